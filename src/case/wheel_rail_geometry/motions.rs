//! Creepages, speeds and angles of the contacts of a job, as its placement gives them.

use super::PlacedContact;
use crate::job::{self, Job};
use crate::parallel::World;
use crate::{Error, Result};

/// Collective: the job with the creepages that follow from its placement; none of a job without one.
pub(crate) fn filled(world: &World, job: &Job) -> Result<Option<Job>> {
    let mut settled = job.clone();
    crate::case::curving::settle(world, &mut settled)?;
    crate::case::contact_places::settle(world, &mut settled)?;
    if settled.placement().is_none() {
        return Ok(None);
    }
    let found = world.on_root(|| motions(&settled))?;
    with_motions(&settled, &world.broadcast(found.unwrap_or_default()))
}

/// Creepages, speed and angles of each contact of `job`, six numbers each ([`PlacedContact::motion`]). For one rank.
pub(in crate::case) fn motions(job: &Job) -> Result<Vec<f64>> {
    Ok(PlacedContact::all(job)?.iter().flat_map(PlacedContact::motion).collect())
}

/// The job with these [`motions`]; none of a job without a placement.
pub(in crate::case) fn with_motions(job: &Job, found: &[f64]) -> Result<Option<Job>> {
    let (Some(contact), Some(_)) = (&job.contact, job.placement()) else { return Ok(None) };
    let mut all = contact.all().zip(found.chunks_exact(6)).map(|(one, motion)| {
        let motion = [0, 1, 2, 3, 4, 5].map(|i| motion[i]);
        PlacedContact::filled(&job::Contact { further: Vec::new(), ..one.clone() }, motion)
    });
    let first = all.next().ok_or_else(|| Error::Defect("a placement without a contact".into()))?;
    let filled = Job { contact: Some(job::Contact { further: all.collect(), ..first }), ..job.clone() };
    // The slip is known only now.
    job::range(&filled)?;
    Ok(Some(filled))
}
