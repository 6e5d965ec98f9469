//! Distributed real sparse matrix in compressed rows: what assembly makes and the solvers take.

use super::exchange::Exchange;
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;
use mpi::traits::*;
use pulp::{Arch, Simd, WithSimd};
use std::ops::{Deref, Range};
use std::rc::Rc;

/// One rank's rows of a square real matrix. Rows are distributed in contiguous ranges.
#[derive(Debug, Clone, Default)]
pub struct DistCsr {
    /// First row of each rank, `[size + 1]`; the last entry is the order of the matrix.
    pub ranges: Vec<u64>,
    /// Start of each local row in `cols`, `[n_local + 1]`.
    pub indptr: Vec<usize>,
    /// Global column of each entry, ascending in a row. Four bytes: beside the values the columns are most of a matrix, and no direct solver here
    /// numbers more than 2³¹ rows.
    pub cols: Vec<u32>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl DistCsr {
    /// Order of the matrix.
    pub fn order(&self) -> u64 {
        self.ranges.last().copied().unwrap_or(0)
    }

    /// Number of rows on this rank.
    pub fn n_local(&self) -> usize {
        self.indptr.len().saturating_sub(1)
    }

    /// Global numbers of the rows of `rank`.
    pub fn rows_of(&self, rank: usize) -> Range<u64> {
        self.ranges[rank]..self.ranges[rank + 1]
    }

    /// Columns and values of local row `row`.
    pub fn row(&self, row: usize) -> (&[u32], &[f64]) {
        let span = self.indptr[row]..self.indptr[row + 1];
        (&self.cols[span.clone()], &self.values[span])
    }

    /// Collective: checks that the parts fit together, the columns ascend and exist, and every value is finite. `name`
    /// stands for the matrix in the message.
    pub fn validate(&self, world: &World, name: &str) -> Result<()> {
        world.agree(self.validate_local(world, name))
    }

    fn validate_local(&self, world: &World, name: &str) -> Result<()> {
        let defect = |what: String| Err(Error::Defect(format!("matrix {name}: {what}")));
        if self.ranges.len() != world.size + 1 || self.ranges[0] != 0 || self.ranges.windows(2).any(|w| w[0] > w[1]) {
            return defect(format!("row ranges {:?} do not fit {} ranks", self.ranges, world.size));
        }
        let rows = self.rows_of(world.rank);
        if self.n_local() as u64 != rows.end - rows.start || self.indptr.first() != Some(&0) {
            return defect(format!("{} row starts for the rows {rows:?}", self.indptr.len()));
        }
        if self.indptr.last() != Some(&self.cols.len()) || self.cols.len() != self.values.len() {
            return defect(format!("{} columns and {} values", self.cols.len(), self.values.len()));
        }
        let order = self.order();
        for i in 0..self.n_local() {
            let (cols, values) = self.row(i);
            if cols.windows(2).any(|w| w[0] >= w[1]) || cols.last().is_some_and(|&c| u64::from(c) >= order) {
                return defect(format!("columns of row {} do not ascend within 0..{order}", rows.start + i as u64));
            }
            if let Some(k) = values.iter().position(|v| !v.is_finite()) {
                return Err(Error::Input(format!(
                    "matrix {name}: entry ({}, {}) is {}. The mesh or the material behind it gives no finite element matrix.",
                    rows.start + i as u64,
                    cols[k],
                    values[k]
                )));
            }
        }
        Ok(())
    }

    /// Local entries on and below the diagonal as (row, column, value), global, 0-based.
    pub fn lower_triangle(&self, rank: usize) -> impl Iterator<Item = (u64, u64, f64)> + '_ {
        let first = self.ranges[rank];
        (0..self.n_local()).flat_map(move |i| {
            let row = first + i as u64;
            let (cols, values) = self.row(i);
            cols.iter()
                .zip(values)
                .map(|(&c, &v)| (u64::from(c), v))
                .take_while(move |(c, _)| *c <= row)
                .map(move |(c, v)| (row, c, v))
        })
    }

    /// Local part of the diagonal, `[n_local]`; zero where no entry is stored.
    pub fn diagonal(&self, rank: usize) -> Vec<f64> {
        let first = self.ranges[rank];
        (0..self.n_local()).map(|i| self.get(i, first + i as u64)).collect()
    }

    /// Entry at local row `row`, global column `col`; zero where none is stored.
    pub fn get(&self, row: usize, col: u64) -> f64 {
        let (cols, values) = self.row(row);
        cols.binary_search_by(|&c| u64::from(c).cmp(&col)).map(|k| values[k]).unwrap_or(0.0)
    }

    /// Collective: largest absolute value.
    pub fn max_abs(&self, world: &World) -> f64 {
        world.max(self.values.iter().fold(0.0, |m, v| v.abs().max(m)))
    }

    /// Collective: largest absolute row sum, the norm induced by the maximum norm and a bound of the spectral radius.
    pub fn norm_inf(&self, world: &World) -> f64 {
        let sum = |i| self.row(i).1.iter().map(|v| v.abs()).sum::<f64>();
        world.max((0..self.n_local()).map(sum).fold(0.0, f64::max))
    }

    /// Collective: largest |a_ij − a_ji| over the largest |a_ij|; 0 for an exactly symmetric matrix.
    pub fn asymmetry(&self, world: &World) -> f64 {
        let first = self.ranges[world.rank];
        let own = self.rows_of(world.rank);
        let mut worst: f64 = 0.0;
        let mut indices = vec![Vec::new(); world.size];
        let mut entries = vec![Vec::new(); world.size];
        for i in 0..self.n_local() {
            let row = first + i as u64;
            let (cols, values) = self.row(i);
            for (&col, &value) in cols.iter().zip(values) {
                let col = u64::from(col);
                if own.contains(&col) {
                    worst = worst.max((value - self.get((col - first) as usize, row)).abs());
                } else {
                    let owner = owner_of(&self.ranges, col);
                    indices[owner].extend([col, row]);
                    entries[owner].push(value);
                }
            }
        }
        let indices = all_to_all(world, &indices);
        let entries = all_to_all(world, &entries);
        for (pair, value) in indices.chunks_exact(2).zip(entries) {
            worst = worst.max((value - self.get((pair[0] - first) as usize, pair[1])).abs());
        }
        let scale = self.max_abs(world);
        let worst = world.max(worst);
        if scale > 0.0 {
            worst / scale
        } else {
            worst
        }
    }

    /// This matrix minus `sigma` times `other`, on the union of both patterns. Both have the same ranges.
    pub fn minus_scaled(&self, sigma: f64, other: &DistCsr) -> DistCsr {
        if sigma == 0.0 {
            return self.clone();
        }
        let mut sum = DistCsr {
            ranges: self.ranges.clone(),
            indptr: Vec::with_capacity(self.indptr.len()),
            cols: Vec::with_capacity(self.cols.len()),
            values: Vec::with_capacity(self.cols.len()),
        };
        sum.indptr.push(0);
        for i in 0..self.n_local() {
            let (a, av) = self.row(i);
            let (b, bv) = other.row(i);
            let (mut p, mut q) = (0, 0);
            while p < a.len() || q < b.len() {
                let (ca, cb) = (a.get(p).copied().unwrap_or(u32::MAX), b.get(q).copied().unwrap_or(u32::MAX));
                let mut value = 0.0;
                if ca <= cb {
                    value += av[p];
                    p += 1;
                }
                if cb <= ca {
                    value -= sigma * bv[q];
                    q += 1;
                }
                sum.cols.push(ca.min(cb));
                sum.values.push(value);
            }
            sum.indptr.push(sum.cols.len());
        }
        sum
    }

    /// Uncouples the degrees of freedom `held` (global, ascending, those of all rows and columns of this rank among them): their rows and columns
    /// become 0, their diagonal is multiplied by `diagonal`.
    pub fn hold(&mut self, rank: usize, held: &[u64], diagonal: f64) {
        if held.is_empty() {
            return;
        }
        let first = self.ranges[rank];
        let is_held = |dof: u64| held.binary_search(&dof).is_ok();
        for i in 0..self.n_local() {
            let row = first + i as u64;
            let whole = is_held(row);
            for k in self.indptr[i]..self.indptr[i + 1] {
                let column = u64::from(self.cols[k]);
                if whole || is_held(column) {
                    self.values[k] *= if row == column { diagonal } else { 0.0 };
                }
            }
        }
    }

    /// Collective: the whole matrix, `[n, n]` on rank 0, `None` elsewhere.
    pub fn gather(&self, world: &World) -> Option<Mat<f64>> {
        let rows: Vec<u64> =
            (0..self.n_local()).flat_map(|i| std::iter::repeat_n(i as u64, self.row(i).0.len())).collect();
        let first = self.ranges[world.rank];
        let rows = world.gather(&rows.iter().map(|i| first + i).collect::<Vec<u64>>());
        let (cols, values) = (world.gather(&self.cols), world.gather(&self.values));
        let n = self.order() as usize;
        world.is_root().then(|| {
            let mut whole = Mat::zeros(n, n);
            for ((&i, &j), v) in rows.iter().zip(&cols).zip(&values) {
                whole[(i as usize, j as usize)] += v;
            }
            whole
        })
    }

    /// Collective: the matrix made ready for products with vectors.
    pub fn operator(&self, world: &World) -> Operator<'_> {
        Operator::new(world, Held::Borrowed(self))
    }
}

/// Rank whose range holds `row`.
pub(crate) fn owner_of(ranges: &[u64], row: u64) -> usize {
    ranges.partition_point(|&start| start <= row) - 1
}

/// Collective: `parts[r]` goes to rank `r`; returns what came from all, in rank order.
pub(crate) fn all_to_all<T: Equivalence + Clone + Default>(world: &World, parts: &[Vec<T>]) -> Vec<T> {
    use mpi::datatype::{Partition, PartitionMut};
    let counts: Vec<i32> = parts.iter().map(|p| p.len() as i32).collect();
    let mut incoming = vec![0i32; world.size];
    world.comm.all_to_all_into(&counts[..], &mut incoming[..]);
    let starts = |counts: &[i32]| {
        let mut at = 0;
        let next = |&c: &i32| {
            at += c;
            at - c
        };
        counts.iter().map(next).collect::<Vec<i32>>()
    };
    let all = parts.concat();
    let mut received = vec![T::default(); incoming.iter().map(|&c| c as usize).sum()];
    let (out_starts, in_starts) = (starts(&counts), starts(&incoming));
    world.comm.all_to_all_varcount_into(
        &Partition::new(&all[..], counts, out_starts),
        &mut PartitionMut::new(&mut received[..], incoming, in_starts),
    );
    received
}

/// A matrix that is borrowed, or shared by those who use it.
#[derive(Debug, Clone)]
pub enum Held<'a> {
    /// Borrowed.
    Borrowed(&'a DistCsr),
    /// Shared.
    Shared(Rc<DistCsr>),
}

impl Deref for Held<'_> {
    type Target = DistCsr;

    fn deref(&self) -> &DistCsr {
        match self {
            Held::Borrowed(matrix) => matrix,
            Held::Shared(matrix) => matrix,
        }
    }
}

impl<'a> From<&'a DistCsr> for Held<'a> {
    fn from(matrix: &'a DistCsr) -> Self {
        Held::Borrowed(matrix)
    }
}

impl From<Rc<DistCsr>> for Held<'_> {
    fn from(matrix: Rc<DistCsr>) -> Self {
        Held::Shared(matrix)
    }
}

/// A matrix with its exchange of ghost values, for repeated products.
pub struct Operator<'a> {
    matrix: Held<'a>,
    /// Column of each entry in the own rows followed by the ghosts.
    local: Vec<u32>,
    exchange: Exchange,
}

impl<'a> Operator<'a> {
    /// Collective: a matrix made ready for products with vectors.
    pub fn new(world: &World, matrix: Held<'a>) -> Self {
        let exchange = Exchange::new(world, &matrix.ranges, matrix.cols.iter().map(|&c| c.into()));
        let own = matrix.rows_of(world.rank);
        let n = matrix.n_local();
        let local = matrix.cols.iter().map(|&col| {
            let col = u64::from(col);
            if own.contains(&col) {
                (col - own.start) as u32
            } else {
                // Every column outside the own rows is a ghost by construction of the exchange.
                (n + exchange.ghosts().partition_point(|&g| g < col)) as u32
            }
        });
        let local = local.collect();
        Self { matrix, local, exchange }
    }

    /// The matrix.
    pub fn matrix(&self) -> &DistCsr {
        &self.matrix
    }

    /// Collective: y = A x over local rows, `x` and `y` real or complex, of `[n_local]`.
    pub fn apply<T>(&self, world: &World, x: &[T], y: &mut [T])
    where
        T: Equivalence + Copy + Default + std::ops::AddAssign,
        f64: std::ops::Mul<T, Output = T>,
    {
        let ghosts = self.exchange.fetch(world, x);
        let n = self.matrix.n_local();
        for (i, out) in y.iter_mut().enumerate() {
            let span = self.matrix.indptr[i]..self.matrix.indptr[i + 1];
            let mut sum = T::default();
            for (&c, &v) in self.local[span.clone()].iter().zip(&self.matrix.values[span]) {
                let c = c as usize;
                sum += v * if c < n { x[c] } else { ghosts[c - n] };
            }
            *out = sum;
        }
    }
}

/// Columns of a block that one pass through the matrix takes with it.
const WIDTH: usize = 8;

impl Operator<'_> {
    /// Collective: Y = A X over local rows, both `[n_local, columns]` column by column. A pass through the matrix takes several columns.
    pub fn apply_block(&self, world: &World, x: &[f64], y: &mut [f64], columns: usize) {
        let n = self.matrix.n_local();
        let mut rows = Vec::new();
        for first in (0..columns).step_by(WIDTH) {
            let width = WIDTH.min(columns - first);
            if width < WIDTH / 4 {
                for j in first..columns {
                    self.apply(world, &x[j * n..(j + 1) * n], &mut y[j * n..(j + 1) * n]);
                }
                break;
            }
            // The columns of a row behind one another, filled up by zeros.
            rows.clear();
            rows.resize(n * WIDTH, 0.0);
            for (j, column) in x[first * n..(first + width) * n].chunks_exact(n.max(1)).enumerate() {
                column.iter().zip(rows.chunks_exact_mut(WIDTH)).for_each(|(v, row)| row[j] = *v);
            }
            let ghosts = self.exchange.fetch_wide(world, &rows, WIDTH);
            rows.extend(ghosts);
            let out = &mut y[first * n..(first + width) * n];
            Arch::new().dispatch(Rows { operator: self, x: &rows, out });
        }
    }
}

/// One pass of [`Operator::apply_block`].
struct Rows<'a> {
    operator: &'a Operator<'a>,
    /// `WIDTH` columns of the own rows and the ghosts, row by row.
    x: &'a [f64],
    /// `[n_local, at most WIDTH]`, column by column.
    out: &'a mut [f64],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (matrix, local) = (&*self.operator.matrix, &self.operator.local);
        let n = matrix.n_local();
        for i in 0..n {
            let span = matrix.indptr[i]..matrix.indptr[i + 1];
            let mut sums = [0.0; WIDTH];
            for (&c, &v) in local[span.clone()].iter().zip(&matrix.values[span]) {
                let row = &self.x[c as usize * WIDTH..][..WIDTH];
                for k in 0..WIDTH {
                    sums[k] += v * row[k];
                }
            }
            self.out.chunks_exact_mut(n).zip(sums).for_each(|(column, s)| column[i] = s);
        }
    }
}

/// Collective: scalar product of two distributed vectors.
pub fn dot(world: &World, a: &[f64], b: &[f64]) -> f64 {
    world.sum(a.iter().zip(b).map(|(x, y)| x * y).sum())
}

/// Collective: Euclidean norm of a distributed vector.
pub fn norm2(world: &World, a: &[f64]) -> f64 {
    dot(world, a, a).sqrt()
}
