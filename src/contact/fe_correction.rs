//! An approximate compliance of a finite-element body: that of the half-space, made right for a load on one node.
//!
//! Under a load spread over some elements a half-space and finite elements move alike, up to the rigid motion of the
//! contact that comes from the rest of the body; under a load on one node they do not. But on equal elements the
//! difference depends on the offset between the nodes alone, so the response to loads on one node in the middle gives
//! all of it.

use faer::Mat;

use crate::{Error, Result};

/// Adds to the compliance `c` of a half-space on the grid `x` × `y` (m/N, `[3n, 3n]`) what it lacks against
/// `columns`, the responses of the body to unit forces (x, y, n) on the node [`middle`] (m/N, `[3][3n]`). Pairs of
/// nodes farther apart than the middle and the border get the difference at the border. Where the elements differ in
/// size, the difference goes with the inverse of their length. The result is symmetric.
pub fn complete(c: &mut Mat<f64>, x: &[f64], y: &[f64], columns: &[Vec<f64>; 3]) -> Result<()> {
    let (nx, ny) = (x.len(), y.len());
    let n = nx * ny;
    if c.shape() != (3 * n, 3 * n) || columns.iter().any(|v| v.len() != 3 * n) {
        return Err(Error::Defect(format!(
            "compliance of {:?} entries and columns of {} for {n} contact nodes",
            c.shape(),
            columns[2].len()
        )));
    }
    let m = middle(x, y);
    let difference: Vec<Vec<f64>> =
        (0..3).map(|k| columns[k].iter().enumerate().map(|(i, v)| v - c[(i, 3 * m + k)]).collect()).collect();
    // What the rest of the body adds is the same at the border of the grid as in it and does not go with the
    // elements' size.
    let border: Vec<usize> =
        (0..n).filter(|i| i % nx == 0 || i % nx + 1 == nx || i / nx == 0 || i / nx + 1 == ny).collect();
    let bulk: [f64; 3] =
        [0, 1, 2].map(|k| border.iter().map(|&i| difference[k][3 * i + k]).sum::<f64>() / border.len() as f64);
    // Length of the elements around a node.
    let width = |x: &[f64], i: usize| {
        let i = i.clamp(1, x.len() - 2);
        x[i + 1] - x[i - 1]
    };
    let length: Vec<f64> = (0..n).map(|i| (width(x, i % nx) * width(y, i / nx)).sqrt()).collect();
    // The node as far from the middle as i is from j, or the nearest to that.
    let at = |i: usize, j: usize| {
        let along = |i: usize, j: usize, m: usize, n: usize| (m + i).saturating_sub(j).min(n - 1);
        along(i % nx, j % nx, m % nx, nx) + nx * along(i / nx, j / nx, m / nx, ny)
    };
    for j in 0..n {
        for i in 0..=j {
            let scale = length[m] / (length[i] * length[j]).sqrt();
            let (there, back) = (at(i, j), at(j, i));
            for a in 0..3 {
                for b in 0..3 {
                    let rest = if a == b { bulk[a] } else { 0.0 };
                    let near = 0.5 * (difference[b][3 * there + a] + difference[a][3 * back + b]);
                    let d = rest + scale * (near - rest);
                    c[(3 * i + a, 3 * j + b)] += d;
                    if i < j {
                        c[(3 * j + b, 3 * i + a)] += d;
                    }
                }
            }
        }
    }
    Ok(())
}

/// The node in the middle of the grid.
pub fn middle(x: &[f64], y: &[f64]) -> usize {
    x.len() / 2 + x.len() * (y.len() / 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::half_space::HalfSpace;

    /// Another material and a displacement of the whole are made good for: exactly on equal elements as far as the
    /// middle reaches, nearly beyond it and on unequal ones.
    #[test]
    fn one_node_tells_of_all() {
        let [stiff, soft] = [HalfSpace { young: 2e11, poisson: 0.3 }, HalfSpace { young: 1.5e11, poisson: 0.2 }];
        let equal: Vec<f64> = (0..11).map(|i| 1e-3 * f64::from(i)).collect();
        let graded: Vec<f64> = (0..11).map(|i| 1e-3 * (f64::from(i) + 0.03 * f64::from(i * i))).collect();
        for (x, bound) in [(&equal, 1e-12), (&graded, 0.03)] {
            let y = &equal[..7];
            let with_whole = |mut c: Mat<f64>| {
                for j in 0..c.ncols() {
                    for i in (j % 3..c.nrows()).step_by(3) {
                        c[(i, j)] += 3e-9;
                    }
                }
                c
            };
            let wanted = with_whole(soft.compliance(x, y).unwrap());
            let mut c = stiff.compliance(x, y).unwrap();
            let m = middle(x, y);
            let columns = [0, 1, 2].map(|k| (0..wanted.nrows()).map(|i| wanted[(i, 3 * m + k)]).collect());
            complete(&mut c, x, y, &columns).unwrap();
            let own = wanted[(3 * m, 3 * m)];
            let (mut within, mut beyond) = (0.0f64, 0.0f64);
            for j in 0..c.ncols() {
                for i in 0..c.nrows() {
                    let off = (c[(i, j)] - wanted[(i, j)]).abs() / own;
                    let (a, b) = (i / 3, j / 3);
                    let near = (a % 11).abs_diff(b % 11) <= 5 && (a / 11).abs_diff(b / 11) <= 3;
                    let worst = if near { &mut within } else { &mut beyond };
                    *worst = worst.max(off);
                    assert_eq!(c[(i, j)], c[(j, i)]);
                }
            }
            assert!(within < bound && beyond < 0.03, "{within:e} {beyond:e}");
        }
    }

    #[test]
    fn columns_of_another_grid_are_refused() {
        let line = [0.0, 1.0, 2.0];
        let mut c = HalfSpace { young: 1e11, poisson: 0.3 }.compliance(&line, &line).unwrap();
        assert!(complete(&mut c, &line, &line, &[vec![0.0; 27], vec![0.0; 27], vec![0.0; 26]]).is_err());
    }
}
