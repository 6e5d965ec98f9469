//! An axle under a given torque: its angular speed follows from the creep forces of its contacts.

use super::both_wheels::on_straight_track;
use super::program::*;
use num_complex::Complex64;
use serde_json::{json, Value};

fn number(folder: &Folder, file: &str, name: &str) -> f64 {
    numbers(folder, file, name)[0]
}

fn numbers(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A yawed wheel between half-spaces, as `jobs/wheel-on-rail-contact.json` has it, with a torque in place of its
/// angular speed.
fn under(torque: Value) -> Value {
    let mut job = job("wheel-on-rail-contact.json");
    job["contact"]["placement"]["angular_speed"] = Value::Null;
    job["contact"]["torque"] = torque;
    job
}

/// The wheel of the job at its angular speed Ω has the torque r (F_x + T ψ/cos δ) about the axle, with the force F_x
/// forwards and T to the right on the wheel; under this torque it has this Ω again. What is left of the difference is
/// that the forces act beside the middle of a contact that leans (r M_z sin δ over all, below 1e-3 of μ N r).
#[test]
fn the_angular_speed_of_a_torque_has_this_torque() {
    let given = job("wheel-on-rail-contact.json");
    let placement = &given["contact"]["placement"];
    let [speed, yaw] = ["angular_speed", "yaw"].map(|key| placement[key].as_f64().expect("a number"));
    let folder = Folder::with(given.to_string());
    folder.call(1, "run", &[]).good();
    let force = numbers(&folder, "job.h5", "contact/force");
    let radius = number(&folder, "job.h5", "placement/rolling_radius");
    let angle = number(&folder, "job.h5", "placement/tilt");
    let torque = radius * (force[0] - force[1] * yaw / angle.cos());
    let scale = radius * 0.3 * -force[2];
    assert!(torque.abs() > 0.1 * scale, "{torque} N m says little beside {scale}");
    std::fs::write(folder.path("job.json"), under(json!(torque)).to_string()).expect("the job");
    for ranks in [1, 2] {
        folder.call(ranks, "run", &["--output", &folder.text("torque.h5"), "--force"]).good();
        let left = torque + number(&folder, "torque.h5", "contact/torque");
        assert!(left.abs() < 1e-8 * scale, "{left} N m are left");
        let found = number(&folder, "torque.h5", "contact/angular_speed");
        // The creep force falls by some 2 μ N over 1 % of creepage here.
        assert!((found / speed - 1.0).abs() < 1e-5, "{found} rad/s, given were {speed}");
        let there = numbers(&folder, "torque.h5", "contact/force");
        assert!(force.iter().zip(&there).all(|(a, b)| (a - b).abs() < 1e-3 * scale / radius), "{force:?} {there:?}");
    }
    // The angular speed as a key has the same forces.
    let found = number(&folder, "torque.h5", "contact/angular_speed");
    let mut again = given;
    again["contact"]["placement"]["angular_speed"] = json!(found);
    std::fs::write(folder.path("job.json"), again.to_string()).expect("the job");
    folder.call(1, "run", &["--output", &folder.text("again.h5")]).good();
    let [there, again] = ["torque.h5", "again.h5"].map(|file| numbers(&folder, file, "contact/force"));
    assert!(there.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-7 * scale / radius), "{there:?} {again:?}");
}

/// At the flange root spin rules the grid at some angular speeds and not at others: under a torque it is one grid. V/r
/// is beyond the largest torque of a friction that falls with the velocity; the angular speed is found before it.
#[test]
fn a_flange_root_under_a_torque_keeps_its_grid() {
    let mut job = under(json!(900));
    job["contact"]["speed"] = json!(20);
    job["contact"]["friction"] = json!({ "exponential": { "static": 0.5, "kinetic": 0.1, "decay_velocity": 0.05 } });
    for (key, value) in [("lateral", -6.5e-3), ("yaw", 0.0), ("roll", 0.0)] {
        job["contact"]["placement"][key] = json!(value);
    }
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("creepages of contact 1"), "{}", ran.out);
    let left = 900.0 + number(&folder, "job.h5", "contact/torque");
    assert!(left.abs() < 1e-8 * 0.5 * 10020.0 * 0.46, "{left} N m are left");
    let creepage = numbers(&folder, "job.h5", "placement/creepage");
    assert!((-3e-3..0.0).contains(&creepage[0]), "{creepage:?}");
    let force = numbers(&folder, "job.h5", "contact/force");
    assert!((0.46 * force[0] / 900.0 - 1.0).abs() < 0.05, "{force:?}");
}

/// A creepage that is given changes the force of a contact, not what the force does when the axle turns. With the
/// lateral creepage of its yaw the wheel is as without it.
#[test]
fn a_given_creepage_leaves_the_torque_that_of_the_motion() {
    let lateral = |creepage: Value| {
        let mut job = under(json!(0));
        job["contact"]["placement"]["creepage"] = creepage;
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).good();
        (numbers(&folder, "job.h5", "contact/force"), numbers(&folder, "job.h5", "placement/creepage")[1])
    };
    let (free, own) = lateral(json!({}));
    let (given, _) = lateral(json!({ "lateral": own }));
    assert!(free[0].abs() > 10.0 && (free[0] - given[0]).abs() < 0.1, "{free:?} {given:?}");
}

/// A torque that friction cannot hold, and keys that contradict it.
#[test]
fn torques_that_cannot_be_are_refused() {
    let refused = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        let mut job = under(json!(50));
        change(&mut job);
        Folder::with(job.to_string()).call(1, "run", &[]).failed(2, parts);
    };
    refused(&|job| job["contact"]["torque"] = json!(5e4), &["contact.torque: found 50000 N m", "do not balance"]);
    refused(
        &|job| job["contact"]["placement"]["angular_speed"] = json!(2.0),
        &["contact.torque", "contact.placement.angular_speed", "leave one of the two out"],
    );
    refused(
        &|job| job["contact"]["placement"]["creepage"] = json!({ "longitudinal": 0.0 }),
        &["contact.torque", "contact.placement.creepage.longitudinal"],
    );
    refused(
        &|job| job["analyses"]["creep_curve"] = json!({ "key": "lateral", "values": [0.001] }),
        &["contact.torque", "analyses.creep_curve"],
    );
    refused(
        &|job| job["contact"]["friction"] = json!(0),
        &["contact.torque: found 50 N m", "no friction", "expected 0"],
    );
    let mut flange = job("flange.json");
    flange["contact"]["torque"] = json!(0);
    Folder::with(flange.to_string()).call(1, "check", &[]).failed(2, &["contact.torque", "contact.wheels", "both"]);
    let mut one_place = job("wheelset-both-wheels.json");
    one_place["contact"]["torque"] = json!(0);
    let parts = ["contact.torque", "leading outer wheel touches at two places", "contact.places = \"all\""];
    Folder::with(one_place.to_string()).call(1, "check", &[]).failed(2, &parts);
    one_place["contact"]["torque"] = json!(10);
    Folder::with(one_place.to_string()).call(1, "check", &[]).failed(2, &["contact.torque", "vehicle.torque", "0 N m"]);
}

/// Both wheels of a braked wheelset: their creep forces have the torque of the brake, on one rank and on two. A point
/// of a sweep with this torque has the eigenvalues of the run by itself.
#[test]
#[ignore = "long: scripts/validate long"]
fn both_wheels_share_the_torque_of_a_brake() {
    let brake = -2000.0;
    let mut job = on_straight_track(json!({
        "steady": {}, "stability": {}, "sweep": { "keys": { "contact.torque": [0.0, brake] } }
    }));
    job["contact"]["placement"]["creepage"] = json!({});
    job["contact"]["torque"] = json!(brake);
    let folder = Folder::with(job.to_string());
    let friction = job["contact"]["friction"].as_f64().expect("a number");
    let scale = 2.0 * friction * 20e3 * 0.46;
    let mut speeds = Vec::new();
    for ranks in [1, 2] {
        folder.call(ranks, "run", &["--force"]).good();
        let left = brake + number(&folder, "job.h5", "contact/torque");
        assert!(left.abs() < 1e-8 * scale, "{left} N m are left");
        let forces = ["contact/force", "contact_2/force"].map(|name| numbers(&folder, "job.h5", name)[0]);
        assert!((forces[0] + forces[1] - brake / 0.46).abs() < 0.01 * 2000.0 / 0.46, "{forces:?}");
        speeds.push(number(&folder, "job.h5", "contact/angular_speed"));
        let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
        let values = |name: &str| file.dataset(name).and_then(|d| d.read_raw::<Complex64>()).expect("eigenvalues");
        let (own, all) = (values("stability/eigenvalue"), values("sweep/eigenvalue"));
        let offset: Vec<i64> = file.dataset("sweep/offset").and_then(|d| d.read_raw()).expect("offsets");
        let braked = &all[offset[1] as usize..];
        let angular: Vec<f64> = file.dataset("sweep/angular_speed").and_then(|d| d.read_raw()).expect("speeds");
        let own_speed = speeds[speeds.len() - 1];
        assert!((angular[1] / own_speed - 1.0).abs() < 1e-9 && angular[0] > angular[1], "{angular:?} {own_speed}");
        for value in braked {
            let apart = own.iter().map(|v| (v - value).norm()).fold(f64::INFINITY, f64::min);
            assert!(apart < 1e-6 * value.norm() + 1e-6, "{value} of the sweep is {apart} from any of {own:?}");
        }
        let force: Vec<f64> = file.dataset("sweep/force").and_then(|d| d.read_raw()).expect("forces");
        // Either wheel bears half of the brake, beside what they do to each other on different radii.
        let half = (force[3] - force[0]) / (0.5 * brake / 0.46);
        assert!((half - 1.0).abs() < 0.05, "{force:?}");
    }
    assert!((speeds[0] / speeds[1] - 1.0).abs() < 1e-9, "{speeds:?}");
}
