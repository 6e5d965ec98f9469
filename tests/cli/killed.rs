//! Runs of every kind that are killed, or ended by Ctrl-C, and taken up: the results of the unbroken run.

use super::interrupted::{signal, start, wait_for, wait_until};
use super::program::*;
use railsqueal::output::{Reader, Values};
use serde_json::{json, Value};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Command;

/// All datasets of a file but its provenance and the sums of its pieces.
fn datasets(file: &Path) -> BTreeMap<String, (Vec<usize>, Values)> {
    fn visit(reader: &Reader, group: &str, all: &mut BTreeMap<String, (Vec<usize>, Values)>) {
        for name in reader.names(group).expect("names") {
            let path = format!("{group}/{name}");
            match reader.read(&path) {
                Ok(found) => drop(all.insert(path, found)),
                Err(_) => visit(reader, &path, all),
            }
        }
    }
    let (reader, mut all) = (Reader::open(file).expect("a file"), BTreeMap::new());
    visit(&reader, "/", &mut all);
    all.retain(|path, _| !path.starts_with("//provenance") && !path.starts_with("//checksums"));
    all
}

fn numbers(values: &Values) -> Option<Vec<f64>> {
    match values {
        Values::F64(v) => Some(v.clone()),
        Values::F32(v) => Some(v.iter().map(|v| f64::from(*v)).collect()),
        Values::Complex(v) => Some(v.iter().flat_map(|v| [v.re, v.im]).collect()),
        _ => None,
    }
}

/// Both files have the same datasets, the numbers to `tolerance` of the largest of each and all else exactly. Residuals
/// and backward errors are what rounding leaves.
#[track_caller]
fn alike(one: &Path, other: &Path, tolerance: f64) {
    let (a, b) = (datasets(one), datasets(other));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{}", other.display());
    for (path, (shape, values)) in &a {
        let (other_shape, others) = &b[path];
        assert_eq!(shape, other_shape, "{path}");
        if ["residual", "backward_error", "iterations", "products"].iter().any(|name| path.ends_with(name)) {
            continue;
        }
        match (numbers(values), numbers(others)) {
            (Some(x), Some(y)) => {
                let finite = |v: &[f64]| v.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect::<Vec<f64>>();
                let nothing = |v: &[f64]| v.iter().map(|v| v.is_nan()).collect::<Vec<bool>>();
                assert_eq!(nothing(&x), nothing(&y), "{path}");
                let (x, y) = (finite(&x), finite(&y));
                let largest = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                let apart = x.iter().zip(&y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart <= tolerance * largest, "{path} differs by {apart:e} of {largest:e}");
            }
            _ => assert!(values == others, "{path} differs"),
        }
    }
}

/// The program, which takes Ctrl-C whatever the shell of the tests does.
fn program() -> Command {
    let mut command = Command::new("env");
    command.args(["--default-signal=INT", PROGRAM]);
    command
}

fn kill(mut child: Running) {
    signal("KILL", child.id());
    child.wait().expect("wait");
}

/// A swept curve of a few modes with a transient.
fn swept() -> Value {
    let mut job = job("swept-curve.json");
    for body in ["lower", "upper"] {
        job["bodies"][body]["damping"] = json!({ "alpha": 1.0, "beta": 1e-6 });
    }
    job["contact"]["patch"] = json!({ "half_length": 0.007, "half_width": 0.007, "spacing": 0.001 });
    job["analyses"] = json!({ "modes": { "count": 24 }, "stability": { "phases": 4 } });
    job
}

/// The complex modes of swept bodies and the shapes of their modes are those of the unbroken run, whether the run is
/// killed when its modes are on the disk or when its compliance is.
#[test]
fn swept_bodies_have_their_complex_modes_after_a_kill() {
    let folder = Folder::with(swept().to_string());
    let (job, whole, output) = (folder.text("job.json"), folder.text("whole.h5"), folder.text("run.h5"));
    let made = folder.call(1, "run", &["--output", &whole]);
    assert!(made.good().err.contains("] modes, body"), "{}", made.err);
    assert!(folder.path("whole.modes.vtkhdf").exists() && folder.path("whole.free_modes.vtkhdf").exists());
    let model = folder.path("run.model.h5");
    for complete in [false, true] {
        let mut child = start(program(), &["run", &job, "--output", &output]);
        wait_until("the file of the model", &mut child, || {
            Reader::open(&model)
                .is_ok_and(|file| file.has("/reduced/version") && (!complete || !file.has("/reduced/alone")))
        });
        kill(child);
        assert!(!folder.path("run.h5").exists());
        let file = folder.text("run.model.h5");
        let ran = folder.call(1, "run", &["--reuse", &file, "--output", &output]);
        assert_eq!(ran.good().err.contains("] compliance"), !complete, "{}", ran.err);
        for name in ["h5", "free_modes.vtkhdf", "modes.vtkhdf"] {
            let [a, b] = ["whole", "run"].map(|run| folder.path(&format!("{run}.{name}")));
            alike(&a, &b, 1e-6);
        }
        let reader = Reader::open(&folder.path("run.h5")).expect("results");
        assert!(reader.has("/stability/shape"));
        let left: Vec<String> = folder.listing().into_iter().filter(|name| name.starts_with("run.")).collect();
        assert!(left.iter().all(|name| !name.contains("model")), "{left:?}");
        left.iter().for_each(|name| std::fs::remove_file(folder.path(name)).expect("remove"));
    }
    // The file of a finished run has no shapes of them, which is said.
    let ran = folder.call(1, "run", &["--reuse", &whole, "--output", &output]);
    assert!(ran.good().out.contains("complex modes                      not written"), "{}", ran.out);
    assert!(!ran.err.contains("] modes, body"), "{}", ran.err);
}

/// The same of a transient that is continued.
#[test]
fn swept_bodies_have_their_complex_modes_after_a_continued_transient() {
    let mut job = swept();
    let transient =
        json!({ "duration": 0.02, "step": 1e-5, "start": { "random": { "seed": 3, "energy": 1e-4 } }, "segment": 100 });
    job["analyses"]["transient"] = transient;
    let folder = Folder::with(job.to_string());
    let (job, whole, output) = (folder.text("job.json"), folder.text("whole.h5"), folder.text("run.h5"));
    folder.call(1, "run", &["--output", &whole]).good();
    let mut child = start(program(), &["run", &job, "--output", &output]);
    wait_for(&folder.path("run.transient"), 3, &mut child);
    kill(child);
    folder.call(1, "run", &["--resume", &output]).good();
    for name in ["h5", "free_modes.vtkhdf", "modes.vtkhdf"] {
        let [a, b] = ["whole", "run"].map(|run| folder.path(&format!("{run}.{name}")));
        alike(&a, &b, 1e-6);
    }
}

/// Files that a killed run was writing are removed by the next one to the same name, which says so, and by no other.
#[test]
fn unfinished_files_of_a_killed_run_are_removed_by_the_next() {
    let mut job = small();
    job["analyses"] = json!({ "modes": { "count": 8 }, "steady": {} });
    let folder = Folder::with(job.to_string());
    let partial =
        |folder: &Folder| folder.listing().into_iter().filter(|name| name.ends_with(".partial")).collect::<Vec<_>>();
    // A file may be finished between the look at it and the kill.
    let left = (0..20).find_map(|_| {
        let output = folder.text("run.h5");
        let mut child = start(program(), &["run", &folder.text("job.json"), "--force", "--output", &output]);
        wait_until("an unfinished file", &mut child, || !partial(&folder).is_empty());
        kill(child);
        Some(partial(&folder)).filter(|left| !left.is_empty())
    });
    let left = left.expect("a kill while a file is written");
    assert!(!left.is_empty() && left.iter().all(|name| name.starts_with(".run.")), "{left:?}");
    let quick = ["--only", "steady", "--set", "output.fields=false"];
    let other = folder.text("other.h5");
    folder.call(1, "run", &[&quick[..], &["--output", &other]].concat()).good();
    assert_eq!(partial(&folder), left);
    let ran = folder.call(1, "run", &[&quick[..], &["--force", "--output", &folder.text("run.h5")]].concat());
    assert!(ran.good().err.contains("of a run that was killed are removed"), "{}", ran.err);
    assert!(left.iter().all(|name| ran.err.contains(name)), "{left:?}: {}", ran.err);
    assert!(folder.listing().iter().all(|name| !name.contains(".partial")), "{:?}", folder.listing());
}

/// Ctrl-C is answered as SIGTERM is: at once with a line, at the end of the step with what goes on, by exit code 5; a
/// second one ends the run at once.
#[test]
fn ctrl_c_is_answered_as_sigterm_is() {
    let mut job = small();
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["max_element_size"] = json!(0.03);
    }
    job["output"] = json!({ "fields": false });
    let folder = Folder::with(job.to_string());
    let said = |name: &str| {
        let mut child = start(program(), &["run", &folder.text("job.json")]);
        let mut lines = BufReader::new(child.stderr.take().expect("stderr")).lines().map(|l| l.expect("a line"));
        assert!(lines.by_ref().any(|line| line.contains("meshing")));
        signal(name, child.id());
        let rest: Vec<String> = lines.collect();
        assert_eq!(child.wait().expect("wait").code(), Some(5), "{name}: {rest:?}");
        rest
    };
    for name in ["TERM", "INT"] {
        let rest = said(name);
        assert!(rest.iter().any(|l| l.contains("a signal came") && l.contains("Ctrl-C")), "{name}: {rest:?}");
        assert!(rest.iter().any(|l| l.contains("railsqueal: error: stopped on request")), "{name}: {rest:?}");
    }
    folder.untouched();
    // Where the shell has it ignored, in the background, it stays so.
    let mut command = Command::new("env");
    command.args(["--ignore-signal=INT", PROGRAM]);
    let mut child = start(command, &["run", &folder.text("job.json"), "--only", "steady"]);
    let mut lines = BufReader::new(child.stderr.take().expect("stderr")).lines().map(|l| l.expect("a line"));
    assert!(lines.by_ref().any(|line| line.contains("meshing")));
    signal("INT", child.id());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("wait").code(), Some(0), "{rest:?}");
}

/// A second Ctrl-C does not wait for the end of the segment, and says how to go on.
#[test]
fn a_second_ctrl_c_ends_a_run_at_once() {
    let transient = json!({ "duration": 100, "contact_stride": 0, "segment": 200_000 });
    let folder = Folder::with(super::transient::sliding(transient).to_string());
    let mut child = start(program(), &["run", &folder.text("job.json")]);
    let mut lines = BufReader::new(child.stderr.take().expect("stderr")).lines().map(|l| l.expect("a line"));
    assert!(lines.by_ref().any(|line| line.ends_with("] transient")));
    signal("INT", child.id());
    assert!(lines.by_ref().any(|line| line.contains("a signal came")));
    assert!(child.try_wait().expect("wait").is_none(), "it goes on to the end of the segment");
    signal("INT", child.id());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().expect("wait").code(), Some(5), "{rest:?}");
    assert!(rest.iter().any(|line| line.contains("ended at once") && line.contains("--resume")), "{rest:?}");
}

/// A job of finite elements with these analyses, killed when its modes and compliance are on the disk and the stage
/// `at` begins, and taken up with `--reuse`: the results of the unbroken run.
#[track_caller]
fn survives_a_kill(job: &Value, at: &str) {
    let folder = Folder::with(job.to_string());
    let (file, whole, output) = (folder.text("job.json"), folder.text("whole.h5"), folder.text("run.h5"));
    folder.call(1, "run", &["--output", &whole]).good();
    let mut child = start(program(), &["run", &file, "--output", &output]);
    let mut lines = BufReader::new(child.stderr.take().expect("stderr")).lines().map(|l| l.expect("a line"));
    assert!(lines.by_ref().any(|line| line.ends_with(&format!("] {at}"))), "no stage {at:?}");
    kill(child);
    let model = folder.text("run.model.h5");
    let ran = folder.call(1, "run", &["--reuse", &model, "--output", &output]);
    assert!(!ran.good().err.contains("] modes, body") && !ran.err.contains("] compliance"), "{}", ran.err);
    alike(&folder.path("whole.h5"), &folder.path("run.h5"), 1e-9);
    assert!(!folder.path("run.model.h5").exists());
}

fn elements(analyses: Value) -> Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
    }
    job["contact"]["creepage"] = json!({ "longitudinal": 0.001, "lateral": 0.01 });
    job["analyses"] = analyses;
    job["output"] = json!({ "fields": false });
    job
}

#[test]
fn a_killed_sweep_is_taken_up() {
    let keys = json!({ "contact.friction": [0.2, 0.3, 0.4], "contact.creepage.lateral": [0.005, 0.01] });
    let job = elements(json!({ "modes": { "count": 12 }, "stability": {}, "sweep": { "keys": keys } }));
    survives_a_kill(&job, "points of the sweep");
}

#[test]
fn a_killed_creep_curve_is_taken_up() {
    let curve = json!({ "key": "lateral", "values": [-0.002, 0.001, 0.003, 0.02] });
    let job = elements(json!({ "modes": { "count": 12 }, "stability": {}, "creep_curve": curve }));
    survives_a_kill(&job, "creep curve");
}

/// Limit cycles that a killed run had found are taken up by the same command, to the last bit.
#[test]
fn killed_limit_cycles_are_taken_up() {
    let cycles = json!({ "duration": 1.0, "settled": 0.01, "amplitude": 1e-5, "harmonics": 3 });
    let keys = json!({ "contact.creepage.lateral": [0.003, 0.012, 0.016] });
    let mut job = elements(json!({
        "modes": { "count": 6 }, "stability": {}, "sweep": { "keys": keys, "cycles": cycles }
    }));
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    for body in ["lower", "upper"] {
        job["bodies"][body]["damping"] = json!({ "alpha": 6.0, "beta": 1e-6 });
        job["bodies"][body]["rotation"] = json!("none");
    }
    let folder = Folder::with(job.to_string());
    let (file, model) = (folder.text("job.json"), folder.text("model.h5"));
    folder.call(1, "run", &["--set", "analyses.sweep=null", "--output", &model]).good();
    let whole = folder.text("whole.h5");
    folder.call(1, "run", &["--reuse", &model, "--output", &whole]).good();
    let (output, kept) = (folder.text("run.h5"), folder.path("run.cycles"));
    let done = || std::fs::read_dir(&kept).map_or(0, |d| d.flatten().count());
    for least in [1, 2] {
        let mut child = start(program(), &["run", &file, "--reuse", &model, "--output", &output]);
        wait_until("a point that is done", &mut child, || done() >= least);
        kill(child);
        assert!(!folder.path("run.h5").exists());
    }
    folder.call(1, "run", &["--reuse", &model, "--output", &output]).good();
    alike(&folder.path("whole.h5"), &folder.path("run.h5"), 0.0);
    assert!(!kept.exists());
}

/// A transient on all degrees of freedom that is killed among its steps goes on to the same bits.
#[test]
fn a_killed_full_transient_is_continued() {
    let folder = Folder::with(super::full_transient::short("full").to_string());
    let (job, whole, output) = (folder.text("job.json"), folder.text("whole.h5"), folder.text("run.h5"));
    let sets = ["--set", "analyses.transient.segment=10"];
    folder.call(1, "run", &[&sets[..], &["--output", &whole]].concat()).good();
    let mut child = start(program(), &[&["run", &job], &sets[..], &["--output", &output]].concat());
    wait_for(&folder.path("run.transient"), 4, &mut child);
    kill(child);
    folder.call(1, "run", &[&sets[..], &["--resume", &output]].concat()).good();
    super::interrupted::same(&super::transient::open(&whole), &super::transient::open(&output));
}
