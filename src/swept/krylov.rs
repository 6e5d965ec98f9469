//! The lowest eigenpairs of one order: Rayleigh and Ritz on a block Krylov space of (K − σM)⁻¹M, σ below all
//! eigenvalues, every vector orthogonal in the mass to all others. A section has a few thousand amplitudes and a few
//! dozen modes of an order, so the space is never restarted.

use super::skyline_ldlt::SkylineFactor;
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
/// A column that keeps this part of its length among the columns of its block is as orthogonal to the basis as before.
const LITTLE_LOST: f64 = 0.1;
/// The same of what two rounds of orthogonalisation leave of it.
const LEFT: f64 = 1e-6;

/// Eigenvalues, ascending, `[m]`, and vectors, orthonormal in the mass, `[order, m]`.
pub struct KrylovPairs {
    /// λ, 1/s².
    pub lambda: Vec<f64>,
    /// Vectors.
    pub vectors: Mat<f64>,
}

/// A basis Q with QᵀMQ = 1.
struct Space<'f> {
    forms: &'f Forms,
    n: usize,
    /// Q, column by column, `[order, columns]`.
    basis: Vec<f64>,
    /// MQ, `[order, columns]`.
    mass: Vec<f64>,
    columns: usize,
    random: u64,
}

/// At least the `count` lowest pairs of the order `n` of `forms`; `factor` is that of K − σM, which must be positive
/// definite.
pub fn lowest(forms: &Forms, n: usize, sigma: f64, factor: &SkylineFactor, count: usize) -> Result<KrylovPairs> {
    let order = forms.order();
    let mut space = Space { forms, n, basis: Vec::new(), mass: Vec::new(), columns: 0, random: 1 };
    // QᵀM(K − σM)⁻¹MQ, and the part of it that is beyond the basis.
    let mut t = Mat::<f64>::zeros(0, 0);
    space.extend(&Mat::zeros(order, BLOCK.min(order)));
    let (mut done, mut look) = (0, count);
    loop {
        let image = factor.solve(space.last_mass(done));
        let width = image.ncols();
        done += width;
        let columns = if done < order { space.extend(&image) } else { space.mass().transpose() * &image };
        let mut larger = Mat::zeros(columns.nrows(), done);
        larger.as_mut().submatrix_mut(0, 0, t.nrows(), t.ncols()).copy_from(&t);
        larger.as_mut().subcols_mut(done - width, width).copy_from(&columns);
        t = larger;
        if done < look && done < order {
            continue;
        }
        let square = t.as_ref().subrows(0, done);
        let symmetric = Mat::from_fn(done, done, |i, j| 0.5 * (square[(i, j)] + square[(j, i)]));
        let (theta, vectors) = symmetric_eigen(symmetric.as_ref())
            .ok_or_else(|| Error::NotConverged(format!("modes of order {n}: the projected problem was not solved")))?;
        let beyond = t.as_ref().subrows(done, t.nrows() - done) * vectors.as_ref();
        let converged = |k: usize| beyond.col(k).norm_l2() <= TOLERANCE * theta[k];
        // The largest θ are those of the lowest λ.
        let open = (done - count..done).filter(|&k| !converged(k)).count();
        if open == 0 {
            let wanted: Vec<usize> = (0..done).rev().take_while(|&k| converged(k)).collect();
            let lambda = wanted.iter().map(|&k| sigma + 1.0 / theta[k]).collect();
            let ritz = Mat::from_fn(done, wanted.len(), |i, k| vectors[(i, wanted[k])]);
            let vectors = space.basis().subcols(0, done) * ritz;
            return Ok(KrylovPairs { lambda, vectors });
        }
        // Hardly more pairs converge than columns are added, and the projected problem is not cheap.
        look = done + open;
    }
}

impl Space<'_> {
    /// Q, `[order, columns]`.
    fn basis(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.basis, self.forms.order(), self.columns)
    }

    /// MQ, `[order, columns]`.
    fn mass(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.mass, self.forms.order(), self.columns)
    }

    /// MQ without its first `done` columns.
    fn last_mass(&self, done: usize) -> MatRef<'_, f64> {
        self.mass().subcols(done, self.columns - done)
    }

    /// Another block: what is new in the columns, and random columns where nothing is. Returns the components QᵀM of
    /// the columns along the basis with the block, `[columns, width]`.
    fn extend(&mut self, columns: &Mat<f64>) -> Mat<f64> {
        let order = self.forms.order();
        let known = self.columns;
        let width = columns.ncols().min(order - known);
        let mut block = columns.as_ref().subcols(0, width).to_owned();
        let sizes: Vec<f64> = block.col_iter().map(|c| c.norm_l2()).collect();
        let mut along = Mat::<f64>::zeros(known + width, width);
        for _ in 0..2 {
            let part = self.mass().transpose() * &block;
            block -= self.basis() * &part;
            let mut old = along.as_mut().subrows_mut(0, known);
            old += part;
        }
        let mut mass = self.forms.mass(self.n, block.as_ref());
        for k in 0..width {
            let length = |block: &Mat<f64>, mass: &Mat<f64>| (block.col(k).transpose() * mass.col(k)).max(0.0).sqrt();
            let before = length(&block, &mass);
            for j in (0..k).chain(0..k) {
                let part = mass.col(j).transpose() * block.col(k);
                along[(known + j, k)] += part;
                subtract(&mut block, part, j, k);
                subtract(&mut mass, part, j, k);
            }
            let mut size = length(&block, &mass);
            if !(size > LITTLE_LOST * before && block.col(k).norm_l2() > LEFT * sizes[k]) {
                size = self.renew((&mut block, &mut mass), k, sizes[k], &mut along);
            } else {
                along[(known + k, k)] = size;
            }
            for matrix in [&mut block, &mut mass] {
                matrix.col_mut(k).iter_mut().for_each(|v| *v /= size);
            }
        }
        for k in 0..width {
            self.basis.extend(block.col(k).iter());
            self.mass.extend(mass.col(k).iter());
        }
        self.columns += width;
        if width == columns.ncols() {
            along
        } else {
            self.mass().transpose() * columns
        }
    }

    /// Makes the column `k` of a block orthogonal to the basis and to the columns before it once more, or puts a random
    /// one in its place where nothing of it is new to a column of the norm `reference`. Returns its length in the mass.
    fn renew(
        &mut self,
        (block, mass): (&mut Mat<f64>, &mut Mat<f64>),
        k: usize,
        mut reference: f64,
        along: &mut Mat<f64>,
    ) -> f64 {
        let known = self.columns;
        let mut column = block.as_ref().subcols(k, 1).to_owned();
        let mut random = false;
        loop {
            for _ in 0..2 {
                let old = self.mass().transpose() * &column;
                column -= self.basis() * &old;
                let here = mass.as_ref().subcols(0, k).transpose() * &column;
                column -= block.as_ref().subcols(0, k) * &here;
                if !random {
                    (0..known).for_each(|i| along[(i, k)] += old[(i, 0)]);
                    (0..k).for_each(|i| along[(known + i, k)] += here[(i, 0)]);
                }
            }
            if column.norm_l2() > SPENT * reference && reference > 0.0 {
                break;
            }
            column = self.random_column();
            (reference, random) = (column.norm_l2(), true);
        }
        let loaded = self.forms.mass(self.n, column.as_ref());
        let size = (column.transpose() * &loaded)[(0, 0)].sqrt();
        along[(known + k, k)] = if random { 0.0 } else { size };
        block.as_mut().col_mut(k).copy_from(column.col(0));
        mass.as_mut().col_mut(k).copy_from(loaded.col(0));
        size
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

/// Subtracts `factor` times the column `j` from the column `k`.
fn subtract(matrix: &mut Mat<f64>, factor: f64, j: usize, k: usize) {
    for i in 0..matrix.nrows() {
        let part = factor * matrix[(i, j)];
        matrix[(i, k)] -= part;
    }
}
