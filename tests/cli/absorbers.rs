//! Tuned absorbers, ring dampers and resilient wheels, in whole runs.

use super::program::*;
use serde_json::{json, Value};

fn numbers(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// `jobs/wheel-with-absorbers.json` with modes up to 1500 Hz and its stability alone.
fn with_absorbers() -> Value {
    let mut job = job("wheel-with-absorbers.json");
    job["analyses"] = json!({ "modes": { "max_frequency": 1500 }, "stability": {} });
    job
}

/// The wheel that squeals near 970 Hz is stable with absorbers that are tuned to it, on two ranks; so it is on one from
/// their reduced model, which other absorbers do not have.
#[test]
#[ignore = "long: scripts/validate long"]
fn absorbers_quieten_the_wheel_that_squeals() {
    let mut job = with_absorbers();
    let folder = Folder::with(job.to_string());
    let ran = folder.call(2, "run", &["--output", &folder.text("with.h5")]);
    for part in ["24 axial absorbers of", "tuned to", "up to 11 nodal diameters", "in all at", "with the loss factor"] {
        assert!(ran.good().out.contains(part), "{part}: {}", ran.out);
    }
    let with = numbers(&folder, "with.h5", "stability/growth_rate");
    assert!(with[0] < 0.0, "{with:?}");
    let reused = folder.text("with.h5");
    folder.call(1, "run", &["--output", &folder.text("again.h5"), "--reuse", &reused]).good();
    let there = numbers(&folder, "again.h5", "stability/growth_rate");
    let apart = with.iter().zip(&there).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(with.len() == there.len() && apart < 1e-5, "{with:?} {there:?}");
    let output = folder.text("other.h5");
    let other = ["--set", "bodies.upper.absorbers.0.loss_factor=0.1", "--reuse", &reused, "--output", &output];
    folder.call(1, "run", &other).failed(2, &["bodies.upper.absorbers", "--reuse"]);
    job["bodies"]["upper"].as_object_mut().expect("a body").remove("absorbers");
    let bare = Folder::with(job.to_string());
    bare.call(1, "run", &[]).good();
    let (growth, frequency) =
        (numbers(&bare, "job.h5", "stability/growth_rate"), numbers(&bare, "job.h5", "stability/frequency"));
    assert!(growth[0] > 1.0 && (frequency[0] - 970.0).abs() < 30.0, "{growth:?} {frequency:?}");
}

/// Steady rolling, receptance, a transient with its sound, with ring damper and absorbers, on wheels that roll;
/// continued after the end of its time to the last bit.
#[test]
fn every_analysis_takes_absorbers_and_ring_dampers() {
    let mut job = job("swept-curve.json");
    let place = json!({ "radius": 0.45, "y": -0.05 });
    job["bodies"]["upper"]["absorbers"] = json!([
        { "place": place, "direction": "axial", "mass": 20, "frequency": 420, "loss_factor": 0.2, "count": 12 },
        { "place": place, "direction": "radial", "mass": 10, "frequency": 600, "loss_factor": 0.2, "count": 9 }
    ]);
    job["bodies"]["upper"]["ring_dampers"] =
        json!([{ "place": place, "diameter": 0.02, "frequency": 1200, "loss_factor": 0.1 }]);
    job["contact"]["patch"] = json!({ "half_length": 0.0075, "half_width": 0.0075, "spacing": 0.0015 });
    job["analyses"] = json!({
        "modes": { "count": 18 },
        "steady": {},
        "stability": {},
        "receptance": { "frequency": [0, 300, 420] },
        "transient": {
            "duration": 0.1, "step": 2e-5, "start": { "mode": 1, "amplitude": 1e-7 }, "segment": 1700,
            "sound_power": { "min_frequency": 200, "max_frequency": 400, "from": 0.005 }
        }
    });
    job["output"] = json!({ "fields": false });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("one.h5")]);
    assert!(ran.good().out.contains("ring damper of wire of 20.00 mm"), "{}", ran.out);
    // The modes of the absorbers are among those of the wheel.
    let upper = numbers(&folder, "one.h5", "modes/upper/frequency");
    let lower = numbers(&folder, "one.h5", "modes/lower/frequency");
    assert!(upper[0] < 0.95 * lower[0], "{upper:?} {lower:?}");
    let output = folder.text("two.h5");
    folder.call(1, "run", &["--output", &output, "--wall-time", "0.01"]).failed(5, &["--resume"]);
    folder.call(1, "run", &["--resume", &output]).good();
    for name in ["transient/sound_power/upper/power", "stability/growth_rate", "modes/upper/frequency"] {
        assert_eq!(numbers(&folder, "one.h5", name), numbers(&folder, "two.h5", name), "{name}");
    }
}

/// A change of a job, and the words of what is said about it.
type Case<'c> = (&'c str, Value, &'c [&'c str]);

#[test]
fn absorbers_that_do_not_fit_are_refused_by_their_keys() {
    let ring = json!([{ "place": "rim", "diameter": 0.018, "frequency": 1500, "loss_factor": 0.1 }]);
    let cases: [Case; 8] = [
        ("absorbers.0.count", json!(2), &["bodies.upper.absorbers.0.count", "found 2"]),
        ("absorbers.0.mass", json!(-1), &["bodies.upper.absorbers.0.mass", "> 0"]),
        ("absorbers.0.mass", json!(4000), &["bodies.upper: absorbers", "% of the 338.2 kg", "far less than the wheel"]),
        ("absorbers.0.direction", json!("lateral"), &["bodies.upper.absorbers.0.direction", "axial"]),
        ("absorbers.0.place", json!("tread"), &["bodies.upper.absorbers.0.place"]),
        (
            "absorbers.0.place",
            json!({ "radius": 0.3, "y": -0.04 }),
            &[
                "bodies.upper.absorbers.0.place: found r = 0.3000 m, y = -0.0400 m",
                "nearest is r = 0.3000 m, y = -0.0120 m",
            ],
        ),
        (
            "ring_dampers",
            json!([{ "place": { "radius": 0.39, "y": 0.0 }, "diameter": 0.4, "frequency": 1500, "loss_factor": 0.1 }]),
            &["bodies.upper.ring_dampers.0.diameter", "0.4"],
        ),
        (
            "ring_dampers.0.place",
            json!({ "radius": 390, "y": -40 }),
            &["bodies.upper.ring_dampers.0.place: found r = 390"],
        ),
    ];
    for (key, value, words) in cases {
        let mut job = with_absorbers();
        job["bodies"]["upper"]["ring_dampers"] = ring.clone();
        let folder = Folder::with(job.to_string());
        let set = format!("bodies.upper.{key}={value}");
        folder.refused(1, &["--set", &set], 2, words);
    }
    let mut meshed = job("curve.json");
    meshed["bodies"]["upper"]["absorbers"] = with_absorbers()["bodies"]["upper"]["absorbers"].clone();
    Folder::with(meshed.to_string()).refused(1, &[], 2, &["bodies.upper.absorbers", "mesh.revolved"]);
    // Six of them near modes with three diameters.
    let folder = Folder::with(with_absorbers().to_string());
    let few = ["--set", "bodies.upper.absorbers.0.count=6"];
    folder.call(1, "run", &few).failed(2, &["bodies.upper.absorbers.0.count", "3 nodal diameters", "more than 6"]);
    let told = folder.call(
        1,
        "check",
        &["--set", "bodies.upper.absorbers.0.frequency=9.65", "--set", "bodies.upper.absorbers.0.mass=80"],
    );
    for part in ["were 9.65 kHz meant", "usual are 2 to 8 %"] {
        assert!(told.good().out.contains(part) || told.err.contains(part), "{part}: {told:?}");
    }
}

/// The tyre of the resilient wheel turns and moves on its ring of rubber, whose loss factor damps it.
#[test]
fn a_resilient_wheel_moves_on_its_rubber() {
    let mut job = job("resilient-wheel.json");
    let checked = Folder::with(job.to_string()).call(1, "check", &[]);
    assert!(checked.good().out.contains("body upper: mass"), "{}", checked.out);
    job["analyses"] = json!({ "modes": { "max_frequency": 600 }, "steady": {}, "stability": { "damping_ratio": 1 } });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let found = numbers(&folder, "job.h5", "modes/upper/frequency");
    for wanted in [107.0, 123.0] {
        assert!(found.iter().any(|f| (f / wanted - 1.0).abs() < 0.01), "{wanted} Hz: {found:?}");
    }
    // A mode that is all rubber has the loss factor 0.12: half of it is the damping ratio.
    let (growth, frequency) =
        (numbers(&folder, "job.h5", "stability/growth_rate"), numbers(&folder, "job.h5", "stability/frequency"));
    let ratio = |k: usize| -growth[k] / (2.0 * std::f64::consts::PI * frequency[k]).hypot(growth[k]);
    let damped = (0..growth.len()).filter(|&k| frequency[k] < 140.0 && frequency[k] > 90.0);
    assert!(
        damped.clone().count() > 0 && damped.clone().any(|k| (ratio(k) - 0.057).abs() < 0.01),
        "{growth:?} {frequency:?}"
    );
}
