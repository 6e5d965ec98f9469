//! A mesh as a file lists it: nodes and elements by their numbers there, with their places in the file. Readers of
//! all formats fill it in; what they have in common, checks first of all, is here.

mod check;
mod groups;
mod index;
mod unmerged_nodes;

use super::{CellKind, Cells, Facet, FacetKind, Mesh, MeshPieces};
use crate::{Error, Result};
pub(super) use index::Index;
use std::collections::HashMap;
pub(super) use unmerged_nodes::JoinedCells;

/// Positions in a file, for messages. A place is a number that only the reader of the format understands.
pub(super) trait FileOrigin {
    /// An error that names the file and the line or byte of the place `at`.
    fn error(&self, at: u64, what: String) -> Error;

    /// The number of a node or an element in words.
    fn number(&self, tag: u64) -> String {
        tag.to_string()
    }

    /// Advice on nodes that were not merged.
    fn merge(&self) -> &'static str;
}

/// Contents of a file, as read.
#[derive(Default)]
pub(super) struct FileContents {
    /// Numbers of the nodes in the file, `[n]`.
    pub tags: Vec<u64>,
    /// Their coordinates in the file's unit, `[n][3]`.
    pub coords: Vec<[f64; 3]>,
    /// Their places, `[n]`.
    pub node_at: Vec<u64>,
    index: Index,
    /// Cells; their nodes are positions among those above.
    pub cells: Cells,
    /// Numbers of the cells in the file, `[cells]`.
    pub cell_tags: Vec<u64>,
    /// Their places, `[cells]`.
    pub cell_at: Vec<u64>,
    /// Facets that the file lists as elements.
    pub facets: Vec<ListedFacet>,
    /// Groups that each surface of those facets is in.
    pub surfaces: HashMap<i32, Vec<String>>,
    /// Faces of cells in groups.
    pub faces: Vec<(String, Facet)>,
    /// Nodes in groups, by their positions: the groups are the faces between these nodes.
    pub node_sets: Vec<(String, Vec<u32>)>,
}

/// A facet on a surface of the model.
pub(super) struct ListedFacet {
    pub kind: FacetKind,
    pub surface: i32,
    pub tag: u64,
    pub at: u64,
    /// True for a shell or a membrane, which need not be a face of a cell.
    pub loose: bool,
    /// Positions of its corners, the first `kind.corners()` of these; `u32::MAX` for one that is not among the nodes.
    pub corners: [u32; 4],
}

impl FileContents {
    /// Makes room for some more nodes, and no more room.
    pub fn reserve_nodes(&mut self, more: usize) {
        self.tags.reserve_exact(more);
        self.coords.reserve_exact(more);
        self.node_at.reserve_exact(more);
    }

    /// Takes a node.
    pub fn node(&mut self, tag: u64, at: u64, coords: [f64; 3]) {
        self.tags.push(tag);
        self.node_at.push(at);
        self.coords.push(coords);
    }

    /// When all nodes are there, and before the first element: makes them to be found by their numbers.
    pub fn number(&mut self, origin: &dyn FileOrigin) -> Result<()> {
        self.index = Index::new(&self.tags).map_err(|i| {
            origin.error(self.node_at[i], format!("a second node {}; expected one", origin.number(self.tags[i])))
        })?;
        Ok(())
    }

    /// Position of the node with a number.
    pub fn position(&self, tag: u64) -> Option<u32> {
        self.index.get(tag)
    }

    /// Takes a cell with the numbers of its `nodes` in a file's order: `order` is the node of the cell at each place
    /// of it.
    pub fn cell(
        &mut self,
        kind: CellKind,
        [tag, at]: [u64; 2],
        order: &[u8],
        nodes: &[u64],
        origin: &dyn FileOrigin,
    ) -> Result<()> {
        let mut positions = [0u32; super::kind::MAX_NODES];
        for (&to, &node) in order.iter().zip(nodes) {
            positions[to as usize] =
                self.index.get(node).ok_or_else(|| missing(kind.topology().name, [tag, at], node, origin))?;
        }
        self.cells.push(kind, &positions[..kind.nodes()]);
        self.cell_tags.push(tag);
        self.cell_at.push(at);
        Ok(())
    }

    /// Takes a facet in `surface` with the numbers of its nodes, corners first.
    pub fn facet(&mut self, kind: FacetKind, surface: i32, [tag, at]: [u64; 2], nodes: &[u64]) {
        let mut corners = [u32::MAX; 4];
        corners
            .iter_mut()
            .zip(&nodes[..kind.corners()])
            .for_each(|(to, &n)| *to = self.index.get(n).unwrap_or(u32::MAX));
        self.facets.push(ListedFacet { kind, surface, tag, at, loose: false, corners });
    }

    /// Drops cells that occurred before with the same nodes.
    pub fn keep_first(&mut self) {
        let mut seen = std::collections::HashSet::new();
        let (mut cells, mut tags, mut at) = (Cells::default(), Vec::new(), Vec::new());
        for (i, cell) in self.cells.iter().enumerate() {
            if seen.insert(cell.nodes.to_vec()) {
                cells.push(cell.kind, cell.nodes);
                tags.push(self.cell_tags[i]);
                at.push(self.cell_at[i]);
            }
        }
        (self.cells, self.cell_tags, self.cell_at) = (cells, tags, at);
    }

    /// Checks what was read and makes the mesh of it; nodes keep their order, unused ones are dropped. Beside the
    /// mesh it has remarks for the user.
    pub fn mesh(mut self, origin: &dyn FileOrigin, pieces: MeshPieces) -> Result<(Mesh, Vec<String>)> {
        self.index = Index::default();
        let mut number = vec![u32::MAX; self.tags.len()];
        self.cells.all_nodes().for_each(|n| number[n as usize] = 0);
        number.iter_mut().filter(|n| **n == 0).zip(0..).for_each(|(new, count)| *new = count);
        let used = |n: &u32| number.get(*n as usize).is_some_and(|new| *new != u32::MAX);
        self.facets.retain(|f| !f.loose || f.corners[..f.kind.corners()].iter().all(used));
        for facet in self.facets.iter_mut().filter(|f| self.surfaces.contains_key(&f.surface)) {
            for corner in &mut facet.corners[..facet.kind.corners()] {
                let (name, place) = (facet.kind.name(), [facet.tag, facet.at]);
                let Some(&new) = number.get(*corner as usize) else {
                    return Err(origin.error(
                        facet.at,
                        format!("{name} {} has a corner that is not among the nodes", origin.number(facet.tag)),
                    ));
                };
                if new == u32::MAX {
                    return Err(origin.error(
                        place[1],
                        format!(
                            "{name} {} has the node {}, which belongs to no cell; expected a face of one",
                            origin.number(facet.tag),
                            origin.number(self.tags[*corner as usize])
                        ),
                    ));
                }
                *corner = new;
            }
        }
        for (_, set) in &mut self.node_sets {
            set.retain_mut(|n| {
                *n = number[*n as usize];
                *n != u32::MAX
            });
        }
        keep(&mut self.tags, &number);
        keep(&mut self.node_at, &number);
        keep(&mut self.coords, &number);
        self.cells.renumber(|n| number[n as usize]);
        drop(number);
        let nodes = std::mem::take(&mut self.coords);
        let mut mesh = Mesh { nodes, cells: std::mem::take(&mut self.cells), ..Mesh::default() };
        self.check_cells(&mesh, origin)?;
        let flat = self.check_seams(&mesh, origin, pieces)?;
        self.check_joints(&mesh, origin)?;
        let mut remarks = self.group(&mut mesh, origin)?;
        remarks.extend(flat);
        Ok((mesh, remarks))
    }
}

/// Keeps the values whose new number is one.
fn keep<T>(values: &mut Vec<T>, number: &[u32]) {
    let mut i = 0;
    values.retain(|_| {
        i += 1;
        number[i - 1] != u32::MAX
    });
}

fn missing(what: &str, [tag, at]: [u64; 2], node: u64, origin: &dyn FileOrigin) -> Error {
    let [tag, node] = [tag, node].map(|t| origin.number(t));
    origin.error(at, format!("{what} {tag} has the node {node}, which is not among the nodes"))
}
