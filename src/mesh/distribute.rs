//! Partition with METIS and distribution of a mesh over the ranks.

use super::{CellKind, Cells, Facet, Mesh};
use crate::parallel::World;
use crate::{Error, Result};
use metis::Idx;
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
    pub cells: Cells,
    /// Index in the whole mesh of each local cell.
    pub cell_ids: Vec<u64>,
    /// True where this rank is the one that counts and writes the cell: each cell is owned by exactly one rank.
    pub cell_owned: Vec<bool>,
    /// Local node indices (ghosts included, ascending) of each boundary group.
    pub groups: BTreeMap<String, Vec<u32>>,
    /// On rank 0: new global number of each node of the whole mesh; empty elsewhere.
    pub renumbered: Vec<u64>,
    /// Edges of the mesh between nodes of different ranks, on every rank: what METIS minimises.
    pub edge_cut: u64,
}

impl MeshPart {
    /// A mesh that is on rank 0 alone: its nodes, m, and its cells.
    pub(crate) fn undivided(
        world: &World,
        nodes: &[[f64; 3]],
        cells: impl Iterator<Item = (CellKind, Vec<u32>)>,
    ) -> Self {
        let mut part = Self { ranges: vec![nodes.len() as u64; world.size + 1], ..Self::default() };
        part.ranges[0] = 0;
        if world.is_root() {
            cells.for_each(|(kind, nodes)| part.cells.push(kind, &nodes));
            part.node_ids = (0..nodes.len() as u64).collect();
            part.owned = nodes.len();
            part.coords = nodes.to_vec();
            part.cell_ids = (0..part.cells.len() as u64).collect();
            part.cell_owned = vec![true; part.cells.len()];
        }
        part
    }

    /// Boundary facets of which this rank has the corner with the lowest number, in the order of their local nodes:
    /// each facet is on one rank.
    pub fn boundary(&self) -> Vec<Facet> {
        let part = self;
        // All cells at an owned node are here, so its facets are known to be on the boundary; others may only seem so.
        let corners = |f: &Facet| part.cells.get(f.cell as usize).facet_corners(f.face as usize);
        let lowest = |f: &Facet| corners(f).min_by_key(|&n| part.node_ids[n as usize]);
        let mut facets: Vec<Facet> = part
            .cells
            .boundary()
            .into_iter()
            .filter(|f| lowest(f).is_some_and(|n| (n as usize) < part.owned))
            .collect();
        facets.sort_unstable_by(|a, b| part.cells.facet(*a).cmp(part.cells.facet(*b)));
        facets
    }
}

/// Owner of each node, and the number of mesh edges between owners.
struct Partition {
    owner: Vec<u32>,
    edge_cut: u64,
}

/// Neighbours of each node along the edges of the cells, in compressed rows, both directions.
fn node_graph(mesh: &Mesh) -> (Vec<usize>, Vec<u32>) {
    let n = mesh.nodes.len();
    let pairs = || {
        let at = |nodes: &[u32], i: u8| nodes[i as usize] as usize;
        mesh.cells.iter().flat_map(move |c| c.kind.links().iter().map(move |&[a, b]| (at(c.nodes, a), at(c.nodes, b))))
    };
    let mut start = vec![0usize; n + 1];
    for (a, b) in pairs() {
        start[a + 1] += 1;
        start[b + 1] += 1;
    }
    for i in 0..n {
        start[i + 1] += start[i];
    }
    let mut fill = start.clone();
    let mut neighbours = vec![0u32; start[n]];
    for (a, b) in pairs() {
        for (from, to) in [(a, b), (b, a)] {
            neighbours[fill[from]] = to as u32;
            fill[from] += 1;
        }
    }
    // Each edge was met once per cell around it.
    let (mut rows, mut cols) = (vec![0usize; n + 1], Vec::with_capacity(neighbours.len() / 3));
    for i in 0..n {
        let row = &mut neighbours[start[i]..start[i + 1]];
        row.sort_unstable();
        let mut last = None;
        for &b in row.iter().filter(|&&b| b as usize != i) {
            if last != Some(b) {
                cols.push(b);
                last = Some(b);
            }
        }
        rows[i + 1] = cols.len();
    }
    (rows, cols)
}

/// Divides the nodes into `parts` with METIS (k-way on the graph of mesh edges).
fn partition(mesh: &Mesh, parts: usize) -> Result<Partition> {
    let n = mesh.nodes.len();
    if parts <= 1 {
        return Ok(Partition { owner: vec![0; n], edge_cut: 0 });
    }
    let (rows, cols) = node_graph(mesh);
    let owner = if n <= 2 * parts {
        // Too few nodes for METIS to divide sensibly: in turn, some ranks with one or none.
        (0..n as u32).map(|i| i % parts as u32).collect()
    } else {
        metis_owners(&rows, &cols, parts)?
    };
    let mut cut = 0u64;
    for i in 0..n {
        cut += cols[rows[i]..rows[i + 1]].iter().filter(|&&b| owner[b as usize] != owner[i]).count() as u64;
    }
    Ok(Partition { owner, edge_cut: cut / 2 })
}

fn metis_owners(rows: &[usize], cols: &[u32], parts: usize) -> Result<Vec<u32>> {
    let too_large = || {
        Error::Input(format!(
            "mesh: its graph of {} nodes and {} edges is larger than the integers of the installed METIS can \
             number; expected a smaller mesh",
            rows.len() - 1,
            cols.len() / 2
        ))
    };
    let index = |v: usize| Idx::try_from(v).map_err(|_| too_large());
    index(cols.len())?;
    let xadj: Vec<Idx> = rows.iter().map(|&r| r as Idx).collect();
    let adjncy: Vec<Idx> = cols.iter().map(|&c| c as Idx).collect();
    let mut part = vec![0 as Idx; rows.len() - 1];
    metis::Graph::new(1, index(parts)?, &xadj, &adjncy)
        .map_err(|e| Error::Defect(format!("METIS refuses the graph of the mesh: {e}")))?
        // A fixed seed: the same job gives the same partition.
        .set_option(metis::option::Seed(1))
        .part_kway(&mut part)
        .map_err(|e| match e {
            metis::Error::Memory => Error::Memory(format!("METIS ran out of memory dividing {} nodes", rows.len() - 1)),
            e => Error::Defect(format!("METIS could not divide {} nodes among {parts} ranks: {e}", rows.len() - 1)),
        })?;
    part.iter()
        .map(|&p| u32::try_from(p).ok().filter(|&p| (p as usize) < parts))
        .collect::<Option<Vec<u32>>>()
        .ok_or_else(|| Error::Defect(format!("METIS returned a part outside 0..{parts}")))
}

/// Data that rank 0 sends to the ranks, one entry each.
#[derive(Default)]
struct Shares {
    ranges: Vec<u64>,
    renumbered: Vec<u64>,
    edge_cut: u64,
    node_ids: Vec<Vec<u64>>,
    coords: Vec<Vec<f64>>,
    /// Pairs of kind and number of cells, block by block.
    blocks: Vec<Vec<u32>>,
    cell_nodes: Vec<Vec<u32>>,
    cell_ids: Vec<Vec<u64>>,
    cell_owned: Vec<Vec<u8>>,
    names: Vec<String>,
    groups: Vec<Vec<Vec<u32>>>,
}

fn shares(mesh: &Mesh, parts: usize) -> Result<Shares> {
    let n = mesh.nodes.len();
    let Partition { owner, edge_cut } = partition(mesh, parts)?;
    let mut ranges = vec![0u64; parts + 1];
    for &o in &owner {
        ranges[o as usize + 1] += 1;
    }
    for r in 0..parts {
        ranges[r + 1] += ranges[r];
    }
    let mut next = ranges.clone();
    let mut renumbered = vec![0u64; n];
    let mut original = vec![0u32; n];
    for (i, &o) in owner.iter().enumerate() {
        renumbered[i] = next[o as usize];
        original[next[o as usize] as usize] = i as u32;
        next[o as usize] += 1;
    }

    let mut cells_of: Vec<Vec<u32>> = vec![Vec::new(); parts];
    let mut cell_owner = Vec::with_capacity(mesh.cells.len());
    for (e, cell) in mesh.cells.iter().enumerate() {
        let mut ranks: Vec<u32> = cell.nodes.iter().map(|&i| owner[i as usize]).collect();
        ranks.sort_unstable();
        // The rank with the most of the cell's nodes owns it, of equals the lowest.
        let (mut best, mut most) = (ranks[0], 0);
        for run in ranks.chunk_by(|a, b| a == b) {
            cells_of[run[0] as usize].push(e as u32);
            if run.len() > most {
                (best, most) = (run[0], run.len());
            }
        }
        cell_owner.push(best);
    }

    let names: Vec<String> = mesh.groups.keys().cloned().collect();
    let members: Vec<Vec<u32>> = mesh
        .groups
        .values()
        .map(|facets| {
            let mut nodes: Vec<u32> = facets.iter().flat_map(|&f| mesh.cells.facet(f)).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        })
        .collect();

    let mut out = Shares { edge_cut, groups: vec![Vec::new(); names.len()], ..Shares::default() };
    let mut local = vec![u32::MAX; n];
    for r in 0..parts {
        let mine = ranges[r] as usize..ranges[r + 1] as usize;
        let mut nodes: Vec<u32> = original[mine].to_vec();
        for (k, &i) in nodes.iter().enumerate() {
            local[i as usize] = k as u32;
        }
        let mut ghosts: Vec<u32> = cells_of[r]
            .iter()
            .flat_map(|&e| mesh.cells.get(e as usize).nodes)
            .copied()
            .filter(|&i| owner[i as usize] as usize != r)
            .collect();
        ghosts.sort_unstable_by_key(|&i| renumbered[i as usize]);
        ghosts.dedup();
        for (k, &i) in ghosts.iter().enumerate() {
            local[i as usize] = (nodes.len() + k) as u32;
        }
        nodes.extend(&ghosts);

        out.node_ids.push(nodes.iter().map(|&i| renumbered[i as usize]).collect());
        out.coords.push(nodes.iter().flat_map(|&i| mesh.nodes[i as usize]).collect());
        let mut cells = Cells::default();
        cells_of[r].iter().map(|&e| mesh.cells.get(e as usize)).for_each(|c| cells.push(c.kind, c.nodes));
        let code = |kind: CellKind| u32::from(kind.topology().vtk);
        out.blocks.push(cells.blocks().iter().flat_map(|b| [code(b.kind), b.len() as u32]).collect());
        out.cell_nodes.push(cells.all_nodes().map(|i| local[i as usize]).collect());
        out.cell_ids.push(cells_of[r].iter().map(|&e| u64::from(e)).collect());
        out.cell_owned.push(cells_of[r].iter().map(|&e| u8::from(cell_owner[e as usize] as usize == r)).collect());
        for (group, nodes) in out.groups.iter_mut().zip(&members) {
            let mut here: Vec<u32> = nodes.iter().map(|&i| local[i as usize]).filter(|&k| k != u32::MAX).collect();
            here.sort_unstable();
            group.push(here);
        }
        nodes.iter().for_each(|&i| local[i as usize] = u32::MAX);
    }
    // Everything is sent with the 32-bit counts of MPI; coordinates and cells are the longest.
    for (what, total) in [
        ("coordinates", out.coords.iter().map(Vec::len).sum::<usize>()),
        ("cell nodes", out.cell_nodes.iter().map(Vec::len).sum()),
    ] {
        if i32::try_from(total).is_err() {
            return Err(Error::Input(format!(
                "mesh: {total} {what} to distribute, more than the {} that one message can hold; expected a \
                 smaller mesh",
                i32::MAX
            )));
        }
    }
    out.ranges = ranges;
    out.renumbered = renumbered;
    out.names = names;
    Ok(out)
}

/// Collective: divides the mesh of rank 0 (`None` elsewhere) among the ranks and gives each its part. A rank may be
/// left with nothing.
pub fn distribute(world: &World, mesh: Option<&Mesh>) -> Result<MeshPart> {
    let root = world.on_root(|| {
        let mesh = mesh.ok_or_else(|| Error::Defect("rank 0 has no mesh to distribute".into()))?;
        shares(mesh, world.size)
    })?;
    let s = root.unwrap_or_default();
    let ranges = world.broadcast(s.ranges);
    let edge_cut = world.broadcast(vec![s.edge_cut]).first().copied().unwrap_or(0);
    let names = world.broadcast(s.names.join("\n").into_bytes());
    let names = String::from_utf8_lossy(&names).into_owned();
    let node_ids = world.scatter(s.node_ids);
    let coords = world.scatter(s.coords);
    let blocks = world.scatter(s.blocks);
    let cell_nodes = world.scatter(s.cell_nodes);
    let cell_ids = world.scatter(s.cell_ids);
    let cell_owned = world.scatter(s.cell_owned);
    let mut groups = BTreeMap::new();
    let mut per_group = s.groups.into_iter();
    for name in names.split('\n').filter(|n| !n.is_empty()) {
        let members = world.scatter(per_group.next().unwrap_or_default());
        groups.insert(name.to_string(), members);
    }
    let mut cells = Cells::default();
    let mut rest = &cell_nodes[..];
    for block in blocks.chunks_exact(2) {
        let kind = u8::try_from(block[0]).ok().and_then(CellKind::of_vtk);
        let kind =
            kind.ok_or_else(|| Error::Defect(format!("cells of no known kind, {}, were distributed", block[0])))?;
        let (nodes, others) = rest.split_at(kind.nodes() * block[1] as usize);
        nodes.chunks_exact(kind.nodes()).for_each(|nodes| cells.push(kind, nodes));
        rest = others;
    }
    Ok(MeshPart {
        owned: (ranges[world.rank + 1] - ranges[world.rank]) as usize,
        ranges,
        node_ids,
        coords: coords.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
        cells,
        cell_ids,
        cell_owned: cell_owned.iter().map(|&o| o != 0).collect(),
        groups,
        renumbered: s.renumbered,
        edge_cut,
    })
}
