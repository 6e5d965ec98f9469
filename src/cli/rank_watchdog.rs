//! Ranks that are killed or stopped: the others would wait for them in a collective call for ever. On each node every
//! rank looks after the next one.

use mpi::traits::{Communicator, CommunicatorCollectives};
use railsqueal::parallel::World;
use std::io::Write;
use std::time::{Duration, Instant};

/// A rank that does nothing for so long, without doing so together with the others, is lost.
const PATIENCE: Duration = Duration::from_secs(10);
/// Time between two looks.
const LOOK: Duration = Duration::from_millis(500);
/// Exit code of ranks that lost another one: as where reading or writing fails.
const LOST: i32 = 6;

/// Collective: from now on the run ends, with the reason, where a rank on this node is killed or stopped while the
/// others go on. A node with one rank has nobody to look.
pub fn watch(world: &World) {
    let node = world.comm.split_shared(world.rank as i32);
    let size = node.size() as usize;
    let mine = [world.rank as u64, u64::from(std::process::id())];
    let mut all = vec![0u64; 2 * size];
    node.all_gather_into(&mine[..], &mut all[..]);
    if size < 2 {
        return;
    }
    let next = (node.rank() as usize + 1) % size;
    let (rank, process) = (all[2 * next], all[2 * next + 1]);
    // It ends with the process; where no thread can be had the launcher alone looks after the ranks.
    let _ = std::thread::Builder::new().spawn(move || {
        let mut since: Option<Instant> = None;
        let mut last = Instant::now();
        loop {
            std::thread::sleep(LOOK);
            // All ranks may be stopped together, and go on together: the time that this one slept does not count.
            let slept = last.elapsed() > 4 * LOOK;
            last = Instant::now();
            let Some(how) = fate(&std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default()) else {
                since = None;
                continue;
            };
            let begun = *since.get_or_insert(last);
            if slept {
                since = Some(last);
            } else if begun.elapsed() > PATIENCE {
                let _ = writeln!(
                    std::io::stderr(),
                    "railsqueal: error: rank {rank} (process {process}) {how} for {} s while the others wait \
                     for it: the run ends; what was kept can be \
                     taken up (--resume, --reuse)",
                    PATIENCE.as_secs()
                );
                std::process::exit(LOST);
            }
        }
    });
}

/// End of a process, by its line in `/proc/PID/stat`, empty where there is none; `None` if it is at work.
fn fate(stat: &str) -> Option<&'static str> {
    // PID (NAME) STATE …
    match stat.rsplit_once(") ").map_or("", |(_, rest)| rest).chars().next() {
        None | Some('Z' | 'X') => Some("has been dead"),
        Some('T') => Some("has been stopped"),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_at_work_stopped_or_dead() {
        for (stat, how) in [
            ("12 (rail squeal) R 1 12 12", None),
            ("12 (a) T) S 1 12", None),
            ("12 (railsqueal) T 1 12", Some("has been stopped")),
            ("12 (railsqueal) Z 1 12", Some("has been dead")),
            ("", Some("has been dead")),
        ] {
            assert_eq!(fate(stat), how, "{stat}");
        }
        let own = std::fs::read_to_string("/proc/self/stat").expect("of this process");
        assert_eq!(fate(&own), None);
    }
}
