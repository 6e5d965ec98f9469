//! Nodes that were not merged, and bodies in several pieces: cracks that nothing else would show.

use super::{FileContents, FileOrigin, MeshPieces};
use crate::mesh::quality::volume;
use crate::mesh::Mesh;
use crate::Result;
use std::collections::HashSet;

/// Two nodes nearer than this part of the shortest edge are one that was not merged.
const OF_EDGE: f64 = 1e-3;
/// Least volume of a cell over the cube of its longest edge: less would cost the stiffness more than half of its
/// digits.
const FLATTEST: f64 = 1e-8;
/// And so are those nearer than this part of the mesh's extent.
const OF_EXTENT: f64 = 1e-10;

impl FileContents {
    /// Refuses meshes with unmerged nodes or in several pieces where one is `expected`, and cells that are too flat; a
    /// remark on flat ones.
    pub(super) fn check_seams(
        &self,
        mesh: &Mesh,
        origin: &dyn FileOrigin,
        expected: MeshPieces,
    ) -> Result<Option<String>> {
        let size = mesh.nodes.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let step = (OF_EDGE * shortest_link(mesh)).max(OF_EXTENT * size);
        let pieces = JoinedCells::new(mesh);
        let mut pairs = coincident(&mesh.nodes, step);
        let flat = self.flat_cells(mesh, &mut pairs, origin)?;
        if let Some(&[a, b]) = pairs.iter().min() {
            pairs.sort_unstable();
            pairs.dedup();
            let [x, y, z] = mesh.nodes[a as usize];
            let [first, second] = [a, b].map(|n| origin.number(self.tags[n as usize]));
            let what = match pairs.len() {
                1 => String::new(),
                n => format!(
                    "{n} pairs of nodes are so: the mesh is not joined along a seam, where the body would be cut. "
                ),
            };
            let cut = match pieces.count {
                1 => String::new(),
                n => format!("The cells form {n} pieces. "),
            };
            return Err(origin.error(
                self.node_at[b as usize],
                format!(
                    "the nodes {first} and {second} lie at the same place ({x:.6}, {y:.6}, {z:.6}), nearer than \
                     {step:.1e} in the file's unit. \
                     {what}{cut}Expected merged nodes ({})",
                    origin.merge()
                ),
            ));
        }
        if pieces.count > 1 && expected == MeshPieces::One {
            let count = pieces.count;
            let (cell, node, cells) = pieces.other(mesh);
            let [x, y, z] = mesh.nodes[node as usize];
            return Err(origin.error(
                self.cell_at[cell],
                format!(
                    "the cells form {count} pieces that share no node; {cells} of {} cells hang together with \
                     {} {} at ({x:.6}, {y:.6}, {z:.6}) and not with the \
                     first; expected one body, in one piece",
                    mesh.cells.len(),
                    mesh.cells.get(cell).kind.topology().name,
                    origin.number(self.cell_tags[cell])
                ),
            ));
        }
        Ok(flat)
    }

    /// Takes out pairs of nodes of one cell, which is then flat: opposite edges of it cross. A remark on such cells, or
    /// an error where one is too flat to be computed with.
    fn flat_cells(&self, mesh: &Mesh, pairs: &mut Vec<[u32; 2]>, origin: &dyn FileOrigin) -> Result<Option<String>> {
        if pairs.is_empty() {
            return Ok(None);
        }
        pairs.iter_mut().for_each(|p| p.sort_unstable());
        let wanted: HashSet<[u32; 2]> = pairs.iter().copied().collect();
        let ends: HashSet<u32> = wanted.iter().flatten().copied().collect();
        let (mut within, mut flat) = (HashSet::new(), Vec::new());
        for (number, cell) in mesh.cells.iter().enumerate() {
            let mut nodes: Vec<u32> = cell.nodes.iter().copied().filter(|n| ends.contains(n)).collect();
            nodes.sort_unstable();
            let own = nodes.iter().enumerate().flat_map(|(i, &a)| nodes[i + 1..].iter().map(move |&b| [a, b]));
            let own: Vec<[u32; 2]> = own.filter(|pair| wanted.contains(pair)).collect();
            if let Some(&pair) = own.first() {
                let places = cell.places(&mesh.nodes);
                let length = |&[a, b]: &[u8; 2]| {
                    let [p, q] = [a, b].map(|i| places[i as usize]);
                    p.iter().zip(q).map(|(u, v)| (u - v).powi(2)).sum::<f64>().sqrt()
                };
                let longest = cell.kind.links().iter().map(length).fold(0.0, f64::max);
                // Links end at nodes in the middles of edges where there are any.
                let edge = if cell.kind.linear() == cell.kind { longest } else { 2.0 * longest };
                flat.push((volume(cell.kind, &places) / edge.powi(3), number, pair));
                within.extend(own);
            }
        }
        pairs.retain(|p| !within.contains(p));
        let Some(&(quality, number, [a, b])) = flat.iter().min_by(|p, q| p.0.total_cmp(&q.0)) else { return Ok(None) };
        let [a, b] = [a, b].map(|n| origin.number(self.tags[n as usize]));
        let (kind, tag) = (mesh.cells.get(number).kind.topology().name, origin.number(self.cell_tags[number]));
        let text = format!(
            "{kind} {tag} is flat: its nodes {a} and {b} nearly meet, and its volume is {quality:.1e} of the cube of \
             its longest edge"
        );
        if !(quality >= FLATTEST) {
            return Err(origin.error(
                self.cell_at[number],
                format!(
                    "{text}; expected at least {FLATTEST:.0e}. {} cells are so: mesh again, or optimise (gmsh \
                     -optimize_netgen)",
                    flat.len()
                ),
            ));
        }
        Ok(Some(format!("{text}; {} of {} cells are so, and are taken as they are", flat.len(), mesh.cells.len())))
    }
}

/// Shortest distance between neighbouring nodes of a cell.
fn shortest_link(mesh: &Mesh) -> f64 {
    let mut shortest = f64::INFINITY;
    for cell in mesh.cells.iter() {
        for &[a, b] in cell.kind.links() {
            let [p, q] = [a, b].map(|i| mesh.nodes[cell.nodes[i as usize] as usize]);
            shortest = shortest.min(p.iter().zip(q).map(|(u, v)| (u - v).powi(2)).sum());
        }
    }
    shortest.sqrt()
}

/// Pairs of nodes in the same cube of the edge `step`. Cubes are laid twice, so that few pairs that are much nearer
/// lie on either side of a border both times.
fn coincident(nodes: &[[f64; 3]], step: f64) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    let mut keyed: Vec<(u64, u32)> = Vec::with_capacity(nodes.len());
    for shift in [0.0, 0.5] {
        let place = |x: &[f64; 3]| x.map(|v| (v / step + shift).round() as i64);
        keyed.clear();
        keyed.extend(nodes.iter().enumerate().map(|(i, x)| (mixed(place(x)), i as u32)));
        keyed.sort_unstable();
        for run in keyed.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
            // Different cubes may have one key.
            let same = |w: &&[(u64, u32)]| place(&nodes[w[0].1 as usize]) == place(&nodes[w[1].1 as usize]);
            pairs.extend(run.windows(2).filter(same).map(|w| [w[0].1, w[1].1]));
        }
    }
    pairs
}

/// A number that differs for different cubes, nearly always.
fn mixed(place: [i64; 3]) -> u64 {
    place.iter().fold(0u64, |h, &v| {
        let h = (h ^ v as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        h ^ (h >> 29)
    })
}

/// Nodes that hang together through cells.
pub(in crate::mesh) struct JoinedCells {
    root: Vec<u32>,
    count: usize,
}

impl JoinedCells {
    pub(in crate::mesh) fn new(mesh: &Mesh) -> Self {
        let mut pieces = JoinedCells { root: (0..mesh.nodes.len() as u32).collect(), count: mesh.nodes.len() };
        for cell in mesh.cells.iter() {
            for &n in &cell.nodes[1..] {
                let (a, b) = (pieces.find(cell.nodes[0]), pieces.find(n));
                if a != b {
                    pieces.root[a.max(b) as usize] = a.min(b);
                    pieces.count -= 1;
                }
            }
        }
        pieces
    }

    /// The first node of the piece of node `i`.
    pub(in crate::mesh) fn find(&mut self, mut i: u32) -> u32 {
        while self.root[i as usize] != i {
            self.root[i as usize] = self.root[self.root[i as usize] as usize];
            i = self.root[i as usize];
        }
        i
    }

    /// The first cell outside the piece of the first one, a node of it, and the number of cells of its piece.
    fn other(mut self, mesh: &Mesh) -> (usize, u32, usize) {
        let nodes = |i: usize| mesh.cells.get(i).nodes[0];
        let first = self.find(nodes(0));
        let cell = (1..mesh.cells.len()).find(|&i| self.find(nodes(i)) != first).unwrap_or(0);
        let piece = self.find(nodes(cell));
        let cells = (0..mesh.cells.len()).filter(|&i| self.find(nodes(i)) == piece).count();
        (cell, nodes(cell), cells)
    }
}
