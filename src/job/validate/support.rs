//! Rules of supports.

use super::super::model::*;

/// Adds the faults of the supports of a body.
pub fn check(path: &str, body: &Body, faults: &mut Vec<String>) {
    for (i, support) in body.supports.iter().enumerate() {
        check_one(&format!("{path}.supports.{i}"), support, faults);
    }
    let swept = matches!(body.mesh, Some(MeshSource::Revolved(_)));
    if !swept && !body.is_meshed() && !body.supports.is_empty() {
        return faults.push(format!(
            "{path}.supports: only for a body with mesh.file, mesh.cylinder or mesh.revolved; leave it out"
        ));
    }
    if !swept && !body.rotates() {
        return;
    }
    let why = if swept { "the body is swept".to_string() } else { format!("{path}.rotation turns the body") };
    for (i, support) in body.supports.iter().enumerate() {
        let [x, _, z, _] = support.springs();
        let uneven = (x - z).abs() / x.max(z).max(f64::MIN_POSITIVE);
        let found = match () {
            _ if support.mass.is_some() => "a mass".to_string(),
            _ if support.damps() => "damping".to_string(),
            _ if !support.clamped.is_empty() || support.symmetry => "single components clamped".to_string(),
            _ if uneven > 1e-12 => format!("stiffnesses along x and z that differ by {uneven:.3} of the larger one"),
            _ => continue,
        };
        faults.push(format!(
            "{path}.supports.{i}: found {found}, but {why}; expected springs that are of revolution about its \
             axle, with stiffness.x = stiffness.z{}",
            if swept { "" } else { ", or rotation \"none\"" }
        ));
    }
}

fn check_one(path: &str, support: &Support, faults: &mut Vec<String>) {
    if support.group.trim().is_empty() {
        faults.push(format!("{path}.group: the group name is empty"));
    }
    if support.group == "contact" {
        faults.push(format!("{path}.group: the contact surface cannot be supported; take another group"));
    }
    let given = support.holds() || support.damps() || support.mass.is_some() || support.absorbing.is_some();
    if !given {
        faults.push(format!(
            "{path}: nothing is given for the group \"{}\"; expected one of clamped, symmetry, stiffness, \
             damping, mass, absorbing",
            support.group
        ));
    }
    for (k, component) in support.clamped.iter().enumerate() {
        if support.clamped[..k].contains(component) {
            faults.push(format!("{path}.clamped.{k}: the component is given twice"));
        }
    }
    match (support.loss_factor, support.loss_frequency) {
        (Some(_), None) => faults.push(format!(
            "{path}.loss_frequency: missing; the loss factor is taken as viscous damping, which it equals at \
             one frequency (Hz)"
        )),
        (None, Some(_)) => faults.push(format!("{path}.loss_factor: missing; loss_frequency belongs to it")),
        (Some(_), Some(_)) if support.stiffness.is_none() => {
            faults.push(format!("{path}.stiffness: missing; loss_factor is that of springs"));
        }
        _ => {}
    }
}
