use super::*;
use crate::body::half_space::HalfSpace;
use crate::contact::law::{size, Status};
use crate::friction::{Exponential, FrictionLaw};
use crate::grid::Interface;
use crate::model::combined_compliance;
use crate::transient::border::Border;
use crate::transient::{ContactSolver, DelassusOperator, NewtonMemory};

/// (dx, dy, g) of bodies pressed together by `approach` and moved by about `path`, unevenly over the contact.
fn displacements(s: &Interface, approach: f64, path: f64) -> Vec<f64> {
    (0..s.len())
        .flat_map(|i| {
            let [x, y] = s.point(i);
            [path * (1.0 + 150.0 * x), 0.4 * path * (1.0 - 200.0 * y), s.gap[i] - approach]
        })
        .collect()
}

/// With open nodes, stick and slip, for equal and for unlike bodies: the reactions of the fixed point, and from a
/// solution nearby in few products without a factorisation of the whole. Falling friction goes another way to the
/// same.
#[test]
fn finds_the_reactions_of_the_fixed_point_for_unlike_bodies_and_falling_friction() {
    let s = Interface::paraboloid(9, 9, [6e-3; 2], [4.0; 2]).unwrap();
    let steel = HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let hard = HalfSpace { young: 205e13, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let falling = FrictionLaw::from(Exponential::new(0.35, 0.25, 0.3));
    for (other, friction) in [
        (&steel, FrictionLaw::Constant(0.3)),
        (&hard, FrictionLaw::Constant(0.3)),
        (&hard, FrictionLaw::Constant(0.0)),
        (&steel, falling.clone()),
        (&hard, falling),
    ] {
        let w = combined_compliance(steel.as_ref(), other.as_ref()).unwrap();
        let columns: Vec<f64> = (0..3 * s.len()).flat_map(|j| w.col_as_slice(j).to_vec()).collect();
        let matrix = &DelassusOperator::new(columns);
        let mut memory = NewtonMemory::default();
        let mut guess = vec![0.0; 3 * s.len()];
        for step in 0..4 {
            let free = displacements(&s, (8.0 + 0.01 * step as f64) * 1e-5, (1.0 + 0.01 * step as f64) * 1.2e-5);
            let tolerance = 1e-11;
            let (friction, before) = (&friction.clone().into(), &[][..]);
            let p =
                StepProblem { matrix, free: &free, friction, before, step: 1e-5, patch: &[], borders: &[], tolerance };
            let solve = |solver, memory: &mut NewtonMemory| {
                let mut effort = Effort::default();
                let found = p.solve(solver, &guess, None, &[], memory, &mut effort).unwrap();
                (found, effort)
            };
            let (found, effort) = solve(ContactSolver::Newton, &mut memory);
            let (reference, _) = solve(ContactSolver::FixedPoint, &mut NewtonMemory::default());
            let normal: f64 = reference.reaction.iter().skip(2).step_by(3).sum();
            let difference =
                found.reaction.iter().zip(&reference.reaction).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(difference < 1e-8 * 0.25 * normal, "{friction:?}, step {step}: {difference:e} of {normal:e} N");
            let count = |state| found.status.iter().filter(|s| **s == state).count();
            let [open, stick, slip] = [Status::Open, Status::Stick, Status::Slip].map(count);
            let enough = open > 10 && slip > 5 && (stick > 5 || *friction == FrictionLaw::Constant(0.0).into());
            assert!(enough, "{friction:?}: {open} open, {stick} in stick, {slip} in slip");
            if step > 0 && friction.is_constant() {
                assert!(effort.factorisations == 0 && effort.products <= 8, "step {step}: {effort:?}");
            }
            // The same with the load given and the approach unknown: from nothing, from bodies far apart, and
            // from what is known.
            let borders = [Border::of_component(2, normal)];
            let loaded = StepProblem { borders: &borders, ..p };
            let nothing = vec![0.0; 3 * s.len()];
            for (guess, known) in [(&nothing, 2e-6), (&nothing, 1e-3), (&guess, 1e-3), (&guess, -1e-7)] {
                let (mut effort, mut memory) = (Effort::default(), NewtonMemory::default());
                let found =
                    loaded.solve(ContactSolver::Newton, guess, None, &[known], &mut memory, &mut effort).unwrap();
                let off = found.reaction.iter().zip(&reference.reaction).map(|(a, b)| (a - b).abs());
                let off = off.fold(0.0, f64::max);
                assert!(off < 1e-8 * 0.25 * normal, "{friction:?}, step {step}, load given: {off:e} of {normal:e} N");
                assert!(found.shift[0].abs() < 1e-9 * 8e-5, "shift {:e}", found.shift[0]);
                assert!(effort.factorisations == 0 || !friction.is_constant(), "step {step}: {effort:?}");
            }
            guess = found.reaction;
        }
    }
}

/// A millinewton on unlike bodies rests on one node, whatever is known of the approach.
#[test]
fn a_small_load_rests_on_one_node() {
    let s = Interface::paraboloid(9, 9, [6e-3; 2], [4.0; 2]).unwrap();
    let steel = HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let hard = HalfSpace { young: 205e13, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let w = combined_compliance(steel.as_ref(), hard.as_ref()).unwrap();
    let matrix = &DelassusOperator::new((0..3 * s.len()).flat_map(|j| w.col_as_slice(j).to_vec()).collect());
    let free = displacements(&s, 0.0, 1e-6);
    let (friction, load) = (FrictionLaw::Constant(0.3).into(), 1e-3);
    let p = StepProblem {
        matrix,
        free: &free,
        friction: &friction,
        before: &[],
        step: 1e-5,
        patch: &[],
        borders: &[Border::of_component(2, load)],
        tolerance: 1e-10,
    };
    for known in [-1e-4, 0.0, 1e-4] {
        let (mut effort, mut memory) = (Effort::default(), NewtonMemory::default());
        let guess = vec![0.0; 3 * s.len()];
        let found = p.solve(ContactSolver::Newton, &guess, None, &[known], &mut memory, &mut effort).unwrap();
        let closed: Vec<usize> = (0..s.len()).filter(|&i| found.status[i] != Status::Open).collect();
        assert_eq!(closed, [40], "from a shift of {known}");
        let r = &found.reaction[120..123];
        assert!((r[2] - load).abs() < 1e-12 && (size([r[0], r[1]]) - 0.3 * load).abs() < 1e-12, "{r:?}");
        // The gap of the middle node is closed.
        assert!((s.gap[40] + found.response[122] + found.shift[0]).abs() < 1e-18, "{:?}", found.shift);
        assert_eq!(effort.factorisations, 0, "{effort:?}");
    }
}

/// A motion that is no number is no open contact, whether the load or the approach is given, with every solver.
#[test]
fn what_is_no_number_is_refused() {
    let s = Interface::paraboloid(3, 3, [2e-3; 2], [4.0; 2]).unwrap();
    let steel = HalfSpace { young: 205e9, poisson: 0.3 }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap();
    let w = combined_compliance(steel.as_ref(), steel.as_ref()).unwrap();
    let matrix = &DelassusOperator::new((0..3 * s.len()).flat_map(|j| w.col_as_slice(j).to_vec()).collect());
    let good = displacements(&s, 1e-5, 1e-6);
    let friction = FrictionLaw::Constant(0.3);
    for (guess, total) in [(0.0, None), (10.0, None), (0.0, Some(50.0))] {
        for solver in [ContactSolver::Newton, ContactSolver::FixedPoint] {
            for at in [0, 14] {
                let mut free = good.clone();
                let guess = vec![guess; 3 * s.len()];
                let solve = |free: &[f64]| {
                    let (before, step, tolerance) = (&[][..], 1e-5, 1e-10);
                    let borders: Vec<Border> = total.map(|n| Border::of_component(2, n)).into_iter().collect();
                    let (patch, borders) = (&[][..], &borders[..]);
                    let friction = &friction.clone().into();
                    let p = StepProblem { matrix, free, friction, before, step, patch, borders, tolerance };
                    let shift = vec![0.0; borders.len()];
                    p.solve(solver, &guess, None, &shift, &mut NewtonMemory::default(), &mut Effort::default())
                };
                solve(&free).unwrap();
                free[at] = f64::NAN;
                let error = solve(&free).expect_err("no number");
                assert!(error.exit_code() == 4 && error.message().contains("no numbers"), "{error}");
            }
        }
    }
}
