//! Requests to stop: signals and the limit of wall time.

use crate::parallel::World;
use nix::sys::signal::{SigSet, Signal};
use signal_hook::consts::{SIGTERM, SIGUSR1};
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Exit code of a run that a second signal ends.
const ENDED: i32 = 5;

/// When a run has to stop.
#[derive(Debug, Clone)]
pub struct Stop {
    signal: Arc<AtomicBool>,
    limit: Option<(Instant, Duration)>,
}

impl Stop {
    /// From now on SIGUSR1 and SIGTERM no longer end the process: they are asked for between steps of the run and between segments, and a
    /// process that is `loud` says at once that they came. A second SIGTERM ends the process with exit code 5. `wall_time` s after `begun` the
    /// run has to be over. To be called before other threads are started: signals are blocked in the calling thread and in those it starts.
    pub fn listen(begun: Instant, wall_time: Option<f64>, loud: bool) -> Self {
        let signal = Arc::new(AtomicBool::new(false));
        // Before the other one: it looks whether a signal came before.
        let _ = signal_hook::flag::register_conditional_shutdown(SIGTERM, ENDED, Arc::clone(&signal));
        for number in [SIGUSR1, SIGTERM] {
            // Where a handler cannot be set the signal ends the run, and the segments stay.
            let _ = signal_hook::flag::register(number, Arc::clone(&signal));
        }
        take_in_turn(&signal);
        if loud {
            let came = Arc::clone(&signal);
            // It ends with the process; a run without it is one that says nothing.
            let _ = std::thread::Builder::new().spawn(move || {
                while !came.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_millis(100));
                }
                let text = "railsqueal: a signal came: the run stops at the end of this step, a transient at the end of a segment";
                let _ = writeln!(std::io::stderr(), "{text}");
            });
        }
        Self { signal, limit: wall_time.map(|s| (begun, Duration::from_secs_f64(s.max(0.0)))) }
    }

    /// Whether a signal came.
    pub fn signalled(&self) -> bool {
        self.signal.load(Ordering::Relaxed)
    }

    /// Collective: whether a signal came to any of the ranks.
    pub fn wanted(&self, world: &World) -> bool {
        world.max(f64::from(u8::from(self.signalled()))) > 0.0
    }

    /// As if a signal had come: it did on another rank.
    pub fn request(&self) {
        self.signal.store(true, Ordering::Relaxed);
    }

    /// Why the run has to stop now, if it has to; another segment takes about `segment`.
    pub fn asked(&self, segment: Duration) -> Option<&'static str> {
        if self.signalled() {
            return Some("on request");
        }
        // Half a segment more, since they do not all take the same time.
        let over = |&(begun, limit): &(Instant, Duration)| begun.elapsed() + segment.mul_f64(1.5) > limit;
        self.limit.as_ref().filter(|l| over(l)).map(|_| "by the limit of wall time")
    }
}

/// A thread waits for the signals, which are blocked in all others: handlers are not enough. METIS puts its own for SIGTERM in their place, takes one that
/// comes while it works for an error of its own, and leaves handlers behind that serve once.
fn take_in_turn(signal: &Arc<AtomicBool>) {
    let set = SigSet::from_iter([Signal::SIGTERM, Signal::SIGUSR1]);
    if set.thread_block().is_err() {
        return;
    }
    let came = Arc::clone(signal);
    let waiting = std::thread::Builder::new().spawn(move || {
        while let Ok(number) = set.wait() {
            if came.swap(true, Ordering::Relaxed) && number == Signal::SIGTERM {
                signal_hook::low_level::exit(ENDED);
            }
        }
    });
    if waiting.is_err() {
        // Nobody would take them.
        let _ = set.thread_unblock();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_before_the_limit_is_passed() {
        let stop = Stop { signal: Arc::default(), limit: Some((Instant::now(), Duration::from_secs(100))) };
        assert_eq!(stop.asked(Duration::from_secs(1)), None);
        assert_eq!(stop.asked(Duration::from_secs(80)), Some("by the limit of wall time"));
        stop.signal.store(true, Ordering::Relaxed);
        assert_eq!(stop.asked(Duration::from_secs(1)), Some("on request"));
    }
}
