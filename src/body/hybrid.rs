//! The contact of a body whose compliance is that of a half-space and a motion of the contact that is constant or goes with x and y ("hybrid").

use super::half_space::HalfSpace;
use crate::parallel::World;
use crate::swept::compliance::sum;
use crate::swept::{both_turned, Constant, Forms, HalfSpaceLoad, Patch, Square, LOADS};
use crate::{Error, Result};
use faer::Mat;

/// Part of the smaller half side of the grid that the circle of the loads has as its radius: about a contact that the grid holds with room to spare.
pub const CIRCLE: f64 = 2.0 / 3.0;
/// A second, wider circle shows how little the constant depends on it.
pub const WIDER: f64 = 1.5;
/// A difference between both circles of more than this part of the contact's own compliance is called large.
const LARGE: f64 = 0.01;

/// Σ ψ̂ψ̂ᵀ/ω²: what modes with ψ̂ = `seen` and the angular frequencies `omega`, rad/s, have of the compliance.
pub(super) fn statics(omega: &[f64], seen: &[[f64; LOADS]]) -> Square {
    let mut sum = [[0.0; LOADS]; LOADS];
    for (w, psi) in omega.iter().zip(seen).filter(|(w, _)| **w > 0.0) {
        for (row, a) in sum.iter_mut().zip(psi) {
            row.iter_mut().zip(psi).for_each(|(m, b)| *m += a * b / (w * w));
        }
    }
    sum
}

/// π = (1, x, y) of the contact rows on a grid of lines along x and y, m, `[3n, 9]`.
pub(super) fn expansion([x, y]: &[Vec<f64>; 2]) -> Mat<f64> {
    let mut pi = Mat::zeros(3 * x.len() * y.len(), LOADS);
    for row in 0..pi.nrows() {
        let node = row / 3;
        let factors = [1.0, x[node % x.len()], y[node / x.len()]];
        factors.into_iter().enumerate().for_each(|(m, f)| pi[(row, 3 * m + row % 3)] = f);
    }
    pi
}

/// The contact rows of a body, on every rank.
#[derive(Debug, Clone)]
pub struct Hybrid {
    /// Lines of the contact grid along x and y, m; none without contact.
    grid: [Vec<f64>; 2],
    half_space: HalfSpace,
    /// What is added to the half-space, m/N and so on, once it is made.
    constant: Option<Square>,
    /// What is added to that by what the section's forms do not know.
    beside: Square,
    /// Modal part of it, once modes are known.
    modal: Square,
}

impl Hybrid {
    /// That of a body of the material of `half_space` with the lines of its contact grid, m, where there is a contact.
    pub fn new(half_space: HalfSpace, grid: Option<[&[f64]; 2]>) -> Self {
        let grid = grid.map_or([Vec::new(), Vec::new()], |lines| lines.map(<[f64]>::to_vec));
        let none = [[0.0; LOADS]; LOADS];
        Self { grid, half_space, constant: None, beside: none, modal: none }
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

    /// Collective: makes what is added to the half-space from the `forms` of a section that is meshed for loads at its contact; order n has the
    /// wavenumber n over `radius`, m. The frame of the contact is turned by `tilt`, rad, against that of the section's surface. What was made, for the
    /// summary.
    pub fn make(&mut self, world: &World, forms: &Forms, radius: f64, tilt: f64) -> Result<Option<String>> {
        let Some(circle) = self.circle() else { return Ok(None) };
        let wider = Patch { radius: WIDER * circle.radius };
        // Beside a corner there is room for the one alone.
        let both = Constant::new(forms, &[circle, wider], radius);
        let constant = both.or_else(|_| Constant::new(forms, &[circle], radius))?;
        let mine = (world.rank..constant.blocks.len()).step_by(world.size);
        let mut memory = Vec::new();
        let parts = world.agree(mine.map(|k| constant.block(k, &mut memory)).collect::<Result<Vec<_>>>())?;
        let nothing = constant.singles().iter().map(|_| [[0.0; LOADS]; LOADS]).collect();
        let own = if world.is_root() { constant.singles() } else { nothing };
        let all = world.sum_all(sum(parts.into_iter().chain([own])).as_flattened().as_flattened());
        let square = |of: &[f64]| -> Square { std::array::from_fn(|c| std::array::from_fn(|d| of[LOADS * c + d])) };
        let made: Vec<Square> = all.chunks_exact(LOADS * LOADS).map(|a| both_turned(&square(a), tilt)).collect();
        let beside = self.take(&made, circle)?;
        Ok(Some(format!(
            "sections of {} unknowns at {} of the orders up to {}; {beside}",
            forms.order(),
            constant.blocks.len(),
            constant.blocks.iter().map(|b| b.0 + b.1 / 2).max().unwrap_or(0)
        )))
    }

    /// What `yielding`, Γ⁻¹BΓ⁻¹ of loads on the discs `circles`, leaves beside the half-space is kept; said in words, for the summary.
    pub fn complete(&mut self, yielding: &[Square], circles: &[Patch]) -> Result<String> {
        let beside = |(b, &patch): (&Square, &Patch)| -> Square {
            let load = HalfSpaceLoad { patch, shear: self.half_space.shear(), poisson: self.half_space.poisson };
            let (known, moments) = (load.whole(), patch.moments());
            std::array::from_fn(|c| std::array::from_fn(|d| b[c][d] - known[c][d] / (moments[c] * moments[d])))
        };
        let made: Vec<Square> = yielding.iter().zip(circles).map(beside).collect();
        let circle = circles.first().copied().unwrap_or(Patch { radius: 0.0 });
        Ok(format!("means over a disc of {:.2} mm; {}", 1e3 * circle.radius, self.take(&made, circle)?))
    }

    /// Keeps the first of `made`, what is added to the half-space by loads on the `circle` and on a wider one; in words.
    fn take(&mut self, made: &[Square], circle: Patch) -> Result<String> {
        let Some(&a) = made.first() else { return Err(Error::Defect("no compliance beside the half-space".into())) };
        self.constant = Some(a);
        let pico = |v: f64| 1e12 * v;
        let mut text = format!(
            "beside a half-space xx {:.1}, yy {:.1}, nn {:.1}, yn {:.1} pm/N",
            pico(a[0][0]),
            pico(a[1][1]),
            pico(a[2][2]),
            pico(a[1][2])
        );
        if let Some(wide) = made.get(1) {
            // Displacements of the middle under forces.
            let off = |c: usize, d: usize| (wide[c][d] - a[c][d]).abs();
            let largest = |all: &[(usize, usize)]| all.iter().map(|&(c, d)| off(c, d)).fold(0.0, f64::max);
            let (normal, along) = (largest(&[(0, 2), (1, 2), (2, 2)]), largest(&[(0, 0), (0, 1), (1, 1)]));
            let own = 0.6 / (self.half_space.plane() * circle.radius);
            text += &format!(
                ", good to {:.1} pm/N along n or by forces along it, {:.2} % of the contact's own compliance, {:.1} pm/N along x and y{}",
                pico(normal),
                100.0 * normal / own,
                pico(along),
                if normal > LARGE * own { ", which is much: the surface is not that of a half-space" } else { "" }
            );
        }
        Ok(text)
    }

    /// The modes with ψ̂ = `seen` and the angular frequencies `omega`, rad/s, at the contact rows, 1/√kg, `[3n, m]`. What of the compliance is theirs
    /// is kept.
    pub fn of_modes(&mut self, omega: &[f64], seen: &[[f64; LOADS]]) -> Mat<f64> {
        self.modal = statics(omega, seen);
        let pi = expansion(&self.grid);
        Mat::from_fn(pi.nrows(), seen.len(), |i, k| {
            (0..3).map(|m| 3 * m + i % 3).map(|c| pi[(i, c)] * seen[k][c]).sum()
        })
    }

    /// What the body yields at its contact beside what the forms of its section say, m/N and so on; the last one given counts.
    pub fn add(&mut self, beside: Square) {
        self.beside = beside;
    }

    fn constant(&self, name: &str) -> Result<Square> {
        let missing = || Error::Defect(format!("body \"{name}\" has no compliance: it is not factorised"));
        let constant = self.constant.as_ref().ok_or_else(missing)?;
        Ok(std::array::from_fn(|i| std::array::from_fn(|j| constant[i][j] + self.beside[i][j])))
    }

    /// Collective: static compliance of the contact rows of the body `name`, m/N, `[3n, 3n]` on rank 0. What is left of it without the modes has to
    /// be positive.
    pub fn compliance(&self, world: &World, name: &str) -> Result<Option<Mat<f64>>> {
        let constant = self.constant(name)?;
        world.on_root(|| {
            let c = self.half_space.compliance(&self.grid[0], &self.grid[1])?;
            let pi = expansion(&self.grid);
            let square = |of: &Square| Mat::from_fn(LOADS, LOADS, |i, j| of[i][j]);
            let c = c + &pi * square(&constant) * pi.transpose();
            let residual = &c - &pi * square(&self.modal) * pi.transpose();
            residual.llt(faer::Side::Lower).map_err(|_| {
                Error::NotConverged(format!(
                    "compliance of body \"{name}\": what is left of it without its modes is not positive definite; ask for fewer modes, or make the contact grid smaller (contact.patch, contact.grid)"
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
            let (pi, forces) = (expansion(&self.grid), faer::ColRef::from_slice(forces));
            let square = Mat::from_fn(LOADS, LOADS, |i, j| constant[i][j]);
            let moved = c * forces + &pi * (square * (pi.transpose() * forces));
            Ok(moved.iter().copied().collect())
        })?;
        Ok(found.unwrap_or_default())
    }
}
