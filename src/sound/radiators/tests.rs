use super::*;

const AIR: Air = Air { density: 1.2, speed: 340.0 };

/// A flat disc of radius 1 in patches of `size`, with one mode of each given shape of (x, y).
fn disc(size: f64, shapes: &[fn(f64, f64) -> f64]) -> Radiators {
    let mut patches = BTreeMap::new();
    let mut square = Mat::<f64>::zeros(shapes.len(), shapes.len());
    let rings = (2.0 / size).ceil() as usize;
    for i in 0..rings {
        let (r0, r1) = (i as f64 / rings as f64, (i + 1) as f64 / rings as f64);
        let sectors = 6 * i + 6;
        for s in 0..sectors {
            let r = (0.5 * (r0 * r0 + r1 * r1)).sqrt();
            let angle = 2.0 * PI * (s as f64 + 0.5) / sectors as f64;
            let (x, y) = (r * angle.cos(), r * angle.sin());
            let area = PI * (r1 * r1 - r0 * r0) / sectors as f64;
            let values: Vec<f64> = shapes.iter().map(|v| v(x, y)).collect();
            let key = [0, (x / size).floor() as i64, (y / size).floor() as i64, 0];
            let flow = values.iter().map(|v| area * v).collect();
            add(&mut patches, key, RadiatingPatch { area, moment: [area * x, area * y, 0.0], flow });
            for (a, va) in values.iter().enumerate() {
                for (b, vb) in values.iter().enumerate() {
                    square[(a, b)] += area * va * vb;
                }
            }
        }
    }
    Radiators::new(patches, size, square)
}

/// Bessel function J1 by its integral (1/π) ∫ cos(t − x sin t) dt from 0 to π; the trapezoidal rule is exact to
/// rounding.
fn j1(x: f64) -> f64 {
    let n = 200;
    let at = |i: usize| (PI * i as f64 / n as f64 - x * (PI * i as f64 / n as f64).sin()).cos();
    (0.5 * (at(0) + at(n)) + (1..n).map(at).sum::<f64>()) / n as f64
}

/// Frequency of the wave number `k`, Hz.
fn frequency(k: f64) -> f64 {
    k * AIR.speed / (2.0 * PI)
}

#[test]
fn a_piston_in_a_baffle_has_rayleighs_resistance() {
    // Lord Rayleigh, The Theory of Sound, § 302: R = ρc S (1 − J1(2ka)/(ka)).
    for ka in [0.1, 0.5, 1.0, 2.0, 4.0, 8.0, 20.0] {
        let wanted = AIR.density * AIR.speed * PI * (1.0 - j1(2.0 * ka) / ka);
        let error = |size: f64| disc(size, &[|_, _| 1.0]).resistance(frequency(ka), AIR)[(0, 0)] / wanted - 1.0;
        // As large as patches may be (0.09 dB), and half of that: of second order.
        let size = (2.0 * PI / ka * crate::sound::power::PATCH).min(0.1);
        let (coarse, fine) = (error(size), error(0.5 * size));
        assert!(coarse.abs() < 0.02, "ka = {ka}: {coarse:e} with patches of {size}");
        assert!(fine.abs() < 0.3 * coarse.abs(), "ka = {ka}: {coarse:e}, then {fine:e}");
    }
}

#[test]
fn a_rocking_disc_radiates_as_a_pair_of_sources_at_low_frequency() {
    // Velocity x on a unit disc: the flow vanishes, the moment D = ∫ x² dS = π/4 gives R = ρc k⁴ D²/(6π), from
    // sin(kr)/(kr) = 1 − (kr)²/6 + … with r² = … − 2 x x'.
    let k: f64 = 0.05;
    let found = disc(0.02, &[|x, _| x]).resistance(frequency(k), AIR)[(0, 0)];
    let wanted = AIR.density * AIR.speed * k.powi(4) * (PI / 4.0).powi(2) / (6.0 * PI);
    assert!((found / wanted - 1.0).abs() < 0.01, "{found:e} for {wanted:e}");
}

#[test]
fn modes_of_other_symmetry_do_not_couple_and_the_matrix_is_positive() {
    let shapes: [fn(f64, f64) -> f64; 3] = [|_, _| 1.0, |x, _| x, |x, y| x * x - y * y];
    let r = disc(0.1, &shapes).resistance(frequency(3.0), AIR);
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let share = r[(a, b)] / (r[(a, a)] * r[(b, b)]).sqrt();
        assert!(share.abs() < 0.02 && r[(a, b)] == r[(b, a)], "modes {a} and {b}: {share}");
        assert!(r[(a, a)] > 0.0 && r[(b, b)] > 0.0);
    }
}

#[test]
fn parts_of_a_surface_radiate_each_for_itself_and_coarser_patches_agree() {
    let one = disc(0.05, &[|x, _| 1.0 + x]);
    let f = frequency(1.0);
    let alone = one.resistance(f, AIR)[(0, 0)];
    let mut twice = one.patches.clone();
    for ([_, i, j, k], patch) in &one.patches {
        twice.insert([1, *i, *j, *k], patch.clone());
    }
    let two = Radiators::new(twice, 0.05, one.square.clone());
    assert!((two.resistance(f, AIR)[(0, 0)] / alone - 2.0).abs() < 1e-12);
    let coarser = two.coarser();
    assert!(coarser.len() < two.len() / 2 && (coarser.area() / two.area() - 1.0).abs() < 1e-12);
    let change = coarser.resistance(f, AIR)[(0, 0)] / (2.0 * alone) - 1.0;
    assert!(change.abs() < 0.005, "{change:e}");
}

#[test]
fn the_sine_is_a_sine() {
    for i in 0..200_000 {
        let x = i as f64 * 0.005_1;
        assert!((sine(x) - x.sin()).abs() < 1e-12, "sin {x}: {} for {}", sine(x), x.sin());
    }
    assert!((sine(999_999.5) - 999_999.5f64.sin()).abs() < 1e-9);
}

#[test]
fn eight_cubes_become_one() {
    let patch = RadiatingPatch { area: 1.0, moment: [0.0; 3], flow: vec![] };
    // From -4 to 3: the lattice is the same on either side of 0.
    let key = |n: i64| [0, n % 8 - 4, n / 8 % 8 - 4, n / 64 - 4];
    let all = Radiators::new((0..512).map(|n| (key(n), patch.clone())).collect(), 0.1, Mat::zeros(0, 0));
    let half = all.coarser();
    assert_eq!((half.len(), half.size()), (64, 0.2));
    assert!(half.patches.values().all(|p| p.area == 8.0));
}
