//! Arguments.

use clap::{Args, Parser, Subcommand};
use std::path::{Path, PathBuf};

/// Exit codes, shown by `--help`.
const AFTER: &str = "\
Run it under an MPI launcher for more than one rank: mpirun -n 4 railsqueal run job.json

Exit codes:
  0  done
  1  a defect of the program
  2  wrong usage or job file
  3  a mesh or another input file is missing or wrong
  4  a solver did not converge
  5  stopped on request or by the time limit; what was computed is kept
  6  reading or writing failed
  7  not enough memory";

/// Rolling contact with friction between finite-element bodies.
#[derive(Debug, Parser)]
#[command(name = "railsqueal", disable_version_flag = true, after_help = AFTER, arg_required_else_help = false)]
pub struct Cli {
    /// Print the versions of railsqueal and of the libraries it uses
    #[arg(short = 'V', long)]
    pub version: bool,
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run the analyses of a job and write the results
    Run {
        /// Job file (JSON); with --resume it may be left out: the run has its job
        #[arg(value_name = "JOB", required_unless_present = "resume")]
        job: Option<PathBuf>,
        #[command(flatten)]
        changes: Changes,
        /// Result file [default: beside the job file, with the ending .h5]
        #[arg(short, long, value_name = "FILE.h5")]
        output: Option<PathBuf>,
        /// Replace an existing result file
        #[arg(short, long)]
        force: bool,
        /// Take modes and compliance from the result file of an earlier run with the same bodies
        #[arg(long, value_name = "FILE.h5")]
        reuse: Option<PathBuf>,
        /// Continue a transient that was stopped, with this result file
        #[arg(long, value_name = "FILE.h5", conflicts_with_all = ["output", "force"])]
        resume: Option<PathBuf>,
        /// Wall time, s, within which a transient stops by itself, its state saved
        #[arg(long, value_name = "SECONDS")]
        wall_time: Option<f64>,
        /// PETSc options, after `--`
        #[arg(last = true, value_name = "PETSC OPTIONS")]
        petsc: Vec<String>,
    },
    /// Validate a job and say what it would compute, how large it is and how much memory it needs
    Check {
        /// Job file (JSON)
        #[arg(value_name = "JOB")]
        job: PathBuf,
        #[command(flatten)]
        changes: Changes,
    },
    /// Print the JSON Schema of the job file
    Schema,
    /// Read a result file and say nothing: whether that can be done without harm
    #[command(hide = true)]
    Probe {
        /// The file
        file: PathBuf,
        /// What it is, and no more
        #[arg(long)]
        head: bool,
    },
}

/// What the command line changes in the job.
#[derive(Debug, Args)]
pub struct Changes {
    /// Override a key of the job: dotted path and JSON value (or text), e.g. contact.friction=0.4; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub sets: Vec<String>,
    /// Run only this analysis of the job, and what it needs
    #[arg(long, value_name = "ANALYSIS")]
    pub only: Option<String>,
}

/// The result file of a job when none is named: beside it, with the ending `.h5`.
pub fn default_output(job: &Path) -> PathBuf {
    job.with_extension("h5")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn the_result_lies_beside_the_job() {
        assert_eq!(default_output(Path::new("a/b.json")), Path::new("a/b.h5"));
        assert_eq!(default_output(Path::new("b")), Path::new("b.h5"));
    }

    #[test]
    fn values_may_begin_with_a_minus() {
        let line = ["railsqueal", "run", "j.json", "--set", "contact.creepage.lateral=-0.01", "--", "-log_view"];
        let Some(Command::Run { changes, petsc, .. }) = Cli::parse_from(line).command else { panic!("no run") };
        assert_eq!(changes.sets, ["contact.creepage.lateral=-0.01"]);
        assert_eq!(petsc, ["-log_view"]);
    }
}
