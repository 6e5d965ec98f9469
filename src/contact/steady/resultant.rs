//! Resultants of the tractions of patches.

use crate::grid::{ContactPatch, Interface};

/// Resultant of the reactions of one contact patch on body 1, in the frame of the patch, and its approach.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PatchResultant {
    /// Contact force, N: (x, y, z); z is along the normal from body 1 to body 2, so the third is minus the normal
    /// force.
    pub force: [f64; 3],
    /// Moment of the tractions about the normal through the origin of the patch, N·m.
    pub moment_z: f64,
    /// Approach δ, m: the gap is g0 − δ + deformation.
    pub approach: f64,
}

impl PatchResultant {
    /// Resultants of the nodal reactions (tx, ty, p), N, `[3n]`, on the patches of `s` with the approaches `approach`,
    /// m, `[patches]`.
    pub fn of_patches(s: &Interface, reaction: &[f64], approach: &[f64]) -> Vec<Self> {
        let of = |(patch, &approach): (&ContactPatch, &f64)| {
            let mut sum = Self { approach, ..Self::default() };
            for (i, f) in patch.nodes().map(|i| (i, &reaction[3 * i..3 * i + 3])) {
                let [x, y] = s.point(i);
                sum.force[0] += f[0];
                sum.force[1] += f[1];
                sum.force[2] -= f[2];
                sum.moment_z += x * f[1] - y * f[0];
            }
            sum
        };
        s.patches.iter().zip(approach).map(of).collect()
    }

    /// Sum of the forces, N, and of the moments, N·m, of `patches`, each in its own frame.
    pub fn total(patches: &[Self]) -> ([f64; 3], f64) {
        let force = [0, 1, 2].map(|c| patches.iter().map(|p| p.force[c]).sum());
        (force, patches.iter().map(|p| p.moment_z).sum())
    }
}
