//! The rough surfaces of both bodies on the grid of the contact, as they travel through it.

use super::{RoughnessLine, RoughnessShape};
use std::f64::consts::FRAC_PI_2;

/// Something that one of the surfaces has.
#[derive(Debug, Clone, PartialEq)]
pub enum RoughnessFeature {
    /// The same line across the whole contact, or one for each of its lateral places, `[1]` or `[ny]`.
    Lines(Vec<RoughnessLine>),
    /// A shape with its middle `at` this way, m; of a wheel at every turn, after `period`, m.
    Shape {
        /// The shape.
        shape: RoughnessShape,
        /// m.
        at: f64,
        /// m.
        period: Option<f64>,
    },
}

impl RoughnessFeature {
    /// Height at the way `s` (m) at the lateral place number `iy`, m.
    fn at(&self, s: f64, iy: usize) -> f64 {
        match self {
            RoughnessFeature::Lines(lines) => lines.get(iy).or(lines.first()).map_or(0.0, |line| line.height(s)),
            RoughnessFeature::Shape { shape, at, period } => shape.height(match period {
                Some(period) => (s - at + 0.5 * period).rem_euclid(*period) - 0.5 * period,
                None => s - at,
            }),
        }
    }

    /// Returns whether it differs across the contact.
    fn varies(&self) -> bool {
        matches!(self, RoughnessFeature::Lines(lines) if lines.len() > 1)
    }
}

/// Both surfaces at a contact.
#[derive(Debug, Clone, PartialEq)]
pub struct RoughSurfaces {
    /// Rolling speed V, m/s.
    pub speed: f64,
    /// Way over which all heights grow from nothing, m.
    pub onset: f64,
    /// Roughness of the lower and of the upper body.
    pub parts: [Vec<RoughnessFeature>; 2],
    /// By how much the ways of both surfaces at this contact are ahead of those at the first one, m.
    pub ahead: [f64; 2],
}

impl RoughSurfaces {
    /// Share of the heights that has come in at the time `t`, s.
    fn share(&self, t: f64) -> f64 {
        let way = self.speed * t;
        if way < self.onset {
            (FRAC_PI_2 * way.max(0.0) / self.onset).sin().powi(2)
        } else {
            1.0
        }
    }

    /// Height of the surface of the lower (0) or upper (1) body at the contact's centre at the time `t` (s), m; of an
    /// area on its lateral place number `iy`.
    pub fn height(&self, body: usize, t: f64, iy: usize) -> f64 {
        let way = self.speed * t + self.ahead[body];
        self.share(t) * self.parts[body].iter().map(|p| p.at(way, iy)).sum::<f64>()
    }

    /// The gap at the time `t` (s) into `gap`, m, `[nx ny]`, on the grid `x` (m, `[nx]`); `smooth` is that without
    /// roughness.
    pub fn travel(&self, t: f64, x: &[f64], smooth: &[f64], gap: &mut [f64]) {
        let (share, way) = (self.share(t), self.speed * t);
        gap.copy_from_slice(smooth);
        if share == 0.0 {
            return;
        }
        let all = || self.parts.iter().zip(self.ahead).flat_map(|(parts, ahead)| parts.iter().map(move |p| (p, ahead)));
        for (ix, &place) in x.iter().enumerate() {
            let s = way - place;
            let even: f64 = all().filter(|(p, _)| !p.varies()).map(|(p, ahead)| p.at(s + ahead, 0)).sum();
            for (iy, row) in gap.chunks_exact_mut(x.len()).enumerate() {
                let own: f64 = all().filter(|(p, _)| p.varies()).map(|(p, ahead)| p.at(s + ahead, iy)).sum();
                row[ix] -= share * (even + own);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(slope: f64) -> RoughnessLine {
        RoughnessLine::through(vec![-10.0, 10.0], vec![-10.0 * slope, 10.0 * slope]).unwrap()
    }

    /// Roughness ahead, at −x, comes to x after x/V: a bump of either body closes the gap there.
    #[test]
    fn material_flows_towards_plus_x_and_bumps_close_the_gap() {
        let bump = |at| RoughnessFeature::Shape {
            shape: RoughnessShape::Joint { length: 0.2, depth: -1e-3 },
            at,
            period: None,
        };
        let x = [-0.1, 0.0, 0.1];
        for body in [0, 1] {
            let mut surface = RoughSurfaces { speed: 2.0, onset: 0.0, parts: [vec![], vec![]], ahead: [0.0; 2] };
            surface.parts[body].push(bump(0.3));
            let mut seen = Vec::new();
            for t in [0.1, 0.15, 0.2] {
                let mut gap = vec![9.0; 3];
                surface.travel(t, &x, &[1e-3; 3], &mut gap);
                seen.push(gap.iter().position(|g| g.abs() < 1e-12));
                let want = if t == 0.15 { 1e-3 } else { 0.0 };
                assert!((surface.height(body, t, 0) - want).abs() < 1e-12);
            }
            assert_eq!(seen, [Some(0), Some(1), Some(2)]);
        }
    }

    #[test]
    fn heights_come_in_slowly_repeat_with_the_turns_and_differ_across() {
        let mut surface = RoughSurfaces {
            speed: 1.0,
            onset: 0.5,
            parts: [vec![RoughnessFeature::Lines(vec![ramp(1.0), ramp(3.0)])], vec![]],
            ahead: [0.0; 2],
        };
        assert_eq!(surface.height(0, 0.0, 0), 0.0);
        assert!((surface.height(0, 0.25, 0) - 0.125).abs() < 1e-12);
        assert!((surface.height(0, 2.0, 1) - 6.0).abs() < 1e-12);
        let mut gap = vec![0.0; 4];
        surface.travel(1.0, &[0.0, 0.5], &[10.0; 4], &mut gap);
        assert!(gap.iter().zip([9.0, 9.5, 7.0, 8.5]).all(|(g, want)| (g - want).abs() < 1e-12), "{gap:?}");
        let flat = RoughnessShape::Flat { length: 0.1, depth: 1.0 };
        surface.parts[1].push(RoughnessFeature::Shape { shape: flat, at: 0.2, period: Some(3.0) });
        for turn in [1.0, 2.0, 7.0] {
            let s = 0.2 + 3.0 * turn;
            assert!((surface.height(1, s, 0) + 1.0).abs() < 1e-9 && surface.height(1, s + 0.06, 0) == 0.0);
        }
    }
}
