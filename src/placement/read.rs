//! Profiles from files: which way they lie, and what is wrong with them.

use super::direction::{orient, ProfileDirections};
use super::formats::{ProfileFilePoint, ProfileFormat, RawProfile};
use super::profile::{ProfilePiece, RunningProfile};
use super::spline::spline;
use crate::input::text;
use crate::{Error, Result};
use std::path::Path;

/// Fewest points of a profile.
const MIN_POINTS: usize = 12;

/// Width of a profile, m.
const WIDTH: [f64; 2] = [0.03, 0.25];

/// Part of the width that the points must cross in one go.
const COVER: f64 = 0.75;

/// How far points that are left out may stand out of the line, m.
const HIDDEN: f64 = 5e-4;

/// How far a point may go back to be left out as noise, m.
const BACKSTEP: f64 = 5e-5;

/// A corner: a turn by more than this, rad, and by three times as much as at the points before and after.
const KINK: f64 = 0.35;

/// Distance of two points that makes a gap, m, if it is also eight times the usual one.
const HOLE: f64 = 4e-3;

/// Place of the running circle in a wheel's file of Miniprof, whose origin is the back of the flange, m.
const MINIPROF_CIRCLE: f64 = 0.07;

/// Body that a profile belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProfileKind {
    /// A wheel.
    Wheel,
    /// A rail.
    Rail,
}

/// Direction of z in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vertical {
    /// Downwards, as here.
    Down,
    /// Upwards.
    Up,
}

/// How a profile file is to be taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Wheel or rail.
    pub kind: ProfileKind,
    /// Length unit, m; without one that of the file, or mm.
    pub unit: Option<f64>,
    /// Direction of z in the file; without one it is seen from the flange or the head.
    pub z: Option<Vertical>,
    /// Reverse y: for a rail whose gauge side has the positive y.
    pub mirror: bool,
    /// y of the running circle in the file of a wheel, m; without one 0, in a file of Miniprof 70 mm from the back of
    /// the flange.
    pub circle: Option<f64>,
    /// Wavelength that is smoothed to half its height, m; 0 passes through all points.
    pub smoothing: f64,
}

impl Reading {
    /// The plain way for a wheel or a rail.
    pub fn plain(kind: ProfileKind) -> Self {
        Self { kind, unit: None, z: None, mirror: false, circle: None, smoothing: 0.0 }
    }
}

/// The profile in a file, and notes: what was understood, in one line, and what was done to it.
///
/// # Errors
/// A file that cannot be read; a line that is none of its format; too few points; a wrong unit; a direction of z that
/// cannot be seen; a line that is no function of y, or unsorted; a gap in it.
pub fn read(path: &Path, reading: &Reading) -> Result<(RunningProfile, Vec<String>)> {
    let name = path.display().to_string();
    let bytes =
        crate::input::read(path).map_err(|e| Error::Input(format!("{name}: {e}; expected a file with a profile")))?;
    let text = text::decode(&bytes).map_err(|e| Error::Input(format!("{name}: {e}")))?;
    profile_of(&name, &text, reading)
}

/// The profile in the text of a file called `name`, whose end says the format.
pub fn profile_of(name: &str, text: &str, reading: &Reading) -> Result<(RunningProfile, Vec<String>)> {
    if !(reading.smoothing >= 0.0 && reading.smoothing <= 0.05) {
        return Err(Error::Job(format!(
            "{name}: found a smoothing length of {} m, expected 0 to 0.05 m; a few mm take away the noise of a \
             measured profile",
            reading.smoothing
        )));
    }
    let format = ProfileFormat::from_name(name);
    let RawProfile { points, unit: own, stated, down, source, mut notes } = format.parse(name, text)?;
    if let (Some(key), Some(own), true) = (reading.unit, own, stated) {
        if key != own {
            return Err(Error::Input(format!(
                "{name}: found headings with the unit {own} m beside file.unit = {key} m; expected one unit, leave the \
                 key out"
            )));
        }
    }
    let unit = reading.unit.or(own).unwrap_or(1e-3);
    let sized = |v: f64| v.is_finite() && v.abs() < 1e12;
    if let Some(p) = points.iter().find(|p| !(sized(p.y) && sized(p.z))) {
        return Err(Error::Input(format!(
            "{name}, line {}: found {} {}, expected two numbers of a length",
            p.line, p.y, p.z
        )));
    }
    if points.len() < MIN_POINTS {
        return Err(Error::Input(format!(
            "{name}: found {} points, expected at least {MIN_POINTS}, better one each mm or less",
            points.len()
        )));
    }
    check_unit(name, &points, unit)?;
    let circle = match (reading.kind, format) {
        (ProfileKind::Rail, _) => 0.0,
        (ProfileKind::Wheel, ProfileFormat::Miniprof) => reading.circle.unwrap_or(MINIPROF_CIRCLE),
        (ProfileKind::Wheel, _) => reading.circle.unwrap_or(0.0),
    };
    let sign = if reading.mirror { -1.0 } else { 1.0 };
    let place = |p: ProfileFilePoint| ProfileFilePoint { y: sign * (unit * p.y - circle), z: unit * p.z, ..p };
    let mut points: Vec<ProfileFilePoint> = points.into_iter().map(place).collect();
    points.dedup_by(|b, a| (a.y - b.y).abs() < 1e-10 && (a.z - b.z).abs() < 1e-10);
    let z = reading.z.or(down.then_some(Vertical::Down));
    let seen = orient(name, &mut points, (reading.kind, z, reading.z.is_some()), &mut notes)?;
    let points = running_line(name, points, reading.kind, &mut notes)?;
    refuse_hole(name, &points)?;
    notes.insert(0, format!("{name}: read {}", understood(&points, &source, unit, &seen)));
    let mut profile = through(name, &points, reading.smoothing)?;
    if reading.kind == ProfileKind::Wheel {
        if !profile.contains(0.0) {
            let [from, to] = profile.range().map(|y| 1e3 * y);
            return Err(Error::Input(format!(
                "{name}: found a wheel's profile from y = {from:.1} to {to:.1} mm, expected the running circle, \
                 y = 0, inside it; say where in \
                 the file the running circle is"
            )));
        }
        let z = profile.local(0.0).z;
        if z.abs() > 5e-5 {
            notes.push(format!(
                "{name}: moved by {:.3} mm in z, so that the running circle has the wheel's radius",
                -1e3 * z
            ));
        }
        profile = profile.moved(0.0, -z);
    }
    Ok((profile, notes))
}

pub(super) fn width(points: &[ProfileFilePoint]) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |w, p| [w[0].min(p.y), w[1].max(p.y)])
}

fn check_unit(name: &str, points: &[ProfileFilePoint], unit: f64) -> Result<()> {
    let [from, to] = width(points);
    let fits = |unit: f64| (WIDTH[0]..=WIDTH[1]).contains(&((to - from) * unit));
    if fits(unit) {
        return Ok(());
    }
    let units = [("m", 1.0), ("inches", 0.0254), ("cm", 0.01), ("mm", 1e-3)];
    let likely: Vec<&str> = units.iter().filter(|(_, u)| fits(*u)).map(|(n, _)| *n).collect();
    let advice = match likely.is_empty() {
        true => "check the columns: y comes first".to_owned(),
        false => format!("it looks like {}: give that unit", likely.join(" or ")),
    };
    Err(Error::Input(format!(
        "{name}: found points from y = {from} to {to}, which is {:.3} mm wide in the unit taken, expected {:.0} \
         to {:.0} mm; {advice}",
        1e3 * (to - from) * unit,
        1e3 * WIDTH[0],
        1e3 * WIDTH[1]
    )))
}

/// A file as it was read, in words: points and their spacing, columns, unit, directions.
fn understood(points: &[ProfileFilePoint], source: &str, unit: f64, seen: &ProfileDirections) -> String {
    let [from, to] = width(points).map(|y| 1e3 * y);
    let apart: Vec<f64> = points.windows(2).map(|w| 1e3 * distance(w)).collect();
    let largest = apart.iter().copied().fold(0.0, f64::max);
    let at = apart.iter().position(|d| *d == largest).map_or(0.0, |k| 1e3 * points[k].y);
    let unit = match unit {
        1e-3 => "mm".to_owned(),
        u => format!("{u} m"),
    };
    format!(
        "{} points, {source}, in {unit}; {}; y from {from:.2} to {to:.2} mm, points {:.2} mm apart, {largest:.2} mm at \
         the most (y = {at:.2} mm)",
        points.len(),
        seen.words(),
        median(apart)
    )
}

/// Distance of the first two points, m.
fn distance(w: &[ProfileFilePoint]) -> f64 {
    (w[1].y - w[0].y).hypot(w[1].z - w[0].z)
}

pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The longest part along which y grows. Sides at its ends that hang over, as the back of a flange and the sides of a
/// rail's head may, are left out; a line that folds where it could touch is an error.
fn running_line(
    name: &str,
    mut points: Vec<ProfileFilePoint>,
    kind: ProfileKind,
    notes: &mut Vec<String>,
) -> Result<Vec<ProfileFilePoint>> {
    let forwards = points.windows(2).filter(|w| w[1].y > w[0].y).count();
    if 2 * forwards < points.len() {
        points.reverse();
    }
    let count = points.len();
    points.dedup_by(|b, a| b.y <= a.y && a.y - b.y < BACKSTEP && (b.z - a.z).abs() < BACKSTEP);
    if points.len() < count {
        notes.push(format!(
            "{name}: {} points that went back by less than {} mm were left out",
            count - points.len(),
            1e3 * BACKSTEP
        ));
    }
    let (mut best, mut start) = (0..0, 0);
    for k in 1..=points.len() {
        if k == points.len() || !(points[k].y > points[k - 1].y) {
            if k - start > best.len() {
                best = start..k;
            }
            start = k;
        }
    }
    let [from, to] = width(&points);
    let run = &points[best.clone()];
    let (Some(first), Some(last)) = (run.first(), run.last()) else {
        return Err(Error::Defect(format!("{name}: a profile without points")));
    };
    let line = |y: f64| -> f64 {
        let k = run.partition_point(|p| p.y <= y).clamp(1, run.len() - 1);
        let (a, b) = (run[k - 1], run[k]);
        a.z + (b.z - a.z) * ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0)
    };
    // Wheels are above their line, rails below it: z points down.
    let stands_out = |p: &ProfileFilePoint| match kind {
        ProfileKind::Wheel => p.z - line(p.y) > HIDDEN,
        ProfileKind::Rail => line(p.y) - p.z > HIDDEN,
    };
    let outside = || points[..best.start].iter().chain(&points[best.end..]);
    let short = last.y - first.y < COVER * (to - from);
    if short || outside().any(stands_out) {
        // The first place where y goes back.
        let back = points.windows(2).find(|w| !(w[1].y > w[0].y));
        let (a, b) = back.map_or((*first, *last), |w| (w[0], w[1]));
        return Err(Error::Input(format!(
            "{name}, line {}: found y going from {:.4} to {:.4} mm (line {}), against the direction of the \
             rest; expected a line that is a \
             function of y, its points sorted from one side to the other; sort the points, and cut off what hangs over",
            a.line.max(b.line),
            1e3 * a.y,
            1e3 * b.y,
            a.line.min(b.line)
        )));
    }
    let left_out = outside().count();
    if left_out > 0 {
        notes.push(format!(
            "{name}: {left_out} points of sides that hang over were left out; kept lines {} to {}",
            first.line, last.line
        ));
    }
    points.truncate(best.end);
    points.drain(..best.start);
    Ok(points)
}

fn refuse_hole(name: &str, points: &[ProfileFilePoint]) -> Result<()> {
    let usual = median(points.windows(2).map(distance).collect());
    let Some(w) = points.windows(2).find(|w| distance(w) > HOLE.max(8.0 * usual)) else { return Ok(()) };
    Err(Error::Input(format!(
        "{name}, line {}: found a gap of {:.2} mm in the line, between y = {:.2} and {:.2} mm, where points are \
         {:.2} mm apart elsewhere; \
         expected no gap: fill it, with points on a straight part too",
        w[0].line.max(w[1].line),
        1e3 * distance(w),
        1e3 * w[0].y,
        1e3 * w[1].y,
        1e3 * usual
    )))
}

/// The splines through the points, one between each two corners.
fn through(name: &str, points: &[ProfileFilePoint], smoothing: f64) -> Result<RunningProfile> {
    let y: Vec<f64> = points.iter().map(|p| p.y).collect();
    let z: Vec<f64> = points.iter().map(|p| p.z).collect();
    let direction: Vec<f64> = points.windows(2).map(|w| (w[1].z - w[0].z).atan2(w[1].y - w[0].y)).collect();
    let turn = |k: usize| match k {
        0 => 0.0,
        _ => direction.get(k).map_or(0.0, |d| (d - direction[k - 1]).abs()),
    };
    let corner = |k: usize| turn(k) > KINK && turn(k) > 3.0 * turn(k - 1).max(turn(k + 1));
    let n = points.len();
    let mut ends = vec![0];
    ends.extend((1..n - 1).filter(|&k| corner(k)));
    ends.push(n - 1);
    let pieces: Vec<ProfilePiece> =
        ends.windows(2).flat_map(|w| spline(&y[w[0]..=w[1]], &z[w[0]..=w[1]], smoothing)).collect();
    RunningProfile::new(name, y, pieces)
}

#[cfg(test)]
mod tests;
