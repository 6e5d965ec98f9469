//! Results of a step.

use super::super::delassus::DelassusOperator;
use super::super::problem::{Effort, StepSolution};
use crate::contact::law::Status;
use crate::friction::Remembered;

/// Results of a step on a patch, in its own frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PatchReport {
    /// Force on body 1 (x, y, z), N.
    pub force: [f64; 3],
    /// Moment about the common normal of the tractions on body 1, N·m.
    pub moment_z: f64,
    /// Closed nodes.
    pub closed: usize,
    /// Number of sticking nodes among them.
    pub stick: usize,
}

/// Results of a step besides the state.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Results of each patch.
    pub patches: Vec<PatchReport>,
    /// Residual of the contact laws, N.
    pub residual: f64,
    /// Work of the solver.
    pub effort: Effort,
}

impl StepReport {
    /// Force on body 1 at the first contact (x, y, z), N: forces of several contacts have frames of their own and no
    /// sum.
    pub fn force(&self) -> [f64; 3] {
        self.patches.first().map_or([0.0; 3], |patch| patch.force)
    }

    /// Closed nodes of all patches.
    pub fn closed(&self) -> usize {
        self.patches.iter().map(|p| p.closed).sum()
    }

    /// Sticking nodes of all patches.
    pub fn stick(&self) -> usize {
        self.patches.iter().map(|p| p.stick).sum()
    }
}

/// The contact problem of a step, see [`super::StepProblem`].
#[derive(Debug, Clone, Copy)]
pub struct ContactProblemView<'a> {
    /// Its nodes, `[k]`.
    pub nodes: &'a [usize],
    /// W.
    pub matrix: &'a DelassusOperator,
    /// (dx, dy, g) at R = 0, m, `[3k]`.
    pub free: &'a [f64],
    /// Memory of friction of the nodes, `[k]`; empty where friction is constant.
    pub before: &'a [Remembered],
}

/// Fields of a step on all nodes.
#[derive(Debug, Clone)]
pub struct StepFields {
    /// Pressure, Pa, `[n]`.
    pub pressure: Vec<f64>,
    /// Traction on body 1, Pa, `[n][2]`.
    pub traction: Vec<[f64; 2]>,
    /// Creep velocity over the last step, m/s, `[n][2]`; 0 away from the contact.
    pub creep: Vec<[f64; 2]>,
    /// 0 open, 1 stick, 2 slip, `[n]`.
    pub state: Vec<u8>,
}

/// Status and slip of the nodes that were in the core of the last step; the working set may be another one since.
#[derive(Default)]
pub(super) struct NodeState {
    /// `[k]`.
    pub(super) nodes: Vec<usize>,
    /// `[k]`.
    pub(super) status: Vec<Status>,
    /// Over the step, m, `[k][2]`.
    pub(super) slip: Vec<f64>,
}

/// State at the end of a step.
pub(super) struct StepEnd {
    pub(super) solution: StepSolution,
    /// W R and Ψ q_free on the rows of the working set, m.
    pub(super) response: Vec<f64>,
    pub(super) free: Vec<f64>,
    /// Ψᵀ R.
    pub(super) modal: Vec<f64>,
    pub(super) q: Vec<f64>,
    pub(super) v: Vec<f64>,
    /// Rigid motions, m, `[motions]`, and rigid creeps that were found, m/s.
    pub(super) motions: Vec<f64>,
    pub(super) creep: [f64; 2],
}
