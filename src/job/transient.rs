//! Keys of `analyses.transient`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Rolling contact in time on the modes of `analyses.modes` and the residual compliance of the contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transient {
    /// Time that is simulated, s.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "s"))]
    pub duration: f64,
    /// Time step, s; at most the period of the highest mode kept over 2 pi.
    #[serde(default = "default_step")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "s"))]
    pub step: f64,
    /// Weight of the end of the step: 0.5 conserves energy, more damps.
    #[serde(default = "default_theta")]
    #[schemars(range(min = 0.5, max = 1.0), extend("unit" = "1"))]
    pub theta: f64,
    /// Moving model: the modes of the bodies, or all degrees of freedom of their finite elements.
    #[serde(default)]
    pub model: TransientModel,
    /// Solver of the contact problem of a step.
    #[serde(default)]
    pub solver: TransientSolver,
    /// Residual of the contact laws of a step relative to the normal force.
    #[serde(default = "default_step_tolerance")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 1e-6))]
    pub tolerance: f64,
    /// The state at time 0.
    #[serde(default)]
    pub start: Start,
    /// Quantity held at the start: the approach, or the normal load.
    #[serde(default)]
    pub hold: HeldQuantity,
    /// Load and creepages as functions of time; those not given are constant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub histories: Option<Histories>,
    /// Points of the bodies whose motion is written at every step.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<ObservedPoint>,
    /// Sound power that the bodies radiate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sound_power: Option<SoundPower>,
    /// Contact fields are written every so many steps; 0 for never.
    #[serde(default = "default_stride")]
    pub contact_stride: u32,
    /// Amplitudes of the modes are written every so many steps; 0 for never.
    #[serde(default = "default_modal_stride")]
    pub modal_stride: u32,
    /// Displacements of the bodies are written every so many steps; 0 for never.
    #[serde(default)]
    pub body_stride: u32,
    /// Results are written, and a run can be stopped, every so many steps.
    #[serde(default = "default_segment")]
    #[schemars(range(min = 1, max = 10_000_000))]
    pub segment: u32,
}

impl Transient {
    /// Number of steps.
    pub fn steps(&self) -> u64 {
        (self.duration / self.step).round() as u64
    }
}

pub(super) fn default_step() -> f64 {
    1e-5
}

pub(super) fn default_theta() -> f64 {
    0.5
}

pub(super) fn default_step_tolerance() -> f64 {
    1e-10
}

fn default_stride() -> u32 {
    100
}

fn default_modal_stride() -> u32 {
    20
}

fn default_segment() -> u32 {
    1000
}

/// Model that moves in time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TransientModel {
    /// The modes of `analyses.modes`, and statically the rest at the contact.
    #[default]
    Reduced,
    /// All degrees of freedom of the finite elements: slow, the check of the reduced model.
    Full,
}

/// Solver of the contact problem of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TransientSolver {
    /// Semi-smooth Newton method on a factorisation that serves many steps.
    #[default]
    Newton,
    /// Fixed point on the reactions: slow, for comparison.
    FixedPoint,
}

/// Quantity held at the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeldQuantity {
    /// The rigid approach: the load varies with the vibration.
    #[default]
    Approach,
    /// The normal load, the approach being massless.
    Load,
}

/// The state at time 0: at rest in `state`, plus perturbations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// The state of rest. Default: that of `analyses.stability`, or `"sliding"` where it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<StartState>,
    /// Number of the eigenvalue of `analyses.stability`, from 1 by falling growth rate, along whose complex mode the
    /// bodies are moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub mode: Option<u32>,
    /// Largest displacement of a contact node in that mode, m.
    #[serde(default = "default_amplitude")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub amplitude: f64,
    /// Random velocities of the modes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub random: Option<RandomStart>,
}

impl Default for Start {
    fn default() -> Self {
        Self { state: None, mode: None, amplitude: default_amplitude(), random: None }
    }
}

fn default_amplitude() -> f64 {
    1e-9
}

/// A state of rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StartState {
    /// The whole contact slides.
    Sliding,
    /// Steady rolling, with what sticks.
    Steady,
}

/// Random velocities of the modes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomStart {
    /// The same seed gives the same velocities.
    pub seed: u32,
    /// Kinetic energy of these velocities, J.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "J"))]
    pub energy: f64,
}

/// Tables of [time in s, value], straight between the points; they must cover the whole run. Those of loads and
/// creepages are of the first contact.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Histories {
    /// The normal load over time, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_load: Option<Vec<[f64; 2]>>,
    /// The approach over time, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approach: Option<Vec<[f64; 2]>>,
    /// The longitudinal creepage over time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitudinal: Option<Vec<[f64; 2]>>,
    /// The lateral creepage over time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral: Option<Vec<[f64; 2]>>,
    /// The spin creepage over time, 1/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spin: Option<Vec<[f64; 2]>>,
    /// The vertical load over time, N, that all contacts of a wheel carry together (`contact.vertical_load`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical_load: Option<Vec<[f64; 2]>>,
    /// The lateral force of the rail on a wheel over time, N, positive to the right, that its contacts bear together
    /// (`contact.lateral_force`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral_force: Option<Vec<[f64; 2]>>,
    /// Tables of the further contacts in their order, one entry each; an empty one keeps its contact constant.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<ContactHistories>,
}

/// Tables of [time in s, value] of one contact.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactHistories {
    /// The normal load over time, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_load: Option<Vec<[f64; 2]>>,
    /// The approach over time, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub approach: Option<Vec<[f64; 2]>>,
    /// The longitudinal creepage over time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitudinal: Option<Vec<[f64; 2]>>,
    /// The lateral creepage over time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral: Option<Vec<[f64; 2]>>,
    /// The spin creepage over time, 1/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spin: Option<Vec<[f64; 2]>>,
}

impl Histories {
    /// Tables of the contact `number`, counted from 0, and the key under which the job has them.
    pub fn of_contact(&self, number: usize) -> (String, ContactHistories) {
        let path = "analyses.transient.histories";
        match number.checked_sub(1) {
            None => {
                let Self { normal_load, approach, longitudinal, lateral, spin, .. } = self.clone();
                (path.into(), ContactHistories { normal_load, approach, longitudinal, lateral, spin })
            }
            Some(k) => (format!("{path}.further.{k}"), self.further.get(k).cloned().unwrap_or_default()),
        }
    }

    /// Tables of all contacts that have some, with their keys.
    pub fn all(&self) -> Vec<(String, ContactHistories)> {
        (0..=self.further.len()).map(|number| self.of_contact(number)).collect()
    }
}

impl ContactHistories {
    /// Returns whether the load or the approach is given over time.
    pub fn presses(&self) -> bool {
        self.normal_load.is_some() || self.approach.is_some()
    }
}

/// A point of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObservedPoint {
    /// Name of the point in the results.
    pub name: String,
    /// The body it belongs to.
    pub body: BodyName,
    /// Position (x, y, z) in the frame of the contact point, m; the nearest node of the mesh is taken.
    pub at: [f64; 3],
}

/// Sound power of bodies in third octaves, from the velocities of their surfaces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SoundPower {
    /// Density of the air, kg/m³.
    #[serde(default = "default_air_density")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "kg/m³"))]
    pub air_density: f64,
    /// Speed of sound in it, m/s.
    #[serde(default = "default_sound_speed")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub sound_speed: f64,
    /// The bodies whose sound is wanted; both where none is named.
    #[serde(default = "default_bodies")]
    pub bodies: Vec<BodyName>,
    /// The mean is taken from this time on, s; where it is not given, over the second half of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("unit" = "s"))]
    pub from: Option<f64>,
    /// The third octave that holds this frequency is the lowest, Hz.
    #[serde(default = "default_min_frequency")]
    #[schemars(range(min = 1.0, max = 1e6), extend("unit" = "Hz"))]
    pub min_frequency: f64,
    /// No third octave ends above this frequency, Hz; where it is not given, above the highest mode kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"), range(max = 1e6))]
    pub max_frequency: Option<f64>,
}

fn default_air_density() -> f64 {
    1.2
}

fn default_sound_speed() -> f64 {
    343.0
}

fn default_bodies() -> Vec<BodyName> {
    vec![BodyName::Lower, BodyName::Upper]
}

fn default_min_frequency() -> f64 {
    100.0
}

/// One of the two bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BodyName {
    /// Body 1.
    Lower,
    /// Body 2.
    Upper,
}

impl BodyName {
    /// The name as in the job.
    pub fn name(self) -> &'static str {
        match self {
            BodyName::Lower => "lower",
            BodyName::Upper => "upper",
        }
    }
}
