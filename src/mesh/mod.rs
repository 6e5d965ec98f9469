//! Meshes: built-in cylinder or file of Gmsh, Abaqus or CalculiX, cells of any kind, groups by name, partition and
//! distribution.

pub(crate) mod attitude;
pub mod cells;
pub mod cylinder;
pub mod distribute;
pub(crate) mod file;
pub mod inp;
pub(crate) mod kind;
mod listed;
pub(crate) mod motion;
pub mod msh;
pub(crate) mod quality;
pub(crate) mod reference;

pub use cells::{facet_key, Cell, Cells, Facet, FacetKey};
pub use kind::{CellKind, FacetKind};

use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

/// A whole mesh, as read or built on rank 0. Every body is kept in *lower form*: it lies below the contact
/// plane (z < 0, contact point at the origin, z the outward normal there); an upper body is reflected in z when used.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Node coordinates, m, `[n_nodes][3]`.
    pub nodes: Vec<[f64; 3]>,
    /// Cells with positive Jacobians.
    pub cells: Cells,
    /// Boundary facets by physical group name.
    pub groups: BTreeMap<String, Vec<Facet>>,
    /// Source of the names of the groups.
    pub naming: Naming,
    /// Groups by their full names in a deck with parts, `instance.set`, where they have another name.
    pub aliases: BTreeMap<String, String>,
}

/// Number of pieces without a common node that a mesh is expected to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshPieces {
    /// One: others are cracks.
    One,
    /// Any, as the pads of a brake.
    Several,
}

/// Place in the file at which surfaces are named.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Naming {
    /// Physical groups of Gmsh.
    #[default]
    Gmsh,
    /// Surfaces and sets of Abaqus or CalculiX.
    Abaqus,
}

impl Naming {
    /// Returns the way to make a surface a group.
    fn advice(self) -> &'static str {
        match self {
            Self::Gmsh => "Name the surface as a physical group in Gmsh",
            Self::Abaqus => {
                "Name the surface in Abaqus or CalculiX, by *SURFACE or as an *NSET of all its nodes; upper and \
                 lower case are the same there, and names are in lower \
                 case here"
            }
        }
    }
}

impl Mesh {
    /// Volume of the mesh, m³.
    pub fn volume(&self) -> f64 {
        self.cells.iter().map(|c| quality::volume(c.kind, &c.places(&self.nodes))).sum()
    }

    /// Mean number of nodes that a node shares a cell with, itself included: blocks in a row of the stiffness.
    pub fn neighbours(&self) -> f64 {
        // The cells at each node, in compressed rows.
        let mut start = vec![0usize; self.nodes.len() + 1];
        self.cells.all_nodes().for_each(|n| start[n as usize + 1] += 1);
        for i in 0..self.nodes.len() {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut at = vec![0u32; start[self.nodes.len()]];
        for (c, cell) in self.cells.iter().enumerate() {
            for &n in cell.nodes {
                at[next[n as usize]] = c as u32;
                next[n as usize] += 1;
            }
        }
        let mut seen = vec![u32::MAX; self.nodes.len()];
        let mut count = 0u64;
        for node in 0..self.nodes.len() {
            for &c in &at[start[node]..start[node + 1]] {
                for &n in self.cells.get(c as usize).nodes {
                    count += u64::from(std::mem::replace(&mut seen[n as usize], node as u32) != node as u32);
                }
            }
        }
        count as f64 / self.nodes.len().max(1) as f64
    }

    /// First node of the piece of each node, `[n_nodes]`: pieces have no common node.
    pub fn pieces(&self) -> Vec<u32> {
        let mut joined = listed::JoinedCells::new(self);
        (0..self.nodes.len() as u32).map(|node| joined.find(node)).collect()
    }

    /// The mesh mirrored in the plane z = 0. Nodes and cells keep their numbers; the nodes of the cells are reordered
    /// so that Jacobians stay positive. Twice gives the same mesh again.
    pub fn reflected(&self) -> Mesh {
        let mut cells = Cells::default();
        for cell in self.cells.iter() {
            let nodes: Vec<u32> = cell.kind.topology().mirror.iter().map(|&i| cell.nodes[i as usize]).collect();
            cells.push(cell.kind, &nodes);
        }
        let image = |f: &Facet| {
            let kind = self.cells.get(f.cell as usize).kind;
            Facet { cell: f.cell, face: kind.mirrored_face(f.face as usize) as u8 }
        };
        Mesh {
            nodes: self.nodes.iter().map(|&[x, y, z]| [x, y, -z]).collect(),
            cells,
            groups: self.groups.iter().map(|(n, facets)| (n.clone(), facets.iter().map(image).collect())).collect(),
            naming: self.naming,
            aliases: self.aliases.clone(),
        }
    }

    /// True where the two meshes (both in lower form) are the same body: same numbering, same groups, node positions
    /// equal to 1e-12 of the largest coordinate. Such bodies need to be computed once only.
    pub fn identical(&self, other: &Mesh) -> bool {
        let size = self.nodes.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let near = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(p, q)| (p - q).abs() <= 1e-12 * size);
        self.nodes.len() == other.nodes.len()
            && self.cells == other.cells
            && self.groups == other.groups
            && self.nodes.iter().zip(&other.nodes).all(|(a, b)| near(a, b))
    }

    /// SHA-256 of the mesh, in hexadecimal: coordinates bit by bit, cells, nodes of the facets of the groups. Cells
    /// of another kind than the eight-node hexahedron come with their kind.
    pub fn checksum(&self) -> String {
        let mut hash = Sha256::new();
        hash.update((self.nodes.len() as u64).to_le_bytes());
        hash.update(bytes(self.nodes.iter().flatten().map(|v| v.to_le_bytes())));
        hash.update((self.cells.len() as u64).to_le_bytes());
        for block in self.cells.blocks() {
            if block.kind != CellKind::Hex8 {
                hash.update([block.kind.topology().vtk]);
                hash.update((block.len() as u64).to_le_bytes());
            }
            hash.update(bytes(block.nodes.iter().map(|n| n.to_le_bytes())));
        }
        for (name, facets) in &self.groups {
            hash.update((name.len() as u64).to_le_bytes());
            hash.update(name.as_bytes());
            hash.update((facets.len() as u64).to_le_bytes());
            hash.update(bytes(facets.iter().flat_map(|&f| self.cells.facet(f)).map(|n| n.to_le_bytes())));
        }
        hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }

    /// Adds the groups that `names` call by their full names, or in another case if the format knows none.
    pub(crate) fn add_aliases<'a>(&mut self, names: impl Iterator<Item = &'a String>) {
        for name in names.filter(|n| !self.groups.contains_key(*n)).cloned().collect::<Vec<_>>() {
            let lower = if self.naming == Naming::Abaqus { name.to_lowercase() } else { name.clone() };
            let group = self.aliases.get(&lower).unwrap_or(&lower);
            if let Some(facets) = self.groups.get(group).cloned() {
                self.groups.insert(name, facets);
            }
        }
    }

    /// Checks that the mesh, from `source`, has the facet group `group`; the error names those it has.
    pub fn require_group(&self, group: &str, source: &str) -> Result<()> {
        if self.groups.get(group).is_some_and(|facets| !facets.is_empty()) {
            return Ok(());
        }
        let ending = format!(".{group}");
        let several: Vec<String> =
            self.groups.keys().filter(|n| n.ends_with(&ending)).map(|n| format!("\"{n}\"")).collect();
        if several.len() > 1 {
            return Err(Error::Input(format!(
                "{source} has several groups \"{group}\", of parts and of the assembly: {}; expected one of these \
                 names",
                several.join(", ")
            )));
        }
        let there = self.groups.iter().filter(|(_, facets)| !facets.is_empty());
        let found: Vec<String> = there.map(|(name, _)| format!("\"{name}\"")).collect();
        let found = if found.is_empty() { "none".to_string() } else { found.join(", ") };
        Err(Error::Input(format!(
            "{source} has no group \"{group}\" of boundary facets; found: {found}. {}",
            self.naming.advice()
        )))
    }
}

fn bytes<const N: usize>(values: impl Iterator<Item = [u8; N]>) -> Vec<u8> {
    values.flatten().collect()
}
