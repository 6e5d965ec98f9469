//! Measured modes in place of computed ones.

use super::program::*;
use super::transient::open;
use serde_json::{json, Value};

/// The swept cylinders with measured modes of the upper one.
fn job_with(measured: Value) -> Value {
    let mut job = job("swept-curve.json");
    job["analyses"] = json!({ "modes": { "count": 12 }, "stability": {} });
    job["bodies"]["upper"]["modes"] = json!({ "measured": measured });
    job["output"] = json!({ "fields": false, "swept_modes": false });
    job
}

fn run(measured: Value) -> (Folder, Ran) {
    let folder = Folder::with(job_with(measured).to_string());
    let ran = folder.call(1, "run", &[]);
    ran.good();
    (folder, ran)
}

fn numbers(folder: &Folder, name: &str) -> Vec<f64> {
    open(folder.path("job.h5")).dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn eigenvalues(folder: &Folder) -> Vec<num_complex::Complex64> {
    open(folder.path("job.h5")).dataset("stability/eigenvalue").and_then(|d| d.read_raw()).expect("eigenvalues")
}

/// A measured frequency equal to the computed one changes no eigenvalue; one that is 2 % higher moves its
/// pair, and no other mode; and the measured damping is that of the mode.
#[test]
fn measured_modes_take_the_place_of_computed_ones() {
    let (plain, _) = run(json!([]));
    let frequency = numbers(&plain, "modes/upper/frequency");
    let orders = numbers(&plain, "modes/upper/diameters");
    let k = (0..frequency.len()).find(|&k| orders[k] == 2.0 && frequency[k] > 0.0).expect("a mode of two diameters");
    let (same, ran) = run(json!([{ "order": 2, "near": frequency[k], "frequency": frequency[k] }]));
    assert_eq!(eigenvalues(&same), eigenvalues(&plain));
    assert!(!ran.out.contains("measured on"), "{}", ran.out);

    let (moved, ran) = run(json!([{ "order": 2, "near": frequency[k], "frequency": 1.02 * frequency[k] }]));
    assert!(ran.out.contains("measured on upper") && ran.out.contains("+2.00 %"), "{}", ran.out);
    let now = numbers(&moved, "modes/upper/frequency");
    for (j, (a, b)) in frequency.iter().zip(&now).enumerate() {
        let want = if (a / frequency[k] - 1.0).abs() < 1e-3 && orders[j] == 2.0 { 1.02 } else { 1.0 };
        assert!((b / a - want).abs() < 1e-9 || (*a == 0.0 && *b == 0.0), "mode {j}: {a} and {b}");
    }
    // Around it there are the pairs of both bodies and one mode beside them. The sum of the squares of the frequencies
    // moves as those of the measured pair, the sum of the growth rates as its damping, whatever the contact couples.
    let omega = std::f64::consts::TAU * frequency[k];
    let around = |folder: &Folder| -> Vec<num_complex::Complex64> {
        eigenvalues(folder).into_iter().filter(|l| (l.im / omega - 1.0).abs() < 0.08).collect()
    };
    let squares = |all: &[num_complex::Complex64]| all.iter().map(|l| (l.im / omega).powi(2)).sum::<f64>();
    let rates = |all: &[num_complex::Complex64]| all.iter().map(|l| l.re).sum::<f64>();
    let (before, after) = (around(&plain), around(&moved));
    assert_eq!((before.len(), after.len()), (5, 5));
    let shift = squares(&after) - squares(&before);
    assert!((shift / (2.0 * (1.02f64.powi(2) - 1.0)) - 1.0).abs() < 0.01, "{shift}");

    let (damped, _) = run(json!([{ "order": 2, "near": frequency[k], "loss_factor": 0.2 }]));
    let found = around(&damped);
    // Of two modes, in place of their Rayleigh damping, −c/2 each.
    let want = -(0.2 * omega - (1.0 + 1e-6 * omega * omega));
    let change = rates(&found) - rates(&before);
    assert!(found.len() == 5 && (change / want - 1.0).abs() < 0.01, "{change}, {want}");
}

#[test]
fn measured_modes_that_cannot_be_are_refused() {
    for (measured, parts) in [
        (
            json!([{ "order": 2, "family": "none", "frequency": 300 }]),
            ["modes.measured.0: found no computed mode", "candidates are"],
        ),
        (json!([{ "near": 1e5, "loss_factor": 0.1 }]), ["no computed mode with near 100000 Hz", "Hz ("]),
    ] {
        let folder = Folder::with(job_with(measured).to_string());
        folder.call(1, "run", &[]).failed(2, &parts);
    }
    for (measured, part) in [
        (json!([{ "frequency": 300 }]), "found neither order nor near"),
        (json!([{ "order": 2 }]), "found nothing measured"),
        (json!([{ "order": 2, "loss_factor": 0.1, "damping_ratio": 0.1 }]), "expected one of them"),
        (json!([{ "near": 300, "family": "axial 0", "frequency": 310 }]), "family without order"),
    ] {
        Folder::with(job_with(measured).to_string()).refused(1, &[], 2, &[part]);
    }
}
