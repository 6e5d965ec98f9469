//! Rules of a torque on the axle, from which its angular speed follows.

use super::super::model::*;

/// Adds the faults of a job in what it says of the torque.
pub fn check(job: &Job, faults: &mut Vec<String>) {
    let Some((contact, torque)) = job.contact.as_ref().and_then(|contact| Some((contact, contact.torque?))) else {
        return;
    };
    if !torque.is_finite() {
        faults.push(format!("contact.torque: found {torque}, expected a finite number (N m)"));
    }
    let Some(placement) = &contact.placement else {
        faults.push(
            "contact.torque: expected beside it a wheel on a rail by their profiles (contact.placement, or curve and \
             vehicle); leave it out"
                .into(),
        );
        return;
    };
    let histories = job.analyses.transient.as_ref().and_then(|t| t.histories.as_ref());
    let beside = [
        ("contact.placement.angular_speed", placement.angular_speed.is_some()),
        ("contact.placement.creepage.longitudinal", placement.creepage.longitudinal.is_some()),
        ("contact.lateral_force", contact.lateral_force.is_some()),
        ("analyses.creep_curve", job.analyses.creep_curve.is_some()),
        ("analyses.cycles", job.analyses.cycles.is_some()),
        ("analyses.transient.histories.longitudinal", histories.is_some_and(|h| h.longitudinal.is_some())),
        (
            "analyses.transient.histories.further",
            histories.is_some_and(|h| h.further.iter().any(|of| of.longitudinal.is_some())),
        ),
    ];
    for (key, _) in beside.into_iter().filter(|(_, given)| *given) {
        faults.push(format!(
            "contact.torque: given beside {key}, which takes an angular speed that is known; leave one of the two out"
        ));
    }
    if contact.compliance == Compliance::Fe || contact.quadrature == Quadrature::Consistent {
        faults.push(
            "contact.torque: takes steady rolling at the nodes of a grid of half-spaces or hybrid bodies; expected \
             contact.compliance \"hybrid\" or \"half_space\" and contact.quadrature \"nodal\""
                .into(),
        );
    }
    let is_wheelset = match job.bodies.upper.as_ref().and_then(|body| body.mesh.as_ref()) {
        Some(MeshSource::Revolved(revolved)) => revolved.middle().is_some(),
        _ => false,
    };
    if contact.wheels != ContactWheels::Both && (is_wheelset || contact.from.is_some()) {
        faults.push(
            "contact.torque: is that of an axle, whose creep forces are those of both wheels; expected contact.wheels \
             = \"both\", or leave it out"
                .into(),
        );
    }
    let (Some(from), Some(vehicle)) = (contact.from, &job.vehicle) else { return };
    let [leading, _] = from.wheel.place();
    let expected = vehicle.data().torque[usize::from(!leading)];
    if torque != expected {
        faults.push(format!(
            "contact.torque: found {torque} N m, but vehicle.torque gives this axle {expected} N m; give both the same"
        ));
    }
}
