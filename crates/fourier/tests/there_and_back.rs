//! Transforms there and back. Beside the library, not in it: tests within it would compile all of rustfft again.

use fourier::Number;
use rustfft::num_complex::Complex;
use rustfft::num_traits::NumCast;

/// Forward and back is `n` times the numbers, and the spectrum of real numbers is half of that of the same as
/// complex ones.
fn agree<T: Number>(bound: f64) {
    for n in [12, 62, 128] {
        let given: Vec<T> = (0..n).map(|i| <T as NumCast>::from((i * i % 7) as f64 - 2.5).unwrap()).collect();
        let near = |a: T, b: T| assert!((a - b).to_f64().unwrap().abs() < bound * n as f64, "{a:?} is not {b:?} ({n})");
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
