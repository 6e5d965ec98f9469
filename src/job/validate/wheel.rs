//! Rules of a wheel by its main dimensions.

use super::super::model::{Body, Material, MeshSource, Section, WheelDimensions};

/// Largest Poisson's ratio of a layer: elements of displacements lock beyond.
const POISSON: f64 = 0.49;
/// Smallest distance of two edges of the section, m.
const LEAST: f64 = 0.001;
/// Largest relative difference of the radius of the wheel from that of the placement.
const RADIUS: f64 = 1e-3;
/// Smallest width of the tread, m, that leaves room for a contact away from its edges.
const TREAD: f64 = 0.030;

/// Adds the faults of the wheel at the key `at`, whose contact lies at `offset`, m, the value of `key`.
pub fn check_wheel(at: &str, wheel: &WheelDimensions, (key, offset): (&str, f64), faults: &mut Vec<String>) {
    let [bore, hub, rim, _, _] = wheel.radii();
    for (name, inner, other, outer) in
        [("bore", bore, "hub_diameter", hub), ("hub_diameter", hub, "diameter less twice rim_thickness", rim)]
    {
        if !(inner + LEAST <= outer) {
            faults.push(format!(
                "{at}.{name}: found {} m, expected less than {other}, {:.4} m",
                2.0 * inner,
                2.0 * outer
            ));
        }
    }
    let [field, face, back] = wheel.rim();
    if !(field < 0.0 && 0.0 < face && TREAD <= face - field) {
        faults.push(format!(
            "{at}.rim_width: the tread reaches from {field:.4} to {face:.4} m, expected at least {TREAD} m with the \
             running circle, 0, within; the back of the flange is {back} m from there, and flange_thickness \
             before it ends the tread"
        ));
    } else if !(field < offset && offset < face) {
        faults.push(format!(
            "{key}: found {offset} m, expected a place on the tread, between {field:.4} and {face:.4} m"
        ));
    }
    check_web(at, wheel, faults);
    check_layer(at, wheel, faults);
}

/// Adds the fault of a wheel whose running circle has not the radius of the placement, m.
pub fn check_radius(path: &str, body: &Body, radius: f64, faults: &mut Vec<String>) {
    let Some(MeshSource::Revolved(revolved)) = &body.mesh else { return };
    let Section::Wheel(wheel) = &revolved.section else { return };
    if !((0.5 * wheel.diameter - radius).abs() <= RADIUS * radius) {
        faults.push(format!(
            "{path}.mesh.revolved.section.wheel.diameter: found {} m, expected {} m, twice contact.placement.radius; \
             change either",
            wheel.diameter,
            2.0 * radius
        ));
    }
}

/// Adds the faults of a web that leaves the rim or the hub.
fn check_web(at: &str, wheel: &WheelDimensions, faults: &mut Vec<String>) {
    let [field, face, _] = wheel.rim();
    let [first, last] = wheel.hub();
    let half = 0.5 * wheel.web_thickness;
    let [at_rim, at_hub] = wheel.web_middle();
    // The mesh of the hub follows the web from its place at the rim to that at the hub.
    for (part, middle, low, high) in
        [("rim", at_rim, field, face), ("hub", at_hub, first, last), ("hub", at_rim, first, last)]
    {
        if !(low + LEAST <= middle - half && middle + half + LEAST <= high) {
            faults.push(format!(
                "{at}.web_thickness: the web reaches from {:.4} to {:.4} m along the axle, expected between {low:.4} \
                 and {high:.4} m, within the {part}; change web_position, web_offset or the {part}",
                middle - half,
                middle + half
            ));
            return;
        }
    }
}

/// Adds the faults of the ring of another material.
fn check_layer(at: &str, wheel: &WheelDimensions, faults: &mut Vec<String>) {
    let Some(layer) = &wheel.layer else { return };
    let [_, _, rim, tread, _] = wheel.radii();
    let inner = 0.5 * layer.inner_diameter;
    let outer = inner + layer.thickness;
    if !(rim + LEAST <= inner && outer + LEAST <= tread && LEAST <= layer.thickness) {
        faults.push(format!(
            "{at}.layer: found the ring between the diameters {:.4} and {:.4} m, expected it at least {LEAST} m thick \
             and within the rim, {:.4} to {:.4} m",
            2.0 * inner,
            2.0 * outer,
            2.0 * rim,
            2.0 * tread
        ));
    }
    check_poisson(&format!("{at}.layer"), &layer.material, faults);
}

/// Adds the fault of a layer whose material is nearly incompressible.
pub fn check_poisson(at: &str, material: &Material, faults: &mut Vec<String>) {
    if material.poisson > POISSON {
        faults.push(format!(
            "{at}.material.poisson: found {}, expected at most {POISSON}: elements of displacements are too stiff \
             for what is nearly incompressible; of a ring of blocks that bulge freely give that of the blocks, \
             about 0.45",
            material.poisson
        ));
    }
}

#[cfg(test)]
mod tests {
    use crate::job::Job;
    use std::path::Path;

    const WHEEL: &[u8] = include_bytes!("../../../jobs/resilient-wheel.json");
    const KEY: &str = "bodies.upper.mesh.revolved.section.wheel";

    fn says(key: &str, value: f64) -> String {
        let set = format!("{KEY}.{key}={value}");
        Job::from_bytes(WHEEL, Path::new("job.json"), &[set], None).expect_err("must be refused").to_string()
    }

    #[test]
    fn dimensions_that_do_not_fit_are_refused_by_their_key() {
        assert!(Job::from_bytes(WHEEL, Path::new("job.json"), &[], None).is_ok());
        for (key, value, fault, part) in [
            ("bore", 0.23, "bore", "expected less than hub_diameter, 0.2200 m"),
            ("rim_thickness", 0.23, "hub_diameter", "expected less than diameter less twice rim_thickness"),
            ("rim_width", 0.06, "rim_width", "the tread reaches from 0.0100"),
            ("rim_width", 0.068, "rim_width", "the tread reaches from 0.0020"),
            ("web_thickness", 0.1, "web_thickness", "within the rim"),
            ("hub_length", 0.025, "web_thickness", "within the hub"),
            ("layer.inner_diameter", 0.43, "layer", "within the rim, 0.4400 to 0.6600 m"),
            ("layer.thickness", 0.09, "layer", "found the ring between"),
            ("layer.material.poisson", 0.4999, "layer.material.poisson", "expected at most 0.49"),
            ("diameter", 0.70, "diameter", "expected 0.66 m, twice contact.placement.radius"),
            ("flange_height", 0.02, "flange_height", "0.022"),
        ] {
            let text = says(key, value);
            assert!(text.contains(&format!("{KEY}.{fault}: ")) && text.contains(part), "{key}: {text}");
        }
    }
}
