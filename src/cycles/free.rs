//! A motion that nothing holds: a wheelset turns about its axle under the torque of what drives it.
//!
//! The contact knows the rate of its displacement q alone. In a cycle q = vt + a periodic part, and the mean velocity v
//! is the one at which the mean of the forces on the motion vanishes:
//!
//! ψᵀR₀ + f − cv = 0
//!
//! with the mean contact forces R₀, the load f, which keeps the state of rest, and the damping c of the motion by its
//! mass, if any. Where other functions of the motion
//! at the contact have their mean displacement among the unknowns, that of ψ has its drift |ψ|v/ω over a radian of the
//! phase, and its equation is the one above, times |ψ|/ω². Gyroscopic forces of the mean velocity are loads −Cv on
//! other modes.
//!
//! For the exponents of the modes a spring holds the motion whose frequency is far below those of all others.

use crate::model::{ModalBlock, ModalMatrix};
use crate::transient::Model;
use crate::{Error, Result};
use faer::Mat;

/// Angular frequency of the motion on its spring, rad/s.
const SOFT: f64 = 0.1;
/// Displacement along the normal, of the largest one, that such a motion may have.
const LEVEL: f64 = 1e-9;

/// The motion, whose function at the contact is the last one.
#[derive(Debug, Clone)]
pub(super) struct FreeMotion {
    /// Its mode.
    pub(super) mode: usize,
    /// |ψ|, 1/√kg.
    pub(super) size: f64,
    /// c, 1/s.
    pub(super) damping: f64,
    /// Motion of what acts at the contact under the gyroscopic forces of a mean velocity of 1 m √kg/s, `[r]`, s.
    pub(super) gyroscopic: Vec<f64>,
}

impl FreeMotion {
    /// Factor |ψ|²/ω² of the mean force in the equation, that of a displacement.
    pub(super) fn receptance(&self, omega: f64) -> f64 {
        (self.size / omega).powi(2)
    }
}

/// The mode of `model` that nothing holds and that moves no contact along its normal. Errors: more than one.
pub(super) fn mode(model: &Model<'_>) -> Result<Option<usize>> {
    let row = |k: usize, n: usize| (n..model.modes.nrows()).step_by(3).map(move |i| model.modes[(i, k)].abs());
    let largest = |k: usize, n: usize| row(k, n).fold(0.0, f64::max);
    let level = |k: &usize| {
        let along = largest(*k, 0).max(largest(*k, 1));
        model.omega[*k] == 0.0 && along > 0.0 && largest(*k, 2) <= LEVEL * along
    };
    let all: Vec<usize> = (0..model.omega.len()).filter(level).collect();
    match all[..] {
        [] => Ok(None),
        [mode] => Ok(Some(mode)),
        _ => Err(Error::Job(format!(
            "limit cycles: found {} motions that nothing holds, expected one at most, the rotation of a wheelset",
            all.len()
        ))),
    }
}

/// The stiffness of the modes with a spring on `mode`, which no other one acts on.
pub(super) fn on_spring(stiffness: &ModalMatrix, mode: usize) -> ModalMatrix {
    let set = |values: &[f64], at: usize| {
        let mut values = values.to_vec();
        values[at] = SOFT * SOFT;
        values
    };
    match stiffness {
        ModalMatrix::Diagonal(values) => ModalMatrix::Diagonal(set(values, mode)),
        ModalMatrix::Blocks(blocks) => {
            let mut first = 0;
            let held = |block: &ModalBlock| {
                let (own, order) = (mode.checked_sub(first), block.order());
                first += order;
                match (own.filter(|at| *at < order), block) {
                    (None, block) => block.clone(),
                    (Some(at), ModalBlock::Diagonal(values)) => ModalBlock::Diagonal(set(values, at)),
                    (Some(at), ModalBlock::Full(matrix)) => {
                        let of = |i: usize, j: usize| match (i == at, j == at) {
                            (true, true) => SOFT * SOFT,
                            (false, false) => matrix[(i, j)],
                            _ => 0.0,
                        };
                        Mat::from_fn(order, order, of).into()
                    }
                }
            };
            ModalMatrix::Blocks(blocks.iter().map(held).collect())
        }
    }
}
