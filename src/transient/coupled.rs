//! The θ-method on modes that couple: those of bodies that rotate, or whose own matrices couple them.

use super::model::Model;
use super::scheme::Scheme;
use crate::dense::{add_columns, dot};
use crate::model::{ModalMatrix, Turning};
use crate::{Error, Result};
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};

/// Square matrices along the diagonal, one for each body, column by column.
#[derive(Debug, Clone)]
struct Blocks(Vec<(usize, Vec<f64>)>);

impl Blocks {
    /// Blocks of the `orders` with the entries `at(i, j)` of the whole matrix.
    fn from_fn(orders: &[usize], at: impl Fn(usize, usize) -> f64) -> Self {
        let mut first = 0;
        let mut blocks = Vec::new();
        for &n in orders {
            blocks.push((n, (0..n * n).map(|k| at(first + k % n, first + k / n)).collect()));
            first += n;
        }
        Self(blocks)
    }

    /// A x.
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        let mut first = 0;
        for (n, block) in &self.0 {
            add_columns(block, *n, &x[first..first + n], &mut out[first..first + n]);
            first += n;
        }
        out
    }
}

/// A step of modes that couple. With A = I + hθC + h²θ²K the velocities change by h A⁻¹ (f − C v − K (q + θ h v)).
#[derive(Debug, Clone)]
pub(super) struct Coupled {
    h: f64,
    theta: f64,
    inverse: Blocks,
    /// K.
    stiffness: Blocks,
    /// C + θhK.
    rate: Blocks,
    /// The symmetric stiffness that stores energy.
    elastic: Blocks,
    /// The damping that takes energy, and what turns with the bodies.
    turning: Turning,
    /// θh²γ times the skew part of A⁻¹; none where that is symmetric.
    lag: Option<Blocks>,
    /// L of the symmetric part of A⁻¹ = L Lᵀ of each body.
    factors: Vec<Mat<f64>>,
}

impl Coupled {
    pub(super) fn new(model: &Model, scheme: Scheme, gamma: f64) -> Result<Self> {
        let (h, theta) = (scheme.step, scheme.theta);
        // A diagonal beside blocks is divided like them.
        let orders: Vec<usize> = match (&model.stiffness, &model.damping) {
            (ModalMatrix::Blocks(blocks), _) | (_, ModalMatrix::Blocks(blocks)) => {
                blocks.iter().map(Mat::nrows).collect()
            }
            _ => vec![model.omega.len()],
        };
        let (k, c) = (&model.stiffness, &model.damping);
        let too_fast = || {
            Error::Input(
                "analyses.transient: the damping matrix of a body feeds energy faster than the step can follow; take a shorter step"
                    .into(),
            )
        };
        let (mut factors, mut inverses) = (Vec::new(), Vec::new());
        let mut first = 0;
        for &n in &orders {
            let a = Mat::from_fn(n, n, |i, j| {
                let one = if i == j { 1.0 } else { 0.0 };
                one + h * theta * (c.get(first + i, first + j) + h * theta * k.get(first + i, first + j))
            });
            let inverse = a.partial_piv_lu().inverse();
            let symmetric = Mat::from_fn(n, n, |i, j| 0.5 * (inverse[(i, j)] + inverse[(j, i)]));
            factors.push(symmetric.llt(Side::Lower).map_err(|_| too_fast())?.L().to_owned());
            inverses.push(inverse);
            first += n;
        }
        let inverse = ModalMatrix::Blocks(inverses);
        let turning = model.turning.clone().unwrap_or_else(|| Turning::none(model.damping.clone()));
        let circulating = turning.stiffness();
        let skew = inverse.asymmetry() > super::model::ASYMMETRY;
        let gain = 0.5 * theta * h * (h * gamma);
        Ok(Self {
            h,
            theta,
            stiffness: Blocks::from_fn(&orders, |i, j| k.get(i, j)),
            rate: Blocks::from_fn(&orders, |i, j| c.get(i, j) + theta * h * k.get(i, j)),
            elastic: Blocks::from_fn(&orders, |i, j| k.get(i, j) - circulating.as_ref().map_or(0.0, |m| m.get(i, j))),
            lag: skew.then(|| Blocks::from_fn(&orders, |i, j| gain * (inverse.get(i, j) - inverse.get(j, i)))),
            inverse: Blocks::from_fn(&orders, |i, j| inverse.get(i, j)),
            turning,
            factors,
        })
    }

    /// Change of the velocities in a step under the modal forces `force`, from `q` and `v`, `[m]`.
    pub(super) fn change(&self, mut force: Vec<f64>, q: &[f64], v: &[f64]) -> Vec<f64> {
        let (elastic, damped) = (self.stiffness.times(q), self.rate.times(v));
        force.iter_mut().zip(elastic.iter().zip(&damped)).for_each(|(f, (k, c))| *f = self.h * (*f - k - c));
        self.inverse.times(&force)
    }

    /// A⁻¹ x.
    pub(super) fn solved(&self, x: &[f64]) -> Vec<f64> {
        self.inverse.times(x)
    }

    /// What the skew part of A⁻¹ makes of the modal reactions `f`, m √kg, `[m]`.
    pub(super) fn lag(&self, f: &[f64]) -> Option<Vec<f64>> {
        self.lag.as_ref().map(|lag| lag.times(f))
    }

    /// Ψ L with the symmetric part L Lᵀ of A⁻¹, from the transpose of Ψ, `[m, 3n]`; `[3n, m]`.
    pub(super) fn half(&self, modes: faer::MatRef<'_, f64>) -> Mat<f64> {
        let mut out = Mat::zeros(modes.nrows(), modes.ncols());
        let mut first = 0;
        for l in &self.factors {
            let n = l.nrows();
            let product = modes.subcols(first, n) * l;
            out.as_mut().subcols_mut(first, n).copy_from(product);
            first += n;
        }
        out
    }

    /// ½ qᵀKq of the stiffness that stores energy, J.
    pub(super) fn elastic(&self, q: &[f64]) -> f64 {
        0.5 * dot(q, &self.elastic.times(q))
    }

    /// Energy that damping takes in a step and the part of it that the axles supply, J, between the ends (q, v) of the step. The rate of the
    /// material is v + D′q, of which the axles turn D′q.
    pub(super) fn damped(&self, before: (&[f64], &[f64]), after: (&[f64], &[f64])) -> (f64, f64) {
        let mean = |w: f64, a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| (1.0 - w) * a + w * b).collect()
        };
        let mut moved = mean(0.5, before.1, after.1);
        let mut rate = mean(self.theta, before.1, after.1);
        let Some(derivative) = &self.turning.derivative else {
            return (self.h * dot(&moved, &self.turning.dissipation.times(&rate)), 0.0);
        };
        let turned = derivative.times(&mean(0.5, before.0, after.0));
        moved.iter_mut().zip(&turned).for_each(|(m, t)| *m += t);
        if self.theta == 0.5 {
            rate.clone_from(&moved);
        } else {
            let turned = derivative.times(&mean(self.theta, before.0, after.0));
            rate.iter_mut().zip(&turned).for_each(|(r, t)| *r += t);
        }
        let force = self.turning.dissipation.times(&rate);
        (self.h * dot(&moved, &force), self.h * dot(&turned, &force))
    }
}
