//! Semi-smooth Newton method on the natural map of a step (P. Alart and A. Curnier, Comput. Methods Appl. Mech.
//! Engrg. 92 (1991)).
//!
//! The factorisation of a Jacobian serves as the preconditioner of the following ones, over many steps, until the
//! contact has moved so far that more products are spent than a new one costs. W R is affine and the Krylov solver
//! returns it with its solution, so that neither a Newton step nor its line search needs a product of its own.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatMut};

use super::problem::{node, Effort, StepProblem, StepSolution};
use super::split_newton::SolverCache;
use crate::contact::krylov::gmres;
use crate::contact::law::{Status, Tangent};
use crate::Result;

/// Data kept for the next step.
#[derive(Default)]
pub struct NewtonMemory {
    factor: Option<PartialPivLu<f64>>,
    /// Unknowns of the factorisation.
    size: usize,
    /// Products beyond the first of each linear system since the factorisation was made.
    excess: usize,
    /// For the method by parts.
    pub(super) parts: SolverCache,
    /// Steps before the method by parts is tried again, and how many it will be the next time it fails.
    pause: usize,
    penalty: usize,
}

/// Excess products after which a new factorisation pays: it costs about as much as that many.
const WORTH: usize = 40;

impl NewtonMemory {
    /// Forgets everything; to be called when the nodes change.
    pub fn forget(&mut self) {
        let mut parts = std::mem::take(&mut self.parts);
        parts.forget();
        *self = Self { parts, ..Self::default() };
    }

    /// Returns whether the next step is to be tried by parts.
    pub(super) fn by_parts(&mut self) -> bool {
        self.pause = self.pause.saturating_sub(1);
        self.pause == 0
    }

    /// The method by parts failed: it rests, longer each time.
    pub(super) fn refused(&mut self) {
        self.penalty = (2 * self.penalty).clamp(2, 64);
        self.pause = self.penalty;
    }
}

/// Rows of the Jacobian of one node: v_t ↦ m v_t + b y_t + e v_n, v_n ↦ ρ_n y_n where closed, v ↦ v where open.
#[derive(Clone, Copy)]
struct Rows {
    closed: bool,
    normal: f64,
    m: [[f64; 2]; 2],
    b: [[f64; 2]; 2],
    e: [f64; 2],
}

/// An iterate.
struct Iterate {
    /// Reactions and shifts of the borders times `unit`, N, `[3k + borders]`.
    x: Vec<f64>,
    /// W R, m, `[3k]`.
    y: Vec<f64>,
    /// Euclidean norm of the map, N.
    norm: f64,
    /// Its largest component, N.
    largest: f64,
}

struct System<'a, 'p> {
    p: &'a StepProblem<'p>,
    /// N per m of shift.
    unit: f64,
    /// Weight of the equations of the totals.
    share: f64,
}

/// Solves to the largest residual `target`, N. `Ok(Err(_))`: the best reactions and shift where the method stalls.
#[allow(clippy::type_complexity)]
pub(super) fn solve(
    p: &StepProblem<'_>,
    target: f64,
    guess: &[f64],
    shift: &[f64],
    memory: &mut NewtonMemory,
    effort: &mut Effort,
) -> Result<std::result::Result<StepSolution, (Vec<f64>, Vec<f64>)>> {
    let k = p.nodes();
    let unit = (0..k).map(|i| p.rho(i).normal).sum::<f64>() / k as f64;
    let s = System { p, unit, share: 1.0 / (k as f64).sqrt() };
    let mut x = guess.to_vec();
    x.extend(shift.iter().map(|s| s * unit));
    let mut now = s.iterate(x, None, effort);
    let mut exact = true;
    let mut renewals = 0;
    let mut refused = 0;
    for _ in 0..40 {
        // First: the largest of several numbers passes over one that is none.
        if !now.norm.is_finite() {
            return Ok(Err((guess.to_vec(), shift.to_vec())));
        }
        if now.largest <= target {
            if exact {
                return Ok(Ok(s.solution(now)));
            }
            now = s.iterate(now.x, None, effort);
            exact = true;
            renewals += 1;
            if renewals > 3 {
                break;
            }
            continue;
        }
        effort.iterations += 1;
        let (rows, rhs) = s.linearise(&now);
        let size = rhs.len();
        if memory.factor.is_none() || memory.size != size || memory.excess > WORTH {
            s.factorise(&rows, memory, effort);
        }
        let forcing = (0.2 * target / now.largest).clamp(0.02, 0.3);
        let mut solved = s.krylov(&rows, &rhs, forcing, 12, memory, effort);
        if solved.relative > 0.5 || !solved.relative.is_finite() {
            s.factorise(&rows, memory, effort);
            solved = s.krylov(&rows, &rhs, forcing, 12, memory, effort);
        }
        // A singular Jacobian, as where a prescribed force finds all nodes sliding.
        if solved.products == 0 || solved.x.iter().any(|v| !v.is_finite()) {
            break;
        }
        memory.excess += solved.products.saturating_sub(1);
        exact = false;
        let mut t = 1.0;
        let mut best: Option<Iterate> = None;
        for _ in 0..6 {
            let x = now.x.iter().zip(&solved.x).map(|(a, b)| a + t * b).collect();
            let y = now.y.iter().zip(&solved.image).map(|(a, b)| a + t * b).collect();
            let trial = s.iterate(x, Some(y), effort);
            let good = trial.norm <= (1.0 - 0.1 * t) * now.norm;
            if trial.norm.is_finite() && best.as_ref().is_none_or(|b| trial.norm < b.norm) {
                best = Some(trial);
            }
            if good {
                break;
            }
            t *= 0.5;
        }
        let Some(best) = best else { break };
        // A full step across a change of status may well raise the norm a little before it falls.
        if best.norm > 0.9 * now.norm {
            refused += 1;
            if refused > 6 {
                now = best;
                break;
            }
        }
        now = best;
    }
    let shift = s.shift(&now.x);
    now.x.truncate(3 * k);
    Ok(Err((now.x, shift)))
}

impl System<'_, '_> {
    fn shift(&self, x: &[f64]) -> Vec<f64> {
        x[self.p.matrix.size()..].iter().map(|s| s / self.unit).collect()
    }

    /// The iterate with the unknowns `x`; `y` = W R where it is known.
    fn iterate(&self, x: Vec<f64>, y: Option<Vec<f64>>, effort: &mut Effort) -> Iterate {
        let (p, k3) = (self.p, self.p.matrix.size());
        let y = y.unwrap_or_else(|| {
            let mut y = vec![0.0; k3];
            p.matrix.times(&x[..k3], &mut y);
            effort.products += 1;
            y
        });
        let shift = self.shift(&x);
        let (mut square, mut largest) = (0.0, 0.0f64);
        for i in 0..k3 / 3 {
            let moved = p.shifted(i, &shift);
            let u = [0, 1, 2].map(|c| p.free[3 * i + c] + y[3 * i + c] + moved[c]);
            let node = node(&x[3 * i..3 * i + 3], &u);
            let f = p.project(i, p.rho(i), &node).map(&node);
            let tangential = f[0] * f[0] + f[1] * f[1];
            square += tangential + f[2] * f[2];
            largest = largest.max(f[2].abs()).max(tangential.sqrt());
        }
        for e in p.total_errors(&x[..k3]) {
            square += (self.share * e).powi(2);
            largest = largest.max(e.abs());
        }
        Iterate { x, y, norm: square.sqrt(), largest }
    }

    fn solution(&self, now: Iterate) -> StepSolution {
        let k3 = self.p.matrix.size();
        let shift = self.shift(&now.x);
        let mut reaction = now.x;
        reaction.truncate(k3);
        let u = self.p.displacement(&now.y, &shift);
        let (residual, status) = self.p.residual(&reaction, &u);
        // What is left on open nodes is below the residual.
        for (i, _) in status.iter().enumerate().filter(|(_, s)| **s == Status::Open) {
            reaction[3 * i..3 * i + 3].fill(0.0);
        }
        StepSolution { reaction, shift, response: now.y, status, friction: Vec::new(), residual }
    }

    /// Rows of the Jacobian and minus the map, with the normal rows put into the tangential ones.
    fn linearise(&self, now: &Iterate) -> (Vec<Rows>, Vec<f64>) {
        let (p, k) = (self.p, self.p.nodes());
        let shift = self.shift(&now.x);
        let mut rows = Vec::with_capacity(k);
        let mut rhs = Vec::with_capacity(3 * k + p.borders.len());
        for i in 0..k {
            let r = &now.x[3 * i..3 * i + 3];
            let moved = p.shifted(i, &shift);
            let u = [0, 1, 2].map(|c| p.free[3 * i + c] + now.y[3 * i + c] + moved[c]);
            let (rho, node) = (p.rho(i), node(r, &u));
            let found = p.project(i, rho, &node);
            let tangent = match found.tangent(&node, p.slope(i, &node)) {
                // A node that cannot move along the surface keeps the traction that it has.
                Tangent::Stick { creep: 0.0 } => Tangent::Open,
                tangent => tangent,
            };
            let ([f, g, _], closed) = (found.map(&node), found.status != Status::Open);
            let (m, e, b) = tangent.plane();
            rows.push(Rows { closed, normal: rho.normal, m, b, e });
            if closed {
                let lift = rho.normal * u[2];
                rhs.extend([-f - e[0] * lift, -g - e[1] * lift, -lift]);
            } else {
                rhs.extend(r.iter().map(|r| -r));
            }
        }
        rhs.extend(p.total_errors(&now.x[..3 * k]).into_iter().map(|e| -self.share * e));
        (rows, rhs)
    }

    fn factorise(&self, rows: &[Rows], memory: &mut NewtonMemory, effort: &mut Effort) {
        let (p, k) = (self.p, self.p.nodes());
        let size = 3 * k + p.borders.len();
        let mut j = Mat::<f64>::zeros(size, size);
        for col in 0..3 * k {
            let w = p.matrix.col(col);
            let out = j.col_as_slice_mut(col);
            for (i, row) in rows.iter().enumerate().filter(|(_, r)| r.closed) {
                let (x, y) = (w[3 * i], w[3 * i + 1]);
                out[3 * i] = row.b[0][0] * x + row.b[0][1] * y;
                out[3 * i + 1] = row.b[1][0] * x + row.b[1][1] * y;
                out[3 * i + 2] = row.normal * w[3 * i + 2];
            }
            let (i, c) = (col / 3, col % 3);
            let row = &rows[i];
            if !row.closed {
                out[col] = 1.0;
            } else if c < 2 {
                out[3 * i] += row.m[0][c];
                out[3 * i + 1] += row.m[1][c];
            } else {
                out[3 * i] += row.e[0];
                out[3 * i + 1] += row.e[1];
            }
            for (b, border) in p.borders.iter().enumerate() {
                out[3 * k + b] = self.share * border.row[p.patch_of(i)][c];
            }
        }
        for (b, border) in p.borders.iter().enumerate() {
            let out = j.col_as_slice_mut(3 * k + b);
            for (i, row) in rows.iter().enumerate().filter(|(_, r)| r.closed) {
                let [x, y, n] = border.column[p.patch_of(i)];
                out[3 * i] = (row.b[0][0] * x + row.b[0][1] * y) / self.unit;
                out[3 * i + 1] = (row.b[1][0] * x + row.b[1][1] * y) / self.unit;
                out[3 * i + 2] = row.normal * n / self.unit;
            }
        }
        memory.factor = Some(j.partial_piv_lu());
        memory.size = size;
        memory.excess = 0;
        effort.factorisations += 1;
    }

    /// J v with W v beside it.
    fn apply(&self, rows: &[Rows], v: &[f64], effort: &mut Effort) -> (Vec<f64>, Vec<f64>) {
        let k3 = 3 * rows.len();
        let mut image = vec![0.0; k3];
        self.p.matrix.times(&v[..k3], &mut image);
        effort.products += 1;
        let shift = self.shift(v);
        let mut out = Vec::with_capacity(v.len());
        for (i, row) in rows.iter().enumerate() {
            let x = &v[3 * i..3 * i + 3];
            if !row.closed {
                out.extend_from_slice(x);
                continue;
            }
            let moved = self.p.shifted(i, &shift);
            let y = [0, 1, 2].map(|c| image[3 * i + c] + moved[c]);
            for c in 0..2 {
                let direct = row.m[c][0] * x[0] + row.m[c][1] * x[1] + row.e[c] * x[2];
                out.push(direct + row.b[c][0] * y[0] + row.b[c][1] * y[1]);
            }
            out.push(row.normal * y[2]);
        }
        out.extend(self.p.borders.iter().map(|b| self.share * self.p.resultant(b, &v[..k3])));
        (out, image)
    }

    fn krylov(
        &self,
        rows: &[Rows],
        rhs: &[f64],
        forcing: f64,
        limit: usize,
        memory: &NewtonMemory,
        effort: &mut Effort,
    ) -> crate::contact::krylov::GmresResult {
        let mut solutions = 0;
        let solved = gmres(
            rhs,
            forcing,
            limit,
            |r| {
                solutions += 1;
                let mut z = r.to_vec();
                if let Some(factor) = &memory.factor {
                    let n = z.len();
                    factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut z, n, 1));
                }
                z
            },
            |v| self.apply(rows, v, effort),
        );
        effort.solutions += solutions;
        solved
    }
}
