//! Distributed matrices as dense ones, for references that are solved whole.

use faer::Mat;
use railsqueal::parallel::World;
use railsqueal::petsc::csr::DistCsr;

/// Collective: the matrix on every rank.
pub fn dense(world: &World, a: &DistCsr) -> Mat<f64> {
    let n = a.order() as usize;
    let (a, first) = (a.full(), a.ranges[world.rank] as usize);
    let mut values = vec![0.0; n * n];
    for i in 0..a.n_local() {
        for (&c, &v) in a.row(i).0.iter().zip(a.row(i).1) {
            values[(first + i) * n + c as usize] = v;
        }
    }
    let values = world.sum_all(&values);
    Mat::from_fn(n, n, |i, j| values[i * n + j])
}
