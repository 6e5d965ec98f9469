//! Creep curves: every point equals a run of its own, with and without modes; points that fail; pictures.

use super::program::*;
use num_complex::Complex64;
use serde_json::{json, Value};
use std::process::Command;

fn read<T: hdf5::H5Type>(folder: &Folder, file: &str, name: &str) -> Vec<T> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn curve(analyses: Value) -> Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
    }
    job["contact"]["creepage"] = json!({ "longitudinal": 0.001 });
    job["analyses"] = analyses;
    job["output"] = json!({ "fields": false });
    job
}

/// Forces and the least stable eigenvalue, from stick to full sliding, on one and on two ranks; documented and drawn.
#[test]
fn points_equal_single_runs() {
    let values = json!([-0.002, 0.001, 0.003, 0.0035, 0.02]);
    let job = curve(json!({
        "modes": { "count": 16 }, "stability": {}, "creep_curve": { "key": "lateral", "values": values }
    }));
    let folder = Folder::with(job.to_string());
    for ranks in [1, 2] {
        let ran = folder.call(ranks, "run", &["--output", &folder.text(&format!("{ranks}.h5"))]);
        assert!(ran.good().out.contains("creep curve over the lateral creepage: 5 points, 0 failed"), "{}", ran.out);
    }
    let eta: Vec<f64> = read(&folder, "1.h5", "creep_curve/lateral");
    assert_eq!(json!(eta), values);
    let (force, other): (Vec<f64>, Vec<f64>) =
        (read(&folder, "1.h5", "creep_curve/force"), read(&folder, "2.h5", "creep_curve/force"));
    let close = |a: f64, b: f64, of: f64| (a - b).abs() < of * 70e3;
    assert!(force.iter().zip(&other).all(|(a, b)| close(*a, *b, 1e-7)), "{force:?} {other:?}");
    let eigenvalue: Vec<Complex64> = read(&folder, "1.h5", "creep_curve/eigenvalue");
    let share: Vec<f64> = read(&folder, "1.h5", "creep_curve/stick_share");
    assert!(share[1] > 0.3 && share[4] == 0.0, "{share:?}");
    for (i, eta) in eta.iter().enumerate() {
        let set = format!("contact.creepage.lateral={eta}");
        let base = folder.text("1.h5");
        let sets =
            ["--reuse", &base, "--set", &set, "--set", "analyses.creep_curve=null", "--set", "analyses.steady={}"];
        folder.call(1, "run", &[&sets[..], &["--force", "--output", &folder.text("single.h5")]].concat()).good();
        let single: Vec<f64> = read(&folder, "single.h5", "contact/force");
        assert!((0..3).all(|c| close(force[3 * i + c], single[c], 1e-7)), "{eta}: {force:?}, {single:?}");
        let single = read::<Complex64>(&folder, "single.h5", "stability/eigenvalue")[0];
        assert!((eigenvalue[i] - single).norm() < 1e-7 * single.norm(), "{eta}: {} and {single}", eigenvalue[i]);
    }
    let root = env!("CARGO_MANIFEST_DIR");
    let venv = format!("{root}/.venv/bin/python");
    let python = if std::path::Path::new(&venv).exists() { venv } else { "python3".into() };
    let result = folder.text("1.h5");
    finish(Command::new(&python).args([&format!("{root}/tests/python/documented.py"), &result])).good();
    let drawn = finish(Command::new(format!("{root}/scripts/plot")).arg(&result));
    assert!(drawn.good().out.contains("1-creep-curve.png") && folder.path("1-creep-curve.png").exists(), "{drawn:?}");
}

/// Half-spaces have no modes; a range; the force rises with the creepage to μN and the contact sticks less and less.
#[test]
fn half_spaces_have_a_curve() {
    let range = json!({ "from": 0.0, "to": 0.02, "count": 11 });
    let mut job = curve(json!({ "creep_curve": { "key": "lateral", "values": range } }));
    job["contact"]["compliance"] = json!("half_space");
    job["contact"]["creepage"] = json!({});
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.001);
    }
    job["contact"]["patch"] = json!({ "half_length": 0.007, "half_width": 0.007 });
    let folder = Folder::with(job.to_string());
    let told = folder.call(1, "check", &[]);
    assert!(told.good().out.contains("steady rolling at 11 values of the lateral creepage"), "{}", told.out);
    folder.call(1, "run", &[]).good();
    let force: Vec<f64> = read(&folder, "job.h5", "creep_curve/force");
    let lateral: Vec<f64> = force.iter().skip(1).step_by(3).copied().collect();
    let share: Vec<f64> = read(&folder, "job.h5", "creep_curve/stick_share");
    // Full sliding is not quite along the rigid creep: the bodies deform as they pass.
    assert!(lateral[0].abs() < 1.0 && (lateral[10] + 0.3 * 70e3).abs() < 5e-4 * 0.3 * 70e3, "{lateral:?}");
    assert!(
        lateral.windows(2).all(|w| w[1] < w[0] + 1.0) && share.windows(2).all(|w| w[1] <= w[0]),
        "{lateral:?} {share:?}"
    );
    // Laws of point contact: within some per cent of it, and in full sliding the same.
    for (law, within) in [("fastsim", 0.05), ("shen_hedrick_elkins", 0.05), ("polach", 0.06)] {
        let there: Vec<f64> = read(&folder, "job.h5", &format!("creep_curve/{law}"));
        let apart = there.chunks_exact(2).zip(&lateral).map(|(f, y)| (f[1] - y).abs() / 21e3).fold(0.0, f64::max);
        assert!(apart < within, "{law}: {apart}, {there:?} {lateral:?}");
    }
    let half: Vec<f64> = read(&folder, "job.h5", "creep_curve/half_axes");
    assert!(half.iter().all(|h| (h - 4.884e-3).abs() < 0.02 * 4.884e-3), "{half:?}");
    assert!(hdf5::File::open(folder.path("job.h5")).expect("results").dataset("creep_curve/eigenvalue").is_err());
}

/// A point that does not converge has its code and message, the others are computed; what no point can have is
/// refused before anything is computed.
#[test]
fn failures_and_bad_input() {
    let wanted = json!({ "key": "lateral", "values": [0.0, 0.005, 0.0] });
    let mut job = curve(json!({ "creep_curve": wanted, "steady": { "max_iterations": 1 } }));
    job["contact"]["compliance"] = json!("half_space");
    job["contact"]["creepage"] = json!({});
    let folder = Folder::with(job.to_string());
    for (set, parts) in [
        ("analyses.creep_curve.key=sideways", vec!["analyses.creep_curve.key"]),
        ("analyses.creep_curve.values=[]", vec!["analyses.creep_curve.values", "empty"]),
        ("analyses.creep_curve.values=[0.01, 3.0]", vec!["rigid slip"]),
        ("analyses.creep_curve.values={\"from\": 0, \"to\": 1}", vec!["analyses.creep_curve.values"]),
    ] {
        folder.call(1, "run", &["--set", set]).failed(2, &parts);
        folder.untouched();
    }
    let ran = folder.call(1, "run", &[]);
    ran.failed(4, &["1 of 3 points of the creep curve", "lateral = 0.005", "max_iterations"]);
    assert_eq!(read::<i32>(&folder, "job.h5", "creep_curve/status"), [0, 4, 0]);
    let force: Vec<f64> = read(&folder, "job.h5", "creep_curve/force");
    assert!((force[2] + 70e3).abs() < 1.0 && force[4].is_nan() && (force[8] + 70e3).abs() < 1.0, "{force:?}");
}
