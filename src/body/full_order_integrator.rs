//! A body in time on all its degrees of freedom: the θ-method of M. Jean (Comput. Methods Appl. Mech. Engrg. 177,
//! 1999) with one factorisation.
//!
//! Over a step h the velocities change by Δ, u⁺ = u + h (v + θΔ), and
//!
//! A Δ = h (Pᵀ R − C v − K (u + θh v)),   A = M + hθC + h²θ²K,   C = αM + βK + the matrix of its supports,
//!
//! with the mean contact forces R of the step. It is the scheme of the modes (`transient::scheme`) before any of them
//! is left out.

use super::trace::Trace;
use super::FullSystem;
use crate::parallel::World;
use crate::petsc::mumps::{Factor, FactorOptions, FactorStatistics, Symmetry};
use crate::petsc::operator::Operator;
use crate::Result;
use faer::{Mat, Scale};
use std::cell::RefCell;
use std::rc::Rc;

/// Matrices that are constant in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepMatrices {
    /// h, s.
    pub step: f64,
    /// θ.
    pub theta: f64,
    /// α, 1/s.
    pub alpha: f64,
    /// β, s.
    pub beta: f64,
}

/// Energies of a body, J: those it has, and what damping took of it in the step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// ½ vᵀMv.
    pub kinetic: f64,
    /// ½ uᵀKu.
    pub elastic: f64,
    /// Taken by damping.
    pub damped: f64,
}

/// A vector and its products that the equation of motion takes.
#[derive(Debug, Clone, Default)]
struct State {
    u: Vec<f64>,
    v: Vec<f64>,
    /// M v, K u and C v.
    mv: Vec<f64>,
    ku: Vec<f64>,
    cv: Vec<f64>,
    /// K v.
    kv: Vec<f64>,
}

/// A body that moves.
pub struct FullOrderIntegrator<'a> {
    world: &'a World,
    march: StepMatrices,
    stiffness: Operator<'a>,
    mass: Operator<'a>,
    /// The damping matrix of its supports.
    own: Option<Operator<'a>>,
    trace: &'a Trace,
    factor: Rc<RefCell<Factor<'a>>>,
    now: State,
    /// Δ without contact forces, of the step that was begun.
    change: Vec<f64>,
}

impl<'a> FullOrderIntegrator<'a> {
    /// Collective: the body at rest without deformation. The factorisation is that of `twin` where it is given: the
    /// same body, that moves by itself elsewhere.
    pub fn new(world: &'a World, body: &'a dyn FullSystem, march: StepMatrices, twin: Option<&Self>) -> Result<Self> {
        let factor = match twin.filter(|t| t.march == march) {
            Some(twin) => Rc::clone(&twin.factor),
            None => {
                let h = march.step * march.theta;
                // M + hθ(αM + βK + C) + h²θ²K.
                let mass = 1.0 + h * march.alpha;
                let stiff = h * march.beta + h * h;
                let mut a = body.stiffness().clone();
                a.values.iter_mut().for_each(|v| *v *= stiff);
                let mut a = a.minus_scaled(-mass, body.mass());
                if let Some(c) = body.damping() {
                    a = a.minus_scaled(-h, c);
                }
                let name = format!("matrix of the steps of body {}", body.name());
                Rc::new(RefCell::new(Factor::new(world, &a, FactorOptions::new(Symmetry::Positive), &name)?))
            }
        };
        let n = body.stiffness().n_local();
        let zero = || vec![0.0; n];
        Ok(Self {
            world,
            march,
            stiffness: body.stiffness().operator(world),
            mass: body.mass().operator(world),
            own: body.damping().map(|c| c.operator(world)),
            trace: body.trace(),
            factor,
            now: State { u: zero(), v: zero(), mv: zero(), ku: zero(), cv: zero(), kv: zero() },
            change: zero(),
        })
    }

    /// Statistics of the factorisation.
    pub fn statistics(&self) -> FactorStatistics {
        self.factor.borrow().statistics()
    }

    /// This rank's displacements, m, and velocities, m/s, in lower form.
    pub fn state(&self) -> (&[f64], &[f64]) {
        (&self.now.u, &self.now.v)
    }

    /// Collective: goes to the displacements `u` and velocities `v`; returns the energies there.
    pub fn place(&mut self, u: Vec<f64>, v: Vec<f64>) -> Energies {
        let now = self.products(u, v);
        self.now = now;
        self.energies(0.0)
    }

    fn products(&self, u: Vec<f64>, v: Vec<f64>) -> State {
        let (world, n) = (self.world, u.len());
        let mut mv = vec![0.0; n];
        self.mass.apply(world, &v, &mut mv);
        let mut both = vec![0.0; 2 * n];
        self.stiffness.apply_block(world, &[&u[..], &v[..]].concat(), &mut both, 2);
        let kv = both.split_off(n);
        let StepMatrices { alpha, beta, .. } = self.march;
        let mut cv: Vec<f64> = mv.iter().zip(&kv).map(|(m, k)| alpha * m + beta * k).collect();
        if let Some(own) = &self.own {
            let mut more = vec![0.0; n];
            own.apply(world, &v, &mut more);
            cv.iter_mut().zip(more).for_each(|(c, m)| *c += m);
        }
        State { u, v, mv, ku: both, cv, kv }
    }

    /// Collective.
    fn energies(&self, damped: f64) -> Energies {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let now = &self.now;
        let all = self.world.sum_all(&[0.5 * dot(&now.v, &now.mv), 0.5 * dot(&now.u, &now.ku), damped]);
        Energies { kinetic: all[0], elastic: all[1], damped: all[2] }
    }

    /// Collective: θh² P A⁻¹ Pᵀ, displacements of the contact rows at the end of a step by forces on them, m/N, `[3n,
    /// 3n]` on rank 0, `None` elsewhere.
    pub fn influence(&self) -> Result<Option<Mat<f64>>> {
        let block = self.factor.borrow_mut().inverse_block(&self.trace.dofs())?;
        let StepMatrices { step, theta, .. } = self.march;
        Ok(self.world.is_root().then(|| Scale(theta * step * step) * self.trace.enclose(block.as_ref())))
    }

    /// Collective: begins a step; returns displacements and velocities of the contact rows at its end without forces
    /// on them, m and m/s, `[3n]` on rank 0.
    pub fn free(&mut self) -> Result<[Vec<f64>; 2]> {
        let (h, now) = (self.march.step, &self.now);
        let lead = self.march.theta * h;
        let force = |((c, k), m): ((&f64, &f64), &f64)| -h * (c + k + lead * m);
        self.change = now.cv.iter().zip(&now.ku).zip(&now.kv).map(force).collect();
        self.factor.borrow_mut().solve(&mut self.change, 1)?;
        let (u, v) = self.end(&self.change);
        Ok([self.trace.project(self.world, &u), self.trace.project(self.world, &v)])
    }

    /// u⁺ and v⁺ of a change of the velocities.
    fn end(&self, change: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let StepMatrices { step: h, theta, .. } = self.march;
        let (u, v) = (&self.now.u, &self.now.v);
        let moved = u.iter().zip(v).zip(change).map(|((u, v), d)| u + h * (v + theta * d)).collect();
        (moved, v.iter().zip(change).map(|(v, d)| v + d).collect())
    }

    /// Collective: ends the step that was begun, under the mean `forces` on the contact rows, N, `[3n]` on rank 0;
    /// returns the energies after it.
    pub fn push(&mut self, forces: &[f64]) -> Result<Energies> {
        let StepMatrices { step: h, theta, .. } = self.march;
        let mut change = vec![0.0; self.change.len()];
        self.trace.spread(self.world, forces, &mut change);
        self.factor.borrow_mut().solve(&mut change, 1)?;
        change.iter_mut().zip(&self.change).for_each(|(c, free)| *c = free + h * *c);
        let (u, v) = self.end(&change);
        let next = self.products(u, v);
        let before = std::mem::replace(&mut self.now, next);
        let now = &self.now;
        // What the force C v_θ takes over the mean motion.
        let damped = (0..change.len())
            .map(|i| {
                let force = (1.0 - theta) * before.cv[i] + theta * now.cv[i];
                force * (0.5 * h) * (before.v[i] + now.v[i])
            })
            .sum();
        Ok(self.energies(damped))
    }

    /// Collective: the shares ΦᵀMu and ΦᵀMv that the mass-normalised `modes` (this rank's degrees of freedom) have in
    /// displacements and velocities, m √kg and m √kg/s, `[modes]` on every rank.
    pub fn amplitudes(&self, modes: &[Vec<f64>]) -> [Vec<f64>; 2] {
        let mut mu = vec![0.0; self.now.u.len()];
        self.mass.apply(self.world, &self.now.u, &mut mu);
        let shares = |m: &[f64]| -> Vec<f64> {
            let own: Vec<f64> = modes.iter().map(|phi| phi.iter().zip(m).map(|(p, m)| p * m).sum()).collect();
            self.world.sum_all(&own)
        };
        [shares(&mu), shares(&self.now.mv)]
    }

    /// Collective: displacements and velocities of the contact rows, m and m/s, `[3n]` on rank 0.
    pub fn at_contact(&self) -> [Vec<f64>; 2] {
        [&self.now.u, &self.now.v].map(|x| self.trace.project(self.world, x))
    }
}
