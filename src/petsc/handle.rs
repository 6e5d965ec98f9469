//! Owners of PETSc and SLEPc objects: destroyed on drop, and never outliving the session that they borrow.

use super::session::{check, Petsc};
use crate::Result;
use num_complex::Complex;
use petsc_sys as sys;
use std::marker::PhantomData;
use std::ptr;

/// A kind of PETSc object: how it is destroyed.
pub(crate) trait Object: Copy {
    /// # Safety
    /// `self` is a live object, destroyed once.
    unsafe fn destroy(self);
}

macro_rules! kinds {
    ($($kind:ty => $destroy:path;)*) => {$(
        impl Object for $kind {
            unsafe fn destroy(mut self) {
                // SAFETY: by the contract of the trait. A failure to destroy leaves nothing to be done.
                unsafe { $destroy(&mut self) };
            }
        }
    )*};
}

kinds! {
    sys::Vec => sys::VecDestroy;
    sys::Mat => sys::MatDestroy;
    sys::KSP => sys::KSPDestroy;
    sys::MatNullSpace => sys::MatNullSpaceDestroy;
    slepc_sys::EPS => slepc_sys::EPSDestroy;
    slepc_sys::PEP => slepc_sys::PEPDestroy;
}

/// An object of PETSc.
pub(crate) struct Handle<'p, K: Object> {
    raw: K,
    session: PhantomData<&'p Petsc<'p>>,
}

impl<'p, K: Object> Handle<'p, K> {
    /// Takes over what `create` makes.
    pub(crate) fn create(
        _petsc: &'p Petsc<'_>,
        doing: &str,
        create: impl FnOnce(&mut K) -> sys::PetscErrorCode,
    ) -> Result<Self> {
        let mut raw = std::mem::MaybeUninit::<K>::zeroed();
        // SAFETY: every kind is a raw pointer, for which zero is valid.
        let slot = unsafe { raw.assume_init_mut() };
        check(create(slot), doing)?;
        Ok(Self { raw: *slot, session: PhantomData })
    }

    /// The object, for calls into PETSc.
    pub(crate) fn raw(&self) -> K {
        self.raw
    }
}

impl<K: Object> Drop for Handle<'_, K> {
    fn drop(&mut self) {
        // SAFETY: created by `create`, destroyed here only, before PETSc's end by the borrow of the session.
        unsafe { self.raw.destroy() };
    }
}

/// Ranks that an object of PETSc spans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Span {
    /// All ranks.
    World,
    /// The calling rank alone.
    Rank,
}

impl Span {
    /// The communicator of these ranks.
    pub(crate) fn comm(self, petsc: &Petsc) -> sys::MPI_Comm {
        use mpi::raw::AsRaw;
        match self {
            Self::World => petsc.world().comm.as_raw(),
            // SAFETY: a constant of the MPI library.
            Self::Rank => unsafe { mpi::ffi::RSMPI_COMM_SELF },
        }
    }
}

/// A distributed vector whose local rows follow `ranges`.
pub(crate) fn vector<'p>(petsc: &'p Petsc<'_>, n_local: usize, order: u64) -> Result<Handle<'p, sys::Vec>> {
    vector_on(petsc, Span::World, n_local, order)
}

/// A vector over the ranks of `span`.
pub(crate) fn vector_on<'p>(
    petsc: &'p Petsc<'_>,
    span: Span,
    n_local: usize,
    order: u64,
) -> Result<Handle<'p, sys::Vec>> {
    let comm = span.comm(petsc);
    let (n, all) = (n_local as sys::PetscInt, order as sys::PetscInt);
    // SAFETY: a live communicator and a valid output.
    Handle::create(petsc, "creating a vector", |v| unsafe { sys::VecCreateMPI(comm, n, all, v) })
}

/// Runs `work` on the local values of `v` for reading.
///
/// # Safety
/// `v` is a live vector.
pub(crate) unsafe fn read<T>(v: sys::Vec, work: impl FnOnce(&[Complex<f64>]) -> T) -> Result<T> {
    let (mut n, mut values) = (0, ptr::null());
    // SAFETY: a live vector and valid outputs; the array holds n values until restored.
    unsafe {
        check(sys::VecGetLocalSize(v, &mut n), "reading a vector")?;
        check(sys::VecGetArrayRead(v, &mut values), "reading a vector")?;
        let result = work(slice(values, n as usize));
        check(sys::VecRestoreArrayRead(v, &mut values), "reading a vector")?;
        Ok(result)
    }
}

/// Runs `work` on the local values of `v` for writing.
///
/// # Safety
/// `v` is a live vector, not locked for reading.
pub(crate) unsafe fn write<T>(v: sys::Vec, work: impl FnOnce(&mut [Complex<f64>]) -> T) -> Result<T> {
    let (mut n, mut values) = (0, ptr::null_mut());
    // SAFETY: a live vector and valid outputs; the array holds n values until restored and is not aliased by us.
    unsafe {
        check(sys::VecGetLocalSize(v, &mut n), "writing a vector")?;
        check(sys::VecGetArray(v, &mut values), "writing a vector")?;
        let all = if n == 0 { &mut [][..] } else { std::slice::from_raw_parts_mut(values, n as usize) };
        let result = work(all);
        check(sys::VecRestoreArray(v, &mut values), "writing a vector")?;
        Ok(result)
    }
}

/// # Safety
/// `values` points to `n` values, or n is 0 (PETSc then gives a null pointer).
unsafe fn slice<'a>(values: *const Complex<f64>, n: usize) -> &'a [Complex<f64>] {
    if n == 0 {
        return &[];
    }
    // SAFETY: by the contract.
    unsafe { std::slice::from_raw_parts(values, n) }
}
