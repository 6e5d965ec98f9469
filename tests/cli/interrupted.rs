//! Transients that are stopped, killed, or run out of disk, as real processes, and continued.

use super::program::*;
use super::transient::{open, read, sliding};
use railsqueal::output::Reader;
use serde_json::json;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

/// A run with a model at hand, so that it is in its steps at once.
pub fn prepared() -> (Folder, String) {
    let transient = json!({
        "duration": 0.3,
        "start": { "mode": 1, "amplitude": 3e-6, "random": { "seed": 5, "energy": 1e-4 } },
        "contact_stride": 500,
        "segment": 700
    });
    static MODEL: OnceLock<Vec<u8>> = OnceLock::new();
    let folder = Folder::with(sliding(transient).to_string());
    let model = folder.text("model.h5");
    let bytes = MODEL.get_or_init(|| {
        folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
        std::fs::read(&model).expect("the model")
    });
    std::fs::write(&model, bytes).expect("the model");
    (folder, model)
}

/// All datasets of the transients are the same to the last bit.
#[track_caller]
pub fn same(a: &hdf5::File, b: &hdf5::File) {
    let names = a.group("transient").expect("group").member_names().expect("names");
    assert!(names.len() > 20, "{names:?}");
    for name in names.iter().filter(|n| !["grid", "points"].contains(&n.as_str())) {
        let path = format!("transient/{name}");
        let (x, y) = (a.dataset(&path).expect("dataset"), b.dataset(&path).expect("dataset"));
        assert_eq!(x.shape(), y.shape(), "{path}");
        if ["closed", "stick", "iterations", "products", "contact_state"].contains(&name.as_str()) {
            assert_eq!(x.read_raw::<i32>().expect("read"), y.read_raw::<i32>().expect("read"), "{path}");
        } else {
            let bits =
                |d: &hdf5::Dataset| d.read_raw::<f64>().expect("read").iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert!(bits(&x) == bits(&y), "{path} differs");
        }
    }
}

/// Files of a folder of segments that are complete.
pub fn segments(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).map(|d| d.flatten().map(|e| e.path()).collect::<Vec<_>>());
    let mut files = entries.unwrap_or_default();
    files.retain(|p| p.extension().is_some_and(|e| e == "h5"));
    files.sort();
    files
}

/// Starts the program in the background.
pub fn start(command: Command, args: &[&str]) -> Running {
    start_on(1, command, args)
}

/// Starts it by a launcher of so many ranks.
pub fn start_on(ranks: usize, mut command: Command, args: &[&str]) -> Running {
    command.args(args).env("OPENBLAS_NUM_THREADS", "1");
    Running::start(ranks, command.stderr(Stdio::piped()).stdout(Stdio::null()))
}

/// Waits until `there` says yes; the run must still be going then. It looks every millisecond. A run that hangs is
/// given up after ten minutes, more than any of them takes on a slow machine.
#[track_caller]
pub fn wait_until(what: &str, child: &mut Child, there: impl Fn() -> bool) {
    const LOOKS: usize = 600_000;
    for _ in 0..LOOKS {
        if there() {
            return;
        }
        if let Some(status) = child.try_wait().expect("wait") {
            let mut said = String::new();
            let _ = child.stderr.take().map(|mut pipe| pipe.read_to_string(&mut said));
            panic!("it was over ({status}) before there was {what}: {said}");
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let _ = child.kill();
    panic!("it hangs before there is {what}");
}

/// Waits until there are `count` segments; the run must still be going then.
#[track_caller]
pub fn wait_for(folder: &Path, count: usize, child: &mut Child) {
    wait_until(&format!("segment number {count}"), child, || segments(folder).len() >= count);
}

/// Files of a folder that are still being written, or were when the run was killed.
fn unfinished(folder: &Path) -> usize {
    let names = std::fs::read_dir(folder).map(|d| d.flatten().map(|e| e.file_name()).collect::<Vec<_>>());
    names.unwrap_or_default().iter().filter(|name| name.to_string_lossy().ends_with(".partial")).count()
}

#[track_caller]
pub fn signal(name: &str, process: u32) {
    use rustix::process::{kill_process, Pid, Signal};
    let which = match name {
        "INT" => Signal::INT,
        "KILL" => Signal::KILL,
        "STOP" => Signal::STOP,
        "TERM" => Signal::TERM,
        "USR1" => Signal::USR1,
        other => panic!("{other} is no signal of these tests"),
    };
    let sent = Pid::from_raw(process as i32).map(|process| kill_process(process, which));
    assert!(matches!(sent, Some(Ok(()))), "process {process} was over before {name}: {sent:?}");
}

/// The process of a rank that `mpirun` started.
pub fn rank_of(launcher: u32, rank: usize) -> u32 {
    let children = |e: std::fs::DirEntry| {
        let id: u32 = e.file_name().to_string_lossy().parse().ok()?;
        let stat = std::fs::read_to_string(e.path().join("stat")).ok()?;
        // PID (NAME) STATE PARENT …
        let parent: u32 = stat.rsplit_once(") ")?.1.split(' ').nth(1)?.parse().ok()?;
        let environment = std::fs::read(e.path().join("environ")).ok()?;
        let wanted = format!("OMPI_COMM_WORLD_RANK={rank}");
        (parent == launcher && environment.split(|&b| b == 0).any(|v| v == wanted.as_bytes())).then_some(id)
    };
    let found = std::fs::read_dir("/proc").expect("processes").flatten().find_map(children);
    found.unwrap_or_else(|| panic!("no process of rank {rank} under {launcher}"))
}

#[test]
fn runs_that_are_stopped_or_killed_continue_to_the_same_bits() {
    let (folder, model) = prepared();
    let whole = folder.text("whole.h5");
    folder.call(1, "run", &["--reuse", &model, "--output", &whole]).good();
    let output = folder.text("run.h5");
    let job = folder.text("job.json");
    let place = folder.path("run.transient");
    let mut ends = Vec::new();
    // Signals 15 and 10 stop it, 9 kills it, each a few segments on.
    for (round, name) in ["TERM", "KILL", "USR1", "KILL", "KILL"].into_iter().enumerate() {
        let target = if round > 0 { "--resume" } else { "--output" };
        let mut child = start(Command::new(PROGRAM), &["run", &job, "--reuse", &model, target, &output]);
        wait_for(&place, 3 + 4 * round, &mut child);
        signal(name, child.id());
        let status = child.wait().expect("wait");
        if name != "KILL" {
            assert_eq!(status.code(), Some(5), "round {round}: {status:?}");
        }
        ends.push(segments(&place).len());
        assert!(!folder.path("run.h5").exists());
        // Every segment can be read.
        for path in segments(&place) {
            let step: i64 = open(&path).dataset("checkpoint/step").and_then(|d| d.read_scalar()).expect("step");
            assert!(step % 700 == 0, "{step}");
        }
    }
    assert!(ends.windows(2).all(|w| w[0] < w[1]), "segments {ends:?}");
    folder.call(1, "run", &["--reuse", &model, "--resume", &output]).good();
    same(&open(&whole), &open(&output));
    assert!(!place.exists());
    folder.call(1, "run", &["--reuse", &model, "--resume", &output]).failed(2, &["nothing to continue"]);
}

/// Largest displacement of a contact node over the period of the modal motion z e^{iωt}, m, from the model in a file.
fn largest(model: &hdf5::File, z: &[num_complex::Complex64]) -> f64 {
    let [lower, upper] = ["lower", "upper"].map(|b| read::<f64>(model, &format!("reduced/{b}/contact_modes")));
    let widths = ["lower", "upper"].map(|b| read::<f64>(model, &format!("reduced/{b}/omega")).len());
    let squares: Vec<f64> = (0..lower.len() / widths[0])
        .map(|row| {
            let of = |modes: &[f64], m: usize, z: &[num_complex::Complex64]| {
                modes[m * row..m * (row + 1)].iter().zip(z).map(|(p, z)| z * p).sum::<num_complex::Complex64>()
            };
            // The tangential motion of one body against the other is a difference, the normal one a sum.
            let sign = if row % 3 == 2 { 1.0 } else { -1.0 };
            (of(&lower, widths[0], z) + sign * of(&upper, widths[1], &z[widths[0]..])).norm_sqr()
        })
        .collect();
    squares.chunks_exact(3).map(|c| c.iter().sum::<f64>().sqrt()).fold(0.0, f64::max)
}

/// The start of a run along a mode: as large as asked for, with the reactions that hold there; and a run that is
/// continued counts its own steps.
#[test]
fn a_start_is_as_large_as_asked_for_with_reactions_that_hold_there() {
    let (folder, model) = prepared();
    let call = |sets: &[&str], target: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        folder.call(1, "run", &[&sets[..], &["--reuse", &model], target].concat())
    };
    let states = |name: &str, start: &str| -> Vec<Vec<Vec<f64>>> {
        let output = folder.text(&format!("{name}.h5"));
        let sets = [&format!("analyses.transient.start={start}"), "analyses.transient.segment=1"];
        call(&sets, &["--output", &output, "--wall-time", "0.001"]).failed(5, &["--resume"]);
        let files = segments(&folder.path(&format!("{name}.transient")));
        let state = |path| ["q", "v", "reaction"].map(|n| read(&open(path), &format!("checkpoint/{n}"))).to_vec();
        files[..2].iter().map(state).collect()
    };
    let rest = states("rest", "{}");
    let moved = states("moved", "{\"mode\": 1, \"amplitude\": 3e-6}");
    let file = open(&model);
    let value = read::<num_complex::Complex64>(&file, "stability/eigenvalue")[0];
    let z: Vec<num_complex::Complex64> = (0..rest[0][0].len())
        .map(|k| {
            let (q, v) = (moved[0][0][k] - rest[0][0][k], moved[0][1][k]);
            // v = Re(λ z) for q = Re z.
            num_complex::Complex64::new(q, (value.re * q - v) / value.im)
        })
        .collect();
    let found = largest(&file, &z);
    assert!((found / 3e-6 - 1.0).abs() < 1e-6, "the largest displacement is {found:e} m");
    // In a step of a hundredth of the period the reactions change by a part of what the motion makes of them.
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let change = apart(&moved[0][2], &rest[0][2]);
    let step = apart(&moved[1][2], &moved[0][2]);
    assert!(change > 1.0, "the reactions of the start are those of rest: {change:e} N");
    assert!(step < 0.2 * change, "the reactions jump by {step:e} N in the first step, of {change:e} N");

    let sets = ["analyses.transient.duration=0.02"];
    let output = folder.text("run.h5");
    call(&sets, &["--output", &output, "--wall-time", "0.001"]).failed(5, &["after 700 of 2000 steps"]);
    let ran = call(&sets, &["--resume", &output]);
    let line = ran.good().out.lines().find(|l| l.contains("work per step") && l.contains("iterations"));
    let line = line.unwrap_or_else(|| panic!("no effort: {}", ran.out));
    let words: Vec<&str> = line.split_whitespace().collect();
    let at = words.iter().position(|w| w.starts_with("iterations")).expect("iterations");
    let told: f64 = words[at - 1].parse().expect("a number");
    let done: Vec<i32> = read(&open(&output), "transient/iterations");
    let mean = done[700..].iter().sum::<i32>() as f64 / 1300.0;
    assert!((told - mean).abs() <= 0.005 + 1e-9, "{told} iterations in a step instead of {mean}");
}

/// Segments so short that the kill often comes while one is written; every other round waits for that.
#[test]
fn killed_at_any_moment_a_run_loses_only_what_came_after_the_last_segment() {
    let (folder, model) = prepared();
    let job = folder.text("job.json");
    let sets =
        ["--reuse", &model, "--set", "analyses.transient.segment=10", "--set", "analyses.transient.duration=0.03"];
    let whole = folder.text("whole.h5");
    folder.call(1, "run", &[&sets[..], &["--output", &whole]].concat()).good();
    let output = folder.text("run.h5");
    let place = folder.path("run.transient");
    let mut before = 0;
    let mut partial = 0;
    for round in 0..12 {
        let target = if round > 0 { "--resume" } else { "--output" };
        let mut child = start(Command::new(PROGRAM), &[&["run", &job], &sets[..], &[target, &output]].concat());
        wait_for(&place, before + 1 + round / 2 % 3, &mut child);
        if round % 2 == 1 {
            wait_until("a segment that is being written", &mut child, || unfinished(&place) > 0);
        }
        signal("KILL", child.id());
        child.wait().expect("wait");
        let now = segments(&place).len();
        assert!(now > before, "round {round}: {before} segments before, {now} after");
        partial += unfinished(&place).min(1);
        before = now;
    }
    assert!(before < 300, "all kills must come before the end");
    eprintln!("{partial} of 12 kills while a segment was written");
    folder.call(1, "run", &[&sets[..], &["--resume", &output]].concat()).good();
    same(&open(&whole), &open(&output));
    assert_eq!(folder.listing(), ["job.json", "model.h5", "run.h5", "whole.h5"]);
}

/// Without `--reuse` the finite elements are computed again, on two ranks in another order of rounding, modes with
/// other signs: the model that is kept makes the continued run the same. Its start is that of the unbroken run
/// itself, copied from it as it goes.
#[test]
#[ignore = "long: scripts/validate long"]
fn on_two_ranks_without_reuse_signals_and_kills_leave_what_continues_to_the_same_bits() {
    let transient = json!({
        "duration": 0.25,
        "start": { "mode": 1, "amplitude": 3e-6, "random": { "seed": 5, "energy": 1e-4 } },
        "contact_stride": 500,
        "body_stride": 5000,
        "segment": 500,
        "points": [{ "name": "rim", "body": "upper", "at": [0.5, -0.02, 0.5] }]
    });
    let mut job = sliding(transient);
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.003);
        job["bodies"][body]["mesh"]["cylinder"]["max_element_size"] = json!(0.08);
    }
    let folder = Folder::with(job.to_string());
    let (job, whole, output) = (folder.text("job.json"), folder.text("whole.h5"), folder.text("run.h5"));
    let launch = |target: &str, file: &str| {
        let mut command = mpirun();
        command.args(["-n", "2", PROGRAM]);
        start_on(2, command, &["run", &job, target, file])
    };
    let mut unbroken = launch("--output", &whole);
    let place = folder.path("run.transient");
    wait_for(&folder.path("whole.transient"), 3, &mut unbroken);
    std::fs::create_dir(&place).expect("make a folder");
    for path in segments(&folder.path("whole.transient")) {
        std::fs::copy(&path, place.join(path.file_name().expect("name"))).expect("copy");
    }
    // It may name more of them than there were.
    std::fs::copy(folder.path("whole.transient/manifest"), place.join("manifest")).expect("copy");
    assert!(unbroken.wait().expect("wait").success());
    for (name, to) in [("USR1", None), ("KILL", Some(0)), ("TERM", Some(1))] {
        let mut child = launch("--resume", &output);
        wait_for(&place, segments(&place).len() + 2, &mut child);
        signal(name, to.map_or(child.id(), |rank| rank_of(child.id(), rank)));
        let code = child.wait().expect("wait").code();
        match name {
            "KILL" => assert!(code != Some(0), "{code:?}"),
            // Open MPI passes SIGUSR1 on to all ranks; and what one rank gets, rank 0 learns.
            _ => assert_eq!(code, Some(5), "{name} to {to:?}"),
        }
        assert!(!folder.path("run.h5").exists());
    }
    folder.call(2, "run", &["--resume", &output]).good();
    same(&open(&whole), &open(&output));
    let moved = |name: &str| -> Vec<f64> { read(&open(folder.path(name)), "VTKHDF/PointData/displacement") };
    let (a, b) = (moved("whole.transient.vtkhdf"), moved("run.transient.vtkhdf"));
    let largest = a.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let differ = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(a.len() == b.len() && differ < 1e-7 * largest, "bodies differ by {differ:e} of {largest:e}");
}

/// All datasets of a file but its provenance, with their shapes, as text: what is no number equals itself.
fn everything(file: &Path) -> BTreeMap<String, String> {
    fn visit(reader: &Reader, group: &str, all: &mut BTreeMap<String, String>) {
        for name in reader.names(group).expect("names") {
            let path = format!("{group}/{name}");
            match reader.read(&path) {
                Ok(found) => drop(all.insert(path, format!("{found:?}"))),
                Err(_) => visit(reader, &path, all),
            }
        }
    }
    let (reader, mut all) = (Reader::open(file).expect("a file"), BTreeMap::new());
    visit(&reader, "/", &mut all);
    all.retain(|path, _| !path.starts_with("//provenance"));
    all
}

/// Modes with their shapes, then the compliance, are on the disk when they are made: killed after the modes, and
/// again among the steps, the run makes neither again, and its files are those of the unbroken run.
#[test]
fn modes_and_their_shapes_are_made_once_however_often_a_run_is_killed() {
    let transient = json!({
        "duration": 0.08,
        "start": { "mode": 1, "amplitude": 3e-6 },
        "body_stride": 2000,
        "segment": 200,
        "points": [{ "name": "rim", "body": "upper", "at": [0.5, -0.02, 0.5] }]
    });
    let mut job = sliding(transient);
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.004);
        job["bodies"][body]["mesh"]["cylinder"]["max_element_size"] = json!(0.08);
    }
    job["analyses"]["stability"]["phases"] = json!(4);
    job["output"] = json!({});
    let folder = Folder::with(job.to_string());
    let (job, whole, output) = (folder.text("job.json"), folder.text("whole.h5"), folder.text("run.h5"));
    let made = folder.call(1, "run", &["--output", &whole]);
    assert!(made.good().err.contains("] modes, body") && made.err.contains("] compliance"), "{}", made.err);
    let model = folder.text("run.model.h5");
    let mut child = start(Command::new(PROGRAM), &["run", &job, "--output", &output]);
    wait_until("the file of modes", &mut child, || Path::new(&model).exists());
    signal("KILL", child.id());
    child.wait().expect("wait");
    assert!(!folder.path("run.h5").exists());
    // The way on is told, with the job file and without, and taken below.
    let advice = format!("is left of it: run its job with --reuse {model}");
    for stopped in [folder.call(1, "run", &["--resume", &output]), railsqueal(1, &["run", "--resume", &output])] {
        stopped.failed(2, &["nothing to continue", "ended before its first segment", &advice]);
    }
    let go_on = |args: &[&str]| {
        let mut child = start(Command::new(PROGRAM), &[&["run", &job], args].concat());
        wait_for(&folder.path("run.transient"), 3, &mut child);
        signal("KILL", child.id());
        child.wait().expect("wait");
        let mut said = String::new();
        child.stderr.take().expect("stderr").read_to_string(&mut said).expect("text");
        assert!(said.contains("] mode shapes of an earlier run") && !said.contains("] modes, body"), "{said}");
    };
    go_on(&["--reuse", &model, "--output", &output]);
    let ran = folder.call(1, "run", &["--resume", &output]);
    assert!(!ran.good().err.contains("] modes, body") && !ran.err.contains("] compliance"), "{}", ran.err);
    for name in ["h5", "free_modes.vtkhdf", "modes.vtkhdf", "transient.vtkhdf"] {
        let [a, b] = ["whole", "run"].map(|run| everything(&folder.path(&format!("{run}.{name}"))));
        assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{name}");
        a.iter().for_each(|(path, values)| assert!(b[path] == *values, "{name}: {path} differs"));
    }
    assert!(folder.listing().iter().all(|name| !name.contains("model")), "{:?}", folder.listing());
}

/// The first signal waits for the end of a segment, which does not come here; the second one does not. METIS has
/// worked before: it puts handlers of its own in place of those there are.
#[test]
fn a_second_signal_ends_a_run_at_once() {
    let folder = Folder::with(sliding(json!({ "duration": 100, "contact_stride": 0, "segment": 200_000 })).to_string());
    let mut child = start(Command::new(PROGRAM), &["run", &folder.text("job.json")]);
    let mut lines = BufReader::new(child.stderr.take().expect("stderr")).lines().map(|l| l.expect("a line"));
    assert!(lines.by_ref().any(|line| line.contains("factorisation")));
    assert!(lines.by_ref().any(|line| line.ends_with("] transient")));
    signal("TERM", child.id());
    assert!(lines.by_ref().any(|line| line.contains("a signal came")));
    assert!(child.try_wait().expect("wait").is_none(), "it goes on to the end of the segment");
    signal("TERM", child.id());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("wait").code(), Some(5), "{rest:?}");
    // The end of the segment would be told, and leave a segment behind that of the start.
    assert!(rest.iter().all(|line| !line.contains("stopped on request")), "{rest:?}");
    let left = segments(&folder.path("job.transient"));
    assert!(left.iter().all(|path| path.ends_with("000000000000.h5")), "{left:?}");
}

/// Open MPI answers SIGTERM and SIGINT by ending the ranks, gently first, and itself with 1: the state is there all the
/// same.
#[test]
fn a_terminated_launcher_leaves_a_state() {
    launcher_leaves_a_state("TERM");
}

#[test]
fn ctrl_c_to_the_launcher_leaves_a_state() {
    launcher_leaves_a_state("INT");
}

fn launcher_leaves_a_state(name: &str) {
    let (folder, model) = prepared();
    let (job, output) = (folder.text("job.json"), folder.text("run.h5"));
    let place = folder.path("run.transient");
    let sets = ["--set", "analyses.transient.duration=20", "--reuse", &model];
    let mut command = mpirun();
    command.args(["-n", "2", PROGRAM]);
    let mut child = start_on(2, command, &[&["run", &job], &sets[..], &["--output", &output]].concat());
    wait_for(&place, 3, &mut child);
    signal(name, child.id());
    assert_eq!(child.wait().expect("wait").code(), Some(1));
    let left = segments(&place).len();
    assert!(left >= 3, "{left} segments");
    let ran = folder.call(2, "run", &[&sets[..], &["--resume", &output, "--wall-time", "1"]].concat());
    ran.failed(5, &["limit of wall time", "--resume"]);
    assert!(segments(&place).len() > left);
}

#[test]
fn the_wall_time_stops_a_run_and_what_does_not_belong_to_it_is_refused() {
    let (folder, model) = prepared();
    let output = folder.text("run.h5");
    let long = ["--set", "analyses.transient.duration=20", "--reuse", &model];
    let call = |args: &[&str]| folder.call(1, "run", &[&long[..], args].concat());
    call(&["--output", &output, "--wall-time", "2"]).failed(5, &["limit of wall time", "--resume"]);
    call(&["--output", &output]).failed(2, &["unfinished run", "--resume"]);
    let resume = ["--resume", &output];
    call(&[&resume[..], &["--set", "contact.friction=0.31", "--set", "analyses.transient.start.mode=2"]].concat())
        .failed(2, &["belongs to another job", "contact.friction", "analyses.transient.start.mode", "begun with"]);
    let last = segments(&folder.path("run.transient")).pop().expect("a segment");
    let bytes = std::fs::read(&last).expect("read");
    let manifest = folder.path("run.transient/manifest");
    let text = std::fs::read_to_string(&manifest).expect("read");
    let this = format!("railsqueal {}", env!("CARGO_PKG_VERSION"));
    std::fs::write(&manifest, resummed(&text.replace(&this, "railsqueal 0.0.1"))).expect("write");
    let parts = ["--resume", "was written by railsqueal 0.0.1", &this, "continue it with that version"];
    call(&resume).failed(2, &parts);
    std::fs::write(&manifest, &text).expect("write");
    std::fs::write(&last, &bytes[..bytes.len() / 2]).expect("truncate");
    call(&resume).failed(3, &["--resume", "damaged", "bytes, expected", "remove it"]);
    // As the message says.
    std::fs::remove_file(&last).expect("remove");
    call(&[&resume[..], &["--wall-time", "2"]].concat()).failed(5, &["limit of wall time"]);
    let first = &segments(&folder.path("run.transient"))[0];
    let bytes = std::fs::read(first).expect("read");
    std::fs::write(first, &bytes[..bytes.len() / 2]).expect("truncate");
    call(&resume).failed(3, &["--resume", "000000000000.h5", "damaged", "--force"]);
    std::fs::remove_file(first).expect("remove");
    call(&resume).failed(3, &["first segment is missing", "--force"]);
}

/// The lines of a manifest with the checksums that fit them.
fn resummed(text: &str) -> String {
    use sha2::{Digest, Sha256};
    let mut before = String::new();
    let line = |line: &str| {
        let record = line.split_once(' ').expect("a record").1;
        let sum = Sha256::new().chain_update(&before).chain_update(record).finalize();
        before = sum.iter().map(|b| format!("{b:02x}")).collect();
        format!("{before} {record}\n")
    };
    text.lines().map(line).collect()
}

#[test]
fn a_step_that_does_not_converge_ends_the_run_with_its_state_saved() {
    let (folder, model) = prepared();
    let output = folder.text("run.h5");
    // A load that all but vanishes, and less than rounding leaves of it on the way: at 70 kN more than is left is
    // asked for, at 30 kN less.
    let load = "analyses.transient.histories.normal_load=[[0, 7e4], [0.01, 7e4], [0.02, 1e-3], [0.3, 1e-3]]";
    let law = r#"contact.friction={"exponential": {"static": 0.31, "kinetic": 0.3, "decay_velocity": 0.5}}"#;
    let sets = ["--set", load, "--set", law, "--set", "analyses.transient.tolerance=7e-17", "--reuse", &model];
    let parts = ["run.transient", "time step", "residual", "was asked for", "analyses.transient.step", "tolerance"];
    folder.call(1, "run", &[&sets[..], &["--output", &output]].concat()).failed(4, &parts);
    let last = segments(&folder.path("run.transient")).pop().expect("a segment");
    let file = open(&last);
    let step: i64 = file.dataset("checkpoint/step").and_then(|d| d.read_scalar()).expect("step");
    let times: Vec<f64> = read(&file, "transient/time");
    drop(file);
    // All steps up to the one that failed are there.
    assert!(step > 1000 && step % 700 != 0, "{step}");
    assert!((times.last().expect("times") - step as f64 * 1e-5).abs() < 1e-12, "{times:?}");
    // Nor does the same job get to its end from there; which step fails next is a matter of rounding.
    folder.call(1, "run", &[&sets[..], &["--resume", &output]].concat()).failed(4, &["time step", "residual"]);
}

/// The disk fills up while segments are written, and again when the results are put together; with room the run goes
/// on.
#[test]
fn a_full_disk_in_the_middle_keeps_the_state() {
    let (folder, model) = prepared();
    let whole = folder.text("whole.h5");
    let sets = ["--reuse", &model, "--set", "output.reduced=false", "--set", "analyses.transient.contact_stride=20"];
    folder.call(1, "run", &[&sets[..], &["--output", &whole]].concat()).good();
    std::fs::create_dir(folder.path("disk")).expect("make a folder");
    let (disk, output) = (folder.text("disk"), folder.text("disk/run.h5"));
    let mount = |options: &str| {
        let done = Command::new("mount").args(["-t", "tmpfs", "-o", options, "tmpfs", &disk]).output();
        done.is_ok_and(|m| m.status.success())
    };
    if !mount("size=4m") {
        eprintln!("no small file system can be mounted here; files_that_may_not_grow_in_the_middle stands for it");
        return;
    }
    let run = |target: &str| folder.call(1, "run", &[&sets[..], &[target, &output]].concat());
    let middle = run("--output");
    let left = segments(&folder.path("disk/run.transient"));
    // Room for the segments, not for the results beside them.
    assert!(mount("remount,size=11m"));
    let end = run("--resume");
    let all = segments(&folder.path("disk/run.transient"));
    assert!(mount("remount,size=100m"));
    let good = run("--resume");
    // A file of HDF5 open here would be open in the processes that other tests start, too.
    let copied = std::fs::copy(&output, folder.path("run.h5"));
    assert!(Command::new("umount").arg(&disk).status().expect("umount").success());
    middle.failed(6, &["run.transient", "No space left", "free space there"]);
    assert!(left.len() > 1 && left.len() < 43, "{left:?}");
    end.failed(6, &["run.h5", "No space left"]);
    assert_eq!(all.len(), 44, "{all:?}");
    good.good();
    copied.expect("copy");
    same(&open(&whole), &open(folder.path("run.h5")));
}

/// The same by a limit on the size of files, which needs no rights to mount.
#[test]
fn files_that_may_not_grow_in_the_middle() {
    let (folder, model) = prepared();
    let sets = ["--reuse", &model, "--set", "analyses.transient.contact_stride=1"];
    let duration = ["--set", "analyses.transient.duration=0.02"];
    let whole = folder.text("whole.h5");
    folder.call(1, "run", &[&sets[..], &duration, &["--output", &whole]].concat()).good();
    let output = folder.text("run.h5");
    // The model at the start is smaller than this, a segment with all contact fields is not.
    let mut command = mpirun();
    // Over shared memory Open MPI itself would need larger files.
    command.env("OMPI_MCA_btl", "self,tcp");
    command.args(["-n", "1", "sh", "-c", "ulimit -f 5000; exec \"$0\" run \"$@\"", PROGRAM, &folder.text("job.json")]);
    command.args(sets).args(duration).args(["--output", &output]);
    finish(&mut command).failed(6, &["run.transient/000000000700.h5", "ulimit -f"]);
    assert_eq!(segments(&folder.path("run.transient")).len(), 1);
    folder.call(1, "run", &[&sets[..], &duration, &["--resume", &output]].concat()).good();
    same(&open(&whole), &open(&output));
}
