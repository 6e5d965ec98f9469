//! Rules of a wheel on a rail by their profiles.

use super::super::model::*;

/// Adds the faults of a job with profiles or a placement.
pub fn check(job: &Job, faults: &mut Vec<String>) {
    let placement = job.contact.as_ref().and_then(|c| c.placement.as_ref());
    for (name, body) in job.bodies() {
        let path = format!("bodies.{name}");
        match (&body.profile, placement) {
            (None, Some(_)) => faults.push(format!(
                "{path}.profile: missing; contact.placement needs that of \
             the wheel (upper) and of the rail (lower), e.g. \"S1002\" or \"60E1\""
            )),
            (Some(_), None) => faults.push(format!(
                "{path}.profile: given without contact.placement, which says \
             where the wheel is; give both or none"
            )),
            (Some(_), Some(placement)) => {
                check_mesh(&path, body, faults);
                super::wheel::check_radius(&path, body, placement.radius, faults);
            }
            _ => {}
        }
        match (&body.profile, name) {
            (Some(Profile::S1002), "lower") => faults
                .push(format!("{path}.profile: found \"S1002\", a wheel; the rail is the lower body, e.g. \"60E1\"")),
            (Some(profile), "upper") if profile.rail().is_some() || *profile == Profile::Uic60 => faults.push(format!(
                "{path}.profile: found the profile of a rail; the wheel is the upper body, e.g. \"S1002\""
            )),
            (Some(Profile::File(file)), _) if file.path.as_os_str().is_empty() => {
                faults.push(format!("{path}.profile.file.path: the file name is empty"))
            }
            _ => {}
        }
        if body.is_half_space() {
            for (key, given) in [("damping", body.damping != Damping::default()), ("fixed", !body.fixed.is_empty())] {
                if given {
                    faults.push(format!("{path}.{key}: a half-space has none; leave it out"));
                }
            }
        }
    }
    let (Some(contact), Some(placement)) = (&job.contact, placement) else { return };
    let moves = job.bodies().iter().any(|(_, b)| b.mesh.is_some());
    match (moves, contact.compliance) {
        (true, Compliance::Hybrid) | (false, Compliance::HalfSpace) => {}
        (true, Compliance::Fe) => {
            let swept = |b: &Body| b.mesh.is_some() && !b.is_meshed();
            if let Some((name, _)) = job.bodies().into_iter().find(|(_, b)| swept(b)) {
                faults.push(format!(
                    "contact.compliance: found \"fe\", but bodies.{name} is swept from a section; expected \
                     \"hybrid\", or a mesh of three dimensions (mesh.file)"
                ));
            } else if placement.loaded {
                faults.push(
                    "contact.compliance: found \"fe\" with contact.placement.loaded = true: what bodies give \
                     way by as a whole is then no part of the contact, and \
                     elements do not tell it from what yields at the contact; expected contact.placement.loaded \
                     = false, for a position without load, or \"hybrid\""
                        .into(),
                );
            }
        }
        (true, Compliance::HalfSpace) => faults.push(
            "contact.compliance: expected \"hybrid\", or \"fe\" with mesh files, with bodies that have a mesh \
             on a contact.placement"
                .into(),
        ),
        (false, _) => faults
            .push("contact.compliance: expected \"half_space\" with contact.placement of bodies without meshes".into()),
    }
    if contact.grid.is_some() {
        faults.push(
            "contact.grid: given beside contact.placement, whose grid follows from the profiles; leave it out".into(),
        );
    }
    if contact.patch.is_some() {
        faults.push(
            "contact.patch: given beside contact.placement, whose grid follows from the profiles; leave it out".into(),
        );
    }
    if contact.creepage != Creepage::default() {
        faults.push(
            "contact.creepage: given beside contact.placement, from which creepages follow; give those \
         that are to be others in contact.placement.creepage"
                .into(),
        );
    }
    if placement.contact.is_some() && (placement.lateral != 0.0 || placement.roll != 0.0) {
        faults.push(
            "contact.placement.contact: given beside lateral or roll, which follow from it; leave one of the two out"
                .into(),
        );
    }
    if job.analyses.modes.is_some() && !moves {
        faults.push(
            "analyses.modes: bodies given by their profiles alone are half-spaces, which have no modes; leave it out"
                .into(),
        );
    }
}

/// Adds the faults of the mesh of a body with a profile.
fn check_mesh(path: &str, body: &Body, faults: &mut Vec<String>) {
    match &body.mesh {
        None => {}
        Some(MeshSource::Revolved(revolved)) => {
            if revolved.contact_offset != 0.0 {
                faults.push(format!(
                    "{path}.mesh.revolved.contact_offset: given beside contact.placement, from which the place \
                     of the contact follows; leave it out"
                ));
            }
            if matches!(revolved.section, Section::Cylinder(_)) {
                faults.push(format!(
                    "{path}.mesh.revolved.section: expected that of a wheel with a profile: \
                 \"W920S\", wheel or a file"
                ));
            }
            if path.ends_with("lower") {
                faults.push(format!("{path}.mesh.revolved: a rail does not turn; the wheel is the upper body"));
            }
        }
        Some(MeshSource::Extruded(extruded)) => {
            if extruded.contact_offset != 0.0 {
                faults.push(format!(
                    "{path}.mesh.extruded.contact_offset: given beside contact.placement, from which the place \
                     of the contact follows; leave it out"
                ));
            }
            if path.ends_with("upper") {
                faults.push(format!("{path}.mesh.extruded: the wheel is the upper body, and a rail the lower one"));
            }
        }
        Some(MeshSource::File(_)) if body.axle_distance.is_some() => faults.push(format!(
            "{path}.axle_distance: given beside contact.placement, from whose radius it follows; leave it out"
        )),
        Some(MeshSource::File(_)) => {}
        Some(MeshSource::Cylinder(_)) => faults.push(format!(
            "{path}.mesh.cylinder: given beside {path}.profile; a wheel on a rail by their profiles has mesh \
             files, is swept from sections (mesh.revolved, \
             mesh.extruded), or is of half-spaces without meshes"
        )),
    }
}
