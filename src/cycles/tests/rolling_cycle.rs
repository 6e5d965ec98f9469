//! Cycles of an elastic half-space that rolls under a ball, which sways across under friction that falls: their
//! multipliers beside marching.

use super::*;
use crate::body::half_space::HalfSpace;
use crate::cycles::corrector::Condition;
use crate::transient::Energy;

/// Rolling speed, m/s, frequency of the mode, rad/s, its displacement, 1/√kg, and its damping, 1/s.
const SPEED: f64 = 10.0;
const RATE: f64 = 2.0 * PI * 1000.0;
const SHAPE: f64 = 0.1;
const DAMPED: f64 = 12.0;
/// Normal force, N.
const FORCE: f64 = 8e3;
const STEPS: Resolution = Resolution { harmonics: 5, samples: 120 };

/// The contact over the lateral sliding velocity, m/s.
struct Ball {
    interface: Interface,
    residual: Mat<f64>,
    shapes: Mat<f64>,
}

impl Ball {
    fn new() -> Self {
        let line = |n: usize| (0..n).map(|i| 1e-3 * (i as f64 - 0.5 * (n - 1) as f64)).collect::<Vec<f64>>();
        let (x, y) = (line(13), line(11));
        let gap = (0..x.len() * y.len()).map(|i| (x[i % 13].powi(2) + y[i / 13].powi(2)) / 0.6).collect();
        let residual = HalfSpace { young: 210e9, poisson: 0.3 }.compliance(&x, &y).unwrap();
        let shapes = Mat::from_fn(residual.nrows(), 1, |row, _| if row % 3 == 1 { SHAPE } else { 0.0 });
        Self { interface: Interface::new(x, y, gap).unwrap(), residual, shapes }
    }

    fn model(&self) -> Model<'_> {
        Model {
            interface: &self.interface,
            residual: self.residual.as_ref(),
            modes: self.shapes.as_ref(),
            omega: &[RATE],
            stiffness: ModalMatrix::squares(&[RATE]),
            damping: vec![DAMPED].into(),
            turning: None,
            carried: None,
            load: &[],
        }
    }

    /// A stepper in the state of steady sliding at the velocity `v`, the ball moved by `q`, m √kg, with the `step`, s.
    fn stepper(&self, v: f64, q: f64, step: f64) -> Stepper<'_> {
        let settings = Settings { scheme: Scheme { step, theta: 0.5 }, ..self.conditions(v).unwrap().settings };
        let n = self.interface.len();
        let mu = settings.friction.law(0).coefficient(v);
        let model = self.model();
        let rest = State::at_rest(&model, &vec![0.0; 3 * n], &[2e-5]).remembering(&vec![mu; n]);
        let mut stepper = Stepper::new(self.model(), settings, rest).unwrap();
        // The ball is held until the contact has formed.
        for _ in 0..2 * STEPS.samples {
            stepper.advance().unwrap();
            let mut state = stepper.state().clone();
            (state.q[0], state.v[0]) = (0.0, 0.0);
            stepper.put(state).unwrap();
        }
        let mut state = stepper.state().clone();
        let push: f64 = (0..n).map(|i| SHAPE * state.reaction[3 * i + 1]).sum();
        state.q[0] = push / (RATE * RATE) + q;
        stepper.put(state).unwrap();
        stepper
    }
}

impl Family for Ball {
    fn conditions(&self, key: f64) -> crate::Result<Conditions> {
        let creepage = ContactCreepage { longitudinal: 0.0, lateral: key / SPEED, spin: 0.0 };
        let law = Exponential { memory_length: 1e-5, ..Exponential::new(0.4, 0.2, 0.3) };
        let settings = Settings {
            scheme: Scheme { step: 1e-5, theta: 0.5 },
            friction: FrictionLaw::from(law).into(),
            solver: ContactSolver::Newton,
            tolerance: 1e-12,
            drive: Loading::constant(NormalLoad::Force(FORCE), creepage, SPEED),
        };
        Ok(Conditions { settings, interface: self.interface.clone(), load: Vec::new() })
    }
}

/// Equations about the motion that `stepper` has, and the unknowns of that motion.
fn about<'e, 'a>(
    ball: &'e Ball,
    structure: &'e Structure<'a>,
    stepper: &mut Stepper<'_>,
    v: f64,
) -> (Equations<'e, 'a>, Vec<f64>) {
    let z = structure.follow(stepper, STEPS).unwrap();
    let unit = z[1..].iter().map(|z| z * z).sum::<f64>().sqrt();
    let memory = ContactMemory::from_state(stepper.state());
    let omega = RATE;
    let equations =
        Equations { structure, family: ball, resolution: STEPS, unit, omega, key: [v, 0.2], memory, marches: 0 };
    let mut u: Vec<f64> = z.iter().map(|z| z / unit).collect();
    u.extend([1.0, 0.0]);
    (equations, u)
}

/// Root mean square of the motion of the ball about its mean in each of `periods` periods of a march. It begins with a
/// `cycle` at `v`, its displacement changed by the part `change` of its amplitude.
fn marched(ball: &Ball, (v, cycle): (f64, &PeriodicSolution), change: f64, periods: usize) -> Vec<f64> {
    let [mut q, velocity] = cycle.state.clone();
    q[0] += change * 2.0 * cycle.modal[1][0].norm();
    let ContactMemory { reaction, friction, motions } = cycle.contact.clone();
    let state =
        State { step: 0, q, v: velocity, reaction, motions, creep: [0.0; 2], friction, energy: Energy::default() };
    let step = 2.0 * PI / (cycle.omega * STEPS.samples as f64);
    let settings = Settings { scheme: Scheme { step, theta: 0.5 }, ..ball.conditions(v).unwrap().settings };
    let mut stepper = Stepper::new(ball.model(), settings, state).unwrap();
    let mut found = Vec::new();
    for _ in 0..periods {
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..STEPS.samples {
            stepper.advance().unwrap();
            let q = stepper.state().q[0] / STEPS.samples as f64;
            (sum, squares) = (sum + q, squares + q * stepper.state().q[0]);
        }
        found.push((squares - sum * sum).sqrt());
    }
    found
}

/// Small cycles lie where rest is stable: a motion leaves them at the rate of their multiplier, to the side to which it
/// was pushed.
#[test]
fn marching_leaves_an_unstable_cycle_in_rolling() {
    let ball = Ball::new();
    let structure = Structure::new(ball.model()).unwrap();
    let v = 0.45;
    let step = 2.0 * PI / RATE / STEPS.samples as f64;
    let mut stepper = ball.stepper(v, 0.2 / (RATE * SHAPE), step);
    let (mut equations, u) = about(&ball, &structure, &mut stepper, v);
    let mut row = vec![0.0; u.len()];
    let largest = (1..3).max_by(|&a, &b| u[a].abs().total_cmp(&u[b].abs())).unwrap();
    row[largest] = 1.0;
    let conditions = [equations.phase(&u), Condition { row, reference: u.clone() }];
    let found = equations.correct(u, &conditions, &mut None).unwrap();
    let v = equations.key_of(&found.u);
    let told = multipliers(&structure, &ball.conditions(v).unwrap(), &found.cycle, STEPS).unwrap();
    let leaves = told.values[0];
    assert!(leaves.re > 1.0005 && leaves.im == 0.0 && (told.phase - 1.0).norm() < 1e-6, "{told:?}");
    assert_eq!(found.cycle.contacts[0].stick(), [0.0; 2]);
    let own = marched(&ball, (v, &found.cycle), 0.0, 1)[0];
    for change in [1e-4, -1e-4] {
        let apart: Vec<f64> = marched(&ball, (v, &found.cycle), change, 300).iter().map(|a| a / own - 1.0).collect();
        let rate = (apart[299] / apart[99]).powf(1.0 / 200.0);
        println!("{rate} {leaves} {} {}", apart[0], apart[299]);
        assert!(((rate - 1.0) / (leaves.re - 1.0) - 1.0).abs() < 2e-3, "{rate} {leaves}");
        assert!(apart[299] * change > 0.0, "{apart:?}");
    }
}

/// Beyond it lies the stable cycle with stick: a motion that is pushed off it comes back at the rate of the multiplier,
/// and stays.
#[test]
fn marching_stays_in_a_stable_cycle_in_rolling() {
    let ball = Ball::new();
    let structure = Structure::new(ball.model()).unwrap();
    let v = 0.46;
    let step = 2.0 * PI / RATE / STEPS.samples as f64;
    let mut stepper = ball.stepper(v, 1.2 * v / (RATE * SHAPE), step);
    for _ in 0..200 * STEPS.samples {
        stepper.advance().unwrap();
    }
    let (mut equations, u) = about(&ball, &structure, &mut stepper, v);
    let found = solve(&mut equations, u, &mut None).unwrap();
    let told = multipliers(&structure, &ball.conditions(v).unwrap(), &found.cycle, STEPS).unwrap();
    assert!(told.is_stable() && found.cycle.contacts[0].stick()[1] > 0.0, "{told:?}");
    let all = marched(&ball, (v, &found.cycle), 1e-2, 800);
    let apart: Vec<f64> = all.iter().map(|a| a / all[799] - 1.0).collect();
    let rate = (apart[300] / apart[100]).abs().powf(1.0 / 200.0);
    println!("{rate} {told:?} {:?}", [0, 20, 60, 100, 200, 300, 400, 600].map(|k| apart[k]));
    assert!((rate - told.values[0].re).abs() < 2e-3, "{rate} {told:?}");
    assert!(apart[600..].iter().all(|d| d.abs() < 1e-6), "{:?}", &apart[600..]);
}
