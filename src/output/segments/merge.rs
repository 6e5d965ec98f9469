//! Segments become part of the main file. Their chunks are copied as they lie in the file, compressed: what was
//! compressed once is neither decoded nor compressed again. Where chunks do not fit (rows between two multiples of
//! `segment`, tiny segments), values are read and written.

use super::super::read::Reader;
use super::super::table::Table;
use super::super::values::{Values, CHUNK_BYTES, CHUNK_LEAST};
use super::super::vtkhdf::strong;
use super::{Entry, Segments};
use crate::progress::Progress;
use crate::{Error, Result};
use hdf5::Dataset;
use hdf5_chunks::Target;
use std::collections::BTreeMap;
use std::path::Path;

/// On rank 0: adds the datasets of `group` of all segments, one after the other along the first dimension, to the
/// file `path`. One segment at a time is open, one of its datasets at the most in memory.
pub(crate) fn append_to(path: &Path, segments: &Segments, group: &str, progress: &mut Progress) -> Result<()> {
    let failure = |e: hdf5::Error| Error::Io(format!("cannot write {}: {e}", path.display()));
    let file = hdf5::File::with_options().with_fapl(strong).open_rw(path).map_err(failure)?;
    let mut merged = Merged { file: &file, datasets: BTreeMap::new() };
    let mut entries = segments.entries();
    // The first one holds the start alone, and the reduced model, which may be large.
    entries.retain(|entry| entry.last > 0);
    for (number, entry) in entries.iter().enumerate() {
        merged.take(segments, entry, group)?;
        progress.step("segments", number + 1, entries.len());
    }
    // They have chunks that are not written yet.
    merged.datasets.clear();
    file.close().map_err(failure)
}

/// The main file with the datasets that grow in it, which stay open: a chunk is written when it is full.
struct Merged<'f> {
    file: &'f hdf5::File,
    datasets: BTreeMap<String, Target>,
}

impl Merged<'_> {
    /// Adds one segment.
    fn take(&mut self, segments: &Segments, entry: &Entry, group: &str) -> Result<()> {
        let path = segments.path(entry);
        let segment = segments.open(entry)?;
        let bytes =
            crate::input::open(&path).map_err(|e| Error::Input(format!("cannot read {}: {e}", path.display())))?;
        for name in segment.names(group)? {
            let at = format!("{group}/{name}");
            let from = segment.dataset(&at)?;
            let (shape, steps) = (from.shape(), entry.last - entry.first + 1);
            if name == "time" && shape != [steps as usize] {
                return Err(Error::Defect(format!("{} holds {shape:?} times of {steps} steps", path.display())));
            }
            if from.size() == 0 {
                continue;
            }
            if !self.datasets.contains_key(&at) {
                self.create(&segment, &at, &from)?;
            }
            let Some(to) = self.datasets.get(&at) else { continue };
            let add = || -> hdf5::Result<()> {
                let mut now = to.dataset().shape();
                let start = now[0];
                now[0] += shape[0];
                to.dataset().resize(now)?;
                match to.takes(&from, start) {
                    true => to.copy(&bytes, &from, start),
                    false => values(&segment, &at)?.write_rows(to.dataset(), start),
                }
            };
            add().map_err(|e| Error::Io(format!("cannot add {at} of {} to the result file: {e}", path.display())))?;
        }
        Ok(())
    }

    /// Makes the dataset that those of the segments become, like `from` and without rows: in chunks of the same size
    /// if these are large enough.
    fn create(&mut self, segment: &Reader, at: &str, from: &Dataset) -> Result<()> {
        let (units, description) = (segment.attribute(at, "units")?, segment.attribute(at, "description")?);
        let (mut shape, none) = (from.shape(), segment.read(at)?.1.slice(0..0));
        let row = none.item_bytes() * shape[1..].iter().product::<usize>();
        let chunk = from.chunk().map_or(0, |chunk| chunk[0]);
        let rows = if chunk * row >= CHUNK_LEAST { chunk } else { (CHUNK_BYTES / row.max(1)).max(1) };
        shape[0] = 0;
        let made = Table::new(at, &units, &description, &shape, none).in_chunks(rows).write(self.file);
        let opened = made.and_then(|()| Target::new(self.file.dataset(at)?));
        let dataset = opened.map_err(|e| Error::Io(format!("cannot make {at} in the result file: {e}")))?;
        self.datasets.insert(at.to_owned(), dataset);
        Ok(())
    }
}

/// The values of a dataset.
fn values(segment: &Reader, at: &str) -> hdf5::Result<Values> {
    segment.read(at).map(|found| found.1).map_err(|e| e.to_string().into())
}
