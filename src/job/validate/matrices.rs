//! Rules for jobs whose bodies are given by matrices.

use super::super::model::*;

/// Rules within one body.
pub(super) fn check_body(path: &str, body: &Body, matrices: &Matrices, faults: &mut Vec<String>) {
    let others = [
        ("mesh", body.mesh.is_some()),
        ("material", body.material.is_some()),
        ("damping", body.damping != Damping::default()),
        ("fixed", !body.fixed.is_empty()),
    ];
    for (key, _) in others.into_iter().filter(|(_, is)| *is) {
        faults.push(format!(
            "{path}.{key}: given beside {path}.matrices, which say everything of the body; leave one of the two out"
        ));
    }
    for (i, contact) in matrices.contacts.iter().enumerate() {
        if !(1..=2).contains(&contact.tangential.len()) {
            faults.push(format!(
                "{path}.matrices.contacts.{i}.tangential: found {} rows, expected one (x) or two (x, y)",
                contact.tangential.len()
            ));
        }
    }
}

/// Rules between the bodies, the contact and the analyses.
pub(super) fn check(job: &Job, faults: &mut Vec<String>) {
    for (name, _) in job.bodies().iter().filter(|(_, b)| b.matrices.is_none()) {
        faults.push(format!(
            "bodies.{name}: found a mesh, but the other body is given by matrices; give both by matrices, or leave this one out: it is then rigid"
        ));
    }
    let analyses = &job.analyses;
    for name in analyses.names().into_iter().filter(|n| !["modes", "stability", "sweep"].contains(n)) {
        faults.push(format!(
            "analyses.{name}: needs meshes; bodies given by matrices have only modes, stability and sweeps of it"
        ));
    }
    if analyses.sweep.is_some() && analyses.stability.is_none() {
        faults.push("analyses.stability: missing; analyses.sweep computes it at every point, e.g. {}".into());
    }
    if analyses.names().is_empty() {
        faults.push("analyses: nothing to compute; give \"modes\", or \"modes\" and \"stability\"".into());
    }
    if analyses.stability.as_ref().is_some_and(|s| s.state == Some(StabilityState::Steady)) {
        faults.push("analyses.stability.state: found \"steady\", but bodies given by matrices slide at their contact.points; leave it out".into());
    }
    match &analyses.modes {
        None if analyses.stability.is_some() => faults
            .push("analyses.modes: missing; analyses.stability is computed on the modes, e.g. {\"count\": 60}".into()),
        Some(m) if m.count.is_some() == m.max_frequency.is_some() => {
            faults.push("analyses.modes: give exactly one of count and max_frequency (Hz)".into());
        }
        _ => {}
    }
    let points = match &job.contact {
        Some(contact) => check_contact(contact, faults),
        None if analyses.stability.is_some() => {
            faults.push("contact: missing; analyses.stability needs it".into());
            None
        }
        None => None,
    };
    for (name, body) in job.bodies() {
        let (Some(matrices), Some(points)) = (&body.matrices, points) else { continue };
        if matrices.contacts.len() != points {
            faults.push(format!(
                "bodies.{name}.matrices.contacts: found {} contacts, expected {points}, one for each of contact.points",
                matrices.contacts.len()
            ));
        }
    }
}

/// Number of contact points.
fn check_contact(contact: &Contact, faults: &mut Vec<String>) -> Option<usize> {
    let others = [
        ("normal_load", contact.normal_load.is_some()),
        ("approach", contact.approach.is_some()),
        ("speed", contact.speed != 0.0),
        ("creepage", contact.creepage != Creepage::default()),
        ("patch", contact.patch.is_some()),
        ("compliance", contact.compliance != Compliance::Fe),
    ];
    for (key, _) in others.into_iter().filter(|(_, is)| *is) {
        faults.push(format!(
            "contact.{key}: has no meaning for bodies given by matrices; contact.points says force, direction and velocity of each contact"
        ));
    }
    let Some(points) = &contact.points else {
        faults.push(
            "contact.points: missing; bodies given by matrices touch at points, e.g. [{\"direction\": [1]}]".into(),
        );
        return None;
    };
    if points.is_empty() {
        faults.push("contact.points: empty; give at least one contact".into());
    }
    for (i, point) in points.iter().enumerate() {
        let d = &point.direction;
        if !(1..=2).contains(&d.len()) || d.iter().all(|v| *v == 0.0) {
            faults.push(format!(
                "contact.points.{i}.direction: found {d:?}, expected one number (x) or two (x, y), not all 0"
            ));
        }
        if point.force.is_some_and(|f| f > 0.0) && point.slip_velocity.is_none() {
            faults.push(format!("contact.points.{i}.slip_velocity: missing; it is needed with force (m/s)"));
        }
    }
    Some(points.len())
}
