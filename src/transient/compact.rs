//! A dense symmetric operator on a few contact nodes.

use pulp::{Arch, Simd, WithSimd};

use crate::dense;

/// W of k nodes, components (x, y, n) node after node: in double precision, and in single precision sorted by components.
#[derive(Debug, Clone, Default)]
pub struct Operator {
    /// Columns, m/N, `[3k][3k]`.
    columns: Vec<f64>,
    size: usize,
    /// Mean of the normal compliances of the nodes, m/N; 1 without nodes.
    unit: f64,
    /// In `unit`: for each node its columns x and y, each as rows x, y and n of all nodes, `[k][2][3][k]`.
    plane: Vec<f32>,
    /// In `unit`: W_nn, columns, `[k][k]`.
    gaps: Vec<f32>,
}

impl Operator {
    /// The operator with these columns, m/N, `[3k][3k]`.
    pub fn new(columns: Vec<f64>) -> Self {
        let size = columns.len().isqrt();
        let k = size / 3;
        let normal: f64 = (0..k).map(|i| columns[(size + 1) * (3 * i + 2)]).sum();
        let unit = if normal > 0.0 { normal / k as f64 } else { 1.0 };
        let mut new = Self { columns, size, unit, plane: vec![0.0; 6 * k * k], gaps: vec![0.0; k * k] };
        let Self { columns, plane, gaps, .. } = &mut new;
        Arch::new().dispatch(Sort { columns, factor: 1.0 / unit, k, plane, gaps });
        new
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// All columns, m/N, `[3k][3k]`.
    pub fn columns(&self) -> &[f64] {
        &self.columns
    }

    /// Column (and row) `j`, `[3k]`.
    pub fn col(&self, j: usize) -> &[f64] {
        &self.columns[self.size * j..][..self.size]
    }

    /// out = A x.
    pub fn times(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        dense::add_symmetric(&self.columns, self.size, x, out);
    }

    /// What single precision is relative to, m/N.
    pub(super) fn unit(&self) -> f64 {
        self.unit
    }

    /// Column `c` (x, y) of node `i` in single precision: rows x, y and n of all nodes, `[3][k]`.
    pub(super) fn tangential(&self, i: usize, c: usize) -> &[f32] {
        let k = self.size / 3;
        &self.plane[3 * k * (2 * i + c)..][..3 * k]
    }

    /// W_nn in single precision, columns, `[k][k]`.
    pub(super) fn gaps(&self) -> &[f32] {
        &self.gaps
    }

    /// What the normal components `x` do, in single precision: (x, y, n) in `unit`, `[3][k]`.
    pub(super) fn pressed(&self, x: &[f32]) -> Vec<f32> {
        let k = x.len();
        // W is symmetric: row n of a column is the column n in its row.
        let row = |j: usize| dense::wide_dot(&self.tangential(j % k, j / k)[2 * k..], x);
        let mut out: Vec<f32> = (0..2 * k).map(row).collect();
        out.resize(3 * k, 0.0);
        dense::add_columns(&self.gaps, k, x, &mut out[2 * k..]);
        out
    }

    /// What the tangential components of `x`, `[3k]`, do along the surface, in single precision: (x, y) in `unit`, `[2][k]`.
    pub(super) fn pulled(&self, x: &[f32]) -> Vec<f32> {
        let mut out = vec![0.0; x.len() / 3 * 2];
        let pull: Vec<f32> = x.chunks_exact(3).flat_map(|x| [x[0], x[1]]).collect();
        dense::add_columns(&self.plane, x.len(), &pull, &mut out);
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
        for (j, column) in columns.chunks_exact(3 * k.max(1)).enumerate() {
            let rows = bytemuck::cast_slice::<f64, [f64; 3]>(column);
            let (i, c) = (j / 3, j % 3);
            if c == 2 {
                gaps[k * i..][..k].iter_mut().zip(rows).for_each(|(g, w)| *g = (w[2] * factor) as f32);
                continue;
            }
            for (r, out) in plane[3 * k * (2 * i + c)..][..3 * k].chunks_exact_mut(k).enumerate() {
                out.iter_mut().zip(rows).for_each(|(o, w)| *o = (w[r] * factor) as f32);
            }
        }
    }
}
