//! A motion that is left to itself: whether its amplitude has come to stay.

use super::trail::Seen;

/// Looks that are compared where an amplitude does not come to rest.
const LOOKS: usize = 4;
/// What their means may differ by, in ln a.
const TREND: f64 = 0.02;
/// A motion whose amplitude has gone so far, in ln a, was not near to its end.
const GONE: f64 = 0.5;

/// What is known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Known {
    /// Nothing yet.
    Nothing,
    /// Its amplitude has settled.
    Settled,
    /// It goes up and down without a trend: two waves that beat, or chaos.
    Wanders,
    /// It goes away.
    Gone,
}

/// The amplitudes since it was left to itself.
#[derive(Debug, Clone, Default)]
pub(super) struct Alone {
    levels: Vec<f64>,
}

impl Alone {
    /// Takes what was seen; `settled` is the wanted relative error of the amplitude.
    pub(super) fn next(&mut self, seen: Seen, settled: f64) -> Known {
        self.levels.push(seen.level);
        let n = self.levels.len();
        // Twice, as amplitudes that beat stand still where they turn.
        if let [.., a, b, c, d] = self.levels[..] {
            if left(a, b, c).max(left(b, c, d)) <= settled {
                return Known::Settled;
            }
        }
        if (seen.level - self.levels[0]).abs() > GONE {
            return Known::Gone;
        }
        if n >= 3 * LOOKS {
            let mean = |k: usize| self.levels[n - (k + 1) * LOOKS..n - k * LOOKS].iter().sum::<f64>() / LOOKS as f64;
            let [a, b, c] = [0, 1, 2].map(mean);
            let trend = (a - b).abs().max((b - c).abs()).max((a - c).abs());
            // What goes one way only is on its way.
            let late = &self.levels[n - 3 * LOOKS..];
            let range = late.iter().copied().fold(f64::MIN, f64::max) - late.iter().copied().fold(f64::MAX, f64::min);
            if range > TREND && trend <= TREND.min(0.5 * range) {
                return Known::Wanders;
            }
        }
        Known::Nothing
    }
}

/// What a geometric approach through three levels has still before it, at least its last way.
fn left(a: f64, b: f64, c: f64) -> f64 {
    let (before, last) = ((b - a).abs(), (c - b).abs());
    let ratio = (last / before.max(f64::MIN_POSITIVE)).min(0.9);
    last.max(last * ratio / (1.0 - ratio))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(level: impl Fn(f64) -> f64) -> (Known, usize) {
        let mut alone = Alone::default();
        let mut looks =
            (0..100).map(|k| (alone.next(Seen { level: level(f64::from(k)), rate: 0.0, linear: false }, 1e-3), k));
        let found = looks.find(|(known, _)| *known != Known::Nothing);
        found.map_or((Known::Nothing, 100), |(known, k)| (known, k as usize))
    }

    #[test]
    fn an_amplitude_settles_wanders_or_goes_away() {
        // A fifth of what is left goes at each look: 1e-3 is left after 21, seen once more.
        let (known, looks) = end(|k| 0.1 * 0.8f64.powf(k));
        assert!(known == Known::Settled && (21..24).contains(&looks), "{known:?} {looks}");
        let (known, looks) = end(|k| 0.05 * (1.3 * k).sin());
        assert!(known == Known::Wanders && looks < 16, "{known:?} {looks}");
        assert_eq!(end(|k| -0.06 * k).0, Known::Gone);
        assert_eq!(end(|k| if k < 2.0 { k } else { 1.0 }).0, Known::Gone);
        assert_eq!(end(|_| 0.3), (Known::Settled, 3));
    }
}
