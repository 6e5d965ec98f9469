//! Friction that falls exponentially with the sliding velocity.

use super::Law;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// mu(v) = kinetic + (static - kinetic) exp(-v / decay_velocity).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Exponential {
    /// Coefficient at rest; no less than `kinetic`.
    #[serde(rename = "static")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub at_rest: f64,
    /// Coefficient in fast sliding.
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub kinetic: f64,
    /// Velocity at which the coefficient has fallen by 63 % of the difference, m/s.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub decay_velocity: f64,
}

impl Law for Exponential {
    fn coefficient(&self, v: f64) -> f64 {
        self.kinetic + (self.at_rest - self.kinetic) * (-v / self.decay_velocity).exp()
    }

    fn slope(&self, v: f64) -> f64 {
        -(self.at_rest - self.kinetic) / self.decay_velocity * (-v / self.decay_velocity).exp()
    }

    fn fault(&self) -> Option<(&'static str, String)> {
        super::rises(self.at_rest, self.kinetic)
    }
}

impl std::fmt::Display for Exponential {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "falling from {} to {} over {} m/s", self.at_rest, self.kinetic, self.decay_velocity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn falls_by_two_thirds_at_the_decay_velocity() {
        let law = Exponential { at_rest: 0.4, kinetic: 0.25, decay_velocity: 0.3 };
        super::super::check(law, 0.4, 0.25);
        assert!((law.coefficient(0.3) - 0.25 - 0.15 * (-1.0f64).exp()).abs() < 1e-15);
    }
}
