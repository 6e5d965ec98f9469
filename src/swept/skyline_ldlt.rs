//! A = L S Lᵀ of a sparse symmetric matrix within its envelope, by blocks of rows, without pivoting; S has the signs
//! of the pivots, 1 or −1.
//!
//! Without pivoting it is stable where A is positive definite. Of other matrices it is asked for the inertia alone
//! (Sylvester's law), and a pivot that is lost in rounding is an error.

use crate::dense::add_columns;
use crate::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place as solve_lower, solve_upper_triangular_in_place as solve_upper,
};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use std::rc::Rc;

/// Rows of a block: a multiple of 3, so that the three amplitudes of a node are in one, and few, as rows of sections
/// reach back by some hundred and fifty.
pub(super) const BLOCK: usize = 24;
/// A pivot of this part of its diagonal entry is lost in rounding.
const LOST: f64 = 1e-13;

/// Envelope of a symmetric matrix: the blocks of its lower triangle, row by row, from the first one of each row that is
/// not empty. All matrices of a section have one envelope.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    n: usize,
    /// First block column of each block row.
    first: Vec<usize>,
    /// Start of each block row among the values, and their number. A block row is stored by columns.
    start: Vec<usize>,
}

impl Envelope {
    /// Envelope of a matrix of order `n` with `entries` (row, column ≤ row).
    pub fn new(n: usize, entries: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut first: Vec<usize> = (0..n.div_ceil(BLOCK)).collect();
        entries.for_each(|(i, j)| first[i / BLOCK] = first[i / BLOCK].min(j / BLOCK));
        let mut start = vec![0];
        for (i, f) in first.iter().enumerate() {
            start.push(start[i] + BLOCK * BLOCK * (i + 1 - f));
        }
        Self { n, first, start }
    }

    fn rows(&self) -> usize {
        self.first.len()
    }

    /// Blocks of a block row before that on the diagonal.
    fn left(&self, row: usize) -> usize {
        row - self.first[row]
    }

    /// Place of an entry among the values. In a block the next row is beside it and the next column `BLOCK` farther.
    #[inline]
    pub fn place(&self, row: usize, column: usize) -> usize {
        let i = row / BLOCK;
        self.start[i] + BLOCK * (column - BLOCK * self.first[i]) + row % BLOCK
    }

    /// Values of a matrix without entries, in the `memory` of another one.
    pub fn empty(&self, mut memory: Vec<f64>) -> Vec<f64> {
        memory.clear();
        memory.resize(self.start[self.rows()], 0.0);
        // Up to whole blocks it is 1.
        (self.n..self.rows() * BLOCK).for_each(|k| memory[self.place(k, k)] = 1.0);
        memory
    }

    /// Block row of values, `[BLOCK, BLOCK (left + 1)]`.
    fn row<'v>(&self, values: &'v [f64], row: usize) -> MatRef<'v, f64> {
        let width = BLOCK * (self.left(row) + 1);
        MatRef::from_column_major_slice(&values[self.start[row]..self.start[row + 1]], BLOCK, width)
    }

    /// Its block on the diagonal.
    fn diagonal<'v>(&self, values: &'v [f64], row: usize) -> MatRef<'v, f64> {
        self.row(values, row).subcols(BLOCK * self.left(row), BLOCK)
    }
}

/// A factorised matrix.
pub struct SkylineFactor {
    envelope: Rc<Envelope>,
    /// L.
    values: Vec<f64>,
    /// S, `[n]` with ones up to whole blocks.
    signs: Vec<f64>,
}

impl SkylineFactor {
    /// Factorises the symmetric matrix with these `values` of its lower triangle; their memory becomes that of the
    /// factor.
    pub fn new(envelope: &Rc<Envelope>, values: Vec<f64>) -> Result<Self> {
        Self::from_block(envelope, values, vec![1.0; envelope.rows() * BLOCK], 0)
    }

    /// Factorises the matrix with these `values` that has the envelope of the factor `other`, and its rows before
    /// `row`.
    pub fn like(other: &Self, mut values: Vec<f64>, row: usize) -> Result<Self> {
        let begin = row / BLOCK;
        let end = other.envelope.start[begin];
        values[..end].copy_from_slice(&other.values[..end]);
        Self::from_block(&other.envelope, values, other.signs.clone(), begin)
    }

    /// Factorises the block rows from `begin` on; those before it are of the factor already, with their `signs`.
    fn from_block(envelope: &Rc<Envelope>, mut values: Vec<f64>, mut signs: Vec<f64>, begin: usize) -> Result<Self> {
        for i in begin..envelope.rows() {
            let (above, from_here) = values.split_at_mut(envelope.start[i]);
            eliminate((envelope, i), above, &mut from_here[..envelope.start[i + 1] - envelope.start[i]], &mut signs)?;
        }
        Ok(Self { envelope: envelope.clone(), values, signs })
    }

    /// Its memory, for another one.
    pub(crate) fn into_memory(self) -> Vec<f64> {
        self.values
    }

    /// Number of negative eigenvalues.
    pub fn negative(&self) -> usize {
        self.signs[..self.envelope.n].iter().filter(|s| **s < 0.0).count()
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
        self.solve_from(0, b)
    }

    /// The rows from `row` on of A⁻¹ b of columns that are 0 before it, `[n, k]`; the rows before are not made, and 0
    /// or what there is of the block of `row`.
    pub(crate) fn solve_from(&self, row: usize, b: MatRef<'_, f64>) -> Mat<f64> {
        let (e, values) = (&*self.envelope, &self.values);
        let begin = row / BLOCK;
        let mut x = Mat::zeros(e.rows() * BLOCK, b.ncols());
        x.as_mut().subrows_mut(0, e.n).copy_from(b);
        // The blocks of a block row from the first one that counts on, and where that is.
        let known = |i: usize| {
            let from = begin.max(e.first[i]);
            (from, e.row(values, i).subcols(BLOCK * (from - e.first[i]), BLOCK * (i - from)))
        };
        for i in begin..e.rows() {
            let (before, mut here) = x.as_mut().subrows_mut(0, (i + 1) * BLOCK).split_at_row_mut(i * BLOCK);
            let (from, left) = known(i);
            matmul(
                here.as_mut(),
                Accum::Add,
                left,
                before.as_ref().subrows(from * BLOCK, left.ncols()),
                -1.0,
                Par::Seq,
            );
            solve_lower(e.diagonal(values, i), here, Par::Seq);
        }
        for column in x.col_iter_mut() {
            column.iter_mut().zip(&self.signs).for_each(|(x, s)| *x *= s);
        }
        for i in (begin..e.rows()).rev() {
            let (before, mut here) = x.as_mut().subrows_mut(0, (i + 1) * BLOCK).split_at_row_mut(i * BLOCK);
            let (from, left) = known(i);
            solve_upper(e.diagonal(values, i).transpose(), here.as_mut(), Par::Seq);
            let rest = before.subrows_mut(from * BLOCK, left.ncols());
            matmul(rest, Accum::Add, left.transpose(), here.as_ref(), -1.0, Par::Seq);
        }
        x.as_ref().subrows(0, e.n).to_owned()
    }
}

/// A slice of columns of a block row.
fn columns(of: &[f64]) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(of, BLOCK, of.len() / BLOCK)
}

/// Turns block row `i` of A, `row`, into that of L, with the block rows `above` it and their signs.
fn eliminate((e, i): (&Envelope, usize), above: &[f64], row: &mut [f64], signs: &mut [f64]) -> Result<()> {
    let (first, width) = (e.first[i], BLOCK * e.left(i));
    let (left, own) = row.split_at_mut(BLOCK * width);
    let scale: [f64; BLOCK] = std::array::from_fn(|k| own[k * BLOCK + k].abs());
    let (before, signs) = signs.split_at_mut(i * BLOCK);
    let before = &before[first * BLOCK..];
    // L S, where that is not L.
    let mut signed = before.iter().any(|s| *s < 0.0).then(|| vec![0.0; left.len()]);
    for j in first..i {
        let (from, at) = (first.max(e.first[j]), BLOCK * BLOCK * (j - first));
        let (done, rest) = left.split_at_mut(at);
        let mut here = MatMut::from_column_major_slice_mut(&mut rest[..BLOCK * BLOCK], BLOCK, BLOCK);
        let known = columns(&signed.as_deref().unwrap_or(done)[BLOCK * BLOCK * (from - first)..at]);
        let other = e.row(above, j).subcols(BLOCK * (from - e.first[j]), known.ncols());
        matmul(here.as_mut(), Accum::Add, known, other.transpose(), -1.0, Par::Seq);
        solve_lower(e.diagonal(above, j), here.transpose_mut(), Par::Seq);
        if let Some(signed) = &mut signed {
            let here = &mut rest[..BLOCK * BLOCK];
            signed[at..][..BLOCK * BLOCK].copy_from_slice(here);
            let signs = &before[BLOCK * (j - first)..];
            here.chunks_exact_mut(BLOCK).zip(signs).for_each(|(column, s)| column.iter_mut().for_each(|v| *v *= s));
        }
    }
    let (here, known) =
        (MatMut::from_column_major_slice_mut(own, BLOCK, BLOCK), columns(signed.as_deref().unwrap_or(left)));
    matmul(here, Accum::Add, known, columns(left).transpose(), -1.0, Par::Seq);
    unblocked(own, &mut signs[..BLOCK], &scale)
        .map_err(|k| Error::NotConverged(format!("row {} of a matrix of a section has no pivot", i * BLOCK + k)))
}

/// L S Lᵀ of one block, its upper triangle zero afterwards; an error with the row of a pivot that is lost.
fn unblocked(a: &mut [f64], signs: &mut [f64], scale: &[f64; BLOCK]) -> std::result::Result<(), usize> {
    for k in 0..BLOCK {
        let (done, rest) = a.split_at_mut(k * BLOCK);
        let (above, here) = rest[..BLOCK].split_at_mut(k);
        let known: [f64; BLOCK] = std::array::from_fn(|j| if j < k { -signs[j] * done[j * BLOCK + k] } else { 0.0 });
        add_columns(&done[k.min(done.len())..], BLOCK, &known[..k], here);
        let d = here[0];
        if !(d.abs() > LOST * scale[k]) {
            return Err(k);
        }
        let root = d.abs().sqrt();
        signs[k] = d.signum();
        let factor = d.signum() / root;
        above.fill(0.0);
        here.iter_mut().for_each(|v| *v *= factor);
        here[0] = root;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix whose rows reach back unevenly: positive definite for `shift` = 0, then with as many negative
    /// eigenvalues as the dense one has.
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

    /// The factor of a matrix given by its entries (row, column, value).
    fn factor(n: usize, list: &[(usize, usize, f64)], memory: Vec<f64>) -> Result<SkylineFactor> {
        let envelope = Rc::new(Envelope::new(n, list.iter().map(|&(i, j, _)| (i, j))));
        let mut values = envelope.empty(memory);
        list.iter().for_each(|&(i, j, v)| values[envelope.place(i, j)] += v);
        SkylineFactor::new(&envelope, values)
    }

    #[test]
    fn solutions_and_inertia_are_those_of_the_dense_matrix() {
        let n = 211;
        let mut memory = vec![7.0; 5];
        for shift in [0.0, 21.3, 24.9] {
            let list = entries(n, shift);
            let factor = factor(n, &list, memory).unwrap();
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
            // The end of a solution, where the right-hand sides begin late.
            let late = Mat::from_fn(n, 2, |i, k| if i < 150 { 0.0 } else { ((i * (k + 3)) % 7) as f64 - 3.0 });
            let (whole, end) = (factor.solve(late.as_ref()), factor.solve_from(150, late.as_ref()));
            let apart = (whole.as_ref().subrows(150, n - 150) - end.as_ref().subrows(150, n - 150)).norm_max();
            assert!(apart < 1e-12 * whole.norm_max(), "{shift} {apart:e}");
            assert_eq!(factor.negative() == 0, shift == 0.0);
            // Another matrix that differs in the last rows.
            let mut other = list.clone();
            other.iter_mut().filter(|at| at.0 >= 190).for_each(|at| at.2 *= if at.0 == at.1 { -1.3 } else { 0.7 });
            let mut values = factor.envelope.empty(Vec::new());
            other.iter().for_each(|&(i, j, v)| values[factor.envelope.place(i, j)] += v);
            let anew = SkylineFactor::new(&factor.envelope, values.clone()).unwrap();
            let like = SkylineFactor::like(&factor, values, 190).unwrap();
            assert!(like.values == anew.values && like.negative() == anew.negative());
            assert!(like.negative() != factor.negative());
            memory = factor.into_memory();
        }
        let list = entries(n, 21.3);
        assert!(factor(n, &list, Vec::new()).unwrap().positive("A").is_err());
    }

    #[test]
    fn a_singular_matrix_is_an_error() {
        let mut laplace = Vec::new();
        for i in 0..60 {
            laplace.push((i, i, if i == 0 || i == 59 { 1.0 } else { 2.0 }));
            if i > 0 {
                laplace.push((i, i - 1, -1.0));
            }
        }
        assert_eq!(factor(60, &laplace, Vec::new()).err().map(|e| e.exit_code()), Some(4));
    }
}
