//! Boundary elements on the outline of a section, for bodies of revolution and for those along a line.

mod mesh;
mod panel;
mod surface;

pub use mesh::PanelMesh;
#[cfg(test)]
pub use panel::Panel;
pub use panel::{Integrals, Kernel, OutlinePoint, PanelNode};
pub use surface::PanelSurface;
