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
