use super::backward_errors::{BackwardErrors, Vectors};
use super::eigenvectors::Lifted;
use super::*;
use crate::body::half_space::HalfSpace;
use crate::body::ReducedBody;
use crate::contact::{ContactCreepage, NormalLoad, PatchKinematics, SteadyProblem, Stencil};
use crate::friction::{Exponential, FrictionLaw};
use crate::grid::Interface;
use crate::model::combined_compliance;
use crate::stability::reduced::{self, assemble};
use faer::Mat;

const MODES: [usize; 2] = [50, 30];

/// Two half-spaces with modes that move the contact as a whole and tilt it; those of the upper body are tied by a
/// damping like that of rotation, two by two.
fn bodies(s: &Interface) -> CoupledModel {
    let steel = HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let body = |count: usize, seed: f64| {
        let omega: Vec<f64> = (0..count).map(|k| 2.0 * PI * (300.0 + 95.0 * (k + k % 2) as f64 + seed)).collect();
        let modes = Mat::from_fn(3 * s.len(), count, |i, k| {
            let [x, y] = s.point(i / 3);
            let phase = 2.3 * k as f64 + seed;
            0.05 * ((1.7 * (i % 3) as f64 + phase).sin() + 10.0 * (x * phase.cos() + y * (2.0 * phase).sin()))
        });
        let mut compliance = steel.clone();
        for k in 0..count {
            for j in 0..3 * s.len() {
                for i in 0..3 * s.len() {
                    compliance[(i, j)] += modes[(i, k)] * modes[(j, k)] / omega[k].powi(2);
                }
            }
        }
        ReducedBody::new(omega, vec![0.4; count], modes, compliance)
    };
    let lower = body(MODES[0], 0.0);
    let mut upper = body(MODES[1], 40.0);
    upper.damping = Mat::from_fn(MODES[1], MODES[1], |i, j| match (i, j) {
        // Damped to death, in the company of another one.
        (21, 21) => 6e4,
        _ if i == j => 0.3 + 0.01 * i as f64,
        _ if i / 2 == j / 2 => {
            if i < j {
                30.0
            } else {
                -30.0
            }
        }
        (2, 9) | (9, 2) => 0.5,
        _ => 0.0,
    })
    .into();
    CoupledModel::new(&lower, &upper).unwrap()
}

fn interface() -> Interface {
    Interface::paraboloid(9, 9, [7e-3; 2], [4.0; 2]).unwrap()
}

fn contact(s: &Interface, pair: &CoupledModel, friction: FrictionLaw, lateral: f64) -> LinearContact {
    let w = combined_compliance(
        HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap().as_ref(),
        HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap().as_ref(),
    )
    .unwrap();
    assert_eq!(w.nrows(), pair.compliance.nrows());
    let problem = SteadyProblem {
        interface: s,
        compliance: w.as_ref().into(),
        friction: friction.into(),
        kinematics: PatchKinematics::one(10.0, ContactCreepage { lateral, spin: 0.3, ..ContactCreepage::default() }),
        loads: NormalLoad::Force(7e4).into(),
        stencil: Stencil::default(),
        tolerance: 1e-10,
        max_iterations: 200,
    };
    problem.contact(&problem.solve().unwrap())
}

fn cases(s: &Interface, pair: &CoupledModel) -> Vec<LinearContact> {
    let falling = |velocity: f64| FrictionLaw::from(Exponential::new(0.4, 0.3, velocity).remembering(4e-4));
    vec![
        contact(s, pair, FrictionLaw::Constant(0.3), 0.01),
        contact(s, pair, FrictionLaw::Constant(0.4), 0.002),
        contact(s, pair, falling(0.3), 0.005),
    ]
}

fn inside(value: C, ratio: f64) -> bool {
    value.im >= 0.0 && (value.re > 0.0 || -value.re <= ratio * value.norm())
}

/// Full sliding, stick and slip, friction that falls and is remembered: what is listed of the dense pencil, value by
/// value and vector by vector.
#[test]
fn they_are_those_of_the_dense_pencil() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let mut growing = 0;
    for (number, contact) in cases(&s, &pair).iter().enumerate() {
        let all = reduced::eigenpairs(&pair, contact, 1e-8).unwrap();
        let found =
            eigenpairs(&pair, contact, [0.3, 1e-10], &memory).unwrap().unwrap_or_else(|| panic!("case {number}: none"));
        let listed = |of: &[Eigenpair]| of.iter().filter(|p| inside(p.value, 0.3)).cloned().collect::<Vec<_>>();
        let (want, got) = (listed(&all), listed(&found));
        assert!(want.len() >= MODES[0] + MODES[1] - 2, "case {number}: {} listed", want.len());
        assert_eq!(got.len(), want.len(), "case {number}");
        growing += want.iter().filter(|p| p.value.re > 0.0).count();
        for w in &want {
            let near = |p: &&Eigenpair| (p.value - w.value).norm();
            let g = got.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
            assert!(near(&g) <= 1e-9 * w.value.norm(), "case {number}: {} against {}", g.value, w.value);
            let square = |v: &[C]| v.iter().map(C::norm_sqr).sum::<f64>();
            let product: C = g.modal.iter().zip(&w.modal).map(|(a, b)| a.conj() * b).sum();
            let alike = product.norm_sqr() / (square(&g.modal) * square(&w.modal));
            assert!((alike - 1.0).abs() < 1e-5, "case {number}: {} has another motion, {alike}", w.value);
            let size = (square(&g.tangential) / square(&w.tangential)).sqrt();
            assert!((size - 1.0).abs() < 1e-4, "case {number}: {}: forces {size} times as large", w.value);
        }
    }
    assert!(growing > 0, "nothing grows");
}

/// The same bodies with the modes `of` contact row and mode.
fn with_modes(s: &Interface, of: impl Fn(usize, usize) -> f64) -> CoupledModel {
    let pair = bodies(s);
    CoupledModel { modes: Mat::from_fn(3 * s.len(), pair.omega.len(), of), ..pair }
}

/// Bodies that move by the same nine functions over the contact share them, as a wheel and a rail do; others have their
/// own. Either way their eigenvalues are those of the dense pencil.
#[test]
fn functions_are_shared_where_bodies_have_the_same() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let phase = |i: usize, k: usize, n: usize| ((1.3 + 0.4 * n as f64) * k as f64 + 0.7 * (i % 3) as f64).sin();
    let alike = with_modes(&s, |i, k| {
        let [x, y] = s.point(i / 3);
        0.05 * (phase(i, k, 0) + 10.0 * (x * phase(i, k, 1) + y * phase(i, k, 2)))
    });
    let apart = with_modes(&s, |i, k| {
        let [x, y] = s.point(i / 3);
        let bent = if k < MODES[0] { 10.0 * x } else { 1e3 * x * y };
        0.05 * if k < MODES[0] { phase(i, k, 0) + bent * phase(i, k, 1) } else { bent * phase(i, k, 2) }
    });
    for (pair, blocks) in [(&alike, vec![[0, 6]]), (&apart, vec![[0, 4], [4, 2]])] {
        for (number, contact) in cases(&s, pair).iter().enumerate() {
            memory.remember(LastState::default());
            let problem = NonlinearEigenproblem::new(pair, contact, 0.3, &memory).unwrap().unwrap();
            assert_eq!(problem.modes.blocks(), blocks);
            let all = reduced::eigenpairs(pair, contact, 1e-8).unwrap();
            let found = eigenpairs(pair, contact, [0.3, 1e-10], &memory)
                .unwrap()
                .unwrap_or_else(|| panic!("case {number}: none"));
            let listed = |of: &[Eigenpair]| of.iter().filter(|p| inside(p.value, 0.3)).cloned().collect::<Vec<_>>();
            let (want, got) = (listed(&all), listed(&found));
            assert_eq!(got.len(), want.len(), "case {number}");
            for w in &want {
                let g = got.iter().map(|p| (p.value - w.value).norm()).fold(f64::INFINITY, f64::min);
                assert!(g <= 1e-9 * w.value.norm(), "case {number}: {} is {g} off", w.value);
            }
        }
    }
}

/// Without motions the eigenvalues are the same ones, in the same order.
#[test]
fn eigenvalues_come_without_motions() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    for contact in cases(&s, &pair) {
        let with = eigenpairs(&pair, &contact, [0.3, 1e-10], &memory).unwrap().unwrap();
        memory.remember(LastState::default());
        let without = eigenvalues(&pair, &contact, [0.3, 1e-10], &memory).unwrap().unwrap();
        let upper: Vec<&Eigenpair> = with.iter().filter(|p| p.value.im > 0.0).collect();
        assert!(without.len() == upper.len() && upper.len() > 70);
        for (a, b) in without.iter().zip(upper) {
            assert!((a.value - b.value).norm() <= 1e-11 * b.value.norm(), "{} {}", a.value, b.value);
            assert!(a.modal.is_empty() && a.backward_error < 1e-12, "{}", a.backward_error);
        }
        // A tolerance below rounding is not met.
        assert!(eigenvalues(&pair, &contact, [0.3, 1e-20], &memory).unwrap().is_none());
    }
}

/// Backward errors are those in the whole pencil, also of what is no eigenvalue; from the contact's side they are a
/// little larger, never smaller.
#[test]
fn errors_are_those_of_the_pencil() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    for contact in cases(&s, &pair) {
        let problem = NonlinearEigenproblem::new(&pair, &contact, 0.3, &memory).unwrap().unwrap();
        let roots = problem.roots().unwrap();
        let pencil = assemble(&pair, &contact, None).unwrap();
        let scaled = BackwardErrors::new(&problem.modes, &problem.contact.rows);
        let norms = [pencil.a.norm_l2(), pencil.e.norm_l2()];
        let same = [(scaled.rate, pencil.scales.rate), (scaled.force, pencil.scales.force)];
        for (a, b) in same.into_iter().chain(scaled.norms().into_iter().zip(norms)) {
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
        for off in [1e-7, 1e-4] {
            let beside: Vec<C> = roots.iter().map(|v| v * C::new(1.0 + off, off)).collect();
            let (forces, motions) = problem.forces(&beside);
            let Lifted { modal, own, squares, errors } =
                problem.lifted(&pair, &scaled, &beside, problem.modes.motions(&beside, &forces));
            let least = problem.modes.least(&beside, &forces);
            let x = Vectors { values: &beside, motions: &motions, own: &own, squares: &least };
            let bounds = scaled.errors(&problem.contact.rows, &x, &forces);
            for l in 0..beside.len() {
                let of = |m: &Mat<C>| m.col_as_slice(l).to_vec();
                let value = beside[l];
                let x = Eigenpair { value, modal: of(&modal), tangential: of(&own), backward_error: 0.0 };
                let x = pencil.vector(&x);
                let value = value / pencil.scales.rate;
                let residual = pencil.residuals(&[value], &Mat::from_fn(x.len(), 1, |i, _| x[i]))[0];
                let norm = x.iter().map(C::norm_sqr).sum::<f64>().sqrt();
                let want = residual / ((norms[0] + value.norm() * norms[1]) * norm);
                assert!((errors[l] / want - 1.0).abs() < 1e-5, "{value}: {} against {want}", errors[l]);
                let of_q = of(&modal).iter().map(C::norm_sqr).sum::<f64>();
                assert!((squares[l] / of_q - 1.0).abs() < 1e-12 && least[l] <= of_q * (1.0 + 1e-9));
                assert!(bounds[l] >= want * (1.0 - 1e-5) && bounds[l] < 30.0 * want, "{value}: {} {want}", bounds[l]);
            }
        }
    }
}

/// Modal data at the contact are kept for other closed nodes, not for other bodies.
#[test]
fn modes_are_kept_for_the_same_bodies() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let (all, some): (Vec<usize>, Vec<usize>) = ((0..3 * s.len()).collect(), (60..90).collect());
    let (first, _) = ModalCompliance::build(&pair, &all, 1.9, &memory).unwrap();
    let (again, shapes) = ModalCompliance::build(&pair, &some, 1.9, &memory).unwrap();
    assert!(Rc::ptr_eq(&first, &again));
    let asked = pair.modes.as_ref() * again.contact_basis().transpose();
    for (row, j) in (0..3 * s.len()).flat_map(|row| (0..again.rank).map(move |j| (row, j))) {
        let want = if some.contains(&row) { asked[(row, j)] } else { 0.0 };
        assert!((shapes[(row, j)] - want).abs() < 1e-14);
    }
    // A row that moves as none did.
    let mut other = pair.clone();
    other.modes[(70, 3)] += 0.01;
    assert!(!Rc::ptr_eq(&first, &ModalCompliance::build(&other, &some, 1.9, &memory).unwrap().0));
    let mut damped = pair.clone();
    damped.damping = damped.damping.with_diagonal(&[0.1; MODES[0] + MODES[1]]);
    assert!(!Rc::ptr_eq(&first, &ModalCompliance::build(&damped, &some, 1.9, &memory).unwrap().0));
}

/// The count detects a missing eigenvalue: where an unlisted one stands in the place of a listed one, each is single.
#[test]
fn one_that_is_missing_is_noticed() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    for contact in cases(&s, &pair) {
        let problem = NonlinearEigenproblem::new(&pair, &contact, 0.3, &memory).unwrap().unwrap();
        let roots = problem.roots().unwrap();
        assert_eq!(problem.missing(&roots), Some(0));
        let all = reduced::eigenpairs(&pair, &contact, 1e-8).unwrap();
        let damped = |p: &&Eigenpair| p.value.im > 0.2 * p.value.norm() && !inside(p.value, 0.4);
        let other = all.iter().find(damped).map_or(C::new(-9e3, 9e3), |p| p.value);
        for place in [0, 7, roots.len() - 1] {
            let mut wrong = roots.clone();
            wrong[place] = other;
            let missing = 2 * i64::from(problem.aside(roots[place]) <= 0.0);
            assert_eq!(problem.missing(&wrong), Some(missing), "without {}", roots[place]);
        }
        // They are found again, with others in their places.
        let some: Vec<C> = roots.iter().copied().skip(3).chain([other]).collect();
        assert_eq!(problem.missing(&some), Some(6));
        memory.remember(LastState { poles: problem.modes.poles.clone(), roots: some, ..LastState::default() });
        let again = problem.roots().unwrap();
        for root in roots.iter().filter(|v| problem.aside(**v) <= 0.0) {
            assert!(again.iter().any(|v| (v - root).norm() < 1e-10 * root.norm()), "{root} is missing");
        }
    }
}

/// Along a line of states, back, and on by another step: the roots that go on from those before are those found from
/// nothing, and they are taken to go on where the contact does.
#[test]
fn roots_go_on_from_state_to_state() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let problem = |friction: f64| {
        let contact = contact(&s, &pair, FrictionLaw::Constant(friction), 0.01);
        NonlinearEigenproblem::new(&pair, &contact, 0.3, &memory).unwrap().unwrap()
    };
    let mut ahead = 0;
    for friction in [0.3, 0.31, 0.32, 0.33, 0.31, 0.3, 0.36] {
        let problem = problem(friction);
        let last = memory.last();
        let starts = last.predicted(&problem.compared());
        let found = problem.roots().unwrap();
        memory.remember(LastState::default());
        let anew = problem.roots().unwrap();
        memory.remember(last.clone());
        assert_eq!(problem.roots().unwrap().len(), found.len());
        for root in anew.iter().filter(|v| problem.aside(**v) <= 0.0) {
            let near = |of: &[C]| of.iter().map(|v| (v - root).norm()).fold(f64::INFINITY, f64::min);
            assert!(near(&found) < 1e-10 * root.norm(), "{friction}: {root} is {} off", near(&found));
            ahead += usize::from(!starts.is_empty() && near(&starts) < 0.2 * near(&last.roots));
        }
    }
    assert!(ahead > 100, "{ahead} were predicted");
}

/// Bodies that are a little different, and what the dense pencil has found: the roots that go on from these are those
/// found from nothing.
#[test]
fn roots_go_on_to_other_bodies() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let mut damped = pair.clone();
    damped.damping = damped.damping.with_diagonal(&[0.1; MODES[0] + MODES[1]]);
    let contact = contact(&s, &pair, FrictionLaw::Constant(0.3), 0.01);
    let problem = |pair: &CoupledModel| NonlinearEigenproblem::new(pair, &contact, 0.3, &memory).unwrap().unwrap();
    let anew = |pair: &CoupledModel| {
        memory.remember(LastState::default());
        problem(pair).roots().unwrap()
    };
    let (first, want) = (anew(&pair), anew(&damped));
    let near = |of: &[C], root: &C| of.iter().map(|v| (v - root).norm()).fold(f64::INFINITY, f64::min);
    let inside = |of: &NonlinearEigenproblem, v: &&C| of.aside(**v) <= 0.0;
    let same = |other: &NonlinearEigenproblem, found: &[C]| {
        for root in want.iter().filter(|v| inside(other, v)) {
            assert!(near(found, root) < 1e-10 * root.norm(), "{root} is {} off", near(found, root));
        }
    };
    // From those of the other bodies.
    memory.remember(LastState { poles: problem(&pair).modes.poles.clone(), roots: first, ..LastState::default() });
    let other = problem(&damped);
    let last = memory.last();
    assert!(last.is_near(&other.modes.poles) && last.poles != other.modes.poles);
    same(&other, &other.roots().unwrap());
    // From the dense pencil.
    memory.remember(LastState::default());
    memory.begin_at(reduced::eigenpairs(&damped, &contact, 1e-8).unwrap().iter().map(|p| p.value));
    let starts = memory.last().roots;
    assert!(want.iter().filter(|v| inside(&other, v)).all(|v| near(&starts, v) < 1e-9 * v.norm()));
    same(&other, &other.roots().unwrap());
}

/// A state that others are continued from, and its spectrum with some of the least damped eigenvalues tracked.
fn begun(s: &Interface, pair: &CoupledModel, tracked: usize, memory: &SpectrumMemory) -> (LastSpectrum, KnownSpectrum) {
    memory.restore(&LastSpectrum::default());
    let base = contact(s, pair, FrictionLaw::Constant(0.3), 0.01);
    let mut all = eigenpairs(pair, &base, [0.3, 1e-10], memory).unwrap().unwrap();
    all.retain(|p| p.value.im > 0.0);
    all.sort_by(|a, b| a.damping_ratio().total_cmp(&b.damping_ratio()));
    let wanted: Vec<C> = all.iter().take(tracked).map(|p| p.value).collect();
    let state = memory.present();
    let known = KnownSpectrum::of_state(&state, &wanted).unwrap();
    assert_eq!(known.tracked(), tracked);
    (state, known)
}

/// The eigenvalues that are continued to a contact, all counted or none.
fn continuation(
    bodies: &CoupledModel,
    contact: &LinearContact,
    (known, counted): (&KnownSpectrum, bool),
    memory: &SpectrumMemory,
) -> Option<TrackedSpectrum> {
    track(bodies, contact, known, [0.3, 1e-10], &|_| counted, memory).unwrap()
}

/// Eigenvalues that are continued from another friction, creepage and damping, many or a few of them, are those of the
/// dense pencil with their motions, and all that grow are among them.
#[test]
fn continued_eigenvalues_are_those_of_the_dense_pencil() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let mut damped = pair.clone();
    damped.damping = damped.damping.with_diagonal(&[0.1; MODES[0] + MODES[1]]);
    let mut growing = 0;
    for tracked in [40, 12] {
        let (state, known) = begun(&s, &pair, tracked, &memory);
        for (bodies, friction, lateral) in [(&pair, 0.31, 0.01), (&pair, 0.28, 0.012), (&damped, 0.305, 0.0095)] {
            memory.restore(&state);
            let contact = contact(&s, bodies, FrictionLaw::Constant(friction), lateral);
            let found =
                continuation(bodies, &contact, (&known, true), &memory).unwrap_or_else(|| panic!("{friction}: none"));
            let all = reduced::eigenpairs(bodies, &contact, 1e-8).unwrap();
            assert_eq!(found.pairs.len(), tracked);
            for f in &found.pairs {
                let far = |p: &&Eigenpair| (p.value - f.value).norm();
                let w = all.iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
                assert!(far(&w) <= 1e-9 * w.value.norm(), "{friction}: {} against {}", f.value, w.value);
                let square = |v: &[C]| v.iter().map(C::norm_sqr).sum::<f64>();
                let product: C = f.modal.iter().zip(&w.modal).map(|(a, b)| a.conj() * b).sum();
                let alike = product.norm_sqr() / (square(&f.modal) * square(&w.modal));
                assert!((alike - 1.0).abs() < 1e-5, "{friction}: {} has another motion, {alike}", w.value);
            }
            let is_found =
                |w: &&Eigenpair| found.pairs.iter().any(|f| (f.value - w.value).norm() <= 1e-9 * w.value.norm());
            let mut grows = all.iter().filter(|p| p.value.im > 0.0 && p.value.re > 0.0);
            growing += grows.clone().count();
            // The count says so; with few tracked ones among many with little damping it is not always certain.
            assert!(grows.all(|w| is_found(&w)), "{tracked}, {friction}");
            assert!(tracked < 40 || found.count == Count::Complete, "{friction}");
            // Whether it is made or not, the eigenvalues are the same.
            memory.restore(&state);
            let without = continuation(bodies, &contact, (&known, false), &memory).unwrap();
            assert_eq!(without.count, Count::NotAsked);
            assert!(without.pairs.iter().zip(&found.pairs).all(|(a, b)| a.value == b.value));
        }
    }
    assert!(growing > 0, "nothing grows");
}

/// Eigenvalues that begin from one state depend on it alone, to the last bit.
#[test]
fn continued_eigenvalues_do_not_depend_on_those_before() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let (state, known) = begun(&s, &pair, 40, &memory);
    let at = |friction: f64| {
        memory.restore(&state);
        let contact = contact(&s, &pair, FrictionLaw::Constant(friction), 0.01);
        let found = continuation(&pair, &contact, (&known, false), &memory).unwrap();
        found.pairs.iter().flat_map(|p| [p.value.re.to_bits(), p.value.im.to_bits()]).collect::<Vec<u64>>()
    };
    let first = at(0.31);
    at(0.29);
    assert_eq!(at(0.31), first);
}

/// A root that is not tracked and grows is counted, and one that grows already is not taken for it.
#[test]
fn growth_that_is_not_tracked_is_noticed() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let (state, known) = begun(&s, &pair, 40, &memory);
    let growing = known.tracked.iter().position(|v| v.re > 0.0).expect("one that grows");
    let contact = contact(&s, &pair, FrictionLaw::Constant(0.31), 0.01);
    let root = known.tracked[growing];
    let wanted: Vec<C> = known.tracked.iter().copied().filter(|v| *v != root).collect();
    let found = |of: &dyn Fn(C) -> C| {
        memory.restore(&state);
        let mut other = KnownSpectrum::of_state(&state, &wanted).unwrap();
        other.others.iter_mut().filter(|v| **v == root).for_each(|v| *v = of(root));
        continuation(&pair, &contact, (&other, true), &memory).map(|found| found.count)
    };
    assert_eq!(found(&|v| v), None, "taken for another one");
    assert_eq!(found(&|v| C::new(-0.01 * v.im, v.im)), Some(Count::Refused), "not counted");
    memory.restore(&state);
    assert_eq!(continuation(&pair, &contact, (&known, true), &memory).map(|found| found.count), Some(Count::Complete));
}

/// Modes that friction which falls drives harder than they oscillate have real eigenvalues, which no root stands for.
#[test]
fn growth_without_oscillation_is_left_to_the_dense_pencil() {
    let s = interface();
    let memory = SpectrumMemory::default();
    let pair = bodies(&s);
    let mut contact = contact(&s, &pair, FrictionLaw::Constant(0.3), 0.01);
    for n in &mut contact.nodes {
        if let crate::contact::Tangent::Slip(slip) = &mut n.tangent {
            slip.falling = slip.direction.map(|t| -8e3 * t);
        }
    }
    let all = reduced::eigenpairs(&pair, &contact, 1e-6).unwrap();
    let real = all.iter().filter(|p| p.value.im == 0.0 && p.value.re > 0.0).count();
    assert!(real > 0, "nothing grows without oscillating");
    assert!(eigenpairs(&pair, &contact, [0.3, 1e-8], &memory).unwrap().is_none());
}
