//! Runs whose segments, or whose earlier results, are damaged, lost or of others: refused before any step, or right.

use super::interrupted::*;
use super::program::*;
use super::transient::{open, read, sliding};
use serde_json::json;
use std::path::Path;
use std::process::Command;

/// Places and bits that are the same in every run of the tests.
fn places(seed: u64) -> impl FnMut(usize) -> usize {
    let mut state = seed;
    move |n| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    }
}

/// A stopped run with the whole of it beside, and what continues it.
struct Stopped {
    folder: Folder,
    model: String,
    output: String,
}

impl Stopped {
    fn new() -> Self {
        let (folder, model) = prepared();
        let output = folder.text("run.h5");
        let stopped = Self { folder, model, output };
        let whole = stopped.folder.text("whole.h5");
        stopped.call(&["--output", &whole]).good();
        let (job, place) = (stopped.folder.text("job.json"), stopped.folder.path("run.transient"));
        let mut child = start(Command::new(PROGRAM), &stopped.line(&job, &["--output", &stopped.output]));
        wait_for(&place, 5, &mut child);
        signal("USR1", child.id());
        assert_eq!(child.wait().expect("wait").code(), Some(5));
        stopped
    }

    fn line<'a>(&'a self, job: &'a str, args: &[&'a str]) -> Vec<&'a str> {
        let sets = ["--set", "analyses.transient.duration=0.2", "--set", "analyses.transient.segment=300"];
        [&["run", job, "--reuse", &self.model], &sets[..], args].concat()
    }

    fn call(&self, args: &[&str]) -> Ran {
        railsqueal(1, &self.line(&self.folder.text("job.json"), args))
    }

    /// To continue it fails like this before any step.
    #[track_caller]
    fn refused(&self, code: i32, parts: &[&str]) {
        let ran = self.call(&["--resume", &self.output]);
        ran.failed(code, parts);
        assert!(!ran.err.contains("s] transient"), "before the steps: {}", ran.err);
        assert!(!Path::new(&self.output).exists());
    }
}

#[test]
fn damaged_lost_and_foreign_segments_are_refused_before_any_step() {
    let stopped = Stopped::new();
    let place = stopped.folder.path("run.transient");
    let files = segments(&place);
    assert!(files.len() > 3, "{files:?}");
    let mut below = places(12);
    for path in [files[0].clone(), files[2].clone(), place.join("manifest")] {
        let bytes = std::fs::read(&path).expect("read");
        for _ in 0..4 {
            let mut harmed = bytes.clone();
            harmed[below(bytes.len() - 1)] ^= 1 << below(8);
            std::fs::write(&path, harmed).expect("write");
            stopped.refused(3, &["--resume", "damaged"]);
        }
        std::fs::write(&path, bytes).expect("write");
    }
    let kept = std::fs::read(&files[2]).expect("read");
    std::fs::remove_file(&files[2]).expect("remove");
    stopped.refused(3, &["the segment is missing"]);
    std::fs::copy(&files[1], &files[2]).expect("copy");
    stopped.refused(3, &["000000000600.h5", "damaged"]);
    std::fs::write(&files[2], kept).expect("write");
    // Of a run with another friction.
    let other = stopped.folder.text("other.h5");
    stopped
        .call(&["--output", &other, "--set", "contact.friction=0.35", "--wall-time", "0.001"])
        .failed(5, &["wall time"]);
    let foreign = segments(&stopped.folder.path("other.transient"));
    let last = files.last().expect("a segment");
    let next = last.with_file_name("000000099900.h5");
    std::fs::copy(&foreign[1], &next).expect("copy");
    stopped.refused(3, &["000000099900.h5", "does not name", "remove it"]);
    std::fs::remove_file(&next).expect("remove");
    stopped.call(&["--resume", &stopped.output]).good();
    same(&open(stopped.folder.path("whole.h5")), &open(&stopped.output));
    assert!(!place.exists());
}

/// Two starts with the same output, the second with --force and another friction.
#[test]
fn a_second_run_with_the_same_output_is_refused() {
    let (folder, model) = prepared();
    let (job, output) = (folder.text("job.json"), folder.text("run.h5"));
    let long = ["--set", "analyses.transient.duration=20", "--reuse", &model];
    let mut child = start(Command::new(PROGRAM), &[&["run", &job], &long[..], &["--output", &output]].concat());
    wait_for(&folder.path("run.transient"), 2, &mut child);
    let others = ["--set", "contact.friction=0.35"];
    let process = format!("process {}", child.id());
    for target in [&["--output", &output, "--force"][..], &["--output", &output], &["--resume", &output]] {
        let ran = child.beside(&[&["run", &job], &long[..], &others, target].concat());
        ran.failed(2, &["run.transient", "another run is at work", &process]);
        assert!(!ran.err.contains("stage") && !ran.err.contains("steady"), "at once: {}", ran.err);
    }
    // The lock ends with the process, however it ends.
    signal("KILL", child.id());
    child.wait().expect("wait");
    folder.call(1, "run", &[&long[..], &["--output", &output]].concat()).failed(2, &["an unfinished run", "--resume"]);
    folder
        .call(1, "run", &[&long[..], &["--resume", &output, "--wall-time", "0.5"]].concat())
        .failed(5, &["wall time"]);
}

/// Numbers of all figures are read as they were written; a run may go on longer than it was begun for, and otherwise.
#[test]
fn a_run_is_continued_with_its_own_job_longer_and_with_other_histories() {
    let (folder, model) = prepared();
    let output = folder.text("run.h5");
    let own = [
        "--reuse",
        &model,
        "--set",
        "analyses.transient.start.amplitude=1.7270911113360663e-07",
        "--set",
        "contact.creepage.lateral=0.010000000000000002",
    ];
    let call = |sets: &[&str], target: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        folder.call(1, "run", &[&own[..], &sets, target].concat())
    };
    let short = "analyses.transient.duration=0.02";
    call(&[short], &["--output", &output, "--wall-time", "0.001"]).failed(5, &["after 700 of 2000 steps"]);
    let bent = |from: f64| {
        format!(
            "analyses.transient.histories.lateral=[[0, 0.010000000000000002], [{from}, \
         0.010000000000000002], [0.03, 0.008]]"
        )
    };
    let longer = "analyses.transient.duration=0.03";
    call(&[longer, &bent(0.006)], &["--resume", &output]).failed(2, &["another job", "histories.lateral"]);
    call(&["analyses.transient.duration=0.005"], &["--resume", &output]).failed(2, &["holds 700 steps already"]);
    // The run has its job: what changes is enough.
    let changes = ["run", "--resume", &output, "--reuse", &model, "--set", longer, "--set", &bent(0.01)];
    railsqueal(1, &changes).good();
    let file = open(&output);
    let times: Vec<f64> = read(&file, "transient/time");
    assert_eq!(times.len(), 3000);
    let steps: Vec<i64> = read(&file, "provenance/parts/step");
    assert_eq!(steps, [0, 700]);
    let jobs: Vec<hdf5::types::VarLenUnicode> = read(&file, "provenance/parts/job");
    assert!(jobs[0].contains("1.7270911113360663e-7") || jobs[0].contains("1.7270911113360663e-07"), "{}", jobs[0]);
    assert!(jobs[0].contains("\"duration\":0.02") && jobs[1].contains("\"duration\":0.03"));
    drop(file);
    // The same as if it had been so from the start.
    let whole = folder.text("whole.h5");
    call(&[longer, &bent(0.01)], &["--output", &whole]).good();
    same(&open(&whole), &open(&output));
}

/// A folder with a job whose model others may take up.
fn without_steps() -> Folder {
    let mut job = sliding(json!({ "duration": 0.01 }));
    job["analyses"].as_object_mut().expect("analyses").remove("transient");
    job["output"]["fields"] = json!(false);
    Folder::with(job.to_string())
}

/// Position of a reference to a text of variable length in a file: four bytes of its length, eight of the place of its
/// heap, four of its number there.
fn reference(bytes: &[u8], length: usize) -> usize {
    let little = |at: usize, n: usize| bytes[at..at + n].iter().rev().fold(0, |sum, b| sum << 8 | usize::from(*b));
    let heap = |at: usize| bytes.get(at..at.saturating_add(4)) == Some(&b"GCOL"[..]);
    let mut places = (0..bytes.len() - 16).filter(|&at| little(at, 4) == length && heap(little(at + 4, 8)));
    places.next().expect("a reference")
}

/// Damage by which libhdf5 asks for gigabytes, or crashes, where it reads the file: one byte of what refers to a text.
#[test]
fn a_model_that_harms_whoever_reads_it_is_refused() {
    let folder = without_steps();
    let (first, model) = (folder.text("first.h5"), folder.text("model.h5"));
    folder.call(1, "run", &["--output", &first]).good();
    let inputs: hdf5::types::VarLenUnicode =
        open(&first).dataset("reduced/inputs").and_then(|d| d.read_scalar()).expect("a text");
    let whole = std::fs::read(&first).expect("read");
    let at = reference(&whole, inputs.len());
    let harmed = |byte: usize| {
        let mut bytes = whole.clone();
        bytes[byte] = 0x70;
        std::fs::write(&model, &bytes).expect("write");
    };
    for ranks in [1, 2] {
        let refused = |parts: &[&str]| {
            let ran = folder.call(ranks, "run", &["--reuse", &model, "--output", &folder.text("again.h5")]);
            ran.failed(3, &[&["model.h5: ", "damaged"], parts].concat());
            assert!(!ran.err.contains("s] "), "at once: {}", ran.err);
        };
        // A text of almost two gigabytes.
        harmed(at + 3);
        refused(&["more memory than ten times the file"]);
        // The number of a text far past the end of its heap, which later versions of libhdf5 notice.
        harmed(at + 14);
        refused(&[]);
    }
    let probe = |file: &str| railsqueal(1, &["probe", "--", file]).code;
    harmed(at + 3);
    assert_eq!((probe(&first), probe(&model)), (Some(0), Some(7)));
}

/// A bit flipped anywhere in the model of an earlier run: the results are the same, or there are none.
#[test]
fn a_damaged_model_is_refused_or_gives_the_same() {
    let folder = without_steps();
    let (first, model, again) = (folder.text("first.h5"), folder.text("model.h5"), folder.text("again.h5"));
    folder.call(1, "run", &["--output", &first]).good();
    let reuse = ["--reuse", &model, "--output", &again, "--force"];
    std::fs::copy(&first, &model).expect("copy");
    let values = || -> Vec<u64> {
        let file = open(&again);
        let growth: Vec<f64> = read(&file, "stability/growth_rate");
        growth.iter().map(|v| v.to_bits()).collect()
    };
    folder.call(1, "run", &reuse).good();
    let (whole, wanted) = (std::fs::read(&first).expect("read"), values());
    let mut below = places(6);
    let mut refused = 0;
    // Metadata lie at the beginning; a compliance that is stored whole takes most of the rest.
    for round in 0..20 {
        let mut bytes = whole.clone();
        let at = if round % 2 == 0 { below(bytes.len()) } else { below(20_000.min(bytes.len())) };
        bytes[at] ^= 1 << below(8);
        std::fs::write(&model, &bytes).expect("write");
        let ran = folder.call(1, "run", &reuse);
        match ran.code {
            Some(0) => assert_eq!(values(), wanted, "byte {at} changes the results without a word"),
            Some(3) => refused += 1,
            // What says which job it is of.
            Some(2) => assert!(ran.err.contains("--reuse"), "{ran:?}"),
            _ => panic!("byte {at}: {ran:?}"),
        }
    }
    assert!(refused > 5, "{refused} of 20 were refused");
}
