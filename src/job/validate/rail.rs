//! Rules between the keys of a rail.

use super::super::model::*;

/// Adds the faults of a rail.
pub fn check_body(path: &str, body: &Body, extruded: &Extruded, faults: &mut Vec<String>) {
    let key = format!("{path}.mesh.extruded");
    if !(extruded.running().room > 0.0) {
        faults.push(format!(
            "{key}.contact_offset: found {} m, expected a place on the head of 60E1, between -0.026 and 0.026 m, where its corners begin",
            extruded.contact_offset
        ));
    }
    for (given, what) in [(!body.fixed.is_empty(), "fixed"), (body.damping != Damping::default(), "damping")] {
        if given {
            faults.push(format!(
                "{path}.{what}: a rail has none of its own, {path}.track holds and damps it; leave it out"
            ));
        }
    }
    let track = body.track.clone().unwrap_or_default();
    if 2.0 * track.ends.length >= extruded.length {
        faults.push(format!(
            "{path}.track.ends.length: found {} m, expected less than half of {key}.length ({} m): there are two ends, and plain rail between them",
            track.ends.length, extruded.length
        ));
    }
}
