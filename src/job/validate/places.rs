//! Rules of a wheel that touches its rail at several places, and of a wheelset that touches both rails.

use super::super::model::*;
use super::super::transient::{BodyName, TransientModel};

/// Distance of the running circles of the built-in wheelset, m, and by how much a job may miss it.
const CIRCLES: f64 = 1.5;
const MISSED: f64 = 5e-3;

/// Adds the faults of a job in what it says of the places of contact and of the wheels.
pub fn check(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    if contact.places == ContactPlaces::One && contact.vertical_load.is_some() {
        faults.push(
            "contact.vertical_load: given with one place of contact; expected contact.places = \"all\", or \
             contact.normal_load for the normal force of one place"
                .into(),
        );
    }
    let keys = [
        ("places", contact.places == ContactPlaces::All, "all"),
        ("wheels", contact.wheels == ContactWheels::Both, "both"),
    ];
    let several: Vec<(&str, &str)> =
        keys.iter().filter(|(_, is, _)| *is).map(|&(key, _, value)| (key, value)).collect();
    let Some(&(key, value)) = several.first() else { return };
    let Some(placement) = &contact.placement else {
        for (key, value) in several {
            faults.push(format!(
                "contact.{key}: found \"{value}\", expected a wheel on a rail by their profiles (contact.placement, \
                 or curve and vehicle); leave it out"
            ));
        }
        return;
    };
    if contact.places == ContactPlaces::All && contact.from.is_none() {
        check_vertical_load(contact, faults);
    }
    if contact.wheels == ContactWheels::Both {
        check_wheelset(job, contact, placement, faults);
    }
    for (name, given) in [("contact", placement.contact.is_some()), ("touch_near", placement.touch_near.is_some())] {
        if given {
            faults.push(format!(
                "contact.placement.{name}: names one place, and contact.{key} = \"{value}\" takes every {} that \
                 carries load; leave one of the two out",
                if key == "places" { "place" } else { "wheel" }
            ));
        }
    }
    check_analyses(job, contact, (key, value), faults);
}

/// Faults of the loads of a wheel at all places of contact, outside of a curve.
fn check_vertical_load(contact: &Contact, faults: &mut Vec<String>) {
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
            "contact.vertical_load: missing; contact.places = \"all\" needs the vertical force on the wheel (N)".into(),
        );
    }
}

/// Faults of a wheelset that touches both rails.
fn check_wheelset(job: &Job, contact: &Contact, placement: &Placement, faults: &mut Vec<String>) {
    let is_wheelset = |body: &Body| match &body.mesh {
        Some(MeshSource::Revolved(revolved)) => revolved.section == Section::W920SWheelset,
        _ => false,
    };
    if !job.bodies.upper.as_ref().is_some_and(is_wheelset) {
        faults.push(
            "bodies.upper.mesh: contact.wheels = \"both\" takes the built-in wheelset, mesh.revolved.section \
             \"W920S-wheelset\", whose two wheels have running lines; give it, or leave contact.wheels out"
                .into(),
        );
    }
    if !job.bodies.lower.as_ref().is_some_and(|body| matches!(body.mesh, Some(MeshSource::Extruded(_)))) {
        faults.push(
            "bodies.lower.mesh: contact.wheels = \"both\" takes a rail swept from its section (mesh.extruded), which \
             stands under either wheel; give it, or leave contact.wheels out"
                .into(),
        );
    }
    if !((placement.circles - CIRCLES).abs() <= MISSED) {
        faults.push(format!(
            "contact.wheels: found running circles {} m apart, expected {CIRCLES} m, the distance of the wheels of \
             \"W920S-wheelset\"; change contact.placement.circles, or vehicle.back_to_back (0.14 m less)",
            placement.circles
        ));
    }
    if contact.vertical_load.is_some() {
        faults.push(
            "contact.vertical_load: is the force on one wheel, and contact.wheels = \"both\" takes a normal force at \
             each contact; expected contact.normal_load or contact.approach of either wheel, or curve and vehicle"
                .into(),
        );
    }
}

/// Faults of what takes one contact, in a job with several by the value of a key.
fn check_analyses(job: &Job, contact: &Contact, (key, value): (&str, &str), faults: &mut Vec<String>) {
    let on_meshes = job.bodies().into_iter().find(|(_, body)| matches!(body.mesh, Some(MeshSource::File(_))));
    if let Some((name, _)) = on_meshes {
        faults.push(format!(
            "bodies.{name}.mesh.file: contact.{key} = \"{value}\" takes bodies swept from sections (mesh.revolved, \
             mesh.extruded), or half-spaces without meshes"
        ));
    }
    if contact.roughness.is_some() {
        faults.push(format!(
            "contact.roughness: has a meaning for one contact; expected contact.{key} = \"one\", or no roughness"
        ));
    }
    let analyses = &job.analyses;
    if let Some(transient) = &analyses.transient {
        let full = transient.model == TransientModel::Full;
        for (name, given) in [("histories", transient.histories.is_some()), ("model \"full\"", full)] {
            if given {
                faults.push(format!(
                    "analyses.transient.{name}: has a meaning for one contact; expected contact.{key} = \"one\", or a \
                     transient on the modes with constant loads and creepages"
                ));
            }
        }
    }
    if contact.wheels == ContactWheels::Both && analyses.cycles.is_some() {
        faults.push(
            "analyses.cycles: the wheelset turns about its axle without stiffness, so that the mean of this motion \
             does not follow from the forces; expected contact.wheels = \"one\" and a wheel whose bore is fixed"
                .into(),
        );
    }
    let heard = [
        ("transient", analyses.transient.as_ref().and_then(|t| t.sound_power.as_ref())),
        ("cycles", analyses.cycles.as_ref().and_then(|c| c.sound_power.as_ref())),
    ];
    for (name, sound) in heard {
        if sound.is_some_and(|s| s.bodies.contains(&BodyName::Lower)) {
            faults.push(format!(
                "analyses.{name}.sound_power.bodies: the sound of a rail is that under one contact; expected \
                 [\"upper\"], the sound of the wheel alone, or contact.{key} = \"one\""
            ));
        }
    }
    let cycles = analyses.sweep.as_ref().is_some_and(|s| s.cycles.is_some());
    let point = analyses.stability.as_ref().is_some_and(|s| s.contact == StabilityContact::Point);
    let full = analyses.stability.as_ref().is_some_and(|s| s.full.is_some());
    for (name, given) in [
        ("analyses.creep_curve", analyses.creep_curve.is_some()),
        ("analyses.sweep.cycles", cycles),
        ("analyses.stability.full", full),
        ("analyses.stability.contact", point),
    ] {
        if given {
            faults.push(format!(
                "{name}: takes one contact; expected contact.{key} = \"one\", or a job with modes, steady, stability \
                 on the reduced model, sweep, uncertainty and transient"
            ));
        }
    }
}
