//! Reads numbers and lines from an MSH file in memory, ASCII or binary, and names the place where one is wrong.

use crate::{Error, Result};

/// Position in the bytes of a file.
pub(super) struct Cursor<'a> {
    data: &'a [u8],
    pos: usize,
    name: &'a str,
    /// Numbers are binary.
    pub binary: bool,
    /// Binary numbers have the other byte order.
    pub swapped: bool,
}

/// At most this many bytes of a wrong token are quoted.
const QUOTED: usize = 40;

impl<'a> Cursor<'a> {
    pub fn new(data: &'a [u8], name: &'a str) -> Self {
        Self { data, pos: 0, name, binary: false, swapped: false }
    }

    /// Where the cursor stands, for [`Cursor::error_at`].
    pub fn pos(&self) -> usize {
        self.pos
    }

    /// Bytes left: an upper bound of what any count in the file can be worth.
    pub fn left(&self) -> usize {
        self.data.len() - self.pos
    }

    /// An error that names the file and the place `at`: the line of an ASCII file, the byte offset of a binary one.
    pub fn error_at(&self, at: usize, what: impl std::fmt::Display) -> Error {
        let at = at.min(self.data.len());
        if self.binary {
            return Error::Input(format!("{}, byte {at}: {what}", self.name));
        }
        // The line of what stands there, not the one whose end is there.
        let at = at + self.data[at..].iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(0);
        let line = 1 + self.data[..at].iter().filter(|&&b| b == b'\n').count();
        Error::Input(format!("{}, line {line}: {what}", self.name))
    }

    /// [`Cursor::error_at`] the position of the cursor.
    pub fn error(&self, what: impl std::fmt::Display) -> Error {
        self.error_at(self.pos, what)
    }

    fn truncated(&self, expected: &str) -> Error {
        self.error_at(self.data.len(), format!("the file ends here; expected {expected}. It may be truncated"))
    }

    /// The next line without its end, trimmed; `None` at the end of the file.
    pub fn line(&mut self) -> Option<String> {
        if self.pos >= self.data.len() {
            return None;
        }
        let rest = &self.data[self.pos..];
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.pos += (end + 1).min(rest.len());
        Some(String::from_utf8_lossy(&rest[..end]).trim().to_string())
    }

    /// The next line that is not blank.
    pub fn filled_line(&mut self) -> Option<String> {
        loop {
            let line = self.line()?;
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    /// Moves behind the line `mark` (such as `$EndNodes`); it may begin anywhere in a binary section.
    pub fn skip_past(&mut self, mark: &str) -> Result<()> {
        let bytes = mark.as_bytes();
        let from = self.pos;
        let mut at = from;
        while at + bytes.len() <= self.data.len() {
            match self.data[at..].iter().position(|&b| b == b'$') {
                Some(step) => at += step,
                None => break,
            }
            if self.data[at..].starts_with(bytes) {
                self.pos = at;
                self.line();
                return Ok(());
            }
            at += 1;
        }
        Err(self.truncated(mark))
    }

    /// Expects the line `mark` next.
    pub fn expect(&mut self, mark: &str) -> Result<()> {
        while self.data.get(self.pos).is_some_and(u8::is_ascii_whitespace) {
            self.pos += 1;
        }
        let at = self.pos;
        if self.data[at..].starts_with(mark.as_bytes()) {
            self.line();
            return Ok(());
        }
        if at == self.data.len() {
            return Err(self.truncated(mark));
        }
        Err(self.error_at(at, format!("found {}; expected {mark}", quote(&self.data[at..]))))
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N]> {
        let Some(bytes) = self.data.get(self.pos..self.pos + N) else { return Err(self.truncated(what)) };
        let mut out = [0; N];
        out.copy_from_slice(bytes);
        if self.swapped {
            out.reverse();
        }
        self.pos += N;
        Ok(out)
    }

    fn token(&mut self, what: &str) -> Result<&'a [u8]> {
        let data = self.data;
        let mut at = self.pos;
        while data.get(at).is_some_and(u8::is_ascii_whitespace) {
            at += 1;
        }
        let start = at;
        while data.get(at).is_some_and(|b| !b.is_ascii_whitespace()) {
            at += 1;
        }
        if start == at {
            return Err(self.truncated(what));
        }
        self.pos = at;
        Ok(&data[start..at])
    }

    fn wrong(&self, token: &[u8], what: &str) -> Error {
        self.error_at(self.pos - token.len(), format!("found {}; expected {what}", quote(token)))
    }

    /// A C int. In binary files 4 bytes.
    pub fn int(&mut self, what: &str) -> Result<i32> {
        if self.binary {
            return Ok(i32::from_le_bytes(self.take(what)?));
        }
        let token = self.token(what)?;
        parse(token).ok_or_else(|| self.wrong(token, &format!("{what}, an integer")))
    }

    /// A count on a line of its own, text in binary files too.
    pub fn line_count(&mut self, what: &str) -> Result<u64> {
        let at = self.pos;
        let Some(line) = self.filled_line() else { return Err(self.truncated(what)) };
        line.parse().map_err(|_| self.error_at(at, format!("found {}; expected {what}", quote(line.as_bytes()))))
    }

    /// A number of a node or element above 0. In binary files 4 bytes.
    pub fn tag(&mut self, what: &str) -> Result<u64> {
        if !self.binary {
            return self.size(what);
        }
        let at = self.pos;
        let value = self.int(what)?;
        u64::try_from(value).map_err(|_| self.error_at(at, format!("found {value}; expected {what}, not negative")))
    }

    /// A size or tag. In binary files 8 bytes.
    pub fn size(&mut self, what: &str) -> Result<u64> {
        if self.binary {
            return Ok(u64::from_le_bytes(self.take(what)?));
        }
        let token = self.token(what)?;
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
            let at = self.pos;
            let value = f64::from_le_bytes(self.take(what)?);
            return if value.is_finite() {
                Ok(value)
            } else {
                Err(self.error_at(at, format!("found {value}; expected {what}, a finite number")))
            };
        }
        let token = self.token(what)?;
        parse(token)
            .filter(|v: &f64| v.is_finite())
            .ok_or_else(|| self.wrong(token, &format!("{what}, a finite number")))
    }

    /// In an ASCII file: expects the end of the line; a record with too many entries would otherwise shift all that follow.
    pub fn end_of_line(&mut self, what: &str) -> Result<()> {
        if self.binary {
            return Ok(());
        }
        while self.data.get(self.pos).is_some_and(|&b| b == b' ' || b == b'\t' || b == b'\r') {
            self.pos += 1;
        }
        match self.data.get(self.pos) {
            None | Some(b'\n') => Ok(()),
            Some(_) => Err(self
                .error(format!("found {} behind {what}; expected the end of the line", quote(&self.data[self.pos..])))),
        }
    }
}

fn parse<T: std::str::FromStr>(token: &[u8]) -> Option<T> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

/// The beginning of wrong bytes, up to the end of the line, printable.
fn quote(bytes: &[u8]) -> String {
    let end = bytes.iter().take(QUOTED).position(|&b| b == b'\n' || b == b'\r').unwrap_or(bytes.len().min(QUOTED));
    format!("\"{}\"", bytes[..end].escape_ascii())
}
