//! Damping of the bodies of the full system: Rayleigh's, C = αM + βK, and what is given in the space of the free modes, MΦ L ΦᵀM, a matrix of low
//! rank that enters the inverse at a shift by Woodbury's identity: modal damping, L = diag(c), and rotation as the modes see it. What they do not see of
//! rotation is sparse and corrects each solution ([`super::system::System`]).

use crate::body::fe::BodyModes;
use crate::body::rotation::{ModalRotation, RotationForms};
use crate::body::ModalMatrix;
use crate::parallel::World;
use crate::petsc::csr::Operator;
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;
use num_complex::Complex;
use std::rc::Rc;

type C = Complex<f64>;

/// Rayleigh damping C = αM + βK.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Damping {
    /// α, 1/s.
    pub alpha: f64,
    /// β, s.
    pub beta: f64,
}

impl Damping {
    /// The shift of imaginary part `height` (rad/s) at which s is real, with that s (1/s²): the eigenvalue that a mode of a body with this
    /// damping would have. `None` where so fast a mode would not oscillate.
    pub fn on_curve(&self, height: f64) -> Option<(C, f64)> {
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
    /// What rotation adds at 1 rad/s.
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
    pub damping: Damping,
    /// Damping coefficients c of the body's free modes, which add to it, 1/s, `[modes]`; empty: none.
    pub modal: Vec<f64>,
    /// Its rotation.
    pub spin: Option<Spin>,
}

impl DampedBody {
    /// A body with Rayleigh damping.
    pub fn rayleigh(body: usize, damping: Damping) -> Self {
        Self { body, damping, ..Self::default() }
    }
}

/// What is given in the space of the free modes of a body in its place: B (λ L1 + L0) Bᵀ with B = U = MΦ of a body that only has its modes damped. That of a body that rotates
/// has B = [U, V], V = GΦ − UΦᵀGΦ, and G → B [ΦᵀGΦ, −1; 1, 0] Bᵀ: what it does to the modes is all there.
pub(super) struct ModalTerms {
    /// B, this rank's rows of each column; shared by mirror images, of which one may need the first columns only.
    pub loads: Rc<Vec<Vec<f64>>>,
    /// L1, 1/s: that of modal damping and of ΩG.
    rate: ModalMatrix,
    /// L0, 1/s²: Ω²(K_σ − K_c) + C ΩD′; none of a body at rest.
    stiffness: Option<ModalMatrix>,
    /// What stands for G and K_σ − K_c at 1 rad/s.
    seen: Option<[ModalMatrix; 2]>,
    /// c, 1/s.
    damping: Vec<f64>,
}

impl ModalTerms {
    /// Collective: B for the `body` with these `modes` and this `mass`.
    pub fn loads(world: &World, mass: &Operator, modes: &BodyModes, body: &DampedBody) -> Rc<Vec<Vec<f64>>> {
        let product = |operator: &Operator, phi: &Vec<f64>| {
            let mut load = vec![0.0; phi.len()];
            operator.apply(world, phi, &mut load);
            load
        };
        let mut loads: Vec<Vec<f64>> = modes.vectors.iter().map(|phi| product(mass, phi)).collect();
        let m = loads.len();
        if let Some(Spin { forms, modal, .. }) = &body.spin {
            let gyroscopic = forms.gyroscopic.operator(world);
            for (j, phi) in modes.vectors.iter().enumerate() {
                let mut rest = product(&gyroscopic, phi);
                for i in 0..m {
                    let factor = modal.gyroscopic[(i, j)];
                    rest.iter_mut().zip(&loads[i]).for_each(|(r, u)| *r -= factor * u);
                }
                loads.push(rest);
            }
        }
        Rc::new(loads)
    }

    /// The terms of the `body` with these loads of its `modes`.
    pub fn new(loads: Rc<Vec<Vec<f64>>>, modes: &BodyModes, body: &DampedBody) -> Result<Self> {
        let m = modes.vectors.len();
        let given = (body.modal.len(), body.spin.as_ref().map(|s| s.modal.gyroscopic.nrows()));
        if !(given.0 == m || body.modal.is_empty()) || given.1.is_some_and(|n| n != m) {
            return Err(Error::Defect(format!("{given:?} coefficients of damping and rotation for {m} modes")));
        }
        let damping = if body.modal.is_empty() { vec![0.0; m] } else { body.modal.clone() };
        let Some(Spin { speed, modal, .. }) = &body.spin else {
            return Ok(Self { loads, rate: damping.clone().into(), stiffness: None, seen: None, damping });
        };
        let Damping { alpha, beta } = body.damping;
        // All damping acts on the rate of the material.
        let whole = |k: usize| damping[k] + alpha + beta * modes.omega[k] * modes.omega[k];
        let padded = |at: &dyn Fn(usize, usize) -> f64| {
            Mat::from_fn(2 * m, 2 * m, |i, j| if i < m && j < m { at(i, j) } else { 0.0 })
        };
        let gyroscopic = Mat::from_fn(2 * m, 2 * m, |i, j| match (i < m, j < m) {
            (true, true) => modal.gyroscopic[(i, j)],
            (true, false) if i + m == j => -1.0,
            (false, true) if i == j + m => 1.0,
            _ => 0.0,
        });
        let stiffness = padded(&|i, j| modal.stiffness[(i, j)]);
        let turned = padded(&|i, j| whole(i) * modal.derivative[(i, j)]);
        let damped = padded(&|i, j| if i == j { damping[i] } else { 0.0 });
        Ok(Self {
            loads,
            rate: (damped + faer::Scale(*speed) * &gyroscopic).into(),
            stiffness: Some((faer::Scale(speed * speed) * &stiffness + faer::Scale(*speed) * turned).into()),
            seen: Some([gyroscopic.into(), stiffness.into()]),
            damping,
        })
    }

    /// Columns of B.
    pub fn count(&self) -> usize {
        self.rate.order()
    }

    /// Collective: out += `factor` times what stands for G, or for K_σ − K_c, at 1 rad/s.
    pub fn add_seen(&self, world: &World, stiffness: bool, factor: f64, u: &[C], out: &mut [C]) {
        let Some(seen) = &self.seen else { return };
        let amplitudes = seen[usize::from(stiffness)].times(&world.sum_all(&self.amplitudes(u)));
        self.add_loads(factor, &amplitudes, out);
    }

    /// This rank's part of the amplitudes Bᵀ u of a motion, `[count]`; to be summed over the ranks.
    pub fn amplitudes(&self, u: &[C]) -> Vec<C> {
        self.loads[..self.count()].iter().map(|load| load.iter().zip(u).map(|(l, u)| *l * u).sum()).collect()
    }

    /// L1 or L0, for the powers 1 and 0 of λ.
    fn matrix(&self, power: usize) -> Option<&ModalMatrix> {
        match power {
            1 => Some(&self.rate),
            0 => self.stiffness.as_ref(),
            _ => None,
        }
    }

    /// Collective: out += `factor` B L Bᵀ u of the power 1 or 0 of λ.
    pub fn add(&self, world: &World, power: usize, factor: f64, u: &[C], out: &mut [C]) {
        let Some(matrix) = self.matrix(power) else { return };
        let amplitudes = matrix.times(&world.sum_all(&self.amplitudes(u)));
        self.add_loads(factor, &amplitudes, out);
    }

    /// out += `factor` B a.
    fn add_loads(&self, factor: f64, amplitudes: &[C], out: &mut [C]) {
        for (load, a) in self.loads.iter().zip(amplitudes) {
            let a = factor * a;
            out.iter_mut().zip(load).for_each(|(o, l)| *o += a * *l);
        }
    }

    /// Collective: uᴴ C u of the modal damping.
    pub fn power(&self, world: &World, u: &[C]) -> f64 {
        let amplitudes = world.sum_all(&self.amplitudes(u));
        amplitudes.iter().zip(&self.damping).map(|(a, c)| c * a.norm_sqr()).sum()
    }

    /// Collective: uᴴ B L0 Bᵀ u, N/m times the square of the unit of `u`.
    pub fn stiffening(&self, world: &World, u: &[C]) -> C {
        let Some(matrix) = &self.stiffness else { return C::default() };
        let amplitudes = world.sum_all(&self.amplitudes(u));
        amplitudes.iter().zip(matrix.times(&amplitudes)).map(|(a, b)| a.conj() * b).sum()
    }

    /// Collective: lower bounds of the norms of B L0 Bᵀ, N/m, and B L1 Bᵀ, N·s/m, max |l_jk| |b_j| |b_k|: the backward error is not flattered by them.
    pub fn norms(&self, world: &World) -> [f64; 2] {
        let squares: Vec<f64> = self.loads[..self.count()].iter().map(|l| l.iter().map(|v| v * v).sum()).collect();
        let sizes: Vec<f64> = world.sum_all(&squares).into_iter().map(f64::sqrt).collect();
        [0, 1].map(|power| {
            let Some(matrix) = self.matrix(power) else { return 0.0 };
            let entry = |i: usize, j: usize| matrix.get(i, j).abs() * sizes[i] * sizes[j];
            let each = (0..sizes.len()).flat_map(|i| (0..sizes.len()).map(move |j| (i, j)));
            each.map(|(i, j)| entry(i, j)).fold(0.0, f64::max)
        })
    }
}

/// What modal terms add to an inverse at λ: with A the dynamic stiffness without them, L = λ L1 + L0, Z = A⁻¹B and G = BᵀZ,
/// (A + B L Bᵀ)⁻¹ = A⁻¹ − Z (I + L G)⁻¹ L Zᵀ (M. A. Woodbury, 1950).
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

    /// What it takes off the receptance of the contact rows: (YZ) (I + L G)⁻¹ L (YZ)ᵀ, `[3m, 3m]`.
    pub fn receptance(&self) -> Mat<C> {
        &self.motion * self.solve(&self.motion.transpose().to_owned())
    }

    /// Factors of the columns of Z that are taken off a solution whose amplitudes without modal terms are `amplitudes`, under contact forces
    /// `forces`, `[modes]`.
    pub fn factors(&self, amplitudes: &[C], forces: &[C]) -> Vec<C> {
        let rows = self.motion.nrows();
        let g = Mat::from_fn(self.terms.nrows(), 1, |k, _| {
            amplitudes[k] + (0..rows).map(|i| self.motion[(i, k)] * forces[i]).sum::<C>()
        });
        let g = self.solve(&g);
        (0..g.nrows()).map(|k| g[(k, 0)]).collect()
    }
}
