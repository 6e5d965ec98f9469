//! Sections of all built-in rails against published figures.

use super::super::*;
use super::straight::RAIL_STEEL;
use crate::rails::{Rail, ALL, R115RE, R49E1, R54E1, R54E3, R60E1, R60E2};

fn measures(rail: &'static Rail) -> Measures {
    BuiltRail::new(rail, 0.0).and_then(|rail| rail.for_modes()).unwrap().measures()
}

/// Area, mass at 7850 kg/m³ and both second moments to 0.3 %, 60E1, whose outline is another's, to 0.5 %.
#[test]
fn the_rails_have_their_published_measures() {
    for rail in ALL {
        let (found, said) = (measures(rail), rail.published);
        let pairs = [
            (found.area, said.area),
            (7850.0 * found.area, said.mass),
            (found.inertia[0], said.inertia[0]),
            (found.inertia[1], said.inertia[1]),
        ];
        let most = if rail == &R60E1 { 5e-3 } else { 3e-3 };
        for (found, said) in pairs {
            assert!((found / said - 1.0).abs() < most, "{}: {found:e} {said:e} {:.5}", rail.name, found / said);
        }
    }
}

/// Heights of the neutral axis of British Steel's data sheet, 75.1, 80.9 and 80.7 mm, and of AREMA's 115RE, 2.99 inch.
#[test]
fn the_centroids_lie_where_they_are_said() {
    for (rail, height) in [(&R54E1, 75.1e-3), (&R60E1, 80.9e-3), (&R60E2, 80.7e-3), (&R115RE, 75.95e-3)] {
        let found = measures(rail).centroid;
        assert!((found - height).abs() < 0.2e-3, "{}: {found}", rail.name);
    }
}

/// Meshes are sound for contacts anywhere on the head, and the outline closes: their area does not depend on the
/// contact.
#[test]
fn the_rails_are_meshed_wherever_they_are_touched() {
    for rail in ALL {
        let area = measures(rail).area;
        let deepest = rail.head.to_deepest();
        for part in [-0.98, -0.7, -0.3, 0.0, 0.4, 0.8, 0.95] {
            let at = rail.head.point(part * deepest);
            let built = BuiltRail::near(rail, [at.y, at.z - rail.head.height]).unwrap();
            for section in [built.for_modes().unwrap(), built.for_loads(4e-3).unwrap()] {
                assert!((section.area() / area - 1.0).abs() < 1e-3, "{} {part}: {:e}", rail.name, section.area());
                assert!(!section.groups["foot"].is_empty() && !section.groups["head"].is_empty());
            }
        }
    }
}

/// Rails without published shear parts are beams with the published area and second moments, and with the part that
/// shears of their outlines: 0.39 to 0.42 vertically and 0.84 to 0.91 laterally in slices of the fine outlines.
#[test]
fn beams_shear_as_their_outlines_do() {
    for rail in [&R49E1, &R54E1, &R54E3, &R60E2, &R115RE] {
        let said = rail.published;
        let built = super::super::PlacedRailSection::Built(BuiltRail::new(rail, 0.02).unwrap());
        for (lateral, shears) in [(false, 0.37..0.44), (true, 0.80..0.96)] {
            let beam = built.beam(RAIL_STEEL, lateral, 0.0).unwrap();
            assert_eq!([beam.area, beam.inertia], [said.area, said.inertia[usize::from(lateral)]]);
            assert!(shears.contains(&beam.sheared), "{}: {beam:?}", rail.name);
        }
    }
}
