//! One eigenpair of a quadratic eigenproblem with its right and its left vector, by SLEPc's two-sided Krylov–Schur
//! method with shift and inversion (I. N. Zwaan, M. E. Hochstenbach, SIAM J. Matrix Anal. Appl. 38 (2017) 297).
//!
//! P(λ) x = (λ²M + λC + K) x = 0 and yᴴ P(λ) = 0 are the pencil A z = λ B z of twice the order,
//!
//! A = [0 1; −K −C],   B = [1 0; 0 M],   right vectors (x, λx),   left vectors (−Kᴴy/λ̄, y),
//!
//! (A − σB)⁻¹ (b₁, b₂) = (z₁, b₁ + σz₁),   z₁ = −P(σ)⁻¹ (b₂ + (C + σM) b₁).
//!
//! The matrices, their transposed ones and the inverse at the shift are given by what they do to a vector. The
//! options of EPS, ST and BV work with the prefix that is given (`-eps_monitor`, `-eps_view`, `-eps_ncv`,
//! `-st_ksp_type`).

use super::handle::{read, vector_on, write, Handle, Span};
use super::session::{check, Petsc};
use super::shell::{monitor, Shell, ShellOperator};
use crate::{Error, Result};
use num_complex::Complex;
use petsc_sys as sys;
use slepc_sys as slepc;
use std::ffi::CString;
use std::ptr;

type C = Complex<f64>;

/// Pencils up to this order are solved by LAPACK as a whole, through SLEPc.
const SMALL: usize = 40;

/// Parameters of the solve.
#[derive(Debug, Clone)]
pub struct TwoSidedOptions<'a> {
    /// Shift σ of the operator's inverse.
    pub shift: C,
    /// The eigenvalue nearest to this one is sought.
    pub target: C,
    /// Largest residual of θ = 1/(λ − σ), relative to θ, on either side.
    pub tolerance: f64,
    /// Vectors of each of the two spaces.
    pub space: usize,
    /// Prefix of the options, such as `"confirm_"`.
    pub prefix: &'a str,
    /// Ranks that the operator spans.
    pub span: Span,
}

/// Vectors to begin with; SLEPc's random ones where there are none.
#[derive(Debug, Clone, Copy, Default)]
pub struct StartVectors<'a> {
    /// Eigenvalue that goes with them.
    pub value: C,
    /// Local rows of x.
    pub right: &'a [C],
    /// Local rows of y.
    pub left: &'a [C],
}

/// An eigenvalue with its vectors.
#[derive(Debug, Clone, Default)]
pub struct TwoSidedPair {
    /// λ.
    pub value: C,
    /// Local rows of x.
    pub right: Vec<C>,
    /// Local rows of y, yᴴ P(λ) = 0.
    pub left: Vec<C>,
    /// Solves with the matrix at the shift and with its transposed.
    pub solves: usize,
}

/// The pencil of twice the order.
struct Companion<'a> {
    inner: &'a mut dyn ShellOperator,
    shift: C,
}

impl Companion<'_> {
    fn product(&mut self, power: usize, transposed: bool, x: &[C]) -> Result<Vec<C>> {
        let mut y = vec![C::default(); x.len()];
        match transposed {
            false => self.inner.multiply(power, x, &mut y)?,
            true => self.inner.multiply_transposed(power, x, &mut y)?,
        }
        Ok(y)
    }

    /// (C + σM) x or (C + σM)ᵀ x.
    fn slope(&mut self, transposed: bool, x: &[C]) -> Result<Vec<C>> {
        let mut sum = self.product(1, transposed, x)?;
        let inertia = self.product(2, transposed, x)?;
        sum.iter_mut().zip(inertia).for_each(|(s, m)| *s += self.shift * m);
        Ok(sum)
    }
}

impl ShellOperator for Companion<'_> {
    fn n_local(&self) -> usize {
        2 * self.inner.n_local()
    }

    fn multiply(&mut self, power: usize, x: &[C], y: &mut [C]) -> Result<()> {
        let n = x.len() / 2;
        let (first, second) = x.split_at(n);
        if power == 1 {
            y[..n].copy_from_slice(first);
            y[n..].copy_from_slice(&self.product(2, false, second)?);
            return Ok(());
        }
        y[..n].copy_from_slice(second);
        let (stiff, damped) = (self.product(0, false, first)?, self.product(1, false, second)?);
        y[n..].iter_mut().zip(stiff.iter().zip(damped)).for_each(|(y, (k, c))| *y = -(k + c));
        Ok(())
    }

    fn multiply_transposed(&mut self, power: usize, x: &[C], y: &mut [C]) -> Result<()> {
        let n = x.len() / 2;
        let (first, second) = x.split_at(n);
        if power == 1 {
            y[..n].copy_from_slice(first);
            y[n..].copy_from_slice(&self.product(2, true, second)?);
            return Ok(());
        }
        let (stiff, damped) = (self.product(0, true, second)?, self.product(1, true, second)?);
        y[..n].iter_mut().zip(stiff).for_each(|(y, k)| *y = -k);
        y[n..].iter_mut().zip(first.iter().zip(damped)).for_each(|(y, (x, c))| *y = x - c);
        Ok(())
    }

    fn solve(&mut self, x: &mut [C]) -> Result<()> {
        let n = x.len() / 2;
        let mut moved = self.slope(false, &x[..n])?;
        moved.iter_mut().zip(&x[n..]).for_each(|(m, b)| *m = -(*m + b));
        self.inner.solve(&mut moved)?;
        for i in 0..n {
            x[n + i] = x[i] + self.shift * moved[i];
            x[i] = moved[i];
        }
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [C]) -> Result<()> {
        let n = x.len() / 2;
        let mut w: Vec<C> = (0..n).map(|i| x[i] + self.shift * x[n + i]).collect();
        self.inner.solve_transposed(&mut w)?;
        let slope = self.slope(true, &w)?;
        for i in 0..n {
            x[i] = x[n + i] - slope[i];
            x[n + i] = -w[i];
        }
        Ok(())
    }
}

/// Collective over the span: the eigenpair nearest to the target, from `start`.
pub fn two_sided(
    petsc: &Petsc,
    operator: &mut dyn ShellOperator,
    start: StartVectors,
    options: &TwoSidedOptions,
) -> Result<TwoSidedPair> {
    let n = operator.n_local();
    let order = match options.span {
        Span::World => petsc.world().sum_u64(2 * n as u64),
        Span::Rank => 2 * n as u64,
    };
    let mut pencil = Companion { inner: operator, shift: options.shift };
    // As the method iterates on them: the left ones of (A − σB)⁻¹B are those of the pencil times Bᴴ.
    let right = start.right.iter().copied().chain(start.right.iter().map(|x| start.value * x)).collect::<Vec<C>>();
    let mut left = Vec::new();
    if !start.left.is_empty() {
        let turned: Vec<C> = start.left.iter().map(C::conj).collect();
        let (stiff, inertia) = (pencil.product(0, true, &turned)?, pencil.product(2, true, &turned)?);
        left.extend(stiff.iter().map(|k| -(k / start.value).conj()));
        left.extend(inertia.iter().map(C::conj));
    }
    let (solved, solves) = {
        let mut progress = |_, _| {};
        let mut shell = Shell::new(&mut pencil, &mut progress, 1);
        let solved = solve(petsc, &shell, [&right, &left], (2 * n, order), options);
        let solves = shell.solves();
        match shell.error() {
            Some(error) => return Err(error),
            None => (solved, solves),
        }
    };
    let (value, right, mut left) = solved?;
    if order as usize <= SMALL {
        // Those of LAPACK are vectors of the inverted operator.
        left.iter_mut().for_each(|v| *v = v.conj());
        pencil.solve_transposed(&mut left)?;
        left.iter_mut().for_each(|v| *v = v.conj());
    }
    Ok(TwoSidedPair { value, right: right[..n].to_vec(), left: left[n..].to_vec(), solves })
}

fn solve(
    petsc: &Petsc,
    shell: &Shell,
    start: [&[C]; 2],
    (rows, order): (usize, u64),
    options: &TwoSidedOptions,
) -> Result<(C, Vec<C>, Vec<C>)> {
    let comm = options.span.comm(petsc);
    let prefix = CString::new(options.prefix).map_err(|_| Error::Defect("zero byte in an options prefix".into()))?;
    let span = (petsc, options.span);
    // SAFETY: the shell outlives this function, and nothing here touches it while the solver runs.
    let (a, b) = unsafe { (shell.matrix(span, 0, rows, order)?, shell.matrix(span, 1, rows, order)?) };
    let doing = "setting up the two-sided eigensolver";
    // SAFETY: a live communicator and a valid output.
    let eps = Handle::create(petsc, doing, |e| unsafe { slepc::EPSCreate(comm, e) })?;
    let (x, y) = (vector_on(petsc, options.span, rows, order)?, vector_on(petsc, options.span, rows, order)?);
    let small = order as usize <= SMALL;
    let space = options.space.max(2).min(order as usize) as sys::PetscInt;
    // SAFETY: live objects, strings that end in zero, valid outputs; the callbacks' context outlives the solver.
    unsafe {
        let e = eps.raw();
        check(slepc::EPSSetOperators(e, a.raw(), b.raw()), doing)?;
        check(slepc::EPSSetProblemType(e, slepc::EPSProblemType_EPS_GNHEP), doing)?;
        check(slepc::EPSSetType(e, if small { c"lapack" } else { c"krylovschur" }.as_ptr()), doing)?;
        check(slepc::EPSSetTwoSided(e, sys::PETSC_TRUE), doing)?;
        check(slepc::EPSSetOptionsPrefix(e, prefix.as_ptr()), doing)?;
        check(slepc::EPSSetWhichEigenpairs(e, slepc::EPSWhich_EPS_TARGET_MAGNITUDE), doing)?;
        check(slepc::EPSSetTarget(e, options.target), doing)?;
        if !small {
            check(slepc::EPSSetDimensions(e, 1, space, sys::PETSC_DEFAULT as sys::PetscInt), doing)?;
        }
        check(slepc::EPSSetTolerances(e, options.tolerance, 100), doing)?;
        let given = [(start[0], &x), (start[1], &y)];
        for (side, (values, vector)) in given.into_iter().enumerate().filter(|(_, (v, _))| !small && !v.is_empty()) {
            write(vector.raw(), |v| v.copy_from_slice(values))?;
            let mut first = vector.raw();
            match side {
                0 => check(slepc::EPSSetInitialSpace(e, 1, &mut first), doing)?,
                _ => check(slepc::EPSSetLeftInitialSpace(e, 1, &mut first), doing)?,
            }
        }
        check(slepc::EPSMonitorSet(e, Some(monitor::<slepc::EPS>), shell.context(), None), doing)?;
        let mut st = ptr::null_mut();
        check(slepc::EPSGetST(e, &mut st), doing)?;
        shell.invert(st)?;
        check(slepc::STSetShift(st, options.shift), doing)?;
        check(slepc::EPSSetFromOptions(e), doing)?;
        check(slepc::EPSSolve(e), "solving the two-sided eigenproblem")?;

        let (mut converged, mut iterations, mut reason) = (0, 0, 0);
        check(slepc::EPSGetConverged(e, &mut converged), doing)?;
        check(slepc::EPSGetIterationNumber(e, &mut iterations), doing)?;
        check(slepc::EPSGetConvergedReason(e, &mut reason), doing)?;
        let mut best: Option<(C, sys::PetscInt)> = None;
        for i in 0..converged {
            let mut value = C::default();
            check(slepc::EPSGetEigenvalue(e, i, &mut value, ptr::null_mut()), "reading an eigenvalue")?;
            let nearer = best.is_none_or(|(v, _)| (value - options.target).norm() < (v - options.target).norm());
            if value.is_finite() && nearer {
                best = Some((value, i));
            }
        }
        let Some((value, i)) = best else {
            return Err(Error::NotConverged(format!(
                "SLEPc's two-sided method found no eigenvalue in {iterations} restarts (reason {reason}); give \
                 it larger \
                 spaces with the PETSc option -{}eps_ncv",
                options.prefix
            )));
        };
        check(slepc::EPSGetEigenvector(e, i, x.raw(), ptr::null_mut()), "reading an eigenvector")?;
        check(slepc::EPSGetLeftEigenvector(e, i, y.raw(), ptr::null_mut()), "reading a left eigenvector")?;
        Ok((value, read(x.raw(), <[C]>::to_vec)?, read(y.raw(), <[C]>::to_vec)?))
    }
}
