//! Elastic stiffness.

use super::{Coupling, Form};
use crate::fem::element::element;
use crate::fem::Material;
use crate::mesh::Cell;

/// ∫ ε(v) : σ(u) dV, N/m.
pub struct Stiffness(pub Material);

impl Form for Stiffness {
    fn coupling(&self) -> Coupling {
        Coupling::Full
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        element(cell.kind).stiffness(x, &self.0, out);
    }
}
