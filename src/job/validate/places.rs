//! Rules of a wheel that touches its rail at several places, of a wheelset that touches both rails, and of several
//! bodies around one.

use super::super::model::*;
use super::super::transient::TransientModel;
use std::f64::consts::{PI, TAU};

/// By how much a job may miss the distance of the running circles of its wheelset, m.
const MISSED: f64 = 5e-3;

/// Reason why a job has several contacts, and the same job with one, as messages say them.
struct SeveralContacts {
    cause: String,
    without: String,
}

/// Adds the faults of a job in what it says of the places of contact and of the wheels.
pub fn check(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    if contact.places == ContactPlaces::One && contact.vertical_load.is_some() {
        faults.push(
            "contact.vertical_load: given with one place of contact; expected contact.places = \"all\", or \
             contact.normal_load for the normal force of one place"
                .into(),
        );
    }
    check_lateral_force(contact, faults);
    check_axle_load(contact, faults);
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
    let several =
        SeveralContacts { cause: format!("contact.{key} = \"{value}\""), without: format!("contact.{key} = \"one\"") };
    check_analyses(job, contact, &several, faults);
}

/// Adds the faults of the forces on a wheelset.
fn check_axle_load(contact: &Contact, faults: &mut Vec<String>) {
    if contact.axle_load.is_none() {
        if contact.roll_moment != 0.0 {
            faults.push("contact.roll_moment: given without contact.axle_load, beside which it acts".into());
        }
        return;
    }
    if contact.wheels != ContactWheels::Both {
        faults.push(
            "contact.axle_load: is the force on both wheels of a wheelset; expected contact.wheels = \"both\", or \
             contact.normal_load of one wheel"
                .into(),
        );
    }
    for (key, _) in [("normal_load", contact.normal_load), ("approach", contact.approach)]
        .into_iter()
        .filter(|(_, given)| given.is_some())
    {
        faults.push(format!("contact.{key}: given beside contact.axle_load, from which it follows; leave one out"));
    }
}

/// Smallest angle between two bodies around one, rad: nearer ones stand at one place.
const APART: f64 = 1e-3;

/// Adds the faults of a job in what it says of further bodies around the lower one.
pub fn check_around(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    if contact.around.is_empty() {
        return;
    }
    let revolved = |body: &Body| matches!(body.mesh, Some(MeshSource::Revolved(_)));
    let drawn = contact.placement.is_none() && job.all_bodies().iter().all(|(_, body)| revolved(body));
    if !drawn {
        faults.push(
            "contact.around: takes bodies of revolution by their sections (mesh.revolved) that a contact.patch \
             joins, without contact.placement; leave it out"
                .into(),
        );
        return;
    }
    check_names(job, contact, faults);
    let radius = |body: Option<&Body>| body.and_then(Body::running).map_or(0.0, |running| running.radius);
    let radius_at = |contact: &Contact| radius(job.upper_at(contact).map(|(_, body)| body));
    let roller = radius(job.bodies.lower.as_ref());
    let mut placed = vec![("the first contact".to_owned(), 0.0, radius_at(contact))];
    for (i, (one, own)) in contact.around.iter().zip(&contact.further).enumerate() {
        let angle = one.angle;
        if !(angle.is_finite() && angle.abs() <= PI) {
            faults.push(format!("contact.around.{i}.angle: found {angle}, expected an angle from -π to π (rad)"));
            continue;
        }
        let wheel = radius_at(own);
        for (name, other, beside) in &placed {
            // Of the angle between two radii the smaller one.
            let between = (angle - other).rem_euclid(TAU);
            let between = between.min(TAU - between);
            if between < APART {
                faults.push(format!(
                    "contact.around.{i}.angle: found {angle} rad, where {name} is; expected another place"
                ));
            } else if between < least_angle(roller, [*beside, wheel]) {
                let least = least_angle(roller, [*beside, wheel]);
                faults.push(format!(
                    "contact.around.{i}.angle: found {between:.4} rad between it and {name}; expected at least \
                     {least:.4} rad: bodies of {beside} m and {wheel} m radius on one of {roller} m would overlap"
                ));
            }
        }
        placed.push((format!("contact.around.{i}"), angle, wheel));
    }
    let measured = |body: &Body| body.modes.as_ref().is_some_and(|modes| !modes.measured.is_empty());
    for (key, _) in job.all_bodies().into_iter().filter(|(key, body)| key != "lower" && measured(body)) {
        faults.push(format!(
            "bodies.{key}.modes.measured: names modes of one body, and contact.around has several; leave one of the \
             two out"
        ));
    }
    let several = SeveralContacts { cause: "contact.around".into(), without: "a job without contact.around".into() };
    check_analyses(job, contact, &several, faults);
}

/// Smallest angle, rad, between two bodies of the radii `around` on a roller of the radius `roller`, m: their centres
/// are as far apart as the sum of their radii.
fn least_angle(roller: f64, around: [f64; 2]) -> f64 {
    let [a, b] = around.map(|radius| roller + radius);
    let apart = around[0] + around[1];
    ((a * a + b * b - apart * apart) / (2.0 * a * b)).clamp(-1.0, 1.0).acos()
}

/// Faults of the names of bodies that contacts have.
fn check_names(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    let known: Vec<String> = job.bodies.others.keys().cloned().collect();
    for (i, name) in contact.around.iter().enumerate().filter_map(|(i, one)| Some((i, one.body.as_ref()?))) {
        let first = contact.around.iter().position(|one| one.body.as_ref() == Some(name)).filter(|first| *first < i);
        if let Some(first) = first {
            faults.push(format!(
                "contact.around.{i}.body: found {name:?}, which stands at contact.around.{first}; expected another \
                 name: give the body a second time under it"
            ));
        } else if !known.contains(name) {
            let near = super::super::schema::nearest(name, &known).map(|n| format!("; did you mean {n:?}?"));
            faults.push(format!(
                "contact.around.{i}.body: found {name:?}, expected one of bodies.others{}",
                near.unwrap_or_else(|| match known.is_empty() {
                    true => ", which the job does not give".into(),
                    false => format!(": {}", super::super::schema::quoted(&known)),
                })
            ));
        }
    }
}

/// Adds the faults of a job in its further bodies.
pub fn check_others(job: &Job, faults: &mut Vec<String>) {
    let elastic = |body: &Body| body.material.as_ref().map(|m| [m.young, m.poisson]);
    let upper = job.bodies.upper.as_ref().and_then(elastic);
    for (name, body) in &job.bodies.others {
        let letters = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || !name.chars().all(letters) {
            faults.push(format!(
                "bodies.others: found the name {name:?}, expected letters, digits, hyphens and underscores"
            ));
        }
        let around = job.contact.iter().flat_map(|contact| &contact.around);
        if !around.into_iter().any(|one| one.body.as_ref() == Some(name)) {
            faults.push(format!(
                "bodies.others.{name}: touches nothing; expected its name as contact.around.N.body, or leave it out"
            ));
        }
        // The contacts of the bodies on one side share their half-space.
        if let (Some([young, poisson]), Some(expected)) = (elastic(body), upper) {
            if [young, poisson] != expected {
                faults.push(format!(
                    "bodies.others.{name}.material: found young {young:e} Pa and poisson {poisson}, expected {:e} Pa \
                     and {}, those of bodies.upper: bodies around one touch it with surfaces of one stiffness",
                    expected[0], expected[1]
                ));
            }
        }
    }
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

/// Faults of the lateral force on a wheel.
fn check_lateral_force(contact: &Contact, faults: &mut Vec<String>) {
    let Some(force) = contact.lateral_force.filter(|_| contact.from.is_none()) else { return };
    if !force.is_finite() {
        faults.push(format!("contact.lateral_force: found {force}, expected a finite number (N)"));
    }
    if contact.places != ContactPlaces::All || contact.vertical_load.is_none() || contact.placement.is_none() {
        faults.push(
            "contact.lateral_force: expected beside it contact.places = \"all\", contact.vertical_load (N) and \
             contact.placement: the places of the wheel share both forces"
                .into(),
        );
    }
    if let Some(lateral) = contact.placement.as_ref().map(|p| p.lateral).filter(|lateral| *lateral != 0.0) {
        faults.push(format!(
            "contact.placement.lateral: found {lateral} m beside contact.lateral_force, from which the shift of the \
             wheel follows; leave one of the two out"
        ));
    }
}

/// Faults of a wheelset that touches both rails.
fn check_wheelset(job: &Job, contact: &Contact, placement: &Placement, faults: &mut Vec<String>) {
    let middle = match job.bodies.upper.as_ref().and_then(|body| body.mesh.as_ref()) {
        Some(MeshSource::Revolved(revolved)) => revolved.middle(),
        _ => None,
    };
    if middle.is_none() {
        faults.push(
            "bodies.upper.mesh: contact.wheels = \"both\" takes a wheelset of two wheels with running lines, \
             mesh.revolved.section \"W920S-wheelset\" or a file of one half of a wheelset with the key middle; give \
             one, or leave contact.wheels out"
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
    if let Some(circles) = middle.map(|middle| 2.0 * middle).filter(|c| !((placement.circles - c).abs() <= MISSED)) {
        faults.push(format!(
            "contact.wheels: found running circles {} m apart, expected {circles} m, the distance of the wheels of \
             the wheelset; change contact.placement.circles, or vehicle.back_to_back (0.14 m less)",
            placement.circles
        ));
    }
    if contact.vertical_load.is_some() {
        faults.push(
            "contact.vertical_load: is the force on one wheel, and contact.wheels = \"both\" takes that of both; \
             expected contact.axle_load, contact.normal_load or contact.approach of either wheel, or curve and vehicle"
                .into(),
        );
    }
}

/// Faults of what takes one contact, in a job with several.
fn check_analyses(job: &Job, contact: &Contact, several: &SeveralContacts, faults: &mut Vec<String>) {
    let SeveralContacts { cause, without } = several;
    let on_meshes = job.bodies().into_iter().find(|(_, body)| matches!(body.mesh, Some(MeshSource::File(_))));
    if let Some((name, _)) = on_meshes.filter(|_| !contact.around.is_empty()) {
        faults.push(format!(
            "bodies.{name}.mesh.file: {cause} takes bodies swept from sections (mesh.revolved, \
             mesh.extruded), or half-spaces without meshes"
        ));
    }
    let analyses = &job.analyses;
    if analyses.transient.as_ref().is_some_and(|t| t.model == TransientModel::Full) {
        faults.push(format!(
            "analyses.transient.model: found \"full\", which takes one contact; expected {without}, or a transient on \
             the modes"
        ));
    }
}
