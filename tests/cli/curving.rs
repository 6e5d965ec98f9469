//! A vehicle in a curve, in whole runs.

use super::program::*;
use num_complex::Complex64;
use serde_json::{json, Value};

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// `jobs/wheel-on-rail.json` with modes up to 1100 Hz.
fn in_curve() -> Value {
    let mut job = job("wheel-on-rail.json");
    job["analyses"] = json!({ "modes": { "max_frequency": 1100 }, "stability": {} });
    job
}

#[test]
fn curving_prints_all_wheels_beside_the_discretised_contact() {
    let folder = Folder::with(in_curve().to_string());
    let ran = folder.call(1, "curving", &["--contact"]);
    let text = ran.good().out.clone();
    for part in ["radius 100", "leading axle", "angle of attack", "trailing outer", "forces by the creep law"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // The law is near the discretised contact where one creepage rules, and off by an eighth of the bound with much
    // spin.
    let own = text.lines().skip_while(|l| !l.starts_with("forces by the creep law")).skip(2);
    let apart: Vec<f64> = own.filter_map(|l| l.split_whitespace().last()?.parse().ok()).collect();
    assert!(apart.len() >= 5 && apart[0] < 0.02 && apart.iter().all(|a| *a < 0.15), "{text}");
}

/// Each wheel is examined where the equilibrium has it; left and right curves have the same eigenvalues.
#[test]
fn wheels_of_a_curve_go_on_into_stability() {
    let mut job = in_curve();
    job["analyses"]["curving"] = json!({ "radii": [600, 300] });
    job["analyses"]["steady"] = json!({});
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    let text = ran.good().out.clone();
    assert!(text.contains("steady curving: radius 100") && !text.contains("straight track"), "{text}");
    let creepage = numbers(&folder, "placement/creepage");
    let wheels = numbers(&folder, "curving/contacts/creepage");
    // The frame is in the middle of the overlap, 0.3 mm from the first touch.
    assert!(
        (creepage[0] - wheels[0]).abs() < 3e-4 && (creepage[1] / wheels[1] - 1.0).abs() < 5e-3,
        "{creepage:?} {wheels:?}"
    );
    assert_eq!(numbers(&folder, "curving/radii/radius"), [600.0, 300.0]);
    let yaw = numbers(&folder, "curving/radii/yaw");
    assert!((yaw[0] / -2.0e-3 - 1.0).abs() < 0.5 && yaw[2] < yaw[0], "{yaw:?}");
    let right = ["stability/frequency", "stability/growth_rate"].map(|name| numbers(&folder, name));
    assert!(right[1][0] > 0.0, "the fastest mode grows: {:?}", &right[1][..4]);
    job["curve"]["direction"] = json!("left");
    let mirrored = Folder::with(job.to_string());
    mirrored.call(1, "run", &[]).good();
    let left = ["stability/frequency", "stability/growth_rate"].map(|name| numbers(&mirrored, name));
    for k in 0..4 {
        let rate = 2.0 * std::f64::consts::PI * right[0][k];
        assert!((right[0][k] / left[0][k] - 1.0).abs() < 1e-5, "{} {}", right[0][k], left[0][k]);
        assert!((right[1][k] - left[1][k]).abs() < 1e-5 * rate, "{} {}", right[1][k], left[1][k]);
    }
    // The job that is kept with the results gives the same contact again: nothing that follows is in it.
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    let kept = file.dataset("provenance/job").expect("job");
    let kept: hdf5::types::VarLenUnicode = kept.read_scalar().expect("text");
    let kept: Value = serde_json::from_str(kept.as_str()).expect("JSON");
    assert!(
        kept["contact"].get("placement").is_none() && kept["contact"]["from"]["wheel"] == "leading inner",
        "{kept}"
    );
}

/// Wheels of the vehicle as points of a sweep; the own point is that of a run.
#[test]
fn wheels_are_swept_by_name() {
    let mut job = in_curve();
    job["analyses"]["modes"]["max_frequency"] = json!(500);
    job["analyses"]["sweep"] = json!({ "keys": { "contact.from.wheel": ["leading inner", "leading outer"] } });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("sweep of contact.from.wheel: 2 points"), "{}", ran.out);
    let growth = numbers(&folder, "sweep/growth_rate");
    let own = numbers(&folder, "stability/growth_rate");
    assert!((growth[0] - own[0]).abs() < 1e-6 * own[0].abs().max(1.0), "{growth:?} {own:?}");
    assert!((growth[1] - growth[0]).abs() > 1e-3, "{growth:?}");
}

#[test]
fn curves_that_make_no_sense_are_refused_with_what_to_do() {
    let cases: [(&str, Value, &[&str]); 9] = [
        ("curve.cant", json!(150), &["curve.cant", "150", "mm"]),
        ("curve.cant", json!(6), &["curve.cant", "degrees"]),
        ("curve.speed", json!(180), &["curve.speed", "km/h", "50"]),
        ("curve.radius", json!(0.3), &["curve.radius", "300 m"]),
        ("vehicle.axle_load", json!(120), &["vehicle.axle_load", "kN"]),
        ("vehicle.wheelbase", json!(40), &["vehicle.wheelbase"]),
        ("curve.cant_deficiency", json!(0.1), &["centre_of_gravity", "100 mm"]),
        ("contact.speed", json!(10), &["contact.speed", "curve"]),
        ("curve.gauge", json!(1.41), &["curve.gauge", "flange"]),
    ];
    let vehicle = json!({
        "wheelbase": 2.5, "axle_load": 120e3, "wheel_radius": 0.46,
        "primary": { "longitudinal": 10e6, "lateral": 5e6, "box_distance": 2.0 },
    });
    for (key, value, parts) in cases {
        let mut job = in_curve();
        job["vehicle"] = vehicle.clone();
        let place = job.pointer_mut(&format!("/{}", key.rsplit_once('.').expect("a path").0)).expect("an object");
        place[key.rsplit_once('.').expect("a path").1] = value;
        let folder = Folder::with(job.to_string());
        let ran = folder.call(1, "check", &[]);
        assert_eq!(ran.code, Some(2), "{key}: {}", ran.err);
        parts.iter().for_each(|part| assert!(ran.err.contains(part), "{key}, {part}: {}", ran.err));
    }
    let mut job = in_curve();
    job["vehicle"] = Value::Null;
    job.as_object_mut().expect("an object").remove("vehicle");
    let ran = Folder::with(job.to_string()).call(1, "check", &[]);
    assert!(ran.code == Some(2) && ran.err.contains("vehicle: missing"), "{}", ran.err);
}

/// Points of a sweep over the friction begin at the equilibrium of the job, and end at that of a run by itself.
#[test]
#[ignore = "long: scripts/validate long"]
fn the_equilibrium_does_not_depend_on_where_it_begins() {
    let mut job = job("wheel-on-rail.json");
    job["analyses"] = json!({
        "modes": { "max_frequency": 600 }, "stability": {}, "sweep": { "keys": { "contact.friction": [0.5] } }
    });
    job["output"] = json!({ "fields": false });
    let values = |folder: &Folder, name: &str| -> Vec<Complex64> {
        let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
        file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let sweep = Folder::with(job.to_string());
    sweep.call(1, "run", &[]).good();
    job["analyses"]["sweep"] = Value::Null;
    job["contact"]["friction"] = json!(0.5);
    let alone = Folder::with(job.to_string());
    alone.call(1, "run", &[]).good();
    let (found, wanted) = (values(&sweep, "sweep/eigenvalue"), values(&alone, "stability/eigenvalue"));
    assert!(wanted.len() > 4 && found.len() == wanted.len(), "{found:?} and {wanted:?}");
    for (a, b) in found.iter().zip(&wanted).take(4) {
        assert!((a - b).norm() < 1e-8 * b.norm(), "{a} and {b}");
    }
}
