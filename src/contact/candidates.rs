//! The nodes that may touch, with everything scaled and gathered that Newton's method works on.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};

use super::influence::row;
use super::interface::Upstream;
use super::newton::Factors;
use super::steady::{NormalLoad, SteadyProblem};
use crate::dense::dot;
use crate::{Error, Result};

/// The candidate nodes with their scaled influence matrix.
pub(super) struct Candidates {
    /// Node numbers, ascending, `[m]`.
    pub nodes: Vec<usize>,
    /// Grid line (index along y) of each candidate, `[m]`.
    pub line: Vec<usize>,
    /// Augmentation parameter of the normal law, Pa/m, `[m]`.
    pub rho: Vec<f64>,
    /// Augmentation parameter of the friction law times V, Pa, `[m]`.
    rho_creep: Vec<f64>,
    /// Nodal areas, m², `[m]`.
    pub weight: Vec<f64>,
    /// Scaled influence matrix, row after row (row `3a + r` is row r of candidate a), `[3m, 3m]`, 1.
    kt: Vec<f64>,
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
    pub unit: f64,
    /// Approach in m per scaled approach.
    pub approach_unit: f64,
    /// What Newton's method has made of them.
    pub factors: Factors,
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
        let mut kt = vec![0.0; 9 * m * m];
        let mut constant = vec![0.0; 3 * m];
        let mut by_approach = vec![0.0; m];
        let reference = problem.rho_normal(nodes[0]);
        let mut rho = vec![0.0; m];
        for (a, &i) in nodes.iter().enumerate() {
            rho[a] = problem.rho_normal(i);
            constant[3 * a + 2] = rho[a] * s.gap[i] / unit;
            by_approach[a] = -rho[a] / reference;
            gather(problem, &[(i, rho[a])], 2, &nodes, &mut kt[3 * m * (3 * a + 2)..][..3 * m])?;
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
            rho_creep: vec![0.0; m],
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
            factors: Factors::default(),
        };
        new.renew(problem, upstream)?;
        Ok(new)
    }

    /// Takes the creep rows from another upstream operator; only rows that differ cost anything. Returns the candidates
    /// (by index) whose rows have changed.
    pub fn renew(&mut self, problem: &SteadyProblem<'_>, upstream: &Upstream) -> Result<Vec<usize>> {
        let mut changed = Vec::new();
        let width = 3 * self.nodes.len();
        for (a, &i) in self.nodes.iter().enumerate() {
            if self.upstream.rows.get(i) == Some(&upstream.rows[i]) {
                continue;
            }
            changed.push(a);
            let rho = problem.rho_tangential(upstream, i);
            self.rho_creep[a] = rho;
            let [x, y] = problem.interface.point(i);
            let rigid = problem.creepage.rigid(x, y);
            let terms = upstream.rows[i].map(|(j, d)| (j, d * rho));
            for (r, c) in rigid.iter().enumerate() {
                let c = c + upstream.at(i, |j| problem.interface.shift[j][r]);
                self.constant[3 * a + r] = rho * c / self.unit;
                gather(problem, &terms, r, &self.nodes, &mut self.kt[width * (3 * a + r)..][..width])?;
            }
        }
        self.upstream.clone_from(upstream);
        Ok(changed)
    }

    /// Takes the creepages of `problem`, which has the interface, the load and the influence matrix of the one before.
    pub fn take_creepage(&mut self, problem: &SteadyProblem<'_>) {
        for (a, &i) in self.nodes.iter().enumerate() {
            let [x, y] = problem.interface.point(i);
            let rigid = problem.creepage.rigid(x, y);
            for (r, c) in rigid.iter().enumerate() {
                let c = c + self.upstream.at(i, |j| problem.interface.shift[j][r]);
                self.constant[3 * a + r] = self.rho_creep[a] * c / self.unit;
            }
        }
    }

    /// Renews the creep of candidate `a` in the response `y` to the stresses `x`.
    pub fn renew_response(&self, a: usize, x: &[f64], creep_factor: f64, y: &mut [f64]) {
        for k in [3 * a, 3 * a + 1] {
            y[k] = dot(self.row(k), x) + creep_factor * self.constant[k];
        }
    }

    /// First guess of the tractions for the pressures in `x`, `[3m]`, whose tractions are zero, by the simplified theory of
    /// rolling contact (J. J. Kalker's FASTSIM, Vehicle System Dynamics 11 (1982)): along each line from the leading edge on
    /// t grows by −ṡ Δx/(V L) and is cut at μp. The flexibility L is the one at which a traction proportional to the pressure
    /// has on average the gradient of w that it has in truth (`friction`: μ of each candidate, `[m]`): with w = L t and elliptic stresses, L = −2⟨ṡ x⟩/(V p_max).
    pub fn guess_tractions(&self, problem: &SteadyProblem<'_>, friction: &[f64], x: &mut [f64], y: &[f64]) {
        let m = self.nodes.len();
        let closed: Vec<usize> = (0..m).filter(|&a| x[3 * a + 2] > 0.0).collect();
        let peak = closed.iter().map(|&a| x[3 * a + 2]).fold(0.0, f64::max);
        let probe: Vec<f64> = (0..3 * m).map(|k| if k % 3 < 2 { x[3 * (k / 3) + 2] } else { 0.0 }).collect();
        let s = self.product(&probe);
        let position = |a: usize| problem.interface.point(self.nodes[a])[0];
        let count = closed.len() as f64;
        let centre = closed.iter().map(|&a| position(a)).sum::<f64>() / count;
        let flexibility = [0, 1].map(|c| {
            let mean = closed.iter().map(|&a| (position(a) - centre) * s[3 * a + c] / self.rho_creep[a]).sum::<f64>();
            -2.0 * mean / (count * peak)
        });
        if flexibility.iter().any(|l| *l <= 0.0 || !l.is_finite()) {
            return;
        }
        let mut previous: Option<usize> = None;
        for &a in &closed {
            let (t, length) = match previous {
                Some(b) if self.nodes[a] == self.nodes[b] + 1 && self.line[a] == self.line[b] => {
                    ([x[3 * b], x[3 * b + 1]], position(a) - position(b))
                }
                // The edge lies half-way ahead of the first node, more or less.
                _ => ([0.0; 2], 0.5 * self.weight[a].sqrt()),
            };
            let z = [0, 1].map(|c| t[c] - y[3 * a + c] / self.rho_creep[a] * length / flexibility[c]);
            let z = super::law::project_disc(z, friction[a] * x[3 * a + 2]);
            x[3 * a..3 * a + 2].copy_from_slice(&z);
            previous = Some(a);
        }
    }

    /// Row `k` of K, `[3m]`.
    pub fn row(&self, k: usize) -> &[f64] {
        let width = 3 * self.nodes.len();
        &self.kt[width * k..][..width]
    }

    /// K x, `[3m]`.
    pub fn product(&self, x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let mut y = vec![0.0; n];
        let rhs = MatRef::from_column_major_slice(x, n, 1);
        let out = MatMut::from_column_major_slice_mut(&mut y, n, 1);
        let k = MatRef::from_column_major_slice(&self.kt, n, n);
        matmul(out, Accum::Replace, k.transpose(), rhs, 1.0, Par::Seq);
        y
    }

    /// Scaled creep and gap of all candidates.
    pub fn response(&self, x: &[f64], approach: f64, creep_factor: f64) -> Vec<f64> {
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
    let mut rows = Vec::with_capacity(terms.len());
    for &(j, d) in terms.iter().filter(|t| t.1 != 0.0) {
        let Some(row) = row(problem.compliance, 3 * j + r) else {
            return Err(Error::Defect("steady contact: the influence matrix is neither by columns nor by rows".into()));
        };
        rows.push((row, d));
    }
    let weight = &problem.interface.weight;
    // All terms at once, so that `out` is written once.

    match rows[..] {
        [(a, x)] => put(nodes, weight, |k| x * a[k], out),
        [(a, x), (b, y)] => put(nodes, weight, |k| x * a[k] + y * b[k], out),
        [(a, x), (b, y), (c, z)] => put(nodes, weight, |k| x * a[k] + y * b[k] + z * c[k], out),
        _ => put(nodes, weight, |k| rows.iter().map(|(row, d)| d * row[k]).sum(), out),
    }
    Ok(())
}

/// Writes weight times `of` each of the three rows of each of `nodes`.
fn put(nodes: &[usize], weight: &[f64], of: impl Fn(usize) -> f64, out: &mut [f64]) {
    for (o, &k) in out.chunks_exact_mut(3).zip(nodes) {
        let values = [of(3 * k), of(3 * k + 1), of(3 * k + 2)];
        o.copy_from_slice(&values.map(|v| weight[k] * v));
    }
}
