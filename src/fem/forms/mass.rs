//! Consistent mass.

use super::{Form, NodeCoupling};
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::Cell;

/// ∫ ρ v·u dV, kg.
pub struct Mass {
    /// Density ρ, kg/m³.
    pub density: f64,
}

impl Form for Mass {
    fn coupling(&self) -> NodeCoupling {
        NodeCoupling::Components
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        let (kind, n) = (cell.kind, cell.kind.nodes());
        out.fill(0.0);
        for p in kind.mass_rule() {
            let w = self.density * p.weight * determinant(&jacobian(x, &p.shape));
            let values = &p.shape.values[..n];
            for (row, a) in out.chunks_exact_mut(n).zip(values) {
                row.iter_mut().zip(values).for_each(|(to, b)| *to += w * a * b);
            }
        }
    }
}
