//! A wheel that turns under the contact: a pair of waves in a frame that stands, against the same in a frame that
//! turns with the wheel, against the linear analysis, and its balance of energy.

use super::*;
use faer::linalg::solvers::Solve;
use railsqueal::model::{turning, ModalRotation};
use railsqueal::transient::scheme::Modal;
use railsqueal::transient::{DelassusOperator, Dynamics, Effort, NewtonMemory, StepProblem};

/// Angular velocity, rad/s.
const SPEED: f64 = 60.0;
/// Nodal diameters of the pair, and g of its gyroscopic coupling 2gΩ.
const N: f64 = 2.0;
const G: f64 = 1.93;
/// Ratio of the stiffness by prestress and convection to Ω².
const KAPPA: f64 = 1.4;
/// Frequencies of a mode by itself and of the pair, Hz.
const FREQUENCY: [f64; 3] = [430.0, 506.0, 506.0];
const DAMPING: f64 = 6.0;

/// Motion of the contact by the modes: of the pair the cosine moves it across and in depth, the sine along.
const SHAPE: [[f64; 3]; 3] = [[0.0, 0.02, 0.08], [0.0, 0.07, -0.03], [0.06, 0.0, 0.0]];

/// A skew matrix that couples the pair.
fn coupled(value: f64) -> Mat<f64> {
    Mat::from_fn(3, 3, |i, j| match (i, j) {
        (1, 2) => -value,
        (2, 1) => value,
        _ => 0.0,
    })
}

fn wheel(nodes: usize, speed: f64) -> Squeal {
    damped(nodes, speed, [DAMPING; 3])
}

/// The same with the damping of each mode by itself, 1/s.
fn damped(nodes: usize, speed: f64, damping: [f64; 3]) -> Squeal {
    let squeal = Squeal::new(nodes, DAMPING);
    let n = squeal.interface.len();
    let steel = HalfSpace { young: 205e9, poisson: 0.3 };
    let local = steel.compliance(&squeal.interface.patches[0].x, &squeal.interface.patches[0].y).unwrap();
    let omega: Vec<f64> = FREQUENCY.iter().map(|f| 2.0 * PI * f).collect();
    let contact_modes = Mat::from_fn(3 * n, 3, |i, k| SHAPE[k][i % 3]);
    let modal = |i: usize, j: usize| {
        (0..3).map(|k| contact_modes[(i, k)] * contact_modes[(j, k)] / omega[k].powi(2)).sum::<f64>()
    };
    let compliance = Mat::from_fn(3 * n, 3 * n, |i, j| local[(i, j)] + modal(i, j));
    let rest = ReducedBody::new(omega, damping.to_vec(), contact_modes, compliance);
    let rotation = ModalRotation {
        gyroscopic: coupled(2.0 * G),
        stiffness: Mat::from_fn(3, 3, |i, j| if i == j && i > 0 { KAPPA } else { 0.0 }),
        derivative: coupled(N),
    };
    let lower = turning(rest, &rotation, &[speed; 3]);
    let upper = ReducedBody::new(vec![], vec![], Mat::zeros(3 * n, 0), local);
    Squeal { pair: CoupledModel::new(&lower, &upper).unwrap(), ..squeal }
}

/// Rubbed without rolling, as in [`rubbed`], from rest under a given approach.
fn settings_of(squeal: &Squeal, step: f64, approach: f64) -> Settings {
    let load = NormalLoad::Approach(approach);
    let mut settings = squeal.settings(ContactCreepage::default(), load, step, ContactSolver::Newton);
    settings.drive.patches[0].speed = 0.0;
    settings.drive.patches[0].tangential[1] = Tangential::Creep(History::constant(0.05));
    settings
}

fn pressed(squeal: &Squeal) -> (State, f64) {
    let friction = FrictionLaw::Constant(0.0);
    let pressed =
        SteadyProblem { friction: friction.into(), ..squeal.steady(ContactCreepage::default()) }.solve().unwrap();
    (squeal.rest(&pressed.pressure, &pressed.traction, pressed.motions[0]), pressed.motions[0])
}

/// Modal displacements in the frame that turns with the wheel, a(t) with q = e^{−JnΩt} a of the pair: there the modes
/// of the contact turn instead, Coriolis's term is 2Ω(g − n)J, and damping acts on the velocity alone. The θ-method
/// with θ = ½, contact by contact.
fn in_the_turning_frame(squeal: &Squeal, start: &State, step: f64, steps: usize, approach: f64) -> Vec<f64> {
    let interface = &squeal.interface;
    let n = interface.len();
    let square = |k: usize| {
        let own = (2.0 * PI * FREQUENCY[k]).powi(2);
        own + if k > 0 { (KAPPA - N * N + 2.0 * G * N) * SPEED * SPEED } else { 0.0 }
    };
    let damping = Mat::from_fn(3, 3, |i, j| if i == j { DAMPING } else { 0.0 }) + coupled(2.0 * SPEED * (G - N));
    let half = 0.5 * step;
    let matrix = Mat::from_fn(3, 3, |i, j| {
        let own = if i == j { 1.0 + half * half * square(i) } else { 0.0 };
        own + half * damping[(i, j)]
    });
    let inverse = matrix.partial_piv_lu();
    let solved = |x: [f64; 3]| -> [f64; 3] {
        let x = inverse.solve(Mat::from_fn(3, 1, |i, _| x[i]));
        [0, 1, 2].map(|i| x[(i, 0)])
    };
    // Ψ e^{−JnΩt}, as three numbers for each mode: all nodes move alike.
    let modes = |time: f64| -> [[f64; 3]; 3] {
        let (s, c) = (N * SPEED * time).sin_cos();
        let turned = |a: f64, b: f64, k: usize| a * SHAPE[1][k] + b * SHAPE[2][k];
        [SHAPE[0], [0, 1, 2].map(|k| turned(c, -s, k)), [0, 1, 2].map(|k| turned(s, c, k))]
    };
    let force = |psi: &[[f64; 3]; 3], reaction: &[f64]| -> [f64; 3] {
        let total = [0, 1, 2].map(|c| reaction.iter().skip(c).step_by(3).sum::<f64>());
        psi.map(|p| (0..3).map(|c| p[c] * total[c]).sum())
    };
    let (mut a, mut v): ([f64; 3], [f64; 3]) = ([0, 1, 2].map(|k| start.q[k]), [0.0; 3]);
    // At rest in the standing frame the waves of the turning one travel backwards.
    (v[1], v[2]) = (-N * SPEED * a[2], N * SPEED * a[1]);
    let mut reaction = start.reaction.clone();
    let displacement = |psi: &[[f64; 3]; 3], a: &[f64; 3], c: usize| (0..3).map(|k| psi[k][c] * a[k]).sum::<f64>();
    let s = &squeal.pair.residual;
    let response = |reaction: &[f64]| s * Mat::from_fn(3 * n, 1, |i, _| reaction[i]);
    let (mut psi, mut now) = (modes(0.0), response(&reaction));
    for k in 0..steps {
        let old = force(&psi, &reaction);
        let before: Vec<f64> = (0..3 * n).map(|i| now[(i, 0)] + displacement(&psi, &a, i % 3)).collect();
        psi = modes((k + 1) as f64 * step);
        let damped = [0, 1, 2].map(|i| (0..3).map(|j| damping[(i, j)] * v[j]).sum::<f64>());
        let free = solved([0, 1, 2].map(|i| 0.5 * old[i] - damped[i] - square(i) * (a[i] + half * v[i])));
        let a_free = [0, 1, 2].map(|i| a[i] + step * (v[i] + half * free[i]));
        let w = Mat::from_fn(3 * n, 3 * n, |i, j| {
            let column = solved([0, 1, 2].map(|k| psi[k][j % 3]));
            s[(i, j)] + half * half * (0..3).map(|k| psi[k][i % 3] * column[k]).sum::<f64>()
        });
        let mut b: Vec<f64> = (0..3 * n).map(|i| displacement(&psi, &a_free, i % 3)).collect();
        for i in 0..n {
            b[3 * i] -= before[3 * i];
            b[3 * i + 1] += 0.05 * step - before[3 * i + 1];
            b[3 * i + 2] += interface.gap[i] - approach;
        }
        let matrix = DelassusOperator::new((0..9 * n * n).map(|k| w[(k % (3 * n), k / (3 * n))]).collect());
        let law = FrictionLaw::Constant(squeal.mu).into();
        let problem = StepProblem {
            matrix: &matrix,
            free: &b,
            friction: &law,
            before: &[],
            step,
            patch: &[],
            borders: &[],
            tolerance: 1e-10,
        };
        let (mut memory, mut effort) = (NewtonMemory::default(), Effort::default());
        let found = problem.solve(ContactSolver::Newton, &reaction, None, &[], &mut memory, &mut effort).unwrap();
        reaction = found.reaction;
        let new = solved(force(&psi, &reaction));
        let change = [0, 1, 2].map(|i| step * (free[i] + 0.5 * new[i]));
        (0..3).for_each(|i| {
            a[i] += step * (v[i] + 0.5 * change[i]);
            v[i] += change[i];
        });
        now = response(&reaction);
    }
    reaction
}

/// The same history of the contact in either frame, sticking first, then sliding.
#[test]
fn the_contact_does_not_know_in_which_frame_the_wheel_is_described() {
    let squeal = wheel(7, SPEED);
    let (start, approach) = pressed(&squeal);
    let apart = [2e-5, 1e-5].map(|step| {
        let mut stepper = Stepper::new(squeal.model(), settings_of(&squeal, step, approach), start.clone()).unwrap();
        let steps = (1.6e-3 / step) as usize;
        let (mut stick, mut slip) = (0, 0);
        for _ in 0..steps {
            stepper.advance().unwrap();
            stick += stepper.report().stick();
            slip += stepper.report().closed() - stepper.report().stick();
        }
        assert!(stick > steps && slip > steps, "{stick} nodes stick, {slip} slip, in {steps} steps");
        let other = in_the_turning_frame(&squeal, &start, step, steps, approach);
        let now = &stepper.state().reaction;
        let largest = now.iter().fold(0.0f64, |m, r| m.max(r.abs()));
        now.iter().zip(&other).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / largest
    });
    assert!(apart[1] < 1e-3 && apart[1] < 0.6 * apart[0], "reactions apart by {apart:?}");
    // What would be missed at rest.
    let still = wheel(7, 0.0);
    let other = in_the_turning_frame(&still, &start, 1e-5, 160, approach);
    let mut stepper = Stepper::new(still.model(), settings_of(&still, 1e-5, approach), start).unwrap();
    (0..160).for_each(|_| stepper.advance().unwrap());
    let now = &stepper.state().reaction;
    let missed = now.iter().zip(&other).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
        / now.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    assert!(missed > 20.0 * apart[1], "at rest they are apart by {missed:.1e}, turning by {apart:?}");
}

/// Growth and frequency of the two waves of a pair, and of the mode beside it, are those of the linear analysis. Each
/// of three runs begins along one of them; the matrix that takes the modal state of one time to that of the next, for
/// all of them, has the eigenvalues e^{λT}.
#[test]
fn both_waves_of_a_pair_grow_as_the_linear_analysis_says() {
    let squeal = wheel(13, SPEED);
    let (h, every) = (1e-5, 20);
    let interval = h * every as f64;
    for creepage in [0.012, -0.012] {
        let problem = squeal.sliding(creepage, NormalLoad::Force(squeal.load));
        let solution = problem.solve().unwrap();
        let pairs = eigenpairs(&squeal.pair, &problem.contact(&solution), 1e-9).unwrap();
        let waves: Vec<_> = pairs.iter().filter(|p| p.value.im > 60.0 && p.damping_ratio() < 0.3).collect();
        assert_eq!(waves.len(), 3);
        let (mut now, mut next) = (Mat::<f64>::zeros(6, 6), Mat::<f64>::zeros(6, 6));
        for wave in &waves {
            let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]);
            let along = ContactCreepage { lateral: creepage, ..ContactCreepage::default() };
            let settings = squeal.settings(along, NormalLoad::Approach(solution.motions[0]), h, ContactSolver::Newton);
            let mut calm = Stepper::new(squeal.model(), settings.clone(), start.clone()).unwrap();
            let amplitude = 5e-7 / wave.modal.iter().map(|z| z.norm()).fold(0.0, f64::max);
            let moved = start.perturbed(&wave.modal, wave.value, amplitude);
            let mut moved = Stepper::new(squeal.model(), settings, moved).unwrap();
            moved.settle().unwrap();
            let mut samples: Vec<Mat<f64>> = Vec::new();
            for step in 0..2000 {
                calm.advance().unwrap();
                moved.advance().unwrap();
                // What the contact relaxes by itself is over by then.
                if step > 100 && step % every == 0 {
                    let (a, b) = (moved.state(), calm.state());
                    samples.push(Mat::from_fn(6, 1, |i, _| match i < 3 {
                        true => a.q[i] - b.q[i],
                        false => (a.v[i - 3] - b.v[i - 3]) / 3e3,
                    }));
                }
            }
            for w in samples.windows(2) {
                let size = w[0].norm_l2().powi(2);
                now += faer::Scale(1.0 / size) * (&w[0] * w[0].transpose());
                next += faer::Scale(1.0 / size) * (&w[1] * w[0].transpose());
            }
        }
        let propagator = now.transpose().partial_piv_lu().solve(next.transpose()).transpose().to_owned();
        let found: Vec<_> = propagator.eigenvalues().unwrap().into_iter().map(|m| m.ln() / interval).collect();
        for wave in waves {
            let near = found.iter().min_by(|a, b| (**a - wave.value).norm().total_cmp(&(**b - wave.value).norm()));
            let (got, want) = (near.unwrap(), wave.value);
            assert!(
                (got.re - want.re).abs() < 0.2 + 0.02 * want.re.abs() && (got.im / want.im - 1.0).abs() < 1e-3,
                "creepage {creepage}: {got}, expected {want}"
            );
        }
    }
}

/// Without contact a wave keeps its energy, and what damping takes comes from it and from the axle, which holds the
/// wheel at its speed.
#[test]
fn energy_of_a_wheel_that_turns() {
    let squeal = wheel(7, SPEED);
    let (start, approach) = pressed(&squeal);
    for (theta, most) in [(0.5, 1e-6), (0.52, 0.1)] {
        let mut settings = settings_of(&squeal, 1e-5, approach);
        settings.scheme.theta = theta;
        let mut stepper = Stepper::new(squeal.model(), settings, start.clone()).unwrap();
        (0..400).for_each(|_| stepper.advance().unwrap());
        let e = stepper.state().energy;
        assert!(e.friction > 0.0 && e.damping > 0.0);
        assert!(e.residual().abs() < most * e.friction, "θ = {theta}: balance {:e} of {e:?}", e.residual());
    }
    // What θ takes beside the balance falls with the step.
    let beside = [1e-5, 5e-6].map(|step| {
        let mut settings = settings_of(&squeal, step, approach);
        settings.scheme.theta = 0.52;
        let mut stepper = Stepper::new(squeal.model(), settings, start.clone()).unwrap();
        (0..(4e-3 / step) as usize).for_each(|_| stepper.advance().unwrap());
        stepper.state().energy.residual()
    });
    let order = (beside[0] / beside[1]).log2();
    assert!((order - 1.0).abs() < 0.2, "order {order}: {beside:?}");
    // Free: nothing but the wave. Modes that are unlike damped, so that C D′ has a symmetric part, which stores
    // nothing.
    let squeal = damped(7, SPEED, [DAMPING, 4.0, 9.0]);
    let mut settings = settings_of(&squeal, 1e-5, -1.0);
    settings.drive.patches[0].tangential[1] = Tangential::Creep(History::constant(0.0));
    let mut free = start;
    free.reaction.fill(0.0);
    free.motions = vec![-1.0];
    (free.q, free.v) = (vec![0.0; 3], vec![0.0; 3]);
    (free.q[1], free.v[2]) = (1e-4, 0.3);
    let mut stepper = Stepper::new(squeal.model(), settings, free).unwrap();
    (0..3000).for_each(|_| stepper.advance().unwrap());
    let e = stepper.state().energy;
    let taken = e.start - e.kinetic - e.elastic;
    assert!(e.residual().abs() < 1e-11 * e.start, "{e:?}");
    // What damping takes differs from what the wave loses by the axle's share, 2 ω/(ω ± nΩ) of each wave.
    assert!(e.drive.abs() > 1e-3 * taken && e.damping > 0.0, "{e:?}");
}

/// The response W of a step is taken symmetric in what it finds the reactions with; with what the skew part adds it
/// is the one that the reactions at its end have: displacements θh²γ A⁻¹ Ψᵀ R of the modes, A = 1 + hθC + h²θ²K with
/// the gyroscopic terms, and S R.
#[test]
fn the_skew_part_of_a_step_is_what_its_symmetric_part_lacks() {
    let squeal = wheel(7, SPEED);
    let model = squeal.model();
    let (n, step, theta) = (model.modes.nrows(), 1e-4, 0.6);
    let modal = Modal::new(&model, Scheme { step, theta }, model.impact().unwrap()).unwrap();
    let reaction = Mat::from_fn(n, 1, |i, _| 1.0 + (0.7 * i as f64).sin());
    let loads = model.modes.transpose() * &reaction;
    let a = Mat::from_fn(3, 3, |i, j| {
        let one = if i == j { 1.0 } else { 0.0 };
        one + step * theta * (model.damping.get(i, j) + step * theta * model.stiffness.get(i, j))
    });
    let exact = faer::Scale(theta * step * step * modal.gamma()) * a.partial_piv_lu().solve(&loads);
    let force: Vec<f64> = (0..3).map(|k| loads[(k, 0)]).collect();
    let lag = modal.lag(&force).expect("a body that turns");
    let lag = model.modes * Mat::from_fn(3, 1, |k, _| lag[k]);
    let rest = model.modes * &exact + model.residual * &reaction - modal.operator(&model) * &reaction;
    assert!(lag.norm_l2() > 1e-6 * (model.modes * &exact).norm_l2(), "{lag:?}");
    assert!((&rest - &lag).norm_l2() < 1e-6 * lag.norm_l2(), "{rest:?} {lag:?}");
}

#[test]
fn both_solvers_find_the_same_reactions_of_a_wheel_that_turns() {
    both_solvers(&wheel(11, SPEED));
}
