//! Semi-smooth Newton method on the coupled natural map of a steady rolling contact.
//!
//! Unknowns are the scaled stresses x = (tx, ty, p)/p̄ of the candidate nodes and the approach. With the scaled influence
//! matrix K, whose rows are the creep per unit speed times ρ_t and the gap times ρ_n, the map needs the values
//! y = (s, g) = constant + K x − δ; its generalised derivative follows P. Alart and A. Curnier, Comput. Methods Appl.
//! Mech. Engrg. 92 (1991): at a sliding node the traction is linearised about the direction ẑ of z = t − s.
//!
//! Each linear system is solved by GMRES to what the Newton step can use. Its preconditioner solves the normal block exactly
//! (Cholesky) and the tangential one line by line along the rolling direction, where the upstream difference couples most.
//! y is affine in x and GMRES returns the products it made, so a step, its line search included, needs no product of its own.

use super::candidates::Candidates;
use super::law::{Augmentation, Node};
use super::linear::{ClosedInfluence, NewtonStep, NewtonSystem, NormalBlock};
use super::steady::{NormalLoad, SteadyProblem};
use crate::{Error, Result};

/// The unknowns are scaled by the augmentation parameters.
pub(super) const UNIT: Augmentation = Augmentation { normal: 1.0, tangential: 1.0 };

/// A node with the scaled stresses `x` and the response `y` to all of them.
pub(super) fn node(x: &[f64], y: &[f64]) -> Node {
    Node { pressure: x[2], traction: [x[0], x[1]], gap: y[2], creep: [y[0], y[1]] }
}

/// An iterate with its response and its map.
#[derive(Clone)]
pub(super) struct Iterate {
    /// Scaled stresses, `[3m]`.
    pub x: Vec<f64>,
    /// Scaled approach.
    d: f64,
    /// Creep and gap, scaled, `[3m]`.
    pub y: Vec<f64>,
    /// Largest component of the map, as [`super::SteadySolution::residual`] measures it.
    largest: f64,
    /// Euclidean norm of the map.
    norm: f64,
}

impl Iterate {
    fn new(c: &Candidates, law: Law<'_>, x: Vec<f64>, d: f64, y: Vec<f64>) -> Self {
        let m = c.nodes.len();
        let (mut largest, mut square) = (0.0f64, 0.0);
        let peak = (0..m).map(|a| x[3 * a + 2]).fold(1e-300, f64::max);
        let scale = if law.largest > 0.0 { 1.0 / law.largest } else { 1.0 };
        for ((u, v), &mu) in x.chunks_exact(3).zip(y.chunks_exact(3)).zip(law.friction) {
            let node = node(u, v);
            let [x, y, n] = node.project(UNIT, mu).map(&node);
            let tangential = scale * scale * (x * x + y * y);
            square += tangential + n * n;
            largest = largest.max(n.abs()).max(tangential.sqrt());
        }
        largest /= peak;
        if law.force_given {
            let f = (0..m).map(|a| c.share[a] * x[3 * a + 2]).sum::<f64>() - c.target;
            square += f * f;
            largest = largest.max(f.abs() / c.target);
        }
        Self { x, d, y, largest, norm: square.sqrt() }
    }
}

/// What the map needs to know of the problem.
#[derive(Clone, Copy)]
pub(super) struct Law<'a> {
    /// Coefficient of friction of each candidate, `[m]`.
    pub friction: &'a [f64],
    /// The largest that the law knows, the unit in which violations of it are measured.
    pub largest: f64,
    /// True where the approach is unknown.
    pub force_given: bool,
}

/// What was made of the closed nodes for the linear systems; of use as long as these nodes stay, from one solution to the next.
#[derive(Default)]
pub(super) struct Factors {
    normal: NormalBlock,
    compact: ClosedInfluence,
    /// The candidates whose rows have changed since the compact matrix was made.
    pub stale: Vec<usize>,
}

/// Counts of a solution.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Effort {
    /// Newton iterations.
    pub iterations: usize,
    /// Products with the influence matrix of the candidates.
    pub products: usize,
}

/// Solves on the candidates with the coefficients of friction `friction` (of all nodes, `[n]`) to the residual `target`, from
/// and into `stress` (Pa, `[3n]`) and `approach` (m), counting in `effort`. Tractions that are all zero are replaced by a
/// guess first.
pub(super) fn solve(
    problem: &SteadyProblem<'_>,
    c: &mut Candidates,
    friction: &[f64],
    target: f64,
    stress: &mut [f64],
    approach: &mut f64,
    effort: &mut Effort,
) -> Result<()> {
    let mut x: Vec<f64> =
        c.nodes.iter().flat_map(|&i| (0..3).map(move |r| 3 * i + r)).map(|k| stress[k] / c.unit).collect();
    let mut d = *approach / c.approach_unit;
    let friction: Vec<f64> = c.nodes.iter().map(|&i| friction[i]).collect();
    let mut run = Run {
        problem,
        law: Law {
            friction: &friction,
            largest: problem.friction.largest(),
            force_given: matches!(problem.load, NormalLoad::Force(_)),
        },
        target,
        factor: 1.0,
        factors: std::mem::take(&mut c.factors),
        effort,
        trace: Vec::new(),
    };
    let mut history = Vec::new();
    // The whole creepage at once first; where that fails, from the load alone in steps of creepage.
    let (mut reached, mut step) = (0.0, 1.0);
    while reached < 1.0 {
        run.factor = f64::min(1.0, reached + step);
        run.trace.clear();
        let mut y = c.response(&x, d, run.factor);
        run.effort.products += 1;
        let mut start = x.clone();
        if run.law.largest > 0.0 && x.chunks_exact(3).all(|v| v[0] == 0.0 && v[1] == 0.0) {
            c.guess_tractions(problem, run.law.friction, &mut start, &y);
            y = c.response(&start, d, run.factor);
            run.effort.products += 2;
        }
        let start = Iterate::new(c, run.law, start, d, y);
        if let Some(found) = run.newton(c, start)? {
            (x, d) = (found.x, found.d);
            reached = run.factor;
            step *= 2.0;
            continue;
        }
        history.push(format!("at {:.3} of the creepage {}", run.factor, list(&run.trace)));
        step *= 0.25;
        if step < 1e-3 || run.effort.iterations >= problem.max_iterations {
            return Err(Error::NotConverged(format!(
                "steady contact: no solution within {:.1e} after {} iterations \
                 (analyses.steady.max_iterations is {}); residuals: {}",
                problem.tolerance,
                run.effort.iterations,
                problem.max_iterations,
                history.join("; ")
            )));
        }
    }
    c.factors = run.factors;
    for (a, &i) in c.nodes.iter().enumerate() {
        for r in 0..3 {
            stress[3 * i + r] = x[3 * a + r] * c.unit;
        }
    }
    *approach = d * c.approach_unit;
    Ok(())
}

fn list(trace: &[f64]) -> String {
    trace.iter().map(|r| format!("{r:.1e}")).collect::<Vec<_>>().join(" ")
}

/// A solution in progress.
struct Run<'a, 'p> {
    problem: &'a SteadyProblem<'p>,
    law: Law<'a>,
    target: f64,
    /// Part of the creepage that is applied.
    factor: f64,
    factors: Factors,
    effort: &'a mut Effort,
    /// Residuals so far.
    trace: Vec<f64>,
}

impl Run<'_, '_> {
    /// Newton iterations at one creepage; None where they stall. The upstream operator follows the iterates: what it
    /// changes is small against what is left, so that the derivative can do without it.
    fn newton(&mut self, c: &mut Candidates, start: Iterate) -> Result<Option<Iterate>> {
        let mut now = start;
        // Whether y is as computed from x, not carried along; and whether that was done once near the solution.
        let (mut exact, mut near) = (true, false);
        let mut before = None;
        for _ in 0..60 {
            if now.largest < 0.1 {
                let upstream = self.problem.upstream(&stresses(c, &now.x, self.problem), now.d * c.approach_unit);
                let changed = c.renew(self.problem, &upstream)?;
                for a in &changed {
                    c.renew_response(*a, &now.x, self.factor, &mut now.y);
                }
                if !changed.is_empty() {
                    now = Iterate::new(c, self.law, now.x, now.d, now.y);
                    self.factors.stale.extend(changed);
                }
            }
            self.trace.push(now.largest);
            if now.largest <= self.target {
                if exact {
                    return Ok(Some(now));
                }
                // y was carried along by increments: renew it before believing it.
                now = self.renewed(c, now);
                exact = true;
                continue;
            }
            if self.effort.iterations >= self.problem.max_iterations || !now.norm.is_finite() {
                return Ok(None);
            }
            self.effort.iterations += 1;
            let closed: Vec<usize> = (0..c.nodes.len()).filter(|&a| now.x[3 * a + 2] > now.y[3 * a + 2]).collect();
            if closed.is_empty() {
                return Ok(None);
            }
            // The creep of open nodes is not carried along, and the first steps are long: their rounding stays.
            let grown = !exact && closed.iter().any(|a| self.factors.compact.closed.binary_search(a).is_err());
            let dropped = open_others(&mut now.x, &closed);
            if dropped || grown || (!near && !exact && now.largest < 1e-3) {
                near = now.largest < 1e-3;
                now = self.renewed(c, now);
            }
            // Solve as exactly as the quadratic model deserves (Eisenstat and Walker's second choice), and no further than
            // the target or the moving edge need.
            let ratio = before.map_or(1.0, |b| now.norm / b);
            before = Some(now.norm);
            let forcing = (0.5f64 * ratio * ratio).clamp(0.01, 0.05).max(0.2 * self.target / now.largest).min(0.3);
            let Factors { normal, compact, stale } = &mut self.factors;
            normal.update(self.problem, c, &closed)?;
            compact.update(c, &closed, stale);
            stale.clear();
            let linear = NewtonSystem::new(c, self.law, &now, normal, compact);
            let Some(step) = linear.solve(forcing, self.effort) else { return Ok(None) };
            let Some(found) = self.search(c, &now, &step) else { return Ok(None) };
            now = found;
            exact = false;
        }
        Ok(None)
    }

    /// `now` with its response computed afresh.
    fn renewed(&mut self, c: &Candidates, now: Iterate) -> Iterate {
        let y = c.response(&now.x, now.d, self.factor);
        self.effort.products += 1;
        Iterate::new(c, self.law, now.x, now.d, y)
    }

    /// Line search on the norm of the map; the best trial where none is good.
    fn search(&self, c: &Candidates, now: &Iterate, step: &NewtonStep) -> Option<Iterate> {
        let mut best: Option<Iterate> = None;
        let mut t = 1.0;
        for _ in 0..8 {
            let x = now.x.iter().zip(&step.dx).map(|(a, b)| a + t * b).collect();
            let y = now.y.iter().zip(&step.dy).map(|(a, b)| a + t * b).collect();
            let trial = Iterate::new(c, self.law, x, now.d + t * step.dd, y);
            let good = trial.norm <= (1.0 - 0.1 * t) * now.norm;
            if trial.norm.is_finite() && best.as_ref().is_none_or(|b| trial.norm < b.norm) {
                best = Some(trial);
            }
            if good {
                break;
            }
            t *= 0.5;
        }
        best
    }
}

/// Scaled stresses of the candidates as stresses of all nodes, Pa, `[3n]`.
fn stresses(c: &Candidates, x: &[f64], problem: &SteadyProblem<'_>) -> Vec<f64> {
    let mut out = vec![0.0; 3 * problem.interface.len()];
    for (v, &i) in x.chunks_exact(3).zip(&c.nodes) {
        for r in 0..3 {
            out[3 * i + r] = v[r] * c.unit;
        }
    }
    out
}

/// Sets the stresses of all candidates but `closed` (ascending) to zero; true if that changed anything.
fn open_others(x: &mut [f64], closed: &[usize]) -> bool {
    let mut dropped = false;
    let mut next = closed.iter().copied().peekable();
    for (a, v) in x.chunks_exact_mut(3).enumerate() {
        if next.next_if_eq(&a).is_none() && v.iter().any(|&v| v != 0.0) {
            v.fill(0.0);
            dropped = true;
        }
    }
    dropped
}
