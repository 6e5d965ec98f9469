//! Hertz' contact of two surfaces with given curvatures, with exact elliptic integrals.

use crate::{Error, Result};
use std::f64::consts::PI;

/// Largest ratio of the semi-axes for which a contact counts as that of a point.
const MAX_ELONGATION: f64 = 50.0;

/// Load that presses two surfaces together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HertzLoad {
    /// Normal force, N.
    Force(f64),
    /// Approach, m.
    Approach(f64),
}

/// The ellipse of Hertz' contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Semi-axes, m: a, the one that is nearer to x, and b.
    pub semi_axes: [f64; 2],
    /// Angle from x to the axis of a, towards y, rad, within ±π/4.
    pub angle: f64,
    /// Largest pressure, Pa.
    pub pressure: f64,
    /// Normal force, N.
    pub force: f64,
    /// Approach of the bodies as half-spaces, m.
    pub approach: f64,
}

impl Ellipse {
    /// The contact of two surfaces whose gap is ½ (x, y) H (x, y)ᵀ, `relative` = H in 1/m, with the contact modulus
    /// E* (Pa), 1/E* = Σ (1 − ν²)/E (K. L. Johnson, Contact Mechanics, 1985, section 4.2, eqs. 4.25 to 4.28).
    ///
    /// ```
    /// use railsqueal::placement::{Ellipse, HertzLoad};
    ///
    /// // Two steel balls with radii of 0.5 m under 70 kN, E* = 115.4 GPa.
    /// let ellipse = Ellipse::new([[4.0, 0.0], [0.0, 4.0]], 115.4e9, HertzLoad::Force(70e3))?;
    /// assert!((ellipse.semi_axes[0] - 4.845e-3).abs() < 1e-5);
    /// assert!((ellipse.pressure - 1.424e9).abs() < 5e6);
    /// # Ok::<(), railsqueal::Error>(())
    /// ```
    ///
    /// # Errors
    /// Surfaces that fit each other so closely that there is no ellipse, or one more than 50 times as long as wide; a
    /// load that is not positive.
    pub fn new(relative: [[f64; 2]; 2], modulus: f64, press: HertzLoad) -> Result<Self> {
        let (value, unit) = match press {
            HertzLoad::Force(v) => (v, "N"),
            HertzLoad::Approach(v) => (v, "m"),
        };
        if !(value > 0.0 && value.is_finite() && modulus > 0.0) {
            return Err(Error::Job(format!("Hertz' contact: found a load of {value} {unit}, expected a positive one")));
        }
        let mean = 0.5 * (relative[0][0] + relative[1][1]);
        let half = 0.5 * (relative[0][0] - relative[1][1]);
        let shear = 0.5 * (relative[0][1] + relative[1][0]);
        let spread = half.hypot(shear);
        let [low, high] = [0.5 * (mean - spread), 0.5 * (mean + spread)];
        if !(low > 0.0) {
            return Err(Error::Job(format!(
                "placement: wheel and rail fit each other at the point of contact: found the relative \
                 curvatures {:.4} and {:.4} 1/m, expected \
                 both to be positive, as at a point contact; move the wheel, or check that both profiles are \
                 bent the right way",
                2.0 * low,
                2.0 * high
            )));
        }
        let (ratio, k_integral, d_integral) = shape(high / low)?;
        // p0 = E* A a / (k D) with the long semi-axis a, the short one k a, A the smaller of the two half curvatures
        // and D = (K − E)/m.
        let long = match press {
            HertzLoad::Force(f) => (1.5 * f * d_integral / (PI * low * modulus)).cbrt(),
            HertzLoad::Approach(d) => (d * d_integral / (low * k_integral)).sqrt(),
        };
        let pressure = modulus * low * long / (ratio * d_integral);
        let short = ratio * long;
        // The gap grows least along the long axis, whose direction is that of the smaller curvature.
        let direction = 0.5 * f64::atan2(-shear, -half);
        let swap = direction.abs() > 0.25 * PI;
        let (semi_axes, angle) = match swap {
            false => ([long, short], direction),
            true => ([short, long], direction - 0.5 * PI * direction.signum()),
        };
        let (force, approach) = (2.0 / 3.0 * PI * pressure * long * short, pressure / modulus * short * k_integral);
        Ok(Self { semi_axes, angle, pressure, force, approach })
    }

    /// Half of the extent along x and along y of the ellipse, m.
    pub fn extent(&self) -> [f64; 2] {
        let ([a, b], (s, c)) = (self.semi_axes, self.angle.sin_cos());
        [(a * c).hypot(b * s), (a * s).hypot(b * c)]
    }
}

/// Axis ratio k = short/long of the ellipse of two half curvatures with B/A = `curvatures` ≥ 1, and the complete
/// elliptic integrals K and D = (K − E)/m at m = 1 − k²: B/A = (K − D)/(k² D).
fn shape(curvatures: f64) -> Result<(f64, f64, f64)> {
    let of = |k: f64| {
        let (first, d) = elliptic(k);
        (first - d) / (k * k * d)
    };
    let (mut low, mut high) = ((1.0 / MAX_ELONGATION).ln(), 0.0);
    if !(curvatures <= of(f64::exp(low))) {
        return Err(Error::Job(format!(
            "placement: wheel and rail fit each other so closely at the point of contact that the contact would \
             be more than {MAX_ELONGATION} \
             times as long as wide: found relative curvatures in the ratio {curvatures:.1}; move the wheel or \
             check the profiles"
        )));
    }
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) {
            break;
        }
        if of(f64::exp(middle)) > curvatures {
            low = middle;
        } else {
            high = middle;
        }
    }
    let k = f64::exp(0.5 * (low + high));
    let (first, d) = elliptic(k);
    Ok((k, first, d))
}

/// Complete elliptic integrals K(m) and D(m) = (K − E)/m at m = 1 − k², by the arithmetic–geometric mean (Abramowitz
/// & Stegun 17.6), D without cancellation at m → 0.
fn elliptic(k: f64) -> (f64, f64) {
    let m = (1.0 - k) * (1.0 + k);
    let (mut a, mut b) = (1.0, k);
    // Σ 2^(n−1) c_n²/m, where c_0² = m and c_1²/m = (1 − k)/(4 (1 + k)).
    let mut sum = 0.5;
    let mut power = 1.0;
    for n in 1..40 {
        let c = 0.5 * (a - b);
        sum += power * if n == 1 { (1.0 - k) / (4.0 * (1.0 + k)) } else { c * c / m.max(f64::MIN_POSITIVE) };
        power *= 2.0;
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        if c.abs() < 1e-17 {
            break;
        }
    }
    let first = 0.5 * PI / a;
    (first, first * sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elliptic_integrals_are_those_of_quadrature() {
        for k in [1.0, 1.0 - 1e-9, 0.9, 0.3, 0.02] {
            let (first, d) = elliptic(k);
            let n = 20_000;
            let (mut want, mut want_d) = (0.0, 0.0);
            for i in 0..n {
                let s = ((i as f64 + 0.5) * 0.5 * PI / n as f64).sin();
                let root = (1.0 - (1.0 - k * k) * s * s).sqrt();
                want += 0.5 * PI / n as f64 / root;
                want_d += 0.5 * PI / n as f64 * s * s / root;
            }
            assert!(
                (first / want - 1.0).abs() < 1e-9 && (d / want_d - 1.0).abs() < 1e-9,
                "{k}: {first} {want} {d} {want_d}"
            );
        }
    }

    #[test]
    fn a_circle_is_that_of_hertz() {
        // Two bodies of R = 0.5 m, 70 kN, E* = 112.64 GPa: a = 4.884 mm, 1401.0 MPa, 95.43 µm.
        let modulus = 205e9 / 2.0 / 0.91;
        let found = Ellipse::new([[4.0, 0.0], [0.0, 4.0]], modulus, HertzLoad::Force(70e3)).unwrap();
        for axis in found.semi_axes {
            assert!((axis - 4.884e-3).abs() < 1e-6);
        }
        assert!((found.pressure - 1401.0e6).abs() < 0.1e6 && (found.approach - 95.43e-6).abs() < 0.01e-6);
    }

    /// The pressure p0 √(1 − x²/a² − y²/b²) must press the surface to the shape it is for: checked by Boussinesq's
    /// integral.
    #[test]
    fn an_ellipse_presses_the_half_space_to_its_curvatures() {
        let (h, modulus) = ([[3.0, 0.0], [0.0, 11.0]], 100e9);
        let found = Ellipse::new(h, modulus, HertzLoad::Force(20e3)).unwrap();
        let [a, b] = found.semi_axes;
        // Sum of the displacements of both bodies at a point: 1/(π E*) ∫ p/r, in polar coordinates about the point,
        // where the singularity is gone.
        let sunk = |x: f64, y: f64| {
            let (n, mut sum) = (4000, 0.0);
            for i in 0..n {
                let (s, c) = (2.0 * PI * (i as f64 + 0.5) / n as f64).sin_cos();
                // Along the ray the pressure is p0 √(A − 2 B r − C r²), over the part inside the ellipse.
                let big = 1.0 - (x / a).powi(2) - (y / b).powi(2);
                let mixed = x * c / (a * a) + y * s / (b * b);
                let square = (c / a).powi(2) + (s / b).powi(2);
                // ∫ from r = 0 to the edge = ½ (Q (π/2 − asin t) ... ) with u = √C r + B/√C.
                let start = mixed / square.sqrt();
                let q = (big + start * start).sqrt();
                let integral =
                    0.5 * (q * q * (0.5 * PI - (start / q).asin()) - start * big.max(0.0).sqrt()) / square.sqrt();
                sum += integral * 2.0 * PI / n as f64;
            }
            found.pressure * sum / (PI * modulus)
        };
        for (u, v) in [(0.0, 0.0), (0.6, 0.0), (0.0, 0.7), (0.4, -0.5)] {
            let (x, y) = (u * a, v * b);
            let gap = 0.5 * (h[0][0] * x * x + h[1][1] * y * y);
            assert!((sunk(x, y) + gap - found.approach).abs() < 1e-6 * found.approach, "{u} {v}: {}", sunk(x, y) + gap);
        }
        assert!((found.force - 20e3).abs() < 1e-6);
        let again = Ellipse::new(h, modulus, HertzLoad::Approach(found.approach)).unwrap();
        assert!((again.force / found.force - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_turned_ellipse_and_bad_ones() {
        let (s, c) = 0.3_f64.sin_cos();
        let turned = |low: f64, high: f64| {
            let d = low - high;
            [[low * c * c + high * s * s, d * s * c], [d * s * c, low * s * s + high * c * c]]
        };
        let straight = Ellipse::new([[2.0, 0.0], [0.0, 9.0]], 1e11, HertzLoad::Force(1e4)).unwrap();
        let found = Ellipse::new(turned(2.0, 9.0), 1e11, HertzLoad::Force(1e4)).unwrap();
        assert!((found.angle - 0.3).abs() < 1e-14 && straight.angle == 0.0);
        assert!(
            (found.semi_axes[0] / straight.semi_axes[0] - 1.0).abs() < 1e-12 && found.semi_axes[0] > found.semi_axes[1]
        );
        let across = Ellipse::new(turned(9.0, 2.0), 1e11, HertzLoad::Force(1e4)).unwrap();
        assert!((across.angle - 0.3).abs() < 1e-14 && across.semi_axes[0] < across.semi_axes[1]);
        for relative in [[[2.0, 0.0], [0.0, -0.1]], [[2.0, 0.0], [0.0, 1e-4]]] {
            let error = Ellipse::new(relative, 1e11, HertzLoad::Force(1e4)).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains("fit each other"), "{error}");
        }
        assert!(Ellipse::new([[2.0, 0.0], [0.0, 2.0]], 1e11, HertzLoad::Force(0.0)).is_err());
    }
}
