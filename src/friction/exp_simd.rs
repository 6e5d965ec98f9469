//! e^(−x) and 1 − e^(−x) for many x ≥ 0 at once, in the widest vector instructions of the processor at hand: the
//! contact nodes of a time step ask for them by hundreds, one by one at ten times the cost.

use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::LOG2_E;

/// Numbers that are taken together.
const LANES: usize = 16;
/// ln 2 in two parts, the first with zeros at its end (as in Sun's fdlibm).
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
/// Added to a number, it leaves the nearest integer in the last digits.
const INTEGER: f64 = 6_755_399_441_055_744.0;
/// Argument beyond which e^(−x) is smaller than any sum notices.
const FAR: f64 = 708.0;
/// Below it the series of 1 − e^(−x), above it the difference.
const NEAR: f64 = 0.1;

/// 1/n! from n = 0 on.
pub(super) const INVERSE_FACTORIALS: [f64; 14] = [
    1.0,
    1.0,
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// Each x becomes e^(−x), which beyond 708 is as at 708.
pub(super) fn left(x: &mut [f64]) {
    Arch::new().dispatch(Each(x, decayed));
}

/// Each x becomes 1 − e^(−x), small ones without loss of digits.
pub(super) fn lapsed(x: &mut [f64]) {
    Arch::new().dispatch(Each(x, gone));
}

struct Each<'a, F>(&'a mut [f64], F);

impl<F: Fn(f64) -> f64> WithSimd for Each<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut chunks = self.0.chunks_exact_mut(LANES);
        for chunk in &mut chunks {
            for v in chunk {
                *v = (self.1)(*v);
            }
        }
        for v in chunks.into_remainder() {
            *v = (self.1)(*v);
        }
    }
}

/// e^(−x) = 2^(−k) e^r, r = k ln 2 − x.
#[inline(always)]
fn decayed(x: f64) -> f64 {
    let x = if x > FAR { FAR } else { x };
    let shifted = x * LOG2_E + INTEGER;
    let k = shifted - INTEGER;
    let r = (k * LN_2[0] - x) + k * LN_2[1];
    let pair = |n: usize| INVERSE_FACTORIALS[n] + r * INVERSE_FACTORIALS[n + 1];
    let (square, fourth) = (r * r, (r * r) * (r * r));
    let high = pair(8) + square * pair(10) + fourth * pair(12);
    let sum = square * pair(2) + fourth * (pair(4) + square * pair(6) + fourth * high);
    (1.0 + (r + sum)) * f64::from_bits(1023u64.wrapping_sub(shifted.to_bits()) << 52)
}

#[inline(always)]
fn gone(x: f64) -> f64 {
    let far = 1.0 - decayed(x);
    // The next term is below 1e-17 of it. By pairs, which do not wait for each other.
    let pair = |n: usize| INVERSE_FACTORIALS[n + 1] - x * INVERSE_FACTORIALS[n + 2];
    let (square, fourth) = (x * x, (x * x) * (x * x));
    let near = x * ((pair(0) + square * pair(2)) + fourth * (pair(4) + square * pair(6) + fourth * pair(8)));
    if x > NEAR {
        far
    } else {
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_are_right_to_the_last_digits() {
        let mut all = vec![0.0, 1e-300, 1e-12, 0.0999999, 0.1, 0.1000001, 0.34, 0.35, 1.0, 36.0, 700.0, 707.9];
        all.extend((0..4000).map(|k| 1e-4 * 1.0047_f64.powi(k)).filter(|x| *x < 700.0));
        let (mut e, mut l) = (all.clone(), all.clone());
        left(&mut e);
        lapsed(&mut l);
        for ((x, e), l) in all.iter().zip(e).zip(l) {
            let want = (-x).exp();
            assert!((e - want).abs() <= 4.5e-16 * want, "{x}: {e} against {want}");
            let want = -(-x).exp_m1();
            assert!((l - want).abs() <= 4e-15 * want, "{x}: {l} against {want}");
        }
        let mut last = [f64::INFINITY, f64::NAN, 1e300];
        lapsed(&mut last);
        assert!(last[0] == 1.0 && last[1].is_nan() && last[2] == 1.0, "{last:?}");
        left(&mut last[..1]);
        assert!((last[0] - (-1.0f64).exp()).abs() < 1e-16);
    }
}
