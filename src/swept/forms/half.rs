//! One half of a mirror-symmetric section, for symmetric or for antisymmetric motions.
//!
//! With the nodes of one half h, of the other half g and of the middle plane m, and the mirror D: (U, V, W) → (U, V,
//! −W), a motion of the parity ±1 is u_g = ±D u_h and u_m = Q u_m, with the projections Q of [`Parity`]. A symmetric
//! matrix A that is its own mirror image then is, in its quadratic form, twice that of one half:
//!
//! ```text
//! uᵀAu = 2 (u_hᵀ A_hh u_h + 2 u_hᵀ A_hm Q u_m + ½ u_mᵀ Q A_mm Q u_m)
//! ```
//!
//! Blocks between a node of one half and one of the other are 0, as each element lies in one half.

use super::{number, scaled, Forms, NodeStiffness, Parity, Path, SkylineFactor};
use crate::swept::{CrossSection, Mirror};
use crate::Result;
use std::collections::HashMap;

/// Parts of the diagonal that blocks and those of their mirror images may differ by.
const SAME: f64 = 1e-9;

/// D B D of a block.
fn mirrored(block: &NodeStiffness) -> NodeStiffness {
    std::array::from_fn(|c| std::array::from_fn(|d| if (c == 2) == (d == 2) { block[c][d] } else { -block[c][d] }))
}

fn transposed(block: &NodeStiffness) -> NodeStiffness {
    std::array::from_fn(|c| std::array::from_fn(|d| block[d][c]))
}

/// Largest difference of the entries of two blocks.
fn apart(a: &NodeStiffness, b: &NodeStiffness) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn trace(block: &NodeStiffness) -> f64 {
    (0..3).map(|c| block[c][c].abs()).sum()
}

impl Forms {
    /// The forms of the half of the section with the contact point, for motions of a parity about the plane of the
    /// `mirror`; none where stiffness, mass or supports are no mirror images, or where elements or bearings lie on both
    /// sides of the plane.
    pub fn half(&self, mirror: &Mirror, parity: Parity) -> Option<Self> {
        if self.path != Path::Axle || !self.rings.is_empty() || !self.is_mirror_image(mirror) {
            return None;
        }
        let all = &self.section;
        let near = |&k: &usize| mirror.is_near(all, k);
        let middle = |&k: &usize| mirror.is_in_middle(k);
        let of_half = all.elements.iter().filter(|e| e.nodes.iter().any(near)).cloned().collect::<Vec<_>>();
        let inside = |nodes: &[usize]| nodes.iter().all(|k| near(k) || middle(k));
        if 2 * of_half.len() != all.elements.len() || !of_half.iter().all(|e| inside(&e.nodes)) {
            return None;
        }
        let section = CrossSection {
            nodes: all.nodes.clone(),
            elements: of_half,
            groups: all.groups.clone(),
            tread: all.tread.iter().filter(|edge| inside(&edge[..])).copied().collect(),
            layers: all.layers.clone(),
        };
        let free: Vec<bool> = self.place.iter().map(Option::is_some).collect();
        let in_middle: Vec<usize> = (0..all.nodes.len()).filter(middle).collect();
        // Matrices of both parities differ in the rows of the middle plane, which come last.
        let numbers = number(&section, &free, &[], &in_middle);
        let mut half = Self::unassembled(section, self.material, self.path, numbers, Some((&in_middle, parity)));
        half.bearings = self.bearings.of_half(near, middle, |a, b| half.pair(a, b))?;
        let nodes = half.nodes();
        for (a, b, k) in half.pairs.iter() {
            let (a, b) = (nodes[a], nodes[b]);
            let (from, turned) = self.between(a, b)?;
            let share = if middle(&a) && middle(&b) { 0.5 } else { 1.0 };
            for (to, own) in half.stiffness.iter_mut().zip(&self.stiffness) {
                let block = scaled(&own[from], share);
                to[k] = if turned { transposed(&block) } else { block };
            }
            half.mass[k] = share * self.mass[from];
        }
        Some(half)
    }

    /// K_n − σM of a half section, factorised for both parities: of the `other` one all but the last rows are the same.
    pub(crate) fn factor_both(&self, other: &Self, n: usize, sigma: f64) -> Result<[SkylineFactor; 2]> {
        let own = self.factor(n, sigma)?;
        let same = self.envelope == other.envelope && self.place == other.place;
        let like = match self.constraints.first_in_middle().filter(|_| same) {
            Some(from) => other.factor_like(&own, from, n, sigma)?,
            None => other.factor(n, sigma)?,
        };
        Ok([own, like])
    }

    /// Nodes of the section by their numbers among the free ones.
    fn nodes(&self) -> Vec<usize> {
        let mut nodes = vec![0; self.pairs.rows()];
        self.place.iter().enumerate().filter_map(|(node, k)| Some((node, (*k)?))).for_each(|(node, k)| nodes[k] = node);
        nodes
    }

    /// The pair of two nodes, and true if it has them the other way round.
    fn between(&self, a: usize, b: usize) -> Option<(usize, bool)> {
        self.pair(a, b).map(|k| (k, false)).or_else(|| Some((self.pair(b, a)?, true)))
    }

    /// Returns whether stiffness and mass of each pair of nodes are the mirror images of those of the pair of their
    /// images.
    fn is_mirror_image(&self, mirror: &Mirror) -> bool {
        let nodes = self.nodes();
        let own = |a: usize| self.pair(nodes[a], nodes[a]);
        let bearings = [0, 1].map(|n| self.of_rings(n));
        let same = |(a, b, k): (usize, usize, usize)| {
            let (Some(aa), Some(bb)) = (own(a), own(b)) else { return false };
            let Some((image, turned)) = self.between(mirror.image(nodes[a]), mirror.image(nodes[b])) else {
                return false;
            };
            let seen = |block: &NodeStiffness| mirrored(&if turned { transposed(block) } else { *block });
            let size = |k: usize| trace(&self.stiffness[0][k]) + trace(&self.stiffness[2][k]);
            let stiff = SAME * (size(aa) * size(bb)).sqrt();
            let heavy = SAME * (self.mass[aa] * self.mass[bb]).sqrt();
            let of = |all: &HashMap<usize, NodeStiffness>, k: usize| all.get(&k).copied().unwrap_or_default();
            self.stiffness.iter().all(|of| apart(&of[k], &seen(&of[image])) <= stiff)
                && (self.mass[k] - self.mass[image]).abs() <= heavy
                && bearings.iter().all(|all| apart(&of(all, k), &seen(&of(all, image))) <= stiff)
        };
        self.pairs.iter().all(same)
    }
}
