//! Many pairs, or all of a band, by spectrum slicing: one factorisation after the other along the axis of λ, each for
//! the pairs to both sides of its shift. The inertia at a shift says how many eigenvalues lie below it, so every
//! stretch between two shifts is known to be complete before the next one begins. What was found to the right of the
//! shift before is deflated, so nothing is found twice, wherever a cluster lies. Source: Grimes, Lewis, Simon, SIAM
//! J. Matrix Anal. Appl. 15 (1994) 228, section 3.

use super::block::columns;
use super::check::{checked, FoundModes};
use super::lanczos::{self, Goal};
use super::{enough, Pencil, Shifted};
use crate::{Error, Result};

/// Pairs about one shift.
const PAIRS: usize = 80;
/// More missing pairs than this below a shift, and one nearer to the shift before is taken.
const TOO_MANY: usize = 2 * PAIRS;
/// Alternative shifts, in parts of the step to the shift, when that is an eigenvalue to working precision.
const ASIDE: [f64; 4] = [0.0, 1.3e-2, -1.7e-2, 3.1e-2];
/// The same at the ends of a band, in parts of its width: those that count as within it lie outside by less.
const BARELY: [f64; 4] = [0.0, 1e-9, 1e-7, 1e-5];

/// An inverse of K − σM whose shift can be moved.
pub trait MovableShift: Shifted {
    /// Collective: factorises K − σM for another σ. An [`Error::NotConverged`] means that σ is an eigenvalue to
    /// working precision.
    fn move_to(&mut self, sigma: f64) -> Result<()>;
}

/// How far to go.
#[derive(Clone, Copy)]
enum Until {
    Count(usize),
    End(f64),
}

/// Collective: at least the `count` lowest pairs above the shift of `first`, complete as the inertia says. `moving`
/// is put to further shifts. `progress` is told found and wanted pairs.
pub fn lowest(
    pencil: &dyn Pencil,
    first: &mut dyn Shifted,
    moving: &mut dyn MovableShift,
    count: usize,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<FoundModes> {
    enough(count, pencil.order())?;
    let mut slices = Slices::new(pencil, first, progress);
    slices.count = Some(count);
    slices.visit(first, PAIRS.min(count))?;
    slices.walk(moving, Until::Count(count))?;
    slices.modes(f64::INFINITY)
}

/// Collective: all pairs with `from` < λ < `to`, as many as the inertia at both ends says. An end that is an
/// eigenvalue to working precision is moved up a little, at most by 1e-5 of the width.
pub fn band(
    pencil: &dyn Pencil,
    moving: &mut dyn MovableShift,
    from: f64,
    to: f64,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<FoundModes> {
    if !(from < to) {
        return Err(Error::Defect(format!("band from {from} to {to}")));
    }
    aside(moving, from, to - from, &BARELY)?;
    let mut slices = Slices::new(pencil, moving, progress);
    // The distance of an eigenvalue from an end says nothing of how well it is known.
    slices.reference = from - (to - from);
    slices.visit(moving, PAIRS / 2)?;
    slices.walk(moving, Until::End(to))?;
    // The end may have been moved.
    let end = slices.shift.max(to);
    slices.modes(end)
}

/// Collective: moves the shift to `sigma`, or as little aside as it takes, in parts of `step`.
fn aside(moving: &mut dyn MovableShift, sigma: f64, step: f64, parts: &[f64]) -> Result<()> {
    let mut last = None;
    for part in parts {
        match moving.move_to(sigma + part * step) {
            Err(error @ Error::NotConverged(_)) => last = Some(error),
            other => return other,
        }
    }
    Err(last.unwrap_or_else(|| Error::Defect("no shift to try".into())))
}

struct Slices<'a> {
    pencil: &'a dyn Pencil,
    progress: &'a mut dyn FnMut(usize, usize),
    /// Pairs that are sought, where that is known.
    count: Option<usize>,
    /// Eigenvalues below the first shift, which nobody asks for.
    base: u64,
    /// Reference eigenvalue of the residuals.
    reference: f64,
    /// The shift up to which all is found.
    shift: f64,
    /// Eigenvalues found, in the order of `vectors`.
    lambda: Vec<f64>,
    /// `[n_local, lambda.len()]`.
    vectors: Vec<f64>,
    /// The first pair beyond the shift.
    beyond: usize,
    /// There are no more.
    exhausted: bool,
    restarts: usize,
    solves: usize,
}

impl<'a> Slices<'a> {
    fn new(pencil: &'a dyn Pencil, first: &dyn Shifted, progress: &'a mut dyn FnMut(usize, usize)) -> Self {
        Self {
            pencil,
            progress,
            count: None,
            base: first.below(),
            reference: first.sigma(),
            shift: first.sigma(),
            lambda: Vec::new(),
            vectors: Vec::new(),
            beyond: 0,
            exhausted: false,
            restarts: 0,
            solves: 0,
        }
    }

    /// Pairs that are missing below the shift `shifted`.
    fn missing(&self, shifted: &dyn Shifted) -> Result<usize> {
        let found = self.lambda.iter().filter(|l| **l < shifted.sigma()).count();
        let there = shifted.below().saturating_sub(self.base) as usize;
        if shifted.below() < self.base || there < found {
            return Err(Error::NotConverged(format!(
                "{found} eigenvalues were found between {:e} and {:e}, but by the inertia of the shifted \
                 matrices there are only {there}",
                self.reference,
                shifted.sigma()
            )));
        }
        Ok(there - found)
    }

    /// Collective: finds what is missing below the shift, and `ahead` pairs above it as far as there are so many.
    fn visit(&mut self, shifted: &mut dyn Shifted, ahead: usize) -> Result<()> {
        let (n, sigma) = (self.pencil.n_local(), shifted.sigma());
        let missing = self.missing(shifted)?;
        let above = (self.pencil.order() - shifted.below()) as usize;
        let ahead = ahead.min(above);
        if missing + ahead > 0 {
            let known = self.pencil.known_vectors();
            let before = self.lambda.len() - self.beyond;
            // Beside what was found beyond the last shift what was known at the start, which is mostly nothing.
            let both: Vec<f64> = match known.ncols() {
                0 => Vec::new(),
                _ => known.col_iter().flat_map(|c| c.iter()).chain(&self.vectors[self.beyond * n..]).copied().collect(),
            };
            let deflated = match known.ncols() {
                0 => columns(&self.vectors[self.beyond * n..], n, before),
                more => columns(&both, n, more + before),
            };
            let (done, count, progress) = (self.lambda.len(), self.count, &mut *self.progress);
            let mut told = |converged: usize, _: usize| match count {
                Some(count) => progress((done + converged).min(count), count),
                // How many there are below the limit is not known.
                None => progress(done + converged, 0),
            };
            let goal = Goal::Sides(missing, ahead);
            let sizes = shifted.sizes(missing + ahead);
            let found = lanczos::run(self.pencil, shifted, deflated, goal, sizes, &mut told)?;
            self.restarts += found.restarts;
            self.solves += found.solves;
            let value = |i: usize| sigma + 1.0 / found.theta[i];
            let left: Vec<usize> = (0..found.theta.len()).filter(|&i| found.theta[i] < 0.0).take(missing).collect();
            let within = left.iter().filter(|&&i| value(i) > self.shift).count();
            if within < missing {
                return Err(Error::NotConverged(format!(
                    "{missing} more eigenvalues lie between {:e} and {sigma:e} by the inertia of the shifted \
                     matrices, but {within} were found",
                    self.shift
                )));
            }
            self.add(&left, &found.vectors, value);
            self.beyond = self.lambda.len();
            let right: Vec<usize> = (0..found.theta.len()).filter(|&i| found.theta[i] > 0.0).collect();
            self.add(&right, &found.vectors, value);
        } else {
            self.beyond = self.lambda.len();
        }
        self.exhausted = self.lambda.len() - self.beyond >= above;
        self.shift = sigma;
        Ok(())
    }

    fn add(&mut self, which: &[usize], vectors: &[f64], value: impl Fn(usize) -> f64) {
        let n = self.pencil.n_local();
        for &i in which {
            self.lambda.push(value(i));
            self.vectors.extend_from_slice(&vectors[i * n..(i + 1) * n]);
        }
    }

    /// Collective: from shift to shift until all that is wanted is known to be there.
    fn walk(&mut self, moving: &mut dyn MovableShift, until: Until) -> Result<()> {
        loop {
            let over = match until {
                Until::Count(count) => self.beyond >= count || self.exhausted,
                Until::End(to) => self.shift >= to || self.exhausted,
            };
            if over {
                return Ok(());
            }
            let (reach, mut sigma, mut ends) = self.next(until);
            loop {
                match ends {
                    true => aside(moving, sigma, sigma - self.reference, &BARELY)?,
                    false => aside(moving, sigma, sigma - reach, &ASIDE)?,
                }
                let missing = self.missing(moving)?;
                // Denser than it seemed.
                let nearer = reach + (sigma - reach) * (PAIRS / 2) as f64 / missing.max(1) as f64;
                if missing <= TOO_MANY || nearer <= reach {
                    break;
                }
                (sigma, ends) = (nearer, false);
            }
            let ahead = match until {
                Until::Count(count) => match (count + self.base as usize).saturating_sub(moving.below() as usize) {
                    0 => 0,
                    rest => (rest + 3).min(PAIRS / 2),
                },
                Until::End(_) if ends => 0,
                Until::End(_) => PAIRS / 2,
            };
            self.visit(moving, ahead)?;
        }
    }

    /// How far pairs are known, the next shift, which is beyond that, and whether it is the end.
    fn next(&self, until: Until) -> (f64, f64, bool) {
        let mut right = self.lambda[self.beyond..].to_vec();
        right.sort_by(f64::total_cmp);
        let reach = right.last().copied().unwrap_or(self.shift);
        let half = right.len() / 2;
        // Spacing of the upper half of what was found, or of all of it where that is one cluster.
        let spacing = match right.get(half) {
            Some(middle) if right.len() > 2 && reach > *middle => (reach - middle) / (right.len() - 1 - half) as f64,
            _ => (reach - self.shift) / right.len().max(1) as f64,
        };
        let spacing = if spacing > 0.0 { spacing } else { 1e-3 * (reach - self.reference).abs() };
        match until {
            Until::Count(count) => {
                let rest = count.saturating_sub(self.lambda.len());
                let ahead = if rest <= PAIRS * 5 / 8 { rest + (rest / 8).max(3) } else { PAIRS / 2 };
                (reach, reach + ahead as f64 * spacing, false)
            }
            Until::End(to) => match reach + (PAIRS * 5 / 8) as f64 * spacing >= to {
                true => (reach, to, true),
                false => (reach, reach + (PAIRS / 2) as f64 * spacing, false),
            },
        }
    }

    /// Collective: what is known to be complete, up to `end`.
    fn modes(self, end: f64) -> Result<FoundModes> {
        let n = self.pencil.n_local();
        let end = if self.exhausted { end } else { end.min(self.shift) };
        let kept: Vec<usize> = (0..self.lambda.len()).filter(|&i| self.lambda[i] < end).collect();
        let mut vectors = self.vectors;
        for (place, &i) in kept.iter().enumerate() {
            vectors.copy_within(i * n..(i + 1) * n, place * n);
        }
        vectors.truncate(kept.len() * n);
        let lambda: Vec<f64> = kept.iter().map(|&i| self.lambda[i]).collect();
        let mut modes = checked(self.pencil, self.reference, &lambda, vectors)?;
        (modes.iterations, modes.solves) = (self.restarts, self.solves);
        Ok(modes)
    }
}
