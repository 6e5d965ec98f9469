//! Sobol' indices: the share of the variance of an output that an input explains by itself (first order), and with
//! all its interactions (total).
//!
//! Design of A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259–270: N points A, N points B independent of
//! them, and for each input i the points A with the column i of B. First-order indices by the formula of that paper,
//! with the mean m taken off, total ones by that of M. J. W. Jansen, Comput. Phys. Commun. 117 (1999) 35–43:
//!
//! S_i = Σ (f(B) − m) (f(AB_i) − f(A)) / NV,  T_i = Σ (f(A) − f(AB_i))² / 2NV.

use super::interval::quantile;
use super::Stream;

/// Repeats of the bootstrap.
const REPEATS: usize = 1000;

/// The indices of an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Indices {
    /// First-order index and its interval.
    pub first: f64,
    /// Ends of its interval.
    pub first_interval: [f64; 2],
    /// Total index and its interval.
    pub total: f64,
    /// Ends of its interval.
    pub total_interval: [f64; 2],
}

/// The indices of each input from the outputs f(A), f(B), f(AB_1) … f(AB_d) of each of N rows, `[N, d + 2]`, with
/// intervals by the bootstrap over the rows; none where fewer than four rows are there or nothing varies.
pub fn indices(rows: &[Vec<f64>], confidence: f64, seed: u64) -> Option<Vec<Indices>> {
    let inputs = rows.first()?.len().checked_sub(2)?;
    if rows.len() < 4 {
        return None;
    }
    let whole = estimate(rows, &(0..rows.len()).collect::<Vec<_>>(), inputs)?;
    let mut stream = Stream::new(seed, 0xB007);
    let mut repeats: Vec<Vec<f64>> = vec![Vec::with_capacity(REPEATS); 2 * inputs];
    for _ in 0..REPEATS {
        let drawn: Vec<usize> = (0..rows.len()).map(|_| stream.below(rows.len())).collect();
        let Some(found) = estimate(rows, &drawn, inputs) else { continue };
        repeats.iter_mut().zip(found).for_each(|(all, value)| all.push(value));
    }
    let tail = 0.5 * (1.0 - confidence);
    let interval = |k: usize| {
        let mut sorted = repeats[k].clone();
        sorted.sort_by(f64::total_cmp);
        [quantile(&sorted, tail), quantile(&sorted, 1.0 - tail)]
    };
    let of = |i: usize| Indices {
        first: whole[2 * i],
        first_interval: interval(2 * i),
        total: whole[2 * i + 1],
        total_interval: interval(2 * i + 1),
    };
    Some((0..inputs).map(of).collect())
}

/// S and T of each input from the rows `drawn`; none where nothing varies.
fn estimate(rows: &[Vec<f64>], drawn: &[usize], inputs: usize) -> Option<Vec<f64>> {
    let n = drawn.len() as f64;
    let both = || drawn.iter().flat_map(|&j| [rows[j][0], rows[j][1]]);
    let mean = both().sum::<f64>() / (2.0 * n);
    let variance = both().map(|f| (f - mean).powi(2)).sum::<f64>() / (2.0 * n - 1.0);
    if !(variance > 1e-24 * mean * mean) {
        return None;
    }
    let mut found = Vec::with_capacity(2 * inputs);
    for i in 0..inputs {
        let sum = |of: &dyn Fn(&[f64]) -> f64| drawn.iter().map(|&j| of(&rows[j])).sum::<f64>() / (n * variance);
        found.push(sum(&|row| (row[1] - mean) * (row[2 + i] - row[0])));
        found.push(sum(&|row| 0.5 * (row[0] - row[2 + i]).powi(2)));
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::super::cube::{latin_hypercube, scrambled_sobol};
    use super::*;
    use std::f64::consts::PI;

    /// Outputs of `f` at the design of points in the unit cube of 2d dimensions.
    fn rows(points: &[Vec<f64>], d: usize, f: &dyn Fn(&[f64]) -> f64) -> Vec<Vec<f64>> {
        let row = |p: &Vec<f64>| {
            let (a, b) = p.split_at(d);
            let mut out = vec![f(a), f(b)];
            out.extend((0..d).map(|i| {
                let mut x = a.to_vec();
                x[i] = b[i];
                f(&x)
            }));
            out
        };
        points.iter().map(row).collect()
    }

    fn check(points: &[Vec<f64>], f: &dyn Fn(&[f64]) -> f64, want: &[[f64; 2]], tolerance: f64) {
        let found = indices(&rows(points, want.len(), f), 0.95, 1).expect("indices");
        for (i, (found, [first, total])) in found.iter().zip(want).enumerate() {
            assert!((found.first - first).abs() < tolerance, "S{i}: {} and {first}", found.first);
            assert!((found.total - total).abs() < tolerance, "T{i}: {} and {total}", found.total);
            let within = |[low, high]: [f64; 2], value: f64| low - tolerance <= value && value <= high + tolerance;
            assert!(within(found.first_interval, *first) && within(found.total_interval, *total), "{found:?}");
        }
    }

    const ISHIGAMI: (f64, f64) = (7.0, 0.1);
    const G: [f64; 5] = [0.0, 1.0, 4.5, 9.0, 99.0];

    /// sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1 (T. Ishigami, T. Homma, 1990), x from −π to π.
    fn ishigami_function(u: &[f64]) -> f64 {
        let (a, b) = ISHIGAMI;
        let x: Vec<f64> = u.iter().map(|u| PI * (2.0 * u - 1.0)).collect();
        x[0].sin() + a * x[1].sin().powi(2) + b * x[2].powi(4) * x[0].sin()
    }

    /// Π (|4x − 2| + a)/(1 + a) (I. M. Sobol', 1993), with a = 0, 1, 4.5, 9, 99.
    fn g_of_sobol(u: &[f64]) -> f64 {
        u.iter().zip(G).map(|(x, a)| ((4.0 * x - 2.0).abs() + a) / (1.0 + a)).product()
    }

    #[test]
    fn ishigami() {
        let (a, b) = ISHIGAMI;
        let alone = 0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2);
        let second = a * a / 8.0;
        let together = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
        let v = alone + second + together;
        let want = [[alone / v, (alone + together) / v], [second / v, second / v], [0.0, together / v]];
        assert!((want[0][0] - 0.3139).abs() < 1e-4 && (want[1][0] - 0.4424).abs() < 1e-4);
        check(&scrambled_sobol(6, 1 << 13, 1, 3), &ishigami_function, &want, 0.01);
        check(&latin_hypercube(6, 1 << 13, 3), &ishigami_function, &want, 0.05);
    }

    #[test]
    fn g_function() {
        let own: Vec<f64> = G.iter().map(|a| 1.0 / (3.0 * (1.0 + a) * (1.0 + a))).collect();
        let v = own.iter().map(|v| 1.0 + v).product::<f64>() - 1.0;
        let want: Vec<[f64; 2]> = own.iter().map(|o| [o / v, o / v * (1.0 + v) / (1.0 + o)]).collect();
        check(&scrambled_sobol(10, 1 << 13, 1, 4), &g_of_sobol, &want, 0.01);
    }

    /// The indices of OpenTURNS on 2^15 points of a Sobol' sequence (docs/data/uncertainty_openturns.py).
    #[test]
    fn indices_are_those_of_openturns() {
        let read = |case: &str, d: usize| -> Vec<[f64; 2]> {
            let mut all = vec![[f64::NAN; 2]; d];
            for line in include_str!("../../docs/data/uncertainty_openturns.csv").lines() {
                let cells: Vec<&str> = line.split(',').collect();
                if cells[0] == case {
                    let (input, value): (usize, f64) = (cells[1].parse().unwrap(), cells[3].parse().unwrap());
                    all[input][usize::from(cells[2] == "total")] = value;
                }
            }
            all
        };
        check(&scrambled_sobol(6, 1 << 13, 1, 11), &ishigami_function, &read("ishigami", 3), 0.01);
        check(&scrambled_sobol(10, 1 << 13, 1, 12), &g_of_sobol, &read("g_function", 5), 0.01);
    }

    /// Intervals of the first-order index of an additive function hold it as often as they say, over 200 repeats.
    #[test]
    fn bootstrap_intervals_cover() {
        let f = |u: &[f64]| 2.0 * u[0] + u[1];
        let mut covered = [0; 2];
        for seed in 0..200 {
            let mut stream = Stream::new(seed, 5);
            let points: Vec<Vec<f64>> = (0..200).map(|_| (0..4).map(|_| stream.unit()).collect()).collect();
            let found = indices(&rows(&points, 2, &f), 0.95, seed).expect("indices")[0];
            let within = |[low, high]: [f64; 2]| usize::from((low..=high).contains(&0.8));
            covered[0] += within(found.first_interval);
            covered[1] += within(found.total_interval);
        }
        assert!(covered.iter().all(|c| (180..=199).contains(c)), "{covered:?}");
    }

    #[test]
    fn what_does_not_vary_has_none() {
        assert!(indices(&vec![vec![1.0; 4]; 10], 0.95, 1).is_none());
        assert!(indices(&[vec![1.0, 2.0, 1.0]], 0.95, 1).is_none());
    }
}
