//! Ends a world of ranks in which a check hangs: ranks that wait for each other would wait for ever.

use std::backtrace::Backtrace;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Processor time that no check takes a tenth of. Ranks that wait for each other use it up, however many others the
/// machine has to serve.
const MOST: f64 = 300.0;

/// The same by the clock, for ranks that sleep while they wait.
const LONGEST: Duration = Duration::from_secs(3600);

/// Processor time of this process, s; 0 where the system does not tell.
fn worked() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // PID (NAME) STATE …: times in user and system mode are the fields 14 and 15.
    let fields = stat.rsplit_once(") ").map_or("", |(_, rest)| rest).split(' ').skip(11).take(2);
    let ticks: u64 = fields.filter_map(|n| n.parse::<u64>().ok()).sum();
    ticks as f64 / rustix::param::clock_ticks_per_second() as f64
}

/// A thread that knows which check runs, and since when, by the clock and in processor time.
pub struct Watch(Arc<Mutex<(String, Instant, f64)>>);

impl Watch {
    /// `rank` stands in what is said.
    pub fn start(rank: usize) -> Self {
        let now = Arc::new(Mutex::new((String::new(), Instant::now(), worked())));
        // SAFETY: what the handler does is not safe in a signal, but the process ends right after it; without it
        // there is no word of where the rank hangs.
        let handler = unsafe {
            signal_hook::low_level::register(signal_hook::consts::SIGUSR2, move || {
                eprintln!("rank {rank} is at:\n{}", Backtrace::force_capture());
            })
        };
        handler.expect("a handler for SIGUSR2");
        let seen = Arc::clone(&now);
        std::thread::spawn(move || loop {
            std::thread::sleep(Duration::from_secs(1));
            let (name, since, before) = seen.lock().expect("name of the check").clone();
            let took = worked() - before;
            if took < MOST && since.elapsed() < LONGEST {
                continue;
            }
            eprintln!(
                "rank {rank}: {name} still runs after {} s, {took:.0} s of processor time",
                since.elapsed().as_secs()
            );
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
        *self.0.lock().expect("name of the check") = (name.into(), Instant::now(), worked());
    }
}
