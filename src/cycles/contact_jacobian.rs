//! The Jacobian of the equations of a cycle, from that of the contact forces.
//!
//! With the harmonics f of the contact forces under the motion z, as coefficients like those of the motion, and the
//! receptance R(s) of the modes at the contact the equations are
//!
//! F = R f/unit + load − z,   ∂F/∂z = R ∂f/∂z/unit − 1
//!
//! ∂F/∂ω = (R ∂f/∂ω + ds/dω ∂R/∂s f)/unit,   ∂F/∂λ = (R ∂f/∂λ + ∂R/∂λ f)/unit
//!
//! A key λ that changes the modes (damping) has ∂R/∂λ, by differences; others have none. Near a resonance R changes
//! within a thousandth of the frequency, whereas the contact has no resonance: ∂f hardly changes from one cycle to the
//! next. Therefore ∂f is what is kept and updated, and R is evaluated anew.

use super::corrector::{norm, Equations};
use super::free::FreeMotion;
use super::structure::Structure;
use crate::Result;
use faer::Mat;
use std::f64::consts::PI;

type C = num_complex::Complex<f64>;

/// Contact forces near a cycle to the first order.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactJacobian {
    /// Unknowns at which the forces were computed, `[size + 2]`.
    pub(super) u: Vec<f64>,
    /// Forces there: the mean, then the cosine and the sine of each harmonic, `[size]`.
    pub(super) force: Vec<f64>,
    /// Derivatives of the forces with respect to the unknowns, `[size, size + 2]`.
    pub(super) derivative: Mat<f64>,
}

impl ContactJacobian {
    /// Takes the forces `force` at `u` as those that derivatives count from.
    pub(super) fn move_to(&mut self, u: &[f64], force: &[f64]) {
        self.u.clone_from_slice(u);
        self.force.clone_from_slice(force);
    }

    /// Forces at `u` to the first order.
    fn force_at(&self, u: &[f64]) -> Vec<f64> {
        let by: Vec<f64> = u.iter().zip(&self.u).map(|(a, b)| a - b).collect();
        let change = |i: usize| by.iter().enumerate().map(|(k, b)| self.derivative[(i, k)] * b).sum::<f64>();
        self.force.iter().enumerate().map(|(i, f)| f + change(i)).collect()
    }

    /// Broyden's update after a step `moved`, in which the forces went from `before` to `after`.
    pub(super) fn update(&mut self, moved: &[f64], before: &[f64], after: &[f64]) {
        let square = norm(moved).powi(2);
        if !(square > 0.0) {
            return;
        }
        for i in 0..before.len() {
            let foreseen: f64 = moved.iter().enumerate().map(|(k, m)| self.derivative[(i, k)] * m).sum();
            let gap = (after[i] - before[i] - foreseen) / square;
            moved.iter().enumerate().for_each(|(k, m)| self.derivative[(i, k)] += gap * m);
        }
    }

    /// The same where the unit of the motion is `size` times as large and that of the angular frequency `period` times,
    /// and the key is `key` in the units of another one on which the forces do not depend so far.
    pub fn in_units(mut self, size: f64, period: f64, key: f64) -> Self {
        let n = self.force.len();
        let factor = |k: usize| if k < n { size } else { period };
        for k in 0..=n {
            self.u[k] /= factor(k);
            (0..n).for_each(|i| self.derivative[(i, k)] *= factor(k));
        }
        self.u[n + 1] = key;
        (0..n).for_each(|i| self.derivative[(i, n + 1)] = 0.0);
        self
    }
}

impl Equations<'_, '_> {
    /// The Jacobian of the equations at `u`, `[size, size + 2]`, with the forces to the first order.
    pub(super) fn assemble(&self, contact: &ContactJacobian, u: &[f64]) -> Result<Mat<f64>> {
        let (n, r) = (self.size(), self.structure.rank());
        let omega = self.omega_of(u);
        let grows = self.family.is_growth();
        let growth = if grows { self.key_of(u) } else { 0.0 };
        let force = contact.force_at(u);
        let structure = self.structure_at(self.key_of(u))?;
        let beside = self.structure_beside(self.key_of(u))?;
        let mut j = Mat::zeros(n, n + 2);
        for k in 0..=self.resolution.harmonics {
            // s = d + iω (N/π) tan(kπ/N) for k > 0.
            let samples = self.resolution.samples as f64;
            let turn = C::new(0.0, samples / PI * (PI * k as f64 / samples).tan());
            let s = turn * omega + if k == 0 { 0.0 } else { growth };
            let [mut response, slope] = structure.receptance(s);
            let slot = r.saturating_sub(1);
            let free = structure.free.as_ref().filter(|_| k == 0);
            if let Some(free) = free {
                (0..r).for_each(|i| (response[(i, slot)], response[(slot, i)]) = (C::default(), C::default()));
                response[(slot, slot)] = C::new(free.receptance(omega), 0.0);
            }
            // The complex amplitude of a cos + b sin is a − ib.
            let first = r * (2 * k).saturating_sub(1);
            let rows = if k == 0 { r } else { 2 * r };
            let real = |of: &Mat<C>, i: usize, m: usize| match (i < r, m < r) {
                (true, true) | (false, false) => of[(i % r, m % r)].re,
                (true, false) => of[(i, m - r)].im,
                (false, true) => -of[(i - r, m)].im,
            };
            let block = Mat::from_fn(rows, rows, |i, m| real(&response, i, m) / self.unit);
            let product = &block * contact.derivative.as_ref().subrows(first, rows);
            j.as_mut().subrows_mut(first, rows).copy_from(&product);
            if let Some(free) = free {
                // The mean velocity u ω/|ψ| of what nothing holds, of which u is a coefficient and no displacement:
                // what a velocity of 1 makes of each equation.
                let by_velocity = |of: &FreeMotion, i: usize| match i == slot {
                    true => -free.receptance(omega) * of.damping / of.size,
                    false => of.gyroscopic[i],
                };
                for i in 0..r {
                    let by = by_velocity(free, i) / free.size;
                    j[(i, slot)] += by * omega + if i == slot { 1.0 } else { 0.0 };
                    j[(i, n)] += by * u[slot] * self.omega;
                    if let Some((Some(there), step)) = beside.as_ref().map(|(there, step)| (&there.free, step)) {
                        j[(i, n + 1)] += (by_velocity(there, i) / free.size - by) * u[slot] * omega / step;
                    }
                }
            }
            // Change of the motion with an unknown that changes R by `change`.
            let mut add = |column: usize, change: Mat<C>| {
                for i in 0..rows {
                    let change = (0..rows).map(|m| real(&change, i, m) * force[first + m]).sum::<f64>();
                    j[(first + i, column)] += change / self.unit;
                }
            };
            if let Some((beside, by)) = &beside {
                let [there, _] = beside.receptance(s);
                let changes = |a: usize, b: usize| free.is_none() || (a != slot && b != slot);
                add(
                    n + 1,
                    Mat::from_fn(r, r, |a, b| match changes(a, b) {
                        true => (there[(a, b)] - response[(a, b)]) / *by,
                        false => C::default(),
                    }),
                );
            }
            if k > 0 {
                let by = |change: C| Mat::from_fn(r, r, |a, b| slope[(a, b)] * change);
                add(n, by(turn * self.omega));
                if grows {
                    add(n + 1, by(C::new(self.key[1], 0.0)));
                }
            }
        }
        (0..n).for_each(|i| j[(i, i)] -= 1.0);
        Ok(j)
    }
}

impl Structure<'_> {
    /// Receptance at the contact R(s) = Cᵀ (s² + s C_m + K_m)⁻¹ C and ∂R/∂s, `[r, r]`, s in 1/s.
    fn receptance(&self, s: C) -> [Mat<C>; 2] {
        let r = self.rank();
        let mut out = [Mat::<C>::zeros(r, r), Mat::zeros(r, r)];
        let mut add = |motion: &dyn Fn(usize) -> C, load: &dyn Fn(usize) -> C, value: C, slope: C| {
            for i in 0..r {
                for k in 0..r {
                    let shape = motion(i) * load(k);
                    out[0][(i, k)] += shape * value;
                    out[1][(i, k)] += shape * slope;
                }
            }
        };
        if self.is_diagonal() {
            for m in 0..self.model.omega.len() {
                let value = 1.0 / (s * s + s * self.model.damping.get(m, m) + self.model.stiffness.get(m, m));
                let shape = |i: usize| C::new(self.mix[i][m], 0.0);
                add(&shape, &shape, value, -(2.0 * s + self.model.damping.get(m, m)) * value * value);
            }
        } else {
            for (lambda, motion, load) in &self.contact_poles {
                let value = 1.0 / (s - lambda);
                add(&|i| motion[i], &|i| load[i], value, -value * value);
            }
        }
        out
    }
}
