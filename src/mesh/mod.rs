//! Meshes: built-in cylinder or Gmsh file, groups by name, partition and distribution.

pub mod cylinder;
pub mod distribute;
pub mod msh;
pub mod quality;

use std::collections::BTreeMap;

/// A whole hexahedral mesh, as read or built on rank 0. Every body is kept in *lower form*: it lies below the contact
/// plane (z < 0, contact point at the origin, z the outward normal there); an upper body is reflected in z when used.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Node coordinates, m, `[n_nodes][3]`.
    pub nodes: Vec<[f64; 3]>,
    /// Eight nodes of each hexahedron in VTK (= Gmsh) order, positive Jacobian.
    pub cells: Vec<[u32; 8]>,
    /// Boundary quadrilaterals by physical group name, outward orientation.
    pub groups: BTreeMap<String, Vec<[u32; 4]>>,
}
