//! Real columns against blocks of complex vectors. The loads and the responses of a body have many columns; every
//! pass through them takes a whole block.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use num_complex::Complex;
use std::ops::Range;

type C = Complex<f64>;

/// Rows taken at a time: their part of some hundred columns stays in the second-level cache.
const STRETCH: usize = 512;

/// Some rows of complex vectors as real columns: the real parts of all, then the imaginary parts.
pub(super) struct Reals {
    rows: usize,
    vectors: usize,
    /// `[rows, 2 vectors]` column by column.
    pub values: Vec<f64>,
}

impl Reals {
    /// The rows `span` of vectors of `n` rows each.
    pub fn from_rows(x: &[C], n: usize, span: Range<usize>) -> Self {
        let vectors = || x.chunks_exact(n).map(|x| &x[span.clone()]);
        let re = vectors().flat_map(|x| x.iter().map(|v| v.re));
        Self {
            rows: span.len(),
            vectors: x.len() / n,
            values: re.chain(vectors().flat_map(|x| x.iter().map(|v| v.im))).collect(),
        }
    }

    /// As many zeros.
    pub fn zeros(&self) -> Self {
        Self { values: vec![0.0; self.values.len()], ..*self }
    }

    /// Number of real columns.
    pub fn width(&self) -> usize {
        2 * self.vectors
    }

    /// x += `factor` times these, in the rows from `first` on of vectors of `n` rows each.
    pub fn add_to(&self, factor: C, x: &mut [C], n: usize, first: usize) {
        let (re, im) = self.values.split_at(self.values.len() / 2);
        let rows = self.rows.max(1);
        for ((x, re), im) in x.chunks_exact_mut(n).zip(re.chunks_exact(rows)).zip(im.chunks_exact(rows)) {
            for ((x, re), im) in x[first..].iter_mut().zip(re).zip(im) {
                *x += factor * C::new(*re, *im);
            }
        }
    }
}

/// Real columns.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    /// Rows of this rank.
    pub rows: usize,
    /// `[rows, columns]` column by column.
    pub values: Vec<f64>,
}

impl Columns {
    /// The first `count` columns, and the stretches of rows.
    fn parts(&self, count: usize) -> (MatRef<'_, f64>, impl Iterator<Item = Range<usize>>) {
        let rows = self.rows;
        let stretches = (0..rows).step_by(STRETCH).map(move |from| from..(from + STRETCH).min(rows));
        (MatRef::from_column_major_slice(&self.values[..rows * count], rows, count), stretches)
    }

    /// Scalar products of the first `count` columns with those of `x`, this rank's part, as complex numbers,
    /// `[count]` for each vector.
    pub fn dots(&self, count: usize, x: &Reals) -> Vec<Vec<C>> {
        let width = x.width();
        let mut sums = vec![0.0; count * width];
        let (columns, stretches) = self.parts(count);
        let x = MatRef::from_column_major_slice(&x.values, self.rows, width);
        for stretch in stretches {
            let sums = MatMut::from_column_major_slice_mut(&mut sums, count, width);
            let [a, b] = [columns, x].map(|m| m.subrows(stretch.start, stretch.len()));
            matmul(sums, Accum::Add, a.transpose(), b, 1.0, Par::Seq);
        }
        let (re, im) = sums.split_at(sums.len() / 2);
        let both = |k: usize| (0..count).map(|i| C::new(re[k * count + i], im[k * count + i])).collect();
        (0..width / 2).map(both).collect()
    }

    /// out += Σ_i factors`[i]` column_i, with factors for each vector of the first columns.
    pub fn add(&self, factors: &[Vec<C>], out: &mut Reals) {
        let count = factors.first().map_or(0, Vec::len);
        let width = out.width();
        let both: Vec<f64> =
            factors.iter().flatten().map(|f| f.re).chain(factors.iter().flatten().map(|f| f.im)).collect();
        let factors = MatRef::from_column_major_slice(&both, count, width);
        let (columns, stretches) = self.parts(count);
        let mut out = MatMut::from_column_major_slice_mut(&mut out.values, self.rows, width);
        for stretch in stretches {
            let columns = columns.subrows(stretch.start, stretch.len());
            let out = out.as_mut().subrows_mut(stretch.start, stretch.len());
            matmul(out, Accum::Add, columns, factors, 1.0, Par::Seq);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_sums_of_columns() {
        let (rows, first, n) = (2 * STRETCH + 37, 5, 2 * STRETCH + 50);
        let values = (0..3 * rows).map(|i| ((i * 7) % 13) as f64 - 6.0).collect();
        let columns = Columns { rows, values };
        let x: Vec<C> = (0..2 * n).map(|i| C::new((i % 5) as f64, (i % 3) as f64 - 1.0)).collect();
        let part = Reals::from_rows(&x, n, first..first + rows);
        assert_eq!(part.width(), 4);
        let dots = columns.dots(2, &part);
        for (k, dots) in dots.iter().enumerate() {
            for (i, dot) in dots.iter().enumerate() {
                let sum: C = (0..rows).map(|r| columns.values[i * rows + r] * x[k * n + first + r]).sum();
                assert_eq!(*dot, sum, "column {i}, vector {k}");
            }
        }
        let factors = [vec![C::new(1.0, 2.0), C::new(-3.0, 0.5)], vec![C::new(0.0, 4.0), C::new(2.0, 0.0)]];
        let mut sum = part.zeros();
        columns.add(&factors, &mut sum);
        let mut out = x.clone();
        sum.add_to(C::i(), &mut out, n, first);
        for (at, (out, x)) in out.iter().zip(&x).enumerate() {
            let (k, row) = (at / n, at % n);
            let inside = (first..first + rows).contains(&row);
            let column = |i: usize| if inside { columns.values[i * rows + row - first] } else { 0.0 };
            let added: C = (0..2).map(|i| C::i() * factors[k][i] * column(i)).sum();
            assert_eq!(*out, x + added, "{at}");
        }
    }
}
