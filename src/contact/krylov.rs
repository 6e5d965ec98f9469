//! Right-preconditioned GMRES (Y. Saad and M. H. Schultz, SIAM J. Sci. Stat. Comput. 7 (1986)) for the small dense
//! systems of contact, without restarts. It also returns the operator's images, so that no product is spent on what
//! is known already.

use crate::dense::dot;

/// Result of [`gmres`].
pub(crate) struct GmresResult {
    /// Solution.
    pub x: Vec<f64>,
    /// Image of the solution as `apply` returned it beside the residual rows (see there).
    pub image: Vec<f64>,
    /// Norm of the last residual relative to the right-hand side.
    pub relative: f64,
    /// Products spent.
    pub products: usize,
}

/// Solves A x = b from zero to ‖b − A x‖ ≤ tolerance·‖b‖ or `limit` products. `precondition` maps a vector to an
/// approximate solution; `apply` returns (A v, image of v), the image being any linear function of v that the caller
/// wants of x as well.
pub(crate) fn gmres(
    b: &[f64],
    tolerance: f64,
    limit: usize,
    mut precondition: impl FnMut(&[f64]) -> Vec<f64>,
    mut apply: impl FnMut(&[f64]) -> (Vec<f64>, Vec<f64>),
) -> GmresResult {
    let norm_b = dot(b, b).sqrt();
    if norm_b == 0.0 {
        let (_, image) = apply(b);
        return GmresResult { x: b.to_vec(), image, relative: 0.0, products: 1 };
    }
    let mut basis = vec![b.iter().map(|v| v / norm_b).collect::<Vec<f64>>()];
    let (mut directions, mut images) = (Vec::<Vec<f64>>::new(), Vec::<Vec<f64>>::new());
    // Upper triangle after the Givens rotations, column by column; g: the rotated right-hand side.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut g = vec![norm_b];
    let mut relative = 1.0;
    while columns.len() < limit && relative > tolerance {
        let k = columns.len();
        let z = precondition(&basis[k]);
        let (mut v, image) = apply(&z);
        directions.push(z);
        images.push(image);
        let before = dot(&v, &v).sqrt();
        let mut h = vec![0.0; k + 1];
        // Gram–Schmidt twice is enough to keep the basis orthogonal.
        for _ in 0..2 {
            for (hj, q) in h.iter_mut().zip(&basis) {
                let d = dot(q, &v);
                *hj += d;
                v.iter_mut().zip(q).for_each(|(a, b)| *a -= d * b);
            }
        }
        let last = dot(&v, &v).sqrt();
        for (j, &(c, s)) in rotations.iter().enumerate() {
            let (a, b) = (h[j], h[j + 1]);
            (h[j], h[j + 1]) = (c * a + s * b, c * b - s * a);
        }
        let r = h[k].hypot(last);
        if !r.is_finite() || r <= 1e-300 {
            directions.pop();
            images.pop();
            break;
        }
        let (c, s) = (h[k] / r, last / r);
        h[k] = r;
        rotations.push((c, s));
        columns.push(h);
        let gk = g[k];
        g[k] = c * gk;
        g.push(-s * gk);
        relative = g[k + 1].abs() / norm_b;
        if last <= 1e-14 * before {
            break;
        }
        v.iter_mut().for_each(|a| *a /= last);
        basis.push(v);
    }
    let k = columns.len();
    let mut y = g[..k].to_vec();
    for j in (0..k).rev() {
        y[j] /= columns[j][j];
        let yj = y[j];
        for i in 0..j {
            y[i] -= columns[j][i] * yj;
        }
    }
    let combine = |vectors: &[Vec<f64>], len: usize| {
        let mut out = vec![0.0; len];
        for (v, c) in vectors.iter().zip(&y) {
            out.iter_mut().zip(v).for_each(|(o, a)| *o += c * a);
        }
        out
    };
    let x = combine(&directions, b.len());
    let image = combine(&images, images.first().map_or(0, Vec::len));
    GmresResult { x, image, relative, products: k }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A nonsymmetric system whose solution is known; with the exact inverse of the diagonal as preconditioner.
    #[test]
    fn solves_a_nonsymmetric_system_and_returns_the_image() {
        let n = 40;
        let a = |i: usize, j: usize| {
            if i == j {
                4.0 + i as f64
            } else if j > i {
                1.0 / (1 + j - i) as f64
            } else {
                -0.3 / (1 + i - j) as f64
            }
        };
        let times = |v: &[f64]| -> Vec<f64> { (0..n).map(|i| (0..n).map(|j| a(i, j) * v[j]).sum()).collect() };
        let want: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
        let b = times(&want);
        let s = gmres(
            &b,
            1e-12,
            n,
            |r| r.iter().enumerate().map(|(i, v)| v / a(i, i)).collect(),
            |v| (times(v), v.iter().map(|x| 2.0 * x).collect()),
        );
        for (i, want) in want.iter().enumerate() {
            assert!((s.x[i] - want).abs() < 1e-10, "component {i}: {} against {want}", s.x[i]);
            assert!((s.image[i] - 2.0 * want).abs() < 1e-10, "image {i}: {}", s.image[i]);
        }
        assert!(s.products < n, "{} products", s.products);
    }
}
