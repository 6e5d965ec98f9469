//! Two points on one belt, each of which one mode moves far and the other one a little, under friction that falls most
//! at one velocity (K. Kraft). Squeal grows from small cycles where the velocity passes a threshold, and the second
//! wave from small ones behind a torus point: both are marched.

use super::*;
use crate::cycles::corrector::Condition;
use crate::cycles::in_order;
use crate::friction::Kraft;
use crate::transient::Energy;

type C = num_complex::Complex<f64>;

/// Frequencies of the modes, Hz, and their damping, 1/s.
const FREQUENCIES: [f64; 2] = [100.0, 163.0];
const DAMPINGS: [f64; 2] = [68.0, 74.0];
/// Coefficient of friction at rest; motion of the point of the other mode, of its own.
const AT_REST: f64 = 0.4;
const BESIDE: f64 = 0.1;
/// Length of the memory of friction, m.
const MEMORY: f64 = 1e-5;
const FINE: Resolution = Resolution { harmonics: 6, samples: 120 };

struct Points {
    interface: Interface,
    residual: Mat<f64>,
    shapes: Mat<f64>,
    omega: [f64; 2],
}

impl Points {
    fn new() -> Self {
        let interface = Self::belt(0.0);
        let residual = Mat::from_fn(6, 6, |i, j| if i == j { SOFT } else { 0.0 });
        let shapes = Mat::from_fn(6, 2, |i, k| match i {
            0 | 3 if i / 3 == k => 1.0,
            0 | 3 => BESIDE,
            _ => 0.0,
        });
        Self { interface, residual, shapes, omega: FREQUENCIES.map(|f| 2.0 * PI * f) }
    }

    /// Both points on a belt of the velocity `v`, m/s.
    fn belt(v: f64) -> Interface {
        Interface::points(vec![0.0; 2], vec![[v, 0.0]; 2]).unwrap()
    }

    fn model(&self) -> Model<'_> {
        Model {
            interface: &self.interface,
            residual: self.residual.as_ref(),
            modes: self.shapes.as_ref(),
            omega: &self.omega,
            stiffness: ModalMatrix::squares(&self.omega),
            damping: DAMPINGS.to_vec().into(),
            turning: None,
            carried: None,
            load: &[],
        }
    }

    fn friction(&self, v: f64) -> f64 {
        self.conditions(v).unwrap().settings.friction.law(0).coefficient(v)
    }

    /// Equations with the motion in units of a velocity of 30 mm/s of the first mode.
    fn equations<'e>(&'e self, structure: &'e Structure<'e>, v: f64) -> Equations<'e, 'e> {
        let mu = self.friction(v);
        let one = [-mu * LOAD, 0.0, LOAD];
        let memory = ContactMemory { reaction: [one, one].concat(), friction: vec![mu; 2], motions: vec![LOAD * SOFT] };
        let unit = 0.03 / OMEGA;
        Equations { structure, family: self, resolution: FINE, unit, omega: OMEGA, key: [v, 0.1], memory, marches: 0 }
    }
}

impl Family for Points {
    fn conditions(&self, key: f64) -> crate::Result<Conditions> {
        let settings = Settings {
            scheme: Scheme { step: 1e-5, theta: 0.5 },
            friction: FrictionLaw::from(Kraft { memory_length: MEMORY, ..Kraft::new(AT_REST) }).into(),
            solver: ContactSolver::Newton,
            tolerance: 1e-12,
            drive: Loading::constant(
                NormalLoad::Approach(LOAD * SOFT),
                ContactCreepage { longitudinal: 0.0, lateral: 0.0, spin: 0.0 },
                0.0,
            ),
        };
        Ok(Conditions { settings, interface: Self::belt(key), load: Vec::new() })
    }
}

/// The cycle of the first mode with a velocity of 30 mm/s, and its branch towards `up` until `stop`.
fn branch(points: &Points, structure: &Structure<'_>, up: bool, stop: fn(&BranchPoint) -> bool) -> BranchState {
    let v = 0.103;
    let mut equations = points.equations(structure, v);
    let force = -points.friction(v) * LOAD * (1.0 + BESIDE);
    let mean: Vec<C> = points.omega.iter().map(|w| C::new(force / (w * w), 0.0)).collect();
    let first = [C::new(0.03 / OMEGA, 0.0), C::default()];
    let of = |q: &[C]| structure.at_contact(q).into_iter().map(|z| z.re / equations.unit).collect::<Vec<f64>>();
    let (mut u, z) = (of(&mean), of(&first));
    u.extend(&z);
    u.resize(equations.size(), 0.0);
    u.extend([1.0, 0.0]);
    let mut row = vec![0.0; u.len()];
    row[2..4].copy_from_slice(&z);
    let conditions = [equations.phase(&u), Condition { row, reference: u.clone() }];
    let mut contact = None;
    let found = equations.correct(u, &conditions, &mut contact).unwrap();
    let key = equations.key_of(&found.u);
    let values = multipliers(structure, &points.conditions(key).unwrap(), &found.cycle, FINE).unwrap();
    let start = BranchPoint { key, u: found.u, cycle: found.cycle, multipliers: Some(values), special: None };
    let extent = BranchExtent { range: [0.06, 0.2], most: 60, longest: 0.2, located: Some(1e-6), stability: true };
    let mut branch = BranchState::new(start, contact.unwrap(), up, &extent);
    follow(&mut equations, &mut branch, &extent, &mut |state| Ok(!state.points.iter().any(stop))).unwrap();
    branch.points = in_order(branch.points, 2);
    branch
}

/// N times the negative slope of the coefficient of friction, 1/s, as the first mode has it of friction that follows
/// the velocity over a length.
fn feed(v: f64) -> f64 {
    let slope = 0.5 * AT_REST * [0.138, 6.9].map(|s| (-s / v).exp() * s / (v * v)).iter().sum::<f64>();
    LOAD * slope / (1.0 + (OMEGA * MEMORY / v).powi(2))
}

/// Above the velocity at which damping takes what friction feeds rest is stable. The branch comes there from below,
/// where rest is not: its cycles are stable down to the smallest.
#[test]
fn cycles_grow_from_rest_where_friction_falls_less_at_larger_amplitudes() {
    let points = Points::new();
    let structure = Structure::new(points.model()).unwrap();
    let branch = branch(&points, &structure, true, |_| false);
    let text: Vec<_> =
        branch.points.iter().map(|p| (p.key, p.cycle.kinetic, p.multipliers.as_ref().map(|m| m.values[0]))).collect();
    assert_eq!(branch.end, Some(BranchEnd::Rest), "{text:?}");
    // The first mode moves its point, and the other one a hundredth as much in power.
    let taken = DAMPINGS[0] / (1.0 + BESIDE * BESIDE);
    let (mut low, mut high) = (0.07, 0.2);
    for _ in 0..60 {
        let v = 0.5 * (low + high);
        *(if feed(v) > taken { &mut low } else { &mut high }) = v;
    }
    let [a, b] = [branch.points.len() - 2, branch.points.len() - 1].map(|k| &branch.points[k]);
    let at_rest = b.key - (a.key - b.key) / (a.cycle.kinetic - b.cycle.kinetic) * b.cycle.kinetic;
    eprintln!("{at_rest} {low}");
    assert!((at_rest / low - 1.0).abs() < 1e-3, "{at_rest}, expected {low}: {text:?}");
    assert!(a.key < b.key && b.key < low, "{text:?}");
    assert!(branch.points.iter().all(|p| p.multipliers.as_ref().unwrap().is_stable()), "{text:?}");
}

/// Frequency, Hz, and amplitude of the line of `signal`, in steps of `h`, nearest to `about`, within 8 Hz: the largest
/// value of its transform under a Hann window.
fn line(signal: &[f64], h: f64, about: f64) -> [f64; 2] {
    let n = signal.len() as f64;
    let size = |f: f64| {
        let turn = |i: usize| C::from_polar(0.5 - 0.5 * (2.0 * PI * i as f64 / n).cos(), -2.0 * PI * f * h * i as f64);
        signal.iter().enumerate().map(|(i, s)| *s * turn(i)).sum::<C>().norm() * 4.0 / n
    };
    let mut best = (-80..=80).map(|k| about + 0.1 * f64::from(k)).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap();
    let mut by = 0.05;
    while by > 1e-6 {
        best = [best - by, best, best + by].into_iter().max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap();
        by *= 0.5;
    }
    [best, size(best)]
}

/// Frequencies of both waves and the amplitude of the second mode, m/s, in the last four seconds of a march at `v`
/// that begins with `cycle` and a second wave of 10 mm/s.
fn marched_waves(points: &Points, v: f64, cycle: &PeriodicSolution) -> [f64; 3] {
    let [q, mut velocity] = cycle.state.clone();
    velocity[1] += 0.01;
    let state = State {
        step: 0,
        q,
        v: velocity,
        reaction: cycle.contact.reaction.clone(),
        motions: cycle.contact.motions.clone(),
        creep: [0.0; 2],
        friction: cycle.contact.friction.clone(),
        energy: Energy::default(),
    };
    let step = 2.0 * PI / (cycle.omega * FINE.samples as f64);
    let settings = Settings { scheme: Scheme { step, theta: 0.5 }, ..points.conditions(v).unwrap().settings };
    let belt = Points::belt(v);
    let mut stepper = Stepper::new(Model { interface: &belt, ..points.model() }, settings, state).unwrap();
    let mut speeds = [Vec::new(), Vec::new()];
    let (before, count) = ((6.0 / step) as usize, (4.0 / step) as usize);
    for k in 0..before + count {
        stepper.advance().unwrap();
        if k >= before && k % 8 == 0 {
            (0..2).for_each(|m| speeds[m].push(stepper.state().v[m]));
        }
    }
    // Each wave where its mode has it most.
    let [first, _] = line(&speeds[0], 8.0 * step, FREQUENCIES[0]);
    let [second, amplitude] = line(&speeds[1], 8.0 * step, FREQUENCIES[1]);
    [first, second, amplitude]
}

/// In front of the torus point the second wave dies out. Behind it marching has both lines, at the distance that the
/// multiplier tells but for what grows with the way from the point, and the second wave grows from nothing: the square
/// of its amplitude is zero where the point is.
#[test]
fn marching_has_both_waves_behind_a_torus_point() {
    let points = Points::new();
    let structure = Structure::new(points.model()).unwrap();
    let is_torus = |p: &BranchPoint| p.special.is_some_and(|s| s.kind == SpecialKind::Torus);
    let branch = branch(&points, &structure, false, is_torus);
    let text: Vec<_> = branch.points.iter().map(|p| (p.key, p.cycle.kinetic, p.special)).collect();
    let torus = branch.points.iter().find(|p| is_torus(p)).unwrap_or_else(|| panic!("{:?} {text:?}", branch.end));
    let Special { second: told, error, .. } = torus.special.unwrap();
    // The second mode lies below twice the first wave. The steps of a march have lower frequencies than the modes.
    let told = told * torus.cycle.omega / (2.0 * PI * torus.cycle.frequency);
    let waves = |by: f64| {
        let [first, second, amplitude] = marched_waves(&points, torus.key - by, &torus.cycle);
        (2.0 * first - second, amplitude)
    };
    let behind = [1e-3, 2e-3, 4e-3].map(waves);
    let in_front = waves(-2e-3);
    let distance = 2.0 * behind[0].0 - behind[1].0;
    // The parabola through the squares over the way behind the point, in mm/s.
    let [a, b, c] = behind.map(|w| w.1 * w.1);
    let (slope, bend) = (b - a, ((c - b) / 2.0 - (b - a)) / 3.0);
    let at_point = a - slope + 2.0 * bend;
    let zero = -1e-3 * at_point / (slope - 3.0 * bend);
    let found = format!("{behind:?}, in front {in_front:?}: {distance} Hz, told {told} Hz; {zero} m/s, error {error}");
    eprintln!("{found}");
    assert!((distance - told).abs() < 5e-3, "{found}");
    assert!(behind.iter().all(|w| (w.0 - told).abs() < 0.05 && w.1 > 0.01) && in_front.1 < 1e-3, "{found}");
    assert!(zero.abs() < error, "{found}");
}
