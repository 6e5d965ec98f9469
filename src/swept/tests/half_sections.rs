//! Modes from half sections beside those of whole ones.

use super::*;

const STEEL_OF_WHEELS: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

/// The wheelset on bearings at these y from its middle, with these stiffnesses along x, y and z, N/m.
fn wheelset(mirrored: bool, bearings: [(f64, [f64; 3]); 2]) -> (Forms, Mirror) {
    let shape = WheelShape::w920s_wheelset();
    let given = SectionSource::Wheel(Wheel { shape, offset: 0.0, height: None, mirrored });
    let section = given.for_modes().unwrap();
    let at = bearings.map(|(y, stiffness)| Bearing { place: [0.0, y], stiffness });
    let bearings = given.bearings(&section, &at).unwrap();
    let mirror = Mirror::new(&section, given.middle().unwrap()).unwrap();
    (Forms::new(section, STEEL_OF_WHEELS, &[]).unwrap().on_bearings(&bearings), mirror)
}

/// Half sections have all modes of the whole one, with the same frequencies and parities, orthonormal in its mass and
/// with small residuals: of free torsion, of springs that act, of the axle and of pairs that it does not couple.
#[test]
fn half_sections_have_the_modes_of_the_whole() {
    let stiffness = [9e6, 5e6, 1e6];
    for (n, mirrored) in [(0, false), (1, true), (2, true), (5, false)] {
        let (forms, mirror) = wheelset(mirrored, [(-1.0, stiffness), (1.0, stiffness)]);
        let halves = HalfSections::new(&forms, &mirror).unwrap();
        let limit = 2.0 * PI * 4000.0;
        let mut whole = of_order(&forms, n, limit).unwrap();
        let parity = mirror.separate(&forms, &mut whole);
        let (found, own) = halves.of_order(&forms, n, limit).unwrap();
        let counts = halves.below(n, limit).unwrap();
        assert_eq!((found.omega.len(), counts[0] + counts[1]), (whole.omega.len(), whole.omega.len()));
        assert_eq!(counts[0], parity.iter().filter(|p| **p > 0.0).count(), "{n}");
        assert!(found.omega.len() > 5 && found.omega.windows(2).all(|w| w[0] <= w[1]), "{n}: {:?}", found.omega);
        for (omega, sign) in whole.omega.iter().zip(&parity) {
            let same = |(w, p): (&f64, &f64)| (w - omega).abs() <= 1e-8 * omega && (p - sign).abs() < 1e-6;
            assert_eq!(found.omega.iter().zip(&own).filter(|at| same(*at)).count(), 1, "{n}: {omega} {sign}");
        }
        let mass = forms.mass(n, found.vectors.as_ref());
        let gram = found.vectors.transpose() * &mass;
        let off = Mat::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] - f64::from(u8::from(i == j)));
        assert!(off.norm_max() < 1e-9, "{n}: {:e}", off.norm_max());
        let stiff = forms.dynamic(n, 0.0, found.vectors.as_ref());
        for (k, omega) in found.omega.iter().enumerate() {
            let left = stiff.col(k) - faer::Scale(omega * omega) * mass.col(k);
            let size = (omega * omega - forms.shift()) * mass.col(k).norm_l2();
            assert!(left.norm_l2() < 1e-4 * size && found.residual[k] < 1e-4, "{n} {k}: {:e}", left.norm_l2() / size);
        }
    }
}

/// Halves of mirror images are taken, others not: springs or places of the bearings that differ, one in the middle,
/// an edge clamped on one side.
#[test]
fn bodies_that_are_no_mirror_images_have_no_half_sections() {
    let (soft, stiff) = ([1e6; 3], [1e6, 1e6, 2e6]);
    let halves = |bearings| {
        let (forms, mirror) = wheelset(false, bearings);
        HalfSections::new(&forms, &mirror).is_some()
    };
    assert!(halves([(-1.0, soft), (1.0, soft)]) && halves([(-0.95, stiff), (0.95, stiff)]));
    assert!(!halves([(-1.0, soft), (1.0, stiff)]) && !halves([(-1.0, soft), (0.9, soft)]));
    assert!(!halves([(-1.0, soft), (0.0, soft)]));
    let (forms, mirror) = wheelset(false, [(-1.0, soft), (1.0, soft)]);
    let mut section = forms.section.clone();
    let held = |section: CrossSection| Forms::new(section, STEEL_OF_WHEELS, &[SEATS.into()]).unwrap();
    assert!(HalfSections::new(&held(section.clone()), &mirror).is_some());
    let nodes = section.nodes.clone();
    section.groups.get_mut(SEATS).unwrap().retain(|&k| nodes[k][1] < 0.75);
    assert!(HalfSections::new(&held(section), &mirror).is_none());
}
