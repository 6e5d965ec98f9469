//! The surface of a swept body as the air sees it: the outline of its section in panels.

use super::panel::{Integrals, Kernel, Panel, PanelNode, NODES};
use num_complex::Complex64;

/// The surface of a swept body: its outline in panels, closed, or round an axle from axis to axis.
#[derive(Debug, Clone)]
pub struct PanelSurface {
    panels: Vec<Panel>,
    nodes: Vec<PanelNode>,
}

impl PanelSurface {
    /// Surface of these panels.
    pub fn new(panels: Vec<Panel>) -> Self {
        let nodes = panels.iter().flat_map(Panel::nodes).collect();
        Self { panels, nodes }
    }

    /// The nodes, [`NODES`] of each panel after those of the one before.
    pub fn nodes(&self) -> &[PanelNode] {
        &self.nodes
    }

    /// The integral operators at a point (r, y): `[orders][2][nodes]` one after the other go to `take` as (order,
    /// node, [∫ G, ∫ ∂G/∂n′]).
    pub fn integrate<K: Kernel>(
        &self,
        at: [f64; 2],
        own: Option<usize>,
        k: f64,
        integrals: &mut Integrals<K>,
        mut take: impl FnMut(usize, usize, [Complex64; 2]),
    ) {
        for (p, panel) in self.panels.iter().enumerate() {
            match own.filter(|node| node / NODES == p) {
                Some(node) => integrals.at_node(panel, node % NODES, k),
                None => integrals.beside(panel, at, k),
            }
            for (order, found) in integrals.of_order.iter().enumerate() {
                found.iter().enumerate().for_each(|(j, &v)| take(order, NODES * p + j, v));
            }
        }
    }

    /// Points inside the body, a grid with the spacing `spacing` (m), half of it away from the outline at least.
    pub fn inside(&self, spacing: f64) -> Vec<[f64; 2]> {
        let ends: Vec<[[f64; 2]; 2]> = self.panels.iter().map(|p| [p.points[0], p.points[1]]).collect();
        let corner = |pick: fn(f64, f64) -> f64, c: usize| ends.iter().map(|e| e[0][c]).reduce(pick).unwrap_or(0.0);
        let (low, high) = ([0, 1].map(|c| corner(f64::min, c)), [0, 1].map(|c| corner(f64::max, c)));
        let count = [0, 1].map(|c| ((high[c] - low[c]) / spacing).floor().max(0.0) as usize);
        // In the middle of what is there.
        let start = [0, 1].map(|c| 0.5 * (low[c] + high[c] - count[c] as f64 * spacing));
        let all = (0..=count[0]).flat_map(|i| (0..=count[1]).map(move |j| [i, j]));
        let points = all.map(|ij| [0, 1].map(|c| start[c] + spacing * ij[c] as f64));
        points.filter(|&x| self.encloses(x) && self.distance(x) >= 0.5 * spacing).collect()
    }

    /// Returns whether the outline winds round a point; straight panels stand for bent ones.
    fn encloses(&self, [r, y]: [f64; 2]) -> bool {
        let crossed = |p: &&Panel| {
            let [a, b, _] = p.points;
            (a[1] > y) != (b[1] > y) && r < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        };
        self.panels.iter().filter(crossed).count() % 2 == 1
    }

    /// Distance of a point from the outline, m; straight panels stand for bent ones.
    fn distance(&self, x: [f64; 2]) -> f64 {
        let from = |p: &Panel| {
            let [a, b, _] = p.points;
            let along = [b[0] - a[0], b[1] - a[1]];
            let t = ((x[0] - a[0]) * along[0] + (x[1] - a[1]) * along[1]) / (along[0].powi(2) + along[1].powi(2));
            let t = t.clamp(0.0, 1.0);
            (a[0] + t * along[0] - x[0]).hypot(a[1] + t * along[1] - x[1])
        };
        self.panels.iter().map(from).fold(f64::INFINITY, f64::min)
    }
}
