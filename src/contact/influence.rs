//! Influence of the contact nodes on each other: a dense matrix, or a convolution that needs none.

use crate::dense::{add_scattered, wide_dot};
use crate::model::Convolution;
use faer::MatRef;

/// Influence matrix W of an interface, m/N, `[3n, 3n]`, rows and columns (x, y, n) of each node.
#[derive(Debug, Clone, Copy)]
pub enum Influence<'a> {
    /// Dense: symmetric and kept by columns, or kept by rows.
    Dense(MatRef<'a, f64>),
    /// By what depends on the offset of two nodes alone.
    Convolution(&'a Convolution),
}

impl<'a> From<MatRef<'a, f64>> for Influence<'a> {
    fn from(matrix: MatRef<'a, f64>) -> Self {
        Self::Dense(matrix)
    }
}

impl<'a> From<&'a Convolution> for Influence<'a> {
    fn from(convolution: &'a Convolution) -> Self {
        Self::Convolution(convolution)
    }
}

impl Influence<'_> {
    /// Rows and columns.
    pub fn shape(self) -> (usize, usize) {
        match self {
            Self::Dense(w) => w.shape(),
            Self::Convolution(c) => (c.rows(), c.rows()),
        }
    }

    /// An entry, m/N.
    pub fn get(self, row: usize, column: usize) -> f64 {
        match self {
            Self::Dense(w) => w[(row, column)],
            Self::Convolution(c) => c.get(row, column),
        }
    }

    /// W f, m, `[3n]`, for forces f, N, `[3n]`, most of which are zero.
    pub fn multiply(self, forces: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; forces.len()];
        match self {
            Self::Convolution(c) => c.exact().times(forces, &mut out),
            Self::Dense(w) => match w.try_as_col_major() {
                Some(w) => {
                    let acting = (0..forces.len()).filter(|&k| forces[k] != 0.0);
                    let columns: Vec<_> = acting.map(|k| (w.col(k).as_slice(), forces[k])).collect();
                    add_scattered(&columns, &mut out);
                }
                None => {
                    for (k, o) in out.iter_mut().enumerate() {
                        *o = match w.row(k).try_as_row_major() {
                            Some(row) => wide_dot(row.as_slice(), forces),
                            None => w.row(k).iter().zip(forces).map(|(w, f)| w * f).sum(),
                        };
                    }
                }
            },
        }
        out
    }
}

/// Row `k` of a dense influence matrix, contiguous: matrices that are symmetric are kept by columns, others by rows.
pub(super) fn row(w: MatRef<'_, f64>, k: usize) -> Option<&[f64]> {
    let by_columns = || w.col(k).try_as_col_major().map(|c| c.as_slice());
    w.row(k).try_as_row_major().map(|r| r.as_slice()).or_else(by_columns)
}
