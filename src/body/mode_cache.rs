//! Modes that a body has found serve another one of the same section that is touched elsewhere on it: a sweep over
//! places finds them once.

use super::{rail, swept};
use crate::parallel::World;
use faer::Mat;
use std::rc::Rc;

/// Modes of a body, and of what they are.
#[derive(Clone)]
pub enum CachedModes {
    /// Modes of a rail.
    Rail(Rc<rail::RailSpectrum>),
    /// Modes of a body of revolution.
    Swept(Rc<swept::ModeSpectrum>),
}

/// Collective: what the contacts see of the modes of each of as many orders as there are `counts` of modes, by `rows`
/// numbers each, `[rows, count]`; `of` tells it of one of them, which one rank does.
pub(super) fn by_ranks(world: &World, counts: &[usize], rows: usize, of: impl Fn(usize) -> Mat<f64>) -> Vec<Mat<f64>> {
    let numbers = |k: usize| {
        let seen = of(k);
        (0..rows * counts[k]).map(|i| seen[(i % rows, i / rows)]).collect::<Vec<f64>>()
    };
    let mine = (world.rank..counts.len()).step_by(world.size).flat_map(numbers).collect::<Vec<_>>();
    let all = world.all_gather(&mine);
    let mut rest = &all[..];
    let mut found = vec![Mat::zeros(rows, 0); counts.len()];
    for k in (0..world.size).flat_map(|rank| (rank..counts.len()).step_by(world.size)) {
        let (own, others) = rest.split_at(rows * counts[k]);
        found[k] = Mat::from_fn(rows, counts[k], |i, j| own[i + rows * j]);
        rest = others;
    }
    found
}
