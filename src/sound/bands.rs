//! Third-octave bands of IEC 61260-1:2014 (base ten) and the A-weighting of IEC 61672-1:2013.

use crate::{Error, Result};

/// Third-octave bands side by side. Band n has the exact centre 1000 · 10^(n/10) Hz and ends 10^(1/20) below and
/// above it.
///
/// ```
/// use railsqueal::sound::Bands;
///
/// let bands = Bands::spanning(800.0, 1250.0);
/// assert_eq!(bands.nominal(), [800.0, 1000.0, 1250.0]);
/// assert!((bands.centres()[0] - 794.3).abs() < 0.1);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bands {
    first: i32,
    last: i32,
}

/// Ratio of the upper end of a band to its centre.
fn half() -> f64 {
    10f64.powf(0.05)
}

/// Number of the band that holds the frequency `f`, Hz.
fn number(f: f64) -> i32 {
    (10.0 * (f / 1000.0).log10()).round() as i32
}

fn exact(n: i32) -> f64 {
    1000.0 * 10f64.powf(f64::from(n) / 10.0)
}

impl Bands {
    /// From the band that holds `lowest` to the highest one that ends at or below `reach` (Hz).
    pub fn between(lowest: f64, reach: f64) -> Result<Self> {
        let first = number(lowest);
        let mut last = number(reach);
        // The end of a band belongs to it.
        if exact(last) * half() > reach * (1.0 + 1e-12) {
            last -= 1;
        }
        if last < first {
            return Err(Error::Job(format!(
                "the lowest third octave, {} Hz, ends at {:.1} Hz, but the modes kept reach {reach:.1} Hz only; \
                 keep more modes in \
                 analyses.modes, or give a lower min_frequency",
                nominal(first),
                exact(first) * half()
            )));
        }
        Ok(Self { first, last })
    }

    /// From the band that holds `lowest` to that which holds `highest` (Hz).
    pub fn spanning(lowest: f64, highest: f64) -> Self {
        Self { first: number(lowest), last: number(highest) }
    }

    /// Exact centres, Hz.
    pub fn centres(&self) -> Vec<f64> {
        (self.first..=self.last).map(exact).collect()
    }

    /// The rounded centres by which bands are called, Hz.
    pub fn nominal(&self) -> Vec<f64> {
        (self.first..=self.last).map(nominal).collect()
    }

    /// Lower end of the first band, Hz.
    pub fn lowest(&self) -> f64 {
        exact(self.first) / half()
    }

    /// Upper end of the last band, Hz.
    pub fn highest(&self) -> f64 {
        exact(self.last) * half()
    }

    /// Frequencies, Hz, a third of a band apart, from the beginning to the end.
    pub fn grid(&self) -> Vec<f64> {
        let count = 3 * (self.last - self.first + 1);
        (0..=count).map(|g| self.lowest() * 10f64.powf(f64::from(g) / 30.0)).collect()
    }

    /// Shares of the interval from `low` to `high` (Hz) in the bands, `(band, share)`.
    pub fn shares(&self, low: f64, high: f64) -> Vec<(usize, f64)> {
        let share = |n: i32| {
            let (begin, end) = (exact(n) / half(), exact(n) * half());
            ((end.min(high) - begin.max(low)) / (high - low)).max(0.0)
        };
        let near = number(low.max(1e-3))..=number(high.max(1e-3));
        near.filter(|n| (self.first..=self.last).contains(n))
            .map(|n| ((n - self.first) as usize, share(n)))
            .filter(|(_, s)| *s > 0.0)
            .collect()
    }
}

/// Nominal centre of a band, Hz.
fn nominal(n: i32) -> f64 {
    const OF_TEN: [f64; 10] = [1000.0, 1250.0, 1600.0, 2000.0, 2500.0, 3150.0, 4000.0, 5000.0, 6300.0, 8000.0];
    OF_TEN[n.rem_euclid(10) as usize] * 10f64.powi(n.div_euclid(10))
}

/// Time, s, in which the band that holds the frequency `lowest` (Hz) can be told from its neighbours: the main lobe
/// of a Hann window of this length is as wide as the band.
pub(crate) fn resolving_time(lowest: f64) -> f64 {
    let centre = exact(number(lowest));
    4.0 / (centre * (half() - 1.0 / half()))
}

/// A-weighting at the frequency `f` (Hz), dB: IEC 61672-1:2013, annex E.
///
/// ```
/// use railsqueal::sound::bands::a_weighting;
///
/// assert!(a_weighting(1000.0).abs() < 0.01);
/// assert!((a_weighting(100.0) + 19.1).abs() < 0.1);
/// ```
pub fn a_weighting(f: f64) -> f64 {
    let response = |f: f64| {
        let s = f * f;
        let (f1, f2, f3, f4) = (20.60f64, 107.7f64, 737.9f64, 12194f64);
        let lower = (s + f1 * f1) * ((s + f2 * f2) * (s + f3 * f3)).sqrt();
        20.0 * (f4 * f4 * s * s / (lower * (s + f4 * f4))).log10()
    };
    response(f) - response(1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_table_of_the_standard() {
        // IEC 61672-1:2013, table 3, to a tenth of a decibel.
        let table = [(31.5, -39.4), (63.0, -26.2), (100.0, -19.1), (250.0, -8.6), (500.0, -3.2), (1000.0, 0.0)];
        for (f, db) in table.into_iter().chain([(2000.0, 1.2), (4000.0, 1.0), (8000.0, -1.1), (16000.0, -6.6)]) {
            let exact = exact(number(f));
            assert!((a_weighting(exact) - db).abs() < 0.05 + 1e-9, "{f} Hz: {} dB", a_weighting(exact));
        }
    }

    #[test]
    fn bands_have_the_standards_names_and_cover_the_frequencies() {
        let bands = Bands::spanning(80.0, 8000.0);
        let names = bands.nominal();
        assert_eq!(names[..5], [80.0, 100.0, 125.0, 160.0, 200.0]);
        assert_eq!(names[18..], [5000.0, 6300.0, 8000.0]);
        for (exact, name) in bands.centres().iter().zip(&names) {
            assert!((exact / name - 1.0).abs() < 0.02, "{exact} is called {name}");
        }
        // Every interval within is divided without rest, whatever its place.
        let mut low = bands.lowest();
        while low + 7.3 < bands.highest() {
            let total: f64 = bands.shares(low, low + 7.3).iter().map(|s| s.1).sum();
            assert!((total - 1.0).abs() < 1e-9, "{low}: {total}");
            low += 7.3;
        }
        assert!(bands.shares(10.0, 20.0).is_empty());
        let grid = bands.grid();
        assert_eq!(grid.len(), 3 * names.len() + 1);
        assert!((grid[grid.len() - 1] / bands.highest() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bands_end_where_the_modes_do() {
        let reach = 1000.0 * 10f64.powf(0.05);
        assert_eq!(Bands::between(100.0, reach).expect("bands"), Bands::spanning(100.0, 1000.0));
        assert_eq!(Bands::between(100.0, reach - 0.1).expect("bands"), Bands::spanning(100.0, 800.0));
        let error = Bands::between(100.0, 105.0).expect_err("too few modes");
        assert!(error.message().contains("112.2 Hz"), "{error}");
    }
}
