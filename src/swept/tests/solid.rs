//! Solid bodies, which reach the axle: rods and discs against closed forms and published figures.

use super::*;
use crate::swept::builtin::SectionLines;

/// Equal parts from `a` to `b`.
fn parts(a: f64, b: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|k| a + (b - a) * k as f64 / count as f64).collect()
}

/// A solid cylinder of the radius `r` between y = 0 and `length`, m.
fn solid(r: f64, length: f64, [across, along]: [usize; 2]) -> CrossSection {
    let lines = [parts(0.0, r, across), parts(0.0, length, along)];
    let section = SectionLines { r: &lines[0], y: &lines[1] }.section(|_, _| true, |x| x, |_, _| true);
    section.check(Path::Axle).unwrap();
    section
}

/// Frequencies of the order n up to `limit`, Hz, of a free body, without rigid motions.
fn elastic(forms: &Forms, n: usize, limit: f64) -> Vec<f64> {
    of_order(forms, n, 2.0 * PI * limit).unwrap().omega.iter().filter(|w| **w > 0.0).map(|w| hertz(*w)).collect()
}

/// Free axial rod: six rigid motions; torsion k c_t/2L exactly, longitudinal waves by Love's correction of the inertia
/// across, 1/√(1 + ν²κ²r²/2), which is one of long waves.
#[test]
fn a_solid_rod_twists_and_stretches_as_rods_do() {
    let (radius, length) = (0.04, 1.2);
    let forms = Forms::new(solid(radius, length, [3, 48]), STEEL, &[]).unwrap();
    let rigid = |n| of_order(&forms, n, 2.0 * PI * 9000.0).unwrap().omega.iter().filter(|w| **w == 0.0).count();
    assert_eq!([rigid(0), rigid(1), rigid(2)], [2, 2, 0]);
    let found = elastic(&forms, 0, 9000.0);
    let twist = |k: i32| f64::from(k) * (STEEL.shear() / STEEL.density).sqrt() / (2.0 * length);
    let stretch = |k: i32| {
        let kappa = PI * f64::from(k) / length;
        let inertia = 1.0 + 0.5 * (STEEL.poisson * kappa * radius).powi(2);
        hertz(kappa * (STEEL.young / (STEEL.density * inertia)).sqrt())
    };
    let mut wanted: Vec<(f64, f64)> = (1..8).map(|k| (twist(k), 5e-5)).collect();
    wanted.extend((1..6).map(|k| (stretch(k), 5e-4)));
    wanted.retain(|(f, _)| *f < 9000.0);
    wanted.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(found.len(), wanted.len(), "{found:?} {wanted:?}");
    for (found, (wanted, allowed)) in found.iter().zip(&wanted) {
        assert!((found / wanted - 1.0).abs() < *allowed, "{found} {wanted}");
    }
}

/// Frequencies, Hz, below `limit`, of a free beam of Timoshenko of a circular section; shear coefficient 6(1 + ν)²/(7 +
/// 12ν + 4ν²) (J. R. Hutchinson, Journal of Applied Mechanics 68, 2001, recalled).
fn timoshenko(radius: f64, length: f64, limit: f64) -> Vec<f64> {
    let nu = STEEL.poisson;
    let kappa = 6.0 * (1.0 + nu).powi(2) / (7.0 + 12.0 * nu + 4.0 * nu * nu);
    let gyration = 0.25 * radius * radius;
    // Determinant of the moment and the shear force at the end of motions that are even, or odd, about the middle.
    let ends = |even: bool, f: f64| {
        let square = (2.0 * PI * f).powi(2) * STEEL.density;
        let (p, q) = (square / (kappa * STEEL.shear()), square / STEEL.young);
        // κ⁴ − (p + q) κ² + q (p − 1/i²) = 0 for waves of the number κ.
        let root = (0.25 * (p - q).powi(2) + q / gyration).sqrt();
        let (a, b) = ((0.5 * (p + q) + root).sqrt(), (root - 0.5 * (p + q)).sqrt());
        let (s, t) = ((p - a * a) / a, (b * b + p) / b);
        let half = 0.5 * length;
        let ((sin, cos), (sinh, cosh)) = ((a * half).sin_cos(), ((b * half).tanh(), 1.0));
        match even {
            true => a * s * cos * (b - t) * sinh + b * t * cosh * (a + s) * sin,
            false => a * s * sin * (b - t) * cosh - b * t * sinh * (a + s) * cos,
        }
    };
    let mut found = Vec::new();
    for even in [true, false] {
        let steps = 4000;
        let at = |k: usize| 10.0 + (limit - 10.0) * k as f64 / steps as f64;
        for k in 0..steps {
            let (mut low, mut high) = (at(k), at(k + 1));
            if ends(even, low) * ends(even, high) < 0.0 {
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if ends(even, low) * ends(even, middle) <= 0.0 {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                found.push(low);
            }
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

/// Bending of a free solid rod is Timoshenko's.
#[test]
fn a_solid_rod_bends_as_timoshenkos_beam() {
    let (radius, length) = (0.04, 1.2);
    let forms = Forms::new(solid(radius, length, [3, 24]), STEEL, &[]).unwrap();
    let (found, wanted) = (elastic(&forms, 1, 4200.0), timoshenko(radius, length, 4200.0));
    println!("{found:?} {wanted:?}");
    assert!(found.len() == wanted.len() && found.len() >= 5, "{found:?} {wanted:?}");
    for (found, wanted) in found.iter().zip(&wanted) {
        assert!((found / wanted - 1.0).abs() < 3e-3, "{found} {wanted}");
    }
}

/// A thin solid disc, free, ν = 0.3, by plate theory: bending λ² = ωR²√(ρh/D) of (2, 0), (0, 1), (3, 0), (1, 1), (4, 0)
/// (A. W. Leissa, Vibration of Plates, NASA SP-160, 1969, with ν = 0.3, recalled), and in its plane Ω =
/// ωR√(ρ(1 − ν²)/E) of n = 0, 1, 2, 3 (T. Irie, G. Yamada, Y. Muramoto, Journal of Sound and Vibration 97, 1984,
/// recalled).
#[test]
fn a_solid_disc_has_the_published_frequencies() {
    let (radius, thick) = (0.5, 0.005);
    let forms = Forms::new(solid(radius, thick, [24, 1]), STEEL, &[]).unwrap();
    let nu = STEEL.poisson;
    let bending =
        hertz((STEEL.young * thick * thick / (12.0 * (1.0 - nu * nu) * STEEL.density)).sqrt()) / radius.powi(2);
    for (n, index, wanted) in [(2, 0, 5.3583), (0, 0, 9.0031), (3, 0, 12.439), (1, 0, 20.475), (4, 0, 21.835)] {
        let found = elastic(&forms, n, 24.0 * bending)[index] / bending;
        println!("bending {n}: {found} {wanted}");
        assert!((found / wanted - 1.0).abs() < 2e-3, "{n}: {found} {wanted}");
    }
    let plane = hertz((STEEL.young / (STEEL.density * (1.0 - nu * nu))).sqrt()) / radius;
    for (n, wanted) in [(0, 2.0489), (1, 1.6176), (2, 1.3876), (3, 2.1304)] {
        // Bending modes are many there: the one that moves least along the axle.
        let modes = of_order(&forms, n, 2.0 * PI * 2.5 * plane).unwrap();
        let seen = ContactModeData::new(&forms, &modes, &[], None);
        let flat = |k: &usize| seen.omega[*k] > 0.0 && seen.shares[*k][2] < 0.01 && seen.shares[*k][0] > 0.01;
        let found = (0..seen.omega.len()).find(flat).map(|k| hertz(seen.omega[k]) / plane).unwrap();
        println!("in plane {n}: {found} {wanted}");
        assert!((found / wanted - 1.0).abs() < 1e-3, "{n}: {found} {wanted}");
    }
}

/// Rotation of a solid disc: an axial pair splits by twice its diameters but for what plates add, and the gyroscopic
/// terms of tilting are those of a disc.
#[test]
fn rigid_motions_of_a_solid_disc_rotate_as_its_moments_of_inertia_say() {
    let forms = Forms::new(solid(0.4, 0.1, [6, 2]), STEEL, &[]).unwrap();
    let [mass, _, polar, diametral] = forms.section.inertia(STEEL);
    assert!((polar / (0.5 * mass * 0.16) - 1.0).abs() < 1e-12);
    assert!((diametral / (mass * (0.25 * 0.16 + 0.01 / 12.0)) - 1.0).abs() < 1e-12);
    let modes = of_order(&forms, 1, 2.0 * PI * 500.0).unwrap();
    let g = blocks(&forms, &modes, None).coupling;
    // Translations have none, tilting has g = I_p/2I_d; the trace does not depend on how both mix.
    let trace = g[(0, 0)] + g[(1, 1)];
    assert!(modes.omega[..2] == [0.0, 0.0] && (trace - 0.5 * polar / diametral).abs() < 1e-9, "{trace}");
}
