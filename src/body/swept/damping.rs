//! Damping that a body of revolution brings itself: layers and springs of rings with a loss factor.

use super::Member;
use crate::parallel::World;
use crate::swept::{Attachment, Forms};
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

/// Frequencies between these parts of the tuning of an absorber are near it.
const NEAR: [f64; 2] = [0.7, 1.4];

/// Returns true if some of the body has a loss factor of its own.
fn is_lossy(forms: &Forms) -> bool {
    forms.section.layers.iter().any(|layer| layer.loss > 0.0) || forms.has_lossy_rings()
}

/// Modal damping matrix, 1/s, `[m, m]` on rank 0: of layers Σ η_l φ_aᵀK_lφ_b/√(ω_a ω_b), on the diagonal ω times the
/// loss factor of the mode, and ΦᵀCΦ of the dashpots of rings.
pub(super) fn matrix(world: &World, forms: &Forms, list: &[Member]) -> Option<Mat<f64>> {
    let between = |i: usize, j: usize| {
        let (a, b) = (&list[i], &list[j]);
        if (a.of.order, a.family) != (b.of.order, b.family) {
            return 0.0;
        }
        let scale = a.omega() * b.omega();
        let layers = if scale > 0.0 { a.of.lost[(a.index, b.index)] / scale.sqrt() } else { 0.0 };
        layers + a.of.viscous[(a.index, b.index)]
    };
    (is_lossy(forms) && world.is_root()).then(|| Mat::from_fn(list.len(), list.len(), between))
}

/// φᵀKφ of the modes in what has a loss factor of its own, 1/s², `[m]`; empty where nothing has. The springs of
/// `bearings`, where there are some, have none and do not turn: loss factors of the modes are those of the material.
pub(super) fn stored(forms: &Forms, list: &[Member], bearings: &[f64]) -> Vec<f64> {
    if is_lossy(forms) || !bearings.is_empty() {
        let of = |(k, m): (usize, &Member)| m.of.stored[m.index] + bearings.get(k).copied().unwrap_or(0.0);
        list.iter().enumerate().map(of).collect()
    } else {
        Vec::new()
    }
}

/// An error where a mode near the tuning of absorbers has as many nodal diameters as half of these, or more.
pub(super) fn refuse_coupled(forms: &Forms, list: &[Member]) -> Result<()> {
    for Attachment { name, frequency, highest, .. } in forms.attachments() {
        let Some(highest) = *highest else { continue };
        let near = |tuned: f64, omega: f64| NEAR[0] * tuned < omega && omega < NEAR[1] * tuned;
        let meets = |m: &&Member| m.of.order > highest && frequency.iter().flatten().any(|&w| near(w, m.omega()));
        if let Some(mode) = list.iter().filter(meets).max_by_key(|m| m.of.order) {
            let hertz = |omega: f64| omega / (2.0 * PI);
            let tuned = frequency.iter().flatten().copied().fold(0.0, f64::max);
            return Err(Error::Job(format!(
                "{name}.count: a mode at {:.1} Hz, near the tuning to {:.1} Hz, has {n} nodal diameters, but so few \
                 absorbers act as a ring on modes of up to {highest} only; expected more than {}, or another frequency",
                hertz(mode.omega()),
                hertz(tuned),
                2 * mode.of.order,
                n = mode.of.order
            )));
        }
    }
    Ok(())
}
