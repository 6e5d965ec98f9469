//! The node of a body that is nearest to a point.

use super::fe::FeBody;
use crate::parallel::World;
use std::cmp::Ordering;

/// The node nearest to a point; the same one on any number of ranks.
#[derive(Debug, Clone, Copy)]
pub struct Nearest {
    /// Its number among the nodes of this rank, if this rank owns it.
    pub node: Option<usize>,
    /// Position, m.
    pub position: [f64; 3],
    /// How far it is from the point, m.
    pub distance: f64,
    /// Largest extent of a cell there, from the node, m.
    pub cell: f64,
}

impl FeBody {
    /// Collective: the node nearest to the point `target` (m, in lower form).
    pub fn nearest(&self, world: &World, target: [f64; 3]) -> Nearest {
        let distance = |p: &[f64; 3]| (0..3).map(|c| (p[c] - target[c]).powi(2)).sum::<f64>().sqrt();
        // Of nodes equally near the first by its coordinates, which is the same one on any number of ranks.
        let key = |i: usize| {
            let p = &self.part.coords[i];
            [distance(p), p[0], p[1], p[2]]
        };
        let order = |a: &[f64; 4], b: &[f64; 4]| {
            let first = a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
            first.unwrap_or(Ordering::Equal)
        };
        let mut node = (0..self.part.owned).min_by(|&a, &b| order(&key(a), &key(b)));
        let mut best = f64::INFINITY;
        for k in 0..4 {
            let mine = node.map_or(f64::INFINITY, |i| key(i)[k]);
            let least = -world.max(-mine);
            node = node.filter(|_| mine == least);
            if k == 0 {
                best = least;
            }
        }
        // The size of the cells there.
        let cell = node.map_or(0.0, |node| {
            let touching = self.part.cells.iter().filter(|c| c.nodes.contains(&(node as u32)));
            touching
                .flat_map(|c| {
                    c.nodes.iter().map(|&j| {
                        (0..3)
                            .map(|k| (self.part.coords[j as usize][k] - self.part.coords[node][k]).powi(2))
                            .sum::<f64>()
                            .sqrt()
                    })
                })
                .fold(0.0, f64::max)
        });
        let cell = world.max(cell);
        let position = [0, 1, 2].map(|c| world.sum(node.map_or(0.0, |i| self.part.coords[i][c])));
        Nearest { node, position, distance: best, cell }
    }
}
