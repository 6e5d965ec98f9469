//! Graded divisions of a line: element sizes that grow geometrically from the contact to a largest size.

/// More sizes than this are not added one by one.
const LONG: usize = 1000;

/// Number of sizes `first·q^k` below `largest`.
fn grown(first: f64, q: f64, largest: f64) -> f64 {
    match q > 1.0 {
        true => ((largest / first).ln() / (q - 1.0).ln_1p()).ceil().max(0.0),
        false => f64::INFINITY,
    }
}

/// Sum of `n` sizes `first·q^k`.
fn total(n: f64, first: f64, q: f64) -> f64 {
    match q > 1.0 {
        true => first * (n * (q - 1.0).ln_1p()).exp_m1() / (q - 1.0),
        false => n * first,
    }
}

/// Sum of `n` sizes `first·q^k`, each cut off at `largest`.
fn sum(n: usize, first: f64, q: f64, largest: f64) -> f64 {
    if n > LONG {
        let growing = grown(first, q, largest).min(n as f64);
        return total(growing, first, q) + (n as f64 - growing) * largest;
    }
    let (mut total, mut size) = (0.0, first);
    for _ in 0..n {
        total += size.min(largest);
        size = (size * q).min(1e6 * largest);
    }
    total
}

/// Number of elements that [`sizes`] needs for `length` (m), without dividing it.
pub fn elements(length: f64, first: f64, growth: f64, largest: f64) -> usize {
    if length <= 0.0 {
        return 0;
    }
    if growth <= 1.0 || largest <= first {
        return ((length / first.min(largest)) * (1.0 - 1e-9)).ceil().max(1.0) as usize;
    }
    let filled = (length * (growth - 1.0) / first).ln_1p() / (growth - 1.0).ln_1p();
    let growing = grown(first, growth, largest);
    if growing.min(filled) > LONG as f64 {
        let rest = if filled <= growing { 0.0 } else { (length - total(growing, first, growth)).max(0.0) / largest };
        return (filled.min(growing).ceil() + (rest * (1.0 - 1e-9)).ceil()) as usize;
    }
    let (mut n, mut total, mut size) = (0usize, 0.0, first);
    while total < length * (1.0 - 1e-9) && size < largest {
        total += size;
        size *= growth;
        n += 1;
    }
    if total < length * (1.0 - 1e-9) {
        n += (((length - total) / largest) * (1.0 - 1e-9)).ceil().max(1.0) as usize;
    }
    n
}

/// Divides `length` (m) into `n` elements whose sizes (m, `[n]`) begin near `first`, grow by one common ratio and stay
/// below `largest`; the ratio is chosen so that they fill the length exactly. With `n` of [`elements`] the ratio is
/// at most the growth asked for there.
pub fn sizes(length: f64, n: usize, first: f64, largest: f64) -> Vec<f64> {
    if n == 0 {
        return Vec::new();
    }
    // No common ratio at or above one fills so short a length: equal elements, a little smaller than `first`.
    if largest <= first || sum(n, first, 1.0, largest) >= length {
        return vec![length / n as f64; n];
    }
    let (mut low, mut high) = (1.0, 2.0);
    while sum(n, first, high, largest) < length && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if sum(n, first, middle, largest) < length {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut out = Vec::with_capacity(n);
    let mut size = first;
    for _ in 0..n {
        out.push(size.min(largest));
        size = (size * high).min(1e6 * largest);
    }
    // Takes up the last rounding (and, where even the largest ratio falls short, what is left).
    let scale = length / out.iter().sum::<f64>();
    out.iter_mut().for_each(|s| *s *= scale);
    out
}

/// Divides `length` (m) into `n` elements, symmetrically: sizes (m, `[n]`) that grow by one common ratio from both
/// ends to the middle, those at the ends `part` (at most 1) of the mean.
pub fn symmetric(length: f64, n: usize, part: f64) -> Vec<f64> {
    let first = part.min(1.0) * length / n.max(1) as f64;
    let exponent = |k: usize| k.min(n - 1 - k) as i32;
    let total = |q: f64| match n > LONG {
        true => 2.0 * total((n / 2) as f64, first, q) + if n % 2 == 1 { first * q.powi(n as i32 / 2) } else { 0.0 },
        false => (0..n).map(|k| first * q.powi(exponent(k))).sum::<f64>(),
    };
    let (mut low, mut high) = (1.0, 2.0);
    if n > 2 {
        while total(high) < length {
            high *= 2.0;
        }
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if total(middle) < length {
            low = middle;
        } else {
            high = middle;
        }
    }
    let scale = length / total(low);
    (0..n).map(|k| scale * first * low.powi(exponent(k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetric_sizes_fill_the_length_from_small_ends() {
        for (n, part) in [(1, 0.6), (2, 0.6), (3, 0.6), (6, 1.0), (17, 0.6), (18, 0.5), (2001, 0.6), (2002, 0.6)] {
            let h = symmetric(0.1, n, part);
            let total: f64 = h.iter().sum();
            assert!(h.len() == n && (total - 0.1).abs() < 1e-14, "{n}: sum {total}");
            let expected = if n > 2 { part * 0.1 / n as f64 } else { 0.1 / n as f64 };
            assert!((h[0] - expected).abs() < 1e-12, "{n}: first {} instead of {expected}", h[0]);
            for k in 0..n {
                assert!((h[k] - h[n - 1 - k]).abs() < 1e-15 && h[k] >= h[0] * (1.0 - 1e-12), "{h:?}");
            }
        }
    }

    #[test]
    fn sizes_fill_the_length_and_grow_no_faster_than_asked() {
        for (length, first, growth, largest) in
            [(0.4, 1e-3, 1.3, 0.025), (0.043, 1.3e-3, 1.3, 0.0037), (1e-3, 2e-3, 1.5, 0.1), (1.5, 1e-4, 1.2, 0.03)]
        {
            let n = elements(length, first, growth, largest);
            let h = sizes(length, n, first, largest);
            assert_eq!(h.len(), n);
            let total: f64 = h.iter().sum();
            assert!((total / length - 1.0).abs() < 1e-14, "sum {total} of {length}");
            assert!(h[0] <= first * (1.0 + 1e-9), "first size {} above {first}", h[0]);
            for w in h.windows(2) {
                let ratio = w[1] / w[0];
                assert!(ratio > 1.0 - 1e-9 && ratio < growth * (1.0 + 1e-6), "ratio {ratio} above {growth}");
                assert!(w[1] < largest * (1.0 + 1e-9), "size {} above {largest}", w[1]);
            }
        }
    }

    /// Long divisions are counted and added up in closed form, to the same as one by one.
    #[test]
    fn long_divisions_are_counted_without_going_through_them() {
        for (length, first, growth, largest) in
            [(1.0, 1e-5, 1.0001, 1.0), (1.0, 1e-5, 1.001, 2e-5), (3.0, 1e-4, 1.0002, 1.0)]
        {
            let (mut n, mut sum, mut size) = (0usize, 0.0, first);
            while sum < length {
                sum += f64::min(size, largest);
                size *= growth;
                n += 1;
            }
            let counted = elements(length, first, growth, largest);
            assert!(n > LONG && counted.abs_diff(n) <= 1, "{counted} instead of {n}");
            let h = sizes(length, counted, first, largest);
            let total: f64 = h.iter().sum();
            assert!((total / length - 1.0).abs() < 1e-12, "sum {total} of {length}");
            assert!(h.windows(2).all(|w| w[1] / w[0] < growth * (1.0 + 1e-9) && w[1] <= largest * (1.0 + 1e-9)));
        }
        assert!(elements(1.0, 1e-12, 1.0000001, 0.5) > 100_000_000);
        assert_eq!(elements(1e300, 1e-300, 1.5, 1e-300), usize::MAX);
    }

    #[test]
    fn uniform_sizes_divide_evenly() {
        assert_eq!(elements(0.1, 0.025, 1.0, 0.025), 4);
        assert_eq!(sizes(0.1, 4, 0.025, 0.025), vec![0.025; 4]);
        assert_eq!(elements(0.1, 0.026, 1.3, 0.026), 4);
    }
}
