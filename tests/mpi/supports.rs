//! Bodies on springs, dashpots and planes of symmetry, with masses, with ends that absorb, and bodies that nothing
//! holds: against closed forms.

use crate::dense::dense;
use crate::elasticity::{block, group};
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;
use railsqueal::body::elements::{Elements, StaticMethod};
use railsqueal::body::fe::FeBody;
use railsqueal::body::modes::Extent;
use railsqueal::body::statics::Statics;
use railsqueal::body::{ElasticBody, TraceModes};
use railsqueal::eigen::sparse;
use railsqueal::fem::ElasticMaterial;
use railsqueal::job::{Absorbing, Component, Dampings, Per, Stiffnesses, Support};
use railsqueal::mesh::Mesh;
use railsqueal::parallel::World;
use railsqueal::petsc::Petsc;
use railsqueal::swept::{self, cylinder, CylinderSection, EdgeSprings, Focus, Forms};
use std::f64::consts::PI;

const STEEL: ElasticMaterial = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 };
/// Material without lateral contraction.
const PLAIN: ElasticMaterial = ElasticMaterial { young: 205e9, poisson: 0.0, density: 7800.0 };

fn on(group: &str) -> Support {
    Support { group: group.into(), ..Support::default() }
}

fn body(world: &World, mesh: &Mesh, material: ElasticMaterial, fixed: &[&str], supports: &[Support]) -> FeBody {
    let fixed: Vec<String> = fixed.iter().map(|g| g.to_string()).collect();
    FeBody::held(world, "block", world.is_root().then_some(mesh), &[], material, (&fixed, supports)).expect("a body")
}

/// Collective: modes and residuals of a body.
fn modes(world: &World, fe: FeBody, count: usize, by: sparse::Method) -> TraceModes {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let mut body = Elements::new(&petsc, fe, StaticMethod::Direct).with_modes_by(by);
    body.factorise().unwrap();
    body.modes(Extent::Count(count), &mut |_, _| {}).unwrap()
}

/// A bar along x of `n` elements over `length`, 0.1 m × 0.1 m, with the groups `left`, `right`, and `sides_y`,
/// `sides_z` along it.
fn bar(n: usize, length: f64) -> Mesh {
    let mut mesh = block([n, 1, 1], [length, 0.1, 0.1], |x| x);
    let id = |i: usize, j: usize, k: usize| (i + (n + 1) * (j + 2 * k)) as u32;
    let along = |face: &dyn Fn(usize) -> [u32; 4]| (0..n).map(face).collect::<Vec<_>>();
    let y = |j: usize| along(&|i| [id(i, j, 0), id(i + 1, j, 0), id(i + 1, j, 1), id(i, j, 1)]);
    let z = |k: usize| along(&|i| [id(i, 0, k), id(i + 1, 0, k), id(i + 1, 1, k), id(i, 1, k)]);
    group(&mut mesh, "sides_y", &[y(0), y(1)].concat());
    group(&mut mesh, "sides_z", &[z(0), z(1)].concat());
    mesh
}

/// All that a bar can then do is to stretch.
fn straight() -> Vec<Support> {
    vec![
        Support { clamped: vec![Component::Y], ..on("sides_y") },
        Support { clamped: vec![Component::Z], ..on("sides_z") },
    ]
}

/// Lowest root of f between `a` and `b`.
fn root(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let m = 0.5 * (a + b);
        if f(a) * f(m) <= 0.0 {
            b = m;
        } else {
            a = m;
        }
    }
    0.5 * (a + b)
}

fn near(found: f64, exact: f64, tolerance: f64, what: &str) {
    assert!((found / exact - 1.0).abs() < tolerance, "{what}: {found:e}, exact {exact:e}");
}

/// A block on springs and dashpots all over one face: the six motions of a rigid one, their damping, and the balance
/// of a static load.
pub fn a_block_on_springs(world: &World) {
    let size = [0.3, 0.2, 0.1];
    let [l, b, h] = size;
    let mesh = block([3, 2, 2], size, |x| x);
    let [kx, ky, kz] = [1e6, 2e6, 5e5];
    let mass = STEEL.density * l * b * h;
    let c = 30.0;
    let springs = Support {
        stiffness: Some(Stiffnesses { y: ky, z: kz, normal: kx, ..Stiffnesses::default() }),
        damping: Some(Dampings { x: c, ..Dampings::default() }),
        ..on("left")
    };
    let fe = body(world, &mesh, STEEL, &[], std::slice::from_ref(&springs));
    assert!(fe.supported && fe.rigid.is_empty());
    let found = modes(world, fe, 6, sparse::Method::Blocks);
    // Motions along a with the rotation that they take with them: the face lies at half the length from the middle.
    let pair = |k: f64, width: f64| {
        let (m2, k11, k12) = (mass * (l * l + width * width) / 12.0, k, -0.5 * k * l);
        let k22 = 0.25 * k * l * l + kx * width * width / 12.0;
        let (a, p, q) = (mass * m2, k11 * m2 + k22 * mass, k11 * k22 - k12 * k12);
        let root = (p * p - 4.0 * a * q).sqrt();
        [(p - root) / (2.0 * a), (p + root) / (2.0 * a)]
    };
    let twist = (ky * h * h + kz * b * b) / 12.0 / (mass * (b * b + h * h) / 12.0);
    let mut exact: Vec<f64> = [&[kx / mass, twist][..], &pair(ky, b), &pair(kz, h)].concat();
    exact.sort_by(f64::total_cmp);
    for (w, squared) in found.omega.iter().zip(&exact) {
        // The block gives way by some 1e-4 of what the springs do.
        near(w * w, *squared, 1e-3, "ω² of a block on springs");
    }
    if let Some(damping) = &found.damping {
        let along = exact.iter().position(|s| *s == kx / mass).unwrap();
        near(damping[(along, along)], c / mass, 1e-3, "damping of the motion along x");
        let trace = (0..6).map(|k| damping[(k, k)]).sum::<f64>();
        // Rotations about y and z take the dashpots along as well: c h²/12 and c b²/12 over the moments of inertia.
        let turning = [h, b].map(|w| c * w * w / (mass * (l * l + w * w)));
        near(trace, c / mass + turning[0] + turning[1], 1e-3, "damping of all six motions");
        assert!((0..6).all(|i| (0..6).all(|j| (damping[(i, j)] - damping[(j, i)]).abs() < 1e-12 * trace)));
    }
    // Per area it is the same, and a loss factor is a dashpot at its frequency.
    let area = b * h;
    let per = Support {
        stiffness: Some(Stiffnesses { x: kx / area, ..Stiffnesses::default() }),
        damping: None,
        loss_factor: Some(0.1),
        loss_frequency: Some(50.0),
        per: Per::Area,
        ..on("left")
    };
    let rest = Support {
        stiffness: Some(Stiffnesses { y: ky, z: kz, ..Stiffnesses::default() }),
        damping: None,
        ..springs.clone()
    };
    let again = modes(world, body(world, &mesh, STEEL, &[], &[per, rest]), 6, sparse::Method::Blocks);
    for (a, b) in again.omega.iter().zip(&found.omega) {
        // Rounding of a stiffness of some 5e10 N/m beside the modal one of the lowest motion, 2.6e4 N/m: 4e-10 of ω²,
        // times a few.
        near(*a, *b, 3e-9, "ω by springs per area");
    }
    if let (Some(lossy), Some(dashpots)) = (&again.damping, &found.damping) {
        near(lossy[(0, 0)] / dashpots[(0, 0)], 0.1 * kx / (2.0 * PI * 50.0) / c, 1e-9, "damping by a loss factor");
    }
    // A force on the far face is borne by the springs alone: F = ∫ k u dA.
    let fe = body(world, &mesh, STEEL, &[], &[springs]);
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let mut solver = Statics::direct(&petsc, &fe).unwrap();
    let at = |n: usize, x: f64| (fe.part.coords[n][0] - x).abs() < 1e-9;
    let mut u: Vec<f64> =
        (0..fe.part.owned).flat_map(|n| if at(n, l) { [1e3 / 9.0, 0.0, 0.0] } else { [0.0; 3] }).collect();
    solver.solve(&mut u, 1).unwrap();
    // Three by three nodes: the weights of the trapezoidal rule.
    let weight = |n: usize| {
        let edge = |c: usize| [0.0, size[c]].iter().any(|e| (fe.part.coords[n][c] - e).abs() < 1e-9);
        [1, 2].map(|c| if edge(c) { 0.25 } else { 0.5 }).iter().product::<f64>()
    };
    let mean = world.sum((0..fe.part.owned).filter(|&n| at(n, 0.0)).map(|n| weight(n) * u[3 * n]).sum());
    near(mean, 1e3 / kx, 1e-9, "displacement of the springs under a load");
}

/// Bars that only stretch: a mass at the end, a spring at the end, and what a dashpot makes of the lowest mode of a
/// stiff one.
pub fn a_bar_with_a_mass(world: &World) {
    let (length, area) = (2.0, 0.01);
    let mesh = bar(40, length);
    let own = PLAIN.density * area * length;
    let (speed, stiff) = ((PLAIN.young / PLAIN.density).sqrt(), PLAIN.young * area / length);
    let lowest = |fixed: &[&str], end: Support| {
        let supports: Vec<Support> = straight().into_iter().chain([end]).collect();
        modes(world, body(world, &mesh, PLAIN, fixed, &supports), 2, sparse::Method::Blocks).omega[0] * length / speed
    };
    // Linear elements are too stiff by (kh)²/24 in ω: some 1e-4 of it.
    let (mass, spring) = (80.0, 3e8);
    let end = Support { mass: Some(mass), ..on("right") };
    let exact = root(1e-6, 0.5 * PI - 1e-6, |x| x * x.tan() - own / mass);
    near(lowest(&["left"], end), exact, 1e-4, "bar with a mass");
    let end = Support { stiffness: Some(Stiffnesses { x: spring, ..Stiffnesses::default() }), ..on("right") };
    let exact = root(1e-6, 0.5 * PI - 1e-6, |x| x * x.tan() - spring / stiff);
    near(lowest(&[], end), exact, 1e-4, "free bar on a spring");
    // What of the energy of a mode is in the spring: of u = cos(ξx/L) that at the end, by the closed form. Springs
    // without a loss factor do not count.
    let lossy = |eta: Option<f64>| {
        let stiffness = Some(Stiffnesses { x: spring, ..Stiffnesses::default() });
        let end = Support { stiffness, loss_factor: eta, loss_frequency: eta.map(|_| 500.0), ..on("right") };
        let supports: Vec<Support> = straight().into_iter().chain([end]).collect();
        modes(world, body(world, &mesh, PLAIN, &[], &supports), 2, sparse::Method::Blocks)
    };
    let found = lossy(Some(0.2));
    let share = spring * exact.cos().powi(2) / (own * (0.5 + 0.25 * (2.0 * exact).sin() / exact));
    near(found.springs[0], share, 1e-3, "what the mode has in the spring");
    assert!(found.springs[0] > 0.1 * found.omega[0].powi(2) && lossy(None).springs.is_empty());
    // Its own loss is in the damping matrix, at its own frequency.
    if let Some(damping) = &found.damping {
        near(damping[(0, 0)], 0.2 * found.springs[0] / (2.0 * PI * 500.0), 1e-9, "what the spring loses");
    }
    // A mass per area is that mass.
    let per = Support { mass: Some(mass / area), per: Per::Area, ..on("right") };
    let exact = root(1e-6, 0.5 * PI - 1e-6, |x| x * x.tan() - own / mass);
    near(lowest(&["left"], per), exact, 1e-4, "bar with a mass per area");
}

/// The end of a rod that absorbs: the receptance at the other end is that of a rod without end, 1/(iωρcA); and what
/// comes back without it. Waves that are shorter than the end are taken up by the mass, long ones by dashpots.
pub fn a_rod_that_absorbs(world: &World) {
    let (length, area, n) = (5.0, 0.01, 100);
    let mesh = bar(n, length);
    let speed = (PLAIN.young / PLAIN.density).sqrt();
    // Largest part by which the receptance is off that of the endless rod.
    let off = |rate: f64, longitudinal: Option<f64>, frequencies: &[f64]| -> f64 {
        let end = Support { absorbing: Some(Absorbing { depth: 4.0, rate, longitudinal }), ..on("right") };
        let supports: Vec<Support> = straight().into_iter().chain([end]).collect();
        let fe = body(world, &mesh, PLAIN, &[], &supports);
        assert_eq!(fe.rigid.len(), 1, "along x");
        let [k, m] = [&*fe.operators.stiffness, &fe.operators.mass].map(|a| dense(world, a));
        let c = fe.effect.damping.as_ref().map(|c| dense(world, c));
        // Only what moves along x, the four nodes of a section alike.
        let own = (0..fe.part.owned).map(|i| (fe.part.coords[i][0] * n as f64 / length).round() as u64);
        let section = world.all_gather(&own.collect::<Vec<u64>>());
        let one = |omega: f64| {
            let mut dynamic = Mat::<Complex<f64>>::zeros(n + 1, n + 1);
            for (i, &p) in section.iter().enumerate() {
                for (j, &q) in section.iter().enumerate() {
                    let at = (3 * i, 3 * j);
                    let damping = c.as_ref().map_or(0.0, |c| c[at]);
                    dynamic[(p as usize, q as usize)] += Complex::new(k[at] - omega * omega * m[at], omega * damping);
                }
            }
            let mut load = Mat::<Complex<f64>>::zeros(n + 1, 1);
            load[(0, 0)] = Complex::from(1.0);
            dynamic.partial_piv_lu().solve_in_place(&mut load);
            let endless = 1.0 / Complex::new(0.0, omega * PLAIN.density * speed * area);
            (load[(0, 0)] / endless - 1.0).norm()
        };
        frequencies.iter().map(|f| one(2.0 * PI * f)).fold(0.0, f64::max)
    };
    let (short, long) = ([4e3, 4.5e3, 5e3], [100.0, 300.0, 1000.0]);
    let worst = [off(25e3, None, &short), off(0.0, None, &short), off(6e3, Some(1.0), &long), off(6e3, None, &long)];
    if world.is_root() && std::env::var("SUPPORTS").is_ok() {
        println!(
            "rod: off by {worst:?} of the endless rod's receptance: short waves with and without \
         absorption, long ones with and without dashpots"
        );
    }
    // ∫α ds = 6.5 c: 0.15 % comes back by ray theory, elements of a 20th of the wave add (kh)²/12, 0.8 %.
    assert!(worst[0] < 0.02, "{worst:?} of the endless rod's receptance");
    assert!(worst[1] > 0.5, "{worst:?} of the endless rod's receptance");
    // Dashpots need no damping by the mass.
    let alone = off(0.0, Some(1.0), &long);
    assert!((alone - worst[2]).abs() < 1e-9, "{alone} by dashpots alone, {worst:?}");
    // Elements of a hundredth of the shortest of these waves are all that is missing.
    assert!(worst[2] < 1e-3, "{worst:?} of the endless rod's receptance");
    assert!(worst[3] > 0.5, "{worst:?} of the endless rod's receptance");
}

/// A bar that nothing holds, pulled at one end: u = F/EA (x²/2L − L/6) with its origin at the other end; and entries
/// of its compliance.
pub fn a_free_bar_is_balanced(world: &World) {
    let (length, area, force) = (2.0, 0.01, 1e4);
    let mesh = bar(20, length);
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let fe = body(world, &mesh, PLAIN, &[], &[]);
    assert_eq!((fe.rigid.len(), fe.supported), (6, false));
    let mut solver = Statics::direct(&petsc, &fe).unwrap();
    let end = |n: usize| (fe.part.coords[n][0] - length).abs() < 1e-9;
    let mut u: Vec<f64> =
        (0..fe.part.owned).flat_map(|n| if end(n) { [0.25 * force, 0.0, 0.0] } else { [0.0; 3] }).collect();
    solver.solve(&mut u, 1).unwrap();
    let scale = force * length / (PLAIN.young * area);
    for n in 0..fe.part.owned {
        let x = fe.part.coords[n][0] / length;
        let exact = [scale * (0.5 * x * x - 1.0 / 6.0), 0.0, 0.0];
        // The mean of a chain of straight pieces misses that of the parabola by 1/12 of the square of their length.
        let off = (0..3).map(|c| (u[3 * n + c] - exact[c]).abs()).fold(0.0, f64::max);
        assert!(off < 5e-4 * scale, "{:?} at {x}, exact {exact:?}", &u[3 * n..3 * n + 3]);
    }
    let rigid = fe.rigid.loads.iter().map(|l| world.sum(l.iter().zip(&u).map(|(l, u)| l * u).sum::<f64>()).abs());
    assert!(rigid.fold(0.0, f64::max) < 1e-9 * scale * 156f64.sqrt(), "a part of the displacement is rigid");
    // Degrees of freedom at the ends, where the body is held for the factorisation, and within.
    let total = fe.dofs.total();
    let rows: Vec<u64> = (0..12).chain(60..66).chain(total - 12..total).collect();
    let block = solver.inverse_block(&rows, &mut |_, _| {}).unwrap();
    let own = fe.dofs.first()..fe.dofs.first() + fe.dofs.owned() as u64;
    for (j, column) in rows.iter().enumerate() {
        let mut v = vec![0.0; fe.dofs.owned()];
        if own.contains(column) {
            v[(column - own.start) as usize] = 1.0;
        }
        solver.solve(&mut v, 1).unwrap();
        let mine: Vec<f64> =
            rows.iter().map(|r| if own.contains(r) { v[(r - own.start) as usize] } else { 0.0 }).collect();
        let all = world.sum_all(&mine);
        if world.is_root() {
            let largest = all.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            for (i, v) in all.iter().enumerate() {
                assert!((block[(i, j)] - v).abs() < 1e-7 * largest, "({i}, {j}): {} and {v}", block[(i, j)]);
            }
        }
    }
}

/// Rigid motions: six of a free block, fewer of one that is held in part, none of them an eigenvalue of a method; the
/// elastic modes are those of another one.
pub fn what_supports_leave_free(world: &World) {
    let size = [0.3, 0.2, 0.1];
    let mesh = block([5, 3, 2], size, |x| x);
    let free = |fixed: &[&str], supports: &[Support]| body(world, &mesh, STEEL, fixed, supports).rigid.len();
    let clamped = |components: &[Component]| Support { clamped: components.to_vec(), ..on("left") };
    let spring = |stiffness: Stiffnesses| Support { stiffness: Some(stiffness), ..on("left") };
    use Component::{X, Y, Z};
    assert_eq!(free(&[], &[]), 6);
    assert_eq!(free(&["left"], &[]), 0);
    assert_eq!(free(&[], &[clamped(&[X, Y, Z])]), 0);
    assert_eq!(free(&[], &[clamped(&[X])]), 3, "motions in the plane");
    assert_eq!(
        free(&[], &[clamped(&[Y])]),
        4,
        "x, z, the rotations about y and about the line through the face along z"
    );
    assert_eq!(free(&[], &[clamped(&[X, Y])]), 1, "along z");
    assert_eq!(free(&[], &[Support { symmetry: true, ..on("right") }]), 3);
    assert_eq!(free(&[], &[spring(Stiffnesses { normal: 1e3, ..Stiffnesses::default() })]), 3);
    let weak = spring(Stiffnesses { x: 1e9, y: 1e9, z: 1.0, normal: 0.0 });
    assert_eq!(free(&[], &[weak]), 0, "a weak spring is one");
    assert_eq!(free(&[], &[Support { mass: Some(3.0), ..on("left") }]), 6);
    let of = |count: usize, by: sparse::Method| modes(world, body(world, &mesh, STEEL, &[], &[]), count, by).omega;
    let (blocks, slepc) = (of(16, sparse::Method::Blocks), of(16, sparse::Method::Slepc));
    assert!(blocks[..6].iter().chain(&slepc[..6]).all(|w| *w == 0.0) && blocks[6] > 1e3);
    for (a, b) in blocks[6..].iter().zip(&slepc[6..]) {
        near(*a, *b, 1e-8, "elastic mode of a free block");
    }
    // Whatever their number, and of a material that is nearly incompressible.
    let stiff = ElasticMaterial { poisson: 0.4999999, ..STEEL };
    for (material, count) in [(STEEL, 7), (STEEL, 9), (STEEL, 23), (STEEL, 40), (stiff, 12)] {
        let of = |by| modes(world, body(world, &mesh, material, &[], &[]), count, by).omega;
        let (blocks, slepc) = (of(sparse::Method::Blocks), of(sparse::Method::Slepc));
        assert_eq!(blocks.len(), slepc.len(), "{count} modes of {material:?}");
        for (a, b) in blocks[6..].iter().zip(&slepc[6..]) {
            near(*a, *b, 1e-8, "elastic mode by SLEPc");
        }
    }
    // Enough of them to be found in slices.
    let many = of(180, sparse::Method::Blocks);
    assert!(many.len() >= 180 && many[..6].iter().all(|w| *w == 0.0));
    for (a, b) in blocks[6..].iter().zip(&many[6..]) {
        near(*a, *b, 1e-8, "elastic mode in a slice");
    }
}

/// One half of a block with a plane of symmetry has those modes of the whole one that are symmetric.
pub fn half_of_a_block(world: &World) {
    let whole = block([6, 3, 2], [0.6, 0.2, 0.1], |x| x);
    let half = block([3, 3, 2], [0.3, 0.2, 0.1], |x| x);
    let of = |mesh: &Mesh, supports: &[Support], count: usize| {
        modes(world, body(world, mesh, STEEL, &[], supports), count, sparse::Method::Blocks).omega
    };
    let all = of(&whole, &[], 40);
    let symmetric = of(&half, &[Support { symmetry: true, ..on("right") }], 10);
    assert!(symmetric[..3].iter().all(|w| *w == 0.0) && symmetric[3] > 1e3, "{symmetric:?}");
    for w in &symmetric[3..] {
        let nearest = all.iter().map(|v| (v / w - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-9, "{w} rad/s is none of {all:?}");
    }
}

/// A swept ring on soft springs moves as a rigid one: along its axle, across it, and round it.
pub fn a_swept_ring_on_springs(_: &World) {
    let (inner, outer, width) = (0.1, 0.3, 0.1);
    let ring = CylinderSection {
        inner_radius: inner,
        outer_radius: outer,
        thickness: width,
        crown_radius: None,
        contact_offset: 0.0,
    };
    let focus = Focus { size: 0.03, reach: 0.0, corner: 0.03, largest: 0.03 };
    let section = cylinder(&ring, focus).expect("a section");
    let mass = STEEL.density * PI * (outer * outer - inner * inner) * width;
    let (across, along) = (2e6, 1e6);
    let springs = |stiffness: [f64; 3], per_area: bool| EdgeSprings { group: "inner".into(), stiffness, per_area };
    let lowest = |n: usize, springs: &[EdgeSprings]| -> Vec<f64> {
        let forms = Forms::sprung(section.clone(), STEEL, &[], springs).expect("forms");
        swept::modes::of_order(&forms, n, 2.0 * PI * 300.0).expect("modes").omega
    };
    let all = springs([across, along, 0.0], false);
    let zero = lowest(0, std::slice::from_ref(&all));
    let polar = 0.5 * mass * (outer * outer + inner * inner);
    let mut exact = [along / mass, across * inner * inner / polar];
    exact.sort_by(f64::total_cmp);
    for (w, squared) in zero.iter().zip(exact) {
        near(w * w, squared, 1e-3, "order 0 of a ring on springs");
    }
    let one = lowest(1, &[all]);
    // The section is its own mirror image: moving across does not tilt it.
    let tilt = (0.25 * (outer * outer + inner * inner) + width * width / 12.0) * mass;
    let tilting = 0.5 * along * inner * inner + across * width * width / 12.0;
    let mut exact = [across / mass, tilting / tilt];
    exact.sort_by(f64::total_cmp);
    for (w, squared) in one.iter().zip(exact) {
        near(w * w, squared, 1e-3, "order 1 of a ring on springs");
    }
    // Springs along the normal of the bore resist half of what both directions do, and nothing along the axle.
    let area = 2.0 * PI * inner * width;
    let radial = lowest(1, &[springs([0.0, 0.0, across / area], true)]);
    assert!(radial.iter().any(|w| (w * w * mass / (0.5 * across) - 1.0).abs() < 1e-3), "{radial:?}");
}
