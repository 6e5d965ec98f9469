//! Named points of the bodies, in `/transient` and in the checkpoints.

use super::super::{Reader, Table};
use crate::job::Transient;
use crate::{Error, Result};

/// Points with the modes of both bodies, the lower one's first, and the residual compliance of n contact nodes.
#[derive(Default)]
pub struct Points {
    /// Their names.
    pub names: Vec<String>,
    /// Positions of the nodes, in the frame of the contact point, m.
    pub at: Vec<[f64; 3]>,
    /// Each mode at the points, (x, y, z) in that frame, 1/√kg, `[m][3 points]`; on rank 0.
    pub modes: Vec<f64>,
    /// Displacements of the points in that frame by the reactions (tx, ty, p), without their part in the modes, m/N,
    /// `[3n][3 points]`; on rank 0.
    pub residual: Vec<f64>,
}

impl Points {
    /// Points that are moved by the modes as `modes` says and by the reactions as `residual` does.
    #[cfg(test)]
    pub fn moved(names: &[&str], modes: Vec<f64>, residual: Vec<f64>) -> Self {
        let at = (0..names.len()).map(|k| [k as f64, 0.1, -0.2]).collect();
        Self { names: names.iter().map(|n| n.to_string()).collect(), at, modes, residual }
    }

    /// On rank 0: the points of the run when it was begun, from its first segment; what moves them, computed again,
    /// would not be the same to the last bit.
    pub fn restore(wanted: &Transient, first: &Reader) -> Result<Self> {
        let names: Vec<String> = wanted.points.iter().map(|p| p.name.clone()).collect();
        if names.is_empty() {
            return Ok(Self::default());
        }
        let matrix = |name: &str, rows: usize| {
            let path = format!("/checkpoint/points/{name}");
            let (shape, values) = first.numbers(&path)?;
            if shape.len() != 2 || shape[1] != rows {
                return Err(Error::Input(format!(
                    "--resume: {}: {path} has the shape {shape:?}, expected {rows} columns",
                    first.path().display()
                )));
            }
            Ok(values)
        };
        let rows = 3 * names.len();
        let at = matrix("position", 3)?.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect::<Vec<_>>();
        if at.len() != names.len() {
            let (path, have, want) = (first.path().display(), at.len(), names.len());
            return Err(Error::Input(format!("--resume: {path}: it has positions of {have} points, expected {want}")));
        }
        Ok(Self { modes: matrix("modes", rows)?, residual: matrix("residual", rows)?, names, at })
    }

    /// Displacements (or velocities) of the points by modal ones, `[3 points]`; on rank 0.
    pub fn modal(&self, q: &[f64]) -> Vec<f64> {
        self.sum(&self.modes, q)
    }

    /// Displacements of the points by the reactions beyond the modes, m, `[3 points]`; on rank 0. `reaction` is (tx,
    /// ty, p), N, `[3n]`.
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

    /// Data that move the points, as tables of the first segment.
    pub fn checkpoint_tables(&self) -> Vec<Table> {
        let rows = 3 * self.names.len();
        if rows == 0 {
            return Vec::new();
        }
        let at = self.at.as_flattened().to_vec();
        let table = |name: &str, units: &str, text: &str, values: &Vec<f64>| {
            let path = format!("/checkpoint/points/{name}");
            Table::new(&path, units, text, &[values.len() / rows, rows], values.clone())
        };
        vec![
            Table::new("/checkpoint/points/position", "m", "Nodes taken for the points.", &[self.at.len(), 3], at),
            table("modes", "kg^-1/2", "Each mode at the points (x, y, z).", &self.modes),
            table(
                "residual",
                "m/N",
                "Displacements (x, y, z) of the points by each reaction, without their part in the modes.",
                &self.residual,
            ),
        ]
    }

    /// Tables that identify the points.
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
