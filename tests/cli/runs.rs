//! Whole runs: what they print and write, and that the number of ranks does not matter.

use super::program::*;
use serde_json::json;
use std::path::{Path, PathBuf};

fn numbers(file: &Path, name: &str) -> Vec<f64> {
    let file = hdf5::File::open(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    file.dataset(name).and_then(|d| d.read_raw::<f64>()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[track_caller]
fn close(what: &str, a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    let scale = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= tolerance * scale, "{what}: {a:?} and {b:?}");
    }
}

/// Unlike bodies, all creepages: forces and frequencies agree to 1e-7 on 1, 2 and 3 ranks.
#[test]
fn the_number_of_ranks_does_not_matter() {
    let mut job = small();
    job["bodies"]["upper"]["material"]["young"] = json!(70e9);
    job["contact"]["creepage"] = json!({ "longitudinal": 0.001, "lateral": 0.002, "spin": 0.1 });
    let folder = Folder::with(job.to_string());
    let names = ["modes/lower/frequency", "modes/upper/frequency", "contact/force", "contact/approach"];
    let mut first: Option<Vec<Vec<f64>>> = None;
    for ranks in [1, 2, 3] {
        let output = folder.text(&format!("{ranks}.h5"));
        folder.call(ranks, "run", &["--output", &output]).good();
        let found: Vec<Vec<f64>> = names.iter().map(|n| numbers(Path::new(&output), n)).collect();
        assert!(found[0].len() >= 5 && found[2].len() == 3, "{found:?}");
        let expected = first.get_or_insert_with(|| found.clone());
        for (name, (a, b)) in names.iter().zip(found.iter().zip(expected.iter())) {
            close(&format!("{name} on {ranks} ranks"), a, b, 1e-7);
        }
    }
}

/// Without the compliance, by corrections from static solves: the same forces as with it, on two unlike bodies.
#[test]
#[ignore = "long: scripts/validate long"]
fn multigrid_gives_the_forces_of_the_factorisation() {
    multigrid_is_the_factorisation(70e9, json!({ "approach": 1.2e-4 }));
}

/// The same with one body for both places.
#[test]
#[ignore = "long: scripts/validate long"]
fn multigrid_gives_the_forces_of_the_factorisation_for_twins() {
    multigrid_is_the_factorisation(205e9, json!({ "normal_load": 70e3 }));
}

fn multigrid_is_the_factorisation(young: f64, load: serde_json::Value) {
    let mut job = small();
    job["bodies"]["upper"]["material"]["young"] = json!(young);
    job["contact"]["creepage"] = json!({ "longitudinal": 0.001, "lateral": 0.002, "spin": 0.1 });
    job["contact"].as_object_mut().unwrap().remove("normal_load");
    job["contact"].as_object_mut().unwrap().extend(load.as_object().unwrap().clone());
    job["analyses"] = json!({ "steady": {} });
    let folder = Folder::with(job.to_string());
    let found = [("mumps", 1), ("gamg", 2)].map(|(linear, ranks)| {
        let output = folder.text(&format!("{linear}.h5"));
        let set = format!("solver.linear={linear}");
        let ran = folder.call(ranks, "run", &["--output", &output, "--set", &set]);
        assert_eq!(ran.good().out.contains("corrections of the compliance"), linear == "gamg", "{}", ran.out);
        let names =
            ["contact/force", "contact/approach", "contact/pressure", "contact/gap", "VTKHDF/PointData/displacement"];
        names.map(|name| numbers(Path::new(&output), name))
    });
    let [direct, corrected] = &found;
    for (k, what) in ["force", "approach"].into_iter().enumerate() {
        close(what, &corrected[k], &direct[k], 1e-7);
    }
    for (k, what) in [(2, "pressure"), (3, "gap")] {
        close(what, &corrected[k], &direct[k], 1e-6);
    }
    // The parts of the mesh are written rank by rank, so only what does not depend on their order is comparable.
    let largest = |u: &[f64]| [0, 1, 2].map(|c| u.iter().skip(c).step_by(3).fold(0.0f64, |m, v| m.max(v.abs())));
    close("largest displacement", &largest(&corrected[4]), &largest(&direct[4]), 1e-6);
}

#[test]
fn a_run_prints_a_summary_and_writes_beside_the_job() {
    let folder = Folder::with(small().to_string());
    let ran = folder.call(2, "run", &["--only", "steady"]);
    for part in ["steady rolling", "normal force", "job.h5"] {
        assert!(ran.good().out.contains(part), "no {part:?} in: {}", ran.out);
    }
    let first = ran.out.lines().next().unwrap_or_default();
    assert!(first.starts_with("No statement on squeal") && first.ends_with("computed: steady rolling."), "{first}");
    assert!(ran.err.contains("meshing") && ran.err.contains("factorisation"), "progress: {}", ran.err);
    assert!(folder.listing().contains(&"job.h5".to_string()), "{:?}", folder.listing());
    let force = numbers(&folder.path("job.h5"), "contact/force");
    assert!((force[2].abs() - 70e3).abs() < 1e-2, "{force:?}");
    // A second run needs --force, and replaces.
    let half = ["--force", "--only", "steady", "--set", "contact.normal_load=35e3"];
    folder.call(1, "run", &half).good();
    let force = numbers(&folder.path("job.h5"), "contact/force");
    assert!((force[2].abs() - 35e3).abs() < 1e-2, "{force:?}");
}

#[test]
fn one_body_without_contact() {
    let mut job = job("annulus.json");
    let cylinder = &mut job["bodies"]["lower"]["mesh"]["cylinder"];
    cylinder["element_size"] = json!(0.05);
    cylinder["max_element_size"] = json!(0.05);
    job["analyses"]["modes"]["count"] = json!(4);
    let folder = Folder::with(job.to_string());
    folder.call(2, "run", &[]).good();
    let f = numbers(&folder.path("job.h5"), "modes/lower/frequency");
    assert!(f.len() >= 4 && f[0] > 100.0 && f.windows(2).all(|w| w[0] <= w[1]), "{f:?}");
}

/// Mesh files, relative to the job file wherever the program is started.
#[test]
fn bodies_from_files() {
    let folder = Folder::with("");
    let output = folder.text("blocks.h5");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/blocks.json");
    railsqueal(2, &["run", path, "--output", &output]).good();
    let force = numbers(Path::new(&output), "contact/force");
    assert!((force[2].abs() - 5e3).abs() < 1e-3, "{force:?}");
    // Creepages towards +x and +y: friction on body 1 acts towards -x and -y.
    assert!(force[0] < 0.0 && force[1] < 0.0, "{force:?}");
    assert!(force[0].hypot(force[1]) <= 0.3 * 5e3 * (1.0 + 1e-6), "{force:?}");
}

#[test]
fn options_of_petsc_that_nothing_asks_for_are_reported() {
    let mut job = small();
    job["petsc_options"] = json!({ "no_such_option": 3 });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--only", "steady", "--", "-another_one", "x"]);
    for part in ["unused PETSc options", "no_such_option", "another_one"] {
        assert!(ran.good().err.contains(part), "no {part:?} in: {}", ran.err);
    }
}

/// The small job in full lateral sliding.
fn sliding(offsets: [f64; 2]) -> serde_json::Value {
    let mut job = small();
    for (body, offset) in [("lower", offsets[0]), ("upper", offsets[1])] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
    }
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    job["analyses"] = json!({ "modes": { "count": 20 }, "stability": { "direction": "rigid", "damping_ratio": 1 } });
    job["output"] = json!({ "fields": false });
    job
}

/// Growth rates of a job on one rank, falling.
fn growth_rates(job: &serde_json::Value) -> Vec<f64> {
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let rates = numbers(&folder.path("job.h5"), "stability/growth_rate");
    assert!(rates.len() > 20, "{} eigenvalues of 40 modes", rates.len());
    rates
}

/// Mirror images are never unstable at constant friction; a contact off the mid-planes is, for one sign of the
/// creepage.
#[test]
fn squeal_needs_a_contact_off_the_mid_plane_and_the_right_sign_of_creepage() {
    let mut mirrored = sliding([0.02, 0.02]);
    mirrored["contact"]["friction"] = json!(1.0);
    let rates = growth_rates(&mirrored);
    assert!(rates[0] < 0.0, "mirror images: {rates:?}");
    let mut curve = sliding([0.03, 0.02]);
    let rates = growth_rates(&curve);
    assert!(rates[0] > 0.0, "contact off the mid-planes, creepage +1 %: {rates:?}");
    curve["contact"]["creepage"]["lateral"] = json!(-0.01);
    let rates = growth_rates(&curve);
    assert!(rates[0] < 0.0, "contact off the mid-planes, creepage -1 %: {rates:?}");
}

/// At 0 Hz the receptance is the static compliance that the file holds too; beyond the modes it is refused.
#[test]
fn receptances_begin_at_the_static_compliance() {
    let mut job = sliding([0.03, 0.02]);
    job["analyses"] = json!({ "modes": { "count": 10 }, "receptance": { "frequency": [0, 200.0, 500.0] } });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &[]).good();
    let share = numbers(&folder.path("job.h5"), "receptance/share");
    assert!((share.iter().sum::<f64>() - 1.0).abs() < 1e-12 && share.iter().all(|s| *s >= 0.0), "{share:?}");
    let file = hdf5::File::open(folder.path("job.h5")).expect("result file");
    for body in ["lower", "upper"] {
        let compliance = numbers(&folder.path("job.h5"), &format!("reduced/{body}/compliance"));
        let h: Vec<num_complex::Complex64> =
            file.dataset(&format!("receptance/{body}")).and_then(|d| d.read_raw()).expect("receptance");
        assert_eq!(h.len(), 27);
        let rows = 3 * share.len();
        for k in 0..9 {
            let mut want = 0.0;
            for (i, a) in share.iter().enumerate() {
                for (j, b) in share.iter().enumerate() {
                    want += a * b * compliance[(3 * i + k / 3) * rows + 3 * j + k % 3];
                }
            }
            assert!((h[k] - want).norm() < 1e-9 * h[8].norm(), "{body}, {k}: {} and {want}", h[k]);
        }
        // Off the mid-plane a normal force moves the contact sideways.
        assert!(h[5].norm() > 1e-3 * h[8].norm(), "{body}: {} beside {}", h[5], h[8]);
    }
    let beyond = ["--force", "--set", "analyses.receptance.frequency=[0,1e5]"];
    folder.call(1, "run", &beyond).failed(2, &["analyses.receptance.frequency: 100000 Hz", "more modes"]);
}

/// A law that falls with the velocity makes modes grow faster than the same coefficient held constant; loss factors
/// damp.
#[test]
fn falling_friction_drives_and_loss_factors_damp() {
    let mut job = sliding([0.03, 0.02]);
    job["version"] = json!(1);
    job["analyses"]["steady"] = json!({});
    // 10 m/s and 1 %: all nodes slide at 0.1 m/s, where the coefficient is 0.25 + 0.15/e.
    let at_slip = 0.25 + 0.15 * (-1.0f64).exp();
    let runs = [
        ("constant", json!(at_slip), json!({ "alpha": 1.0, "beta": 1e-6 })),
        (
            "falling",
            json!({ "exponential": { "static": 0.4, "kinetic": 0.25, "decay_velocity": 0.1 } }),
            json!({ "alpha": 1.0, "beta": 1e-6 }),
        ),
        (
            "damped",
            json!(at_slip),
            json!({ "modal": { "by_frequency": [{ "up_to": 800, "loss_factor": 0.05 }, { "loss_factor": 0.01 }] } }),
        ),
    ];
    let mut rates = Vec::new();
    let mut told = 0;
    for (name, friction, damping) in runs {
        job["contact"]["friction"] = friction;
        job["bodies"]["lower"]["damping"] = damping.clone();
        job["bodies"]["upper"]["damping"] = damping;
        let folder = Folder::with(job.to_string());
        let ran = folder.call(1, "run", &[]);
        ran.good();
        let (rate, frequency) = ("stability/growth_rate", "stability/frequency");
        let [rate, frequency] = [rate, frequency].map(|name| numbers(&folder.path("job.h5"), name));
        rates.push((name, rate[0]));
        // What grows, oscillates.
        assert!(rate.iter().zip(&frequency).all(|(r, f)| *r < 0.0 || *f > 100.0), "{name}: {rate:?} {frequency:?}");
        told += usize::from(ran.out.contains(
            "default changed: contact.friction.exponential.memory_length is not given: 2e-5 m since format 2",
        ));
        if name == "falling" {
            assert!(
                ran.out.contains("friction memory length             20.0000 µm (minimum for well-posedness "),
                "{}",
                ran.out
            );
            let smallest = numbers(&folder.path("job.h5"), "stability/smallest_memory_length")[0];
            assert!(smallest > 1e-6 && smallest < 2e-5, "{smallest} m");
            let short = format!("contact.friction.exponential.memory_length={}", 0.999 * smallest);
            folder.call(1, "run", &["--force", "--set", &short]).failed(
                2,
                &["contact.friction.exponential.memory_length: found", &format!("expected more than {smallest:.4e} m")],
            );
            let long = format!("contact.friction.exponential.memory_length={}", 1.001 * smallest);
            folder.call(1, "run", &["--set", &long, "--output", &folder.text("long.h5")]).good();
            // Steady rolling has the coefficient at the local creep: between those of fast sliding and of rest.
            let force = numbers(&folder.path("job.h5"), "contact/force");
            let used = force[0].hypot(force[1]) / -force[2];
            assert!(used > 0.25 && used < 0.4 && (used - at_slip).abs() < 0.05, "{used} beside {at_slip}");
        }
    }
    assert_eq!(told, 1, "a job of the first format is told of the memory, where there is one");
    let [constant, falling, damped] = rates[..] else { panic!("{rates:?}") };
    assert!(constant.1 > 0.0 && falling.1 > constant.1 + 1.0 && damped.1 < 0.0, "{rates:?}");
}

/// A law that has fallen by half at 0.1 m/s drives as the exponential one does, and a rising one is refused by its key.
#[test]
fn the_rational_law_falls_too() {
    let mut job = sliding([0.03, 0.02]);
    let mut rates = Vec::new();
    for friction in [json!(0.325), json!({ "rational": { "static": 0.4, "kinetic": 0.25, "half_velocity": 0.1 } })] {
        job["contact"]["friction"] = friction;
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).good();
        rates.push(numbers(&folder.path("job.h5"), "stability/growth_rate")[0]);
        let rising = [
            "--force",
            "--set",
            "contact.friction={\"rational\":{\"static\":0.2,\"kinetic\":0.3,\"half_velocity\":1}}",
        ];
        folder
            .call(1, "run", &rising)
            .failed(2, &["contact.friction.rational.kinetic: found 0.3", "at most static (0.2)"]);
    }
    assert!(rates[1] > rates[0] + 1.0, "{rates:?}");
}

/// Exchanging the bodies and turning all creepages round changes no eigenvalue; neither does the number of ranks.
#[test]
fn exchanged_bodies_have_the_same_spectrum() {
    let mut job = sliding([0.03, 0.02]);
    job["contact"]["creepage"] = json!({ "longitudinal": 0.004, "lateral": 0.01, "spin": 0.3 });
    let mut turned = sliding([0.02, 0.03]);
    turned["contact"]["creepage"] = json!({ "longitudinal": -0.004, "lateral": -0.01, "spin": -0.3 });
    let names = ["stability/growth_rate", "stability/frequency"];
    let spectrum = |job: &serde_json::Value, ranks| {
        let folder = Folder::with(job.to_string());
        folder.call(ranks, "run", &[]).good();
        names.map(|n| numbers(&folder.path("job.h5"), n))
    };
    let here = spectrum(&job, 1);
    for (what, there) in [("exchanged", spectrum(&turned, 1)), ("on 2 ranks", spectrum(&job, 2))] {
        for (name, (a, b)) in names.iter().zip(here.iter().zip(&there)) {
            close(&format!("{name}, {what}"), a, b, 1e-7);
        }
    }
}

/// The full system has the eigenvalues of the reduced model, the nearer the more modes are kept, on any number of
/// ranks.
#[test]
#[ignore = "long: scripts/validate long"]
fn the_reduced_model_converges_to_the_full_system() {
    let mut job = sliding([0.03, 0.02]);
    job["analyses"]["stability"] = json!({ "direction": "rigid", "full": { "max_frequency": 1500, "count": 10 } });
    // Damping of the residual compliance, which the reduced model leaves out, would hide what the modes do.
    for body in ["lower", "upper"] {
        job["bodies"][body]["damping"] = json!({ "alpha": 1.0 });
    }
    let mut errors = Vec::new();
    let mut first: Option<[Vec<f64>; 2]> = None;
    for (modes, ranks) in [(20, 1), (80, 3)] {
        job["analyses"]["modes"]["count"] = json!(modes);
        let folder = Folder::with(job.to_string());
        let ran = folder.call_alone(ranks, "run", &[]);
        assert!(ran.good().out.contains("stability of the full system"), "{}", ran.out);
        let file = folder.path("job.h5");
        let [growth, frequency, partner] =
            ["growth_rate", "frequency", "partner"].map(|n| numbers(&file, &format!("stability/{n}")));
        let (backward, opening) =
            (numbers(&file, "stability/backward_error"), numbers(&file, "stability/constraint_violation"));
        assert!(backward.iter().chain(&opening).all(|e| *e <= 1e-9), "{backward:?} {opening:?}");
        let shares = numbers(&file, "stability/participation");
        let columns = shares.len() / growth.len();
        let mut worst = 0.0f64;
        let full: Vec<usize> = (0..growth.len()).filter(|&i| partner[i] >= 0.0 && partner[i] < i as f64).collect();
        assert!(full.len() >= 10, "{} pairs", full.len());
        for &i in &full {
            let j = partner[i] as usize;
            assert_eq!(partner[j] as usize, i, "partners of each other");
            let omega = 2.0 * std::f64::consts::PI;
            let distance = (growth[i] - growth[j]).hypot(omega * (frequency[i] - frequency[j]));
            worst = worst.max(distance / (omega * frequency[i]));
            let difference = (0..columns).map(|k| (shares[i * columns + k] - shares[j * columns + k]).abs());
            let difference: f64 = difference.sum();
            assert!(difference < 5e-3, "participation at {} Hz differs by {difference}", frequency[i]);
        }
        errors.push(worst);
        let found = [&frequency, &growth].map(|v| full.iter().map(|&i| v[i]).collect::<Vec<f64>>());
        let expected = first.get_or_insert_with(|| found.clone());
        for (a, b) in found.iter().zip(expected.iter()) {
            close("full spectrum", a, b, 1e-7);
        }
    }
    // Four times the modes reach twice the frequency or more; what is left out falls at least with its square.
    assert!(errors[0] < 5e-4 && errors[1] < 0.25 * errors[0], "{errors:?}");
}

/// Python with what the pictures and the checks need.
fn python() -> PathBuf {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    if venv.exists() {
        venv
    } else {
        "python3".into()
    }
}

/// The file of complex modes and the tables that go with it.
#[track_caller]
fn check_modes(folder: &Folder, job: &serde_json::Value) {
    let radii = ["inner_radius", "outer_radius"].map(|r| job["bodies"]["lower"]["mesh"]["cylinder"][r].to_string());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/check_modes.py");
    let check = std::process::Command::new(python()).arg(script).arg(folder.path("job.h5")).args(&radii).output();
    let check = check.expect("python3 with h5py and vtk");
    assert!(check.status.success(), "{}", String::from_utf8_lossy(&check.stderr));
}

/// Loss factors mean the same in both systems: the modes kept are damped, the rest is not. Shapes and their energies
/// with it.
#[test]
#[ignore = "long: scripts/validate long"]
fn modal_damping_is_that_of_the_full_system_too() {
    modal_damping_on(&[2]);
}

/// The same on one rank, with the same spectrum.
#[test]
#[ignore = "long: scripts/validate long"]
fn modal_damping_does_not_depend_on_ranks() {
    modal_damping_on(&[1, 2]);
}

fn modal_damping_on(all: &[usize]) {
    let mut job = sliding([0.03, 0.02]);
    job["analyses"]["stability"] = json!({ "direction": "rigid", "full": { "max_frequency": 1500, "count": 10 } });
    job["analyses"]["stability"]["phases"] = json!(4);
    job["output"] = json!({ "fields": true });
    job["bodies"]["lower"]["damping"] = json!({ "modal": { "by_mode": [0.01, 0.03, 0.02] } });
    let bands = json!([{ "up_to": 700, "loss_factor": 0.03 }, { "loss_factor": 0.01 }]);
    job["bodies"]["upper"]["damping"] = json!({ "modal": { "by_frequency": bands } });
    let mut first: Option<[Vec<f64>; 2]> = None;
    for &ranks in all {
        let folder = Folder::with(job.to_string());
        folder.call_alone(ranks, "run", &[]).good();
        let [growth, frequency, partner] =
            ["growth_rate", "frequency", "partner"].map(|n| numbers(&folder.path("job.h5"), &format!("stability/{n}")));
        let full: Vec<usize> = (0..growth.len()).filter(|&i| partner[i] >= 0.0 && partner[i] < i as f64).collect();
        assert!(full.len() >= 10, "{} pairs", full.len());
        let omega = 2.0 * std::f64::consts::PI;
        for &i in &full {
            let j = partner[i] as usize;
            let distance = (growth[i] - growth[j]).hypot(omega * (frequency[i] - frequency[j]));
            assert!(distance < 5e-4 * omega * frequency[i], "{distance} 1/s apart at {} Hz", frequency[i]);
            // The least loss factor is 0.01, so damping is worth ten times the distance that is allowed.
            assert!(growth[i] < 0.0, "growth rate {} at {} Hz", growth[i], frequency[i]);
        }
        let found = [&frequency, &growth].map(|v| full.iter().map(|&i| v[i]).collect::<Vec<f64>>());
        let expected = first.get_or_insert_with(|| found.clone());
        for (a, b) in found.iter().zip(expected.iter()) {
            close("full spectrum", a, b, 1e-7);
        }
        if ranks == all[0] {
            check_modes(&folder, &job);
        }
    }
}

/// Loss factors of modes leave out what springs with a loss factor of their own store: in the reduced system and in a
/// model of an earlier run. Dashpots in place of that loss factor do not.
#[test]
fn springs_with_their_own_loss_are_not_damped_twice() {
    springs_with_loss(false);
}

/// The same in the full system.
#[test]
#[ignore = "long: scripts/validate long"]
fn springs_with_their_own_loss_are_not_damped_twice_in_the_full_system() {
    springs_with_loss(true);
}

fn springs_with_loss(in_full: bool) {
    let mut job = sliding([0.03, 0.02]);
    let reduced = json!({ "direction": "rigid" });
    job["analyses"]["stability"] = reduced.clone();
    if in_full {
        job["analyses"]["stability"]["full"] = json!({ "max_frequency": 600, "count": 6 });
    }
    job["output"] = json!({ "fields": false });
    let stiffness = 4e9;
    let springs = json!({ "x": stiffness, "y": stiffness, "z": stiffness });
    job["bodies"]["lower"]["fixed"] = json!([]);
    job["bodies"]["lower"]["rotation"] = json!("none");
    job["bodies"]["lower"]["damping"] = json!({ "modal": { "by_mode": [0.05] } });
    let lossy = json!([{ "group": "inner", "stiffness": springs, "loss_factor": 0.02, "loss_frequency": 400 }]);
    let dashpot = 0.02 * stiffness / (2.0 * std::f64::consts::PI * 400.0);
    let dashpots =
        json!([{ "group": "inner", "stiffness": springs, "damping": { "x": dashpot, "y": dashpot, "z": dashpot } }]);
    let mut first = Vec::new();
    for supports in [lossy, dashpots] {
        let own = supports[0].get("loss_factor").is_some();
        job["bodies"]["lower"]["supports"] = supports;
        if !own {
            job["analyses"]["stability"] = reduced.clone();
        }
        let folder = Folder::with(job.to_string());
        folder.call(1, "run", &[]).good();
        let part = hdf5::File::open(folder.path("job.h5")).expect("result file").dataset("reduced/lower/springs");
        assert_eq!(part.is_ok(), own);
        let growth = numbers(&folder.path("job.h5"), "stability/growth_rate");
        first.push(growth[0]);
        if !own {
            continue;
        }
        let [frequency, partner] = match in_full {
            true => ["frequency", "partner"].map(|n| numbers(&folder.path("job.h5"), &format!("stability/{n}"))),
            false => [vec![], vec![]],
        };
        let full: Vec<usize> = (0..partner.len()).filter(|&i| partner[i] >= 0.0 && partner[i] < i as f64).collect();
        assert!(!in_full || full.len() >= 3, "{} pairs", full.len());
        for &i in &full {
            let j = partner[i] as usize;
            let omega = 2.0 * std::f64::consts::PI;
            let distance = (growth[i] - growth[j]).hypot(omega * (frequency[i] - frequency[j]));
            assert!(distance < 5e-4 * omega * frequency[i], "{distance} 1/s apart at {} Hz", frequency[i]);
        }
        let args = ["--reuse", &folder.text("job.h5"), "--output", &folder.text("again.h5"), "--only", "stability"];
        folder.call(2, "run", &[&args[..], &["--set", "analyses.stability.full=null"]].concat()).good();
        let again = numbers(&folder.path("again.h5"), "stability/growth_rate");
        close("growth of the earlier model", &again[..10], &growth[..10], 1e-8);
    }
    assert!(first[0] > first[1] + 1.0, "{first:?}");
}

/// Complex modes play in VTK, keep to the supports and the contact, and their energies add up; those of the full system
/// do so in the tests of modal damping.
#[test]
fn complex_modes_are_motions_of_the_bodies() {
    let mut job = sliding([0.03, 0.02]);
    job["output"] = json!({ "fields": true });
    job["analyses"]["stability"] = json!({ "shapes": 4, "phases": 8 });
    let folder = Folder::with(job.to_string());
    folder.call(2, "run", &[]).good();
    assert!(folder.listing().contains(&"job.modes.vtkhdf".to_string()), "{:?}", folder.listing());
    let plot = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/plot");
    let ran = finish(std::process::Command::new(plot).args([&folder.text("job.h5"), "--modes", "1"]));
    assert!(ran.good().out.contains("job-complex-modes.png"), "{ran:?}");
    check_modes(&folder, &job);
}
