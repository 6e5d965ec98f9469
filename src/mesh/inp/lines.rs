//! Lines of a file and of those that it includes, without comments, with their places.

use super::{FileOrigin, Files};
use crate::input::text::without_mark;
use crate::{Error, Result};
use std::io::BufRead;
use std::path::{Path, PathBuf};

/// A file by its number (upper half) and a line of it, from 1.
pub type Place = u64;

/// Number of the file, and line.
pub fn place(at: Place) -> [u64; 2] {
    [at >> 40, at & ((1 << 40) - 1)]
}

/// No line is longer, in bytes.
const LONGEST: u64 = 1 << 20;
/// Files in files in files: no deck goes deeper.
const DEEPEST: usize = 20;
/// No deck has more files: one that includes others many times over would be read for ever.
const MOST: usize = 10_000;

/// A file that is being read.
struct Open<'a> {
    text: Box<dyn BufRead + 'a>,
    /// Its number among all files.
    number: usize,
    line: u64,
}

/// The lines of a deck, one after the other.
pub struct DeckLines<'a> {
    /// Every file that was opened, the first one first.
    pub files: Vec<PathBuf>,
    open: Vec<Open<'a>>,
    buffer: Vec<u8>,
    /// The line is to be given once more.
    again: bool,
    text: String,
    at: Place,
}

impl<'a> DeckLines<'a> {
    pub fn new(text: Box<dyn BufRead + 'a>, path: PathBuf) -> Self {
        let open = vec![Open { text, number: 0, line: 0 }];
        DeckLines { files: vec![path], open, buffer: Vec::new(), again: false, text: String::new(), at: 0 }
    }

    /// Place of the last line.
    pub fn place(&self) -> Place {
        self.at
    }

    /// The last line, trimmed.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// An error at the place `at`.
    pub fn error(&self, at: Place, what: impl std::fmt::Display) -> Error {
        Files { names: self.files.clone(), ..Files::default() }.error(at, what.to_string())
    }

    /// An error at the last line.
    pub fn wrong(&self, what: impl std::fmt::Display) -> Error {
        self.error(self.at, what)
    }

    /// Reads on to the next line that is neither blank nor a comment; false behind the last one.
    pub fn next(&mut self) -> Result<bool> {
        if std::mem::take(&mut self.again) {
            return Ok(true);
        }
        while let Some(open) = self.open.last_mut() {
            self.buffer.clear();
            let read = std::io::Read::take(&mut open.text, LONGEST).read_until(b'\n', &mut self.buffer);
            open.line += 1;
            self.at = (open.number as u64) << 40 | open.line;
            match read {
                Err(e) => return Err(self.wrong(format!("cannot be read: {e}"))),
                Ok(0) => drop(self.open.pop()),
                Ok(n) if n as u64 == LONGEST => {
                    return Err(self.wrong(format!("a line of more than {LONGEST} bytes; is it a mesh file?")))
                }
                Ok(_) => {
                    self.text.clear();
                    let bytes = if open.line == 1 { without_mark(&self.buffer) } else { &self.buffer };
                    self.text.push_str(String::from_utf8_lossy(bytes).trim());
                    if !self.text.is_empty() && !self.text.starts_with("**") {
                        return Ok(true);
                    }
                }
            }
        }
        self.text.clear();
        Ok(false)
    }

    /// Reads on to the next line if it is a data line; false before a keyword and at the end.
    pub fn data(&mut self) -> Result<bool> {
        let there = self.next()?;
        self.again = there && self.text.starts_with('*');
        Ok(there && !self.again)
    }

    /// Reads on in the file `name`, relative to the folder of the file of the last line.
    pub fn include(&mut self, name: &str) -> Result<()> {
        let folder = self.files.get(place(self.at)[0] as usize).and_then(|f| f.parent()).unwrap_or(Path::new(""));
        let path = folder.join(name);
        let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
            (Ok(a), Ok(b)) => a == b,
            _ => a == b,
        };
        if self.open.iter().any(|o| same(&self.files[o.number], &path)) {
            return Err(self.wrong(format!(
                "*INCLUDE of {}, which is being read: files include each other in a circle",
                path.display()
            )));
        }
        if self.open.len() >= DEEPEST || self.files.len() >= MOST {
            return Err(self.wrong(format!(
                "*INCLUDE of {}: more than {DEEPEST} files in each other, or {MOST} in all",
                path.display()
            )));
        }
        let file = crate::input::open(&path)
            .map_err(|e| self.wrong(format!("*INCLUDE of {}, which cannot be read: {e}", path.display())))?;
        let text = Box::new(std::io::BufReader::with_capacity(1 << 18, file));
        self.open.push(Open { text, number: self.files.len(), line: 0 });
        self.files.push(path);
        Ok(())
    }
}
