//! One mass on a belt, whose friction falls with the velocity and remembers little: a cycle of stick and slip beside
//! a rest that is stable.

use super::*;
use crate::contact::{ContactCreepage, NormalLoad};
use crate::friction::{Exponential, FrictionLaw};
use crate::grid::Interface;
use crate::model::ModalMatrix;
use crate::transient::{ContactSolver, Loading, Model, Scheme, Settings as Steps};
use std::f64::consts::PI;

const OMEGA: f64 = 2.0 * PI * 100.0;
const STEP: f64 = 5e-5;
/// Normal force, N, and compliance, m/N.
const LOAD: f64 = 100.0;
const SOFT: f64 = 1e-8;
const STATIC: f64 = 0.4;
const KINETIC: f64 = 0.2;
/// m/s.
const DECAY: f64 = 0.3;
/// m.
const MEMORY: f64 = 1e-5;
/// 1/s: rest is stable above a belt's velocity of some 0.5 m/s.
const DAMPING: f64 = 12.6;

/// I₁ by its series.
fn bessel(x: f64) -> f64 {
    let (mut term, mut sum) = (0.5 * x, 0.0);
    for k in 1..60 {
        sum += term;
        term *= 0.25 * x * x / (f64::from(k) * f64::from(k + 1));
    }
    sum
}

/// Growth rate of a motion whose velocity swings by `a` on a belt of the velocity `v` > a: the means of what friction
/// feeds and damping takes.
fn growth(v: f64, a: f64) -> f64 {
    LOAD * (STATIC - KINETIC) * (-v / DECAY).exp() * bessel(a / DECAY) / a - 0.5 * DAMPING
}

/// Outcome of a motion of the mass, 1 kg, whose velocity swings by `a`, m/s, on a belt of the velocity `v`, m/s.
fn fate(v: f64, a: f64) -> FollowedMotion {
    let kicked = |mut rest: State| {
        rest.v[0] += a;
        rest
    };
    followed(v, kicked).0
}

/// Outcome of the motion that `start` makes of rest on a belt of the velocity `v`, m/s, and where it was at the end.
fn followed(v: f64, start: impl FnOnce(State) -> State) -> (FollowedMotion, State) {
    beside(v, None, start)
}

/// The same with another mode that has nothing to do with the contact: its angular frequency, rad/s, and damping, 1/s.
fn beside(v: f64, other: Option<[f64; 2]>, start: impl FnOnce(State) -> State) -> (FollowedMotion, State) {
    let m = 1 + usize::from(other.is_some());
    let points = Interface::points(vec![0.0], vec![[0.0; 2]]).unwrap();
    let residual = Mat::from_fn(3, 3, |i, j| if i == j { [0.0, SOFT, SOFT][i] } else { 0.0 });
    let modes = Mat::from_fn(3, m, |i, k| if i == 0 && k == 0 { 1.0 } else { 0.0 });
    let omega = &[OMEGA, other.map_or(0.0, |o| o[0])][..m];
    let model = Model {
        interface: &points,
        residual: residual.as_ref(),
        modes: modes.as_ref(),
        omega,
        stiffness: ModalMatrix::squares(omega),
        damping: [DAMPING, other.map_or(0.0, |o| o[1])][..m].to_vec().into(),
        turning: None,
        carried: None,
        load: &[],
    };
    let law = Exponential { memory_length: MEMORY, ..Exponential::new(STATIC, KINETIC, DECAY) };
    let friction = FrictionLaw::from(law);
    let mu = friction.coefficient(v);
    let creepage = ContactCreepage { longitudinal: 1.0, lateral: 0.0, spin: 0.0 };
    let settings = Steps {
        scheme: Scheme { step: STEP, theta: 0.5 },
        friction: friction.into(),
        solver: ContactSolver::Newton,
        tolerance: 1e-12,
        drive: Loading::constant(NormalLoad::Approach(LOAD * SOFT), creepage, v),
    };
    let rest = State::at_rest(&model, &[-mu * LOAD, 0.0, LOAD], &[LOAD * SOFT]).remembering(&[mu]);
    let mut stepper = Stepper::new(model, settings, start(rest.clone())).unwrap();
    stepper.settle().unwrap();
    let search = CycleSettings {
        step: STEP,
        period: 2.0 * PI / OMEGA,
        settled: 1e-3,
        longest: 40.0,
        floor: 1e-6,
        stable: growth(v, 1e-9) < 0.0,
        nodes: [1, 0],
        harmonics: 3,
        watch: Mat::from_fn(1, m, |_, k| if k == 0 { 1.0 } else { 0.0 }),
        heard: None,
    };
    let followed = follow(&mut stepper, &rest, &search).unwrap();
    (followed, stepper.state().clone())
}

/// The amplitude at which the mean of what friction feeds is what damping takes: below it motion dies out.
fn threshold(v: f64) -> f64 {
    let (mut low, mut high) = (1e-6, v);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if growth(v, middle) < 0.0 { &mut low } else { &mut high }) = middle;
    }
    low
}

#[test]
fn beside_a_stable_rest_large_motions_stick_and_stay() {
    let v = 0.56;
    let a = threshold(v);
    assert!(growth(v, 1e-6) < 0.0 && growth(v, v) > 0.0 && a < 0.8 * v, "{a}");
    let (below, above) = (fate(v, 0.9 * a), fate(v, 1.1 * a));
    assert_eq!((below.fate, above.fate), (CycleOutcome::Rest, CycleOutcome::Cycle));
    let (returns, record) = above.motion.unwrap();
    // It moves with the belt for a while: its velocity is that of the belt at most.
    assert!(record.stick[0] > 0.005 && record.stick[1] == 1.0, "{:?}", record.stick);
    let swing = record.spectrum[0][0].norm();
    assert!(swing > v && swing < 1.03 * v, "{swing}");
    assert!((returns.period * OMEGA / (2.0 * PI) - 1.0).abs() < 0.02 && returns.crossings == 1, "{returns:?}");
    // Friction and spring balance, and what it weighs is what is held.
    assert!((record.force[2] + LOAD).abs() < 1e-6, "{:?}", record.force);
    assert!((0.5 * record.velocity[0].powi(2) - record.kinetic).abs() < 1e-3 * record.kinetic);
    assert_eq!(record.closed, 1);
}

/// The same cycle from far above, from just above the threshold, and where rest is unstable from next to nothing: as
/// it would be without shortening the way.
#[test]
fn the_way_to_a_cycle_does_not_matter() {
    let v = 0.4;
    assert!(growth(v, 1e-9) > 1.0);
    let kinetic = |a: f64| {
        let found = fate(v, a);
        assert_eq!(found.fate, CycleOutcome::Cycle, "from {a}");
        found.motion.unwrap().1.kinetic
    };
    let (small, large) = (kinetic(1e-4), kinetic(3.0 * v));
    assert!((small / large - 1.0).abs() < 4e-3, "{small} J, {large} J");
}

/// Beside the stick–slip cycle another mode rings, 3.3 % above its frequency: damped, its beat dies out and the cycle
/// is what it is alone; undamped, it stays and the motion never repeats itself. States one period apart are close to
/// each other in either case.
#[test]
fn a_beat_that_dies_out_leaves_a_cycle_and_one_that_stays_is_irregular() {
    let v = 0.4;
    let ringing = |damping: f64| {
        let start = |mut rest: State| {
            (rest.v[0], rest.v[1]) = (v, 0.3 * v);
            rest
        };
        beside(v, Some([1.033 * OMEGA, damping]), start).0
    };
    let alone = fate(v, v).motion.unwrap().1;
    let (dying, lasting) = (ringing(1.0), ringing(0.0));
    let (returns, record) = dying.motion.unwrap();
    assert_eq!((dying.fate, returns.crossings), (CycleOutcome::Cycle, 1), "{returns:?}");
    assert!((record.kinetic / alone.kinetic - 1.0).abs() < 4e-3, "{} J, {} J", record.kinetic, alone.kinetic);
    let (returns, _) = lasting.motion.unwrap();
    assert_eq!((lasting.fate, returns.crossings), (CycleOutcome::Irregular, 0), "{returns:?}");
    assert!(returns.apart > 0.2 && lasting.time < 0.5 * dying.time + 20.0, "{returns:?} {} s", lasting.time);
}

/// Beyond the fold nothing remains, however large the motion.
#[test]
fn beyond_the_fold_every_motion_dies_out() {
    let v = 0.8;
    assert!(growth(v, v) < 0.0);
    assert_eq!(fate(v, 1.5 * v).fate, CycleOutcome::Rest);
}

/// Largest velocity of the belt, m/s, at which the mass goes on coming back to the velocity of the belt, slip by
/// slip, each begun where friction as it is then lets go: displacement, velocity and remembered friction by Runge and
/// Kutta's method, stick in closed form, a contact without compliance.
fn fold(memory: f64) -> f64 {
    let returns = |v: f64| {
        let rate = |[x, u, mu]: [f64; 3]| {
            let slip = v - u;
            let steady = KINETIC + (STATIC - KINETIC) * (-slip.abs() / DECAY).exp();
            [u, LOAD * mu - DAMPING * u - OMEGA * OMEGA * x, slip.abs() / memory * (steady - mu)]
        };
        let h = 1e-6;
        let mut mu = STATIC;
        'slip: for _ in 0..60 {
            let mut y = [(LOAD * mu - DAMPING * v) / (OMEGA * OMEGA), v, mu];
            // Some periods more than one: where the swing grows it may come back later.
            for step in 0..(5.0 * 2.0 * PI / OMEGA / h) as usize {
                let ahead = |d: [f64; 3], by: f64| std::array::from_fn(|i| y[i] + by * d[i]);
                let a = rate(y);
                let b = rate(ahead(a, 0.5 * h));
                let c = rate(ahead(b, 0.5 * h));
                let d = rate(ahead(c, h));
                (0..3).for_each(|i| y[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
                if step > 10 && y[1] >= v {
                    mu = y[2];
                    continue 'slip;
                }
            }
            return false;
        }
        true
    };
    let (mut low, mut high) = (0.4, 1.0);
    assert!(returns(low) && !returns(high));
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        *(if returns(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}

/// Handed on from belt to faster belt the cycle lives up to the fold; handed on from belt to slower belt rest lives
/// down to where it loses its stability. Between the two there are both.
#[test]
fn squeal_ends_and_begins_at_different_velocities() {
    // Where small motions feed on friction what damping takes.
    let onset = DECAY * (LOAD * (STATIC - KINETIC) / (DECAY * DAMPING)).ln();
    let fold = fold(MEMORY);
    assert!(growth(0.999 * onset, 1e-6) > 0.0 && growth(1.001 * onset, 1e-6) < 0.0);
    assert!(fold > 1.1 * onset, "fold at {fold} m/s, onset at {onset} m/s");
    let step = 0.005;
    let along = |from: f64, step: f64, first: CycleOutcome, start: f64| {
        let (mut v, mut last) = (from, None);
        for _ in 0..200 {
            let (found, state) = followed(v, |mut rest| {
                // A little disturbance, so that what is unstable shows.
                rest.v[0] += start;
                last.take().unwrap_or(rest)
            });
            if found.fate != first {
                return [v - step, v];
            }
            last = (first == CycleOutcome::Cycle).then_some(state);
            v += step;
        }
        panic!("nothing changes up to {v} m/s");
    };
    let up = along(0.9 * fold, step, CycleOutcome::Cycle, 1.5 * fold);
    let down = along(1.06 * onset, -step, CycleOutcome::Rest, 1e-4);
    // Half a hundredth: what memory and compliance of the contact take.
    assert!(
        up[0] < 1.005 * fold && up[1] > 0.995 * fold,
        "the cycle ends between {up:?} m/s, the fold is at {fold} m/s"
    );
    assert!(
        down[1] < 1.005 * onset && down[0] > 0.995 * onset,
        "rest ends between {down:?} m/s, expected at {onset} m/s"
    );
}
