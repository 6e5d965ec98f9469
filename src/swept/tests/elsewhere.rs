//! Sections that are touched elsewhere: their modes are those found at another place, in another frame.

use super::straight::{pads, RAIL_STEEL};
use super::*;
use crate::swept::modes::contact_functions;
use crate::swept::waves::RailMode;

const PERIOD: f64 = 14.0;

fn rail(y: f64) -> (BuiltRail, Forms) {
    let rail = BuiltRail::new(&R60E1, y).unwrap();
    let angle = rail.contact().angle;
    (rail, Forms::along(rail.for_modes().unwrap(), RAIL_STEEL, PERIOD, Some(&pads()), angle).unwrap())
}

/// The waves of a rail touched at one place, turned to the frame of another one, are those that are found there, and
/// the contact sees them as it does those.
#[test]
fn waves_of_a_rail_serve_wherever_it_is_touched() {
    let ((here, forms), (there, other)) = (rail(-0.004), rail(0.013));
    let angle = there.contact().angle - here.contact().angle;
    assert!(angle < -0.04 && forms.is_elsewhere(&other, angle) && other.is_elsewhere(&forms, -angle));
    assert!(!forms.is_elsewhere(&other, -angle) && !forms.is_elsewhere(&other, angle + 1e-9));
    let patch = LoadPatch::Circle { radius: 5e-3 };
    for n in [0, 1, 7, 30] {
        let limit = 2.0 * PI * 2500.0;
        let rotated = RailMode::new(&forms, of_order(&forms, n, limit).unwrap(), &[]).rotated(angle);
        let line = LineLoad::new(&other, patch, n, PERIOD / (2.0 * PI));
        let lines = [line];
        let own = RailMode::new(&other, of_order(&other, n, limit).unwrap(), &lines);
        assert!(!own.omega.is_empty() && own.omega.len() == rotated.omega.len(), "{n}");
        let contact = contact_functions(rotated.vectors.as_ref(), &lines);
        for k in 0..own.omega.len() {
            assert!((rotated.omega[k] / own.omega[k] - 1.0).abs() < 1e-9, "{n} {k}");
            let (here, there) = (contact.col(k), own.contact.col(k));
            let product: f64 = here.transpose() * there;
            let off = (0..LOADS).map(|c| (here[c] - product.signum() * there[c]).abs());
            assert!(off.fold(0.0, f64::max) < 1e-6 * there.norm_max(), "{n} {k}: {here:?} {there:?}");
        }
    }
}

/// The wheel has one mesh for its modes wherever it is touched, and another one from the other side; that of a
/// cylinder has a line at the contact.
#[test]
fn meshes_that_move_are_told_from_those_that_change() {
    let steel = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
    let wheel = |offset: f64, mirrored: bool| {
        let section = SectionSource::Wheel(Wheel { mirrored, ..Wheel::w920s(offset) }).for_modes().unwrap();
        clamped(section, steel)
    };
    assert!(wheel(0.004, true).is_elsewhere(&wheel(-0.011, true), 0.0));
    assert!(!wheel(0.004, true).is_elsewhere(&wheel(0.004, false), 0.0));
    let lighter = ElasticMaterial { density: 7800.0, ..steel };
    let section = SectionSource::Wheel(Wheel { mirrored: true, ..Wheel::w920s(0.0) }).for_modes().unwrap();
    assert!(!wheel(0.004, true).is_elsewhere(&clamped(section, lighter), 0.0));
    let ring = |offset: f64| clamped(cylinder(&annulus(None, offset), COARSE).unwrap(), STEEL);
    assert!(ring(0.01).is_elsewhere(&ring(0.01), 0.0) && !ring(0.01).is_elsewhere(&ring(0.03), 0.0));
}
