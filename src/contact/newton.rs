//! Semi-smooth Newton method on the coupled natural map of a steady rolling contact.
//!
//! Unknowns are the scaled stresses x = (tx, ty, p)/p̄ of the candidate nodes and the rigid motions. With the scaled
//! influence matrix K, whose rows are the creep per unit speed times ρ_t and the gap times ρ_n, the map needs the
//! values y = (s, g) = constant + K x − N d; its generalised derivative follows P. Alart and A. Curnier, Comput.
//! Methods Appl. Mech. Engrg. 92 (1991): at a sliding node the traction is linearised about the direction ẑ of z = t
//! − s.
//!
//! Each linear system is solved by GMRES to what the Newton step can use. Its preconditioner solves the normal block
//! (Cholesky, or by the inverse of the spectrum where the block is large and a convolution) and the tangential one
//! line by line along the rolling direction, where the upstream difference couples most. Displacements are linear in
//! x and GMRES returns those of what it found, so a step, its line search included, needs no product of its own; a
//! product in full precision is made once near the solution and once at it.

use super::candidates::Candidates;
use super::law::{Augmentation, Node};
use super::linear::{NewtonStep, NewtonSystem, NormalBlock};
use super::steady::SteadyProblem;
use crate::{Error, Result};

/// The unknowns are scaled by the augmentation parameters.
pub(super) const UNIT: Augmentation = Augmentation { normal: 1.0, tangential: 1.0 };

/// A node with the scaled stresses `x` and the response `y` to all of them.
pub(super) fn node(x: &[f64], y: &[f64]) -> Node {
    Node { pressure: x[2], traction: [x[0], x[1]], gap: y[2], creep: [y[0], y[1]] }
}

/// Rounding error of a product in single precision, as a part of the stresses that it is of: creep is a difference of
/// displacements that are almost the same.
const ROUNDING: f64 = 1e-6;
/// Residual below which the rounding of products is removed.
const NEAR: f64 = 1e-3;

/// An iterate with its response and its map.
#[derive(Clone)]
pub(super) struct Iterate {
    /// Scaled stresses, `[3m]`.
    pub x: Vec<f64>,
    /// Scaled motions, `[motions]`.
    d: Vec<f64>,
    /// Displacements per unit of stress, m/Pa, `[3q]`.
    u: Vec<f64>,
    /// Creep and gap, scaled, `[3m]`.
    pub y: Vec<f64>,
    /// Largest component of the map, as [`super::SteadySolution::residual`] measures it.
    largest: f64,
    /// Euclidean norm of the map.
    norm: f64,
}

impl Iterate {
    /// The stresses `x` and the motions `d` with the displacements `u`, at the part `factor` of the creepage.
    fn new(c: &Candidates, (law, factor): (MapData<'_>, f64), x: Vec<f64>, d: Vec<f64>, u: Vec<f64>) -> Self {
        let y = c.response(&u, &d, factor);
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
        for resultant in &c.resultants {
            let f = resultant.error(&x);
            square += f * f;
            largest = largest.max(f.abs() / resultant.scale);
        }
        Self { x, d, u, y, largest, norm: square.sqrt() }
    }
}

/// Data of the problem that the map needs.
#[derive(Clone, Copy)]
pub(super) struct MapData<'a> {
    /// Coefficient of friction of each candidate, `[m]`.
    pub friction: &'a [f64],
    /// The largest that the law knows, the unit in which violations of it are measured.
    pub largest: f64,
}

/// Factorisations of the closed nodes for the linear systems; of use as long as these nodes stay, from one solution to
/// the next.
#[derive(Default)]
pub(super) struct Factors<'a> {
    pub normal: NormalBlock<'a>,
}

/// Stresses that solve a problem, or that a solution is begun with.
pub(super) struct StressState {
    /// Stresses (tx, ty, p), Pa, `[3n]`.
    pub stress: Vec<f64>,
    /// Rigid motions, m, `[motions]`.
    pub motions: Vec<f64>,
    /// The displacements of all nodes under these, m, `[3n]`, where a product in full precision has told them.
    pub displacement: Option<Vec<f64>>,
}

/// Counts of a solution.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct NewtonEffort {
    /// Newton iterations.
    pub iterations: usize,
    /// Products with the influence matrix of the candidates.
    pub products: usize,
}

/// Solves on the candidates with the coefficients of friction `friction` (of all nodes, `[n]`) to the residual
/// `target`, from and into `at`, counting in `effort`. Tractions that are all zero are replaced by a guess first.
/// What rounding has left in the residual is for the caller to see, who takes the displacement of all nodes.
pub(super) fn solve<'p>(
    problem: &SteadyProblem<'p>,
    c: &mut Candidates<'p>,
    friction: &[f64],
    target: f64,
    at: &mut StressState,
    effort: &mut NewtonEffort,
) -> Result<()> {
    let mut x: Vec<f64> =
        c.nodes.iter().flat_map(|&i| (0..3).map(move |r| 3 * i + r)).map(|k| at.stress[k] / c.unit).collect();
    let mut d = c.scaled(&at.motions);
    let friction: Vec<f64> = c.nodes.iter().map(|&i| friction[i]).collect();
    let acting: Vec<usize> = (0..c.nodes.len()).filter(|&a| x[3 * a..3 * a + 3].iter().any(|&v| v != 0.0)).collect();
    c.press(&acting);
    let gather = |x: &[f64]| acting.iter().flat_map(|&a| [x[3 * a], x[3 * a + 1], x[3 * a + 2]]).collect::<Vec<f64>>();
    let (mut u, mut moved) = match &at.displacement {
        Some(all) => (c.of_all(all, 1.0 / c.unit), 0.0),
        None => (c.displaced(&acting, &gather(&x)), 1.0),
    };
    // Where the edge is in the contact to begin with.
    let upstream = c.upstream_of(problem, &x, &u, &d);
    c.renew(problem, &upstream);
    let mut run = Run {
        problem,
        law: MapData { friction: &friction, largest: problem.friction.largest() },
        target,
        factor: 1.0,
        factors: std::mem::take(&mut c.factors),
        effort,
        moved,
        trace: Vec::new(),
    };
    let mut history = Vec::new();
    // The whole creepage at once first; where that fails, from the load alone in steps of creepage.
    let (mut reached, mut step) = (0.0, 1.0);
    while reached < 1.0 {
        run.factor = f64::min(1.0, reached + step);
        run.trace.clear();
        run.moved = moved;
        let (mut start, mut displaced) = (x.clone(), u.clone());
        if run.law.largest > 0.0 && x.chunks_exact(3).all(|v| v[0] == 0.0 && v[1] == 0.0) {
            let y = c.response(&u, &d, run.factor);
            c.guess_tractions(problem, run.law.friction, &mut start, &y);
            displaced = c.displaced(&acting, &gather(&start));
            // The tractions may lift the bodies as wholes, which the motions take up.
            let y = c.response(&displaced, &d, run.factor);
            for by in c.resultants.iter().map(|r| r.motion) {
                let moved = || acting.iter().filter(|&&a| c.by_motion[by][a] != 0.0);
                let sum = |of: &dyn Fn(usize) -> f64| moved().map(|&a| of(a)).sum::<f64>();
                let lift = sum(&|a| y[3 * a + 2]) / sum(&|a| c.by_motion[by][a]);
                d[by] -= if lift.is_finite() { lift } else { 0.0 };
            }
            run.moved = 1.0;
            run.effort.products += 2;
        }
        let start = Iterate::new(c, (run.law, run.factor), start, d.clone(), displaced);
        if let Some(found) = run.newton(c, start)? {
            (x, d, u, moved) = (found.x, found.d, found.u, run.moved);
            reached = run.factor;
            step *= 2.0;
            continue;
        }
        history.push(format!("at {:.3} of the creepage {}", run.factor, list(&run.trace)));
        step *= 0.25;
        if reached == 0.0 {
            x.chunks_exact_mut(3).for_each(|v| (v[0], v[1]) = (0.0, 0.0));
            (u, moved) = (c.displaced(&acting, &gather(&x)), 1.0);
        }
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
            at.stress[3 * i + r] = x[3 * a + r] * c.unit;
        }
    }
    at.motions = c.unscaled(&d);
    at.displacement = None;
    Ok(())
}

fn list(trace: &[f64]) -> String {
    trace.iter().map(|r| format!("{r:.1e}")).collect::<Vec<_>>().join(" ")
}

/// A solution in progress.
struct Run<'a, 'p> {
    problem: &'a SteadyProblem<'p>,
    law: MapData<'a>,
    target: f64,
    /// Part of the creepage that is applied.
    factor: f64,
    factors: Factors<'p>,
    effort: &'a mut NewtonEffort,
    /// How far the stresses have moved since their displacements were those of a product in full precision.
    moved: f64,
    /// Residuals so far.
    trace: Vec<f64>,
}

impl<'p> Run<'_, 'p> {
    /// Newton iterations at one creepage; None where they stall. The upstream operator follows the iterates: what it
    /// changes is small against what is left, so that the derivative can do without it.
    fn newton(&mut self, c: &mut Candidates<'p>, start: Iterate) -> Result<Option<Iterate>> {
        let mut now = start;
        let mut before = None;
        for _ in 0..60 {
            if now.largest < 0.1 {
                let upstream = c.upstream_of(self.problem, &now.x, &now.u, &now.d);
                if c.renew(self.problem, &upstream) {
                    now = Iterate::new(c, (self.law, self.factor), now.x, now.d, now.u);
                }
            }
            self.trace.push(now.largest);
            if now.largest <= self.target {
                return Ok(Some(now));
            }
            if self.effort.iterations >= self.problem.max_iterations || !now.norm.is_finite() {
                return Ok(None);
            }
            self.effort.iterations += 1;
            let closed: Vec<usize> = (0..c.nodes.len()).filter(|&a| now.x[3 * a + 2] > now.y[3 * a + 2]).collect();
            if closed.is_empty() {
                return Ok(None);
            }
            let mut renewed = false;
            if let Some((dropped, change)) = open_others(&mut now.x, &closed) {
                let off = c.displaced(&dropped, &change);
                now.u.iter_mut().zip(off).for_each(|(u, o)| *u += o);
                self.moved += size(&change);
                self.effort.products += 1;
                renewed = true;
            }
            // What the step leaves of the residual is to be more than rounding.
            if now.largest < NEAR && ROUNDING * self.moved > 0.3 * self.target.max(0.01 * now.largest) {
                now.u = c.displaced_exactly(self.problem, &now.x);
                self.moved = 0.0;
                self.effort.products += 1;
                renewed = true;
            }
            if renewed {
                now = Iterate::new(c, (self.law, self.factor), now.x, now.d, now.u);
            }
            // Solve as exactly as the quadratic model deserves (Eisenstat and Walker's second choice), and no further
            // than the target or the moving edge need.
            let ratio = before.map_or(1.0, |b| now.norm / b);
            before = Some(now.norm);
            let forcing = (0.5f64 * ratio * ratio).clamp(0.01, 0.05).max(0.2 * self.target / now.largest).min(0.3);
            c.press(&closed);
            self.factors.normal.update(c, &closed)?;
            let linear = NewtonSystem::new(c, self.law, &now, &self.factors.normal, &closed);
            let Some(step) = linear.solve(forcing, self.effort) else { return Ok(None) };
            let Some(found) = self.search(c, &now, &step) else { return Ok(None) };
            now = found;
        }
        Ok(None)
    }

    /// Line search on the norm of the map; the best trial where none is good.
    fn search(&mut self, c: &Candidates, now: &Iterate, step: &NewtonStep) -> Option<Iterate> {
        let mut best: Option<(f64, Iterate)> = None;
        let mut t = 1.0;
        for _ in 0..8 {
            let x = now.x.iter().zip(&step.dx).map(|(a, b)| a + t * b).collect();
            let u = now.u.iter().zip(&step.du).map(|(a, b)| a + t * b).collect();
            let d = now.d.iter().zip(&step.dd).map(|(a, b)| a + t * b).collect();
            let trial = Iterate::new(c, (self.law, self.factor), x, d, u);
            let good = trial.norm <= (1.0 - 0.1 * t) * now.norm;
            if trial.norm.is_finite() && best.as_ref().is_none_or(|(_, b)| trial.norm < b.norm) {
                best = Some((t, trial));
            }
            if good {
                break;
            }
            t *= 0.5;
        }
        let (t, found) = best?;
        self.moved += t * size(&step.dx);
        Some(found)
    }
}

/// Largest component.
fn size(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// Sets the stresses of all candidates but `closed` (ascending) to zero; those that had one, and what it takes to be
/// rid of it.
fn open_others(x: &mut [f64], closed: &[usize]) -> Option<(Vec<usize>, Vec<f64>)> {
    let (mut dropped, mut change) = (Vec::new(), Vec::new());
    let mut next = closed.iter().copied().peekable();
    for (a, v) in x.chunks_exact_mut(3).enumerate() {
        if next.next_if_eq(&a).is_none() && v.iter().any(|&v| v != 0.0) {
            dropped.push(a);
            change.extend(v.iter().map(|v| -v));
            v.fill(0.0);
        }
    }
    (!dropped.is_empty()).then_some((dropped, change))
}
