//! A = L D Lᵀ of a sparse symmetric matrix within its envelope, by blocks of rows, without pivoting.
//!
//! Without pivoting it is stable where A is positive definite. Of other matrices it is asked for the inertia alone (Sylvester's law), and a pivot
//! that is lost in rounding is an error.

use crate::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_unit_lower_triangular_in_place as solve_lower, solve_unit_upper_triangular_in_place as solve_upper,
};
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Rows of a block.
const BLOCK: usize = 48;
/// A pivot of this part of its diagonal entry is lost in rounding.
const LOST: f64 = 1e-13;

/// A factorised matrix.
pub struct Factor {
    n: usize,
    /// First block column of each block row.
    first: Vec<usize>,
    /// Block rows of L from the first block column up to the diagonal block, `[BLOCK, BLOCK * (i + 1 - first)]`.
    rows: Vec<Mat<f64>>,
    /// D, `[n]` with ones up to whole blocks.
    pivots: Vec<f64>,
}

impl Factor {
    /// Factorises the symmetric matrix of order `n` whose lower triangle `entries` calls its argument with, (row, column, value), each once.
    pub fn new(n: usize, entries: impl Fn(&mut dyn FnMut(usize, usize, f64))) -> Result<Self> {
        let blocks = n.div_ceil(BLOCK);
        let mut first: Vec<usize> = (0..blocks).collect();
        entries(&mut |i, j, _| first[i / BLOCK] = first[i / BLOCK].min(j / BLOCK));
        let mut rows: Vec<Mat<f64>> = (0..blocks).map(|i| Mat::zeros(BLOCK, BLOCK * (i + 1 - first[i]))).collect();
        entries(&mut |i, j, v| rows[i / BLOCK][(i % BLOCK, j - BLOCK * first[i / BLOCK])] += v);
        let mut pivots = vec![1.0; blocks * BLOCK];
        for i in n..blocks * BLOCK {
            let at = i - BLOCK * first[i / BLOCK];
            rows[i / BLOCK][(i % BLOCK, at)] = 1.0;
        }
        for i in 0..blocks {
            let (above, from_here) = rows.split_at_mut(i);
            eliminate(&mut from_here[0], i, &first, above, &mut pivots)?;
        }
        Ok(Self { n, first, rows, pivots })
    }

    /// Number of negative eigenvalues.
    pub fn negative(&self) -> usize {
        self.pivots[..self.n].iter().filter(|d| **d < 0.0).count()
    }

    /// An error unless the matrix is positive definite.
    pub fn positive(self, name: &str) -> Result<Self> {
        match self.negative() {
            0 => Ok(self),
            n => Err(Error::NotConverged(format!(
                "{name}: found {n} negative pivots, expected a positive definite matrix; is a support missing?"
            ))),
        }
    }

    /// A⁻¹ b of columns, `[n, k]`.
    pub fn solve(&self, b: MatRef<'_, f64>) -> Mat<f64> {
        let columns = b.ncols();
        let mut x = Mat::zeros(self.rows.len() * BLOCK, columns);
        x.as_mut().subrows_mut(0, self.n).copy_from(b);
        for (i, row) in self.rows.iter().enumerate() {
            let (before, mut here) = x.as_mut().subrows_mut(0, (i + 1) * BLOCK).split_at_row_mut(i * BLOCK);
            let left = i - self.first[i];
            let known = before.as_ref().subrows(self.first[i] * BLOCK, left * BLOCK);
            matmul(here.as_mut(), Accum::Add, row.as_ref().subcols(0, left * BLOCK), known, -1.0, Par::Seq);
            solve_lower(diagonal(row, left), here, Par::Seq);
        }
        for column in x.col_iter_mut() {
            column.iter_mut().zip(&self.pivots).for_each(|(x, d)| *x /= d);
        }
        for (i, row) in self.rows.iter().enumerate().rev() {
            let (before, mut here) = x.as_mut().subrows_mut(0, (i + 1) * BLOCK).split_at_row_mut(i * BLOCK);
            let left = i - self.first[i];
            solve_upper(diagonal(row, left).transpose(), here.as_mut(), Par::Seq);
            let rest = before.subrows_mut(self.first[i] * BLOCK, left * BLOCK);
            matmul(rest, Accum::Add, row.as_ref().subcols(0, left * BLOCK).transpose(), here.as_ref(), -1.0, Par::Seq);
        }
        x.as_ref().subrows(0, self.n).to_owned()
    }
}

/// The diagonal block of a block row that has `left` blocks before it.
fn diagonal(row: &Mat<f64>, left: usize) -> MatRef<'_, f64> {
    row.as_ref().subcols(left * BLOCK, BLOCK)
}

/// Turns block row `i` of A into that of L, with the block rows `above` it and their pivots.
fn eliminate(row: &mut Mat<f64>, i: usize, first: &[usize], above: &[Mat<f64>], pivots: &mut [f64]) -> Result<()> {
    let own = diagonal(row, i - first[i]);
    let scale: Vec<f64> = (0..BLOCK).map(|k| own[(k, k)].abs()).collect();
    // L D, column block by column block.
    for j in first[i]..i {
        let start = first[i].max(first[j]);
        let width = (j - start) * BLOCK;
        let (done, rest) = row.as_mut().split_at_col_mut((j - first[i]) * BLOCK);
        let mut here = rest.subcols_mut(0, BLOCK);
        let known = done.as_ref().subcols((start - first[i]) * BLOCK, width);
        let other = above[j].as_ref().subcols((start - first[j]) * BLOCK, width);
        matmul(here.as_mut(), Accum::Add, known, other.transpose(), -1.0, Par::Seq);
        solve_lower(diagonal(&above[j], j - first[j]), here.transpose_mut(), Par::Seq);
    }
    let width = (i - first[i]) * BLOCK;
    let (mut left, mut here) = row.as_mut().split_at_col_mut(width);
    let scaled = left.to_owned();
    for (k, column) in left.as_mut().col_iter_mut().enumerate() {
        let d = pivots[first[i] * BLOCK + k];
        column.iter_mut().for_each(|v| *v /= d);
    }
    matmul(here.as_mut(), Accum::Add, scaled.as_ref(), left.as_ref().transpose(), -1.0, Par::Seq);
    unblocked(here, &mut pivots[i * BLOCK..(i + 1) * BLOCK], &scale)
        .map_err(|k| Error::NotConverged(format!("row {} of a matrix of a section has no pivot", i * BLOCK + k)))
}

/// L D Lᵀ of one block, its upper triangle zero afterwards and the diagonal 1; an error with the row of a pivot that is lost.
fn unblocked(mut a: MatMut<'_, f64>, pivots: &mut [f64], scale: &[f64]) -> std::result::Result<(), usize> {
    for k in 0..BLOCK {
        let d = a[(k, k)];
        if !(d.abs() > LOST * scale[k]) {
            return Err(k);
        }
        pivots[k] = d;
        let column: Vec<f64> = (k + 1..BLOCK).map(|i| a[(i, k)]).collect();
        for (j, &v) in column.iter().enumerate() {
            let factor = v / d;
            let target = a.rb_mut_column(k + 1 + j);
            target[k + 1 + j..].iter_mut().zip(&column[j..]).for_each(|(t, c)| *t -= factor * c);
        }
        let own = a.rb_mut_column(k);
        own[..k].iter_mut().for_each(|v| *v = 0.0);
        own[k] = 1.0;
        own[k + 1..].iter_mut().for_each(|v| *v /= d);
    }
    Ok(())
}

/// A column of a block as a slice.
trait Column {
    fn rb_mut_column(&mut self, k: usize) -> &mut [f64];
}

impl Column for MatMut<'_, f64> {
    fn rb_mut_column(&mut self, k: usize) -> &mut [f64] {
        // Blocks are parts of matrices stored by columns.
        match self.as_mut().col_mut(k).try_as_col_major_mut() {
            Some(column) => column.as_slice_mut(),
            None => &mut [],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix whose rows reach back unevenly: positive definite for `shift` = 0, then with as many negative eigenvalues as the dense one has.
    fn entries(n: usize, shift: f64) -> Vec<(usize, usize, f64)> {
        let mut all = Vec::new();
        for i in 0..n {
            let reach = if i % 50 < 10 { 90 } else { 7 };
            for j in i.saturating_sub(reach)..i {
                if (i * 7 + j * 3) % 4 == 0 {
                    all.push((i, j, ((i * 31 + j * 17) % 13) as f64 / 13.0 - 0.5));
                }
            }
            all.push((i, i, 20.0 + (i % 9) as f64 - shift));
        }
        all
    }

    #[test]
    fn solutions_and_inertia_are_those_of_the_dense_matrix() {
        let n = 211;
        for shift in [0.0, 21.3, 24.9] {
            let list = entries(n, shift);
            let factor = Factor::new(n, |f| list.iter().for_each(|&(i, j, v)| f(i, j, v))).unwrap();
            let mut dense = Mat::<f64>::zeros(n, n);
            for &(i, j, v) in &list {
                dense[(i, j)] = v;
                dense[(j, i)] = v;
            }
            let values = dense.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
            assert_eq!(factor.negative(), values.iter().filter(|v| **v < 0.0).count(), "{shift}");
            let x = Mat::from_fn(n, 3, |i, k| ((i * (k + 2)) % 11) as f64 - 5.0);
            let found = factor.solve((&dense * &x).as_ref());
            assert!((&found - &x).norm_max() < 1e-9, "{shift} {:e}", (&found - &x).norm_max());
            assert_eq!(factor.positive("A").is_ok(), shift == 0.0);
        }
    }

    #[test]
    fn a_singular_matrix_is_an_error() {
        let laplace = |f: &mut dyn FnMut(usize, usize, f64)| {
            for i in 0..60 {
                f(i, i, if i == 0 || i == 59 { 1.0 } else { 2.0 });
                if i > 0 {
                    f(i, i - 1, -1.0);
                }
            }
        };
        assert_eq!(Factor::new(60, laplace).err().map(|e| e.exit_code()), Some(4));
    }
}
