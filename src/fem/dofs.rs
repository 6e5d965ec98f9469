//! Numbering of the free degrees of freedom. Supported nodes are left out altogether, so matrices stay symmetric and
//! positive definite and no artificial eigenvalue appears.

use crate::mesh::distribute::MeshPart;
use crate::parallel::World;

/// Mark of a node without free degrees of freedom.
pub const FIXED: u64 = u64::MAX;

/// Numbers of the free degrees of freedom: each free node has three consecutive ones (x, y, z), each rank a
/// contiguous range.
#[derive(Debug, Clone)]
pub struct DofMap {
    /// First degree of freedom of each rank, `[size + 1]`; the last entry is their number.
    pub ranges: Vec<u64>,
    /// First degree of freedom of each local node (ghosts included), or [`FIXED`].
    pub local: Vec<u64>,
    /// On rank 0: first degree of freedom of every node by its global number, or [`FIXED`]; empty elsewhere.
    pub all: Vec<u64>,
    /// This rank.
    rank: usize,
}

impl DofMap {
    /// Collective: numbers the degrees of freedom of the nodes outside the `fixed` groups. The groups must exist in
    /// the mesh.
    pub fn new(world: &World, part: &MeshPart, fixed: &[String]) -> Self {
        let mut supported = vec![false; part.node_ids.len()];
        for name in fixed {
            for &n in part.groups.get(name).map_or(&[][..], |v| v) {
                supported[n as usize] = true;
            }
        }
        // One byte a node on every rank: the price of numbering ghosts without a second exchange.
        let mine: Vec<u8> = supported[..part.owned].iter().map(|&f| f as u8).collect();
        let flags = world.all_gather(&mine);
        let mut next = 0u64;
        let first: Vec<u64> = flags
            .iter()
            .map(|&f| {
                if f != 0 {
                    return FIXED;
                }
                next += 3;
                next - 3
            })
            .collect();
        let mut ranges = Vec::with_capacity(world.size + 1);
        let mut count = 0u64;
        for r in 0..world.size {
            ranges.push(count);
            let (a, b) = (part.ranges[r] as usize, part.ranges[r + 1] as usize);
            count += 3 * flags[a..b].iter().filter(|&&f| f == 0).count() as u64;
        }
        ranges.push(count);
        let local = part.node_ids.iter().map(|&g| first[g as usize]).collect();
        let all = if world.is_root() { first } else { Vec::new() };
        Self { ranges, local, all, rank: world.rank }
    }

    /// Number of free degrees of freedom of the whole body.
    pub fn total(&self) -> u64 {
        self.ranges[self.ranges.len() - 1]
    }

    /// First degree of freedom of this rank.
    pub fn first(&self) -> u64 {
        self.ranges[self.rank]
    }

    /// Number of degrees of freedom of this rank.
    pub fn owned(&self) -> usize {
        (self.ranges[self.rank + 1] - self.ranges[self.rank]) as usize
    }
}
