//! The group `/curving`: a vehicle in a curve.

use super::super::Table;
use crate::curving::{ContactForce, CurvingProblem, CurvingSolution, WHEELS};
use crate::Error;

/// Numbers of one place of contact, in the order of a table's columns.
type Numbers = fn(&ContactForce) -> Vec<f64>;

/// The tables of places of contact: name, unit, columns, description, numbers.
const PLACES: [(&str, &str, usize, &str, Numbers); 12] = [
    ("wheel_y", "m", 1, "Position on the profile of the wheel, to the field side of the running circle.", |c| {
        vec![c.place.wheel]
    }),
    ("rail_y", "m", 1, "Position on the profile of the rail after its cant, to the field side.", |c| {
        vec![c.place.rail]
    }),
    ("position", "m", 2, "Position ahead of the axle, and to the right of the middle of the track.", |c| {
        vec![c.place.arm[0], c.place.across]
    }),
    ("contact_angle", "rad", 1, "Contact angle, positive where the rail falls to the right.", |c| vec![c.place.angle]),
    ("rolling_radius", "m", 1, "Rolling radius.", |c| vec![c.place.radius]),
    ("normal_force", "N", 1, "Normal force.", |c| vec![c.normal]),
    ("half_axes", "m", 2, "Half-axes of Hertz' ellipse along and across the track.", |c| c.half_axes.to_vec()),
    ("friction", "1", 1, "Coefficient of friction at the creep velocity.", |c| vec![c.friction]),
    ("creepage", "1, 1, 1/m", 3, "Longitudinal creepage, lateral creepage and spin, of rail over wheel.", |c| {
        c.creepage.to_vec()
    }),
    (
        "creep_force",
        "N",
        2,
        "Tangential force on the wheel: forwards, and to the right along the rail's tangent.",
        |c| vec![c.longitudinal, c.tangential],
    ),
    ("force", "N", 3, "Force on the wheel: forwards, to the right, and down.", |c| {
        vec![c.longitudinal, c.lateral(), c.vertical()]
    }),
    ("utilisation", "1", 1, "Tangential force over the bound of friction.", |c| vec![c.utilisation()]),
];

/// The equilibrium of the job's own curve.
pub fn tables(problem: &CurvingProblem, solution: &CurvingSolution) -> Vec<Table> {
    let (curve, bogie) = (&problem.curve, &problem.bogie);
    let scalar = |name: &str, units: &str, text: &str, value: f64| {
        Table::scalar(&format!("/curving/{name}"), units, text, value)
    };
    let mut tables = vec![
        scalar("curvature", "1/m", "Curvature of the track, positive to the right.", curve.curvature),
        scalar("speed", "m/s", "Speed along the track.", curve.speed),
        scalar("wheelbase", "m", "Distance of the axles.", 2.0 * bogie.half_wheelbase),
        scalar("circles", "m", "Distance of the running circles.", 2.0 * bogie.half_circles),
        scalar("axle_load", "N", "Load of an axle on the rails.", bogie.axle_load),
        scalar(
            "residual",
            "1",
            "Largest force or moment left, over the load of an axle, or that times a radius.",
            solution.residual,
        ),
        Table::list(
            "/curving/frame",
            "m, rad",
            "Shift and yaw of the frame in the middle of the wheelbase, to the right.",
            solution.frame.to_vec(),
        ),
    ];
    let axles = |name: &str, units: &str, text: &str, of: &dyn Fn(usize) -> Vec<f64>| {
        let rows = [of(0), of(1)];
        let shape = if rows[0].len() == 1 { vec![2] } else { vec![2, rows[0].len()] };
        Table::new(&format!("/curving/axles/{name}"), units, text, &shape, rows.concat())
    };
    let axle = |k: usize| &solution.axles[k];
    tables.extend([
        axles("shift", "m", "Shift of the leading and of the trailing axle to the right.", &|k| {
            vec![axle(k).motion.lateral]
        }),
        axles("yaw", "rad", "Yaw of the axles against the track there (angle of attack), to the right.", &|k| {
            vec![axle(k).motion.yaw]
        }),
        axles("roll", "rad", "Roll of the axles, positive where the right-hand wheel is lower.", &|k| {
            vec![axle(k).motion.roll]
        }),
        axles("angular_speed", "rad/s", "Angular speed of the axles.", &|k| vec![axle(k).angular_speed]),
        axles("suspension", "N, N m", "Lateral force and yaw moment of the suspension on the axles.", &|k| {
            axle(k).suspension.to_vec()
        }),
    ]);
    let places: Vec<(usize, &ContactForce)> = WHEELS
        .iter()
        .enumerate()
        .flat_map(|(k, &wheel)| solution.wheel(problem, wheel).iter().map(move |c| (k, c)))
        .collect();
    let numbers: Vec<i64> = places.iter().map(|(k, _)| *k as i64).collect();
    tables.push(Table::list(
        "/curving/contacts/wheel",
        "-",
        "Wheel of each place of contact: 0 leading inner, 1 leading outer, 2 trailing inner, 3 trailing outer.",
        numbers,
    ));
    for (name, units, columns, text, of) in PLACES {
        let values: Vec<f64> = places.iter().flat_map(|(_, c)| of(c)).collect();
        let shape = if columns == 1 { vec![places.len()] } else { vec![places.len(), columns] };
        tables.push(Table::new(&format!("/curving/contacts/{name}"), units, text, &shape, values));
    }
    tables
}

/// Equilibria at other radii: the place of each wheel that carries most. Radii that failed have NaN and say why.
pub fn tables_of_radii(all: &[(f64, CurvingProblem, crate::Result<CurvingSolution>)]) -> Vec<Table> {
    if all.is_empty() {
        return Vec::new();
    }
    let k = all.len();
    let message = |e: &Error| e.message().to_string();
    let messages: Vec<String> = all.iter().map(|(_, _, s)| s.as_ref().err().map(message).unwrap_or_default()).collect();
    let axles = |of: fn(&CurvingSolution) -> [f64; 2]| -> Vec<f64> {
        all.iter().flat_map(|(_, _, s)| s.as_ref().map_or([f64::NAN; 2], of)).collect()
    };
    let mut tables = vec![
        Table::list("/curving/radii/radius", "m", "Radius of each curve.", all.iter().map(|r| r.0).collect::<Vec<_>>()),
        Table::list(
            "/curving/radii/message",
            "-",
            "Reason why a curve has no equilibrium; empty where it has one.",
            messages,
        ),
        Table::new(
            "/curving/radii/shift",
            "m",
            "Shift of the leading and of the trailing axle to the right.",
            &[k, 2],
            axles(|s| [0, 1].map(|k| s.axles[k].motion.lateral)),
        ),
        Table::new(
            "/curving/radii/yaw",
            "rad",
            "Yaw of the axles against the track (angle of attack), to the right.",
            &[k, 2],
            axles(|s| [0, 1].map(|k| s.axles[k].motion.yaw)),
        ),
    ];
    for (name, units, columns, text, of) in PLACES {
        let row = |problem: &CurvingProblem, solution: &crate::Result<CurvingSolution>, wheel: usize| {
            let places = solution.as_ref().map_or(&[][..], |s| s.wheel(problem, WHEELS[wheel]));
            let heaviest = places.iter().max_by(|a, b| a.normal.total_cmp(&b.normal));
            heaviest.map_or(vec![f64::NAN; columns], of)
        };
        let values: Vec<f64> =
            all.iter().flat_map(|(_, p, s)| (0..WHEELS.len()).flat_map(|w| row(p, s, w)).collect::<Vec<_>>()).collect();
        let shape = if columns == 1 { vec![k, WHEELS.len()] } else { vec![k, WHEELS.len(), columns] };
        let text = format!(
            "{text} Of the place of contact of each wheel that carries most; wheels as in /curving/contacts/wheel."
        );
        tables.push(Table::new(&format!("/curving/radii/{name}"), units, &text, &shape, values));
    }
    let loaded = |problem: &CurvingProblem, solution: &crate::Result<CurvingSolution>, wheel: usize| {
        solution.as_ref().map_or(0, |s| s.wheel(problem, WHEELS[wheel]).len() as i64)
    };
    let counts: Vec<i64> =
        all.iter().flat_map(|(_, p, s)| (0..WHEELS.len()).map(|w| loaded(p, s, w)).collect::<Vec<_>>()).collect();
    tables.push(Table::new(
        "/curving/radii/places",
        "1",
        "Number of places of contact of each wheel.",
        &[k, WHEELS.len()],
        counts,
    ));
    tables
}
