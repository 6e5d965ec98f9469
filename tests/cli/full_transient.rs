//! The transient on all degrees of freedom, as real processes.

use super::interrupted::same;
use super::program::*;
use super::transient::{open, read, sliding};
use serde_json::{json, Value};

/// A short run whose bodies do not rotate.
fn job(model: &str) -> Value {
    let start = json!({ "mode": 1, "amplitude": 1e-6 });
    let mut job =
        sliding(json!({ "model": model, "step": 2e-6, "duration": 6e-5, "segment": 10, "contact_stride": 1, "start": start }));
    for body in ["lower", "upper"] {
        job["bodies"][body]["rotation"] = json!("none");
        job["bodies"][body]["mesh"]["cylinder"]["inner_radius"] = json!(0.3);
    }
    job
}

/// What is left out of the modes is small over a tenth of the period, with steps that nodes with mass can be followed by; a run that is continued is the run that was not stopped, to the last bit; two ranks
/// find what one does, from the same phase of the mode.
#[test]
fn all_degrees_of_freedom_move_as_the_modes_do() {
    let folder = Folder::with(job("full").to_string());
    let [whole, parts, two] = ["whole.h5", "parts.h5", "two.h5"].map(|name| folder.text(name));
    folder.call(1, "run", &["--output", &whole]).good();
    folder
        .call(1, "run", &["--output", &parts, "--wall-time", "0.001"])
        .failed(5, &["after 10 of 30 steps", "--resume"]);
    folder.call(1, "run", &["--resume", &parts]).good();
    same(&open(&whole), &open(&parts));
    folder.call(2, "run", &["--output", &two]).good();

    let reduced = Folder::with(job("reduced").to_string());
    let modes = reduced.text("modes.h5");
    reduced.call(1, "run", &["--output", &modes]).good();
    let normal = |path: &str| -> Vec<f64> {
        read::<f64>(&open(path), "transient/force").chunks_exact(3).map(|f| f[2]).collect()
    };
    let full = normal(&whole);
    let mean = full.iter().sum::<f64>() / full.len() as f64;
    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let swing = rms(&full.iter().map(|f| f - mean).collect::<Vec<f64>>());
    let apart = |other: &[f64]| rms(&full.iter().zip(other).map(|(a, b)| a - b).collect::<Vec<f64>>()) / swing;
    let (ranks, left_out) = (apart(&normal(&two)), apart(&normal(&modes)));
    assert!(swing > 1.0 && ranks < 1e-4 && left_out < 0.01, "{swing} N, two ranks {ranks:e}, modes {left_out:e}");
}

#[test]
fn what_the_full_model_has_not_is_refused() {
    let cases =
        [("analyses.transient.hold", "\"load\"", "hold"), ("analyses.transient.body_stride", "5", "body_stride")];
    let folder = Folder::with(job("full").to_string());
    for (key, value, named) in cases {
        folder.call(1, "check", &["--set", &format!("{key}={value}")]).failed(2, &[named, "\"full\"", "reduced"]);
    }
    let missing = ["--set", "solver.linear=gamg"];
    folder.call(1, "check", &missing).failed(2, &["solver.linear", "mumps"]);
}
