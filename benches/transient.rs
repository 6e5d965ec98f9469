//! Cost of a time step, in products W·r on the closed contacts timed in turn with the steps in the same process:
//! products that read all of W, as a library for dense matrices does them (faer), and the solver's own, which read
//! half of it.
//!
//!     cargo bench --bench transient
//!     cargo bench --bench transient -- --model squeal.h5 [--until SECONDS] [--export problems.h5]
//!     cargo bench --bench transient -- --problems problems.h5
//!
//! The first takes two half-spaces with invented modes. The second takes the reduced model, the friction and the
//! creepage from a result file of `jobs/squeal.json` or a job like it (creepages, normal load and constant friction),
//! starts from full sliding with a large share of the most unstable mode, and measures from `until` on (0.4 s), when
//! stick and slip have ended the growth. With `--export` step problems with open nodes, stick and slip are solved
//! again, cold and warm, and written for `benches/peers/siconos_nsgs.py`; the third solves such a file again.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use railsqueal::body::half_space::HalfSpace;
use railsqueal::body::{ModalMatrix, ReducedBody};
use railsqueal::contact::{
    ContactCreepage, NormalLoad, PatchKinematics, SlidingDirection, SlidingProblem, SteadyProblem, Stencil,
};
use railsqueal::friction::{Exponential, FrictionLaw};
use railsqueal::grid::Interface;
use railsqueal::model::combined_compliance;
use railsqueal::model::CoupledModel;
use railsqueal::output::Reader;
use railsqueal::stability::reduced::eigenpairs;
use railsqueal::transient::{
    ContactSolver, DelassusOperator, Effort, Loading, Model, NewtonMemory, Scheme, Settings, State, StepProblem,
    Stepper,
};

/// Step, s.
const STEP: f64 = 1e-5;
/// Residual relative to the normal force.
const TOLERANCE: f64 = 1e-10;

fn argument(name: &str) -> Option<String> {
    let all: Vec<String> = std::env::args().collect();
    all.iter().position(|a| a == name).and_then(|i| all.get(i + 1).cloned())
}

/// Processor time of this process so far, s, where the system tells (Linux); else the time of day.
fn cpu(begun: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|v| v.parse::<f64>().ok()).map_or(begun.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

fn main() {
    match (argument("--model"), argument("--problems")) {
        (Some(path), _) => squeal(&path),
        (None, Some(path)) => dumped(&path),
        (None, None) => half_spaces(),
    }
}

/// Solves the step problems of a file made with `--export` again.
fn dumped(path: &str) {
    let file = Reader::open(Path::new(path)).expect("file");
    let mut times = vec![Vec::new(); RESIDUALS.len() * STARTS.len()];
    let mut efforts = vec![Effort::default(); times.len()];
    for number in 0.. {
        let list = |name: &str| file.numbers(&format!("/{number:02}/{name}")).map(|(_, v)| v);
        let Ok(matrix) = list("matrix") else { break };
        let [free, before, mu] = ["free", "before", "friction"].map(|n| list(n).expect(n));
        let matrix = DelassusOperator::new(matrix);
        for (c, time) in times.iter_mut().enumerate() {
            let problem = StepProblem {
                matrix: &matrix,
                free: &free,
                friction: &FrictionLaw::Constant(mu[0]).into(),
                before: &[],
                step: STEP,
                patch: &[],
                borders: &[],
                tolerance: RESIDUALS[c / STARTS.len()],
            };
            let (best, effort) = again(&problem, c % STARTS.len(), &free, &before);
            time.push(best);
            efforts[c] += effort;
        }
    }
    let count = times[0].len();
    report(&mut times);
    for (c, e) in efforts.iter().enumerate() {
        println!("{} to {:.0e}, all {count}: {e:?}", STARTS[c % STARTS.len()], RESIDUALS[c / STARTS.len()]);
    }
}

/// Prints the median of the times for each residual and start.
fn report(times: &mut [Vec<f64>]) {
    for (c, t) in times.iter_mut().enumerate().filter(|(_, t)| !t.is_empty()) {
        t.sort_by(f64::total_cmp);
        let (residual, start) = (RESIDUALS[c / STARTS.len()], STARTS[c % STARTS.len()]);
        println!("to {residual:.0e}, {start}: median {:.1} µs of {} problems", 1e6 * t[t.len() / 2], t.len());
    }
}

/// Times `steps` steps in turn with products on as many contacts as are closed, and prints what a step took.
fn measure(stepper: &mut Stepper<'_>, steps: usize, name: &str) {
    const TURNS: usize = 10;
    let size = 3 * stepper.report().closed();
    let data: Vec<f64> = (0..size * size).map(|k| (k % 97) as f64).collect();
    let operator = DelassusOperator::new(data);
    let (x, mut y) = (vec![1.0; size], vec![0.0; size]);
    let plain = Mat::from_fn(size, size, |i, j| ((i + size * j) % 97) as f64);
    let (column, mut image) = (Mat::from_fn(size, 1, |_, _| 1.0), Mat::zeros(size, 1));
    let (mut effort, mut stick, mut closed) = (Effort::default(), [0, usize::MAX, 0], [0, usize::MAX, 0]);
    let (mut step_time, mut plain_time, mut own_time) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let begun = Instant::now();
    let now = || [begun.elapsed().as_secs_f64(), cpu(begun)];
    let each = steps / TURNS;
    for _ in 0..TURNS {
        let start = now();
        for _ in 0..each {
            stepper.advance().expect("step");
            let report = stepper.report();
            effort += report.effort;
            for (seen, v) in [(&mut stick, report.stick()), (&mut closed, report.closed())] {
                *seen = [seen[0] + v, seen[1].min(v), seen[2].max(v)];
            }
        }
        let middle = now();
        for _ in 0..5 * each {
            matmul(image.as_mut(), Accum::Replace, plain.as_ref(), black_box(column.as_ref()), 1.0, Par::Seq);
            black_box(&image);
        }
        let between = now();
        for _ in 0..5 * each {
            operator.times(black_box(&x), &mut y);
            black_box(&y);
        }
        let end = now();
        for c in 0..2 {
            step_time[c] += (middle[c] - start[c]) / (TURNS * each) as f64;
            plain_time[c] += (between[c] - middle[c]) / (5 * TURNS * each) as f64;
            own_time[c] += (end[c] - between[c]) / (5 * TURNS * each) as f64;
        }
    }
    let per = |v: usize| v as f64 / (TURNS * each) as f64;
    println!(
        "{name}: {:.1} closed ({} to {}), {:.1} in stick ({} to {})\n  step {:.1} µs by processor time ({:.1} \
         by the clock) = {:.1} products \
         of {:.1} µs, or {:.1} of the own ones of {:.1} µs\n  {:.2} products, {:.2} iterations, {:.2} inner \
         ones, {:.2} solutions, {:.4} \
         factorisations, {:.4} sweeps a step",
        per(closed[0]),
        closed[1],
        closed[2],
        per(stick[0]),
        stick[1],
        stick[2],
        1e6 * step_time[1],
        1e6 * step_time[0],
        step_time[1] / plain_time[1],
        1e6 * plain_time[1],
        step_time[1] / own_time[1],
        1e6 * own_time[1],
        per(effort.products),
        per(effort.iterations),
        per(effort.inner),
        per(effort.solutions),
        per(effort.factorisations),
        per(effort.sweeps)
    );
    let spread = |s: [usize; 3]| format!("{:.1} ({} to {})", per(s[0]), s[1], s[2]);
    println!(
        "row: {name} | {} | {} | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.2} | {:.1}",
        spread(closed),
        spread(stick),
        1e6 * step_time[1],
        1e6 * plain_time[1],
        step_time[1] / plain_time[1],
        1e6 * own_time[1],
        step_time[1] / own_time[1],
        per(effort.products),
        per(effort.inner)
    );
}

fn settings(friction: FrictionLaw, approach: f64, creepage: ContactCreepage, speed: f64) -> Settings {
    Settings {
        scheme: Scheme { step: STEP, theta: 0.5 },
        friction: friction.into(),
        solver: ContactSolver::Newton,
        tolerance: TOLERANCE,
        drive: Loading::constant(NormalLoad::Approach(approach), creepage, speed),
    }
}

fn nodal(s: &Interface, pressure: &[f64], traction: &[[f64; 2]]) -> Vec<f64> {
    (0..s.len()).flat_map(|i| [traction[i][0], traction[i][1], pressure[i]].map(|v| v * s.weight[i])).collect()
}

/// Steady rolling with stick and slip on half-spaces, quiet and shaken, with constant friction and friction that falls.
fn half_spaces() {
    let (load, speed) = (70e3, 10.0);
    let s = Interface::paraboloid(15, 15, [7e-3; 2], [4.0; 2]).expect("interface");
    let n = s.len();
    let steel =
        HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).expect("compliance");
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
        stiffness: ModalMatrix::squares(&omega),
        damping: damping.into(),
        turning: None,
        carried: None,
        load: &[],
    };
    let creepage = ContactCreepage { lateral: 0.006, ..ContactCreepage::default() };
    let statics = model.statics();
    let falling = FrictionLaw::from(Exponential::new(0.35, 0.25, 0.2));
    for (friction, name) in [(FrictionLaw::Constant(0.3), "constant friction"), (falling, "falling friction")] {
        let steady = SteadyProblem {
            interface: &s,
            compliance: statics.as_ref().into(),
            friction: friction.clone().into(),
            kinematics: PatchKinematics::one(speed, creepage),
            loads: NormalLoad::Force(load).into(),
            stencil: Stencil::Edge,
            tolerance: 1e-9,
            max_iterations: 200,
        };
        let rest = steady.solve().expect("steady state");
        let reaction = nodal(&s, &rest.pressure, &rest.traction);
        for (energy, moves) in [(0.0, "steady rolling"), (0.1, "strongly shaken")] {
            let settings = settings(friction.clone(), rest.motions[0], creepage, speed);
            let start = State::at_rest(&model, &reaction, &rest.motions).remembering(&rest.friction).shaken(1, energy);
            let mut stepper = Stepper::new(model.clone(), settings, start).expect("stepper");
            for _ in 0..500 {
                stepper.advance().expect("step");
            }
            measure(&mut stepper, 3000, &format!("half-spaces, {count} modes, {moves}, {name}"));
        }
    }
}

/// Model and contact of a result file.
struct Case {
    interface: Interface,
    pair: CoupledModel,
    friction: FrictionLaw,
    load: f64,
    speed: f64,
    creepage: ContactCreepage,
}

fn read(path: &str) -> Case {
    let file = Reader::open(Path::new(path)).expect("result file");
    let job: serde_json::Value = serde_json::from_str(&file.text("/provenance/job").expect("job")).expect("JSON");
    let number =
        |at: &str| job.pointer(at).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("{at} of the job"));
    let list = |at: &str| file.numbers(at).expect(at).1;
    let interface = Interface::new(list("/reduced/x"), list("/reduced/y"), list("/reduced/gap")).expect("interface");
    let body = |name: &str| {
        let matrix = |what: &str| {
            let (shape, v) = file.numbers(&format!("/reduced/{name}/{what}")).expect(what);
            Mat::from_fn(shape[0], shape[1], |i, j| v[i * shape[1] + j])
        };
        let omega = list(&format!("/reduced/{name}/omega"));
        let [alpha, beta] = ["alpha", "beta"].map(|k| number(&format!("/bodies/{name}/damping/{k}")));
        let damping: Vec<f64> = omega.iter().map(|w| alpha + beta * w * w).collect();
        ReducedBody::new(omega, damping, matrix("contact_modes"), matrix("compliance"))
    };
    let pair = CoupledModel::new(&body("lower"), &body("upper")).expect("pair");
    let creepage = |c: &str| number(&format!("/contact/creepage/{c}"));
    Case {
        interface,
        pair,
        friction: FrictionLaw::Constant(number("/contact/friction")),
        load: number("/contact/normal_load"),
        speed: number("/contact/speed"),
        creepage: ContactCreepage {
            longitudinal: creepage("longitudinal"),
            lateral: creepage("lateral"),
            spin: creepage("spin"),
        },
    }
}

/// The stick–slip limit cycle of an unstable mode.
fn squeal(path: &str) {
    let case = read(path);
    let s = &case.interface;
    let model = Model::new(&case.pair, s);
    let sliding = SlidingProblem {
        interface: s,
        compliance: case.pair.compliance.as_ref(),
        friction: case.friction.clone().into(),
        kinematics: PatchKinematics::one(case.speed, case.creepage),
        loads: NormalLoad::Force(case.load).into(),
        stencil: Stencil::default(),
        direction: SlidingDirection::Actual,
    };
    let rest = sliding.solve().expect("full sliding");
    let pairs = eigenpairs(&case.pair, &sliding.contact(&rest), 1e-9).expect("eigenvalues");
    let mode = &pairs[0];
    println!(
        "{} modes, {} closed in full sliding; most unstable: {:.2} Hz, {:+.3} 1/s",
        case.pair.omega.len(),
        rest.closed.len(),
        mode.frequency(),
        mode.growth_rate()
    );
    // Mode shapes have any size: 10 µm at the node that moves most.
    let psi = &case.pair.modes;
    let move_of =
        |row: usize| mode.modal.iter().enumerate().map(|(k, z)| z * psi[(row, k)]).sum::<num_complex::Complex<f64>>();
    let largest = (0..3 * s.len()).map(|row| move_of(row).norm()).fold(0.0, f64::max);
    let start = State::at_rest(&model, &nodal(s, &rest.pressure, &rest.traction), &rest.motions).perturbed(
        &mode.modal,
        mode.value,
        1e-5 / largest,
    );
    let settings = settings(case.friction.clone(), rest.motions[0], case.creepage, case.speed);
    let mut stepper = Stepper::new(model.clone(), settings.clone(), start).expect("stepper");
    stepper.settle().expect("start");
    let until: f64 = argument("--until").map_or(0.4, |v| v.parse().expect("seconds"));
    while stepper.time() < until {
        stepper.advance().expect("step");
    }
    measure(&mut stepper, 20_000, "limit cycle");
    if let Some(path) = argument("--export") {
        // Stick and loss of contact fall into different parts of a cycle. All neighbours of closed nodes become
        // candidates: a pressure that is not quite 0 brings them in.
        let mut start = stepper.state().clone();
        let nx = s.patches[0].x.len();
        for i in (0..s.len()).filter(|&i| stepper.state().reaction[3 * i + 2] > 0.0) {
            for j in [i - nx, i - 1, i + 1, i + nx] {
                start.reaction[3 * j + 2] = start.reaction[3 * j + 2].max(f64::MIN_POSITIVE);
            }
        }
        let mut wider = Stepper::new(model, settings, start).expect("stepper");
        export(&mut wider, case.friction, &path);
    }
}

/// Residuals relative to the normal force at which step problems are solved again.
const RESIDUALS: [f64; 2] = [1e-6, 1e-10];
/// Starts: without reactions and without anything known of W; without reactions; from the reactions of the step
/// before, whose response W R that step computed.
const STARTS: [&str; 3] = ["cold", "cold, W known", "warm"];

/// Solves step problems with open nodes, stick and slip again and writes them.
fn export(stepper: &mut Stepper<'_>, friction: FrictionLaw, path: &str) {
    const COUNT: usize = 10;
    let file = hdf5::File::create(path).expect("file");
    let FrictionLaw::Constant(mu) = &friction else { panic!("constant friction") };
    let mut before: Option<(Vec<usize>, Vec<f64>, Vec<f64>)> = None;
    let mut times = vec![Vec::new(); RESIDUALS.len() * STARTS.len()];
    for _ in 0..100_000 {
        stepper.advance().expect("step");
        let (state, report) = (stepper.state(), stepper.report());
        let Some(posed) = stepper.problem_view() else {
            before = None;
            continue;
        };
        let k = posed.nodes.len();
        let last = before.take().filter(|(nodes, ..)| nodes == posed.nodes);
        let reaction: Vec<f64> = posed.nodes.iter().flat_map(|&i| state.reaction[3 * i..3 * i + 3].to_vec()).collect();
        let mixed = report.stick() > 0 && report.closed() < k && state.step.is_multiple_of(37);
        if let Some((_, guess, free)) = last.filter(|_| mixed) {
            let mut line = Vec::new();
            for (a, tolerance) in RESIDUALS.into_iter().enumerate() {
                let (matrix, friction, free_now) = (posed.matrix, &friction.clone().into(), posed.free);
                let problem = StepProblem {
                    matrix,
                    free: free_now,
                    friction,
                    before: &[],
                    step: STEP,
                    patch: &[],
                    borders: &[],
                    tolerance,
                };
                for (b, name) in STARTS.iter().enumerate() {
                    let (best, effort) = again(&problem, b, &free, &guess);
                    times[STARTS.len() * a + b].push(best);
                    line.push(format!("{name} to {tolerance:.0e}: {:.0} µs, {} products", 1e6 * best, effort.products));
                }
            }
            let number = times[0].len() - 1;
            let group = file.create_group(&format!("{number:02}")).expect("group");
            let write = |name: &str, v: &[f64]| {
                group.new_dataset_builder().with_data(v).create(name).map(|_| ()).expect("dataset");
            };
            write("matrix", &(0..3 * k).flat_map(|j| posed.matrix.col(j).to_vec()).collect::<Vec<f64>>());
            write("free", posed.free);
            write("before", &guess);
            write("reaction", &reaction);
            write("friction", &[*mu]);
            // Rows: residuals; columns: starts.
            write("seconds", &times.iter().filter_map(|t| t.last().copied()).collect::<Vec<f64>>());
            let (open, slip) = (k - report.closed(), report.closed() - report.stick());
            println!(
                "problem {number}: {k} nodes, {open} open, {} in stick, {slip} in slip; {}",
                report.stick(),
                line.join("; ")
            );
            if times[0].len() == COUNT {
                break;
            }
        }
        before = Some((posed.nodes.to_vec(), reaction, posed.free.to_vec()));
    }
    report(&mut times);
}

/// The best time of twenty solutions from the start with this index, s, and what the last one took. `free` and
/// `before` are those of the step before.
fn again(problem: &StepProblem<'_>, start: usize, free: &[f64], before: &[f64]) -> (f64, Effort) {
    let (zero, mut response) = (vec![0.0; before.len()], vec![0.0; before.len()]);
    problem.matrix.times(before, &mut response);
    let (guess, known) = if start == 2 { (before, Some(&response[..])) } else { (&zero[..], None) };
    let last = StepProblem { free, ..*problem };
    let mut memory = NewtonMemory::default();
    let solve = |problem: &StepProblem<'_>, guess: &[f64], known: Option<&[f64]>, memory: &mut NewtonMemory| {
        let mut effort = Effort::default();
        let begun = Instant::now();
        let found = problem.solve(ContactSolver::Newton, black_box(guess), known, &[], memory, &mut effort);
        let seconds = begun.elapsed().as_secs_f64();
        assert!(found.is_ok_and(|f| f.residual.is_finite()), "no solution");
        (seconds, effort)
    };
    let (mut best, mut effort) = (f64::INFINITY, Effort::default());
    for run in 0..30 {
        // The memory is as the step before leaves it, after many others.
        if start == 0 {
            memory.forget();
        } else {
            solve(&last, before, None, &mut memory);
        }
        let seconds;
        (seconds, effort) = solve(problem, guess, known, &mut memory);
        if run >= 10 {
            best = best.min(seconds);
        }
    }
    (best, effort)
}
