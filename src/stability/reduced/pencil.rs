//! Generalised eigenvalue problem of steady sliding in scaled variables.

use faer::linalg::solvers::Solve;
use faer::Mat;
use num_complex::Complex;

use super::Eigenpair;
use crate::stability::rightmost;
use crate::{Error, Result};

/// The pencil (A − λE) x = 0 in scaled variables x = (q, v, f).
pub(in crate::stability) struct ScaledPencil {
    pub a: Mat<f64>,
    pub e: Mat<f64>,
    pub scales: Scales,
    /// Number of f where the rows are, in this order, λq = v, the modes', and the contact's, in which E has f alone;
    /// none of a pencil of another build, such as a transposed one.
    pub parts: Option<usize>,
}

/// Units of a [`ScaledPencil`].
#[derive(Clone)]
pub(in crate::stability) struct Scales {
    /// Unit of time is 1/`rate`, rad/s.
    pub rate: f64,
    /// Unit of the tangential forces, N.
    pub force: f64,
    /// Divisors of the rows of the unknowns f.
    pub rows: Vec<f64>,
}

/// An eigenvalue of a [`ScaledPencil`] in its own unit, Im λ ≥ 0, with its right vector of Euclidean norm 1.
pub(in crate::stability) struct Root {
    pub value: Complex<f64>,
    pub vector: Vec<Complex<f64>>,
    pub backward_error: f64,
}

impl ScaledPencil {
    /// Pencil of two matrices, each scaled.
    pub fn scaled(a: Mat<f64>, e: Mat<f64>) -> Self {
        Self { a, e, scales: Scales { rate: 1.0, force: 1.0, rows: Vec::new() }, parts: None }
    }

    /// All finite eigenvalues, one of each conjugate pair.
    pub fn roots(&self, tolerance: f64) -> Result<Vec<Root>> {
        let n = self.a.nrows();
        let eigen = self.inverted()?.eigen().map_err(failed)?;
        let theta: Vec<Complex<f64>> = eigen.S().column_vector().iter().copied().collect();
        let norms = (self.a.norm_l2(), self.e.norm_l2());
        let (wanted, values): (Vec<usize>, Vec<Complex<f64>>) = finite(&theta).unzip();
        let vectors = Mat::from_fn(n, wanted.len(), |i, j| eigen.U()[(i, wanted[j])]);
        let mut roots = Vec::new();
        for ((lambda, residual), x) in values.iter().zip(self.residuals(&values, &vectors)).zip(vectors.col_iter()) {
            let norm = x.norm_l2();
            let mut vector: Vec<Complex<f64>> = x.iter().map(|x| x / norm).collect();
            let mut backward_error = residual / ((norms.0 + lambda.norm() * norms.1) * norm);
            if backward_error > tolerance {
                // Of eigenvalues that are equal, as those of mirror images, the vectors come out mixed with others.
                let start = Mat::from_fn(n, 1, |i, _| vector[i]);
                (vector, backward_error) = rightmost::vector(self, *lambda, start);
            }
            if backward_error > tolerance || backward_error.is_nan() {
                return Err(Error::NotConverged(format!(
                    "reduced stability: the eigenvalue {:.6e} {:+.6e}i 1/s has a backward error of \
                     {backward_error:.1e}, \
                     {tolerance:.1e} was asked for",
                    lambda.re * self.scales.rate,
                    lambda.im * self.scales.rate
                )));
            }
            vector.iter_mut().for_each(|x| *x = x.conj());
            roots.push(Root { value: lambda.conj(), vector, backward_error });
        }
        Ok(roots)
    }

    /// All finite eigenvalues alone, with Im λ ≥ 0, one of each conjugate pair.
    pub fn values(&self) -> Result<Vec<Complex<f64>>> {
        let theta = self.inverted()?.eigenvalues().map_err(failed)?;
        let values = finite(&theta).map(|(_, value)| value.conj()).collect();
        Ok(values)
    }

    /// (A − shift E)⁻¹ E.
    fn inverted(&self) -> Result<Mat<f64>> {
        let inverted = match self.parts {
            None => (&self.a - faer::Scale(SHIFT) * &self.e).partial_piv_lu().solve(&self.e),
            Some(nf) => self.without_velocities(nf),
        };
        match (0..self.a.nrows()).all(|i| inverted[(i, i)].is_finite()) {
            true => Ok(inverted),
            false => {
                Err(Error::NotConverged("reduced stability: the linearised system is singular at the shift".into()))
            }
        }
    }

    /// The same of a pencil of modes and `nf` unknowns of the contact: v = shift q + (the right-hand side for q) is
    /// put into the other rows.
    fn without_velocities(&self, nf: usize) -> Mat<f64> {
        let n = self.a.nrows();
        let m = (n - nf) / 2;
        let (a, e) = (self.a.as_ref().subrows(m, m + nf), self.e.as_ref().submatrix(2 * m, 2 * m, nf, nf));
        let mut rates = a.subcols(m, m).to_owned();
        (0..m).for_each(|i| rates[(i, i)] -= SHIFT);
        let mut matrix = Mat::<f64>::zeros(m + nf, m + nf);
        matrix.as_mut().subcols_mut(0, m).copy_from(a.subcols(0, m) + faer::Scale(SHIFT) * &rates);
        matrix.as_mut().subcols_mut(m, nf).copy_from(a.subcols(2 * m, nf));
        let mut own = matrix.as_mut().submatrix_mut(m, m, nf, nf);
        own -= faer::Scale(SHIFT) * e;
        let mut right = Mat::<f64>::zeros(m + nf, n);
        right.as_mut().subcols_mut(0, m).copy_from(-&rates);
        (0..m).for_each(|i| right[(i, m + i)] = 1.0);
        right.as_mut().submatrix_mut(m, 2 * m, nf, nf).copy_from(e);
        matrix.partial_piv_lu().solve_in_place(&mut right);
        let mut whole = Mat::<f64>::zeros(n, n);
        whole.as_mut().subrows_mut(0, m).copy_from(right.as_ref().subrows(0, m));
        whole.as_mut().subrows_mut(m, m).copy_from(faer::Scale(SHIFT) * right.as_ref().subrows(0, m));
        (0..m).for_each(|i| whole[(m + i, i)] += 1.0);
        whole.as_mut().subrows_mut(2 * m, nf).copy_from(right.as_ref().subrows(m, nf));
        whole
    }

    /// ‖(A − λE) x‖ of each pair of `values` and columns of `vectors`.
    pub fn residuals(&self, values: &[Complex<f64>], vectors: &Mat<Complex<f64>>) -> Vec<f64> {
        let n = self.a.nrows();
        let Some(nf) = self.parts else {
            return images([&self.a, &self.e], values, vectors).col_iter().map(|c| c.norm_l2()).collect();
        };
        let m = (n - nf) / 2;
        // q and v are tied by λq = v alone, and E is 1 but in the rows of the contact: these have no part of q and v
        // in it.
        let (low, storing) = (self.a.as_ref().subrows(m, m + nf), self.e.as_ref().submatrix(2 * m, 2 * m, nf, nf));
        let part = |of: fn(&Complex<f64>) -> f64, first: usize| {
            Mat::from_fn(n - first, vectors.ncols(), |i, j| of(&vectors[(first + i, j)]))
        };
        let [low_re, low_im] = [part(|v| v.re, 0), part(|v| v.im, 0)].map(|x| low * x);
        let [e_re, e_im] = [part(|v| v.re, 2 * m), part(|v| v.im, 2 * m)].map(|x| storing * x);
        let of = |(j, value): (usize, &Complex<f64>)| {
            let x = |i: usize| vectors[(i, j)];
            let tied: f64 = (0..m).map(|i| (x(m + i) - value * x(i)).norm_sqr()).sum();
            let image = |i: usize| Complex::new(low_re[(i, j)], low_im[(i, j)]);
            let moved: f64 = (0..m).map(|i| (image(i) - value * x(m + i)).norm_sqr()).sum();
            let rows = (0..nf).map(|i| image(m + i) - value * Complex::new(e_re[(i, j)], e_im[(i, j)]));
            (tied + moved + rows.map(|v| v.norm_sqr()).sum::<f64>()).sqrt()
        };
        values.iter().enumerate().map(of).collect()
    }

    /// The vector x of an eigenpair of it.
    pub fn vector(&self, pair: &Eigenpair) -> Vec<Complex<f64>> {
        let Scales { rate, force, .. } = self.scales;
        let velocity = pair.modal.iter().map(|q| q * (pair.value / rate));
        pair.modal.iter().copied().chain(velocity).chain(pair.tangential.iter().map(|f| f / force)).collect()
    }
}

/// A real shift beside the origin of the right half-plane; an eigenvalue there would be static divergence at just
/// this rate, which the backward error would show.
const SHIFT: f64 = 0.7390851332151607;

fn failed(e: impl std::fmt::Debug) -> Error {
    Error::NotConverged(format!("reduced stability: dense eigenvalues failed: {e:?}"))
}

/// The finite eigenvalues of a pencil, with their places among those, `theta`, of the inverted one: those of a
/// singular E are left out. The matrices are real: of a conjugate pair one says all, here that with Im λ ≤ 0.
fn finite(theta: &[Complex<f64>]) -> impl Iterator<Item = (usize, Complex<f64>)> + '_ {
    let largest = theta.iter().map(|t| t.norm()).fold(0.0, f64::max);
    let kept = move |t: &Complex<f64>| t.im >= 0.0 && t.norm() > 1e-13 * largest;
    theta.iter().enumerate().filter(move |(_, t)| kept(t)).map(|(k, t)| (k, SHIFT + t.inv()))
}

/// (A − λE) x of each pair of `values` and columns of `vectors`, for real matrices [A, E].
pub(in crate::stability) fn images(
    [a, e]: [&Mat<f64>; 2],
    values: &[Complex<f64>],
    vectors: &Mat<Complex<f64>>,
) -> Mat<Complex<f64>> {
    // Four real products of matrices are much faster than a complex one vector by vector.
    let part =
        |of: fn(&Complex<f64>) -> f64| Mat::from_fn(vectors.nrows(), vectors.ncols(), |i, j| of(&vectors[(i, j)]));
    let (re, im) = (part(|v| v.re), part(|v| v.im));
    let (a_re, a_im, e_re, e_im) = (a * &re, a * &im, e * &re, e * &im);
    Mat::from_fn(vectors.nrows(), vectors.ncols(), |i, j| {
        Complex::new(a_re[(i, j)], a_im[(i, j)]) - values[j] * Complex::new(e_re[(i, j)], e_im[(i, j)])
    })
}
