//! Requests to stop: signals and the limit of wall time.

use crate::parallel::World;
use crate::progress::end_line;
use nix::poll::{poll, PollFd, PollFlags};
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use std::io::Write;
use std::os::fd::AsFd;
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
    /// From now on SIGUSR1, SIGTERM and SIGINT (Ctrl-C) no longer end the process: they are asked for between steps of
    /// the run and between segments, and a process that is `loud` says at once that they came. A second SIGTERM or
    /// SIGINT ends the process with exit code 5. `wall_time` s after `begun` the run has to be over. To be called
    /// before other threads are started: signals are blocked in the calling thread and in those it starts.
    pub fn listen(begun: Instant, wall_time: Option<f64>, loud: bool) -> Self {
        let signal = Arc::new(AtomicBool::new(false));
        for number in ending() {
            // Before the other one: it looks whether a signal came before.
            let _ = signal_hook::flag::register_conditional_shutdown(number, ENDED, Arc::clone(&signal));
        }
        for number in ending().into_iter().chain([SIGUSR1]) {
            // Where a handler cannot be set the signal ends the run, and the segments stay.
            let _ = signal_hook::flag::register(number, Arc::clone(&signal));
        }
        look_after(&signal, loud);
        Self { signal, limit: wall_time.map(|s| (begun, Duration::from_secs_f64(s.max(0.0)))) }
    }

    /// Returns whether a signal came.
    pub(crate) fn signalled(&self) -> bool {
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

/// Signals of which a second one ends the process at once. A shell lets the programs that it starts in the background
/// ignore SIGINT, which is meant for the one in front: it stays so.
fn ending() -> Vec<i32> {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    match ignores(&status, SIGINT) {
        true => vec![SIGTERM],
        false => vec![SIGTERM, SIGINT],
    }
}

/// True if the process of a `/proc/PID/status` ignores the signal.
fn ignores(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}

/// Time between two looks at what else may have been told, ms.
const LOOK: u16 = 100;

/// A thread takes the signals, which are blocked in all others, and says so where it is `loud`. Handlers are not
/// enough: METIS puts its own for SIGTERM in their place, takes one that comes while it works for an error of its
/// own, and leaves handlers behind that serve once.
fn look_after(signal: &Arc<AtomicBool>, loud: bool) {
    let ending = ending();
    let mut set = SigSet::from_iter([Signal::SIGTERM, Signal::SIGUSR1]);
    if ending.contains(&SIGINT) {
        set.add(Signal::SIGINT);
    }
    let queue = SignalFd::with_flags(&set, SfdFlags::SFD_NONBLOCK | SfdFlags::SFD_CLOEXEC).ok();
    let queue = queue.filter(|_| set.thread_block().is_ok());
    let came = Arc::clone(signal);
    // It ends with the process, and takes no memory of its own: that would cost an arena of the allocator.
    let begun = std::thread::Builder::new().spawn(move || {
        let mut said = !loud;
        loop {
            while let Some(taken) = queue.as_ref().and_then(|q| q.read_signal().ok().flatten()) {
                if came.swap(true, Ordering::Relaxed) && ending.iter().any(|&s| taken.ssi_signo == s as u32) {
                    if loud {
                        let text =
                            "railsqueal: error: ended at once by a second signal; what was kept can be taken up \
                                    (--resume, --reuse)";
                        end_line();
                        let _ = writeln!(std::io::stderr(), "{text}");
                    }
                    signal_hook::low_level::exit(ENDED);
                }
            }
            // Also where a handler, or another rank, was told.
            if !said && came.load(Ordering::Relaxed) {
                let text =
                    "railsqueal: a signal came: the run stops at the end of this step, a transient at the end of a \
                            segment; a second SIGTERM or Ctrl-C ends it at once";
                end_line();
                let _ = writeln!(std::io::stderr(), "{text}");
                said = true;
            }
            // At once where a signal comes: it counts from then on.
            match &queue {
                Some(queue) => drop(poll(&mut [PollFd::new(queue.as_fd(), PollFlags::POLLIN)], LOOK)),
                None => std::thread::sleep(Duration::from_millis(LOOK.into())),
            }
        }
    });
    if begun.is_err() {
        // Nobody would take them.
        let _ = set.thread_unblock();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_known() {
        let status = "Name:\ta\nSigIgn:\t0000000000001002\nSigCgt:\t00000001000044ff\n";
        assert!(ignores(status, SIGINT) && !ignores(status, SIGTERM) && !ignores("", SIGINT));
    }

    #[test]
    fn stops_before_the_limit_is_passed() {
        let stop = Stop { signal: Arc::default(), limit: Some((Instant::now(), Duration::from_secs(100))) };
        assert_eq!(stop.asked(Duration::from_secs(1)), None);
        assert_eq!(stop.asked(Duration::from_secs(80)), Some("by the limit of wall time"));
        stop.signal.store(true, Ordering::Relaxed);
        assert_eq!(stop.asked(Duration::from_secs(1)), Some("on request"));
    }
}
