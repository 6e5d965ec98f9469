//! Eigenpairs around a shift, with their residuals.
//!
//! The inverse at a shift takes rotation as the modes see it. So what the eigensolver finds with it are pairs of a nearby problem. They become those of the whole one in the space
//! of their vectors, in which the whole problem is projected, and which is corrected by what one more inverse iteration would change of each: that is the measure of the error, too.
//! What vectors at the border of the disc have of eigenvectors just beyond goes slowly that way. Where it is not small, because the modes see too little of the rotation, the
//! eigensolver works on the whole problem instead, with solutions that are corrected ([`super::turning`]).

use super::residuals::{Judged, Residuals};
use super::system::System;
use crate::eigen::projection::Projection;
use crate::eigen::quadratic::{nearest, Pairs, Quadratic, Wanted, BLOCK};
use crate::eigen::sparse::Method;
use crate::petsc::pep::{quadratic, QuadraticOptions};
use crate::petsc::Petsc;
use crate::Result;
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
/// Where what is left falls by less in a round, corrected solutions cost less than the rounds to come.
const SLOW: f64 = 0.6;

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
    /// Whether solutions had to be corrected for what the modes do not see of rotation.
    pub corrected: bool,
}

/// What an eigensolver found: eigenvalues in units of the rate, the nearest first, their vectors, others that help, and the columns that were solved for.
struct Ritz {
    lambda: Vec<C>,
    vectors: Vec<Vec<C>>,
    beside: Vec<Vec<C>>,
    solves: usize,
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
        let mut solves = 0;
        self.accuracy = None;
        if self.turns() {
            let nearby = self.ritz(petsc, method, (count, NEARBY, LOOSE), progress)?;
            solves = nearby.solves;
            // Those found beyond the wanted ones help like the others.
            let wanted = &nearby.lambda[..count.min(nearby.lambda.len())];
            let vectors: Vec<Vec<C>> = nearby.vectors.into_iter().chain(nearby.beside).collect();
            if let Some(around) = self.improve(wanted, &vectors, &mut solves)? {
                return Ok(around);
            }
            let target = self.sigma / self.rate;
            self.correct_solutions(wanted.iter().map(|l| (l - target).norm()));
        }
        let found = self.ritz(petsc, method, (count, TOLERANCE, 0.0), progress)?;
        solves += found.solves + found.lambda.len();
        let values: Vec<C> = found.lambda.iter().map(|l| l * self.rate).collect();
        let pairs: Vec<(C, &[C])> = values.iter().copied().zip(found.vectors.iter().map(Vec::as_slice)).collect();
        let residuals = self.residuals(&pairs)?;
        let found = values.into_iter().zip(found.vectors).zip(residuals);
        let pairs = found.map(|((value, vector), residuals)| Found { value, vector, residuals }).collect();
        Ok(Around { pairs, moved: 0.0, solves, corrected: self.accuracy.is_some() })
    }

    /// Collective: the `count` pairs nearest to the shift with residuals of `tolerance`, and vectors beside them that are `loose`, of the problem that solutions stand for.
    fn ritz(
        &mut self,
        petsc: &Petsc,
        method: Method,
        (count, tolerance, loose): (usize, f64, f64),
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Ritz> {
        let target = self.sigma / self.rate;
        match method {
            Method::Blocks => {
                let start = self.start(BLOCK)?;
                let Pairs { lambda, vectors, beside, solves, .. } =
                    nearest(self, &start, &Wanted { target, count, tolerance, loose }, progress)?;
                Ok(Ritz { lambda, vectors, beside, solves: solves + BLOCK })
            }
            Method::Slepc => {
                let start = self.start(1)?;
                let wanted = QuadraticOptions { target, count, tolerance, prefix: "stability_".into() };
                let found = quadratic(petsc, self, &start, &wanted, progress)?;
                Ok(Ritz { lambda: found.lambda, vectors: found.vectors, beside: Vec::new(), solves: found.solves + 1 })
            }
        }
    }

    /// Collective: the pairs of the whole problem nearest to those of the nearby one, of eigenvalues `lambda` and the first of the `vectors`; the others help. `None` where they
    /// come too slowly. The columns that are solved for are added to `solves`.
    fn improve(&mut self, lambda: &[C], vectors: &[Vec<C>], solves: &mut usize) -> Result<Option<Around>> {
        let target = self.sigma / self.rate;
        let n = Quadratic::n_local(self);
        let mut space = Projection::new(self, vectors)?;
        let mut before = f64::INFINITY;
        let mut done: Vec<Option<Found>> = vec![None; lambda.len()];
        let mut current = lambda.to_vec();
        loop {
            let (values, coordinates) = space.pairs(self.world, target, &current)?;
            let open: Vec<usize> = (0..current.len()).filter(|&i| done[i].is_none()).collect();
            let (mut which, mut changes, mut worst) = (Vec::new(), Vec::new(), 0.0f64);
            for some in open.chunks(BLOCK) {
                let own = Mat::from_fn(space.order(), some.len(), |i, j| coordinates[(i, some[j])]);
                let mine: Vec<C> = some.iter().map(|&i| values[i]).collect();
                let vectors = space.vectors(own.as_ref());
                let rest = space.residuals(&mine, own.as_ref());
                *solves += some.len();
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
            if !(worst <= SLOW * before) {
                return Ok(None);
            }
            space.correct(self, coordinates.as_ref(), &which, &changes)?;
            before = worst;
        }
        let moved = lambda.iter().zip(&current).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) * self.rate;
        let mut pairs: Vec<Found> = done.into_iter().flatten().collect();
        let distance = |p: &Found| (p.value - self.sigma).norm();
        pairs.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        Ok(Some(Around { pairs, moved, solves: *solves, corrected: false }))
    }
}
