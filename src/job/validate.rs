//! Rules between keys, which the schema cannot express.

use super::model::*;

mod absorber;
mod analyses;
mod curving;
mod faces;
mod friction;
mod matrices;
mod measured;
mod placement;
mod places;
mod quadrature;
mod rail;
mod roughness;
mod support;
mod swept;
mod torque;
mod wheel;

use analyses::{check_analyses, check_uncertainty};

/// All faults of a job that fits the schema, with the names that it gives its bodies; empty if it makes sense.
pub fn validate(job: &Job) -> Vec<String> {
    faults_of(job).into_iter().map(|fault| job.bodies.with_names(fault)).collect()
}

fn faults_of(job: &Job) -> Vec<String> {
    let mut faults = Vec::new();
    if job.bodies().is_empty() {
        faults.push("bodies: give at least one of \"lower\" and \"upper\"".into());
    }
    for (name, body) in job.all_bodies() {
        check_body(&format!("bodies.{name}"), body, &mut faults);
    }
    check_rotating(job, &mut faults);
    if job.is_disc_with_pads() {
        faces::check(job, &mut faults);
        return faults;
    }
    rail::check_modes(job, &mut faults);
    rail::check_sleepers(job, &mut faults);
    rail::check_track_decay(job, &mut faults);
    curving::check(job, &mut faults);
    if let Some(wanted) = &job.analyses.uncertainty {
        check_uncertainty(job, wanted, &mut faults);
    }
    job.all_bodies()
        .into_iter()
        .for_each(|(name, body)| measured::check(&format!("bodies.{name}"), body, job, &mut faults));
    places::check_others(job, &mut faults);
    quadrature::check(job, &mut faults);
    torque::check(job, &mut faults);
    if job.by_matrices() {
        matrices::check(job, &mut faults);
        roughness::check(job, &mut faults);
        return faults;
    }
    if let Some(contact) = &job.contact {
        check_contact(job, contact, &mut faults);
    }
    placement::check(job, &mut faults);
    roughness::check(job, &mut faults);
    check_analyses(job, &mut faults);
    faults
}

const CYLINDER_GROUPS: [&str; 5] = ["inner", "outer", "contact", "side_minus", "side_plus"];

fn check_body(path: &str, body: &Body, faults: &mut Vec<String>) {
    for (i, group) in body.fixed.iter().enumerate() {
        if group.trim().is_empty() {
            faults.push(format!("{path}.fixed.{i}: the group name is empty"));
        } else if body.fixed[..i].contains(group) {
            faults.push(format!("{path}.fixed.{i}: the group \"{group}\" is given twice"));
        } else if group == "contact" {
            faults.push(format!("{path}.fixed.{i}: the contact surface cannot be clamped; fix another group"));
        }
    }
    check_rotation(path, body, faults);
    support::check(path, body, faults);
    absorber::check(path, body, faults);
    if body.track.is_some() && !matches!(body.mesh, Some(MeshSource::Extruded(_))) {
        faults.push(format!("{path}.track: only for a rail, a body with mesh.extruded; leave it out"));
    }
    if let Some(matrices) = &body.matrices {
        return matrices::check_body(path, body, matrices, faults);
    }
    if body.material.is_none() {
        faults.push(format!("{path}.material: missing; expected an object"));
    }
    check_damping(&format!("{path}.damping"), &body.damping, faults);
    let known = body.rotates() || matches!(body.mesh, Some(MeshSource::Revolved(_)));
    if matches!(body.damping.modal, Some(ModalDamping::ByDiameter(_))) && !known {
        faults.push(format!(
            "{path}.damping.modal.by_diameter: the nodal diameters are known of bodies with \
         mesh.revolved and of bodies that rotate; give by_frequency"
        ));
    }
    swept::check_suspension(path, body, faults);
    match &body.mesh {
        None if body.profile.is_some() => {}
        None => faults.push(format!("{path}.mesh: missing; a body has a mesh and a material, or matrices")),
        Some(MeshSource::Cylinder(c)) => {
            check_cylinder(&format!("{path}.mesh.cylinder"), c, faults);
            check_groups(path, body, "the cylinder", &CYLINDER_GROUPS, faults);
        }
        Some(MeshSource::Revolved(r)) => swept::check_body(path, body, r, faults),
        Some(MeshSource::Extruded(e)) => rail::check_body(path, body, e, faults),
        Some(MeshSource::File(file)) if file.path().as_os_str().is_empty() => {
            faults.push(format!("{path}.mesh.file: the file name is empty"));
        }
        Some(MeshSource::File(file)) => check_transform(path, file, faults),
    }
}

/// Faults of the steps that bring a mesh to its place.
fn check_transform(path: &str, file: &MeshFile, faults: &mut Vec<String>) {
    for (i, step) in file.transform().iter().enumerate() {
        if matches!(step, Motion::Rotate(turn) if turn.axis.iter().all(|&a| a == 0.0)) {
            faults.push(format!("{path}.mesh.file.transform.{i}.rotate.axis: found 0, 0, 0; expected a direction"));
        }
    }
}

/// Faults of supports that are not among the `groups` of the built-in body `what`.
fn check_groups(path: &str, body: &Body, what: &str, groups: &[&str], faults: &mut Vec<String>) {
    let fixed = body.fixed.iter().enumerate().map(|(i, g)| (format!("fixed.{i}"), g));
    let supported = body.supports.iter().enumerate().map(|(i, s)| (format!("supports.{i}.group"), &s.group));
    for (key, group) in fixed.chain(supported).filter(|(_, g)| !groups.contains(&g.as_str())) {
        let names: Vec<String> = groups.iter().map(|g| g.to_string()).collect();
        let near = super::schema::nearest(group, &names).map(|n| format!("; did you mean \"{n}\"?"));
        faults.push(format!(
            "{path}.{key}: {what} has no group \"{group}\"{} Its groups are {}",
            near.unwrap_or_else(|| ".".into()),
            super::schema::quoted(&names)
        ));
    }
}

fn check_rotation(path: &str, body: &Body, faults: &mut Vec<String>) {
    let file = matches!(body.mesh, Some(MeshSource::File(_)));
    if body.axle_distance.is_some() && !file {
        faults.push(format!("{path}.axle_distance: only for a body with a mesh file; leave it out"));
    }
    if !body.rotates() {
        return;
    }
    if matches!(body.mesh, Some(MeshSource::Extruded(_))) {
        return faults.push(format!("{path}.rotation: a rail does not turn; expected \"none\", or leave it out"));
    }
    // Of one with a profile the placement says where it is.
    if file && body.axle_distance.is_none() && body.profile.is_none() {
        faults.push(format!(
            "{path}.axle_distance: missing; a mesh file does not say where the axle is, and \
         {path}.rotation needs it (m)"
        ));
    }
    if let Some(Rotation::Speed(speed)) = body.rotation {
        if !speed.is_finite() {
            faults.push(format!("{path}.rotation: found {speed}, expected a finite angular velocity (rad/s)"));
        }
    }
}

/// Checks the keys that rotation requires, and those that exclude it.
fn check_rotating(job: &Job, faults: &mut Vec<String>) {
    for (name, body) in job.all_bodies().into_iter().filter(|(_, b)| b.rotates()) {
        let path = format!("bodies.{name}.rotation");
        if job.analyses.modes.is_none() {
            faults.push(format!("analyses.modes: missing; {path} acts on the modes, e.g. {{\"count\": 60}}"));
        }
        if body.rotation == Some(Rotation::Named(RotationName::Rolling)) && job.contact.is_none() {
            faults.push(format!(
                "{path}: \"rolling\" takes the speed of contact, which is missing; give an angular velocity (rad/s)"
            ));
        }
    }
}

fn check_damping(path: &str, damping: &Damping, faults: &mut Vec<String>) {
    let Some(modal) = &damping.modal else { return };
    if damping.alpha != 0.0 || damping.beta != 0.0 {
        faults.push(format!(
            "{path}: both modal and Rayleigh damping (alpha, beta) are given; loss factors take the place of \
             Rayleigh's damping, give one of the two"
        ));
    }
    match modal {
        ModalDamping::ByMode(factors) if factors.is_empty() => {
            faults.push(format!("{path}.modal.by_mode: the list is empty; give at least one loss factor"));
        }
        ModalDamping::ByFrequency(bands) if bands.is_empty() => {
            faults.push(format!("{path}.modal.by_frequency: the list is empty; give at least one band"));
        }
        ModalDamping::ByDiameter(factors) if factors.is_empty() => {
            faults.push(format!("{path}.modal.by_diameter: the list is empty; give at least one loss factor"));
        }
        ModalDamping::ByMode(_) | ModalDamping::ByDiameter(_) => {}
        ModalDamping::ByFrequency(bands) => {
            for (i, pair) in bands.windows(2).enumerate() {
                match (pair[0].up_to, pair[1].up_to) {
                    (None, _) => faults.push(format!(
                        "{path}.modal.by_frequency.{i}.up_to: missing; only the last band may do without (Hz)"
                    )),
                    (Some(a), Some(b)) if b <= a => faults.push(format!(
                        "{path}.modal.by_frequency.{}.up_to: found {b} Hz, expected more than {a} Hz, the end \
                         of the band before",
                        i + 1
                    )),
                    _ => {}
                }
            }
        }
    }
}

/// Returns whether the dimensions of a ring fit together; `offset` is the key of the contact's distance from its
/// mid-plane and that, m.
fn check_ring(path: &str, c: &Ring, (key, offset): (&str, f64), faults: &mut Vec<String>) -> bool {
    if c.inner_radius >= c.outer_radius {
        faults.push(format!(
            "{path}.inner_radius: found {} m, expected less than outer_radius ({} m)",
            c.inner_radius, c.outer_radius
        ));
        return false;
    }
    let half = 0.5 * c.thickness;
    if offset.abs() >= half {
        faults.push(format!("{key}: found {offset} m, expected less than half the thickness ({half} m) in magnitude"));
        return false;
    }
    if let Some(crown) = c.crown_radius {
        let reach = half + offset.abs();
        if crown <= reach {
            faults.push(format!(
                "{path}.crown_radius: found {crown} m, expected more than {reach} m, the distance from the apex \
                 of the crown to the farther side"
            ));
        } else {
            let drop = crown - (crown * crown - reach * reach).sqrt();
            if drop >= c.outer_radius - c.inner_radius {
                faults.push(format!(
                    "{path}.crown_radius: the crown falls by {drop:.4} m at the side, through the ring of {:.4} \
                     m; use a larger radius",
                    c.outer_radius - c.inner_radius
                ));
            }
        }
    }
    true
}

fn check_cylinder(path: &str, c: &Cylinder, faults: &mut Vec<String>) {
    let Cylinder { inner_radius, outer_radius, thickness, crown_radius, contact_offset, .. } = *c;
    let ring = Ring { inner_radius, outer_radius, thickness, crown_radius };
    if !check_ring(path, &ring, (&format!("{path}.contact_offset"), contact_offset), faults) {
        return;
    }
    let smallest = c.thickness.min(c.outer_radius - c.inner_radius);
    if c.element_size > smallest {
        faults.push(format!(
            "{path}.element_size: found {} m, expected at most {smallest} m, the smallest dimension of the ring",
            c.element_size
        ));
    }
    if let Some(largest) = c.max_element_size.filter(|l| *l < c.element_size) {
        faults.push(format!(
            "{path}.max_element_size: found {largest} m, expected at least element_size ({} m)",
            c.element_size
        ));
    }
}

fn check_contact(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    if contact.speed == 0.0 {
        faults.push("contact.speed: missing; expected a number > 0 (m/s)".into());
    }
    for (name, body) in [("lower", &job.bodies.lower), ("upper", &job.bodies.upper)] {
        if body.is_none() {
            faults.push(format!("bodies.{name}: missing; contact needs both bodies"));
        }
    }
    friction::check(job, contact, faults);
    match (contact.normal_load, contact.approach) {
        (Some(_), Some(_)) => {
            faults.push("contact: both normal_load and approach are given; give exactly one of them".into());
        }
        (None, None) if contact.vertical_load.is_none() && contact.axle_load.is_none() => {
            faults.push("contact: give exactly one of normal_load (N) and approach (m)".into());
        }
        _ => {}
    }
    places::check(job, contact, faults);
    places::check_around(job, contact, faults);
    let cylinders: Vec<(&str, &Cylinder)> = job
        .bodies()
        .into_iter()
        .filter_map(|(name, b)| match &b.mesh {
            Some(MeshSource::Cylinder(c)) => Some((name, c)),
            _ => None,
        })
        .collect();
    if contact.compliance == Compliance::HalfSpace
        && contact.placement.is_none()
        && cylinders.len() < job.bodies().len()
    {
        faults.push(
            "contact.compliance: \"half_space\" takes the gap from the radii of built-in cylinders; a body has \
             a mesh file"
                .into(),
        );
    }
    let common = contact.grid.is_some() || contact.compliance == Compliance::Hybrid;
    if let [(_, a), (_, b)] = cylinders[..] {
        if !common && a.element_size != b.element_size {
            faults.push(format!(
                "bodies.upper.mesh.cylinder.element_size: found {} m, expected {} m as in bodies.lower, or \
                 contact.grid, on which meshes meet that differ",
                b.element_size, a.element_size
            ));
        }
    }
    swept::check_contact(job, contact, faults);
    check_grid(job, contact, faults);
    if contact.points.is_some() {
        faults.push(
            "contact.points: only for bodies given by matrices; bodies with meshes touch on their surfaces".into(),
        );
    }
    if contact.patch.is_some()
        && cylinders.is_empty()
        && !job.is_swept()
        && contact.placement.is_none()
        && !job.bodies().is_empty()
    {
        faults.push(
            "contact.patch: given, but both bodies have mesh files, whose group \"contact\" is the patch; leave it out"
                .into(),
        );
    }
    let Some(patch) = contact.patch else {
        if !cylinders.is_empty() {
            faults.push(
                "contact.patch: missing; a built-in cylinder needs it, e.g. {\"half_length\": 0.007, \
             \"half_width\": 0.007} (m)"
                    .into(),
            );
        }
        return;
    };
    for (name, c) in cylinders {
        if patch.half_length >= 0.5 * c.outer_radius {
            faults.push(format!(
                "contact.patch.half_length: found {} m, expected less than half the outer radius of \
                 bodies.{name} ({} m)",
                patch.half_length,
                0.5 * c.outer_radius
            ));
        }
        let room = 0.5 * c.thickness - c.contact_offset.abs();
        if patch.half_width > room {
            faults.push(format!(
                "contact.patch.half_width: found {} m, expected at most {room:.6} m, the distance from the \
                 contact point of bodies.{name} to its nearer side",
                patch.half_width
            ));
        }
        for (key, half) in [("half_length", patch.half_length), ("half_width", patch.half_width)] {
            if half < 2.0 * c.element_size {
                faults.push(format!(
                    "contact.patch.{key}: found {half} m, expected at least two elements of bodies.{name} ({} m)",
                    2.0 * c.element_size
                ));
            }
        }
    }
}

/// Most nodes of a common grid in a row.
pub const MOST_NODES: f64 = 400.0;

fn check_grid(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    let Some(grid) = &contact.grid else { return };
    if contact.placement.is_some() {
        // Its rules are with the profiles.
        return;
    }
    if contact.compliance == Compliance::HalfSpace || job.bodies().iter().any(|(_, b)| !b.is_meshed()) {
        faults.push(
            "contact.grid: only between two meshes of three dimensions (mesh.file, mesh.cylinder) with \
         the compliance \"fe\" or \"hybrid\"; leave it out"
                .into(),
        );
    }
    for (key, half) in [("half_length", grid.half_length), ("half_width", grid.half_width)] {
        let (Some(half), Some(spacing)) = (half, grid.spacing) else { continue };
        if !(2.0 * spacing..=0.5 * MOST_NODES * spacing).contains(&half) {
            faults.push(format!(
                "contact.grid.{key}: found {half} m, expected from {} to {} m, 2 to {} times contact.grid.spacing",
                2.0 * spacing,
                0.5 * MOST_NODES * spacing,
                0.5 * MOST_NODES
            ));
        }
    }
    if let Some(curvatures) = grid.curvatures.filter(|c| c.iter().any(|v| !(*v > 0.0))) {
        faults.push(format!(
            "contact.grid.curvatures: found {curvatures:?}, expected two above 0 (1/m): sums over both bodies, \
             positive of bodies that are round outwards"
        ));
    }
}
