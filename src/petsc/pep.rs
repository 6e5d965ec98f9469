//! Quadratic eigenproblem (λ²M + λC + K) x = 0, eigenvalues nearest to a complex target, by SLEPc's TOAR method with shift
//! and inversion. The matrices and the inverse at the target are given by what they do to a vector.
//!
//! SLEPc has been seen to report convergence on wrong pairs of saddle-point problems with a singular mass: the caller scales the
//! problem so that the unknowns are of one size and |target| is about 1, and judges every pair on a residual of its own.

use super::handle::{read, vector, write, Handle};
use super::session::{check, Petsc};
use crate::{Error, Result};
use mpi::raw::AsRaw;
use num_complex::Complex;
use petsc_sys as sys;
use slepc_sys as slepc;
use std::ffi::{c_void, CString};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::ptr;

/// A quadratic eigenproblem as the solver sees it, distributed over the ranks by rows.
pub trait QuadraticOperator {
    /// Rows on this rank; at least one.
    fn n_local(&self) -> usize;

    /// Collective: y = K x, C x, M x for power 0, 1, 2; local rows.
    fn multiply(&mut self, power: usize, x: &[Complex<f64>], y: &mut [Complex<f64>]) -> Result<()>;

    /// Collective: x := (σ²M + σC + K)⁻¹ x at the target σ; local rows.
    fn solve(&mut self, x: &mut [Complex<f64>]) -> Result<()>;
}

/// What to compute.
#[derive(Debug, Clone)]
pub struct QuadraticOptions {
    /// The eigenvalues nearest to this one are sought.
    pub target: Complex<f64>,
    /// Number of eigenpairs.
    pub count: usize,
    /// SLEPc's own tolerance, relative to the eigenvalue.
    pub tolerance: f64,
    /// Prefix of the solver's options, such as `"stability_"`.
    pub prefix: String,
}

/// Eigenpairs, the nearest to the target first. There may be more than were asked for.
#[derive(Debug, Clone, Default)]
pub struct QuadraticModes {
    /// Eigenvalues.
    pub lambda: Vec<Complex<f64>>,
    /// Local rows of each eigenvector, of Euclidean norm 1.
    pub vectors: Vec<Vec<Complex<f64>>>,
    /// Restarts of the method.
    pub iterations: usize,
    /// Solves with the matrix at the target.
    pub solves: usize,
}

/// What the callbacks work on.
struct Context<'a> {
    operator: &'a mut dyn QuadraticOperator,
    progress: &'a mut dyn FnMut(usize, usize),
    wanted: usize,
    solves: usize,
    error: Option<Error>,
}

/// One of the shell matrices.
struct Power {
    context: *mut c_void,
    power: usize,
}

impl Context<'_> {
    /// Runs a callback's work: neither an error nor a panic may cross C as anything but a code.
    fn guard(&mut self, work: impl FnOnce(&mut Self) -> Result<()>) -> sys::PetscErrorCode {
        let outcome = catch_unwind(AssertUnwindSafe(|| work(self)));
        let error = match outcome {
            Ok(Ok(())) => return 0,
            Ok(Err(error)) => error,
            Err(_) => Error::Defect("panic in the quadratic eigensolver's operator".into()),
        };
        self.error.get_or_insert(error);
        sys::PETSC_ERR_USER as sys::PetscErrorCode
    }
}

unsafe extern "C" fn apply_matrix(mat: sys::Mat, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    let mut power: *mut c_void = ptr::null_mut();
    // SAFETY: the shell matrix was made with a pointer to a Power that outlives the solve, as does the Context that it points to.
    unsafe {
        let code = sys::MatShellGetContext(mat, (&raw mut power).cast());
        if code != 0 {
            return code;
        }
        let Power { context, power } = *power.cast::<Power>();
        // SAFETY: SLEPc passes live vectors, distinct, of the layout they were created with.
        (*context.cast::<Context>()).guard(|c| read(x, |x| write(y, |y| c.operator.multiply(power, x, y)))??)
    }
}

unsafe extern "C" fn apply_inverse(pc: sys::PC, x: sys::Vec, y: sys::Vec) -> sys::PetscErrorCode {
    let mut context: *mut c_void = ptr::null_mut();
    // SAFETY: as in `apply_matrix`, for the preconditioner.
    unsafe {
        let code = sys::PCShellGetContext(pc, (&raw mut context).cast());
        if code != 0 {
            return code;
        }
        (*context.cast::<Context>()).guard(|c| {
            c.solves += 1;
            read(x, |x| {
                write(y, |y| {
                    y.copy_from_slice(x);
                    c.operator.solve(y)
                })
            })??
        })
    }
}

unsafe extern "C" fn monitor(
    _pep: slepc::PEP,
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
        (*context.cast::<Context>()).guard(|c| {
            (c.progress)((converged.max(0) as usize).min(c.wanted), c.wanted);
            Ok(())
        })
    }
}

/// Collective: the eigenpairs nearest to the target. `start` holds the local rows of the vector to begin with. `progress` is told converged
/// and wanted pairs at every restart.
pub fn quadratic(
    petsc: &Petsc,
    operator: &mut dyn QuadraticOperator,
    start: &[Complex<f64>],
    options: &QuadraticOptions,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<QuadraticModes> {
    let world = petsc.world();
    let n = operator.n_local();
    let order = world.sum_u64(n as u64);
    // On a rank without rows TOAR's projected problem of SLEPc 3.18 holds garbage, and the ranks part ways.
    world.agree(match n {
        0 => Err(Error::Defect("quadratic eigenproblem: a rank without rows".into())),
        _ if start.len() != n => Err(Error::Defect(format!("a start of {} values for {n} rows", start.len()))),
        _ => Ok(()),
    })?;
    if options.count as u64 > 2 * order {
        return Err(Error::Job(format!(
            "{} eigenvalues were asked for, but there are only {}; ask for fewer",
            options.count,
            2 * order
        )));
    }
    let mut context = Context { operator, progress, wanted: options.count, solves: 0, error: None };
    let pointer: *mut c_void = (&raw mut context).cast();
    let solved = solve(petsc, pointer, start, order, options);
    let solves = context.solves;
    // The operator's own error says more than PETSc's report that a callback failed.
    if let Some(error) = context.error.take() {
        return Err(error);
    }
    let (mut pairs, iterations) = solved?;
    pairs.sort_by(|a, b| (a.0 - options.target).norm().total_cmp(&(b.0 - options.target).norm()));
    let (lambda, vectors) = pairs.into_iter().unzip();
    Ok(QuadraticModes { lambda, vectors, iterations, solves })
}

/// Eigenpairs as SLEPc gives them, and the number of restarts.
type Pairs = (Vec<(Complex<f64>, Vec<Complex<f64>>)>, usize);

fn solve(
    petsc: &Petsc,
    context: *mut c_void,
    start: &[Complex<f64>],
    order: u64,
    options: &QuadraticOptions,
) -> Result<Pairs> {
    let comm = petsc.world().comm.as_raw();
    let (rows, all) = (start.len() as sys::PetscInt, order as sys::PetscInt);
    let prefix =
        CString::new(options.prefix.as_str()).map_err(|_| Error::Defect("zero byte in an options prefix".into()))?;
    // SAFETY: PETSc stores every operation as a function without arguments and calls MULT with those of `apply_matrix`.
    let multiply = unsafe {
        std::mem::transmute::<
            unsafe extern "C" fn(sys::Mat, sys::Vec, sys::Vec) -> sys::PetscErrorCode,
            unsafe extern "C" fn(),
        >(apply_matrix)
    };
    let mut powers = [0, 1, 2].map(|power| Power { context, power });
    let mut matrices = Vec::new();
    for power in &mut powers {
        let place: *mut c_void = (&raw mut *power).cast();
        // SAFETY: a live communicator, a context that outlives the matrix, a valid output.
        let matrix = Handle::create(petsc, "creating a matrix of the quadratic eigenproblem", |m| unsafe {
            sys::MatCreateShell(comm, rows, rows, all, all, place, m)
        })?;
        check(
            // SAFETY: a live matrix, and the operation in the form that PETSc stores.
            unsafe { sys::MatShellSetOperation(matrix.raw(), sys::MatOperation_MATOP_MULT, Some(multiply)) },
            "setting a matrix of the quadratic eigenproblem",
        )?;
        matrices.push(matrix);
    }
    // SAFETY: a live communicator and a valid output.
    let pep = Handle::create(petsc, "creating the quadratic eigensolver", |p| unsafe { slepc::PEPCreate(comm, p) })?;
    let x = vector(petsc, start.len(), order)?;
    // SAFETY: a live vector that nothing else uses.
    unsafe { write(x.raw(), |v| v.copy_from_slice(start))? };
    let mut raw: Vec<sys::Mat> = matrices.iter().map(Handle::raw).collect();
    let space = (2 * options.count).max(options.count + 15).min(order as usize);
    let doing = "setting up the quadratic eigensolver";
    // SAFETY: live objects, strings that end in zero, valid outputs; the callbacks' context outlives the solver.
    unsafe {
        let p = pep.raw();
        check(slepc::PEPSetOperators(p, 3, raw.as_mut_ptr()), doing)?;
        check(slepc::PEPSetProblemType(p, slepc::PEPProblemType_PEP_GENERAL), doing)?;
        check(slepc::PEPSetType(p, c"toar".as_ptr()), doing)?;
        check(slepc::PEPSetOptionsPrefix(p, prefix.as_ptr()), doing)?;
        check(slepc::PEPSetWhichEigenpairs(p, slepc::PEPWhich_PEP_TARGET_MAGNITUDE), doing)?;
        check(slepc::PEPSetTarget(p, options.target), doing)?;
        check(slepc::PEPSetTolerances(p, options.tolerance, 200), doing)?;
        check(
            slepc::PEPSetDimensions(p, options.count as sys::PetscInt, space as sys::PetscInt, sys::PETSC_DEFAULT),
            doing,
        )?;
        let mut first = x.raw();
        check(slepc::PEPSetInitialSpace(p, 1, &mut first), doing)?;
        check(slepc::PEPMonitorSet(p, Some(monitor), context, None), doing)?;
        let (mut st, mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut(), ptr::null_mut());
        check(slepc::PEPGetST(p, &mut st), doing)?;
        check(slepc::STSetType(st, c"sinvert".as_ptr()), doing)?;
        // The matrix at the target is never formed; its inverse is the preconditioner.
        check(slepc::STSetMatMode(st, slepc::STMatMode_ST_MATMODE_SHELL), doing)?;
        check(slepc::STGetKSP(st, &mut ksp), doing)?;
        check(sys::KSPSetType(ksp, c"preonly".as_ptr()), doing)?;
        check(sys::KSPGetPC(ksp, &mut pc), doing)?;
        check(sys::PCSetType(pc, c"shell".as_ptr()), doing)?;
        check(sys::PCShellSetContext(pc, context), doing)?;
        check(sys::PCShellSetApply(pc, Some(apply_inverse)), doing)?;
        check(slepc::PEPSetFromOptions(p), doing)?;
        check(slepc::PEPSolve(p), "solving the quadratic eigenproblem")?;

        let (mut converged, mut iterations, mut reason) = (0, 0, 0);
        check(slepc::PEPGetConverged(p, &mut converged), doing)?;
        check(slepc::PEPGetIterationNumber(p, &mut iterations), doing)?;
        check(slepc::PEPGetConvergedReason(p, &mut reason), doing)?;
        if (converged as usize) < options.count {
            return Err(Error::NotConverged(format!(
                "quadratic eigenproblem: only {converged} of {} eigenvalues converged in {iterations} restarts (SLEPc reason {reason}). \
                 Ask for fewer, or give a larger subspace with the PETSc option -{}pep_ncv.",
                options.count, options.prefix
            )));
        }
        let mut pairs = Vec::with_capacity(converged as usize);
        for i in 0..converged {
            let mut value = Complex::default();
            check(
                slepc::PEPGetEigenpair(p, i, &mut value, ptr::null_mut(), x.raw(), ptr::null_mut()),
                "reading an eigenpair",
            )?;
            pairs.push((value, read(x.raw(), <[Complex<f64>]>::to_vec)?));
        }
        Ok((pairs, iterations as usize))
    }
}
