//! The section of the rail 60E1: structured 9-node quadrilaterals in three blocks, foot, web and head, mapped onto its outline.
//!
//! The head runs on arcs of 300, 80 and 13 mm that meet tangentially 20.456 mm and 52.053 mm apart, with sides of 1:20 (EN 13674-1). The rest of the
//! outline is that of the program Rolland (M. Mantel, github mantelmax/rolland, BSD-3-Clause), made symmetric; y to the right, z up from the foot,
//! mm.

use super::builtin::{Focus, Lines};
use super::{Beam, HeadPoint, Path, Section};
use crate::fem::Material;
use crate::{Error, Result};

/// From the lower corner of the head to the web.
const UNDERSIDE: [[f64; 2]; 8] = [
    [36.40, 134.73],
    [35.90, 134.27],
    [35.34, 133.90],
    [34.72, 133.63],
    [16.91, 127.15],
    [15.67, 126.61],
    [15.08, 126.28],
    [14.54, 125.87],
];
/// Down the web, in the middle of its upper and its lower fillet.
#[rustfmt::skip]
const WEB: [[f64; 2]; 26] = [
    [14.54, 125.87], [14.03, 125.43], [13.56, 124.94], [13.16, 124.40], [12.79, 123.83], [12.25, 122.59], [11.67, 120.65], [11.35, 119.33],
    [10.37, 114.69], [9.89, 112.03], [9.38, 108.68], [9.04, 106.00], [8.76, 103.30], [8.38, 97.90], [8.25, 92.49], [8.25, 59.31],
    [8.39, 54.58], [8.70, 49.85], [9.12, 45.81], [9.68, 41.79], [10.37, 37.78], [11.35, 33.15], [11.85, 31.18], [12.51, 29.26],
    [13.17, 28.08], [14.05, 27.06],
];
/// Along the upper side of the foot.
#[rustfmt::skip]
const FOOT: [[f64; 2]; 16] = [
    [14.05, 27.06], [14.56, 26.61], [15.70, 25.88], [16.94, 25.36], [44.94, 15.18], [47.51, 14.34], [48.82, 13.99], [50.80, 13.54],
    [52.80, 13.20], [54.14, 13.02], [70.35, 11.83], [71.69, 11.70], [72.34, 11.51], [72.95, 11.23], [73.52, 10.86], [73.99, 10.38],
];
/// Up its tip.
#[rustfmt::skip]
const TIP: [[f64; 2]; 7] = [
    [75.00, 0.00], [75.00, 3.19], [74.99, 7.93], [74.88, 8.59], [74.69, 9.24], [74.40, 9.84], [73.99, 10.38],
];
/// Up the side of the head, from its lower corner to where the arc of 13 mm begins.
const SIDE: [[f64; 2]; 5] = [[36.40, 134.73], [36.72, 135.31], [36.95, 135.94], [37.03, 136.60], [36.00, 157.70]];

/// Height, m.
const HEIGHT: f64 = 172e-3;
/// Radii of the head from the crown outwards, m, and the distances from the middle at which they end, m.
const RADII: [f64; 3] = [300e-3, 80e-3, 13e-3];
const ENDS: [f64; 2] = [10.228e-3, 26.0265e-3];
/// Angle of the last arc at which the top of the head's block ends and its side begins, and at which the arc does, rad.
const CORNER: f64 = 0.87;
const STEEP: f64 = 1.520_837_931_072_954;
/// Half width of the web's block on the lines of the mesh, m.
const STEM: f64 = 14e-3;
/// Largest edge length, m: a wave of 6 kHz in the web is six times as long.
const LARGEST: f64 = 15e-3;
/// Largest edge length of the mesh for loads, m.
const FINE: f64 = 10e-3;

/// The rail 60E1 whose contact point is at a place of its head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rail60E1 {
    /// Length of the surface from the crown to the contact point, m.
    along: f64,
}

/// Angles at which the arcs of the head end, rad.
fn angles() -> [f64; 3] {
    let first = (ENDS[0] / RADII[0]).asin();
    let second = ((ENDS[1] - (RADII[0] - RADII[1]) * first.sin()) / RADII[1]).asin();
    [first, second, STEEP]
}

/// The place at the length `along`, m, of the surface from the crown, to the left if negative.
fn on_head(along: f64) -> HeadPoint {
    let (mut left, mut angle, mut at) = (along.abs(), 0.0_f64, [0.0, HEIGHT]);
    for (radius, end) in RADII.into_iter().zip(angles()) {
        let step = (left / radius).min(end - angle).max(0.0);
        at[0] += radius * ((angle + step).sin() - angle.sin());
        at[1] -= radius * (angle.cos() - (angle + step).cos());
        left -= radius * step;
        angle += step;
    }
    HeadPoint { y: along.signum() * at[0], z: at[1], angle: -along.signum() * angle }
}

/// Length of the surface from the crown to where the last arc has the angle `angle`, rad.
fn to_angle(angle: f64) -> f64 {
    let [first, second, _] = angles();
    RADII[0] * first + RADII[1] * (second - first) + RADII[2] * (angle - second)
}

/// The point at the part `part` of the length of a line, mm; m.
fn on_line(line: &[[f64; 2]], part: f64) -> [f64; 2] {
    let length = |w: &[[f64; 2]]| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]);
    let mut left = part * line.windows(2).map(length).sum::<f64>();
    let mut at = line[0];
    for w in line.windows(2) {
        let step = length(w);
        let here = (left / step).clamp(0.0, 1.0);
        at = [0, 1].map(|c| w[0][c] + here * (w[1][c] - w[0][c]));
        left -= step;
        if left <= 0.0 {
            break;
        }
    }
    at.map(|v| 1e-3 * v)
}

/// The point at the part `part` of the side of the head: a line, then the rest of the arc.
fn on_side(part: f64) -> [f64; 2] {
    let straight = 1e-3 * SIDE.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum::<f64>();
    let arc = RADII[2] * (STEEP - CORNER);
    let length = part * (straight + arc);
    if length <= straight {
        return on_line(&SIDE, length / straight);
    }
    let place = on_head(to_angle(STEEP) - (length - straight));
    [place.y, place.z]
}

/// Half of the width of the web at a height, m.
fn web(z: f64) -> f64 {
    let z = 1e3 * z;
    let within = WEB.windows(2).find(|w| z >= w[1][1]).unwrap_or(&WEB[WEB.len() - 2..]);
    let part = ((z - within[1][1]) / (within[0][1] - within[1][1])).clamp(0.0, 1.0);
    1e-3 * (within[1][0] + part * (within[0][0] - within[1][0]))
}

/// A block that is symmetric about y = 0: its lines of the mesh reach from −`half` to `half`; lower and upper side are given for s ≥ 0, its right
/// side from 0, below, to 1, m.
struct Block<'b> {
    half: f64,
    lower: &'b dyn Fn(f64) -> [f64; 2],
    upper: &'b dyn Fn(f64) -> [f64; 2],
    side: &'b dyn Fn(f64) -> [f64; 2],
}

impl Block<'_> {
    /// The point at s and the part t of the height (W. J. Gordon, C. A. Hall, Int. J. Numer. Meth. Engng 7 (1973) 461).
    fn at(&self, s: f64, t: f64) -> [f64; 2] {
        let mirrored = |p: [f64; 2]| if s < 0.0 { [-p[0], p[1]] } else { p };
        let (lower, upper) = (mirrored((self.lower)(s.abs())), mirrored((self.upper)(s.abs())));
        let (side, low, high) = ((self.side)(t), (self.lower)(self.half), (self.upper)(self.half));
        // What the right side is off the straight line between its ends, and what the left one is.
        let off = [0, 1].map(|c| side[c] - (1.0 - t) * low[c] - t * high[c]);
        let part = s / self.half;
        [(1.0 - t) * lower[0] + t * upper[0] + part * off[0], (1.0 - t) * lower[1] + t * upper[1] + off[1]]
    }
}

/// The place on the upright section of what is at the height z and at s across on the lines of the mesh, m.
fn place([z, s]: [f64; 2]) -> [f64; 2] {
    let (top, bottom) = (1e-3 * WEB[0][1], 1e-3 * WEB[WEB.len() - 1][1]);
    let stem = |s: f64, z: f64| [s / STEM * web(z), z];
    let beside = |s: f64, half: f64| (s - STEM) / (half - STEM);
    if z > bottom && z < top {
        return stem(s, z);
    }
    if z >= top {
        let half = to_angle(CORNER);
        let lower = |s: f64| match s <= STEM {
            true => stem(s, top),
            false => on_line(&UNDERSIDE, 1.0 - beside(s, half)),
        };
        let upper = |s: f64| [on_head(s).y, on_head(s).z];
        return Block { half, lower: &lower, upper: &upper, side: &on_side }.at(s, (z - top) / (HEIGHT - top));
    }
    let half = 1e-3 * TIP[0][0];
    let inner = web(bottom);
    let lower = |s: f64| match s <= STEM {
        true => [s / STEM * inner, 0.0],
        false => [inner + beside(s, half) * (half - inner), 0.0],
    };
    let upper = |s: f64| match s <= STEM {
        true => stem(s, bottom),
        false => on_line(&FOOT, beside(s, half)),
    };
    Block { half, lower: &lower, upper: &upper, side: &|t| on_line(&TIP, t) }.at(s, z / bottom)
}

impl Rail60E1 {
    /// The rail with the contact point at y, m, of its head, to the right of its middle.
    pub fn new(y: f64) -> Result<Self> {
        let reach = on_head(to_angle(CORNER)).y;
        if !(y.abs() < reach) {
            return Err(Error::Job(format!(
                "the contact point on the rail 60E1: found y = {y} m, expected a place on its head, less than {reach:.4} m from the middle"
            )));
        }
        let angles = angles();
        let (mut start, mut angle) = (0.0, 0.0_f64);
        let mut at = 0.0;
        for (radius, end) in RADII.into_iter().zip(angles) {
            let reached = at + radius * (end.sin() - angle.sin());
            if y.abs() <= reached {
                let here = (angle.sin() + (y.abs() - at) / radius).asin();
                start += radius * (here - angle);
                break;
            }
            start += radius * (end - angle);
            (at, angle) = (reached, end);
        }
        Ok(Self { along: y.signum() * start })
    }

    /// The beam that it is, vertically or laterally: figures of EN 13674-1, and parts that shear of D. J. Thompson, Railway Noise and Vibration,
    /// 2009.
    pub fn beam(material: Material, lateral: bool, loss: f64) -> Beam {
        let (inertia, sheared) = if lateral { (5.127e-6, 0.538) } else { (3.037e-5, 0.393) };
        let Material { young, density, .. } = material;
        Beam { young, shear: material.shear(), density, area: 76.70e-4, inertia, sheared, loss }
    }

    /// The contact point.
    pub fn contact(&self) -> HeadPoint {
        on_head(self.along)
    }

    fn seen(&self, [y, z]: [f64; 2]) -> [f64; 2] {
        self.contact().seen([z, y])
    }

    /// Height of the surface over its tangent at the contact point, m, at the distance `y` from there along the tangent; 0 there, negative elsewhere.
    pub fn height(&self, y: f64) -> f64 {
        let end = to_angle(STEEP);
        let (mut low, mut high) = (-end, end);
        let point = |s: f64| self.seen([on_head(s).y, on_head(s).z]);
        // Along the tangent the distance grows with the length of the surface up to where that is upright.
        while high - low > 1e-15 + 1e-14 * end {
            let middle = 0.5 * (low + high);
            if point(middle)[1] < y {
                low = middle;
            } else {
                high = middle;
            }
        }
        point(0.5 * (low + high))[0]
    }

    /// Length of the surface, along the tangent, from the contact point to where the arc of the corner begins, m, to the nearer side.
    pub fn room(&self) -> f64 {
        let corner = to_angle(angles()[1]);
        [-corner, corner]
            .map(|s| self.seen([on_head(s).y, on_head(s).z])[1].abs())
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// The mesh for the modes, in the frame of the surface at the contact point.
    pub fn for_modes(&self) -> Result<Section> {
        self.section(Focus { size: LARGEST, reach: 0.0, corner: LARGEST, largest: LARGEST })
    }

    /// The mesh for loads spread over circles of the radius `radius`, m, and more, in the same frame.
    pub fn for_loads(&self, radius: f64) -> Result<Section> {
        self.section(Focus { size: radius / 3.0, reach: 1.5 * radius, corner: FINE, largest: FINE })
    }

    /// The section with the groups `foot`, its lower side, and `head`, the running line, in the frame of the surface at the contact point.
    pub fn section(&self, focus: Focus) -> Result<Section> {
        let (top, bottom) = (1e-3 * WEB[0][1], 1e-3 * WEB[WEB.len() - 1][1]);
        let (head, foot) = (to_angle(CORNER), 1e-3 * TIP[0][0]);
        let z = focus.lines(&[0.0, bottom, top, HEIGHT], &[HEIGHT], &[]);
        let y = focus.lines(&[-foot, -head, -STEM, STEM, head, foot], &[self.along], &[]);
        let inside = |z: f64, y: f64| match z {
            z if z < bottom => true,
            z if z < top => y.abs() < STEM,
            _ => y.abs() < head,
        };
        let mut section = Lines { r: &z, y: &y }.section(inside, |at| self.seen(place(at)), |z, _| z == HEIGHT);
        let foot = section.groups.remove("inner").unwrap_or_default();
        let mut head: Vec<usize> = section.tread.iter().flatten().copied().collect();
        head.sort_unstable();
        head.dedup();
        section.groups = [("foot".to_string(), foot), ("head".to_string(), head)].into();
        section.check(Path::Line(1.0))?;
        Ok(section)
    }
}
