//! Iterative solver for real symmetric positive definite matrices too large to factorise: conjugate gradients
//! preconditioned by PETSc's algebraic multigrid (GAMG, smoothed aggregation with the rigid-body motions as near null
//! space).
//!
//! PETSc's vectors are complex and the matrix is real, so one complex solve carries two real right-hand sides, one in
//! the real and one in the imaginary part.

use super::aij::assembled;
use super::csr::{dot, norm2, DistCsr};
use super::handle::{read, vector, write, Handle};
use super::operator::{Held, Operator};
use super::session::{check, Petsc};
use crate::{Error, Result};
use faer::Mat;
use mpi::raw::AsRaw;
use num_complex::Complex;
use petsc_sys as sys;
use std::ffi::CString;
use std::ptr;

/// How to solve.
#[derive(Debug, Clone)]
pub struct IterativeOptions {
    /// |b − Ax| / |b| to reach for each right-hand side.
    pub tolerance: f64,
    /// Iterations after which the solver gives up.
    pub max_iterations: usize,
    /// Prefix of the solver's options, such as `"lower_"`.
    pub prefix: String,
}

/// A matrix with its multigrid hierarchy.
pub struct Iterative<'p> {
    petsc: &'p Petsc<'p>,
    operator: Operator<'p>,
    ksp: Handle<'p, sys::KSP>,
    b: Handle<'p, sys::Vec>,
    x: Handle<'p, sys::Vec>,
    options: IterativeOptions,
    iterations: usize,
    solves: usize,
}

/// Norm of a solution.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Norm {
    /// The Euclidean norm of the residual r.
    Residual,
    /// (rᵀBr)^½ with the preconditioner B, near the energy norm of the error.
    Energy,
}

/// Settings of GAMG that differ from PETSc's defaults, unless the user gives them. The flat elements between a fine
/// contact patch and a coarse rim need both: with Jacobi smoothing such a mesh takes four times the iterations, on
/// one of 143 000 rows more than 300 instead of 72.
const DEFAULTS: &[(&str, &str)] = &[
    ("pc_gamg_threshold", "0.04"),
    ("mg_levels_pc_type", "sor"),
    // The largest eigenvalue of each level. With conjugate gradients, PETSc's own choice, an indefinite matrix ends
    // the iteration early, and what it then takes for a tridiagonal matrix may hold anything: with a NaN in it a loop
    // of `KSPComputeExtremeSingularValues_CG` (3.18) has no end, on this rank alone.
    ("pc_gamg_esteig_ksp_type", "gmres"),
];

/// Shift of the diagonal in the smoother, as a part of the largest entry. An aggregate of fewer nodes than it takes
/// for six independent motions leaves zero rows on the coarse grid, which successive over-relaxation would divide by.
const DIAGONAL_SHIFT: f64 = 1e-10;

impl<'p> Iterative<'p> {
    /// Collective: sets up the solver of `matrix`, whose rows come in blocks of `block` (3 for displacements, 1 if
    /// rows do not come in equal blocks). `near_null` holds the local rows of vectors that the matrix without its
    /// supports maps to zero. `name` stands for the matrix in messages.
    pub fn new(
        petsc: &'p Petsc<'p>,
        matrix: impl Into<Held<'p>>,
        block: usize,
        near_null: &[Vec<f64>],
        options: IterativeOptions,
        name: &str,
    ) -> Result<Self> {
        let world = petsc.world();
        let matrix = matrix.into();
        matrix.validate(world, name)?;
        let whole = |rows: u64| rows.is_multiple_of(block as u64);
        if !matrix.ranges.iter().all(|&r| whole(r)) {
            return Err(Error::Defect(format!("matrix {name}: row ranges {:?} cut blocks of {block}", matrix.ranges)));
        }
        let a = assembled(petsc, &matrix, block)?;
        for property in [sys::MatOption_MAT_SYMMETRIC, sys::MatOption_MAT_HERMITIAN, sys::MatOption_MAT_SPD] {
            // SAFETY: a live matrix.
            check(unsafe { sys::MatSetOption(a.raw(), property, sys::PETSC_TRUE) }, "setting up multigrid")?;
        }
        near_null_space(petsc, &a, &matrix, near_null)?;
        let ksp = solver(petsc, &a, &options, DIAGONAL_SHIFT * matrix.max_abs(world))?;
        let (n, order) = (matrix.n_local(), matrix.order());
        let (b, x) = (vector(petsc, n, order)?, vector(petsc, n, order)?);
        Ok(Self { petsc, operator: Operator::new(world, matrix), ksp, b, x, options, iterations: 0, solves: 0 })
    }

    /// Collective: solves for `nrhs` right-hand sides in place. `rhs`: local rows, `[n_local, nrhs]` column by column.
    pub fn solve(&mut self, rhs: &mut [f64], nrhs: usize) -> Result<()> {
        let mut x = vec![0.0; rhs.len()];
        self.iterate(&mut x, rhs, nrhs, self.options.tolerance, Norm::Residual)?;
        rhs.copy_from_slice(&x);
        Ok(())
    }

    /// Collective: improves the approximate solutions `x` of `nrhs` right-hand sides until (rᵀBr)^½ ≤
    /// `tolerance`·(bᵀBb)^½ for each, with r = b − Ax and the preconditioner B in the place of A⁻¹: then the error of
    /// x is so small in the energy norm, which bounds the error at any one place, as the norm of r does not. Only
    /// what x lacks is solved for. Local rows, `[n_local, nrhs]` column by column.
    pub fn improve(&mut self, x: &mut [f64], rhs: &[f64], nrhs: usize, tolerance: f64) -> Result<()> {
        self.iterate(x, rhs, nrhs, tolerance, Norm::Energy)
    }

    fn iterate(&mut self, x: &mut [f64], rhs: &[f64], nrhs: usize, tolerance: f64, norm: Norm) -> Result<()> {
        let n = self.operator.matrix().n_local();
        let right = [&*x, rhs].iter().all(|v| v.len() == n * nrhs && v.iter().all(|v| v.is_finite()));
        self.petsc.world().agree(right.then_some(()).ok_or_else(|| {
            Error::Defect(format!(
                "right-hand side of {} values for {nrhs} columns of {n} rows, or not finite",
                rhs.len()
            ))
        }))?;
        for pair in 0..nrhs.div_ceil(2) {
            let columns = (nrhs - 2 * pair).min(2);
            let span = 2 * pair * n..(2 * pair + columns) * n;
            self.iterate_pair(&mut x[span.clone()], &rhs[span], columns, tolerance, norm)?;
        }
        Ok(())
    }

    /// One or two columns. They are scaled to norm 1, so that one tolerance serves both.
    fn iterate_pair(&mut self, x: &mut [f64], rhs: &[f64], columns: usize, tolerance: f64, norm: Norm) -> Result<()> {
        let world = self.petsc.world();
        let n = self.operator.matrix().n_local();
        let norms = self.norms(rhs, columns, norm)?;
        for (j, _) in norms.iter().enumerate().filter(|(_, norm)| **norm == 0.0) {
            x[j * n..][..n].fill(0.0);
        }
        let mut left = vec![0.0; columns * n];
        let mut size = f64::INFINITY;
        // A second pass makes up for the drift of the recursive residual.
        for pass in 0..4 {
            // What is left of each right-hand side, relative to it.
            let mut ax = vec![0.0; n];
            for j in 0..columns {
                let span = j * n..(j + 1) * n;
                self.operator.apply(world, &x[span.clone()], &mut ax);
                for ((l, b), ax) in left[span.clone()].iter_mut().zip(&rhs[span]).zip(&ax) {
                    *l = scaled(b - ax, norms[j]);
                }
            }
            size = self.norms(&left, columns, norm)?.into_iter().fold(0.0, f64::max);
            if size <= tolerance {
                return Ok(());
            }
            if pass == 3 || !size.is_finite() {
                break;
            }
            let gain = self.correct(&left, columns, (0.5 * tolerance / size).min(0.5), norm)?;
            for (i, (x, d)) in x.iter_mut().zip(&gain).enumerate() {
                *x += d * norms[i / n];
            }
        }
        Err(Error::NotConverged(format!(
            "{}conjugate gradients with multigrid: the residual is {:.1e} of the right-hand side, not {:.1e} as \
             asked for, after {} iterations. \
             Use solver.linear \"mumps\", or choose another preconditioner by the PETSc option -{}pc_type.",
            self.options.prefix, size, tolerance, self.iterations, self.options.prefix
        )))
    }

    /// Norms of one or two columns.
    fn norms(&self, v: &[f64], columns: usize, norm: Norm) -> Result<Vec<f64>> {
        let world = self.petsc.world();
        let n = self.operator.matrix().n_local();
        if norm == Norm::Residual {
            return Ok((0..columns).map(|j| norm2(world, &v[j * n..][..n])).collect());
        }
        self.load(v, columns)?;
        let (mut pc, doing) = (ptr::null_mut(), "applying multigrid");
        // SAFETY: live objects of this solver.
        unsafe {
            check(sys::KSPGetPC(self.ksp.raw(), &mut pc), doing)?;
            check(sys::PCApply(pc, self.b.raw(), self.x.raw()), doing)?;
        }
        let bv = self.result(columns)?;
        Ok((0..columns).map(|j| dot(world, &v[j * n..][..n], &bv[j * n..][..n]).max(0.0).sqrt()).collect())
    }

    /// Puts one or two columns into the complex right-hand side.
    fn load(&self, columns: &[f64], count: usize) -> Result<()> {
        let (real, imaginary) = columns.split_at(self.operator.matrix().n_local());
        // SAFETY: a live vector of this solver; the array is used within the closure only.
        unsafe {
            write(self.b.raw(), |b| {
                for (i, b) in b.iter_mut().enumerate() {
                    *b = Complex::new(real[i], if count == 2 { imaginary[i] } else { 0.0 });
                }
            })
        }
    }

    /// One or two columns out of the complex solution.
    fn result(&self, count: usize) -> Result<Vec<f64>> {
        let parts: [fn(&Complex<f64>) -> f64; 2] = [|v| v.re, |v| v.im];
        // SAFETY: a live vector of this solver; the array is used within the closure only.
        unsafe { read(self.x.raw(), |x| parts[..count].iter().flat_map(|part| x.iter().map(part)).collect()) }
    }

    /// A⁻¹ of one or two columns to a relative tolerance.
    fn correct(&mut self, right: &[f64], columns: usize, tolerance: f64, norm: Norm) -> Result<Vec<f64>> {
        let doing = "solving by conjugate gradients";
        self.load(right, columns)?;
        // SAFETY: live objects of this solver.
        let (iterations, reason) = unsafe {
            let ksp = self.ksp.raw();
            let most = self.options.max_iterations as sys::PetscInt;
            let kind = match norm {
                Norm::Residual => sys::KSPNormType_KSP_NORM_UNPRECONDITIONED,
                Norm::Energy => sys::KSPNormType_KSP_NORM_NATURAL,
            };
            check(sys::KSPSetNormType(ksp, kind), doing)?;
            check(sys::KSPSetTolerances(ksp, tolerance, 0.0, 1e10, most), doing)?;
            check(sys::KSPSolve(ksp, self.b.raw(), self.x.raw()), doing)?;
            let (mut iterations, mut reason) = (0, 0);
            check(sys::KSPGetIterationNumber(ksp, &mut iterations), doing)?;
            check(sys::KSPGetConvergedReason(ksp, &mut reason), doing)?;
            (iterations, reason)
        };
        let solution = self.result(columns)?;
        self.iterations += iterations as usize;
        self.solves += 1;
        if reason < 0 {
            let why = match reason {
                sys::KSPConvergedReason_KSP_DIVERGED_ITS => "the limit of iterations was reached",
                sys::KSPConvergedReason_KSP_DIVERGED_INDEFINITE_MAT => "the matrix is not positive definite",
                sys::KSPConvergedReason_KSP_DIVERGED_INDEFINITE_PC => "the preconditioner is not positive definite",
                sys::KSPConvergedReason_KSP_DIVERGED_NANORINF => {
                    "a value is not finite: is the body held by a fixed group?"
                }
                _ => "PETSc gave up",
            };
            return Err(Error::NotConverged(format!(
                "{}conjugate gradients with multigrid: {why} (reason {reason}) after {iterations} iterations. \
                 Use solver.linear \"mumps\".",
                self.options.prefix
            )));
        }
        Ok(solution)
    }

    /// Collective: the entries of the inverse at `rows` × `rows` (global numbers, the same on every rank), `[rows,
    /// rows]` on rank 0 and empty elsewhere, by one solve for two rows. Made symmetric: the two halves differ by the
    /// tolerance. `progress` is told rows done and rows in all.
    pub fn inverse_block(&mut self, rows: &[u64], progress: &mut dyn FnMut(usize, usize)) -> Result<Mat<f64>> {
        let world = self.petsc.world();
        let own = self.operator.matrix().rows_of(world.rank);
        let n = self.operator.matrix().n_local();
        let k = rows.len();
        let mine: Vec<usize> = (0..k).filter(|&i| own.contains(&rows[i])).collect();
        let places = world.gather(&mine.iter().map(|&i| i as u64).collect::<Vec<_>>());
        let mut block = if world.is_root() { Mat::zeros(k, k) } else { Mat::new() };
        for first in (0..k).step_by(2) {
            let columns = (k - first).min(2);
            let mut x = vec![0.0; columns * n];
            for j in 0..columns {
                if own.contains(&rows[first + j]) {
                    x[j * n + (rows[first + j] - own.start) as usize] = 1.0;
                }
            }
            self.solve(&mut x, columns)?;
            for j in 0..columns {
                let part: Vec<f64> = mine.iter().map(|&i| x[j * n + (rows[i] - own.start) as usize]).collect();
                let column = world.gather(&part);
                if world.is_root() {
                    for (&i, v) in places.iter().zip(column) {
                        block[(i as usize, first + j)] = v;
                    }
                }
            }
            progress(first + columns, k);
        }
        for j in 0..block.ncols() {
            for i in 0..j {
                let mean = 0.5 * (block[(i, j)] + block[(j, i)]);
                block[(i, j)] = mean;
                block[(j, i)] = mean;
            }
        }
        Ok(block)
    }

    /// Iterations and complex solves so far.
    pub fn effort(&self) -> (usize, usize) {
        (self.iterations, self.solves)
    }
}

fn scaled(value: f64, norm: f64) -> f64 {
    if norm > 0.0 {
        value / norm
    } else {
        0.0
    }
}

/// Gives the matrix its near null space, made orthonormal.
fn near_null_space(petsc: &Petsc, a: &Handle<sys::Mat>, matrix: &DistCsr, given: &[Vec<f64>]) -> Result<()> {
    let world = petsc.world();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for v in given {
        let mut v = v.clone();
        let before = norm2(world, &v);
        // Twice is enough for six vectors.
        for _ in 0..2 {
            for b in &basis {
                let along = dot(world, b, &v);
                v.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
            }
        }
        let norm = norm2(world, &v);
        // A body of few nodes does not have all six motions.
        if norm > 1e-10 * before {
            v.iter_mut().for_each(|x| *x /= norm);
            basis.push(v);
        }
    }
    if basis.is_empty() {
        return Ok(());
    }
    let vectors = basis.iter().map(|values| {
        let v = vector(petsc, matrix.n_local(), matrix.order())?;
        // SAFETY: a live vector that nothing else uses.
        unsafe { write(v.raw(), |v| v.iter_mut().zip(values).for_each(|(v, &x)| *v = Complex::new(x, 0.0)))? };
        Ok(v)
    });
    let vectors = vectors.collect::<Result<Vec<_>>>()?;
    let raw: Vec<sys::Vec> = vectors.iter().map(Handle::raw).collect();
    let doing = "setting the near null space";
    let comm = world.comm.as_raw();
    // SAFETY: live vectors, as many as said; PETSc counts its own references to them and to the space.
    let space = Handle::create(petsc, doing, |s| unsafe {
        sys::MatNullSpaceCreate(comm, sys::PETSC_FALSE, raw.len() as sys::PetscInt, raw.as_ptr(), s)
    })?;
    // SAFETY: live objects.
    check(unsafe { sys::MatSetNearNullSpace(a.raw(), space.raw()) }, doing)
}

fn solver<'p>(
    petsc: &'p Petsc<'_>,
    a: &Handle<sys::Mat>,
    options: &IterativeOptions,
    shift: f64,
) -> Result<Handle<'p, sys::KSP>> {
    let comm = petsc.world().comm.as_raw();
    let prefix =
        CString::new(options.prefix.as_str()).map_err(|_| Error::Defect("zero byte in an options prefix".into()))?;
    // SAFETY: a live communicator and a valid output.
    let ksp = Handle::create(petsc, "creating the iterative solver", |k| unsafe { sys::KSPCreate(comm, k) })?;
    let doing = "setting up multigrid";
    for (name, value) in DEFAULTS {
        petsc.default_option(&format!("{}{}", options.prefix, name), value)?;
    }
    petsc.default_option(&format!("{}mg_levels_pc_sor_diagonal_shift", options.prefix), &format!("{shift:e}"))?;
    // SAFETY: live objects; strings end in zero.
    unsafe {
        let k = ksp.raw();
        check(sys::KSPSetOptionsPrefix(k, prefix.as_ptr()), doing)?;
        check(sys::KSPSetOperators(k, a.raw(), a.raw()), doing)?;
        check(sys::KSPSetType(k, c"cg".as_ptr()), doing)?;
        check(sys::KSPSetNormType(k, sys::KSPNormType_KSP_NORM_UNPRECONDITIONED), doing)?;
        let mut pc = ptr::null_mut();
        check(sys::KSPGetPC(k, &mut pc), doing)?;
        check(sys::PCSetType(pc, c"gamg".as_ptr()), doing)?;
        check(sys::KSPSetFromOptions(k), doing)?;
        check(sys::KSPSetUp(k), doing)?;
    }
    Ok(ksp)
}

/// The six rigid-body motions of nodes at `coordinates` (m) as local rows, three per node.
pub fn rigid_body_motions(coordinates: &[[f64; 3]]) -> Vec<Vec<f64>> {
    let motion = |k: usize| {
        let at = move |&[x, y, z]: &[f64; 3]| match k {
            0..=2 => std::array::from_fn(|c| f64::from(u8::from(c == k))),
            3 => [0.0, -z, y],
            4 => [z, 0.0, -x],
            _ => [-y, x, 0.0],
        };
        coordinates.iter().flat_map(at).collect()
    };
    (0..6).map(motion).collect()
}
