//! The structure through which MUMPS is spoken to. MUMPS keeps each precision in a library of its own, with structures that differ in the type of their
//! numbers alone. Numbers of controls and statistics are counted from 1, as in the users' guide.

use super::Precision;
use crate::parallel::World;
use crate::{Error, Result};
use mpi::raw::AsRaw;
use mumps_sys::{dmumps_c, smumps_c, DMUMPS_STRUC_C, MUMPS_INT, SMUMPS_STRUC_C};
use std::ptr;

/// Boxed: MUMPS keeps pointers into its own structure.
pub(super) enum Instance {
    Double(Box<DMUMPS_STRUC_C>),
    Single(Box<SMUMPS_STRUC_C>),
}

/// The same expression on the structure of either precision.
macro_rules! either {
    ($id:expr, $s:ident => $body:expr) => {
        match $id {
            $crate::petsc::mumps::instance::Instance::Double($s) => $body,
            $crate::petsc::mumps::instance::Instance::Single($s) => $body,
        }
    };
}
pub(super) use either;

impl Instance {
    /// A structure for the ranks of `world`, before MUMPS knows of it; `sym` as in the users' guide.
    pub fn new(world: &World, precision: Precision, sym: MUMPS_INT) -> Self {
        // SAFETY: structures of integers, floats and pointers, for which all zeros are valid; MUMPS fills them.
        let mut id = unsafe {
            match precision {
                Precision::Double => Instance::Double(Box::new(std::mem::zeroed())),
                Precision::Single => Instance::Single(Box::new(std::mem::zeroed())),
            }
        };
        // SAFETY: a live communicator.
        let comm = unsafe { mpi::ffi::RSMPI_Comm_c2f(world.comm.as_raw()) } as MUMPS_INT;
        either!(&mut id, s => (s.comm_fortran, s.par, s.sym) = (comm, 1, sym));
        id
    }

    pub fn precision(&self) -> Precision {
        match self {
            Instance::Double(_) => Precision::Double,
            Instance::Single(_) => Precision::Single,
        }
    }

    /// Collective: one job of MUMPS.
    pub fn call(&mut self, job: MUMPS_INT) {
        either!(&mut *self, s => s.job = job);
        // SAFETY: the structure was zeroed and initialised (job -1) on all ranks; pointers set in it are valid for the
        // job at hand and are reset by the caller after it.
        unsafe {
            match self {
                Instance::Double(s) => dmumps_c(&mut **s),
                Instance::Single(s) => smumps_c(&mut **s),
            }
        }
    }

    /// ICNTL(`number`).
    pub fn icntl(&self, number: usize) -> MUMPS_INT {
        either!(self, s => s.icntl[number - 1])
    }

    /// Sets ICNTL(`number`).
    pub fn control(&mut self, number: usize, value: MUMPS_INT) {
        either!(self, s => s.icntl[number - 1] = value);
    }

    /// INFO(`number`) of this rank.
    pub fn info(&self, number: usize) -> MUMPS_INT {
        either!(self, s => s.info[number - 1])
    }

    /// INFOG(`number`), the same on every rank.
    pub fn infog(&self, number: usize) -> MUMPS_INT {
        either!(self, s => s.infog[number - 1])
    }

    /// RINFO(`number`) of this rank.
    pub fn rinfo(&self, number: usize) -> f64 {
        #[allow(clippy::useless_conversion)]
        {
            either!(self, s => f64::from(s.rinfo[number - 1]))
        }
    }

    /// RINFOG(`number`), the same on every rank.
    pub fn rinfog(&self, number: usize) -> f64 {
        #[allow(clippy::useless_conversion)]
        {
            either!(self, s => f64::from(s.rinfog[number - 1]))
        }
    }

    /// Makes MUMPS look for null pivots: those below `part` of the largest entry.
    pub fn find_null_pivots(&mut self, part: f64) {
        self.control(24, 1);
        either!(self, s => s.cntl[2] = part as _);
    }

    /// Rows (from 1) of the null pivots; on rank 0.
    pub fn null_pivots(&self) -> &[MUMPS_INT] {
        let (list, count) = (either!(self, s => s.pivnul_list), self.infog(28).max(0));
        match list.is_null() {
            true => &[],
            // SAFETY: on rank 0 MUMPS lists the rows of the null pivots, INFOG(28) of them.
            false => unsafe { std::slice::from_raw_parts(list, count as usize) },
        }
    }

    /// Collective: the analysis of a pattern of order `n` (rows and columns from 1), in the elimination order `order` or, where that is empty, one of MUMPS's own.
    pub fn analyse(&mut self, n: u64, rows: &mut [MUMPS_INT], cols: &mut [MUMPS_INT], order: &mut [MUMPS_INT]) {
        let order = if order.is_empty() { ptr::null_mut() } else { order.as_mut_ptr() };
        either!(&mut *self, s => (s.n, s.perm_in) = (n as MUMPS_INT, order));
        self.entries(rows, cols);
        self.call(1);
        either!(&mut *self, s => s.perm_in = ptr::null_mut());
        self.no_entries();
    }

    /// Places of the local entries of the matrix.
    pub fn entries(&mut self, rows: &mut [MUMPS_INT], cols: &mut [MUMPS_INT]) {
        let at = (rows.as_mut_ptr(), cols.as_mut_ptr());
        either!(self, s => (s.nnz_loc, s.irn_loc, s.jcn_loc) = (rows.len() as i64, at.0, at.1));
    }

    /// No pointer to the matrix stays behind.
    pub fn no_entries(&mut self) {
        either!(self, s => (s.irn_loc, s.jcn_loc, s.a_loc) = (ptr::null_mut(), ptr::null_mut(), ptr::null_mut()));
    }

    /// Factors go to files in the folder `path`.
    pub fn write_factors(&mut self, path: &str) -> Result<()> {
        self.control(22, 1);
        either!(self, s => put_text(&mut s.ooc_tmpdir, path))
    }
}

/// Puts `text` into a field of characters that ends in zero.
fn put_text(field: &mut [std::ffi::c_char], text: &str) -> Result<()> {
    if text.len() >= field.len() || text.contains('\0') {
        return Err(Error::Job(format!(
            "solver.out_of_core: found a path of {} bytes, {text}; expected one that MUMPS can hold, of at most {} bytes",
            text.len(),
            field.len() - 1
        )));
    }
    field.fill(0);
    field.iter_mut().zip(text.bytes()).for_each(|(to, from)| *to = from as std::ffi::c_char);
    Ok(())
}
