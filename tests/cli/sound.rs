//! Sound power of a transient, as users ask for it.

use super::program::*;
use super::transient::sliding;
use serde_json::json;
use std::collections::BTreeMap;
use std::process::Command;

/// All datasets of real numbers in `/transient/sound_power`.
fn sound(path: &str) -> BTreeMap<String, Vec<f64>> {
    let file = hdf5::File::open(path).expect("result file");
    let root = file.group("transient/sound_power").expect("sound power");
    let mut found = BTreeMap::new();
    for group in [String::new(), "lower/".into(), "upper/".into()] {
        let here = if group.is_empty() { root.clone() } else { root.group(&group).expect("a body") };
        for name in here.member_names().expect("names").iter().filter(|n| !["lower", "upper"].contains(&n.as_str())) {
            let values = here.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"));
            found.insert(format!("{group}{name}"), values);
        }
    }
    found
}

#[test]
fn a_squealing_wheel_is_heard_in_the_band_of_its_mode_and_a_continued_run_sounds_the_same() {
    let job = sliding(json!({
        "duration": 0.1,
        "start": { "mode": 1, "amplitude": 1e-7 },
        "points": [{ "name": "rim", "body": "upper", "at": [0.0, -0.02, 1.0] }],
        "sound_power": { "min_frequency": 200, "max_frequency": 1300, "from": 0.005 },
        "segment": 1700
    }));
    let folder = Folder::with(job.to_string());
    let whole = folder.text("whole.h5");
    let ran = folder.call(1, "run", &["--output", &whole]);
    assert!(ran.good().out.contains("sound power of upper") && ran.out.contains("dB(A)"), "{}", ran.out);
    let found = sound(&whole);
    let file = hdf5::File::open(&whole).expect("result file");
    let names: Vec<String> = file.group("/").and_then(|g| g.member_names()).expect("names");
    assert!(!names.contains(&"sound".into()), "what sound was made from stays out: {names:?}");

    let eigenvalues: Vec<num_complex::Complex64> =
        file.dataset("stability/eigenvalue").and_then(|d| d.read_raw()).expect("eigenvalues");
    let tone = eigenvalues[0].im.abs() / (2.0 * std::f64::consts::PI);
    // The band of 1250 Hz would end above the highest frequency wanted.
    assert_eq!(found["band_name"], [200.0, 250.0, 315.0, 400.0, 500.0, 630.0, 800.0, 1000.0]);
    let centres = &found["band_frequency"];
    let own = (0..centres.len())
        .min_by(|&a, &b| (centres[a] / tone).ln().abs().total_cmp(&(centres[b] / tone).ln().abs()))
        .expect("bands");
    for body in ["lower", "upper"] {
        let at = |name: &str| &found[&format!("{body}/{name}")];
        let (power, sigma) = (at("power"), at("radiation_efficiency"));
        let all: f64 = power.iter().sum();
        assert!(power[own] > 0.95 * all && all > 0.0, "{body}: {power:?} W at {centres:?} Hz, tone {tone} Hz");
        assert!(sigma.iter().all(|&s| s > 0.0 && s < 2.0), "{body}: {sigma:?}");
        let level = 10.0 * (all / 1e-12).log10();
        assert!((at("total_level")[0] - level).abs() < 1e-9, "{} for {level} dB", at("total_level")[0]);
        let weight = at("level_a")[own] - at("level")[own];
        assert!(centres[own] < 900.0 && weight < -0.5 && weight > -5.0, "A-weight {weight} dB at {} Hz", centres[own]);
        let lines: f64 = at("density").iter().sum::<f64>() * (found["frequency"][1] - found["frequency"][0]);
        assert!((lines / all - 1.0).abs() < 0.02, "{body}: lines {lines} W, bands {all} W");
    }
    // Opposite the contact the rim moves most, and sides and rim together less than half as much in the square: a
    // nodal diameter.
    let velocity: Vec<f64> = file.dataset("transient/point_velocity").and_then(|d| d.read_raw()).expect("velocity");
    let late = &velocity[3 * 500..];
    let square = late.iter().map(|v| v * v).sum::<f64>() / (late.len() / 3) as f64;
    let plane = found["upper/power"][own] / found["upper/radiation_efficiency"][own] / (1.2 * 343.0);
    let surface = 2.0 * std::f64::consts::PI * (0.25 - 0.01);
    let share = plane / (square * surface);
    assert!(share < 0.5 && share > 0.1, "∫v² {plane} m⁴/s², rim {square} m²/s²: {share}");

    let output = folder.text("run.h5");
    folder.call(1, "run", &["--output", &output, "--wall-time", "0.01"]).failed(5, &["--resume"]);
    folder.call(1, "run", &["--resume", &output]).good();
    let bits = |f: BTreeMap<String, Vec<f64>>| -> Vec<(String, Vec<u64>)> {
        f.into_iter().map(|(name, v)| (name, v.iter().map(|x| x.to_bits()).collect())).collect()
    };
    assert!(bits(sound(&output)) == bits(found.clone()), "the continued run sounds different");

    // Where the phase of the start comes out otherwise on two ranks, the level hardly changes.
    folder.call(2, "run", &["--output", &output, "--force"]).good();
    for body in ["lower", "upper"] {
        let name = format!("{body}/total_level_a");
        let (one, two) = (found[&name][0], sound(&output)[&name][0]);
        assert!((one - two).abs() < 1.0, "{body}: {one} dB(A) on one rank, {two} on two");
    }

    // Every dataset is documented, and the picture can be drawn.
    let root = env!("CARGO_MANIFEST_DIR");
    let venv = format!("{root}/.venv/bin/python");
    let python = if std::path::Path::new(&venv).exists() { venv } else { "python3".into() };
    finish(Command::new(&python).args([&format!("{root}/tests/python/documented.py"), &whole])).good();
    let drawn = finish(Command::new(format!("{root}/scripts/plot")).arg(&whole));
    assert!(drawn.good().out.contains("whole-sound-power.png"), "{drawn:?}");
}

#[test]
fn sound_that_cannot_be_found_is_refused() {
    let folder = Folder::with(sliding(json!({ "duration": 0.3, "sound_power": {} })).to_string());
    let refused = |sets: &[&str], parts: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        folder.call(1, "run", &[&sets[..], &["--output", &folder.text("x.h5")]].concat()).failed(2, parts);
    };
    let key = "analyses.transient.sound_power";
    refused(&[], &[key, "100 Hz", "after 0.17", "longer `duration`"]);
    folder.refused(1, &[], 2, &[key, "after 0.17"]);
    refused(&[&format!("{key}.from=0.4")], &[key, "0.4 s to 0.3 s"]);
    refused(&[&format!("{key}.air_density=-1.2")], &["air_density", "-1.2"]);
    refused(&[&format!("{key}.sound_speed=0")], &["sound_speed"]);
    refused(&[&format!("{key}.bodies=[\"middle\"]")], &["bodies", "middle"]);
    refused(&[&format!("{key}.bodies=[]")], &["bodies"]);
    refused(&[&format!("{key}.bodies=[\"upper\",\"upper\"]")], &["bodies"]);
    refused(&[&format!("{key}.max_frequency=50")], &["max_frequency", "min_frequency"]);
    let early = format!("{key}.from=0.05");
    refused(&[&early, &format!("{key}.max_frequency=50e3")], &["max_frequency", "modes kept reach"]);
    refused(&[&early, &format!("{key}.min_frequency=20e3")], &["lowest third octave", "modes kept reach"]);
    // That the modes do not reach so far is known when there are modes.
    assert_eq!(folder.listing(), ["job.json", "x.model.h5", "x.model.shapes.h5"]);
}
