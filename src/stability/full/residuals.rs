//! How well eigenpairs satisfy the equations.

use super::system::System;
use crate::eigen::quadratic::{Quadratic, BLOCK};
use crate::Result;
use num_complex::Complex;

type C = Complex<f64>;

/// Residuals of an eigenpair.
#[derive(Debug, Clone, Copy)]
pub struct Residuals {
    /// |P(λ)x| / ((|λ|²‖M‖ + |λ|‖C‖ + ‖K‖) |x|) (Tisseur, Linear Algebra Appl. 309, 2000).
    pub backward_error: f64,
    /// |P(σ)⁻¹P(λ)x| / |x| with the last shift σ; where solutions are not corrected, that of the problem with the
    /// rotation that the modes see.
    pub correction: f64,
    /// Largest |Y_n u| of the closed nodes over the largest |u|.
    pub constraint: f64,
}

/// The residuals of a pair, and what one more inverse iteration changes.
pub(super) struct PairResiduals {
    pub residuals: Residuals,
    /// Local rows of P(σ)⁻¹P(λ)x.
    pub change: Vec<C>,
}

impl System<'_> {
    /// Collective: residuals of pairs (λ in 1/s, x).
    pub fn residuals(&mut self, pairs: &[(C, &[C])]) -> Result<Vec<Residuals>> {
        let mut all = Vec::new();
        for pairs in pairs.chunks(BLOCK) {
            let values: Vec<C> = pairs.iter().map(|p| p.0).collect();
            let vectors = pairs.iter().map(|p| p.1).collect::<Vec<_>>().concat();
            let rest = self.apply(&values, &vectors)?;
            all.extend(self.judge(&values, &vectors, rest)?.into_iter().map(|j| j.residuals));
        }
        Ok(all)
    }

    /// Collective: P(λ)x of pairs (λ in 1/s; x one behind the other).
    pub(super) fn apply(&mut self, values: &[C], vectors: &[C]) -> Result<Vec<C>> {
        let n = vectors.len() / values.len().max(1);
        let [mut sum, damped, inertia] = self.images(vectors, values.len())?;
        let moving = damped.chunks_exact(n).zip(inertia.chunks_exact(n));
        for ((sum, (damped, inertia)), value) in sum.chunks_exact_mut(n).zip(moving).zip(values) {
            let scaled = value / self.rate;
            let terms = damped.iter().zip(inertia).map(|(c, m)| scaled * (c + scaled * m));
            sum.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
        }
        Ok(sum)
    }

    /// Collective: how good pairs (λ in 1/s; x one behind the other) are of which P(λ)x is the `rest`.
    pub(super) fn judge(&mut self, values: &[C], vectors: &[C], rest: Vec<C>) -> Result<Vec<PairResiduals>> {
        let n = vectors.len() / values.len().max(1);
        let left: Vec<f64> = rest.chunks_exact(n).map(|r| self.size(r)).collect();
        let mut changes = rest;
        self.solve_whole(&mut changes, values.len(), false)?;
        let judge = |(i, left): (usize, f64)| {
            let [x, change] = [vectors, &changes].map(|all| &all[i * n..(i + 1) * n]);
            let value = values[i];
            let power = value.norm() / self.rate;
            let [k, c, m] = self.norms;
            let size = self.size(x);
            let rows = self.motion(x);
            let gap = (0..self.coupling.closed()).map(|i| rows[3 * i + 2].norm()).fold(0.0, f64::max);
            let u = self.world.max(x[..self.pressures()].iter().map(|v| v.norm()).fold(0.0, f64::max));
            let residuals = Residuals {
                backward_error: left / ((k + power * c + power * power * m) * size),
                correction: self.size(change) / size,
                constraint: gap / u,
            };
            PairResiduals { residuals, change: change.to_vec() }
        };
        Ok(left.into_iter().enumerate().map(judge).collect())
    }
}
