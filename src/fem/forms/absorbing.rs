//! Damping by the mass that grows towards a plane.

use super::{Form, NodeCoupling};
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::Cell;

/// ∫ ρ α v·u dV, kg/s, or with what moves across the normal alone, with α = `rate` (1 − d/`depth`)² at the distance d
/// < `depth` from a plane and 0 beyond: waves meet no step that would send them back.
pub struct AbsorbingMass {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// A point of the plane, m.
    pub place: [f64; 3],
    /// Its unit normal.
    pub normal: [f64; 3],
    /// Distance from the plane at which the damping begins, m.
    pub depth: f64,
    /// α at the plane, 1/s.
    pub rate: f64,
    /// True if it is only for what moves across the normal, v·(1 − n nᵀ)u.
    pub across: bool,
}

impl AbsorbingMass {
    /// α at a point, 1/s.
    pub fn rate(&self, x: [f64; 3]) -> f64 {
        let distance = (0..3).map(|c| (x[c] - self.place[c]) * self.normal[c]).sum::<f64>().abs();
        self.rate * (1.0 - distance / self.depth).max(0.0).powi(2)
    }
}

impl Form for AbsorbingMass {
    fn coupling(&self) -> NodeCoupling {
        if self.across {
            NodeCoupling::Full
        } else {
            NodeCoupling::Components
        }
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        let n = cell.kind.nodes();
        let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let tensor: [[f64; 3]; 3] =
            std::array::from_fn(|i| std::array::from_fn(|j| unit(i, j) - self.normal[i] * self.normal[j]));
        out.fill(0.0);
        for p in cell.kind.mass_rule() {
            let values = &p.shape.values[..n];
            let place = std::array::from_fn(|c| x.iter().zip(values).map(|(x, v)| v * x[c]).sum());
            let w = self.density * self.rate(place) * p.weight * determinant(&jacobian(x, &p.shape));
            if !self.across {
                for (row, a) in out.chunks_exact_mut(n).zip(values) {
                    row.iter_mut().zip(values).for_each(|(to, b)| *to += w * a * b);
                }
                continue;
            }
            for (rows, a) in out.chunks_exact_mut(9 * n).zip(values) {
                for (row, tensor) in rows.chunks_exact_mut(3 * n).zip(&tensor) {
                    for (to, b) in row.chunks_exact_mut(3).zip(values) {
                        to.iter_mut().zip(tensor).for_each(|(to, t)| *to += w * a * b * t);
                    }
                }
            }
        }
    }
}
