//! Contacts on the gauge corner of a rail: the compliance there is a smooth function of the place, and left and right
//! are mirror images.

use railsqueal::fem::ElasticMaterial;
use railsqueal::rails::R60E1;
use railsqueal::swept::compliance::{pair_of, sum};
use railsqueal::swept::{rotate_loads, BuiltRail, Constant, Forms, LoadPatch, RailTrack, Square, TrackLayer};
use std::f64::consts::PI;

const STEEL: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
const PERIOD: f64 = 14.0;
const RADIUS: f64 = 2.5e-3;

fn pads() -> RailTrack {
    RailTrack { pad: TrackLayer::with_loss([200e6, 66.7e6, 66.7e6], 0.2, 60.2), sleeper: None }
}

/// Compliance that a rail adds to the half-space under loads on a disc, in the frame of its surface at the contact,
/// with orders up to `last`.
fn constant(rail: &BuiltRail, last: Option<usize>) -> Square {
    let patch = LoadPatch::Circle { radius: RADIUS };
    let section = rail.for_loads(RADIUS).expect("a section");
    let forms = Forms::along(section, STEEL, PERIOD, Some(&pads()), rail.contact().angle).expect("forms");
    let mut constant = Constant::new(&forms, &[patch], PERIOD / (2.0 * PI)).expect("a running line");
    if let Some(last) = last {
        constant = constant.up_to(last);
    }
    let blocks = (0..constant.blocks.len()).map(|k| constant.block(k, &mut Vec::new()).expect("statics"));
    pair_of(sum(blocks.chain([constant.singles()]))[0].as_ref(), [0, 0])
}

/// The rail touched where its surface has the angle `angle`, rad, on the right of the crown if positive.
fn at_angle(angle: f64) -> BuiltRail {
    let head = &R60E1.head;
    let place = head.point(angle.signum() * head.to_angle(angle.abs()));
    BuiltRail::near(&R60E1, [place.y, place.z - head.height]).expect("a place on the head")
}

/// Components (x, y, n) of the middle of the contact in the frame of the upright section.
fn upright(rail: &BuiltRail, square: &Square) -> [[f64; 3]; 3] {
    let rows = square.map(|row| rotate_loads(row, -rail.contact().angle));
    std::array::from_fn(|j| {
        let column = rotate_loads(std::array::from_fn(|i| rows[i][j]), -rail.contact().angle);
        [column[0], column[1], column[2]]
    })
}

/// Components of the middle of the contact at an angle, upright.
fn middle(angle: f64) -> [f64; 4] {
    let rail = at_angle(angle);
    let u = upright(&rail, &constant(&rail, None));
    [u[0][0], u[1][1], u[2][2], u[1][2]]
}

/// Largest difference of two sets of components, over the first.
fn apart(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max)
}

/// On either side of where the mesh changes, 0.4 rad, and of 0.87 rad, up to which a contact was allowed before.
#[test]
fn compliance_is_continuous_along_the_head() {
    let change = apart(middle(0.399), middle(0.401));
    let corner = apart(middle(0.86), middle(0.88));
    assert!(change < 3e-3, "where the mesh changes: {change:e}");
    assert!(corner < 6e-3, "0.02 rad at the corner: {corner:e}");
}

/// Components that are odd in y change their sign, all others are equal to rounding.
#[test]
fn the_left_corner_mirrors_the_right_one() {
    let [right, left] = [1.0, -1.0].map(|angle| constant(&at_angle(angle), None));
    // Loads 3m + c: along y, or with the factor y.
    let odd = |k: usize| (k % 3 == 1) != (k / 3 == 2);
    for (i, row) in right.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let mirrored = if odd(i) == odd(j) { left[i][j] } else { -left[i][j] };
            let size = (right[i][i] * right[j][j]).abs().sqrt();
            assert!((value - mirrored).abs() < 1e-8 * size, "{i} {j}: {value:e} {mirrored:e}");
        }
    }
}

/// More orders than the distance to the end of the running line asks for change little on the arc of 13 mm.
#[test]
fn orders_suffice_on_the_corner() {
    let rail = at_angle(1.25);
    let [usual, many] = [None, Some(4000)].map(|last| constant(&rail, last));
    for k in 0..3 {
        assert!((usual[k][k] / many[k][k] - 1.0).abs() < 5e-3, "{k}: {:e} {:e}", usual[k][k], many[k][k]);
    }
}
