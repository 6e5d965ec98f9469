//! Distributed real sparse matrix in compressed rows: what assembly makes and the solvers take.

use super::operator::{Held, Operator};
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;
use mpi::traits::*;
use std::borrow::Cow;
use std::ops::Range;

/// Entries between its own rows that a rank stores.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Stored {
    /// All of them.
    #[default]
    Whole,
    /// Entries on and below the diagonal, of a symmetric matrix. An entry between rows of two ranks stands on both all
    /// the same, so that a product needs what one with all entries needs from other ranks.
    Lower {
        /// This rank's first row, global.
        first: u64,
    },
}

/// One rank's rows of a square real matrix. Rows are distributed in contiguous ranges. Of a symmetric matrix half of
/// the entries are enough ([`Stored::Lower`]): they are most of the memory beside a factor, and of the time of a
/// product.
#[derive(Debug, Clone, Default)]
pub struct DistCsr {
    /// First row of each rank, `[size + 1]`; the last entry is the order of the matrix.
    pub ranges: Vec<u64>,
    /// Start of each local row in `cols`, `[n_local + 1]`.
    pub indptr: Vec<usize>,
    /// Global column of each entry, ascending in a row. Four bytes: beside the values the columns are most of a
    /// matrix, and no direct solver here numbers more than 2³¹ rows.
    pub cols: Vec<u32>,
    /// Value of each entry.
    pub values: Vec<f64>,
    /// Which entries there are.
    pub stored: Stored,
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

    /// Own columns left of the diagonal of local row `row`, whose entries stand for two; none where all are stored.
    fn mirrored(&self, row: usize) -> Range<u64> {
        match self.stored {
            Stored::Whole => 0..0,
            Stored::Lower { first } => first..first + row as u64,
        }
    }

    /// Columns and values of local row `row`, as far as they are stored.
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
            let above = rows.start + i as u64 + 1..rows.end;
            if self.stored != Stored::Whole && cols.iter().any(|&c| above.contains(&c.into())) {
                return defect(format!("row {} has own columns above the diagonal", rows.start + i as u64));
            }
            if let Some(k) = values.iter().position(|v| !v.is_finite()) {
                return Err(Error::Input(format!(
                    "matrix {name}: entry ({}, {}) is {}. The mesh or the material behind it gives no finite \
                     element matrix.",
                    rows.start + i as u64,
                    cols[k],
                    values[k]
                )));
            }
        }
        Ok(())
    }

    /// Local entries on and below the diagonal as (row, column, value), global, 0-based.
    pub(crate) fn lower_triangle(&self, rank: usize) -> impl Iterator<Item = (u64, u64, f64)> + '_ {
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

    /// Entry at local row `row`, global column `col`; zero where there is none.
    pub fn get(&self, row: usize, col: u64) -> f64 {
        let (row, col) = match self.stored {
            Stored::Lower { first } if (first + row as u64 + 1..first + self.n_local() as u64).contains(&col) => {
                ((col - first) as usize, first + row as u64)
            }
            _ => (row, col),
        };
        let (cols, values) = self.row(row);
        cols.binary_search_by(|&c| u64::from(c).cmp(&col)).map(|k| values[k]).unwrap_or(0.0)
    }

    /// Collective: largest absolute value.
    pub fn max_abs(&self, world: &World) -> f64 {
        world.max(self.values.iter().fold(0.0, |m, v| v.abs().max(m)))
    }

    /// Collective: largest absolute row sum, the norm induced by the maximum norm and a bound of the spectral radius.
    pub fn norm_inf(&self, world: &World) -> f64 {
        let mut sums = vec![0.0; self.n_local()];
        for i in 0..self.n_local() {
            let mirrored = self.mirrored(i);
            let (cols, values) = self.row(i);
            for (&c, v) in cols.iter().zip(values) {
                sums[i] += v.abs();
                if mirrored.contains(&c.into()) {
                    sums[(u64::from(c) - mirrored.start) as usize] += v.abs();
                }
            }
        }
        world.max(sums.into_iter().fold(0.0, f64::max))
    }

    /// Collective: largest |a_ij − a_ji| over the largest |a_ij|; 0 for an exactly symmetric matrix. Where half of
    /// the entries are stored this sees only those between rows of two ranks.
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

    /// The same matrix with all entries.
    pub fn full(&self) -> Cow<'_, DistCsr> {
        if self.stored == Stored::Whole {
            return Cow::Borrowed(self);
        }
        let indptr = self.whole_starts();
        let entries = indptr.last().copied().unwrap_or(0);
        let (mut cols, mut values) = (vec![0; entries], vec![0.0; entries]);
        self.spread(&indptr, |to, col, from| (cols[to], values[to]) = (col, self.values[from]));
        Cow::Owned(DistCsr { ranges: self.ranges.clone(), indptr, cols, values, stored: Stored::Whole })
    }

    /// Starts and columns of the rows with all entries.
    pub(super) fn whole_pattern(&self) -> (Cow<'_, [usize]>, Cow<'_, [u32]>) {
        if self.stored == Stored::Whole {
            return (Cow::Borrowed(&self.indptr), Cow::Borrowed(&self.cols));
        }
        let indptr = self.whole_starts();
        let mut cols = vec![0; indptr.last().copied().unwrap_or(0)];
        self.spread(&indptr, |to, col, _| cols[to] = col);
        (Cow::Owned(indptr), Cow::Owned(cols))
    }

    /// Starts of the rows with all entries, `[n_local + 1]`.
    fn whole_starts(&self) -> Vec<usize> {
        let mut starts = vec![0; self.n_local() + 1];
        for i in 0..self.n_local() {
            let mirrored = self.mirrored(i);
            let cols = self.row(i).0;
            starts[i + 1] += cols.len();
            for &c in cols.iter().filter(|&&c| mirrored.contains(&c.into())) {
                starts[(u64::from(c) - mirrored.start) as usize + 1] += 1;
            }
        }
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        starts
    }

    /// Tells of every entry of the rows with all entries, which begin at `starts`, its place, its column, and where
    /// its value is stored.
    fn spread(&self, starts: &[usize], mut put: impl FnMut(usize, u32, usize)) {
        let mut next = starts[..self.n_local()].to_vec();
        let last = self.ranges.last().copied().unwrap_or(0);
        for i in 0..self.n_local() {
            let mirrored = self.mirrored(i);
            // Left of the diagonal and on it; what is mirrored follows from later rows, and columns of later ranks
            // end the row.
            let split = match self.stored {
                Stored::Whole => last,
                Stored::Lower { .. } => mirrored.end + 1,
            };
            let cols = self.row(i).0;
            let tail = starts[i + 1] - cols.len();
            for (k, &c) in cols.iter().enumerate() {
                let from = self.indptr[i] + k;
                match u64::from(c) < split {
                    true => {
                        put(next[i], c, from);
                        next[i] += 1;
                    }
                    false => put(tail + k, c, from),
                }
                if mirrored.contains(&c.into()) {
                    let row = (u64::from(c) - mirrored.start) as usize;
                    put(next[row], mirrored.end as u32, from);
                    next[row] += 1;
                }
            }
        }
    }

    /// This matrix minus `sigma` times `other`, on the union of both patterns, stored as this one is; `other` must be
    /// symmetric too where half of the entries are stored. Both have the same ranges.
    pub fn minus_scaled(&self, sigma: f64, other: &DistCsr) -> DistCsr {
        if sigma == 0.0 {
            return self.clone();
        }
        let other = match self.stored {
            Stored::Whole => other.full(),
            Stored::Lower { .. } => Cow::Borrowed(other),
        };
        let own = self.mirrored(self.n_local());
        let mut sum = DistCsr {
            stored: self.stored,
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
                if cb < ca && own.contains(&cb.into()) && u64::from(cb) > own.start + i as u64 {
                    q += 1;
                    continue;
                }
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

    /// Uncouples the degrees of freedom `held` (global, ascending, those of all rows and columns of this rank among
    /// them): their rows and columns become 0, their diagonal is multiplied by `diagonal`.
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
        self.full().gather_stored(world)
    }

    fn gather_stored(&self, world: &World) -> Option<Mat<f64>> {
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

/// Collective: scalar product of two distributed vectors.
pub fn dot(world: &World, a: &[f64], b: &[f64]) -> f64 {
    world.sum(a.iter().zip(b).map(|(x, y)| x * y).sum())
}

/// Collective: Euclidean norm of a distributed vector.
pub fn norm2(world: &World, a: &[f64]) -> f64 {
    dot(world, a, a).sqrt()
}
