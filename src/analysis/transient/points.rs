//! Named points of the bodies: nodes of their meshes, with what the modes and the contact forces move there.

use crate::analysis::bodies::Bodies;
use crate::analysis::reduction::Reduction;
use crate::body::fe::BodyModes;
use crate::body::residual;
use crate::body::statics::Statics;
use crate::job::{self, BodyName};
use crate::output::datasets::points::Points;
use crate::parallel::World;
use crate::{Error, Result};
use std::cmp::Ordering;

/// The nodes that stand for the points of a job.
#[derive(Default)]
pub struct Located {
    /// Names and positions, and what moves them once it is computed.
    pub points: Points,
    /// Index of their bodies in `Bodies::places`.
    place: Vec<usize>,
    /// Their nodes among those of this rank, where it owns them.
    node: Vec<Option<usize>>,
}

impl Located {
    /// Collective: the nodes nearest to the points of the job; nothing moves them yet.
    pub fn find(world: &World, wanted: &job::Transient, bodies: &Bodies, modes: &[BodyModes]) -> Result<Self> {
        let mut located = Self::default();
        if !wanted.points.is_empty() && modes.is_empty() {
            return Err(Error::Job(
                "analyses.transient.points: with --reuse there are no mode shapes of the bodies; leave the points out, or run \
                 without --reuse"
                    .into(),
            ));
        }
        for point in &wanted.points {
            let place = usize::from(point.body == BodyName::Upper);
            let at = bodies.places.get(place).ok_or_else(missing)?;
            let body = &bodies.unique[at.body];
            let up = at.side.reflection(2);
            let target = [point.at[0], point.at[1], up * point.at[2]];
            let distance = |p: &[f64; 3]| (0..3).map(|c| (p[c] - target[c]).powi(2)).sum::<f64>().sqrt();
            // Of nodes equally near the first by its coordinates, which is the same one on any number of ranks.
            let key = |i: usize| {
                let p = &body.part.coords[i];
                [distance(p), p[0], p[1], p[2]]
            };
            let order = |a: &[f64; 4], b: &[f64; 4]| {
                let first = a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne());
                first.unwrap_or(Ordering::Equal)
            };
            let mut node = (0..body.part.owned).min_by(|&a, &b| order(&key(a), &key(b)));
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
                let touching = body.part.cells.iter().filter(|c| c.contains(&(node as u32)));
                touching
                    .flat_map(|c| {
                        c.iter().map(|&j| {
                            (0..3)
                                .map(|k| (body.part.coords[j as usize][k] - body.part.coords[node][k]).powi(2))
                                .sum::<f64>()
                                .sqrt()
                        })
                    })
                    .fold(0.0, f64::max)
            });
            let cell = world.max(cell);
            let place_at: Vec<f64> = (0..3).map(|c| world.sum(node.map_or(0.0, |i| body.part.coords[i][c]))).collect();
            let position = [place_at[0], place_at[1], up * place_at[2]];
            if best > 0.5 * cell {
                return Err(Error::Job(format!(
                    "analyses.transient.points: {:?} at {:?} m is not on the mesh of the {} body: the nearest node, {position:?} m, \
                     is {best:.4} m away, in cells of {cell:.4} m; name a point of the body",
                    point.name, point.at, at.name
                )));
            }
            located.points.names.push(point.name.clone());
            located.points.at.push(position);
            located.place.push(place);
            located.node.push(node);
        }
        Ok(located)
    }

    /// Collective: what moves the points, by three static solves for each.
    pub fn solve(
        &mut self,
        world: &World,
        bodies: &Bodies,
        modes: &[BodyModes],
        model: &Reduction,
        solvers: &mut [Statics],
    ) -> Result<()> {
        let counts: Vec<usize> = bodies.places.iter().map(|p| modes.get(p.body).map_or(0, |m| m.omega.len())).collect();
        let (mut modal, mut residual) = (Vec::new(), Vec::new());
        for (&place, &node) in self.place.iter().zip(&self.node) {
            let at = &bodies.places[place];
            let (Some(shapes), Some(solver)) = (modes.get(at.body), solvers.get_mut(at.body)) else {
                return Err(missing());
            };
            let reduced = model.on_root().map(|m| m.bodies[m.place[place]].contact_modes.as_ref());
            let motion = residual::at_node(world, &bodies.unique[at.body], solver, shapes, reduced, node)?;
            let before: usize = counts[..place].iter().sum();
            for c in 0..3 {
                let sign = at.side.reflection(c);
                let mut row = vec![0.0; counts.iter().sum()];
                row[before..].iter_mut().zip(&motion.modes[c]).for_each(|(r, v)| *r = sign * v);
                modal.push(row);
                // The reactions as forces on this body.
                residual.push(at.side.turned(&motion.residual[c]).iter().map(|v| sign * v).collect::<Vec<f64>>());
            }
        }
        self.points.modes = columns(&modal);
        self.points.residual = columns(&residual);
        Ok(())
    }
}

fn missing() -> Error {
    Error::Defect("a body of a point is missing".into())
}

/// The columns of a matrix given by rows, one after the other.
fn columns(rows: &[Vec<f64>]) -> Vec<f64> {
    let count = rows.first().map_or(0, Vec::len);
    (0..count).flat_map(|k| rows.iter().map(move |row| row[k])).collect()
}
