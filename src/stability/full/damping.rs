//! Damping of the bodies of the full system: Rayleigh's, C = αM + βK, and what is given in the space of the free
//! modes, MΦ L ΦᵀM, a matrix of low rank that enters the inverse at a shift by Woodbury's identity: modal damping, L
//! = diag(c), and rotation as the modes see it. What they do not see of rotation improves the eigenpairs
//! ([`super::pairs`]).

use super::columns::{Columns, Reals};
use crate::body::fe::BodyModes;
use crate::body::rotation::{ModalRotation, RotationForms};
use crate::body::ModalMatrix;
use crate::parallel::World;
use crate::petsc::operator::Operator;
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;
use num_complex::Complex;
use std::rc::Rc;

type C = Complex<f64>;

/// Rayleigh damping C = αM + βK.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RayleighDamping {
    /// α, 1/s.
    pub alpha: f64,
    /// β, s.
    pub beta: f64,
}

impl RayleighDamping {
    /// The shift of imaginary part `height` (rad/s) at which s is real, with that s (1/s²): the eigenvalue that a
    /// mode of a body with this damping would have. `None` where so fast a mode would not oscillate.
    pub(crate) fn on_curve(&self, height: f64) -> Option<(C, f64)> {
        let mut s = height * height;
        for _ in 0..200 {
            let half = 0.5 * (self.alpha + self.beta * s);
            let next = height * height + half * half;
            if (next - s).abs() <= 1e-15 * s {
                break;
            }
            s = next;
        }
        let half = 0.5 * (self.alpha + self.beta * s);
        ((height * height + half * half - s).abs() <= 1e-12 * s && s.is_finite()).then(|| (C::new(-half, height), s))
    }
}

/// A body that rotates.
#[derive(Debug, Clone)]
pub struct Spin {
    /// Angular velocity Ω, rad/s.
    pub speed: f64,
    /// Rotation terms at 1 rad/s.
    pub forms: Rc<RotationForms>,
    /// The same in the space of the free modes of the body.
    pub modal: ModalRotation,
}

/// The body in one of the two places, how it is damped there, and whether it rotates.
#[derive(Debug, Clone, Default)]
pub struct DampedBody {
    /// Index in the list of bodies.
    pub body: usize,
    /// Rayleigh damping.
    pub damping: RayleighDamping,
    /// Damping coefficients c of the body's free modes, which add to it, 1/s, `[modes]`; empty: none.
    pub modal: Vec<f64>,
    /// Its rotation.
    pub spin: Option<Spin>,
}

impl DampedBody {
    /// A body with Rayleigh damping.
    pub fn rayleigh(body: usize, damping: RayleighDamping) -> Self {
        Self { body, damping, ..Self::default() }
    }
}

/// Terms in the space of the free modes of a body: B (λ L1 + L0) Bᵀ with B = MΦ: damping of its modes, and rotation as
/// they see it, G → B ΦᵀGΦ Bᵀ.
pub(super) struct ModalTerms {
    /// B, this rank's rows of each column; shared by mirror images.
    pub loads: Rc<Columns>,
    /// L1, 1/s: modal damping and ΩG as the modes see it.
    rate: ModalMatrix,
    /// L0, 1/s²: C ΩD′, and Ω²(K_σ − K_c) as the modes see it; none of a body at rest.
    stiffness: Option<ModalMatrix>,
    /// Part of L0 in the space of the modes: C ΩD′.
    given: Option<ModalMatrix>,
    /// The same of L1: c, 1/s; none where the modes are not damped.
    damping: Option<ModalMatrix>,
}

impl ModalTerms {
    /// Collective: B for the body with these `modes` and this `mass`.
    pub fn loads(world: &World, mass: &Operator, modes: &BodyModes) -> Rc<Columns> {
        let (n, m) = (mass.matrix().n_local(), modes.vectors.len());
        let mut values = vec![0.0; n * m];
        mass.apply_block(world, &modes.vectors.concat(), &mut values, m);
        Rc::new(Columns { rows: n, values })
    }

    /// The terms of the `body` with these loads of its `modes`.
    pub fn new(loads: Rc<Columns>, modes: &BodyModes, body: &DampedBody) -> Result<Self> {
        let m = modes.vectors.len();
        let given = (body.modal.len(), body.spin.as_ref().map(|s| s.modal.gyroscopic.nrows()));
        if !(given.0 == m || body.modal.is_empty()) || given.1.is_some_and(|n| n != m) {
            return Err(Error::Defect(format!("{given:?} coefficients of damping and rotation for {m} modes")));
        }
        let damping = if body.modal.is_empty() { vec![0.0; m] } else { body.modal.clone() };
        let diagonal = ModalMatrix::from(damping.clone());
        let Some(Spin { speed, modal, .. }) = &body.spin else {
            return Ok(Self { loads, rate: diagonal.clone(), stiffness: None, given: None, damping: Some(diagonal) });
        };
        let RayleighDamping { alpha, beta } = body.damping;
        // All damping acts on the rate of the material.
        let whole = |k: usize| damping[k] + alpha + beta * modes.omega[k] * modes.omega[k];
        let turned = |i: usize, j: usize| speed * whole(i) * modal.derivative[(i, j)];
        let stiffness = Mat::from_fn(m, m, |i, j| speed * speed * modal.stiffness[(i, j)] + turned(i, j));
        let damped = Mat::from_fn(m, m, |i, j| diagonal.get(i, j));
        Ok(Self {
            loads,
            rate: (damped + faer::Scale(*speed) * &modal.gyroscopic).into(),
            stiffness: Some(stiffness.into()),
            given: Some(Mat::from_fn(m, m, turned).into()),
            damping: (!body.modal.is_empty()).then_some(diagonal),
        })
    }

    /// Columns of B.
    pub fn count(&self) -> usize {
        self.rate.order()
    }

    /// Collective: the amplitudes Bᵀ u of motions, `[count]` for each.
    pub fn amplitudes(&self, world: &World, u: &Reals) -> Vec<Vec<C>> {
        summed(world, self.loads.dots(self.count(), u))
    }

    /// Collective: out += what is given in the space of the modes and goes with the power 1 or 0 of λ, of each
    /// motion: modal damping, and C ΩD′.
    pub fn add(&self, world: &World, power: usize, u: &Reals, out: &mut Reals) {
        let given = [self.given.as_ref(), self.damping.as_ref()];
        let Some(matrix) = given.get(power).copied().flatten() else { return };
        self.add_terms(world, matrix, u, out);
    }

    /// Collective: the same with the transposed matrices.
    pub fn add_transposed(&self, world: &World, power: usize, u: &Reals, out: &mut Reals) {
        let given = [self.given.as_ref(), self.damping.as_ref()];
        let Some(matrix) = given.get(power).copied().flatten() else { return };
        self.add_terms(world, &matrix.transposed(), u, out);
    }

    /// Collective: out += B L Bᵀ u of each motion.
    fn add_terms(&self, world: &World, matrix: &ModalMatrix, u: &Reals, out: &mut Reals) {
        let amplitudes = summed(world, self.loads.dots(matrix.order(), u));
        let factors: Vec<Vec<C>> = amplitudes.iter().map(|a| matrix.times(a)).collect();
        self.loads.add(&factors, out);
    }

    /// Collective: uᴴ C u of the modal damping.
    pub fn power(&self, world: &World, u: &Reals) -> f64 {
        let Some(damping) = &self.damping else { return 0.0 };
        let all = summed(world, self.loads.dots(damping.order(), u));
        let of = |a: &Vec<C>| damping.times(a).iter().zip(a).map(|(c, a)| (a.conj() * c).re).sum::<f64>();
        all.iter().map(of).sum()
    }

    /// Collective: lower bounds of the norms of B L0 Bᵀ, N/m, and B L1 Bᵀ, N·s/m, max |l_jk| |b_j| |b_k|: the
    /// backward error is not flattered by them.
    pub fn norms(&self, world: &World) -> [f64; 2] {
        let columns = (0..self.count()).map(|k| &self.loads.values[k * self.loads.rows..(k + 1) * self.loads.rows]);
        let squares: Vec<f64> = columns.map(|l| l.iter().map(|v| v * v).sum()).collect();
        let sizes: Vec<f64> = world.sum_all(&squares).into_iter().map(f64::sqrt).collect();
        [0, 1].map(|power| {
            let Some(matrix) = [self.stiffness.as_ref(), Some(&self.rate)][power] else { return 0.0 };
            let entry = |i: usize, j: usize| matrix.get(i, j).abs() * sizes[i] * sizes[j];
            let each = (0..sizes.len()).flat_map(|i| (0..sizes.len()).map(move |j| (i, j)));
            each.map(|(i, j)| entry(i, j)).fold(0.0, f64::max)
        })
    }
}

/// Collective: the sums over the ranks.
fn summed(world: &World, own: Vec<Vec<C>>) -> Vec<Vec<C>> {
    let count = own.first().map_or(0, Vec::len).max(1);
    world.sum_all(&own.concat()).chunks_exact(count).map(<[C]>::to_vec).collect()
}

/// Correction of an inverse at λ by modal terms: with A the dynamic stiffness without them, L = λ L1 + L0, Z = A⁻¹B and
/// G = BᵀZ, (A + B L Bᵀ)⁻¹ = A⁻¹ − Z (I + L G)⁻¹ L Zᵀ (M. A. Woodbury, 1950).
pub(super) struct ModalCorrection {
    factor: PartialPivLu<C>,
    /// L.
    terms: Mat<C>,
    /// Motion of the contact rows by Z, Y Z, `[3m, modes]`.
    pub motion: Mat<C>,
}

impl ModalCorrection {
    /// The correction at `lambda` with `gram` = G and the `motion` of the contact rows, the same on every rank.
    pub fn new(modal: &ModalTerms, lambda: C, gram: &Mat<C>, motion: Mat<C>) -> Self {
        let n = gram.nrows();
        let still = |i: usize, j: usize| modal.stiffness.as_ref().map_or(0.0, |m| m.get(i, j));
        let terms = Mat::from_fn(n, n, |i, j| lambda * modal.rate.get(i, j) + still(i, j));
        let a = Mat::<C>::identity(n, n) + &terms * gram;
        Self { factor: a.partial_piv_lu(), terms, motion }
    }

    /// (I + L G)⁻¹ L g, columns of `[modes]`.
    pub fn solve(&self, g: &Mat<C>) -> Mat<C> {
        let mut out = &self.terms * g;
        self.factor.solve_in_place(&mut out);
        out
    }

    /// Reduction of the receptance of the contact rows: (YZ) (I + L G)⁻¹ L (YZ)ᵀ, `[3m, 3m]`.
    pub fn receptance(&self) -> Mat<C> {
        &self.motion * self.solve(&self.motion.transpose().to_owned())
    }

    /// ((I + L G)⁻¹ L)ᵀ g, columns of `[modes]`.
    fn solve_transposed(&self, g: &Mat<C>) -> Mat<C> {
        let mut out = g.clone();
        self.factor.solve_transpose_in_place(&mut out);
        self.terms.transpose() * out
    }

    /// Factors of the columns of Z that are taken off a solution whose amplitudes without modal terms are
    /// `amplitudes`, under contact forces `forces`, `[modes]`; of a solution with the transposed matrix where this is
    /// `transposed`.
    pub fn factors(&self, amplitudes: &[C], forces: &[C], transposed: bool) -> Vec<C> {
        let rows = self.motion.nrows();
        let g = Mat::from_fn(self.terms.nrows(), 1, |k, _| {
            amplitudes[k] + (0..rows).map(|i| self.motion[(i, k)] * forces[i]).sum::<C>()
        });
        let g = if transposed { self.solve_transposed(&g) } else { self.solve(&g) };
        (0..g.nrows()).map(|k| g[(k, 0)]).collect()
    }
}
