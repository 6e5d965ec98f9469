//! Gauss–Legendre points of any number.

use std::f64::consts::PI;

/// Points, ascending, and weights on [−1, 1], `[count]`, exact to degree 2·count − 1: roots of the Legendre polynomial by Newton's method.
pub fn legendre(count: usize) -> Vec<(f64, f64)> {
    let root = |i: usize| {
        let mut x = -(PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos();
        // It doubles its digits each time, from two on.
        for _ in 0..6 {
            let (value, slope) = polynomial(count, x);
            x -= value / slope;
        }
        let (_, slope) = polynomial(count, x);
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(root).collect()
}

/// The Legendre polynomial of the degree `count` and its derivative at |x| < 1.
fn polynomial(count: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (0.0, 1.0);
    for k in 0..count {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0));
    }
    (value, count as f64 * (before - x * value) / (1.0 - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated() {
        for count in [1, 2, 3, 6, 16, 65] {
            let rule = legendre(count);
            assert!(rule.windows(2).all(|w| w[0].0 < w[1].0));
            for degree in 0..2 * count {
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                let wanted = if degree % 2 == 0 { 2.0 / (degree as f64 + 1.0) } else { 0.0 };
                assert!((sum - wanted).abs() < 1e-14, "{count} points, degree {degree}: {sum}");
            }
        }
    }
}
