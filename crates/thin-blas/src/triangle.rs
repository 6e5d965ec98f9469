//! X = op(A)⁻¹ B for an upper triangle A with a unit diagonal and eight columns, whose rows lie side by side.

use pulp::x86::V3;
use pulp::{Simd, WithSimd};

use crate::kernel::{dots, row, spread, Row, COLUMNS, GROUP};

/// Largest order that is solved at once: the triangle stays in the first-level cache.
pub(crate) const LARGEST: usize = 64;

/// B becomes op(A)⁻¹ B, with A of order `b.len()`.
pub(crate) struct Triangle<'a> {
    pub simd: V3,
    /// op(A) is Aᵀ, a lower triangle.
    pub transposed: bool,
    /// Column by column; only what is above the diagonal is read.
    pub a: &'a [f64],
    pub stride: usize,
    pub b: &'a mut [[f64; COLUMNS]],
}

/// `target` −= `factor` `other`.
#[inline(always)]
fn take(simd: V3, target: &mut [f64; COLUMNS], factor: f64, other: &[f64; COLUMNS]) {
    let factor = simd.splat_f64s(-factor);
    let mut sums = row(target);
    sums.iter_mut().zip(row(other)).for_each(|(s, v)| *s = simd.mul_add_f64s(factor, v, *s));
    *target = pulp::cast(sums);
}

impl Triangle<'_> {
    pub(crate) fn solve(self) {
        Simd::vectorize(self.simd, self);
    }

    /// From the top down: each row less what the rows before it give, some rows at a time.
    #[inline(always)]
    fn forward(self) {
        let Self { simd, a, stride, b, .. } = self;
        for first in (0..b.len()).step_by(GROUP) {
            let (known, new) = b.split_at_mut(first);
            let width = GROUP.min(new.len());
            let new = &mut new[..width];
            let columns = &a[first * stride..];
            if new.len() == GROUP {
                less(simd, new, &dots::<GROUP>(simd, columns, stride, known));
            } else {
                for (i, row) in new.iter_mut().enumerate() {
                    less(simd, std::slice::from_mut(row), &dots::<1>(simd, &columns[i * stride..], stride, known));
                }
            }
            for i in 1..new.len() {
                let (before, own) = new.split_at_mut(i);
                let column = &columns[i * stride + first..];
                before.iter().zip(column).for_each(|(other, v)| take(simd, &mut own[0], *v, other));
            }
        }
    }

    /// From the bottom up: what some rows give is taken off all above them.
    #[inline(always)]
    fn backward(self) {
        let Self { simd, a, stride, b, .. } = self;
        let mut end = b.len();
        while end > 0 {
            let first = end.saturating_sub(GROUP);
            let (above, own) = b.split_at_mut(first);
            let own = &mut own[..end - first];
            for j in (1..own.len()).rev() {
                let (before, this) = own.split_at_mut(j);
                let column = &a[(first + j) * stride + first..];
                before.iter_mut().zip(column).for_each(|(other, v)| take(simd, other, *v, &this[0]));
            }
            if first > 0 {
                let less: [[f64; COLUMNS]; GROUP] = std::array::from_fn(|j| own[j].map(|v| -v));
                let next = first.saturating_sub(GROUP) * stride;
                spread::<GROUP>(simd, a, first * stride, stride, next, &less, above);
            }
            end = first;
        }
    }
}

/// `rows` −= `sums`.
#[inline(always)]
fn less(simd: V3, rows: &mut [[f64; COLUMNS]], sums: &[Row]) {
    for (target, sum) in rows.iter_mut().zip(sums) {
        let mut now = row(target);
        now.iter_mut().zip(sum).for_each(|(v, s)| *v = simd.sub_f64s(*v, *s));
        *target = pulp::cast(now);
    }
}

impl WithSimd for Triangle<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        match self.transposed {
            true => self.forward(),
            false => self.backward(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::tests::numbers;

    /// Against the definition, op(A) X = B, of all orders that are solved at once; below the diagonal and on it is what nobody reads.
    #[test]
    fn solutions_are_those_of_the_definition() {
        let Some(simd) = V3::try_new() else { return };
        for order in 1..=LARGEST {
            for transposed in [false, true] {
                let stride = order + order % 3 * 7;
                let size = stride * (order - 1) + order;
                let mut a: Vec<f64> = numbers(size, 1).iter().map(|v| v / order as f64).collect();
                for j in 0..order {
                    a[j * stride + j..j * stride + order].fill(f64::NAN);
                }
                let mut x = vec![[0.0; COLUMNS]; order];
                x.iter_mut().zip(numbers(COLUMNS * order, 2).chunks(COLUMNS)).for_each(|(x, n)| x.copy_from_slice(n));
                let at = |i: usize, j: usize| match (i.cmp(&j), transposed) {
                    (std::cmp::Ordering::Equal, _) => 1.0,
                    (std::cmp::Ordering::Less, false) => a[j * stride + i],
                    (std::cmp::Ordering::Greater, true) => a[i * stride + j],
                    _ => 0.0,
                };
                let product = |i: usize, k: usize| (0..order).map(|j| at(i, j) * x[j][k]).sum::<f64>();
                let mut b: Vec<[f64; COLUMNS]> = (0..order).map(|i| std::array::from_fn(|k| product(i, k))).collect();
                Triangle { simd, transposed, a: &a, stride, b: &mut b }.solve();
                for (own, right) in b.iter().flatten().zip(x.iter().flatten()) {
                    assert!((own - right).abs() < 1e-13, "{order} {transposed}: {own} for {right}");
                }
            }
        }
    }
}
