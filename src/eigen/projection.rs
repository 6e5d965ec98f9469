//! Galerkin's projection of a quadratic eigenproblem (λ²M + λC + K) x = 0 onto a space of not many more vectors than
//! pairs are sought. It is not widened but corrected: from each vector is taken what one step of inverse iteration
//! with a residual changes of it (A. Neumaier, SIAM J. Numer. Anal. 22, 1985). What eigenvectors in the space have of
//! each other the projection sorts out; the rest, of eigenvectors far from the shift, shrinks quickly.

use super::quadratic::{gram, sizes, split_block, Quadratic, C};
use crate::parallel::World;
use crate::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Columns taken in at a time.
const BLOCK: usize = 8;

/// A space and the problem in it.
pub struct Projection {
    /// Local rows of each vector.
    n: usize,
    /// Local rows of the basis Q, column by column.
    basis: Vec<C>,
    /// Images K Q, C Q, M Q.
    images: [Vec<C>; 3],
    /// QᴴKQ, QᴴCQ, QᴴMQ.
    matrices: [Mat<C>; 3],
}

fn columns(values: &[C], n: usize) -> MatRef<'_, C> {
    MatRef::from_column_major_slice(values, n, values.len() / n)
}

/// out += factor a b, `a` of `n` rows, column by column.
fn add_product(out: &mut [C], a: &[C], b: MatRef<'_, C>, factor: f64, n: usize) {
    let target = MatMut::from_column_major_slice_mut(out, n, b.ncols());
    matmul(target, Accum::Add, columns(a, n), b, C::from(factor), Par::Seq);
}

impl Projection {
    /// Collective: the span of `vectors`, local rows of each; what is rounding beside the others is left out.
    pub fn new(operator: &mut dyn Quadratic, vectors: Vec<Vec<C>>) -> Result<Self> {
        let n = operator.n_local();
        let mut basis = Vec::new();
        for some in vectors.chunks(BLOCK) {
            let w = some.concat();
            let lengths = sizes(operator.world(), &w, n);
            let new = split_block(operator.world(), columns(&w, n), columns(&basis, n), &lengths).q;
            new.col_iter().for_each(|c| basis.extend(c.iter()));
        }
        drop(vectors);
        let images = images(operator, &basis)?;
        let mut space = Self { n, basis, images, matrices: [0, 1, 2].map(|_| Mat::zeros(0, 0)) };
        space.project(operator.world());
        Ok(space)
    }

    /// Vectors of Q.
    pub fn order(&self) -> usize {
        self.basis.len() / self.n
    }

    /// Collective.
    fn project(&mut self, world: &World) {
        for (matrix, images) in self.matrices.iter_mut().zip(&self.images) {
            *matrix = gram(world, columns(&self.basis, self.n), columns(images, self.n));
        }
    }

    /// Collective: takes the `changes` (local rows column by column) off the vectors `which` of those with these
    /// coordinates.
    pub fn correct(
        &mut self,
        operator: &mut dyn Quadratic,
        coordinates: MatRef<'_, C>,
        which: &[usize],
        changes: &[C],
    ) -> Result<()> {
        // Q − W T with T Y = 1.
        let square = coordinates.adjoint() * coordinates;
        let whole = square.partial_piv_lu().solve(coordinates.adjoint().to_owned());
        for (changes, which) in changes.chunks(BLOCK * self.n).zip(which.chunks(BLOCK)) {
            let t = Mat::from_fn(which.len(), whole.ncols(), |i, j| whole[(which[i], j)]);
            add_product(&mut self.basis, changes, t.as_ref(), -1.0, self.n);
            for (image, changed) in self.images.iter_mut().zip(images(operator, changes)?) {
                add_product(image, &changed, t.as_ref(), -1.0, self.n);
            }
        }
        self.project(operator.world());
        Ok(())
    }

    /// Collective: of the pairs of the projected problem those that go with `known` eigenvalues, each nearest to its
    /// own, none twice; the vectors as coordinates in Q, of norm 1. `target` is the shift at which it is inverted.
    pub fn pairs(&self, world: &World, target: C, known: &[C]) -> Result<(Vec<C>, Mat<C>)> {
        let r = self.order();
        let found = world.on_root(|| {
            let (all, vectors) = self.all(target)?;
            let mut distances: Vec<(f64, usize, usize)> = Vec::new();
            for (i, a) in known.iter().enumerate() {
                distances.extend(all.iter().enumerate().map(|(j, b)| ((a - b).norm(), i, j)));
            }
            distances.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (mut own, mut taken) = (vec![None; known.len()], vec![false; all.len()]);
            for (_, i, j) in distances {
                if own[i].is_none() && !taken[j] {
                    (own[i], taken[j]) = (Some(j), true);
                }
            }
            let own: Vec<usize> = own.into_iter().flatten().collect();
            if own.len() < known.len() {
                let few = format!("{} pairs are sought in a space of {r}", known.len());
                return Err(Error::Defect(format!("quadratic eigenproblem: {few}")));
            }
            let mut flat: Vec<C> = own.iter().map(|&j| all[j]).collect();
            for &j in &own {
                let size = (0..r).map(|i| vectors[(i, j)].norm_sqr()).sum::<f64>().sqrt();
                flat.extend((0..r).map(|i| vectors[(i, j)] / size));
            }
            Ok(flat)
        })?;
        let flat = world.broadcast(found.unwrap_or_default());
        let (lambda, coordinates) = flat.split_at(known.len());
        Ok((lambda.to_vec(), MatRef::from_column_major_slice(coordinates, r, known.len()).to_owned()))
    }

    /// All finite eigenvalues of the projected problem and their vectors, by its companion form inverted at the
    /// target: (x₁, x₂) → (u, x₁ + σu), u = −P(σ)⁻¹ (M (x₂ + σx₁) + C x₁).
    fn all(&self, target: C) -> Result<(Vec<C>, Mat<C>)> {
        let r = self.order();
        let [k, c, m] = &self.matrices;
        let scaled = |a: &Mat<C>, by: C| a * faer::Scale(by);
        let whole = k + scaled(c, target) + scaled(m, target * target);
        let factor = whole.partial_piv_lu();
        let (first, second) = (factor.solve(&(scaled(m, target) + c)), factor.solve(m));
        let operator = Mat::from_fn(2 * r, 2 * r, |i, j| {
            let of = |i: usize| if j < r { -first[(i, j)] } else { -second[(i, j - r)] };
            match i < r {
                true => of(i),
                false => target * of(i - r) + if i - r == j { C::from(1.0) } else { C::default() },
            }
        });
        let eigen = operator
            .eigen()
            .map_err(|e| Error::NotConverged(format!("quadratic eigenproblem: its projection: {e:?}")))?;
        let theta = eigen.S().column_vector();
        let finite: Vec<usize> = (0..2 * r).filter(|&j| theta[j].norm() > 0.0).collect();
        let lambda = finite.iter().map(|&j| target + theta[j].inv()).collect();
        Ok((lambda, Mat::from_fn(r, finite.len(), |i, j| eigen.U()[(i, finite[j])])))
    }

    /// Local rows of the vectors with these coordinates.
    pub fn vectors(&self, coordinates: MatRef<'_, C>) -> Vec<C> {
        let mut out = vec![C::default(); self.n * coordinates.ncols()];
        add_product(&mut out, &self.basis, coordinates, 1.0, self.n);
        out
    }

    /// Local rows of P(λ)x of pairs with these eigenvalues and coordinates.
    pub fn residuals(&self, lambda: &[C], coordinates: MatRef<'_, C>) -> Vec<C> {
        let mut out = vec![C::default(); self.n * lambda.len()];
        for (power, images) in self.images.iter().enumerate() {
            let weighted = Mat::from_fn(coordinates.nrows(), lambda.len(), |i, j| {
                lambda[j].powu(power as u32) * coordinates[(i, j)]
            });
            add_product(&mut out, images, weighted.as_ref(), 1.0, self.n);
        }
        out
    }
}

/// Collective: K X, C X, M X.
fn images(operator: &mut dyn Quadratic, x: &[C]) -> Result<[Vec<C>; 3]> {
    let n = operator.n_local();
    let mut out: [Vec<C>; 3] = Default::default();
    for x in x.chunks(BLOCK * n) {
        for (out, image) in out.iter_mut().zip(operator.images(x, x.len() / n)?) {
            out.extend(image);
        }
    }
    Ok(out)
}
