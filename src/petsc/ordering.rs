//! Fill-reducing elimination order by METIS nested dissection, on the graph of blocks of rows with the same pattern.
//!
//! The three displacement rows of a node share their pattern, so the graph of blocks is nine times smaller than that of
//! rows, and a separator never cuts through a node.

use super::csr::DistCsr;
use crate::parallel::World;
use crate::{Error, Result};
use metis_sys::idx_t;

/// Collective: position of every row in the elimination, 0-based, on rank 0 (empty elsewhere). The pattern is
/// symmetric.
pub(crate) fn nested_dissection(world: &World, matrix: &DistCsr) -> Result<Vec<u32>> {
    // Consecutive rows with the same columns form a block; a rank's first row always begins one.
    // (Not bytes: the address of an empty slice of them is 1, which Open MPI takes for MPI_IN_PLACE.)
    let (starts, cols) = matrix.whole_pattern();
    let row = |i: usize| &cols[starts[i]..starts[i + 1]];
    let begins: Vec<u32> = (0..matrix.n_local()).map(|i| u32::from(i == 0 || row(i) != row(i - 1))).collect();
    let all = world.all_gather(&begins);
    let mut block_of = Vec::with_capacity(all.len());
    let mut blocks = 0u32;
    for b in all {
        blocks += b;
        block_of.push(blocks - 1);
    }
    let mut degrees: Vec<idx_t> = Vec::new();
    let mut neighbours: Vec<idx_t> = Vec::new();
    let first = matrix.ranges[world.rank] as usize;
    for i in (0..matrix.n_local()).filter(|&i| begins[i] == 1) {
        let own = block_of[first + i];
        let mut last = u32::MAX;
        let before = neighbours.len();
        for &c in row(i) {
            let block = block_of[c as usize];
            // Columns ascend, so repetitions of a block are adjacent.
            if block != own && block != last {
                neighbours.push(block as idx_t);
                last = block;
            }
        }
        degrees.push((neighbours.len() - before) as idx_t);
    }
    let degrees = world.gather(&degrees);
    let neighbours = world.gather(&neighbours);
    let order = world.on_root(|| dissect(&degrees, neighbours, &block_of))?;
    Ok(order.unwrap_or_default())
}

fn dissect(degrees: &[idx_t], mut neighbours: Vec<idx_t>, block_of: &[u32]) -> Result<Vec<u32>> {
    let n = degrees.len();
    let mut starts = Vec::with_capacity(n + 1);
    let mut at: idx_t = 0;
    starts.push(0);
    for &d in degrees {
        at = at.checked_add(d).ok_or_else(|| {
            Error::Memory(format!(
                "the graph of the matrix has more than {} edges, too many for METIS with indices of {} bit; use \
                 solver.linear \"gamg\"",
                idx_t::MAX,
                idx_t::BITS
            ))
        })?;
        starts.push(at);
    }
    let mut weights = vec![0 as idx_t; n];
    for &b in block_of {
        weights[b as usize] += 1;
    }
    let mut place = vec![0 as idx_t; n];
    // METIS stops the process on a graph without vertices, and on one without edges needs none.
    if neighbours.is_empty() {
        place.iter_mut().enumerate().for_each(|(i, p)| *p = i as idx_t);
    } else {
        let mut order = vec![0 as idx_t; n];
        let mut options = [0 as idx_t; metis_sys::METIS_NOPTIONS as usize];
        let mut count = n as idx_t;
        // SAFETY: every array has the length METIS documents for `count` vertices; METIS keeps none of them.
        let status = unsafe {
            metis_sys::METIS_SetDefaultOptions(options.as_mut_ptr());
            metis_sys::METIS_NodeND(
                &mut count,
                starts.as_mut_ptr(),
                neighbours.as_mut_ptr(),
                weights.as_mut_ptr(),
                options.as_mut_ptr(),
                order.as_mut_ptr(),
                place.as_mut_ptr(),
            )
        };
        if status != metis_sys::rstatus_et_METIS_OK {
            return Err(Error::Memory(format!(
                "METIS failed (status {status}) to order a graph of {n} blocks and {} edges: not enough memory for it",
                neighbours.len() / 2
            )));
        }
    }
    let mut block_at = vec![0u32; n];
    for (block, &p) in place.iter().enumerate() {
        block_at[p as usize] = block as u32;
    }
    let mut next = vec![0u32; n];
    let mut sum = 0;
    for &block in &block_at {
        next[block as usize] = sum;
        sum += weights[block as usize] as u32;
    }
    Ok(block_of
        .iter()
        .map(|&b| {
            let position = next[b as usize];
            next[b as usize] += 1;
            position
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A path of five blocks of 1, 2, 3, 2, 1 rows: every row gets a place, and blocks stay together.
    #[test]
    fn order_is_a_permutation_that_keeps_blocks_together() {
        let block_of = [0, 1, 1, 2, 2, 2, 3, 3, 4];
        let order = dissect(&[1, 2, 2, 2, 1], vec![1, 0, 2, 1, 3, 2, 4, 3], &block_of).unwrap();
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..9).collect::<Vec<u32>>(), "{order:?}");
        for i in 1..9 {
            assert!(block_of[i] != block_of[i - 1] || order[i] == order[i - 1] + 1, "{order:?}");
        }
    }

    #[test]
    fn graph_without_edges_is_ordered() {
        assert_eq!(dissect(&[0, 0], vec![], &[0, 1]).unwrap(), [0, 1]);
        assert!(dissect(&[], vec![], &[]).unwrap().is_empty());
    }

    /// Graphs with more edges than the installed METIS can count are refused, whichever width it has.
    #[test]
    fn more_edges_than_metis_counts_are_refused() {
        let error = dissect(&[idx_t::MAX, 1], vec![1, 0], &[0, 1]).unwrap_err();
        assert_eq!(error.exit_code(), 7);
        assert!(error.to_string().contains(&format!("indices of {} bit", idx_t::BITS)), "{error}");
    }
}
