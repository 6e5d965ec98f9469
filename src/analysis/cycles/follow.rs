//! The walk along the branches, spread over the ranks.

use super::search::{Clock, Search};
use super::spread::spread;
use super::starts::{BranchOrigin, BranchStart, Candidate, FailedStart};
use super::stored_branches::StoredBranches;
use crate::cycles::branch::follow;
use crate::cycles::corrector::Equations;
use crate::cycles::{in_order, BranchEnd, BranchPoint, BranchState, ContactMemory, Family, NodalPeriod, Structure};
use crate::output::datasets::branches::{shown, OneBranch};
use crate::parallel::World;
use crate::progress::Progress;
use crate::{Error, Result};

/// Distance of a cycle from a branch, of the range of the key and of the largest velocity, up to which it lies on it.
const NEAR: f64 = 0.02;
/// The same of the frequency.
pub(super) const ALIKE: f64 = 2e-4;
/// Distance in the key, of its range, of the end of a branch at rest from the threshold where it ends.
pub(super) const AT_REST: f64 = 0.05;

/// Everything that the branches are followed with.
pub(super) struct BranchFollower<'w, 'a> {
    pub(super) search: &'w Search<'a>,
    pub(super) structure: &'w Structure<'a>,
    pub(super) kept: &'w StoredBranches,
    pub(super) clock: &'w Clock<'w>,
}

/// All branches.
pub(super) struct FollowedBranches {
    pub(super) all: Vec<OneBranch>,
    /// Starts that lie on a branch of another one: in words, and the number of the branch.
    pub(super) same: Vec<(String, usize)>,
    /// Marches of the contact.
    pub(super) marches: usize,
}

/// A branch in one direction: its start, and whether the direction is turned.
type Task = (usize, bool);

impl<'w, 'a> BranchFollower<'w, 'a> {
    /// The equations of a branch.
    pub(super) fn equations(&self, [unit, omega, key]: [f64; 3], memory: ContactMemory) -> Equations<'w, 'a> {
        let wanted = self.search.wanted;
        Equations {
            structure: self.structure,
            family: self.search,
            resolution: self.search.resolution(),
            unit,
            omega,
            key: [key, wanted.to - wanted.from],
            memory,
            marches: 0,
        }
    }

    /// Collective: the cycles that the candidates lead to, on every rank, and those that lead to none.
    pub(super) fn starts(
        &self,
        world: &World,
        candidates: &[Candidate],
        progress: &mut Progress,
    ) -> Result<(Vec<BranchStart>, Vec<FailedStart>)> {
        self.clock.start_step();
        let found = spread(world, candidates.len(), |k| {
            if self.clock.is_over() {
                return Ok(None);
            }
            let name = format!("start-{k:03}");
            if let Some(numbers) = self.kept.numbers(&name).filter(|n| BranchStart::from_numbers(n).is_some()) {
                return Ok(Some(numbers));
            }
            progress.step("first cycles", k, candidates.len());
            let numbers = self.solve(k, &candidates[k])?.numbers()?;
            self.kept.keep(&name, &numbers)?;
            self.clock.goes_on();
            Ok(Some(numbers))
        })?;
        let (mut starts, mut failed) = (Vec::new(), Vec::new());
        for (candidate, item) in candidates.iter().zip(found) {
            match item {
                Some(Ok(numbers)) => starts.extend(BranchStart::from_numbers(&numbers)),
                Some(Err(why)) => failed.push(FailedStart { origin: candidate.text(&self.search.wanted.along), why }),
                None => {}
            }
        }
        Ok((starts, failed))
    }

    /// Collective: the contact nodes over a period of each of the cycles that are [`shown`], on every rank; and why one
    /// could not be marched again, the first of them.
    pub(super) fn nodal_periods(
        &self,
        world: &World,
        branches: &[OneBranch],
    ) -> Result<(Vec<NodalPeriod>, Option<String>)> {
        let cycles = shown(branches, self.search.wanted.every);
        let firsts = branches.iter().scan(0, |sum, b| Some(std::mem::replace(sum, *sum + b.points.len())));
        let units: Vec<(usize, f64)> = firsts.zip(branches.iter().map(|b| b.unit)).collect();
        let of_row = |row: usize| units.iter().rev().find(|u| u.0 <= row).map_or(1.0, |u| u.1);
        let found = spread(world, cycles.len(), |k| {
            let (row, point) = cycles[k];
            let around = (self.structure, self.search as &dyn Family);
            NodalPeriod::new(around, self.search.resolution(), (point, of_row(row))).map(|p| Some(p.numbers()))
        })?;
        let torn = || Error::Defect("limit cycles: a period was torn on its way".into());
        let (mut periods, mut lost) = (Vec::with_capacity(found.len()), None);
        for item in found {
            periods.push(match item.ok_or_else(torn)? {
                Ok(numbers) => NodalPeriod::from_numbers(&numbers).ok_or_else(torn)?,
                Err(why) => {
                    lost.get_or_insert(why);
                    NodalPeriod::default()
                }
            });
        }
        Ok((periods, lost))
    }

    /// Collective: the branches from the `starts`, in their order; one that lies on a branch before it is not another
    /// one.
    pub(super) fn branches(
        &self,
        world: &World,
        candidates: &[Candidate],
        starts: Vec<BranchStart>,
        progress: &mut Progress,
    ) -> Result<FollowedBranches> {
        let mut found = FollowedBranches { all: Vec::new(), same: Vec::new(), marches: 0 };
        let mut pending = starts;
        let range = self.search.wanted.to - self.search.wanted.from;
        while !pending.is_empty() {
            let later = pending.split_off(at_once(candidates, &pending).max(world.size.div_ceil(2)).min(pending.len()));
            let now = std::mem::replace(&mut pending, later);
            let mut tasks: Vec<Task> = Vec::new();
            for (k, start) in now.iter().enumerate() {
                let both = [Some((k, false)), start.state.is_two_way().then_some((k, true))];
                let own = tasks.len();
                tasks.extend(both.into_iter().flatten());
                // Ranks take up and down in turn: one direction of most branches is longer.
                if k % 2 == 1 {
                    tasks[own..].reverse();
                }
            }
            let states = self.walk(world, &now, &tasks, progress)?;
            if world.max(f64::from(u8::from(self.clock.is_over()))) > 0.0 {
                return Ok(found);
            }
            for (k, start) in now.iter().enumerate() {
                let text = candidates.get(start.number).map_or(String::new(), |c| c.text(&self.search.wanted.along));
                if let Some(place) = found.all.iter().position(|b| lies_on(start, b, range)) {
                    found.same.push((text, place));
                    continue;
                }
                let of = |turned: bool| tasks.iter().position(|t| *t == (k, turned)).and_then(|t| states[t].clone());
                let branch = joined(of(false), of(true), text, (start.scale[0], self.structure.rank()))?;
                found.marches += branch.1;
                found.all.push(branch.0);
            }
            let mut others = Vec::new();
            for start in pending {
                match found.all.iter().position(|b| lies_on(&start, b, range)) {
                    Some(place) => {
                        let text = candidates.get(start.number).map(|c| c.text(&self.search.wanted.along));
                        found.same.push((text.unwrap_or_default(), place));
                    }
                    None => others.push(start),
                }
            }
            pending = others;
        }
        Ok(found)
    }

    /// Collective: the branches of some `tasks`, on every rank; none of those that were stopped.
    fn walk(
        &self,
        world: &World,
        starts: &[BranchStart],
        tasks: &[Task],
        progress: &mut Progress,
    ) -> Result<Vec<Option<BranchState>>> {
        let extent = self.search.extent();
        let mut done = 0;
        self.clock.start_step();
        let found = spread(world, tasks.len(), |t| {
            let (k, turned) = tasks[t];
            let start = &starts[k];
            let name = format!("branch-{:03}-{}", start.number, if turned { "down" } else { "up" });
            let begin = || if turned { start.state.clone().turned() } else { start.state.clone() };
            let (mut state, mut file) = self.kept.branch(&name, begin)?;
            if self.clock.is_over() {
                return Ok(None);
            }
            let mut equations = self.equations(start.scale, state.memory().clone());
            let mut step = |state: &BranchState| {
                done += 1;
                progress.step("cycles", done, extent.most * tasks.len());
                file.keep(self.kept, state)?;
                Ok(self.clock.goes_on())
            };
            follow(&mut equations, &mut state, &extent, &mut step)?;
            if state.end.is_none() {
                return Ok(None);
            }
            let mut numbers = vec![state.points.len() as f64];
            for point in &state.points {
                let point = point.numbers();
                numbers.push(point.len() as f64);
                numbers.extend(point);
            }
            numbers.extend(state.numbers());
            Ok(Some(numbers))
        })?;
        let states = found.into_iter().map(|item| match item {
            Some(Ok(numbers)) => {
                state_of(&numbers).map(Some).ok_or_else(|| Error::Defect("a branch was torn on its way".into()))
            }
            Some(Err(why)) => Err(Error::NotConverged(why)),
            None => Ok(None),
        });
        states.collect()
    }
}

/// Number of the first of `starts` that are followed at once: those of the unstable modes at one value of the key have
/// branches of their own but for folds; others mostly lie on a branch of theirs.
fn at_once(candidates: &[Candidate], starts: &[BranchStart]) -> usize {
    let key = |start: &BranchStart| match candidates.get(start.number)?.origin {
        BranchOrigin::Mode { key, .. } => Some(key),
        _ => None,
    };
    let first = starts.first().and_then(key);
    starts.iter().take_while(|start| first.is_some() && key(start) == first).count()
}

/// A branch from its numbers.
fn state_of(numbers: &[f64]) -> Option<BranchState> {
    let (count, mut rest) = numbers.split_first()?;
    let mut points = Vec::new();
    for _ in 0..*count as usize {
        let (length, after) = rest.split_first()?;
        let (point, after) = after.split_at_checked(*length as usize)?;
        points.push(BranchPoint::from_numbers(point)?);
        rest = after;
    }
    BranchState::from_numbers(rest, points)
}

/// Both directions of a branch as one, from its end down to that up, special points in their order along it; and the
/// marches made for it. `unit` and `rank` are those of the motion.
fn joined(
    up: Option<BranchState>,
    down: Option<BranchState>,
    origin: String,
    (unit, rank): (f64, usize),
) -> Result<(OneBranch, usize)> {
    let Some(up) = up else { return Err(Error::Defect("limit cycles: a branch is missing".into())) };
    let marches = up.marches + down.as_ref().map_or(0, |d| d.marches);
    let text = |end: &Option<BranchEnd>| end.as_ref().map_or(String::new(), BranchEnd::text);
    let ends = [down.as_ref().map_or(BranchEnd::Rest.text(), |d| text(&d.end)), text(&up.end)];
    let unknown = up.unknown.or_else(|| down.as_ref().and_then(|d| d.unknown.clone()));
    let before = in_order(down.map_or(Vec::new(), |d| d.points), rank);
    let start = before.len().saturating_sub(1);
    let points = before.into_iter().skip(1).rev().chain(in_order(up.points, rank)).collect();
    Ok((OneBranch { points, start, ends, origin, unit, unknown }, marches))
}

/// True if the cycle of `start` is one of `branch`: by key, velocity and frequency, between two of its cycles.
fn lies_on(start: &BranchStart, branch: &OneBranch, range: f64) -> bool {
    let Ok(own) = start.point() else { return false };
    let ordinary: Vec<&BranchPoint> = branch.points.iter().filter(|p| p.special.is_none()).collect();
    let largest = ordinary.iter().map(|p| p.cycle.kinetic).fold(0.0, f64::max).sqrt();
    let place = |p: &BranchPoint| [p.key / range, p.cycle.kinetic.max(0.0).sqrt() / largest];
    let [x, y] = place(own);
    let between = ordinary.windows(2).any(|ends| {
        let ([a, b], [c, d]) = (place(ends[0]), place(ends[1]));
        let square = (c - a).powi(2) + (d - b).powi(2);
        let along = ((x - a) * (c - a) + (y - b) * (d - b)) / square.max(f64::MIN_POSITIVE);
        let along = along.clamp(0.0, 1.0);
        let apart = (x - a - along * (c - a)).hypot(y - b - along * (d - b));
        let frequencies = [ends[0].cycle.frequency, ends[1].cycle.frequency];
        let there = frequencies[0] + along * (frequencies[1] - frequencies[0]);
        let course = 0.2 * (frequencies[1] - frequencies[0]).abs();
        apart < NEAR && (own.cycle.frequency - there).abs() < ALIKE * there + course
    });
    // A branch that ends at rest ends at the threshold where small cycles begin.
    let rest = BranchEnd::Rest.text();
    let at_end = [(branch.points.first(), &branch.ends[0]), (branch.points.last(), &branch.ends[1])];
    between
        || at_end.into_iter().any(|(end, why)| {
            end.is_some_and(|end| {
                let small = y < NEAR.max(place(end)[1]);
                let near = (x - end.key / range).abs() < AT_REST;
                *why == rest && small && near && (own.cycle.frequency / end.cycle.frequency - 1.0).abs() < 5.0 * ALIKE
            })
        })
}
