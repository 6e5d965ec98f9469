//! The points of some models, spread over the ranks. Those of a study are solved in passes: first the points at which
//! unstable eigenvalues are counted in any case, then the others, and of these last what no base point leads to, from
//! some of them; and where unstable ones were missing, all that were not counted once more.

use super::outcome::PackedOutcomes;
use super::stopped;
use super::stored_points::StoredPoints;
use super::uncertain::Study;
use crate::analysis::run::Run;
use crate::job::Job;
use crate::output::datasets::sweep::{EigenvalueSearch, Outcome};
use crate::parallel::World;
use crate::{Error, Result};
use std::collections::HashSet;

/// Points of a study that each rank computes before what is done is kept.
const BLOCK: usize = 16;

/// Solver of a point from the number of its model and its own; none where the model could not be made, or the point is
/// left for later.
type Solver<'s> = &'s mut dyn FnMut(usize, usize) -> Option<Result<Outcome>>;

/// Destinations of the results of points.
pub(super) struct PointSinks<'a> {
    pub points: &'a [Option<Job>],
    /// On rank 0 all of them.
    pub results: &'a mut [Option<Outcome>],
    /// Results of a study, kept on the disk by rank 0.
    pub kept: &'a mut Option<Option<StoredPoints>>,
}

/// Points that are to be solved.
pub(super) struct Passes<'a> {
    pub study: Option<&'a Study<'a>>,
    /// All points of each model.
    pub models: Vec<&'a [usize]>,
    /// True if the points of a model differ in where its bodies are touched.
    pub placed: bool,
    /// Number of the model and of each point.
    pub planned: Vec<(usize, usize)>,
    /// True if the points have gone astray: each rank takes a stretch of them.
    pub astray: bool,
}

impl Passes<'_> {
    /// The points of the first pass, and those of the second one.
    fn split(&self) -> [Vec<(usize, usize)>; 2] {
        let Some(study) = self.study else { return [self.planned.clone(), Vec::new()] };
        let (first, second) = self.planned.iter().partition(|&&(m, i)| study.is_first(self.models[m], i, self.placed));
        [first, second]
    }

    /// Returns whether this rank has a point of the model `number` in a pass, or may have one.
    pub fn needs(&self, number: usize, world: &World) -> bool {
        let passes = self.split();
        let later = passes[1].iter().any(|p| p.0 == number);
        later || self.blocks(&passes[0], world).iter().flatten().any(|p| p.0 == number)
    }

    /// This rank's share of some points, block by block.
    fn blocks(&self, points: &[(usize, usize)], world: &World) -> Vec<Vec<(usize, usize)>> {
        // Points of a study are kept on the disk block by block.
        let block = if self.study.is_some() { BLOCK * world.size } else { points.len() };
        points.chunks(block.max(1)).map(|part| share(part, self.models.len() > 1 || self.astray, world)).collect()
    }

    /// Collective: solves the points.
    pub fn solve(&self, run: &mut Run, into: &mut PointSinks, solver: Solver) -> Result<()> {
        let [first, second] = self.split();
        let total = self.planned.len();
        self.solve_some(run, (&first, 0, total), into, solver)?;
        let (Some(study), false) = (self.study, second.is_empty()) else { return Ok(()) };
        let world = run.world();
        for members in &self.models {
            let counted = |i: &usize| {
                let outcome = into.results[*i].as_ref().filter(|o| o.status == 0)?;
                let known = study.is_first(members, *i, self.placed) && outcome.search != EigenvalueSearch::Uncounted;
                known.then(|| [*i as u64, outcome.unstable() as u64])
            };
            let counted: Vec<u64> = match world.is_root() {
                true => members.iter().filter_map(counted).flatten().collect(),
                false => Vec::new(),
            };
            let counted = world.broadcast(counted);
            study.learn(members, counted.chunks_exact(2).map(|c| (c[0] as usize, c[1] as usize)).collect());
        }
        study.defer(true);
        let solved = self.solve_some(run, (&second, first.len(), total), into, solver);
        study.defer(false);
        solved?;
        self.solve_strayed(run, study, (&second, total), into, solver)?;
        let again = world.broadcast(if world.is_root() { self.doubtful(into) } else { Vec::new() });
        if again.is_empty() {
            return Ok(());
        }
        run.progress.note("unstable eigenvalues were missing: all points are counted");
        let again: Vec<(usize, usize)> = again.chunks_exact(2).map(|c| (c[0] as usize, c[1] as usize)).collect();
        study.count_all(true);
        let solved = self.solve_some(run, (&again, 0, again.len()), into, solver);
        study.count_all(false);
        solved
    }

    /// Collective: solves what no base point leads to of the `second` points. Points of an earlier run are among what
    /// the others are continued from, so that a run that was stopped goes on to the same results.
    fn solve_strayed(
        &self,
        run: &mut Run,
        study: &Study,
        (second, total): (&[(usize, usize)], usize),
        into: &mut PointSinks,
        solver: Solver,
    ) -> Result<()> {
        use EigenvalueSearch::{FellBack, Missed, Rebased};
        let world = run.world();
        let mut left = Vec::new();
        for (m, members) in self.models.iter().enumerate() {
            let own = second.iter().filter(|p| p.0 == m).map(|p| p.1).collect::<HashSet<usize>>();
            let is_strayed = |i: usize| match &into.results[i] {
                None => own.contains(&i),
                Some(o) => matches!(o.search, FellBack | Missed | Rebased),
            };
            let found = |&i: &usize| {
                let strayed = !study.is_first(members, i, self.placed) && is_strayed(i);
                strayed.then(|| [i as u64, u64::from(into.results[i].is_none())])
            };
            let strayed: Vec<u64> = match world.is_root() {
                true => members.iter().filter_map(found).flatten().collect(),
                false => Vec::new(),
            };
            let strayed = world.broadcast(strayed);
            let mut all: Vec<usize> = strayed.chunks_exact(2).map(|s| s[0] as usize).collect();
            all.sort_unstable();
            study.stray(members, all);
            left.extend(strayed.chunks_exact(2).filter(|s| s[1] == 1).map(|s| (m, s[0] as usize)));
        }
        // A rank computes few of the points that others begin from.
        left.sort_by_key(|&(m, i)| (m, study.stray_base(self.models[m], i), i));
        let begun = total - left.len();
        let mine = Passes { astray: true, planned: Vec::new(), models: self.models.clone(), ..*self };
        mine.solve_some(run, (&left, begun, total), into, solver)
    }

    /// On rank 0: the points that were not counted of models where unstable eigenvalues were missing at another one.
    fn doubtful(&self, into: &PointSinks) -> Vec<u64> {
        let mut all = Vec::new();
        for (m, members) in self.models.iter().enumerate() {
            let is = |i: usize, search| into.results[i].as_ref().is_some_and(|o| o.search == search);
            if members.iter().any(|&i| is(i, EigenvalueSearch::Missed)) {
                let points = members.iter().filter(|&&i| is(i, EigenvalueSearch::Uncounted));
                all.extend(points.flat_map(|&i| [m as u64, i as u64]));
            }
        }
        all
    }

    /// Outcome of a point that fails. One that went astray is still one of those for a run that goes on.
    fn failed(&self, error: &Error) -> Outcome {
        let failed = Outcome::failed(error);
        match self.astray {
            true => Outcome { search: EigenvalueSearch::FellBack, ..failed },
            false => failed,
        }
    }

    /// Collective: solves `points`, before which `before` of `total` were solved.
    fn solve_some(
        &self,
        run: &mut Run,
        (points, before, total): (&[(usize, usize)], usize, usize),
        into: &mut PointSinks,
        solver: Solver,
    ) -> Result<()> {
        let world = run.world();
        let blocks = self.blocks(points, world);
        let all = blocks.iter().map(Vec::len).sum::<usize>();
        let mut begun = 0;
        for mine in &blocks {
            let mut solved = PackedOutcomes::default();
            for &(m, i) in mine.iter().take_while(|_| !run.stop.signalled()) {
                begun += 1;
                if let Some(found) = solver(m, i) {
                    solved.push(i, &found.unwrap_or_else(|e| self.failed(&e)));
                }
                run.progress.step("points", before + begun * points.len() / all.max(1), total);
            }
            let (numbers, text) = (world.gather(&solved.numbers), world.gather(&solved.text));
            world.on_root(|| {
                let packed = PackedOutcomes { numbers, text };
                packed.unpack(into.results)?;
                into.kept.iter_mut().flatten().try_for_each(|kept| kept.add(&packed, into.points))
            })?;
            if run.stop.wanted(world) {
                return Err(Error::Stopped(stopped(into.kept.is_some(), &run.options.output)));
            }
        }
        Ok(())
    }
}

/// This rank's share of the `planned` points, each with its model: every so-manieth point, since neighbours cost alike,
/// or a stretch, which needs few models.
fn share(planned: &[(usize, usize)], stretches: bool, world: &World) -> Vec<(usize, usize)> {
    let (rank, size) = (world.rank, world.size);
    match stretches {
        false => planned.iter().copied().skip(rank).step_by(size).collect(),
        true => planned[rank * planned.len() / size..(rank + 1) * planned.len() / size].to_vec(),
    }
}
