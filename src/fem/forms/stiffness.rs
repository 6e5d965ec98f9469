//! Elastic stiffness.

use super::{Form, NodeCoupling};
use crate::fem::element::element;
use crate::fem::ElasticMaterial;
use crate::mesh::Cell;

/// ∫ ε(v) : σ(u) dV, N/m.
pub struct Stiffness(pub ElasticMaterial);

impl Form for Stiffness {
    fn coupling(&self) -> NodeCoupling {
        NodeCoupling::Full
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        element(cell.kind).stiffness(x, &self.0, out);
    }
}
