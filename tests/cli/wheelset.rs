//! A wheelset on its primary suspension, in whole runs.

use super::program::*;
use serde_json::{json, Value};

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// `jobs/wheelset.json` with modes up to 1100 Hz.
fn wheelset() -> Value {
    let mut job = job("wheelset.json");
    job["analyses"] = json!({ "modes": { "max_frequency": 1100 }, "steady": {}, "stability": {} });
    job
}

/// The inner wheel of a right curve is the right-hand one, that of a left curve the left-hand one: mirror images, with
/// equal eigenvalues. Modes carry their parity, free torsion is the first, and some mode squeals.
#[test]
fn the_right_hand_wheel_is_the_mirror_image_of_the_left_hand_one() {
    let mut job = wheelset();
    let right = Folder::with(job.to_string());
    let out = right.call(2, "run", &[]).good().out.clone();
    assert!(out.contains("antisymmetric") && out.contains("symmetric axial 0"), "{out}");
    assert!(out.contains("mass 1.0195"), "{out}");
    job["curve"]["direction"] = json!("left");
    let left = Folder::with(job.to_string());
    left.call(1, "run", &[]).good();
    let pairs = [&right, &left].map(|f| ["stability/frequency", "stability/growth_rate"].map(|name| numbers(f, name)));
    let [right, left] = pairs;
    assert!(right[1].iter().any(|rate| *rate > 0.1), "{right:?}");
    for k in 0..4 {
        let rate = 2.0 * std::f64::consts::PI * right[0][k];
        let apart = (2.0 * std::f64::consts::PI * (left[0][k] - right[0][k])).hypot(left[1][k] - right[1][k]);
        assert!(apart < 1e-5 * rate, "{k}: {right:?} {left:?}");
    }
}

/// Refusals of wheelsets that are not held, or held twice, name the key.
#[test]
fn wheelsets_that_are_not_held_are_refused() {
    let refused = |change: &dyn Fn(&mut Value), message: &str| {
        let mut job = wheelset();
        change(&mut job["bodies"]["upper"]);
        let folder = Folder::with(job.to_string());
        let ran = folder.call(1, "check", &[]);
        assert!(ran.code == Some(2) && ran.err.contains(message), "{message}: {:?} {}", ran.code, ran.err);
    };
    refused(&|b| b["suspension"] = Value::Null, "or give its primary suspension");
    refused(&|b| b["suspension"]["lateral"] = json!(0.0), "suspension.lateral");
    refused(&|b| b["suspension"]["journals"] = json!([1.0]), "one bearing does not hold a wheelset");
    refused(&|b| b["suspension"]["journals"] = json!([-1.0, 1.3]), "found y = 1.3 m");
    refused(&|b| b["fixed"] = json!(["seats"]), "held by its bearings alone");
    refused(&|b| b["mesh"] = json!({ "revolved": { "section": "W920S" } }), "the section has no axle");
}
