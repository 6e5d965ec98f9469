//! The transient as a run: growth as stability says, and bad input.

use super::program::*;
use serde_json::{json, Value};

/// Lateral sliding off the mid-planes, on a coarse mesh. What the tests rest on and a job may leave out is named here.
pub fn sliding(mut transient: Value) -> Value {
    let named = json!({
        "step": 1e-5, "theta": 0.5, "solver": "newton", "tolerance": 1e-10, "hold": "approach",
        "contact_stride": 100, "modal_stride": 20, "body_stride": 0, "segment": 1000
    });
    for (key, value) in named.as_object().expect("keys") {
        transient.as_object_mut().expect("keys").entry(key).or_insert(value.clone());
    }
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.002);
    }
    job["contact"]["patch"] = json!({ "half_length": 0.01, "half_width": 0.01 });
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    let stability = json!({ "direction": "actual" });
    job["analyses"] = json!({ "modes": { "count": 20 }, "stability": stability, "transient": transient });
    job["output"] = json!({ "fields": false });
    job
}

pub fn open(path: impl AsRef<std::path::Path>) -> hdf5::File {
    hdf5::File::open(path).expect("result file")
}

pub fn read<T: hdf5::H5Type>(file: &hdf5::File, name: &str) -> Vec<T> {
    file.dataset(name).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Growth rate and frequency of rows of modal amplitudes dominated by one oscillation, `interval` apart.
pub fn growth(rows: &[Vec<f64>], interval: f64, about: f64) -> (f64, f64) {
    // Differences take the state of rest away; then x_{j+1} = a x_j − b x_{j−1}, a = 2 r cos ωT, b = r².
    let x: Vec<Vec<f64>> = rows.windows(2).map(|w| w[1].iter().zip(&w[0]).map(|(a, b)| a - b).collect()).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut s = [0.0; 5];
    for w in x.windows(3) {
        let terms = [dot(&w[1], &w[1]), dot(&w[1], &w[0]), dot(&w[0], &w[0]), dot(&w[1], &w[2]), dot(&w[0], &w[2])];
        s.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
    }
    let det = s[0] * s[2] - s[1] * s[1];
    let (a, b) = ((s[3] * s[2] - s[4] * s[1]) / det, (s[3] * s[1] - s[4] * s[0]) / det);
    let turn = (a / (2.0 * b.sqrt())).acos() / (2.0 * std::f64::consts::PI);
    let whole = (about * interval).round();
    let candidates = [(whole + turn) / interval, (whole - turn) / interval];
    let frequency =
        if (candidates[0] - about).abs() < (candidates[1] - about).abs() { candidates[0] } else { candidates[1] };
    (0.5 * b.ln() / interval, frequency)
}

#[test]
fn an_unstable_mode_grows_as_stability_says_and_decays_for_the_other_creepage() {
    let transient = json!({
        "duration": 0.25,
        "start": { "mode": 1, "amplitude": 1e-7 },
        "contact_stride": 1000,
        "points": [{ "name": "rim", "body": "upper", "at": [0.5, -0.02, 0.5] }]
    });
    let folder = Folder::with(sliding(transient).to_string());
    for (creepage, sign) in [("0.01", 1.0), ("-0.01", -1.0)] {
        let output = folder.text("run.h5");
        let set = format!("contact.creepage.lateral={creepage}");
        let ran = folder.call(1, "run", &["--set", &set, "--output", &output, "--force"]);
        assert!(ran.good().out.contains("transient: 0.25 s"), "{}", ran.out);
        let file = open(&output);
        let linear: Vec<num_complex::Complex64> = read(&file, "stability/eigenvalue");
        let wanted = linear.iter().find(|l| l.im > 100.0).expect("an oscillation");
        assert!(wanted.re * sign > 0.0, "growth rate {} at creepage {creepage}", wanted.re);
        let shape = file.dataset("transient/modal_displacement").expect("amplitudes").shape();
        let q: Vec<f64> = read(&file, "transient/modal_displacement");
        // The start is at rest in the steady analysis's state; what that leaves has to die away first.
        let rows: Vec<Vec<f64>> = q.chunks_exact(shape[1]).skip(shape[0] / 5).map(<[f64]>::to_vec).collect();
        let (sigma, frequency) = growth(&rows, 20e-5, wanted.im / (2.0 * std::f64::consts::PI));
        let linear_frequency = wanted.im / (2.0 * std::f64::consts::PI);
        assert!(
            (sigma - wanted.re).abs() < 0.2f64.max(0.02 * wanted.re.abs()),
            "creepage {creepage}: growth {sigma}, linear {}",
            wanted.re
        );
        assert!((frequency / linear_frequency - 1.0).abs() < 1e-3, "frequency {frequency}, linear {linear_frequency}");
        let (balance, friction): (Vec<f64>, Vec<f64>) =
            (read(&file, "transient/balance"), read(&file, "transient/friction_loss"));
        assert!(balance.last().unwrap().abs() < 1e-6 * friction.last().unwrap(), "{:?}", balance.last());
        assert!(!folder.listing().iter().any(|name| name == "run.transient"), "{:?}", folder.listing());
    }
}

#[test]
fn ranks_do_not_matter_and_steady_state_stays() {
    let transient = json!({ "duration": 0.01, "start": { "state": "steady" }, "hold": "load", "body_stride": 500 });
    let mut job = sliding(transient);
    job["contact"]["creepage"] = json!({ "lateral": 0.003 });
    job["analyses"].as_object_mut().expect("analyses").remove("stability");
    let folder = Folder::with(job.to_string());
    let mut forces = Vec::new();
    for ranks in [1, 2] {
        let output = folder.text(&format!("{ranks}.h5"));
        folder.call(ranks, "run", &["--output", &output]).good();
        let force: Vec<f64> = read(&open(&output), "transient/force");
        forces.push(force);
        let moved = open(folder.path(&format!("{ranks}.transient.vtkhdf")));
        assert_eq!(moved.dataset("VTKHDF/Steps/Values").expect("times").shape(), [2]);
    }
    let limit = 0.3 * 70e3;
    let differ = forces[0].iter().zip(&forces[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / limit;
    assert!(differ < 1e-6, "forces on 1 and 2 ranks differ by {differ:e} μN");
    let drift = (forces[0][1] - forces[0][forces[0].len() - 2]).abs() / limit;
    // Without any step in the operator it would be nothing; Vh over the length of the contact is 0.01.
    assert!(drift < 1e-3, "the lateral force leaves the steady one by {drift} μN");
}

/// Node of the body of a point (1 lower, 2 upper) at its place, among the points of a file of fields.
fn node_of(fields: &hdf5::File, body: i8, at: &[f64]) -> usize {
    let (nodes, bodies): (Vec<f64>, Vec<i8>) = (read(fields, "VTKHDF/Points"), read(fields, "VTKHDF/PointData/body"));
    let near = |i: &usize| bodies[*i] == body && (0..3).all(|c| (nodes[3 * i + c] - at[c]).abs() < 1e-9);
    (0..bodies.len()).find(near).expect("the node of a point")
}

/// At rest points and bodies stand where the finite elements have them, however few modes are kept; in motion they
/// depend on them little, the velocity is the rate of the displacement, and the number of ranks does not matter.
#[test]
fn points_move_as_the_whole_body_does() {
    let points: Vec<Value> = [("lower", -1.0), ("upper", 1.0)]
        .into_iter()
        .flat_map(|(body, up)| {
            [("contact", [0.0, 0.0, 0.0]), ("rim", [0.5, -0.02, up * 0.5]), ("web", [0.0, 0.0, up * 0.15])]
                .map(|(name, at)| json!({ "name": format!("{body} {name}"), "body": body, "at": at }))
        })
        .collect();
    let transient = json!({
        "duration": 1e-3,
        "start": { "state": "steady" },
        "histories": { "lateral": [[0, 0.003], [1e-3, 0.006]] },
        "modal_stride": 0,
        "body_stride": 5,
        "segment": 30,
        "points": points
    });
    let mut job = sliding(transient);
    for body in ["lower", "upper"] {
        job["bodies"][body]["mesh"]["cylinder"]["element_size"] = json!(0.003);
        job["bodies"][body]["mesh"]["cylinder"]["max_element_size"] = json!(0.08);
    }
    // All components of the traction, on bodies that differ.
    job["contact"]["creepage"] = json!({ "lateral": 0.003, "longitudinal": 0.001 });
    job["analyses"].as_object_mut().expect("analyses").remove("stability");
    // As near to rest as the start is.
    job["analyses"]["steady"] = json!({ "tolerance": 1e-10 });
    job["output"] = json!({ "fields": true });
    let folder = Folder::with(job.to_string());
    let run = |name: &str, ranks: usize, sets: &[&str]| {
        let output = folder.text(name);
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        folder.call(ranks, "run", &[&sets[..], &["--output", &output]].concat()).good();
        open(&output)
    };
    let few = "analyses.modes.count=4";

    // So short a time that nothing moves.
    let rest = ["analyses.transient.duration=1e-8", "analyses.transient.step=1e-8", "analyses.transient.body_stride=1"];
    for modes in [few, "analyses.modes.count=20"] {
        let file = run(&format!("rest of {modes}.h5"), 1, &[&rest[..], &[modes]].concat());
        let at: Vec<f64> = read(&file, "transient/points/position");
        let whole: Vec<f64> = read(&file, "VTKHDF/PointData/displacement");
        let found: Vec<f64> = read(&file, "transient/point_displacement");
        let velocity: Vec<f64> = read(&file, "transient/point_velocity");
        for (k, point) in points.iter().enumerate() {
            let own = if point["body"] == "lower" { 1 } else { 2 };
            let node = node_of(&file, own, &at[3 * k..3 * k + 3]);
            let (u, wanted) = (&found[3 * k..3 * k + 3], &whole[3 * node..3 * node + 3]);
            let (mut error, mut size) = (0.0f64, 0.0f64);
            for c in 0..3 {
                error = error.max((u[c] - wanted[c]).abs());
                size = size.max(wanted[c].abs());
            }
            assert!(size > 1e-7 && error < 1e-9 * size, "{modes}: {point} at {u:?} m, by finite elements {wanted:?}");
        }
        assert!(velocity.iter().all(|v| v.abs() < 1e-9), "{velocity:?}");
        // In single precision.
        let moved = open(folder.path(&format!("rest of {modes}.transient.vtkhdf")));
        let (places, bodies): (Vec<f64>, Vec<f64>) =
            (read(&moved, "VTKHDF/Points"), read(&moved, "VTKHDF/PointData/displacement"));
        assert!(places == read::<f64>(&file, "VTKHDF/Points") && bodies.len() == whole.len());
        let size = whole.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let error = whole.iter().zip(&bodies).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 2e-7 * size, "{modes}: bodies at rest are {error:e} of {size:e} m away");
    }

    let moving: Vec<Vec<f64>> = [("few.h5", 1, few), ("ranks.h5", 2, few), ("many.h5", 1, "analyses.modes.count=20")]
        .map(|(name, ranks, modes)| read(&run(name, ranks, &[modes]), "transient/point_displacement"))
        .to_vec();
    let width = 3 * points.len();
    // Largest distance from the first step on, and between two runs, of each point.
    let size = |u: &[f64], from: &dyn Fn(usize) -> f64, k: usize| {
        let of = |(i, v): (usize, &f64)| if i % width / 3 == k { (v - from(i)).abs() } else { 0.0 };
        u.iter().enumerate().map(of).fold(0.0, f64::max)
    };
    for name in ["few", "ranks"] {
        let fields = open(folder.path(&format!("{name}.transient.vtkhdf")));
        let at: Vec<f64> = read(&open(folder.path(&format!("{name}.h5"))), "transient/points/position");
        let bodies: Vec<f64> = read(&fields, "VTKHDF/PointData/displacement");
        let times: Vec<f64> = read(&fields, "VTKHDF/Steps/Values");
        // Of several segments, and more than are worked on together.
        assert_eq!(times.len(), 20, "{times:?}");
        assert!((0..20).all(|k| (times[k] / (5e-5 * (k + 1) as f64) - 1.0).abs() < 1e-9), "{times:?}");
        let count = bodies.len() / times.len();
        for (k, point) in points.iter().enumerate() {
            let node = node_of(&fields, if point["body"] == "lower" { 1 } else { 2 }, &at[3 * k..3 * k + 3]);
            for time in 0..20 {
                let u = &moving[0][width * (5 * time + 4) + 3 * k..][..3];
                let shown = &bodies[time * count + 3 * node..][..3];
                let size = u.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                let error = u.iter().zip(shown).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < 2e-7 * size, "{name}, {point}, time {time}: {u:?}, in the field {shown:?}");
            }
        }
    }
    let rate: Vec<f64> = read(&open(folder.path("few.h5")), "transient/point_velocity");
    for (k, point) in points.iter().enumerate() {
        let u = &moving[0];
        let way = size(u, &|i| u[i % width], k);
        let ranks = size(u, &|i| moving[1][i], k);
        let modes = size(u, &|i| moving[2][i], k);
        let before = |i: usize| if i < width { u[i] } else { u[i - width] };
        let step = size(u, &before, k);
        // The mean of the velocities at both ends, times the step.
        let by_rate = |i: usize| if i < width { u[i] } else { before(i) + 0.5e-5 * (rate[i] + rate[i - width]) };
        let drift = size(u, &by_rate, k);
        assert!(way > 1e-8, "{point} moves by {way:e} m");
        assert!(ranks < 1e-8 * way, "{point}: {ranks:e} of {way:e} m apart on two ranks");
        assert!(modes < 0.1 * way, "{point}: {modes:e} of {way:e} m apart with 4 and 20 modes");
        assert!(drift < 0.02 * step, "{point}: {drift:e} of {step:e} m in a step are not by the velocity");
    }
}

#[test]
fn what_cannot_be_integrated_is_refused() {
    let transient =
        json!({ "duration": 0.01, "points": [{ "name": "rim", "body": "upper", "at": [0.0, -0.02, 0.5] }] });
    let folder = Folder::with(sliding(transient).to_string());
    let no_points = ["--set", "analyses.transient.points=[]"];
    let refused = |sets: &[&str], parts: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        folder.call(1, "run", &[&sets[..], &["--output", &folder.text("x.h5")]].concat()).failed(2, parts);
    };
    refused(
        &["analyses.transient.theta=0.4"],
        &["analyses.transient.theta: found 0.4", "expected a number ≥ 0.5 and ≤ 1"],
    );
    refused(
        &["analyses.transient.theta=1.1"],
        &["analyses.transient.theta: found 1.1", "expected a number ≥ 0.5 and ≤ 1"],
    );
    refused(&["analyses.transient.step=0"], &["analyses.transient.step: found 0", "expected"]);
    refused(&["analyses.transient.duration=1e-6"], &["duration", "at least one step"]);
    refused(
        &[],
        &["analyses.transient.points", "\"rim\" at [0.0, -0.02, 0.5]", "upper body", "nearest node", "m away"],
    );
    refused(
        &[no_points[1], "analyses.transient.step=4e-4"],
        &["analyses.transient.step is 4.0000e-4 s", "highest mode kept", "the limit is", "shorter step or fewer modes"],
    );
    refused(
        &[no_points[1], "analyses.transient.histories.lateral=[[0, 0.01], [0.005, 0.01]]"],
        &[
            "analyses.transient.histories.lateral",
            "from 0 s to 0.005 s",
            "from 0 to 0.01 s",
            "give values for all of it",
        ],
    );
    refused(
        &[no_points[1], "analyses.transient.histories.spin=[[0.001, 0.1], [0.02, 0.1]]"],
        &["analyses.transient.histories.spin", "from 0.001 s to 0.02 s", "give values for all of it"],
    );
    refused(&[no_points[1], "analyses.transient.histories.spin=[]"], &["histories.spin", "no points"]);
    refused(
        &[no_points[1], "analyses.transient.histories.normal_load=[[0, 0], [0.02, 7e4]]"],
        &["histories.normal_load", "begins with 0 N", "above 0"],
    );
    refused(
        &[no_points[1], "analyses.transient.histories.normal_load=[[0, 7e4], [0.02, 7e4], [0.01, 7e4]]"],
        &["histories.normal_load", "from 0.02 s to 0.01 s", "must ascend"],
    );
    refused(&[no_points[1], "analyses.transient.start.mode=1000"], &["start.mode", "eigenvalues"]);
    // Some of it is known when there are modes.
    assert_eq!(folder.listing(), ["job.json", "x.model.h5"]);
}

/// θ = 0.51 takes some percent of the growth at 10 µs, θ = 0.5 nothing, θ = 0.501 less than 2 %: the damping (θ − ½)
/// ω²h.
#[test]
fn damping_by_the_scheme_is_warned_of_above_two_percent() {
    let transient = json!({ "duration": 1e-4, "start": { "mode": 1 } });
    let folder = Folder::with(sliding(transient).to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    let file = open(&model);
    let linear: Vec<num_complex::Complex64> = read(&file, "stability/eigenvalue");
    let unstable: Vec<_> = linear.iter().filter(|l| l.re > 0.0 && l.im > 0.0).collect();
    assert!(!unstable.is_empty());
    for theta in [0.5, 0.501, 0.51] {
        let set = format!("analyses.transient.theta={theta}");
        let ran =
            folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("x.h5"), "--force", "--set", &set]);
        ran.good();
        let share = |l: &num_complex::Complex64| (theta - 0.5) * l.im * l.im * 1e-5 / l.re;
        let warned: Vec<&str> = ran.err.lines().filter(|l| l.contains("warning: the scheme damps")).collect();
        assert_eq!(warned.len(), unstable.iter().filter(|l| share(l) > 0.02).count(), "{theta}: {warned:?}");
        for l in &unstable {
            let (hertz, percent) = (l.im / (2.0 * std::f64::consts::PI), 100.0 * share(l));
            let name = format!("damping by the scheme, {hertz:.2} Hz");
            let line = ran.out.lines().find(|l| l.contains(&name)).unwrap_or_else(|| panic!("no {name}: {}", ran.out));
            assert!(line.contains(&format!("{percent:.2} % of the growth rate")), "{percent}: {line}");
            let told =
                warned.iter().any(|w| w.contains(&format!("{hertz:.2} Hz")) && w.contains("theta nearer to 0.5"));
            assert_eq!(told, share(l) > 0.02, "{theta}, {hertz} Hz: {warned:?}");
        }
    }
}

/// Tables of constant values say the same as the keys whose place they take, at the start too; a load that is held is
/// there at every step.
#[test]
fn histories_take_the_place_of_keys() {
    let start = json!({ "state": "steady", "random": { "seed": 1, "energy": 1e-3 } });
    let mut job = sliding(json!({ "duration": 1e-3, "start": start, "hold": "load" }));
    job["contact"]["creepage"] = json!({ "longitudinal": 0.001, "lateral": 0.004, "spin": 0.1 });
    job["analyses"].as_object_mut().expect("analyses").remove("stability");
    let folder = Folder::with(job.to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--output", &model]).good();
    let run = |name: &str, sets: &[&str]| -> Vec<Vec<f64>> {
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        let output = folder.text(name);
        folder.call(1, "run", &[&sets[..], &["--reuse", &model, "--output", &output]].concat()).good();
        let file = open(&output);
        ["force", "moment_z", "kinetic", "approach"].map(|n| read(&file, &format!("transient/{n}"))).to_vec()
    };
    let keys = run("keys.h5", &[]);
    let load = keys[0].chunks_exact(3).map(|f| (f[2] / -70e3 - 1.0).abs()).fold(0.0, f64::max);
    assert!(load < 1e-9, "the load that is held differs by {load:e} of itself");
    let energy = keys[2][0];
    assert!(energy > 0.8e-3 && energy < 1.05e-3, "kinetic energy {energy} J after a step");
    let other = ["contact.creepage={\"lateral\": 0.002}", "contact.normal_load=50e3"];
    let table = |value: f64| format!("[[0, {value:e}], [1, {value:e}]]");
    let creep = |rest: String| {
        let [x, y, s] = [0.001, 0.004, 0.1].map(table);
        format!("analyses.transient.histories={{\"longitudinal\": {x}, \"lateral\": {y}, \"spin\": {s}, {rest}}}")
    };
    let tables = run("tables.h5", &[other[0], other[1], &creep(format!("\"normal_load\": {}", table(70e3)))]);
    assert!(keys == tables, "forces {:?} N instead of {:?} N", &tables[0][..6], &keys[0][..6]);

    let held = run("held.h5", &["analyses.transient.hold=approach"]);
    assert!(held[3].iter().all(|a| *a == held[3][0]) && held[0] != keys[0]);
    let tables = run("approach.h5", &[other[0], other[1], &creep(format!("\"approach\": {}", table(held[3][0])))]);
    let differ = tables[0].iter().zip(&held[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(differ < 1e-6 * 70e3, "forces differ by {differ} N");
    // A number that is written and read may change in its last bit.
    let sunk = tables[3][0] / held[3][0] - 1.0;
    assert!(sunk.abs() < 1e-15 && tables[3].iter().all(|a| *a == tables[3][0]), "approach differs by {sunk:e}");
}
