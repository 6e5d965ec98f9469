//! The mass on the belt: multipliers beside marching, the order of the time step, the linearised contact, and a second
//! mode whose own instability makes a torus or a flip of the cycle of the first one.

use super::*;
use crate::cycles::balance::{Balance, ContactPeriod};
use crate::cycles::corrector::Condition;
use crate::cycles::floquet::{through_kernel, through_modes};
use crate::cycles::kernel::window;
use crate::transient::Energy;

type C = num_complex::Complex<f64>;

/// Constant of the friction law, m/s.
pub(super) const FALL: f64 = 0.3;
/// Velocity of the belt on which rest loses its stability, m/s.
pub(super) fn onset() -> f64 {
    FALL * (LOAD * 0.2 / (FALL * DAMPING)).ln()
}

/// Modes along the belt: angular frequencies, rad/s, and damping, 1/s.
pub(super) struct BeltModes {
    residual: Mat<f64>,
    shapes: Mat<f64>,
    omega: Vec<f64>,
    damping: Vec<f64>,
}

impl BeltModes {
    pub(super) fn new(omega: &[f64], damping: &[f64]) -> Self {
        let shapes = Mat::from_fn(3, omega.len(), |i, _| f64::from(u8::from(i == 0)));
        Self { residual: Belt::residual(), shapes, omega: omega.to_vec(), damping: damping.to_vec() }
    }

    pub(super) fn model<'a>(&'a self, belt: &'a Belt) -> Model<'a> {
        Model {
            interface: &belt.0,
            residual: self.residual.as_ref(),
            modes: self.shapes.as_ref(),
            omega: &self.omega,
            stiffness: ModalMatrix::squares(&self.omega),
            damping: self.damping.clone().into(),
            turning: None,
            carried: None,
            load: &[],
        }
    }
}

pub(super) fn equations<'e, 'a>(
    belt: &'e Belt,
    structure: &'e Structure<'a>,
    resolution: Resolution,
    v: f64,
) -> Equations<'e, 'a> {
    let mu = belt.conditions(v).unwrap().settings.friction.law(0).coefficient(v);
    let memory =
        ContactMemory { reaction: vec![-mu * LOAD, 0.0, LOAD], friction: vec![mu], motions: vec![LOAD * SOFT] };
    // The motion is measured by that whose velocity is that of the belt.
    let (unit, omega) = (v / OMEGA * (structure.rank() as f64).sqrt(), OMEGA);
    Equations { structure, family: belt, resolution, unit, omega, key: [v, 0.2], memory, marches: 0 }
}

/// The cycle whose velocity has `amplitude` (m/s) in the first mode, with the velocity of the belt unknown.
pub(super) fn smooth(
    equations: &mut Equations<'_, '_>,
    amplitude: f64,
) -> (f64, Vec<f64>, PeriodicSolution, ContactJacobian) {
    let r = equations.structure.rank();
    let v = equations.key[0];
    let mu = equations.family.conditions(v).unwrap().settings.friction.law(0).coefficient(v);
    let mut u = vec![0.0; equations.size() + 2];
    // Mean displacement, and a cosine: what acts at the contact is the sum of the modes.
    let stiffness: f64 = equations.structure.model.omega.iter().map(|w| 1.0 / (w * w)).sum::<f64>();
    let basis = equations.structure.basis()[(0, 0)];
    u[0] = -mu * LOAD * stiffness / basis / equations.unit;
    u[r] = amplitude / OMEGA / basis / equations.unit;
    u[equations.size()] = 1.0;
    let mut row = vec![0.0; u.len()];
    row[r] = 1.0;
    let conditions = [equations.phase(&u), Condition { row, reference: u.clone() }];
    let mut contact = None;
    let found = equations.correct(u, &conditions, &mut contact).unwrap();
    (equations.key_of(&found.u), found.u, found.cycle, contact.unwrap())
}

/// A stepper in the cycle, with the velocity of the last mode changed by `change` (m/s).
fn in_cycle<'a>(belt: &Belt, model: Model<'a>, v: f64, cycle: &PeriodicSolution, change: f64) -> Stepper<'a> {
    let [q, mut velocity] = cycle.state.clone();
    if let Some(last) = velocity.last_mut() {
        *last += change;
    }
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
    let step = 2.0 * PI / (cycle.omega * cycle.contacts[0].force.len() as f64);
    let settings = Settings { scheme: Scheme { step, theta: 0.5 }, ..belt.conditions(v).unwrap().settings };
    Stepper::new(model, settings, state).unwrap()
}

/// From an unstable cycle marching leaves at the rate of its multiplier, and the kernel has the same multipliers.
#[test]
fn marching_leaves_an_unstable_cycle_at_the_rate_of_its_multiplier() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let mut equations = equations(&belt, &structure, RESOLUTION, onset());
    let (v, _, cycle, _) = smooth(&mut equations, 0.3);
    assert!(v > onset() && v < 0.64, "{v}");
    let conditions = belt.conditions(v).unwrap();
    let found = through_modes(&structure, &conditions, &cycle, RESOLUTION.samples).unwrap();
    let told = found.values[0];
    assert!(told.re > 1.001 && told.im == 0.0 && (found.phase - 1.0).norm() < 1e-6, "{found:?}");
    let beside = through_kernel(&structure, &conditions, &cycle, RESOLUTION).unwrap();
    assert!((beside.values[0] - told).norm() < 1e-6 && (beside.phase - 1.0).norm() < 1e-6, "{found:?} {beside:?}");
    let mut stepper = in_cycle(&belt, modes.model(&belt), v, &cycle, 1e-5);
    let mut places = vec![stepper.state().q[0]];
    for _ in 0..40 {
        for _ in 0..RESOLUTION.samples {
            stepper.advance().unwrap();
        }
        places.push(stepper.state().q[0]);
    }
    // What is left after a period that is the same in each: the phase.
    let gone: Vec<f64> = places.windows(2).map(|p| p[1] - p[0]).collect();
    let rate = (gone[39] / gone[19]).abs().powf(1.0 / 20.0);
    assert!((rate - told.re).abs() < 2e-4, "{rate} {told}");
}

/// The stable cycle with stick at the velocity `v` of the belt.
fn with_stick(
    belt: &Belt,
    (structure, model): (&Structure<'_>, &Model<'_>),
    resolution: Resolution,
    v: f64,
) -> PeriodicSolution {
    let mut stepper = marched(belt, model, v, 1.2 * v, 1.0);
    let z = structure.follow(&mut stepper, RESOLUTION).unwrap();
    let mut equations = equations(belt, structure, resolution, v);
    let mut u: Vec<f64> = z.iter().map(|z| z / equations.unit).collect();
    u.resize(equations.size(), 0.0);
    u.extend([1.0, 0.0]);
    equations.memory = ContactMemory::from_state(stepper.state());
    solve(&mut equations, u, &mut None).unwrap().cycle
}

/// A motion beside a stable cycle with stick comes back to it, and stays for two hundred periods.
#[test]
fn marching_stays_in_a_stable_cycle() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let model = modes.model(&belt);
    let structure = Structure::new(model.clone()).unwrap();
    let v = 0.62;
    let cycle = with_stick(&belt, (&structure, &model), RESOLUTION, v);
    let values = multipliers(&structure, &belt.conditions(v).unwrap(), &cycle, RESOLUTION).unwrap();
    assert!(values.is_stable(), "{values:?}");
    let mut stepper = in_cycle(&belt, model, v, &cycle, 1e-2);
    let mut energy = Vec::new();
    for _ in 0..200 {
        let mut sum = 0.0;
        for _ in 0..RESOLUTION.samples {
            stepper.advance().unwrap();
            sum += 0.5 * stepper.state().v[0].powi(2) / RESOLUTION.samples as f64;
        }
        energy.push(sum);
    }
    // The phase in the steps of the march, which drifts, changes the energy by less than 1e-4.
    let apart = |e: &f64| (e / energy[199] - 1.0).abs();
    assert!(energy[100..].iter().all(|e| apart(e) < 1e-4), "{:?}", &energy[100..]);
    // With all harmonics of the motion, of which the equations have twelve.
    assert!((energy[199] / cycle.kinetic - 1.0).abs() < 1e-3, "{} {}", energy[199], cycle.kinetic);
}

/// Without stick the steps are of second order, by four each time that they are halved.
#[test]
fn cycles_converge_with_the_second_order_of_the_time_step() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let found: Vec<f64> = [100, 200, 400]
        .map(|samples| {
            let resolution = Resolution { harmonics: 6, samples };
            smooth(&mut equations(&belt, &structure, resolution, onset()), 0.3).0
        })
        .to_vec();
    let order = ((found[1] - found[0]) / (found[2] - found[1])).abs().log2();
    assert!(order > 1.7 && order < 2.4, "{order}: {found:?}");
}

/// The kernel beside the forces of two marches on either side of a cycle.
#[test]
fn kernel_is_the_derivative_of_the_contact_forces() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let resolution = Resolution { harmonics: 6, samples: 100 };
    let (v, u, cycle, _) = smooth(&mut equations(&belt, &structure, resolution, onset()), 0.3);
    let window = window(resolution.samples, 7.0).unwrap();
    let conditions = belt.conditions(v).unwrap();
    let mut balance = Balance::new(&structure, &conditions, resolution, 1.0, &cycle.contact).unwrap();
    let kernel = balance.kernel(&cycle, &window).unwrap();
    // A periodic change is the same in every period.
    let change: Vec<f64> = (0..resolution.samples).map(|n| (2.0 * PI * (2 * n + 2) as f64 / 100.0).cos()).collect();
    let part = |k: usize| (0..resolution.samples).map(|n| window[(n, k)] * change[n]).sum::<f64>();
    let parts: Vec<f64> = (0..window.ncols()).map(part).collect();
    let sum =
        |b: usize| kernel.iter().map(|a| (0..parts.len()).map(|k| a[(b, k)] * parts[k]).sum::<f64>()).sum::<f64>();
    let linear: Vec<f64> = (0..parts.len()).map(sum).collect();
    let amplitude = u[1].abs() * v / OMEGA;
    let mut ends = Vec::new();
    for sign in [1.0, -1.0] {
        let by = sign * 1e-4 * amplitude;
        let moved = balance.forces_under(&cycle, &|n| by * (4.0 * PI * n as f64 / 100.0).cos()).unwrap();
        ends.push((moved, by));
    }
    let derivative: Vec<f64> =
        ends[0].0.iter().zip(&ends[1].0).map(|(a, b)| (a - b) / (ends[0].1 - ends[1].1)).collect();
    let projected = |b: usize| (0..resolution.samples).map(|n| window[(n, b)] * derivative[n]).sum::<f64>();
    let size = linear.iter().map(|l| l * l).sum::<f64>().sqrt();
    let error = (0..linear.len()).map(|b| (projected(b) - linear[b]).powi(2)).sum::<f64>().sqrt();
    assert!(error < 1e-3 * size, "{error} of {size}");
}

/// The modified Bessel function I_n.
fn bessel(n: i32, x: f64) -> f64 {
    let steps = 400;
    let sum = |k: usize| {
        let angle = PI * (k as f64 + 0.5) / steps as f64;
        (x * angle.cos()).exp() * (f64::from(n) * angle).cos()
    };
    (0..steps).map(sum).sum::<f64>() / steps as f64
}

/// The branch from a small cycle on, with a second mode.
fn with_second_mode(frequency: f64, damping: f64) -> (Vec<BranchPoint>, BeltModes) {
    let belt = Belt::new();
    let modes = BeltModes::new(&[OMEGA, 2.0 * PI * frequency], &[DAMPING, damping]);
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let resolution = Resolution { harmonics: 6, samples: 240 };
    let mut equations = equations(&belt, &structure, resolution, onset());
    let (key, u, cycle, contact) = smooth(&mut equations, 0.1);
    let values = multipliers(&structure, &belt.conditions(key).unwrap(), &cycle, resolution).unwrap();
    let start = BranchPoint { key, u, cycle, multipliers: Some(values), special: None };
    let extent = BranchExtent { range: [0.3, 0.64], most: 40, longest: 0.1, located: Some(1e-6), stability: true };
    let mut branch = BranchState::new(start, contact, true, &extent);
    let found = |p: &BranchPoint| p.special.is_some_and(|s| matches!(s.kind, SpecialKind::Torus | SpecialKind::Flip));
    follow(&mut equations, &mut branch, &extent, &mut |state| Ok(!state.points.iter().any(found))).unwrap();
    drop(structure);
    (branch.points, modes)
}

/// In the cycle of the first mode, x = a/0.3 m/s large in velocity, friction feeds a second mode more than the first
/// one, by I₀(x)/(2I₁(x)/x): where that is the ratio of the dampings the second wave begins. It is a torus point unless
/// the second frequency is one and a half times the first one: then it is a flip.
#[test]
fn second_mode_makes_a_torus_or_a_flip() {
    let (frequency, damping) = (163.0, 15.5);
    let (points, modes) = with_second_mode(frequency, damping);
    let torus = points.iter().find(|p| p.special.is_some_and(|s| s.kind == SpecialKind::Torus)).expect("a torus");
    let x = (4.0 * torus.cycle.kinetic).sqrt() / FALL;
    let ratio = bessel(0, x) * x / (2.0 * bessel(1, x));
    assert!((ratio * DAMPING / damping - 1.0).abs() < 0.01, "{ratio}");
    // Two waves of the first frequency less one of the second, which friction shifts a little.
    let beat = 2.0 * torus.cycle.frequency - frequency;
    let second = torus.special.unwrap().second.abs();
    assert!((second - beat).abs() < 0.2, "{second} Hz, expected {beat} Hz");
    // As it is marched, period by period: places d obey d_(k+1) + d_(k-1) = 2 cos θ d_k.
    let belt = Belt::new();
    let mut stepper = in_cycle(&belt, modes.model(&belt), torus.key, &torus.cycle, 1e-5);
    let mut places = Vec::new();
    for _ in 0..120 {
        for _ in 0..torus.cycle.contacts[0].force.len() {
            stepper.advance().unwrap();
        }
        places.push(stepper.state().q[1]);
    }
    let gone: Vec<f64> = places.windows(2).map(|p| p[1] - p[0]).collect();
    let sums = gone.windows(3).fold([0.0, 0.0], |s, d| [s[0] + d[1] * (d[0] + d[2]), s[1] + d[1] * d[1]]);
    let marched = (0.5 * sums[0] / sums[1]).acos() / (2.0 * PI) * torus.cycle.frequency;
    assert!((marched - second).abs() < 0.02, "{second} Hz, marched {marched} Hz");
    // With the shift it is in step with the cycle after two periods.
    let shifted = 1.5 * (torus.cycle.frequency + (second - beat) / 1.63);
    let (points, _) = with_second_mode(shifted, damping);
    let kinds: Vec<_> = points.iter().filter_map(|p| p.special.map(|s| s.kind)).collect();
    assert!(kinds.contains(&SpecialKind::Flip), "{kinds:?}");
}

/// Belts that are not faster than a limit, m/s.
struct Slow(Belt, f64);

impl Family for Slow {
    fn conditions(&self, key: f64) -> crate::Result<Conditions> {
        match key <= self.1 {
            true => self.0.conditions(key),
            false => Err(crate::Error::Job(format!("the belt is not faster than {} m/s", self.1))),
        }
    }
}

/// A branch ends where the model does not hold, with the reason.
#[test]
fn branch_ends_with_the_reason_where_the_model_does() {
    let (slow, modes) = (Slow(Belt::new(), 0.55), BeltModes::new(&[OMEGA], &[DAMPING]));
    let structure = Structure::new(modes.model(&slow.0)).unwrap();
    let resolution = Resolution { harmonics: 6, samples: 100 };
    let mut equations = Equations { family: &slow, ..equations(&slow.0, &structure, resolution, onset()) };
    let (key, u, cycle, contact) = smooth(&mut equations, 0.1);
    let start = BranchPoint { key, u, cycle, multipliers: None, special: None };
    let extent = BranchExtent { range: [0.3, 0.9], most: 60, longest: 0.2, located: Some(1e-6), stability: false };
    let mut branch = BranchState::new(start, contact, true, &extent);
    follow(&mut equations, &mut branch, &extent, &mut |_| Ok(true)).unwrap();
    let why = branch.end.as_ref().map(BranchEnd::text).unwrap_or_default();
    assert!(why.contains("where the model ends: the belt is not faster than 0.55 m/s"), "{why}");
    let last = branch.points.last().unwrap().key;
    assert!(branch.points.len() > 2 && last > 0.549 && last <= 0.55, "{last}");
}

/// Shorter steps, and the way back, find the same fold and the same first stick.
#[test]
fn branch_does_not_depend_on_length_and_direction_of_its_steps() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let resolution = Resolution { harmonics: 8, samples: 120 };
    let places = [0.2, 0.07].map(|longest| {
        let mut equations = equations(&belt, &structure, resolution, onset());
        let (key, u, cycle, contact) = smooth(&mut equations, 0.3);
        let start = BranchPoint { key, u, cycle, multipliers: None, special: None };
        let extent = BranchExtent { range: [0.3, 0.9], most: 200, longest, located: Some(1e-6), stability: false };
        let mut branch = BranchState::new(start, contact, true, &extent);
        let mut kept = Vec::new();
        follow(&mut equations, &mut branch, &extent, &mut |state| {
            kept.push(state.clone());
            Ok(state.points.len() < 6)
        })
        .unwrap();
        // A branch that was stopped goes on to the last bit, from numbers alone.
        let half = branch.clone();
        let points = half.points.iter().map(|p| BranchPoint::from_numbers(&p.numbers()).unwrap()).collect();
        let mut again = BranchState::from_numbers(&half.numbers(), points).unwrap();
        assert_eq!(again, half);
        let place = |state: &BranchState, kind: SpecialKind| {
            let found = |p: &&BranchPoint| p.special.is_some_and(|s| s.kind == kind);
            state.points.iter().find(found).map(|p| p.key)
        };
        let to = |kind: SpecialKind| move |state: &BranchState| Ok(place(state, kind).is_none());
        follow(&mut equations, &mut branch, &extent, &mut to(SpecialKind::Fold)).unwrap();
        follow(&mut equations, &mut again, &extent, &mut to(SpecialKind::Fold)).unwrap();
        assert_eq!(again, branch);
        follow(&mut equations, &mut branch, &extent, &mut to(SpecialKind::Stick)).unwrap();
        let end = branch.points.last().cloned().unwrap();
        let back = branch.ahead.iter().map(|a| -a).collect();
        let mut back = BranchState::new(end, branch.contact.clone().unwrap(), true, &extent).towards(back);
        follow(&mut equations, &mut back, &extent, &mut to(SpecialKind::Fold)).unwrap();
        [&branch, &back].map(|b| {
            let keys: Vec<_> = b.points.iter().map(|p| (p.key, p.special)).collect();
            let known = |kind| place(b, kind).unwrap_or_else(|| panic!("no {kind:?}: {:?} {keys:?}", b.end));
            [SpecialKind::Fold, SpecialKind::Stick].map(known)
        })
    });
    let [[one, back], [short, short_back]] = places;
    for other in [back, short, short_back] {
        assert!((0..2).all(|k| (other[k] - one[k]).abs() < 2e-6), "{places:?}");
    }
}

/// A mode that moves the mass off the belt as well, by 2 µm a mm: the node first opens where the motion takes back the
/// whole approach.
#[test]
fn node_first_opens_where_the_motion_takes_back_the_approach() {
    let (belt, mut modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let lean = 2e-3;
    modes.shapes[(2, 0)] = lean;
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let resolution = Resolution { harmonics: 8, samples: 240 };
    let mut equations = equations(&belt, &structure, resolution, onset());
    // With the normal force p − lean q/SOFT friction and pressure on the mode have a part of q.
    let mu = belt.conditions(onset()).unwrap().settings.friction.law(0).coefficient(onset());
    equations.omega = (OMEGA * OMEGA - (mu - lean) * lean / SOFT).sqrt();
    let (key, u, cycle, contact) = smooth(&mut equations, 0.1);
    let start = BranchPoint { key, u, cycle, multipliers: None, special: None };
    let extent = BranchExtent { range: [0.3, 0.9], most: 60, longest: 0.1, located: Some(1e-6), stability: false };
    let mut branch = BranchState::new(start, contact, true, &extent);
    let opens = |p: &BranchPoint| p.special.is_some_and(|s| s.kind == SpecialKind::Opening);
    follow(&mut equations, &mut branch, &extent, &mut |state| Ok(!state.points.iter().any(opens))).unwrap();
    let text: Vec<_> = branch.points.iter().map(|p| (p.key, p.cycle.contacts[0].normal(), p.special)).collect();
    let at = branch.points.iter().position(opens).unwrap_or_else(|| panic!("{:?}: {text:?}", branch.end));
    let [before, opening, after] = [at - 1, at, at + 1].map(|k| &branch.points[k].cycle.contacts[0]);
    let open = |contact: &ContactPeriod| contact.nodes.iter().filter(|n| n[0] == 0).count();
    assert!(open(before) == 0 && before.normal()[0] > 0.01 * LOAD && open(after) > 0, "{text:?}");
    assert!(opening.normal()[0] < 1e-3 * LOAD, "{text:?}");
    // The farthest that it is moved off the belt, between the samples too.
    let modal = &branch.points[at].cycle.modal;
    let moved = |t: f64| -> f64 {
        let part = |(k, q): (usize, &Vec<C>)| (q[0] * C::from_polar(1.0, 2.0 * PI * k as f64 * t)).re;
        lean * modal.iter().enumerate().map(part).sum::<f64>()
    };
    let farthest = (0..2000).map(|n| moved(n as f64 / 2000.0)).fold(f64::NEG_INFINITY, f64::max);
    assert!((farthest / (LOAD * SOFT) - 1.0).abs() < 2e-3, "{farthest} {text:?}");
}

/// Motions of growing amplitude lead from rest to the cycle that is marched to. Friction feeds small ones less than
/// larger ones, so that the growth rate rises before it falls where they begin to stick.
#[test]
fn growing_motions_lead_to_the_cycle_that_is_marched_to() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA], &[DAMPING]));
    let model = modes.model(&belt);
    let structure = Structure::new(model.clone()).unwrap();
    let v = 0.45;
    let marched = with_stick(&belt, (&structure, &model), RESOLUTION, v);
    let slope = 0.2 / FALL * (-v / FALL).exp();
    let rate = 0.5 * (LOAD * slope - DAMPING);
    let motions = GrowingMotion(belt.conditions(v).unwrap());
    let mut equations =
        Equations { family: &motions, key: [rate, rate], ..equations(&belt, &structure, RESOLUTION, v) };
    let mu = motions.0.settings.friction.law(0).coefficient(v);
    let basis = structure.basis()[(0, 0)];
    let mut u = vec![0.0; equations.size() + 2];
    u[0] = -mu * LOAD / (OMEGA * OMEGA * basis * equations.unit);
    u[1] = 0.05 * v / (OMEGA * basis * equations.unit);
    u[equations.size()] = 1.0;
    let (found, _) = cycle_of_mode(&mut equations, u).unwrap();
    // The instants of stick lie elsewhere within their steps: that alone is 1e-4 in 300 steps.
    let known = |cycle: &PeriodicSolution| [cycle.kinetic, cycle.frequency, cycle.contacts[0].stick()[0]];
    let [grown, marched] = [known(&found.cycle), known(&marched)];
    let apart = |k: usize| (grown[k] / marched[k] - 1.0).abs();
    assert!(apart(0) < 3e-4 && apart(1) < 1e-5, "{grown:?} {marched:?}");
    // The cycle sticks, a motion that grows as the mode does not.
    assert!(found.cycle.contacts[0].stick()[0] > 0.01);
}

/// Columns of the assembled Jacobian at `u` beside central differences of the equations in these steps.
pub(super) fn beside_differences(equations: &mut Equations<'_, '_>, u: &[f64], columns: &[(usize, f64)]) {
    let n = equations.size();
    let contact = equations.derivatives(u).unwrap();
    let jacobian = equations.assemble(&contact, u).unwrap();
    for &(column, by) in columns {
        let mut lack = |by: f64| {
            let mut u = u.to_vec();
            u[column] += by;
            equations.march(&u).unwrap().lack
        };
        let [ahead, behind] = [lack(by), lack(-by)];
        let found: Vec<f64> = (0..n).map(|i| (ahead[i] - behind[i]) / (2.0 * by)).collect();
        let size = found.iter().map(|f| f * f).sum::<f64>().sqrt();
        let error = (0..n).map(|i| (found[i] - jacobian[(i, column)]).powi(2)).sum::<f64>().sqrt();
        assert!(size > 0.0 && error < 1e-3 * size, "column {column}: {error:e} of {size:e}");
    }
}

/// The assembled Jacobian beside central differences of the equations, for motions that grow with 5 1/s.
#[test]
fn jacobian_is_the_derivative_of_the_equations() {
    let (belt, modes) = (Belt::new(), BeltModes::new(&[OMEGA, 1.63 * OMEGA], &[DAMPING, 15.5]));
    let structure = Structure::new(modes.model(&belt)).unwrap();
    let resolution = Resolution { harmonics: 6, samples: 120 };
    let mut equations = equations(&belt, &structure, resolution, onset());
    let (v, u, ..) = smooth(&mut equations, 0.2);
    let motions = GrowingMotion(belt.conditions(v).unwrap());
    let mut equations = Equations { family: &motions, key: [5.0, 1.0], ..equations };
    let (n, mut u) = (equations.size(), u);
    u[n + 1] = 0.0;
    beside_differences(&mut equations, &u, &[(1, 1e-4), (2, 1e-4), (n, 1e-5), (n + 1, 1e-2)]);
}
