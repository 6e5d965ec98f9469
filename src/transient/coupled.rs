//! The θ-method on modes that couple: those of bodies that rotate, or whose own matrices couple them.

use super::model::Model;
use super::scheme::Scheme;
use crate::dense::{add_columns, add_symmetric, dot};
use crate::model::{ModalBlock, ModalMatrix, RotationTerms};
use crate::{Error, Result};
use faer::linalg::solvers::DenseSolveCore;
use faer::{ColRef, Mat, MatRef, Scale, Side};

/// A square matrix by what a product with it needs.
#[derive(Debug, Clone)]
enum Block {
    /// The diagonal; zeros for a body that has no such matrix.
    Diagonal(Vec<f64>),
    /// Columns of a symmetric matrix, of which a product reads half.
    Symmetric(Vec<f64>),
    /// Columns.
    Full(Vec<f64>),
}

/// Square matrices along the diagonal, one for each body.
#[derive(Debug, Clone)]
struct Blocks(Vec<(usize, Block)>);

/// Largest difference of mirrored entries of a block taken as symmetric, relative to its largest entry: the rounding
/// of an inverse.
const ROUNDING: f64 = 1e-12;

impl Block {
    /// The matrix of order `n` with these columns.
    fn new(n: usize, mut columns: Vec<f64>) -> Self {
        let (mut largest, mut apart, mut off) = (0.0f64, 0.0f64, 0.0f64);
        for j in 0..n {
            largest = largest.max(columns[n * j + j].abs());
            for i in 0..j {
                let (above, below) = (columns[n * j + i], columns[n * i + j]);
                off = off.max(above.abs()).max(below.abs());
                apart = apart.max((above - below).abs());
            }
        }
        if off == 0.0 {
            return Block::Diagonal(columns.into_iter().step_by(n + 1).collect());
        }
        if apart > ROUNDING * largest.max(off) {
            return Block::Full(columns);
        }
        for j in 0..n {
            for i in 0..j {
                columns[n * i + j] = 0.5 * (columns[n * i + j] + columns[n * j + i]);
            }
        }
        Block::Symmetric(columns)
    }
}

impl Blocks {
    /// Blocks of the `orders` with the entries `at(i, j)` of the whole matrix.
    fn from_fn(orders: &[usize], at: impl Fn(usize, usize) -> f64) -> Self {
        let mut first = 0;
        let mut blocks = Vec::new();
        for &n in orders {
            blocks.push((n, Block::new(n, (0..n * n).map(|k| at(first + k % n, first + k / n)).collect())));
            first += n;
        }
        Self(blocks)
    }

    /// A x.
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        let mut first = 0;
        for (n, block) in &self.0 {
            let (x, out) = (&x[first..first + n], &mut out[first..first + n]);
            match block {
                Block::Diagonal(d) => out.iter_mut().zip(d).zip(x).for_each(|((o, d), x)| *o = d * x),
                Block::Symmetric(columns) => add_symmetric(columns, *n, x, out),
                Block::Full(columns) => add_columns(columns, *n, x, out),
            }
            first += n;
        }
        out
    }

    /// A X, `[m, c]`.
    fn times_columns(&self, x: &Mat<f64>) -> Mat<f64> {
        let mut out = Mat::zeros(x.nrows(), x.ncols());
        let mut first = 0;
        for (n, block) in &self.0 {
            let (x, mut out) = (x.as_ref().subrows(first, *n), out.as_mut().subrows_mut(first, *n));
            match block {
                Block::Diagonal(d) => out.copy_from(ColRef::from_slice(d).as_diagonal() * x),
                Block::Symmetric(columns) | Block::Full(columns) => {
                    out.copy_from(MatRef::from_column_major_slice(columns, *n, *n) * x);
                }
            }
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
    /// The symmetric stiffness that stores energy.
    elastic: Blocks,
    /// The damping that takes energy.
    dissipation: Blocks,
    /// D′ of bodies that rotate.
    derivative: Option<Blocks>,
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
                blocks.iter().map(ModalBlock::order).collect()
            }
            _ => vec![model.omega.len()],
        };
        let (k, c) = (&model.stiffness, &model.damping);
        let too_fast = || {
            Error::Input(
                "analyses.transient: the damping matrix of a body feeds energy faster than the step can follow; \
                 take a shorter step"
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
        let inverse = ModalMatrix::Blocks(inverses.into_iter().map(ModalBlock::from).collect());
        let turning = model.turning.clone().unwrap_or_else(|| RotationTerms::none(model.damping.clone()));
        let circulating = turning.stiffness();
        let skew = inverse.asymmetry() > super::model::ASYMMETRY;
        let gain = 0.5 * theta * h * (h * gamma);
        Ok(Self {
            h,
            theta,
            stiffness: Blocks::from_fn(&orders, |i, j| k.get(i, j)),
            elastic: Blocks::from_fn(&orders, |i, j| k.get(i, j) - circulating.as_ref().map_or(0.0, |m| m.get(i, j))),
            lag: skew.then(|| Blocks::from_fn(&orders, |i, j| gain * (inverse.get(i, j) - inverse.get(j, i)))),
            inverse: Blocks::from_fn(&orders, |i, j| inverse.get(i, j)),
            dissipation: Blocks::from_fn(&orders, |i, j| turning.dissipation.get(i, j)),
            derivative: turning.derivative.as_ref().map(|d| Blocks::from_fn(&orders, |i, j| d.get(i, j))),
            factors,
        })
    }

    /// Change of the velocities in a step under the modal forces `force`, from `q` and `v`, `[m]`: as hθC = A − I −
    /// h²θ²K, it is h A⁻¹ (f − K q + v/(hθ)) − v/θ.
    pub(super) fn change(&self, mut force: Vec<f64>, q: &[f64], v: &[f64]) -> Vec<f64> {
        let elastic = self.stiffness.times(q);
        force.iter_mut().zip(elastic.iter().zip(v)).for_each(|(f, (k, v))| *f = self.h * (*f - k) + v / self.theta);
        let mut change = self.inverse.times(&force);
        change.iter_mut().zip(v).for_each(|(c, v)| *c -= v / self.theta);
        change
    }

    /// The same of small changes, one in each column, `[m, c]`.
    pub(super) fn changes(&self, force: Mat<f64>, q: &Mat<f64>, v: &Mat<f64>) -> Mat<f64> {
        let own = Scale(1.0 / self.theta) * v;
        let force = Scale(self.h) * (force - self.stiffness.times_columns(q)) + &own;
        self.inverse.times_columns(&force) - own
    }

    /// A⁻¹ X.
    pub(super) fn solved_columns(&self, x: &Mat<f64>) -> Mat<f64> {
        self.inverse.times_columns(x)
    }

    /// [`lag`](Self::lag) of each column of `f`, `[m, c]`.
    pub(super) fn lags(&self, f: &Mat<f64>) -> Option<Mat<f64>> {
        self.lag.as_ref().map(|lag| lag.times_columns(f))
    }

    /// A⁻¹ x.
    pub(super) fn solved(&self, x: &[f64]) -> Vec<f64> {
        self.inverse.times(x)
    }

    /// Displacements by the skew part of A⁻¹ under the modal reactions `f`, m √kg, `[m]`.
    pub(super) fn lag(&self, f: &[f64]) -> Option<Vec<f64>> {
        self.lag.as_ref().map(|lag| lag.times(f))
    }

    /// Ψ L with the symmetric part L Lᵀ of A⁻¹, from the transpose of Ψ, `[m, 3n]`; `[3n, m]`.
    pub(super) fn half(&self, modes: MatRef<'_, f64>) -> Mat<f64> {
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

    /// Energy that damping takes in a step and the part of it that the axles supply, J, between the ends (q, v) of
    /// the step. The rate of the material is v + D′q, of which the axles turn D′q.
    pub(super) fn damped(&self, before: (&[f64], &[f64]), after: (&[f64], &[f64])) -> (f64, f64) {
        let mean = |w: f64, a: &[f64], b: &[f64]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| (1.0 - w) * a + w * b).collect()
        };
        let mut moved = mean(0.5, before.1, after.1);
        let mut rate = mean(self.theta, before.1, after.1);
        let Some(derivative) = &self.derivative else {
            return (self.h * dot(&moved, &self.dissipation.times(&rate)), 0.0);
        };
        let turned = derivative.times(&mean(0.5, before.0, after.0));
        moved.iter_mut().zip(&turned).for_each(|(m, t)| *m += t);
        if self.theta == 0.5 {
            rate.clone_from(&moved);
        } else {
            let turned = derivative.times(&mean(self.theta, before.0, after.0));
            rate.iter_mut().zip(&turned).for_each(|(r, t)| *r += t);
        }
        let force = self.dissipation.times(&rate);
        (self.h * dot(&moved, &force), self.h * dot(&turned, &force))
    }
}
