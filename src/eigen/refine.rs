//! Pairs found with a rough inverse, such as a factor in single precision, made those of K and M.
//!
//! With P⁻¹ ≈ (K − σM)⁻¹ the vector x − d, d = P⁻¹(K − λM)x, is what one step of inverse iteration makes of x, but for the error of P⁻¹ in the small
//! correction d alone. That takes off high frequencies, of which rounding leaves most. What x has of modes just above the wanted ones is in d as well:
//! the best pairs in the span of all vectors and corrections follow by the method of Rayleigh and Ritz.

use super::block::{columns, combine, gram};
use super::{Pencil, Shifted};
use crate::dense::symmetric_eigen;
use crate::{Error, Result};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, Par};

/// Residual |Kx − λMx| / (|λ − σ| |Mx|) above which a vector is corrected.
const CORRECTED: f64 = 5e-8;
/// Rounds of corrections at the most.
const ROUNDS: usize = 4;
/// Part of a correction's energy that must be its own, not that of columns before it.
const OWN: f64 = 1e-8;
/// Columns that are multiplied and solved at once.
const BLOCK: usize = 16;

/// Collective: makes the pairs `lambda` with `vectors`, `[n_local, lambda.len()]`, those of K and M. K − σM must be positive definite. Returns how many
/// right-hand sides it took.
pub(super) fn refine(
    pencil: &dyn Pencil,
    shifted: &mut dyn Shifted,
    lambda: &mut Vec<f64>,
    vectors: &mut Vec<f64>,
) -> Result<usize> {
    let mut solves = 0;
    for round in 0..ROUNDS {
        let corrected = correct(pencil, shifted, lambda, vectors)?;
        // The eigenvalues before the first round are those of the rough inverse, whatever the residuals are.
        if corrected == 0 && round > 0 {
            break;
        }
        solves += corrected;
        // Corrections bring high frequencies back, which later rounds take off.
        let more = if round == 0 { corrected } else { 0 };
        vectors.truncate(pencil.n_local() * (lambda.len() + more));
        *lambda = rayleigh_ritz(pencil, shifted.sigma(), vectors, lambda.len(), more)?;
    }
    Ok(solves)
}

/// Collective: corrects the vectors whose residuals are not small and puts the corrections behind them; returns how many.
fn correct(pencil: &dyn Pencil, shifted: &mut dyn Shifted, lambda: &[f64], vectors: &mut Vec<f64>) -> Result<usize> {
    let (world, n, count) = (pencil.world(), pencil.n_local(), lambda.len());
    let (mut residual, mut mass) = (vec![0.0; n * BLOCK], vec![0.0; n * BLOCK]);
    let mut corrected = 0;
    for first in (0..count).step_by(BLOCK) {
        let width = BLOCK.min(count - first);
        let x = &vectors[first * n..(first + width) * n];
        pencil.stiffness(x, &mut residual[..width * n], width);
        pencil.mass(x, &mut mass[..width * n], width);
        let mut sums = Vec::with_capacity(2 * width);
        for j in 0..width {
            let (r, m) = (&mut residual[j * n..(j + 1) * n], &mass[j * n..(j + 1) * n]);
            r.iter_mut().zip(m).for_each(|(r, m)| *r -= lambda[first + j] * m);
            sums.extend([r.iter().map(|r| r * r).sum::<f64>(), m.iter().map(|m| m * m).sum()]);
        }
        let sums = world.sum_all(&sums);
        let size = |j: usize| (sums[2 * j] / sums[2 * j + 1]).sqrt() / (lambda[first + j] - shifted.sigma()).abs();
        let open: Vec<usize> = (0..width).filter(|&j| size(j) > CORRECTED).collect();
        for (to, &from) in open.iter().enumerate() {
            residual.copy_within(from * n..(from + 1) * n, to * n);
        }
        let d = &mut residual[..open.len() * n];
        shifted.solve(d, open.len())?;
        for (from, &to) in open.iter().enumerate() {
            let x = &mut vectors[(first + to) * n..(first + to + 1) * n];
            x.iter_mut().zip(&d[from * n..(from + 1) * n]).for_each(|(x, d)| *x -= d);
        }
        vectors.reserve_exact(d.len());
        vectors.extend_from_slice(d);
        corrected += open.len();
    }
    Ok(corrected)
}

/// Collective: replaces `count` vectors with `more` behind them, `[n_local, count + more]`, by the `count` best Ritz vectors of K and M in their span,
/// orthonormal in M; returns their λ. Those are found from the inverse, whose largest eigenvalues rounding leaves alone, whatever frequencies are in `more`.
fn rayleigh_ritz(
    pencil: &dyn Pencil,
    sigma: f64,
    vectors: &mut Vec<f64>,
    count: usize,
    more: usize,
) -> Result<Vec<f64>> {
    let (n, all) = (pencil.n_local(), count + more);
    let (energy, mass) = projected(pencil, sigma, vectors, all);
    let failed = || Error::NotConverged(format!("Ritz values of {count} vectors"));
    let scale: Vec<f64> = (0..all).map(|i| energy[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip()).collect();
    let even = |a: &Mat<f64>, i: usize, j: usize| 0.5 * scale[i] * (a[(i, j)] + a[(j, i)]) * scale[j];
    let (kept, factor) = independent(&Mat::from_fn(all, all, |i, j| even(&energy, i, j)));
    let size = kept.len();
    let mut inverse = Mat::<f64>::identity(size, size);
    solve_lower_triangular_in_place(factor.as_ref(), inverse.as_mut(), Par::Seq);
    let mass = Mat::from_fn(size, size, |i, j| even(&mass, kept[i], kept[j]));
    let (theta, turn) = symmetric_eigen((&inverse * mass * inverse.transpose()).as_ref()).ok_or_else(failed)?;
    let mut order: Vec<usize> = (0..size).filter(|&i| theta[i] > 0.0).collect();
    order.sort_by(|&a, &b| theta[b].total_cmp(&theta[a]));
    order.truncate(count);
    if order.len() < count {
        return Err(failed());
    }
    let turn = inverse.transpose() * Mat::from_fn(size, count, |i, j| turn[(i, order[j])] / theta[order[j]].sqrt());
    let mut whole = Mat::<f64>::zeros(all, count);
    for (i, &at) in kept.iter().enumerate() {
        (0..count).for_each(|j| whole[(at, j)] = scale[at] * turn[(i, j)]);
    }
    combine(vectors, n, whole.as_ref());
    vectors.truncate(n * count);
    Ok(order.into_iter().map(|i| sigma + 1.0 / theta[i]).collect())
}

/// Collective: Vᵀ(K − σM)V and VᵀMV of `count` vectors V.
fn projected(pencil: &dyn Pencil, sigma: f64, vectors: &[f64], count: usize) -> (Mat<f64>, Mat<f64>) {
    let (world, n) = (pencil.world(), pencil.n_local());
    let all = columns(vectors, n, count);
    let mut image = vec![0.0; n * BLOCK.min(count)];
    let (mut energy, mut mass) = (Mat::zeros(count, count), Mat::zeros(count, count));
    for first in (0..count).step_by(BLOCK) {
        let width = BLOCK.min(count - first);
        let (x, image) = (&vectors[first * n..(first + width) * n], &mut image[..width * n]);
        pencil.stiffness(x, image, width);
        energy.subcols_mut(first, width).copy_from(gram(world, all, columns(image, n, width)));
        pencil.mass(x, image, width);
        mass.subcols_mut(first, width).copy_from(gram(world, all, columns(image, n, width)));
    }
    energy -= faer::Scale(sigma) * &mass;
    (energy, mass)
}

/// Columns of a Gram matrix with unit diagonal that do not depend on those before them, and their Cholesky factor.
fn independent(products: &Mat<f64>) -> (Vec<usize>, Mat<f64>) {
    let all = products.nrows();
    let mut kept: Vec<usize> = Vec::with_capacity(all);
    let mut factor = Mat::<f64>::zeros(all, all);
    for i in 0..all {
        let row = kept.len();
        for (j, &at) in kept.iter().enumerate() {
            let before: f64 = (0..j).map(|l| factor[(row, l)] * factor[(j, l)]).sum();
            factor[(row, j)] = (products[(i, at)] - before) / factor[(j, j)];
        }
        let own = products[(i, i)] - (0..row).map(|l| factor[(row, l)].powi(2)).sum::<f64>();
        if own > OWN {
            factor[(row, row)] = own.sqrt();
            kept.push(i);
        }
    }
    let size = kept.len();
    (kept, factor.subrows(0, size).subcols(0, size).to_owned())
}
