//! Products of dense columns with vectors, in the widest vector instructions of the processor at hand: a program
//! compiled for all processors of a family uses none but the oldest by itself. And the eigenvectors of dense
//! symmetric matrices.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Mul};

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{self, ComputeEigenvectors, SelfAdjointEvdParams};
use faer::linalg::matmul::matmul;
use faer::{Accum, Auto, Mat, MatMut, MatRef, Par, Spec};
use pulp::{Arch, Simd, WithSimd};

/// `f64` or `f32`.
pub(crate) trait Real: Copy + Default + Add<Output = Self> + Mul<Output = Self> + AddAssign + Sum {
    /// See the function [`add_columns`].
    fn add_columns(a: &[Self], stride: usize, x: &[Self], out: &mut [Self]);
    /// See the function [`add_transposed`].
    fn add_transposed(a: &[Self], stride: usize, x: &[Self], out: &mut [Self]);
    /// See the function [`add_scattered`].
    fn add_scattered(columns: &[(&[Self], Self)], out: &mut [Self]);
}

/// A x, of as many entries as A has rows.
pub(crate) fn product(a: MatRef<'_, f64>, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.nrows()];
    if !x.is_empty() && !out.is_empty() {
        let column = MatMut::from_column_major_slice_mut(&mut out, a.nrows(), 1);
        matmul(column, Accum::Replace, a, MatRef::from_column_major_slice(x, x.len(), 1), 1.0, Par::Seq);
    }
    out
}

/// Eigenvalues, ascending, `[n]`, and orthonormal eigenvectors, columns of `[n, n]`, of the symmetric matrix whose
/// lower triangle `a` holds; by QR iterations, accurate to rounding in the norm of the matrix. The library's divide
/// and conquer, which it takes by itself from order 128 on, leaves up to 1e-8 of it on matrices whose eigenvalues
/// span several powers of ten. `None` where the iterations do not end.
pub(crate) fn symmetric_eigen(a: MatRef<'_, f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = a.nrows();
    let params =
        SelfAdjointEvdParams { recursion_threshold: usize::MAX, ..<SelfAdjointEvdParams as Auto<f64>>::auto() };
    let (params, par) = (Spec::new(params), Par::Seq);
    let (mut values, mut vectors) = (Diag::zeros(n), Mat::zeros(n, n));
    let scratch = evd::self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, par, params);
    let mut memory = MemBuffer::new(scratch);
    evd::self_adjoint_evd(a, values.as_mut(), Some(vectors.as_mut()), par, MemStack::new(&mut memory), params).ok()?;
    Some((values.column_vector().iter().copied().collect(), vectors))
}

/// Inner product in several partial sums, which the compiler can keep in vector registers.
#[inline(always)]
pub(crate) fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    const PARTS: usize = 16;
    let (ac, bc) = (a.chunks_exact(PARTS), b.chunks_exact(PARTS));
    let tail: T = ac.remainder().iter().zip(bc.remainder()).map(|(x, y)| *x * *y).sum();
    let mut s = [T::default(); PARTS];
    for (x, y) in ac.zip(bc) {
        for k in 0..PARTS {
            s[k] += x[k] * y[k];
        }
    }
    s.into_iter().sum::<T>() + tail
}

/// Σ f(i), i < n, in several partial sums: one by one each addition waits for the one before.
#[inline(always)]
pub(crate) fn sum_over<T: Real>(n: usize, f: impl Fn(usize) -> T) -> T {
    const PARTS: usize = 8;
    let whole = n - n % PARTS;
    let mut sums = [T::default(); PARTS];
    for i in (0..whole).step_by(PARTS) {
        (0..PARTS).for_each(|k| sums[k] += f(i + k));
    }
    sums.into_iter().sum::<T>() + (whole..n).map(f).sum::<T>()
}

/// [`dot`] where nothing around it is compiled for the processor at hand.
pub(crate) fn wide_dot<T: Real>(a: &[T], b: &[T]) -> T {
    Arch::new().dispatch(Dot(a, b))
}

struct Dot<'a, T>(&'a [T], &'a [T]);

impl<T: Real> WithSimd for Dot<'_, T> {
    type Output = T;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> T {
        dot(self.0, self.1)
    }
}

/// out += A x for the leading rows of the columns in `a`, which are `stride` apart; runs of columns whose factors are
/// 0 cost nothing.
pub(crate) fn add_columns<T: Real>(a: &[T], stride: usize, x: &[T], out: &mut [T]) {
    T::add_columns(a, stride, x, out);
}

/// out += Aᵀ x of columns in `a` that begin `stride` apart and are as long as `x`.
pub(crate) fn add_transposed<T: Real>(a: &[T], stride: usize, x: &[T], out: &mut [T]) {
    T::add_transposed(a, stride, x, out);
}

/// out += the sum of columns times factors, of columns that lie anywhere and are as long as `out`.
pub(crate) fn add_scattered<T: Real>(columns: &[(&[T], T)], out: &mut [T]) {
    T::add_scattered(columns, out);
}

struct Scattered<'a, T> {
    columns: &'a [(&'a [T], T)],
    out: &'a mut [T],
}

struct Columns<'a, T> {
    a: &'a [T],
    stride: usize,
    x: &'a [T],
    out: &'a mut [T],
}

struct Transposed<'a, T> {
    a: &'a [T],
    stride: usize,
    x: &'a [T],
    out: &'a mut [T],
}

/// Columns taken at a time: as many as there are registers for what belongs to them.
const WIDTH: usize = 6;

/// [`add_columns`] for one kind of number, with its vector instructions.
macro_rules! real {
    ($t:ty, $parts:ident, $parts_mut:ident, $splat:ident, $mul:ident, $fma:ident, $add:ident, $sum:ident) => {
        impl Real for $t {
            fn add_columns(a: &[$t], stride: usize, x: &[$t], out: &mut [$t]) {
                Arch::new().dispatch(Columns { a, stride, x, out });
            }

            fn add_transposed(a: &[$t], stride: usize, x: &[$t], out: &mut [$t]) {
                Arch::new().dispatch(Transposed { a, stride, x, out });
            }

            fn add_scattered(columns: &[(&[$t], $t)], out: &mut [$t]) {
                Arch::new().dispatch(Scattered { columns, out });
            }
        }

        impl WithSimd for Scattered<'_, $t> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(self, s: S) {
                let Self { columns, out } = self;
                let n = out.len();
                let (wide, tail) = S::$parts_mut(out);
                let len = wide.len();
                let groups = columns.chunks_exact(WIDTH);
                let rest = groups.remainder();
                for group in groups {
                    let parts: [_; WIDTH] = std::array::from_fn(|c| S::$parts(&group[c].0[..n]));
                    let factors: [_; WIDTH] = std::array::from_fn(|c| s.$splat(group[c].1));
                    let [a0, a1, a2, a3, a4, a5] = std::array::from_fn(|c| &parts[c].0[..len]);
                    for (i, o) in wide.iter_mut().enumerate() {
                        let even = s.$fma(a2[i], factors[2], s.$fma(a0[i], factors[0], *o));
                        let odd = s.$fma(a3[i], factors[3], s.$mul(a1[i], factors[1]));
                        *o = s.$add(s.$fma(a4[i], factors[4], even), s.$fma(a5[i], factors[5], odd));
                    }
                    for ((_, column), (_, x)) in parts.iter().zip(group) {
                        tail.iter_mut().zip(*column).for_each(|(o, a)| *o += a * x);
                    }
                }
                for (column, x) in rest {
                    let (column, below) = S::$parts(&column[..n]);
                    let factor = s.$splat(*x);
                    wide.iter_mut().zip(column).for_each(|(o, a)| *o = s.$fma(*a, factor, *o));
                    tail.iter_mut().zip(below).for_each(|(o, a)| *o += a * x);
                }
            }
        }

        impl WithSimd for Transposed<'_, $t> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(self, s: S) {
                let Self { a, stride, x, out } = self;
                let (wide, tail) = S::$parts(x);
                let (groups, rest) = out.split_at_mut(out.len() / WIDTH * WIDTH);
                for (o, column) in rest.iter_mut().zip((groups.len()..).map(|j| &a[j * stride..][..x.len()])) {
                    *o += dot(column, x);
                }
                for (j, out) in groups.chunks_exact_mut(WIDTH).enumerate() {
                    let columns: [_; WIDTH] =
                        std::array::from_fn(|c| S::$parts(&a[(WIDTH * j + c) * stride..][..x.len()]));
                    let [a0, a1, a2, a3, a4, a5] = std::array::from_fn(|c| &columns[c].0[..wide.len()]);
                    let mut sums = [s.$splat(0.0); WIDTH];
                    for (i, &x) in wide.iter().enumerate() {
                        let at = [a0[i], a1[i], a2[i], a3[i], a4[i], a5[i]];
                        for c in 0..WIDTH {
                            sums[c] = s.$fma(at[c], x, sums[c]);
                        }
                    }
                    for (c, o) in out.iter_mut().enumerate() {
                        let rest: $t = columns[c].1.iter().zip(tail).map(|(a, x)| a * x).sum();
                        *o += s.$sum(sums[c]) + rest;
                    }
                }
            }
        }

        impl WithSimd for Columns<'_, $t> {
            type Output = ();

            #[inline(always)]
            fn with_simd<S: Simd>(self, s: S) {
                let Self { a, stride, x, out } = self;
                let n = out.len();
                let groups = x.chunks_exact(WIDTH);
                let rest = x.len() - groups.remainder().len();
                let (wide, tail) = S::$parts_mut(out);
                let len = wide.len();
                for (j, x) in groups.enumerate().filter(|(_, x)| x.iter().any(|x| *x != 0.0)) {
                    let columns: [_; WIDTH] = std::array::from_fn(|c| S::$parts(&a[(WIDTH * j + c) * stride..][..n]));
                    let factors: [_; WIDTH] = std::array::from_fn(|c| s.$splat(x[c]));
                    let [a0, a1, a2, a3, a4, a5] = std::array::from_fn(|c| &columns[c].0[..len]);
                    for (i, o) in wide.iter_mut().enumerate() {
                        let even = s.$fma(a2[i], factors[2], s.$fma(a0[i], factors[0], *o));
                        let odd = s.$fma(a3[i], factors[3], s.$mul(a1[i], factors[1]));
                        *o = s.$add(s.$fma(a4[i], factors[4], even), s.$fma(a5[i], factors[5], odd));
                    }
                    for ((_, column), x) in columns.iter().zip(x) {
                        tail.iter_mut().zip(*column).for_each(|(o, a)| *o += a * x);
                    }
                }
                for j in rest..x.len() {
                    let (column, below) = S::$parts(&a[j * stride..][..n]);
                    let factor = s.$splat(x[j]);
                    wide.iter_mut().zip(column).for_each(|(o, a)| *o = s.$fma(*a, factor, *o));
                    tail.iter_mut().zip(below).for_each(|(o, a)| *o += a * x[j]);
                }
            }
        }
    };
}

real!(f64, as_simd_f64s, as_mut_simd_f64s, splat_f64s, mul_f64s, mul_add_e_f64s, add_f64s, reduce_sum_f64s);
real!(f32, as_simd_f32s, as_mut_simd_f32s, splat_f32s, mul_f32s, mul_add_e_f32s, add_f32s, reduce_sum_f32s);

/// out += A x for a symmetric matrix, of whose columns, `stride` apart, only the entries on and below the diagonal
/// are read: large products take as long as their matrix takes from memory.
pub(crate) fn add_symmetric(a: &[f64], stride: usize, x: &[f64], out: &mut [f64]) {
    Arch::new().dispatch(Symmetric { a, stride, x, out });
}

struct Symmetric<'a> {
    a: &'a [f64],
    stride: usize,
    x: &'a [f64],
    out: &'a mut [f64],
}

impl WithSimd for Symmetric<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, s: S) {
        let Self { a, stride, x, out } = self;
        let n = out.len();
        let whole = n - n % WIDTH;
        for j in (0..whole).step_by(WIDTH) {
            let (head, below) = out.split_at_mut(j + WIDTH);
            let mut own: [f64; WIDTH] = std::array::from_fn(|c| head[j + c]);
            for c in 0..WIDTH {
                let column = &a[(j + c) * stride + j..][..WIDTH];
                own[c] += column[c] * x[j + c];
                for r in c + 1..WIDTH {
                    own[r] += column[r] * x[j + c];
                    own[c] += column[r] * x[j + r];
                }
            }
            let columns: [_; WIDTH] =
                std::array::from_fn(|c| S::as_simd_f64s(&a[(j + c) * stride + j + WIDTH..][..below.len()]));
            let (x_below, x_tail) = S::as_simd_f64s(&x[j + WIDTH..n]);
            let (out_below, out_tail) = S::as_mut_simd_f64s(below);
            let len = out_below.len();
            let factors: [_; WIDTH] = std::array::from_fn(|c| s.splat_f64s(x[j + c]));
            let mut sums = [s.splat_f64s(0.0); WIDTH];
            let [a0, a1, a2, a3, a4, a5] = std::array::from_fn(|c| &columns[c].0[..len]);
            for (i, (o, &x)) in out_below.iter_mut().zip(x_below).enumerate() {
                let at = [a0[i], a1[i], a2[i], a3[i], a4[i], a5[i]];
                let mut even = *o;
                let mut odd = s.mul_f64s(at[1], factors[1]);
                for c in 0..WIDTH {
                    sums[c] = s.mul_add_e_f64s(at[c], x, sums[c]);
                }
                for c in [0, 2, 4] {
                    even = s.mul_add_e_f64s(at[c], factors[c], even);
                }
                for c in [3, 5] {
                    odd = s.mul_add_e_f64s(at[c], factors[c], odd);
                }
                *o = s.add_f64s(even, odd);
            }
            for c in 0..WIDTH {
                own[c] += s.reduce_sum_f64s(sums[c]) + dot(columns[c].1, x_tail);
                out_tail.iter_mut().zip(columns[c].1).for_each(|(o, a)| *o += a * x[j + c]);
            }
            head[j..].copy_from_slice(&own);
        }
        for c in whole..n {
            let column = &a[c * stride..][..n];
            out[c] += dot(&column[c..], &x[c..n]);
            out[c + 1..].iter_mut().zip(&column[c + 1..]).for_each(|(o, a)| *o += a * x[c]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ritz values of a method of Lanczos span many powers of ten: what small ones lack is rounding beside the largest.
    #[test]
    fn eigenvectors_of_a_graded_matrix_are_accurate() {
        let n = 200;
        let value = |i: usize| 10f64.powf(-6.0 * i as f64 / n as f64);
        // A graded band: blocks of eight that couple with their neighbours.
        let a = Mat::from_fn(n, n, |i, j| {
            let size = (value(i) * value(j)).sqrt();
            let mixed = (1.0 + (3 * i.max(j) + 7 * i.min(j)) as f64).sin();
            match i.abs_diff(j) {
                0 => size,
                d if d <= 8 => 0.3 * size * mixed,
                _ => 0.0,
            }
        });
        let (values, vectors) = symmetric_eigen(a.as_ref()).unwrap();
        assert!(values.windows(2).all(|w| w[0] <= w[1]));
        let scaled = Mat::from_fn(n, n, |i, j| vectors[(i, j)] * values[j]);
        let norm = a.norm_max();
        let rest = (&a * &vectors - scaled).norm_max() / norm;
        let skew = (vectors.transpose() * &vectors - Mat::<f64>::identity(n, n)).norm_max();
        assert!(rest < 1e-13 && skew < 1e-13, "residual {rest:.1e}, orthogonality {skew:.1e}");
    }

    /// Sizes that leave all kinds of remainders, in columns longer than what is meant of them; what is above the
    /// diagonal is not read.
    #[test]
    fn products_are_those_of_the_plain_sums() {
        for n in [0, 1, 5, 6, 7, 12, 31, 64, 99] {
            let stride = n + 2;
            let entry = |i: usize, j: usize| ((i * 7 + j * 5 + i * j) % 13) as f64 - 4.0;
            let mut a: Vec<f64> = (0..stride * n).map(|k| entry(k % stride, k / stride)).collect();
            let x: Vec<f64> = (0..n).map(|i| (i % 5) as f64 - 1.5).collect();
            let start: Vec<f64> = (0..n).map(|i| i as f64).collect();
            let plain = |i: usize| start[i] + (0..n).map(|j| entry(i, j) * x[j]).sum::<f64>();
            let mut out = start.clone();
            add_columns(&a, stride, &x, &mut out);
            (0..n).for_each(|i| assert_eq!(out[i], plain(i), "columns of {n}, row {i}"));
            let mut out = start.clone();
            add_transposed(&a, stride, &x, &mut out);
            let across = |j: usize| start[j] + (0..n).map(|i| entry(i, j) * x[i]).sum::<f64>();
            (0..n).for_each(|j| assert_eq!(out[j], across(j), "transposed of {n}, column {j}"));
            let mut out = start.clone();
            let scattered: Vec<_> = (0..n).rev().map(|j| (&a[stride * j..][..n], x[j])).collect();
            add_scattered(&scattered, &mut out);
            (0..n).for_each(|i| assert_eq!(out[i], plain(i), "scattered columns of {n}, row {i}"));
            (0..n).for_each(|j| a[stride * j..][..j].fill(f64::NAN));
            let mirrored = |i: usize| start[i] + (0..n).map(|j| entry(i.max(j), i.min(j)) * x[j]).sum::<f64>();
            let mut out = start.clone();
            add_symmetric(&a, stride, &x, &mut out);
            (0..n).for_each(|i| assert_eq!(out[i], mirrored(i), "symmetric of {n}, row {i}"));
            assert_eq!(dot(&x, &start), x.iter().zip(&start).map(|(a, b)| a * b).sum::<f64>());
        }
    }
}
