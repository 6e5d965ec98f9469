//! Dynamics behind the contact, as the steps ask it: modes ([`Modal`](super::scheme::Modal)), or bodies that another
//! room advances.
//!
//! The steps know it by m coordinates `q` and their rates `v`. They see them at the contact through Ψ of the
//! [`Model`], and act on them by f = Ψᵀ R.

use super::model::Model;
use crate::Result;
use faer::Mat;

/// Motion behind the contact.
pub trait Dynamics {
    /// W, m/N, `[3n, 3n]`: displacements of the contact rows at the end of a step by the reactions in it, residual
    /// compliance included; symmetric.
    fn operator(&self, model: &Model<'_>) -> Mat<f64>;

    /// The step without the reaction at its end, from `q`, `v` and the forces `f` at its beginning (all `[m]`): (q,
    /// v) at the end. Once in each step.
    fn free(&mut self, q: &[f64], v: &[f64], f: &[f64]) -> Result<(Vec<f64>, Vec<f64>)>;

    /// Changes at the end of a step without the reaction at its end, by small changes of (q, v, f) at its beginning,
    /// `[m, c]`, one in each column: those of q and v, and the displacements that the contact sees, [`lag`](Self::lag)
    /// included. None where they are not known.
    fn free_changes(&self, _changes: [&Mat<f64>; 3]) -> Option<[Mat<f64>; 3]> {
        None
    }

    /// Adds to the changes (q, v) what changes `f` of the forces at the end of the step do, `[m, c]`, where
    /// [`free_changes`](Self::free_changes) are known.
    fn add_changes(&self, _f: &Mat<f64>, _changes: [&mut Mat<f64>; 2]) {}

    /// Part of the response that W leaves out, under the forces `f` at the beginning of a step, at the contact, `[m]`;
    /// none where W is complete.
    fn lag(&self, f: &[f64]) -> Option<Vec<f64>>;

    /// Adds what the forces `f` at the end of the step do.
    fn add(&self, f: &[f64], q: &mut [f64], v: &mut [f64]);

    /// Takes the step that [`free`](Self::free) began, with the forces `f` that the contact found; `q` and `v` are
    /// those that [`add`](Self::add) made, and may be improved.
    fn accept(&mut self, _f: &[f64], _q: &mut [f64], _v: &mut [f64]) -> Result<()> {
        Ok(())
    }

    /// Weight γ of the reaction at the end of the step in the mean force of the step.
    fn gamma(&self) -> f64;

    /// Kinetic energy, J, of the velocities at hand.
    fn kinetic(&self, v: &[f64]) -> f64;

    /// Elastic energy, J, of the displacements at hand, without that of the residual compliance.
    fn elastic(&self, q: &[f64]) -> f64;

    /// Energy that damping takes in a step, and the part of it that the axles of bodies that rotate supply, J;
    /// between the ends (q, v) of the step.
    fn damped(&self, before: (&[f64], &[f64]), after: (&[f64], &[f64])) -> (f64, f64);

    /// Work of loads that are not contact forces in a step, J.
    fn loaded(&self, _before: &[f64], _after: &[f64]) -> f64 {
        0.0
    }
}
