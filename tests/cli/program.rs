//! How the tests start the program, and the small jobs they start it on.

use serde_json::{json, Value};
use std::io::Write;
use std::ops::{Deref, DerefMut};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output};
use std::sync::{Condvar, LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tempfile::TempDir;

/// The program under test.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_railsqueal");

/// A finished run of the program.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Ran {
    fn new(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        Self { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }

    /// Ended well.
    #[track_caller]
    pub fn good(&self) -> &Self {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }

    /// Ended with this code, and one message that says all the parts.
    #[track_caller]
    pub fn failed(&self, code: i32, parts: &[&str]) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_eq!(self.err.matches("railsqueal: error:").count(), 1, "one message: {self:?}");
        for part in parts {
            assert!(self.err.contains(part), "no {part:?} in: {}", self.err);
        }
        assert!(!self.err.contains("panicked"), "{self:?}");
    }
}

/// `mpirun` with the environment it needs on a small machine, as root or not.
pub fn mpirun() -> Command {
    let mut command = Command::new("mpirun");
    command.env("OPENBLAS_NUM_THREADS", "1").env("OMPI_MCA_rmaps_base_oversubscribe", "1");
    // The same for the launcher of Open MPI 5.
    command.env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe");
    command.env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    // Several tests run at once: ranks that wait give the processor to those that work.
    command.env("OMPI_MCA_mpi_yield_when_idle", "1");
    // Seconds: ranks that wait for each other would wait for ever.
    command.env("MPIEXEC_TIMEOUT", "900");
    command
}

/// Runs any command of a single process to its end.
pub fn finish(command: &mut Command) -> Ran {
    finish_on(1, command)
}

/// Runs a command that starts so many ranks to its end.
pub fn finish_on(ranks: usize, command: &mut Command) -> Ran {
    let _share = PROCESSORS.take(ranks);
    ended(command)
}

fn ended(command: &mut Command) -> Ran {
    Ran::new(command.output().expect("the command starts"))
}

/// The Python of the tests on a script of theirs.
pub fn script(name: &str, arguments: &[&str]) -> Ran {
    let root = env!("CARGO_MANIFEST_DIR");
    let own = format!("{root}/.venv/bin/python");
    let python = if Path::new(&own).exists() { own } else { "python3".into() };
    let mut command = Command::new(python);
    finish(command.env("OPENBLAS_NUM_THREADS", "1").arg(format!("{root}/tests/python/{name}")).args(arguments))
}

/// Processors of the machine, which runs share: no more ranks run at once than there are processors. Ranks that share
/// them wait for the scheduler at each message, and take up to twenty times as long.
///
/// A run begins as soon as there are enough for it: while one waits for several, smaller ones go on. It has its turn at
/// the latest when no other test is left.
struct Processors {
    all: usize,
    free: Mutex<usize>,
    changed: Condvar,
}

static PROCESSORS: LazyLock<Processors> = LazyLock::new(|| {
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    Processors { all, free: Mutex::new(all), changed: Condvar::new() }
});

/// Processors that a run has; they are free again once it is gone.
struct Share(usize);

impl Processors {
    fn free(&self) -> MutexGuard<'_, usize> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for so many processors, or for all where there are fewer.
    fn take(&self, count: usize) -> Share {
        let count = count.min(self.all);
        let mut free = self.free();
        while *free < count {
            free = self.changed.wait(free).unwrap_or_else(PoisonError::into_inner);
        }
        *free -= count;
        Share(count)
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        *PROCESSORS.free() += self.0;
        PROCESSORS.changed.notify_all();
    }
}

/// A process in the background with its processors, which others have once it was waited for.
pub struct Running {
    child: Child,
    share: Option<Share>,
}

impl Running {
    /// Starts a command of so many ranks.
    pub fn start(ranks: usize, command: &mut Command) -> Self {
        let share = Some(PROCESSORS.take(ranks));
        Self { child: command.spawn().expect("start"), share }
    }

    /// Waits for its end.
    pub fn wait(&mut self) -> std::io::Result<ExitStatus> {
        let status = self.child.wait();
        self.share = None;
        status
    }

    /// Runs the program beside it, on the same processor: it is to end at once.
    pub fn beside(&self, args: &[&str]) -> Ran {
        launched(1, args)
    }
}

/// A test that fails leaves nothing running.
impl Drop for Running {
    fn drop(&mut self) {
        if self.share.is_some() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

impl Deref for Running {
    type Target = Child;

    fn deref(&self) -> &Child {
        &self.child
    }
}

impl DerefMut for Running {
    fn deref_mut(&mut self) -> &mut Child {
        &mut self.child
    }
}

/// The program on so many ranks; without a launcher on one.
pub fn railsqueal(ranks: usize, args: &[&str]) -> Ran {
    let _share = PROCESSORS.take(ranks);
    start(ranks, args)
}

/// The same with no other run beside it.
fn undisturbed(ranks: usize, args: &[&str]) -> Ran {
    let _share = PROCESSORS.take(PROCESSORS.all);
    start(ranks, args)
}

fn start(ranks: usize, args: &[&str]) -> Ran {
    let begun = Instant::now();
    let ran = launched(ranks, args);
    note_time(ranks, begun, args);
    ran
}

/// Adds a line on a run to the file that the environment variable `RAILSQUEAL_TEST_TIMES` names: processors times
/// seconds, the test, and the arguments.
fn note_time(ranks: usize, begun: Instant, args: &[&str]) {
    let Some(path) = std::env::var_os("RAILSQUEAL_TEST_TIMES") else { return };
    let seconds = begun.elapsed().as_secs_f64() * ranks.min(PROCESSORS.all) as f64;
    let test = std::thread::current().name().unwrap_or("").to_owned();
    let line = format!("{seconds:.2} {test} {ranks} {}\n", args.join(" "));
    let file = std::fs::OpenOptions::new().append(true).create(true).open(path);
    file.and_then(|mut f| f.write_all(line.as_bytes())).expect("the file of times");
}

fn launched(ranks: usize, args: &[&str]) -> Ran {
    match ranks {
        1 => ended(Command::new(PROGRAM).env("OPENBLAS_NUM_THREADS", "1").args(args)),
        // mpirun gives processes that are left when one has failed a second, twice, and sits these out where none is
        // left. Ranks of the program tell what they have to tell before any of them ends. PRRTE, the launcher of Open
        // MPI 5, has no such parameter.
        _ => ended(
            mpirun()
                .env("OMPI_MCA_odls_base_sigkill_timeout", "0")
                .args(["-n", &ranks.to_string(), PROGRAM])
                .args(args),
        ),
    }
}

/// A folder with a job file, and nothing else until the program writes.
pub struct Folder {
    dir: TempDir,
}

impl Folder {
    /// A folder whose `job.json` has this text.
    pub fn with(text: impl AsRef<[u8]>) -> Self {
        let dir = tempfile::tempdir().expect("temporary folder");
        std::fs::write(dir.path().join("job.json"), text).expect("write the job");
        Self { dir }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }

    /// Runs `railsqueal COMMAND job.json ARGS`.
    pub fn call(&self, ranks: usize, command: &str, args: &[&str]) -> Ran {
        let job = self.text("job.json");
        railsqueal(ranks, &[&[command, job.as_str()], args].concat())
    }

    /// The job is refused like this by `check` and, by the same code and before anything is factorised, by `run`;
    /// nothing is left behind.
    #[track_caller]
    pub fn refused(&self, ranks: usize, args: &[&str], code: i32, parts: &[&str]) {
        let (before, output) = (self.listing(), self.text("refused.h5"));
        for (command, more) in [("check", &[][..]), ("run", &["--output", output.as_str()][..])] {
            let ran = self.call(ranks, command, &[args, more].concat());
            ran.failed(code, parts);
            assert!(!ran.err.contains("] factorisation") && !ran.err.contains("] modes,"), "{command}: {}", ran.err);
            assert_eq!(self.listing(), before, "{command}");
        }
    }

    /// [`call`](Self::call) with no other run beside it.
    pub fn call_alone(&self, ranks: usize, command: &str, args: &[&str]) -> Ran {
        let job = self.text("job.json");
        undisturbed(ranks, &[&[command, job.as_str()], args].concat())
    }

    /// Files in the folder, sorted.
    pub fn listing(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.dir.path()).expect("list the folder");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Nothing but the job is there.
    #[track_caller]
    pub fn untouched(&self) {
        assert_eq!(self.listing(), ["job.json"]);
    }
}

/// A job file of the project.
pub fn job(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs").join(name);
    serde_json::from_slice(&std::fs::read(path).expect("the job file")).expect("a job")
}

/// The two cylinders with meshes so coarse that a run takes a second: for behaviour, not for mechanics.
pub fn small() -> Value {
    let mut job = job("two-cylinders.json");
    for body in ["lower", "upper"] {
        let cylinder = &mut job["bodies"][body]["mesh"]["cylinder"];
        cylinder["element_size"] = json!(0.004);
        cylinder["growth"] = json!(2.0);
        cylinder["max_element_size"] = json!(0.05);
    }
    job["contact"]["patch"] = json!({ "half_length": 0.012, "half_width": 0.012 });
    job["analyses"] = json!({ "modes": { "count": 5 }, "steady": {} });
    job
}
