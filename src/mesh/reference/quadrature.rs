//! Rules of quadrature on the reference cells. All weights are positive, all points within.

use super::HEX_CORNERS;
use crate::mesh::CellKind;
use crate::quadrature::{triangle_6, GAUSS_2, GAUSS_3};

/// Points and weights.
pub(super) type RawRule = Vec<([f64; 3], f64)>;

/// The rule for the stiffness.
pub(super) fn stiffness(kind: CellKind) -> RawRule {
    match kind {
        CellKind::Tet4 => vec![([0.25; 3], 1.0 / 6.0)],
        CellKind::Tet10 => tet_4(),
        CellKind::Pyramid5 => pyramid(2),
        CellKind::Pyramid13 => pyramid(3),
        CellKind::Wedge6 => wedge(&triangle_3(), &GAUSS_2),
        CellKind::Wedge15 | CellKind::Wedge18 => wedge(&triangle_6(), &GAUSS_3),
        // In the order of the corners.
        CellKind::Hex8 => HEX_CORNERS.map(|c| (c.map(|v| v * (1.0 / 3f64.sqrt())), 1.0)).to_vec(),
        CellKind::Hex20 | CellKind::Hex27 => hex_27(),
    }
}

/// The rule for the mass.
pub(super) fn mass(kind: CellKind) -> RawRule {
    match kind {
        CellKind::Tet4 => tet_4(),
        CellKind::Tet10 => tet_14(),
        // The Jacobian of a distorted cell varies too.
        CellKind::Pyramid5 | CellKind::Pyramid13 => pyramid(3),
        CellKind::Wedge6 | CellKind::Wedge15 | CellKind::Wedge18 => wedge(&triangle_6(), &GAUSS_3),
        CellKind::Hex8 | CellKind::Hex20 | CellKind::Hex27 => hex_27(),
    }
}

/// Gauss's rule on [0, 1] with the weight (1 − z)², two or three points: zeros of the Jacobi polynomials of that
/// weight.
fn gauss_squared(n: usize) -> Vec<(f64, f64)> {
    // ∫ (1 − z)² z^k dz.
    let moments = [1.0 / 3.0, 1.0 / 12.0, 1.0 / 30.0];
    let zeros = match n {
        2 => {
            // 15 z² − 10 z + 1.
            let root = 10f64.sqrt() / 15.0;
            vec![1.0 / 3.0 - root, 1.0 / 3.0 + root]
        }
        _ => {
            // 56 z³ − 63 z² + 18 z − 1, by Viète's cosines: z = 3/8 + t.
            let (p, q) = (-45.0 / 448.0, -5.0 / 1792.0);
            let (r, third) = (2.0 * f64::sqrt(-p / 3.0), 2.0 * std::f64::consts::PI / 3.0);
            let angle = (3.0 * q / (p * r)).clamp(-1.0, 1.0).acos() / 3.0;
            [2.0, 1.0, 0.0].map(|k| 0.375 + r * (angle - third * k).cos()).to_vec()
        }
    };
    // The weights give the first moments: Lagrange polynomials over the zeros.
    let weight = |i: usize| {
        let others: Vec<f64> = (0..n).filter(|&j| j != i).map(|j| zeros[j]).collect();
        let scale: f64 = others.iter().map(|o| zeros[i] - o).product();
        match others[..] {
            [a] => (moments[1] - a * moments[0]) / scale,
            [a, b] => (moments[2] - (a + b) * moments[1] + a * b * moments[0]) / scale,
            _ => moments[0],
        }
    };
    (0..n).map(|i| (zeros[i], weight(i))).collect()
}

/// Three points in the triangle of 0 and the unit points, exact to degree 2.
fn triangle_3() -> Vec<([f64; 2], f64)> {
    let (a, b) = (1.0 / 6.0, 2.0 / 3.0);
    [[a, a], [b, a], [a, b]].map(|p| (p, 1.0 / 6.0)).to_vec()
}

/// Four points in the tetrahedron, exact to degree 2.
fn tet_4() -> RawRule {
    let root = 5f64.sqrt();
    let (a, b) = ((5.0 - root) / 20.0, (5.0 + 3.0 * root) / 20.0);
    [[a, a, a], [b, a, a], [a, b, a], [a, a, b]].map(|p| (p, 1.0 / 24.0)).to_vec()
}

/// Fourteen points in the tetrahedron, exact to degree 5. N. J. Walkington, Quadrature on simplices of arbitrary
/// dimension, 2000.
fn tet_14() -> RawRule {
    let mut points = Vec::with_capacity(14);
    for (a, w) in
        [(0.310_885_919_263_300_6, 0.112_687_925_718_015_86), (0.092_735_250_310_891_23, 0.073_493_043_116_361_95)]
    {
        let b = 1.0 - 3.0 * a;
        points.extend([[a, a, a], [b, a, a], [a, b, a], [a, a, b]].map(|p| (p, w / 6.0)));
    }
    let (a, w) = (0.045_503_704_125_649_65, 0.042_546_020_777_081_47);
    let b = 0.5 - a;
    let edges = [[a, a, b], [a, b, a], [b, a, a], [a, b, b], [b, a, b], [b, b, a]];
    points.extend(edges.map(|p| (p, w / 6.0)));
    points
}

/// Gauss's rule of 3 × 3 × 3 points.
fn hex_27() -> RawRule {
    let mut points = Vec::with_capacity(27);
    for (xi, wx) in GAUSS_3 {
        for (eta, wy) in GAUSS_3 {
            points.extend(GAUSS_3.iter().map(|&(zeta, wz)| ([xi, eta, zeta], wx * wy * wz)));
        }
    }
    points
}

fn wedge(triangle: &[([f64; 2], f64)], line: &[(f64, f64)]) -> RawRule {
    line.iter().flat_map(|&(z, wz)| triangle.iter().map(move |&([x, y], w)| ([x, y, z], w * wz))).collect()
}

/// `n` × `n` × `n` points, n = 2 or 3, in the pyramid, drawn together towards the apex.
fn pyramid(n: usize) -> RawRule {
    let line: &[(f64, f64)] = if n == 2 { &GAUSS_2 } else { &GAUSS_3 };
    let mut points = Vec::with_capacity(n * n * n);
    for (z, wz) in gauss_squared(n) {
        for &(u, wu) in line {
            points.extend(line.iter().map(|&(v, wv)| ([u * (1.0 - z), v * (1.0 - z), z], wu * wv * wz)));
        }
    }
    points
}
