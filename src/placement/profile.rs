//! A profile: the height z over the lateral position y, of exact pieces.

use crate::{Error, Result};
use std::cell::Cell;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Slopes that differ by no more than this at a break are one tangent: drawings are given to so many digits.
#[cfg(test)]
const TANGENT: f64 = 1e-3;

/// Longest piece of a curve other than a line or an arc when a profile is turned, m.
const TURNED_PIECE: f64 = 5e-4;

/// Angle to the upright, rad, below which a side of a turned profile counts as one that hangs over.
pub(super) const UPRIGHT: f64 = 5e-3;

/// One piece of a profile, in m.
#[derive(Debug, Clone, PartialEq)]
pub enum ProfilePiece {
    /// z = Σ c_k (y − at)^k, c_k in m^(1−k).
    Polynomial {
        /// Centre of the expansion of the polynomial, m.
        at: f64,
        /// Coefficients c_0, c_1, …
        coefficients: Vec<f64>,
    },
    /// z = z_c ± √(R² − (y − y_c)²).
    Arc {
        /// Centre (y_c, z_c), m.
        centre: [f64; 2],
        /// Radius R, m; positive for the branch with +, which is below the centre as z points down, negative for that
        /// above it.
        radius: f64,
    },
}

/// Height, slope and second derivative of a profile at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Local {
    /// Height z, downwards, m.
    pub z: f64,
    /// dz/dy, 1.
    pub slope: f64,
    /// d²z/dy², 1/m.
    pub second: f64,
}

impl Local {
    /// Curvature of the line, 1/m, positive where it is bent downwards to either side, as a rail's head is.
    pub fn curvature(&self) -> f64 {
        self.second / (1.0 + self.slope * self.slope).powf(1.5)
    }
}

impl ProfilePiece {
    /// The piece at `y`, m.
    pub fn local(&self, y: f64) -> Local {
        match self {
            ProfilePiece::Polynomial { at, coefficients } => {
                let t = y - at;
                let (mut z, mut slope, mut half) = (0.0, 0.0, 0.0);
                for c in coefficients.iter().rev() {
                    half = half * t + slope;
                    slope = slope * t + z;
                    z = z * t + c;
                }
                Local { z, slope, second: 2.0 * half }
            }
            ProfilePiece::Arc { centre, radius } => {
                let t = y - centre[0];
                // The end of an arc may lie a rounding beyond its widest place.
                let h = (radius * radius - t * t).max(f64::MIN_POSITIVE).sqrt() * radius.signum();
                Local { z: centre[1] + h, slope: -t / h, second: -radius * radius / (h * h * h) }
            }
        }
    }

    fn moved(&self, dy: f64, dz: f64) -> Self {
        match self {
            ProfilePiece::Polynomial { at, coefficients } => {
                let mut coefficients = coefficients.clone();
                if let Some(c) = coefficients.first_mut() {
                    *c += dz;
                }
                ProfilePiece::Polynomial { at: at + dy, coefficients }
            }
            ProfilePiece::Arc { centre, radius } => {
                ProfilePiece::Arc { centre: [centre[0] + dy, centre[1] + dz], radius: *radius }
            }
        }
    }

    fn mirrored(&self) -> Self {
        match self {
            ProfilePiece::Polynomial { at, coefficients } => {
                let coefficients =
                    coefficients.iter().enumerate().map(|(k, c)| if k % 2 == 1 { -c } else { *c }).collect();
                ProfilePiece::Polynomial { at: -at, coefficients }
            }
            ProfilePiece::Arc { centre, radius } => {
                ProfilePiece::Arc { centre: [-centre[0], centre[1]], radius: *radius }
            }
        }
    }

    /// The straight piece through two points, m.
    pub fn line(from: [f64; 2], to: [f64; 2]) -> Self {
        ProfilePiece::Polynomial { at: from[0], coefficients: vec![from[1], (to[1] - from[1]) / (to[0] - from[0])] }
    }
}

/// A profile z(y) over a range of y: y positive to the field side of the track, z downwards, m. Outside its range it
/// goes on straight; whoever asks there ([`RunningProfile::contains`]) decides whether that is allowed.
#[derive(Debug, Clone, PartialEq)]
pub struct RunningProfile {
    name: Arc<str>,
    breaks: Arc<[f64]>,
    pieces: Arc<[ProfilePiece]>,
}

impl RunningProfile {
    /// A profile of `pieces`, `[n]`, between `breaks`, m, ascending, `[n + 1]`.
    pub fn new(name: impl Into<String>, breaks: Vec<f64>, pieces: Vec<ProfilePiece>) -> Result<Self> {
        let name = name.into();
        if pieces.is_empty()
            || breaks.len() != pieces.len() + 1
            || breaks.windows(2).any(|w| !(w[1] > w[0]))
            || breaks.iter().any(|b| !b.is_finite())
        {
            return Err(Error::Defect(format!("profile {name}: {} pieces between {breaks:?} m", pieces.len())));
        }
        Ok(Self { name: name.into(), breaks: breaks.into(), pieces: pieces.into() })
    }

    /// Name of the profile in messages: the name of a built-in one, the path of a file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// First and last y, m.
    pub fn range(&self) -> [f64; 2] {
        [self.breaks[0], self.breaks[self.pieces.len()]]
    }

    /// Returns whether `y` (m) is within the range.
    pub fn contains(&self, y: f64) -> bool {
        let [a, b] = self.range();
        (a..=b).contains(&y)
    }

    /// Break points between pieces, and both ends, m.
    pub fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    /// Height, slope and second derivative at `y`, m; at a break those of the piece that begins there, outside the
    /// range those of the tangent at its end.
    pub fn local(&self, y: f64) -> Local {
        self.local_from(y, &Cell::new(0))
    }

    /// The same, looked for from the piece `last` on, which becomes that of `y`.
    pub(super) fn local_from(&self, y: f64, last: &Cell<usize>) -> Local {
        let [a, b] = self.range();
        let inside = y.clamp(a, b);
        let holds = |i: &usize| *i < self.pieces.len() && self.breaks[*i] <= inside && inside < self.breaks[*i + 1];
        let near = [last.get(), last.get() + 1];
        let i = near
            .into_iter()
            .find(holds)
            .unwrap_or_else(|| self.breaks.partition_point(|&v| v <= inside).clamp(1, self.pieces.len()) - 1);
        last.set(i);
        let local = self.pieces[i].local(inside);
        if self.contains(y) {
            return local;
        }
        Local { z: local.z + local.slope * (y - inside), second: 0.0, ..local }
    }

    /// Corners: breaks at which the direction of the line changes by more than 1 mrad, and by how much: (y in m,
    /// angle in rad, positive where the slope grows with y).
    #[cfg(test)]
    pub(crate) fn kinks(&self) -> Vec<(f64, f64)> {
        let pairs = self.pieces.windows(2).zip(&self.breaks[1..]);
        let turn =
            |(pair, &y): (&[ProfilePiece], &f64)| (y, pair[1].local(y).slope.atan() - pair[0].local(y).slope.atan());
        pairs.map(turn).filter(|(_, angle)| angle.abs() > TANGENT).collect()
    }

    /// Places no further apart than `step` (m) over the range, all breaks among them, ascending.
    pub fn nodes(&self, step: f64) -> Vec<f64> {
        let mut nodes = vec![self.breaks[0]];
        for w in self.breaks.windows(2) {
            let n = ((w[1] - w[0]) / step).ceil().max(1.0) as usize;
            nodes.extend((1..=n).map(|i| w[0] + (w[1] - w[0]) * i as f64 / n as f64));
        }
        nodes
    }

    /// The highest place: y, m. A rail has it on its head.
    pub fn top(&self) -> f64 {
        let nodes = self.nodes(1e-4);
        let least = |a: &f64, b: &f64| self.local(*a).z.total_cmp(&self.local(*b).z);
        let Some(k) = (0..nodes.len()).min_by(|&i, &j| least(&nodes[i], &nodes[j])) else { return 0.0 };
        let (mut low, mut high) = (nodes[k.saturating_sub(1)], nodes[(k + 1).min(nodes.len() - 1)]);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if self.local(middle).slope < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// The profile moved by (dy, dz), m.
    pub fn moved(&self, dy: f64, dz: f64) -> Self {
        let breaks = self.breaks.iter().map(|b| b + dy).collect();
        Self { name: self.name.clone(), breaks, pieces: self.pieces.iter().map(|p| p.moved(dy, dz)).collect() }
    }

    /// The profile with y reversed.
    pub fn mirrored(&self) -> Self {
        let breaks = self.breaks.iter().rev().map(|b| -b).collect();
        Self { name: self.name.clone(), breaks, pieces: self.pieces.iter().rev().map(ProfilePiece::mirrored).collect() }
    }

    /// The profile turned about its origin so that its top leans by `angle` (rad) towards −y, as a rail leans towards
    /// the middle of the track. Arcs and lines stay what they are; other curves become quintic pieces that share
    /// value, slope and curvature with the turned ones every 0.5 mm. Sides at either end that would hang over are
    /// cut.
    ///
    /// # Errors
    /// Where the turned line would no longer be a function of y.
    pub fn turned(&self, angle: f64) -> Result<Self> {
        let (from, to) = self.standing(angle)?;
        let (s, c) = angle.sin_cos();
        let point = |y: f64, z: f64| [c * y + s * z, c * z - s * y];
        let (mut breaks, mut pieces) = (Vec::new(), Vec::new());
        for (piece, w) in self.pieces.iter().zip(self.breaks.windows(2)).filter(|(_, w)| w[1] > from && w[0] < to) {
            let w = [w[0].max(from), w[1].min(to)];
            let ends = |y: f64| point(y, piece.local(y).z);
            if breaks.is_empty() {
                breaks.push(ends(w[0])[0]);
            }
            match piece {
                ProfilePiece::Arc { centre, radius } => {
                    pieces.push(ProfilePiece::Arc { centre: point(centre[0], centre[1]), radius: *radius });
                    breaks.push(ends(w[1])[0]);
                }
                ProfilePiece::Polynomial { coefficients, .. } if coefficients.len() <= 2 => {
                    pieces.push(ProfilePiece::line(ends(w[0]), ends(w[1])));
                    breaks.push(ends(w[1])[0]);
                }
                ProfilePiece::Polynomial { .. } => {
                    let n = ((w[1] - w[0]) / TURNED_PIECE).ceil().max(1.0) as usize;
                    let knot = |i: usize| {
                        let y = w[0] + (w[1] - w[0]) * i as f64 / n as f64;
                        let local = piece.local(y);
                        let slope = (local.slope.atan() - angle).tan();
                        let second = local.curvature() * (1.0 + slope * slope).powf(1.5);
                        let [y, z] = point(y, local.z);
                        (y, Local { z, slope, second })
                    };
                    for i in 0..n {
                        let (from, to) = (knot(i), knot(i + 1));
                        pieces.push(quintic(from, to));
                        breaks.push(to.0);
                    }
                }
            }
        }
        if let Some(w) = breaks.windows(2).find(|w| !(w[1] > w[0])) {
            return Err(Error::Input(format!(
                "profile {}: turned by {angle} rad its line is no longer a function of y near y = {:.2} mm: \
                 found a side that hangs over; cut \
                 the side off or reduce the cant",
                self.name,
                1e3 * w[0]
            )));
        }
        Self::new(self.name.to_string(), breaks, pieces)
    }
}

impl RunningProfile {
    /// The range of y, m, without what hangs over at either end once the profile is turned by `angle`, rad.
    fn standing(&self, angle: f64) -> Result<(f64, f64)> {
        let stands = |piece: &ProfilePiece, y: f64| (piece.local(y).slope.atan() - angle).abs() < FRAC_PI_2 - UPRIGHT;
        // From an end inwards: the first piece of which something stands, and where on it that begins.
        let begin = |mut pieces: Box<dyn Iterator<Item = (&ProfilePiece, f64, f64)> + '_>| {
            pieces.by_ref().find(|&(piece, _, inner)| stands(piece, inner)).map(|(piece, outer, inner)| {
                if stands(piece, outer) {
                    return outer;
                }
                let (mut over, mut up) = (outer, inner);
                for _ in 0..60 {
                    let middle = 0.5 * (over + up);
                    *(if stands(piece, middle) { &mut up } else { &mut over }) = middle;
                }
                up
            })
        };
        let pieces = || self.pieces.iter().zip(self.breaks.windows(2));
        let low = begin(Box::new(pieces().map(|(piece, w)| (piece, w[0], w[1]))));
        let high = begin(Box::new(pieces().rev().map(|(piece, w)| (piece, w[1], w[0]))));
        match (low, high) {
            (Some(low), Some(high)) if low < high => Ok((low, high)),
            _ => Err(Error::Input(format!(
                "profile {}: turned by {angle} rad nothing of it faces upwards; expected an angle of some hundredths",
                self.name
            ))),
        }
    }
}

/// The polynomial of fifth degree with the given values, slopes and second derivatives at both ends.
fn quintic((y0, a): (f64, Local), (y1, b): (f64, Local)) -> ProfilePiece {
    let h = y1 - y0;
    let value = b.z - (a.z + h * (a.slope + 0.5 * h * a.second));
    let slope = (b.slope - (a.slope + h * a.second)) * h;
    let second = (b.second - a.second) * h * h;
    let c3 = (10.0 * value - 4.0 * slope + 0.5 * second) / (h * h * h);
    let c4 = (-15.0 * value + 7.0 * slope - second) / h.powi(4);
    let c5 = (6.0 * value - 3.0 * slope + 0.5 * second) / h.powi(5);
    ProfilePiece::Polynomial { at: y0, coefficients: vec![a.z, a.slope, 0.5 * a.second, c3, c4, c5] }
}

#[cfg(test)]
mod tests {
    use super::super::builtin::{rail_60e1, s1002};
    use super::*;

    #[test]
    fn slopes_and_curvatures_are_those_of_differences() {
        for profile in [s1002().unwrap(), rail_60e1().unwrap()] {
            let h = 1e-6;
            for w in profile.breaks().windows(2) {
                for t in [0.1, 0.4, 0.85] {
                    let y = w[0] + t * (w[1] - w[0]);
                    let [a, b, c] = [y - h, y, y + h].map(|y| profile.local(y));
                    let slope = (c.z - a.z) / (2.0 * h);
                    assert!((slope - b.slope).abs() < 1e-6 * (1.0 + b.slope.powi(2)), "{y}: {slope} {}", b.slope);
                    let second = (c.slope - a.slope) / (2.0 * h);
                    assert!((second - b.second).abs() < 1e-4 * (1.0 + b.second.abs()), "{y}: {second} {}", b.second);
                }
            }
        }
    }

    #[test]
    fn a_turned_profile_has_the_same_points_and_curvatures() {
        let angle = 0.025_f64.atan();
        let (s, c) = angle.sin_cos();
        // The steep flange of a wheel would fold; its tread does not.
        let parabola = RunningProfile::new(
            "parabola",
            vec![-0.02, 0.0, 0.03],
            vec![
                ProfilePiece::Polynomial { at: 0.0, coefficients: vec![0.0, 0.0, 2.0, -9.0] },
                ProfilePiece::Polynomial { at: 0.0, coefficients: vec![0.0, 0.0, 2.0] },
            ],
        )
        .unwrap();
        for profile in [parabola, rail_60e1().unwrap()] {
            let turned = profile.turned(angle).unwrap();
            for y in profile.nodes(3.7e-4) {
                let local = profile.local(y);
                let found = turned.local(c * y + s * local.z);
                let z = c * local.z - s * y;
                let steep = 1.0 + found.slope.abs();
                assert!((found.z - z).abs() < 1e-14 * steep, "y {y}: {} {z}", found.z);
            }
            for y in [-0.0153, -0.0021, 0.0042, 0.0239] {
                let local = profile.local(y);
                let found = turned.local(c * y + s * local.z);
                assert!((found.curvature() - local.curvature()).abs() < 1e-7 * local.curvature().abs().max(1.0));
                assert!((found.slope.atan() - local.slope.atan() + angle).abs() < 1e-11);
            }
        }
        // A rail that leans towards −y is highest on its +y side: at 300 mm · sin.
        let top = rail_60e1().unwrap().turned(angle).unwrap().top();
        assert!((top - 0.3 * s).abs() < 1e-9, "{top}");
    }

    /// Sides of 1:20 stand upright at a cant of 1:20, and hang over beyond.
    #[test]
    fn sides_that_hang_over_are_cut() {
        let rail = rail_60e1().unwrap();
        let upright = 0.025_f64.atan();
        let ends = [rail.range()[0], rail.range()[1]];
        assert_eq!(rail.standing(upright).unwrap(), (ends[0], ends[1]), "nothing is cut at 1:40");
        for angle in [0.05_f64.atan(), 0.06, 0.1] {
            let (s, c) = angle.sin_cos();
            for (sign, turned) in [(1.0, rail.turned(angle).unwrap()), (-1.0, rail.turned(-angle).unwrap().mirrored())]
            {
                // Of the arc of 13 mm that much is left: its tangent is then upright but for the margin.
                let low = turned.range()[0];
                assert!((turned.local(low).slope.atan() + FRAC_PI_2 - UPRIGHT).abs() < 1e-6, "{sign} {angle}");
                for y in [-0.03, -0.01, 0.0, 0.02, 0.034] {
                    let local = rail.local(y);
                    let found = turned.local(c * y + s * local.z);
                    assert!((found.z - (c * local.z - s * y)).abs() < 1e-12, "{sign} {angle} {y}");
                }
            }
        }
        assert!(rail.turned(3.2).unwrap_err().message().contains("faces upwards"));
    }

    #[test]
    fn mirrored_and_moved_profiles() {
        let profile = s1002().unwrap();
        let other = profile.mirrored().moved(0.1, 0.2);
        for y in profile.nodes(1e-3) {
            let (a, b) = (profile.local(y + 1e-9), other.local(0.1 - y - 1e-9));
            // Section C has coefficients of some metres, which cancel: rounding of 1e-14 m.
            assert!((a.z + 0.2 - b.z).abs() < 1e-13, "{y}: {} {}", a.z + 0.2, b.z);
            assert!((a.slope + b.slope).abs() < 1e-9 * (1.0 + a.slope.abs()), "{y}: {} {}", a.slope, b.slope);
        }
    }

    #[test]
    fn kinks_are_kept_and_the_line_goes_on_straight_beyond_its_ends() {
        let roof = RunningProfile::new(
            "roof",
            vec![-1.0, 0.0, 1.0],
            vec![ProfilePiece::line([-1.0, 0.5], [0.0, 0.0]), ProfilePiece::line([0.0, 0.0], [1.0, 0.5])],
        )
        .unwrap();
        let kinks = roof.kinks();
        assert_eq!(kinks.len(), 1);
        assert!(kinks[0].0 == 0.0 && (kinks[0].1 - 2.0 * 0.5_f64.atan()).abs() < 1e-15);
        assert_eq!(roof.local(3.0).z, 1.5);
        assert!(!roof.contains(3.0));
        assert!(s1002().unwrap().kinks().is_empty());
        assert!(rail_60e1().unwrap().kinks().is_empty());
    }
}
