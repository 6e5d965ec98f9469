//! Steady rolling on half-spaces against Hertz, CONTACT and Kalker's linear theory, its signs and symmetries, and an
//! independent solution by marching in time.

use faer::Mat;
use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::{
    ContactCreepage, Continuation, NormalLoad, PatchKinematics, SteadyProblem, SteadySolution, Stencil,
};
use railsqueal::friction::{Exponential, FrictionLaw};
use railsqueal::grid::Interface;
use railsqueal::model::{combined_compliance, Convolution};
use railsqueal::Error;

const STEEL: HalfSpace = HalfSpace { young: 205e9, poisson: 0.3 };
const SOFT: HalfSpace = HalfSpace { young: 60e9, poisson: 0.1 };
const MU: f64 = 0.3;

/// Interface and influence matrix of two bodies with equal radii of 0.5 m both ways.
struct Pair {
    interface: Interface,
    w: Mat<f64>,
    /// Hertz's contact radius, m.
    a: f64,
    load: f64,
}

impl Pair {
    /// `k` nodes per contact radius, and two beyond it.
    fn new(lower: HalfSpace, upper: HalfSpace, load: f64, k: usize) -> Self {
        let modulus = 1.0 / (1.0 / lower.plane() + 1.0 / upper.plane());
        let a = (0.75 * load / (modulus * 4.0)).cbrt();
        let n = 2 * (k + 2) + 1;
        let half = a * (k + 2) as f64 / k as f64;
        let interface = Interface::paraboloid(n, n, [half, half], [4.0, 4.0]).unwrap();
        let [c1, c2] = [lower, upper].map(|m| m.compliance(&interface.patches[0].x, &interface.patches[0].y).unwrap());
        let w = combined_compliance(c1.as_ref(), c2.as_ref()).unwrap();
        Self { interface, w, a, load }
    }

    fn problem(&self, xi: f64, eta: f64, phi: f64) -> SteadyProblem<'_> {
        SteadyProblem {
            interface: &self.interface,
            compliance: self.w.as_ref().into(),
            friction: FrictionLaw::Constant(MU).into(),
            kinematics: PatchKinematics::one(10.0, ContactCreepage { longitudinal: xi, lateral: eta, spin: phi }),
            loads: NormalLoad::Force(self.load).into(),
            stencil: Stencil::default(),
            tolerance: 1e-8,
            max_iterations: 200,
        }
    }

    fn solve(&self, xi: f64, eta: f64, phi: f64) -> SteadySolution {
        let s = self.problem(xi, eta, phi).solve().unwrap();
        assert!(s.residual <= 1e-8, "residual {}", s.residual);
        s
    }

    /// Node (ix, iy) counted from the centre.
    fn at(&self, ix: isize, iy: isize) -> usize {
        let nx = self.interface.patches[0].x.len() as isize;
        let ny = self.interface.patches[0].y.len() as isize;
        (nx / 2 + ix + nx * (ny / 2 + iy)) as usize
    }
}

/// Value at h = 0 of f = f0 + c h² through the points (1/k, f(k)) in the sense of least squares: the order that the
/// default upstream difference shows.
fn extrapolate(grids: &[usize], f: impl Fn(usize) -> f64) -> f64 {
    let points: Vec<(f64, f64)> = grids.iter().map(|&k| (1.0 / (k * k) as f64, f(k))).collect();
    let n = points.len() as f64;
    let (mh, mf) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let slope = points.iter().map(|p| (p.0 - mh) * (p.1 - mf)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mh).powi(2)).sum::<f64>();
    mf - slope * mh
}

fn near(got: f64, want: f64, relative: f64, what: &str) {
    assert!((got / want - 1.0).abs() <= relative, "{what}: {got:.6e}, expected {want:.6e} within {relative}");
}

#[test]
fn normal_contact_is_hertz() {
    for (load, a, p0, approach) in [(10e3, 2.553e-3, 732.4e6, 26.08e-6), (70e3, 4.884e-3, 1401.0e6, 95.43e-6)] {
        let pair = Pair::new(STEEL, STEEL, load, 12);
        let s = pair.solve(0.0, 0.0, 0.0);
        near(s.force[2], -load, 1e-8, "force");
        near(s.motions[0], approach, 1e-3, "approach");
        near(s.pressure.iter().copied().fold(0.0, f64::max), p0, 2e-3, "largest pressure");
        let area: f64 = (0..s.state.len()).filter(|&i| s.state[i] > 0).map(|i| pair.interface.weight[i]).sum();
        near((area / std::f64::consts::PI).sqrt(), a, 0.02, "radius");
        for (i, p) in s.pressure.iter().enumerate() {
            let [x, y] = pair.interface.point(i);
            let want = p0 * (1.0 - (x * x + y * y) / (a * a)).max(0.0).sqrt();
            // The nodes at the border carry what their cells hold.
            let border = ((x.hypot(y) - a) / a).abs() < 0.1;
            assert!(border || (p - want).abs() < 0.01 * p0, "pressure at {x}, {y}: {p} against {want}");
        }
        // Nothing rolls against anything: no traction.
        assert!(s.traction.iter().all(|t| t[0].hypot(t[1]) <= 1e-8 * p0), "traction without creepage");
    }
}

/// The centre of the pressure lies at the lowest place of the gap, beside the origin; of one in the middle it is
/// the origin, with friction, too: of equal bodies the pressure does not know of it.
#[test]
fn centre_of_the_pressure_follows_the_gap() {
    let mut pair = Pair::new(STEEL, STEEL, 70e3, 6);
    let middle = pair.solve(0.0, 0.003, 0.0).centre(&pair.interface);
    assert!(middle.iter().all(|x| x.abs() < 1e-9), "{middle:?} m");
    let step = pair.interface.patches[0].x[1] - pair.interface.patches[0].x[0];
    let gap = (0..pair.interface.len()).map(|i| {
        let [x, y] = pair.interface.point(i);
        2.0 * ((x - step).powi(2) + (y + 0.5 * step).powi(2))
    });
    pair.interface = pair.interface.with_gap(gap.collect());
    let [x, y] = pair.solve(0.0, 0.0, 0.0).centre(&pair.interface);
    assert!((x / step - 1.0).abs() < 0.02 && (y / step + 0.5).abs() < 0.02, "{x} and {y} m for {step} m");
}

#[test]
fn lateral_forces_are_those_of_contact() {
    for (load, eta, want) in
        [(70e3, 0.003, -0.7177), (70e3, 0.001, -0.3005), (70e3, 0.005, -0.9304), (10e3, 0.003, -0.9684)]
    {
        let got = extrapolate(&[6, 9, 13], |k| {
            let s = Pair::new(STEEL, STEEL, load, k).solve(0.0, eta, 0.0);
            assert!(s.force[0].abs() < 1e-6 * load, "longitudinal force {}", s.force[0]);
            s.force[1] / (MU * load)
        });
        near(got, want, 0.005, &format!("F_y/muN at {load} N, eta {eta}"));
    }
}

/// CONTACT's own grid error: with its own difference and a grid of a/16 it gives |F_y|/μN = 0.7283.
#[test]
fn two_point_difference_gives_the_figure_of_contact_on_the_same_grid() {
    let pair = Pair::new(STEEL, STEEL, 70e3, 16);
    let mut p = pair.problem(0.0, 0.003, 0.0);
    p.stencil = Stencil::Upwind1;
    near(p.solve().unwrap().force[1] / (MU * 70e3), -0.7283, 1e-4, "F_y/muN");
}

#[test]
fn traction_along_the_rolling_direction_is_that_of_contact() {
    let rows: Vec<[f64; 3]> = include_str!("data/contact_n70_eta03_y0.csv")
        .lines()
        .filter(|l| !l.starts_with('#') && !l.starts_with('x'))
        .map(|l| {
            let v: Vec<f64> = l.split(',').take(3).map(|v| v.parse().unwrap()).collect();
            [v[0], v[1], v[2]]
        })
        .collect();
    let k = 16;
    let pair = Pair::new(STEEL, STEEL, 70e3, k);
    let s = pair.solve(0.0, 0.003, 0.0);
    let bound = MU * 1401e6;
    let mut compared = 0;
    for ix in -(k as isize) + 2..=k as isize - 2 {
        let i = pair.at(ix, 0);
        let x = pair.interface.point(i)[0];
        let j = rows.windows(2).position(|w| w[0][0] <= x && x <= w[1][0]).unwrap();
        let f = (x - rows[j][0]) / (rows[j + 1][0] - rows[j][0]);
        let between = |c: usize| rows[j][c] + f * (rows[j + 1][c] - rows[j][c]);
        let (p, t) = (between(1), between(2));
        assert!((s.pressure[i] - p).abs() < 0.01 * 1401e6, "pressure at x = {x}: {} against {p}", s.pressure[i]);
        assert!((s.traction[i][1] - t).abs() < 0.02 * bound, "traction at x = {x}: {} against {t}", s.traction[i][1]);
        compared += 1;
    }
    assert_eq!(compared, 29);

    // Stick from the leading edge (x < 0; the very edge node may slip) to x/a = 0.22, slip from there on.
    let states: Vec<u8> = (-(k as isize)..=k as isize).map(|ix| s.state[pair.at(ix, 0)]).collect();
    let last = states.iter().rposition(|&v| v == 1).unwrap() as f64 / k as f64 - 1.0;
    assert!((last - 0.22).abs() < 1.0 / k as f64, "stick ends at x/a = {last}: {states:?}");
    assert!(states[2..(last * k as f64) as usize + k].iter().all(|&v| v == 1), "{states:?}");
    let closed = s.state.iter().filter(|&&v| v > 0).count() as f64;
    let stick = s.state.iter().filter(|&&v| v == 1).count() as f64;
    assert!((stick / closed - 0.518).abs() < 0.02, "stick fraction {}", stick / closed);
    for i in 0..s.state.len() {
        match s.state[i] {
            1 => assert!(s.creep[i][0].hypot(s.creep[i][1]) < 1e-8, "creep {:?} in stick", s.creep[i]),
            2 => assert!(s.creep[i][1] * s.traction[i][1] < 0.0, "traction along the creep at node {i}"),
            _ => assert_eq!(s.traction[i], [0.0, 0.0]),
        }
    }
}

/// Kalker's creepage coefficients of a circular contact at ν = 1/4: C11 = 4.12, C22 = 3.67, C23 = 1.47 (J. J. Kalker,
/// Three-Dimensional Elastic Bodies in Rolling Contact, 1990, appendix E), and C22 = 3.729 at ν = 0.3. In the frame
/// where the contact rolls towards −x: F_x = −C11 G a² ξ, F_y = −C22 G a² η + C23 G a³ φ.
#[test]
fn forces_without_slip_are_those_of_the_linear_theory() {
    let quarter = HalfSpace { young: 205e9, poisson: 0.25 };
    let coefficient = |m: HalfSpace, c: [f64; 3], component: usize, power: i32| {
        let pair = Pair::new(m, m, 10e3, 16);
        let mut p = pair.problem(c[0], c[1], c[2]);
        p.friction = FrictionLaw::Constant(1e3).into();
        let s = p.solve().unwrap();
        assert!(s.state.iter().all(|&v| v != 2), "slip at friction 1000");
        s.force[component] / (m.shear() * pair.a.powi(power) * (c[0] + c[1] + c[2]))
    };
    near(coefficient(quarter, [1e-5, 0.0, 0.0], 0, 2), -4.12, 0.01, "C11");
    near(coefficient(quarter, [0.0, 1e-5, 0.0], 1, 2), -3.67, 0.01, "C22");
    near(coefficient(STEEL, [0.0, 1e-5, 0.0], 1, 2), -3.729, 0.01, "C22, nu = 0.3");
    near(coefficient(quarter, [0.0, 0.0, 1e-3], 1, 3), 1.47, 0.015, "C23");
}

/// Half-spaces slide as a whole from |η| = πμp0(4−ν)/8G and |ξ| = πμp0(4−3ν)/8G on.
/// The lateral force of spin alone, a rigid slip of 0.2 % at the edge, wherever the leading edge lies between the
/// nodes: too small by some 2 h²/a², so that fourteen spacings in the half axis make it good to about 1 %.
#[test]
fn spin_converges_with_the_square_of_the_spacing() {
    let force = |k: f64| {
        let mut pair = Pair::new(STEEL, STEEL, 70e3, 4);
        let (h, reach) = (pair.a / k, k.ceil() as usize + 2);
        let (n, half) = (2 * reach + 1, h * reach as f64);
        pair.interface = Interface::paraboloid(n, n, [half, half], [4.0, 4.0]).unwrap();
        let c = STEEL.compliance(&pair.interface.patches[0].x, &pair.interface.patches[0].y).unwrap();
        pair.w = combined_compliance(c.as_ref(), c.as_ref()).unwrap();
        pair.solve(0.0, 0.0, 0.4).force[1] / (MU * 70e3)
    };
    // By seven grids down to a/33, and within the linear theory without slip: 0.258.
    let limit = 0.2540;
    for k in [4.88, 6.98, 9.77, 13.95, 14.0, 14.5] {
        let off = force(k) / limit - 1.0;
        assert!(off < 2e-3 && off > -2.6 / (k * k), "a/{k}: {off:+.4}");
    }
    assert!(force(4.88) / limit < 0.94, "a coarse grid");
}

#[test]
fn full_sliding_begins_at_the_creepages_of_the_half_space() {
    let pair = Pair::new(STEEL, STEEL, 70e3, 12);
    let sticks = |xi, eta| pair.solve(xi, eta, 0.0).state.iter().filter(|&&v| v == 1).count();
    assert_eq!(sticks(0.0, 1.05 * 0.00775), 0);
    assert!(sticks(0.0, 0.9 * 0.00775) > 0);
    assert_eq!(sticks(1.05 * 0.00649, 0.0), 0);
    assert!(sticks(0.9 * 0.00649, 0.0) > 0);
}

fn largest_difference(a: &[[f64; 2]], b: impl Fn(usize) -> [f64; 2]) -> f64 {
    a.iter().enumerate().map(|(i, v)| (v[0] - b(i)[0]).abs().max((v[1] - b(i)[1]).abs())).fold(0.0, f64::max)
}

#[test]
fn symmetries_of_unlike_bodies() {
    let pair = Pair::new(STEEL, SOFT, 70e3, 8);
    let s = pair.solve(1e-3, -2e-3, 0.3);
    let p0 = s.pressure.iter().copied().fold(0.0, f64::max);
    // Mirror y → −y.
    let m = pair.solve(1e-3, 2e-3, -0.3);
    let (nx, ny) = (pair.interface.patches[0].x.len(), pair.interface.patches[0].y.len());
    let mirror = |i: usize| i % nx + nx * (ny - 1 - i / nx);
    let d = largest_difference(&s.traction, |i| [m.traction[mirror(i)][0], -m.traction[mirror(i)][1]]);
    assert!(d < 1e-7 * p0, "mirror image differs by {d} Pa");
    near(m.moment_z, -s.moment_z, 1e-6, "moment of the mirror image");
    // The bodies change places and every creepage its sign: the lower body then feels the opposite.
    let other = Pair::new(SOFT, STEEL, 70e3, 8);
    let e = other.solve(-1e-3, 2e-3, -0.3);
    let d = largest_difference(&s.traction, |i| [-e.traction[i][0], -e.traction[i][1]]);
    assert!(d < 1e-7 * p0, "after the exchange of bodies the traction differs by {d} Pa");
    near(e.motions[0], s.motions[0], 1e-9, "approach after the exchange");
    // Unlike bodies: normal and tangential are coupled, so reversing the creepages alone is no symmetry here…
    let r = pair.solve(-1e-3, 2e-3, -0.3);
    let d = largest_difference(&s.traction, |i| [-r.traction[i][0], -r.traction[i][1]]);
    assert!(d > 1e-3 * p0, "coupling has vanished: {d}");
    // …but it is for like ones.
    let like = Pair::new(STEEL, STEEL, 70e3, 8);
    let (a, b) = (like.solve(1e-3, -2e-3, 0.3), like.solve(-1e-3, 2e-3, -0.3));
    let d = largest_difference(&a.traction, |i| [-b.traction[i][0], -b.traction[i][1]]);
    assert!(d < 1e-7 * p0, "reversal: {d} Pa");
}

#[test]
fn sliding_longitudinally_sticks_at_the_leading_edge_too() {
    let pair = Pair::new(STEEL, STEEL, 70e3, 10);
    for xi in [1.5e-3, -1.5e-3] {
        let s = pair.solve(xi, 0.0, 0.0);
        assert!(s.force[0] * xi < 0.0, "force {} at creepage {xi}", s.force[0]);
        let closed: Vec<u8> = (-10..=10).map(|i| s.state[pair.at(i, 0)]).filter(|&v| v > 0).collect();
        let half = closed.len() / 2;
        assert!(closed[1..half - 2].iter().all(|&v| v == 1), "leading half: {closed:?}");
        assert_eq!(closed[closed.len() - 1], 2, "trailing edge: {closed:?}");
    }
}

/// A law that falls with the velocity: every sliding node has the coefficient at its own creep velocity, which is not
/// the rigid one, and every sticking node stays below the coefficient at rest.
#[test]
fn falling_friction_takes_the_coefficient_at_the_local_creep() {
    let pair = Pair::new(STEEL, SOFT, 70e3, 8);
    let law = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.05));
    let (mut slipping, mut sticking, mut spread) = (0, 0, 0.0f64);
    for creepages in [[0.0, 2e-3, 0.0], [-3e-3, 4e-3, 0.3], [0.02, 0.01, 0.0]] {
        let [xi, eta, phi] = creepages;
        let mut p = pair.problem(xi, eta, phi);
        p.friction = law.clone().into();
        let s = p.solve().unwrap();
        let peak = s.pressure.iter().copied().fold(0.0, f64::max);
        let mut mu = 0.4;
        for i in (0..s.pressure.len()).filter(|&i| s.state[i] > 0) {
            // What the material brought and what it learned on the way from the node upstream.
            let before = if s.state[i - 1] > 0 { mu } else { 0.4 };
            let (v, spacing) =
                (s.creep[i][0].hypot(s.creep[i][1]), pair.interface.patches[0].x[1] - pair.interface.patches[0].x[0]);
            let kept = (-v.max(1e-3) * spacing / (10.0 * 2e-5)).exp();
            mu = kept * before + (1.0 - kept) * law.coefficient(v);
            assert!((s.friction[i] - mu).abs() < 1e-12, "node {i}: {} against {mu}", s.friction[i]);
            let (t, c) = (s.traction[i], s.creep[i]);
            let v = c[0].hypot(c[1]);
            let size = t[0].hypot(t[1]);
            if s.state[i] == 1 {
                sticking += 1;
                assert!(size <= s.friction[i] * s.pressure[i] + 1e-7 * peak, "stick at node {i}: {size}");
            } else {
                slipping += 1;
                let [x, y] = pair.interface.point(i);
                let rigid = p.kinematics[0].creepage.rigid(x, y);
                spread = spread.max((law.coefficient(10.0 * rigid[0].hypot(rigid[1])) - law.coefficient(v)).abs());
                let bound = s.friction[i] * s.pressure[i];
                assert!((size - bound).abs() < 1e-7 * peak, "slip at node {i}: |t| = {size}, mu p = {bound}");
                let along = (t[0] * c[0] + t[1] * c[1]) / (size * v).max(1e-300);
                assert!(v < 1e-6 || along < -1.0 + 1e-9, "node {i}: traction along the creep {along}");
            }
        }
        // The same coefficient at all velocities is Coulomb's law.
        p.friction = Exponential::new(MU, MU, 0.05).into();
        let (flat, constant) = (p.solve().unwrap(), pair.solve(xi, eta, phi));
        assert!(largest_difference(&flat.traction, |i| constant.traction[i]) < 1e-6 * peak);
    }
    assert!(slipping > 100 && sticking > 50, "{slipping} slip, {sticking} stick");
    assert!(spread > 0.01, "local and rigid creep give coefficients that differ by {spread} at the most");
}

/// A memory that is short against the elements leaves each node the coefficient at its own creep velocity, a long one
/// that at rest.
#[test]
fn short_and_long_memories() {
    let pair = Pair::new(STEEL, SOFT, 70e3, 8);
    let mut p = pair.problem(0.001, 3e-3, 0.2);
    for (length, long) in [(1e-8, false), (10.0, true)] {
        let law = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.05).remembering(length));
        p.friction = law.clone().into();
        let s = p.solve().unwrap();
        let mut slipping = 0;
        for i in (0..s.pressure.len()).filter(|&i| s.state[i] == 2) {
            let v = s.creep[i][0].hypot(s.creep[i][1]);
            let want = if long { 0.4 } else { law.coefficient(v) };
            assert!(
                (s.friction[i] - want).abs() < 1e-5,
                "memory of {length} m, node {i}, {v} m/s: {} against {want}",
                s.friction[i]
            );
            slipping += 1;
        }
        assert!(slipping > 20, "{slipping} nodes in slip");
    }
}

/// However steeply friction falls within reason, a state is found that obeys the laws at the local creep.
#[test]
fn friction_that_falls_steeply_is_solved() {
    let pair = Pair::new(STEEL, STEEL, 70e3, 6);
    for decay_velocity in [2e-1, 2e-2, 5e-3, 1e-3, 2e-4] {
        for eta in [5e-4, 4e-3] {
            let mut p = pair.problem(0.0, eta, 0.0);
            p.friction = Exponential::new(0.6, 0.05, decay_velocity).into();
            let s = p.solve().unwrap_or_else(|e| panic!("v_d = {decay_velocity}, eta = {eta}: {e}"));
            assert!(s.residual <= 1e-8, "v_d = {decay_velocity}, eta = {eta}: residual {}", s.residual);
        }
    }
}

/// A compliance common to all nodes (the bulk of a body) moves the bodies, not the stresses.
#[test]
fn bulk_compliance_only_shifts_the_approach() {
    let pair = Pair::new(STEEL, SOFT, 70e3, 6);
    let s = pair.solve(1e-3, -2e-3, 0.3);
    let bulk = 3e-9;
    let n = pair.w.nrows();
    let w = Mat::from_fn(n, n, |i, j| pair.w[(i, j)] + if i % 3 == j % 3 { bulk } else { 0.0 });
    let mut p = pair.problem(1e-3, -2e-3, 0.3);
    p.compliance = w.as_ref().into();
    let b = p.solve().unwrap();
    near(b.motions[0], s.motions[0] + bulk * 70e3, 1e-8, "approach");
    let d = largest_difference(&s.traction, |i| b.traction[i]);
    assert!(d < 1e-6 * 1e9, "traction moved by {d} Pa");
}

#[test]
fn approach_given_equals_load_given_and_speed_only_scales_the_creep() {
    let pair = Pair::new(STEEL, SOFT, 70e3, 6);
    let s = pair.solve(1e-3, -2e-3, 0.3);
    let mut p = pair.problem(1e-3, -2e-3, 0.3);
    p.loads = NormalLoad::Approach(s.motions[0]).into();
    p.kinematics[0].speed = 20.0;
    let b = p.solve().unwrap();
    // The upstream difference takes the leading edge from the frictionless contact, which at this approach carries a
    // little less than at this load.
    near(b.force[2], -70e3, 1e-4, "force");
    near(b.force[1], s.force[1], 1e-4, "lateral force");
    p.loads = NormalLoad::Force(70e3).into();
    let b = p.solve().unwrap();
    let d = largest_difference(&b.creep, |i| s.creep[i].map(|v| 2.0 * v));
    assert!(d < 1e-7, "creep at twice the speed: {d} m/s");
    let like = Pair::new(STEEL, STEEL, 70e3, 6);
    let s = like.solve(1e-3, -2e-3, 0.3);
    let mut p = like.problem(1e-3, -2e-3, 0.3);
    p.loads = NormalLoad::Approach(s.motions[0]).into();
    let b = p.solve().unwrap();
    near(b.force[2], -70e3, 1e-7, "force of like bodies");
    near(b.force[1], s.force[1], 1e-7, "lateral force of like bodies");
    p.loads = NormalLoad::Approach(-1e-6).into();
    let open = p.solve().unwrap();
    assert_eq!(open.force, [0.0; 3]);
    assert!(open.state.iter().all(|&v| v == 0) && open.gap.iter().all(|&g| g >= 1e-6));
}

/// Independent of the solver: rolling marched in time as Kalker does, a node per step, w_i(t) − w_{i−1}(t − h), each
/// step by projected Gauss–Seidel on pressures and tractions, until nothing moves. Its steady state is that of the
/// two-point difference.
#[test]
fn unlike_bodies_agree_with_marching_in_time() {
    let pair = Pair::new(STEEL, SOFT, 70e3, 4);
    let (xi, eta, phi) = (1.5e-3, -1e-3, 0.4);
    let mut p = pair.problem(xi, eta, phi);
    p.stencil = Stencil::Upwind1;
    let s = p.solve().unwrap();
    assert!(s.state.contains(&1) && s.state.contains(&2), "the case must hold stick and slip");

    let (n, nx) = (pair.interface.len(), pair.interface.patches[0].x.len());
    let dx = pair.interface.patches[0].x[1] - pair.interface.patches[0].x[0];
    let c = p.kinematics[0].creepage;
    let w = |i: usize, j: usize| pair.w[(i, j)];
    let mut r = vec![0.0f64; 3 * n];
    let mut u = vec![0.0f64; 3 * n];
    let mut moved = f64::INFINITY;
    for _ in 0..400 {
        let old = u.clone();
        let before = r.clone();
        for _ in 0..200 {
            let mut change = 0.0f64;
            for i in 0..n {
                let mut set = |k: usize, v: f64, r: &mut Vec<f64>, u: &mut Vec<f64>| {
                    let d = v - r[k];
                    if d != 0.0 {
                        r[k] = v;
                        (0..3 * n).for_each(|j| u[j] += w(j, k) * d);
                        change = change.max(d.abs());
                    }
                };
                let g = pair.interface.gap[i] - s.motions[0] + u[3 * i + 2];
                let k = 3 * i + 2;
                let value = (r[k] - g / w(k, k)).max(0.0);
                set(k, value, &mut r, &mut u);
                let bound = MU * r[k];
                let [x, y] = pair.interface.point(i);
                let rigid = c.rigid(x, y);
                let z = [0, 1].map(|q| {
                    let foot = if i % nx == 0 { 0.0 } else { old[3 * (i - 1) + q] };
                    r[3 * i + q] - (rigid[q] * dx + u[3 * i + q] - foot) / w(3 * i + q, 3 * i + q)
                });
                let f = (bound / z[0].hypot(z[1]).max(1e-300)).min(1.0);
                for (q, z) in z.iter().enumerate() {
                    set(3 * i + q, f * z, &mut r, &mut u);
                }
            }
            if change < 1e-9 {
                break;
            }
        }
        moved = r.iter().zip(&before).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if moved < 1e-7 {
            break;
        }
    }
    assert!(moved < 1e-7, "the march has not settled: {moved} N");
    let peak = r.iter().copied().fold(0.0, f64::max);
    for i in 0..n {
        let got = [s.traction[i][0], s.traction[i][1], s.pressure[i]].map(|v| v * pair.interface.weight[i]);
        for q in 0..3 {
            let d = (got[q] - r[3 * i + q]).abs();
            assert!(d < 1e-6 * peak, "node {i} component {q}: {} against {} marched", got[q], r[3 * i + q]);
        }
    }
}

#[test]
fn bad_problems_are_refused_with_a_reason() {
    let pair = Pair::new(STEEL, STEEL, 70e3, 5);
    let good = pair.problem(1e-3, 1e-3, 0.1);
    let rolling = good.kinematics[0];
    let fails = |p: SteadyProblem<'_>| p.solve().err();
    let job = |p: SteadyProblem<'_>, word: &str| match fails(p) {
        Some(Error::Job(m)) => assert!(m.contains(word), "{m}"),
        other => panic!("{word}: {other:?}"),
    };
    job(SteadyProblem { kinematics: PatchKinematics::one(0.0, rolling.creepage), ..good.clone() }, "contact.speed");
    job(SteadyProblem { friction: FrictionLaw::Constant(f64::NAN).into(), ..good.clone() }, "contact.friction");
    job(SteadyProblem { loads: NormalLoad::Force(-1.0).into(), ..good.clone() }, "contact.normal_load");
    let turning = PatchKinematics::one(rolling.speed, ContactCreepage { spin: f64::INFINITY, ..rolling.creepage });
    job(SteadyProblem { kinematics: turning, ..good.clone() }, "spin");
    // Four times the load needs a patch 1.59 times as large.
    match fails(SteadyProblem { loads: NormalLoad::Force(280e3).into(), ..good.clone() }) {
        Some(Error::Job(m)) => {
            assert!(m.contains("contact.patch.half_length") && m.contains("contact.patch.half_width"), "{m}");
            let told = m.split("needs about half_length ").nth(1).unwrap().split(' ').next().unwrap();
            let told: f64 = told.parse().unwrap();
            let need = pair.a * 4f64.cbrt();
            assert!(told > need && told < 1.4 * need, "told {told}, contact radius {need}");
        }
        other => panic!("{other:?}"),
    }
    match fails(SteadyProblem { max_iterations: 1, ..good.clone() }) {
        Some(Error::NotConverged(m)) => assert!(m.contains("residuals"), "{m}"),
        other => panic!("{other:?}"),
    }
    // Not a compliance.
    let n = pair.w.nrows();
    let zero = Mat::<f64>::zeros(n, n);
    assert!(matches!(fails(SteadyProblem { compliance: zero.as_ref().into(), ..good.clone() }), Some(Error::Input(_))));
}

/// A curve gone through point by point, up from rest, down again and with a jump, has at every point the solution that
/// there is from nothing. The rolling of `problem` with the lateral creepage `eta`.
fn lateral(problem: &SteadyProblem<'_>, eta: f64) -> Vec<PatchKinematics> {
    let PatchKinematics { speed, creepage } = problem.kinematics[0];
    PatchKinematics::one(speed, ContactCreepage { lateral: eta, ..creepage })
}

#[test]
fn a_curve_by_continuation_is_made_of_single_solutions() {
    let c = Pair::new(STEEL, SOFT, 70e3, 8);
    for law in [FrictionLaw::Constant(0.3), Exponential::new(0.4, 0.25, 0.1).into()] {
        let problem = SteadyProblem { friction: law.clone().into(), tolerance: 1e-10, ..c.problem(0.0005, 0.0, 0.1) };
        let mut curve = Continuation::new(problem.clone());
        let up = (0..=24).map(|i| 0.0005 * f64::from(i));
        for eta in up.chain([0.011, 0.007, 0.0069, -0.003, -0.004]) {
            let kinematics = lateral(&problem, eta);
            let found = curve.solve(kinematics.clone()).unwrap();
            let alone = SteadyProblem { kinematics, ..problem.clone() }.solve().unwrap();
            assert_eq!(found.state, alone.state, "{law} at {eta}");
            assert!(found.residual <= 1e-10);
            let peak = alone.pressure.iter().copied().fold(0.0, f64::max);
            let apart = largest_difference(&found.traction, |i| alone.traction[i]);
            assert!(apart < 1e-8 * peak, "{law} at {eta}: tractions differ by {apart:e} of {peak:e}");
            assert!((found.motions[0] - alone.motions[0]).abs() < 1e-9 * alone.motions[0]);
        }
    }
}

/// Points accepted at the residual that a curve has by default have their forces to 1e-6 of the load, whichever way
/// the curve is gone.
#[test]
fn a_curve_at_its_own_residual_has_the_forces() {
    let c = Pair::new(STEEL, SOFT, 70e3, 8);
    for law in [FrictionLaw::Constant(0.3), Exponential::new(0.4, 0.25, 0.1).into()] {
        let exact = SteadyProblem { friction: law.clone().into(), tolerance: 1e-11, ..c.problem(0.0005, 0.0, 0.1) };
        let mut curve = Continuation::new(SteadyProblem { tolerance: 1e-6, ..exact.clone() });
        let mut most = 0.0f64;
        for eta in (0..=30).chain((0..30).rev()).map(|i| 0.0004 * f64::from(i)) {
            let kinematics = lateral(&exact, eta);
            let found = curve.solve(kinematics.clone()).unwrap();
            let alone = SteadyProblem { kinematics, ..exact.clone() }.solve().unwrap();
            let off = (0..3).map(|k| (found.force[k] - alone.force[k]).abs()).fold(0.0, f64::max);
            most = most.max(off / 70e3);
        }
        assert!(most < 1e-6, "{law}: {most:e} of the load");
    }
}

/// Compliance of a pair of half-spaces, by offsets.
fn convolution(s: &Interface, lower: HalfSpace, upper: HalfSpace) -> Convolution {
    let [lower, upper] =
        [lower, upper].map(|m| Convolution::of_half_space(&m, &s.patches[0].x, &s.patches[0].y).unwrap().unwrap());
    Convolution::combined(&lower, &upper).unwrap()
}

/// Half-spaces, and bodies that yield and turn as wholes by about as much, as matrices and as convolutions.
#[test]
fn a_convolution_has_the_solution_of_its_matrix() {
    let pair = Pair::new(STEEL, SOFT, 70e3, 7);
    let s = &pair.interface;
    let pi = Mat::from_fn(3 * s.len(), 9, |row, k| {
        let [x, y] = s.point(row / 3);
        if k % 3 == row % 3 {
            [1.0, x, y][k / 3]
        } else {
            0.0
        }
    });
    let whole = Mat::from_fn(9, 9, |i, j| {
        let size = [2e-9f64, 3e-8, 3e-8];
        (if i == j { 1.0 } else { 0.2 }) * (size[i / 3] * size[j / 3]).sqrt()
    });
    let hybrid = &pair.w + &pi * whole * pi.transpose();
    for (w, c) in [
        (&pair.w, convolution(s, STEEL, SOFT)),
        (&hybrid, Convolution::found_in(hybrid.as_ref(), &s.patches[0].x, &s.patches[0].y).unwrap()),
    ] {
        for (xi, eta, phi) in [(0.0, 0.0, 0.0), (0.001, -0.002, 0.3), (-0.004, 0.004, -0.2), (0.0, 0.0005, 0.8)] {
            for load in [NormalLoad::Force(70e3), NormalLoad::Approach(9e-5)] {
                let of = |w| SteadyProblem {
                    compliance: w,
                    loads: load.into(),
                    tolerance: 1e-12,
                    ..pair.problem(xi, eta, phi)
                };
                let [a, b] = [of(w.as_ref().into()), of((&c).into())].map(|p| p.solve().unwrap());
                let peak = a.pressure.iter().copied().fold(0.0, f64::max);
                let off = |x: f64, y: f64| (x - y).abs() / peak;
                let worst = (0..s.len())
                    .map(|i| {
                        let [x, y] = [0, 1].map(|k| off(a.traction[i][k], b.traction[i][k]));
                        off(a.pressure[i], b.pressure[i]).max(x).max(y)
                    })
                    .fold(0.0, f64::max);
                assert!(worst < 1e-10, "{xi} {eta} {phi} {load:?}: stresses differ by {worst:e}");
                assert_eq!(a.state, b.state, "{xi} {eta} {phi} {load:?}");
                near(b.motions[0], a.motions[0], 1e-10, "approach");
                near(b.force[2], a.force[2], 1e-10, "normal force");
                let [x, y] = [0, 1].map(|k| (a.force[k] - b.force[k]).abs() / a.force[2].abs());
                assert!(x.max(y) < 1e-10, "{xi} {eta} {phi} {load:?}: forces differ by {x:e} {y:e}");
            }
        }
    }
}

/// Some 3 300 nodes in contact, from coarser grids: a matrix would take 1.6 GB.
#[test]
fn many_nodes_need_no_matrix() {
    let (load, k) = (70e3, 33);
    let a = 4.884e-3;
    let half = a * (k + 2) as f64 / k as f64;
    let s = Interface::paraboloid(2 * k + 5, 2 * k + 5, [half, half], [4.0, 4.0]).unwrap();
    let c = convolution(&s, STEEL, STEEL);
    let problem = |eta: f64, phi: f64| SteadyProblem {
        interface: &s,
        compliance: (&c).into(),
        friction: FrictionLaw::Constant(MU).into(),
        kinematics: PatchKinematics::one(10.0, ContactCreepage { longitudinal: 0.0, lateral: eta, spin: phi }),
        loads: NormalLoad::Force(load).into(),
        stencil: Stencil::default(),
        tolerance: 1e-8,
        max_iterations: 200,
    };
    for (eta, want) in [(0.003, -0.7177), (0.001, -0.3005), (0.005, -0.9304)] {
        let found = problem(eta, 0.0).solve().unwrap();
        assert!(found.residual <= 1e-8 && found.state.iter().filter(|&&v| v > 0).count() > 3000);
        near(found.force[1] / (MU * load), want, 0.002, "F_y/muN");
    }
    // With spin it has neither symmetry.
    assert!(problem(0.001, 0.5).solve().unwrap().residual <= 1e-8);
}
