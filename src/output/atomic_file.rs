//! The temporary file: made beside the final name, its disk space reserved, renamed at the end or removed.

use super::overwrite_policy::replaceable;
use crate::parallel::World;
use crate::{Error, Result};
use rustix::fs::FallocateFlags;
use rustix::io::Errno;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A file being written. Dropping it without [`Partial::publish`] removes it.
#[derive(Debug)]
pub(super) struct Partial {
    /// Temporary name, the same on all ranks.
    pub(super) path: PathBuf,
    /// Final name.
    pub(super) target: PathBuf,
    owner: bool,
    published: bool,
}

/// Collective: fails early, before hours of work, where the results could not be written in the end.
pub(super) fn check_target(world: &World, target: &Path, overwrite: bool) -> Result<()> {
    ignore_file_size_signal();
    let check = || {
        replaceable(target, overwrite)?;
        let probe = temporary_name(target);
        let made = fs::OpenOptions::new().write(true).create_new(true).open(&probe);
        made.map_err(|e| failure(target, &e))?;
        fs::remove_file(&probe).map_err(|e| failure(target, &e))
    };
    world.on_root(check).map(|_| ())
}

impl Partial {
    /// Collective: names the temporary file of `target`. It is not made yet.
    pub(super) fn new(world: &World, target: &Path) -> Result<Self> {
        use std::os::unix::ffi::{OsStrExt, OsStringExt};
        let name = if world.is_root() { temporary_name(target).as_os_str().as_bytes().to_vec() } else { Vec::new() };
        let path = PathBuf::from(std::ffi::OsString::from_vec(world.broadcast(name)));
        Ok(Self { path, target: target.to_owned(), owner: world.is_root(), published: false })
    }

    /// On one rank alone: the same.
    pub(super) fn alone(target: &Path) -> Self {
        Self { path: temporary_name(target), target: target.to_owned(), owner: true, published: false }
    }

    /// On rank 0: fails where a file of `bytes` could not be made. HDF5 1.10 does not survive a failure while it
    /// closes a file, so what can be known is known before.
    pub(super) fn probe(&self, bytes: u64) -> Result<()> {
        let made = fs::OpenOptions::new().write(true).create_new(true).open(&self.path);
        drop(made.map_err(|e| failure(&self.target, &e))?);
        let room = self.reserve(bytes);
        room.and(fs::remove_file(&self.path).map_err(|e| failure(&self.target, &e)))
    }

    /// On rank 0: lengthens the file to `bytes`, with the disk space for them, and fails where there is none. HDF5
    /// cuts off what it did not need when it closes the file.
    pub(super) fn reserve(&self, bytes: u64) -> Result<()> {
        let file = fs::OpenOptions::new().write(true).open(&self.path).map_err(|e| failure(&self.target, &e))?;
        match rustix::fs::fallocate(&file, FallocateFlags::empty(), 0, bytes.max(1)) {
            Ok(()) => Ok(()),
            Err(Errno::NOTSUP | Errno::NOSYS | Errno::INVAL) => self.check_free(bytes),
            Err(e) => Err(failure(&self.target, &std::io::Error::from(e))),
        }
    }

    /// The weaker check, for file systems that cannot reserve.
    fn check_free(&self, bytes: u64) -> Result<()> {
        let have = fs::metadata(&self.path).map(|m| m.len()).unwrap_or(0);
        let missing = bytes.saturating_sub(have);
        match rustix::fs::statvfs(&self.path) {
            Ok(s) if s.f_bavail.saturating_mul(s.f_frsize) < missing => {
                Err(failure(&self.target, &std::io::Error::from(Errno::NOSPC)))
            }
            _ => Ok(()),
        }
    }

    /// On rank 0: brings the file to the disk.
    pub(super) fn sync(&self) -> Result<()> {
        fs::File::open(&self.path).and_then(|f| f.sync_all()).map_err(|e| failure(&self.target, &e))
    }

    /// On rank 0: brings the file to the disk and gives it its final name.
    pub(super) fn publish(&mut self) -> Result<()> {
        self.sync()?;
        fs::rename(&self.path, &self.target).map_err(|e| failure(&self.target, &e))?;
        self.published = true;
        Ok(())
    }

    /// On rank 0: leaves the file under a name of its own where another run has written under its name; returns the
    /// error that says so.
    pub(super) fn aside(&mut self) -> Error {
        let name = self.target.display().to_string();
        self.target = super::companion(&self.target, &format!("{}.h5", std::process::id()));
        match self.publish() {
            Err(e) => e,
            Ok(()) => Error::Io(format!(
                "{name} was written by another run since this one began, and is not replaced; the results of \
                 this one are in {}, without \
                 the files beside it. Name an --output for each run",
                self.target.display()
            )),
        }
    }

    /// An HDF5 error as the error of the run.
    pub(super) fn hdf5_error(&self, doing: &str, e: &hdf5::Error) -> Error {
        let all = format!("{e:?}");
        for errno in [Errno::NOSPC, Errno::FBIG, Errno::DQUOT, Errno::IO] {
            let cause = std::io::Error::from(errno);
            if all.contains(&format!("errno = {}", errno.raw_os_error())) {
                return failure(&self.target, &cause);
            }
        }
        Error::Io(format!(
            "cannot write {}: HDF5 failed while {doing}: {e}; check the directory and the free space, or name \
             another --output",
            self.target.display()
        ))
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if self.owner && !self.published {
            // Nothing better can be done in a failing run; the next one sweeps what is left.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// A failure of the operating system, with what to do about it.
pub(super) fn failure(target: &Path, e: &std::io::Error) -> Error {
    let advice = match e.raw_os_error().map(Errno::from_raw_os_error) {
        Some(Errno::NOSPC | Errno::DQUOT) => "free space there, or name another --output",
        Some(Errno::FBIG) => "raise the file size limit (ulimit -f), or write fewer fields",
        Some(Errno::NOENT | Errno::NOTDIR) => "make the directory, or name another --output",
        Some(Errno::ACCESS | Errno::PERM | Errno::ROFS) => "name an --output in a directory you may write to",
        _ => "check the file system, or name another --output",
    };
    Error::Io(format!("cannot write {}: {e}; {advice}", target.display()))
}

/// A process that passes the file size limit is killed by SIGXFSZ unless it handles the signal; then the write fails
/// instead, which is an error like any other.
fn ignore_file_size_signal() {
    use std::sync::{atomic::AtomicBool, Arc, Once};
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // If it cannot be registered the limit kills the run, as it would any program.
        let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false)));
    });
}

fn host() -> String {
    rustix::system::uname().nodename().to_string_lossy().replace('/', "_")
}

fn prefix(target: &Path) -> String {
    let name = target.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    format!(".{name}.{}-", host())
}

fn directory(target: &Path) -> PathBuf {
    match target.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// `.NAME.HOST-PID.partial` in the directory of the target.
fn temporary_name(target: &Path) -> PathBuf {
    directory(target).join(format!("{}{}.partial", prefix(target), std::process::id()))
}

/// Unfinished files of a target that earlier runs have left.
#[derive(Debug, Default)]
pub struct UnfinishedFiles {
    /// Files that were removed.
    pub removed: Vec<PathBuf>,
    /// Files of other hosts, where a run may be at work.
    pub elsewhere: Vec<PathBuf>,
}

/// Removes what killed runs on this host have left of the same target.
pub(super) fn sweep(target: &Path) {
    clear(target, false, &mut UnfinishedFiles::default());
}

/// Age from which a file of a process that lives is one of an earlier process of the same number, under a lock on the
/// target. A run that has no lock yet has such a file for a moment, to see that it can write.
const OLD: Duration = Duration::from_secs(60);

/// Removes what runs on this host have left of `target` whose processes are gone; with a `lock` on the target also what
/// is older than [`OLD`], where their number is that of another process now. Adds all to `found`.
pub(super) fn clear(target: &Path, lock: bool, found: &mut UnfinishedFiles) {
    let Ok(entries) = fs::read_dir(directory(target)) else { return };
    let name = target.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    for entry in entries.flatten() {
        let file = entry.file_name().to_string_lossy().into_owned();
        let Some((owner, rest)) = file.strip_prefix(&format!(".{name}.")).and_then(|r| r.rsplit_once(".partial"))
        else {
            continue;
        };
        // MPI-IO has a file of its own beside each that it writes.
        let lock_file = rest.starts_with('-') && rest.ends_with(".lock");
        if !rest.is_empty() && !lock_file {
            continue;
        }
        let Some((owner, pid)) = owner.rsplit_once('-') else { continue };
        let Some(pid) = pid.parse::<i32>().ok().and_then(rustix::process::Pid::from_raw) else { continue };
        let written = entry.metadata().and_then(|m| m.modified()).ok();
        let old = written.and_then(|w| w.elapsed().ok()).is_some_and(|age| age > OLD);
        if owner != host() {
            found.elsewhere.push(entry.path());
        } else if ((lock && old) || rustix::process::test_kill_process(pid) == Err(Errno::SRCH))
            && fs::remove_file(entry.path()).is_ok()
        {
            found.removed.push(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    /// Files of dead processes go, of living ones only with a lock and where they are old, of other hosts and other
    /// targets never.
    #[test]
    fn what_dead_runs_left_is_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("run.h5");
        let made = |name: &str, host: &str, pid: u32| {
            let path = folder.path().join(format!(".{name}.{host}-{pid}.partial"));
            fs::write(&path, "unfinished").expect("write");
            path
        };
        let mut ended = std::process::Command::new("true").spawn().expect("a process");
        ended.wait().expect("its end");
        let living = made("run.h5", &host(), std::process::id());
        let other = made("other.h5", &host(), ended.id());
        let elsewhere = made("run.h5", "node-17.cluster", ended.id());
        let beside = folder.path().join(format!(".run.h5.{}-{}.partial-1-{1}.lock", host(), std::process::id()));
        fs::write(&beside, "").expect("write");
        let age = |path: &Path, seconds: u64| {
            let file = fs::OpenOptions::new().write(true).open(path).expect("open");
            file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).expect("a time");
        };
        // A run that is about to claim the target sees whether it can write: its file stays.
        let mut found = UnfinishedFiles::default();
        clear(&target, true, &mut found);
        assert!(found.removed.is_empty() && living.exists() && beside.exists(), "{found:?}");
        [&living, &beside].iter().for_each(|path| age(path, 3600));
        for (lock, gone) in [(false, vec![made("run.h5", &host(), ended.id())]), (true, vec![living.clone(), beside])] {
            let mut found = UnfinishedFiles::default();
            clear(&target, lock, &mut found);
            found.removed.sort();
            assert_eq!(found.removed, gone);
            assert_eq!(found.elsewhere, std::slice::from_ref(&elsewhere));
            assert!(gone.iter().all(|path| !path.exists()) && elsewhere.exists() && other.exists());
            assert_eq!(living.exists(), !lock);
        }
    }
}
