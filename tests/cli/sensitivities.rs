//! Derivatives of eigenvalues in whole runs: against differences of runs of their own, in the file and in the summary.

use super::program::*;
use num_complex::Complex64;
use serde_json::json;

/// Two wheels that roll, unlike in the place of the contact, with friction that falls and part of the contact in stick.
fn rolling() -> serde_json::Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
        job["bodies"][body]["rotation"] = json!("rolling");
    }
    job["contact"]["friction"] = json!({ "exponential": { "static": 0.4, "kinetic": 0.25, "decay_velocity": 0.1 } });
    job["contact"]["creepage"] = json!({ "longitudinal": 0.001, "lateral": 0.006, "spin": 0.05 });
    job["analyses"] = json!({ "modes": { "count": 16 }, "stability": {} });
    job["output"] = json!({ "fields": false });
    job
}

fn read<T: hdf5::H5Type>(file: &hdf5::File, name: &str) -> Vec<T> {
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Load, speed (with the rotation of the bodies), creepages and friction, each the whole way through the steady
/// state, with stick and without.
#[test]
fn derivatives_equal_differences_of_runs() {
    let folder = Folder::with(rolling().to_string());
    folder.call(1, "run", &["--output", &folder.text("base.h5")]).good();
    let run = |out: &str, sets: &[String]| {
        let (base, out) = (folder.text("base.h5"), folder.text(out));
        let mut args = vec!["--reuse", &base, "--output", &out, "--force"];
        sets.iter().for_each(|set| args.extend(["--set", set]));
        let ran = folder.call(1, "run", &args);
        ran.good();
        (hdf5::File::open(&out).expect("results"), ran)
    };
    for lateral in [0.006, 0.03] {
        let own = format!("contact.creepage.lateral={lateral}");
        let (here, _) = run("here.h5", &[own.clone(), "analyses.stability.sensitivities=true".into()]);
        let states: Vec<i8> = read(&here, "stability/state");
        assert_eq!(states.contains(&1), lateral == 0.006, "{states:?}");
        let values: Vec<Complex64> = read(&here, "stability/eigenvalue");
        let [at_rest, kinetic] = [0.4, 0.25];
        let law = |scale: f64| {
            let (a, b) = (scale * at_rest, scale * kinetic);
            format!(
                "contact.friction={{\"exponential\": {{\"static\": {a}, \"kinetic\": {b}, \"decay_velocity\": 0.1}}}}"
            )
        };
        type Set<'a> = &'a dyn Fn(f64) -> String;
        let parameters: [(&str, f64, Set); 6] = [
            ("friction", 2e-5, &|by| law(1.0 + by)),
            ("normal_load", 2.0, &|by| format!("contact.normal_load={}", 70e3 + by)),
            ("speed", 2e-4, &|by| format!("contact.speed={}", 10.0 + by)),
            ("longitudinal", 1e-7, &|by| format!("contact.creepage.longitudinal={}", 0.001 + by)),
            ("lateral", 1e-7, &|by| format!("contact.creepage.lateral={}", lateral + by)),
            ("spin", 2e-5, &|by| format!("contact.creepage.spin={}", 0.05 + by)),
        ];
        for (name, step, set) in parameters {
            let of = |out: &str, by: f64| -> Vec<Complex64> {
                read(&run(out, &[own.clone(), set(by)]).0, "stability/eigenvalue")
            };
            let (ahead, behind) = (of("ahead.h5", step), of("behind.h5", -step));
            let found: Vec<Complex64> = read(&here, &format!("stability/sensitivity/{name}"));
            assert_eq!(found.len(), values.len());
            let largest = found.iter().map(|f| f.norm()).fold(0.0, f64::max);
            for (f, l) in found.iter().zip(&values) {
                let near = |all: &[Complex64]| {
                    *all.iter().min_by(|a, b| (*a - l).norm().total_cmp(&(*b - l).norm())).expect("eigenvalues")
                };
                let want = (near(&ahead) - near(&behind)) / (2.0 * step);
                let error = (f - want).norm();
                assert!(error < 1e-4 * want.norm() + 1e-5 * largest, "{lateral}, {l}, by {name}: {f} against {want}");
            }
        }
    }
}

/// The summary says what would end the growth of each unstable mode; every dataset is documented; without the key
/// there is none of it.
#[test]
fn cures_are_told_and_work() {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
    }
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    job["contact"]["friction"] = json!(0.4);
    job["analyses"] = json!({ "modes": { "count": 24 }, "stability": {} });
    job["output"] = json!({ "fields": false });
    let folder = Folder::with(job.to_string());
    let plain = folder.call(1, "run", &["--output", &folder.text("plain.h5")]);
    assert!(!plain.good().out.contains("to stabilise"), "{}", plain.out);
    let set = "analyses.stability.sensitivities=true";
    let base = folder.text("plain.h5");
    let ran = folder.call(1, "run", &["--reuse", &base, "--set", set, "--output", &folder.text("cured.h5")]);
    let file = hdf5::File::open(folder.path("cured.h5")).expect("results");
    let values: Vec<Complex64> = read(&file, "stability/eigenvalue");
    let unstable = values.iter().filter(|l| l.re > 0.0).count();
    assert!(unstable > 0, "{values:?}");
    assert_eq!(ran.good().out.matches("to stabilise (linear estimate)").count(), unstable, "{}", ran.out);
    // The summary begins with the verdict, which the report has in the same words.
    let said = script("check_verdict.py", &[&folder.text("cured.h5"), &base]);
    let [cured, plain] = [&ran, &plain].map(|ran| ran.out.lines().next().unwrap_or_default());
    assert_eq!(said.good().out.lines().collect::<Vec<_>>(), [cured, plain]);
    assert!(plain.starts_with("Squeals at ") && plain.contains("loss factor of the upper body"), "{plain}");
    let plain = hdf5::File::open(folder.path("plain.h5")).expect("results");
    assert!(plain.group("stability").expect("the group").group("sensitivity").is_err());
    let documented = format!("{}/tests/python/documented.py", env!("CARGO_MANIFEST_DIR"));
    let venv = format!("{}/.venv/bin/python", env!("CARGO_MANIFEST_DIR"));
    let python = if std::path::Path::new(&venv).exists() { venv } else { "python3".into() };
    finish(std::process::Command::new(&python).args([&documented, &folder.text("cured.h5")])).good();
    // More damping of all modes by Δζ moves each growth rate by the sum of the derivatives.
    let by: Vec<Complex64> = read(&file, "stability/sensitivity/damping");
    let modes = by.len() / values.len();
    let frequency: Vec<f64> = read(&file, "stability/mode_frequency");
    // α of Rayleigh's damping is 2 ω_k ζ_k.
    let (change, top) = (0.01, values[0]);
    let want =
        top.re + (0..modes).map(|k| by[k].re * change / (4.0 * std::f64::consts::PI * frequency[k])).sum::<f64>();
    let more: Vec<String> = ["lower", "upper"].map(|b| format!("bodies.{b}.damping.alpha={}", 1.0 + change)).into();
    let args = ["--reuse", &base, "--set", &more[0], "--set", &more[1], "--output", &folder.text("more.h5")];
    folder.call(1, "run", &args).good();
    let file = hdf5::File::open(folder.path("more.h5")).expect("results");
    let found = read::<Complex64>(&file, "stability/eigenvalue")[0].re;
    assert!((found - want).abs() < 1e-3 * (want - top.re).abs(), "{found} expected {want}, was {}", top.re);
}
