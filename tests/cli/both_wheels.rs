//! Both wheels of a wheelset in contact at once: derivatives, motion in time, and all places of either wheel.

use super::interrupted::{same, start, wait_for};
use super::program::*;
use num_complex::Complex64;
use serde_json::{json, Value};
use std::f64::consts::TAU;
use std::process::Command;

fn read<T: hdf5::H5Type>(folder: &Folder, file: &str, name: &str) -> Vec<T> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The wheelset a little aside of the middle of straight track, braked, with either wheel on its tread and few modes.
pub(super) fn on_straight_track(analyses: Value) -> Value {
    aside_of_the_middle("wheelset-both-wheels.json", analyses)
}

/// The same of the wheelset of a job.
fn aside_of_the_middle(name: &str, analyses: Value) -> Value {
    let mut job = job(name);
    (job["curve"], job["vehicle"]) = (Value::Null, Value::Null);
    let contact = &mut job["contact"];
    contact["from"] = Value::Null;
    (contact["normal_load"], contact["speed"]) = (json!(20e3), json!(10));
    contact["placement"] = json!({
        "side": "right", "radius": 0.46, "cant": 0.025, "lateral": 1.5e-3, "yaw": 2e-3,
        "creepage": { "longitudinal": 0.01 }
    });
    job["analyses"] = analyses;
    job["analyses"]["modes"] = json!({ "max_frequency": 400 });
    job["output"] = json!({ "fields": false });
    job
}

/// Both wheels bear an axle load and a roll moment about the track, of vertical forces N cos δ at their places.
#[test]
fn an_axle_load_and_a_roll_moment_are_borne_by_both_wheels() {
    let mut job = on_straight_track(json!({ "steady": {} }));
    let contact = job["contact"].as_object_mut().expect("a contact");
    contact.remove("normal_load");
    contact.insert("axle_load".into(), json!(40e3));
    contact.insert("roll_moment".into(), json!(6e3));
    let folder = Folder::with(job.to_string());
    let told = folder.call(1, "check", &[]);
    assert!(told.good().out.contains("axle load 40000 N, roll moment 6000 N m"), "{}", told.out);
    folder.call(2, "run", &[]).good();
    let (mut load, mut moment) = (0.0, 0.0);
    for (contact, placement) in [("contact", "placement"), ("contact_2", "placement_2")] {
        let number = |name: &str, k: usize| read::<f64>(&folder, "job.h5", name)[k];
        let vertical = -number(&format!("{contact}/force"), 2) * number(&format!("{placement}/contact_angle"), 0).cos();
        (load, moment) = (load + vertical, moment + vertical * number(&format!("{placement}/origin"), 1));
    }
    // The frame of a contact stands at the middle of its pressure, half a millimetre from first touch.
    assert!((load / 40e3 - 1.0).abs() < 1e-6 && (moment - 6e3).abs() < 1e-3 * load, "{load} N, {moment} N m");
    type Change = fn(&mut Value);
    let table: [(Change, &[&str]); 4] = [
        (
            |job| job["contact"]["roll_moment"] = json!(4e4),
            &["contact.roll_moment", "lifts a wheel", "expected between"],
        ),
        (|job| job["contact"]["normal_load"] = json!(2e4), &["contact.normal_load", "contact.axle_load"]),
        (|job| job["contact"]["wheels"] = json!("one"), &["contact.axle_load", "expected contact.wheels"]),
        (|job| drop(job["contact"].as_object_mut().unwrap().remove("axle_load")), &["contact.roll_moment", "without"]),
    ];
    for (change, parts) in table {
        let mut other = job.clone();
        change(&mut other);
        Folder::with(other.to_string()).refused(1, &[], 2, parts);
    }
}

/// Rails of twelve bays of sleepers that have this much stiffness against the ballast across the track, N/m, below both
/// rails where `whole` says so.
fn on_sleepers(across: f64, whole: bool) -> Value {
    let mut job = on_straight_track(json!({ "steady": {}, "stability": {} }));
    job["bodies"]["lower"]["mesh"]["extruded"]["length"] = json!(7.2);
    job["bodies"]["lower"]["track"] = json!({
        "spacing": 0.6, "pad_length": 0.15, "position": 0.1, "ends": { "length": 3 },
        "sleeper": { "mass": 150, "ballast": { "vertical": 60e6, "lateral": across, "loss_factor": 0 } }
    });
    if whole {
        // Turned about the track or the vertical, such a sleeper has at the rails the mass and the ballast of both.
        let whole = json!({ "length": 1.5 * 3f64.sqrt(), "rail_distance": 1.5 });
        job["bodies"]["lower"]["track"]["sleeper"]["both_rails"] = whole;
    }
    job
}

/// Sleepers below both rails that hardly move across or along the track have the eigenvalues of half a sleeper below
/// each rail, if they turn like two halves: on one rank and on two. Ballast of 1e13 N/m gives way by 4e-6 of what pads
/// do. Where sleepers can move, there are other eigenvalues.
#[test]
fn sleepers_below_both_rails_couple_them() {
    let folder = Folder::with(on_sleepers(1e13, false).to_string());
    let found = |job: Value, ranks: usize| -> Vec<Complex64> {
        std::fs::write(folder.path("job.json"), job.to_string()).expect("the job");
        let ran = folder.call(ranks, "run", &["--force"]);
        let text = format!("{}{}", ran.good().out, ran.err);
        assert_eq!(text.contains("two rails on common sleepers"), job.to_string().contains("both_rails"), "{text}");
        read(&folder, "job.h5", "stability/eigenvalue")
    };
    let off = |a: &[Complex64], b: &[Complex64]| -> f64 {
        let nearest = |x: &Complex64| b.iter().map(|y| (x - y).norm() / x.norm()).fold(f64::INFINITY, f64::min);
        a.iter().filter(|x| x.im > TAU * 20.0 && x.im < TAU * 380.0).map(nearest).fold(0.0, f64::max)
    };
    let apart = found(on_sleepers(1e13, false), 1);
    let tied = found(on_sleepers(1e13, true), 2);
    assert!(apart.len() > 40 && off(&apart, &tied) < 4e-6, "{} of {}", off(&apart, &tied), apart.len());
    let free = found(on_sleepers(20e6, true), 1);
    assert!(off(&free, &tied) > 1e-2, "{}", off(&free, &tied));
}

/// The same of a wheelset of which one half is drawn.
fn drawn_half() -> Value {
    let mut job = aside_of_the_middle("drawn-wheelset.json", json!({ "steady": {}, "stability": {} }));
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/wheelset-section.msh");
    job["bodies"]["upper"]["mesh"]["revolved"]["section"]["file"]["path"] = json!(mesh);
    job
}

/// It has a contact at either wheel.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_drawn_half_rolls_on_both_rails() {
    let folder = Folder::with(drawn_half().to_string());
    folder.call(1, "run", &[]).good();
    let forces = ["contact/force", "contact_2/force"].map(|name| read::<f64>(&folder, "job.h5", name));
    assert!(forces.iter().all(|f| (f[2] + 20e3).abs() < 1e-3 && f[0] < -7e3), "{forces:?}");
    assert!(read::<Complex64>(&folder, "job.h5", "stability/eigenvalue").len() > 10);
}

/// A wheelset of which one half is drawn has modes of the kinds of the built-in one; a drawing that ends elsewhere is
/// refused.
#[test]
fn a_drawn_half_is_a_wheelset() {
    let mut job = drawn_half();
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--only", "modes"]);
    assert!(ran.good().out.contains("mass 1.033909e3 kg"), "{}", ran.out);
    let family = read::<hdf5::types::VarLenUnicode>(&folder, "job.h5", "modes/upper/family");
    for kind in ["symmetric axial", "antisymmetric axial", "antisymmetric torsion", "symmetric bending"] {
        assert!(family.iter().any(|name| name.starts_with(kind)), "{kind}: {family:?}");
    }
    job["bodies"]["upper"]["mesh"]["revolved"]["section"]["file"]["middle"] = json!(0.752);
    let parts =
        ["section.file.middle", "found 0.752 m, but the drawing ends at x = 0.750000 m", "one half of a wheelset"];
    Folder::with(job.to_string()).call(1, "check", &[]).failed(2, &parts);
}

/// Derivatives of the eigenvalues are differences between points of a sweep: by the friction of both contacts, by their
/// longitudinal creepages, and by the speed of all that moves.
#[test]
#[ignore = "long: scripts/validate long"]
fn derivatives_of_both_wheels_are_differences_between_points() {
    // Name, key, value and step of a parameter.
    let parameters = [
        ("friction", "contact.friction", 0.4, 4e-5),
        ("longitudinal", "contact.placement.creepage.longitudinal", 0.01, 1e-6),
        ("speed", "contact.speed", 10.0, 1e-3),
    ];
    let mut keys = json!({});
    for (own, (_, key, value, step)) in parameters.iter().enumerate() {
        let at = |point: usize| match point / 2 == own {
            true => value + [*step, -*step][point % 2],
            false => *value,
        };
        keys[*key] = (0..2 * parameters.len()).map(at).collect();
    }
    let folder = Folder::with(
        on_straight_track(json!({
            "steady": {}, "stability": { "sensitivities": true }, "sweep": { "keys": keys, "combine": "zip" }
        }))
        .to_string(),
    );
    folder.call(1, "run", &[]).good();
    let complex = |name: &str| read::<Complex64>(&folder, "job.h5", name);
    let (values, all) = (complex("stability/eigenvalue"), complex("sweep/eigenvalue"));
    let offset: Vec<i64> = read(&folder, "job.h5", "sweep/offset");
    // The rolling speed at the first contact is in proportion to the speed of the job along the track.
    let rolling = read::<f64>(&folder, "job.h5", "placement/speed")[0];
    for (own, (name, _, value, step)) in parameters.into_iter().enumerate() {
        let unit = match name {
            "friction" => 1.0 / value,
            "speed" => rolling / value,
            _ => 1.0,
        };
        let found = complex(&format!("stability/sensitivity/{name}"));
        let largest = found.iter().filter(|f| !f.is_nan()).map(|f| f.norm()).fold(0.0, f64::max);
        assert!(found.len() == values.len() && largest > 0.0, "{name}: {found:?}");
        let mut compared = 0;
        for (f, l) in found.iter().zip(&values).filter(|(f, _)| !f.is_nan()) {
            let near = |point: usize| {
                let of = &all[offset[point] as usize..offset[point + 1] as usize];
                *of.iter().min_by(|a, b| (*a - l).norm().total_cmp(&(*b - l).norm())).expect("eigenvalues")
            };
            let want = (near(2 * own) - near(2 * own + 1)) / (2.0 * step * unit);
            assert!((f - want).norm() < 1e-3 * want.norm() + 1e-4 * largest, "{l}, by {name}: {f} against {want}");
            compared += 1;
        }
        assert!(compared > 8, "{name}: {found:?}");
    }
}

/// Samples of a wheelset with both contacts are points of a sweep, on any number of ranks.
#[test]
#[ignore = "long: scripts/validate long"]
fn samples_of_both_wheels_are_points_of_a_sweep() {
    let keys = ["contact.friction", "contact.placement.creepage.longitudinal"];
    let uniform = |from: f64, to: f64| json!({ "uniform": { "from": from, "to": to } });
    let inputs = json!([
        { "key": keys[0], "distribution": uniform(0.3, 0.5) },
        { "key": keys[1], "distribution": uniform(0.008, 0.012) }
    ]);
    let mut job = on_straight_track(json!({
        "stability": {},
        "uncertainty": { "inputs": inputs, "samples": 16, "method": "latin_hypercube", "indices": false }
    }));
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("16 points on 1 reduced model"), "{}", ran.out);
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    let growth = read::<f64>(&folder, "job.h5", "uncertainty/growth_rate");
    // Factorisations on two ranks round otherwise.
    let two = read::<f64>(&folder, "two.h5", "uncertainty/growth_rate");
    assert!(growth.iter().zip(&two).all(|(a, b)| (a - b).abs() <= 1e-8 * a.abs()), "{growth:?} and {two:?}");
    let values = keys.map(|key| read::<f64>(&folder, "job.h5", &format!("uncertainty/values/{key}")));
    job["analyses"]["uncertainty"] = Value::Null;
    job["analyses"]["sweep"] = json!({ "keys": { keys[0]: values[0], keys[1]: values[1] }, "combine": "zip" });
    let sweep = Folder::with(job.to_string());
    sweep.call(1, "run", &[]).good();
    let all = read::<Complex64>(&sweep, "job.h5", "sweep/eigenvalue");
    let offset: Vec<i64> = read(&sweep, "job.h5", "sweep/offset");
    assert_eq!(growth.len(), 16);
    for (found, &first) in growth.iter().zip(&offset) {
        let wanted = all[first as usize];
        assert!((found - wanted.re).abs() <= 1e-8 * wanted.norm() + 1e-8, "{found} and {wanted}");
    }
}

/// The wheelset in time, pushed at random.
fn in_time(hold: &str) -> Value {
    on_straight_track(json!({
        "transient": {
            "duration": 4e-4, "step": 1e-5, "hold": hold, "segment": 5, "contact_stride": 5,
            "start": { "state": "steady", "random": { "seed": 3, "energy": 1e-2 } }
        }
    }))
}

/// Normal forces of both wheels at each step, N.
fn normal_forces(folder: &Folder, file: &str) -> [Vec<f64>; 2] {
    ["transient/force", "transient_2/force"]
        .map(|name| read::<f64>(folder, file, name).chunks(3).map(|f| -f[2]).collect())
}

/// With `hold` = "load" each wheel bears its load at each step.
#[test]
#[ignore = "long: scripts/validate long"]
fn both_wheels_roll_in_time() {
    let folder = Folder::with(in_time("load").to_string());
    folder.call(1, "run", &[]).good();
    for normal in normal_forces(&folder, "job.h5") {
        assert_eq!(normal.len(), 40);
        let apart = normal.iter().map(|n| (n - 20e3).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-8 * 20e3, "{apart} N");
    }
    let along = ["transient/force", "transient_2/force"].map(|name| read::<f64>(&folder, "job.h5", name));
    for force in &along {
        let moved = force.chunks(3).map(|f| (f[0] - force[0]).abs()).fold(0.0, f64::max);
        assert!(moved > 1e-6 * 20e3, "nothing moves: {moved} N");
    }
    assert!(along[0] != along[1], "the same contact twice");
}

/// A wheelset that nothing pushes stays at rest: the torque of what drives it balances that of the contacts.
#[test]
#[ignore = "long: scripts/validate long"]
fn braked_wheelset_stays_at_its_creepages() {
    let mut job = in_time("load");
    let transient = &mut job["analyses"]["transient"];
    (transient["duration"], transient["step"]) = (json!(4e-3), json!(4e-5));
    transient["start"] = json!({ "state": "steady" });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    for name in ["transient/force", "transient_2/force"] {
        let force = read::<f64>(&folder, "job.h5", name);
        assert!(force[0].abs() > 1e3, "{name}: a wheelset that rolls freely says nothing");
        let moved = force.chunks(3).flat_map(|f| [0, 1].map(|c| (f[c] - force[c]).abs())).fold(0.0, f64::max);
        // Steps of rolling differ from steady rolling on a grid by this; the torque by itself would move kilonewtons.
        assert!(moved < 5e-4 * 20e3, "{name}: {moved} N");
    }
}

/// A run that is killed goes on to the same bits.
#[test]
#[ignore = "long: scripts/validate long"]
fn both_wheels_go_on_after_a_kill() {
    let folder = Folder::with(in_time("load").to_string());
    folder.call(1, "run", &[]).good();
    let killed = folder.text("killed.h5");
    let mut child = start(Command::new(PROGRAM), &["run", &folder.text("job.json"), "--output", &killed]);
    wait_for(&folder.path("killed.transient"), 3, &mut child);
    child.kill().expect("kill");
    child.wait().expect("wait");
    folder.call(1, "run", &["--resume", &killed]).good();
    let [whole, resumed] = ["job.h5", "killed.h5"].map(|name| hdf5::File::open(folder.path(name)).expect("a result"));
    same(&whole, &resumed);
    drop((whole, resumed));
    let bits =
        |file: &str| read::<f64>(&folder, file, "transient_2/force").iter().map(|f| f.to_bits()).collect::<Vec<_>>();
    assert!(bits("job.h5") == bits("killed.h5"));
}

/// With `hold` = "approach" the loads follow the motion.
#[test]
#[ignore = "long: scripts/validate long"]
fn loads_of_held_wheels_follow_the_motion() {
    let held = Folder::with(in_time("approach").to_string());
    held.call(1, "run", &[]).good();
    for normal in normal_forces(&held, "job.h5") {
        let apart = normal.iter().map(|n| (n / 20e3 - 1.0).abs()).fold(0.0, f64::max);
        assert!((1e-6..0.5).contains(&apart), "{apart} of the load");
    }
}

/// All places of either wheel in a curve: one of the inner wheel, two of the outer one, each with its load of the
/// equilibrium. The two contacts of the outer wheel share what one of them would not carry.
#[test]
#[ignore = "long: scripts/validate long"]
fn all_places_of_both_wheels_are_solved_at_once() {
    let mut job = job("wheelset-both-wheels.json");
    job["contact"]["places"] = json!("all");
    job["analyses"] = json!({ "modes": { "max_frequency": 400 }, "steady": {}, "stability": {} });
    let folder = Folder::with(job.to_string());
    let out = folder.call(1, "run", &[]).good().out.clone();
    assert!(out.contains("contact 3") && !out.contains("left out"), "{out}");
    let normal: Vec<f64> = read(&folder, "job.h5", "curving/contacts/normal_force");
    let forces =
        ["contact", "contact_2", "contact_3"].map(|name| read::<f64>(&folder, "job.h5", &format!("{name}/force")));
    for force in &forces {
        assert!(normal.iter().any(|n| (-force[2] / n - 1.0).abs() < 1e-6), "{force:?} {normal:?}");
        let sliding = force[0].hypot(force[1]) / (0.4 * -force[2]);
        assert!((0.9..=1.0 + 1e-9).contains(&sliding), "{sliding}");
    }
    let rates: Vec<f64> = read(&folder, "job.h5", "stability/growth_rate");
    assert!(rates.len() > 8 && rates.iter().all(|rate| rate.is_finite()), "{rates:?}");
}

/// Friction that falls with the velocity feeds the torsion of the axle of a wheelset in traction. By itself this mode
/// grows as σ = ½ Σ_c F′ ψ_c² − ½ η ω: ψ_c is its motion along the rail at the contact c, η its loss factor, and F′ the
/// change of the steady creep force with the creep velocity, from two more solutions. Both wheels slip alike, and turn
/// against each other.
#[test]
#[ignore = "long: scripts/validate long"]
fn falling_friction_feeds_the_torsion_of_a_wheelset_in_traction() {
    let mut job = job("wheelset-traction.json");
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let model = folder.text("job.h5");
    let read = |file: &str, name: &str| read::<f64>(&folder, file, name);
    // The frequency of the axle that is fixed in its middle.
    let torsion = read("job.h5", "reduced/upper/omega").iter().position(|w| (w / TAU - 62.6).abs() < 0.5);
    let torsion = torsion.expect("the torsion of the axle");
    let modes = read("job.h5", "reduced/upper/omega").len();
    let shapes = read("job.h5", "reduced/upper/function_modes");
    let psi = [0, 9].map(|row| shapes[row * modes + torsion]);
    assert!((psi[0] + psi[1]).abs() < 1e-6 * psi[0].abs(), "{psi:?}");
    job["analyses"] = json!({ "modes": { "max_frequency": 1000 }, "steady": { "tolerance": 1e-10 } });
    let forces = [-0.0199, -0.0201].map(|creepage| {
        job["contact"]["placement"]["creepage"]["longitudinal"] = json!(creepage);
        std::fs::write(folder.path("job.json"), job.to_string()).expect("the job");
        folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("near.h5"), "--force"]).good();
        ["contact/force", "contact_2/force"].map(|name| read("near.h5", name)[0])
    });
    let slope = [0, 1].map(|c| (forces[0][c] - forces[1][c]) / (10.0 * 2e-4));
    let omega = TAU * 62.6;
    let wanted = 0.5 * (slope[0] * psi[0] * psi[0] + slope[1] * psi[1] * psi[1]) - 0.5 * 0.002 * omega;
    let (frequency, growth) = (read("job.h5", "stability/frequency"), read("job.h5", "stability/growth_rate"));
    let found = frequency.iter().position(|f| (f - 61.2).abs() < 1.0).expect("a torsional vibration");
    assert!((growth[found] / wanted - 1.0).abs() < 0.03, "{} 1/s, by the creep force {wanted}", growth[found]);
}
