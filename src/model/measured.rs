//! Measured frequencies and damping in place of computed ones; shapes and residual compliance stay.

use crate::body::{ModeLabel, TraceModes};
use crate::job::{Body, Job, MeasuredMode};
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

/// Part of a frequency within which a mode is near it.
const NEAR: f64 = 0.03;
/// Part of a frequency within which modes of one name are a pair.
const PAIR: f64 = 1e-3;
/// Part of a frequency that is rounding.
const ROUNDING: f64 = 1e-12;
/// Candidates that are told.
const TOLD: usize = 12;

/// The modes of a `body` that a measured one is, of those with the angular frequencies `omega` (rad/s) and `names`.
/// With `taken` the measured frequency has been put into `omega`.
fn places(mode: &MeasuredMode, (omega, names): (&[f64], &[ModeLabel]), taken: bool) -> Vec<usize> {
    let hertz = |k: usize| omega[k] / (2.0 * PI);
    let named = |k: usize| {
        let name = names.get(k);
        mode.order.is_none_or(|n| name.is_some_and(|name| name.order == n))
            && mode.family.as_ref().is_none_or(|f| name.is_some_and(|name| name.family == *f))
    };
    let near = |k: usize| match (mode.near, mode.frequency.filter(|_| taken)) {
        (None, _) => true,
        (Some(_), Some(f)) => (hertz(k) - f).abs() <= ROUNDING * f,
        (Some(f), None) => (hertz(k) - f).abs() <= NEAR * f,
    };
    (0..omega.len()).filter(|&k| omega[k] > 0.0 && named(k) && near(k)).collect()
}

/// True if modes are one, or a pair of one name.
fn are_one(found: &[usize], (omega, names): (&[f64], &[ModeLabel])) -> bool {
    let Some(&first) = found.first() else { return false };
    let same = |k: &usize| (omega[*k] - omega[first]).abs() <= PAIR * omega[first] && names.get(*k) == names.get(first);
    found.len() <= 2 && found.iter().all(same)
}

/// Puts the measured frequencies of the body `name` of `job` into its `modes`. An error where a measured mode is none
/// of the computed ones, or several, or two are the same.
pub fn measure(job: &Job, name: &str, modes: &mut TraceModes) -> Result<()> {
    let Some(given) = of(job, name) else { return Ok(()) };
    let computed = modes.omega.clone();
    let known = (&computed[..], &modes.names[..]);
    let mut taken: Vec<usize> = Vec::new();
    for (i, mode) in given.iter().enumerate() {
        let path = format!("bodies.{name}.modes.measured.{i}");
        let found = places(mode, known, false);
        if !are_one(&found, known) {
            return Err(refused(&path, mode, &found, known));
        }
        if found.iter().any(|k| taken.contains(k)) {
            return Err(Error::Job(format!(
                "{path}: found the mode {} again, expected each mode once",
                described(found[0], known)
            )));
        }
        taken.extend(&found);
        if let Some(f) = mode.frequency {
            // A pair keeps its distance, which is of the mesh.
            let mean = found.iter().map(|&k| computed[k]).sum::<f64>() / found.len() as f64;
            let factor = 2.0 * PI * f / mean;
            let alike = (factor - 1.0).abs() <= ROUNDING;
            found.iter().filter(|_| !alike).for_each(|&k| modes.omega[k] = computed[k] * factor);
        }
    }
    modes.computed = computed;
    Ok(())
}

fn of<'a>(job: &'a Job, name: &str) -> Option<&'a [MeasuredMode]> {
    let body = job.bodies().into_iter().find(|(n, _)| *n == name)?.1;
    body.modes.as_ref().map(|m| &m.measured[..]).filter(|m| !m.is_empty())
}

/// A mode in words.
fn described(k: usize, (omega, names): (&[f64], &[ModeLabel])) -> String {
    let name = names.get(k).map_or(String::new(), |name| format!(" {name}"));
    format!("{:.2} Hz{name}", omega[k] / (2.0 * PI))
}

fn refused(path: &str, mode: &MeasuredMode, found: &[usize], known: (&[f64], &[ModeLabel])) -> Error {
    let count = match found.len() {
        0 => "no computed mode".into(),
        n => format!("{n} computed modes"),
    };
    // Those that are meant, or those nearest to what is known of it.
    let about = mode.near.or(mode.frequency);
    let mut all: Vec<usize> = match found.len() {
        0 => (0..known.0.len()).filter(|&k| known.0[k] > 0.0).collect(),
        _ => found.to_vec(),
    };
    if let Some(f) = about {
        let far = |k: &usize| (known.0[*k] / (2.0 * PI) - f).abs();
        all.sort_by(|a, b| far(a).total_cmp(&far(b)));
    }
    let mut list: Vec<String> = all.iter().map(|&k| described(k, known)).collect();
    list.dedup();
    let more = if list.len() > TOLD { ", ..." } else { "" };
    list.truncate(TOLD);
    Error::Job(format!(
        "{path}: found {count} with {}, expected one; candidates are {}{more}",
        mode.described(),
        list.join(", ")
    ))
}

/// The change of the compliance at the contact `rows` of a body with these `modes` where measured frequencies took the
/// place of computed ones: the residual stays. None where nothing was measured.
pub(super) fn change(modes: &TraceModes, rows: &Mat<f64>) -> Option<Mat<f64>> {
    let changed: Vec<usize> =
        (0..modes.computed.len()).filter(|&k| modes.computed[k] != modes.omega[k] && modes.omega[k] > 0.0).collect();
    if changed.is_empty() {
        return None;
    }
    let part = |k: usize| modes.omega[k].powi(-2) - modes.computed[k].powi(-2);
    let phi = Mat::from_fn(rows.nrows(), changed.len(), |i, j| rows[(i, changed[j])]);
    let scaled = Mat::from_fn(rows.nrows(), changed.len(), |i, j| rows[(i, changed[j])] * part(changed[j]));
    Some(phi * scaled.transpose())
}

/// Puts the measured damping of `body` into the coefficients `modal`, 1/s, of modes with the angular frequencies
/// `omega`, rad/s, which are measured where that was done; `own` is what a mode has by a damping matrix beside them.
pub(super) fn damp(body: &Body, (omega, names): (&[f64], &[ModeLabel]), own: &dyn Fn(usize) -> f64, modal: &mut [f64]) {
    for mode in body.modes.iter().flat_map(|m| &m.measured) {
        let Some(loss) = mode.loss() else { continue };
        for k in places(mode, (omega, names), true) {
            modal[k] = loss * omega[k] - own(k);
        }
    }
}

/// Computed and present frequency of each mode whose frequency was measured, in words.
pub fn shifts(modes: &TraceModes) -> Vec<String> {
    let known = (&modes.computed[..], &modes.names[..]);
    let shift = |k: usize| {
        let (from, to) = (modes.computed[k], modes.omega[k]);
        let name = described(k, known);
        (from != to)
            .then(|| format!("{:.2} Hz in place of {name}, {:+.2} %", to / (2.0 * PI), 100.0 * (to / from - 1.0)))
    };
    let mut all: Vec<String> = (0..modes.computed.len()).filter_map(shift).collect();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn modes() -> TraceModes {
        let omega = [100.0, 350.6, 350.6, 968.0, 968.001, 990.0].map(|f| 2.0 * PI * f).to_vec();
        let name = |order: u32, family: &str| ModeLabel { order, family: family.into() };
        let names = [(0, "axial 0"), (2, "axial 0"), (2, "axial 0"), (3, "axial 0"), (3, "axial 0"), (2, "radial 0")];
        let names = names.map(|(n, f)| name(n, f)).to_vec();
        TraceModes { omega, names, ..TraceModes::default() }
    }

    fn job(measured: &str) -> Job {
        let mut job = crate::job::example::two_cylinders(&[]);
        let given = serde_json::from_str(measured).unwrap();
        if let Some(body) = &mut job.bodies.upper {
            body.modes = Some(crate::job::GivenModes { measured: given });
        }
        job
    }

    #[test]
    fn a_pair_is_moved_and_its_compliance_with_it() {
        let mut found = modes();
        measure(
            &job(r#"[{"order": 2, "family": "axial 0", "frequency": 358, "loss_factor": 3e-4}]"#),
            "upper",
            &mut found,
        )
        .unwrap();
        assert!((found.omega[1] / (2.0 * PI) - 358.0).abs() < 1e-9 && found.omega[1] == found.omega[2]);
        assert_eq!([found.omega[0], found.omega[5]], [found.computed[0], found.computed[5]]);
        assert_eq!(shifts(&found), ["358.00 Hz in place of 350.60 Hz (2, axial 0), +2.11 %"]);
        let rows = Mat::from_fn(3, 6, |i, k| (i + k) as f64);
        let change = change(&found, &rows).unwrap();
        let want: f64 = [1, 2]
            .map(|k| rows[(0, k)] * rows[(2, k)] * (found.omega[k].powi(-2) - found.computed[k].powi(-2)))
            .iter()
            .sum();
        assert!((change[(0, 2)] - want).abs() < 1e-15 * want.abs().max(1e-12));
        let mut modal = vec![1.0; 6];
        let job = job(r#"[{"near": 351, "order": 2, "frequency": 358, "loss_factor": 3e-4}]"#);
        let body = job.bodies.upper.as_ref().unwrap();
        damp(body, (&found.omega, &found.names), &|k| if k == 1 { 0.5 } else { 0.0 }, &mut modal);
        assert_eq!(modal, [1.0, 3e-4 * found.omega[1] - 0.5, 3e-4 * found.omega[2], 1.0, 1.0, 1.0]);
    }

    /// The computed frequency itself changes no bit.
    #[test]
    fn a_measured_frequency_that_is_the_computed_one_changes_nothing() {
        let mut found = modes();
        let text = format!(r#"[{{"order": 2, "family": "axial 0", "frequency": {}}}]"#, found.omega[1] / (2.0 * PI));
        measure(&job(&text), "upper", &mut found).unwrap();
        assert!(found.omega == modes().omega && shifts(&found).is_empty());
        assert!(change(&found, &Mat::zeros(3, 6)).is_none());
    }

    #[test]
    fn what_is_none_or_two_is_refused_with_candidates() {
        for (text, parts) in [
            (r#"[{"order": 7, "frequency": 400}]"#, ["no computed mode with order 7", "350.60 Hz (2, axial 0)"]),
            (r#"[{"order": 2, "frequency": 400}]"#, ["3 computed modes with order 2", "990.00 Hz (2, radial 0)"]),
            (r#"[{"near": 975, "frequency": 400}]"#, ["3 computed modes with near 975 Hz", "968.00 Hz (3, axial 0)"]),
            (
                r#"[{"near": 351, "frequency": 355}, {"order": 2, "family": "axial 0", "loss_factor": 0.1}]"#,
                ["measured.1: found the mode 350.60 Hz", "each mode once"],
            ),
        ] {
            let error = measure(&job(text), "upper", &mut modes()).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(parts.iter().all(|p| error.message().contains(p)), "{error}");
        }
    }
}
