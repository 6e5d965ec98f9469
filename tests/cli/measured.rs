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
    let shape = |points, motion| json!([{ "shape": { "points": points, "motion": motion }, "frequency": 300 }]);
    for (measured, part) in [
        (json!([{ "frequency": 300 }]), "found neither order nor near nor shape"),
        (
            json!([{ "near": 300, "frequency_deviation": 1 , "loss_factor": 0.1}]),
            "frequency_deviation without frequency",
        ),
        (shape(json!([[0, 0, 0.4]]), json!([[1, 2, null]])), "found 2 measured components, expected at least 6"),
        (shape(json!([[0, 0, 0.4]]), json!([[1, 2, 3], [1, 2, 3]])), "found 1 points and 2 motions"),
        (json!([{ "order": 2 }]), "found nothing measured"),
        (json!([{ "order": 2, "loss_factor": 0.1, "damping_ratio": 0.1 }]), "expected one of them"),
        (json!([{ "near": 300, "family": "axial 0", "frequency": 310 }]), "family without order"),
    ] {
        Folder::with(job_with(measured).to_string()).refused(1, &[], 2, &[part]);
    }
}

/// Values of a data set of the mode shapes of a run.
fn of_shapes(folder: &Folder, name: &str) -> Vec<f64> {
    open(folder.path("job.free_modes.vtkhdf")).dataset(name).and_then(|d| d.read_raw()).expect("mode shapes")
}

/// The mode number `mode` of the upper body of a run as it would be measured at some points, of which `own` makes the
/// coordinates of a job: with another factor, errors of some per cent, and one direction in five not measured.
fn measured_shape(folder: &Folder, mode: usize, own: impl Fn(&[f64]) -> [f64; 3]) -> Value {
    let points = of_shapes(folder, "VTKHDF/Points");
    let all = of_shapes(folder, "VTKHDF/PointData/shape");
    let lower = numbers(folder, "modes/lower/frequency").len();
    let motion = &all[(lower + mode) * points.len()..][..points.len()];
    let moved: Vec<usize> = (0..points.len() / 3)
        .filter(|&p| points[3 * p + 2] > 0.05 && motion[3 * p..3 * p + 3].iter().any(|u| *u != 0.0))
        .collect();
    let chosen: Vec<usize> = (0..24).map(|k| moved[(2 * k + 1) * moved.len() / 48]).collect();
    let component = |p: usize, c: usize| {
        let error = 1.0 + 0.03 * (7.0 * (3 * p + c) as f64).sin();
        (!(3 * p + c).is_multiple_of(5)).then_some(-40.0 * error * motion[3 * p + c])
    };
    let motions: Vec<[Option<f64>; 3]> = chosen.iter().map(|&p| [0, 1, 2].map(|c| component(p, c))).collect();
    let points: Vec<[f64; 3]> = chosen.iter().map(|&p| own(&points[3 * p..3 * p + 3])).collect();
    json!({ "points": points, "motion": motions })
}

/// A measured shape finds its mode: of a swept wheel at points about its axle, and of a mesh at points of the result
/// file, on one rank and on two. Beside the body, or with other axes, it is refused.
#[test]
#[ignore = "long: scripts/validate long"]
fn measured_shapes_find_their_modes() {
    let mut swept = job_with(json!([]));
    swept["output"] = json!({ "fields": false, "swept_modes": true });
    let mut mesh = small();
    mesh["analyses"] = json!({ "modes": { "count": 8 } });
    for (job, ranks, about_axle) in [(swept, 1, true), (mesh, 2, false)] {
        let plain = Folder::with(job.to_string());
        plain.call(1, "run", &[]).good();
        let frequency = numbers(&plain, "modes/upper/frequency");
        // The third of the mesh is one by itself, as is the torsion of the wheel.
        let own = |p: &[f64]| if about_axle { [p[0], p[1] + 0.03, p[2] - 0.5] } else { [p[0], p[1], p[2]] };
        let (mut moved, mut found) = (0, Vec::new());
        for mode in 2..6 {
            let shape = measured_shape(&plain, mode, own);
            let mut again = job.clone();
            again["output"] = json!({ "fields": false, "swept_modes": false });
            let measured = json!([{ "shape": shape, "frequency": 1.03 * frequency[mode] }]);
            again["bodies"]["upper"]["modes"] = json!({ "measured": measured });
            let folder = Folder::with(again.to_string());
            let ran = folder.call(ranks, "run", &[]);
            ran.good();
            let mac = ran.out.split("MAC ").nth(1).and_then(|text| text.get(..5)).and_then(|t| t.parse().ok());
            let mac: f64 = mac.unwrap_or_else(|| panic!("no MAC: {}", ran.out));
            assert!(mac > 0.99 && ran.out.contains("measured on upper"), "{mac}");
            // One mode or a pair has the measured frequency.
            let now = numbers(&folder, "modes/upper/frequency");
            let mut expected = frequency.clone();
            let alike = |k: &usize| (frequency[*k] / frequency[mode] - 1.0).abs() < 1e-3;
            let pair: Vec<usize> = (0..frequency.len()).filter(alike).collect();
            // The mean of a pair has it: those of a mesh are a little apart.
            let mean = pair.iter().map(|&k| frequency[k]).sum::<f64>() / pair.len() as f64;
            pair.iter().for_each(|&k| expected[k] *= 1.03 * frequency[mode] / mean);
            assert!(now.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= 1e-6 * b), "{now:?} {expected:?}");
            moved += pair.len();
            found.push(mac);
        }
        assert!(moved >= 5, "{found:?}");
        let shape = measured_shape(&plain, 2, own);
        for (own, part) in [([0.0, 0.0, 3.0], "beside the"), ([0.0, 0.0, 0.0], "found no computed mode like it")] {
            let mut wrong = shape.clone();
            if own[2] > 0.0 {
                wrong["points"][0] = json!(own);
            } else {
                // Axial motion the other way, as in a left-handed frame.
                for motion in wrong["motion"].as_array_mut().expect("motions") {
                    let [x, y, z] = [0, 1, 2].map(|c| motion[c].clone());
                    *motion = json!([y, z, x]);
                }
            }
            let mut again = job.clone();
            again["bodies"]["upper"]["modes"] = json!({ "measured": [{ "shape": wrong, "frequency": frequency[2] }] });
            let folder = Folder::with(again.to_string());
            folder.call(ranks, "run", &[]).failed(2, &[part, "modes.measured"]);
        }
    }
}
