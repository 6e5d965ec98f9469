//! Rules of friction and of the zones of the rails that have one of their own.

use super::super::model::*;
use crate::friction::ZoneRail;
use std::f64::consts::FRAC_PI_2;

/// Adds the faults of a job in what it says of friction.
pub fn check(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    faults.extend(contact.friction.fault("contact.friction"));
    for (i, one) in contact.around.iter().enumerate() {
        faults.extend(one.friction.as_ref().and_then(|law| law.fault(&format!("contact.around.{i}.friction"))));
    }
    if !contact.friction_zones.is_empty() && contact.placement.is_none() {
        faults.push(
            "contact.friction_zones: zones lie on the rails of a track; expected a wheel on a rail by their profiles \
             (contact.placement, or curve and vehicle); leave it out"
                .into(),
        );
    }
    for (i, zone) in contact.friction_zones.iter().enumerate() {
        let path = format!("contact.friction_zones.{i}");
        faults.extend(zone.friction.fault(&format!("{path}.friction")));
        if let Some(angle) = zone.from_angle.filter(|angle| !(angle.abs() < FRAC_PI_2)) {
            faults.push(format!("{path}.from_angle: found {angle}, expected a contact angle between -π/2 and π/2 rad"));
        }
        if zone.rail.is_none() && zone.from_angle.is_none() {
            faults.push(format!(
                "{path}: gives neither rail nor from_angle, so that it holds every contact; expected one of the two, \
                 or its friction as contact.friction"
            ));
        }
        let straight = job.curve.is_none() && contact.placement.as_ref().is_some_and(|p| p.curvature == 0.0);
        if let Some(rail) = zone.rail.filter(|rail| rail.is_in_a_curve() && straight) {
            let found = if rail == ZoneRail::Inner { "inner" } else { "outer" };
            faults.push(format!(
                "{path}.rail: found \"{found}\", but the track is straight; expected \"left\" or \"right\", or a curve \
                 (contact.placement.curvature, or curve and vehicle)"
            ));
        }
    }
}
