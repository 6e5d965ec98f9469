//! Factors of small complex matrices.

use super::C;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::PI;

/// A matrix factored with row exchanges.
pub(super) struct DenseLu {
    /// Both factors, by rows, `[n, n]`.
    a: Vec<C>,
    n: usize,
    /// Row of the matrix in the place of each row of the factors.
    rows: Vec<usize>,
    odd: bool,
}

impl DenseLu {
    /// LU factors of the matrix `a` given by rows, `[n, n]`.
    pub fn new(mut a: Vec<C>, n: usize) -> Self {
        let mut rows: Vec<usize> = (0..n).collect();
        let mut odd = false;
        for k in 0..n {
            let best = (k..n).max_by(|&i, &j| a[i * n + k].norm_sqr().total_cmp(&a[j * n + k].norm_sqr())).unwrap_or(k);
            if best != k {
                (0..n).for_each(|j| a.swap(best * n + j, k * n + j));
                rows.swap(best, k);
                odd = !odd;
            }
            // A singular one is as good as singular.
            if a[k * n + k].norm_sqr() == 0.0 {
                a[k * n + k] = C::from(1e-300);
            }
            let inverse = a[k * n + k].inv();
            let (above, below) = a.split_at_mut((k + 1) * n);
            let pivot = &above[k * n + k + 1..];
            for row in below.chunks_exact_mut(n) {
                let factor = row[k] * inverse;
                row[k] = factor;
                if factor != C::default() {
                    row[k + 1..].iter_mut().zip(pivot).for_each(|(v, p)| *v -= factor * p);
                }
            }
        }
        Self { a, n, rows, odd }
    }

    /// ln det, its imaginary part up to a multiple of 2π.
    pub fn log_determinant(&self) -> C {
        let sign = if self.odd { C::new(0.0, PI) } else { C::default() };
        sign + (0..self.n).map(|k| self.a[k * self.n + k].ln()).sum::<C>()
    }

    /// The solution x of A x = `b`.
    pub fn solve(&self, b: &[C]) -> Vec<C> {
        let n = self.n;
        let mut x: Vec<C> = self.rows.iter().map(|&i| b[i]).collect();
        for i in 0..n {
            let sum: C = self.a[i * n..i * n + i].iter().zip(&x).map(|(a, x)| a * x).sum();
            x[i] -= sum;
        }
        for i in (0..n).rev() {
            let sum: C = self.a[i * n + i + 1..(i + 1) * n].iter().zip(&x[i + 1..]).map(|(a, x)| a * x).sum();
            x[i] = (x[i] - sum) / self.a[i * n + i];
        }
        x
    }

    /// tr(A⁻¹ B) of the matrix `b` given by rows.
    pub fn trace_of_solution(&self, b: &[C]) -> C {
        let n = self.n;
        let mut x: Vec<C> = Vec::with_capacity(n * n);
        self.rows.iter().for_each(|&i| x.extend_from_slice(&b[i * n..(i + 1) * n]));
        Arch::new().dispatch(Traced { lu: self, x: &mut x })
    }

    /// The vector of norm 1 that the matrix makes smallest, by inverse iteration.
    pub fn null_vector(&self) -> Vec<C> {
        let mut x: Vec<C> = (0..self.n).map(|i| C::from_polar(1.0, (i * i) as f64)).collect();
        for _ in 0..3 {
            x = self.solve(&x);
            let largest = x.iter().map(|v| v.norm()).fold(0.0, f64::max);
            x.iter_mut().for_each(|v| *v /= largest);
            let norm = x.iter().map(C::norm_sqr).sum::<f64>().sqrt();
            x.iter_mut().for_each(|v| *v /= norm);
        }
        x
    }
}

/// The trace of what the factors `lu` make of the rows `x`.
struct Traced<'a> {
    lu: &'a DenseLu,
    x: &'a mut [C],
}

impl WithSimd for Traced<'_> {
    type Output = C;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> C {
        let (n, a, x) = (self.lu.n, &self.lu.a, self.x);
        for k in 0..n {
            let (above, below) = x.split_at_mut((k + 1) * n);
            for (i, row) in below.chunks_exact_mut(n).enumerate() {
                subtract(a[(k + 1 + i) * n + k], &above[k * n..], row);
            }
        }
        let mut trace = C::default();
        for k in (0..n).rev() {
            let (above, below) = x.split_at_mut(k * n);
            let inverse = a[k * n + k].inv();
            below[..k + 1].iter_mut().for_each(|v| *v *= inverse);
            trace += below[k];
            // Of the rows above only what leads to the diagonal.
            for (i, row) in above.chunks_exact_mut(n).enumerate() {
                subtract(a[i * n + k], below, &mut row[..i + 1]);
            }
        }
        trace
    }
}

/// `out` −= `factor` x, over the length of `out`.
#[inline(always)]
fn subtract(factor: C, x: &[C], out: &mut [C]) {
    for (v, x) in out.iter_mut().zip(x) {
        v.re -= factor.re * x.re - factor.im * x.im;
        v.im -= factor.re * x.im + factor.im * x.re;
    }
}

/// Products of matrices that have blocks of their own: `out` += K G of matrices by columns, `[n, n]`, where G has
/// entries in `blocks` alone, each with its first row and its size.
pub(super) fn add_product((k, g): (&[C], &[C]), n: usize, blocks: &[[usize; 2]], out: &mut [C]) {
    Arch::new().dispatch(Product { k, g, n, blocks, out });
}

struct Product<'a> {
    k: &'a [C],
    g: &'a [C],
    n: usize,
    blocks: &'a [[usize; 2]],
    out: &'a mut [C],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let n = self.n;
        for [first, size] in self.blocks {
            let block = *first..first + size;
            for j in block.clone() {
                let out = &mut self.out[j * n..(j + 1) * n];
                for l in block.clone() {
                    subtract(-self.g[j * n + l], &self.k[l * n..(l + 1) * n], out);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_factored() {
        let n = 5;
        let a = |i: usize, j: usize| C::new(((3 * i + 7 * j) as f64).sin(), (2.0 * i as f64 - j as f64).cos());
        let flat = |f: &dyn Fn(usize, usize) -> C| (0..n * n).map(|k| f(k / n, k % n)).collect::<Vec<C>>();
        let lu = DenseLu::new(flat(&|i, j| a(i, j) + if i == (j + 1) % n { 2.0 } else { 0.0 }), n);
        let whole = faer::Mat::from_fn(n, n, |i, j| a(i, j) + if i == (j + 1) % n { 2.0 } else { 0.0 });
        assert!((lu.log_determinant().exp() - whole.determinant()).norm() < 1e-12 * whole.determinant().norm());
        assert!((lu.trace_of_solution(&flat(&|i, j| whole[(i, j)])) - 5.0).norm() < 1e-12);
        // The last column of a singular matrix is the sum of the others.
        let singular = |i: usize, j: usize| {
            let of = |j: usize| whole[(i, j)];
            if j + 1 == n {
                (0..n - 1).map(of).sum()
            } else {
                of(j)
            }
        };
        let x = DenseLu::new(flat(&singular), n).null_vector();
        assert!((1..n - 1).all(|i| (x[i] / x[0] - 1.0).norm() < 1e-10) && (x[n - 1] / x[0] + 1.0).norm() < 1e-10);
    }
}
