//! Jobs beside each other: what a reduced model depends on, and in which keys two documents differ.

use super::{Body, Contact, ContactAround, ContactPlaces, ContactWheels, FaceContact, GivenCreepage, Job, Placement};
use serde_json::{json, Value};
use std::fmt;

/// Inputs that the reduced model of a job depends on, damping apart: two jobs with the same have the same modes and
/// compliances.
pub fn fe_inputs(job: &Job) -> Value {
    let body = |b: &Body| {
        let mut fixed = b.fixed.clone();
        fixed.sort();
        let mut matrices = b.matrices.clone();
        // A factor costs nothing.
        matrices.iter_mut().for_each(|m| m.damping_factor = 1.0);
        let mut body = json!({ "mesh": b.mesh, "material": b.material, "fixed": fixed, "matrices": matrices });
        // What rotation adds is there or is not, whatever the speed.
        if let Some(axle) = b.axle().filter(|_| b.rotates()) {
            body["axle"] = json!(axle);
        }
        if !b.supports.is_empty() {
            body["supports"] = json!(b.supports);
        }
        if b.suspension.is_some() {
            body["suspension"] = json!(b.suspension);
        }
        if !b.absorbers.is_empty() {
            body["absorbers"] = json!(b.absorbers);
        }
        if !b.ring_dampers.is_empty() {
            body["ring_dampers"] = json!(b.ring_dampers);
        }
        // Damping is no part of the model, measured frequencies are.
        let measured = b.modes.iter().flat_map(|m| &m.measured).filter(|m| m.frequency.is_some());
        let measured: Vec<_> = measured.map(|m| json!([m.order, m.family, m.near, m.frequency, m.shape])).collect();
        if !measured.is_empty() {
            body["measured"] = json!(measured);
        }
        if let Some(track) = &b.track {
            body["track"] = json!(track);
        }
        if let Some(profile) = &b.profile {
            body["profile"] = json!(profile);
        }
        body
    };
    let contact = job.contact.as_ref();
    let mut inputs = json!({
        "bodies": {
            "lower": job.bodies.lower.as_ref().map(body),
            "upper": job.bodies.upper.as_ref().map(body),
        },
        "contact": { "patch": contact.map(|c| c.patch), "compliance": contact.map(|c| c.compliance) },
        "analyses": { "modes": job.analyses.modes },
    });
    if !job.bodies.others.is_empty() {
        inputs["bodies"]["others"] = job.bodies.others.iter().map(|(name, of)| (name.clone(), body(of))).collect();
    }
    if job.is_disc_with_pads() {
        let cells = |one: &FaceContact| json!([one.between, one.face, one.pad_face, one.cells]);
        inputs["contacts"] = job.contacts.iter().map(cells).collect();
    }
    if let Some(grid) = contact.and_then(|c| c.grid) {
        inputs["contact"]["grid"] = json!(grid);
    }
    if let Some(contact) = contact.filter(|c| !c.around.is_empty()) {
        let named = |one: &ContactAround| match (&one.body, one.patch) {
            (None, None) => json!(one.angle),
            (Some(body), None) => json!([one.angle, body]),
            (body, patch) => json!([one.angle, body, patch]),
        };
        inputs["contact"]["around"] = contact.around.iter().map(named).collect();
    }
    if let Some(placement) = job.placement() {
        inputs["contact"]["placement"] = json!(geometry(Some(placement)));
        inputs["contact"]["load"] = json!([contact.and_then(|c| c.normal_load), contact.and_then(|c| c.approach)]);
        let several = |c: &&Contact| c.places == ContactPlaces::All || c.wheels == ContactWheels::Both;
        if let Some(contact) = contact.filter(several) {
            if contact.places == ContactPlaces::All {
                inputs["contact"]["places"] = json!([contact.places, contact.vertical_load]);
                // The shift of the wheel follows from creep forces too.
                if let Some(force) = contact.lateral_force {
                    let track = contact.placement.as_ref();
                    let rolling = track.map(|p| json!([p.speed, p.angular_speed, p.creepage, p.curvature]));
                    inputs["contact"]["lateral_force"] =
                        json!([force, contact.friction, contact.friction_zones, contact.speed, rolling]);
                }
            }
            if contact.wheels == ContactWheels::Both {
                inputs["contact"]["wheels"] = json!(contact.wheels);
            }
            let further = contact.further.iter();
            let further: Vec<_> = further.map(|c| json!([geometry(c.placement.as_ref()), c.normal_load])).collect();
            if !further.is_empty() {
                inputs["contact"]["further"] = json!(further);
            }
        }
    }
    inputs
}

/// A placement without how fast the wheel rolls and slides, which changes neither the bodies nor the gap.
fn geometry(placement: Option<&Placement>) -> Option<Placement> {
    placement.map(|placement| Placement {
        speed: None,
        angular_speed: None,
        creepage: GivenCreepage::default(),
        loaded: true,
        curvature: 0.0,
        ..placement.clone()
    })
}

/// The keys in which two resolved jobs of a transient differ in what matters up to the time `until`, s: all but what
/// is written, the duration, and the histories after that time.
pub(crate) fn run_differences(a: &Value, b: &Value, until: f64) -> Vec<String> {
    let path = "analyses.transient.histories";
    let further = |job: &Value| job.pointer("/analyses/transient/histories/further")?.as_array().map(Vec::len);
    let mut keys = Vec::new();
    for number in 0..=further(a).max(further(b)).unwrap_or(0) {
        // The creepages of the first contact that are no histories.
        let (path, constants) = match number {
            0 => (path.to_owned(), Some("/contact/creepage")),
            k => (format!("{path}.further.{}", k - 1), None),
        };
        for key in ["normal_load", "approach", "longitudinal", "lateral", "spin", "vertical_load", "lateral_force"] {
            let of = |job: &Value| {
                let own = format!("/{}/{key}", path.replace('.', "/"));
                let constant = constants.and_then(|at| job.pointer(&format!("{at}/{key}"))?.as_f64());
                job.pointer(&own).and_then(table).or(constant.map(|c| vec![[0.0, c]]))
            };
            let same = match (of(a), of(b)) {
                (Some(x), Some(y)) => same_until(&x, &y, until),
                (x, y) => x == y,
            };
            if !same {
                keys.push(format!("{path}.{key}"));
            }
        }
    }
    let [a, b] = [a, b].map(|job| {
        let mut job = job.clone();
        job["output"] = Value::Null;
        if let Some(Value::Object(transient)) = job.pointer_mut("/analyses/transient") {
            transient.remove("duration");
            transient.remove("histories");
        }
        job
    });
    keys.extend(differences(&a, &b).into_iter().map(|d| d.key));
    keys
}

/// The points of a history.
fn table(value: &Value) -> Option<Vec<[f64; 2]>> {
    let point = |p: &Value| Some([p.get(0)?.as_f64()?, p.get(1)?.as_f64()?]);
    value.as_array()?.iter().map(point).collect()
}

/// Returns whether two histories, straight between their points, are the same function up to the time `until`, to
/// rounding.
fn same_until(a: &[[f64; 2]], b: &[[f64; 2]], until: f64) -> bool {
    let at = |points: &[[f64; 2]], t: f64| {
        let after = points.iter().position(|p| p[0] > t).unwrap_or(points.len());
        match (after.checked_sub(1).map(|i| points[i]), points.get(after).copied()) {
            (Some([t0, v0]), Some([t1, v1])) if t > t0 => v0 + (v1 - v0) * ((t - t0) / (t1 - t0)),
            (Some([_, v]), _) | (None, Some([_, v])) => v,
            (None, None) => 0.0,
        }
    };
    let size = a.iter().chain(b).map(|p| p[1].abs()).fold(0.0, f64::max);
    let times = a.iter().chain(b).map(|p| p[0]).filter(|t| *t <= until).chain([until]);
    times.into_iter().all(|t| (at(a, t) - at(b, t)).abs() <= 1e-12 * size)
}

/// A key in which two documents differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Its dotted path.
    pub key: String,
    /// The values in the first and in the second document; null where there is none.
    pub values: [Value; 2],
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [there, here] = self.values.each_ref().map(brief);
        write!(f, "{} ({there} there, {here} here)", self.key)
    }
}

/// The keys in which two documents differ, in alphabetical order. Numbers are compared as numbers: 1 is 1.0.
pub fn differences(a: &Value, b: &Value) -> Vec<Difference> {
    let mut found = Vec::new();
    compare(a, b, "", &mut found);
    found
}

fn compare(a: &Value, b: &Value, path: &str, found: &mut Vec<Difference>) {
    match (a, b) {
        (Value::Object(x), Value::Object(y)) => {
            let mut keys: Vec<&String> = x.keys().chain(y.keys()).collect();
            keys.sort();
            keys.dedup();
            for key in keys {
                let inner = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                compare(x.get(key).unwrap_or(&Value::Null), y.get(key).unwrap_or(&Value::Null), &inner, found);
            }
        }
        (Value::Number(x), Value::Number(y)) if x.as_f64() == y.as_f64() => {}
        _ if a == b => {}
        _ => found.push(Difference { key: path.to_owned(), values: [a.clone(), b.clone()] }),
    }
}

fn brief(value: &Value) -> String {
    let text = match value {
        Value::Null => "none".into(),
        other => other.to_string(),
    };
    if text.chars().count() > 60 {
        return text.chars().take(59).chain(['…']).collect();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differing_keys_are_named_by_their_paths() {
        let a = json!({"x": {"a": 1, "b": [1, 2]}, "y": 2, "gone": true});
        let b = json!({"x": {"a": 1.0, "b": [1, 3]}, "y": 2, "new": null, "z": 1});
        let found = differences(&a, &b);
        assert_eq!(found.iter().map(|d| d.key.as_str()).collect::<Vec<_>>(), ["gone", "x.b", "z"]);
        assert_eq!(found[1].to_string(), "x.b ([1,2] there, [1,3] here)");
    }

    /// Histories of further contacts, and of a load that contacts share, are compared as those of the first one.
    #[test]
    fn a_run_may_go_on_with_other_histories_of_further_contacts() {
        let with = |histories: Value| json!({ "analyses": { "transient": { "histories": histories } } });
        let job = |further: Value| with(json!({ "further": further }));
        let first = job(json!([{}, { "normal_load": [[0, 500], [1, 500]] }]));
        let bent = job(json!([{}, { "normal_load": [[0, 500], [0.3, 500], [1, 900]] }]));
        assert_eq!(run_differences(&first, &bent, 0.3), [] as [&str; 0]);
        let key = "analyses.transient.histories.further.1.normal_load";
        assert_eq!(run_differences(&first, &bent, 0.31), [key]);
        assert_eq!(run_differences(&job(json!([])), &first, 0.1), [key]);
        let shared = |load: f64| with(json!({ "vertical_load": [[0, 500], [1, load]] }));
        assert_eq!(
            run_differences(&shared(500.0), &shared(600.0), 0.1),
            ["analyses.transient.histories.vertical_load"]
        );
        let sideways = |force: f64| with(json!({ "lateral_force": [[0, -500], [1, force]] }));
        assert_eq!(
            run_differences(&sideways(-500.0), &sideways(600.0), 0.1),
            ["analyses.transient.histories.lateral_force"]
        );
    }

    /// Histories before the completed steps must be the same; later ones may differ.
    #[test]
    fn a_run_may_go_on_longer_and_with_other_histories() {
        let job = |duration: f64, lateral: Value| {
            json!({
                "contact": { "creepage": { "lateral": 0.01 } },
                "analyses": {
                    "transient": { "duration": duration, "step": 1e-5, "histories": { "lateral": lateral } }
                },
                "output": { "fields": duration > 1.0 },
            })
        };
        let first = job(1.0, json!([[0, 0.01], [1, 0.01]]));
        let bent = job(2.0, json!([[0, 0.01], [0.3, 0.01], [2, 0.02]]));
        assert_eq!(run_differences(&first, &bent, 0.3), [] as [&str; 0]);
        assert_eq!(run_differences(&first, &bent, 0.31), ["analyses.transient.histories.lateral"]);
        // A constant is a history, too.
        let mut none = job(1.0, Value::Null);
        assert_eq!(run_differences(&none, &bent, 0.3), [] as [&str; 0]);
        none["contact"]["creepage"]["lateral"] = json!(0.011);
        assert_eq!(
            run_differences(&none, &bent, 0.3),
            ["analyses.transient.histories.lateral", "contact.creepage.lateral"]
        );
        let mut other = bent.clone();
        other["analyses"]["transient"]["step"] = json!(2e-5);
        assert_eq!(run_differences(&bent, &other, 0.1), ["analyses.transient.step"]);
    }
}
