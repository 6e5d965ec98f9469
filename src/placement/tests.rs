//! Wheels on rails in closed form, by symmetry, and beside CONTACT.

mod manchester;

use super::builtin::{rail, rail_60e1, rail_head, s1002};
use super::profile::ProfilePiece;
use super::*;

fn placement(side: RailSide, lateral: f64, yaw: f64, roll: f64) -> WheelPlacement {
    WheelPlacement {
        side,
        gauge: 1.435,
        gauge_depth: 0.014,
        cant: 0.025_f64.atan(),
        radius: 0.46,
        circles: 1.5,
        position: Position::Shift { lateral, yaw, roll },
        near: None,
    }
}

fn standard(side: RailSide, lateral: f64, yaw: f64, roll: f64) -> PlacedWheel {
    placement(side, lateral, yaw, roll).place(&s1002().unwrap(), &rail_60e1().unwrap()).unwrap()
}

/// Nodes an eighth of the smaller extent apart; along a contact twelve times as long as wide as many lines as there
/// may be.
#[test]
fn lines_of_a_long_contact_are_further_apart() {
    let [x, y] = grid_lines([4e-3, 2e-3]);
    assert_eq!((x.len(), y.len()), (57, 29));
    assert!((x[1] - x[0] - 0.25e-3).abs() < 1e-15 && (y[1] - y[0] - 0.25e-3).abs() < 1e-15);
    let [x, y] = grid_lines([12e-3, 1e-3]);
    assert_eq!((x.len(), y.len(), x[48]), (97, 29, 0.0));
    assert!((x[96] - 1.7 * 12e-3).abs() < 1e-15 && (y[1] - y[0] - 0.125e-3).abs() < 1e-15);
}

/// Grids of one of several contacts: over its closed part and 0.4 of the halves on either side, finer across.
#[test]
fn fitted_lines_follow_the_closed_part_of_a_contact() {
    let [x, y] = fitted_grid_lines([[-4e-3, 4e-3], [-0.2e-3, 1.0e-3]], 8.0);
    let spacing = 0.6e-3 / 8.0;
    assert!((y[1] - y[0] - spacing).abs() < 1e-15 && y.iter().any(|y| y.abs() < 1e-15));
    assert!(y[0] <= -0.44e-3 && y[0] > -0.44e-3 - spacing && y[y.len() - 1] >= 1.24e-3);
    assert!((96..=98).contains(&x.len()) && x[0] <= -5.6e-3 && x[x.len() - 1] >= 5.6e-3);
}

/// A contact that ends where another one begins has a part of its force on the line there, one that ends by itself
/// none.
#[test]
fn force_at_a_neighbour_is_told() {
    let open = 0.01;
    let gap = Gap {
        x: vec![0.0, 1.0],
        y: vec![0.0, 1.0, 2.0],
        gap: vec![0.0, 0.0, 1e-5, 1e-5, open, open],
        beyond: vec![false; 6],
    };
    let pressure = |values: [f64; 6]| gap.share_at_neighbour(|i| values[i]);
    assert_eq!(pressure([3.0, 0.0, 0.5, 0.5, 0.0, 0.0]), 0.25);
    assert_eq!(pressure([3.0, 1.0, 0.0, 0.0, 0.0, 0.0]), 0.0);
}

/// A grid ends with the first line in the profile of another contact on either side; one that has no neighbour stays.
#[test]
fn grids_end_where_contacts_meet() {
    let open = 0.01;
    let of = |lines: &[f64]| Gap {
        x: vec![0.0, 1.0],
        y: (0..lines.len()).map(|j| j as f64).collect(),
        gap: lines.iter().flat_map(|gap| [*gap, open]).collect(),
        beyond: vec![false; 2 * lines.len()],
    };
    let ended = of(&[open, open, 2e-5, 0.0, open, open, open]).up_to_neighbours();
    assert_eq!((ended.y, ended.gap[2], ended.gap.len()), (vec![1.0, 2.0, 3.0, 4.0], 2e-5, 8));
    let alone = of(&[1e-5, 0.0, 2e-5]);
    assert_eq!(alone.clone().up_to_neighbours(), alone);
}

/// The example of `docs/explanation/placement.md`.
#[test]
fn the_example_of_the_page() {
    let placed = standard(RailSide::Right, -4e-3, 0.010, 0.0);
    let touch = placed.touch();
    let ellipse = placed.ellipse(0.5 * 210e9 / 0.91, HertzLoad::Force(60e3)).unwrap();
    let frame = placed.centred_frame(ellipse.approach).unwrap();
    let creepages = placed.creepages(&frame, &RollingMotion::free_rolling(10.0)).unwrap();
    for (found, want, digit) in [
        (touch.angle, -9.64e-3, 1e-5),
        (touch.radius, 459.774e-3, 1e-6),
        (ellipse.semi_axes[0], 5.81e-3, 1e-5),
        (ellipse.semi_axes[1], 5.16e-3, 1e-5),
        (ellipse.pressure, 956e6, 1e6),
        (ellipse.approach, 71.2e-6, 1e-7),
        (frame.angle(), -10.93e-3, 1e-5),
        (creepages.longitudinal, 0.000533, 1e-6),
        (creepages.lateral, 0.009998, 1e-6),
        (creepages.spin, -0.0238, 1e-4),
    ] {
        assert!((found - want).abs() <= 0.5001 * digit, "{found} {want}");
    }
    assert!(placed.others(ellipse.approach).unwrap().is_empty());
    let extent = placed.extent(&frame, &ellipse).unwrap();
    assert_eq!(grid_lines(extent).map(|line| line.len()), [29, 31]);
}

/// Sides of 1:40 stand upright on rails canted by 1:40 and hang over beyond: their ends are cut, and the gauge is that
/// of the innermost place. Towards that cant the rail moves continuously.
#[test]
fn upright_sides_of_canted_rails_give_the_gauge() {
    let rail = rail(&crate::rails::R115RE).unwrap();
    let at = |cant: f64| WheelPlacement { cant, ..placement(RailSide::Right, 0.0, 0.0, 0.0) };
    for cant in [0.021, 0.025, 0.03] {
        let (moved, ..) = at(cant).rail_in_track(&rail).unwrap();
        let end = moved.range()[0];
        assert!((end - 0.5 * at(cant).gauge).abs() < 1e-12 && moved.local(end).z < at(cant).gauge_depth);
    }
    let [before, after] = [0.0199, 0.0201].map(|cant| at(cant).rail_in_track(&rail).unwrap().1);
    assert!((before - after).abs() < 1e-5, "{before} {after}");
    // A profile that ends too high is refused however steep it is there.
    let short = rail_head("short", &[0.3, 0.013], &[0.05], 40.0).unwrap();
    let low = WheelPlacement { gauge_depth: 0.04, ..at(0.025) };
    assert!(low.rail_in_track(&short).unwrap_err().message().contains("goes down to"));
}

/// A cone z = slope · y, wide enough.
fn cone(slope: f64) -> RunningProfile {
    RunningProfile::new(
        "cone",
        vec![-0.07, 0.07],
        vec![ProfilePiece::line([-0.07, -0.07 * slope], [0.07, 0.07 * slope])],
    )
    .unwrap()
}

/// A rail that is a cylinder of radius 0.2 m, 70 mm wide, with steep sides for the gauge.
fn cylinder() -> RunningProfile {
    let z = 0.2 - (0.04_f64 - 0.035 * 0.035).sqrt();
    RunningProfile::new(
        "cylinder",
        vec![-0.0351, -0.035, 0.035, 0.0351],
        vec![
            ProfilePiece::line([-0.0351, z + 0.05], [-0.035, z]),
            ProfilePiece::Arc { centre: [0.0, 0.2], radius: -0.2 },
            ProfilePiece::line([0.035, z], [0.0351, z + 0.05]),
        ],
    )
    .unwrap()
}

/// Cone on cylinder: point of contact, angle, curvatures and gap in closed form, with roll.
#[test]
fn a_cone_on_a_cylinder() {
    let (slope, roll, lateral) = (-0.05_f64, 0.004, 2e-3);
    let upright = WheelPlacement { cant: 0.0, ..placement(RailSide::Right, lateral, 0.0, roll) };
    let placed = upright.place(&cone(slope), &cylinder()).unwrap();
    let touch = placed.touch();
    let angle = slope.atan() + roll;
    assert!((touch.angle - angle).abs() < 1e-9, "{} {angle}", touch.angle);
    assert!((touch.rail - 0.2 * angle.sin()).abs() < 1e-9);
    assert!((touch.point[2] - 0.2 * (1.0 - angle.cos())).abs() < 1e-9 && touch.point[0].abs() < 1e-15);
    assert!((touch.radius - 0.46 - slope * touch.wheel).abs() < 1e-15);
    let own = slope.atan();
    let curvatures = placed.curvatures();
    assert!((curvatures.wheel_rolling - own.cos() / touch.radius).abs() < 1e-9);
    assert!(curvatures.wheel_across == 0.0 && (curvatures.rail_across - 5.0).abs() < 1e-9);
    let frame = placed.frame();
    let (x, y) = ([-6e-3, -1e-3, 0.0, 2e-3, 7e-3], [-8e-3, -2e-3, 0.0, 5e-3]);
    let gap = placed.gap(&frame, &x, &y).unwrap();
    for (j, b) in y.iter().enumerate() {
        // The rail falls off as a circle; the cone, cut across its generator where its radius is r, is a conic: x² =
        // 2 r t/c − t²(c² − s⁴/c²).
        let radius = touch.radius + own.sin() * b;
        let (s, c) = own.sin_cos();
        let (linear, square) = (2.0 * radius / c, c * c - s.powi(4) / (c * c));
        for (i, a) in x.iter().enumerate() {
            let wheel = 2.0 * a * a / (linear + (linear * linear - 4.0 * square * a * a).sqrt());
            let want = wheel + 0.2 - (0.04 - b * b).sqrt();
            // The point of contact is known to 1e-10 m, at which the gap is 1e-19; it shifts the circle by as much.
            assert!((gap.gap[i + 5 * j] - want).abs() < 1e-11, "{a} {b}: {} {want}", gap.gap[i + 5 * j]);
        }
    }
    assert!(!gap.beyond.iter().any(|&b| b));
}

#[test]
fn left_and_right_are_mirror_images() {
    for (lateral, yaw, roll) in [(3e-3, 0.012, 1e-3), (-5.5e-3, -0.02, 0.0)] {
        let (right, left) =
            (standard(RailSide::Right, lateral, yaw, roll), standard(RailSide::Left, -lateral, -yaw, -roll));
        let (a, b) = (right.touch(), left.touch());
        assert!(a.wheel == b.wheel && a.rail == b.rail && a.radius == b.radius && a.angle == -b.angle);
        assert!(a.point[0] == b.point[0] && a.point[1] == -b.point[1] && a.point[2] == b.point[2]);
        let (f, g) = (right.frame(), left.frame());
        let motion = RollingMotion { angular_speed: Some(22.0), ..RollingMotion::free_rolling(10.0) };
        let (c, d) = (right.creepages(&f, &motion).unwrap(), left.creepages(&g, &motion).unwrap());
        assert!(c.longitudinal == d.longitudinal && c.lateral == -d.lateral && c.spin == -d.spin && c.speed == d.speed);
        // A mirror image y → −y: an axle, which points to the right in both, keeps its y and reverses the rest.
        let (p, q) = (right.axle(&f), left.axle(&g));
        assert!(p[0] == -q[0] && p[1] == q[1] && p[2] == -q[2]);
        let x: Vec<f64> = (-5..=5).map(|i| 1.1e-3 * f64::from(i)).collect();
        let y: Vec<f64> = (-4..=4).map(|i| 0.7e-3 * f64::from(i)).collect();
        let (u, v) = (right.gap(&f, &x, &y).unwrap(), left.gap(&g, &x, &y).unwrap());
        for j in 0..9 {
            for i in 0..11 {
                assert!((u.gap[i + 11 * j] - v.gap[i + 11 * (8 - j)]).abs() < 1e-17);
            }
        }
        let (h, k) = (right.curvatures().relative, left.curvatures().relative);
        assert!(h[0][0] == k[0][0] && h[0][1] == -k[0][1] && h[1][1] == k[1][1]);
    }
}

#[test]
fn without_yaw_nothing_is_skew_and_small_yaw_shifts_the_point_along_the_track() {
    let straight = standard(RailSide::Right, 4e-3, 0.0, 0.0);
    assert_eq!(straight.touch().point[0], 0.0);
    assert_eq!(straight.curvatures().relative[0][1], 0.0);
    let x = [-3e-3, -1e-3, 1e-3, 3e-3];
    let gap = straight.gap(&straight.frame(), &x, &[-2e-3, 1e-3]).unwrap();
    for j in 0..2 {
        assert!(
            (gap.gap[4 * j] - gap.gap[3 + 4 * j]).abs() < 1e-15
                && (gap.gap[1 + 4 * j] - gap.gap[2 + 4 * j]).abs() < 1e-15
        );
    }
    let before = straight.touch();
    let slope = s1002().unwrap().local(before.wheel).slope;
    for yaw in [1e-4, 1e-3] {
        let touch = standard(RailSide::Right, 4e-3, yaw, 0.0).touch();
        // The axle turned back by the yaw takes the point along, and the slope of the tread moves it by −r r′ ψ.
        let want = -yaw * (0.75 + before.wheel) - before.radius * slope * yaw;
        assert!((touch.point[0] / want - 1.0).abs() < 0.02 * yaw / 1e-3, "{yaw}: {} {want}", touch.point[0]);
        assert!((touch.wheel - before.wheel).abs() < 2e3 * yaw * yaw * 1e-3);
    }
}

#[test]
fn curvatures_are_second_differences_of_the_gap() {
    for (side, lateral, yaw) in
        [(RailSide::Right, 3e-3, 0.03), (RailSide::Left, 2.0e-3, 0.05), (RailSide::Right, -6.5e-3, -0.03)]
    {
        let placed = standard(side, lateral, yaw, 0.0);
        let h = 2e-5;
        let line = [-h, 0.0, h];
        let g = placed.gap(&placed.frame(), &line, &line).unwrap().gap;
        let relative = placed.curvatures().relative;
        let across = (g[1] - 2.0 * g[4] + g[7]) / (h * h);
        for (found, want) in [
            ((g[3] - 2.0 * g[4] + g[5]) / (h * h), relative[0][0]),
            (across, relative[1][1]),
            ((g[8] - g[2] - g[6] + g[0]) / (4.0 * h * h), relative[0][1]),
        ] {
            assert!(
                (found - want).abs() < 2e-4 * relative[1][1].max(relative[0][0]),
                "{side:?} {lateral}: {found} {want}"
            );
        }
        // Nothing of first order: the planes touch.
        assert!(
            g[4].abs() < 1e-15 && ((g[5] - g[3]) / (2.0 * h)).abs() < 1e-5 && ((g[7] - g[1]) / (2.0 * h)).abs() < 1e-5
        );
        assert!(g.iter().all(|&v| v >= -1e-15));
    }
}

/// The signs that everything else hangs on, in words.
#[test]
fn creepages_have_the_signs_of_the_conventions() {
    let on = |side: RailSide, yaw: f64, speed: f64| {
        let placed = standard(side, 0.0, yaw, 0.0);
        let motion = RollingMotion { angular_speed: Some(speed), ..RollingMotion::free_rolling(10.0) };
        placed.creepages(&placed.frame(), &motion).unwrap()
    };
    let rolling = 10.0 / standard(RailSide::Right, 0.0, 0.0, 0.0).touch().radius;
    for side in [RailSide::Left, RailSide::Right] {
        let free = on(side, 0.0, rolling);
        assert!(free.longitudinal.abs() < 1e-15 && free.lateral == 0.0 && (free.speed - 10.0).abs() < 1e-13);
        // A driving wheel: its material overtakes the rail's towards +x (backwards), ξ < 0, and pushes the rail to
        // +x, as −μp ṡ says.
        let driving = on(side, 0.0, 1.01 * rolling);
        assert!((driving.longitudinal + 0.01 / 1.005).abs() < 1e-12);
        // Yawed to the right it rolls to the right; held back by the track it slides to the left: v_rail − v_wheel is
        // to the right.
        let yawed = on(side, 0.01, rolling);
        assert!(yawed.lateral > 0.0099 && yawed.lateral < 0.0101, "{}", yawed.lateral);
        // The axle against the normal: |φ| = |ω sin δ|/V, the rail tilts outwards on the right (δ < 0 inside its top).
        let angle = standard(side, 0.0, 0.0, 0.0).touch().angle;
        assert!((free.spin - rolling * angle.sin() / 10.0).abs() < 1e-12, "{} {angle}", free.spin);
    }
    let placed = standard(RailSide::Right, 0.0, 0.0, 0.0);
    let given = RollingMotion {
        longitudinal: Some(0.1),
        lateral: Some(0.2),
        spin: Some(0.3),
        ..RollingMotion::free_rolling(10.0)
    };
    let found = placed.creepages(&placed.frame(), &given).unwrap();
    assert_eq!([found.longitudinal, found.lateral, found.spin], [0.1, 0.2, 0.3]);
    // Without an angular speed the running circle rolls freely.
    let own = placed.creepages(&placed.frame(), &RollingMotion::free_rolling(10.0)).unwrap();
    assert!((own.longitudinal - (1.0 - placed.touch().radius / 0.46)).abs() < 1e-4 * own.longitudinal.abs() + 1e-7);
    for motion in [
        RollingMotion::free_rolling(0.0),
        RollingMotion { angular_speed: Some(f64::NAN), ..RollingMotion::free_rolling(1.0) },
    ] {
        assert_eq!(placed.creepages(&placed.frame(), &motion).unwrap_err().exit_code(), 2);
    }
}

/// The axle in the frame: tilted by δ, and turned by the yaw.
#[test]
fn the_axle_is_tilted_by_the_contact_angle() {
    for side in [RailSide::Left, RailSide::Right] {
        let placed = standard(side, side.sign() * 8e-3, 0.0, 0.0);
        let (axle, angle) = (placed.axle(&placed.frame()), placed.touch().angle);
        assert!(angle * side.sign() < -0.1, "a flange contact leans to the middle of the track: {angle}");
        assert!(axle[0] == 0.0 && (axle[1] - angle.cos()).abs() < 1e-15 && (axle[2] - angle.sin()).abs() < 1e-15);
    }
    // Yawed to the right its right end is behind: x is backwards.
    let placed = standard(RailSide::Left, 0.0, 0.01, 0.0);
    assert!((placed.axle(&placed.frame())[0] - 0.01_f64.sin()).abs() < 1e-9);
}

#[test]
fn a_point_given_directly_is_the_one_that_follows_from_its_shift() {
    for side in [RailSide::Left, RailSide::Right] {
        let first = standard(side, 2.5e-3, 0.015, 0.002);
        let touch = first.touch();
        let position = Position::Contact { wheel: touch.wheel, rail: touch.rail, yaw: 0.015 };
        let again = WheelPlacement { position, ..placement(side, 0.0, 0.0, 0.0) };
        let again = again.place(&s1002().unwrap(), &rail_60e1().unwrap()).unwrap();
        for (a, b) in first.wheelset().iter().zip(again.wheelset()) {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
        assert!((again.touch().wheel - touch.wheel).abs() < 1e-9 && (again.touch().angle - touch.angle).abs() < 1e-9);
    }
    let refuse = |wheel: f64, rail: f64, what: &str| {
        let position = Position::Contact { wheel, rail, yaw: 0.0 };
        let wrong = WheelPlacement { position, ..placement(RailSide::Right, 0.0, 0.0, 0.0) };
        let error = wrong.place(&s1002().unwrap(), &rail_60e1().unwrap()).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(what), "{error}");
    };
    refuse(0.09, 0.0, "at y = 90.00 mm of the wheel");
    refuse(0.0, 0.05, "at y = 50.00 mm of the rail");
    refuse(-0.039, 0.0, "differ by");
    // On the root of the flange, which is hollower than the rail is round: the wheel beside it would be in the rail.
    refuse(-0.0245, -0.022, "overlap");
}

/// The lines to be drawn touch at the point of contact and nowhere cross.
#[test]
fn drawn_lines_touch() {
    for side in [RailSide::Left, RailSide::Right] {
        let placed = standard(side, 3e-3, 0.01, 0.0);
        let (rail, wheel) = (placed.rail_line(1e-5), placed.wheel_line(1e-5));
        let nearest = wheel.iter().filter_map(|w| {
            let r = rail.iter().min_by(|a, b| (a[0] - w[0]).abs().total_cmp(&(b[0] - w[0]).abs()))?;
            // On the steep sides the nearest of the rail's points is beside.
            ((r[0] - w[0]).abs() < 1e-5 && (r[1] < 0.01)).then_some((r[1] - w[1], w[0]))
        });
        let (distance, y) = nearest.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        assert!(distance.abs() < 2e-6 && (y - placed.touch().point[1]).abs() < 3e-3, "{side:?}: {distance} {y}");
    }
}

/// Two bumps on one wheel: the second is reported where it is within the approach, and is separate.
#[test]
fn a_separate_second_contact_is_reported() {
    let bump = |y: f64, z: f64| ProfilePiece::Arc { centre: [y, z - 0.05], radius: 0.05 };
    let height = 4e-6;
    let low = -2e-3;
    // Two arcs of 50 mm, 16 mm apart, one 4 µm higher, on a flat-topped rail of 3 m radius.
    let wheel =
        RunningProfile::new("bumps", vec![-0.02, 0.0, 0.02], vec![bump(-8e-3, low), bump(8e-3, low - height)]).unwrap();
    let z = 3.0 - (9.0 - 0.035_f64 * 0.035).sqrt();
    let rail = RunningProfile::new(
        "flat",
        vec![-0.0351, -0.035, 0.035, 0.0351],
        vec![
            ProfilePiece::line([-0.0351, z + 0.05], [-0.035, z]),
            ProfilePiece::Arc { centre: [0.0, 3.0], radius: -3.0 },
            ProfilePiece::line([0.035, z], [0.0351, z + 0.05]),
        ],
    )
    .unwrap();
    let lateral = 0.5 * 1.435 + 0.035 - 0.75;
    let flat = WheelPlacement { cant: 0.0, ..placement(RailSide::Right, lateral, 0.0, 0.0) };
    let placed = flat.place(&wheel, &rail).unwrap();
    let others = placed.others(20e-6).unwrap();
    assert_eq!(others.len(), 1);
    assert!(others[0].separate && (others[0].gap - height).abs() < 0.5e-6, "{:?}", others[0]);
    assert!(placed.others(3e-6).unwrap().is_empty());
    for bad in [0.0, 0.01, f64::NAN] {
        assert!(placed.others(bad).unwrap_err().to_string().contains("approach"));
        assert_eq!(placed.centred_frame(bad).unwrap_err().exit_code(), 2);
    }
}

/// Seats lie on the drawings where bodies touch, turned as their drawings are; left and right are mirror images.
#[test]
fn seats_on_the_drawings() {
    let cant = 1.0_f64.atan2(40.0);
    for (lateral, roll) in [(0.0, 0.0), (-4e-3, 0.0), (6e-3, -2e-3)] {
        let of = |side: RailSide, sign: f64| {
            let placed = standard(side, sign * lateral, sign * 0.01, sign * roll);
            (placed.seats(&placed.frame()).unwrap(), placed.touch())
        };
        let ([rail, wheel], touch) = of(RailSide::Right, 1.0);
        assert!((wheel.y - touch.wheel).abs() < 1e-9 && (wheel.tilt - (touch.angle - roll)).abs() < 1e-5, "{wheel:?}");
        assert!((rail.tilt + touch.angle + cant).abs() < 1e-15, "{rail:?}");
        // On the upright profile the slope is the contact angle and the cant; its place is that of the touch turned
        // back.
        let profile = rail_60e1().unwrap();
        let at = profile.local(rail.y);
        assert!((at.slope.atan() - touch.angle - cant).abs() < 1e-9, "{} {}", at.slope.atan(), touch.angle);
        assert!((cant.cos() * rail.y + cant.sin() * at.z - touch.rail).abs() < 1e-9, "{rail:?}");
        let ([left_rail, left_wheel], _) = of(RailSide::Left, -1.0);
        for (left, right) in [(left_rail, rail), (left_wheel, wheel)] {
            assert!((left.y + right.y).abs() < 1e-12 && (left.tilt + right.tilt).abs() < 1e-12);
        }
    }
}

/// The overlap of round bodies is √2 times as wide as their contact; that of a wheel that touches at two near places
/// is much wider than either's ellipse.
#[test]
fn the_extent_of_a_grid() {
    let upright = WheelPlacement { cant: 0.0, ..placement(RailSide::Right, 0.0, 0.0, 0.0) };
    let placed = upright.place(&cone(-0.02), &cylinder()).unwrap();
    let ellipse = placed.ellipse(1.1e11, HertzLoad::Approach(30e-6)).unwrap();
    let wide = (2.0 * 30e-6 * 0.2_f64).sqrt();
    let found = placed.extent(&placed.frame(), &ellipse).unwrap();
    assert!(found[0] == ellipse.extent()[0] && found[1] >= ellipse.extent()[1]);
    assert!((found[1] - ellipse.extent()[1].max(0.75 * wide)).abs() < 2e-5, "{found:?} {wide}");
}

#[test]
fn grids_and_edges() {
    let [x, y] = grid_lines([4e-3, 2e-3]);
    assert!((x[1] - x[0] - 0.25e-3).abs() < 1e-18 && (y[1] - y[0] - 0.25e-3).abs() < 1e-18);
    assert!(x.contains(&0.0) && x[0] <= -6.8e-3 && x[0] > -7.1e-3 && y[0] <= -3.4e-3 && y[0] > -3.7e-3);
    // A cone that ends 2.5 mm beside the point of contact.
    let short =
        RunningProfile::new("short", vec![-0.07, -0.005], vec![ProfilePiece::line([-0.07, 3.5e-3], [-0.005, 0.25e-3])])
            .unwrap();
    let upright = WheelPlacement { cant: 0.0, ..placement(RailSide::Right, 0.0, 0.0, 0.0) };
    let placed = upright.place(&short, &cylinder()).unwrap();
    let end = -0.005 - placed.touch().wheel;
    assert!(end > 2e-3 && end < 3e-3, "{end}");
    let y = [-1e-3, 0.5 * end, 1.5 * end];
    let gap = placed.gap(&placed.frame(), &[-1e-3, 0.0, 1e-3], &y).unwrap();
    assert_eq!(gap.beyond, [false, false, false, false, false, false, true, true, true]);
    assert!(gap.refuse_edge(|i| i < 6).is_ok());
    assert!(gap.refuse_edge(|i| i == 7).unwrap_err().to_string().contains("end of a profile"));
    let modulus = 1.1e11;
    let half =
        |load: f64| Ellipse::new(placed.curvatures().relative, modulus, HertzLoad::Force(load)).unwrap().extent()[1];
    let load = 1e4 * (end / half(1e4)).powi(3);
    assert!(placed.ellipse(modulus, HertzLoad::Force(0.99 * load)).is_ok());
    let error = placed.ellipse(modulus, HertzLoad::Force(1.01 * load)).unwrap_err();
    assert!(
        error.exit_code() == 2 && error.to_string().contains("reaches the end of the profile of the wheel (short)"),
        "{error}"
    );
}

#[test]
fn bad_placements_are_refused() {
    let refuse = |p: WheelPlacement, wheel: &RunningProfile, rail: &RunningProfile, what: &str| {
        let error = p.place(wheel, rail).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(what), "{what}: {error}");
    };
    let (wheel, rail) = (s1002().unwrap(), rail_60e1().unwrap());
    let at = |lateral: f64| placement(RailSide::Right, lateral, 0.0, 0.0);
    refuse(at(0.15), &wheel, &rail, "do not meet");
    refuse(at(0.053), &wheel, &rail, "off its tread");
    refuse(at(-0.069), &wheel, &rail, "end of the profile of the");
    refuse(at(3.0), &wheel, &rail, "lateral shift of 3 m");
    refuse(placement(RailSide::Left, 0.0, f64::NAN, 0.0), &wheel, &rail, "yaw of NaN");
    refuse(WheelPlacement { gauge: 1435.0, ..at(0.0) }, &wheel, &rail, "gauge of 1435 m");
    refuse(WheelPlacement { gauge_depth: 0.04, ..at(0.0) }, &wheel, &rail, "depth at which the gauge");
    // A roof rides on the cylinder with its corner.
    let roof = RunningProfile::new(
        "roof",
        vec![-0.07, 0.0, 0.07],
        vec![ProfilePiece::line([-0.07, -0.01], [0.0, 0.0]), ProfilePiece::line([0.0, 0.0], [0.07, -0.01])],
    )
    .unwrap();
    let upright = WheelPlacement { cant: 0.0, ..at(0.0) };
    refuse(upright, &roof, &cylinder(), "corner");
}
