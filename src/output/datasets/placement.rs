//! The group `/placement`: a wheel on a rail by their profiles.

use super::super::Table;

/// Result of placing a wheel.
pub struct PlacementResult {
    /// Places of first touch on the profiles of wheel and rail, m.
    pub touch: [f64; 2],
    /// Origin of the frame of the contact in the track, m.
    pub origin: [f64; 3],
    /// Contact angle at first touch and of the frame, rad.
    pub angles: [f64; 2],
    /// Rolling radius, m.
    pub radius: f64,
    /// Second derivatives of the gap, 1/m.
    pub curvatures: [[f64; 2]; 2],
    /// Semi-axes of Hertz' ellipse, m.
    pub semi_axes: [f64; 2],
    /// ξ, η (1) and φ (1/m).
    pub creepages: [f64; 3],
    /// V, m/s.
    pub speed: f64,
    /// Number of the zone of friction that holds the contact, in a job with zones: −1 outside all.
    pub friction_zone: Option<i32>,
    /// Lateral shift of the wheel, m, where it follows from a lateral force.
    pub lateral_shift: Option<f64>,
    /// Lines of rail and wheel, m.
    pub lines: [Vec<[f64; 2]>; 2],
}

/// The tables of what was `found` of the contact `number`, from 0: further contacts have groups of their own,
/// `/placement_2` and so on.
pub fn tables(number: usize, found: &PlacementResult) -> Vec<Table> {
    let group = if number == 0 { "/placement".to_owned() } else { format!("/placement_{}", number + 1) };
    let scalar =
        |name: &str, units: &str, text: &str, value: f64| Table::scalar(&format!("{group}/{name}"), units, text, value);
    let list = |name: &str, units: &str, text: &str, values: &[f64]| {
        Table::list(&format!("{group}/{name}"), units, text, values.to_vec())
    };
    let mut tables = vec![
        scalar(
            "wheel_y",
            "m",
            "First touch on the profile of the wheel, to the field side of the running circle.",
            found.touch[0],
        ),
        scalar(
            "rail_y",
            "m",
            "First touch on the profile of the rail after its cant, to the field side.",
            found.touch[1],
        ),
        list(
            "origin",
            "m",
            "Origin of the frame of the contact in the track: x forwards, y to the right, z down.",
            &found.origin,
        ),
        scalar(
            "contact_angle",
            "rad",
            "Contact angle at first touch, positive where the rail falls to the right.",
            found.angles[0],
        ),
        scalar("tilt", "rad", "Angle of the frame of the contact.", found.angles[1]),
        scalar("rolling_radius", "m", "Rolling radius at first touch.", found.radius),
        Table::new(
            &format!("{group}/curvatures"),
            "1/m",
            "Second derivatives of the gap at first touch along x and y of the frame.",
            &[2, 2],
            found.curvatures.concat(),
        ),
        list("semi_axes", "m", "Semi-axes of Hertz' ellipse, that nearer to x first.", &found.semi_axes),
        list(
            "creepage",
            "1, 1, 1/m",
            "Longitudinal creepage, lateral creepage and spin, of rail over wheel.",
            &found.creepages,
        ),
        scalar(
            "speed",
            "m/s",
            "Rolling speed: the mean of those with which both materials pass the contact.",
            found.speed,
        ),
    ];
    if let Some(zone) = found.friction_zone {
        let text = "Number of the zone of contact.friction_zones that holds the contact, from 0; -1 outside all.";
        tables.push(Table::scalar(&format!("{group}/friction_zone"), "1", text, zone));
    }
    if let Some(shift) = found.lateral_shift {
        let text = "Lateral shift of the wheel, positive to the right, that follows from contact.lateral_force.";
        tables.push(scalar("lateral_shift", "m", text, shift));
    }
    for (name, line) in ["rail_line", "wheel_line"].into_iter().zip(&found.lines) {
        let text = "Points (y, z) of the line at first touch, in the track: y to the right, z down.";
        tables.push(Table::new(&format!("{group}/{name}"), "m", text, &[line.len(), 2], line.concat()));
    }
    tables
}
