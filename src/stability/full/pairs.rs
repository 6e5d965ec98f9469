//! Eigenpairs around a shift, with their residuals.
//!
//! The inverse at a shift takes rotation as the modes see it. So what the eigensolver finds with it are pairs of a nearby problem. They become those of the whole one in the space
//! of their vectors, in which the whole problem is projected, and which is corrected by what one more inverse iteration would change of each: that is the measure of the error, too.

use super::residuals::{Judged, Residuals};
use super::system::System;
use crate::eigen::projection::Projection;
use crate::eigen::quadratic::{nearest, Quadratic, Wanted, BLOCK};
use crate::eigen::sparse::Method;
use crate::petsc::pep::{quadratic, QuadraticOptions};
use crate::petsc::Petsc;
use crate::{Error, Result};
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Largest residual of θ = 1/(λ − σ) over θ.
const TOLERANCE: f64 = 1e-10;
/// The same where pairs of a nearby problem are improved anyway, and of vectors beyond them that help: without those what eigenvectors have of others just beyond is slow to go.
const NEARBY: f64 = 1e-7;
const LOOSE: f64 = 3e-2;
/// Change of an eigenvector by one more inverse iteration, and backward error, after which it is not improved any more.
const UNCHANGED: f64 = 3e-8;
const GOOD: f64 = 1e-10;
/// Where what is left falls by less in a round, the changes widen the space.
const SLOW: f64 = 0.6;
/// Most improvements.
const ROUNDS: usize = 30;

/// An eigenpair of the system.
#[derive(Debug, Clone)]
pub struct Found {
    /// λ, 1/s.
    pub value: C,
    /// Local rows of the vector.
    pub vector: Vec<C>,
    /// Its residuals.
    pub residuals: Residuals,
}

/// Eigenpairs around a shift.
#[derive(Debug, Clone)]
pub struct Around {
    /// The nearest first; none is left out among them.
    pub pairs: Vec<Found>,
    /// Distance, 1/s, by which eigenvalues of the nearby problem moved: so far inside the farthest all are known.
    pub moved: f64,
    /// Columns that were solved for.
    pub solves: usize,
}

impl System<'_> {
    /// Collective: at least the `count` eigenpairs nearest to the shift at which the system stands. `progress` is told converged and wanted pairs.
    pub fn nearest(
        &mut self,
        petsc: &Petsc,
        method: Method,
        count: usize,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Around> {
        let turns = self.turns();
        let target = self.sigma / self.rate;
        let tolerance = if turns { NEARBY } else { TOLERANCE };
        let (lambda, vectors, beside, solves) = match method {
            Method::Blocks => {
                let start = self.start(BLOCK)?;
                let loose = if turns { LOOSE } else { 0.0 };
                let found = nearest(self, &start, &Wanted { target, count, tolerance, loose }, progress)?;
                (found.lambda, found.vectors, found.beside, found.solves + BLOCK)
            }
            Method::Slepc => {
                let start = self.start(1)?;
                let wanted = QuadraticOptions { target, count, tolerance, prefix: "stability_".into() };
                let found = quadratic(petsc, self, &start, &wanted, progress)?;
                (found.lambda, found.vectors, Vec::new(), found.solves + 1)
            }
        };
        if turns {
            // Those found beyond the wanted ones help like the others.
            let wanted = count.min(lambda.len());
            return self.improve(&lambda[..wanted], vectors.into_iter().chain(beside).collect(), solves);
        }
        let solved = solves + lambda.len();
        let values: Vec<C> = lambda.iter().map(|l| l * self.rate).collect();
        let pairs: Vec<(C, &[C])> = values.iter().copied().zip(vectors.iter().map(Vec::as_slice)).collect();
        let residuals = self.residuals(&pairs)?;
        let found = values.into_iter().zip(vectors).zip(residuals);
        let pairs = found.map(|((value, vector), residuals)| Found { value, vector, residuals }).collect();
        Ok(Around { pairs, moved: 0.0, solves: solved })
    }

    /// Collective: the pairs of the whole problem nearest to those of the nearby one, of eigenvalues `lambda` and the first of the `vectors`; the others help.
    fn improve(&mut self, lambda: &[C], vectors: Vec<Vec<C>>, mut solves: usize) -> Result<Around> {
        let target = self.sigma / self.rate;
        let n = Quadratic::n_local(self);
        let mut space = Projection::new(self, vectors)?;
        let mut before = f64::INFINITY;
        let mut done: Vec<Option<Found>> = vec![None; lambda.len()];
        let mut current = lambda.to_vec();
        for round in 0.. {
            let (values, coordinates) = space.pairs(self.world, target, &current)?;
            let open: Vec<usize> = (0..current.len()).filter(|&i| done[i].is_none()).collect();
            let (mut which, mut changes, mut worst) = (Vec::new(), Vec::new(), 0.0f64);
            for some in open.chunks(BLOCK) {
                let own = Mat::from_fn(space.order(), some.len(), |i, j| coordinates[(i, some[j])]);
                let mine: Vec<C> = some.iter().map(|&i| values[i]).collect();
                let vectors = space.vectors(own.as_ref());
                let rest = space.residuals(&mine, own.as_ref());
                solves += some.len();
                let real: Vec<C> = mine.iter().map(|l| l * self.rate).collect();
                let judged = self.judge(&real, &vectors, rest)?;
                for ((&i, x), Judged { residuals, change }) in some.iter().zip(vectors.chunks_exact(n)).zip(judged) {
                    current[i] = values[i];
                    if residuals.correction <= UNCHANGED && residuals.backward_error <= GOOD {
                        done[i] = Some(Found { value: values[i] * self.rate, vector: x.to_vec(), residuals });
                    } else {
                        worst = worst.max(residuals.correction);
                        which.push(i);
                        changes.extend(change);
                    }
                }
            }
            if which.is_empty() {
                break;
            }
            if round == ROUNDS {
                return Err(Error::NotConverged(format!(
                    "the rotation that the modes do not see is not taken in: one more inverse iteration changes an eigenvector by {worst:.1e}; \
                     ask for more modes in analyses.modes"
                )));
            }
            if worst <= SLOW * before {
                space.correct(self, coordinates.as_ref(), &which, &changes)?;
            } else {
                space.widen(self, &changes)?;
            }
            before = worst;
        }
        let moved = lambda.iter().zip(&current).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) * self.rate;
        let mut pairs: Vec<Found> = done.into_iter().flatten().collect();
        let distance = |p: &Found| (p.value - self.sigma).norm();
        pairs.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        Ok(Around { pairs, moved, solves })
    }
}
