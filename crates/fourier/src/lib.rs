//! Fast Fourier transforms of rustfft and realfft, in double and in single precision.
//!
//! The libraries are generic: each crate that plans a transform compiles them anew, for every precision. Here that is
//! done once; in the program it took a fifth of each build, and another fifth of each build of its tests.

#![warn(missing_docs)]

use std::sync::Arc;

pub use realfft::{ComplexToReal, FftError, RealToComplex};
pub use rustfft::Fft;

use realfft::RealFftPlanner;
use rustfft::num_traits::{Float, NumAssign};
use rustfft::{FftNum, FftPlanner};

/// Numbers that transforms are made in: `f64` and `f32`.
pub trait Number: FftNum + Float + NumAssign {
    /// From `n` real numbers to the n/2 + 1 complex ones of their spectrum, unscaled.
    fn real_forward(n: usize) -> Arc<dyn RealToComplex<Self>>;
    /// From the n/2 + 1 complex numbers of a spectrum to `n` real ones, unscaled.
    fn real_inverse(n: usize) -> Arc<dyn ComplexToReal<Self>>;
    /// From `n` complex numbers to their spectrum, unscaled.
    fn forward(n: usize) -> Arc<dyn Fft<Self>>;
    /// From a spectrum to `n` complex numbers, unscaled.
    fn inverse(n: usize) -> Arc<dyn Fft<Self>>;
}

/// Never inlined: where such a function is inlined its planner is compiled again.
macro_rules! planned {
    ($($number:ty),*) => {$(
        impl Number for $number {
            #[inline(never)]
            fn real_forward(n: usize) -> Arc<dyn RealToComplex<Self>> {
                RealFftPlanner::new().plan_fft_forward(n)
            }
            #[inline(never)]
            fn real_inverse(n: usize) -> Arc<dyn ComplexToReal<Self>> {
                RealFftPlanner::new().plan_fft_inverse(n)
            }
            #[inline(never)]
            fn forward(n: usize) -> Arc<dyn Fft<Self>> {
                FftPlanner::new().plan_fft_forward(n)
            }
            #[inline(never)]
            fn inverse(n: usize) -> Arc<dyn Fft<Self>> {
                FftPlanner::new().plan_fft_inverse(n)
            }
        }
    )*};
}

planned!(f64, f32);

#[cfg(test)]
mod tests {
    use super::Number;
    use rustfft::num_complex::Complex;
    use rustfft::num_traits::NumCast;

    /// Forward and back is `n` times the numbers, and the spectrum of real numbers is half of that of the same as
    /// complex ones.
    fn agree<T: Number>(bound: f64) {
        for n in [12, 62, 128] {
            let given: Vec<T> = (0..n).map(|i| <T as NumCast>::from((i * i % 7) as f64 - 2.5).unwrap()).collect();
            let near =
                |a: T, b: T| assert!((a - b).to_f64().unwrap().abs() < bound * n as f64, "{a:?} is not {b:?} ({n})");
            let mut whole: Vec<_> = given.iter().map(|v| Complex::new(*v, T::zero())).collect();
            T::forward(n).process(&mut whole);
            let (mut line, mut half) = (given.clone(), vec![Complex::new(T::zero(), T::zero()); n / 2 + 1]);
            T::real_forward(n).process(&mut line, &mut half).unwrap();
            for (a, b) in half.iter().zip(&whole) {
                near(a.re, b.re);
                near(a.im, b.im);
            }
            T::inverse(n).process(&mut whole);
            T::real_inverse(n).process(&mut half, &mut line).unwrap();
            let times = <T as NumCast>::from(n).unwrap();
            for ((v, a), b) in given.iter().zip(&whole).zip(&line) {
                near(a.re, times * *v);
                near(*b, times * *v);
            }
        }
    }

    #[test]
    fn there_and_back_in_both_precisions() {
        agree::<f64>(1e-13);
        agree::<f32>(1e-5);
    }
}
