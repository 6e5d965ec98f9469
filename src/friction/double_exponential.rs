//! Friction that falls in two terms, a fast one and a slow one: the exponential formula of the program CONTACT, whose
//! velocities are those at which half of a term is left (ln 2 of these).

use super::velocity_weakening::{falling, Falling};

falling! {
    /// mu(v) = kinetic + (static - kinetic) (share exp(-v / decay_velocity) + (1 - share) exp(-v /
    /// second_decay_velocity)).
    pub struct DoubleExponential {
        /// Part of the difference that the first term takes.
        #[schemars(range(min = 0.0, max = 1.0), extend("unit" = "1"))]
        pub share: f64,
        /// Velocity at which 63 % of the first term are gone, m/s.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
        pub decay_velocity: f64,
        /// Velocity at which 63 % of the second term are gone, m/s.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
        pub second_decay_velocity: f64,
    }
}

impl DoubleExponential {
    /// The two terms: parts of the difference and velocities.
    fn terms(&self) -> [(f64, f64); 2] {
        [(self.share, self.decay_velocity), (1.0 - self.share, self.second_decay_velocity)]
    }
}

impl Falling for DoubleExponential {
    fn left(&self, v: f64) -> f64 {
        self.terms().map(|(part, decay)| part * (-v / decay).exp()).iter().sum()
    }

    fn left_slope(&self, v: f64) -> f64 {
        self.terms().map(|(part, decay)| -part * (-v / decay).exp() / decay).iter().sum()
    }

    fn shape(&self) -> String {
        let [(first, fast), (second, slow)] = self.terms();
        format!(", {:.0} % over {fast} m/s, {:.0} % over {slow} m/s", 100.0 * first, 100.0 * second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{check, Exponential, FrictionLaw};

    #[test]
    fn falls_in_two_terms() {
        let law = FrictionLaw::from(DoubleExponential::new(0.4, 0.25, 0.7, 0.1, 2.0));
        check(&law, 0.4, 0.25);
        let want = 0.25 + 0.15 * (0.7 * (-2.0f64).exp() + 0.3 * (-0.1f64).exp());
        assert!((law.coefficient(0.2) - want).abs() < 1e-15);
        // One term alone is the exponential law.
        let one = FrictionLaw::from(DoubleExponential::new(0.4, 0.25, 1.0, 0.3, 2.0));
        let exponential = FrictionLaw::from(Exponential::new(0.4, 0.25, 0.3));
        assert!([0.0, 0.1, 1.0].iter().all(|&v| (one.coefficient(v) - exponential.coefficient(v)).abs() < 1e-15));
    }
}
