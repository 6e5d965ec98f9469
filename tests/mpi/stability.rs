//! Stability of the full system against a dense solution of the same equations, assembled here from the formulas.

use crate::elasticity::block;
use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;
use railsqueal::analysis::stability::full::{spectrum, Damping, FullOptions, FullSpectrum};
use railsqueal::body::fe::FeBody;
use railsqueal::contact::SlidingContact;
use railsqueal::fem::Material;
use railsqueal::mesh::grid::ContactGrid;
use railsqueal::parallel::World;
use railsqueal::petsc::csr::DistCsr;
use railsqueal::petsc::Petsc;
use railsqueal::progress::Progress;
use std::f64::consts::PI;

type C = Complex<f64>;

const SPEED: f64 = 8.0;

/// A block under the plane z = 0, held at its lower face, with the contact surface on top.
fn body(world: &World, name: &str, layers: usize, young: f64) -> FeBody {
    let depth = 0.05 * layers as f64;
    let mut mesh = block([4, 3, layers], [0.2, 0.15, depth], |x| x);
    for p in &mut mesh.nodes {
        *p = [p[0] - 0.1, p[1] - 0.075, p[2] - depth];
    }
    let row = |j: usize, z: usize| (5 * (j + 4 * z)) as u32;
    let face = |z: usize| -> Vec<[u32; 4]> {
        (0..3)
            .flat_map(|j| {
                (0..4u32).map(move |i| [row(j, z) + i, row(j, z) + i + 1, row(j + 1, z) + i + 1, row(j + 1, z) + i])
            })
            .collect()
    };
    mesh.groups.insert("contact".into(), face(layers));
    mesh.groups.insert("foot".into(), face(0).into_iter().map(|[a, b, c, d]| [a, d, c, b]).collect());
    let grid = world.is_root().then(|| ContactGrid::from_mesh(&mesh, "contact").unwrap());
    let material = Material { young, poisson: 0.3, density: 7800.0 };
    FeBody::new(world, name, world.is_root().then_some(&mesh), grid, material, &["foot".into()]).unwrap()
}

/// Six closed nodes in the middle of the 5 × 4 grid; forces, directions and velocities differ from node to node.
fn contact() -> SlidingContact {
    let nodes = vec![6, 7, 8, 11, 12, 13];
    let turn = |i: usize| 1.4 + 0.1 * i as f64;
    SlidingContact {
        force: (0..6).map(|i| 6e3 + 700.0 * i as f64).collect(),
        direction: (0..6).map(|i| [turn(i).cos(), turn(i).sin()]).collect(),
        velocity: (0..6).map(|i| 0.1 + 0.01 * i as f64).collect(),
        friction: vec![0.4; 6],
        slope: vec![-0.02; 6],
        convection: nodes.iter().map(|&n| vec![(n, SPEED / 0.05), (n - 1, -SPEED / 0.05)]).collect(),
        nodes,
    }
}

/// The matrix on every rank.
fn dense(world: &World, a: &DistCsr) -> Mat<f64> {
    let n = a.order() as usize;
    let first = a.ranges[world.rank] as usize;
    let mut values = vec![0.0; n * n];
    for i in 0..a.n_local() {
        for (&c, &v) in a.row(i).0.iter().zip(a.row(i).1) {
            values[(first + i) * n + c as usize] = v;
        }
    }
    let values = world.sum_all(&values);
    Mat::from_fn(n, n, |i, j| values[i * n + j])
}

/// [K, C, M] of the whole system, unknowns (u1, u2, r), every rank: w = u1 − u2, gap change = (u2 − u1)·z with the upper body reflected in z.
fn matrices(world: &World, bodies: [&FeBody; 2], damping: [Damping; 2], s: &SlidingContact) -> [Mat<f64>; 3] {
    let rows = bodies.map(|b| b.contact_rows(world).unwrap());
    let sizes = bodies.map(|b| b.dofs.total() as usize);
    let (n, k) = (sizes[0] + sizes[1], s.nodes.len());
    let [mut stiff, mut damp, mut mass] = [0, 1, 2].map(|_| Mat::<f64>::zeros(n + k, n + k));
    let first = [0, sizes[0]];
    for b in 0..2 {
        let (kb, mb) = (dense(world, &bodies[b].operators.stiffness), dense(world, &bodies[b].operators.mass));
        for i in 0..sizes[b] {
            for j in 0..sizes[b] {
                let at = (first[b] + i, first[b] + j);
                stiff[at] = kb[(i, j)];
                mass[at] = mb[(i, j)];
                damp[at] = damping[b].alpha * mb[(i, j)] + damping[b].beta * kb[(i, j)];
            }
        }
    }
    // Unknowns and factors that make w_x, w_y and the opening of a node. Both bodies are kept in lower form, so the opening is minus the sum of
    // their z displacements.
    let motion = |node: usize, c: usize| {
        let sign = if c == 2 { [-1.0, -1.0] } else { [1.0, -1.0] };
        [0, 1].map(|b| (first[b] + rows[b][3 * node + c] as usize, sign[b]))
    };
    for (i, &node) in s.nodes.iter().enumerate() {
        let t = s.direction[i];
        for p in 0..2 {
            for q in 0..2 {
                let across = s.friction[i] * s.force[i] / s.velocity[i];
                let same = if p == q { 1.0 } else { 0.0 };
                let d = across * (same - t[p] * t[q]) + s.slope[i] * s.force[i] * t[p] * t[q];
                for (row, a) in motion(node, p) {
                    for (column, b) in motion(node, q) {
                        damp[(row, column)] += a * d * b;
                    }
                    for &(other, v) in &s.convection[i] {
                        for (column, b) in motion(other, q) {
                            stiff[(row, column)] += a * d * v * b;
                        }
                    }
                }
            }
            for (row, a) in motion(node, p) {
                stiff[(row, n + i)] += a * s.friction[i] * t[p];
            }
        }
        for (row, a) in motion(node, 2) {
            stiff[(row, n + i)] -= a;
            stiff[(n + i, row)] += a;
        }
    }
    [stiff, damp, mass]
}

/// All finite eigenvalues by one dense shift and inversion of the companion form.
fn eigenvalues(matrices: &[Mat<f64>; 3], unknowns: usize, rate: f64) -> Vec<C> {
    let n = matrices[0].nrows();
    let largest = (0..n).map(|i| matrices[0][(i, i)].abs()).fold(0.0, f64::max);
    // Multipliers in units of the stiffness, time in units of 1/rate.
    let unit = |i: usize| if i < unknowns { 1.0 / largest.sqrt() } else { largest.sqrt() };
    let scaled = |p: i32| {
        let m = &matrices[p as usize];
        Mat::from_fn(n, n, |i, j| m[(i, j)] * unit(i) * unit(j) * rate.powi(p))
    };
    let [k, c, m] = [scaled(0), scaled(1), scaled(2)];
    let shift = 0.37;
    // [0 I; −K −C] x = λ [I 0; 0 M] x.
    let e = Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
        (true, true) if i == j => 1.0,
        (false, false) => m[(i - n, j - n)],
        _ => 0.0,
    });
    let a = Mat::from_fn(2 * n, 2 * n, |i, j| {
        let plain = match (i < n, j < n) {
            (true, false) if i + n == j => 1.0,
            (false, true) => -k[(i - n, j)],
            (false, false) => -c[(i - n, j - n)],
            _ => 0.0,
        };
        plain - shift * e[(i, j)]
    });
    let theta = a.partial_piv_lu().solve(&e).eigenvalues().unwrap();
    let top = theta.iter().map(|t| t.norm()).fold(0.0, f64::max);
    theta.into_iter().filter(|t| t.norm() > 1e-10 * top).map(|t| (shift + t.inv()) * rate).collect()
}

/// The spectrum of the program and of the dense solution, and the dense matrices.
fn both(
    world: &World,
    bodies: &[FeBody],
    places: [(usize, Damping); 2],
    tolerance: f64,
) -> (railsqueal::Result<FullSpectrum>, Vec<C>, [Mat<f64>; 3]) {
    let s = contact();
    let pair = places.map(|p| &bodies[p.0]);
    let matrices = matrices(world, pair, places.map(|p| p.1), &s);
    let unknowns = matrices[0].nrows() - s.nodes.len();
    let exact = eigenvalues(&matrices, unknowns, 2.0 * PI * 15e3);
    let options = FullOptions { max_frequency: LIMIT, damping_ratio: 0.2, count: 12, tolerance };
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let found = spectrum(&petsc, bodies, places, &s, &exact, &[], &options, &mut Progress::new(false));
    (found, exact, matrices)
}

const LIMIT: f64 = 40e3;

fn compare(world: &World, bodies: &[FeBody], places: [(usize, Damping); 2]) {
    let (found, exact, matrices) = both(world, bodies, places, 1e-9);
    let found = found.unwrap();
    assert!(found.shifts.len() > 1, "one shift only");
    // Every dense eigenvalue of the promised wedge is there, once, and nothing else.
    let slope = 0.2 / (1.0f64 - 0.04).sqrt();
    let promised: Vec<C> = exact
        .iter()
        .copied()
        .filter(|v| v.im > 0.0 && v.im <= 2.0 * PI * LIMIT && v.re.abs() <= slope * v.im)
        .collect();
    assert!(promised.len() > 15, "{} eigenvalues of {}", promised.len(), exact.len());
    let near = |a: C, b: C| (a - b).norm() < 1e-8 * b.norm();
    for v in &promised {
        let twins = promised.iter().filter(|w| near(**w, *v)).count();
        let hits = found.pairs.iter().filter(|p| near(p.value, *v)).count();
        assert_eq!(hits, twins, "{v} of {promised:?}");
    }
    let (s, n) = (contact(), matrices[0].nrows());
    let conjugate = |v: C| exact.iter().any(|w| near(*w, v.conj()));
    let rows: Vec<Vec<u64>> = places.iter().map(|p| bodies[p.0].contact_rows(world).unwrap()).collect();
    for p in &found.pairs {
        assert!(exact.iter().any(|v| near(p.value, *v)), "{} is not an eigenvalue", p.value);
        assert!(conjugate(p.value), "{} has no conjugate", p.value);
        // The eigenvector in the equations assembled here.
        let mut x: Vec<C> = p.motion.iter().flat_map(|u| world.all_gather(u)).collect();
        let first = [0, x.len() - world.sum_u64(p.motion[1].len() as u64) as usize];
        let size = x.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
        x.extend(&p.pressure);
        let mut worst = (0.0f64, 0.0f64);
        for i in 0..n {
            let term = |j: usize, power: usize| p.value.powu(power as u32) * matrices[power][(i, j)] * x[j];
            let terms: Vec<C> = (0..n).flat_map(|j| (0..3).map(move |q| (j, q))).map(|(j, q)| term(j, q)).collect();
            worst.0 = worst.0.max(terms.iter().sum::<C>().norm());
            worst.1 = worst.1.max(terms.iter().map(|t| t.norm()).sum());
        }
        assert!(worst.0 < 1e-9 * worst.1, "{}: residual {worst:?}", p.value);
        for &node in &s.nodes {
            let opening: C = (0..2).map(|b| x[first[b] + rows[b][3 * node + 2] as usize]).sum();
            assert!(opening.norm() < 1e-9 * size, "{}: node {node} opens by {opening}", p.value);
        }
    }
}

/// Unlike bodies with the same damping: real factorisations.
pub fn unlike_bodies(world: &World) {
    let damping = Damping { alpha: 5.0, beta: 1e-7 };
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    compare(world, &bodies, [(0, damping), (1, damping)]);
}

/// Unlike damping: a complex factorisation for the upper body.
pub fn unlike_damping(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    compare(world, &bodies, [(0, Damping { alpha: 5.0, beta: 1e-7 }), (1, Damping { alpha: 40.0, beta: 2e-7 })]);
}

/// Mirror images: one factorisation for both.
pub fn mirror_images(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9)];
    let damping = Damping { alpha: 5.0, beta: 1e-7 };
    compare(world, &bodies, [(0, damping), (0, damping)]);
}

/// What does not reach the tolerance is no result.
pub fn inaccurate_pairs_are_refused(world: &World) {
    let damping = Damping { alpha: 5.0, beta: 1e-7 };
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let error = both(world, &bodies, [(0, damping), (1, damping)], 1e-22).0.unwrap_err();
    assert_eq!(error.exit_code(), 4, "{error}");
    assert!(error.message().contains("backward error"), "{error}");
}
