//! Solutions with a real factor. Each rank gives its own rows of the right-hand sides and gets its own rows of the
//! solutions; no rank sees a whole column.

use super::Factor;
use crate::parallel::World;
use crate::petsc::csr::{all_to_all, owner_of};
use crate::{Error, Result};
use mumps_sys::MUMPS_INT;
use std::ptr;

/// Columns solved at once: twice what MUMPS takes through the factor together, so that its buffers stay small.
const BLOCK: usize = 64;

/// Distribution of the rows of right-hand sides and solutions. MUMPS leaves the solution with the ranks that eliminated
/// its rows.
#[derive(Default)]
pub(super) struct Rows {
    /// This rank's rows, 1-based.
    own: Vec<MUMPS_INT>,
    /// Rows of which MUMPS leaves the solution on this rank, 1-based; written by the first solve.
    left: Vec<MUMPS_INT>,
    /// The way of the solution to the ranks that own its rows, known after the first solve.
    way: Option<Way>,
}

struct Way {
    /// Places in `left` of the rows that each rank owns.
    send: Vec<Vec<u32>>,
    /// Local rows that come from each rank, in the order in which they come.
    receive: Vec<Vec<u32>>,
}

impl Way {
    /// Collective.
    fn new(world: &World, ranges: &[u64], left: &[MUMPS_INT]) -> Self {
        let mut send = vec![Vec::new(); world.size];
        let mut rows = vec![Vec::new(); world.size];
        for (place, &row) in left.iter().enumerate() {
            let row = row as u64 - 1;
            let owner = owner_of(ranges, row);
            send[owner].push(place as u32);
            rows[owner].push((row - ranges[owner]) as u32);
        }
        let counts: Vec<Vec<u64>> = rows.iter().map(|r| vec![r.len() as u64]).collect();
        let counts = all_to_all(world, &counts);
        let mut rows = all_to_all(world, &rows).into_iter();
        let receive = counts.iter().map(|&n| rows.by_ref().take(n as usize).collect()).collect();
        Self { send, receive }
    }

    /// Collective: `solution`, `[rows left here, k]` with leading dimension `stride`, as this rank's own rows, `[n,
    /// k]`.
    fn bring(&self, world: &World, solution: &[f64], stride: usize, own: &mut [f64], k: usize) {
        let column = |j: usize, places: &[u32]| places.iter().map(|&p| solution[j * stride + p as usize]).collect();
        let part = |places: &Vec<u32>| (0..k).flat_map(|j| -> Vec<f64> { column(j, places) }).collect();
        let parts: Vec<Vec<f64>> = self.send.iter().map(part).collect();
        let mut values = all_to_all(world, &parts).into_iter();
        let n = own.len() / k;
        for rows in &self.receive {
            for j in 0..k {
                rows.iter().zip(values.by_ref()).for_each(|(&row, v)| own[j * n + row as usize] = v);
            }
        }
    }
}

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
        for first in (0..nrhs).step_by(BLOCK) {
            let k = BLOCK.min(nrhs - first);
            let columns = &mut rhs[first * n..(first + k) * n];
            match self.world.size {
                1 => self.solve_whole(columns, k)?,
                _ => self.solve_distributed(columns, k)?,
            }
        }
        Ok(())
    }

    fn solve_whole(&mut self, rhs: &mut [f64], k: usize) -> Result<()> {
        self.id.nrhs = k as MUMPS_INT;
        self.id.lrhs = self.n_local() as MUMPS_INT;
        self.control(20, 0);
        self.control(21, 0);
        self.control(30, 0);
        self.id.rhs = rhs.as_mut_ptr();
        self.call(3);
        self.id.rhs = ptr::null_mut();
        self.result("solve")
    }

    fn solve_distributed(&mut self, rhs: &mut [f64], k: usize) -> Result<()> {
        let n = self.n_local();
        // INFO(23): rows of the solution that will be left on this rank.
        let stride = self.id.info[22].max(0) as usize;
        if self.rows.own.len() != n || self.rows.left.len() != stride {
            let first = self.ranges[self.world.rank] as MUMPS_INT + 1;
            self.rows = Rows { own: (first..first + n as MUMPS_INT).collect(), left: vec![0; stride], way: None };
        }
        // MUMPS takes a null pointer for one that was forgotten, also on a rank without rows.
        let mut nothing = [0.0];
        let mut no_row = [1 as MUMPS_INT];
        let mut solution = vec![0.0; (stride * k).max(1)];
        let or = |values: &mut Vec<MUMPS_INT>, empty: &mut [MUMPS_INT; 1]| match values.is_empty() {
            true => empty.as_mut_ptr(),
            false => values.as_mut_ptr(),
        };
        self.id.nrhs = k as MUMPS_INT;
        self.id.nloc_rhs = n as MUMPS_INT;
        self.id.lrhs_loc = n.max(1) as MUMPS_INT;
        self.id.irhs_loc = or(&mut self.rows.own, &mut no_row);
        self.id.rhs_loc = if rhs.is_empty() { nothing.as_mut_ptr() } else { rhs.as_mut_ptr() };
        self.id.lsol_loc = stride.max(1) as MUMPS_INT;
        self.id.isol_loc = or(&mut self.rows.left, &mut no_row);
        self.id.sol_loc = solution.as_mut_ptr();
        self.control(20, 10); // right-hand sides distributed as the caller has them
        self.control(21, 1); // solution distributed as MUMPS has it
        self.control(30, 0);
        self.call(3);
        self.control(20, 0);
        self.control(21, 0);
        self.id.nloc_rhs = 0;
        self.id.irhs_loc = ptr::null_mut();
        self.id.rhs_loc = ptr::null_mut();
        self.id.isol_loc = ptr::null_mut();
        self.id.sol_loc = ptr::null_mut();
        self.result("solve")?;
        let (world, ranges, rows) = (self.world, &self.ranges, &mut self.rows);
        let way = rows.way.get_or_insert_with(|| Way::new(world, ranges, &rows.left));
        way.bring(world, &solution, stride, rhs, k);
        Ok(())
    }
}
