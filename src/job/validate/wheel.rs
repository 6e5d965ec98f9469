//! Rules of a wheel by a few numbers.

use super::super::model::WheelNumbers;

/// Largest Poisson's ratio of a layer: elements of displacements lock beyond.
const POISSON: f64 = 0.49;

/// Adds the faults of the wheel at the key `at`, whose contact lies at `offset`, m.
pub fn check_wheel(at: &str, wheel: &WheelNumbers, (key, offset): (&str, f64), faults: &mut Vec<String>) {
    let [bore, hub, rim, tread, _] = wheel.radii();
    for (name, inner, other, outer) in
        [("bore", bore, "hub_diameter", hub), ("hub_diameter", hub, "diameter less twice rim_thickness", rim)]
    {
        if !(inner < outer) {
            faults.push(format!("{at}.{name}: found {} m, expected less than {other}, {} m", 2.0 * inner, 2.0 * outer));
        }
    }
    let [field, face, back] = wheel.rim();
    if !(field < 0.0 && 0.0 < face) {
        faults.push(format!(
            "{at}.rim_width: the tread reaches from {field:.4} to {face:.4} m, expected it on both sides of the running circle, 0; the back of the flange is \
             {back} m from there"
        ));
    }
    let half = 0.5 * wheel.web_thickness;
    let [at_rim, at_hub] = wheel.web_middle();
    for (part, middle, low, high) in [
        ("rim", at_rim, field, face),
        ("hub", at_hub, wheel.hub()[0], wheel.hub()[1]),
        ("hub", at_rim, wheel.hub()[0], wheel.hub()[1]),
    ] {
        if !(low < middle - half && middle + half < high) {
            faults.push(format!(
                "{at}.web_thickness: the web reaches from {:.4} to {:.4} m along the axle, expected between {low:.4} and {high:.4} m, within the {part}; change \
                 web_position, web_offset or the {part}",
                middle - half,
                middle + half
            ));
        }
    }
    if !(field < offset && offset < face) {
        faults.push(format!(
            "{key}: found {offset} m, expected a place on the tread, between {field:.4} and {face:.4} m"
        ));
    }
    let Some(layer) = &wheel.layer else { return };
    let inner = 0.5 * layer.inner_diameter;
    if !(rim < inner && inner + layer.thickness < tread) {
        faults.push(format!(
            "{at}.layer: found the ring between the diameters {} and {} m, expected it within the rim, {} to {} m",
            layer.inner_diameter,
            layer.inner_diameter + 2.0 * layer.thickness,
            2.0 * rim,
            2.0 * tread
        ));
    }
    if layer.material.poisson > POISSON {
        faults.push(format!(
            "{at}.layer.material.poisson: found {}, expected at most {POISSON}: elements of displacements are too stiff for what is nearly \
             incompressible; of a ring of blocks that bulge freely give that of the blocks, about 0.45",
            layer.material.poisson
        ));
    }
}
