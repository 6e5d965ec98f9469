//! Integrals of several functions at once, to a given accuracy.

use crate::{Error, Result};

/// Points of Kronrod on [0, 1], half of [−1, 1], and their weights; each second one, from the first on, is one of
/// Gauss' seven (A. S. Kronrod, 1965; R. Piessens et al., *QUADPACK*, 1983).
const KRONROD: [(f64, f64); 8] = [
    (0.0, 0.209_482_141_084_727_83),
    (0.207_784_955_007_898_47, 0.204_432_940_075_298_9),
    (0.405_845_151_377_397_2, 0.190_350_578_064_785_4),
    (0.586_087_235_467_691_1, 0.169_004_726_639_267_9),
    (0.741_531_185_599_394_4, 0.140_653_259_715_525_92),
    (0.864_864_423_359_769_1, 0.104_790_010_322_250_18),
    (0.949_107_912_342_758_5, 0.063_092_092_629_978_55),
    (0.991_455_371_120_812_6, 0.022_935_322_010_529_224),
];
const GAUSS: [f64; 4] =
    [0.417_959_183_673_469_4, 0.381_830_050_505_118_9, 0.279_705_391_489_276_7, 0.129_484_966_168_869_7];
/// Intervals at the most.
const MOST: usize = 600;
/// The smallest interval that is halved, of the whole: on a pole sums grow until rounding makes them look right.
const LEAST: f64 = 1e-9;

/// An interval with what is known of it.
struct Interval {
    ends: [f64; 2],
    sum: Vec<f64>,
    error: Vec<f64>,
}

fn estimate(ends: [f64; 2], count: usize, of: &mut impl FnMut(f64) -> Vec<f64>) -> Interval {
    let (middle, half) = (0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0]));
    let (mut sum, mut coarse) = (vec![0.0; count], vec![0.0; count]);
    for (k, (x, weight)) in KRONROD.iter().enumerate() {
        let signs: &[f64] = if k == 0 { &[1.0] } else { &[-1.0, 1.0] };
        for sign in signs {
            let value = of(middle + sign * half * x);
            for (c, value) in value.into_iter().enumerate() {
                sum[c] += half * weight * value;
                if k % 2 == 0 {
                    coarse[c] += half * GAUSS[k / 2] * value;
                }
            }
        }
    }
    let error = sum.iter().zip(&coarse).map(|(sum, coarse)| (sum - coarse).abs()).collect();
    Interval { ends, sum, error }
}

/// ∫ of `count` functions from the first to the last of `breaks`, ascending, between which they are smooth: those that
/// `judged` names are right to `accuracy` of themselves. Errors: not converged.
pub fn integral(
    breaks: &[f64],
    (count, judged): (usize, &[usize]),
    accuracy: f64,
    mut of: impl FnMut(f64) -> Vec<f64>,
) -> Result<Vec<f64>> {
    let mut all: Vec<Interval> = breaks.windows(2).map(|w| estimate([w[0], w[1]], count, &mut of)).collect();
    loop {
        let total = |part: fn(&Interval) -> &[f64], c: usize| all.iter().map(|i| part(i)[c]).sum::<f64>();
        let size = |c: usize| total(|i| &i.sum, c).abs().max(f64::MIN_POSITIVE);
        if judged.iter().all(|&c| total(|i| &i.error, c) <= accuracy * size(c)) {
            return Ok((0..count).map(|c| total(|i| &i.sum, c)).collect());
        }
        let sizes: Vec<f64> = judged.iter().map(|&c| size(c)).collect();
        let share = |i: &Interval| judged.iter().zip(&sizes).map(|(&c, s)| i.error[c] / s).fold(0.0, f64::max);
        let worst = (0..all.len()).max_by(|&a, &b| share(&all[a]).total_cmp(&share(&all[b])));
        let whole = breaks.last().zip(breaks.first()).map_or(0.0, |(b, a)| b - a);
        let wide = |i: &usize| all[*i].ends[1] - all[*i].ends[0] > LEAST * whole;
        let Some(worst) = worst.filter(|i| all.len() < MOST && wide(i)) else {
            return Err(Error::NotConverged(format!(
                "an integral over wavenumbers has not come to {accuracy} with {} intervals",
                all.len()
            )));
        };
        let [a, b] = all.swap_remove(worst).ends;
        let middle = 0.5 * (a + b);
        all.push(estimate([a, middle], count, &mut of));
        all.push(estimate([middle, b], count, &mut of));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A narrow peak, a root at an end, and a polynomial that both rules have exactly; the first two are judged.
    #[test]
    fn peaks_are_found_and_integrated() {
        let width = 1e-3;
        let of = |x: f64| vec![1.0 / ((x - 0.4) * (x - 0.4) + width * width), x.sqrt(), x.powi(13)];
        let found = integral(&[0.0, 0.39, 1.0], (3, &[0, 1]), 1e-6, of).unwrap();
        let peak = ((0.6_f64 / width).atan() + (0.4_f64 / width).atan()) / width;
        for (found, wanted, good) in
            [(found[0], peak, 1e-9), (found[1], 2.0 / 3.0, 1e-6), (found[2], 1.0 / 14.0, 1e-14)]
        {
            assert!((found / wanted - 1.0).abs() < good, "{found} for {wanted}");
        }
        let swinging = integral(&[0.0, 1.0], (1, &[0]), 1e-6, |x: f64| vec![(1.0 / x).sin() / x]);
        let pole = integral(&[0.0, 0.3, 1.0], (1, &[0]), 1e-2, |x: f64| vec![1.0 / ((x - 0.31) * (x - 0.31))]);
        for never in [swinging, pole] {
            assert!(never.as_ref().is_err_and(|e| e.message().contains("has not come to")), "{never:?}");
        }
    }
}
