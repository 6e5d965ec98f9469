//! Special points of a branch in their order along it.

use super::branch::{BranchPoint, SpecialKind};

/// The cycles of a branch in one direction with its special points in their order along it. They are found after the
/// ordinary cycle that a step begins with, whatever the order within the step, and a fold also before it. `rank` is the
/// number of coefficients of the mean of the motion, which does not count as way along a branch.
pub fn in_order(points: Vec<BranchPoint>, rank: usize) -> Vec<BranchPoint> {
    let (special, ordinary): (Vec<_>, Vec<_>) = {
        let mut steps = 0;
        let numbered = points.into_iter().map(|p| {
            steps += usize::from(p.special.is_none());
            (steps.max(1) - 1, p)
        });
        numbered.partition(|(_, p)| p.special.is_some())
    };
    let ordinary: Vec<BranchPoint> = ordinary.into_iter().map(|(_, p)| p).collect();
    let mut steps: Vec<Vec<(f64, BranchPoint)>> = vec![Vec::new(); ordinary.len().max(1)];
    for (step, p) in special {
        let place = |step: usize| match ordinary.get(step..step + 2) {
            Some([a, b]) => part(&p.u[rank..], &a.u[rank..], &b.u[rank..]),
            _ => 0.0,
        };
        let is_fold = p.special.is_some_and(|s| s.kind == SpecialKind::Fold);
        match step.checked_sub(1).filter(|_| is_fold && place(step) < 0.0) {
            Some(before) => steps[before].push((place(before), p)),
            None => steps[step].push((place(step), p)),
        }
    }
    let mut all = Vec::new();
    let mut steps = steps.into_iter();
    for p in ordinary {
        all.push(p);
        let mut found = steps.next().unwrap_or_default();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.extend(found.into_iter().map(|(_, p)| p));
    }
    all
}

/// Place of `u` between `a` and `b`, of the way from one to the other.
fn part(u: &[f64], a: &[f64], b: &[f64]) -> f64 {
    let along = |u: &[f64]| u.iter().zip(a).zip(b).map(|((u, a), b)| (u - a) * (b - a)).sum::<f64>();
    along(u) / along(b).max(f64::MIN_POSITIVE)
}
