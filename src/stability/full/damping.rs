//! Damping of the bodies of the full system: Rayleigh's, C = αM + βK, and that of free modes, C = MΦ diag(c) ΦᵀM, a matrix of low
//! rank that enters the inverse at a shift by Woodbury's identity.

use crate::body::fe::BodyModes;
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

/// The body in one of the two places, and how it is damped there.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DampedBody {
    /// Index in the list of bodies.
    pub body: usize,
    /// Rayleigh damping.
    pub damping: Damping,
    /// Damping coefficients c of the body's free modes, which add to it, 1/s, `[modes]`; empty: none.
    pub modal: Vec<f64>,
}

impl DampedBody {
    /// A body with Rayleigh damping.
    pub fn rayleigh(body: usize, damping: Damping) -> Self {
        Self { body, damping, modal: Vec::new() }
    }
}

/// The matrix MΦ diag(c) ΦᵀM of a body in its place.
pub(super) struct ModalDamping {
    /// U = MΦ, this rank's rows of each column, √kg; shared by mirror images.
    pub loads: Rc<Vec<Vec<f64>>>,
    /// c, 1/s.
    coefficients: Vec<f64>,
}

impl ModalDamping {
    /// Collective: MΦ of a body.
    pub fn loads(world: &World, mass: &Operator, modes: &BodyModes) -> Rc<Vec<Vec<f64>>> {
        let product = |phi: &Vec<f64>| {
            let mut load = vec![0.0; phi.len()];
            mass.apply(world, phi, &mut load);
            load
        };
        Rc::new(modes.vectors.iter().map(product).collect())
    }

    /// The damping of modes with these loads and `coefficients`.
    pub fn new(loads: Rc<Vec<Vec<f64>>>, coefficients: &[f64]) -> Result<Self> {
        if loads.len() != coefficients.len() {
            return Err(Error::Defect(format!(
                "{} damping coefficients for {} modes",
                coefficients.len(),
                loads.len()
            )));
        }
        Ok(Self { loads, coefficients: coefficients.to_vec() })
    }

    /// This rank's part of the amplitudes Uᵀ u of a motion, `[modes]`; to be summed over the ranks.
    pub fn amplitudes(&self, u: &[C]) -> Vec<C> {
        self.loads.iter().map(|load| load.iter().zip(u).map(|(l, u)| *l * u).sum()).collect()
    }

    /// Collective: out += `factor` C u.
    pub fn add(&self, world: &World, factor: f64, u: &[C], out: &mut [C]) {
        let amplitudes = world.sum_all(&self.amplitudes(u));
        for ((load, a), c) in self.loads.iter().zip(amplitudes).zip(&self.coefficients) {
            let a = factor * c * a;
            out.iter_mut().zip(load).for_each(|(o, l)| *o += a * *l);
        }
    }

    /// Collective: uᴴ C u.
    pub fn power(&self, world: &World, u: &[C]) -> f64 {
        let amplitudes = world.sum_all(&self.amplitudes(u));
        amplitudes.iter().zip(&self.coefficients).map(|(a, c)| c * a.norm_sqr()).sum()
    }

    /// Collective: a lower bound of the norm of C, max c |MΦ|², N·s/m: the backward error is not flattered by it.
    pub fn norm(&self, world: &World) -> f64 {
        let squares: Vec<f64> = self.loads.iter().map(|l| l.iter().map(|v| v * v).sum()).collect();
        world.sum_all(&squares).iter().zip(&self.coefficients).map(|(s, c)| s * c).fold(0.0, f64::max)
    }
}

/// What modal damping adds to an inverse at λ: with A the dynamic stiffness without it, Z = A⁻¹U and G = UᵀZ,
/// (A + λ U c Uᵀ)⁻¹ = A⁻¹ − Z (I + λ c G)⁻¹ λ c Zᵀ (M. A. Woodbury, 1950).
pub(super) struct ModalCorrection {
    factor: PartialPivLu<C>,
    /// λ c.
    weights: Vec<C>,
    /// Motion of the contact rows by Z, Y Z, `[3m, modes]`.
    pub motion: Mat<C>,
}

impl ModalCorrection {
    /// The correction at `lambda` with `gram` = G and the `motion` of the contact rows, the same on every rank.
    pub fn new(damping: &ModalDamping, lambda: C, gram: &Mat<C>, motion: Mat<C>) -> Self {
        let weights: Vec<C> = damping.coefficients.iter().map(|c| lambda * c).collect();
        let n = weights.len();
        let one = |i, j| if i == j { C::from(1.0) } else { C::default() };
        let a = Mat::from_fn(n, n, |i, j| one(i, j) + weights[i] * gram[(i, j)]);
        Self { factor: a.partial_piv_lu(), weights, motion }
    }

    /// (I + λ c G)⁻¹ λ c g in place, columns of `[modes]`.
    pub fn solve(&self, g: &mut Mat<C>) {
        for j in 0..g.ncols() {
            for (i, w) in self.weights.iter().enumerate() {
                g[(i, j)] *= w;
            }
        }
        self.factor.solve_in_place(g);
    }

    /// What it takes off the receptance of the contact rows: (YZ) (I + λ c G)⁻¹ λ c (YZ)ᵀ, `[3m, 3m]`.
    pub fn receptance(&self) -> Mat<C> {
        let mut g = self.motion.transpose().to_owned();
        self.solve(&mut g);
        &self.motion * &g
    }

    /// Factors of the columns of Z that are taken off a solution whose amplitudes without modal damping are `amplitudes`, under contact forces
    /// `forces`, `[modes]`.
    pub fn factors(&self, amplitudes: &[C], forces: &[C]) -> Vec<C> {
        let rows = self.motion.nrows();
        let mut g = Mat::from_fn(self.weights.len(), 1, |k, _| {
            amplitudes[k] + (0..rows).map(|i| self.motion[(i, k)] * forces[i]).sum::<C>()
        });
        self.solve(&mut g);
        (0..g.nrows()).map(|k| g[(k, 0)]).collect()
    }
}
