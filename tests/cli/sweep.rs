//! Sweeps: every point equals a run of its own, on any number of ranks, and failures of some points leave the others.

use super::program::*;
use serde_json::{json, Value};
use std::process::Command;

struct Sweep(hdf5::File);

impl Sweep {
    fn open(path: impl AsRef<std::path::Path>) -> Self {
        Self(hdf5::File::open(path).expect("result file"))
    }

    fn read<T: hdf5::H5Type>(&self, name: &str) -> Vec<T> {
        self.0.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Eigenvalues of a point.
    fn spectrum(&self, point: usize) -> Vec<num_complex::Complex64> {
        let offset: Vec<i64> = self.read("sweep/offset");
        self.read("sweep/eigenvalue")[offset[point] as usize..offset[point + 1] as usize].to_vec()
    }
}

fn sliding(sweep: Value) -> Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
    }
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    job["analyses"] =
        json!({ "modes": { "count": 20 }, "stability": { "direction": "rigid", "damping_ratio": 1 }, "sweep": sweep });
    job["output"] = json!({ "fields": false });
    job
}

/// Keys that reuse the finite elements and one that does not; on 1 and 2 ranks; each point against a run of its own.
#[test]
fn points_equal_single_runs_on_any_number_of_ranks() {
    let law = json!({ "exponential": { "static": 0.5, "kinetic": 0.2, "decay_velocity": 0.3 } });
    let sweep = json!({
        "keys": {
            "bodies.upper.material.young": [205e9, 150e9],
            "contact.friction": [0.2, law],
            "contact.normal_load": [70e3, 50e3],
            "bodies.lower.damping": [{ "alpha": 1.0 }, { "modal": { "by_mode": [1e-3] } }],
        },
        "combine": "zip"
    });
    let folder = Folder::with(sliding(sweep.clone()).to_string());
    let ran = folder.call(2, "run", &["--output", &folder.text("2.h5")]);
    assert!(ran.good().out.contains("2 points on 2 finite-element models"), "{}", ran.out);
    folder.call(1, "run", &["--output", &folder.text("1.h5")]).good();
    let (two, one) = (Sweep::open(folder.path("2.h5")), Sweep::open(folder.path("1.h5")));
    assert_eq!(two.read::<i32>("sweep/status"), [0, 0]);
    assert_eq!(two.read::<f64>("sweep/values/contact.normal_load"), [70e3, 50e3]);
    for point in 0..2 {
        let mut args = vec!["--output".to_string(), folder.text("single.h5"), "--force".into()];
        for (key, values) in sweep["keys"].as_object().expect("keys") {
            args.extend(["--set".into(), format!("{key}={}", values[point])]);
        }
        args.extend(["--only".into(), "stability".into()]);
        folder.call(1, "run", &args.iter().map(String::as_str).collect::<Vec<_>>()).good();
        let single: Vec<num_complex::Complex64> = Sweep::open(folder.path("single.h5")).read("stability/eigenvalue");
        assert!(single.len() >= 40, "{}", single.len());
        for (ranks, file) in [(1, &one), (2, &two)] {
            let found = file.spectrum(point);
            assert_eq!(found.len(), single.len(), "point {point} on {ranks} ranks");
            for (a, b) in found.iter().zip(&single) {
                // The spectrum of one model is the same to the last bits; on two ranks the modes themselves are not.
                let tolerance = if ranks == 1 { 1e-8 } else { 1e-7 };
                assert!((a - b).norm() <= tolerance * b.norm(), "point {point} on {ranks} ranks: {a} and {b}");
            }
            assert_eq!(file.read::<f64>("sweep/growth_rate")[point], found[0].re);
        }
    }
}

/// From rest to full sliding in small steps every point has its state and its eigenvalues, and fewer and fewer nodes
/// stick. With a second key the map dots what sticks in part.
#[test]
fn a_sweep_goes_from_stick_to_full_sliding_without_a_gap() {
    let range = json!({ "from": 0.0, "to": 0.014, "count": 29 });
    let mut job = sliding(json!({ "keys": { "contact.creepage.lateral": range } }));
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.002);
    }
    job["contact"]["creepage"] = json!({});
    job["analyses"]["modes"]["count"] = json!(8);
    job["analyses"]["stability"] = json!({});
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(
        ran.good().out.contains("29 points on 1 finite-element model") && ran.out.contains("0 failed"),
        "{}",
        ran.out
    );
    let file = Sweep::open(folder.path("job.h5"));
    let (sticking, closed) = (file.read::<i64>("sweep/sticking"), file.read::<i64>("sweep/closed"));
    assert!(closed[0] > 15 && sticking[0] == closed[0] && sticking[28] == 0, "{sticking:?} of {closed:?}");
    assert!(sticking.windows(2).all(|w| w[1] <= w[0]), "{sticking:?}");
    let first = sticking.iter().position(|s| *s == 0).expect("full sliding");
    assert!((10..25).contains(&first), "{sticking:?}");
    // On this coarse grid the growth rate rises where nodes leave stick, by a large part where the last ones do;
    // while the same number sticks it hardly moves, on either side.
    let rates = file.read::<f64>("sweep/growth_rate");
    let whole = rates[28] - rates[0];
    assert!(whole > 1.0 && rates.windows(2).all(|w| w[1] > w[0] - 0.01 * whole), "{rates:?}");
    for (rate, nodes) in rates.windows(2).zip(sticking.windows(2)).filter(|(_, n)| n[0] == n[1]) {
        assert!((rate[1] - rate[0]).abs() < 0.05 * whole, "{nodes:?} in stick: {rates:?}, {sticking:?}");
    }
    let map = json!({ "keys": { "contact.creepage.lateral": [0.002, 0.014], "contact.friction": [0.2, 0.3] } });
    let base = folder.text("job.h5");
    let set = format!("analyses.sweep={map}");
    folder.call(1, "run", &["--reuse", &base, "--set", &set, "--output", &folder.text("map.h5")]).good();
    let map = Sweep::open(folder.path("map.h5"));
    assert_eq!(
        map.read::<i64>("sweep/sticking").iter().map(|s| *s > 0).collect::<Vec<_>>(),
        [true, true, false, false]
    );
    let drawn = finish(
        std::process::Command::new(format!("{}/scripts/plot", env!("CARGO_MANIFEST_DIR"))).arg(folder.path("map.h5")),
    );
    assert!(drawn.good().out.contains("map"), "{drawn:?}");
}

/// Bodies of revolution that are mirror images of each other, supports and meshes included, are stable at any
/// constant friction whatever the direction of sliding.
#[test]
fn mirror_images_are_stable_for_every_friction_and_direction() {
    let mut job = sliding(json!({ "keys": {
        "contact.friction": [0.05, 0.3, 0.6, 1.0],
        "contact.creepage": [
            { "lateral": 0.01 },
            { "lateral": -0.01 },
            { "longitudinal": 0.01 },
            { "longitudinal": -0.01 },
            { "longitudinal": 0.01, "lateral": 0.01 },
            { "longitudinal": -0.004, "lateral": 0.01, "spin": 0.3 },
            { "longitudinal": 0.005, "lateral": -0.02, "spin": -0.5 },
        ],
    }}));
    job["bodies"]["upper"]["mesh"]["cylinder"]["contact_offset"] = json!(0.03);
    let folder = Folder::with(job.to_string());
    let ran = folder.call(2, "run", &[]);
    assert!(ran.good().out.contains("28 points on 1 finite-element model, 0 unstable, 0 failed"), "{}", ran.out);
    let file = Sweep::open(folder.path("job.h5"));
    let rates = file.read::<f64>("sweep/growth_rate");
    assert!(rates.len() == 28 && rates.iter().all(|r| *r < 0.0), "{rates:?}");
    // Rayleigh damping alone would leave the least damped mode at −(α + βω²)/2 of the lowest frequency; nothing rises
    // above it by much.
    let lowest: Vec<f64> = hdf5::File::open(folder.path("job.h5"))
        .and_then(|f| f.dataset("modes/lower/frequency"))
        .and_then(|d| d.read_raw())
        .expect("frequencies");
    let alone = -0.5 * (1.0 + 1e-6 * (2.0 * std::f64::consts::PI * lowest[0]).powi(2));
    assert!(rates.iter().all(|r| *r < 0.5 * alone), "{rates:?}, damping alone {alone}");
}

/// A load that the patch does not hold, and one that it does: the file is written, the exit code says that a point
/// failed.
#[test]
fn a_point_that_fails_leaves_the_others() {
    let sweep = json!({ "keys": { "contact.normal_load": [70e3, 1e6, 60e3], "contact.friction": [0.3, 0.4] } });
    let mut job = sliding(sweep);
    job["analyses"]["receptance"] = json!({ "frequency": { "from": 0, "to": 400, "count": 5 } });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(2, "run", &[]);
    ran.failed(4, &["2 of 6 points", "contact.normal_load = 1000000.0", "contact.patch", "/sweep/status"]);
    assert!(ran.out.contains("6 points on 1 finite-element model, "), "{}", ran.out);
    let file = Sweep::open(folder.path("job.h5"));
    assert_eq!(file.read::<i32>("sweep/status"), [0, 0, 2, 2, 0, 0]);
    let rates = file.read::<f64>("sweep/growth_rate");
    assert!(rates[2].is_nan() && rates[3].is_nan() && rates[4].is_finite(), "{rates:?}");
    assert!(file.spectrum(2).is_empty() && file.spectrum(5).len() >= 40);
    let messages: Vec<hdf5::types::VarLenUnicode> = file.read("sweep/message");
    assert!(messages[2].contains("contact.patch") && messages[0].is_empty());
    drop(file);
    // Every dataset of such a file is documented, and its pictures can be drawn.
    let root = env!("CARGO_MANIFEST_DIR");
    let venv = format!("{root}/.venv/bin/python");
    let python = if std::path::Path::new(&venv).exists() { venv } else { "python3".into() };
    let result = folder.text("job.h5");
    finish(Command::new(&python).args([&format!("{root}/tests/python/documented.py"), &result])).good();
    // The verdict is that of the package, but for the names of the keys.
    script("check_verdict.py", &[&result]).good();
    assert!(ran.out.contains("; 2 points failed; fastest "), "{}", ran.out);
    let drawn = finish(Command::new(format!("{root}/scripts/plot")).arg(&result));
    for picture in ["job-sweep-map.png", "job-receptance.png"] {
        assert!(drawn.good().out.contains(picture) && folder.path(picture).exists(), "{drawn:?}");
    }
}

/// The point of the job itself fails, in its contact or already in its supports: the points of the sweep are computed
/// all the same.
#[test]
fn points_are_computed_although_that_of_the_job_fails() {
    let mut job = sliding(json!({ "keys": { "contact.normal_load": [60e3, 70e3] } }));
    job["contact"]["normal_load"] = json!(1e6);
    let mut unmade = sliding(json!({ "keys": { "bodies.lower.fixed": [["inner"], ["side_plus", "outer"]] } }));
    unmade["bodies"]["lower"]["fixed"] = json!(["outer"]);
    for (job, own, status, parts) in [
        (job, 2, [0, 0], &["the job's own point failed", "contact.patch"][..]),
        (unmade, 2, [0, 2], &["the job's own point failed", "bodies.lower.fixed", "contact"]),
    ] {
        let folder = Folder::with(job.to_string());
        let ran = folder.call(2, "run", &[]);
        ran.failed(4, parts);
        assert!(ran.out.contains("2 points on "), "{}", ran.out);
        let file = Sweep::open(folder.path("job.h5"));
        assert_eq!(file.read::<i32>("sweep/own_status"), [own]);
        let message: Vec<hdf5::types::VarLenUnicode> = file.read("sweep/own_message");
        assert!(message[0].contains(parts[1]), "{message:?}");
        assert_eq!(file.read::<i32>("sweep/status"), status);
        assert!(file.spectrum(0).len() >= 40);
    }
}

/// Finite elements that cannot be made fail the points that need them, and no others.
#[test]
fn finite_elements_that_fail_leave_the_points_of_the_others() {
    let sweep = json!({ "keys": { "bodies.lower.fixed": [["inner"], ["side_plus", "outer"]] } });
    let folder = Folder::with(sliding(sweep).to_string());
    folder.call(2, "run", &[]).failed(4, &["1 of 2 points", "contact"]);
    assert_eq!(Sweep::open(folder.path("job.h5")).read::<i32>("sweep/status"), [0, 2]);
}

#[test]
fn sweeps_that_cannot_be_are_refused() {
    for (keys, part) in [
        (json!({}), "the sweep is empty"),
        (json!({ "contact.fricton": [0.3] }), "did you mean \"friction\"?"),
        (json!({ "contact.speed": ["fast"] }), "found the string \"fast\", expected a number"),
    ] {
        let folder = Folder::with(sliding(json!({ "keys": keys })).to_string());
        for ranks in [1, 2] {
            folder.call(ranks, "run", &[]).failed(2, &[part]);
            folder.untouched();
        }
    }
}
