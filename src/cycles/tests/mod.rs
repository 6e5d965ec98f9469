//! One mass on a belt, whose friction falls with the velocity and remembers little: a cycle of stick and slip, rest
//! that loses its stability, and the unstable cycles between the two.

use super::*;
use crate::contact::{ContactCreepage, NormalLoad};
use crate::cycles::branch::{follow, solve};
use crate::cycles::corrector::Equations;
use crate::cycles::floquet::multipliers;
use crate::cycles::in_order;
use crate::friction::{Exponential, FrictionLaw};
use crate::grid::Interface;
use crate::model::ModalMatrix;
use crate::transient::stepper::{Settings, State, Stepper};
use crate::transient::{ContactSolver, Loading, Model, Scheme};
use faer::Mat;
use std::f64::consts::PI;

mod belt;
mod damped;
mod free;
mod hulten;
mod located;
mod rolling;
mod rolling_cycle;
mod two_contacts;
mod two_waves;

const OMEGA: f64 = 2.0 * PI * 100.0;
/// Normal force, N, and compliance, m/N.
const LOAD: f64 = 100.0;
const SOFT: f64 = 1e-8;
const DAMPING: f64 = 12.6;
const RESOLUTION: Resolution = Resolution { harmonics: 12, samples: 300 };

/// Belts of all velocities, m/s.
struct Belt(Interface);

impl Belt {
    fn new() -> Self {
        Self(Interface::points(vec![0.0], vec![[0.0; 2]]).unwrap())
    }

    fn law() -> Exponential {
        Exponential { memory_length: 1e-5, ..Exponential::new(0.4, 0.2, 0.3) }
    }

    fn residual() -> Mat<f64> {
        Mat::from_fn(3, 3, |i, j| if i == j { SOFT } else { 0.0 })
    }

    fn modes() -> Mat<f64> {
        Mat::from_fn(3, 1, |i, _| if i == 0 { 1.0 } else { 0.0 })
    }

    fn model<'a>(&'a self, residual: &'a Mat<f64>, modes: &'a Mat<f64>) -> Model<'a> {
        Model {
            interface: &self.0,
            residual: residual.as_ref(),
            modes: modes.as_ref(),
            omega: &[OMEGA],
            stiffness: ModalMatrix::squares(&[OMEGA]),
            damping: vec![DAMPING].into(),
            turning: None,
            carried: None,
            load: &[],
        }
    }
}

impl Family for Belt {
    fn conditions(&self, key: f64) -> crate::Result<Conditions> {
        let settings = Settings {
            scheme: Scheme { step: 1e-5, theta: 0.5 },
            friction: FrictionLaw::from(Self::law()).into(),
            solver: ContactSolver::Newton,
            tolerance: 1e-12,
            drive: Loading::constant(
                NormalLoad::Approach(LOAD * SOFT),
                ContactCreepage { longitudinal: 1.0, lateral: 0.0, spin: 0.0 },
                key,
            ),
        };
        Ok(Conditions { settings, interface: self.0.clone(), load: Vec::new() })
    }
}

/// A stepper that has followed the motion begun with the velocity `a`, m/s, for `time`, s, in steps of a period's
/// share.
fn marched<'a>(belt: &Belt, model: &Model<'a>, v: f64, a: f64, time: f64) -> Stepper<'a> {
    let conditions = belt.conditions(v).unwrap();
    let mu = conditions.settings.friction.law(0).coefficient(v);
    let mut rest = State::at_rest(model, &[-mu * LOAD, 0.0, LOAD], &[LOAD * SOFT]).remembering(&[mu]);
    rest.v[0] += a;
    let step = 2.0 * PI / OMEGA / RESOLUTION.samples as f64;
    let settings = Settings { scheme: Scheme { step, theta: 0.5 }, ..conditions.settings };
    let mut stepper = Stepper::new(model.clone(), settings, rest).unwrap();
    for _ in 0..(time / step) as usize {
        stepper.advance().unwrap();
    }
    stepper
}

/// From the cycle that sticks past where it no longer does up to the fold, and along unstable cycles back to rest where
/// that loses its stability.
#[test]
fn cycles_of_a_mass_on_a_belt_turn_back_at_the_fold_and_end_at_rest() {
    let belt = Belt::new();
    let (residual, modes) = (Belt::residual(), Belt::modes());
    let model = belt.model(&residual, &modes);
    let structure = Structure::new(model.clone()).unwrap();
    let v = 0.62;
    let mut stepper = marched(&belt, &model, v, 1.2 * v, 1.0);
    let z = structure.follow(&mut stepper, RESOLUTION).unwrap();
    let memory = ContactMemory::from_state(stepper.state());
    let unit = z[1..].iter().map(|z| z * z).sum::<f64>().sqrt();
    let mut equations = Equations {
        structure: &structure,
        family: &belt,
        resolution: RESOLUTION,
        unit,
        omega: OMEGA,
        key: [v, 0.2],
        memory,
        marches: 0,
    };
    let mut u: Vec<f64> = z.iter().map(|z| z / unit).collect();
    u.extend([1.0, 0.0]);
    let mut contact = None;
    let found = solve(&mut equations, u, &mut contact).unwrap();
    let conditions = belt.conditions(v).unwrap();
    let multipliers = multipliers(&structure, &conditions, &found.cycle, RESOLUTION).unwrap();
    // It sticks for a while: what deviates is gone within a period.
    assert!(found.cycle.contacts[0].stick()[0] > 0.01 && multipliers.is_stable(), "{multipliers:?}");
    let start = BranchPoint { key: v, u: found.u, cycle: found.cycle, multipliers: Some(multipliers), special: None };
    let extent = BranchExtent { range: [0.3, 0.9], most: 200, longest: 0.1, located: Some(1e-6), stability: true };
    let mut branch = BranchState::new(start.clone(), contact.clone().unwrap(), true, &extent);
    follow(&mut equations, &mut branch, &extent, &mut |_| Ok(true)).unwrap();
    let line = |p: &BranchPoint| {
        let m = p.multipliers.as_ref().map(|m| (m.values[0].norm(), m.phase));
        format!(
            "{:.6} {:.4e} J, stick {:.3}, {m:?} {:?}",
            p.key,
            p.cycle.kinetic,
            p.cycle.contacts[0].stick()[0],
            p.special
        )
    };
    branch.points = in_order(branch.points, structure.rank());
    let text: Vec<String> = branch.points.iter().map(line).collect();
    assert_eq!(branch.end, Some(BranchEnd::Rest), "{text:#?}");
    let kinds = |kind: SpecialKind| branch.points.iter().filter(move |p| p.special.is_some_and(|s| s.kind == kind));
    let folds: Vec<f64> = kinds(SpecialKind::Fold).map(|p| p.key).collect();
    // By Runge and Kutta's method, without compliance, a motion stays at 0.6474 m/s and dies out at 0.6490 m/s.
    assert!(folds.len() == 1 && folds[0] > 0.6474 && folds[0] < 0.6490, "{folds:?} {text:#?}");
    // Slip by slip it no longer comes back to the velocity of the belt above 0.6440 m/s.
    let sticks: Vec<f64> = kinds(SpecialKind::Stick).map(|p| p.key).collect();
    assert!(sticks.len() == 1 && (sticks[0] / 0.6440 - 1.0).abs() < 1e-3, "{sticks:?} {text:#?}");
    let at = branch.points.iter().position(|p| p.special.is_some_and(|s| s.kind == SpecialKind::Fold)).unwrap();
    let (before, after) = (&branch.points[..at], &branch.points[at + 1..]);
    let stable = |p: &BranchPoint| p.multipliers.as_ref().unwrap().is_stable();
    assert!(before.iter().all(stable) && after.iter().all(|p| !stable(p)), "{text:#?}");
    // Small cycles lie where rest is stable, above: squeal jumps.
    let rising = |points: &[BranchPoint], sign: f64| points.windows(2).all(|p| sign * (p[1].key - p[0].key) > 0.0);
    assert!(rising(before, 1.0) && rising(after, -1.0), "{text:#?}");
    // Where friction feeds a small motion what damping takes.
    let onset = 0.3 * (LOAD * 0.2 / (0.3 * DAMPING)).ln();
    let end = branch.points.last().unwrap();
    let small = end.cycle.kinetic / start.cycle.kinetic;
    assert!((onset - 0.4998).abs() < 1e-4 && small < 0.02, "{text:#?}");
    // Small cycles have v = onset + a²·const: two of them lead to the end at rest.
    let [a, b] = [after[after.len() - 2].clone(), end.clone()];
    let at_rest = b.key - (a.key - b.key) / (a.cycle.kinetic - b.cycle.kinetic) * b.cycle.kinetic;
    assert!((at_rest / onset - 1.0).abs() < 1e-3, "{at_rest} {text:#?}");
}
