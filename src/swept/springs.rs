//! Springs of revolution between edges of a section and the ground.

use super::forms::Springs;
use super::CrossSection;
use crate::{Error, Result};
use std::f64::consts::PI;

/// Springs all round on the edges of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeSprings {
    /// Name of the group.
    pub group: String,
    /// Stiffness across the axle (radially and along the circle), along it, and along the normal of the surface: N/m,
    /// or N/m³ per area.
    pub stiffness: [f64; 3],
    /// True if that is the stiffness of each square metre, and not of the whole group.
    pub per_area: bool,
}

impl EdgeSprings {
    /// Blocks at pairs of nodes of `section`, each radian.
    pub(super) fn blocks(&self, section: &CrossSection) -> Result<Vec<(usize, usize, Springs)>> {
        let edges = section.edges(&self.group);
        let radius = |edge: &[usize; 3], values: &[f64; 3]| -> f64 {
            edge.iter().zip(values).map(|(&node, v)| v * section.nodes[node][0]).sum()
        };
        let steps =
            edges.iter().flat_map(|e| section.along(e).into_iter().map(move |(values, step)| (e, values, step)));
        let area: f64 = steps.map(|(e, values, step)| 2.0 * PI * step * radius(e, &values)).sum();
        if !(area > 0.0) {
            let names: Vec<String> = section.groups.keys().map(|k| format!("\"{k}\"")).collect();
            return Err(Error::Job(format!(
                "the section has no edges in a group \"{}\" to stand on springs; its groups are {}",
                self.group,
                names.join(", ")
            )));
        }
        let share = if self.per_area { 1.0 } else { 1.0 / area };
        let [across, along, normal] = self.stiffness;
        let mut blocks = Vec::new();
        for edge in &edges {
            let [from, to] = [edge[0], edge[1]].map(|k| section.nodes[k]);
            let (dr, dy) = (to[0] - from[0], to[1] - from[1]);
            let n = [dy / dr.hypot(dy), 0.0, -dr / dr.hypot(dy)];
            let plain = [across, across, along];
            let stiffness: [[f64; 3]; 3] = std::array::from_fn(|i| {
                std::array::from_fn(|j| normal * n[i] * n[j] + if i == j { plain[i] } else { 0.0 })
            });
            let springs = Springs { stiffness, ..Springs::default() };
            for (values, step) in section.along(edge) {
                let weight = share * step * radius(edge, &values);
                for (&a, va) in edge.iter().zip(values) {
                    for (&b, vb) in edge.iter().zip(values) {
                        blocks.push((a, b, springs.times(weight * va * vb)));
                    }
                }
            }
        }
        Ok(blocks)
    }
}
