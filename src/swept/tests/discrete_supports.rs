//! Pads and sleepers that stand apart, against beams on supports.

use super::straight::{pads, receptance, RAIL_STEEL};
use super::*;
use crate::swept::waves::{self, RailMode};
use faer::linalg::solvers::Solve;
use num_complex::Complex;

type C64 = Complex<f64>;

/// 48 bays: with fewer the ends are felt in the resonance of the bays.
const BAYS: usize = 48;
const SPACING: f64 = 0.6;
const PERIOD: f64 = 28.8;
const PATCH: LoadPatch = LoadPatch::Circle { radius: 5e-3 };

/// Displacement at the distance x, m/N, of the infinite beam without anything below it (as [`Beam::infinite`]).
fn free(beam: &Beam, omega: f64, x: f64) -> C64 {
    let loss = Complex::new(1.0, beam.loss);
    let bend = beam.young * beam.inertia * loss;
    let shear = beam.shear * beam.area * beam.sheared * loss;
    let turning = beam.density * beam.inertia * omega * omega;
    let (carried, turned) = (Complex::from(-beam.density * beam.area * omega * omega), shear - turning);
    let (a, b, c) = (bend * shear, bend * carried - shear * turning, carried * turned);
    let root = (b * b - 4.0 * a * c).sqrt();
    let of = |square: C64| {
        let k = square.sqrt();
        let k = if k.im > 0.0 { k } else { -k };
        C64::I * (bend * square + turned) / (4.0 * a * k * square + 2.0 * b * k) * (C64::I * k * x.abs()).exp()
    };
    of((-b + root) / (2.0 * a)) + of((-b - root) / (2.0 * a))
}

/// Point receptance of the infinite beam on supports of the stiffness `support`, N/m, each on five points of the
/// length of a pad, the contact at `position` from the middle of one.
fn on_supports(beam: &Beam, omega: f64, support: C64, (spacing, length, position): (f64, f64, f64)) -> C64 {
    const SUPPORTS: i32 = 30;
    const POINTS: usize = 5;
    let points: Vec<f64> = (-SUPPORTS..=SUPPORTS)
        .flat_map(|j| {
            let middle = f64::from(j) * spacing - position;
            (0..POINTS).map(move |p| middle + length * ((p as f64 + 0.5) / POINTS as f64 - 0.5))
        })
        .collect();
    let n = points.len();
    let apart = Mat::from_fn(n, n, |i, j| {
        let own = if i == j { POINTS as f64 / support } else { C64::default() };
        free(beam, omega, points[i] - points[j]) + own
    });
    let here = Mat::from_fn(n, 1, |i, _| free(beam, omega, points[i]));
    let forces = apart.partial_piv_lu().solve(&here);
    free(beam, omega, 0.0) - (0..n).map(|i| here[(i, 0)] * forces[(i, 0)]).sum::<C64>()
}

/// A rail on an even track: forms, angle of the section, waves, members, damping, and A.
struct Even {
    forms: Forms,
    tilt: f64,
    waves: Vec<RailMode>,
    list: Vec<waves::Member>,
    damping: Mat<f64>,
    a: Square,
}

/// Rail on even pads of the length `period`, m, with its modes up to `limit`, Hz.
fn even(track: &RailTrack, period: f64, limit: f64) -> Even {
    even_at(track, period, limit, 0.0)
}

/// The same touched at y, m.
fn even_at(track: &RailTrack, period: f64, limit: f64, y: f64) -> Even {
    let rail = BuiltRail::new(&R60E1, y).unwrap();
    let (radius, tilt) = (period / (2.0 * PI), rail.contact().angle);
    let forms = Forms::along(rail.for_modes().unwrap(), RAIL_STEEL, period, Some(track), tilt).unwrap();
    let of = |n| {
        let modes = of_order(&forms, n, 2.0 * PI * limit)?;
        Ok(RailMode::new(&forms, modes, &[LineLoad::new(&forms, PATCH, n, radius)]))
    };
    let size = |w: &RailMode| w.omega.len().saturating_sub(track.motions());
    let waves: Vec<RailMode> = by_orders(1, size, |o| o.into_iter().map(of).collect()).unwrap();
    let mut list = Vec::new();
    for (i, w) in waves.iter().enumerate() {
        list.extend((0..w.omega.len()).flat_map(|k| (0..ContactModeData::families(w.order)).map(move |f| (i, k, f))));
    }
    let ends = Some(AbsorbingEnds { period, length: 5.0, damping: 6000.0, along: 0.0 });
    let damping = waves::damping(&forms, &waves, &list, &waves::RailDamping { loss: 0.02, ends });
    let focus = Focus { size: 2.5e-3, reach: 7.5e-3, corner: 0.015, largest: 0.015 };
    let loaded = Forms::along(rail.section(focus).unwrap(), RAIL_STEEL, period, Some(track), tilt).unwrap();
    let constant = Constant::new(&loaded, &[PATCH], radius).unwrap();
    let a = own(&constant)[0];
    Even { forms, tilt, waves, list, damping, a }
}

impl Even {
    fn laid(&self, bays: &DiscreteSupports) -> SupportedRailModes {
        let list: Vec<_> = self.list.iter().map(|&member| (0, member)).collect();
        bays.lay(&[self.on_pads(0.0)], &list, &self.damping).unwrap()
    }

    fn on_pads(&self, ahead: f64) -> RailOnPads<'_> {
        RailOnPads { forms: &self.forms, tilt: self.tilt, waves: &self.waves, ahead }
    }

    /// This rail and another one on `bays`, both contacts this far ahead.
    fn laid_with(&self, other: &Even, bays: &DiscreteSupports, ahead: f64) -> SupportedRailModes {
        let m = self.list.len();
        let own = self.list.iter().map(|&member| (0, member));
        let list: Vec<_> = own.chain(other.list.iter().map(|&member| (1, member))).collect();
        let damping = Mat::from_fn(list.len(), list.len(), |i, j| match (i < m, j < m) {
            (true, true) => self.damping[(i, j)],
            (false, false) => other.damping[(i - m, j - m)],
            _ => 0.0,
        });
        bays.lay(&[self.on_pads(ahead), other.on_pads(ahead)], &list, &damping).unwrap()
    }

    fn seen(&self, &(i, k, family): &waves::Member, d: usize) -> f64 {
        match self.waves[i].order == 0 || FAMILY[d] == family {
            true => self.waves[i].contact[(d, k)],
            false => 0.0,
        }
    }

    /// Vertical receptance at the contact on `bays`, m/N, at frequencies, Hz.
    fn on(&self, bays: &DiscreteSupports, frequencies: &[f64]) -> Vec<C64> {
        let laid = self.laid(bays);
        let seen = laid.shares.transpose() * Mat::from_fn(self.list.len(), 1, |i, _| self.seen(&self.list[i], 2));
        let n = laid.omega.len();
        // What the rail yields by itself without its modes stays.
        let modal = self.list.iter().map(|m| (self.seen(m, 2) / self.waves[m.0].omega[m.1]).powi(2)).sum::<f64>();
        let at = |f: &f64| {
            let w = 2.0 * PI * f;
            let dynamic = Mat::from_fn(n, n, |i, j| {
                let own = if i == j { laid.omega[i].powi(2) - w * w } else { 0.0 };
                Complex::new(own, w * laid.damping[(i, j)])
            });
            let moved = dynamic.partial_piv_lu().solve(Mat::from_fn(n, 1, |i, _| Complex::from(seen[(i, 0)])));
            (0..n).map(|i| moved[(i, 0)] * seen[(i, 0)]).sum::<C64>() + self.a[2][2] - modal
        };
        frequencies.iter().map(at).collect()
    }
}

/// Sleepers of 300 kg on 120 MN/m, spread evenly.
fn sleepers() -> SleeperLayer {
    SleeperLayer { mass: 500.0, ballast: TrackLayer::with_loss([200e6, 66.7e6, 66.7e6], 0.2, 500.0) }
}

fn bays(position: f64, length: f64, sleeper: Option<SleeperLayer>) -> DiscreteSupports {
    DiscreteSupports { count: BAYS, spacing: SPACING, length, position, pad: pads().pad, sleeper, shared: None }
}

/// The infinite beam on one pad each 0.6 m, over a sleeper and between two: within 1.1 % and 2.2° below the resonance
/// of half a wave a bay, 4.4 % above it. At 1075 Hz the beam's peak between sleepers is 6.6 times as high as what is
/// left over one, that of the rail with its ends 5.3 times.
#[test]
fn a_rail_on_pads_that_stand_apart_is_pinned() {
    let even = even(&pads(), PERIOD, 3500.0);
    let beam = beam_60e1(RAIL_STEEL, false, 0.02);
    let frequencies = [150.0, 500.0, 800.0, 1200.0, 1075.0];
    let wanted = |f: f64, position: f64, track: &RailTrack| {
        let w = 2.0 * PI * f;
        on_supports(&beam, w, SPACING * track.stiffness(w, 0), (SPACING, 0.15, position))
    };
    let mut pinned = [0.0; 2];
    for (position, pinned) in [0.0, 0.3].into_iter().zip(&mut pinned) {
        let found = even.on(&bays(position, 0.15, None), &frequencies);
        for (&f, found) in frequencies.iter().zip(found) {
            let ratio = found / wanted(f, position, &pads());
            if f != 1075.0 {
                let good = if f < 1000.0 { 0.02 } else { 0.06 };
                let close = (ratio.norm() - 1.0).abs() < good && ratio.arg().abs().to_degrees() < 4.0;
                assert!(close, "{position} m, {f} Hz: {ratio}");
            }
            *pinned = found.norm();
        }
    }
    assert!(pinned[1] > 4.0 * pinned[0], "{pinned:?}");
    // Sleepers that stand apart: their own resonances are below.
    let track = RailTrack { sleeper: Some(sleepers()), ..pads() };
    let low = [100.0, 150.0, 200.0];
    for position in [0.0, 0.3] {
        for (&f, found) in low.iter().zip(even.on(&bays(position, 0.15, Some(sleepers())), &low)) {
            let ratio = found / wanted(f, position, &track);
            let close = (ratio.norm() - 1.0).abs() < 0.02 && ratio.arg().abs().to_degrees() < 3.0;
            assert!(close, "sleepers, {position} m, {f} Hz: {ratio}");
        }
    }
}

/// Pads as long as their bay are even; where the contact stands is then all the same, and half a bay to either side
/// is the same place.
#[test]
fn pads_that_meet_are_even() {
    let even = even(&pads(), PERIOD, 1200.0);
    let lay = |bays: &DiscreteSupports| even.laid(bays).omega;
    let mut before: Vec<f64> = even.list.iter().map(|m| even.waves[m.0].omega[m.1]).collect();
    before.sort_by(f64::total_cmp);
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    assert!(apart(&lay(&bays(0.17, SPACING, None)), &before) < 1e-9);
    let pinned = lay(&bays(0.0, 0.15, None));
    assert!(apart(&pinned, &before) > 1e-3, "{}", apart(&pinned, &before));
    // The rail as a whole does not know where the contact is.
    assert!(apart(&lay(&bays(0.2, 0.15, None)), &pinned) < 1e-9);
}

/// Two rails on common sleepers move alike or against each other. Alike they have half a sleeper each. Against each
/// other the sleeper turns, with L²/(3D²) of its mass and of its ballast, and its middle stands still across the track:
/// both halves are tied to the ground there. A force on one rail is half the sum of both, what the other one does is
/// half the difference.
#[test]
fn rails_on_common_sleepers_move_alike_or_against_each_other() {
    let even = even(&pads(), 7.2, 900.0);
    let (length, distance) = (2.6, 1.1);
    let part: f64 = length * length / (3.0 * distance * distance);
    let own = sleepers();
    let SleeperLayer { mass, ballast: TrackLayer { stiffness, viscosity } } = own;
    let held = 1e6 * stiffness[2];
    let of = |of: [f64; 3], across: f64| [part * of[0], part * of[1], across];
    let against = SleeperLayer {
        mass: part * mass,
        ballast: TrackLayer { stiffness: of(stiffness, held), viscosity: of(viscosity, viscosity[2]) },
    };
    let on = |sleeper, shared| DiscreteSupports { count: 12, sleeper: Some(sleeper), shared, ..bays(0.1, 0.15, None) };
    let [alike, against] = [own, against].map(|sleeper| even.laid(&on(sleeper, None)));
    let m = even.list.len();
    let bar = SleeperBar { length, rail_distance: distance };
    // Contacts ahead of the place that the supports are given from are elsewhere on them.
    let both = even.laid_with(&even, &DiscreteSupports { position: -0.1, ..on(own, Some(bar)) }, 0.2);
    let receptance = |laid: &SupportedRailModes, (to, from): (usize, usize), d: usize, f: f64| {
        let seen = |rail: usize, k: usize| -> f64 {
            let share = |i: usize| laid.shares[(rail * m + i, k)] * even.seen(&even.list[i], d);
            (0..m).map(share).sum()
        };
        let (w, n) = (2.0 * PI * f, laid.omega.len());
        let dynamic = Mat::from_fn(n, n, |i, j| {
            let own = if i == j { laid.omega[i].powi(2) - w * w } else { 0.0 };
            Complex::new(own, w * laid.damping[(i, j)])
        });
        let moved = dynamic.partial_piv_lu().solve(Mat::from_fn(n, 1, |k, _| Complex::from(seen(from, k))));
        (0..n).map(|k| moved[(k, 0)] * seen(to, k)).sum::<C64>()
    };
    for (d, f) in [(0, 90.0), (0, 300.0), (1, 60.0), (1, 140.0), (1, 500.0), (2, 80.0), (2, 170.0), (2, 400.0)] {
        let [same, other] = [&alike, &against].map(|laid| receptance(laid, (0, 0), d, f));
        let found = [(0, 0), (1, 1), (0, 1), (1, 0)].map(|pair| receptance(&both, pair, d, f));
        for (found, wanted) in found.into_iter().zip([same + other, same + other, same - other, same - other]) {
            let off = (found - 0.5 * wanted).norm() / same.norm();
            assert!(off < 1e-5, "direction {d}, {f} Hz: {found} and {}, {off:.1e} apart", 0.5 * wanted);
        }
    }
}

/// Rails that are touched at different places of their heads, so that a section is turned, move alike as each of them
/// does on half a sleeper.
#[test]
fn turned_sections_lie_on_the_same_sleepers() {
    let [upright, turned] = [0.0, 0.02].map(|y| even_at(&pads(), 7.2, 900.0, y));
    assert!(upright.tilt == 0.0 && turned.tilt.abs() > 0.05, "{}", turned.tilt);
    let on = |shared| DiscreteSupports { count: 12, shared, ..bays(0.1, 0.15, Some(sleepers())) };
    let [own, also] = [&upright, &turned].map(|rail| rail.laid(&on(None)).omega);
    let both = upright.laid_with(&turned, &on(Some(SleeperBar { length: 2.6, rail_distance: 1.1 })), 0.0).omega;
    for (omega, also) in own.iter().zip(&also) {
        let off = both.iter().map(|w| (w / omega - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!((also / omega - 1.0).abs() < 1e-6 && off < 1e-6, "{omega} rad/s: {also}, {off:e}");
    }
}

/// Two layers, spread evenly, against the infinite beam on them: within 2 % and 5°. Sleepers have motions at every
/// order, however short its waves: the list of orders ends all the same.
#[test]
fn the_rail_on_sleepers_responds_as_a_beam() {
    let track = RailTrack { sleeper: Some(sleepers()), ..pads() };
    let even = even(&track, 14.0, 3500.0);
    let beam = beam_60e1(RAIL_STEEL, false, 0.02);
    for f in [100.0, 150.0, 300.0, 700.0, 1500.0] {
        let wanted = beam.infinite(2.0 * PI * f, track.stiffness(2.0 * PI * f, 0));
        let found = receptance(&even.waves, &even.list, &even.damping, &even.a, f)[2][2];
        let ratio = found / wanted;
        assert!((ratio.norm() - 1.0).abs() < 0.03 && ratio.arg().abs().to_degrees() < 5.5, "{f} Hz: {ratio}");
    }
}
