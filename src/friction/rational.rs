//! Friction that falls with the inverse of the sliding velocity: the rational formula of the program CONTACT (E. A.
//! H. Vollebregt, *User guide for CONTACT, rolling and sliding contact with friction*).

use super::velocity_weakening::{falling, Falling};

falling! {
    /// mu(v) = kinetic + (static - kinetic) / (1 + v / half_velocity).
    pub struct Rational {
        /// Velocity at which the coefficient has fallen by half of the difference, m/s.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
        pub half_velocity: f64,
    }
}

impl Falling for Rational {
    fn left(&self, v: f64) -> f64 {
        1.0 / (1.0 + v / self.half_velocity)
    }

    fn left_slope(&self, v: f64) -> f64 {
        -1.0 / (self.half_velocity * (1.0 + v / self.half_velocity).powi(2))
    }

    fn shape(&self) -> String {
        format!(", half of it by {} m/s", self.half_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::FrictionLaw;

    #[test]
    fn falls_by_half_at_the_half_velocity() {
        let law = FrictionLaw::from(Rational::new(0.4, 0.25, 0.3));
        crate::friction::check(&law, 0.4, 0.25);
        assert!((law.coefficient(0.3) - 0.325).abs() < 1e-15);
    }
}
