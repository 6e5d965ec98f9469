//! Friction that falls exponentially with the sliding velocity.

use super::velocity_weakening::{falling, Falling};
use super::exp_simd;

falling! {
    /// mu(v) = kinetic + (static - kinetic) exp(-v / decay_velocity).
    pub struct Exponential {
        /// Velocity at which the coefficient has fallen by 63 % of the difference, m/s.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
        pub decay_velocity: f64,
    }
}

impl Falling for Exponential {
    fn left(&self, v: f64) -> f64 {
        (-v / self.decay_velocity).exp()
    }

    fn left_slope(&self, v: f64) -> f64 {
        -(-v / self.decay_velocity).exp() / self.decay_velocity
    }

    fn left_with_slope(&self, v: f64) -> (f64, f64) {
        let left = self.left(v);
        (left, -left / self.decay_velocity)
    }

    fn lefts_with_slopes(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut left: Vec<f64> = v.iter().map(|v| v / self.decay_velocity).collect();
        exp_simd::left(&mut left);
        let slope = left.iter().map(|l| -l / self.decay_velocity).collect();
        (left, slope)
    }

    fn shape(&self) -> String {
        format!(" over {} m/s", self.decay_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::FrictionLaw;

    #[test]
    fn falls_by_two_thirds_at_the_decay_velocity() {
        let law = FrictionLaw::from(Exponential::new(0.4, 0.25, 0.3));
        crate::friction::check(&law, 0.4, 0.25);
        assert!((law.coefficient(0.3) - 0.25 - 0.15 * (-1.0f64).exp()).abs() < 1e-15);
    }
}
