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
#[ignore = "long: scripts/validate long"]
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

/// The same with both wheels on their rails.
fn both_wheels() -> Value {
    let mut job = wheelset();
    job["contact"]["wheels"] = json!("both");
    job
}

/// λ of the listed modes, 1/s: real and imaginary part.
fn eigenvalues(folder: &Folder) -> Vec<[f64; 2]> {
    let [rate, frequency] = ["growth_rate", "frequency"].map(|name| numbers(folder, &format!("stability/{name}")));
    rate.iter().zip(&frequency).map(|(s, f)| [*s, 2.0 * std::f64::consts::PI * f]).collect()
}

/// Distance of an eigenvalue to the nearest of others, over its size.
fn apart(value: &[f64; 2], others: &[[f64; 2]]) -> f64 {
    let far = |o: &[f64; 2]| (value[0] - o[0]).hypot(value[1] - o[1]) / value[0].hypot(value[1]);
    others.iter().map(far).fold(f64::INFINITY, f64::min)
}

/// On clamped seats the axle does not couple the wheels: each eigenvalue of both wheels together is one of the inner
/// wheel alone or of the outer one alone. The compliance of several contacts is summed over narrower blocks of orders,
/// which changes that of a contact by up to 0.1 %, and so does its part of the damping.
#[test]
#[ignore = "long: scripts/validate long"]
fn wheels_on_clamped_seats_squeal_as_each_of_them_alone() {
    let mut job = both_wheels();
    job["analyses"]["modes"]["max_frequency"] = json!(700);
    let upper = &mut job["bodies"]["upper"];
    (upper["suspension"], upper["fixed"]) = (Value::Null, json!(["seats"]));
    let both = Folder::with(job.to_string());
    let out = both.call(1, "run", &[]).good().out.clone();
    assert!(out.contains("contact 2: left-hand wheel") && out.contains("two rails without coupling"), "{out}");
    job["contact"]["wheels"] = json!("one");
    let [inner, outer] = ["leading inner", "leading outer"].map(|wheel| {
        job["contact"]["from"]["wheel"] = json!(wheel);
        let one = Folder::with(job.to_string());
        one.call(1, "run", &[]).good();
        (eigenvalues(&one), numbers(&one, "contact/force"))
    });
    for (force, alone) in [("contact/force", &inner.1), ("contact_2/force", &outer.1)] {
        let found = numbers(&both, force);
        assert!(found.iter().zip(alone).all(|(a, b)| (a - b).abs() < 1e-6 * alone[2].abs()), "{found:?} {alone:?}");
    }
    let mut own = [0; 2];
    let found = eigenvalues(&both);
    for value in &found {
        let apart = [&inner.0, &outer.0].map(|alone| apart(value, alone));
        let bound = 1e-6 + 1e-3 * value[0].abs() / value[0].hypot(value[1]);
        assert!(apart[0].min(apart[1]) < bound, "{value:?}: {apart:?}");
        own[0] += usize::from(apart[1] > 1e-4);
        own[1] += usize::from(apart[0] > 1e-4);
    }
    assert!(own.iter().all(|count| *count > 5), "{own:?} of {}", found.len());
}

/// With both wheels in contact the inner one squeals as it does alone: the axle does not couple wheels with n ≥ 2. The
/// bending of the axle at 71 Hz grows where the outer wheel is free, and here it does not.
#[test]
fn both_wheels_of_a_curve_are_solved_at_once() {
    let mut job = both_wheels();
    let right = Folder::with(job.to_string());
    right.call(1, "run", &[]).good();
    let normal = numbers(&right, "curving/contacts/normal_force");
    for force in ["contact/force", "contact_2/force"] {
        let load = -numbers(&right, force)[2];
        assert!(normal.iter().any(|n| (load / n - 1.0).abs() < 1e-6), "{load} {normal:?}");
    }
    job["contact"]["wheels"] = json!("one");
    let one = Folder::with(job.to_string());
    one.call(1, "run", &[]).good();
    let [both, alone] = [&right, &one].map(eigenvalues);
    let growing = |all: &[[f64; 2]]| all.iter().filter(|v| v[0] > 0.1).copied().collect::<Vec<_>>();
    let hertz = |v: &[f64; 2]| v[1] / (2.0 * std::f64::consts::PI);
    assert!(growing(&alone).iter().any(|v| hertz(v) < 100.0), "{alone:?}");
    assert!(growing(&both).len() > 3 && growing(&both).iter().all(|v| hertz(v) > 300.0), "{both:?}");
    for value in growing(&both) {
        let near = alone.iter().find(|v| (v[1] / value[1] - 1.0).abs() < 1e-4).expect("the mode of one wheel");
        assert!((near[0] / value[0] - 1.0).abs() < 0.01, "{near:?} {value:?}");
    }
}

/// A left curve is the mirror image of a right one.
#[test]
#[ignore = "long: scripts/validate long"]
fn both_wheels_of_a_left_curve_are_the_mirror_image() {
    let mut job = both_wheels();
    let [right, left] = ["right", "left"].map(|direction| {
        job["curve"]["direction"] = json!(direction);
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).good();
        eigenvalues(&folder)
    });
    for value in &right[..6] {
        assert!(apart(value, &left) < 1e-5, "{value:?} {left:?}");
    }
}

/// Without yaw and shift both wheels are mirror images: they have the same forces, and each mode moves either the
/// symmetric or the antisymmetric modes of the wheelset.
#[test]
#[ignore = "long: scripts/validate long"]
fn mirror_images_move_symmetrically_or_antisymmetrically() {
    let mut job = both_wheels();
    job["curve"] = Value::Null;
    job["vehicle"] = Value::Null;
    job["contact"]["from"] = Value::Null;
    job["contact"]["normal_load"] = json!(60e3);
    job["contact"]["speed"] = json!(10);
    job["contact"]["placement"] =
        json!({ "side": "right", "radius": 0.46, "cant": 0.025, "creepage": { "longitudinal": 0.01 } });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let [right, left] = ["contact/force", "contact_2/force"].map(|name| numbers(&folder, name));
    for (k, sign) in [1.0, -1.0, 1.0].into_iter().enumerate() {
        assert!((right[k] - sign * left[k]).abs() < 1e-6 * right[2].abs(), "{right:?} {left:?}");
    }
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    let family: Vec<hdf5::types::VarLenUnicode> =
        file.dataset("modes/upper/family").and_then(|d| d.read_raw()).expect("names of the modes");
    let symmetric: Vec<bool> = family.iter().map(|name| name.starts_with("symmetric")).collect();
    let shares = numbers(&folder, "stability/participation");
    let values = eigenvalues(&folder);
    let modes = shares.len() / values.len();
    let mut seen = [0; 2];
    for (k, value) in values.iter().enumerate() {
        // Neighbours may be mixed by rounding.
        let others: Vec<[f64; 2]> =
            values.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, other)| *other).collect();
        if apart(value, &others) < 1e-5 {
            continue;
        }
        let own = &shares[modes * k..modes * (k + 1)][modes - symmetric.len()..];
        let part = |which: bool| own.iter().zip(&symmetric).filter(|(_, s)| **s == which).map(|(v, _)| v).sum::<f64>();
        let [even, odd] = [part(true), part(false)];
        if even + odd > 0.1 {
            assert!(even.min(odd) < 1e-6, "{value:?}: {even} symmetric, {odd} antisymmetric");
            seen[usize::from(odd > even)] += 1;
        }
    }
    assert!(seen.iter().all(|count| *count > 3), "{seen:?}");
}

/// Refusals of what both wheels need and do not go with.
#[test]
fn mistakes_about_both_wheels_are_told() {
    let told = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        let mut job = both_wheels();
        change(&mut job);
        Folder::with(job.to_string()).call(1, "check", &[]).failed(2, parts);
    };
    told(
        &|job| {
            let upper = &mut job["bodies"]["upper"];
            upper["mesh"] = json!({ "revolved": { "section": "W920S" } });
            (upper["suspension"], upper["fixed"]) = (Value::Null, json!(["inner"]));
        },
        &["bodies.upper.mesh: contact.wheels = \"both\" takes a wheelset of two wheels with running lines"],
    );
    told(
        &|job| {
            (job["curve"], job["vehicle"], job["contact"]["from"]) = (Value::Null, Value::Null, Value::Null);
            (job["contact"]["normal_load"], job["contact"]["speed"]) = (json!(60e3), json!(10));
            job["contact"]["placement"] =
                json!({ "side": "right", "radius": 0.46, "circles": 1.54, "touch_near": 0.0 });
        },
        &["found running circles 1.54 m apart", "contact.placement.touch_near: names one place"],
    );
}
