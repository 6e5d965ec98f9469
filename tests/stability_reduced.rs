//! Stability of steady sliding on the reduced model: closed forms, symmetries, the original equations, and derivatives.

use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;
use railsqueal::body::half_space::HalfSpace;
use railsqueal::body::{ModalMatrix, ReducedBody, Side};
use railsqueal::contact::{
    ContactCreepage, LinearContact, LinearMemory, LinearNode, NormalLoad, PatchKinematics, SlidingDirection,
    SlidingProblem, Slip, SteadyProblem, Stencil, Tangent,
};
use railsqueal::fem::ElasticMaterial;
use railsqueal::friction::{Exponential, FrictionLaw};
use railsqueal::grid::Interface;
use railsqueal::model::CoupledModel;
use railsqueal::stability::criterion::criteria;
use railsqueal::stability::reduced::{eigenpairs, participation, sharpness, Eigenpair};
use railsqueal::stability::sensitivity::Linearisation;
use railsqueal::swept::{self, Bearing, Forms, SectionSource, Wheel, WheelShape};
use railsqueal::Error;

mod rotated;

const PI: f64 = std::f64::consts::PI;
const TOLERANCE: f64 = 1e-10;

fn near(got: f64, want: f64, relative: f64, what: &str) {
    assert!(
        (got - want).abs() <= relative * want.abs(),
        "{what}: {got:.9e}, expected {want:.9e} within {relative:.1e}"
    );
}

/// A counter-body that does not move, with `n` contact nodes.
fn rigid(n: usize) -> ReducedBody {
    ReducedBody::new(vec![], vec![], Mat::zeros(3 * n, 0), Mat::zeros(3 * n, 3 * n))
}

fn single(omega: Vec<f64>, damping: Vec<f64>, contact_modes: Mat<f64>, residual: Mat<f64>) -> CoupledModel {
    let c = Mat::from_fn(residual.nrows(), residual.ncols(), |i, j| {
        let modal = |k: usize| {
            if omega[k] > 0.0 {
                contact_modes[(i, k)] * contact_modes[(j, k)] / omega[k].powi(2)
            } else {
                0.0
            }
        };
        residual[(i, j)] + (0..omega.len()).map(modal).sum::<f64>()
    });
    let n = residual.nrows() / 3;
    CoupledModel::new(&ReducedBody::new(omega, damping, contact_modes, c), &rigid(n)).unwrap()
}

/// Hultén's oscillator: two masses, each pressed through a spring on a belt that rubs the other one: contact 1 has
/// the massless normal dof a1 and the tangent x2, contact 2 has a2 and x1.
fn hulten(mu: f64, damping: f64) -> Vec<Eigenpair> {
    let w = [2.0 * PI * 100.0, 2.0 * PI * 75.0];
    let mut modes = Mat::zeros(6, 2);
    let mut residual = Mat::zeros(6, 6);
    for contact in 0..2 {
        // The free body moves as two rigid masses with their springs; the springs alone are the residual compliance.
        modes[(3 * contact + 2, contact)] = 1.0;
        modes[(3 * contact, 1 - contact)] = 1.0;
        residual[(3 * contact + 2, 3 * contact + 2)] = 1.0 / (w[contact] * w[contact]);
    }
    let bodies = single(vec![0.0, 0.0], w.map(|v| damping * v).to_vec(), modes, residual);
    let contact = sliding_nodes(vec![
        node(0, Slip::steady(1.0, [-1.0, 0.0], 1.0, mu, 0.0)),
        node(1, Slip::steady(1.0, [1.0, 0.0], 1.0, mu, 0.0)),
    ]);
    eigenpairs(&bodies, &contact, TOLERANCE).unwrap()
}

/// Nodes without memories.
fn sliding_nodes(nodes: Vec<LinearNode>) -> LinearContact {
    LinearContact { nodes, ..LinearContact::default() }
}

/// A sliding node where nothing rolls.
fn node(node: usize, slip: Slip) -> LinearNode {
    LinearNode { node, tangent: Tangent::Slip(slip), convection: Vec::new() }
}

fn limit(grows: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    assert!(!grows(low) && grows(high), "no limit between {low} and {high}");
    while high - low > 1e-9 {
        let middle = 0.5 * (low + high);
        if grows(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}

#[test]
fn hulten_without_damping() {
    // At the limit two eigenvalues meet, so that σ grows like the root of the distance.
    let critical = limit(|mu| hulten(mu, 0.0)[0].growth_rate() > 0.1, 0.2, 0.4);
    near(critical, 0.2916667, 1e-6, "critical friction");
    near(hulten(critical, 0.0)[0].frequency(), 88.388, 1e-5, "frequency at the limit");
    let unstable = &hulten(0.4, 0.0)[0];
    near(unstable.growth_rate(), 72.3586, 1e-6, "growth rate");
    near(unstable.frequency(), 89.1354, 1e-6, "frequency");
}

#[test]
fn hulten_with_damping() {
    let critical = limit(|mu| hulten(mu, 0.02)[0].growth_rate() > 0.0, 0.2, 0.4);
    near(critical, 0.2893671, 3e-7, "critical friction");
    near(hulten(critical, 0.02)[0].frequency(), 86.6025, 1e-6, "frequency at the limit");
}

/// One mass that can move across the sliding: D = μp0/|ṡ0| damps it through the residual compliance s in series:
/// λ² + cλ + ω² + φ² dλ/(1 + d s λ) = 0.
#[test]
fn sliding_damps_the_motion_across() {
    let (omega, c, phi, mu, p0, v) = (2.0 * PI * 500.0, 3.0, 0.2, 0.3, 7e3, 0.4);
    let d = mu * p0 / v;
    for s in [0.0, 1e-8, 1e-6] {
        let modes = Mat::from_fn(3, 1, |i, _| if i == 0 { phi } else { 0.0 });
        let mut residual = Mat::zeros(3, 3);
        residual[(0, 0)] = s;
        residual[(1, 1)] = s;
        residual[(2, 2)] = 1e-9;
        let bodies = single(vec![omega], vec![c], modes, residual);
        let contact = sliding_nodes(vec![node(0, Slip::steady(p0, [0.0, 1.0], v, mu, 0.0))]);
        let pairs = eigenpairs(&bodies, &contact, TOLERANCE).unwrap();
        assert_eq!(pairs.len(), if s == 0.0 { 2 } else { 3 }, "residual compliance {s}");
        for p in &pairs {
            let l = p.value;
            let terms = [l * l, l * c, Complex::new(omega * omega, 0.0), l * phi * phi * d / (1.0 + d * s * l)];
            let sum: Complex<f64> = terms.iter().sum();
            let size: f64 = terms.iter().map(|t| t.norm()).sum();
            assert!(sum.norm() < 1e-9 * size, "s = {s}: characteristic equation {sum} at {l}");
            assert!(p.growth_rate() < 0.0, "{l}");
        }
    }
}

/// A sticking contact is a spring: the residual compliance s holds the mass, λ² + cλ + ω² + φ²/s = 0, along either
/// axis; sliding that comes to rest has the same limit across it. Two more eigenvalues are 0: where it sticks is
/// arbitrary.
#[test]
fn a_stuck_contact_is_a_spring() {
    let (omega, c, phi, s) = (2.0 * PI * 500.0, 3.0, 0.2, 1e-7);
    let stiffer = omega * omega + phi * phi / s;
    let want = Complex::new(-0.5 * c, (stiffer - 0.25 * c * c).sqrt());
    for axis in [0, 1] {
        let modes = Mat::from_fn(3, 1, |i, _| if i == axis { phi } else { 0.0 });
        let residual = Mat::from_fn(3, 3, |i, j| if i == j { s } else { 0.0 });
        let bodies = single(vec![omega], vec![c], modes, residual);
        let stuck = LinearNode { node: 0, tangent: Tangent::Stick { creep: 1.0 }, convection: Vec::new() };
        let direction = [f64::from(axis as u8), 1.0 - f64::from(axis as u8)];
        for node in [stuck, node(0, Slip::steady(7e3, direction, 0.0, 0.3, 0.0))] {
            let pairs = eigenpairs(&bodies, &sliding_nodes(vec![node]), TOLERANCE).unwrap();
            let found = pairs.iter().find(|p| p.value.im > 0.0).expect("a vibration").value;
            assert!((found - want).norm() < 1e-9 * want.norm(), "{found} against {want}");
            assert!(pairs.iter().filter(|p| p.value.im == 0.0).all(|p| p.value.norm() < 1e-6 * omega));
        }
    }
}

/// Along the sliding a falling law is negative damping: λ² + (c + μ′p0 φ²) λ + ω² = 0, unstable from c = −μ′p0 φ² on.
#[test]
fn falling_friction_destabilises_at_its_closed_form_limit() {
    let (omega, phi, p0, v) = (2.0 * PI * 300.0, 0.1, 5e3, 0.5);
    let law = FrictionLaw::from(Exponential::new(0.45, 0.2, 0.6));
    let slope = law.slope(v);
    let critical = -slope * p0 * phi * phi;
    for factor in [0.9, 1.1] {
        let c = factor * critical;
        let modes = Mat::from_fn(3, 1, |i, _| if i == 1 { phi } else { 0.0 });
        let mut residual = Mat::zeros(3, 3);
        residual[(2, 2)] = 1e-9;
        let bodies = single(vec![omega], vec![c], modes, residual);
        let contact = sliding_nodes(vec![node(0, Slip::steady(p0, [0.0, 1.0], v, law.coefficient(v), slope))]);
        let pairs = eigenpairs(&bodies, &contact, TOLERANCE).unwrap();
        let sigma = -0.5 * (c + slope * p0 * phi * phi);
        near(pairs[0].growth_rate(), sigma, 1e-7, "growth rate");
        near(pairs[0].frequency(), (omega * omega - sigma * sigma).sqrt() / (2.0 * PI), 1e-9, "frequency");
        assert_eq!(pairs[0].growth_rate() > 0.0, factor < 1.0);
    }
}

/// A mass that moves along the sliding on a belt, whose friction remembers: with the residual compliance s, r = v/d
/// and g = μ′ p0, λ² + cλ + ω² + φ² g r λ/(λ + r + s g r λ) = 0. Without s it is unstable where r² + cr + cω²/(c +
/// gφ²) > 0: for short memories, if the law falls steeply enough.
#[test]
fn a_mass_on_a_belt_that_remembers() {
    let (omega, c, phi, p0, v) = (2.0 * PI * 300.0, 4.0, 0.1, 5e3, 0.5);
    let law = |d: f64| FrictionLaw::from(Exponential::new(0.45, 0.2, 0.6).remembering(d));
    let g = law(1.0).slope(v) * p0;
    let pairs = |d: f64, s: f64| {
        let modes = Mat::from_fn(3, 1, |i, _| if i == 1 { phi } else { 0.0 });
        let residual = Mat::from_fn(3, 3, |i, j| f64::from(u8::from(i == j)) * [s, s, 1e-9][i]);
        let bodies = single(vec![omega], vec![c], modes, residual);
        let law = law(d);
        let contact = LinearContact {
            nodes: vec![node(0, Slip::steady(p0, [0.0, 1.0], v, law.coefficient(v), 0.0))],
            memory: LinearMemory::at_a_point(&law, 0, [0.0, 1.0], p0, v).into_iter().collect(),
            ..LinearContact::default()
        };
        (eigenpairs(&bodies, &contact, TOLERANCE).unwrap(), sharpness(&bodies, &contact).unwrap())
    };
    for (d, s) in [(1e-6, 0.0), (1e-4, 0.0), (3e-3, 0.0), (2e-5, 1e-9), (1e-4, 1e-8), (1e-2, 1e-6)] {
        let r = v / d;
        for p in &pairs(d, s).0 {
            let l = p.value;
            // Motion across the sliding is another matter.
            if l.im == 0.0 && s > 0.0 && (l.re + v / (law(d).coefficient(v) * p0 * s)).abs() < 1e-6 * l.re.abs() {
                continue;
            }
            let memory = phi * phi * g * r * l / (l + r + s * g * r * l);
            let terms = [l * l, l * c, Complex::new(omega * omega, 0.0), memory];
            let (sum, size) = (terms.iter().sum::<Complex<f64>>(), terms.iter().map(|t| t.norm()).sum::<f64>());
            assert!(sum.norm() < 1e-8 * size, "d = {d}, s = {s}: characteristic equation {sum} of {size} at {l}");
        }
        // One point needs a memory of |μ′| p v s.
        let needed = pairs(d, s).1 * d;
        assert!(
            (needed + g * v * s).abs() < 1e-12 * -g * v * s + 1e-20,
            "needed length {needed}, expected {}",
            -g * v * s
        );
    }
    let slow = c + g * phi * phi;
    assert!(slow < 0.0, "no squeal at all");
    let critical = v / (-0.5 * c + (0.25 * c * c - c * omega * omega / slow).sqrt());
    let found = limit(|d| pairs(d * critical, 0.0).0[0].growth_rate() < 0.0, 0.5, 2.0);
    near(found, 1.0, 1e-6, "critical length over that of the closed form");
    // Without memory it grows at −(c + gφ²)/2, with a long one the body's own damping is left.
    near(pairs(1e-9, 0.0).0[0].growth_rate(), -0.5 * slow, 1e-4, "growth with a short memory");
    let long = pairs(10.0, 0.0).0;
    let vibration = long.iter().find(|p| p.value.im > 0.0).expect("a vibration");
    near(vibration.growth_rate(), -0.5 * c, 1e-4, "growth with a long memory");
}

/// At the smallest sound length the fastest eigenvalue, which is real, goes through infinity: a longer memory has it
/// at minus, a shorter one at plus infinity. It is the largest eigenvalue of diag(−gain d) S_ττ diag(p0), as the
/// contact has it across what is held.
#[test]
fn the_fastest_eigenvalue_changes_its_sign_at_the_smallest_length() {
    let s = interface(4);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
    for creepage in [[0.0, 0.01, 0.0], [0.01, -0.004, 0.3]] {
        let at = |d: f64| {
            let mut p = problem(&s, &b, 0.3, creepage);
            p.friction = Exponential::new(0.45, 0.2, 0.1).remembering(d).into();
            p.contact(&p.solve().unwrap())
        };
        let sharp = |d: f64| sharpness(&b, &at(d)).unwrap();
        let smallest = 1e-6 * limit(|d| sharp(1e-6 * d) < 1.0, 0.1, 100.0);
        assert!(smallest > 2e-6 && smallest < 2e-5, "smallest length {smallest}");
        let fastest = |d: f64| {
            let pairs = eigenpairs(&b, &at(d), 1e-8).unwrap();
            pairs.iter().map(|p| p.value).max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap()
        };
        for (factor, sign) in [(1.0 + 1e-4, -1.0), (1.0 - 1e-4, 1.0)] {
            let l = fastest(factor * smallest);
            assert!(l.im == 0.0 && l.re * sign > 1e6, "{factor} of {smallest}: {l}");
        }
        // Well above it nothing of the contact grows.
        let pairs = eigenpairs(&b, &at(2.0 * smallest), TOLERANCE).unwrap();
        assert!(pairs.iter().all(|p| p.value.im != 0.0 || p.value.re < -1e3), "{:?}", pairs[0].value);
    }
}

/// A law that remembers but does not change is Coulomb's: the same eigenvalues, and one more at each node, which
/// nothing feels.
#[test]
fn the_memory_of_a_constant_coefficient_changes_nothing() {
    let s = interface(4);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
    let mut p = problem(&s, &b, 0.4, [0.004, 0.009, 0.3]);
    let constant = eigenpairs(&b, &p.contact(&p.solve().unwrap()), TOLERANCE).unwrap();
    p.friction = Exponential::new(0.4, 0.4, 0.1).into();
    let contact = p.contact(&p.solve().unwrap());
    let memory = eigenpairs(&b, &contact, TOLERANCE).unwrap();
    assert_eq!((memory.len(), contact.memory.len()), (constant.len() + contact.nodes.len(), contact.nodes.len()));
    for c in &constant {
        let apart = memory.iter().map(|m| (m.value - c.value).norm()).fold(f64::INFINITY, f64::min);
        assert!(apart < 1e-9 * c.value.norm(), "{} has no partner, nearest at {apart}", c.value);
    }
}

/// A body with half-space contact compliance and modes that move the contact as a rigid piece, normal and tangential
/// motion coupled by `offset`.
fn body(material: HalfSpace, s: &Interface, frequencies: &[f64], offset: f64) -> ReducedBody {
    let n = s.len();
    let m = frequencies.len();
    let omega: Vec<f64> = frequencies.iter().map(|f| 2.0 * PI * f).collect();
    let contact_modes = Mat::from_fn(3 * n, m, |i, k| {
        let [x, y] = s.point(i / 3);
        let f = |a: f64| (1.7 * (k as f64 + 1.0) + a).sin();
        0.08 * match i % 3 {
            0 => f(0.3) - 4.0 * f(0.5) * y,
            1 => f(1.1) + offset * f(2.0) + 4.0 * f(0.5) * x,
            _ => f(2.0) + offset * f(1.1) + 6.0 * f(0.9) * x + 5.0 * f(1.6) * y,
        }
    });
    let mut compliance = material.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    for k in 0..m {
        for j in 0..3 * n {
            for i in 0..3 * n {
                compliance[(i, j)] += contact_modes[(i, k)] * contact_modes[(j, k)] / omega[k].powi(2);
            }
        }
    }
    let damping: Vec<f64> = omega.iter().map(|w| 1.0 + 1e-7 * w * w).collect();
    ReducedBody::new(omega, damping, contact_modes, compliance)
}

const LOWER: [f64; 6] = [310.0, 420.0, 430.0, 700.0, 1130.0, 1500.0];
const UPPER: [f64; 5] = [290.0, 450.0, 690.0, 1210.0, 1490.0];
const STEEL: HalfSpace = HalfSpace { young: 205e9, poisson: 0.3 };

fn interface(k: usize) -> Interface {
    let n = 2 * k + 5;
    let half = 4.884e-3 * (k + 2) as f64 / k as f64;
    Interface::paraboloid(n, n, [half, half], [4.0, 4.0]).unwrap()
}

fn problem<'a>(s: &'a Interface, b: &'a CoupledModel, mu: f64, c: [f64; 3]) -> SlidingProblem<'a> {
    SlidingProblem {
        interface: s,
        compliance: b.compliance.as_ref(),
        friction: FrictionLaw::Constant(mu).into(),
        kinematics: PatchKinematics::one(10.0, ContactCreepage { longitudinal: c[0], lateral: c[1], spin: c[2] }),
        loads: NormalLoad::Force(70e3).into(),
        stencil: Stencil::default(),
        direction: SlidingDirection::Rigid,
    }
}

fn spectrum(s: &Interface, b: &CoupledModel, mu: f64, c: [f64; 3]) -> Vec<Eigenpair> {
    let p = problem(s, b, mu, c);
    eigenpairs(b, &p.contact(&p.solve().unwrap()), TOLERANCE).unwrap()
}

#[test]
fn equilibrium_of_sliding_obeys_its_laws() {
    let s = interface(5);
    let (lower, upper) =
        (body(STEEL, &s, &LOWER, 0.4), body(HalfSpace { young: 80e9, poisson: 0.25 }, &s, &UPPER, -0.2));
    let b = CoupledModel::new(&lower, &upper).unwrap();
    let p = problem(&s, &b, 0.4, [0.003, -0.012, 0.2]);
    let r = p.solve().unwrap();
    assert!((r.force[2] + 70e3).abs() < 1e-7 * 70e3, "normal force {}", r.force[2]);
    let peak = r.pressure.iter().copied().fold(0.0, f64::max);
    let mut closed = 0;
    for i in 0..s.len() {
        let [x, y] = s.point(i);
        let c = p.kinematics[0].creepage.rigid(x, y);
        let v = c[0].hypot(c[1]);
        for (got, c) in r.traction[i].iter().zip(c) {
            let want = -0.4 * r.pressure[i] * c / v;
            assert!((got - want).abs() < 1e-9 * peak, "node {i}: {got} against {want}");
        }
        if r.pressure[i] > 0.0 {
            closed += 1;
            assert!(r.gap[i].abs() < 1e-12, "gap {} at the closed node {i}", r.gap[i]);
        } else {
            assert!(r.pressure[i] == 0.0 && r.gap[i] >= -1e-15, "node {i}: p {} gap {}", r.pressure[i], r.gap[i]);
        }
    }
    assert_eq!(closed, r.closed.len());
    assert!(closed > 60 && closed < s.len() / 2 + 30, "{closed} closed nodes");
    // The same with the creep of the deformed bodies: the direction is then that of the creep.
    let mut a = p.clone();
    a.direction = SlidingDirection::Actual;
    a.kinematics[0].creepage = ContactCreepage { longitudinal: 0.008, lateral: -0.03, spin: 0.2 };
    let r = a.solve().unwrap();
    for (j, &i) in r.closed.iter().enumerate() {
        let (t, c) = (r.direction[j], r.creep[i]);
        let across = (t[0] * c[1] - t[1] * c[0]) / c[0].hypot(c[1]);
        assert!(across.abs() < 1e-8, "node {i}: creep {c:?} across {t:?}");
    }
    // Too little creepage: some nodes would stick.
    a.kinematics[0].creepage = ContactCreepage { longitudinal: 0.0, lateral: 0.001, spin: 0.0 };
    assert!(matches!(a.solve(), Err(Error::Job(m)) if m.contains("stick")));
    let mut none = p.clone();
    none.kinematics[0].creepage = ContactCreepage::default();
    assert!(matches!(none.solve(), Err(Error::Job(m)) if m.contains("direction of sliding")));
}

/// V ∂/∂x of a field that rises along x is its slope times the speed, on every closed node.
#[test]
fn convection_is_the_speed_times_the_slope() {
    let s = interface(4);
    let one = body(STEEL, &s, &LOWER, 0.4);
    let b = CoupledModel::new(&one, &one).unwrap();
    let mut p = problem(&s, &b, 0.3, [0.02, 0.0, 0.0]);
    p.kinematics[0].speed = 7.0;
    for stencil in [Stencil::Edge, Stencil::Upwind1] {
        p.stencil = stencil;
        let contact = p.contact(&p.solve().unwrap());
        let rows = || contact.nodes.iter().map(|n| n.convection.iter());
        let slopes = rows().map(|row| row.map(|&(j, v)| v * s.point(j)[0]).sum::<f64>());
        let sums = rows().map(|row| row.map(|&(_, v)| v).sum::<f64>());
        let spacing = s.patches[0].x[1] - s.patches[0].x[0];
        for (i, (slope, sum)) in slopes.zip(sums).enumerate() {
            assert!(sum.abs() < 1e-9 * 7.0 / spacing, "node {i}: a constant changes by {sum} 1/s");
            assert!((slope - 7.0).abs() < 1e-9 * 7.0, "node {i}: {slope} m/s, {stencil:?}");
        }
    }
}

/// The eigenpairs satisfy the equations they come from: contact forces solved for directly at each λ and put into the
/// modal equations.
#[test]
fn eigenpairs_satisfy_the_original_equations() {
    let s = interface(3);
    let (lower, upper) =
        (body(STEEL, &s, &LOWER, 0.4), body(HalfSpace { young: 80e9, poisson: 0.25 }, &s, &UPPER, -0.2));
    let b = CoupledModel::new(&lower, &upper).unwrap();
    let mut p = problem(&s, &b, 0.4, [0.004, 0.009, 0.3]);
    p.friction = Exponential::new(0.5, 0.3, 0.2).into();
    let sliding = p.solve().unwrap();
    let contact = p.contact(&sliding);
    let pairs = eigenpairs(&b, &contact, TOLERANCE).unwrap();
    let (k, m) = (contact.nodes.len(), b.omega.len());
    assert_eq!(pairs.len(), 2 * m + 2 * k);
    let mut checked = 0;
    for pair in pairs.iter().filter(|p| p.value.im > 0.0) {
        let l = pair.value;
        // Unknown forces R of the closed nodes and changes of their friction; rows: y_n = 0, t + μτ r + p0 τ δμ + D
        // (λ + V∂x) w = 0 with D across the sliding, and the rate of δμ.
        let (mut a, mut rhs) = (Mat::<Complex<f64>>::zeros(4 * k, 4 * k), Mat::<Complex<f64>>::zeros(4 * k, 1));
        for i in 0..k {
            let (node, t, v) = (sliding.closed[i], sliding.direction[i], sliding.velocity[i]);
            let (law, slope) = (p.friction.law(0).coefficient(v), p.friction.law(0).slope(v));
            let mu = sliding.friction[node];
            let p0 = sliding.pressure[node] * s.weight[node];
            let d = |q: usize, c: usize| mu * p0 / v * (f64::from(u8::from(q == c)) - t[q] * t[c]);
            // Material that comes from the node upstream, or with the coefficient at rest from an open one.
            let (length, spacing) = (p.friction.law(0).memory().unwrap().length, s.patches[0].x[1] - s.patches[0].x[0]);
            let kept = (-v * spacing / (p.kinematics[0].speed * length)).exp();
            let from = sliding.closed.iter().position(|&j| j + 1 == node);
            let before = from.map_or(p.friction.law(0).coefficient(0.0), |_| sliding.friction[node - 1]);
            near(mu, kept * before + (1.0 - kept) * law, 1e-12, "friction of the state");
            let rate = v / length / (1.0 - kept);
            let gain = v / length * slope
                - (mu - law) / length * (v * spacing / (p.kinematics[0].speed * length)) / (1.0 - kept);
            // (λ + V∂x) w_c at this node as weights of rows.
            let motion = |c: usize| -> Vec<(usize, Complex<f64>)> {
                let mut list = vec![(3 * node + c, l)];
                list.extend(contact.nodes[i].convection.iter().map(|&(j, v)| (3 * j + c, Complex::new(v, 0.0))));
                list
            };
            let mut row = |r: usize, weights: Vec<(usize, Complex<f64>)>| {
                for (from, weight) in weights {
                    for j in 0..k {
                        for c in 0..3 {
                            a[(r, 3 * j + c)] += weight * b.residual[(from, 3 * contact.nodes[j].node + c)];
                        }
                    }
                    for mode in 0..m {
                        rhs[(r, 0)] -= weight * b.modes[(from, mode)] * pair.modal[mode];
                    }
                }
            };
            row(3 * i + 2, vec![(3 * node + 2, Complex::new(1.0, 0.0))]);
            for q in 0..2 {
                let weights = (0..2).flat_map(|c| motion(c).into_iter().map(move |(f, w)| (f, w * d(q, c)))).collect();
                row(3 * i + q, weights);
            }
            let along = (0..2).flat_map(|c| motion(c).into_iter().map(move |(f, w)| (f, -w * gain * t[c]))).collect();
            row(3 * k + i, along);
            a[(3 * k + i, 3 * k + i)] += l + rate;
            if let Some(from) = from {
                a[(3 * k + i, 3 * k + from)] -= Complex::new(rate * kept, 0.0);
            }
            for q in 0..2 {
                a[(3 * i + q, 3 * k + i)] += Complex::new(p0 * t[q], 0.0);
                a[(3 * i + q, 3 * i + q)] += Complex::new(1.0, 0.0);
                a[(3 * i + q, 3 * i + 2)] += Complex::new(mu * t[q], 0.0);
            }
        }
        a.partial_piv_lu().solve_in_place(&mut rhs);
        for mode in 0..m {
            let force: Complex<f64> = (0..k)
                .flat_map(|j| (0..3).map(move |c| (j, c)))
                .map(|(j, c)| rhs[(3 * j + c, 0)] * b.modes[(3 * contact.nodes[j].node + c, mode)])
                .sum();
            let q = pair.modal[mode];
            let own = (l * l + l * b.damping.get(mode, mode) + b.omega[mode].powi(2)) * q;
            let size = (l.norm_sqr() + b.omega[mode].powi(2)) * pair.modal.iter().map(|q| q.norm()).fold(0.0, f64::max);
            assert!((own - force).norm() < 1e-6 * size, "mode {mode} at {l}: {own} against {force}");
        }
        checked += 1;
    }
    assert!(checked >= m, "only {checked} oscillating pairs");
}

#[test]
fn spectra_are_conjugate_and_participations_sum_to_one() {
    let s = interface(4);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
    let pairs = spectrum(&s, &b, 0.5, [0.0, 0.01, 0.2]);
    for p in &pairs {
        let partner = pairs.iter().map(|q| (q.value - p.value.conj()).norm()).fold(f64::INFINITY, f64::min);
        assert!(partner < 1e-8 * p.value.norm().max(1.0), "{} has no conjugate", p.value);
        let sum: f64 = participation(&b, p).iter().sum();
        assert!((sum - 1.0).abs() < 1e-12, "participations sum to {sum}");
    }
}

/// Mirror images with constant friction: the pressure perturbation lives in the symmetric motions, the creep in the
/// antisymmetric ones, and nothing couples back.
#[test]
fn mirror_images_are_stable_at_any_constant_friction() {
    let s = interface(4);
    let one = body(STEEL, &s, &LOWER, 0.4);
    let b = CoupledModel::new(&one, &one).unwrap();
    for mu in [0.1, 0.3, 0.6, 1.0] {
        for c in [[0.0, 0.02, 0.0], [0.0, -0.02, 0.0], [0.02, 0.0, 0.0], [-0.02, 0.0, 0.0], [0.015, 0.015, 0.1]] {
            let top = &spectrum(&s, &b, mu, c)[0];
            assert!(top.growth_rate() < 0.0, "mu {mu}, creepage {c:?}: {}", top.value);
        }
    }
    // The same bodies with one of them detuned do flutter, so that the test above can fail.
    let other = body(STEEL, &s, &UPPER, -0.6);
    let b = CoupledModel::new(&one, &other).unwrap();
    let top = [0.02, -0.02].map(|eta| spectrum(&s, &b, 0.6, [0.0, eta, 0.0])[0].growth_rate());
    assert!(top[0].max(top[1]) > 0.0, "growth rates {top:?}");
}

/// The bodies change places and ξ, η, φ their signs: nothing else changes.
#[test]
fn exchange_of_the_bodies_leaves_the_spectrum() {
    let s = interface(4);
    let (one, two) = (body(STEEL, &s, &LOWER, 0.4), body(HalfSpace { young: 80e9, poisson: 0.25 }, &s, &UPPER, -0.2));
    let a = spectrum(&s, &CoupledModel::new(&one, &two).unwrap(), 0.4, [0.004, 0.009, 0.3]);
    let b = spectrum(&s, &CoupledModel::new(&two, &one).unwrap(), 0.4, [-0.004, -0.009, -0.3]);
    assert_eq!(a.len(), b.len());
    for p in &a {
        let partner = b.iter().map(|q| (q.value - p.value).norm()).fold(f64::INFINITY, f64::min);
        assert!(partner < 1e-7 * p.value.norm(), "{} has no partner, nearest at {partner}", p.value);
    }
    // The same with friction that falls and remembers.
    let falling = |lower, upper, c| {
        let b = CoupledModel::new(lower, upper).unwrap();
        let mut p = problem(&s, &b, 0.4, c);
        p.friction = Exponential::new(0.45, 0.2, 0.1).into();
        eigenpairs(&b, &p.contact(&p.solve().unwrap()), TOLERANCE).unwrap()
    };
    let (one_way, other_way) = (falling(&one, &two, [0.004, 0.009, 0.3]), falling(&two, &one, [-0.004, -0.009, -0.3]));
    assert_eq!(one_way.len(), other_way.len());
    for p in &one_way {
        let partner = other_way.iter().map(|q| (q.value - p.value).norm()).fold(f64::INFINITY, f64::min);
        assert!(partner < 1e-7 * p.value.norm(), "{} has no partner, nearest at {partner}", p.value);
    }
    // Reversing the creepages alone is another problem.
    let c = spectrum(&s, &CoupledModel::new(&one, &two).unwrap(), 0.4, [-0.004, -0.009, -0.3]);
    assert!((c[0].value - a[0].value).norm() > 1e-3 * a[0].value.norm(), "{} {}", c[0].value, a[0].value);
}

/// The convective term across longitudinal sliding depends on the upstream difference; refining the grid must settle
/// it.
#[test]
fn longitudinal_sliding_converges_with_the_grid() {
    let bodies = |k: usize, stencil| {
        let s = interface(k);
        let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.6)).unwrap();
        let mut p = problem(&s, &b, 0.6, [0.02, 0.0, 0.0]);
        p.stencil = stencil;
        let pairs = eigenpairs(&b, &p.contact(&p.solve().unwrap()), TOLERANCE).unwrap();
        // The modes of the bodies; the relaxation of the contact itself is far more damped.
        let mut v: Vec<Complex<f64>> = pairs.iter().map(|p| p.value).filter(|l| l.im > 0.0 && l.re > -1000.0).collect();
        v.sort_by(|a, b| a.im.total_cmp(&b.im));
        assert_eq!(v.len(), LOWER.len() + UPPER.len(), "a/{k}: {v:?}");
        v
    };
    let [coarse, middle, fine] = [5, 8, 11].map(|k| bodies(k, Stencil::Edge));
    let distance =
        |a: &[Complex<f64>]| a.iter().zip(&fine).map(|(a, b)| (a.re - b.re).abs() / b.re.abs()).fold(0.0, f64::max);
    let d = [distance(&coarse), distance(&middle)];
    assert!(d[0] < 0.15 && d[1] < 0.02 && d[1] < 0.25 * d[0], "growth rates differ from those at a/11 by {d:?}");
    // The two-point difference comes to the same from further away.
    let two = distance(&bodies(11, Stencil::Upwind1));
    assert!(two < 0.15, "two-point difference at a/11: {two}");
}

/// One mode on everything else, with the motion over the contact condensed to its linear course, which is all that
/// these modes have: of every eigenvalue that oscillates, growing or not, whatever the sliding and the law of
/// friction.
#[test]
fn one_mode_on_the_rest_grows_as_the_eigenvalue_does() {
    let s = interface(4);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.7)).unwrap();
    let falling = FrictionLaw::from(Exponential::new(0.45, 0.3, 0.3)).remembering(2e-3);
    let places: Vec<[f64; 2]> = (0..s.len()).map(|i| s.point(i)).collect();
    let (mut count, mut tilted) = (0, 0.0f64);
    for (friction, c) in [
        (FrictionLaw::Constant(0.3), [0.0, 0.02, 0.0]),
        (FrictionLaw::Constant(0.5), [0.015, -0.02, 0.3]),
        (falling, [0.0, 0.03, 0.0]),
    ] {
        let p = SlidingProblem { friction: friction.into(), ..problem(&s, &b, 0.0, c) };
        let contact = p.contact(&p.solve().unwrap());
        let mut pairs = eigenpairs(&b, &contact, TOLERANCE).unwrap();
        // Those of modes; relaxations of the contact have no mode of their own.
        pairs.retain(|e| e.value.im > 0.0 && e.damping_ratio().abs() < 0.02);
        for (pair, found) in pairs.iter().zip(criteria(&b, std::slice::from_ref(&places), &contact, &pairs).unwrap()) {
            let (got, want) = (found.growth_rate, pair.growth_rate());
            assert!((got - want).abs() < 1e-8 * pair.value.norm(), "{c:?} {}: {got}, expected {want}", pair.value);
            // Nothing of it is small: without the tilting the equation would be another one.
            tilted = tilted.max((found.tilting / (want - found.damping)).abs());
            count += 1;
        }
    }
    assert!(count >= 15 && tilted > 0.1, "{count} {tilted}");
}

/// Eigenvalues take residual compliance and modes alone: of bodies that are interpolated there is no more.
#[test]
fn the_whole_compliance_is_not_needed() {
    let s = interface(3);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
    let p = problem(&s, &b, 0.4, [0.004, 0.009, 0.3]);
    let contact = p.contact(&p.solve().unwrap());
    let without = CoupledModel { compliance: Mat::zeros(0, 0), ..b.clone() };
    let [whole, bare] = [&b, &without].map(|b| eigenpairs(b, &contact, TOLERANCE).unwrap());
    assert!(!whole.is_empty() && whole.iter().zip(&bare).all(|(a, b)| a.value == b.value));
}

#[test]
fn an_open_contact_and_one_beyond_the_interface_are_refused() {
    let s = interface(3);
    let one = body(STEEL, &s, &LOWER, 0.4);
    let b = CoupledModel::new(&one, &one).unwrap();
    let p = problem(&s, &b, 0.3, [0.0, 0.01, 0.0]);
    let mut contact = p.contact(&p.solve().unwrap());
    contact.nodes[3].node = s.len();
    assert!(matches!(eigenpairs(&b, &contact, TOLERANCE), Err(Error::Defect(_))));
    assert!(matches!(eigenpairs(&b, &LinearContact::default(), TOLERANCE), Err(Error::Job(_))));
}

/// Full modal matrices say the same as the diagonal ones of the same bodies.
#[test]
fn the_spectrum_does_not_depend_on_the_coordinates() {
    let s = interface(4);
    let (lower, upper) =
        (body(STEEL, &s, &LOWER, 0.4), body(HalfSpace { young: 80e9, poisson: 0.25 }, &s, &UPPER, -0.2));
    let b = CoupledModel::new(&lower, &upper).unwrap();
    let (turned, q) = rotated::rotated(&b);
    // The residual follows from the full stiffness as well.
    let whole = CoupledModel::new(
        &ReducedBody {
            stiffness: of_body(&turned.stiffness, 0),
            damping: of_body(&turned.damping, 0),
            contact_modes: &lower.contact_modes * block(&q, 0, lower.omega.len()),
            ..lower.clone()
        },
        &ReducedBody {
            stiffness: of_body(&turned.stiffness, 1),
            damping: of_body(&turned.damping, 1),
            contact_modes: &upper.contact_modes * block(&q, lower.omega.len(), upper.omega.len()),
            ..upper.clone()
        },
    )
    .unwrap();
    let largest = b.residual.norm_max();
    assert!((&whole.residual - &b.residual).norm_max() < 1e-10 * largest);
    assert!((&whole.modes - &turned.modes).norm_max() < 1e-14 * b.modes.norm_max());
    let wanted = spectrum(&s, &b, 0.35, [0.001, 0.012, 0.0]);
    for other in [&turned, &whole] {
        let found = spectrum(&s, other, 0.35, [0.001, 0.012, 0.0]);
        assert_eq!(found.len(), wanted.len());
        for w in wanted.iter().filter(|w| w.value.im > 0.0) {
            let nearest = found.iter().map(|f| (f.value - w.value).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-9 * w.value.norm(), "{} is missing by {nearest:e}", w.value);
        }
    }
}

/// The block of one body.
fn of_body(matrix: &ModalMatrix, body: usize) -> ModalMatrix {
    ModalMatrix::Blocks(vec![matrix.blocks().swap_remove(body)])
}

fn block(q: &Mat<f64>, first: usize, n: usize) -> Mat<f64> {
    Mat::from_fn(n, n, |i, j| q[(first + i, first + j)])
}

/// Steady rolling with what sticks.
fn rolling<'a>(s: &'a Interface, b: &'a CoupledModel, friction: FrictionLaw, c: [f64; 3]) -> SteadyProblem<'a> {
    let SlidingProblem { interface, compliance, kinematics, loads, stencil, .. } = problem(s, b, 0.3, c);
    let (tolerance, max_iterations) = (1e-11, 400);
    let compliance = compliance.into();
    SteadyProblem {
        interface,
        compliance,
        friction: friction.into(),
        kinematics,
        loads,
        stencil,
        tolerance,
        max_iterations,
    }
}

/// Without sticking nodes, the steady state is that of sliding along the actual creep, with constant friction and with
/// friction that falls.
#[test]
fn the_steady_state_is_that_of_sliding_where_nothing_sticks() {
    let s = interface(4);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
    for law in [FrictionLaw::Constant(0.3), Exponential::new(0.3, 0.2, 0.3).into()] {
        let c = [0.003, -0.03, 0.1];
        let (mut p, steady) = (problem(&s, &b, 0.3, c), rolling(&s, &b, law.clone(), c));
        (p.friction, p.direction) = (law.clone().into(), SlidingDirection::Actual);
        let (sliding, rolling) = (p.contact(&p.solve().unwrap()), steady.contact(&steady.solve().unwrap()));
        assert_eq!((rolling.sticking(), rolling.nodes.len()), (0, sliding.nodes.len()));
        let [sliding, rolling] = [sliding, rolling].map(|c| eigenpairs(&b, &c, TOLERANCE).unwrap());
        assert_eq!(sliding.len(), rolling.len());
        for p in &sliding {
            let partner = rolling.iter().map(|q| (q.value - p.value).norm()).fold(f64::INFINITY, f64::min);
            assert!(partner < 1e-8 * p.value.norm(), "{law}: {} has no partner, nearest at {partner}", p.value);
        }
    }
}

/// In a partly sticking contact, two relaxations a node in stick and one a node in slip come to the modes, and none of
/// them grows. Modes of the bodies converge with the grid; what goes with the speed over the spacing of the nodes is
/// damped too much to be listed.
#[test]
fn contacts_that_stick_in_part_have_modes_and_relaxations() {
    let about = |k: usize, eta: f64| {
        let s = interface(k);
        let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
        let steady = rolling(&s, &b, FrictionLaw::Constant(0.3), [0.0, eta, 0.0]);
        let contact = steady.contact(&steady.solve().unwrap());
        let (stick, closed) = (contact.sticking(), contact.nodes.len());
        assert!(stick > 0 && stick < closed, "{stick} of {closed} nodes stick");
        let pairs = eigenpairs(&b, &contact, TOLERANCE).unwrap();
        assert_eq!(pairs.len(), 2 * b.omega.len() + closed + stick);
        // Friction holds the bodies to each other: nothing of the contact grows.
        assert!(pairs.iter().all(|p| p.value.re < 0.0), "{}", pairs[0].value);
        let mut listed: Vec<Complex<f64>> =
            pairs.iter().filter(|p| p.value.im > 0.0 && p.damping_ratio() < 0.3).map(|p| p.value).collect();
        listed.sort_by(|a, b| a.im.total_cmp(&b.im));
        listed
    };
    for eta in [0.002, 0.004] {
        let [coarse, fine] = [5, 9].map(|k| about(k, eta));
        assert_eq!(coarse.len(), fine.len(), "{eta}: {coarse:.1?}, {fine:.1?}");
        for (a, b) in coarse.iter().zip(&fine) {
            assert!((a - b).norm() < 0.03 * b.norm(), "{eta}: {a} on the coarse grid, {b} on the fine one");
        }
    }
}

/// A node that sticks hands on what friction remembers of slip ahead of it; the eigenvalues are those of the bodies
/// exchanged and reflected.
#[test]
fn partial_slip_with_memory_has_the_symmetry_of_the_exchanged_bodies() {
    let s = interface(4);
    let (one, two) = (body(STEEL, &s, &LOWER, 0.4), body(HalfSpace { young: 80e9, poisson: 0.25 }, &s, &UPPER, -0.2));
    let spectrum = |lower, upper, c: [f64; 3]| {
        let b = CoupledModel::new(lower, upper).unwrap();
        let steady = rolling(&s, &b, Exponential::new(0.4, 0.3, 0.1).into(), c);
        let contact = steady.contact(&steady.solve().unwrap());
        assert!(contact.sticking() > 3 && contact.memory.len() > 10);
        eigenpairs(&b, &contact, TOLERANCE).unwrap()
    };
    let c = [0.002, 0.004, 0.4];
    let (a, b) = (spectrum(&one, &two, c), spectrum(&two, &one, c.map(|c| -c)));
    assert_eq!(a.len(), b.len());
    for p in &a {
        let partner = b.iter().map(|q| (q.value - p.value).norm()).fold(f64::INFINITY, f64::min);
        assert!(partner < 1e-6 * p.value.norm(), "{} has no partner, nearest at {partner}", p.value);
    }
}

/// Growth below rounding is none.
#[test]
fn growth_means_more_than_rounding() {
    let grows = |re: f64, im: f64, error: f64| railsqueal::stability::grows(Complex::new(re, im), error);
    assert!(grows(1e-3, 3e3, 1e-16) && grows(5.0, 0.0, 1e-16));
    assert!(!grows(1e-13, 550.0, 1e-16) && !grows(1e-11, 0.0, 1e-16) && !grows(-1.0, 3e3, 1e-16));
    // Not more than the backward error allows for.
    assert!(!grows(1e-3, 3e3, 1e-8) && grows(1e-2, 3e3, 1e-8));
}

/// Derivative of the eigenvalue nearest to `from` by a difference of fourth order between spectra at two steps ahead,
/// one ahead, one behind and two behind.
fn difference(from: Complex<f64>, spectra: &[Vec<Eigenpair>; 4], step: f64) -> Complex<f64> {
    let near = |all: &Vec<Eigenpair>| {
        let apart = |p: &&Eigenpair| (p.value - from).norm();
        all.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).expect("eigenvalues").value
    };
    let [a, b, c, d] = spectra.each_ref().map(near);
    (8.0 * (b - c) - (a - d)) / (12.0 * step)
}

/// One mass that can move across the sliding, F(λ) = λ² + cλ + ω² + φ² dλ/(1 + d s λ) = 0: its derivatives by ζ and
/// by the friction, which is in d = μp0/v alone, are −F_ζ/F_λ and −d F_d/F_λ.
#[test]
fn derivatives_of_one_mass_in_closed_form() {
    let (omega, c, phi, mu, p0, v, s) = (2.0 * PI * 500.0, 3.0, 0.2, 0.3, 7e3, 0.4, 1e-8);
    let d = mu * p0 / v;
    let modes = Mat::from_fn(3, 1, |i, _| if i == 0 { phi } else { 0.0 });
    let residual = Mat::from_fn(3, 3, |i, j| f64::from(u8::from(i == j)) * [s, s, 1e-9][i]);
    let bodies = single(vec![omega], vec![c], modes, residual);
    let contact = |mu: f64| sliding_nodes(vec![node(0, Slip::steady(p0, [0.0, 1.0], v, mu, 0.0))]);
    let mut pairs = eigenpairs(&bodies, &contact(mu), TOLERANCE).unwrap();
    pairs.retain(|p| p.value.im >= 0.0);
    let here = Linearisation::new(&bodies, &contact(mu), &pairs, TOLERANCE).unwrap();
    let by_damping = here.by_damping(&bodies);
    let step = 1e-5;
    let (ahead, behind) = (contact(mu * (1.0 + step)), contact(mu * (1.0 - step)));
    let by_friction = here.between((&bodies, &ahead), (&bodies, &behind), 2.0 * step).unwrap();
    for ((pair, damping), friction) in pairs.iter().zip(&by_damping).zip(&by_friction) {
        let l = pair.value;
        let yields = 1.0 + d * s * l;
        let slope = 2.0 * l + c + phi * phi * d / (yields * yields);
        let want = -2.0 * omega * l / slope;
        assert!((damping[0] - want).norm() < 1e-8 * want.norm(), "{l}: by ζ {} against {want}", damping[0]);
        let want = -phi * phi * d * l / (yields * yields) / slope;
        assert!((friction - want).norm() < 1e-7 * want.norm(), "{l}: by μ {friction} against {want}");
    }
    assert_eq!(pairs.len(), 2);
}

/// Two like modes, neither of which the contact feels, share their eigenvalue: what damping of either does to both
/// together is its own.
#[test]
fn eigenvalues_that_lie_together_move_together() {
    let (omega, c) = (2.0 * PI * 400.0, 5.0);
    let modes = Mat::from_fn(3, 3, |i, j| if (i, j) == (2, 2) { 0.1 } else { 0.0 });
    let residual = Mat::from_fn(3, 3, |i, j| f64::from(u8::from(i == j)) * 1e-9);
    let bodies = single(vec![omega, omega, 2.0 * omega], vec![c, c, c], modes, residual);
    let contact = sliding_nodes(vec![node(0, Slip::steady(5e3, [0.0, 1.0], 0.5, 0.3, 0.0))]);
    let mut pairs = eigenpairs(&bodies, &contact, TOLERANCE).unwrap();
    pairs.retain(|p| p.value.im > 0.0 && (p.value.im - omega).abs() < 1.0);
    assert_eq!(pairs.len(), 2);
    let found = Linearisation::new(&bodies, &contact, &pairs, TOLERANCE).unwrap().by_damping(&bodies);
    let l = pairs[0].value;
    let want = -2.0 * omega * l / (2.0 * l + c);
    for k in 0..2 {
        let sum: Complex<f64> = found.iter().map(|d| d[k]).sum();
        assert!((sum - want).norm() < 1e-9 * want.norm(), "mode {k}: {sum} against {want}");
    }
    assert!(found.iter().all(|d| d[2].norm() < 1e-9 * want.norm()));
}

/// Derivatives with the state of rest against differences of the eigenvalues, with stick and slip and friction that
/// remembers: by load, speed, creepage, friction, the place of the contact and the damping of a mode.
#[test]
fn derivatives_equal_differences_of_the_eigenvalues() {
    let s = interface(4);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
    let laws = [FrictionLaw::Constant(0.35), Exponential::new(0.4, 0.25, 0.1).into()];
    for (law, eta, sticks) in [(&laws[0], 0.004, true), (&laws[1], 0.004, true), (&laws[1], 0.02, false)] {
        let creepage = [0.0005, eta, 0.05];
        let base = rolling(&s, &b, law.clone(), creepage);
        let contact = base.contact(&base.solve().unwrap());
        assert_eq!(contact.sticking() > 0, sticks, "{law} at {eta}");
        let mut pairs = eigenpairs(&b, &contact, TOLERANCE).unwrap();
        pairs.retain(|p| p.value.im > 0.0 && p.damping_ratio() < 0.3);
        assert_eq!(pairs.len(), b.omega.len());
        let here = Linearisation::new(&b, &contact, &pairs, TOLERANCE).unwrap();
        let at = |change: &dyn Fn(&mut SteadyProblem, f64), by: f64| {
            let mut p = base.clone();
            change(&mut p, by);
            p.contact(&p.solve().unwrap())
        };
        // By load the eigenvalues bend within some hundred newtons, as nodes at the leading edge open and close.
        let steps = |step: f64| [2.0 * step, step, -step, -2.0 * step];
        let compare = |what: &str, step: f64, found: &[Complex<f64>], spectra: [Vec<Eigenpair>; 4]| {
            for (f, p) in found.iter().zip(&pairs) {
                let w = difference(p.value, &spectra, step);
                // Most modes hardly feel the damping of another one: there the difference is of the size of its
                // rounding.
                let rounding = if what == "damping" { 1e-14 * p.value.norm() / step } else { 0.0 };
                assert!(
                    (f - w).norm() < 1e-5 * w.norm() + rounding,
                    "{law} at {eta}, {}, by {what}: {f} against {w}",
                    p.value
                );
            }
        };
        type Change<'a> = &'a dyn Fn(&mut SteadyProblem, f64);
        let changes: [(&str, f64, Change); 5] = [
            ("load", 20.0, &|p, by| p.loads = NormalLoad::Force(70e3 + by).into()),
            ("speed", 3e-3, &|p, by| p.kinematics[0].speed += by),
            ("lateral creepage", 1e-6, &|p, by| p.kinematics[0].creepage.lateral += by),
            ("spin", 1e-3, &|p, by| p.kinematics[0].creepage.spin += by),
            ("friction", 3e-4, &|p, by| p.friction = p.friction.law(0).scaled(1.0 + by).into()),
        ];
        for (what, step, change) in changes {
            let small = 0.05 * step;
            let found = here.between((&b, &at(change, small)), (&b, &at(change, -small)), 2.0 * small).unwrap();
            let spectra = steps(step).map(|by| {
                let there = at(change, by);
                assert!(there.alike(&contact), "{law} at {eta}, {what}");
                eigenpairs(&b, &there, TOLERANCE).unwrap()
            });
            compare(what, step, &found, spectra);
        }
        // Other modes under the contact, with their compliance.
        let (step, small) = (1e-5, 5e-7);
        let moved = |by: f64| {
            let moved = b.with_contact_moved(&s, Side::Upper, by);
            let p = SteadyProblem { compliance: moved.influence().into(), ..base.clone() };
            let contact = p.contact(&p.solve().unwrap());
            (moved, contact)
        };
        let (ahead, behind) = (moved(small), moved(-small));
        let found = here.between((&ahead.0, &ahead.1), (&behind.0, &behind.1), 2.0 * small).unwrap();
        let spectra = steps(step).map(|by| {
            let (bodies, contact) = moved(by);
            eigenpairs(&bodies, &contact, TOLERANCE).unwrap()
        });
        compare("place", step, &found, spectra);
        // Damping, with the state kept.
        let found = here.by_damping(&b);
        for k in 0..b.omega.len() {
            let step = 1e-4;
            let spectra = steps(step).map(|by| {
                let mut damped = b.clone();
                let more = |i: usize| if i == k { 2.0 * b.omega[k] * by } else { 0.0 };
                damped.damping = (0..b.omega.len()).map(|i| b.damping.get(i, i) + more(i)).collect::<Vec<f64>>().into();
                eigenpairs(&damped, &contact, TOLERANCE).unwrap()
            });
            compare("damping", step, &found.iter().map(|d| d[k]).collect::<Vec<_>>(), spectra);
        }
    }
}

/// The modes of a contact that is moved are those at the place it has gone to; these are linear along the surface.
#[test]
fn a_contact_that_moves_sees_the_modes_there() {
    let s = interface(3);
    let b = CoupledModel::new(&body(STEEL, &s, &LOWER, 0.4), &body(STEEL, &s, &UPPER, -0.2)).unwrap();
    let distance = 1.3e-3;
    let moved = b.with_contact_moved(&s, Side::Lower, distance);
    let spacing = s.patches[0].y[1] - s.patches[0].y[0];
    for row in 0..3 * s.len() {
        for k in 0..b.omega.len() {
            let next = if row / 3 / s.patches[0].x.len() + 1 < s.patches[0].y.len() { 1.0 } else { -1.0 };
            let beside = (row as f64 + next * 3.0 * s.patches[0].x.len() as f64) as usize;
            let slope = if k < LOWER.len() { next * (b.modes[(beside, k)] - b.modes[(row, k)]) / spacing } else { 0.0 };
            let want = b.modes[(row, k)] + distance * slope;
            assert!((moved.modes[(row, k)] - want).abs() < 1e-13, "row {row}, mode {k}");
        }
    }
    assert_eq!(moved.residual, b.residual);
    let unmoved = b.with_contact_moved(&s, Side::Upper, 0.0);
    assert!((&unmoved.compliance - &b.compliance).norm_max() < 1e-14 * b.compliance.norm_max());
}

/// A wheelset that no contact moves: each mode of its section decays by itself, λ = −ζω ± iω√(1 − ζ²), and torsion as a
/// whole, which nothing resists, is a double zero. The contact that slides beside it has a relaxation of its own.
#[test]
fn a_free_wheelset_decays_by_its_modes_alone() {
    let shape = WheelShape::w920s_wheelset();
    let given = SectionSource::Wheel(Wheel { shape, offset: 0.0, height: None, mirrored: false });
    let section = given.for_modes().unwrap();
    let bearing = |y: f64| Bearing { place: [0.0, y], stiffness: [1e6; 3] };
    let bearings = given.bearings(&section, &[bearing(-1.0), bearing(1.0)]).unwrap();
    let steel = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7860.0 };
    let forms = Forms::new(section, steel, &[]).unwrap().on_bearings(&bearings);
    let mut omega: Vec<f64> =
        (0..3).flat_map(|n| swept::modes::of_order(&forms, n, 2.0 * PI * 1500.0).unwrap().omega).collect();
    omega.sort_by(f64::total_cmp);
    assert!(omega[0] == 0.0 && omega[1] > 1.0 && omega.len() > 8, "{omega:?}");
    let loss = |k: usize| [2e-3, 2e-4][k % 2];
    let damping: Vec<f64> = omega.iter().enumerate().map(|(k, w)| loss(k) * w).collect();
    let still = Mat::zeros(3, omega.len());
    let pair = single(omega.clone(), damping, still, Mat::from_fn(3, 3, |i, j| if i == j { 1e-9 } else { 0.0 }));
    let tangent = Tangent::Slip(Slip::steady(5e3, [0.6, 0.8], 0.2, 0.4, 0.0));
    let nodes = vec![LinearNode { node: 0, tangent, convection: Vec::new() }];
    let found = eigenpairs(&pair, &LinearContact { nodes, ..LinearContact::default() }, TOLERANCE).unwrap();
    assert_eq!(found.iter().filter(|pair| pair.value.im != 0.0).count(), 2 * (omega.len() - 1));
    for (k, w) in omega.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        let half = 0.5 * loss(k) * w;
        let want = Complex::new(-half, (w * w - half * half).sqrt());
        let apart = found.iter().map(|pair| (pair.value - want).norm()).fold(f64::INFINITY, f64::min);
        assert!(apart < 1e-9 * w, "{k}: {apart:e} of {w}");
    }
    assert_eq!(found.iter().filter(|pair| pair.value.norm() < 1e-3).count(), 2);
}

/// Two mirror images that do not see each other have every eigenvalue twice, each pair to the accuracy that was asked
/// for.
#[test]
fn equal_eigenvalues_have_vectors_of_their_own() {
    let count = 8;
    let omega: Vec<f64> = (0..2 * count).map(|k| 500.0 * (1 + k / 2) as f64).collect();
    let seen = |i: usize, k: usize| 0.05 * ((1 + i) as f64 * (2.3 + k as f64)).sin();
    let rows = |i: usize, k: usize| if i / 6 == k % 2 { seen(i % 6, k / 2) } else { 0.0 };
    let modes = Mat::from_fn(12, 2 * count, rows);
    let residual = Mat::from_fn(12, 12, |i, j| if i == j { 1e-8 } else { 0.0 });
    let pair = single(omega.clone(), vec![1.0; 2 * count], modes, residual);
    let node = |node: usize| LinearNode {
        node,
        tangent: Tangent::Slip(Slip::steady(5e3, [0.6, 0.8], 0.2, 0.4, 0.0)),
        convection: Vec::new(),
    };
    let contact = LinearContact { nodes: (0..4).map(node).collect(), ..LinearContact::default() };
    let found = eigenpairs(&pair, &contact, TOLERANCE).unwrap();
    for pair in &found {
        let twin = found.iter().filter(|other| (other.value - pair.value).norm() < 1e-6 * pair.value.norm()).count();
        assert!(twin == 2 && pair.backward_error <= TOLERANCE, "{}: {twin}", pair.value);
    }
}
