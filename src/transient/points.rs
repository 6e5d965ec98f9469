//! The transient of contact points: what takes the place of grid and load, and where it begins.

use super::{Model, State};
use crate::grid::Interface;
use crate::model::CoupledModel;
use faer::Mat;

/// A residual compliance below this part of the whole one is rounding.
const ROUNDING: f64 = 1e-9;
/// Compliance along the surface of a contact that does not move there, against the largest one: it carries what
/// friction asks of it and hardly gives way.
const STIFF: f64 = 1e-3;

/// Contact points as the transient takes them.
#[derive(Debug, Clone)]
pub struct PointModel {
    interface: Interface,
    /// Residual S, m/N, `[3n, 3n]`.
    residual: Mat<f64>,
    /// Modal loads, N/√kg, `[m]`; empty for none.
    load: Vec<f64>,
    /// Reactions at rest, N, `[3n]`.
    reaction: Vec<f64>,
    /// Coefficients of friction at rest, `[n]`.
    friction: Vec<f64>,
    /// Rigid motions at rest, m, `[motions]`.
    motions: Vec<f64>,
}

impl PointModel {
    /// Points that bear loads with the reactions, N, `[3n]`, and coefficients of friction, `[n]`, `rest`, at the rigid
    /// motions `motions`, m. `span` is the time, s, over which a step takes the motion of its end.
    pub(crate) fn under_load(
        pair: &CoupledModel,
        points: &Interface,
        rest: (Vec<f64>, Vec<f64>),
        motions: Vec<f64>,
        span: f64,
    ) -> Self {
        let (reaction, friction) = rest;
        Self {
            interface: points.clone(),
            residual: residual(pair, span),
            load: Vec::new(),
            reaction,
            friction,
            motions,
        }
    }

    /// Points with given reactions, N, `[3n]`, and coefficients of friction, `[n]`: loads from outside balance them
    /// on the modes, and the gaps are those that the forces close.
    pub(crate) fn with_reactions(
        pair: &CoupledModel,
        points: &Interface,
        rest: (Vec<f64>, Vec<f64>),
        span: f64,
    ) -> Self {
        let (reaction, friction) = rest;
        let residual = residual(pair, span);
        let force = Mat::from_fn(reaction.len(), 1, |i, _| reaction[i]);
        let (moved, modal) = (&residual * &force, pair.modes.transpose() * &force);
        let interface = points.with_gap((0..points.len()).map(|i| -moved[(3 * i + 2, 0)]).collect());
        let load = (0..modal.nrows()).map(|k| -modal[(k, 0)]).collect();
        Self { interface, residual, load, reaction, friction, motions: vec![0.0] }
    }

    /// The model of the two bodies.
    pub fn model<'a>(&'a self, pair: &'a CoupledModel) -> Model<'a> {
        Model { residual: self.residual.as_ref(), load: &self.load, ..Model::new(pair, &self.interface) }
    }

    /// The state of rest.
    pub fn at_rest(&self, model: &Model<'_>) -> State {
        State::at_rest(model, &self.reaction, &self.motions).remembering(&self.friction)
    }
}

/// The residual compliance without rounding, and with a compliance where neither body moves: along the normal it
/// keeps the force as it is.
fn residual(pair: &CoupledModel, span: f64) -> Mat<f64> {
    let mut s = pair.residual.clone();
    let n = s.nrows();
    for k in (0..n).filter(|&k| pair.residual[(k, k)].abs() <= ROUNDING * pair.compliance[(k, k)].abs()) {
        (0..n).for_each(|j| (s[(k, j)], s[(j, k)]) = (0.0, 0.0));
    }
    let largest = (0..n).map(|k| s[(k, k)]).fold(0.0, f64::max);
    let square = |k: usize| pair.modes.row(k).iter().map(|v| v * v).sum::<f64>();
    // Where there is no residual compliance, what the modes yield in a step.
    let scale = match largest > 0.0 {
        true => largest,
        false => (0..n).map(square).fold(0.0, f64::max) * span.powi(2),
    };
    for k in (0..n).filter(|&k| square(k) == 0.0) {
        if s[(k, k)] == 0.0 {
            s[(k, k)] = if k % 3 == 2 { scale } else { STIFF * scale };
        }
    }
    s
}
