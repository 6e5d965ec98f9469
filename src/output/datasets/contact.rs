//! The group `/contact`: steady rolling.

use super::super::Table;
use crate::contact::SteadySolution;
use crate::grid::Interface;

/// The steady state `r` on the interface `s`; with the coefficient of friction where it is `varying`. Further contacts
/// have groups of their own, `/contact_2` and so on.
pub fn tables(s: &Interface, r: &SteadySolution, varying: bool) -> Vec<Table> {
    (0..s.patches.len()).flat_map(|number| of_patch(s, r, number, varying)).collect()
}

/// The tables of the contact `number`, from 0.
fn of_patch(s: &Interface, r: &SteadySolution, number: usize, varying: bool) -> Vec<Table> {
    let group = if number == 0 { "/contact".to_owned() } else { format!("/contact_{}", number + 1) };
    let (patch, resultant) = (&s.patches[number], &r.patches[number]);
    let nodes = patch.nodes();
    let points: Vec<[f64; 2]> = nodes.clone().map(|i| s.point(i)).collect();
    let name = |name: &str| format!("{group}/{name}");
    let list = |of: &str, units: &str, text: &str, values: &[f64]| Table::list(&name(of), units, text, values.to_vec());
    let at_nodes = |of: &str, units: &str, text: &str, values: &[f64]| list(of, units, text, &values[nodes.clone()]);
    let pairs = |of: &str, units: &str, text: &str, values: &[[f64; 2]]| {
        Table::new(&name(of), units, text, &[nodes.len(), 2], values[nodes.clone()].concat())
    };
    let state: Vec<i8> = r.state[nodes.clone()].iter().map(|&s| s as i8).collect();
    let along = |c: usize| points.iter().map(|p| p[c]).collect::<Vec<f64>>();
    let text = "Longitudinal position of the contact nodes; the leading edge is at negative x.";
    let mut tables = vec![
        list("x", "m", text, &along(0)),
        list("y", "m", "Lateral position of the contact nodes.", &along(1)),
        Table::list(
            &name("shape"),
            "1",
            "Numbers of grid nodes along x and y; node (i, j) has index i + nx j.",
            vec![patch.x.len() as i64, patch.y.len() as i64],
        ),
        at_nodes("weight", "m²", "Area of each contact node: nodal force is pressure times area.", &s.weight),
        at_nodes("gap0", "m", "Gap of the undeformed bodies at first touch.", &s.gap),
        at_nodes("gap", "m", "Gap of the deformed bodies.", &r.gap),
        at_nodes("pressure", "Pa", "Contact pressure.", &r.pressure),
        pairs("traction", "Pa", "Tangential traction (x, y) on body 1.", &r.traction),
        pairs("creep", "m/s", "Creep velocity (x, y) of body 1 relative to body 2.", &r.creep),
        pairs("w", "m", "Tangential displacement difference u1 - u2 (x, y).", &r.w),
        Table::list(&name("state"), "-", "0 open, 1 stick, 2 slip.", state),
        list("force", "N", "Contact force (x, y, z) on body 1.", &resultant.force),
        Table::scalar(
            &name("moment_z"),
            "N m",
            "Moment of the tractions on body 1 about the common normal.",
            resultant.moment_z,
        ),
        list("centre", "m", "Centre of the pressure (x, y).", &r.centre_of(s, number)),
        Table::scalar(&name("approach"), "m", "Rigid approach of the bodies from first touch.", resultant.approach),
        Table::scalar(&name("residual"), "1", "Residual of the contact laws, relative.", r.residual),
    ];
    if varying {
        let text = "Coefficient of friction that the material remembers; at open nodes that at rest.";
        tables.push(at_nodes("friction", "1", text, &r.friction));
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
