//! Limit cycles over a sweep: the same on any number of ranks, and after a stop.

use super::interrupted::{signal, start, wait_until};
use super::program::*;
use super::transient::open;
use serde_json::{json, Value};
use std::path::Path;

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
    let number = |n: &&String| !["branch", "along", "message", "motion", "sound_power"].contains(&n.as_str());
    let of = |n: &String| {
        let values = group.dataset(n).expect("dataset").read_raw::<f64>().expect("numbers");
        (n.clone(), values.into_iter().map(f64::to_bits).collect())
    };
    let motions = ["displacement", "velocity", "period"].map(|name| format!("motion/{name}"));
    names.iter().filter(number).chain(&motions).map(of).collect()
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
    // One rule for both: what comes back is periodic, what does not is irregular.
    let crossings: Vec<i64> =
        whole.dataset("sweep/cycles/crossings").and_then(|d| d.read_raw()).expect("numbers of crossings");
    let agree = |(fate, crossings): (&i8, &i64)| match fate {
        1 => *crossings > 0,
        2 => *crossings == 0,
        _ => true,
    };
    assert!(fate.iter().zip(&crossings).all(agree), "{fate:?}, {crossings:?}");
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
    wait_until("a second point", &mut child, || done(&kept) >= 2);
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

/// Samples of a study are as loud as the limit cycle that a sweep gives at their values; stable ones are silent.
#[test]
#[ignore = "long: scripts/validate long"]
fn samples_are_as_loud_as_their_limit_cycles() {
    let mut cycles = quick();
    cycles["harmonics"] = json!(8);
    cycles["sound_power"] = json!({ "min_frequency": 200, "bodies": ["upper"] });
    let mut job = swept(cycles.clone());
    let analyses = job["analyses"].as_object_mut().expect("analyses");
    let mut sweep = analyses.remove("sweep").expect("sweep");
    cycles.as_object_mut().expect("cycles").remove("harmonics");
    cycles["samples"] = json!(4);
    let input = json!({
        "key": "contact.creepage.lateral", "distribution": { "uniform": { "from": 0.002, "to": 0.016 } }
    });
    let study = json!({
        "inputs": [input], "samples": 8, "method": "latin_hypercube", "indices": false, "cycles": cycles
    });
    analyses.insert("uncertainty".into(), study);
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("study.h5")]);
    for part in ["limit cycles", "of 4 samples squeal", "dB(A) of those that squeal", "one in twenty is louder than"] {
        assert!(ran.good().out.contains(part), "{part:?} is not in\n{}", ran.out);
    }
    for left in ["study.cycles", "study.uncertainty"] {
        assert!(!folder.path(left).exists(), "{left} is left");
    }
    let file = open(folder.path("study.h5"));
    let read = |name: &str| file.dataset(&format!("uncertainty/{name}")).and_then(|d| d.read_raw::<f64>());
    let numbers = |name: &str| read(name).unwrap_or_else(|e| panic!("{name}: {e}"));
    let creepages = numbers("values/contact.creepage.lateral");
    let unstable: Vec<i64> = file.dataset("uncertainty/unstable").and_then(|d| d.read_raw()).expect("numbers");
    let fate: Vec<i8> = file.dataset("uncertainty/cycles/fate").and_then(|d| d.read_raw()).expect("fates");
    let level = numbers("cycles/level_a");
    assert!(fate.len() == 4 && unstable.len() == 8, "{fate:?}, {unstable:?}");
    for k in 0..4 {
        assert_eq!((fate[k] > 0, level[k].is_finite()), (unstable[k] > 0, unstable[k] > 0), "{k}: {level:?}");
    }
    let loud = (0..4).find(|&k| fate[k] > 0).expect("one that squeals");
    let silent = fate.iter().position(|f| *f == 0).expect("one that is silent");
    assert_eq!(numbers("cycles/sound_power/upper/total_level_a")[silent], f64::NEG_INFINITY);
    assert!((numbers("cycles/force")[3 * silent + 2] / -70e3 - 1.0).abs() < 0.05);
    // Where the rest of all is stable, all is silent; what cannot be followed is refused before the samples are solved.
    let quiet = r#"analyses.uncertainty.inputs.0.distribution={"uniform":{"from":0.002,"to":0.0025}}"#;
    let ran = folder.call(1, "run", &["--set", quiet, "--output", &folder.text("quiet.h5")]);
    assert!(ran.good().out.contains("silence of 4 samples"), "{}", ran.out);
    let key = "analyses.uncertainty.cycles.step";
    let ran = folder.call(1, "run", &["--set", &format!("{key}=0.01"), "--output", &folder.text("refused.h5")]);
    ran.failed(2, &[key, "too long for the highest mode"]);
    let quantiles = numbers("cycles/quantiles");
    assert!(quantiles.windows(2).all(|q| q[0] <= q[1]) && quantiles[6] == level.iter().copied().fold(0.0, f64::max));

    sweep["keys"]["contact.creepage.lateral"] = json!([creepages[loud]]);
    sweep["cycles"]["branches"] = json!(["mode"]);
    let analyses = job["analyses"].as_object_mut().expect("analyses");
    analyses.remove("uncertainty");
    analyses.insert("sweep".into(), sweep);
    let single = Folder::with(job.to_string());
    single.call(1, "run", &["--output", &single.text("point.h5")]).good();
    let point = open(single.path("point.h5"));
    let of_sweep = |name: &str| point.dataset(&format!("sweep/cycles/{name}")).and_then(|d| d.read_raw::<f64>());
    let of_sweep = |name: &str| of_sweep(name).unwrap_or_else(|e| panic!("{name}: {e}"))[0];
    for name in ["frequency", "kinetic", "sound_power/upper/total_level_a"] {
        let (found, want) = (numbers(&format!("cycles/{name}"))[loud], of_sweep(name));
        assert!((found / want - 1.0).abs() < 1e-6, "{name}: {found} against {want}");
    }
}

/// A sweep with sound that was stopped has left its mode shapes: it goes on with them, and sounds the same.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_stopped_map_sounds_the_same() {
    let mut cycles = quick();
    cycles["sound_power"] = json!({ "min_frequency": 200, "bodies": ["upper"] });
    let folder = Folder::with(swept(cycles).to_string());
    folder.call(1, "run", &["--output", &folder.text("whole.h5")]).good();
    let whole = open(folder.path("whole.h5"));
    let sound = |file: &hdf5::File| -> Vec<u64> {
        let group = file.group("sweep/cycles/sound_power").expect("sound");
        assert!(!group.member_names().expect("names").contains(&"lower".into()), "the lower body was not asked for");
        let power: Vec<f64> = group.dataset("upper/power").and_then(|d| d.read_raw()).expect("power");
        power.into_iter().map(f64::to_bits).collect()
    };
    let (output, kept) = (folder.text("stopped.h5"), folder.path("stopped.cycles"));
    let job = folder.text("job.json");
    let mut child = start(std::process::Command::new(PROGRAM), &["run", &job, "--output", &output]);
    wait_until("a second point", &mut child, || done(&kept) >= 2);
    signal("TERM", child.id());
    assert_eq!(child.wait().expect("end").code(), Some(5));
    assert!(done(&kept) < 6, "all points were done before the stop");
    let model = folder.text("stopped.model.h5");
    let again = folder.call(1, "run", &["--reuse", &model, "--output", &output]);
    let text = again.good().err.clone();
    assert!(!text.contains("modes, body"), "{text}");
    let stopped = open(&output);
    assert_eq!(sound(&stopped), sound(&whole));
    assert_eq!(bits(&stopped), bits(&whole));
}

/// A point of the map beside a run of its own that nothing has shortened: amplitude, forces and their harmonics,
/// stick, frequency and sound.
#[test]
fn a_point_of_the_map_is_the_single_run() {
    let sound = json!({ "min_frequency": 200, "max_frequency": 600 });
    let cycles = json!({
        "branches": ["mode"], "duration": 3.0, "settled": 1e-3, "amplitude": 1e-5, "harmonics": 3, "sound_power": sound
    });
    let mut job = swept(cycles);
    job["analyses"]["sweep"]["keys"]["contact.creepage.lateral"] = json!([0.003, 0.016]);
    let folder = Folder::with(job.to_string());
    let map = folder.call(1, "run", &["--output", &folder.text("map.h5")]);
    assert!(map.good().out.contains("loudest") && map.out.contains("dB(A)"), "{}", map.out);
    let file = open(folder.path("map.h5"));
    let read = |name: &str| -> Vec<f64> {
        file.dataset(&format!("sweep/cycles/{name}"))
            .and_then(|d| d.read_raw())
            .unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    assert_eq!(read("fate"), [0.0, 1.0]);

    let from = 2.0;
    let mut single = job.clone();
    let analyses = single["analyses"].as_object_mut().expect("analyses");
    analyses.remove("sweep");
    let mut sound = sound;
    sound["from"] = json!(from);
    analyses.insert(
        "transient".into(),
        json!({ "duration": 2.5, "start": { "mode": 1, "amplitude": 1e-5 }, "sound_power": sound, "modal_stride": 0 }),
    );
    single["contact"]["creepage"]["lateral"] = json!(0.016);
    let alone = Folder::with(single.to_string());
    alone.call(1, "run", &["--output", &alone.text("one.h5")]).good();
    let one = open(alone.path("one.h5"));
    let numbers = |name: &str| -> Vec<f64> {
        one.dataset(&format!("transient/{name}")).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let time = numbers("time");
    let late: Vec<usize> = (0..time.len()).filter(|&i| time[i] > from).collect();
    // Under von Hann's window it hardly matters where a period begins.
    let count = late.len() as f64;
    let window = |n: usize| 2.0 * (std::f64::consts::PI * (n as f64 + 0.5) / count).sin().powi(2);
    let mean =
        |of: &dyn Fn(usize) -> f64| late.iter().enumerate().map(|(n, &i)| window(n) * of(i)).sum::<f64>() / count;
    let near = |what: &str, found: f64, wanted: f64, within: f64| {
        assert!((found - wanted).abs() <= within * wanted.abs(), "{what}: {found} in the map, {wanted} alone");
    };
    let (kinetic, force) = (numbers("kinetic"), numbers("force"));
    near("kinetic energy", read("kinetic")[1], mean(&|i| kinetic[i]), 4e-3);
    for c in 0..3 {
        let level = mean(&|i| force[3 * i + c]);
        let sway = mean(&|i| (force[3 * i + c] - level).powi(2)).sqrt();
        let found = read("force")[3 + c];
        assert!(
            (found - level).abs() < 2e-3 * sway + 1e-6 * level.abs(),
            "mean force {c}: {found}, {level} alone, {sway} N about it"
        );
        near(&format!("force {c}"), read("force_rms")[3 + c], sway, 4e-3);
        let frequency = read("frequency")[1];
        for k in 1..=3 {
            let turn = |i: usize| 2.0 * std::f64::consts::PI * k as f64 * frequency * time[i];
            let part = |of: &dyn Fn(f64) -> f64| 2.0 * mean(&|i| (force[3 * i + c] - level) * of(turn(i)));
            let line = part(&f64::cos).hypot(part(&f64::sin));
            let found = read("force_harmonics")[(3 + (k - 1)) * 3 + c];
            assert!((found - line).abs() < 4e-3 * sway, "line {k} of force {c}: {found} in the map, {line} alone");
        }
    }
    let (stick, closed) = (numbers("stick"), numbers("closed"));
    assert!((read("stick")[2] - mean(&|i| stick[i] / closed[i])).abs() < 2e-3, "{:?}", read("stick"));
    assert_eq!(read("sound_power/band_name"), numbers("sound_power/band_name"));
    for body in ["lower", "upper"] {
        for name in ["total_level", "total_level_a"] {
            let (found, wanted) =
                (read(&format!("sound_power/{body}/{name}")), numbers(&format!("sound_power/{body}/{name}"))[0]);
            assert!(
                found[0] == f64::NEG_INFINITY && (found[1] - wanted).abs() < 0.05,
                "{body}: {found:?} dB, {wanted} alone"
            );
        }
        let (power, wanted) =
            (read(&format!("sound_power/{body}/power")), numbers(&format!("sound_power/{body}/power")));
        let all: f64 = wanted.iter().sum();
        assert!(power.len() == 2 * wanted.len() && power[..wanted.len()].iter().all(|p| *p == 0.0), "{power:?}");
        for (found, wanted) in power[wanted.len()..].iter().zip(&wanted) {
            assert!(
                (found - wanted).abs() < 1e-2 * wanted + 1e-6 * all,
                "{body}: {found} W in a band, {wanted} W alone"
            );
        }
    }
    let root = env!("CARGO_MANIFEST_DIR");
    let venv = format!("{root}/.venv/bin/python");
    let python = if Path::new(&venv).exists() { venv } else { "python3".into() };
    let documented = format!("{root}/tests/python/documented.py");
    finish(std::process::Command::new(&python).args([&documented, &folder.text("map.h5")])).good();
    // Without mode shapes nothing sounds.
    folder
        .call(1, "run", &["--reuse", &folder.text("map.h5"), "--output", &folder.text("again.h5")])
        .failed(2, &["analyses.sweep.cycles.sound_power", "no mode shapes"]);
}

#[test]
fn what_cannot_be_followed_is_refused() {
    for (cycles, parts) in [
        (json!({ "along": "contact.speed" }), ["cycles.along", "contact.creepage.lateral"]),
        (json!({ "branches": ["up", "up"] }), ["cycles.branches", "\"up\" twice"]),
        (json!({ "branches": ["left"] }), ["branches.0", "left"]),
        (json!({ "duration": 1e-6 }), ["cycles.duration", "at least one step"]),
        (json!({ "sound_power": { "from": 1 } }), ["cycles.sound_power.from", "expected none"]),
        (json!({ "sound_power": { "bodies": [] } }), ["cycles.sound_power.bodies", "\"lower\""]),
    ] {
        Folder::with(swept(cycles).to_string()).refused(1, &[], 2, &parts);
    }
    let mut job = swept(json!({}));
    job["contact"]["roughness"] = json!({ "lower": [{ "spectrum": { "levels": "ISO3095", "seed": 1 } }] });
    Folder::with(job.to_string()).refused(1, &[], 2, &["cycles", "no motion repeats itself"]);
}

/// At 1 % creepage the wave of the pair of modes that is not on the cycle dies out beside it, over some seconds: the
/// motion is periodic, with energy and lateral force of a run that nothing shortens.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_beat_that_dies_out_is_no_irregular_motion() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/limit-cycles.json");
    let mut job: Value = serde_json::from_slice(&std::fs::read(path).expect("the job")).expect("JSON");
    let cycles = json!({ "duration": 8, "branches": ["mode"], "harmonics": 3 });
    job["analyses"]["sweep"] = json!({ "keys": { "contact.creepage.lateral": [0.01] }, "cycles": cycles });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &["--output", &folder.text("one.h5")]).good();
    let file = open(folder.path("one.h5"));
    let read = |name: &str| -> Vec<f64> {
        file.dataset(&format!("sweep/cycles/{name}")).and_then(|d| d.read_raw()).expect("numbers")
    };
    assert_eq!((read("fate"), read("crossings")), (vec![1.0], vec![1.0]), "apart {:?}", read("apart"));
    let (energy, lateral) = (read("kinetic")[0] / 0.1690, read("force_rms")[1] / 153.5);
    assert!((energy - 1.0).abs() < 2e-3 && (lateral - 1.0).abs() < 5e-3, "energy {energy}, lateral force {lateral}");
}
