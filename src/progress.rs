//! Progress on stderr: stage, count, time. Plain lines from rank 0 only; counts once a second at the most on a
//! terminal, once in half a minute in a log.

use crate::error::printable;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Names the stages of a run as they begin and keeps the time each took, for the summary and `/provenance`.
pub struct Progress {
    loud: bool,
    /// Least time between two counts.
    interval: Duration,
    start: Instant,
    last: Instant,
    current: Option<(String, Instant)>,
    times: Vec<(String, f64)>,
}

impl Progress {
    /// `loud` on the one rank that reports.
    pub fn new(loud: bool) -> Self {
        let now = Instant::now();
        let interval = Duration::from_secs(if std::io::stderr().is_terminal() { 1 } else { 30 });
        Self { loud, interval, start: now, last: now, current: None, times: Vec::new() }
    }

    /// Ends the stage before and begins `name`.
    pub fn stage(&mut self, name: impl Into<String>) {
        self.finish();
        let name = name.into();
        if self.loud {
            self.say(&format!(" {name}"));
        }
        self.current = Some((name, Instant::now()));
        self.last = Instant::now();
    }

    /// Within a stage: `done` of `total` steps, with the time left estimated from those done.
    pub fn step(&mut self, what: &str, done: usize, total: usize) {
        if !self.loud || self.last.elapsed() < self.interval {
            return;
        }
        self.last = Instant::now();
        let Some((_, begun)) = &self.current else { return };
        let left = begun.elapsed().as_secs_f64() * (total.saturating_sub(done)) as f64 / done.max(1) as f64;
        self.say(&format!("   {what} {done}/{total}, about {left:.0} s left"));
    }

    /// A remark within the stage.
    pub fn note(&self, text: impl AsRef<str>) {
        if self.loud {
            self.say(&format!("   {}", text.as_ref()));
        }
    }

    /// A line behind the time since the start. One that cannot be written is lost, the run goes on.
    fn say(&self, text: &str) {
        let text = printable(text);
        let _ = writeln!(std::io::stderr(), "[{:8.1} s]{text}", self.start.elapsed().as_secs_f64());
    }

    /// Ends the current stage. Times of a stage that comes again, as those of the points of a sweep do, add up.
    pub fn finish(&mut self) {
        let Some((name, begun)) = self.current.take() else { return };
        let time = begun.elapsed().as_secs_f64();
        match self.times.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += time,
            None => self.times.push((name, time)),
        }
    }

    /// Stages so far, in the order of their first beginnings, each once, with their wall time, s.
    pub fn times(&self) -> &[(String, f64)] {
        &self.times
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All time from the first stage on is that of one of the stages.
    #[test]
    fn times_of_repeated_stages_add_up() {
        let mut progress = Progress::new(false);
        let begun = Instant::now();
        let mut single: f64 = 0.0;
        for _ in 0..50 {
            for name in ["points", "modes"] {
                let before = Instant::now();
                progress.stage(name);
                std::hint::black_box((0..2000).map(f64::from).sum::<f64>());
                progress.finish();
                single = single.max(before.elapsed().as_secs_f64());
            }
        }
        let whole = begun.elapsed().as_secs_f64();
        let names: Vec<&str> = progress.times().iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["points", "modes"]);
        let sum: f64 = progress.times().iter().map(|(_, time)| time).sum();
        assert!(sum <= whole && sum > single, "{sum} s of {whole} s, one stage {single} s");
    }
}
