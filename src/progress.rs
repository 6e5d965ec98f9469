//! Progress on stderr: stage, count, time, from rank 0 only. On a terminal a count rewrites its line; elsewhere counts
//! are plain lines, one in half a minute at most.

mod pace;

use crate::error::printable;
use pace::Pace;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Least times between two counts on a terminal and in a log.
const INTERVALS: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(30)];
/// Moves a terminal to the begin of its line and clears it.
const CLEAR: &str = "\r\x1b[2K";

/// True while a count stands on the last line of the terminal, which has no end yet.
static OPEN: AtomicBool = AtomicBool::new(false);

/// Ends the line of a count on the terminal, before anything else is written there.
pub fn end_line() {
    if OPEN.swap(false, Ordering::Relaxed) {
        let _ = writeln!(std::io::stderr());
    }
}

/// Names the stages of a run as they begin and keeps the time each took, for the summary and `/provenance`.
pub struct Progress {
    loud: bool,
    /// True if counts rewrite their line.
    terminal: bool,
    start: Instant,
    last: Instant,
    current: Option<(String, Instant)>,
    pace: Pace,
    times: Vec<(String, f64)>,
}

impl Progress {
    /// `loud` on the one rank that reports.
    pub fn new(loud: bool) -> Self {
        let now = Instant::now();
        let terminal = std::io::stderr().is_terminal();
        Self { loud, terminal, start: now, last: now, current: None, pace: Pace::default(), times: Vec::new() }
    }

    /// Ends the stage before and begins `name`.
    pub fn stage(&mut self, name: impl Into<String>) {
        self.finish();
        let name = name.into();
        if self.loud {
            self.say(&format!(" {name}"), false);
        }
        self.current = Some((name, Instant::now()));
        self.pace = Pace::default();
        self.last = Instant::now();
    }

    /// Within a stage: `done` of `total` pieces of work that take equal times, with the time left estimated from those
    /// done.
    pub fn step(&mut self, what: &str, done: usize, total: usize) {
        let Some((_, begun)) = self.current.as_ref().filter(|_| self.loud) else { return };
        let since = |time: Instant| (time - self.start).as_secs_f64();
        // Also a count that is not told is one to go by, the first one of its kind above all.
        let left = self.pace.left(what, (done, total), since(*begun), since(Instant::now()));
        if !self.is_due() {
            return;
        }
        self.say(&format!("   {}", count(what, done, total, left)), true);
    }

    /// Within a stage: `done` of `total` that were found so far, which do not come at a steady pace; 0 where the total
    /// is not known.
    pub fn converged(&mut self, what: &str, done: usize, total: usize) {
        if self.is_due() && self.current.is_some() {
            self.say(&format!("   {}", count(what, done, total, None)), true);
        }
    }

    /// True once in an interval.
    fn is_due(&mut self) -> bool {
        let due = self.loud && self.last.elapsed() >= INTERVALS[usize::from(!self.terminal)];
        if due {
            self.last = Instant::now();
        }
        due
    }

    /// A remark within the stage.
    pub fn note(&self, text: impl AsRef<str>) {
        if self.loud {
            self.say(&format!("   {}", text.as_ref()), false);
        }
    }

    /// A line behind the time since the start; of a `count` one that the next line replaces on a terminal. One that
    /// cannot be written is lost, the run goes on.
    fn say(&self, text: &str, count: bool) {
        let text = format!("[{:8.1} s]{}", self.start.elapsed().as_secs_f64(), printable(text));
        let open = count && self.terminal;
        let replaces = OPEN.swap(open, Ordering::Relaxed);
        let _ = std::io::stderr().write_all(line(&text, replaces, open).as_bytes());
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

impl Drop for Progress {
    /// Ends the line of progress, so that the next output begins on its own.
    fn drop(&mut self) {
        if self.loud {
            end_line();
        }
    }
}

/// A count in words.
fn count(what: &str, done: usize, total: usize, left: Option<f64>) -> String {
    match (total, left) {
        (0, _) => format!("{what} {done}"),
        (_, None) => format!("{what} {done}/{total}"),
        (_, Some(left)) => format!("{what} {done}/{total}, {} left", pace::words(left)),
    }
}

/// Characters of a line: it `replaces` the last one on a terminal, and stays `open` for the next one.
fn line(text: &str, replaces: bool, open: bool) -> String {
    format!("{}{text}{}", if replaces { CLEAR } else { "" }, if open { "" } else { "\n" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_replace_each_other_on_a_terminal_and_are_lines_elsewhere() {
        let counted = count("points", 3, 20, Some(45.3));
        assert_eq!(counted, "points 3/20, about 45 s left");
        assert_eq!([count("modes", 0, 23, None), count("modes", 12, 0, None)], ["modes 0/23", "modes 12"]);
        let terminal = [line(&counted, false, true), line(&counted, true, true), line("stage", true, false)].concat();
        assert_eq!(terminal, format!("{counted}{CLEAR}{counted}{CLEAR}stage\n"));
        assert_eq!(line(&counted, false, false), format!("{counted}\n"));
    }

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
