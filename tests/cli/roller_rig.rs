//! Several bodies around one: wheels on a roller.

use super::program::*;
use num_complex::Complex64;
use serde_json::{json, Value};

/// The wheels of `jobs/roller-rig.json` on a coarse grid with few modes.
fn coarse(around: Value) -> Value {
    let mut job = job("roller-rig.json");
    job["contact"]["patch"]["spacing"] = json!(3e-4);
    job["contact"]["around"] = around;
    job["analyses"]["modes"]["max_frequency"] = json!(4000);
    job["analyses"]["stability"] = json!({});
    job
}

fn read<T: hdf5::H5Type>(folder: &Folder, file: &str, name: &str) -> Vec<T> {
    let file = hdf5::File::open(folder.path(file)).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn eigenvalues(folder: &Folder, file: &str) -> Vec<Complex64> {
    read(folder, file, "stability/eigenvalue")
}

/// Distance of each of `some` to the nearest of `others`, over its size.
fn farthest(some: &[Complex64], others: &[Complex64]) -> f64 {
    let nearest = |a: &Complex64| others.iter().map(|b| (a - b).norm()).fold(f64::INFINITY, f64::min) / a.norm();
    some.iter().map(nearest).fold(0.0, f64::max)
}

/// Two wheels that stand the other way round on the roller are the same rig: each wheel has changed its place with the
/// other one. On two ranks it is the same as on one.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_rig_seen_from_either_wheel_is_the_same() {
    let folder = Folder::with(coarse(json!([{ "angle": 0.7 }])).to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("ahead.h5")]);
    assert!(ran.good().out.contains("body upper: 2 alike around the lower one"), "{}", ran.out);
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    let behind = r#"contact.around=[{"angle": -0.7}]"#;
    folder.call(1, "run", &["--set", behind, "--output", &folder.text("behind.h5")]).good();
    let [ahead, two, behind] = ["ahead.h5", "two.h5", "behind.h5"].map(|file| eigenvalues(&folder, file));
    assert!(ahead.len() > 30 && ahead.len() == behind.len() && ahead.len() == two.len(), "{}", ahead.len());
    assert!(farthest(&ahead, &two) < 1e-8, "{:e}", farthest(&ahead, &two));
    let apart = farthest(&ahead, &behind).max(farthest(&behind, &ahead));
    assert!(apart < 1e-9, "{apart:e}");
    // The wheel behind rolls on a roller that the one ahead has deformed: their forces differ, and change places.
    let forces = |file: &str| ["contact/force", "contact_2/force"].map(|name| read::<f64>(&folder, file, name));
    let ([first, second], [other, one]) = (forces("ahead.h5"), forces("behind.h5"));
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off(&first, &one).max(off(&second, &other)) < 1e-6, "{first:?} {one:?} {second:?} {other:?}");
    assert!(off(&first, &second) > 1e-3, "{first:?} {second:?}");
    // The model is kept as few numbers, and is the same to the last bit when it is taken up.
    let model = folder.text("ahead.h5");
    let again = folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("again.h5")]);
    assert!(again.good().out.contains("from the earlier run"), "{}", again.out);
    assert_eq!(eigenvalues(&folder, "again.h5"), ahead);
    let kept = hdf5::File::open(folder.path("ahead.h5")).expect("result file");
    let names = kept.group("reduced/upper").and_then(|g| g.member_names()).expect("names");
    assert!(names.iter().any(|n| n == "function_modes") && !names.iter().any(|n| n == "compliance"), "{names:?}");
}

/// On a roller that hardly gives way each wheel rolls by itself: it has the eigenvalues that it has alone under its own
/// load and friction on its own grid. The model is taken up with both grids.
#[test]
#[ignore = "long: scripts/validate long"]
fn wheels_on_a_stiff_roller_do_not_see_each_other() {
    let patch = json!({ "half_length": 0.0015, "half_width": 0.002, "spacing": 2.5e-4 });
    let mut job = coarse(json!([{
        "angle": 2.0, "normal_load": 600, "friction": 0.21, "patch": patch, "creepage": { "lateral": 0.004 }
    }]));
    job["bodies"]["lower"]["material"]["young"] = json!(210e14);
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let both = eigenvalues(&folder, "job.h5");
    let mut count = 0;
    let nodes = ["contact/pressure", "contact_2/pressure"].map(|name| read::<f64>(&folder, "job.h5", name).len());
    assert!(nodes[0] < nodes[1], "{nodes:?}");
    let model = folder.text("job.h5");
    folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("again.h5")]).good();
    assert_eq!(eigenvalues(&folder, "again.h5"), both);
    let first = ["friction", "patch"].map(|key| job["contact"][key].clone());
    for (name, load, creepage, [friction, patch]) in
        [("first.h5", 1000.0, 0.01, first), ("second.h5", 600.0, 0.004, [json!(0.21), patch])]
    {
        job["contact"]["around"] = json!([]);
        (job["contact"]["friction"], job["contact"]["patch"]) = (friction, patch);
        job["contact"]["normal_load"] = json!(load);
        job["contact"]["creepage"]["lateral"] = json!(creepage);
        let alone = Folder::with(job.to_string());
        alone.call(1, "run", &["--output", &alone.text(name)]).good();
        let alone = eigenvalues(&alone, name);
        count += alone.len();
        assert!(farthest(&alone, &both) < 1e-6, "{name}: {:e}", farthest(&alone, &both));
    }
    assert_eq!(both.len(), count);
    let names = read::<hdf5::types::VarLenUnicode>(&folder, "job.h5", "contacts/name");
    assert_eq!(names.iter().map(|name| name.as_str()).collect::<Vec<_>>(), ["body 1", "body 2"]);
    assert_eq!(read::<f64>(&folder, "job.h5", "contacts/friction")[1], 0.21);
    let normal = ["contact/force", "contact_2/force"].map(|name| -read::<f64>(&folder, "job.h5", name)[2]);
    assert!((normal[0] - 1000.0).abs() < 1e-6 && (normal[1] - 600.0).abs() < 1e-6, "{normal:?}");
}

/// The wheel and the idler of `jobs/wheel-and-idler.json` on a coarse grid with few modes.
fn with_idler() -> Value {
    let mut job = job("wheel-and-idler.json");
    job["contact"]["patch"]["spacing"] = json!(3e-4);
    job["analyses"]["modes"]["max_frequency"] = json!(6000);
    job["analyses"]["stability"] = json!({});
    job
}

/// A second wheel that is given by its name is the one that is like the first.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_wheel_by_its_name_is_the_one_that_is_alike() {
    let alike = Folder::with(coarse(json!([{ "angle": 0.7 }])).to_string());
    alike.call(1, "run", &[]).good();
    let mut job = coarse(json!([{ "angle": 0.7, "body": "second" }]));
    job["bodies"]["others"] = json!({ "second": job["bodies"]["upper"] });
    let named = Folder::with(job.to_string());
    let ran = named.call(1, "run", &[]);
    assert!(
        ran.good().out.contains("2 around the lower one, without coupling of their own: body 1, second"),
        "{}",
        ran.out
    );
    let [alike, named] = [alike, named].map(|folder| eigenvalues(&folder, "job.h5"));
    assert!(alike.len() > 30 && alike.len() == named.len() && farthest(&alike, &named) < 1e-10);
}

/// On a roller that hardly gives way a wheel and a smaller idler, which turns faster and is damped otherwise, have the
/// eigenvalues that each has alone under its own load and friction on its own grid, also with contacts of one point. On
/// two ranks, taken up and in a sweep they are the same.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_wheel_and_an_idler_on_a_stiff_roller_are_each_by_itself() {
    let mut job = with_idler();
    job["bodies"]["lower"]["material"]["young"] = json!(210e14);
    job["analyses"]["stability"]["contact"] = json!("point");
    let own = json!({
        "friction": 0.21, "patch": { "half_length": 0.0015, "half_width": 0.002, "spacing": 2.5e-4 }
    });
    for key in ["friction", "patch"] {
        job["contact"]["around"][0][key] = own[key].clone();
    }
    job["analyses"]["sweep"] = json!({ "keys": { "bodies.others.idler.damping.modal.by_diameter.0": [0.004, 0.008] } });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    for part in ["idler, -1.2 rad around the lower body", "body others.idler: swept", "damping of others.idler"] {
        assert!(ran.good().out.contains(part), "{part}: {}", ran.out);
    }
    let told = folder.call(1, "check", &[]);
    assert!(told.good().out.contains("\n  others.idler "), "the size of the idler: {}", told.out);
    let both = eigenvalues(&folder, "job.h5");
    assert!(ran.out.contains("contacts of one point each, half-axes "), "{}", ran.out);
    assert_eq!(read::<f64>(&folder, "job.h5", "stability/point/half_axes").len(), 4);
    let by_points =
        |folder: &Folder, law: &str| read::<Complex64>(folder, "job.h5", &format!("stability/point/{law}/eigenvalue"));
    let laws = ["linear", "shen_hedrick_elkins", "polach", "fastsim"];
    let points = laws.map(|law| by_points(&folder, law));
    let swept = read::<Complex64>(&folder, "job.h5", "sweep/eigenvalue");
    let offset = read::<i64>(&folder, "job.h5", "sweep/offset").into_iter().map(|k| k as usize).collect::<Vec<_>>();
    let [as_given, twice] = [0, 1].map(|point| &swept[offset[point]..offset[point + 1]]);
    assert!(as_given.len() == both.len() && farthest(as_given, &both) < 1e-9, "{as_given:?} and {both:?}");
    assert!(farthest(twice, &both) > 1e-4, "twice the damping of the idler changes its modes: {twice:?}");
    let model = folder.text("job.h5");
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("again.h5")]).good();
    let two = eigenvalues(&folder, "two.h5");
    assert!(two.len() == both.len() && farthest(&both, &two) < 1e-8, "{:e}", farthest(&both, &two));
    assert_eq!(eigenvalues(&folder, "again.h5"), both);
    let names = read::<hdf5::types::VarLenUnicode>(&folder, "job.h5", "modes/upper/family");
    let speeds = read::<f64>(&folder, "job.h5", "modes/upper/angular_velocities");
    for (name, speed) in names.iter().zip(&speeds) {
        let radius = if name.ends_with(", idler") { 0.1 } else { 0.15 };
        assert!((speed * radius / 5.0 - 1.0).abs() < 1e-12, "{}: {speed} rad/s", name.as_str());
    }
    let idler = job["bodies"]["others"]["idler"].clone();
    job["analyses"]["sweep"] = Value::Null;
    job["bodies"]["others"] = json!({});
    job["contact"]["around"] = json!([]);
    let (mut count, mut by_law) = (0, [0; 4]);
    let first = ["friction", "patch"].map(|key| job["contact"][key].clone());
    let second = ["friction", "patch"].map(|key| own[key].clone());
    for (body, load, creepage, [friction, patch]) in
        [(job["bodies"]["upper"].clone(), 1000.0, 0.01, first), (idler, 600.0, 0.002, second)]
    {
        job["bodies"]["upper"] = body;
        (job["contact"]["friction"], job["contact"]["patch"]) = (friction, patch);
        job["contact"]["normal_load"] = json!(load);
        job["contact"]["creepage"]["lateral"] = json!(creepage);
        let alone = Folder::with(job.to_string());
        alone.call(1, "run", &[]).good();
        for ((law, points), count) in laws.iter().zip(&points).zip(&mut by_law) {
            let alone = by_points(&alone, law);
            *count += alone.len();
            assert!(farthest(&alone, points) < 1e-6, "{load} N by {law}: {:e}", farthest(&alone, points));
        }
        let alone = eigenvalues(&alone, "job.h5");
        count += alone.len();
        assert!(alone.len() > 3 && farthest(&alone, &both) < 1e-6, "{load} N: {:e}", farthest(&alone, &both));
    }
    assert_eq!(both.len(), count);
    assert_eq!(points.map(|of_law| of_law.len()), by_law);
}

/// Each contact has the receptances of its own wheel. Those between the contacts are of the roller alone; where its
/// particles stand still they are reciprocal.
#[test]
fn receptances_are_those_of_each_contact() {
    let mut job = with_idler();
    job["analyses"]["stability"] = Value::Null;
    job["analyses"]["receptance"] = json!({ "frequency": [0, 900, 2500] });
    job["bodies"]["lower"]["rotation"] = json!("none");
    let folder = Folder::with(job.to_string());
    folder.call(2, "run", &[]).good();
    let table = |folder: &Folder, name: &str| read::<Complex64>(folder, "job.h5", name);
    let size = |h: &[Complex64]| h.iter().map(|v| v.norm()).fold(0.0, f64::max);
    let between = ["receptance/lower_by_2", "receptance_2/lower_by_1"].map(|name| table(&folder, name));
    for k in 0..27 {
        let turned = between[1][9 * (k / 9) + 3 * (k % 3) + k % 9 / 3];
        assert!((between[0][k] - turned).norm() < 1e-12 * size(&between[0]), "entry {k}: {between:?}");
    }
    let lower = table(&folder, "receptance/lower");
    assert!(size(&between[0]) > 1e-3 * size(&lower) && size(&between[0]) < size(&lower));
    assert_eq!(size(&table(&folder, "receptance/upper_by_2")), 0.0);
    let shares = ["receptance/share", "receptance_2/share"].map(|name| read::<f64>(&folder, "job.h5", name));
    assert!(shares.iter().all(|share| (share.iter().sum::<f64>() - 1.0).abs() < 1e-12));
    let found = ["receptance/upper", "receptance_2/upper"].map(|name| table(&folder, name));
    let (wheel, idler) = (job["bodies"]["upper"].clone(), job["bodies"]["others"]["idler"].clone());
    let (own, load) = (job["contact"]["around"][0].clone(), job["contact"]["around"][0]["normal_load"].clone());
    assert!(load.as_f64().is_some_and(|load| load > 0.0) && own["patch"].is_null(), "{own}");
    job["bodies"]["others"] = json!({});
    job["contact"]["around"] = json!([]);
    for (body, load, found) in [(wheel, job["contact"]["normal_load"].clone(), &found[0]), (idler, load, &found[1])] {
        job["bodies"]["upper"] = body;
        job["contact"]["normal_load"] = load;
        let alone = Folder::with(job.to_string());
        alone.call(1, "run", &[]).good();
        let alone = table(&alone, "receptance/upper");
        let apart: Vec<Complex64> = alone.iter().zip(found).map(|(a, b)| a - b).collect();
        assert!(alone.len() == 27 && size(&apart) < 1e-6 * size(&alone), "{apart:?}");
    }
}

/// An idler that has no mode up to the highest frequency adds none to those of the wheel.
#[test]
fn an_idler_may_be_without_modes() {
    let mut job = with_idler();
    job["analyses"]["modes"]["max_frequency"] = json!(1300);
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let names = read::<hdf5::types::VarLenUnicode>(&folder, "job.h5", "modes/upper/family");
    let frequencies = read::<f64>(&folder, "job.h5", "modes/upper/frequency");
    assert!(names.len() > 1 && names.iter().all(|name| name.ends_with(", body 1")), "{names:?}");
    assert!(frequencies.len() == names.len() && !eigenvalues(&folder, "job.h5").is_empty(), "{frequencies:?}");
}

/// Bodies by their names that are not there, stand nowhere or at two places are refused by their keys.
#[test]
fn names_of_bodies_that_do_not_fit_are_refused() {
    let idler = r#"{"angle": -1.2, "body": "idler"}"#;
    let other = "bodies.others.idler.material.young=2e11";
    for (sets, parts) in [
        (
            vec![r#"contact.around=[{"angle": 1, "body": "idle"}]"#],
            ["contact.around.0.body: found \"idle\"", "\"idler\"?"],
        ),
        (vec!["contact.around=[]"], ["bodies.others.idler: touches nothing", "contact.around.N.body"]),
        (vec![other], ["bodies.others.idler.material: found young 2e11", "bodies.upper"]),
        (vec!["contact.around.0.angle=0.45"], ["contact.around.0.angle: found 0.4500 rad", "0.15 m and 0.1 m radius"]),
        (vec!["bodies.others.idler.fixed.0=bore"], ["bodies.others.idler.fixed.0", "\"inner\""]),
        (vec!["bodies.others.idler.mesh.revolved.contact_offset=0.02"], ["bodies.others.idler", "half the thickness"]),
    ] {
        let sets: Vec<&str> = sets.into_iter().flat_map(|set| ["--set", set]).collect();
        Folder::with(with_idler().to_string()).refused(1, &sets, 2, &parts);
    }
    let twice = format!(r#"contact.around=[{idler}, {{"angle": 1.5, "body": "idler"}}]"#);
    let parts = ["contact.around.1.body: found \"idler\", which stands at contact.around.0"];
    Folder::with(with_idler().to_string()).refused(1, &["--set", &twice], 2, &parts);
}

/// The growth of a small motion of the rig in time is the eigenvalue of the linear analysis.
#[test]
fn a_small_motion_of_a_rig_grows_as_its_eigenvalue_says() {
    for mut job in [coarse(json!([{ "angle": 0.7 }])), with_idler()] {
        job["analyses"]["modes"]["max_frequency"] = json!(4000);
        job["analyses"]["transient"] = json!({
            "duration": 0.04, "step": 5e-6, "hold": "approach",
            "start": { "state": "steady", "mode": 1, "amplitude": 1e-8 }
        });
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).good();
        let value = eigenvalues(&folder, "job.h5")[0];
        let energy = read::<f64>(&folder, "job.h5", "transient/kinetic");
        let time = read::<f64>(&folder, "job.h5", "transient/time");
        // Logarithms of means over parts of the run differ by twice the growth rate over the time between.
        let part = energy.len() / 4;
        let mean = |first: usize| energy[first..first + part].iter().sum::<f64>() / part as f64;
        let found = (mean(2 * part) / mean(part)).ln() / (2.0 * (time[2 * part] - time[part]));
        assert!(value.re > 5.0 && (found / value.re - 1.0).abs() < 0.02, "{found} and {value}");
    }
}

/// The limit cycle of a wheel on a stiff roller, beside another wheel that is quiet, is that of the wheel alone, and as
/// loud.
#[test]
#[ignore = "long: scripts/validate long"]
fn the_limit_cycle_beside_a_quiet_wheel_is_that_of_one() {
    let mut job = coarse(json!([{ "angle": 2.0, "creepage": { "lateral": 0.0002 } }]));
    job["contact"]["creepage"]["lateral"] = json!(0.02);
    job["bodies"]["lower"]["material"]["young"] = json!(210e14);
    job["analyses"] = json!({
        "modes": { "max_frequency": 2000 },
        "stability": {},
        "sweep": {
            "keys": { "contact.friction.exponential.kinetic": [0.3] },
            "cycles": {
                "duration": 2.0, "settled": 0.01, "step": 2e-5, "branches": ["mode"],
                "sound_power": { "min_frequency": 400, "bodies": ["upper"] }
            }
        }
    });
    let found = |job: &Value| -> [f64; 4] {
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).good();
        assert_eq!(read::<i8>(&folder, "job.h5", "sweep/cycles/fate"), [1]);
        let force = read::<f64>(&folder, "job.h5", "sweep/cycles/force");
        [
            read(&folder, "job.h5", "sweep/cycles/frequency")[0],
            read(&folder, "job.h5", "sweep/cycles/kinetic")[0],
            force[1],
            read(&folder, "job.h5", "sweep/cycles/sound_power/upper/total_level")[0],
        ]
    };
    let both = found(&job);
    job["contact"]["around"] = json!([]);
    let alone = found(&job);
    let near = |k: usize, part: f64| (both[k] / alone[k] - 1.0).abs() < part;
    assert!(near(0, 1e-5) && near(1, 0.02) && near(2, 1e-3), "{both:?} and {alone:?}");
    assert!(both[3] > 20.0 && (both[3] - alone[3]).abs() < 0.1, "{both:?} and {alone:?}");
}

/// Bodies that cannot stand around one are refused by their key.
#[test]
fn what_does_not_stand_around_one_is_refused() {
    for (around, parts) in [
        (
            json!([{ "angle": 0.3 }]),
            ["contact.around.0.angle: found 0.3000 rad between it and the first", "0.5525 rad"],
        ),
        (json!([{ "angle": 1.0 }, { "angle": 1.2 }]), ["contact.around.1.angle", "contact.around.0"]),
        (json!([{ "angle": 7.0 }]), ["contact.around.0.angle: found 7", "from -π to π"]),
        (json!([{ "angle": 0.0 }]), ["contact.around.0.angle: found 0 rad", "another place"]),
        (json!([{ "angle": 1.0, "normal_load": 1e9 }]), ["contact.around.0.normal_load", "strain"]),
        (json!([{ "angle": 1.0, "creepage": { "lateral": 3 } }]), ["contact.around.0.creepage", "range of the theory"]),
        (json!([{ "angle": 1.0, "friction": -0.1 }]), ["contact.around.0.friction", "-0.1"]),
        (
            json!([{ "angle": 1.0, "patch": { "half_length": 3e-4, "half_width": 3e-4, "spacing": 1e-4 } }]),
            ["contact.around.0: contact.patch: the contact reaches the border", "this load needs"],
        ),
        (
            json!([{ "angle": 1.0, "patch": { "half_length": 1e-3, "half_width": 0.05, "spacing": 3e-4 } }]),
            ["contact.around.0.patch.half_width: found 0.05 m", "bodies.upper"],
        ),
    ] {
        Folder::with(coarse(around).to_string()).refused(1, &[], 2, &parts);
    }
    let mut alone = coarse(json!([{ "angle": 1.0, "body": "unknown" }]));
    alone["bodies"]["lower"] = Value::Null;
    Folder::with(alone.to_string()).refused(1, &[], 2, &["bodies.lower: missing"]);
    let mut placed = job("wheel-on-rail.json");
    placed["contact"]["around"] = json!([{ "angle": 1.0 }]);
    Folder::with(placed.to_string()).refused(1, &[], 2, &["contact.around: takes bodies of revolution"]);
    let mut full = coarse(json!([{ "angle": 1.0 }]));
    full["analyses"]["stability"]["full"] = json!({ "max_frequency": 500 });
    let parts = ["analyses.stability.full: needs matrices, which bodies.lower does not have"];
    Folder::with(full.to_string()).refused(1, &[], 2, &parts);
    let mut moved = coarse(json!([{ "angle": 1.0 }]));
    for (histories, parts) in [
        (json!({ "further": [{}, {}] }), ["histories.further: found tables of 2", "at most 1"]),
        (json!({ "vertical_load": [[0, 1000], [1, 1000]] }), ["histories.vertical_load", "contact.vertical_load"]),
    ] {
        moved["analyses"]["transient"] = json!({ "duration": 1e-3, "step": 1e-5, "histories": histories });
        Folder::with(moved.to_string()).refused(1, &[], 2, &parts);
    }
}

/// A creep curve of a rig goes through the creepages of all its contacts: on a stiff roller each wheel has the forces
/// and, of the two, the least stable eigenvalue that it has alone.
#[test]
#[ignore = "long: scripts/validate long"]
fn a_creep_curve_of_a_rig_is_that_of_its_wheels() {
    let mut job = coarse(json!([{ "angle": 2.0, "normal_load": 600, "creepage": { "lateral": 0.006 } }]));
    job["bodies"]["lower"]["material"]["young"] = json!(210e14);
    job["analyses"] = json!({
        "modes": { "max_frequency": 2000 }, "stability": {},
        "creep_curve": { "key": "lateral", "values": [0.001, 0.004, 0.01] }
    });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("largest friction, contact 2 (body 2)"), "{}", ran.out);
    let eigenvalue = |folder: &Folder| read::<Complex64>(folder, "job.h5", "creep_curve/eigenvalue");
    let both = eigenvalue(&folder);
    let mut alone: Vec<Vec<Complex64>> = Vec::new();
    for (number, load, change) in [("", 1000.0, 0.0), ("_2", 600.0, -0.004)] {
        job["contact"]["around"] = json!([]);
        job["contact"]["normal_load"] = json!(load);
        job["analyses"]["creep_curve"]["values"] = json!([0.001 + change, 0.004 + change, 0.01 + change]);
        let single = Folder::with(job.to_string());
        single.call(1, "run", &[]).good();
        for name in ["lateral", "force", "stick_share", "fastsim", "closed"] {
            let numbers = |folder: &Folder, group: &str| -> Vec<f64> {
                let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
                let data = file.dataset(&format!("{group}/{name}")).expect("a curve");
                match name {
                    "closed" => data.read_raw::<i64>().expect("counts").iter().map(|n| *n as f64).collect(),
                    _ => data.read_raw().expect("numbers"),
                }
            };
            let (found, wanted) = (numbers(&folder, &format!("creep_curve{number}")), numbers(&single, "creep_curve"));
            let scale = wanted.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let off = found.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(found.len() == wanted.len() && off < 1e-6 * scale, "{name}{number}: {found:?} {wanted:?}");
        }
        alone.push(eigenvalue(&single));
    }
    for (k, value) in both.iter().enumerate() {
        let worst = alone.iter().map(|of| of[k]).max_by(|a, b| a.re.total_cmp(&b.re)).expect("two wheels");
        assert!((value - worst).norm() < 1e-6 * worst.norm(), "{value} and {worst}");
    }
}

/// A joint on the roller passes the wheel that stands behind, whose surface differs from that of the first one. On two
/// ranks it is the same; another surface below one of the wheels is refused.
#[test]
fn the_rough_roller_passes_one_wheel_after_the_other() {
    let angle = -0.6;
    let mut job = coarse(json!([{ "angle": angle, "normal_load": 1000 }]));
    // It has 10 mm to go to the wheel at -0.6 rad, which stands 0.24 m behind the first one.
    let joint = json!([{ "joint": { "length": 0.004, "depth": 1e-5, "at": 0.01 - 0.4 * angle } }]);
    let upper = json!([{ "spectrum": { "levels": [[0.1, 10], [0.05, 5]], "seed": 2 } }]);
    job["contact"]["roughness"] = json!({ "onset": 0.001, "lower": joint, "upper": upper });
    job["analyses"] = json!({
        "modes": { "max_frequency": 1500 },
        "transient": { "duration": 4e-3, "step": 2e-5, "start": { "state": "steady" } }
    });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let way = read::<f64>(&folder, "job.h5", "roughness_2/way");
    let [first, second] = ["roughness/lower", "roughness_2/lower"].map(|of| read::<f64>(&folder, "job.h5", of));
    let dip = |s: f64| -1e-5 * (1.0 - 2.0 * (s - 0.01).abs() / 0.004).max(0.0).powi(2);
    let apart = way.iter().zip(&second).map(|(s, h)| (h - dip(*s)).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-10 && second.iter().any(|h| *h < -5e-6), "{apart} m");
    assert!(first.iter().all(|h| *h == 0.0));
    let [first, second] = ["roughness/upper", "roughness_2/upper"].map(|of| read::<f64>(&folder, "job.h5", of));
    assert!(first.iter().zip(&second).any(|(a, b)| (a - b).abs() > 1e-7));
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    for of in ["transient/force", "transient_2/force"] {
        let [one, two] = ["job.h5", "two.h5"].map(|file| read::<f64>(&folder, file, of));
        let normal = |force: &[f64]| force.iter().skip(2).step_by(3).copied().collect::<Vec<f64>>();
        let most = normal(&one).iter().map(|f| (f + 1000.0).abs()).fold(0.0, f64::max);
        let apart = one.iter().zip(&two).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(most > 1.0 && apart < 1e-6 * most, "{of}: {most} N, {apart:e} N apart");
    }
    // Its own roughness leaves the second wheel on the same roller.
    job["contact"]["roughness"]["further"] = json!([{ "upper": [] }]);
    let model = folder.text("job.h5");
    let smooth = Folder::with(job.to_string());
    smooth.call(1, "run", &["--reuse", &model]).good();
    let [roller, wheel] = ["roughness_2/lower", "roughness_2/upper"].map(|of| read::<f64>(&smooth, "job.h5", of));
    assert_eq!(roller, read::<f64>(&folder, "job.h5", "roughness_2/lower"));
    assert!(wheel.iter().all(|h| *h == 0.0));
    let way: Vec<String> = (0..200).map(|k| format!("{} {}", 1e-3 * f64::from(k), (f64::from(k)).sin())).collect();
    let file = smooth.path("roller.txt");
    std::fs::write(&file, way.join("\n")).expect("a file of roughness");
    for (lower, further, part) in [
        (
            &joint,
            json!([{ "lower": upper }]),
            "contact.roughness.further.0.lower: the same surface passes all contacts",
        ),
        (&joint, json!([{}, {}]), "contact.roughness.further: found the roughness of 2 further contacts"),
        (&json!([{ "file": { "path": file } }]), json!([]), "that do not repeat themselves"),
    ] {
        job["contact"]["roughness"]["further"] = further;
        job["contact"]["roughness"]["lower"] = lower.clone();
        let code = if lower == &joint { 2 } else { 3 };
        Folder::with(job.to_string()).call(1, "check", &[]).failed(code, &[part]);
    }
}

/// Loads and creepages of each contact may change in time: constant tables say the same as the keys, and a load that
/// grows is there at each step.
#[test]
fn contacts_of_a_rig_have_histories_of_their_own() {
    let mut job = coarse(json!([{ "angle": 2.0, "normal_load": 600, "creepage": { "lateral": 0.004 } }]));
    job["analyses"] = json!({
        "modes": { "max_frequency": 1500 },
        "transient": { "duration": 4e-4, "step": 1e-5, "hold": "load", "segment": 10,
                       "start": { "state": "steady", "random": { "seed": 1, "energy": 1e-6 } } }
    });
    let folder = Folder::with(job.to_string());
    let model = folder.text("job.h5");
    folder.call(1, "run", &[]).good();
    let run = |name: &str, creepage: &str, histories: Value| {
        let set = format!("analyses.transient.histories={histories}");
        let output = folder.text(name);
        folder.call(1, "run", &["--set", creepage, "--set", &set, "--reuse", &model, "--output", &output]).good();
        ["transient/force", "transient_2/force"].map(|of| read::<f64>(&folder, name, of))
    };
    let keys = ["transient/force", "transient_2/force"].map(|of| read::<f64>(&folder, "job.h5", of));
    let table = |value: f64| json!([[0, value], [1, value]]);
    let other = r#"contact.around=[{"angle": 2.0, "normal_load": 300, "creepage": {"lateral": 0.001}}]"#;
    let same = run(
        "same.h5",
        other,
        json!({ "lateral": table(0.01), "further": [{ "lateral": table(0.004), "normal_load": table(600.0) }] }),
    );
    assert_eq!(keys, same);
    let own = r#"contact.around=[{"angle": 2.0, "normal_load": 600, "creepage": {"lateral": 0.004}}]"#;
    let growing = json!({ "further": [{ "normal_load": [[0, 600], [4e-4, 720]] }] });
    let [first, second] = run("growing.h5", own, growing);
    let (last, before) = (second.len() - 1, keys[0].len() - 1);
    assert!((second[last] / -720.0 - 1.0).abs() < 1e-9 && (first[before] / -1000.0 - 1.0).abs() < 1e-9, "{second:?}");
    assert!((second[2] / -603.0 - 1.0).abs() < 1e-9, "after a step of forty: {} N", second[2]);
}
