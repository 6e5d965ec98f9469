//! C += op(A) B for a B of at most eight columns, whose rows lie side by side.

use std::arch::x86_64::{_mm_prefetch, _MM_HINT_T0};

use pulp::x86::V3;
use pulp::{f64x4, Simd, WithSimd};

/// Most columns of a thin product.
pub(crate) const COLUMNS: usize = 8;
/// Columns that [`Product::add_plain`] has in registers at a time.
const HALF: usize = COLUMNS / 2;
/// Fewest rows of C.
pub(crate) const LEAST: usize = TILE;
/// Rows of C that [`Product::add_plain`] keeps in registers, for half of the columns at a time.
const TILE: usize = 8;
/// Columns of A that it goes through for all tiles, so that memory is read nearly in order.
const PANEL: usize = 16;
/// Rows of C that [`Product::add_transposed`] keeps in registers.
const ROWS: usize = 4;
/// Numbers in a line of the cache.
const LINE: usize = 8;

/// αB, `[inner]` rows of it, each filled up by zeros.
pub(crate) fn side_by_side(b: &[f64], stride: usize, inner: usize, alpha: f64, rows: &mut Vec<[f64; COLUMNS]>) {
    rows.clear();
    rows.resize(inner, [0.0; COLUMNS]);
    for (j, column) in b.chunks(stride).enumerate() {
        column.iter().zip(&mut *rows).for_each(|(v, row)| row[j] = alpha * v);
    }
}

/// C = βC; what C holds where β is 0 does not count, NaN neither.
pub(crate) fn scale(c: &mut [f64], stride: usize, rows: usize, beta: f64) {
    if beta == 1.0 {
        return;
    }
    for column in c.chunks_mut(stride) {
        column[..rows].iter_mut().for_each(|v| *v = if beta == 0.0 { 0.0 } else { beta * *v });
    }
}

/// Asks for a line at some place of or behind `a`.
#[inline(always)]
fn fetch(a: &[f64], at: usize) {
    // SAFETY: nothing is read; any address may be asked for.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(a.as_ptr().wrapping_add(at).cast()) }
}

#[inline(always)]
fn four(x: &[f64]) -> f64x4 {
    f64x4(x[0], x[1], x[2], x[3])
}

/// What a tile of C gets in half of its columns, `[4][8]`.
type Sums = [[f64x4; TILE / 4]; HALF];

/// C += op(A) B, with op(A) of `[rows, b.len()]`; at least [`LEAST`] rows, two columns.
pub(crate) struct Product<'a> {
    pub simd: V3,
    /// op(A) is Aᵀ.
    pub transposed: bool,
    /// Column by column, as C.
    pub a: &'a [f64],
    pub a_stride: usize,
    pub rows: usize,
    pub b: &'a [[f64; COLUMNS]],
    pub c: &'a mut [f64],
    pub c_stride: usize,
}

impl Product<'_> {
    pub(crate) fn add(self) {
        Simd::vectorize(self.simd, self);
    }

    #[inline(always)]
    fn add_plain(self) {
        let Self { simd, a, a_stride, rows, b, c, c_stride, .. } = self;
        let columns = c.len().div_ceil(c_stride);
        for (k, b) in b.chunks(PANEL).enumerate() {
            let panel = &a[k * PANEL * a_stride..];
            // The panel after this one, a line for each step of a tile.
            let mut ahead = PANEL * a_stride;
            for first in (0..rows).step_by(TILE) {
                // The last tile reaches back over rows that have been dealt with.
                let from = first.min(rows - TILE);
                let sums = tile::<true>(simd, panel, a_stride, from, b, 0, ahead);
                ahead += LINE * b.len();
                add(&sums, first - from, &mut c[from..], c_stride, columns);
                if columns > HALF {
                    let sums = tile::<false>(simd, panel, a_stride, from, b, HALF, 0);
                    add(&sums, first - from, &mut c[HALF * c_stride + from..], c_stride, columns - HALF);
                }
            }
        }
    }

    #[inline(always)]
    fn add_transposed(self) {
        let Self { simd, a, a_stride, rows, b, c, c_stride, .. } = self;
        let mut first = 0;
        while first + ROWS <= rows {
            let sums = dots::<ROWS>(simd, &a[first * a_stride..], a_stride, b);
            store(&sums, first, c, c_stride);
            first += ROWS;
        }
        for row in first..rows {
            store(&dots::<1>(simd, &a[row * a_stride..], a_stride, b), row, c, c_stride);
        }
    }
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        if self.transposed {
            self.add_transposed();
        } else {
            self.add_plain();
        }
    }
}

/// Sums for the rows from `from` on and the columns from `left` on; with `FETCH` asks for what lies `ahead`.
#[inline(always)]
fn tile<const FETCH: bool>(
    simd: V3,
    a: &[f64],
    stride: usize,
    from: usize,
    b: &[[f64; COLUMNS]],
    left: usize,
    ahead: usize,
) -> Sums {
    let mut sums: Sums = [[f64x4(0.0, 0.0, 0.0, 0.0); TILE / 4]; HALF];
    for (p, row) in b.iter().enumerate() {
        let values = &a[p * stride + from..][..TILE];
        let values = [four(values), four(&values[4..])];
        if FETCH {
            fetch(a, ahead + LINE * p);
        }
        for j in 0..HALF {
            let factor = simd.splat_f64s(row[left + j]);
            for i in 0..TILE / 4 {
                sums[j][i] = simd.mul_add_f64s(factor, values[i], sums[j][i]);
            }
        }
    }
    sums
}

/// Adds to a tile of C, of at most half of the columns, what its rows from `done` on get.
#[inline(always)]
fn add(sums: &Sums, done: usize, c: &mut [f64], stride: usize, columns: usize) {
    for j in 0..HALF.min(columns) {
        let mut sum: [f64; TILE] = pulp::cast(sums[j]);
        if done > 0 {
            sum[..done].fill(0.0);
        }
        let out = &mut c[j * stride..][..TILE];
        for i in 0..TILE {
            out[i] += sum[i];
        }
    }
}

/// Sums over `N` columns of A, `[N][8]`.
#[inline(always)]
fn dots<const N: usize>(simd: V3, a: &[f64], stride: usize, b: &[[f64; COLUMNS]]) -> [[f64x4; 2]; N] {
    let mut sums = [[f64x4(0.0, 0.0, 0.0, 0.0); 2]; N];
    let columns: [&[f64]; N] = std::array::from_fn(|i| &a[i * stride..][..b.len()]);
    // Two groups ahead: N numbers a step, a line for every other step of four.
    let ahead = 2 * N * stride;
    for (p, row) in b.iter().enumerate() {
        if p % (LINE / ROWS) == 0 {
            fetch(a, ahead + N * p);
        }
        let row = [four(row), four(&row[4..])];
        for (sum, column) in sums.iter_mut().zip(columns) {
            let factor = simd.splat_f64s(column[p]);
            sum.iter_mut().zip(row).for_each(|(s, v)| *s = simd.mul_add_f64s(factor, v, *s));
        }
    }
    sums
}

#[inline(always)]
fn store<const N: usize>(sums: &[[f64x4; 2]; N], first: usize, c: &mut [f64], stride: usize) {
    for (i, sum) in sums.iter().enumerate() {
        let sum: [f64; COLUMNS] = pulp::cast(*sum);
        c.chunks_mut(stride).zip(sum).for_each(|(column, s)| column[first + i] += s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..n).map(|_| next()).collect()
    }

    /// Both kernels against the definition, over sizes about those of tiles and panels, with strides of their own; what lies between columns stays.
    #[test]
    fn products_are_those_of_the_definition() {
        let Some(simd) = V3::try_new() else { return };
        let (alpha, mut space) = (-0.7, Vec::new());
        for rows in (LEAST..28).chain([64, 105]) {
            for inner in [1, 2, 3, 15, 16, 17, 33, 120] {
                for columns in 2..=COLUMNS {
                    for (beta, extra) in [(1.0, 0), (0.0, 3), (2.5, 1)] {
                        for transposed in [false, true] {
                            let (high, wide) = if transposed { (inner, rows) } else { (rows, inner) };
                            let (a_stride, b_stride, c_stride) = (high + extra, inner + extra, rows + extra);
                            let a = numbers(a_stride * wide, 1);
                            let b = numbers(b_stride * columns, 2);
                            let mut c = numbers(c_stride * columns, 3);
                            if beta == 0.0 {
                                c[0] = f64::NAN;
                            }
                            let mut wanted = c.clone();
                            for j in 0..columns {
                                for i in 0..rows {
                                    let at =
                                        |p: usize| if transposed { a[i * a_stride + p] } else { a[p * a_stride + i] };
                                    let sum: f64 = (0..inner).map(|p| at(p) * b[j * b_stride + p]).sum();
                                    let v = &mut wanted[j * c_stride + i];
                                    *v = alpha * sum + if beta == 0.0 { 0.0 } else { beta * *v };
                                }
                            }
                            let ends = (a_stride * (wide - 1) + high, c_stride * (columns - 1) + rows);
                            let (a, c) = (&a[..ends.0], &mut c[..ends.1]);
                            side_by_side(&b[..b_stride * (columns - 1) + inner], b_stride, inner, alpha, &mut space);
                            scale(c, c_stride, rows, beta);
                            Product { simd, transposed, a, a_stride, rows, b: &space, c, c_stride }.add();
                            for (own, right) in c.iter().zip(&wanted) {
                                assert!(
                                    (own - right).abs() < 1e-13,
                                    "{rows} {inner} {columns} {transposed}: {own} for {right}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}
