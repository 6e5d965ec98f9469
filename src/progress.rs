//! Progress on stderr: stage, count, time. Plain lines, one a second at the most, from rank 0 only.

use std::time::{Duration, Instant};

/// Names the stages of a run as they begin and keeps the time each took, for the summary and `/provenance`.
pub struct Progress {
    loud: bool,
    start: Instant,
    last: Instant,
    current: Option<(String, Instant)>,
    times: Vec<(String, f64)>,
}

impl Progress {
    /// `loud` on the one rank that reports.
    pub fn new(loud: bool) -> Self {
        let now = Instant::now();
        Self { loud, start: now, last: now, current: None, times: Vec::new() }
    }

    /// Ends the stage before and begins `name`.
    pub fn stage(&mut self, name: impl Into<String>) {
        self.finish();
        let name = name.into();
        if self.loud {
            eprintln!("[{:8.1} s] {name}", self.start.elapsed().as_secs_f64());
        }
        self.current = Some((name, Instant::now()));
        self.last = Instant::now();
    }

    /// Within a stage: `done` of `total` steps, with the time left estimated from those done.
    pub fn step(&mut self, what: &str, done: usize, total: usize) {
        if !self.loud || self.last.elapsed() < Duration::from_secs(1) {
            return;
        }
        self.last = Instant::now();
        let Some((_, begun)) = &self.current else { return };
        let left = begun.elapsed().as_secs_f64() * (total.saturating_sub(done)) as f64 / done.max(1) as f64;
        eprintln!("[{:8.1} s]   {what} {done}/{total}, about {left:.0} s left", self.start.elapsed().as_secs_f64());
    }

    /// A remark within the stage.
    pub fn note(&self, text: impl AsRef<str>) {
        if self.loud {
            eprintln!("[{:8.1} s]   {}", self.start.elapsed().as_secs_f64(), text.as_ref());
        }
    }

    /// Ends the current stage.
    pub fn finish(&mut self) {
        if let Some((name, begun)) = self.current.take() {
            self.times.push((name, begun.elapsed().as_secs_f64()));
        }
    }

    /// Stages so far with their wall time, s.
    pub fn times(&self) -> &[(String, f64)] {
        &self.times
    }
}
