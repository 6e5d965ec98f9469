//! The isoparametric element of any kind: displacement and geometry by the same shape functions, full integration.

use super::{inverse, stress_of, to_space, Element, PointStress};
use crate::fem::ElasticMaterial;
use crate::mesh::kind::MAX_NODES;
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::reference::ShapeFunctions;
use crate::mesh::CellKind;
use std::sync::OnceLock;

/// The element.
pub(super) struct Isoparametric(pub CellKind);

/// Derivatives of the shape functions with respect to the space coordinates, 1/m, and the determinant of the
/// Jacobian, m³.
fn gradients(x: &[[f64; 3]], shape: &ShapeFunctions) -> ([[f64; 3]; MAX_NODES], f64) {
    let j = jacobian(x, shape);
    let det = determinant(&j);
    let inv = inverse(&j, det);
    let mut g = [[0.0; 3]; MAX_NODES];
    for (to, from) in g.iter_mut().zip(&shape.gradients[..x.len()]) {
        *to = to_space(*from, &inv);
    }
    (g, det)
}

/// Stress (xx, yy, zz, xy, yz, zx), Pa, of the displacement `u`, m, `[3n]`, where the shape functions have the
/// gradients `g`, 1/m, `[n][3]`.
fn stress_at(g: &[[f64; 3]], u: &[f64], material: &ElasticMaterial) -> [f64; 6] {
    let mut d = [[0.0; 3]; 3];
    for (ga, ua) in g.iter().zip(u.chunks_exact(3)) {
        for i in 0..3 {
            (0..3).for_each(|j| d[i][j] += ua[i] * ga[j]);
        }
    }
    let strain = [d[0][0], d[1][1], d[2][2], d[0][1] + d[1][0], d[1][2] + d[2][1], d[2][0] + d[0][2]];
    let (lambda, mu) = material.lame();
    stress_of(strain, lambda, mu)
}

impl Element for Isoparametric {
    /// With A_(ai)(bj) = ∫ ∂N_a/∂x_i ∂N_b/∂x_j dV the stiffness is λ A_(ai)(bj) + μ A_(aj)(bi) + μ δ_ij Σ_k
    /// A_(ak)(bk): A is a sum of products of a vector with itself, which is most of the work.
    fn stiffness(&self, x: &[[f64; 3]], material: &ElasticMaterial, k: &mut [f64]) {
        let n = x.len();
        let (lambda, mu) = material.lame();
        k.fill(0.0);
        for p in self.0.stiffness_rule() {
            let (g, det) = gradients(x, &p.shape);
            let g = g[..n].as_flattened();
            let weight = p.weight * det;
            // The upper triangle, from the block of the row's node on.
            for (r, row) in k.chunks_exact_mut(3 * n).enumerate() {
                let (first, f) = (r - r % 3, weight * g[r]);
                row[first..].iter_mut().zip(&g[first..]).for_each(|(to, v)| *to += f * v);
            }
        }
        for a in 0..n {
            for b in a..n {
                let at = |i: usize, j: usize| 3 * n * (3 * a + i) + 3 * b + j;
                let products: [[f64; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|j| k[at(i, j)]));
                let trace = mu * (products[0][0] + products[1][1] + products[2][2]);
                for i in 0..3 {
                    for j in 0..3 {
                        let diagonal = if i == j { trace } else { 0.0 };
                        let value = lambda * products[i][j] + mu * products[j][i] + diagonal;
                        k[at(i, j)] = value;
                        k[3 * n * (3 * b + j) + 3 * a + i] = value;
                    }
                }
            }
        }
    }

    /// Evaluated at as many points within as there are corners, where it is most accurate, and extrapolated by the
    /// functions of the linear cell.
    fn nodal_stress(&self, x: &[[f64; 3]], u: &[f64], material: &ElasticMaterial, stress: &mut [[f64; 6]]) {
        let recovery = recovery(self.0);
        let at = |shape: &ShapeFunctions| stress_at(&gradients(x, shape).0[..x.len()], u, material);
        let at_points: Vec<[f64; 6]> = recovery.points.iter().map(at).collect();
        for (s, weights) in stress.iter_mut().zip(recovery.weights.chunks_exact(at_points.len())) {
            *s = std::array::from_fn(|i| weights.iter().zip(&at_points).map(|(w, p)| w * p[i]).sum());
        }
    }

    fn stresses(&self, x: &[[f64; 3]], u: &[f64], material: &ElasticMaterial) -> Vec<PointStress> {
        let of = |p: &crate::mesh::reference::QuadraturePoint| {
            let (g, det) = gradients(x, &p.shape);
            let g = &g[..x.len()];
            PointStress { volume: p.weight * det, gradients: g.to_vec(), stress: stress_at(g, u, material) }
        };
        self.0.stiffness_rule().iter().map(of).collect()
    }
}

/// Points of stress evaluation, and how they come from there to the nodes.
struct Recovery {
    points: Vec<ShapeFunctions>,
    /// `[nodes, points]`, row-major.
    weights: Vec<f64>,
}

/// How far the points lie from the centre on the way to the corners: at Gauss's points where there are such.
fn reach(linear: CellKind) -> [f64; 3] {
    let g = 1.0 / 3f64.sqrt();
    match linear {
        CellKind::Tet4 => [0.2f64.sqrt(); 3],
        CellKind::Pyramid5 => [0.5; 3],
        CellKind::Wedge6 => [0.5, 0.5, g],
        _ => [g; 3],
    }
}

fn recovery(kind: CellKind) -> &'static Recovery {
    static ALL: [OnceLock<Recovery>; CellKind::ALL.len()] = [const { OnceLock::new() }; CellKind::ALL.len()];
    ALL[kind as usize].get_or_init(|| {
        let (linear, centre) = (kind.linear(), kind.centre());
        if kind == CellKind::Tet4 {
            return Recovery { points: vec![kind.shape(centre)], weights: vec![1.0; 4] };
        }
        let reach = reach(linear);
        let within = |c: &[f64; 3]| std::array::from_fn(|i| centre[i] + reach[i] * (c[i] - centre[i]));
        let places: Vec<[f64; 3]> = linear.reference_nodes().iter().map(within).collect();
        let n = places.len();
        let nodes = kind.reference_nodes();
        // The functions of the linear cell at the points, inverted, times those at the nodes.
        let a = faer::Mat::from_fn(n, n, |p, c| linear.shape(places[p]).values[c]);
        let b = faer::Mat::from_fn(n, nodes.len(), |c, k| linear.shape(nodes[k]).values[c]);
        let w = faer::linalg::solvers::Solve::solve_transpose(&a.partial_piv_lu(), &b);
        let weights = (0..nodes.len()).flat_map(|k| (0..n).map(move |p| (k, p))).map(|(k, p)| w[(p, k)]).collect();
        Recovery { points: places.iter().map(|&at| kind.shape(at)).collect(), weights }
    })
}
