//! Friction that falls in a straight line and is constant from there on: the linear formula of the program CONTACT.

use super::velocity_weakening::{falling, Falling};

falling! {
    /// mu(v) = kinetic + (static - kinetic) max(0, 1 - v / end_velocity).
    pub struct Linear {
        /// Velocity from which on the coefficient is the kinetic one, m/s.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
        pub end_velocity: f64,
    }
}

impl Falling for Linear {
    fn left(&self, v: f64) -> f64 {
        (1.0 - v / self.end_velocity).max(0.0)
    }

    fn left_slope(&self, v: f64) -> f64 {
        if v < self.end_velocity {
            -1.0 / self.end_velocity
        } else {
            0.0
        }
    }

    fn shape(&self) -> String {
        format!(" in a straight line up to {} m/s", self.end_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{check, FrictionLaw};

    #[test]
    fn falls_in_a_straight_line() {
        let law = FrictionLaw::from(Linear::new(0.4, 0.25, 0.3));
        check(&law, 0.4, 0.25);
        assert!((law.coefficient(0.1) - 0.35).abs() < 1e-15 && law.coefficient(0.31) == 0.25);
    }
}
