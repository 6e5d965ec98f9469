//! C += op(A) B for a B of at most eight columns, whose rows lie side by side.

use std::arch::x86_64::{_mm_prefetch, _MM_HINT_T0};

use pulp::x86::V3;
use pulp::{f64x4, Simd, WithSimd};

/// Most columns of a thin product.
pub(crate) const COLUMNS: usize = 8;
/// Fewest rows of C.
pub(crate) const LEAST: usize = 8;
/// Columns of A that the kernels go through together: what belongs to them stays in registers.
pub(crate) const GROUP: usize = 4;
/// Rows of C, or of B, that stay in half of the first-level cache.
const STRIP: usize = 256;
/// Length of columns up to which what comes next is asked for two groups ahead, and above which one.
const SHORT: usize = 96;
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

/// A row of eight columns.
pub(crate) type Row = [f64x4; COLUMNS / 4];

#[inline(always)]
pub(crate) fn row(x: &[f64; COLUMNS]) -> Row {
    [f64x4(x[0], x[1], x[2], x[3]), f64x4(x[4], x[5], x[6], x[7])]
}

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
        let Self { simd, a, a_stride: stride, rows, b, c, c_stride, .. } = self;
        let mut sums = [[0.0; COLUMNS]; STRIP];
        for first in (0..rows).step_by(STRIP) {
            let sums = &mut sums[..STRIP.min(rows - first)];
            sums.fill([0.0; COLUMNS]);
            let whole = b.len() / GROUP * GROUP;
            for k in (0..whole).step_by(GROUP) {
                let from = k * stride + first;
                spread::<GROUP>(simd, a, from, stride, from + ahead(stride), &b[k..], sums);
            }
            for k in whole..b.len() {
                spread::<1>(simd, a, k * stride + first, stride, a.len(), &b[k..], sums);
            }
            for (j, column) in c.chunks_mut(c_stride).enumerate() {
                column[first..].iter_mut().zip(&*sums).for_each(|(v, sum)| *v += sum[j]);
            }
        }
    }

    #[inline(always)]
    fn add_transposed(self) {
        let Self { simd, a, a_stride: stride, rows, b, c, c_stride, .. } = self;
        for (strip, b) in b.chunks(STRIP).enumerate() {
            let a = &a[strip * STRIP..];
            let whole = rows / GROUP * GROUP;
            for first in (0..whole).step_by(GROUP) {
                store(&dots::<GROUP>(simd, &a[first * stride..], stride, b), first, c, c_stride);
            }
            for row in whole..rows {
                store(&dots::<1>(simd, &a[row * stride..], stride, b), row, c, c_stride);
            }
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

/// How much further on what comes next lies.
#[inline(always)]
fn ahead(stride: usize) -> usize {
    GROUP * stride * if stride > SHORT { 1 } else { 2 }
}

/// Asks for a line of a group of columns of this `length` at each second step: in the order in which they lie in memory, which lets the processor go on by itself, where little is
/// between them.
#[inline(always)]
fn fetch_group(a: &[f64], at: usize, stride: usize, length: usize, step: usize) {
    let turn = LINE / GROUP;
    if step.is_multiple_of(turn) {
        let place = match stride < length + LINE {
            true => GROUP * step,
            false => step / turn % GROUP * stride + step / LINE * LINE,
        };
        fetch(a, at + place);
    }
}

/// Adds to rows what `N` columns of A give, which begin at `from`; at `next` begin those that come next.
#[inline(always)]
pub(crate) fn spread<const N: usize>(
    simd: V3,
    a: &[f64],
    from: usize,
    stride: usize,
    next: usize,
    b: &[[f64; COLUMNS]],
    sums: &mut [[f64; COLUMNS]],
) {
    let length = sums.len();
    let columns: [&[f64]; N] = std::array::from_fn(|j| &a[from + j * stride..][..length]);
    let factors: [Row; N] = std::array::from_fn(|j| row(&b[j]));
    for (i, target) in sums.iter_mut().enumerate() {
        fetch_group(a, next, stride, length, i);
        let mut sum = row(target);
        for (column, factor) in columns.iter().zip(&factors) {
            let value = simd.splat_f64s(column[i]);
            sum.iter_mut().zip(factor).for_each(|(s, f)| *s = simd.mul_add_f64s(value, *f, *s));
        }
        *target = pulp::cast(sum);
    }
}

/// Sums over `N` columns of A.
#[inline(always)]
pub(crate) fn dots<const N: usize>(simd: V3, a: &[f64], stride: usize, b: &[[f64; COLUMNS]]) -> [Row; N] {
    let mut sums = [[f64x4(0.0, 0.0, 0.0, 0.0); 2]; N];
    let columns: [&[f64]; N] = std::array::from_fn(|i| &a[i * stride..][..b.len()]);
    for (p, values) in b.iter().enumerate() {
        fetch_group(a, ahead(stride), stride, b.len(), p);
        let values = row(values);
        for (sum, column) in sums.iter_mut().zip(columns) {
            let factor = simd.splat_f64s(column[p]);
            sum.iter_mut().zip(values).for_each(|(s, v)| *s = simd.mul_add_f64s(factor, v, *s));
        }
    }
    sums
}

#[inline(always)]
fn store<const N: usize>(sums: &[Row; N], first: usize, c: &mut [f64], stride: usize) {
    for (i, sum) in sums.iter().enumerate() {
        let sum: [f64; COLUMNS] = pulp::cast(*sum);
        c.chunks_mut(stride).zip(sum).for_each(|(column, s)| column[first + i] += s);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn numbers(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..n).map(|_| next()).collect()
    }

    /// Both kernels against the definition, over sizes about those of groups and strips, with strides of their own; what lies between columns stays.
    #[test]
    fn products_are_those_of_the_definition() {
        let Some(simd) = V3::try_new() else { return };
        let (alpha, mut space) = (-0.7, Vec::new());
        for rows in (LEAST..28).chain([64, 105, STRIP + 13]) {
            for inner in [1, 2, 3, 15, 16, 17, 33, 120, STRIP + 6] {
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
