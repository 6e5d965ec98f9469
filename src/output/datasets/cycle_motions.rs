//! The group `/sweep/cycles/motion`: the motions that the marches of a sweep end with, from which branches of limit
//! cycles begin.

use crate::output::{Reader, Table};
use crate::transient::cycle::CycleMotion;
use crate::{Error, Result};
use std::f64::consts::PI;

const GROUP: &str = "/sweep/cycles/motion";
/// Relative difference of frequencies, and of displacements at the contact of the largest one, of the same mode in two
/// runs.
const SAME: [f64; 2] = [1e-6, 1e-4];

/// The modes that motions consist of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionModes {
    /// Angular frequencies, rad/s, `[m]`.
    pub omega: Vec<f64>,
    /// Displacements (x, y, n) of the lower and the upper body at the middle of the contact grid, 1/√kg, `[6][m]`.
    pub at_contact: Vec<f64>,
}

/// Tables of motions in the order of a `shape`, each with the number of its modes among `models`; nothing where no
/// point moves.
pub fn tables(shape: &[usize], all: &[Option<(usize, CycleMotion)>], models: &[MotionModes]) -> Vec<Table> {
    if all.iter().all(Option::is_none) {
        return Vec::new();
    }
    let most = models.iter().map(|m| m.omega.len()).max().unwrap_or(0);
    // Of models with fewer modes the rest of a row is empty.
    let row = |values: &[f64]| {
        let mut row = values.to_vec();
        row.resize(most, f64::NAN);
        row
    };
    let path = |name: &str| format!("{GROUP}/{name}");
    let motions = |name: &str, units: &str, text: &str, of: &dyn Fn(&CycleMotion) -> &[f64]| {
        let values = all.iter().flat_map(|m| row(m.as_ref().map_or(&[], |m| of(&m.1))));
        Table::new(&path(name), units, text, &[shape, &[most]].concat(), values.collect::<Vec<f64>>()).summed()
    };
    let hertz = |m: &MotionModes| row(&m.omega.iter().map(|w| w / (2.0 * PI)).collect::<Vec<f64>>());
    let at_contact = |m: &MotionModes| m.at_contact.chunks(m.omega.len().max(1)).flat_map(row).collect::<Vec<f64>>();
    vec![
        motions(
            "displacement",
            "m kg^1/2",
            "Modal displacements from rest at the end of the march; NaN where nothing moves.",
            &|m| &m.q,
        ),
        motions("velocity", "m kg^1/2/s", "Modal velocities at the end of the march.", &|m| &m.v),
        Table::new(&path("period"), "s", "Period; of a motion that does not repeat itself the mean.", shape, {
            all.iter().map(|m| m.as_ref().map_or(f64::NAN, |m| m.1.period)).collect::<Vec<f64>>()
        })
        .summed(),
        Table::new(&path("model"), "1", "Row of the modes that follow; -1 where nothing moves.", shape, {
            all.iter().map(|m| m.as_ref().map_or(-1, |m| m.0 as i64)).collect::<Vec<i64>>()
        })
        .summed(),
        Table::new(&path("mode_frequency"), "Hz", "Frequencies of the modes of each model.", &[models.len(), most], {
            models.iter().flat_map(hertz).collect::<Vec<f64>>()
        })
        .summed(),
        Table::new(
            &path("mode_at_contact"),
            "kg^-1/2",
            "Displacements (x, y, n) of the lower and the upper body at the middle of the contact grid by each mode.",
            &[models.len(), 6, most],
            models.iter().flat_map(at_contact).collect::<Vec<f64>>(),
        )
        .summed(),
    ]
}

/// Returns whether a result has motions of a sweep, and no branches.
pub fn is_of_sweep(file: &Reader) -> bool {
    file.has(&format!("{GROUP}/displacement")) && !file.has("/cycles/motion")
}

/// Examines whether a point of a sweep over the key `along` moves: its period, s.
pub fn examine(file: &Reader, (along, place): (&str, usize)) -> Result<f64> {
    let refused = |what: String| Err(Error::Input(format!("{}: {what}", file.path().display())));
    if !file.has(&format!("/sweep/values/{along}")) {
        let keys = file.names("/sweep/values")?.join("\", \"");
        return refused(format!("found a sweep over \"{keys}\", expected one over \"{along}\""));
    }
    let all = file.verified_numbers(&format!("{GROUP}/period"))?.1;
    match all.get(place) {
        None => refused(format!(
            "found {} motions of limit cycles, expected one with the number {place}, from 0",
            all.len()
        )),
        Some(&period) if period > 0.0 => Ok(period),
        Some(_) => {
            let moving: Vec<String> = (0..all.len()).filter(|&i| all[i] > 0.0).map(|i| i.to_string()).collect();
            let moving = moving.join(", ");
            refused(format!("found no motion at the number {place} of the sweep; these move: {moving}"))
        }
    }
}

/// The motion of the point `place` (of several branches of points those of the first come first) of a sweep over the
/// key `along`, in the `modes` of this job, and the value of the key there.
///
/// # Errors
/// A sweep over another key, a point that does not move, or other modes.
pub fn read(file: &Reader, (along, place): (&str, usize), modes: &MotionModes) -> Result<(f64, CycleMotion)> {
    let period = examine(file, (along, place))?;
    let refused = |what: String| Error::Input(format!("{}: {what}", file.path().display()));
    let keys = file.numbers(&format!("/sweep/values/{along}"))?.1;
    let read = |name: &str| file.verified_numbers(&format!("{GROUP}/{name}"));
    let damaged = || refused(format!("{GROUP} is damaged"));
    let row = |name: &str, row: usize, rows: usize| -> Result<Vec<f64>> {
        let (shape, all) = read(name)?;
        let width = shape.last().copied().unwrap_or(0);
        all.get(row * rows * width..(row + 1) * rows * width).map(<[f64]>::to_vec).ok_or_else(damaged)
    };
    let model = match file.verified(&format!("{GROUP}/model"))?.1 {
        crate::output::Values::I64(all) => all.get(place).and_then(|&m| usize::try_from(m).ok()).ok_or_else(damaged)?,
        _ => return Err(damaged()),
    };
    let (q, v) = (row("displacement", place, 1)?, row("velocity", place, 1)?);
    let (frequency, at_contact) = (row("mode_frequency", model, 1)?, row("mode_at_contact", model, 6)?);
    let (m, most) = (modes.omega.len(), frequency.len());
    let count = frequency.iter().take_while(|f| f.is_finite()).count();
    let others = |what: String| {
        refused(format!(
            "{what}; a motion is taken over by its modes: run both jobs with the same bodies and analyses.modes, or \
             this one with --reuse of that file"
        ))
    };
    if count != m {
        return Err(others(format!("found {count} modes, expected the {m} of this job")));
    }
    let largest = modes.at_contact.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let mut signs = Vec::with_capacity(m);
    for k in 0..m {
        let own = modes.omega[k] / (2.0 * PI);
        if !((frequency[k] - own).abs() <= SAME[0] * own.max(1.0)) {
            return Err(others(format!("found a mode {} of {} Hz, expected {own} Hz", k + 1, frequency[k])));
        }
        let (there, here) = (|c: usize| at_contact[c * most + k], |c: usize| modes.at_contact[c * m + k]);
        let sign = if (0..6).map(|c| there(c) * here(c)).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        if (0..6).any(|c| !((sign * there(c) - here(c)).abs() <= SAME[1] * largest)) {
            return Err(others(format!("the mode {} of {own} Hz moves otherwise at the contact there", k + 1)));
        }
        signs.push(sign);
    }
    let signed = |all: &[f64]| signs.iter().zip(all).map(|(s, v)| s * v).collect::<Vec<f64>>();
    let key = keys.get(place % keys.len().max(1)).copied().ok_or_else(damaged)?;
    Ok((key, CycleMotion { q: signed(&q), v: signed(&v), period }))
}
