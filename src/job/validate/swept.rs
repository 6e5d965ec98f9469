//! Rules between the keys of bodies swept from a section.

use super::super::model::*;
use super::{check_groups, check_ring};

/// Most lines of the contact grid on either side of the contact point.
const MOST_LINES: f64 = 500.0;

const RING_GROUPS: [&str; 4] = ["inner", "outer", "side_minus", "side_plus"];

const WHEELSET_GROUPS: [&str; 2] = ["seats", "journals"];

/// Adds the faults of the primary suspension of a body.
pub fn check_suspension(path: &str, body: &Body, faults: &mut Vec<String>) {
    let Some(suspension) = &body.suspension else { return };
    let section = match &body.mesh {
        Some(MeshSource::Revolved(Revolved { section, .. })) => section,
        _ => {
            return faults.push(format!(
                "{path}.suspension: only for a wheelset that is swept from a section (mesh.revolved); give a body with \
                 a mesh file bodies.*.supports"
            ))
        }
    };
    let journals = suspension.journals.as_deref();
    match (section, journals) {
        (Section::W920SWheelset, _) | (Section::File(_), Some(_)) => {}
        (Section::File(_), None) => faults.push(format!(
            "{path}.suspension.journals: missing; a drawing does not say where the bearings are, e.g. [-1.0, 1.0] (m)"
        )),
        _ => faults.push(format!(
            "{path}.suspension: the section has no axle; expected \"W920S-wheelset\" or a file with a solid axle"
        )),
    }
    if let Some(places) = journals {
        let apart = places.iter().enumerate().all(|(i, y)| y.is_finite() && !places[..i].contains(y));
        if places.len() < 2 || !apart {
            faults.push(format!(
                "{path}.suspension.journals: found {places:?}, expected two different places at least (m); one bearing \
                 does not hold a wheelset"
            ));
        }
    }
    if !body.fixed.is_empty() || !body.supports.is_empty() {
        faults.push(format!(
            "{path}.suspension: given beside fixed or supports; a wheelset on its suspension is held by its bearings \
             alone, leave one of the two out"
        ));
    }
}

/// Adds the faults of a swept body.
pub fn check_body(path: &str, body: &Body, revolved: &Revolved, faults: &mut Vec<String>) {
    let key = format!("{path}.mesh.revolved.contact_offset");
    match &revolved.section {
        Section::Cylinder(ring) => {
            check_ring(
                &format!("{path}.mesh.revolved.section.cylinder"),
                ring,
                (&key, revolved.contact_offset),
                faults,
            );
            check_groups(path, body, "the section", &RING_GROUPS, faults);
        }
        Section::W920S | Section::W920SWheelset => {
            let set = revolved.section == Section::W920SWheelset;
            if !(revolved.running().room > 0.0) {
                faults.push(format!(
                    "{key}: found {} m, expected a place on the tread of W920S, between -0.065 and 0.040 m",
                    revolved.contact_offset
                ));
            }
            let (what, groups) =
                if set { ("W920S-wheelset", &WHEELSET_GROUPS[..]) } else { ("W920S", &RING_GROUPS[..1]) };
            check_groups(path, body, what, groups, faults);
        }
        Section::Wheel(wheel) => {
            let at = format!("{path}.mesh.revolved.section.wheel");
            super::wheel::check_wheel(&at, wheel, (&key, revolved.contact_offset), faults);
            check_groups(path, body, "the wheel", &["bore"], faults);
        }
        // Its groups are found when it is read.
        Section::File(file) => {
            let at = format!("{path}.mesh.revolved.section.file");
            if file.path.as_os_str().is_empty() {
                faults.push(format!("{at}.path: found \"\", expected the path of a plane mesh"));
            }
            for (i, layer) in file.layers.iter().enumerate() {
                let at = format!("{at}.layers.{i}");
                super::wheel::check_poisson(&at, &layer.material, faults);
                if layer.group.trim().is_empty() {
                    faults.push(format!("{at}.group: found \"\", expected the name of a physical surface of the file"));
                } else if file.layers[..i].iter().any(|other| other.group == layer.group) {
                    faults.push(format!("{at}.group: the physical surface {:?} is given twice", layer.group));
                }
            }
            let running = |group: &String| *group == file.running;
            if let Some(i) = body.fixed.iter().position(running) {
                faults.push(format!(
                    "{path}.fixed.{i}: {:?} is the running line, which cannot be clamped; fix another group",
                    file.running
                ));
            }
            if let Some(i) = body.supports.iter().position(|s| running(&s.group)) {
                faults.push(format!(
                    "{path}.supports.{i}.group: {:?} is the running line, which cannot be supported; take \
                     another group",
                    file.running
                ));
            }
        }
    }
    if let Some(i) = body.supports.iter().position(|s| s.group == "outer") {
        faults.push(format!(
            "{path}.supports.{i}.group: \"outer\" is the running line, which cannot be supported; take another group"
        ));
    }
    if body.fixed.iter().any(|g| g == "outer") {
        faults.push(format!("{path}.fixed: \"outer\" is the running line, which cannot be clamped; fix another group"));
    }
}

/// Adds the faults of a contact with swept bodies, or of one that asks for them.
pub fn check_contact(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    let swept: Vec<(String, Running)> = job
        .all_bodies()
        .into_iter()
        .filter(|(_, b)| matches!(b.mesh, Some(MeshSource::Revolved(_) | MeshSource::Extruded(_))))
        .filter_map(|(name, b)| Some((name, b.running()?)))
        .collect();
    if contact.placement.is_some() {
        // Its rules are with the profiles.
        return;
    }
    let hybrid = contact.compliance == Compliance::Hybrid;
    let spacing = contact.patch.and_then(|p| p.spacing);
    if swept.len() < job.all_bodies().len() {
        if !swept.is_empty() {
            faults.push(
                "bodies: one is swept (mesh.revolved, mesh.extruded), the other is not; without \
             contact.placement sweep both bodies or none"
                    .into(),
            );
        }
        if spacing.is_some() {
            faults.push(
                "contact.patch.spacing: only between swept bodies; others have the nodes of their elements".into(),
            );
        }
        return;
    }
    if swept.is_empty() {
        return;
    }
    if !hybrid {
        faults.push(
            "contact.compliance: expected \"hybrid\" with bodies that are swept (mesh.revolved, mesh.extruded)".into(),
        );
    }
    let Some(patch) = contact.patch else {
        faults.push(
            "contact.patch: missing; swept bodies need it, e.g. {\"half_length\": 0.007, \
         \"half_width\": 0.007, \"spacing\": 0.001} (m)"
                .into(),
        );
        return;
    };
    let lower = job.bodies.lower.as_ref().map(|body| ("lower".to_owned(), body));
    let running = |(name, body): (String, &Body)| body.running().map(|running| (format!("bodies.{name}"), running));
    let lower = lower.and_then(running);
    let upper = |contact: &Contact| job.upper_at(contact).and_then(running);
    check_spacing("contact.patch", patch, faults);
    lower.iter().chain(&upper(contact)).for_each(|body| check_room("contact.patch", patch, body, faults));
    for (i, (own, one)) in contact.around.iter().zip(&contact.further).enumerate() {
        let path = format!("contact.around.{i}.patch");
        match own.patch {
            Some(patch) => {
                check_spacing(&path, patch, faults);
                lower.iter().chain(&upper(one)).for_each(|body| check_room(&path, patch, body, faults));
            }
            // The lower body is that of the first contact.
            None if own.body.is_some() => {
                upper(one).iter().for_each(|body| check_room("contact.patch", patch, body, faults));
            }
            None => {}
        }
    }
}

/// Adds the faults of the lines of the `patch` given by the key `path`.
fn check_spacing(path: &str, patch: Patch, faults: &mut Vec<String>) {
    match patch.spacing {
        None => faults.push(format!(
            "{path}.spacing: missing; swept bodies need the distance of the nodes of the contact grid, e.g. 0.001 (m)"
        )),
        Some(h) => {
            for (key, half) in [("half_length", patch.half_length), ("half_width", patch.half_width)] {
                if half < 2.0 * h {
                    faults
                        .push(format!("{path}.{key}: found {half} m, expected at least twice {path}.spacing ({h} m)"));
                }
                if half > MOST_LINES * h {
                    faults.push(format!(
                        "{path}.spacing: found {h:e} m, expected at least {} m, {path}.{key} / {MOST_LINES}",
                        half / MOST_LINES
                    ));
                }
            }
        }
    }
}

/// Adds the faults of the `patch` given by the key `path` where a body with its name has no room for it.
fn check_room(path: &str, patch: Patch, (name, running): &(String, Running), faults: &mut Vec<String>) {
    if patch.half_length >= 0.5 * running.radius {
        faults.push(format!(
            "{path}.half_length: found {} m, expected less than half the rolling radius of {name} ({} m)",
            patch.half_length,
            0.5 * running.radius
        ));
    }
    if patch.half_width > running.room {
        faults.push(format!(
            "{path}.half_width: found {} m, expected at most {:.6} m, the distance from the contact point of \
             {name} to the nearer edge of its running surface",
            patch.half_width, running.room
        ));
    }
}
