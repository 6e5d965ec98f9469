//! Distributions by their quantile functions, and the normal distribution.

use std::f64::consts::{PI, SQRT_2};

/// The standard normal distribution function.
pub fn normal_cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x / SQRT_2)
}

/// Its quantile at 0 < `p` < 1: the approximation 26.2.23 of M. Abramowitz, I. A. Stegun, Handbook of Mathematical
/// Functions (1964), improved by Halley's method.
pub fn normal_quantile(p: f64) -> f64 {
    let tail = p.min(1.0 - p);
    let t = (-2.0 * tail.ln()).sqrt();
    let start = t - ((0.010328 * t + 0.802853) * t + 2.515517) / (((0.001308 * t + 0.189269) * t + 1.432788) * t + 1.0);
    // In the upper tail, where nothing cancels.
    let mut x = start;
    for _ in 0..4 {
        let error = tail - 0.5 * libm::erfc(x / SQRT_2);
        let step = error * (2.0 * PI).sqrt() * (0.5 * x * x).exp();
        x -= step / (1.0 + 0.5 * x * step);
    }
    if p < 0.5 {
        -x
    } else {
        x
    }
}

/// The distribution of an input.
#[derive(Debug, Clone, PartialEq)]
pub enum InputDistribution {
    /// Mean and standard deviation.
    Normal([f64; 2]),
    /// Median and standard deviation of the logarithm.
    Lognormal([f64; 2]),
    /// Lower and upper end.
    Uniform([f64; 2]),
    /// Lower end, most likely value, upper end.
    Triangular([f64; 3]),
    /// Values, rising, each with the probability of a value up to it, which rises from 0 to 1; even between them.
    Table(Vec<[f64; 2]>),
}

impl InputDistribution {
    /// The value that is not exceeded with the probability `p`, 0 < `p` < 1.
    pub fn quantile(&self, p: f64) -> f64 {
        match self {
            Self::Normal([mean, deviation]) => mean + deviation * normal_quantile(p),
            Self::Lognormal([median, deviation]) => median * (deviation * normal_quantile(p)).exp(),
            Self::Uniform([from, to]) => from + (to - from) * p,
            Self::Triangular([from, mode, to]) => {
                let below = (mode - from) / (to - from);
                match p <= below {
                    true => from + (p * (to - from) * (mode - from)).sqrt(),
                    false => to - ((1.0 - p) * (to - from) * (to - mode)).sqrt(),
                }
            }
            Self::Table(rows) => {
                let after = rows.partition_point(|r| r[1] < p).clamp(1, rows.len() - 1);
                let ([x0, p0], [x1, p1]) = (rows[after - 1], rows[after]);
                x0 + (x1 - x0) * ((p - p0) / (p1 - p0)).clamp(0.0, 1.0)
            }
        }
    }

    /// The probability of a value up to `x`.
    pub(crate) fn cdf(&self, x: f64) -> f64 {
        match self {
            Self::Normal([mean, deviation]) => normal_cdf((x - mean) / deviation),
            Self::Lognormal([median, deviation]) => match x > 0.0 {
                true => normal_cdf((x / median).ln() / deviation),
                false => 0.0,
            },
            Self::Uniform([from, to]) => ((x - from) / (to - from)).clamp(0.0, 1.0),
            Self::Triangular([from, mode, to]) => match x {
                x if x <= *from => 0.0,
                x if x >= *to => 1.0,
                x if x <= *mode => (x - from).powi(2) / ((to - from) * (mode - from)),
                x => 1.0 - (to - x).powi(2) / ((to - from) * (to - mode)),
            },
            Self::Table(rows) => {
                let after = rows.partition_point(|r| r[0] < x);
                match (after.checked_sub(1).map(|i| rows[i]), rows.get(after)) {
                    (None, _) => 0.0,
                    (_, None) => 1.0,
                    (Some([x0, p0]), Some([x1, p1])) => p0 + (p1 - p0) * (x - x0) / (x1 - x0),
                }
            }
        }
    }

    /// Fault of its numbers, if there is one.
    pub fn fault(&self) -> Option<String> {
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        match self {
            Self::Normal(n) if !finite(n) || n[1] <= 0.0 => {
                Some(format!("found a deviation of {}, expected one above 0", n[1]))
            }
            Self::Lognormal(n) if !finite(n) || n[0] <= 0.0 || n[1] <= 0.0 => {
                Some(format!("found a median of {} and a log_deviation of {}, expected both above 0", n[0], n[1]))
            }
            Self::Uniform([from, to]) if !finite(&[*from, *to]) || from >= to => {
                Some(format!("found the ends {from} and {to}, expected from < to"))
            }
            Self::Triangular([from, mode, to])
                if !finite(&[*from, *mode, *to]) || from >= to || mode < from || mode > to =>
            {
                Some(format!("found {from}, {mode} and {to}, expected from <= mode <= to and from < to"))
            }
            Self::Table(rows) => {
                let ends = [rows.first(), rows.last()].map(|r| r.map(|r| r[1]));
                if rows.len() < 2 || ends != [Some(0.0), Some(1.0)] {
                    return Some(
                        "expected two and more rows [value, probability of a value up to it], the probability \
                         rising from 0 to 1"
                            .into(),
                    );
                }
                let row = rows.windows(2).position(|w| !(w[1][0] > w[0][0] && w[1][1] > w[0][1]))?;
                Some(format!("found {:?} after {:?}, expected both numbers to rise", rows[row + 1], rows[row]))
            }
            _ => None,
        }
    }
}

/// A distribution cut off at both ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Truncated {
    distribution: InputDistribution,
    /// Probabilities of the distribution below the lower and up to the upper end.
    range: [f64; 2],
    ends: [f64; 2],
}

impl Truncated {
    /// `distribution` between the `ends`, which may be infinite; what is wrong with them.
    pub fn new(distribution: InputDistribution, ends: [f64; 2]) -> Result<Self, String> {
        let range = ends.map(|x| match x.is_infinite() {
            true => f64::from(u8::from(x > 0.0)),
            false => distribution.cdf(x),
        });
        match range[1] - range[0] > 1e-6 {
            true => Ok(Self { distribution, range, ends }),
            false => Err(format!(
                "found the ends {} and {}, between which the distribution has the probability {:.1e}; expected more \
                 than 1e-6",
                ends[0],
                ends[1],
                (range[1] - range[0]).max(0.0)
            )),
        }
    }

    /// The value that is not exceeded with the probability `p`, 0 < `p` < 1.
    pub fn quantile(&self, p: f64) -> f64 {
        let [low, high] = self.range;
        let p = (low + p * (high - low)).clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0);
        self.distribution.quantile(p).clamp(self.ends[0], self.ends[1])
    }
}

/// Lower triangle of Cholesky's factor of the matrix `a` by rows; none of one that is not positive definite.
pub fn cholesky(a: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = a.len();
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = a[i][j] - sum;
            l[i][j] = match i == j {
                true if rest > 1e-12 => rest.sqrt(),
                true => return None,
                false => rest / l[j][j],
            };
        }
    }
    Some(l)
}

/// Probabilities with normal dependence (Gaussian copula) from independent ones: `factor` is Cholesky's of the
/// correlations of the normal variables.
pub fn correlated(factor: &[Vec<f64>], independent: &[f64]) -> Vec<f64> {
    let z: Vec<f64> = independent.iter().map(|p| normal_quantile(*p)).collect();
    let inside = |p: f64| p.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0);
    factor.iter().map(|row| inside(normal_cdf(row.iter().zip(&z).map(|(l, z)| l * z).sum()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of the normal distribution as tables have them.
    #[test]
    fn the_normal_distribution() {
        for (p, x) in [(0.5, 0.0), (0.975, 1.959963984540054), (0.999, 3.090232306167813), (1e-10, -6.361340902404056)]
        {
            assert!((normal_quantile(p) - x).abs() < 1e-12, "{p}: {}", normal_quantile(p));
        }
        for p in [1e-300, 1e-20, 1e-5, 0.3, 0.49999, 0.7, 0.999999] {
            assert!((normal_cdf(normal_quantile(p)) / p - 1.0).abs() < 1e-10, "{p}");
        }
    }

    fn all() -> [InputDistribution; 5] {
        [
            InputDistribution::Normal([0.35, 0.1]),
            InputDistribution::Lognormal([2e-4, 0.5]),
            InputDistribution::Uniform([-3.0, 5.0]),
            InputDistribution::Triangular([-1.0, 0.5, 4.0]),
            InputDistribution::Table(vec![[0.0, 0.0], [1.0, 0.25], [1.5, 0.9], [4.0, 1.0]]),
        ]
    }

    /// Quantiles of OpenTURNS, to its twelve digits (docs/data/uncertainty_openturns.py).
    #[test]
    fn quantiles_are_those_of_openturns() {
        let anywhere = [f64::NEG_INFINITY, f64::INFINITY];
        let cases = [
            ("normal", InputDistribution::Normal([0.3, 0.05]), anywhere),
            ("truncated_normal", InputDistribution::Normal([-0.006, 0.002]), [-0.008, -0.001]),
            ("lognormal", InputDistribution::Lognormal([2e-4, 0.5]), anywhere),
            ("uniform", InputDistribution::Uniform([0.2, 0.45]), anywhere),
            ("triangular", InputDistribution::Triangular([0.05, 0.2, 0.45]), anywhere),
        ];
        let mut compared = 0;
        for (name, distribution, ends) in cases {
            let truncated = Truncated::new(distribution, ends).unwrap();
            for line in include_str!("../../docs/data/uncertainty_openturns.csv").lines() {
                let cells: Vec<&str> = line.split(',').collect();
                if cells[0] == name {
                    let (p, want): (f64, f64) = (cells[1].parse().unwrap(), cells[3].parse().unwrap());
                    let found = truncated.quantile(p);
                    assert!((found / want - 1.0).abs() < 1e-10, "{name} at {p}: {found} and {want}");
                    compared += 1;
                }
            }
        }
        assert_eq!(compared, 25);
    }

    #[test]
    fn quantiles_invert_the_distribution_functions() {
        for d in all() {
            assert_eq!(d.fault(), None);
            for p in [1e-6, 0.1, 0.2, 0.25, 0.5, 0.8, 0.95, 1.0 - 1e-9] {
                assert!((d.cdf(d.quantile(p)) - p).abs() < 1e-12, "{d:?} at {p}");
            }
        }
    }

    /// Means and standard deviations in closed form, by the midpoint rule in the probability.
    #[test]
    fn moments_are_those_of_the_distributions() {
        let n = 2_000_000;
        let moments = |d: &InputDistribution| {
            let x = |i: usize| d.quantile((i as f64 + 0.5) / n as f64);
            let mean = (0..n).map(x).sum::<f64>() / n as f64;
            (mean, ((0..n).map(|i| (x(i) - mean).powi(2)).sum::<f64>() / n as f64).sqrt())
        };
        let [normal, lognormal, uniform, triangular, table] = all();
        let s = 0.25f64;
        let [a, c, b] = [-1.0f64, 0.5, 4.0];
        let spread = (a * a + b * b + c * c - a * b - a * c - b * c) / 18.0;
        for (d, want) in [
            (normal, (0.35, 0.1)),
            (lognormal, (2e-4 * (s / 2.0).exp(), 2e-4 * (s / 2.0).exp() * (s.exp() - 1.0).sqrt())),
            (uniform, (1.0, 8.0 / 12f64.sqrt())),
            (triangular, ((a + b + c) / 3.0, spread.sqrt())),
        ] {
            let (mean, deviation) = moments(&d);
            assert!((mean / want.0 - 1.0).abs() < 1e-4 && (deviation / want.1 - 1.0).abs() < 1e-4, "{d:?}");
        }
        assert!((moments(&table).0 - (0.25 * 0.5 + 0.65 * 1.25 + 0.1 * 2.75)).abs() < 1e-6);
    }

    #[test]
    fn a_truncated_distribution_keeps_its_shape_inside() {
        let d = Truncated::new(InputDistribution::Normal([0.0, 1.0]), [0.0, f64::INFINITY]).unwrap();
        // Half a normal distribution: its median is the upper quartile of the whole one.
        assert!((d.quantile(0.5) - 0.6744897501960817).abs() < 1e-12);
        assert!(d.quantile(1e-12) >= 0.0 && d.quantile(1.0 - 1e-15).is_finite());
        let fault = Truncated::new(InputDistribution::Uniform([0.0, 1.0]), [2.0, 3.0]).unwrap_err();
        assert!(fault.contains("probability 0.0e0"), "{fault}");
    }

    #[test]
    fn faults_of_numbers_are_told() {
        for d in [
            InputDistribution::Normal([0.0, 0.0]),
            InputDistribution::Lognormal([-1.0, 0.3]),
            InputDistribution::Uniform([1.0, 1.0]),
            InputDistribution::Triangular([0.0, 2.0, 1.0]),
            InputDistribution::Table(vec![[0.0, 0.0], [1.0, 0.5]]),
            InputDistribution::Table(vec![[0.0, 0.0], [1.0, 0.5], [0.5, 1.0]]),
        ] {
            assert!(d.fault().is_some(), "{d:?}");
        }
    }

    /// The rank correlation of a Gaussian copula is 6/π asin(ρ/2).
    #[test]
    fn a_gaussian_copula_has_its_rank_correlation() {
        let rho = 0.7;
        let factor = cholesky(&[vec![1.0, rho], vec![rho, 1.0]]).unwrap();
        let points = super::super::cube::scrambled_sobol(2, 1 << 14, 1, 5);
        let pairs: Vec<Vec<f64>> = points.iter().map(|p| correlated(&factor, p)).collect();
        let mean = pairs.iter().map(|p| (p[0] - 0.5) * (p[1] - 0.5)).sum::<f64>() / pairs.len() as f64;
        let want = 6.0 / PI * (rho / 2.0).asin();
        assert!((12.0 * mean - want).abs() < 2e-3, "{} and {want}", 12.0 * mean);
        assert!(cholesky(&[vec![1.0, 1.2], vec![1.2, 1.0]]).is_none());
    }
}
