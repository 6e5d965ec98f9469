//! Causes of growth, in whole runs: one free mode on everything else beside the eigenvalue.

use super::program::*;
use num_complex::Complex64;
use serde_json::{json, Value};

/// Runs the job; of each eigenvalue that is told of: the growth rate in closed form, the eigenvalue, and −c/2.
fn run(job: Value) -> Vec<(f64, Complex64, f64)> {
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("growth-rate budget"), "{}", ran.out);
    let file = hdf5::File::open(folder.text("job.h5")).expect("results");
    let list = |name: &str| -> Vec<f64> { file.dataset(name).and_then(|d| d.read_raw()).expect(name) };
    let values: Vec<Complex64> = file.dataset("stability/eigenvalue").and_then(|d| d.read_raw()).expect("eigenvalues");
    let part = |name: &str| list(&format!("stability/criterion/{name}"));
    let (all, damping) = (part("growth_rate"), part("damping"));
    all.into_iter().zip(damping).zip(values).map(|((got, damping), value)| (got, value, damping)).collect()
}

/// A wheel that turns on a rail with fewer modes than `jobs/wheel-at-given-yaw.json` keeps, and two cylinders of finite
/// elements as in `jobs/curve.json`, at rest and rolling, on coarse meshes: within 1 % of the eigenvalue where that
/// grows, and of what is not its own damping where it decays.
#[test]
fn growth_in_closed_form_is_that_of_the_eigenvalues() {
    let mut wheel = job("wheel-at-given-yaw.json");
    wheel["analyses"] = json!({ "modes": { "max_frequency": 1500 }, "stability": {} });
    let cylinders = |rotation: &str| {
        let mut job = small();
        for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
            job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
            job["bodies"][body]["rotation"] = json!(rotation);
        }
        job["contact"]["creepage"] = json!({ "longitudinal": 0.0, "lateral": 0.01, "spin": 0.0 });
        job["analyses"] = json!({ "modes": { "count": 20 }, "stability": {} });
        job["output"] = json!({ "fields": false });
        job
    };
    let mut growing = 0;
    for (name, job) in [("wheel", wheel), ("at rest", cylinders("none")), ("rolling", cylinders("rolling"))] {
        for (got, value, damping) in run(job) {
            let size = if value.re > 0.0 { value.re } else { (value.re - damping).abs() };
            assert!((got - value.re).abs() < 0.01 * size, "{name}: {got}, expected {value}, damping {damping}");
            growing += usize::from(value.re > 0.0);
        }
    }
    assert!(growing >= 6, "{growing} grow");
}
