//! Newton's method on the equations of a cycle, bordered by a phase condition and by one more condition.
//!
//! The Jacobian comes from differences of marches: a march costs milliseconds, whatever the number of modes. Between
//! such Jacobians it is updated by Broyden's rule (C. G. Broyden, Math. Comp. 19 (1965)), along a branch too. Marches
//! are smooth but where a node changes its status; differences so small hardly ever meet such a change, and the
//! matrix is the one with the statuses as they are: an element of the generalised Jacobian of the semi-smooth map.

use super::balance::{Balance, Conditions, ContactMemory, Marched, PeriodicSolution, Resolution, Structure};
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::Mat;

/// Dependence on the key.
pub trait Family {
    /// Conditions at the value `key`; an error where the model does not hold there, whose text ends the branch.
    fn at(&self, key: f64) -> Result<Conditions>;

    /// Growth rate, 1/s, that motions have at the value `key`; that of cycles is 0.
    fn growth(&self, _key: f64) -> f64 {
        0.0
    }
}

/// The equations over motion, frequency and key.
///
/// Unknowns u are the coefficients of the motion in units, the angular frequency and the key, both in units too,
/// `[size + 2]`.
pub struct Equations<'e, 'a> {
    /// Modes.
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
pub struct Corrected {
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
const SETTLED: f64 = 1e-8;
const WITHIN: f64 = 1e-5;
/// Correction that may be left of a motion that grows, which only leads to a cycle.
const PASSING: f64 = 1e-6;
/// Jacobians that are made for one solution, at the most.
const MOST_JACOBIANS: usize = 2;
/// Iterations after which a Jacobian that was updated is made anew.
const PATIENCE: usize = 8;
/// Differences relative to the motion and to the frequency, and to the unit of the key.
const DIFFERENCE: [f64; 3] = [3e-6, 1e-7, 1e-6];

impl<'a> Equations<'_, 'a> {
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

    /// The march at `u`.
    pub(super) fn march(&mut self, u: &[f64]) -> Result<Marched> {
        let key = self.key_of(u);
        let conditions = self.family.at(key)?;
        let (n, omega) = (self.size(), self.omega_of(u));
        self.marches += 1;
        let mut balance = self.balance(&conditions, key)?;
        balance.march(&u[..n], omega, &self.memory)
    }

    /// Marches begin with the contact that a march at `u` ends with.
    pub fn settle(&mut self, u: &[f64]) -> Result<()> {
        self.memory = self.march(u)?.memory;
        Ok(())
    }

    /// The equations under `conditions`, those at `key`.
    fn balance<'s>(&'s self, conditions: &'s Conditions, key: f64) -> Result<Balance<'a, 's>> {
        let balance = Balance::new(self.structure, conditions, self.resolution, self.unit, &self.memory)?;
        Ok(balance.growing(self.family.growth(key)))
    }

    /// Size of the motion beside its mean.
    pub fn amplitude(&self, u: &[f64]) -> f64 {
        norm(&u[self.structure.rank()..self.size()])
    }

    /// The Jacobian at `u`, `[size, size + 2]`. All marches for it begin with the same contact: what it has not yet
    /// forgotten at their end is far more than such small differences.
    pub(super) fn jacobian(&mut self, u: &[f64]) -> Result<Mat<f64>> {
        let lack = self.march(u)?.lack;
        let (n, omega, key) = (self.size(), self.omega_of(u), self.key_of(u));
        let conditions = self.family.at(key)?;
        let memory = self.memory.clone();
        let mut j = Mat::zeros(n, n + 2);
        let mut set = |column: usize, found: &[f64], by: f64| {
            (0..n).for_each(|i| j[(i, column)] = (found[i] - lack[i]) / by);
        };
        let mut balance = self.balance(&conditions, key)?;
        let by = DIFFERENCE[0] * self.amplitude(u).max(1e-6);
        let mut z = u[..n].to_vec();
        for column in 0..n {
            z[column] += by;
            set(column, &balance.march(&z, omega, &memory)?.lack, by);
            z[column] = u[column];
        }
        let by = DIFFERENCE[1] * u[n];
        set(n, &balance.march(&z, omega + self.omega * by, &memory)?.lack, by);
        drop(balance);
        self.marches += n + 1;
        self.key_column(&mut j, u)?;
        Ok(j)
    }

    /// Makes the column of the key of a Jacobian at `u`.
    pub fn key_column(&mut self, j: &mut Mat<f64>, u: &[f64]) -> Result<()> {
        let lack = self.march(u)?.lack;
        let (n, omega, key) = (self.size(), self.omega_of(u), self.key_of(u));
        let by = DIFFERENCE[2];
        // On the other side where the model does not hold on the first.
        let (by, beside) = match self.family.at(key + self.key[1] * by) {
            Ok(conditions) => (by, conditions),
            Err(_) => (-by, self.family.at(key - self.key[1] * by)?),
        };
        let found = self.balance(&beside, key + self.key[1] * by)?.march(&u[..n], omega, &self.memory)?.lack;
        (0..n).for_each(|i| j[(i, n + 1)] = (found[i] - lack[i]) / by);
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

    /// The solution near `u` that meets both `conditions`. `jacobian` is one nearby, and becomes that at the end;
    /// where it is none one is made.
    pub fn correct(
        &mut self,
        mut u: Vec<f64>,
        conditions: &[Condition; 2],
        jacobian: &mut Option<Mat<f64>>,
    ) -> Result<Corrected> {
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
                if jacobian.is_none() {
                    *jacobian = Some(self.jacobian(&u)?);
                }
                let cycle = self.structure.solution(found, self.resolution.harmonics)?;
                return Ok(Corrected { u, cycle, iterations: iteration });
            }
            if jacobian.is_none() || (since >= PATIENCE && made < MOST_JACOBIANS) {
                *jacobian = Some(self.jacobian(&u)?);
                (made, since) = (made + 1, 0);
            }
            let Some(j) = jacobian.as_mut() else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
            let system = bordered(j, [&conditions[0].row, &conditions[1].row]).partial_piv_lu();
            let step = correction(&system, &residual(&found.lack, &u))?;
            let size = norm(&step);
            // Near a resonance a force that is hardly wrong moves the modes far: what counts is the correction that a
            // residual asks for (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, natural monotonicity).
            let settled = match self.family.growth(self.key_of(&u)) == 0.0 {
                true => made > 0 && iteration > 1 && size <= SETTLED * aim,
                false => iteration > 0 && size <= PASSING * aim,
            };
            if settled && error <= WITHIN * aim {
                let cycle = self.structure.solution(found, self.resolution.harmonics)?;
                return Ok(Corrected { u, cycle, iterations: iteration });
            }
            let mut factor = 1.0;
            let mut last: Option<(Vec<f64>, Marched, [f64; 2])> = None;
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
            update(j, &moved, &found.lack, &there.lack);
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
            let cycle = self.structure.solution(found, self.resolution.harmonics)?;
            return Ok(Corrected { u, cycle, iterations: MOST_ITERATIONS });
        }
        Err(Error::NotConverged(format!(
            "limit cycles: Newton's method ends with a residual of {:.1e} of the motion at the key {:.8e}, expected \
             {ACCEPTED:.0e}",
            best.min(error / aim),
            self.key_of(&u)
        )))
    }

    /// The tangent of the branch at a solution with the Jacobian `j`, of length 1, on the side of `ahead`.
    pub fn tangent(&self, j: &Mat<f64>, phase: &Condition, ahead: &[f64]) -> Result<Vec<f64>> {
        let border = Condition { row: ahead.to_vec(), reference: vec![0.0; ahead.len()] };
        let n = self.size();
        let rows = [&phase.row, &border.row];
        let a = bordered(j, rows);
        let b = Mat::from_fn(n + 2, 1, |i, _| if i == n + 1 { 1.0 } else { 0.0 });
        let t = a.partial_piv_lu().solve(b);
        let t: Vec<f64> = (0..n + 2).map(|i| t[(i, 0)]).collect();
        let length = norm(&t);
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

/// Broyden's update after a step `moved` from `before` to `after`.
pub(super) fn update(j: &mut Mat<f64>, moved: &[f64], before: &[f64], after: &[f64]) {
    let square: f64 = moved.iter().map(|v| v * v).sum();
    if !(square > 0.0) {
        return;
    }
    let n = j.nrows();
    let gap: Vec<f64> = (0..n)
        .map(|i| {
            let foreseen: f64 = moved.iter().enumerate().map(|(k, m)| j[(i, k)] * m).sum();
            (after[i] - before[i] - foreseen) / square
        })
        .collect();
    for (k, m) in moved.iter().enumerate() {
        (0..n).for_each(|i| j[(i, k)] += gap[i] * m);
    }
}

pub(super) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}
