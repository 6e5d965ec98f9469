//! A mass that sways across a belt which nothing holds along its motion: as a wheelset, the belt goes as fast as the
//! constant force lets it that drives it at rest.

use super::belt::beside_differences;
use super::*;
use crate::body::rotation::RotationTerms;
use crate::cycles::floquet::{through_kernel, through_modes};

/// Velocity of the belt along itself at rest, of that across, and its mass, kg.
const ALONG: f64 = 0.25;
const BELT: f64 = 5.0;
/// Damping of the belt by its mass, 1/s.
const RESISTED: f64 = 4.0;
/// Angular frequency of a mode behind the mass, rad/s, and how far it moves the mass along the normal, 1/√kg.
const BEHIND: f64 = 2.0 * PI * 310.0;
const LIFT: f64 = 0.02;
const FEW: Resolution = Resolution { harmonics: 16, samples: 400 };

/// The mass across, the belt along itself, and a mode along the normal that gyroscopic forces couple with the belt.
struct FreeBelt {
    interface: Interface,
    residual: Mat<f64>,
    modes: Mat<f64>,
    omega: Vec<f64>,
    damping: Mat<f64>,
}

impl FreeBelt {
    /// With the gyroscopic coupling `turning`, 1/s.
    fn new(turning: f64) -> Self {
        let modes = [[0.0, 1.0, 0.0], [-1.0 / BELT.sqrt(), 0.0, 0.0], [0.0, 0.0, LIFT]];
        let damping = [[DAMPING, 0.0, 0.0], [0.0, RESISTED, turning], [0.0, -turning, 30.0]];
        Self {
            interface: Interface::points(vec![0.0], vec![[0.0; 2]]).unwrap(),
            residual: Belt::residual(),
            modes: Mat::from_fn(3, 3, |i, k| modes[k][i]),
            omega: vec![OMEGA, 0.0, BEHIND],
            damping: Mat::from_fn(3, 3, |i, j| damping[i][j]),
        }
    }

    fn model<'a>(&'a self, load: &'a [f64]) -> Model<'a> {
        let dissipation = Mat::from_fn(3, 3, |i, j| if i == j { self.damping[(i, j)] } else { 0.0 });
        Model {
            interface: &self.interface,
            residual: self.residual.as_ref(),
            modes: self.modes.as_ref(),
            omega: &self.omega,
            stiffness: ModalMatrix::squares(&self.omega),
            damping: self.damping.clone().into(),
            turning: Some(RotationTerms::none(dissipation.into())),
            carried: None,
            load,
        }
    }

    /// Reactions at rest at the velocity `v` across, and its coefficient of friction.
    fn rest(&self, v: f64) -> ([f64; 3], f64) {
        let mu = FrictionLaw::from(Belt::law()).coefficient(v * ALONG.hypot(1.0));
        let pull = mu * LOAD / ALONG.hypot(1.0);
        ([-ALONG * pull, -pull, LOAD], mu)
    }

    /// Load of the modes that keeps the belt at rest at this velocity.
    fn load(&self, v: f64) -> Vec<f64> {
        let (reaction, _) = self.rest(v);
        vec![0.0, -self.modes[(0, 1)] * reaction[0], 0.0]
    }
}

impl Family for FreeBelt {
    fn conditions(&self, key: f64) -> crate::Result<Conditions> {
        let conditions = Belt::new().conditions(key)?;
        // A mean displacement along the normal would change the approach: the rest is a little beside.
        let creepage = ContactCreepage { longitudinal: ALONG, lateral: 1.0, spin: 0.0 };
        let drive = Loading::constant(NormalLoad::Approach(LOAD * SOFT), creepage, key);
        let settings = Settings { drive, ..conditions.settings };
        Ok(Conditions { settings, interface: self.interface.clone(), load: self.load(key) })
    }
}

/// Quantities of a march over whole periods of the mass: frequency, Hz, mean kinetic energy beside the mean velocity of
/// the belt, J, and this velocity, m √kg/s.
fn measured(stepper: &mut Stepper<'_>, step: f64, periods: usize) -> [f64; 3] {
    let (mut time, mut sums, mut count) = (Vec::new(), [0.0; 2], 0.0);
    let mut before = stepper.state().v[0];
    let mut n = 0.0;
    while time.len() <= periods {
        stepper.advance().unwrap();
        let v = &stepper.state().v;
        n += 1.0;
        if before < 0.0 && v[0] >= 0.0 {
            time.push(n - v[0] / (v[0] - before));
        }
        before = v[0];
        if !time.is_empty() {
            let squares = v.iter().map(|v| v * v).sum::<f64>();
            [squares, v[1]].iter().zip(&mut sums).for_each(|(a, sum)| *sum += a);
            count += 1.0;
        }
    }
    let [squares, mean] = sums.map(|sum| sum / count);
    let period = (time[periods] - time[0]) * step / periods as f64;
    [1.0 / period, 0.5 * (squares - mean * mean), mean]
}

/// Newton's method from a marched motion ends at the cycle that the march has: with its frequency, its energy and the
/// mean velocity of the belt, which gyroscopic forces of this velocity change by way of the normal force.
#[test]
fn belt_that_nothing_holds_goes_as_a_march_says() {
    let v = 0.3;
    let mut found = Vec::new();
    for turning in [0.0, 40.0] {
        let belt = FreeBelt::new(turning);
        let load = belt.load(v);
        let model = belt.model(&load);
        let structure = Structure::new(model.clone()).unwrap();
        let (reaction, mu) = belt.rest(v);
        let mut rest = State::at_rest(&model, &reaction, &[LOAD * SOFT]).remembering(&[mu]);
        rest.v[0] += 1.2 * v;
        let step = 2.0 * PI / OMEGA / FEW.samples as f64;
        let settings = Settings { scheme: Scheme { step, theta: 0.5 }, ..belt.conditions(v).unwrap().settings };
        let mut stepper = Stepper::new(model.clone(), settings, rest).unwrap();
        (0..400 * FEW.samples).for_each(|_| stepper.advance().unwrap());
        let [frequency, kinetic, drift] = measured(&mut stepper, step, 50);
        let z = structure.follow(&mut stepper, FEW).unwrap();
        let memory = ContactMemory::from_state(stepper.state());
        let unit = z[structure.rank()..].iter().map(|z| z * z).sum::<f64>().sqrt();
        let mut equations = Equations {
            structure: &structure,
            family: &belt,
            resolution: FEW,
            unit,
            omega: OMEGA,
            key: [v, 0.2],
            memory,
            marches: 0,
        };
        let mut u: Vec<f64> = z.iter().map(|z| z / unit).collect();
        u.extend([1.0, 0.0]);
        let mut contact = None;
        let solved = solve(&mut equations, u, &mut contact).unwrap();
        let cycle = &solved.cycle;
        // As the march counts it, in steps.
        let own = cycle.omega / (2.0 * PI);
        println!("{turning}: {frequency} {kinetic} {drift}; {own} {} {}", cycle.kinetic, cycle.drift);
        assert!((own / frequency - 1.0).abs() < 1e-6, "{own} {frequency}");
        assert!((cycle.kinetic / kinetic - 1.0).abs() < 1e-4, "{} {kinetic}", cycle.kinetic);
        assert!(drift.abs() > 1e-2 && (cycle.drift / drift - 1.0).abs() < 1e-4, "{} {drift}", cycle.drift);
        // The mean force on the belt is the one at rest and what its damping takes.
        let along = cycle.contacts[0].sway()[1][0];
        let wanted = reaction[0] + RESISTED * cycle.drift / belt.modes[(0, 1)];
        assert!((along / wanted - 1.0).abs() < 1e-6, "{along} {wanted}");
        let conditions = belt.conditions(v).unwrap();
        let [own, kernel] = [
            through_modes(&structure, &conditions, cycle, FEW.samples).unwrap(),
            through_kernel(&structure, &conditions, cycle, FEW).unwrap(),
        ];
        println!("{own:?} {kernel:?}");
        assert!(own.is_stable() && (own.phase - 1.0).norm() < 1e-4, "{own:?}");
        assert!((own.values[0] - kernel.values[0]).norm() < 1e-4, "{own:?} {kernel:?}");
        let n = equations.size();
        let r = structure.rank();
        beside_differences(&mut equations, &solved.u, &[(0, 1e-4), (r - 1, 1e-4), (r, 1e-4), (n, 1e-5), (n + 1, 1e-4)]);
        found.push(cycle.drift);
    }
    assert!((found[1] / found[0] - 1.0).abs() > 1e-3, "{found:?}");
}

/// Two motions that nothing holds are refused.
#[test]
fn two_motions_that_nothing_holds_are_refused() {
    let mut belt = FreeBelt::new(0.0);
    belt.omega[0] = 0.0;
    let load = belt.load(0.5);
    let refused = Structure::new(belt.model(&load)).map(|_| ()).unwrap_err();
    assert!(refused.message().contains("found 2 motions that nothing holds"), "{refused}");
}
