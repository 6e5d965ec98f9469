//! Pairs put in order, normalised and judged on residuals and products of their own, whoever found them.

use super::block::{columns, gram};
use super::Pencil;
use crate::{Error, Result};

/// Eigenpairs in ascending order of λ. There may be more than were asked for.
#[derive(Debug, Clone, Default)]
pub struct FoundModes {
    /// Eigenvalues.
    pub lambda: Vec<f64>,
    /// Local rows of each eigenvector, normalised to xᵀMx = 1.
    pub vectors: Vec<Vec<f64>>,
    /// |Kx − λMx| / (|λ − σ| |Mx|) of each.
    pub residuals: Vec<f64>,
    /// Restarts of the method.
    pub iterations: usize,
    /// Right-hand sides solved.
    pub solves: usize,
}

/// Largest residual of an accepted eigenpair. The eigenvalue's relative error is of the order of its square.
const RESIDUAL_LIMIT: f64 = 1e-6;

/// Largest |xᵢᵀMxⱼ| of an accepted set.
const ORTHOGONALITY_LIMIT: f64 = 1e-8;

/// Columns that are multiplied at once.
const BLOCK: usize = 16;

/// Collective: the eigenvalues `lambda` found about the shift `sigma`, with eigenvectors `vectors`, `[n_local,
/// lambda.len()]`, in order and normalised; an error where a residual or a product of two is too large.
pub(crate) fn checked(pencil: &dyn Pencil, sigma: f64, lambda: &[f64], vectors: Vec<f64>) -> Result<FoundModes> {
    let (world, n, count) = (pencil.world(), pencil.n_local(), lambda.len());
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| lambda[a].total_cmp(&lambda[b]));
    let mut modes = FoundModes { lambda: order.iter().map(|&i| lambda[i]).collect(), ..FoundModes::default() };
    let mut residuals = vec![0.0; count];
    let mut lengths = vec![0.0; count];
    let mut skew = vec![0.0f64; count];
    let (mut kx, mut mx) = (vec![0.0; n * BLOCK], vec![0.0; n * BLOCK]);
    for first in (0..count).step_by(BLOCK) {
        let width = BLOCK.min(count - first);
        let x = &vectors[first * n..(first + width) * n];
        let (kx, mx) = (&mut kx[..width * n], &mut mx[..width * n]);
        pencil.mass(x, mx, width);
        pencil.stiffness(x, kx, width);
        let products = gram(world, columns(&vectors, n, count), columns(mx, n, width));
        let mut sums = Vec::with_capacity(2 * width);
        for j in 0..width {
            let (k, m) = (&kx[j * n..(j + 1) * n], &mx[j * n..(j + 1) * n]);
            sums.push(k.iter().zip(m).map(|(k, m)| (k - lambda[first + j] * m).powi(2)).sum::<f64>());
            sums.push(m.iter().map(|m| m * m).sum());
        }
        let sums = world.sum_all(&sums);
        for j in 0..width {
            lengths[first + j] = products[(first + j, j)].sqrt();
            let size = (lambda[first + j] - sigma).abs() * sums[2 * j + 1].sqrt();
            residuals[first + j] = sums[2 * j].sqrt() / size;
            let others = (0..count).filter(|i| *i != first + j);
            skew[first + j] = others.map(|i| products[(i, j)].abs()).fold(0.0, f64::max);
        }
    }
    for &i in &order {
        let (residual, skew) = (residuals[i], skew[i] / lengths[i]);
        let good = residual <= RESIDUAL_LIMIT && skew <= ORTHOGONALITY_LIMIT;
        if !good {
            return Err(Error::NotConverged(format!(
                "eigenvalue {:e} counts as converged, but its residual is {residual:.1e} (limit \
                 {RESIDUAL_LIMIT:.0e}) and its \
                 product with another mode {skew:.1e} (limit {ORTHOGONALITY_LIMIT:.0e})",
                lambda[i]
            )));
        }
        modes.residuals.push(residual);
        modes.vectors.push(vectors[i * n..(i + 1) * n].iter().map(|v| v / lengths[i]).collect());
    }
    Ok(modes)
}
