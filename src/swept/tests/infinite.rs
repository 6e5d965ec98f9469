//! The rail without ends.

use super::*;
use crate::swept::infinite::{Infinite, Making, FORCES};
use num_complex::Complex64;

fn making(track: Track, loss: f64) -> Making {
    let section = Rail60E1::new(0.015).unwrap();
    Making {
        section: section.for_modes().unwrap(),
        material: straight::RAIL_STEEL,
        track: Some(track),
        angle: section.contact().angle,
        tilt: 0.0,
        loss,
        patch: Patch { radius: 4e-3 },
    }
}

/// Without damping the motions are those of the whole section at any wavenumber, also between those that are taken.
#[test]
fn a_few_motions_of_the_section_are_enough() {
    let pad = Layer { stiffness: [5e8, 7e7, 7e7], viscosity: [0.0; 3] };
    let ballast = Layer { stiffness: [1.7e8, 1.2e8, 1.2e8], viscosity: [0.0; 3] };
    let making = making(Track { pad, sleeper: Some(Sleeper { mass: 250.0, ballast }) }, 0.0);
    let rail = Infinite::new(&making, 2.0 * PI * 6000.0).unwrap();
    let q = rail.loads().nrows();
    assert!(q < 260, "{q} motions");
    let forms =
        Forms::along(making.section.clone(), making.material, 2.0 * PI, making.track.as_ref(), making.angle).unwrap();
    let line = LineLoad::new(&forms, making.patch, 0, 1.0);
    let forces = line.columns(forms.order());
    for n in [2usize, 8, 20, 33, 55, 95] {
        for f in [120.0, 900.0, 2500.0, 6000.0] {
            let omega = 2.0 * PI * f;
            let direct = forms.factor(n, omega * omega).unwrap().solve(forces.as_ref().subcols(0, FORCES));
            let few = rail.response(omega, n as f64);
            let seen = rail.loads().transpose() * Mat::from_fn(q, FORCES, |i, c| few[(i, c)].re);
            for c in 0..FORCES {
                // For each metre, in place of the whole period.
                let wanted = forms.path.whole(n) * line.means(direct.col(c))[c];
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

/// The point receptance, an integral over all wavenumbers, beside that of an infinite Timoshenko beam on the same track, vertically; within what a solid
/// section is stiffer or softer than a beam.
#[test]
fn its_receptance_is_that_of_an_infinite_beam() {
    let pad = Layer::with_loss([5e8, 7e7, 7e7], 0.25, 60.2);
    let ballast = Layer::with_loss([1.7e8, 1.2e8, 1.2e8], 1.0, 250.0);
    let track = Track { pad, sleeper: Some(Sleeper { mass: 250.0, ballast }) };
    let section = Rail60E1::new(0.0).unwrap();
    let making = Making { section: section.for_modes().unwrap(), angle: 0.0, ..making(track, 0.02) };
    let rail = Infinite::new(&making, 2.0 * PI * 2000.0).unwrap();
    let beam = Rail60E1::beam(making.material, false, 0.02);
    for f in [100.0, 250.0, 500.0, 900.0] {
        let omega = 2.0 * PI * f;
        let of = |xi: f64| -> Complex64 {
            let u = rail.response(omega, xi);
            (0..u.nrows()).map(|i| rail.loads()[(i, 2)] * u[(i, 2)]).sum()
        };
        // What only yields beside the contact, and a beam does not have, is what is left at the highest wavenumber.
        let (steps, last) = (3000, 30.0);
        let rest = of(rail.last()).re.min(of(last).re);
        let step = last / steps as f64;
        let sum: Complex64 = (0..steps).map(|i| (of(step * (i as f64 + 0.5)) - rest) * step / PI).sum();
        let wanted = beam.infinite(omega, track.stiffness(omega, 0));
        let off = (sum / wanted - 1.0).norm();
        assert!(off < 0.06, "{f} Hz: {sum:e} for {wanted:e}, {off:.3}");
    }
}
