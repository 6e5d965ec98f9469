//! The outline of a section: what of it meets the air.

use super::CrossSection;
use crate::{Error, Result};
use faer::Mat;
use std::collections::BTreeMap;

/// Part of the largest radius within which nodes are at the same radius.
const SAME: f64 = 1e-6;

/// An edge of the outline, from its first to its last point; the body lies to the left, in the plane with r to the
/// right and y upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// First, last and middle point (r, y), m.
    pub points: [[f64; 2]; 3],
    /// Their places in [`Outline::nodes`]; none of a flat end that stands still.
    pub nodes: Option<[usize; 3]>,
}

/// The outline of a section: one closed curve, or a curve from axis to axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Nodes of the section that lie on it.
    pub nodes: Vec<usize>,
    /// Its edges, each beginning where the one before ends.
    pub edges: Vec<Edge>,
}

/// The modes of a swept body as the air around it sees them.
#[derive(Debug, Clone)]
pub struct OutlineModes {
    /// The outline.
    pub outline: Outline,
    /// The modes of each order that has some.
    pub orders: Vec<OrderModes>,
    /// Number of all modes, both families counted.
    pub count: usize,
}

/// The modes of one order of Fourier on the outline.
#[derive(Debug, Clone)]
pub struct OrderModes {
    /// Number of nodal diameters.
    pub order: usize,
    /// (U, W) at the nodes of the outline, 1/√kg, interleaved, `[2 · nodes, m]`.
    pub motion: Mat<f64>,
    /// Places of these modes among all modes of the body, those of one family after those of the other,
    /// `[families][m]`.
    pub places: Vec<Vec<usize>>,
}

impl CrossSection {
    /// The outline. Edges at the smallest radius whose nodes are all among `clamped` sit on an axle: it is taken to
    /// end with them, in flat ends that stand still. With the nodes on the axle of a solid body among them it goes from
    /// axle to axle.
    pub fn outline(&self, clamped: &[usize]) -> Result<Outline> {
        let mut open: BTreeMap<usize, [usize; 3]> = BTreeMap::new();
        let mut seen: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        let edges = || self.elements.iter().flat_map(|e| e.kind.edges().iter().map(|k| k.map(|i| e.nodes[i])));
        edges().for_each(|[a, b, _]| *seen.entry([a.min(b), a.max(b)]).or_default() += 1);
        let split = |node: usize| {
            let [r, y] = self.nodes[node];
            Error::Input(format!(
                "the section's outline meets itself at r = {r:.6} m, y = {y:.6} m; for sound it must be one \
                 closed curve: no holes, \
                 no parts that touch in a point"
            ))
        };
        for edge in edges().filter(|[a, b, _]| seen[&[*a.min(b), *a.max(b)]] == 1) {
            if open.insert(edge[0], edge).is_some() {
                return Err(split(edge[0]));
            }
        }
        let radius = |pick: fn(f64, f64) -> f64| self.nodes.iter().map(|x| x[0]).reduce(pick).unwrap_or(0.0);
        let bore = radius(f64::min) + SAME * radius(f64::max);
        let sits = |e: &[usize; 3]| e.iter().all(|&k| self.nodes[k][0] <= bore && clamped.contains(&k));
        // After the axle, where there is one, or anywhere.
        let ends = open.values().find(|e| sits(e) && open.get(&e[1]).is_some_and(|next| !sits(next)));
        let Some(start) = ends.map(|e| e[1]).or_else(|| open.keys().next().copied()) else {
            return Err(Error::Input("the section has no elements, and so no outline".into()));
        };
        let (mut chain, mut here) = (Vec::new(), start);
        while let Some(edge) = open.remove(&here) {
            here = edge[1];
            chain.push(edge);
        }
        if here != start {
            return Err(split(here));
        }
        if let Some(rest) = open.keys().next() {
            return Err(split(*rest));
        }
        chain.retain(|e| !sits(e));
        Ok(self.with_ends(&chain))
    }

    /// The outline of a chain of edges, closed by flat ends where it is not closed by itself.
    fn with_ends(&self, chain: &[[usize; 3]]) -> Outline {
        let mut nodes: Vec<usize> = chain.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let edge = |e: &[usize; 3]| Edge {
            points: e.map(|k| self.nodes[k]),
            nodes: Some(e.map(|k| nodes.partition_point(|&n| n < k))),
        };
        let mut edges: Vec<Edge> = chain.iter().map(edge).collect();
        if let (Some(first), Some(last)) = (chain.first().map(|e| e[0]), chain.last().map(|e| e[1])) {
            if first != last {
                let flat = |from: [f64; 2], to: [f64; 2]| Edge {
                    points: [from, to, [0, 1].map(|c| 0.5 * (from[c] + to[c]))],
                    nodes: None,
                };
                let (a, b) = (self.nodes[first], self.nodes[last]);
                if a[0] > 0.0 {
                    edges.insert(0, flat([0.0, a[1]], a));
                }
                if b[0] > 0.0 {
                    edges.push(flat(b, [0.0, b[1]]));
                }
            }
        }
        Outline { nodes, edges }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{cylinder, w920s, CylinderSection, Focus};
    use super::*;

    const FOCUS: Focus = Focus { size: 0.02, reach: 0.0, corner: 0.01, largest: 0.03 };

    /// 2π∫ r² dy / 2 round the outline, m³: the volume of what is inside.
    fn volume(outline: &Outline) -> f64 {
        let of = |e: &Edge| {
            let [a, b, c] = e.points;
            // ∫ r² dy of a parabola, by Simpson's rule where it is straight.
            std::f64::consts::PI * (b[1] - a[1]) * (a[0] * a[0] + 4.0 * c[0] * c[0] + b[0] * b[0]) / 6.0
        };
        outline.edges.iter().map(of).sum()
    }

    fn joined(outline: &Outline) -> bool {
        outline.edges.windows(2).all(|w| w[0].points[1] == w[1].points[0])
    }

    #[test]
    fn a_wheel_is_outlined_with_its_axle_or_with_its_bore() {
        let section = w920s(0.0, FOCUS).expect("section");
        let free = section.outline(&[]).expect("outline");
        assert!(joined(&free) && free.edges[0].points[0] == free.edges[free.edges.len() - 1].points[1]);
        assert!((volume(&free) / section.volume() - 1.0).abs() < 1e-12);
        let held = section.outline(&section.groups["inner"]).expect("outline");
        assert!(joined(&held));
        let (first, last) = (held.edges[0], held.edges[held.edges.len() - 1]);
        assert_eq!((first.points[0], first.nodes), ([0.0, -0.09], None));
        assert_eq!((last.points[1], last.nodes), ([0.0, 0.09], None));
        let axle = std::f64::consts::PI * 0.095f64.powi(2) * 0.18;
        assert!((volume(&held) / (section.volume() + axle) - 1.0).abs() < 1e-12);
        let lowest = held.nodes.iter().map(|&k| section.nodes[k][0]).fold(f64::INFINITY, f64::min);
        assert_eq!(lowest, 0.095);
    }

    #[test]
    fn clamped_sides_stay_and_outlines_that_meet_themselves_are_refused() {
        let ring = CylinderSection {
            inner_radius: 0.1,
            outer_radius: 0.3,
            thickness: 0.1,
            crown_radius: None,
            contact_offset: 0.0,
        };
        let section = cylinder(&ring, FOCUS).expect("section");
        let side = section.outline(&section.groups["side_minus"]).expect("outline");
        assert_eq!(side, section.outline(&[]).expect("outline"));
        // Without an element inside there is a hole.
        let mut holed = section.clone();
        let middle = |e: &super::super::SectionElement| section.nodes[e.nodes[8]];
        let inside = |x: [f64; 2]| (x[0] - 0.2).abs() < 0.05 && x[1].abs() < 0.02;
        let found = holed.elements.iter().position(|e| inside(middle(e))).expect("an element inside");
        holed.elements.remove(found);
        let error = holed.outline(&[]).expect_err("a hole");
        assert!(error.message().contains("one closed curve"), "{error}");
    }
}
