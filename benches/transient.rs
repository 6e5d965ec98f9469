//! Cost of a time step in stick and slip, in products W·r on the closed contacts of the same process.
//!
//! cargo bench --bench transient

use faer::Mat;
use railsqueal::contact::half_space::HalfSpace;
use railsqueal::contact::{combined_compliance, Creepage, FrictionLaw, Interface, NormalLoad, SteadyProblem, Stencil};
use railsqueal::transient::{ContactSolver, Drive, Effort, Model, Operator, Scheme, Settings, State, Stepper};
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let (load, mu, speed) = (70e3, 0.3, 10.0);
    let s = Interface::paraboloid(15, 15, [7e-3; 2], [4.0; 2]).expect("interface");
    let n = s.len();
    let steel = HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.x, &s.y).expect("compliance");
    let residual = combined_compliance(steel.as_ref(), steel.as_ref()).expect("both");
    // As many modes as 60 of each body, from 400 Hz to 7.5 kHz; each moves the contact as a whole and tilts it.
    let count = 120;
    let omega: Vec<f64> = (0..count).map(|k| 2.0 * std::f64::consts::PI * (400.0 + 60.0 * k as f64)).collect();
    let modes = Mat::from_fn(3 * n, count, |i, k| {
        let [x, y] = s.point(i / 3);
        0.05 * ((1.7 * (i % 3) as f64 + 2.3 * k as f64).sin() + 10.0 * (x * (k as f64).cos() + y * (k as f64).sin()))
    });
    let damping = vec![3.0; count];
    let model = Model {
        interface: &s,
        residual: residual.as_ref(),
        modes: modes.as_ref(),
        omega: &omega,
        damping: &damping,
        load: &[],
    };
    let creepage = Creepage { lateral: 0.006, ..Creepage::default() };
    let statics = model.statics();
    let steady = SteadyProblem {
        interface: &s,
        compliance: statics.as_ref(),
        friction: FrictionLaw::Constant(mu),
        speed,
        creepage,
        load: NormalLoad::Force(load),
        stencil: Stencil::Edge,
        tolerance: 1e-9,
        max_iterations: 200,
    };
    let rest = steady.solve().expect("steady state");
    let reaction: Vec<f64> = (0..n)
        .flat_map(|i| [rest.traction[i][0], rest.traction[i][1], rest.pressure[i]].map(|v| v * s.weight[i]))
        .collect();
    for energy in [0.0, 0.1] {
        let settings = Settings {
            scheme: Scheme { step: 1e-5, theta: 0.5 },
            friction: FrictionLaw::Constant(mu),
            solver: ContactSolver::Newton,
            tolerance: 1e-10,
            drive: Drive::constant(NormalLoad::Approach(rest.approach), creepage, speed),
        };
        let start = State::at_rest(&model, &reaction, rest.approach).shaken(1, energy);
        let mut stepper = Stepper::new(model.clone(), settings, start).expect("stepper");
        for _ in 0..500 {
            stepper.advance().expect("step");
        }
        let (mut effort, mut stick, mut closed) = (Effort::default(), 0, 0);
        let steps = 3000;
        let begun = Instant::now();
        for _ in 0..steps {
            stepper.advance().expect("step");
            effort += stepper.report().effort;
            stick += stepper.report().stick;
            closed += stepper.report().closed;
        }
        let step = begun.elapsed().as_secs_f64() / steps as f64;
        let size = 3 * (closed / steps);
        let data: Vec<f64> = (0..size * size).map(|k| (k % 97) as f64).collect();
        let operator = Operator::new(&data, size, size);
        let (x, mut y) = (vec![1.0; size], vec![0.0; size]);
        let repeats = 2000;
        let begun = Instant::now();
        for _ in 0..repeats {
            operator.times(black_box(&x), &mut y);
            black_box(&y);
        }
        let product = begun.elapsed().as_secs_f64() / f64::from(repeats);
        let per = |v: usize| v as f64 / steps as f64;
        println!(
            "{count} modes, {:.1} closed, {:.1} in stick: step {:.1} µs = {:.1} products of {:.1} µs; {:.2} products, {:.2} \
             solutions, {:.4} factorisations, {:.2} iterations a step",
            per(closed),
            per(stick),
            1e6 * step,
            step / product,
            1e6 * product,
            per(effort.products),
            per(effort.solutions),
            per(effort.factorisations),
            per(effort.iterations)
        );
    }
}
