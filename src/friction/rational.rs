//! Friction that falls with the inverse of the sliding velocity: the rational formula of the program CONTACT (E. A. H. Vollebregt, *User guide
//! for CONTACT, rolling and sliding contact with friction*).

use super::Law;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// mu(v) = kinetic + (static - kinetic) / (1 + v / half_velocity).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rational {
    /// Coefficient at rest; no less than `kinetic`.
    #[serde(rename = "static")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub at_rest: f64,
    /// Coefficient in fast sliding.
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub kinetic: f64,
    /// Velocity at which the coefficient has fallen by half of the difference, m/s.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub half_velocity: f64,
}

impl Law for Rational {
    fn coefficient(&self, v: f64) -> f64 {
        self.kinetic + (self.at_rest - self.kinetic) / (1.0 + v / self.half_velocity)
    }

    fn slope(&self, v: f64) -> f64 {
        -(self.at_rest - self.kinetic) / (self.half_velocity * (1.0 + v / self.half_velocity).powi(2))
    }

    fn fault(&self) -> Option<(&'static str, String)> {
        super::rises(self.at_rest, self.kinetic)
    }
}

impl std::fmt::Display for Rational {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "falling from {} to {}, half of it by {} m/s", self.at_rest, self.kinetic, self.half_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn falls_by_half_at_the_half_velocity() {
        let law = Rational { at_rest: 0.4, kinetic: 0.25, half_velocity: 0.3 };
        super::super::check(law, 0.4, 0.25);
        assert!((law.coefficient(0.3) - 0.325).abs() < 1e-15);
    }
}
