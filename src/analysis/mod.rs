//! From a job to results: the driver, then one file per analysis.

mod complex_modes;
mod creep_curve;
mod curving;
mod cycles;
mod deferred_correction;
mod full_stability;
mod inputs;
mod modes;
mod point;
mod radiation;
mod receptance;
pub mod reduction;
mod reuse;
mod run;
mod run_state;
mod sensitivity;
mod stability;
mod steady;
pub(crate) mod steps;
mod sweep;
mod track_decay;
pub mod track_fit;
mod transient;

use crate::body::{Capability, Kind};
use crate::case::{preflight, wheel_rail_geometry, Meshes};
use crate::job::{self, damping_lines, Compliance, Job, TransientModel};
use crate::output::datasets::contacts::{self, NamedContact};
use crate::output::datasets::reduced::of_modes_alone;
use crate::output::verdict::Verdict;
use crate::output::{companion, Provenance, Reader, ResultFile, Segments, MODEL};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::stop::Stop;
use crate::summary::Summary;
use crate::{Error, Result};
use run_state::RunState;
use std::cell::OnceCell;
use std::path::PathBuf;
use steps::{is_heard, steps, PriorRun, Step};

pub use cycles::job_of as job_of_branches;
pub use run::Run;

/// Options of the command line beside the job.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// The job file; none where the job comes from the run that is continued.
    pub job: Option<PathBuf>,
    /// The result file.
    pub output: PathBuf,
    /// True if existing results are overwritten.
    pub force: bool,
    /// A result file whose modes and compliance are taken instead of computing them.
    pub reuse: Option<PathBuf>,
    /// The command line, for the provenance.
    pub command: Vec<String>,
    /// Name and version of the program and of its libraries, for the provenance.
    pub versions: Vec<(String, String)>,
    /// True if a transient is continued from the segments beside `output`.
    pub resume: bool,
    /// Wall time after which a transient stops, s.
    pub wall_time: Option<f64>,
}

/// Refuses analyses that cannot run, before anything is meshed; rules of the job itself are checked elsewhere.
pub fn check(job: &Job) -> Result<()> {
    capable(job)?;
    match (&job.analyses.transient, &job.contact) {
        (Some(wanted), Some(contact)) => transient::check(job, wanted, contact),
        _ => Ok(()),
    }
}

/// Capabilities of the bodies that the analyses of the contact need, and the keys that ask for them.
fn wanted(job: &Job) -> Vec<(&'static str, Capability)> {
    let a = &job.analyses;
    let transient = |of: &dyn Fn(&crate::job::Transient) -> bool| a.transient.as_ref().is_some_and(of);
    let all = [
        ("steady", a.steady.is_some(), Capability::Grid),
        ("creep_curve", a.creep_curve.is_some(), Capability::Grid),
        ("receptance", a.receptance.is_some(), Capability::Modes),
        ("stability", a.stability.is_some(), Capability::Modes),
        ("stability.full", a.stability.as_ref().is_some_and(|s| s.full.is_some()), Capability::FullSystem),
        ("transient", a.transient.is_some(), Capability::Modes),
        ("cycles", a.cycles.is_some(), Capability::Modes),
        ("transient.model", transient(&|t| t.model == TransientModel::Full), Capability::FullSystem),
        ("transient.points", transient(&|t| !t.points.is_empty()), Capability::Fields),
        ("transient.sound_power", transient(&|t| t.sound_power.is_some()), Capability::Surface),
        ("transient.body_stride", transient(&|t| t.body_stride > 0), Capability::Fields),
    ];
    let sounds = a.limit_cycle_sounds().map(|(key, sound)| (key, sound.is_some(), Capability::Surface));
    all.into_iter().chain(sounds).filter(|w| w.1).map(|(key, _, what)| (key, what)).collect()
}

/// An error if an analysis needs what a body cannot give.
fn capable(job: &Job) -> Result<()> {
    let half_space = job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::HalfSpace);
    let hybrid = job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::Hybrid);
    let by_means = hybrid && job.bodies().iter().all(|(_, b)| b.is_meshed());
    for (key, what) in wanted(job) {
        if by_means && what == Capability::FullSystem {
            return Err(Error::Job(format!(
                "analyses.{key}: takes the contact from the finite elements themselves, which \
                 contact.compliance \"hybrid\" does not; expected \"fe\". Change one \
                 of the two"
            )));
        }
        let needed = match what {
            Capability::Grid => "meshes with a contact surface",
            Capability::Modes => "modes",
            Capability::Fields => "meshes",
            Capability::Surface => "surfaces that radiate sound",
            Capability::FullSystem => "matrices",
            Capability::SeveralContacts => "several contacts",
        };
        let of_transient = job.analyses.transient.as_ref().and_then(|t| t.sound_power.as_ref());
        let of_cycles = job.analyses.limit_cycle_sounds().into_iter().find(|of| of.0 == key).and_then(|of| of.1);
        let sounding = if key == "transient.sound_power" { of_transient } else { of_cycles };
        let sounding = sounding.map(|s| &s.bodies);
        let asked =
            |name: &str| what != Capability::Surface || sounding.is_none_or(|all| all.iter().any(|b| b.name() == name));
        for (name, body) in job.bodies().into_iter().filter(|(name, _)| asked(name)) {
            let (kind, is) = match body.matrices {
                Some(_) => (Kind::Matrices, "is given by matrices"),
                None if half_space => (Kind::HalfSpace, "is a half-space"),
                None if body.is_half_space() => (Kind::HalfSpace, "is a half-space"),
                None if body.track.is_some() => (Kind::Rail, "is a rail"),
                None if !body.is_meshed() => (Kind::Swept, "is swept from a section"),
                None => (Kind::Elements, "is of finite elements"),
            };
            if !kind.can(what) {
                return Err(Error::Job(format!(
                    "analyses.{key}: needs {needed}, which bodies.{name} does not have: it {is}; leave one of \
                     the two out"
                )));
            }
        }
    }
    Ok(())
}

/// Surroundings of a run at its beginning.
#[derive(Clone, Copy)]
pub struct RunContext<'r> {
    /// Data read of the mesh files to plan the run, on rank 0.
    pub meshes: &'r Meshes,
    /// When to stop.
    pub stop: &'r Stop,
}

/// Collective: runs the analyses of `job` and writes the result file. The summary is the same on every rank.
pub fn run(
    petsc: &Petsc,
    job: &Job,
    options: &RunOptions,
    around: &RunContext,
    progress: &mut Progress,
) -> Result<Summary> {
    let world = petsc.world();
    let &RunContext { meshes, stop } = around;
    if let (true, Some(path)) = (job.is_reduced_anew(), &options.reuse) {
        return Err(Error::Job(format!(
            "--reuse {}: bodies given by matrices, or a disc with its pads, are reduced anew in each run; leave it out",
            path.display()
        )));
    }
    let date = crate::output::utc_now();
    check(job)?;
    world.on_root(|| inputs::refuse_overwriting_inputs(job, options))?;
    let segments = world.on_root(|| segments(job, options, progress))?.flatten();
    let file = ResultFile::create(world, &options.output, options.force || options.resume)?;
    for (files, what) in [
        (&file.left().removed, "unfinished files of a run that was killed are removed"),
        (&file.left().elsewhere, "unfinished files are of a run on another machine; remove them unless it is at work"),
    ] {
        let names: Vec<_> = files.iter().map(|path| path.display().to_string()).collect();
        if !names.is_empty() {
            progress.note(format!("{what}: {}", names.join(", ")));
        }
    }
    let model = companion(&options.output, MODEL);
    if options.reuse.is_none() && !options.resume && world.is_root() && model.is_file() {
        let (name, what) = (model.display(), reuse::held(&model));
        progress.note(format!("{name} has {what} of a run that did not come to its end: --reuse {name} takes them up"));
    }
    // What is written as the job stays as it was given.
    let filled = wheel_rail_geometry::filled(world, job)?;
    let given = job;
    let job = filled.as_ref().unwrap_or(job);
    let balanced = OnceCell::new();
    let summary = Summary::from_job(job);
    let mut run =
        Run { petsc, job, given, balanced: &balanced, options, meshes, stop, segments, file, progress, summary };
    let inputs = perform(&mut run).map_err(|e| match run.file.kept_file() {
        Some(kept) if kept.exists() => {
            let what = if run.file.keeps_all() { "Modes and compliance" } else { "Modes" };
            e.with(format!("{what} are kept in {0}: --reuse {0} takes them up", kept.display()))
        }
        _ => e,
    })?;
    let job = run.job;
    if let Some(contact) = job.contact.as_ref().filter(|c| world.is_root() && !c.further.is_empty()) {
        let of = |(name, one): (String, &job::Contact)| {
            let job::Creepage { longitudinal, lateral, spin } = one.creepage;
            let (friction, creepage) = (one.law().coefficient(0.0), [longitudinal, lateral, spin]);
            NamedContact { name, angle: one.angle, friction, speed: one.speed, creepage }
        };
        let named: Vec<NamedContact> = contact.names().into_iter().zip(contact.all()).map(of).collect();
        run.file.tables(contacts::tables(&named));
    }

    let Run { mut file, progress, mut summary, segments, .. } = run;
    file.merge(progress)?;
    progress.stage("writing results");
    let verdict = world.on_root(|| Ok(Verdict::new(&given.to_json(), file.tables_so_far())))?.flatten();
    if let Some(verdict) = verdict {
        summary.verdict(verdict.lines().map(str::to_owned));
        file.tables(verdict.tables());
    }
    let mut provenance = Provenance {
        job: serde_json::to_string_pretty(&given.to_json()).map_err(|e| Error::Defect(format!("resolved job: {e}")))?,
        command: options.command.clone(),
        versions: options.versions.clone(),
        ranks: world.size,
        inputs: inputs.unwrap_or_default(),
        stages: Vec::new(),
        date,
        parts: segments.map(|s| s.parts()).unwrap_or_default(),
        warnings: summary.warnings().to_vec(),
        summary: summary.lines().to_vec(),
        damping: damping_lines(job),
    };
    // All is written but how long it took.
    file.finish(|| {
        progress.finish();
        provenance.stages = progress.times().to_vec();
        provenance.tables()
    })?;
    summary.line(format!("results: {}", options.output.display()));
    Ok(summary)
}

/// On rank 0: the segments of the transient of `job`, where it has one: those of a run to be continued, every one of
/// them as it was written, or the right to make them.
fn segments(job: &Job, options: &RunOptions, progress: &mut Progress) -> Result<Option<Segments>> {
    if options.resume && job.analyses.transient.is_none() {
        return Err(Error::Job("--resume: only a transient can be continued; the job has none".into()));
    }
    if job.analyses.transient.is_none() {
        return Ok(None);
    }
    let segments = match options.resume {
        true => Segments::reopen(&options.output)?,
        false => Segments::claim(&options.output, options.force)?,
    };
    if options.resume {
        transient::refuse_other_job(&segments, job)?;
        progress.stage("checking the segments");
        segments.verify().map_err(|e| e.context("--resume"))?;
    }
    if !segments.locked() {
        let place = segments.folder().display();
        progress.note(format!("warning: the file system of {place} has no locks; do not start this run twice"));
    }
    Ok(Some(segments))
}

/// Collective: what there is of earlier runs.
fn earlier(run: &Run) -> PriorRun {
    let RunOptions { reuse, resume, output, .. } = run.options;
    let left = companion(output, MODEL);
    let same = |path: &PathBuf| path.canonicalize().ok().zip(left.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    // What stands against reading it is said when it is read.
    let alone = |path: &PathBuf| Reader::open(path).is_ok_and(|file| of_modes_alone(&file));
    let shapes = || reuse::shapes::of_unfinished(run.options).is_some();
    let found = match run.world().is_root() {
        true => {
            let given = |of: &dyn Fn(&PathBuf) -> bool| reuse.as_ref().is_some_and(of);
            let flags = [given(&alone), shapes(), given(&same) && !resume, given(&|p| reuse::is_left(p))];
            flags.into_iter().map(u8::from).collect()
        }
        false => Vec::new(),
    };
    let found: Vec<bool> = run.world().broadcast(found).into_iter().map(|flag| flag == 1).collect();
    let at = |k: usize| found.get(k).copied().unwrap_or(false);
    PriorRun { reuse: reuse.is_some(), resume: *resume, alone: at(0), shapes: at(1), own: at(2), left: at(3) }
}

/// Collective: the examination that `railsqueal check` makes, before anything is factorised; with the meshes of the
/// bodies if they are `made`.
fn examine(run: &mut Run, made: bool) -> Result<()> {
    run.progress.stage("examining the job");
    let found = run.world().on_root(|| preflight::of_run(run.job, run.meshes, made))?;
    run.warn(found.map(|report| report.warnings).unwrap_or_default());
    Ok(())
}

/// Collective: the steps of the job and the points of its sweep; returns name and checksum of every input on rank 0.
fn perform(run: &mut Run) -> Result<Option<Vec<(String, String)>>> {
    let earlier = earlier(run);
    let all = steps(run.job, earlier);
    if is_heard(run.job) && earlier.reuse && !earlier.shapes && !all.contains(&Step::Modes) {
        let key = run.job.analyses.limit_cycle_sounds().into_iter().find(|(_, sound)| sound.is_some()).map(|of| of.0);
        return Err(Error::Job(format!(
            "analyses.{}: with --reuse there are no mode shapes of the bodies; leave the sound out, or run without \
             --reuse",
            key.unwrap_or_default()
        )));
    }
    let examined = examine(run, all.contains(&Step::Bodies));
    if run.job.sweep.is_none() {
        examined.clone()?;
    }
    curving::run(run)?;
    track_decay::run(run)?;
    let mut stock = RunState::new(earlier);
    let mut each = || {
        all.iter().enumerate().try_for_each(|(number, &step)| {
            stock.perform(step, run)?;
            match number + 1 < all.len() && run.stop.wanted(run.world()) {
                true => Err(Error::Stopped(match run.options.resume {
                    true => format!("stopped on request; continue with --resume {}", run.options.output.display()),
                    false => "stopped on request before the end of the run".into(),
                })),
                false => Ok(()),
            }
        })
    };
    // Points of a sweep are examined each for itself.
    let own = examined.and_then(|()| each());
    match &run.job.sweep {
        Some(plan) if own.as_ref().err().is_none_or(sweep::goes_on) => {
            sweep::run(run, plan, stock.base(), own.as_ref().err())?;
        }
        _ => own?,
    }
    run.world().on_root(|| stock.checksums(run))
}
