//! A body that does not move.

use super::modes::Extent;
use super::{ElasticBody, Kind, ProgressFn, TraceModes};
use crate::parallel::World;
use crate::Result;
use faer::Mat;

/// A rigid body that is held.
pub struct Rigid<'w> {
    world: &'w World,
    name: String,
    rows: usize,
}

impl<'w> Rigid<'w> {
    /// The body `name` with `rows` = 3n contact rows.
    pub fn new(world: &'w World, name: &str, rows: usize) -> Self {
        Self { world, name: name.into(), rows }
    }
}

impl ElasticBody for Rigid<'_> {
    fn name(&self) -> &str {
        &self.name
    }

    fn kind(&self) -> Kind {
        Kind::Rigid
    }

    fn rows(&self) -> usize {
        self.rows
    }

    fn compliance(&self, _: &mut ProgressFn) -> Result<Option<Mat<f64>>> {
        Ok(self.world.is_root().then(|| Mat::zeros(self.rows, self.rows)))
    }

    fn modes(&mut self, _: Extent, _: &mut ProgressFn) -> Result<TraceModes> {
        let rows = self.world.is_root().then(|| Mat::zeros(self.rows, 0));
        Ok(TraceModes { rows, reach: f64::INFINITY, ..TraceModes::default() })
    }

    fn response(&self, forces: &[f64]) -> Result<Vec<f64>> {
        Ok(vec![0.0; forces.len()])
    }
}
