//! Bessel functions of the first kind.

/// J_0(x) … J_last(x), x ≥ 0, by downward recurrence (J. C. P. Miller), small ones to the same number of digits as
/// large ones.
pub fn bessel(last: usize, x: f64) -> Vec<f64> {
    let mut values = vec![0.0; last + 1];
    if x == 0.0 {
        values[0] = 1.0;
        return values;
    }
    // From an order at which the function is smaller than at those wanted by all digits of a number.
    let top = last.max(x.ceil() as usize);
    let start = 2 * ((top + 20 + (40.0 * top as f64).sqrt() as usize) / 2);
    let (mut above, mut here, mut sum) = (0.0, 1e-300, 0.0);
    for n in (0..=start).rev() {
        if n <= last {
            values[n] = here;
        }
        if n % 2 == 0 {
            sum += if n == 0 { here } else { 2.0 * here };
        }
        if n > 0 {
            (above, here) = (here, 2.0 * n as f64 / x * here - above);
        }
        if here.abs() > 1e150 {
            (above, here, sum) = (above * 1e-300, here * 1e-300, sum * 1e-300);
            values.iter_mut().for_each(|v| *v *= 1e-300);
        }
    }
    // J_0 + 2 (J_2 + J_4 + …) = 1.
    values.iter_mut().for_each(|v| *v /= sum);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// J_n(x) = 1/π ∫ cos(nφ − x sin φ) dφ from 0 to π, whose mean over equal steps converges faster than any power;
    /// small arguments by the series.
    #[test]
    fn they_are_those_of_bessels_integral() {
        for x in [1e-9, 0.01, 0.3, 1.0, 7.5, 30.0, 101.3] {
            let found = bessel(14, x);
            for (n, found) in found.iter().enumerate() {
                let steps = 400;
                let at = |k: usize| {
                    let phi = PI * (k as f64 + 0.5) / steps as f64;
                    (n as f64 * phi - x * phi.sin()).cos()
                };
                let wanted = (0..steps).map(at).sum::<f64>() / steps as f64;
                assert!((found - wanted).abs() < 2e-14, "J_{n}({x}): {found}, expected {wanted}");
            }
        }
        let factorial: f64 = (1..=9).map(f64::from).product();
        let x: f64 = 0.02;
        let wanted = (0.5 * x).powi(9) / factorial * (1.0 - 0.25 * x * x / 10.0);
        assert!((bessel(12, x)[9] / wanted - 1.0).abs() < 1e-9);
    }
}
