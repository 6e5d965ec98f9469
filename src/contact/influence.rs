//! Products with an influence matrix W that is either symmetric and kept by columns, or kept by rows.

use crate::dense::dot;
use faer::MatRef;

/// Row `k` of an influence matrix, contiguous: matrices that are symmetric are kept by columns, others by rows.
pub(super) fn row(w: MatRef<'_, f64>, k: usize) -> Option<&[f64]> {
    let by_columns = || w.col(k).try_as_col_major().map(|c| c.as_slice());
    w.row(k).try_as_row_major().map(|r| r.as_slice()).or_else(by_columns)
}

/// `w` times a vector most of whose components are zero.
pub(super) fn multiply(w: MatRef<'_, f64>, x: impl Iterator<Item = f64>) -> Vec<f64> {
    if w.try_as_col_major().is_none() {
        let x: Vec<f64> = x.collect();
        return (0..w.nrows()).map(|k| row(w, k).map_or(f64::NAN, |r| dot(r, &x))).collect();
    }
    let mut out = vec![0.0; w.nrows()];
    for (k, v) in x.enumerate().filter(|(_, v)| *v != 0.0) {
        let Some(column) = w.col(k).try_as_col_major() else { continue };
        for (o, c) in out.iter_mut().zip(column.as_slice()) {
            *o += c * v;
        }
    }
    out
}
