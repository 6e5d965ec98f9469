//! `--set a.b.c=VALUE`: overrides of single keys before validation.

use super::model::{Vehicle, VehicleName};
use super::schema::{nearest, quoted, unknown_key, Checker};
use crate::{rails, Error, Result};
use serde_json::{json, Map, Value};

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
    write_out(job, segments);
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

/// All keys of a value that has a short form at this place: data of a built-in vehicle, keys of a file that is given
/// by its path. None where the value is in no short form.
fn long_form(place: &[&str], value: &Value) -> Option<Value> {
    let text = value.as_str()?;
    match place {
        ["vehicle"] => {
            let name: VehicleName = serde_json::from_value(value.clone()).ok()?;
            serde_json::to_value(Vehicle::Named(name).data()).ok()
        }
        ["bodies", .., "mesh", "file"] | ["bodies", .., "matrices", "mass" | "damping" | "stiffness"] => {
            Some(json!({ "path": text }))
        }
        _ => None,
    }
}

/// Writes out the short forms that a path leads into, so that a key inside one can be changed alone.
fn write_out(job: &mut Value, segments: &[&str]) {
    let mut node = job;
    for (n, segment) in segments.iter().enumerate() {
        if let Some(long) = long_form(&segments[..n], node) {
            *node = long;
        }
        let inner = match node {
            Value::Object(map) => map.get_mut(*segment),
            Value::Array(items) => segment.parse::<usize>().ok().and_then(|i| items.get_mut(i)),
            _ => None,
        };
        let Some(inner) = inner else { return };
        node = inner;
    }
}

/// Sets the value at a path; `what` begins messages. A vehicle by its name, or a file by its path, keeps its other
/// data.
pub(super) fn put(job: &mut Value, segments: &[&str], value: Value, what: &str) -> Result<()> {
    write_out(job, segments);
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

#[cfg(test)]
mod tests {
    use super::super::Job;
    use super::*;
    use std::path::Path;

    fn applied(job: Value, sets: &[&str]) -> Value {
        let (mut job, sets) = (job, sets.iter().map(ToString::to_string).collect::<Vec<_>>());
        apply(&mut job, &sets, &Checker::default()).expect("overrides");
        job
    }

    /// A key of a built-in vehicle is changed alone: the others are those of its name.
    #[test]
    fn keys_of_named_vehicle_are_set_alone() {
        for name in ["metro_bogie", "tram_bogie", "freight_bogie"] {
            let named: Vehicle = serde_json::from_value(json!(name)).unwrap();
            let set = applied(json!({ "vehicle": name }), &["vehicle.axle_load=1e5", "vehicle.primary.yaw=2e6"]);
            let found: Vehicle = serde_json::from_value(set["vehicle"].clone()).unwrap();
            let mut wanted = named.data();
            wanted.axle_load = 1e5;
            wanted.primary.yaw = 2e6;
            assert_eq!(found, Vehicle::Data(wanted));
        }
        let torque = applied(json!({ "vehicle": "tram_bogie" }), &["vehicle.torque.1=500", "vehicle.wheelbase=1.9"]);
        assert_eq!((&torque["vehicle"]["torque"], &torque["vehicle"]["axle_load"]), (&json!([0.0, 500]), &json!(60e3)));
        let without = applied(json!({ "vehicle": "metro_bogie" }), &["vehicle.centre_of_gravity=null"]);
        assert!(without["vehicle"].get("centre_of_gravity").is_none() && without["vehicle"]["wheelbase"] == 2.5);
        // Of a name that does not exist nothing is known.
        assert_eq!(
            applied(json!({ "vehicle": "metro" }), &["vehicle.wheelbase=2"])["vehicle"],
            json!({"wheelbase": 2})
        );
    }

    /// Keys of a file that is given by its path alone.
    #[test]
    fn keys_of_file_are_set_beside_its_path() {
        let job = json!({ "bodies": {
            "lower": { "mesh": { "file": "ring.msh" } },
            "others": { "left": { "matrices": { "mass": "m.mtx" } } }
        } });
        let sets = ["bodies.lower.mesh.file.scale=0.001", "bodies.others.left.matrices.mass.format=\"matrix_market\""];
        let found = applied(job, &sets);
        assert_eq!(found["bodies"]["lower"]["mesh"]["file"], json!({ "path": "ring.msh", "scale": 0.001 }));
        let mass = &found["bodies"]["others"]["left"]["matrices"]["mass"];
        assert_eq!(*mass, json!({ "path": "m.mtx", "format": "matrix_market" }));
    }

    /// Sweeps and samples set keys of a named vehicle as overrides do.
    #[test]
    fn points_keep_data_of_named_vehicle() {
        let text = include_bytes!("../../jobs/uncertain-curve.json");
        let read = |sets: &[&str]| {
            let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
            Job::from_bytes(text, Path::new("jobs/uncertain-curve.json"), &sets, None).unwrap()
        };
        let input = r#"{"key": "vehicle.axle_load", "distribution": {"uniform": {"from": 9e4, "to": 12e4}}}"#;
        let study = format!(r#"analyses.uncertainty={{"inputs": [{input}], "samples": 16}}"#);
        let sweep = r#"analyses.sweep={"keys": {"vehicle.axle_load": [9e4, 12e4]}}"#;
        for sets in [vec![study.as_str()], vec!["analyses.uncertainty=null", sweep]] {
            let job = read(&sets);
            let named = job.vehicle.as_ref().expect("a vehicle").data();
            let plan = job.sweep.as_ref().expect("points");
            assert_eq!(plan.units, ["N"]);
            for (load, point) in plan.values[0].iter().zip(&plan.points) {
                let mut wanted = named.clone();
                wanted.axle_load = load.as_f64().expect("a load");
                assert_eq!(point.vehicle, Some(Vehicle::Data(wanted)));
                assert_eq!(point.contact.as_ref().and_then(|c| c.normal_load), load.as_f64().map(|load| 0.5 * load));
            }
        }
    }
}
