//! How the eigenvalues of the reduced model move with what the job gives: derivatives from left and right eigenvectors.
//!
//! With (A − λE) x = 0 and zᵀ(A − λE) = 0, zᵀE x = 1, an eigenvalue that is simple moves with a parameter p as
//!
//! dλ/dp = zᵀ (∂A/∂p − λ ∂E/∂p) x
//!
//! (P. Lancaster, *Numer. Math.* 6 (1964)). The vectors are exact. Where the state of rest follows the parameter, the
//! derivative of the pencil is that along both: a difference of two pencils, each about a state of its own, in the
//! same units.

use faer::linalg::solvers::DenseSolveCore;
use faer::Mat;
use num_complex::Complex;

use super::reduced::{assemble, images, Eigenpair, Root, ScaledPencil, Scales};
use crate::contact::LinearContact;
use crate::model::CoupledModel;
use crate::{Error, Result};

/// Eigenvalues nearer to each other than this, over their size, share one space of eigenvectors.
const TOGETHER: f64 = 1e-7;
/// Largest |zᵀ(A − λE) x| over |λ| of an eigenvalue that has a derivative.
const SIMPLE: f64 = 1e-6;
/// Smallest size that an eigenvalue is measured by, in units of a mean frequency.
const SLOW: f64 = 1e-6;

/// Derivatives of a list of eigenvalues; NaN where an eigenvalue has none, because others are at the same place and
/// share its motion.
#[derive(Debug, Clone, Default)]
pub struct Sensitivities {
    /// By what is one number in the job.
    pub parameters: Vec<Derivative>,
    /// By the damping ratio of each free-interface mode, 1/s, `[eigenvalues][m1 + m2]`, with the state of rest kept;
    /// 0 of modes without a frequency.
    pub damping: Vec<Vec<Complex<f64>>>,
}

/// Derivative of a list of eigenvalues by a parameter.
#[derive(Debug, Clone)]
pub struct Derivative {
    /// The parameter.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// dλ/dp, 1/s over the unit of the parameter.
    pub by: Vec<Complex<f64>>,
}

/// Parameter of a derivative of an eigenvalue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// The coefficient of friction at all velocities, over what it is.
    Friction,
    /// Normal force, N; of points with forces of their own their sum, in proportion.
    NormalLoad,
    /// Rigid approach, m.
    Approach,
    /// Rolling speed, m/s, with it that of bodies that roll.
    Speed,
    /// Longitudinal creepage, 1.
    Longitudinal,
    /// Lateral creepage, 1.
    Lateral,
    /// Spin, 1/m.
    Spin,
    /// Lateral position of the contact on the lower body, m.
    LowerPosition,
    /// Lateral position of the contact on the upper body, m.
    UpperPosition,
}

impl Parameter {
    /// Its name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "coefficient of friction",
            Self::NormalLoad => "normal load",
            Self::Approach => "approach",
            Self::Speed => "speed",
            Self::Longitudinal => "longitudinal creepage",
            Self::Lateral => "lateral creepage",
            Self::Spin => "spin",
            Self::LowerPosition => "lateral position of the contact on the lower body",
            Self::UpperPosition => "lateral position of the contact on the upper body",
        }
    }
}

/// The linearised contact with the vectors of some of its eigenvalues.
pub struct Linearisation {
    scales: Scales,
    modes: usize,
    /// In units of the pencil.
    values: Vec<Complex<f64>>,
    right: Mat<Complex<f64>>,
    /// Left vectors z, columns like `right`; NaN where there is none.
    left: Mat<Complex<f64>>,
}

impl Linearisation {
    /// Sensitivities of those `pairs` that [`super::reduced::eigenpairs`] found of this contact, with Im λ ≥ 0; left
    /// vectors have at most the backward error `tolerance`.
    pub fn new(bodies: &CoupledModel, contact: &LinearContact, pairs: &[Eigenpair], tolerance: f64) -> Result<Self> {
        let pencil = assemble(bodies, contact, None)?;
        let vectors: Vec<_> = pairs.iter().map(|p| pencil.vector(p)).collect();
        let values: Vec<_> = pairs.iter().map(|p| p.value / pencil.scales.rate).collect();
        let n = pencil.a.nrows();
        let right = Mat::from_fn(n, pairs.len(), |i, j| vectors[j][i]);
        let left = left_vectors(&pencil, &values, &right, tolerance)?;
        let mut all = Self { scales: pencil.scales.clone(), modes: bodies.omega.len(), values, right, left };
        for (j, error) in all.forms(&pencil.a, &pencil.e).into_iter().enumerate() {
            let error = error.norm();
            if error > SIMPLE * all.values[j].norm().max(SLOW) || error.is_nan() {
                (0..n).for_each(|i| all.left[(i, j)] = Complex::new(f64::NAN, f64::NAN));
            }
        }
        Ok(all)
    }

    /// zᵀ(A − λE) x of each eigenvalue.
    fn forms(&self, a: &Mat<f64>, e: &Mat<f64>) -> Vec<Complex<f64>> {
        let images = images([a, e], &self.values, &self.right);
        let product = |j: usize| (0..images.nrows()).map(|i| self.left[(i, j)] * images[(i, j)]).sum();
        (0..self.values.len()).map(product).collect()
    }

    /// Derivatives by a parameter, 1/s over its unit, from the contacts `ahead` and `behind`, between which it
    /// changes by `distance`. They have to be [alike](LinearContact::alike).
    pub fn between(
        &self,
        ahead: (&CoupledModel, &LinearContact),
        behind: (&CoupledModel, &LinearContact),
        distance: f64,
    ) -> Result<Vec<Complex<f64>>> {
        let [ahead, behind] = [ahead, behind].map(|(bodies, contact)| assemble(bodies, contact, Some(&self.scales)));
        let (ahead, behind) = (ahead?, behind?);
        if ahead.a.shape() != behind.a.shape() || ahead.a.nrows() != self.right.nrows() {
            return Err(Error::Defect("sensitivities: contacts with different unknowns".into()));
        }
        let forms = self.forms(&(ahead.a - behind.a), &(ahead.e - behind.e));
        Ok(forms.into_iter().map(|f| f * (self.scales.rate / distance)).collect())
    }

    /// Derivatives by the damping ratio of each mode, 1/s, `[eigenvalues][m1 + m2]`, as in
    /// [`Sensitivities::damping`]: of δC = 2ω_k δζ_k at the mode alone, which takes the material rate q̇ + D′q.
    pub fn by_damping(&self, bodies: &CoupledModel) -> Vec<Vec<Complex<f64>>> {
        let m = self.modes;
        let of = |j: usize| -> Vec<Complex<f64>> {
            let (q, v) = (self.right.col(j).subrows(0, m), self.right.col(j).subrows(m, m));
            let q: Vec<_> = q.iter().copied().collect();
            let turned = bodies.turning.as_ref().and_then(|t| t.derivative.as_ref()).map(|d| d.times(&q));
            let rate = |k: usize| v[k] * self.scales.rate + turned.as_ref().map_or(Complex::default(), |t| t[k]);
            (0..m).map(|k| self.left[(m + k, j)] * rate(k) * (-2.0 * bodies.omega[k] / self.scales.rate)).collect()
        };
        (0..self.values.len()).map(of).collect()
    }
}

/// Left vectors z of the eigenvalues `values`, zᵀE x = 1 with the right ones, columns like `right`. Vectors of
/// eigenvalues that lie together are made dual to their right ones.
fn left_vectors(
    pencil: &ScaledPencil,
    values: &[Complex<f64>],
    right: &Mat<Complex<f64>>,
    tolerance: f64,
) -> Result<Mat<Complex<f64>>> {
    let (a, e) = (pencil.a.transpose().to_owned(), pencil.e.transpose().to_owned());
    // Turned round it is no pencil of modes and contact any more.
    let turned = ScaledPencil { a, e, scales: pencil.scales.clone(), parts: None };
    let mut found: Vec<Root> = turned.roots(tolerance)?;
    let n = right.nrows();
    let zero = Mat::<f64>::zeros(n, n);
    // (0 + E) x by the form A − λE with A = E.
    let loaded = images([&pencil.e, &zero], values, right);
    let mut left = Mat::from_fn(n, values.len(), |_, _| Complex::new(f64::NAN, f64::NAN));
    let mut done = vec![false; values.len()];
    for i in 0..values.len() {
        if done[i] {
            continue;
        }
        let reach = TOGETHER * values[i].norm().max(SLOW);
        let group: Vec<usize> = (i..values.len()).filter(|&j| (values[j] - values[i]).norm() <= reach).collect();
        // The nearest as many.
        found.sort_by(|a, b| (a.value - values[i]).norm().total_cmp(&(b.value - values[i]).norm()));
        let near = &found[..group.len().min(found.len())];
        group.iter().for_each(|&j| done[j] = true);
        if near.len() < group.len() {
            continue;
        }
        let products = Mat::from_fn(group.len(), group.len(), |p, q| {
            (0..n).map(|r| near[p].vector[r] * loaded[(r, group[q])]).sum::<Complex<f64>>()
        });
        let inverse = products.partial_piv_lu().inverse();
        for (p, &j) in group.iter().enumerate() {
            for r in 0..n {
                left[(r, j)] = (0..near.len()).map(|q| inverse[(p, q)] * near[q].vector[r]).sum();
            }
        }
    }
    Ok(left)
}
