//! Contacts of a body: their grids, frames and places, and how near to each other they may lie.

use crate::swept::LoadCircle;
use crate::{Error, Result};

/// Contact of a body: the lines of its grid, the frame of its rows, and its place, of the type `P`, on the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSpec<'a, P> {
    /// Lines of the contact grid along x and y, m.
    pub lines: [&'a [f64]; 2],
    /// Angle of the frame of the contact about x, rad: of a body of revolution against that of the axle, as
    /// [`rotate_loads`](crate::swept::rotate_loads) has it; of a rail against the upright section.
    pub tilt: f64,
    /// Place on the section; none: the contact point of the section itself.
    pub place: Option<P>,
    /// Place along the path of the section: angle about the axle, rad, or distance x along a rail, m.
    pub along: f64,
}

impl<'a, P> ContactSpec<'a, P> {
    /// Contact at the contact point of a section, in a frame of the angle `tilt`, rad.
    pub fn own(lines: [&'a [f64]; 2], tilt: f64) -> Self {
        Self { lines, tilt, place: None, along: 0.0 }
    }
}

/// Position of a contact: a point, m, and the unit normal out of the body there, in one frame for all of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPosition {
    /// Point, m.
    pub point: [f64; 3],
    /// Normal out of the body.
    pub normal: [f64; 3],
}

/// Distance of two contacts over the radius of the wider one's circle below which nine means do not describe what one
/// does to the other.
const NEAR: f64 = 3.0;
/// Largest angle between the normals of places that one grid spans, rad.
const ALIKE: f64 = 0.2;

impl ContactPosition {
    /// Position at the angle `along` about an axle, rad, from the place (r, y) of a section, m, whose normal is turned
    /// by `angle`, rad, from the radius to smaller y.
    pub fn round([r, y]: [f64; 2], along: f64, angle: f64) -> Self {
        let ((s, c), (lean, up)) = (along.sin_cos(), angle.sin_cos());
        Self { point: [r * s, y, r * c], normal: [up * s, -lean, up * c] }
    }

    /// The same at the distance `along`, m, on a line.
    pub fn straight([z, y]: [f64; 2], along: f64, angle: f64) -> Self {
        let (lean, up) = angle.sin_cos();
        Self { point: [along, y, z], normal: [0.0, -lean, up] }
    }

    /// Distance, m.
    pub fn distance(&self, other: &Self) -> f64 {
        (0..3).map(|c| (self.point[c] - other.point[c]).powi(2)).sum::<f64>().sqrt()
    }

    /// Angle between the normals, rad.
    pub fn angle(&self, other: &Self) -> f64 {
        (0..3).map(|c| self.normal[c] * other.normal[c]).sum::<f64>().clamp(-1.0, 1.0).acos()
    }
}

/// Remarks on contacts that lie near each other, with loads on the `circles`. An error where two of them are one:
/// nearer than three radii, with normals that differ by less than 0.2 rad.
pub fn near_contacts(positions: &[ContactPosition], circles: &[LoadCircle]) -> Result<Vec<String>> {
    let mut remarks = Vec::new();
    for (d, there) in positions.iter().enumerate() {
        for (c, here) in positions[..d].iter().enumerate() {
            let (distance, angle) = (here.distance(there), here.angle(there));
            let least = NEAR * circles[c].radius.max(circles[d].radius);
            if distance >= least {
                continue;
            }
            let [a, b] = [c + 1, d + 1];
            if angle < ALIKE {
                return Err(Error::Job(format!(
                    "contacts {a} and {b} of the body: found {:.2} mm between them, with normals that differ by \
                     {angle:.3} rad; expected at least {:.2} mm, three radii of their circles, or {ALIKE} rad: take \
                     them as one contact, on one grid that spans both, or make the grids smaller",
                    1e3 * distance,
                    1e3 * least
                )));
            }
            remarks.push(format!(
                "contacts {a} and {b} lie {:.2} mm apart, less than three radii of their circles, with normals that \
                 differ by {angle:.2} rad: their compliance with each other is rough",
                1e3 * distance
            ));
        }
    }
    Ok(remarks)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contacts on one tread are refused below three radii, those on tread and flange are told, and those beside each
    /// other along the circumference have their distance and their angle.
    #[test]
    fn near_contacts_are_refused_or_told() {
        let circles = [LoadCircle { radius: 4e-3 }, LoadCircle { radius: 5e-3 }];
        let tread = ContactPosition::round([0.46, 0.0], 0.0, 0.0);
        let beside =
            |y: f64, angle: f64| near_contacts(&[tread, ContactPosition::round([0.46, y], 0.0, angle)], &circles);
        assert_eq!(beside(0.016, 0.0).unwrap(), Vec::<String>::new());
        let error = beside(0.014, 0.1).unwrap_err();
        assert!(error.exit_code() == 2 && error.message().contains("14.00 mm between them"), "{error}");
        let told = beside(0.014, 1.2).unwrap();
        assert!(told.len() == 1 && told[0].contains("differ by 1.20 rad"), "{told:?}");
        let ahead = ContactPosition::round([0.46, 0.0], 0.5, 0.0);
        assert!(
            (tread.distance(&ahead) - 0.92 * 0.25f64.sin()).abs() < 1e-15 && (tread.angle(&ahead) - 0.5).abs() < 1e-12
        );
        let along =
            ContactPosition::straight([0.0, 0.01], 0.3, 0.0).distance(&ContactPosition::straight([0.0; 2], 0.0, 0.0));
        assert!((along - 0.3f64.hypot(0.01)).abs() < 1e-15);
    }
}
