//! Constraints of nodes: regularity on the axle of a solid body, and symmetry in the middle plane of a half section.
//!
//! The displacement on the axle is one vector for all angles. Of order 0, u = (U, V, W), it lies along the axle:
//! U = V = 0. At order 1, (U cos θ, V sin θ, W cos θ), it is across the axle and constant: u_z = U cos²θ − V sin²θ, so
//! that U + V = 0 and W = 0. Of higher orders it is 0. With these conditions met, no strain at an integration point has
//! a part of a node on the axle that goes with 1/r.
//!
//! The mirror about the middle plane takes (U, V, W) to (U, V, −W). In that plane a symmetric motion has W = 0, and an
//! antisymmetric one U = V = 0.
//!
//! The projections Q on these motions act node by node, and those of both kinds commute: stiffness and mass become QKQ
//! and QMQ, and what is projected out is held by a stiffness of its own, without mass.

use super::super::CrossSection;
use super::{NodePairs, NodeStiffness};
use faer::Mat;
use std::collections::HashMap;

/// Symmetry of motions about the middle plane of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// Motions that are their own mirror image.
    Symmetric,
    /// Motions that are the opposite of their mirror image.
    Antisymmetric,
}

impl Parity {
    /// 1 or −1.
    pub fn sign(self) -> f64 {
        match self {
            Parity::Symmetric => 1.0,
            Parity::Antisymmetric => -1.0,
        }
    }

    /// The projection Q on its motions in the middle plane.
    fn projection(self) -> NodeStiffness {
        match self {
            Parity::Symmetric => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]],
            Parity::Antisymmetric => [[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]],
        }
    }
}

/// The projection Q on motions of the order n that are regular on the axle.
fn on_axle(n: usize) -> NodeStiffness {
    match n {
        0 => [[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0]],
        1 => [[0.5, -0.5, 0.0], [-0.5, 0.5, 0.0], [0.0; 3]],
        _ => [[0.0; 3]; 3],
    }
}

/// A B.
fn times(a: &NodeStiffness, b: &NodeStiffness) -> NodeStiffness {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Constraints of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Constraint {
    /// True on the axle.
    axle: bool,
    /// Symmetry of its motions, in the middle plane.
    middle: Option<Parity>,
}

impl Constraint {
    /// The projection Q on its motions of the order n.
    fn projection(self, n: usize) -> NodeStiffness {
        match (self.axle, self.middle) {
            (true, Some(parity)) => times(&on_axle(n), &parity.projection()),
            (true, None) => on_axle(n),
            (false, Some(parity)) => parity.projection(),
            (false, None) => super::IDENTITY,
        }
    }
}

/// Nodes with constraints.
#[derive(Debug, Clone, Default)]
pub(super) struct ConstrainedNodes {
    /// Their numbers among the free nodes, ascending.
    nodes: Vec<(usize, Constraint)>,
    /// Pairs of nodes with one of them, by their index: the constraints of the first and of the second node.
    pairs: HashMap<usize, [Option<Constraint>; 2]>,
}

impl ConstrainedNodes {
    /// The nodes of `section` on the axle, and the nodes `middle` of its middle plane, where motions are symmetric or
    /// antisymmetric; with the numbers `place` of the free nodes, and their pairs.
    pub fn new(
        section: &CrossSection,
        middle: Option<(&[usize], Parity)>,
        place: &[Option<usize>],
        pairs: &NodePairs,
    ) -> Self {
        let mut all: HashMap<usize, Constraint> = HashMap::new();
        for node in section.on_axle().filter_map(|k| place[k]) {
            all.insert(node, Constraint { axle: true, middle: None });
        }
        if let Some((nodes, parity)) = middle {
            for node in nodes.iter().filter_map(|&k| place[k]) {
                all.entry(node).or_insert(Constraint { axle: false, middle: None }).middle = Some(parity);
            }
        }
        let touched = pairs.iter().map(|(a, b, k)| (k, [a, b].map(|node| all.get(&node).copied())));
        let touched = touched.filter(|(_, on)| on[0].or(on[1]).is_some());
        let pairs = if all.is_empty() { HashMap::new() } else { touched.collect() };
        let mut nodes: Vec<(usize, Constraint)> = all.into_iter().collect();
        nodes.sort_unstable_by_key(|(node, _)| *node);
        Self { nodes, pairs }
    }

    /// Q_a B Q_b of the block of the pair `k`, at the order n.
    pub fn projected(&self, n: usize, k: usize, block: NodeStiffness) -> NodeStiffness {
        let Some([a, b]) = self.pairs.get(&k).filter(|_| !self.pairs.is_empty()) else { return block };
        let left = a.map_or(block, |a| times(&a.projection(n), &block));
        b.map_or(left, |b| times(&left, &b.projection(n)))
    }

    /// Returns whether a pair has a node with a constraint.
    pub fn has(&self, k: usize) -> bool {
        !self.pairs.is_empty() && self.pairs.contains_key(&k)
    }

    /// The block of a node with itself, at the order n: projected, and with what is projected out held by the mean of
    /// its diagonal.
    pub fn held(&self, n: usize, k: usize, block: NodeStiffness) -> NodeStiffness {
        let Some([Some(own), _]) = self.pairs.get(&k) else { return block };
        let q = own.projection(n);
        let stiff = (block[0][0] + block[1][1] + block[2][2]).abs() / 3.0;
        let mut held = self.projected(n, k, block);
        for (i, row) in held.iter_mut().enumerate() {
            for (j, v) in row.iter_mut().enumerate() {
                *v += stiff * (f64::from(u8::from(i == j)) - q[i][j]);
            }
        }
        held
    }

    /// Projects columns of amplitudes of the order n, `[order, k]`, on motions that meet the constraints.
    pub fn project(&self, n: usize, x: &mut Mat<f64>) {
        for (node, constraint) in &self.nodes {
            let q = constraint.projection(n);
            for column in 0..x.ncols() {
                let own: [f64; 3] = std::array::from_fn(|c| x[(3 * node + c, column)]);
                (0..3).for_each(|c| x[(3 * node + c, column)] = (0..3).map(|d| q[c][d] * own[d]).sum());
            }
        }
    }

    /// The first of the nodes of the middle plane, by its number.
    pub fn first_in_middle(&self) -> Option<usize> {
        self.nodes.iter().find(|(_, constraint)| constraint.middle.is_some()).map(|(node, _)| *node)
    }

    /// Returns true if no node has a constraint.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}
