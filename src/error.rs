//! The one error type of the library. Its variants are the program's exit codes.

use std::borrow::Cow;
use std::fmt;

/// Every failure, by what the user can do about it. [`Error::exit_code`] maps it to the exit code of the process.
#[derive(Debug, Clone, thiserror::Error)]
pub enum Error {
    /// A defect of the program: an invariant that input must not be able to break was broken.
    #[error("internal defect: {0}. Please report this with the job file.")]
    Defect(String),
    /// Wrong usage or a wrong job file: what is wrong, where, what was expected.
    #[error("{0}")]
    Job(String),
    /// A mesh or another input file is missing or wrong.
    #[error("{0}")]
    Input(String),
    /// A solver did not converge, or returned something that fails its own check.
    #[error("{0}")]
    NotConverged(String),
    /// Stopped on request or by the wall-time limit; a checkpoint was saved.
    #[error("{0}")]
    Stopped(String),
    /// Reading or writing failed.
    #[error("{0}")]
    Io(String),
    /// Not enough memory: how much is needed, how much there is.
    #[error("{0}")]
    Memory(String),
}

/// Result with the library's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Exit code of the process: 1 defect, 2 usage or job, 3 input data, 4 not converged, 5 stopped, 6 I/O, 7 memory.
    ///
    /// ```
    /// use railsqueal::Error;
    ///
    /// assert_eq!(Error::Job("contact.friction: found -1".into()).exit_code(), 2);
    /// ```
    pub fn exit_code(&self) -> i32 {
        match self {
            Error::Defect(_) => 1,
            Error::Job(_) => 2,
            Error::Input(_) => 3,
            Error::NotConverged(_) => 4,
            Error::Stopped(_) => 5,
            Error::Io(_) => 6,
            Error::Memory(_) => 7,
        }
    }

    /// The variant that [`Error::exit_code`] maps to `code`; rebuilds on every rank the error of one rank.
    pub(crate) fn from_code(code: i32, message: String) -> Self {
        match code {
            2 => Error::Job(message),
            3 => Error::Input(message),
            4 => Error::NotConverged(message),
            5 => Error::Stopped(message),
            6 => Error::Io(message),
            7 => Error::Memory(message),
            _ => Error::Defect(message),
        }
    }

    /// The message without the prefix that the variant's display adds.
    pub fn message(&self) -> &str {
        match self {
            Error::Defect(m)
            | Error::Job(m)
            | Error::Input(m)
            | Error::NotConverged(m)
            | Error::Stopped(m)
            | Error::Io(m)
            | Error::Memory(m) => m,
        }
    }

    /// All errors among these as one, each of them once, with the exit code of the first; `Ok` where there is none.
    pub fn all(results: impl IntoIterator<Item = Result<()>>) -> Result<()> {
        let mut found: Vec<Error> = Vec::new();
        for error in results.into_iter().filter_map(|r| r.err()) {
            if found.iter().all(|e| e.message() != error.message()) {
                found.push(error);
            }
        }
        match &found[..] {
            [] => Ok(()),
            [one] => Err(one.clone()),
            [first, ..] => {
                let texts: Vec<&str> = found.iter().map(|e| e.message()).collect();
                Err(Error::from_code(first.exit_code(), format!("{} faults:\n  {}", found.len(), texts.join("\n  "))))
            }
        }
    }

    /// The same error with a further line: what to do about it.
    pub fn with(self, line: impl fmt::Display) -> Self {
        Error::from_code(self.exit_code(), format!("{}\n  {line}", self.message()))
    }

    /// The same error with `what` put before its message: the place in the run where it happened.
    pub fn context(self, what: impl fmt::Display) -> Self {
        Error::from_code(self.exit_code(), format!("{what}: {}", self.message()))
    }
}

/// The `text` with characters that steer a terminal, or the order in which text is read, written as escapes
/// (`\\u{1b}`); lines and tabs stay. For everything that may quote a file and goes to stdout or stderr.
pub fn printable(text: &str) -> Cow<'_, str> {
    let steers = |c: char| {
        (c.is_control() && !matches!(c, '\n' | '\t'))
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match steers(c) {
            true => shown.extend(c.escape_unicode()),
            false => shown.push(c),
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_that_steer_a_terminal_are_escaped() {
        assert!(matches!(printable("a µm\n\tb"), Cow::Borrowed(_)));
        assert_eq!(printable("\u{1b}[31mred\r\u{9b}\u{7f}\u{202e}"), r"\u{1b}[31mred\u{d}\u{9b}\u{7f}\u{202e}");
    }

    #[test]
    fn errors_come_together_each_once() {
        let job = |text: &str| Err(Error::Job(text.into()));
        assert!(Error::all([Ok(()), Ok(())]).is_ok());
        assert_eq!(Error::all([Ok(()), job("a"), job("a")]).map_err(|e| e.to_string()), Err("a".into()));
        let both = Error::all([Err(Error::Input("a".into())), job("b"), Ok(())]).expect_err("two");
        assert_eq!((both.exit_code(), both.message()), (3, "2 faults:\n  a\n  b"));
    }
}
