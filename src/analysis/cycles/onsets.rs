//! Thresholds of rest: values of the key at which the growth rate of a mode is zero.

use super::search::{is_local, Clock, Search};
use super::spread::spread;
use super::stored_branches::StoredBranches;
use super::LOCATED;
use crate::output::datasets::branches::Onset;
use crate::parallel::World;
use crate::progress::Progress;
use crate::Result;

/// Values of the key at which rest is looked at.
const LOOKS: usize = 17;
/// Modes whose thresholds are sought, by falling growth rate.
const MODES: usize = 8;

/// Growth rate, 1/s, and frequency, Hz.
type Growth = [f64; 2];

/// Collective: all thresholds between the ends of the range, by the rank of the mode and then by the key.
pub(super) fn all(
    search: &Search<'_>,
    world: &World,
    (kept, clock): (&StoredBranches, &Clock<'_>),
    progress: &mut Progress,
) -> Result<Vec<Onset>> {
    if let Some(found) = kept.onsets(world)? {
        return Ok(found);
    }
    let (from, to) = (search.wanted.from, search.wanted.to);
    let value = |look: usize| from + (to - from) * look as f64 / (LOOKS - 1) as f64;
    clock.start_step();
    let looks = spread(world, LOOKS, |look| {
        progress.step("stability of rest", look, LOOKS);
        let found = growths(search, value(look))?.map(|g| g.into_flattened());
        Ok(clock.goes_on().then(|| found.unwrap_or_default()))
    })?;
    let looks: Vec<Vec<Growth>> = looks
        .into_iter()
        .map(|l| l.and_then(|l| l.ok()).unwrap_or_default().chunks_exact(2).map(|c| [c[0], c[1]]).collect())
        .collect();
    // Where fewer modes are told the others decay faster than any that is.
    let of = |look: usize, mode: usize| looks[look].get(mode).copied();
    let mut brackets = Vec::new();
    for mode in 0..MODES {
        for look in 1..LOOKS {
            let ends = [of(look - 1, mode), of(look, mode)];
            let told = !looks[look - 1].is_empty() && !looks[look].is_empty();
            if told && (ends[0].is_some_and(|g| g[0] > 0.0)) != (ends[1].is_some_and(|g| g[0] > 0.0)) {
                let known = |end: Option<Growth>| end.unwrap_or([f64::NEG_INFINITY, 0.0]);
                brackets.push((mode, (value(look - 1), known(ends[0])), (value(look), known(ends[1]))));
            }
        }
    }
    let found = spread(world, brackets.len(), |k| {
        let (mode, low, high) = brackets[k];
        let onset = one(search, mode, low, high)?;
        let numbers = onset.map_or(Vec::new(), |o| o.numbers().to_vec());
        Ok(clock.goes_on().then_some(numbers))
    })?;
    let found: Vec<Onset> = found.iter().flatten().flatten().filter_map(|n| Onset::from_numbers(n)).collect();
    if world.max(f64::from(u8::from(clock.is_over()))) == 0.0 {
        kept.keep_onsets(world, &found)?;
    }
    Ok(found)
}

/// The growth rates at a value of the key; none where the model does not hold.
fn growths(search: &Search<'_>, key: f64) -> Result<Option<Vec<Growth>>> {
    match search.growth(key) {
        Ok(found) => Ok(Some(found.into_iter().map(|g| g.0).take(MODES).collect())),
        Err(e) if is_local(&e) => Ok(None),
        Err(e) => Err(e),
    }
}

/// The zero of the growth rate of the mode of the rank `mode` between two values of the key: secants, halving where
/// they do not gain.
fn one(search: &Search<'_>, mode: usize, mut low: (f64, Growth), mut high: (f64, Growth)) -> Result<Option<Onset>> {
    let above = high.1[0] > 0.0;
    let close = LOCATED * (search.wanted.to - search.wanted.from);
    for round in 0..60 {
        if high.0 - low.0 <= close {
            break;
        }
        let secant = low.0 - low.1[0] * (high.0 - low.0) / (high.1[0] - low.1[0]);
        // A secant that lands beside the zero leaves most of the bracket: the other end follows it closely.
        let part = (secant - low.0) / (high.0 - low.0);
        let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.5 };
        let near = 0.4 * close / (high.0 - low.0);
        let part = match round % 3 {
            0 => part - near,
            1 => part + near,
            _ => 0.5,
        };
        let key = low.0 + part.clamp(0.01 * near, 1.0 - 0.01 * near) * (high.0 - low.0);
        let Some(growth) = growths(search, key)? else { return Ok(None) };
        let growth = growth.get(mode).copied().unwrap_or([f64::NEG_INFINITY, 0.0]);
        match (growth[0] > 0.0) == (low.1[0] > 0.0) {
            true => low = (key, growth),
            false => high = (key, growth),
        }
    }
    let frequency = if above { high.1[1] } else { low.1[1] };
    Ok(Some(Onset { key: 0.5 * (low.0 + high.0), frequency, above, mode }))
}
