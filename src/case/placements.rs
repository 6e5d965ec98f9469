//! Placements of many jobs, spread over the ranks.

use super::curving::needs_equilibrium;
use super::wheel_rail_geometry::{filled, motions, with_motions};
use crate::job::{ContactPlaces, ContactWheels, Job};
use crate::parallel::World;
use crate::Result;

/// Returns whether the contacts of a job are those that it gives: none follows from a vehicle, from a vertical load or
/// from the other wheel.
fn has_its_contacts(job: &Job) -> bool {
    let Some(contact) = &job.contact else { return true };
    !needs_equilibrium(job) && contact.places != ContactPlaces::All && contact.wheels == ContactWheels::One
}

/// Collective: each of `jobs` with the creepages that follow from its placement, or none without one, as [`filled`] has
/// it; or the error of its placement.
pub(crate) fn all_filled(world: &World, jobs: &[Job]) -> Vec<Result<Option<Job>>> {
    // The number of a job's motions and these; −1 where all ranks look at it together, as where it has an error.
    let of = |job: &Job| -> Vec<f64> {
        let own = match has_its_contacts(job) {
            true if job.placement().is_none() => Some(Vec::new()),
            true => motions(job).ok(),
            false => None,
        };
        own.map_or(vec![-1.0], |own| [vec![own.len() as f64], own].concat())
    };
    let mine = &jobs[world.share(jobs.len())];
    let all = world.all_gather(&mine.iter().flat_map(of).collect::<Vec<f64>>());
    let mut rest = &all[..];
    let next = |job: &Job| {
        let count = rest.first().copied().unwrap_or(-1.0);
        let end = (1 + count.max(0.0) as usize).min(rest.len());
        let own = &rest[1.min(end)..end];
        rest = &rest[end..];
        if count >= 0.0 {
            with_motions(job, own)
        } else {
            filled(world, job)
        }
    };
    jobs.iter().map(next).collect()
}
