//! Shape functions of the reference cells and their derivatives.

use super::{ShapeFunctions, HEX_CORNERS};
use crate::mesh::kind::{CellKind, MAX_NODES};

pub(super) fn shape(kind: CellKind, at: [f64; 3]) -> ShapeFunctions {
    match kind {
        CellKind::Tet4 => tet4(at),
        CellKind::Tet10 => tet10(at),
        CellKind::Pyramid5 | CellKind::Pyramid13 => pyramid(kind, at),
        CellKind::Wedge6 | CellKind::Wedge15 | CellKind::Wedge18 => wedge(kind, at),
        CellKind::Hex8 => hex8(at),
        CellKind::Hex20 => hex20(at),
        CellKind::Hex27 => hex27(at),
    }
}

fn zero() -> ShapeFunctions {
    ShapeFunctions { values: [0.0; MAX_NODES], gradients: [[0.0; 3]; MAX_NODES] }
}

impl ShapeFunctions {
    fn set(&mut self, node: usize, value: f64, gradient: [f64; 3]) {
        self.values[node] = value;
        self.gradients[node] = gradient;
    }
}

/// Barycentric coordinates of the tetrahedron, and their derivatives.
fn barycentric(at: [f64; 3]) -> [(f64, [f64; 3]); 4] {
    let [x, y, z] = at;
    [(1.0 - x - y - z, [-1.0; 3]), (x, [1.0, 0.0, 0.0]), (y, [0.0, 1.0, 0.0]), (z, [0.0, 0.0, 1.0])]
}

fn tet4(at: [f64; 3]) -> ShapeFunctions {
    let mut shape = zero();
    barycentric(at).into_iter().enumerate().for_each(|(k, (l, g))| shape.set(k, l, g));
    shape
}

fn tet10(at: [f64; 3]) -> ShapeFunctions {
    let mut shape = zero();
    let l = barycentric(at);
    for (k, (v, g)) in l.into_iter().enumerate() {
        shape.set(k, v * (2.0 * v - 1.0), g.map(|d| d * (4.0 * v - 1.0)));
    }
    for (k, [a, b]) in CellKind::Tet10.topology().edges.iter().enumerate() {
        let ((va, ga), (vb, gb)) = (l[*a as usize], l[*b as usize]);
        let gradient = std::array::from_fn(|c| 4.0 * (va * gb[c] + vb * ga[c]));
        shape.set(4 + k, 4.0 * va * vb, gradient);
    }
    shape
}

/// Hierarchical pieces of the line [-1, 1]: (1 − t)/2, (1 + t)/2, 1 − t², and their derivatives.
fn line(t: f64) -> [(f64, f64); 3] {
    [(0.5 * (1.0 - t), -0.5), (0.5 * (1.0 + t), 0.5), (1.0 - t * t, -2.0 * t)]
}

fn wedge(kind: CellKind, [x, y, z]: [f64; 3]) -> ShapeFunctions {
    let mut shape = zero();
    let l = [(1.0 - x - y, [-1.0, -1.0]), (x, [1.0, 0.0]), (y, [0.0, 1.0])];
    let ends = line(z);
    let product = |(f, g): (f64, [f64; 2]), (h, d): (f64, f64)| (f * h, [g[0] * h, g[1] * h, f * d]);
    let times = |(f, g): (f64, [f64; 2]), (h, d): (f64, [f64; 2])| (f * h, [g[0] * h + f * d[0], g[1] * h + f * d[1]]);
    let scaled = |(f, g): (f64, [f64; 3]), s: f64| (f * s, g.map(|d| d * s));
    let minus = |(f, g): (f64, [f64; 3]), (h, d): (f64, [f64; 3])| (f - h, std::array::from_fn(|c| g[c] - d[c]));
    if kind == CellKind::Wedge6 {
        for k in 0..6 {
            let (v, g) = product(l[k % 3], ends[k / 3]);
            shape.set(k, v, g);
        }
        return shape;
    }
    // Functions of the nodes on the edges and in the quadrilaterals; those of the corners are what these leave of the
    // linear ones.
    let full = kind == CellKind::Wedge18;
    let mut further = [(0.0, [0.0; 3]); 12];
    for k in 0..3 {
        let across = times(l[k], l[(k + 1) % 3]);
        if full {
            further[9 + k] = scaled(product(across, ends[2]), 4.0);
        }
        for (end, at) in [(0, 0), (1, 3)] {
            let edge = scaled(product(across, ends[end]), 4.0);
            further[at + k] = minus(edge, scaled(further[9 + k], 0.5));
        }
    }
    for k in 0..3 {
        // Without half of each of the two quadrilaterals at the edge.
        let rest = minus(product(l[k], ends[2]), scaled(further[9 + k], 0.5));
        further[6 + k] = minus(rest, scaled(further[9 + (k + 2) % 3], 0.5));
    }
    let between: Vec<&[u8]> = kind.between().collect();
    for k in 0..6 {
        let mut rest = product(l[k % 3], ends[k / 3]);
        for (around, &f) in between.iter().zip(&further) {
            if around.contains(&(k as u8)) {
                rest = minus(rest, scaled(f, 1.0 / around.len() as f64));
            }
        }
        shape.set(k, rest.0, rest.1);
    }
    for (k, &(v, g)) in further[..between.len()].iter().enumerate() {
        shape.set(6 + k, v, g);
    }
    shape
}

/// G. Bedrosian, Shape functions and integration formulas for three-dimensional finite element analysis, Int. J.
/// Numer. Meth. Engng 35 (1992) 95–108. With u = ξ/(1 − ζ), v = η/(1 − ζ) every function but the apex's is (1 − ζ)
/// P(u, v, ζ) with a polynomial P, so that the derivatives are P_u, P_v and −P + (1 − ζ) P_ζ + u P_u + v P_v. At the
/// apex they depend on the direction: those along the axis are taken.
fn pyramid(kind: CellKind, [x, y, z]: [f64; 3]) -> ShapeFunctions {
    let mut shape = zero();
    let rest = 1.0 - z;
    let (u, v) = if rest.abs() > 1e-12 { (x / rest, y / rest) } else { (0.0, 0.0) };
    let mut set = |node: usize, [p, pu, pv, pz]: [f64; 4]| {
        shape.set(node, rest * p, [pu, pv, -p + rest * pz + u * pu + v * pv]);
    };
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    for (k, [a, b]) in corners.into_iter().enumerate() {
        let (f, g) = (1.0 + a * u, 1.0 + b * v);
        if kind == CellKind::Pyramid5 {
            set(k, [0.25 * f * g, 0.25 * a * g, 0.25 * b * f, 0.0]);
            continue;
        }
        // ¼ (a ξ + b η − 1)(1 + a u)(1 + b v)
        let (s, along) = (rest * (a * u + b * v) - 1.0, a * u + b * v);
        let (su, sv, sz) = (rest * a, rest * b, -along);
        set(k, [0.25 * s * f * g, 0.25 * (su * f + s * a) * g, 0.25 * (sv * g + s * b) * f, 0.25 * sz * f * g]);
        // ζ (1 + a u)(1 + b v), half-way to the apex.
        set(9 + k, [z * f * g, z * a * g, z * b * f, f * g]);
        // ½ (1 − ζ)(1 − u²)(1 + b v) or with u and v exchanged, half-way to the next corner.
        if k % 2 == 0 {
            let q = 1.0 - u * u;
            set(5 + k, [0.5 * rest * q * g, -rest * u * g, 0.5 * rest * q * b, -0.5 * q * g]);
        } else {
            let q = 1.0 - v * v;
            set(5 + k, [0.5 * rest * q * f, 0.5 * rest * q * a, -rest * v * f, -0.5 * q * f]);
        }
    }
    match kind {
        CellKind::Pyramid5 => shape.set(4, z, [0.0, 0.0, 1.0]),
        _ => shape.set(4, z * (2.0 * z - 1.0), [0.0, 0.0, 4.0 * z - 1.0]),
    }
    shape
}

fn hex8(at: [f64; 3]) -> ShapeFunctions {
    let mut shape = zero();
    for (k, c) in HEX_CORNERS.iter().enumerate() {
        let f = [1. + c[0] * at[0], 1. + c[1] * at[1], 1. + c[2] * at[2]];
        shape.values[k] = 0.125 * f[0] * f[1] * f[2];
        shape.gradients[k] = [0.125 * c[0] * f[1] * f[2], 0.125 * c[1] * f[0] * f[2], 0.125 * c[2] * f[0] * f[1]];
    }
    shape
}

/// The serendipity element.
fn hex20(at: [f64; 3]) -> ShapeFunctions {
    let mut shape = zero();
    let nodes = CellKind::Hex20.topology().edges.iter();
    for (k, c) in HEX_CORNERS.iter().enumerate() {
        let f: [f64; 3] = std::array::from_fn(|i| 1.0 + c[i] * at[i]);
        let s = c[0] * at[0] + c[1] * at[1] + c[2] * at[2] - 2.0;
        let gradient = std::array::from_fn(|i| 0.125 * c[i] * f[(i + 1) % 3] * f[(i + 2) % 3] * (s + f[i]));
        shape.set(k, 0.125 * f[0] * f[1] * f[2] * s, gradient);
    }
    for (k, [a, b]) in nodes.enumerate() {
        let c: [f64; 3] = std::array::from_fn(|i| 0.5 * (HEX_CORNERS[*a as usize][i] + HEX_CORNERS[*b as usize][i]));
        // 1 − t² along the edge, 1 + c t across.
        let f: [f64; 3] = std::array::from_fn(|i| if c[i] == 0.0 { 1.0 - at[i] * at[i] } else { 1.0 + c[i] * at[i] });
        let d: [f64; 3] = std::array::from_fn(|i| if c[i] == 0.0 { -2.0 * at[i] } else { c[i] });
        let gradient = std::array::from_fn(|i| 0.25 * d[i] * f[(i + 1) % 3] * f[(i + 2) % 3]);
        shape.set(8 + k, 0.25 * f[0] * f[1] * f[2], gradient);
    }
    shape
}

/// Products of the quadratic polynomials of a line.
fn hex27(at: [f64; 3]) -> ShapeFunctions {
    let mut shape = zero();
    let lagrange = |c: f64, t: f64| match c {
        0.0 => (1.0 - t * t, -2.0 * t),
        c => (0.5 * t * (t + c), t + 0.5 * c),
    };
    let mut nodes = HEX_CORNERS.to_vec();
    for around in CellKind::Hex27.between() {
        let mean = |i: usize| around.iter().map(|&k| HEX_CORNERS[k as usize][i]).sum::<f64>() / around.len() as f64;
        nodes.push([mean(0), mean(1), mean(2)]);
    }
    for (k, c) in nodes.into_iter().enumerate() {
        let f: [(f64, f64); 3] = std::array::from_fn(|i| lagrange(c[i], at[i]));
        let gradient = std::array::from_fn(|i| f[i].1 * f[(i + 1) % 3].0 * f[(i + 2) % 3].0);
        shape.set(k, f[0].0 * f[1].0 * f[2].0, gradient);
    }
    shape
}
