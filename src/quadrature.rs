//! Points and weights of integrals over lines and triangles.

use std::f64::consts::PI;

/// Two points of Gauss and Legendre on [−1, 1] and their weights, exact to degree 3.
pub const GAUSS_2: [(f64, f64); 2] = [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];

/// Three points of Gauss and Legendre on [−1, 1] and their weights, exact to degree 5.
pub const GAUSS_3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
    (0.0, 0.888_888_888_888_889),
    (0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
];

/// Points of Gauss and Legendre, ascending, and weights on [−1, 1], `[count]`, exact to degree 2·count − 1: roots of
/// the Legendre polynomial by Newton's method.
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

/// Six points in the triangle (0, 0), (1, 0), (0, 1) and their weights, exact to degree 4. G. R. Cowper, Int. J.
/// Numer. Meth. Engng 7 (1973) 405–408, in closed form.
pub fn triangle_6() -> Vec<([f64; 2], f64)> {
    let root = 10f64.sqrt();
    let spread = (38.0 - 44.0 * 0.4f64.sqrt()).sqrt();
    let part = (213_125.0 - 53_320.0 * root).sqrt();
    let mut points = Vec::with_capacity(6);
    for sign in [1.0, -1.0] {
        let a = (8.0 - root + sign * spread) / 18.0;
        let w = 0.5 * (620.0 + sign * part) / 3720.0;
        let b = 1.0 - 2.0 * a;
        points.extend([[a, a], [b, a], [a, b]].map(|p| (p, w)));
    }
    points
}

/// Seven points in that triangle and their weights, exact to degree 5 (J. Radon, Monatshefte für Mathematik und
/// Physik 52 (1948) 286).
pub fn triangle_7() -> Vec<([f64; 2], f64)> {
    let root = 15f64.sqrt();
    let mut points = vec![([1.0 / 3.0; 2], 9.0 / 80.0)];
    for (a, weight) in [((6.0 - root) / 21.0, (155.0 - root) / 2400.0), ((6.0 + root) / 21.0, (155.0 + root) / 2400.0)]
    {
        let b = 1.0 - 2.0 * a;
        points.extend([[a, a], [b, a], [a, b]].map(|at| (at, weight)));
    }
    points
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
    fn the_tables_are_those_of_legendre() {
        let both = GAUSS_2.iter().zip(legendre(2)).chain(GAUSS_3.iter().zip(legendre(3)));
        for (own, other) in both {
            assert!((own.0 - other.0).abs() < 1e-15 && (own.1 - other.1).abs() < 1e-15, "{own:?} {other:?}");
        }
    }

    /// ∫ x^p y^q over the triangle is p! q!/(p + q + 2)!.
    #[test]
    fn polynomials_on_the_triangle_are_integrated() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for (rule, degree) in [(triangle_6(), 4), (triangle_7(), 5)] {
            for p in 0..=degree {
                for q in 0..=degree - p {
                    let sum: f64 = rule.iter().map(|([x, y], w)| w * x.powi(p) * y.powi(q)).sum();
                    let wanted = factorial(p) * factorial(q) / factorial(p + q + 2);
                    assert!((sum - wanted).abs() < 1e-15, "{} points, x^{p} y^{q}: {sum}, {wanted}", rule.len());
                }
            }
        }
    }

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
