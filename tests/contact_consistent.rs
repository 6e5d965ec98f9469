//! Contact laws at points of quadrature, in steady rolling and in time, against closed forms, CONTACT, the nodal laws
//! and the paper's fixed point.

use faer::Mat;
use railsqueal::body::half_space::HalfSpace;
use railsqueal::contact::consistent::{augmentation, ConsistentSolution, ConsistentSteady, ConsistentSurface};
use railsqueal::contact::{ContactCreepage, NormalLoad, PatchKinematics, SteadyProblem, Stencil};
use railsqueal::friction::{Exponential, FrictionLaw};
use railsqueal::grid::Interface;
use railsqueal::model::combined_compliance;
use railsqueal::transient::{ContactSolver, Loading, Model, Scheme, Settings, State, Stepper};
use railsqueal::Error;

const STEEL: HalfSpace = HalfSpace { young: 205e9, poisson: 0.3 };
const MU: f64 = 0.3;
const LOAD: f64 = 70e3;
/// Hertz's radius (m) and pressure (Pa).
const A: f64 = 4.884e-3;
const P0: f64 = 1401.0e6;

/// Two steel bodies on a grid with the distance `h` of its nodes, m.
struct Pair {
    interface: Interface,
    w: Mat<f64>,
}

impl Pair {
    /// With radii of 0.5 m both ways.
    fn new(h: f64) -> Self {
        let k = (7e-3 / h).round() as usize;
        Self::of(2 * k + 1, 2 * k + 1, h, [4.0, 4.0])
    }

    fn of(nx: usize, ny: usize, h: f64, curvature: [f64; 2]) -> Self {
        let half = [nx, ny].map(|n| 0.5 * (n - 1) as f64 * h);
        let interface = Interface::paraboloid(nx, ny, half, curvature).unwrap();
        let one = STEEL.compliance(&interface.patches[0].x, &interface.patches[0].y).unwrap();
        let w = combined_compliance(one.as_ref(), one.as_ref()).unwrap();
        Self { interface, w }
    }

    fn problem(&self, creepage: [f64; 3]) -> SteadyProblem<'_> {
        let [longitudinal, lateral, spin] = creepage;
        SteadyProblem {
            interface: &self.interface,
            compliance: self.w.as_ref().into(),
            friction: FrictionLaw::Constant(MU).into(),
            kinematics: PatchKinematics::one(10.0, ContactCreepage { longitudinal, lateral, spin }),
            loads: NormalLoad::Force(LOAD).into(),
            stencil: Stencil::default(),
            tolerance: 1e-9,
            max_iterations: 200,
        }
    }

    fn solve(&self, creepage: [f64; 3], scale: f64) -> ConsistentSolution {
        let mut problem = ConsistentSteady::new(self.problem(creepage));
        problem.augmentation.normal *= scale;
        problem.augmentation.tangential *= scale;
        let found = problem.solve().unwrap();
        assert!(found.solution.residual <= 1e-9, "residual {}", found.solution.residual);
        found
    }

    fn reaction(&self, found: &ConsistentSolution) -> Vec<f64> {
        let s = &found.solution;
        let of = |i: usize| [s.traction[i][0], s.traction[i][1], s.pressure[i]].map(|v| v * self.interface.weight[i]);
        (0..self.interface.len()).flat_map(of).collect()
    }
}

fn top(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// Area, largest pressure and approach of Hertz; by both quadratures, with the orders in which they come near.
#[test]
fn normal_contact_is_hertz() {
    let area = std::f64::consts::PI * A * A;
    let mut errors: Vec<[f64; 4]> = Vec::new();
    for h in [1e-3, 0.5e-3] {
        let pair = Pair::new(h);
        let nodal = pair.problem([0.0; 3]).solve().unwrap();
        let closed =
            (0..nodal.state.len()).filter(|&i| nodal.state[i] > 0).map(|i| pair.interface.weight[i]).sum::<f64>();
        let found = pair.solve([0.0; 3], 1.0);
        let off = |a: f64, b: f64| (a / b - 1.0).abs();
        let peak = top(found.field.iter().map(|f| f[2]));
        errors.push([
            off(closed, area),
            off(found.area[0], area),
            off(peak, P0),
            off(found.solution.motions[0], 95.43e-6),
        ]);
        // Forces are integrals of what is projected: none pulls, and they carry the load.
        assert!(found.solution.pressure.iter().all(|&p| p >= 0.0));
        assert!((found.solution.force[2] + LOAD).abs() < 1e-8 * LOAD);
    }
    let orders = [0, 1, 2, 3].map(|k| (errors[0][k] / errors[1][k]).log2());
    println!("area nodal, area, p0, approach: {errors:?}, orders {orders:?}");
    assert!(errors[1][1] < 0.01 && errors[1][2] < 5e-3 && errors[1][3] < 1e-3, "{errors:?}");
    assert!(orders[1] > 1.0 && orders[2] > 1.0 && orders[3] > 1.0, "{errors:?}, orders {orders:?}");
}

#[test]
fn lateral_forces_come_near_those_of_contact() {
    let pairs = [1e-3, 0.5e-3].map(Pair::new);
    for (eta, want) in [(0.001, -0.3005), (0.003, -0.7177), (0.005, -0.9304)] {
        let found = [0, 1].map(|k| pairs[k].solve([0.0, eta, 0.0], 1.0));
        let errors = [0, 1].map(|k| (found[k].solution.force[1] / (MU * LOAD) / want - 1.0).abs());
        println!("eta {eta}: {errors:?}, order {}", (errors[0] / errors[1]).log2());
        assert!(errors[1] < 0.035 && errors[1] < 0.6 * errors[0], "eta {eta}: {errors:?}");
        assert!(found[1].solution.force[0].abs() < 1e-6 * LOAD, "longitudinal force {:?}", found[1].solution.force);
        // Sliding points act against the creep, and no traction exceeds its bound: neither does a mean of them.
        let s = &found[1].solution;
        for (t, p) in s.traction.iter().zip(&s.pressure) {
            assert!(t[0].hypot(t[1]) <= MU * p * (1.0 + 1e-8) + 1e-6 * P0 * 1e-3, "{t:?} under {p}");
        }
    }
}

#[test]
fn all_of_it_slides_at_large_creepage() {
    let pair = Pair::new(1e-3);
    for (creepage, force) in [([0.0, 0.02, 0.0], [0.0, -1.0]), ([0.012, 0.016, 0.0], [-0.6, -0.8])] {
        let found = pair.solve(creepage, 1.0);
        let total =
            found.solution.traction.iter().zip(&pair.interface.weight).map(|(t, w)| w * t[0].hypot(t[1])).sum::<f64>();
        assert!((total / (MU * LOAD) - 1.0).abs() < 2e-3, "{total} N");
        for c in 0..2 {
            assert!((found.solution.force[c] / (MU * LOAD) - force[c]).abs() < 5e-3, "{:?}", found.solution.force);
        }
        assert_eq!(found.area[1], 0.0, "some of it sticks");
    }
}

/// The equations are exact where their points are all closed or all open; ρ is seen in the cells of the border alone,
/// less on a finer grid.
#[test]
fn what_depends_on_the_augmentation_vanishes_with_the_grid() {
    let spread = [1e-3, 0.5e-3].map(|h| {
        let pair = Pair::new(h);
        let found = [0.1, 1.0, 10.0].map(|scale| {
            let found = pair.solve([0.0, 0.003, 0.0], scale).solution;
            [found.force[1] / (MU * LOAD), found.motions[0] / 95.43e-6]
        });
        [0, 1].map(|k| {
            let all = found.map(|f| f[k]);
            top(all.into_iter().map(|v| v - all[0])) - all.into_iter().map(|v| v - all[0]).fold(0.0, f64::min)
        })
    });
    println!("spread of F_y/muN and approach over a hundredfold rho: {spread:?}");
    assert!(spread[1].iter().zip(spread[0]).all(|(fine, coarse)| *fine < 0.7 * coarse && *fine < 0.01), "{spread:?}");
}

/// A contact without friction does not know x from y.
#[test]
fn a_turned_contact_is_the_same() {
    let free = |pair: &Pair| {
        let problem = SteadyProblem {
            friction: FrictionLaw::Constant(0.0).into(),
            loads: NormalLoad::Force(20e3).into(),
            ..pair.problem([0.0, 0.01, 0.0])
        };
        let found = ConsistentSteady::new(problem).solve().unwrap();
        assert!(found.solution.traction.iter().all(|t| t[0].hypot(t[1]) <= 1e-9 * P0));
        found
    };
    let along = Pair::of(17, 13, 1e-3, [3.0, 6.0]);
    let across = Pair::of(13, 17, 1e-3, [6.0, 3.0]);
    let (a, b) = (free(&along), free(&across));
    let mut seen = 0;
    for iy in 0..13 {
        for ix in 0..17 {
            let (p, q) = (a.field[ix + 17 * iy][2], b.field[iy + 13 * ix][2]);
            assert!((p - q).abs() < 1e-6 * P0, "({ix}, {iy}): {p} and {q}");
            seen += usize::from(p > 0.1 * P0);
        }
    }
    assert!(seen > 20 && (a.solution.motions[0] / b.solution.motions[0] - 1.0).abs() < 1e-8);
}

#[test]
fn what_it_is_not_for_is_refused() {
    let pair = Pair::new(1e-3);
    let falling =
        SteadyProblem { friction: Exponential::new(0.4, 0.25, 0.2).into(), ..pair.problem([0.0, 0.003, 0.0]) };
    assert!(matches!(ConsistentSteady::new(falling).solve(), Err(Error::Job(m)) if m.contains("contact.quadrature")));
    // The contact lies within, but no more than by its neighbours.
    let heavy = SteadyProblem { loads: NormalLoad::Force(280e3).into(), ..pair.problem([0.0; 3]) };
    assert!(matches!(ConsistentSteady::new(heavy).solve(), Err(Error::Job(m)) if m.contains("contact.patch")));
    let open = SteadyProblem { loads: NormalLoad::Approach(-1e-6).into(), ..pair.problem([0.0; 3]) };
    assert_eq!(ConsistentSteady::new(open).solve().unwrap().area, [0.0; 2]);
}

/// ∫Nᵀ of the projections of equation (3) over all cells, written down once more: `u` (x, y, n) at the nodes.
fn projected(s: &Interface, surface: &ConsistentSurface, forces: &[f64], u: &[f64], rho: [f64; 2]) -> Vec<f64> {
    let stress = surface.field(forces);
    let nx = s.patches[0].x.len();
    let mut out = vec![0.0; forces.len()];
    let root = 0.6f64.sqrt();
    let gauss = [(-root, 5.0 / 18.0), (0.0, 8.0 / 18.0), (root, 5.0 / 18.0)];
    for iy in 0..s.patches[0].y.len() - 1 {
        for ix in 0..nx - 1 {
            let i = ix + nx * iy;
            let corners = [i, i + 1, i + nx, i + nx + 1];
            let area = (s.patches[0].x[ix + 1] - s.patches[0].x[ix]) * (s.patches[0].y[iy + 1] - s.patches[0].y[iy]);
            for (x, v) in gauss {
                for (y, w) in gauss {
                    let (a, b) = (0.5 * (1.0 + x), 0.5 * (1.0 + y));
                    let n = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
                    let z: [f64; 3] = std::array::from_fn(|c| {
                        let rho = rho[usize::from(c < 2)];
                        (0..4).map(|k| n[k] * (stress[3 * corners[k] + c] - rho * u[3 * corners[k] + c])).sum()
                    });
                    let q = z[2].max(0.0);
                    let length = z[0].hypot(z[1]);
                    let f = if length > MU * q { MU * q / length } else { 1.0 };
                    for (k, &i) in corners.iter().enumerate() {
                        for (c, value) in [f * z[0], f * z[1], q].into_iter().enumerate() {
                            out[3 * i + c] += v * w * area * n[k] * value;
                        }
                    }
                }
            }
        }
    }
    out
}

/// Rolls from the steady state, whose approach is kept, with a step in which the material goes half the distance of
/// the nodes.
fn rolling(
    pair: &Pair,
    load: NormalLoad,
    begin: [f64; 3],
    along: [f64; 3],
    with: impl FnOnce(&mut Stepper<'_>, &ConsistentSolution),
) {
    let found = pair.solve(begin, 1.0);
    let reaction = pair.reaction(&found);
    let none = Mat::<f64>::zeros(3 * pair.interface.len(), 0);
    let model = Model {
        interface: &pair.interface,
        residual: pair.w.as_ref(),
        modes: none.as_ref(),
        omega: &[],
        stiffness: vec![].into(),
        damping: vec![].into(),
        turning: None,
        carried: None,
        load: &[],
    };
    let problem = pair.problem(along);
    let load = match load {
        NormalLoad::Approach(_) => NormalLoad::Approach(found.solution.motions[0]),
        force => force,
    };
    let settings = Settings {
        scheme: Scheme { step: 0.5e-3 / problem.kinematics[0].speed, theta: 0.5 },
        friction: FrictionLaw::Constant(MU).into(),
        solver: ContactSolver::Newton,
        tolerance: 1e-10,
        drive: Loading::constant(load, problem.kinematics[0].creepage, problem.kinematics[0].speed),
    };
    let start = State::at_rest(&model, &reaction, &found.solution.motions);
    let mut stepper = Stepper::new(model, settings, start).unwrap().consistent(augmentation(&problem)).unwrap();
    with(&mut stepper, &found);
}

/// A run that begins with full sliding or with no creepage, where w along the material is the same for every step,
/// stays there; one in partial slip comes to a state near the steady one: the first-order difference over the way of
/// a step is not the derivative.
#[test]
fn steady_rolling_goes_on() {
    let pair = Pair::new(1e-3);
    for (creepage, load) in [([0.0, 0.02, 0.0], NormalLoad::Force(LOAD)), ([0.0, 0.02, 0.0], NormalLoad::Approach(0.0))]
    {
        rolling(&pair, load, creepage, creepage, |stepper, found| {
            let before = stepper.state().reaction.clone();
            (0..30).for_each(|_| stepper.advance().unwrap());
            let off = top(stepper.state().reaction.iter().zip(&before).map(|(a, b)| (a - b).abs()));
            let peak = top(before.iter().skip(2).step_by(3).copied());
            println!("full sliding: moved by {:.2e} of the largest force", off / peak);
            assert!(off < 1e-3 * peak, "{off} of {peak} N");
            assert!((stepper.state().motions[0] / found.solution.motions[0] - 1.0).abs() < 1e-6);
            assert_eq!(stepper.report().stick(), 0);
        });
    }
    let creepage = [0.0, 0.003, 0.0];
    rolling(&pair, NormalLoad::Force(LOAD), creepage, creepage, |stepper, found| {
        (0..60).for_each(|_| stepper.advance().unwrap());
        let (now, then) = (stepper.report().force(), found.solution.force);
        println!("partial slip: F_y/muN {} steady, {} in time", then[1] / (MU * LOAD), now[1] / (MU * LOAD));
        assert!((now[1] / then[1] - 1.0).abs() < 0.03 && (now[2] / then[2] - 1.0).abs() < 1e-8, "{now:?}, {then:?}");
    });
}

/// A step is the fixed point of equation (3), to which the paper's iteration, slowed down, comes from elsewhere.
#[test]
fn a_step_is_the_fixed_point_of_the_paper() {
    let pair = Pair::new(1e-3);
    // The creepage turns, so that the reactions change in the step.
    rolling(&pair, NormalLoad::Approach(0.0), [0.0, 0.003, 0.0], [0.002, 0.003, 0.1], |stepper, _| {
        for _ in 0..3 {
            stepper.advance().unwrap();
        }
        let n = pair.interface.len();
        let surface = ConsistentSurface::new(&pair.interface.patches[0]);
        let rho = augmentation(&pair.problem([0.0; 3]));
        let rho = [rho.normal, rho.tangential / 0.5e-3];
        let posed = stepper.problem_view().unwrap();
        let (nodes, k) = (posed.nodes, posed.nodes.len());
        let wanted = &stepper.state().reaction;
        let peak = top(wanted.iter().skip(2).step_by(3).copied());
        let moved = |forces: &[f64]| {
            let mut u = vec![1.0; 3 * n];
            for (a, &i) in nodes.iter().enumerate() {
                for c in 0..3 {
                    let column = posed.matrix.col(3 * a + c);
                    let response: f64 = nodes
                        .iter()
                        .enumerate()
                        .map(|(b, j)| (0..3).map(|e| column[3 * b + e] * forces[3 * j + e]).sum::<f64>())
                        .sum();
                    u[3 * i + c] = posed.free[3 * a + c] + response;
                }
            }
            u
        };
        let error = |forces: &[f64]| top(forces.iter().zip(wanted).map(|(a, b)| (a - b).abs())) / peak;
        let mut forces: Vec<f64> = wanted.iter().map(|r| 0.9 * r).collect();
        let begun = error(&forces);
        for _ in 0..6000 {
            let next = projected(&pair.interface, &surface, &forces, &moved(&forces), rho);
            forces.iter_mut().zip(next).for_each(|(f, n)| *f += 0.06 * (n - *f));
        }
        println!("{k} nodes: from {begun:.1e} to {:.1e} of the largest force", error(&forces));
        assert!(begun > 0.05 && error(&forces) < 1e-6, "{}", error(&forces));
        let held = projected(&pair.interface, &surface, wanted, &moved(wanted), rho);
        assert!(error(&held) < 1e-8, "the reactions leave {:.1e}", error(&held));
    });
}
