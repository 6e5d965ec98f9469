//! Contact points of bodies given by matrices beyond stability: in time, under a load, as receptances; against closed
//! forms.

use super::program::*;
use serde_json::{json, Value};
use std::f64::consts::PI;
use std::path::Path;

/// A job of `jobs/` with its folder of matrices.
fn with_matrices(name: &str, change: impl FnOnce(&mut Value)) -> Folder {
    let mut job = job(&format!("{name}.json"));
    change(&mut job);
    let folder = Folder::with(job.to_string());
    std::fs::create_dir(folder.path(name)).unwrap();
    for file in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs").join(name)).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), folder.path(name).join(file.file_name())).unwrap();
    }
    folder
}

fn read(folder: &Folder, name: &str) -> Vec<f64> {
    hdf5::File::open(folder.path("job.h5")).unwrap().dataset(name).unwrap().read_raw::<f64>().unwrap()
}

#[track_caller]
fn near(got: f64, want: f64, relative: f64) {
    assert!((got - want).abs() <= relative * want.abs(), "{got:.12}, expected {want:.12} within {relative:.0e}");
}

/// Growth rate, 1/s, and frequency, Hz, of a motion c + a exp(σt) cos(ωt + φ) sampled every `h` seconds, by least
/// squares: its differences d follow d_{n+1} = 2 e^{σh} cos(ωh) d_n − e^{2σh} d_{n−1}.
fn growth(samples: &[f64], h: f64) -> (f64, f64) {
    let d: Vec<f64> = samples.windows(2).map(|w| w[1] - w[0]).collect();
    let mut normal = [[0.0; 2]; 2];
    let mut right = [0.0; 2];
    for w in d.windows(3) {
        let known = [w[1], -w[0]];
        for i in 0..2 {
            right[i] += known[i] * w[2];
            (0..2).for_each(|j| normal[i][j] += known[i] * known[j]);
        }
    }
    let [[a, b], [c, e]] = normal;
    let det = a * e - b * c;
    let (sum, square) = ((right[0] * e - b * right[1]) / det, (a * right[1] - c * right[0]) / det);
    (square.ln() / (2.0 * h), (0.5 * sum / square.sqrt()).acos() / (2.0 * PI * h))
}

/// Hultén's oscillator grows in time as its eigenvalue says, σ = 72.3586 1/s at 89.1354 Hz, with the second order of
/// the midpoint rule.
#[test]
fn hultens_flutter_grows_in_time() {
    let folder = with_matrices("hulten", |job| {
        job["bodies"]["lower"]["matrices"]["damping"] = Value::Null;
        let point = |d: i32| json!({ "direction": [d], "force": 100, "slip_velocity": 1 });
        job["contact"] = json!({ "friction": 0.4, "points": [point(-1), point(1)] });
    });
    let mut errors = Vec::new();
    for (ranks, step) in [(1, 1e-4f64), (2, 5e-5)] {
        let wanted =
            json!({ "duration": 0.06, "step": step, "start": { "mode": 1, "amplitude": 1e-9 }, "modal_stride": 1 });
        folder.call(ranks, "run", &["--force", "--set", &format!("analyses.transient={wanted}")]).good();
        let (sigma, omega) = (read(&folder, "stability/growth_rate")[0], read(&folder, "stability/frequency")[0]);
        near(sigma, 72.3586, 1e-6);
        let modal = read(&folder, "transient/modal_displacement");
        let stride = (1e-3 / step).round() as usize;
        // After the discrete motion that the eigenvector of the continuous one leaves out has died away, as exp(−72
        // t) against exp(72 t).
        let samples: Vec<f64> =
            modal.chunks_exact(2).skip((0.02 / step) as usize).step_by(stride).map(|q| q[0]).collect();
        let (rate, frequency) = growth(&samples, 1e-3);
        errors.push([rate - sigma, frequency - omega]);
        assert!(read(&folder, "transient/stick").iter().all(|&s| s == 0.0), "a small motion does not stick");
    }
    for (k, (what, value)) in [("growth rate", 72.3586), ("frequency", 89.1354)].into_iter().enumerate() {
        let (coarse, fine) = (errors[0][k], errors[1][k]);
        near(coarse / fine, 4.0, 0.05);
        assert!((fine - (coarse - fine) / 3.0).abs() < 1e-5 * value, "{what}: errors {coarse:e}, {fine:e}");
    }
}

/// A mass on a belt under Coulomb's constant friction swings about its place at rest. Its velocity never exceeds that
/// of the belt: a larger motion sticks, and leaves the belt with the amplitude v/ω, which it keeps; a smaller one
/// never sticks and keeps its own.
#[test]
fn a_mass_on_a_belt_settles_at_the_velocity_of_the_belt() {
    let (mass, stiffness, force, mu, v) = (2.0f64, 8e4, 500.0, 0.4, 0.2);
    let omega = (stiffness / mass).sqrt();
    let folder = with_matrices("belt", |job| {
        job["contact"]["friction"] = json!(mu);
        job["analyses"]["transient"] = json!({ "duration": 0.2, "step": 1e-5, "modal_stride": 1, "contact_stride": 1 });
    });
    for (ranks, amplitude) in [(1, 4.0 * v / omega), (2, 0.9 * v / omega)] {
        let start = format!("analyses.transient.start={}", json!({ "mode": 1, "amplitude": amplitude }));
        folder.call(ranks, "run", &["--force", "--set", &start]).good();
        // x = q/√m of the mode along x, from the state of rest.
        let moved: Vec<f64> =
            read(&folder, "transient/modal_displacement").chunks_exact(2).map(|q| q[0] / mass.sqrt()).collect();
        let settled = &moved[moved.len() / 2..];
        let (low, high) = settled.iter().fold((f64::MAX, f64::MIN), |(l, h), &x| (l.min(x), h.max(x)));
        near(0.5 * (high - low), amplitude.min(v / omega), 2e-4);
        assert!((high + low).abs() < 2e-4 * (high - low), "{low} to {high} m");
        let stick = read(&folder, "transient/stick");
        assert_eq!(stick.iter().any(|&s| s > 0.0), amplitude > v / omega, "sticks at first if it is large");
        assert!(
            stick[stick.len() - 200..].iter().all(|&s| s == 0.0),
            "what has settled touches the velocity of the belt and slides on"
        );
        let traction = read(&folder, "transient/contact_traction");
        let largest = traction.iter().fold(0.0f64, |m, t| m.max(t.abs()));
        assert!(largest <= mu * force * (1.0 + 1e-9), "{largest} N beyond Coulomb's bound");
    }
}

/// Friction that falls and is remembered over 0.2 mm drives the mass on the belt in time as in the eigenvalue;
/// without memory it would grow at −μ′N/2m = 21 1/s.
#[test]
fn falling_friction_drives_a_mass_on_a_belt_in_time() {
    let folder = with_matrices("belt", |job| {
        let law = json!({ "static": 0.4, "kinetic": 0.3, "decay_velocity": 0.3, "memory_length": 2e-4 });
        job["contact"]["friction"] = json!({ "exponential": law });
        let start = json!({ "mode": 1, "amplitude": 1e-8 });
        job["analyses"]["transient"] = json!({ "duration": 0.15, "step": 2e-5, "start": start, "modal_stride": 1 });
    });
    folder.call(2, "run", &[]).good();
    let (sigma, frequency) = (read(&folder, "stability/growth_rate")[0], read(&folder, "stability/frequency")[0]);
    let slope = -0.1 / 0.3 * (-0.2f64 / 0.3).exp();
    assert!(sigma > 5.0 && sigma < 0.98 * -slope * 500.0 / 4.0, "{sigma} 1/s");
    // Once what the material remembers has come to follow the motion.
    let modal = read(&folder, "transient/modal_displacement");
    let samples: Vec<f64> = modal.chunks_exact(2).skip(1500).step_by(50).map(|q| q[0]).collect();
    let found = growth(&samples, 1e-3);
    near(found.0, sigma, 1e-3);
    near(found.1, frequency, 1e-4);
}

/// Two contacts of one body on springs that couple normal and tangential motion, under one load: the shares in closed
/// form.
fn two_contacts(change: impl FnOnce(&mut Value)) -> Folder {
    let folder = with_matrices("belt", |job| {
        let contact = |t: i32, n: i32| json!({ "tangential": [t], "normal": n });
        job["bodies"] = json!({ "lower": { "matrices": {
            "mass": "m.mtx", "stiffness": "k.mtx", "contacts": [contact(1, 2), contact(3, 4)]
        } } });
        let point = |d: i32, gap: f64| json!({ "direction": [d], "slip_velocity": 1, "gap": gap });
        job["contact"] = json!({ "friction": 0.4, "normal_load": 1000, "points": [point(1, 0.0), point(-1, 2e-6)] });
        job["analyses"] = json!({ "modes": { "count": 2 }, "stability": {} });
        change(job);
    });
    let write = |name: &str, entries: &str| {
        let head = "%%MatrixMarket matrix coordinate real symmetric\n";
        std::fs::write(folder.path(name), format!("{head}4 4 {}\n{entries}", entries.lines().count())).unwrap();
    };
    write("m.mtx", "1 1 2\n2 2 2\n3 3 3\n4 4 3\n");
    write("k.mtx", "1 1 6e7\n2 1 2e7\n2 2 9e7\n3 3 5e7\n4 3 -1e7\n4 4 7e7\n");
    folder
}

/// Compliance of each contact of [`two_contacts`], (nn, nt), m/N.
fn yielding() -> [[f64; 2]; 2] {
    [[6e7, 2e7, 9e7], [5e7, -1e7, 7e7]].map(|[tt, tn, nn]: [f64; 3]| {
        let det = tt * nn - tn * tn;
        [tt / det, -tn / det]
    })
}

#[test]
fn a_load_is_shared_by_its_contacts() {
    let folder = two_contacts(|_| ());
    let (mu, load, gap) = (0.4, 1000.0, [0.0, 2e-6]);
    // Body 1 slides along τ, so that t = −μ p τ: it gives way by C_nn p − μ τ C_nt p.
    let [a, b] = [(0, 1.0), (1, -1.0)].map(|(i, tau)| yielding()[i][0] - mu * tau * yielding()[i][1]);
    let approach = (load + gap[0] / a + gap[1] / b) / (1.0 / a + 1.0 / b);
    let forces = [(approach - gap[0]) / a, (approach - gap[1]) / b];
    for ranks in [1, 2] {
        folder.call(ranks, "run", &["--force"]).good();
        let found = read(&folder, "stability/pressure");
        (0..2).for_each(|i| near(found[i], forces[i], 1e-10));
        near(read(&folder, "stability/approach")[0], approach, 1e-10);
        let force = read(&folder, "stability/force");
        near(force[0], -mu * (forces[0] - forces[1]), 1e-9);
        near(force[2], -load, 1e-10);
    }
    // Given one by one the same forces have the same eigenvalues, and rest stays rest in time, whichever way they are
    // held.
    let growth = read(&folder, "stability/growth_rate");
    let each = two_contacts(|job| {
        let point = |d: i32, force: f64| json!({ "direction": [d], "slip_velocity": 1, "force": force });
        job["contact"] = json!({ "friction": 0.4, "points": [point(1, forces[0]), point(-1, forces[1])] });
    });
    each.call(1, "run", &[]).good();
    read(&each, "stability/growth_rate")
        .iter()
        .zip(&growth)
        .for_each(|(a, b)| assert!((a - b).abs() < 1e-6, "{a} {b}"));
    let still = json!({ "duration": 0.01, "step": 1e-5, "contact_stride": 100 });
    let still = format!("analyses.transient={still}");
    // With one mode the contacts have compliance of their own, with all of them none.
    for (folder, sets) in [
        (&folder, &["--set", "analyses.transient.hold=load", "--set", "analyses.modes.count=1"][..]),
        (&folder, &["--set", "analyses.transient.hold=approach", "--set", "analyses.modes.count=4"]),
        (&each, &["--set", "analyses.modes.count=1"]),
        (&each, &["--set", "analyses.modes.count=4"]),
    ] {
        folder.call(1, "run", &[&["--force", "--set", &still], sets].concat()).good();
        let pressure = read(folder, "transient/contact_pressure");
        pressure.iter().enumerate().for_each(|(k, &p)| near(p, forces[k % 2], 1e-7));
    }
}

/// The receptance of masses on springs, in closed form; forces that are given spread the unit force.
#[test]
fn receptances_of_matrices_are_those_of_masses_on_springs() {
    let frequency = [0.0, 40.0, 900.0];
    let folder = with_matrices("belt", |job| {
        job["analyses"]["receptance"] = json!({ "frequency": frequency });
        job["analyses"]["transient"].take();
    });
    folder.call(2, "run", &[]).good();
    let file = hdf5::File::open(folder.path("job.h5")).unwrap();
    let found = file.dataset("receptance/upper").unwrap().read_raw::<num_complex::Complex<f64>>().unwrap();
    for (f, block) in frequency.iter().zip(found.chunks_exact(9)) {
        let omega = 2.0 * PI * f;
        let closed = [1.0 / (8e4 - 2.0 * omega * omega), 1.0 / (2e5 - 2.0 * omega * omega), 0.0];
        for (row, column) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let want = if row == column { closed[row] } else { 0.0 };
            let got = block[3 * row + column];
            assert!(
                (got - want).norm() <= 1e-10 * closed[0].abs(),
                "{f} Hz, ({row}, {column}): {got}, expected {want}"
            );
        }
    }
    let rigid = file.dataset("receptance/lower").unwrap().read_raw::<num_complex::Complex<f64>>().unwrap();
    assert!(rigid.iter().all(|r| r.norm() == 0.0));
}

/// A run that is stopped goes on bit for bit, with bodies read anew.
#[test]
fn a_stopped_run_of_contact_points_goes_on() {
    let sets = ["--set", "analyses.transient.duration=0.08", "--set", "analyses.transient.segment=1000"];
    let (whole, stopped) = (with_matrices("belt", |_| ()), with_matrices("belt", |_| ()));
    whole.call(1, "run", &sets).good();
    let output = stopped.path("job.h5").display().to_string();
    let call = |more: &[&str]| stopped.call(1, "run", &[&sets, &["--output", &output][..], more].concat());
    call(&["--wall-time", "0.001"]).failed(5, &["--resume", "after 1000 of 4000 steps"]);
    stopped.call(1, "run", &[&sets[..], &["--resume", &output]].concat()).good();
    for name in ["modal_displacement", "force", "contact_traction", "stick"] {
        let name = format!("transient/{name}");
        assert_eq!(read(&whole, &name), read(&stopped, &name), "{name}");
    }
    // Other matrices are another run.
    let other = with_matrices("belt", |_| ());
    let output = other.path("job.h5").display().to_string();
    let call = |more: &[&str]| other.call(1, "run", &[&sets[..], more].concat());
    call(&["--output", &output, "--wall-time", "0.001"]).failed(5, &["--resume"]);
    let text = other.text("belt/stiffness.mtx").replace("8e4", "8.1e4");
    std::fs::write(other.path("belt/stiffness.mtx"), text).unwrap();
    let refused = call(&["--resume", &output]);
    assert!(matches!(refused.code, Some(2 | 3)), "{refused:?}");
}

/// Analyses that bodies of matrices cannot give are refused before anything is read, by `check` as by `run`, with an
/// alternative.
#[test]
fn what_matrices_cannot_give_is_refused() {
    let refused = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        let folder = with_matrices("belt", |job| change(job));
        std::fs::remove_file(folder.path("belt/mass.mtx")).unwrap();
        folder.refused(1, &[], 2, parts);
        folder.call(2, "run", &[]).failed(2, parts);
    };
    let upper = "which bodies.upper does not have: it is given by matrices";
    refused(
        &|job| job["analyses"]["steady"] = json!({}),
        &["analyses.steady: needs meshes with a contact surface", upper],
    );
    refused(
        &|job| job["analyses"]["transient"]["points"] = json!([{ "name": "a", "body": "upper", "at": [0, 0, 0] }]),
        &["analyses.transient.points: needs meshes", upper],
    );
    refused(&|job| job["analyses"]["transient"]["sound_power"] = json!({}), &["sound_power: needs surfaces", upper]);
    refused(&|job| job["analyses"]["transient"]["body_stride"] = json!(10), &["body_stride: needs meshes", upper]);
    refused(
        &|job| job["contact"]["points"][0].as_object_mut().unwrap().retain(|k, _| k != "force"),
        &["contact.points.0.force: missing"],
    );
    refused(&|job| job["contact"]["normal_load"] = json!(100), &["contact.points.0.force: given beside a load"]);
    // The belt's mass does not move along the normal: a load has nothing to be shared out by.
    let folder = with_matrices("belt", |job| {
        job["contact"]["normal_load"] = json!(100);
        job["contact"]["points"][0].as_object_mut().unwrap().retain(|k, _| k != "force");
    });
    folder.call(2, "run", &[]).failed(2, &["contact.normal_load", "contact.points.N.force"]);
}
