//! The analysis `sweep`: stability at many points, spread over the ranks. What the finite elements or the matrices give is made once
//! for all points that share it, by all ranks together; the points themselves are solved by one rank each.

mod outcome;

use super::bodies::Bodies;
use super::matrices::{self, MatrixModel};
use super::reduction::Reduction;
use super::report::Summary;
use super::run::Run;
use super::{modes, stability};
use crate::job::fe_inputs;
use crate::job::{Job, SweepPlan};
use crate::model::{damping, SharedModel};
use crate::output::datasets::sweep::{tables, Outcome};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::{Error, Result};
use outcome::{summarise, Packed};

/// The reduced model of the job itself, which serves all points with the same bodies.
pub enum Base<'a> {
    /// Of finite elements.
    Elements(&'a Reduction),
    /// Of bodies given by matrices, on every rank.
    Matrices(&'a MatrixModel),
}

/// Whether the points of a sweep are computed although the job's own point ended with `error`: what concerns this point alone, not the machine
/// or the program.
pub fn goes_on(error: &Error) -> bool {
    matches!(error, Error::Job(_) | Error::Input(_) | Error::NotConverged(_))
}

/// Collective: every point of `plan`, tables under `/sweep`. `base` is the model of `job`, if it could be made; `own` is what went wrong at
/// the job's own point. Points that fail are in the table with what went wrong, and in the summary as the failure of the run.
pub fn run(run: &mut Run, plan: &SweepPlan, base: Option<Base>, own: Option<&Error>) -> Result<()> {
    let (world, job) = (run.world(), run.job);
    let mut results: Vec<Option<Outcome>> = vec![None; plan.points.len()];
    let groups = groups(&plan.points);
    for (number, (inputs, members)) in groups.iter().enumerate() {
        let model = if let (true, Some(base)) = (*inputs == fe_inputs(job), &base) {
            match base {
                Base::Elements(model) => Model::Elements(SharedModel::broadcast(world, model.on_root())?),
                Base::Matrices(model) => Model::Matrices((*model).clone()),
            }
        } else {
            run.progress.note(format!("bodies {} of {}", number + 1, groups.len()));
            match build(run.petsc, &plan.points[members[0]], run.progress) {
                Ok(model) => model,
                Err(e) if matches!(e, Error::Defect(_) | Error::Io(_)) => return Err(e),
                Err(e) => {
                    members.iter().for_each(|&i| results[i] = Some(Outcome::failed(&e)));
                    continue;
                }
            }
        };
        run.progress.stage("points of the sweep");
        let mut mine = Packed::default();
        let mut model = model;
        for (done, &i) in members.iter().enumerate().skip(world.rank).step_by(world.size) {
            mine.push(i, &model.solve(&plan.points[i]).unwrap_or_else(|e| Outcome::failed(&e)));
            run.progress.step("points", (done + world.size).min(members.len()), members.len());
        }
        let (numbers, text) = (world.gather(&mine.numbers), world.gather(&mine.text));
        world.on_root(|| Packed { numbers, text }.unpack(&mut results))?;
    }
    world.on_root(|| {
        let all: Vec<Outcome> = results
            .into_iter()
            .map(|r| r.ok_or_else(|| Error::Defect("a point of the sweep was not computed".into())))
            .collect::<Result<_>>()?;
        run.file.tables(tables(plan, &all, own));
        if let Some(e) = own {
            let text =
                format!("the job's own point failed, those of the sweep were computed and are in the results: {e}");
            run.summary.fail(Error::NotConverged(text));
        }
        let kind = if job.by_matrices() { "reduced" } else { "finite-element" };
        summarise(plan, &all, groups.len(), kind, &mut run.summary);
        Ok(())
    })?;
    Ok(())
}

/// The points by the finite elements they need, in the order of their first points.
fn groups(points: &[Job]) -> Vec<(serde_json::Value, Vec<usize>)> {
    let mut groups: Vec<(serde_json::Value, Vec<usize>)> = Vec::new();
    for (i, point) in points.iter().enumerate() {
        let inputs = fe_inputs(point);
        // Neighbouring points mostly share them.
        match groups.iter_mut().rev().find(|g| g.0 == inputs) {
            Some(group) => group.1.push(i),
            None => groups.push((inputs, vec![i])),
        }
    }
    groups
}

/// The model of points, on every rank.
enum Model {
    Elements(SharedModel),
    Matrices(MatrixModel),
}

/// Collective: the reduced model of a point, on every rank.
fn build(petsc: &Petsc, point: &Job, progress: &mut Progress) -> Result<Model> {
    let world = petsc.world();
    let mut quiet = Summary::default();
    if point.by_matrices() {
        let bodies = matrices::reduce_all(petsc, point, progress, &mut quiet)?;
        return Ok(Model::Matrices(MatrixModel::shared(world, &bodies)?));
    }
    let mut job = point.clone();
    // Each point brings its own damping.
    for body in [&mut job.bodies.lower, &mut job.bodies.upper].into_iter().flatten() {
        body.damping = Default::default();
    }
    let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("a point of a sweep without contact".into()))?;
    let mut bodies = Bodies::build(petsc, &job, progress, &mut quiet)?;
    bodies.factorise(&job, progress, &mut quiet)?;
    let found = modes::compute_all(&job, &mut bodies, progress)?;
    let model = Reduction::build(world, &job, contact, &bodies, &found, progress)?;
    Ok(Model::Elements(SharedModel::broadcast(world, model.on_root())?))
}

impl Model {
    /// Stability at one point, on this rank alone.
    fn solve(&mut self, point: &Job) -> Result<Outcome> {
        let (Some(wanted), Some(contact)) = (&point.analyses.stability, &point.contact) else {
            return Err(Error::Defect("a point of a sweep without contact or stability".into()));
        };
        let of = |spectrum: &crate::stability::Spectrum| Outcome {
            status: 0,
            message: String::new(),
            eigenvalues: spectrum.eigenpairs.iter().map(|p| p.value).collect(),
            backward_error: spectrum.eigenpairs.iter().map(|p| p.backward_error).fold(0.0, f64::max),
            closed: 0,
            sticking: spectrum.sticking,
            reversed: 0,
            force: [0.0; 3],
            approach: f64::NAN,
        };
        match self {
            Model::Elements(model) => {
                super::plan::small_strain(point)?;
                let (lower, upper) = model.pair.omega.split_at(model.pair.lower_modes);
                let mut coefficients = Vec::new();
                for ((name, body), omega) in point.bodies().into_iter().zip([lower, upper]) {
                    coefficients.extend(damping(&body.damping, omega, &format!("bodies.{name}.damping"))?);
                }
                model.pair.damping = coefficients.into();
                let model = (&model.interface, &model.pair);
                let examined = stability::Examined { job: point, stability: wanted, contact, model };
                let stability::Found { state, spectrum, .. } = examined.analyse()?;
                let (closed, reversed) = (state.closed(), state.reversed);
                let (force, approach) = (state.force, state.approach);
                Ok(Outcome { closed, reversed, force, approach, ..of(&spectrum) })
            }
            Model::Matrices(model) => {
                let pair = model.pair(point);
                let sliding = matrices::sound(contact, &pair)?;
                let spectrum = crate::stability::spectrum(wanted, &pair, &sliding, model.reach)?;
                let mut force = [0.0; 3];
                for (point, node) in contact.points.iter().flatten().zip(&sliding.nodes) {
                    let (pressed, [x, y]) = (point.force.unwrap_or(0.0), node.tangent.friction());
                    force[0] += x * pressed;
                    force[1] += y * pressed;
                    force[2] -= pressed;
                }
                Ok(Outcome { closed: sliding.nodes.len(), force, ..of(&spectrum) })
            }
        }
    }
}
