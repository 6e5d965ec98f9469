//! Bodies given by their matrices, through the whole program: Hultén's oscillator in closed form (S. Hultén, *Friction
//! phenomena related to drum brake squeal instabilities*, ASME 1997), and what is refused.

use super::program::*;
use serde_json::{json, Value};
use std::f64::consts::PI;
use std::path::Path;

/// The job and its matrices in a folder of their own.
fn hulten(change: impl FnOnce(&mut Value)) -> Folder {
    let mut job = job("hulten.json");
    change(&mut job);
    let folder = Folder::with(job.to_string());
    std::fs::create_dir(folder.path("hulten")).unwrap();
    for name in ["mass", "damping", "stiffness"] {
        let file = format!("hulten/{name}.mtx");
        std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs").join(&file), folder.path(&file)).unwrap();
    }
    folder
}

/// Largest growth rate and its frequency.
fn leading(folder: &Folder, ranks: usize, friction: f64, args: &[&str]) -> (f64, f64) {
    let set = format!("contact.friction={friction}");
    folder.call(ranks, "run", &[&["--force", "--set", set.as_str()], args].concat()).good();
    let file = hdf5::File::open(folder.path("job.h5")).unwrap();
    let first = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap()[0];
    (first("stability/growth_rate"), first("stability/frequency"))
}

#[track_caller]
fn near(got: f64, want: f64, relative: f64) {
    assert!((got - want).abs() <= relative * want.abs(), "{got:.9}, expected {want:.9} within {relative:.0e}");
}

const UNDAMPED: &[&str] = &["--set", "bodies.lower.matrices.damping=null"];

#[test]
fn hultens_flutter_without_damping() {
    let folder = hulten(|_| ());
    for ranks in [1, 2] {
        let (growth, frequency) = leading(&folder, ranks, 0.4, UNDAMPED);
        near(growth, 72.3586, 1e-6);
        near(frequency, 89.1354, 1e-6);
    }
    // μ_c = (ω1² − ω2²) / 2 ω1 ω2 for these springs; there both frequencies are the root of the mean square.
    let critical = (100.0f64.powi(2) - 75.0f64.powi(2)) / (2.0 * 100.0 * 75.0);
    near(critical, 0.2916667, 1e-6);
    let (above, frequency) = leading(&folder, 1, critical * 1.0001, UNDAMPED);
    near(frequency, ((100.0f64.powi(2) + 75.0f64.powi(2)) / 2.0).sqrt(), 1e-4);
    let (below, _) = leading(&folder, 1, critical * 0.9999, UNDAMPED);
    assert!(above > 1.0 && below.abs() < 1e-3, "growth rates {below} below and {above} above the limit");
}

/// On all degrees of freedom, without reduction, the figures are the same.
#[test]
fn hultens_flutter_on_all_degrees_of_freedom() {
    let folder = hulten(|job| {
        job["analyses"]["stability"]["full"] = json!({ "max_frequency": 1000, "damping_ratio": 0.2 });
    });
    let ran = folder.call(1, "run", UNDAMPED);
    let out = &ran.good().out;
    let file = hdf5::File::open(folder.path("job.h5")).unwrap();
    let read = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
    let (growth, frequency) = (read("stability/growth_rate"), read("stability/frequency"));
    // The one that grows is SLEPc's as well, of both systems.
    let confirms = out.lines().filter(|l| l.contains("SLEPc confirms") && l.contains("1 of 1 unstable pairs"));
    assert_eq!(confirms.count(), 2, "{out}");
    let place = file.dataset("stability/confirmation/place").unwrap().read_raw::<i64>().unwrap();
    assert_eq!(place, [0, 2]);
    let value =
        file.dataset("stability/confirmation/eigenvalue").unwrap().read_raw::<num_complex::Complex64>().unwrap();
    for (value, &place) in value.iter().zip(&place) {
        near(value.re, growth[place as usize], 1e-10);
    }
    let numbers = [read("stability/confirmation/difference"), read("stability/confirmation/backward_error")].concat();
    assert!(numbers.len() == 6 && numbers.iter().all(|v| *v < 1e-12), "{numbers:?}");
    // Two of the reduced model, then two of the full one.
    assert_eq!(growth.len(), 4, "{growth:?}");
    near(growth[2], 72.3586, 1e-6);
    near(frequency[2], 89.1354, 1e-6);
    near(growth[2], growth[0], 1e-10);
    let partner = file.dataset("stability/partner").unwrap().read_raw::<i64>().unwrap();
    assert_eq!(partner, [2, 3, 0, 1]);
    let shares = read("stability/participation");
    near(shares[0], shares[4], 1e-9);
}

#[test]
fn hultens_flutter_with_damping() {
    let folder = hulten(|_| ());
    let (mut low, mut high) = (0.28, 0.30);
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        let (growth, frequency) = leading(&folder, 1, middle, &[]);
        if growth > 0.0 {
            high = middle;
            near(frequency, 86.6025, 2e-2);
        } else {
            low = middle;
        }
    }
    near(high, 0.2893671, 2e-6);
    near(leading(&folder, 1, high, &[]).1, 86.6025, 1e-5);
}

/// One mass m = 2 kg on springs along x and y, without normal motion, slides along x under N = 50 N at v = 0.5 m/s:
/// across the sliding D = μN/v damps, so that λ = −μN/(2 v m) ± i …, while along it nothing does.
#[test]
fn sliding_damps_across_its_direction() {
    let folder = hulten(|job| {
        job["bodies"]["lower"]["matrices"] = json!({
            "mass": "m.mtx", "stiffness": "k.mtx", "contacts": [{ "normal": 0, "tangential": [1, -2] }]
        });
        job["contact"] = json!({
            "friction": 0.4, "points": [{ "direction": [3, 0], "force": 50, "slip_velocity": 0.5 }]
        });
    });
    std::fs::write(folder.path("m.mtx"), "%%MatrixMarket matrix array real general\n2 2\n2\n0\n0\n2\n").unwrap();
    std::fs::write(folder.path("k.mtx"), "%%MatrixMarket matrix array real general\n2 2\n8e4\n0\n0\n9.8e4\n").unwrap();
    folder.call(1, "run", &[]).good();
    let file = hdf5::File::open(folder.path("job.h5")).unwrap();
    let read = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
    let (growth, frequency) = (read("stability/growth_rate"), read("stability/frequency"));
    assert_eq!(growth.len(), 2, "{growth:?}");
    near(frequency[0], 200.0 / (2.0 * PI), 1e-9);
    assert!(growth[0].abs() < 1e-8, "{growth:?}");
    let sigma = -0.4 * 50.0 / (2.0 * 0.5 * 2.0);
    near(growth[1], sigma, 1e-9);
    near(frequency[1], (9.8e4 / 2.0 - sigma * sigma).sqrt() / (2.0 * PI), 1e-9);
}

/// The limits of flutter with and without damping from a sweep, each point as in a run of its own.
#[test]
fn a_sweep_finds_the_limits_of_flutter() {
    let limits = [0.2916667, 0.2893671];
    let friction: Vec<f64> = limits.iter().flat_map(|mu| [mu - 1e-6, mu + 1e-6]).chain([0.4]).collect();
    let keys = json!({ "bodies.lower.matrices.damping_factor": [0, 1], "contact.friction": friction });
    let folder = hulten(|job| {
        // The point of the job itself asks for a mode too many.
        job["analyses"]["modes"]["count"] = json!(3);
        job["analyses"]["sweep"] = json!({ "keys": keys });
        job["analyses"]["sweep"]["keys"]["analyses.modes.count"] = json!([2]);
    });
    for ranks in [1, 3] {
        let ran = folder.call(ranks, "run", &["--force"]);
        ran.failed(4, &["the job's own point failed", "analyses.modes.count: 3 modes"]);
        // Below its limit what has no damping neither grows nor decays but for rounding, which is not counted.
        assert!(ran.out.contains("10 points on 1 reduced model, 6 unstable"), "{}", ran.out);
        let file = hdf5::File::open(folder.path("job.h5")).unwrap();
        let read = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
        let (growth, frequency) = (read("sweep/growth_rate"), read("sweep/frequency"));
        // Without damping what does not flutter does not decay either.
        assert!(growth[..2].iter().all(|g| g.abs() < 0.3), "{growth:?}");
        assert!(growth[2].abs() < 1e-3 && growth[3].abs() < 1e-3, "{growth:?}");
        near(growth[4], 72.3586, 1e-6);
        near(frequency[4], 89.1354, 1e-6);
        // With it.
        assert!(growth[7] < 0.0 && growth[8] > 0.0, "{growth:?}");
        near(frequency[8], 86.6025, 1e-5);
        let single = hulten(|_| ());
        let (one, _) = leading(&single, 1, 0.4, &[]);
        near(growth[9], one, 1e-12);
    }
    // Along with the job's own results; damping enters the full system with its factor too.
    let folder = hulten(|job| {
        job["analyses"]["sweep"] = json!({ "keys": { "contact.friction": [0.4], "contact.points.0.force": [0.0] } });
        job["contact"]["points"][0]["slip_velocity"] = json!(1);
        job["bodies"]["lower"]["matrices"]["damping_factor"] = json!(0.5);
        job["analyses"]["stability"] = json!({ "full": { "max_frequency": 200, "damping_ratio": 0.5 } });
    });
    folder.call(2, "run", &[]).good();
    let file = hdf5::File::open(folder.path("job.h5")).unwrap();
    let read = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
    let growth = read("stability/growth_rate");
    assert_eq!(growth.len(), 4, "two of each system: {growth:?}");
    near(growth[2], growth[0], 1e-9);
    near(read("sweep/growth_rate")[0], growth[0], 1e-12);
    let half = hulten(|_| ());
    let (undamped, damped) = (leading(&half, 1, 0.4, UNDAMPED).0, leading(&half, 1, 0.4, &[]).0);
    assert!(growth[0] < undamped && growth[0] > damped, "{undamped} {} {damped}", growth[0]);
}

#[test]
fn faults_are_named() {
    let refused = |change: &dyn Fn(&mut Value), code: i32, parts: &[&str]| {
        hulten(|job| change(job)).call(1, "run", &[]).failed(code, parts);
    };
    let lower = |job: &mut Value| job["bodies"]["lower"].take();
    refused(
        &|job| job["bodies"]["lower"]["matrices"]["contacts"][1]["normal"] = json!(-9),
        2,
        &["bodies.lower.matrices.contacts.1.normal", "found row 9", "rows 1 to 4"],
    );
    refused(
        &|job| job["contact"]["points"] = json!([{ "direction": [1] }]),
        2,
        &["bodies.lower.matrices.contacts: found 2 contacts, expected 1"],
    );
    refused(
        &|job| job["contact"]["points"][0]["direction"] = json!([0, 0]),
        2,
        &["contact.points.0.direction", "not all 0"],
    );
    refused(&|job| job["contact"]["speed"] = json!(10), 2, &["contact.speed: has no meaning"]);
    refused(&|job| job["analyses"]["steady"] = json!({}), 2, &["analyses.steady: needs meshes"]);
    refused(&|job| job["bodies"]["lower"]["fixed"] = json!(["inner"]), 2, &["bodies.lower.fixed: given beside"]);
    refused(
        &|job| job["analyses"]["modes"]["count"] = json!(3),
        2,
        &["analyses.modes.count: 3 modes", "only 2 of finite"],
    );
    refused(
        &|job| {
            let matrices = lower(job);
            job["bodies"] = json!({ "lower": small()["bodies"]["lower"].clone(), "upper": matrices });
        },
        2,
        &["bodies.lower: found a mesh, but the other body is given by matrices"],
    );
    let folder = hulten(|_| ());
    let head = "%%MatrixMarket matrix coordinate real general\n";
    for (text, parts) in [
        (format!("{head}3 3 1\n1 1 1\n"), &["stiffness.mtx", "order 4", "mass.mtx", "order 3"][..]),
        (format!("{head}4 3 1\n1 1 1\n"), &["mass.mtx: line 2", "4 rows and 3 columns"]),
        (format!("{head}4 4 3\n1 1 1\n2 2 1\n1 2 0.1\n"), &["mass.mtx: not symmetric: entries (1, 2) and (2, 1)"]),
        (format!("{head}4 4 3\n1 1 1\n2 2 1\n"), &["mass.mtx: line 4", "truncated"]),
    ] {
        std::fs::write(folder.path("hulten/mass.mtx"), text).unwrap();
        folder.call(2, "run", &[]).failed(3, parts);
    }
    std::fs::remove_file(folder.path("hulten/mass.mtx")).unwrap();
    folder.call(1, "run", &[]).failed(3, &["mass.mtx: cannot read the matrix"]);
    assert!(!folder.listing().contains(&"job.h5".to_string()), "{:?}", folder.listing());
}
