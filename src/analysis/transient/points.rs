//! Named points of the bodies: nodes of their meshes, with what the modes and the contact forces move there.

use crate::analysis::reduction::Reduction;
use crate::body::nearest::Nearest;
use crate::body::TraceModes;
use crate::case::bodies::BuiltBodies;
use crate::job::{self, BodyName};
use crate::output::datasets::points::Points;
use crate::{Error, Result};

/// The nodes that stand for the points of a job.
#[derive(Default)]
pub struct LocatedPoints {
    /// Names and positions, and what moves them once it is computed.
    pub points: Points,
    /// Index of their bodies in `BuiltBodies::places`.
    place: Vec<usize>,
    /// Their nodes among those of this rank, where it owns them.
    node: Vec<Option<usize>>,
}

impl LocatedPoints {
    /// Collective: the nodes nearest to the points of the job; nothing moves them yet. `shapes` says whether there
    /// are mode shapes.
    pub fn find(wanted: &job::Transient, bodies: &BuiltBodies, shapes: bool) -> Result<Self> {
        let mut located = Self::default();
        if !wanted.points.is_empty() && !shapes {
            return Err(Error::Job(
                "analyses.transient.points: with --reuse there are no mode shapes of the bodies; leave the \
                 points out, or run \
                 without --reuse"
                    .into(),
            ));
        }
        for point in &wanted.points {
            let place = usize::from(point.body == BodyName::Upper);
            let at = bodies.places.get(place).ok_or_else(missing)?;
            let up = at.side.reflection(2);
            let target = [point.at[0], point.at[1], up * point.at[2]];
            let Nearest { node, position, distance: best, cell } = bodies.fields(at.body)?.nearest(target);
            let position = [position[0], position[1], up * position[2]];
            if best > 0.5 * cell {
                return Err(Error::Job(format!(
                    "analyses.transient.points: {:?} at {:?} m is not on the mesh of the {} body: the nearest \
                     node, {position:?} m, \
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

    /// The place of the body of each point, and its node on the rank that owns it.
    pub fn nodes(&self) -> impl Iterator<Item = (usize, Option<usize>)> + '_ {
        self.place.iter().copied().zip(self.node.iter().copied())
    }

    /// Collective: what moves the points, by three static solves for each.
    pub fn solve(&mut self, bodies: &BuiltBodies, modes: &[TraceModes], model: &Reduction) -> Result<()> {
        let counts: Vec<usize> = bodies.places.iter().map(|p| modes.get(p.body).map_or(0, |m| m.omega.len())).collect();
        let (mut modal, mut residual) = (Vec::new(), Vec::new());
        for (&place, &node) in self.place.iter().zip(&self.node) {
            let at = &bodies.places[place];
            let reduced = model.on_root().map(|m| m.bodies[m.place[place]].contact_modes.as_ref());
            let motion = bodies.fields(at.body)?.node_motion(reduced, node)?;
            let before: usize = counts[..place].iter().sum();
            for c in 0..3 {
                let sign = at.side.reflection(c);
                let mut row = vec![0.0; counts.iter().sum()];
                row[before..].iter_mut().zip(&motion.modes[c]).for_each(|(r, v)| *r = sign * v);
                modal.push(row);
                // The reactions as forces on this body.
                residual.push(at.side.orient(&motion.residual[c]).iter().map(|v| sign * v).collect::<Vec<f64>>());
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
