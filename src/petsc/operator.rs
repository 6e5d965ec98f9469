//! Products of a distributed matrix with vectors and blocks of vectors.

use super::csr::{DistCsr, Stored};
use super::exchange::Exchange;
use crate::parallel::World;
use mpi::traits::*;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Deref;
use std::rc::Rc;

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
    /// Column of each entry in the own rows followed by the ghosts; none where that is its global one.
    local: Option<Vec<u32>>,
    exchange: Exchange,
}

impl<'a> Operator<'a> {
    /// Collective: a matrix made ready for products with vectors.
    pub fn new(world: &World, matrix: Held<'a>) -> Self {
        let exchange = Exchange::new(world, &matrix.ranges, matrix.cols.iter().map(|&c| c.into()));
        let own = matrix.rows_of(world.rank);
        let n = matrix.n_local();
        let number = |&col: &u32| {
            let col = u64::from(col);
            if own.contains(&col) {
                (col - own.start) as u32
            } else {
                // Every column outside the own rows is a ghost by construction of the exchange.
                (n + exchange.ghosts().partition_point(|&g| g < col)) as u32
            }
        };
        let local = (world.size > 1).then(|| matrix.cols.iter().map(number).collect());
        Self { matrix, local, exchange }
    }

    /// The matrix.
    pub fn matrix(&self) -> &DistCsr {
        &self.matrix
    }

    /// Columns, in the own rows followed by the ghosts, and values of local row `row`, as far as they are stored.
    fn row(&self, row: usize) -> (&[u32], &[f64]) {
        let span = self.matrix.indptr[row]..self.matrix.indptr[row + 1];
        (&self.local.as_ref().unwrap_or(&self.matrix.cols)[span.clone()], &self.matrix.values[span])
    }

    /// Collective: y = A x over local rows, `x` and `y` real or complex, of `[n_local]`.
    pub fn apply<T>(&self, world: &World, x: &[T], y: &mut [T])
    where
        T: Equivalence + Copy + Default + std::ops::AddAssign,
        f64: std::ops::Mul<T, Output = T>,
    {
        let ghosts = self.exchange.fetch(world, x);
        let n = self.matrix.n_local();
        let mirrors = self.matrix.stored != Stored::Whole;
        for i in 0..n {
            let (cols, values) = self.row(i);
            let mut sum = T::default();
            for (&c, &v) in cols.iter().zip(values) {
                let c = c as usize;
                sum += v * if c < n { x[c] } else { ghosts[c - n] };
                if mirrors && c < i {
                    y[c] += v * x[i];
                }
            }
            // What later rows add comes on top.
            y[i] = sum;
        }
    }

    /// Collective: Y = A X over local rows, both `[n_local, columns]` column by column. A pass through the matrix
    /// takes several columns.
    pub fn apply_block(&self, world: &World, x: &[f64], y: &mut [f64], columns: usize) {
        let n = self.matrix.n_local();
        let mut with_ghosts = Vec::new();
        // Pages that the system clears are not cleared again.
        let mut out = if columns < WIDTH / 4 { Vec::new() } else { vec![0.0; n * WIDTH] };
        for first in (0..columns).step_by(WIDTH) {
            let width = WIDTH.min(columns - first);
            if width < WIDTH / 4 {
                for j in first..columns {
                    self.apply(world, &x[j * n..(j + 1) * n], &mut y[j * n..(j + 1) * n]);
                }
                break;
            }
            let (x, y) = (&x[first * n..(first + width) * n], &mut y[first * n..(first + width) * n]);
            // The result has the room for it where there are neither ghosts nor zeros to fill up with.
            if world.size == 1 && width == WIDTH {
                by_rows(x, y);
                Arch::new().dispatch(Rows { operator: self, x: y, out: &mut out });
            } else {
                with_ghosts.clear();
                with_ghosts.resize(n * WIDTH, 0.0);
                by_rows(x, &mut with_ghosts);
                let ghosts = self.exchange.fetch_wide(world, &with_ghosts, WIDTH);
                with_ghosts.extend(ghosts);
                Arch::new().dispatch(Rows { operator: self, x: &with_ghosts, out: &mut out });
            }
            for (part, rows) in out.chunks(TILE * WIDTH).enumerate() {
                for (j, column) in y.chunks_exact_mut(n).enumerate() {
                    let column = &mut column[part * TILE..];
                    column.iter_mut().zip(rows.chunks_exact(WIDTH)).for_each(|(v, row)| *v = row[j]);
                }
            }
        }
    }
}

/// Puts up to `WIDTH` columns of `x` behind one another in each row of `rows`, `[n][WIDTH]`.
fn by_rows(x: &[f64], rows: &mut [f64]) {
    let n = rows.len() / WIDTH;
    for (part, rows) in rows.chunks_mut(TILE * WIDTH).enumerate() {
        for (j, column) in x.chunks_exact(n).enumerate() {
            let column = &column[part * TILE..];
            column.iter().zip(rows.chunks_exact_mut(WIDTH)).for_each(|(v, row)| row[j] = *v);
        }
    }
}

/// Rows that are put side by side at a time: they stay in the first-level cache.
const TILE: usize = 128;

/// Columns of a block that one pass through the matrix takes with it.
const WIDTH: usize = 8;

/// One pass of [`Operator::apply_block`].
struct Rows<'a> {
    operator: &'a Operator<'a>,
    /// `WIDTH` columns of the own rows and the ghosts, row by row.
    x: &'a [f64],
    /// `WIDTH` columns of the own rows, row by row; overwritten.
    out: &'a mut [f64],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let matrix = self.operator.matrix();
        let mirrors = matrix.stored != Stored::Whole;
        for i in 0..matrix.n_local() {
            let (cols, values) = self.operator.row(i);
            let mut sums = [0.0; WIDTH];
            let mut own = [0.0; WIDTH];
            own.copy_from_slice(&self.x[i * WIDTH..][..WIDTH]);
            for (&c, &v) in cols.iter().zip(values) {
                let c = c as usize;
                let row = &self.x[c * WIDTH..][..WIDTH];
                for k in 0..WIDTH {
                    sums[k] = f64::mul_add(v, row[k], sums[k]);
                }
                if mirrors && c < i {
                    let across = &mut self.out[c * WIDTH..][..WIDTH];
                    for k in 0..WIDTH {
                        across[k] = f64::mul_add(v, own[k], across[k]);
                    }
                }
            }
            self.out[i * WIDTH..][..WIDTH].copy_from_slice(&sums);
        }
    }
}
