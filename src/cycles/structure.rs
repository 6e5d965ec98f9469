//! The modes of both bodies as the equations of a cycle have them: by the functions of them that act at the contact.

use super::balance::{MarchResult, PeriodicSolution, Resolution};
use super::free::{self, FreeMotion};
use super::poles::Poles;
use super::receptance::{discrete, harmonic};
use crate::model::ModalDynamics;
use crate::transient::low_rank_modes::factors;
use crate::transient::stepper::Stepper;
use crate::transient::Model;
use crate::{Error, Result};
use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, MatRef};
use std::f64::consts::PI;

type C = num_complex::Complex<f64>;

/// Columns of Ψ that are shorter than this part of the longest one are left out of what acts at the contact.
pub const LOSSLESS: f64 = 1e-4;

/// Multiples of the frequency, at the least, whose motion is told.
const TOLD: usize = 12;

/// The modes of both bodies, and the functions of them that act at the contact, Ψ = B Cᵀ.
#[derive(Clone)]
pub struct Structure<'a> {
    pub(super) model: Model<'a>,
    /// B, `[3n, r]`.
    basis: Mat<f64>,
    /// C, column by column, `[r][m]`.
    pub(super) mix: Vec<Vec<f64>>,
    /// Frequencies of the functions of a march, whose motion is given: none, `[r]`.
    pub(super) zeros: Vec<f64>,
    pub(super) poles: Poles,
    /// Eigenvalues, 1/s, with ξ and β of [`Poles::at_contact`].
    pub(super) contact_poles: Vec<(C, Vec<C>, Vec<C>)>,
    /// Motion of what acts at the contact under the loads of the modes, `[r]`.
    pub(super) loaded: Vec<C>,
    /// The motion that nothing holds, which acts at the contact by the last function.
    pub(super) free: Option<FreeMotion>,
}

impl<'a> Structure<'a> {
    /// Columns of `model`, to [`LOSSLESS`].
    pub fn new(model: Model<'a>) -> Result<Self> {
        let (rows, whole) = model.modes.shape();
        let free = free::mode(&model)?;
        // A motion that nothing holds has a function of its own.
        let held = Mat::from_fn(rows, whole, |i, k| if Some(k) == free { 0.0 } else { model.modes[(i, k)] });
        let [mut basis, mut mix] = factors(held.as_ref(), whole, LOSSLESS)
            .ok_or_else(|| Error::Defect("limit cycles: the modes at the contact are no numbers".into()))?;
        if let Some(mode) = free {
            let size = model.modes.col(mode).norm_l2();
            basis.push(model.modes.col(mode).iter().map(|v| v / size).collect());
            mix.push((0..whole).map(|k| if k == mode { size } else { 0.0 }).collect());
        }
        let basis = Mat::from_fn(rows, basis.len(), |i, k| basis[k][i]);
        Self::on(model, (basis, mix), free)
    }

    /// The same modes with other equations of motion.
    pub fn with(&self, dynamics: ModalDynamics) -> Result<Self> {
        let ModalDynamics { stiffness, damping, turning } = dynamics;
        let model = Model { stiffness, damping, turning, ..self.model.clone() };
        Self::on(model, (self.basis.clone(), self.mix.clone()), self.free.as_ref().map(|free| free.mode))
    }

    fn on(mut model: Model<'a>, (basis, mix): (Mat<f64>, Vec<Vec<f64>>), free: Option<usize>) -> Result<Self> {
        if let Some(mode) = free {
            model.stiffness = free::on_spring(&model.stiffness, mode);
        }
        let zeros = vec![0.0; mix.len()];
        let poles = Poles::new(&model)?;
        let contact_poles = poles.at_contact(&mix);
        let mut new = Self { model, basis, mix, zeros, poles, contact_poles, loaded: Vec::new(), free: None };
        let load = new.model.load.iter().enumerate();
        let load: Vec<C> = load.map(|(k, l)| C::new(if Some(k) == free { 0.0 } else { *l }, 0.0)).collect();
        if !load.is_empty() {
            new.loaded = new.at_contact(&new.response(C::default(), &load)?);
        }
        if let Some(mode) = free {
            let force = (0..new.model.omega.len()).map(|k| match k == mode {
                true => C::default(),
                false => C::new(-new.model.damping.get(k, mode), 0.0),
            });
            let moved = new.response(C::default(), &force.collect::<Vec<C>>())?;
            let gyroscopic = new.at_contact(&moved).iter().map(|z| z.re).collect();
            let (size, damping) = (new.mix[new.rank() - 1][mode], new.model.damping.get(mode, mode));
            new.free = Some(FreeMotion { mode, size, damping, gyroscopic });
        }
        Ok(new)
    }

    /// r.
    pub fn rank(&self) -> usize {
        self.mix.len()
    }

    /// Highest angular frequency of a mode, rad/s.
    fn highest(&self) -> f64 {
        self.model.omega.iter().copied().fold(0.0, f64::max)
    }

    /// B, `[3n, r]`.
    pub fn basis(&self) -> MatRef<'_, f64> {
        self.basis.as_ref()
    }

    /// Displacement along x of the contact `nodes`, the mean of them, by the motion that nothing holds, 1/√kg; none
    /// where all are held.
    pub fn free_along(&self, nodes: std::ops::Range<usize>) -> Option<f64> {
        let free = self.free.as_ref()?;
        let count = nodes.len().max(1) as f64;
        Some(free.size * nodes.map(|i| self.basis[(3 * i, self.rank() - 1)]).sum::<f64>() / count)
    }

    /// The motion of what acts at the contact, `[r]`, m √kg, whose displacements come nearest to `displacement`,
    /// `[3n]`, m.
    pub fn projected(&self, displacement: &[f64]) -> Vec<f64> {
        let column = Mat::from_fn(self.basis.nrows(), 1, |i, _| displacement.get(i).copied().unwrap_or(0.0));
        // The function of a motion that nothing holds may be a sum of the others.
        let held = self.rank() - usize::from(self.free.is_some());
        let found = self.basis.as_ref().subcols(0, held).qr().solve_lstsq(column);
        (0..self.rank()).map(|k| if k < held { found[(k, 0)] } else { 0.0 }).collect()
    }
}

impl Structure<'_> {
    /// The cycle that a march belongs to, with the motion of all modes.
    pub(super) fn solution(&self, marched: MarchResult, harmonics: usize) -> Result<PeriodicSolution> {
        let MarchResult { memory, omega, pushes, contacts, contact, drift, .. } = marched;
        let (samples, m) = (contacts[0].force.len(), self.model.omega.len());
        let h = 2.0 * PI / (samples as f64 * omega);
        let reach = (self.highest() / omega).ceil() as usize;
        let told = harmonics.max(TOLD).max(reach).min(samples / 2 - 1);
        let mut modal = Vec::with_capacity(told + 1);
        let (mut kinetic, mut q, mut v) = (0.0, vec![0.0; m], vec![0.0; m]);
        for (k, push) in pushes.iter().enumerate() {
            let mut push = self.spread(push);
            if k == 0 {
                push.iter_mut().zip(self.model.load).for_each(|(p, l)| *p += *l);
                if let Some(free) = &self.free {
                    // Its mean velocity has gyroscopic forces; its own mean force is nothing.
                    push.iter_mut().enumerate().for_each(|(i, p)| *p -= self.model.damping.get(i, free.mode) * drift);
                    push[free.mode] = C::default();
                    v[free.mode] += drift;
                }
            }
            let s = discrete(k, omega, h);
            // Beyond what is told inertia alone is left.
            let moved = match k <= told || self.is_diagonal() {
                true => self.response(C::new(0.0, s), &push)?,
                false => push.iter().map(|p| -p / (s * s)).collect(),
            };
            kinetic += 0.25 * s * s * moved.iter().map(|q| q.norm_sqr()).sum::<f64>();
            q.iter_mut().zip(&moved).for_each(|(q, z)| *q += z.re);
            v.iter_mut().zip(&moved).for_each(|(v, z)| *v -= s * z.im);
            if k <= told {
                modal.push(moved);
            }
        }
        let frequency = discrete(1, omega, h) / (2.0 * PI);
        Ok(PeriodicSolution {
            omega,
            frequency,
            kinetic,
            contacts,
            modal,
            drift,
            state: [q, v],
            contact,
            begin: memory,
        })
    }

    pub(super) fn is_diagonal(&self) -> bool {
        use crate::model::ModalMatrix::Diagonal;
        matches!((&self.model.stiffness, &self.model.damping), (Diagonal(_), Diagonal(_)))
    }

    /// The motion of a stepper on these modes through one period from where it is, in its own steps, as coefficients
    /// (`[r (2H + 1)]`, m √kg) of the unit 1.
    pub fn follow(&self, stepper: &mut Stepper<'_>, resolution: Resolution) -> Result<Vec<f64>> {
        let count = resolution.samples;
        let seen = |stepper: &Stepper<'_>| -> Vec<f64> {
            let q: Vec<C> = stepper.state().q.iter().map(|q| C::new(*q, 0.0)).collect();
            self.at_contact(&q).iter().map(|z| z.re).collect()
        };
        let start = seen(stepper);
        let mut samples = vec![Vec::new(); count];
        for n in 1..=count {
            stepper.advance()?;
            samples[n % count] = seen(stepper);
        }
        // What nothing holds moves on over a period; the first sample is the end of it.
        let slot = self.free.as_ref().map(|_| self.rank() - 1);
        let drift = slot.map_or(0.0, |slot| samples[0][slot] - start[slot]);
        if let Some(slot) = slot {
            let gone = |n: usize| drift * if n == 0 { 1.0 } else { n as f64 / count as f64 };
            samples.iter_mut().enumerate().for_each(|(n, sample)| sample[slot] -= gone(n));
        }
        let mut z = Vec::new();
        for k in 0..=resolution.harmonics {
            let all = harmonic(&samples, k);
            z.extend(all.iter().map(|z| z.re));
            if k > 0 {
                z.extend(all.iter().map(|z| -z.im));
            }
        }
        if let Some(slot) = slot {
            z[slot] = drift / (2.0 * PI);
        }
        Ok(z)
    }
}
