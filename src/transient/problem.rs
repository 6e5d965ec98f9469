//! The frictional contact problem of one step.
//!
//! With the reactions R = (tx, ty, p) of k nodes and u = free + W R + shift, where u holds the tangential
//! displacements d of the particle over the step relative to the other body, and the gap g (or θh times its rate): g
//! ≥ 0 ⟂ p ≥ 0, |t| ≤ μp, t = −μ p d/|d| where d ≠ 0. The shift is rigid: the sum of the unknown shifts of the
//! [borders](Border), whose resultants are prescribed.

use super::border::Border;
use super::delassus::DelassusOperator;
use super::newton::NewtonMemory;
use super::{fixed_point, gauss_seidel, newton, split_newton};
use crate::contact::law::{size, Augmentation, Node, Projected, Status};
use crate::friction::{FrictionLaw, PatchFriction, Remembered};
use crate::{Error, Result};

/// How the problem of a step is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ContactSolver {
    /// Semi-smooth Newton method on a factorisation that serves many steps.
    #[default]
    Newton,
    /// The paper's fixed point on the reactions, its equation (3): the reference.
    FixedPoint,
}

/// Counts of a solution.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Iterations.
    pub iterations: usize,
    /// Products with W.
    pub products: usize,
    /// Solutions with the factorisation.
    pub solutions: usize,
    /// Factorisations.
    pub factorisations: usize,
    /// Sweeps of block Gauss–Seidel.
    pub sweeps: usize,
    /// Iterations on the tangential unknowns, each a product with a ninth of W.
    pub inner: usize,
}

impl std::ops::AddAssign for Effort {
    fn add_assign(&mut self, o: Effort) {
        self.iterations += o.iterations;
        self.products += o.products;
        self.solutions += o.solutions;
        self.factorisations += o.factorisations;
        self.sweeps += o.sweeps;
        self.inner += o.inner;
    }
}

/// The problem of one step on k nodes.
#[derive(Debug, Clone, Copy)]
pub struct StepProblem<'a> {
    /// W, m/N, `[3k, 3k]`.
    pub matrix: &'a DelassusOperator,
    /// (dx, dy, g) at R = 0, m, `[3k]`.
    pub free: &'a [f64],
    /// Friction law of each patch, of the velocity |d|/h.
    pub friction: &'a PatchFriction,
    /// Memory of friction of the nodes, `[k]`; empty where the coefficient is that of the law itself.
    pub before: &'a [Remembered],
    /// Step h, s.
    pub step: f64,
    /// Patch of each node, `[k]`; empty where there is one.
    pub patch: &'a [usize],
    /// Rigid shifts with their prescribed resultants.
    pub borders: &'a [Border],
    /// Residual of a solution (largest component of the natural map, R − Proj(R − ρ u)) relative to the normal force.
    pub tolerance: f64,
}

/// Reactions that satisfy the laws.
#[derive(Debug, Clone, PartialEq)]
pub struct StepSolution {
    /// Reactions (tx, ty, p), N, `[3k]`.
    pub reaction: Vec<f64>,
    /// Shift of each border, m.
    pub shift: Vec<f64>,
    /// W R, m, `[3k]`.
    pub response: Vec<f64>,
    /// Status of the nodes, `[k]`.
    pub status: Vec<Status>,
    /// Coefficients of friction at the end of the step, `[k]`; empty where the method has not kept them.
    pub friction: Vec<f64>,
    /// Largest component of the map, N.
    pub residual: f64,
}

impl StepProblem<'_> {
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.matrix.size() / 3
    }

    /// Patch of node `i`.
    #[inline(always)]
    pub(super) fn patch_of(&self, i: usize) -> usize {
        self.patch.get(i).copied().unwrap_or(0)
    }

    /// Friction law of node `i`.
    #[inline(always)]
    fn law(&self, i: usize) -> &FrictionLaw {
        self.friction.law(self.patch_of(i))
    }

    /// Solves the problem from the reactions `guess` (N, `[3k]`) and the shifts that go with it; `response` is W
    /// times the guess, where that is known. `memory` keeps what serves the next step too.
    pub fn solve(
        &self,
        solver: ContactSolver,
        guess: &[f64],
        response: Option<&[f64]>,
        shift: &[f64],
        memory: &mut NewtonMemory,
        effort: &mut Effort,
    ) -> Result<StepSolution> {
        let pressing = |b: &&Border| b.is_normal() && !b.has_traction() && b.row.iter().all(|r| r[2] >= 0.0);
        if let Some(pulled) = self.borders.iter().filter(pressing).find(|b| b.total < 0.0) {
            return Err(Error::Job(format!("the normal load is {:.4e} N; a contact can only press", pulled.total)));
        }
        if shift.len() != self.borders.len() {
            return Err(Error::Defect(format!("{} shifts of {} resultants", shift.len(), self.borders.len())));
        }
        // What picks the largest of several numbers passes over one that is none.
        if self.free.iter().chain(guess).any(|v| v.is_nan()) {
            return Err(Error::NotConverged(
                "displacements or reactions of the contact are no numbers before the step; a smaller \
                 analyses.transient.step may help"
                    .into(),
            ));
        }
        let (scale, k) = (self.scale(guess), self.nodes());
        if k == 0 && scale > 0.0 {
            return Err(Error::Defect(format!("the contact of a step has a load of {scale:.4e} N and no nodes")));
        }
        if scale == 0.0 {
            return Ok(StepSolution {
                reaction: vec![0.0; 3 * k],
                shift: shift.to_vec(),
                response: vec![0.0; 3 * k],
                status: vec![Status::Open; k],
                friction: Vec::new(),
                residual: 0.0,
            });
        }
        let target = self.tolerance * scale;
        let mut begun = None;
        let mut shift = shift.to_vec();
        let simple = self.borders.iter().all(Border::is_normal);
        if solver == ContactSolver::Newton && simple && memory.by_parts() {
            match split_newton::solve(self, target, (guess, response), &shift, &mut memory.parts, effort) {
                Ok(solution) => return Ok(solution),
                Err((best, nearer)) => {
                    memory.refused();
                    if best.iter().chain(&nearer).all(|v| v.is_finite()) {
                        (begun, shift) = (Some(best), nearer);
                    }
                }
            }
        }
        let guess = begun.as_deref().unwrap_or(guess);
        let solved = match solver {
            ContactSolver::FixedPoint => fixed_point::solve(self, target, guess, shift, 200_000, effort)?,
            ContactSolver::Newton => match self.direct(target, guess, shift.clone(), memory, effort)? {
                Ok(solution) => solution,
                Err(best) => match self.borders.iter().position(|b| b.tangential().is_some()) {
                    Some(b) => self.bracketed(b, target, guess.to_vec(), shift, memory, effort)?,
                    None => fixed_point::solve(self, target, &best.0, best.1, 5_000, effort)?,
                },
            },
        };
        Ok(solved)
    }

    /// Newton's method, with sweeps of Gauss–Seidel where it stalls; the best reactions where that does not help
    /// either.
    #[allow(clippy::type_complexity)]
    fn direct(
        &self,
        target: f64,
        guess: &[f64],
        shift: Vec<f64>,
        memory: &mut NewtonMemory,
        effort: &mut Effort,
    ) -> Result<std::result::Result<StepSolution, (Vec<f64>, Vec<f64>)>> {
        let mut start = (guess.to_vec(), shift);
        for round in 0..4 {
            match newton::solve(self, target, &start.0, &start.1, memory, effort)? {
                Ok(solution) => return Ok(Ok(solution)),
                // Newton's method cycles where several nodes are about to change; sweeps do not.
                Err(best) if round < 3 => start = gauss_seidel::sweep(self, target, best.0, best.1, 30, effort),
                Err(best) => start = best,
            }
        }
        Ok(Err(start))
    }

    /// The shift of border `number` by bracketing: the force falls with the shift, and at a given shift the problem is
    /// a good-natured one. A prescribed force near the limit of friction needs this: where all nodes slide it says
    /// nothing of the shift.
    fn bracketed(
        &self,
        number: usize,
        target: f64,
        mut reaction: Vec<f64>,
        start: Vec<f64>,
        memory: &mut NewtonMemory,
        effort: &mut Effort,
    ) -> Result<StepSolution> {
        let border = &self.borders[number];
        let (total, c) = (border.total, border.tangential().unwrap_or(0));
        let mut given = self.borders.to_vec();
        given.remove(number);
        let mut others = start.clone();
        others.remove(number);
        let mut at = |s: f64, effort: &mut Effort| -> Result<(StepSolution, f64)> {
            let moved = |(k, f): (usize, &f64)| f + border.column[self.patch_of(k / 3)][k % 3] * s;
            let free: Vec<f64> = self.free.iter().enumerate().map(moved).collect();
            let inner = StepProblem { free: &free, borders: &given, tolerance: 0.1 * self.tolerance, ..*self };
            let mut found = inner.solve(ContactSolver::Newton, &reaction, None, &others, memory, effort)?;
            reaction.clone_from(&found.reaction);
            others.clone_from(&found.shift);
            found.shift.insert(number, s);
            let error = self.resultant(border, &found.reaction) - total;
            Ok((found, error))
        };
        let (found, error) = at(start[number], effort)?;
        if error.abs() <= target {
            return Ok(found);
        }
        let stiffness = (0..self.nodes()).map(|i| self.rho(i).tangential).sum::<f64>() / self.nodes().max(1) as f64;
        let mut near = (start[number], error);
        let mut step = error / stiffness;
        let mut far = None;
        for _ in 0..60 {
            let s = near.0 + step;
            let (found, e) = at(s, effort)?;
            if e.abs() <= target {
                return Ok(found);
            }
            if e * error < 0.0 {
                far = Some((s, e));
                break;
            }
            near = (s, e);
            step *= 2.0;
        }
        let Some(mut far) = far else {
            return Err(Error::NotConverged(format!(
                "contact of a time step: friction cannot carry the tangential force of {total:.4e} N along {}",
                ["x", "y"][c]
            )));
        };
        // Regula falsi of the Illinois kind: the end that stays is halved.
        for _ in 0..100 {
            let s = (near.0 * far.1 - far.0 * near.1) / (far.1 - near.1);
            let (found, e) = at(s, effort)?;
            if e.abs() <= target {
                return Ok(found);
            }
            if e * far.1 < 0.0 {
                near = far;
            } else {
                near.1 *= 0.5;
            }
            far = (s, e);
        }
        Err(Error::NotConverged(format!(
            "contact of a time step: the creep for the tangential force of {total:.4e} N was not found; last \
             error {:.2e} N",
            far.1
        )))
    }

    /// Measure of the forces in this problem, N: the load where it is given, else what the guess and the penetrations
    /// say; 0 where nothing touches.
    pub(super) fn scale(&self, guess: &[f64]) -> f64 {
        let normal = || self.borders.iter().filter(|b| b.is_normal());
        let load: f64 = normal().map(|b| b.total.abs()).sum();
        let patches = self.borders.first().map_or(1, |b| b.column.len());
        if (0..patches).all(|c| normal().any(|b| b.loads[c])) {
            return load;
        }
        let held = |i: usize| !normal().any(|b| b.loads[self.patch_of(i)]);
        let pressed: f64 = (0..self.nodes()).filter(|&i| held(i)).map(|i| guess[3 * i + 2].max(0.0)).sum();
        let normal = self.free.chunks_exact(3).zip(self.matrix.diagonal().chunks_exact(3)).enumerate();
        let normal = normal.filter(|(i, _)| held(*i)).map(|(_, (free, compliance))| -free[2] / compliance[2]);
        load + normal.fold(pressed, f64::max).max(0.0)
    }

    /// Augmentation parameters of node `i`, N/m: the inverse of its own compliance.
    pub(super) fn rho(&self, i: usize) -> Augmentation {
        let d = &self.matrix.diagonal()[3 * i..3 * i + 3];
        // A node that cannot move along the surface has no slip either, whatever the traction.
        let tangential = d[0].max(d[1]);
        Augmentation { normal: 1.0 / d[2], tangential: if tangential > 0.0 { 1.0 / tangential } else { 0.0 } }
    }

    /// Coefficient of friction of node `i` at the end of the step, for its displacement `d` over the step, m.
    #[inline(always)]
    pub fn coefficient(&self, i: usize, d: [f64; 2]) -> f64 {
        let law = self.law(i);
        if let FrictionLaw::Constant(mu) = law {
            return *mu;
        }
        let v = size(d) / self.step;
        match self.before.get(i) {
            Some(before) => law.renewed(before, v),
            None => law.coefficient(v),
        }
    }

    /// Coefficients of friction of all nodes as [`StepProblem::coefficient`] has them, at their velocities `v`, and
    /// the slopes by the displacement over the step, 1/m.
    pub(super) fn coefficients_with_slopes(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mu, mut slope) = self.friction.renewed_with_slopes(self.patch, self.before, v);
        slope.iter_mut().for_each(|s| *s /= self.step);
        (mu, slope)
    }

    /// The projections of node `i` with the parameters `rho`, N, m.
    #[inline(always)]
    pub(super) fn project(&self, i: usize, rho: Augmentation, node: &Node) -> Projected {
        node.project(rho, self.coefficient(i, node.creep))
    }

    /// Slope of the friction of node `i` by its displacement over the step, 1/m.
    pub(super) fn slope(&self, i: usize, node: &Node) -> f64 {
        let v = size(node.creep) / self.step;
        let slope = match self.before.get(i) {
            Some(before) => self.law(i).renewed_slope(before, v),
            None => self.law(i).slope(v),
        };
        slope / self.step
    }

    /// Largest component of the map over all nodes and of the errors in the totals, N; and the status of the nodes.
    pub fn residual(&self, reaction: &[f64], u: &[f64]) -> (f64, Vec<Status>) {
        let mut largest = self.total_errors(reaction).into_iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        let mut states = Vec::with_capacity(self.nodes());
        for i in 0..self.nodes() {
            let node = node(&reaction[3 * i..3 * i + 3], &u[3 * i..3 * i + 3]);
            let found = self.project(i, self.rho(i), &node);
            let f = found.map(&node);
            let most = size([f[0], f[1]]).max(f[2].abs());
            if !(most <= largest) {
                largest = most;
            }
            states.push(found.status);
        }
        (largest, states)
    }

    /// Resultant of the reactions in a border, N.
    pub(super) fn resultant(&self, border: &Border, reaction: &[f64]) -> f64 {
        reaction.chunks_exact(3).enumerate().map(|(i, r)| border.contribution(self.patch_of(i), r)).sum()
    }

    /// Resultants of the reactions minus the prescribed ones, N, `[borders]`.
    pub(super) fn total_errors(&self, reaction: &[f64]) -> Vec<f64> {
        self.borders.iter().map(|b| self.resultant(b, reaction) - b.total).collect()
    }

    /// Displacement (d_x, d_y, g) of node `i` by the shifts of the borders, m.
    #[inline(always)]
    pub(super) fn shifted(&self, i: usize, shift: &[f64]) -> [f64; 3] {
        let mut moved = [0.0; 3];
        for (border, s) in self.borders.iter().zip(shift) {
            let column = &border.column[self.patch_of(i)];
            (0..3).for_each(|c| moved[c] += column[c] * s);
        }
        moved
    }

    /// u = free + y + shift, `[3k]`.
    pub(super) fn displacement(&self, y: &[f64], shift: &[f64]) -> Vec<f64> {
        let at = |i: usize| {
            let moved = self.shifted(i, shift);
            [0, 1, 2].map(|c| self.free[3 * i + c] + y[3 * i + c] + moved[c])
        };
        (0..self.nodes()).flat_map(at).collect()
    }
}

/// A node with the reaction `r`, N, and the displacement `u`, m.
#[inline(always)]
pub(super) fn node(r: &[f64], u: &[f64]) -> Node {
    Node { pressure: r[2], traction: [r[0], r[1]], gap: u[2], creep: [u[0], u[1]] }
}
