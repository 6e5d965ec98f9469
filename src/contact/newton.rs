//! Semi-smooth Newton method on the coupled natural map of a steady rolling contact.
//!
//! Unknowns are the scaled stresses x = (tx, ty, p)/p̄ of the candidate nodes and the approach. With the scaled influence
//! matrix K, whose rows are the creep per unit speed times ρ_t and the gap times ρ_n, the map needs the values
//! s = c + K_s x and g = g0 − δ + K_n x; its generalised derivative follows P. Alart and A. Curnier, Comput. Methods Appl.
//! Mech. Engrg. 92 (1991): at a sliding node the traction is linearised about the direction ẑ of z = t − s.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, Par};

use super::steady::{NormalLoad, SteadyProblem};
use crate::{Error, Result};

/// The candidate nodes with their scaled influence matrix.
pub(super) struct Candidates {
    /// Node numbers, ascending, `[m]`.
    pub nodes: Vec<usize>,
    /// Transposed scaled influence matrix: column `3a + r` is row r of candidate a, `[3m, 3m]`, 1.
    kt: Mat<f64>,
    /// Scaled rigid creep and undeformed gap, `[3m]`.
    constant: Vec<f64>,
    /// Scaled rigid creep alone of the whole creepage is `constant`; derivative of the gap rows by the scaled approach, `[m]`.
    by_approach: Vec<f64>,
    /// Shares of the nodes in the load equation: Σ share·p = target, `[m]`.
    share: Vec<f64>,
    target: f64,
    /// Unit of stress, Pa.
    unit: f64,
    /// Approach in m per scaled approach.
    approach_unit: f64,
}

impl Candidates {
    /// Gathers the rows and columns of `nodes`; `stress` (Pa, `[3n]`) sets the unit of stress.
    pub fn new(problem: &SteadyProblem<'_>, nodes: Vec<usize>, stress: &[f64]) -> Result<Self> {
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
        for (a, &i) in nodes.iter().enumerate() {
            let (rn, rt) = (problem.rho_normal(i), problem.rho_tangential(i));
            let [x, y] = s.point(i);
            let c = problem.creepage.rigid(x, y);
            constant[3 * a] = rt * c[0] / unit;
            constant[3 * a + 1] = rt * c[1] / unit;
            constant[3 * a + 2] = rn * s.gap[i] / unit;
            by_approach[a] = -rn / reference;
            for r in 0..3 {
                let out = kt.col_as_slice_mut(3 * a + r);
                // W is symmetric: its column is the row wanted, and contiguous.
                let terms: &[(usize, f64)] =
                    if r < 2 { &s.upstream(i, problem.stencil).map(|(j, d)| (j, d * rt)) } else { &[(i, rn)] };
                for &(j, d) in terms.iter().filter(|t| t.1 != 0.0) {
                    let col = problem.compliance.col(3 * j + r);
                    for (o, &k) in out.chunks_exact_mut(3).zip(&nodes) {
                        for (c, v) in o.iter_mut().enumerate() {
                            *v += d * col[3 * k + c];
                        }
                    }
                }
                for (o, &k) in out.chunks_exact_mut(3).zip(&nodes) {
                    o.iter_mut().for_each(|v| *v *= s.weight[k]);
                }
            }
        }
        let total: f64 = nodes.iter().map(|&i| s.weight[i]).sum();
        let share = nodes.iter().map(|&i| s.weight[i] / total).collect();
        let target = match problem.load {
            NormalLoad::Force(f) => f / (unit * total),
            NormalLoad::Approach(_) => 0.0,
        };
        Ok(Self { nodes, kt, constant, by_approach, share, target, unit, approach_unit: unit / reference })
    }

    /// Scaled creep and gap of all candidates.
    fn response(&self, x: &[f64], approach: f64, creep_factor: f64) -> Vec<f64> {
        let n = x.len();
        let mut y = vec![0.0; n];
        let rhs = faer::MatRef::from_column_major_slice(x, n, 1);
        let out = faer::MatMut::from_column_major_slice_mut(&mut y, n, 1);
        matmul(out, Accum::Replace, self.kt.transpose(), rhs, 1.0, Par::Seq);
        for a in 0..self.nodes.len() {
            y[3 * a] += creep_factor * self.constant[3 * a];
            y[3 * a + 1] += creep_factor * self.constant[3 * a + 1];
            y[3 * a + 2] += self.constant[3 * a + 2] + self.by_approach[a] * approach;
        }
        y
    }
}

/// The map at one iterate.
struct Map {
    /// Creep and gap, scaled.
    y: Vec<f64>,
    /// Largest component as [`super::SteadySolution::residual`] measures it.
    largest: f64,
    /// Euclidean norm.
    norm: f64,
}

fn map(c: &Candidates, mu: f64, force_given: bool, x: &[f64], approach: f64, creep_factor: f64) -> Map {
    let y = c.response(x, approach, creep_factor);
    let m = c.nodes.len();
    let mut f = vec![0.0; 3 * m + 1];
    let mut largest = 0.0f64;
    let peak = (0..m).map(|a| x[3 * a + 2]).fold(1e-300, f64::max);
    let friction_scale = if mu > 0.0 { mu } else { 1.0 };
    for a in 0..m {
        let (fp, ft, _) = super::laws::natural_map(
            x[3 * a + 2],
            [x[3 * a], x[3 * a + 1]],
            y[3 * a + 2],
            [y[3 * a], y[3 * a + 1]],
            1.0,
            1.0,
            mu,
        );
        f[3 * a..3 * a + 3].copy_from_slice(&[ft[0] / friction_scale, ft[1] / friction_scale, fp]);
        largest = largest.max(fp.abs() / peak).max(ft[0].hypot(ft[1]) / (friction_scale * peak));
    }
    if force_given {
        let sum: f64 = (0..m).map(|a| c.share[a] * x[3 * a + 2]).sum();
        f[3 * m] = sum - c.target;
        largest = largest.max(f[3 * m].abs() / c.target);
    }
    let norm = f.iter().map(|v| v * v).sum::<f64>().sqrt();
    Map { y, largest, norm }
}

/// Solves on the candidates, from and into `stress` (Pa, `[3n]`) and `approach` (m). Returns the iterations spent so far,
/// `spent` among them.
pub(super) fn solve(
    problem: &SteadyProblem<'_>,
    c: &Candidates,
    stress: &mut [f64],
    approach: &mut f64,
    spent: usize,
) -> Result<usize> {
    let mut x: Vec<f64> =
        c.nodes.iter().flat_map(|&i| (0..3).map(move |r| 3 * i + r)).map(|k| stress[k] / c.unit).collect();
    let mut d = *approach / c.approach_unit;
    let mut iterations = spent;
    let mut history = Vec::new();
    // The whole creepage at once first; where that fails, from the load alone in steps of creepage.
    let mut reached = 0.0;
    let mut step = 1.0;
    while reached < 1.0 {
        let factor = f64::min(1.0, reached + step);
        let (mut tx, mut td) = (x.clone(), d);
        let mut trace = Vec::new();
        if newton(problem, c, factor, &mut tx, &mut td, &mut iterations, &mut trace)? {
            (x, d) = (tx, td);
            reached = factor;
            step *= 2.0;
            continue;
        }
        history.push(format!("{:.3} of the creepage: {}", factor, list(&trace)));
        step *= 0.25;
        if step < 1e-3 || iterations >= problem.max_iterations {
            return Err(Error::NotConverged(format!(
                "steady contact: no solution within {:.1e} after {iterations} iterations \
                 (analyses.steady.max_iterations is {}); residuals: {}",
                problem.tolerance,
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
    Ok(iterations)
}

fn list(trace: &[f64]) -> String {
    trace.iter().map(|r| format!("{r:.1e}")).collect::<Vec<_>>().join(" ")
}

/// Newton iterations at one creepage; false where they stall.
fn newton(
    problem: &SteadyProblem<'_>,
    c: &Candidates,
    factor: f64,
    x: &mut Vec<f64>,
    d: &mut f64,
    iterations: &mut usize,
    trace: &mut Vec<f64>,
) -> Result<bool> {
    let force_given = matches!(problem.load, NormalLoad::Force(_));
    let mu = problem.friction;
    let mut now = map(c, mu, force_given, x, *d, factor);
    // Half the tolerance: the final check sums in another order.
    let target = 0.5 * problem.tolerance;
    for _ in 0..40 {
        trace.push(now.largest);
        if now.largest <= target {
            return Ok(true);
        }
        if *iterations >= problem.max_iterations {
            return Ok(false);
        }
        *iterations += 1;
        let Some((nx, nd)) = direction(c, mu, force_given, x, *d, &now) else { return Ok(false) };
        let mut best: Option<(Vec<f64>, f64, Map)> = None;
        let mut t = 1.0;
        for _ in 0..7 {
            let tx: Vec<f64> = x.iter().zip(&nx).map(|(a, b)| a + t * (b - a)).collect();
            let td = *d + t * (nd - *d);
            let trial = map(c, mu, force_given, &tx, td, factor);
            let good = trial.norm <= (1.0 - 0.1 * t) * now.norm;
            if trial.norm.is_finite() && best.as_ref().map_or(true, |b| trial.norm < b.2.norm) {
                best = Some((tx, td, trial));
            }
            if good {
                break;
            }
            t *= 0.5;
        }
        let Some((tx, td, trial)) = best else { return Ok(false) };
        (*x, *d, now) = (tx, td, trial);
    }
    trace.push(now.largest);
    Ok(now.largest <= target)
}

/// Next iterate by the linearised map.
fn direction(c: &Candidates, mu: f64, force_given: bool, x: &[f64], d: f64, now: &Map) -> Option<(Vec<f64>, f64)> {
    let m = c.nodes.len();
    let closed: Vec<usize> = (0..m).filter(|&a| x[3 * a + 2] - now.y[3 * a + 2] > 0.0).collect();
    if closed.is_empty() {
        return None;
    }
    // Nodes found open lose their stresses at once; the response without them is where the linearisation starts.
    let mut x0 = vec![0.0; 3 * m];
    for &a in &closed {
        x0[3 * a..3 * a + 3].copy_from_slice(&x[3 * a..3 * a + 3]);
    }
    let k = closed.len();
    let size = 3 * k + usize::from(force_given);
    let mut jac = Mat::<f64>::zeros(size, size);
    let mut rhs = Mat::<f64>::zeros(size, 1);
    // Row by row; the unknowns are the new values themselves, not increments.
    let row = |a: usize, r: usize, b: usize, q: usize| c.kt[(3 * b + q, 3 * a + r)];
    for (i, &a) in closed.iter().enumerate() {
        let base_of = |r: usize| -> f64 {
            // Constant part of the response: y(x) − K x.
            let col = c.kt.col_as_slice(3 * a + r);
            now.y[3 * a + r] - col.iter().zip(x).map(|(u, v)| u * v).sum::<f64>()
        };
        let base = [base_of(0), base_of(1), base_of(2) - c.by_approach[a] * d];
        for (j, &b) in closed.iter().enumerate() {
            for q in 0..3 {
                jac[(3 * i + 2, 3 * j + q)] = row(a, 2, b, q);
            }
        }
        rhs[(3 * i + 2, 0)] = -base[2];
        if force_given {
            jac[(3 * i + 2, 3 * k)] = c.by_approach[a];
            jac[(3 * k, 3 * i + 2)] = c.share[a];
        } else {
            rhs[(3 * i + 2, 0)] -= c.by_approach[a] * d;
        }
        let p = x[3 * a + 2].max(0.0);
        let q = x[3 * a + 2] - now.y[3 * a + 2];
        let z = [x[3 * a] - now.y[3 * a], x[3 * a + 1] - now.y[3 * a + 1]];
        let norm = z[0].hypot(z[1]);
        if mu > 0.0 && norm <= mu * q {
            for (j, &b) in closed.iter().enumerate() {
                for cc in 0..3 {
                    jac[(3 * i, 3 * j + cc)] = row(a, 0, b, cc);
                    jac[(3 * i + 1, 3 * j + cc)] = row(a, 1, b, cc);
                }
            }
            rhs[(3 * i, 0)] = -base[0];
            rhs[(3 * i + 1, 0)] = -base[1];
        } else {
            let e = if norm > 0.0 { [z[0] / norm, z[1] / norm] } else { [1.0, 0.0] };
            let h = [-e[1], e[0]];
            let alpha = if norm > 0.0 { (mu * p / norm).min(1.0) } else { 0.0 };
            // Along ẑ: t·ẑ = μp. Across: (1 − α) t·ĥ + α s·ĥ = 0.
            jac[(3 * i, 3 * i)] = e[0];
            jac[(3 * i, 3 * i + 1)] = e[1];
            jac[(3 * i, 3 * i + 2)] = -mu;
            if alpha > 0.0 {
                for (j, &b) in closed.iter().enumerate() {
                    for cc in 0..3 {
                        jac[(3 * i + 1, 3 * j + cc)] = alpha * (h[0] * row(a, 0, b, cc) + h[1] * row(a, 1, b, cc));
                    }
                }
            }
            jac[(3 * i + 1, 3 * i)] += (1.0 - alpha) * h[0];
            jac[(3 * i + 1, 3 * i + 1)] += (1.0 - alpha) * h[1];
            rhs[(3 * i + 1, 0)] = -alpha * (h[0] * base[0] + h[1] * base[1]);
        }
    }
    if force_given {
        rhs[(3 * k, 0)] = c.target;
    }
    let lu = jac.partial_piv_lu();
    lu.solve_in_place(&mut rhs);
    if (0..size).any(|i| !rhs[(i, 0)].is_finite()) {
        return None;
    }
    for (i, &a) in closed.iter().enumerate() {
        for r in 0..3 {
            x0[3 * a + r] = rhs[(3 * i + r, 0)];
        }
    }
    Some((x0, if force_given { rhs[(3 * k, 0)] } else { d }))
}
