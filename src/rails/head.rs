//! The head of a rail: arcs from the crown outwards that meet tangentially, then straight sides.

/// A point of the head of an upright rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadPoint {
    /// Lateral position, to the right of the middle of the head, m.
    pub y: f64,
    /// Height over the underside of the foot, m.
    pub z: f64,
    /// Angle of the tangent, from y to z, rad: negative on the right of the crown.
    pub angle: f64,
}

impl HeadPoint {
    /// A point (z, y) of the upright section in the frame of the surface here: (z, y), m.
    pub(crate) fn in_surface_frame(&self, [z, y]: [f64; 2]) -> [f64; 2] {
        let (s, c) = self.angle.sin_cos();
        let (y, z) = (y - self.y, z - self.z);
        [c * z - s * y, c * y + s * z]
    }
}

/// The running surface of a symmetric head, upright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Head {
    /// Radii of the arcs from the crown outwards, m.
    pub radii: &'static [f64],
    /// Distances from the middle at which the arcs end but for the last, which ends where the side begins, m.
    pub ends: &'static [f64],
    /// Fall of the sides for each unit of width.
    pub side: f64,
    /// Height of the crown over the underside of the foot, m.
    pub height: f64,
}

/// Largest depth of a contact below the crown, on the face of the head, m.
pub const DEEPEST: f64 = 16e-3;
/// Steepest surface at a contact that is given by its lateral position alone, rad: 72 degrees. On steeper ones the
/// position hardly says the height.
pub const STEEPEST: f64 = 1.256_637_061_435_917_2;
/// Places between the ends of the head of which the nearest one starts a search.
const PLACES: usize = 400;

impl Head {
    /// Angle of the sides, at which the last arc ends, rad.
    pub fn steep(&self) -> f64 {
        self.side.atan()
    }

    /// Radii of the arcs, m, and the angles at which they end, rad, from the crown outwards.
    fn arcs(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (mut y, mut angle) = (0.0, 0.0_f64);
        self.radii.iter().enumerate().map(move |(k, &radius)| {
            let end = self.ends.get(k).map_or(self.steep(), |end| (angle.sin() + (end - y) / radius).asin());
            y += radius * (end.sin() - angle.sin());
            angle = end;
            (radius, end)
        })
    }

    /// The place at the length `along`, m, of the surface from the crown, to the left if negative; beyond the arcs on
    /// the straight side.
    pub fn point(&self, along: f64) -> HeadPoint {
        let (mut left, mut angle, mut at) = (along.abs(), 0.0_f64, [0.0, self.height]);
        for (radius, end) in self.arcs() {
            let step = (left / radius).min(end - angle).max(0.0);
            at[0] += radius * ((angle + step).sin() - angle.sin());
            at[1] -= radius * (angle.cos() - (angle + step).cos());
            left -= radius * step;
            angle += step;
        }
        // What rounding leaves on the arcs is no way down the side.
        if left > 1e-12 {
            at = [at[0] + left * angle.cos(), at[1] - left * angle.sin()];
        }
        HeadPoint { y: along.signum() * at[0], z: at[1], angle: -along.signum() * angle }
    }

    /// Length of the surface from the crown to where its arcs have the angle `angle`, rad.
    pub fn to_angle(&self, angle: f64) -> f64 {
        let (mut length, mut from) = (0.0, 0.0);
        for (radius, end) in self.arcs() {
            length += radius * (end.min(angle) - from).max(0.0);
            from = end;
        }
        length
    }

    /// Length of the surface from the crown to the distance `y` ≥ 0 from the middle, m, on the arcs.
    pub(crate) fn to_distance(self, y: f64) -> f64 {
        let (mut length, mut angle, mut at) = (0.0, 0.0_f64, 0.0);
        for (radius, end) in self.arcs() {
            let reached = at + radius * (end.sin() - angle.sin());
            if y <= reached {
                let here = (angle.sin() + (y - at) / radius).asin();
                return length + radius * (here - angle);
            }
            length += radius * (end - angle);
            (at, angle) = (reached, end);
        }
        length
    }

    /// Length of the surface from the crown to the depth [`DEEPEST`] below it, m.
    pub(crate) fn to_deepest(self) -> f64 {
        let steep = self.steep();
        let end = self.to_angle(steep);
        let depth = self.height - self.point(end).z;
        end + ((DEEPEST - depth) / steep.sin()).max(0.0)
    }

    /// Largest distance from the middle of a contact that is given by it alone, m, down to tenths of a millimetre.
    pub fn reach(&self) -> f64 {
        (1e4 * self.point(self.to_angle(STEEPEST)).y).floor() / 1e4
    }

    /// Radius of the arc at a distance from the middle, m.
    pub(crate) fn radius_at(&self, y: f64) -> f64 {
        let k = self.ends.iter().take_while(|end| y.abs() >= **end).count();
        self.radii[k]
    }

    /// Length of the surface from the crown, to the left if negative, to the place nearest to (y, z), m, down to the
    /// depth [`DEEPEST`].
    pub fn nearest(&self, [y, z]: [f64; 2]) -> f64 {
        let end = self.to_deepest();
        let at = |s: f64| self.point(s);
        let apart = |s: f64| (at(s).y - y).hypot(at(s).z - z);
        let places = (0..=PLACES).map(|k| end * (2.0 * k as f64 / PLACES as f64 - 1.0));
        let near = places.min_by(|a, b| apart(*a).total_cmp(&apart(*b))).unwrap_or(0.0);
        let step = 2.0 * end / PLACES as f64;
        let (mut low, mut high) = ((near - step).max(-end), (near + step).min(end));
        // The distance falls where the way to the place has a part along the tangent.
        let ahead = |s: f64| {
            let HeadPoint { y: here, z: up, angle } = at(s);
            (y - here) * angle.cos() + (z - up) * angle.sin()
        };
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if ahead(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Distance along the tangent of the place at `y`, m, to where the nearer side of the head begins, m.
    pub fn room(&self, y: f64) -> f64 {
        let here = self.point(y.signum() * self.to_distance(y.abs()));
        let end = self.to_angle(self.steep());
        let (sin, cos) = here.angle.sin_cos();
        let along = |s: f64| {
            let there = self.point(s);
            ((there.y - here.y) * cos + (there.z - here.z) * sin).abs()
        };
        along(end).min(along(-end))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ALL, R115RE, R49E1, R54E1, R60E1, R60E2};
    use super::*;

    #[test]
    fn the_nearest_place_of_a_place_is_itself() {
        let head = R60E1.head;
        let end = head.to_deepest();
        for k in -20..=20 {
            let s = end * f64::from(k) / 20.0;
            let at = head.point(s);
            assert!((head.nearest([at.y, at.z]) - s).abs() < 1e-12, "{s}");
            // So is that of what lies off it along the normal.
            let off = 1e-3;
            let above = [at.y - off * at.angle.sin(), at.z + off * at.angle.cos()];
            assert!((head.nearest(above) - s).abs() < 1e-9, "{s} {}", head.nearest(above));
        }
        assert!((head.height - head.point(end).z - DEEPEST).abs() < 1e-12);
    }

    /// Places, lengths and angles of 60E1 agree; the height is continuous where arcs and the side meet.
    #[test]
    fn arcs_and_sides_meet() {
        let head = R60E1.head;
        let steep = head.steep();
        for head in ALL.map(|rail| rail.head) {
            for (_, end) in head.arcs() {
                let s = head.to_angle(end);
                let [a, b] = [s - 1e-9, s + 1e-9].map(|s| head.point(s));
                assert!((a.y - b.y).hypot(a.z - b.z) < 2.1e-9 && (a.angle - b.angle).abs() < 3e-7, "{a:?} {b:?}");
            }
            for &end in head.ends {
                assert!((head.point(head.to_distance(end)).y - end).abs() < 1e-15);
            }
        }
        for y in [3e-3, 15e-3, 30e-3, head.reach()] {
            assert!((head.point(head.to_distance(y)).y - y).abs() < 1e-15);
        }
        assert_eq!(head.reach(), 0.0353);
        assert!((head.point(head.to_angle(steep)).y - 36e-3).abs() < 1e-6);
        assert_eq!([0.0, 0.0102, 0.0103, 0.03].map(|y| head.radius_at(-y)), [0.3, 0.3, 0.08, 0.013]);
        // On the crown the nearer side begins 36 mm away.
        assert!((head.room(0.0) - 36e-3).abs() < 1e-6);
        // Half width and depth where the sides begin: from the tangency of the arcs, round numbers.
        for (rail, [y, depth]) in [(&R49E1, [33.5e-3, 14e-3]), (&R54E1, [35e-3, 14.1e-3]), (&R60E2, [36e-3, 14.3e-3])] {
            let at = rail.head.point(rail.head.to_angle(rail.head.steep()));
            let off = (at.y - y).hypot(rail.head.height - depth - at.z);
            assert!(off < 1e-6, "{}: {at:?}", rail.name);
        }
        // The sides of 115RE, 1:40, are 2 23/32 inch apart on the fishing faces, which meet the middle 1 11/16 inch
        // below the crown with a slope of 1:4.
        let [half, depth] = [2.71875 / 2.0 * 25.4e-3, 1.6875 * 25.4e-3];
        let at = R115RE.head.point(R115RE.head.to_angle(40.0_f64.atan()));
        let lower = R115RE.head.height - depth + half / 4.0;
        assert!((at.y + (at.z - lower) / 40.0 - half).abs() < 1e-7, "{at:?}");
    }
}
