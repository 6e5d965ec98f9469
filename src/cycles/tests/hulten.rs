//! Hultén's oscillator with dry friction (S. Hultén, SAE Technical Paper 932965, 1993): a mass between two belts, whose
//! contact points are pressed to them by springs. Flutter grows until a point sticks to its belt; the cycle that it
//! ends in beside an integration from slip to slip, without compliance along the belts.
//!
//! ä + c ȧ + w a = p₁ + μ p₂ sgn(v − ȧ),  b̈ + c ḃ + w b = p₂ − μ p₁ sgn(v + ḃ),  p₁ = k₁ (d − a),  p₂ = k₂ (d − b)

use super::*;

/// w, k₁ and k₂, 1/s²; c, 1/s; d, m; v, m/s; μ.
const GROUND: f64 = 0.6 * OMEGA * OMEGA;
const SPRINGS: [f64; 2] = [0.4 * OMEGA * OMEGA, 0.42 * OMEGA * OMEGA];
const DAMPED: f64 = 50.0;
const PRESSED: f64 = 1e-3;
const SPEED: f64 = 0.1;
const FRICTION: f64 = 0.3;

/// The motion a, ȧ, b, ḃ from slip to slip.
struct SlipBySlip {
    x: [f64; 4],
    /// Direction of the sliding at both points; 0 where it sticks.
    sliding: [f64; 2],
}

impl SlipBySlip {
    /// Normal forces.
    fn pressure(x: [f64; 4]) -> [f64; 2] {
        [SPRINGS[0] * (PRESSED - x[0]), SPRINGS[1] * (PRESSED - x[2])]
    }

    /// Velocities over the belts: of the first point, which moves with b, and of the second one, against a.
    fn slip(x: [f64; 4]) -> [f64; 2] {
        [SPEED + x[3], SPEED - x[1]]
    }

    /// Tractions that hold the points to their belts.
    fn holding(x: [f64; 4]) -> [f64; 2] {
        let p = Self::pressure(x);
        [DAMPED * x[3] + GROUND * x[2] - p[1], p[0] - DAMPED * x[1] - GROUND * x[0]]
    }

    fn rate(&self, x: [f64; 4]) -> [f64; 4] {
        let (p, held) = (Self::pressure(x), Self::holding(x));
        let t = [0, 1].map(|k| if self.sliding[k] == 0.0 { held[k] } else { -FRICTION * p[k] * self.sliding[k] });
        [x[1], p[0] - t[1] - DAMPED * x[1] - GROUND * x[0], x[3], p[1] + t[0] - DAMPED * x[3] - GROUND * x[2]]
    }

    /// By Runge and Kutta's method.
    fn moved(&self, h: f64) -> [f64; 4] {
        let plus = |x: [f64; 4], k: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| x[i] + h * k[i]);
        let a = self.rate(self.x);
        let b = self.rate(plus(self.x, a, 0.5 * h));
        let c = self.rate(plus(self.x, b, 0.5 * h));
        let d = self.rate(plus(self.x, c, h));
        [0, 1, 2, 3].map(|i| self.x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    }

    /// One step, in pieces where a point begins to stick or to slide.
    fn step(&mut self, h: f64) {
        let mut left = h;
        for _ in 0..8 {
            let (next, slip) = (self.moved(left), Self::slip(self.x));
            let beyond = Self::slip(next);
            let part = |k: usize| match self.sliding[k] != 0.0 && beyond[k] * self.sliding[k] < 0.0 {
                true => slip[k] / (slip[k] - beyond[k]),
                false => f64::INFINITY,
            };
            let first = if part(0) <= part(1) { 0 } else { 1 };
            let way = part(first);
            if way.is_infinite() {
                self.x = next;
                break;
            }
            self.x = self.moved(way * left);
            self.sliding[first] = 0.0;
            // It comes to rest on its belt.
            if first == 0 {
                self.x[3] = -SPEED;
            } else {
                self.x[1] = SPEED;
            }
            self.release();
            left *= 1.0 - way;
        }
        self.release();
    }

    /// Points slide that more than friction would have to hold.
    fn release(&mut self) {
        let (p, held) = (Self::pressure(self.x), Self::holding(self.x));
        for k in 0..2 {
            if self.sliding[k] == 0.0 && held[k].abs() > FRICTION * p[k] {
                self.sliding[k] = -held[k].signum();
            }
        }
    }
}

/// Frequency, Hz, mean kinetic energy, J, and share of the time in which a point sticks, of the motion in the end.
fn slip_by_slip(time: f64) -> [f64; 3] {
    let h = 1e-6;
    let mut motion = SlipBySlip { x: [0.0, 1e-3, 0.0, 0.0], sliding: [1.0; 2] };
    let (mut kinetic, mut sticks, mut crossings) = (0.0, 0, Vec::new());
    let steps = (time / h) as usize;
    for step in 0..steps {
        let before = motion.x[3];
        motion.step(h);
        assert!(SlipBySlip::pressure(motion.x).iter().all(|p| *p > 0.0), "it lifts off");
        if step < steps / 2 {
            continue;
        }
        if before < 0.0 && motion.x[3] >= 0.0 {
            crossings.push((step as f64 + before / (before - motion.x[3])) * h);
        }
        if (1..=20).contains(&crossings.len()) {
            kinetic += 0.5 * (motion.x[1].powi(2) + motion.x[3].powi(2)) * h;
            sticks += usize::from(motion.sliding.contains(&0.0));
        }
    }
    let [first, last] = [crossings[0], crossings[20]];
    [20.0 / (last - first), kinetic / (last - first), sticks as f64 * h / (last - first)]
}

struct Belts(Interface);

impl Family for Belts {
    fn conditions(&self, _key: f64) -> crate::Result<Conditions> {
        let settings = Settings {
            scheme: Scheme { step: 1e-5, theta: 0.5 },
            friction: FrictionLaw::Constant(FRICTION).into(),
            solver: ContactSolver::Newton,
            tolerance: 1e-12,
            drive: Loading::constant(
                NormalLoad::Approach(PRESSED),
                ContactCreepage { longitudinal: 0.0, lateral: 0.0, spin: 0.0 },
                0.0,
            ),
        };
        Ok(Conditions { settings, interface: self.0.clone(), load: Vec::new() })
    }
}

/// The cycle of points with a compliance `along` their belts, m/N: frequency, Hz, mean kinetic energy, J, share of the
/// time in which a point sticks; and whether it is stable.
fn cycle(along: f64, fine: Resolution) -> ([f64; 3], bool) {
    let belts = Belts(Interface::points(vec![0.0; 2], vec![[SPEED, 0.0]; 2]).unwrap());
    let residual = Mat::from_fn(6, 6, |i, j| match (i == j, i % 3) {
        (true, 2) => 1.0 / SPRINGS[i / 3],
        (true, _) => along,
        (false, _) => 0.0,
    });
    // a moves the first point off its belt and the second one against its own, b the other way round.
    let modes = Mat::from_fn(6, 2, |i, k| match (i, k) {
        (2, 0) | (0, 1) | (5, 1) => 1.0,
        (3, 0) => -1.0,
        _ => 0.0,
    });
    let omega = [GROUND.sqrt(); 2];
    let model = Model {
        interface: &belts.0,
        residual: residual.as_ref(),
        modes: modes.as_ref(),
        omega: &omega,
        stiffness: ModalMatrix::squares(&omega),
        damping: vec![DAMPED; 2].into(),
        turning: None,
        carried: None,
        load: &[],
    };
    let structure = Structure::new(model.clone()).unwrap();
    let conditions = belts.conditions(0.0).unwrap();
    let p = SPRINGS.map(|k| k * PRESSED);
    let reaction = [-FRICTION * p[0], 0.0, p[0], -FRICTION * p[1], 0.0, p[1]];
    let mut rest = State::at_rest(&model, &reaction, &[PRESSED]);
    rest.v[0] += 1e-2;
    let step = 2.0 * PI / OMEGA / fine.samples as f64;
    let settings = Settings { scheme: Scheme { step, theta: 0.5 }, ..conditions.settings.clone() };
    let mut stepper = Stepper::new(model, settings, rest).unwrap();
    for _ in 0..(1.0 / step) as usize {
        stepper.advance().unwrap();
    }
    let z = structure.follow(&mut stepper, fine).unwrap();
    let state = stepper.state();
    let memory =
        ContactMemory { reaction: state.reaction.clone(), friction: Vec::new(), motions: state.motions.clone() };
    let unit = z[2..].iter().map(|z| z * z).sum::<f64>().sqrt();
    let mut equations = Equations {
        structure: &structure,
        family: &belts,
        resolution: fine,
        unit,
        omega: OMEGA,
        key: [0.0, 1.0],
        memory,
        marches: 0,
    };
    let mut u: Vec<f64> = z.iter().map(|z| z / unit).collect();
    u.extend([1.0, 0.0]);
    let found = solve(&mut equations, u, &mut None).unwrap().cycle;
    let nodes = &found.contacts[0].nodes;
    let stick = nodes.iter().filter(|n| n[1] > 0).count() as f64 / nodes.len() as f64;
    let values = multipliers(&structure, &conditions, &found, fine).unwrap();
    ([found.frequency, found.kinetic, stick], values.is_stable())
}

/// Points that yield along their belts ring while they stick, and slip for moments: the difference falls with the first
/// order of the compliance.
#[test]
fn cycle_of_hultens_oscillator_is_that_from_slip_to_slip() {
    let known = slip_by_slip(3.0);
    let fine = Resolution { harmonics: 60, samples: 1600 };
    let (soft, hard) = (cycle(4e-9, fine), cycle(2e-9, fine));
    let found = [0, 1].map(|k| 2.0 * hard.0[k] - soft.0[k]);
    let text = format!("{found:?}, slip by slip {known:?}, {soft:?}, {hard:?}");
    assert!(hard.1 && soft.1 && known[2] > 0.1 && hard.0[2] > 0.1, "{text}");
    assert!((found[0] / known[0] - 1.0).abs() < 1e-4, "{text}");
    assert!((found[1] / known[1] - 1.0).abs() < 2e-3, "{text}");
}
