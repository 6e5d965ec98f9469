//! Reads numbers and lines of an MSH file, ASCII or binary, and names the place where one is wrong. A window of the
//! file is in memory, never all of it.

use crate::input::text::without_mark;
use crate::{Error, Result};
use std::cell::RefCell;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;

/// Input: a file, or bytes in memory.
pub(super) trait InputSource: Read + Seek {}

impl<T: Read + Seek> InputSource for T {}

/// Position in the bytes of a file.
pub(super) struct Cursor<'a> {
    source: RefCell<&'a mut dyn InputSource>,
    /// Bytes of the file from `base` on.
    window: Vec<u8>,
    base: u64,
    /// Position of the cursor in the window.
    at: usize,
    /// Bytes of the file in all.
    length: u64,
    /// The window reaches to the end of the file.
    ended: bool,
    name: &'a str,
    /// Numbers are binary.
    pub binary: bool,
    /// Binary numbers have the other byte order.
    pub swapped: bool,
}

/// At most this many bytes of a wrong token are quoted.
const QUOTED: usize = 40;
/// Bytes read at once.
const CHUNK: usize = 1 << 18;
/// No line and no word of a mesh file is longer, in bytes.
const LONGEST: usize = 1 << 20;

impl<'a> Cursor<'a> {
    pub fn new(source: &'a mut dyn InputSource, name: &'a str) -> Result<Self> {
        let length = source.seek(SeekFrom::End(0)).and_then(|n| source.rewind().map(|()| n));
        let length = length.map_err(|e| unreadable(name, &e))?;
        let source = RefCell::new(source);
        let window = Vec::new();
        Ok(Self { source, window, base: 0, at: 0, length, ended: false, name, binary: false, swapped: false })
    }

    /// Position of the cursor, for [`Cursor::error_at`].
    pub fn pos(&self) -> u64 {
        self.base + self.at as u64
    }

    /// Bytes left: an upper bound of what any count in the file can be worth.
    pub fn left(&self) -> usize {
        (self.length - self.pos().min(self.length)) as usize
    }

    /// An error that names the file and the place `at`: the line of an ASCII file, the byte offset of a binary one.
    pub fn error_at(&self, at: u64, what: impl std::fmt::Display) -> Error {
        let at = at.min(self.length);
        if self.binary {
            return Error::Input(format!("{}, byte {at}: {what}", self.name));
        }
        match self.line_of(at) {
            Ok(line) => Error::Input(format!("{}, line {line}: {what}", self.name)),
            Err(e) => unreadable(self.name, &e),
        }
    }

    /// [`Cursor::error_at`] the position of the cursor.
    pub fn error(&self, what: impl std::fmt::Display) -> Error {
        self.error_at(self.pos(), what)
    }

    /// The line of the first thing that stands at the byte `at` or behind it, from 1: the file is read again up to
    /// there.
    fn line_of(&self, at: u64) -> std::io::Result<u64> {
        let mut source = self.source.borrow_mut();
        let back = source.stream_position()?;
        source.rewind()?;
        let (mut line, mut pos, mut chunk) = (1, 0u64, vec![0; CHUNK]);
        // Line ends between `at` and what stands there, which count if something does.
        let mut between = 0;
        'file: loop {
            let n = source.read(&mut chunk)?;
            if n == 0 {
                break;
            }
            for &b in &chunk[..n] {
                if pos < at {
                    line += u64::from(b == b'\n');
                } else if b.is_ascii_whitespace() {
                    between += u64::from(b == b'\n');
                } else {
                    line += between;
                    break 'file;
                }
                pos += 1;
            }
        }
        source.seek(SeekFrom::Start(back))?;
        Ok(line)
    }

    fn truncated(&self, expected: &str) -> Error {
        self.error_at(self.length, format!("the file ends here; expected {expected}. It may be truncated"))
    }

    /// Reads on behind the window and drops what lies before the cursor; false at the end of the file.
    fn fill(&mut self) -> Result<bool> {
        if self.ended {
            return Ok(false);
        }
        self.window.drain(..self.at);
        self.base += self.at as u64;
        self.at = 0;
        let kept = self.window.len();
        self.window.resize(kept + CHUNK, 0);
        let read = loop {
            match self.source.borrow_mut().read(&mut self.window[kept..]) {
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                read => break read,
            }
        };
        let read = read.map_err(|e| unreadable(self.name, &e))?;
        self.window.truncate(kept + read);
        self.ended = read == 0;
        Ok(!self.ended)
    }

    /// Has the next `n` bytes in the window if the file has so many.
    fn ensure(&mut self, n: usize) -> Result<()> {
        while self.window.len() - self.at < n && self.fill()? {}
        Ok(())
    }

    /// Bytes in the window up to the first one that `ends` the search, or to the end of the file.
    fn until(&mut self, ends: impl Fn(&u8) -> bool) -> Result<Range<usize>> {
        let mut searched = 0;
        loop {
            if let Some(n) = self.window[self.at + searched..].iter().position(&ends) {
                return Ok(self.at..self.at + searched + n);
            }
            searched = self.window.len() - self.at;
            if searched > LONGEST {
                return Err(self.error(format!("a line of more than {LONGEST} bytes; is it a mesh file?")));
            }
            if !self.fill()? {
                return Ok(self.at..self.window.len());
            }
        }
    }

    /// Moves to the first byte that is not white.
    fn skip_white(&mut self) -> Result<()> {
        loop {
            match self.window[self.at..].iter().position(|b| !b.is_ascii_whitespace()) {
                Some(n) => {
                    self.at += n;
                    return Ok(());
                }
                None => self.at = self.window.len(),
            }
            if !self.fill()? {
                return Ok(());
            }
        }
    }

    /// Moves behind a byte order mark.
    pub fn skip_mark(&mut self) -> Result<()> {
        self.ensure(3)?;
        let here = &self.window[self.at..];
        self.at += here.len() - without_mark(here).len();
        Ok(())
    }

    /// The next line without its end, trimmed; `None` at the end of the file.
    pub fn line(&mut self) -> Result<Option<String>> {
        self.ensure(1)?;
        if self.at == self.window.len() {
            return Ok(None);
        }
        let range = self.until(|&b| b == b'\n')?;
        self.at = (range.end + 1).min(self.window.len());
        Ok(Some(String::from_utf8_lossy(&self.window[range]).trim().to_string()))
    }

    /// The next line that is not blank.
    pub fn filled_line(&mut self) -> Result<Option<String>> {
        while let Some(line) = self.line()? {
            if !line.is_empty() {
                return Ok(Some(line));
            }
        }
        Ok(None)
    }

    /// Moves behind the line `mark` (such as `$EndNodes`); it may begin anywhere in a binary section.
    pub fn skip_past(&mut self, mark: &str) -> Result<()> {
        loop {
            match self.window[self.at..].iter().position(|&b| b == b'$') {
                Some(step) => {
                    self.at += step;
                    self.ensure(mark.len())?;
                    if self.window[self.at..].starts_with(mark.as_bytes()) {
                        self.line()?;
                        return Ok(());
                    }
                    self.at += 1;
                }
                None => {
                    self.at = self.window.len();
                    if !self.fill()? {
                        return Err(self.truncated(mark));
                    }
                }
            }
        }
    }

    /// Expects the line `mark` next.
    pub fn expect(&mut self, mark: &str) -> Result<()> {
        self.skip_white()?;
        self.ensure(mark.len().max(QUOTED))?;
        let here = &self.window[self.at..];
        if here.starts_with(mark.as_bytes()) {
            self.line()?;
            return Ok(());
        }
        if here.is_empty() {
            return Err(self.truncated(mark));
        }
        Err(self.error(format!("found {}; expected {mark}", quote(here))))
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        self.ensure(N)?;
        let Some(bytes) = self.window.get(self.at..self.at + N) else { return Err(self.truncated(what)) };
        let mut out = [0; N];
        out.copy_from_slice(bytes);
        if self.swapped {
            out.reverse();
        }
        self.at += N;
        Ok(out)
    }

    /// The next word, as its place in the window; the cursor stands behind it.
    fn token(&mut self, what: &str) -> Result<Range<usize>> {
        self.skip_white()?;
        let range = self.until(u8::is_ascii_whitespace)?;
        if range.is_empty() {
            return Err(self.truncated(what));
        }
        self.at = range.end;
        Ok(range)
    }

    fn wrong(&self, token: &[u8], what: &str) -> Error {
        self.error_at(self.pos() - token.len() as u64, format!("found {}; expected {what}", quote(token)))
    }

    /// A C int. In binary files 4 bytes.
    pub fn int(&mut self, what: &str) -> Result<i32> {
        if self.binary {
            return Ok(i32::from_le_bytes(self.take(what)?));
        }
        let range = self.token(what)?;
        let token = &self.window[range];
        parse(token).ok_or_else(|| self.wrong(token, &format!("{what}, an integer")))
    }

    /// A count on a line of its own, text in binary files too.
    pub fn line_count(&mut self, what: &str) -> Result<u64> {
        let at = self.pos();
        let Some(line) = self.filled_line()? else { return Err(self.truncated(what)) };
        line.parse().map_err(|_| self.error_at(at, format!("found {}; expected {what}", quote(line.as_bytes()))))
    }

    /// A number of a node or element above 0. In binary files 4 bytes.
    pub fn tag(&mut self, what: &str) -> Result<u64> {
        if !self.binary {
            return self.size(what);
        }
        let at = self.pos();
        let value = self.int(what)?;
        u64::try_from(value).map_err(|_| self.error_at(at, format!("found {value}; expected {what}, not negative")))
    }

    /// A size or tag. In binary files 8 bytes.
    pub fn size(&mut self, what: &str) -> Result<u64> {
        if self.binary {
            return Ok(u64::from_le_bytes(self.take(what)?));
        }
        let range = self.token(what)?;
        let token = &self.window[range];
        // Most of a file is such numbers: digits are read here, everything else by the standard library.
        let mut value = 0u64;
        for &b in token {
            let digit = b.wrapping_sub(b'0');
            match value.checked_mul(10).and_then(|v| v.checked_add(u64::from(digit))) {
                Some(v) if digit < 10 => value = v,
                _ => return Err(self.wrong(token, &format!("{what}, a whole number"))),
            }
        }
        Ok(value)
    }

    /// A finite double.
    pub fn double(&mut self, what: &str) -> Result<f64> {
        if self.binary {
            let at = self.pos();
            let value = f64::from_le_bytes(self.take(what)?);
            return if value.is_finite() {
                Ok(value)
            } else {
                Err(self.error_at(at, format!("found {value}; expected {what}, a finite number")))
            };
        }
        let range = self.token(what)?;
        let token = &self.window[range];
        parse(token)
            .filter(|v: &f64| v.is_finite())
            .ok_or_else(|| self.wrong(token, &format!("{what}, a finite number")))
    }

    /// In an ASCII file: expects the end of the line; a record with too many entries would otherwise shift all that
    /// follow.
    pub fn end_of_line(&mut self, what: &str) -> Result<()> {
        if self.binary {
            return Ok(());
        }
        loop {
            match self.window.get(self.at).copied() {
                Some(b' ' | b'\t' | b'\r') => self.at += 1,
                Some(b'\n') => return Ok(()),
                Some(_) => break,
                None if self.fill()? => {}
                None => return Ok(()),
            }
        }
        self.ensure(QUOTED)?;
        Err(self.error(format!("found {} behind {what}; expected the end of the line", quote(&self.window[self.at..]))))
    }
}

fn unreadable(name: &str, error: &std::io::Error) -> Error {
    Error::Input(format!("mesh file {name} cannot be read: {error}"))
}

fn parse<T: std::str::FromStr>(token: &[u8]) -> Option<T> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

/// The beginning of wrong bytes, up to the end of the line, printable.
fn quote(bytes: &[u8]) -> String {
    let end = bytes.iter().take(QUOTED).position(|&b| b == b'\n' || b == b'\r').unwrap_or(bytes.len().min(QUOTED));
    format!("\"{}\"", bytes[..end].escape_ascii())
}
