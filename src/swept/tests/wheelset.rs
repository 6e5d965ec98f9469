//! The benchmark wheelset.

use super::*;

const STEEL_OF_WHEELS: ElasticMaterial = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };

fn wheelset(mirrored: bool) -> SectionSource {
    let shape = WheelShape::w920s_wheelset();
    SectionSource::Wheel(Wheel { shape, offset: 0.0, height: None, mirrored })
}

/// Bearings of the stiffness along x, y and z, N/m, 1 m from the middle on either side.
fn suspended(given: &SectionSource, stiffness: [f64; 3]) -> Forms {
    let section = given.for_modes().unwrap();
    let at = |y: f64| Bearing { place: [0.0, y], stiffness };
    let bearings = given.bearings(&section, &[at(-1.0), at(1.0)]).unwrap();
    Forms::new(section, STEEL_OF_WHEELS, &[]).unwrap().on_bearings(&bearings)
}

/// Modes of the order n up to `limit`, Hz, with their parity.
fn modes(given: &SectionSource, forms: &Forms, n: usize, limit: f64) -> (modes::FourierModes, Vec<f64>) {
    let mirror = Mirror::new(&forms.section, given.middle().unwrap()).unwrap();
    let mut modes = of_order(forms, n, 2.0 * PI * limit).unwrap();
    let parity = mirror.separate(forms, &mut modes);
    (modes, parity)
}

/// 1019.5 kg of the same parts in closed form, the centre of mass in the middle, and bearings on the journals.
#[test]
fn the_wheelset_has_the_mass_of_its_parts() {
    let given = wheelset(true);
    let section = given.for_modes().unwrap();
    let [mass, centre, ..] = section.inertia(STEEL_OF_WHEELS);
    let disc = |from: f64, to: f64, width: f64| PI * (to * to - from * from) * width * STEEL_OF_WHEELS.density;
    let wheel = disc(0.095, 0.135, 0.18) + disc(0.135, 0.390, 0.024) + disc(0.390, 0.460, 0.135);
    let half = wheel + disc(0.460, 0.488, 0.030) + disc(0.0, 0.065, 0.26) + disc(0.0, 0.095, 0.18);
    let whole = 2.0 * (half + disc(0.0, 0.080, 0.66));
    assert!((mass / whole - 1.0).abs() < 1e-10 && (mass - 1019.5).abs() < 0.1, "{mass} {whole}");
    assert!((centre + 0.75).abs() < 1e-10 && given.middle() == Some(-0.75), "{centre}");
    let forms = suspended(&given, [1e6; 3]);
    let places: Vec<[f64; 2]> = forms.bearings().map(|b| b.place).collect();
    let wanted = [[0.065, -1.75], [0.065, 0.25]];
    let near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-12;
    assert!(places.iter().zip(&wanted).all(near), "{places:?}");
    let beside = Bearing { place: [0.0, 1.2], stiffness: [1e6; 3] };
    assert!(given.bearings(&section, &[beside]).unwrap_err().message().contains("found y = 1.2 m"));
}

/// With its seats clamped each wheel is the single one on its clamped bore.
#[test]
fn a_wheelset_on_clamped_seats_is_two_single_wheels() {
    let single =
        Forms::new(SectionSource::Wheel(Wheel::w920s(0.0)).for_modes().unwrap(), STEEL_OF_WHEELS, &["inner".into()]);
    let both = Forms::new(wheelset(false).for_modes().unwrap(), STEEL_OF_WHEELS, &[SEATS.into()]);
    let (single, both) = (single.unwrap(), both.unwrap());
    for n in 0..4 {
        let [one, two] = [&single, &both].map(|forms| of_order(forms, n, 2.0 * PI * 3000.0).unwrap().omega);
        assert!(one.len() > 1);
        for w in &one {
            let same = two.iter().filter(|v| (**v / w - 1.0).abs() < 1e-3).count();
            assert!(same >= 2, "{n}: {w} rad/s of {two:?}");
        }
    }
}

/// Every mode is symmetric or antisymmetric to 1e-6; those of n = 0 and 1 lie between 60 and 224 Hz where the clamped
/// wheel has 150.6 and 100.0 Hz, and from n = 2 on the axle does not couple the wheels: pairs of both kinds.
#[test]
fn modes_are_symmetric_or_antisymmetric() {
    let given = wheelset(false);
    let forms = suspended(&given, [1e6; 3]);
    let mut table = Vec::new();
    for n in 0..5 {
        let (modes, parity) = modes(&given, &forms, n, 3000.0);
        let mass = forms.mass(n, modes.vectors.as_ref());
        let gram = modes.vectors.transpose() * mass;
        let off = Mat::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] - f64::from(u8::from(i == j)));
        assert!(off.norm_max() < 1e-9, "{n}");
        assert!(parity.iter().all(|p| (p.abs() - 1.0).abs() < 1e-6), "{n}: {parity:?}");
        let named: Vec<(f64, i32)> =
            modes.omega.iter().zip(&parity).map(|(w, p)| (hertz(*w), p.round() as i32)).collect();
        println!("{n}: {named:.2?}");
        table.push(named);
    }
    // Free torsion, lateral motion, and the first modes in which the axle bends or the wheels open like umbrellas.
    assert_eq!(table[0][0], (0.0, 1));
    for row in &table[2..] {
        for pair in row.chunks_exact(2).take(2) {
            assert!(pair[0].1 * pair[1].1 == -1 && (pair[1].0 / pair[0].0 - 1.0).abs() < 2e-4, "{pair:?}");
        }
    }
    let elastic = |n: usize| table[n].iter().filter(|(f, _)| (30.0..260.0).contains(f)).map(|(f, _)| *f);
    let range = elastic(0).chain(elastic(1)).fold([f64::INFINITY, 0.0], |r, f| [r[0].min(f), r[1].max(f)]);
    assert!((range[0] - 62.0).abs() < 2.0 && (range[1] - 224.0).abs() < 4.0, "{range:?}");
}

/// On soft springs the wheelset moves as a rigid body: heave √(2k/m), lateral motion √(2k_y/m), yaw and roll √(2kb²/I),
/// b = 1 m; the boxes exert no torque about the axle.
#[test]
fn on_soft_springs_it_moves_as_a_rigid_body() {
    let given = wheelset(true);
    let (k, lateral) = (2e4, 1e4);
    let forms = suspended(&given, [k, lateral, k]);
    let [mass, _, _, diametral] = forms.section.inertia(STEEL_OF_WHEELS);
    let (zero, parity) = modes(&given, &forms, 0, 20.0);
    let (one, kinds) = modes(&given, &forms, 1, 20.0);
    let near = |found: f64, square: f64| (found / square.sqrt() - 1.0).abs() < 1e-3;
    assert!(
        zero.omega.len() == 2 && zero.omega[0] == 0.0 && near(zero.omega[1], 2.0 * lateral / mass),
        "{:?}",
        zero.omega
    );
    // All of it moves to one side: what is mirrored moves to the other.
    assert!((parity[0] - 1.0).abs() < 1e-9 && (parity[1] + 1.0).abs() < 1e-9, "{parity:?}");
    assert!(near(one.omega[0], 2.0 * k / mass) && near(one.omega[1], 2.0 * k / diametral), "{:?}", one.omega);
    assert!(kinds[0] > 0.5 && kinds[1] < -0.5, "{kinds:?}");
    // Mean displacement of a heave at the bearings: 1/√m in the norm of both families, whose whole is π.
    let seen = forms.at_bearings(1, one.vectors.as_ref());
    assert!((seen[(0, 0)].abs() * mass.sqrt() - 1.0).abs() < 1e-3 && (seen[(0, 0)] - seen[(1, 0)]).abs() < 1e-6);
}

/// Statics of order 0 without the rigid torsion: the residual is the torque that is left out, and the motion has none
/// of it.
#[test]
fn statics_of_a_body_that_turns_freely_leave_the_torsion_out() {
    let given = wheelset(false);
    let forms = suspended(&given, [1e6; 3]);
    assert!(forms.turns_freely());
    assert!(!Forms::new(given.for_modes().unwrap(), STEEL_OF_WHEELS, &[SEATS.into()]).unwrap().turns_freely());
    let factor = forms.factor_free(Vec::new()).unwrap();
    let mut load = Mat::from_fn(forms.order(), 2, |i, k| ((i * (k + 3)) % 17) as f64 - 8.0);
    forms.make_regular(0, &mut load);
    let u = forms.solve_free(&factor, load.as_ref());
    let (rigid, _) = modes(&given, &forms, 0, 1.0);
    let torsion = rigid.vectors.as_ref().subcols(0, 1);
    let inertia = forms.mass(0, torsion);
    let torque = torsion.transpose() * &load;
    let left = &load - &inertia * &torque - forms.dynamic(0, 0.0, u.as_ref());
    assert!(left.norm_max() < 1e-6 * load.norm_max(), "{:e}", left.norm_max());
    let turned = (inertia.transpose() * &u).norm_max();
    assert!(turned < 1e-9 * (u.transpose() * forms.mass(0, u.as_ref())).norm_max().sqrt(), "{turned:e}");
}

/// Γ⁻¹BΓ⁻¹ of contacts on the treads of both wheels, in the frame of the one that carries y = 0.
fn both_treads(given: &SectionSource, patch: LoadPatch) -> (Mat<f64>, Vec<SectionContact>) {
    let there = RunningPlace { y: 0.0, height: None, opposite: true };
    let section = given.for_loads_at(&[there], &[patch.half()[1]; 2]).unwrap();
    assert!(Mirror::new(&section, given.middle().unwrap()).is_some(), "the meshes of both wheels differ");
    let at = |y: f64| Bearing { place: [0.0, y], stiffness: [1e6; 3] };
    let bearings = given.bearings(&section, &[at(-1.0), at(1.0)]).unwrap();
    let forms = Forms::new(section, STEEL_OF_WHEELS, &[]).unwrap().on_bearings(&bearings);
    let contacts = vec![given.contact(), given.contact_at(there)];
    assert_eq!(contacts[1].origin(), [0.46, 2.0 * given.middle().unwrap()]);
    let constant = Constant::of_contacts(&forms, &[vec![patch; 2]], &contacts).unwrap();
    let mut memory = Vec::new();
    let parts = (0..constant.blocks.len()).map(|k| constant.block(k, &mut memory).unwrap());
    (sum(parts.chain([constant.singles()])).swap_remove(0), contacts)
}

/// Contacts on both wheels: each does to itself what its mirror image does; what one does to the other, W_LR, is motion
/// of the whole wheelset on its springs and bending of its axle, and the modes have all of it but for 0.5 pm/N.
#[test]
fn both_wheels_act_on_each_other_by_the_modes_alone() {
    let patch = LoadPatch::Circle { radius: 6e-3 };
    let given = wheelset(false);
    let (all, contacts) = both_treads(&given, patch);
    let forms = suspended(&given, [1e6; 3]);
    let mut rest = all.clone();
    for n in 0..40 {
        let (modes, _) = modes(&given, &forms, n, 6000.0);
        let loads: Vec<LineLoad> = contacts.iter().map(|c| LineLoad::for_contact(&forms, patch, n, c)).collect();
        let found = modes::contact_functions(modes.vectors.as_ref(), &loads);
        for k in (0..modes.omega.len()).filter(|k| modes.omega[*k] > 0.0) {
            for family in 0..ContactModeData::families(n) {
                let shares = [loads[0].shares(family), loads[1].shares(family)].concat();
                let psi = Mat::from_fn(2 * LOADS, 1, |i, _| shares[i] * found[(i, k)] / modes.omega[k]);
                rest -= &psi * psi.transpose();
            }
        }
    }
    let (whole, left) = (pair_of(all.as_ref(), [0, 1]), pair_of(rest.as_ref(), [0, 1]));
    let largest = |of: &Square| (0..9).map(|k| 1e12 * of[k / 3][k % 3].abs()).fold(0.0, f64::max);
    println!("W_LR {:.1} pm/N, S_LR {:.3} pm/N", largest(&whole), largest(&left));
    assert!(largest(&whole) > 1e4 && largest(&left) < 0.5, "{} {}", largest(&whole), largest(&left));
    // Mirror images: forces along y and turns about x change their sign.
    let [own, other] = [[0, 0], [1, 1]].map(|c| pair_of(all.as_ref(), c));
    let odd = |k: usize| (k % 3 == 1) != (k / 3 == 2);
    for (i, j) in (0..81).map(|k| (k / 9, k % 9)) {
        let sign = if odd(i) == odd(j) { 1.0 } else { -1.0 };
        assert!((own[i][j] - sign * other[i][j]).abs() < 1e-6 * own[i][i].abs().max(own[j][j].abs()), "{i} {j}");
    }
}

/// A wheelset that turns about its axle as a whole moves both surfaces along x by its angle times the radius there, and
/// touches as before: nothing of a contact is tilted, in whatever frame, where elastic torsion tilts it.
#[test]
fn a_wheelset_that_turns_touches_as_before() {
    let patch = LoadPatch::Circle { radius: 6e-3 };
    let place = RunningPlace { y: -0.0385, height: Some(0.014), opposite: false };
    let given = wheelset(false);
    let forms = suspended(&given, [1e6; 3]);
    let (found, _) = modes(&given, &forms, 0, 1000.0);
    let contacts = [given.contact(), given.contact_at(place)];
    let loads: Vec<LineLoad> = contacts.iter().map(|c| LineLoad::for_contact(&forms, patch, 0, c)).collect();
    let seen = ContactModeData::new(&forms, &found, &loads, None).contact;
    let torsion = |k: &usize| seen[(0, *k)].abs() > 1e-3;
    let (free, held): (Vec<usize>, Vec<usize>) =
        (0..found.omega.len()).filter(torsion).partition(|k| found.omega[*k] == 0.0);
    assert!(free.len() == 1 && !held.is_empty(), "{:?}", found.omega);
    let turned = |c: usize| seen[(LOADS * c, free[0])] / contacts[c].radius();
    assert!((turned(0) / turned(1) - 1.0).abs() < 1e-3, "{} {}", turned(0), turned(1));
    let tilt = |k: usize| [4, 5, LOADS + 4, LOADS + 5].map(|row| seen[(row, k)]);
    assert_eq!(tilt(free[0]), [0.0; 4]);
    assert!(held.iter().all(|&k| tilt(k)[1].abs() > 1e-3), "{:?}", held.iter().map(|&k| tilt(k)).collect::<Vec<_>>());
    // Nothing else moves, but along x.
    let others = (0..2 * LOADS).filter(|row| ![0, 6].contains(&(row % LOADS)));
    assert!(others.map(|row| seen[(row, free[0])].abs()).fold(0.0, f64::max) < 1e-6 * seen[(0, free[0])].abs());
}

/// A contact on the face of a flange loads its own wheel alone: both faces lie at the same radii. On the other wheel
/// it is the mirror image.
#[test]
fn a_flange_contact_loads_one_wheel() {
    let shape = WheelShape::w920s_wheelset();
    let (patch, [y, height]) = (LoadPatch::Circle { radius: 4e-3 }, [0.0385, 0.014]);
    for mirrored in [false, true] {
        let given = SectionSource::Wheel(Wheel { shape: shape.clone(), offset: y, height: Some(height), mirrored });
        let middle = given.middle().unwrap();
        let there = RunningPlace { y, height: Some(height), opposite: true };
        let section = given.for_loads_at(&[there], &[patch.half()[1]; 2]).unwrap();
        let forms = Forms::new(section, STEEL_OF_WHEELS, &[]).unwrap();
        let contacts = [given.contact(), given.contact_at(there)];
        let [own, other] = [0, 1].map(|c: usize| contacts[c].origin());
        assert!((own[1] + other[1] - 2.0 * middle).abs() < 1e-12 && own[0] == other[0], "{own:?} {other:?}");
        for (contact, place) in contacts.iter().zip([own, other]) {
            let columns = LineLoad::for_contact(&forms, patch, 3, contact).columns(forms.order());
            let mut loaded = 0;
            for (node, [_, y]) in forms.section.nodes.iter().enumerate() {
                let Some(at) = forms.amplitude(node) else { continue };
                let load = (0..3).map(|c| columns.row(at + c).norm_l2()).fold(0.0, f64::max);
                assert!(load == 0.0 || (y - place[1]).abs() < 0.02, "{y} {place:?}");
                loaded += usize::from(load > 0.0);
            }
            assert!(loaded > 3, "{loaded}");
        }
    }
}

/// The right-hand wheelset is the mirror image of the left-hand one.
#[test]
fn left_and_right_are_mirror_images() {
    let patch = LoadPatch::Circle { radius: 6e-3 };
    let of = |mirrored: bool, n: usize| {
        let given = wheelset(mirrored);
        let forms = suspended(&given, [1e6, 2e6, 1e6]);
        let (modes, parity) = modes(&given, &forms, n, 2000.0);
        let found = modes::contact_functions(
            modes.vectors.as_ref(),
            &[LineLoad::for_contact(&forms, patch, n, &given.contact())],
        );
        (modes.omega, parity, found)
    };
    for n in 0..4 {
        let [left, right] = [false, true].map(|side| of(side, n));
        assert_eq!(left.0.len(), right.0.len());
        for k in 0..left.0.len() {
            assert!((left.0[k] - right.0[k]).abs() < 1e-8 * left.0[k].max(1e3), "{n} {k}");
            let product = |a: &Mat<f64>, b: &Mat<f64>, i: usize, j: usize| a[(i, k)] * b[(j, k)];
            // The sign of a vector is arbitrary, that of products is not.
            for (i, j, sign) in [(0, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0), (1, 2, -1.0)] {
                let [a, b] = [&left.2, &right.2].map(|s| product(s, s, i, j));
                assert!((a - sign * b).abs() < 1e-5 * left.2.norm_max().powi(2), "{n} {k} {i}{j}: {a:e} {b:e}");
            }
            assert!((left.1[k] - right.1[k]).abs() < 1e-6, "{n} {k}");
        }
    }
}

/// A wheelset of which one half is drawn, here the mesh of the built-in one, is the built-in wheelset: the same modes,
/// and the same places on either wheel, seen from both sides.
#[test]
fn a_wheelset_of_one_drawn_half_is_the_built_in_one() {
    let focus = Focus { size: 0.02, reach: 0.0, corner: 0.003, largest: 0.02 };
    let drawn_half = super::super::wheel::half(&WheelShape::w920s_wheelset(), 0.0, &[[0.46, 0.0]], focus);
    let faces: Vec<Vec<usize>> = drawn_half.elements.iter().map(|element| element.nodes.clone()).collect();
    let level = |edge: &&[usize; 3]| edge.iter().all(|&k| (drawn_half.nodes[k][0] - 0.46).abs() < 1e-9);
    let running: Vec<Vec<usize>> = drawn_half.tread.iter().filter(level).map(|edge| edge[..2].to_vec()).collect();
    let curves = [("running".to_owned(), running)].into();
    let made = |nodes| DrawnSection::new(Path::Axle, nodes, &faces, &curves, "running").unwrap();
    // A cut of which a corner is off by micrometres would leave a slit.
    let mut off = drawn_half.nodes.clone();
    off.iter_mut().filter(|x| x[0] == 0.0 && (x[1] - 0.75).abs() < 1e-9).for_each(|x| x[1] -= 2e-6);
    assert!(made(off).with_mirror_image(0.75).unwrap_err().message().contains("lies 2.0e-6 m beside it"));
    let drawn = made(drawn_half.nodes);
    for (middle, words) in [(0.7, "ends at x = 0.750000 m"), (0.8, "up to the middle of its axle and no farther")] {
        assert!(drawn.clone().with_mirror_image(middle).unwrap_err().message().contains(words));
    }
    let drawn = std::rc::Rc::new(drawn.with_mirror_image(0.75).unwrap());
    assert_eq!(drawn.reach(), [-0.065, 0.040]);
    for mirrored in [false, true] {
        let built = wheelset(mirrored);
        let given = SectionSource::DrawnSection { drawn: std::rc::Rc::clone(&drawn), offset: 0.0, mirrored };
        assert_eq!(given.middle(), built.middle());
        let forms = [&built, &given].map(|source| suspended(source, [1e6, 2e6, 1e6]));
        for n in 0..4 {
            let [(wanted, kinds), (found, parities)] =
                [(&built, 0), (&given, 1)].map(|(source, k)| modes(source, &forms[k], n, 1500.0));
            assert!(wanted.omega.len() == found.omega.len() && found.omega.len() > 1);
            let rigid = |w: f64| w < 2.0 * PI;
            for (a, b) in wanted.omega.iter().zip(&found.omega).filter(|(a, _)| !rigid(**a)) {
                assert!((a / b - 1.0).abs() < 1e-8, "order {n}: {a} {b}");
            }
            assert!(kinds.iter().zip(&parities).all(|(a, b)| (a - b).abs() < 1e-6), "{kinds:?} {parities:?}");
        }
        let there = RunningPlace { y: 0.012, height: Some(0.0), opposite: true };
        let [wanted, found] = [&built, &given].map(|source| source.contact_at(there).origin());
        assert!((0..2).all(|c| (wanted[c] - found[c]).abs() < 1e-12), "{wanted:?} {found:?}");
        let section = given.for_loads_at(&[there], &[6e-3; 2]).unwrap();
        let edges = section.running_at(found[1]);
        let near = |edge: &&[usize; 3]| (section.nodes[edge[2]][1] - found[1]).abs() < 6e-3;
        let longest = edges.iter().filter(near).map(|edge| section.length(edge)).fold(0.0, f64::max);
        assert!(longest > 0.0 && longest <= 2e-3 + 1e-12, "{longest}");
    }
}
