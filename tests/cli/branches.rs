//! Branches of limit cycles: the same on any number of ranks, beside marching, and what is refused.

use super::interrupted::{signal, start, wait_until};
use super::program::*;
use super::transient::open;
use serde_json::{json, Value};

/// Lateral sliding on a coarse mesh.
pub(super) fn job(cycles: Value) -> Value {
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

pub(super) fn quick() -> Value {
    json!({
        "along": "contact.creepage.lateral", "from": 0.004, "to": 0.02, "most": 4, "harmonics": 4, "samples": 120,
        "starts": { "modes": 1 }, "march": { "duration": 1.0, "settled": 0.01, "amplitude": 1e-5 }
    })
}

/// All numbers of the branch, as they are.
fn bits(file: &hdf5::File) -> Vec<(String, Vec<u64>)> {
    let group = file.group("cycles").expect("group");
    let of = |name: &str| {
        let values = group.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers");
        (name.to_owned(), values.into_iter().map(f64::to_bits).collect())
    };
    let names =
        ["key", "frequency", "kinetic", "force", "velocity_rms", "onset/key", "motion/coefficient", "motion/reaction"];
    names.map(of).to_vec()
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
    let start = whole.dataset("cycles/start").and_then(|d| d.read_raw::<i64>()).expect("start")[0] as usize;
    assert!(key.len() > 5 && (key[start] - 0.014).abs() < 1e-12 && key.windows(2).all(|k| k[0] < k[1]), "{key:?}");
    // The same cycle, marched, and the sound of both.
    let sound = json!({ "min_frequency": 200, "max_frequency": 600 });
    let mut swept = job(quick());
    swept["analyses"] = json!({
        "modes": { "count": 6 },
        "stability": {},
        "sweep": {
            "keys": { "contact.creepage.lateral": [0.014] },
            "cycles": {
                "duration": 3.0, "settled": 0.001, "amplitude": 1e-5, "branches": ["mode"], "sound_power": sound
            }
        }
    });
    // Alone and with its sound, in the same run.
    swept["analyses"]["cycles"] = quick();
    for (key, value) in [("most", json!(1)), ("stability", json!(false)), ("sound_power", sound)] {
        swept["analyses"]["cycles"][key] = value;
    }
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
    let numbers = |name: &str| file.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers");
    let place = file.dataset("cycles/start").and_then(|d| d.read_raw::<i64>()).expect("start")[0] as usize;
    assert_eq!(numbers("cycles/sound_power/band_name"), numbers("sweep/cycles/sound_power/band_name"));
    for body in ["lower", "upper"] {
        let of = |name: &str| numbers(&format!("{name}/sound_power/{body}/power"));
        let (power, marched) = (of("cycles"), of("sweep/cycles"));
        // The first harmonic, in the third octave of 400 Hz, has all of it but for the waves that die out in the march.
        let own = &power[marched.len() * place..marched.len() * (place + 1)];
        let loudest = (0..own.len()).max_by(|&a, &b| own[a].total_cmp(&own[b])).expect("bands");
        assert!(own[loudest] > 0.1 && (own[loudest] / marched[loudest] - 1.0).abs() < 0.01, "{own:?} {marched:?}");
        for level in ["total_level", "total_level_a", "pressure_level_a"] {
            let [own, marched] = [("cycles", place), ("sweep/cycles", 0)]
                .map(|(group, place)| numbers(&format!("{group}/sound_power/{body}/{level}"))[place]);
            assert!((own - marched).abs() < 0.05, "{body}, {level}: {own} dB, marched {marched} dB");
        }
    }
}

/// Cycles that are kept of the branches of a run.
fn kept(folder: &std::path::Path) -> u64 {
    let sizes = std::fs::read_dir(folder).map(|d| {
        let files = d.flatten().filter(|e| e.path().extension().is_some_and(|x| x == "points"));
        files.filter_map(|e| e.metadata().ok()).map(|m| m.len()).sum()
    });
    sizes.unwrap_or(0)
}

/// A stopped run goes on to the same bits, on other ranks too, without a job; so does one that was killed.
#[test]
fn a_stopped_branch_goes_on_to_the_same_bits() {
    let folder = Folder::with(job(quick()).to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("whole.h5")]).good();
    let whole = open(folder.path("whole.h5"));
    assert!(!folder.path("whole.branches").exists());
    let (text, output) = (folder.text("job.json"), folder.text("stopped.h5"));
    let place = folder.path("stopped.branches");
    let mut sizes = Vec::new();
    for (name, target) in [("TERM", "--output"), ("KILL", "--resume")] {
        let args = ["run", &text, "--reuse", &model, target, &output];
        let mut child = start(std::process::Command::new(PROGRAM), &args);
        let before = kept(&place);
        wait_until("a further cycle", &mut child, || kept(&place) > before);
        signal(name, child.id());
        let status = child.wait().expect("end");
        assert!(name == "KILL" || status.code() == Some(5), "{status:?}");
        assert!(!folder.path("stopped.h5").exists());
        sizes.push(kept(&place));
    }
    assert!(sizes[0] < sizes[1], "{sizes:?}");
    let ran = railsqueal(2, &["run", "--reuse", &model, "--resume", &output]);
    ran.good();
    assert_eq!(bits(&open(folder.path("stopped.h5"))), bits(&whole), "after a stop");
    assert!(!place.exists());
}

/// Small cycles at the threshold of rest, and a cycle of an earlier result, lead to the branch that is marched to.
#[test]
fn other_starts_lead_to_the_same_branch() {
    let folder = Folder::with(job(quick()).to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("first.h5")]).good();
    let first = open(folder.path("first.h5"));
    let read = |file: &hdf5::File, name: &str| file.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers");
    let (keys, energies) = (read(&first, "cycles/key"), read(&first, "cycles/kinetic"));
    // From a cycle at another value of the key than that of the job, alone.
    let mut cycles = quick();
    cycles["most"] = json!(1);
    cycles["starts"] = json!({ "modes": 0, "results": [{ "file": folder.text("first.h5"), "cycle": 1 }] });
    let other = Folder::with(job(cycles).to_string());
    other.call(1, "run", &["--reuse", &model, "--output", &other.text("second.h5")]).good();
    let second = open(other.path("second.h5"));
    let start = second.dataset("cycles/start").and_then(|d| d.read_raw::<i64>()).expect("start")[0] as usize;
    let (key, energy) = (read(&second, "cycles/key")[start], read(&second, "cycles/kinetic")[start]);
    assert!((key - keys[1]).abs() < 1e-12 && (energy / energies[1] - 1.0).abs() < 1e-6, "{key} {energy}");
    // Marched, in the place of a motion of growing amplitude, alone: its first step lies at another phase of the cycle.
    let mut cycles = quick();
    (cycles["most"], cycles["starts"]["by"]) = (json!(1), json!("march"));
    let other = Folder::with(job(cycles).to_string());
    other.call(1, "run", &["--reuse", &model, "--output", &other.text("march.h5")]).good();
    let own = open(other.path("march.h5"));
    let at = |file: &hdf5::File| {
        let start = file.dataset("cycles/start").and_then(|d| d.read_raw::<i64>()).expect("start")[0] as usize;
        ["key", "kinetic", "frequency"].map(|name| read(file, &format!("cycles/{name}"))[start])
    };
    let (ours, theirs) = (at(&own), at(&first));
    assert!((0..3).all(|k| (ours[k] / theirs[k] - 1.0).abs() < 1e-4), "{ours:?} {theirs:?}");
    // Beside the other one it is recognised.
    let mut cycles = quick();
    cycles["starts"] = json!({ "modes": 1, "results": [{ "file": folder.text("first.h5"), "cycle": 1 }] });
    let both = Folder::with(job(cycles).to_string());
    let ran = both.call(2, "run", &["--reuse", &model, "--output", &both.text("both.h5")]);
    assert!(ran.good().out.contains("the same branch"), "{}", ran.out);
    assert_eq!(bits(&open(both.path("both.h5"))), bits(&first));
    // A place that is not there, and another key.
    let refused = |change: Value, along: &str, parts: &[&str]| {
        let mut cycles = quick();
        cycles["along"] = json!(along);
        if along == "contact.friction" {
            (cycles["from"], cycles["to"]) = (json!(0.2), json!(0.4));
        }
        cycles["starts"] = json!({ "results": [change] });
        let folder = Folder::with(job(cycles).to_string());
        folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("none.h5")]).failed(3, parts);
    };
    let file = folder.text("first.h5");
    let lateral = "contact.creepage.lateral";
    refused(json!({ "file": file, "cycle": 99 }), lateral, &["results[0]", "the number 99", "cycles"]);
    refused(json!({ "file": file, "cycle": 0 }), "contact.friction", &["results[0]", lateral, "contact.friction"]);
    refused(json!({ "file": model, "cycle": 0 }), lateral, &["results[0]", "found neither /cycles/motion"]);
}

/// A branch ends where its range does; under a large load the contact opens and closes at nodes in the period.
#[test]
fn a_branch_over_the_load_ends_with_its_range() {
    let mut cycles = quick();
    cycles["along"] = json!("contact.normal_load");
    (cycles["from"], cycles["to"], cycles["most"]) = (json!(280e3), json!(305e3), json!(30));
    cycles["stability"] = json!(false);
    cycles["longest"] = json!(1.0);
    let mut job = job(cycles);
    job["contact"]["patch"] = json!({ "half_length": 0.0085, "half_width": 0.0085 });
    job["contact"]["normal_load"] = json!(300e3);
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("end.h5")]);
    let out = &ran.good().out;
    for part in
        ["= 280000.0000000, at the end of the range", "= 305000.0000000, at the end of the range", "first opening"]
    {
        assert!(out.contains(part), "no {part:?} in\n{out}");
    }
}

/// Over the radius creepages and loads are those of the vehicle: at the radius of the job its cycle over the friction,
/// at another one that of a job with this radius, but for its place of contact.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_branch_over_the_radius_has_the_creepages_of_the_curve() {
    let job = |cycles: Value, radius: f64| {
        let mut job = super::program::job("wheel-on-rail.json");
        job["curve"]["radius"] = json!(radius);
        let mut cycles = cycles;
        for (key, value) in [
            ("most", json!(3)),
            ("harmonics", json!(3)),
            ("samples", json!(80)),
            ("stability", json!(false)),
            ("starts", json!({ "modes": 1 })),
        ] {
            cycles[key] = value;
        }
        job["analyses"] = json!({ "modes": { "max_frequency": 400 }, "stability": {}, "cycles": cycles });
        job["output"] = json!({ "fields": false });
        job
    };
    let folder = Folder::with(job(json!({ "along": "curve.radius", "from": 95, "to": 105 }), 100.0).to_string());
    let ran = folder.call(2, "run", &[]);
    for part in ["limit cycles over curve.radius", "33 equilibria of the vehicle between 95.0 and 105.0 m"] {
        assert!(ran.good().out.contains(part), "{part:?} is not in\n{}", ran.out);
    }
    // The cycle that a branch begins with, or its last one.
    let cycle = |folder: &Folder, last: bool| {
        let file = open(folder.path("job.h5"));
        let read = |name: &str| file.dataset(&format!("cycles/{name}")).and_then(|d| d.read_raw::<f64>()).expect(name);
        let start = file.dataset("cycles/start").and_then(|d| d.read_raw::<i64>()).expect("start")[0] as usize;
        let at = if last { read("key").len() - 1 } else { start };
        [("key", 1), ("frequency", 1), ("kinetic", 1), ("normal", 2)].map(|(name, width)| read(name)[width * at])
    };
    let [begin, end] = [false, true].map(|last| cycle(&folder, last));
    assert!((begin[0] - 100.0).abs() < 1e-9 && end[0] > 101.0, "{begin:?} {end:?}");
    assert!((end[2] / begin[2] - 1.0).abs() > 0.02, "{begin:?} {end:?}");
    for over_radius in [begin, end] {
        let over_friction = json!({ "along": "contact.friction", "from": 0.39, "to": 0.41 });
        let beside = Folder::with(job(over_friction, over_radius[0]).to_string());
        beside.call(1, "run", &[]).good();
        let found = cycle(&beside, false);
        assert!((found[0] - 0.4).abs() < 1e-12, "{found:?}");
        println!("{over_radius:?}, by itself {found:?}");
        for (a, b) in over_radius[1..].iter().zip(&found[1..]) {
            assert!((a / b - 1.0).abs() < 1e-4, "{over_radius:?}, by itself {found:?}");
        }
    }
}

/// A job whose creepages do not follow from a curve has no branch over its radius.
#[test]
fn a_branch_over_the_radius_needs_a_curve() {
    let mut other = super::program::job("squeal-branch.json");
    other["analyses"]["cycles"]["along"] = json!("curve.radius");
    Folder::with(other.to_string()).call(1, "check", &[]).failed(2, &["analyses.cycles.along", "curve.radius"]);
}

/// Damping, and the speed of bodies that rotate, change the modes along the branch: a cycle on it is that of a job with
/// this damping or speed.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_branch_over_damping_or_speed_has_the_modes_of_each_value() {
    for (key, pointer, [from, to]) in [
        ("bodies.upper.damping.beta", "/bodies/upper/damping/beta", [2e-7, 3e-6]),
        ("contact.speed", "/contact/speed", [8.0, 12.0]),
    ] {
        let turned = |cycles: Value| {
            let mut job = job(cycles);
            for body in ["lower", "upper"] {
                job["bodies"][body]["rotation"] = json!("rolling");
            }
            job
        };
        let mut cycles = quick();
        (cycles["along"], cycles["from"], cycles["to"], cycles["most"]) =
            (json!(key), json!(from), json!(to), json!(3));
        let folder = Folder::with(turned(cycles).to_string());
        let ran = folder.call(1, "run", &[]);
        assert!(ran.good().out.contains(&format!("limit cycles over {key}")), "{}", ran.out);
        let read = |folder: &Folder, at: Option<usize>| -> [f64; 3] {
            let file = open(folder.path("job.h5"));
            let start = file.dataset("cycles/start").and_then(|d| d.read_raw::<i64>()).expect("start")[0] as usize;
            ["key", "frequency", "kinetic"].map(|name| {
                let all = file.dataset(&format!("cycles/{name}")).and_then(|d| d.read_raw::<f64>()).expect("numbers");
                all[at.map_or(start, |at| at.min(all.len() - 1))]
            })
        };
        let (begin, end) = (read(&folder, None), read(&folder, Some(usize::MAX)));
        assert!((end[0] / begin[0] - 1.0).abs() > 1e-3, "{key}: {begin:?} {end:?}");
        let mut other = quick();
        (other["most"], other["stability"]) = (json!(1), json!(false));
        let mut job = turned(other);
        *job.pointer_mut(pointer).expect("the key") = json!(end[0]);
        let beside = Folder::with(job.to_string());
        beside.call(1, "run", &[]).good();
        let found = read(&beside, None);
        assert!((1..3).all(|k| (found[k] / end[k] - 1.0).abs() < 1e-4), "{key}: {end:?}, by itself {found:?}");
    }
}

/// Stable cycles of `jobs/limit-cycles.json` at three creepages beside those that are marched.
#[test]
#[ignore = "long: scripts/validate long"]
fn branches_have_the_cycles_that_are_marched() {
    let creepages = json!([0.008, 0.01, 0.012]);
    let mut job = super::program::job("limit-cycles.json");
    job["analyses"] = json!({
        "modes": { "count": 40 },
        "stability": {},
        "cycles": {
            "along": "contact.creepage.lateral", "from": 0.0075, "to": 0.0125, "most": 1, "longest": 0.02,
            "starts": { "modes": 1, "at": creepages }
        },
        "sweep": {
            "keys": { "contact.creepage.lateral": creepages },
            "cycles": { "duration": 8.0, "branches": ["mode"] }
        }
    });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let file = open(folder.path("job.h5"));
    let numbers = |name: &str| file.dataset(name).and_then(|d| d.read_raw::<f64>()).expect("numbers");
    let whole = |name: &str| file.dataset(name).and_then(|d| d.read_raw::<i64>()).expect("numbers");
    let starts = whole("cycles/start");
    assert_eq!(starts.len(), 3);
    for (k, &start) in starts.iter().enumerate() {
        let own = |name: &str| numbers(&format!("cycles/{name}"))[start as usize];
        let marched = |name: &str| numbers(&format!("sweep/cycles/{name}"))[k];
        assert!((own("key") - creepages[k].as_f64().expect("a number")).abs() < 1e-12);
        assert_eq!(whole("cycles/unstable")[start as usize], 0);
        // The frequency of the march is low by (hω)²/12.
        let step = 1e-5 * 2.0 * std::f64::consts::PI * marched("frequency");
        let frequency = marched("frequency") * (1.0 + step * step / 12.0);
        let apart = [own("frequency") / frequency - 1.0, own("kinetic") / marched("kinetic") - 1.0];
        println!("{}: frequency {:.1e}, energy {:.1e}", creepages[k], apart[0], apart[1]);
        assert!(apart[0].abs() < 1e-5 && apart[1].abs() < 5e-3, "{}: {apart:?}", creepages[k]);
    }
}

/// A branch that leaves the range of the model ends there with the reason, which names the key to change, and the run
/// ends well; one that no start leads to ends the run with code 4 and the keys to change.
#[test]
fn ends_and_failures_of_branches_name_the_key_to_change() {
    let mut cycles = quick();
    for (key, value) in [
        ("along", json!("contact.normal_load")),
        ("from", json!(50e3)),
        ("to", json!(2e6)),
        ("most", json!(30)),
        ("longest", json!(1.0)),
        ("stability", json!(false)),
        ("harmonics", json!(3)),
        ("samples", json!(80)),
    ] {
        cycles[key] = value;
    }
    let folder = Folder::with(job(cycles).to_string());
    let ran = folder.call(1, "run", &[]);
    let end = "where the model ends: contact.patch: the contact reaches the border of the patch";
    for part in [end, "enlarge contact.patch.half_length and contact.patch.half_width", "at the end of the range"] {
        assert!(ran.good().out.contains(part), "no {part:?} in\n{}", ran.out);
    }
    let file = open(folder.path("job.h5"));
    let ends = file.dataset("cycles/end").and_then(|d| d.read_raw::<hdf5::types::VarLenUnicode>()).expect("ends");
    assert!(ends.iter().any(|e| e.as_str().starts_with(end)), "{ends:?}");
    // The march ends long before its motion has grown.
    let mut cycles = quick();
    cycles["starts"]["by"] = json!("march");
    cycles["march"]["duration"] = json!(0.02);
    let folder = Folder::with(job(cycles).to_string());
    let parts = [
        "analyses.cycles: none of 1 starts led to a cycle",
        "the first, unstable mode 1 at contact.creepage.lateral = 0.014",
        "falls back to rest",
        "analyses.cycles.march.duration",
        "analyses.cycles.starts (modes, at)",
    ];
    folder.call(1, "run", &[]).failed(4, &parts);
}

#[test]
fn what_no_branch_can_follow_is_refused() {
    let refused = |change: Value, code: i32, parts: &[&str]| {
        let mut cycles = quick();
        change.as_object().expect("keys").iter().for_each(|(k, v)| cycles[k] = v.clone());
        let folder = Folder::with(job(cycles).to_string());
        folder.call(1, "check", &[]).failed(code, parts);
    };
    for key in ["bodies.lower.material.young", "bodies.lower.mesh.cylinder.thickness", "contact.patch.half_length"] {
        let parts = ["analyses.cycles.along", key, "friction", "creepage.lateral", "bodies.upper.damping"];
        refused(json!({ "along": key }), 2, &parts);
    }
    for (key, meant) in [
        ("contact.creepage.latteral", "contact.creepage.lateral"),
        ("contact.lateral", "contact.creepage.lateral"),
        ("contact.frction", "contact.friction"),
    ] {
        refused(json!({ "along": key }), 2, &[key, &format!("; did you mean \"{meant}\"?")]);
    }
    let other = "bodies.upper.damping.modal.by_diameter.2";
    refused(json!({ "along": other }), 2, &["analyses.cycles.along", other, "a number"]);
    refused(json!({ "starts": { "at": [0.5] } }), 2, &["analyses.cycles.starts.at", "found 0.5", "0.004 to 0.02"]);
    refused(json!({ "starts": { "modes": 0 } }), 2, &["analyses.cycles.starts.modes", "at least one start"]);
    refused(json!({ "sound_power": { "from": 1.0 } }), 2, &["analyses.cycles.sound_power.from", "a period"]);
    refused(json!({ "from": 0.015 }), 2, &["analyses.cycles.from, to", "0.015 to 0.02", "0.014"]);
    refused(json!({ "samples": 32, "harmonics": 8 }), 2, &["analyses.cycles.samples", "found 32", "8 harmonics"]);
    refused(json!({ "march": { "theta": 0.6 } }), 2, &["analyses.cycles.march.theta", "0.6", "0.5"]);
    // Contact points of matrices: no key of theirs, and not without stability.
    let points = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/belt.json");
    let analyses = json!({
        "modes": { "count": 2 },
        "cycles": { "along": "contact.points.0.slip_velocity", "from": 0.02, "to": 0.3, "most": 3 }
    });
    let set = format!("analyses={analyses}");
    railsqueal(1, &["check", points, "--set", &set])
        .failed(2, &["analyses.stability: missing", "analyses.cycles.along"]);
    let mut stable = job(quick());
    stable["contact"]["creepage"]["lateral"] = json!(0.0041);
    let folder = Folder::with(stable.to_string());
    let parts = ["rest is stable at contact.creepage.lateral = 0.0041", "unstable mode"];
    folder.call(1, "run", &["--output", &folder.text("none.h5")]).failed(2, &parts);
}

/// The motion of the bodies over the period of some cycles, as ParaView plays it: its velocity where the bodies touch
/// is the one that the table of the cycles has.
#[test]
fn cycles_move_the_bodies_of_the_sequence() {
    let mut wanted = quick();
    (wanted["every"], wanted["most"], wanted["stability"]) = (json!(2), json!(2), json!(false));
    let mut job = job(wanted);
    job["output"] = json!({ "fields": true });
    let folder = Folder::with(job.to_string());
    folder.call(2, "run", &[]).good();
    let (table, file) = (open(folder.path("job.h5")), open(folder.path("job.cycles.vtkhdf")));
    let numbers = |file: &hdf5::File, name: &str| -> Vec<f64> {
        file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let places: Vec<i64> = table.dataset("cycles/period/point").and_then(|d| d.read_raw()).expect("places");
    let (points, body) = (numbers(&file, "VTKHDF/Points"), numbers(&file, "VTKHDF/PointData/body"));
    let motion = numbers(&file, "VTKHDF/PointData/displacement");
    let (count, phases) = (points.len() / 3, 24);
    assert!(places.len() >= 2, "{places:?}");
    assert_eq!(motion.len(), 3 * count * phases * places.len());
    assert_eq!(numbers(&file, "VTKHDF/Steps/Values").len(), phases * places.len());
    let (frequency, velocity) = (numbers(&table, "cycles/frequency"), numbers(&table, "cycles/velocity_rms"));
    for (k, &place) in places.iter().enumerate() {
        assert_eq!(numbers(&file, "cycles/frequency")[k * phases], frequency[place as usize]);
        for (b, number) in [1.0, 2.0].into_iter().enumerate() {
            let far = |p: &usize| points[3 * p..3 * p + 3].iter().map(|x| x * x).sum::<f64>();
            let node = (0..count).filter(|&p| body[p] == number).min_by(|p, q| far(p).total_cmp(&far(q)));
            let node = node.expect("a node");
            let at = |phase: usize| motion[3 * ((k * phases + phase) * count + node) + 1];
            let mean = (0..phases).map(at).sum::<f64>() / phases as f64;
            let rms = ((0..phases).map(|p| at(p).powi(2)).sum::<f64>() / phases as f64).sqrt();
            assert!(mean.abs() < 1e-5 * rms, "{mean} m of {rms} m");
            let (found, want) = (
                2.0 * std::f64::consts::PI * frequency[place as usize] * rms,
                velocity[6 * place as usize + 3 * b + 1],
            );
            // Higher harmonics have more of the velocity than of the displacement.
            assert!((found / want - 1.0).abs() < 0.05, "cycle {place}, body {number}: {found} m/s, {want} m/s");
        }
    }
}
