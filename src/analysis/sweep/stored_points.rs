//! The points of a study that are done, on the disk: one file of records, each with what it is of and a checksum. A
//! later run of the same points takes them up, whatever its number of ranks.

use super::outcome::PackedOutcomes;
use crate::job::Job;
use crate::output::companion;
use crate::output::datasets::sweep::Outcome;
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Bytes of an identity, and of a checksum.
const SUM: usize = 32;

/// The folder of the points that are done.
pub(super) fn folder(output: &Path) -> PathBuf {
    companion(output, "uncertainty")
}

/// The file of the points that are done.
pub(super) struct StoredPoints {
    folder: PathBuf,
    path: PathBuf,
    file: File,
    /// Inputs that all points share.
    common: Vec<u8>,
    /// Records that were read: the outcome of a point by its identity.
    found: HashMap<[u8; SUM], Outcome>,
}

impl StoredPoints {
    /// Reads what an earlier run to the same `output` has left. `common` is what every point rests on.
    pub(super) fn open(output: &Path, common: Vec<u8>) -> Result<Self> {
        let folder = folder(output);
        let path = folder.join("points");
        let fail = |e: std::io::Error| Error::Io(format!("{}: cannot keep samples: {e}", path.display()));
        std::fs::create_dir_all(&folder).map_err(fail)?;
        let bytes = match std::fs::read(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            other => other.map_err(fail)?,
        };
        let (found, sound) = records(&bytes);
        let mut file = OpenOptions::new().create(true).truncate(false).write(true).open(&path).map_err(fail)?;
        // What was torn at the end is written again.
        file.set_len(sound as u64).and_then(|()| file.seek(SeekFrom::End(0))).map_err(fail)?;
        Ok(Self { folder, path, file, common, found })
    }

    /// The folder of the file.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Puts what is there of the `points` in their places.
    pub(super) fn take_up(&mut self, points: &[Option<Job>], results: &mut [Option<Outcome>]) -> Result<()> {
        if self.found.is_empty() {
            return Ok(());
        }
        for (point, result) in points.iter().zip(results) {
            if let (Some(point), None) = (point, &result) {
                *result = self.found.remove(&self.identity(point)?);
            }
        }
        self.found.clear();
        Ok(())
    }

    /// Adds the points `packed`.
    pub(super) fn add(&mut self, packed: &PackedOutcomes, points: &[Option<Job>]) -> Result<()> {
        let mut all = vec![None; points.len()];
        packed.unpack(&mut all)?;
        let mut bytes = Vec::new();
        for (outcome, point) in all.iter().zip(points) {
            if let (Some(outcome), Some(point)) = (outcome, point) {
                bytes.extend(record(self.identity(point)?, outcome));
            }
        }
        let fail = |e: std::io::Error| Error::Io(format!("{}: cannot keep samples: {e}", self.path.display()));
        self.file.write_all(&bytes).and_then(|()| self.file.sync_data()).map_err(fail)
    }

    /// Checksum of the inputs of a point.
    fn identity(&self, point: &Job) -> Result<[u8; SUM]> {
        let job = serde_json::to_vec(point).map_err(|e| Error::Defect(format!("a sample as text: {e}")))?;
        let mut sum = Sha256::new();
        sum.update(env!("CARGO_PKG_VERSION"));
        sum.update(&self.common);
        sum.update(job);
        Ok(sum.finalize().into())
    }
}

/// The record of a point: what it is of, the numbers of its outcome and its text, each after its length, and a
/// checksum.
fn record(identity: [u8; SUM], outcome: &Outcome) -> Vec<u8> {
    let mut packed = PackedOutcomes::default();
    packed.push(0, outcome);
    let mut bytes = identity.to_vec();
    for length in [packed.numbers.len(), packed.text.len()] {
        bytes.extend((length as u64).to_le_bytes());
    }
    bytes.extend(packed.numbers.iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(&packed.text);
    let sum = Sha256::digest(&bytes);
    bytes.extend(sum);
    bytes
}

/// All sound records up to the first one that is not, and where that begins.
fn records(bytes: &[u8]) -> (HashMap<[u8; SUM], Outcome>, usize) {
    let (mut found, mut at) = (HashMap::new(), 0);
    while let Some((identity, outcome, length)) = first(&bytes[at..]) {
        found.insert(identity, outcome);
        at += length;
    }
    (found, at)
}

/// The first record, and its length.
fn first(bytes: &[u8]) -> Option<([u8; SUM], Outcome, usize)> {
    let eight = |at: usize| <[u8; 8]>::try_from(bytes.get(at..at.checked_add(8)?)?).ok();
    let numbers = usize::try_from(u64::from_le_bytes(eight(SUM)?)).ok()?.checked_mul(8)?;
    let text = usize::try_from(u64::from_le_bytes(eight(SUM + 8)?)).ok()?;
    let begin = SUM + 16;
    let end = begin.checked_add(numbers)?.checked_add(text)?;
    let sum = bytes.get(end..end.checked_add(SUM)?)?;
    if Sha256::digest(&bytes[..end]).as_slice() != sum {
        return None;
    }
    let values = (0..numbers / 8).map(|k| Some(f64::from_le_bytes(eight(begin + 8 * k)?))).collect::<Option<_>>()?;
    let packed = PackedOutcomes { numbers: values, text: bytes[begin + numbers..end].to_vec() };
    let mut one = [None];
    packed.unpack(&mut one).ok()?;
    let [outcome] = one;
    Some((bytes[..SUM].try_into().ok()?, outcome?, end + SUM))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::datasets::sweep::Followed;
    use num_complex::Complex;

    #[test]
    fn records_are_read_as_they_were_written_up_to_a_torn_one() {
        let failed = Outcome::failed(&Error::NotConverged("no equilibrium".into()));
        let value = Complex::new(0.1 + 0.2, 1e3 / 3.0);
        let good = Outcome {
            status: 0,
            message: String::new(),
            eigenvalues: vec![value],
            followed: vec![
                Followed { mode: Some(3), value, agreement: 0.9 },
                Followed { mode: None, value, agreement: 0.1 },
            ],
            backward_error: 1e-15,
            approach: 1e-5,
            angular_speed: 21.5,
            force: [1.0, 2.0, 3.0],
            ..failed.clone()
        };
        let bytes = [record([1; SUM], &good), record([2; SUM], &failed)].concat();
        let (found, end) = records(&bytes);
        assert_eq!((found.len(), end), (2, bytes.len()));
        assert_eq!(found[&[1; SUM]], good);
        assert_eq!((found[&[2; SUM]].status, found[&[2; SUM]].message.as_str()), (4, "no equilibrium"));
        // Every cut and every changed byte of the second one leaves the first one.
        let (_, whole) = records(&bytes[..bytes.len() - 1]);
        for cut in whole..bytes.len() {
            let (found, end) = records(&bytes[..cut]);
            assert_eq!((found.len(), end), (1, whole));
        }
        for at in whole..bytes.len() {
            let mut harmed = bytes.clone();
            harmed[at] ^= 4;
            assert_eq!(records(&harmed).1, whole);
        }
    }
}
