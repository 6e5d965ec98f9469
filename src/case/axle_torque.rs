//! Torque on the axle of a wheel or a wheelset, and the angular speed that follows from it.
//!
//! The rigid slip c = (V ξ, V η, V φ) of a contact, rail over wheel, is linear in the angular speed Ω of the axle. By
//! the power of its forces F_x, F_y and of its moment M_z about the normal, all on the rail, a contact exerts on the
//! axle the torque
//!
//! ```text
//! T_c = F_x ∂(V ξ)/∂Ω + F_y ∂(V η)/∂Ω + M_z ∂(V φ)/∂Ω,
//! ```
//!
//! which is −r_c F_x where the wheel is not yawed and the contact does not lean. A drive with the torque T, positive in
//! the sense of rotation, and an axle that rolls steadily have
//!
//! ```text
//! T + Σ_c T_c(Ω) = 0,
//! ```
//!
//! with the forces of steady rolling on the grids of the contacts. The sum falls as Ω grows, as long as the creep
//! forces rise with the creep: the search begins where the wheels do not slip along the track on the mean, and goes to
//! the first solution.

use super::interface::at_rest;
use super::wheel_rail_geometry::{with_motions, PlacedContact};
use crate::contact::{PatchResultant, SteadySolution};
use crate::grid::Interface;
use crate::job::{self, ContactPlaces, ContactWheels, Job, Load};
use crate::model::CoupledModel;
use crate::parallel::World;
use crate::{Error, Result};

/// Torque that may be left, over the sum of μ N r of all contacts.
const BALANCED: f64 = 1e-9;

/// Largest step of the search, as a part of the angular speed, as long as this is within [`NEAR`] of rolling without
/// slip on the mean. Creep forces saturate at more creepage, so the search does not step over their largest torque.
const STEP: f64 = 0.003;

/// Change of the angular speed, as a part of it, up to which steps are at most [`STEP`].
const NEAR: f64 = 0.03;

/// Largest change of the angular speed that is looked at, as a part of it.
const FARTHEST: f64 = 0.1;

/// Largest number of steps between two angular speeds on either side of the solution.
const MOST_STEPS: usize = 60;

/// The contacts of an axle.
struct Axle<'a> {
    job: &'a Job,
    model: (&'a Interface, &'a CoupledModel),
    placed: Vec<PlacedContact>,
    /// ∂c/∂Ω of each contact.
    rates: Vec<[f64; 3]>,
}

/// An axle that rolls at an angular speed.
struct RollingAxle {
    /// Ω, rad/s.
    angular_speed: f64,
    /// The job with its creepages.
    job: Job,
    solution: SteadySolution,
    /// Torque of the drive and of the contacts, N m.
    sum: f64,
    /// Torque of the contacts alone, N m.
    contacts: f64,
}

/// Torque of the rails on the axle of `job`, N m, by the `patches` of steady rolling. For one rank.
pub(crate) fn of_contacts(job: &Job, patches: &[PatchResultant]) -> Result<f64> {
    let rates = PlacedContact::all(job)?.iter().map(PlacedContact::slip_rate).collect::<Result<Vec<_>>>()?;
    Ok(torque(&rates, patches))
}

/// Σ T_c, N m, from ∂c/∂Ω of each contact.
fn torque(rates: &[[f64; 3]], patches: &[PatchResultant]) -> f64 {
    let of = |([x, y, spin], p): (&[f64; 3], &PatchResultant)| p.force[0] * x + p.force[1] * y + p.moment_z * spin;
    rates.iter().zip(patches).map(of).sum()
}

/// `job` with an angular speed, rad/s, and the motions of its contacts ([`PlacedContact::motion`]).
fn rolling_at(job: &Job, angular_speed: f64, motions: &[f64]) -> Result<Job> {
    let mut job = job.clone();
    if let Some(contact) = &mut job.contact {
        let turn = |one: &mut job::Contact| {
            one.placement.iter_mut().for_each(|placement| placement.angular_speed = Some(angular_speed))
        };
        turn(contact);
        contact.further.iter_mut().for_each(turn);
    }
    with_motions(&job, motions)?.ok_or_else(|| Error::Defect("the torque on an axle without contacts".into()))
}

/// `job` at the angular speed at which the creep forces balance `contact.torque`; none of a job without one. For one
/// rank.
///
/// # Errors
/// A torque that the creep forces do not bear; those of steady rolling.
pub(crate) fn balanced(job: &Job, model: (&Interface, &CoupledModel)) -> Result<Option<Job>> {
    Ok(found(job, model)?.map(|axle| axle.job))
}

/// Collective: the same, with the `model` on rank 0, and the angular speed, rad/s.
pub(crate) fn balanced_on_root(
    world: &World,
    job: &Job,
    model: Option<(&Interface, &CoupledModel)>,
) -> Result<Option<(Job, f64)>> {
    if job.contact.as_ref().is_none_or(|contact| contact.torque.is_none()) {
        return Ok(None);
    }
    let numbers = world.on_root(|| {
        let model = model.ok_or_else(|| Error::Defect("no contact on rank 0".into()))?;
        let found = found(job, model)?.ok_or_else(|| Error::Defect("a torque that was lost".into()))?;
        let contacts = found.job.contact.iter().flat_map(job::Contact::all);
        let motions = contacts.flat_map(|one| {
            let job::Creepage { longitudinal, lateral, spin } = one.creepage;
            [longitudinal, lateral, spin, one.speed, one.angle, one.touch_angle]
        });
        Ok(std::iter::once(found.angular_speed).chain(motions).collect::<Vec<f64>>())
    })?;
    let numbers = world.broadcast(numbers.unwrap_or_default());
    let Some((&angular_speed, motions)) = numbers.split_first() else {
        return Err(Error::Defect("an angular speed was lost on its way".into()));
    };
    Ok(Some((rolling_at(job, angular_speed, motions)?, angular_speed)))
}

fn found(job: &Job, model: (&Interface, &CoupledModel)) -> Result<Option<RollingAxle>> {
    let Some((contact, torque)) = job.contact.as_ref().and_then(|contact| Some((contact, contact.torque?))) else {
        return Ok(None);
    };
    let placed = PlacedContact::all(job)?;
    let alone = contact.places == ContactPlaces::One && contact.wheels == ContactWheels::One;
    if let Some(text) = placed.iter().filter(|_| alone).find_map(|one| one.warnings().pop()) {
        return Err(Error::Job(format!(
            "contact.torque: {text}; all contacts of the axle balance it, expected contact.places = \"all\""
        )));
    }
    let rates = placed.iter().map(PlacedContact::slip_rate).collect::<Result<Vec<_>>>()?;
    Axle { job, model, placed, rates }.under(torque).map(Some)
}

impl Axle<'_> {
    /// The angular speed at which the wheels roll without slip along the track, rad/s: on the mean of their loads.
    fn without_slip(&self) -> Result<f64> {
        let load = |one: &job::Contact| if let Load::Normal(force) = one.load() { force } else { 1.0 };
        let weights = self.job.contact.iter().flat_map(job::Contact::all).map(load);
        let (mut slip, mut rate) = (0.0, 0.0);
        for ((placed, [along, ..]), weight) in self.placed.iter().zip(&self.rates).zip(weights) {
            let there = placed.at_angular_speed(1.0)?;
            slip += weight * there.speed * there.longitudinal;
            rate += weight * along;
        }
        Ok(1.0 - slip / rate)
    }

    /// Steady rolling at an angular speed, rad/s, under a torque, N m, begun with the solution `before`.
    fn at(&self, angular_speed: f64, given: f64, before: Option<&SteadySolution>) -> Result<RollingAxle> {
        let mut motions = Vec::new();
        for one in &self.placed {
            motions.extend(one.motion_with(&one.at_angular_speed(angular_speed)?));
        }
        let job = rolling_at(self.job, angular_speed, &motions)?;
        let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("an axle without contacts".into()))?;
        let solution = at_rest(self.model, contact, job.analyses.steady.as_ref()).solve_from(before)?;
        let contacts = torque(&self.rates, &solution.patches);
        Ok(RollingAxle { angular_speed, job, solution, sum: given + contacts, contacts })
    }

    /// Σ μ N r of the contacts, N m.
    fn scale(&self, at: &RollingAxle) -> f64 {
        let contacts = at.job.contact.iter().flat_map(job::Contact::all);
        let of = |((contact, patch), [along, ..]): ((&job::Contact, &PatchResultant), &[f64; 3])| {
            contact.law().coefficient(0.0) * patch.force[2].abs() * along.abs()
        };
        contacts.zip(&at.solution.patches).zip(&self.rates).map(of).sum()
    }

    /// The axle under a torque, N m: from rolling without slip by steps to an angular speed on the other side, then by
    /// the Illinois algorithm.
    fn under(&self, given: f64) -> Result<RollingAxle> {
        let start = self.without_slip()?;
        let mut near = self.at(start, given, None)?;
        let scale = self.scale(&near);
        if scale == 0.0 && given != 0.0 {
            return Err(Error::Job(format!(
                "contact.torque: found {given} N m, but the contacts have no friction, or are open, and bear no \
                 torque; expected 0"
            )));
        }
        let is_found = |at: &RollingAxle| at.sum.abs() <= BALANCED * scale;
        if is_found(&near) {
            return Ok(near);
        }
        // More torque than the contacts bear makes the axle turn faster.
        let mut step = STEP * start * (near.sum / scale).clamp(-1.0, 1.0);
        let mut seen = [near.contacts; 2];
        let mut far = loop {
            let next = self.at(near.angular_speed + step, given, Some(&near.solution))?;
            if is_found(&next) {
                return Ok(next);
            }
            seen = [seen[0].min(next.contacts), seen[1].max(next.contacts)];
            if next.sum * near.sum < 0.0 {
                break next;
            }
            let changed = (next.angular_speed / start - 1.0).abs();
            if changed >= FARTHEST {
                return Err(Error::Job(format!(
                    "contact.torque: found {given} N m, which the creep forces do not balance: from {start:.3} to \
                     {:.3} rad/s the contacts exert torques between {:.1} and {:.1} N m on the axle; give a torque \
                     against which they can hold it, or the angular speed (contact.placement.angular_speed)",
                    next.angular_speed, seen[0], seen[1]
                )));
            }
            near = next;
            step *= 2.0;
            if changed < NEAR {
                step = step.clamp(-STEP * start, STEP * start);
            }
        };
        // The end that stays has half its weight from the second time on.
        let mut weight = near.sum;
        for _ in 0..MOST_STEPS {
            let between = (weight * far.angular_speed - far.sum * near.angular_speed) / (weight - far.sum);
            let next = self.at(between, given, Some(&far.solution))?;
            if is_found(&next) {
                return Ok(next);
            }
            if next.sum * far.sum < 0.0 {
                near = std::mem::replace(&mut far, next);
                weight = near.sum;
            } else {
                far = next;
                weight *= 0.5;
            }
        }
        Err(Error::NotConverged(format!(
            "contact.torque: no angular speed of the axle was found at which the creep forces balance {given} N m: \
             {:.3e} N m are left at {} rad/s",
            far.sum, far.angular_speed
        )))
    }
}
