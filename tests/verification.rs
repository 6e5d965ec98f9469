//! The program against solutions that are known otherwise: modes of plain and crowned cylinders (Fourier series in
//! the angle, high order in the section), Hertz, and CONTACT's steady rolling. Sizes are moderate; `scripts/validate`
//! goes further.

#[path = "cli/program.rs"]
#[allow(dead_code)] // Shared with the tests of the command line, which use all of it.
mod program;

use program::{job, Folder};
use railsqueal::output::Reader;
use serde_json::{json, Value};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// One run at a time: each is on two ranks already.
static TURN: Mutex<()> = Mutex::new(());

/// Runs a job on two ranks; the result file, and the folder that holds it.
fn run(job: &Value, args: &[&str]) -> (Reader, Folder) {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Folder::with(job.to_string());
    folder.call(2, "run", &[args, &["--set", "output.fields=false"]].concat()).good();
    (Reader::open(&folder.path("job.h5")).expect("result file"), folder)
}

fn numbers(file: &Reader, path: &str) -> Vec<f64> {
    file.numbers(path).unwrap_or_else(|e| panic!("{e}")).1
}

// ---- Modes ----

/// Frequencies (Hz) and numbers of nodal diameters of one support, ascending.
fn reference(support: &str) -> Vec<(f64, usize)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/data/annulus_modes.csv");
    let text = std::fs::read_to_string(path).expect("reference frequencies");
    let rows = text.lines().filter(|l| l.starts_with(support)).map(|l| {
        let cells: Vec<&str> = l.split(',').collect();
        (cells[2].parse().expect("frequency"), cells[3].parse().expect("order"))
    });
    let rows: Vec<(f64, usize)> = rows.collect();
    assert_eq!(rows.len(), 30, "{support}");
    rows
}

/// Relative error of each mode of the annular cylinder, with its number of nodal diameters; rigid-body modes have their
/// frequency (Hz) in place of an error. `size` replaces the job's graded mesh by a uniform one.
fn annulus(support: &str, size: Option<f64>) -> Vec<(f64, usize)> {
    let mut job = job("annulus.json");
    if support == "free" {
        job["bodies"]["lower"]["fixed"] = json!([]);
    }
    if let Some(h) = size {
        let cylinder = &mut job["bodies"]["lower"]["mesh"]["cylinder"];
        cylinder["element_size"] = json!(h);
        cylinder["max_element_size"] = json!(h);
    }
    let (file, _folder) = run(&job, &[]);
    let found = numbers(&file, "modes/lower/frequency");
    assert!(found.len() >= 30, "{} modes", found.len());
    let pairs = found.iter().zip(reference(support));
    pairs.map(|(f, (r, n))| (if r > 0.0 { f / r - 1.0 } else { *f }, n)).collect()
}

#[test]
fn modes_of_the_clamped_annulus() {
    let errors = annulus("clamped", None);
    assert!(errors.iter().all(|(e, _)| e.abs() < 0.005), "relative error, nodal diameters: {errors:?}");
}

#[test]
fn modes_of_the_free_annulus() {
    let errors = annulus("free", None);
    let (rigid, elastic) = errors.split_at(6);
    assert!(rigid.iter().all(|(f, _)| *f == 0.0), "rigid-body modes, Hz: {rigid:?}");
    assert!(elastic.iter().all(|(e, _)| e.abs() < 0.005), "relative error, nodal diameters: {elastic:?}");
}

/// Linear displacements give second order in the frequencies of smooth modes. The free cylinder has them: a clamped
/// bore has a singular stress along its edges, which lowers the order of the modes that strain it.
#[test]
fn frequencies_converge_at_the_order_of_the_element() {
    let [coarse, fine] = [0.05, 0.025].map(|h| annulus("free", Some(h)));
    let mut seen = [false; 6];
    for ((e, n), (f, _)) in coarse.iter().zip(&fine).skip(6) {
        // The first mode of each number of nodal diameters; those above change their order in the list.
        if *n >= seen.len() || std::mem::replace(&mut seen[*n], true) {
            continue;
        }
        let order = (e / f).log2();
        assert!((1.7..2.3).contains(&order), "{n} nodal diameters: errors {e} and {f}, order {order}");
    }
    assert_eq!(seen, [true; 6]);
}

/// Two wheels that differ only by the place of the contact on their crowns: the small distance between their
/// frequencies, on which the growth of squeal depends, is far better than the frequencies themselves, because far
/// from the contacts both have the same mesh.
#[test]
fn the_distance_between_the_frequencies_of_two_wheels() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/data/crowned_modes.csv");
    let text = std::fs::read_to_string(path).expect("reference frequencies");
    let first = |offset: &str, order: usize| -> f64 {
        let row = text.lines().find(|l| l.starts_with(&format!("{offset},{order},"))).expect("a row of the reference");
        row.rsplit(',').next().and_then(|f| f.parse().ok()).expect("a frequency")
    };
    let mut job = job("curve.json");
    job["analyses"] = json!({ "modes": { "count": 6 } });
    for body in ["lower", "upper"] {
        let cylinder = &mut job["bodies"][body]["mesh"]["cylinder"];
        cylinder["element_size"] = json!(0.002);
        cylinder["max_element_size"] = json!(0.05);
    }
    let (file, _folder) = run(&job, &[]);
    let [lower, upper] = ["lower", "upper"].map(|b| numbers(&file, &format!("modes/{b}/frequency")));
    // One nodal diameter (a pair of modes), none, two (a pair).
    for (order, modes) in [(1, 0..2), (0, 2..3), (2, 3..5)] {
        let mean = |f: &[f64]| f[modes.clone()].iter().sum::<f64>() / modes.len() as f64;
        let (f, g) = (mean(&lower), mean(&upper));
        let (f0, g0) = (first("0.03", order), first("0.02", order));
        assert!((f / f0 - 1.0).abs() < 0.01 && (g / g0 - 1.0).abs() < 0.01, "{f} and {g} Hz instead of {f0} and {g0}");
        let (distance, exact) = (f - g, f0 - g0);
        assert!(
            (distance / exact - 1.0).abs() < 0.02,
            "{order} nodal diameters: {distance} Hz apart instead of {exact}"
        );
    }
}

// ---- Steady rolling ----

/// Hertz for N = 70 kN, two steel bodies of R = 0.5 m both ways: radius of the contact (m), pressure (Pa), approach
/// (m).
const HERTZ: (f64, f64, f64) = (4.884e-3, 1401.0e6, 95.43e-6);
/// CONTACT, half-space, N = 70 kN, η = 0.3 %, μ = 0.3, extrapolated to zero grid size: F_y/μN.
const CONTACT: f64 = -0.7177;

#[derive(Clone)]
struct Rolling {
    /// Nodes (m), pressure (Pa), state.
    x: Vec<f64>,
    y: Vec<f64>,
    pressure: Vec<f64>,
    state: Vec<i8>,
    /// On body 1, N.
    force: Vec<f64>,
    approach: f64,
}

/// Runs done: compliance, size, load.
static ROLLING: Mutex<Vec<(String, Rolling)>> = Mutex::new(Vec::new());

/// The two cylinders with elements of `size` (m) in the contact, under `load` (N). Each case runs once.
fn rolling(compliance: &str, size: f64, load: f64) -> Rolling {
    let mut done = ROLLING.lock().unwrap_or_else(PoisonError::into_inner);
    let case = format!("{compliance} {size} {load}");
    if let Some((_, found)) = done.iter().find(|d| d.0 == case) {
        return found.clone();
    }
    let found = roll(compliance, size, load);
    done.push((case, found.clone()));
    found
}

fn roll(compliance: &str, size: f64, load: f64) -> Rolling {
    let mut job = job("two-cylinders.json");
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(size);
    }
    job["contact"]["patch"] = json!({ "half_length": 6.3e-3, "half_width": 6.3e-3 });
    job["contact"]["normal_load"] = json!(load);
    job["contact"]["compliance"] = json!(compliance);
    let (file, _folder) = run(&job, &["--only", "steady"]);
    Rolling {
        x: numbers(&file, "contact/x"),
        y: numbers(&file, "contact/y"),
        pressure: numbers(&file, "contact/pressure"),
        state: match file.read("contact/state").expect("state").1 {
            railsqueal::output::Values::I8(v) => v,
            other => panic!("state: {other:?}"),
        },
        force: numbers(&file, "contact/force"),
        approach: numbers(&file, "contact/approach")[0],
    }
}

impl Rolling {
    /// F_y/μN.
    fn lateral(&self) -> f64 {
        self.force[1] / (0.3 * self.force[2].abs())
    }

    /// (x, state) of the closed nodes on y = 0, in the order of x.
    fn along_the_middle(&self) -> Vec<(f64, i8)> {
        let nodes = (0..self.x.len()).filter(|&i| self.y[i].abs() < 1e-9 && self.state[i] > 0);
        let mut row: Vec<(f64, i8)> = nodes.map(|i| (self.x[i], self.state[i])).collect();
        row.sort_by(|a, b| a.0.total_cmp(&b.0));
        row
    }
}

/// Value at h = 0 of f0 + c h², least squares.
fn extrapolated(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 * p.0 / n, y + p.1 / n));
    let (top, bottom) = points.iter().fold((0.0, 0.0), |(t, b), p| {
        let d = p.0 * p.0 - mx;
        (t + d * (p.1 - my), b + d * d)
    });
    my - top / bottom * mx
}

#[test]
fn lateral_force_of_the_cylinders_is_that_of_contact() {
    lateral_force_beside_contact(&[1.0e-3, 0.7e-3]);
}

/// The same with a finer grid.
#[test]
#[ignore = "long: scripts/validate long"]
fn lateral_force_of_the_cylinders_goes_on_towards_that_of_contact() {
    lateral_force_beside_contact(&[1.0e-3, 0.7e-3, 0.5e-3]);
}

fn lateral_force_beside_contact(sizes: &[f64]) {
    let runs: Vec<Rolling> = sizes.iter().map(|&h| rolling("fe", h, 70e3)).collect();
    let points: Vec<(f64, f64)> = sizes.iter().zip(&runs).map(|(&h, r)| (h, r.lateral())).collect();
    let limit = extrapolated(&points);
    assert!((limit / CONTACT - 1.0).abs() < 0.015, "F_y/μN {points:?}, at h = 0 {limit}; CONTACT {CONTACT}");
    let gaps: Vec<f64> = points.iter().map(|p| (p.1 - CONTACT).abs()).collect();
    assert!(gaps.windows(2).all(|w| w[1] < w[0]), "nearer with each grid: {gaps:?}");

    for (h, r) in sizes.iter().zip(&runs) {
        assert!((r.force[2] / -70e3 - 1.0).abs() < 1e-7, "normal force on body 1: {:?}", r.force);
        // Zero by symmetry about y = 0, which the mesh away from the patch need not have.
        assert!(r.force[0].abs() < 1e-4 * 0.3 * 70e3, "longitudinal force: {:?}", r.force);
        let peak = r.pressure.iter().copied().fold(0.0, f64::max);
        assert!((peak / HERTZ.1 - 1.0).abs() < 0.01, "h {h}: largest pressure {peak:e}, Hertz {:e}", HERTZ.1);
    }

    // Stick begins at the leading edge x = -a, the very edge aside, and ends at x/a = 0.22; then slip.
    let finest = sizes.len() - 1;
    let row = runs[finest].along_the_middle();
    let (a, h) = (HERTZ.0, sizes[finest]);
    assert!((row[0].0 + a).abs() < h && (row[row.len() - 1].0 - a).abs() < h, "contact from -a to a: {row:?}");
    assert_eq!((row[1].1, row[row.len() - 1].1), (1, 2), "leading, trailing: {row:?}");
    let last = row.iter().rposition(|p| p.1 == 1).expect("stick");
    assert!(row[1..=last].iter().all(|p| p.1 == 1), "one zone of stick: {row:?}");
    assert!((row[last].0 - 0.22 * a).abs() < 1.5 * h, "stick ends near {:e}: {row:?}", 0.22 * a);
}

/// Three elements and more from a loaded node, the influence function of one clamped cylinder is that of Boussinesq's
/// half-space and a constant, the compliance of the disc, m/N.
const DISC: f64 = 0.04e-9;

/// On one grid the finite-element bodies differ from half-spaces by a uniform motion of the contact, proportional to
/// the load, which does nothing to a steady state, and by what elements cannot represent within two or three of their
/// lengths from a loaded node. The latter goes away with the grid.
#[test]
fn cylinders_are_half_spaces_near_the_contact() {
    near_half_spaces(&[(1.0e-3, 70e3, 0.015, 0.01), (1.0e-3, 35e3, 0.015, 0.01)]);
}

/// The same with a finer grid, nearer by a factor of about three.
#[test]
#[ignore = "long: scripts/validate long"]
fn cylinders_are_nearer_to_half_spaces_on_a_finer_grid() {
    near_half_spaces(&[(0.5e-3, 70e3, 0.005, 0.004)]);
}

/// Element size, m, load, N, and bounds of the differences of force and of approach.
fn near_half_spaces(cases: &[(f64, f64, f64, f64)]) {
    for &(size, load, of_force, of_approach) in cases {
        let [fe, half] = ["fe", "half_space"].map(|c| rolling(c, size, load));
        let (f, s) = (fe.lateral(), half.lateral());
        assert!((f / s - 1.0).abs() < of_force, "h {size}, {load} N: F_y/μN {f}, half-space {s}");
        let hertz = HERTZ.2 * (load / 70e3).powf(2.0 / 3.0);
        let (fe, half) = (fe.approach - 2.0 * DISC * load, half.approach);
        assert!((half / hertz - 1.0).abs() < 0.003, "h {size}, {load} N: approach {half}, Hertz {hertz}");
        assert!(
            (fe / hertz - 1.0).abs() < of_approach,
            "h {size}, {load} N: approach less the discs {fe}, Hertz {hertz}"
        );
    }
}
