//! The contact of a body whose compliance is that of a half-space and a motion of the contact that is constant or goes with x and y ("hybrid").

use super::half_space::HalfSpace;
use crate::parallel::World;
use crate::swept::{Patch, Square, LOADS};
use crate::{Error, Result};
use faer::Mat;

/// Part of the smaller half side of the grid that the circle of the loads has as its radius: about a contact that the grid holds with room to spare.
const CIRCLE: f64 = 2.0 / 3.0;

/// The contact rows of a body, on every rank.
#[derive(Debug, Clone)]
pub struct Hybrid {
    /// Lines of the contact grid along x and y, m; none without contact.
    grid: [Vec<f64>; 2],
    half_space: HalfSpace,
    /// What is added to the half-space, m/N and so on, once it is made.
    pub constant: Option<Square>,
    /// Modal part of it, once modes are known.
    modal: Square,
}

impl Hybrid {
    /// That of a body of the material of `half_space` with the lines of its contact grid, m, where there is a contact.
    pub fn new(half_space: HalfSpace, grid: Option<[&[f64]; 2]>) -> Self {
        let grid = grid.map_or([Vec::new(), Vec::new()], |lines| lines.map(<[f64]>::to_vec));
        Self { grid, half_space, constant: None, modal: [[0.0; LOADS]; LOADS] }
    }

    /// Number of contact rows, 3n.
    pub fn rows(&self) -> usize {
        3 * self.grid[0].len() * self.grid[1].len()
    }

    /// The circle of the loads at the contact; none without contact.
    pub fn circle(&self) -> Option<Patch> {
        let half = |lines: &[f64]| Some(0.5 * (lines.last()? - lines.first()?));
        let [x, y] = [half(&self.grid[0])?, half(&self.grid[1])?];
        Some(Patch { radius: CIRCLE * x.min(y) })
    }

    /// The contact's own compliance under a load on a circle, m/N.
    pub fn own(&self, circle: Patch) -> f64 {
        0.6 / (self.half_space.plane() * circle.radius)
    }

    /// π = (1, x, y) of a node.
    fn factors(&self, node: usize) -> [f64; 3] {
        let [x, y] = &self.grid;
        [1.0, x[node % x.len()], y[node / x.len()]]
    }

    /// π a πᵀ of two contact rows.
    fn between(&self, a: &Square, i: usize, j: usize) -> f64 {
        let (left, right) = (self.factors(i / 3), self.factors(j / 3));
        let row = |m: usize| (0..3).map(|k| right[k] * a[3 * m + i % 3][3 * k + j % 3]).sum::<f64>();
        (0..3).map(|m| left[m] * row(m)).sum()
    }

    /// The modes with ψ̂ = `seen` and the angular frequencies `omega`, rad/s, at the contact rows, 1/√kg, `[3n, m]`. What of the compliance is theirs
    /// is kept.
    pub fn of_modes(&mut self, omega: &[f64], seen: &[[f64; LOADS]]) -> Mat<f64> {
        self.modal = [[0.0; LOADS]; LOADS];
        for (w, psi) in omega.iter().zip(seen).filter(|(w, _)| **w > 0.0) {
            for (row, a) in self.modal.iter_mut().zip(psi) {
                row.iter_mut().zip(psi).for_each(|(m, b)| *m += a * b / (w * w));
            }
        }
        Mat::from_fn(self.rows(), seen.len(), |i, k| {
            let pi = self.factors(i / 3);
            (0..3).map(|m| pi[m] * seen[k][3 * m + i % 3]).sum()
        })
    }

    fn constant(&self, name: &str) -> Result<&Square> {
        let missing = || Error::Defect(format!("body \"{name}\" has no compliance: it is not factorised"));
        self.constant.as_ref().ok_or_else(missing)
    }

    /// Collective: static compliance of the contact rows of the body `name`, m/N, `[3n, 3n]` on rank 0. What is left of it without the modes has to
    /// be positive.
    pub fn compliance(&self, world: &World, name: &str) -> Result<Option<Mat<f64>>> {
        let constant = self.constant(name)?;
        world.on_root(|| {
            let mut c = self.half_space.compliance(&self.grid[0], &self.grid[1])?;
            let mut residual = c.clone();
            for j in 0..c.ncols() {
                for i in 0..c.nrows() {
                    let added = self.between(constant, i, j);
                    c[(i, j)] += added;
                    residual[(i, j)] += added - self.between(&self.modal, i, j);
                }
            }
            residual.llt(faer::Side::Lower).map_err(|_| {
                Error::NotConverged(format!(
                    "compliance of body \"{name}\": what is left of it without its modes is not positive definite; ask for fewer modes, or make contact.patch smaller"
                ))
            })?;
            Ok(c)
        })
    }

    /// Collective: static displacement of the contact rows of the body `name`, m, `[3n]` on rank 0, under forces on them, N.
    pub fn response(&self, world: &World, name: &str, forces: &[f64]) -> Result<Vec<f64>> {
        let constant = self.constant(name)?;
        let found = world.on_root(|| {
            let c = self.half_space.compliance(&self.grid[0], &self.grid[1])?;
            let row = |i: usize| {
                let part = |(j, f): (usize, &f64)| (c[(i, j)] + self.between(constant, i, j)) * f;
                forces.iter().enumerate().map(part).sum::<f64>()
            };
            Ok((0..c.nrows()).map(row).collect())
        })?;
        Ok(found.unwrap_or_default())
    }
}
