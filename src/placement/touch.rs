//! Search for the first point of contact of wheel and rail, and for further ones.

use super::pose::{along, dot, LowestPoint, Vector, WheelPose};
use super::profile::{Local, RunningProfile};
use crate::{Error, Result};
use std::cell::Cell;
use std::sync::Arc;

/// Distance of the places on the wheel's profile at which the gap is looked at first, m.
const STEP: f64 = 1e-4;

/// Distance of the places for the centre of the contact, m.
const FINE_STEP: f64 = 1e-5;

/// Largest difference of the slopes either side of a point of contact, rad: beyond it, it is a corner.
const CORNER: f64 = 2e-3;

/// Largest height of a wheel over the rail that it should roll on, m: a wheel that stands on its flange is some 28 mm
/// up.
const MAX_HEIGHT: f64 = 20e-3;

/// Largest approach of two bodies that touch in a small patch, m.
const MAX_APPROACH: f64 = 1e-3;

/// Steepest contact, rad: beyond it the vertical distance says nothing.
const MAX_ANGLE: f64 = 1.4;

/// A place where wheel and rail touch, or come close, right-hand form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Close {
    /// The point of the wheel.
    pub lowest: LowestPoint,
    /// Vertical distance to the rail, m.
    pub distance: f64,
    /// Slope dz/dy of the rail there.
    pub rail_slope: f64,
}

/// A wheel over a rail, both in the track frame, right-hand form.
#[derive(Debug, Clone)]
pub(super) struct WheelOverRail {
    pub wheel: WheelPose,
    /// The rail in the track frame.
    pub rail: RunningProfile,
    /// Places y on the wheel's profile at which the gap is looked at first, m, and the profile there.
    scan: Arc<[(f64, Local)]>,
}

impl WheelOverRail {
    /// Wheel and rail, both in the track frame.
    pub fn new(wheel: WheelPose, rail: RunningProfile) -> Self {
        let scan = wheel.profile.nodes(STEP).into_iter().map(|y| (y, wheel.profile.local(y))).collect();
        Self { wheel, rail, scan }
    }

    /// The point of the wheel's lowest line at `wheel_y` with its distance to the rail; none beside the rail.
    pub fn close(&self, wheel_y: f64) -> Option<Close> {
        self.closing()(wheel_y)
    }

    /// [`close`](Self::close) for many places of the wheel as it stands.
    pub fn closing(&self) -> impl Fn(f64) -> Option<Close> + '_ {
        let (by, last) = (self.closing_by(), Cell::new(0));
        move |wheel_y| by(wheel_y, &self.wheel.profile.local_from(wheel_y, &last))
    }

    /// The same with the wheel's profile at each place.
    fn closing_by(&self) -> impl Fn(f64, &Local) -> Option<Close> + '_ {
        let (orientation, last) = (self.wheel.orientation(), Cell::new(0));
        move |wheel_y, local| {
            let lowest = self.wheel.lowest_by(&orientation, wheel_y, local)?;
            let y = lowest.point[1];
            self.rail.contains(y).then(|| {
                let rail = self.rail.local_from(y, &last);
                Close { lowest, distance: rail.z - lowest.point[2], rail_slope: rail.slope }
            })
        }
    }

    /// Places where the vertical distance of wheel and rail has a minimum, the closest first.
    ///
    /// # Errors
    /// Wheel and rail that do not lie over each other; the closest place at the end of one of the profiles or at a
    /// corner.
    pub fn minima(&self) -> Result<Vec<Close>> {
        let (closing, close) = (self.closing_by(), self.closing());
        let places: Vec<Option<Close>> = self.scan.iter().map(|(y, local)| closing(*y, local)).collect();
        let distance = |k: usize| places.get(k).copied().flatten().map(|c| c.distance);
        let Some(least) = (0..places.len()).filter_map(distance).min_by(f64::total_cmp) else {
            let wheel = self.wheel.profile.range().map(|y| self.wheel.lowest(y).map_or(f64::NAN, |l| 1e3 * l.point[1]));
            let rail = self.rail.range().map(|y| 1e3 * y);
            return Err(Error::Job(format!(
                "placement: wheel and rail do not meet: found the wheel between y = {:.1} and {:.1} mm from the \
                 middle of the track and the \
                 rail between {:.1} and {:.1} mm; check the lateral shift, the gauge and the distance of the \
                 running circles",
                wheel[0], wheel[1], rail[0], rail[1]
            )));
        };
        let mut found = Vec::new();
        for k in 0..places.len() {
            let Some(here) = places[k] else { continue };
            let (before, after) = (k.checked_sub(1).and_then(distance), distance(k + 1));
            match (before, after) {
                (Some(a), Some(b)) if here.distance < a && here.distance <= b => {
                    found.extend(refine(&close, places[k - 1], places[k + 1]));
                }
                (Some(_), Some(_)) => {}
                _ if here.distance == least => {
                    let at_wheel = k == 0 || k + 1 == places.len();
                    let (what, profile, y) = match at_wheel {
                        true => ("wheel", self.wheel.profile.name(), here.lowest.wheel_y),
                        false => ("rail", self.rail.name(), here.lowest.point[1]),
                    };
                    return Err(Error::Job(format!(
                        "placement: wheel and rail touch at the end of the profile of the {what} ({profile}), \
                         at y = {:.2} mm of the {}; \
                         expected a contact inside both profiles: move the wheel, or give a profile that goes on",
                        1e3 * y,
                        if at_wheel { "wheel" } else { "track" }
                    )));
                }
                _ => {}
            }
        }
        found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        match found.first() {
            Some(first) => self.refuse_corner(first)?,
            None => return Err(Error::Defect("placement: the closest place of wheel and rail was lost".into())),
        }
        Ok(found)
    }

    fn refuse_corner(&self, at: &Close) -> Result<()> {
        let close = self.closing();
        let near = |d: f64| close(at.lowest.wheel_y + d);
        // At a smooth minimum both slopes are the same within curvature times this distance.
        let reach = 1e-8;
        let open = |c: Option<Close>| c.map_or(0.0, |c| (c.rail_slope.atan() - c.lowest.slope.atan()).abs());
        if open(near(-reach)).max(open(near(reach))) <= CORNER {
            return Ok(());
        }
        Err(Error::Job(format!(
            "placement: wheel and rail touch at a corner of a profile: found one at y = {:.2} mm of the wheel, \
             y = {:.2} mm of the track; \
             expected a smooth line, whose curvature makes the contact. Move the wheel, or round or smooth the profile",
            1e3 * at.lowest.wheel_y,
            1e3 * at.lowest.point[1]
        )))
    }

    /// An error if the wheel at its first touch is not where a wheel rolls.
    pub fn refuse_unreasonable(&self, first: &Close) -> Result<()> {
        let (height, angle) = (first.distance, first.rail_slope.atan());
        if height.abs() > MAX_HEIGHT {
            return Err(Error::Job(format!(
                "placement: the wheel first touches the rail {:.1} mm {} its running circle's height, at y = \
                 {:.1} mm of its profile: found it \
                 off its tread, expected at most {} mm; check the lateral shift, the gauge and the profiles",
                1e3 * height.abs(),
                if height < 0.0 { "above" } else { "below" },
                1e3 * first.lowest.wheel_y,
                1e3 * MAX_HEIGHT
            )));
        }
        if angle.abs() > MAX_ANGLE {
            return Err(Error::Job(format!(
                "placement: found a contact angle of {:.1} degrees, expected at most {:.0}: wheel and rail \
                 touch with their sides; check the \
                 lateral shift",
                angle.to_degrees(),
                MAX_ANGLE.to_degrees()
            )));
        }
        Ok(())
    }

    /// The extent of wheel_y around `first` in which the wheel, lowered by `lowered` (vertical, m) from first touch,
    /// overlaps the rail, cut into places of [`FINE_STEP`]: (place, overlap in m).
    fn overlap(&self, first: &Close, lowered: f64, bounds: Option<[f64; 2]>) -> Vec<(Close, f64)> {
        let [from, to] = bounds.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let close = self.closing();
        let side = |sign: f64| {
            let mut found = Vec::new();
            for k in 1..20_000 {
                let y = first.lowest.wheel_y + sign * FINE_STEP * k as f64;
                let inside = (from..=to).contains(&y) && self.wheel.profile.contains(y);
                let place = inside.then(|| close(y)).flatten();
                match place.map(|c| (c, lowered - (c.distance - first.distance))) {
                    Some((c, depth)) if depth > 0.0 => found.push((c, depth)),
                    _ => break,
                }
            }
            found
        };
        let mut all: Vec<_> = side(-1.0).into_iter().rev().collect();
        all.push((*first, lowered));
        all.extend(side(1.0));
        all
    }

    /// Centre of the overlap of the undeformed bodies at an `approach` (m) along the normal: the point of the track
    /// frame above the rail, and the mean contact angle. Weight is the square of the overlap, taken over x as that of
    /// a circle: the 5/2th power of that of the lowest line. CONTACT puts its frame there.
    pub fn centre(&self, first: &Close, approach: f64, bounds: Option<[f64; 2]>) -> Result<(Vector, f64)> {
        refuse_approach(approach)?;
        let lowered = approach / first.rail_slope.atan().cos();
        let mut sum = [0.0; 4];
        for (c, depth) in self.overlap(first, lowered, bounds) {
            let weight = depth.powf(2.5);
            let values = [1.0, c.lowest.point[0], c.lowest.point[1], c.rail_slope.atan()];
            sum.iter_mut().zip(values).for_each(|(s, v)| *s += weight * v);
        }
        let [weight, x, y, angle] = sum;
        let y = y / weight;
        Ok(([x / weight, y, self.rail.local(y).z], angle / weight))
    }

    /// First and last y of the track (m) where the undeformed bodies overlap at an `approach` (m) along the normal.
    pub fn reach(&self, first: &Close, approach: f64, bounds: Option<[f64; 2]>) -> Result<[f64; 2]> {
        refuse_approach(approach)?;
        let overlap = self.overlap(first, approach / first.rail_slope.atan().cos(), bounds);
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        Ok(overlap.iter().map(|(c, _)| c.lowest.point[1]).fold(none, |r, y| [r[0].min(y), r[1].max(y)]))
    }

    /// The other minima that are closed, too, once the bodies have approached each other by `approach` (m) at the
    /// first: the place, its gap along its own normal at first touch (m), and whether open places lie between it and
    /// the first.
    pub fn others(&self, minima: &[Close], approach: f64, bounds: Option<[f64; 2]>) -> Result<Vec<(Close, f64, bool)>> {
        refuse_approach(approach)?;
        let Some((first, rest)) = minima.split_first() else { return Ok(Vec::new()) };
        let lowered = approach / first.rail_slope.atan().cos();
        let overlap = self.overlap(first, lowered, bounds);
        let inside = |y: f64| overlap.iter().any(|(c, _)| (c.lowest.wheel_y - y).abs() <= 1.5 * FINE_STEP);
        let closed = rest.iter().filter(|c| c.distance - first.distance < lowered);
        let report = |c: &Close| {
            let gap = (c.distance - first.distance) * c.rail_slope.atan().cos();
            (*c, gap, !inside(c.lowest.wheel_y))
        };
        Ok(closed.map(report).collect())
    }

    /// Hessian of the gap at a place of contact in the directions along the track and across it in the tangent plane,
    /// 1/m; and the principal curvatures: of the wheel around its axle and across, and of the rail across.
    pub fn curvatures(&self, at: &Close) -> ([[f64; 2]; 2], [f64; 3]) {
        let local = self.wheel.profile.local(at.lowest.wheel_y);
        let rail = self.rail.local(at.lowest.point[1]);
        let rolling = 1.0 / ((self.wheel.radius + local.z) * (1.0 + local.slope * local.slope).sqrt());
        let (across, head) = (-local.curvature(), rail.curvature());
        // The meridian of the wheel and the direction around it, in the tangent plane.
        let arm = along(at.lowest.point, -1.0, self.wheel.centre());
        let axle = self.wheel.axle();
        let radial = along(arm, -dot(arm, axle), axle);
        let size = dot(radial, radial).sqrt();
        let steep = (1.0 + local.slope * local.slope).sqrt();
        let meridian = along(axle.map(|v| v / steep), local.slope / (steep * size), radial);
        let (s, c) = rail.slope.atan().sin_cos();
        let m = [meridian[0], c * meridian[1] + s * meridian[2]];
        let round = [-m[1], m[0]];
        let entry = |i: usize, j: usize| {
            rolling * round[i] * round[j] + across * m[i] * m[j] + if i == 1 && j == 1 { head } else { 0.0 }
        };
        ([[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]], [rolling, across, head])
    }
}

/// The minimum between two neighbouring places: where the slopes of wheel and rail are equal, found by halving,
/// which neither corners nor jumps of the curvature disturb.
fn refine(close: &dyn Fn(f64) -> Option<Close>, from: Option<Close>, to: Option<Close>) -> Option<Close> {
    let (mut low, mut high) = (from?.lowest.wheel_y, to?.lowest.wheel_y);
    let falls = |c: &Close| c.rail_slope < c.lowest.slope;
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) {
            break;
        }
        if falls(&close(middle)?) {
            low = middle;
        } else {
            high = middle;
        }
    }
    close(0.5 * (low + high))
}

fn refuse_approach(approach: f64) -> Result<()> {
    if approach > 0.0 && approach <= MAX_APPROACH {
        return Ok(());
    }
    Err(Error::Job(format!(
        "placement: found an approach of {:e} m, expected one above zero and at most {MAX_APPROACH} m: wheel \
         and rail would overlap beyond what \
         elastic bodies bear; reduce the load or the approach",
        approach
    )))
}
