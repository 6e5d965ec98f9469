//! Matrices in PETSc's own format.

use super::csr::DistCsr;
use super::handle::Handle;
use super::session::{check, Petsc};
use crate::Result;
use mpi::raw::AsRaw;
use num_complex::Complex;
use petsc_sys as sys;

/// Collective: the matrix in PETSc's rows, each allocated to its length.
pub(crate) fn assembled<'p>(petsc: &'p Petsc<'_>, matrix: &DistCsr, block: usize) -> Result<Handle<'p, sys::Mat>> {
    let matrix = matrix.full();
    assembled_with(petsc, &matrix, block, |row, at, _| Complex::new(matrix.row(row).1[at], 0.0))
}

/// Collective: a matrix with the pattern of `pattern`, all of whose entries are stored, whose entry in local row
/// `row`, the `at`-th of that row, in global column `column` is `value(row, at, column)`.
pub(crate) fn assembled_with<'p>(
    petsc: &'p Petsc<'_>,
    pattern: &DistCsr,
    block: usize,
    value: impl Fn(usize, usize, u64) -> Complex<f64>,
) -> Result<Handle<'p, sys::Mat>> {
    let matrix = pattern;
    let world = petsc.world();
    let own = matrix.rows_of(world.rank);
    let (n, order) = (matrix.n_local() as sys::PetscInt, matrix.order() as sys::PetscInt);
    let inside: Vec<sys::PetscInt> = (0..matrix.n_local())
        .map(|i| matrix.row(i).0.iter().filter(|&&c| own.contains(&c.into())).count() as sys::PetscInt)
        .collect();
    let outside: Vec<sys::PetscInt> =
        (0..matrix.n_local()).map(|i| matrix.row(i).0.len() as sys::PetscInt - inside[i]).collect();
    let comm = world.comm.as_raw();
    // SAFETY: a live communicator and a valid output.
    let a = Handle::create(petsc, "creating a matrix", |a| unsafe { sys::MatCreate(comm, a) })?;
    let doing = "assembling a matrix";
    // SAFETY: a live matrix; the counts have one entry per local row; columns and values are as long as their count
    // says.
    unsafe {
        let m = a.raw();
        check(sys::MatSetSizes(m, n, n, order, order), doing)?;
        check(sys::MatSetBlockSize(m, block as sys::PetscInt), doing)?;
        check(sys::MatSetType(m, c"aij".as_ptr()), doing)?;
        check(sys::MatSeqAIJSetPreallocation(m, 0, inside.as_ptr()), doing)?;
        check(sys::MatMPIAIJSetPreallocation(m, 0, inside.as_ptr(), 0, outside.as_ptr()), doing)?;
        check(sys::MatSetOption(m, sys::MatOption_MAT_NO_OFF_PROC_ENTRIES, sys::PETSC_TRUE), doing)?;
        let mut columns: Vec<sys::PetscInt> = Vec::new();
        let mut values: Vec<Complex<f64>> = Vec::new();
        for i in 0..matrix.n_local() {
            let cols = matrix.row(i).0;
            columns.clear();
            columns.extend(cols.iter().map(|&c| c as sys::PetscInt));
            values.clear();
            values.extend(cols.iter().enumerate().map(|(at, &c)| value(i, at, c.into())));
            let row = (own.start + i as u64) as sys::PetscInt;
            let count = columns.len() as sys::PetscInt;
            check(
                sys::MatSetValues(m, 1, &row, count, columns.as_ptr(), values.as_ptr(), sys::InsertMode_INSERT_VALUES),
                doing,
            )?;
        }
        check(sys::MatAssemblyBegin(m, sys::MatAssemblyType_MAT_FINAL_ASSEMBLY), doing)?;
        check(sys::MatAssemblyEnd(m, sys::MatAssemblyType_MAT_FINAL_ASSEMBLY), doing)?;
    }
    Ok(a)
}
