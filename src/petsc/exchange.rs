//! Values of vector entries that other ranks own.

use super::csr::{all_to_all, owner_of};
use crate::parallel::World;
use mpi::traits::*;

/// Plan of an exchange: who needs which of whose entries. Made once, used for every product.
#[derive(Debug, Clone)]
pub struct Exchange {
    ghosts: Vec<u64>,
    /// Rank and number of the ghosts it owns; together they are `ghosts` in order.
    receive: Vec<(i32, usize)>,
    /// Rank and the local rows it needs.
    send: Vec<(i32, Vec<u32>)>,
}

impl Exchange {
    /// Collective: the plan to fetch all of `columns` (global, any order, repetitions allowed) that are not in this
    /// rank's range.
    pub fn new(world: &World, ranges: &[u64], columns: impl IntoIterator<Item = u64>) -> Self {
        let own = ranges[world.rank]..ranges[world.rank + 1];
        let mut ghosts: Vec<u64> = columns.into_iter().filter(|c| !own.contains(c)).collect();
        ghosts.sort_unstable();
        ghosts.dedup();
        let mut wanted = vec![Vec::new(); world.size];
        for &g in &ghosts {
            wanted[owner_of(ranges, g)].push(g);
        }
        let counts: Vec<i32> = wanted.iter().map(|w| w.len() as i32).collect();
        let mut asked = vec![0i32; world.size];
        world.comm.all_to_all_into(&counts[..], &mut asked[..]);
        let rows = all_to_all(world, &wanted);
        let mut rows = rows.iter().map(|row| (row - own.start) as u32);
        let send =
            (0..world.size as i32).zip(&asked).map(|(rank, &n)| (rank, rows.by_ref().take(n as usize).collect()));
        let send = send.filter(|(_, rows): &(i32, Vec<u32>)| !rows.is_empty()).collect();
        let receive = (0..world.size as i32).zip(counts).filter(|(_, n)| *n > 0).map(|(r, n)| (r, n as usize));
        Self { receive: receive.collect(), send, ghosts }
    }

    /// Global numbers of the entries fetched, ascending.
    pub fn ghosts(&self) -> &[u64] {
        &self.ghosts
    }

    /// Collective: the ghosts' values of the distributed vector whose local part is `x`, in the order of
    /// [`Exchange::ghosts`].
    pub fn fetch<T: Equivalence + Copy + Default>(&self, world: &World, x: &[T]) -> Vec<T> {
        self.fetch_wide(world, x, 1)
    }

    /// Collective: as [`Exchange::fetch`] for `width` values of each entry, one behind the other.
    pub(crate) fn fetch_wide<T: Equivalence + Copy + Default>(&self, world: &World, x: &[T], width: usize) -> Vec<T> {
        let mut values = vec![T::default(); width * self.ghosts.len()];
        let entry = |&row: &u32| &x[row as usize * width..(row as usize + 1) * width];
        let outgoing: Vec<Vec<T>> =
            self.send.iter().map(|(_, rows)| rows.iter().flat_map(entry).copied().collect()).collect();
        mpi::request::multiple_scope(self.send.len() + self.receive.len(), |scope, requests| {
            let mut rest = &mut values[..];
            for &(rank, n) in &self.receive {
                let (part, tail) = rest.split_at_mut(width * n);
                rest = tail;
                requests.add(world.comm.process_at_rank(rank).immediate_receive_into(scope, part));
            }
            for ((rank, _), part) in self.send.iter().zip(&outgoing) {
                requests.add(world.comm.process_at_rank(*rank).immediate_send(scope, &part[..]));
            }
            let mut done = Vec::new();
            requests.wait_all(&mut done);
        });
        values
    }
}
