//! Least squares by Levenberg and Marquardt's method.
//!
//! The sum Σ r_i(θ)² is least where Jᵀr = 0, J = ∂r/∂θ. Beside θ the residuals are r + Jδ, and those of least squares
//! have (JᵀJ + λD)δ = −Jᵀr with D = diag(JᵀJ): Gauss and Newton's step for λ = 0, a short one down the slope for a
//! large λ. λ falls where a step makes the sum smaller and grows where it does not (D. W. Marquardt, J. SIAM 11 (1963),
//! 431–441).

use crate::dense::symmetric_eigen;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;

/// Most evaluations.
const EVALUATIONS: usize = 60;
/// λ at the beginning, its factors behind good steps and bad ones, and the largest.
const DAMPING: f64 = 1e-3;
const EASED: f64 = 0.1;
const HELD: f64 = 5.0;
const STIFFEST: f64 = 1e8;
/// Reduction of the sum, in s², the variance of the residuals, that is no more worth a step: the parameters are then
/// within 3 % of their standard deviations of the minimum. It counts where λ is below one, that is, for steps that
/// damping hardly shortens.
const REACHED: f64 = 1e-3;
const FREE: f64 = 1.0;
/// Longest step of a parameter.
const LONGEST: f64 = 1.0;
/// Eigenvalues of JᵀJ below this part of the largest are taken for it: what they say is not determined.
const SMALLEST: f64 = 1e-14;

/// Residuals and their derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// r, `[m]`.
    pub residuals: Vec<f64>,
    /// J, `[m][n]`.
    pub jacobian: Vec<Vec<f64>>,
}

impl Evaluation {
    /// Σ r².
    pub fn sum(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum()
    }

    /// s² = Σ r²/(m − n) for n parameters.
    fn variance(&self, n: usize) -> f64 {
        self.sum() / self.residuals.len().saturating_sub(n).max(1) as f64
    }

    /// Reduction Σ r² − Σ (r + Jδ)² of the sum by a step δ if the residuals were linear.
    fn reduction(&self, step: &[f64]) -> f64 {
        let moved = |row: &[f64]| row.iter().zip(step).map(|(slope, step)| slope * step).sum::<f64>();
        let left = self.residuals.iter().zip(&self.jacobian).map(|(r, row)| (r + moved(row)).powi(2));
        self.sum() - left.sum::<f64>()
    }

    /// JᵀJ, `[n, n]`, and Jᵀr, `[n, 1]`.
    fn normal(&self, n: usize) -> (Mat<f64>, Mat<f64>) {
        let product = |i: usize, j: usize| self.jacobian.iter().map(|row| row[i] * row[j]).sum::<f64>();
        let slope = |i: usize| self.jacobian.iter().zip(&self.residuals).map(|(row, r)| row[i] * r).sum::<f64>();
        (Mat::from_fn(n, n, product), Mat::from_fn(n, 1, |i, _| slope(i)))
    }

    /// s² (JᵀJ)⁻¹ with s² = Σ r²/(m − n), `[n][n]`: the covariance of the parameters where the residuals are
    /// independent and of one variance.
    pub fn covariance(&self, n: usize) -> Result<Vec<Vec<f64>>> {
        let lost = || Error::NotConverged("fitted parameters: their covariance cannot be computed".into());
        let (values, vectors) = symmetric_eigen(self.normal(n).0.as_ref()).ok_or_else(lost)?;
        let least = SMALLEST * values.last().copied().unwrap_or(1.0);
        let variance = self.variance(n);
        let entry = |i: usize, j: usize| -> f64 {
            (0..n).map(|k| vectors[(i, k)] * vectors[(j, k)] / values[k].max(least)).sum::<f64>() * variance
        };
        Ok((0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect())
    }
}

/// Least sum of squares.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// Parameters θ, `[n]`.
    pub parameters: Vec<f64>,
    /// Residuals there.
    pub there: Evaluation,
}

/// The parameters of the least sum of squares, from `start` on, until a step is shorter than `short` or promises no
/// reduction; each within its `bounds`.
///
/// # Errors
/// An evaluation at the start that fails; another one that fails otherwise than by not converging; no end of the steps.
pub fn least_squares(
    start: Vec<f64>,
    bounds: &[[f64; 2]],
    short: f64,
    mut evaluate: impl FnMut(&[f64]) -> Result<Evaluation>,
) -> Result<Minimum> {
    let n = start.len();
    let there = evaluate(&start)?;
    let mut best = Minimum { parameters: start, there };
    let mut damping = DAMPING;
    for _ in 1..EVALUATIONS {
        let (normal, slope) = best.there.normal(n);
        // Parameters at a bound that the step of all others would push beyond it stay there.
        let mut free: Vec<usize> = (0..n).collect();
        let step = loop {
            let step = damped_step(&normal, &slope, &free, damping);
            let outward = |i: usize, k: usize| {
                let at = best.parameters[k];
                (at <= bounds[k][0] && step[i] < 0.0) || (at >= bounds[k][1] && step[i] > 0.0)
            };
            let inside: Vec<usize> = (0..free.len()).filter(|i| !outward(*i, free[*i])).map(|i| free[i]).collect();
            if inside.len() == free.len() {
                break step;
            }
            free = inside;
        };
        let length = step.iter().map(|step| step.abs()).fold(0.0, f64::max);
        let scale = if length > LONGEST { LONGEST / length } else { 1.0 };
        let mut trial = best.parameters.clone();
        for (step, k) in step.iter().zip(&free) {
            trial[*k] = (trial[*k] + scale * step).clamp(bounds[*k][0], bounds[*k][1]);
        }
        let moves: Vec<f64> = trial.iter().zip(&best.parameters).map(|(a, b)| a - b).collect();
        let reached = damping < FREE && best.there.reduction(&moves) < REACHED * best.there.variance(n);
        if reached || moves.iter().all(|step| step.abs() < short) {
            return Ok(best);
        }
        match evaluate(&trial) {
            Ok(found) if found.sum() < best.there.sum() => {
                best = Minimum { parameters: trial, there: found };
                damping *= EASED;
            }
            Ok(_) | Err(Error::NotConverged(_)) if damping < STIFFEST => damping *= HELD,
            Ok(_) => return Ok(best),
            Err(error) => return Err(error),
        }
    }
    Err(Error::NotConverged(format!(
        "least squares: found no end in {EVALUATIONS} evaluations, the sum of squares is {:.3e}; fit fewer keys, or \
         begin elsewhere",
        best.there.sum()
    )))
}

/// Step of the parameters `free`, the others at rest.
fn damped_step(normal: &Mat<f64>, slope: &Mat<f64>, free: &[usize], damping: f64) -> Vec<f64> {
    if free.is_empty() {
        return Vec::new();
    }
    let most = free.iter().map(|i| normal[(*i, *i)]).fold(f64::MIN_POSITIVE, f64::max);
    let damped = Mat::from_fn(free.len(), free.len(), |i, j| {
        let entry = normal[(free[i], free[j])];
        entry + if i == j { damping * entry.max(SMALLEST * most) } else { 0.0 }
    });
    let step = damped.partial_piv_lu().solve(&Mat::from_fn(free.len(), 1, |i, _| -slope[(free[i], 0)]));
    (0..free.len()).map(|i| step[(i, 0)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's function: the least sum of squares, 0 at (1, 1), along a bent valley.
    #[test]
    fn a_bent_valley_is_followed_to_its_end() {
        let rosenbrock = |x: &[f64]| {
            Ok(Evaluation {
                residuals: vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]],
                jacobian: vec![vec![-20.0 * x[0], 10.0], vec![-1.0, 0.0]],
            })
        };
        let found = least_squares(vec![-1.2, 1.0], &[[-9.0, 9.0]; 2], 1e-10, rosenbrock).expect("a minimum");
        assert!(found.parameters.iter().all(|x| (x - 1.0).abs() < 1e-7), "{found:?}");
        // Held at a bound, where something is left.
        let found = least_squares(vec![-1.2, 1.0], &[[-9.0, 0.5], [-9.0, 9.0]], 1e-10, rosenbrock).expect("a minimum");
        assert!(found.parameters[0] == 0.5 && (found.parameters[1] - 0.25).abs() < 2e-3, "{found:?}");
    }

    /// A straight line through points, whose deviations are those of the textbooks.
    #[test]
    fn deviations_of_a_straight_line() {
        let (x, y) = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.1, 1.9, 4.2, 5.8, 8.1]);
        let line = |p: &[f64]| {
            Ok(Evaluation {
                residuals: x.iter().zip(&y).map(|(x, y)| p[0] + p[1] * x - y).collect(),
                jacobian: x.iter().map(|x| vec![1.0, *x]).collect(),
            })
        };
        let found = least_squares(vec![0.0, 0.0], &[[-9.0, 9.0]; 2], 1e-12, line).expect("a minimum");
        // Slope Σ(x − 2)y/Σ(x − 2)², its variance s²/Σ(x − 2)².
        let slope = x.iter().zip(&y).map(|(x, y)| (x - 2.0) * y).sum::<f64>() / 10.0;
        let covariance = found.there.covariance(2).expect("a covariance");
        let variance = found.there.sum() / 3.0 / 10.0;
        assert!((found.parameters[1] - slope).abs() < 0.03 * variance.sqrt(), "{found:?}, {slope}");
        assert!((covariance[1][1] / variance - 1.0).abs() < 1e-9 && (covariance[0][1] / variance + 2.0).abs() < 1e-9);
    }
}
