//! Static solves with the stiffness of a body, by the method the job selects.

use super::fe::FeBody;
use super::inertia_relief::InertiaRelief;
use crate::fem::dofs::FIXED;
use crate::petsc::ksp::{rigid_body_motions, Iterative, IterativeOptions};
use crate::petsc::mumps::{Factor, FactorOptions, Symmetry};
use crate::petsc::session::Petsc;
use crate::{Error, Result};
use faer::Mat;
use std::rc::Rc;

/// Relative residual of an iterative solve: an order below the steady analysis' default tolerance.
const TOLERANCE: f64 = 1e-10;
/// Iterations after which an iterative solve gives up; multigrid takes some tens.
const MAX_ITERATIONS: usize = 1000;

/// Solver of K u = f for one body.
pub enum Statics<'p> {
    /// Factorisation of K.
    Direct(Factor<'p>),
    /// Inertia relief, of a body with free rigid motions.
    InertiaRelief(Box<InertiaRelief<'p>>),
    /// Conjugate gradients with algebraic multigrid.
    Iterative(Iterative<'p>),
}

impl<'p> Statics<'p> {
    /// Collective: factorises K, or what takes its place where rigid motions are free.
    pub fn direct(petsc: &'p Petsc<'p>, body: &FeBody) -> Result<Self> {
        let world = petsc.world();
        let k = &body.operators.stiffness;
        let name = format!("stiffness of body {}", body.name);
        if !body.rigid.is_empty() {
            return Ok(Statics::InertiaRelief(Box::new(InertiaRelief::new(world, k, &body.rigid, &name)?)));
        }
        Ok(Statics::Direct(Factor::new(world, k, FactorOptions::new(Symmetry::Positive), &name)?))
    }

    /// Collective: sets up multigrid on K with the rigid-body motions as near-null space.
    pub fn iterative(petsc: &'p Petsc<'p>, body: &FeBody) -> Result<Self> {
        if !body.rigid.is_empty() {
            return Err(Error::Job(format!(
                "solver.linear: found \"gamg\", but the supports of body \"{}\" leave {} rigid motions free; \
                 hold the body, or take \"mumps\"",
                body.name,
                body.rigid.len()
            )));
        }
        let free = |&n: &usize| body.dofs.local[n] != FIXED;
        let at: Vec<[f64; 3]> = (0..body.part.owned).filter(free).map(|n| body.part.coords[n]).collect();
        let prefix = format!("{}_", body.name);
        let options = IterativeOptions { tolerance: TOLERANCE, max_iterations: MAX_ITERATIONS, prefix };
        let name = format!("stiffness of body {}", body.name);
        let near_null = rigid_body_motions(&at);
        Ok(Statics::Iterative(Iterative::new(
            petsc,
            Rc::clone(&body.operators.stiffness),
            3,
            &near_null,
            options,
            &name,
        )?))
    }

    /// Collective: solves for `count` loads in place; `f` holds this rank's degrees of freedom, `[owned, count]`
    /// column by column, N in, m out.
    pub fn solve(&mut self, f: &mut [f64], count: usize) -> Result<()> {
        match self {
            Statics::Direct(factor) => factor.solve(f, count),
            Statics::InertiaRelief(balanced) => balanced.solve(f, count),
            Statics::Iterative(solver) => solver.solve(f, count),
        }
    }

    /// Collective: improves the approximate solutions `u` (m) of `count` loads (N) until |f − K u| ≤ `tolerance`·|f|
    /// for each; this rank's degrees of freedom, `[owned, count]` column by column. A factorisation needs no start
    /// and keeps to no tolerance.
    pub fn improve(&mut self, u: &mut [f64], loads: &[f64], count: usize, tolerance: f64) -> Result<()> {
        match self {
            Statics::Direct(_) | Statics::InertiaRelief(_) => {
                u.copy_from_slice(loads);
                self.solve(u, count)
            }
            Statics::Iterative(solver) => solver.improve(u, loads, count, tolerance),
        }
    }

    /// Iterations of the iterative solver so far.
    pub fn iterations(&self) -> usize {
        match self {
            Statics::Direct(_) | Statics::InertiaRelief(_) => 0,
            Statics::Iterative(solver) => solver.effort().0,
        }
    }

    /// Collective: entries of K⁻¹ at `rows` × `rows` (the same on every rank), m/N, on rank 0. `progress` is told rows
    /// done and rows in all where they are made one after the other.
    pub fn inverse_block(&mut self, rows: &[u64], progress: &mut dyn FnMut(usize, usize)) -> Result<Mat<f64>> {
        match self {
            Statics::Direct(factor) => factor.inverse_block(rows),
            Statics::InertiaRelief(balanced) => balanced.inverse_block(rows),
            Statics::Iterative(solver) => solver.inverse_block(rows, progress),
        }
    }

    /// Describes it for the summary.
    pub fn describe(&self) -> String {
        match self {
            Statics::Direct(factor) => of_factor(factor),
            Statics::InertiaRelief(balanced) => {
                format!("{}; {} rigid motions are free", of_factor(balanced.factor()), balanced.rigid().len())
            }
            Statics::Iterative(_) => "conjugate gradients with multigrid".into(),
        }
    }
}

fn of_factor(factor: &Factor) -> String {
    let s = factor.statistics();
    let (entries, memory) = (s.factor_entries as f64 / 1e6, s.memory_sum_mb as f64 / 1e3);
    format!("factor of {entries:.1} M entries, {memory:.2} GB on all ranks")
}
