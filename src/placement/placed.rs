//! A wheel placed on its rail: touch, curvatures, frame, creepages and gap.

use super::frame::{Creepages, Frame, RollingMotion};
use super::gap::Gap;
use super::hertz::{Ellipse, HertzLoad};
use super::touch::Close;
use super::{frame, gap, pose, Curvatures, PlacedWheel, Seat, Touch, WIDTH_OF_OVERLAP};
use crate::{Error, Result};

impl PlacedWheel {
    /// The point of contact.
    pub fn touch(&self) -> Touch {
        self.report(&self.minima[0], 0.0, false)
    }

    /// Other points that would be in contact as well once the bodies have approached each other by `approach`, m. The
    /// program computes one contact: a separate one means that the real wheel has two.
    pub fn others(&self, approach: f64) -> Result<Vec<Touch>> {
        let found = self.pair.others(&self.minima, approach, self.bounds)?;
        Ok(found.iter().map(|(c, gap, separate)| self.report(c, *gap, *separate)).collect())
    }

    fn report(&self, c: &Close, gap: f64, separate: bool) -> Touch {
        let sign = self.side.sign();
        let [x, y, z] = c.lowest.point;
        Touch {
            wheel: c.lowest.wheel_y,
            rail: y - self.rail_shift,
            point: [x, sign * y, z],
            angle: sign * c.rail_slope.atan(),
            radius: self.pair.wheel.radius_at(c.lowest.wheel_y),
            gap,
            separate,
        }
    }

    /// Lateral shift (m), roll (rad) and height of the axle (m, down, zero one radius above the rails' tops) of the
    /// wheelset at first touch.
    pub fn wheelset(&self) -> [f64; 3] {
        let w = &self.pair.wheel;
        [self.side.sign() * w.lateral, self.side.sign() * w.roll, w.height]
    }

    /// The curvatures at the point of contact.
    pub fn curvatures(&self) -> Curvatures {
        let (h, [wheel_rolling, wheel_across, rail_across]) = self.pair.curvatures(&self.minima[0]);
        let mixed = -self.side.sign() * h[0][1];
        let relative = [[h[0][0], mixed], [mixed, h[1][1]]];
        Curvatures { wheel_rolling, wheel_across, rail_rolling: 0.0, rail_across, relative }
    }

    /// Hertz' ellipse at the point of contact, for a contact modulus E*, Pa.
    ///
    /// # Errors
    /// As [`Ellipse::new`]; an ellipse that reaches the end of a profile.
    pub fn ellipse(&self, modulus: f64, press: HertzLoad) -> Result<Ellipse> {
        let ellipse = Ellipse::new(self.curvatures().relative, modulus, press)?;
        let touch = self.touch();
        let half = ellipse.extent()[1];
        for (what, profile, y) in [
            ("wheel", &self.pair.wheel.profile, touch.wheel),
            ("rail", &self.pair.rail, self.side.sign() * touch.point[1]),
        ] {
            if !profile.contains(y - half) || !profile.contains(y + half) {
                let [from, to] = profile.range().map(|end| 1e3 * (end - y).abs());
                return Err(Error::Job(format!(
                    "placement: the contact, {:.2} mm wide, reaches the end of the profile of the {what} ({}): \
                     found {:.2} mm from the point of \
                     contact to it; move the wheel, or give a profile that goes on",
                    2e3 * half,
                    profile.name(),
                    from.min(to)
                )));
            }
        }
        Ok(ellipse)
    }

    /// The frame at the point of contact.
    pub fn frame(&self) -> Frame {
        let first = &self.minima[0];
        let [x, y, _] = first.lowest.point;
        Frame { side: self.side, origin: [x, y, self.pair.rail.local(y).z], angle: first.rail_slope.atan() }
    }

    /// The frame in the middle of the overlap of the undeformed bodies at an `approach`, m, with the mean angle
    /// there: nearer to the centre of the pressure where curvatures change within the contact.
    pub fn centred_frame(&self, approach: f64) -> Result<Frame> {
        let (origin, angle) = self.pair.centre(&self.minima[0], approach, self.bounds)?;
        Ok(Frame { side: self.side, origin, angle })
    }

    /// Half extents along x and y of a contact in a frame, m, for [`super::grid_lines`]: those of the ellipse, or of
    /// the overlap of the undeformed bodies where that is wider, as it is where curvatures change within the contact. A
    /// contact that reaches the border of its grid all the same needs a larger one.
    pub fn extent(&self, frame: &Frame, ellipse: &Ellipse) -> Result<[f64; 2]> {
        let [from, to] = self.pair.reach(&self.minima[0], ellipse.approach, self.bounds)?;
        let wide = (to - frame.origin[1]).max(frame.origin[1] - from) / frame.angle.cos();
        let [along, across] = ellipse.extent();
        Ok([along, across.max(WIDTH_OF_OVERLAP * wide)])
    }

    /// The creepages in a frame.
    pub fn creepages(&self, frame: &Frame, motion: &RollingMotion) -> Result<Creepages> {
        frame::creepages(&self.pair.wheel, frame, motion)
    }

    /// The gap at first touch on the lines of a grid in a frame, m.
    pub fn gap(&self, frame: &Frame, x: &[f64], y: &[f64]) -> Result<Gap> {
        gap::gap(&self.pair, frame, [x, y], self.bounds)
    }

    /// The rail's line in the track frame, (y, z) in m, places no further apart than `step` (m): to be drawn.
    pub(crate) fn rail_line(&self, step: f64) -> Vec<[f64; 2]> {
        let rail = &self.pair.rail;
        rail.nodes(step).into_iter().map(|y| [self.side.sign() * y, rail.local(y).z]).collect()
    }

    /// The wheel's outline at first touch, seen along the track, (y, z) of the track frame in m, places of the
    /// profile no further apart than `step` (m).
    pub(crate) fn wheel_line(&self, step: f64) -> Vec<[f64; 2]> {
        let wheel = &self.pair.wheel;
        let points = wheel.profile.nodes(step).into_iter().filter_map(|y| wheel.lowest(y));
        points.map(|l| [self.side.sign() * l.point[1], l.point[2]]).collect()
    }

    /// Height by which the wheel was lowered from that of a running circle on the tops of the rails until it touched,
    /// m: what places of one wheel differ by is their vertical distance when the first one touches.
    pub fn height(&self) -> f64 {
        self.pair.wheel.height
    }

    /// Positions of the origin of a frame on the rail's and on the wheel's own drawings.
    ///
    /// # Errors
    /// There is no wheel above the origin.
    pub fn seats(&self, frame: &Frame) -> Result<[Seat; 2]> {
        let sign = self.side.sign();
        let [_, y, z] = frame.origin;
        // The turn of [`Profile::turned`] undone.
        let (s, c) = self.cant.sin_cos();
        let [across, down] = [y - self.rail_shift, z + self.crown];
        let rail = Seat {
            y: sign * (c * across - s * down),
            z: self.middle - (s * across + c * down),
            tilt: -sign * (frame.angle + self.cant),
        };
        let (wheel_y, _) = self.pair.wheel.meet(frame.origin, frame.normal()).ok_or_else(|| {
            Error::Job(format!(
                "placement: there is no wheel above the point y = {:.2} mm of the track",
                1e3 * sign * y
            ))
        })?;
        let axle = self.axle(frame);
        let profile = &self.pair.wheel.profile;
        let wheel = Seat {
            y: sign * wheel_y,
            z: profile.local(wheel_y).z - profile.local(0.0).z,
            tilt: axle[2].atan2(axle[1]),
        };
        Ok([rail, wheel])
    }

    /// Distance of the origin of a frame ahead of the axle, m, across it: the other wheel of a yawed wheelset lies
    /// behind or ahead of this one along the track, and not about the axle.
    pub(crate) fn ahead_of_axle(&self, frame: &Frame) -> f64 {
        let wheel = &self.pair.wheel;
        wheel.inwards(pose::along(frame.origin, -1.0, wheel.centre()))[0]
    }

    /// Direction of the axle in the frame of the program, `[3]`, with a positive y; in lower form, in which the wheel
    /// is described, its z is reversed.
    pub fn axle(&self, frame: &Frame) -> [f64; 3] {
        frame.axle(self.pair.wheel.axle())
    }
}
