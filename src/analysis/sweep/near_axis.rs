//! Modes of a study that may become unstable: only these are continued from sample to sample.
//!
//! A linear function of the inputs is fitted to the growth rates of each followed mode at the base points. The
//! mode is near the axis where the largest value of this function at the samples, plus a multiple of its largest
//! residual, is not negative. Where the base points are too few for a fit, the largest growth rate and the range of the
//! growth rates stand for both. The same holds of the least stable motion of each base point that is like no followed
//! mode. What becomes unstable beyond this is found by the counts ([`counts`](super::counts)).

use crate::output::datasets::sweep::Followed;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use num_complex::Complex;

type C = Complex<f64>;

/// Base points from which on their growth rates tell a range.
const LEAST: usize = 4;
/// Base points that a fit has beside its coefficients.
const BESIDE: usize = 4;
/// Largest residuals, scaled to as many base points as there are beside the coefficients, by which the growth rates of
/// samples may go beyond the fit.
const RESIDUALS: f64 = 2.0;
/// Part of the inputs' variance that is nothing.
const NOTHING: f64 = 1e-9;
/// Part of the range by which the growth rates of samples may go beyond those of the base points.
const REACH: f64 = 1.0;

/// An eigenvalue of a base point.
#[derive(Debug, Clone)]
pub(super) struct BaseEigenvalue {
    /// 1/s.
    pub value: C,
    /// Numbers of the modes that it may be, by its shape.
    pub may_be: Vec<usize>,
    /// True if it is no more damped than the most damped mode that is followed.
    pub is_little_damped: bool,
}

/// The modes that are continued, and other motions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NearAxis {
    /// Numbers of the modes, ascending.
    pub modes: Vec<usize>,
    /// Largest range of growth rates by which a motion that is like none of the followed modes may become unstable,
    /// 1/s; none where no such motion does.
    pub others: Option<f64>,
}

/// Motions of a base point.
#[derive(Clone, Copy)]
pub(super) struct BaseMotions<'a> {
    /// Modes that are followed.
    pub followed: &'a [Followed],
    /// All that oscillate.
    pub candidates: &'a [BaseEigenvalue],
}

/// Inputs that growth rates are fitted to.
pub(super) struct FitInputs<'a> {
    /// Inputs over their deviations at the base points, `[bases][inputs]`.
    pub bases: Vec<&'a [f64]>,
    /// The same at the samples, `[samples][inputs]`.
    pub samples: Vec<&'a [f64]>,
}

impl FitInputs<'_> {
    /// Largest growth rate at the samples by a fit to those of some base points, each with its number; none where these
    /// are too few.
    fn highest(&self, rates: &[(usize, f64)]) -> Option<f64> {
        let d = self.samples.first()?.len();
        let n = rates.len();
        if n < d + 1 + BESIDE {
            return None;
        }
        let entry = |row: &[f64], j: usize| if j == 0 { 1.0 } else { row[j - 1] };
        let a = Mat::from_fn(n, d + 1, |i, j| entry(self.bases[rates[i].0], j));
        let mut normal = a.transpose() * &a;
        // An input that does not vary on this model has no coefficient.
        (0..=d).for_each(|j| normal[(j, j)] += NOTHING * n as f64);
        let right = a.transpose() * Mat::from_fn(n, 1, |i, _| rates[i].1);
        let fit = normal.llt(Side::Lower).ok()?.solve(right);
        let value = |row: &[f64]| (0..=d).map(|j| fit[(j, 0)] * entry(row, j)).sum::<f64>();
        let residual = rates.iter().map(|&(b, rate)| (rate - value(self.bases[b])).abs()).fold(0.0, f64::max);
        let residual = residual * (n as f64 / (n - d - 1) as f64).sqrt();
        let largest = self.samples.iter().map(|row| value(row)).fold(f64::NEG_INFINITY, f64::max);
        Some(largest + RESIDUALS * residual)
    }
}

impl NearAxis {
    /// The modes near the axis by what is found at the base points, and those that are `told` of in any case; none
    /// where the base points are too few to tell.
    pub fn new(found: &[BaseMotions], told: &[usize], inputs: &FitInputs) -> Option<Self> {
        if found.len() < LEAST {
            return None;
        }
        let mut rates: Vec<Vec<(usize, f64)>> = Vec::new();
        for (b, f) in found.iter().enumerate().flat_map(|(b, of)| of.followed.iter().map(move |f| (b, f))) {
            let Some(r) = f.mode else { continue };
            rates.resize_with(rates.len().max(r + 1), Vec::new);
            rates[r].push((b, f.value.re));
        }
        let ends = |rates: &[(usize, f64)]| -> [f64; 2] {
            let all = || rates.iter().map(|rate| rate.1);
            [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)]
        };
        let near = |rates: &[(usize, f64)]| {
            let [low, high] = ends(rates);
            let by_range = high + REACH * (high - low);
            high >= 0.0 || inputs.highest(rates).unwrap_or(by_range) >= 0.0
        };
        let mut modes: Vec<usize> = (0..rates.len()).filter(|&r| !rates[r].is_empty() && near(&rates[r])).collect();
        // The least stable motion that is like none of them.
        let other = |(b, of): (usize, &BaseMotions)| {
            let all = of.candidates.iter().filter(|c| c.may_be.is_empty()).map(|c| c.value.re);
            all.reduce(f64::max).map(|rate| (b, rate))
        };
        let others: Vec<(usize, f64)> = found.iter().enumerate().filter_map(other).collect();
        let all = modes.iter().map(|&r| &rates[r]).chain([&others]);
        let range = all.map(|rates| ends(rates)).map(|[low, high]| high - low).fold(0.0, f64::max);
        let others = (!others.is_empty() && near(&others)).then_some(range);
        modes.extend(told);
        modes.sort_unstable();
        modes.dedup();
        Some(Self { modes, others })
    }

    /// True if a mode is one of these.
    pub fn has(&self, mode: usize) -> bool {
        self.modes.binary_search(&mode).is_ok()
    }

    /// True if an eigenvalue of a base point is continued: one that is unstable there; one that may be one of the
    /// modes; or one that is like no mode that is followed, and may become unstable.
    pub fn wants(&self, candidate: &BaseEigenvalue) -> bool {
        if candidate.value.re >= 0.0 {
            return true;
        }
        let may_grow = self.others.is_some_and(|range| candidate.value.re + REACH * range >= 0.0);
        candidate.may_be.iter().any(|r| self.has(*r)) || (candidate.may_be.is_empty() && may_grow)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(rates: &[f64]) -> Vec<Followed> {
        let one = |(r, re): (usize, &f64)| Followed { mode: Some(r), value: C::new(*re, 1e3), agreement: 1.0 };
        let other = Followed { mode: None, value: C::new(9.0, 1e3), agreement: 0.0 };
        rates.iter().enumerate().map(one).chain([other]).collect()
    }

    /// Few base points: a mode that comes as near to the axis as its growth rate varies is taken, one that varies less
    /// is not; so is an eigenvalue that is like none of the modes, where the least stable of these varies that much.
    /// Still fewer base points tell of none.
    #[test]
    fn modes_are_near_the_axis_by_their_range() {
        let rates = |x: f64| list(&[-1.0 + 0.5 * x, -8.0 + 2.0 * x, -3.0 + 0.1 * x, -900.0]);
        let all: Vec<Vec<Followed>> = (0..4).map(|k| rates(f64::from(k))).collect();
        let candidate = |re: f64, may_be: &[usize]| BaseEigenvalue {
            value: C::new(re, 1e3),
            may_be: may_be.to_vec(),
            is_little_damped: false,
        };
        let places: Vec<[f64; 1]> = (0..4).map(|k| [f64::from(k)]).collect();
        let rows = || places.iter().map(|p| &p[..]).collect::<Vec<_>>();
        let inputs = FitInputs { bases: rows(), samples: rows() };
        // What is like no mode varies from −4 to −4 + 3 `by` 1/s.
        let near = |by: f64, count: usize| {
            let others = |k: usize| [candidate(-4.0 + by * k as f64, &[]), candidate(-0.1, &[2])];
            let others: Vec<_> = (0..4).map(others).collect();
            let found = all.iter().zip(&others).map(|(followed, candidates)| BaseMotions { followed, candidates });
            NearAxis::new(&found.take(count).collect::<Vec<_>>(), &[3], &inputs)
        };
        let grow = near(1.0, 4).unwrap();
        assert_eq!(grow, NearAxis { modes: vec![0, 1, 3], others: Some(6.0) });
        assert!(near(1.0, 3).is_none());
        assert!(grow.wants(&candidate(-50.0, &[2, 1])) && grow.wants(&candidate(-5.9, &[])));
        assert!(!grow.wants(&candidate(-50.0, &[2])) && !grow.wants(&candidate(-6.1, &[])));
        assert!(!grow.wants(&candidate(-5.9, &[2])) && grow.wants(&candidate(0.1, &[2])));
        let stay = near(0.5, 4).unwrap();
        assert_eq!(stay, NearAxis { modes: vec![0, 1, 3], others: None });
        assert!(!stay.wants(&candidate(-1.0, &[])));
    }

    /// With more base points a fit tells: a mode that damping alone moves stays damped however far it moves, one that
    /// grows with an input is near where this input goes beyond the base points, as is one that is bent.
    #[test]
    fn modes_are_near_the_axis_by_a_fit() {
        let second = [3, 9, 0, 6, 11, 2, 8, 5, 1, 10, 4, 7];
        let at = |k: usize| [((k * 7) % 12) as f64 / 4.0 - 1.4, f64::from(second[k]) / 4.0 - 1.4];
        let rates = |[x, y]: [f64; 2]| list(&[-3.0 - 1.5 * x, -3.0 + y, -4.0 + 0.5 * y + 1.6 * x * x, -4.0 + 0.1 * y]);
        let (places, ends) = ((0..12).map(at).collect::<Vec<_>>(), [[-1.5, 0.0], [1.5, 3.5]]);
        let all: Vec<Vec<Followed>> = places.iter().map(|p| rates(*p)).collect();
        let lists: Vec<_> = all.iter().map(|followed| BaseMotions { followed, candidates: &[] }).collect();
        let bases = places.iter().map(|p| &p[..]).collect();
        let inputs = FitInputs { bases, samples: ends.iter().map(|p| &p[..]).collect() };
        assert_eq!(NearAxis::new(&lists, &[], &inputs).unwrap().modes, [1, 2]);
    }
}
