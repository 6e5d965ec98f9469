//! A dense symmetric operator on a few contact nodes.

use faer::MatRef;
use pulp::{Arch, Simd, WithSimd};

use super::aligned::{padded_len, AlignedVec};
use crate::dense;

/// W of k nodes, components (x, y, n) node after node: in double precision, and in single precision sorted by
/// components, the nodes in `l` ≥ k places that fill whole lines.
#[derive(Debug, Clone, Default)]
pub struct DelassusOperator {
    /// Columns, m/N, `[3k][3k]`, every one in lines of its own.
    columns: AlignedVec<f64>,
    size: usize,
    /// Diagonal, m/N, `[3k]`.
    diagonal: Vec<f64>,
    /// Mean of the normal compliances of the nodes, m/N; 1 without nodes.
    unit: f64,
    /// In `unit`: for each node its columns x and y, each as rows x, y and n of all nodes, `[k][2][3][l]`.
    plane: AlignedVec<f32>,
    /// In `unit`: W_nn, columns, `[k][l]`.
    gaps: AlignedVec<f32>,
}

impl DelassusOperator {
    /// The operator with these columns, m/N, `[3k][3k]`.
    pub fn new(columns: Vec<f64>) -> Self {
        let size = columns.len().isqrt();
        let k = size / 3;
        let diagonal: Vec<f64> = columns.iter().step_by(size + 1).copied().collect();
        let normal: f64 = diagonal.iter().skip(2).step_by(3).sum();
        let unit = if normal > 0.0 { normal / k as f64 } else { 1.0 };
        let places = padded_len::<f32>(k);
        let (plane, gaps) = (AlignedVec::zeros(6 * k * places), AlignedVec::zeros(k * places));
        let lines = AlignedVec::columns(size, columns.iter().copied());
        let mut new = Self { columns: lines, size, diagonal, unit, plane, gaps };
        let Self { plane, gaps, .. } = &mut new;
        Arch::new().dispatch(Sort { columns: &columns, factor: 1.0 / unit, k, plane, gaps });
        new
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Distance of the columns.
    fn stride(&self) -> usize {
        padded_len::<f64>(self.size)
    }

    /// The matrix, m/N, `[3k, 3k]`.
    pub fn matrix(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice_with_stride(&self.columns, self.size, self.size, self.stride())
    }

    /// Column (and row) `j`, `[3k]`.
    pub fn col(&self, j: usize) -> &[f64] {
        &self.columns[self.stride() * j..][..self.size]
    }

    /// Diagonal, m/N, `[3k]`.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// out = A x.
    pub fn times(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        dense::add_symmetric(&self.columns, self.stride(), x, out);
    }

    /// Reference compliance of single precision, m/N.
    pub(super) fn unit(&self) -> f64 {
        self.unit
    }

    /// l.
    pub(super) fn places(&self) -> usize {
        padded_len::<f32>(self.size / 3)
    }

    /// Column `c` (x, y) of node `i` in single precision: rows x, y and n of all nodes, `[3][l]`.
    pub(super) fn tangential(&self, i: usize, c: usize) -> &[f32] {
        let column = 3 * self.places();
        &self.plane[column * (2 * i + c)..][..column]
    }

    /// W_nn in single precision, columns, `[k][l]`.
    pub(super) fn gaps(&self) -> &[f32] {
        &self.gaps
    }

    /// Response to the normal components `x`, `[l]`, in single precision: (x, y, n) in `unit`, `[3][l]`.
    pub(super) fn pressed(&self, x: &[f32]) -> AlignedVec<f32> {
        let (k, l) = (self.size / 3, self.places());
        let mut out = AlignedVec::zeros(3 * l);
        for c in 0..2 {
            // W is symmetric: row n of a column is the column n in its row.
            let rows = self.plane.get(l * (3 * c + 2)..).unwrap_or_default();
            dense::add_transposed(rows, 6 * l, x, &mut out[l * c..][..k]);
        }
        dense::add_columns(&self.gaps, l, &x[..k], &mut out[2 * l..]);
        out
    }

    /// Response along the surface to the tangential components `[x, y]`, `[l]` each, in single precision: (x, y) in
    /// `unit`, `[2][l]`.
    pub(super) fn pulled(&self, [x, y]: [Vec<f32>; 2]) -> AlignedVec<f32> {
        let (k, l) = (self.size / 3, self.places());
        let mut out = AlignedVec::zeros(2 * l);
        let pull: Vec<f32> = x.iter().zip(&y).take(k).flat_map(|(x, y)| [*x, *y]).collect();
        dense::add_columns(&self.plane, 3 * l, &pull, &mut out);
        out
    }
}

/// Sorts columns by components.
struct Sort<'a> {
    columns: &'a [f64],
    factor: f64,
    k: usize,
    plane: &'a mut [f32],
    gaps: &'a mut [f32],
}

impl WithSimd for Sort<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { columns, factor, k, plane, gaps } = self;
        let l = padded_len::<f32>(k);
        for (j, column) in columns.chunks_exact(3 * k.max(1)).enumerate() {
            let rows = bytemuck::cast_slice::<f64, [f64; 3]>(column);
            let (i, c) = (j / 3, j % 3);
            if c == 2 {
                gaps[l * i..][..k].iter_mut().zip(rows).for_each(|(g, w)| *g = (w[2] * factor) as f32);
                continue;
            }
            for (r, out) in plane[3 * l * (2 * i + c)..][..3 * l].chunks_exact_mut(l).enumerate() {
                out.iter_mut().zip(rows).for_each(|(o, w)| *o = (w[r] * factor) as f32);
            }
        }
    }
}
