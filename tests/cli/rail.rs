//! A rail on its track, in whole runs.

use super::program::*;
use num_complex::Complex;
use serde_json::{json, Value};

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// `jobs/rail-receptance.json` to lower frequencies on a coarser contact.
fn rail(frequency: Value) -> Value {
    let mut job = job("rail-receptance.json");
    job["contact"]["patch"] = json!({ "half_length": 0.009, "half_width": 0.009, "spacing": 0.003 });
    job["analyses"] = json!({ "modes": { "max_frequency": 2500 }, "receptance": { "frequency": frequency } });
    job
}

/// The infinite Timoshenko beam on pads of 200 MN/m² with the loss factor 0.2, |α| in 1e-10 m/N and phase: 139 and
/// −81° at 300 Hz, 25.7 and −123° at 500 Hz, 7.60 and −116° at 1000 Hz, of another program. What the contact yields
/// by itself under the pressure is added, the same at all frequencies and about 0.6(1−ν²)/(Ea) of Hertz.
#[test]
fn the_rail_has_the_receptance_of_a_beam() {
    let folder = Folder::with(rail(json!([300, 500, 1000])).to_string());
    let ran = folder.call(1, "run", &[]);
    ran.good();
    assert!(ran.out.contains("body lower: rail"), "{}", ran.out);
    // Below some 280 Hz ten per cent of what runs along 14 m of rail come back, and it is said.
    let from = ran.out.split("10 % of the infinite rail above ").nth(1).and_then(|t| t.split(' ').next());
    let from: f64 = from.and_then(|f| f.parse().ok()).expect("the frequency from which on it is one");
    assert!((200.0..300.0).contains(&from), "{}", ran.out);
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    let found: Vec<Complex<f64>> = file.dataset("receptance/lower").and_then(|d| d.read_raw()).expect("receptance");
    let wanted = [(139.0, -81.0), (25.7, -123.0), (7.60, -116.0_f64)]
        .map(|(size, phase)| Complex::from_polar(1e-10 * size, phase.to_radians()));
    let normal: Vec<Complex<f64>> = (0..3).map(|f| found[9 * f + 8]).collect();
    let own = (normal[2] - wanted[2]).re;
    assert!((2e-10..6e-10).contains(&own), "{own:e}");
    for (f, w) in normal.iter().zip(wanted) {
        let ratio = (f - own) / w;
        assert!((ratio.norm() - 1.0).abs() < 0.04 && ratio.arg().abs() < 0.06, "{ratio}");
    }
    // Laterally the head rolls as well: more than the beam's 6e-9 m/N of bending alone, and behind the force.
    assert!(found[4].norm() > 1e-8 && found[4].im < 0.0, "{}", found[4]);
    // Reciprocity, and no coupling of a symmetric rail's lateral and vertical motion.
    assert!(
        (found[5] - found[7]).norm() < 1e-9 * found[4].norm() && found[5].norm() < 1e-3 * found[4].norm(),
        "{} {}",
        found[5],
        found[7]
    );
    let damping = numbers(&folder, "reduced/lower/damping");
    let n = damping.len().isqrt();
    assert_eq!(n, numbers(&folder, "modes/lower/frequency").len());
    assert!((0..n).all(|k| damping[k * n + k] > 0.0));
    // The damping matrix comes with the reduced model.
    let earlier = folder.text("job.h5");
    folder.call(1, "run", &["--output", &folder.text("two.h5"), "--reuse", &earlier]).good();
    let file = hdf5::File::open(folder.path("two.h5")).expect("result file");
    let again: Vec<Complex<f64>> = file.dataset("receptance/lower").and_then(|d| d.read_raw()).expect("receptance");
    assert!(found.iter().zip(&again).all(|(a, b)| (a - b).norm() < 1e-9 * found[8].norm()));
}

/// The built-in rails carry a wheel by section and running profile, and `check` says the measures of their sections.
#[test]
fn check_says_the_measures_of_rails() {
    for (name, area, mass, inertia, centroid) in [
        ("49E1", 62.92, 49.39, [1816.0, 319.1], 73.4),
        ("54E1", 69.77, 54.77, [2338.0, 419.2], 75.1),
        ("54E3", 69.52, 54.57, [2074.0, 354.8], 75.1),
        ("60E1", 76.70, 60.21, [3038.0, 512.3], 80.9),
        ("60E2", 76.48, 60.03, [3022.0, 510.5], 80.7),
        ("115RE", 72.37, 56.74, [2726.0, 445.4], 75.9),
    ] {
        let mut job = job("wheel-at-given-yaw.json");
        job["bodies"]["lower"]["mesh"]["extruded"]["section"] = json!(name);
        job["bodies"]["lower"]["profile"] = json!(name);
        job["bodies"]["lower"]["material"]["density"] = json!(7850);
        let out = Folder::with(job.to_string()).call(1, "check", &[]).good().out.clone();
        let line = out.lines().find_map(|l| l.split(&format!("body lower: rail {name}, ")).nth(1)).expect("a line");
        let numbers: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
        let wanted = [area, mass, inertia[0], inertia[1], centroid];
        assert_eq!(numbers.len(), wanted.len(), "{line}");
        for (found, wanted) in numbers.iter().zip(wanted) {
            assert!((found / wanted - 1.0).abs() < 5e-3, "{line}");
        }
    }
    // A grooved rail that is drawn: main dimensions and measures of 59R2 as recalled.
    let drawn = |file: &str| format!("{}/meshes/{file}", env!("CARGO_MANIFEST_DIR"));
    let mut grooved = job("grooved-rail.json");
    let lower = &mut grooved["bodies"]["lower"];
    lower["mesh"]["extruded"]["section"]["file"]["path"] = json!(drawn("grooved-rail.msh"));
    lower["profile"]["file"]["path"] = json!(drawn("grooved-rail-head.txt"));
    let out = Folder::with(grooved.to_string()).call(1, "check", &[]).good().out.clone();
    let line = out.lines().find_map(|l| l.split("body lower: rail of a drawing, ").nth(1)).expect("a line");
    let numbers: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    for (found, wanted) in numbers.iter().zip([74.1, 58.2, 3214.0, 878.0]) {
        assert!((found / wanted - 1.0).abs() < 1e-2, "{line}");
    }
    // A head is no profile of a wheel.
    let mut wrong = job("wheel-at-given-yaw.json");
    wrong["bodies"]["upper"]["profile"] = json!("54E1");
    Folder::with(wrong.to_string()).refused(1, &[], 2, &["bodies.upper.profile", "profile of a rail"]);
}

#[test]
fn what_a_rail_cannot_be_is_refused() {
    let mut too_short = rail(json!([300]));
    too_short["bodies"]["lower"]["mesh"]["extruded"]["length"] = json!(5.0);
    too_short["bodies"]["lower"]["track"]["ends"] = json!({ "length": 2.0 });
    let folder = Folder::with(too_short.to_string());
    folder
        .call(1, "run", &[])
        .failed(2, &["bodies.lower.mesh.extruded.length", "found 5 m", "300 Hz", "track.ends.length"]);
    for (key, value, says) in [
        ("rotation", json!("rolling"), "a rail does not turn"),
        ("fixed", json!(["foot"]), "bodies.lower.fixed"),
        ("damping", json!({ "beta": 1e-6 }), "bodies.lower.damping"),
        ("track", json!({ "ends": { "length": 7 } }), "bodies.lower.track.ends.length"),
        ("mesh", json!({ "extruded": { "section": "60E1", "contact_offset": 0.036 } }), "between -0.0353 and 0.0353 m"),
    ] {
        let mut job = rail(json!([300]));
        job["bodies"]["lower"][key] = value;
        let folder = Folder::with(job.to_string());
        folder.refused(1, &[], 2, &[says]);
    }
    let mut wheel = rail(json!([300]));
    wheel["bodies"]["upper"]["track"] = json!({});
    let folder = Folder::with(wheel.to_string());
    folder.refused(1, &[], 2, &["bodies.upper.track"]);
}

/// The sound of a rail under the forces of a wheel that squeals, without mode shapes of its own.
#[test]
fn rails_are_heard() {
    rail_under_squeal(false);
}

/// The same to the last bit of a run that is continued, and as loud on two ranks as on one; sleepers that stand apart
/// are spread evenly.
#[test]
#[ignore = "long: scripts/validate long"]
fn rails_are_heard_alike_in_parts_and_on_ranks() {
    rail_under_squeal(true);
}

/// Wheel and rail under two contacts, and a wheelset on both rails, are heard; in parts and on two ranks alike.
#[test]
#[ignore = "long: scripts/validate long"]
fn rails_are_heard_under_all_contacts() {
    for (name, modes) in [("flange.json", 1100), ("wheelset-both-wheels.json", 500)] {
        let mut curve = job(name);
        curve["analyses"] = json!({
            "modes": { "max_frequency": modes },
            "transient": {
                "duration": 0.052, "step": 5e-5, "segment": 300,
                "start": { "state": "steady", "random": { "seed": 3, "energy": 1e-3 } },
                "sound_power": { "min_frequency": 400, "max_frequency": 450, "from": 2e-3 }
            }
        });
        curve["output"] = json!({ "fields": false });
        let folder = Folder::with(curve.to_string());
        folder.call(1, "run", &["--output", &folder.text("one.h5")]).good();
        let all = |name: &str| {
            ["lower/power", "lower/density", "upper/power"].map(|n| {
                let file = hdf5::File::open(folder.path(name)).expect("result file");
                let found = file.dataset(&format!("transient/sound_power/{n}")).and_then(|d| d.read_raw::<f64>());
                found.unwrap_or_else(|e| panic!("{n}: {e}"))
            })
        };
        let one = all("one.h5");
        assert!(one.iter().flatten().all(|p| *p > 0.0 && p.is_finite()), "{name}: {one:?}");
        let two = folder.text("two.h5");
        folder.call(1, "run", &["--output", &two, "--wall-time", "0.01"]).failed(5, &["--resume"]);
        folder.call(1, "run", &["--resume", &two]).good();
        assert_eq!(one, all("two.h5"), "{name}");
        folder.call(2, "run", &["--output", &two, "--force"]).good();
        for (one, two) in one.iter().flatten().zip(all("two.h5").iter().flatten()) {
            assert!((one - two).abs() < 1e-3 * one, "{name}: {one} on one rank, {two} on two");
        }
    }
}

fn rail_under_squeal(in_parts: bool) {
    let mut squeal = job("wheel-on-rail-squeal.json");
    squeal["analyses"] = json!({
        "modes": { "max_frequency": 1500 },
        "stability": {},
        "transient": {
            "duration": 0.08,
            "step": 5e-5,
            "start": { "mode": 1, "amplitude": 1e-6 },
            "sound_power": { "min_frequency": 400, "max_frequency": 1300, "from": 0.02 },
            "segment": 500
        }
    });
    squeal["output"] = json!({ "fields": false });
    let folder = Folder::with(squeal.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("job.h5")]);
    assert!(ran.good().out.contains("sound power of lower"), "{}", ran.out);
    let of = |name: &str| numbers(&folder, &format!("transient/sound_power/{name}"));
    let (centres, power, sigma) = (of("band_frequency"), of("lower/power"), of("lower/radiation_efficiency"));
    let own = centres.iter().position(|f| (f / 965.0).log10().abs() < 0.05).expect("a band");
    assert!(power[own] > 0.9 * power.iter().sum::<f64>() && power[own] > 0.0, "{power:?} W at {centres:?} Hz");
    assert!(sigma.iter().all(|s| (0.1..1.5).contains(s)) && sigma[own] > 0.5, "{sigma:?}");
    // A wheel that squeals drowns the rail.
    let [rail, wheel] = ["lower", "upper"].map(|body| of(&format!("{body}/total_level_a"))[0]);
    assert!(rail > 0.0 && rail + 10.0 < wheel, "{rail} and {wheel} dB(A)");
    if !in_parts {
        return;
    }
    let all = |name: &str| {
        ["lower/power", "lower/density", "upper/power"].map(|n| {
            let file = hdf5::File::open(folder.path(name)).expect("result file");
            let found = file.dataset(&format!("transient/sound_power/{n}")).and_then(|d| d.read_raw::<f64>());
            found.unwrap_or_else(|e| panic!("{n}: {e}"))
        })
    };
    let two = folder.text("two.h5");
    folder.call(1, "run", &["--output", &two, "--wall-time", "0.01"]).failed(5, &["--resume"]);
    folder.call(1, "run", &["--resume", &two]).good();
    assert_eq!(all("job.h5"), all("two.h5"));
    folder.call(2, "run", &["--output", &two, "--force"]).good();
    for (one, two) in all("job.h5").iter().flatten().zip(all("two.h5").iter().flatten()) {
        assert!((one - two).abs() < 1e-3 * power[own], "{one} on one rank, {two} on two");
    }
    // Sleepers that stand apart are spread evenly for the sound.
    squeal["bodies"]["lower"]["track"] = json!({ "pad_length": 0.15 });
    squeal["bodies"]["lower"]["mesh"]["extruded"]["length"] = json!(14.4);
    squeal["analyses"]["transient"]["sound_power"]["bodies"] = json!(["lower"]);
    let folder = Folder::with(squeal.to_string());
    folder.call(1, "run", &["--output", &folder.text("job.h5")]).good();
    let apart = numbers(&folder, "transient/sound_power/lower/radiation_efficiency");
    assert!((apart[own] / sigma[own] - 1.0).abs() < 0.1, "{apart:?}, {sigma:?}");
}
