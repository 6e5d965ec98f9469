//! Memory that may be used, from the kernel, the control groups and the limits of the process, and whether there is
//! so much of it now.

/// Memory that may be used, and who says so.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Byte.
    pub bytes: f64,
    /// Source of the figure, for messages.
    pub source: String,
}

impl Limit {
    /// On this node: the limit that a job sets, or else what the system and the control groups leave.
    pub fn or_system(given: Option<f64>) -> Limit {
        match given {
            Some(bytes) => Limit { bytes, source: "solver.memory_limit".into() },
            None => Limit::of_system(),
        }
    }

    /// Address space that this process may still add (`ulimit -v`); infinite without such a limit.
    pub fn of_process() -> Limit {
        let pages = std::fs::read_to_string("/proc/self/statm").ok();
        let used = pages.as_deref().and_then(|t| number(t.split(' ').next()?)).unwrap_or(0.0);
        let most = rustix::process::getrlimit(rustix::process::Resource::As).current;
        let bytes = most.map_or(f64::INFINITY, |n| (n as f64 - used * rustix::param::page_size() as f64).max(0.0));
        Limit { bytes, source: "the limit of the address space (ulimit -v)".into() }
    }

    /// Free part of the swap, byte: a run that needs it is slow, and runs.
    pub fn swap() -> f64 {
        std::fs::read_to_string("/proc/meminfo").ok().as_deref().and_then(|t| kibibytes(t, "SwapFree:")).unwrap_or(0.0)
    }

    /// The least of the memory the kernel calls available and what is left in the control group of this process and
    /// those above it.
    pub(crate) fn of_system() -> Limit {
        let read = |path: &str| std::fs::read_to_string(path).ok();
        let mut limit = Limit { bytes: f64::INFINITY, source: "the system".into() };
        if let Some(bytes) = read("/proc/meminfo").as_deref().and_then(mem_available) {
            limit = Limit { bytes, source: "the system (MemAvailable)".into() };
        }
        for (max, used) in control_groups(&read("/proc/self/cgroup").unwrap_or_default()) {
            let (Some(max), Some(used)) = (read(&max).and_then(|t| number(&t)), read(&used).and_then(|t| number(&t)))
            else {
                continue;
            };
            // Without a limit version 1 shows a number near 2^63.
            if max < 1e18 && max - used < limit.bytes {
                limit = Limit { bytes: (max - used).max(0.0), source: "the control group of this process".into() };
            }
        }
        limit
    }
}

/// From here on this process gets no more than so many bytes beside the memory that it can write to now; more is
/// refused as if there were none. Its next call counts anew. Where the system does not say what the process has,
/// nothing is limited.
pub(crate) fn confine(bytes: u64) {
    use rustix::process::{getrlimit, setrlimit, Resource, Rlimit};
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let Some(used) = kibibytes(&status, "VmData:") else { return };
    // Not the address space: the C library sets much of it aside for each thread and uses little.
    let maximum = getrlimit(Resource::Data).maximum;
    let wanted = (used as u64).saturating_add(bytes);
    let current = Some(maximum.map_or(wanted, |most| wanted.min(most)));
    let _ = setrlimit(Resource::Data, Rlimit { current, maximum });
}

/// Returns whether the last call of the system or the C library that failed, on this thread, got no memory.
pub fn refused() -> bool {
    std::io::Error::last_os_error().kind() == std::io::ErrorKind::OutOfMemory
}

/// Asks the system for so many bytes in one piece and gives them back; what it says where it refuses.
pub fn reserve(bytes: f64) -> Result<(), String> {
    let mut piece: Vec<u8> = Vec::new();
    let size = bytes.clamp(0.0, isize::MAX as f64) as usize;
    allocator::asking(|| piece.try_reserve_exact(size)).map_err(|_| {
        let (process, system) = (Limit::of_process(), Limit::of_system());
        let limit = if process.bytes < system.bytes { process } else { system };
        let (refused, left) = (bytes / 1e6, limit.bytes / 1e6);
        format!("the system refuses {refused:.0} MB; {} leaves {left:.0} MB", limit.source)
    })
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok()
}

/// MemAvailable of /proc/meminfo, byte.
fn mem_available(text: &str) -> Option<f64> {
    kibibytes(text, "MemAvailable:")
}

/// The entry `name` of /proc/meminfo, or of /proc/self/status, byte.
fn kibibytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find(|l| l.starts_with(name))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024.0)
}

/// Files with the limit and the use of the memory control groups of this process, from its own upwards (versions 1
/// and 2).
fn control_groups(text: &str) -> Vec<(String, String)> {
    let mut files = Vec::new();
    for line in text.lines() {
        let mut fields = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(path)) = (fields.next(), fields.next(), fields.next()) else { continue };
        let (root, max, used) = if controllers.is_empty() {
            ("/sys/fs/cgroup", "memory.max", "memory.current")
        } else if controllers.split(',').any(|c| c == "memory") {
            ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes")
        } else {
            continue;
        };
        let mut path = path.trim_end_matches('/');
        loop {
            files.push((format!("{root}{path}/{max}"), format!("{root}{path}/{used}")));
            match path.rfind('/') {
                Some(at) => path = &path[..at],
                None => break,
            }
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_files_are_read() {
        let text = "MemTotal:       32861560 kB\nMemAvailable:    1024 kB\n";
        assert_eq!(mem_available(text), Some(1048576.0));
        assert_eq!(mem_available("nothing"), None);
        let two: Vec<String> = control_groups("0::/user/job\n").into_iter().map(|f| f.0).collect();
        assert_eq!(
            two,
            ["/sys/fs/cgroup/user/job/memory.max", "/sys/fs/cgroup/user/memory.max", "/sys/fs/cgroup/memory.max"]
        );
        let one = control_groups("12:cpu,cpuacct:/a\n5:memory:/b\n");
        assert_eq!(one[0].1, "/sys/fs/cgroup/memory/b/memory.usage_in_bytes");
        assert_eq!(one.len(), 2);
        assert!(Limit::of_system().bytes > 0.0 && Limit::of_process().bytes > 0.0);
    }

    #[test]
    fn what_the_system_does_not_give_is_an_error() {
        assert_eq!(reserve(1e6), Ok(()));
        // More than an address has bits for.
        let error = reserve(1e18).expect_err("an exabyte");
        assert!(error.contains("refuses 1000000000000 MB") && error.contains("leaves"), "{error}");
    }
}
