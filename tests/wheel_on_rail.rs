//! A wheel on a rail from its profiles to the forces: placement, gap and creepages of `placement` on half-spaces,
//! beside CONTACT.

use railsqueal::body::half_space::HalfSpace;
use railsqueal::body::hybrid::half_spaces;
use railsqueal::contact::{
    ContactCreepage, Loads, NormalLoad, PatchKinematics, SteadyProblem, SteadySolution, Stencil,
};
use railsqueal::friction::FrictionLaw;
use railsqueal::grid::Interface;
use railsqueal::model::combined_compliance;
use railsqueal::placement::builtin::{s1002, uic60};
use railsqueal::placement::read::{read, ProfileKind, Reading};
use railsqueal::placement::{
    grid_lines, Creepages, Frame, Gap, HertzLoad, Position, RailSide, RollingMotion, WheelPlacement,
};
use std::collections::HashMap;
use std::path::Path;

type Row = HashMap<String, f64>;

/// Cases of the Manchester benchmark, computed with CONTACT (github eve70a/CONTACT, Apache-2.0); lengths in mm,
/// forces in N, pressures in MPa.
fn rows() -> Vec<(RailSide, Row)> {
    let mut lines = include_str!("../src/placement/tests/manchester_a22_sample.csv").lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let read = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let side = if cells[0] == "left" { RailSide::Left } else { RailSide::Right };
        (side, names.iter().zip(&cells).skip(1).map(|(n, c)| (n.to_string(), c.parse().unwrap())).collect())
    };
    lines.map(read).collect()
}

/// Steady rolling of a case under its normal force, on the grid of Hertz' ellipse.
fn roll(side: RailSide, row: &Row, stencil: Stencil) -> (SteadySolution, f64) {
    // The benchmark's rail, whose arcs meet elsewhere than those of 60E1.
    let rail = uic60().unwrap();
    let placement = WheelPlacement {
        side,
        gauge: 1.435,
        gauge_depth: 0.014,
        cant: 0.025_f64.atan(),
        radius: 0.46,
        circles: 1.5,
        position: Position::Shift { lateral: 1e-3 * row["y_ws"], yaw: row["yaw"], roll: row["roll"] },
        near: None,
    };
    let placed = placement.place(&s1002().unwrap(), &rail).unwrap();
    let steel = HalfSpace { young: 2.0 * 82e9 * 1.28, poisson: 0.28 };
    let ellipse = placed.ellipse(0.5 * steel.plane(), HertzLoad::Force(row["fn"])).unwrap();
    let frame = placed.centred_frame(ellipse.approach).unwrap();
    let motion = RollingMotion { angular_speed: Some(-row["vpitch"]), ..RollingMotion::free_rolling(2.0) };
    let creepage = placed.creepages(&frame, &motion).unwrap();
    let [x, y] = grid_lines(placed.extent(&frame, &ellipse).unwrap());
    let gap = placed.gap(&frame, &x, &y).unwrap();
    let interface = Interface::new(x, y, gap.gap.clone()).unwrap();
    let own = steel.compliance(&interface.patches[0].x, &interface.patches[0].y).unwrap();
    let compliance = combined_compliance(own.as_ref(), own.as_ref()).unwrap();
    let problem = SteadyProblem {
        interface: &interface,
        compliance: compliance.as_ref().into(),
        friction: FrictionLaw::Constant(0.3).into(),
        kinematics: PatchKinematics::one(
            creepage.speed,
            ContactCreepage { longitudinal: creepage.longitudinal, lateral: creepage.lateral, spin: creepage.spin },
        ),
        loads: NormalLoad::Force(row["fn"]).into(),
        stencil,
        tolerance: 1e-8,
        max_iterations: 200,
    };
    let solution = problem.solve().unwrap();
    gap.refuse_edge(|i| solution.pressure[i] > 0.0).unwrap();
    (solution, interface.patches[0].x[1] - interface.patches[0].x[0])
}

/// Approach and pressures at the same normal force, and forces. CONTACT's have the error of its operator of first
/// order on its grid of 0.2 mm, up to 0.8 % where a part sticks and nothing where all slips: they are compared with
/// what the operators of first and of second order give, taken to that grid.
#[test]
fn forces_are_those_of_contact() {
    for (side, row) in rows() {
        let case = format!("{side:?} {}", row["case"]);
        let (found, spacing) = roll(side, &row, Stencil::default());
        let (first, _) = roll(side, &row, Stencil::Upwind1);
        assert!(
            (found.patches[0].approach - 1e-3 * row["approach"]).abs() < 0.03e-6,
            "{case}: {}",
            found.patches[0].approach
        );
        let peak = found.pressure.iter().copied().fold(0.0, f64::max);
        assert!((1e-6 * peak / row["pmax"] - 1.0).abs() < 4e-3, "{case}: {peak}");
        let part = 0.2e-3 / spacing;
        let limit = 0.3 * row["fn"];
        let grid = |c: usize| found.force[c] + part * (first.force[c] - found.force[c]);
        // In CONTACT's axes, its own figures in brackets: the row of the table in docs/explanation/placement.md, which
        // a study writes.
        println!(
            "row: {} {} mm | {:.2} ({:.2}) | {:.1} ({:.1}) | {:.0}; {:.0} ({:.0}) | {:.0}; {:.0} ({:.0})",
            format!("{side:?}").to_lowercase(),
            row["y_ws"],
            1e6 * found.patches[0].approach,
            1e3 * row["approach"],
            1e-6 * peak,
            row["pmax"],
            -found.force[0],
            -grid(0),
            row["fx"],
            found.force[1],
            grid(1),
            row["fs"]
        );
        // Backwards in the program is forwards in CONTACT with the other sign; to the right is the same in both.
        for (c, want) in [(0, -row["fx"]), (1, row["fs"])] {
            let force = grid(c);
            assert!((force - want).abs() < 3e-3 * limit, "{case}: {force} {want}");
            if found.state.iter().all(|&s| s != 1) {
                assert!((found.force[c] - want).abs() < 1e-3 * limit, "{case}: {} {want}", found.force[c]);
            }
        }
        // Stick where CONTACT has stick.
        let share = |s: u8| found.state.iter().filter(|&&v| v == s).count() as f64;
        let stick = share(1) / (share(1) + share(2));
        assert!((stick - row["nadh"] / row["ncon"]).abs() < 0.03, "{case}: {stick}");
    }
}

/// The second case of `force_site_b` of CONTACT's test bank: a worn wheel on a worn high rail under a vertical force of
/// 32.5 kN touches at the tread and at the flange root. CONTACT finds 18 590 N at -0.0587 rad and 16 240 N at -0.577
/// rad on a grid of 0.4 mm, with friction of 0.35 and 0.2 there. The program has one coefficient, and the two of them
/// change the normal forces by less than the tolerance.
#[test]
fn tread_and_flange_root_share_a_vertical_force_as_in_contact() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/profiles");
    let file = |name: &str, kind: ProfileKind, circle: Option<f64>| {
        let reading = Reading { kind, unit: None, z: None, mirror: false, circle, smoothing: 0.0 };
        read(&folder.join(name), &reading).unwrap().0
    };
    // The origin of the wheel's file is the back of its flange; the distance of the backs is 1347.4 mm.
    let wheel = file("worn_high_mileage.prw", ProfileKind::Wheel, Some(0.07));
    let rail = file("site_b_hr.prr", ProfileKind::Rail, None);
    let steel = HalfSpace { young: 2.0 * 82e9 * 1.28, poisson: 0.28 };
    let place = |near: f64, force: f64| {
        let placement = WheelPlacement {
            side: RailSide::Right,
            gauge: 1.4351,
            gauge_depth: 0.015875,
            cant: 0.0,
            radius: 0.444,
            circles: 1.3474 + 0.14,
            position: Position::Shift { lateral: 14.74e-3, yaw: 5e-3, roll: -1.3e-3 },
            near: Some(near),
        };
        let placed = placement.place(&wheel, &rail).unwrap();
        let ellipse = placed.ellipse(0.5 * steel.plane(), HertzLoad::Force(force)).unwrap();
        let frame = placed.centred_frame(ellipse.approach).unwrap();
        let motion = RollingMotion { angular_speed: Some(32.1), ..RollingMotion::free_rolling(15.0) };
        let creepage = placed.creepages(&frame, &motion).unwrap();
        let [x, y] = grid_lines(placed.extent(&frame, &ellipse).unwrap());
        let gap = placed.gap(&frame, &x, &y).unwrap();
        (placed.height(), frame, creepage, gap)
    };
    let both = [place(66.93e-3 - 0.07, 18.6e3), place(34.35e-3 - 0.07, 16.2e3)];
    let first = both[0].0.min(both[1].0);
    let part = |(height, frame, _, gap): &(f64, Frame, Creepages, Gap)| {
        let open = (height - first) * frame.angle().cos();
        Interface::new(gap.x.clone(), gap.y.clone(), gap.gap.iter().map(|g| g + open).collect()).unwrap()
    };
    let interface = Interface::joined(both.iter().map(part).collect()).unwrap();
    let grids: Vec<[Vec<f64>; 2]> = interface.patches.iter().map(|p| [p.x.clone(), p.y.clone()]).collect();
    let own = half_spaces(&steel, &grids).unwrap();
    let compliance = combined_compliance(own.as_ref(), own.as_ref()).unwrap();
    let angles = [0, 1].map(|c: usize| both[c].1.angle());
    let solve = |friction: f64| {
        let kinematics = |(_, _, c, _): &(f64, Frame, Creepages, Gap)| PatchKinematics {
            speed: c.speed,
            creepage: ContactCreepage { longitudinal: c.longitudinal, lateral: c.lateral, spin: c.spin },
        };
        let problem = SteadyProblem {
            interface: &interface,
            compliance: compliance.as_ref().into(),
            friction: FrictionLaw::Constant(friction).into(),
            kinematics: both.iter().map(kinematics).collect(),
            loads: Loads::vertical(&angles, NormalLoad::Force(32.5e3)),
            stencil: Stencil::default(),
            tolerance: 1e-8,
            max_iterations: 200,
        };
        problem.solve().unwrap()
    };
    let [low, high] = [0.2, 0.35].map(solve);
    for (c, (angle, normal)) in [(-0.0587, 18.59e3), (-0.577, 16.24e3)].into_iter().enumerate() {
        assert!((angles[c] - angle).abs() < 0.01, "contact {c}: angle {}", angles[c]);
        for found in [&low, &high] {
            let force = -found.patches[c].force[2];
            assert!((force / normal - 1.0).abs() < 0.01, "contact {c}: {force} N, CONTACT has {normal} N");
        }
    }
    // The vertical parts of all forces on the wheel are the load.
    let vertical = |c: usize| {
        let [_, y, z] = high.patches[c].force;
        -z * angles[c].cos() + y * angles[c].sin()
    };
    assert!((vertical(0) + vertical(1) - 32.5e3).abs() < 1e-5 * 32.5e3, "{} {}", vertical(0), vertical(1));
    // Tangential forces of the two contacts beside CONTACT's 6477 and -624 N at 0.35, and 3192 and -545.8 N at 0.2.
    for (found, c, x, y) in [(&high, 0, -6477.0, -624.0), (&low, 1, -3192.0, -545.8)] {
        let [fx, fy, fz] = found.patches[c].force;
        let bound = [0.35, 0.2][c] * -fz;
        assert!((fx - x).hypot(fy - y) < 0.03 * bound, "contact {c}: {fx} {fy}");
    }
}
