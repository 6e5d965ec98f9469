//! Modes of a mirror-symmetric section, symmetric or antisymmetric about its middle.
//!
//! The mirror image of the amplitudes (U, V, W) at (r, y) is (U, V, −W) at (r, 2y_m − y). A mode of a single frequency
//! is equal to its image or to the opposite of it. Modes of one frequency, as those of two wheels that the axle does
//! not couple, come out of a solver as any mixture: such neighbours are turned into one of each kind.

use super::modes::FourierModes;
use super::{CrossSection, Forms};
use faer::Mat;

/// Purity ±1 that a mode by itself has but for this.
const PURE: f64 = 1e-9;
/// Neighbours whose squares of frequencies differ by less than this part may be mixed.
const NEAR: f64 = 1e-6;
/// Distance of a node from the image of another one that it is, m.
const SAME: f64 = 1e-7;

/// The mirror images of the nodes of a section.
#[derive(Debug, Clone, PartialEq)]
pub struct Mirror {
    /// y of the middle plane, m.
    middle: f64,
    /// Node at the mirror image of each node.
    image: Vec<usize>,
}

impl Mirror {
    /// The images of the nodes of `section` on the other side of y = `middle`, m; none where the section is not
    /// symmetric.
    pub fn new(section: &CrossSection, middle: f64) -> Option<Self> {
        let cell = |[r, y]: [f64; 2]| [r, y].map(|x| (x / SAME).round() as i64);
        let mut known = std::collections::HashMap::new();
        for (k, node) in section.nodes.iter().enumerate() {
            known.insert(cell(*node), k);
        }
        let of = |&[r, y]: &[f64; 2]| {
            let [a, b] = cell([r, 2.0 * middle - y]);
            // Rounding may bring it into the cell beside.
            let beside = [-1, 0, 1].into_iter().flat_map(|i| [-1, 0, 1].map(|j| [a + i, b + j]));
            beside.into_iter().find_map(|cell| known.get(&cell).copied())
        };
        let image = section.nodes.iter().map(of).collect::<Option<Vec<usize>>>()?;
        Some(Self { middle, image })
    }

    /// The node at the mirror image of a node.
    pub(super) fn image(&self, node: usize) -> usize {
        self.image[node]
    }

    /// Returns true for nodes of the half section that has the contact point y = 0, without those of the middle plane.
    pub(super) fn is_near(&self, section: &CrossSection, node: usize) -> bool {
        let far_side = section.nodes[node][1] - self.middle;
        !self.is_in_middle(node) && far_side * self.middle <= 0.0
    }

    /// Returns true for nodes of the middle plane.
    pub(super) fn is_in_middle(&self, node: usize) -> bool {
        self.image[node] == node
    }

    /// The images of columns of amplitudes, `[order, k]`.
    fn images(&self, forms: &Forms, x: &Mat<f64>) -> Mat<f64> {
        let mut y = Mat::zeros(x.nrows(), x.ncols());
        for (node, &image) in self.image.iter().enumerate() {
            let (Some(to), Some(from)) = (forms.amplitude(node), forms.amplitude(image)) else { continue };
            for k in 0..x.ncols() {
                (0..3).for_each(|c| y[(to + c, k)] = if c == 2 { -x[(from + c, k)] } else { x[(from + c, k)] });
            }
        }
        y
    }

    /// Makes the `modes` of `forms` symmetric and antisymmetric ones, and returns the parity of each, 1 or −1 but for
    /// rounding.
    pub fn separate(&self, forms: &Forms, modes: &mut FourierModes) -> Vec<f64> {
        let mass = forms.mass(modes.order, modes.vectors.as_ref());
        let parity = mass.transpose() * self.images(forms, &modes.vectors);
        let count = modes.omega.len();
        let mut found: Vec<f64> = (0..count).map(|k| parity[(k, k)]).collect();
        let mut k = 0;
        while k + 1 < count {
            let square = |k: usize| modes.omega[k] * modes.omega[k];
            let near = (square(k + 1) - square(k)).abs() <= NEAR * square(k + 1);
            let mixed = parity[(k, k)].abs().min(parity[(k + 1, k + 1)].abs()) < 1.0 - PURE;
            if !(near && mixed) {
                k += 1;
                continue;
            }
            // The angle that makes the parity of both diagonal, the symmetric one first.
            let cross = 0.5 * (parity[(k, k + 1)] + parity[(k + 1, k)]);
            let (s, c) = (0.5 * (2.0 * cross).atan2(parity[(k, k)] - parity[(k + 1, k + 1)])).sin_cos();
            for i in 0..modes.vectors.nrows() {
                let [a, b] = [modes.vectors[(i, k)], modes.vectors[(i, k + 1)]];
                (modes.vectors[(i, k)], modes.vectors[(i, k + 1)]) = (c * a + s * b, c * b - s * a);
            }
            let [a, b] = [parity[(k, k)], parity[(k + 1, k + 1)]];
            found[k] = c * c * a + s * s * b + 2.0 * s * c * cross;
            found[k + 1] = s * s * a + c * c * b - 2.0 * s * c * cross;
            k += 2;
        }
        found
    }
}
