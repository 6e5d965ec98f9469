//! Stability of the full system against a dense solution of the same equations, assembled here from the formulas.

use crate::dense::dense;
use crate::elasticity::{block, group};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use num_complex::Complex;
use railsqueal::body::averaged_trace::MeshContact;
use railsqueal::body::fe::{BodyModes, FeBody};
use railsqueal::body::modes;
use railsqueal::body::rotation::{centrifugal, RotationForms};
use railsqueal::body::statics::Statics;
use railsqueal::body::FullSystem;
use railsqueal::contact::{LinearContact, LinearMemory, LinearNode, Slip, Tangent};
use railsqueal::eigen::sparse::Method;
use railsqueal::fem::rotation::Axis;
use railsqueal::fem::ElasticMaterial;
use railsqueal::friction::Relaxation;
use railsqueal::grid::ContactGrid;
use railsqueal::job::{Dampings, Stiffnesses, Support};
use railsqueal::parallel::World;
use railsqueal::petsc::shell::ShellOperator;
use railsqueal::petsc::Petsc;
use railsqueal::progress::Progress;
use railsqueal::stability::full::completeness::{partners, Wedge};
use railsqueal::stability::full::system::System;
use railsqueal::stability::full::{
    spectrum, Coupling, DampedBody, FullBodies, FullOptions, FullSpectrum, RayleighDamping, Spin,
};
use std::f64::consts::PI;
use std::ops::AddAssign;
use std::rc::Rc;

type C = Complex<f64>;

const SPEED: f64 = 8.0;

/// A block under the plane z = 0, held at its lower face, with the contact surface on top.
pub fn body(world: &World, name: &str, layers: usize, young: f64) -> FeBody {
    supported(world, (name, layers, young), &["foot".into()], &[])
}

/// The same, held otherwise.
fn supported(
    world: &World,
    (name, layers, young): (&str, usize, f64),
    fixed: &[String],
    supports: &[Support],
) -> FeBody {
    touched(world, (name, layers, young), &["contact"], (fixed, supports))
}

/// The same, touched at each of `groups`: "contact", all of the upper face, or "strip 0" to "strip 2", parts of it
/// along x.
fn touched(
    world: &World,
    (name, layers, young): (&str, usize, f64),
    groups: &[&str],
    held: (&[String], &[Support]),
) -> FeBody {
    let depth = 0.05 * layers as f64;
    let mut mesh = block([4, 3, layers], [0.2, 0.15, depth], |x| x);
    for p in &mut mesh.nodes {
        *p = [p[0] - 0.1, p[1] - 0.075, p[2] - depth];
    }
    let row = |j: usize, z: usize| (5 * (j + 4 * z)) as u32;
    let strip = |j: usize, z: usize| -> Vec<[u32; 4]> {
        let face = |i: u32| [row(j, z) + i, row(j, z) + i + 1, row(j + 1, z) + i + 1, row(j + 1, z) + i];
        (0..4).map(face).collect()
    };
    let face = |z: usize| (0..3).flat_map(|j| strip(j, z)).collect::<Vec<_>>();
    group(&mut mesh, "contact", &face(layers));
    (0..3).for_each(|j| group(&mut mesh, &format!("strip {j}"), &strip(j, layers)));
    group(&mut mesh, "foot", &face(0));
    let of = |name: &&str| ContactGrid::from_mesh(&mesh, name).unwrap();
    let grids: Vec<ContactGrid> = groups.iter().filter(|_| world.is_root()).map(of).collect();
    let material = ElasticMaterial { young, poisson: 0.3, density: 7800.0 };
    let contacts: Vec<MeshContact> = grids.iter().map(|grid| MeshContact::Grid { grid, along: 0.0 }).collect();
    FeBody::held(world, name, world.is_root().then_some(&mesh), &contacts, material, held).unwrap()
}

/// Six closed nodes in the middle of the 5 × 4 grid; forces, directions and velocities differ from node to node.
fn contact() -> LinearContact {
    let node = |(i, node): (usize, usize)| {
        let turn = 1.4 + 0.1 * i as f64;
        let (force, velocity) = (6e3 + 700.0 * i as f64, 0.1 + 0.01 * i as f64);
        let slip = Slip::steady(force, [turn.cos(), turn.sin()], velocity, 0.4, -0.02);
        LinearNode { node, tangent: Tangent::Slip(slip), convection: upstream(node) }
    };
    LinearContact {
        nodes: [6, 7, 8, 11, 12, 13].into_iter().enumerate().map(node).collect(),
        ..LinearContact::default()
    }
}

/// The same nodes with friction that remembers: node 8 takes it over from node 7, and that from node 6.
fn remembering() -> LinearContact {
    let mut s = contact();
    let upstream = [None, Some(0), Some(1), None, Some(3), Some(4)];
    for (at, from) in upstream.into_iter().enumerate() {
        let Tangent::Slip(slip) = &mut s.nodes[at].tangent else { panic!("stick") };
        slip.falling = [0.0; 2];
        let decay = 6e3 + 500.0 * at as f64;
        let relaxation = Relaxation { decay, upstream: 0.6 * decay, gain: -3e3 };
        let force = 6e3 + 700.0 * at as f64;
        s.memory.push(LinearMemory { at, direction: slip.direction, force, relaxation, upstream: from });
    }
    s
}

/// The two-point difference.
fn upstream(node: usize) -> Vec<(usize, f64)> {
    vec![(node, SPEED / 0.05), (node - 1, -SPEED / 0.05)]
}

/// The lowest free modes of a body, densely: angular frequencies and mass-normalised columns.
fn dense_modes(world: &World, body: &FeBody, count: usize) -> (Vec<f64>, Mat<f64>) {
    let (k, m) = (dense(world, &body.operators.stiffness), dense(world, &body.operators.mass));
    // K = L Lᵀ, L⁻¹ M L⁻ᵀ z = z / ω², φ = ω L⁻ᵀ z.
    let factor = k.llt(Side::Lower).unwrap();
    let mut b = m;
    let l = factor.L().to_owned();
    let lu = l.partial_piv_lu();
    lu.solve_in_place(&mut b);
    let mut b = b.transpose().to_owned();
    lu.solve_in_place(&mut b);
    let eigen = b.self_adjoint_eigen(Side::Lower).unwrap();
    let n = k.nrows();
    let omega: Vec<f64> = (0..count).map(|j| eigen.S().column_vector()[n - 1 - j].sqrt().recip()).collect();
    let mut phi = Mat::from_fn(n, count, |i, j| omega[j] * eigen.U()[(i, n - 1 - j)]);
    l.transpose().to_owned().partial_piv_lu().solve_in_place(&mut phi);
    (omega, phi)
}

/// This rank's rows of them.
pub fn shared_modes(world: &World, body: &FeBody, count: usize) -> BodyModes {
    let (omega, phi) = dense_modes(world, body, count);
    let first = body.dofs.first() as usize;
    let rows = first..first + body.dofs.owned();
    let vectors = (0..count).map(|j| rows.clone().map(|i| phi[(i, j)]).collect()).collect();
    BodyModes { omega, residual: vec![0.0; count], vectors }
}

/// [K, C, M] of the whole system, unknowns (u1, u2, r), every rank: w = u1 − u2, gap change = (u2 − u1)·z with the
/// upper body reflected in z.
fn matrices(world: &World, all: &[FeBody], places: &[DampedBody; 2], s: &LinearContact) -> [Mat<f64>; 3] {
    let bodies = [0, 1].map(|b| &all[places[b].body]);
    let damping = [0, 1].map(|b| places[b].damping);
    let rows = bodies.map(|b| b.trace.dofs());
    let sizes = bodies.map(|b| b.dofs.total() as usize);
    let (n, k) = (sizes[0] + sizes[1], s.nodes.len());
    let size = n + k + s.memory.len();
    let [mut stiff, mut damp, mut mass] = [0, 1, 2].map(|_| Mat::<f64>::zeros(size, size));
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
        if let Some(own) = &bodies[b].effect.damping {
            damp.as_mut().submatrix_mut(first[b], first[b], sizes[b], sizes[b]).add_assign(dense(world, own));
        }
        let modal = &places[b].modal;
        let (_, phi) = dense_modes(world, bodies[b], modal.len());
        let loads = &mb * &phi;
        if let Some(spin) = &places[b].spin {
            let [g, kr] = [&spin.forms.gyroscopic, &spin.forms.stiffness].map(|a| dense(world, a));
            // The damping of the modes acts on the rate of the material.
            let (omega, phi) = dense_modes(world, bodies[b], spin.modal.derivative.nrows());
            let whole =
                |k: usize| damping[b].alpha + damping[b].beta * omega[k].powi(2) + modal.get(k).copied().unwrap_or(0.0);
            let turned = Mat::from_fn(omega.len(), omega.len(), |i, j| whole(i) * spin.modal.derivative[(i, j)]);
            let loads = &mb * &phi;
            let circulating = &loads * turned * loads.transpose();
            for i in 0..sizes[b] {
                for j in 0..sizes[b] {
                    let at = (first[b] + i, first[b] + j);
                    damp[at] += spin.speed * g[(i, j)];
                    stiff[at] += spin.speed * (spin.speed * kr[(i, j)] + circulating[(i, j)]);
                }
            }
        }
        for i in 0..sizes[b] {
            for j in 0..sizes[b] {
                let sum: f64 = modal.iter().enumerate().map(|(k, c)| c * loads[(i, k)] * loads[(j, k)]).sum();
                damp[(first[b] + i, first[b] + j)] += sum;
            }
        }
    }
    // Unknowns and factors that make w_x, w_y and the opening of a node. Both bodies are kept in lower form, so the
    // opening is minus the sum of their z displacements.
    let motion = |node: usize, c: usize| {
        let sign = if c == 2 { [-1.0, -1.0] } else { [1.0, -1.0] };
        [0, 1].map(|b| (first[b] + rows[b][3 * node + c] as usize, sign[b]))
    };
    for (i, &LinearNode { node, tangent, ref convection }) in s.nodes.iter().enumerate() {
        let Tangent::Slip(slip) = tangent else { panic!("stick") };
        let t = slip.direction;
        for p in 0..2 {
            for q in 0..2 {
                let across = slip.across[1] / slip.across[0];
                let same = if p == q { 1.0 } else { 0.0 };
                let d = across * (same - t[p] * t[q]) + slip.falling[p] * t[q];
                for (row, a) in motion(node, p) {
                    for (column, b) in motion(node, q) {
                        damp[(row, column)] += a * d * b;
                    }
                    for &(other, v) in convection {
                        for (column, b) in motion(other, q) {
                            stiff[(row, column)] += a * d * v * b;
                        }
                    }
                }
            }
            for (row, a) in motion(node, p) {
                stiff[(row, n + i)] += a * slip.friction * t[p];
            }
        }
        for (row, a) in motion(node, 2) {
            stiff[(row, n + i)] -= a;
            stiff[(n + i, row)] += a;
        }
    }
    // Changes of friction in newtons, their rows in units in which they are as large as the others.
    let largest = (0..n).map(|i| stiff[(i, i)]).fold(0.0, f64::max);
    let (row_unit, newtons) = (1.0 / (largest * RATE), 1e4);
    for (i, m) in s.memory.iter().enumerate() {
        let (at, node) = (n + k + i, &s.nodes[m.at]);
        damp[(at, at)] = row_unit;
        stiff[(at, at)] = m.relaxation.decay * row_unit;
        if let Some(from) = m.upstream {
            stiff[(at, n + k + from)] = -m.relaxation.upstream * row_unit;
        }
        for q in 0..2 {
            let gain = newtons * m.relaxation.gain * m.direction[q] * row_unit;
            for (column, b) in motion(node.node, q) {
                damp[(at, column)] -= gain * b;
                stiff[(column, at)] += m.force / newtons * m.direction[q] * b;
            }
            for &(other, v) in &node.convection {
                for (column, b) in motion(other, q) {
                    stiff[(at, column)] -= gain * v * b;
                }
            }
        }
    }
    [stiff, damp, mass]
}

/// Unit of λ in dense solutions, rad/s.
const RATE: f64 = 2.0 * PI * 15e3;

/// Shift at which they invert, in that unit.
const SHIFT: f64 = 0.37;

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
    let shift = SHIFT;
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

/// |P(λ)x| / ((|λ|²‖M‖ + |λ|‖C‖ + ‖K‖) |x|), with the norms of the `unknowns` of the bodies by row sums.
fn backward_error([k, c, m]: &[Mat<f64>; 3], unknowns: usize, lambda: C, x: &[C]) -> f64 {
    // Multipliers in units of the largest stiffness.
    let largest =
        (0..unknowns).flat_map(|i| (0..unknowns).map(move |j| (i, j))).map(|at| k[at].abs()).fold(0.0, f64::max);
    let mut square = 0.0;
    for i in 0..x.len() {
        let row: C = (0..x.len()).map(|j| (lambda * lambda * m[(i, j)] + lambda * c[(i, j)] + k[(i, j)]) * x[j]).sum();
        square += row.norm_sqr() / if i < unknowns { largest * largest } else { 1.0 };
    }
    let size: f64 =
        x.iter().enumerate().map(|(j, v)| v.norm_sqr() / if j < unknowns { 1.0 } else { largest * largest }).sum();
    let norm = |a: &Mat<f64>| {
        let rows = (0..unknowns).map(|i| (0..unknowns).map(|j| a[(i, j)].abs()).sum::<f64>());
        rows.fold(0.0, f64::max) / largest
    };
    (square / size).sqrt() / (lambda.norm_sqr() * norm(m) + lambda.norm() * norm(c) + norm(k))
}

/// The matrices of the bodies.
fn full_systems(bodies: &[FeBody]) -> Vec<&dyn FullSystem> {
    bodies.iter().map(|b| b as &dyn FullSystem).collect()
}

/// The dense reference: eigenvalues, and K, C, M of the coupled system. Rank 0 computes for all: ranks that do the
/// same get in each other's way.
struct Reference {
    exact: Vec<C>,
    matrices: [Mat<f64>; 3],
}

impl Reference {
    fn new(world: &World, bodies: &[FeBody], places: &[DampedBody; 2], s: &LinearContact) -> Self {
        let matrices = matrices(world, bodies, places, s);
        let unknowns = matrices[0].nrows() - s.nodes.len() - s.memory.len();
        let mine = if world.is_root() { eigenvalues(&matrices, unknowns, RATE) } else { Vec::new() };
        Self { exact: world.broadcast(mine), matrices }
    }
}

fn solved(
    world: &World,
    (bodies, places): (&[FeBody], &[DampedBody; 2]),
    s: &LinearContact,
    exact: &[C],
    (tolerance, method): (f64, Method),
) -> railsqueal::Result<FullSpectrum> {
    let options = FullOptions { max_frequency: LIMIT, damping_ratio: 0.2, count: 12, tolerance, method };
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let turning = |p: &DampedBody| p.spin.as_ref().map_or(0, |s| s.modal.derivative.nrows());
    let count = places.iter().map(|p| p.modal.len().max(turning(p))).max().unwrap_or(0);
    let modes: Vec<BodyModes> = bodies.iter().map(|b| shared_modes(world, b, count)).collect();
    let modes: Vec<&BodyModes> = if count > 0 { modes.iter().collect() } else { Vec::new() };
    let (bodies, modes) = (&full_systems(bodies)[..], &modes[..]);
    spectrum(&petsc, FullBodies { bodies, modes, places }, s, exact, &options, &mut Progress::new(false))
}

const LIMIT: f64 = 40e3;

/// Backward error that is asked for.
const TOLERANCE: f64 = 1e-9;

/// The spectrum by blocks, and SLEPc's second opinion.
fn compare(world: &World, bodies: &[FeBody], places: [DampedBody; 2], s: &LinearContact) {
    let reference = Reference::new(world, bodies, &places, s);
    for method in [Method::Blocks, Method::Slepc] {
        judge(world, (bodies, &places), s, &reference, method);
    }
}

/// The spectrum by blocks beside a reference of its own.
fn compare_blocks(world: &World, bodies: &[FeBody], places: &[DampedBody; 2], s: &LinearContact) -> FullSpectrum {
    judge(world, (bodies, places), s, &Reference::new(world, bodies, places, s), Method::Blocks)
}

fn judge(
    world: &World,
    (bodies, places): (&[FeBody], &[DampedBody; 2]),
    s: &LinearContact,
    Reference { exact, matrices }: &Reference,
    method: Method,
) -> FullSpectrum {
    let found = solved(world, (bodies, places), s, exact, (TOLERANCE, method)).unwrap();
    assert!(found.shifts.len() > 1, "one shift only");
    // Every dense eigenvalue of the promised wedge is there, once, and nothing else.
    let slope = 0.2 / (1.0f64 - 0.04).sqrt();
    let promised: Vec<C> = exact
        .iter()
        .copied()
        .filter(|v| v.im > 0.0 && v.im <= 2.0 * PI * LIMIT && v.re.abs() <= slope * v.im)
        .collect();
    assert!(promised.len() > 15, "{} eigenvalues of {}", promised.len(), exact.len());
    // The dense solution inverts at a shift, and is as accurate as its distance from it allows.
    let near = |a: C, b: C| (a - b).norm() < 1e-8 * (b - SHIFT * RATE).norm();
    for v in &promised {
        let twins = promised.iter().filter(|w| near(**w, *v)).count();
        let hits = found.pairs.iter().filter(|p| near(p.value, *v)).count();
        assert_eq!(hits, twins, "{v} of {promised:?}");
    }
    // Any one of them taken away (those found beyond the wedge are not promised): the comparison that ends every run
    // misses it.
    let values: Vec<C> = found.pairs.iter().map(|p| p.value).collect();
    let wedge = Wedge::new(LIMIT, 0.2);
    partners(&values, &promised, &wedge, 1e-3).unwrap();
    let well_inside = |v: C| wedge.holds(v) && v.im < 0.99 * wedge.height;
    for missing in (0..values.len()).filter(|&i| well_inside(values[i])) {
        let mut rest = values.clone();
        let lost = rest.remove(missing);
        let error = partners(&rest, &promised, &wedge, 1e-3).expect_err("an eigenvalue is missing");
        assert!(error.exit_code() == 4 && error.message().contains("of the reduced system"), "{lost}: {error}");
    }
    // With SLEPc's method it confirms every one that grows, and no other, where nothing turns.
    let still = found.pairs.iter().all(|p| p.stiffening == [0.0; 2]);
    for p in &found.pairs {
        let unstable = wedge.holds(p.value) && railsqueal::stability::grows(p.value, p.residuals.backward_error);
        assert_eq!(p.confirmation.is_some(), unstable && still && method == Method::Slepc, "{}", p.value);
        let Some(c) = p.confirmation else { continue };
        assert!(exact.iter().any(|v| near(c.value, *v)), "{}: SLEPc's {}", p.value, c.value);
        assert!(
            c.difference < 1e-9 && c.residuals.iter().all(|r| *r < 1e-9) && c.condition > 0.1,
            "{}: {c:?}",
            p.value
        );
    }
    let n = matrices[0].nrows();
    let conjugate = |v: C| exact.iter().any(|w| near(*w, v.conj()));
    let rows: Vec<Vec<u64>> = places.iter().map(|p| bodies[p.body].trace.dofs()).collect();
    for p in &found.pairs {
        let apart = exact.iter().map(|v| (p.value - v).norm()).fold(f64::INFINITY, f64::min);
        assert!(exact.iter().any(|v| near(p.value, *v)), "{} is not an eigenvalue: {apart:e} 1/s apart", p.value);
        assert!(conjugate(p.value), "{} has no conjugate", p.value);
        // Beyond the wedge lie relaxations of the friction, whose changes do not follow from the motion.
        if !s.memory.is_empty() && !wedge.holds(p.value) {
            continue;
        }
        // The eigenvector in the equations assembled here.
        let mut x: Vec<C> = p.motion.iter().flat_map(|u| world.all_gather(u)).collect();
        let first = [0, x.len() - world.sum_u64(p.motion[1].len() as u64) as usize];
        let unknowns = x.len();
        let size = x.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
        x.extend(&p.pressure);
        // What friction does follows from the motion, node by node down the stream.
        for row in x.len()..n {
            let at = |j: usize| matrices[0][(row, j)] + p.value * matrices[1][(row, j)];
            let moved: C = (0..row).map(|j| at(j) * x[j]).sum();
            x.push(-moved / at(row));
        }
        let (own, told) = (backward_error(matrices, unknowns, p.value, &x), p.residuals.backward_error);
        assert!(own < TOLERANCE && own < 2.0 * told + 1e-15, "{}: backward error {own:e}, told {told:e}", p.value);
        for node in s.nodes.iter().map(|n| n.node) {
            let opening: C = (0..2).map(|b| x[first[b] + rows[b][3 * node + 2] as usize]).sum();
            assert!(opening.norm() < 1e-9 * size, "{}: node {node} opens by {opening}", p.value);
        }
    }
    found
}

/// Unlike bodies with the same damping: real factorisations.
pub fn unlike_bodies(world: &World) {
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    compare(world, &bodies, [0, 1].map(|body| DampedBody::rayleigh(body, damping)), &contact());
}

/// Friction that remembers: its coefficients are unknowns beside the pressures.
pub fn friction_that_remembers(world: &World) {
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    compare(world, &bodies, [0, 1].map(|body| DampedBody::rayleigh(body, damping)), &remembering());
}

/// Unlike damping: a complex factorisation for the upper body.
pub fn unlike_damping(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let damping = [RayleighDamping { alpha: 5.0, beta: 1e-7 }, RayleighDamping { alpha: 40.0, beta: 2e-7 }];
    compare(world, &bodies, [0, 1].map(|body| DampedBody::rayleigh(body, damping[body])), &contact());
}

/// Mirror images: one factorisation for both.
pub fn mirror_images(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9)];
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    compare(world, &bodies, [0, 0].map(|body| DampedBody::rayleigh(body, damping)), &contact());
}

/// Loss factors that differ from mode to mode, up to a tenth; one mode is not damped at all.
fn loss(omega: &[f64], least: f64) -> Vec<f64> {
    let factor = |k: usize| if k == 1 { 0.0 } else { least + 0.02 * k as f64 };
    omega.iter().enumerate().map(|(k, w)| w * factor(k)).collect()
}

/// Unlike bodies, the lowest modes of each damped: real factorisations.
pub fn modal_damping(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let place = |body: usize| {
        let (omega, _) = dense_modes(world, &bodies[body], 5 - body);
        DampedBody { body, modal: loss(&omega, 0.01 + 0.005 * body as f64), ..DampedBody::default() }
    };
    // Every body has as many modes as the one with most.
    let mut places = [place(0), place(1)];
    places[1].modal.push(0.0);
    compare(world, &bodies, places, &contact());
}

/// Modal damping of the upper one of two mirror images, beside Rayleigh damping of both: one factorisation.
pub fn modal_damping_of_a_mirror_image(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9)];
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let (omega, _) = dense_modes(world, &bodies[0], 4);
    compare(
        world,
        &bodies,
        [DampedBody::rayleigh(0, damping), DampedBody { body: 0, damping, modal: loss(&omega, 0.02), spin: None }],
        &contact(),
    );
}

/// Modal damping against Rayleigh damping: a complex factorisation for the upper body, corrected for its modes.
pub fn modal_against_rayleigh_damping(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let (omega, _) = dense_modes(world, &bodies[1], 3);
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let upper = DampedBody { body: 1, modal: loss(&omega, 0.02), ..DampedBody::default() };
    compare(world, &bodies, [DampedBody::rayleigh(0, damping), upper], &contact());
}

/// Springs and dashpots under the foot of one body, an end that absorbs under that of the other: damping that no
/// modes are diagonal in.
pub fn bodies_on_dashpots(world: &World) {
    let springs = Support {
        group: "foot".into(),
        stiffness: Some(Stiffnesses { x: 4e9, y: 5e9, z: 8e9, normal: 1e9 }),
        damping: Some(Dampings { x: 3e4, z: 6e4, ..Dampings::default() }),
        ..Support::default()
    };
    let absorbing = Support {
        group: "foot".into(),
        absorbing: Some(railsqueal::job::Absorbing { depth: 0.08, rate: 4e3, longitudinal: Some(0.7) }),
        ..Support::default()
    };
    let bodies = [
        supported(world, ("lower", 1, 205e9), &[], &[springs]),
        supported(world, ("upper", 2, 180e9), &["foot".into()], &[absorbing]),
    ];
    let damping = RayleighDamping { alpha: 50.0, beta: 2e-7 };
    compare(world, &bodies, [0, 1].map(|b| DampedBody::rayleigh(b, damping)), &contact());
}

/// Bodies that rotate, one of them against the other and with its modes damped: the inverse knows what the modes see
/// of it, the eigenpairs all. At the lowest shift they are improved together, at higher ones, which the modes do not
/// reach, each solution is corrected.
pub fn bodies_that_rotate(world: &World) {
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let spin = |body: usize, speed: f64| {
        let fe = &bodies[body];
        let axis = Axis::below(0.3);
        let petsc = Petsc::start(world, &[], &[]).unwrap();
        let mut statics = Statics::direct(&petsc, fe).unwrap();
        let spread = centrifugal(world, fe, &mut statics, axis).unwrap();
        let forms = Rc::new(RotationForms::assemble(world, fe, axis, &spread).unwrap());
        let modal = forms.project(world, &fe.operators.mass, &shared_modes(world, fe, 40));
        Some(Spin { speed, forms, modal })
    };
    let (omega, _) = dense_modes(world, &bodies[1], 40);
    let upper = DampedBody { body: 1, modal: loss(&omega, 0.002), spin: spin(1, -150.0), ..DampedBody::default() };
    let lower = DampedBody { spin: spin(0, 100.0), ..DampedBody::rayleigh(0, damping) };
    let turned = [lower.clone(), upper];
    // Each solution is corrected by several steps of all ranks: SLEPc's way takes half a minute on two, and blocks do
    // on more ranks than processors.
    if world.size < 3 {
        let wanted = Reference::new(world, &bodies, &turned, &contact());
        let found = judge(world, (&bodies, &turned), &contact(), &wanted, Method::Blocks);
        if world.size == 1 {
            judge(world, (&bodies, &turned), &contact(), &wanted, Method::Slepc);
        }
        let corrected: Vec<bool> = found.shifts.iter().map(|s| s.corrected).collect();
        assert!(corrected.contains(&true) && corrected.contains(&false), "one way only: {:?}", found.shifts);
    }
    // Mirror images, of which one stands still.
    compare_blocks(world, &bodies[..1], &[lower, DampedBody::rayleigh(0, damping)], &contact());
}

/// Bodies that touch in two strips beside each other, at the nodes of one contact: the nodes of both grids, one after
/// the other, are those of the one, and so are the eigenvalues.
pub fn several_contacts(world: &World) {
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let places = [0, 1].map(|body| DampedBody::rayleigh(body, damping));
    let [one, two] = [&["contact"][..], &["strip 0", "strip 2"]].map(|groups| {
        let foot = (&["foot".into()][..], &[][..]);
        let body = |of: (&str, usize, f64)| touched(world, of, groups, foot);
        [body(("lower", 2, 205e9)), body(("upper", 1, 150e9))]
    });
    assert_eq!(one[0].trace.dofs(), two[0].trace.dofs());
    let Reference { exact, .. } = Reference::new(world, &one, &places, &contact());
    let found = solved(world, (&two, &places), &contact(), &exact, (1e-10, Method::Blocks)).unwrap();
    assert!(found.pairs.len() > 10, "{} pairs", found.pairs.len());
    for pair in &found.pairs {
        let apart = exact.iter().map(|e| (e - pair.value).norm()).fold(f64::INFINITY, f64::min);
        assert!(apart < 1e-9 * pair.value.norm(), "{}: {apart:e}", pair.value);
    }
}

/// A bar along x of which one end is free, on either side, so that on several ranks some have no rows at all, or none
/// of the contact.
fn bar(world: &World, name: &str, free_end: f64) -> FeBody {
    let (nx, nz) = (8, 2);
    let mut mesh = block([nx, 1, nz], [0.4, 0.05, 0.1], |x| x);
    let id = |i: usize, j: usize, k: usize| (i + (nx + 1) * (j + 2 * k)) as u32;
    // Cells count from the free end on.
    let cell = |i: usize| if free_end > 0.0 { nx - 1 - i } else { i };
    let face = |i: usize, k: usize| [id(i, 0, k), id(i + 1, 0, k), id(i + 1, 1, k), id(i, 1, k)];
    group(&mut mesh, "contact", &[face(cell(0), nz)]);
    let held: Vec<[u32; 4]> =
        (3..nx).flat_map(|i| (0..=nz).map(move |k| (i, k))).map(|(i, k)| face(cell(i), k)).collect();
    group(&mut mesh, "foot", &held);
    let end = if free_end > 0.0 { 0.4 - 0.025 } else { 0.025 };
    for p in &mut mesh.nodes {
        *p = [p[0] - end, p[1] - 0.025, p[2] - 0.1];
    }
    let grid = world.is_root().then(|| ContactGrid::from_mesh(&mesh, "contact").unwrap());
    let material = ElasticMaterial { young: 205e9, poisson: 0.3, density: 7800.0 };
    FeBody::new(world, name, world.is_root().then_some(&mesh), grid.as_ref(), material, &["foot".into()]).unwrap()
}

/// Angular frequencies as the program finds them.
fn free_modes(world: &World, body: &FeBody, count: usize) -> Vec<f64> {
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let mut statics = Statics::direct(&petsc, body).unwrap();
    modes::compute(&petsc, body, &mut statics, modes::Extent::Count(count), Method::Blocks, &mut |_, _| {})
        .unwrap()
        .omega
}

/// Two closed nodes of the four, and two upstream of them.
fn small_contact() -> LinearContact {
    let moved = |(mut n, node): (LinearNode, usize)| {
        (n.node, n.convection) = (node, upstream(node));
        n
    };
    LinearContact { nodes: contact().nodes.into_iter().zip([1, 3]).map(moved).collect(), ..LinearContact::default() }
}

/// Ranks without any unknown, and ranks without contact rows, with real and with complex factorisations and damped
/// modes.
pub fn ranks_without_rows(world: &World) {
    for free_end in [1.0, -1.0] {
        let bodies = [bar(world, "lower", free_end), bar(world, "upper", free_end)];
        let owned: Vec<u64> = world.all_gather(&[bodies.iter().map(|b| b.dofs.owned() as u64).sum()]);
        assert_eq!(owned.iter().sum::<u64>(), 2 * 54);
        assert!(world.size < 3 || owned.contains(&0), "every rank has rows: {owned:?}");
        let rows = bodies[0].trace.dofs();
        let own = bodies[0].dofs.first()..bodies[0].dofs.first() + bodies[0].dofs.owned() as u64;
        let touching = world.all_gather(&[rows.iter().filter(|r| own.contains(r)).count() as u64]);
        assert!(world.size == 1 || touching.contains(&0), "every rank has contact rows: {touching:?}");
        let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
        let (omega, _) = dense_modes(world, &bodies[1], 3);
        let free = free_modes(world, &bodies[1], 3);
        for (a, b) in free.iter().zip(&omega) {
            assert!((a - b).abs() < 1e-8 * b, "free modes {free:?} and {omega:?}");
        }
        let upper = DampedBody { body: 1, modal: loss(&omega, 0.02), ..DampedBody::default() };
        let alike = [0, 1].map(|body| DampedBody::rayleigh(body, damping));
        for places in [alike, [DampedBody::rayleigh(0, damping), upper]] {
            compare(world, &bodies, places, &small_contact());
        }
    }
}

/// A pair that is none has the backward error |P(λ)x| / ((|λ|²‖M‖ + |λ|‖C‖ + ‖K‖) |x|) of the equations assembled
/// here, which sees the eigenvalue and the vector.
pub fn backward_errors(world: &World) {
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let places = [0, 1].map(|body| DampedBody::rayleigh(body, damping));
    let s = contact();
    let matrices = matrices(world, &bodies, &places, &s);
    let unknowns = matrices[0].nrows() - s.nodes.len();
    let rate = 2.0 * PI * 20e3;
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let mut system =
        System::new(&petsc, &full_systems(&bodies), &[], &places, Coupling::new(&s).unwrap(), rate).unwrap();
    system.shift_to(0.8 * rate).unwrap();
    let x = system.start(1).unwrap();
    let ([lower, upper], pressure) = system.split(&x);
    let mut whole: Vec<C> = [lower, upper].iter().flat_map(|u| world.all_gather(u)).collect();
    whole.extend(&pressure);
    for lambda in [C::new(-30.0, 0.8 * rate), C::new(400.0, 0.3 * rate)] {
        let want = backward_error(&matrices, unknowns, lambda, &whole);
        let found = system.residuals(&[(lambda, &x)]).unwrap()[0].backward_error;
        // The program bounds the norms from above: K by 1 more for the constraints, D by its largest entries.
        assert!(found > 0.5 * want && found < 1.2 * want, "backward error {found:e}, by the matrices {want:e}");
    }
}

/// yᵀ(A x) = (Aᵀy)ᵀ x for the matrices and for the inverse at a shift: real and complex factors, damped modes,
/// friction that remembers, rotation.
pub fn transposed_system(world: &World) {
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let modes: Vec<BodyModes> = bodies.iter().map(|b| shared_modes(world, b, 8)).collect();
    let (omega, _) = dense_modes(world, &bodies[1], 8);
    let damped = DampedBody { body: 1, modal: loss(&omega, 0.02), ..DampedBody::default() };
    let lower = DampedBody::rayleigh(0, damping);
    let cases = [
        [lower.clone(), DampedBody::rayleigh(1, damping)],
        [lower.clone(), DampedBody::rayleigh(1, RayleighDamping { alpha: 40.0, beta: 2e-7 })],
        [lower, damped],
    ];
    let petsc = Petsc::start(world, &[], &[]).unwrap();
    let rate = 2.0 * PI * 20e3;
    for (places, s) in cases.iter().flat_map(|c| [(c, contact()), (c, remembering())]) {
        let known: Vec<&BodyModes> = modes.iter().collect();
        let coupling = Coupling::new(&s).unwrap();
        let mut system = System::new(&petsc, &full_systems(&bodies), &known, places, coupling, rate).unwrap();
        system.shift_to(0.4 * rate).unwrap();
        let n = ShellOperator::n_local(&system);
        let value = |k: f64| -> Vec<C> {
            let at = |i: usize| (7919 * world.rank + i) as f64;
            (0..n).map(|i| C::new((k * at(i)).sin(), (k + 0.3 * at(i)).cos())).collect()
        };
        let (x, y) = (value(0.7), value(1.1));
        let product = |a: &[C], b: &[C]| world.sum_all(&[a.iter().zip(b).map(|(a, b)| a * b).sum::<C>()])[0];
        let check = |what: &str, ax: &[C], aty: &[C]| {
            let (a, b) = (product(&y, ax), product(aty, &x));
            let size = world.sum(ax.iter().zip(&y).map(|(a, b)| (a * b).norm()).sum());
            assert!((a - b).norm() < 1e-11 * size, "{what}: {a} and {b} of {size:e}");
        };
        for power in 0..3 {
            let (mut ax, mut aty) = (vec![C::default(); n], vec![C::default(); n]);
            ShellOperator::multiply(&mut system, power, &x, &mut ax).unwrap();
            ShellOperator::multiply_transposed(&mut system, power, &y, &mut aty).unwrap();
            check(&format!("power {power}"), &ax, &aty);
        }
        let (mut ax, mut aty) = (x.clone(), y.clone());
        ShellOperator::solve(&mut system, &mut ax).unwrap();
        ShellOperator::solve_transposed(&mut system, &mut aty).unwrap();
        check("inverse", &ax, &aty);
    }
}

/// Eigenpairs that do not reach the tolerance are refused.
pub fn inaccurate_pairs_are_refused(world: &World) {
    let damping = RayleighDamping { alpha: 5.0, beta: 1e-7 };
    let bodies = [body(world, "lower", 2, 205e9), body(world, "upper", 1, 150e9)];
    let places = [0, 1].map(|body| DampedBody::rayleigh(body, damping));
    let Reference { exact, .. } = Reference::new(world, &bodies, &places, &contact());
    let error = solved(world, (&bodies, &places), &contact(), &exact, (1e-22, Method::Blocks)).unwrap_err();
    assert_eq!(error.exit_code(), 4, "{error}");
    assert!(error.message().contains("backward error"), "{error}");
}
