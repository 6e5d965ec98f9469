//! The analysis `cycles`: a branch of limit cycles over a key of the contact, from a cycle that is marched, and the
//! thresholds of rest. All of it on rank 0.

use super::reduction::Reduction;
use super::run::Run;
use crate::case::limit_cycle_point::{watch, LimitCyclePoint};
use crate::case::stability_problem::StabilityProblem;
use crate::case::transient_problem::TransientProblem;
use crate::cycles::branch::{follow, solve, BranchExtent};
use crate::cycles::corrector::Equations;
use crate::cycles::{
    multipliers, Branch, BranchEnd, BranchPoint, Conditions, ContactMemory, Family, Resolution, Special, SpecialKind,
    Structure,
};
use crate::grid::Interface;
use crate::job::{self, key_unit, range, Branches, Job, StabilityState, StartState};
use crate::model::{CoupledModel, ReducedModel};
use crate::output::datasets::branches::{BranchTables, Onset};
use crate::output::Table;
use crate::progress::Progress;
use crate::stop::Stop;
use crate::summary::Summary;
use crate::transient::{Scheme, Stepper};
use crate::{Error, Result};
use std::f64::consts::PI;

/// Values of the key at which rest is looked at, at the least.
const LOOKS: usize = 17;
/// Places of the key, of its range, to which thresholds are located.
const LOCATED: f64 = 1e-6;
/// Periods that the marched cycle goes on in the steps of the equations before they take it up.
const PERIODS: usize = 8;

/// Results.
struct Found {
    tables: Vec<Table>,
    points: Vec<BranchPoint>,
    ends: [BranchEnd; 2],
    onsets: Vec<Onset>,
    marched: f64,
    marches: usize,
}

/// Collective: the branch of `wanted`; tables under `/cycles`.
pub fn run(run: &mut Run, wanted: &Branches, model: &Reduction) -> Result<()> {
    let (world, job, stop) = (run.world(), run.job, run.stop);
    run.progress.stage("limit cycles");
    let progress = &mut *run.progress;
    let found = world.on_root(|| {
        let search = Search { job, wanted, model: model.root()? };
        search.all(stop, progress)
    })?;
    if let Some(found) = found {
        tell(wanted, &found, &mut run.summary);
        run.file.tables(found.tables);
    }
    Ok(())
}

/// The bodies and the key.
#[derive(Clone, Copy)]
struct Search<'a> {
    job: &'a Job,
    wanted: &'a Branches,
    model: &'a ReducedModel,
}

impl Family for Search<'_> {
    fn at(&self, key: f64) -> Result<Conditions> {
        let job = self.job_at(key)?;
        range(&job)?;
        let transient = self.wanted.march.transient(self.state()?);
        let rolling = rolling(&job, &transient, self.bodies())?;
        let ready = rolling.ready()?;
        let model = ready.model(self.bodies().1);
        let (_, settings) = ready.begin(&model, &rolling)?;
        Ok(Conditions { settings, interface: ready.interface().clone() })
    }
}

fn rolling<'a>(
    job: &'a Job,
    wanted: &'a job::Transient,
    model: (&'a Interface, &'a CoupledModel),
) -> Result<TransientProblem<'a>> {
    let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("limit cycles without contact".into()))?;
    Ok(TransientProblem { job, wanted, contact, model })
}

impl<'a> Search<'a> {
    fn bodies(&self) -> (&'a Interface, &'a CoupledModel) {
        (&self.model.interface, &self.model.pair)
    }

    fn job_at(&self, key: f64) -> Result<Job> {
        match self.job.contact_number(&self.wanted.along) == Some(key) {
            true => Ok(self.job.clone()),
            false => self.job.with_contact_number(&self.wanted.along, key),
        }
    }

    fn stability(&self) -> Result<&'a job::Stability> {
        let stability = self.job.analyses.stability.as_ref();
        stability.ok_or_else(|| Error::Defect("limit cycles without stability".into()))
    }

    fn state(&self) -> Result<StartState> {
        Ok(match self.stability()?.state() {
            StabilityState::Sliding => StartState::Sliding,
            StabilityState::Steady => StartState::Steady,
        })
    }

    /// Largest growth rate about rest, 1/s, and its frequency, Hz.
    fn growth(&self, key: f64) -> Result<[f64; 2]> {
        let job = self.job_at(key)?;
        let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("limit cycles without contact".into()))?;
        let examined = StabilityProblem { job: &job, stability: self.stability()?, contact, model: self.bodies() };
        let found = examined.eigenvalues()?.spectrum;
        let first = found.eigenpairs.iter().find(|e| e.frequency() > 0.0);
        Ok(first.map_or([f64::NEG_INFINITY, 0.0], |e| [e.value.re, e.frequency()]))
    }

    /// The values of the key at which rest loses or finds its stability: the zeros of the largest growth rate.
    fn onsets(&self, stop: &Stop, progress: &mut Progress) -> Result<Vec<Onset>> {
        let (from, to) = (self.wanted.from, self.wanted.to);
        let mut found = Vec::new();
        let mut before: Option<(f64, [f64; 2])> = None;
        for look in 0..LOOKS {
            if stop.signalled() {
                return Ok(found);
            }
            progress.step("stability of rest", look, LOOKS);
            let key = from + (to - from) * look as f64 / (LOOKS - 1) as f64;
            let Some(growth) = allowed(self.growth(key))? else {
                before = None;
                continue;
            };
            if let Some(last) = before.filter(|b| (b.1[0] > 0.0) != (growth[0] > 0.0)) {
                found.extend(self.onset(last, (key, growth))?);
            }
            before = Some((key, growth));
        }
        Ok(found)
    }

    /// The zero of the largest growth rate between two values of the key: secants, halving where they do not gain.
    fn onset(&self, mut low: (f64, [f64; 2]), mut high: (f64, [f64; 2])) -> Result<Option<Onset>> {
        let above = high.1[0] > 0.0;
        let close = LOCATED * (self.wanted.to - self.wanted.from);
        for round in 0..60 {
            if high.0 - low.0 <= close {
                break;
            }
            let secant = low.0 - low.1[0] * (high.0 - low.0) / (high.1[0] - low.1[0]);
            // A secant that lands beside the zero leaves most of the bracket: the other end follows it closely.
            let part = ((secant - low.0) / (high.0 - low.0)).clamp(0.0, 1.0);
            let near = 0.4 * close / (high.0 - low.0);
            let part = match round % 3 {
                0 => part - near,
                1 => part + near,
                _ => 0.5,
            };
            let key = low.0 + part.clamp(0.01 * near, 1.0 - 0.01 * near) * (high.0 - low.0);
            let Some(growth) = allowed(self.growth(key))? else { return Ok(None) };
            match (growth[0] > 0.0) == (low.1[0] > 0.0) {
                true => low = (key, growth),
                false => high = (key, growth),
            }
        }
        let frequency = if above { high.1[1] } else { low.1[1] };
        Ok(Some(Onset { key: 0.5 * (low.0 + high.0), frequency, above }))
    }

    fn all(&self, stop: &Stop, progress: &mut Progress) -> Result<Found> {
        let wanted = self.wanted;
        let here = self
            .job
            .contact_number(&wanted.along)
            .ok_or_else(|| Error::Defect(format!("analyses.cycles.along: {} is no number", wanted.along)))?;
        let onsets = self.onsets(stop, progress)?;
        progress.note("marching to the first cycle");
        let attempt = LimitCyclePoint { job: self.job, cycles: &wanted.march, model: self.bodies(), heard: None };
        let Some(motion) = attempt.follow(None)?.motion else {
            let known: Vec<String> = onsets.iter().map(|o| format!("{:.6}", o.key)).collect();
            return Err(Error::Job(format!(
                "analyses.cycles: rest is stable at {} = {here}, so no cycle begins there by itself; expected a \
                 job with an unstable mode{}",
                wanted.along,
                match known.is_empty() {
                    true => String::new(),
                    false => format!("; its stability changes at {} = {}", wanted.along, known.join(", ")),
                }
            )));
        };
        let transient = wanted.march.transient(self.state()?);
        let rolling = rolling(self.job, &transient, self.bodies())?;
        let ready = rolling.ready()?;
        let model = ready.model(self.bodies().1);
        let (rest, settings) = ready.begin(&model, &rolling)?;
        let watched = watch(self.bodies(), &rest);
        let watched: Vec<Vec<f64>> = (0..watched.nrows()).map(|i| watched.row(i).iter().copied().collect()).collect();
        let resolution = Resolution { harmonics: wanted.harmonics as usize, samples: wanted.samples as usize };
        let mut state = rest;
        state.q.iter_mut().zip(&motion.q).for_each(|(q, d)| *q += d);
        state.v.iter_mut().zip(&motion.v).for_each(|(v, d)| *v += d);
        let scheme = Scheme { step: motion.period / resolution.samples as f64, theta: 0.5 };
        let structure = Structure::new(model.clone())?;
        let mut stepper = Stepper::new(model, crate::transient::Settings { scheme, ..settings }, state)?;
        stepper.settle()?;
        for _ in 0..PERIODS * resolution.samples {
            stepper.advance()?;
        }
        let z = structure.follow(&mut stepper, resolution)?;
        let state = stepper.state();
        let memory = ContactMemory {
            reaction: state.reaction.clone(),
            friction: state.friction.clone(),
            approach: state.approach,
        };
        let unit = z[structure.rank()..].iter().map(|z| z * z).sum::<f64>().sqrt();
        let mut equations = Equations {
            structure: &structure,
            family: self,
            resolution,
            unit,
            omega: 2.0 * PI / motion.period,
            key: [here, wanted.to - wanted.from],
            memory,
            marches: 0,
        };
        progress.note(format!("{} unknowns", equations.size() + 1));
        let mut u: Vec<f64> = z.iter().map(|z| z / unit).collect();
        u.extend([1.0, 0.0]);
        let mut jacobian = None;
        let found = solve(&mut equations, u, &mut jacobian)?;
        let values = match wanted.stability {
            true => Some(multipliers(&structure, &self.at(here)?, &found.cycle, resolution.samples)?),
            false => None,
        };
        let start = BranchPoint { key: here, u: found.u, cycle: found.cycle, multipliers: values, special: None };
        let extent = BranchExtent {
            range: [wanted.from, wanted.to],
            most: wanted.most as usize,
            longest: wanted.longest,
            located: LOCATED,
            stability: wanted.stability,
        };
        let Some(jacobian) = jacobian else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
        let mut done = 0;
        let mut step = |_: &BranchPoint| {
            done += 1;
            progress.step("cycles", done, 2 * extent.most);
            Ok(!stop.signalled())
        };
        let down = follow(&mut equations, &start, &jacobian, false, &extent, &mut step)?;
        let up = match down.end {
            BranchEnd::Stopped => Branch { points: vec![start], end: BranchEnd::Stopped },
            _ => follow(&mut equations, &start, &jacobian, true, &extent, &mut step)?,
        };
        let place = down.points.len() - 1;
        let points: Vec<BranchPoint> = down.points.into_iter().rev().chain(up.points.into_iter().skip(1)).collect();
        let unit = key_unit(&wanted.along);
        let tables = BranchTables {
            along: (&wanted.along, &unit),
            points: &points,
            start: place,
            ends: [down.end.text(), up.end.text()],
            watch: &watched,
            onsets: &onsets,
        };
        let (tables, marches) = (tables.tables(), equations.marches);
        let marched = 1.0 / motion.period;
        Ok(Found { tables, points, ends: [down.end, up.end], onsets, marched, marches })
    }
}

/// A result; none where the model does not hold.
fn allowed<T>(found: Result<T>) -> Result<Option<T>> {
    match found {
        Ok(found) => Ok(Some(found)),
        Err(Error::Job(_) | Error::Input(_) | Error::NotConverged(_)) => Ok(None),
        Err(e) => Err(e),
    }
}

/// Writes the lines of the summary.
fn tell(wanted: &Branches, found: &Found, summary: &mut Summary) {
    let key = &wanted.along;
    summary.line(format!(
        "limit cycles over {key}: {} cycles, {} marches of the contact",
        found.points.len(),
        found.marches
    ));
    summary.value("begun at", format!("a cycle of {:.3} Hz that was marched", found.marched));
    for onset in &found.onsets {
        let side = if onset.above { "above" } else { "below" };
        summary
            .value("squeal starts by itself", format!("{side} {key} = {:.7} ({:.3} Hz)", onset.key, onset.frequency));
    }
    let stable = |p: &BranchPoint| p.multipliers.as_ref().is_some_and(|m| m.is_stable());
    // Points where a cycle loses its stability bound them; elsewhere there may be more beyond.
    let bound = |p: &BranchPoint| {
        p.special.filter(|s| !matches!(s.kind, SpecialKind::Stick | SpecialKind::Opening)).map(|s| s.kind.name())
    };
    let range = |of: &dyn Fn(&BranchPoint) -> bool| {
        let all = found.points.iter().filter(|p| of(p));
        let lowest = all.clone().min_by(|a, b| a.key.total_cmp(&b.key))?;
        Some([lowest, all.max_by(|a, b| a.key.total_cmp(&b.key))?])
    };
    let (name, ends) = if found.points.iter().any(stable) {
        ("stable cycles", range(&|p| stable(p) || bound(p).is_some()))
    } else {
        ("cycles", range(&|_| true))
    };
    if let Some(ends) = ends {
        let [low, high] = ends.map(|p| match bound(p) {
            Some(kind) => format!("{:.7} ({kind}: squeal that was started ends there)", p.key),
            None => format!("{:.7} (followed no further)", p.key),
        });
        summary.value(name, format!("from {key} = {low} to {high}"));
    }
    for p in &found.points {
        if let Some(Special { kind, second }) = p.special {
            let beat = if second > 0.0 { format!(", beats with {second:.3} Hz") } else { String::new() };
            let text = format!("{key} = {:.7}, {:.3} Hz, {:.4e} J{beat}", p.key, p.cycle.frequency, p.cycle.kinetic);
            summary.value(kind.name(), text);
        }
    }
    let most = found.points.iter().max_by(|a, b| a.cycle.kinetic.total_cmp(&b.cycle.kinetic));
    if let Some(p) = most {
        let text = format!("{:.4e} J at {:.3} Hz, {key} = {:.7}", p.cycle.kinetic, p.cycle.frequency, p.key);
        summary.value("most energy", text);
    }
    let [down, up] = &found.ends;
    let at = |p: Option<&BranchPoint>| p.map_or(f64::NAN, |p| p.key);
    summary.value("first end", format!("{key} = {:.7}, {}", at(found.points.first()), down.text()));
    summary.value("other end", format!("{key} = {:.7}, {}", at(found.points.last()), up.text()));
    if matches!(down, BranchEnd::Stopped) || matches!(up, BranchEnd::Stopped) {
        summary.fail(Error::Stopped("stopped on request along a branch; the cycles so far are in the results".into()));
    }
}
