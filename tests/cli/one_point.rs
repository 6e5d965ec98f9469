//! Stability with one point in place of the patch: its eigenvalues by formulas of its own, beside those of the patch,
//! in file and summary.

use super::program::*;
use faer::Mat;
use num_complex::Complex64;
use railsqueal::contact::baseline::coefficients;
use railsqueal::grid::Interface;
use serde_json::json;

const SPEED: f64 = 10.0;
const LOAD: f64 = 70e3;
const FRICTION: f64 = 0.3;
const LATERAL: f64 = 0.03;

fn read<T: hdf5::H5Type>(file: &hdf5::File, name: &str) -> Vec<T> {
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Two unlike wheels at rest but for the contact, in full lateral sliding.
fn sliding() -> serde_json::Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
        job["bodies"][body]["rotation"] = json!("none");
        job["bodies"][body]["damping"] = json!({ "alpha": 1.0, "beta": 1e-6 });
    }
    job["contact"]["creepage"] = json!({ "lateral": LATERAL });
    job["analyses"] = json!({ "modes": { "count": 8 }, "stability": { "contact": "point" } });
    job["output"] = json!({ "fields": false });
    job
}

/// Body data for a contact of one point: squared frequencies and damping, means (x, y, n) over the pressure of the
/// modes and of their slopes along x, `[m]` each.
struct Modes {
    omega: Vec<f64>,
    mean: [Vec<f64>; 3],
    slope: [Vec<f64>; 2],
}

impl Modes {
    /// From the modes of both bodies at the contact, of which the upper one is in lower form, mirrored.
    fn of(file: &hdf5::File) -> Self {
        let [x, y, gap] = ["x", "y", "gap"].map(|name| read::<f64>(file, &format!("reduced/{name}")));
        let s = Interface::new(x, y, gap).expect("the grid");
        let pressure: Vec<f64> = read(file, "stability/pressure");
        let load: f64 = (0..s.len()).map(|i| pressure[i] * s.weight[i]).sum();
        assert!((load / LOAD - 1.0).abs() < 1e-8, "{load}");
        let closed: Vec<usize> = (0..s.len()).filter(|&i| pressure[i] > 0.0).collect();
        let mut modes =
            Self { omega: Vec::new(), mean: [(); 3].map(|()| Vec::new()), slope: [(); 2].map(|()| Vec::new()) };
        for (body, signs) in [("lower", [1.0, 1.0, 1.0]), ("upper", [-1.0, -1.0, 1.0])] {
            let omega: Vec<f64> = read(file, &format!("reduced/{body}/omega"));
            let rows: Vec<f64> = read(file, &format!("reduced/{body}/contact_modes"));
            let m = omega.len();
            for k in 0..m {
                let over = |of: &dyn Fn(usize) -> f64| -> f64 {
                    closed.iter().map(|&i| pressure[i] * s.weight[i] / load * of(i)).sum()
                };
                let at = |i: usize, c: usize| signs[c] * rows[(3 * i + c) * m + k];
                for c in 0..3 {
                    modes.mean[c].push(over(&|i| at(i, c)));
                }
                for c in 0..2 {
                    let rise = |i: usize| (at(i + 1, c) - at(i - 1, c)) / (s.point(i + 1)[0] - s.point(i - 1)[0]);
                    modes.slope[c].push(over(&rise));
                }
            }
            modes.omega.extend(omega);
        }
        modes
    }

    /// How far `lambda` is from an eigenvalue, about, over its size: the least singular value of
    /// λ² + λ (C + ΨtᵀDΨt) + K + k ψnψnᵀ + k ΨtᵀF′ψnᵀ + V ΨtᵀD ∂xΨt over 2|λ|².
    fn distance(&self, lambda: Complex64, stiffness: f64, resistance: [f64; 2], by_load: [f64; 2]) -> f64 {
        let m = self.omega.len();
        let [x, y, n] = &self.mean;
        let matrix = Mat::from_fn(m, m, |i, j| {
            let own = if i == j {
                lambda * (lambda + 1.0 + 1e-6 * self.omega[i].powi(2)) + self.omega[i].powi(2)
            } else {
                0.0.into()
            };
            let creep = |c: usize| lambda * self.mean[c][j] + SPEED * self.slope[c][j];
            let rubbed = x[i] * resistance[0] * creep(0) + y[i] * resistance[1] * creep(1);
            own + rubbed + stiffness * (n[i] + x[i] * by_load[0] + y[i] * by_load[1]) * n[j]
        });
        let values = matrix.singular_values().expect("singular values");
        values.last().expect("modes") / (2.0 * lambda.norm_sqr())
    }
}

/// By the linear theory and by a law that slides as much as it can, whose slopes are known: each eigenvalue makes the
/// modal equations singular, which are put together here from modes, pressure and half-axes alone. Other laws slide
/// as the second does. On one and on two ranks.
#[test]
fn eigenvalues_solve_the_modal_equations() {
    let folder = Folder::with(sliding().to_string());
    for ranks in [1, 2] {
        let ran = folder.call(ranks, "run", &["--output", &folder.text(&format!("{ranks}.h5"))]);
        assert!(ran.good().out.contains("contact of one point") && ran.out.contains("3 by Polach"), "{}", ran.out);
    }
    let [file, other] = [1, 2].map(|ranks| hdf5::File::open(folder.path(&format!("{ranks}.h5"))).expect("results"));
    let modes = Modes::of(&file);
    let half: Vec<f64> = read(&file, "stability/point/half_axes");
    let (young, poisson): (f64, f64) = (205e9, 0.3);
    let stiffness = read::<f64>(&file, "stability/point/stiffness")[0];
    // Of a contact that is nearly round.
    let round = (half[0] * half[1]).sqrt() * young / (1.0 - poisson * poisson);
    assert!((stiffness / round - 1.0).abs() < 1e-3, "{stiffness:e} {round:e} {half:?}");
    let kalker = coefficients(poisson, half[0] / half[1]).expect("half-axes of the table");
    let unit = young / (2.0 * (1.0 + poisson)) * half[0] * half[1];
    let linear = -unit * kalker.lateral * LATERAL;
    let across = kalker.longitudinal / kalker.lateral * FRICTION * LOAD / (SPEED * LATERAL);
    for (law, force, resistance, by_load) in [
        ("linear", linear, [kalker.longitudinal, kalker.lateral].map(|c| unit * c / SPEED), 2.0 / 3.0 * linear / LOAD),
        ("shen_hedrick_elkins", -FRICTION * LOAD, [across, 0.0], -FRICTION),
    ] {
        let name = |what: &str| format!("stability/point/{law}/{what}");
        let found: Vec<f64> = read(&file, &name("force"));
        assert!(found[0].abs() < 1.0 && (found[1] / force - 1.0).abs() < 1e-6, "{law}: {found:?}, expected {force}");
        let values: Vec<Complex64> = read(&file, &name("eigenvalue"));
        assert!(values.len() > 8, "{law}: {values:?}");
        for value in &values {
            let away = modes.distance(*value, stiffness, resistance, [0.0, by_load]);
            assert!(away < 1e-6, "{law}: {value} is {away:e} of itself from an eigenvalue");
        }
        let again: Vec<Complex64> = read(&other, &name("eigenvalue"));
        assert!(values.iter().zip(&again).all(|(a, b)| (a - b).norm() < 1e-7 * b.norm()), "{values:?} {again:?}");
    }
    // Each partner is where it says, and moves at much the same frequency; of what squeals a law that saturates has
    // the sign and the size.
    let patch: Vec<Complex64> = read(&file, "stability/eigenvalue");
    for law in ["linear", "shen_hedrick_elkins", "polach", "fastsim"] {
        let name = |what: &str| format!("stability/point/{law}/{what}");
        let values: Vec<Complex64> = read(&file, &name("eigenvalue"));
        let partner: Vec<i64> = read(&file, &name("partner"));
        let beside: Vec<Complex64> = read(&file, &name("beside"));
        assert_eq!((partner.len(), beside.len()), (values.len(), patch.len()));
        for (here, there) in beside.iter().zip(&patch).filter(|(_, there)| law != "linear" && there.re > 0.0) {
            assert!((here.re / there.re - 1.0).abs() < 0.33, "{law}: {here} beside {there}");
        }
        for (value, p) in values.iter().zip(&partner).filter(|(_, p)| **p >= 0) {
            assert_eq!(beside[*p as usize], *value);
            let there = patch[*p as usize];
            assert!((value.im / there.im - 1.0).abs() < 0.05, "{law}: {value} beside {there}");
        }
    }
    let documented = format!("{}/tests/python/documented.py", env!("CARGO_MANIFEST_DIR"));
    let venv = format!("{}/.venv/bin/python", env!("CARGO_MANIFEST_DIR"));
    let python = if std::path::Path::new(&venv).exists() { venv } else { "python3".into() };
    finish(std::process::Command::new(&python).args([&documented, &folder.text("1.h5")])).good();
}

/// Without the key there is none of it; points have no patch to be compared with.
#[test]
fn it_is_asked_for_and_refused_where_it_has_no_meaning() {
    let mut job = sliding();
    job["analyses"]["stability"] = json!({});
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(!ran.good().out.contains("one point"), "{}", ran.out);
    let file = hdf5::File::open(folder.path("job.h5")).expect("results");
    assert!(file.group("stability").expect("the group").group("point").is_err());
    let hulten = format!("{}/jobs/hulten.json", env!("CARGO_MANIFEST_DIR"));
    let ran = railsqueal(1, &["check", &hulten, "--set", "analyses.stability.contact=point"]);
    ran.failed(2, &["analyses.stability.contact", "contact.points"]);
    let ran = folder.call(1, "check", &["--set", "analyses.stability.contact=line"]);
    ran.failed(2, &["analyses.stability.contact", "patch"]);
}
