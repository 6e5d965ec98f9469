//! Two balls that roll on elastic half-spaces of their own, each on a mode across: the first one slides on friction
//! that falls with the velocity and sways, the second one is at rest. It changes nothing of the cycle of the first one.
//! And both on one mode, alike: two contacts are one on a mode that moves √2 as far.

use super::*;
use crate::body::half_space::HalfSpace;
use crate::contact::{Loads, PatchKinematics};
use crate::cycles::corrector::Condition;
use crate::friction::PatchFriction;
use crate::transient::PatchDrive;

/// Rolling speed, m/s; angular frequencies of the modes, rad/s, their damping, 1/s, and displacement at their contact,
/// 1/√kg.
const SPEED: f64 = 10.0;
const MODES: [f64; 2] = [2.0 * PI * 300.0, 2.0 * PI * 410.0];
const DAMPED: [f64; 2] = [20.0, 600.0];
const SHAPE: f64 = 0.1;
/// Lateral creepage of the second contact.
const OTHER: f64 = 0.03;
const FEW: Resolution = Resolution { harmonics: 2, samples: 96 };

/// One ball, or both.
struct Balls {
    interface: Interface,
    residual: Mat<f64>,
    shapes: Mat<f64>,
    /// True of balls that are all alike, on one mode.
    alike: bool,
}

impl Balls {
    fn new(count: usize) -> Self {
        let line = |n: usize| (0..n).map(|i| 1.5e-3 * (i as f64 - 0.5 * (n - 1) as f64)).collect::<Vec<f64>>();
        let (x, y) = (line(7), line(5));
        let gap: Vec<f64> = (0..35).map(|i| (x[i % 7].powi(2) + y[i / 7].powi(2)) / 0.6).collect();
        let own = HalfSpace { young: 210e9, poisson: 0.3 }.compliance(&x, &y).unwrap();
        let rows = own.nrows();
        let residual = Mat::from_fn(count * rows, count * rows, |i, j| match i / rows == j / rows {
            true => own[(i % rows, j % rows)],
            false => 0.0,
        });
        let one = || Interface::new(x.clone(), y.clone(), gap.clone()).unwrap();
        let shapes = Mat::from_fn(count * rows, count, |i, k| if i / rows == k && i % 3 == 1 { SHAPE } else { 0.0 });
        Self {
            interface: Interface::joined((0..count).map(|_| one()).collect()).unwrap(),
            residual,
            shapes,
            alike: false,
        }
    }

    /// All balls on one mode, Σψ² being the same for any number of them.
    fn on_one_mode(count: usize) -> Self {
        let alone = Self::new(count);
        let shape = SHAPE * (2.0 / count as f64).sqrt();
        let shapes = Mat::from_fn(alone.residual.nrows(), 1, |i, _| if i % 3 == 1 { shape } else { 0.0 });
        Self { shapes, alike: true, ..alone }
    }

    fn count(&self) -> usize {
        self.interface.patches.len()
    }

    /// True if the ball slides on its mode as the first one does.
    fn sways(&self, patch: usize) -> bool {
        patch == 0 || self.alike
    }

    /// Load, N.
    fn load(&self, patch: usize) -> f64 {
        if self.sways(patch) {
            8e3
        } else {
            6e3
        }
    }
}

/// The key is the lateral creepage of the first contact.
impl Family for Balls {
    fn conditions(&self, key: f64) -> crate::Result<Conditions> {
        let law = Exponential { memory_length: 1e-5, ..Exponential::new(0.4, 0.2, 0.3) };
        let drive = |patch: usize| {
            let lateral = if self.sways(patch) { key } else { OTHER };
            let creepage = ContactCreepage { longitudinal: 0.0, lateral, spin: 0.0 };
            PatchDrive::constant(PatchKinematics { speed: SPEED, creepage })
        };
        let loads: Vec<NormalLoad> = (0..self.count()).map(|patch| NormalLoad::Force(self.load(patch))).collect();
        let loads = Loads::of_patches(&loads);
        // A ball that does not sway rubs by a law of its own, which has no memory.
        let others = (1..self.count()).map(|patch| match self.sways(patch) {
            true => law.clone().into(),
            false => FrictionLaw::Constant(0.25),
        });
        let settings = Settings {
            scheme: Scheme { step: 1e-5, theta: 0.5 },
            friction: PatchFriction::new(law.clone().into(), others.collect()),
            solver: ContactSolver::Newton,
            tolerance: 1e-12,
            drive: Loading::of_loads(&loads, (0..self.count()).map(drive).collect()),
        };
        Ok(Conditions { settings, interface: self.interface.clone(), load: Vec::new() })
    }
}

/// The cycle of the first ball with a given amplitude, its key and its multipliers.
fn cycle(balls: &Balls) -> (f64, PeriodicSolution, Vec<num_complex::Complex<f64>>) {
    let (count, m) = (balls.count(), balls.shapes.ncols());
    // Of two balls on one mode each feeds it as the one alone.
    let on_one = balls.alike;
    let damping = [if on_one { 2.0 * DAMPED[0] } else { DAMPED[0] }, DAMPED[1]];
    let model = Model {
        interface: &balls.interface,
        residual: balls.residual.as_ref(),
        modes: balls.shapes.as_ref(),
        omega: &MODES[..m],
        stiffness: ModalMatrix::squares(&MODES[..m]),
        damping: damping[..m].to_vec().into(),
        turning: None,
        carried: None,
        load: &[],
    };
    let structure = Structure::new(model).unwrap();
    let n = balls.interface.len();
    let key = 0.02;
    let memory = ContactMemory { reaction: vec![0.0; 3 * n], friction: vec![0.3; n], motions: vec![5e-5; count] };
    // The motion is measured by three times that sway.
    let sway = 0.03 / MODES[0];
    let unit = 3.0 * sway * 35f64.sqrt();
    let mut equations = Equations {
        structure: &structure,
        family: balls,
        resolution: FEW,
        unit,
        omega: MODES[0],
        key: [key, 0.01],
        memory,
        marches: 0,
    };
    // The first ball sways with 30 mm/s about where friction, with the sign that creepage has, holds it.
    let of = |u: [f64; 2]| {
        let field: Vec<f64> = (0..3 * n).map(|row| if row % 3 == 1 { u[row / (3 * 35)] } else { 0.0 }).collect();
        structure.projected(&field).into_iter().map(|z| z / unit)
    };
    let mean = |k: usize| match on_one {
        true => -0.5 * balls.load(k) * (SHAPE / MODES[0]).powi(2),
        false => -0.25 * balls.load(k) * (SHAPE / MODES[k]).powi(2),
    };
    let mut u: Vec<f64> = of([mean(0), mean(1)]).collect();
    let first: Vec<f64> = of([sway, if on_one { sway } else { 0.0 }]).collect();
    u.extend(&first);
    u.resize(equations.size(), 0.0);
    u.extend([1.0, 0.0]);
    equations.settle(&u).unwrap();
    let size = first.iter().map(|s| s * s).sum::<f64>().sqrt();
    let mut row = vec![0.0; u.len()];
    first.iter().enumerate().for_each(|(k, s)| row[first.len() + k] = s / size);
    let conditions = [equations.phase(&u), Condition { row, reference: u.clone() }];
    let found = equations.correct(u, &conditions, &mut None).unwrap();
    let key = equations.key_of(&found.u);
    let values = multipliers(&structure, &balls.conditions(key).unwrap(), &found.cycle, FEW).unwrap().values;
    (key, found.cycle, values)
}

#[test]
fn second_contact_at_rest_leaves_the_cycle_as_it_is() {
    let [(key, alone, own), (other, both, all)] = [1, 2].map(|count| cycle(&Balls::new(count)));
    assert!((key / other - 1.0).abs() < 1e-7, "{key} {other}");
    assert!((alone.frequency / both.frequency - 1.0).abs() < 1e-8, "{} {}", alone.frequency, both.frequency);
    assert!((alone.kinetic / both.kinetic - 1.0).abs() < 1e-6, "{} {}", alone.kinetic, both.kinetic);
    let [sway, mean] = alone.contacts[0].sway();
    assert!(sway[1] > 10.0 && mean[1].abs() > 1e3, "{sway:?} {mean:?}");
    for (a, b) in alone.contacts[0].force.iter().zip(&both.contacts[0].force) {
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-3), "{a:?} {b:?}");
    }
    let [sway, mean] = both.contacts[1].sway();
    assert!(sway.iter().all(|s| *s < 1e-3) && (mean[2] + 6e3).abs() < 1e-3, "{sway:?} {mean:?}");
    let near = all.iter().map(|v| (v - own[0]).norm()).fold(f64::INFINITY, f64::min);
    assert!(near < 1e-6 && all.len() > own.len(), "{own:?} {all:?}");
}

/// Two contacts on one mode have the cycle of one contact on a mode that moves √2 as far, with half the energy.
#[test]
fn two_contacts_on_one_mode_are_one_on_a_larger_shape() {
    let [(key, alone, own), (other, both, all)] = [1, 2].map(|count| cycle(&Balls::on_one_mode(count)));
    assert!((key / other - 1.0).abs() < 1e-7, "{key} {other}");
    assert!((alone.frequency / both.frequency - 1.0).abs() < 1e-8, "{} {}", alone.frequency, both.frequency);
    assert!((2.0 * alone.kinetic / both.kinetic - 1.0).abs() < 1e-6, "{} {}", alone.kinetic, both.kinetic);
    let [sway, mean] = alone.contacts[0].sway();
    assert!(sway[1] > 10.0 && mean[1].abs() > 1e3, "{sway:?} {mean:?}");
    for contact in &both.contacts {
        for (a, b) in alone.contacts[0].force.iter().zip(&contact.force) {
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-3), "{a:?} {b:?}");
        }
    }
    let near = all.iter().map(|v| (v - own[0]).norm()).fold(f64::INFINITY, f64::min);
    assert!(near < 1e-6, "{own:?} {all:?}");
}
