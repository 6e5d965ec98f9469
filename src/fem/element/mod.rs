//! Elements: what stiffness and stress are in a cell of each kind.

mod hex8;
mod isoparametric;
#[cfg(test)]
mod tests;

use super::ElasticMaterial;
use crate::mesh::CellKind;
use isoparametric::Isoparametric;

/// Stress at a point of a cell.
pub struct PointStress {
    /// Share of the volume, m³.
    pub volume: f64,
    /// Gradients of the shape functions, 1/m, `[n]`.
    pub gradients: Vec<[f64; 3]>,
    /// Stress (xx, yy, zz, xy, yz, zx), Pa.
    pub stress: [f64; 6],
}

/// The elastic behaviour of a cell.
pub trait Element: Sync {
    /// Stiffness of the cell with nodes at `x` (m, `[n][3]`), N/m, `[3n, 3n]` row-major, degree of freedom `3*node +
    /// component`.
    fn stiffness(&self, x: &[[f64; 3]], material: &ElasticMaterial, k: &mut [f64]);

    /// Stress (xx, yy, zz, xy, yz, zx), Pa, at the nodes, `[n][6]`, under the displacement `u`, m, `[3n]`.
    fn nodal_stress(&self, x: &[[f64; 3]], u: &[f64], material: &ElasticMaterial, stress: &mut [[f64; 6]]);

    /// Stress at the points of the rule for the stiffness under the displacement `u`, m, `[3n]`: in equilibrium with
    /// what the stiffness says.
    fn stresses(&self, x: &[[f64; 3]], u: &[f64], material: &ElasticMaterial) -> Vec<PointStress>;
}

/// The element of a kind of cell.
pub fn element(kind: CellKind) -> &'static dyn Element {
    static ALL: [Isoparametric; CellKind::ALL.len()] = {
        let mut all = [const { Isoparametric(CellKind::Tet4) }; CellKind::ALL.len()];
        let mut i = 0;
        while i < all.len() {
            all[i] = Isoparametric(CellKind::ALL[i]);
            i += 1;
        }
        all
    };
    match kind {
        CellKind::Hex8 => &hex8::Hex8,
        _ => &ALL[kind as usize],
    }
}

/// Inverse of a Jacobian with determinant `det`, 1/m.
pub(in crate::fem) fn inverse(j: &[[f64; 3]; 3], det: f64) -> [[f64; 3]; 3] {
    let c = |a: usize, b: usize, d: usize, e: usize| (j[a][b] * j[d][e] - j[a][e] * j[d][b]) / det;
    [
        [c(1, 1, 2, 2), c(0, 2, 2, 1), c(0, 1, 1, 2)],
        [c(1, 2, 2, 0), c(0, 0, 2, 2), c(0, 2, 1, 0)],
        [c(1, 0, 2, 1), c(0, 1, 2, 0), c(0, 0, 1, 1)],
    ]
}

/// Derivatives with respect to the space coordinates from those with respect to the reference ones: `g_i = g_ξj
/// J⁻¹_ji`.
pub(in crate::fem) fn to_space(grad: [f64; 3], inv: &[[f64; 3]; 3]) -> [f64; 3] {
    std::array::from_fn(|i| grad[0] * inv[0][i] + grad[1] * inv[1][i] + grad[2] * inv[2][i])
}

/// Strain (xx, yy, zz, xy, yz, zx; engineering shears) made by a unit displacement of a function with gradient `g`
/// along axis `c`.
fn strain_column(g: [f64; 3], c: usize) -> [f64; 6] {
    match c {
        0 => [g[0], 0., 0., g[1], 0., g[2]],
        1 => [0., g[1], 0., g[0], g[2], 0.],
        _ => [0., 0., g[2], 0., g[1], g[0]],
    }
}

/// Stress of a strain, both (xx, yy, zz, xy, yz, zx), Pa.
fn stress_of(e: [f64; 6], lambda: f64, mu: f64) -> [f64; 6] {
    let p = lambda * (e[0] + e[1] + e[2]);
    [p + 2. * mu * e[0], p + 2. * mu * e[1], p + 2. * mu * e[2], mu * e[3], mu * e[4], mu * e[5]]
}
