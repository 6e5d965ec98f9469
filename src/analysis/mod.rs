//! From a job to results: the driver, then one file per analysis.

mod bodies;
mod modes;
pub mod plan;
mod report;
pub mod stability;
mod steady;

use crate::job::Job;
use crate::output::{Provenance, ResultFile};
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::{Error, Result};
use bodies::Bodies;
use std::path::PathBuf;

pub use report::Summary;

/// What the command line adds to the job.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// The result file.
    pub output: PathBuf,
    /// Whether existing results are overwritten.
    pub force: bool,
    /// The command line, for the provenance.
    pub command: Vec<String>,
    /// Name and version of the program and of its libraries, for the provenance.
    pub versions: Vec<(String, String)>,
}

/// Collective: runs the analyses of `job` and writes the result file. The summary is the same on every rank.
pub fn run(petsc: &Petsc, job: &Job, options: &RunOptions, progress: &mut Progress) -> Result<Summary> {
    let world = petsc.world();
    let date = crate::output::utc_now();
    let mut file = ResultFile::create(world, &options.output, options.force)?;
    let mut summary = Summary::default();

    let bodies = Bodies::build(world, job, progress, &mut summary)?;
    let mut solvers = bodies.solvers(petsc, job, progress, &mut summary)?;
    if let Some(wanted) = &job.analyses.modes {
        modes::run(petsc, job, wanted.extent(), &bodies, &mut solvers, options, &mut file, progress, &mut summary)?;
    }
    match (&job.analyses.steady, &job.contact) {
        (Some(steady), Some(contact)) => {
            steady::run(world, job, steady, contact, &bodies, &mut solvers, &mut file, progress, &mut summary)?;
        }
        (Some(_), None) => {
            return Err(Error::Job("analyses.steady needs `contact`, which the job does not have".into()))
        }
        (None, _) => {
            if job.output.fields {
                bodies.write_shapes(&mut file)?;
            }
        }
    }
    drop(solvers);

    progress.stage("writing results");
    progress.finish();
    let provenance = Provenance {
        job: serde_json::to_string_pretty(&job.to_json()).map_err(|e| Error::Defect(format!("resolved job: {e}")))?,
        command: options.command.clone(),
        versions: options.versions.clone(),
        ranks: world.size,
        inputs: world.on_root(|| bodies.checksums(job))?.unwrap_or_default(),
        stages: progress.times().to_vec(),
        date,
    };
    file.tables(provenance.tables());
    file.finish()?;
    summary.line(format!("results: {}", options.output.display()));
    Ok(summary)
}
