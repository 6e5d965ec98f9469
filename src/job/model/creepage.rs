//! Creepages of a contact.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Creepages: rigid slip velocity of body 1 relative to body 2 over the rolling speed, (xi - phi y, eta + phi x).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Creepage {
    /// Longitudinal creepage xi, 1 (0.003 is 0.3 %).
    #[serde(default)]
    #[schemars(extend("unit" = "1"))]
    pub longitudinal: f64,
    /// Lateral creepage eta, 1 (0.003 is 0.3 %).
    #[serde(default)]
    #[schemars(extend("unit" = "1"))]
    pub lateral: f64,
    /// Spin phi, 1/m.
    #[serde(default)]
    #[schemars(extend("unit" = "1/m"))]
    pub spin: f64,
}

impl Creepage {
    /// The same with another value of one of the three.
    pub fn with(self, key: CreepageKey, value: f64) -> Self {
        match key {
            CreepageKey::Longitudinal => Self { longitudinal: value, ..self },
            CreepageKey::Lateral => Self { lateral: value, ..self },
            CreepageKey::Spin => Self { spin: value, ..self },
        }
    }

    /// One of the three.
    pub fn component(self, key: CreepageKey) -> f64 {
        match key {
            CreepageKey::Longitudinal => self.longitudinal,
            CreepageKey::Lateral => self.lateral,
            CreepageKey::Spin => self.spin,
        }
    }
}

/// A creepage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CreepageKey {
    /// The longitudinal one.
    Longitudinal,
    /// The lateral one.
    Lateral,
    /// Spin.
    Spin,
}

impl CreepageKey {
    /// Its key in a job.
    pub fn name(self) -> &'static str {
        match self {
            Self::Longitudinal => "longitudinal",
            Self::Lateral => "lateral",
            Self::Spin => "spin",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Spin => "1/m",
            Self::Longitudinal | Self::Lateral => "1",
        }
    }
}
