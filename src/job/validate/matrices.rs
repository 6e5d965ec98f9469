//! Rules for jobs whose bodies are given by matrices.

use super::super::model::*;
use super::super::transient::{Hold, Transient};

/// Rules within one body.
pub(super) fn check_body(path: &str, body: &Body, matrices: &Matrices, faults: &mut Vec<String>) {
    let others = [
        ("mesh", body.mesh.is_some()),
        ("profile", body.profile.is_some()),
        ("material", body.material.is_some()),
        ("damping", body.damping != Damping::default()),
        ("fixed", !body.fixed.is_empty()),
        ("supports", !body.supports.is_empty()),
        ("rotation", body.rotates()),
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
    if analyses.sweep.is_some() && analyses.stability.is_none() {
        faults.push("analyses.stability: missing; analyses.sweep computes it at every point, e.g. {}".into());
    }
    if analyses.names().is_empty() {
        faults.push("analyses: nothing to compute; give \"modes\", or \"modes\" and \"stability\", \"receptance\" or \"transient\"".into());
    }
    if analyses.stability.as_ref().is_some_and(|s| s.state == Some(StabilityState::Steady)) {
        faults.push("analyses.stability.state: found \"steady\", but bodies given by matrices slide at their contact.points; leave it out".into());
    }
    if analyses.stability.as_ref().is_some_and(|s| s.contact == StabilityContact::Point) {
        faults.push("analyses.stability.contact: found \"point\", which is taken from the pressure on a patch, but bodies given by matrices touch at contact.points; leave it out".into());
    }
    let on_contact = analyses.on_contact().first().copied();
    match (&analyses.modes, on_contact) {
        (None, Some(name)) => faults
            .push(format!("analyses.modes: missing; analyses.{name} is computed on the modes, e.g. {{\"count\": 60}}")),
        (Some(m), _) if m.count.is_some() == m.max_frequency.is_some() => {
            faults.push("analyses.modes: give exactly one of count and max_frequency (Hz)".into());
        }
        _ => {}
    }
    let points = match &job.contact {
        Some(contact) => check_contact(contact, faults),
        None => {
            faults.extend(on_contact.map(|name| format!("contact: missing; analyses.{name} needs it")));
            None
        }
    };
    if let Some(receptance) = &analyses.receptance {
        if let Err(fault) = receptance.frequency.numbers() {
            faults.push(format!("analyses.receptance.frequency: {fault}"));
        }
    }
    if let (Some(transient), Some(contact)) = (&analyses.transient, &job.contact) {
        check_transient(transient, contact, analyses.stability.is_some(), faults);
    }
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
        ("speed", contact.speed != 0.0),
        ("creepage", contact.creepage != Creepage::default()),
        ("patch", contact.patch.is_some()),
        ("compliance", contact.compliance != Compliance::Fe),
    ];
    for (key, _) in others.into_iter().filter(|(_, is)| *is) {
        faults.push(format!(
            "contact.{key}: has no meaning for bodies given by matrices; contact.points says direction and velocity of each contact"
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
    let load = match (contact.normal_load, contact.approach) {
        (Some(_), Some(_)) => {
            faults.push("contact: both normal_load and approach are given; give exactly one of them".into());
            true
        }
        (n, d) => n.is_some() || d.is_some(),
    };
    for (i, point) in points.iter().enumerate() {
        if load && point.force.is_some() {
            faults.push(format!(
                "contact.points.{i}.force: given beside a load on all contacts; leave one of the two out"
            ));
        }
        if !load && point.gap != 0.0 {
            faults.push(format!(
                "contact.points.{i}.gap: has no meaning without contact.normal_load or contact.approach; give one of them, or leave it out"
            ));
        }
        if load && point.slip_velocity.is_none() {
            faults.push(format!("contact.points.{i}.slip_velocity: missing; it is needed under a load (m/s)"));
        }
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

/// Rules for the transient of contact points.
fn check_transient(transient: &Transient, contact: &Contact, stability: bool, faults: &mut Vec<String>) {
    let path = "analyses.transient";
    if transient.histories.is_some() {
        faults.push(format!("{path}.histories: contact points keep load, direction and velocity; leave them out"));
    }
    if transient.duration < transient.step {
        faults.push(format!(
            "{path}.duration: found {} s, expected at least one step ({} s)",
            transient.duration, transient.step
        ));
    }
    if transient.start.mode.is_some() && !stability {
        faults.push(format!("analyses.stability: missing; {path}.start.mode names a mode of it, e.g. {{}}"));
    }
    if transient.hold == Hold::Load && contact.normal_load.is_none() {
        faults.push(format!("{path}.hold: \"load\" needs contact.normal_load, which the job does not give"));
    }
    if contact.normal_load.is_none() && contact.approach.is_none() {
        for (i, _) in contact.points.iter().flatten().enumerate().filter(|(_, p)| !p.force.is_some_and(|f| f > 0.0)) {
            faults.push(format!(
                "contact.points.{i}.force: missing; {path} needs contacts that are pressed: give the force of each, or contact.normal_load or contact.approach"
            ));
        }
    }
}
