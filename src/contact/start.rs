//! Initial guess of Newton's method: pressures without friction, tractions for these, and the pressures that the
//! tractions leave.

use super::candidates::Candidates;
use super::frictionless_cg::FrictionlessSolution;
use super::interface::Stencil;
use super::law::project_disc;
use super::nested;
use super::newton::StressState;
use super::normal::solve_normal;
use super::patch::refuse_border;
use super::steady::SteadyProblem;
use crate::Result;

/// The start of a solution: stresses, candidates and coefficients of friction, 1, `[n]`.
pub(super) struct InitialGuess<'a> {
    pub at: StressState,
    pub candidates: Candidates<'a>,
    pub friction: Vec<f64>,
}

/// The start of `problem` from nothing.
pub(super) fn cold<'a>(problem: &SteadyProblem<'a>) -> Result<InitialGuess<'a>> {
    let s = problem.interface;
    let mut pressed = match s.are_points() {
        true => None,
        false => FrictionlessSolution::new(problem.compliance, s, &problem.loads),
    };
    let normal = match pressed.as_mut().and_then(FrictionlessSolution::settle) {
        Some(normal) => normal,
        None => {
            pressed = None;
            solve_normal(problem.compliance, s, &problem.loads)?
        }
    };
    refuse_border(problem.compliance, s, &problem.loads, &normal.closed)?;
    let mut at = StressState { stress: vec![0.0; 3 * s.len()], motions: normal.motions, displacement: None };
    for (&i, f) in normal.closed.iter().zip(&normal.force) {
        at.stress[3 * i + 2] = f / s.weight[i];
    }
    // The edge is looked at once the displacements are known.
    let upstream = s.upstream(Stencil::Upwind2, None);
    let mut candidates = Candidates::new(problem, &upstream, problem.dilate(&normal.closed), &at.stress)?;
    let friction = problem.friction_at_first(&at.stress);
    if problem.friction.largest() > 0.0 {
        match nested::solution(problem, normal.closed.len()) {
            Some((grid, found)) => nested::tractions(problem, (&grid, &found), &friction, &mut at.stress),
            None => rolled(problem, &mut candidates, &friction, &mut at),
        }
        if let Some(pressed) = &mut pressed {
            press_again(problem, &mut candidates, pressed, &friction, &mut at);
            let closed = at.closed();
            if closed.iter().any(|i| candidates.nodes.binary_search(i).is_err()) {
                candidates = Candidates::new(problem, &upstream, problem.dilate(&closed), &at.stress)?;
            }
        }
    }
    if let Some(pressed) = pressed {
        candidates.factors.normal = pressed.block();
    }
    Ok(InitialGuess { at, candidates, friction })
}

/// Tractions by the simplified theory.
fn rolled<'a>(problem: &SteadyProblem<'a>, c: &mut Candidates<'a>, friction: &[f64], at: &mut StressState) {
    let mut x: Vec<f64> = c.nodes.iter().flat_map(|&i| [0.0, 0.0, at.stress[3 * i + 2] / c.unit]).collect();
    let closed: Vec<usize> = (0..c.nodes.len()).filter(|&a| x[3 * a + 2] > 0.0).collect();
    c.press(&closed);
    let given: Vec<f64> = closed.iter().flat_map(|&a| [0.0, 0.0, x[3 * a + 2]]).collect();
    let (u, d) = (c.displaced(&closed, &given), c.scaled(&at.motions));
    let upstream = c.upstream_of(problem, &x, &u, &d);
    c.renew(problem, &upstream);
    let y = c.response(&u, &d, 1.0);
    let friction: Vec<f64> = c.nodes.iter().map(|&i| friction[i]).collect();
    c.guess_tractions(problem, &friction, &mut x, &y);
    for (&i, x) in c.nodes.iter().zip(x.chunks_exact(3)) {
        (0..2).for_each(|r| at.stress[3 * i + r] = x[r] * c.unit);
    }
}

/// Makes the pressures those under the tractions, which keep their proportion to them.
fn press_again<'a>(
    problem: &SteadyProblem<'a>,
    c: &mut Candidates<'a>,
    pressed: &mut FrictionlessSolution<'a, '_>,
    friction: &[f64],
    at: &mut StressState,
) {
    let s = problem.interface;
    let closed: Vec<usize> = (0..c.nodes.len()).filter(|&a| at.stress[3 * c.nodes[a] + 2] > 0.0).collect();
    c.press(&closed);
    let given = |&a: &usize| [0, 1, 2].map(|r| if r < 2 { at.stress[3 * c.nodes[a] + r] } else { 0.0 });
    let u = c.displaced(&closed, &closed.iter().flat_map(given).collect::<Vec<f64>>());
    // Beyond what the candidates see it is not far from what it is there.
    let mean = u.iter().skip(2).step_by(3).sum::<f64>() / c.seen.len() as f64;
    let mut gap: Vec<f64> = s.gap.iter().map(|g| g + mean).collect();
    c.seen.iter().zip(u.chunks_exact(3)).for_each(|(&i, u)| gap[i] += u[2] - mean);
    pressed.set_gap(&gap);
    let normal = match pressed.settle() {
        Some(normal) if !normal.closed.iter().any(|&i| s.on_border(i)) => normal,
        _ => {
            problem.loads.unknown().into_iter().for_each(|j| at.motions[j] += mean);
            return;
        }
    };
    let before = std::mem::replace(&mut at.stress, vec![0.0; 3 * s.len()]);
    for (&i, f) in normal.closed.iter().zip(&normal.force) {
        let (p, old) = (f / s.weight[i], &before[3 * i..3 * i + 3]);
        let share = if old[2] > 0.0 { p / old[2] } else { 0.0 };
        let [x, y] = project_disc([old[0] * share, old[1] * share], friction[i] * p);
        at.stress[3 * i..3 * i + 3].copy_from_slice(&[x, y, p]);
    }
    at.motions = normal.motions;
}
