//! Direct solver for complex symmetric matrices aK + bM + … of real ones: MUMPS through PETSc.

use super::csr::DistCsr;
use super::handle::{read, vector, write, Handle};
use super::mumps::{failure, room, space, MumpsCall};
use super::session::{check, Petsc};
use crate::{Error, Result};
use mpi::raw::AsRaw;
use num_complex::Complex;
use petsc_sys as sys;
use std::ffi::CString;

/// Advice against a complex factorisation without memory.
const ADVICE: &str =
    "solver.out_of_core, more ranks on more machines, a coarser mesh, or equal damping.alpha and damping.beta \
     for both bodies, \
                      which needs real factorisations only";

/// Right-hand sides solved at once.
const BLOCK: usize = 64;

/// A factorised complex symmetric matrix.
pub struct ComplexFactor<'p> {
    petsc: &'p Petsc<'p>,
    // Before the matrix that it was made from.
    factor: Handle<'p, sys::Mat>,
    _matrix: Handle<'p, sys::Mat>,
    n_local: usize,
    order: u64,
    name: String,
}

impl<'p> ComplexFactor<'p> {
    /// Collective: factorises a sum of symmetric matrices with the same ranges, each with its factor. `prefix` is
    /// that of the PETSc options, `name` stands for the matrix in messages.
    pub fn new(petsc: &'p Petsc<'p>, terms: &[(&DistCsr, Complex<f64>)], prefix: &str, name: &str) -> Result<Self> {
        let missing = || Error::Defect("a factorisation of no matrix".into());
        let Some((first, others)) = terms.split_first() else { return Err(missing()) };
        let pattern = others.iter().fold(first.0.full().into_owned(), |sum, (matrix, _)| sum.minus_scaled(1.0, matrix));
        let value =
            |row: usize, _: usize, column: u64| terms.iter().map(|(matrix, f)| f * matrix.get(row, column)).sum();
        let matrix = super::aij::assembled_with(petsc, &pattern, 1, value)?;
        // PETSc passes MUMPS its ordering by the option only. SCOTCH (3) is used where MUMPS has it, else MUMPS
        // chooses.
        petsc.default_option(&format!("{prefix}mat_mumps_icntl_7"), "3")?;
        if let Some(scratch) = petsc.world().scratch.get() {
            petsc.default_option(&format!("{prefix}mat_mumps_icntl_22"), "1")?;
            petsc.default_option(&format!("{prefix}mat_mumps_ooc_tmpdir"), &scratch.path().to_string_lossy())?;
        }
        let text = |s: &str| CString::new(s).map_err(|_| Error::Defect("zero byte in an options prefix".into()));
        let prefix = text(prefix)?;
        let doing = format!("factorising {name}");
        // SAFETY: a live matrix and a string that ends in zero.
        unsafe {
            check(sys::MatSetOptionsPrefix(matrix.raw(), prefix.as_ptr()), &doing)?;
            check(sys::MatSetOption(matrix.raw(), sys::MatOption_MAT_SYMMETRIC, sys::PETSC_TRUE), &doing)?;
        }
        let kind = sys::MatFactorType_MAT_FACTOR_CHOLESKY;
        // SAFETY: a live matrix, a string that ends in zero, a valid output.
        let factor =
            Handle::create(petsc, &doing, |f| unsafe { sys::MatGetFactor(matrix.raw(), c"mumps".as_ptr(), kind, f) })?;
        let made = Self {
            petsc,
            factor,
            _matrix: matrix,
            n_local: pattern.n_local(),
            order: pattern.order(),
            name: name.to_owned(),
        };
        // SAFETY: a structure of numbers, for which zeros are valid.
        let info: sys::MatFactorInfo = unsafe { std::mem::zeroed() };
        let f = made.factor.raw();
        // SAFETY: live matrices; MUMPS orders by itself and needs no index set.
        unsafe {
            check(sys::MatCholeskyFactorSymbolic(f, made._matrix.raw(), std::ptr::null_mut(), &info), &doing)?;
            made.refuse_failure()?;
            made.refuse_no_room()?;
            check(sys::MatCholeskyFactorNumeric(f, made._matrix.raw(), &info), &doing)?;
        }
        made.refuse_failure()?;
        Ok(made)
    }

    /// INFOG(`number`) of MUMPS.
    fn infog(&self, number: i32) -> Result<i64> {
        let mut value = 0;
        check(
            // SAFETY: a live factor matrix of MUMPS and a valid output.
            unsafe { sys::MatMumpsGetInfog(self.factor.raw(), number as sys::PetscInt, &mut value) },
            "asking MUMPS",
        )?;
        Ok(i64::from(value))
    }

    fn refuse_failure(&self) -> Result<()> {
        let (code, detail) = (self.infog(1)?, self.infog(2)?);
        self.failing(|failed| failure(code, detail, failed))
    }

    fn refuse_no_room(&self) -> Result<()> {
        // Of the rank that needs most: PETSc shows those of each only where its own options ask for them.
        let world = self.petsc.world();
        let entries = match self.infog(20)? {
            millions if millions < 0 => -1e6 * millions as f64,
            entries => entries as f64,
        };
        self.failing(|failed| {
            space(world, 16.0 * entries / world.size as f64, failed)?;
            room(world, failed.megabytes, failed)
        })
    }

    fn failing(&self, judge: impl FnOnce(&MumpsCall) -> Result<()>) -> Result<()> {
        let on_disk = self.petsc.world().scratch.get().is_some();
        let megabytes = self.infog(if on_disk { 26 } else { 16 })?.max(0) as u64;
        let what = format!("the complex factorisation of {}", self.name);
        judge(&MumpsCall { what: &what, matrix: &self.name, entry: 16.0, megabytes, advice: ADVICE })
    }

    /// Collective: solves for `nrhs` right-hand sides in place. `rhs`: local rows, `[n_local, nrhs]` column by column.
    pub fn solve(&mut self, rhs: &mut [Complex<f64>], nrhs: usize) -> Result<()> {
        let n = self.n_local;
        let doing = "solving with a complex factor";
        if nrhs < 4 {
            let (b, x) = (vector(self.petsc, n, self.order)?, vector(self.petsc, n, self.order)?);
            for column in 0..nrhs {
                let values = &mut rhs[column * n..(column + 1) * n];
                // SAFETY: live vectors of this layout that nothing else uses.
                unsafe {
                    write(b.raw(), |v| v.copy_from_slice(values))?;
                    check(sys::MatSolve(self.factor.raw(), b.raw(), x.raw()), doing)?;
                    read(x.raw(), |v| values.copy_from_slice(v))?;
                }
            }
            return self.refuse_failure();
        }
        for first in (0..nrhs).step_by(BLOCK) {
            let count = BLOCK.min(nrhs - first);
            let (b, x) = (self.dense(count)?, self.dense(count)?);
            let values = &mut rhs[first * n..(first + count) * n];
            // SAFETY: live dense matrices of `count` columns of `n` local rows each, stored column by column without
            // gaps.
            unsafe {
                let mut array = std::ptr::null_mut();
                check(sys::MatDenseGetArray(b.raw(), &mut array), doing)?;
                if n > 0 {
                    std::slice::from_raw_parts_mut(array, values.len()).copy_from_slice(values);
                }
                check(sys::MatDenseRestoreArray(b.raw(), &mut array), doing)?;
                check(sys::MatMatSolve(self.factor.raw(), b.raw(), x.raw()), doing)?;
                check(sys::MatDenseGetArray(x.raw(), &mut array), doing)?;
                if n > 0 {
                    values.copy_from_slice(std::slice::from_raw_parts(array, values.len()));
                }
                check(sys::MatDenseRestoreArray(x.raw(), &mut array), doing)?;
            }
        }
        self.refuse_failure()
    }

    fn dense(&self, columns: usize) -> Result<Handle<'p, sys::Mat>> {
        let comm = self.petsc.world().comm.as_raw();
        let (n, all) = (self.n_local as sys::PetscInt, self.order as sys::PetscInt);
        let columns = columns as sys::PetscInt;
        let matrix = Handle::create(self.petsc, "making right-hand sides", |m| {
            // SAFETY: a live communicator, a valid output; PETSc allocates the values.
            unsafe {
                sys::MatCreateDense(comm, n, sys::PETSC_DECIDE as sys::PetscInt, all, columns, std::ptr::null_mut(), m)
            }
        })?;
        // SAFETY: a live matrix.
        unsafe {
            check(
                sys::MatAssemblyBegin(matrix.raw(), sys::MatAssemblyType_MAT_FINAL_ASSEMBLY),
                "making right-hand sides",
            )?;
            check(
                sys::MatAssemblyEnd(matrix.raw(), sys::MatAssemblyType_MAT_FINAL_ASSEMBLY),
                "making right-hand sides",
            )?;
        }
        Ok(matrix)
    }
}
