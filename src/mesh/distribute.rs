//! Partition with METIS and distribution of a mesh over the ranks.

use std::collections::BTreeMap;

/// One rank's share of a mesh. Nodes are renumbered so that each rank owns a contiguous range of global numbers.
/// A rank holds every cell that touches one of its nodes, so it can assemble its own rows without communication.
#[derive(Debug, Clone, Default)]
pub struct MeshPart {
    /// Global node number at which each rank's range starts, `[size + 1]`; the last entry is the number of nodes.
    pub ranges: Vec<u64>,
    /// Global numbers of the local nodes: the owned ones first, in order, then the ghosts, ascending.
    pub node_ids: Vec<u64>,
    /// Number of owned nodes.
    pub owned: usize,
    /// Coordinates of the local nodes, m, `[node_ids.len()][3]`.
    pub coords: Vec<[f64; 3]>,
    /// Cells that touch an owned node, as local node indices.
    pub cells: Vec<[u32; 8]>,
    /// Index in the whole mesh of each local cell.
    pub cell_ids: Vec<u64>,
    /// True where this rank is the one that counts and writes the cell: each cell is owned by exactly one rank.
    pub cell_owned: Vec<bool>,
    /// Local node indices (ghosts included) of each boundary group.
    pub groups: BTreeMap<String, Vec<u32>>,
    /// On rank 0: new global number of each node of the whole mesh; empty elsewhere.
    pub renumbered: Vec<u64>,
}
