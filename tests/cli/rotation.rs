//! Bodies that rotate, in whole runs.

use super::program::*;
use serde_json::{json, Value};

fn numbers(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn close(what: &str, a: &[f64], b: &[f64], relative: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    let scale = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart <= relative * scale, "{what}: {apart:e} of {scale:e}");
}

/// Two wheels that roll, in full lateral sliding, unlike in the place of the contact.
fn rolling() -> Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
        job["bodies"][body]["rotation"] = json!("rolling");
        job["bodies"][body]["damping"] = json!({ "alpha": 1.0, "beta": 1e-6 });
    }
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    job["analyses"] = json!({ "modes": { "count": 24 }, "stability": {} });
    job["output"] = json!({ "fields": false });
    job
}

/// The same with stability of the full system beside that of the modes.
fn rolling_in_full() -> Value {
    let mut job = rolling();
    job["analyses"]["stability"] = json!({ "full": { "max_frequency": 1000, "count": 10 } });
    job["output"] = json!({});
    job
}

/// Reduced and full analysis have the same spectrum on 1 and on 2 ranks.
#[test]
#[ignore = "long: scripts/validate long"]
fn wheels_that_roll_have_the_same_spectrum_on_two_ranks() {
    let folder = Folder::with(rolling_in_full().to_string());
    folder.call(1, "run", &["--output", &folder.text("one.h5")]).good();
    folder.call_alone(2, "run", &["--output", &folder.text("two.h5")]).good();
    for name in ["stability/growth_rate", "stability/frequency"] {
        close(name, &numbers(&folder, "two.h5", name), &numbers(&folder, "one.h5", name), 1e-7);
    }
}

/// Reduced and full analysis agree, what growth is made of adds up to it, waves have their direction. And rotation
/// matters: the same job at rest has other growth rates.
#[test]
fn stability_of_wheels_that_roll() {
    let mut job = rolling_in_full();
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("one.h5")]);
    assert!(ran.good().out.contains("waves at 20.000 rad/s"), "{}", ran.out);
    let [growth, frequency, partner] =
        ["growth_rate", "frequency", "partner"].map(|n| numbers(&folder, "one.h5", &format!("stability/{n}")));
    let full: Vec<usize> = (0..growth.len()).filter(|&i| partner[i] >= 0.0 && partner[i] < i as f64).collect();
    assert!(full.len() >= 8, "{} pairs", full.len());
    let diameters = numbers(&folder, "one.h5", "stability/diameters");
    for &i in &full {
        let j = partner[i] as usize;
        let apart = [growth[i] - growth[j], std::f64::consts::TAU * (frequency[i] - frequency[j])];
        assert!(
            apart[0].hypot(apart[1]) < 5e-4 * std::f64::consts::TAU * frequency[i],
            "{} Hz: {apart:?}",
            frequency[i]
        );
        for body in 0..2 {
            let [a, b] = [i, j].map(|k| diameters[2 * k + body]);
            assert!((a - b).abs() < 0.05, "{} Hz: {a} and {b} nodal diameters", frequency[i]);
        }
    }
    assert!(diameters.iter().any(|d| *d > 0.8) && diameters.iter().any(|d| *d < -0.8), "{diameters:?}");
    // The identity of the energies, for the motions that are written: those of the full system.
    let (shape, parts) =
        (numbers(&folder, "one.h5", "stability/shape"), numbers(&folder, "one.h5", "stability/growth_parts"));
    assert!(!shape.is_empty());
    for (i, parts) in shape.iter().zip(parts.chunks_exact(3)) {
        let (sum, growth) = (parts.iter().sum::<f64>(), growth[*i as usize]);
        let largest = parts.iter().fold(0.0f64, |m, p| m.max(p.abs()));
        assert!((sum - growth).abs() < 1e-6 * largest, "{parts:?} make {growth}");
    }
    // Waves of the wheels, seen from beside them: a pair of n nodal diameters about gΩ up and down, g near n.
    let [rest, wave, turned] = ["frequency", "wave_frequency", "wave_diameters"]
        .map(|n| numbers(&folder, "one.h5", &format!("modes/lower/{n}")));
    let n = numbers(&folder, "one.h5", "modes/lower/diameters");
    let first = (0..n.len()).find(|&k| (n[k] - 1.0).abs() < 0.05).expect("a mode of one nodal diameter");
    let of = |sign: f64| {
        let near = |k: &usize| (turned[*k] - sign).abs() < 0.1;
        let apart = |k: usize| (wave[k] - rest[first]).abs();
        wave[(0..wave.len()).filter(near).min_by(|a, b| apart(*a).total_cmp(&apart(*b))).expect("a wave")]
    };
    let split = 0.5 * (of(1.0) - of(-1.0));
    assert!((split / (20.0 / std::f64::consts::TAU) - 1.0).abs() < 0.1, "split {split} Hz");

    for body in ["lower", "upper"] {
        job["bodies"][body]["rotation"] = json!("none");
    }
    job["analyses"]["stability"] = json!({});
    let still = Folder::with(job.to_string());
    still.call(1, "run", &[]).good();
    let largest = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let rest = largest(&numbers(&still, "job.h5", "stability/growth_rate"));
    assert!((rest - growth[0]).abs() > 0.05 * rest.abs(), "at rest {rest}, rolling {} 1/s", growth[0]);
    let file = hdf5::File::open(still.path("job.h5")).expect("result file");
    assert!(!file.link_exists("stability/diameters") && !file.link_exists("modes/lower/wave_frequency"));
}

/// Speeds of a sweep turn the bodies faster, without new finite elements, and give what runs of their own give.
/// Reused, too.
#[test]
fn a_sweep_over_the_speed_turns_the_bodies() {
    let job = rolling();
    let folder = Folder::with(job.to_string());
    let (first, sweep) = (folder.text("first.h5"), folder.text("sweep.h5"));
    folder.call(1, "run", &["--output", &first]).good();
    let keys = "analyses.sweep={\"keys\":{\"contact.speed\":[5, 20]}}";
    let ran = folder.call(2, "run", &["--set", keys, "--reuse", &first, "--output", &sweep]);
    assert!(!ran.good().err.contains("meshing") && !ran.err.contains("factorisation"), "{}", ran.err);
    let most = numbers(&folder, "sweep.h5", "sweep/growth_rate");
    let width = most.len() / 2;
    for (row, speed) in most.chunks_exact(width).zip([5, 20]) {
        let own = format!("own{speed}.h5");
        folder.call(1, "run", &["--set", &format!("contact.speed={speed}"), "--output", &folder.text(&own)]).good();
        let alone = numbers(&folder, &own, "stability/growth_rate");
        assert!((row[0] - alone[0]).abs() < 1e-6 * alone[0].abs().max(1.0), "{speed} m/s: {row:?}, {alone:?}");
    }
    assert!((most[0] - most[width]).abs() > 0.02 * most[0].abs(), "{most:?}");
    // A body that is at rest now has no rotation in the file, and the other way round.
    let still = ["--set", "bodies.upper.rotation=none", "--reuse", &first, "--output", &folder.text("no.h5")];
    folder.call(1, "run", &still).failed(2, &["--reuse", "bodies.upper.axle"]);
}

/// Mirror images stay stable at any speed: by symmetry the normal force does not change with what slides, and without
/// that friction feeds nothing.
#[test]
fn mirror_images_that_roll_are_stable() {
    let mut job = rolling();
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(0.03);
    }
    job["analyses"]["sweep"] = json!({ "keys": { "contact.speed": [0.01, 1, 3, 10, 20, 30] } });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &["--output", &folder.text("twins.h5")]).good();
    let [growth, unstable] = ["growth_rate", "unstable"].map(|n| numbers(&folder, "twins.h5", &format!("sweep/{n}")));
    assert!(growth.iter().all(|g| !(*g > 0.0)) && growth.iter().any(|g| *g < 0.0), "{growth:?}");
    assert_eq!(unstable, [0.0; 6]);
}

/// With the sliding velocity held, and so the damping of the friction, the spectrum of wheels that roll ever slower
/// becomes that of wheels at rest: in proportion to Ω, but for single eigenvalues, to Ω².
#[test]
#[ignore = "long: scripts/validate long"]
fn rolling_ever_slower_is_rest() {
    let job = rolling();
    let folder = Folder::with(job.to_string());
    let distance = |speed: f64| {
        let [rolls, rests] = ["rolling", "none"].map(|rotation| {
            let sets = [
                format!("contact.speed={speed}"),
                format!("contact.creepage.lateral={}", 0.01 / speed),
                format!("bodies.lower.rotation={rotation}"),
                format!("bodies.upper.rotation={rotation}"),
            ];
            let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
            let output = folder.text("slow.h5");
            folder.call(1, "run", &[&sets[..], &["--force", "--output", &output]].concat()).good();
            let [growth, frequency] =
                ["growth_rate", "frequency"].map(|n| numbers(&folder, "slow.h5", &format!("stability/{n}")));
            let near = growth.into_iter().zip(frequency).filter(|(_, f)| *f > 100.0 && *f < 2000.0);
            near.map(|(g, f)| [g, std::f64::consts::TAU * f]).collect::<Vec<_>>()
        });
        assert_eq!(rolls.len(), rests.len(), "{speed} m/s");
        // The largest distance of an eigenvalue at rest from the nearest one of the wheels that roll.
        let apart = |a: &[f64; 2]| rolls.iter().map(|b| (a[0] - b[0]).hypot(a[1] - b[1])).fold(f64::INFINITY, f64::min);
        rests.iter().map(apart).fold(0.0, f64::max)
    };
    let [fast, slow] = [1.0, 0.02].map(distance);
    assert!(fast > 0.1, "{fast} rad/s at 1 m/s");
    assert!(slow < 0.04 * fast, "{slow} rad/s at 0.02 m/s, {fast} at 1 m/s");
}

/// In time, on 1 and 2 ranks: the most unstable motion begins as it does in the linear analysis, at the frequency of
/// the wheels that roll.
#[test]
fn wheels_that_roll_in_time() {
    let mut job = rolling();
    job["analyses"]["modes"]["count"] = json!(16);
    job["analyses"]["transient"] = json!({
        "duration": 5e-3, "step": 1e-5, "segment": 100, "start": { "mode": 1, "amplitude": 1e-6 },
        "contact_stride": 50, "modal_stride": 1
    });
    let folder = Folder::with(job.to_string());
    let (whole, parted) = (folder.text("whole.h5"), folder.text("parted.h5"));
    folder.call(1, "run", &["--output", &whole]).good();
    folder.call(2, "run", &["--output", &parted]).good();
    let column = |file: &str, name: &str| numbers(&folder, file, &format!("transient/{name}"));
    close("force", &column("parted.h5", "force"), &column("whole.h5", "force"), 1e-5);
    // Stopped and resumed, bit for bit.
    let stopped = folder.text("stopped.h5");
    let stop = ["--reuse", &whole, "--output", &stopped, "--wall-time", "0.001"];
    folder.call(1, "run", &stop).failed(5, &["--resume", "after 100 of 500 steps"]);
    folder.call(1, "run", &["--reuse", &whole, "--resume", &stopped]).good();
    for name in ["force", "modal_displacement", "contact_traction"] {
        assert_eq!(column("stopped.h5", name), column("whole.h5", name), "{name}");
    }
    // The frequency from the crossings of the mean of the largest amplitude.
    let (time, q) = (column("whole.h5", "modal_time"), column("whole.h5", "modal_displacement"));
    let m = q.len() / time.len();
    let swing = |k: usize| {
        let row = || q.iter().skip(k).step_by(m);
        row().fold(f64::MIN, |a, b| a.max(*b)) - row().fold(f64::MAX, |a, b| a.min(*b))
    };
    let k = (0..m).max_by(|&a, &b| swing(a).total_cmp(&swing(b))).expect("modes");
    let row: Vec<f64> = q.iter().skip(k).step_by(m).copied().collect();
    let middle = 0.5 * (row.iter().copied().fold(f64::MIN, f64::max) + row.iter().copied().fold(f64::MAX, f64::min));
    let up: Vec<f64> = (1..row.len())
        .filter(|&i| row[i - 1] < middle && row[i] >= middle)
        .map(|i| time[i] - (row[i] - middle) / (row[i] - row[i - 1]) * (time[i] - time[i - 1]))
        .collect();
    let seen = (up.len() - 1) as f64 / (up[up.len() - 1] - up[0]);
    let linear = numbers(&folder, "whole.h5", "stability/frequency")[0];
    assert!((seen / linear - 1.0).abs() < 0.02, "{seen} Hz in time, {linear} Hz by eigenvalues");
}

/// Mistakes are told with their place.
#[test]
fn rotation_that_makes_no_sense_is_refused() {
    let refused = |set: &[&str], parts: &[&str]| {
        let folder = Folder::with(rolling().to_string());
        let args: Vec<&str> = set.iter().flat_map(|s| ["--set", s]).collect();
        folder.call(1, "run", &args).failed(2, parts);
        folder.untouched();
    };
    refused(
        &["bodies.upper.rotation=roling"],
        &["bodies.upper.rotation: found the string \"roling\"", "\"none\", \"rolling\""],
    );
    refused(&["bodies.upper.rotation=true"], &["bodies.upper.rotation: found", "a number"]);
    refused(&["bodies.upper.axle_distance=0.4"], &["bodies.upper.axle_distance", "only for a body with a mesh file"]);
    refused(&["bodies.upper.fixed=[]"], &["bodies.upper.fixed", "no fixed support", "static problem"]);
    refused(&["analyses.modes=null", "analyses.stability=null", "analyses.steady={}"], &["analyses.modes: missing"]);
}
