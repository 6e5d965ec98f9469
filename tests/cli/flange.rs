//! Several contacts of one wheel, in whole runs.

use super::interrupted::{same, start, wait_for};
use super::program::*;
use serde_json::{json, Value};
use std::process::Command;

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A job of a wheel in a curve with modes up to 1100 Hz.
fn in_curve(name: &str) -> Value {
    let mut job = job(name);
    job["analyses"] = json!({ "modes": { "max_frequency": 1100 }, "steady": {}, "stability": {} });
    job
}

/// The outer wheel of `jobs/flange.json` has two contacts with the loads of the equilibrium in the curve, whose creep
/// forces all but slide.
#[test]
#[ignore = "long: scripts/validate long"]
fn flange_root_and_flange_are_solved_at_once() {
    let folder = Folder::with(in_curve("flange.json").to_string());
    let ran = folder.call(2, "run", &[]);
    let text = ran.good().out.clone();
    assert!(text.contains("contact 2: y = -38.65 mm") && !text.contains("left out"), "{text}");
    let forces = ["contact/force", "contact_2/force"].map(|name| numbers(&folder, name));
    let normal = numbers(&folder, "curving/contacts/normal_force");
    let wheels: Vec<f64> = forces.iter().map(|f| -f[2]).collect();
    assert!(wheels.iter().all(|n| normal.iter().any(|m| (n / m - 1.0).abs() < 1e-6)), "{wheels:?} {normal:?}");
    let sliding: Vec<f64> = forces.iter().map(|f| f[0].hypot(f[1]) / (0.4 * -f[2])).collect();
    assert!(sliding.iter().all(|s| (0.97..=1.0).contains(s)), "{sliding:?}");
    let tilt = ["placement/tilt", "placement_2/tilt"].map(|name| numbers(&folder, name)[0]);
    assert!(tilt[0] > 0.3 && tilt[1] > 1.1, "{tilt:?}");
    // In wider curves both meet on the gauge corner of the rail.
    let mut wide = in_curve("flange.json");
    wide["curve"]["radius"] = json!(250);
    let folder = Folder::with(wide.to_string());
    let out = folder.call(2, "run", &[]).good().out.clone();
    assert!(out.contains("ends where another contact of the wheel begins"), "{out}");
    let [rail, wheel] = ["lower", "upper"].map(|of| numbers(&folder, &format!("reduced/{of}/near_contacts")));
    // The surfaces lean the opposite way in lower form, and their contact points are the same.
    assert!(rail.len() == 5 && (rail[4] + wheel[4]).abs() < 1e-3 && (rail[4].abs() - 0.456).abs() < 1e-3, "{rail:?}");
    assert!((2..4).all(|k| (rail[k] - wheel[k]).abs() < 0.1e-3), "{rail:?} {wheel:?}");
}

/// The wheel of `jobs/flange.json` with a lubricated gauge face: `check` says which contact is in the zone, and which
/// zone holds none.
#[test]
fn contacts_are_told_their_zone_of_friction() {
    let mut job = in_curve("flange.json");
    job["contact"]["friction_zones"] = json!([
        { "rail": "outer", "from_angle": 0.9, "friction": 0.15 },
        { "rail": "inner", "from_angle": 0.9, "friction": 0.1 }
    ]);
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "check", &[]);
    for part in [
        "friction 0.4 of contact.friction, outside all zones",
        "friction 0.15 of contact.friction_zones.0",
        "contact.friction_zones.1 holds none of the contacts examined",
    ] {
        assert!(ran.good().out.contains(part), "{part}: {}", ran.out);
    }
    // The flange root has 0.483 rad at first touch, as the vehicle sees it, and 0.528 rad in its frame.
    job["contact"]["friction_zones"] = json!([{ "rail": "outer", "from_angle": 0.5, "friction": 0.15 }]);
    let ran = Folder::with(job.to_string()).call(1, "check", &[]);
    let out = &ran.good().out;
    assert!(out.matches("outside all zones").count() == 1 && out.matches("of contact.friction_zones.0").count() == 1);
    for (zones, wanted) in [
        (json!([{ "friction": 0.1 }]), "contact.friction_zones.0: gives neither rail nor from_angle"),
        (json!([{ "from_angle": 28, "friction": 0.1 }]), "contact.friction_zones.0.from_angle: found 28"),
        (json!([{ "rail": "outside", "friction": 0.1 }]), "contact.friction_zones.0.rail"),
        (json!([{ "rail": "outer", "friction": -0.1 }]), "contact.friction_zones.0.friction"),
    ] {
        job["contact"]["friction_zones"] = zones;
        let ran = Folder::with(job.to_string()).call(1, "check", &[]);
        assert!(ran.code == Some(2) && ran.err.contains(wanted), "{wanted}: {:?} {}", ran.code, ran.err);
    }
    let mut straight = self::job("wheel-at-given-yaw.json");
    straight["contact"]["friction_zones"] = json!([{ "rail": "inner", "friction": 0.1 }]);
    let ran = Folder::with(straight.to_string()).call(1, "check", &[]);
    assert!(ran.code == Some(2) && ran.err.contains("but the track is straight"), "{}", ran.err);
    let mut cylinders = self::job("two-cylinders.json");
    cylinders["contact"]["friction_zones"] = json!([{ "rail": "left", "friction": 0.1 }]);
    let ran = Folder::with(cylinders.to_string()).call(1, "check", &[]);
    assert!(ran.code == Some(2) && ran.err.contains("zones lie on the rails of a track"), "{}", ran.err);
}

/// With a lubricated gauge face the flange carries the load of an equilibrium in which it slides more easily, under its
/// own bound of friction, and the result says which contact that is.
#[test]
#[ignore = "long: scripts/validate long"]
fn lubricated_flange_slides_under_its_own_friction() {
    let mut job = in_curve("flange.json");
    job["contact"]["friction_zones"] = json!([{ "rail": "outer", "from_angle": 0.9, "friction": 0.15 }]);
    let folder = Folder::with(job.to_string());
    folder.call(2, "run", &[]).good();
    let mut seen = Vec::new();
    for number in ["", "_2"] {
        let [x, y, z] = numbers(&folder, &format!("contact{number}/force"))[..] else { panic!("three components") };
        let steep = numbers(&folder, &format!("placement{number}/tilt"))[0] > 0.9;
        let zone = numbers(&folder, &format!("placement{number}/friction_zone"))[0];
        assert_eq!(zone, if steep { 0.0 } else { -1.0 });
        let bound = if steep { 0.15 } else { 0.4 };
        let used = x.hypot(y) / (bound * -z);
        assert!((0.95..=1.0 + 1e-9).contains(&used), "{used} of {bound}");
        let friction = numbers(&folder, &format!("contact{number}/friction"));
        assert!(friction.iter().all(|mu| *mu == bound));
        seen.push(steep);
    }
    assert!(seen.contains(&true) && seen.contains(&false));
    let friction: Vec<f64> = seen.iter().map(|steep| if *steep { 0.15 } else { 0.4 }).collect();
    assert_eq!(numbers(&folder, "contacts/friction"), friction);
    let angle = ["placement/tilt", "placement_2/tilt"].map(|name| numbers(&folder, name)[0]);
    assert_eq!(numbers(&folder, "contacts/contact_angle"), angle);
    let (angle, friction) = ("curving/contacts/contact_angle", "curving/contacts/friction");
    let placed = numbers(&folder, angle).into_iter().zip(numbers(&folder, friction));
    assert!(placed.filter(|(_, mu)| *mu == 0.15).all(|(angle, _)| angle > 0.9));
}

/// With two contacts a left curve is the mirror image of a right one.
#[test]
#[ignore = "long: scripts/validate long"]
fn two_contacts_in_a_left_curve_are_those_of_a_right_one() {
    let mut job = in_curve("flange.json");
    let folder = Folder::with(job.to_string());
    folder.call(2, "run", &[]).good();
    let right = ["stability/frequency", "stability/growth_rate"].map(|name| numbers(&folder, name));
    job["curve"]["direction"] = json!("left");
    let mirrored = Folder::with(job.to_string());
    mirrored.call(1, "run", &[]).good();
    let left = ["stability/frequency", "stability/growth_rate"].map(|name| numbers(&mirrored, name));
    for k in 0..4 {
        let rate = 2.0 * std::f64::consts::PI * right[0][k];
        let apart = (2.0 * std::f64::consts::PI * (left[0][k] - right[0][k])).hypot(left[1][k] - right[1][k]);
        assert!(apart < 1e-5 * rate, "{k}: {right:?} {left:?}");
    }
}

/// In time both contacts bear the loads of the equilibrium at each step, alike on one rank and on two, and a run that
/// is killed goes on to the same bits.
#[test]
#[ignore = "long: scripts/validate long"]
fn two_contacts_roll_in_time_and_go_on_after_a_kill() {
    let mut job = in_curve("flange.json");
    job["analyses"] = json!({
        "modes": { "max_frequency": 1100 },
        "transient": {
            "duration": 4e-4, "step": 1e-5, "hold": "load", "segment": 5, "contact_stride": 5,
            "start": { "state": "steady", "random": { "seed": 3, "energy": 1e-2 } }
        }
    });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let normal = numbers(&folder, "curving/contacts/normal_force");
    let forces = ["transient/force", "transient_2/force"].map(|name| numbers(&folder, name));
    for force in &forces {
        assert_eq!(force.len(), 3 * 40);
        let load = normal.iter().copied().min_by(|a, b| (a + force[2]).abs().total_cmp(&(b + force[2]).abs()));
        let load = load.expect("contacts of the vehicle");
        let apart = force.chunks(3).map(|f| (f[2] + load).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-8 * load, "{apart} of {load} N");
        let moved = force.chunks(3).map(|f| (f[0] - force[0]).abs()).fold(0.0, f64::max);
        assert!(moved > 1e-6 * load, "nothing moves: {moved} N");
    }
    assert!((forces[0][2] - forces[1][2]).abs() > 1.0, "the same contact twice");
    for group in ["transient", "transient_2"] {
        let nodes = numbers(&folder, &format!("{group}/grid/x")).len();
        assert_eq!(numbers(&folder, &format!("{group}/contact_pressure")).len(), 8 * nodes);
        let weight = numbers(&folder, &format!("{group}/grid/weight"));
        let pressure = numbers(&folder, &format!("{group}/contact_pressure"));
        let sum: f64 = pressure[7 * nodes..].iter().zip(&weight).map(|(p, w)| p * w).sum();
        let last = numbers(&folder, &format!("{group}/force"))[3 * 39 + 2];
        assert!((sum / -last - 1.0).abs() < 1e-10, "{group}: {sum} and {last} N");
    }
    let killed = folder.text("killed.h5");
    let mut child = start(Command::new(PROGRAM), &["run", &folder.text("job.json"), "--output", &killed]);
    wait_for(&folder.path("killed.transient"), 3, &mut child);
    child.kill().expect("kill");
    child.wait().expect("wait");
    folder.call(1, "run", &["--resume", &killed]).good();
    let [whole, killed] = ["job.h5", "killed.h5"].map(|name| hdf5::File::open(folder.path(name)).expect("a result"));
    same(&whole, &killed);
    let last = |file: &hdf5::File| {
        let force = file.dataset("transient_2/force").and_then(|d| d.read_raw::<f64>()).expect("forces");
        force.iter().map(|f| f.to_bits()).collect::<Vec<_>>()
    };
    assert!(last(&whole) == last(&killed));
    drop((whole, killed));
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    let two = hdf5::File::open(folder.path("two.h5")).expect("a result");
    for (name, one) in ["transient/force", "transient_2/force"].iter().zip(&forces) {
        let two: Vec<f64> = two.dataset(name).and_then(|d| d.read_raw()).expect("forces");
        let apart = one.iter().zip(&two).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-6 * one[2].abs(), "{name}: {apart} N");
    }
}

/// The inner wheel touches at one place: all places are that one.
#[test]
#[ignore = "long: scripts/validate long"]
fn all_places_of_a_wheel_with_one_contact_are_that_one() {
    let mut job = in_curve("wheel-on-rail.json");
    let one = Folder::with(job.to_string());
    one.call(1, "run", &[]).good();
    job["contact"]["places"] = json!("all");
    let all = Folder::with(job.to_string());
    all.call(1, "run", &[]).good();
    for name in ["contact/force", "stability/frequency", "stability/growth_rate"] {
        let (one, all) = (numbers(&one, name), numbers(&all, name));
        assert!(one.iter().zip(&all).all(|(a, b)| (a - b).abs() <= 1e-10 * a.abs().max(1.0)), "{name}");
    }
}

/// Two contacts on half-spaces, at the tread and at the gauge corner, share a vertical force, friction included.
#[test]
fn contacts_share_a_vertical_force() {
    let mut job = job("wheel-on-rail-contact.json");
    let contact = &mut job["contact"];
    contact["normal_load"] = Value::Null;
    contact["vertical_load"] = json!(60e3);
    contact["places"] = json!("all");
    let placement = &mut contact["placement"];
    (placement["side"], placement["roll"]) = (json!("right"), json!(0.0));
    (placement["lateral"], placement["yaw"]) = (json!(5.2e-3), json!(-2e-3));
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let vertical = [("contact", "placement"), ("contact_2", "placement_2")].map(|(contact, placement)| {
        let force = numbers(&folder, &format!("{contact}/force"));
        let tilt = numbers(&folder, &format!("{placement}/tilt"))[0];
        -force[2] * tilt.cos() + force[1] * tilt.sin()
    });
    assert!(vertical.iter().all(|v| *v > 20e3), "{vertical:?}");
    assert!(((vertical[0] + vertical[1]) / 60e3 - 1.0).abs() < 1e-8, "{vertical:?}");
}

/// Flange root and flange on half-spaces bear a vertical and a lateral force, friction included. A force that the wheel
/// bears nowhere, or at one place, is refused with the shifts or the range; so is one that does not tell the loads.
#[test]
fn a_wheel_bears_a_vertical_and_a_lateral_force() {
    let mut job = job("lateral-force.json");
    for body in ["lower", "upper"] {
        let of = job["bodies"][body].as_object_mut().expect("a body");
        ["mesh", "fixed"].iter().for_each(|key| drop(of.remove(*key)));
    }
    job["contact"]["compliance"] = json!("half_space");
    job["analyses"] = json!({ "steady": {} });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    let told = folder.call(1, "check", &[]);
    assert!(told.good().out.contains("vertical load 60000 N, lateral force -32000 N"), "{}", told.out);
    assert!(told.out.contains("lateral force of -32000 N on the wheel: a shift of 6."), "{}", told.out);
    assert!(ran.good().out.contains("lateral force of -32000 N on the wheel: a shift of 6."), "{}", ran.out);
    let forces = ["", "_2"].map(|number| {
        let force = numbers(&folder, &format!("contact{number}/force"));
        let (sin, cos) = numbers(&folder, &format!("placement{number}/tilt"))[0].sin_cos();
        [-force[2] * cos + force[1] * sin, -force[2] * sin - force[1] * cos, -force[2]]
    });
    let borne = [0, 1].map(|k| forces[0][k] + forces[1][k]);
    assert!((borne[0] - 60e3).abs() < 1e-3 && (borne[1] + 32e3).abs() < 1e-3, "{borne:?} N");
    assert!(forces.iter().all(|f| f[2] > 20e3), "{forces:?}");
    let shift = numbers(&folder, "placement/lateral_shift")[0];
    assert!((6.3e-3..6.7e-3).contains(&shift), "{shift} m");
    for (force, parts) in [
        (-100e3, ["contact.lateral_force: found -100000 N on the wheel", "beyond that it climbs its rail"]),
        (-2e3, ["which one place of contact carries", "give contact.placement.lateral"]),
    ] {
        job["contact"]["lateral_force"] = json!(force);
        Folder::with(job.to_string()).call(1, "check", &[]).failed(2, &parts);
    }
    job["contact"]["placement"]["lateral"] = json!(5e-3);
    let parts = ["contact.placement.lateral: found 0.005 m beside contact.lateral_force"];
    Folder::with(job.to_string()).call(1, "check", &[]).failed(2, &parts);
    job["contact"]["places"] = json!("one");
    let parts = ["contact.lateral_force: expected beside it contact.places"];
    Folder::with(job.to_string()).call(1, "check", &[]).failed(2, &parts);

    // Tread and gauge corner, whose creep forces make up for their angles.
    let mut alike = self::job("wheel-on-rail-contact.json");
    let contact = &mut alike["contact"];
    (contact["normal_load"], contact["vertical_load"]) = (Value::Null, json!(60e3));
    (contact["places"], contact["lateral_force"]) = (json!("all"), json!(-19149));
    let placement = contact["placement"].as_object_mut().expect("a placement");
    placement.remove("lateral");
    (placement["side"], placement["roll"], placement["yaw"]) = (json!("right"), json!(0.0), json!(-2e-3));
    Folder::with(alike.to_string()).call(1, "run", &[]).failed(2, &["hardly depends on how its contacts share"]);
}

/// Tread and gauge corner of swept bodies lie near each other with almost the same normal: the half-space acts between
/// them, and what is left without the modes is positive.
#[test]
#[ignore = "long: scripts/validate long"]
fn near_places_with_alike_normals_act_on_each_other() {
    let mut job = job("wheel-at-given-yaw.json");
    let contact = &mut job["contact"];
    contact["normal_load"] = Value::Null;
    contact["vertical_load"] = json!(60e3);
    contact["places"] = json!("all");
    (contact["placement"]["lateral"], contact["placement"]["yaw"]) = (json!(4.95e-3), json!(-2e-3));
    job["analyses"] = json!({ "modes": { "max_frequency": 600 }, "steady": {}, "stability": {} });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let pairs = numbers(&folder, "reduced/lower/near_contacts");
    assert!(pairs.len() == 5 && pairs[..2] == [0.0, 1.0] && pairs[3].abs() > 5e-3, "{pairs:?}");
    let found = numbers(&folder, "stability/growth_rate");
    let model = folder.text("job.h5");
    folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("again.h5")]).good();
    let again = hdf5::File::open(folder.path("again.h5")).expect("a result");
    let again: Vec<f64> = again.dataset("stability/growth_rate").and_then(|d| d.read_raw()).expect("rates");
    assert_eq!(found, again);
}

/// Refusals of what places need and do not go with.
#[test]
fn mistakes_about_places_are_told() {
    let told = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        let mut job = job("wheel-at-given-yaw.json");
        job["contact"]["places"] = json!("all");
        change(&mut job);
        Folder::with(job.to_string()).call(1, "check", &[]).failed(2, parts);
    };
    told(&|_| {}, &["contact.normal_load", "contact.vertical_load (N)", "contact.vertical_load: missing"]);
    told(
        &|job| {
            job["contact"]["placement"]["touch_near"] = json!(-0.03);
            job["contact"]["vertical_load"] = json!(60e3);
            job["contact"]["normal_load"] = Value::Null;
            job["analyses"]["transient"] =
                json!({ "duration": 1e-3, "histories": { "normal_load": [[0, 5e4], [1e-3, 6e4]] } });
        },
        &[
            "contact.placement.touch_near: names one place",
            "analyses.transient.histories: normal_load or approach is given, but the contacts of the wheel share",
            "expected analyses.transient.histories.vertical_load",
        ],
    );
    told(
        &|job| {
            job["contact"]["places"] = json!("one");
            job["contact"]["vertical_load"] = json!(60e3);
        },
        &["contact.vertical_load: given with one place"],
    );
}
