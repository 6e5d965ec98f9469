//! Operators of ours inside SLEPc's solvers: shell matrices, a shell preconditioner and a monitor whose work is
//! guarded, so that neither an error nor a panic crosses C as anything but a code.

use super::handle::{read, write, Handle, Span};
use super::session::{check, Petsc};
use crate::{Error, Result};
use num_complex::Complex;
use petsc_sys as sys;
use slepc_sys as slepc;
use std::ffi::c_void;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::ptr::{self, NonNull};

/// An eigenproblem as the solver sees it, distributed over the ranks by rows: the matrices that go with the powers of
/// the eigenvalue, and the inverse at the target.
pub trait ShellOperator {
    /// Rows on this rank.
    fn n_local(&self) -> usize;

    /// Collective: y = A x with the matrix A of this power of the eigenvalue, K, C, M for 0, 1, 2 in (λ²M + λC + K) x
    /// = 0; local rows.
    fn multiply(&mut self, power: usize, x: &[Complex<f64>], y: &mut [Complex<f64>]) -> Result<()>;

    /// Collective: x := P(σ)⁻¹ x at the target σ; local rows.
    fn solve(&mut self, x: &mut [Complex<f64>]) -> Result<()>;

    /// Collective: y = Aᵀ x, as [`ShellOperator::multiply`]; asked for by two-sided methods alone.
    fn multiply_transposed(&mut self, _power: usize, _x: &[Complex<f64>], _y: &mut [Complex<f64>]) -> Result<()> {
        Err(Error::Defect("a product with the transposed of an operator that has none".into()))
    }

    /// Collective: x := P(σ)⁻ᵀ x; asked for by two-sided methods alone.
    fn solve_transposed(&mut self, _x: &mut [Complex<f64>]) -> Result<()> {
        Err(Error::Defect("a solve with the transposed of an operator that has none".into()))
    }
}

/// Data of the callbacks.
struct Work<'a> {
    operator: &'a mut dyn ShellOperator,
    progress: &'a mut dyn FnMut(usize, usize),
    wanted: usize,
    solves: usize,
    error: Option<Error>,
}

impl Work<'_> {
    fn guard(&mut self, work: impl FnOnce(&mut Self) -> Result<()>) -> sys::PetscErrorCode {
        let outcome = catch_unwind(AssertUnwindSafe(|| work(self)));
        let error = match outcome {
            Ok(Ok(())) => return 0,
            Ok(Err(error)) => error,
            Err(_) => Error::Defect("panic in the eigensolver's operator".into()),
        };
        self.error.get_or_insert(error);
        sys::PETSC_ERR_USER as sys::PetscErrorCode
    }
}

/// A value at an address that C may keep: it is reached by the pointer alone.
struct Pinned<T>(NonNull<T>);

impl<T> Pinned<T> {
    fn new(value: T) -> Self {
        Self(NonNull::from(Box::leak(Box::new(value))))
    }

    fn context(&self) -> *mut c_void {
        self.0.as_ptr().cast()
    }
}

impl<T> Drop for Pinned<T> {
    fn drop(&mut self) {
        // SAFETY: from a box, freed here only.
        drop(unsafe { Box::from_raw(self.0.as_ptr()) });
    }
}

/// The operator as callbacks know it.
pub(super) struct Shell<'a> {
    work: Pinned<Work<'a>>,
}

/// One of the shell matrices.
struct Power {
    work: *mut c_void,
    power: usize,
}

/// A shell matrix.
pub(super) struct ShellMatrix<'p> {
    matrix: Handle<'p, sys::Mat>,
    // After the matrix that points to it.
    _power: Pinned<Power>,
}

impl ShellMatrix<'_> {
    /// The matrix, for calls into SLEPc.
    pub fn raw(&self) -> sys::Mat {
        self.matrix.raw()
    }
}

impl<'a> Shell<'a> {
    /// The callbacks of `operator`; `progress` is told converged and `wanted` pairs at every restart.
    pub fn new(operator: &'a mut dyn ShellOperator, progress: &'a mut dyn FnMut(usize, usize), wanted: usize) -> Self {
        Self { work: Pinned::new(Work { operator, progress, wanted, solves: 0, error: None }) }
    }

    /// The context of the callbacks.
    pub fn context(&self) -> *mut c_void {
        self.work.context()
    }

    /// Solves so far.
    pub fn solves(&self) -> usize {
        // SAFETY: alive as long as self; callbacks run only inside a solver.
        unsafe { self.work.0.as_ref() }.solves
    }

    /// The operator's own error, which says more than PETSc's report that a callback failed.
    pub fn error(&mut self) -> Option<Error> {
        // SAFETY: as in `solves`, and borrowed mutably.
        unsafe { self.work.0.as_mut() }.error.take()
    }

    /// Collective over the `span`: the matrix of `power` with `rows` local ones of `order`.
    ///
    /// # Safety
    /// `self` outlives every use of the matrix and is not touched while a solver runs.
    pub unsafe fn matrix<'p>(
        &self,
        (petsc, span): (&'p Petsc<'_>, Span),
        power: usize,
        rows: usize,
        order: u64,
    ) -> Result<ShellMatrix<'p>> {
        let comm = span.comm(petsc);
        let (n, all) = (rows as sys::PetscInt, order as sys::PetscInt);
        let place = Pinned::new(Power { work: self.context(), power });
        let context = place.context();
        // SAFETY: a live communicator, a context that outlives the matrix, a valid output.
        let matrix = Handle::create(petsc, "creating an operator of the eigensolver", |m| unsafe {
            sys::MatCreateShell(comm, n, n, all, all, context, m)
        })?;
        let products: [(sys::MatOperation, Product); 2] = [
            (sys::MatOperation_MATOP_MULT, apply_matrix),
            (sys::MatOperation_MATOP_MULT_TRANSPOSE, apply_matrix_transposed),
        ];
        for (operation, product) in products {
            // SAFETY: PETSc stores every operation as a function without arguments and calls these two with those of a
            // product.
            let product = unsafe { std::mem::transmute::<Product, unsafe extern "C" fn()>(product) };
            check(
                // SAFETY: a live matrix, and the operation in the form that PETSc stores.
                unsafe { sys::MatShellSetOperation(matrix.raw(), operation, Some(product)) },
                "setting an operator of the eigensolver",
            )?;
        }
        Ok(ShellMatrix { matrix, _power: place })
    }

    /// Makes the spectral transformation shift and inversion by the operator's own inverse: the matrix at the target
    /// is never formed, its inverse is the preconditioner.
    ///
    /// # Safety
    /// `st` is live; `self` outlives every use of it.
    pub unsafe fn invert(&self, st: slepc::ST) -> Result<()> {
        let doing = "setting up the eigensolver's inverse";
        let (mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut());
        // SAFETY: live objects, strings that end in zero, valid outputs.
        unsafe {
            check(slepc::STSetType(st, c"sinvert".as_ptr()), doing)?;
            check(slepc::STSetMatMode(st, slepc::STMatMode_ST_MATMODE_SHELL), doing)?;
            check(slepc::STGetKSP(st, &mut ksp), doing)?;
            check(sys::KSPSetType(ksp, c"preonly".as_ptr()), doing)?;
            check(sys::KSPGetPC(ksp, &mut pc), doing)?;
            check(sys::PCSetType(pc, c"shell".as_ptr()), doing)?;
            check(sys::PCShellSetContext(pc, self.context()), doing)?;
            check(sys::PCShellSetApply(pc, Some(apply_inverse)), doing)?;
            check(sys::PCShellSetApplyTranspose(pc, Some(apply_inverse_transposed)), doing)
        }
    }
}

/// A product of a shell matrix as PETSc calls it.
type Product = unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec) -> sys::PetscErrorCode;

unsafe extern "C" fn apply_matrix(mat: sys::Mat, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    // SAFETY: what PETSc passes, passed on.
    unsafe { product(mat, x, y, false) }
}

unsafe extern "C" fn apply_matrix_transposed(mat: sys::Mat, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    // SAFETY: as above.
    unsafe { product(mat, x, y, true) }
}

/// y = A x or Aᵀ x.
///
/// # Safety
/// `mat` is one of [`Shell::matrix`]; the vectors are live, distinct, and of its layout.
unsafe fn product(mat: sys::Mat, x: sys::Vec, y: sys::Vec, transposed: bool) -> sys::PetscErrorCode {
    let mut place: *mut c_void = ptr::null_mut();
    // SAFETY: the shell matrix was made with a pointer to a Power that lives as long as it, as does the Work that it
    // points to. SLEPc passes live vectors, distinct, of the layout they were created with.
    unsafe {
        let code = sys::MatShellGetContext(mat, (&raw mut place).cast());
        if code != 0 {
            return code;
        }
        let Power { work, power } = *place.cast::<Power>();
        (*work.cast::<Work>()).guard(|w| {
            let operator = &mut w.operator;
            read(x, |x| {
                write(y, |y| match transposed {
                    false => operator.multiply(power, x, y),
                    true => operator.multiply_transposed(power, x, y),
                })
            })??
        })
    }
}

unsafe extern "C" fn apply_inverse(pc: sys::PC, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    // SAFETY: what PETSc passes, passed on.
    unsafe { inverse(pc, x, y, false) }
}

unsafe extern "C" fn apply_inverse_transposed(pc: sys::PC, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    // SAFETY: as above.
    unsafe { inverse(pc, x, y, true) }
}

/// y = P(σ)⁻¹ x or P(σ)⁻ᵀ x.
///
/// # Safety
/// `pc` is the preconditioner of [`Shell::invert`]; the vectors are live, distinct, and of its layout.
unsafe fn inverse(pc: sys::PC, x: sys::Vec, y: sys::Vec, transposed: bool) -> sys::PetscErrorCode {
    let mut work: *mut c_void = ptr::null_mut();
    // SAFETY: as in `apply_matrix`, for the preconditioner.
    unsafe {
        let code = sys::PCShellGetContext(pc, (&raw mut work).cast());
        if code != 0 {
            return code;
        }
        (*work.cast::<Work>()).guard(|w| {
            w.solves += 1;
            read(x, |x| {
                write(y, |y| {
                    y.copy_from_slice(x);
                    match transposed {
                        false => w.operator.solve(y),
                        true => w.operator.solve_transposed(y),
                    }
                })
            })??
        })
    }
}

/// Monitor of a solver of kind `S`; its context is [`Shell::context`].
pub(super) unsafe extern "C" fn monitor<S>(
    _solver: S,
    _its: sys::PetscInt,
    converged: sys::PetscInt,
    _re: *mut sys::PetscScalar,
    _im: *mut sys::PetscScalar,
    _errors: *mut sys::PetscReal,
    _n: sys::PetscInt,
    context: *mut c_void,
) -> sys::PetscErrorCode {
    // SAFETY: the context given with the monitor, which outlives the solve.
    unsafe {
        (*context.cast::<Work>()).guard(|w| {
            (w.progress)((converged.max(0) as usize).min(w.wanted), w.wanted);
            Ok(())
        })
    }
}
