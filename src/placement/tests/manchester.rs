//! The Manchester contact benchmark, case A-2.2 (S1002 on UIC 60 of 1:40, gauge 1435 mm at 14 mm, flanges 1360 mm
//! apart back to back, R = 460 mm), computed with CONTACT (github eve70a/CONTACT, Apache-2.0):
//! `manchester_a22_sample.csv`, lengths in mm, forces in N.
//!
//! The benchmark's rail is no 60E1: its arcs of 300 and 80 mm meet 21 mm apart, those of 80 and 13 mm 51.976 mm apart
//! (fitted to its points within 0.02 µm), where EN 13674-1 has 20.456 and 52.053 mm.

use super::super::builtin::{rail_head, s1002};
use super::super::*;
use std::collections::HashMap;

type Row = HashMap<String, f64>;

fn rows() -> Vec<(RailSide, Row)> {
    let mut lines = include_str!("manchester_a22_sample.csv").lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let read = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let side = if cells[0] == "left" { RailSide::Left } else { RailSide::Right };
        (side, names.iter().zip(&cells).skip(1).map(|(n, c)| (n.to_string(), c.parse().unwrap())).collect())
    };
    lines.map(read).collect()
}

fn place(side: RailSide, row: &Row) -> PlacedWheel {
    let rail = rail_head("UIC60", &[300e-3, 80e-3, 13e-3], &[21e-3, 51.976e-3], 20.0).unwrap();
    let position = Position::Shift { lateral: 1e-3 * row["y_ws"], yaw: row["yaw"], roll: row["roll"] };
    let placement = WheelPlacement {
        side,
        gauge: 1.435,
        gauge_depth: 0.014,
        cant: 0.025_f64.atan(),
        radius: 0.46,
        circles: 1.5,
        position,
        near: None,
    };
    placement.place(&s1002().unwrap(), &rail).unwrap()
}

/// Contact modulus of two bodies of G = 82 GPa, ν = 0.28, Pa.
const MODULUS: f64 = 82e9 / (1.0 - 0.28);

/// The approach in CONTACT is how far its wheel, loaded, is below ours at first touch. Both are printed to 0.1 µm.
#[test]
fn the_approach_is_that_of_contact() {
    for (side, row) in rows() {
        let placed = place(side, &row);
        let lowered = 1e-3 * row["z_ws"] - placed.wheelset()[2];
        let approach = lowered * placed.touch().angle.cos();
        let error = approach - 1e-3 * row["approach"];
        assert!(error.abs() < 0.1e-6, "{side:?} {}: {approach} {}", row["case"], row["approach"]);
    }
}

/// CONTACT puts its frame in the middle of the overlap; it finds it on a grid of 0.2 mm.
#[test]
fn the_centre_of_the_contact_is_that_of_contact() {
    for (side, row) in rows() {
        let frame = place(side, &row).centred_frame(1e-3 * row["approach"]).unwrap();
        for (found, name) in frame.origin().iter().zip(["x_tr", "y_tr", "z_tr"]) {
            assert!(
                (found - 1e-3 * row[name]).abs() < 1.2e-6,
                "{side:?} {} {name}: {found} {}",
                row["case"],
                row[name]
            );
        }
        assert!((frame.angle() - row["delta"]).abs() < 0.6e-4, "{side:?} {}: {}", row["case"], frame.angle());
    }
}

/// Creepages beside CONTACT's, whose x points forwards and whose normal points down: ξ and φ have the other sign,
/// forces along x as well.
#[test]
fn creepages_are_those_of_contact() {
    for (side, row) in rows() {
        let placed = place(side, &row);
        let frame = placed.centred_frame(1e-3 * row["approach"]).unwrap();
        let motion = RollingMotion { angular_speed: Some(-row["vpitch"]), ..RollingMotion::free_rolling(2.0) };
        let found = placed.creepages(&frame, &motion).unwrap();
        // Four digits are printed; 1 µm of rolling radius, by which CONTACT's point is deeper, is 2e-6 of ξ.
        for (value, want, slack) in [
            (-found.longitudinal, row["cksi"], 2e-6),
            (found.lateral, row["ceta"], 1e-8),
            (-1e-3 * found.spin, row["cphi"], 1e-9),
        ] {
            assert!((value - want).abs() < slack + 5e-4 * want.abs(), "{side:?} {}: {value} {want}", row["case"]);
        }
    }
}

/// The rolling radius: the wheel's circles through CONTACT's points. The point (y_w, z_w) is below the undeformed
/// wheel by what the wheel gives way.
#[test]
fn rolling_radii_are_those_of_contact() {
    let wheel = s1002().unwrap();
    for (side, row) in rows() {
        let placed = place(side, &row);
        let touch = placed.touch();
        assert!((touch.radius - 0.46 - wheel.local(touch.wheel).z).abs() < 1e-15);
        // At the centre of the overlap, in CONTACT's coordinates.
        let (y, z) = (side.sign() * 1e-3 * row["y_w"], 1e-3 * row["z_w"]);
        let deeper = wheel.local(y).z - z;
        assert!(deeper > -1e-6 && deeper < 1.2e-3 * row["approach"], "{side:?} {}: {deeper}", row["case"]);
    }
}

/// Pressures and forces are Hertz' where the curvatures are nearly the same all over the contact: on the cone outside
/// the running circle.
#[test]
fn hertz_is_near_where_curvatures_are_even() {
    for (side, row) in rows().into_iter().filter(|(s, r)| *s == RailSide::Left && r["case"] > 12.0) {
        let ellipse = place(side, &row).ellipse(MODULUS, HertzLoad::Approach(1e-3 * row["approach"])).unwrap();
        assert!((ellipse.force / row["fn"] - 1.0).abs() < 2e-3, "{} {}", ellipse.force, row["fn"]);
        assert!((ellipse.pressure / (1e6 * row["pmax"]) - 1.0).abs() < 3e-3, "{} {}", ellipse.pressure, row["pmax"]);
    }
}

/// In the middle of the track the tread touches in two places at once.
#[test]
fn the_second_place_is_reported() {
    let (side, row) = rows().swap_remove(0);
    let placed = place(side, &row);
    let others = placed.others(1e-3 * row["approach"]).unwrap();
    assert_eq!(others.len(), 1);
    assert!((others[0].gap - 8.15e-6).abs() < 0.05e-6 && !others[0].separate, "{:?}", others[0]);
    assert!(placed.others(8e-6).unwrap().is_empty());
}
