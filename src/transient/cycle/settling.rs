//! A motion that is left to itself: whether its amplitude has settled, or goes on beating.
//!
//! A beat that dies out and one that stays look the same for a while. What tells them apart is the spread of the states
//! at the Poincaré section ([`PoincareSection::spread`](super::section::PoincareSection::spread)) over successive
//! batches of looks: of the one it shrinks, of the other it does not.

use super::amplitude_continuation::GrowthSample;

/// Looks of a batch.
pub(super) const LOOKS: usize = 4;
/// Looks of the batches that are compared.
const BATCHES: [usize; 4] = [LOOKS, 2 * LOOKS, 4 * LOOKS, 8 * LOOKS];
/// Largest difference of the means of batches without a trend, in ln a.
const TREND: f64 = 0.02;
/// A motion whose amplitude has gone so far, in ln a, was not near to its end.
const GONE: f64 = 0.5;
/// A spread that is no less than this part of what it was two batches before, nor that is of it, stays.
const SHRINKS: f64 = 0.8;
/// A spread that goes one way over three batches has a trend, unless it is by less than this part.
const STEADY: f64 = 0.95;

/// Known state of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SettlingState {
    /// Nothing yet, or a beat that still shrinks.
    Nothing,
    /// Its amplitude has settled.
    Settled,
    /// Its amplitude goes up and down without a trend, and its states spread as much as before: waves that beat, or
    /// chaos.
    Sustained,
    /// It goes away.
    Gone,
}

/// Amplitudes and spreads since it was left to itself.
#[derive(Debug, Clone, Default)]
pub(super) struct FreeRecord {
    levels: Vec<f64>,
    spreads: Vec<f64>,
}

impl FreeRecord {
    /// Takes what was seen, and the spread of the states over the last batch; `settled` is the wanted relative error of
    /// the amplitude.
    pub(super) fn next(&mut self, seen: GrowthSample, spread: f64, settled: f64) -> SettlingState {
        self.levels.push(seen.level);
        self.spreads.push(spread);
        // Twice, as amplitudes that beat stand still where they turn.
        if let [.., a, b, c, d] = self.levels[..] {
            if left(a, b, c).max(left(b, c, d)) <= settled {
                return SettlingState::Settled;
            }
        }
        // A beat that has become so small has settled as well, unless the states still say that it shrinks.
        if self.levels.len() >= 2 * LOOKS {
            let (range, drift) = (self.range(2 * LOOKS), (self.mean(0) - self.mean(1)).abs());
            let small = spread <= 4.0 * settled || self.spreads_as_before(LOOKS);
            if range <= 2.0 * settled && drift <= 0.25 * range && small {
                return SettlingState::Settled;
            }
        }
        // In the mean: a beat is no way.
        if (self.mean(0) - self.levels[0]).abs() > GONE {
            return SettlingState::Gone;
        }
        if self.is_sustained() {
            return SettlingState::Sustained;
        }
        SettlingState::Nothing
    }

    /// Looks since it was left to itself.
    pub(super) fn looks(&self) -> usize {
        self.levels.len()
    }

    /// Mean of the amplitudes of the last batch of [`LOOKS`] but `k`, in ln a; of what there is of it.
    fn mean(&self, k: usize) -> f64 {
        let n = self.levels.len() - k * LOOKS;
        let batch = &self.levels[n.saturating_sub(LOOKS)..n];
        batch.iter().sum::<f64>() / batch.len() as f64
    }

    /// Range of the amplitudes of the last `looks`, in ln a.
    fn range(&self, looks: usize) -> f64 {
        let late = &self.levels[self.levels.len().saturating_sub(looks)..];
        late.iter().copied().fold(f64::MIN, f64::max) - late.iter().copied().fold(f64::MAX, f64::min)
    }

    /// Returns true if the amplitude goes up and down and neither has a trend nor spreads less than before, over three
    /// batches of some length: slow beats are longer than short ones.
    fn is_sustained(&self) -> bool {
        BATCHES.into_iter().any(|b| self.range(3 * b) > TREND && self.is_stationary_over(b))
    }

    /// Returns true if over three batches of some length neither the amplitude has a trend nor the spread shrinks.
    pub(super) fn is_stationary(&self) -> bool {
        BATCHES.into_iter().any(|b| self.is_stationary_over(b))
    }

    fn is_stationary_over(&self, batch: usize) -> bool {
        let Some(first) = self.levels.len().checked_sub(3 * batch) else { return false };
        let mut means = self.levels[first..].chunks_exact(batch).map(|b| b.iter().sum::<f64>() / batch as f64);
        let [Some(a), Some(b), Some(c)] = [means.next(), means.next(), means.next()] else { return false };
        let trend = (a - b).abs().max((b - c).abs()).max((a - c).abs());
        // What goes one way only is on its way.
        trend <= TREND.min(0.5 * self.range(3 * batch)) && self.spreads_as_before(batch)
    }

    /// Returns true if the spread of the last `batch` looks is about what it was two batches before, and is not on its
    /// way slowly: a beat may grow by a fifth in a second, and leads to another motion then.
    fn spreads_as_before(&self, batch: usize) -> bool {
        let Some(first) = self.spreads.len().checked_sub(3 * batch) else { return false };
        let largest = |b: usize| self.spreads[first + b * batch..][..batch].iter().copied().fold(0.0, f64::max);
        let [a, b, c] = [0, 1, 2].map(largest);
        let one_way = (a < b && b < c && a < STEADY * c) || (a > b && b > c && c < STEADY * a);
        c >= SHRINKS * a && a >= SHRINKS * c && !one_way
    }

    /// Returns true if the spread neither shrinks nor grows, whatever the amplitude does.
    pub(super) fn keeps_its_spread(&self) -> bool {
        self.spreads_as_before(LOOKS)
    }
}

/// Remaining distance of a geometric approach through three levels, at least its last step.
fn left(a: f64, b: f64, c: f64) -> f64 {
    let (before, last) = ((b - a).abs(), (c - b).abs());
    let ratio = (last / before.max(f64::MIN_POSITIVE)).min(0.9);
    last.max(last * ratio / (1.0 - ratio))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(level: impl Fn(f64) -> f64, spread: impl Fn(f64) -> f64) -> (SettlingState, usize) {
        let mut alone = FreeRecord::default();
        let seen = |level: f64| GrowthSample { level, rate: 0.0, linear: false };
        let mut looks = (0..100).map(|k| (alone.next(seen(level(f64::from(k))), spread(f64::from(k)), 1e-3), k));
        let found = looks.find(|(known, _)| *known != SettlingState::Nothing);
        found.map_or((SettlingState::Nothing, 100), |(known, k)| (known, k as usize))
    }

    #[test]
    fn an_amplitude_settles_beats_or_goes_away() {
        // A fifth of what is left goes at each look: 1e-3 is left after 21, seen once more.
        let decay = |k: f64| 0.8f64.powf(k);
        let (known, looks) = end(|k| 0.1 * decay(k), |k| 0.1 * decay(k));
        assert!(known == SettlingState::Settled && (21..24).contains(&looks), "{known:?} {looks}");
        let (known, looks) = end(|k| 0.05 * (1.3 * k).sin(), |_| 0.1);
        assert!(known == SettlingState::Sustained && looks < 16, "{known:?} {looks}");
        assert_eq!(end(|k| -0.06 * k, |_| 0.1).0, SettlingState::Gone);
        assert_eq!(end(|k| if k < 2.0 { k } else { 1.0 }, |_| 0.1).0, SettlingState::Gone);
        assert_eq!(end(|_| 0.3, |_| 0.1), (SettlingState::Settled, 3));
    }

    /// A beat that grows is on its way to another motion.
    #[test]
    fn a_beat_that_grows_is_not_sustained() {
        let beat = |k: f64| 0.01 * 1.04f64.powf(k);
        let mut alone = FreeRecord::default();
        for k in (0..60).map(f64::from) {
            let seen = GrowthSample { level: beat(k) * (1.3 * k).sin(), rate: 0.0, linear: false };
            let known = alone.next(seen, 2.0 * beat(k), 1e-3);
            assert!(known == SettlingState::Nothing, "{k}: {known:?}");
        }
    }

    /// So is one that grows by 1 % at each look, which is less than a fifth over three batches of four.
    #[test]
    fn a_beat_that_grows_slowly_is_not_sustained() {
        let beat = |k: f64| 0.02 * 1.01f64.powf(k);
        let (known, looks) = end(|k| beat(k) * (1.3 * k).sin(), |k| 2.0 * beat(k));
        assert_eq!((known, looks), (SettlingState::Nothing, 100));
        // One that stays, with spreads that differ by a tenth from look to look.
        let (known, looks) = end(|k| 0.05 * (1.3 * k).sin(), |k| 0.1 + 0.005 * (2.1 * k).sin());
        assert!(known == SettlingState::Sustained && looks < 24, "{known:?} {looks}");
    }

    /// A beat of 20 % that loses 7 % at each look stands no chance to settle within 16 looks, and is given the time to.
    #[test]
    fn a_beat_that_shrinks_is_given_time() {
        let beat = |k: f64| 0.2 * 0.93f64.powf(k);
        let (known, looks) = end(|k| beat(k) * (1.3 * k).sin(), |k| 2.0 * beat(k));
        assert!(known == SettlingState::Settled && looks > 60, "{known:?} {looks}");
    }
}
