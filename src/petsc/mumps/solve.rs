//! Solutions with a real factor: columns gathered on rank 0, where MUMPS takes them.

use super::Factor;
use crate::{Error, Result};
use mumps_sys::MUMPS_INT;
use std::ptr;

impl Factor<'_> {
    /// Collective: solves for `nrhs` right-hand sides in place. `rhs`: local rows, `[n_local, nrhs]` column by column.
    pub fn solve(&mut self, rhs: &mut [f64], nrhs: usize) -> Result<()> {
        let n = self.n_local();
        let right = rhs.len() == n * nrhs && rhs.iter().all(|v| v.is_finite());
        self.world.agree(right.then_some(()).ok_or_else(|| {
            Error::Defect(format!(
                "right-hand side of {} values for {nrhs} columns of {n} rows, or not finite",
                rhs.len()
            ))
        }))?;
        let order = self.ranges[self.world.size] as usize;
        // Counts in MPI and leading dimensions in MUMPS are 32-bit.
        let chunk = (i32::MAX as usize / order).clamp(1, 512);
        let mut done = 0;
        while done < nrhs {
            let k = chunk.min(nrhs - done);
            self.solve_chunk(&mut rhs[done * n..(done + k) * n], k)?;
            done += k;
        }
        Ok(())
    }

    fn solve_chunk(&mut self, rhs: &mut [f64], k: usize) -> Result<()> {
        let world = self.world;
        let order = self.ranges[world.size] as usize;
        self.id.nrhs = k as MUMPS_INT;
        self.id.lrhs = order as MUMPS_INT;
        self.control(20, 0);
        self.control(21, 0);
        self.control(30, 0);
        if world.size == 1 {
            self.id.rhs = rhs.as_mut_ptr();
            self.call(3);
            self.id.rhs = ptr::null_mut();
            return self.result("solve");
        }
        // Ranks hold rows, MUMPS takes whole columns on rank 0.
        let parts = world.gather(rhs);
        let mut whole = vec![0.0; parts.len()];
        let pieces = |ranges: &[u64]| -> Vec<(usize, usize)> {
            ranges.windows(2).map(|w| (w[0] as usize, (w[1] - w[0]) as usize)).collect()
        };
        let pieces = pieces(&self.ranges);
        if world.is_root() {
            for &(first, n) in &pieces {
                for j in 0..k {
                    let from = first * k + j * n;
                    whole[j * order + first..][..n].copy_from_slice(&parts[from..from + n]);
                }
            }
        }
        // MUMPS remembers that a rank gave a pointer, and refuses sparse right-hand sides then on any but rank 0.
        if world.is_root() {
            self.id.rhs = whole.as_mut_ptr();
        }
        self.call(3);
        self.id.rhs = ptr::null_mut();
        self.result("solve")?;
        let parts = if world.is_root() {
            let part = |&(first, n): &(usize, usize)| {
                (0..k).flat_map(|j| whole[j * order + first..][..n].iter().copied()).collect()
            };
            pieces.iter().map(part).collect()
        } else {
            Vec::new()
        };
        rhs.copy_from_slice(&world.scatter(parts));
        Ok(())
    }
}
