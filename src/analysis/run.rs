//! Context that all analyses of a run share.

use super::RunOptions;
use crate::case::meshes::Meshes;
use crate::job::Job;
use crate::output::{ResultFile, Segments};
use crate::parallel::World;
use crate::petsc::session::Petsc;
use crate::progress::Progress;
use crate::stop::Stop;
use crate::summary::Summary;
use crate::{Error, Result};
use std::cell::OnceCell;

/// A run of a job: its input, the libraries it may call, and where results and reports go.
pub struct Run<'r> {
    /// PETSc and the ranks.
    pub petsc: &'r Petsc<'r>,
    /// The resolved job.
    pub job: &'r Job,
    /// The job as it was given: without what its placement fills in. What is written and what a run is known by is
    /// this one.
    pub given: &'r Job,
    /// Place of the job once its axle is balanced.
    pub balanced: &'r OnceCell<Job>,
    /// Options of the command line.
    pub options: &'r RunOptions,
    /// Data read of mesh files to plan the run, on rank 0.
    pub meshes: &'r Meshes,
    /// When to stop.
    pub stop: &'r Stop,
    /// On rank 0: the segments of a transient.
    pub segments: Option<Segments>,
    /// The result file.
    pub file: ResultFile<'r>,
    /// Stages, steps and remarks, on stderr.
    pub progress: &'r mut Progress,
    /// Summary that the run prints at its end, on stdout.
    pub summary: Summary,
}

impl<'r> Run<'r> {
    /// The ranks.
    pub fn world(&self) -> &'r World {
        self.petsc.world()
    }

    /// On rank 0: the segments of the transient.
    pub fn segments(&self) -> Result<&Segments> {
        self.segments.as_ref().ok_or_else(|| Error::Defect("a transient without segments".into()))
    }

    /// Adds warnings to the summary, and says them at once.
    pub fn warn(&mut self, warnings: impl IntoIterator<Item = String>) {
        for text in warnings {
            self.progress.note(format!("warning: {text}"));
            self.summary.warn(text);
        }
    }

    /// Goes on with `job`, in which the angular speed of the axle is that of its torque.
    pub fn go_on_with(&mut self, job: Job) {
        self.job = self.balanced.get_or_init(|| job);
    }

    /// Returns whether files beside the result file are replaced where they exist: with `--force`, and by a run that is
    /// continued.
    pub fn replaces(&self) -> bool {
        self.options.force || self.options.resume
    }
}
