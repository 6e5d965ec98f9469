//! The limit cycles of the points of a sweep. A chain of points is followed by one rank, each point from where that
//! before it ended; what is done is kept on disk at once, and taken up by a later run of the same points on the same
//! model.

use super::outcome::LISTED;
use super::sound::SoundSetup;
use super::{goes_on, interface_at, point_of, Sources};
use crate::analysis::radiation::ModalSound;
use crate::analysis::run::Run;
use crate::case::axle_torque;
use crate::case::limit_cycle_point::{motion_modes, LimitCyclePoint, PointCache};
use crate::job::{Branch, Cycles, Job, SweepPlan};
use crate::model::SharedModel;
use crate::output::companion;
use crate::output::datasets::cycle_motions::{self, MotionModes};
use crate::output::datasets::cycles::{tables, Cycle};
use crate::output::datasets::sweep::Outcome;
use crate::output::Table;
use crate::parallel::World;
use crate::progress::Progress;
use crate::stop::Stop;
use crate::summary::Summary;
use crate::transient::cycle::CycleMotion;
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Points that are followed one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Chain {
    /// Its branch among those of the job.
    branch: usize,
    points: Vec<usize>,
}

impl Chain {
    /// A point by itself, of the first branch.
    pub(super) fn of_point(point: usize) -> Self {
        Self { branch: 0, points: vec![point] }
    }
}

/// The chains of the points `members` of `plan`, which share a model.
pub(super) fn chains(plan: &SweepPlan, cycles: &Cycles, members: &[usize]) -> Vec<Chain> {
    let (along, _) = plan.along(cycles.along.as_deref());
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

/// Data that one rank needs for its chains.
struct CycleChains<'a> {
    cycles: &'a Cycles,
    points: &'a [Option<Job>],
    /// Folder of finished points.
    folder: &'a Path,
    /// How their modes radiate, where that is asked for.
    sounding: Option<&'a ModalSound>,
    stop: &'a Stop,
}

/// Results of one rank, on their way to rank 0.
#[derive(Default)]
struct RankResults {
    /// [branch, point, how many, numbers of the cycle …] of each point one after the other.
    rows: Vec<f64>,
    /// [branch, point, period, how many modes, displacements and velocities …] of each point that moves.
    motions: Vec<f64>,
    /// Reasons of points that were not computed: "branch point why", each closed by a zero.
    text: String,
}

/// All points of all branches, `[branches][points]`.
pub(super) struct BranchOutcomes {
    pub(super) cycles: Vec<Option<Cycle>>,
    /// The motions that they end with, each with the number of its model.
    motions: Vec<Option<(usize, CycleMotion)>>,
    models: Vec<MotionModes>,
    /// Why some were not computed.
    pub(super) failed: Vec<(usize, usize, String)>,
    /// Recorder of the sound; none where no sound is asked for.
    pub(super) heard: Option<SoundSetup>,
}

impl BranchOutcomes {
    /// None of them yet.
    pub(super) fn new(plan: &SweepPlan, cycles: &Cycles) -> Self {
        let count = cycles.branches.len() * plan.points.len();
        Self {
            cycles: vec![None; count],
            motions: vec![None; count],
            models: Vec::new(),
            failed: Vec::new(),
            heard: None,
        }
    }

    /// The cycles of a model are heard.
    fn hears(&mut self, sounding: &ModalSound) {
        self.heard = Some(SoundSetup::with(self.heard.take(), sounding));
    }

    /// Takes what the ranks found of `points` points.
    fn collect(&mut self, (rows, motions): (&[f64], &[f64]), text: &[u8], points: usize) -> Result<()> {
        let torn = || Error::Defect("limit cycles were torn on their way".into());
        let mut rest = rows;
        while let [branch, point, length, after @ ..] = rest {
            let (numbers, after) = after.split_at_checked(*length as usize).ok_or_else(torn)?;
            let place = self.cycles.get_mut(*branch as usize * points + *point as usize).ok_or_else(torn)?;
            *place = Some(Cycle::from_numbers(numbers).ok_or_else(torn)?);
            rest = after;
        }
        let mut rest = motions;
        while let [branch, point, period, modes, after @ ..] = rest {
            let (q, after) = after.split_at_checked(*modes as usize).ok_or_else(torn)?;
            let (v, after) = after.split_at_checked(*modes as usize).ok_or_else(torn)?;
            let place = self.motions.get_mut(*branch as usize * points + *point as usize).ok_or_else(torn)?;
            *place = Some((self.models.len(), CycleMotion { q: q.to_vec(), v: v.to_vec(), period: *period }));
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

impl BranchOutcomes {
    /// Collective: follows the `chains` of points of a model, and hears them where sound is wanted and `sources` are
    /// there. Where no state of rest is unstable nothing is followed, and nothing is heard.
    pub(super) fn follow(
        &mut self,
        run: &mut Run,
        wanted: &FollowedPoints,
        (model, sources): (&mut SharedModel, Option<Sources>),
        (chains, unstable): (&[Chain], bool),
    ) -> Result<()> {
        let world = run.world();
        let sounding = match (&wanted.cycles.sound_power, sources) {
            (Some(sound), Some(sources)) if unstable => {
                run.progress.stage("radiation of sound");
                let (bodies, modes) = sources.get();
                let motions = (wanted.cycles.step, model.interface.patches.len());
                Some(ModalSound::new(world, (wanted.sound_key, sound), motions, bodies, modes)?)
            }
            _ => None,
        };
        if let (true, Some(sounding)) = (world.is_root(), &sounding) {
            self.hears(sounding);
        }
        run.progress.stage("limit cycles");
        let &FollowedPoints { cycles, points, folder, .. } = wanted;
        let following = CycleChains { cycles, points, folder, sounding: sounding.as_ref(), stop: run.stop };
        let mine = world.agree(following.all(world, model, chains, run.progress))?;
        let (rows, text) = (world.gather(&mine.rows), world.gather(mine.text.as_bytes()));
        let motions = world.gather(&mine.motions);
        world.on_root(|| self.collect((&rows, &motions), &text, points.len()))?;
        if let Some(job) = chains.iter().flat_map(|c| &c.points).find_map(|&p| point_of(points, p).ok()) {
            let interface = interface_at(job, &model.interface)?;
            self.models.push(motion_modes((&interface, model.pair(job)?)));
        }
        if run.stop.wanted(world) {
            return Err(Error::Stopped(format!(
                "stopped on request among the limit cycles; those that are done are kept in {}, and the same run takes \
                 them up",
                folder.display()
            )));
        }
        Ok(())
    }
}

/// Points that are followed in time.
pub(super) struct FollowedPoints<'a> {
    pub cycles: &'a Cycles,
    /// Key of their sound, for messages.
    pub sound_key: &'static str,
    pub points: &'a [Option<Job>],
    /// Folder of finished points.
    pub folder: &'a Path,
}

impl<'a> FollowedPoints<'a> {
    /// Collective: the points with the folder of those that are done, which the result file of `run` replaces.
    pub(super) fn create_folder(
        run: &mut Run,
        (cycles, sound_key): (&'a Cycles, &'static str),
        (points, folder): (&'a [Option<Job>], &'a Path),
    ) -> Result<Self> {
        let fail = |e| Error::Io(format!("{}: cannot make the folder of the limit cycles: {e}", folder.display()));
        run.world().on_root(|| std::fs::create_dir_all(folder).map_err(fail))?;
        run.file.discard(folder);
        Ok(Self { cycles, sound_key, points, folder })
    }
}

impl CycleChains<'_> {
    /// Follows the chains of this rank.
    fn all(
        &self,
        world: &World,
        model: &mut SharedModel,
        chains: &[Chain],
        progress: &mut Progress,
    ) -> Result<RankResults> {
        let mut found = RankResults::default();
        let mine: Vec<&Chain> = chains.iter().skip(world.rank).step_by(world.size).collect();
        let total: usize = mine.iter().map(|c| c.points.len()).sum();
        let mut done = 0;
        for chain in mine {
            let mut before: Option<CycleMotion> = None;
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
                if let (Some(motion), true) = (&before, cycle.fate > 0) {
                    let head = [chain.branch as f64, point as f64, motion.period, motion.q.len() as f64];
                    found.motions.extend(head.iter().chain(&motion.q).chain(&motion.v));
                }
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
        (before, history): (&mut Option<CycleMotion>, &mut Sha256),
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
        let interface = interface_at(job, &model.interface)?;
        let balanced = axle_torque::balanced(job, (&interface, model.pair(job)?))?;
        let job = balanced.as_ref().unwrap_or(job);
        let pair = model.pair(job)?;
        let heard = self.sounding.map(ModalSound::quantities);
        let attempt = LimitCyclePoint { job, cycles: self.cycles, model: (&interface, pair), heard, mode: 0 };
        history.update(attempt.identity(branch)?);
        let kept = PointCache {
            path: self.folder.join(format!("{}-{point:06}", branch.name())),
            identity: history.clone().finalize().into(),
        };
        if let Some((cycle, motion)) = kept.read(pair.omega.len()) {
            *before = motion;
            return Ok(cycle);
        }
        let found = attempt.follow(before.take())?;
        let (mut cycle, motion) = (found.cycle, found.motion);
        if let Some(sounding) = self.sounding {
            cycle.sound = sounding.powers(&found.heard)?;
        }
        kept.write(&cycle, motion.as_ref())?;
        *before = motion;
        Ok(cycle)
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
    found: BranchOutcomes,
    summary: &mut Summary,
) -> Vec<Table> {
    let none = Cycle::none(cycles.harmonics as usize);
    let BranchOutcomes { cycles: all, motions, models, mut failed, heard } = found;
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
        for i in (0..points).filter(|&i| branch[i].fate > 0 && points <= LISTED) {
            let level =
                heard.as_ref().and_then(|h| h.level(&branch[i])).map_or(String::new(), |(_, text)| format!(", {text}"));
            summary.value(&format!("  {}", plan.place(i)), format!("{:.3} Hz{level}", branch[i].frequency));
        }
        let loudest = (0..points)
            .filter(|&i| branch[i].fate > 0)
            .max_by(|&a, &b| branch[a].kinetic.total_cmp(&branch[b].kinetic));
        if let Some(i) = loudest {
            let c = &branch[i];
            summary.value("  most energy", format!("{:.4e} J at {:.3} Hz, {}", c.kinetic, c.frequency, plan.place(i)));
        }
        if let Some((i, text)) = heard.as_ref().and_then(|h| h.loudest(branch)) {
            summary.value("  loudest", format!("{text}, {}", plan.place(i)));
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
            "{} limit cycles of the sweep were not computed, the others are in the results; \
             /sweep/cycles/message says which and why. The first is {}, {}: {why}",
            failed.len(),
            names[*branch],
            plan.place(*point)
        )));
    }
    let (_, key) = plan.along(cycles.along.as_deref());
    let mut messages = vec![String::new(); all.len()];
    failed.into_iter().for_each(|(branch, point, why)| messages[branch * points + point] = why);
    let text = "Why a point was not computed; empty where it was.";
    let shape = [cycles.branches.len(), points];
    let mut tables = tables(&cycles.branches, &key, points, &all);
    tables.extend(heard.iter().flat_map(|h| h.tables("/sweep/cycles", &shape, &all)));
    tables.extend(cycle_motions::tables(&shape, &motions, &models));
    tables.push(Table::new("/sweep/cycles/message", "-", text, &shape, messages));
    tables
}
