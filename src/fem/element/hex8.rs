//! Eight-node hexahedron with incompatible modes: the element of Taylor, Beresford and Wilson, "A non-conforming
//! element for stress analysis", Int. J. Numer. Meth. Engng 10 (1976) 1211–1219. It represents bending exactly on
//! parallelepipeds and, with the Jacobian of the incompatible part taken at the centre, passes the patch test on
//! distorted meshes.

use pulp::{Arch, Simd, WithSimd};

use super::{inverse, strain_column, stress_of, to_space, Element, PointStress};
use crate::fem::ElasticMaterial;
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::reference::{QuadraturePoint, HEX_CORNERS};
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

fn gauss_point(x: &[[f64; 3]], point: &QuadraturePoint, centre_inv: &[[f64; 3]; 3], centre_det: f64) -> GaussPoint {
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
    // Incompatible modes 1-ξ², 1-η², 1-ζ² with the centre's Jacobian scaled by det₀/det: their strains then integrate
    // to zero over the element, which is what the patch test asks for.
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

/// Condensed stiffness and the operator that recovers the incompatible amplitudes: `amplitudes[9] = recover[9][24] ·
/// u`.
struct Condensed {
    stiffness: [[f64; DOFS]; DOFS],
    recover: [[f64; DOFS]; 9],
}

fn condense(points: &[GaussPoint; 8], material: &ElasticMaterial) -> Condensed {
    Arch::new().dispatch(Condense { points, material })
}

/// [`condense`] in the vector instructions of the processor at hand.
struct Condense<'a> {
    points: &'a [GaussPoint; 8],
    material: &'a ElasticMaterial,
}

impl WithSimd for Condense<'_> {
    type Output = Condensed;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Condensed {
        condense_here(self.points, self.material)
    }
}

/// Columns of a Gauss point, filled up to whole vectors, and numbers in one of these.
const WIDE: usize = 36;
const VECTOR: usize = 4;

#[inline(always)]
fn condense_here(points: &[GaussPoint; 8], material: &ElasticMaterial) -> Condensed {
    let (lambda, mu) = material.lame();
    let mut k = [[0.0; WIDE]; 33];
    for p in points {
        // Component by component: products run over the columns.
        let mut stress = [[0.0; WIDE]; 6];
        for (b, e) in p.columns.iter().enumerate() {
            let of = stress_of(*e, lambda, mu);
            (0..6).for_each(|i| stress[i][b] = of[i] * p.weight);
        }
        for (a, row) in k.iter_mut().enumerate() {
            let e = p.columns[a];
            for b in a / VECTOR * VECTOR..WIDE {
                row[b] += e[0] * stress[0][b]
                    + e[1] * stress[1][b]
                    + e[2] * stress[2][b]
                    + e[3] * stress[3][b]
                    + e[4] * stress[4][b]
                    + e[5] * stress[5][b];
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
    let mut work: [[f64; 33]; 9] = std::array::from_fn(|a| {
        let mut row = [0.0; 33];
        row[..9].copy_from_slice(&k[24 + a][24..33]);
        row[9..].copy_from_slice(&k[24 + a][..24]);
        row
    });
    for p in 0..9 {
        let pivot = work[p][p];
        work[p].iter_mut().for_each(|v| *v /= pivot);
        let row = work[p];
        for r in (0..9).filter(|&r| r != p) {
            let f = work[r][p];
            (p..33).for_each(|c| work[r][c] -= f * row[c]);
        }
    }
    for (a, row) in work.iter().enumerate() {
        for d in 0..DOFS {
            recover[a][d] = -row[9 + d];
        }
    }
    let mut stiffness = [[0.0; DOFS]; DOFS];
    for d in 0..DOFS {
        let mut row: [f64; DOFS] = std::array::from_fn(|e| k[d][e]);
        for a in 0..9 {
            (0..DOFS).for_each(|e| row[e] += k[d][24 + a] * recover[a][e]);
        }
        for e in d..DOFS {
            stiffness[d][e] = row[e];
            stiffness[e][d] = row[e];
        }
    }
    Condensed { stiffness, recover }
}

impl Element for Hex8 {
    fn stiffness(&self, x: &[[f64; 3]], material: &ElasticMaterial, k: &mut [f64]) {
        k.copy_from_slice(condense(&gauss(x), material).stiffness.as_flattened());
    }

    /// Evaluated at the Gauss points, where it is most accurate, and extrapolated trilinearly.
    fn nodal_stress(&self, x: &[[f64; 3]], u: &[f64], material: &ElasticMaterial, stress: &mut [[f64; 6]]) {
        let at_gauss = gauss_stress(&gauss(x), u, material);
        for (s, c) in stress.iter_mut().zip(&HEX_CORNERS) {
            let n = CellKind::Hex8.shape(c.map(|v| v * 3f64.sqrt())).values;
            *s = std::array::from_fn(|i| (0..8).map(|g| n[g] * at_gauss[g][i]).sum());
        }
    }

    fn stresses(&self, x: &[[f64; 3]], u: &[f64], material: &ElasticMaterial) -> Vec<PointStress> {
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
fn gauss_stress(points: &[GaussPoint; 8], u: &[f64], material: &ElasticMaterial) -> [[f64; 6]; 8] {
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
        let mat = ElasticMaterial { young: e, poisson: nu, density: 1. };
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
