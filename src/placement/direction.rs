//! Directions of a profile in its file: z is to point down, the flange of a wheel and the gauge side of a rail are to
//! be at negative y.

use super::formats::ProfileFilePoint;
use super::read::{median, width, ProfileKind, Vertical};
use crate::{Error, Result};

/// Height from which the tip of a flange is one, above the tread, m.
const FLANGE: f64 = 0.015;

/// Height from which a wheel's profile without the tip of its flange shows the root of it, m: no chamfer is as high.
const ROOT: f64 = 0.010;

/// How much higher than anything on the other side of the tread that root is.
const ABOVE_OTHERS: f64 = 1.5;

/// Height of a rail's head from which it is seen which way that is round, m.
const HEAD: f64 = 1e-3;

/// Directions that a profile was found to have, or that were given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProfileDirections {
    /// True if z pointed up.
    up: bool,
    /// True if the flange or the head shows it; else it was given.
    shown: bool,
    /// True if y was reversed, as the flange or the gauge side was at positive y.
    reversed: bool,
    kind: ProfileKind,
}

impl ProfileDirections {
    /// The directions in words.
    pub fn words(&self) -> String {
        let z = if self.up { "z up in the file" } else { "z down" };
        let by = match (self.kind, self.shown) {
            (ProfileKind::Wheel, true) => "seen from the flange",
            (ProfileKind::Rail, true) => "seen from the head",
            (_, false) => "as given",
        };
        let side = match (self.kind, self.shown, self.reversed) {
            (ProfileKind::Wheel, true, true) => "flange at positive y in the file",
            (ProfileKind::Wheel, true, false) => "flange at negative y",
            (ProfileKind::Wheel, false, _) => {
                "no flange is seen, y is taken to point to the field side (mirror reverses it)"
            }
            (ProfileKind::Rail, _, true) => "gauge side at positive y in the file",
            (ProfileKind::Rail, _, false) => "gauge side at negative y",
        };
        format!("{z}, {by}; {side}")
    }
}

/// How high a point stands out of the level part of a profile, m, positive downwards, and that point: the tip of a
/// flange, the root of one, or the side of a rail's head. `None` where nothing shows which way the profile lies.
fn landmark(points: &[ProfileFilePoint], kind: ProfileKind) -> Option<(f64, ProfileFilePoint)> {
    // The tread and the tip of the flange, or the head of the rail.
    let level: Vec<ProfileFilePoint> =
        points.windows(2).filter(|w| (w[1].z - w[0].z).abs() < 0.5 * (w[1].y - w[0].y).abs()).map(|w| w[0]).collect();
    let middle = median(level.iter().map(|p| p.z).collect());
    let height = |p: &ProfileFilePoint| p.z - middle;
    let highest =
        |all: &[ProfileFilePoint]| all.iter().copied().max_by(|a, b| height(a).abs().total_cmp(&height(b).abs()));
    let found = |p: ProfileFilePoint| Some((height(&p), p));
    match kind {
        ProfileKind::Wheel => {
            if let Some(tip) = highest(&level).filter(|p| height(p).abs() > FLANGE) {
                return found(tip);
            }
            let root = highest(points)?;
            let opposite = points.iter().map(|p| -height(p) * height(&root).signum()).fold(0.0, f64::max);
            let is_root = height(&root).abs() > ROOT.max(ABOVE_OTHERS * opposite);
            if is_root {
                found(root)
            } else {
                None
            }
        }
        ProfileKind::Rail => highest(points).filter(|p| height(p).abs() > HEAD).and_then(found),
    }
}

/// Turns what points up or to the wrong side. `z` is the direction of the file where the job or its format says one;
/// `asked` is true if it was the job.
///
/// # Errors
/// A direction that neither the job says nor the profile shows, or on which both disagree.
pub(super) fn orient(
    name: &str,
    points: &mut [ProfileFilePoint],
    (kind, z, asked): (ProfileKind, Option<Vertical>, bool),
    notes: &mut Vec<String>,
) -> Result<ProfileDirections> {
    let landmark = landmark(points, kind);
    let shown = landmark.map(|(height, _)| if height < 0.0 { Vertical::Up } else { Vertical::Down });
    let (what, unseen) = match kind {
        ProfileKind::Wheel => ("flange", "no flange"),
        ProfileKind::Rail => ("head of the rail", "no round head"),
    };
    let direction = match (shown, z) {
        (Some(shown), Some(given)) if asked && shown != given => {
            let word = |v: Vertical| if v == Vertical::Up { "up" } else { "down" };
            return Err(Error::Input(format!(
                "{name}: found z pointing {}, as the {what} shows, expected {}, as profile.file.z says; correct the \
                 key, or leave it out",
                word(shown),
                word(given)
            )));
        }
        (Some(direction), _) | (None, Some(direction)) => direction,
        (None, None) => {
            return Err(Error::Input(format!(
                "{name}: found {unseen} that would show whether z points up or down; expected the direction in the \
                 job: give profile.file.z = \"down\" or \"up\""
            )));
        }
    };
    if direction == Vertical::Up {
        points.iter_mut().for_each(|p| p.z = -p.z);
        notes.push(format!("{name}: z pointed up; turned, z is down here"));
    }
    let [from, to] = width(points);
    let reversed = match kind {
        ProfileKind::Wheel => landmark.is_some_and(|(_, p)| p.y > 0.5 * (from + to)),
        ProfileKind::Rail => {
            // A profile measured from the top to the gauge side has that side alone.
            let top = points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
            let depth = |y: f64| {
                let near = points.iter().filter(|p| (p.y - y).abs() < 2e-3);
                near.map(|p| p.z - top).fold(0.0, f64::max)
            };
            depth(from) < 1e-2 && depth(to) >= 1e-2
        }
    };
    if reversed {
        points.iter_mut().for_each(|p| p.y = -p.y);
        let side = if kind == ProfileKind::Wheel { "flange" } else { "gauge side" };
        notes.push(format!("{name}: the {side} was at positive y; turned, positive y is the field side here"));
    }
    Ok(ProfileDirections { up: direction == Vertical::Up, shown: shown.is_some(), reversed, kind })
}
