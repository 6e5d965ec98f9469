//! Keys of receptances and of the decay rates of a track.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::analyses::SweepRange;

/// Displacement of each body at the contact point per unit force there, over frequency, from the modes and the
/// residual compliance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Receptance {
    /// Frequencies, Hz: a list, or a range. None may lie beyond the modes of the bodies.
    pub frequency: Frequencies,
    /// How the force is spread over the contact nodes; the displacement is their mean with the same shares.
    #[serde(default)]
    pub spread: Spread,
}

/// Decay rates of the track along a rail (EN 15461): third octaves from 250 to 5000 Hz, a hammer at 29 positions along
/// the top of the head of a rail without ends, pads and sleepers spread evenly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackDecay {
    /// Length of the sleeper bays that the positions of the hammer are given in, m; by default that of the track.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub spacing: Option<f64>,
    /// Distance between hammer and accelerometer along the rail for the direct response, m: the dent under the hammer
    /// is no part of it.
    #[serde(default = "default_offset")]
    #[schemars(range(min = 0.01, max = 0.1), extend("unit" = "m"))]
    pub offset: f64,
    /// Frequencies in each third octave, over which the squares of the responses are averaged.
    #[serde(default = "default_lines")]
    #[schemars(range(min = 1, max = 100))]
    pub lines: u32,
}

fn default_offset() -> f64 {
    0.04
}

fn default_lines() -> u32 {
    6
}

/// Frequencies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Frequencies {
    /// These.
    List(Vec<Hertz>),
    /// Equidistant ones.
    Range(SweepRange),
}

/// A frequency, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Hertz(#[schemars(range(min = 0.0), extend("unit" = "Hz"))] pub f64);

impl Frequencies {
    /// The frequencies one by one, Hz, or what is wrong with them.
    pub fn numbers(&self) -> Result<Vec<f64>, String> {
        let list = match self {
            Frequencies::List(list) => list.iter().map(|f| f.0).collect(),
            Frequencies::Range(range) => range.numbers()?,
        };
        match list.iter().find(|f| **f < 0.0) {
            _ if list.is_empty() => Err("the list is empty".into()),
            Some(f) => Err(format!("found {f} Hz, expected frequencies ≥ 0")),
            None => Ok(list),
        }
    }
}

/// How a unit force is spread over the contact nodes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Spread {
    /// As the pressure of the contact without friction under the load of the job.
    #[default]
    Pressure,
    /// Evenly over the whole patch.
    Uniform,
}
