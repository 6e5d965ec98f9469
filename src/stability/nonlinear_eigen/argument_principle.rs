//! Number of roots by the argument principle.

use super::modal_compliance::SampledCompliance;
use super::pole_sums::DeflationQuotient;
use super::{NonlinearEigenproblem, ABOVE, BELOW, C, CROWDED, EVEN, HALVINGS, SMOOTH, STEP};
use std::f64::consts::PI;

/// Estimate of the distance of a root to its place after a change, by the `changes` of all, each with its number: that
/// of another root counts by the square of the distance to it.
pub(super) fn remaining_error(all: &[C], changes: &[(usize, f64)], (own, change): (usize, f64)) -> f64 {
    let value = all[own];
    let others = changes.iter().filter(|c| c.0 != own);
    let bent = others.map(|&(k, other)| other / (all[k] - value).norm_sqr()).sum::<f64>();
    change * change * (CROWDED / value.norm() + bent)
}

/// An angle in (−π, π].
fn wrapped(angle: f64) -> f64 {
    angle - 2.0 * PI * (angle / (2.0 * PI)).round()
}

/// By how much the phase of e^(`at`) turns from a real value before the first of `points` to 1 beyond the last; none
/// where it is not certain.
pub(super) fn phase_change(mut points: Vec<(f64, C)>, at: &dyn Fn(&[f64]) -> Vec<C>) -> Option<f64> {
    let step = |a: &(f64, C), b: &(f64, C)| C::new(b.1.re - a.1.re, wrapped(b.1.im - a.1.im));
    for _ in 0..=HALVINGS {
        if points.iter().any(|p| !p.1.is_finite()) {
            return None;
        }
        let steps: Vec<C> = points.windows(2).map(|w| step(&w[0], &w[1])).collect();
        // Per unit of u, so that steps of unlike length can be compared.
        let length = |i: usize| points[i + 1].0 - points[i].0;
        let slope = |i: usize| steps[i] / length(i);
        let smooth = |i: usize| {
            let bent = |j: usize| (slope(i) - slope(j)).norm() * length(i) <= SMOOTH[1];
            steps[i].norm() <= SMOOTH[0] && (i == 0 || bent(i - 1)) && (i + 1 == steps.len() || bent(i + 1))
        };
        let rough: Vec<usize> = (0..steps.len()).filter(|&i| !smooth(i)).collect();
        if rough.is_empty() {
            let (first, last) = (points.first()?.1.im, points.last()?.1.im);
            let before = first - PI * (first / PI).round();
            return Some(before + steps.iter().map(|s| s.im).sum::<f64>() - wrapped(last));
        }
        let between: Vec<f64> = rough.iter().map(|&i| 0.5 * (points[i].0 + points[i + 1].0)).collect();
        points.extend(between.iter().copied().zip(at(&between)));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    None
}

impl NonlinearEigenproblem<'_> {
    /// How many eigenvalues within the ray, both of each conjugate pair, are missing in `roots`; none where the count
    /// is not certain.
    pub(super) fn missing(&self, roots: &[C]) -> Option<i64> {
        self.missing_by(roots, None)
    }

    /// The same by the phase at the values `among` on the ray as well, whose moduli ascend.
    pub(super) fn missing_by(&self, roots: &[C], among: Option<&SampledCompliance>) -> Option<i64> {
        let [poles, roots] = self.balanced(roots);
        let quotient = DeflationQuotient::new(&poles, &roots);
        let [low, high] = self.modes.range().map(f64::ln);
        let on_ray = |u: f64| C::from_polar(u.exp(), self.angle);
        let all_at = |u: &[f64]| self.rest(&quotient, &u.iter().map(|&u| on_ray(u)).collect::<Vec<C>>());
        let at = |u: f64| all_at(&[u])[0];
        let even = |v: C| (v.im / PI - (v.im / PI).round()).abs() * PI < EVEN;
        let one = |v: C| wrapped(v.im).abs() < EVEN && v.re.abs() < EVEN;
        // Down to where it is real and up to where it is 1.
        let mut points = vec![(low, at(low))];
        let mut u = low;
        while u > low - BELOW[0] || !even(points[0].1) {
            u -= STEP;
            if u < low - BELOW[1] {
                return None;
            }
            points.insert(0, (u, at(u)));
        }
        u = low;
        if let Some(among) = among {
            let rest = self.rest_with(&quotient, &among.values, &self.modes.compliance_at(among));
            let all = among.values.iter().map(|v| v.norm().ln()).zip(rest);
            points.extend(all.filter(|p| p.0 > low && p.0 < high));
            u = points.last().map_or(low, |p| p.0);
        }
        while u < high + ABOVE[0] || !points.last().is_some_and(|p| one(p.1)) {
            u += STEP;
            if u > high + ABOVE[1] {
                return None;
            }
            points.push((u, at(u)));
        }
        // From 0, where it is real, to infinity, where it is 1: π less for each that is missing.
        Some((-phase_change(points, &all_at)? / PI).round() as i64)
    }
}
