//! Results of a long run in segments: small files, each complete when it appears, so that a run killed at any moment leaves
//! files that can be read, and continued. At the end they become part of the main file.

use super::partial::{sweep, Partial};
use super::read::Reader;
use super::result::companion;
use super::table::Table;
use super::values::Values;
use super::vtkhdf::{skeleton, strong};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// The segments of a run, on rank 0: files `NUMBER.h5` in the folder `FILE.transient` beside the main file `FILE.h5`.
#[derive(Debug, Clone)]
pub struct Segments {
    folder: PathBuf,
}

impl Segments {
    /// Those that go with the main file `result`.
    pub fn of(result: &Path) -> Self {
        Self { folder: companion(result, "transient") }
    }

    /// Where they are.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The segments there are, in order; none where there is no folder.
    pub fn files(&self) -> Result<Vec<PathBuf>> {
        let entries = match std::fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(self.failure("read", &e)),
        };
        let named = |p: &PathBuf| {
            p.extension().is_some_and(|e| e == "h5")
                && p.file_stem().is_some_and(|s| s.to_string_lossy().bytes().all(|b| b.is_ascii_digit()))
        };
        let mut files: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(named).collect();
        files.sort();
        Ok(files)
    }

    /// The segment of the start, if it is there.
    pub fn first(&self) -> Result<Option<PathBuf>> {
        let path = self.folder.join(file_name(0));
        Ok(self.files()?.into_iter().find(|p| *p == path))
    }

    /// Makes the folder; segments of an earlier run are removed if `overwrite`, an error if not.
    pub fn begin(&self, overwrite: bool) -> Result<()> {
        let old = self.files()?;
        if !old.is_empty() && !overwrite {
            return Err(Error::Job(format!(
                "{} holds an unfinished run; continue it with --resume, or give --force to begin again",
                self.folder.display()
            )));
        }
        for file in old {
            std::fs::remove_file(file).map_err(|e| self.failure("clear", &e))?;
        }
        std::fs::create_dir_all(&self.folder).map_err(|e| self.failure("make", &e))
    }

    /// Writes a segment, which appears complete or not at all.
    pub fn write(&self, number: u64, tables: &[Table]) -> Result<()> {
        if let Some(fault) = tables.iter().find_map(Table::fault) {
            return Err(Error::Defect(fault));
        }
        let target = self.folder.join(file_name(number));
        sweep(&target);
        let mut partial = Partial::alone(&target);
        skeleton(&partial, None, &[], tables, None)?;
        partial.publish()
    }

    /// Removes the segments, which are in the main file now.
    pub(super) fn remove(&self) {
        // A folder that stays is in nobody's way.
        for file in self.files().unwrap_or_default() {
            let _ = std::fs::remove_file(file);
        }
        let _ = std::fs::remove_dir(&self.folder);
    }

    /// Bytes on disk.
    pub(super) fn bytes(&self) -> u64 {
        let files = self.files().unwrap_or_default();
        files.iter().filter_map(|f| std::fs::metadata(f).ok()).map(|m| m.len() + 4096).sum()
    }

    /// Adds the datasets of `group` of all segments to an open file, one after the other along the first dimension. One
    /// segment at a time is in memory.
    pub(super) fn append(&self, file: &hdf5::File, group: &str) -> Result<()> {
        for path in self.files()? {
            let segment = Reader::open(&path)?;
            // The first one holds the start alone.
            let names = if segment.has(group) { segment.names(group)? } else { Vec::new() };
            for name in names {
                let at = format!("{group}/{name}");
                let (shape, values) = segment.read(&at)?;
                if values.is_empty() {
                    continue;
                }
                let (units, description) = (segment.attribute(&at, "units")?, segment.attribute(&at, "description")?);
                add(file, &at, &units, &description, &shape, values)
                    .map_err(|e| Error::Io(format!("cannot add {at} of {} to the result file: {e}", path.display())))?;
            }
        }
        Ok(())
    }

    fn failure(&self, doing: &str, e: &std::io::Error) -> Error {
        Error::Io(format!(
            "cannot {doing} {}: {e}; check the directory, or name another --output",
            self.folder.display()
        ))
    }
}

fn file_name(number: u64) -> String {
    format!("{number:012}.h5")
}

fn add(
    file: &hdf5::File,
    path: &str,
    units: &str,
    description: &str,
    shape: &[usize],
    values: Values,
) -> hdf5::Result<()> {
    let there = file.dataset(path);
    let Ok(dataset) = there else {
        return Table::new(path, units, description, shape, values).extendible().write(file);
    };
    let mut now = dataset.shape();
    let start = now[0];
    now[0] += shape[0];
    dataset.resize(now)?;
    values.write_rows(&dataset, start)
}

/// On a file opened for writing by rank 0 alone.
pub(super) fn append_to(path: &Path, segments: &Segments, group: &str) -> Result<()> {
    let failure = |e: hdf5::Error| Error::Io(format!("cannot write {}: {e}", path.display()));
    let file = hdf5::File::with_options().with_fapl(strong).open_rw(path).map_err(failure)?;
    segments.append(&file, group)?;
    file.close().map_err(failure)
}
