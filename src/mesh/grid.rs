//! The rectilinear grid of contact nodes that a body offers to the interface.

/// Tensor-product grid of surface nodes around the contact point. Node `(i, j)` has index `i + nx*j`.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactGrid {
    /// Longitudinal node positions, m, `[nx]`, ascending.
    pub x: Vec<f64>,
    /// Lateral node positions, m, `[ny]`, ascending.
    pub y: Vec<f64>,
    /// Mesh node (index into [`super::Mesh::nodes`]) of each grid node, `[nx*ny]`.
    pub nodes: Vec<u32>,
    /// Height z of the surface of the body in lower form at each grid node, m, `[nx*ny]`; 0 at the contact point, negative away from it.
    pub z: Vec<f64>,
}
