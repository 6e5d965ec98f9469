//! Real symmetric generalised eigenproblem K x = λ M x by SLEPc's Krylov–Schur method, shift-invert.
//!
//! SLEPc sees complex vectors, but the operator (K − σM)⁻¹M is applied with the real factorisation: a real starting
//! vector stays real, as every product with a zero imaginary part is an exact zero. It is the second opinion on the
//! block method of [`crate::eigen`], which judges what both find.

use super::csr::norm2;
use super::handle::{read, vector, write, Handle, Span};
use super::operator::Operator;
use super::session::{check, Petsc};
use super::shell::{monitor, Shell, ShellOperator};
use crate::parallel::World;
use crate::{Error, Result};
use mpi::raw::AsRaw;
use num_complex::Complex;
use petsc_sys as sys;
use slepc_sys as slepc;
use std::ffi::CString;
use std::ptr;

/// Real linear solves with K − σM, local rows in place.
pub(crate) type Solve<'a> = dyn FnMut(&mut [f64]) -> Result<()> + 'a;

/// Parameters of the solve.
pub(crate) struct EpsSettings<'a> {
    /// Shift σ of the inverse; the eigenvalues nearest to it are sought.
    pub sigma: f64,
    /// Eigenvectors that are known and not sought, local rows one after the other, orthonormal in M.
    pub known: &'a [f64],
    /// Number of eigenpairs.
    pub count: usize,
    /// Prefix of the solver's options, such as `"lower_"`.
    pub prefix: &'a str,
}

/// Eigenpairs as SLEPc gives them. There may be more than were asked for.
pub(crate) struct Pairs {
    /// Eigenvalues.
    pub lambda: Vec<f64>,
    /// Local rows of the eigenvectors, one after the other.
    pub vectors: Vec<f64>,
    /// Restarts of the method.
    pub restarts: usize,
    /// Right-hand sides solved.
    pub solves: usize,
}

/// M and the inverse of K − σM.
struct Inverted<'a, 'w> {
    world: &'a World,
    inverse: &'a mut Solve<'w>,
    mass: &'a Operator<'a>,
}

impl ShellOperator for Inverted<'_, '_> {
    fn n_local(&self) -> usize {
        self.mass.matrix().n_local()
    }

    /// The mass alone: SLEPc never multiplies by the stiffness.
    fn multiply(&mut self, _power: usize, x: &[Complex<f64>], y: &mut [Complex<f64>]) -> Result<()> {
        let (world, mass) = (self.world, self.mass);
        y.copy_from_slice(x);
        each_part(world, y, &mut |part| {
            let mut product = vec![0.0; part.len()];
            mass.apply(world, part, &mut product);
            part.copy_from_slice(&product);
            Ok(())
        })
    }

    fn solve(&mut self, x: &mut [Complex<f64>]) -> Result<()> {
        let inverse = &mut *self.inverse;
        each_part(self.world, x, &mut |part| inverse(part))
    }
}

/// Collective: real work on the real and on the imaginary part, the latter only if there is one on any rank.
fn each_part(world: &World, x: &mut [Complex<f64>], work: &mut dyn FnMut(&mut [f64]) -> Result<()>) -> Result<()> {
    let mut real: Vec<f64> = x.iter().map(|v| v.re).collect();
    let mut imaginary: Vec<f64> = x.iter().map(|v| v.im).collect();
    work(&mut real)?;
    if world.max(f64::from(u8::from(imaginary.iter().any(|&v| v != 0.0)))) > 0.0 {
        work(&mut imaginary)?;
    }
    for ((x, re), im) in x.iter_mut().zip(real).zip(imaginary) {
        *x = Complex::new(re, im);
    }
    Ok(())
}

/// Collective: the eigenpairs of K x = λ M x nearest to the shift. `inverse` solves with K − σM; K and M are
/// symmetric, M positive definite, and there are at least as many degrees of freedom as wanted pairs. `progress` is
/// told converged and wanted pairs at every restart.
pub(crate) fn pairs(
    petsc: &Petsc,
    inverse: &mut Solve,
    mass: &Operator,
    wanted: &EpsSettings,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Pairs> {
    let matrix = mass.matrix();
    let (n, order) = (matrix.n_local(), matrix.order());
    let mut operator = Inverted { world: petsc.world(), inverse, mass };
    let mut shell = Shell::new(&mut operator, progress, wanted.count);
    let solved = solve(petsc, &shell, n, order, wanted);
    let solves = shell.solves();
    if let Some(error) = shell.error() {
        return Err(error.context("modes"));
    }
    Ok(Pairs { solves, ..solved? })
}

fn solve(petsc: &Petsc, shell: &Shell, n: usize, order: u64, options: &EpsSettings) -> Result<Pairs> {
    let comm = petsc.world().comm.as_raw();
    // SAFETY: the shell outlives this function, and nothing here touches it while the solver runs.
    let mass = unsafe { shell.matrix((petsc, Span::World), 1, n, order)? };
    // SAFETY: a valid output.
    let eps = Handle::create(petsc, "creating the eigensolver", |e| unsafe { slepc::EPSCreate(comm, e) })?;
    let start = vector(petsc, n, order)?;
    let first = options_start(petsc.world(), order, n);
    // SAFETY: a live vector that nothing else uses.
    unsafe { write(start.raw(), |v| v.iter_mut().zip(first).for_each(|(v, x)| *v = Complex::new(x, 0.0)))? };
    let prefix = CString::new(options.prefix).map_err(|_| Error::Defect("zero byte in an options prefix".into()))?;
    let known = options.known.len().checked_div(n).unwrap_or(0);
    let known = petsc.world().max(known as f64) as usize;
    let mut deflated = Vec::new();
    for k in 0..known {
        let vector = vector(petsc, n, order)?;
        let values = &options.known[k * n..(k + 1) * n];
        // SAFETY: a live vector that nothing else uses.
        unsafe { write(vector.raw(), |v| v.iter_mut().zip(values).for_each(|(v, x)| *v = Complex::from(*x)))? };
        deflated.push(vector);
    }
    let (count, subspace) = dimensions(options.count, order - known as u64);
    let doing = "setting up the eigensolver";
    // SAFETY: live objects; strings end in zero; the callbacks' context outlives the solver.
    unsafe {
        let e = eps.raw();
        // The shifted matrix is never formed by SLEPc, and its first part never multiplied: the preconditioner is its
        // inverse.
        check(slepc::EPSSetOperators(e, mass.raw(), mass.raw()), doing)?;
        check(slepc::EPSSetProblemType(e, slepc::EPSProblemType_EPS_GHEP), doing)?;
        check(slepc::EPSSetType(e, c"krylovschur".as_ptr()), doing)?;
        check(slepc::EPSSetOptionsPrefix(e, prefix.as_ptr()), doing)?;
        check(slepc::EPSSetWhichEigenpairs(e, slepc::EPSWhich_EPS_TARGET_MAGNITUDE), doing)?;
        check(slepc::EPSSetTarget(e, Complex::new(options.sigma, 0.0)), doing)?;
        check(slepc::EPSSetDimensions(e, count, subspace, sys::PETSC_DEFAULT as sys::PetscInt), doing)?;
        check(slepc::EPSSetTolerances(e, 1e-9, 200), doing)?;
        // The image of each vector is what is returned: its residual is free of the high frequencies, which K would
        // enlarge, even where the material is nearly incompressible.
        check(slepc::EPSSetPurify(e, sys::PETSC_TRUE), doing)?;
        if !deflated.is_empty() {
            let mut all: Vec<sys::Vec> = deflated.iter().map(|v| v.raw()).collect();
            check(slepc::EPSSetDeflationSpace(e, all.len() as sys::PetscInt, all.as_mut_ptr()), doing)?;
        }
        let mut first = start.raw();
        check(slepc::EPSSetInitialSpace(e, 1, &mut first), doing)?;
        check(slepc::EPSMonitorSet(e, Some(monitor::<slepc::EPS>), shell.context(), None), doing)?;
        let mut st = ptr::null_mut();
        check(slepc::EPSGetST(e, &mut st), doing)?;
        shell.invert(st)?;
        check(slepc::EPSSetFromOptions(e), doing)?;
        check(slepc::EPSSolve(e), "solving for modes")?;

        let (mut converged, mut iterations, mut reason) = (0, 0, 0);
        check(slepc::EPSGetConverged(e, &mut converged), doing)?;
        check(slepc::EPSGetIterationNumber(e, &mut iterations), doing)?;
        check(slepc::EPSGetConvergedReason(e, &mut reason), doing)?;
        if (converged as usize) < options.count {
            return Err(Error::NotConverged(format!(
                "modes: only {converged} of {} converged in {iterations} restarts (SLEPc reason {reason}). Ask \
                 for fewer \
                 modes, or give a larger subspace with the PETSc option -{}eps_ncv.",
                options.count, options.prefix
            )));
        }
        let mut pairs = Pairs { lambda: Vec::new(), vectors: Vec::new(), restarts: iterations as usize, solves: 0 };
        for i in 0..converged {
            let mut value = Complex::default();
            let null = ptr::null_mut();
            check(slepc::EPSGetEigenpair(e, i, &mut value, ptr::null_mut(), start.raw(), null), "reading a mode")?;
            let x = read(start.raw(), <[Complex<f64>]>::to_vec)?;
            pairs.lambda.push(value.re);
            pairs.vectors.extend(real_part(petsc.world(), &x, i)?);
        }
        Ok(pairs)
    }
}

/// Number of pairs and dimension of the subspace. A small problem takes all of its space.
fn dimensions(count: usize, order: u64) -> (sys::PetscInt, sys::PetscInt) {
    let subspace = (2 * count).max(count + 20).min(order as usize);
    (count as sys::PetscInt, subspace as sys::PetscInt)
}

/// A starting vector with parts of every mode, the same on any number of ranks.
fn options_start(world: &World, order: u64, n: usize) -> impl Iterator<Item = f64> {
    // The rows before this rank's.
    let mine = [n as u64];
    let all = world.all_gather(&mine);
    let first: u64 = all[..world.rank].iter().sum();
    debug_assert!(first <= order);
    (first..first + n as u64).map(|i| {
        // Weyl's sequence: equidistributed, without a period that a regular numbering could meet.
        let golden = 0.618_033_988_749_894_9;
        (i as f64 * golden).fract() - 0.5 + 0.3 * (i as f64 * 0.754_877_666_246_692_7).fract()
    })
}

/// The eigenvector turned to the phase in which it is real.
fn real_part(world: &World, x: &[Complex<f64>], index: sys::PetscInt) -> Result<Vec<f64>> {
    // Σ x² has twice the phase of a real vector times a phase.
    let square: Complex<f64> = x.iter().map(|v| v * v).sum();
    let square = Complex::new(world.sum(square.re), world.sum(square.im));
    let turn = Complex::from_polar(1.0, -0.5 * square.arg());
    let rotated: Vec<Complex<f64>> = x.iter().map(|v| v * turn).collect();
    let real: Vec<f64> = rotated.iter().map(|v| v.re).collect();
    let imaginary: Vec<f64> = rotated.iter().map(|v| v.im).collect();
    let (re, im) = (norm2(world, &real), norm2(world, &imaginary));
    if im.is_nan() || im > 1e-10 * re {
        return Err(Error::NotConverged(format!(
            "mode {}: the eigenvector of a real problem came back complex ({:.1e} of it imaginary)",
            index + 1,
            im / re
        )));
    }
    Ok(real)
}
