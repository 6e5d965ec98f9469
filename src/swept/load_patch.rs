//! Small patches of a surface that carry loads.
//!
//! Weight ω(x, y) of the force 1: Hertz' pressure on a circle, 3/(2πb²) √(1 − r²/b²), r² = x² + y², or 1/(4ab) on a
//! rectangle, x and y from its middle. Loads ω π_m e_c with π = (1, x, y) along e_c = (x, y, n into the body) have the
//! number 3m + c; they are forces and moments on the patch, and the same means ⟨ω π_m, u_c⟩ are taken of displacements.

use super::Path;
use crate::quadrature::legendre;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Points in a part of an integral.
static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(8));

/// Points and weights for integrals over [a, b] by `panels` equal parts.
pub(super) fn points(a: f64, b: f64, panels: usize) -> Vec<(f64, f64)> {
    let half = 0.5 * (b - a) / panels as f64;
    let panel = |k: usize| {
        let middle = a + half * (2 * k + 1) as f64;
        RULE.iter().map(move |(x, w)| (middle + half * x, half * w))
    };
    (0..panels).flat_map(panel).collect()
}

/// Number of loads.
pub const LOADS: usize = 9;

/// A value for each pair of loads.
pub type Square = [[f64; LOADS]; LOADS];

/// ∫ω … dx with cos nθ, sin nθ, and the tilt of e_r and e_θ against the fixed axes: along, cos θ; tilt, sin θ.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Round {
    cos: f64,
    x_sin: f64,
    cos_along: f64,
    sin_tilt: f64,
    x_cos_tilt: f64,
    x_sin_along: f64,
}

impl Round {
    /// Displacements times the weight, for each load without the factor y, in (U, V, W): u_x = u_r sin θ + u_θ cos θ,
    /// u_z = u_r cos θ − u_θ sin θ, n = −z.
    pub(super) fn means(&self, n: usize) -> [[f64; 3]; 6] {
        let Round { cos, x_sin, cos_along, sin_tilt, x_cos_tilt, x_sin_along } = *self;
        if n == 0 {
            return [
                [0.0, cos_along, 0.0],
                [0.0, 0.0, cos],
                [-cos_along, 0.0, 0.0],
                [x_cos_tilt, 0.0, 0.0],
                [0.0; 3],
                [0.0, x_cos_tilt, 0.0],
            ];
        }
        [
            [sin_tilt, -cos_along, 0.0],
            [0.0, 0.0, cos],
            [-cos_along, sin_tilt, 0.0],
            [x_cos_tilt, x_sin_along, 0.0],
            [0.0, 0.0, x_sin],
            [-x_sin_along, -x_cos_tilt, 0.0],
        ]
    }
}

/// The patch that carries a load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadPatch {
    /// A circle of the radius b about the contact point, under Hertz' pressure.
    Circle {
        /// Its radius, m.
        radius: f64,
    },
    /// A rectangle under an even pressure, whose middle is beside the contact point along y.
    Rectangle {
        /// Half its sides a along x and b along y, m.
        half: [f64; 2],
        /// y of its middle, m.
        middle: f64,
    },
}

impl LoadPatch {
    /// Half of its extent along x and y, m.
    pub fn half(&self) -> [f64; 2] {
        match *self {
            Self::Circle { radius } => [radius; 2],
            Self::Rectangle { half, .. } => half,
        }
    }

    /// Half of its shorter extent, m.
    pub fn shorter(&self) -> f64 {
        let [a, b] = self.half();
        a.min(b)
    }

    /// y of its middle, m.
    pub fn middle(&self) -> f64 {
        match *self {
            Self::Circle { .. } => 0.0,
            Self::Rectangle { middle, .. } => middle,
        }
    }

    /// A patch about the same middle that is longer and wider by the factor `by`.
    pub fn times(&self, by: f64) -> Self {
        match *self {
            Self::Circle { radius } => Self::Circle { radius: by * radius },
            Self::Rectangle { half, middle } => Self::Rectangle { half: half.map(|a| by * a), middle },
        }
    }

    /// ∫ over x at the place y of ω times what [`Round`] names, of the order `n` on the rolling radius `radius`, m,
    /// or on a straight line of the period 2π `radius`.
    pub(super) fn round(&self, n: usize, (radius, path): (f64, Path), y: f64) -> Round {
        let n = n as f64;
        let mut round = Round::default();
        let mut add = |x: f64, weight: f64| {
            let (theta, (tilt, along)) = match path {
                Path::Axle => ((x / radius).asin(), (x / radius).asin().sin_cos()),
                Path::Line(_) => (x / radius, (0.0, 1.0)),
            };
            let (sin, cos) = (n * theta).sin_cos();
            round.cos += weight * cos;
            round.x_sin += weight * x * sin;
            round.cos_along += weight * cos * along;
            round.sin_tilt += weight * sin * tilt;
            round.x_cos_tilt += weight * x * cos * tilt;
            round.x_sin_along += weight * x * sin * along;
        };
        match *self {
            Self::Circle { radius: b } => {
                let c = (b * b - y * y).max(0.0).sqrt();
                // x = c sin φ: periodic in φ, so equal steps converge faster than any power.
                let steps = 16 + (n * c / radius).ceil() as usize;
                let unit = 1.5 * c * c / (b * b * b) / steps as f64;
                for i in 0..steps {
                    let phi = PI * i as f64 / steps as f64;
                    add(c * phi.sin(), unit * phi.cos().powi(2));
                }
            }
            // One half of it stands for both.
            Self::Rectangle { half: [a, b], .. } => {
                for (x, step) in points(0.0, a, 1 + (0.2 * n * a / radius) as usize) {
                    add(x, 0.5 * step / (a * b));
                }
            }
        }
        round
    }

    /// Γ: ∫∫ω π_m² of each load about the middle, 1 or m².
    pub fn moments(&self) -> [f64; LOADS] {
        let squares = match *self {
            Self::Circle { radius } => [radius * radius / 5.0; 2],
            Self::Rectangle { half, .. } => half.map(|a| a * a / 3.0),
        };
        std::array::from_fn(|k| if k < 3 { 1.0 } else { squares[k / 3 - 1] })
    }

    /// The coefficients of the functions 1, x and y of the contact point that have these means on the patch: Γ⁻¹ times
    /// the means, with y counted from the contact point in place of the middle.
    pub fn functions(&self, means: &[f64; LOADS]) -> [f64; LOADS] {
        let moments = self.moments();
        let mut all: [f64; LOADS] = std::array::from_fn(|k| means[k] / moments[k]);
        (0..3).for_each(|c| all[c] -= self.middle() * all[6 + c]);
        all
    }

    /// F = ∫∫ω e^{−ik·x} about the middle of a wave k = (k_x, k_y), 1/m, and its derivatives by k_x and k_y, m: on a
    /// circle 3 j1(s)/s, s = κb, on a rectangle j0(k_x a) j0(k_y b).
    pub(super) fn transform(&self, wave: [f64; 2]) -> [f64; 3] {
        match *self {
            Self::Circle { radius } => {
                let [x, y] = wave.map(|k| radius * k);
                let q = x * x + y * y;
                let s = q.sqrt();
                // F and F′(s)/s.
                let [f, slope] = if s < 0.05 {
                    [1.0 - q / 10.0 * (1.0 - q / 28.0), -0.2 * (1.0 - q / 14.0)]
                } else {
                    let f = 3.0 * (s.sin() / s - s.cos()) / q;
                    [f, (3.0 * s.sin() / s - 3.0 * f) / q]
                };
                [f, radius * slope * x, radius * slope * y]
            }
            Self::Rectangle { half, .. } => {
                let side = |c: usize| {
                    let s = wave[c] * half[c];
                    match s.abs() < 0.05 {
                        true => [1.0 - s * s / 6.0 * (1.0 - s * s / 20.0), -s / 3.0 * (1.0 - s * s / 10.0) * half[c]],
                        false => [s.sin() / s, (s.cos() - s.sin() / s) / s * half[c]],
                    }
                };
                let ([f, along], [g, across]) = (side(0), side(1));
                [f * g, along * g, f * across]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_load_is_that_of_the_bessel_function() {
        let patch = LoadPatch::Circle { radius: 2.0 };
        // ∫ω cos kx dx = (3/2b³) c J1(kc)/k; on a large radius nθ = kx. J1(1.2) = 0.498289057567216, J1(30) =
        // −0.118751062616623.
        for (k, y, bessel) in [(0.75, 1.2, 0.498_289_057_567_216), (18.75, 1.2, -0.118_751_062_616_623)] {
            let wanted = 1.5 / 8.0 * 1.6 * bessel / k;
            let round = patch.round((k * 1e6) as usize, (1e6, Path::Axle), y);
            assert!((round.cos - wanted).abs() < 1e-10, "{} {wanted}", round.cos);
            assert!((round.cos_along - wanted).abs() < 1e-10 && round.sin_tilt.abs() < 1e-5);
        }
        let sum = |f: &dyn Fn(f64) -> f64| points(-2.0, 2.0, 4).into_iter().map(|(y, w)| w * f(y)).sum::<f64>();
        let total = sum(&|y| patch.round(0, (1e6, Path::Axle), y).cos);
        let second = sum(&|y| y * y * patch.round(0, (1e6, Path::Axle), y).cos);
        assert!((total - 1.0).abs() < 1e-13 && (second - patch.moments()[8]).abs() < 1e-13, "{total} {second}");
    }

    /// The moments of a rectangle are those of its weight; both ways to a transform have its slopes.
    #[test]
    fn a_patch_has_its_moments_and_its_transform() {
        let slender = LoadPatch::Rectangle { half: [2.0, 0.5], middle: 0.3 };
        let sum = |f: &dyn Fn(f64, Round) -> f64| -> f64 {
            let round = |y: f64| slender.round(1, (1e6, Path::Axle), y);
            points(-0.2, 0.8, 4).into_iter().map(|(y, w)| w * f(y - 0.3, round(y))).sum()
        };
        let [total, across, along] = [sum(&|_, r| r.cos), sum(&|y, r| y * y * r.cos), 1e6 * sum(&|_, r| r.x_sin)];
        let moments = slender.moments();
        assert!((total - 1.0).abs() < 1e-11 && (across - moments[6]).abs() < 1e-11, "{total} {across}");
        assert!((along - moments[3]).abs() < 1e-9, "{along}");
        // u = 4 + 5x + 6y has the means 4 + 6 · 0.3, 5 a²/3 and 6 b²/3.
        let means =
            std::array::from_fn(|k| if k % 3 == 0 { [5.8, 5.0 * moments[3], 6.0 * moments[6]][k / 3] } else { 0.0 });
        let found = slender.functions(&means);
        assert!((0..3).all(|m| (found[3 * m] - [4.0, 5.0, 6.0][m]).abs() < 1e-14), "{found:?}");
        for patch in [slender, LoadPatch::Circle { radius: 2.0 }] {
            // On either side of s = 0.05.
            for wave in [[0.0124, 0.02], [0.0251, 0.101], [0.0249, 0.099], [0.7, 0.4], [0.2, 3.0]] {
                let at = patch.transform(wave);
                for c in 0..2 {
                    let [low, high] = [-1e-4, 1e-4].map(|d| {
                        let mut moved = wave;
                        moved[c] += d;
                        patch.transform(moved)[0]
                    });
                    assert!((at[c + 1] - (high - low) / 2e-4).abs() < 1e-6, "{wave:?} {at:?}");
                }
            }
        }
    }
}
