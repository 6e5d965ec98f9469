//! A wheel of revolution in the track: its points, its lowest line and its axle.
//!
//! Everything here is of a right-hand wheel, in the track frame (x forwards, y to the right, z down; origin in the
//! middle of the track at the height of the rails' tops). A left-hand wheel is the mirror image, y → −y, with lateral
//! shift, yaw and roll reversed.

use super::profile::{Local, RunningProfile};
use std::cell::Cell;

/// Vector of the track frame.
pub(super) type Vector = [f64; 3];

/// Scalar product.
pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + t b.
pub(super) fn along(a: Vector, t: f64, b: Vector) -> Vector {
    [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]]
}

/// A wheel placed in the track. Its own frame has the axle as y and the origin in the middle of the wheelset.
#[derive(Debug, Clone)]
pub(super) struct WheelPose {
    /// Profile, y from the running circle to the field side, z down.
    pub profile: RunningProfile,
    /// Radius at the running circle, m.
    pub radius: f64,
    /// Distance of the running circle from the middle of the wheelset, m.
    pub offset: f64,
    /// Shift of the wheelset to the right, m.
    pub lateral: f64,
    /// Yaw ψ about z, which turns forwards to the right, rad.
    pub yaw: f64,
    /// Roll φ about x of the track after the yaw, which lowers the right-hand wheel, rad.
    pub roll: f64,
    /// Height z of the middle of the axle below one radius over the rails' tops, m.
    pub height: f64,
}

/// A point of the lowest line: the points of the wheel where its normal has no component along the track, which are
/// those that can touch a prismatic rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LowestPoint {
    /// Position on the wheel's profile, m.
    pub wheel_y: f64,
    /// The point in the track frame, m.
    pub point: Vector,
    /// dz/dy of the wheel's surface at a fixed x, which is also that of the line seen along the track.
    pub slope: f64,
}

/// Directions and centre of a wheel in the track.
#[derive(Debug, Clone, Copy)]
pub(super) struct Orientation {
    /// Rotation from the frame of the wheelset to that of the track, `[row][column]`.
    rotation: [Vector; 3],
    /// tan ψ of the yaw.
    yaw_slope: f64,
    /// Middle of the axle, m.
    centre: Vector,
}

impl WheelPose {
    /// A wheel of this profile and radius, m, in the middle of the track, with its running circle at the distance
    /// `offset`, m, from the middle of the wheelset.
    pub fn in_middle(profile: RunningProfile, radius: f64, offset: f64) -> Self {
        Self { profile, radius, offset, lateral: 0.0, yaw: 0.0, roll: 0.0, height: 0.0 }
    }

    /// Rotation from the frame of the wheelset to that of the track, roll after yaw, `[row][column]`.
    pub fn rotation(&self) -> [Vector; 3] {
        let ((s, c), (sr, cr)) = (self.yaw.sin_cos(), self.roll.sin_cos());
        [[c, -s, 0.0], [cr * s, cr * c, -sr], [sr * s, sr * c, cr]]
    }

    /// Unit vector of the axle, to the field side.
    pub fn axle(&self) -> Vector {
        self.rotation().map(|row| row[1])
    }

    /// Middle of the axle.
    pub fn centre(&self) -> Vector {
        [0.0, self.lateral, self.height - self.radius]
    }

    /// Components in the frame of the wheelset of a vector of the track frame.
    pub fn inwards(&self, v: Vector) -> Vector {
        let r = self.rotation();
        [0, 1, 2].map(|k| r[0][k] * v[0] + r[1][k] * v[1] + r[2][k] * v[2])
    }

    /// Radius at `y` of the profile, m.
    pub fn radius_at(&self, y: f64) -> f64 {
        self.radius + self.profile.local(y).z
    }

    /// Directions and centre of the wheel in the track.
    pub fn orientation(&self) -> Orientation {
        Orientation { rotation: self.rotation(), yaw_slope: self.yaw.tan(), centre: self.centre() }
    }

    /// The lowest point of the circle at `wheel_y` of the profile, seen along the track; none where the wheel is so
    /// steep and yawed so much that it has none.
    pub fn lowest(&self, wheel_y: f64) -> Option<LowestPoint> {
        self.lowest_by(&self.orientation(), wheel_y, &self.profile.local(wheel_y))
    }

    /// The same by the orientation of the wheel and the profile at `wheel_y`, which a search over many places finds
    /// once.
    ///
    /// The outward normal (sin θ, −r′, cos θ) of a surface of revolution in its own frame has no component along the
    /// track where sin θ = −r′ tan ψ, whatever the roll.
    pub fn lowest_by(&self, orientation: &Orientation, wheel_y: f64, local: &Local) -> Option<LowestPoint> {
        let Orientation { rotation: r, yaw_slope, centre } = orientation;
        let s = -local.slope * yaw_slope;
        if !(s.abs() < 1.0) {
            return None;
        }
        let c = (1.0 - s * s).sqrt();
        let radius = self.radius + local.z;
        let turn = |v: Vector| [dot(r[0], v), dot(r[1], v), dot(r[2], v)];
        let arm = turn([radius * s, self.offset + wheel_y, radius * c]);
        let normal = turn([s, -local.slope, c]);
        Some(LowestPoint { wheel_y, point: along(*centre, 1.0, arm), slope: -normal[1] / normal[2] })
    }

    /// Position on the profile and the distance, along `direction` from `start` (track frame, m), of the wheel's
    /// surface near `start`; none if the search does not settle.
    pub fn meet(&self, start: Vector, direction: Vector) -> Option<(f64, f64)> {
        let q = self.inwards(along(start, -1.0, self.centre()));
        let d = self.inwards(direction);
        let (mut t, last) = (0.0, Cell::new(0));
        for _ in 0..60 {
            let p = along(q, t, d);
            let distance = (p[0] * p[0] + p[2] * p[2]).sqrt();
            let local = self.profile.local_from(p[1] - self.offset, &last);
            let rest = self.radius + local.z - distance;
            let slope = local.slope * d[1] - (p[0] * d[0] + p[2] * d[2]) / distance;
            let step = (-rest / slope).clamp(-3e-3, 3e-3);
            t += step;
            if step.abs() < 1e-13 {
                return Some((q[1] + t * d[1] - self.offset, t));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::builtin::s1002;
    use super::*;

    fn wheel(yaw: f64, roll: f64) -> WheelPose {
        WheelPose { profile: s1002().unwrap(), radius: 0.46, offset: 0.75, lateral: 3e-3, yaw, roll, height: 1e-4 }
    }

    #[test]
    fn the_rotation_is_one_and_turns_as_it_says() {
        let r = wheel(0.02, -0.01).rotation();
        for i in 0..3 {
            for j in 0..3 {
                assert!((dot(r[i], r[j]) - f64::from(i == j)).abs() < 1e-15);
            }
        }
        // Yaw turns the axle of the right-hand wheel backwards, roll lowers it.
        assert!(wheel(0.02, 0.0).axle()[0] < 0.0);
        assert!(wheel(0.0, 0.01).axle()[2] > 0.0);
    }

    /// The lowest point at a given y of the track is that of a fine search over the wheel's surface.
    #[test]
    fn the_lowest_line_is_the_outline_of_the_wheel() {
        let wheel = wheel(0.03, 0.004);
        for wheel_y in [-0.0457, -0.033, -0.012, 0.008, 0.03] {
            let found = wheel.lowest(wheel_y).unwrap();
            // Around it the wheel at the same y lies higher: along x by the curvature of a circle, and by nothing of
            // first order.
            let at = |x: f64| {
                let start = [found.point[0] + x, found.point[1], found.point[2]];
                wheel.meet(start, [0.0, 0.0, 1.0]).unwrap().1
            };
            assert!(at(0.0).abs() < 1e-13);
            let h = 1e-4;
            assert!(at(h) < 0.0 && at(-h) < 0.0 && (at(h) - at(-h)).abs() < 1e-3 * at(h).abs(), "{} {}", at(h), at(-h));
            let near = |d: f64| wheel.lowest(wheel_y + d).unwrap().point;
            let (a, b) = (near(-1e-6), near(1e-6));
            let slope = (b[2] - a[2]) / (b[1] - a[1]);
            assert!((slope - found.slope).abs() < 1e-6 * (1.0 + slope.abs()), "{slope} {}", found.slope);
        }
    }

    #[test]
    fn without_yaw_it_is_the_profile_turned_by_the_roll() {
        let wheel = wheel(0.0, 0.002);
        let (s, c) = 0.002_f64.sin_cos();
        for y in [-0.04, 0.0, 0.03] {
            let (lowest, r) = (wheel.lowest(y).unwrap(), wheel.radius_at(y));
            assert!(lowest.point[0].abs() < 1e-18);
            assert!((lowest.point[1] - (3e-3 + c * (0.75 + y) - s * r)).abs() < 1e-15);
            assert!((lowest.point[2] - (1e-4 - 0.46 + s * (0.75 + y) + c * r)).abs() < 1e-15);
            assert!((lowest.slope.atan() - wheel.profile.local(y).slope.atan() - 0.002).abs() < 1e-14);
        }
    }
}
