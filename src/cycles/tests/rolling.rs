//! An elastic half-space that rolls under a ball, moved along y and about it: the linearised march beside differences
//! of marches, where nodes stick, slip, come into contact and leave it.

use super::*;
use crate::body::half_space::HalfSpace;
use crate::cycles::balance::Balance;

/// Rolling speed, m/s, and frequency of the motion, rad/s.
const SPEED: f64 = 10.0;
const RATE: f64 = 2.0 * PI * 1000.0;
const FEW: Resolution = Resolution { harmonics: 1, samples: 48 };

/// Contact nodes with their compliance, m/N, and two motions of all nodes, 1/√kg.
struct Rolling {
    interface: Interface,
    residual: Mat<f64>,
    shapes: Mat<f64>,
    load: NormalLoad,
    friction: FrictionLaw,
}

impl Rolling {
    fn new(load: NormalLoad, friction: FrictionLaw) -> Self {
        let line = |n: usize| (0..n).map(|i| 7e-4 * (i as f64 - 0.5 * (n - 1) as f64)).collect::<Vec<f64>>();
        let (x, y) = (line(17), line(13));
        let gap = (0..x.len() * y.len()).map(|i| (x[i % 17].powi(2) + y[i / 17].powi(2)) / 0.6).collect();
        let residual = HalfSpace { young: 210e9, poisson: 0.3 }.compliance(&x, &y).unwrap();
        let tilt = |i: usize| 0.3 + x[i % 17] / 5e-3;
        let shape = |row: usize, k: usize| match (row % 3, k) {
            (1, 0) => 1.0,
            (2, 1) => tilt(row / 3),
            _ => 0.0,
        };
        let shapes = Mat::from_fn(residual.nrows(), 2, shape);
        Self { interface: Interface::new(x, y, gap).unwrap(), residual, shapes, load, friction }
    }

    fn conditions(&self) -> Conditions {
        let creepage = ContactCreepage { longitudinal: 1e-3, lateral: 3e-3, spin: 0.1 };
        let settings = Settings {
            scheme: Scheme { step: 1e-5, theta: 0.5 },
            friction: self.friction.clone().into(),
            solver: ContactSolver::Newton,
            tolerance: 1e-12,
            drive: Loading::constant(self.load, creepage, SPEED),
        };
        Conditions { settings, interface: self.interface.clone(), load: Vec::new() }
    }
}

/// Derivatives of the forces with respect to the motion, the largest difference from central differences relative to
/// their size.
fn error(rolling: &Rolling) -> f64 {
    let omega = [RATE, 1.3 * RATE];
    let model = Model {
        interface: &rolling.interface,
        residual: rolling.residual.as_ref(),
        modes: rolling.shapes.as_ref(),
        omega: &omega,
        stiffness: ModalMatrix::squares(&omega),
        damping: vec![10.0, 10.0].into(),
        turning: None,
        carried: None,
        load: &[],
    };
    let structure = Structure::new(model).unwrap();
    let conditions = rolling.conditions();
    let n = rolling.interface.len();
    let mu = rolling.friction.coefficient(0.0);
    let remembered = if rolling.friction.is_constant() { Vec::new() } else { vec![mu; n] };
    let mut memory = ContactMemory { reaction: vec![0.0; 3 * n], friction: remembered, motions: vec![2e-5] };
    let mut balance = Balance::new(&structure, &conditions, FEW, 1.0, &memory).unwrap();
    // The ball sways by some 10 µm across, and nods so that the edge moves by a node and more.
    let sway = |direction: [f64; 2], i: usize, c: usize| direction[c] * if i == 0 { 1e-5 } else { 2e-6 };
    let of = |displacement: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        let field: Vec<f64> =
            (0..3 * n).map(|row| (0..2).map(|k| rolling.shapes[(row, k)] * displacement(k, row)).sum()).collect();
        structure.projected(&field)
    };
    let mut z = vec![0.0; 2];
    z.extend(of(&|k, _| sway([1.0, 0.4], k, 0)));
    z.extend(of(&|k, _| sway([0.2, 1.0], k, 1)));
    for _ in 0..4 {
        memory = balance.march(&z, RATE, &memory).unwrap().memory;
    }
    let base = balance.march(&z, RATE, &memory).unwrap();
    let [mean, most] = {
        let cycle = structure.solution(base, 1).unwrap();
        let closed = cycle.contacts[0].nodes.iter().map(|n| n[0]);
        assert!(closed.clone().max() > closed.min(), "the edge does not move");
        cycle.contacts[0].stick()
    };
    assert!(mean > 0.02 && mean < 0.9 && most > mean + 0.02, "stick {mean}, {most}");
    let found = balance.force_derivative(&z, RATE, &memory).unwrap();
    let (mut worst, mut size) = (0.0f64, 0.0f64);
    for column in 0..z.len() {
        let by = 4e-11;
        let mut at = |sign: f64| {
            let mut there = z.clone();
            there[column] += sign * by;
            balance.march(&there, RATE, &memory).unwrap().coefficients
        };
        let (more, less) = (at(1.0), at(-1.0));
        for row in 0..z.len() {
            let difference = (more[row] - less[row]) / (2.0 * by);
            size = size.max(difference.abs());
            worst = worst.max((difference - found[(row, column)]).abs());
        }
    }
    worst / size
}

#[test]
fn linearised_march_is_the_derivative_of_a_march() {
    let law = Exponential { memory_length: 3e-4, ..Exponential::new(0.4, 0.2, 0.3) };
    for (load, friction, bound) in [
        (NormalLoad::Force(8e3), FrictionLaw::Constant(0.3), 1e-5),
        (NormalLoad::Approach(2.2e-5), FrictionLaw::from(law), 1e-5),
    ] {
        let error = error(&Rolling::new(load, friction));
        assert!(error < bound, "{error:e}");
    }
}
