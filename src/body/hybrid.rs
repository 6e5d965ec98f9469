//! The contact of a body whose compliance is that of a half-space and a motion of the contact that is constant or
//! goes with x and y ("hybrid").

use super::convolution::{Convolution, Product};
use super::half_space::HalfSpace;
use crate::dense::dot;
use crate::parallel::World;
use crate::swept::compliance::sum;
use crate::swept::{both_turned, Constant, Forms, HalfSpaceLoad, Patch, SectionContact};
use crate::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

pub use crate::swept::{Square, LOADS};

/// Part of the smaller half side of the grid that the circle of the loads has as its radius: about a contact that the
/// grid holds with room to spare.
pub const CIRCLE: f64 = 2.0 / 3.0;
/// A second, wider circle shows how little the constant depends on it.
pub const WIDER: f64 = 1.5;
/// A difference between both circles of more than this part of the contact's own compliance is called large.
const LARGE: f64 = 0.01;

/// Residual of the forces that move a grid as its functions do, over what is wanted, and steps to get there at the
/// most.
const PRECISE: f64 = 1e-10;
const STEPS: usize = 1000;
/// An eigenvalue this near to 0 tells nothing of its sign.
const NEAR: f64 = 1e-6;

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
pub fn expansion([x, y]: &[Vec<f64>; 2]) -> Mat<f64> {
    let mut pi = Mat::zeros(3 * x.len() * y.len(), LOADS);
    for row in 0..pi.nrows() {
        let node = row / 3;
        let factors = [1.0, x[node % x.len()], y[node / x.len()]];
        factors.into_iter().enumerate().for_each(|(m, f)| pi[(row, 3 * m + row % 3)] = f);
    }
    pi
}

/// Low-rank compliance of a body at its contact rows: it yields as a half-space does and by motions that are constant
/// or go with x and y, as its modes move.
#[derive(Debug, Clone, PartialEq)]
pub struct Compact {
    /// The half-space.
    pub half_space: HalfSpace,
    /// Compliance beside it that the modes have no part in, m/N and so on.
    pub beside: Square,
    /// The modes, 1/√kg and 1/(√kg m), `[m]`.
    pub seen: Vec<[f64; LOADS]>,
}

/// The contact rows of a body, on every rank.
#[derive(Debug, Clone)]
pub struct Hybrid {
    /// Lines of the contact grid along x and y, m; none without contact.
    grid: [Vec<f64>; 2],
    half_space: HalfSpace,
    /// Compliance added to the half-space, m/N and so on, once it is made.
    constant: Option<Square>,
    /// Compliance added to `constant` by effects outside the section's forms.
    beside: Square,
    /// The modes at the contact, once they are known, and their part of it.
    seen: Vec<[f64; LOADS]>,
    modal: Square,
}

impl Hybrid {
    /// Compliance of a body of the material of `half_space` with the lines of its contact grid, m, where there is a
    /// contact.
    pub fn new(half_space: HalfSpace, grid: Option<[&[f64]; 2]>) -> Self {
        let grid = grid.map_or([Vec::new(), Vec::new()], |lines| lines.map(<[f64]>::to_vec));
        let none = [[0.0; LOADS]; LOADS];
        Self { grid, half_space, constant: None, beside: none, seen: Vec::new(), modal: none }
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

    /// Collective: makes what is added to the half-space from the `forms` of a section that is meshed for loads at its
    /// `contact`. The frame of the
    /// grid is turned by `tilt`, rad, against that of the loads. Returns a line for the summary.
    pub fn make(
        &mut self,
        world: &World,
        forms: &Forms,
        contact: &SectionContact,
        tilt: f64,
    ) -> Result<Option<String>> {
        let Some(circle) = self.circle() else { return Ok(None) };
        let wider = Patch { radius: WIDER * circle.radius };
        // Beside a corner there is room for the one alone.
        let both = Constant::at(forms, &[circle, wider], contact);
        let constant = both.or_else(|_| Constant::at(forms, &[circle], contact))?;
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
            "section of {} unknowns solved at {} of the Fourier orders up to {}; {beside}",
            forms.order(),
            constant.blocks.len(),
            constant.blocks.iter().map(|b| b.0 + b.1 / 2).max().unwrap_or(0)
        )))
    }

    /// Keeps the compliance that `yielding`, Γ⁻¹BΓ⁻¹ of loads on the discs `circles`, leaves beside the half-space is
    /// kept; said in words, for the summary.
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

    /// Keeps the first of `made`, what is added to the half-space by loads on the `circle` and on a wider one; in
    /// words.
    fn take(&mut self, made: &[Square], circle: Patch) -> Result<String> {
        let Some(&a) = made.first() else { return Err(Error::Defect("no compliance beside the half-space".into())) };
        self.constant = Some(a);
        let pico = |v: f64| 1e12 * v;
        let mut text = format!(
            "compliance added to the half-space xx {:.1}, yy {:.1}, nn {:.1}, yn {:.1} pm/N",
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
                "; estimated error {:.1} pm/N (normal, {:.2} % of the contact's own compliance), {:.1} pm/N \
                 (tangential){}",
                pico(normal),
                100.0 * normal / own,
                pico(along),
                if normal > LARGE * own { "; this is large: the surface is not that of a half-space" } else { "" }
            );
        }
        Ok(text)
    }

    /// The modes with ψ̂ = `seen` and the angular frequencies `omega`, rad/s, at the contact rows, 1/√kg, `[3n, m]`.
    /// Keeps their share of the compliance.
    pub fn of_modes(&mut self, omega: &[f64], seen: &[[f64; LOADS]]) -> Mat<f64> {
        self.modal = statics(omega, seen);
        self.seen = seen.to_vec();
        let pi = expansion(&self.grid);
        Mat::from_fn(pi.nrows(), seen.len(), |i, k| {
            (0..3).map(|m| 3 * m + i % 3).map(|c| pi[(i, c)] * seen[k][c]).sum()
        })
    }

    /// Adds compliance of the body at its contact beside what the forms of its section say, m/N and so on; the last one
    /// given counts.
    pub fn add(&mut self, beside: Square) {
        self.beside = beside;
    }

    fn constant(&self, name: &str) -> Result<Square> {
        let missing = || Error::Defect(format!("body \"{name}\" has no compliance: it is not factorised"));
        let constant = self.constant.as_ref().ok_or_else(missing)?;
        Ok(std::array::from_fn(|i| std::array::from_fn(|j| constant[i][j] + self.beside[i][j])))
    }

    /// Data that the contact rows of the body `name` need, after its modes are known.
    pub fn compact(&self, name: &str) -> Result<Compact> {
        let constant = self.constant(name)?;
        let beside = std::array::from_fn(|i| std::array::from_fn(|j| constant[i][j] - self.modal[i][j]));
        Ok(Compact { half_space: self.half_space, beside, seen: self.seen.clone() })
    }

    /// Collective: static compliance of the contact rows of the body `name`, m/N, `[3n, 3n]` on rank 0. What is left
    /// of it without the modes has to be positive.
    pub fn compliance(&self, world: &World, name: &str) -> Result<Option<Mat<f64>>> {
        let constant = self.constant(name)?;
        refuse_negative(world, &[(name, &self.compact(name)?)], &self.grid)?;
        world.on_root(|| matrix(&self.half_space, &constant, &self.grid))
    }

    /// Collective: static displacement of the contact rows of the body `name`, m, `[3n]` on rank 0, under forces on
    /// them, N.
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

/// A half-space and what is `beside` it at the contact rows, m/N, `[3n, 3n]`.
fn matrix(half_space: &HalfSpace, beside: &Square, grid: &[Vec<f64>; 2]) -> Result<Mat<f64>> {
    let mut c = half_space.compliance(&grid[0], &grid[1])?;
    add_functions(&mut c, &expansion(grid), beside);
    Ok(c)
}

/// Collective: an error where what is left of the compliance of a body without its modes is not positive definite, of
/// `bodies` with their names on one grid. What counts is what rank 0 knows.
///
/// C + π D πᵀ with a positive C is positive just where 1 + LᵀDL is, LLᵀ = πᵀC⁻¹π.
pub fn refuse_negative(world: &World, bodies: &[(&str, &Compact)], grid: &[Vec<f64>; 2]) -> Result<()> {
    // Of half-spaces of one Poisson's ratio one is as good as the other.
    let mut known: Vec<(f64, Option<Square>)> = Vec::new();
    for (name, Compact { half_space, beside, .. }) in bodies {
        let left = world.broadcast(beside.as_flattened().to_vec());
        let left: Square = std::array::from_fn(|i| std::array::from_fn(|j| left[LOADS * i + j]));
        let punch = match known.iter().find(|(poisson, _)| *poisson == half_space.poisson) {
            Some(&(_, punch)) => punch,
            None => {
                let punch = punch(world, half_space.poisson, grid)?;
                known.push((half_space.poisson, punch));
                punch
            }
        };
        let scaled = punch.map(|p| p.map(|row| row.map(|v| v * half_space.young)));
        let positive = match scaled.and_then(|punch| stays_positive(&punch, &left)) {
            Some(positive) => positive,
            None => {
                let dense = || Ok(matrix(half_space, &left, grid)?.llt(faer::Side::Lower).is_ok());
                world.max(f64::from(u8::from(world.on_root(dense)? == Some(true)))) > 0.0
            }
        };
        if !positive {
            return Err(Error::NotConverged(format!(
                "compliance of body \"{name}\": what is left of it without its modes is not positive definite; \
                 ask for fewer modes, or make the contact grid smaller (contact.patch, contact.grid)"
            )));
        }
    }
    Ok(())
}

/// Adds π D πᵀ, D = `beside`, to a matrix of the contact rows, `[3n, 3n]`.
pub fn add_functions(c: &mut Mat<f64>, pi: &Mat<f64>, beside: &Square) {
    let half = pi * Mat::from_fn(LOADS, LOADS, |i, j| beside[i][j]);
    matmul(c.as_mut(), Accum::Add, half.as_ref(), pi.transpose(), 1.0, Par::Seq);
}

/// Collective: πᵀC⁻¹π of a half-space of 1 Pa and of a Poisson's ratio on a grid, m and so on: by the forces that
/// move all nodes as the functions π do; none where the grid is not uniform, or they are not found.
fn punch(world: &World, poisson: f64, grid: &[Vec<f64>; 2]) -> Result<Option<Square>> {
    let half_space = HalfSpace { young: 1.0, poisson };
    let Some(c) = Convolution::of_half_space(&half_space, &grid[0], &grid[1])? else { return Ok(None) };
    let pi = expansion(grid);
    let mut product = c.exact();
    let mut found = [[0.0; LOADS]; LOADS];
    let mut all = true;
    for k in (world.rank..LOADS).step_by(world.size) {
        match forces(&mut product, pi.col_as_slice(k)) {
            Some(forces) => (0..LOADS).for_each(|l| found[k][l] = dot(pi.col_as_slice(l), &forces)),
            None => all = false,
        }
    }
    let sums = world.sum_all(found.as_flattened());
    let all = world.max(f64::from(u8::from(!all))) == 0.0;
    let mean = |i: usize, j: usize| 0.5 * (sums[LOADS * i + j] + sums[LOADS * j + i]);
    Ok(all.then(|| std::array::from_fn(|i| std::array::from_fn(|j| mean(i, j)))))
}

/// The forces under which all nodes move by `motion`, by conjugate gradients; none where these do not get there.
fn forces(product: &mut Product<'_, f64>, motion: &[f64]) -> Option<Vec<f64>> {
    let mut found = vec![0.0; motion.len()];
    let (mut rest, mut way, mut moved) = (motion.to_vec(), motion.to_vec(), motion.to_vec());
    let mut square = dot(&rest, &rest);
    let small = PRECISE * PRECISE * square;
    for _ in 0..STEPS {
        if square <= small {
            return Some(found);
        }
        product.times(&way, &mut moved);
        let step = square / dot(&way, &moved);
        found.iter_mut().zip(&way).for_each(|(f, w)| *f += step * w);
        rest.iter_mut().zip(&moved).for_each(|(r, m)| *r -= step * m);
        let before = std::mem::replace(&mut square, dot(&rest, &rest));
        way.iter_mut().zip(&rest).for_each(|(w, r)| *w = r + square / before * *w);
    }
    None
}

/// Returns whether 1 + LᵀDL, LLᵀ = `punch`, D = `left`, is positive definite; none where that is not certain.
fn stays_positive(punch: &Square, left: &Square) -> Option<bool> {
    let [punch, left] = [punch, left].map(|of| Mat::from_fn(LOADS, LOADS, |i, j| of[i][j]));
    let factor = punch.llt(faer::Side::Lower).ok()?;
    let grown = factor.L().transpose() * (left * factor.L());
    let values = grown.self_adjoint_eigenvalues(faer::Side::Lower).ok()?;
    let lowest = 1.0 + values.into_iter().fold(f64::INFINITY, f64::min);
    (lowest.abs() > NEAR).then_some(lowest > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The forces that hold a grid as the functions do are those of the dense inverse; the sign of what is left is
    /// that of its Cholesky factor, on either side of where it changes.
    #[test]
    fn what_is_left_is_positive_where_its_factor_is() {
        let line = |n: i32, h: f64| (-n..=n).map(|i| f64::from(i) * h).collect::<Vec<f64>>();
        let grid = [line(4, 1e-3), line(3, 0.8e-3)];
        let steel = HalfSpace { young: 210e9, poisson: 0.3 };
        let (c, pi) = (steel.compliance(&grid[0], &grid[1]).unwrap(), expansion(&grid));
        let convolution = Convolution::of_half_space(&steel, &grid[0], &grid[1]).unwrap().unwrap();
        let mut product = convolution.exact();
        let found = Mat::from_fn(pi.nrows(), LOADS, {
            let all: Vec<Vec<f64>> = (0..LOADS).map(|k| forces(&mut product, pi.col_as_slice(k)).unwrap()).collect();
            move |i, k| all[k][i]
        });
        assert!((&c * &found - &pi).norm_max() < 1e-8, "{:e}", (&c * &found - &pi).norm_max());
        let dense = pi.transpose() * &found;
        let punch: Square = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (dense[(i, j)] + dense[(j, i)])));
        let stiff = |k: usize| 1.0 / punch[k][k];
        let mut answers = [0, 0];
        for part in [-0.2, -0.9, -1.1] {
            for k in 0..LOADS {
                // Of which the half-space alone would need just as much, beside one that yields more.
                let mut left = [[0.0; LOADS]; LOADS];
                left[k][k] = part * stiff(k);
                left[2][2] += 0.3 * stiff(2);
                let mut whole = c.clone();
                add_functions(&mut whole, &pi, &left);
                let factor = whole.llt(faer::Side::Lower).is_ok();
                assert_eq!(stays_positive(&punch, &left), Some(factor), "{k} {part}");
                assert!(factor || part < -1.0, "{k} {part}");
                answers[usize::from(factor)] += 1;
            }
        }
        assert_eq!(answers, [8, 19], "all but the one that yields more");
    }
}
