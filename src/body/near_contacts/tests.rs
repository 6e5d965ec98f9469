use super::super::hybrid::matrix;
use super::*;
use crate::fem::ElasticMaterial;
use crate::rails::R60E1;
use crate::swept::compliance::{pair_of, sum};
use crate::swept::{
    BuiltRail, Constant, Forms, HalfSpaceLoad, HeadPoint, PlacedRailSection, RailTrack, SectionContact, TrackLayer,
};
use std::f64::consts::PI;

const STEEL: HalfSpace = HalfSpace { young: 210e9, poisson: 0.3 };

fn grid(half: [f64; 2], lines: [usize; 2]) -> Lines {
    let line = |c: usize| -> Vec<f64> {
        (0..lines[c]).map(|k| half[c] * (2.0 * k as f64 / (lines[c] - 1) as f64 - 1.0)).collect()
    };
    [line(0), line(1)]
}

/// Contacts on one tread are refused where their circles overlap, those on tread and flange are told, those far
/// away are left to the functions; those beside each other along the circumference have their distance and angle.
#[test]
fn near_contacts_are_refused_or_told() {
    let radii = [4e-3, 5e-3];
    let grids = [grid([6e-3, 6e-3], [5, 5]), grid([8e-3, 7.5e-3], [5, 5])];
    // With half a spacing at either end they reach over each other by 2.875 mm at 14 mm.
    let moved = beside_each_other([&grids[0], &grids[1]], [2e-3, -0.014]);
    assert!(moved[0] == 2e-3 && (moved[1] + 0.016875).abs() < 1e-15, "{moved:?}");
    assert_eq!(beside_each_other([&grids[0], &grids[1]], [0.02, 0.01]), [0.02, 0.01]);
    let tread = ContactPosition::round([0.46, 0.0], 0.0, 0.0);
    let beside =
        |y: f64, angle: f64| near_pairs(&[tread, ContactPosition::round([0.46, y], 0.0, angle)], &radii, &grids);
    assert_eq!(beside(0.025, 0.0).unwrap(), (Vec::new(), Vec::new()));
    let (pairs, told) = beside(-0.014, 0.0).unwrap();
    assert!(told.is_empty() && pairs[0].contacts == [0, 1] && (pairs[0].apart[1] + 0.016875).abs() < 1e-15);
    let error = beside(0.008, 0.1).unwrap_err();
    assert!(error.exit_code() == 2 && error.message().contains("8.00 mm between them"), "{error}");
    let (pairs, told) = beside(0.014, 1.2).unwrap();
    assert!(pairs.is_empty() && told.len() == 1 && told[0].contains("differ by 1.20 rad"), "{told:?}");
    let ahead = ContactPosition::round([0.46, 0.0], 0.5, 0.0);
    assert!((tread.distance(&ahead) - 0.92 * 0.25f64.sin()).abs() < 1e-15 && (tread.angle(&ahead) - 0.5).abs() < 1e-12);
    let along =
        ContactPosition::straight([0.0, 0.01], 0.3, 0.0).distance(&ContactPosition::straight([0.0; 2], 0.0, 0.0));
    assert!((along - 0.3f64.hypot(0.01)).abs() < 1e-15);
}

/// The loads of a circle on itself are those of the closed form; those of another one far away are a point force.
#[test]
fn loads_act_on_each_other_through_the_half_space() {
    let circle = LoadPatch::Circle { radius: 3e-3 };
    let pair = |apart: [f64; 2]| NearPair { contacts: [0, 1], apart, bend: 0.0 };
    let own = STEEL.between_loads([circle; 2], &pair([0.0; 2]), ACROSS);
    let load = HalfSpaceLoad { patch: circle, shear: STEEL.shear(), poisson: STEEL.poisson };
    let (known, moments) = (load.sum(), circle.moments());
    for i in 0..LOADS {
        for j in 0..LOADS {
            let scale = (known[i][i] * known[j][j]).sqrt() / (moments[i] * moments[j]);
            let wanted = known[i][j] / (moments[i] * moments[j]);
            assert!((own[i][j] - wanted).abs() < 0.03 * scale, "{i} {j}: {:e} {wanted:e}", own[i][j]);
        }
    }
    let apart = [0.08, -0.06];
    let far = STEEL.between_loads([circle, LoadPatch::Circle { radius: 2e-3 }], &pair(apart), ACROSS);
    let point = STEEL.point(apart.map(|v| -v));
    for i in 0..3 {
        for j in 0..3 {
            assert!((far[i][j] - point[i][j]).abs() < 2e-3 * point[2][2], "{i} {j}");
        }
    }
}

/// A plane body whose loads do to each other what the half-space does has nothing left beside it; its contacts are
/// held as they hold each other on one surface, and one pulls the other where it yields less than that.
#[test]
fn contacts_on_a_plane_hold_each_other() {
    let grids = [grid([4e-3, 2e-3], [9, 9]), grid([3e-3, 3e-3], [7, 7])];
    let near = |apart: [f64; 2]| vec![NearPair { contacts: [0, 1], apart, bend: 0.0 }];
    let held = |apart| stiffness(0.3, (&grids, &near(apart))).unwrap().unwrap();
    let (beside, far) = (held([0.0, 7e-3]), held([0.0, 7.0]));
    assert!(far[(2, LOADS + 2)].abs() < 1e-3 * far[(2, 2)]);
    // Both sink together under less force than alone.
    let together = |k: &Mat<f64>| k[(2, 2)] + 2.0 * k[(2, LOADS + 2)] + k[(LOADS + 2, LOADS + 2)];
    let ratio = together(&beside) / together(&far);
    assert!((0.5..0.9).contains(&ratio), "{ratio}");
    let mut all = half_spaces(&STEEL, &grids).unwrap();
    add_between(&mut all, &STEEL, (&grids, &near([0.0, 7e-3])), 1.0).unwrap();
    assert!(all.llt(Side::Lower).is_ok());
    // The other sign of motions along x and y changes normal against tangential motion alone.
    let mut turned = Mat::zeros(all.nrows(), all.ncols());
    add_between(&mut turned, &STEEL, (&grids, &near([0.0, 7e-3])), -1.0).unwrap();
    let first = rows(&grids[0]);
    for (i, j) in [(0, first), (2, first + 2), (1, first + 2), (2, first + 1), (4, first + 5)] {
        let sign = if (i % 3 == 2) == (j % 3 == 2) { 1.0 } else { -1.0 };
        assert!((turned[(i, j)] - sign * all[(i, j)]).abs() < 1e-18, "{i} {j}");
    }
}

/// An even load on a rectangle yields as the sum over its waves says (`HalfSpaceLoad`), about a middle that lies
/// beside the contact point as about the contact point itself.
#[test]
fn even_loads_yield_as_their_waves_do() {
    let half = [6e-3, 1.5e-3];
    let of = |middle: f64| LoadPatch::Rectangle { half, middle };
    let found = STEEL.under_loads(of(0.0));
    let load = HalfSpaceLoad { patch: of(0.0), shear: STEEL.shear(), poisson: STEEL.poisson };
    let [near, far] = [40.0, 80.0].map(|reach| load.up_to(reach / half[1]));
    let known = scaled([of(0.0); 2], |i, j| 2.0 * far[i][j] - near[i][j]);
    for i in 0..LOADS {
        for j in 0..LOADS {
            let scale = (known[i][i] * known[j][j]).sqrt();
            let digits = if i < 3 && j < 3 { 2e-3 } else { 1e-2 };
            assert!((found[i][j] - known[i][j]).abs() < digits * scale, "{i} {j}: {:e} {:e}", found[i][j], known[i][j]);
        }
    }
    // Loads that are moved have the same forces, and moments about another place.
    let moved = STEEL.under_loads(of(1e-3));
    for c in 0..3 {
        // To the rounding of a million terms.
        assert!((moved[6 + c][6 + c] / found[6 + c][6 + c] - 1.0).abs() < 1e-10);
        let wanted = found[c][c] - 2e-3 * found[c][6 + c] + 1e-6 * found[6 + c][6 + c];
        assert!((moved[c][c] / wanted - 1.0).abs() < 1e-10, "{c}: {:e} {wanted:e}", moved[c][c]);
    }
}

/// The half-space between two contacts is turned with them by half their angle: a force and the motion along one
/// direction of space are the same from either frame.
#[test]
fn contacts_that_lean_see_the_same_half_space() {
    let grids = [grid([2e-3, 1e-3], [3, 3]), grid([1e-3, 2e-3], [3, 3])];
    let pair = |bend: f64| NearPair { contacts: [0, 1], apart: [1e-3, 6e-3], bend };
    let [level, bent] = [0.0, -0.4].map(|bend| STEEL.between([&grids[0], &grids[1]], &pair(bend)).unwrap());
    let turned = |frame: f64, v: [f64; 3]| {
        let loads = crate::swept::rotate_loads(std::array::from_fn(|k| if k < 3 { v[k] } else { 0.0 }), frame);
        [loads[0], loads[1], loads[2]]
    };
    let (force, direction) = ([0.3, 1.0, -0.7], [-0.2, 0.5, 1.1]);
    let work = |c: &Mat<f64>, d: [f64; 3], f: [f64; 3]| -> f64 {
        (0..9).map(|k| d[k / 3] * c[(12 + k / 3, 3 + k % 3)] * f[k % 3]).sum()
    };
    let wanted = work(&level, direction, force);
    // The frame of the first one leans by half of the angle the other way.
    let found = work(&bent, turned(0.2, direction), turned(-0.2, force));
    assert!((found / wanted - 1.0).abs() < 1e-12, "{found:e} {wanted:e}");
    assert!((work(&bent, direction, force) / wanted - 1.0).abs() > 0.05);
}

/// Length of a rail over 2π, m.
const RADIUS: f64 = 14.0 / (2.0 * PI);

/// The place of the gauge corner of a rail 60E1, an arc of 13 mm, at the angle `angle`, rad.
fn corner(angle: f64) -> HeadPoint {
    R60E1.head.point(R60E1.head.to_angle(angle))
}

/// Γ⁻¹BΓ⁻¹ of a rail 60E1 under the loads on `patches` at `places`, each with its distance along the rail, m, beside
/// the half-spaces, `[9T, 9T]`, each in the frame of the surface at its place.
fn of_rail(places: &[(HeadPoint, f64)], patches: &[LoadPatch]) -> Mat<f64> {
    let steel = ElasticMaterial { young: STEEL.young, poisson: STEEL.poisson, density: 7860.0 };
    let track = RailTrack { pad: TrackLayer::with_loss([200e6, 66.7e6, 66.7e6], 0.2, 60.2), sleeper: None };
    let own = BuiltRail::near(&R60E1, [places[0].0.y, places[0].0.z - R60E1.head.height]).unwrap();
    let rail = PlacedRailSection::Built(own);
    let others: Vec<HeadPoint> = places[1..].iter().map(|at| at.0).collect();
    let shorter: Vec<f64> = patches.iter().map(LoadPatch::shorter).collect();
    let section = rail.for_loads_at(&others, &shorter).unwrap();
    let forms = Forms::along(section, steel, 2.0 * PI * RADIUS, Some(&track), rail.contact().angle).unwrap();
    let contacts: Vec<SectionContact> =
        places.iter().map(|&(at, along)| rail.contact_at(at, RADIUS).at_place(along)).collect();
    let constant = Constant::of_contacts(&forms, &[patches.to_vec()], &contacts).unwrap();
    let mut memory = Vec::new();
    let blocks: Vec<_> = (0..constant.blocks.len()).map(|k| constant.block(k, &mut memory).unwrap()).collect();
    sum(blocks.into_iter().chain([constant.singles()])).swap_remove(0)
}

/// Two contacts on the gauge corner of a rail, 6 mm apart, with normals that differ by 0.46 rad: what forces on small
/// discs of one do to places of the other, by the waves of the rail, beside what the contacts have of each other. The
/// half-space between both, turned with them, is what makes it near; functions from circles are far off.
#[test]
#[ignore = "long: scripts/validate long"]
fn contacts_on_a_bent_surface_act_on_each_other_as_they_do() {
    let arc = 0.013;
    let angles = [0.62, 1.08];
    let places = [(corner(angles[0]), 0.0), (corner(angles[1]), -4e-3)];
    let grids = [grid([10e-3, 2.4e-3], [21, 7]), grid([9e-3, 2.0e-3], [19, 7])];
    let positions = places.map(|(at, along)| ContactPosition::straight([at.z, at.y], along, at.angle));
    let radii = [1.6e-3, 1.3e-3];
    let (near, _) = near_pairs(&positions, &radii, &grids).unwrap();
    assert!((near[0].bend + 0.46).abs() < 1e-12 && (near[0].apart[1] - 0.026 * 0.23f64.sin()).abs() < 1e-6, "{near:?}");
    // Places of the grids, (x, y) in their frames, and the same on the surface.
    let of = |c: usize, [x, y]: [f64; 2]| {
        let angle = angles[c] + (y / arc).asin();
        (corner(angle), places[c].1 + x)
    };
    let (a, b) = (0.8e-3, 2e-3 / 3.0);
    let seen = [[[-6e-3, 0.0], [0.0, 2.0 * a], [5e-3, -a]], [[-5e-3, b], [0.0, -2.0 * b], [6e-3, 0.0]]];
    let all: Vec<(HeadPoint, f64)> = [0, 1].iter().flat_map(|&c| seen[c].map(|at| of(c, at))).collect();
    let small = LoadPatch::Circle { radius: 0.8e-3 };
    let wanted = of_rail(&all, &vec![small; all.len()]);
    let models = [
        ("circles alone", radii.map(|radius| LoadPatch::Circle { radius }), Vec::new()),
        (
            "half-space between",
            [0, 1].map(|c| LoadPatch::Rectangle { half: grids[c].each_ref().map(|l| ends(l)[1]), middle: 0.0 }),
            near.clone(),
        ),
    ];
    let mut errors = Vec::new();
    for (name, patches, near) in models {
        let mut left = of_rail(&places, &patches);
        for pair in &near {
            let known = pair.share(&STEEL, &patches);
            for i in 0..LOADS {
                for j in 0..LOADS {
                    left[(i, LOADS + j)] -= known[i][j];
                    left[(LOADS + j, i)] -= known[i][j];
                }
            }
        }
        let whole = matrix(&STEEL, &left, (&grids, &near)).unwrap();
        let node = |c: usize, [x, y]: [f64; 2]| {
            let nearest = |lines: &Vec<f64>, v: f64| {
                (0..lines.len()).min_by(|&a, &b| (lines[a] - v).abs().total_cmp(&(lines[b] - v).abs())).unwrap()
            };
            let first = if c == 0 { 0 } else { rows(&grids[0]) };
            first + 3 * (nearest(&grids[c][0], x) + grids[c][0].len() * nearest(&grids[c][1], y))
        };
        let mut squares = [0.0; 3];
        for i in 0..3 {
            for j in 0..3 {
                let found = pair_of(wanted.as_ref(), [i, 3 + j]);
                // From the frames of the surface at the places into those of the contacts.
                let turns = [(i, 0), (3 + j, 1)].map(|(k, c)| places[c].0.angle - all[k].0.angle);
                let found = crate::swept::rotate_load_pairs_between(&found, turns);
                for (c, square) in squares.iter_mut().enumerate() {
                    let model = whole[(node(0, seen[0][i]) + c, node(1, seen[1][j]) + c)];
                    *square += (model - found[c][c]).powi(2) / 9.0;
                }
            }
        }
        let found = squares.map(|s| 1e12 * s.sqrt());
        println!("{name}: {found:.1?} pm/N along x, y and n");
        errors.push(found);
    }
    // Along y most of it is the plane of the grids: it leaves the surface by up to 0.15 mm, about which the rail rolls
    // on its pads.
    let [circles, near] = [errors[0], errors[1]];
    assert!(near[0] < 0.25 * circles[0] && near[1] < 0.25 * circles[1], "{errors:?}");
    assert!(near[2] < 0.05 * circles[2] && near[2] < 5.0, "{errors:?}");
}
