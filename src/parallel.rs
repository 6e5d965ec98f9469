//! The world of ranks: agreement on errors, gathers and scatters that the stages share.

use crate::scratch::Scratch;
use crate::{Error, Result};
use mpi::collective::SystemOperation;
use mpi::topology::SimpleCommunicator;
use mpi::traits::*;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Tag of the message by which a rank tells rank 0 of its wish.
const WISH: i32 = 77;

/// Time for which a rank that waits asks again and again, and its longest sleep after that.
const BUSY: Duration = Duration::from_micros(200);
const LONGEST: Duration = Duration::from_millis(2);

/// All ranks of the run.
pub struct World {
    /// The communicator of all ranks.
    pub comm: SimpleCommunicator,
    /// This rank, `0..size`.
    pub rank: usize,
    /// Number of ranks.
    pub size: usize,
    /// Folder in which this rank keeps the factors of matrices; none: in memory.
    pub scratch: OnceLock<Scratch>,
}

impl World {
    /// Wraps the world communicator of an initialised MPI.
    pub fn new(comm: SimpleCommunicator) -> Self {
        let rank = comm.rank() as usize;
        let size = comm.size() as usize;
        Self { comm, rank, size, scratch: OnceLock::new() }
    }

    /// True on rank 0, which reads, writes and does the dense work.
    pub fn is_root(&self) -> bool {
        self.rank == 0
    }

    /// Collective: `Ok` if `local` is `Ok` on every rank; otherwise the error of the lowest failing rank, on every
    /// rank. Every fallible local step ends in one, so that no rank goes on into a collective call the others never
    /// reach.
    pub fn agree<T>(&self, local: Result<T>) -> Result<T> {
        let mine = if local.is_err() { self.rank as i32 } else { i32::MAX };
        let mut first = 0i32;
        self.comm.all_reduce_into(&mine, &mut first, SystemOperation::min());
        if first == i32::MAX {
            return local;
        }
        let root = self.comm.process_at_rank(first);
        let (mut code, mut text) = match &local {
            Err(e) if self.rank as i32 == first => (e.exit_code(), e.message().as_bytes().to_vec()),
            _ => (0, Vec::new()),
        };
        root.broadcast_into(&mut code);
        let mut len = text.len() as u64;
        root.broadcast_into(&mut len);
        text.resize(len as usize, 0);
        if !text.is_empty() {
            root.broadcast_into(&mut text[..]);
        }
        Err(Error::from_code(code, String::from_utf8_lossy(&text).into_owned()))
    }

    /// Collective: runs `work` on rank 0 only, and returns its error on every rank. `Some` on rank 0, `None`
    /// elsewhere. Work that takes long leaves the processors of the other ranks free.
    pub fn on_root<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<Option<T>> {
        let local = if self.is_root() { work().map(Some) } else { Ok(None) };
        self.meet();
        self.agree(local)
    }

    /// Collective: runs `work` on every rank, and returns the error of the lowest rank that failed on every rank. Ranks
    /// that are done leave their processors free.
    pub fn together<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let local = work();
        self.meet();
        self.agree(local)
    }

    /// This rank's share of so many things, in the order of the ranks.
    pub fn share(&self, count: usize) -> std::ops::Range<usize> {
        self.rank * count / self.size..(self.rank + 1) * count / self.size
    }

    /// Collective: waits for the other ranks; after a moment it sleeps in between, for a small part of the time waited.
    fn meet(&self) {
        if self.size == 1 {
            return;
        }
        let begun = Instant::now();
        let mut over = self.comm.immediate_barrier();
        while let Err(pending) = over.test() {
            over = pending;
            match begun.elapsed() {
                waited if waited < BUSY => std::thread::yield_now(),
                waited => std::thread::sleep((waited / 8).min(LONGEST)),
            }
        }
    }

    /// Collective: as [`World::on_root`] for work that takes long: the other ranks sleep instead of waiting busily,
    /// and where `wish` becomes true on one of them, `work` learns it from the function that it is given.
    pub(crate) fn on_root_heeding<T>(
        &self,
        wish: impl Fn() -> bool,
        work: impl FnOnce(&dyn Fn() -> bool) -> Result<T>,
    ) -> Result<Option<T>> {
        let heard = || match self.comm.any_process().immediate_matched_probe_with_tag(WISH) {
            Some((message, _)) => {
                let (_, _) = message.matched_receive::<u8>();
                true
            }
            None => false,
        };
        let result = if self.is_root() { work(&heard).map(Some) } else { Ok(None) };
        let mut told = self.is_root();
        let mut over = self.comm.immediate_barrier();
        while let Err(pending) = over.test() {
            over = pending;
            if !told && wish() {
                self.comm.process_at_rank(0).send_with_tag(&[1u8][..], WISH);
                told = true;
            }
            // What came too late must not stay behind.
            if self.is_root() {
                heard();
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        while self.is_root() && heard() {}
        self.agree(result)
    }

    /// Collective: sum over the ranks.
    pub fn sum(&self, value: f64) -> f64 {
        let mut out = 0.0;
        self.comm.all_reduce_into(&value, &mut out, SystemOperation::sum());
        out
    }

    /// Collective: sum over the ranks on this rank's node.
    pub(crate) fn sum_on_node(&self, value: f64) -> f64 {
        let mut out = 0.0;
        self.comm.split_shared(self.rank as i32).all_reduce_into(&value, &mut out, SystemOperation::sum());
        out
    }

    /// Collective: sum over the ranks.
    pub fn sum_u64(&self, value: u64) -> u64 {
        let mut out = 0;
        self.comm.all_reduce_into(&value, &mut out, SystemOperation::sum());
        out
    }

    /// Collective: sum over the ranks, entry by entry; the same length everywhere.
    pub fn sum_all<T: Equivalence + Clone + Default>(&self, values: &[T]) -> Vec<T> {
        let mut out = buffer(values.len());
        if !values.is_empty() {
            self.comm.all_reduce_into(values, &mut out[..], SystemOperation::sum());
        }
        out
    }

    /// Collective: maximum over the ranks.
    pub fn max(&self, value: f64) -> f64 {
        let mut out = 0.0;
        self.comm.all_reduce_into(&value, &mut out, SystemOperation::max());
        out
    }

    /// Collective: the vector of rank 0 on every rank.
    pub fn broadcast<T: Equivalence + Clone + Default>(&self, values: Vec<T>) -> Vec<T> {
        let root = self.comm.process_at_rank(0);
        let mut len = values.len() as u64;
        root.broadcast_into(&mut len);
        let mut out = values;
        out.resize(len as usize, T::default());
        if !out.is_empty() {
            root.broadcast_into(&mut out[..]);
        }
        out
    }

    /// Collective: concatenation of the ranks' slices in rank order, on rank 0; empty elsewhere.
    pub fn gather<T: Equivalence + Clone + Default>(&self, mine: &[T]) -> Vec<T> {
        use mpi::datatype::PartitionMut;
        let root = self.comm.process_at_rank(0);
        let n = mine.len() as i32;
        let somewhere = [T::default()];
        let mine = if mine.is_empty() { &somewhere[..0] } else { mine };
        if !self.is_root() {
            root.gather_into(&n);
            root.gather_varcount_into(mine);
            return Vec::new();
        }
        let mut counts = vec![0i32; self.size];
        root.gather_into_root(&n, &mut counts[..]);
        let displs = displacements(&counts);
        let mut all = buffer(counts.iter().map(|&c| c as usize).sum());
        root.gather_varcount_into_root(mine, &mut PartitionMut::new(&mut all[..], counts, displs));
        all
    }

    /// Collective: `parts[r]` of rank 0 on rank `r`. Other ranks pass an empty vector.
    pub fn scatter<T: Equivalence + Clone + Default>(&self, parts: Vec<Vec<T>>) -> Vec<T> {
        use mpi::datatype::Partition;
        let root = self.comm.process_at_rank(0);
        let mut n = 0i32;
        if !self.is_root() {
            root.scatter_into(&mut n);
            let mut mine = buffer(n as usize);
            root.scatter_varcount_into(&mut mine[..]);
            return mine;
        }
        let counts: Vec<i32> = parts.iter().map(|p| p.len() as i32).collect();
        root.scatter_into_root(&counts[..], &mut n);
        let mut mine = buffer(n as usize);
        let mut all = parts.concat();
        all.reserve(1);
        let displs = displacements(&counts);
        root.scatter_varcount_into_root(&Partition::new(&all[..], counts, displs), &mut mine[..]);
        mine
    }

    /// Collective: concatenation of the ranks' slices in rank order, on every rank.
    pub fn all_gather<T: Equivalence + Clone + Default>(&self, mine: &[T]) -> Vec<T> {
        let all = self.gather(mine);
        self.broadcast(all)
    }
}

/// A receive buffer of `n` values. It has memory even if empty: the pointer of an empty byte vector without memory is
/// 1, which OpenMPI takes for MPI_IN_PLACE.
fn buffer<T: Clone + Default>(n: usize) -> Vec<T> {
    let mut out = Vec::with_capacity(n.max(1));
    out.resize(n, T::default());
    out
}

fn displacements(counts: &[i32]) -> Vec<i32> {
    counts
        .iter()
        .scan(0, |sum, &c| {
            let start = *sum;
            *sum += c;
            Some(start)
        })
        .collect()
}
