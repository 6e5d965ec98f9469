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
//! forces rise with the creep: a solution is looked for on this side.

use super::interface::at_rest;
use super::wheel_rail_geometry::{with_motions, PlacedContact};
use crate::contact::{PatchResultant, SteadySolution};
use crate::grid::Interface;
use crate::job::{self, Job};
use crate::model::CoupledModel;
use crate::parallel::World;
use crate::{Error, Result};

/// Torque that may be left, over the sum of μ N r of all contacts.
const BALANCED: f64 = 1e-9;

/// Change of the angular speed that the search begins with, for a torque of μ N r: a creepage near that of saturation.
const SATURATION: f64 = 0.003;

/// Largest change of the angular speed that is looked at.
const FARTHEST: f64 = 0.3;

/// Largest number of steps between two angular speeds on either side of the solution.
const MOST_STEPS: usize = 60;

/// The contacts of an axle.
struct Axle<'a> {
    job: &'a Job,
    model: (&'a Interface, &'a CoupledModel),
    placed: Vec<PlacedContact>,
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
    /// That of the contacts, N m.
    contacts: f64,
}

/// Torque of the rails on the axle of `job`, N m, by the `patches` of steady rolling. For one rank.
pub(crate) fn of_contacts(job: &Job, patches: &[PatchResultant]) -> Result<f64> {
    torque(&PlacedContact::all(job)?, angular_speed(job)?, patches)
}

/// Σ T_c at an angular speed, N m.
fn torque(placed: &[PlacedContact], angular_speed: f64, patches: &[PatchResultant]) -> Result<f64> {
    let mut sum = 0.0;
    for (one, patch) in placed.iter().zip(patches) {
        let [x, y, spin] = slip_rate(one, angular_speed)?;
        sum += patch.force[0] * x + patch.force[1] * y + patch.moment_z * spin;
    }
    Ok(sum)
}

/// ∂(V ξ, V η, V φ)/∂Ω of a contact, from differences of what is linear in Ω.
fn slip_rate(placed: &PlacedContact, angular_speed: f64) -> Result<[f64; 3]> {
    let slip = |of: f64| {
        let c = placed.at_angular_speed(of)?;
        Ok([c.longitudinal, c.lateral, c.spin].map(|creepage| c.speed * creepage))
    };
    let (here, there) = (slip(angular_speed)?, slip(1.5 * angular_speed)?);
    Ok([0, 1, 2].map(|k| (there[k] - here[k]) / (0.5 * angular_speed)))
}

/// Angular speed of the axle of a job, rad/s.
fn angular_speed(job: &Job) -> Result<f64> {
    let missing = || Error::Defect("the torque on the axle of a job without a placement".into());
    let (contact, placement) = (job.contact.as_ref().ok_or_else(missing)?, job.placement().ok_or_else(missing)?);
    Ok(placement.angular_speed.unwrap_or(placement.speed.unwrap_or(contact.speed) / placement.radius))
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
    match job.contact.as_ref().and_then(|contact| contact.torque) {
        Some(torque) => Axle { job, model, placed: PlacedContact::all(job)? }.under(torque).map(Some),
        None => Ok(None),
    }
}

impl Axle<'_> {
    /// Steady rolling at an angular speed, begun with that at another one.
    fn at(&self, angular_speed: f64, torque_given: f64, before: Option<&SteadySolution>) -> Result<RollingAxle> {
        let mut motions = Vec::new();
        for one in &self.placed {
            motions.extend(one.motion_with(&one.at_angular_speed(angular_speed)?));
        }
        let job = rolling_at(self.job, angular_speed, &motions)?;
        let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("an axle without contacts".into()))?;
        let solution = at_rest(self.model, contact, job.analyses.steady.as_ref()).solve_from(before)?;
        let contacts = torque(&self.placed, angular_speed, &solution.patches)?;
        Ok(RollingAxle { angular_speed, job, solution, sum: torque_given + contacts, contacts })
    }

    /// Σ μ N r of the contacts, N m.
    fn scale(&self, at: &RollingAxle) -> Result<f64> {
        let mut sum = 0.0;
        let contacts = at.job.contact.iter().flat_map(job::Contact::all);
        for ((placed, patch), contact) in self.placed.iter().zip(&at.solution.patches).zip(contacts) {
            let [rate, ..] = slip_rate(placed, at.angular_speed)?;
            sum += contact.law().coefficient(0.0) * patch.force[2].abs() * rate.abs();
        }
        Ok(sum)
    }

    /// The axle under a torque, N m: from the job's angular speed by steps that double to one on the other side, then
    /// by regula falsi of the Illinois kind.
    fn under(&self, torque: f64) -> Result<RollingAxle> {
        let start = angular_speed(self.job)?;
        let mut near = self.at(start, torque, None)?;
        let scale = self.scale(&near)?;
        let is_found = |at: &RollingAxle| at.sum.abs() <= BALANCED * scale;
        if is_found(&near) {
            return Ok(near);
        }
        // More torque than the contacts bear makes the axle turn faster.
        let mut step = SATURATION * start * (near.sum / scale).clamp(-1.0, 1.0);
        let mut seen = [near.contacts; 2];
        let mut far = loop {
            let next = self.at(near.angular_speed + step, torque, Some(&near.solution))?;
            seen = [seen[0].min(next.contacts), seen[1].max(next.contacts)];
            if is_found(&next) {
                return Ok(next);
            }
            if next.sum * near.sum < 0.0 {
                break next;
            }
            if (next.angular_speed / start - 1.0).abs() > FARTHEST {
                return Err(Error::Job(format!(
                    "contact.torque: found {torque} N m, which the creep forces do not balance: between {start:.3} and \
                     {:.3} rad/s the contacts exert from {:.0} to {:.0} N m on the axle; give a torque against which \
                     they can hold it, or the angular speed (contact.placement.angular_speed)",
                    next.angular_speed, seen[0], seen[1]
                )));
            }
            near = next;
            step *= 2.0;
        };
        // The end that stays has half its weight from the second time on.
        let mut weight = near.sum;
        for _ in 0..MOST_STEPS {
            let between = (weight * far.angular_speed - far.sum * near.angular_speed) / (weight - far.sum);
            let next = self.at(between, torque, Some(&far.solution))?;
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
            "contact.torque: no angular speed of the axle was found at which the creep forces balance {torque} N m: \
             {:.3e} N m are left at {} rad/s",
            far.sum, far.angular_speed
        )))
    }
}
