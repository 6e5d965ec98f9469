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

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

use super::interface::Upstream;
use super::linear::{Linear, NormalBlock};
use super::steady::{NormalLoad, SteadyProblem};
use crate::{Error, Result};

/// The candidate nodes with their scaled influence matrix.
pub(super) struct Candidates {
    /// Node numbers, ascending, `[m]`.
    pub nodes: Vec<usize>,
    /// Grid line (index along y) of each candidate, `[m]`.
    pub line: Vec<usize>,
    /// Augmentation parameter of the normal law, Pa/m, `[m]`.
    pub rho: Vec<f64>,
    /// Nodal areas, m², `[m]`.
    pub weight: Vec<f64>,
    /// Transposed scaled influence matrix: column `3a + r` is row r of candidate a, `[3m, 3m]`, 1.
    pub kt: Mat<f64>,
    /// Scaled rigid creep of the whole creepage and undeformed gap, `[3m]`.
    constant: Vec<f64>,
    /// Derivative of the gap rows by the scaled approach, `[m]`.
    pub by_approach: Vec<f64>,
    /// Shares of the nodes in the load equation: Σ share·p = target, `[m]`.
    pub share: Vec<f64>,
    pub target: f64,
    /// Operator that the creep rows are taken with.
    upstream: Upstream,
    /// Unit of stress, Pa.
    unit: f64,
    /// Approach in m per scaled approach.
    approach_unit: f64,
}

impl Candidates {
    /// Gathers the rows and columns of `nodes`; `stress` (Pa, `[3n]`) sets the unit of stress.
    pub fn new(problem: &SteadyProblem<'_>, upstream: &Upstream, nodes: Vec<usize>, stress: &[f64]) -> Result<Self> {
        let s = problem.interface;
        let m = nodes.len();
        let unit = nodes.iter().map(|&i| stress[3 * i + 2]).fold(0.0, f64::max);
        if !(unit > 0.0 && unit.is_finite()) {
            return Err(Error::Defect("steady contact: Newton's method was started without contact".into()));
        }
        let mut kt = Mat::<f64>::zeros(3 * m, 3 * m);
        let mut constant = vec![0.0; 3 * m];
        let mut by_approach = vec![0.0; m];
        let reference = problem.rho_normal(nodes[0]);
        let mut rho = vec![0.0; m];
        for (a, &i) in nodes.iter().enumerate() {
            rho[a] = problem.rho_normal(i);
            constant[3 * a + 2] = rho[a] * s.gap[i] / unit;
            by_approach[a] = -rho[a] / reference;
            gather(problem, &[(i, rho[a])], 2, &nodes, kt.col_as_slice_mut(3 * a + 2))?;
        }
        let total: f64 = nodes.iter().map(|&i| s.weight[i]).sum();
        let share = nodes.iter().map(|&i| s.weight[i] / total).collect();
        let target = match problem.load {
            NormalLoad::Force(f) => f / (unit * total),
            NormalLoad::Approach(_) => 0.0,
        };
        let line = nodes.iter().map(|&i| i / s.x.len()).collect();
        let mut new = Self {
            line,
            rho,
            upstream: Upstream { rows: Vec::new() },
            weight: nodes.iter().map(|&i| s.weight[i]).collect(),
            nodes,
            kt,
            constant,
            by_approach,
            share,
            target,
            unit,
            approach_unit: unit / reference,
        };
        new.renew(problem, upstream)?;
        Ok(new)
    }

    /// Takes the creep rows from another upstream operator; only rows that differ cost anything.
    pub fn renew(&mut self, problem: &SteadyProblem<'_>, upstream: &Upstream) -> Result<()> {
        for (a, &i) in self.nodes.iter().enumerate() {
            if self.upstream.rows.get(i) == Some(&upstream.rows[i]) {
                continue;
            }
            let rho = problem.rho_tangential(upstream, i);
            let [x, y] = problem.interface.point(i);
            let rigid = problem.creepage.rigid(x, y);
            let terms = upstream.rows[i].map(|(j, d)| (j, d * rho));
            for r in 0..2 {
                self.constant[3 * a + r] = rho * rigid[r] / self.unit;
                gather(problem, &terms, r, &self.nodes, self.kt.col_as_slice_mut(3 * a + r))?;
            }
        }
        self.upstream.clone_from(upstream);
        Ok(())
    }

    /// K x, `[3m]`.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let mut y = vec![0.0; n];
        let rhs = MatRef::from_column_major_slice(x, n, 1);
        let out = MatMut::from_column_major_slice_mut(&mut y, n, 1);
        matmul(out, Accum::Replace, self.kt.transpose(), rhs, 1.0, Par::Seq);
        y
    }

    /// Scaled creep and gap of all candidates.
    fn response(&self, x: &[f64], approach: f64, creep_factor: f64) -> Vec<f64> {
        let mut y = self.product(x);
        for a in 0..self.nodes.len() {
            y[3 * a] += creep_factor * self.constant[3 * a];
            y[3 * a + 1] += creep_factor * self.constant[3 * a + 1];
            y[3 * a + 2] += self.constant[3 * a + 2] + self.by_approach[a] * approach;
        }
        y
    }
}

/// Writes Σ d_j W[3j + r, columns of `nodes`]·weight into `out`, `[3m]`, for the pairs (j, d_j) of `terms`.
fn gather(
    problem: &SteadyProblem<'_>,
    terms: &[(usize, f64)],
    r: usize,
    nodes: &[usize],
    out: &mut [f64],
) -> Result<()> {
    out.fill(0.0);
    for &(j, d) in terms.iter().filter(|t| t.1 != 0.0) {
        // W is symmetric: its column is the row wanted, and contiguous.
        let Some(col) = problem.compliance.col(3 * j + r).try_as_col_major().map(|c| c.as_slice()) else {
            return Err(Error::Defect("steady contact: the influence matrix is not column-major".into()));
        };
        for (o, &k) in out.chunks_exact_mut(3).zip(nodes) {
            let (d, v) = (d * problem.interface.weight[k], &col[3 * k..3 * k + 3]);
            o[0] += d * v[0];
            o[1] += d * v[1];
            o[2] += d * v[2];
        }
    }
    Ok(())
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
    fn new(c: &Candidates, law: Law, x: Vec<f64>, d: f64, y: Vec<f64>) -> Self {
        let m = c.nodes.len();
        let (mut largest, mut square) = (0.0f64, 0.0);
        let peak = (0..m).map(|a| x[3 * a + 2]).fold(1e-300, f64::max);
        let scale = if law.friction > 0.0 { 1.0 / law.friction } else { 1.0 };
        for (u, v) in x.chunks_exact(3).zip(y.chunks_exact(3)) {
            let (fp, ft, _) = super::laws::natural_map(u[2], [u[0], u[1]], v[2], [v[0], v[1]], 1.0, 1.0, law.friction);
            let tangential = scale * scale * (ft[0] * ft[0] + ft[1] * ft[1]);
            square += tangential + fp * fp;
            largest = largest.max(fp.abs()).max(tangential.sqrt());
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
pub(super) struct Law {
    /// Coefficient of friction.
    pub friction: f64,
    /// True where the approach is unknown.
    pub force_given: bool,
}

/// Counts of a solution.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Effort {
    /// Newton iterations.
    pub iterations: usize,
    /// Products with the influence matrix of the candidates.
    pub products: usize,
}

/// Solves on the candidates to the residual `target`, from and into `stress` (Pa, `[3n]`) and `approach` (m), counting in
/// `effort`.
pub(super) fn solve(
    problem: &SteadyProblem<'_>,
    c: &Candidates,
    target: f64,
    stress: &mut [f64],
    approach: &mut f64,
    effort: &mut Effort,
) -> Result<()> {
    let law = Law { friction: problem.friction, force_given: matches!(problem.load, NormalLoad::Force(_)) };
    let mut x: Vec<f64> =
        c.nodes.iter().flat_map(|&i| (0..3).map(move |r| 3 * i + r)).map(|k| stress[k] / c.unit).collect();
    let mut d = *approach / c.approach_unit;
    let mut history = Vec::new();
    // The whole creepage at once first; where that fails, from the load alone in steps of creepage.
    let (mut reached, mut step) = (0.0, 1.0);
    let mut normal = NormalBlock::default();
    while reached < 1.0 {
        let factor = f64::min(1.0, reached + step);
        let mut trace = Vec::new();
        let y = c.response(&x, d, factor);
        effort.products += 1;
        let start = Iterate::new(c, law, x.clone(), d, y);
        if let Some(found) = newton(problem, c, law, factor, target, start, &mut normal, effort, &mut trace)? {
            (x, d) = (found.x, found.d);
            reached = factor;
            step *= 2.0;
            continue;
        }
        history.push(format!("at {factor:.3} of the creepage {}", list(&trace)));
        step *= 0.25;
        if step < 1e-3 || effort.iterations >= problem.max_iterations {
            return Err(Error::NotConverged(format!(
                "steady contact: no solution within {:.1e} after {} iterations \
                 (analyses.steady.max_iterations is {}); residuals: {}",
                problem.tolerance,
                effort.iterations,
                problem.max_iterations,
                history.join("; ")
            )));
        }
    }
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

/// Newton iterations at one creepage; None where they stall.
#[allow(clippy::too_many_arguments)]
fn newton(
    problem: &SteadyProblem<'_>,
    c: &Candidates,
    law: Law,
    factor: f64,
    target: f64,
    start: Iterate,
    normal: &mut NormalBlock,
    effort: &mut Effort,
    trace: &mut Vec<f64>,
) -> Result<Option<Iterate>> {
    let mut now = start;
    let mut exact = true;
    let mut before = f64::INFINITY;
    for _ in 0..60 {
        trace.push(now.largest);
        if now.largest <= target {
            if exact {
                return Ok(Some(now));
            }
            // y was carried along by increments: renew it before believing it.
            let y = c.response(&now.x, now.d, factor);
            effort.products += 1;
            now = Iterate::new(c, law, now.x, now.d, y);
            exact = true;
            continue;
        }
        if effort.iterations >= problem.max_iterations || !now.norm.is_finite() {
            return Ok(None);
        }
        effort.iterations += 1;
        let closed: Vec<usize> = (0..c.nodes.len()).filter(|&a| now.x[3 * a + 2] > now.y[3 * a + 2]).collect();
        if closed.is_empty() {
            return Ok(None);
        }
        // Nodes found open lose their stresses at once; the linearisation starts from what is left.
        let mut dropped = false;
        let mut next = closed.iter().copied().peekable();
        for a in 0..c.nodes.len() {
            if next.peek() == Some(&a) {
                next.next();
            } else if now.x[3 * a..3 * a + 3].iter().any(|&v| v != 0.0) {
                now.x[3 * a..3 * a + 3].fill(0.0);
                dropped = true;
            }
        }
        if dropped {
            let y = c.response(&now.x, now.d, factor);
            effort.products += 1;
            now = Iterate { y, ..now };
        }
        // Solve as exactly as the quadratic model deserves (Eisenstat and Walker's second choice).
        let ratio = now.norm / before;
        before = now.norm;
        let forcing = (0.5 * ratio * ratio).clamp(1e-4, 0.05).max(0.2 * target / now.largest).min(0.3);
        normal.update(problem, c, &closed)?;
        let linear = Linear::new(c, law, &now, &closed, normal);
        let Some(step) = linear.solve(forcing, effort) else { return Ok(None) };
        let mut best: Option<Iterate> = None;
        let mut t = 1.0;
        for _ in 0..8 {
            let x = now.x.iter().zip(&step.dx).map(|(a, b)| a + t * b).collect();
            let y = now.y.iter().zip(&step.dy).map(|(a, b)| a + t * b).collect();
            let trial = Iterate::new(c, law, x, now.d + t * step.dd, y);
            let good = trial.norm <= (1.0 - 0.1 * t) * now.norm;
            if trial.norm.is_finite() && best.as_ref().map_or(true, |b| trial.norm < b.norm) {
                best = Some(trial);
            }
            if good {
                break;
            }
            t *= 0.5;
        }
        let Some(found) = best else { return Ok(None) };
        now = found;
        exact = false;
    }
    Ok(None)
}
