//! The modes of rails on pads and sleepers that stand apart, as their contacts see them.

use super::hybrid::statics;
use crate::parallel::World;
use crate::swept::{DiscreteSupports, RailMember, RailOnPads};
use crate::Result;
use faer::Mat;

/// The modes of rails on pads that stand apart.
pub(super) struct OnBays {
    /// Angular frequencies, rad/s, `[m]`.
    pub omega: Vec<f64>,
    /// Their values at the contacts, `[9T, m]`.
    pub seen: Mat<f64>,
    /// Their damping matrix, 1/s, `[m, m]`; on rank 0.
    pub damping: Option<Mat<f64>>,
    /// Compliance beside that on even pads, `[9T, 9T]`.
    pub beside: Mat<f64>,
}

/// Collective: the modes of `rails` on their `bays`, from their modes `list` on even pads, with the values `seen` at
/// the contacts, `[9T, m]`, and their `damping`, 1/s, `[m, m]`.
pub(super) fn on_bays(
    world: &World,
    bays: &DiscreteSupports,
    (rails, list): (&[RailOnPads], &[RailMember]),
    seen: &Mat<f64>,
    damping: impl FnOnce() -> Result<Mat<f64>>,
) -> Result<OnBays> {
    let laid = world.on_root(|| {
        let laid = bays.lay(rails, list, &damping()?)?;
        Ok((seen * &laid.shares, laid.omega, laid.damping))
    })?;
    let omega = world.broadcast(laid.as_ref().map_or(Vec::new(), |l| l.1.clone()));
    let rows = seen.nrows();
    let numbers = laid.as_ref().map(|l| (0..rows * l.0.ncols()).map(|i| l.0[(i % rows, i / rows)]).collect());
    let numbers: Vec<f64> = world.broadcast(numbers.unwrap_or_default());
    let moved = Mat::from_fn(rows, omega.len(), |c, k| numbers[c + rows * k]);
    let even: Vec<f64> = list.iter().map(|&(rail, (of, index, _))| rails[rail].waves[of].omega[index]).collect();
    let beside = statics(&omega, moved.as_ref()) - statics(&even, seen.as_ref());
    Ok(OnBays { omega, seen: moved, damping: laid.map(|l| l.2), beside })
}
