//! Boundary elements on the outline of a section, for bodies of revolution and for those along a line.

mod mesh;
mod panel;
mod surface;

pub use mesh::Meshed;
#[cfg(test)]
pub use panel::Panel;
pub use panel::{Integrals, Kernel, Node, Point};
pub use surface::Surface;
