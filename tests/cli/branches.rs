//! Branches of limit cycles: the same on any number of ranks, beside marching, and what is refused.

use super::program::*;
use super::transient::open;
use serde_json::{json, Value};

/// Lateral sliding on a coarse mesh.
fn job(cycles: Value) -> Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
        job["bodies"][body]["damping"] = json!({ "alpha": 6.0, "beta": 1e-6 });
        job["bodies"][body]["rotation"] = json!("none");
    }
    job["contact"]["creepage"] = json!({ "lateral": 0.014 });
    job["analyses"] = json!({ "modes": { "count": 6 }, "stability": {}, "cycles": cycles });
    job["output"] = json!({ "fields": false });
    job
}

fn quick() -> Value {
    json!({
        "along": "contact.creepage.lateral", "from": 0.004, "to": 0.02, "most": 4, "harmonics": 4, "samples": 120,
        "march": { "duration": 1.0, "settled": 0.01, "amplitude": 1e-5 }
    })
}

/// All numbers of the branch, as they are.
fn bits(file: &hdf5::File) -> Vec<(String, Vec<u64>)> {
    let group = file.group("cycles").expect("group");
    let of = |name: &str| {
        let values = group.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers");
        (name.to_owned(), values.into_iter().map(f64::to_bits).collect())
    };
    ["key", "frequency", "kinetic", "force", "velocity_rms", "onset/key"].map(of).to_vec()
}

#[test]
fn a_branch_is_the_same_on_two_ranks_and_passes_through_a_marched_cycle() {
    let folder = Folder::with(job(quick()).to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    let one = folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("one.h5")]);
    for part in ["limit cycles over contact.creepage.lateral", "squeal starts by itself", "stable cycles"] {
        assert!(one.good().out.contains(part), "{part:?} is not in\n{}", one.out);
    }
    let whole = open(folder.path("one.h5"));
    folder.call(2, "run", &["--reuse", &model, "--output", &folder.text("two.h5")]).good();
    assert_eq!(bits(&open(folder.path("two.h5"))), bits(&whole), "two ranks");
    let read = |name: &str| whole.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers");
    let (key, energy, frequency) = (read("cycles/key"), read("cycles/kinetic"), read("cycles/frequency"));
    let start = whole.dataset("cycles/start").and_then(|d| d.read_scalar::<i64>()).expect("start") as usize;
    assert!(key.len() > 5 && (key[start] - 0.014).abs() < 1e-12 && key.windows(2).all(|k| k[0] < k[1]), "{key:?}");
    // The same cycle, marched.
    let mut swept = job(quick());
    swept["analyses"] = json!({
        "modes": { "count": 6 },
        "stability": {},
        "sweep": {
            "keys": { "contact.creepage.lateral": [0.014] },
            "cycles": { "duration": 3.0, "settled": 0.001, "amplitude": 1e-5, "branches": ["mode"] }
        }
    });
    let beside = Folder::with(swept.to_string());
    beside.call(1, "run", &["--output", &beside.text("swept.h5")]).good();
    let file = open(beside.path("swept.h5"));
    let number = |name: &str| file.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers")[0];
    // The frequency of the march is low by (hω)²/12.
    let marched = number("sweep/cycles/frequency");
    let step = 1e-5 * 2.0 * std::f64::consts::PI * marched;
    let marched = marched * (1.0 + step * step / 12.0);
    assert!((frequency[start] / marched - 1.0).abs() < 2e-5, "{} Hz, marched {marched} Hz", frequency[start]);
    let kinetic = number("sweep/cycles/kinetic");
    assert!((energy[start] / kinetic - 1.0).abs() < 0.01, "{} J, marched {kinetic} J", energy[start]);
}

#[test]
fn what_no_branch_can_follow_is_refused() {
    let refused = |change: Value, code: i32, parts: &[&str]| {
        let mut cycles = quick();
        change.as_object().expect("keys").iter().for_each(|(k, v)| cycles[k] = v.clone());
        let folder = Folder::with(job(cycles).to_string());
        folder.call(1, "check", &[]).failed(code, parts);
    };
    let key = "bodies.lower.material.young";
    refused(json!({ "along": key }), 2, &["analyses.cycles.along", key, "friction", "creepage.lateral"]);
    refused(json!({ "from": 0.015 }), 2, &["analyses.cycles.from, to", "0.015 to 0.02", "0.014"]);
    refused(json!({ "samples": 32, "harmonics": 8 }), 2, &["analyses.cycles.samples", "found 32", "8 harmonics"]);
    refused(json!({ "march": { "theta": 0.6 } }), 2, &["analyses.cycles.march.theta", "0.6", "0.5"]);
    let mut stable = job(quick());
    stable["contact"]["creepage"]["lateral"] = json!(0.0041);
    let folder = Folder::with(stable.to_string());
    let parts = ["rest is stable at contact.creepage.lateral = 0.0041", "unstable mode"];
    folder.call(1, "run", &["--output", &folder.text("none.h5")]).failed(2, &parts);
}
