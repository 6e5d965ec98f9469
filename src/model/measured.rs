//! Measured frequencies and damping in place of computed ones; shapes and residual compliance stay.

use crate::body::{ModeLabel, TraceModes};
use crate::job::{Body, Job, MeasuredMode, MeasuredShape};
use crate::{Error, Result};
use faer::Mat;
use std::f64::consts::PI;

/// Part of a frequency within which a mode is near it.
const NEAR: f64 = 0.03;
/// Part of a frequency within which modes of one name are a pair.
const PAIR: f64 = 1e-3;
/// Part of a frequency that is rounding.
const ROUNDING: f64 = 1e-12;
/// Modal assurance criterion from which on a computed mode is a measured one, and by how much it is better than others.
/// D. J. Ewins (Modal Testing, 2nd edition, 2000, 6.5) takes above 0.9 for the same mode, below 0.05 for another.
const ALIKE: f64 = 0.7;
const CLEAR: f64 = 0.1;
/// Part of the measured frequency within which the computed modes lie that a shape is compared with.
const COMPARED: f64 = 0.3;
/// Part of a shape, squared, that is left of another one of its pair where both are the same at the measured places.
const DEPENDENT: f64 = 1e-12;
/// Candidates that are told.
const TOLD: usize = 12;

/// Angular frequencies of modes, rad/s, with their names.
type KnownModes<'k> = (&'k [f64], &'k [ModeLabel]);

/// Modes of a body at points, (x, y, z) in its own coordinates, m; `[3p, m]`.
pub type ModesAt<'a> = dyn FnMut(&[[f64; 3]]) -> Result<Option<Mat<f64>>> + 'a;

/// Returns whether the mode `k` has the order and the family of a measured one, as far as these are given.
fn is_named(mode: &MeasuredMode, k: usize, names: &[ModeLabel]) -> bool {
    let name = names.get(k);
    mode.order.is_none_or(|n| name.is_some_and(|name| name.order == n))
        && mode.family.as_ref().is_none_or(|f| name.is_some_and(|name| name.family == *f))
}

/// The computed modes that a measured one may be by its order, its family and the frequency that it is near.
fn candidates(mode: &MeasuredMode, (omega, names): KnownModes) -> Vec<usize> {
    let near = |k: usize| mode.near.is_none_or(|f| (omega[k] / (2.0 * PI) - f).abs() <= NEAR * f);
    (0..omega.len()).filter(|&k| omega[k] > 0.0 && is_named(mode, k, names) && near(k)).collect()
}

/// The modes that a measured one has become: its frequency, where it has one, is that of the mode or the mean of those
/// of a pair.
fn taken(mode: &MeasuredMode, known: KnownModes) -> Vec<usize> {
    let (omega, names) = known;
    let Some(f) = mode.frequency else { return candidates(mode, known) };
    let is_it = |group: &[usize]| {
        let mean = group.iter().map(|&k| omega[k]).sum::<f64>() / (2.0 * PI * group.len() as f64);
        (mean - f).abs() <= ROUNDING * f
    };
    let named: Vec<usize> = (0..omega.len()).filter(|&k| omega[k] > 0.0 && is_named(mode, k, names)).collect();
    let pairs = named.windows(2).filter(|pair| are_one(pair, known)).map(<[usize]>::to_vec);
    let all: Vec<Vec<usize>> = pairs.chain(named.iter().map(|&k| vec![k])).collect();
    all.into_iter().find(|group| is_it(group)).unwrap_or_default()
}

/// Modes and pairs of one name among `modes`, whose numbers rise.
fn groups(modes: &[usize], known: KnownModes) -> Vec<Vec<usize>> {
    let mut all: Vec<Vec<usize>> = Vec::new();
    for &k in modes {
        match all.last_mut() {
            Some(last) if last.len() == 1 && are_one(&[last[0], k], known) => last.push(k),
            _ => all.push(vec![k]),
        }
    }
    all
}

/// True if modes are one, or a pair of one name.
fn are_one(found: &[usize], (omega, names): KnownModes) -> bool {
    let Some(&first) = found.first() else { return false };
    let same = |k: &usize| (omega[*k] - omega[first]).abs() <= PAIR * omega[first] && names.get(*k) == names.get(first);
    found.len() <= 2 && found.iter().all(same)
}

/// Modal assurance criterion of a measured shape s and the `group` of modes whose components φ at the measured places
/// are columns of `modes`: ‖Qᵀs‖²/‖s‖² with an orthonormal basis Q of the span of φ, which of one mode is
/// (φᵀs)²/(φᵀφ sᵀs). A pair of a round body has its nodal diameters anywhere.
fn assurance(shape: &MeasuredShape, group: &[usize], modes: &Mat<f64>) -> f64 {
    let measured: Vec<(usize, f64)> = shape.components().collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let values: Vec<f64> = measured.iter().map(|m| m.1).collect();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for &k in group {
        let mut column: Vec<f64> = measured.iter().map(|m| modes[(m.0, k)]).collect();
        let whole = product(&column, &column);
        for known in &basis {
            let along = product(known, &column);
            column.iter_mut().zip(known).for_each(|(c, q)| *c -= along * q);
        }
        let left = product(&column, &column);
        // A mode that rests at all these places, or moves there as the other one of its pair, adds nothing.
        if left > DEPENDENT * whole && left > 0.0 {
            basis.push(column.iter().map(|c| c / left.sqrt()).collect());
        }
    }
    let explained: f64 = basis.iter().map(|q| product(q, &values).powi(2)).sum();
    explained / product(&values, &values)
}

/// The mode or pair among `found`, near the measured `frequency`, Hz, whose shape is the measured one, with the modal
/// assurance criterion. An error where none is like it, or several are.
fn by_shape(
    path: &str,
    (shape, frequency): (&MeasuredShape, f64),
    found: &[usize],
    known: KnownModes,
    modes_at: &mut ModesAt,
) -> Result<(Vec<usize>, f64)> {
    let Some(modes) = modes_at(&shape.points)? else {
        return Err(Error::Job(format!(
            "{path}.shape: this body has no shapes to compare with; name the mode by order and family, or by near"
        )));
    };
    let is_near = |k: &usize| (known.0[*k] / (2.0 * PI) - frequency).abs() <= COMPARED * frequency;
    let near: Vec<usize> = found.iter().copied().filter(is_near).collect();
    let mut all: Vec<(Vec<usize>, f64)> =
        groups(&near, known).into_iter().map(|g| (g.clone(), assurance(shape, &g, &modes))).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    let told = |count: usize| {
        let of = |(group, mac): &(Vec<usize>, f64)| format!("{} with {mac:.2}", described(group[0], known));
        all.iter().take(count).map(of).collect::<Vec<_>>().join(", ")
    };
    match all.as_slice() {
        [] => Err(Error::Job(format!(
            "{path}.shape: found no computed mode that may be it within {:.0} % of {frequency} Hz, expected one; ask \
             for more modes in analyses.modes, or check the frequency",
            100.0 * COMPARED
        ))),
        [(_, best), ..] if *best < ALIKE => Err(Error::Job(format!(
            "{path}.shape: found no computed mode like it, expected one with a modal assurance criterion of {ALIKE} \
             or more; the nearest are {}. Check points, directions and signs",
            told(4)
        ))),
        [(_, best), (_, next), ..] if best - next < CLEAR => Err(Error::Job(format!(
            "{path}.shape: found several computed modes like it by the modal assurance criterion: {}; expected one \
             that is better by {CLEAR}. Give order, family or near as well, or more points",
            told(4)
        ))),
        [(group, best), ..] => Ok((group.clone(), *best)),
    }
}

/// Puts the measured frequencies of the body `name` of `job` into its `modes`; `modes_at` evaluates their shapes, the
/// same on every rank. An error where a measured mode is none of the computed ones, or several, or two are the same.
pub fn measure(job: &Job, name: &str, modes: &mut TraceModes, modes_at: &mut ModesAt) -> Result<()> {
    let Some(given) = of(job, name) else { return Ok(()) };
    let computed = modes.omega.clone();
    let known = (&computed[..], &modes.names[..]);
    let (mut all, mut matched): (Vec<usize>, Vec<(usize, f64)>) = (Vec::new(), Vec::new());
    for (i, mode) in given.iter().enumerate() {
        let path = format!("bodies.{name}.modes.measured.{i}");
        let mut found = candidates(mode, known);
        if let Some(shape) = &mode.shape {
            let (group, mac) = by_shape(&path, (shape, mode.frequency.unwrap_or(0.0)), &found, known, modes_at)?;
            matched.extend(group.iter().map(|&k| (k, mac)));
            found = group;
        }
        if !are_one(&found, known) {
            return Err(refused(&path, mode, &found, known));
        }
        if found.iter().any(|k| all.contains(k)) {
            return Err(Error::Job(format!(
                "{path}: found the mode {} again, expected each mode once",
                described(found[0], known)
            )));
        }
        all.extend(&found);
        if let Some(f) = mode.frequency {
            // A pair keeps its distance, which is of the mesh.
            let mean = found.iter().map(|&k| computed[k]).sum::<f64>() / found.len() as f64;
            let factor = 2.0 * PI * f / mean;
            let alike = (factor - 1.0).abs() <= ROUNDING;
            found.iter().filter(|_| !alike).for_each(|&k| modes.omega[k] = computed[k] * factor);
        }
    }
    (modes.computed, modes.matched) = (computed, matched);
    Ok(())
}

fn of<'a>(job: &'a Job, name: &str) -> Option<&'a [MeasuredMode]> {
    let body = job.bodies().into_iter().find(|(n, _)| *n == name)?.1;
    body.modes.as_ref().map(|m| &m.measured[..]).filter(|m| !m.is_empty())
}

/// A mode in words.
fn described(k: usize, (omega, names): KnownModes) -> String {
    let name = names.get(k).map_or(String::new(), |name| format!(" {name}"));
    format!("{:.2} Hz{name}", omega[k] / (2.0 * PI))
}

fn refused(path: &str, mode: &MeasuredMode, found: &[usize], known: KnownModes) -> Error {
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
        for k in taken(mode, (omega, names)) {
            modal[k] = loss * omega[k] - own(k);
        }
    }
}

/// Computed and present frequency of each mode whose frequency or shape was measured, in words.
pub fn shifts(modes: &TraceModes) -> Vec<String> {
    let known = (&modes.computed[..], &modes.names[..]);
    let shift = |k: usize| {
        let (from, to) = (modes.computed[k], modes.omega[k]);
        let name = described(k, known);
        let mac = modes.matched.iter().find(|of| of.0 == k).map(|of| format!(", MAC {:.3}", of.1));
        (from != to || mac.is_some()).then(|| {
            let shift = 100.0 * (to / from - 1.0);
            format!("{:.2} Hz in place of {name}, {shift:+.2} %{}", to / (2.0 * PI), mac.unwrap_or_default())
        })
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
        let given = job(r#"[{"order": 2, "family": "axial 0", "frequency": 358, "loss_factor": 3e-4}]"#);
        measure(&given, "upper", &mut found, &mut |_| Ok(None)).unwrap();
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
        measure(&job(&text), "upper", &mut found, &mut |_| Ok(None)).unwrap();
        assert!(found.omega == modes().omega && shifts(&found).is_empty());
        assert!(change(&found, &Mat::zeros(3, 6)).is_none());
    }

    /// The modes of a pair of a mesh keep their distance, and both have the damping.
    #[test]
    fn both_modes_of_an_uneven_pair_are_damped() {
        let mut found = modes();
        let given = job(r#"[{"near": 968, "order": 3, "frequency": 972, "loss_factor": 1e-3}]"#);
        measure(&given, "upper", &mut found, &mut |_| Ok(None)).unwrap();
        assert!(found.omega[3] != found.omega[4]);
        let mut modal = vec![0.0; 6];
        damp(given.bodies.upper.as_ref().unwrap(), (&found.omega, &found.names), &|_| 0.0, &mut modal);
        assert_eq!(modal, [0.0, 0.0, 0.0, 1e-3 * found.omega[3], 1e-3 * found.omega[4], 0.0]);
    }

    const PAIR_OF_TWO: &str = r#""frequency": 340"#;

    /// Motions at eight points about the axle, two components each: those of order 2, rotated by 20 degrees and with
    /// errors of some per cent, are of that pair.
    #[test]
    fn a_shape_finds_its_mode() {
        let at = |point: usize| [0.0, 0.7, 1.9, 3.0, 3.4, 4.1, 4.9, 5.6][point];
        let orders = [0.0, 2.0, 2.0, 3.0, 3.0, 2.0];
        // Axial and radial motion, of the last mode mostly radial.
        let parts = |k: usize| if k == 5 { [0.2, 1.0] } else { [1.0, 0.2] };
        let motion = |k: usize, theta: f64| {
            let angle = orders[k] * theta;
            let round = if k == 2 || k == 4 { angle.sin() } else { angle.cos() };
            [0.0, parts(k)[0] * round, parts(k)[1] * round]
        };
        let all = Mat::from_fn(24, 6, |row, k| motion(k, at(row / 3))[row % 3]);
        let shape = |error: f64| {
            let rows = (0..8).map(|point| {
                let of = |k: usize| motion(k, at(point) - 20.0 * PI / 180.0)[1..].to_vec();
                let [y, z] = [0, 1].map(|c| of(1)[c] + error * (7.0 * (2 * point + c) as f64).sin());
                format!("[null, {y}, {z}]")
            });
            rows.collect::<Vec<_>>().join(", ")
        };
        let given = |motion: &str, more: &str| {
            let points = ["[0, 0, 0]"; 8].join(", ");
            job(&format!(r#"[{{"shape": {{"points": [{points}], "motion": [{motion}]}}, {more}}}]"#))
        };
        let found = |motion: &str, more: &str| {
            let mut found = modes();
            measure(&given(motion, more), "upper", &mut found, &mut |points| {
                assert_eq!(points.len(), 8);
                Ok(Some(all.clone()))
            })
            .map(|()| found)
        };
        let exact = found(&shape(0.0), PAIR_OF_TWO).unwrap();
        assert_eq!(exact.matched.iter().map(|m| m.0).collect::<Vec<_>>(), [1, 2]);
        assert!((exact.matched[0].1 - 1.0).abs() < 1e-12 && (exact.omega[1] / (2.0 * PI) - 340.0).abs() < 1e-9);
        let near = found(&shape(0.05), PAIR_OF_TWO).unwrap();
        assert!(near.matched[0].0 == 1 && near.matched[0].1 > 0.97 && near.matched[0].1 < 1.0, "{:?}", near.matched);
        assert_eq!(shifts(&near).len(), 1);
        assert!(shifts(&near)[0].starts_with("340.00 Hz in place of 350.60 Hz (2, axial 0), -3.02 %, MAC 0.9"));
        // Of order 3 alone nothing is like it, and a motion that no mode has is none.
        for (motion, more, part) in [
            (shape(0.0), r#""order": 3, "frequency": 960"#, "no computed mode like it"),
            (
                ["[null, 1, 0], [null, -1, 3], [null, 0, 2], [null, 0.3, -2]"; 2].join(", "),
                PAIR_OF_TWO,
                "no computed mode like it",
            ),
        ] {
            let error = found(&motion, more).unwrap_err();
            assert!(error.exit_code() == 2 && error.message().contains(part), "{error}");
            assert!(error.message().contains("measured.0.shape") && error.message().contains(" with 0."), "{error}");
        }
        let error = measure(&given(&shape(0.0), PAIR_OF_TWO), "upper", &mut modes(), &mut |_| Ok(None)).unwrap_err();
        assert!(error.message().contains("has no shapes to compare with"), "{error}");
    }

    /// A shape that two modes have alike at the measured places is refused with both.
    #[test]
    fn a_shape_of_several_modes_is_refused() {
        let all =
            Mat::from_fn(6, 6, |row, k| ((row * (1 + if k == 5 { 3 } else { k })) as f64).sin() + 0.01 * k as f64);
        let motion: Vec<String> = (0..2)
            .map(|p| format!("[{}, {}, {}]", all[(3 * p, 3)], all[(3 * p + 1, 3)], all[(3 * p + 2, 3)]))
            .collect();
        let text = format!(
            r#"[{{"shape": {{"points": [[0, 0, 0], [1, 0, 0]], "motion": [{}]}}, "frequency": 980}}]"#,
            motion.join(", ")
        );
        let error = measure(&job(&text), "upper", &mut modes(), &mut |_| Ok(Some(all.clone()))).unwrap_err();
        assert!(error.message().contains("found several computed modes like it"), "{error}");
        assert!(error.message().contains("968.00 Hz (3, axial 0) with 1.00, 990.00 Hz"), "{error}");
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
            let error = measure(&job(text), "upper", &mut modes(), &mut |_| Ok(None)).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(parts.iter().all(|p| error.message().contains(p)), "{error}");
        }
    }
}
