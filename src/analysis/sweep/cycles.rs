//! The limit cycles of the points of a sweep. A chain of points is followed by one rank, each point from where that before it ended; what is done is kept on disk
//! at once, and taken up by a later run of the same points on the same model.

use super::super::stability::Examined;
use super::super::transient::rest::{moved, Rolling};
use super::{goes_on, point_of};
use crate::case::interface::points as points_of;
use crate::contact::points::interface as interface_of;
use crate::grid::Interface;
use crate::job::{Branch, Cycles, Job, StabilityState, StartState, SweepPlan};
use crate::model::{ModalPair, SharedModel};
use crate::output::companion;
use crate::output::datasets::checkpoint;
use crate::output::datasets::cycles::{tables, Cycle};
use crate::output::datasets::sweep::Outcome;
use crate::output::Table;
use crate::parallel::World;
use crate::progress::Progress;
use crate::stability::grows;
use crate::stop::Stop;
use crate::summary::Summary;
use crate::transient::cycle::{follow, Fate, Settings};
use crate::transient::{State, Stepper};
use crate::{Error, Result};
use faer::Mat;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Of the velocities in the mode that a point begins with: what moves less has died out.
const FLOOR: f64 = 1e-2;

/// Points that are followed one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Chain {
    /// Its branch among those of the job.
    branch: usize,
    points: Vec<usize>,
}

/// The chains of the points `members` of `plan`, which share a model.
pub(super) fn chains(plan: &SweepPlan, cycles: &Cycles, members: &[usize]) -> Vec<Chain> {
    let along = along(plan, cycles).unwrap_or(plan.shape.len() - 1);
    // Points that differ in nothing else stand so far apart, and so many of them make a line.
    let stride: usize = plan.shape[along + 1..].iter().product();
    let line = |point: usize| (point / (stride * plan.shape[along]), point % stride);
    let mut lines: Vec<((usize, usize), Vec<usize>)> = Vec::new();
    for &point in members {
        let here = line(point);
        match lines.iter_mut().find(|l| l.0 == here) {
            Some(there) => there.1.push(point),
            None => lines.push((here, vec![point])),
        }
    }
    let mut all = Vec::new();
    for (branch, kind) in cycles.branches.iter().enumerate() {
        for (_, points) in &lines {
            match kind {
                Branch::Mode => all.extend(points.iter().map(|&p| Chain { branch, points: vec![p] })),
                Branch::Up => all.push(Chain { branch, points: points.clone() }),
                Branch::Down => all.push(Chain { branch, points: points.iter().rev().copied().collect() }),
            }
        }
    }
    all
}

/// The dimension of the plan's shape along which branches go.
fn along(plan: &SweepPlan, cycles: &Cycles) -> Option<usize> {
    let key = cycles.along.as_ref()?;
    // Lists side by side have one dimension for all keys.
    plan.keys.iter().position(|k| k == key).map(|k| k.min(plan.shape.len() - 1))
}

/// What one rank needs for its chains.
pub(super) struct Following<'a> {
    pub(super) cycles: &'a Cycles,
    pub(super) points: &'a [Option<Job>],
    /// Where what is done is kept.
    pub(super) folder: &'a Path,
    pub(super) stop: &'a Stop,
}

/// What one rank found, on its way to rank 0.
#[derive(Default)]
pub(super) struct Mine {
    /// [branch, point, how many, numbers of the cycle …] of each point one after the other.
    pub(super) rows: Vec<f64>,
    /// Of those that were not computed "branch point why", each closed by a zero.
    pub(super) text: String,
}

/// All points of all branches, `[branches][points]`.
pub(super) struct All {
    pub(super) cycles: Vec<Option<Cycle>>,
    /// Why some were not computed.
    pub(super) failed: Vec<(usize, usize, String)>,
}

impl All {
    /// None of them yet.
    pub(super) fn of(plan: &SweepPlan, cycles: &Cycles) -> Self {
        Self { cycles: vec![None; cycles.branches.len() * plan.points.len()], failed: Vec::new() }
    }

    /// Takes what the ranks found of `points` points.
    pub(super) fn take(&mut self, rows: &[f64], text: &[u8], points: usize) -> Result<()> {
        let torn = || Error::Defect("limit cycles were torn on their way".into());
        let mut rest = rows;
        while let [branch, point, length, after @ ..] = rest {
            let (numbers, after) = after.split_at_checked(*length as usize).ok_or_else(torn)?;
            let place = self.cycles.get_mut(*branch as usize * points + *point as usize).ok_or_else(torn)?;
            *place = Some(Cycle::from_numbers(numbers).ok_or_else(torn)?);
            rest = after;
        }
        for line in String::from_utf8_lossy(text).split_terminator('\0') {
            let mut parts = line.splitn(3, ' ');
            let mut number = || parts.next().and_then(|p| p.parse().ok()).ok_or_else(torn);
            let (branch, point) = (number()?, number()?);
            self.failed.push((branch, point, parts.next().unwrap_or_default().to_owned()));
        }
        Ok(())
    }
}

/// Where the motion of a point has come to: what the next one begins with.
#[derive(Debug, Clone, PartialEq)]
struct Motion {
    /// Deviations from rest.
    q: Vec<f64>,
    v: Vec<f64>,
    /// s.
    period: f64,
}

impl Following<'_> {
    /// Follows the chains of this rank.
    pub(super) fn all(
        &self,
        world: &World,
        model: &mut SharedModel,
        chains: &[Chain],
        progress: &mut Progress,
    ) -> Result<Mine> {
        let mut found = Mine::default();
        let mine: Vec<&Chain> = chains.iter().skip(world.rank).step_by(world.size).collect();
        let total: usize = mine.iter().map(|c| c.points.len()).sum();
        let mut done = 0;
        for chain in mine {
            let mut before: Option<Motion> = None;
            let mut history = Sha256::new();
            for &point in &chain.points {
                if self.stop.signalled() {
                    return Ok(found);
                }
                let cycle = match self.one(model, chain, point, (&mut before, &mut history)) {
                    // What stability or a step says of one point is that point's.
                    Err(e) if goes_on(&e) => {
                        found.text += &format!("{} {point} {e}\0", chain.branch);
                        Cycle::none(self.cycles.harmonics as usize)
                    }
                    other => other?,
                };
                let numbers = cycle.numbers();
                found.rows.extend([chain.branch as f64, point as f64, numbers.len() as f64]);
                found.rows.extend(numbers);
                done += 1;
                progress.step("limit cycles", done, total);
            }
        }
        Ok(found)
    }

    /// One point, from its file if it is there. `history` is the checksum of all that the point rests on.
    fn one(
        &self,
        model: &mut SharedModel,
        chain: &Chain,
        point: usize,
        (before, history): (&mut Option<Motion>, &mut Sha256),
    ) -> Result<Cycle> {
        let harmonics = self.cycles.harmonics as usize;
        let job = match point_of(self.points, point) {
            Ok(job) => job,
            Err(_) => {
                *before = None;
                return Ok(Cycle::none(harmonics));
            }
        };
        let branch = self.cycles.branches[chain.branch];
        let interface = match job.contact.as_ref().and_then(points_of) {
            Some(points) => interface_of(&points)?,
            None => model.interface.clone(),
        };
        let pair = model.pair(job)?;
        let attempt = Attempt { job, cycles: self.cycles, model: (&interface, pair) };
        history.update(attempt.identity(branch)?);
        let kept = Kept {
            path: self.folder.join(format!("{}-{point:06}", branch.name())),
            identity: history.clone().finalize().into(),
        };
        if let Some((cycle, motion)) = kept.read(harmonics, pair.omega.len()) {
            *before = motion;
            return Ok(cycle);
        }
        let (cycle, motion) = attempt.follow(before.take())?;
        kept.write(&cycle, motion.as_ref())?;
        *before = motion;
        Ok(cycle)
    }
}

/// A point as it is to be followed.
struct Attempt<'a> {
    job: &'a Job,
    cycles: &'a Cycles,
    model: (&'a Interface, &'a ModalPair),
}

impl Attempt<'_> {
    /// What the point rests on, but for the points before it.
    fn identity(&self, branch: Branch) -> Result<Vec<u8>> {
        let text =
            |v: serde_json::Value| serde_json::to_vec(&v).map_err(|e| Error::Defect(format!("resolved job: {e}")));
        let own = serde_json::json!({ "contact": self.job.contact, "bodies": self.job.bodies, "stability": self.job.analyses.stability });
        let cycles = Cycles { branches: vec![branch], ..self.cycles.clone() };
        let mut all = text(own)?;
        all.extend(serde_json::to_vec(&cycles).map_err(|e| Error::Defect(format!("resolved job: {e}")))?);
        all.extend(checkpoint::identity(&crate::transient::Model::of(self.model.1, self.model.0)).bytes());
        Ok(all)
    }

    /// The motion of the point from that of the one `before`, or from its own most unstable mode.
    fn follow(&self, before: Option<Motion>) -> Result<(Cycle, Option<Motion>)> {
        let harmonics = self.cycles.harmonics as usize;
        let (Some(wanted), Some(contact)) = (&self.job.analyses.stability, &self.job.contact) else {
            return Err(Error::Defect("a point of a sweep without contact or stability".into()));
        };
        let found = Examined { job: self.job, stability: wanted, contact, model: self.model }.analyse()?;
        let state = match wanted.state() {
            StabilityState::Sliding => StartState::Sliding,
            StabilityState::Steady => StartState::Steady,
        };
        let transient = self.cycles.transient(state);
        let rolling = Rolling { job: self.job, wanted: &transient, contact, model: self.model };
        let ready = rolling.ready()?;
        let model = ready.model(self.model.1);
        let (rest, settings) = ready.begin(&model, &rolling)?;
        let nodes = [found.contact.nodes.len(), found.spectrum.sticking];
        let mode = found.spectrum.eigenpairs.iter().find(|e| e.frequency() > 0.0);
        let unstable = found.spectrum.eigenpairs.first().is_some_and(|e| grows(e.value, e.backward_error));
        let force = [0, 1, 2].map(|c| {
            let sum: f64 = rest.reaction.iter().skip(c).step_by(3).sum();
            if c == 2 {
                -sum
            } else {
                sum
            }
        });
        let Some(mode) = mode else { return Ok((Cycle::rest(force, nodes, 0.0, harmonics), None)) };
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
            let search = Settings {
                step: self.cycles.step,
                period,
                settled: self.cycles.settled,
                longest: self.cycles.duration - time,
                floor: FLOOR * size(&small.v),
                stable: !unstable,
                nodes,
                harmonics,
                watch: watch(self.model, &rest),
            };
            let followed = follow(&mut stepper, &rest, &search)?;
            time += followed.time;
            if let (Some(mut cycle), true) = (Cycle::of(&followed), followed.fate != Fate::Rest) {
                cycle.time = time;
                let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
                let period = followed.motion.as_ref().map_or(period, |(r, _)| r.period / r.crossings.max(1) as f64);
                let period = if period > 0.0 { period } else { 1.0 / mode.frequency() };
                let motion =
                    Motion { q: apart(&followed.state.q, &rest.q), v: apart(&followed.state.v, &rest.v), period };
                return Ok((cycle, Some(motion)));
            }
        }
        Ok((Cycle::rest(force, nodes, time, harmonics), None))
    }
}

/// Velocities of the lower and the upper body along x, y and n at the closed node nearest to the middle of the contact, over the modal ones, `[6, m]`.
fn watch((interface, pair): (&Interface, &ModalPair), rest: &State) -> Mat<f64> {
    let weight = |i: usize| rest.reaction[3 * i + 2];
    let total: f64 = (0..interface.len()).map(weight).sum();
    let middle = [0, 1].map(|c| (0..interface.len()).map(|i| weight(i) * interface.point(i)[c]).sum::<f64>() / total);
    let far = |i: &usize| {
        let [x, y] = interface.point(*i);
        (x - middle[0]).hypot(y - middle[1])
    };
    let node = (0..interface.len()).filter(|&i| weight(i) > 0.0).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
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
struct Kept {
    path: PathBuf,
    identity: [u8; 32],
}

impl Kept {
    /// Cycle and motion, if they are there, whole, and of this point.
    fn read(&self, harmonics: usize, modes: usize) -> Option<(Cycle, Option<Motion>)> {
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
        let length = Cycle::none(harmonics).numbers().len();
        let (cycle, motion) = numbers.split_at_checked(length)?;
        let motion = match motion {
            [] => None,
            [period, all @ ..] if all.len() == 2 * modes => {
                Some(Motion { period: *period, q: all[..modes].to_vec(), v: all[modes..].to_vec() })
            }
            _ => return None,
        };
        Some((Cycle::from_numbers(cycle)?, motion))
    }

    fn write(&self, cycle: &Cycle, motion: Option<&Motion>) -> Result<()> {
        let mut numbers = cycle.numbers();
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

/// The folder of the points that are done.
pub(super) fn folder(output: &Path) -> PathBuf {
    companion(output, "cycles")
}

/// The tables of all points, and what the summary says.
pub(super) fn report(
    plan: &SweepPlan,
    cycles: &Cycles,
    outcomes: &[Outcome],
    found: All,
    summary: &mut Summary,
) -> Vec<Table> {
    let none = Cycle::none(cycles.harmonics as usize);
    let All { cycles: all, mut failed } = found;
    failed.sort();
    let all: Vec<Cycle> = all.into_iter().map(|c| c.unwrap_or_else(|| none.clone())).collect();
    let points = outcomes.len();
    let names: Vec<&str> = cycles.branches.iter().map(|b| b.name()).collect();
    for (name, branch) in names.iter().zip(all.chunks(points)) {
        let count = |fate: i8| branch.iter().filter(|c| c.fate == fate).count();
        let mut text = format!("{} of {points} points squeal", branch.iter().filter(|c| c.fate > 0).count());
        for (fate, what) in [(2, "irregular"), (3, "unsettled"), (-1, "not computed")] {
            if count(fate) > 0 {
                text += &format!(", {} {what}", count(fate));
            }
        }
        summary.value(&format!("limit cycles, {name}"), text);
        let loudest = (0..points)
            .filter(|&i| branch[i].fate > 0)
            .max_by(|&a, &b| branch[a].kinetic.total_cmp(&branch[b].kinetic));
        if let Some(i) = loudest {
            let c = &branch[i];
            summary.value("  most energy", format!("{:.4e} J at {:.3} Hz, {}", c.kinetic, c.frequency, plan.place(i)));
        }
    }
    // Squeal where rest is stable: it does not begin by itself.
    let silent = (0..points).filter(|&i| {
        outcomes[i].status == 0 && outcomes[i].unstable() == 0 && all.iter().skip(i).step_by(points).any(|c| c.fate > 0)
    });
    let silent = silent.count();
    if silent > 0 {
        summary.value("squeal beside a stable rest", format!("{silent} points"));
    }
    if let Some((branch, point, why)) = failed.first() {
        summary.fail(Error::NotConverged(format!(
            "{} limit cycles of the sweep were not computed, the others are in the results; /sweep/cycles/message says which and why. The first is {}, {}: {why}",
            failed.len(),
            names[*branch],
            plan.place(*point)
        )));
    }
    let key = match along(plan, cycles) {
        Some(_) => cycles.along.clone().unwrap_or_default(),
        None if plan.shape.len() == plan.keys.len() => plan.keys.last().cloned().unwrap_or_default(),
        None => plan.keys.join(", "),
    };
    let mut messages = vec![String::new(); all.len()];
    failed.into_iter().for_each(|(branch, point, why)| messages[branch * points + point] = why);
    let text = "Why a point was not computed; empty where it was.";
    let shape = [cycles.branches.len(), points];
    let mut tables = tables(&cycles.branches, &key, points, &all);
    tables.push(Table::new("/sweep/cycles/message", "-", text, &shape, messages));
    tables
}
