//! Jobs beside each other: what a reduced model depends on, and in which keys two documents differ.

use super::{Body, Job};
use serde_json::{json, Value};
use std::fmt;

/// What of a job its reduced model depends on, damping apart: two jobs with the same have the same modes and compliances.
pub fn fe_inputs(job: &Job) -> Value {
    let body = |b: &Body| {
        let mut fixed = b.fixed.clone();
        fixed.sort();
        let mut matrices = b.matrices.clone();
        // A factor costs nothing.
        matrices.iter_mut().for_each(|m| m.damping_factor = 1.0);
        json!({ "mesh": b.mesh, "material": b.material, "fixed": fixed, "matrices": matrices })
    };
    let contact = job.contact.as_ref();
    json!({
        "bodies": {
            "lower": job.bodies.lower.as_ref().map(body),
            "upper": job.bodies.upper.as_ref().map(body),
        },
        "contact": { "patch": contact.map(|c| c.patch), "compliance": contact.map(|c| c.compliance) },
        "analyses": { "modes": job.analyses.modes },
    })
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
}
