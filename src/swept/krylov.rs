//! The lowest eigenpairs of one order: Rayleigh and Ritz on a block Krylov space of (K − σM)⁻¹M, σ below all
//! eigenvalues, every vector orthogonal in the mass to all others. A section has a few thousand amplitudes and a few
//! dozen modes of an order, so the space is never restarted.

use super::skyline_ldlt::Factor;
use super::Forms;
use crate::dense::symmetric_eigen;
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Columns of a block: more than the multiplicity of any eigenvalue of an order.
const BLOCK: usize = 4;
/// Relative residual of 1/(λ − σ) at which a pair has converged. λ is right to its square; the vectors take what is
/// small in the mass but stiff.
const TOLERANCE: f64 = 1e-12;
/// A column of which less than this part is new is replaced by another.
const SPENT: f64 = 1e-10;

/// Eigenvalues, ascending, `[m]`, and vectors, orthonormal in the mass, `[order, m]`.
pub struct Pairs {
    /// λ, 1/s².
    pub lambda: Vec<f64>,
    /// Vectors.
    pub vectors: Mat<f64>,
}

struct Space<'f> {
    forms: &'f Forms,
    n: usize,
    basis: Vec<Mat<f64>>,
    /// M times the basis.
    mass: Vec<Mat<f64>>,
    random: u64,
}

/// At least the `count` lowest pairs of the order `n` of `forms`; `factor` is that of K − σM, which must be positive
/// definite.
pub fn lowest(forms: &Forms, n: usize, sigma: f64, factor: &Factor, count: usize) -> Result<Pairs> {
    let order = forms.order();
    let mut space = Space { forms, n, basis: Vec::new(), mass: Vec::new(), random: 1 };
    let mut t = Mat::<f64>::zeros(0, 0);
    space.extend(&Mat::zeros(order, BLOCK.min(order)));
    let mut done = 0;
    loop {
        let last = space.mass.len() - 1;
        let image = factor.solve(space.mass[last].as_ref());
        done += image.ncols();
        if done < order {
            space.extend(&image);
        }
        let columns = space.coordinates(image.as_ref());
        let mut larger = Mat::zeros(columns.nrows(), done);
        larger.as_mut().submatrix_mut(0, 0, t.nrows(), t.ncols()).copy_from(&t);
        larger.as_mut().subcols_mut(done - image.ncols(), image.ncols()).copy_from(&columns);
        t = larger;
        if done < count {
            continue;
        }
        let square = t.as_ref().subrows(0, done);
        let symmetric = Mat::from_fn(done, done, |i, j| 0.5 * (square[(i, j)] + square[(j, i)]));
        let (theta, vectors) = symmetric_eigen(symmetric.as_ref())
            .ok_or_else(|| Error::NotConverged(format!("modes of order {n}: the projected problem was not solved")))?;
        let beyond = t.as_ref().subrows(done, t.nrows() - done) * vectors.as_ref();
        let converged = |k: usize| beyond.col(k).norm_l2() <= TOLERANCE * theta[k];
        // The largest θ are those of the lowest λ.
        if (done - count..done).all(converged) {
            let wanted: Vec<usize> = (0..done).rev().take_while(|&k| converged(k)).collect();
            let lambda = wanted.iter().map(|&k| sigma + 1.0 / theta[k]).collect();
            let ritz = Mat::from_fn(done, wanted.len(), |i, k| vectors[(i, wanted[k])]);
            return Ok(Pairs { lambda, vectors: space.combined(ritz.as_ref()) });
        }
    }
}

impl Space<'_> {
    /// Components of columns along the basis, `[basis, columns]`.
    fn coordinates(&self, columns: MatRef<'_, f64>) -> Mat<f64> {
        let rows: usize = self.mass.iter().map(Mat::ncols).sum();
        let mut out = Mat::zeros(rows, columns.ncols());
        let mut first = 0;
        for block in &self.mass {
            out.as_mut().subrows_mut(first, block.ncols()).copy_from(block.transpose() * columns);
            first += block.ncols();
        }
        out
    }

    /// Basis times coefficients, `[order, columns]`.
    fn combined(&self, coefficients: MatRef<'_, f64>) -> Mat<f64> {
        let mut out = Mat::zeros(self.forms.order(), coefficients.ncols());
        let mut first = 0;
        for block in self.basis.iter().filter(|_| coefficients.ncols() > 0) {
            let here = block.ncols().min(coefficients.nrows().saturating_sub(first));
            if here > 0 {
                out += block.as_ref().subcols(0, here) * coefficients.subrows(first, here);
            }
            first += here;
        }
        out
    }

    /// Another block: what is new in the columns, and random columns where nothing is.
    fn extend(&mut self, columns: &Mat<f64>) {
        let order = self.forms.order();
        let known: usize = self.mass.iter().map(Mat::ncols).sum();
        let width = columns.ncols().min(order - known);
        let mut block = columns.as_ref().subcols(0, width).to_owned();
        let sizes: Vec<f64> = block.col_iter().map(|c| c.norm_l2()).collect();
        for _ in 0..2 {
            let along = self.coordinates(block.as_ref());
            block -= self.combined(along.as_ref());
        }
        let mut mass = Mat::zeros(order, width);
        for k in 0..width {
            let mut column = Mat::from_fn(order, 1, |i, _| block[(i, k)]);
            let mut reference = sizes[k];
            loop {
                for _ in 0..2 {
                    let known = self.coordinates(column.as_ref());
                    column -= self.combined(known.as_ref());
                    let here = mass.as_ref().subcols(0, k).transpose() * &column;
                    column -= block.as_ref().subcols(0, k) * here;
                }
                if column.norm_l2() > SPENT * reference && reference > 0.0 {
                    break;
                }
                column = self.random_column();
                reference = column.norm_l2();
            }
            let loaded = self.forms.mass(self.n, column.as_ref());
            let length = (column.transpose() * &loaded)[(0, 0)].sqrt();
            block.as_mut().col_mut(k).copy_from(faer::Scale(1.0 / length) * column.col(0));
            mass.as_mut().col_mut(k).copy_from(faer::Scale(1.0 / length) * loaded.col(0));
        }
        self.basis.push(block);
        self.mass.push(mass);
    }

    /// Numbers in [−½, ½) from a linear congruence (D. E. Knuth, MMIX): the same in every run.
    fn random_column(&mut self) -> Mat<f64> {
        let mut column = Mat::from_fn(self.forms.order(), 1, |_, _| {
            self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.random >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        });
        self.forms.make_regular(self.n, &mut column);
        column
    }
}
