//! Geometry of cells: Jacobians, volume.

use super::kind::CellKind;
use super::reference::ShapeFunctions;

/// Jacobian ∂x_i/∂ξ_j, m, `[3][3]`, of the cell with nodes at `x` (m, `[nodes][3]`) where its shape functions are
/// `shape`.
pub fn jacobian(x: &[[f64; 3]], shape: &ShapeFunctions) -> [[f64; 3]; 3] {
    let mut j = [[0.0; 3]; 3];
    for (xa, ga) in x.iter().zip(&shape.gradients) {
        for (i, row) in j.iter_mut().enumerate() {
            for (k, e) in row.iter_mut().enumerate() {
                *e += xa[i] * ga[k];
            }
        }
    }
    j
}

/// Determinant of a Jacobian, m³.
pub fn determinant(j: &[[f64; 3]; 3]) -> f64 {
    j[0][0] * (j[1][1] * j[2][2] - j[1][2] * j[2][1]) - j[0][1] * (j[1][0] * j[2][2] - j[1][2] * j[2][0])
        + j[0][2] * (j[1][0] * j[2][1] - j[1][1] * j[2][0])
}

/// Smallest and largest Jacobian determinant of a cell with nodes at `x` (m, `[nodes][3]`), m³: over its nodes, its
/// centre and, but of the eight-node hexahedron, the points of the rule for its stiffness.
pub fn jacobian_range(kind: CellKind, x: &[[f64; 3]]) -> [f64; 2] {
    let shapes = kind.checked_shapes();
    // The Jacobian of a tetrahedron with straight edges is the same everywhere.
    let shapes = if kind.linear() == CellKind::Tet4 && is_straight(kind, x) { &shapes[..1] } else { shapes };
    shapes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], shape| {
        let det = determinant(&jacobian(x, shape));
        // Not a number anywhere, not a number in all.
        [if det < low || det.is_nan() { det } else { low }, high.max(det)]
    })
}

/// Returns whether each node that is no corner lies in the middle of the corners around it, to rounding.
fn is_straight(kind: CellKind, x: &[[f64; 3]]) -> bool {
    kind.between().zip(&x[kind.corners()..]).all(|(around, node)| {
        (0..3).all(|c| {
            let sum =
                |f: fn(f64) -> f64| around.iter().map(|&i| f(x[i as usize][c])).sum::<f64>() / around.len() as f64;
            (node[c] - sum(|v| v)).abs() <= 4.0 * f64::EPSILON * sum(f64::abs)
        })
    })
}

/// Node of a cell with nodes at `x` (m, `[nodes][3]`) where its Jacobian determinant is smallest: where to look if it
/// is inverted.
pub fn worst_node(kind: CellKind, x: &[[f64; 3]]) -> usize {
    let det = |i: usize| determinant(&jacobian(x, &kind.checked_shapes()[i]));
    (0..kind.nodes()).min_by(|&a, &b| det(a).total_cmp(&det(b))).unwrap_or(0)
}

/// Volume of a cell with nodes at `x` (m, `[nodes][3]`), m³.
pub fn volume(kind: CellKind, x: &[[f64; 3]]) -> f64 {
    kind.volume_rule().iter().map(|p| p.weight * determinant(&jacobian(x, &p.shape))).sum()
}
