//! The analyses and their keys.

use super::CreepageKey;
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::super::branches::Branches;
use super::super::cycles::Cycles;
use super::super::transient::{SoundPower, Transient};
use super::receptance::{Receptance, TrackDecay};
use super::uncertainty::Uncertainty;

/// The analyses; those given are run, in this order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Analyses {
    /// Undamped modes of each body without contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<Modes>,
    /// Steady rolling with friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steady: Option<Steady>,
    /// Stability of steady rolling: the modes that squeal, with their growth rates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stability: Option<Stability>,
    /// Steady rolling over a range of one creepage: forces, stick, and where `stability` is asked for the least
    /// stable eigenvalue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub creep_curve: Option<CreepCurve>,
    /// Receptances of the bodies at the contact point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub receptance: Option<Receptance>,
    /// Decay rates of the track along a rail, vertical and lateral, as EN 15461 has them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub track_decay: Option<TrackDecay>,
    /// Rolling contact in time: how instability grows, and to what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transient: Option<Transient>,
    /// Branches of limit cycles over a key, with their stability and thresholds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycles: Option<Branches>,
    /// Steady curving at other radii than that of `curve`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curving: Option<Curving>,
    /// Stability at many values of keys of the job.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep: Option<Sweep>,
    /// Probability of squeal where keys of the job are uncertain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<Uncertainty>,
}

impl Analyses {
    /// Sound that is wanted of limit cycles, by the keys of `analyses` that ask for it.
    pub(crate) fn limit_cycle_sounds(&self) -> [(&'static str, Option<&SoundPower>); 3] {
        let of_sweep = self.sweep.as_ref().and_then(|s| s.cycles.as_ref());
        let of_samples = self.uncertainty.as_ref().and_then(|u| u.cycles.as_ref());
        [
            ("sweep.cycles.sound_power", of_sweep.and_then(|c| c.sound_power.as_ref())),
            ("uncertainty.cycles.sound_power", of_samples.and_then(|c| c.sound_power.as_ref())),
            ("cycles.sound_power", self.cycles.as_ref().and_then(|c| c.sound_power.as_ref())),
        ]
    }

    /// The analyses given that work on the contact of two bodies, by name; each needs their compliance.
    pub(crate) fn on_contact(&self) -> Vec<&'static str> {
        self.names()
            .into_iter()
            .filter(|n| !["modes", "curving", "track_decay", "sweep", "uncertainty"].contains(n))
            .collect()
    }

    /// Names of the analyses that are given, in the order in which they run.
    pub fn names(&self) -> Vec<&'static str> {
        let given = [
            ("curving", self.curving.is_some()),
            ("track_decay", self.track_decay.is_some()),
            ("modes", self.modes.is_some()),
            ("steady", self.steady.is_some()),
            ("stability", self.stability.is_some()),
            ("creep_curve", self.creep_curve.is_some()),
            ("receptance", self.receptance.is_some()),
            ("transient", self.transient.is_some()),
            ("cycles", self.cycles.is_some()),
            ("sweep", self.sweep.is_some()),
            ("uncertainty", self.uncertainty.is_some()),
        ];
        given.into_iter().filter(|(_, is)| *is).map(|(name, _)| name).collect()
    }
}

/// Equilibrium of `vehicle` in `curve`: shifts, yaws, loads and creepages of all wheels.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curving {
    /// Radii of other curves that are run through in the same way, m: a list, or a range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "m"))]
    pub radii: Option<CreepageValues>,
}

impl Curving {
    /// The radii one by one, or what is wrong with them.
    pub fn radii(&self) -> Result<Vec<f64>, String> {
        let list = match &self.radii {
            None => Vec::new(),
            Some(CreepageValues::List(list)) => list.clone(),
            Some(CreepageValues::Range(range)) => range.numbers()?,
        };
        match list.iter().find(|r| !(**r > 0.0 && r.is_finite())) {
            Some(radius) => Err(format!("found {radius} m, expected radii above 0")),
            None => Ok(list),
        }
    }
}

/// Undamped modes of each body, contact open, supports held. Give either `count` or `max_frequency`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Modes {
    /// Number of modes of each body, the lowest first; a cluster of equal frequencies is never cut, so a few more may
    /// come.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 100_000))]
    pub count: Option<u32>,
    /// All modes of each body up to this frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub max_frequency: Option<f64>,
}

impl Modes {
    /// Which modes are asked for. Reading a job makes sure that exactly one of the two keys is given.
    pub fn extent(&self) -> ModesExtent {
        match (self.count, self.max_frequency) {
            (Some(n), _) => ModesExtent::Count(n as usize),
            (None, Some(f)) => ModesExtent::MaxFrequency(f),
            (None, None) => ModesExtent::Count(0),
        }
    }
}

/// Which modes are asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModesExtent {
    /// This many, the lowest first.
    Count(usize),
    /// All up to this frequency, Hz.
    MaxFrequency(f64),
}

/// Steady rolling: normal contact and friction with everything constant in time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Steady {
    /// Residual of the contact laws, relative to the normal force, at which the solution is accepted.
    #[serde(default = "default_tolerance")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.01))]
    pub tolerance: f64,
    /// Iterations after which the solver gives up.
    #[serde(default = "default_iterations")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub max_iterations: u32,
}

impl Default for Steady {
    fn default() -> Self {
        Self { tolerance: default_tolerance(), max_iterations: default_iterations() }
    }
}

/// Steady rolling at many values of one creepage, one after the other, each from the solution before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CreepCurve {
    /// The creepage that changes; the others are those of the contact.
    pub key: CreepageKey,
    /// Its values, 1, for spin 1/m: a list, or a range. They are gone through in the order given; close steps are
    /// quick.
    pub values: CreepageValues,
    /// Residual of the contact laws at which a point is accepted, relative to the normal force, where forces alone
    /// are asked for; with `stability` it is that of a state of rest, 1e-10. Default: that of `analyses.steady`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.01))]
    pub tolerance: Option<f64>,
}

/// Values of a creepage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum CreepageValues {
    /// These.
    List(Vec<f64>),
    /// Equidistant ones.
    Range(SweepRange),
}

impl CreepCurve {
    /// The values one by one, or what is wrong with them.
    pub fn numbers(&self) -> Result<Vec<f64>, String> {
        let list = match &self.values {
            CreepageValues::List(list) => list.clone(),
            CreepageValues::Range(range) => range.numbers()?,
        };
        match list.is_empty() {
            true => Err("the list is empty".into()),
            false => Ok(list),
        }
    }
}

/// Stability of steady rolling or sliding on the modes of `analyses.modes` and the residual compliance of the contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stability {
    /// Eigenvalues up to this frequency are kept, Hz. Default: the highest frequency that both bodies' modes reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub max_frequency: Option<f64>,
    /// The state that is examined. Default: `"steady"`, what the creepage gives; with `direction` `"rigid"` it is
    /// `"sliding"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<StabilityState>,
    /// Origin of the direction and the velocity of sliding in the state `"sliding"`.
    #[serde(default)]
    pub direction: Direction,
    /// Eigenvalues up to this damping ratio are listed, and all that grow; 1: all. The relaxations of the contact
    /// itself, which go with the size of the elements, are damped far more than any mode of the bodies.
    #[serde(default = "default_listed")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 1.0))]
    pub damping_ratio: f64,
    /// Largest backward error of an accepted eigenpair.
    #[serde(default = "default_backward_error")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.01))]
    pub tolerance: f64,
    /// Complex modes that are written as motions of the bodies: the unstable ones, and if these are fewer the least
    /// damped up to this number; 0: none.
    #[serde(default = "default_shapes")]
    #[schemars(range(max = 10_000))]
    pub shapes: u32,
    /// Pictures of each complex mode over its period, a multiple of 4.
    #[serde(default = "default_phases")]
    #[schemars(range(min = 4, max = 1000), extend("multipleOf" = 4))]
    pub phases: u32,
    /// True if the derivatives of the eigenvalues are computed: by friction, load, speed, creepages, damping of each
    /// mode and lateral position of the contact.
    #[serde(default)]
    pub sensitivities: bool,
    /// Model of the contact: the discretised patch, or beside that one point in place of each, to see what the patch
    /// changes.
    #[serde(default)]
    pub contact: StabilityContact,
    /// The same on the full finite-element system, compared with the reduced one. Default: reduced only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full: Option<FullStability>,
}

impl Stability {
    /// The state that is examined.
    pub fn state(&self) -> StabilityState {
        self.state.unwrap_or(match self.direction {
            Direction::Rigid => StabilityState::Sliding,
            Direction::Actual => StabilityState::Steady,
        })
    }
}

/// Model of the contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StabilityContact {
    /// The discretised patch, each node with its own pressure and friction.
    #[default]
    Patch,
    /// Beside each patch one point on Hertz' spring, with the creep forces of each law of point contact.
    Point,
}

/// A state that stability is examined about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StabilityState {
    /// Steady rolling as the creepage gives it, with what sticks.
    Steady,
    /// Sliding of all nodes in contact, whether or not the creepage is enough for it.
    Sliding,
}

/// Stability on the full finite-element system: the quadratic eigenproblem with a multiplier for each closed node, by
/// successive shifts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FullStability {
    /// All eigenvalues up to this frequency are computed, Hz.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub max_frequency: f64,
    /// and up to this damping ratio of either sign: faster decay is not looked for.
    #[serde(default = "default_damping_ratio")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.9))]
    pub damping_ratio: f64,
    /// Eigenvalues per shift, about: the shifts are as far apart as this allows.
    #[serde(default = "default_shift_count")]
    #[schemars(range(min = 6, max = 1000))]
    pub count: u32,
    /// Largest backward error and constraint violation of an accepted eigenpair.
    #[serde(default = "default_backward_error")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.01))]
    pub tolerance: f64,
    /// Relative distance |Δλ|/|λ| within which every eigenvalue must have its partner in the reduced model, and the
    /// other way round.
    #[serde(default = "default_agreement")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.5))]
    pub agreement: f64,
}

fn default_listed() -> f64 {
    0.3
}

fn default_shapes() -> u32 {
    3
}

fn default_phases() -> u32 {
    16
}

fn default_damping_ratio() -> f64 {
    0.1
}

fn default_shift_count() -> u32 {
    20
}

fn default_agreement() -> f64 {
    0.01
}

fn default_backward_error() -> f64 {
    1e-9
}

/// Stability at many values of keys of the job: every point has its own sliding equilibrium, contact set and
/// spectrum, as `analyses.stability` has for the job itself. What needs new modes or compliances makes them once for
/// all points that share them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Values of each swept key, by its dotted path, e.g. `{"contact.friction": [0.2, 0.3]}`: a list, or a range.
    pub keys: IndexMap<String, SweepValues>,
    /// How the values of several keys are combined.
    #[serde(default)]
    pub combine: Combine,
    /// Follows every point in time to its limit cycle as well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycles: Option<Cycles>,
}

/// Values of a swept key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SweepValues {
    /// These values, of any type the key may have.
    List(Vec<Value>),
    /// Equidistant numbers.
    Range(SweepRange),
}

/// Equidistant numbers, both ends included. Give either `count` or `step`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepRange {
    /// First value, in the unit of the key.
    #[schemars(extend("unit" = "1"))]
    pub from: f64,
    /// Last value, in the unit of the key.
    #[schemars(extend("unit" = "1"))]
    pub to: f64,
    /// Number of values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 100_000))]
    pub count: Option<u32>,
    /// Distance of the values, in the unit of the key; the last one may fall short of `to`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "1"))]
    pub step: Option<f64>,
}

/// How the values of several keys are combined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Combine {
    /// Every value of each with every value of the others; the last key runs fastest.
    #[default]
    Grid,
    /// Side by side: the first values of all, then the second ones, and so on.
    Zip,
}

/// Origin of the direction and the velocity of sliding.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// The creep of the deformed bodies, by a fixed point; refused where a node would stick.
    #[default]
    Actual,
    /// The rigid creep at each node.
    Rigid,
}

fn default_tolerance() -> f64 {
    1e-8
}

fn default_iterations() -> u32 {
    200
}
