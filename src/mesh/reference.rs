//! Reference cells: shape functions, and rules of quadrature.

use super::kind::{CellKind, MAX_NODES};
use std::sync::LazyLock;

/// Corners of the reference hexahedron [-1, 1]³.
pub const HEX_CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Shape functions of a cell at a point of its reference cell.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Their values; the first `kind.nodes()` count.
    pub values: [f64; MAX_NODES],
    /// Their derivatives with respect to the reference coordinates.
    pub gradients: [[f64; 3]; MAX_NODES],
}

/// A point of a rule of quadrature.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Reference coordinates.
    pub at: [f64; 3],
    /// Weight.
    pub weight: f64,
}

impl CellKind {
    /// Shape functions at the reference point `at`.
    pub fn shape(self, at: [f64; 3]) -> Shape {
        match self {
            CellKind::Hex8 => hex8(at),
        }
    }

    /// Nodes of the reference cell, `[nodes][3]`.
    pub fn reference_nodes(self) -> &'static [[f64; 3]] {
        match self {
            CellKind::Hex8 => &HEX_CORNERS,
        }
    }

    /// Centre of the reference cell.
    pub fn centre(self) -> [f64; 3] {
        [0.0; 3]
    }

    /// The rule for stiffness and volume: exact for the stiffness of a cell whose faces are parallel.
    pub fn stiffness_rule(self) -> &'static [Point] {
        match self {
            CellKind::Hex8 => &GAUSS_2,
        }
    }

    /// The rule for the mass: exact for products of two shape functions where the Jacobian is constant.
    pub fn mass_rule(self) -> &'static [Point] {
        match self {
            CellKind::Hex8 => &GAUSS_3,
        }
    }
}

/// Gauss's rule of 2 × 2 × 2 points, in the order of the corners.
static GAUSS_2: LazyLock<Vec<Point>> = LazyLock::new(|| {
    let g = 1.0 / 3f64.sqrt();
    HEX_CORNERS.map(|c| Point { at: c.map(|v| v * g), weight: 1.0 }).to_vec()
});

/// Gauss's rule of 3 × 3 × 3 points.
static GAUSS_3: LazyLock<Vec<Point>> = LazyLock::new(|| {
    let line = [(-(0.6f64.sqrt()), 5. / 9.), (0., 8. / 9.), (0.6f64.sqrt(), 5. / 9.)];
    let mut points = Vec::with_capacity(27);
    for (xi, wx) in line {
        for (eta, wy) in line {
            points.extend(line.map(|(zeta, wz)| Point { at: [xi, eta, zeta], weight: wx * wy * wz }));
        }
    }
    points
});

fn hex8(at: [f64; 3]) -> Shape {
    let mut shape = Shape { values: [0.0; MAX_NODES], gradients: [[0.0; 3]; MAX_NODES] };
    for (k, c) in HEX_CORNERS.iter().enumerate() {
        let f = [1. + c[0] * at[0], 1. + c[1] * at[1], 1. + c[2] * at[2]];
        shape.values[k] = 0.125 * f[0] * f[1] * f[2];
        shape.gradients[k] = [0.125 * c[0] * f[1] * f[2], 0.125 * c[1] * f[0] * f[2], 0.125 * c[2] * f[0] * f[1]];
    }
    shape
}
