//! The primal–dual active set for Signorini's law (M. Hintermüller, K. Ito and K. Kunisch, SIAM J. Optim. 13 (2002)):
//! the pressures that close the gaps of a set of nodes say which of them pull, the gaps of the others which of those
//! penetrate; the next set leaves the first out and takes the second in.

/// The closed nodes and what was found for them; or, where they do not settle, how many changed each time.
pub(crate) type Settled<T> = Result<(Vec<usize>, T), Vec<usize>>;

/// Repeats `press` until the set of closed nodes (ascending) settles, at most `limit` times. `press` is given the
/// set, may amend it, and returns the next one, ascending, with what it found.
pub(crate) fn settle<T, E>(
    mut closed: Vec<usize>,
    limit: usize,
    mut press: impl FnMut(&mut Vec<usize>) -> Result<(Vec<usize>, T), E>,
) -> Result<Settled<T>, E> {
    let mut history = Vec::new();
    for _ in 0..limit {
        let (next, found) = press(&mut closed)?;
        if next == closed {
            return Ok(Ok((closed, found)));
        }
        let left = closed.iter().filter(|i| next.binary_search(i).is_err()).count();
        // Those that left, and those that came.
        history.push(2 * left + next.len() - closed.len());
        closed = next;
    }
    Ok(Err(history))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_that_wanders_is_told_and_one_that_stays_is_found() {
        let walk = |closed: &mut Vec<usize>| {
            Ok::<_, ()>((closed.iter().map(|i| (i + 1).min(5)).collect::<Vec<_>>(), closed.len()))
        };
        assert_eq!(settle(vec![2], 10, walk), Ok(Ok((vec![5], 1))));
        assert_eq!(settle(vec![2], 3, walk), Ok(Err(vec![2, 2, 2])));
        let none = |_: &mut Vec<usize>| Err::<(Vec<usize>, ()), _>("no");
        assert_eq!(settle(vec![2], 3, none), Err("no"));
    }
}
