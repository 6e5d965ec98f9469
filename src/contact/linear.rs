//! The linear systems of Newton's method: the linearised map on the closed nodes, its preconditioner, and their solution.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{Llt, PartialPivLu, Solve};
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};

use super::candidates::Candidates;
use super::krylov::gmres;
use super::law::Tangent;
use super::newton::{node, Effort, Iterate, Law, UNIT};
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
pub(super) struct ClosedInfluence {
    /// Closed nodes (indices into the candidates).
    pub closed: Vec<usize>,
    /// Row after row: row `3i + r` is row r of the closed node i, `[3k, 3k]`.
    kt: Option<Vec<f32>>,
}

impl ClosedInfluence {
    /// Makes the matrix that of `closed`; where the set is the same, only the rows of the candidates `changed`.
    pub fn update(&mut self, c: &Candidates, closed: &[usize], changed: &[usize]) {
        let k = closed.len();
        let mut kt = self.kt.take().unwrap_or_default();
        if self.closed == closed && kt.len() == 9 * k * k {
            changed.iter().filter_map(|a| closed.binary_search(a).ok()).for_each(|i| gather(c, closed, i, &mut kt));
        } else {
            self.closed = closed.to_vec();
            // In the memory of the one before, all of which is written.
            kt.resize(9 * k * k, 0.0);
            (0..k).for_each(|i| gather(c, closed, i, &mut kt));
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

/// A Newton step.
pub(super) struct NewtonStep {
    /// Change of the stresses, `[3m]`.
    pub dx: Vec<f64>,
    /// Change of the approach.
    pub dd: f64,
    /// Change of creep and gap that follows, `[3m]`; of the nodes that are not closed, the gap alone.
    pub dy: Vec<f64>,
}

/// The linearised map at an iterate. Unknowns `[3k + 1]`: (δtx, δty, δp) of the closed nodes, then δδ.
pub(super) struct NewtonSystem<'a> {
    c: &'a Candidates,
    law: Law<'a>,
    closed: &'a [usize],
    tangents: Vec<Tangent>,
    normal: &'a NormalBlock,
    compact: &'a ClosedInfluence,
    lines: Vec<Line>,
    rhs: Vec<f64>,
}

/// The tangential block of the closed nodes of one grid line, factored.
struct Line {
    first: usize,
    len: usize,
    factor: PartialPivLu<f64>,
}

impl<'a> NewtonSystem<'a> {
    /// Linearises at `now` with the closed nodes `compact.closed`, for which `normal` has been updated too.
    pub fn new(
        c: &'a Candidates,
        law: Law<'a>,
        now: &Iterate,
        normal: &'a NormalBlock,
        compact: &'a ClosedInfluence,
    ) -> Self {
        let closed = &compact.closed[..];
        let k = closed.len();
        let mut tangents = Vec::with_capacity(k);
        let mut rhs = vec![0.0; 3 * k + 1];
        for (i, &a) in closed.iter().enumerate() {
            let (x, y) = (&now.x[3 * a..3 * a + 3], &now.y[3 * a..3 * a + 3]);
            let node = node(x, y);
            // The normal row closes the gap: the bound of the traction is that of the pressure itself.
            let mut projected = node.project(UNIT, law.friction[a]);
            projected.pressure = x[2].max(0.0);
            let tangent = projected.tangent(&node, 0.0);
            let [along, across] = tangent.rows(node.traction, node.pressure, node.creep);
            rhs[3 * i..3 * i + 3].copy_from_slice(&[-along, -across, -y[2]]);
            tangents.push(tangent);
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
                    for j in 0..len {
                        let b = 3 * closed[first + j];
                        for q in 0..2 {
                            let (sx, sy) = (rows[0][b + q], rows[1][b + q]);
                            let t = [0, 1].map(|r| f64::from(u8::from(i == j && r == q)));
                            let [u, v] = tangents[first + i].rows(t, 0.0, [sx, sy]);
                            block[(2 * i, 2 * j + q)] = u;
                            block[(2 * i + 1, 2 * j + q)] = v;
                        }
                    }
                }
                Line { first, len, factor: block.partial_piv_lu() }
            })
            .collect();
        Self { c, law, closed, tangents, normal, compact, lines, rhs }
    }

    /// Solves to the relative residual `tolerance`; None when that fails badly.
    pub fn solve(&self, tolerance: f64, effort: &mut Effort) -> Option<NewtonStep> {
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
        Some(NewtonStep { dx, dd, dy })
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
            let [u, w] = self.tangents[i].rows([t[0], t[1]], t[2], [s[0], s[1]]);
            out[3 * i..3 * i + 3].copy_from_slice(&[u, w, s[2]]);
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
                let [along, across] = self.tangents[i].rows([0.0; 2], p[i], [0.0; 2]);
                t.extend([r[3 * i] - along, r[3 * i + 1] - across]);
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
