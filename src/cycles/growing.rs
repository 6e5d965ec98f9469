//! From an unstable mode of rest to its cycle without a march: motions of growing amplitude.
//!
//! A small motion along the mode grows with its growth rate. The larger it is, the less it grows, and where the rate is
//! zero it is a cycle. In between, the modes take the motion as exp((d + ikω)t), k > 0, with the rate d, and the
//! contact takes it as periodic, which a rate much lower than the frequency permits. So the branch over d that begins
//! at the eigenvalue of rest ends at the cycle, which obeys the equations of [`super::balance`] without change. It is
//! followed by pseudo-arclength: the amplitude may fall back on the way, and the rate may rise.

use super::balance::Conditions;
use super::branch::{follow, solve_under, BranchEnd, BranchExtent, BranchPoint, BranchState};
use super::contact_jacobian::ContactJacobian;
use super::corrector::{Condition, Equations, Family};
use crate::{Error, Result};

/// Conditions that stay, the key being the growth rate, 1/s.
pub struct GrowingMotion(pub Conditions);

impl Family for GrowingMotion {
    fn conditions(&self, _key: f64) -> Result<Conditions> {
        Ok(self.0.clone())
    }

    fn is_growth(&self) -> bool {
        true
    }
}

/// Longest step, in units of motion, frequency and growth rate together.
const LONGEST: f64 = 0.3;
/// Motions on the way, at the most.
const MOST: usize = 80;
/// Growth rate, of that of the mode, at which the way ends on the other side.
const FASTEST: f64 = 20.0;

/// The cycle that begins with the small motion `u`: `equations` are those of a [`GrowingMotion`], whose key counts from
/// the growth rate of the mode and has it as unit. With the contact forces near it, in the units of the equations.
pub fn cycle_of_mode(equations: &mut Equations<'_, '_>, u: Vec<f64>) -> Result<(BranchPoint, ContactJacobian)> {
    let (r, n) = (equations.structure.rank(), equations.size());
    let rate = equations.key[0];
    let size = equations.amplitude(&u).max(f64::MIN_POSITIVE);
    let mut ahead = vec![0.0; u.len()];
    (r..n).for_each(|k| ahead[k] = u[k] / size);
    let mut contact = None;
    let held = Condition { row: ahead.clone(), reference: u.clone() };
    let first = solve_under(equations, u, held, &mut contact)?;
    let Some(contact) = contact else { return Err(Error::Defect("limit cycles: no Jacobian".into())) };
    let key = equations.key_of(&first.u);
    if !(key > 0.0) {
        return Err(Error::NotConverged(format!(
            "limit cycles: a small motion along the mode has the growth rate {key:.3e} 1/s, expected one near that of \
             the mode, {rate:.3e} 1/s"
        )));
    }
    let start = BranchPoint { key, u: first.u, cycle: first.cycle, multipliers: None, special: None };
    let extent =
        BranchExtent { range: [0.0, FASTEST * rate], most: MOST, longest: LONGEST, located: None, stability: false };
    let mut branch = BranchState::new(start, contact, false, &extent).towards(ahead);
    follow(equations, &mut branch, &extent, &mut |_| Ok(true))?;
    let BranchState { points, end, contact, .. } = branch;
    match (points.into_iter().next_back(), end, contact) {
        (Some(last), Some(BranchEnd::Range), Some(contact)) if last.key <= 1e-9 * rate => Ok((last, contact)),
        (last, end, _) => Err(Error::NotConverged(format!(
            "limit cycles: motions of growing amplitude lead to no cycle: they end {}, growing with {:.3e} 1/s",
            end.map_or(String::new(), |e| e.text()),
            last.map_or(f64::NAN, |p| p.key)
        ))),
    }
}
