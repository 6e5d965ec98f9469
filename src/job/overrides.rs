//! `--set a.b.c=VALUE`: overrides of single keys before validation.

use super::schema::{nearest, quoted, unknown_key, Checker};
use crate::{rails, Error, Result};
use serde_json::{Map, Value};

/// Applies overrides in order. The value is JSON, or else a string. A path may name keys that the job does not give
/// yet, but only keys that exist in the schema.
pub fn apply(job: &mut Value, sets: &[String], checker: &Checker) -> Result<()> {
    for set in sets {
        let Some((path, text)) = set.split_once('=') else {
            return Err(Error::Job(format!("--set {set}: expected PATH=VALUE, e.g. --set contact.friction=0.4")));
        };
        let value = parse_value(text);
        let segments: Vec<&str> = path.trim().split('.').collect();
        if segments.iter().any(|s| s.is_empty()) {
            return Err(Error::Job(format!("--set {set}: the path has an empty part; write it like contact.friction")));
        }
        check_path(&segments, &format!("--set {set}"), checker)?;
        if value.is_null() && take_out(job, &segments) {
            continue;
        }
        put(job, &segments, value, &format!("--set {set}"))?;
    }
    Ok(())
}

/// Takes the key at a path out of the job: null stands for a key that is not given. False where the place is an entry
/// of a list.
fn take_out(job: &mut Value, segments: &[&str]) -> bool {
    let Some((key, holder)) = segments.split_last() else { return false };
    match job.pointer_mut(&holder.iter().map(|s| format!("/{s}")).collect::<String>()) {
        Some(Value::Object(map)) => {
            map.remove(*key);
            true
        }
        Some(Value::Array(_)) => false,
        // What has no such key, or is not there, needs nothing taken out.
        _ => true,
    }
}

/// A rail's name is text, although `54E1` is a number of JSON as well.
fn parse_value(text: &str) -> Value {
    if rails::ALL.iter().any(|rail| rail.name == text) {
        return Value::String(text.into());
    }
    super::parse::parse(text.as_bytes(), "--set").unwrap_or_else(|_| Value::String(text.into()))
}

/// Refuses a path that the schema has not; `what` begins the message.
pub(super) fn check_path(segments: &[&str], what: &str, checker: &Checker) -> Result<()> {
    for n in 0..segments.len() {
        if checker.keys_at(&segments[..=n]).is_some() {
            continue;
        }
        let allowed = checker.keys_at(&segments[..n]).unwrap_or_default();
        let place = segments[..=n].join(".");
        if allowed.is_empty() {
            let outer = segments[..n].join(".");
            return Err(Error::Job(format!("{what}: \"{outer}\" has no keys inside, so \"{place}\" does not exist")));
        }
        let mut message = format!("{what}: {}", unknown_key(&place, segments[n], &allowed));
        if nearest(segments[n], &allowed).is_none() && n == 0 {
            message = format!("{what}: unknown key \"{place}\". A path begins with one of {}", quoted(&allowed));
        }
        return Err(Error::Job(message));
    }
    Ok(())
}

/// Sets the value at a path; `what` begins messages.
pub(super) fn put(job: &mut Value, segments: &[&str], value: Value, what: &str) -> Result<()> {
    let mut node = job;
    for (n, segment) in segments.iter().enumerate() {
        if node.is_null() {
            *node = Value::Object(Map::new());
        }
        let place = segments[..n].join(".");
        node = match node {
            Value::Object(map) => map.entry(segment.to_string()).or_insert(Value::Null),
            Value::Array(items) => {
                let len = items.len();
                let found = segment.parse::<usize>().ok().and_then(|i| items.get_mut(i));
                found.ok_or_else(|| {
                    Error::Job(format!(
                        "{what}: \"{place}\" is a list of {len}; \"{segment}\" is not an index of it (0 is the first)"
                    ))
                })?
            }
            _ => {
                // A scalar where the path needs an object, e.g. a key of another form of the same entry.
                *node = Value::Object(Map::new());
                match node {
                    Value::Object(map) => map.entry(segment.to_string()).or_insert(Value::Null),
                    _ => return Err(Error::Defect("override of a value that is no object".into())),
                }
            }
        };
    }
    *node = value;
    Ok(())
}
