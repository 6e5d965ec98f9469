//! Shape functions of facets: on the triangle of 0 and the unit points, on the square [0, 1]².

use crate::mesh::kind::{FacetKind, MAX_FACET_NODES};

impl FacetKind {
    /// Shape functions at the reference point `(s, t)`; the first `nodes()` count.
    pub fn shape(self, [s, t]: [f64; 2]) -> [f64; MAX_FACET_NODES] {
        let mut values = [0.0; MAX_FACET_NODES];
        let corners = [(1.0 - s, 1.0 - t), (s, 1.0 - t), (s, t), (1.0 - s, t)];
        match self {
            FacetKind::Tri3 => values[..3].copy_from_slice(&[1.0 - s - t, s, t]),
            FacetKind::Tri6 => {
                let l = [1.0 - s - t, s, t];
                for k in 0..3 {
                    values[k] = l[k] * (2.0 * l[k] - 1.0);
                    values[3 + k] = 4.0 * l[k] * l[(k + 1) % 3];
                }
            }
            FacetKind::Quad4 => (0..4).for_each(|k| values[k] = corners[k].0 * corners[k].1),
            FacetKind::Quad8 | FacetKind::Quad9 => {
                if self == FacetKind::Quad9 {
                    values[8] = 16.0 * s * (1.0 - s) * t * (1.0 - t);
                }
                let (along, up) = (4.0 * s * (1.0 - s), 4.0 * t * (1.0 - t));
                let edges = [along * (1.0 - t), s * up, along * t, (1.0 - s) * up];
                (0..4).for_each(|k| values[4 + k] = edges[k] - 0.5 * values[8]);
                for k in 0..4 {
                    let half = 0.5 * (values[4 + k] + values[4 + (k + 3) % 4]);
                    values[k] = corners[k].0 * corners[k].1 - half - 0.25 * values[8];
                }
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facets_interpolate() {
        for kind in FacetKind::ALL {
            let corners: &[[f64; 2]] = match kind.corners() {
                3 => &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
                _ => &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
            };
            let n = corners.len();
            let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            let mut nodes = corners.to_vec();
            nodes.extend((0..n).map(|k| middle(corners[k], corners[(k + 1) % n])));
            nodes.push([0.5, 0.5]);
            for (i, &at) in nodes[..kind.nodes()].iter().enumerate() {
                for (a, v) in kind.shape(at).into_iter().enumerate() {
                    let wanted = f64::from(u8::from(a == i));
                    assert!((v - wanted).abs() < 1e-15, "{kind:?}: {a} at node {i}: {v}");
                }
            }
            let sum: f64 = kind.shape([0.3, 0.45]).iter().sum();
            assert!((sum - 1.0).abs() < 1e-15, "{kind:?}: {sum}");
        }
    }
}
