//! Ends a world of ranks in which a check hangs: ranks that wait for each other would wait for ever.

use std::backtrace::Backtrace;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// No check takes a tenth of it.
const MOST: Duration = Duration::from_secs(300);

/// A thread that knows which check runs, and since when.
pub struct Watch(Arc<Mutex<(String, Instant)>>);

impl Watch {
    /// `rank` stands in what is said.
    pub fn start(rank: usize) -> Self {
        let now = Arc::new(Mutex::new((String::new(), Instant::now())));
        // SAFETY: what the handler does is not safe in a signal, but the process ends right after it; without it there is no word of where the rank hangs.
        let handler = unsafe {
            signal_hook::low_level::register(signal_hook::consts::SIGUSR2, move || {
                eprintln!("rank {rank} is at:\n{}", Backtrace::force_capture());
            })
        };
        handler.expect("a handler for SIGUSR2");
        let seen = Arc::clone(&now);
        std::thread::spawn(move || loop {
            std::thread::sleep(Duration::from_secs(1));
            let (name, since) = seen.lock().expect("name of the check").clone();
            if since.elapsed() < MOST {
                continue;
            }
            eprintln!("rank {rank}: {name} still runs after {} s", MOST.as_secs());
            // To the first thread, which runs the checks.
            let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::USR2);
            // The other ranks say it too.
            std::thread::sleep(Duration::from_secs(10));
            std::process::abort();
        });
        Self(now)
    }

    /// From now on this check runs.
    pub fn begins(&self, name: &str) {
        *self.0.lock().expect("name of the check") = (name.into(), Instant::now());
    }
}
