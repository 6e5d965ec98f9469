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
    /// |P(σ)⁻¹P(λ)x| / |x| with the last shift σ.
    pub correction: f64,
    /// Largest |Y_n u| of the closed nodes over the largest |u|.
    pub constraint: f64,
}

impl System<'_> {
    /// Collective: residuals of pairs (λ in 1/s, x).
    pub fn residuals(&mut self, pairs: &[(C, &[C])]) -> Result<Vec<Residuals>> {
        let mut judged = Vec::new();
        for pairs in pairs.chunks(BLOCK) {
            let (sums, backward): (Vec<Vec<C>>, Vec<f64>) = pairs.iter().map(|(l, x)| self.residual(*l, x)).unzip();
            let mut sums = sums.concat();
            Quadratic::solve(self, &mut sums, pairs.len())?;
            let n = sums.len() / pairs.len();
            for (((_, x), backward_error), y) in pairs.iter().zip(backward).zip(sums.chunks_exact(n)) {
                let correction = self.size(y) / self.size(x);
                let rows = self.motion(x);
                let gap = (0..self.coupling.closed()).map(|i| rows[3 * i + 2].norm()).fold(0.0, f64::max);
                let u = self.world.max(x[..self.pressures()].iter().map(|v| v.norm()).fold(0.0, f64::max));
                judged.push(Residuals { backward_error, correction, constraint: gap / u });
            }
        }
        Ok(judged)
    }

    /// Collective: P(λ)x of the pair (λ in 1/s, x), and its backward error.
    fn residual(&self, lambda: C, x: &[C]) -> (Vec<C>, f64) {
        let scaled = lambda / self.rate;
        let mut sum = vec![C::default(); x.len()];
        let mut y = sum.clone();
        let mut power = C::from(1.0);
        let mut scale = 0.0;
        for (p, norm) in self.norms.into_iter().enumerate() {
            self.product(p, x, &mut y, 1);
            sum.iter_mut().zip(&y).for_each(|(s, y)| *s += power * y);
            scale += power.norm() * norm;
            power *= scaled;
        }
        let backward_error = self.size(&sum) / (scale * self.size(x));
        (sum, backward_error)
    }
}
