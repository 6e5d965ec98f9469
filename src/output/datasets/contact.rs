//! The group `/contact`: steady rolling.

use super::super::Table;
use crate::contact::SteadySolution;
use crate::grid::Interface;

/// The steady state `r` on the interface `s`; with the coefficient of friction where it is `varying`.
pub fn tables(s: &Interface, r: &SteadySolution, varying: bool) -> Vec<Table> {
    let n = s.len();
    let points: Vec<[f64; 2]> = (0..n).map(|i| s.point(i)).collect();
    let list = |name: &str, units: &str, text: &str, values: Vec<f64>| {
        Table::list(&format!("/contact/{name}"), units, text, values)
    };
    let pairs = |name: &str, units: &str, text: &str, values: &[[f64; 2]]| {
        Table::new(&format!("/contact/{name}"), units, text, &[n, 2], values.concat())
    };
    let state: Vec<i8> = r.state.iter().map(|&s| s as i8).collect();
    let mut tables = vec![
        list(
            "x",
            "m",
            "Longitudinal position of the contact nodes; the leading edge is at negative x.",
            points.iter().map(|p| p[0]).collect(),
        ),
        list("y", "m", "Lateral position of the contact nodes.", points.iter().map(|p| p[1]).collect()),
        Table::list(
            "/contact/shape",
            "1",
            "Numbers of grid nodes along x and y; node (i, j) has index i + nx j.",
            s.patches.iter().flat_map(|p| [p.x.len() as i64, p.y.len() as i64]).collect::<Vec<i64>>(),
        ),
        list("weight", "m²", "Area of each contact node: nodal force is pressure times area.", s.weight.clone()),
        list("gap0", "m", "Gap of the undeformed bodies at first touch.", s.gap.clone()),
        list("gap", "m", "Gap of the deformed bodies.", r.gap.clone()),
        list("pressure", "Pa", "Contact pressure.", r.pressure.clone()),
        pairs("traction", "Pa", "Tangential traction (x, y) on body 1.", &r.traction),
        pairs("creep", "m/s", "Creep velocity (x, y) of body 1 relative to body 2.", &r.creep),
        pairs("w", "m", "Tangential displacement difference u1 - u2 (x, y).", &r.w),
        Table::list("/contact/state", "-", "0 open, 1 stick, 2 slip.", state),
        Table::list("/contact/force", "N", "Contact force (x, y, z) on body 1.", r.force.to_vec()),
        Table::scalar(
            "/contact/moment_z",
            "N m",
            "Moment of the tractions on body 1 about the common normal.",
            r.moment_z,
        ),
        Table::list("/contact/centre", "m", "Centre of the pressure (x, y).", r.centre(s).to_vec()),
        Table::scalar(
            "/contact/approach",
            "m",
            "Rigid approach of the bodies from first touch.",
            r.patches[0].approach,
        ),
        Table::scalar("/contact/residual", "1", "Residual of the contact laws, relative.", r.residual),
    ];
    if varying {
        let text = "Coefficient of friction that the material remembers; at open nodes that at rest.";
        tables.push(list("friction", "1", text, r.friction.clone()));
    }
    tables
}

/// Additional tables where the laws hold at points of quadrature: the field H⁻¹R, Pa, `[n][3]`, and the areas under
/// pressure and in stick, m².
pub fn consistent(field: &[[f64; 3]], area: [f64; 2]) -> Vec<Table> {
    let text = "Stress that the nodal forces are the integrals of, by the consistent matrix of the grid: \
     traction x, y on body 1 and pressure.";
    vec![
        Table::new("/contact/field", "Pa", text, &[field.len(), 3], field.concat()),
        Table::list(
            "/contact/area",
            "m²",
            "Area under pressure, and that of it that sticks, by points of quadrature.",
            area.to_vec(),
        ),
    ]
}
