//! Forms: what is integrated over the cells. One file each; [`crate::fem::assembly::Assembly`] assembles any of them.

mod absorbing;
mod foundation;
mod mass;
mod rotation;
mod stiffness;

pub use absorbing::AbsorbingMass;
pub use foundation::{Foundation, SurfaceForm};
pub use mass::Mass;
pub use rotation::{Convected, Gyroscopic, PrestressStiffness};
pub use stiffness::Stiffness;

use crate::mesh::Cell;

/// How a form couples the displacements of two nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeCoupling {
    /// Each component with each: blocks of 3 × 3.
    Full,
    /// Equal components, all three alike: multiples of the identity.
    Components,
}

impl NodeCoupling {
    /// Rows of the matrix of a cell, and of one of its nodes among them.
    pub(crate) fn per_node(self) -> usize {
        match self {
            NodeCoupling::Full => 3,
            NodeCoupling::Components => 1,
        }
    }
}

/// A bilinear form of displacements, symmetric or not.
pub trait Form {
    /// How it couples two nodes.
    fn coupling(&self) -> NodeCoupling;

    /// Returns whether it is symmetric: half of the entries of its matrix are enough then.
    fn symmetric(&self) -> bool {
        true
    }

    /// Matrix of a cell with nodes at `x` (m, `[n][3]`), row-major, `[pn, pn]` with `p` = `NodeCoupling::per_node`;
    /// overwritten.
    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]);
}
