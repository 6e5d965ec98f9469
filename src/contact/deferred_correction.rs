//! Steady rolling with an influence matrix W that is known by its products alone: too large, or too dear, to be made.
//!
//! An approximate matrix W₀ stands in for it, and what it leaves out of the displacement, d = (W − W₀) R, is taken
//! from the reactions of the step before: d is an additional gap and an additional tangential displacement of the
//! problem of W₀ (deferred correction). A uniform d has no part in the reactions at given load, and elsewhere W₀ is
//! good to some per cent, so that the steps contract. Anderson's method makes them faster and lets soft bodies
//! converge too (D. G. Anderson, J. ACM 12 (1965); H. F. Walker and P. Ni, SIAM J. Numer. Anal. 49 (2011)): the next
//! d is the combination of the last ones for which, in a linear problem, the least would be missing. W₀ stays as it
//! is, so each problem solved is as benign as the first.

use super::newton::NewtonEffort;
use super::steady::{SteadyProblem, SteadySolution};
use crate::dense::dot;
use crate::grid::Interface;
use crate::{Error, Result};

/// Steps that Anderson's method looks back.
const DEPTH: usize = 4;
/// Part of a difference between two steps that must be new for it to be used: more than the error of inexact products.
const NEW: f64 = 0.05;

/// A steady problem on the way to its solution.
pub struct DeferredSteady<'a> {
    problem: SteadyProblem<'a>,
    /// The interface with what the matrix leaves out of the displacement.
    interface: Interface,
    /// Assumed difference of the problem solved last, m, `[3n]`.
    assumed: Vec<f64>,
    /// Pairs of d assumed and d found less d assumed, the latest last.
    history: Vec<[Vec<f64>; 2]>,
    /// The solution of the problem solved last.
    proposed: Option<SteadySolution>,
    effort: NewtonEffort,
}

impl<'a> DeferredSteady<'a> {
    /// `problem` with the approximate matrix W₀ as its compliance.
    pub fn new(problem: SteadyProblem<'a>) -> Self {
        let interface = problem.interface.clone();
        let assumed = vec![0.0; 3 * interface.len()];
        Self { problem, interface, assumed, history: Vec::new(), proposed: None, effort: NewtonEffort::default() }
    }

    /// The next reactions to be multiplied by W: N, `[3n]`.
    pub(crate) fn propose(&mut self) -> Result<Vec<f64>> {
        if self.proposed.is_some() {
            self.assume();
        }
        let problem = SteadyProblem {
            interface: &self.interface,
            // What remains of it must not count beside what W₀ leaves out.
            tolerance: 0.2 * self.problem.tolerance,
            ..self.problem.clone()
        };
        // Where the last solution is no good start, as after a large change of d, there is still that from nothing.
        let found = match problem.solve_from(self.proposed.as_ref()) {
            Err(Error::NotConverged(_)) if self.proposed.is_some() => problem.solve()?,
            found => found?,
        };
        self.effort.iterations += found.iterations;
        self.effort.products += found.products;
        let reactions = self.reactions(&found);
        self.proposed = Some(found);
        self.history.push([self.assumed.clone(), Vec::new()]);
        Ok(reactions)
    }

    /// Takes W R of the proposed reactions, m, `[3n]`, and returns what they are as a solution of the problem itself:
    /// the residual is that of the laws with the displacement W R. May be called again with a better product.
    pub fn judge(&mut self, product: Vec<f64>) -> Result<SteadySolution> {
        let s = self.problem.interface;
        let (Some(proposed), Some(step)) = (&self.proposed, self.history.len().checked_sub(1)) else {
            return Err(Error::Defect("steady contact: a product came before its reactions".into()));
        };
        if product.len() != 3 * s.len() || product.iter().any(|v| !v.is_finite()) {
            return Err(Error::NotConverged(format!(
                "steady contact: the displacement of {} contact nodes has {} components, or is not finite",
                s.len(),
                product.len()
            )));
        }
        let (stress, motions) = (proposed.stresses(), proposed.motions.clone());
        let approach = self.problem.approaches(&motions);
        let known = self.problem.compliance.multiply(&self.reactions(proposed));
        self.history[step][1] = (0..3 * s.len()).map(|k| product[k] - known[k] - self.assumed[k]).collect();
        let deformed = |i: usize| s.gap[i] - approach[s.patch_of(i)] + product[3 * i + 2];
        let upstream = s.edge_upstream(self.problem.stencil, &stress, deformed);
        self.problem.evaluate(&stress, motions, upstream, &product, self.effort)
    }

    fn reactions(&self, solution: &SteadySolution) -> Vec<f64> {
        let weight = &self.interface.weight;
        solution.stresses().iter().enumerate().map(|(k, v)| v * weight[k / 3]).collect()
    }

    /// The next d.
    fn assume(&mut self) {
        let excess = self.history.len().saturating_sub(DEPTH + 1);
        self.history.drain(..excess);
        let Some(([assumed, missing], earlier)) = self.history.split_last() else { return };
        // The last d, what was missing of it, and what counts of that.
        let (mut next, mut left) = (assumed.clone(), missing.clone());
        let mut counts = self.counting(&left);
        let mut basis: Vec<[Vec<f64>; 3]> = Vec::new();
        for [a, m] in earlier.iter().rev() {
            let minus = |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| u - v).collect::<Vec<f64>>();
            let (da, dm) = (minus(assumed, a), minus(missing, m));
            let mut column = [self.counting(&dm), da, dm];
            let before = dot(&column[0], &column[0]).sqrt();
            for b in &basis {
                let along = dot(&b[0], &column[0]);
                column.iter_mut().zip(b).for_each(|(v, b)| subtract(v, along, b));
            }
            let norm = dot(&column[0], &column[0]).sqrt();
            if norm > NEW * before {
                column.iter_mut().flatten().for_each(|v| *v /= norm);
                let along = dot(&column[0], &counts);
                let [c, a, m] = &column;
                subtract(&mut counts, along, c);
                subtract(&mut next, along, a);
                subtract(&mut left, along, m);
                basis.push(column);
            }
        }
        next.iter_mut().zip(&left).for_each(|(n, l)| *n += l);
        let s = self.problem.interface;
        for i in 0..s.len() {
            self.interface.gap[i] = s.gap[i] + next[3 * i + 2];
            self.interface.shift[i] = [0, 1].map(|c| s.shift[i][c] + next[3 * i + c]);
        }
        self.assumed = next;
    }

    /// Relevant part of a displacement: that of the closed nodes less its mean along the surface on each patch, and
    /// less what the unknown motions take up along the normal.
    fn counting(&self, d: &[f64]) -> Vec<f64> {
        let s = self.problem.interface;
        let closed: Vec<usize> = match &self.proposed {
            Some(p) => (0..p.pressure.len()).filter(|&i| p.pressure[i] > 0.0).collect(),
            None => Vec::new(),
        };
        let mut counts: Vec<f64> = Vec::with_capacity(3 * closed.len());
        for on_patch in closed.chunk_by(|&a, &b| s.patch_of(a) == s.patch_of(b)) {
            let mean = [0, 1].map(|c| on_patch.iter().map(|&i| d[3 * i + c]).sum::<f64>() / on_patch.len() as f64);
            counts.extend(on_patch.iter().flat_map(|&i| [d[3 * i] - mean[0], d[3 * i + 1] - mean[1], d[3 * i + 2]]));
        }
        for j in self.problem.loads.unknown() {
            let factors: Vec<f64> =
                closed.iter().map(|&i| self.problem.loads.motions[j].factors[s.patch_of(i)]).collect();
            let along = counts.iter().skip(2).step_by(3).zip(&factors).map(|(d, n)| d * n).sum::<f64>();
            let part = along / dot(&factors, &factors);
            if part.is_finite() {
                counts.iter_mut().skip(2).step_by(3).zip(&factors).for_each(|(d, n)| *d -= part * n);
            }
        }
        counts
    }
}

fn subtract(v: &mut [f64], factor: f64, u: &[f64]) {
    v.iter_mut().zip(u).for_each(|(v, u)| *v -= factor * u);
}

#[cfg(test)]
mod tests {
    use super::super::interface::{ContactCreepage, PatchKinematics, Stencil};
    use super::super::{Influence, NormalLoad};
    use super::*;
    use crate::body::half_space::HalfSpace;
    use crate::friction::FrictionLaw;
    use crate::model::combined_compliance;
    use faer::Mat;

    fn half_spaces(s: &Interface, stiffer: f64) -> Mat<f64> {
        let of = |young: f64, poisson| {
            HalfSpace { young: stiffer * young, poisson }.compliance(&s.patches[0].x, &s.patches[0].y).unwrap()
        };
        combined_compliance(of(205e9, 0.3).as_ref(), of(60e9, 0.1).as_ref()).unwrap()
    }

    /// Steps to the solution, which is that of the matrix itself.
    fn steps(true_w: &Mat<f64>, w0: &Mat<f64>, s: &Interface, load: NormalLoad) -> usize {
        let problem = |w| SteadyProblem {
            interface: s,
            compliance: Influence::Dense(w),
            friction: FrictionLaw::Constant(0.3).into(),
            kinematics: PatchKinematics::one(10.0, ContactCreepage { longitudinal: 0.001, lateral: 0.002, spin: 0.2 }),
            loads: load.into(),
            stencil: Stencil::default(),
            tolerance: 1e-8,
            max_iterations: 200,
        };
        let direct = problem(true_w.as_ref()).solve().unwrap();
        let mut deferred = DeferredSteady::new(problem(w0.as_ref()));
        for step in 1..40 {
            let reactions = deferred.propose().unwrap();
            let found = deferred.judge(Influence::from(true_w.as_ref()).multiply(&reactions)).unwrap();
            if found.residual > 1e-8 {
                continue;
            }
            let peak = direct.pressure.iter().copied().fold(0.0, f64::max);
            for (a, b) in found.stresses().iter().zip(direct.stresses()) {
                assert!((a - b).abs() < 1e-6 * peak, "{a} and {b} of {peak}");
            }
            for (a, b) in found.force.iter().zip(direct.force) {
                assert!((a - b).abs() < 1e-7 * direct.force[2].abs(), "{:?} and {:?}", found.force, direct.force);
            }
            assert!((found.motions[0] - direct.motions[0]).abs() < 1e-7 * direct.motions[0]);
            return step;
        }
        panic!("no solution in 40 steps");
    }

    /// `w` with what a body adds whose contact moves as a whole: a displacement in each direction (m/N), a turn about
    /// the normal (1/(N m)).
    fn soft(w: &Mat<f64>, s: &Interface, along: f64, turn: f64) -> Mat<f64> {
        let motion = |k: usize| {
            let [x, y] = s.point(k / 3);
            [-y, x, 0.0][k % 3]
        };
        Mat::from_fn(w.nrows(), w.ncols(), |i, j| {
            w[(i, j)] + if i % 3 == j % 3 { along } else { 0.0 } + turn * motion(i) * motion(j)
        })
    }

    #[test]
    fn reaches_the_solution_of_the_matrix_it_never_sees() {
        let s = Interface::paraboloid(15, 13, [7e-3, 7e-3], [4.0, 4.0]).unwrap();
        let w0 = half_spaces(&s, 1.0);
        let near = half_spaces(&s, 1.02);
        let force = NormalLoad::Force(40e3);
        let few = steps(&soft(&near, &s, 3e-9, 0.0), &w0, &s, force);
        assert!(few <= 7, "{few} steps for a matrix 2 % off and a uniform displacement");
        // At given approach the uniform displacement counts, here an eighth of it; and a body that turns feeds back
        // its creepage, here several parts in ten of it.
        steps(&soft(&near, &s, 3e-10, 0.0), &w0, &s, NormalLoad::Approach(1e-4));
        steps(&soft(&near, &s, 0.0, 1e-4), &w0, &s, force);
    }

    #[test]
    fn a_product_out_of_turn_or_not_finite_is_an_error() {
        let s = Interface::paraboloid(9, 9, [7e-3, 7e-3], [4.0, 4.0]).unwrap();
        let w0 = half_spaces(&s, 1.0);
        let problem = SteadyProblem {
            interface: &s,
            compliance: w0.as_ref().into(),
            friction: FrictionLaw::Constant(0.3).into(),
            kinematics: PatchKinematics::one(10.0, ContactCreepage::default()),
            loads: NormalLoad::Force(10e3).into(),
            stencil: Stencil::default(),
            tolerance: 1e-8,
            max_iterations: 200,
        };
        let mut deferred = DeferredSteady::new(problem);
        assert!(matches!(deferred.judge(vec![0.0; 243]), Err(Error::Defect(_))));
        deferred.propose().unwrap();
        assert!(matches!(deferred.judge(vec![f64::NAN; 243]), Err(Error::NotConverged(_))));
        assert!(matches!(deferred.judge(vec![0.0; 3]), Err(Error::NotConverged(_))));
    }
}
