//! Named points of the bodies: nodes of their meshes, with the modes there.

use crate::analysis::bodies::Bodies;
use crate::body::fe::BodyModes;
use crate::job::{self, BodyName};
use crate::output::{Reader, Table};
use crate::parallel::World;
use crate::{Error, Result};

/// Points with the modes of both bodies, the lower one's first.
pub struct Points {
    /// Their names.
    pub names: Vec<String>,
    /// Positions of the nodes, in the frame of the contact point, m.
    at: Vec<[f64; 3]>,
    /// Modes at the points, (x, y, z) in that frame, 1/√kg, `[3 points][m]`; on every rank.
    rows: Vec<Vec<f64>>,
}

impl Points {
    /// Collective: the nodes nearest to the points of the job.
    pub fn find(world: &World, wanted: &job::Transient, bodies: &Bodies, modes: &[BodyModes]) -> Result<Self> {
        let mut points = Self { names: Vec::new(), at: Vec::new(), rows: Vec::new() };
        if !wanted.points.is_empty() && modes.is_empty() {
            return Err(Error::Job(
                "analyses.transient.points: with --reuse there are no mode shapes of the bodies; leave the points out, or run \
                 without --reuse"
                    .into(),
            ));
        }
        let counts: Vec<usize> = bodies.places.iter().map(|p| modes.get(p.body).map_or(0, |m| m.omega.len())).collect();
        for point in &wanted.points {
            let place = usize::from(point.body == BodyName::Upper);
            let missing = || Error::Defect("a body of a point is missing".into());
            let at = bodies.places.get(place).ok_or_else(missing)?;
            let (body, shapes) = (&bodies.unique[at.body], &modes[at.body]);
            let up = if at.upper { -1.0 } else { 1.0 };
            let target = [point.at[0], point.at[1], up * point.at[2]];
            let distance = |p: &[f64; 3]| (0..3).map(|c| (p[c] - target[c]).powi(2)).sum::<f64>().sqrt();
            let nearest = (0..body.part.owned)
                .min_by(|&a, &b| distance(&body.part.coords[a]).total_cmp(&distance(&body.part.coords[b])));
            let mine = nearest.map_or(f64::INFINITY, |i| distance(&body.part.coords[i]));
            let best = -world.max(-mine);
            // The lowest rank that has it, and the size of the cells there.
            let holder = -world.max(if mine == best { -(world.rank as f64) } else { f64::NEG_INFINITY });
            let node = nearest.filter(|_| holder == world.rank as f64);
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
            let first: usize = counts[..place].iter().sum();
            let mut rows = vec![vec![0.0; counts.iter().sum()]; 3];
            for (k, vector) in shapes.vectors.iter().enumerate() {
                let values = body.at_nodes(world, vector);
                for (c, row) in rows.iter_mut().enumerate() {
                    let sign = if c == 2 { up } else { 1.0 };
                    row[first + k] = sign * world.sum(node.map_or(0.0, |i| values[i][c]));
                }
            }
            points.names.push(point.name.clone());
            points.at.push(position);
            points.rows.extend(rows);
        }
        Ok(points)
    }

    /// Displacements (or velocities) of the points under modal ones, `[3 points]`.
    pub fn motion(&self, q: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| row.iter().zip(q).map(|(a, b)| a * b).sum()).collect()
    }

    /// The modes at the points as a table of the first segment.
    pub fn kept(&self) -> Option<Table> {
        let first = self.rows.first()?;
        let text = "Modes (x, y, z) at the points.";
        let shape = [self.rows.len(), first.len()];
        Some(Table::new("/checkpoint/points", "kg^-1/2", text, &shape, self.rows.concat()))
    }

    /// On rank 0: takes the modes at the points that the run was begun with.
    pub fn restore(&mut self, first: &std::path::Path) -> Result<()> {
        let count = self.rows.first().map_or(0, Vec::len);
        if count == 0 {
            return Ok(());
        }
        let (shape, values) = Reader::open(first)?.numbers("/checkpoint/points")?;
        if shape != [self.rows.len(), count] {
            return Err(Error::Job(format!(
                "--resume: {}: /checkpoint/points has the shape {shape:?}, expected {:?}",
                first.display(),
                [self.rows.len(), count]
            )));
        }
        self.rows = values.chunks_exact(count).map(<[f64]>::to_vec).collect();
        Ok(())
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
