//! A wheel on a rail: profiles, where they touch, and what contact mechanics needs to know of it. Geometry alone: no
//! bodies, no loads but Hertz'.
//!
//! From a wheel's and a rail's [`RunningProfile`] and a [`WheelPlacement`] follows a [`PlacedWheel`] at first touch. It
//! gives the point of contact ([`Touch`]) and others that are near, the curvatures and Hertz' [`Ellipse`], the tilted
//! [`Frame`], the [`Creepages`] and the undeformed [`Gap`] on a grid.
//!
//! # Profiles
//! y is positive to the field side (away from the middle of the track) of wheel and rail, z points down, y = 0 of a
//! wheel is its running circle. So a right-hand wheel's profile is drawn as one sees it along the track, looking
//! forwards: the flange hangs down on the left (y < 0).
//!
//! # Track frame
//! x forwards, y to the right, z down, origin in the middle of the track at the height of the rails' tops and at the
//! axle. In it are given: the wheelset's shift (positive to the right), its yaw (about z: positive turns it to the
//! right, the right-hand wheel falls back), its roll (about x after the yaw: positive lowers the right-hand wheel),
//! the point of contact and the contact angle δ, positive where the rail falls to the right. A contact on the inner
//! side of a head has δ < 0 on the right and δ > 0 on the left. It is the frame of the Manchester benchmark and of
//! CONTACT.
//!
//! # The program's frame
//! The track frame turned by half a turn about y, then tilted by δ: **x backwards** along the track (the contact
//! rolls towards −x), **y to the right** along the rail's tangent, **z up**, the rail's outward normal. In components
//! of the track frame x = (−1, 0, 0), y = (0, cos δ, sin δ), z = (0, sin δ, −cos δ). It is a right-handed frame on
//! either side; nothing is mirrored. The rail is body 1, the wheel body 2.
//!
//! - Creepages are (v_rail − v_wheel)/V: a driving wheel has ξ < 0, one yawed to the right η = +ψ/cos δ about, spin φ
//!   = ω sin(δ − roll)/V about. Of CONTACT's ξ, η, φ and forces (Fx, Fs) on the rail those of the program are −ξ, η,
//!   −φ and (−Fx, Fs).
//! - A right-hand wheel has its field side at +y, its flange at −y; a left-hand wheel has its flange at +y.
//! - The wheel's body in lower form is its image z → −z, its rim below the plane. Its axle is (axle_x, axle_y,
//!   −axle_z) of [`PlacedWheel::axle`], which is (ψ about, cos χ, −sin χ) with χ = δ − roll, through (y, z) = (−r sin
//!   χ, −r cos χ) with the rolling radius r; the angular velocity ω > 0 about it carries the material at the contact
//!   towards +x.
//! - Of a wheel's section with r outwards and Y to the field side, both measured from the point of contact, the point
//!   (r, Y) is at the lower-form (y, z) = (s Y cos χ + r sin χ, r cos χ − s Y sin χ), s = +1 on the right and −1 on
//!   the left.
//! - The rail's body keeps its shape, turned by δ: what is upright in the track, (0, 0, −1), is (0, −sin δ, cos δ).
//! - Left and right are mirror images: the same wheel and rail on the other side, with shift, yaw and roll reversed,
//!   have the same ξ; η, φ, δ and the y of the gap are reversed.

pub mod builtin;
mod direction;
mod formats;
pub(crate) mod frame;
pub(crate) mod gap;
pub(crate) mod hertz;
mod placed;
mod places;
mod pose;
pub(crate) mod profile;
pub mod read;
pub(crate) mod spline;
mod touch;

use crate::{Error, Result};
pub use frame::{Creepages, Frame, RollingMotion};
pub(crate) use gap::finer_grid_lines;
pub(crate) use gap::fitted_grid_lines;
pub(crate) use gap::rough_grid_lines;
pub use gap::{grid_lines, Gap};
pub use hertz::{Ellipse, HertzLoad};
pub use places::{ContactPlace, MovableWheel};
use pose::WheelPose;
pub use profile::RunningProfile;
use profile::UPRIGHT;
use touch::{Close, WheelOverRail};

/// Largest roll that a point of contact given directly may need, rad.
const MAX_ROLL: f64 = 0.1;

/// Half width of a contact over that of the overlap of the undeformed bodies: 1/√2 for round bodies, and a little more.
const WIDTH_OF_OVERLAP: f64 = 0.75;

/// Overlap elsewhere that a point of contact given directly may leave, m: the rounding of its positions.
const MAX_OVERLAP: f64 = 1e-7;

/// The side of the track, seen in the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RailSide {
    /// The left-hand wheel and rail.
    Left,
    /// The right-hand wheel and rail.
    Right,
}

impl RailSide {
    /// +1 for the right-hand side, −1 for the left-hand one.
    pub fn sign(self) -> f64 {
        match self {
            RailSide::Left => -1.0,
            RailSide::Right => 1.0,
        }
    }
}

/// Position of the wheel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Position {
    /// The wheelset's shift to the right (m), its yaw (rad, positive to the right) and its roll (rad, positive lowers
    /// the right-hand wheel).
    Shift {
        /// m.
        lateral: f64,
        /// rad.
        yaw: f64,
        /// rad.
        roll: f64,
    },
    /// The point of contact on both profiles. The wheel is shifted and rolled until it touches there.
    Contact {
        /// y of the wheel's profile, m.
        wheel: f64,
        /// y of the rail's profile after its cant, m.
        rail: f64,
        /// Yaw, rad.
        yaw: f64,
    },
}

/// A wheel and a rail to be placed, m and rad.
///
/// ```
/// use railsqueal::placement::builtin::{rail_60e1, s1002};
/// use railsqueal::placement::{grid_lines, HertzLoad, Position, RailSide, RollingMotion, WheelPlacement};
///
/// let placement = WheelPlacement {
///     side: RailSide::Right,
///     gauge: 1.435,
///     gauge_depth: 0.014,
///     cant: 0.025_f64.atan(),
///     radius: 0.46,
///     circles: 1.5,
///     position: Position::Shift { lateral: -4e-3, yaw: 0.010, roll: 0.0 },
///     near: None,
/// };
/// let placed = placement.place(&s1002()?, &rail_60e1()?)?;
/// let touch = placed.touch();
/// let ellipse = placed.ellipse(0.5 * 210e9 / 0.91, HertzLoad::Force(60e3))?;
/// let second = placed.others(ellipse.approach)?;
/// let frame = placed.centred_frame(ellipse.approach)?;
/// let creepages = placed.creepages(&frame, &RollingMotion::free_rolling(10.0))?;
/// let [x, y] = grid_lines(placed.extent(&frame, &ellipse)?);
/// let gap = placed.gap(&frame, &x, &y)?;
/// assert!((touch.angle + 9.64e-3).abs() < 1e-5 && (touch.radius - 459.774e-3).abs() < 1e-6);
/// assert!((ellipse.pressure - 956e6).abs() < 2e6 && second.is_empty());
/// assert!((creepages.longitudinal - 0.000533).abs() < 1e-6 && (creepages.lateral - 0.009998).abs() < 1e-6);
/// assert_eq!(([x.len(), y.len()], gap.gap.len()), ([29, 31], 29 * 31));
/// # Ok::<(), railsqueal::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelPlacement {
    /// Side of the track.
    pub side: RailSide,
    /// Gauge: distance of the rails' inner sides.
    pub gauge: f64,
    /// Depth below the rails' tops down to which the gauge is taken; 14 mm in Europe.
    pub gauge_depth: f64,
    /// Inclination of the rail towards the middle of the track, added to what its profile has: atan(1/40) of an
    /// upright profile.
    pub cant: f64,
    /// Radius of the running circle, y = 0 of the wheel's profile.
    pub radius: f64,
    /// Distance of the two running circles.
    pub circles: f64,
    /// Position of the wheel.
    pub position: Position,
    /// Position on the wheel's profile near which the contact is, of a wheel that touches at several places. Without it
    /// the place of first touch is taken.
    pub near: Option<f64>,
}

/// A point of contact, in the track frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Position on the wheel's profile, m: positive to the field side of the running circle.
    pub wheel: f64,
    /// Position on the rail's profile after its cant, m: positive to the field side of its origin.
    pub rail: f64,
    /// The point in the track frame (x forwards, y to the right, z down), m.
    pub point: [f64; 3],
    /// Contact angle δ, rad: positive where the rail falls to the right.
    pub angle: f64,
    /// Rolling radius, m.
    pub radius: f64,
    /// Gap along the normal at first touch, m: zero for the first point.
    pub gap: f64,
    /// True if open places lie between this contact and the first one.
    pub separate: bool,
}

/// Curvatures at a point of contact, 1/m, positive for a body that is round outwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curvatures {
    /// Curvature of the wheel around its axle.
    pub wheel_rolling: f64,
    /// Curvature of the wheel across.
    pub wheel_across: f64,
    /// Curvature of the rail along the track: none.
    pub rail_rolling: f64,
    /// Curvature of the rail across.
    pub rail_across: f64,
    /// Second derivatives of the gap in x and y of the program's frame, with the angle between the wheel's and the
    /// rail's directions.
    pub relative: [[f64; 2]; 2],
}

/// A wheel at first touch on its rail.
#[derive(Debug, Clone)]
pub struct PlacedWheel {
    side: RailSide,
    pair: WheelOverRail,
    minima: Vec<Close>,
    /// From y of the rail's profile to y of the track, m.
    rail_shift: f64,
    /// Height of the top of the rail's profile after its cant, z down, m.
    crown: f64,
    /// Inclination of the rail, rad.
    cant: f64,
    /// Part of the wheel's profile that belongs to this contact, m, where another one carries load beside it.
    bounds: Option<[f64; 2]>,
    /// z of the rail's profile before its cant at y = 0, or at its top where it does not reach there, m.
    middle: f64,
}

/// Position of a contact on a body drawn in a frame of its own, y to the right and z up in the lower form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seat {
    /// y of the contact on the body's drawing, m: from the running circle of a wheel, from the middle of a rail's
    /// profile.
    pub y: f64,
    /// Height of the contact over the place y = 0 of the body's profile, m: of a wheel, in the lower form, its radius
    /// less that of the running circle.
    pub z: f64,
    /// Angle χ of the contact's frame against the drawing's, about x, rad: the contact sees cos χ u_y − sin χ u_n
    /// along y and sin χ u_y + cos χ u_n along n.
    pub tilt: f64,
}

impl WheelPlacement {
    /// Puts the wheel on the rail: both profiles with y to the field side and z down.
    ///
    /// # Errors
    /// Values that are no track; profiles that do not meet, or touch at an end, at a corner or away from the tread; a
    /// point of contact given directly that needs too much roll or makes the bodies overlap elsewhere.
    pub fn place(&self, wheel: &RunningProfile, rail: &RunningProfile) -> Result<PlacedWheel> {
        self.check()?;
        let middle = rail.local(if rail.contains(0.0) { 0.0 } else { rail.top() }).z;
        let (rail, rail_shift, crown) = self.rail_in_track(rail)?;
        let sign = self.side.sign();
        let pose = WheelPose::in_middle(wheel.clone(), self.radius, 0.5 * self.circles);
        let mut pair = WheelOverRail::new(pose, rail);
        match self.position {
            Position::Shift { lateral, yaw, roll } => {
                (pair.wheel.lateral, pair.wheel.yaw, pair.wheel.roll) = (sign * lateral, sign * yaw, sign * roll);
            }
            Position::Contact { wheel, rail, yaw } => {
                pair.wheel.yaw = sign * yaw;
                bring_together(&mut pair, wheel, rail, rail_shift)?;
            }
        }
        let mut minima = pair.minima()?;
        let mut bounds = None;
        if let Some(near) = self.near {
            places::bring_to_front(&mut minima, near)?;
            bounds = places::bounds(&pair, &minima);
        }
        let Some(&first) = minima.first() else { return Err(Error::Defect("placement: no point of contact".into())) };
        if let Position::Contact { wheel, .. } = self.position {
            refuse_overlap(&pair, wheel, &first)?;
        }
        pair.refuse_unreasonable(&first)?;
        pair.wheel.height = first.distance;
        let rest = minima.iter().map(|c| Close {
            distance: c.distance - first.distance,
            lowest: pose::LowestPoint {
                point: pose::along(c.lowest.point, first.distance, [0.0, 0.0, 1.0]),
                ..c.lowest
            },
            ..*c
        });
        let minima = rest.collect();
        Ok(PlacedWheel { side: self.side, pair, minima, rail_shift, crown, cant: self.cant, bounds, middle })
    }

    fn check(&self) -> Result<()> {
        let (lateral, yaw, roll) = match self.position {
            Position::Shift { lateral, yaw, roll } => (lateral, yaw, roll),
            Position::Contact { yaw, .. } => (0.0, yaw, 0.0),
        };
        for (what, value, from, to, unit) in [
            ("gauge", self.gauge, 0.3, 3.0, "m"),
            ("depth of the gauge", self.gauge_depth, 1e-3, 50e-3, "m"),
            ("cant of the rail", self.cant, -0.2, 0.2, "rad"),
            ("radius of the wheel", self.radius, 0.05, 2.0, "m"),
            ("distance of the running circles", self.circles, 0.3, 3.2, "m"),
            ("lateral shift", lateral, -0.2, 0.2, "m"),
            ("yaw", yaw, -0.3, 0.3, "rad"),
            ("roll", roll, -0.3, 0.3, "rad"),
        ] {
            if !(from..=to).contains(&value) {
                return Err(Error::Job(format!(
                    "placement: found a {what} of {value} {unit}, expected one from {from} to {to} {unit}; \
                     lengths are in m, angles in rad"
                )));
            }
        }
        Ok(())
    }

    /// The rail in the track frame, right-hand form, by how much it was moved in y, m, and the z of its top before
    /// that.
    fn rail_in_track(&self, rail: &RunningProfile) -> Result<(RunningProfile, f64, f64)> {
        let turned = match self.cant {
            0.0 => rail.clone(),
            cant => rail.turned(cant)?,
        };
        let top = turned.top();
        let crown = turned.local(top).z;
        let (mut low, mut high) = (turned.range()[0], top);
        let deep = turned.local(low).z - crown;
        // A side that was cut because it stands upright or hangs over at this cant has its innermost place at its end.
        let whole = rail.local(rail.range()[0]).z - rail.local(rail.top()).z > self.gauge_depth;
        let upright = turned.local(low).slope.atan() < 2.0 * UPRIGHT - std::f64::consts::FRAC_PI_2;
        if deep < self.gauge_depth && whole && upright {
            high = low;
        } else if deep < self.gauge_depth {
            return Err(Error::Job(format!(
                "placement: the profile of the rail ({}) goes down to {:.2} mm below its top on the side of the \
                 gauge, which is taken down to \
                 {:.2} mm; give a profile that goes on, or the depth at which the gauge was measured",
                rail.name(),
                1e3 * deep,
                1e3 * self.gauge_depth
            )));
        }
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if turned.local(middle).z - crown > self.gauge_depth {
                low = middle;
            } else {
                high = middle;
            }
        }
        let shift = 0.5 * self.gauge - 0.5 * (low + high);
        Ok((turned.moved(shift, -crown), shift, crown))
    }
}

/// Rolls and shifts the wheel until its profile at `wheel` touches the rail at `rail`, both m.
fn bring_together(pair: &mut WheelOverRail, wheel: f64, rail: f64, rail_shift: f64) -> Result<()> {
    let there = rail + rail_shift;
    for (what, profile, y, inside) in [
        ("wheel", &pair.wheel.profile, wheel, pair.wheel.profile.contains(wheel)),
        ("rail", &pair.rail, rail, pair.rail.contains(there)),
    ] {
        if !inside {
            let shift = if what == "rail" { rail_shift } else { 0.0 };
            let [from, to] = profile.range().map(|v| 1e3 * (v - shift));
            return Err(Error::Job(format!(
                "placement: found the point of contact at y = {:.2} mm of the {what}, expected one inside its \
                 profile ({}), from {from:.2} to \
                 {to:.2} mm",
                1e3 * y,
                profile.name()
            )));
        }
    }
    let wanted = pair.rail.local(there).slope.atan();
    let no_line = || Error::Job("placement: the wheel is yawed so much that it has no lowest point there".into());
    for _ in 0..50 {
        let turn = wanted - pair.wheel.lowest(wheel).ok_or_else(no_line)?.slope.atan();
        pair.wheel.roll += turn;
        if pair.wheel.roll.abs() > MAX_ROLL {
            return Err(Error::Job(format!(
                "placement: at the given point of contact wheel and rail have slopes that differ by {:.3} rad, \
                 expected at most {MAX_ROLL}: the \
                 wheel would have to roll by as much to touch there; give points where the two lines are nearly \
                 parallel",
                pair.wheel.roll
            )));
        }
        if turn.abs() < 1e-15 {
            break;
        }
    }
    pair.wheel.lateral += there - pair.wheel.lowest(wheel).ok_or_else(no_line)?.point[1];
    Ok(())
}

/// An error if the wheel, placed by its point of contact, is closest to the rail elsewhere.
fn refuse_overlap(pair: &WheelOverRail, wheel: f64, first: &Close) -> Result<()> {
    let given = pair.close(wheel).map_or(f64::INFINITY, |c| c.distance);
    if given - first.distance <= MAX_OVERLAP {
        return Ok(());
    }
    Err(Error::Job(format!(
        "placement: with the given point of contact wheel and rail would overlap by {:.4} mm at y = {:.2} mm of \
         the wheel's profile; give \
         another point, or the lateral shift, from which the point of contact follows",
        1e3 * (given - first.distance),
        1e3 * first.lowest.wheel_y
    )))
}

impl PlacedWheel {}

#[cfg(test)]
mod tests;
