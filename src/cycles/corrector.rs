//! Newton's method on the equations of a cycle, bordered by a phase condition and by one more condition.
//!
//! The Jacobian comes from differences of marches: a march costs milliseconds, whatever the number of modes. Between
//! such Jacobians it is updated by Broyden's rule (C. G. Broyden, Math. Comp. 19 (1965)), along a branch too. Marches
//! are smooth but where a node changes its status; differences so small hardly ever meet such a change, and the
//! matrix is the one with the statuses as they are: an element of the generalised Jacobian of the semi-smooth map.

use super::balance::{Balance, Conditions, ContactMemory, Marched, PeriodicSolution, Resolution, Structure};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::Mat;

/// Dependence on the key.
pub trait Family {
    /// Conditions at the value `key`; an error where the model does not hold there, whose text ends the branch.
    fn at(&self, key: f64) -> Result<Conditions>;
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
/// Iterations after which a Jacobian that was updated is made anew.
const PATIENCE: usize = 8;
/// Differences relative to the motion and to the frequency, and to the unit of the key.
const DIFFERENCE: [f64; 3] = [3e-6, 1e-7, 1e-6];

impl Equations<'_, '_> {
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
        let conditions = self.family.at(self.key_of(u))?;
        let (n, omega) = (self.size(), self.omega_of(u));
        self.marches += 1;
        let mut balance = Balance::new(self.structure, &conditions, self.resolution, self.unit, &self.memory)?;
        balance.march(&u[..n], omega, &self.memory)
    }

    /// Size of the motion beside its mean.
    pub fn amplitude(&self, u: &[f64]) -> f64 {
        norm(&u[self.structure.rank()..self.size()])
    }

    /// The Jacobian at `u`, where the march gives `lack`: `[size, size + 2]`.
    pub(super) fn jacobian(&mut self, u: &[f64], lack: &[f64]) -> Result<Mat<f64>> {
        let (n, omega, key) = (self.size(), self.omega_of(u), self.key_of(u));
        let conditions = self.family.at(key)?;
        let memory = self.memory.clone();
        let mut j = Mat::zeros(n, n + 2);
        let mut set = |column: usize, found: &[f64], by: f64| {
            (0..n).for_each(|i| j[(i, column)] = (found[i] - lack[i]) / by);
        };
        let mut balance = Balance::new(self.structure, &conditions, self.resolution, self.unit, &memory)?;
        let by = DIFFERENCE[0] * self.amplitude(u).max(1e-6);
        let mut z = u[..n].to_vec();
        for column in 0..n {
            z[column] += by;
            set(column, &balance.march(&z, omega, &memory)?.lack, by);
            z[column] = u[column];
        }
        let by = DIFFERENCE[1] * u[n];
        set(n, &balance.march(&z, omega + self.omega * by, &memory)?.lack, by);
        let by = DIFFERENCE[2];
        // On the other side where the model does not hold on the first.
        let (by, beside) = match self.family.at(key + self.key[1] * by) {
            Ok(conditions) => (by, conditions),
            Err(_) => (-by, self.family.at(key - self.key[1] * by)?),
        };
        let mut balance = Balance::new(self.structure, &beside, self.resolution, self.unit, &memory)?;
        set(n + 1, &balance.march(&z, omega, &memory)?.lack, by);
        self.marches += n + 2;
        Ok(j)
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
        let mut fresh = false;
        let mut since = 0;
        let apart = |found: &Marched, u: &[f64]| {
            let rows = conditions.iter().map(|c| c.apart(u).powi(2)).sum::<f64>();
            (found.lack.iter().map(|v| v * v).sum::<f64>() + rows).sqrt()
        };
        let mut error = apart(&found, &u);
        let mut best = f64::INFINITY;
        for iteration in 0..MOST_ITERATIONS {
            self.memory = found.memory.clone();
            let aim = self.amplitude(&u).max(1e-3);
            best = best.min(error / aim);
            // A solution whose contact has not settled is looked at once more.
            if error <= SOLVED * aim || (iteration > 1 && since > 2 && error <= ACCEPTED * aim && fresh) {
                // A cycle that was a solution to begin with has none yet.
                if jacobian.is_none() {
                    *jacobian = Some(self.jacobian(&u, &found.lack)?);
                }
                let cycle = self.structure.solution(found, self.resolution.harmonics)?;
                return Ok(Corrected { u, cycle, iterations: iteration });
            }
            if jacobian.is_none() || (since >= PATIENCE && !fresh) {
                *jacobian = Some(self.jacobian(&u, &found.lack)?);
                (fresh, since) = (true, 0);
            }
            let Some(j) = jacobian.as_mut() else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
            let step = solve(j, conditions, &found.lack, &u)?;
            let mut factor = 1.0;
            let mut last: Option<(Vec<f64>, Marched, f64)> = None;
            for _ in 0..4 {
                let next: Vec<f64> = u.iter().zip(&step).map(|(u, s)| u + factor * s).collect();
                match self.march(&next) {
                    Ok(there) => {
                        let e = apart(&there, &next);
                        let better = e < (1.0 - 0.1 * factor) * error;
                        last = Some((next, there, e));
                        if better {
                            break;
                        }
                    }
                    Err(e) if factor < 0.2 => return Err(e),
                    Err(_) => {}
                }
                factor *= 0.4;
            }
            let Some((next, there, e)) = last else {
                return Err(Error::NotConverged("limit cycles: the contact of a march does not converge".into()));
            };
            let moved: Vec<f64> = next.iter().zip(&u).map(|(a, b)| a - b).collect();
            update(j, &moved, &found.lack, &there.lack);
            since += 1;
            if e > 0.5 * error && !fresh {
                since = PATIENCE;
            }
            if e > 0.7 * error && fresh && since > PATIENCE {
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

/// The Newton step.
fn solve(j: &Mat<f64>, conditions: &[Condition; 2], lack: &[f64], u: &[f64]) -> Result<Vec<f64>> {
    let n = j.nrows();
    let a = bordered(j, [&conditions[0].row, &conditions[1].row]);
    let b = Mat::from_fn(n + 2, 1, |i, _| -if i < n { lack[i] } else { conditions[i - n].apart(u) });
    let x = a.partial_piv_lu().solve(b);
    let step: Vec<f64> = (0..n + 2).map(|i| x[(i, 0)]).collect();
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
