//! Keys of `analyses.sweep.cycles`.

use super::transient::{
    default_step, default_step_tolerance, default_theta, HeldQuantity, SoundPower, Start, StartState, Transient,
    TransientModel, TransientSolver,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The limit cycles of the points of a sweep: each point is followed in time until its motion repeats itself or has
/// died out. `{}` takes all defaults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cycles {
    /// Origin of the motion of a point. With `"up"` and `"down"` one sees where squeal persists that does not begin by
    /// itself.
    #[serde(default = "default_branches")]
    #[schemars(length(min = 1))]
    pub branches: Vec<Branch>,
    /// The swept key along which `"up"` and `"down"` go. Default: the last one, or all of them where lists run side
    /// by side.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<String>,
    /// Longest time that a point is followed, s.
    #[serde(default = "default_duration")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "s"))]
    pub duration: f64,
    /// Relative error of the amplitude at which a cycle counts as reached.
    #[serde(default = "default_settled")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.1))]
    pub settled: f64,
    /// Largest displacement of a contact node in the mode that a point begins with, m.
    #[serde(default = "default_amplitude")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub amplitude: f64,
    /// Multiples of the frequency whose amplitudes are written.
    #[serde(default = "default_harmonics")]
    #[schemars(range(min = 1, max = 100))]
    pub harmonics: u32,
    /// Time step, s; at most the period of the highest mode kept over 2 pi.
    #[serde(default = "default_step")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "s"))]
    pub step: f64,
    /// Weight of the end of the step: 0.5 conserves energy, more damps.
    #[serde(default = "default_theta")]
    #[schemars(range(min = 0.5, max = 1.0), extend("unit" = "1"))]
    pub theta: f64,
    /// Residual of the contact laws of a step relative to the normal force.
    #[serde(default = "default_step_tolerance")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 1e-6))]
    pub tolerance: f64,
    /// Quantity held at rest: the approach, or the normal load.
    #[serde(default)]
    pub hold: HeldQuantity,
    /// Sound power of the motions, in third octaves; `from` is not given here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sound_power: Option<SoundPower>,
}

impl Cycles {
    /// A point as a transient that begins at rest.
    pub fn transient(&self, state: StartState) -> Transient {
        Transient {
            duration: self.duration,
            step: self.step,
            theta: self.theta,
            model: TransientModel::Reduced,
            solver: TransientSolver::Newton,
            tolerance: self.tolerance,
            start: Start { state: Some(state), ..Start::default() },
            hold: self.hold,
            histories: None,
            points: Vec::new(),
            sound_power: None,
            contact_stride: 0,
            modal_stride: 0,
            body_stride: 0,
            segment: 1,
        }
    }
}

/// Origin of the motion of a point of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Branch {
    /// Its own most unstable mode, a little; a point without one rests.
    Mode,
    /// The motion of the point before, the values of the key ascending as given.
    Up,
    /// The motion of the point behind, from the last value to the first one.
    Down,
}

impl Branch {
    /// As in a job.
    pub fn name(self) -> &'static str {
        match self {
            Branch::Mode => "mode",
            Branch::Up => "up",
            Branch::Down => "down",
        }
    }
}

impl Default for Cycles {
    fn default() -> Self {
        Self {
            branches: default_branches(),
            along: None,
            duration: default_duration(),
            settled: default_settled(),
            amplitude: default_amplitude(),
            harmonics: default_harmonics(),
            step: default_step(),
            theta: default_theta(),
            tolerance: default_step_tolerance(),
            hold: HeldQuantity::default(),
            sound_power: None,
        }
    }
}

fn default_branches() -> Vec<Branch> {
    vec![Branch::Up, Branch::Down]
}

pub(super) fn default_duration() -> f64 {
    5.0
}

pub(super) fn default_settled() -> f64 {
    1e-3
}

pub(super) fn default_amplitude() -> f64 {
    1e-7
}

fn default_harmonics() -> u32 {
    8
}
