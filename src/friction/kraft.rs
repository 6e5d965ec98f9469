//! Friction of wheel and rail as K. Kraft measured it, in the form of A. D. de Beer, M. H. A. Janssens, P. P.
//! Kooijman (*J. Sound Vib.* 267 (2003)): it falls in two stages, about 0.2 and 10 m/s, to nothing.

use super::velocity_weakening::remembering;
use super::Law;

/// The velocities of the two stages, m/s.
const STAGES: [f64; 2] = [0.138, 6.9];

remembering! {
    /// mu(v) = static (1 - exp(-0.138 m/s / v) / 2 - exp(-6.9 m/s / v) / 2).
    pub struct Kraft {
        /// Coefficient at rest.
        #[serde(rename = "static")]
        #[schemars(range(min = 0.0), extend("unit" = "1"))]
        pub at_rest: f64,
    }
}

impl Law for Kraft {
    fn coefficient(&self, v: f64) -> f64 {
        // At rest exp(−∞) is 0.
        self.at_rest * (1.0 - 0.5 * STAGES.map(|s| (-s / v).exp()).iter().sum::<f64>())
    }

    fn slope(&self, v: f64) -> f64 {
        // exp(−s/v) s/v² goes to 0 with v.
        let stage = |s: f64| if v > 1e-3 * s { (-s / v).exp() * s / (v * v) } else { 0.0 };
        -0.5 * self.at_rest * STAGES.map(stage).iter().sum::<f64>()
    }

    fn scale(&mut self, factor: f64) {
        self.at_rest *= factor;
    }

    fn fault(&self) -> Option<(&'static str, String)> {
        None
    }
}

impl std::fmt::Display for Kraft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "falling from {} as Kraft found it", self.at_rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{check, FrictionLaw};

    #[test]
    fn falls_in_two_stages_to_nothing() {
        let law = FrictionLaw::from(Kraft::new(0.4));
        check(&law, 0.4, 0.0);
        let want = 0.4 * (1.0 - 0.5 * (-0.138f64).exp() - 0.5 * (-6.9f64).exp());
        assert!((law.coefficient(1.0) - want).abs() < 1e-15 && law.slope(0.0) == 0.0);
    }
}
