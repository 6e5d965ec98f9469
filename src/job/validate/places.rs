//! Rules of a wheel that touches its rail at several places.

use super::super::model::*;
use super::super::transient::TransientModel;

/// Adds the faults of a job in what it says of the places of contact.
pub fn check(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    let in_curve = contact.from.is_some();
    if contact.places == ContactPlaces::One {
        if contact.vertical_load.is_some() {
            faults.push(
                "contact.vertical_load: given with one place of contact; expected contact.places = \"all\", or \
                 contact.normal_load for the normal force of one place"
                    .into(),
            );
        }
        return;
    }
    let Some(placement) = &contact.placement else {
        faults.push(
            "contact.places: found \"all\", expected a wheel on a rail by their profiles (contact.placement, or \
             curve and vehicle); leave it out"
                .into(),
        );
        return;
    };
    if !in_curve {
        for (key, given) in [("normal_load", contact.normal_load.is_some()), ("approach", contact.approach.is_some())] {
            if given {
                faults.push(format!(
                    "contact.{key}: given with contact.places = \"all\"; expected contact.vertical_load (N), the \
                     vertical force on the wheel, which its contacts share"
                ));
            }
        }
        if contact.vertical_load.is_none() {
            faults.push(
                "contact.vertical_load: missing; contact.places = \"all\" needs the vertical force on the wheel (N)"
                    .into(),
            );
        }
    }
    for (key, given) in [("contact", placement.contact.is_some()), ("touch_near", placement.touch_near.is_some())] {
        if given {
            faults.push(format!(
                "contact.placement.{key}: names one place, and contact.places = \"all\" takes every place that \
                 carries load; leave one of the two out"
            ));
        }
    }
    let on_meshes = job.bodies().into_iter().find(|(_, body)| matches!(body.mesh, Some(MeshSource::File(_))));
    if let Some((name, _)) = on_meshes {
        faults.push(format!(
            "bodies.{name}.mesh.file: contact.places = \"all\" takes bodies swept from sections (mesh.revolved, \
             mesh.extruded), or half-spaces without meshes"
        ));
    }
    if contact.roughness.is_some() {
        faults.push(
            "contact.roughness: has a meaning for one contact; expected contact.places = \"one\", or no roughness"
                .into(),
        );
    }
    let analyses = &job.analyses;
    if let Some(transient) = &analyses.transient {
        let full = transient.model == TransientModel::Full;
        for (key, given) in [("histories", transient.histories.is_some()), ("model \"full\"", full)] {
            if given {
                faults.push(format!(
                    "analyses.transient.{key}: has a meaning for one contact; expected contact.places = \"one\", or a \
                     transient on the modes with constant loads and creepages"
                ));
            }
        }
    }
    let cycles = analyses.sweep.as_ref().is_some_and(|s| s.cycles.is_some());
    let point = analyses.stability.as_ref().is_some_and(|s| s.contact == StabilityContact::Point);
    let full = analyses.stability.as_ref().is_some_and(|s| s.full.is_some());
    for (key, given) in [
        ("analyses.creep_curve", analyses.creep_curve.is_some()),
        ("analyses.cycles", analyses.cycles.is_some()),
        ("analyses.sweep.cycles", cycles),
        ("analyses.uncertainty", analyses.uncertainty.is_some()),
        ("analyses.stability.full", full),
        ("analyses.stability.contact", point),
    ] {
        if given {
            faults.push(format!(
                "{key}: takes one contact; expected contact.places = \"one\", or a job with modes, steady, stability \
                 on the reduced model, sweep and transient"
            ));
        }
    }
}
