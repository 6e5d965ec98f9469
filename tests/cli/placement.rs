//! A wheel on a rail by their profiles, in whole runs.

use super::program::*;
use serde_json::{json, Value};

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn wheel_on_rail() -> Value {
    job("wheel-on-rail-contact.json")
}

/// `jobs/wheel-on-rail-contact.json` beside CONTACT, case 13 of the Manchester benchmark, left wheel: Fx 973 N
/// and Fs −2845 N in its axes, on the rail, approach 22.78 µm, 578.5 MPa; the point of contact at −3.3 mm of the
/// rail's profile. The same on two ranks.
#[test]
fn the_forces_are_those_of_contact() {
    for ranks in [1, 2] {
        let folder = Folder::with(wheel_on_rail().to_string());
        let ran = folder.call(ranks, "run", &[]);
        assert!(ran.good().out.contains("wheel on rail: touch at y ="), "{}", ran.out);
        let force = numbers(&folder, "contact/force");
        // x is backwards in the program.
        for (found, want) in [(-force[0], 973.0), (force[1], -2845.0)] {
            assert!((found - want).abs() < 0.003 * 3006.0, "{force:?}");
        }
        let approach = numbers(&folder, "contact/approach")[0];
        assert!((approach - 22.78e-6).abs() < 0.05e-6, "{approach}");
        let peak = numbers(&folder, "contact/pressure").into_iter().fold(0.0, f64::max);
        assert!((peak / 578.5e6 - 1.0).abs() < 4e-3, "{peak}");
        // ξ, η, φ of CONTACT: −0.004901, 0.01437, −1.957e-5 1/mm.
        let creepage = numbers(&folder, "placement/creepage");
        for (found, want) in creepage.iter().zip([0.004901, 0.01437, 0.01957]) {
            assert!((found / want - 1.0).abs() < 2e-3, "{creepage:?}");
        }
        assert!((numbers(&folder, "placement/tilt")[0] - 0.0084).abs() < 1e-4);
    }
}

/// Left and right are mirror images; a creepage that is given takes the place of its own.
#[test]
fn sides_are_mirrored_and_creepages_are_overridden() {
    let run = |change: &dyn Fn(&mut Value)| {
        let mut job = wheel_on_rail();
        change(&mut job["contact"]["placement"]);
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).good();
        (numbers(&folder, "contact/force"), numbers(&folder, "placement/creepage"))
    };
    let (left, _) = run(&|_| {});
    let (right, _) = run(&|p| {
        p["side"] = json!("right");
        for key in ["lateral", "yaw", "roll"] {
            p[key] = json!(-p[key].as_f64().expect("a number"));
        }
    });
    for (c, sign) in [(0, 1.0), (1, -1.0), (2, 1.0)] {
        assert!((left[c] - sign * right[c]).abs() < 1e-6 * left[2].abs(), "{left:?} {right:?}");
    }
    let (force, creepage) = run(&|p| p["creepage"] = json!({ "longitudinal": 0.0, "lateral": -0.002, "spin": 0.0 }));
    assert_eq!(creepage, [0.0, -0.002, 0.0]);
    assert!(force[0].abs() < 0.01 * 3006.0 && force[1] > 0.5 * 3006.0, "{force:?}");
}

/// Output of `check` on the geometry, a profile from a file, and a creep curve on it.
#[test]
fn a_profile_from_a_file_is_checked_and_rolled() {
    let mut job = wheel_on_rail();
    job["bodies"]["upper"]["profile"] = json!({ "file": { "path": "wheel.txt" } });
    job["contact"]["placement"]["yaw"] = json!(0.0);
    job["analyses"] = json!({ "creep_curve": { "key": "lateral", "values": { "from": 0, "to": 0.01, "count": 5 } } });
    let folder = Folder::with(job.to_string());
    // A cone of 1:20 with a flange, mm, z down.
    let z = |y: f64| if y < -34.0 { 1.7 + 1.2 * (-34.0 - y) } else { -0.05 * y };
    let text: String = (-50..=60).map(|y| format!("{} {}\n", y, z(f64::from(y)))).collect();
    std::fs::write(folder.path("wheel.txt"), text).expect("write the profile");
    let checked = folder.call(1, "check", &[]);
    assert!(checked.good().out.contains("contact angle") && checked.out.contains("rolling radius"), "{}", checked.out);
    folder.call(1, "run", &[]).good();
    let force = numbers(&folder, "creep_curve/force");
    let lateral: Vec<f64> = force.chunks_exact(3).map(|f| f[1]).collect();
    assert!(lateral.windows(2).all(|w| w[1] < w[0]) && lateral[0].abs() < 200.0, "{lateral:?}");
}

#[test]
fn mistakes_are_named() {
    /// A change of the job, the exit code, and what is said.
    type Case<'c> = (&'c dyn Fn(&mut Value), i32, &'c [&'c str]);
    let cases: [Case; 8] = [
        (&|j| j["bodies"]["lower"]["profile"] = Value::Null, 2, &["bodies.lower.profile: missing", "60E1"]),
        (&|j| j["bodies"]["lower"]["profile"] = json!("S1002"), 2, &["bodies.lower.profile", "a wheel"]),
        (&|j| j["contact"]["placement"] = Value::Null, 2, &["bodies.lower.profile: given without contact.placement"]),
        (&|j| j["contact"]["compliance"] = json!("fe"), 2, &["contact.compliance", "half_space"]),
        (
            &|j| j["contact"]["creepage"] = json!({ "lateral": 0.01 }),
            2,
            &["contact.creepage", "contact.placement.creepage"],
        ),
        (&|j| j["contact"]["placement"]["radius"] = json!(460), 2, &["radius of the wheel of 460 m"]),
        (&|j| j["contact"]["placement"]["lateral"] = json!(0.15), 2, &["contact.placement"]),
        (&|j| j["bodies"]["upper"]["profile"] = json!({ "file": { "path": "gone.prw" } }), 3, &["gone.prw"]),
    ];
    for (change, code, words) in cases {
        let mut job = wheel_on_rail();
        change(&mut job);
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).failed(code, words);
        folder.untouched();
    }
}

/// The wheel of `jobs/wheel-at-given-yaw.json` up to 1.5 kHz, on a rail that is a half-space at the contact and nothing
/// else.
fn wheel_on_a_stiff_rail() -> Value {
    let mut job = job("wheel-at-given-yaw.json");
    let rail = &mut job["bodies"]["lower"];
    *rail = json!({ "profile": "60E1", "material": rail["material"].clone() });
    job["analyses"] = json!({ "modes": { "max_frequency": 1500 }, "stability": {} });
    job
}

/// On a rail without inertia one wheel mode has no phase to feed it: nothing squeals. Left and right are mirror
/// images; two ranks have the same; what is known of a wheel damps it by its nodal diameters.
#[test]
fn a_wheel_on_a_stiff_rail_is_stable() {
    let folder = Folder::with(wheel_on_a_stiff_rail().to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("0 unstable of") && ran.out.contains("(2, axial 0)"), "{}", ran.out);
    let right = ["growth_rate", "frequency"].map(|name| numbers(&folder, &format!("stability/{name}")));
    // W920S: n = 0, 1, 2, 3 axial at 150.1, 99.7, 350.6, 975.5 Hz; waves at 10 m/s on 460 mm turn with the wheel or
    // against it.
    let waves = numbers(&folder, "modes/upper/wave_frequency");
    let omega = 10.0 / 0.46;
    assert!((numbers(&folder, "modes/upper/angular_velocity")[0] - omega).abs() < 1e-12);
    let split = 2.0 * 1.9331 * omega / (2.0 * std::f64::consts::PI);
    assert!((waves[4] - waves[3] - split).abs() < 0.03, "{waves:?}");
    let orders = numbers(&folder, "modes/upper/diameters");
    assert_eq!(orders[..5].iter().map(|n| n.round()).collect::<Vec<_>>(), [1.0, 1.0, 0.0, 2.0, 2.0]);
    let mut job = wheel_on_a_stiff_rail();
    job["contact"]["placement"]["side"] = json!("left");
    for key in ["lateral", "yaw"] {
        let value = job["contact"]["placement"][key].as_f64().expect("a number");
        job["contact"]["placement"][key] = json!(-value);
    }
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let left = ["growth_rate", "frequency"].map(|name| numbers(&folder, &format!("stability/{name}")));
    for (right, left) in right.iter().zip(&left) {
        let apart = right.iter().zip(left).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(right.len() == left.len() && apart < 1e-5, "{apart:e}");
    }
}

/// Impossible sections on a placement are refused.
#[test]
fn sections_on_a_placement_are_checked() {
    type Change = fn(&mut Value);
    let cases: [(Change, &[&str]); 6] = [
        (
            |j| {
                j["bodies"]["lower"]["mesh"] = json!({ "extruded": { "section": "60E1" } });
                j["contact"]["placement"]["lateral"] = json!(0.020);
            },
            &["contact.placement", "off its tread", "lateral shift"],
        ),
        (
            |j| j["bodies"]["upper"]["mesh"]["revolved"]["contact_offset"] = json!(0.01),
            &["bodies.upper.mesh.revolved.contact_offset", "the place of the contact follows"],
        ),
        (|j| j["contact"]["compliance"] = json!("half_space"), &["contact.compliance", "\"hybrid\""]),
        (
            |j| j["bodies"]["lower"]["mesh"] = json!({ "revolved": { "section": "W920S" } }),
            &["bodies.lower.mesh.revolved", "a rail does not turn"],
        ),
        (
            |j| j["bodies"]["upper"]["damping"] = json!({ "modal": { "by_diameter": [] } }),
            &["bodies.upper.damping.modal.by_diameter", "the list is empty"],
        ),
        (|j| j["bodies"]["lower"]["fixed"] = json!(["foot"]), &["bodies.lower.fixed", "a half-space has none"]),
    ];
    for (change, words) in cases {
        let mut job = wheel_on_a_stiff_rail();
        change(&mut job);
        Folder::with(job.to_string()).refused(1, &[], 2, words);
    }
    // The rail is touched on its face, the wheel on its flange.
    let mut flange = job("wheel-at-given-yaw.json");
    flange["contact"]["placement"]["lateral"] = json!(0.010);
    let ran = Folder::with(flange.to_string()).call(1, "check", &[]);
    assert!(ran.good().out.contains("touch at y = -41.0"), "{}", ran.out);
}

/// Points of a sweep stand where their own placements say, with the creepages of these: the last one is the job's own.
#[test]
fn sweeps_move_the_wheel() {
    let mut job = wheel_on_a_stiff_rail();
    job["analyses"]["modes"]["max_frequency"] = json!(500);
    job["analyses"]["sweep"] =
        json!({ "keys": { "contact.placement.lateral": [-0.004, -0.006], "contact.friction": [0.35] } });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let own = numbers(&folder, "stability/force");
    let swept = numbers(&folder, "sweep/force");
    let apart = |point: usize| (0..3).map(|c| (swept[3 * point + c] - own[c]).abs()).fold(0.0, f64::max);
    assert!(apart(1) < 1e-6 * 6e4 && apart(0) > 1.0, "{own:?} {swept:?}");
}

/// A sweep over places takes the modes of both sections from the first place, and makes its models from few numbers:
/// what it finds at the second place is what a run there finds, which does neither.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_place_among_others_is_that_by_itself() {
    let mut job = job("wheel-at-given-yaw.json");
    job["analyses"] = json!({
        "modes": { "max_frequency": 500 },
        "stability": {},
        "sweep": { "keys": { "contact.placement.lateral": [-0.003, -0.005], "contact.friction": [0.3, 0.4] } },
    });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let [growth, frequency] = ["sweep/growth_rate", "sweep/frequency"].map(|name| numbers(&folder, name));
    job["contact"]["placement"]["lateral"] = json!(-0.005);
    job["contact"]["friction"] = json!(0.4);
    job["analyses"]["sweep"] = Value::Null;
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let alone = ["stability/growth_rate", "stability/frequency"].map(|name| numbers(&folder, name)[0]);
    let rate = 2.0 * std::f64::consts::PI * alone[1];
    assert!((growth[3] - alone[0]).abs() < 1e-8 * rate, "{growth:?} 1/s, alone {alone:?}");
    assert!((frequency[3] / alone[1] - 1.0).abs() < 1e-8, "{frequency:?} Hz, alone {alone:?}");
    // The places differ by more than that.
    assert!((growth[1] - alone[0]).abs() > 1e-5 * rate, "{growth:?} 1/s, alone {alone:?}");
}

/// With a placement under the load, the forces are those of half-spaces, whatever the rail gives way by, and a
/// transient begins at rest.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_rail_that_gives_way_has_the_forces_of_half_spaces() {
    let mut job = job("wheel-at-given-yaw.json");
    job["analyses"] =
        json!({ "modes": { "max_frequency": 300 }, "steady": {}, "transient": { "duration": 2e-3, "step": 1e-5 } });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(2, "run", &[]);
    assert!(ran.good().out.contains("structural deflection under load"), "{}", ran.out);
    let force = numbers(&folder, "contact/force");
    let deflection = numbers(&folder, "contact/deflection");
    // 61 and 31 nm/N along y of rail and wheel, under 21 kN.
    assert!(
        (deflection[1].abs() - 92.2e-9 * force[1].abs()).abs() < 0.1e-3 && deflection[2] > 0.1e-3,
        "{deflection:?}"
    );
    let history = numbers(&folder, "transient/force");
    // Steps settle beside the steady state by what their operator of the leading edge is another one: 20 N at once,
    // then 6 N, as wheels without a placement do.
    let moved: Vec<f64> =
        history.chunks_exact(3).map(|f| (0..3).map(|c| (f[c] - force[c]).abs()).fold(0.0, f64::max)).collect();
    let largest = moved.iter().fold(0.0, |m: f64, v| m.max(*v));
    assert!(largest < 1e-3 * force[2].abs() && moved[moved.len() - 1] < 2e-4 * force[2].abs(), "{largest}");
    for body in ["lower", "upper"] {
        let keys = job["bodies"][body].as_object_mut().expect("a body");
        keys.remove("mesh");
        keys.remove("fixed");
    }
    job["contact"]["compliance"] = json!("half_space");
    job["analyses"] = json!({ "steady": {} });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let alone = numbers(&folder, "contact/force");
    assert!((0..3).all(|c| (force[c] - alone[c]).abs() < 1e-5 * force[2].abs()), "{force:?} {alone:?}");
}
