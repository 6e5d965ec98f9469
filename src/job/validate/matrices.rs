//! Rules for jobs whose bodies are given by matrices.

use super::super::model::*;
use super::super::transient::{HeldQuantity, Transient};

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
    if !(matrices.scale > 0.0 && matrices.scale.is_finite()) {
        faults.push(format!("{path}.matrices.scale: found {}, expected a length above 0, m", matrices.scale));
    }
    for (i, support) in matrices.supports.iter().enumerate() {
        check_support(&format!("{path}.matrices.supports.{i}"), support, faults);
    }
    for (i, contact) in matrices.contacts.iter().enumerate() {
        check_directions(&format!("{path}.matrices.contacts.{i}"), contact, faults);
    }
}

/// Rules of a support.
fn check_support(key: &str, support: &MatrixSupport, faults: &mut Vec<String>) {
    if support.nodes.is_empty() {
        faults.push(format!("{key}.nodes: empty; give at least one node"));
    }
    let mut sorted = support.nodes.clone();
    sorted.sort_unstable();
    if let Some(w) = sorted.windows(2).find(|w| w[0] == w[1]) {
        faults.push(format!("{key}.nodes: found node {} twice, expected every node once", w[0]));
    }
    if support.clamped.is_empty() && support.stiffness.is_none() && support.damping.is_none() {
        faults.push(format!("{key}: does nothing; give clamped, stiffness or damping"));
    }
    for (what, values) in [("stiffness", support.stiffness), ("damping", support.damping)] {
        let both = |(component, value): (&Component, f64)| support.clamped.contains(component) && value > 0.0;
        let components = [Component::X, Component::Y, Component::Z];
        if values.is_some_and(|v| components.iter().zip(v).any(both)) {
            faults.push(format!("{key}.{what}: given along a component that is clamped; leave one of the two out"));
        }
    }
}

/// Rules of the directions of a contact.
fn check_directions(key: &str, contact: &MatrixContact, faults: &mut Vec<String>) {
    if !(1..=2).contains(&contact.tangential.len()) {
        faults
            .push(format!("{key}.tangential: found {} rows, expected one (x) or two (x, y)", contact.tangential.len()));
    }
    if contact.against.is_some() && contact.node.is_none() {
        faults.push(format!("{key}.node: missing; against is the node that this one moves relative to"));
    }
    if contact.node.is_some() && contact.node == contact.against {
        faults.push(format!("{key}.against: found the node itself, expected the node of the counter-body"));
    }
    let names = ["tangential.0", "tangential.1"].into_iter().zip(&contact.tangential);
    let mut all = vec![("normal", &contact.normal)];
    all.extend(names);
    let mut vectors: Vec<(&str, [f64; 3])> = Vec::new();
    for (what, direction) in all {
        match (direction.vector(), contact.node) {
            (None, Some(_)) if *direction != MatrixDirection::Row(0) => faults.push(format!(
                "{key}.{what}: found a row beside a node, expected a direction as \"z\" or [0, 0, 1]; leave \
                 node out for rows"
            )),
            (Some(_), None) => {
                faults.push(format!("{key}.node: missing; {key}.{what} is a direction at a node, not a row"))
            }
            (Some(v), _) if v.iter().any(|c| !c.is_finite()) => {
                faults.push(format!("{key}.{what}: found a vector without direction, expected one that is not 0"));
            }
            (Some(v), _) => vectors.push((what, v)),
            (None, _) => {}
        }
    }
    for (i, (a, u)) in vectors.iter().enumerate() {
        for (b, v) in &vectors[i + 1..] {
            let cosine: f64 = u.iter().zip(v).map(|(p, q)| p * q).sum();
            if cosine.abs() > 1e-6 {
                faults.push(format!(
                    "{key}.{b}: found a direction that is not perpendicular to {a} (cosine {cosine:.2e}); give \
                     one that is"
                ));
            }
        }
    }
}

/// Rules between the bodies, the contact and the analyses.
pub(super) fn check(job: &Job, faults: &mut Vec<String>) {
    for (name, _) in job.bodies().iter().filter(|(_, b)| b.matrices.is_none()) {
        faults.push(format!(
            "bodies.{name}: found a mesh, but the other body is given by matrices; give both by matrices, or \
             leave this one out: it is then rigid"
        ));
    }
    let analyses = &job.analyses;
    if analyses.sweep.is_some() && analyses.stability.is_none() {
        faults.push("analyses.stability: missing; analyses.sweep computes it at every point, e.g. {}".into());
    }
    if let Some(cycles) = &analyses.cycles {
        faults.extend(crate::job::branches::faults(job, cycles));
    }
    if analyses.names().is_empty() {
        faults.push(
            "analyses: nothing to compute; give \"modes\", or \"modes\" and \"stability\", \
         \"receptance\" or \"transient\""
                .into(),
        );
    }
    if analyses.stability.as_ref().is_some_and(|s| s.state == Some(StabilityState::Steady)) {
        faults.push(
            "analyses.stability.state: found \"steady\", but bodies given by matrices slide at their \
         contact.points; leave it out"
                .into(),
        );
    }
    if analyses.stability.as_ref().is_some_and(|s| s.contact == StabilityContact::Point) {
        faults.push(
            "analyses.stability.contact: found \"point\", which is taken from the pressure on a patch, \
         but bodies given by matrices touch at contact.points; leave it out"
                .into(),
        );
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
            "contact.{key}: has no meaning for bodies given by matrices; contact.points says direction and \
             velocity of each contact"
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
                "contact.points.{i}.gap: has no meaning without contact.normal_load or contact.approach; give \
                 one of them, or leave it out"
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
    if transient.hold == HeldQuantity::Load && contact.normal_load.is_none() {
        faults.push(format!("{path}.hold: \"load\" needs contact.normal_load, which the job does not give"));
    }
    if contact.normal_load.is_none() && contact.approach.is_none() {
        for (i, _) in contact.points.iter().flatten().enumerate().filter(|(_, p)| !p.force.is_some_and(|f| f > 0.0)) {
            faults.push(format!(
                "contact.points.{i}.force: missing; {path} needs contacts that are pressed: give the force of \
                 each, or contact.normal_load or contact.approach"
            ));
        }
    }
}
