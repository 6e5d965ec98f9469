//! How long the memory of friction must be for a contact to be well-posed: said where it is long enough, refused
//! where it is not.

use super::interface::friction;
use crate::contact::{SlidingProblem, SteadyProblem};
use crate::friction::PatchFriction;
use crate::job;
use crate::model::CoupledModel;
use crate::output::{ResultFile, Table};
use crate::stability::reduced::sharpness;
use crate::summary::Summary;
use crate::{Error, Result};

/// Relative accuracy of the smallest sound length.
const ACCURACY: f64 = 1e-8;

/// Key in the job of the length of the first memory at the contacts of `contact`.
fn memory_key(contact: &job::Contact) -> String {
    let first = contact.all().enumerate().find(|(_, one)| one.law().memory().is_some());
    first.map_or(String::new(), |(number, one)| one.law().memory_key(&contact.law_key(number)))
}

/// The smallest sound length of the memory of friction at the contacts of `contact`, m: where `sharpness`, which a
/// contact has with the friction it is given, is 1. 0 where every length is sound. It is the length of the first law
/// that has a memory; those of the others go with it. The sharpness falls with the length at least as fast as its
/// inverse but for what a longer memory adds, the coefficient at rest carried farther into the contact.
pub(crate) fn smallest(
    contact: &job::Contact,
    mut sharpness: impl FnMut(&PatchFriction) -> Result<f64>,
) -> Result<f64> {
    let friction = friction(contact);
    let Some(memory) = friction.memory() else { return Ok(0.0) };
    // Lengths with the ones that they would need: a memory is sound where it is longer than it needs.
    let mut needed = |length: f64| Ok::<f64, Error>(length * sharpness(&friction.remembering(length))?);
    let mut last = (memory.length, needed(memory.length)?);
    let mut next = last.1;
    for _ in 0..50 {
        if next <= 0.0 {
            return Ok(0.0);
        }
        let now = (next, needed(next)?);
        if (now.1 - now.0).abs() <= ACCURACY * now.0 {
            return Ok(now.1);
        }
        // Where the line through the last two meets "as long as needed", or without such a place what the last needed.
        let slope = (now.1 - last.1) / (now.0 - last.0);
        let meeting = now.0 + (now.1 - now.0) / (1.0 - slope);
        next = if slope < 1.0 && meeting > 0.0 && meeting.is_finite() { meeting } else { now.1 };
        last = now;
    }
    Err(Error::NotConverged(format!(
        "{}: the smallest sound length was not found; the last ones tried were {:.6e} m and {next:.6e} m",
        memory_key(contact),
        last.0
    )))
}

/// Refuses memories that are too short: `sharpness` is what the contacts have with a friction.
pub(crate) fn refuse_short(
    contact: &job::Contact,
    mut sharpness: impl FnMut(&PatchFriction) -> Result<f64>,
) -> Result<()> {
    let friction = friction(contact);
    let Some(memory) = friction.memory() else { return Ok(()) };
    if sharpness(&friction)? < 1.0 {
        return Ok(());
    }
    let smallest = smallest(contact, sharpness)?;
    let law = friction.laws().find(|law| law.memory().is_some()).map_or(String::new(), ToString::to_string);
    let others = if friction.only().is_none() { ", with the lengths of other laws in proportion" } else { "" };
    Err(Error::Job(format!(
        "{}: found {} m, expected more than {smallest:.4e} m{others}: over a shorter length of sliding this contact, \
         which is {law}, runs away \
         from any state at once, which is no squeal; give a longer memory",
        memory_key(contact),
        memory.length
    )))
}

/// The sharpness of a contact that slides with the friction `friction`.
pub(crate) fn sliding(problem: &SlidingProblem, friction: &PatchFriction, pair: &CoupledModel) -> Result<f64> {
    let problem = SlidingProblem { friction: friction.clone(), ..problem.clone() };
    sharpness(pair, &problem.contact(&problem.solve()?))
}

/// The sharpness of a contact that rolls steadily with the friction `friction`.
pub(crate) fn rolling(problem: &SteadyProblem, friction: &PatchFriction, pair: &CoupledModel) -> Result<f64> {
    let problem = SteadyProblem { friction: friction.clone(), ..problem.clone() };
    sharpness(pair, &problem.contact(&problem.solve()?))
}

/// Writes the smallest memory length for well-posedness, `smallest`, m, where friction has a memory.
pub(crate) fn say(contact: &job::Contact, smallest: f64, file: &mut ResultFile, summary: &mut Summary) {
    let Some(memory) = friction(contact).memory() else { return };
    let text = "Length that the memory of friction must be longer than for the contact to be well-posed.";
    file.table(Table::scalar("/stability/smallest_memory_length", "m", text, smallest));
    let lengths = format!("{:.4} µm (minimum for well-posedness {:.4} µm)", 1e6 * memory.length, 1e6 * smallest);
    summary.value("friction memory length", lengths);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{Exponential, FrictionLaw, FrictionZone};
    use crate::job::example;

    #[test]
    fn the_smallest_length_is_where_it_is_as_long_as_it_needs() {
        let contact = |law: FrictionLaw| {
            let mut contact = example::wheel_on_rail(&[]).contact.unwrap();
            contact.friction = law;
            contact
        };
        let law = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.3));
        let length = |friction: &PatchFriction| friction.memory().unwrap().length;
        // A need of 3 µm for short memories that grows to 12 µm for long ones.
        let needed = |d: f64| 3e-6 + 9e-6 * d / (d + 2e-5);
        for given in [1e-7, 4e-6, 2e-5, 1e-3] {
            let rubbing = contact(law.remembering(given));
            let found = smallest(&rubbing, |f| Ok(needed(length(f)) / length(f))).unwrap();
            assert!((needed(found) - found).abs() < 1e-7 * found, "from {given}: {found:e}");
            let refused = refuse_short(&rubbing, |f| Ok(needed(length(f)) / length(f)));
            assert_eq!(refused.is_err(), given < found, "{given}");
            if let Err(e) = refused {
                let text = e.to_string();
                let value = format!("expected more than {found:.4e} m");
                assert!(
                    e.exit_code() == 2
                        && text.contains("contact.friction.exponential.memory_length")
                        && text.contains(&value),
                    "{text}"
                );
            }
        }
        assert_eq!(smallest(&contact(law), |_| Ok(0.0)).unwrap(), 0.0);
        assert_eq!(smallest(&contact(FrictionLaw::Constant(0.3)), |_| Ok(2.0)).unwrap(), 0.0);
    }

    /// A tread without memory and a gauge face with one: it is that of the gauge face that is too short.
    #[test]
    fn the_memory_of_a_zone_is_named_by_its_key() {
        let mut contact = example::wheel_on_rail(&[]).contact.unwrap();
        let friction = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.3)).remembering(1e-6);
        contact.friction_zones = vec![FrictionZone { rail: None, from_angle: Some(0.5), friction }];
        let steep = if contact.side() == job::TrackSide::Right { -1.2 } else { 1.2 };
        contact.further = vec![job::Contact { touch_angle: steep, ..contact.clone() }];
        let refused = refuse_short(&contact, |f| Ok(4e-6 / f.memory().unwrap().length)).unwrap_err().to_string();
        assert!(
            refused.starts_with("contact.friction_zones.0.friction.exponential.memory_length: found 0.000001 m")
                && refused.contains("with the lengths of other laws in proportion"),
            "{refused}"
        );
    }
}
