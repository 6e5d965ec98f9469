//! Pads and ballast of a rail without ends on the motions of its section, each by its stiffness.

use super::super::track::{RailTrack, SleeperLayer, TrackLayer};
use super::{CrossSection, Forms, Infinite};
use crate::Result;
use faer::{Mat, MatRef};

/// Directions of a layer: vertical, longitudinal, lateral.
const DIRECTIONS: usize = 3;
/// A layer without springs and dashpots.
const NONE: TrackLayer = TrackLayer { stiffness: [0.0; DIRECTIONS], viscosity: [0.0; DIRECTIONS] };

/// Derivative of a rail on its track by a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackSlope {
    /// Derivative of the pad, N/m² and N·s/m².
    pub pad: TrackLayer,
    /// Derivative of the ballast; that of a track without sleepers is not looked at.
    pub ballast: TrackLayer,
    /// Derivative of the loss factor of the rail.
    pub loss: f64,
}

impl Default for TrackSlope {
    fn default() -> Self {
        Self { pad: NONE, ballast: NONE, loss: 0.0 }
    }
}

/// Springs of 1 N/m² of each layer and direction on the motions of the section, `[layers][directions]` of `[q, q]`;
/// pads first, then ballast where there are sleepers.
#[derive(Debug, Clone, Default)]
pub(super) struct UnitLayers(Vec<[Mat<f64>; DIRECTIONS]>);

impl UnitLayers {
    /// The layers of `track` under `section`, turned by `angle`, rad, against the upright one, on the motions `basis`,
    /// `[order, q]`.
    pub fn new(
        section: &CrossSection,
        forms: &Forms,
        (track, angle): (&RailTrack, f64),
        basis: MatRef<'_, f64>,
    ) -> Result<Self> {
        let unit = |layer: usize, direction: usize| -> Result<Mat<f64>> {
            let stiff = |k: usize| {
                let stiffness = std::array::from_fn(|d| if (k, d) == (layer, direction) { 1.0 } else { 0.0 });
                TrackLayer { stiffness, ..NONE }
            };
            let sleeper = track.sleeper.map(|s| SleeperLayer { mass: s.mass, ballast: stiff(1) });
            let added = RailTrack { pad: stiff(0), sleeper }.added(&mut section.clone(), angle)?;
            let mut image = Mat::<f64>::zeros(basis.nrows(), basis.ncols());
            for (a, b, springs) in &added.blocks {
                let (Some(a), Some(b)) = (forms.amplitude(*a), forms.amplitude(*b)) else { continue };
                for k in 0..basis.ncols() {
                    for c in 0..3 {
                        image[(a + c, k)] += (0..3).map(|d| springs.stiffness[c][d] * basis[(b + d, k)]).sum::<f64>();
                    }
                }
            }
            Ok(basis.transpose() * image)
        };
        let layers = 1 + usize::from(track.sleeper.is_some());
        let all = (0..layers).map(|layer| Ok([unit(layer, 0)?, unit(layer, 1)?, unit(layer, 2)?]));
        Ok(Self(all.collect::<Result<_>>()?))
    }

    /// Σ of the layers times a factor of each direction, `[q, q]`.
    pub fn sum(&self, q: usize, layers: &[[f64; DIRECTIONS]]) -> Mat<f64> {
        let mut total = Mat::zeros(q, q);
        for (units, factors) in self.0.iter().zip(layers) {
            for (unit, factor) in units.iter().zip(factors).filter(|(_, f)| **f != 0.0) {
                total += faer::Scale(*factor) * unit;
            }
        }
        total
    }
}

impl Infinite {
    /// The same rail with the loss factor `loss` on another track of as many layers, with sleepers of the same mass; on
    /// the motions of the section that were made for the track before, which are good for one that is not very
    /// different.
    pub(crate) fn on_track(&self, track: &RailTrack, loss: f64) -> Self {
        let layers = [track.pad, track.sleeper.map_or(NONE, |s| s.ballast)];
        let q = self.loads.nrows();
        Self {
            springs: self.units.sum(q, &layers.map(|l| l.stiffness)),
            dashpots: self.units.sum(q, &layers.map(|l| l.viscosity)),
            loss,
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::ElasticMaterial;
    use crate::rails::R60E1;
    use crate::swept::infinite::{ForcePlace, InfiniteRailSpec};
    use crate::swept::track_decay::{decay_rate, log_slope, POSITIONS};
    use crate::swept::{BuiltRail, LoadPatch};
    use num_complex::Complex64;
    use std::f64::consts::PI;

    const MASS: f64 = 60.2;

    fn track(pad: [f64; 2], loss: f64, ballast: [f64; 2]) -> RailTrack {
        let layer = |[v, l]: [f64; 2], loss, mass| TrackLayer::with_loss([v, l, l], loss, mass);
        RailTrack {
            pad: layer(pad, loss, MASS),
            sleeper: Some(SleeperLayer { mass: 250.0, ballast: layer(ballast, 1.0, 250.0) }),
        }
    }

    fn rail(track: RailTrack, loss: f64) -> Infinite {
        let section = BuiltRail::new(&R60E1, 0.0).unwrap();
        let making = InfiniteRailSpec {
            section: section.for_modes().unwrap(),
            material: ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 },
            track: Some(track),
            angle: 0.1,
            loss,
            places: vec![ForcePlace::at_contact_point(LoadPatch::Circle { radius: 5e-3 }, -0.1)],
        };
        Infinite::new(&making, 2.0 * PI * 1500.0).unwrap()
    }

    fn off(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        (a - b).norm_l2() / b.norm_l2()
    }

    /// The layers times their stiffness are the springs, and a track laid later is that of the beginning.
    #[test]
    fn layers_make_up_the_track() {
        let (one, other) = (track([2e8, 7e7], 0.2, [1e8, 8e7]), track([2.2e8, 6.5e7], 0.22, [1.1e8, 7.5e7]));
        let made = rail(one, 0.02);
        let again = made.on_track(&one, 0.02);
        assert!(off(&again.springs, &made.springs) < 1e-10, "{:.1e}", off(&again.springs, &made.springs));
        assert!(off(&again.dashpots, &made.dashpots) < 1e-10);
        // On the motions of the section on softer pads, and its waves there.
        let (moved, wanted) = (made.on_track(&other, 0.03), rail(other, 0.03));
        for f in [200.0, 700.0, 1400.0] {
            let omega = 2.0 * PI * f;
            let at = [0.04, 0.6, 2.4];
            let (found, exact) =
                (moved.along(omega, &[2, 1], &at).unwrap(), wanted.along(omega, &[2, 1], &at).unwrap());
            for (a, b) in found.iter().flatten().zip(exact.iter().flatten()) {
                assert!((a / b - 1.0).norm() < 2e-3, "{f} Hz: {a:e} for {b:e}");
            }
        }
    }

    /// Derivatives by pads, ballast and the loss factor of the rail beside differences.
    #[test]
    fn slopes_are_those_of_differences() {
        let base = track([2e8, 7e7], 0.2, [1e8, 8e7]);
        let made = rail(base, 0.02);
        let only = |stiffness, viscosity| TrackLayer { stiffness, viscosity };
        let slopes = [
            TrackSlope { pad: only([2e8, 0.0, 0.0], [1e4, 0.0, 0.0]), ..TrackSlope::default() },
            TrackSlope { pad: only([0.0, 7e7, 7e7], [0.0, 2e3, 2e3]), ..TrackSlope::default() },
            TrackSlope { ballast: only([0.0; 3], [1e5, 1e5, 3e4]), ..TrackSlope::default() },
            TrackSlope { loss: 0.02, ..TrackSlope::default() },
        ];
        let changed = |slope: &TrackSlope, h: f64| {
            let plus = |a: TrackLayer, b: TrackLayer| TrackLayer {
                stiffness: std::array::from_fn(|d| a.stiffness[d] + h * b.stiffness[d]),
                viscosity: std::array::from_fn(|d| a.viscosity[d] + h * b.viscosity[d]),
            };
            let sleeper = base.sleeper.map(|s| SleeperLayer { ballast: plus(s.ballast, slope.ballast), ..s });
            made.on_track(&RailTrack { pad: plus(base.pad, slope.pad), sleeper }, made.loss + h * slope.loss)
        };
        let positions: Vec<f64> = POSITIONS.iter().map(|bay| (0.6 * bay).max(0.04)).collect();
        // Laterally at 500 Hz the effect of the ballast is so small that what the waves lack is 2 % of it.
        for (f, forces) in [(150.0, &[2, 1][..]), (500.0, &[2])] {
            let omega = 2.0 * PI * f;
            let along = made.along_slopes(omega, forces, &positions, &slopes).unwrap();
            for (direction, force) in forces.iter().copied().enumerate() {
                for (p, slope) in slopes.iter().enumerate() {
                    let h = 1e-4;
                    let [less, more] =
                        [-h, h].map(|h| changed(slope, h).along(omega, &[force], &positions).unwrap().remove(0));
                    let found = &along[direction].slopes[p];
                    // The waves at either side are on motions of their own, which differ by the square of their error.
                    let wanted: Vec<Complex64> = less.iter().zip(&more).map(|(a, b)| (b - a) / (2.0 * h)).collect();
                    let size = wanted.iter().map(|v| v.norm()).fold(0.0, f64::max);
                    for (n, (a, b)) in found.iter().zip(&wanted).enumerate() {
                        let off = (a - b).norm() / size;
                        assert!(off < 1e-3, "{f} Hz, force {force}, slope {p}, position {n}: {a:e} for {b:e}");
                    }
                    let squares = |u: &[Complex64]| u.iter().map(|v| v.norm_sqr()).collect::<Vec<_>>();
                    let rate = |u: &[Complex64]| decay_rate(&squares(u), &positions).ln();
                    let moved: Vec<f64> =
                        along[direction].response.iter().zip(found).map(|(u, d)| 2.0 * (u.conj() * d).re).collect();
                    let slope = log_slope(&squares(&along[direction].response), &moved, &positions);
                    let difference = (rate(&more) - rate(&less)) / (2.0 * h);
                    assert!(
                        (slope - difference).abs() < 1e-3 * difference.abs().max(0.1),
                        "{f} Hz: {slope} {difference}"
                    );
                }
            }
        }
    }
}
