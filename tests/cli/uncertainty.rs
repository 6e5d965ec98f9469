//! Probability of squeal: Hultén's oscillator in closed form, the same samples on any number of ranks and after a stop,
//! failed samples, and what is refused.

use super::interrupted::{signal, start, wait_until};
use super::program::*;
use super::transient::open;
use serde_json::{json, Value};
use std::path::Path;

/// Hultén's oscillator without damping, with its matrices in a folder of its own: it flutters from the friction
/// μ_c = (ω1² − ω2²)/2 ω1 ω2 on.
fn hulten(uncertainty: Value) -> Folder {
    oscillator(uncertainty, false)
}

/// The same with or without its damping.
pub(super) fn oscillator(uncertainty: Value, damped: bool) -> Folder {
    let mut job = job("hulten.json");
    if !damped {
        job["bodies"]["lower"]["matrices"]["damping"] = Value::Null;
    }
    job["analyses"]["uncertainty"] = uncertainty;
    // Forces of the contacts act across the sliding alone, where nothing moves.
    for point in job["contact"]["points"].as_array_mut().expect("points") {
        point["force"] = json!(1.0);
        point["slip_velocity"] = json!(1.0);
    }
    let folder = Folder::with(job.to_string());
    std::fs::create_dir(folder.path("hulten")).expect("folder");
    for name in ["mass", "stiffness", "damping"] {
        let file = format!("hulten/{name}.mtx");
        std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs").join(&file), folder.path(&file))
            .expect("copy");
    }
    folder
}

/// Friction from which on it flutters.
pub(super) const CRITICAL: f64 = (100.0 * 100.0 - 75.0 * 75.0) / (2.0 * 100.0 * 75.0);

pub(super) fn numbers(file: &hdf5::File, name: &str) -> Vec<f64> {
    file.dataset(&format!("uncertainty/{name}")).and_then(|d| d.read_raw()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn texts(file: &hdf5::File, name: &str) -> Vec<String> {
    let read = file.dataset(&format!("uncertainty/{name}")).and_then(|d| d.read_raw::<hdf5::types::VarLenUnicode>());
    read.unwrap_or_else(|e| panic!("{name}: {e}")).iter().map(|t| t.to_string()).collect()
}

/// All numbers of the group, as they are.
fn bits(file: &hdf5::File) -> Vec<(String, Vec<u64>)> {
    let mut all = Vec::new();
    for part in ["", "/modes", "/indices", "/values"] {
        // Without indices there is no group of them.
        let Ok(group) = file.group(&format!("uncertainty{part}")) else { continue };
        for name in group.member_names().expect("names") {
            let Ok(set) = group.dataset(&name) else { continue };
            let Ok(values) = set.read_raw::<f64>() else { continue };
            all.push((format!("{part}/{name}"), values.into_iter().map(f64::to_bits).collect()));
        }
    }
    assert!(all.len() > 20, "{}", all.len());
    all
}

/// The probability of flutter is that of a friction above the critical one; all of the variance is friction, and
/// the quantiles of the growth rate are those of the friction, which it rises with.
#[test]
fn hultens_probability_in_closed_form() {
    let friction = json!({ "uniform": { "from": 0.2, "to": 0.45 } });
    let force = json!({ "normal": { "mean": 1.0, "deviation": 0.1 } });
    let folder = hulten(json!({
        "inputs": [
            { "key": "contact.friction", "distribution": friction },
            { "key": "contact.points.0.force", "distribution": force, "truncate": [0.5, null] }
        ],
        "samples": 256
    }));
    let ran = folder.call(1, "run", &["--output", &folder.text("one.h5")]);
    let file = open(folder.path("one.h5"));
    let want = (0.45 - CRITICAL) / 0.25;
    let probability = numbers(&file, "probability")[0];
    let [low, high] = numbers(&file, "probability_interval")[..] else { panic!("two ends") };
    // A net of 16 points in each of 16 replicates misses the share by less than one point of each.
    assert!((probability - want).abs() < 0.02 && low < want && want < high, "{probability} {low} {high}, {want}");
    assert_eq!(texts(&file, "interval_method"), ["the spread of the replicates"]);
    assert!(high - low < 0.06, "{low} {high}");
    let said = format!("P(squeal) = {probability:.2} +- ");
    assert!(ran.good().out.contains(&said) && ran.out.contains("of the variance of the growth rate is"), "{}", ran.out);
    assert!(ran.out.contains("1024 points on 1 reduced model, 512 random samples, 0 failed"), "{}", ran.out);
    // The mode that flutters at 0.4 is the same one whatever the friction.
    let of_modes = numbers(&file, "modes/probability");
    assert!((of_modes[0] - probability).abs() < 1e-12 && of_modes[1..].iter().all(|p| *p == 0.0), "{of_modes:?}");
    let [first, total] = ["indices/first", "indices/total"].map(|name| numbers(&file, name));
    assert!((first[0] - 1.0).abs() < 0.02 && (total[0] - 1.0).abs() < 0.05, "{first:?} {total:?}");
    assert!(first[1].abs() < 0.02 && total[1].abs() < 1e-6, "{first:?} {total:?}");
    // Growth rates at given frictions: λ² of the oscillator in closed form.
    let (w1, w2) = (2.0 * std::f64::consts::PI * 100.0, 2.0 * std::f64::consts::PI * 75.0);
    let growth = |mu: f64| {
        let (sum, product) = (w1 * w1 + w2 * w2, w1 * w1 * w2 * w2 * (1.0 + mu * mu));
        let inner = 0.25 * sum * sum - product;
        let root = num_complex::Complex64::new(inner, 0.0).sqrt();
        (num_complex::Complex64::new(-0.5 * sum, 0.0) + root).sqrt().re.abs()
    };
    let (frictions, rates) = (numbers(&file, "values/contact.friction"), numbers(&file, "growth_rate"));
    for (mu, rate) in frictions.iter().zip(&rates) {
        assert!((rate - growth(*mu)).abs() < 1e-3, "{mu}: {rate} and {}", growth(*mu));
    }
    let (levels, quantiles) = (numbers(&file, "levels"), numbers(&file, "quantiles"));
    for (p, q) in levels.iter().zip(&quantiles).filter(|(p, _)| **p > 0.5) {
        assert!((q - growth(0.2 + 0.25 * p)).abs() < 1.5, "{p}: {q} and {}", growth(0.2 + 0.25 * p));
    }
    assert!(!folder.path("one.uncertainty").exists());

    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    assert_eq!(bits(&open(folder.path("two.h5"))), bits(&file), "two ranks");
}

/// The damped oscillator with lognormal friction is unstable with the probability that OpenTURNS finds by FORM and by
/// simulation (docs/data/uncertainty_openturns.py).
#[test]
fn hultens_probability_is_that_of_openturns() {
    let known = |quantity: &str| -> f64 {
        let text = include_str!("../../docs/data/uncertainty_openturns.csv");
        let line = text.lines().find(|l| l.starts_with(&format!("hulten,,{quantity},"))).expect("a row");
        line.split(',').next_back().expect("a value").parse().expect("a number")
    };
    let friction = json!({ "lognormal": { "median": 0.27, "log_deviation": 0.08 } });
    let inputs = json!([{ "key": "contact.friction", "distribution": friction }]);
    let folder = oscillator(json!({ "inputs": inputs, "samples": 512, "indices": false }), true);
    folder.call(1, "run", &["--output", &folder.text("one.h5")]).good();
    let file = open(folder.path("one.h5"));
    let probability = numbers(&file, "probability")[0];
    let [low, high] = numbers(&file, "probability_interval")[..] else { panic!("two ends") };
    let (form, simulated, half) = (known("form"), known("simulated"), known("simulated_half_width"));
    assert!(low < form && form < high && high - low < 0.04, "{low} {high}, {form}");
    assert!((probability - form).abs() < 0.01, "{probability} and {form}");
    assert!((probability - simulated).abs() < half + 0.5 * (high - low), "{probability} and {simulated}");
}

/// Lateral sliding on a coarse mesh.
fn sliding() -> Value {
    let mut job = small();
    for (body, offset) in [("lower", 0.03), ("upper", 0.02)] {
        job["bodies"][body]["mesh"]["cylinder"]["contact_offset"] = json!(offset);
        job["bodies"][body]["damping"] = json!({ "alpha": 6.0, "beta": 1e-6 });
    }
    job["contact"]["creepage"] = json!({ "lateral": 0.01 });
    let uniform = |from: f64, to: f64| json!({ "uniform": { "from": from, "to": to } });
    job["analyses"] = json!({
        "modes": { "count": 20 },
        "stability": {},
        "uncertainty": {
            "inputs": [
                { "key": "contact.friction", "distribution": uniform(0.1, 0.5) },
                { "key": "contact.creepage.lateral", "distribution": uniform(0.004, 0.02) },
                { "key": "contact.speed", "distribution": uniform(8.0, 12.0) }
            ],
            "samples": 16,
            "replicates": 4
        }
    });
    job["output"] = json!({ "fields": false });
    job
}

#[test]
fn samples_are_the_same_on_two_ranks_and_after_a_stop() {
    let folder = Folder::with(sliding().to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("one.h5")]).good();
    let whole = open(folder.path("one.h5"));
    assert_eq!(numbers(&whole, "growth_rate").len(), 16 * 5);
    assert!(numbers(&whole, "growth_rate").iter().all(|g| g.is_finite()));
    folder.call(2, "run", &["--reuse", &model, "--output", &folder.text("two.h5")]).good();
    assert_eq!(bits(&open(folder.path("two.h5"))), bits(&whole), "two ranks");

    let output = folder.text("stopped.h5");
    let (job, kept) = (folder.text("job.json"), folder.path("stopped.uncertainty/points"));
    let size = || std::fs::metadata(&kept).map_or(0, |m| m.len());
    let mut child = start(std::process::Command::new(PROGRAM), &["run", &job, "--reuse", &model, "--output", &output]);
    wait_until("a first block", &mut child, || size() > 0);
    signal("TERM", child.id());
    assert_eq!(child.wait().expect("end").code(), Some(5));
    let there = size();
    assert!(there > 0 && !folder.path("stopped.h5").exists());
    // What was torn is computed again.
    let file = std::fs::OpenOptions::new().write(true).open(&kept).expect("open");
    file.set_len(there - 5).expect("cut");
    let again = folder.call(2, "run", &["--reuse", &model, "--output", &output]);
    assert_eq!(bits(&open(folder.path("stopped.h5"))), bits(&whole), "after a stop: {}", again.good().err);
    assert!(!folder.path("stopped.uncertainty").exists());
}

pub(super) fn uniform(from: f64, to: f64) -> Value {
    json!({ "uniform": { "from": from, "to": to } })
}

/// Swept wheels with 110 modes each and samples of these inputs.
pub(super) fn swept(inputs: Value) -> Value {
    let mut job = job("swept-curve.json");
    job["contact"]["patch"]["spacing"] = json!(0.0014);
    job["analyses"]["modes"]["count"] = json!(110);
    job["analyses"]["uncertainty"] =
        json!({ "inputs": inputs, "samples": 144, "method": "latin_hypercube", "indices": false });
    job
}

/// From stick to slip modes change too much for the base points. Samples that go astray there begin from some of them:
/// to the eigenvalues of the dense pencil, the same on two ranks and after a stop.
#[test]
#[ignore = "long: scripts/validate long"]
fn samples_that_go_astray_begin_from_some_of_them() {
    let folder = Folder::with(
        swept(json!([
            { "key": "contact.friction", "distribution": uniform(0.2, 0.5) },
            { "key": "contact.creepage.lateral", "distribution": uniform(0.0005, 0.008) },
            { "key": "contact.normal_load", "distribution": uniform(60e3, 80e3) }
        ]))
        .to_string(),
    );
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    let ran = folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("one.h5")]);
    assert!(ran.good().out.contains("points were continued from some of these"), "{}", ran.out);
    let one = open(folder.path("one.h5"));
    let search: Vec<i32> = one.dataset("uncertainty/search").and_then(|d| d.read_raw()).expect("search");
    assert!(search.iter().filter(|s| **s == 5).count() > 10, "{search:?}");
    // With all eigenvalues, whatever their damping, the search is that of the dense pencil.
    let dense = ["--set", "analyses.uncertainty.follow=false", "--set", "analyses.stability.damping_ratio=1"];
    folder.call(1, "run", &[&["--reuse", &model, "--output", &folder.text("whole.h5")], &dense[..]].concat()).good();
    let whole = open(folder.path("whole.h5"));
    let [a, b] = [&one, &whole].map(|file| numbers(file, "growth_rate"));
    let mut growing = 0;
    for ((a, b), f) in a.iter().zip(&b).zip(numbers(&whole, "frequency")) {
        // Where nothing grows the least stable one may be a mode that is not tracked.
        let bound = 1e-9 * 2.0 * std::f64::consts::PI * f;
        assert!(*a <= b + bound && (*b < 0.0 || (a - b).abs() <= bound), "{a} and {b} at {f} Hz");
        growing += usize::from(*b > 0.0);
    }
    assert!((10..135).contains(&growing), "{growing} grow");
    folder.call(2, "run", &["--reuse", &model, "--output", &folder.text("two.h5")]).good();
    assert_eq!(bits(&open(folder.path("two.h5"))), bits(&one), "on two ranks");
    let output = folder.text("stopped.h5");
    let (job, kept) = (folder.text("job.json"), folder.path("stopped.uncertainty/points"));
    let mut child = start(std::process::Command::new(PROGRAM), &["run", &job, "--reuse", &model, "--output", &output]);
    wait_until("a first block", &mut child, || std::fs::metadata(&kept).is_ok_and(|m| m.len() > 0));
    signal("TERM", child.id());
    assert_eq!(child.wait().expect("end").code(), Some(5));
    folder.call(1, "run", &["--reuse", &model, "--output", &output]).good();
    assert_eq!(bits(&open(folder.path("stopped.h5"))), bits(&one), "after a stop");
}

/// Eigenvalues of samples that are continued from base points are those of the whole search by the small determinant
/// and those of the dense pencil, on any number of ranks.
#[test]
fn continued_samples_are_those_of_the_whole_search_and_of_the_dense_pencil() {
    let folder = Folder::with(
        swept(json!([
            { "key": "contact.friction", "distribution": uniform(0.2, 0.4) },
            { "key": "contact.creepage.lateral", "distribution": uniform(0.008, 0.012) },
            { "key": "contact.normal_load", "distribution": uniform(60e3, 80e3) },
            { "key": "bodies.upper.damping.alpha", "distribution": uniform(0.8, 1.2) }
        ]))
        .to_string(),
    );
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    let ran = folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("one.h5")]);
    let one = open(folder.path("one.h5"));
    let search: Vec<i32> = one.dataset("uncertainty/search").and_then(|d| d.read_raw()).expect("search");
    let by = |way: i32| search.iter().filter(|s| **s == way).count();
    let [counted, uncounted] = [1, 3].map(by);
    let continued = counted + uncounted;
    assert!(continued > 130 && counted > 5 && uncounted > 60, "{search:?}");
    assert!(ran.good().out.contains(&format!("{continued} points continued from 4 base points")), "{}", ran.out);
    let counts = format!("unstable eigenvalues counted at {counted} of these points, none was missing");
    assert!(ran.out.contains(&counts) && ran.out.contains("may become unstable"), "{}", ran.out);
    let of_modes = |file: &hdf5::File| ["growth_rate", "frequency"].map(|name| numbers(file, &format!("modes/{name}")));
    // All eigenvalues, whatever their damping, are those of the dense pencil at every point.
    for (name, ratio) in [("whole", "0.3"), ("dense", "1")] {
        let (output, ratio) = (folder.text(&format!("{name}.h5")), format!("analyses.stability.damping_ratio={ratio}"));
        let set = ["--set", "analyses.uncertainty.follow=false", "--set", &ratio];
        folder.call(1, "run", &[&["--reuse", &model, "--output", &output], &set[..]].concat()).good();
        let whole = open(folder.path(&format!("{name}.h5")));
        let [rates, hertz] = ["growth_rate", "frequency"].map(|part| {
            let read = whole.dataset(&format!("stability/{part}")).and_then(|d| d.read_raw::<f64>());
            read.expect("eigenvalues")
        });
        let relaxes = |(rate, f): (&f64, &f64)| -rate > 0.8 * rate.hypot(2.0 * std::f64::consts::PI * f);
        assert_eq!(rates.iter().zip(&hertz).any(relaxes), name == "dense");
        let [a, b] = [&one, &whole].map(|file| numbers(file, "growth_rate"));
        for ((a, b), f) in a.iter().zip(&b).zip(numbers(&whole, "frequency")) {
            assert!((a - b).abs() <= 1e-9 * 2.0 * std::f64::consts::PI * f, "{name}: {a} and {b} at {f} Hz");
        }
        let ([a, fa], [b, fb]) = (of_modes(&one), of_modes(&whole));
        assert!(!b.is_empty() && a.len() == b.len());
        for k in 0..a.len() {
            let near =
                |x: f64, y: f64| (x - y).abs() <= 1e-9 * 2.0 * std::f64::consts::PI * fb[k] || x.is_nan() && y.is_nan();
            assert!(
                near(a[k], b[k]) && near(fa[k], fb[k]),
                "{name}, {k}: {} and {}, {} and {} Hz",
                a[k],
                b[k],
                fa[k],
                fb[k]
            );
        }
    }
    folder.call(2, "run", &["--reuse", &model, "--output", &folder.text("two.h5")]).good();
    assert_eq!(bits(&open(folder.path("two.h5"))), bits(&one), "two ranks");
}

/// Samples at places of a wheel on its rail that are interpolated.
fn at_places() -> (Value, [&'static str; 4]) {
    let mut job = job("uncertain-squeal.json");
    let uniform = |from: f64, to: f64| json!({ "uniform": { "from": from, "to": to } });
    let keys = ["contact.friction", "contact.placement.lateral", "contact.placement.yaw", "contact.normal_load"];
    let laws = [uniform(0.25, 0.4), uniform(-0.008, -0.004), uniform(-0.013, -0.008), uniform(55e3, 65e3)];
    let inputs: Vec<Value> =
        keys.iter().zip(laws).map(|(key, law)| json!({ "key": key, "distribution": law })).collect();
    job["analyses"]["uncertainty"] =
        json!({ "inputs": inputs, "samples": 96, "method": "latin_hypercube", "indices": false });
    (job, keys)
}

/// Interpolated bodies with few modes, whose eigenvalues are those of a dense pencil: samples are alike on one rank and
/// two, and the same to the last bit after a stop.
#[test]
#[ignore = "long: scripts/validate long"]
fn interpolated_places_go_on_after_a_stop() {
    let (mut job, _) = at_places();
    job["analyses"]["modes"]["max_frequency"] = json!(800);
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("one.h5")]);
    assert!(ran.good().out.contains("96 points on 1 reduced model,"), "{}", ran.out);
    let one = open(folder.path("one.h5"));
    folder.call(2, "run", &["--output", &folder.text("two.h5")]).good();
    // Ranks add up the compliance of the bodies in another order.
    let [rates, two] = [&one, &open(folder.path("two.h5"))].map(|file| numbers(file, "growth_rate"));
    assert!(rates.iter().zip(&two).all(|(a, b)| (a - b).abs() <= 1e-8 * a.abs().max(1.0)), "{rates:?} and {two:?}");

    let output = folder.text("stopped.h5");
    let (job, kept) = (folder.text("job.json"), folder.path("stopped.uncertainty/points"));
    let mut child = start(std::process::Command::new(PROGRAM), &["run", &job, "--output", &output]);
    wait_until("a first block", &mut child, || std::fs::metadata(&kept).is_ok_and(|m| m.len() > 0));
    signal("TERM", child.id());
    assert_eq!(child.wait().expect("end").code(), Some(5));
    folder.call(1, "run", &["--output", &output]).good();
    assert_eq!(bits(&open(folder.path("stopped.h5"))), bits(&one), "after a stop");
}

/// Bodies are interpolated over a part of their profiles: the run itself compares them with those computed.
#[test]
#[ignore = "long: scripts/validate long"]
fn bodies_are_interpolated_over_their_profiles() {
    let (mut job, _) = at_places();
    let inputs = &mut job["analyses"]["uncertainty"]["inputs"];
    inputs[1]["distribution"] = uniform(-0.0065, -0.0055);
    inputs[2]["distribution"] = uniform(-0.0105, -0.0095);
    job["analyses"]["modes"]["max_frequency"] = json!(1200);
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    assert!(ran.good().out.contains("growth rates at 8 computed places differ by up to"), "{}", ran.out);
    let found = open(folder.path("job.h5"));
    let interpolated: Vec<i32> =
        found.dataset("uncertainty/interpolated").and_then(|d| d.read_raw()).expect("interpolated");
    assert!(interpolated.len() == 96 && interpolated.iter().all(|i| *i == 1));
    assert!(numbers(&found, "interpolation_error")[0] <= 1e-4 && numbers(&found, "mesh_scatter")[0] <= 1e-3);
}

/// Growth rates of samples on bodies that are interpolated over their profiles are those of runs of these places alone.
#[test]
#[ignore = "long: scripts/validate long"]
fn interpolated_places_are_those_computed() {
    let (mut job, mut keys) = at_places();
    // A law that falls, with a memory.
    job["contact"]["friction"] =
        json!({ "exponential": { "static": 0.35, "kinetic": 0.25, "decay_velocity": 0.3, "memory_length": 2e-3 } });
    keys[0] = "contact.friction.exponential.static";
    job["analyses"]["uncertainty"]["inputs"][0]["key"] = json!(keys[0]);
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &["--output", &folder.text("all.h5")]);
    assert!(ran.good().out.contains("growth rates at 8 computed places differ by up to"), "{}", ran.out);
    assert!(ran.out.contains("96 points on 1 reduced model,"), "{}", ran.out);
    let all = open(folder.path("all.h5"));
    let read = |name: &str| -> Vec<i32> { all.dataset(name).and_then(|d| d.read_raw()).expect("numbers") };
    let continued = read("uncertainty/search").iter().filter(|s| **s == 1).count();
    assert!(read("uncertainty/interpolated").iter().all(|i| *i == 1) && continued > 80, "{continued}");
    assert!(numbers(&all, "interpolation_error")[0] <= 1e-4 && numbers(&all, "mesh_scatter")[0] <= 1e-3);
    // Runs of these places alone have meshes of their own, coarser than that of the tables. Their growth rates differ
    // by what the run has found itself at the most, nearly alike at all places, and about the mean by the error asked
    // for.
    let rates = numbers(&all, "growth_rate");
    let mut differences = Vec::new();
    for i in (0..96).step_by(10) {
        let value = |key: &&str| format!("{key}={}", numbers(&all, &format!("values/{key}"))[i]);
        let sets: Vec<String> = keys.iter().map(value).collect();
        let output = folder.text("one.h5");
        let mut with = vec!["--only", "stability", "--force", "--output", &output];
        sets.iter().for_each(|set| with.extend(["--set", set]));
        folder.call(1, "run", &with).good();
        let one = open(folder.path("one.h5"));
        let exact: Vec<f64> = one.dataset("stability/growth_rate").and_then(|d| d.read_raw()).expect("rates");
        differences.push((rates[i] - exact[0]) / exact[0].abs().max(1.0));
    }
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    let scatter = numbers(&all, "mesh_scatter")[0];
    assert!(differences.iter().all(|d| d.abs() <= scatter), "{differences:?}, {scatter}");
    assert!(differences.iter().all(|d| (d - mean).abs() <= 1e-4), "{differences:?}");
}

/// Samples without a state of rest are counted and told, and too many of them end the run with exit code 4.
#[test]
fn failed_samples_are_counted() {
    let mut job = sliding();
    job["analyses"]["stability"] = json!({ "state": "sliding" });
    let creepage = json!({ "uniform": { "from": 0.0, "to": 0.02 } });
    job["analyses"]["uncertainty"] = json!({
        "inputs": [{ "key": "contact.creepage.lateral", "distribution": creepage }],
        "samples": 16, "method": "latin_hypercube", "indices": false
    });
    let folder = Folder::with(job.to_string());
    let ran = folder.call(1, "run", &[]);
    ran.failed(4, &["of 16 samples failed, more than analyses.uncertainty.max_failed = 0.05"]);
    let file = open(folder.path("job.h5"));
    let status: Vec<i32> = file.dataset("uncertainty/status").and_then(|d| d.read_raw()).expect("status");
    let lost = status.iter().filter(|s| **s != 0).count();
    let (creepages, messages) = (numbers(&file, "values/contact.creepage.lateral"), texts(&file, "message"));
    assert!((1..12).contains(&lost), "{status:?}");
    for ((status, message), creepage) in status.iter().zip(&messages).zip(&creepages) {
        assert_eq!(*status != 0, !message.is_empty());
        // Small creepages do not make the whole contact slide.
        assert!(*status == 0 || *creepage < 0.012, "{creepage}: {message}");
    }
    assert_eq!(texts(&file, "interval_method"), ["Wilson's formula"]);
    assert!(ran.out.contains("if all") && ran.out.contains("first failed sample"), "{}", ran.out);
    let set = ["--force", "--set", "analyses.uncertainty.max_failed=1"];
    folder.call(1, "run", &set).good();
}

#[test]
fn what_cannot_be_is_refused() {
    let friction = |law: Value| json!({ "inputs": [{ "key": "contact.friction", "distribution": law }] });
    for (uncertainty, part) in [
        (friction(json!({ "uniform": { "from": 0.5, "to": 0.1 } })), "expected from < to"),
        (friction(json!({ "normal": { "mean": 0.0, "deviation": 0.1 } })), "truncate the distribution"),
        (json!({ "inputs": [] }), "analyses.uncertainty.inputs"),
        (
            json!({ "cycles": { "samples": 48 }, "inputs": friction(uniform(0.1, 0.3))["inputs"] }),
            "cycles.samples: found 48, expected a power of two of each of the 16 replicates, e.g. 64",
        ),
    ] {
        hulten(uncertainty).refused(1, &[], 2, &[part]);
    }
}
