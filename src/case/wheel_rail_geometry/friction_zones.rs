//! Zones of the rails with a friction of their own, in the words of the summary.

use super::PlacedContact;
use crate::job;

/// The friction at a `contact` of a job whose angle is known, in words; none of a job without zones.
pub(super) fn friction_text(contact: &job::Contact) -> Option<String> {
    let zone = contact
        .zone()
        .map_or("contact.friction, outside all zones".into(), |zone| format!("contact.friction_zones.{zone}"));
    (!contact.friction_zones.is_empty()).then(|| format!("friction {} of {zone}", contact.law()))
}

/// Number of the zone that holds a `contact` of a job whose angle is known, −1 outside all; none of a job without
/// zones.
pub(super) fn zone_number(contact: &job::Contact) -> Option<i32> {
    let number = contact.zone().and_then(|zone| i32::try_from(zone).ok()).unwrap_or(-1);
    (!contact.friction_zones.is_empty()).then_some(number)
}

/// A line for each zone of the `job` that holds none of its contacts.
pub(super) fn empty_zones(job: &job::Job, placed: &[PlacedContact]) -> Vec<String> {
    let zones = job.contact.as_ref().map_or(0, |contact| contact.friction_zones.len());
    let holds = |zone: usize, one: &PlacedContact| one.zone.is_some_and(|own| usize::try_from(own) == Ok(zone));
    let empty = (0..zones).filter(|&zone| !placed.iter().any(|one| holds(zone, one)));
    empty.map(|zone| format!("contact.friction_zones.{zone} holds none of the contacts examined")).collect()
}
