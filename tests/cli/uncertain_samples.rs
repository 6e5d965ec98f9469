//! Samples of `analyses.uncertainty` beside runs of their own, their distributions and dependence, and their growth
//! rates where nothing grows.

use super::program::*;
use super::transient::open;
use super::uncertainty::{numbers, oscillator, swept, uniform, CRITICAL};
use serde_json::json;
use std::f64::consts::PI;

/// Radius of the curve and axle load of a built-in bogie are uncertain: a sample is a run of its own with these values.
#[test]
#[ignore = "long: scripts/validate long"]
fn samples_in_a_curve_are_runs_of_their_own() {
    let keys = ["curve.radius", "vehicle.axle_load"];
    let mut job = job("uncertain-curve.json");
    assert_eq!(job["vehicle"], "metro_bogie");
    job["analyses"]["modes"]["max_frequency"] = json!(600);
    job["output"] = json!({ "fields": false, "swept_modes": false });
    job["analyses"]["uncertainty"] = json!({
        "inputs": [
            { "key": keys[0], "distribution": uniform(200.0, 400.0) },
            { "key": keys[1], "distribution": uniform(90e3, 130e3) }
        ],
        "samples": 4, "method": "latin_hypercube", "indices": false
    });
    let folder = Folder::with(job.to_string());
    folder.call(1, "run", &["--output", &folder.text("all.h5")]).good();
    let all = open(folder.path("all.h5"));
    let [rates, hertz] = ["growth_rate", "frequency"].map(|name| numbers(&all, name));
    let values = keys.map(|key| numbers(&all, &format!("values/{key}")));
    for i in 0..4 {
        let [radius, load] = [0, 1].map(|k| format!("{}={}", keys[k], values[k][i]));
        let output = folder.text("one.h5");
        let with = ["--only", "stability", "--force", "--output", &output, "--set", &radius, "--set", &load];
        let ran = folder.call(1, "run", &with);
        ran.good();
        let one = open(folder.path("one.h5"));
        let first = |name: &str| {
            let read = one.dataset(&format!("stability/{name}")).and_then(|d| d.read_raw::<f64>());
            read.expect("eigenvalues")[0]
        };
        let (rate, f) = (first("growth_rate"), first("frequency"));
        assert!((rates[i] - rate).abs() < 1e-7 * rate.abs().max(1.0), "{i}: {} and {rate} 1/s", rates[i]);
        assert!((hertz[i] / f - 1.0).abs() < 1e-8, "{i}: {} and {f} Hz", hertz[i]);
        // The equilibrium is that of this curve and this bogie, which has its other data by its name.
        let told = |before: &str| -> f64 {
            let after = ran.out.split(before).nth(1).and_then(|rest| rest.split(' ').next());
            after.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{before}: {}", ran.out))
        };
        assert!((told("steady curving: radius ") / values[0][i] - 1.0).abs() < 1e-6, "{}", ran.out);
        assert!((told("axle load ") * 1e3 / values[1][i] - 1.0).abs() < 1e-6, "{}", ran.out);
        assert!(ran.out.contains("wheelbase 2.500000 m"), "{}", ran.out);
    }
    let spread =
        rates.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b)) - rates.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    assert!(spread > 1.0, "{rates:?}");
}

/// The standard normal distribution function.
fn normal(x: f64) -> f64 {
    0.5 * libm::erfc(-x / 2f64.sqrt())
}

/// Ranks of numbers, from 0 on.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    order.iter().enumerate().for_each(|(rank, &i)| ranks[i] = rank as f64);
    ranks
}

/// Spearman's rank correlation.
fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let squares: f64 = ranks(a).iter().zip(ranks(b)).map(|(a, b)| (a - b).powi(2)).sum();
    1.0 - 6.0 * squares / (n * (n * n - 1.0))
}

/// Samples of correlated inputs, one by a table: each has its distribution, each two have the rank correlation of
/// normal variables, and the probabilities are those of both.
#[test]
fn samples_have_their_distributions_and_correlations() {
    let rows = [[0.2, 0.0], [0.27, 0.5], [CRITICAL, 0.7], [0.45, 1.0]];
    let correlation: [[f64; 3]; 3] = [[1.0, 0.6, -0.3], [0.6, 1.0, 0.2], [-0.3, 0.2, 1.0]];
    let keys = ["contact.friction", "contact.points.0.force", "contact.points.1.force"];
    let folder = oscillator(
        json!({
            "inputs": [
                { "key": keys[0], "distribution": { "table": rows } },
                { "key": keys[1], "distribution": { "normal": { "mean": 1.0, "deviation": 0.1 } },
                  "truncate": [0.9, null] },
                { "key": keys[2], "distribution": { "lognormal": { "median": 2.0, "log_deviation": 0.2 } } }
            ],
            "correlation": correlation,
            "samples": 1024
        }),
        false,
    );
    folder.call(1, "run", &["--output", &folder.text("one.h5")]).good();
    let file = open(folder.path("one.h5"));
    let values = keys.map(|key| numbers(&file, &format!("values/{key}")));
    let of_table = |x: f64| {
        let k = (1..rows.len() - 1).find(|&k| x <= rows[k][0]).unwrap_or(rows.len() - 1);
        let [[x0, p0], [x1, p1]] = [rows[k - 1], rows[k]];
        p0 + (p1 - p0) * (x - x0) / (x1 - x0)
    };
    let cut = |x: f64| (normal((x - 1.0) / 0.1) - normal(-1.0)) / (1.0 - normal(-1.0));
    let lognormal = |x: f64| normal((x / 2.0).ln() / 0.2);
    let n = values[0].len();
    for (k, law) in [&of_table as &dyn Fn(f64) -> f64, &cut, &lognormal].into_iter().enumerate() {
        let mut sorted = values[k].clone();
        sorted.sort_by(f64::total_cmp);
        let off = |(i, x): (usize, &f64)| (law(*x) - (i as f64 + 0.5) / n as f64).abs();
        let off = sorted.iter().enumerate().map(off).fold(0.0, f64::max);
        // A net of 64 points in each replicate misses a share by less than one point in the first input; in the others,
        // which are mixed, by less than Kolmogorov's bound (95 %) of independent samples.
        let bound = if k == 0 { 1.0 / 64.0 } else { 1.36 / (n as f64).sqrt() };
        assert!(off < bound, "{}: {off}", keys[k]);
    }
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let (found, want) = (rank_correlation(&values[i], &values[j]), 6.0 / PI * (0.5 * correlation[i][j]).asin());
        assert!((found - want).abs() < 0.01, "{} and {}: {found}, {want}", keys[i], keys[j]);
    }
    // It flutters above the critical friction, with the probability that the table has there.
    let unstable: Vec<i64> = file.dataset("uncertainty/unstable").and_then(|d| d.read_raw()).expect("unstable");
    assert!(values[0].iter().zip(&unstable).all(|(mu, u)| (*mu > CRITICAL) == (*u > 0)));
    let probability = numbers(&file, "probability")[0];
    let [low, high] = numbers(&file, "probability_interval")[..] else { panic!("two ends") };
    assert!((probability - 0.3).abs() < 1.0 / 64.0 && low < 0.3 && 0.3 < high, "{probability}, {low} to {high}");
    // Where a force is above its median it is more likely: P(Z1 > z, Z2 > 0) of two normal variables, with Φ(z) = 0.7.
    let z = 0.5244005127080407;
    let inner = |x: f64| (-0.5 * x * x).exp() / (2.0 * PI).sqrt() * normal(0.6 * x / 0.8);
    let want: f64 = (0..8000).map(|k| inner(z + (f64::from(k) + 0.5) * 1e-3) * 1e-3).sum::<f64>() / 0.5;
    let above: Vec<bool> = values[1].iter().map(|x| cut(*x) > 0.5).collect();
    let both = above.iter().zip(&unstable).filter(|(a, u)| **a && **u > 0).count();
    let found = both as f64 / above.iter().filter(|a| **a).count() as f64;
    assert!((found - want).abs() < 0.02 && want > 0.45, "{found}, {want}");
}

/// Largest growth rate where nothing grows: it is that of whichever mode leads, and so are its quantiles and indices,
/// whether eigenvalues are continued or searched for as a whole at each point.
#[test]
fn growth_rates_where_nothing_grows_are_those_of_the_whole_search() {
    let mut job = swept(json!([]));
    // Modes without nodal diameter are the least stable ones where they have little damping, not at the own point.
    job["bodies"]["upper"]["damping"] = json!({ "modal": { "by_diameter": [0.008, 0.006, 0.003] } });
    job["bodies"]["lower"]["damping"] = json!({ "modal": { "by_diameter": [0.008, 0.006, 0.004] } });
    job["contact"]["friction"] = json!(0.05);
    job["analyses"]["uncertainty"] = json!({
        "inputs": [
            { "key": "contact.friction", "distribution": uniform(0.02, 0.08) },
            { "key": "contact.creepage.lateral", "distribution": uniform(0.008, 0.012) },
            { "key": "bodies.upper.damping.modal.by_diameter.0", "distribution": uniform(0.001, 0.008) }
        ],
        "samples": 64
    });
    let folder = Folder::with(job.to_string());
    let model = folder.text("model.h5");
    folder.call(1, "run", &["--only", "stability", "--output", &model]).good();
    folder.call(1, "run", &["--reuse", &model, "--output", &folder.text("one.h5")]).good();
    let whole = ["--reuse", &model, "--set", "analyses.uncertainty.follow=false", "--output", &folder.text("whole.h5")];
    folder.call(1, "run", &whole).good();
    let [one, whole] = ["one", "whole"].map(|name| open(folder.path(&format!("{name}.h5"))));
    let [a, b] = [&one, &whole].map(|file| numbers(file, "growth_rate"));
    let hertz = numbers(&whole, "frequency");
    let off = a.iter().zip(&b).zip(&hertz).map(|((a, b), f)| (a - b).abs() / (2.0 * PI * f)).fold(0.0, f64::max);
    assert!(off < 1e-9, "{off:.1e}");
    let search: Vec<i32> = one.dataset("uncertainty/search").and_then(|d| d.read_raw()).expect("search");
    assert!(search.iter().filter(|s| [1, 3].contains(*s)).count() > 250 && b.iter().all(|b| *b < 0.0), "{search:?}");
    // Two kinds of modes lead.
    let without = hertz.iter().filter(|f| (**f - 482.0).abs() < 5.0).count();
    assert!((30..290).contains(&without), "{without}");
    for name in ["quantiles", "indices/first", "indices/total", "indices/first_interval", "indices/total_interval"] {
        let [a, b] = [&one, &whole].map(|file| numbers(file, name));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6), "{name}: {a:?} and {b:?}");
    }
}
