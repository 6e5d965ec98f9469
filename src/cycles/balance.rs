//! The equations of a cycle: the contact marched under a given motion, and the modes under the forces that it finds.

use super::prescribed::{Prescribed, PrescribedMotion};
use super::receptance::{discrete, harmonic};
use super::structure::Structure;
use crate::grid::{ContactPatch, Interface};
use crate::transient::stepper::{Settings, State, StateChanges, Stepper};
use crate::transient::{Energy, Model, PatchDrive, Scheme};
use crate::{Error, Result};
use faer::Mat;
use std::cell::RefCell;
use std::f64::consts::PI;
use std::rc::Rc;

type C = num_complex::Complex<f64>;

/// Residual of the contact laws of a step relative to the normal force. Near a resonance the modes move a hundred times
/// as far as a force that is not balanced moves the contact: that of a transient is too coarse for differences.
const SHARP: f64 = 1e-13;

/// How finely a cycle is resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Harmonics H of the motion.
    pub harmonics: usize,
    /// Steps N of the march in a period.
    pub samples: usize,
}

/// Harmonics and steps of a period that lead near a cycle.
const COARSE: Resolution = Resolution { harmonics: 3, samples: 80 };

impl Resolution {
    /// The resolution of equations that only have to lead near a cycle.
    pub fn coarser(self) -> Self {
        Self { harmonics: self.harmonics.min(COARSE.harmonics), samples: self.samples.min(COARSE.samples) }
    }

    /// ω, rad/s, of cycles whose modes have the `frequency`, Hz: in N steps of 2π/(Nω).
    pub fn omega(self, frequency: f64) -> f64 {
        let part = PI / self.samples as f64;
        2.0 * PI * frequency * part / part.tan()
    }
}

/// Conditions at one value of the key.
#[derive(Debug, Clone)]
pub struct Conditions {
    /// Friction law, drive, solver; its step is not used.
    pub settings: Settings,
    /// The interface with the gap of the bodies without load.
    pub interface: Interface,
    /// Loads of the modes that keep the state of rest, N/√kg, `[m]`; none where all bodies are held.
    pub load: Vec<f64>,
}

/// The contact at the phase that a march begins with.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactMemory {
    /// Reactions, N, `[3n]`.
    pub reaction: Vec<f64>,
    /// Coefficients of friction, `[n]`; empty where friction is constant.
    pub friction: Vec<f64>,
    /// Rigid motions, m, `[motions]`; of one patch its approach.
    pub motions: Vec<f64>,
}

impl ContactMemory {
    pub(super) fn from_state(state: &State) -> Self {
        Self { reaction: state.reaction.clone(), friction: state.friction.clone(), motions: state.motions.clone() }
    }
}

/// A march of the contact under a motion.
pub(super) struct MarchResult {
    /// F: what the modes make of the forces less the motion, by the amplitude unit, `[r (2H + 1)]`.
    pub(super) lack: Vec<f64>,
    /// Harmonics of the forces on what acts at the contact, as coefficients like those of the motion, `[r (2H + 1)]`.
    pub(super) coefficients: Vec<f64>,
    /// The contact a period after the start.
    pub(super) memory: ContactMemory,
    /// Angular frequency, rad/s.
    pub(super) omega: f64,
    /// Harmonics of the forces on what acts at the contact, `[N/2][r]`.
    pub(super) pushes: Vec<Vec<C>>,
    /// See [`PeriodicSolution`].
    pub(super) contacts: Vec<ContactPeriod>,
    pub(super) contact: ContactMemory,
    pub(super) drift: f64,
}

/// A period of one contact.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactPeriod {
    /// Force on body 1 (x, y, z) at the end of each step, N, `[N][3]`.
    pub force: Vec<[f64; 3]>,
    /// Closed and sticking nodes at the end of each step, `[N][2]`.
    pub nodes: Vec<[usize; 2]>,
}

impl ContactPeriod {
    /// Root mean square of the force about its mean (x, y, z), and the mean, N.
    pub fn sway(&self) -> [[f64; 3]; 2] {
        let count = self.force.len().max(1) as f64;
        let mean = [0, 1, 2].map(|c| self.force.iter().map(|f| f[c]).sum::<f64>() / count);
        let rms = |c: usize| (self.force.iter().map(|f| (f[c] - mean[c]).powi(2)).sum::<f64>() / count).sqrt();
        [[0, 1, 2].map(rms), mean]
    }

    /// Least and largest normal force, N.
    pub fn normal(&self) -> [f64; 2] {
        let normal = || self.force.iter().map(|f| -f[2]);
        [normal().fold(f64::INFINITY, f64::min), normal().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Mean and largest share of the closed nodes that stick.
    pub fn stick(&self) -> [f64; 2] {
        let share = || self.nodes.iter().map(|n| n[1] as f64 / n[0].max(1) as f64);
        [share().sum::<f64>() / self.nodes.len().max(1) as f64, share().fold(0.0, f64::max)]
    }

    /// Fewest closed nodes.
    pub fn closed(&self) -> usize {
        self.nodes.iter().map(|n| n[0]).min().unwrap_or(0)
    }
}

/// A cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicSolution {
    /// Angular frequency, rad/s, in steps of 2π/(Nω).
    pub omega: f64,
    /// Frequency that the modes have, Hz: s_1/(2π).
    pub frequency: f64,
    /// Mean kinetic energy of the modes, J.
    pub kinetic: f64,
    /// The contacts over the period.
    pub contacts: Vec<ContactPeriod>,
    /// Modal amplitudes at the multiples 0, 1, … of the frequency, `[..][m]`.
    pub modal: Vec<Vec<C>>,
    /// Mean velocity of the motion that nothing holds, m √kg/s; 0 where there is none.
    pub drift: f64,
    /// Displacements and velocities of the modes at phase zero, `[m]`.
    pub state: [Vec<f64>; 2],
    /// The contact at phase zero.
    pub contact: ContactMemory,
    /// The contact at the phase where marches begin.
    pub begin: ContactMemory,
}

impl PeriodicSolution {
    /// Complex amplitudes at the multiples 1, 2, … of the frequency, of the modal velocities and then of the forces on
    /// body 1 at each of C contacts, `[..][m + 3C]`.
    pub fn lines(&self) -> Vec<Vec<C>> {
        let samples = self.contacts.first().map_or(0, |contact| contact.force.len());
        let at = |n: usize| self.contacts.iter().flat_map(|contact| contact.force[n]).collect();
        let force: Vec<Vec<f64>> = (0..samples).map(at).collect();
        let base = 2.0 * PI * self.frequency;
        let line = |(k, q): (usize, &Vec<C>)| {
            let rate = C::new(0.0, k as f64 * base);
            q.iter().map(|q| rate * q).chain(harmonic(&force, k)).collect()
        };
        self.modal.iter().enumerate().skip(1).map(line).collect()
    }

    /// Root mean square of a velocity about its mean: `row` over the modal ones, `[m]`, m/s.
    pub fn velocity(&self, row: &[f64]) -> f64 {
        let base = 2.0 * PI * self.frequency;
        let one = |(k, q): (usize, &Vec<C>)| {
            let v: C = row.iter().zip(q).map(|(r, q)| *q * *r).sum();
            0.5 * (v.norm() * k as f64 * base).powi(2)
        };
        self.modal.iter().enumerate().skip(1).map(one).sum::<f64>().sqrt()
    }
}

/// The equations of the cycles at one value of the key.
pub struct Balance<'a, 's> {
    pub(super) structure: &'s Structure<'a>,
    conditions: &'s Conditions,
    pub(super) resolution: Resolution,
    pub(super) stepper: Stepper<'s>,
    pub(super) course: Rc<RefCell<PrescribedMotion>>,
    /// Unit of the motion, m √kg.
    unit: f64,
    /// Growth rate of the motion, 1/s.
    growth: f64,
}

impl<'a, 's> Balance<'a, 's> {
    /// Equations on `structure` under `conditions`; `unit` is what the motion is measured by, `memory` the contact that
    /// marches begin with.
    pub fn new(
        structure: &'s Structure<'a>,
        conditions: &'s Conditions,
        resolution: Resolution,
        unit: f64,
        memory: &ContactMemory,
    ) -> Result<Self> {
        let course = Rc::new(RefCell::new(PrescribedMotion::default()));
        let r = structure.rank();
        let model = Model {
            interface: &conditions.interface,
            residual: structure.model.residual,
            modes: structure.basis(),
            omega: &structure.zeros,
            stiffness: vec![0.0; r].into(),
            damping: vec![0.0; r].into(),
            turning: None,
            carried: None,
            load: &[],
        };
        let n = conditions.interface.len();
        if let Some(k) = (0..3 * n).find(|&k| !(model.residual[(k, k)] > 0.0)) {
            return Err(Error::Job(format!(
                "limit cycles: the residual compliance of contact node {} in direction {} is {:.3e} m/N; expected a \
                 contact with a compliance of its own beside the modes. Keep fewer modes",
                k / 3,
                ["x", "y", "n"][k % 3],
                model.residual[(k, k)]
            )));
        }
        let start = state(vec![0.0; r], memory);
        let tolerance = conditions.settings.tolerance.min(SHARP);
        let settings = Settings { scheme: Scheme { step: 1e-5, theta: 0.5 }, tolerance, ..conditions.settings.clone() };
        let stepper = Stepper::driven(model, settings, start, Box::new(Prescribed(course.clone())))?;
        Ok(Self { structure, conditions, resolution, stepper, course, unit, growth: 0.0 })
    }

    /// The same of motions whose harmonics grow with the rate `growth`, 1/s, as far as the modes are concerned.
    pub(super) fn growing(self, growth: f64) -> Self {
        Self { growth, ..self }
    }

    /// s_k, 1/s.
    fn exponent(&self, k: usize, omega: f64, h: f64) -> C {
        C::new(if k == 0 { 0.0 } else { self.growth }, discrete(k, omega, h))
    }

    /// Steps before the period whose forces are taken: as long as the material takes through the contacts, and at
    /// points a period.
    pub(super) fn forgetting(&self, memory: &ContactMemory, h: f64) -> usize {
        let s = &self.conditions.interface;
        if s.are_points() {
            return self.resolution.samples;
        }
        let steps = |(patch, drive): (&ContactPatch, &PatchDrive)| {
            let closed = patch.nodes().filter(|&i| memory.reaction[3 * i + 2] > 0.0).map(|i| s.point(i)[0]);
            let (low, high) = closed.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            let spacing = patch.x.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
            (((high - low).max(0.0) + 6.0 * spacing) / (drive.speed * h)).ceil()
        };
        let patches = s.patches.iter().zip(&self.conditions.settings.drive.patches);
        patches.map(steps).fold(8.0, f64::max) as usize
    }

    /// Displacement of the motion that nothing holds over a radian of the phase, m √kg, where it counts among the
    /// coefficients `z`.
    fn drift(&self, z: &[f64]) -> f64 {
        self.structure.free.as_ref().map_or(0.0, |_| self.unit * z[self.structure.rank() - 1])
    }

    /// Marches the contact under the motion with the coefficients `z` (`[size]`: the mean, then the cosine and the
    /// sine of each harmonic, `[r]` each, in units) and the angular frequency `omega`, rad/s, from `memory`, the
    /// contact at the phase where a march of this step begins.
    pub(super) fn march(&mut self, z: &[f64], omega: f64, memory: &ContactMemory) -> Result<MarchResult> {
        let Resolution { harmonics, samples } = self.resolution;
        let r = self.structure.rank();
        let h = 2.0 * PI / (samples as f64 * omega);
        let (before, _) = self.begin(z, h, memory)?;
        let mut after = None;
        let mut contact = None;
        let mut forces = vec![Vec::new(); samples];
        let period = ContactPeriod { force: vec![[0.0; 3]; samples], nodes: vec![[0; 2]; samples] };
        let mut contacts = vec![period; self.conditions.interface.patches.len()];
        for step in 1..=before + samples {
            self.stepper.advance()?;
            if step == samples {
                after = Some(ContactMemory::from_state(self.stepper.state()));
            }
            if step == before + samples {
                contact = Some(ContactMemory::from_state(self.stepper.state()));
            }
            if step > before {
                // The last step ends where the period began: at phase zero.
                let n = (step - before) % samples;
                forces[n] = self.stepper.modal_force().unwrap_or_default().to_vec();
                for (contact, patch) in contacts.iter_mut().zip(&self.stepper.report().patches) {
                    contact.force[n] = patch.force;
                    contact.nodes[n] = [patch.closed, patch.stick];
                }
            }
        }
        let (Some(after), Some(contact)) = (after, contact) else {
            return Err(Error::Defect("limit cycles: a march without steps".into()));
        };
        let pushes: Vec<Vec<C>> = (0..samples.div_ceil(2)).map(|k| harmonic(&forces, k)).collect();
        let (mut lack, mut coefficients) = (Vec::with_capacity(z.len()), Vec::with_capacity(z.len()));
        for (k, push) in pushes.iter().enumerate().take(harmonics + 1) {
            let mut seen = self.structure.contact_response(k, self.exponent(k, omega, h), push)?;
            let own = |part: usize, i: usize| z[r * part + i];
            coefficients.extend(push.iter().map(|p| p.re));
            if k > 0 {
                coefficients.extend(push.iter().map(|p| -p.im));
            } else if let Some(free) = &self.structure.free {
                let slot = r - 1;
                coefficients[slot] += self.conditions.load.get(free.mode).copied().unwrap_or(0.0) / free.size;
                let turned = self.drift(z) * omega / free.size;
                seen.iter_mut().zip(&free.gyroscopic).for_each(|(z, by)| *z += by * turned);
                let force = coefficients[slot] - free.damping * turned / free.size;
                seen[slot] = C::new(self.unit * own(0, slot) + free.receptance(omega) * force, 0.0);
            }
            if k == 0 {
                lack.extend(seen.iter().enumerate().map(|(i, s)| s.re / self.unit - own(0, i)));
            } else {
                lack.extend(seen.iter().enumerate().map(|(i, s)| s.re / self.unit - own(2 * k - 1, i)));
                lack.extend(seen.iter().enumerate().map(|(i, s)| -s.im / self.unit - own(2 * k, i)));
            }
        }
        let drift = self.structure.free.as_ref().map_or(0.0, |free| self.drift(z) * omega / free.size);
        Ok(MarchResult { lack, coefficients, memory: after, omega, pushes, contacts, contact, drift })
    }

    /// Reactions, N, `[3n]`, and statuses, `[n]`, of all nodes over the period whose forces a
    /// [`march`](Self::march) takes, at the phases 2πk/N, `[N]`.
    pub(super) fn nodal_fields(
        &mut self,
        z: &[f64],
        omega: f64,
        memory: &ContactMemory,
    ) -> Result<Vec<(Vec<f64>, Vec<u8>)>> {
        let samples = self.resolution.samples;
        let (before, _) = self.begin(z, 2.0 * PI / (samples as f64 * omega), memory)?;
        let mut all = vec![(Vec::new(), Vec::new()); samples];
        for step in 1..=before + samples {
            self.stepper.advance()?;
            if step > before {
                all[(step - before) % samples] = (self.stepper.state().reaction.clone(), self.stepper.fields().state);
            }
        }
        Ok(all)
    }

    /// Begins a march in steps of `h`, s: the number of steps before the period whose forces are taken, and the sample
    /// that it starts from.
    fn begin(&mut self, z: &[f64], h: f64, memory: &ContactMemory) -> Result<(usize, usize)> {
        if !(h > 0.0 && h.is_finite()) {
            return Err(Error::NotConverged(format!("limit cycles: steps of {h} s")));
        }
        let samples = self.resolution.samples;
        let before = self.forgetting(memory, h);
        let motion: Vec<Vec<f64>> = (0..samples).map(|n| self.sample(z, n)).collect();
        let start = (samples - before % samples) % samples;
        {
            let mut course = self.course.borrow_mut();
            course.samples.clone_from(&motion);
            course.next = (start + 1) % samples;
            (course.drift, course.gone) = (self.drift(z) * 2.0 * PI / samples as f64, 0.0);
        }
        self.stepper.restart(h, state(motion[start].clone(), memory))?;
        Ok((before, start))
    }

    /// Derivatives of the forces of [`march`](Self::march) (as coefficients, `[size]`) with respect to the motion `z`,
    /// `[size, size]`, at the steps as they are.
    pub(super) fn force_derivative(&mut self, z: &[f64], omega: f64, memory: &ContactMemory) -> Result<Mat<f64>> {
        let Resolution { harmonics, samples } = self.resolution;
        let (r, size) = (self.structure.rank(), z.len());
        let h = 2.0 * PI / (samples as f64 * omega);
        let (before, start) = self.begin(z, h, memory)?;
        // The functions of the motion at a sample: 1, cos θ, sin θ, cos 2θ, …
        let functions = |n: usize| -> Vec<f64> {
            let angle = |k: usize| 2.0 * PI * ((k * n) % samples) as f64 / samples as f64;
            let one =
                |b: usize| if b > 0 && b.is_multiple_of(2) { angle(b / 2).sin() } else { angle(b.div_ceil(2)).cos() };
            (0..=2 * harmonics).map(one).collect()
        };
        let (unit, drifts) = (self.unit, self.structure.free.is_some());
        let motion = |n: usize, steps: usize| {
            let all = functions(n);
            let gone = 2.0 * PI * steps as f64 / samples as f64;
            let part = |column: usize| if drifts && column == r - 1 { gone } else { all[column / r] };
            Mat::from_fn(r, size, |i, column| if column % r == i { unit * part(column) } else { 0.0 })
        };
        let mut changes = StateChanges::of_motion(&self.stepper, motion(start, 0));
        let mut derivative = Mat::<f64>::zeros(size, size);
        for step in 1..=before + samples {
            let n = (start + step) % samples;
            self.stepper.advance_with(&mut changes, motion(n, step).as_ref())?;
            if step > before {
                let weight = |b: usize| if b == 0 { 1.0 } else { 2.0 } / samples as f64;
                let weights: Vec<f64> = functions(n).iter().enumerate().map(|(b, f)| weight(b) * f).collect();
                let force = changes.force();
                for column in 0..size {
                    let to = derivative.col_as_slice_mut(column);
                    (0..size).for_each(|row| to[row] += weights[row / r] * force[(row % r, column)]);
                }
            }
        }
        Ok(derivative)
    }

    /// The motion at the phase 2πn/N, m √kg, `[r]`.
    fn sample(&self, z: &[f64], n: usize) -> Vec<f64> {
        let Resolution { harmonics, samples } = self.resolution;
        let r = self.structure.rank();
        let mut out: Vec<f64> = z[..r].iter().map(|z| self.unit * z).collect();
        if self.structure.free.is_some() {
            out[r - 1] = 0.0;
        }
        for k in 1..=harmonics {
            let angle = 2.0 * PI * ((k * n) % samples) as f64 / samples as f64;
            let (cosine, sine) = (&z[r * (2 * k - 1)..][..r], &z[r * 2 * k..][..r]);
            for (o, (a, b)) in out.iter_mut().zip(cosine.iter().zip(sine)) {
                *o += self.unit * (a * angle.cos() + b * angle.sin());
            }
        }
        out
    }
}

/// The state of a driven stepper.
pub(super) fn state(q: Vec<f64>, memory: &ContactMemory) -> State {
    State {
        step: 0,
        v: vec![0.0; q.len()],
        q,
        reaction: memory.reaction.clone(),
        motions: memory.motions.clone(),
        creep: [0.0; 2],
        friction: memory.friction.clone(),
        energy: Energy::default(),
    }
}
