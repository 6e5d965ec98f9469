//! The transient on all degrees of freedom, as real processes.

use super::program::*;
use super::transient::sliding;
use serde_json::{json, Value};

/// A short run whose bodies do not rotate.
fn job(model: &str) -> Value {
    let start = json!({ "mode": 1, "amplitude": 1e-6 });
    let mut job =
        sliding(json!({ "model": model, "duration": 3e-4, "segment": 10, "contact_stride": 1, "start": start }));
    for body in ["lower", "upper"] {
        job["bodies"][body]["rotation"] = json!("none");
    }
    job
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
