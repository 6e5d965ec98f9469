//! Eight-node hexahedron with incompatible modes: the element of Taylor, Beresford and Wilson, "A non-conforming element
//! for stress analysis", Int. J. Numer. Meth. Engng 10 (1976) 1211–1219. It represents bending exactly on parallelepipeds
//! and, with the Jacobian of the incompatible part taken at the centre, passes the patch test on distorted meshes.

use super::{inverse, strain_column, stress_of, to_space, Element, PointStress};
use crate::fem::Material;
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::reference::{Point, HEX_CORNERS};
use crate::mesh::CellKind;

/// Number of displacement degrees of freedom of the element.
const DOFS: usize = 24;

/// The element.
pub(super) struct Hex8;

/// Strain-displacement columns at one Gauss point: 24 of the shape functions, then 9 of the incompatible modes.
struct GaussPoint {
    weight: f64,
    columns: [[f64; 6]; 33],
}

fn gauss_point(x: &[[f64; 3]], point: &Point, centre_inv: &[[f64; 3]; 3], centre_det: f64) -> GaussPoint {
    let (shape, xi) = (&point.shape, point.at);
    let j = jacobian(x, shape);
    let det = determinant(&j);
    let inv = inverse(&j, det);
    let mut columns = [[0.0; 6]; 33];
    for (a, ga) in shape.gradients[..8].iter().enumerate() {
        let g = to_space(*ga, &inv);
        for c in 0..3 {
            columns[3 * a + c] = strain_column(g, c);
        }
    }
    // Incompatible modes 1-ξ², 1-η², 1-ζ² with the centre's Jacobian scaled by det₀/det: their strains then integrate to
    // zero over the element, which is what the patch test asks for.
    for m in 0..3 {
        let mut gm = [0.0; 3];
        gm[m] = -2. * xi[m] * centre_det / det;
        let g = to_space(gm, centre_inv);
        for c in 0..3 {
            columns[24 + 3 * m + c] = strain_column(g, c);
        }
    }
    GaussPoint { weight: det, columns }
}

/// At the points of the 2×2×2 rule, in the order of the corners; all weights are 1.
fn gauss(x: &[[f64; 3]]) -> [GaussPoint; 8] {
    let j0 = jacobian(x, &CellKind::Hex8.shape([0.; 3]));
    let det0 = determinant(&j0);
    let inv0 = inverse(&j0, det0);
    let rule = CellKind::Hex8.stiffness_rule();
    std::array::from_fn(|g| gauss_point(x, &rule[g], &inv0, det0))
}

/// Condensed stiffness and the operator that recovers the incompatible amplitudes: `amplitudes[9] = recover[9][24] · u`.
struct Condensed {
    stiffness: [[f64; DOFS]; DOFS],
    recover: [[f64; DOFS]; 9],
}

fn condense(points: &[GaussPoint; 8], material: &Material) -> Condensed {
    let (lambda, mu) = material.lame();
    let mut k = [[0.0; 33]; 33];
    for p in points {
        let stress: [[f64; 6]; 33] = p.columns.map(|e| stress_of(e, lambda, mu));
        for a in 0..33 {
            for b in a..33 {
                let mut s = 0.0;
                for i in 0..6 {
                    s += p.columns[a][i] * stress[b][i];
                }
                k[a][b] += s * p.weight;
            }
        }
    }
    for a in 0..33 {
        for b in 0..a {
            k[a][b] = k[b][a];
        }
    }
    // K_uu - K_ua K_aa⁻¹ K_au by eliminating the nine amplitudes, symmetric positive definite.
    let mut recover = [[0.0; DOFS]; 9];
    let mut work: Vec<[f64; 33]> = (24..33)
        .map(|a| {
            let mut row = [0.0; 33];
            row[..9].copy_from_slice(&k[a][24..33]);
            row[9..33].copy_from_slice(&k[a][..24]);
            row
        })
        .collect();
    for p in 0..9 {
        let pivot = work[p][p];
        for v in &mut work[p] {
            *v /= pivot;
        }
        for r in 0..9 {
            if r != p {
                let f = work[r][p];
                for c in p..33 {
                    work[r][c] -= f * work[p][c];
                }
            }
        }
    }
    for (a, row) in work.iter().enumerate() {
        for d in 0..DOFS {
            recover[a][d] = -row[9 + d];
        }
    }
    let mut stiffness = [[0.0; DOFS]; DOFS];
    for d in 0..DOFS {
        for e in d..DOFS {
            let mut v = k[d][e];
            for a in 0..9 {
                v += k[d][24 + a] * recover[a][e];
            }
            stiffness[d][e] = v;
            stiffness[e][d] = v;
        }
    }
    Condensed { stiffness, recover }
}

impl Element for Hex8 {
    fn stiffness(&self, x: &[[f64; 3]], material: &Material, k: &mut [f64]) {
        k.copy_from_slice(condense(&gauss(x), material).stiffness.as_flattened());
    }

    /// Evaluated at the Gauss points, where it is most accurate, and extrapolated trilinearly.
    fn nodal_stress(&self, x: &[[f64; 3]], u: &[f64], material: &Material, stress: &mut [[f64; 6]]) {
        let at_gauss = gauss_stress(&gauss(x), u, material);
        for (s, c) in stress.iter_mut().zip(&HEX_CORNERS) {
            let n = CellKind::Hex8.shape(c.map(|v| v * 3f64.sqrt())).values;
            *s = std::array::from_fn(|i| (0..8).map(|g| n[g] * at_gauss[g][i]).sum());
        }
    }

    fn stresses(&self, x: &[[f64; 3]], u: &[f64], material: &Material) -> Vec<PointStress> {
        let points = gauss(x);
        let stress = gauss_stress(&points, u, material);
        // The first strain of a column along x, the second along y, the third along z is the gradient.
        let gradient = |p: &GaussPoint, a: usize| std::array::from_fn(|c| p.columns[3 * a + c][c]);
        let of = |(p, stress): (&GaussPoint, [f64; 6])| PointStress {
            volume: p.weight,
            gradients: (0..8).map(|a| gradient(p, a)).collect(),
            stress,
        };
        points.iter().zip(stress).map(of).collect()
    }
}

/// Stress at the Gauss points under the displacement `u`, Pa.
fn gauss_stress(points: &[GaussPoint; 8], u: &[f64], material: &Material) -> [[f64; 6]; 8] {
    let recover = condense(points, material).recover;
    let amplitudes: [f64; 9] = std::array::from_fn(|a| recover[a].iter().zip(u).map(|(r, v)| r * v).sum());
    let (lambda, mu) = material.lame();
    points.each_ref().map(|p| {
        let mut e = [0.0; 6];
        for (column, v) in p.columns.iter().zip(u.iter().chain(&amplitudes)) {
            for (ei, ci) in e.iter_mut().zip(column) {
                *ei += ci * v;
            }
        }
        stress_of(e, lambda, mu)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pure_bending_of_one_element_is_exact() {
        // A 2×2×2 cube bent about y: u = κxz, w = -κx²/2 (+ Poisson terms); the energy per volume is E κ² z²/2.
        let (e, nu) = (205e9, 0.3);
        let mat = Material { young: e, poisson: nu, density: 1. };
        let mut k = [[0.0; DOFS]; DOFS];
        Hex8.stiffness(&HEX_CORNERS, &mat, k.as_flattened_mut());
        let mut u = [0.0; DOFS];
        for (a, c) in HEX_CORNERS.iter().enumerate() {
            // Corner values of the beam solution; x² and y², z² parts live in the incompatible modes.
            u[3 * a] = c[0] * c[2];
            u[3 * a + 1] = -nu * c[1] * c[2];
        }
        let energy: f64 = 0.5 * (0..DOFS).map(|i| u[i] * (0..DOFS).map(|j| k[i][j] * u[j]).sum::<f64>()).sum::<f64>();
        let exact = 0.5 * e * 8. / 3.;
        assert!((energy / exact - 1.).abs() < 1e-12, "bending energy {energy:e}, beam theory {exact:e}");
    }
}
