//! The samples of `analyses.uncertainty` as points of a sweep.

use super::model::*;
use super::overrides::check_path;
use super::schema::Checker;
use super::sweep::{points, SweepPlan};
use crate::random::cube::{latin_hypercube, scrambled_sobol};
use crate::random::distribution::{cholesky, correlated, Truncated};
use crate::{Error, Result};
use serde_json::Value;
use std::path::Path;

/// More points than this are a slip of the pen.
const MAX_POINTS: usize = 200_000;

/// Faults of the keys of `analyses.uncertainty` among each other.
pub(super) fn faults(wanted: &Uncertainty) -> Vec<String> {
    let (mut faults, n) = (Vec::new(), wanted.inputs.len());
    if n == 0 {
        faults.push("inputs: the list is empty; name a key with its distribution".into());
    }
    for (i, input) in wanted.inputs.iter().enumerate() {
        let place = format!("inputs.{i} ({})", input.key);
        if let Some(first) = wanted.inputs[..i].iter().position(|other| other.key == input.key) {
            faults.push(format!("{place}: found the key of inputs.{first} again, expected each key once"));
        }
        if let Some(fault) = input.distribution.law().fault() {
            faults.push(format!("{place}.distribution: {fault}"));
        } else if let Err(fault) = input.truncated() {
            faults.push(format!("{place}.truncate: {fault}"));
        }
    }
    if let Some(matrix) = &wanted.correlation {
        let square = matrix.len() == n && matrix.iter().all(|row| row.len() == n);
        let symmetric = || (0..n).all(|i| matrix[i][i] == 1.0 && (0..i).all(|j| matrix[i][j] == matrix[j][i]));
        if !square {
            faults.push(format!("correlation: expected {n} rows of {n} numbers, one for each of the inputs"));
        } else if !symmetric() {
            faults.push("correlation: expected 1 on the diagonal and the same number on both sides of it".into());
        } else if cholesky(matrix).is_none() {
            faults.push(
                "correlation: found a matrix that is not positive definite, which no variables have; expected smaller \
                 correlations"
                    .into(),
            );
        }
        if wanted.indices == Some(true) {
            faults.push(
                "indices: found true beside correlation; Sobol' indices are those of independent inputs: leave out \
                 one of the two"
                    .into(),
            );
        }
    }
    match (wanted.method, wanted.replicates) {
        (SamplingMethod::LatinHypercube, Some(_)) => {
            faults.push("replicates: a Latin hypercube has none; leave it out or take the method \"sobol\"".into());
        }
        (SamplingMethod::Sobol, _) => {
            let (samples, replicates) = (wanted.samples as usize, wanted.replicates());
            if samples % replicates != 0 || !(samples / replicates).is_power_of_two() {
                let power = (samples as f64 / replicates as f64).max(1.0).log2().round() as u32;
                faults.push(format!(
                    "samples: found {samples}, expected {replicates} replicates times a power of two, of which a \
                     Sobol' sequence is even, e.g. {}",
                    replicates << power
                ));
            }
        }
        _ => {}
    }
    if let Some(cycles) = &wanted.cycles {
        let (found, replicates) = (cycles.samples, wanted.replicates() as u32);
        if found > wanted.samples {
            faults.push(format!("cycles.samples: found {found}, expected at most the {} samples", wanted.samples));
        } else if wanted.method == SamplingMethod::Sobol
            && (found % replicates != 0 || !(found / replicates).is_power_of_two())
        {
            faults.push(format!(
                "cycles.samples: found {found}, expected a power of two of each of the {replicates} replicates, e.g. \
                 {}",
                replicates * found.div_ceil(replicates).next_power_of_two()
            ));
        }
    }
    if wanted.samples as usize * wanted.points_per_sample() > MAX_POINTS {
        faults.push(format!(
            "samples: found {} of {} points each, expected at most {MAX_POINTS} points in all",
            wanted.samples,
            wanted.points_per_sample()
        ));
    }
    faults
}

impl UncertainInput {
    fn truncated(&self) -> std::result::Result<Truncated, String> {
        let [low, high] = self.truncate.unwrap_or_default();
        let ends = [low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY)];
        Truncated::new(self.distribution.law(), ends)
    }
}

/// True if a key may be uncertain.
fn may_vary(segments: &[&str]) -> bool {
    matches!(segments, ["bodies" | "contact" | "contacts" | "curve" | "vehicle", _, ..])
}

/// The values of the inputs at all points, `[inputs][points]`: sample after sample, each with the points of the
/// design, first A, then B, then A with one column after the other of B.
fn values(wanted: &Uncertainty) -> std::result::Result<Vec<Vec<f64>>, String> {
    let d = wanted.inputs.len();
    let width = d * wanted.random_per_sample();
    let (samples, replicates) = (wanted.samples as usize, wanted.replicates());
    let cube = match wanted.method {
        SamplingMethod::Sobol => scrambled_sobol(width, samples / replicates, replicates, wanted.seed),
        SamplingMethod::LatinHypercube => latin_hypercube(width, samples, wanted.seed),
    };
    let laws = wanted.inputs.iter().map(UncertainInput::truncated).collect::<std::result::Result<Vec<_>, _>>()?;
    let factor = wanted.correlation.as_deref().and_then(cholesky);
    let mut values = vec![Vec::with_capacity(samples * wanted.points_per_sample()); d];
    let mut add = |unit: &[f64]| {
        let dependent = factor.as_ref().map(|factor| correlated(factor, unit));
        let unit = dependent.as_deref().unwrap_or(unit);
        values.iter_mut().zip(&laws).zip(unit).for_each(|((all, law), u)| all.push(law.quantile(*u)));
    };
    for point in &cube {
        let (a, b) = point.split_at(d);
        add(a);
        if b.is_empty() {
            continue;
        }
        add(b);
        for i in 0..d {
            let mut mixed = a.to_vec();
            mixed[i] = b[i];
            add(&mixed);
        }
    }
    Ok(values)
}

/// The points of `analyses.uncertainty` over the job `base` (as written, overrides applied). `name` names the job in
/// messages.
pub(super) fn plan(
    base: &Value,
    wanted: &Uncertainty,
    name: &str,
    folder: &Path,
    checker: &Checker,
) -> Result<SweepPlan> {
    const PATH: &str = "analyses.uncertainty";
    let fault = |text: String| Error::Job(format!("{name}: {PATH}.{text}"));
    let keys: Vec<String> = wanted.inputs.iter().map(|i| i.key.clone()).collect();
    for (i, key) in keys.iter().enumerate() {
        let segments: Vec<&str> = key.split('.').collect();
        check_path(&segments, &format!("{name}: {PATH}.inputs.{i}.key"), checker)?;
        if !may_vary(&segments) {
            return Err(fault(format!(
                "inputs.{i}.key: found \"{key}\", expected a key of bodies, contact, contacts, curve or vehicle"
            )));
        }
    }
    let number = |v: f64| serde_json::Number::from_f64(v).map(Value::Number);
    let values = values(wanted).map_err(fault)?;
    let values: Option<Vec<Vec<Value>>> = values.iter().map(|all| all.iter().map(|v| number(*v)).collect()).collect();
    let values = values.ok_or_else(|| fault("inputs: a distribution gives numbers that are not finite".into()))?;
    let points = points(base, PATH, (&keys, &values), (name, folder, checker)).map_err(|e| {
        e.with("Every sample has to be a job by itself: truncate the distribution where a value cannot be")
    })?;
    let units = keys.iter().map(|k| checker.unit_at(&k.split('.').collect::<Vec<_>>())).collect();
    Ok(SweepPlan { keys, units, shape: vec![points.len()], values, points })
}

#[cfg(test)]
mod tests {
    use super::super::Job;
    use super::*;

    const WHEEL: &str = include_str!("../../jobs/wheel-at-given-yaw.json");

    fn read(uncertainty: &str) -> Result<Job> {
        let sets = [format!("analyses.uncertainty={uncertainty}")];
        Job::from_bytes(WHEEL.as_bytes(), Path::new("job.json"), &sets, None)
    }

    const FRICTION: &str =
        r#"{"key": "contact.friction", "distribution": {"normal": {"mean": 0.35, "deviation": 0.05}}}"#;
    const LATERAL: &str =
        r#"{"key": "contact.placement.lateral", "distribution": {"uniform": {"from": -0.008, "to": -0.004}}}"#;

    #[test]
    fn points_are_those_of_the_design() {
        let job = read(&format!(r#"{{"inputs": [{FRICTION}, {LATERAL}], "samples": 32}}"#)).unwrap();
        let plan = job.sweep.as_ref().unwrap();
        assert_eq!((plan.points.len(), plan.shape.as_slice()), (128, &[128][..]));
        let at = |key: usize, point: usize| plan.values[key][point].as_f64().unwrap();
        for s in (0..128).step_by(4) {
            assert!(at(0, s) != at(0, s + 1) && at(1, s) != at(1, s + 1));
            assert_eq!([at(0, s + 2), at(1, s + 2)], [at(0, s + 1), at(1, s)]);
            assert_eq!([at(0, s + 3), at(1, s + 3)], [at(0, s), at(1, s + 1)]);
        }
        assert_eq!(plan.points[5].placement().map(|p| p.lateral), Some(at(1, 5)));
        // Each half of a distribution has half of the samples.
        let low = (0..128).step_by(4).filter(|&s| at(0, s) < 0.35).count();
        assert_eq!(low, 16);
        assert_eq!(job.analyses.names().last(), Some(&"uncertainty"));
        let other = read(&format!(r#"{{"inputs": [{FRICTION}, {LATERAL}], "samples": 32, "seed": 2}}"#)).unwrap();
        assert!(other.sweep.unwrap().values != plan.values);
    }

    #[test]
    fn correlated_inputs_have_no_indices() {
        let text = format!(
            r#"{{"inputs": [{FRICTION}, {LATERAL}], "samples": 64, "method": "latin_hypercube",
                "correlation": [[1, 0.9], [0.9, 1]]}}"#
        );
        let job = read(&text).unwrap();
        let plan = job.sweep.unwrap();
        assert_eq!(plan.points.len(), 64);
        let number = |k: usize| plan.values[k].iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
        let (x, y) = (number(0), number(1));
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let (mx, my) = (mean(&x), mean(&y));
        let of =
            |a: &[f64], ma: f64, b: &[f64], mb: f64| a.iter().zip(b).map(|(a, b)| (a - ma) * (b - mb)).sum::<f64>();
        let correlation = of(&x, mx, &y, my) / (of(&x, mx, &x, mx) * of(&y, my, &y, my)).sqrt();
        assert!((0.8..0.95).contains(&correlation), "{correlation}");
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let job = |more: &str| format!(r#"{{"inputs": [{FRICTION}, {LATERAL}]{more}}}"#);
        let one = |input: &str| format!(r#"{{"inputs": [{input}], "samples": 16}}"#);
        let of = |key: &str, law: &str| one(&format!(r#"{{"key": "{key}", "distribution": {law}}}"#));
        for (text, want) in [
            (job(r#", "samples": 500"#), "samples: found 500, expected 16 replicates times a power of two"),
            (job(r#", "samples": 500"#), "e.g. 512"),
            (job(r#", "method": "latin_hypercube", "replicates": 4"#), "replicates: a Latin hypercube has none"),
            (job(r#", "correlation": [[1, 0.5]]"#), "expected 2 rows of 2 numbers"),
            (job(r#", "correlation": [[1, 0.5], [0.4, 1]]"#), "expected 1 on the diagonal"),
            (job(r#", "correlation": [[1, 1.5], [1.5, 1]]"#), "not positive definite"),
            (job(r#", "correlation": [[1, 0.5], [0.5, 1]], "indices": true"#), "leave out one of the two"),
            (format!(r#"{{"inputs": [{FRICTION}, {FRICTION}]}}"#), "the key of inputs.0 again"),
            (of("contact.frction", r#"{"uniform": {"from": 0.1, "to": 0.2}}"#), "contact.frction"),
            (
                of("analyses.stability.max_frequency", r#"{"uniform": {"from": 1, "to": 2}}"#),
                "expected a key of bodies",
            ),
            (of("contact.friction", r#"{"uniform": {"from": 0.3, "to": 0.2}}"#), "expected from < to"),
            (of("contact.friction", r#"{"table": [[0.1, 0], [0.2, 0.9]]}"#), "rising from 0 to 1"),
            (of("contact.friction", r#"{"normal": {"mean": 0.02, "deviation": 0.2}}"#), "truncate the distribution"),
            (of("contact.compliance", r#"{"uniform": {"from": 0.1, "to": 0.2}}"#), "contact.compliance"),
            (
                one(r#"{"key": "contact.friction", "distribution": {"uniform": {"from": 0.1, "to": 0.2}},
                       "truncate": [0.3, null]}"#),
                "expected more than 1e-6",
            ),
        ] {
            let fault = read(&text).unwrap_err();
            assert!(fault.message().contains(want) && fault.exit_code() == 2, "{want}: {fault}");
        }
        let sets = [
            format!("analyses.uncertainty={}", job("")),
            "analyses.sweep={\"keys\": {\"contact.friction\": [0.2]}}".into(),
        ];
        let fault = Job::from_bytes(WHEEL.as_bytes(), Path::new("job.json"), &sets, None).unwrap_err();
        assert!(fault.message().contains("analyses.sweep"), "{fault}");
    }
}
