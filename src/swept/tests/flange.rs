//! Contact of a wheel along its profile, from the tread over the flange root to the face of the flange.

use super::super::modes::{contact_functions, FourierModes};
use super::*;

const RAIL_WHEEL: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
const PATCH: LoadPatch = LoadPatch::Circle { radius: 4e-3 };

/// Height of S1002 (EN 13715) above the running circle at y, both mm, y to the field side.
fn s1002(y: f64) -> f64 {
    let polynomial = |c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * y + c);
    match y {
        y if y < -49.662510381 => 16.0 + (144.0 - (y + 55.0).powi(2)).sqrt(),
        y if y < -39.764473993 => 8.834924130 + (400.0 - (y + 58.558326413).powi(2)).sqrt(),
        y if y < -38.426669071 => polynomial(&[-93.576667419, -2.747477419]),
        y if y < -35.0 => 16.446 - (169.0 - (y + 26.210665).powi(2)).sqrt(),
        y if y < -26.0 => polynomial(&[
            -4.320221063e+03,
            -1.038384026e+03,
            -1.065501873e+02,
            -6.051367875,
            -2.054332446e-01,
            -4.169739389e-03,
            -4.687195829e-05,
            -2.252755540e-07,
        ]),
        y if y < 32.15796 => polynomial(&[
            0.0,
            -3.358537058e-02,
            1.565681624e-03,
            -2.810427944e-05,
            5.844240864e-08,
            -1.562379023e-08,
            5.309217349e-15,
            -5.957839843e-12,
            2.646656573e-13,
        ]),
        _ => polynomial(&[1.364323640, -0.066666667]),
    }
}

/// Place of S1002 at `y` (m) from the running circle to the flange: y and height, m, and slope angle, rad.
fn on_profile(y: f64) -> [f64; 3] {
    let at = -1e3 * y;
    // The pieces of the standard meet within 0.12 µm: over a longer step that is 3 mrad.
    let slope = (s1002(at + 0.02) - s1002(at - 0.02)) / 0.04;
    [y, 1e-3 * s1002(at), -slope.atan()]
}

fn wheel([offset, height, _]: [f64; 3], mirrored: bool) -> SectionSource {
    SectionSource::Wheel(Wheel { height: Some(height), mirrored, ..Wheel::w920s(offset) })
}

/// Angle of the frame of the profile against that of the loads, rad.
fn turn(place: [f64; 3], mirrored: bool) -> f64 {
    let tilt = if mirrored { -place[2] } else { place[2] };
    tilt - wheel(place, mirrored).contact().angle()
}

/// Compliance of the contact beside the half-space, in the frame of the profile.
fn compliance(place: [f64; 3], mirrored: bool) -> Square {
    let given = wheel(place, mirrored);
    let loads = clamped(given.for_loads(PATCH.half()[1]).unwrap(), RAIL_WHEEL);
    let constant = Constant::for_contact(&loads, &[PATCH], &given.contact()).unwrap();
    load_frame::rotate_load_pairs(&own(&constant)[0], turn(place, mirrored))
}

/// The lowest mode of two nodal diameters at the contact, in the frame of the profile, with the sign of its motion
/// along y on the tread.
fn motion(place: [f64; 3], mirrored: bool, modes: &FourierModes, forms: &Forms) -> [f64; LOADS] {
    let mut moved = forms.clone();
    moved.section = wheel(place, mirrored).for_modes().unwrap();
    let contact = wheel(place, mirrored).contact();
    let line = LineLoad::for_contact(&moved, PATCH, modes.order, &contact);
    let seen = contact_functions(modes.vectors.as_ref(), &[line]);
    rotate_loads(std::array::from_fn(|c| seen[(c, 0)]), turn(place, mirrored))
}

fn lowest(mirrored: bool) -> (FourierModes, Forms) {
    let forms = clamped(wheel(on_profile(0.0), mirrored).for_modes().unwrap(), RAIL_WHEEL);
    let modes = of_order(&forms, 2, 2.0 * PI * 500.0).unwrap();
    assert!(!modes.omega.is_empty());
    (modes, forms)
}

/// Forces at the contact have the force and, within 3 mm, the arm of those on the profile: means of a rotation about x.
#[test]
fn loads_on_the_flange_root_have_the_arm_of_the_profile() {
    for mirrored in [false, true] {
        for k in 0..=200 {
            let place = on_profile(-0.058 + 5e-4 * f64::from(k));
            let given = wheel(place, mirrored);
            let forms = Forms::new(given.for_modes().unwrap(), RAIL_WHEEL, &[]).unwrap();
            let mut rotation = vec![0.0; forms.order()];
            for (node, &[r, y]) in forms.section.nodes.iter().enumerate() {
                let at = forms.amplitude(node).unwrap();
                rotation[at..at + 3].copy_from_slice(&[y, -y, -r]);
            }
            let line = LineLoad::for_contact(&forms, PATCH, 1, &given.contact());
            let [_, y, n, ..] = line.means(faer::ColRef::from_slice(&rotation));
            let arm = 0.46 + place[1];
            assert!((y + arm).abs() < 3.2e-3 && n.abs() < 3.2e-3, "{place:?}: {y} {n}");
            let shares: f64 = given.contact().spots().map(|s| s.share).sum();
            assert!((shares - 1.0).abs() < 1e-15);
        }
    }
}

/// The motion of a mode at the contact has no jump on the way from the field side of the tread to 20 mm up the flange,
/// and is mirrored.
#[test]
fn modes_at_the_contact_go_on_over_the_flange_root() {
    let (modes, forms) = lowest(false);
    let (mirrored, other) = lowest(true);
    let size = motion(on_profile(0.0), false, &modes, &forms)[1].abs();
    let sign = motion(on_profile(0.0), false, &modes, &forms)[1] * motion(on_profile(0.0), true, &mirrored, &other)[1];
    let mut before: Option<([f64; LOADS], f64)> = None;
    for k in 0..=1000 {
        let place = on_profile(-0.058 + 1e-4 * f64::from(k));
        let found = motion(place, false, &modes, &forms);
        if let Some((before, angle)) = before {
            // 0.1 mm on: the frame turns, and the loads go over by up to 3 % of what changes over the root.
            let jump = (0..3).map(|c| (found[c] - before[c]).abs()).fold(0.0, f64::max);
            let turned = (place[2] - angle).abs();
            assert!(jump < (turned + 0.012) * size, "{place:?}: {before:?} {found:?}");
        }
        before = Some((found, place[2]));
        if k % 100 == 0 || (k > 840 && k % 20 == 0) {
            let seen = motion(place, true, &mirrored, &other);
            for (c, factor) in [(0, 1.0), (1, -1.0), (2, 1.0)] {
                let wanted = -sign.signum() * factor * found[c];
                assert!((seen[c] - wanted).abs() < 1e-8 * size, "{place:?}: {found:?} {seen:?}");
            }
        }
        if place[1] > 0.020 {
            return;
        }
    }
    panic!("the path ends 20 mm up the flange");
}

/// The compliance beside the half-space has no jump on the same way, and is mirrored.
#[test]
fn the_contact_yields_alike_on_either_side_of_the_flange_root() {
    yields_alike(&[38.2e-3]);
}

/// The same at more places.
#[test]
#[ignore = "long: scripts/validate long"]
fn the_contact_yields_alike_all_over_the_flange_root() {
    yields_alike(&[27e-3, 33e-3, 40.5e-3]);
}

fn yields_alike(places: &[f64]) {
    let largest = |a: &Square, b: &Square| {
        let pairs = (0..3).flat_map(|c| (0..3).map(move |d| (c, d)));
        pairs.map(|(c, d)| (a[c][d] - b[c][d]).abs()).fold(0.0, f64::max)
    };
    for &y in places {
        let [a, b] = [y, y + 0.05e-3].map(|y| compliance(on_profile(y), false));
        let size = a[1][1].max(a[2][2]);
        assert!(largest(&a, &b) < 0.02 * size, "{y}: {a:?} {b:?}");
        let other = compliance(on_profile(y), true);
        for c in 0..3 {
            for d in 0..3 {
                let sign = if (c == 1) == (d == 1) { 1.0 } else { -1.0 };
                assert!((other[c][d] - sign * a[c][d]).abs() < 1e-7 * size, "{y} {c}{d}: {a:?} {other:?}");
            }
        }
    }
}

/// Beyond the face of the flange W920S is not touched.
#[test]
fn a_contact_on_the_tip_of_the_flange_is_refused() {
    let error = wheel(on_profile(0.05), false).for_modes().unwrap_err();
    assert!(error.exit_code() == 2 && error.message().contains("24 mm above"), "{error}");
}
