//! Steady rolling of finite-element bodies whose compliance is not made: a static solve of the bodies for each set of
//! reactions.

use super::run::Run;
use crate::body::Fields;
use crate::case::bodies::BuiltBodies;
use crate::contact::fe_correction;
use crate::contact::{DeferredSteady, SteadyProblem, SteadySolution};
use crate::grid::ContactGrid;
use crate::{Error, Result};

/// Sets of reactions after which the correction counts as not converging.
const MAX_CORRECTIONS: usize = 40;
/// Error of a static solve, in the energy norm, against the residual of the contact laws before it. A residual of the
/// laws came out some forty times as large as the error: at this value that does not slow the correction.
const FORCING: f64 = 3e-3;
/// Error of the first static solves, which probe the bodies and displace them under reactions that are a thousandth
/// off.
const FIRST: f64 = 1e-4;

/// A steady state and the displacements that belong to it.
pub struct SteadyWithField {
    /// On rank 0: the solution, judged with the displacement of the finite elements.
    pub solution: Option<SteadySolution>,
    /// Displacement of each place's body, this rank's degrees of freedom, m.
    pub displacements: Vec<Vec<f64>>,
}

/// Collective: solves `problem`, which rank 0 holds with a compliance near that of the bodies, for the bodies
/// themselves. The residual of the solution is that of their displacement, from static solves whose error is
/// [`FORCING`] of `tolerance`.
pub fn solve(
    run: &mut Run,
    problem: Option<&SteadyProblem>,
    tolerance: f64,
    bodies: &BuiltBodies,
) -> Result<SteadyWithField> {
    let world = run.world();
    let all = (0..bodies.unique.len()).map(|b| bodies.fields(b)).collect::<Result<Vec<&dyn Fields>>>()?;
    let effort = || all.iter().map(|b| b.iterations()).sum::<usize>();
    let mut deferred = problem.map(|p| DeferredSteady::new(p.clone()));
    let finest = FORCING * tolerance;
    let mut u: Vec<Vec<f64>> = bodies.places.iter().map(|p| vec![0.0; all[p.body].len()]).collect();
    let mut accuracy = FIRST.max(finest);
    let mut residuals = Vec::new();
    for step in 0..MAX_CORRECTIONS {
        let reactions = world.on_root(|| held(&mut deferred)?.propose())?.unwrap_or_default();
        loop {
            let before = effort();
            let product = displaced(bodies, &all, &reactions, &mut u, accuracy)?;
            let iterations = effort() - before;
            let judged = world.on_root(|| held(&mut deferred)?.judge(product))?;
            let residual = world.max(judged.as_ref().map_or(0.0, |j| j.residual));
            run.progress.note(format!(
                "correction {}: residual {residual:.1e} with {iterations} iterations of the static solver",
                step + 1
            ));
            if residual > tolerance {
                residuals.push(format!("{residual:.1e}"));
                accuracy = (FORCING * residual).clamp(finest, accuracy);
                break;
            }
            if accuracy <= finest {
                run.summary.value(
                    "corrections of the compliance",
                    format!("{}, {} iterations of static solvers", step + 1, effort()),
                );
                return Ok(SteadyWithField { solution: judged, displacements: u });
            }
            // The laws hold; whether the displacement does is seen with a better one.
            accuracy = finest;
        }
    }
    Err(Error::NotConverged(format!(
        "steady contact: the reactions did not settle within analyses.steady.tolerance = {tolerance:e} in \
         {MAX_CORRECTIONS} corrections of the \
         approximate compliance; residuals: {}. Use solver.linear \"mumps\", which takes the bodies' own compliance",
        residuals.join(" ")
    )))
}

fn held<'a, 'p>(deferred: &'a mut Option<DeferredSteady<'p>>) -> Result<&'a mut DeferredSteady<'p>> {
    deferred.as_mut().ok_or_else(|| Error::Defect("no contact on rank 0".into()))
}

/// Collective: displacement of the contact rows (x, y, n), m/N, `[3][3n]` on rank 0, under unit forces (x, y, n) on
/// the middle node of the contact `grid`, which rank 0 has.
pub fn probe(body: &dyn Fields, grid: Option<&ContactGrid>) -> Result<[Vec<f64>; 3]> {
    let forces = grid.map_or(Vec::new(), |g| {
        let (rows, middle) = (3 * g.len(), fe_correction::middle(&g.x, &g.y));
        let mut forces = vec![0.0; 3 * rows];
        (0..3).for_each(|k| forces[k * rows + 3 * middle + k] = 1.0);
        forces
    });
    let n = body.len();
    let mut u = vec![0.0; 3 * n];
    body.improve(&mut u, &forces, 3, FIRST)?;
    Ok([0, 1, 2].map(|k| body.at_contact(&u[k * n..(k + 1) * n])))
}

/// Collective: (w_x, w_y, change of gap) of the contact nodes, m, `[3n]` on rank 0, under the reactions (N, `[3n]` on
/// rank 0). `u` holds the displacements of the places before and after. Two places are one solve if their bodies,
/// `all` that differ, are one.
fn displaced(
    bodies: &BuiltBodies,
    all: &[&dyn Fields],
    reactions: &[f64],
    u: &mut [Vec<f64>],
    accuracy: f64,
) -> Result<Vec<f64>> {
    let mut product = vec![0.0; reactions.len()];
    for (index, body) in all.iter().enumerate() {
        let places: Vec<usize> = (0..bodies.places.len()).filter(|&k| bodies.places[k].body == index).collect();
        let (mut forces, mut solutions) = (Vec::new(), Vec::new());
        for &k in &places {
            forces.extend(bodies.places[k].side.orient(reactions));
            solutions.append(&mut u[k]);
        }
        body.improve(&mut solutions, &forces, places.len(), accuracy)?;
        let n = body.len();
        for (j, &k) in places.iter().enumerate() {
            u[k] = solutions[j * n..(j + 1) * n].to_vec();
            let part = bodies.places[k].side.orient(&body.at_contact(&u[k]));
            product.iter_mut().zip(part).for_each(|(w, d)| *w += d);
        }
    }
    Ok(product)
}
