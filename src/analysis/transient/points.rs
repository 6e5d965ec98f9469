//! Named points of the bodies: nodes of their meshes, with what the modes and the contact forces move there.

use crate::analysis::bodies::Bodies;
use crate::analysis::reduction::Reduction;
use crate::body::fe::BodyModes;
use crate::body::residual;
use crate::body::statics::Statics;
use crate::job::{self, BodyName};
use crate::output::{Reader, Table};
use crate::parallel::World;
use crate::{Error, Result};
use std::cmp::Ordering;
use std::path::Path;

/// Points with the modes of both bodies, the lower one's first, and the residual compliance of n contact nodes.
#[derive(Default)]
pub struct Points {
    /// Their names.
    pub names: Vec<String>,
    /// Positions of the nodes, in the frame of the contact point, m.
    at: Vec<[f64; 3]>,
    /// Index of their bodies in `Bodies::places`.
    place: Vec<usize>,
    /// Their nodes among those of this rank, where it owns them.
    node: Vec<Option<usize>>,
    /// Each mode at the points, (x, y, z) in that frame, 1/√kg, `[m][3 points]`; on rank 0.
    modes: Vec<f64>,
    /// Displacements of the points in that frame by the reactions (tx, ty, p), without their part in the modes, m/N,
    /// `[3n][3 points]`; on rank 0.
    residual: Vec<f64>,
}

impl Points {
    /// Points that are moved by the modes as `modes` says and by the reactions as `residual` does.
    #[cfg(test)]
    pub fn moved(names: &[&str], modes: Vec<f64>, residual: Vec<f64>) -> Self {
        Self { names: names.iter().map(|n| n.to_string()).collect(), modes, residual, ..Self::default() }
    }

    /// Collective: the nodes nearest to the points of the job; nothing moves them yet.
    pub fn find(world: &World, wanted: &job::Transient, bodies: &Bodies, modes: &[BodyModes]) -> Result<Self> {
        let mut points = Self::default();
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
            points.names.push(point.name.clone());
            points.at.push(position);
            points.place.push(place);
            points.node.push(node);
        }
        Ok(points)
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
        self.modes = columns(&modal);
        self.residual = columns(&residual);
        Ok(())
    }

    /// On rank 0: what moved the points when the run was begun, from its first segment; computed again it would not be the same to
    /// the last bit.
    pub fn restore(&mut self, first: &Path) -> Result<()> {
        if self.names.is_empty() {
            return Ok(());
        }
        let file = Reader::open(first)?;
        let matrix = |name: &str| {
            let path = format!("/checkpoint/points/{name}");
            let (shape, values) = file.numbers(&path)?;
            let rows = 3 * self.names.len();
            if shape.len() != 2 || shape[1] != rows {
                return Err(Error::Input(format!(
                    "--resume: {}: {path} has the shape {shape:?}, expected {rows} columns",
                    first.display()
                )));
            }
            Ok(values)
        };
        (self.modes, self.residual) = (matrix("modes")?, matrix("residual")?);
        Ok(())
    }

    /// Displacements (or velocities) of the points by modal ones, `[3 points]`; on rank 0.
    pub fn modal(&self, q: &[f64]) -> Vec<f64> {
        self.sum(&self.modes, q)
    }

    /// Displacements of the points by the reactions beyond the modes, m, `[3 points]`; on rank 0. `reaction` is (tx, ty, p), N, `[3n]`.
    pub fn residual(&self, reaction: &[f64]) -> Vec<f64> {
        self.sum(&self.residual, reaction)
    }

    /// The columns times `factors`, of which many are 0.
    fn sum(&self, columns: &[f64], factors: &[f64]) -> Vec<f64> {
        let rows = 3 * self.names.len();
        let mut out = vec![0.0; rows];
        for (column, &f) in columns.chunks_exact(rows.max(1)).zip(factors).filter(|(_, f)| **f != 0.0) {
            out.iter_mut().zip(column).for_each(|(o, c)| *o += c * f);
        }
        out
    }

    /// What moves the points, as tables of the first segment.
    pub fn kept(&self) -> Vec<Table> {
        let rows = 3 * self.names.len();
        if rows == 0 {
            return Vec::new();
        }
        let table = |name: &str, units: &str, text: &str, values: &Vec<f64>| {
            let path = format!("/checkpoint/points/{name}");
            Table::new(&path, units, text, &[values.len() / rows, rows], values.clone())
        };
        vec![
            table("modes", "kg^-1/2", "Each mode at the points (x, y, z).", &self.modes),
            table(
                "residual",
                "m/N",
                "Displacements (x, y, z) of the points by each reaction, without their part in the modes.",
                &self.residual,
            ),
        ]
    }

    /// What says which points they are.
    pub fn tables(&self) -> Vec<Table> {
        if self.names.is_empty() {
            return Vec::new();
        }
        let at = self.at.as_flattened().to_vec();
        vec![
            Table::list("/transient/points/name", "-", "Names of the points.", self.names.clone()),
            Table::new(
                "/transient/points/position",
                "m",
                "Nodes taken for the points (x, y, z).",
                &[self.at.len(), 3],
                at,
            ),
        ]
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
