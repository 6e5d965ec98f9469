//! Damping of modes, as a job gives it.

use crate::body::{ModalMatrix, ModeLabel};
use crate::job::{self, ModalDamping};
use crate::parallel::World;
use crate::{Error, Result};

/// Intrinsic damping of a body.
#[derive(Debug, Clone, Default)]
pub struct IntrinsicDamping {
    /// ΦᵀCΦ of its damping matrix, 1/s, where it has one.
    pub matrix: Option<ModalMatrix>,
    /// φᵀKφ of its modes in springs that have a loss factor of their own, 1/s², `[m]`; empty where there are none.
    pub springs: Vec<f64>,
}

impl IntrinsicDamping {
    /// Collective: that of rank 0 on every rank.
    pub fn broadcast(world: &World, root: Option<&Self>) -> Self {
        let matrix = ModalMatrix::broadcast(world, root.and_then(|own| own.matrix.as_ref()));
        let springs = world.broadcast(root.map_or(Vec::new(), |own| own.springs.clone()));
        Self { matrix: (matrix.order() > 0).then_some(matrix), springs }
    }
}

/// Modal damping coefficients c_k of modes with the angular frequencies `omega` (rad/s), 1/s, `[m]`: α + β ω_k², or
/// with loss factors η_k η_k (ω_k² − s_k)/ω_k, where s_k = φᵀKφ is what a mode has in `springs` with a loss factor of
/// their own. `names` has the nodal diameters, where they are known; `key` names the damping in messages.
pub fn damping(
    given: &job::Damping,
    (omega, names): (&[f64], &[ModeLabel]),
    springs: &[f64],
    key: &str,
) -> Result<Vec<f64>> {
    let factor = |k: usize, frequency: f64| -> Result<f64> {
        match &given.modal {
            Some(ModalDamping::ByMode(factors)) => Ok(factors.get(k).or(factors.last()).map_or(0.0, |f| f.0)),
            Some(ModalDamping::ByFrequency(bands)) => {
                match bands.iter().find(|b| b.up_to.is_none_or(|end| frequency <= end)) {
                    Some(band) => Ok(band.loss_factor.0),
                    None => Err(Error::Job(format!(
                        "{key}.modal.by_frequency: mode {} at {frequency:.1} Hz lies above the last band; \
                         raise its up_to, or leave it out for a band without end",
                        k + 1
                    ))),
                }
            }
            Some(ModalDamping::ByDiameter(factors)) => match names.get(k) {
                Some(name) => Ok(factors.get(name.order as usize).or(factors.last()).map_or(0.0, |f| f.0)),
                None => Err(Error::Job(format!(
                    "{key}.modal.by_diameter: the nodal diameters of the modes are not known; they are of \
                     bodies with mesh.revolved and of those that rotate"
                ))),
            },
            None => Ok(0.0),
        }
    };
    let coefficient = |(k, &w): (usize, &f64)| match given.modal {
        Some(_) => {
            let elastic = springs.get(k).map_or(w, |s| if w > 0.0 { (w - s / w).max(0.0) } else { 0.0 });
            Ok(elastic * factor(k, w / (2.0 * std::f64::consts::PI))?)
        }
        None => Ok(given.alpha + given.beta * w * w),
    };
    omega.iter().enumerate().map(coefficient).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{DampingBand, LossFactor};

    fn modal(modal: ModalDamping) -> job::Damping {
        job::Damping { modal: Some(modal), ..Default::default() }
    }

    #[test]
    fn damping_is_rayleigh_or_by_loss_factors() {
        let omega = [0.0, 100.0, 1000.0, 1e4];
        let rayleigh = job::Damping { alpha: 2.0, beta: 1e-6, modal: None };
        assert_eq!(damping(&rayleigh, (&omega, &[]), &[], "d").unwrap(), [2.0, 2.01, 3.0, 102.0]);
        let by_mode = modal(ModalDamping::ByMode(vec![LossFactor(0.5), LossFactor(0.01), LossFactor(0.002)]));
        assert_eq!(damping(&by_mode, (&omega, &[]), &[], "d").unwrap(), [0.0, 1.0, 2.0, 20.0]);
        // Half of what the second mode stores, and all of the third one, is in springs that have their own loss.
        let springs = [0.0, 5e3, 1e6, 0.0];
        assert_eq!(damping(&by_mode, (&omega, &[]), &springs, "d").unwrap(), [0.0, 0.5, 0.0, 20.0]);
        assert_eq!(damping(&rayleigh, (&omega, &[]), &springs, "d").unwrap(), [2.0, 2.01, 3.0, 102.0]);
        let band = |up_to: Option<f64>, eta: f64| DampingBand { up_to, loss_factor: LossFactor(eta) };
        let end = 1000.0 / (2.0 * std::f64::consts::PI);
        let bands = modal(ModalDamping::ByFrequency(vec![band(Some(end), 0.01), band(None, 0.001)]));
        assert_eq!(damping(&bands, (&omega, &[]), &[], "d").unwrap(), [0.0, 1.0, 10.0, 10.0]);
        let short = modal(ModalDamping::ByFrequency(vec![band(Some(end), 0.01)]));
        let error = damping(&short, (&omega, &[]), &[], "bodies.lower.damping").unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.message().contains("bodies.lower.damping.modal.by_frequency: mode 4 at 1591.5 Hz"), "{error}");
    }
}
