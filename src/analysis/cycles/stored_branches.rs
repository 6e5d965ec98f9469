//! Finished parts of the branches, on the disk: thresholds, cycles that branches begin with, and each branch with all
//! that its next cycle depends on. A later run of the same job on the same model goes on from there, whatever its
//! number of ranks. Every file begins with what it is of and ends with a checksum; what does not fit is made again.

use super::search::Search;
use crate::cycles::{BranchPoint, BranchState};
use crate::job::{Branches, Job};
use crate::output::companion;
use crate::output::datasets::branches::Onset;
use crate::output::datasets::checkpoint;
use crate::parallel::World;
use crate::transient::Model;
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Bytes of an identity, and of a checksum.
const SUM: usize = 32;
/// File with the job.
const JOB: &str = "job.json";

/// The folder of finished parts.
fn folder(output: &Path) -> PathBuf {
    companion(output, "branches")
}

/// The job of a run to `output` that was stopped among its branches, as text; none where there is no such run.
pub fn job_of(output: &Path) -> Option<PathBuf> {
    Some(folder(output).join(JOB)).filter(|path| path.is_file())
}

/// The files of a run.
pub(super) struct StoredBranches {
    folder: PathBuf,
    /// Checksum of everything that cycles depend on.
    common: Vec<u8>,
}

fn fail(path: &Path, e: &std::io::Error) -> Error {
    Error::Io(format!("{}: cannot keep limit cycles: {e}", path.display()))
}

impl StoredBranches {
    /// Collective: makes the folder beside `output`, with the job as it was `given`.
    pub(super) fn open(world: &World, output: &Path, given: &Job, search: &Search<'_>) -> Result<Self> {
        let folder = folder(output);
        let text = |v: &serde_json::Value| v.to_string();
        // More cycles of a branch are cycles of the same branch, and so are others that are shown.
        let own = Branches { most: 1, every: None, ..search.wanted.clone() };
        let json = serde_json::json!({
            "contact": search.job.contact, "bodies": search.job.bodies, "curve": search.job.curve,
            "vehicle": search.job.vehicle, "further": search.job.contact.as_ref().map(|c| &c.further),
            "stability": search.job.analyses.stability, "cycles": own
        });
        let mut sum = Sha256::new();
        sum.update(env!("CARGO_PKG_VERSION"));
        sum.update(text(&json));
        sum.update(checkpoint::identity(&Model::new(search.model.1, search.model.0)));
        let kept = Self { folder, common: sum.finalize().to_vec() };
        world.on_root(|| {
            std::fs::create_dir_all(&kept.folder).map_err(|e| fail(&kept.folder, &e))?;
            replace(&kept.folder.join(JOB), text(&given.to_json()).as_bytes())
        })?;
        Ok(kept)
    }

    /// The folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    fn identity(&self, name: &str) -> [u8; SUM] {
        let mut sum = Sha256::new();
        sum.update(&self.common);
        sum.update(name);
        sum.finalize().into()
    }

    /// Collective: the thresholds of rest, where they were found.
    pub(super) fn onsets(&self, world: &World) -> Result<Option<Vec<Onset>>> {
        let found = world.on_root(|| Ok(self.numbers("rest")))?.flatten();
        let known = world.broadcast(vec![u8::from(found.is_some())]) == [1];
        let numbers = world.broadcast(found.unwrap_or_default());
        Ok(known.then(|| numbers.chunks_exact(Onset::NUMBERS).filter_map(Onset::from_numbers).collect()))
    }

    /// Collective: keeps the thresholds of rest.
    pub(super) fn keep_onsets(&self, world: &World, onsets: &[Onset]) -> Result<()> {
        let numbers: Vec<f64> = onsets.iter().flat_map(Onset::numbers).collect();
        world.on_root(|| self.keep("rest", &numbers)).map(drop)
    }

    /// The numbers of a file, if it is there, whole, and of this run.
    pub(super) fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let bytes = std::fs::read(self.folder.join(name)).ok()?;
        let (numbers, length) = record(&bytes, &self.identity(name))?;
        (length == bytes.len()).then_some(numbers)
    }

    /// Writes the numbers of a file, all at once.
    pub(super) fn keep(&self, name: &str, numbers: &[f64]) -> Result<()> {
        replace(&self.folder.join(name), &bytes_of(&self.identity(name), numbers))
    }

    /// The branch `name`, as far as it was followed, and its files; `start` where there is none.
    pub(super) fn branch(&self, name: &str, start: impl FnOnce() -> BranchState) -> Result<(BranchState, BranchFile)> {
        let path = self.folder.join(format!("{name}.points"));
        let identity = self.identity(name);
        let bytes = match std::fs::read(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            other => other.map_err(|e| fail(&path, &e))?,
        };
        let (mut points, mut ends) = (Vec::new(), vec![0]);
        while let Some((numbers, length)) = record(&bytes[ends[ends.len() - 1]..], &identity) {
            let Some(point) = BranchPoint::from_numbers(&numbers) else { break };
            points.push(point);
            ends.push(ends[ends.len() - 1] + length);
        }
        let state_name = format!("{name}.state");
        let state = self.numbers(&state_name).and_then(|n| BranchState::from_numbers(&n, points));
        let written = state.as_ref().map_or(0, |s| s.points.len());
        let mut file =
            OpenOptions::new().create(true).truncate(false).write(true).open(&path).map_err(|e| fail(&path, &e))?;
        // Points that the state does not know of are found again.
        let end = ends[written] as u64;
        file.set_len(end).and_then(|()| file.seek(SeekFrom::Start(end))).map_err(|e| fail(&path, &e))?;
        let state = state.unwrap_or_else(start);
        Ok((state, BranchFile { path, file, identity, written, state_name }))
    }
}

/// The files of a branch: its points, one record after the other, and its state.
pub(super) struct BranchFile {
    path: PathBuf,
    file: File,
    identity: [u8; SUM],
    /// Points in the file.
    written: usize,
    state_name: String,
}

impl BranchFile {
    /// Adds the points that are new, then the state.
    pub(super) fn keep(&mut self, kept: &StoredBranches, state: &BranchState) -> Result<()> {
        let new = state.points.iter().skip(self.written);
        let bytes: Vec<u8> = new.flat_map(|p| bytes_of(&self.identity, &p.numbers())).collect();
        self.file.write_all(&bytes).and_then(|()| self.file.sync_data()).map_err(|e| fail(&self.path, &e))?;
        self.written = state.points.len();
        kept.keep(&self.state_name, &state.numbers())
    }
}

/// Identity, length, numbers, checksum.
fn bytes_of(identity: &[u8; SUM], numbers: &[f64]) -> Vec<u8> {
    let mut bytes = identity.to_vec();
    bytes.extend((numbers.len() as u64).to_le_bytes());
    bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
    let sum = Sha256::digest(&bytes);
    bytes.extend(sum);
    bytes
}

/// The numbers of the first record, if it is whole and of this identity, and its length in bytes.
fn record(bytes: &[u8], identity: &[u8; SUM]) -> Option<(Vec<f64>, usize)> {
    let head = bytes.get(..SUM + 8)?;
    let count = u64::from_le_bytes(head[SUM..].try_into().ok()?);
    let end = usize::try_from(count).ok()?.checked_mul(8)?.checked_add(SUM + 8)?;
    let (body, sum) = (bytes.get(..end)?, bytes.get(end..end.checked_add(SUM)?)?);
    if &head[..SUM] != identity || Sha256::digest(body).as_slice() != sum {
        return None;
    }
    let number = |c: &[u8]| c.try_into().map_or(f64::NAN, f64::from_le_bytes);
    Some((body[SUM + 8..].chunks_exact(8).map(number).collect(), end + SUM))
}

/// Writes a file that is there whole or not at all.
fn replace(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, path)).map_err(|e| fail(path, &e))
}
