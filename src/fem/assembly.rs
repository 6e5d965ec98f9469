//! Distributed assembly of stiffness and mass. Each rank holds every cell that touches its nodes and so computes its own
//! rows whole: no entry travels, and the pattern is known before the first value, from the node graph.

use super::dofs::{DofMap, FIXED};
use super::{hex8, Material};
use crate::mesh::distribute::MeshPart;
use crate::mesh::quality;
use crate::parallel::World;
use crate::petsc::csr::DistCsr;
use crate::{Error, Result};

/// Stiffness and mass of the free degrees of freedom of one body.
#[derive(Debug, Clone)]
pub struct Operators {
    /// Stiffness K, N/m.
    pub stiffness: DistCsr,
    /// Consistent mass M, kg; couples equal components only.
    pub mass: DistCsr,
}

/// Sorted neighbours (itself included) of each owned node in the mesh, as local nodes ordered by global number.
fn node_graph(part: &MeshPart) -> Vec<Vec<u32>> {
    let mut graph: Vec<Vec<u32>> = vec![Vec::new(); part.owned];
    for cell in &part.cells {
        for &a in cell {
            if (a as usize) < part.owned {
                graph[a as usize].extend_from_slice(cell);
            }
        }
    }
    for list in &mut graph {
        list.sort_unstable_by_key(|&n| part.node_ids[n as usize]);
        list.dedup();
    }
    graph
}

/// An empty matrix with the pattern of the graph: full 3×3 blocks, or only their diagonals.
fn pattern(graph: &[Vec<u32>], dofs: &DofMap, full_blocks: bool) -> DistCsr {
    let rows = dofs.owned();
    let per_node = if full_blocks { 3 } else { 1 };
    let entries: usize = graph
        .iter()
        .enumerate()
        .filter(|(n, _)| dofs.local[*n] != FIXED)
        .map(|(_, l)| 3 * per_node * l.iter().filter(|&&m| dofs.local[m as usize] != FIXED).count())
        .sum();
    let mut indptr = Vec::with_capacity(rows + 1);
    let mut cols = Vec::with_capacity(entries);
    indptr.push(0);
    for (n, list) in graph.iter().enumerate() {
        if dofs.local[n] == FIXED {
            continue;
        }
        for c in 0..3 {
            for &m in list {
                let first = dofs.local[m as usize];
                if first == FIXED {
                    continue;
                }
                if full_blocks {
                    cols.extend([first, first + 1, first + 2]);
                } else {
                    cols.push(first + c);
                }
            }
            indptr.push(cols.len());
        }
    }
    let values = vec![0.0; cols.len()];
    DistCsr { ranges: dofs.ranges.clone(), indptr, cols, values }
}

/// Collective: assembles K and M of the body with one material. An element that is inverted is an [`Error::Input`] that names it.
pub fn assemble(world: &World, part: &MeshPart, dofs: &DofMap, material: &Material) -> Result<Operators> {
    let graph = node_graph(part);
    let mut stiffness = pattern(&graph, dofs, true);
    let mut mass = pattern(&graph, dofs, false);
    let begin = dofs.begin();
    let local = (|| {
        for (cell, id) in part.cells.iter().zip(&part.cell_ids) {
            let x = cell.map(|n| part.coords[n as usize]);
            let [det, _] = quality::jacobian_range(&x);
            if det.is_nan() || det <= 0.0 {
                return Err(Error::Input(format!(
                    "mesh: element {id} is inverted or degenerate (Jacobian {det:e} m³ at a corner, must be positive); \
                     its corners are {x:?}; repair the mesh"
                )));
            }
            let ke = hex8::stiffness(&x, material);
            let me = hex8::mass(&x, material.density);
            for (a, &na) in cell.iter().enumerate() {
                if na as usize >= part.owned || dofs.local[na as usize] == FIXED {
                    continue;
                }
                let row = (dofs.local[na as usize] - begin) as usize;
                let k_base = stiffness.indptr[row];
                let k_len = stiffness.indptr[row + 1] - k_base;
                let m_base = mass.indptr[row];
                let m_len = mass.indptr[row + 1] - m_base;
                for (b, &nb) in cell.iter().enumerate() {
                    let first = dofs.local[nb as usize];
                    if first == FIXED {
                        continue;
                    }
                    // The pattern was made from these very cells: the column is there.
                    let at = mass.cols[m_base..m_base + m_len].partition_point(|&c| c < first);
                    for c in 0..3 {
                        mass.values[m_base + c * m_len + at] += me[a][b];
                        let k_row = k_base + c * k_len + 3 * at;
                        for d in 0..3 {
                            stiffness.values[k_row + d] += ke[3 * a + c][3 * b + d];
                        }
                    }
                }
            }
        }
        Ok(())
    })();
    world.agree(local)?;
    Ok(Operators { stiffness, mass })
}

/// Collective: volume of the mesh, m³, each cell counted once.
pub fn volume(world: &World, part: &MeshPart) -> f64 {
    let mine: f64 = part
        .cells
        .iter()
        .zip(&part.cell_owned)
        .filter(|(_, &o)| o)
        .map(|(c, _)| quality::volume(&c.map(|n| part.coords[n as usize])))
        .sum();
    world.sum(mine)
}
