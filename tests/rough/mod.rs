//! Rough surfaces in the transient: two half-spaces, each on a mass with a spring and a dashpot.

use super::{near, settings, PI};
use faer::Mat;
use num_complex::Complex64;
use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::{ContactCreepage, NormalLoad};
use railsqueal::grid::Interface;
use railsqueal::model::combined_compliance;
use railsqueal::roughness::{RoughSurfaces, RoughnessFeature, RoughnessShape};
use railsqueal::transient::loading::{History, Loading, Normal};
use railsqueal::transient::{Model, Settings, State, Stepper};

const STEP: f64 = 4e-6;
/// Approach of the bodies, m, of which the contact has about a third.
const APPROACH: f64 = 1e-4;
/// Masses, kg, angular frequencies, rad/s, and damping, 1/s.
const MASS: [f64; 2] = [60.0, 25.0];
const OMEGA: [f64; 2] = [2.0 * PI * 500.0, 2.0 * PI * 800.0];
const DAMPING: [f64; 2] = [3000.0, 4000.0];

struct Pair {
    interface: Interface,
    residual: Mat<f64>,
    modes: Mat<f64>,
}

impl Pair {
    fn new() -> Self {
        let interface = Interface::paraboloid(17, 17, [8e-3; 2], [4.0; 2]).unwrap();
        let steel = HalfSpace { young: 205e9, poisson: 0.3 };
        let c = steel.compliance(&interface.patches[0].x, &interface.patches[0].y).unwrap();
        let residual = combined_compliance(c.as_ref(), c.as_ref()).unwrap();
        let rows = 3 * interface.len();
        let modes = Mat::from_fn(rows, 2, |i, k| if i % 3 == 2 { 1.0 / MASS[k].sqrt() } else { 0.0 });
        Self { interface, residual, modes }
    }

    fn model(&self) -> Model<'_> {
        Model {
            interface: &self.interface,
            residual: self.residual.as_ref(),
            modes: self.modes.as_ref(),
            omega: &OMEGA,
            stiffness: OMEGA.map(|w| w * w).to_vec().into(),
            damping: DAMPING.to_vec().into(),
            turning: None,
            carried: None,
            load: &[],
        }
    }

    fn settings(&self, approach: f64, speed: f64) -> Settings {
        settings(STEP, Loading::constant(NormalLoad::Approach(approach), ContactCreepage::default(), speed), 0.0)
    }

    /// At rest, pressed together without roughness: the springs and the contact in balance after a while.
    fn pressed(&self, approach: f64) -> State {
        let model = self.model();
        let start = State::at_rest(&model, &vec![0.0; 3 * self.interface.len()], &[1e-6]);
        // Slowly, so that the contact has no more than its share at any time.
        let history = History::table("approach", &[[0.0, 1e-6], [0.02, approach], [0.04, approach]], 0.04).unwrap();
        let mut settings = self.settings(approach, 0.0);
        settings.drive.motions[0].normal = Normal::Approach(history);
        let mut stepper = Stepper::new(model, settings, start).unwrap();
        (0..8000).for_each(|_| stepper.advance().unwrap());
        let state = stepper.state();
        let model = self.model();
        State::at_rest(&model, &state.reaction, &[approach])
    }
}

fn force(state: &State) -> f64 {
    state.reaction.iter().skip(2).step_by(3).sum()
}

fn rough(part: RoughnessShape, at: f64, speed: f64) -> RoughSurfaces {
    let part = RoughnessFeature::Shape { shape: part, at, period: None };
    RoughSurfaces { speed, onset: 0.1, parts: [vec![part], vec![]], ahead: [0.0; 2] }
}

/// F = r / (α1 + α2 + α_c) with the receptances of the bodies and the compliance of the contact, which comes from two
/// approaches; amplitude and phase.
#[test]
fn small_waves_make_the_force_that_receptances_and_contact_stiffness_predict() {
    let (pair, amplitude, wavelength) = (Pair::new(), 2e-8, 0.25);
    let start = pair.pressed(APPROACH);
    let load = force(&start);
    let statics: f64 = (0..2).map(|k| 1.0 / (MASS[k] * OMEGA[k].powi(2))).sum();
    // What the contact yields more than the springs, between approaches a wave's height apart.
    let bent = 1e-7;
    let more = force(&pair.pressed(APPROACH + bent)) - force(&pair.pressed(APPROACH - bent));
    let contact = 2.0 * bent / more - statics;
    assert!(contact > 1e-10 && contact < statics, "{contact:e} m/N beside {statics:e} m/N");
    for frequency in [300.0, 600.0, 1000.0] {
        let (omega, speed) = (2.0 * PI * frequency, frequency * wavelength);
        let surface = rough(RoughnessShape::Wave { length: wavelength, height: amplitude }, 0.0, speed);
        let mut stepper = Stepper::new(pair.model(), pair.settings(APPROACH, speed), start.clone())
            .unwrap()
            .rough(vec![surface])
            .unwrap();
        // Eight periods of the scheme's steps after all has come in.
        let count = (8.0 / frequency / STEP).round() as usize;
        (0..4000).for_each(|_| stepper.advance().unwrap());
        let mut sum = Complex64::default();
        for _ in 0..count {
            stepper.advance().unwrap();
            let turn = Complex64::from_polar(1.0, -omega * stepper.time());
            sum += turn * (-stepper.report().force()[2] - load) * (2.0 / count as f64);
        }
        let body = |k: usize| 1.0 / (MASS[k] * Complex64::new(OMEGA[k].powi(2) - omega * omega, omega * DAMPING[k]));
        // r = A sin ωt.
        let want = Complex64::new(0.0, -amplitude) / (body(0) + body(1) + contact);
        let off = (sum - want).norm() / want.norm();
        assert!(off < 0.02, "{frequency} Hz: {sum} N, expected {want} N: off by {off:.4}");
        let e = stepper.state().energy;
        assert!(e.residual().abs() < 0.02 * e.damping, "balance {:e} of {e:?}", e.residual());
    }
}

/// Over a flat the contact opens and closes with a blow; the energies balance. A run that is continued is the same to
/// the last bit.
#[test]
fn a_flat_opens_the_contact_and_strikes() {
    let (pair, speed) = (Pair::new(), 20.0);
    let start = pair.pressed(APPROACH);
    let load = force(&start);
    let surface = || rough(RoughnessShape::RoundedFlat { length: 0.04, depth: 6e-4 }, 0.2, speed);
    let stepper = |state: State| Stepper::new(pair.model(), pair.settings(APPROACH, speed), state).unwrap();
    let mut run = stepper(start).rough(vec![surface()]).unwrap();
    let mut again = None;
    let (mut open, mut highest) = (0, 0.0f64);
    for step in 1..=5000 {
        run.advance().unwrap();
        if let Some(again) = &mut again {
            let again: &mut Stepper<'_> = again;
            again.advance().unwrap();
        }
        if step == 2500 {
            // In the middle of the flat.
            run.reset().unwrap();
            again = Some(stepper(run.state().clone()).rough(vec![surface()]).unwrap());
        }
        open += usize::from(run.report().closed() == 0);
        highest = highest.max(-run.report().force()[2]);
    }
    assert!(open > 20 && highest > 1.5 * load, "open for {open} steps, up to {highest} N of {load} N");
    assert_eq!(again.unwrap().state(), run.state());
    let e = run.state().energy;
    assert!(e.residual().abs() < 0.02 * e.damping, "balance {:e} of {e:?}", e.residual());
    near(force(run.state()), load, 0.05, "load after the flat");
}
