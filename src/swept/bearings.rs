//! Bearings of a wheelset on its primary suspension. The boxes do not turn: through its bearing a box has the mean
//! displacement of the ring of particles that are at the journal at the time, which is a fixed functional in the frame
//! of the contact. Springs act on that mean alone, f = −Pᵀk P u, without a torque about the axle and without a moment.
//! On a ring
//! - order 0: ⟨u_y⟩ = W,
//! - order 1: u_z = u_r cos θ − u_θ sin θ and u_x = u_r sin θ + u_θ cos θ, so that ⟨u_z⟩ = (U − V)/2 of the family (U
//!   cos θ, V sin θ, W cos θ) and ⟨u_x⟩ = (U − V)/2 of the family (U sin θ, −V cos θ, W sin θ); the other mean is 0,
//! - all means of higher orders are 0.
//!
//! The stiffness K_1 of both families has the mean of k_x and k_z; what they differ by couples modes of one family,
//! ±(k_z − k_x)/2 in the modal stiffness.

use super::forms::NodeStiffness;
use super::{CrossSection, Forms};
use faer::{Mat, MatRef};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Bearing of an axle box on its springs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bearing {
    /// Place (r, y) of its journal, m.
    pub place: [f64; 2],
    /// Stiffness along x, y and z, N/m.
    pub stiffness: [f64; 3],
}

/// Bearings with their nodes.
#[derive(Debug, Clone, Default)]
pub(super) struct Bearings {
    all: Vec<Carried>,
}

/// A bearing on a section.
#[derive(Debug, Clone)]
struct Carried {
    bearing: Bearing,
    /// Nodes of the section with the values of their shape functions at its place.
    shares: Vec<(usize, f64)>,
    /// Pairs of nodes with the product of their values.
    pairs: Vec<(usize, f64)>,
}

/// Factors of (U, V, W) in the mean displacement at the order n.
fn mean(n: usize) -> [f64; 3] {
    match n {
        0 => [0.0, 0.0, 1.0],
        1 => [0.5, -0.5, 0.0],
        _ => [0.0; 3],
    }
}

/// Pairs of nodes with the product of their `shares`.
fn pairs_of(shares: &[(usize, f64)], pair: impl Fn(usize, usize) -> Option<usize>) -> Vec<(usize, f64)> {
    let each = shares.iter().flat_map(|&(a, va)| shares.iter().map(move |&(b, vb)| (a, b, va * vb)));
    each.filter_map(|(a, b, product)| Some((pair(a, b)?, product))).collect()
}

impl Bearings {
    /// The bearings at the places of `section` nearest to theirs; `pair` has the index of each pair of nodes.
    pub fn new(section: &CrossSection, bearings: &[Bearing], pair: impl Fn(usize, usize) -> Option<usize>) -> Self {
        let of = |bearing: &Bearing| {
            let near = section.nearest(bearing.place)?;
            let shares: Vec<(usize, f64)> = near.shares.into_iter().filter(|(_, value)| *value != 0.0).collect();
            let pairs = pairs_of(&shares, &pair);
            Some(Carried { bearing: *bearing, shares, pairs })
        };
        Self { all: bearings.iter().filter_map(of).collect() }
    }

    /// The bearings of the half of a section whose nodes `near` has, with the index of each `pair` of its nodes; none
    /// where a bearing touches the nodes of the `middle` plane.
    pub fn of_half(
        &self,
        near: impl Fn(&usize) -> bool,
        middle: impl Fn(&usize) -> bool,
        pair: impl Fn(usize, usize) -> Option<usize>,
    ) -> Option<Self> {
        if self.all.iter().any(|carried| carried.shares.iter().any(|(node, _)| middle(node))) {
            return None;
        }
        let inside = |carried: &&Carried| carried.shares.iter().any(|(node, _)| near(node));
        let of = |carried: &Carried| Carried { pairs: pairs_of(&carried.shares, &pair), ..carried.clone() };
        Some(Self { all: self.all.iter().filter(inside).map(of).collect() })
    }

    /// Returns true if `other` has the same bearings but for their places.
    pub fn are_alike(&self, other: &Self) -> bool {
        let alike = |(a, b): (&Carried, &Carried)| a.bearing == Bearing { place: a.bearing.place, ..b.bearing };
        self.all.len() == other.all.len() && self.all.iter().zip(&other.all).all(alike)
    }

    /// Adds the stiffness of the springs at the order `n`, of each radian, by pairs of nodes: of the order 1 with the
    /// mean of k_x and k_z.
    pub fn add_stiffness(&self, n: usize, all: &mut HashMap<usize, NodeStiffness>) {
        let m = mean(n);
        let whole = if n == 0 { 2.0 * PI } else { PI };
        for Carried { bearing: Bearing { stiffness: [along, lateral, vertical], .. }, pairs, .. } in &self.all {
            let stiffness = match n {
                0 => *lateral,
                1 => 0.5 * (along + vertical),
                _ => continue,
            };
            for &(pair, product) in pairs {
                let block = all.entry(pair).or_default();
                for (c, row) in block.iter_mut().enumerate() {
                    row.iter_mut().zip(m).for_each(|(v, d)| *v += stiffness * product * m[c] * d / whole);
                }
            }
        }
    }
}

impl Forms {
    /// Mean displacements ⟨u⟩ of the columns `x` at the order n at each bearing, `[bearings, k]`: along y of the order
    /// 0, along z or x of the first or the second family of the order 1.
    pub(crate) fn at_bearings(&self, n: usize, x: MatRef<'_, f64>) -> Mat<f64> {
        let m = mean(n);
        Mat::from_fn(self.bearings.all.len(), x.ncols(), |j, k| {
            let of = |&(node, value): &(usize, f64)| {
                let first = self.amplitude(node)?;
                Some(value * (0..3).map(|c| m[c] * x[(first + c, k)]).sum::<f64>())
            };
            self.bearings.all[j].shares.iter().filter_map(of).sum()
        })
    }

    /// The bearings of the body.
    pub fn bearings(&self) -> impl Iterator<Item = &Bearing> {
        self.bearings.all.iter().map(|carried| &carried.bearing)
    }
}
