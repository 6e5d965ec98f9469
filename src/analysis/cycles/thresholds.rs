//! Thresholds of squeal in words: where it starts by itself, how far it persists, and the push that starts it between.

use crate::cycles::{BranchEnd, BranchPoint, Special, SpecialKind};
use crate::output::datasets::branches::{OneBranch, Onset};

/// A range of the key where rest is stable and squeal goes on once it was started.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Persistence {
    /// Number of the branch.
    pub(super) branch: usize,
    /// The threshold of rest.
    pub(super) onset: Onset,
    /// Value of the key to which stable cycles persist, and why no farther.
    pub(super) to: f64,
    pub(super) bound: Option<SpecialKind>,
    /// Value of the key and amplitude, m/s, of the velocity at the rim of the unstable cycle there: the push.
    pub(super) push: Option<[f64; 2]>,
}

/// The ranges of all thresholds of rest, branch by branch.
pub(super) fn persistence(branches: &[OneBranch], onsets: &[Onset], watch: &[Vec<f64>]) -> Vec<Persistence> {
    let mut all = Vec::new();
    for (branch, one) in branches.iter().enumerate() {
        for onset in onsets.iter().filter(|o| o.mode == 0) {
            all.extend(of_branch(branch, one, onset, watch));
        }
    }
    all
}

fn of_branch(branch: usize, one: &OneBranch, onset: &Onset, watch: &[Vec<f64>]) -> Option<Persistence> {
    // Away from the side where rest is unstable.
    let beyond = |key: f64| if onset.above { onset.key - key } else { key - onset.key };
    let stable = |p: &BranchPoint| p.multipliers.as_ref().is_some_and(|m| m.is_stable());
    // Stable cycles, and the points where they cease to be, that are connected with the unstable side of rest.
    let mut runs: Vec<Vec<usize>> = vec![Vec::new()];
    for (k, p) in one.points.iter().enumerate() {
        if stable(p) || bounds(p).is_some() {
            if let Some(run) = runs.last_mut() {
                run.push(k);
            }
        }
        if !stable(p) {
            runs.push(if bounds(p).is_some() { vec![k] } else { Vec::new() });
        }
    }
    let reaches = |run: &&Vec<usize>| run.iter().any(|&k| stable(&one.points[k]) && beyond(one.points[k].key) <= 0.0);
    let run = runs.iter().filter(reaches).max_by_key(|run| run.len())?;
    let end = run.iter().copied().max_by(|&a, &b| beyond(one.points[a].key).total_cmp(&beyond(one.points[b].key)))?;
    // A branch that ends at rest ends at the threshold: its last cycle may lie a little beyond, by the error of the
    // time step.
    let sides = [(0, &one.ends[0]), (one.points.len() - 1, &one.ends[1])];
    let at_rest = sides.iter().any(|(place, why)| *place == end && **why == BranchEnd::Rest.text());
    let to = if at_rest { onset.key } else { one.points[end].key };
    if beyond(to) <= 0.0 {
        return Some(Persistence { branch, onset: *onset, to, bound: None, push: None });
    }
    let push = push_at(one, 0.5 * (to + onset.key), watch);
    Some(Persistence { branch, onset: *onset, to, bound: bounds(&one.points[end]).map(|s| s.kind), push })
}

/// The special point `p` if a cycle loses its stability there.
fn bounds(p: &BranchPoint) -> Option<Special> {
    p.special.filter(|s| !matches!(s.kind, SpecialKind::Stick | SpecialKind::Opening))
}

/// The value `key` and the amplitude of the velocity of the smallest unstable cycle there, between two of a branch.
fn push_at(one: &OneBranch, key: f64, watch: &[Vec<f64>]) -> Option<[f64; 2]> {
    let unstable = |p: &BranchPoint| p.multipliers.as_ref().is_some_and(|m| !m.is_stable()) || bounds(p).is_some();
    let pairs = one.points.windows(2).filter(|ends| {
        let [a, b] = [ends[0].key, ends[1].key];
        unstable(&ends[0]) && unstable(&ends[1]) && a != b && (key - a) * (b - key) >= 0.0
    });
    let at = pairs.map(|ends| {
        let part = (key - ends[0].key) / (ends[1].key - ends[0].key);
        let [a, b] = [0, 1].map(|k| rim_velocity(&ends[k], watch));
        a + part * (b - a)
    });
    at.min_by(f64::total_cmp).map(|v| [key, v])
}

/// Amplitude of the velocity of the body that moves faster at the middle of the contact, m/s.
pub(super) fn rim_velocity(point: &BranchPoint, watch: &[Vec<f64>]) -> f64 {
    let squares: Vec<f64> = watch.iter().map(|row| point.cycle.velocity(row).powi(2)).collect();
    let body = |rows: &[f64]| (2.0 * rows.iter().sum::<f64>()).sqrt();
    squares.chunks(3).map(body).fold(0.0, f64::max)
}
