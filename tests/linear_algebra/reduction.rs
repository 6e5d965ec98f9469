//! Reduction of bodies given by matrices, densely and by distributed factorisations, against chains in closed form.

use crate::Check;
use railsqueal::body::matrices::{reduce, BodyMatrices, Reduced};
use railsqueal::body::matrix_market::Csr;
use railsqueal::body::modes::Extent;
use railsqueal::eigen::sparse::Method;
use railsqueal::parallel::World;
use railsqueal::petsc::Petsc;
use std::f64::consts::PI;

pub const CHECKS: &[Check] = &[
    ("a free chain is reduced to its modes and its compliance without rigid-body motion", free),
    ("a chain between walls is reduced to its modes and its inverse", walls),
];

/// Degrees of freedom of the orders that are reduced densely and sparsely.
const ORDERS: [usize; 2] = [300, 1500];

/// A chain of unit masses and springs of 1 N/m, free or between walls, with proportional and other damping. Contact 1
/// has the first mass as its normal and mass 11, turned round, along x; contact 2 the last mass as its normal.
fn chain(n: usize, free: bool) -> BodyMatrices {
    let end = |i: usize| if free && (i == 0 || i == n - 1) { 1.0 } else { 2.0 };
    let k = (0..n).map(|i| (i, i, end(i)));
    let k = k.chain((1..n).flat_map(|i| [(i, i - 1, -1.0), (i - 1, i, -1.0)])).collect();
    let stiffness = Csr::from_entries(n, k);
    let mass = Csr::from_entries(n, (0..n).map(|i| (i, i, 1.0)).collect());
    // A dashpot on the first mass alone couples the modes.
    let damping = Csr::from_entries(n, vec![(0, 0, 0.5)]);
    let contacts = vec![[vec![(10, -1.0)], vec![], vec![(0, 1.0)]], [vec![], vec![], vec![(n - 1, 1.0)]]];
    BodyMatrices { mass, damping: Some(damping), stiffness, contacts }
}

fn reduced(world: &World, m: &BodyMatrices, count: usize) -> Option<Reduced> {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let given = world.is_root().then_some(m);
    reduce(&petsc, "lower", given, Extent::Count(count), Method::Blocks, &mut |_, _| ()).unwrap()
}

/// Rows of the contacts in the chain: (row of the body, mass, sign).
fn rows(n: usize) -> [(usize, usize, f64); 3] {
    [(0, 10, -1.0), (2, 0, 1.0), (5, n - 1, 1.0)]
}

fn near(got: f64, want: f64, scale: f64, what: &str) {
    assert!((got - want).abs() <= scale, "{what}: {got:.12e}, expected {want:.12e} within {scale:.1e}");
}

fn free(world: &World) {
    for n in ORDERS {
        let m = chain(n, true);
        let Some(r) = reduced(world, &m, 8) else { continue };
        let shape = |k: usize, i: usize| match k {
            0 => (1.0 / n as f64).sqrt(),
            _ => (2.0 / n as f64).sqrt() * (k as f64 * PI * (i as f64 + 0.5) / n as f64).cos(),
        };
        let omega = |k: usize| 2.0 * (k as f64 * PI / (2 * n) as f64).sin();
        assert_eq!(r.modes.omega[0], 0.0, "rigid-body motion");
        for k in 1..8 {
            near(r.modes.omega[k], omega(k), 1e-8 * omega(k), "frequency");
        }
        let rows_of = r.modes.rows.as_ref().unwrap();
        let c = |i: usize, j: usize| (1..n).map(|k| shape(k, i) * shape(k, j) / omega(k).powi(2)).sum::<f64>();
        for (a, i, s) in rows(n) {
            for (b, j, t) in rows(n) {
                // Rigid-body motion is taken off a matrix 400 times as large.
                near(r.compliance[(a, b)], s * t * c(i, j), 1e-7 * c(0, 0), &format!("order {n}, rows {a}, {b}"));
            }
            for k in 0..8 {
                let want = shape(k, i) * shape(k, 0) * s;
                near(rows_of[(a, k)] * rows_of[(2, k)], want, 1e-8, "mode shape");
            }
        }
        assert!((0..6).all(|b| r.compliance[(1, b)] == 0.0), "a direction without motion has no compliance");
        let damping = r.modes.damping.unwrap();
        for (j, k) in [(0, 0), (1, 1), (2, 5)] {
            near(damping[(j, k)].abs(), (0.5 * shape(j, 0) * shape(k, 0)).abs(), 1e-9, "modal damping");
        }
    }
}

fn walls(world: &World) {
    for n in ORDERS {
        let m = chain(n, false);
        let Some(r) = reduced(world, &m, 5) else { continue };
        for (k, w) in r.modes.omega.iter().enumerate() {
            let exact = 2.0 * ((k + 1) as f64 * PI / (2 * (n + 1)) as f64).sin();
            near(*w, exact, 1e-9 * exact, "frequency");
        }
        let inverse = |i: usize, j: usize| (i.min(j) + 1) as f64 * (n - i.max(j)) as f64 / (n + 1) as f64;
        for (a, i, s) in rows(n) {
            for (b, j, t) in rows(n) {
                near(r.compliance[(a, b)], s * t * inverse(i, j), 1e-9 * inverse(10, 10), "compliance");
            }
        }
    }
}
