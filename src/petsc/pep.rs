//! Quadratic eigenproblem (λ²M + λC + K) x = 0 with real matrices of any kind, eigenvalues nearest to a complex target, by
//! SLEPc's TOAR method, shift-invert, complex MUMPS.
//!
//! With its default scaling SLEPc reports convergence on wrong pairs of saddle-point problems with a singular mass. The scaling is
//! therefore set here, and every pair has to pass a backward error of our own.

use super::aij::assembled;
use super::csr::{norm2, DistCsr, Operator};
use super::handle::{read, vector, Handle};
use super::session::{check, Petsc};
use crate::parallel::World;
use crate::{Error, Result};
use mpi::raw::AsRaw;
use num_complex::Complex;
use petsc_sys as sys;
use slepc_sys as slepc;
use std::ffi::CString;
use std::ptr;

/// What to compute.
#[derive(Debug, Clone)]
pub struct QuadraticOptions {
    /// The eigenvalues nearest to this one are sought.
    pub target: Complex<f64>,
    /// Number of eigenpairs.
    pub count: usize,
    /// Largest accepted backward error.
    pub backward_error: f64,
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
    /// |(λ²M + λC + K) x| / ((|λ|²‖M‖ + |λ|‖C‖ + ‖K‖) |x|) of each, with norms of row sums (Tisseur, Linear Algebra Appl. 309, 2000).
    pub backward_error: Vec<f64>,
    /// Restarts of the method.
    pub iterations: usize,
}

/// Collective: the eigenpairs of (λ²M + λC + K) x = 0 nearest to the target. The matrices have the same ranges. Pairs that SLEPc
/// takes for converged but whose backward error is above the limit end the call with an error.
pub fn quadratic(
    petsc: &Petsc,
    stiffness: &DistCsr,
    damping: &DistCsr,
    mass: &DistCsr,
    options: &QuadraticOptions,
) -> Result<QuadraticModes> {
    let world = petsc.world();
    let order = stiffness.order();
    if options.count == 0 || order == 0 {
        return Ok(QuadraticModes::default());
    }
    if options.count as u64 > 2 * order {
        return Err(Error::Job(format!(
            "{} eigenvalues were asked for, but there are only {}",
            options.count,
            2 * order
        )));
    }
    // On a rank without rows TOAR's projected problem of SLEPc 3.18 holds garbage, and the ranks part ways.
    if stiffness.ranges.windows(2).any(|w| w[0] == w[1]) {
        return Err(Error::Job(format!(
            "the quadratic eigenproblem has {order} rows, and some of the {} ranks none of them; start fewer ranks",
            world.size
        )));
    }
    let given = [(stiffness, "K"), (damping, "C"), (mass, "M")];
    for (matrix, name) in given {
        matrix.validate(world, name)?;
    }
    let handles = given.iter().map(|(matrix, _)| assembled(petsc, matrix, 1)).collect::<Result<Vec<_>>>()?;
    let (pairs, iterations) = solve(petsc, &handles, stiffness.n_local(), order, options)?;
    drop(handles);
    let operators = given.map(|(matrix, _)| matrix.operator(world));
    let norms = given.map(|(matrix, _)| matrix.norm_inf(world));
    let mut modes = QuadraticModes { iterations, ..Default::default() };
    for (lambda, mut x) in pairs {
        let size = norm2(world, &parts(&x).concat());
        x.iter_mut().for_each(|v| *v /= size);
        let error = backward_error(world, &operators, &norms, lambda, &x);
        if error.is_nan() || error > options.backward_error {
            // Beyond those asked for, the first bad one ends the list.
            if modes.lambda.len() >= options.count {
                break;
            }
            return Err(Error::NotConverged(format!(
                "SLEPc takes eigenvalue {lambda:.6e} for converged, but its backward error is {error:.1e} (limit {:.0e}). Try another \
                 scaling by the PETSc option -{}pep_scale.",
                options.backward_error, options.prefix
            )));
        }
        modes.lambda.push(lambda);
        modes.vectors.push(x);
        modes.backward_error.push(error);
    }
    Ok(modes)
}

/// Real and imaginary part.
fn parts(x: &[Complex<f64>]) -> [Vec<f64>; 2] {
    [x.iter().map(|v| v.re).collect(), x.iter().map(|v| v.im).collect()]
}

/// Of K, C, M and their norms.
fn backward_error(
    world: &World,
    operators: &[Operator; 3],
    norms: &[f64; 3],
    lambda: Complex<f64>,
    x: &[Complex<f64>],
) -> f64 {
    let split = parts(x);
    let mut sum = vec![Complex::default(); x.len()];
    let mut y = vec![0.0; x.len()];
    let mut scale = 0.0;
    let mut power = Complex::new(1.0, 0.0);
    for (operator, norm) in operators.iter().zip(norms) {
        for (part, unit) in split.iter().zip([Complex::new(1.0, 0.0), Complex::i()]) {
            operator.apply(world, part, &mut y);
            sum.iter_mut().zip(&y).for_each(|(s, &y)| *s += power * unit * y);
        }
        scale += power.norm() * norm;
        power *= lambda;
    }
    norm2(world, &parts(&sum).concat()) / (scale * norm2(world, &split.concat()))
}

/// Eigenpairs as SLEPc gives them, and the number of restarts.
type Pairs = (Vec<(Complex<f64>, Vec<Complex<f64>>)>, usize);

fn solve(
    petsc: &Petsc,
    matrices: &[Handle<sys::Mat>],
    n: usize,
    order: u64,
    options: &QuadraticOptions,
) -> Result<Pairs> {
    let comm = petsc.world().comm.as_raw();
    let prefix =
        CString::new(options.prefix.as_str()).map_err(|_| Error::Defect("zero byte in an options prefix".into()))?;
    // PETSc passes MUMPS its ordering by the option only. SCOTCH (3) is used where MUMPS has it, else MUMPS chooses.
    petsc.default_option(&format!("{}st_mat_mumps_icntl_7", options.prefix), "3")?;
    // SAFETY: a live communicator and a valid output.
    let pep = Handle::create(petsc, "creating the quadratic eigensolver", |p| unsafe { slepc::PEPCreate(comm, p) })?;
    let x = vector(petsc, n, order)?;
    let mut raw: Vec<sys::Mat> = matrices.iter().map(Handle::raw).collect();
    let space = (2 * options.count).max(options.count + 15).min(order as usize);
    let doing = "setting up the quadratic eigensolver";
    // SAFETY: live objects, strings that end in zero, valid outputs.
    unsafe {
        let p = pep.raw();
        check(slepc::PEPSetOperators(p, 3, raw.as_mut_ptr()), doing)?;
        check(slepc::PEPSetProblemType(p, slepc::PEPProblemType_PEP_GENERAL), doing)?;
        check(slepc::PEPSetType(p, c"toar".as_ptr()), doing)?;
        check(slepc::PEPSetOptionsPrefix(p, prefix.as_ptr()), doing)?;
        let automatic = f64::from(sys::PETSC_DEFAULT);
        let none = ptr::null_mut();
        check(slepc::PEPSetScale(p, slepc::PEPScale_PEP_SCALE_BOTH, automatic, none, none, 5, 1.0), doing)?;
        check(slepc::PEPSetWhichEigenpairs(p, slepc::PEPWhich_PEP_TARGET_MAGNITUDE), doing)?;
        check(slepc::PEPSetTarget(p, options.target), doing)?;
        check(slepc::PEPSetTolerances(p, 1e-10, 200), doing)?;
        check(
            slepc::PEPSetDimensions(p, options.count as sys::PetscInt, space as sys::PetscInt, sys::PETSC_DEFAULT),
            doing,
        )?;
        let (mut st, mut ksp, mut pc) = (ptr::null_mut(), ptr::null_mut(), ptr::null_mut());
        check(slepc::PEPGetST(p, &mut st), doing)?;
        check(slepc::STSetType(st, c"sinvert".as_ptr()), doing)?;
        check(slepc::STGetKSP(st, &mut ksp), doing)?;
        check(sys::KSPSetType(ksp, c"preonly".as_ptr()), doing)?;
        // Else a failed factorisation would pass for a solve.
        check(sys::KSPSetErrorIfNotConverged(ksp, sys::PetscBool_PETSC_TRUE), doing)?;
        check(sys::KSPGetPC(ksp, &mut pc), doing)?;
        check(sys::PCSetType(pc, c"lu".as_ptr()), doing)?;
        // PETSc's own factorisation, its default, breaks down on the zero pivots of a saddle point.
        check(sys::PCFactorSetMatSolverType(pc, c"mumps".as_ptr()), doing)?;
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
        pairs.sort_by(|a, b| (a.0 - options.target).norm().total_cmp(&(b.0 - options.target).norm()));
        Ok((pairs, iterations as usize))
    }
}
