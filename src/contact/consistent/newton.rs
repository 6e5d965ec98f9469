//! Semi-smooth Newton method on F(R) = R − ∫Nᵀ Proj(N (H⁻¹R − ρ u)), u = constant + B R + shift.
//!
//! With the derivative D of the integral F′ = I − D (H⁻¹ − ρ B). A Jacobian is factored where the one before no
//! longer serves GMRES as a preconditioner, over Newton iterations and over steps in time.

use super::cells::{CellDerivative, ContactCells, IntegratedLaw, NodeFields};
use crate::contact::krylov::gmres;
use crate::dense::product;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatMut, MatRef};

/// A problem on the nodes of some cells.
pub(crate) struct CellProblem<'a> {
    pub cells: &'a ContactCells,
    pub law: IntegratedLaw,
    /// B: creep (x, y) and gap per force (x, y, n), `[3k, 3k]`.
    pub response: MatRef<'a, f64>,
    /// u at R = 0 without shift, `[3k]`.
    pub constant: &'a [f64],
    /// Totals of the forces along x, y, n, N; where one is given the shift of that component is unknown.
    pub total: [Option<f64>; 3],
    /// Unit of the components of F at a node, N, `[k]`.
    pub measure: &'a [f64],
}

/// Forces and shifts with what follows from them.
#[derive(Debug, Clone)]
pub(crate) struct ConsistentIterate {
    /// R, N, `[3k]`.
    pub forces: Vec<f64>,
    /// Shift of each component of u.
    pub shift: [f64; 3],
    /// B R, `[3k]`.
    pub response: Vec<f64>,
    /// H⁻¹R, Pa, `[3k]`.
    pub stress: Vec<f64>,
    /// u, `[3k]`.
    pub motion: Vec<f64>,
    /// F, and the errors of the totals, N, `[3k + borders]`.
    map: Vec<f64>,
    /// Largest component of it, as measured.
    pub largest: f64,
    norm: f64,
}

impl ConsistentIterate {
    /// The integral, N, `[3k]`: the forces but for what is left of F, and none where nothing presses.
    pub fn projected(&self) -> Vec<f64> {
        self.forces.iter().zip(&self.map).map(|(r, f)| r - f).collect()
    }

    pub fn fields(&self) -> NodeFields<'_> {
        NodeFields { stress: &self.stress, motion: &self.motion }
    }
}

/// A factored Jacobian.
#[derive(Default)]
pub(crate) struct FactoredJacobian {
    factor: Option<PartialPivLu<f64>>,
}

/// Counts of a solution.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ConsistentEffort {
    pub iterations: usize,
    pub products: usize,
    pub factorisations: usize,
}

/// Products of a linear system from which on a new factorisation pays.
const WORTH: usize = 25;
/// Iterations after which the method is given up.
const PATIENCE: usize = 60;

impl CellProblem<'_> {
    /// Components with an unknown shift.
    fn borders(&self) -> impl Iterator<Item = usize> + '_ {
        (0..3).filter(|&c| self.total[c].is_some())
    }

    fn rho(&self) -> [f64; 3] {
        let rho = self.law.rho;
        [rho.tangential, rho.tangential, rho.normal]
    }

    /// Everything that follows from forces, N, `[3k]`, and shifts.
    pub fn iterate(&self, forces: Vec<f64>, shift: [f64; 3]) -> ConsistentIterate {
        let response = product(self.response, &forces);
        self.with(forces, shift, response)
    }

    fn with(&self, forces: Vec<f64>, shift: [f64; 3], response: Vec<f64>) -> ConsistentIterate {
        let stress = self.cells.stress(&forces);
        let motion: Vec<f64> =
            self.constant.iter().zip(&response).enumerate().map(|(r, (c, b))| c + b + shift[r % 3]).collect();
        let found = self.cells.integral(NodeFields { stress: &stress, motion: &motion }, self.law);
        let mut map: Vec<f64> = forces.iter().zip(&found.forces).map(|(r, i)| r - i).collect();
        let of = |(f, m): (&[f64], &f64)| f[0].hypot(f[1]).max(f[2].abs()) / m;
        // A comparison that keeps what is not a number.
        let worse = |a: f64, b: f64| if b <= a { a } else { b };
        let mut largest = map.chunks_exact(3).zip(self.measure).map(of).fold(0.0, worse);
        let measure = self.measure.iter().copied().fold(0.0, f64::max);
        for c in self.borders() {
            let error = forces[c..].iter().step_by(3).sum::<f64>() - self.total[c].unwrap_or(0.0);
            largest = worse(largest, error.abs() / measure);
            map.push(error);
        }
        let norm = map.iter().map(|f| f * f).sum::<f64>().sqrt();
        ConsistentIterate { forces, shift, response, stress, motion, map, largest, norm }
    }

    /// Solves to a largest residual of `target`, as measured, from `start`; the residual that is left where the
    /// method stalls.
    pub fn solve(
        &self,
        target: f64,
        start: ConsistentIterate,
        memory: &mut FactoredJacobian,
        effort: &mut ConsistentEffort,
    ) -> Result<ConsistentIterate, f64> {
        let mut now = start;
        for _ in 0..PATIENCE {
            if now.largest <= target {
                return Ok(now);
            }
            if !now.norm.is_finite() {
                break;
            }
            effort.iterations += 1;
            let d = self.cells.derivative(now.fields(), self.law);
            let Some(step) = self.step(&now, &d, target, memory, effort) else { break };
            match self.search(&now, &step) {
                Some(next) => now = next,
                None => break,
            }
        }
        Err(now.largest)
    }

    /// A Newton step, `[3k + borders]`.
    fn step(
        &self,
        now: &ConsistentIterate,
        d: &CellDerivative,
        target: f64,
        memory: &mut FactoredJacobian,
        effort: &mut ConsistentEffort,
    ) -> Option<Vec<f64>> {
        let rhs: Vec<f64> = now.map.iter().map(|f| -f).collect();
        let tolerance = (0.1 * target / now.largest).clamp(1e-10, 1e-2);
        for fresh in [false, true] {
            if fresh || memory.factor.as_ref().is_none_or(|f| f.L().nrows() != rhs.len()) {
                effort.factorisations += 1;
                memory.factor = Some(self.jacobian(d).partial_piv_lu());
            }
            let factor = memory.factor.as_ref()?;
            let precondition = |r: &[f64]| {
                let mut r = r.to_vec();
                let n = r.len();
                factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut r, n, 1));
                r
            };
            let solved = gmres(&rhs, tolerance, WORTH, precondition, |v| (self.apply(d, v), Vec::new()));
            effort.products += solved.products;
            if solved.relative <= tolerance && solved.x.iter().all(|v| v.is_finite()) {
                return Some(solved.x);
            }
        }
        None
    }

    /// F′ v, `[3k + borders]`.
    fn apply(&self, d: &CellDerivative, v: &[f64]) -> Vec<f64> {
        let n = 3 * self.cells.len();
        let rho = self.rho();
        let mut z = self.cells.stress(&v[..n]);
        let mut u = product(self.response, &v[..n]);
        for (b, c) in self.borders().enumerate() {
            u[c..].iter_mut().step_by(3).for_each(|u| *u += v[n + b]);
        }
        z.iter_mut().zip(u).enumerate().for_each(|(k, (z, u))| *z -= rho[k % 3] * u);
        let mut out = v.to_vec();
        self.cells.subtract(d, &z, &mut out[..n]);
        for (b, c) in self.borders().enumerate() {
            out[n + b] = v[c..n].iter().step_by(3).sum();
        }
        out
    }

    /// F′, `[3k + borders, 3k + borders]`.
    fn jacobian(&self, d: &CellDerivative) -> Mat<f64> {
        let n = 3 * self.cells.len();
        let rho = self.rho();
        let borders: Vec<usize> = self.borders().collect();
        let mut out = Mat::zeros(n + borders.len(), n + borders.len());
        let mut z = vec![0.0; n];
        for j in 0..n {
            let (b, c) = (j / 3, j % 3);
            let own = |k: usize| if k % 3 == c { self.cells.inverse(k / 3, b) } else { 0.0 };
            z.iter_mut().enumerate().for_each(|(k, z)| *z = own(k) - rho[k % 3] * self.response[(k, j)]);
            let column = &mut out.col_as_slice_mut(j)[..];
            column[j] = 1.0;
            self.cells.subtract(d, &z, &mut column[..n]);
            if let Some(at) = borders.iter().position(|&border| border == c) {
                column[n + at] = 1.0;
            }
        }
        for (at, &c) in borders.iter().enumerate() {
            z.iter_mut().enumerate().for_each(|(k, z)| *z = if k % 3 == c { -rho[c] } else { 0.0 });
            self.cells.subtract(d, &z, &mut out.col_as_slice_mut(n + at)[..n]);
        }
        out
    }

    /// Line search on the norm of the map; the best trial where none is good.
    fn search(&self, now: &ConsistentIterate, step: &[f64]) -> Option<ConsistentIterate> {
        let n = 3 * self.cells.len();
        let moved = product(self.response, &step[..n]);
        let mut best: Option<ConsistentIterate> = None;
        let mut t = 1.0;
        for _ in 0..10 {
            let add = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + t * b).collect::<Vec<f64>>();
            let mut shift = now.shift;
            self.borders().zip(&step[n..]).for_each(|(c, v)| shift[c] += t * v);
            let trial = self.with(add(&now.forces, step), shift, add(&now.response, &moved));
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
