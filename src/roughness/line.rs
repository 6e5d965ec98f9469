//! A height along the way: a cubic spline through samples.

use crate::{Error, Result};

/// Samples of the neighbouring turns that a line which repeats itself is continued by on either side: what the ends
/// of the spline are taken to be changes it by (2 − √3)^24 = 2e-14.
const WRAPPED: usize = 24;

/// Height r(s), m, at the way s, m.
#[derive(Debug, Clone, PartialEq)]
pub struct RoughnessLine {
    /// Places of the samples, m, ascending.
    at: Vec<f64>,
    height: Vec<f64>,
    /// Second derivatives there, 1/m.
    second: Vec<f64>,
    period: Option<f64>,
}

impl RoughnessLine {
    /// The natural cubic spline through `height` (m) `at` (m, ascending, at least 2). Beyond its ends it goes on level.
    pub fn through(at: Vec<f64>, height: Vec<f64>) -> Result<Self> {
        if at.len() < 2 || at.len() != height.len() || at.windows(2).any(|w| !(w[1] > w[0])) {
            return Err(Error::Defect(format!("roughness: {} places for {} heights", at.len(), height.len())));
        }
        let second = bends(&at, &height);
        Ok(Self { at, height, second, period: None })
    }

    /// The same that repeats itself after `period`, m; samples that lie a period or more after the first are left out.
    pub fn repeating(at: &[f64], height: &[f64], period: f64) -> Result<Self> {
        // A last sample that is the first one again is left out too.
        let kept = at.iter().take_while(|&&s| s - at[0] < period * (1.0 - 1e-9)).count();
        if kept < 2 || height.len() < kept {
            return Err(Error::Defect(format!("roughness: {kept} samples in a period of {period} m")));
        }
        let wrapped = WRAPPED as i64;
        let turn = |i: i64| {
            let (n, i) = (kept as i64, i);
            (i.div_euclid(n) as f64 * period, i.rem_euclid(n) as usize)
        };
        let around = -wrapped..kept as i64 + wrapped + 1;
        let (at, height) = around.map(turn).map(|(way, k)| (at[k] + way, height[k])).unzip();
        Ok(Self { period: Some(period), ..Self::through(at, height)? })
    }

    /// The same, moved by `way` (m) towards larger s.
    pub fn moved(mut self, way: f64) -> Self {
        self.at.iter_mut().for_each(|s| *s += way);
        self
    }

    /// The places between which the line is known, m; none of one that repeats itself.
    pub fn ends(&self) -> Option<[f64; 2]> {
        self.period.is_none().then(|| [self.at[0], self.at[self.at.len() - 1]])
    }

    /// Its height at `s` (m), m.
    pub fn height(&self, s: f64) -> f64 {
        let (n, mut s) = (self.at.len(), s);
        if let Some(period) = self.period {
            let first = self.at[WRAPPED];
            s = first + (s - first).rem_euclid(period);
        } else {
            s = s.clamp(self.at[0], self.at[n - 1]);
        }
        let i = self.at.partition_point(|&v| v <= s).clamp(1, n - 1) - 1;
        let h = self.at[i + 1] - self.at[i];
        let (b, a) = ((s - self.at[i]) / h, (self.at[i + 1] - s) / h);
        let bend = (a * a - 1.0) * a * self.second[i] + (b * b - 1.0) * b * self.second[i + 1];
        a * self.height[i] + b * self.height[i + 1] + bend * h * h / 6.0
    }
}

/// Second derivatives of the natural spline: h_(i−1) m_(i−1) + 2(h_(i−1) + h_i) m_i + h_i m_(i+1) = 6 (slope_i −
/// slope_(i−1)).
fn bends(at: &[f64], height: &[f64]) -> Vec<f64> {
    let n = at.len();
    let h = |i: usize| at[i + 1] - at[i];
    let slope = |i: usize| (height[i + 1] - height[i]) / h(i);
    let mut second = vec![0.0; n];
    // What is left of the row before, over its pivot.
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let pivot = 2.0 * (h(i - 1) + h(i)) - h(i - 1) * upper[i - 1];
        upper[i] = h(i) / pivot;
        second[i] = (6.0 * (slope(i) - slope(i - 1)) - h(i - 1) * second[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        second[i] -= upper[i] * second[i + 1];
    }
    second
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_line_that_repeats_itself_has_no_seam_and_converges_with_the_fourth_power() {
        let f = |s: f64| 1e-6 * (2.0 * PI * s / 0.5).sin() + 5e-7 * (6.0 * PI * s / 0.5).cos();
        let mut before = f64::INFINITY;
        for n in [20, 40, 80] {
            // Uneven samples over one turn, the last one being the first again.
            let place = |i: usize| (i as f64 + 0.2 * (2.0 * PI * i as f64 / n as f64).sin()) * 0.5 / n as f64;
            let at: Vec<f64> = (0..=n).map(place).collect();
            let height: Vec<f64> = at.iter().map(|&s| f(s)).collect();
            let line = RoughnessLine::repeating(&at, &height, 0.5).unwrap();
            let worst = (0..997).map(|i| -3.0 + 0.0071 * i as f64).map(|s| (line.height(s) - f(s)).abs());
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < before / 11.0, "{n}: {worst:e} after {before:e}");
            before = worst;
        }
        assert!(before < 1e-10, "{before:e}");
    }

    #[test]
    fn a_line_passes_its_samples_keeps_straight_lines_and_ends_level() {
        let at = vec![0.0, 0.1, 0.3, 0.35];
        let line = RoughnessLine::through(at.clone(), at.iter().map(|s| 2.0 - 3.0 * s).collect()).unwrap();
        for (s, want) in [(-1.0, 2.0), (0.0, 2.0), (0.1, 1.7), (0.22, 1.34), (0.35, 0.95), (2.0, 0.95)] {
            assert!((line.height(s) - want).abs() < 1e-14, "at {s}: {}, expected {want}", line.height(s));
        }
        assert_eq!(line.moved(1.0).ends(), Some([1.0, 1.35]));
        assert!(RoughnessLine::through(vec![0.0, 0.2, 0.2], vec![0.0; 3]).is_err());
    }
}
