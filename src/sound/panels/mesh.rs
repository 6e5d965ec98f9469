//! Panels along the outline of a section, and the velocities of its nodes on them.

use super::panel::{Panel, NODES};
use super::PanelSurface;
use crate::swept::Outline;
use faer::{Mat, MatRef};

/// Edges that meet at a larger angle than this, by its cosine (20°), make a corner.
const SMOOTH: f64 = 0.94;
/// Panels at a corner are this part of the largest ones, and grow by this part of the distance from it.
const AT_CORNER: f64 = 0.2;
const GROWTH: f64 = 0.7;

/// The panels of an outline.
#[derive(Debug, Clone)]
pub struct PanelMesh {
    /// The panels.
    pub surface: PanelSurface,
    /// Interpolation from the nodes of the outline to each node of the panels: their places and weights; nothing where
    /// it stands still.
    takes: Vec<Vec<(usize, f64)>>,
    /// Number of the outline's nodes.
    given: usize,
}

/// A place on the outline: edge and parameter, −1 to 1.
type Place = (usize, f64);

impl PanelMesh {
    /// Panels no longer than `size`, m.
    pub fn new(outline: &Outline, size: f64) -> Self {
        let (mut panels, mut takes) = (Vec::new(), Vec::new());
        for run in smooth_runs(outline) {
            let lengths: Vec<f64> = run.iter().map(|&e| length(outline, e)).collect();
            let breaks = divided(lengths.iter().sum(), size);
            let place = |s: f64| at_length(&run, &lengths, s);
            for w in breaks.windows(2) {
                let middle = 0.5 * (w[0] + w[1]);
                panels.push(Panel { points: [w[0], w[1], middle].map(|s| point(outline, place(s))) });
                for t in Panel::parameters() {
                    let (edge, t) = place(middle + 0.5 * (w[1] - w[0]) * t);
                    let nodes = outline.edges[edge].nodes;
                    takes.push(nodes.map_or(Vec::new(), |n| n.into_iter().zip(shape(t)).collect()));
                }
            }
        }
        debug_assert_eq!(takes.len(), NODES * panels.len());
        Self { surface: PanelSurface::new(panels), takes, given: outline.nodes.len() }
    }

    /// Outward normal velocities at the nodes of the panels, `[nodes, m]`, of (u_r, u_y) at the nodes of the outline,
    /// `[2 · nodes, m]`, interleaved.
    pub fn normal(&self, motion: MatRef<'_, f64>) -> Mat<f64> {
        debug_assert_eq!(motion.nrows(), 2 * self.given);
        Mat::from_fn(self.takes.len(), motion.ncols(), |i, j| {
            let normal = self.surface.nodes()[i].point.normal;
            let part =
                |&(k, w): &(usize, f64)| w * (normal[0] * motion[(2 * k, j)] + normal[1] * motion[(2 * k + 1, j)]);
            self.takes[i].iter().map(part).sum()
        })
    }
}

/// Shape functions of an edge: first, last, middle node.
fn shape(t: f64) -> [f64; 3] {
    [0.5 * t * (t - 1.0), 0.5 * t * (t + 1.0), 1.0 - t * t]
}

fn point(outline: &Outline, (edge, t): Place) -> [f64; 2] {
    let points = outline.edges[edge].points;
    let n = shape(t);
    [0, 1].map(|c| (0..3).map(|k| n[k] * points[k][c]).sum())
}

/// Unit vector along an edge at its first (t = −1) or last (t = 1) point.
fn direction(outline: &Outline, (edge, t): Place) -> [f64; 2] {
    let [a, b, c] = outline.edges[edge].points;
    let d = [0, 1].map(|k| (t - 0.5) * a[k] + (t + 0.5) * b[k] - 2.0 * t * c[k]);
    d.map(|x| x / d[0].hypot(d[1]))
}

fn length(outline: &Outline, edge: usize) -> f64 {
    Panel { points: outline.edges[edge].points }.length()
}

/// Edges between corners and ends. An end that stands still is a run of its own.
fn smooth_runs(outline: &Outline) -> Vec<Vec<usize>> {
    let count = outline.edges.len();
    let breaks = |e: usize| {
        let next = (e + 1) % count;
        let (here, there) = (direction(outline, (e, 1.0)), direction(outline, (next, -1.0)));
        let apart = outline.edges[e].points[1] != outline.edges[next].points[0];
        let stands = outline.edges[e].nodes.is_none() != outline.edges[next].nodes.is_none();
        apart || stands || here[0] * there[0] + here[1] * there[1] < SMOOTH
    };
    // After a corner, where there is one.
    let start = (0..count).find(|&e| breaks(e)).map_or(0, |e| e + 1);
    let mut runs = vec![Vec::new()];
    for k in 0..count {
        let edge = (start + k) % count;
        if let Some(run) = runs.last_mut() {
            run.push(edge);
        }
        if breaks(edge) && k + 1 < count {
            runs.push(Vec::new());
        }
    }
    runs
}

/// Ends of the panels along a run of this length, m, from 0: small at both ends of the run.
fn divided(length: f64, size: f64) -> Vec<f64> {
    const PARTS: usize = 256;
    let corner = AT_CORNER * size;
    let wanted = |s: f64| (corner + GROWTH * s.min(length - s)).min(size);
    let step = length / PARTS as f64;
    // Panels up to each place, had they just the size that is wanted there.
    let mut count = vec![0.0];
    for k in 0..PARTS {
        count.push(count[k] + step / wanted(step * (k as f64 + 0.5)));
    }
    let panels = count[PARTS].ceil().max(1.0) as usize;
    let mut ends = vec![0.0];
    let mut k = 0;
    for panel in 1..panels {
        let upto = count[PARTS] * panel as f64 / panels as f64;
        while count[k + 1] < upto {
            k += 1;
        }
        ends.push(step * (k as f64 + (upto - count[k]) / (count[k + 1] - count[k])));
    }
    ends.push(length);
    ends
}

/// The place at the length `s` along a run of edges.
fn at_length(run: &[usize], lengths: &[f64], s: f64) -> Place {
    let mut left = s;
    for (k, l) in lengths.iter().enumerate() {
        if left <= *l || k + 1 == lengths.len() {
            return (run[k], (2.0 * left / l - 1.0).clamp(-1.0, 1.0));
        }
        left -= l;
    }
    (run[0], -1.0)
}

#[cfg(test)]
mod tests;
