//! Given shapes: a flat of a wheel, a dipped joint, a step.

use std::f64::consts::PI;

/// A shape about its middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RoughnessShape {
    /// Waves of one length, from s = 0.
    Wave {
        /// m.
        length: f64,
        /// Height of a crest, m.
        height: f64,
    },
    /// A new flat: what a chord cuts off a wheel, −depth (1 − (2s/length)²).
    Flat {
        /// m.
        length: f64,
        /// m.
        depth: f64,
    },
    /// A flat whose edges are worn: −depth (1 + cos(2πs/length))/2.
    RoundedFlat {
        /// m.
        length: f64,
        /// m.
        depth: f64,
    },
    /// Two rails bent down where they meet: −depth (1 − 2|s|/length)².
    Joint {
        /// m.
        length: f64,
        /// m.
        depth: f64,
    },
    /// The surface goes up by `height` over `length`, along a half wave of a sine; ahead of it, it stays there.
    Step {
        /// m.
        length: f64,
        /// m.
        height: f64,
    },
}

impl RoughnessShape {
    /// Depth of the chord of `length` in a circle of `radius`, m.
    pub fn chord(length: f64, radius: f64) -> f64 {
        length * length / (8.0 * radius)
    }

    /// Height at the distance `s` (m) from its middle, m.
    pub fn height(&self, s: f64) -> f64 {
        let inside = |length: f64| 2.0 * s.abs() < length;
        match *self {
            RoughnessShape::Wave { length, height } => height * (2.0 * PI * s / length).sin(),
            RoughnessShape::Flat { length, depth } if inside(length) => -depth * (1.0 - (2.0 * s / length).powi(2)),
            RoughnessShape::RoundedFlat { length, depth } if inside(length) => {
                -0.5 * depth * (1.0 + (2.0 * PI * s / length).cos())
            }
            RoughnessShape::Joint { length, depth } if inside(length) => {
                -depth * (1.0 - 2.0 * s.abs() / length).powi(2)
            }
            RoughnessShape::Step { length, height } if inside(length) => 0.5 * height * (1.0 + (PI * s / length).sin()),
            RoughnessShape::Step { height, .. } if s > 0.0 => height,
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_have_their_depth_in_the_middle_and_meet_the_surface_at_their_ends() {
        let (length, depth, height) = (0.05, 7e-4, 3e-4);
        assert!(
            (RoughnessShape::chord(0.05, 0.46) - (0.46 - (0.46f64.powi(2) - 0.025f64.powi(2)).sqrt())).abs() < 1e-6
        );
        let all = [
            RoughnessShape::Flat { length, depth },
            RoughnessShape::RoundedFlat { length, depth },
            RoughnessShape::Joint { length, depth },
        ];
        for shape in all {
            assert_eq!(shape.height(0.0), -depth);
            for s in [-0.0249999999, 0.0249999999, 0.025, 0.3] {
                assert!(shape.height(s).abs() < 1e-10, "{shape:?} at {s}: {}", shape.height(s));
            }
            assert_eq!(shape.height(0.01), shape.height(-0.01));
        }
        // A quarter of the way from the middle to the end.
        let quarter = all.map(|s| s.height(0.00625) / -depth);
        let want = [1.0 - 1.0 / 16.0, 0.5 + 0.5f64.sqrt() / 2.0, 9.0 / 16.0];
        assert!((0..3).all(|i| (quarter[i] - want[i]).abs() < 1e-12), "{quarter:?}");
        let step = RoughnessShape::Step { length, height };
        assert_eq!([-1.0, 0.0, 1.0].map(|s| step.height(s)), [0.0, 0.5 * height, height]);
        assert!((step.height(0.02499999) - height).abs() < 1e-12 && step.height(-0.02499999).abs() < 1e-12);
        let wave = RoughnessShape::Wave { length: 0.2, height: 1e-6 };
        assert!((wave.height(0.05) - 1e-6).abs() < 1e-18 && wave.height(0.1).abs() < 1e-18);
    }
}
