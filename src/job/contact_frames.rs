//! Directions of contacts between two bodies by matrices, as far as the job shows whether they fit each other.

use super::{Job, MatrixContact, MatrixDirection};

/// Cosines that differ from those of directions that fit each other by so much are told.
const APART: f64 = 1e-3;

/// Warnings of contacts whose normals are not opposite, or whose tangents differ, where both bodies give them as
/// directions at nodes: right only if the two models have different frames.
pub fn contact_frames(job: &Job) -> Vec<String> {
    let (Some(lower), Some(upper)) = (&job.bodies.lower, &job.bodies.upper) else { return Vec::new() };
    let (Some(lower), Some(upper)) = (&lower.matrices, &upper.matrices) else { return Vec::new() };
    let pairs = lower.contacts.iter().zip(&upper.contacts).enumerate();
    pairs.filter_map(|(i, (a, b))| misfit(a, b).map(|what| warning(i, what))).collect()
}

fn warning(contact: usize, what: &str) -> String {
    format!(
        "bodies.*.matrices.contacts.{contact}: found {what}; expected opposite normals, each into its own body, \
         and the \
         same directions x and y, unless the two models have different frames"
    )
}

/// How the directions of a contact do not fit each other.
fn misfit(a: &MatrixContact, b: &MatrixContact) -> Option<&'static str> {
    let cosine = |u: &MatrixDirection, v: &MatrixDirection| -> Option<f64> {
        let (u, v) = (u.vector()?, v.vector()?);
        Some(u.iter().zip(v).map(|(p, q)| p * q).sum())
    };
    if cosine(&a.normal, &b.normal).is_some_and(|c| c > APART - 1.0) {
        return Some("normals that are not opposite");
    }
    let mut tangents = a.tangential.iter().zip(&b.tangential);
    let differ = tangents.any(|(u, v)| cosine(u, v).is_some_and(|c| c < 1.0 - APART));
    differ.then_some("tangential directions that differ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::Path;

    #[test]
    fn directions_of_two_bodies_fit_each_other() {
        let text = include_str!("../../jobs/disc-brake.json");
        let mut value: serde_json::Value = serde_json::from_str(text).unwrap();
        let warnings = |value: &serde_json::Value| {
            let bytes = value.to_string();
            contact_frames(&Job::from_bytes(bytes.as_bytes(), Path::new("job.json"), &[], None).unwrap())
        };
        assert_eq!(warnings(&value), [""; 0]);
        let contacts = &mut value["bodies"]["upper"]["matrices"]["contacts"];
        contacts[2]["normal"] = json!("z");
        contacts[5]["tangential"] = json!(["-x", "y"]);
        // One that slides nowhere, and a row, say nothing.
        contacts[6]["tangential"] = json!([0]);
        let found = warnings(&value);
        assert!(found.len() == 2 && found[0].contains("contacts.2: found normals that are not opposite"), "{found:?}");
        assert!(found[1].contains("contacts.5: found tangential directions that differ"), "{found:?}");
    }
}
