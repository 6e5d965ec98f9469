//! Keys of `analyses.uncertainty`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::cycles::{default_amplitude, default_duration, default_settled, Branch, Cycles};
use super::super::transient::{default_step, HeldQuantity, SoundPower};
use crate::random::distribution::InputDistribution as Law;

/// Probability of squeal where keys of the job are uncertain: stability at many samples of them, which modes are
/// unstable how often, and which input the growth rate depends on. Needs `stability`; a job has this or `sweep`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Uncertainty {
    /// The uncertain keys with their distributions.
    #[schemars(length(min = 1, max = 32))]
    pub inputs: Vec<UncertainInput>,
    /// Correlations of the inputs, one row and column for each, 1 on the diagonal: those of normal variables whose
    /// dependence the inputs have (Gaussian copula). Default: independent inputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<Vec<Vec<f64>>>,
    /// Number of samples. With Sobol' indices of d inputs d + 2 points are computed for each, two of which, both at
    /// random, count for the probability. With `"sobol"` a multiple of `replicates` by a power of two.
    #[serde(default = "default_samples")]
    #[schemars(range(min = 4, max = 100_000))]
    pub samples: u32,
    /// How the samples are spread.
    #[serde(default)]
    pub method: SamplingMethod,
    /// Independent scramblings of the Sobol' sequence, whose spread gives the confidence intervals of probabilities.
    /// Default: 16; `"latin_hypercube"` has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 1000))]
    pub replicates: Option<u32>,
    /// Seed of the random numbers: the same samples come from the same seed.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// True if Sobol' indices of the largest growth rate are computed. Default: with independent inputs; they are not
    /// defined for others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub indices: Option<bool>,
    /// Probability with which intervals hold what they stand for.
    #[serde(default = "default_confidence")]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1, "unit" = "1"))]
    pub confidence: f64,
    /// True if eigenvalues near the axis are continued from those of a few points of a model to the others; unstable
    /// ones that are missing are counted at a tenth of these, and where their number changes.
    #[serde(default = "default_follow")]
    pub follow: bool,
    /// True if wheel and rail are interpolated over their profiles where 96 or more points touch them at places of
    /// their own, and growth rates agree within 1e-4 with those of places computed on the same mesh.
    #[serde(default = "default_interpolate")]
    pub interpolate: bool,
    /// How loud some of the samples are, by their limit cycles. Default: none is followed in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycles: Option<SampleCycles>,
    /// Share of the points that may fail. With more of them the run ends with exit code 4 after writing its results.
    #[serde(default = "default_max_failed")]
    #[schemars(range(min = 0.0, max = 1.0), extend("unit" = "1"))]
    pub max_failed: f64,
}

/// The limit cycles of some random samples: each unstable one is followed in time from its most unstable mode until its
/// motion repeats itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleCycles {
    /// Number of random samples that are followed: the first ones of each replicate, a power of two of each, or of the
    /// Latin hypercube. Those that are stable count as silent.
    #[schemars(range(min = 4, max = 100_000))]
    pub samples: u32,
    /// Longest time that a sample is followed, s.
    #[serde(default = "default_duration")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "s"))]
    pub duration: f64,
    /// Relative error of the amplitude at which a cycle counts as reached.
    #[serde(default = "default_settled")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.1))]
    pub settled: f64,
    /// Largest displacement of a contact node in the mode that a sample begins with, m.
    #[serde(default = "default_amplitude")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub amplitude: f64,
    /// Time step, s; at most the period of the highest mode kept over 2 pi.
    #[serde(default = "default_step")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "s"))]
    pub step: f64,
    /// Quantity held at rest: the approach, or the normal load.
    #[serde(default)]
    pub hold: HeldQuantity,
    /// Sound power of the motions, in third octaves; `from` is not given here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sound_power: Option<SoundPower>,
}

impl SampleCycles {
    /// The limit cycles of points by themselves.
    pub(crate) fn of_points(&self) -> Cycles {
        let Self { samples: _, duration, settled, amplitude, step, hold, sound_power } = self.clone();
        let branches = vec![Branch::Mode];
        Cycles { branches, duration, settled, amplitude, step, hold, sound_power, ..Cycles::default() }
    }
}

/// An uncertain key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UncertainInput {
    /// Its dotted path, e.g. `"contact.friction"`: a number of `bodies`, `contact`, `curve` or `vehicle`.
    pub key: String,
    /// Its distribution, in the unit of the key.
    pub distribution: Distribution,
    /// Lower and upper end at which the distribution is cut off, in the unit of the key; null for no end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truncate: Option<[Option<f64>; 2]>,
}

/// A distribution, in the unit of its key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Distribution {
    /// A normal distribution.
    Normal {
        /// Mean of the input.
        #[schemars(extend("unit" = "1"))]
        mean: f64,
        /// Standard deviation of the input.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"))]
        deviation: f64,
    },
    /// A value whose logarithm is distributed normally.
    Lognormal {
        /// Median of the input.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"))]
        median: f64,
        /// Standard deviation of the natural logarithm.
        #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"))]
        log_deviation: f64,
    },
    /// All values between two ends alike.
    Uniform {
        /// Lower end of the range.
        #[schemars(extend("unit" = "1"))]
        from: f64,
        /// Upper end of the range.
        #[schemars(extend("unit" = "1"))]
        to: f64,
    },
    /// A density that rises and falls in straight lines.
    Triangular {
        /// Lower end of the range.
        #[schemars(extend("unit" = "1"))]
        from: f64,
        /// Most likely value.
        #[schemars(extend("unit" = "1"))]
        mode: f64,
        /// Upper end of the range.
        #[schemars(extend("unit" = "1"))]
        to: f64,
    },
    /// Rows [value, probability of a value up to it], both rising, the probability from 0 to 1; even between them.
    Table(Vec<[f64; 2]>),
    /// The normal distribution of a measured frequency or damping, by its value and its `_deviation` in
    /// `bodies.*.modes.measured`. Reading a job puts that in its place.
    Measured,
}

impl Distribution {
    /// The law of probability.
    pub fn law(&self) -> Law {
        match *self {
            Self::Normal { mean, deviation } => Law::Normal([mean, deviation]),
            Self::Lognormal { median, log_deviation } => Law::Lognormal([median, log_deviation]),
            Self::Uniform { from, to } => Law::Uniform([from, to]),
            Self::Triangular { from, mode, to } => Law::Triangular([from, mode, to]),
            Self::Table(ref rows) => Law::Table(rows.clone()),
            // Without its numbers it is no distribution, which is a fault.
            Self::Measured => Law::Normal([f64::NAN; 2]),
        }
    }
}

/// How samples are spread over the distributions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SamplingMethod {
    /// A Sobol' sequence, scrambled as A. B. Owen does.
    #[default]
    Sobol,
    /// A Latin hypercube.
    LatinHypercube,
}

impl Uncertainty {
    /// True if Sobol' indices are computed.
    pub(crate) fn wants_indices(&self) -> bool {
        self.indices.unwrap_or(self.correlation.is_none())
    }

    /// Points that are computed for each sample: one, or those of the design of Saltelli.
    pub(crate) fn points_per_sample(&self) -> usize {
        if self.wants_indices() {
            self.inputs.len() + 2
        } else {
            1
        }
    }

    /// Points of each sample that are at random, the first ones: they count for probabilities.
    pub(crate) fn random_per_sample(&self) -> usize {
        if self.wants_indices() {
            2
        } else {
            1
        }
    }

    /// Number of independent replicates.
    pub fn replicates(&self) -> usize {
        match self.method {
            SamplingMethod::Sobol => self.replicates.unwrap_or(16) as usize,
            SamplingMethod::LatinHypercube => 1,
        }
    }
}

fn default_samples() -> u32 {
    256
}

fn default_seed() -> u64 {
    1
}

fn default_confidence() -> f64 {
    0.95
}

fn default_follow() -> bool {
    true
}

fn default_interpolate() -> bool {
    true
}

fn default_max_failed() -> f64 {
    0.05
}
