//! Eigenpairs around a shift, with their residuals.
//!
//! The inverse at a shift takes rotation as the modes see it. So what the eigensolver finds with it are pairs of a
//! nearby problem. They become those of the whole one in the space of their vectors, in which the whole problem is
//! projected, and which is corrected by what one more inverse iteration would change of each: that is the measure of
//! the error, too. What vectors have of eigenvectors that the space does not hold shrinks by their distances from the
//! shift, so pairs beyond those that are needed are in it as well. Where it goes slowly and much is left, because the
//! modes see too little of the rotation, the eigensolver works on the whole problem instead, with solutions that are
//! corrected (`turning`).

use super::residuals::{PairResiduals, Residuals};
use super::system::System;
use crate::eigen::projection::Projection;
use crate::eigen::quadratic::{nearest, Quadratic, QuadraticPairs, QuadraticSettings, BLOCK};
use crate::eigen::sparse::Method;
use crate::petsc::pep::{quadratic, QuadraticOptions};
use crate::petsc::Petsc;
use crate::Result;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Largest residual of θ = 1/(λ − σ) over θ.
const TOLERANCE: f64 = 1e-10;
/// The same where pairs of a nearby problem are improved anyway, and of vectors beyond them that help: without those
/// what eigenvectors have of others just beyond is slow to go.
const NEARBY: f64 = 1e-7;
const LOOSE: f64 = 3e-2;
/// Change of an eigenvector by one more inverse iteration, and backward error, after which it is not improved any more.
const UNCHANGED: f64 = 3e-8;
const GOOD: f64 = 1e-10;
/// By this much farther than they are needed pairs are improved: eigenvalues of the nearby problem move.
const MARGIN: f64 = 1e-3;
/// Solves that a corrected solution takes.
const CORRECTED: f64 = 3.0;

/// An eigenpair of the system.
#[derive(Debug, Clone)]
pub struct FullEigenpair {
    /// λ, 1/s.
    pub value: C,
    /// Local rows of the vector.
    pub vector: Vec<C>,
    /// Its residuals.
    pub residuals: Residuals,
}

/// Eigenpairs around a shift.
#[derive(Debug, Clone)]
pub struct ShiftSpectrum {
    /// The nearest first; none is left out among them.
    pub pairs: Vec<FullEigenpair>,
    /// Distance from the shift within which all are known, 1/s.
    pub radius: f64,
    /// Columns that were solved for.
    pub solves: usize,
    /// True if solutions had to be corrected for what the modes do not see of rotation.
    pub corrected: bool,
}

/// Ritz values and vectors of an eigensolver: eigenvalues in units of the rate, the nearest first, their vectors,
/// others that help, and the columns that were solved for.
struct Ritz {
    lambda: Vec<C>,
    vectors: Vec<Vec<C>>,
    beside: Vec<Vec<C>>,
    solves: usize,
}

impl System<'_> {
    /// Collective: the `count` eigenpairs nearest to the shift at which the system stands, or more; where bodies
    /// rotate only those of them within the `reach`, 1/s, if they come together. `progress` is told converged and
    /// wanted pairs.
    pub fn nearest(
        &mut self,
        petsc: &Petsc,
        method: Method,
        (count, reach): (usize, f64),
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<ShiftSpectrum> {
        let mut solves = 0;
        self.accuracy = None;
        if self.turns() {
            let nearby = self.ritz(petsc, method, (count, NEARBY, LOOSE), progress)?;
            let target = self.sigma / self.rate;
            let distances: Vec<f64> = nearby.lambda.iter().map(|l| (l - target).norm()).collect();
            solves = nearby.solves;
            if let Some(around) = self.improve(nearby, reach, &mut solves)? {
                return Ok(around);
            }
            self.correct_solutions(&distances);
        }
        let found = self.ritz(petsc, method, (count, TOLERANCE, 0.0), progress)?;
        solves += found.solves + found.lambda.len();
        let values: Vec<C> = found.lambda.iter().map(|l| l * self.rate).collect();
        let pairs: Vec<(C, &[C])> = values.iter().copied().zip(found.vectors.iter().map(Vec::as_slice)).collect();
        let residuals = self.residuals(&pairs)?;
        let radius = values.iter().map(|v| (v - self.sigma).norm()).fold(0.0, f64::max);
        let found = values.into_iter().zip(found.vectors).zip(residuals);
        let pairs = found.map(|((value, vector), residuals)| FullEigenpair { value, vector, residuals }).collect();
        Ok(ShiftSpectrum { pairs, radius, solves, corrected: self.accuracy.is_some() })
    }

    /// Collective: the `count` pairs nearest to the shift with residuals of `tolerance`, and vectors beside them that
    /// are `loose`, of the problem that solutions stand for.
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
                let QuadraticPairs { lambda, vectors, beside, solves, .. } =
                    nearest(self, &start, &QuadraticSettings { target, count, tolerance, loose }, progress)?;
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

    /// Collective: the pairs of the whole problem that those of the `nearby` one within the `reach` (1/s) become;
    /// those beyond help. `None` where they come so slowly that corrected solutions take less. The columns that are
    /// solved for are added to `solves`.
    fn improve(&mut self, nearby: Ritz, reach: f64, solves: &mut usize) -> Result<Option<ShiftSpectrum>> {
        let target = self.sigma / self.rate;
        let n = Quadratic::n_local(self);
        let distance = |l: &C| (l - target).norm();
        let needed = reach / self.rate * (1.0 + MARGIN);
        let sought = nearby.lambda.iter().take_while(|l| distance(l) <= needed).count();
        let mut current = nearby.lambda.clone();
        let mut space = Projection::new(self, nearby.vectors.into_iter().chain(nearby.beside).collect())?;
        let mut done: Vec<Option<FullEigenpair>> = vec![None; sought];
        let mut before = f64::INFINITY;
        loop {
            let (values, coordinates) = space.pairs(self.world, target, &current)?;
            let open: Vec<usize> = (0..sought).filter(|&i| done[i].is_none()).collect();
            for i in open.iter().copied().chain(sought..values.len()) {
                current[i] = values[i];
            }
            let (mut which, mut changes, mut worst) = (Vec::new(), Vec::new(), 0.0f64);
            for some in open.chunks(BLOCK) {
                let own = Mat::from_fn(space.order(), some.len(), |i, j| coordinates[(i, some[j])]);
                let mine: Vec<C> = some.iter().map(|&i| values[i]).collect();
                let vectors = space.vectors(own.as_ref());
                let rest = space.residuals(&mine, own.as_ref());
                *solves += some.len();
                let real: Vec<C> = mine.iter().map(|l| l * self.rate).collect();
                let judged = self.judge(&real, &vectors, rest)?;
                for ((&i, x), PairResiduals { residuals, change }) in
                    some.iter().zip(vectors.chunks_exact(n)).zip(judged)
                {
                    if residuals.correction <= UNCHANGED && residuals.backward_error <= GOOD {
                        done[i] = Some(FullEigenpair { value: values[i] * self.rate, vector: x.to_vec(), residuals });
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
            // The rounds to come at this pace.
            let rounds = (worst / UNCHANGED).ln() / (before / worst).ln();
            if !(worst < before && rounds * which.len() as f64 <= CORRECTED * nearby.solves as f64) {
                return Ok(None);
            }
            space.correct(self, coordinates.as_ref(), &which, &changes)?;
            before = worst;
        }
        let moved = nearby.lambda.iter().zip(&current).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        // Up to the nearest of those that were not sought all are known.
        let bound = match sought < current.len() {
            true => current[sought..].iter().map(distance).fold(f64::INFINITY, f64::min),
            false => current.iter().map(distance).fold(0.0, f64::max),
        };
        let radius = (bound - 2.0 * moved) * self.rate;
        let mut pairs: Vec<FullEigenpair> = done.into_iter().flatten().collect();
        pairs.sort_by(|a, b| (a.value - self.sigma).norm().total_cmp(&(b.value - self.sigma).norm()));
        Ok(Some(ShiftSpectrum { pairs, radius, solves: *solves, corrected: false }))
    }
}
