//! Regularity on the axle of a solid body: what the amplitudes (U, V, W) of an order may be at r = 0.
//!
//! The displacement is one vector there for all angles. Of order 0, u = (U, V, W), it lies along the axle: U = V = 0.
//! At order 1, (U cos θ, V sin θ, W cos θ), it is across the axle and constant: u_z = U cos²θ − V sin²θ, so that U + V
//! = 0, and W = 0. Of higher orders it is 0. The projections Q on these motions act node by node: stiffness and mass
//! become QKQ and QMQ, and what is projected out is held by a stiffness of its own, without mass. With the conditions
//! met, no strain at an integration point has a part of a node on the axle that goes with 1/r.

use super::super::Section;
use super::{Block, NodePairs};
use faer::Mat;
use std::collections::HashMap;

/// The projection Q on regular motions of the order n.
pub(super) fn projection(n: usize) -> Block {
    match n {
        0 => [[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]],
        1 => [[0.5, -0.5, 0.0], [-0.5, 0.5, 0.0], [0.0; 3]],
        _ => [[0.0; 3]; 3],
    }
}

/// A B.
fn times(a: &Block, b: &Block) -> Block {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Nodes on the axle.
#[derive(Debug, Clone, Default)]
pub(super) struct AxisNodes {
    /// Their numbers among the free nodes.
    nodes: Vec<usize>,
    /// NodePairs of nodes with one of them, by their index: whether the first and the second node are on the axle.
    pairs: HashMap<usize, [bool; 2]>,
}

impl AxisNodes {
    /// The nodes of `section` on the axle, with the numbers `place` of the free nodes, and their pairs.
    pub fn new(section: &Section, place: &[Option<usize>], pairs: &NodePairs) -> Self {
        let mut nodes: Vec<usize> = section.on_axle().filter_map(|k| place[k]).collect();
        nodes.sort_unstable();
        let on = |a: usize| nodes.binary_search(&a).is_ok();
        let touched = pairs.iter().map(|(a, b, k)| (k, [on(a), on(b)])).filter(|(_, on)| on[0] || on[1]);
        let pairs = if nodes.is_empty() { HashMap::new() } else { touched.collect() };
        Self { nodes, pairs }
    }

    /// Q_a B Q_b of the block of the pair `k`, at the order n.
    pub fn projected(&self, n: usize, k: usize, block: Block) -> Block {
        let Some(on) = self.pairs.get(&k).filter(|_| !self.pairs.is_empty()) else { return block };
        let q = projection(n);
        let left = if on[0] { times(&q, &block) } else { block };
        if on[1] {
            times(&left, &q)
        } else {
            left
        }
    }

    /// Returns whether a pair has a node on the axle.
    pub fn has(&self, k: usize) -> bool {
        !self.pairs.is_empty() && self.pairs.contains_key(&k)
    }

    /// The block of a node on the axle with itself, at the order n: projected, and with what is projected out held by
    /// the mean of its diagonal.
    pub fn held(&self, n: usize, k: usize, block: Block) -> Block {
        let q = projection(n);
        let stiff = (block[0][0] + block[1][1] + block[2][2]).abs() / 3.0;
        let mut held = self.projected(n, k, block);
        for (i, row) in held.iter_mut().enumerate() {
            for (j, v) in row.iter_mut().enumerate() {
                *v += stiff * (f64::from(u8::from(i == j)) - q[i][j]);
            }
        }
        held
    }

    /// Projects columns of amplitudes of the order n, `[order, k]`, on regular motions.
    pub fn project(&self, n: usize, x: &mut Mat<f64>) {
        let q = projection(n);
        for &node in &self.nodes {
            for column in 0..x.ncols() {
                let own: [f64; 3] = std::array::from_fn(|c| x[(3 * node + c, column)]);
                (0..3).for_each(|c| x[(3 * node + c, column)] = (0..3).map(|d| q[c][d] * own[d]).sum());
            }
        }
    }
}
