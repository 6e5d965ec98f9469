//! Places of contact of a wheel that moves over its rail: shift, yaw and roll change, the profiles stay.

use super::pose::WheelPose;
use super::touch::{Close, WheelOverRail};
use super::{RailSide, RunningProfile, WheelPlacement};
use crate::{Error, Result};

/// Smallest distance of two places of contact along the wheel's profile, m. Nearer minima of the distance are ripples
/// of one contact.
const APART: f64 = 2.5e-3;

/// Distance of two places from which on both count in full, m.
const WELL_APART: f64 = 3.5e-3;

/// Height of the ridge between a place and a nearer one above the place from which on it counts in full, m. Below it
/// the place is about to become a shoulder of the other one, and its load fades: it would jump otherwise, and there
/// would be radii without an equilibrium.
const PROMINENT: f64 = 1.5e-6;

/// Half of the width over which the curvature across the track is averaged, m: arcs of a profile change their radius
/// within a contact.
const AVERAGED: f64 = 0.5e-3;

/// Largest and smallest ratio of the curvature across to that along the track for which a contact counts as an ellipse.
const RATIO: [f64; 2] = [0.01, 250.0];

/// Distance of the places at which the angle of the flange is looked at, m, and by how much it may miss its largest,
/// rad.
const FLANGE_STEP: f64 = 1e-4;
const FLANGE_ANGLE: f64 = 1e-3;

/// Distance of a place of contact from the one that is asked for within which it is that one, m.
const NEAR: f64 = 1.5e-3;

/// Vertical distance of another place, m, up to which it may carry load beside the one that is asked for.
const MAY_CLOSE: f64 = 0.3e-3;

/// Distance of the places at which the ridge between two contacts is looked for, m.
const RIDGE_STEP: f64 = 5e-5;

/// Distance of the places at which the height of a ridge is looked at, m.
const SCAN_STEP: f64 = 1e-4;

/// Smallest curvature along the track, 1/m: a wheel on the back of its flange has none, and no load there is a
/// solution.
const FLAT: f64 = 0.05;

/// A wheel over its rail, to be moved.
#[derive(Debug, Clone)]
pub struct MovableWheel {
    side: RailSide,
    pair: WheelOverRail,
    rail_shift: f64,
}

/// A place where a wheel touches its rail or comes close to it. Signs are those of the track frame (x forwards, y to
/// the right, z down).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPlace {
    /// Position on the wheel's profile, m: positive to the field side of the running circle.
    pub wheel: f64,
    /// Position on the rail's profile after its cant, m: positive to the field side of its origin.
    pub rail: f64,
    /// Position in the track, m: forwards of the axle, and to the right of the middle of the axle.
    pub arm: [f64; 2],
    /// Position to the right of the middle of the track, m.
    pub across: f64,
    /// Contact angle δ, rad: positive where the rail falls to the right.
    pub angle: f64,
    /// Rolling radius, m.
    pub radius: f64,
    /// Vertical distance of wheel and rail, m, when the axle is one radius above the rails' tops.
    pub distance: f64,
    /// Share of its own force that the place has beside a nearer one, from which it hardly stands apart; 1 of a place
    /// by itself.
    pub share: f64,
    /// Curvatures of the gap along and across, 1/m, in the tangent plane; the second averaged over a millimetre of
    /// width.
    pub curvature: [f64; 2],
}

impl MovableWheel {
    /// Both profiles with y to the field side and z down, on the track of `track`, whose position is not used.
    ///
    /// # Errors
    /// Values that are no track; a rail whose gauge cannot be measured.
    pub fn new(track: &WheelPlacement, wheel: &RunningProfile, rail: &RunningProfile) -> Result<Self> {
        track.check()?;
        let (rail, rail_shift, _) = track.rail_in_track(rail)?;
        let wheel = WheelPose::in_middle(wheel.clone(), track.radius, 0.5 * track.circles);
        Ok(Self { side: track.side, pair: WheelOverRail::new(wheel, rail), rail_shift })
    }

    /// The side of the track.
    pub fn side(&self) -> RailSide {
        self.side
    }

    /// Largest angle that the flange has, rad, and the position of the lower end of that part of the wheel's profile,
    /// m.
    pub fn flange(&self) -> (f64, f64) {
        let profile = &self.pair.wheel.profile;
        let angle = |y: f64| -profile.local(y).slope.atan();
        let side: Vec<f64> = profile.nodes(FLANGE_STEP).into_iter().filter(|&y| y < 0.0).collect();
        let steepest = side.iter().map(|&y| angle(y)).fold(0.0, f64::max);
        let end = side.iter().copied().find(|&y| angle(y) >= steepest - FLANGE_ANGLE).unwrap_or(0.0);
        (steepest, end)
    }

    /// Places of contact of the wheel of an axle with the shift `lateral`, m, the `yaw` and the `roll`, rad, the
    /// nearest first.
    ///
    /// # Errors
    /// Profiles that do not lie over each other, or touch at an end or at a corner.
    pub fn places(&self, lateral: f64, yaw: f64, roll: f64) -> Result<Vec<ContactPlace>> {
        let sign = self.side.sign();
        let mut pair = self.pair.clone();
        (pair.wheel.lateral, pair.wheel.yaw, pair.wheel.roll) = (sign * lateral, sign * yaw, sign * roll);
        let mut kept: Vec<Close> = Vec::new();
        for place in pair.minima()? {
            if kept.iter().all(|k| (k.lowest.wheel_y - place.lowest.wheel_y).abs() >= APART) {
                kept.push(place);
            }
        }
        let share = |k: usize| kept[..k].iter().map(|nearer| prominence(&pair, nearer, &kept[k])).fold(1.0, f64::min);
        Ok(kept.iter().enumerate().map(|(k, close)| self.described(&pair, close, share(k))).collect())
    }

    fn described(&self, pair: &WheelOverRail, close: &Close, share: f64) -> ContactPlace {
        let sign = self.side.sign();
        let [x, y, _] = close.lowest.point;
        ContactPlace {
            wheel: close.lowest.wheel_y,
            rail: y - self.rail_shift,
            arm: [x, sign * (y - pair.wheel.lateral)],
            across: sign * y,
            angle: sign * close.rail_slope.atan(),
            radius: pair.wheel.radius_at(close.lowest.wheel_y),
            distance: close.distance,
            share,
            curvature: averaged(pair, close),
        }
    }
}

/// Share of its own force that the place `here` has beside the place `nearer`, which is nearer to the rail: by the
/// ridge between them and by their distance, both smoothly from 0 to 1.
fn prominence(pair: &WheelOverRail, nearer: &Close, here: &Close) -> f64 {
    let [from, to] = [nearer, here].map(|c| c.lowest.wheel_y);
    let apart = (to - from).abs();
    let steps = (apart / SCAN_STEP).ceil() as usize;
    let close = pair.closing();
    let at = |k: usize| close(from + (to - from) * k as f64 / steps as f64).map_or(f64::NEG_INFINITY, |c| c.distance);
    let ridge = (1..steps).map(at).fold(here.distance, f64::max);
    let smooth = |t: f64| {
        let t = t.clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    smooth((ridge - here.distance) / PROMINENT).min(smooth((apart - APART) / (WELL_APART - APART)))
}

/// Curvatures of the gap along and across the track, 1/m.
///
/// The distance D(y) of the lowest line to the rail is the gap minimised over x, so that D″ = h_yy − h_xy²/h_xx; D″ is
/// averaged over the change of the slopes either side of the place.
fn averaged(pair: &WheelOverRail, close: &Close) -> [f64; 2] {
    let (h, _) = pair.curvatures(close);
    let along = h[0][0].max(FLAT);
    let opening = |c: Close| c.rail_slope.atan() - c.lowest.slope.atan();
    let closing = pair.closing();
    let beside = [-AVERAGED, AVERAGED].map(|d| closing(close.lowest.wheel_y + d));
    let across = match beside {
        [Some(left), Some(right)] => {
            let [a, b] = [left, right].map(|c| c.lowest.point);
            let mean = (opening(right) - opening(left)) / (b[1] - a[1]).hypot(b[2] - a[2]);
            mean + h[0][1] * h[0][1] / along
        }
        _ => h[1][1],
    };
    [along, across.clamp(RATIO[0] * along, RATIO[1] * along)]
}

/// Moves the place of contact at the position `near` of the wheel's profile, m, to the front of `minima`.
///
/// # Errors
/// No such place.
pub(super) fn bring_to_front(minima: &mut [Close], near: f64) -> Result<()> {
    let off = |c: &Close| (c.lowest.wheel_y - near).abs();
    let nearest = (0..minima.len()).min_by(|&a, &b| off(&minima[a]).total_cmp(&off(&minima[b])));
    match nearest.filter(|&k| off(&minima[k]) <= NEAR) {
        Some(k) => {
            minima[..=k].rotate_right(1);
            Ok(())
        }
        None => {
            let places: Vec<String> = minima.iter().map(|c| format!("{:.2}", 1e3 * c.lowest.wheel_y)).collect();
            Err(Error::Job(format!(
                "placement: found no place of contact within {} mm of y = {:.2} mm of the wheel's profile; \
                 wheel and rail come close at {} mm",
                1e3 * NEAR,
                1e3 * near,
                places.join(", ")
            )))
        }
    }
}

/// The part of the wheel's profile that belongs to the first of `minima`, m, as far as the ridges towards other places
/// that may carry load beside it; none without any.
pub(super) fn bounds(pair: &WheelOverRail, minima: &[Close]) -> Option<[f64; 2]> {
    let (first, rest) = minima.split_first()?;
    let here = first.lowest.wheel_y;
    let rivals =
        rest.iter().filter(|c| (c.lowest.wheel_y - here).abs() >= APART && c.distance - first.distance < MAY_CLOSE);
    let close = pair.closing();
    let mut bounds = [f64::NEG_INFINITY, f64::INFINITY];
    for there in rivals.map(|c| c.lowest.wheel_y) {
        let steps = ((there - here).abs() / RIDGE_STEP).ceil() as usize;
        let at = |k: usize| here + (there - here) * k as f64 / steps as f64;
        let height = |y: f64| close(y).map_or(f64::NEG_INFINITY, |c| c.distance);
        let ridge = (1..steps).map(at).max_by(|&a, &b| height(a).total_cmp(&height(b))).unwrap_or(0.5 * (here + there));
        match there < here {
            true => bounds[0] = bounds[0].max(ridge),
            false => bounds[1] = bounds[1].min(ridge),
        }
    }
    (bounds != [f64::NEG_INFINITY, f64::INFINITY]).then_some(bounds)
}
