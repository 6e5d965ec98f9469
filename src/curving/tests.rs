use super::*;
use crate::friction::{FrictionLaw, FrictionZone, ZoneRail};
use crate::placement::builtin::{rail_60e1, rail_head, s1002};
use crate::placement::profile::{ProfilePiece, RunningProfile};
use crate::placement::{Position, RailSide, WheelPlacement};

fn track(side: RailSide, gauge: f64, gauge_depth: f64, cant: f64) -> WheelPlacement {
    WheelPlacement {
        side,
        gauge,
        gauge_depth,
        cant,
        radius: 0.46,
        circles: 1.5,
        position: Position::Shift { lateral: 0.0, yaw: 0.0, roll: 0.0 },
        near: None,
    }
}

/// A bogie with the wheelbase 2.5 m, 10 and 5 MN/m a box, 1 m from the middle, 120 kN an axle.
fn bogie() -> BogieData {
    BogieData {
        half_wheelbase: 1.25,
        axle_load: 120e3,
        wheel_radius: 0.46,
        half_circles: 0.75,
        primary: [10e6, 5e6],
        half_boxes: 1.0,
        yaw_stiffness: 0.0,
        secondary_moment: 0.0,
        torque: [0.0; 2],
        mass_height: 0.46,
    }
}

fn on_rails(rail: &RunningProfile, radius: f64, friction: f64) -> CurvingProblem {
    let wheel = s1002().unwrap();
    let over = |side| MovableWheel::new(&track(side, 1.435, 0.014, 0.025_f64.atan()), &wheel, rail).unwrap();
    CurvingProblem {
        wheels: [RailSide::Left, RailSide::Right].map(over),
        materials: [(210e9, 0.3); 2],
        friction: FrictionLaw::Constant(friction).into(),
        law: CreepLaw::ShenHedrickElkins,
        bogie: bogie(),
        curve: CurveMotion { curvature: 1.0 / radius, speed: 10.0, deficiency: 0.0 },
    }
}

/// S1002 on 60E1 1:40 in a curve to the right.
fn problem(radius: f64, friction: f64) -> CurvingProblem {
    on_rails(&rail_60e1().unwrap(), radius, friction)
}

/// Distance of the contact from the middle of a head, m: the head of 300 mm has the slope 0.05 of the cone there, on
/// the side of the gauge.
const OFF_CROWN: f64 = 0.015;

/// Wheelsets with cones of the conicity 0.05 on heads of a radius of 300 mm, 1.5 m apart.
fn cones(radius: f64) -> CurvingProblem {
    let wheel =
        RunningProfile::new("cone", vec![-0.05, 0.05], vec![ProfilePiece::line([-0.05, 0.0025], [0.05, -0.0025])])
            .unwrap();
    let head = ProfilePiece::Arc { centre: [0.0, 0.3], radius: -0.3 };
    let rail = RunningProfile::new("head", vec![-0.04, 0.04], vec![head]).unwrap();
    // 1 mm down the head is this far from its middle.
    let side = (0.3_f64 * 0.3 - 0.299 * 0.299).sqrt();
    let over = |side_of| MovableWheel::new(&track(side_of, 1.5 - 2.0 * side, 1e-3, 0.0), &wheel, &rail).unwrap();
    let wheels = [RailSide::Left, RailSide::Right].map(over);
    let mut problem = CurvingProblem { wheels, ..problem(radius, 0.35) };
    problem.bogie.primary = [0.0; 2];
    problem
}

/// A free wheelset rolls without creep where the radii of its wheels are in the ratio of the ways on both rails: the
/// shift of the axle is −(l0 r0/(λR)) (1 − λ(r0 + R_h)/l0), as the familiar l0 r0/(λR) is that at the rail and the axle
/// rolls back by λ y (r0 + R_h)/l0; l0 and r0 are those of the places of contact.
#[test]
fn free_wheelset_on_cones_matches_closed_form() {
    let problem = cones(2000.0);
    let solution = problem.solve().unwrap();
    let (half, radius) = (0.75 - OFF_CROWN, 0.46 + 0.05 * OFF_CROWN);
    let familiar: f64 = -half * radius / (0.05 * 2000.0);
    let corrected = familiar * (1.0 - 0.05 * (radius + 0.3) / half);
    for axle in &solution.axles {
        let found = axle.motion.lateral;
        assert!((found / corrected - 1.0).abs() < 3e-3, "{found} against {corrected}, familiar {familiar}");
        assert!(axle.motion.yaw.abs() < 1e-6);
        for contact in axle.wheels.iter().flatten() {
            assert!(contact.creepage[0].abs() < 1e-6, "{:?}", contact.creepage);
        }
    }
}

/// Axles that the frame holds without give stand at −b/R and +b/R from its own direction, and across as it lies.
#[test]
fn rigid_bogie_keeps_its_axles_parallel() {
    let mut problem = problem(300.0, 0.35);
    problem.bogie.primary = [1e10; 2];
    let solution = problem.solve().unwrap();
    let [a, b] = [solution.axles[0].motion, solution.axles[1].motion];
    let angle = -2.5 / 300.0;
    assert!(((a.yaw - b.yaw) / angle - 1.0).abs() < 5e-4, "{} {}", a.yaw, b.yaw);
    assert!((a.lateral - b.lateral - 2.5 * solution.frame[1]).abs() < 1e-6);
}

/// The sums of the equations of the front page, from the numbers of the solution alone.
#[test]
fn forces_and_moments_are_balanced() {
    for radius in [1500.0, 600.0, 300.0, 150.0] {
        let mut problem = problem(radius, 0.4);
        problem.bogie.torque = [800.0, -500.0];
        problem.bogie.secondary_moment = 2e3;
        problem.bogie.yaw_stiffness = 1e6;
        problem.bogie.mass_height = 1.4;
        problem.curve.deficiency = 0.03;
        let solution = problem.solve().unwrap();
        let (w, side) = (120e3, -120e3 * 0.03);
        let mut frame = [0.0; 2];
        for (k, axle) in solution.axles.iter().enumerate() {
            let all: Vec<&ContactForce> = axle.wheels.iter().flatten().collect();
            let sum = |of: &dyn Fn(&ContactForce) -> f64| all.iter().map(|c| of(c)).sum::<f64>();
            let [force, moment] = axle.suspension;
            let vertical = sum(&|c| c.vertical()) + w;
            let lateral = sum(&|c| c.lateral()) + force + side;
            let roll = sum(&|c| c.place.arm[1] * c.vertical() - c.place.radius * c.lateral()) + side * (1.4 - 0.46);
            let yaw = sum(&|c| c.place.arm[0] * c.lateral() - c.place.arm[1] * c.longitudinal) + moment;
            let torque =
                sum(&|c| c.place.radius * (c.longitudinal + c.tangential * axle.motion.yaw / c.place.angle.cos()));
            for (what, left) in [
                ("vertical", vertical),
                ("lateral", lateral),
                ("roll", roll),
                ("yaw", yaw),
                ("torque", torque - problem.bogie.torque[k]),
            ] {
                assert!(left.abs() < 1e-6 * w, "R {radius}, axle {k}: {what} {left}");
            }
            let s = [1.0, -1.0][k];
            frame[0] += force;
            frame[1] += s * 1.25 * force + moment;
        }
        assert!(frame[0].abs() < 1e-6 * w && (frame[1] - 2e3).abs() < 1e-6 * w, "{frame:?}");
        assert!(solution.residual < 1e-6);
    }
}

#[test]
fn mirrored_curve_has_mirrored_solution() {
    let right = problem(400.0, 0.35);
    let mut left = right.clone();
    left.curve.curvature = -right.curve.curvature;
    let (a, b) = (right.solve().unwrap(), left.solve().unwrap());
    for wheel in WHEELS {
        let (p, q) = (a.wheel(&right, wheel), b.wheel(&left, wheel));
        assert_eq!(p.len(), q.len());
        for (p, q) in p.iter().zip(q) {
            assert!((p.normal / q.normal - 1.0).abs() < 1e-6, "{} {}", p.normal, q.normal);
            assert!((p.creepage[0] - q.creepage[0]).abs() < 1e-8 && (p.creepage[1] + q.creepage[1]).abs() < 1e-8);
            assert!((p.creepage[2] + q.creepage[2]).abs() < 1e-6 && (p.place.angle + q.place.angle).abs() < 1e-6);
        }
    }
}

#[test]
fn very_wide_curve_is_straight_track() {
    let problem = problem(1e8, 0.35);
    let solution = problem.solve().unwrap();
    for axle in &solution.axles {
        assert!(axle.motion.lateral.abs() < 2e-6 && axle.motion.yaw.abs() < 1e-6, "{:?}", axle.motion);
        let load = |k: usize| axle.wheels[k].iter().map(|c| c.normal * c.place.angle.cos()).sum::<f64>();
        assert!((load(0) / load(1) - 1.0).abs() < 1e-3);
    }
}

/// Columns of a wheel: position on its profile, mm, contact angle, mrad, rolling radius, mm, normal force, kN, ξ and η,
/// %, F_x, T and lateral force on the wheel, kN.
fn columns(c: &ContactForce) -> [f64; 9] {
    [
        1e3 * c.place.wheel,
        1e3 * c.place.angle,
        1e3 * c.place.radius,
        1e-3 * c.normal,
        1e2 * c.creepage[0],
        1e2 * c.creepage[1],
        1e-3 * c.longitudinal,
        1e-3 * c.tangential,
        1e-3 * c.lateral(),
    ]
}

/// A table of an independent program for this bogie on a head whose arcs meet 20.8 and 52.0 mm apart: within 2 % and
/// the last digit that is printed.
#[test]
fn published_example_is_met() {
    let rail = rail_head("arcs", &[300e-3, 80e-3, 13e-3], &[20.8e-3, 52.0e-3], 20.0).unwrap();
    let problem = on_rails(&rail, 600.0, 0.35);
    let solution = problem.solve().unwrap();
    let axles = [[-5.894, -2.533], [-1.221, 0.253]];
    for (axle, want) in solution.axles.iter().zip(axles) {
        let found = [1e3 * axle.motion.lateral, 1e3 * axle.motion.yaw];
        (0..2).for_each(|k| assert!((found[k] - want[k]).abs() < 0.02 * want[k].abs(), "{found:?} {want:?}"));
    }
    let table = [
        [14.3, -8.0, 459.75, 59.9, 0.240, -0.253, -13.7, -12.9, -13.4],
        [-30.8, 394.0, 464.22, 58.8, -0.480, -0.274, 13.5, -15.5, 8.3],
        [7.1, -16.0, 459.83, 57.7, -0.048, 0.025, 5.0, 2.8, 1.9],
        [-9.6, 72.0, 460.49, 62.3, 0.058, 0.025, -4.9, -1.3, 3.2],
    ];
    let digit = [0.05, 0.5, 0.005, 0.05, 5e-4, 5e-4, 0.05, 0.05, 0.05];
    for (wheel, want) in WHEELS.iter().zip(table) {
        let places = solution.wheel(&problem, *wheel);
        assert_eq!(places.len(), 1);
        let found = columns(&places[0]);
        for k in 0..9 {
            let allowed = 0.02 * f64::abs(want[k]) + digit[k];
            assert!((found[k] - want[k]).abs() < allowed, "{}, column {k}: {found:?} {want:?}", wheel.name());
        }
    }
}

/// The flange of the leading outer wheel takes more load the tighter the curve, and its contact moves up the flange.
#[test]
fn flange_contact_grows_as_the_curve_becomes_tighter() {
    let outer = BogieWheel { leading: true, inner: false };
    let mut before = (0.0, 0.0);
    for radius in [600.0, 525.0, 450.0, 400.0, 360.0, 330.0, 300.0] {
        let problem = problem(radius, 0.35);
        let solution = problem.solve().unwrap();
        let places = solution.wheel(&problem, outer);
        let steepest = places.iter().map(|c| c.place.angle).fold(0.0, f64::max);
        let sideways: f64 = places.iter().map(|c| c.normal * c.place.angle.sin()).sum();
        assert!(steepest > before.0 && sideways > before.1, "R {radius}: {steepest} {sideways}, before {before:?}");
        before = (steepest, sideways);
    }
}

/// The laws differ by some per cent of the bound of friction: so do the positions.
#[test]
fn creep_laws_agree_on_the_position() {
    let solve = |law: CreepLaw| {
        let mut problem = problem(400.0, 0.35);
        problem.law = law;
        problem.solve().unwrap()
    };
    let reference = solve(CreepLaw::ShenHedrickElkins);
    for law in [CreepLaw::Polach, CreepLaw::Fastsim] {
        let found = solve(law);
        assert!(found.residual < 1e-6);
        for (a, b) in found.axles.iter().zip(&reference.axles) {
            assert!((a.motion.lateral - b.motion.lateral).abs() < 0.7e-3, "{law:?}: {:?} {:?}", a.motion, b.motion);
            assert!((a.motion.yaw - b.motion.yaw).abs() < 0.7e-3, "{law:?}: {:?} {:?}", a.motion, b.motion);
        }
        let differs = (found.axles[0].motion.yaw - reference.axles[0].motion.yaw).abs();
        assert!(differs > 1e-7, "{law:?} is not used");
    }
}

fn refused(problem: &CurvingProblem, parts: &[&str]) {
    let error = problem.solve().expect_err("a curve that cannot be run through");
    let text = error.to_string();
    assert!(error.exit_code() == 2, "{text}");
    parts.iter().for_each(|part| assert!(text.contains(part), "{part}: {text}"));
}

#[test]
fn curves_that_cannot_be_run_through_are_refused() {
    // Beyond Nadal's limit, or on the tip of the flange.
    let mut climbing = problem(150.0, 0.9);
    climbing.curve.deficiency = 0.1;
    refused(&climbing, &["the left wheel of the leading axle", "flange"]);
    let mut tipping = problem(300.0, 0.35);
    tipping.bogie.mass_height = 3.0;
    tipping.curve.deficiency = 0.5;
    refused(&tipping, &["curve.cant_deficiency", "tips over", "centre_of_gravity"]);
    let mut long = problem(20.0, 0.35);
    long.bogie.half_wheelbase = 2.0;
    refused(&long, &["flange", "wider curve"]);
    let narrow = |side| {
        let track = track(side, 1.415, 0.014, 0.025_f64.atan());
        MovableWheel::new(&track, &s1002().unwrap(), &rail_60e1().unwrap()).unwrap()
    };
    let mut narrow_gauge = problem(600.0, 0.35);
    narrow_gauge.wheels = [RailSide::Left, RailSide::Right].map(narrow);
    refused(&narrow_gauge, &["curve.gauge", "flange"]);
}

/// Number in a row of `docs/data/curving_bogie.csv` by the name of its column, without the unit.
fn cell(names: &[&str], row: &[&str], name: &str) -> f64 {
    let column = names.iter().position(|n| n.split(' ').next() == Some(name)).unwrap();
    row[column].parse().unwrap()
}

/// Differences that a table may have beside 0.5 % of its values.
struct Allowed {
    /// Yaw of an axle, mrad, and lateral creepage, 1e-3.
    yaw: f64,
    /// Longitudinal creepage, 1e-3.
    longitudinal: f64,
    /// Longitudinal force, kN.
    force: f64,
    /// True if the creepages of the table have terms of second order in yaw, creepage and the width of the track over
    /// its radius.
    second_order: bool,
}

/// Creepages of a place with their terms of second order: ξ + (Ωr/V)(1 − cos θ cos ψ), as the material at the contact,
/// which is the angle θ ahead, sin θ = tan χ tan ψ, moves down as well, and η Ωr/V − x cos δ/R; Ωr/V is 1 − ξ − y/R.
fn second_order(place: &ContactForce, motion: AxleMotion, curvature: f64) -> [f64; 2] {
    let [longitudinal, lateral, _] = place.creepage;
    let rolling = 1.0 - longitudinal - place.place.across * curvature;
    let ahead = ((place.place.angle - motion.roll).tan() * motion.yaw.tan()).asin();
    let turned = place.place.arm[0] * curvature * place.place.angle.cos();
    [longitudinal + rolling * (1.0 - ahead.cos() * motion.yaw.cos()), lateral * rolling - turned]
}

/// Compares all places of contact in the rows of a table with those of the program, at the radii and coefficients of
/// friction of `cases`; returns how many there are.
fn compare_table(table: &str, cases: &[(f64, f64)], allowed: &Allowed) -> usize {
    let mut lines = table.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    let mut compared = 0;
    for &(radius, friction) in cases {
        let problem = problem(radius, friction);
        let solution = problem.solve().unwrap();
        let here = |r: &&Vec<&str>| cell(&names, r, "radius") == radius && cell(&names, r, "friction") == friction;
        for row in rows.iter().filter(here) {
            let axle = &solution.axles[cell(&names, row, "axle") as usize - 1];
            let side = row[names.iter().position(|n| n.starts_with("wheel [")).unwrap()];
            let wheel_y = 1e-3 * cell(&names, row, "wheel_y");
            let places = &axle.wheels[usize::from(side == "right")];
            let place = places.iter().find(|c| (c.place.wheel - wheel_y).abs() < 0.2e-3);
            let place = place.unwrap_or_else(|| panic!("R {radius}: no place at {wheel_y} m of {side} of {places:?}"));
            let [longitudinal, lateral] = match allowed.second_order {
                true => second_order(place, axle.motion, 1.0 / radius),
                false => [place.creepage[0], place.creepage[1]],
            };
            let part_of_yaw = if allowed.second_order { 5e-3 } else { 0.0 };
            // Name, value, and what is allowed beside a part of the value, and that part. Both programs average the
            // curvature across in ways of their own, which moves the flange root by 0.05 mm: a radius by 0.013 mm, ξ
            // by 0.003 %.
            let found = [
                ("y", 1e3 * axle.motion.lateral, 2e-3, 0.0),
                ("yaw", 1e3 * axle.motion.yaw, allowed.yaw, part_of_yaw),
                ("delta", 1e3 * place.place.angle, 0.5, 5e-3),
                ("r", 1e3 * place.place.radius, 0.02, 0.0),
                ("N", 1e-3 * place.normal, 0.1, 5e-3),
                ("xi", 1e3 * longitudinal, allowed.longitudinal, 5e-3),
                ("eta", 1e3 * lateral, allowed.yaw + 3e-3, 5e-3),
                ("phi", place.creepage[2], 1e-3, 5e-3),
                ("Fx", 1e-3 * place.longitudinal, allowed.force, 5e-3),
                ("T", 1e-3 * place.tangential, 0.1, 5e-3),
                ("F_lateral", 1e-3 * place.lateral(), 0.1, 5e-3),
            ];
            for (name, value, digit, part) in found {
                let want = cell(&names, row, name);
                assert!(
                    (value - want).abs() < part * want.abs() + digit,
                    "R {radius}, {side} at {wheel_y} m, {name}: {value} against {want}"
                );
            }
            compared += 1;
        }
    }
    compared
}

/// All places of contact of an independent program with contact of its own, at radii from 1000 to 150 m.
#[test]
fn independent_model_is_met() {
    let table = include_str!("../../docs/data/curving_bogie.csv");
    let cases = [(1000.0, 0.35), (600.0, 0.35), (450.0, 0.35), (200.0, 0.35), (150.0, 0.35), (150.0, 0.5)];
    let allowed = Allowed { yaw: 2e-3, longitudinal: 0.03, force: 0.05, second_order: false };
    assert_eq!(compare_table(table, &cases, &allowed), 29);
}

/// All places of contact at the end of a run in time by the multibody program Exudyn, whose creepages are those of the
/// velocities of the material: at R = 200 m the forces of the program, with creepages of first order, turn the axles by
/// 0.01 mrad.
#[test]
fn multibody_program_is_met() {
    let table = include_str!("../../docs/data/curving_exudyn.csv");
    let allowed = Allowed { yaw: 15e-3, longitudinal: 0.12, force: 0.1, second_order: true };
    assert_eq!(compare_table(table, &[(600.0, 0.35), (200.0, 0.35)], &allowed), 10);
}

/// A lubricated gauge face of the outer rail: its contacts alone have the friction of the zone, and the axles run
/// otherwise. A zone with the friction of all others changes nothing.
#[test]
fn lubricated_gauge_face_has_its_own_friction() {
    let dry = problem(150.0, 0.4);
    let zone =
        |mu| FrictionZone { rail: Some(ZoneRail::Outer), from_angle: Some(0.8), friction: FrictionLaw::Constant(mu) };
    let with = |mu| CurvingProblem {
        friction: TrackFriction { elsewhere: FrictionLaw::Constant(0.4), zones: vec![zone(mu)] },
        ..dry.clone()
    };
    let [alone, alike, lubricated] = [dry.clone(), with(0.4), with(0.1)].map(|p| p.solve().unwrap());
    assert_eq!(alone, alike);
    let mut lubricates = 0;
    for axle in &lubricated.axles {
        for (wheel, side) in axle.wheels.iter().zip([1.0, -1.0]) {
            for c in wheel {
                // In a curve to the right the outer rail is the left one.
                let in_zone = side > 0.0 && c.place.angle > 0.8;
                lubricates += usize::from(in_zone);
                assert_eq!(c.friction, if in_zone { 0.1 } else { 0.4 }, "{c:?}");
                assert!(c.longitudinal.hypot(c.tangential) <= c.friction * c.normal * (1.0 + 1e-12), "{c:?}");
            }
        }
    }
    assert!(lubricates > 0, "no flange contact");
    // Whether a wheel climbs hangs on the friction of its flange.
    let rough = |mu| CurvingProblem {
        friction: TrackFriction { elsewhere: FrictionLaw::Constant(0.7), zones: vec![zone(mu)] },
        ..problem(100.0, 0.7)
    };
    rough(0.1).solve().unwrap();
    let text = rough(0.7).solve().unwrap_err().to_string();
    assert!(text.contains("climbs its rail") && text.contains("a friction of 0.70"), "{text}");
    assert!(lubricated.residual < 1e-7);
    // With less friction at the flange the leading axle runs at another angle.
    let yaw = |s: &CurvingSolution| s.axles[0].motion.yaw;
    assert!((yaw(&lubricated) - yaw(&alone)).abs() > 1e-5, "{} and {}", yaw(&lubricated), yaw(&alone));
}
