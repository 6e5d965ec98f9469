//! Results of a long run in segments: small files, each complete when it appears, so that a run killed at any moment
//! leaves files that can be read, and continued. At the end they become part of the main file. A manifest beside them
//! says which they are and what is in each: no segment is opened that is not as it was written.

mod manifest;
mod merge;

pub use manifest::{program, Entry, RunOrigin};
pub(super) use merge::append_to;

use super::atomic_file::{failure, sweep, Partial};
use super::read::Reader;
use super::result::{companion, MODEL};
use super::table::Table;
use super::vtkhdf::skeleton;
use crate::{Error, Result};
use manifest::Manifest;
use serde_json::Value;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// The segments of a run, on rank 0: files `NUMBER.h5` in the folder `FILE.transient` beside the main file `FILE.h5`,
/// their number being that of the last step in them, and the manifest. As long as one of these exists no other run
/// can have them.
#[derive(Debug, Clone)]
pub struct Segments {
    held: Rc<Held>,
}

/// State shared by all who look at the segments.
#[derive(Debug)]
struct Held {
    folder: PathBuf,
    manifest: RefCell<Manifest>,
}

impl Drop for Held {
    fn drop(&mut self) {
        // Of a run that ended before its first segment nothing is left.
        let manifest = self.manifest.borrow();
        if manifest.parts.is_empty() && numbered(&self.folder).is_ok_and(|files| files.is_empty()) {
            manifest.remove();
            let _ = std::fs::remove_dir(&self.folder);
        }
    }
}

impl Segments {
    /// For a run that begins, with the main file `result`. `Error::Job` if there is an unfinished run and not
    /// `overwrite`, or if another process has it.
    pub fn claim(result: &Path, overwrite: bool) -> Result<Self> {
        let folder = companion(result, "transient");
        let Some((manifest, read)) = Manifest::open(&folder, true)? else {
            return Err(Error::Defect("a manifest that is made is not there".into()));
        };
        let merged = manifest.merged;
        let found = Self { held: Rc::new(Held { folder, manifest: RefCell::new(manifest) }) };
        if !overwrite && !merged && (read.is_err() || !numbered(found.folder())?.is_empty()) {
            return Err(Error::Job(format!(
                "{} holds an unfinished run; continue it with --resume {}, or give --force to begin again",
                found.folder().display(),
                result.display()
            )));
        }
        Ok(found)
    }

    /// For a run that is continued, with the main file `result`. `Error::Job` if there is nothing to continue.
    pub fn reopen(result: &Path) -> Result<Self> {
        let folder = companion(result, "transient");
        let nothing = |why: &str, advice: Option<String>| {
            let advice = advice.unwrap_or_else(|| "name the result file of a run that was stopped".into());
            Err(Error::Job(format!("--resume: there is nothing to continue in {}{why}; {advice}", folder.display())))
        };
        // Where there are no segments the model of the run may be left; segments of nobody are another matter.
        let empty = || match numbered(&folder)?.is_empty() {
            true => nothing("", left_of(result)),
            false => {
                nothing(": it holds segments without a manifest, of an earlier version or of another program", None)
            }
        };
        let Some((manifest, read)) = Manifest::open(&folder, false)? else { return empty() };
        read.map_err(|e| e.context("--resume"))?;
        if manifest.merged {
            let over = format!(": the run came to its end, its results are in {}", result.display());
            return nothing(&over, None);
        }
        // Begun, and ended before its first segment had its name; or the lines of the manifest are lost.
        if manifest.parts.is_empty() || (numbered(&folder)?.is_empty() && left_of(result).is_some()) {
            return empty();
        }
        Ok(Self { held: Rc::new(Held { folder, manifest: RefCell::new(manifest) }) })
    }

    /// Returns their folder.
    pub fn folder(&self) -> &Path {
        &self.held.folder
    }

    /// False where the file system has no locks: nothing then keeps two runs apart.
    pub fn locked(&self) -> bool {
        self.held.manifest.borrow().locked
    }

    /// The segments that belong to the run, in order.
    pub fn entries(&self) -> Vec<Entry> {
        self.held.manifest.borrow().entries.clone()
    }

    /// The parts in which the run was made so far.
    pub fn parts(&self) -> Vec<RunOrigin> {
        self.held.manifest.borrow().parts.clone()
    }

    /// Steps that are done.
    pub fn done(&self) -> u64 {
        self.held.manifest.borrow().entries.last().map_or(0, |e| e.last)
    }

    /// The file of a segment.
    pub fn path(&self, entry: &Entry) -> PathBuf {
        self.held.folder.join(file_name(entry.last))
    }

    /// Opens a segment, once its file is known to be what was written; `Error::Input` if it is not.
    pub fn open(&self, entry: &Entry) -> Result<Reader> {
        let path = self.path(entry);
        entry.verify(&path)?;
        Reader::open(&path)
    }

    /// Opens that of the start.
    pub fn open_first(&self) -> Result<Reader> {
        let entries = self.entries();
        let first = entries.first().ok_or_else(|| Error::Defect("a run without its first segment".into()))?;
        self.open(first)
    }

    /// Checks every segment, before any is opened. Missing ones at the end are given up: a run that was killed may
    /// have announced one.
    pub fn verify(&self) -> Result<()> {
        let there: BTreeSet<u64> = numbered(&self.held.folder)?.into_iter().collect();
        let entries = self.entries();
        if let Some(stranger) = there.iter().find(|n| !entries.iter().any(|e| e.last == **n)) {
            return Err(Error::Input(format!(
                "{}: the manifest of the run does not name this segment: it is of another run, or a copy; remove it",
                self.held.folder.join(file_name(*stranger)).display()
            )));
        }
        let left = entries.iter().rposition(|e| there.contains(&e.last)).map_or(0, |last| last + 1);
        if let Some(lost) = entries[..left].iter().find(|e| !there.contains(&e.last)) {
            let advice = match lost.last {
                0 => {
                    "the first segment is missing, and with it the reduced model of the run; bring it back \
                 from a copy, or begin again with --force"
                }
                _ => {
                    "the segment is missing; bring it back from a copy, or remove all after it to continue \
                 from the one before"
                }
            };
            return Err(Error::Input(format!("{}: {advice}", self.path(lost).display())));
        }
        if left == 0 {
            return Err(Error::Job(format!(
                "{}: the run has no segment, not even that of its start; begin again with --force",
                self.held.folder.display()
            )));
        }
        self.held.manifest.borrow_mut().cut(left)?;
        entries[..left].iter().try_for_each(|e| e.verify(&self.path(e)))
    }

    /// `Error::Input` unless the segments hold the steps to `total`, and no more.
    pub fn complete(&self, total: u64) -> Result<()> {
        let done = self.done();
        if done != total {
            return Err(Error::Input(format!(
                "{}: the segments hold {done} steps, expected {total}; continue the run with --resume",
                self.held.folder.display()
            )));
        }
        Ok(())
    }

    /// The run begins, with the resolved `job`; what was there before is removed.
    pub fn start_run(&self, job: Value) -> Result<()> {
        self.held.manifest.borrow_mut().clear()?;
        for number in numbered(&self.held.folder)? {
            let path = self.held.folder.join(file_name(number));
            std::fs::remove_file(&path).map_err(|e| failure(&path, &e))?;
        }
        self.sweep();
        self.held.manifest.borrow_mut().record_origin(RunOrigin::new(0, job))
    }

    /// The run goes on, with the resolved `job`.
    pub fn go_on(&self, job: Value) -> Result<()> {
        self.sweep();
        let done = self.done();
        self.held.manifest.borrow_mut().record_origin(RunOrigin::new(done, job))
    }

    /// Writes the segment that ends with step `number`; it appears complete or not at all.
    pub fn write(&self, number: u64, tables: &[Table]) -> Result<()> {
        if let Some(fault) = tables.iter().find_map(Table::fault) {
            return Err(Error::Defect(fault));
        }
        let target = self.held.folder.join(file_name(number));
        sweep(&target);
        let mut partial = Partial::alone(&target);
        skeleton(&partial, None, &[], tables, None)?;
        let first = self.entries().last().map_or(0, |e| e.last + 1);
        let entry = Entry::new(&partial.path, first, number)?;
        partial.sync()?;
        self.held.manifest.borrow_mut().segment(entry)?;
        partial.publish()
    }

    /// Removes the segments, which are in the main file now.
    pub(super) fn remove(&self) {
        // A run that is killed from here on is over; a folder that stays is in nobody's way.
        let _ = self.held.manifest.borrow_mut().merge();
        for entry in self.entries() {
            let _ = std::fs::remove_file(self.path(&entry));
        }
        self.sweep();
        self.held.manifest.borrow().remove();
        let _ = std::fs::remove_dir(&self.held.folder);
    }

    /// Removes unfinished files: nobody else works here.
    fn sweep(&self) {
        for entry in std::fs::read_dir(&self.held.folder).into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().ends_with(".partial") {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// Bytes on disk.
    pub(super) fn bytes(&self) -> u64 {
        let size = |e: &Entry| std::fs::metadata(self.path(e)).map_or(0, |m| m.len() + 4096);
        self.entries().iter().map(size).sum()
    }
}

/// Model from which a run goes on that ended before its first segment, if it left one.
fn left_of(result: &Path) -> Option<String> {
    let model = companion(result, MODEL);
    let advice = "the run ended before its first segment.";
    model.is_file().then(|| format!("{advice} {0} is left of it: run its job with --reuse {0}", model.display()))
}

/// The resolved job of the run with the main file `result`, that of its last part, as the bytes of a job file.
pub fn job_of_run(result: &Path) -> Result<Vec<u8>> {
    let part = Segments::reopen(result)?.parts().pop();
    let part = part.ok_or_else(|| Error::Defect("a run to be continued was never begun".into()))?;
    Ok(part.job.to_string().into_bytes())
}

/// Numbers of the segments that lie in a folder, ascending; none where there is no folder.
fn numbered(folder: &Path) -> Result<Vec<u64>> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(Error::Io(format!("cannot read {}: {e}", folder.display()))),
    };
    let number = |entry: std::fs::DirEntry| -> Option<u64> {
        let name = entry.file_name().to_string_lossy().into_owned();
        let number = name.strip_suffix(".h5")?.parse().ok()?;
        (name == file_name(number)).then_some(number)
    };
    let mut numbers: Vec<u64> = entries.flatten().filter_map(number).collect();
    numbers.sort_unstable();
    Ok(numbers)
}

fn file_name(number: u64) -> String {
    format!("{number:012}.h5")
}

#[cfg(test)]
mod tests;
