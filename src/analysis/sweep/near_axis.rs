//! Modes of a study that may become unstable, or are the least stable where nothing grows: only these are continued
//! from sample to sample.
//!
//! A linear function of the inputs is fitted to the growth rates of each followed mode at the base points. The
//! mode is near the axis where the largest value of this function at the samples, plus a multiple of its largest
//! residual, is not negative. Where the base points are too few for a fit, the largest growth rate and the range of the
//! growth rates stand for both. The same holds of the least stable motion of each base point that is like no followed
//! mode. What becomes unstable beyond this is found by the counts ([`counts`](super::counts)).
//!
//! The largest growth rate of a sample that is stable is that of a mode which *leads*: one whose growth rate is the
//! largest at a base point, or whose fitted function is the largest at a sample. Where a motion leads at a base point
//! that is none of the followed modes, all modes that it may be are continued, and if there is none of these all such
//! motions that come as near to it as the growth rates vary.

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
    /// Distance from the axis, 1/s, up to which motions that are like none of the followed modes are continued; none
    /// where no such motion may become unstable or leads.
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

/// Linear function of the inputs.
struct RateFit {
    /// Constant and derivatives by the scaled inputs, 1/s, `[1 + inputs]`.
    coefficients: Vec<f64>,
    /// Growth rates may go beyond the function by this, 1/s.
    margin: f64,
}

impl RateFit {
    /// Value at scaled inputs, 1/s.
    fn at(&self, row: &[f64]) -> f64 {
        let (constant, slopes) = self.coefficients.split_first().unwrap_or((&0.0, &[]));
        constant + slopes.iter().zip(row).map(|(c, x)| c * x).sum::<f64>()
    }
}

impl FitInputs<'_> {
    /// Fit to growth rates at some base points, each with its number; none where these are too few.
    fn fit(&self, rates: &[(usize, f64)]) -> Option<RateFit> {
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
        let solution = normal.llt(Side::Lower).ok()?.solve(right);
        let mut fit = RateFit { coefficients: (0..=d).map(|j| solution[(j, 0)]).collect(), margin: 0.0 };
        let residual = rates.iter().map(|&(b, rate)| (rate - fit.at(self.bases[b])).abs()).fold(0.0, f64::max);
        fit.margin = RESIDUALS * residual * (n as f64 / (n - d - 1) as f64).sqrt();
        Some(fit)
    }

    /// Largest growth rate at the samples by a fit.
    fn highest(&self, fit: &RateFit) -> f64 {
        self.samples.iter().map(|row| fit.at(row)).fold(f64::NEG_INFINITY, f64::max) + fit.margin
    }

    /// Numbers of the modes that lead at samples by the `fits` of those modes that have one.
    fn leading(&self, fits: &[Option<RateFit>]) -> Vec<usize> {
        let leader = |row: &&[f64]| {
            let rates = fits.iter().enumerate().filter_map(|(r, fit)| Some((r, fit.as_ref()?.at(row))));
            rates.max_by(|a, b| a.1.total_cmp(&b.1)).map(|found| found.0)
        };
        let mut all: Vec<usize> = self.samples.iter().filter_map(leader).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

impl BaseMotions<'_> {
    /// The least stable motion: its growth rate, 1/s, and the numbers of the modes that it may be.
    fn leader(&self) -> Option<(f64, Vec<usize>)> {
        let largest = |a: &(f64, Vec<usize>), b: &(f64, Vec<usize>)| a.0.total_cmp(&b.0);
        let candidates = self.candidates.iter().map(|c| (c.value.re, c.may_be.clone()));
        let followed = self.followed.iter().filter_map(|f| Some((f.value.re, vec![f.mode?])));
        // Of the same motion, which is in both, the mode that it is.
        candidates.chain(followed).max_by(largest)
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
        let near = |rates: &[(usize, f64)], fit: Option<&RateFit>| {
            let [low, high] = ends(rates);
            let by_range = high + REACH * (high - low);
            high >= 0.0 || fit.map_or(by_range, |fit| inputs.highest(fit)) >= 0.0
        };
        let fits: Vec<Option<RateFit>> = rates.iter().map(|rates| inputs.fit(rates)).collect();
        let is_near = |r: &usize| !rates[*r].is_empty() && near(&rates[*r], fits[*r].as_ref());
        let mut modes: Vec<usize> = (0..rates.len()).filter(is_near).collect();
        // The least stable motion that is like none of them.
        let other = |(b, of): (usize, &BaseMotions)| {
            let all = of.candidates.iter().filter(|c| c.may_be.is_empty()).map(|c| c.value.re);
            all.reduce(f64::max).map(|rate| (b, rate))
        };
        let others: Vec<(usize, f64)> = found.iter().enumerate().filter_map(other).collect();
        let all = modes.iter().map(|&r| &rates[r]).chain([&others]);
        let range = all.map(|rates| ends(rates)).map(|[low, high]| high - low).fold(0.0, f64::max);
        let mut others = (!others.is_empty() && near(&others, inputs.fit(&others).as_ref())).then_some(REACH * range);
        modes.extend(told.iter().copied().chain(inputs.leading(&fits)));
        for (rate, may_be) in found.iter().filter_map(BaseMotions::leader) {
            if may_be.is_empty() && rate < 0.0 {
                others = Some(others.unwrap_or(0.0).max(REACH * range - rate));
            }
            modes.extend(may_be);
        }
        modes.sort_unstable();
        modes.dedup();
        Some(Self { modes, others })
    }

    /// True if a mode is one of these.
    pub fn has(&self, mode: usize) -> bool {
        self.modes.binary_search(&mode).is_ok()
    }

    /// True if an eigenvalue of a base point is continued: one that is unstable there; one that may be one of the
    /// modes; or one that is like no mode that is followed, and may become unstable or lead.
    pub fn wants(&self, candidate: &BaseEigenvalue) -> bool {
        if candidate.value.re >= 0.0 {
            return true;
        }
        let is_near = self.others.is_some_and(|distance| candidate.value.re + distance >= 0.0);
        candidate.may_be.iter().any(|r| self.has(*r)) || (candidate.may_be.is_empty() && is_near)
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

    fn candidate(re: f64, may_be: &[usize]) -> BaseEigenvalue {
        BaseEigenvalue { value: C::new(re, 1e3), may_be: may_be.to_vec(), is_little_damped: false }
    }

    /// Few base points: a mode that comes as near to the axis as its growth rate varies is taken, one that varies less
    /// is not; so is an eigenvalue that is like none of the modes, where the least stable of these varies that much.
    /// Still fewer base points tell of none.
    #[test]
    fn modes_are_near_the_axis_by_their_range() {
        let rates = |x: f64| list(&[-1.0 + 0.5 * x, -8.0 + 2.0 * x, -3.0 + 0.1 * x, -900.0]);
        let all: Vec<Vec<Followed>> = (0..4).map(|k| rates(f64::from(k))).collect();
        let places: Vec<[f64; 1]> = (0..4).map(|k| [f64::from(k)]).collect();
        let rows = || places.iter().map(|p| &p[..]).collect::<Vec<_>>();
        let inputs = FitInputs { bases: rows(), samples: rows() };
        // What is like no mode varies from −4 to −4 + 3 `by` 1/s.
        let near = |by: f64, count: usize| {
            let others = |k: usize| [candidate(-4.0 + by * k as f64, &[]), candidate(-1.5, &[2])];
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

    /// The modes by growth rates that are a function of two inputs, at twelve base points and two samples.
    fn modes_of(rates: impl Fn([f64; 2]) -> Vec<Followed>) -> Vec<usize> {
        let second = [3, 9, 0, 6, 11, 2, 8, 5, 1, 10, 4, 7];
        let at = |k: usize| [((k * 7) % 12) as f64 / 4.0 - 1.4, f64::from(second[k]) / 4.0 - 1.4];
        let (places, ends) = ((0..12).map(at).collect::<Vec<_>>(), [[-1.5, 0.0], [1.5, 3.5]]);
        let all: Vec<Vec<Followed>> = places.iter().map(|p| rates(*p)).collect();
        let lists: Vec<_> = all.iter().map(|followed| BaseMotions { followed, candidates: &[] }).collect();
        let bases = places.iter().map(|p| &p[..]).collect();
        let inputs = FitInputs { bases, samples: ends.iter().map(|p| &p[..]).collect() };
        NearAxis::new(&lists, &[], &inputs).unwrap().modes
    }

    /// With more base points a fit tells: a mode that damping alone moves stays damped however far it moves, one that
    /// grows with an input is near where this input goes beyond the base points, as is one that is bent.
    #[test]
    fn modes_are_near_the_axis_by_a_fit() {
        let rates = |[x, y]: [f64; 2]| [-6.0 - 1.5 * x, -3.0 + y, -4.0 + 0.5 * y + 1.6 * x * x, -7.0 + 0.1 * y];
        assert_eq!(modes_of(|at| list(&rates(at))), [1, 2]);
    }

    /// Modes that all stay damped are taken where they are the least stable ones somewhere: at a base point, or by the
    /// fit at a sample alone.
    #[test]
    fn modes_that_lead_are_taken_where_nothing_grows() {
        let rates = |[x, y]: [f64; 2]| [-3.0 + 0.2 * x, -3.5 - y, -5.0 + y, -9.0 + 0.3 * y];
        assert_eq!(modes_of(|at| list(&rates(at))), [0, 1, 2]);
    }

    /// A motion that leads and is none of the followed modes has those taken that it may be; one that is like none of
    /// them has all such motions taken that are no more damped.
    #[test]
    fn motions_that_lead_are_taken_where_nothing_grows() {
        let followed = list(&[-3.0, -5.0, -6.0]);
        let candidates = [vec![], vec![candidate(-2.0, &[1])], vec![candidate(-1.0, &[])], vec![candidate(-4.0, &[2])]];
        let found = candidates.each_ref().map(|candidates| BaseMotions { followed: &followed, candidates });
        let places: Vec<[f64; 1]> = (0..4).map(|k| [f64::from(k)]).collect();
        let rows = || places.iter().map(|p| &p[..]).collect::<Vec<_>>();
        let near = NearAxis::new(&found, &[], &FitInputs { bases: rows(), samples: rows() }).unwrap();
        assert_eq!(near, NearAxis { modes: vec![0, 1], others: Some(1.0) });
        assert!(near.wants(&candidate(-1.0, &[])) && !near.wants(&candidate(-1.1, &[])));
    }
}
