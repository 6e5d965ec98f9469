//! Rules of measured modes.

use super::super::model::*;

/// Fewest measured components of a shape: fewer fit too many modes.
const LEAST: usize = 6;

/// Faults of the measured modes of the body at `path` of `job`.
pub(super) fn check(path: &str, body: &Body, job: &Job, faults: &mut Vec<String>) {
    let Some(modes) = &body.modes else { return };
    let path = format!("{path}.modes.measured");
    let meshed = !matches!(body.mesh, None | Some(MeshSource::Extruded(_)));
    if !meshed {
        faults.push(format!("{path}: only for a body with a mesh of its own that is no rail; leave it out"));
    }
    if job.analyses.modes.is_none() {
        faults.push(format!("analyses.modes: missing; {path} changes the computed modes"));
    }
    let full = job.analyses.stability.as_ref().is_some_and(|s| s.full.is_some())
        || job.analyses.transient.as_ref().is_some_and(|t| t.model == super::super::TransientModel::Full);
    if full {
        faults.push(format!(
            "{path}: the full finite-element system has no modes to be changed; leave out one of the two"
        ));
    }
    for (i, mode) in modes.measured.iter().enumerate() {
        let mut fault = |text: &str| faults.push(format!("{path}.{i}: {text}"));
        if mode.order.is_none() && mode.near.is_none() && mode.shape.is_none() {
            fault("found neither order nor near nor shape, expected one of them, which say what mode it is");
        }
        if mode.family.is_some() && mode.order.is_none() {
            fault("found family without order, expected both");
        }
        if mode.frequency.is_none() && mode.loss().is_none() {
            fault("found nothing measured, expected frequency, loss_factor or damping_ratio");
        }
        if mode.loss_factor.is_some() && mode.damping_ratio.is_some() {
            fault("found loss_factor and damping_ratio, expected one of them");
        }
        for (key, deviation, value) in [
            ("frequency", mode.frequency_deviation, mode.frequency),
            ("loss_factor", mode.loss_factor_deviation, mode.loss_factor),
            ("damping_ratio", mode.damping_ratio_deviation, mode.damping_ratio),
        ] {
            if deviation.is_some() && value.is_none() {
                fault(&format!("found {key}_deviation without {key}, expected both"));
            }
        }
        if let Some(shape) = &mode.shape {
            if mode.frequency.is_none() {
                fault("found shape without frequency, expected the measured frequency of this shape");
            }
            check_shape(shape, &mut |text| fault(&format!("shape: {text}")));
        }
    }
}

/// Faults of a measured shape.
fn check_shape(shape: &MeasuredShape, fault: &mut dyn FnMut(&str)) {
    let (points, motions) = (shape.points.len(), shape.motion.len());
    if points != motions {
        fault(&format!("found {points} points and {motions} motions, expected as many of both"));
    }
    let measured: Vec<f64> = shape.components().map(|(_, value)| value).collect();
    if measured.len() < LEAST {
        fault(&format!(
            "found {} measured components, expected at least {LEAST}, by which modes can be told apart",
            measured.len()
        ));
    } else if measured.iter().all(|v| *v == 0.0) {
        fault("found a motion of 0 everywhere, expected displacements in any unit");
    }
}
