//! The motion of one point of a sweep, followed to its end, and its file.

use super::stability_problem::StabilityProblem;
use super::transient_problem::{moved, TransientProblem};
use crate::grid::Interface;
use crate::job::{Branch, Cycles, Job, StabilityState, StartState};
use crate::model::CoupledModel;
use crate::output::datasets::checkpoint;
use crate::output::datasets::cycle_motions::MotionModes;
use crate::output::datasets::cycles::Cycle;
use crate::stability::grows;
use crate::stability::nonlinear_eigen::SpectrumMemory;
use crate::transient::cycle::{follow, AmplitudeRecord, CycleMotion, CycleOutcome, CycleSettings};
use crate::transient::{State, Stepper};
use crate::{Error, Result};
use faer::Mat;
use sha2::{Digest, Sha256};
use std::path::PathBuf;

/// Fraction of the initial velocity in the mode below which the motion counts as decayed.
const FLOOR: f64 = 1e-2;

/// A point as it is to be followed.
pub(crate) struct LimitCyclePoint<'a> {
    pub(crate) job: &'a Job,
    pub(crate) cycles: &'a Cycles,
    pub(crate) model: (&'a Interface, &'a CoupledModel),
    /// Quantities recorded for the sound.
    pub(crate) heard: Option<AmplitudeRecord>,
    /// Rank, by growth rate, of the mode that the motion begins with: 0 for the most unstable one.
    pub(crate) mode: usize,
}

/// Outcome of a point.
pub(crate) struct CyclePointOutcome {
    pub(crate) cycle: Cycle,
    /// Motion that the next point begins with.
    pub(crate) motion: Option<CycleMotion>,
    /// Modal displacements of the motion and impulses of C contacts for its sound, `[samples][m + 3C]`.
    pub(crate) heard: Vec<Vec<f64>>,
}

impl CyclePointOutcome {
    fn rest(cycle: Cycle) -> Self {
        Self { cycle, motion: None, heard: Vec::new() }
    }
}

impl LimitCyclePoint<'_> {
    /// Identity of everything that a point depends on, except the points before it.
    pub(crate) fn identity(&self, branch: Branch) -> Result<Vec<u8>> {
        let text =
            |v: serde_json::Value| serde_json::to_vec(&v).map_err(|e| Error::Defect(format!("resolved job: {e}")));
        let own = serde_json::json!({
            "contact": self.job.contact, "bodies": self.job.bodies, "stability": self.job.analyses.stability
        });
        let cycles = Cycles { branches: vec![branch], ..self.cycles.clone() };
        let mut all = text(own)?;
        all.extend(serde_json::to_vec(&cycles).map_err(|e| Error::Defect(format!("resolved job: {e}")))?);
        all.extend(checkpoint::identity(&crate::transient::Model::new(self.model.1, self.model.0)).bytes());
        Ok(all)
    }

    /// The motion of the point from that of the one `before`, or from its own unstable mode.
    pub(crate) fn follow(&self, before: Option<CycleMotion>) -> Result<CyclePointOutcome> {
        let harmonics = self.cycles.harmonics as usize;
        let (Some(wanted), Some(contact)) = (&self.job.analyses.stability, &self.job.contact) else {
            return Err(Error::Defect("a point of a sweep without contact or stability".into()));
        };
        let problem = StabilityProblem { job: self.job, stability: wanted, contact, model: self.model };
        let found = problem.analyse(&SpectrumMemory::default())?;
        let state = match wanted.state() {
            StabilityState::Sliding => StartState::Sliding,
            StabilityState::Steady => StartState::Steady,
        };
        let transient = self.cycles.transient(state);
        let rolling = TransientProblem { job: self.job, wanted: &transient, contact, model: self.model };
        let ready = rolling.ready()?;
        let model = ready.model(self.model.1);
        let (rest, settings) = ready.initial_state(&model, &rolling)?;
        let nodes = [found.contact.nodes.len(), found.spectrum.sticking];
        let mode = found.spectrum.eigenpairs.iter().filter(|e| e.frequency() > 0.0).nth(self.mode);
        let unstable = found.spectrum.eigenpairs.first().is_some_and(|e| grows(e.value, e.backward_error));
        // That of the first contact, as the report of a step has it.
        let first = &rest.reaction[..3 * self.model.0.patches[0].nodes().len()];
        let force = [0, 1, 2].map(|c| {
            let sum: f64 = first.iter().skip(c).step_by(3).sum();
            if c == 2 {
                -sum
            } else {
                sum
            }
        });
        let Some(mode) = mode else { return Ok(CyclePointOutcome::rest(Cycle::at_rest(force, nodes, 0.0, harmonics))) };
        let small = moved(rest.clone(), self.model.1, mode, self.cycles.amplitude);
        let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let own = (small.clone(), 1.0 / mode.frequency());
        let handed = before.filter(|m| m.v.len() == rest.v.len() && size(&m.v) > size(&small.v)).map(|m| {
            let mut state = rest.clone();
            state.q.iter_mut().zip(&m.q).for_each(|(q, d)| *q += d);
            state.v.iter_mut().zip(&m.v).for_each(|(v, d)| *v += d);
            (state, m.period)
        });
        // A motion that was handed on and died out says nothing of an unstable rest.
        let starts = handed.into_iter().chain(unstable.then_some(own));
        let mut time = 0.0;
        for (start, period) in starts {
            let mut stepper = Stepper::new(ready.model(self.model.1), settings.clone(), start)?;
            stepper.settle()?;
            let search = CycleSettings {
                step: self.cycles.step,
                period,
                settled: self.cycles.settled,
                longest: self.cycles.duration - time,
                floor: FLOOR * size(&small.v),
                stable: !unstable,
                nodes,
                harmonics,
                watch: watch(self.model, &rest, 0),
                heard: self.heard,
            };
            let followed = follow(&mut stepper, &rest, &search)?;
            time += followed.time;
            if let (Some(mut cycle), true) = (Cycle::from_followed(&followed), followed.fate != CycleOutcome::Rest) {
                cycle.time = time;
                let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
                let period = followed.motion.as_ref().map_or(period, |(r, _)| r.period / r.crossings.max(1) as f64);
                let period = if period > 0.0 { period } else { 1.0 / mode.frequency() };
                let motion =
                    CycleMotion { q: apart(&followed.state.q, &rest.q), v: apart(&followed.state.v, &rest.v), period };
                let heard = followed.motion.map(|(_, record)| record.heard).unwrap_or_default();
                return Ok(CyclePointOutcome { cycle, motion: Some(motion), heard });
            }
        }
        Ok(CyclePointOutcome::rest(Cycle::at_rest(force, nodes, time, harmonics)))
    }
}

/// Velocities of the lower and the upper body along x, y and n at the closed node nearest to the middle of the contact
/// `patch`, over the modal ones, `[6, m]`.
pub(crate) fn watch((interface, pair): (&Interface, &CoupledModel), rest: &State, patch: usize) -> Mat<f64> {
    let nodes = interface.patches[patch].nodes();
    let weight = |i: usize| rest.reaction[3 * i + 2];
    let total: f64 = nodes.clone().map(weight).sum();
    let middle = [0, 1].map(|c| nodes.clone().map(|i| weight(i) * interface.point(i)[c]).sum::<f64>() / total);
    let far = |i: &usize| {
        let [x, y] = interface.point(*i);
        (x - middle[0]).hypot(y - middle[1])
    };
    let closed = nodes.clone().filter(|&i| weight(i) > 0.0);
    let node = closed.min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(nodes.start);
    at_node(pair, node)
}

/// The modes that motions consist of, with their displacements at the middle of the grid of the first contact.
pub(crate) fn motion_modes((interface, pair): (&Interface, &CoupledModel)) -> MotionModes {
    let nodes = interface.patches[0].nodes();
    let middle = [0, 1].map(|c| {
        let at = || nodes.clone().map(|i| interface.point(i)[c]);
        0.5 * (at().fold(f64::INFINITY, f64::min) + at().fold(f64::NEG_INFINITY, f64::max))
    });
    let far = |i: &usize| {
        let [x, y] = interface.point(*i);
        (x - middle[0]).hypot(y - middle[1])
    };
    let node = nodes.clone().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(nodes.start);
    let rows = at_node(pair, node);
    let at_contact = (0..6).flat_map(|row| rows.row(row).iter().copied().collect::<Vec<f64>>()).collect();
    MotionModes { omega: pair.omega.clone(), at_contact }
}

/// Motions of the lower and the upper body along x, y and n at a contact node over the modal ones, `[6, m]`.
fn at_node(pair: &CoupledModel, node: usize) -> Mat<f64> {
    Mat::from_fn(6, pair.omega.len(), |row, k| {
        let lower = k < pair.lower_modes;
        if (row < 3) == lower {
            pair.modes[(3 * node + row % 3, k)]
        } else {
            0.0
        }
    })
}

/// The file of a point that is done.
pub(crate) struct PointCache {
    pub(crate) path: PathBuf,
    pub(crate) identity: [u8; 32],
}

impl PointCache {
    /// Cycle and motion, if they are there, whole, and of this point.
    pub(crate) fn read(&self, modes: usize) -> Option<(Cycle, Option<CycleMotion>)> {
        let bytes = std::fs::read(&self.path).ok()?;
        let (body, sum) = bytes.split_at_checked(bytes.len().checked_sub(32)?)?;
        let (identity, numbers) = body.split_at_checked(32)?;
        if identity != self.identity || sum != Sha256::digest(body).as_slice() {
            return None;
        }
        let mut eight = [0; 8];
        let number = |b: &[u8]| {
            eight.copy_from_slice(b);
            f64::from_le_bytes(eight)
        };
        let numbers: Vec<f64> = numbers.chunks_exact(8).map(number).collect();
        let (length, numbers) = numbers.split_first()?;
        let (cycle, motion) = numbers.split_at_checked(*length as usize)?;
        let motion = match motion {
            [] => None,
            [period, all @ ..] if all.len() == 2 * modes => {
                Some(CycleMotion { period: *period, q: all[..modes].to_vec(), v: all[modes..].to_vec() })
            }
            _ => return None,
        };
        Some((Cycle::from_numbers(cycle)?, motion))
    }

    pub(crate) fn write(&self, cycle: &Cycle, motion: Option<&CycleMotion>) -> Result<()> {
        let cycle = cycle.numbers();
        let mut numbers = vec![cycle.len() as f64];
        numbers.extend(cycle);
        if let Some(m) = motion {
            numbers.push(m.period);
            numbers.extend(m.q.iter().chain(&m.v));
        }
        let mut bytes = self.identity.to_vec();
        bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
        let sum = Sha256::digest(&bytes);
        bytes.extend(sum);
        let partial = self.path.with_extension("partial");
        let fail = |e: std::io::Error| Error::Io(format!("{}: cannot keep a limit cycle: {e}", self.path.display()));
        std::fs::write(&partial, bytes).map_err(fail)?;
        std::fs::rename(&partial, &self.path).map_err(fail)
    }
}
