//! Patches in time whose rigid motions follow from resultants: their own loads, or a vertical one that they share.

use super::*;
use railsqueal::transient::StepReport;

/// Two half-space patches far apart on one body whose modes move both of them, two modes near each other, against a
/// half-space below each.
struct Wheel {
    interface: Interface,
    pair: CoupledModel,
    loads: Loads,
    kinematics: Vec<PatchKinematics>,
}

/// Contact angles, rad.
const ANGLES: [f64; 2] = [0.1, -0.7];

impl Wheel {
    fn new(loads: Loads, lateral: [f64; 2]) -> Self {
        let s = patch(4.0, 0.0);
        let n = s.len();
        let interface = Interface::joined(vec![s.clone(), s.clone()]).unwrap();
        let omega: Vec<f64> = [430.0, 506.0, 616.0].iter().map(|f| 2.0 * PI * f).collect();
        let shape = [
            [[0.06, 0.02, 0.08], [-0.06, 0.07, 0.02], [0.03, 0.07, -0.07]],
            [[0.05, 0.04, 0.05], [-0.05, 0.05, 0.05], [0.02, 0.08, -0.03]],
        ];
        let contact_modes = Mat::from_fn(6 * n, 3, |i, k| shape[i / (3 * n)][k][i % 3]);
        let mut compliance = far_apart(&s, 2);
        for k in 0..3 {
            for j in 0..6 * n {
                for i in 0..6 * n {
                    compliance[(i, j)] += contact_modes[(i, k)] * contact_modes[(j, k)] / omega[k].powi(2);
                }
            }
        }
        let lower = ReducedBody::new(omega, vec![6.0; 3], contact_modes, compliance);
        let pair = CoupledModel::new(&lower, &rigid(2 * n)).unwrap();
        let of = |lateral| ContactCreepage { lateral, ..ContactCreepage::default() };
        let kinematics = vec![
            PatchKinematics { speed: 10.0, creepage: of(lateral[0]) },
            PatchKinematics { speed: 11.0, creepage: of(lateral[1]) },
        ];
        Self { interface, pair, loads, kinematics }
    }

    fn model(&self) -> Model<'_> {
        Model::new(&self.pair, &self.interface)
    }

    fn steady(&self) -> (SteadyProblem<'_>, SteadySolution) {
        let w = &self.pair.compliance;
        let mut steady = problem(&self.interface, w, self.kinematics.clone(), self.loads.clone());
        steady.stencil = Stencil::Edge;
        let found = steady.solve().unwrap();
        (steady, found)
    }

    fn rest(&self, found: &SteadySolution) -> State {
        let weight = &self.interface.weight;
        let of = |i: usize| [found.traction[i][0], found.traction[i][1], found.pressure[i]].map(|v| v * weight[i]);
        let reaction: Vec<f64> = (0..self.interface.len()).flat_map(of).collect();
        State::at_rest(&self.model(), &reaction, &found.motions)
    }

    fn loading(&self) -> Loading {
        Loading::of_loads(&self.loads, self.kinematics.iter().copied().map(PatchDrive::constant).collect())
    }
}

/// Vertical force on the upper body of the patches, N.
fn vertical(report: &StepReport) -> f64 {
    report.patches.iter().zip(ANGLES).map(|(p, d)| -p.force[2] * d.cos() + p.force[1] * d.sin()).sum()
}

/// Patches that do not feel each other, each with modes and a load of its own, are the single ones under their loads.
#[test]
fn own_loads_of_patches_apart_are_those_of_single_ones() {
    let s = patch(4.0, 0.0);
    let n = s.len();
    let bodies = [modal(&s, &[600.0, 1300.0], 0.0), modal(&s, &[900.0, 2100.0], 1.1)];
    let rolling = [
        PatchKinematics { speed: 10.0, creepage: ContactCreepage { longitudinal: 0.0, lateral: 0.003, spin: 0.3 } },
        PatchKinematics { speed: 14.0, creepage: ContactCreepage { longitudinal: 0.001, lateral: -0.012, spin: 0.0 } },
    ];
    let forces = [NormalLoad::Force(40e3), NormalLoad::Force(20e3)];
    let both = Interface::joined(vec![s.clone(), s.clone()]).unwrap();
    let whole = CoupledModel::new(&side_by_side(&bodies[0], &bodies[1]), &rigid(2 * n)).unwrap();
    let rest = problem(&both, &whole.compliance, rolling.to_vec(), Loads::of_patches(&forces)).solve().unwrap();
    let falling = FrictionLaw::from(Exponential::new(0.4, 0.25, 0.1).remembering(1e-3));
    let run =
        |s: &Interface, pair: &CoupledModel, from: usize, count: usize, kicks: &[f64], friction: &PatchFriction| {
            let of =
                |i: usize| [rest.traction[i][0], rest.traction[i][1], rest.pressure[i]].map(|v| v * both.weight[i]);
            let reaction: Vec<f64> = (n * from..n * (from + count)).flat_map(of).collect();
            let model = Model::new(pair, s);
            let mut start = State::at_rest(&model, &reaction, &rest.motions[from..from + count]);
            start.v.copy_from_slice(kicks);
            let drives = rolling[from..from + count].iter().copied().map(PatchDrive::constant).collect();
            let mut loading = Loading::of_loads(&Loads::of_patches(&forces[from..from + count]), drives);
            for (motion, load) in loading.motions.iter_mut().zip([40e3, 20e3][from..from + count].iter()) {
                let swing = [[0.0, *load], [2e-4, 1.2 * load], [1.0, 1.2 * load]];
                motion.normal = Normal::Force(History::table("load", &swing, 1.0).unwrap());
            }
            let mut settings = settings(loading, friction.clone(), 1e-5);
            settings.tolerance = 1e-13;
            let mut stepper = Stepper::new(model, settings, start).unwrap();
            (0..40).for_each(|_| stepper.advance().unwrap());
            (stepper.state().clone(), stepper.report().clone())
        };
    let kicks = [0.3, -0.2, 0.25, 0.1];
    let slippery = FrictionLaw::Constant(0.4 * MU);
    for laws in [[FrictionLaw::Constant(MU), slippery.clone()], [falling.clone(), falling.clone()], [slippery, falling]]
    {
        let friction = PatchFriction::new(laws[0].clone(), vec![laws[1].clone()]);
        let (found, report) = run(&both, &whole, 0, 2, &kicks, &friction);
        for c in 0..2 {
            let pair = CoupledModel::new(&bodies[c], &rigid(n)).unwrap();
            let (alone, own) = run(&s, &pair, c, 1, &kicks[2 * c..2 * c + 2], &laws[c].clone().into());
            let load = -own.patches[0].force[2];
            assert!((load / [48e3, 24e3][c] - 1.0).abs() < 1e-12, "{load}");
            let off = (0..3 * n).map(|k| (found.reaction[3 * n * c + k] - alone.reaction[k]).abs());
            let off = off.fold(0.0, f64::max);
            let law = &laws[c];
            assert!(off < 1e-10 * load, "{law}, patch {c}: a reaction off by {off:e} of {load} N");
            assert!((found.motions[c] / alone.motions[0] - 1.0).abs() < 1e-10);
            let (a, b) = (report.patches[c], own.patches[0]);
            assert_eq!([a.closed, a.stick], [b.closed, b.stick]);
            assert!((a.moment_z - b.moment_z).abs() < 1e-9 * load * 1e-2);
        }
    }
}

/// A patch without load stays open and changes nothing of the other one, in stick and slip, on bodies that couple both.
#[test]
fn a_patch_without_load_changes_no_step() {
    let h = Humps::new();
    let n = h.patches.patches[0].len();
    let rolling = Humps::rolling(ContactCreepage { longitudinal: 1e-3, lateral: -2e-3, spin: 0.3 });
    let run = |s: &Interface, w: &Mat<f64>, kinematics: &[PatchKinematics], loads: &[NormalLoad]| {
        let none = Mat::zeros(3 * s.len(), 0);
        let model = quasi_static(s, w, &none);
        let start = State::at_rest(&model, &vec![0.0; 3 * s.len()], &vec![0.0; loads.len()]);
        let drives = kinematics.iter().copied().map(PatchDrive::constant).collect();
        let mut settings =
            settings(Loading::of_loads(&Loads::of_patches(loads), drives), FrictionLaw::Constant(MU), 4e-5);
        settings.tolerance = 1e-13;
        let mut stepper = Stepper::new(model, settings, start).unwrap();
        (0..12).for_each(|_| stepper.advance().unwrap());
        (stepper.state().clone(), stepper.report().clone())
    };
    for pressed in [0, 1] {
        let alone = patch([4.0, 5.0][pressed], [0.0, 4e-6][pressed]);
        let w = h.patches_w.as_ref().submatrix(3 * n * pressed, 3 * n * pressed, 3 * n, 3 * n).to_owned();
        let (single, own) = run(&alone, &w, &rolling[pressed..=pressed], &[NormalLoad::Force(30e3)]);
        let mut loads = [NormalLoad::Force(0.0); 2];
        loads[pressed] = NormalLoad::Force(30e3);
        let (both, report) = run(&h.patches, &h.patches_w, &rolling, &loads);
        let nodes = 3 * n * pressed..3 * n * (pressed + 1);
        let off = both.reaction[nodes].iter().zip(&single.reaction).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12 * 30e3, "{off:e} N");
        assert!(own.stick() > 10 && report.patches[pressed].stick == own.stick());
        assert_eq!(report.patches[1 - pressed].closed, 0);
    }
}

/// Patches under one vertical force that swings in time: their forces add up to it at every step, friction included,
/// with stick and slip; the fixed point finds the same reactions as Newton's method; the energies balance.
#[test]
fn patches_share_a_vertical_force_at_every_step() {
    let load = 40e3;
    let wheel = Wheel::new(Loads::vertical(&ANGLES, NormalLoad::Force(load)), [3e-3, 9e-3]);
    let (_, found) = wheel.steady();
    assert!(found.state.contains(&1) && found.patches.iter().all(|p| p.force[2] < -1e3), "{:?}", found.patches);
    let (step, steps) = (1e-5, 60);
    let swing = |t: f64| load * (1.0 + 0.2 * (2.0 * PI * 800.0 * t).sin());
    let table: Vec<[f64; 2]> = (0..=steps).map(|k| k as f64 * step).map(|t| [t, swing(t)]).collect();
    let run = |solver: ContactSolver, tolerance: f64| {
        let mut loading = wheel.loading();
        loading.motions[0].normal = Normal::Force(History::table("load", &table, step * steps as f64).unwrap());
        let settings = Settings { solver, tolerance, ..settings(loading, FrictionLaw::Constant(MU), step) };
        let mut start = wheel.rest(&found);
        start.v.copy_from_slice(&[0.02, -0.03, 0.01]);
        let mut stepper = Stepper::new(wheel.model(), settings, start).unwrap();
        let mut effort = railsqueal::transient::problem::Effort::default();
        for k in 1..=steps {
            stepper.advance().unwrap();
            effort += stepper.report().effort;
            let apart = vertical(stepper.report()) - swing(k as f64 * step);
            assert!(apart.abs() < (10.0 * tolerance).max(1e-10) * load, "{solver:?}, step {k}: {apart:e} N");
        }
        (stepper.state().clone(), stepper.report().clone(), effort)
    };
    let (newton, report, effort) = run(ContactSolver::Newton, 1e-12);
    assert!(report.patches.iter().all(|p| p.closed > 10), "{report:?}");
    assert!(effort.factorisations == 0 && effort.iterations < 8 * steps, "{effort:?}");
    let e = newton.energy;
    assert!(e.residual().abs() < 1e-3 * e.friction, "{e:?}");
    let (fixed, ..) = run(ContactSolver::FixedPoint, 1e-9);
    let off = newton.reaction.iter().zip(&fixed.reaction).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-6 * load, "{off:e} N");
    assert!((newton.motions[0] / fixed.motions[0] - 1.0).abs() < 1e-6);
}

/// Patches under a vertical and a lateral force of the wheel bear both at every step, while the vertical one swings.
#[test]
fn patches_share_a_vertical_and_a_lateral_force_at_every_step() {
    let load = 40e3;
    let (_, found) = Wheel::new(Loads::vertical(&ANGLES, NormalLoad::Force(load)), [3e-3, 9e-3]).steady();
    let lateral = |patches: &[[f64; 3]]| -> f64 {
        patches.iter().zip(ANGLES).map(|(force, d)| -force[2] * d.sin() - force[1] * d.cos()).sum()
    };
    let sideways = lateral(&found.patches.iter().map(|p| p.force).collect::<Vec<_>>());
    let begin = found.patches.iter().map(|p| -p.force[2]).collect();
    let wheel = Wheel::new(Loads::vertical_and_lateral(&ANGLES, [load, sideways], begin), [3e-3, 9e-3]);
    let (_, found) = wheel.steady();
    let (step, steps) = (1e-5, 60);
    let swing = |t: f64| load * (1.0 + 0.05 * (2.0 * PI * 800.0 * t).sin());
    let table: Vec<[f64; 2]> = (0..=steps).map(|k| k as f64 * step).map(|t| [t, swing(t)]).collect();
    let mut loading = wheel.loading();
    loading.motions[0].normal = Normal::Force(History::table("load", &table, step * steps as f64).unwrap());
    let mut settings = settings(loading, FrictionLaw::Constant(MU), step);
    settings.tolerance = 1e-12;
    let mut start = wheel.rest(&found);
    start.v.copy_from_slice(&[0.02, -0.03, 0.01]);
    let mut stepper = Stepper::new(wheel.model(), settings, start).unwrap();
    for k in 1..=steps {
        stepper.advance().unwrap();
        let forces: Vec<[f64; 3]> = stepper.report().patches.iter().map(|p| p.force).collect();
        let apart = [vertical(stepper.report()) - swing(k as f64 * step), lateral(&forces) - sideways];
        assert!(apart.iter().all(|d| d.abs() < 1e-10 * load), "step {k}: {apart:?} N");
    }
    assert!(stepper.report().patches.iter().all(|p| p.closed > 10), "{:?}", stepper.report());
}

/// Patches at a given height bear a lateral force that goes through 0 at the end of a step and stays there: they remain
/// closed, on the right-hand wheel and on its mirror image.
#[test]
fn patches_at_a_given_height_bear_a_lateral_force() {
    let load = 40e3;
    for side in [1.0, -1.0] {
        let (angles, creepages) = (ANGLES.map(|d| side * d), [3e-3, 9e-3].map(|c| side * c));
        let (_, found) = Wheel::new(Loads::vertical(&angles, NormalLoad::Force(load)), creepages).steady();
        let lateral = |patches: &[[f64; 3]]| -> f64 {
            patches.iter().zip(angles).map(|(force, d)| -force[2] * d.sin() - force[1] * d.cos()).sum()
        };
        let sideways = lateral(&found.patches.iter().map(|p| p.force).collect::<Vec<_>>()) + side * 3e3;
        let begin = found.patches.iter().map(|p| -p.force[2]).collect();
        let loads = Loads::vertical_and_lateral(&angles, [load, sideways], begin);
        let wheel = Wheel::new(loads, creepages);
        let (_, found) = wheel.steady();
        assert!(side * sideways > 2e3, "{sideways} N");
        let (step, steps) = (1e-5, 60);
        let force = |t: f64| sideways * (1.0 - t / (40.0 * step)).max(0.0);
        let table: Vec<[f64; 2]> = (0..=steps).map(|k| k as f64 * step).map(|t| [t, -force(t)]).collect();
        let mut loading = wheel.loading().held_at(&found.motions);
        loading.motions[1].normal = Normal::Force(History::table("force", &table, step * steps as f64).unwrap());
        let mut settings = settings(loading, FrictionLaw::Constant(MU), step);
        settings.tolerance = 1e-12;
        let mut stepper = Stepper::new(wheel.model(), settings, wheel.rest(&found)).unwrap();
        for k in 1..=steps {
            stepper.advance().unwrap();
            let forces: Vec<[f64; 3]> = stepper.report().patches.iter().map(|p| p.force).collect();
            let apart = lateral(&forces) - force(k as f64 * step);
            assert!(apart.abs() < 1e-9 * load, "side {side}, step {k}: {apart} N");
            assert!(stepper.report().patches.iter().all(|p| p.closed > 10), "step {k}: {:?}", stepper.report());
        }
        assert_eq!(stepper.state().motions[0], found.motions[0]);
        assert_ne!(stepper.state().motions[1], found.motions[1]);
    }
}

/// Growth in time is the eigenvalue of the linear analysis, with both contacts sliding and with one of them in stick
/// in part: the difference of two marches, one of them moved along the eigenvector.
#[test]
fn growth_of_two_contacts_matches_the_eigenvalue() {
    for lateral in [[0.02, 0.03], [0.004, 0.03]] {
        let loads = Loads::of_patches(&[NormalLoad::Force(40e3), NormalLoad::Force(20e3)]);
        let wheel = Wheel::new(loads, lateral);
        let (steady, found) = wheel.steady();
        let contact = steady.contact(&found);
        let stick = contact.sticking();
        assert_eq!(stick > 0, lateral[0] < 0.01, "{stick} nodes stick");
        let pairs = reduced::eigenpairs(&wheel.pair, &contact, 1e-9).unwrap();
        let first = pairs.iter().find(|p| p.frequency() > 10.0 && p.damping_ratio() < 0.3).unwrap();
        let step = 5e-6;
        let mut settings = settings(wheel.loading().held_at(&found.motions), FrictionLaw::Constant(MU), step);
        settings.tolerance = 1e-13;
        let march = |start: State, steps: usize, seen: &mut dyn FnMut(usize, &Stepper<'_>)| {
            let mut stepper = Stepper::new(wheel.model(), settings.clone(), start).unwrap();
            for k in 0..steps {
                stepper.advance().unwrap();
                seen(k, &stepper);
            }
            stepper.state().clone()
        };
        // The state of rest of the scheme: modes stopped by hand until it has settled.
        let mut rest = wheel.rest(&found);
        for _ in 0..200 {
            rest = march(rest, 20, &mut |_, _| ());
            rest.v.iter_mut().for_each(|v| *v *= 0.5);
        }
        let amplitude = 1e-9 / first.modal.iter().map(|z| z.norm()).fold(0.0, f64::max);
        let moved = rest.clone().perturbed(&first.modal, first.value, amplitude);
        let course = |start: State| {
            let mut all = Vec::new();
            march(start, 4000, &mut |k, s| {
                if k > 800 && k % 40 == 0 {
                    all.push(s.state().q.clone());
                }
            });
            all
        };
        let (calm, moved) = (course(rest), course(moved));
        let apart: Vec<Vec<f64>> =
            calm.iter().zip(&moved).map(|(a, b)| a.iter().zip(b).map(|(a, b)| b - a).collect()).collect();
        let (sigma, frequency) = oscillation(&apart, 40.0 * step, first.frequency());
        let want = first.growth_rate();
        assert!((sigma - want).abs() < 0.2 + 0.02 * want.abs(), "{lateral:?}: growth {sigma}, linear {want}");
        assert!((frequency / first.frequency() - 1.0).abs() < 1e-3, "{frequency} Hz");
    }
}

/// Growth rate, 1/s, and frequency, Hz, of one oscillation sampled at an `interval`, s, by x₊ = a x − b x₋ in the sense
/// of least squares (Prony); `about` tells the turns between two samples.
fn oscillation(samples: &[Vec<f64>], interval: f64, about: f64) -> (f64, f64) {
    let (mut m, mut rhs) = ([0.0; 3], [0.0; 2]);
    for w in samples.windows(3) {
        for k in 0..w[0].len() {
            let (x, y, z) = (w[1][k], -w[0][k], w[2][k]);
            [m[0], m[1], m[2]] = [m[0] + x * x, m[1] + x * y, m[2] + y * y];
            rhs = [rhs[0] + x * z, rhs[1] + y * z];
        }
    }
    let det = m[0] * m[2] - m[1] * m[1];
    let (a, b) = ((rhs[0] * m[2] - rhs[1] * m[1]) / det, (m[0] * rhs[1] - m[1] * rhs[0]) / det);
    let (r, turns) = (b.sqrt(), (about * interval).round());
    let part = (a / (2.0 * r)).acos() / (2.0 * PI);
    let nearest = [turns + part, turns - part].map(|t| t / interval);
    let nearest = nearest.into_iter().min_by(|x, y| (x - about).abs().total_cmp(&(y - about).abs()));
    (r.ln() / interval, nearest.unwrap())
}
