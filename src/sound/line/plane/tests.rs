use super::*;
use crate::sound::panels::Panel;

/// A circle of the radius 1 m.
fn circle(panels: usize) -> PanelSurface {
    let at = |t: f64| {
        let (s, c) = (2.0 * PI * t).sin_cos();
        [c, s]
    };
    let panel = |k: usize| Panel { points: [0.0, 1.0, 0.5].map(|t| at((k as f64 + t) / panels as f64)) };
    PanelSurface::new((0..panels).map(panel).collect())
}

/// H_n⁽²⁾ and its derivative.
fn hankel(n: i32, z: f64) -> [Complex64; 2] {
    let of = |n: i32| Complex64::new(libm::jn(n, z), -libm::yn(n, z));
    [of(n), 0.5 * (of(n - 1) - of(n + 1))]
}

/// Largest errors of the surface pressure and of the far field, beside their largest values, of the velocity cos nθ
/// of a circle.
fn of_circle(panels: usize, n: i32, ka: f64, points: Option<&[[f64; 2]]>) -> [f64; 2] {
    let surface = circle(panels);
    let angle = |at: [f64; 2]| at[1].atan2(at[0]);
    let cosine = |i: usize| (f64::from(n) * angle(surface.nodes()[i].point.at)).cos();
    let velocity = Mat::from_fn(surface.nodes().len(), 1, |i, _| cosine(i));
    let pressure = match points {
        Some(points) => with_points(&surface, ka, velocity.as_ref(), points),
        None => pressures(&surface, ka, velocity.as_ref()),
    };
    let pressure = pressure.expect("pressures");
    // iωρv = −∂p/∂r.
    let [h, slope] = hankel(n, ka);
    let impedance = -h / (ka * slope);
    let off = |i: usize| (pressure[(i, 0)] - impedance * cosine(i)).norm() / impedance.norm();
    let near = (0..velocity.nrows()).map(off).fold(0.0, f64::max);
    let count = directions(ka, 1.0);
    let found = far(&surface, ka, velocity.as_ref(), &pressure, count);
    let size = Complex64::new(0.0, -4.0) * Complex64::i().powi(n) / (ka * slope);
    // Harmonics of a small circle are next to nothing beside what a hundredth of their velocity would radiate, were
    // it the same all round.
    let least = 1e-2 * 4.0 / (ka * hankel(0, ka)[1].norm());
    let away = |d: usize| {
        let wanted = size * (2.0 * PI * f64::from(n) * d as f64 / count as f64).cos();
        (found[(d, 0)] - wanted).norm() / size.norm().max(least)
    };
    [near, (0..count).map(away).fold(0.0, f64::max)]
}

/// All harmonics, small and large circles; the errors fall with the third power of the panels or faster, down to
/// 1e-5, those of the rule for panels beside.
#[test]
fn circles_radiate_as_hankels_functions_say() {
    for ka in [0.05, 0.4, 1.0, 3.0, 9.0] {
        for n in [0, 1, 2, 3, 6] {
            let [coarse, fine] = [16, 32].map(|panels| of_circle(panels, n, ka, None));
            assert!(fine[0] < 3e-4 && fine[1] < 3e-4, "n {n}, ka {ka}: {coarse:?}, {fine:?}");
            for (coarse, fine) in coarse.iter().zip(fine) {
                assert!(coarse / fine > 6.0 || fine < 1e-5, "n {n}, ka {ka}: {coarse:e}, {fine:e}");
            }
        }
    }
}

/// At the zeros of J_n the space inside resonates.
#[test]
fn resonances_of_the_space_inside_are_not_seen() {
    let mut worst: f64 = 0.0;
    for (n, ka) in [(0, 2.404825557695773), (1, 3.831705970207512), (2, 5.135622301840683)] {
        let [at, beside] = [1.0, 1.03].map(|part| of_circle(24, n, part * ka, None));
        assert!(at[0] < 1.5 * beside[0] && at[1] < 1.5 * beside[1], "n {n}: {at:?}, {beside:?}");
        worst = worst.max(of_circle(24, n, ka, Some(&[]))[0] / at[0]);
    }
    assert!(worst > 30.0, "without points the resonances do no harm here: {worst:.1}");
}
