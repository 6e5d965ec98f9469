//! Modes that a body has found serve another one of the same section that is touched elsewhere on it: a sweep over
//! places finds them once.

use super::{rail, swept};
use crate::parallel::World;
use crate::swept::LOADS;
use std::rc::Rc;

/// Modes of a body, and of what they are.
#[derive(Clone)]
pub enum CachedModes {
    /// Modes of a rail.
    Rail(Rc<rail::RailSpectrum>),
    /// Modes of a body of revolution.
    Swept(Rc<swept::ModeSpectrum>),
}

/// Collective: what the contact sees of the modes of each of as many orders as there are `counts` of modes; `of`
/// tells it of one of them, which one rank does.
pub(super) fn by_ranks(
    world: &World,
    counts: &[usize],
    of: impl Fn(usize) -> Vec<[f64; LOADS]>,
) -> Vec<Vec<[f64; LOADS]>> {
    let mine = (world.rank..counts.len()).step_by(world.size).flat_map(of).collect::<Vec<_>>();
    let all = world.all_gather(mine.as_flattened());
    let mut rest = &all[..];
    let mut found = vec![Vec::new(); counts.len()];
    for k in (0..world.size).flat_map(|rank| (rank..counts.len()).step_by(world.size)) {
        let (own, others) = rest.split_at(LOADS * counts[k]);
        found[k] = own.chunks_exact(LOADS).map(|row| std::array::from_fn(|c| row[c])).collect();
        rest = others;
    }
    found
}
