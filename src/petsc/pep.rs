//! Quadratic eigenproblem (λ²M + λC + K) x = 0, eigenvalues nearest to a complex target, by SLEPc's TOAR method with
//! shift and inversion. The matrices and the inverse at the target are given by what they do to a vector.
//!
//! SLEPc has been seen to report convergence on wrong pairs of saddle-point problems with a singular mass: the caller
//! scales the problem so that the unknowns are of one size and |target| is about 1, and judges every pair on a
//! residual of its own.

use super::handle::{read, vector, write, Handle, Span};
use super::session::{check, Petsc};
use super::shell::{monitor, Shell, ShellOperator};
use crate::{Error, Result};
use mpi::raw::AsRaw;
use num_complex::Complex;
use petsc_sys as sys;
use slepc_sys as slepc;
use std::ffi::CString;
use std::ptr;

/// Settings of the computation.
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

/// Collective: the eigenpairs nearest to the target. `start` holds the local rows of the vector to begin with.
/// `progress` is told converged and wanted pairs at every restart.
pub fn quadratic(
    petsc: &Petsc,
    operator: &mut dyn ShellOperator,
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
    let mut shell = Shell::new(operator, progress, options.count);
    let solved = solve(petsc, &shell, start, order, options);
    let solves = shell.solves();
    if let Some(error) = shell.error() {
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
    shell: &Shell,
    start: &[Complex<f64>],
    order: u64,
    options: &QuadraticOptions,
) -> Result<Pairs> {
    let comm = petsc.world().comm.as_raw();
    let prefix =
        CString::new(options.prefix.as_str()).map_err(|_| Error::Defect("zero byte in an options prefix".into()))?;
    let mut matrices = Vec::new();
    for power in 0..3 {
        // SAFETY: the shell outlives this function, and nothing here touches it while the solver runs.
        matrices.push(unsafe { shell.matrix((petsc, Span::World), power, start.len(), order)? });
    }
    // SAFETY: a live communicator and a valid output.
    let pep = Handle::create(petsc, "creating the quadratic eigensolver", |p| unsafe { slepc::PEPCreate(comm, p) })?;
    let x = vector(petsc, start.len(), order)?;
    // SAFETY: a live vector that nothing else uses.
    unsafe { write(x.raw(), |v| v.copy_from_slice(start))? };
    let mut raw: Vec<sys::Mat> = matrices.iter().map(|m| m.raw()).collect();
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
        let [count, space] = [options.count, space].map(|n| n as sys::PetscInt);
        check(slepc::PEPSetDimensions(p, count, space, sys::PETSC_DEFAULT as sys::PetscInt), doing)?;
        let mut first = x.raw();
        check(slepc::PEPSetInitialSpace(p, 1, &mut first), doing)?;
        check(slepc::PEPMonitorSet(p, Some(monitor::<slepc::PEP>), shell.context(), None), doing)?;
        let mut st = ptr::null_mut();
        check(slepc::PEPGetST(p, &mut st), doing)?;
        shell.invert(st)?;
        check(slepc::PEPSetFromOptions(p), doing)?;
        check(slepc::PEPSolve(p), "solving the quadratic eigenproblem")?;

        let (mut converged, mut iterations, mut reason) = (0, 0, 0);
        check(slepc::PEPGetConverged(p, &mut converged), doing)?;
        check(slepc::PEPGetIterationNumber(p, &mut iterations), doing)?;
        check(slepc::PEPGetConvergedReason(p, &mut reason), doing)?;
        if (converged as usize) < options.count {
            return Err(Error::NotConverged(format!(
                "quadratic eigenproblem: only {converged} of {} eigenvalues converged in {iterations} restarts \
                 (SLEPc reason {reason}). \
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
