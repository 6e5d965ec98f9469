//! Pairs found with a rough inverse, such as a factor in single precision, made those of K and M.
//!
//! With P⁻¹ ≈ (K − σM)⁻¹ = A M⁻¹ the recurrence ends in Ritz vectors of P. In their span K gives the best eigenvalues and what is missing, R = (K − σM)X − MXΛ.
//! Then AX = (X − D)Λ⁻¹ with D = A M⁻¹R, which P⁻¹R is to the digits that P⁻¹ has: D is small, so the images are known to those digits more. They are images
//! of a basis like others, and the recurrence goes on from there with D as the next block, for which P⁻¹ is good enough again.
//!
//! P⁻¹ is worst along the lowest modes, which are in X already. So what D has of X is not taken from it: with XᵀR = 0 it is XᵀMD = −Λ⁻¹RᵀD, of second
//! order, and T = XᵀMAX = Λ⁻¹ + Λ⁻¹RᵀDΛ⁻¹.

use super::block::{columns, combine, gram, subtract};
use super::lanczos::{Lanczos, Ritz, TOLERANCE};
use super::orthonormal::{orthonormalise, Against};
use super::{Pencil, Shifted};
use crate::dense::symmetric_eigen;
use crate::{Error, Result};
use faer::Mat;

/// Pairs beyond the wanted ones are taken along where their residual is below this.
const GUARD: f64 = 1e-2;
/// Parts of a block that matter less than this to every wanted pair are left out.
const NEGLIGIBLE: f64 = 0.05 * TOLERANCE;
/// Residual |Kx − λMx| / (|λ − σ| |Mx|) above which a vector is polished.
const POLISHED: f64 = 1e-8;
/// Columns that are multiplied at once.
const BLOCK: usize = 16;

impl Lanczos<'_> {
    /// Collective: replaces the basis by the `wanted` leading Ritz vectors and those that are nearly as good, with images as K gives them, and the next block by
    /// what these have beyond.
    pub fn refine(&mut self, ritz: &Ritz, wanted: usize) -> Result<()> {
        let (n, world) = (self.n, self.pencil.world());
        let guards = ritz.residual.iter().skip(wanted).take_while(|r| **r <= GUARD).count();
        let m = (wanted + guards).min(ritz.theta.len());
        combine(&mut self.basis[..self.done * n], n, ritz.vectors.subcols(0, m));
        self.basis.truncate(m * n);
        self.mass = Vec::new();
        let mut r = self.by_stiffness(m)?;
        let theta = std::mem::take(&mut r.1);
        let r = r.0;
        let mut d = r.clone();
        self.shifted.solve(&mut d, m)?;
        self.solves += m;
        let inner = gram(world, columns(&r, n, m), columns(&d, n, m));
        drop(r);
        self.t = Mat::from_fn(m, m, |i, j| {
            let second = 0.5 * theta[i] * (inner[(i, j)] + inner[(j, i)]) * theta[j];
            if i == j { theta[i] + second } else { second }
        });
        self.done = m;
        let against = Against { deflated: self.deflated, basis: columns(&self.basis, n, m) };
        let mut mass = vec![0.0; n * m];
        self.pencil.mass(&d, &mut mass, m);
        let before_norm: Vec<f64> = { let g = gram(world, columns(&d, n, m), columns(&mass, n, m)); (0..m).map(|i| g[(i, i)]).collect() };
        against.take(world, &mut d, &mass, m);
        self.pencil.mass(&d, &mut mass, m);
        // Columns that depend on each other, as those of one block before, become as many as there are.
        let products = gram(world, columns(&d, n, m), columns(&mass, n, m));
        let (kept, sizes) = leading(&products)?;
        if std::env::var_os("DEBUG").is_some() && world.is_root() {
            let full = (0..m).map(|i| inner[(i, i)] * theta[i]).collect::<Vec<f64>>();
            eprintln!("refine m {m} wanted {wanted} solves {} rank {} sizes {:.1e} {:.1e}", self.solves, sizes.len(), sizes[0], sizes[sizes.len()-1]);
            for i in (0..m).step_by(6) { eprintln!("{i} residual {:.1e} own {:.1e} D {:.1e} second {:.1e}", ritz.residual[i], before_norm[i].sqrt(), products[(i,i)].sqrt(), full[i]); }
        }
        let parts = Mat::from_fn(m, sizes.len(), |i, j| kept[(i, j)] / sizes[j]);
        combine(&mut d, n, parts.as_ref());
        d.truncate(n * sizes.len());
        mass.truncate(n * sizes.len());
        let new = orthonormalise(self.pencil, &against, &mut d, &mut mass, &vec![1.0; sizes.len()]);
        let before = Mat::from_fn(sizes.len(), m, |i, j| -sizes[i] * kept[(j, i)] * theta[j]);
        self.beyond = Mat::zeros(0, m);
        self.follow(&d, &mass, &new.factors * before);
        Ok(())
    }

    /// Collective: turns the `m` columns of the basis to the Ritz vectors of K − σM; returns their residuals, `[n, m]`, and θ.
    fn by_stiffness(&mut self, m: usize) -> Result<(Vec<f64>, Vec<f64>)> {
        let (n, world, sigma) = (self.n, self.pencil.world(), self.shifted.sigma());
        let mut k = vec![0.0; n * m];
        for first in (0..m).step_by(BLOCK) {
            let part = first * n..(first + BLOCK.min(m - first)) * n;
            self.pencil.stiffness(&self.basis[part.clone()], &mut k[part], BLOCK.min(m - first));
        }
        let inner = gram(world, columns(&self.basis, n, m), columns(&k, n, m));
        let inner = Mat::from_fn(m, m, |i, j| 0.5 * (inner[(i, j)] + inner[(j, i)]));
        let failed = || Error::NotConverged(format!("eigenvalues of the projected stiffness of order {m}"));
        let (values, vectors) = symmetric_eigen(inner.as_ref()).ok_or_else(failed)?;
        let theta = |i: usize| 1.0 / (values[i] - sigma);
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|&a, &b| theta(b).abs().total_cmp(&theta(a).abs()));
        let turn = Mat::from_fn(m, m, |i, j| vectors[(i, order[j])]);
        combine(&mut self.basis, n, turn.as_ref());
        combine(&mut k, n, turn.as_ref());
        let mut mass = vec![0.0; n * BLOCK];
        for first in (0..m).step_by(BLOCK) {
            let width = BLOCK.min(m - first);
            self.pencil.mass(&self.basis[first * n..(first + width) * n], &mut mass[..width * n], width);
            for j in 0..width {
                let lambda = values[order[first + j]];
                let column = &mut k[(first + j) * n..(first + j + 1) * n];
                column.iter_mut().zip(&mass[j * n..(j + 1) * n]).for_each(|(k, m)| *k -= lambda * m);
            }
        }
        Ok((k, order.into_iter().map(theta).collect()))
    }

    /// Reduces the next block to what matters to the `wanted` leading pairs that have not converged.
    pub fn narrow(&mut self, ritz: &Ritz, wanted: usize) -> Result<()> {
        let (n, last, size, width) = (self.n, self.beyond.ncols(), self.done, self.width());
        let open: Vec<usize> = (0..wanted.saturating_sub(self.locked.len()).min(ritz.theta.len()))
            .filter(|&i| ritz.residual[i] > self.tolerance)
            .collect();
        let rest = &self.beyond * ritz.vectors.subrows(size - last, last);
        let rest = Mat::from_fn(width, open.len(), |i, j| rest[(i, open[j])] / ritz.theta[open[j]]);
        let (kept, sizes) = leading(&(&rest * rest.transpose()))?;
        let turn = kept.subcols(0, sizes.len());
        if std::env::var_os("DEBUG").is_some() { eprintln!("narrow open {} width {width} to {} solves {} largest {:.1e}", open.len(), sizes.len(), self.solves, open.iter().map(|&i| ritz.residual[i]).fold(0.0, f64::max)); }
        let next = (self.locked.len() + size) * n;
        combine(&mut self.basis[next..], n, turn);
        self.basis.truncate(next + sizes.len() * n);
        let mut mass = std::mem::take(&mut self.mass);
        combine(&mut mass, n, turn);
        mass.truncate(sizes.len() * n);
        let block = self.basis.split_off(next);
        let beyond = turn.transpose() * &self.beyond;
        self.t.resize_with(size, size, |_, _| 0.0);
        self.beyond = Mat::zeros(0, last);
        self.follow(&block, &mass, beyond);
        Ok(())
    }
}

/// Collective: takes off the vectors of the pairs `lambda`, `[n_local, lambda.len()]`, which are orthonormal in the mass, what a rough inverse left of high
/// frequencies: rounding that its solutions have beside their size, which K enlarges. The vectors stay orthonormal.
pub(super) fn polish(
    pencil: &dyn Pencil,
    shifted: &mut dyn Shifted,
    lambda: &[f64],
    vectors: &mut [f64],
) -> Result<usize> {
    let (world, n, sigma, count) = (pencil.world(), pencil.n_local(), shifted.sigma(), lambda.len());
    let (mut d, mut which) = (Vec::new(), Vec::new());
    let (mut k, mut mass) = (vec![0.0; n * BLOCK], vec![0.0; n * BLOCK]);
    for first in (0..count).step_by(BLOCK) {
        let width = BLOCK.min(count - first);
        let x = &vectors[first * n..(first + width) * n];
        pencil.stiffness(x, &mut k[..width * n], width);
        pencil.mass(x, &mut mass[..width * n], width);
        let mut sums = Vec::with_capacity(2 * width);
        for j in 0..width {
            let (k, m) = (&mut k[j * n..(j + 1) * n], &mass[j * n..(j + 1) * n]);
            k.iter_mut().zip(m).for_each(|(k, m)| *k -= lambda[first + j] * m);
            sums.extend([k.iter().map(|r| r * r).sum::<f64>(), m.iter().map(|m| m * m).sum()]);
        }
        let sums = world.sum_all(&sums);
        for j in 0..width {
            let residual = (sums[2 * j] / sums[2 * j + 1]).sqrt() / (lambda[first + j] - sigma).abs();
            if std::env::var_os("DEBUG").is_some() && world.is_root() { eprint!("{residual:.0e} "); }
            if residual > POLISHED {
                which.push(first + j);
                d.extend_from_slice(&k[j * n..(j + 1) * n]);
            }
        }
    }
    drop((k, mass));
    if which.is_empty() {
        return Ok(0);
    }
    shifted.solve(&mut d, which.len())?;
    let mut mass = vec![0.0; d.len()];
    pencil.mass(&d, &mut mass, which.len());
    let own = gram(world, columns(vectors, n, count), columns(&mass, n, which.len()));
    subtract(&mut d, columns(vectors, n, count), own.as_ref());
    for (j, &i) in which.iter().enumerate() {
        vectors[i * n..(i + 1) * n].iter_mut().zip(&d[j * n..(j + 1) * n]).for_each(|(x, d)| *x -= d);
    }
    Ok(which.len())
}

/// The eigenvectors of a Gram matrix with lengths above [`NEGLIGIBLE`], the longest first, and the lengths.
fn leading(products: &Mat<f64>) -> Result<(Mat<f64>, Vec<f64>)> {
    let m = products.nrows();
    let even = Mat::from_fn(m, m, |i, j| 0.5 * (products[(i, j)] + products[(j, i)]));
    let failed = || Error::NotConverged(format!("eigenvalues of a Gram matrix of order {m}"));
    let (values, vectors) = symmetric_eigen(even.as_ref()).ok_or_else(failed)?;
    let length = |i: usize| values[i].max(0.0).sqrt();
    let mut order: Vec<usize> = (0..m).filter(|&i| length(i) > NEGLIGIBLE).collect();
    order.sort_by(|&a, &b| length(b).total_cmp(&length(a)));
    let kept = Mat::from_fn(m, order.len(), |i, j| vectors[(i, order[j])]);
    Ok((kept, order.into_iter().map(length).collect()))
}
