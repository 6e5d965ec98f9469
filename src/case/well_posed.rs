//! How long the memory of friction must be for a contact to be well-posed: said where it is long enough, refused
//! where it is not.

use crate::contact::{SlidingProblem, SteadyProblem};
use crate::friction::FrictionLaw;
use crate::model::CoupledModel;
use crate::output::{ResultFile, Table};
use crate::stability::reduced::sharpness;
use crate::summary::Summary;
use crate::{Error, Result};

/// Place of the law in a job.
const PATH: &str = "contact.friction";
/// Relative accuracy of the smallest sound length.
const ACCURACY: f64 = 1e-8;

/// The smallest sound length of the memory of `law`, m: where `sharpness`, which a contact has with the law it is
/// given, is 1. 0 where every length is sound. The sharpness falls with the length at least as fast as its inverse
/// but for what a longer memory adds, the coefficient at rest carried farther into the contact.
pub(crate) fn smallest(law: &FrictionLaw, mut sharpness: impl FnMut(&FrictionLaw) -> Result<f64>) -> Result<f64> {
    let Some(memory) = law.memory() else { return Ok(0.0) };
    // Lengths with the ones that they would need: a memory is sound where it is longer than it needs.
    let mut needed = |length: f64| Ok::<f64, Error>(length * sharpness(&law.remembering(length))?);
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
        law.memory_key(PATH),
        last.0
    )))
}

/// Refuses a memory that is too short: `sharpness` is what a contact has with a law.
pub(crate) fn refuse_short(law: &FrictionLaw, mut sharpness: impl FnMut(&FrictionLaw) -> Result<f64>) -> Result<()> {
    let Some(memory) = law.memory() else { return Ok(()) };
    if sharpness(law)? < 1.0 {
        return Ok(());
    }
    let smallest = smallest(law, sharpness)?;
    Err(Error::Job(format!(
        "{}: found {} m, expected more than {smallest:.4e} m: over a shorter length of sliding this contact, \
         which is {law}, runs away \
         from any state at once, which is no squeal; give a longer memory",
        law.memory_key(PATH),
        memory.length
    )))
}

/// The sharpness of a contact that slides with the friction `law`.
pub(crate) fn sliding(problem: &SlidingProblem, law: &FrictionLaw, pair: &CoupledModel) -> Result<f64> {
    let problem = SlidingProblem { friction: law.clone(), ..problem.clone() };
    sharpness(pair, &problem.contact(&problem.solve()?))
}

/// The sharpness of a contact that rolls steadily with the friction `law`.
pub(crate) fn rolling(problem: &SteadyProblem, law: &FrictionLaw, pair: &CoupledModel) -> Result<f64> {
    let problem = SteadyProblem { friction: law.clone(), ..problem.clone() };
    sharpness(pair, &problem.contact(&problem.solve()?))
}

/// Writes the smallest memory length for well-posedness, `smallest`, m, where the law has a memory.
pub(crate) fn say(law: &FrictionLaw, smallest: f64, file: &mut ResultFile, summary: &mut Summary) {
    let Some(memory) = law.memory() else { return };
    let text = "Length that the memory of friction must be longer than for the contact to be well-posed.";
    file.table(Table::scalar("/stability/smallest_memory_length", "m", text, smallest));
    let lengths = format!("{:.4} µm (minimum for well-posedness {:.4} µm)", 1e6 * memory.length, 1e6 * smallest);
    summary.value("friction memory length", lengths);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::Exponential;

    #[test]
    fn the_smallest_length_is_where_it_is_as_long_as_it_needs() {
        let law = FrictionLaw::from(Exponential::new(0.4, 0.2, 0.3));
        let length = |law: &FrictionLaw| law.memory().unwrap().length;
        // A need of 3 µm for short memories that grows to 12 µm for long ones.
        let needed = |d: f64| 3e-6 + 9e-6 * d / (d + 2e-5);
        for given in [1e-7, 4e-6, 2e-5, 1e-3] {
            let law = law.remembering(given);
            let found = smallest(&law, |law| Ok(needed(length(law)) / length(law))).unwrap();
            assert!((needed(found) - found).abs() < 1e-7 * found, "from {given}: {found:e}");
            let refused = refuse_short(&law, |law| Ok(needed(length(law)) / length(law)));
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
        assert_eq!(smallest(&law, |_| Ok(0.0)).unwrap(), 0.0);
        assert_eq!(smallest(&FrictionLaw::Constant(0.3), |_| Ok(2.0)).unwrap(), 0.0);
    }
}
