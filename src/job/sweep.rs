//! The points of a sweep: every combination of values put into the job, checked like any other job before anything is
//! computed.

use super::damping;
use super::from_json;
use super::model::*;
use super::overrides::{check_path, put};
use super::schema::Checker;
use super::validate::validate;
use crate::{Error, Result};
use serde_json::Value;
use std::path::Path;

/// More points than this are a slip of the pen, not a sweep.
const MAX_POINTS: usize = 100_000;

/// A sweep as a list of jobs.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// The swept keys, dotted paths, `[k]`.
    pub keys: Vec<String>,
    /// Unit of each key as the schema has it, "-" where it has none, `[k]`.
    pub units: Vec<String>,
    /// Value of each key at each point, `[k][points]`.
    pub values: Vec<Vec<Value>>,
    /// Numbers of values along the keys of a grid, the last key running fastest, `[k]`; of lists taken side by side
    /// their common length, `[1]`.
    pub shape: Vec<usize>,
    /// The resolved job of each point, with `modes` and `stability` alone, `[points]`.
    pub points: Vec<Job>,
}

impl SweepPlan {
    /// The dimension of the shape along which the points go with a key, and its name; without one the last key, and
    /// where lists stand side by side all of them.
    pub fn along(&self, key: Option<&str>) -> (usize, String) {
        let last = self.shape.len() - 1;
        match key.and_then(|key| self.keys.iter().position(|k| k == key)) {
            Some(k) => (k.min(last), self.keys[k].clone()),
            None if self.shape.len() == self.keys.len() => (last, self.keys[last].clone()),
            None => (last, self.keys.join(", ")),
        }
    }

    /// The values of the keys at a point, as one reads them.
    pub fn place(&self, point: usize) -> String {
        let here: Vec<String> =
            self.keys.iter().zip(&self.values).map(|(key, values)| format!("{key} = {}", values[point])).collect();
        here.join(", ")
    }
}

/// Expands `sweep` over the job `base` (as written, overrides applied). `name` names the job in messages.
pub(super) fn plan(base: &Value, sweep: &Sweep, name: &str, folder: &Path, checker: &Checker) -> Result<SweepPlan> {
    let fault = |text: String| Error::Job(format!("{name}: analyses.sweep.{text}"));
    if sweep.keys.is_empty() {
        return Err(fault(
            "keys: the sweep is empty; name a key and its values, e.g. {\"contact.friction\": [0.2, 0.3]}".into(),
        ));
    }
    let mut lists: Vec<Vec<Value>> = Vec::new();
    for (key, values) in &sweep.keys {
        let segments: Vec<&str> = key.split('.').collect();
        check_path(&segments, &format!("{name}: analyses.sweep.keys"), checker)?;
        if !sweepable(&segments) {
            return Err(fault(format!(
                "keys: \"{key}\" cannot be swept; keys of bodies, contact, contacts, curve, vehicle, analyses.modes \
                 and analyses.stability can"
            )));
        }
        lists.push(values.list().map_err(|text| fault(format!("keys: {key}: {text}")))?);
    }
    let keys: Vec<String> = sweep.keys.keys().cloned().collect();
    let lengths: Vec<usize> = lists.iter().map(Vec::len).collect();
    let (shape, count) = match sweep.combine {
        Combine::Grid => (lengths.clone(), lengths.iter().try_fold(1usize, |n, &l| n.checked_mul(l))),
        Combine::Zip => {
            if let Some(k) = (1..lists.len()).find(|&k| lengths[k] != lengths[0]) {
                return Err(fault(format!(
                    "keys: {} has {} values and {} has {}; with combine = \"zip\" all have as many",
                    keys[0], lengths[0], keys[k], lengths[k]
                )));
            }
            (vec![lengths[0]], Some(lengths[0]))
        }
    };
    let count = count.filter(|&n| n <= MAX_POINTS).ok_or_else(|| {
        fault(format!("keys: {lengths:?} values make more than {MAX_POINTS} points; use fewer values"))
    })?;
    let mut values = vec![Vec::with_capacity(count); keys.len()];
    for point in 0..count {
        let mut rest = point;
        for k in (0..keys.len()).rev() {
            let at = match sweep.combine {
                Combine::Grid => {
                    let at = rest % lengths[k];
                    rest /= lengths[k];
                    at
                }
                Combine::Zip => point,
            };
            values[k].push(lists[k][at].clone());
        }
    }
    let points = points(base, "analyses.sweep", (&keys, &values), (name, folder, checker))?;
    let units = keys.iter().map(|k| checker.unit_at(&k.split('.').collect::<Vec<_>>())).collect();
    Ok(SweepPlan { keys, units, values, shape, points })
}

/// The jobs of points over the job `base`, with `modes` and `stability` alone; `path` is that of the analysis, and
/// `name` names the job in messages.
pub(super) fn points(
    base: &Value,
    path: &str,
    (keys, values): (&[String], &[Vec<Value>]),
    (name, folder, checker): (&str, &Path, &Checker),
) -> Result<Vec<Job>> {
    let count = values.first().map_or(0, Vec::len);
    let mut stripped = base.clone();
    if let Some(analyses) = stripped.get_mut("analyses").and_then(Value::as_object_mut) {
        analyses.retain(|k, _| k == "modes" || k == "stability");
        // Points are computed on the reduced model.
        analyses.get_mut("stability").and_then(Value::as_object_mut).map(|stability| stability.remove("full"));
    }
    let mut points = Vec::with_capacity(count);
    for point in 0..count {
        let mut job = stripped.clone();
        let mut here = Vec::new();
        for (key, values) in keys.iter().zip(values) {
            put(&mut job, &key.split('.').collect::<Vec<_>>(), values[point].clone(), &format!("{path}.keys"))?;
            here.push(format!("{key} = {}", values[point]));
        }
        let refused = |fault: &str| Error::Job(format!("{name}: {path}, at {}: {fault}", here.join(", ")));
        if let Some(fault) = checker.check(&job).first() {
            return Err(refused(fault));
        }
        let stated = damping::stated(&job);
        let mut job: Job = from_json(&job).map_err(|e| refused(&e.to_string()))?;
        if let Some(fault) = job.resolve_contacts().first() {
            return Err(refused(fault));
        }
        job.resolve_groups();
        job.resolve_rotation();
        if let Some(fault) = validate(&job).first() {
            return Err(refused(fault));
        }
        job.resolve_damping(&stated);
        job.resolve(folder);
        points.push(job);
    }
    Ok(points)
}

/// Returns whether a key can change the stability of steady sliding.
fn sweepable(segments: &[&str]) -> bool {
    segments.get(..3) != Some(&["analyses", "stability", "full"])
        && matches!(
            segments,
            ["bodies" | "contact" | "contacts" | "curve" | "vehicle", _, ..]
                | ["vehicle"]
                | ["analyses", "modes" | "stability", ..]
        )
}

impl SweepValues {
    /// The values one by one, or what is wrong with them.
    fn list(&self) -> std::result::Result<Vec<Value>, String> {
        let range = match self {
            SweepValues::List(list) if list.is_empty() => return Err("the list of values is empty".into()),
            SweepValues::List(list) => return Ok(list.clone()),
            SweepValues::Range(range) => range,
        };
        range.numbers()?.into_iter().map(number).collect()
    }
}

impl SweepRange {
    /// The numbers one by one, or what is wrong with them.
    pub fn numbers(&self) -> std::result::Result<Vec<f64>, String> {
        let (from, to) = (self.from, self.to);
        let count = match (self.count, self.step) {
            (Some(n), None) => n as usize,
            (None, Some(step)) => {
                if (to - from) * step < 0.0 {
                    return Err(format!("a step of {step} does not lead from {from} to {to}"));
                }
                // A last step that falls short of the end by rounding alone counts.
                let steps = ((to - from) / step + 1e-9).floor();
                if steps >= MAX_POINTS as f64 {
                    return Err(format!("steps of {step} from {from} to {to} are more than {MAX_POINTS}"));
                }
                return Ok((0..=steps as usize).map(|i| rounded(from + step * i as f64)).collect());
            }
            _ => return Err("give exactly one of count and step".into()),
        };
        if count == 1 && from != to {
            return Err(format!("one value cannot reach from {from} to {to}; give a count of 2 or more"));
        }
        let part = |i: usize| i as f64 / (count.max(2) - 1) as f64;
        Ok((0..count).map(|i| rounded(from + (to - from) * part(i))).collect())
    }
}

/// Sums like 0.1 + 0.2 in a column are ugly, and differ from what a user would type: 15 digits are kept.
fn rounded(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

fn number(value: f64) -> std::result::Result<Value, String> {
    serde_json::Number::from_f64(value).map(Value::Number).ok_or_else(|| format!("{value} is no finite number"))
}
