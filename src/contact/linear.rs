//! The linear systems of Newton's method: the linearised map on the closed nodes, its preconditioner, and their solution.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{Llt, PartialPivLu, Solve};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

use super::candidates::Candidates;
use super::krylov::gmres;
use super::newton::{Effort, Iterate, Law};
use super::normal::not_definite;
use super::steady::SteadyProblem;
use crate::dense::dot;
use crate::Result;

/// Cholesky factor of the normal compliance of the closed nodes, kept while the set stays.
#[derive(Default)]
pub(super) struct NormalBlock {
    closed: Vec<usize>,
    factor: Option<Llt<f64>>,
    /// K_nn⁻¹ ∂g/∂δ, `[k]`.
    by_approach: Vec<f64>,
}

impl NormalBlock {
    /// Makes the factor that of `closed` (indices into the candidates).
    pub fn update(&mut self, problem: &SteadyProblem<'_>, c: &Candidates, closed: &[usize]) -> Result<()> {
        if self.factor.is_some() && self.closed == closed {
            return Ok(());
        }
        let row = |i: usize| 3 * c.nodes[closed[i]] + 2;
        let a =
            Mat::from_fn(
                closed.len(),
                closed.len(),
                |i, j| {
                    if i >= j {
                        problem.compliance[(row(i), row(j))]
                    } else {
                        0.0
                    }
                },
            );
        self.factor = Some(a.llt(Side::Lower).map_err(|_| not_definite())?);
        self.closed = closed.to_vec();
        let mut z: Vec<f64> = closed.iter().map(|&a| c.by_approach[a]).collect();
        self.solve(c, &mut z);
        self.by_approach = z;
        Ok(())
    }

    /// K_nn⁻¹ r in place, `[k]`; the factor is that of the unscaled block, which is symmetric.
    fn solve(&self, c: &Candidates, r: &mut [f64]) {
        let Some(factor) = &self.factor else { return };
        r.iter_mut().zip(&self.closed).for_each(|(v, &a)| *v /= c.rho[a]);
        let k = r.len();
        factor.solve_in_place(MatMut::from_column_major_slice_mut(r, k, 1));
        r.iter_mut().zip(&self.closed).for_each(|(v, &a)| *v /= c.weight[a]);
    }
}

/// The influence matrix of the closed nodes alone in single precision, for the products of GMRES: they are bound by memory,
/// and a Newton step needs no more digits. What the rounding leaves in the response is removed by computing it afresh.
#[derive(Default)]
pub(super) struct Compact {
    /// Closed nodes (indices into the candidates).
    pub closed: Vec<usize>,
    /// Row after row: row `3i + r` is row r of the closed node i, `[3k, 3k]`.
    kt: Option<Vec<f32>>,
}

impl Compact {
    /// Makes the matrix that of `closed`; where the set is the same, only the rows of the candidates `changed`.
    pub fn update(&mut self, c: &Candidates, closed: &[usize], changed: &[usize]) {
        let k = closed.len();
        let mut kt = match self.kt.take() {
            Some(kt) if self.closed == closed => kt,
            _ => {
                self.closed = closed.to_vec();
                let mut kt = vec![0.0; 9 * k * k];
                (0..k).for_each(|i| gather(c, closed, i, &mut kt));
                self.kt = Some(kt);
                return;
            }
        };
        for a in changed {
            if let Ok(i) = closed.binary_search(a) {
                gather(c, closed, i, &mut kt);
            }
        }
        self.kt = Some(kt);
    }

    /// Change of creep and gap of the closed nodes under changes `x` of their stresses, `[3k]`.
    fn product(&self, x: &[f64]) -> Vec<f64> {
        let Some(kt) = &self.kt else { return vec![0.0; x.len()] };
        let x: Vec<f32> = x.iter().map(|&v| v as f32).collect();
        let mut y = vec![0.0f32; x.len()];
        let n = x.len();
        let (rhs, out) = (MatRef::from_column_major_slice(&x, n, 1), MatMut::from_column_major_slice_mut(&mut y, n, 1));
        let kt = MatRef::from_column_major_slice(kt, n, n);
        matmul(out, Accum::Replace, kt.transpose(), rhs, 1.0, Par::Seq);
        y.iter().map(|&v| f64::from(v)).collect()
    }
}

/// Copies the rows of the closed node `i`.
fn gather(c: &Candidates, closed: &[usize], i: usize, kt: &mut [f32]) {
    let width = 3 * closed.len();
    for r in 0..3 {
        let from = c.row(3 * closed[i] + r);
        for (o, &b) in kt[width * (3 * i + r)..][..width].chunks_exact_mut(3).zip(closed) {
            let v = &from[3 * b..3 * b + 3];
            (o[0], o[1], o[2]) = (v[0] as f32, v[1] as f32, v[2] as f32);
        }
    }
}

/// Linearised friction law at a closed node.
#[derive(Clone, Copy)]
enum Friction {
    /// s + δs = 0.
    Stick,
    /// Along ẑ: δt·ẑ − μ δp = r. Across: (1−α) δt·ĥ + α δs·ĥ = r, α = μp/|z|, ĥ = ẑ turned by 90°.
    Slip { z: [f64; 2], alpha: f64 },
}

/// A Newton step.
pub(super) struct Step {
    /// Change of the stresses, `[3m]`.
    pub dx: Vec<f64>,
    /// Change of the approach.
    pub dd: f64,
    /// Change of creep and gap that follows, `[3m]`; of the nodes that are not closed, the gap alone.
    pub dy: Vec<f64>,
}

/// The linearised map at an iterate. Unknowns `[3k + 1]`: (δtx, δty, δp) of the closed nodes, then δδ.
pub(super) struct Linear<'a> {
    c: &'a Candidates,
    law: Law<'a>,
    closed: &'a [usize],
    friction: Vec<Friction>,
    normal: &'a NormalBlock,
    compact: &'a Compact,
    lines: Vec<Line>,
    rhs: Vec<f64>,
}

/// The tangential block of the closed nodes of one grid line, factored.
struct Line {
    first: usize,
    len: usize,
    factor: PartialPivLu<f64>,
}

impl<'a> Linear<'a> {
    /// Linearises at `now` with the closed nodes `compact.closed`, for which `normal` has been updated too.
    pub fn new(c: &'a Candidates, law: Law<'a>, now: &Iterate, normal: &'a NormalBlock, compact: &'a Compact) -> Self {
        let closed = &compact.closed[..];
        let k = closed.len();
        let mut friction = Vec::with_capacity(k);
        let mut rhs = vec![0.0; 3 * k + 1];
        for (i, &a) in closed.iter().enumerate() {
            let (x, y) = (&now.x[3 * a..3 * a + 3], &now.y[3 * a..3 * a + 3]);
            let mu = law.friction[a];
            let z = [x[0] - y[0], x[1] - y[1]];
            let norm = z[0].hypot(z[1]);
            rhs[3 * i + 2] = -y[2];
            if norm <= mu * (x[2] - y[2]) && mu > 0.0 {
                friction.push(Friction::Stick);
                rhs[3 * i] = -y[0];
                rhs[3 * i + 1] = -y[1];
            } else {
                let z = if norm > 0.0 { [z[0] / norm, z[1] / norm] } else { [1.0, 0.0] };
                let alpha = if norm > 0.0 { (mu * x[2].max(0.0) / norm).min(1.0) } else { 0.0 };
                friction.push(Friction::Slip { z, alpha });
                rhs[3 * i] = mu * x[2] - (z[0] * x[0] + z[1] * x[1]);
                let across = |v: &[f64]| z[0] * v[1] - z[1] * v[0];
                rhs[3 * i + 1] = -(1.0 - alpha) * across(x) - alpha * across(y);
            }
        }
        if law.force_given {
            rhs[3 * k] = c.target - c.share.iter().zip(now.x.chunks_exact(3)).map(|(s, x)| s * x[2]).sum::<f64>();
        }
        let lines = (0..k)
            .collect::<Vec<_>>()
            .chunk_by(|&i, &j| c.line[closed[i]] == c.line[closed[j]])
            .map(|ids| {
                let (first, len) = (ids[0], ids.len());
                let mut block = Mat::<f64>::zeros(2 * len, 2 * len);
                for i in 0..len {
                    let rows = [0, 1].map(|r| c.row(3 * closed[first + i] + r));
                    let mu = law.friction[closed[first + i]];
                    for j in 0..len {
                        let b = 3 * closed[first + j];
                        for q in 0..2 {
                            let (sx, sy) = (rows[0][b + q], rows[1][b + q]);
                            let t = |r: usize| f64::from(u8::from(i == j && r == q));
                            let (u, v) = linearised(friction[first + i], [t(0), t(1)], 0.0, [sx, sy], mu);
                            block[(2 * i, 2 * j + q)] = u;
                            block[(2 * i + 1, 2 * j + q)] = v;
                        }
                    }
                }
                Line { first, len, factor: block.partial_piv_lu() }
            })
            .collect();
        Self { c, law, closed, friction, normal, compact, lines, rhs }
    }

    /// Solves to the relative residual `tolerance`; None when that fails badly.
    pub fn solve(&self, tolerance: f64, effort: &mut Effort) -> Option<Step> {
        let k = self.closed.len();
        let solved = gmres(&self.rhs, tolerance, 200, |r| self.precondition(r), |v| self.apply(v));
        effort.products += solved.products;
        if solved.relative.is_nan() || solved.relative > 0.5 || solved.x.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let (mut dx, mut dy) = (vec![0.0; 3 * self.c.nodes.len()], vec![0.0; 3 * self.c.nodes.len()]);
        let mut inside = vec![false; self.c.nodes.len()];
        for (i, &a) in self.closed.iter().enumerate() {
            inside[a] = true;
            dx[3 * a..3 * a + 3].copy_from_slice(&solved.x[3 * i..3 * i + 3]);
            dy[3 * a..3 * a + 3].copy_from_slice(&solved.image[3 * i..3 * i + 3]);
        }
        let dd = solved.x[3 * k];
        for a in (0..self.c.nodes.len()).filter(|&a| !inside[a]) {
            dy[3 * a + 2] = dot(self.c.row(3 * a + 2), &dx) + self.c.by_approach[a] * dd;
        }
        Some(Step { dx, dd, dy })
    }

    /// Linearised map of `v`, and the change of creep and gap of the closed nodes.
    fn apply(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let k = self.closed.len();
        let mut y = self.compact.product(&v[..3 * k]);
        let mut out = vec![0.0; 3 * k + 1];
        for (i, &a) in self.closed.iter().enumerate() {
            let (t, s) = (&v[3 * i..3 * i + 3], &mut y[3 * i..3 * i + 3]);
            if self.law.force_given {
                s[2] += self.c.by_approach[a] * v[3 * k];
                out[3 * k] += self.c.share[a] * t[2];
            }
            let (u, w) = linearised(self.friction[i], [t[0], t[1]], t[2], [s[0], s[1]], self.law.friction[a]);
            out[3 * i] = u;
            out[3 * i + 1] = w;
            out[3 * i + 2] = s[2];
        }
        if !self.law.force_given {
            out[3 * k] = v[3 * k];
        }
        (out, y)
    }

    /// Approximate solution for the residual `r`.
    fn precondition(&self, r: &[f64]) -> Vec<f64> {
        let k = self.closed.len();
        let mut out = vec![0.0; 3 * k + 1];
        let mut p: Vec<f64> = (0..k).map(|i| r[3 * i + 2]).collect();
        self.normal.solve(self.c, &mut p);
        if self.law.force_given {
            let share: Vec<f64> = self.closed.iter().map(|&a| self.c.share[a]).collect();
            let z = &self.normal.by_approach;
            let d = (dot(&share, &p) - r[3 * k]) / dot(&share, z);
            p.iter_mut().zip(z).for_each(|(p, z)| *p -= d * z);
            out[3 * k] = d;
        } else {
            out[3 * k] = r[3 * k];
        }
        let mut t = Vec::new();
        for line in &self.lines {
            t.clear();
            for i in line.first..line.first + line.len {
                let radial = match self.friction[i] {
                    Friction::Stick => 0.0,
                    Friction::Slip { .. } => self.law.friction[self.closed[i]] * p[i],
                };
                t.extend([r[3 * i] + radial, r[3 * i + 1]]);
            }
            let n = t.len();
            line.factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut t, n, 1));
            for (i, v) in (line.first..).zip(t.chunks_exact(2)) {
                out[3 * i] = v[0];
                out[3 * i + 1] = v[1];
            }
        }
        for i in 0..k {
            out[3 * i + 2] = p[i];
        }
        out
    }
}

/// Left-hand sides of the two linearised friction rows of a node under changes of its traction, pressure and creep.
fn linearised(f: Friction, t: [f64; 2], p: f64, s: [f64; 2], mu: f64) -> (f64, f64) {
    match f {
        Friction::Stick => (s[0], s[1]),
        Friction::Slip { z, alpha } => {
            let across = |v: [f64; 2]| z[0] * v[1] - z[1] * v[0];
            (z[0] * t[0] + z[1] * t[1] - mu * p, (1.0 - alpha) * across(t) + alpha * across(s))
        }
    }
}
