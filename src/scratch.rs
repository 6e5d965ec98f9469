//! A folder of this process on a disk, for what is not to stay in memory.
//!
//! It goes with its owner. What a killed process has left is removed by the next one that is given the same place: a
//! lock beside the folder dies with its process.

use crate::{Error, Result};
use rustix::fs::{flock, FlockOperation};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// How the names of these folders begin, and how those of their locks end.
const NAME: &str = "railsqueal-factors-";
const LOCK: &str = ".lock";

/// A folder that exists as long as this does.
#[derive(Debug)]
pub struct Scratch {
    folder: PathBuf,
    lock: PathBuf,
    _held: File,
}

impl Scratch {
    /// A new folder in `place`, which exists. Those that nobody holds any more are removed. Errors name the job's key.
    pub fn new(place: &Path) -> Result<Self> {
        let fail = |e: io::Error| {
            Error::Io(format!(
                "solver.out_of_core: cannot make a folder in {}: {e}; name a folder that exists, on a disk of \
                 the machine itself, and may be written",
                place.display()
            ))
        };
        clear(place).map_err(fail)?;
        let mut count = 0;
        loop {
            let name = format!("{NAME}{}-{count}", std::process::id());
            let (folder, lock) = (place.join(&name), place.join(name + LOCK));
            count += 1;
            let held = match File::create_new(&lock) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
                held => held.map_err(fail)?,
            };
            // Between the two lines another process may have taken it for one that was left.
            if flock(&held, FlockOperation::NonBlockingLockExclusive).is_err() || !lock.exists() {
                continue;
            }
            fs::create_dir(&folder).map_err(fail)?;
            return Ok(Self { folder, lock, _held: held });
        }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Free space on its disk, byte.
    pub fn free(&self) -> Result<f64> {
        free(&self.folder)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
        let _ = fs::remove_file(&self.lock);
    }
}

/// Free space on the disk of the folder `place`, byte.
pub fn free(place: &Path) -> Result<f64> {
    let there = rustix::fs::statvfs(place)
        .map_err(|e| Error::Io(format!("solver.out_of_core: {}: {}", place.display(), io::Error::from(e))))?;
    Ok(there.f_bavail as f64 * there.f_frsize as f64)
}

/// Removes the folders in `place` whose processes are gone.
fn clear(place: &Path) -> io::Result<()> {
    for entry in fs::read_dir(place)? {
        let path = entry?.path();
        let Some(folder) = path.to_str().and_then(|p| p.strip_suffix(LOCK)) else { continue };
        if !Path::new(folder).file_name().is_some_and(|n| n.to_string_lossy().starts_with(NAME)) {
            continue;
        }
        let Ok(held) = File::open(&path) else { continue };
        if flock(&held, FlockOperation::NonBlockingLockExclusive).is_ok() {
            let _ = fs::remove_dir_all(folder);
            let _ = fs::remove_file(&path);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_goes_with_its_owner_and_others_stay() {
        let place = tempfile::tempdir().unwrap();
        let (one, two) = (Scratch::new(place.path()).unwrap(), Scratch::new(place.path()).unwrap());
        assert_ne!(one.path(), two.path());
        fs::write(one.path().join("factor"), [0; 100]).unwrap();
        assert!(one.free().unwrap() > 0.0);
        let gone = one.path().to_owned();
        drop(one);
        assert!(!gone.exists() && two.path().exists());
        drop(two);
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let left = place.path().join(format!("{NAME}1-0"));
        fs::create_dir(&left).unwrap();
        fs::write(left.join("factor"), [0; 100]).unwrap();
        fs::write(place.path().join(format!("{NAME}1-0{LOCK}")), "").unwrap();
        let other = place.path().join(format!("other{LOCK}"));
        fs::write(&other, "").unwrap();
        let mine = Scratch::new(place.path()).unwrap();
        assert!(!left.exists() && other.exists() && mine.path().exists());
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 3);
    }

    #[test]
    fn a_place_that_will_not_do_is_named() {
        let error = Scratch::new(Path::new("/nowhere/at/all")).unwrap_err();
        assert_eq!(error.exit_code(), 6);
        assert!(
            error.message().contains("solver.out_of_core") && error.message().contains("/nowhere/at/all"),
            "{error}"
        );
    }
}
