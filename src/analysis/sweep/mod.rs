//! The analysis `sweep`: stability at many points, spread over the ranks. What the finite elements or the matrices
//! give is made once for all points that share it, by all ranks together; the points themselves are solved by one
//! rank each.

mod bases;
mod counts;
mod cycles;
mod near_axis;
mod outcome;
mod passes;
mod places;
mod point_model;
mod sound;
mod stored_points;
mod uncertain;

use super::modes;
use super::radiation::bands_of;
use super::reduction::Reduction;
use super::run::Run;
use crate::body::mode_cache::CachedModes;
use crate::body::TraceModes;
use crate::case::axle_torque;
use crate::case::bodies::BuiltBodies;
use crate::case::interface::{given_forces, points};
use crate::case::meshes::Meshes;
use crate::case::placements;
use crate::case::preflight;
use crate::case::stability_problem::{StabilityProblem, StabilityResult};
use crate::contact::points::{interface as of_points, reactions};
use crate::contact::SlidingPoint;
use crate::grid::Interface;
use crate::job::{fe_inputs, range, Contact, ContactPlaces, Job, SweepPlan};
use crate::model::SharedModel;
use crate::output::datasets::sweep::{tables, EigenvalueSearch, Outcome};
use crate::output::datasets::uncertainty::interpolation_errors;
use crate::output::Table;
use crate::parallel::World;
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::stability::nonlinear_eigen::SpectrumMemory;
use crate::summary::Summary;
use crate::{Error, Result};
use cycles::{BranchOutcomes, FollowedPoints};
use outcome::summarise;
use passes::{Passes, PointSinks};
use point_model::StudyModel;
use std::collections::HashMap;
use stored_points::StoredPoints;
use uncertain::Study;

/// The key of the sound of limit cycles.
pub(super) const SOUND: &str = "analyses.sweep.cycles.sound_power";

/// Returns whether the points of a sweep are computed although the job's own point ended with `error`: what concerns
/// this point alone, not the machine or the program.
pub fn goes_on(error: &Error) -> bool {
    matches!(error, Error::Job(_) | Error::Input(_) | Error::NotConverged(_))
}

/// The job's own point, which serves the points of a sweep on the same finite elements.
pub struct Base<'a, 's> {
    /// Its reduced model.
    pub model: &'a Reduction,
    /// Its bodies, with their mode shapes where limit cycles are heard.
    pub bodies: &'a BuiltBodies<'s>,
    /// Free modes of each of [`BuiltBodies::unique`].
    pub modes: &'a [TraceModes],
    /// Results of stability, on rank 0.
    pub found: Option<&'a StabilityResult>,
}

/// Collective: every point of `plan`, tables under `/sweep`. `base` is there if its model could be made; `own` is
/// what went wrong at the job's own point. Points that fail are in the table with what went wrong, and in the summary
/// as the failure of the run.
pub fn run(run: &mut Run, plan: &SweepPlan, base: Option<Base<'_, '_>>, own: Option<&Error>) -> Result<()> {
    let (world, job) = (run.world(), run.job);
    let study = Study::new(world, (job, plan), (base.as_ref(), own))?;
    if let Some(study) = &study {
        study.check_cycles(world, base.as_ref())?;
    }
    let mut kept = match &study {
        Some(study) => Some(world.on_root(|| StoredPoints::open(&run.options.output, study.identity()))?),
        None => None,
    };
    let mut results: Vec<Option<Outcome>> = vec![None; plan.points.len()];
    let points = filled(world, plan, &mut results)?;
    let (families, mut groups) = match &study {
        Some(study) if study.interpolates() => places::families(&points, groups(&points)),
        _ => (Vec::new(), groups(&points)),
    };
    if let Some(Some(kept)) = &mut kept {
        run.file.discard(kept.folder());
        kept.take_up(&points, &mut results)?;
    }
    // Points of a study that an earlier run has computed are not computed again.
    let done: Vec<u8> = results.iter().map(|r| u8::from(study.is_some() && r.is_some())).collect();
    let done = world.broadcast(done);
    let mut remarks = Vec::new();
    let mut errors = Vec::new();
    let mut models = 0;
    for (family, study) in families.into_iter().zip(study.iter().cycle()) {
        let computing = places::PlaceInputs { petsc: run.petsc, meshes: run.meshes, points: &points };
        let (mut bodies, text) = match places::bodies(&computing, &family, study, run.progress)? {
            Ok(bodies) => {
                let text = bodies.in_words();
                (bodies, text)
            }
            Err(text) => {
                remarks.push(text);
                groups.extend(family.groups);
                continue;
            }
        };
        remarks.push(text);
        errors.push(bodies.errors);
        models += 1;
        study.forget();
        let planned: Vec<(usize, usize)> = family.members.iter().filter(|&&i| done[i] == 0).map(|&i| (0, i)).collect();
        let passes = Passes { study: Some(study), models: vec![&family.members], placed: true, planned, astray: false };
        run.progress.stage("points of the sweep");
        let mut into = PointSinks { points: &points, results: &mut results, kept: &mut kept };
        passes.solve(run, &mut into, &mut |_, i| {
            study.solve(StudyModel::Placed(&mut bodies), (&points, &family.members), i).transpose()
        })?;
    }
    models += groups.len();
    groups.retain(|(_, members)| members.iter().any(|&i| done[i] == 0));
    let folder = cycles::folder(&run.options.output);
    let wanted = job.analyses.sweep.as_ref().and_then(|s| s.cycles.as_ref());
    let mut followed = match wanted {
        Some(w) => {
            Some((FollowedPoints::create_folder(run, (w, SOUND), (&points, &folder))?, BranchOutcomes::new(plan, w)))
        }
        None => None,
    };
    let heard = wanted.and_then(|w| w.sound_power.as_ref());
    let mut earlier = Vec::new();
    let memory = SpectrumMemory::default();
    // Ranks share the points of several models, one for each: three points of one place are no work for two. Limit
    // cycles are shared model by model.
    let together = if followed.is_some() { 1 } else { world.size };
    for (round, batch) in groups.chunks(together).enumerate() {
        study.iter().for_each(Study::forget);
        let planned: Vec<(usize, usize)> = batch
            .iter()
            .enumerate()
            .flat_map(|(m, (_, members))| members.iter().filter(|&&i| done[i] == 0).map(move |&i| (m, i)))
            .collect();
        let of_models = batch.iter().map(|(_, members)| &members[..]).collect();
        let passes = Passes { study: study.as_ref(), models: of_models, placed: false, planned, astray: false };
        let mut models = Vec::with_capacity(batch.len());
        for (number, (inputs, members)) in batch.iter().enumerate() {
            let made = if let (true, Some(base)) = (*inputs == fe_inputs(job), &base) {
                let sources = heard.map(|_| Sources::Base(base.bodies, base.modes));
                (SharedModel::broadcast(world, base.model.on_root())?, sources)
            } else {
                run.progress.note(format!("bodies {} of {}", round * together + number + 1, groups.len()));
                let around = (run.meshes, &mut *run.progress);
                match build(run.petsc, point_of(&points, members[0])?, &mut earlier, around) {
                    Ok((model, bodies, modes)) => {
                        (model, heard.map(|_| Sources::IntrinsicDamping(Box::new(bodies), modes)))
                    }
                    Err(e) if matches!(e, Error::Defect(_) | Error::Io(_)) => return Err(e),
                    Err(e) => {
                        members.iter().for_each(|&i| results[i] = Some(Outcome::failed(&e)));
                        models.push(None);
                        continue;
                    }
                }
            };
            // Third octaves beyond the modes are refused before the points are solved.
            if let (Some(sound), Some(sources)) = (heard, &made.1) {
                let (bodies, modes) = sources.get();
                bands_of((SOUND, sound), bodies, modes)?;
            }
            // A rank keeps the models of its own points alone.
            let needed = followed.is_some() || passes.needs(number, world);
            models.push(needed.then_some(made));
        }
        run.progress.stage("points of the sweep");
        let mut into = PointSinks { points: &points, results: &mut results, kept: &mut kept };
        passes.solve(run, &mut into, &mut |m, i| {
            let (model, _) = models[m].as_mut()?;
            match &study {
                Some(study) => study.solve(StudyModel::Shared(model), (&points, &batch[m].1), i).transpose(),
                None => Some(point_of(&points, i).and_then(|point| solve(model, point, &memory))),
            }
        })?;
        if let (Some((wanted, found)), [Some((model, sources))]) = (&mut followed, &mut models[..]) {
            let chains = cycles::chains(plan, wanted.cycles, &batch[0].1);
            let unstable = batch[0].1.iter().any(|&i| results[i].as_ref().is_some_and(|r| r.unstable() > 0));
            let unstable = world.broadcast(vec![u8::from(unstable)]) == [1];
            found.follow(run, wanted, (model, sources.take()), (&chains, unstable))?;
        }
    }
    let loudness = match &study {
        Some(study) => study.loudness(run, (plan, &points), base.as_ref(), &results)?,
        None => None,
    };
    world.on_root(|| {
        let all: Vec<Outcome> = results
            .into_iter()
            .map(|r| r.ok_or_else(|| Error::Defect("a point of the sweep was not computed".into())))
            .collect::<Result<_>>()?;
        if let Some(study) = &study {
            run.file.tables(study.report(plan, &all, models, &mut run.summary)?);
            run.file.tables(interpolation_errors(&errors));
            remarks.iter().for_each(|text| run.summary.value("places", text.clone()));
            if let Some(loudness) = loudness {
                run.file.tables(loudness.report(plan, &mut run.summary));
            }
            return Ok(());
        }
        run.file.tables(tables(plan, &all, own));
        if job.contact.as_ref().is_some_and(|c| c.places == ContactPlaces::All) {
            let contacts = |point: &Option<Job>| point.iter().flat_map(|p| &p.contact).flat_map(|c| c.all()).count();
            let text = "Contacts of the wheel at each point; 0 where it could not be placed.";
            let counts: Vec<i64> = points.iter().map(|p| contacts(p) as i64).collect();
            run.file.table(Table::list("/sweep/contacts", "1", text, counts));
        }
        if let Some(e) = own {
            let text =
                format!("the job's own point failed, those of the sweep were computed and are in the results: {e}");
            run.summary.fail(Error::NotConverged(text));
        }
        if let Some((wanted, found)) = followed {
            run.file.tables(cycles::report(plan, wanted.cycles, &all, found, &mut run.summary));
        }
        let kind = if job.by_matrices() { "reduced" } else { "finite-element" };
        summarise(plan, &all, models, kind, &mut run.summary);
        Ok(())
    })?;
    Ok(())
}

/// Collective: the points with the creepages that follow from their placements; those whose wheels stand on no rail
/// have failed.
fn filled(world: &World, plan: &SweepPlan, results: &mut [Option<Outcome>]) -> Result<Vec<Option<Job>>> {
    let mut all = Vec::new();
    let found = placements::all_filled(world, &plan.points);
    for ((point, result), found) in plan.points.iter().zip(results).zip(found) {
        all.push(match found {
            Ok(found) => Some(found.unwrap_or_else(|| point.clone())),
            Err(e) if matches!(e, Error::Defect(_) | Error::Io(_)) => return Err(e),
            Err(e) => {
                *result = Some(Outcome::failed(&e));
                None
            }
        });
    }
    Ok(all)
}

fn point_of(points: &[Option<Job>], i: usize) -> Result<&Job> {
    points.get(i).and_then(Option::as_ref).ok_or_else(|| Error::Defect(format!("point {i} of the sweep is missing")))
}

/// The contact of a point.
fn contact_of(point: &Job) -> Result<&Contact> {
    point.contact.as_ref().ok_or_else(|| Error::Defect("a point of a sweep without contact".into()))
}

/// The points by the finite elements they need, in the order of their first points.
fn groups(points: &[Option<Job>]) -> Vec<(serde_json::Value, Vec<usize>)> {
    let mut groups: Vec<(serde_json::Value, Vec<usize>)> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for (i, point) in points.iter().enumerate() {
        let Some(point) = point else { continue };
        let inputs = fe_inputs(point);
        let group = *known.entry(inputs.to_string()).or_insert(groups.len());
        match groups.get_mut(group) {
            Some(group) => group.1.push(i),
            None => groups.push((inputs, vec![i])),
        }
    }
    groups
}

/// Bodies whose surfaces radiate, with their modes.
enum Sources<'a, 's> {
    /// Bodies of the job's own point.
    Base(&'a BuiltBodies<'s>, &'a [TraceModes]),
    /// Bodies of a point of the sweep.
    IntrinsicDamping(Box<BuiltBodies<'a>>, Vec<TraceModes>),
}

impl<'a, 's: 'a> Sources<'a, 's> {
    fn get(&self) -> (&BuiltBodies<'a>, &[TraceModes]) {
        match self {
            Self::Base(bodies, modes) => (bodies, modes),
            Self::IntrinsicDamping(bodies, modes) => (bodies, modes),
        }
    }
}

/// Collective: the reduced model of a point, on every rank, its bodies and their modes. Modes that bodies elsewhere
/// have found are `earlier`.
fn build<'p>(
    petsc: &'p Petsc,
    point: &Job,
    earlier: &mut Vec<Option<CachedModes>>,
    (meshes, progress): (&Meshes, &mut Progress),
) -> Result<(SharedModel, BuiltBodies<'p>, Vec<TraceModes>)> {
    let world = petsc.world();
    let mut quiet = Summary::default();
    let mut job = point.clone();
    // Each point brings its own damping.
    job.bodies.all_mut().for_each(|body| body.damping = Default::default());
    let contact = contact_of(&job)?;
    world.on_root(|| preflight::of_run(&job, meshes, true).map(drop))?;
    let mut bodies = BuiltBodies::build(petsc, &job, meshes, progress, &mut quiet)?;
    bodies.factorise(&job, progress, &mut quiet)?;
    bodies.unique.iter_mut().zip(&*earlier).for_each(|(body, found)| found.iter().for_each(|f| body.reuse_modes(f)));
    let found = modes::compute_all(&job, &mut bodies, progress)?;
    *earlier = bodies.unique.iter().map(|body| body.cached_modes()).collect();
    let model = match Reduction::shared(world, &job, contact, (&bodies, &found), progress)? {
        Some(model) => model,
        None => {
            let made = Reduction::build(world, &job, contact, &bodies, &found, progress)?;
            SharedModel::broadcast(world, made.on_root())?
        }
    };
    Ok((model, bodies, found))
}

/// Message of a run that is stopped among the points.
fn stopped(is_kept: bool, output: &std::path::Path) -> String {
    match is_kept {
        false => "stopped on request among the points of the sweep, which are not kept".into(),
        true => format!(
            "stopped on request among the samples; those that are done are kept in {}, and the same run takes them up",
            stored_points::folder(output).display()
        ),
    }
}

/// Stability at one point, on this rank alone.
fn solve(model: &mut SharedModel, point: &Job, memory: &SpectrumMemory) -> Result<Outcome> {
    with_problem(model, point, |problem| Ok(outcome_of(problem.contact, &problem.eigenvalues(memory)?)))
}

/// The contact nodes of a point: its contact points, on a disc with the creeps of this point, or the grid of the model.
fn interface_at(point: &Job, of_model: &Interface) -> Result<Interface> {
    match point.contact.as_ref().and_then(points) {
        Some(points) if point.is_disc_with_pads() => {
            let creep = |p: &SlidingPoint| p.direction.map(|d| d * p.velocity.unwrap_or(0.0));
            Ok(of_model.with_creep(points.iter().map(creep).collect()))
        }
        Some(points) => of_points(&points),
        None => Ok(of_model.clone()),
    }
}

/// Result of `examine` for the stability problem of a point, on this rank alone.
fn with_problem<T>(
    model: &mut SharedModel,
    point: &Job,
    examine: impl FnOnce(&StabilityProblem) -> Result<T>,
) -> Result<T> {
    let Some(wanted) = &point.analyses.stability else {
        return Err(Error::Defect("a point of a sweep without stability".into()));
    };
    range(point)?;
    // Each point brings its own damping, and its own contact points.
    let interface = interface_at(point, &model.interface)?;
    let balanced = axle_torque::balanced(point, (&interface, model.pair(point)?))?;
    let job = balanced.as_ref().unwrap_or(point);
    let model = (&interface, model.pair(job)?);
    examine(&StabilityProblem { job, stability: wanted, contact: contact_of(job)?, model })
}

/// Angular speed of the axle of a contact by its torque, rad/s, where one is given.
fn balanced_speed(contact: &crate::job::Contact) -> Option<f64> {
    contact.torque?;
    contact.placement.as_ref()?.angular_speed
}

/// The outcome of a point with this contact.
fn outcome_of(contact: &crate::job::Contact, found: &StabilityResult) -> Outcome {
    let (spectrum, linear) = (&found.spectrum, &found.contact);
    let state = found.state.as_ref();
    let force = match (state, given_forces(contact)) {
        (Some(state), _) => state.patches[0].force,
        (None, Some(points)) => {
            let all = reactions(&points, contact.law());
            let sum = |c: usize| all.iter().skip(c).step_by(3).sum::<f64>();
            [sum(0), sum(1), -sum(2)]
        }
        (None, None) => [0.0; 3],
    };
    Outcome {
        status: 0,
        message: String::new(),
        eigenvalues: spectrum.eigenpairs.iter().map(|p| p.value).collect(),
        backward_error: spectrum.eigenpairs.iter().map(|p| p.backward_error).fold(0.0, f64::max),
        closed: linear.nodes.len(),
        sticking: spectrum.sticking,
        reversed: state.map_or(0, |s| s.reversed),
        force,
        approach: state.map_or(f64::NAN, |s| s.patches[0].approach),
        angular_speed: balanced_speed(contact).unwrap_or(f64::NAN),
        followed: Vec::new(),
        search: EigenvalueSearch::Whole,
        interpolated: false,
    }
}
