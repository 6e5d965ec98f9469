//! Influence of the nodes of a uniform grid on each other where it depends on their offset alone, as that of a
//! half-space does, and beside it a motion of all nodes that is constant or goes with x and y, as the rest of a body
//! adds it. Such a matrix needs the memory of its first rows, and its products are convolutions: fast Fourier
//! transforms on a grid of twice the size (as in J. J. Kalker's CONTACT; E. A. H. Vollebregt, J. Tribol. 136 (2014)).

use std::fmt;
use std::sync::{Arc, OnceLock};

use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, MatRef};

mod product;

use super::half_space::{is_uniform, HalfSpace};
use crate::{Error, Result};
use product::KernelSpectrum;
pub use product::Product;

/// Forces and moments that a motion of the whole answers: (1, x, y) times (x, y, n).
const LOADS: usize = 9;
/// Difference that rounding may leave between a matrix and the convolution that stands for it, as a part of the
/// matrix's largest entry.
const ALIKE: f64 = 2e-14;

type Block = [[f64; 3]; 3];

/// An influence matrix on a uniform grid of nx × ny nodes, m/N, `[3n, 3n]`, rows and columns `3*i + (x, y, n)`, i =
/// ix + nx·iy: k(x_i − x_j) + π_i A π_jᵀ with π = (1, x, y). Nothing of the order n² is ever made.
#[derive(Clone)]
pub struct Convolution {
    x: Vec<f64>,
    y: Vec<f64>,
    /// k at all offsets, `[(2nx − 1)(2ny − 1)]`: that of (dx, dy) at dx + nx − 1 + (2nx − 1)(dy + ny − 1).
    kernel: Vec<Block>,
    /// A, `[9, 9]`, index 3·(of 1, x, y) + (x, y, n); none where there is nothing beside k.
    whole: Option<[[f64; LOADS]; LOADS]>,
    double: OnceLock<Arc<KernelSpectrum<f64>>>,
    single: OnceLock<Arc<KernelSpectrum<f32>>>,
    inverse: OnceLock<Arc<KernelSpectrum<f32>>>,
    /// Data that [`along`](Self::along) takes from.
    lines: OnceLock<[Vec<[f64; 2]>; 2]>,
}

impl fmt::Debug for Convolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Convolution on {} x {} nodes", self.x.len(), self.y.len())
    }
}

impl Convolution {
    /// The compliance of a half-space at the nodes of the grid `x` × `y`, m, as [`HalfSpace::compliance`] has it;
    /// none where the grid is not uniform.
    pub fn of_half_space(material: &HalfSpace, x: &[f64], y: &[f64]) -> Result<Option<Self>> {
        if !(is_uniform(x) && is_uniform(y)) {
            return Ok(None);
        }
        let (nx, ny) = (x.len(), y.len());
        let table = material.offsets(x, y)?;
        let kernel = (0..(2 * nx - 1) * (2 * ny - 1)).map(|k| {
            let (ix, iy) = (k % (2 * nx - 1), k / (2 * nx - 1));
            HalfSpace::towards([ix >= nx - 1, iy >= ny - 1], &table[ix.abs_diff(nx - 1) + nx * iy.abs_diff(ny - 1)])
        });
        Ok(Some(Self::new(x, y, kernel.collect(), None)))
    }

    fn new(x: &[f64], y: &[f64], kernel: Vec<Block>, whole: Option<[[f64; LOADS]; LOADS]>) -> Self {
        Self {
            x: x.into(),
            y: y.into(),
            kernel,
            whole,
            double: OnceLock::new(),
            single: OnceLock::new(),
            inverse: OnceLock::new(),
            lines: OnceLock::new(),
        }
    }

    /// The influence matrix of an interface, C1 + E C2 E, E = diag(−1, −1, 1) at each node, of the lower and the
    /// upper body, both in lower form.
    pub fn combined(lower: &Self, upper: &Self) -> Result<Self> {
        if [&lower.x, &lower.y] != [&upper.x, &upper.y] {
            return Err(Error::Defect("convolutions on two grids cannot be combined on one interface".into()));
        }
        let sign = |i: usize, j: usize| if (i % 3 == 2) == (j % 3 == 2) { 1.0 } else { -1.0 };
        let block = |(a, b): (&Block, &Block)| -> Block {
            std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + sign(i, j) * b[i][j]))
        };
        let kernel = lower.kernel.iter().zip(&upper.kernel).map(block).collect();
        let of = |c: &Self, i: usize, j: usize| c.whole.map_or(0.0, |a| a[i][j]);
        let whole = (lower.whole.is_some() || upper.whole.is_some())
            .then(|| std::array::from_fn(|i| std::array::from_fn(|j| of(lower, i, j) + sign(i, j) * of(upper, i, j))));
        Ok(Self::new(&lower.x, &lower.y, kernel, whole))
    }

    /// The convolution that the matrix `w` on the grid `x` × `y` is, to rounding; none where it is none.
    pub fn found_in(w: MatRef<'_, f64>, x: &[f64], y: &[f64]) -> Option<Self> {
        Self::found(w, x, y, 1)
    }

    /// As [`found_in`](Self::found_in), looking at one column in `every`.
    fn found(w: MatRef<'_, f64>, x: &[f64], y: &[f64], every: usize) -> Option<Self> {
        let (nx, ny) = (x.len(), y.len());
        if nx < 3 || ny < 3 || w.shape() != (3 * nx * ny, 3 * nx * ny) || !(is_uniform(x) && is_uniform(y)) {
            return None;
        }
        let at = |i: usize, j: usize| -> Block {
            std::array::from_fn(|a| std::array::from_fn(|b| w[(3 * i + a, 3 * j + b)]))
        };
        let largest = (0..w.nrows()).map(|k| w[(k, k)].abs()).fold(0.0, f64::max);
        let whole = whole_of(at, x, y)?;
        let found = Self::new(x, y, Vec::new(), Some(whole));
        // Each offset from a pair of nodes as near to the middle as there is one: what the whole adds is the least
        // there.
        let pair = |d: isize, n: usize| {
            let low = (n as isize - 1 - d).div_euclid(2).clamp(0.max(-d), n as isize - 1 - 0.max(d));
            ((low + d) as usize, low as usize)
        };
        let kernel = (0..(2 * nx - 1) * (2 * ny - 1)).map(|k| {
            let (ix, jx) = pair((k % (2 * nx - 1)) as isize - (nx as isize - 1), nx);
            let (iy, jy) = pair((k / (2 * nx - 1)) as isize - (ny as isize - 1), ny);
            let (i, j) = (ix + nx * iy, jx + nx * jy);
            let (all, rest) = (at(i, j), found.whole_at(i, j));
            std::array::from_fn(|a| std::array::from_fn(|b| all[a][b] - rest[a][b]))
        });
        let found = Self { kernel: kernel.collect(), ..found };
        let none = whole.iter().flatten().all(|a| a.abs() * size(x, y) <= ALIKE * largest);
        let found = if none { Self { whole: None, ..found } } else { found };
        found.stands_for(w, ALIKE * largest, every).then_some(found)
    }

    /// The same without the transforms that products have left with it.
    pub fn fresh(&self) -> Self {
        Self::new(&self.x, &self.y, self.kernel.clone(), self.whole)
    }

    /// The convolution that another matrix `w` on the same grid is; some columns alone are looked at to see whether
    /// it is one.
    pub(crate) fn found_again(&self, w: MatRef<'_, f64>) -> Option<Self> {
        Self::found(w, &self.x, &self.y, 37)
    }

    /// As numbers, for [`from_numbers`](Self::from_numbers).
    pub fn numbers(&self) -> Vec<f64> {
        let whole = self.whole.iter().flatten().flatten();
        let sizes = [self.x.len() as f64, self.y.len() as f64];
        let kernel = self.kernel.iter().flat_map(|b| b.as_flattened());
        sizes.iter().chain(&self.x).chain(&self.y).chain(kernel).chain(whole).copied().collect()
    }

    /// From [`numbers`](Self::numbers); none from none.
    pub fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (&[nx, ny], rest) = numbers.split_first_chunk()?;
        let (nx, ny) = (nx as usize, ny as usize);
        let (x, rest) = rest.split_at_checked(nx)?;
        let (y, rest) = rest.split_at_checked(ny)?;
        let (kernel, whole) = rest.split_at_checked(9 * (2 * nx - 1) * (2 * ny - 1))?;
        let block = |v: &[f64]| -> Block { std::array::from_fn(|i| std::array::from_fn(|j| v[3 * i + j])) };
        let square = || std::array::from_fn(|i| std::array::from_fn(|j| whole[LOADS * i + j]));
        let whole = (whole.len() == LOADS * LOADS).then(square);
        Some(Self::new(x, y, kernel.chunks_exact(9).map(block).collect(), whole))
    }

    /// Returns whether no entry of `w` is farther than `allowed` from that of the convolution, in one column of nodes
    /// in `every`.
    fn stands_for(&self, w: MatRef<'_, f64>, allowed: f64, every: usize) -> bool {
        let n = self.x.len() * self.y.len();
        let columns = w.try_as_col_major().is_some();
        // A column or a row of nodes, whichever lies in one piece.
        (0..n).step_by(every).all(|j| {
            let of_j = self.whole_of_node(j, columns);
            (0..n).all(|i| {
                let (row, column) = if columns { (i, j) } else { (j, i) };
                let (k, p) = (self.offset(row, column), self.factors(i));
                (0..9).all(|e| {
                    let (r, c) = (e / 3, e % 3);
                    let beside: f64 = (0..3).map(|m| p[m] * of_j[m][r][c]).sum();
                    (w[(3 * row + r, 3 * column + c)] - k[r][c] - beside).abs() <= allowed
                })
            })
        })
    }

    /// Σ_n A_mn π_n of node `j` for each m, or Σ_m π_m A_mn for each n where `j` is the row.
    fn whole_of_node(&self, j: usize, column: bool) -> [Block; 3] {
        let Some(a) = &self.whole else { return [[[0.0; 3]; 3]; 3] };
        let q = self.factors(j);
        let entry = |m: usize, n: usize, r: usize, c: usize| match column {
            true => a[3 * m + r][3 * n + c],
            false => a[3 * n + r][3 * m + c],
        };
        let sum = |m: usize, r: usize, c: usize| (0..3).map(|n| q[n] * entry(m, n, r, c)).sum();
        std::array::from_fn(|m| std::array::from_fn(|r| std::array::from_fn(|c| sum(m, r, c))))
    }

    /// Number of rows, 3n.
    pub fn rows(&self) -> usize {
        3 * self.x.len() * self.y.len()
    }

    /// Nodes along x and y.
    pub fn shape(&self) -> [usize; 2] {
        [self.x.len(), self.y.len()]
    }

    /// Byte that convolutions on a grid of `nodes` nodes take, the one with its transforms, about.
    pub fn bytes(nodes: f64) -> f64 {
        // The kernel and its spectra in both precisions on a grid of twice the size, and those of two bodies.
        nodes * (3.0 * 4.0 * 72.0 + 5.0 * 72.0 * 1.5)
    }

    fn offset(&self, i: usize, j: usize) -> &Block {
        let (nx, ny) = (self.x.len(), self.y.len());
        &self.kernel[i % nx + nx - 1 - j % nx + (2 * nx - 1) * (i / nx + ny - 1 - j / nx)]
    }

    fn factors(&self, i: usize) -> [f64; 3] {
        let nx = self.x.len();
        [1.0, self.x[i % nx], self.y[i / nx]]
    }

    fn whole_at(&self, i: usize, j: usize) -> Block {
        let Some(a) = &self.whole else { return [[0.0; 3]; 3] };
        let (p, q) = (self.factors(i), self.factors(j));
        let mut out = [[0.0; 3]; 3];
        for m in 0..3 {
            for n in 0..3 {
                let pq = p[m] * q[n];
                for r in 0..3 {
                    for c in 0..3 {
                        out[r][c] += pq * a[3 * m + r][3 * n + c];
                    }
                }
            }
        }
        out
    }

    /// Displacements (x, y) of the nodes of a grid line under a force along `c` on its node `j`, but for what there
    /// is beside k, m/N, `[nx]`.
    pub fn along(&self, c: usize, j: usize) -> &[[f64; 2]] {
        let nx = self.x.len();
        let make = || {
            let line = &self.kernel[(2 * nx - 1) * (self.y.len() - 1)..][..2 * nx - 1];
            [0, 1].map(|c| line.iter().map(|b| [b[0][c], b[1][c]]).collect())
        };
        &self.lines.get_or_init(make)[c][nx - 1 - j % nx..][..nx]
    }

    /// Adds to the displacements `u` of `nodes` what there is beside k, under `forces` on the nodes beside them.
    pub fn add_whole(&self, forces: impl Iterator<Item = (usize, [f64; 3])>, nodes: &[usize], u: &mut [f64]) {
        let Some(a) = &self.whole else { return };
        let mut moments = [0.0; LOADS];
        for (j, f) in forces {
            let q = self.factors(j);
            (0..LOADS).for_each(|k| moments[k] += q[k / 3] * f[k % 3]);
        }
        let moved = a.map(|row| row.iter().zip(&moments).map(|(a, m)| a * m).sum::<f64>());
        for (&i, u) in nodes.iter().zip(u.chunks_exact_mut(3)) {
            let p = self.factors(i);
            (0..3).for_each(|r| u[r] += (0..3).map(|m| p[m] * moved[3 * m + r]).sum::<f64>());
        }
    }

    /// The influence on a grid of every second line along x and y, on which a force is spread over as much more: the
    /// mean of that of the nodes about it. None where that would leave too few lines.
    pub(crate) fn coarsened(&self) -> Option<Self> {
        let every = |x: &[f64]| -> Vec<f64> { x.iter().copied().step_by(2).collect() };
        let (x, y) = (every(&self.x), every(&self.y));
        let ([nx, ny], [cx, cy]) = (self.shape(), [x.len(), y.len()]);
        if cx < 5 || cy < 5 {
            return None;
        }
        let kernel = (0..(2 * cx - 1) * (2 * cy - 1)).map(|k| {
            let offset = [k % (2 * cx - 1) + 1, k / (2 * cx - 1) + 1].map(|d| 2 * d as isize);
            let at = [offset[0] - 2 * cx as isize + nx as isize - 1, offset[1] - 2 * cy as isize + ny as isize - 1];
            let mut block = [[0.0; 3]; 3];
            for (dx, dy) in (-1..2).flat_map(|dy| (-1..2).map(move |dx| (dx, dy))) {
                let share = [dx, dy].iter().map(|&d: &isize| if d == 0 { 0.5 } else { 0.25 }).product::<f64>();
                // The farthest offsets have none beyond them.
                let i = (at[0] + dx).clamp(0, 2 * nx as isize - 2) as usize;
                let j = (at[1] + dy).clamp(0, 2 * ny as isize - 2) as usize;
                let fine = &self.kernel[i + (2 * nx - 1) * j];
                block.as_flattened_mut().iter_mut().zip(fine.as_flattened()).for_each(|(b, f)| *b += share * f);
            }
            block
        });
        Some(Self::new(&x, &y, kernel.collect(), self.whole))
    }

    /// Displacements of node `i` (rows) under forces on node `j` (columns), m/N.
    pub fn block(&self, i: usize, j: usize) -> Block {
        let mut out = *self.offset(i, j);
        if self.whole.is_some() {
            let whole = self.whole_at(i, j);
            out.as_flattened_mut().iter_mut().zip(whole.as_flattened()).for_each(|(o, w)| *o += w);
        }
        out
    }

    /// Entry (`row`, `column`), m/N.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        let (i, j) = (row / 3, column / 3);
        let k = self.offset(i, j)[row % 3][column % 3];
        match &self.whole {
            Some(a) => {
                let (p, q) = (self.factors(i), self.factors(j));
                let of = |m: usize| (0..3).map(|n| q[n] * a[3 * m + row % 3][3 * n + column % 3]).sum::<f64>();
                k + p[0] * of(0) + p[1] * of(1) + p[2] * of(2)
            }
            None => k,
        }
    }

    /// The matrix itself, `[3n, 3n]`.
    pub fn dense(&self) -> Mat<f64> {
        if self.whole.is_some() {
            return Mat::from_fn(self.rows(), self.rows(), |i, j| self.get(i, j));
        }
        let [nx, ny] = self.shape();
        let mut all = Mat::<f64>::zeros(self.rows(), self.rows());
        for column in 0..self.rows() {
            let (j, c) = (column / 3, column % 3);
            for (iy, line) in all.col_as_slice_mut(column).chunks_exact_mut(3 * nx).enumerate() {
                let kernel = &self.kernel[nx - 1 - j % nx + (2 * nx - 1) * (iy + ny - 1 - j / nx)..][..nx];
                for (out, k) in line.chunks_exact_mut(3).zip(kernel) {
                    (0..3).for_each(|r| out[r] = k[r][c]);
                }
            }
        }
        all
    }

    /// Products in double precision, good to rounding.
    pub fn exact(&self) -> Product<'_, f64> {
        Product::new(self, self.double.get_or_init(|| Arc::new(KernelSpectrum::new(self))), self.whole.as_ref())
    }

    /// Products in single precision with k alone; [`add_whole`](Self::add_whole) has the rest.
    pub fn fast(&self) -> Product<'_, f32> {
        Product::new(self, self.single(), None)
    }

    /// Approximate inverse of the part of the kernel that is normal to the surface, for products of the component 2
    /// alone: by the inverse of its spectrum (E. A. H. Vollebregt, J. Tribol. 136 (2014)). Displacements of some
    /// nodes, 0 elsewhere, give about the forces on them.
    pub(crate) fn inverse_normal(&self) -> Product<'_, f32> {
        let make = || Arc::new(self.single().inverse_normal());
        Product::new(self, self.inverse.get_or_init(make), None)
    }

    fn single(&self) -> &KernelSpectrum<f32> {
        self.single.get_or_init(|| Arc::new(KernelSpectrum::new(self)))
    }
}

/// Largest product of π of two nodes.
fn size(x: &[f64], y: &[f64]) -> f64 {
    [x, y].into_iter().flatten().fold(1.0, |m: f64, v| m.max(v * v))
}

/// Part A of a matrix on the grid, from its entries `at`: pairs of nodes at the same offset differ by A alone. What of
/// A depends on the offset alone belongs to k as well, and is left there.
fn whole_of(at: impl Fn(usize, usize) -> Block, x: &[f64], y: &[f64]) -> Option<[[f64; LOADS]; LOADS]> {
    let (nx, ny) = (x.len(), y.len());
    let unit = [x, y].into_iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    let terms = |i: [usize; 2], j: [usize; 2]| -> [f64; 6] {
        let ([a, b], [c, d]) = ([x[i[0]] / unit, y[i[1]] / unit], [x[j[0]] / unit, y[j[1]] / unit]);
        [a + c, b + d, a * c, b * d, a * d, b * c]
    };
    let node = |i: [usize; 2]| i[0] + nx * i[1];
    let (fx, fy) = (nx / 2, ny / 2);
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for offset in [[fx, fy], [fx, 0], [0, fy]] {
        let room = [nx - 1 - offset[0], ny - 1 - offset[1]];
        let shifted = |j: [usize; 2]| [j[0] + offset[0], j[1] + offset[1]];
        let (first, base) = (terms(shifted([0, 0]), [0, 0]), at(node(shifted([0, 0])), 0));
        for place in [[2, 0], [0, 2], [2, 2], [1, 0], [0, 1], [1, 1]] {
            let j = [0, 1].map(|c| room[c] * place[c] / 2);
            let (these, there) = (terms(shifted(j), j), at(node(shifted(j)), node(j)));
            rows.push(these.iter().zip(first).map(|(t, f)| t - f).collect::<Vec<f64>>());
            values.push(there.as_flattened().iter().zip(base.as_flattened()).map(|(t, b)| t - b).collect::<Vec<f64>>());
        }
    }
    let matrix = Mat::from_fn(rows.len(), 6, |i, j| rows[i][j]);
    let given = Mat::from_fn(rows.len(), 9, |i, j| values[i][j]);
    let found = matrix.col_piv_qr().solve_lstsq(&given);
    let mut a = [[0.0; LOADS]; LOADS];
    for k in 0..9 {
        let (r, c) = (k / 3, k % 3);
        let [sx, sy, xx, yy, xy, yx]: [f64; 6] = std::array::from_fn(|t| found[(t, k)]);
        for (m, n, v, degree) in [
            (1, 0, sx, 1),
            (0, 1, sx, 1),
            (2, 0, sy, 1),
            (0, 2, sy, 1),
            (1, 1, xx, 2),
            (2, 2, yy, 2),
            (1, 2, xy, 2),
            (2, 1, yx, 2),
        ] {
            a[3 * m + r][3 * n + c] = v / unit.powi(degree);
        }
    }
    a.iter().flatten().all(|v| v.is_finite()).then_some(a)
}

#[cfg(test)]
mod tests;
