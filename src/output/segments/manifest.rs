//! The manifest of a run in segments: the jobs it was begun and continued with, and step range and SHA-256 of each
//! segment.
//!
//! A file of lines `CHECKSUM RECORD`, a record being JSON and the checksum the SHA-256 of the checksum before it and
//! the record. Lines are only added, and brought to the disk before the segment they speak of gets its name: a run
//! killed at any moment leaves at the most the beginning of a line, or a last line whose segment is not there. What
//! was altered, lost or put in does not fit the checksums. As long as a run has it open the file is locked; the lock
//! ends with the process, however it ends.

use super::super::atomic_file::failure;
use super::super::provenance::hexadecimal;
use crate::{Error, Result};
use rustix::fs::FlockOperation;
use rustix::io::Errno;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// A line of the manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Record {
    /// The run begins, or goes on.
    Part(RunOrigin),
    /// A segment is about to get its name.
    Segment(Entry),
    /// Segments after this step are removed.
    Cut(u64),
    /// All segments are in the result file.
    Merged,
}

/// From where a run was begun or continued, with which job, and by whom.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunOrigin {
    /// Steps that were done before.
    pub step: u64,
    /// The resolved job.
    pub job: Value,
    /// Program and version.
    pub program: String,
    /// When it was, UTC.
    pub date: String,
    /// The host of the process.
    pub host: String,
    /// The process.
    pub pid: u32,
}

impl RunOrigin {
    /// A part of this process, after so many steps.
    pub(super) fn new(step: u64, job: Value) -> Self {
        let host = rustix::system::uname().nodename().to_string_lossy().into_owned();
        Self { step, job, program: program(), date: super::super::utc_now(), host, pid: std::process::id() }
    }
}

/// Name and version of this program.
pub fn program() -> String {
    format!("railsqueal {}", env!("CARGO_PKG_VERSION"))
}

/// A segment: the steps in it, and what its file must be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// The first step in it; 0 of the segment of the start.
    pub first: u64,
    /// The last step in it, which is its number.
    pub last: u64,
    /// Size of the file.
    bytes: u64,
    /// SHA-256 of the file, hexadecimal.
    sha256: String,
}

impl Entry {
    /// The segment of these steps that lies in `file`.
    pub(super) fn new(file: &Path, first: u64, last: u64) -> Result<Self> {
        let (bytes, sha256) = sum(file)?;
        Ok(Self { first, last, bytes, sha256 })
    }

    /// `Error::Input` if `file` is not what was written.
    pub(super) fn verify(&self, file: &Path) -> Result<()> {
        let (bytes, sha256) = sum(file)?;
        if (bytes, &sha256) == (self.bytes, &self.sha256) {
            return Ok(());
        }
        let what = match bytes == self.bytes {
            true => format!("found SHA-256 {sha256}, expected {}", self.sha256),
            false => format!("found {bytes} bytes, expected {}", self.bytes),
        };
        let advice = match self.last {
            0 => "it holds the reduced model of the run: bring it back from a copy, or begin again with --force",
            _ => "bring it back from a copy, or remove it and all segments after it to continue from the one before",
        };
        Err(Error::Input(format!("{}: damaged: it is not as it was written ({what}); {advice}", file.display())))
    }
}

/// Size and SHA-256 of a file.
fn sum(file: &Path) -> Result<(u64, String)> {
    let read = || -> std::io::Result<(u64, String)> {
        let mut hash = Sha256::new();
        let bytes = std::io::copy(&mut File::open(file)?, &mut hash)?;
        Ok((bytes, hexadecimal(&hash.finalize())))
    };
    read().map_err(|e| Error::Input(format!("cannot read {}: {e}", file.display())))
}

/// An open manifest, locked where the file system can.
#[derive(Debug)]
pub(super) struct Manifest {
    path: PathBuf,
    file: File,
    /// True if there is a lock: some file systems have none.
    pub(super) locked: bool,
    /// Checksum of the last line.
    chain: String,
    /// Bytes of whole lines.
    length: u64,
    /// The parts of the run.
    pub(super) parts: Vec<RunOrigin>,
    /// Its segments.
    pub(super) entries: Vec<Entry>,
    /// True if they are in the result file already.
    pub(super) merged: bool,
}

impl Manifest {
    /// Opens and locks the manifest of a folder; made where it is missing and `create`, none if not. A fault of its
    /// lines is the second value: the caller may want to begin anew.
    pub(super) fn open(folder: &Path, create: bool) -> Result<Option<(Self, Result<()>)>> {
        let path = folder.join("manifest");
        // The file may go between opening and locking it, with the run that it belonged to.
        for _ in 0..100 {
            let opened = OpenOptions::new().read(true).write(true).create(create).truncate(false).open(&path);
            let file = match opened {
                Ok(file) => file,
                Err(e) if e.kind() == std::io::ErrorKind::NotFound && !create => return Ok(None),
                Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                    std::fs::create_dir_all(folder).map_err(|e| failure(&path, &e))?;
                    continue;
                }
                Err(e) => return Err(failure(&path, &e)),
            };
            let locked = lock(&file, folder)?;
            let same = std::fs::metadata(&path).ok().zip(file.metadata().ok());
            if same.is_some_and(|(a, b)| (a.dev(), a.ino()) == (b.dev(), b.ino())) {
                let mut manifest = Self {
                    path,
                    file,
                    locked,
                    chain: String::new(),
                    length: 0,
                    parts: Vec::new(),
                    entries: Vec::new(),
                    merged: false,
                };
                let read = manifest.read();
                return Ok(Some((manifest, read)));
            }
        }
        Err(Error::Io(format!("cannot lock {}: it comes and goes; is another run at work there?", path.display())))
    }

    /// Takes up the lines there are.
    fn read(&mut self) -> Result<()> {
        let mut bytes = Vec::new();
        self.file
            .read_to_end(&mut bytes)
            .map_err(|e| Error::Io(format!("cannot read {}: {e}", self.path.display())))?;
        for (number, line) in (1..).zip(bytes.split_inclusive(|&b| b == b'\n')) {
            // What a killed run had begun to write.
            let Some(line) = line.strip_suffix(b"\n") else { break };
            let path = self.path.clone();
            let wrong = |what: String| {
                Error::Input(format!(
                    "{}: line {number}: damaged: {what}; bring the file back from a copy, or begin again with --force",
                    path.display()
                ))
            };
            let text = std::str::from_utf8(line).map_err(|e| wrong(e.to_string()))?;
            let (sum, record) = text.split_once(' ').ok_or_else(|| wrong("it has no checksum".into()))?;
            if sum != next(&self.chain, record) {
                return Err(wrong("its checksum does not fit it and the lines before".into()));
            }
            let record = serde_json::from_str(record).map_err(|e| wrong(e.to_string()))?;
            self.take(record).map_err(wrong)?;
            self.chain = sum.to_owned();
            self.length += line.len() as u64 + 1;
        }
        Ok(())
    }

    /// Applies a record; an error if it contradicts earlier records.
    fn take(&mut self, record: Record) -> std::result::Result<(), String> {
        match record {
            Record::Part(part) => self.parts.push(part),
            Record::Segment(entry) => {
                let expected = self.entries.last().map_or(0, |e| e.last + 1);
                if entry.first != expected || entry.last < entry.first {
                    return Err(format!(
                        "a segment of the steps {} to {} where step {expected} comes next",
                        entry.first, entry.last
                    ));
                }
                self.entries.push(entry);
            }
            Record::Cut(step) => self.entries.retain(|e| e.last <= step),
            Record::Merged => self.merged = true,
        }
        Ok(())
    }

    /// Adds a record and brings it to the disk.
    fn add(&mut self, record: Record) -> Result<()> {
        let text = serde_json::to_string(&record).map_err(|e| Error::Defect(format!("manifest: {e}")))?;
        let chain = next(&self.chain, &text);
        let line = format!("{chain} {text}\n");
        let mut write = || {
            self.file.set_len(self.length)?;
            self.file.seek(SeekFrom::Start(self.length))?;
            self.file.write_all(line.as_bytes())?;
            self.file.sync_data()
        };
        write().map_err(|e| failure(&self.path, &e))?;
        self.take(record).map_err(|e| Error::Defect(format!("manifest: {e}")))?;
        self.chain = chain;
        self.length += line.len() as u64;
        Ok(())
    }

    /// The run is begun, or goes on after what there is.
    pub(super) fn record_origin(&mut self, part: RunOrigin) -> Result<()> {
        self.add(Record::Part(part))
    }

    /// A segment is about to get its name.
    pub(super) fn segment(&mut self, entry: Entry) -> Result<()> {
        self.add(Record::Segment(entry))
    }

    /// Removes all segments but the first `count`.
    pub(super) fn cut(&mut self, count: usize) -> Result<()> {
        match self.entries.get(..count).and_then(<[Entry]>::last).map(|e| e.last) {
            Some(step) if count < self.entries.len() => self.add(Record::Cut(step)),
            _ => Ok(()),
        }
    }

    /// All segments are in the result file.
    pub(super) fn merge(&mut self) -> Result<()> {
        self.add(Record::Merged)
    }

    /// Forgets everything, for a run that begins.
    pub(super) fn clear(&mut self) -> Result<()> {
        self.file.set_len(0).map_err(|e| failure(&self.path, &e))?;
        (self.chain, self.length, self.merged) = (String::new(), 0, false);
        self.parts.clear();
        self.entries.clear();
        Ok(())
    }

    /// Removes the file.
    pub(super) fn remove(&self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Checksum of a line after one with the checksum `before`.
fn next(before: &str, record: &str) -> String {
    hexadecimal(&Sha256::new().chain_update(before).chain_update(record).finalize())
}

/// Locks the manifest of `folder`; false where the file system has no locks. `Error::Job` if another run has it.
fn lock(file: &File, folder: &Path) -> Result<bool> {
    match rustix::fs::flock(file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(true),
        Err(Errno::WOULDBLOCK) => {
            let mut text = String::new();
            let _ = (&*file).read_to_string(&mut text);
            let parts = text.lines().filter_map(|l| serde_json::from_str(l.split_once(' ')?.1).ok());
            let last = parts.filter_map(|r| if let Record::Part(p) = r { Some(p) } else { None }).next_back();
            let who = last.map_or(String::new(), |p| format!(" (process {} on {}, since {})", p.pid, p.host, p.date));
            Err(Error::Job(format!(
                "{}: another run is at work there{who}; wait for its end, or name another --output",
                folder.display()
            )))
        }
        Err(Errno::NOSYS | Errno::OPNOTSUPP | Errno::NOLCK | Errno::INVAL) => Ok(false),
        Err(e) => Err(failure(&folder.join("manifest"), &std::io::Error::from(e))),
    }
}
