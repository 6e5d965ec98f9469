//! Stability of a cycle: Floquet multipliers.
//!
//! Few modes are followed themselves; of many, and where the contact remembers more than a period, the contact is
//! linearised and closed through the modes (`hill`).
//!
//! A small change of every modal displacement and velocity y at phase zero is followed through a period by the
//! linearised steps of the transient: y makes Φ_yy y of itself and leaves Φ_cy y in the contact. This is U z with few
//! independent changes U of the contact (a singular value decomposition), which are followed through a period as well.
//! The contact forgets within a period what it knew before, Φ_cc Φ_cy = 0, and multipliers are the eigenvalues of
//!
//! y⁺ = Φ_yy y + Φ_yc U z,   z⁺ = U⁻¹ Φ_cy y

use super::balance::{Balance, Conditions, PeriodicSolution, Resolution};
use super::hill::multipliers_near_the_circle;
use super::structure::Structure;
use crate::transient::stepper::{Settings, State, StateChanges, Stepper};
use crate::transient::{Energy, Model, Scheme};
use crate::{Error, Result};
use faer::Mat;

type C = num_complex::Complex<f64>;

/// Residual of the contact laws of a step relative to the normal force.
const SHARP: f64 = 1e-12;

/// Floquet multipliers of a cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Multipliers {
    /// Largest multipliers in size, one of each conjugate pair, without the one that belongs to the phase.
    pub values: Vec<C>,
    /// The one that belongs to the phase, to be 1.
    pub phase: C,
}

/// Sequences of a window beside two for each harmonic.
const SPILL: usize = 13;
/// Multipliers that are told of a cycle.
const TOLD: usize = 12;
/// Distance of two multipliers that are conjugate.
const PAIR: f64 = 1e-12;
/// Error of the multiplier of a motion that nothing holds.
const FREE: f64 = 1e-2;
/// Growth of the logarithm in a period that the rounding of a march may make.
const ROUNDING: f64 = 1e-6;

impl Multipliers {
    /// Error of the sizes of multipliers, as far as that of the phase tells.
    pub(super) fn error(&self) -> f64 {
        ROUNDING + 2.0 * (self.phase - 1.0).norm()
    }

    /// Number of multipliers outside the unit circle, both of a pair counted.
    pub fn unstable(&self) -> usize {
        let out = self.values.iter().filter(|v| v.norm() > 1.0 + self.error());
        out.map(|v| if v.im.abs() > 0.0 { 2 } else { 1 }).sum()
    }

    /// True if small deviations go back.
    pub fn is_stable(&self) -> bool {
        self.unstable() == 0
    }
}

/// The multipliers of `cycle`, by the way that costs less.
pub fn multipliers(
    structure: &Structure<'_>,
    conditions: &Conditions,
    cycle: &PeriodicSolution,
    resolution: Resolution,
) -> Result<Multipliers> {
    let samples = resolution.samples;
    let balance = Balance::new(structure, conditions, resolution, 1.0, &cycle.contact)?;
    let h = 2.0 * std::f64::consts::PI / (samples as f64 * cycle.omega);
    let delays = balance.delays(&cycle.contact, h);
    // Columns times periods: sequences of a window of so many harmonics, or displacements and velocities of all modes
    // and, in a second period, fewer changes of the contact (a third of them on two cylinders).
    let columns = structure.rank() * (2 * resolution.harmonics + SPILL) * (1 + delays);
    match delays > 1 || columns < 3 * structure.model.omega.len() {
        true => through_kernel(structure, conditions, cycle, resolution),
        false => through_modes(structure, conditions, cycle, samples),
    }
}

/// Multipliers from the kernel of the contact.
pub(super) fn through_kernel(
    structure: &Structure<'_>,
    conditions: &Conditions,
    cycle: &PeriodicSolution,
    resolution: Resolution,
) -> Result<Multipliers> {
    sorted(multipliers_near_the_circle(structure, conditions, cycle, resolution)?, structure.free.is_some())
}

/// Multipliers from the monodromy matrix of all modes.
pub(super) fn through_modes(
    structure: &Structure<'_>,
    conditions: &Conditions,
    cycle: &PeriodicSolution,
    samples: usize,
) -> Result<Multipliers> {
    let m = structure.model.omega.len();
    let h = 2.0 * std::f64::consts::PI / (samples as f64 * cycle.omega);
    let load = if conditions.load.is_empty() { structure.model.load } else { &conditions.load };
    let model = Model { interface: &conditions.interface, load, ..structure.model.clone() };
    let settings = Settings {
        scheme: Scheme { step: h, theta: 0.5 },
        tolerance: conditions.settings.tolerance.min(SHARP),
        ..conditions.settings.clone()
    };
    let [q, v] = &cycle.state;
    let start = State {
        step: 0,
        q: q.clone(),
        v: v.clone(),
        reaction: cycle.contact.reaction.clone(),
        motions: cycle.contact.motions.clone(),
        creep: [0.0; 2],
        friction: cycle.contact.friction.clone(),
        energy: Energy::default(),
    };
    let omega = structure.model.omega.to_vec();
    let typical = 2.0 * std::f64::consts::PI * cycle.frequency;
    // In √J: displacements count by the frequency of their modes.
    let weight = |k: usize| omega[k].max(typical);
    let mut stepper = Stepper::new(model, settings, start)?;
    let unit = |part: usize| {
        Mat::from_fn(m, 2 * m, |i, column| match (column == part * m + i, part) {
            (true, 0) => 1.0 / weight(i),
            (true, _) => 1.0,
            (false, _) => 0.0,
        })
    };
    let mut changes = StateChanges::of_modes(&stepper, unit(0), unit(1));
    let follow = |stepper: &mut Stepper<'_>, changes: &mut StateChanges| -> Result<Mat<f64>> {
        (0..samples).try_for_each(|_| stepper.advance_modes_with(changes))?;
        let [q, v] = changes.modes();
        Ok(Mat::from_fn(2 * m, q.ncols(), |i, column| match i < m {
            true => weight(i) * q[(i, column)],
            false => v[(i - m, column)],
        }))
    };
    let own = follow(&mut stepper, &mut changes)?;
    let mut kept = changes.kept_by_the_contact(&stepper)?;
    let later = follow(&mut stepper, &mut kept.changes)?;
    let n = 2 * m;
    let size = n + kept.parts.nrows();
    let monodromy = Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
        (true, true) => own[(i, j)],
        (true, false) => later[(i, j - n)],
        (false, true) => kept.parts[(i - n, j)],
        (false, false) => 0.0,
    });
    let all = monodromy.eigenvalues().map_err(|e| {
        Error::NotConverged(format!("limit cycles: the eigenvalues of the monodromy matrix were not found ({e:?})"))
    })?;
    sorted(all, structure.free.is_some())
}

/// The multipliers among all eigenvalues. One more of 1 belongs to a motion that is `free`: wherever it is, the cycle
/// is the same.
fn sorted(mut all: Vec<C>, free: bool) -> Result<Multipliers> {
    let nearest = |all: &[C]| {
        let apart = |k: usize| (all[k] - 1.0).norm();
        let found = (0..all.len()).min_by(|&a, &b| apart(a).total_cmp(&apart(b)));
        found.ok_or_else(|| Error::Defect("limit cycles: no multipliers".into()))
    };
    let mut phase = all.remove(nearest(&all)?);
    // Both are 1 but for the error of a march, which is that of the phase. Of a pair one alone may be there.
    let paired = phase.im != 0.0 && all.iter().all(|v| (v - phase.conj()).norm() > PAIR);
    if free && !paired {
        let other = all.remove(nearest(&all)?);
        if (other - 1.0).norm() > FREE {
            return Err(Error::NotConverged(format!(
                "limit cycles: the multiplier of a motion that nothing holds is {other:.4}, expected 1"
            )));
        }
        if (other - 1.0).norm() > (phase - 1.0).norm() {
            phase = other;
        }
    }
    all.retain(|v| v.im >= 0.0);
    all.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.re.total_cmp(&a.re)));
    all.truncate(TOLD);
    Ok(Multipliers { values: all, phase })
}
