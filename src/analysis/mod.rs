//! From a job to results: the driver, then one file per analysis.

mod bodies;
mod complex_modes;
mod deferred;
mod full_stability;
mod interface;
mod matrices;
mod memory;
mod modes;
pub mod plan;
mod receptance;
pub mod reduction;
mod report;
mod reuse;
mod run;
mod stability;
mod steady;
mod steps;
mod stock;
mod sweep;
mod transient;

use crate::job::Job;
use crate::output::{Provenance, ResultFile, Segments};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::{Error, Result};
use std::path::PathBuf;
use steps::{steps, Earlier};
use stock::Stock;
use sweep::Base;
use transient::Stop;

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
    let mut run = Run { petsc, job, options, stop: stop.as_ref(), file, progress, summary: Summary::of(job) };

    let inputs = if job.by_matrices() {
        matrices::run(&mut run)?;
        world.on_root(|| matrices::checksums(job))?
    } else {
        elements(&mut run)?
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

/// Collective: the steps of the job and the points of its sweep; returns name and checksum of every input on rank 0.
fn elements(run: &mut Run) -> Result<Option<Vec<(String, String)>>> {
    let earlier = Earlier { reuse: run.options.reuse.is_some(), resume: run.options.resume };
    let mut stock = Stock::new();
    let own = steps(run.job, earlier).into_iter().try_for_each(|step| stock.perform(step, run));
    match &run.job.sweep {
        Some(plan) if own.as_ref().err().is_none_or(sweep::goes_on) => {
            let base = stock.model.as_ref().map(Base::Elements);
            sweep::run(run, plan, base, own.as_ref().err())?;
        }
        _ => own?,
    }
    run.world().on_root(|| stock.checksums(run))
}
