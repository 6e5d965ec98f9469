//! SLEPc's confirmation of unstable eigenvalues: each is computed once more by its two-sided Krylov–Schur method,
//! with its right and its left vector, near the value that was found.
//!
//! On the reduced model SLEPc begins with random vectors at a shift just beside the value. On the full system it
//! begins with the vectors found, at the shift whose factors are at hand. With both vectors the first-order bound of
//! the error is known: the condition number of λ,
//!
//! κ = (|λ|²‖M‖ + |λ|‖C‖ + ‖K‖) |x| |y| / (|λ| |yᴴ(2λM + C) x|)
//!
//! (F. Tisseur, Linear Algebra Appl. 309 (2000) 339), times the backward error.

use super::dense::DensePencil;
use super::reduced::{assemble, Eigenpair};
use crate::contact::LinearContact;
use crate::model::CoupledModel;
use crate::petsc::shell::ShellOperator;
use crate::petsc::two_sided::{two_sided, StartVectors, TwoSidedOptions, TwoSidedPair};
use crate::petsc::{Petsc, Span};
use crate::{Error, Result};
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatRef};
use num_complex::Complex;

type C = Complex<f64>;

/// Largest difference of the two eigenvalues over their size, and over the first-order bound of SLEPc's error.
const LIMIT: (f64, f64) = (1e-6, 10.0);
/// Backward error below which no method gets.
const ROUNDING: f64 = 1e-15;
/// Distance of the shift of the reduced model from the value, over its size.
const BESIDE: f64 = 1e-4;
/// Residual that SLEPc iterates to, and vectors of its spaces, on the reduced model.
const REDUCED: (f64, usize) = (1e-11, 16);
/// Vectors of its spaces in the second attempt.
const WIDE: usize = 40;
/// Prefix of the PETSc options.
pub const PREFIX: &str = "confirm_";

/// An unstable eigenvalue as SLEPc has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confirmation {
    /// SLEPc's eigenvalue, 1/s.
    pub value: C,
    /// Distance from the one that was found, over its size.
    pub difference: f64,
    /// Condition number κ of the eigenvalue.
    pub condition: f64,
    /// Backward errors of SLEPc's right and left vector.
    pub residuals: [f64; 2],
    /// Solves that it took.
    pub solves: usize,
}

/// The problem that SLEPc is given.
pub struct Problem<'a> {
    /// PETSc and its ranks.
    pub petsc: &'a Petsc<'a>,
    /// Ranks that the operator spans.
    pub span: Span,
    /// ‖K‖, ‖C‖, ‖M‖ in the units of the operator.
    pub norms: [f64; 3],
    /// Unit of λ, 1/s.
    pub rate: f64,
    /// System that messages name.
    pub system: &'static str,
}

/// The pair to be confirmed, and how.
pub struct ConfirmationRequest<'a> {
    /// λ as it was found, 1/s.
    pub value: C,
    /// Shift, 1/s.
    pub shift: C,
    /// Vectors to begin with, none: random ones.
    pub right: &'a [C],
    /// The same of the left vector.
    pub left: &'a [C],
    /// Residual that SLEPc iterates to, and vectors of its spaces.
    pub effort: (f64, usize),
}

impl Problem<'_> {
    /// Collective over the span: sums over its ranks.
    fn sum(&self, values: &[C]) -> Vec<C> {
        match self.span {
            Span::World => self.petsc.world().sum_all(values),
            Span::Rank => values.to_vec(),
        }
    }

    /// Collective over the span: SLEPc's pair beside the one that was found; none where SLEPc's method does not
    /// converge, neither from the vectors given nor from random ones.
    ///
    /// # Errors
    /// [`Error::NotConverged`] where the two are not the same.
    pub fn confirm(
        &self,
        operator: &mut dyn ShellOperator,
        asked: &ConfirmationRequest,
    ) -> Result<Option<Confirmation>> {
        let target = asked.value / self.rate;
        let options = TwoSidedOptions {
            shift: asked.shift / self.rate,
            target,
            tolerance: asked.effort.0,
            space: asked.effort.1,
            prefix: PREFIX,
            span: self.span,
        };
        let hertz = |v: C| v.im / (2.0 * std::f64::consts::PI);
        // From vectors that are eigenvectors but for rounding the rest of the space is rounding too, and where the left
        // one is not exact enough for a small space, a wide one may converge on another eigenvalue: the second
        // attempt begins with random vectors.
        let given = StartVectors { value: target, right: asked.right, left: asked.left };
        let mut other = None;
        for (start, space) in
            [(given, asked.effort.1), (StartVectors { value: target, ..StartVectors::default() }, WIDE)]
        {
            let pair = match two_sided(self.petsc, operator, start, &TwoSidedOptions { space, ..options.clone() }) {
                Err(Error::NotConverged(_)) => continue,
                pair => pair?,
            };
            let value = pair.value * self.rate;
            let difference = (value - asked.value).norm() / asked.value.norm();
            let (condition, residuals) = self.judge(operator, &pair)?;
            let bound = condition * residuals.into_iter().fold(ROUNDING, f64::max);
            let limit = LIMIT.0.max(LIMIT.1 * bound);
            if difference <= limit && value.re > 0.0 {
                return Ok(Some(Confirmation { value, difference, condition, residuals, solves: pair.solves }));
            }
            other = Some((value, difference, limit));
        }
        let Some((value, difference, limit)) = other else { return Ok(None) };
        Err(Error::NotConverged(format!(
            "{}: SLEPc does not confirm the unstable eigenvalue at {:.6} Hz, growth rate {:+.6} 1/s: the one that \
             it finds there is at {:.6} Hz, growth rate {:+.6} 1/s, a relative difference of {difference:.1e} \
             (limit {limit:.0e})",
            self.system,
            hertz(asked.value),
            asked.value.re,
            hertz(value),
            value.re
        )))
    }

    /// Collective over the span: the condition number of SLEPc's eigenvalue, and the backward errors of its vectors.
    fn judge(&self, operator: &mut dyn ShellOperator, pair: &TwoSidedPair) -> Result<(f64, [f64; 2])> {
        let TwoSidedPair { value, right, left, .. } = pair;
        let n = right.len();
        let left: Vec<C> = left.iter().map(C::conj).collect();
        let (mut rest, mut other, mut slope) = (vec![C::default(); n], vec![C::default(); n], vec![C::default(); n]);
        let mut image = vec![C::default(); n];
        for power in 0..3u32 {
            operator.multiply(power as usize, right, &mut image)?;
            let (own, by) = (value.powu(power), f64::from(power) * value.powi(power as i32 - 1));
            for i in 0..n {
                rest[i] += own * image[i];
                slope[i] += by * image[i];
            }
            operator.multiply_transposed(power as usize, &left, &mut image)?;
            other.iter_mut().zip(&image).for_each(|(o, v)| *o += own * v);
        }
        let square = |v: &[C]| C::from(v.iter().map(C::norm_sqr).sum::<f64>());
        let product = left.iter().zip(&slope).map(|(y, s)| y * s).sum::<C>();
        let sums = self.sum(&[square(right), square(&left), square(&rest), square(&other), product]);
        let [x, y, r, s] = [0, 1, 2, 3].map(|i| sums[i].re.sqrt());
        let [k, c, m] = self.norms;
        let size = value.norm();
        let scale = k + size * c + size * size * m;
        Ok((scale * x * y / (size * sums[4].norm()), [r / (scale * x), s / (scale * y)]))
    }
}

/// P(λ) = λ²M + λC + K of the reduced model, densely, with its inverse at a shift.
struct Dense {
    /// K, C, M.
    matrices: [Mat<f64>; 3],
    inverse: PartialPivLu<C>,
}

impl Dense {
    fn at(matrices: [Mat<f64>; 3], shift: C) -> Self {
        let [k, c, m] = &matrices;
        let whole = Mat::from_fn(k.nrows(), k.nrows(), |i, j| k[(i, j)] + shift * (c[(i, j)] + shift * m[(i, j)]));
        Self { inverse: whole.partial_piv_lu(), matrices }
    }

    fn product(matrix: MatRef<'_, f64>, x: &[C], y: &mut [C]) {
        // Real and imaginary parts are the columns of one product.
        let parts = Mat::from_fn(x.len(), 2, |i, j| if j == 0 { x[i].re } else { x[i].im });
        let product = matrix * parts;
        y.iter_mut().enumerate().for_each(|(i, y)| *y = C::new(product[(i, 0)], product[(i, 1)]));
    }
}

impl ShellOperator for Dense {
    fn n_local(&self) -> usize {
        self.matrices[0].nrows()
    }

    fn multiply(&mut self, power: usize, x: &[C], y: &mut [C]) -> Result<()> {
        Self::product(self.matrices[power].as_ref(), x, y);
        Ok(())
    }

    fn solve(&mut self, x: &mut [C]) -> Result<()> {
        let mut column = Mat::from_fn(x.len(), 1, |i, _| x[i]);
        self.inverse.solve_in_place(&mut column);
        x.copy_from_slice(column.col_as_slice(0));
        Ok(())
    }

    fn multiply_transposed(&mut self, power: usize, x: &[C], y: &mut [C]) -> Result<()> {
        Self::product(self.matrices[power].transpose(), x, y);
        Ok(())
    }

    fn solve_transposed(&mut self, x: &mut [C]) -> Result<()> {
        let mut column = Mat::from_fn(x.len(), 1, |i, _| x[i]);
        self.inverse.solve_transpose_in_place(&mut column);
        x.copy_from_slice(column.col_as_slice(0));
        Ok(())
    }
}

/// On rank 0: SLEPc's confirmation of those `pairs` of the reduced model, which are unstable, in their order.
pub(crate) fn of_reduced(
    petsc: &Petsc,
    bodies: &CoupledModel,
    contact: &LinearContact,
    pairs: &[&Eigenpair],
) -> Result<Vec<Option<Confirmation>>> {
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let pencil = assemble(bodies, contact, None)?;
    let (m, rate) = (bodies.omega.len(), pencil.scales.rate);
    let nf = pencil.a.nrows() - 2 * m;
    // (λ² + …) q and the rows of the contact, v = λq put in.
    let part = |first: usize, columns: usize| pencil.a.as_ref().submatrix(m, first, m + nf, columns);
    let mut stiffness = Mat::<f64>::zeros(m + nf, m + nf);
    stiffness.as_mut().subcols_mut(0, m).copy_from(-part(0, m));
    stiffness.as_mut().subcols_mut(m, nf).copy_from(-part(2 * m, nf));
    let mut damping = Mat::<f64>::zeros(m + nf, m + nf);
    damping.as_mut().subcols_mut(0, m).copy_from(-part(m, m));
    damping.as_mut().submatrix_mut(m, m, nf, nf).copy_from(pencil.e.as_ref().submatrix(2 * m, 2 * m, nf, nf));
    let mass = Mat::from_fn(m + nf, m + nf, |i, j| if i == j && i < m { 1.0 } else { 0.0 });
    drop(pencil);
    let values: Vec<C> = pairs.iter().map(|p| p.value).collect();
    densely(petsc, [stiffness, damping, mass], rate, (&values, "stability of the reduced model"))
}

/// On rank 0: SLEPc's confirmation of unstable `values` (1/s) of a dense pencil, in their order.
pub fn of_pencil(petsc: &Petsc, pencil: DensePencil, values: &[C]) -> Result<Vec<Option<Confirmation>>> {
    let DensePencil { a, e, rate } = pencil;
    let none = Mat::zeros(a.nrows(), a.nrows());
    densely(petsc, [-a, e, none], rate, (values, "stability of the full system"))
}

/// The same of λ²M + λC + K, given as K, C, M with λ in units of `rate`; `system` is the name of the problem in
/// messages.
fn densely(
    petsc: &Petsc,
    [k, c, m]: [Mat<f64>; 3],
    rate: f64,
    (values, system): (&[C], &'static str),
) -> Result<Vec<Option<Confirmation>>> {
    let mut all = Vec::new();
    for &value in values {
        // The value itself is the unit of λ: the pencil of twice the order has 1 beside K, C and M.
        let unit = value.norm();
        let scale = unit / rate;
        let matrices = [k.clone(), faer::Scale(scale) * &c, faer::Scale(scale * scale) * &m];
        let norms = [0, 1, 2].map(|i: usize| matrices[i].norm_l2());
        let problem = Problem { petsc, span: Span::Rank, norms, rate: unit, system };
        let shift = value + C::from_polar(BESIDE * unit, std::f64::consts::FRAC_PI_4);
        let mut operator = Dense::at(matrices, shift / unit);
        let asked = ConfirmationRequest { value, shift, right: &[], left: &[], effort: REDUCED };
        all.push(problem.confirm(&mut operator, &asked)?);
    }
    Ok(all)
}

/// In the words of the summary: how many of the pairs that were asked about are confirmed, and how nearly.
pub(crate) fn in_words(asked: &[Option<Confirmation>]) -> String {
    let all: Vec<Confirmation> = asked.iter().flatten().copied().collect();
    let most = |of: &dyn Fn(&Confirmation) -> f64| all.iter().map(of).fold(0.0, f64::max);
    format!(
        "{} of {} unstable pairs, largest difference {:.1e}, condition numbers up to {:.2e}{}",
        all.len(),
        asked.len(),
        most(&|c| c.difference),
        most(&|c| c.condition),
        if all.len() < asked.len() { "; on the others its method does not converge" } else { "" }
    )
}
