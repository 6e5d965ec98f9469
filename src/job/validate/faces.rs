//! Rules of a disc that turns between pads that do not (`contacts`).

use super::super::model::*;
use super::super::transient::{StartState, Transient, TransientModel};
use super::analyses::{check_cycles, check_transient, check_uncertainty};
use std::f64::consts::TAU;

/// Part of a cell by which cells beside each other may overlap by rounding.
const ROUNDING: f64 = 1e-9;

/// Adds the faults of a job with `contacts`.
pub fn check(job: &Job, faults: &mut Vec<String>) {
    if let (Some(disc), Some(pads)) = (&job.bodies.lower, &job.bodies.upper) {
        check_disc(disc, faults);
        check_pads(job, pads, faults);
    }
    for (i, contact) in job.contacts.iter().enumerate() {
        check_cells(&job.contacts[..i], i, contact, faults);
    }
    check_analyses(job, faults);
}

/// Adds the faults of the disc.
fn check_disc(disc: &Body, faults: &mut Vec<String>) {
    let path = "bodies.lower";
    let section = match &disc.mesh {
        Some(MeshSource::Revolved(revolved)) => &revolved.section,
        _ => {
            return faults.push(format!(
                "{path}.mesh: expected a body of revolution by its section (mesh.revolved), on whose faces pads lie; \
                 of a disc by matrices the contacts do not turn past the pads: give such a job contact.points"
            ))
        }
    };
    if !matches!(section, Section::Cylinder(_) | Section::File(_)) {
        faults.push(format!(
            "{path}.mesh.revolved.section: found a wheel, which has no faces for pads; expected \"cylinder\" or a \
             \"file\" whose physical curves are the faces"
        ));
    }
    match disc.rotation {
        Some(Rotation::Speed(speed)) if speed != 0.0 => {}
        _ => faults.push(format!(
            "{path}.rotation: expected the angular velocity of the disc, not 0 (rad/s), as a number; the pads slide \
             by it"
        )),
    }
    if disc.suspension.is_some() {
        faults.push(format!("{path}.suspension: only for a wheelset on its rails; clamp the disc (fixed)"));
    } else if !disc.is_held() {
        faults.push(format!(
            "{path}.fixed: nothing holds the disc against the pads; clamp its bore, e.g. [\"inner\"], or give it \
             supports"
        ));
    }
    if disc.modes.is_some() {
        faults.push(format!("{path}.modes: measured modes are not for a disc between pads so far; leave them out"));
    }
}

/// Adds the faults of the pads.
fn check_pads(job: &Job, pads: &Body, faults: &mut Vec<String>) {
    let path = "bodies.upper";
    let Some(matrices) = &pads.matrices else {
        return check_meshed_pads(job, pads, faults);
    };
    for (i, contact) in job.contacts.iter().enumerate() {
        if contact.pad_face.is_some() {
            faults
                .push(format!("contacts.{i}.pad_face: for pads by a mesh; pads by matrices have nodes; leave it out"));
        }
        for (k, _) in contact.cells.iter().enumerate().filter(|(_, cell)| cell.node.is_none()) {
            faults.push(format!("contacts.{i}.cells.{k}.node: missing; expected the node of the pads that presses it"));
        }
    }
    if !matrices.contacts.is_empty() {
        faults.push(format!(
            "{path}.matrices.contacts: given beside the key contacts of the job, from whose cells they follow (node, \
             angle and face); leave them out"
        ));
    }
    if pads.modes.is_some() {
        faults.push(format!("{path}.modes: measured modes are not for pads by matrices; leave them out"));
    }
}

/// Adds the faults of pads by a mesh.
fn check_meshed_pads(job: &Job, pads: &Body, faults: &mut Vec<String>) {
    let path = "bodies.upper";
    if !matches!(pads.mesh, Some(MeshSource::File(_))) {
        faults.push(format!(
            "{path}: expected pads by the matrices of another program (matrices) or by the file of a mesh (mesh.file)"
        ));
    }
    if pads.profile.is_some() {
        faults.push(format!("{path}.profile: only for a wheel or a rail; leave it out"));
    }
    if pads.rotates() {
        faults.push(format!("{path}.rotation: pads do not turn; leave it out"));
    }
    if pads.modes.is_some() {
        faults.push(format!("{path}.modes: measured modes are not for pads so far; leave them out"));
    }
    if !pads.is_held() {
        faults.push(format!(
            "{path}.supports: nothing holds the pads; give the groups of their backs springs, or clamp them (fixed)"
        ));
    }
    for (i, contact) in job.contacts.iter().enumerate() {
        if contact.pad_face.as_ref().is_none_or(|group| group.trim().is_empty()) {
            faults.push(format!(
                "contacts.{i}.pad_face: missing; expected the group of the mesh of the pads that lies on this face"
            ));
        }
        for (k, _) in contact.cells.iter().enumerate().filter(|(_, cell)| cell.node.is_some()) {
            faults.push(format!("contacts.{i}.cells.{k}.node: for pads by matrices; leave it out"));
        }
    }
}

/// Adds the faults of the cells and the friction of the contact `number`, which comes after those `before`.
fn check_cells(before: &[FaceContact], number: usize, contact: &FaceContact, faults: &mut Vec<String>) {
    let path = format!("contacts.{number}");
    faults.extend(contact.friction.fault(&format!("{path}.friction")));
    if contact.cells.is_empty() {
        faults.push(format!("{path}.cells: the list is empty; give at least one cell of the face"));
    }
    let on_face = |other: &&FaceContact| other.face == contact.face;
    for (i, cell) in contact.cells.iter().enumerate() {
        let path = format!("{path}.cells.{i}");
        if !(cell.angle.abs() <= TAU) {
            faults.push(format!("{path}.angle: found {}, expected an angle from -2π to 2π (rad)", cell.angle));
        }
        if let Some(c) = (0..2).find(|&c| !(cell.half[c] > 0.0)) {
            faults.push(format!("{path}.half.{c}: found {} m, expected more than 0", cell.half[c]));
        }
        if !(cell.half[0] < 0.5 * cell.radius) {
            faults.push(format!(
                "{path}.half.0: found {} m, expected less than half the radius ({} m)",
                cell.half[0], cell.radius
            ));
        }
        let earlier = || before.iter().flat_map(|other| &other.cells).chain(&contact.cells[..i]);
        if let Some(node) = cell.node.filter(|_| earlier().any(|other| other.node == cell.node)) {
            faults.push(format!("{path}.node: found {node} twice, expected a node of its own for each cell"));
        }
        let beside = before.iter().filter(on_face).flat_map(|other| &other.cells).chain(&contact.cells[..i]);
        if beside.into_iter().any(|other| overlap(cell, other)) {
            faults.push(format!(
                "{path}: overlaps an earlier cell of the face \"{}\"; expected cells beside each other",
                contact.face
            ));
        }
    }
}

/// Returns whether two cells of a face overlap.
fn overlap(one: &ContactCell, other: &ContactCell) -> bool {
    let apart = (one.angle - other.angle).rem_euclid(TAU);
    let apart = apart.min(TAU - apart);
    let across = (one.radius - other.radius).abs();
    // Along the circle through the outer ends of the inner sides, where they are nearest.
    let along = 2.0 * one.radius.min(other.radius) * (0.5 * apart).sin();
    let both = [0, 1].map(|c| (one.half[c] + other.half[c]) * (1.0 - ROUNDING));
    across < both[1] && along < both[0] && apart < 0.25 * TAU
}

/// Adds the faults of what the steps in time do not do for a disc between pads.
fn check_steps(transient: &Transient, faults: &mut Vec<String>) {
    let path = "analyses.transient";
    let not_so_far = [
        (
            "model",
            transient.model == TransientModel::Full,
            "the full system does not carry a disc past its pads so far",
        ),
        ("start.state", transient.start.state == Some(StartState::Steady), "pads slide everywhere (\"sliding\")"),
        ("body_stride", transient.body_stride > 0, "pads have no fields"),
        ("points", !transient.points.is_empty(), "pads have no fields"),
        ("sound_power", transient.sound_power.is_some(), "the sound of a brake is not computed so far"),
    ];
    for (key, _, why) in not_so_far.into_iter().filter(|(_, is, _)| *is) {
        faults.push(format!("{path}.{key}: not for the contacts of a disc with pads: {why}; leave it out"));
    }
    let histories = transient.histories.as_ref().map(|histories| histories.all()).unwrap_or_default();
    for (path, of) in histories {
        let moved = [("approach", of.approach), ("longitudinal", of.longitudinal), ("lateral", of.lateral)];
        for (key, _) in moved.into_iter().chain([("spin", of.spin)]).filter(|(_, table)| table.is_some()) {
            faults.push(format!(
                "{path}.{key}: a pad is pressed by a force and slides by the rotation of the disc; expected normal_load"
            ));
        }
    }
}

/// Analyses of a disc between pads.
const COMPUTED: [&str; 6] = ["modes", "stability", "transient", "receptance", "sweep", "uncertainty"];

/// Adds the faults of the analyses: what is computed of a disc between pads, and what is not so far.
fn check_analyses(job: &Job, faults: &mut Vec<String>) {
    let analyses = &job.analyses;
    for name in analyses.names().into_iter().filter(|name| !COMPUTED.contains(name)) {
        faults.push(format!(
            "analyses.{name}: not for the contacts of a disc with pads so far, for which there are {}; leave it out",
            COMPUTED.join(", ")
        ));
    }
    if analyses.names().is_empty() {
        faults.push("analyses: nothing to compute; give \"modes\", or \"modes\" and \"stability\"".into());
    }
    if let Some(Err(fault)) = analyses.receptance.as_ref().map(|receptance| receptance.frequency.numbers()) {
        faults.push(format!("analyses.receptance.frequency: {fault}"));
    }
    let followed = [
        ("sweep", analyses.sweep.as_ref().and_then(|sweep| sweep.cycles.as_ref()?.sound_power.as_ref())),
        ("uncertainty", analyses.uncertainty.as_ref().and_then(|wanted| wanted.cycles.as_ref()?.sound_power.as_ref())),
    ];
    for (name, _) in followed.into_iter().filter(|(_, sound)| sound.is_some()) {
        faults.push(format!(
            "analyses.{name}.cycles.sound_power: not for the contacts of a disc with pads: the sound of a brake is not \
             computed so far; leave it out"
        ));
    }
    if let Some(transient) = &analyses.transient {
        check_transient(job, transient, ("analyses.transient", faults));
        check_steps(transient, faults);
    }
    if let Some(wanted) = &analyses.uncertainty {
        check_uncertainty(job, wanted, faults);
    }
    match &analyses.modes {
        Some(modes) if modes.count.is_some() == modes.max_frequency.is_some() => {
            faults.push("analyses.modes: give exactly one of count and max_frequency (Hz)".into());
        }
        None => faults.extend(analyses.on_contact().first().map(|name| {
            format!("analyses.modes: missing; analyses.{name} is computed on the modes, e.g. {{\"count\": 60}}")
        })),
        _ => {}
    }
    if let Some(sweep) = &analyses.sweep {
        if analyses.stability.is_none() {
            faults.push("analyses.stability: missing; analyses.sweep computes it at every point, e.g. {}".into());
        }
        check_cycles(job, sweep, faults);
    }
    let Some(stability) = &analyses.stability else { return };
    let of_a_patch = [
        ("full", stability.full.is_some(), "the full system does not carry a disc past its pads so far"),
        ("state", stability.state == Some(StabilityState::Steady), "pads slide everywhere (\"sliding\")"),
        ("contact", stability.contact == StabilityContact::Point, "a pad is no point on Hertz' spring"),
    ];
    for (key, _, why) in of_a_patch.into_iter().filter(|(_, is, _)| *is) {
        faults.push(format!("analyses.stability.{key}: not for the contacts of a disc with pads: {why}; leave it out"));
    }
}
