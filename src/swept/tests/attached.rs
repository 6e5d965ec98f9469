//! Rings of mass on springs that a section carries, against closed forms.

use super::super::attached::RingLoss;
use super::*;
use num_complex::Complex;

/// Steel that hardly yields, so that sections move as a whole.
const RIGID: ElasticMaterial = ElasticMaterial { young: 205e9 * 3e4, ..STEEL };

/// Absorbers that move along one direction at the angular frequency `omega`, rad/s.
fn absorber(along: usize, mass: f64, omega: f64, loss: f64) -> Attachment {
    Attachment {
        name: "absorber".into(),
        place: [0.3, 0.01],
        mass,
        frequency: [0, 1, 2].map(|c| (c == along).then_some(omega)),
        loss,
        highest: None,
        wire: None,
    }
}

fn ring_section() -> CrossSection {
    cylinder(&annulus(None, 0.0), even(0.02, 0.05)).unwrap()
}

/// A ring of stiff `material` on springs along its axle with the angular frequency `omega`, rad/s, that carries
/// `attachments`; and its mass, kg.
fn on_springs(material: ElasticMaterial, omega: f64, attachments: &[Attachment]) -> (Forms, f64) {
    let section = ring_section();
    let [mass, ..] = section.inertia(material);
    // Across the axle it is held far more stiffly.
    let stiffness = [1e4 * mass * omega * omega, mass * omega * omega, 0.0];
    let springs = EdgeSprings { group: "inner".into(), stiffness, per_area: false };
    (Forms::carrying(section, material, (&[], &[springs]), attachments).unwrap(), mass)
}

/// Eigenvalues of s² + s C + K = 0 with positive imaginary parts, by imaginary part.
fn eigenvalues(stiffness: &Mat<f64>, damping: &Mat<f64>) -> Vec<Complex<f64>> {
    let m = stiffness.nrows();
    let companion = Mat::from_fn(2 * m, 2 * m, |i, j| match (i < m, j < m) {
        (true, true) => 0.0,
        (true, false) => f64::from(u8::from(i + m == j)),
        (false, true) => -stiffness[(i - m, j)],
        (false, false) => -damping[(i - m, j - m)],
    });
    let mut all: Vec<Complex<f64>> = companion.eigenvalues().unwrap().into_iter().filter(|s| s.im > 0.0).collect();
    all.sort_by(|a, b| a.im.total_cmp(&b.im));
    all
}

/// Eigenvalues of the modes of the order 0 with the dashpots of rings.
fn damped(forms: &Forms, limit: f64) -> Vec<Complex<f64>> {
    let modes = of_order(forms, 0, limit).unwrap();
    let RingLoss { viscous, .. } = forms.ring_loss(0, modes.vectors.as_ref());
    let m = modes.omega.len();
    eigenvalues(&Mat::from_fn(m, m, |i, j| if i == j { modes.omega[i].powi(2) } else { 0.0 }), &viscous)
}

/// One mode with an absorber is the oscillator of two masses: its eigenvalues are those of the closed form, and the
/// tuning ω/(1 + μ) damps both alike (the characteristic polynomial is palindromic).
#[test]
fn one_mode_with_an_absorber_has_the_eigenvalues_of_two_masses() {
    let omega = 2.0 * PI * 100.0;
    let (_, mass) = on_springs(RIGID, omega, &[]);
    for (ratio, tuned, loss) in [(0.05, 1.0 / 1.05, 0.2), (0.05, 1.0, 0.1), (0.02, 0.8, 0.4), (0.3, 1.3, 0.05)] {
        let (m, own) = (ratio * mass, tuned * omega);
        let (forms, _) = on_springs(RIGID, omega, &[absorber(2, m, own, loss)]);
        let found = damped(&forms, 2.0 * omega);
        let (k, c) = (m * own * own, m * own * loss);
        let both = |diagonal: f64, beside: f64| {
            Mat::from_fn(2, 2, |i, j| match (i, j) {
                (0, 0) => (diagonal + beside) / mass,
                (0, 1) => -beside / mass,
                (1, 0) => -beside / m,
                _ => beside / m,
            })
        };
        let wanted = eigenvalues(&both(mass * omega * omega, k), &both(0.0, c));
        assert_eq!((found.len(), wanted.len()), (2, 2));
        for (s, w) in found.iter().zip(&wanted) {
            assert!((s - w).norm() < 2e-6 * omega, "{ratio} {tuned}: {s} 1/s, expected {w}");
        }
        let ratios: Vec<f64> = found.iter().map(|s| -s.re / s.norm()).collect();
        let alike = (ratios[0] / ratios[1] - 1.0).abs() < 1e-4;
        assert_eq!(alike, tuned == 1.0 / (1.0 + ratio), "{ratios:?}");
    }
}

/// Den Hartog's fixed points: with the tuning ω/(1 + μ) the displacement under a force is √(1 + 2/μ) of the static one
/// at the frequencies ω √((1 ± √(μ/(2 + μ)))/(1 + μ)), whatever the loss. Free motions are damped best where both modes
/// merge, at η = 2√(μ/(1 + μ)), each with the damping ratio √μ/2.
#[test]
fn absorbers_have_den_hartogs_fixed_points_and_the_best_damping() {
    let omega = 2.0 * PI * 100.0;
    let (_, mass) = on_springs(RIGID, omega, &[]);
    let mu: f64 = 0.06;
    for loss in [0.05, 0.3, 2.0 * (mu / (1.0 + mu)).sqrt()] {
        let (forms, _) = on_springs(RIGID, omega, &[absorber(2, mu * mass, omega / (1.0 + mu), loss)]);
        let modes = of_order(&forms, 0, 2.0 * omega).unwrap();
        let viscous = forms.ring_loss(0, modes.vectors.as_ref()).viscous;
        assert_eq!(modes.omega.len(), 2);
        // The axial motion of the section, which moves as a whole.
        let phi = [0, 1].map(|k| modes.vectors[(forms.amplitude(0).unwrap() + 2, k)]);
        for sign in [-1.0, 1.0] {
            let w = omega * ((1.0 + sign * (mu / (2.0 + mu)).sqrt()) / (1.0 + mu)).sqrt();
            let at = |i: usize, j: usize| {
                let own = if i == j { modes.omega[i].powi(2) - w * w } else { 0.0 };
                Complex::new(own, w * viscous[(i, j)])
            };
            let determinant = at(0, 0) * at(1, 1) - at(0, 1) * at(1, 0);
            let moved = at(1, 1) * phi[0] * phi[0] + at(0, 0) * phi[1] * phi[1] - 2.0 * at(0, 1) * phi[0] * phi[1];
            let height = (moved / determinant).norm() * mass * omega * omega;
            assert!((height / (1.0 + 2.0 / mu).sqrt() - 1.0).abs() < 1e-4, "{loss} {sign}: {height}");
        }
    }
    let best = 2.0 * (mu / (1.0 + mu)).sqrt();
    let ratios = |loss: f64| -> Vec<f64> {
        let (forms, _) = on_springs(RIGID, omega, &[absorber(2, mu * mass, omega / (1.0 + mu), loss)]);
        damped(&forms, 2.0 * omega).iter().map(|s| -s.re / s.norm()).collect()
    };
    // At the double eigenvalue rounding takes the two apart, but not their mean.
    let mean = 0.5 * ratios(best).iter().sum::<f64>();
    assert!((mean / (0.5 * mu.sqrt()) - 1.0).abs() < 1e-4, "{mean}");
    assert!([0.8, 1.2].iter().all(|part| ratios(part * best).iter().any(|r| *r < 0.9 * mean)));
}

/// Without mass nothing changes; tied rigidly it is an added mass; in either way of the three directions.
#[test]
fn an_absorber_of_no_mass_changes_nothing_and_a_rigid_one_adds_its_mass() {
    let omega = 2.0 * PI * 100.0;
    // Less stiff than in the other tests, as the rounding of rigid springs goes with their stiffness.
    let stiff = ElasticMaterial { young: 1e3 * STEEL.young, ..STEEL };
    let (bare, mass) = on_springs(stiff, omega, &[]);
    let first = |forms: &Forms| of_order(forms, 0, 1.5 * omega).unwrap().omega[0];
    assert!((first(&bare) / omega - 1.0).abs() < 1e-4);
    for along in [0, 1, 2] {
        let (rigid, _) = on_springs(stiff, omega, &[absorber(along, 0.1 * mass, 1e4 * omega, 0.1)]);
        let wanted = first(&bare) / 1.1f64.sqrt();
        assert!((first(&rigid) / wanted - 1.0).abs() < 1e-5, "{along}: {} {wanted}", first(&rigid));
    }
    let wheel = |attachments: &[Attachment]| {
        let section = w920s(0.0, COARSE).unwrap();
        Forms::carrying(section, STEEL, (&["inner".to_string()], &[]), attachments).unwrap()
    };
    let light = Attachment { place: [0.39, -0.04], ..absorber(2, 1e-7, 2.0 * PI * 4000.0, 0.2) };
    let (bare, light) = (wheel(&[]), wheel(&[light]));
    for n in [0, 2, 3] {
        let [a, b] = [&bare, &light].map(|forms| of_order(forms, n, 2.0 * PI * 3500.0).unwrap());
        assert_eq!(a.omega.len(), b.omega.len());
        assert!(a.omega.iter().zip(&b.omega).all(|(a, b)| (a / b - 1.0).abs() < 1e-8), "{n}");
    }
}

/// A rigid ring of mass at rest is what makes a free wheel heavier: it stays free, with as many motions as a whole.
#[test]
fn a_free_wheel_stays_free() {
    let section = ring_section();
    let forms = Forms::carrying(section, STEEL, (&[], &[]), &[absorber(2, 8.0, 2.0 * PI * 900.0, 0.2)]).unwrap();
    for (n, rigid) in [(0, 2), (1, 2), (2, 0)] {
        let modes = of_order(&forms, n, 2.0 * PI * 2000.0).unwrap();
        assert_eq!(modes.omega.iter().filter(|w| **w == 0.0).count(), rigid, "{n}: {:?}", modes.omega);
        // The absorber itself is there in every order.
        assert!(modes.omega.iter().any(|w| (w / (2.0 * PI * 900.0) - 1.0).abs() < 0.1), "{n}: {:?}", modes.omega);
    }
}

/// Masses that turn with a held wheel move in its frame by (ω_r² − Ω² − ν²)(ω_t² − Ω² − ν²) = 4Ω²ν², ω_r along the
/// radius and ω_t along the circle; a wave of n diameters then has ν ± nΩ beside the wheel. Along the axle ν is ω.
#[test]
fn rings_on_a_turning_wheel_have_the_closed_form() {
    let (radial, around, axial, speed) = (2.0 * PI * 90.0, 2.0 * PI * 140.0, 2.0 * PI * 60.0, 110.0);
    let mass = Attachment { frequency: [Some(radial), Some(around), Some(axial)], ..absorber(2, 3.0, 1.0, 0.0) };
    let forms = Forms::carrying(ring_section(), RIGID, (&["inner".to_string()], &[]), &[mass]).unwrap();
    let prestress = forms.centrifugal().unwrap();
    let s = speed * speed;
    let (p, q) = (radial * radial + around * around + 2.0 * s, (radial * radial - s) * (around * around - s));
    let root = (0.25 * p * p - q).sqrt();
    let inside = [(0.5 * p - root).sqrt(), (0.5 * p + root).sqrt(), axial];
    for n in [1usize, 2, 5] {
        let modes = of_order(&forms, n, 2.0 * PI * 300.0).unwrap();
        let m = modes.omega.len();
        assert_eq!(m, 3);
        let turning = blocks(&forms, &modes, Some(&prestress));
        let mut found = Vec::new();
        for sign in [-1.0, 1.0] {
            let companion = Mat::from_fn(2 * m, 2 * m, |i, j| match (i < m, j < m) {
                (true, true) => 0.0,
                (true, false) => f64::from(u8::from(i + m == j)),
                (false, true) => {
                    let own = if i - m == j { modes.omega[j].powi(2) } else { 0.0 };
                    own + s * turning.stiffness[(i - m, j)]
                }
                (false, false) => 2.0 * sign * speed * turning.coupling[(i - m, j - m)],
            });
            found.extend(companion.eigenvalues().unwrap().into_iter().map(|p| p.re.abs()));
        }
        let n = n as f64;
        let mut wanted: Vec<f64> = inside.iter().flat_map(|v| [v - n * speed, v + n * speed]).map(f64::abs).collect();
        // Either wave is found with both signs.
        wanted.extend(wanted.clone());
        found.sort_by(f64::total_cmp);
        wanted.sort_by(f64::total_cmp);
        for (f, w) in found.iter().zip(&wanted) {
            assert!((f - w).abs() < 1e-5 * axial, "{n}: {found:?}, expected {wanted:?}");
        }
    }
}

/// Seen from the other side of the wheel absorbers have the same frequencies and losses.
#[test]
fn mirrored_wheels_have_the_same_modes() {
    let place = [0.39, -0.03];
    let found = [false, true].map(|mirrored| {
        let given = SectionSource::Wheel(Wheel { mirrored, height: Some(0.0), ..Wheel::w920s(0.01) });
        let section = given.for_modes().unwrap();
        let tuned = Attachment { place, ..absorber(2, 10.0, 2.0 * PI * 900.0, 0.2) };
        let attached = given.attached(&section, &[tuned]).unwrap();
        let at = section.nearest(attached[0].place).unwrap();
        assert!(at.distance < 1e-9 && (at.place[1] - if mirrored { 0.04 } else { -0.04 }).abs() < 1e-9, "{at:?}");
        let forms = Forms::carrying(section, STEEL, (&["inner".to_string()], &[]), &attached).unwrap();
        let prestress = forms.centrifugal().unwrap();
        let modes = of_order(&forms, 3, 2.0 * PI * 3000.0).unwrap();
        ContactModeData::new(&forms, &modes, &[], Some(&prestress))
    });
    let [a, b] = &found;
    assert!(a.omega.len() > 2 && a.omega.len() == b.omega.len());
    for k in 0..a.omega.len() {
        assert!((a.omega[k] / b.omega[k] - 1.0).abs() < 1e-9);
        assert!((a.viscous[(k, k)] - b.viscous[(k, k)]).abs() < 1e-6 * a.viscous[(0, 0)].abs().max(1.0));
        assert!((a.rotation.stiffness[(k, k)] - b.rotation.stiffness[(k, k)]).abs() < 1e-6);
        assert!((a.stored[k] - b.stored[k]).abs() < 1e-6 * a.omega[k].powi(2));
    }
}

/// A ring of wire that hardly touches its groove has the frequencies of a free ring: across its plane
/// n(n² − 1)/√(n² + 1 + ν) times √(EI/ρA)/r², in it n(n² − 1)/√(n² + 1) (Love); springs add their own.
#[test]
fn a_ring_of_wire_has_the_frequencies_of_a_free_ring() {
    let (r, d) = (0.4, 0.012);
    let wire = Wire { diameter: d, material: STEEL };
    let ring = |omega: f64| {
        let place = [r, 0.0];
        let ring =
            Attachment { place, frequency: [Some(omega); 3], wire: Some(wire), ..absorber(2, wire.mass(r), 1.0, 0.0) };
        Forms::carrying(ring_section(), RIGID, (&["inner".to_string()], &[]), &[ring]).unwrap()
    };
    let unit = (STEEL.young / STEEL.density).sqrt() * 0.25 * d / (r * r);
    let (loose, tuned) = (ring(1e-3 * unit), ring(10.0 * unit));
    for n in [2usize, 3, 6] {
        let x = (n * n) as f64;
        let bent = n as f64 * (x - 1.0);
        let wanted = [bent / (x + 1.0 + STEEL.poisson).sqrt() * unit, bent / (x + 1.0).sqrt() * unit];
        let found = of_order(&loose, n, 1.2 * wanted[1]).unwrap().omega;
        assert_eq!(found.len(), 2, "{n}: {found:?} {wanted:?}");
        for (f, w) in found.iter().zip(wanted) {
            assert!((f / w - 1.0).abs() < 3e-3, "{n}: {found:?}, expected {wanted:?}");
        }
        let found = of_order(&tuned, n, 1.2 * wanted[1].hypot(10.0 * unit)).unwrap().omega;
        let wanted = wanted[0].hypot(10.0 * unit);
        assert!(found.iter().any(|f| (f / wanted - 1.0).abs() < 1e-4), "{n}: {found:?}, expected {wanted}");
    }
    // Moved as a whole and turned about the axle it is not strained.
    let bare = Forms::carrying(
        ring_section(),
        STEEL,
        (&[], &[]),
        &[Attachment { wire: Some(wire), frequency: [Some(1e3); 3], ..absorber(2, wire.mass(0.3), 1.0, 0.0) }],
    )
    .unwrap();
    for (n, rigid) in [(0, 2), (1, 2)] {
        let modes = of_order(&bare, n, 2.0 * PI * 100.0).unwrap();
        assert_eq!(modes.omega.iter().filter(|w| **w == 0.0).count(), rigid, "{n}: {:?}", modes.omega);
    }
}

/// From half of their number on absorbers move across their direction alone: as a mass that is tied there.
#[test]
fn few_absorbers_do_not_act_on_many_diameters() {
    let omega = 2.0 * PI * 900.0;
    let with = |attachment: Attachment| {
        Forms::carrying(ring_section(), STEEL, (&["inner".to_string()], &[]), &[attachment]).unwrap()
    };
    let few = with(Attachment { highest: Some(3), ..absorber(2, 9.0, omega, 0.2) });
    let many = with(absorber(2, 9.0, omega, 0.2));
    let bare = clamped(ring_section(), STEEL);
    let limit = 2.0 * PI * 3500.0;
    for n in [3, 4] {
        let [few, many, bare] = [&few, &many, &bare].map(|forms| of_order(forms, n, limit).unwrap().omega.len());
        assert_eq!(many, bare + 1, "{n}");
        assert_eq!(few, if n == 3 { many } else { bare }, "{n}");
    }
    let modes = of_order(&few, 4, limit).unwrap();
    let loss = few.ring_loss(4, modes.vectors.as_ref());
    assert!(loss.viscous.norm_max() == 0.0 && loss.stored.iter().all(|s| *s == 0.0));
}

/// Places inside are met to rounding, places beside by their distance; the rings are part of what two bodies have in
/// common.
#[test]
fn places_on_a_section_are_found() {
    for section in [w920s(0.013, COARSE).unwrap(), ring_section()] {
        for place in [[0.3, 0.0], [0.2311, -0.0087]] {
            let place = [place[0], place[1] - if section.nodes.iter().any(|x| x[0] < 0.096) { 0.013 } else { 0.0 }];
            let found = section.nearest(place).unwrap();
            assert!(found.distance < 1e-12, "{found:?}");
            assert!((found.shares.iter().map(|s| s.1).sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
    let found = ring_section().nearest([0.3, 0.0531]).unwrap();
    assert!((found.distance - 0.0031).abs() < 1e-9 && (found.place[1] - 0.05).abs() < 1e-9, "{found:?}");
    let given = SectionSource::Wheel(Wheel { mirrored: true, height: Some(0.0), ..Wheel::w920s(0.01) });
    let section = given.for_modes().unwrap();
    let beside =
        Attachment { place: [0.3, -0.04], name: "bodies.upper.absorbers.1".into(), ..absorber(2, 1.0, 1e3, 0.0) };
    let error = given.attached(&section, &[beside]).unwrap_err();
    let text = error.message();
    for part in [
        "bodies.upper.absorbers.1.place: found r = 0.3000 m, y = -0.0400 m",
        "28.0 mm",
        "y = -0.0120 m",
        "0.0950 to 0.4880",
    ] {
        assert!(text.contains(part), "{text}");
    }
    let wheel = |offset: f64, mass: f64| {
        let given = SectionSource::Wheel(Wheel::w920s(offset));
        let section = given.for_modes().unwrap();
        let attached =
            given.attached(&section, &[Attachment { place: [0.39, -0.04], ..absorber(2, mass, 1e3, 0.1) }]).unwrap();
        Forms::carrying(section, STEEL, (&[], &[]), &attached).unwrap()
    };
    assert!(wheel(0.0, 3.0).is_elsewhere(&wheel(0.011, 3.0), 0.0));
    assert!(!wheel(0.0, 3.0).is_elsewhere(&wheel(0.011, 3.1), 0.0));
}
