//! Rules of tuned absorbers and ring dampers.

use super::super::model::*;

/// Adds the faults of what a body carries.
pub fn check(path: &str, body: &Body, faults: &mut Vec<String>) {
    let absorbers = body.absorbers.iter().enumerate().map(|(i, a)| (format!("{path}.absorbers.{i}"), a.place));
    let rings = body.ring_dampers.iter().enumerate().map(|(i, r)| (format!("{path}.ring_dampers.{i}"), r.place));
    let section = match &body.mesh {
        Some(MeshSource::Revolved(revolved)) => &revolved.section,
        _ => {
            let given = [("absorbers", body.absorbers.len()), ("ring_dampers", body.ring_dampers.len())];
            return faults.extend(given.into_iter().filter(|(_, count)| *count > 0).map(|(key, _)| {
                format!(
                    "{path}.{key}: only for a wheel that is swept from a section (mesh.revolved); model them in the \
                     mesh file, or leave them out"
                )
            }));
        }
    };
    let unnamed = match section {
        Section::W920S | Section::W920SWheelset | Section::Wheel(_) => None,
        Section::Cylinder(_) => Some("the cylinder"),
        Section::File(_) => Some("a drawn section"),
    };
    for (key, place) in absorbers.chain(rings) {
        if let (Some(what), AbsorberPlace::Named(_)) = (unnamed, place) {
            faults.push(format!(
                "{key}.place: {what} has no places by name; expected coordinates, e.g. {{\"radius\": 0.39, \"y\": \
                 -0.04}} (m)"
            ));
        }
    }
    for (i, ring) in body.ring_dampers.iter().enumerate() {
        if let AbsorberPlace::At(at) = ring.place {
            if ring.diameter >= at.radius {
                faults.push(format!(
                    "{path}.ring_dampers.{i}.diameter: found {} m, expected the diameter of the wire, far less than \
                     place.radius, {} m",
                    ring.diameter, at.radius
                ));
            }
        }
    }
}
