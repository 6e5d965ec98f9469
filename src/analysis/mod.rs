//! From a job to results: the driver, then one file per analysis.

mod bodies;
mod complex_modes;
mod deferred;
mod full_stability;
mod interface;
mod matrices;
mod modes;
pub mod plan;
pub mod receptance;
pub mod reduction;
mod report;
mod reuse;
mod run;
mod stability;
mod steady;
mod sweep;
pub mod transient;

use crate::job::{Compliance, Job};
use crate::model::ReducedModel;
use crate::output::{sha256, Provenance, ResultFile, Segments};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::{Error, Result};
use bodies::Bodies;
use reduction::Reduction;
use reuse::{Origin, Reused};
use std::path::PathBuf;
use sweep::Base;
use transient::{Inputs, Stop};

pub use report::Summary;
pub use run::Run;

/// What the command line adds to the job.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// The result file.
    pub output: PathBuf,
    /// Whether existing results are overwritten.
    pub force: bool,
    /// A result file whose modes and compliance are taken instead of computing them.
    pub reuse: Option<PathBuf>,
    /// The command line, for the provenance.
    pub command: Vec<String>,
    /// Name and version of the program and of its libraries, for the provenance.
    pub versions: Vec<(String, String)>,
    /// Whether a transient is continued from the segments beside `output`.
    pub resume: bool,
    /// Wall time after which a transient stops, s.
    pub wall_time: Option<f64>,
}

/// What of the analyses can be refused before anything is meshed, beyond what the job itself shows.
pub fn check(job: &Job) -> Result<()> {
    match (&job.analyses.transient, &job.contact) {
        (Some(wanted), Some(contact)) => transient::check(wanted, contact),
        _ => Ok(()),
    }
}

/// Collective: runs the analyses of `job` and writes the result file. The summary is the same on every rank.
pub fn run(petsc: &Petsc, job: &Job, options: &RunOptions, progress: &mut Progress) -> Result<Summary> {
    let world = petsc.world();
    if let (true, Some(path)) = (job.by_matrices(), &options.reuse) {
        return Err(Error::Job(format!(
            "--reuse {}: bodies given by matrices are reduced anew in each run; leave it out",
            path.display()
        )));
    }
    let begun = std::time::Instant::now();
    let date = crate::output::utc_now();
    if options.resume {
        if job.analyses.transient.is_none() {
            return Err(Error::Job("--resume: only a transient can be continued; the job has none".into()));
        }
        world.on_root(|| transient::refuse_other_job(&Segments::of(&options.output), job))?;
    }
    check(job)?;
    let stop = job.analyses.transient.as_ref().map(|_| Stop::listen(begun, options.wall_time));
    let file = ResultFile::create(world, &options.output, options.force)?;
    let mut run = Run { petsc, job, options, file, progress, summary: Summary::of(job) };

    let inputs = if job.by_matrices() {
        matrices::run(&mut run)?;
        world.on_root(|| matrices::checksums(job))?
    } else {
        elements(&mut run, stop.as_ref())?
    };

    let Run { mut file, progress, mut summary, .. } = run;
    progress.stage("writing results");
    progress.finish();
    let provenance = Provenance {
        job: serde_json::to_string_pretty(&job.to_json()).map_err(|e| Error::Defect(format!("resolved job: {e}")))?,
        command: options.command.clone(),
        versions: options.versions.clone(),
        ranks: world.size,
        inputs: inputs.unwrap_or_default(),
        stages: progress.times().to_vec(),
        date,
    };
    file.tables(provenance.tables());
    file.finish()?;
    summary.line(format!("results: {}", options.output.display()));
    Ok(summary)
}

/// Collective: the analyses of bodies of finite elements; returns name and checksum of every input on rank 0.
fn elements(run: &mut Run, stop: Option<&Stop>) -> Result<Option<Vec<(String, String)>>> {
    let (world, job, options) = (run.world(), run.job, run.options);
    let reused = match &options.reuse {
        Some(path) => {
            run.progress.stage("reading the reduced model of an earlier run");
            Some(world.on_root(|| reuse::read(path, job))?)
        }
        None => None,
    };
    // A run that is continued goes on with the model that it was begun with.
    let kept = match options.resume {
        true => Some(world.on_root(|| transient::kept::read(&Segments::of(&options.output), job))?),
        false => None,
    };
    let (mut bodies, mut model) = (Bodies::none(), None);
    let own = itself(run, stop, (reused, kept), &mut bodies, &mut model);
    match &job.sweep {
        Some(plan) if own.as_ref().err().is_none_or(sweep::goes_on) => {
            let base = model.as_ref().map(Base::Elements);
            sweep::run(run, plan, base, own.as_ref().err())?;
        }
        _ => own?,
    }
    world.on_root(|| {
        let mut sums = bodies.checksums(job)?;
        if let Some(path) = &options.reuse {
            sums.push((path.display().to_string(), sha256(path)?));
        }
        Ok(sums)
    })
}

/// Whether complex modes are to be written.
fn wants_shapes(job: &Job) -> bool {
    job.output.fields && job.analyses.stability.as_ref().is_some_and(|s| s.shapes > 0)
}

/// The model of an earlier run, where there is one; on rank 0.
type Earlier = Option<Option<Reused>>;

/// Collective: the analyses of the job itself, sweeps apart. The models of earlier runs are that of `--reuse` and that of a run that is continued. `bodies` and `model` are filled as soon as they are made.
fn itself(
    run: &mut Run,
    stop: Option<&Stop>,
    (reused, kept): (Earlier, Earlier),
    bodies: &mut Bodies,
    model: &mut Option<Reduction>,
) -> Result<()> {
    let (petsc, world, job, options) = (run.petsc, run.world(), run.job, run.options);
    // With modes and compliance at hand, meshes serve the fields alone, and factors those of steady rolling.
    if reused.is_none() || job.output.fields {
        *bodies = Bodies::build(world, job, run.progress, &mut run.summary)?;
    }
    let bodies = &*bodies;
    let mut shapes = match (&reused, &options.reuse) {
        (Some(reused), Some(path)) if wants_shapes(job) => {
            run.progress.stage("mode shapes of an earlier run");
            let none = Reduction::elsewhere();
            let model = reused.as_ref().map_or(&none, |r| &r.reduction);
            reuse::shapes::read(world, &reuse::shapes::file(path), bodies, model).map(Some)
        }
        _ => Ok(None),
    };
    let mut solvers = match reused {
        Some(_) if job.analyses.steady.is_none() && !matches!(shapes, Ok(Some(_))) => Vec::new(),
        _ => bodies.solvers(petsc, job, run.progress, &mut run.summary)?,
    };
    let mut found = match &reused {
        Some(reused) => {
            if let (Some(reused), Some(_)) = (reused, &job.analyses.modes) {
                modes::write_reused(run, &reused.modes);
            }
            Vec::new()
        }
        None => modes::run(run, bodies, &mut solvers)?,
    };
    if job.analyses.steady.is_none() && job.output.fields {
        bodies.write_shapes(&mut run.file)?;
    }
    let (false, Some(contact)) = (job.analyses.on_contact().is_empty(), &job.contact) else { return Ok(()) };
    let origin = match (&kept, &reused) {
        (Some(kept), _) => kept.as_ref().map(|k| k.origin.clone()),
        (None, Some(reused)) => reused.as_ref().map(|r| r.origin.clone()),
        (None, None) => Some(Origin::of(bodies, &found)),
    };
    let model = &*model.insert(match kept.or(reused) {
        Some(there) => there.map_or_else(Reduction::elsewhere, |r| r.reduction),
        None => Reduction::build(world, job, contact, bodies, &found, &mut solvers, run.progress)?,
    });
    if options.resume && !found.is_empty() {
        transient::kept::align(world, bodies, &mut found, model)?;
    }
    if let (true, Ok(Some(shapes))) = (options.resume, &mut shapes) {
        transient::kept::align(world, bodies, shapes, model)?;
    }
    let tables = |root: &ReducedModel| reuse::tables(job, &origin.clone().unwrap_or_default(), root);
    // A compliance that is only near the true one is of no use to another run.
    let whole = options.reuse.is_none() && !model.approximate;
    if whole && job.output.reduced && contact.compliance == Compliance::Fe {
        run.file.tables(world.on_root(|| tables(model.root()?))?.unwrap_or_default());
    }
    if let Some(wanted) = &job.analyses.receptance {
        receptance::run(run, wanted, contact, model)?;
    }
    let mut spectrum = None;
    if let Some(wanted) = &job.analyses.stability {
        let modes = match &shapes {
            Ok(Some(shapes)) => Ok(&shapes[..]),
            Ok(None) => Ok(&found[..]),
            Err(e) => Err(e),
        };
        let parts = stability::Parts { bodies, modes, model };
        spectrum = stability::run(run, wanted, contact, &parts, &mut solvers)?;
    }
    if let Some(wanted) = &job.analyses.steady {
        steady::run(run, wanted, contact, bodies, model, &mut solvers)?;
    }
    if let (Some(wanted), Some(stop)) = (&job.analyses.transient, stop) {
        let eigenpairs = spectrum.as_ref().map_or(&[][..], |s| &s.eigenpairs);
        let keep = match options.resume {
            true => None,
            false => world.on_root(|| tables(model.root()?))?,
        };
        let (modes, keep) = (&found, &keep.unwrap_or_default()[..]);
        let inputs = Inputs { job, wanted, contact, bodies, modes, model, eigenpairs, options, stop, keep };
        transient::run(run, &inputs, &mut solvers)?;
    }
    Ok(())
}
