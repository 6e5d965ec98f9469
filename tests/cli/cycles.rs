//! Limit cycles over a sweep: the same on any number of ranks, and after a stop.

use super::interrupted::{signal, start};
use super::program::*;
use super::transient::open;
use serde_json::{json, Value};
use std::path::Path;
use std::time::{Duration, Instant};

/// Lateral sliding on a coarse mesh, from what sticks in part to what squeals.
fn swept(cycles: Value) -> Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
        job["bodies"][body]["damping"] = json!({ "alpha": 6.0, "beta": 1e-6 });
        job["bodies"][body]["rotation"] = json!("none");
    }
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    job["analyses"] = json!({
        "modes": { "count": 6 },
        "stability": {},
        "sweep": { "keys": { "contact.creepage.lateral": [0.003, 0.012, 0.016] }, "cycles": cycles }
    });
    job["output"] = json!({ "fields": false });
    job
}

fn quick() -> Value {
    json!({ "duration": 1.0, "settled": 0.01, "amplitude": 1e-5, "harmonics": 3 })
}

/// Files of points that are done.
fn done(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder).map(|d| d.flatten().count());
    entries.unwrap_or_default()
}

/// All numbers of the limit cycles, as they are.
fn bits(file: &hdf5::File) -> Vec<(String, Vec<u64>)> {
    let group = file.group("sweep/cycles").expect("group");
    let names = group.member_names().expect("names");
    let number = |n: &&String| !["branch", "along", "message"].contains(&n.as_str());
    let of = |n: &String| {
        let values = group.dataset(n).expect("dataset").read_raw::<f64>().expect("numbers");
        (n.clone(), values.into_iter().map(f64::to_bits).collect())
    };
    names.iter().filter(number).map(of).collect()
}

#[test]
fn limit_cycles_are_the_same_on_two_ranks_and_after_a_stop() {
    let folder = Folder::with(swept(quick()).to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    let one = folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("one.h5")]);
    for part in ["limit cycles, up", "limit cycles, down", "of 3 points squeal", "most energy"] {
        assert!(one.good().out.contains(part), "{part:?} is not in\n{}", one.out);
    }
    let whole = open(folder.path("one.h5"));
    let fate: Vec<i8> = whole.dataset("sweep/cycles/fate").and_then(|d| d.read_raw()).expect("fates");
    // What sticks in part is quiet, what slides squeals, whichever way it is come to.
    assert!(
        fate.len() == 6 && [fate[0], fate[3]] == [0, 0] && fate[1] > 0 && fate[2] > 0 && fate[4] > 0 && fate[5] > 0,
        "{fate:?}"
    );
    let read =
        |name: &str| whole.dataset(&format!("sweep/cycles/{name}")).and_then(|d| d.read_raw::<f64>()).expect("numbers");
    let (force, lines, energy) = (read("force"), read("force_harmonics"), read("kinetic"));
    assert!(force.chunks(3).all(|f| (f[2] / -70e3 - 1.0).abs() < 0.05), "{force:?}");
    assert!(lines.len() == 6 * 3 * 3 && energy[0] == 0.0, "{energy:?}");
    // Whichever way a point is come to it is the same cycle here.
    assert!((1..3).all(|k| (energy[k] / energy[k + 3] - 1.0).abs() < 0.04), "{energy:?}");
    assert!(!folder.path("one.cycles").exists());

    folder.call(2, "run", &["--reuse", &model, "--output", &folder.text("two.h5")]).good();
    assert_eq!(bits(&open(folder.path("two.h5"))), bits(&whole), "two ranks");

    let output = folder.text("stopped.h5");
    let (job, kept) = (folder.text("job.json"), folder.path("stopped.cycles"));
    let mut child = start(std::process::Command::new(PROGRAM), &["run", &job, "--reuse", &model, "--output", &output]);
    let begun = Instant::now();
    while done(&kept) < 2 {
        assert!(begun.elapsed() < Duration::from_secs(60) && child.try_wait().expect("state").is_none());
        std::thread::sleep(Duration::from_millis(2));
    }
    signal("TERM", child.id());
    assert_eq!(child.wait().expect("end").code(), Some(5));
    let there = done(&kept);
    assert!((2..6).contains(&there) && !folder.path("stopped.h5").exists(), "{there}");
    // One of them is damaged: it is computed again.
    let some = std::fs::read_dir(&kept).expect("folder").flatten().next().expect("a file").path();
    let mut bytes = std::fs::read(&some).expect("read");
    bytes[40] ^= 1;
    std::fs::write(&some, bytes).expect("write");
    folder.call(1, "run", &["--reuse", &model, "--output", &output]).good();
    assert_eq!(bits(&open(folder.path("stopped.h5"))), bits(&whole), "after a stop");
    assert!(!kept.exists());
}

#[test]
fn what_cannot_be_followed_is_refused() {
    for (cycles, parts) in [
        (json!({ "along": "contact.speed" }), ["cycles.along", "contact.creepage.lateral"]),
        (json!({ "branches": ["up", "up"] }), ["cycles.branches", "\"up\" twice"]),
        (json!({ "branches": ["left"] }), ["branches.0", "left"]),
        (json!({ "duration": 1e-6 }), ["cycles.duration", "at least one step"]),
    ] {
        Folder::with(swept(cycles).to_string()).call(1, "check", &[]).failed(2, &parts);
    }
    let mut job = swept(json!({}));
    job["contact"]["roughness"] = json!({ "lower": [{ "spectrum": { "levels": "ISO3095", "seed": 1 } }] });
    Folder::with(job.to_string()).call(1, "check", &[]).failed(2, &["cycles", "no motion repeats itself"]);
}
