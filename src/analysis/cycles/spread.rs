//! Work items spread over the ranks.

use super::search::is_local;
use crate::parallel::World;
use crate::{Error, Result};

/// Result of an item: its numbers, or why there are none.
pub(super) type Item = std::result::Result<Vec<f64>, String>;

/// Collective: the results of `count` items, on every rank; none of those that were not done. Item i is done by the
/// rank i modulo their number, in order; `work` returns none to stop.
pub(super) fn spread(
    world: &World,
    count: usize,
    mut work: impl FnMut(usize) -> Result<Option<Vec<f64>>>,
) -> Result<Vec<Option<Item>>> {
    let mut mine = Vec::new();
    let mut own = || -> Result<()> {
        for item in (world.rank..count).step_by(world.size) {
            let (kind, numbers) = match work(item) {
                Ok(Some(numbers)) => (0.0, numbers),
                Ok(None) => return Ok(()),
                Err(e) if is_local(&e) => (1.0, e.to_string().bytes().map(f64::from).collect()),
                Err(e) => return Err(e),
            };
            mine.extend([item as f64, kind, numbers.len() as f64]);
            mine.extend(numbers);
        }
        Ok(())
    };
    let done = own();
    world.agree(done)?;
    let all = world.all_gather(&mine);
    let torn = || Error::Defect("limit cycles were torn on their way".into());
    let mut found: Vec<Option<Item>> = vec![None; count];
    let mut rest = &all[..];
    while let [item, kind, length, after @ ..] = rest {
        let (numbers, after) = after.split_at_checked(*length as usize).ok_or_else(torn)?;
        let text = || String::from_utf8_lossy(&numbers.iter().map(|b| *b as u8).collect::<Vec<u8>>()).into_owned();
        *found.get_mut(*item as usize).ok_or_else(torn)? =
            Some(if *kind == 0.0 { Ok(numbers.to_vec()) } else { Err(text()) });
        rest = after;
    }
    Ok(found)
}
