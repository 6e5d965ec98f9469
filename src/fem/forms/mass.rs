//! Consistent mass.

use super::{Coupling, Form};
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::Cell;

/// ∫ ρ v·u dV, kg.
pub struct Mass {
    /// Density ρ, kg/m³.
    pub density: f64,
}

impl Form for Mass {
    fn coupling(&self) -> Coupling {
        Coupling::Components
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        let (kind, n) = (cell.kind, cell.kind.nodes());
        out.fill(0.0);
        for p in kind.mass_rule() {
            let shape = kind.shape(p.at);
            let w = self.density * p.weight * determinant(&jacobian(x, &shape));
            for a in 0..n {
                for b in 0..n {
                    out[n * a + b] += w * shape.values[a] * shape.values[b];
                }
            }
        }
    }
}
