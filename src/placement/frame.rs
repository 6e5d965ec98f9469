//! The tilted frame of a contact and the creepages in it.

use super::pose::{along, dot, Vector, WheelPose};
use super::RailSide;
use crate::{Error, Result};

/// The frame of a contact as the program has it: x backwards along the track, y to the right along the tangent of the
/// rail, z the outward normal of the rail. Positions are in the track frame, right-hand form; the side says how they
/// are seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    pub(super) side: RailSide,
    /// Origin on the rail.
    pub(super) origin: Vector,
    /// Slope angle dz/dy of the rail.
    pub(super) angle: f64,
}

impl Frame {
    /// Origin in the track frame (x forwards, y to the right, z down), m.
    pub fn origin(&self) -> [f64; 3] {
        [self.origin[0], self.side.sign() * self.origin[1], self.origin[2]]
    }

    /// Contact angle δ, rad: positive where the rail falls to the right. A flange contact of a right-hand wheel has a
    /// negative one, of a left-hand wheel a positive one.
    pub fn angle(&self) -> f64 {
        self.side.sign() * self.angle
    }

    /// Direction across the track, in the tangent plane to the field side.
    pub(super) fn across(&self) -> Vector {
        let (s, c) = self.angle.sin_cos();
        [0.0, c, s]
    }

    /// Outward normal of the rail, from it into the wheel.
    pub(super) fn normal(&self) -> Vector {
        let (s, c) = self.angle.sin_cos();
        [0.0, s, -c]
    }

    /// The point of the tangent plane at (x, y) of the program's frame, m.
    pub(super) fn point(&self, x: f64, y: f64) -> Vector {
        along(along(self.origin, -x, [1.0, 0.0, 0.0]), self.side.sign() * y, self.across())
    }

    /// Components in the program's frame of a vector (a velocity) of the track frame, right-hand form.
    fn components(&self, v: Vector) -> [f64; 3] {
        [-v[0], self.side.sign() * dot(v, self.across()), dot(v, self.normal())]
    }

    /// The axle, given to the field side in right-hand form, in the program's frame and to the right.
    pub(super) fn axle(&self, axle: Vector) -> [f64; 3] {
        let sign = self.side.sign();
        self.components(axle).map(|v| sign * v)
    }

    /// The component along z of the program's frame of an angular velocity of the track frame, right-hand form: a
    /// mirror image turns the other way.
    fn turning(&self, w: Vector) -> f64 {
        self.side.sign() * dot(w, self.normal())
    }
}

/// How a wheel rolls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RollingMotion {
    /// Speed along the track, m/s, above zero.
    pub speed: f64,
    /// Curvature of the track 1/R, 1/m: positive where it turns to the right.
    pub curvature: f64,
    /// Angular speed about the axle, rad/s; without one the speed over the radius of the running circle, as of a
    /// wheel that would roll freely there.
    pub angular_speed: Option<f64>,
    /// Longitudinal creepage instead of that of the motion, 1.
    pub longitudinal: Option<f64>,
    /// Lateral creepage instead of that of the motion, 1.
    pub lateral: Option<f64>,
    /// Spin instead of that of the motion, 1/m.
    pub spin: Option<f64>,
}

impl RollingMotion {
    /// A wheel that would roll freely on its running circle, at a speed, m/s.
    pub fn free_rolling(speed: f64) -> Self {
        Self { speed, curvature: 0.0, angular_speed: None, longitudinal: None, lateral: None, spin: None }
    }
}

/// Creepages in the program's frame, (v_rail − v_wheel) over the rolling speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Creepages {
    /// Longitudinal creepage ξ, 1; negative when the wheel turns too fast, as it does when it drives.
    pub longitudinal: f64,
    /// Lateral creepage η, 1; positive when the wheel slides to the left over the rail.
    pub lateral: f64,
    /// Spin φ, 1/m.
    pub spin: f64,
    /// Rolling speed V with which the material of both bodies passes the contact, the mean of the two, m/s.
    pub speed: f64,
}

/// The creepages of a wheel in a frame. The wheel's point is that above the origin of the frame, of the undeformed
/// wheel.
pub(super) fn creepages(wheel: &WheelPose, frame: &Frame, motion: &RollingMotion) -> Result<Creepages> {
    let turning = motion.angular_speed.unwrap_or(motion.speed / wheel.radius);
    for (what, unit, value) in [("speed", "m/s", motion.speed), ("angular speed of the wheel", "rad/s", turning)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(Error::Job(format!("placement: found a {what} of {value} {unit}, expected one above zero")));
        }
    }
    let (_, rise) = wheel.meet(frame.origin, frame.normal()).ok_or_else(|| {
        Error::Job(format!(
            "placement: there is no wheel above the point y = {:.2} mm of the track; check the point of contact",
            1e3 * frame.origin()[1]
        ))
    })?;
    let arm = along(along(frame.origin, rise, frame.normal()), -1.0, wheel.centre());
    // Rolling forwards the lowest point goes backwards: the wheel turns about −y.
    let spin = wheel.axle().map(|v| -turning * v);
    let [vx, vy, vz] =
        [spin[1] * arm[2] - spin[2] * arm[1], spin[2] * arm[0] - spin[0] * arm[2], spin[0] * arm[1] - spin[1] * arm[0]];
    // Of the frame that travels with the contact the rail's material goes backwards with the speed, the wheel's with
    // (vx, vy, vz).
    let speed = 0.5 * (motion.speed - vx);
    // In a curve the way on the inner rail is shorter, V(1 − y/R), and the track turns under the wheel.
    let curvature = frame.side.sign() * motion.curvature;
    let slip = frame.components([-motion.speed * (1.0 - frame.origin[1] * curvature) - vx, -vy, -vz]);
    let away = frame.turning([-spin[0], -spin[1], -spin[2] - motion.speed * curvature]);
    Ok(Creepages {
        longitudinal: motion.longitudinal.unwrap_or(slip[0] / speed),
        lateral: motion.lateral.unwrap_or(slip[1] / speed),
        spin: motion.spin.unwrap_or(away / speed),
        speed,
    })
}
