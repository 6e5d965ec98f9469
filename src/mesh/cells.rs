//! Cells in blocks of one kind, and facets as faces of cells.

use super::kind::{CellKind, Face};
use std::collections::HashMap;

/// Consecutive cells of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Their kind.
    pub kind: CellKind,
    /// Number of the first of them among all cells.
    pub first: usize,
    /// Their nodes, cell by cell, `[cells * kind.nodes()]`.
    pub nodes: Vec<u32>,
}

impl Block {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.kind.nodes()
    }

    /// True for a block without cells.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}

/// Cells, numbered from 0 through blocks of one kind each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    blocks: Vec<Block>,
}

/// A cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell<'a> {
    /// Its kind.
    pub kind: CellKind,
    /// Its nodes, `[kind.nodes()]`.
    pub nodes: &'a [u32],
}

/// A facet: a face of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Facet {
    /// Number of the cell.
    pub cell: u32,
    /// Number of the face in the cell.
    pub face: u8,
}

/// Key on which two cells on either side of a facet agree: its corners, ascending; the last is `u32::MAX` for a
/// triangle.
pub type FacetKey = [u32; 4];

/// The key of a facet with three or four `corners` in any order.
pub fn facet_key(corners: impl IntoIterator<Item = u32>) -> FacetKey {
    let mut key = [u32::MAX; 4];
    key.iter_mut().zip(corners).for_each(|(k, c)| *k = c);
    key.sort_unstable();
    key
}

impl Cells {
    /// Adds a cell behind the others.
    pub fn push(&mut self, kind: CellKind, nodes: &[u32]) {
        debug_assert_eq!(nodes.len(), kind.nodes());
        match self.blocks.last_mut() {
            Some(last) if last.kind == kind => last.nodes.extend_from_slice(nodes),
            _ => self.blocks.push(Block { kind, first: self.len(), nodes: nodes.to_vec() }),
        }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.blocks.last().map_or(0, |b| b.first + b.len())
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// The blocks, in order; neighbouring ones are of different kinds.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The cell with number `i`.
    pub fn get(&self, i: usize) -> Cell<'_> {
        let block = &self.blocks[self.blocks.partition_point(|b| b.first <= i) - 1];
        let (n, at) = (block.kind.nodes(), i - block.first);
        Cell { kind: block.kind, nodes: &block.nodes[n * at..n * (at + 1)] }
    }

    /// All cells in order.
    pub fn iter(&self) -> impl Iterator<Item = Cell<'_>> + Clone {
        self.blocks
            .iter()
            .flat_map(|b| b.nodes.chunks_exact(b.kind.nodes()).map(move |nodes| Cell { kind: b.kind, nodes }))
    }

    /// The nodes of all cells, one after the other.
    pub fn all_nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.blocks.iter().flat_map(|b| b.nodes.iter().copied())
    }

    /// Gives their nodes other numbers.
    pub(crate) fn renumber(&mut self, number: impl Fn(u32) -> u32) {
        self.blocks.iter_mut().flat_map(|b| &mut b.nodes).for_each(|n| *n = number(*n));
    }

    /// These cells with other numbers for their nodes.
    pub fn renumbered(&self, number: impl Fn(u32) -> u32) -> Cells {
        let mut cells = self.clone();
        cells.renumber(number);
        cells
    }

    /// Nodes of a facet, corners first, outward.
    pub fn facet(&self, facet: Facet) -> impl Iterator<Item = u32> + Clone + '_ {
        self.get(facet.cell as usize).facet(facet.face as usize)
    }

    /// The first facet of the cells with each of the `wanted` keys; none where no cell has such a face.
    pub fn find_facets(&self, wanted: &[FacetKey]) -> Vec<Option<Facet>> {
        let mut found: HashMap<FacetKey, Option<Facet>> = wanted.iter().map(|&k| (k, None)).collect();
        self.visit_facets(wanted, |key, facet| {
            found.entry(key).and_modify(|f| {
                f.get_or_insert(facet);
            });
        });
        wanted.iter().map(|k| found.get(k).copied().flatten()).collect()
    }

    /// The faces that one cell alone has, in the order of the cells.
    pub fn boundary(&self) -> Vec<Facet> {
        let mut open: HashMap<FacetKey, Facet> = HashMap::new();
        for (i, cell) in self.iter().enumerate() {
            for face in 0..cell.kind.faces().len() {
                let key = cell.facet_key(face);
                // Met for the second time it lies between two cells.
                if open.remove(&key).is_none() {
                    open.insert(key, Facet { cell: i as u32, face: face as u8 });
                }
            }
        }
        let mut facets: Vec<Facet> = open.into_values().collect();
        facets.sort_unstable();
        facets
    }

    /// Calls `visit` with every face of every cell whose corners all occur in the `wanted` keys.
    fn visit_facets(&self, wanted: &[FacetKey], mut visit: impl FnMut(FacetKey, Facet)) {
        let last = self.all_nodes().max().map_or(0, |n| n as usize + 1);
        let mut touched = vec![false; last];
        wanted.iter().flatten().for_each(|&n| {
            if let Some(t) = touched.get_mut(n as usize) {
                *t = true;
            }
        });
        for (i, cell) in self.iter().enumerate() {
            for face in 0..cell.kind.faces().len() {
                if cell.facet_corners(face).all(|n| touched[n as usize]) {
                    visit(cell.facet_key(face), Facet { cell: i as u32, face: face as u8 });
                }
            }
        }
    }

    /// Number of cells that have each of the `facets`: 1 on the boundary, 2 within.
    pub fn sharing(&self, facets: &[Facet]) -> Vec<usize> {
        let keys: Vec<FacetKey> = facets.iter().map(|&f| self.facet_key(f)).collect();
        let mut count: HashMap<FacetKey, usize> = keys.iter().map(|&k| (k, 0)).collect();
        self.visit_facets(&keys, |key, _| {
            count.entry(key).and_modify(|n| *n += 1);
        });
        keys.iter().map(|k| count[k]).collect()
    }

    /// The key of a facet.
    pub fn facet_key(&self, facet: Facet) -> FacetKey {
        self.get(facet.cell as usize).facet_key(facet.face as usize)
    }
}

impl<'a> Cell<'a> {
    /// Places of its nodes, m, `[kind.nodes()]`.
    pub fn places(&self, coords: &[[f64; 3]]) -> Vec<[f64; 3]> {
        self.nodes.iter().map(|&n| coords[n as usize]).collect()
    }

    /// Nodes of a face, corners first, outward.
    pub fn facet(&self, face: usize) -> impl Iterator<Item = u32> + Clone + 'a {
        let (nodes, Face { nodes: local, .. }) = (self.nodes, &self.kind.faces()[face]);
        local.iter().map(move |&i| nodes[i as usize])
    }

    /// Corners of a face, outward.
    pub fn facet_corners(&self, face: usize) -> impl Iterator<Item = u32> + Clone + 'a {
        self.facet(face).take(self.kind.faces()[face].kind.corners())
    }

    /// The key of a face.
    pub fn facet_key(&self, face: usize) -> FacetKey {
        facet_key(self.facet_corners(face))
    }
}
