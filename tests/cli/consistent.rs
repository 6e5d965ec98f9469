//! The laws of contact at points of quadrature (`contact.quadrature` `"consistent"`), in whole runs.

use super::program::*;
use super::transient::{open, read};
use serde_json::{json, Value};

/// The paper's cylinders, a few nodes in contact, which stick and slip; steady rolling and 40 steps that begin with it.
fn rolling() -> Value {
    let mut job = small();
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.002);
    }
    job["contact"]["patch"] = json!({ "half_length": 0.008, "half_width": 0.008 });
    job["contact"]["quadrature"] = json!("consistent");
    let transient = json!({ "duration": 4e-4, "step": 1e-5, "start": { "state": "steady" } });
    job["analyses"] = json!({ "modes": { "count": 6 }, "steady": {}, "transient": transient });
    job["output"] = json!({ "fields": false });
    job
}

/// The transient begins with the steady state of its laws and keeps it, to what the difference over the way of a step
/// is from the derivative (4e-5 of the force; the forces with laws at the nodes are 3 % others). The stress at the
/// nodes makes their forces, and two ranks find what one does.
#[test]
fn a_transient_keeps_the_steady_state_on_one_rank_and_on_two() {
    let folder = Folder::with(rolling().to_string());
    let [one, two, nodal] = ["one.h5", "two.h5", "nodal.h5"].map(|name| folder.text(name));
    folder.call(1, "run", &["--output", &one]).good();
    folder.call(2, "run", &["--output", &two]).good();
    folder.call(1, "run", &["--output", &nodal, "--set", "contact.quadrature=nodal"]).good();
    let of = |path: &str, name: &str| read::<f64>(&open(path), name);
    let most = |values: &[f64]| values.iter().fold(0.0f64, |m, v| m.max(v.abs()));

    let force = of(&one, "contact/force");
    assert!((force[2] + 70e3).abs() < 1e-3, "{force:?}");
    let lateral: Vec<f64> = of(&one, "transient/force").chunks_exact(3).map(|f| f[1]).collect();
    let drift = most(&lateral.iter().map(|f| f / force[1] - 1.0).collect::<Vec<f64>>());
    let apart = of(&nodal, "contact/force")[1] / force[1] - 1.0;
    assert!(lateral.len() >= 40 && drift < 2e-4 && apart.abs() > 0.01, "drift {drift:e}, nodal laws {apart:e}");
    let area = of(&one, "contact/area");
    assert!(0.0 < area[1] && area[1] < area[0] && area[0] < 1.2 * std::f64::consts::PI * 4.9e-3 * 4.9e-3, "{area:?}");
    // Bilinear stress over rectangles: its integral is that of the nodal values over nodal areas.
    let weights = of(&one, "contact/weight");
    let field = of(&one, "contact/field");
    let total: f64 = field.chunks_exact(3).zip(&weights).map(|(f, w)| f[2] * w).sum();
    assert!((total / 70e3 - 1.0).abs() < 1e-6, "{total} N");

    for (name, tolerance) in
        [("contact/force", 1e-7), ("contact/field", 1e-7), ("contact/area", 1e-7), ("transient/force", 1e-7)]
    {
        let (a, b) = (of(&one, name), of(&two, name));
        let off = most(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<f64>>());
        assert!(a.len() == b.len() && off < tolerance * most(&a), "{name}: {off:e} of {:e}", most(&a));
    }
}
