use super::*;
use crate::body::ModeLabel;
use crate::swept::RotationBlocks;
use crate::swept::{Wheel, WheelShape};

fn seen(order: usize, omega: &[f64]) -> ContactModeData {
    let m = omega.len();
    let rotation = RotationBlocks {
        coupling: Mat::from_fn(m, m, |i, j| match order {
            0 => i as f64 - j as f64,
            n => (n + i + j) as f64,
        }),
        stiffness: Mat::from_fn(m, m, |i, j| -((i + j) as f64)),
    };
    let contact = Mat::from_fn(LOADS, m, |c, k| (1 + k + c) as f64);
    let shares = (0..m).map(|k| if k % 2 == 0 { [0.1, 0.2, 0.7] } else { [0.6, 0.3, 0.1] }).collect();
    let outline = Mat::from_fn(2, m, |i, j| (10 * order + 2 * j + i) as f64);
    ContactModeData {
        order,
        omega: omega.to_vec(),
        residual: vec![0.0; m],
        shares,
        contact,
        rotation,
        stored: vec![0.0; m],
        lost: Mat::zeros(m, m),
        viscous: Mat::from_fn(m, m, |i, j| (i * j) as f64),
        parity: vec![0.0; m],
        bearings: Mat::zeros(0, m),
        outline,
        vectors: Mat::zeros(0, m),
    }
}

/// Modes on the outline, by orders, with their places in the list, and their transfer between ranks.
#[test]
fn modes_on_the_outline_know_their_places() {
    let all = [seen(0, &[5.0, 9.0]), seen(2, &[4.0, 9.0])];
    let numbers: Vec<f64> = all.iter().flat_map(ContactModeData::to_numbers).collect();
    assert_eq!(ContactModeData::from_numbers(&numbers).expect("modes"), all);
    let mut list = members(&all);
    list.truncate(3);
    let found = on_outline(&list);
    assert_eq!((found[0].order, found[0].places.clone()), (0, vec![vec![2]]));
    assert_eq!((found[1].order, found[1].places.clone()), (2, vec![vec![0], vec![1]]));
    assert_eq!((found[0].motion.ncols(), found[0].motion[(1, 0)]), (1, 1.0));
    assert_eq!((found[1].motion.ncols(), found[1].motion[(0, 0)]), (1, 20.0));
    assert_eq!(on_outline(&members(&all))[1].motion[(1, 1)], 23.0);
}

/// Families stand beside each other, turned by 90°: the contact sees one of them along y and n, the other along
/// x; G and D′ are skew and couple the two families of an order, order 0 within itself.
#[test]
fn pairs_at_the_contact_and_in_rotation() {
    let all = [seen(0, &[5.0, 9.0]), seen(2, &[4.0, 9.0])];
    let list = members(&all);
    let omega: Vec<f64> = list.iter().map(Member::omega).collect();
    assert_eq!(omega, [4.0, 4.0, 5.0, 9.0, 9.0, 9.0]);
    assert_eq!(list[0].contact_motion(0, 0.0), [0.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 8.0, 9.0]);
    assert_eq!(list[1].contact_motion(0, 0.0), [1.0, 0.0, 0.0, 0.0, 5.0, 6.0, 7.0, 0.0, 0.0]);
    // A quarter of the circle ahead the families of two nodal diameters are each the other way round.
    assert!(list[0]
        .contact_motion(0, 0.5 * PI)
        .iter()
        .zip(list[0].contact_motion(0, 0.0))
        .all(|(a, b)| (a + b).abs() < 1e-14));
    let eighth = list[0].contact_motion(0, 0.25 * PI);
    assert!(eighth.iter().zip(list[1].contact_motion(0, 0.0)).all(|(a, b)| (a + b).abs() < 1e-14), "{eighth:?}");
    assert_eq!(list[2].contact_motion(0, 0.7), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    let named: Vec<String> = names(&all, &list).iter().map(ModeLabel::to_string).collect();
    assert_eq!(named[..3], ["(2, axial 0)", "(2, axial 0)", "(0, axial 0)"]);
    assert_eq!(named[3..].iter().filter(|n| **n == "(2, radial 0)").count(), 2, "{named:?}");
    let r = rotation(&list);
    for i in 0..6 {
        for j in 0..6 {
            assert_eq!(r.gyroscopic[(i, j)], -r.gyroscopic[(j, i)]);
            assert_eq!(r.derivative[(i, j)], -r.derivative[(j, i)]);
            assert_eq!(r.stiffness[(i, j)], r.stiffness[(j, i)]);
        }
    }
    // φsᵀMDφc = −g, and G twice that.
    assert_eq!((r.gyroscopic[(1, 0)], r.gyroscopic[(0, 1)]), (-4.0, 4.0));
    assert_eq!((r.gyroscopic[(2, 3)], r.gyroscopic[(2, 4)]), (-2.0, 0.0));
    assert_eq!(r.diameters(), [2.0, 2.0, 0.0, 0.0, 2.0, 2.0]);
    assert_eq!((r.stiffness[(0, 4)], r.stiffness[(0, 5)], r.stiffness[(4, 4)]), (-1.0, 0.0, -2.0));
}

/// Modes of the wheelset have the same names and frequencies from half sections and from the whole one.
#[test]
fn names_and_frequencies_of_half_sections_are_those_of_the_whole() {
    let steel = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
    let shape = WheelShape::w920s_wheelset();
    let given = SectionSource::Wheel(Wheel { shape, offset: 0.0, height: None, mirrored: true });
    let section = given.for_modes().expect("section");
    let at = |y: f64| Bearing { place: [0.0, y], stiffness: [9e6, 5e6, 1e6] };
    let bearings = given.bearings(&section, &[at(-1.0), at(1.0)]).expect("bearings");
    let mirror = Mirror::new(&section, given.middle().expect("a wheelset")).expect("mirror images");
    let forms = Forms::new(section, steel, &[]).expect("forms").on_bearings(&bearings);
    let halves = HalfSections::new(&forms, &mirror).expect("halves");
    let named = |of: &dyn Fn(usize) -> (FourierModes, Vec<f64>)| {
        let seen = |n: usize| {
            let (modes, parity) = of(n);
            ContactModeData::new(&forms, &modes, &[], None).with_parity(parity)
        };
        let all: Vec<ContactModeData> = (0..4).map(seen).collect();
        let list = members(&all);
        let mut named: Vec<(String, f64)> =
            names(&all, &list).iter().zip(&list).map(|(name, m)| (name.to_string(), m.omega())).collect();
        named.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        named
    };
    let limit = 2.0 * PI * 3000.0;
    let own = named(&|n| halves.of_order(&forms, n, limit).expect("modes"));
    let whole = named(&|n| {
        let mut modes = of_order(&forms, n, limit).expect("modes");
        let parity = mirror.separate(&forms, &mut modes);
        (modes, parity)
    });
    assert!(own.len() > 40 && own.iter().any(|(name, _)| name == "(0, symmetric torsion 0)"), "{own:?}");
    assert_eq!(own.len(), whole.len());
    for ((name, omega), (other, there)) in own.iter().zip(&whole) {
        assert!(name == other && (omega - there).abs() <= 1e-8 * there, "{name} {omega}, {other} {there}");
    }
}
