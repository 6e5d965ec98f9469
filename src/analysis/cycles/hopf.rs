//! Hopf points: on which side of a threshold of rest the small cycles lie.

use super::follow::{ALIKE, AT_REST};
use super::LOCATED;
use crate::cycles::{BranchEnd, BranchPoint};
use crate::output::datasets::branches::{Criticality, OneBranch, Onset};

/// Criticality of each of `onsets`, by the direction in which the branch that ends at rest there begins; unknown where
/// no branch does, and where it is vertical. `range` is the length of that of the key.
pub(super) fn criticality(onsets: &[Onset], branches: &[OneBranch], range: f64) -> Vec<Criticality> {
    let mut all = vec![Criticality::Unknown; onsets.len()];
    for branch in branches {
        let points = &branch.points;
        let ends = [(points.first(), points.get(1)), (points.last(), points.iter().rev().nth(1))];
        for (end, (last, before)) in branch.ends.iter().zip(ends) {
            let (Some(last), Some(before)) = (last, before) else { continue };
            if *end != BranchEnd::Rest.text() {
                continue;
            }
            let Some((place, rises)) = at_rest(onsets, [before, last], range) else { continue };
            if all[place] == Criticality::Unknown {
                all[place] = match rises == onsets[place].above {
                    true => Criticality::Supercritical,
                    false => Criticality::Subcritical,
                };
            }
        }
    }
    all
}

/// Place of the threshold where a branch whose two smallest cycles are given ends, the smallest one last; and true if
/// the key rises with the amplitude.
fn at_rest(onsets: &[Onset], [before, last]: [&BranchPoint; 2], range: f64) -> Option<(usize, bool)> {
    // The key changes with the square of the amplitude.
    let gain = before.cycle.kinetic - last.cycle.kinetic;
    let slope = (before.key - last.key) / gain;
    if !(gain > 0.0) || (before.key - last.key).abs() < LOCATED * range {
        return None;
    }
    let rest = last.key - slope * last.cycle.kinetic;
    let apart = |o: &Onset| (o.key - rest).abs();
    let near = |o: &Onset| apart(o) < AT_REST * range && (last.cycle.frequency / o.frequency - 1.0).abs() < 5.0 * ALIKE;
    let found = onsets.iter().enumerate().filter(|(_, o)| near(o)).min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)));
    found.map(|(place, _)| (place, slope > 0.0))
}
