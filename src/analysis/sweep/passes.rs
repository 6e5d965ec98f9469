//! The points of some models, spread over the ranks. Those of a study are solved in passes: first the points at which
//! unstable eigenvalues are counted in any case, then the others; and where some were missing, all others once more.

use super::outcome::PackedOutcomes;
use super::stopped;
use super::stored_points::StoredPoints;
use super::uncertain::Study;
use crate::analysis::run::Run;
use crate::job::Job;
use crate::output::datasets::sweep::{EigenvalueSearch, Outcome};
use crate::parallel::World;
use crate::{Error, Result};

/// Points of a study that each rank computes before what is done is kept.
const BLOCK: usize = 16;

/// Solver of a point from the number of its model and its own; none where the model could not be made.
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
        points.chunks(block.max(1)).map(|part| share(part, self.models.len(), world)).collect()
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
        self.solve_some(run, (&second, first.len(), total), into, solver)?;
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
                    solved.push(i, &found.unwrap_or_else(|e| Outcome::failed(&e)));
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

/// This rank's share of the `planned` points of some `models`, each with its model: of one model every so-manieth
/// point, since neighbours cost alike, of several a stretch, which needs few of them.
fn share(planned: &[(usize, usize)], models: usize, world: &World) -> Vec<(usize, usize)> {
    let (rank, size) = (world.rank, world.size);
    match models {
        1 => planned.iter().copied().skip(rank).step_by(size).collect(),
        _ => planned[rank * planned.len() / size..(rank + 1) * planned.len() / size].to_vec(),
    }
}
