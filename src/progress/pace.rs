//! Pace of a count of equal pieces of work, and the time that is left.

/// Samples that are kept at most.
const SAMPLES: usize = 128;

/// Counts of one stage with their times, s.
#[derive(Debug, Default)]
pub(super) struct Pace {
    what: String,
    total: usize,
    /// Done, and when; the first sample is the begin.
    samples: Vec<(usize, f64)>,
    /// True once the total has changed: then it says nothing of the work that is left.
    uncertain: bool,
}

impl Pace {
    /// Takes a count at the time `now`, s, of a stage that began at `begun`; returns the time that is left, s. None
    /// before anything is done, at the end, and where the total changes on the way.
    pub(super) fn left(&mut self, what: &str, (done, total): (usize, usize), begun: f64, now: f64) -> Option<f64> {
        if self.samples.is_empty() {
            self.restart(what, total, (0, begun));
        } else if what != self.what || done < self.samples.last().map_or(0, |s| s.0) {
            // What was done before it began is not known.
            self.restart(what, total, (done, now));
        } else if total != self.total {
            (self.uncertain, self.total) = (true, total);
        }
        if self.samples.len() == SAMPLES {
            let mut number = 0;
            self.samples.retain(|_| {
                number += 1;
                number % 2 == 1
            });
        }
        self.samples.push((done, now));
        let (first, begin) = self.samples[0];
        if self.uncertain || done >= total || done <= first || now <= begin {
            return None;
        }
        // Pieces done lately tell more than the first ones, as of points of which some were known already.
        let middle = begin + 0.5 * (now - begin);
        let before = |s: &&(usize, f64)| s.1 <= middle && s.0 < done;
        let from = self.samples.iter().rev().find(before).map_or(first, |s| s.0);
        // The work on the next piece began when the count was first seen.
        let since = self.samples.iter().find(|s| s.0 == from).map_or(begin, |s| s.1);
        Some((now - since) * (total - done) as f64 / (done - from) as f64)
    }

    fn restart(&mut self, what: &str, total: usize, begin: (usize, f64)) {
        *self = Self { what: what.to_owned(), total, samples: vec![begin], uncertain: false };
    }
}

/// A time in words.
pub(super) fn words(seconds: f64) -> String {
    match seconds {
        s if s < 1.0 => "less than 1 s".into(),
        s if s < 120.0 => format!("about {s:.0} s"),
        s if s < 7200.0 => format!("about {:.0} min", s / 60.0),
        s => {
            let minutes = (s / 60.0).round() as u64;
            format!("about {} h {} min", minutes / 60, minutes % 60)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pieces_are_foreseen_exactly() {
        let mut pace = Pace::default();
        for done in 1..20 {
            let left = pace.left("points", (done, 20), 100.0, 100.0 + 3.0 * done as f64).expect("an estimate");
            assert!((left - 3.0 * (20 - done) as f64).abs() < 1e-9, "{done}: {left}");
        }
        assert_eq!(pace.left("points", (20, 20), 100.0, 160.0), None);
    }

    #[test]
    fn nothing_done_says_nothing() {
        let mut pace = Pace::default();
        assert_eq!(pace.left("modes", (0, 23), 0.0, 32.0), None);
        assert_eq!(pace.left("modes", (0, 23), 0.0, 64.0), None);
        // The time without any counts.
        assert_eq!(pace.left("modes", (1, 23), 0.0, 96.0), Some(96.0 * 22.0));
    }

    #[test]
    fn a_total_that_grows_says_nothing() {
        let mut pace = Pace::default();
        let all: Vec<Option<f64>> = (1..12).map(|k| pace.left("orders", (k, k + 1), 0.0, k as f64)).collect();
        assert_eq!(all[1..], [None; 10]);
    }

    /// The first half is known from an earlier run and takes no time.
    #[test]
    fn the_estimate_follows_the_pace_of_late() {
        let mut pace = Pace::default();
        assert_eq!(pace.left("limit cycles", (50, 100), 0.0, 0.001).map(|s| s < 1.0), Some(true));
        let times = (1..=40).map(|k| (50 + k, 10.0 * k as f64));
        let last = times.map(|(done, now)| (done, pace.left("limit cycles", (done, 100), 0.0, now))).last();
        let (done, left) = last.expect("some");
        let (left, want) = (left.expect("an estimate"), 10.0 * (100 - done) as f64);
        assert!((left / want - 1.0).abs() < 0.1, "{left} s, {want} s are left");
    }

    /// Another count in the same stage begins anew, and thousands of samples do not harm.
    #[test]
    fn counts_follow_each_other() {
        let mut pace = Pace::default();
        pace.left("points", (10, 10), 0.0, 1000.0);
        assert_eq!(pace.left("limit cycles", (1, 4), 0.0, 1010.0), None);
        assert_eq!(pace.left("limit cycles", (2, 4), 0.0, 1020.0), Some(20.0));
        let mut long = Pace::default();
        let mut worst: f64 = 0.0;
        for done in 1..10_000usize {
            let left = long.left("steps", (done, 10_000), 0.0, 0.25 * done as f64).expect("an estimate");
            worst = worst.max((left - 0.25 * (10_000 - done) as f64).abs());
        }
        assert!(worst < 1e-6 && long.samples.len() <= SAMPLES && long.samples[0] == (0, 0.0), "{worst}");
    }

    #[test]
    fn times_are_told_in_fitting_units() {
        let said = [0.2, 45.3, 705.0, 20_000.0].map(words);
        assert_eq!(said, ["less than 1 s", "about 45 s", "about 12 min", "about 5 h 33 min"]);
    }
}
