//! Steps on one or two contacts, whose answers are known in closed form.

use super::loading::Normal;
use super::*;
use crate::contact::law::Status;
use crate::friction::{Exponential, FrictionLaw};
use crate::grid::Interface;
use crate::model::ModalMatrix;
use faer::Mat;

/// Compliance of every node along x, y and n, m/N.
const SOFT: f64 = 1e-6;
const H: f64 = 1e-3;

/// Five by five nodes half a metre apart, far from contact but for those of `near`, (node, gap in m). Node 8 lies at
/// (0.5, −0.5).
fn grid(near: &[(usize, f64)]) -> Interface {
    let x: Vec<f64> = (0..5).map(|i| 0.5 * (f64::from(i) - 2.0)).collect();
    let mut gap = vec![1.0; 25];
    near.iter().for_each(|&(i, g)| gap[i] = g);
    Interface::new(x.clone(), x, gap).unwrap()
}

/// Independent springs at the nodes.
fn springs() -> Mat<f64> {
    Mat::from_fn(75, 75, |i, j| if i == j { SOFT } else { 0.0 })
}

fn none() -> Mat<f64> {
    Mat::zeros(75, 0)
}

/// A model with the given modes, without damping and loads.
fn model<'a>(interface: &'a Interface, residual: &'a Mat<f64>, modes: &'a Mat<f64>, omega: &'a [f64]) -> Model<'a> {
    let residual = residual.as_ref();
    let (stiffness, damping) = (ModalMatrix::squares(omega), vec![0.0; omega.len()].into());
    Model {
        interface,
        residual,
        modes: modes.as_ref(),
        omega,
        stiffness,
        damping,
        turning: None,
        carried: None,
        load: &[],
    }
}

/// A history that goes from `begin` to `end` in ten steps.
fn straight(begin: f64, end: f64) -> History {
    History::table("straight", &[[0.0, begin], [10.0 * H, end]], 10.0 * H).unwrap()
}

fn settings(drive: Loading, mu: f64) -> Settings {
    Settings {
        scheme: Scheme { step: H, theta: 0.5 },
        friction: FrictionLaw::Constant(mu).into(),
        solver: ContactSolver::Newton,
        tolerance: 1e-12,
        drive,
    }
}

/// Nothing prescribed but the approach.
fn still(approach: History) -> Loading {
    let zero = || History::constant(0.0);
    let tangential = [Tangential::Creep(zero()), Tangential::Creep(zero())];
    Loading::of_patch(Normal::Approach(approach), PatchDrive { tangential, spin: zero(), speed: 0.0 })
}

/// The same under a load.
fn loaded(load: History) -> Loading {
    let mut still = still(History::constant(0.0));
    still.motions[0].normal = Normal::Force(load);
    still
}

/// The reactions with the pressure `p` (N) at `node` alone.
fn pressed(node: usize, p: f64) -> Vec<f64> {
    (0..75).map(|k| if k == 3 * node + 2 { p } else { 0.0 }).collect()
}

#[track_caller]
fn near(got: f64, want: f64, what: &str) {
    assert!((got - want).abs() <= 1e-9 * want.abs() + 1e-13, "{what}: {got:.12e}, expected {want:.12e}");
}

/// One node under growing approach, creep and spin: it slips where friction cannot hold it, and sticks where it can.
/// Forces, fields, counts and all parts of the energy.
#[test]
fn a_single_node_slips_and_sticks() {
    let (s, w, no) = (grid(&[(8, 0.0)]), springs(), none());
    let [x, y] = s.point(8);
    assert_eq!([x, y], [0.5, -0.5]);
    let mu = 0.3;
    for (faster, sticks) in [(1.0, false), (1e-3, true)] {
        let approach = straight(1e-3, 3e-3);
        // At the middle of the first step, a twentieth of the way.
        let creep = [faster * 2.0, faster * -1.05];
        let spin = faster * 0.4;
        let tangential = [
            Tangential::Creep(straight(creep[0] - 0.1, creep[0] + 1.9)),
            Tangential::Creep(straight(creep[1] + 0.05, creep[1] - 0.95)),
        ];
        let patch = PatchDrive { tangential, spin: straight(spin - 0.02, spin + 0.38), speed: 0.0 };
        let drive = Loading::of_patch(Normal::Approach(approach), patch);
        let start = State::at_rest(&model(&s, &w, &no, &[]), &pressed(8, 1e-3 / SOFT), &[1e-3]);
        let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings(drive, mu), start).unwrap();
        stepper.advance().unwrap();

        let (before, p) = (1e-3 / SOFT, 1.2e-3 / SOFT);
        let rigid = [creep[0] - spin * y, creep[1] + spin * x];
        let size = rigid[0].hypot(rigid[1]);
        let force = if sticks { H * size / SOFT } else { mu * p };
        assert_eq!(force < mu * p, sticks);
        let t = rigid.map(|c| -force * c / size);
        let slip = [0, 1].map(|c| H * rigid[c] + SOFT * t[c]);
        let report = stepper.report();
        for (c, want) in [t[0], t[1], -p].into_iter().enumerate() {
            near(report.force()[c], want, "force");
        }
        near(report.patches[0].moment_z, x * t[1] - y * t[0], "moment");
        assert_eq!((report.closed(), report.stick()), (1, usize::from(sticks)));
        let fields = stepper.fields();
        assert_eq!(s.weight[8], 0.25);
        near(fields.pressure[8], p / 0.25, "pressure");
        for c in 0..2 {
            near(fields.traction[8][c], t[c] / 0.25, "traction");
            near(fields.creep[8][c], slip[c] / H, "creep");
        }
        assert_eq!((fields.state[8], fields.state[7]), (if sticks { 1 } else { 2 }, 0));
        let e = stepper.state().energy;
        near(e.start, 0.5 * SOFT * before * before, "energy of the start");
        near(e.elastic, 0.5 * SOFT * (p * p + force * force), "elastic energy");
        near(e.friction, -0.5 * (t[0] * slip[0] + t[1] * slip[1]), "friction");
        let turned = -0.5 * H * (t[0] * rigid[0] + t[1] * rigid[1]);
        near(e.drive, turned + 0.5 * (before + p) * 0.2e-3, "drive");
        assert!(e.residual().abs() < 1e-9 * e.drive, "balance {:e}", e.residual());
    }
}

/// Reported values of the nodes follow from their stresses and creep at every step, also where most of them have just
/// come off each other and the working set has shrunk.
#[test]
fn status_and_creep_belong_to_the_stresses_at_every_step() {
    let line = || (0..7).map(f64::from).collect::<Vec<f64>>();
    // Independent springs: a node is closed where the approach is beyond its gap.
    let gap = |i: usize| 1e-5 * (i % 7).abs_diff(3).max((i / 7).abs_diff(3)) as f64;
    let s = Interface::new(line(), line(), (0..49).map(gap).collect()).unwrap();
    let w = Mat::from_fn(147, 147, |i, j| if i == j { SOFT } else { 0.0 });
    let no = Mat::zeros(147, 0);
    let mu = 0.3;
    let tangential = [Tangential::Creep(straight(1e-4, 1e-4)), Tangential::Creep(straight(-5e-5, -5e-5))];
    let points = [[0.0, 2.5e-5], [4.0 * H, 2.5e-5], [5.0 * H, 0.4e-5], [10.0 * H, 0.4e-5]];
    let approach = History::table("falling", &points, 10.0 * H).unwrap();
    let patch = PatchDrive { tangential, spin: straight(4e-4, 4e-4), speed: 0.0 };
    let drive = Loading::of_patch(Normal::Approach(approach), patch);
    let start = State::at_rest(&model(&s, &w, &no, &[]), &[0.0; 147], &[0.0]);
    let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings(drive, mu), start).unwrap();
    let mut seen = Vec::new();
    for step in 1..=8 {
        stepper.advance().unwrap();
        let fields = stepper.fields();
        for i in 0..49 {
            let (p, t, creep) = (fields.pressure[i], fields.traction[i], fields.creep[i]);
            let (t, v) = (t[0].hypot(t[1]), creep[0].hypot(creep[1]));
            let want = match (p > 0.0, v > 1e-9) {
                (false, _) => 0,
                (true, false) => 1,
                (true, true) => 2,
            };
            assert_eq!(fields.state[i], want, "step {step}, node {i}: {p} Pa, {t} Pa, {v} m/s");
            let bound = mu * p;
            match want {
                2 => assert!((t - bound).abs() < 1e-9 * bound, "step {step}, node {i}: {t} of {bound} Pa"),
                _ => assert!(t <= bound, "step {step}, node {i}: {t} of {bound} Pa"),
            }
        }
        seen.push([1, 2].map(|state| fields.state.iter().filter(|s| **s == state).count()));
    }
    assert!(seen[0][0] > 0 && seen[0][1] > 0 && seen[0][0] + seen[0][1] == 25, "{seen:?}");
    assert!(seen[4][0] + seen[4][1] == 1, "{seen:?}");
}

/// Load and tangential force given: what they are at the end of the step; the approach and the creep follow.
#[test]
fn prescribed_forces_are_there_at_the_end_of_the_step() {
    let (s, w, no) = (grid(&[(8, 0.0)]), springs(), none());
    let tangential = [Tangential::Force(straight(0.0, 500.0)), Tangential::Creep(History::constant(0.0))];
    let patch = PatchDrive { tangential, spin: History::constant(0.0), speed: 0.0 };
    let drive = Loading::of_patch(Normal::Force(straight(1e3, 2e3)), patch);
    let start = State::at_rest(&model(&s, &w, &no, &[]), &pressed(8, 1e3), &[1e3 * SOFT]);
    let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings(drive, 0.3), start.clone()).unwrap();
    for step in 1..=3 {
        stepper.advance().unwrap();
        let (f, state) = (stepper.report().force(), stepper.state());
        let (along, normal) = (50.0 * f64::from(step), 1e3 + 100.0 * f64::from(step));
        near(f[0], along, "tangential force");
        near(f[2], -normal, "load");
        near(state.motions[0], SOFT * normal, "approach");
        near(state.creep[0], -SOFT * 50.0 / H, "creep");
        assert_eq!((stepper.report().stick(), state.creep[1]), (1, 0.0));
    }
    let pulled = loaded(History::constant(-1.0));
    let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings(pulled, 0.3), start).unwrap();
    let error = stepper.advance().unwrap_err();
    assert!(error.exit_code() == 2 && error.message().contains("only press"), "{error}");
}

/// Under a prescribed load the contact grows by the nodes that the approach brings near.
#[test]
fn a_growing_load_closes_more_nodes() {
    let (s, w, no) = (grid(&[(8, 0.0), (16, 0.5e-3)]), springs(), none());
    let drive = loaded(straight(100.0, 1100.0));
    let start = State::at_rest(&model(&s, &w, &no, &[]), &pressed(8, 100.0), &[100.0 * SOFT]);
    let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings(drive, 0.3), start).unwrap();
    (0..9).for_each(|_| stepper.advance().unwrap());
    let state = stepper.state();
    near(state.reaction[3 * 8 + 2], 750.0, "pressure where it began");
    near(state.reaction[3 * 16 + 2], 250.0, "pressure of the second node");
    near(state.motions[0], 750.0 * SOFT, "approach");
}

/// A load that goes to zero and comes back rests on the nodes nearest to each other again; and so does one at a start
/// without contact.
#[test]
fn a_load_that_comes_back_is_carried_again() {
    let (s, w, no) = (grid(&[(8, 0.0), (16, 0.5e-3)]), springs(), none());
    let points = [[0.0, 100.0], [3.0 * H, 0.0], [6.0 * H, 0.0], [10.0 * H, 1000.0]];
    let load = History::table("load", &points, 10.0 * H).unwrap();
    for start in [(100.0, 100.0 * SOFT), (0.0, -1e-2)] {
        let drive = loaded(load.clone());
        let state = State::at_rest(&model(&s, &w, &no, &[]), &pressed(8, start.0), &[start.1]);
        let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings(drive, 0.3), state).unwrap();
        for step in 1..=10 {
            stepper.advance().unwrap();
            let force = -stepper.report().force()[2];
            near(force, load.value(f64::from(step) * H), &format!("force in step {step}"));
        }
        near(stepper.state().reaction[3 * 16 + 2], 250.0, "pressure of the second node");
        near(stepper.state().motions[0], 750.0 * SOFT, "approach");
    }
}

/// The reactions at a perturbed start are those of its displacements, and it stays where it is in time, at its place
/// and speed.
#[test]
fn settling_finds_the_reactions_and_moves_nothing() {
    let (s, w) = (grid(&[(12, 0.0)]), springs());
    let modes = Mat::from_fn(75, 1, |i, _| if i == 3 * 12 + 2 { 1.0 } else { 0.0 });
    let m = model(&s, &w, &modes, &[500.0]);
    let mut start = State::at_rest(&m, &[0.0; 75], &[0.0]);
    (start.q[0], start.v[0], start.step) = (-1e-3, 0.2, 7);
    let mut settings = settings(still(History::constant(0.0)), 0.3);
    settings.scheme.step = 1e-7;
    let mut stepper = Stepper::new(m, settings, start).unwrap();
    stepper.settle().unwrap();
    let state = stepper.state();
    assert_eq!((state.q[0], state.v[0], state.step), (-1e-3, 0.2, 7));
    let p = state.reaction[3 * 12 + 2];
    assert!((p / 1e3 - 1.0).abs() < 1e-3, "{p} N");
    let e = state.energy;
    near(e.kinetic, 0.02, "kinetic energy");
    assert!((e.start - 0.02 - 0.125 - 0.5).abs() < 1e-3 && e.start == e.kinetic + e.elastic, "{e:?}");
    near(e.friction + e.damping + e.impact + e.drive, 0.0, "works before the start");
}

/// The reactions of a start that moves fast are a step ahead of its displacements, by p v h of energy: the balance
/// does not count it, in the first step or later.
#[test]
fn balance_does_not_count_the_start() {
    let (s, w) = (grid(&[(12, 0.0)]), springs());
    let modes = Mat::from_fn(75, 1, |i, _| if i == 3 * 12 + 2 { 1.0 } else { 0.0 });
    let m = model(&s, &w, &modes, &[500.0]);
    let mut start = State::at_rest(&m, &[0.0; 75], &[0.0]);
    (start.q[0], start.v[0]) = (-1e-3, 0.2);
    let mut settings = settings(still(History::constant(0.0)), 0.3);
    settings.scheme.step = 1e-5;
    let mut stepper = Stepper::new(m, settings, start).unwrap();
    stepper.settle().unwrap();
    let stored = stepper.state().energy.start;
    stepper.advance().unwrap();
    let e = stepper.state().energy;
    // It was 1 kN of 0.2 m/s over 10 µs.
    assert!(((e.start - stored).abs() / 2e-3 - 1.0).abs() < 0.05, "{stored} J became {} J", e.start);
    for _ in 0..50 {
        stepper.advance().unwrap();
        assert_eq!(stepper.report().closed(), 1);
        let e = stepper.state().energy;
        assert!(e.residual().abs() < 1e-12 && e.kinetic > 0.0, "{e:?}");
    }
}

/// Extrapolated or iterated, the response that is kept is W R: after many steps the laws hold with a product made anew.
#[test]
fn the_laws_hold_with_a_fresh_product_after_many_steps() {
    let s = Interface::paraboloid(11, 11, [6e-3; 2], [4.0; 2]).unwrap();
    let steel = crate::body::half_space::HalfSpace { young: 205e9, poisson: 0.3 };
    let c = steel.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let w = crate::model::combined_compliance(c.as_ref(), c.as_ref()).unwrap();
    let no = Mat::<f64>::zeros(3 * s.len(), 0);
    let falling = Exponential::new(0.35, 0.25, 0.3).into();
    for friction in [FrictionLaw::Constant(0.3), falling] {
        let creep = Tangential::Creep(History::constant(0.05));
        let tangential = [Tangential::Creep(History::constant(0.01)), creep];
        let patch = PatchDrive { tangential, spin: History::constant(0.0), speed: 10.0 };
        let drive = Loading::of_patch(Normal::Approach(History::constant(6e-5)), patch);
        let model = model(&s, &w, &no, &[]);
        let (n, h, tolerance) = (s.len(), 2e-5, 1e-9);
        let settings = Settings {
            scheme: Scheme { step: h, theta: 0.5 },
            friction: friction.clone().into(),
            solver: ContactSolver::Newton,
            tolerance,
            drive,
        };
        let start = State::at_rest(&model, &vec![0.0; 3 * n], &[6e-5]);
        let mut stepper = Stepper::new(model, settings, start).unwrap();
        for step in 1..=600 {
            stepper.advance().unwrap();
            let Some(posed) = stepper.problem_view().filter(|_| step % 20 == 0) else { continue };
            let k = 3 * posed.nodes.len();
            let (matrix, free, before) = (posed.matrix, posed.free, posed.before);
            let problem = StepProblem {
                matrix,
                free,
                friction: &friction.clone().into(),
                before,
                step: h,
                patch: &[],
                borders: &[],
                tolerance,
            };
            let mut u = vec![0.0; k];
            let all = &stepper.state().reaction;
            let reaction: Vec<f64> = posed.nodes.iter().flat_map(|i| all[3 * i..3 * i + 3].iter().copied()).collect();
            matrix.times(&reaction, &mut u);
            let u = problem.displacement(&u, &[]);
            let (residual, status) = problem.residual(&reaction, &u);
            let normal = -stepper.report().force()[2];
            assert!(residual < 1.2 * tolerance * normal, "{friction:?}, step {step}: {residual:e} N of {normal} N");
            assert!(status.contains(&Status::Slip) && normal > 1e3, "{status:?}");
        }
    }
}

/// The rolling moment works against the pressure on a slope: −V ∫ p ∂x g0 over time.
#[test]
fn rolling_over_a_slope() {
    let (s, w, no) = (grid(&[(11, 0.3), (12, 0.0), (13, 0.8)]), springs(), none());
    let mut drive = still(History::constant(1e-3));
    drive.patches[0].speed = 10.0;
    let start = State::at_rest(&model(&s, &w, &no, &[]), &pressed(12, 1e-3 / SOFT), &[1e-3]);
    let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings(drive, 0.0), start).unwrap();
    stepper.advance().unwrap();
    stepper.advance().unwrap();
    near(stepper.state().energy.rolling, -1e3 * 10.0 * 2.0 * H * 0.5, "work of the rolling moment");
}

/// Contact at the border of the patch is outside the model.
#[test]
fn contact_at_the_border_is_refused() {
    let (s, w, no) = (grid(&[(12, 0.0), (14, 0.9e-3)]), springs(), none());
    let start = State::at_rest(&model(&s, &w, &no, &[]), &pressed(12, 0.5e-3 / SOFT), &[0.5e-3]);
    let settings = settings(still(straight(0.5e-3, 1.5e-3)), 0.3);
    let mut stepper = Stepper::new(model(&s, &w, &no, &[]), settings, start).unwrap();
    let error = (0..10).find_map(|_| stepper.advance().err()).expect("the border");
    assert!(error.exit_code() == 2 && error.message().contains("border of the patch"), "{error}");
    assert!(stepper.state().motions[0] < 0.9e-3 + 1e-12, "{}", stepper.state().motions[0]);
}

/// Nodes that are not looked at come near by the motion of a mode, whatever its sign, and by reactions elsewhere.
#[test]
fn distant_nodes_are_noticed_when_they_touch() {
    let short = || {
        let settings = settings(still(History::constant(0.0)), 0.3);
        Settings { scheme: Scheme { step: 0.1 * H, theta: 0.5 }, ..settings }
    };
    // A mass on node 18 that moves against its normal, thrown over a millimetre.
    let (s, w) = (grid(&[(18, 1e-3)]), springs());
    for sign in [1.0, -1.0] {
        let modes = Mat::from_fn(75, 1, |i, _| if i == 3 * 18 + 2 { sign } else { 0.0 });
        let m = model(&s, &w, &modes, &[0.0]);
        let mut start = State::at_rest(&m, &[0.0; 75], &[0.0]);
        start.v[0] = -sign;
        let mut stepper = Stepper::new(m, short(), start).unwrap();
        (0..12).for_each(|_| stepper.advance().unwrap());
        assert!(stepper.report().force()[2] < -100.0, "sign {sign}: force {:?} N", stepper.report().force());
    }
    // A mass thrown on node 6, whose pressure bends node 18 towards the other body.
    let (s, g) = (grid(&[(6, 0.0), (18, 0.25e-3)]), 0.25e-3);
    let bent = |i: usize, j: usize| (i == 20 && j == 56) || (i == 56 && j == 20);
    let w = Mat::from_fn(75, 75, |i, j| if bent(i, j) { -0.5 * SOFT } else { springs()[(i, j)] });
    let modes = Mat::from_fn(75, 1, |i, _| if i == 20 { 1.0 } else { 0.0 });
    let m = model(&s, &w, &modes, &[0.0]);
    let mut start = State::at_rest(&m, &[0.0; 75], &[0.0]);
    start.v[0] = -1.0;
    let mut stepper = Stepper::new(m, short(), start).unwrap();
    // About a quarter of the period 2π √(SOFT · 1 kg).
    (0..15).for_each(|_| stepper.advance().unwrap());
    let [p, q] = [6, 18].map(|i| stepper.state().reaction[3 * i + 2]);
    assert!(p > 550.0 && q > 10.0, "{p} N and {q} N");
    near(g - 0.5 * SOFT * p + SOFT * q, 0.0, "gap of the second node");
}

/// A rigid plane meets a rigid mass at rest and takes it along: half of what the drive does is lost.
#[test]
fn a_moving_plane_takes_a_mass_along() {
    let s = grid(&[(12, 0.5e-3)]);
    let w = Mat::<f64>::zeros(75, 75);
    let modes = Mat::from_fn(75, 1, |i, _| if i == 3 * 12 + 2 { 1.0 } else { 0.0 });
    let m = model(&s, &w, &modes, &[0.0]);
    let speed = 2.0;
    let start = State::at_rest(&m, &[0.0; 75], &[0.0]);
    let settings = settings(still(straight(0.0, 10.0 * H * speed)), 0.3);
    let mut stepper = Stepper::new(m, settings, start).unwrap();
    (0..5).for_each(|_| stepper.advance().unwrap());
    let state = stepper.state();
    near(state.v[0], speed, "velocity");
    near(state.energy.kinetic, 0.5 * speed * speed, "kinetic energy");
    near(state.energy.drive, speed * speed, "drive");
    near(state.energy.impact, 0.5 * speed * speed, "impact");
    assert!(state.energy.residual().abs() < 1e-9, "balance {:e}", state.energy.residual());
}

/// A free mass with damping: what damping takes is what the kinetic energy loses, for any θ.
#[test]
fn damping_takes_what_a_free_mass_loses() {
    let (s, w) = (grid(&[]), springs());
    let modes = Mat::zeros(75, 1);
    for theta in [0.5, 0.8, 1.0] {
        let m = Model { damping: vec![100.0].into(), ..model(&s, &w, &modes, &[0.0]) };
        let mut start = State::at_rest(&m, &[0.0; 75], &[0.0]);
        start.v[0] = 2.0;
        let mut settings = settings(still(History::constant(0.0)), 0.3);
        settings.scheme.theta = theta;
        let mut stepper = Stepper::new(m, settings, start).unwrap();
        (0..10).for_each(|_| stepper.advance().unwrap());
        let (e, v) = (stepper.state().energy, stepper.state().v[0]);
        let factor = (1.0 - 0.1 * (1.0 - theta)) / (1.0 + 0.1 * theta);
        near(v, 2.0 * factor.powi(10), "velocity");
        near(e.damping, 2.0 - 0.5 * v * v, "energy that damping takes");
    }
}

/// With θ > ½ force and velocity of a step are weighed alike: the work of the contact on the mode and what damping
/// takes add up with what the scheme itself takes, which is known for a spring that stays closed.
#[test]
fn a_mass_on_a_contact_is_damped_by_the_scheme_as_by_a_spring() {
    let s = grid(&[(12, 0.0)]);
    let w = springs();
    // 1000 rad/s on the compliance of the contact alone, pressed so far that it stays closed.
    let modes = Mat::from_fn(75, 1, |i, _| if i == 3 * 12 + 2 { 1.0 } else { 0.0 });
    for theta in [0.5, 0.6, 0.8] {
        let load = [-1e3];
        let m = Model { load: &load, ..model(&s, &w, &modes, &[0.0]) };
        let mut start = State::at_rest(&m, &pressed(12, 1e3), &[1e3 * SOFT]);
        start.v[0] = 0.1;
        let mut settings = settings(still(History::constant(1e3 * SOFT)), 0.3);
        settings.scheme = Scheme { step: 2e-5, theta };
        let own = settings.scheme.own_damping(1000.0);
        let mut stepper = Stepper::new(m, settings, start).unwrap();
        // Energy of the vibration about rest.
        let vibration = |s: &State| 0.5 * s.v[0] * s.v[0] + 0.5 * 1e6 * s.q[0] * s.q[0];
        let begun = vibration(stepper.state());
        let steps = 2000;
        (0..steps).for_each(|_| stepper.advance().unwrap());
        let decay = -0.5 * (vibration(stepper.state()) / begun).ln() / (f64::from(steps) * 2e-5);
        assert!((decay - own).abs() < 0.01 * own + 1e-6, "θ = {theta}: decay {decay}, expected {own}");
        let e = stepper.state().energy;
        // What the scheme takes shows as the balance: nothing else takes anything here.
        let lost = begun - vibration(stepper.state());
        assert!((e.residual() + lost).abs() < 1e-3 * begun, "θ = {theta}: balance {:e}, lost {lost:e}", e.residual());
    }
}
