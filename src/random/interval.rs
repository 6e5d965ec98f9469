//! Confidence intervals.

use super::distribution::normal_quantile;

/// How an interval was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntervalMethod {
    /// Wilson's score interval of a share.
    Wilson,
    /// Student's t of the means of independent replicates.
    Replicates,
}

/// Wilson's interval of the share of `hits` in `count` independent trials (E. B. Wilson, J. Am. Stat. Assoc. 22
/// (1927) 209–212), with the probability `confidence`.
pub fn wilson(hits: usize, count: usize, confidence: f64) -> [f64; 2] {
    if count == 0 {
        return [0.0, 1.0];
    }
    let (n, p) = (count as f64, hits as f64 / count as f64);
    let z = normal_quantile(0.5 + 0.5 * confidence);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    // At the ends rounding alone is left.
    let low = if hits == 0 { 0.0 } else { (middle - half).max(0.0) };
    let high = if hits == count { 1.0 } else { (middle + half).min(1.0) };
    [low, high]
}

/// The regularised incomplete beta function I_x(a, b), by the continued fraction of Lentz.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return f64::from(u8::from(x >= 1.0));
    }
    let front = (libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let tiny = 1e-300;
    let guard = |v: f64| if v.abs() < tiny { tiny } else { v };
    let mut c = 1.0;
    let mut d = 1.0 / guard(1.0 - (a + b) * x / (a + 1.0));
    let mut h = d;
    for m in 1..500 {
        let m = f64::from(m);
        for numerator in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / guard(1.0 + numerator * d);
            c = guard(1.0 + numerator / c);
            h *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * h / a
}

/// The quantile of Student's t with `freedom` degrees of freedom at 0.5 < `p` < 1.
pub fn student_quantile(p: f64, freedom: f64) -> f64 {
    let upper = |t: f64| 0.5 * incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + t * t));
    let (mut low, mut high) = (0.0, 1.0);
    while upper(high) > 1.0 - p && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        match upper(middle) > 1.0 - p {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

/// Fewest samples on either side of a limit for which the spread of replicates says something.
const FEW: usize = 10;

/// The share of `hits`, its interval and how it was made. With `replicates` above 1 the samples stand one replicate
/// after the other, and replicates are independent of each other; points of one are not. Their spread, which is smaller
/// than that of independent points, gives the interval, unless fewer than ten samples lie on one side: then it may
/// vanish by accident, and Wilson's interval is taken, which is too wide rather than too narrow. Where replicates agree
/// in each hit, one in R of them might still differ by a hit in n: half the width is −ln(1 − confidence) samples at
/// least (the rule of three). A hit that is `None` is of a sample that is not known and left out.
pub fn share(hits: &[Option<bool>], replicates: usize, confidence: f64) -> (f64, [f64; 2], IntervalMethod) {
    let known: Vec<bool> = hits.iter().flatten().copied().collect();
    let yes = known.iter().filter(|h| **h).count();
    let mean = yes as f64 / known.len() as f64;
    let means: Vec<f64> = match replicates > 1 && hits.len().is_multiple_of(replicates) {
        false => Vec::new(),
        true => hits
            .chunks(hits.len() / replicates)
            .map(|part| part.iter().flatten().copied().collect::<Vec<bool>>())
            .filter(|part| !part.is_empty())
            .map(|part| part.iter().filter(|h| **h).count() as f64 / part.len() as f64)
            .collect(),
    };
    if means.len() < 2 || yes.min(known.len() - yes) < FEW {
        return (mean, wilson(yes, known.len(), confidence), IntervalMethod::Wilson);
    }
    let n = means.len() as f64;
    let middle = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - middle).powi(2)).sum::<f64>() / (n - 1.0);
    let spread = student_quantile(0.5 + 0.5 * confidence, n - 1.0) * (variance / n).sqrt();
    let half = spread.max(-(1.0 - confidence).ln() / known.len() as f64);
    (mean, [(mean - half).max(0.0), (mean + half).min(1.0)], IntervalMethod::Replicates)
}

/// The quantile `p` of sorted `values`, straight between neighbours (type 7 of R. J. Hyndman, Y. Fan, The American
/// Statistician 50 (1996) 361–365); NaN of none.
pub fn quantile(values: &[f64], p: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return f64::NAN };
    let at = p * last as f64;
    let below = (at.floor() as usize).min(last);
    values[below] + (at - below as f64) * (values[(below + 1).min(last)] - values[below])
}

#[cfg(test)]
mod tests {
    use super::super::cube::{latin_hypercube, scrambled_sobol};
    use super::super::Stream;
    use super::*;

    /// Wilson's interval of 81 of 263: 0.2553 to 0.3662 (R. G. Newcombe, Stat. Med. 17 (1998) 857–872, Table I), and
    /// of 0 of 20: 0 to 0.1611.
    #[test]
    fn wilson_intervals_of_newcombe() {
        let [low, high] = wilson(81, 263, 0.95);
        assert!((low - 0.2553).abs() < 5e-5 && (high - 0.3662).abs() < 5e-5, "{low} {high}");
        let [low, high] = wilson(0, 20, 0.95);
        assert!(low == 0.0 && (high - 0.1611).abs() < 5e-5, "{low} {high}");
    }

    /// Student's t as tables have it.
    #[test]
    fn student_quantiles() {
        for (p, freedom, want) in [
            (0.975, 1.0, 12.706204736),
            (0.975, 7.0, 2.364624252),
            (0.975, 15.0, 2.131449546),
            (0.95, 30.0, 1.697260887),
        ] {
            assert!((student_quantile(p, freedom) - want).abs() < 1e-8 * want, "{p} {freedom}");
        }
    }

    /// The shares of a limit that is crossed with the probability 0.23 or 0.02 lie in their intervals as often as
    /// they say, over 200 repeats.
    #[test]
    fn intervals_cover_as_often_as_they_say() {
        for limit in [0.23, 0.02] {
            // y = u1 + u2/2 + u1 u3 with its own quantile by a fine sequence.
            let y = |u: &[f64]| u[0] + 0.5 * u[1] + u[0] * u[2];
            let mut fine: Vec<f64> = scrambled_sobol(3, 1 << 17, 1, 99).iter().map(|u| y(u)).collect();
            fine.sort_by(f64::total_cmp);
            let level = quantile(&fine, 1.0 - limit);
            let mut covered = [0; 3];
            for seed in 0..200 {
                let mut stream = Stream::new(seed, 77);
                let random = (0..512).map(|_| (0..3).map(|_| stream.unit()).collect()).collect::<Vec<Vec<f64>>>();
                let sets = [(scrambled_sobol(3, 32, 16, seed), 16), (latin_hypercube(3, 512, seed), 1), (random, 1)];
                for (k, (points, replicates)) in sets.into_iter().enumerate() {
                    let hits: Vec<Option<bool>> = points.iter().map(|u| Some(y(u) > level)).collect();
                    let (_, [low, high], _) = share(&hits, replicates, 0.95);
                    covered[k] += usize::from((low..=high).contains(&limit));
                }
            }
            // 95 % of 200 is 190 ± 3.1; Latin hypercubes are covered more often, since they spread less.
            let [sobol, latin, random] = covered;
            assert!((180..=200).contains(&sobol), "Sobol' {sobol} at {limit}");
            assert!((184..=200).contains(&latin), "hypercube {latin} at {limit}");
            assert!((181..=199).contains(&random), "random {random} at {limit}");
        }
    }

    #[test]
    fn replicates_narrow_the_interval_of_an_even_sequence() {
        let hits: Vec<Option<bool>> = scrambled_sobol(2, 64, 8, 1).iter().map(|u| Some(u[0] + u[1] < 0.6)).collect();
        let (share, [low, high], method) = share(&hits, 8, 0.95);
        assert_eq!(method, IntervalMethod::Replicates);
        assert!(low < 0.18 && 0.18 < high, "{low} {high}");
        let [wide_low, wide_high] = wilson((share * 512.0).round() as usize, 512, 0.95);
        assert!(high - low < 0.6 * (wide_high - wide_low), "{low} {high} in {wide_low} {wide_high}");
    }

    #[test]
    fn what_is_not_known_is_left_out() {
        let hits = [Some(true), None, Some(false), Some(false)];
        let (share, _, method) = share(&hits, 1, 0.95);
        assert!((share - 1.0 / 3.0).abs() < 1e-15 && method == IntervalMethod::Wilson);
        assert!(quantile(&[], 0.5).is_nan());
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.75), 3.0);
    }
}
