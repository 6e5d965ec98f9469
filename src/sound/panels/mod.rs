//! Boundary elements on the outline of a section, for bodies of revolution and for those along a line.

mod mesh;
mod panel;
mod surface;

pub use mesh::Meshed;
pub use panel::{Integrals, Kernel, Node, Panel, Point, NODES};
pub use surface::Surface;
