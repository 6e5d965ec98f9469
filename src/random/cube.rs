//! Points in the unit cube: scrambled Sobol' sequences and Latin hypercubes.

use super::joe_kuo::NUMBERS;
use super::{mixed, Stream, STEP};

/// Binary digits of its points.
const DIGITS: usize = 32;

/// Direction numbers of dimension `k`, the first one being that of the most significant digit.
fn directions(k: usize) -> [u32; DIGITS] {
    let mut v = [0; DIGITS];
    let Some(&(s, a, m)) = k.checked_sub(1).and_then(|k| NUMBERS.get(k)) else {
        (0..DIGITS).for_each(|i| v[i] = 1 << (31 - i));
        return v;
    };
    let s = s as usize;
    for i in 0..DIGITS {
        if i < s {
            v[i] = m[i] << (31 - i);
            continue;
        }
        v[i] = v[i - s] ^ (v[i - s] >> s);
        for j in 1..s {
            v[i] ^= ((a >> (s - 1 - j)) & 1) * v[i - j];
        }
    }
    v
}

/// The point `number` of dimension `k` of a Sobol' sequence, as 32 binary digits, in the order of Gray's code.
fn sobol(number: u32, directions: &[u32; DIGITS]) -> u32 {
    let gray = number ^ (number >> 1);
    (0..DIGITS).filter(|i| gray >> i & 1 == 1).fold(0, |x, i| x ^ directions[i])
}

/// Nested uniform scrambling (A. B. Owen, Randomly permuted (t,m,s)-nets and (t,s)-sequences, 1995): each digit is
/// turned over or not as a coin says that belongs to the digits before it.
fn scrambled(x: u32, key: u64) -> u32 {
    let mut y = x;
    for digit in 0..DIGITS {
        // Digits before this one, with a leading 1 that tells their number.
        let before = (1u64 << digit) | if digit == 0 { 0 } else { u64::from(x >> (32 - digit)) };
        let coin = mixed(key ^ mixed(before.wrapping_mul(STEP))) >> 63;
        y ^= (coin as u32) << (31 - digit);
    }
    y
}

/// `replicates` independent scramblings of the first `count` points of a Sobol' sequence, one after the other,
/// `[replicates · count, dimensions]` by rows. At most as many dimensions as there are direction numbers and one.
pub fn scrambled_sobol(dimensions: usize, count: usize, replicates: usize, seed: u64) -> Vec<Vec<f64>> {
    let all: Vec<[u32; DIGITS]> = (0..dimensions).map(directions).collect();
    let mut points = Vec::with_capacity(count * replicates);
    for replicate in 0..replicates {
        let mut stream = Stream::new(seed, replicate as u64);
        let keys: Vec<u64> = (0..dimensions).map(|_| stream.bits()).collect();
        for number in 0..count {
            let of = |(v, key): (&[u32; DIGITS], &u64)| {
                // Below the last digit it is uniform.
                (f64::from(scrambled(sobol(number as u32, v), *key)) + stream.unit()) / 2f64.powi(DIGITS as i32)
            };
            points.push(all.iter().zip(&keys).map(of).collect());
        }
    }
    points
}

/// A Latin hypercube of `count` points: each of `count` equal parts of each axis has one (M. D. McKay, R. J. Beckman,
/// W. J. Conover, Technometrics 21 (1979) 239–245).
pub fn latin_hypercube(dimensions: usize, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut points = vec![vec![0.0; dimensions]; count];
    for k in 0..dimensions {
        let mut stream = Stream::new(seed, k as u64);
        let mut order: Vec<usize> = (0..count).collect();
        for i in (1..count).rev() {
            order.swap(i, stream.below(i + 1));
        }
        for (point, part) in points.iter_mut().zip(order) {
            point[k] = (part as f64 + stream.unit()) / count as f64;
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Most dimensions of a Sobol' sequence.
    const MOST: usize = NUMBERS.len() + 1;

    /// Points 5, 37 and 63 of dimensions 1, 2, 3, 11, 41 and 64, as SciPy 1.17 has them (`scipy.stats.qmc.Sobol`
    /// without scrambling), which takes the same direction numbers.
    #[test]
    fn the_sequence_is_that_of_joe_and_kuo() {
        let at = |number: u32, k: usize| f64::from(sobol(number, &directions(k))) / 2f64.powi(32);
        let dimensions = [0, 1, 2, 10, 40, 63];
        for (number, want) in [
            (2, [0.75, 0.25, 0.25, 0.75, 0.25, 0.75]),
            (5, [0.875, 0.875, 0.125, 0.375, 0.375, 0.625]),
            (37, [0.921875, 0.640625, 0.578125, 0.015625, 0.078125, 0.828125]),
            (63, [0.015625, 0.796875, 0.359375, 0.421875, 0.671875, 0.734375]),
        ] {
            assert_eq!(dimensions.map(|k| at(number, k)), want, "point {number}");
        }
    }

    /// Scrambling keeps what makes the sequence even: one of 2^m points in each of 2^m equal parts of every axis, and
    /// in two dimensions in every box of that volume.
    #[test]
    fn scrambled_points_are_as_even_as_before() {
        let points = scrambled_sobol(MOST, 64, 2, 7);
        for replicate in points.chunks(64) {
            for k in 0..MOST {
                let mut parts: Vec<usize> = replicate.iter().map(|p| (64.0 * p[k]) as usize).collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..64).collect::<Vec<_>>(), "dimension {k}");
            }
            for power in 0..=6 {
                let (a, b) = (1 << power, 64 >> power);
                let cell = |p: &Vec<f64>| (p[0] * a as f64) as usize * b + (p[1] * b as f64) as usize;
                let mut cells: Vec<usize> = replicate.iter().map(cell).collect();
                cells.sort_unstable();
                assert_eq!(cells, (0..64).collect::<Vec<_>>());
            }
        }
        assert!(points[0] != points[64], "replicates are independent");
        assert_eq!(points, scrambled_sobol(MOST, 64, 2, 7));
        assert!(points != scrambled_sobol(MOST, 64, 2, 8));
    }

    /// A single scrambled point is uniform, and two digits of it are independent.
    #[test]
    fn scrambling_is_unbiased() {
        let mut counts = [0usize; 8];
        for seed in 0..4000 {
            let p = &scrambled_sobol(3, 2, 1, seed)[1];
            counts[(8.0 * p[2]) as usize] += 1;
        }
        let chi: f64 = counts.iter().map(|&n| (n as f64 - 500.0).powi(2) / 500.0).sum();
        // 99.9 % of χ² with 7 degrees of freedom.
        assert!(chi < 24.3, "{counts:?}");
    }

    #[test]
    fn a_hypercube_has_one_point_in_each_part_of_each_axis() {
        let points = latin_hypercube(5, 37, 3);
        for k in 0..5 {
            let mut parts: Vec<usize> = points.iter().map(|p| (37.0 * p[k]) as usize).collect();
            parts.sort_unstable();
            assert_eq!(parts, (0..37).collect::<Vec<_>>());
        }
        let along = |k: usize| points.iter().map(|p| p[k]).collect::<Vec<_>>();
        assert!(along(0) != along(1));
    }
}
