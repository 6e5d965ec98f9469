//! Blocks of distributed columns: Gram matrices, projections, combinations. Every rank holds its rows, `[n, columns]`
//! column by column.

use crate::parallel::World;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Rows combined at a time: their part of some hundred columns stays in the second-level cache.
const ROWS: usize = 512;

/// The columns of `values` that have `n` rows each.
pub(super) fn columns(values: &[f64], n: usize, count: usize) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(values, n, count)
}

/// Collective: aᵀ b, the same on every rank.
pub(super) fn gram(world: &World, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let (rows, cols) = (a.ncols(), b.ncols());
    let mut own = vec![0.0; rows * cols];
    if a.nrows() > 0 {
        let out = MatMut::from_column_major_slice_mut(&mut own, rows, cols);
        matmul(out, Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    }
    let all = world.sum_all(&own);
    Mat::from_fn(rows, cols, |i, j| all[j * rows + i])
}

/// w −= v h.
pub(super) fn subtract(w: &mut [f64], v: MatRef<'_, f64>, h: MatRef<'_, f64>) {
    if v.nrows() > 0 && v.ncols() > 0 {
        let w = MatMut::from_column_major_slice_mut(w, v.nrows(), h.ncols());
        matmul(w, Accum::Add, v, h, -1.0, Par::Seq);
    }
}

/// The first columns of `v`, `[n, s.nrows()]`, become V S, without a copy of V. S must not have more columns than rows.
pub(super) fn combine(v: &mut [f64], n: usize, s: MatRef<'_, f64>) {
    let (from, to) = (s.nrows(), s.ncols());
    let mut product = vec![0.0; ROWS.min(n) * to];
    for first in (0..n).step_by(ROWS) {
        let rows = ROWS.min(n - first);
        let product = &mut product[..rows * to];
        let part = columns(&v[..n * from], n, from).subrows(first, rows);
        let out = MatMut::from_column_major_slice_mut(product, rows, to);
        matmul(out, Accum::Replace, part, s, 1.0, Par::Seq);
        for (j, column) in product.chunks_exact(rows).enumerate() {
            v[j * n + first..][..rows].copy_from_slice(column);
        }
    }
}

/// Numbers between −1/2 and 1/2 for the rows from `first` on that depend on row and `column` alone, not on the ranks.
pub fn random(first: u64, column: u64, out: &mut [f64]) {
    for (i, value) in out.iter_mut().enumerate() {
        // SplitMix64.
        let mut z = (first + i as u64).wrapping_add(column << 40).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        *value = ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combination_in_place_is_the_product() {
        for n in [0, 1, ROWS - 1, ROWS, 2 * ROWS + 3] {
            let mut v: Vec<f64> = vec![0.0; 5 * n];
            (0..5).for_each(|j| random(7, j, &mut v[j as usize * n..(j as usize + 1) * n]));
            let s = Mat::from_fn(5, 3, |i, j| (i as f64 - 1.5) * (j as f64 + 0.5));
            let want = columns(&v, n, 5) * &s;
            combine(&mut v, n, s.as_ref());
            for j in 0..3 {
                for i in 0..n {
                    assert!((v[j * n + i] - want[(i, j)]).abs() < 1e-14, "{n}: {i}, {j}");
                }
            }
        }
    }

    #[test]
    fn random_rows_do_not_depend_on_where_they_begin() {
        let (mut whole, mut part) = (vec![0.0; 100], vec![0.0; 40]);
        random(1000, 3, &mut whole);
        random(1060, 3, &mut part);
        assert_eq!(whole[60..], part);
        let mean = whole.iter().sum::<f64>() / 100.0;
        assert!(mean.abs() < 0.1 && whole.iter().all(|v| v.abs() <= 0.5), "{mean}");
    }
}
