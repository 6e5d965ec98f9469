//! Result files of earlier runs are read by a process of their own first: libhdf5 can crash, or never come back, on
//! metadata that is damaged. Whether it comes back is told by the processor time that it takes, which neither other
//! programs nor a slow file system lengthen.

use super::args::{default_output, Command as Given};
use railsqueal::output::{companion, survey, MODEL, SHAPES};
use railsqueal::{Error, Result};
use rustix::process::{getrlimit, setrlimit, Resource, Rlimit};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Reading a file takes no more processor time, s, than this and its size at [`SLOW`].
const LEAST: u64 = 30;
/// Byte per second of processor time.
const SLOW: u64 = 20_000_000;
/// Wall time that is waited for, over the processor time.
const PATIENCE: u32 = 20;
/// Signal of a process that has used up its processor time.
const SIGXCPU: i32 = signal_hook::consts::SIGXCPU;

/// Exit code of a child that was refused memory, by libhdf5 or by the allocator.
const STARVED: i32 = 7;

/// Processor time that reading a file may take, s.
fn seconds(file: &Path) -> u64 {
    LEAST + std::fs::metadata(file).map_or(0, |m| m.len() / SLOW)
}

/// Ends this process by SIGXCPU once it has used so many seconds of processor time from its start on; a lower limit
/// that there is already stays. It leaves no core file.
fn limit_processor(seconds: u64) {
    let Rlimit { current, maximum } = getrlimit(Resource::Cpu);
    let least = [current, maximum].into_iter().flatten().fold(seconds, u64::min);
    let _ = setrlimit(Resource::Cpu, Rlimit { current: Some(least), maximum });
    let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: getrlimit(Resource::Core).maximum });
}

/// Work of the child: reads, and takes no notice of errors that the run will meet itself. Its exit code.
pub fn child(file: &Path, head: bool) -> i32 {
    limit_processor(seconds(file));
    match survey(file, head) {
        Err(Error::Memory(_)) => STARVED,
        _ => 0,
    }
}

/// On the process that speaks, before MPI starts: an error if a file that the command takes up, or would replace,
/// cannot be read without harm.
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

/// Ends of a process that reads a file.
#[derive(Debug, PartialEq)]
enum End {
    /// With this status.
    Status(ExitStatus),
    /// It had to be ended after this time.
    Waited(Duration),
}

/// How the `command` ends, for which no more than `patience` is waited; none where no process can be started.
fn end_of(mut command: Command, patience: Duration) -> Option<End> {
    let mut process = command.spawn().ok()?;
    let begun = Instant::now();
    loop {
        match process.try_wait() {
            Ok(Some(status)) => return Some(End::Status(status)),
            Ok(None) if begun.elapsed() < patience => std::thread::sleep(Duration::from_millis(2)),
            _ => {
                let _ = process.kill();
                let _ = process.wait();
                return Some(End::Waited(begun.elapsed()));
            }
        }
    }
}

/// `Error::Input` if a process that reads the file dies of it or uses up its processor time; `Error::Io` if it does not
/// come to its end although it has time left.
fn survives(file: &Path, head: bool) -> Result<()> {
    let Ok(program) = std::env::current_exe() else { return Ok(()) };
    let mut command = Command::new(program);
    command.arg("probe").args(head.then_some("--head")).arg("--").arg(file);
    // A thread of OpenBLAS that starts late, as on a busy machine, asks for its buffer for ever once the reader has
    // confined its memory.
    command.env("OPENBLAS_NUM_THREADS", "1");
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let seconds = seconds(file);
    // Where no process can be started the file is read as it is.
    match end_of(command, PATIENCE * Duration::from_secs(seconds)) {
        Some(end) => judged(file, seconds, &end),
        None => Ok(()),
    }
}

/// The end of a process that reads `file`, as an error where it is not the right one. It had so many `seconds` of
/// processor time.
fn judged(file: &Path, seconds: u64, end: &End) -> Result<()> {
    let name = file.display();
    let damaged = |how: String| {
        Err(Error::Input(format!(
            "{name}: damaged: {how} while reading it; bring it back from a copy, make it again, or remove it"
        )))
    };
    match end {
        End::Status(status) if status.success() => Ok(()),
        End::Status(status) if status.code() == Some(STARVED) => {
            damaged("libhdf5 asks for more memory than ten times the file and 64 MB".into())
        }
        End::Status(status) if status.signal() == Some(SIGXCPU) => match getrlimit(Resource::Cpu).current {
            Some(own) if own < seconds => Err(Error::Io(format!(
                "{name}: reading it takes more than the processor time that this process may use (ulimit -t), {own} s; \
                 raise the limit"
            ))),
            _ => damaged(format!("libhdf5 did not come back within {seconds} s of processor time")),
        },
        End::Status(status) => damaged(format!("libhdf5 crashed ({status})")),
        End::Waited(time) => Err(Error::Io(format!(
            "{name}: reading it has not come to its end after {:.0} s, with less than {seconds} s of processor time: \
             the file system does not answer, or the machine is too busy; copy the file to another disk, or try \
             again later",
            time.as_secs_f64()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(text: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", text]).stderr(Stdio::null());
        command
    }

    /// A process that works for ever is told from one that waits for ever: by its processor time.
    #[test]
    fn waiting_is_no_damage_and_working_for_ever_is() {
        let patience = Duration::from_secs(600);
        let judged = |end: Option<End>| judged(Path::new("a.h5"), 30, &end.expect("a shell"));
        assert!(judged(end_of(shell("exit 0"), patience)).is_ok());
        // The limit of the shell stands for that of the reader, whose hard limit stays where it was.
        let error = judged(end_of(shell("ulimit -S -t 1; while :; do :; done"), patience)).expect_err("it works");
        assert_eq!(error.exit_code(), 3);
        assert!(error.message().contains("within 30 s of processor time"), "{error}");
        let error = judged(end_of(shell("exec sleep 1000"), Duration::from_millis(50))).expect_err("it waits");
        assert_eq!(error.exit_code(), 6);
        assert!(error.message().contains("file system does not answer") && !error.message().contains("damaged"));
        let error = judged(end_of(shell("kill -SEGV $$"), patience)).expect_err("it crashes");
        assert!(error.exit_code() == 3 && error.message().contains("crashed (signal: 11"), "{error}");
        let error = judged(end_of(shell("exit 7"), patience)).expect_err("it starves");
        assert!(error.exit_code() == 3 && error.message().contains("more memory"), "{error}");
    }
}
