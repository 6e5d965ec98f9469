//! The analysis `transient`: rolling contact in time, from a state of rest and its perturbation, written in segments.

mod fields;
mod full;
mod points;
mod sound;
pub(crate) mod stored_model;
mod time_loop;
mod transient_summary;

pub use crate::output::datasets::checkpoint::refuse_other_job;

use super::full_stability::FullComparison;
use super::reduction::Reduction;
use super::run::Run;
use super::steps::Requirements;
use super::RunOptions;
use crate::body::TraceModes;
use crate::case::bodies::BuiltBodies;
use crate::case::roughness;
use crate::case::stability_problem::StabilityResult;
use crate::case::transient_problem::{drive, moved, TransientProblem};
use crate::job::{self, Job, TransientModel};
use crate::model::ReducedModel;
use crate::output::datasets::checkpoint::{self, Checkpoint};
use crate::output::datasets::points::Points;
use crate::output::datasets::record::{grid, group};
use crate::output::verdict::of_motion;
use crate::output::{Segments, Table};
use crate::progress::Progress;
use crate::stability::grows;
use crate::stability::reduced::Eigenpair;
use crate::stop::Stop;
use crate::summary::Summary;
use crate::transient::{Scheme, State, Stepper};
use crate::{Error, Result};
use points::LocatedPoints;
use sound::Sound;
use std::path::Path;
use time_loop::{LoopReport, TimeLoop};

/// Results of other stages of a run that the transient uses.
pub struct Inputs<'a> {
    /// The job.
    pub job: &'a Job,
    /// The job as it was given, by which the run is known.
    pub given: &'a Job,
    /// Its transient.
    pub wanted: &'a job::Transient,
    /// Its contact.
    pub contact: &'a job::Contact,
    /// The bodies with their modes; none where nothing is asked of them.
    pub bodies: &'a BuiltBodies<'a>,
    /// The names of the places, and which of the bodies that differ are in them.
    pub places: &'a [(&'static str, usize)],
    /// Modes of each body that differs.
    pub modes: &'a [TraceModes],
    /// True if an earlier run, where modes are of one, gives the shapes of the modes too.
    pub shapes: bool,
    /// The reduced model.
    pub model: &'a Reduction,
    /// On rank 0: what stability found, where it was asked for.
    pub found: Option<&'a StabilityResult>,
    /// Result that the full system found beside the mode that the bodies are moved along at the start, where it was
    /// asked.
    pub beside: Option<&'a FullComparison>,
    /// Options of the command line.
    pub options: &'a RunOptions,
    /// When to stop.
    pub stop: &'a Stop,
    /// On rank 0: the segments of the run.
    pub segments: Option<&'a Segments>,
    /// File in which modes and compliance are kept until the first segment has them.
    pub kept: Option<&'a Path>,
}

impl Inputs<'_> {
    /// On rank 0: the eigenvalues of the reduced model, by falling growth rate.
    fn eigenpairs(&self) -> &[Eigenpair] {
        self.found.map_or(&[], |f| &f.spectrum.eigenpairs)
    }

    /// On rank 0: the eigenvalue along whose mode the bodies are moved at the start.
    fn start_mode(&self) -> Result<&Eigenpair> {
        let number = self.wanted.start.mode.unwrap_or(0);
        (number as usize).checked_sub(1).and_then(|i| self.eigenpairs().get(i)).ok_or_else(|| {
            let found = self.eigenpairs().len();
            Error::Job(format!("analyses.transient.start.mode is {number}: stability found {found} eigenvalues"))
        })
    }

    /// On rank 0: the segments of the run.
    fn segments(&self) -> Result<&Segments> {
        self.segments.ok_or_else(|| Error::Defect("a transient without segments".into()))
    }
}

/// Requirements of the analysis on the bodies: named points and the motion of the bodies take static solves, and sound
/// the shapes. What moves the points and how the modes radiate is in the first segment of a run that is continued.
pub(super) fn needs(wanted: &job::Transient, resume: bool) -> Requirements {
    if wanted.model == TransientModel::Full {
        return full::needs(wanted, resume);
    }
    let solvers = (!wanted.points.is_empty() && !resume) || wanted.body_stride > 0;
    Requirements { solvers, shapes: solvers || (wanted.sound_power.is_some() && !resume) }
}

/// Collective: the transient; its results become part of `file`. At the start of a run rank 0 has the reduced model
/// as tables in `keep`, for the first segment.
pub fn run(run: &mut Run, inputs: &Inputs<'_>, keep: Vec<Table>) -> Result<()> {
    let world = run.world();
    let wanted = inputs.wanted;
    if wanted.body_stride > 0 && !inputs.shapes {
        return Err(Error::Job(
            "analyses.transient.body_stride: with --reuse there are no mode shapes of the bodies; set it to 0, \
             or run without \
             --reuse"
                .into(),
        ));
    }
    let full = wanted.model == TransientModel::Full;
    let mut located = LocatedPoints::default();
    let points = if full {
        full::refuse_without_shapes(inputs)?;
        located = LocatedPoints::find(wanted, inputs.bodies, true)?;
        full::points(&mut located, inputs.model.on_root().map_or(0, |root| 3 * root.interface.len()));
        std::mem::take(&mut located.points)
    } else if inputs.options.resume {
        let found = world.on_root(|| Points::restore(wanted, &inputs.segments()?.open_first()?))?;
        found.unwrap_or_default()
    } else {
        located = LocatedPoints::find(wanted, inputs.bodies, inputs.shapes)?;
        located.solve(inputs.bodies, inputs.modes, inputs.model)?;
        std::mem::take(&mut located.points)
    };
    let sound = match &wanted.sound_power {
        Some(power) => Some(Sound::new(world, inputs, power, run.progress)?),
        None => None,
    };
    run.progress.stage("transient");
    if world.is_root() {
        report_damping(wanted, inputs.eigenpairs(), run.progress, &mut run.summary);
    }
    let done = if full {
        full::run(run, inputs, (&located, &points), sound.as_ref(), keep)?
    } else {
        let wish = || inputs.stop.signalled();
        let work =
            |elsewhere: &dyn Fn() -> bool| advance(inputs, (&points, sound.as_ref()), keep, elsewhere, run.progress);
        world.on_root_heeding(wish, work)?
    };
    if let Some(LoopReport { effort, steps, seconds, account }) = &done {
        let pair = &inputs.model.root()?.pair;
        let per = |n: usize| n as f64 / (*steps).max(1) as f64;
        run.summary.line(format!("transient: {} s in steps of {} s", wanted.duration, wanted.step));
        roughness::described(inputs.job)?.into_iter().for_each(|line| run.summary.line(line));
        if *steps > 0 {
            run.summary.value("computing time per step", format!("{:.3} ms", 1e3 * seconds / *steps as f64));
            run.summary.value(
                "work per step",
                format!(
                    "{:.2} iterations, {:.2} products, {:.2} solutions, {:.4} factorisations, {:.4} sweeps",
                    per(effort.iterations),
                    per(effort.products),
                    per(effort.solutions),
                    per(effort.factorisations),
                    per(effort.sweeps)
                ),
            );
        }
        account.report(&points.names, &mut run.summary)?;
        if let Some(frequency) = account.beyond(pair.reach)?.filter(|_| !full) {
            run.progress.note(format!(
                "warning: analyses.transient: the contact forces oscillate most at {frequency:.0} Hz, and the modes \
                 describe the bodies up to {:.0} Hz: the model squeals there, the bodies need not. Give analyses.modes \
                 a higher max_frequency, the bodies their damping there, or a larger theta",
                pair.reach
            ));
        }
        run.file.tables(points.tables());
        run.file.tables(inputs.model.root().map(|m| grid(&m.interface, pair))?);
        let interface = &inputs.model.root()?.interface;
        let rough = roughness::surfaces(inputs.job, interface)?.unwrap_or_default();
        for (number, (surface, patch)) in rough.iter().zip(&interface.patches).enumerate() {
            run.file.tables(roughness::tables(number, surface, &patch.y, wanted.duration));
        }
        let segments = inputs.segments()?;
        for number in 0..interface.patches.len() {
            run.file.append(segments.clone(), &group(number));
        }
    }
    if let Some(sound) = &sound {
        run.progress.stage("sound power");
        sound.write(run, inputs)?;
    }
    if let (Some(LoopReport { account, .. }), None) = (&done, &run.job.analyses.stability) {
        let (rate, frequency) = account.motion()?;
        let sentence = of_motion(&run.given.to_json(), run.file.tables_so_far(), rate, frequency);
        run.summary.verdict([sentence]);
    }
    if wanted.body_stride > 0 {
        run.progress.stage("motion of the bodies");
        fields::write(run, inputs)?;
    }
    Ok(())
}

/// The scheme's own damping beside the growth rates that it would falsify.
fn report_damping(wanted: &job::Transient, pairs: &[Eigenpair], progress: &Progress, summary: &mut Summary) {
    let scheme = Scheme { step: wanted.step, theta: wanted.theta };
    for e in pairs.iter().filter(|e| grows(e.value, e.backward_error) && e.frequency() > 0.0) {
        let own = scheme.own_damping(e.value.im.abs());
        let share = own / e.growth_rate();
        let text = match share <= 1.0 {
            true => format!("{own:.3e} 1/s, {:.2} % of the growth rate {:.4e} 1/s", 100.0 * share, e.growth_rate()),
            false => format!("{own:.3e} 1/s, more than its growth rate {:.4e} 1/s: it dies away", e.growth_rate()),
        };
        summary.value(&format!("damping by the scheme, {:.2} Hz", e.frequency()), &text);
        if share > 0.02 {
            progress.note(format!(
                "warning: the scheme damps the unstable motion at {:.2} Hz by {text}; take theta nearer to 0.5 \
                 or a shorter step",
                e.frequency()
            ));
        }
    }
}

/// On rank 0: all steps on the reduced model.
fn advance(
    inputs: &Inputs<'_>,
    (points, sound): (&Points, Option<&Sound<'_>>),
    keep: Vec<Table>,
    elsewhere: &dyn Fn() -> bool,
    progress: &mut Progress,
) -> Result<LoopReport> {
    let (root, segments) = (inputs.model.root()?, inputs.segments()?);
    let wanted = inputs.wanted;
    let rolling =
        TransientProblem { job: inputs.job, wanted, contact: inputs.contact, model: (&root.interface, &root.pair) };
    // The settings follow from the state of rest; a resumed run finds the same again.
    let ready = rolling.ready()?;
    let interface = ready.interface();
    let model = ready.model(&root.pair);
    Scheme { step: wanted.step, theta: wanted.theta }.check(model.omega)?;
    let surfaces = roughness::surfaces(inputs.job, interface)?;
    let identity = roughness::identity(checkpoint::identity(&model), surfaces.as_deref());
    let resumed = if inputs.options.resume { Some(Checkpoint::last(segments)?) } else { None };
    let (rest, settings) = ready.initial_state(&model, &rolling)?;
    let begin = |state: State| -> Result<Stepper<'_>> {
        let stepper = Stepper::new(model, settings, state)?;
        let stepper = match rolling.augmentation() {
            Some(rho) => stepper.consistent(rho)?,
            None => stepper,
        };
        Ok(match surfaces {
            Some(surfaces) => stepper.rough(surfaces)?,
            None => stepper,
        })
    };
    let (mut stepper, begun);
    match resumed {
        Some(found) => {
            let at_start = found.state.step == 0 && is_perturbed(inputs);
            stepper = begin(found.state)?;
            if at_start {
                stepper = stepper.after_settling();
            }
            begun = Some(found.identity);
        }
        None => {
            let (start, moved) = perturbed(inputs, root, rest)?;
            stepper = begin(start)?;
            if moved {
                stepper.settle().map_err(|e| e.context("analyses.transient: the start"))?;
            }
            begun = None;
        }
    }
    let course = TimeLoop { inputs, points, sound, identity, more: &|| Ok(Vec::new()), elsewhere };
    course.go(stepper, begun.as_deref(), keep, progress)
}

/// The start with its perturbations, and whether there are any.
fn perturbed(inputs: &Inputs<'_>, root: &ReducedModel, mut state: State) -> Result<(State, bool)> {
    let start = &inputs.wanted.start;
    if start.mode.is_some() {
        state = moved(state, &root.pair, inputs.start_mode()?, start.amplitude);
    }
    if let Some(random) = start.random {
        state = state.shaken(u64::from(random.seed), random.energy);
    }
    Ok((state, is_perturbed(inputs)))
}

/// True if the start has perturbations.
fn is_perturbed(inputs: &Inputs<'_>) -> bool {
    let start = &inputs.wanted.start;
    start.mode.is_some() || start.random.is_some()
}

/// Checks that need no mesh.
pub fn check(job: &Job, wanted: &job::Transient, contact: &job::Contact) -> Result<()> {
    Scheme { step: wanted.step, theta: wanted.theta }.check(&[])?;
    sound::check(wanted)?;
    if wanted.model == TransientModel::Full {
        full::check(job)?;
    }
    roughness::check(job)?;
    drive(wanted, contact, &[], &[]).map(|_| ())
}
