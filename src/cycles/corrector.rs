//! Newton's method on the equations of a cycle, bordered by a phase condition and by one more condition.
//!
//! The derivatives of the contact forces come from a linearised march, whatever the number of modes, those by the
//! frequency and the key from differences of marches. Between such derivatives they are updated by Broyden's rule (C.
//! G. Broyden, Math. Comp. 19 (1965)), along a branch too. Marches are smooth but where a node changes its status; the
//! linearised march takes the statuses as they are, which gives an element of the generalised Jacobian of the
//! semi-smooth map. The modes enter exactly (see [`super::contact_jacobian`]).

use super::balance::{Balance, Conditions, ContactMemory, MarchResult, PeriodicSolution, Resolution};
use super::contact_jacobian::ContactJacobian;
use super::structure::Structure;
use crate::model::ModalDynamics;
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;
use std::borrow::Cow;

/// Dependence on the key.
pub trait Family {
    /// Conditions at the value `key`; an error where the model does not hold there, whose text ends the branch.
    fn conditions(&self, key: f64) -> Result<Conditions>;

    /// Equations of motion of the modes at the value `key`; none where the key does not change them.
    fn dynamics(&self, _key: f64) -> Result<Option<ModalDynamics>> {
        Ok(None)
    }

    /// True if the key is the growth rate of the motion, 1/s; that of cycles is 0.
    fn is_growth(&self) -> bool {
        false
    }
}

/// The equations over motion, frequency and key.
///
/// Unknowns u are the coefficients of the motion in units, the angular frequency and the key, both in units too,
/// `[size + 2]`.
pub struct Equations<'e, 'a> {
    /// Modes, with their equations of motion where the key does not change them.
    pub structure: &'e Structure<'a>,
    /// Dependence on the key of the branch.
    pub family: &'e dyn Family,
    /// Harmonics and steps.
    pub resolution: Resolution,
    /// Unit of the motion, m √kg.
    pub unit: f64,
    /// Unit of the angular frequency, rad/s.
    pub omega: f64,
    /// Value of the key that counts from, and its unit.
    pub key: [f64; 2],
    /// The contact that marches begin with.
    pub memory: ContactMemory,
    /// Marches made so far.
    pub marches: usize,
}

/// A solution.
pub struct CorrectorResult {
    /// Unknowns.
    pub u: Vec<f64>,
    /// The cycle.
    pub cycle: PeriodicSolution,
    /// Iterations.
    pub iterations: usize,
}

/// A condition row·(u − reference) = 0.
pub struct Condition {
    /// `[size + 2]`.
    pub row: Vec<f64>,
    /// `[size + 2]`.
    pub reference: Vec<f64>,
}

/// Norm of what the modes make of the forces less the motion, relative to the motion, at a solution.
const SOLVED: f64 = 1e-9;
/// The same that is accepted where rounding and the tolerance of the contact leave no more.
const ACCEPTED: f64 = 1e-7;
const MOST_ITERATIONS: usize = 30;
/// Correction relative to the motion at a solution, and the residual that may belong to it near a resonance.
const SETTLED: f64 = 3e-8;
const WITHIN: f64 = 1e-5;
/// Correction that may be left of a motion that grows, which only leads to a cycle.
const PASSING: f64 = 1e-6;
/// Jacobians that are made for one solution, at the most.
const MOST_JACOBIANS: usize = 2;
/// Iterations after which a Jacobian that was updated is made anew.
const PATIENCE: usize = 8;
/// Differences relative to the frequency, and to the unit of the key.
const DIFFERENCE: [f64; 2] = [1e-7, 1e-6];

impl<'e, 'a> Equations<'e, 'a> {
    /// Number of coefficients of the motion.
    pub fn size(&self) -> usize {
        self.structure.rank() * (2 * self.resolution.harmonics + 1)
    }

    /// The key of unknowns.
    pub fn key_of(&self, u: &[f64]) -> f64 {
        self.key[0] + self.key[1] * u[self.size() + 1]
    }

    /// Angular frequency of unknowns, rad/s.
    pub fn omega_of(&self, u: &[f64]) -> f64 {
        self.omega * u[self.size()]
    }

    /// The modes with their equations of motion at the value `key`.
    pub fn structure_at(&self, key: f64) -> Result<Cow<'e, Structure<'a>>> {
        Ok(match self.family.dynamics(key)? {
            Some(dynamics) => Cow::Owned(self.structure.with(dynamics)?),
            None => Cow::Borrowed(self.structure),
        })
    }

    /// The same a small part of the unit of the key away, and that part; none where the key does not change them. On
    /// the other side where the model does not hold on the first.
    pub(super) fn structure_beside(&self, key: f64) -> Result<Option<(Structure<'a>, f64)>> {
        let by = DIFFERENCE[1];
        let (found, by) = match self.family.dynamics(key + self.key[1] * by) {
            Ok(found) => (found, by),
            Err(_) => (self.family.dynamics(key - self.key[1] * by)?, -by),
        };
        found.map(|dynamics| Ok((self.structure.with(dynamics)?, by))).transpose()
    }

    /// The march at `u`.
    pub(super) fn march(&mut self, u: &[f64]) -> Result<MarchResult> {
        let key = self.key_of(u);
        let conditions = self.family.conditions(key)?;
        let (n, omega) = (self.size(), self.omega_of(u));
        self.marches += 1;
        let structure = self.structure_at(key)?;
        let mut balance = self.balance(&structure, &conditions, key)?;
        balance.march(&u[..n], omega, &self.memory)
    }

    /// Marches begin with the contact that a march at `u` ends with.
    pub fn settle(&mut self, u: &[f64]) -> Result<()> {
        self.memory = self.march(u)?.memory;
        Ok(())
    }

    /// The equations of the modes `structure` under `conditions`, both those at `key`.
    fn balance<'s>(
        &self,
        structure: &'s Structure<'a>,
        conditions: &'s Conditions,
        key: f64,
    ) -> Result<Balance<'a, 's>> {
        let balance = Balance::new(structure, conditions, self.resolution, self.unit, &self.memory)?;
        Ok(if self.family.is_growth() { balance.growing(key) } else { balance })
    }

    /// A step of the unknowns without the mean of the motion, which friction alone moves by many amplitudes: what the
    /// length of a step along a branch counts.
    pub(super) fn counted(&self, mut step: Vec<f64>) -> Vec<f64> {
        step[..self.structure.rank()].fill(0.0);
        step
    }

    /// Size of the motion beside its mean.
    pub fn amplitude(&self, u: &[f64]) -> f64 {
        norm(&u[self.structure.rank()..self.size()])
    }

    /// The contact forces at `u` with their derivatives. All marches begin with the same contact: what it has not yet
    /// forgotten at their end is far more than such small differences.
    pub(super) fn derivatives(&mut self, u: &[f64]) -> Result<ContactJacobian> {
        let force = self.march(u)?.coefficients;
        let (n, omega, key) = (self.size(), self.omega_of(u), self.key_of(u));
        let conditions = self.family.conditions(key)?;
        let memory = self.memory.clone();
        let mut derivative = Mat::zeros(n, n + 2);
        let structure = self.structure_at(key)?;
        let mut balance = self.balance(&structure, &conditions, key)?;
        let by_motion = balance.force_derivative(&u[..n], omega, &memory)?;
        derivative.as_mut().subcols_mut(0, n).copy_from(&by_motion);
        let by = DIFFERENCE[0] * u[n];
        let found = balance.march(&u[..n], omega + self.omega * by, &memory)?.coefficients;
        (0..n).for_each(|i| derivative[(i, n)] = (found[i] - force[i]) / by);
        drop(balance);
        self.marches += 2;
        let mut contact = ContactJacobian { u: u.to_vec(), force, derivative };
        self.key_derivative(&mut contact)?;
        Ok(contact)
    }

    /// Makes the derivatives with respect to the key, and the forces, anew.
    pub fn key_derivative(&mut self, contact: &mut ContactJacobian) -> Result<()> {
        let u = contact.u.clone();
        let (n, omega, key) = (self.size(), self.omega_of(&u), self.key_of(&u));
        // The contact knows nothing of the growth rate.
        if self.family.is_growth() {
            (0..n).for_each(|i| contact.derivative[(i, n + 1)] = 0.0);
            return Ok(());
        }
        let force = self.march(&u)?.coefficients;
        let by = DIFFERENCE[1];
        // On the other side where the model does not hold on the first.
        let (by, beside) = match self.family.conditions(key + self.key[1] * by) {
            Ok(conditions) => (by, conditions),
            Err(_) => (-by, self.family.conditions(key - self.key[1] * by)?),
        };
        // The forces do not depend on what the modes make of them.
        let mut balance = self.balance(self.structure, &beside, key + self.key[1] * by)?;
        let found = balance.march(&u[..n], omega, &self.memory)?.coefficients;
        drop(balance);
        (0..n).for_each(|i| contact.derivative[(i, n + 1)] = (found[i] - force[i]) / by);
        contact.move_to(&u, &force);
        self.marches += 1;
        Ok(())
    }

    /// The phase condition about the motion of `u`: no part of the change lies along its velocity.
    pub fn phase(&self, u: &[f64]) -> Condition {
        let r = self.structure.rank();
        let mut row = vec![0.0; self.size() + 2];
        for k in 1..=self.resolution.harmonics {
            for i in 0..r {
                let (a, b) = (r * (2 * k - 1) + i, r * 2 * k + i);
                (row[a], row[b]) = (k as f64 * u[b], -(k as f64) * u[a]);
            }
        }
        let length = norm(&row).max(f64::MIN_POSITIVE);
        row.iter_mut().for_each(|v| *v /= length);
        Condition { row, reference: u.to_vec() }
    }

    /// The solution near `u` that meets both `conditions`. `contact` has the derivatives nearby, and becomes those at
    /// the end; where there are none they are made.
    pub fn correct(
        &mut self,
        u: Vec<f64>,
        conditions: &[Condition; 2],
        contact: &mut Option<ContactJacobian>,
    ) -> Result<CorrectorResult> {
        self.correct_within(u, conditions, contact, f64::INFINITY)
    }

    /// The same where the first correction is not longer than `longest`: a guess that is worse is given up before
    /// derivatives are made for it.
    pub(super) fn correct_within(
        &mut self,
        mut u: Vec<f64>,
        conditions: &[Condition; 2],
        contact: &mut Option<ContactJacobian>,
        longest: f64,
    ) -> Result<CorrectorResult> {
        let mut found = self.march(&u)?;
        let (mut made, mut since) = (0, 0);
        let residual = |lack: &[f64], u: &[f64]| -> Vec<f64> {
            lack.iter().copied().chain(conditions.iter().map(|c| c.apart(u))).collect()
        };
        let mut error = norm(&residual(&found.lack, &u));
        let mut best = f64::INFINITY;
        for iteration in 0..MOST_ITERATIONS {
            self.memory = found.memory.clone();
            let aim = self.amplitude(&u).max(1e-3);
            best = best.min(error / aim);
            // A solution whose contact has not settled is looked at once more.
            if error <= SOLVED * aim || (iteration > 1 && since > 2 && error <= ACCEPTED * aim && made > 0) {
                // A cycle that was a solution to begin with has none yet.
                if contact.is_none() {
                    *contact = Some(self.derivatives(&u)?);
                }
                return self.corrected(u, found, contact, iteration);
            }
            if contact.is_none() || (since >= PATIENCE && made < MOST_JACOBIANS) {
                *contact = Some(self.derivatives(&u)?);
                (made, since) = (made + 1, 0);
            }
            let Some(near) = contact.as_mut() else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
            near.move_to(&u, &found.coefficients);
            let j = self.assemble(near, &u)?;
            let system = bordered(&j, [&conditions[0].row, &conditions[1].row]).partial_piv_lu();
            let step = correction(&system, &residual(&found.lack, &u))?;
            let size = norm(&step);
            if iteration == 0 && longest.is_finite() {
                let way = norm(&self.counted(step.clone()));
                if way > longest {
                    return Err(Error::NotConverged(format!(
                        "limit cycles: the cycle is {way:.1e} from its guess, expected at most {longest:.1e}"
                    )));
                }
            }
            // Near a resonance a force that is hardly wrong moves the modes far: what counts is the correction that a
            // residual asks for (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, natural monotonicity).
            let settled = match self.family.is_growth() && self.key_of(&u) != 0.0 {
                true => iteration > 0 && size <= PASSING * aim,
                false => iteration > 0 && size <= SETTLED * aim,
            };
            if settled && error <= WITHIN * aim {
                return self.corrected(u, found, contact, iteration);
            }
            let mut factor = 1.0;
            let mut last: Option<(Vec<f64>, MarchResult, [f64; 2])> = None;
            for _ in 0..4 {
                let next: Vec<f64> = u.iter().zip(&step).map(|(u, s)| u + factor * s).collect();
                match self.march(&next) {
                    Ok(there) => {
                        let now = residual(&there.lack, &next);
                        let sizes = [norm(&now), norm(&correction(&system, &now)?)];
                        let better = sizes[0] < (1.0 - 0.1 * factor) * error || sizes[1] < (1.0 - 0.25 * factor) * size;
                        last = Some((next, there, sizes));
                        if better {
                            break;
                        }
                    }
                    Err(e) if factor < 0.2 => return Err(e),
                    Err(_) => {}
                }
                factor *= 0.4;
            }
            let Some((next, there, [e, natural])) = last else {
                return Err(Error::NotConverged("limit cycles: the contact of a march does not converge".into()));
            };
            let moved: Vec<f64> = next.iter().zip(&u).map(|(a, b)| a - b).collect();
            near.update(&moved, &found.coefficients, &there.coefficients);
            since += 1;
            if e > 0.5 * error && natural > 0.5 * size && made < MOST_JACOBIANS {
                since = PATIENCE;
            }
            if e > 0.7 * error && natural > 0.7 * size && made == MOST_JACOBIANS && since > PATIENCE {
                break;
            }
            (u, found, error) = (next, there, e);
        }
        let aim = self.amplitude(&u).max(1e-3);
        if error <= ACCEPTED * aim {
            return self.corrected(u, found, contact, MOST_ITERATIONS);
        }
        Err(Error::NotConverged(format!(
            "limit cycles: Newton's method ends with a residual of {:.1e} of the motion at the key {:.8e}, expected \
             {ACCEPTED:.0e}",
            best.min(error / aim),
            self.key_of(&u)
        )))
    }

    /// The solution `u` with its march.
    fn corrected(
        &self,
        u: Vec<f64>,
        found: MarchResult,
        contact: &mut Option<ContactJacobian>,
        iterations: usize,
    ) -> Result<CorrectorResult> {
        if let Some(near) = contact {
            near.move_to(&u, &found.coefficients);
        }
        let structure = self.structure_at(self.key_of(&u))?;
        Ok(CorrectorResult { u, cycle: structure.solution(found, self.resolution.harmonics)?, iterations })
    }

    /// The tangent of the branch at the solution `u`, of length 1 but for its mean, on the side of `ahead`.
    pub fn tangent(&self, contact: &ContactJacobian, u: &[f64], ahead: &[f64]) -> Result<Vec<f64>> {
        let (n, phase) = (self.size(), self.phase(u));
        let a = bordered(&self.assemble(contact, u)?, [&phase.row, &self.counted(ahead.to_vec())]);
        let b = Mat::from_fn(n + 2, 1, |i, _| if i == n + 1 { 1.0 } else { 0.0 });
        let t = a.partial_piv_lu().solve(b);
        let t: Vec<f64> = (0..n + 2).map(|i| t[(i, 0)]).collect();
        let length = norm(&self.counted(t.clone()));
        if !length.is_finite() || length == 0.0 {
            return Err(Error::NotConverged("limit cycles: a branch without tangent".into()));
        }
        Ok(t.into_iter().map(|v| v / length).collect())
    }
}

impl Condition {
    fn apart(&self, u: &[f64]) -> f64 {
        self.row.iter().zip(u.iter().zip(&self.reference)).map(|(r, (u, o))| r * (u - o)).sum()
    }
}

fn bordered(j: &Mat<f64>, rows: [&Vec<f64>; 2]) -> Mat<f64> {
    let n = j.nrows();
    Mat::from_fn(n + 2, n + 2, |i, k| if i < n { j[(i, k)] } else { rows[i - n][k] })
}

/// The correction that a residual asks for, with the bordered Jacobian `system`.
fn correction(system: &PartialPivLu<f64>, residual: &[f64]) -> Result<Vec<f64>> {
    let x = system.solve(Mat::from_fn(residual.len(), 1, |i, _| -residual[i]));
    let step: Vec<f64> = (0..residual.len()).map(|i| x[(i, 0)]).collect();
    match step.iter().all(|v| v.is_finite()) {
        true => Ok(step),
        false => Err(Error::NotConverged("limit cycles: the Jacobian is singular".into())),
    }
}

pub(super) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}
