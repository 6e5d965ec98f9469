//! The rail without ends.

use super::straight::RAIL_STEEL;
use super::*;
use crate::swept::infinite::{ForcePlace, Infinite, InfiniteRailSpec, FORCES};
use crate::swept::track_decay::{decay_rate, POSITIONS};
use num_complex::Complex64;

/// Displacement at the contact along `c` under a unit force there, m/N, over the wavenumbers of `spans`, 1/m, each
/// from where the one before ends with steps of its own; without what is left at the last of them, which only yields
/// beside the contact.
fn receptance(rail: &Infinite, c: usize, omega: f64, spans: &[(f64, usize)]) -> Complex64 {
    let of = |xi: f64| -> Complex64 {
        let u = rail.response(omega, xi);
        (0..u.nrows()).map(|i| rail.loads()[(i, c)] * u[(i, c)]).sum()
    };
    let last = spans.last().unwrap().0;
    let rest = of(rail.last()).re.min(of(last).re);
    let mut sum = Complex64::default();
    let mut from = 0.0;
    for &(to, steps) in spans {
        let step = (to - from) / steps as f64;
        sum += (0..steps).map(|i| (of(from + step * (i as f64 + 0.5)) - rest) * step / PI).sum::<Complex64>();
        from = to;
    }
    sum
}

fn making(track: RailTrack, loss: f64) -> InfiniteRailSpec {
    let section = BuiltRail::new(&R60E1, 0.015).unwrap();
    InfiniteRailSpec {
        section: section.for_modes().unwrap(),
        material: RAIL_STEEL,
        track: Some(track),
        angle: section.contact().angle,
        loss,
        places: vec![ForcePlace::at_contact_point(LoadPatch::Circle { radius: 4e-3 }, 0.0)],
    }
}

/// Without damping the motions are those of the whole section at any wavenumber, also between those that are taken.
#[test]
fn a_few_motions_of_the_section_are_enough() {
    let pad = TrackLayer { stiffness: [5e8, 7e7, 7e7], viscosity: [0.0; 3] };
    let ballast = TrackLayer { stiffness: [1.7e8, 1.2e8, 1.2e8], viscosity: [0.0; 3] };
    let making = making(RailTrack { pad, sleeper: Some(SleeperLayer { mass: 250.0, ballast }) }, 0.0);
    let rail = Infinite::new(&making, 2.0 * PI * 6000.0).unwrap();
    let q = rail.loads().nrows();
    assert!(q < 260, "{q} motions");
    let forms =
        Forms::along(making.section.clone(), making.material, 2.0 * PI, making.track.as_ref(), making.angle).unwrap();
    let line = LineLoad::new(&forms, making.places[0].patch, 0, 1.0);
    let forces = line.columns(forms.order());
    for n in [2usize, 8, 20, 33, 55, 95] {
        for f in [120.0, 900.0, 2500.0, 6000.0] {
            let omega = 2.0 * PI * f;
            let direct = forms.factor(n, omega * omega).unwrap().solve(forces.as_ref().subcols(0, FORCES));
            let few = rail.response(omega, n as f64);
            let seen = rail.loads().transpose() * Mat::from_fn(q, FORCES, |i, c| few[(i, c)].re);
            for c in 0..FORCES {
                // For each metre, in place of the whole period.
                let wanted = forms.path.length_integral(n) * line.means(direct.col(c))[c];
                let off = (seen[(c, c)] / wanted - 1.0).abs();
                assert!(off < 2e-3, "{n} 1/m, {f} Hz, {c}: {} for {wanted}, {off:.1e}", seen[(c, c)]);
            }
            assert!(few.col_iter().all(|c| c.iter().all(|v| v.im == 0.0)));
        }
        // The waves are those of the section.
        let modes = of_order(&forms, n, 2.0 * PI * 6000.0).unwrap();
        for omega in modes.omega.iter().filter(|w| **w > 2000.0) {
            let travelling = rail.travelling(*omega * (1.0 + 1e-9));
            let near = travelling.iter().map(|x| (x - n as f64).abs()).fold(f64::INFINITY, f64::min);
            assert!(near < 0.05, "{n} 1/m: {:.1} Hz, {travelling:?}", omega / (2.0 * PI));
        }
    }
}

/// The point receptance, an integral over all wavenumbers, beside that of an infinite Timoshenko beam on the same
/// track, vertically; within what a solid section is stiffer or softer than a beam.
#[test]
fn its_receptance_is_that_of_an_infinite_beam() {
    let pad = TrackLayer::with_loss([5e8, 7e7, 7e7], 0.25, 60.2);
    let ballast = TrackLayer::with_loss([1.7e8, 1.2e8, 1.2e8], 1.0, 250.0);
    let track = RailTrack { pad, sleeper: Some(SleeperLayer { mass: 250.0, ballast }) };
    let section = BuiltRail::new(&R60E1, 0.0).unwrap();
    let making = InfiniteRailSpec { section: section.for_modes().unwrap(), angle: 0.0, ..making(track, 0.02) };
    let rail = Infinite::new(&making, 2.0 * PI * 2000.0).unwrap();
    let beam = beam_60e1(making.material, false, 0.02);
    for f in [100.0, 250.0, 500.0, 900.0] {
        let omega = 2.0 * PI * f;
        let sum = receptance(&rail, 2, omega, &[(30.0, 3000)]);
        let wanted = beam.infinite(omega, track.stiffness(omega, 0));
        let off = (sum / wanted - 1.0).norm();
        assert!(off < 0.06, "{f} Hz: {sum:e} for {wanted:e}, {off:.3}");
    }
}

/// The sum over the waves is the integral over the wavenumbers, in both directions, from beside the force on.
#[test]
fn waves_sum_up_to_the_integral() {
    let pad = TrackLayer::with_loss([5e8, 7e7, 7e7], 0.25, 60.2);
    let ballast = TrackLayer::with_loss([1.7e8, 1.2e8, 1.2e8], 1.0, 250.0);
    let track = RailTrack { pad, sleeper: Some(SleeperLayer { mass: 250.0, ballast }) };
    let section = BuiltRail::new(&R60E1, 0.0).unwrap();
    let making = InfiniteRailSpec { section: section.for_modes().unwrap(), angle: 0.0, ..making(track, 0.02) };
    let rail = Infinite::new(&making, 2.0 * PI * 1200.0).unwrap();
    let at = [0.04, 0.15, 0.6, 2.4];
    for f in [400.0, 1100.0] {
        let omega = 2.0 * PI * f;
        let found = rail.along(omega, &[2, 1], &at).unwrap();
        let mut sums = [[Complex64::default(); 4]; 2];
        // Finely where waves travel; beyond 280 1/m smoothly to nothing.
        for (from, to, steps) in [(0.0, 40.0, 800), (40.0, 400.0, 720)] {
            let step = (to - from) / f64::from(steps);
            for k in 0..steps {
                let xi = from + step * (f64::from(k) + 0.5);
                let u = rail.response(omega, xi);
                let fade = if xi > 280.0 { (0.5 * PI * (xi - 280.0) / 120.0).cos().powi(2) } else { 1.0 };
                for (d, c) in [2, 1].into_iter().enumerate() {
                    let h: Complex64 = (0..u.nrows()).map(|i| rail.loads()[(i, c)] * u[(i, c)]).sum();
                    for (n, x) in at.iter().enumerate() {
                        sums[d][n] += fade * h * (xi * x).cos() * (step / PI);
                    }
                }
            }
        }
        for d in 0..2 {
            for n in 0..at.len() {
                let off = (found[d][n] / sums[d][n] - 1.0).norm();
                assert!(off < 0.02, "{f} Hz, direction {d}, {} m: {:e} for {:e}", at[n], found[d][n], sums[d][n]);
            }
        }
    }
    let undamped = RailTrack { pad: TrackLayer { stiffness: [5e8, 7e7, 7e7], viscosity: [0.0; 3] }, sleeper: None };
    let rail = Infinite::new(&InfiniteRailSpec { loss: 0.0, track: Some(undamped), ..making }, 2.0 * PI * 500.0);
    assert_eq!(rail.unwrap().along(2.0 * PI * 300.0, &[2], &at).unwrap_err().exit_code(), 2);
}

/// Vertical decay rates beside those of Timoshenko's beam on the same track in closed form, at the positions of the
/// standard.
#[test]
fn its_decay_rate_is_that_of_an_infinite_beam() {
    let pad = TrackLayer::with_loss([2e8, 7e7, 7e7], 0.2, 60.2);
    let track = RailTrack { pad, sleeper: None };
    let section = BuiltRail::new(&R60E1, 0.0).unwrap();
    let making = InfiniteRailSpec { section: section.for_modes().unwrap(), angle: 0.0, ..making(track, 0.02) };
    let rail = Infinite::new(&making, 2.0 * PI * 1600.0).unwrap();
    let beam = beam_60e1(making.material, false, 0.02);
    let at: Vec<f64> = POSITIONS.iter().map(|bay| (0.6 * bay).max(0.04)).collect();
    for f in [250.0, 400.0, 630.0, 1000.0, 1250.0] {
        let omega = 2.0 * PI * f;
        let rate = |moved: Vec<Complex64>| decay_rate(&moved.iter().map(|h| h.norm_sqr()).collect::<Vec<_>>(), &at);
        let found = rate(rail.along(omega, &[2], &at).unwrap().remove(0));
        let wanted = rate(at.iter().map(|x| beam.along(omega, track.stiffness(omega, 0), *x)).collect());
        println!("{f} Hz: {found:.3} and {wanted:.3} dB/m");
        assert!((found / wanted - 1.0).abs() < 0.1, "{f} Hz: {found} and {wanted} dB/m");
    }
}

/// Along itself a rail with dashpots at its ends is one without ends, from where its waves no longer are as long as
/// the rail; without dashpots it is not. What the contact yields by itself is not in the sum over the wavenumbers: a
/// real constant.
#[test]
fn dashpots_end_a_rail_along_itself() {
    let track = straight::pads();
    let section = BuiltRail::new(&R60E1, 0.0).unwrap();
    let making = InfiniteRailSpec { section: section.for_modes().unwrap(), angle: 0.0, ..making(track, 0.02) };
    let rail = Infinite::new(&making, 2.0 * PI * 1500.0).unwrap();
    let (period, patch) = (14.0, LoadPatch::Circle { radius: 5e-3 });
    // Dashpots at a section move by short waves as well: with modes up to 2500 Hz 14 % are missing at 800 Hz.
    let few = straight::PaddedRail::new(period, 6000.0, patch);
    let a = straight::at_contact(0.0, &[patch.half()[1]], 2.0, period, None)[0];
    let ends = |along: f64| AbsorbingEnds { period, length: 5.0, damping: 6000.0, along };
    let speed = beam_60e1(RAIL_STEEL, false, 0.0).speed();
    let frequencies = [300.0, 344.0, 500.0, 800.0, 1000.0, 1400.0];
    let wanted = frequencies.map(|f| receptance(&rail, 0, 2.0 * PI * f, &[(1.5, 1500), (30.0, 2000)]));
    let off = [0.9 * speed, 0.0].map(|along| {
        let damping = few.damped(Some(ends(along)));
        let found = frequencies.map(|f| straight::receptance(&few.waves, &few.list, &damping, &a, f)[0][0]);
        let apart: [Complex64; 6] = std::array::from_fn(|k| found[k] - wanted[k]);
        let own = apart[2..].iter().map(|d| d.re).sum::<f64>() / 4.0;
        let parts: [f64; 6] = std::array::from_fn(|k| (apart[k] - own).norm() / wanted[k].norm());
        parts
    });
    println!("{off:.3?}");
    assert!(off[0].iter().all(|part| *part < 0.08), "{off:?}");
    assert!(off[1][0] > 0.5 && off[1][1] > 0.5, "{off:?}");
}

/// Decay rates of third octaves beside those of rolland's beam, which shears, twists and warps
/// (docs/data/track_decay_rolland.py).
#[test]
fn its_decay_rates_are_those_of_rolland() {
    let pad = TrackLayer::with_loss([2e8, 4e8 / 6.0, 4e8 / 6.0], 0.2, 60.2);
    let section = BuiltRail::new(&R60E1, 0.0).unwrap();
    let making = InfiniteRailSpec {
        section: section.for_modes().unwrap(),
        angle: 0.0,
        places: vec![ForcePlace::at_contact_point(LoadPatch::Circle { radius: 5e-3 }, 0.0)],
        ..making(RailTrack { pad, sleeper: None }, 0.0)
    };
    let rail = Infinite::new(&making, 2.0 * PI * 2400.0).unwrap();
    let positions = POSITIONS.map(|bay| 0.6 * bay);
    let at = positions.map(|x| x.max(0.04));
    for line in include_str!("../../../docs/data/track_decay_rolland.csv").lines().skip(2) {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let centre = 1000.0 * 10f64.powf((10.0 * (cells[0] / 1000.0).log10()).round() / 10.0);
        let (low, high) = (centre / 10f64.powf(0.05), centre * 10f64.powf(0.05));
        let mut squares = [[0.0; 29]; 2];
        for k in 0..6 {
            let omega = 2.0 * PI * (low + (high - low) * (f64::from(k) + 0.5) / 6.0);
            for (sum, moved) in squares.iter_mut().zip(rail.along(omega, &[2, 1], &at).unwrap()) {
                sum.iter_mut().zip(moved).for_each(|(s, h)| *s += omega * omega * h.norm_sqr());
            }
        }
        let [vertical, lateral] = squares.map(|s| decay_rate(&s, &positions));
        let [vertical, lateral] = [vertical / cells[1] - 1.0, lateral / cells[2] - 1.0];
        println!("{} Hz: vertical {vertical:+.3}, lateral {lateral:+.3}", cells[0]);
        // Laterally the web bends from 1.2 kHz on, which a beam does not.
        let (most, aside) = match cells[0] {
            f if f <= 1000.0 => (0.02, 0.1),
            f if f <= 1600.0 => (0.05, f64::INFINITY),
            _ => (0.12, f64::INFINITY),
        };
        assert!(vertical.abs() < most && lateral.abs() < aside, "{line}: {vertical:+.3}, {lateral:+.3}");
    }
}
