//! Graded divisions of a line: element sizes that grow geometrically from the contact to a largest size.

/// Sum of `n` sizes `first·q^k`, each cut off at `largest`.
fn sum(n: usize, first: f64, q: f64, largest: f64) -> f64 {
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
/// below `largest`; the ratio is chosen so that they fill the length exactly. With `n` of [`elements`] the ratio is at most the
/// growth asked for there.
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

/// A line with a small element at either end, whose sizes grow towards the middle.
pub struct TwoEnds {
    /// Length graded from each end, m.
    lengths: [f64; 2],
    counts: [usize; 2],
    first: [f64; 2],
    largest: f64,
}

impl TwoEnds {
    /// Divides `length` (m) with sizes near `first` (m) at its beginning and its end that grow by at most `growth` to at most `largest` (m).
    pub fn new(length: f64, first: [f64; 2], growth: f64, largest: f64) -> Self {
        // Sizes that grow at the same rate from either end are equal here.
        let meet = (0.5 * (length + (first[1] - first[0]) / growth.ln())).clamp(0.0, length);
        // A remainder of less than one element belongs to the other end.
        let meet = if meet < first[0] {
            0.0
        } else if length - meet < first[1] {
            length
        } else {
            meet
        };
        let lengths = [meet, length - meet];
        let counts = [0, 1].map(|e| elements(lengths[e], first[e], growth, largest));
        Self { lengths, counts, first, largest }
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.counts[0] + self.counts[1]
    }

    /// Mean size, m; 0 without elements.
    pub fn mean(&self) -> f64 {
        (self.lengths[0] + self.lengths[1]) / self.elements().max(1) as f64
    }

    /// Takes one element more, where they are the larger on the mean; false where there are none.
    pub fn refine(&mut self) -> bool {
        let mean = |e: usize| self.lengths[e] / self.counts[e].max(1) as f64;
        let end = usize::from(mean(1) > mean(0));
        let any = self.counts[end] > 0;
        self.counts[end] += usize::from(any);
        any
    }

    /// The sizes, m, `[elements]`, from the beginning.
    pub fn sizes(&self) -> Vec<f64> {
        let [mut all, end] = [0, 1].map(|e| sizes(self.lengths[e], self.counts[e], self.first[e], self.largest));
        all.extend(end.iter().rev());
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_ends_fill_the_length_and_meet_without_a_jump() {
        for (length, first, growth, largest) in [
            (0.4, [1e-3, 7.5e-3], 1.3, 0.02),
            (0.073, [1.3e-3, 1.67e-3], 1.3, 2.8e-3),
            (0.013, [1.3e-3, 5e-3], 1.3, 8e-3),
            (2e-3, [1.3e-3, 5e-3], 1.3, 8e-3),
        ] {
            let mut line = TwoEnds::new(length, first, growth, largest);
            for more in 0..3 {
                let h = line.sizes();
                assert_eq!(h.len(), line.elements());
                let total: f64 = h.iter().sum();
                assert!((total / length - 1.0).abs() < 1e-14, "sum {total} of {length}");
                assert!(h.iter().all(|&s| s <= largest * (1.0 + 1e-9)), "{h:?} above {largest}");
                if more == 0 {
                    let jump = h.windows(2).map(|w| (w[1] / w[0]).max(w[0] / w[1])).fold(1.0, f64::max);
                    assert!(jump < growth * growth, "neighbours differ by {jump}: {h:?}");
                }
                assert!(line.refine());
            }
        }
        assert!(!TwoEnds::new(0.0, [1e-3, 1e-3], 1.3, 1e-2).refine());
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

    #[test]
    fn uniform_sizes_divide_evenly() {
        assert_eq!(elements(0.1, 0.025, 1.0, 0.025), 4);
        assert_eq!(sizes(0.1, 4, 0.025, 0.025), vec![0.025; 4]);
        assert_eq!(elements(0.1, 0.026, 1.3, 0.026), 4);
    }
}
