//! The transient against closed forms, against the steady and the linear analyses, and its solvers against each other.

use faer::Mat;
use railsqueal::body::half_space::HalfSpace;
use railsqueal::body::{ModalMatrix, ReducedBody};
use railsqueal::contact::{
    ContactCreepage, NormalLoad, PatchKinematics, SlidingDirection, SlidingProblem, SteadyProblem, SteadySolution,
    Stencil,
};
use railsqueal::friction::{Exponential, FrictionLaw};
use railsqueal::grid::Interface;
use railsqueal::model::CoupledModel;
use railsqueal::stability::reduced::eigenpairs;
use railsqueal::transient::loading::{History, Loading, Normal, PatchDrive, Tangential};
use railsqueal::transient::{ContactSolver, Model, Scheme, Settings, State, Stepper};

mod rotated;
mod rough;
mod turning;

const PI: f64 = std::f64::consts::PI;

fn near(got: f64, want: f64, relative: f64, what: &str) {
    assert!(
        (got - want).abs() <= relative * want.abs(),
        "{what}: {got:.9e}, expected {want:.9e} within {relative:.1e}"
    );
}

/// One contact at the centre of a grid of nine, the others far away; nothing prescribed but the approach 0.
fn single_contact(gap: f64) -> Interface {
    let mut gaps = vec![1e3; 9];
    gaps[4] = gap;
    Interface::new(vec![-1.0, 0.0, 1.0], vec![-1.0, 0.0, 1.0], gaps).unwrap()
}

fn still() -> Loading {
    Loading::constant(NormalLoad::Approach(0.0), ContactCreepage::default(), 0.0)
}

fn settings(step: f64, drive: Loading, mu: f64) -> Settings {
    Settings {
        scheme: Scheme { step, theta: 0.5 },
        friction: FrictionLaw::Constant(mu).into(),
        solver: ContactSolver::Newton,
        tolerance: 1e-11,
        drive,
    }
}

#[test]
fn a_rigid_mass_thrown_on_a_rigid_plane_sticks_and_loses_its_kinetic_energy() {
    let (mass, velocity, gap) = (2.5, 3.0, 0.0123);
    let s = single_contact(gap);
    let modes = Mat::from_fn(27, 1, |i, _| if i == 14 { 1.0 / f64::sqrt(mass) } else { 0.0 });
    let residual = Mat::<f64>::zeros(27, 27);
    for weight in [0.0, 9.81 * mass] {
        let load = [-weight / f64::sqrt(mass)];
        let model = Model {
            interface: &s,
            residual: residual.as_ref(),
            modes: modes.as_ref(),
            omega: &[0.0],
            stiffness: vec![0.0].into(),
            damping: vec![0.0].into(),
            turning: None,
            carried: None,
            load: &load,
        };
        let mut start = State::at_rest(&model, &[0.0; 27], &[0.0]);
        start.v[0] = -velocity * mass.sqrt();
        let mut stepper = Stepper::new(model, settings(1e-4, still(), 0.3), start).unwrap();
        let mut impulse = 0.0;
        for _ in 0..200 {
            stepper.advance().unwrap();
            impulse -= stepper.report().force()[2] * 1e-4;
        }
        let state = stepper.state();
        let height = gap + state.q[0] / mass.sqrt();
        let e = state.energy;
        let fallen = weight * (gap - height);
        assert!(state.v[0].abs() < 1e-12, "it moves on with {:e}", state.v[0]);
        // It stops within half the way of a step: the velocity law acts in the step that would pass through the plane.
        assert!(height.abs() <= 0.5 * 1.01e-4 * velocity, "height {height:e}");
        near(e.impact, 0.5 * mass * velocity * velocity + fallen, 1e-3, "energy lost in the impact");
        near(impulse, mass * velocity + weight * 0.02, 1e-9, "impulse");
        assert!(e.residual().abs() < 1e-12 * e.impact, "balance {:e} of {e:?}", e.residual());
    }
}

/// An elastic bar of unit mass, length and wave speed flies against a rigid wall: it presses with ρcAv for 2L/c and
/// leaves as fast as it came (St. Venant). With a velocity law on its modes alone, and with a position law on the
/// compliance of the modes left out.
#[test]
fn an_elastic_bar_rebounds_after_two_passages_of_the_wave() {
    let (count, velocity, gap) = (120, 0.01, 0.001);
    let s = single_contact(gap);
    let omega: Vec<f64> = (0..count).map(|k| k as f64 * PI).collect();
    let modes = Mat::from_fn(27, count, |i, k| {
        if i == 14 {
            if k == 0 {
                1.0
            } else {
                2f64.sqrt()
            }
        } else {
            0.0
        }
    });
    let damping = vec![0.0; count];
    let tail: f64 = 1.0 / 3.0 - (1..count).map(|k| 2.0 / (k as f64 * PI).powi(2)).sum::<f64>();
    for compliance in [0.0, tail] {
        let residual = Mat::from_fn(27, 27, |i, j| if i == j { compliance } else { 0.0 });
        let model = Model {
            interface: &s,
            residual: residual.as_ref(),
            modes: modes.as_ref(),
            omega: &omega,
            stiffness: ModalMatrix::squares(&omega),
            damping: damping.clone().into(),
            turning: None,
            carried: None,
            load: &[],
        };
        let mut start = State::at_rest(&model, &[0.0; 27], &[0.0]);
        start.v[0] = -velocity;
        let h = 1e-3;
        let mut stepper = Stepper::new(model, settings(h, still(), 0.0), start).unwrap();
        let (mut impulse, mut last) = (0.0, 0.0);
        for _ in 0..3000 {
            stepper.advance().unwrap();
            let force = -stepper.report().force()[2];
            impulse += force * h;
            if force > 0.0 {
                last = stepper.time();
            }
        }
        let contact = last - gap / velocity;
        near(contact, 2.0, 0.02, "time of contact");
        near(impulse / contact, velocity, 0.02, "mean force");
        near(stepper.state().v[0], velocity, 0.02, "velocity of the centre of mass after");
        let e = stepper.state().energy;
        assert!(e.impact >= 0.0 && e.impact < 0.02 * e.start, "energy lost {:e} of {:e}", e.impact, e.start);
        assert!(e.residual().abs() < 1e-3 * e.start, "balance {:e} of {:e}", e.residual(), e.start);
    }
}

#[test]
fn without_contact_and_damping_the_energy_is_constant() {
    let s = single_contact(1e3);
    let omega = [2.0 * PI * 100.0, 2.0 * PI * 733.0, 2.0 * PI * 2000.0];
    let modes = Mat::from_fn(27, 3, |i, k| 0.1 * ((i + 3 * k) as f64).sin());
    let residual = Mat::from_fn(27, 27, |i, j| if i == j { 1e-9 } else { 0.0 });
    let model = Model {
        interface: &s,
        residual: residual.as_ref(),
        modes: modes.as_ref(),
        omega: &omega,
        stiffness: ModalMatrix::squares(&omega),
        damping: vec![0.0; 3].into(),
        turning: None,
        carried: None,
        load: &[],
    };
    let start = State::at_rest(&model, &[0.0; 27], &[0.0]).shaken(7, 0.02);
    let mut stepper = Stepper::new(model, settings(2e-5, still(), 0.3), start).unwrap();
    near(stepper.state().energy.start, 0.02, 1e-12, "energy of the start");
    for _ in 0..100_000 {
        stepper.advance().unwrap();
    }
    let e = stepper.state().energy;
    assert!(((e.kinetic + e.elastic) / 0.02 - 1.0).abs() < 1e-11, "{e:?}");
}

/// Two half-spaces of the same material under a paraboloid: W on a uniform grid.
fn half_spaces(material: HalfSpace, s: &Interface) -> Mat<f64> {
    let c = material.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    railsqueal::model::combined_compliance(c.as_ref(), c.as_ref()).unwrap()
}

/// Only static compliance: no modes.
fn quasi_static<'a>(s: &'a Interface, w: &'a Mat<f64>, none: &'a Mat<f64>) -> Model<'a> {
    let nothing = ModalMatrix::from(Vec::new());
    let (stiffness, damping) = (nothing.clone(), nothing);
    Model {
        interface: s,
        residual: w.as_ref(),
        modes: none.as_ref(),
        omega: &[],
        stiffness,
        damping,
        turning: None,
        carried: None,
        load: &[],
    }
}

/// CONTACT's example of Cattaneo's shift that turns into Carter's rolling (mm, unit shear modulus): ν = 0.28, N =
/// 0.4705, μ = 0.4013, a = 3.5.
struct Carter {
    material: HalfSpace,
    load: f64,
    mu: f64,
    a: f64,
}

const CARTER: Carter = Carter { material: HalfSpace { young: 2.56, poisson: 0.28 }, load: 0.4705, mu: 0.4013, a: 3.5 };

fn grid(spacing: f64, half: f64) -> Interface {
    let n = (half / spacing).round() as usize * 2 + 1;
    Interface::paraboloid(n, n, [half, half], [2.0 * 0.002963, 2.0 * 0.002963]).unwrap()
}

/// Shift under the tangential force 0.657 μN in `steps` steps.
fn shifted(s: &Interface, w: &Mat<f64>, none: &Mat<f64>, steps: usize) -> State {
    let c = CARTER;
    let force = 0.657 * c.mu * c.load;
    let end = steps as f64;
    let tangential = [
        Tangential::Force(History::table("force", &[[0.0, 0.0], [end, force]], end).unwrap()),
        Tangential::Creep(History::constant(0.0)),
    ];
    let patch = PatchDrive { tangential, spin: History::constant(0.0), speed: 0.0 };
    let drive = Loading::of_patch(Normal::Force(History::constant(c.load)), patch);
    let model = quasi_static(s, w, none);
    let normal = SteadyProblem {
        interface: s,
        compliance: w.as_ref().into(),
        friction: FrictionLaw::Constant(0.0).into(),
        kinematics: PatchKinematics::one(1.0, ContactCreepage::default()),
        loads: NormalLoad::Force(c.load).into(),
        stencil: Stencil::Upwind1,
        tolerance: 1e-10,
        max_iterations: 100,
    };
    let pressed = normal.solve().unwrap();
    let reaction: Vec<f64> = (0..s.len()).flat_map(|i| [0.0, 0.0, pressed.pressure[i] * s.weight[i]]).collect();
    let start = State::at_rest(&model, &reaction, &pressed.motions);
    let mut stepper = Stepper::new(model, settings(1.0, drive, c.mu), start).unwrap();
    for _ in 0..steps {
        stepper.advance().unwrap();
    }
    stepper.state().clone()
}

/// Mindlin and Cattaneo: the shift is 3μN(2 − ν)/(8Ga) (1 − (1 − Q/μN)^(2/3)) for equal bodies (K. L. Johnson,
/// Contact Mechanics, equation (7.42)), with adhesion inside c = a (1 − Q/μN)^(1/3). The discrete contact converges
/// to it with the grid.
#[test]
fn cattaneo_mindlin_shift() {
    let c = CARTER;
    let none_of = |s: &Interface| Mat::<f64>::zeros(3 * s.len(), 0);
    let want = 3.0 * c.mu * c.load * (2.0 - c.material.poisson) / (8.0 * c.material.shear() * c.a)
        * (1.0 - (1.0f64 - 0.657).powf(2.0 / 3.0));
    let mut errors = Vec::new();
    for spacing in [0.5, 0.25] {
        let s = grid(spacing, 4.5);
        let (w, none) = (half_spaces(c.material, &s), none_of(&s));
        let state = shifted(&s, &w, &none, 4);
        // The load is applied in steps: the shift is the sum of their rigid slips, here from the displacements in the
        // stick area.
        let centre = s.len() / 2;
        let moved: f64 = (0..3 * s.len()).map(|k| w[(3 * centre, k)] * state.reaction[k]).sum();
        errors.push(moved / want - 1.0);
        let stick = 0.343f64.cbrt() * c.a;
        // Across the force; the full traction is reached outside the stick circle and not inside.
        for i in 0..s.len() {
            let [x, y] = s.point(i);
            let r = x.hypot(y);
            let (t, p) = (state.reaction[3 * i].hypot(state.reaction[3 * i + 1]), state.reaction[3 * i + 2]);
            if p > 0.0 && r < stick - 2.0 * spacing {
                assert!(t < 0.999 * c.mu * p, "slip at {x} {y}, inside {stick}");
            }
            if p > 0.0 && r > stick + 2.0 * spacing {
                assert!(t > 0.999 * c.mu * p, "stick at {x} {y}, outside {stick}: {t} of {}", c.mu * p);
            }
        }
    }
    assert!(errors[1].abs() < 0.01 && errors[1].abs() < 0.7 * errors[0].abs(), "errors of the shift {errors:?}");
}

#[test]
fn cattaneo_becomes_carter() {
    let c = CARTER;
    let s = grid(0.25, 5.0);
    let none = Mat::<f64>::zeros(3 * s.len(), 0);
    let w = half_spaces(c.material, &s);
    let start = State { step: 0, ..shifted(&s, &w, &none, 1) };
    let tangential =
        [Tangential::Force(History::constant(0.657 * c.mu * c.load)), Tangential::Creep(History::constant(0.0))];
    let patch = PatchDrive { tangential, spin: History::constant(0.0), speed: 0.25 };
    let drive = Loading::of_patch(Normal::Force(History::constant(c.load)), patch);
    let model = quasi_static(&s, &w, &none);
    let mut stepper = Stepper::new(model, settings(1.0, drive, c.mu), start).unwrap();
    let mut creepage = Vec::new();
    for _ in 0..120 {
        stepper.advance().unwrap();
        creepage.push(stepper.state().creep[0].abs() / 0.25);
    }

    near(creepage[0], 1.824e-3, 5e-4, "creepage of the first rolling step");
    near(creepage[119], 3.101e-3, 5e-4, "settled creepage");
}

/// A wheel and a rail of a kind: half-spaces under the contact, and below them three modes of one body that move the
/// contact as a whole, two of them near each other, which friction couples.
struct Squeal {
    interface: Interface,
    pair: CoupledModel,
    mu: f64,
    /// The friction law; its coefficient at rest is not `mu` where it falls.
    law: FrictionLaw,
    speed: f64,
    load: f64,
}

impl Squeal {
    fn new(nodes: usize, damping: f64) -> Self {
        let half = 0.007;
        let interface = Interface::paraboloid(nodes, nodes, [half, half], [4.0, 4.0]).unwrap();
        let n = interface.len();
        let steel = HalfSpace { young: 205e9, poisson: 0.3 };
        let local = steel.compliance(&interface.patches[0].x, &interface.patches[0].y).unwrap();
        let omega: Vec<f64> = [430.0, 506.0, 616.0].iter().map(|f| 2.0 * PI * f).collect();
        let shape = [[0.06, 0.02, 0.08], [-0.06, 0.07, 0.02], [0.03, 0.07, -0.07]];
        let contact_modes = Mat::from_fn(3 * n, 3, |i, k| shape[k][i % 3]);
        let modal = |i: usize, j: usize| {
            (0..3).map(|k| contact_modes[(i, k)] * contact_modes[(j, k)] / omega[k].powi(2)).sum::<f64>()
        };
        let compliance = Mat::from_fn(3 * n, 3 * n, |i, j| local[(i, j)] + modal(i, j));
        let lower = ReducedBody::new(omega, vec![damping; 3], contact_modes, compliance);
        let upper = ReducedBody::new(vec![], vec![], Mat::zeros(3 * n, 0), local);
        let pair = CoupledModel::new(&lower, &upper).unwrap();
        Self { interface, pair, mu: 0.3, law: FrictionLaw::Constant(0.3), speed: 10.0, load: 40e3 }
    }

    fn with(self, law: impl Into<FrictionLaw>) -> Self {
        Self { law: law.into(), ..self }
    }

    fn model(&self) -> Model<'_> {
        Model::new(&self.pair, &self.interface)
    }

    fn sliding(&self, creepage: f64, load: NormalLoad) -> SlidingProblem<'_> {
        SlidingProblem {
            interface: &self.interface,
            compliance: self.pair.influence(),
            friction: self.law.clone().into(),
            kinematics: PatchKinematics::one(
                self.speed,
                ContactCreepage { lateral: creepage, ..ContactCreepage::default() },
            ),
            loads: load.into(),
            stencil: Stencil::Edge,
            direction: SlidingDirection::Actual,
        }
    }

    fn steady(&self, creepage: ContactCreepage) -> SteadyProblem<'_> {
        SteadyProblem {
            interface: &self.interface,
            compliance: self.pair.influence().into(),
            friction: self.law.clone().into(),
            kinematics: PatchKinematics::one(self.speed, creepage),
            loads: NormalLoad::Force(self.load).into(),
            stencil: Stencil::Edge,
            tolerance: 1e-10,
            max_iterations: 200,
        }
    }

    fn rolling(&self, creepage: ContactCreepage) -> SteadySolution {
        self.steady(creepage).solve().unwrap()
    }

    /// The state at rest with these stresses.
    fn rest(&self, pressure: &[f64], traction: &[[f64; 2]], approach: f64) -> State {
        let weight = &self.interface.weight;
        let reaction: Vec<f64> = (0..pressure.len())
            .flat_map(|i| [traction[i][0], traction[i][1], pressure[i]].map(|v| v * weight[i]))
            .collect();
        State::at_rest(&self.model(), &reaction, &[approach])
    }

    fn settings(&self, creepage: ContactCreepage, load: NormalLoad, step: f64, solver: ContactSolver) -> Settings {
        let drive = Loading::constant(load, creepage, self.speed);
        Settings { solver, friction: self.law.clone().into(), ..settings(step, drive, self.mu) }
    }
}

/// Growth rate and frequency of the difference between a perturbed and an unperturbed run, from its modal amplitudes:
/// the pair of (q, v/ω) is projected on its course by least squares, x(t + T) = r x(t).
fn growth(samples: &[Vec<f64>], interval: f64, about: f64) -> (f64, f64) {
    // Prony for one oscillation: x_{j+1} + x_{j−1}·b = a x_j with a = 2 r cos ωT, b = r².
    let (mut m, mut rhs) = ([[0.0; 2]; 2], [0.0; 2]);
    for w in samples.windows(3) {
        for k in 0..w[0].len() {
            let (x, y, z) = (w[1][k], -w[0][k], w[2][k]);
            m[0][0] += x * x;
            m[0][1] += x * y;
            m[1][1] += y * y;
            rhs[0] += x * z;
            rhs[1] += y * z;
        }
    }
    let det = m[0][0] * m[1][1] - m[0][1] * m[0][1];
    let a = (rhs[0] * m[1][1] - rhs[1] * m[0][1]) / det;
    let b = (m[0][0] * rhs[1] - m[0][1] * rhs[0]) / det;
    let r = b.sqrt();
    let angle = (a / (2.0 * r)).acos();
    let turns = (about * interval).round();
    let frequency = [turns + angle / (2.0 * PI), turns - angle / (2.0 * PI)]
        .map(|t| t / interval)
        .into_iter()
        .min_by(|x, y| (x - about).abs().total_cmp(&(y - about).abs()))
        .unwrap();
    (r.ln() / interval, frequency)
}

#[test]
fn perturbations_grow_and_decay_as_the_linear_analysis_says() {
    let falling = Exponential::new(0.4, 0.25, 0.2);
    for (law, creepage) in [
        (FrictionLaw::Constant(0.3), 0.012),
        (FrictionLaw::Constant(0.3), -0.012),
        (falling.clone().into(), 0.02),
        (falling.remembering(2e-4).into(), -0.02),
    ] {
        let squeal = Squeal::new(15, 6.0).with(law.clone());
        let problem = squeal.sliding(creepage, NormalLoad::Force(squeal.load));
        let solution = problem.solve().unwrap();
        let pairs = eigenpairs(&squeal.pair, &problem.contact(&solution), 1e-9).unwrap();
        let first = pairs.iter().find(|p| p.frequency() > 10.0).unwrap();

        let h = 1e-5;
        let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]);
        let start = start.remembering(&solution.friction);
        let along = ContactCreepage { lateral: creepage, ..ContactCreepage::default() };
        let settings = squeal.settings(along, NormalLoad::Approach(solution.motions[0]), h, ContactSolver::Newton);
        let mut calm = Stepper::new(squeal.model(), settings.clone(), start.clone()).unwrap();
        let amplitude = 2e-6 / first.modal.iter().map(|z| z.norm()).fold(0.0, f64::max);
        let mut moved =
            Stepper::new(squeal.model(), settings, start.perturbed(&first.modal, first.value, amplitude)).unwrap();
        moved.settle().unwrap();
        let mut samples = Vec::new();
        for step in 0..4000 {
            calm.advance().unwrap();
            moved.advance().unwrap();
            if step > 400 && step % 20 == 0 {
                samples.push(moved.state().q.iter().zip(&calm.state().q).map(|(a, b)| a - b).collect());
            }
        }
        let (sigma, frequency) = growth(&samples, 20.0 * h, first.frequency());

        let want = first.growth_rate();
        assert!(
            (sigma - want).abs() < 0.2 + 0.02 * want.abs(),
            "{law}, creepage {creepage}: growth {sigma}, linear {want}"
        );
        near(frequency, first.frequency(), 1e-3, "frequency");
    }
}

/// With part of the contact in stick as well, while no node changes its status: each run begins along the eigenvector
/// of one mode, at the state of rest that the scheme itself has. The distance from the eigenvalue falls with the
/// step.
#[test]
fn perturbations_of_a_contact_that_sticks_in_part_do_too() {
    let constant = FrictionLaw::Constant;
    for (law, load, creepage) in [
        (constant(0.3), 40e3, 0.004),
        (constant(0.4), 70e3, 0.003),
        (constant(0.4), 70e3, 0.005),
        (constant(0.4), 70e3, 0.007),
        (Exponential::new(0.4, 0.3, 0.2).into(), 40e3, 0.005),
    ] {
        let squeal = Squeal { load, ..Squeal::new(13, 6.0).with(law.clone()) };
        let along = ContactCreepage { lateral: creepage, ..ContactCreepage::default() };
        let problem = squeal.steady(along);
        let solution = problem.solve().unwrap();
        let contact = problem.contact(&solution);
        assert!(contact.sticking() > 3 && contact.sticking() < contact.nodes.len());
        let pairs = eigenpairs(&squeal.pair, &contact, 1e-9).unwrap();
        let first = pairs.iter().find(|p| p.frequency() > 10.0 && p.damping_ratio() < 0.3).unwrap();
        let (mut apart, mut seen) = (Vec::new(), 0.0);
        for h in [1e-5, 2.5e-6] {
            let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]);
            let load = NormalLoad::Approach(solution.motions[0]);
            let mut settings = squeal.settings(along, load, h, ContactSolver::Newton);
            settings.tolerance = 1e-13;
            // The state of rest of the scheme: what is left of the start has decayed where the modes are damped by
            // hand.
            let mut rest =
                Stepper::new(squeal.model(), settings.clone(), start.remembering(&solution.friction)).unwrap();
            for _ in 0..(0.04 / h) as usize {
                rest.advance().unwrap();
                if rest.state().step % 20 == 0 {
                    let mut state = rest.state().clone();
                    state.v.iter_mut().for_each(|v| *v *= 0.5);
                    rest = Stepper::new(squeal.model(), settings.clone(), state).unwrap();
                }
            }
            let rest = rest.state().clone();
            let amplitude = 1e-9 / first.modal.iter().map(|z| z.norm()).fold(0.0, f64::max);
            let moved = rest.clone().perturbed(&first.modal, first.value, amplitude);
            let mut calm = Stepper::new(squeal.model(), settings.clone(), rest).unwrap();
            let mut moved = Stepper::new(squeal.model(), settings, moved).unwrap();
            let (mut samples, every) = (Vec::new(), (2e-4 / h).round() as usize);
            let stick = calm.report().stick();
            for step in 0..(0.03 / h) as usize {
                calm.advance().unwrap();
                moved.advance().unwrap();
                let seen = [calm.report().stick(), moved.report().stick()];
                assert!(step < 2 || seen[0] == seen[1], "{law}: nodes change from {stick} in stick to {seen:?}");
                if step as f64 * h > 5e-3 && step % every == 0 {
                    samples.push(moved.state().q.iter().zip(&calm.state().q).map(|(a, b)| a - b).collect());
                }
            }
            let (sigma, frequency) = growth(&samples, every as f64 * h, first.frequency());
            apart.push((sigma - first.growth_rate()).abs());
            seen = frequency;
        }
        near(seen, first.frequency(), 1e-3, "frequency");
        let want = first.growth_rate().abs();
        assert!(apart[1] < 0.2 + 0.02 * want && apart[1] < 0.8 * apart[0], "{law}: {apart:?} of {want}");
    }
}

/// Halving the step must halve the error: the order seen, log2 of the ratio of two errors, is nearer to 1 than to any
/// other.
#[track_caller]
fn first_order(errors: &[f64], what: &str) {
    let orders: Vec<f64> = errors.windows(2).map(|w| (w[0] / w[1]).log2()).collect();
    assert!(orders.iter().all(|o| (0.5..1.5).contains(o)), "{what}: orders {orders:.2?} of the errors {errors:?}");
}

/// The difference along the particle is that of the steady analysis but for the first order in Vh: the transient
/// stays where the steady analysis puts it, and the difference falls with the step to nothing, on every grid.
#[test]
fn at_rest_the_transient_is_the_steady_analysis() {
    for nodes in [15, 29] {
        let squeal = Squeal::new(nodes, 400.0);
        let creepage = ContactCreepage { lateral: 0.002, longitudinal: -0.001, spin: 0.0 };
        let solution = squeal.rolling(creepage);
        let limit = squeal.mu * squeal.load;
        let (mut errors, mut sunk) = (Vec::new(), Vec::new());
        for step in [4e-5, 2e-5, 1e-5, 5e-6] {
            let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]);
            let settings = squeal.settings(creepage, NormalLoad::Force(squeal.load), step, ContactSolver::Newton);
            let mut stepper = Stepper::new(squeal.model(), settings, start).unwrap();
            let mut forces = Vec::new();
            for _ in 0..(0.01 / step).round() as usize {
                stepper.advance().unwrap();
                forces.push(stepper.report().force());
            }
            let (half, last) = (forces[forces.len() / 2], forces[forces.len() - 1]);
            let apart = |a: [f64; 3], b: [f64; 3]| (0..2).map(|c| (a[c] - b[c]).abs() / limit).fold(0.0, f64::max);
            let error = apart(last, solution.force);

            assert!(
                apart(half, last) < 0.02 * error,
                "the forces still change by {:e} of {error:e}",
                apart(half, last)
            );
            errors.push(error);
            sunk.push((stepper.state().motions[0] / solution.motions[0] - 1.0).abs());
        }
        first_order(&errors, &format!("{nodes} nodes, forces over μN"));
        first_order(&sunk, &format!("{nodes} nodes, approach"));
    }
}

/// Steps that carry the material from node to node have the steady analysis with the two-point difference as their
/// state of rest, with stick and slip and with friction that falls: nothing moves, and what is moved comes back to
/// it. With shorter steps the coefficient has the same course at the same creep.
#[test]
fn material_that_travels_from_node_to_node_remembers_as_in_steady_rolling() {
    let steel = HalfSpace { young: 205e9, poisson: 0.3 };
    let interface = Interface::paraboloid(15, 15, [0.007; 2], [4.0, 4.0]).unwrap();
    let (w, none) = (half_spaces(steel, &interface), Mat::<f64>::zeros(3 * interface.len(), 0));
    let law = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.05));
    let creepage = ContactCreepage { longitudinal: -0.001, lateral: 0.003, spin: 0.2 };
    let (speed, load) = (10.0, 40e3);
    let problem = SteadyProblem {
        interface: &interface,
        compliance: w.as_ref().into(),
        friction: law.clone().into(),
        kinematics: PatchKinematics::one(speed, creepage),
        loads: NormalLoad::Force(load).into(),
        stencil: Stencil::Upwind1,
        tolerance: 1e-11,
        max_iterations: 400,
    };
    let steady = problem.solve().unwrap();
    let stick = steady.state.iter().filter(|s| **s == 1).count();
    let fallen = steady.friction.iter().filter(|mu| **mu < 0.35).count();
    assert!(stick > 5 && fallen > 5, "{stick} nodes in stick, {fallen} with less friction than at rest");
    let reaction: Vec<f64> = (0..interface.len())
        .flat_map(|i| {
            [steady.traction[i][0], steady.traction[i][1], steady.pressure[i]].map(|v| v * interface.weight[i])
        })
        .collect();
    let model = quasi_static(&interface, &w, &none);
    let rest = State::at_rest(&model, &reaction, &steady.motions);
    let drive = Loading::constant(NormalLoad::Force(load), creepage, speed);
    let step = (interface.patches[0].x[1] - interface.patches[0].x[0]) / speed;
    let settings = Settings { friction: law.clone().into(), ..settings(step, drive, 0.3) };
    // At rest, and with the memory of material that never slid.
    for (start, steps) in [(rest.clone().remembering(&steady.friction), 3), (rest, 60)] {
        let mut stepper = Stepper::new(quasi_static(&interface, &w, &none), settings.clone(), start).unwrap();
        (0..steps).for_each(|_| stepper.advance().unwrap());
        let state = stepper.state();
        let apart = state.reaction.iter().zip(&reaction).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-8 * 0.4 * load, "after {steps} steps the reactions differ by {apart:e} N");
        let apart = state.friction.iter().zip(&steady.friction).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-8, "after {steps} steps the coefficients differ by {apart:e}");
    }
}

/// A law that remembers but does not change is Coulomb's.
#[test]
fn the_memory_of_a_constant_coefficient_changes_no_step() {
    let one = Squeal::new(11, 6.0);
    let two = Squeal::new(11, 6.0).with(Exponential::new(0.3, 0.3, 0.1));
    let creepage = ContactCreepage { lateral: 0.004, ..ContactCreepage::default() };
    let found = [&one, &two].map(|squeal| {
        let solution = squeal.rolling(creepage);
        let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]);
        let start = start.remembering(&solution.friction).shaken(3, 2.0);
        let mut settings =
            squeal.settings(creepage, NormalLoad::Approach(solution.motions[0]), 1e-5, ContactSolver::Newton);
        settings.tolerance = 1e-13;
        let mut stepper = Stepper::new(squeal.model(), settings, start).unwrap();
        (0..100).for_each(|_| stepper.advance().unwrap());
        stepper.state().reaction.clone()
    });
    let apart = found[0].iter().zip(&found[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-9 * 0.3 * one.load, "reactions differ by {apart:e} N");
}

#[test]
fn both_solvers_find_the_same_reactions_in_stick_and_slip() {
    both_solvers(&Squeal::new(11, 6.0));
}

#[test]
fn both_solvers_find_the_same_reactions_with_friction_that_falls() {
    both_solvers(&Squeal::new(11, 6.0).with(Exponential::new(0.4, 0.25, 0.1)));
}

/// Friction that falls takes no factorisation of the whole, whatever the load, from stick to full sliding, at rest
/// and shaken; and the fixed point makes the same of the last step.
#[test]
fn falling_friction_goes_the_fast_way_under_any_load() {
    for load in [2e3, 10e3, 30e3, 70e3] {
        for (lateral, energy) in [(0.003, 0.0), (0.003, 0.5), (0.02, 0.5)] {
            let squeal = Squeal { load, ..Squeal::new(11, 6.0).with(Exponential::new(0.4, 0.25, 0.1)) };
            let creepage = ContactCreepage { lateral, ..ContactCreepage::default() };
            let solution = squeal.rolling(creepage);
            let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]);
            let start = start.remembering(&solution.friction).shaken(3, energy * load / 40e3);
            let settings = |solver| squeal.settings(creepage, NormalLoad::Force(load), 1e-5, solver);
            let mut stepper = Stepper::new(squeal.model(), settings(ContactSolver::Newton), start).unwrap();
            let (mut before, mut long) = (stepper.state().clone(), 0);
            for _ in 0..200 {
                before = stepper.state().clone();
                stepper.advance().unwrap();
                long += usize::from(stepper.report().effort.factorisations > 0);
            }
            assert!(long <= 10, "{load} N, creepage {lateral}: {long} of 200 steps went the long way");
            let mut reference = Stepper::new(squeal.model(), settings(ContactSolver::FixedPoint), before).unwrap();
            reference.advance().unwrap();
            let (a, b) = (&stepper.state().reaction, &reference.state().reaction);
            let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(
                difference < 1e-8 * 0.4 * load,
                "{load} N, creepage {lateral}: reactions differ by {difference:e} N"
            );
        }
    }
}

fn both_solvers(squeal: &Squeal) {
    let run = |solver| {
        let creepage = ContactCreepage { lateral: 0.004, ..ContactCreepage::default() };
        let solution = squeal.rolling(creepage);
        let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]);
        let start = start.remembering(&solution.friction);
        let settings = squeal.settings(creepage, NormalLoad::Approach(solution.motions[0]), 1e-5, solver);
        let mut stepper = Stepper::new(squeal.model(), settings, start.shaken(3, 2.0)).unwrap();
        let mut found = Vec::new();
        let mut stick = 0;
        for step in 0..300 {
            stepper.advance().unwrap();
            let r = stepper.report();
            stick += usize::from(r.stick() > 0 && r.stick() < r.closed());
            if step % 10 == 0 {
                found.push(stepper.state().reaction.clone());
            }
        }
        (found, stick)
    };
    let (fast, stick) = run(ContactSolver::Newton);
    let (reference, _) = run(ContactSolver::FixedPoint);

    assert!(stick > 100, "only {stick} of 300 steps have both stick and slip");
    let limit = squeal.mu * squeal.load;
    for (step, (a, b)) in fast.iter().zip(&reference).enumerate() {
        let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(difference < 1e-8 * limit, "step {}: reactions differ by {:e} μN", 10 * step, difference / limit);
    }
}

/// Bodies pressed together and rubbed to and fro without rolling, from rest: all of stick, slip, loss of contact and
/// damping, and no error of interpolation. Returns modal displacements and the energy balance at the end, relative to
/// what friction took.
fn rubbed(squeal: &Squeal, step: f64, theta: f64, swing: f64) -> (Vec<f64>, f64) {
    let end = 4e-3;
    let pressed =
        SteadyProblem { friction: FrictionLaw::Constant(0.0).into(), ..squeal.steady(ContactCreepage::default()) }
            .solve()
            .unwrap();
    let start = squeal.rest(&pressed.pressure, &pressed.traction, pressed.motions[0]);
    let load = NormalLoad::Approach(pressed.motions[0]);
    let mut settings = squeal.settings(ContactCreepage::default(), load, step, ContactSolver::Newton);
    settings.scheme.theta = theta;
    settings.drive.patches[0].speed = 0.0;
    let wave = |mean: f64, size: f64, frequency: f64| {
        let table: Vec<[f64; 2]> =
            (0..=200).map(|i| i as f64 * 2e-5).map(|t| [t, mean + size * (2.0 * PI * frequency * t).sin()]).collect();
        History::table("wave", &table, end).unwrap()
    };
    settings.drive.patches[0].tangential[1] = Tangential::Creep(wave(0.0, 0.05, 300.0));
    settings.drive.motions[0].normal = Normal::Approach(wave(pressed.motions[0], swing * pressed.motions[0], 250.0));
    let mut stepper = Stepper::new(squeal.model(), settings, start).unwrap();
    for _ in 0..(end / step).round() as usize {
        stepper.advance().unwrap();
    }
    let e = stepper.state().energy;
    (stepper.state().q.clone(), e.residual().abs() / e.friction)
}

#[test]
fn error_falls_with_the_step() {
    let squeal = Squeal::new(9, 6.0);
    let (exact, _) = rubbed(&squeal, 6.25e-7, 0.5, 0.1);
    let errors: Vec<f64> = [2e-5, 1e-5, 5e-6]
        .into_iter()
        .map(|h| rubbed(&squeal, h, 0.5, 0.1).0.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
        .collect();

    assert!(errors.windows(2).all(|w| w[0] / w[1] > 1.7), "errors {errors:?} do not fall with the first order");
}

/// Rolling with stick and slip, shaken: nodes change between stick and slip, and enter and leave. The sum over some
/// seeds, since an error also depends on where in a step such a change falls.
#[test]
fn error_falls_with_the_step_in_rolling_too() {
    let squeal = Squeal::new(9, 6.0);
    let creepage = ContactCreepage { lateral: 0.002, longitudinal: -0.0005, spin: 0.0 };
    let solution = squeal.rolling(creepage);
    let run = |step: f64, seed: u64| {
        let start = squeal.rest(&solution.pressure, &solution.traction, solution.motions[0]).shaken(seed, 0.5);
        let load = NormalLoad::Approach(solution.motions[0]);
        let settings = squeal.settings(creepage, load, step, ContactSolver::Newton);
        let mut stepper = Stepper::new(squeal.model(), settings, start).unwrap();
        let (mut changes, mut before) = (0, None);
        for _ in 0..(2e-3 / step).round() as usize {
            stepper.advance().unwrap();
            let stick = stepper.report().stick();
            changes += usize::from(before.is_some_and(|b| b != stick));
            before = Some(stick);
        }
        assert!(changes > 10, "only {changes} changes between stick and slip");
        stepper.state().q.clone()
    };
    let seeds = [1, 2, 3, 4];
    let exact = seeds.map(|seed| run(6.25e-7, seed));
    let errors = [2e-5, 1e-5, 5e-6].map(|step| {
        seeds
            .iter()
            .zip(&exact)
            .map(|(&seed, exact)| run(step, seed).iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
            .sum::<f64>()
    });
    first_order(&errors, "modal displacements");
}

#[test]
fn energy_is_balanced_to_the_order_of_the_scheme() {
    let squeal = Squeal::new(9, 6.0);
    // Closed contact and θ = ½: exact. Nodes that open and close, or θ > ½: first order.
    let exact = rubbed(&squeal, 1e-5, 0.5, 0.0).1;
    assert!(exact < 1e-10, "balance {exact:e}");
    for (theta, swing) in [(0.5, 1.3), (0.6, 0.0)] {
        let balance: Vec<f64> = [2e-5, 1e-5, 5e-6].into_iter().map(|h| rubbed(&squeal, h, theta, swing).1).collect();

        assert!(balance.windows(2).all(|w| w[0] / w[1] > 1.6), "θ = {theta}, swing {swing}: balances {balance:?}");
    }
}

/// Full modal matrices move the contact as the diagonal ones of the same bodies do, and keep the balance of energy.
#[test]
fn the_motion_does_not_depend_on_the_coordinates() {
    let squeal = Squeal::new(9, 40.0);
    let (pair, q) = rotated::rotated(&squeal.pair);
    let turned = Squeal { pair, interface: squeal.interface.clone(), law: squeal.law.clone(), ..squeal };
    let creepage = ContactCreepage { lateral: 0.006, ..ContactCreepage::default() };
    let rolling = squeal.rolling(creepage);
    let settings = squeal.settings(creepage, NormalLoad::Approach(rolling.motions[0]), 1e-5, ContactSolver::Newton);
    let start = |s: &Squeal| s.rest(&rolling.pressure, &rolling.traction, rolling.motions[0]);
    let mut one = start(&squeal);
    let kick = [0.02, -0.01, 0.03];
    one.v.copy_from_slice(&kick);
    let mut two = start(&turned);
    two.v = (0..3).map(|j| (0..3).map(|i| q[(i, j)] * kick[i]).sum()).collect();
    let mut one = Stepper::new(squeal.model(), settings.clone(), one).unwrap();
    let mut two = Stepper::new(turned.model(), settings, two).unwrap();
    for step in 0..400 {
        one.advance().unwrap();
        two.advance().unwrap();
        let (a, b) = (one.state(), two.state());
        let largest = a.reaction.iter().fold(0.0f64, |m, r| m.max(r.abs()));
        let apart = a.reaction.iter().zip(&b.reaction).fold(0.0f64, |m, (x, y)| m.max((x - y).abs()));
        assert!(apart < 1e-7 * largest, "step {step}: reactions differ by {apart:e} of {largest:e} N");
    }
    let (a, b) = (one.state().energy, two.state().energy);
    for (x, y, what) in
        [(a.damping, b.damping, "damping"), (a.elastic, b.elastic, "elastic"), (a.kinetic, b.kinetic, "kinetic")]
    {
        near(y, x, 1e-6, what);
    }
    assert!(a.damping > 0.0 && (a.residual() - b.residual()).abs() < 1e-6 * a.damping.max(a.kinetic), "{a:?} {b:?}");
}
