//! The claim of a run on its result file: no two runs write to one name at once, and what came under the name since the
//! run began is not replaced.

use super::atomic_file::failure;
use crate::{Error, Result};
use rustix::fs::{flock, FlockOperation};
use rustix::io::Errno;
use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::Duration;

/// How long a claim waits for another process to end, and how often it looks: one that was killed goes in a moment.
const PATIENCE: Duration = Duration::from_secs(5);
const PAUSE: Duration = Duration::from_millis(50);

/// A claim on a result file, which goes with its process: a lock on `.NAME.claim` beside the file.
#[derive(Debug)]
pub(super) struct Claim {
    path: PathBuf,
    _held: File,
    /// False where the file system has no locks.
    pub(super) locked: bool,
    /// The file under the name when the claim was made.
    found: Option<Stamp>,
}

/// Marks of a file that another one under the same name has not: device, inode, length, last change (s, ns).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stamp {
    device: u64,
    inode: u64,
    length: u64,
    changed: [i64; 2],
}

impl Stamp {
    fn of(path: &Path) -> Option<Self> {
        let m = fs::symlink_metadata(path).ok()?;
        Some(Self { device: m.dev(), inode: m.ino(), length: m.len(), changed: [m.mtime(), m.mtime_nsec()] })
    }
}

impl Claim {
    /// Claims `target`.
    ///
    /// # Errors
    /// [`Error::Job`] if another process has claimed it; [`Error::Io`] where no file can be made beside it. On a file
    /// system without locks only [`Claim::holds`] tells of another run.
    pub(super) fn new(target: &Path) -> Result<Self> {
        let name = target.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let path = target.with_file_name(format!(".{name}.claim"));
        let mut waited = Duration::ZERO;
        loop {
            let held = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
            let held = held.map_err(|e| failure(target, &e))?;
            match flock(&held, FlockOperation::NonBlockingLockExclusive) {
                // The process that held it may have removed the file in between.
                Ok(()) if !same(&held, &path) => continue,
                Err(Errno::WOULDBLOCK) if waited < PATIENCE => {
                    sleep(PAUSE);
                    waited += PAUSE;
                }
                Err(Errno::WOULDBLOCK) => {
                    return Err(Error::Job(format!(
                        "{}: another run writes to this file now; wait until it ends, or name another --output",
                        target.display()
                    )))
                }
                lock => return Ok(Self { path, _held: held, locked: lock.is_ok(), found: Stamp::of(target) }),
            }
        }
    }

    /// True unless something came under the name of `target` since the claim was made.
    pub(super) fn holds(&self, target: &Path) -> bool {
        Stamp::of(target) == self.found
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // The lock is still held: nobody else has claimed this file.
        let _ = fs::remove_file(&self.path);
    }
}

/// True if `path` names the open file.
fn same(held: &File, path: &Path) -> bool {
    let there = fs::metadata(path).map(|m| (m.dev(), m.ino()));
    held.metadata().is_ok_and(|m| there.is_ok_and(|t| t == (m.dev(), m.ino())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_ends_with_its_owner_and_sees_what_came_meanwhile() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("run.h5");
        let claim = Claim::new(&target).expect("nobody has it");
        assert!(claim.holds(&target));
        fs::write(&target, "of another run").expect("write");
        assert!(!claim.holds(&target));
        let refused = Claim::new(&target).expect_err("it is claimed");
        assert_eq!(refused.exit_code(), 2);
        assert!(refused.to_string().contains("another run writes to this file now"), "{refused}");
        drop(claim);
        let again = Claim::new(&target).expect("nobody has it any more");
        assert!(again.holds(&target));
        fs::write(&target, "another one").expect("write");
        assert!(!again.holds(&target));
        drop(again);
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1, "the claim's file is gone");
    }
}
