//! Result files of earlier runs are read by a process of their own first: libhdf5 can crash, or never come back, on metadata that is damaged.

use super::args::{default_output, Command as Given};
use railsqueal::output::{companion, survey, MODEL, SHAPES};
use railsqueal::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Reading a file takes no longer than this and its size at a slow disk's speed.
const LEAST: Duration = Duration::from_secs(30);
/// Byte per second.
const SLOW: f64 = 20e6;

/// Exit code of a child that was refused memory, by libhdf5 or by the allocator.
const STARVED: i32 = 7;

/// What the child does: reads, and takes no notice of errors that the run will meet itself. Its exit code.
pub fn child(file: &Path, head: bool) -> i32 {
    match survey(file, head) {
        Err(Error::Memory(_)) => STARVED,
        _ => 0,
    }
}

/// On the process that speaks, before MPI starts: an error if a file that the command takes up, or would replace, cannot be read without harm.
pub fn files(command: &Given) -> Result<()> {
    let Given::Run { job, output, force, reuse, resume, .. } = command else { return Ok(()) };
    let mut all: Vec<(PathBuf, bool)> = Vec::new();
    if let Some(file) = reuse {
        all.extend([(file.clone(), false), (companion(file, "free_modes.vtkhdf"), false)]);
        all.push((companion(file, "shapes.h5"), false));
    }
    if let Some(target) = resume {
        all.push((companion(target, SHAPES), false));
    }
    let Some(target) = resume.clone().or(output.clone()).or(job.as_deref().map(default_output)) else {
        return Ok(());
    };
    // What a run that failed has left is looked at by the next one in any case.
    let (targets, left) = (railsqueal::output::outputs(&target).0, companion(&target, MODEL));
    all.extend(targets.into_iter().filter(|t| *force || resume.is_some() || *t == left).map(|t| (t, true)));
    all.into_iter().filter(|(file, _)| file.is_file()).try_for_each(|(file, head)| survives(&file, head))
}

/// `Error::Input` if a process that reads the file dies of it or does not come to its end.
fn survives(file: &Path, head: bool) -> Result<()> {
    let damaged = |how: String| {
        Err(Error::Input(format!(
            "{}: damaged: {how} while reading it; bring it back from a copy, make it again, or remove it",
            file.display()
        )))
    };
    let Ok(program) = std::env::current_exe() else { return Ok(()) };
    let mut command = Command::new(program);
    command.arg("probe").args(head.then_some("--head")).arg("--").arg(file);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // Where no process can be started the file is read as it is.
    let Ok(mut process) = command.spawn() else { return Ok(()) };
    let size = std::fs::metadata(file).map_or(0.0, |m| m.len() as f64);
    let (begun, limit) = (Instant::now(), LEAST + Duration::from_secs_f64(size / SLOW));
    loop {
        match process.try_wait() {
            Ok(Some(status)) if status.success() => return Ok(()),
            Ok(Some(status)) if status.code() == Some(STARVED) => {
                return damaged("libhdf5 asks for more memory than ten times the file and 64 MB".into());
            }
            Ok(Some(status)) => return damaged(format!("libhdf5 crashed ({status})")),
            Ok(None) if begun.elapsed() < limit => std::thread::sleep(Duration::from_millis(2)),
            _ => {
                let _ = process.kill();
                let _ = process.wait();
                return damaged(format!("libhdf5 did not come back within {:.0} s", limit.as_secs_f64()));
            }
        }
    }
}
