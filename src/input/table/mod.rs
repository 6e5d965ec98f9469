//! Tables of numbers in text files: one reader for profiles, roughness and every other measured file.
//!
//! - **Encoding**: UTF-8 or UTF-16 with their byte order marks, UTF-8 or Latin-1 without; any line ends.
//! - **Comments** begin with `#`, `!`, `%` or `//`; behind the numbers of a row with `#`, `!` or `//`.
//! - **Separator and decimal sign** are found from the whole file: semicolons, tabs, blanks or commas, one of them
//!   throughout. Every row has the same number of finite numbers. Whole numbers between commas that could be the digits
//!   behind decimal commas are refused.
//! - **Headings**: one row of names, with units in brackets or in a row of their own; they are followed. A comment
//!   right above the numbers whose words are known names is a row of headings.
//! - **Columns**: a numbering of the rows under a heading such as `i` or `index` is left out; any other column that is
//!   not expected is refused.

mod columns;
mod layout;
#[cfg(test)]
mod tests;

pub use columns::{Column, ColumnPair};
use layout::{Separator, TableLayout};

use super::text;
use crate::{Error, Result};
use std::path::Path;

/// Largest file that is taken for a table, bytes.
const LARGEST: usize = 200_000_000;

/// A table: rows of numbers, all of the same length.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberTable {
    name: String,
    headings: Option<Headings>,
    /// Words of the comment right above the first row.
    comment: Option<Headings>,
    /// Numbers, row by row.
    values: Vec<f64>,
    /// Lines of the rows, from 1.
    lines: Vec<usize>,
    columns: usize,
    /// True for the columns whose fields are digits alone.
    whole: Vec<bool>,
    layout: TableLayout,
    /// True where a decimal sign occurs.
    fractions: bool,
}

/// A row of names.
#[derive(Debug, Clone, PartialEq)]
struct Headings {
    line: usize,
    names: Vec<String>,
    /// Units of a row of their own, empty without one.
    units: Vec<String>,
}

/// A line that is neither empty nor a comment, without a comment at its end.
type Line<'a> = (usize, &'a str);

impl NumberTable {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// A file that cannot be read or is no text; rows that are no numbers or differ in length; commas that may be
    /// separators or decimal signs.
    pub fn read(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let bytes = super::read(path).map_err(|e| Error::Input(format!("{name}: {e}; expected a table of numbers")))?;
        Self::from_bytes(&name, &bytes)
    }

    /// Reads the bytes of a file called `name` in messages.
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self> {
        if bytes.len() > LARGEST {
            return Err(Error::Input(format!(
                "{name}: found {} MB, expected a table of at most {} MB",
                bytes.len() / 1_000_000,
                LARGEST / 1_000_000
            )));
        }
        let text = text::decode(bytes).map_err(|e| Error::Input(format!("{name}: {e}")))?;
        Self::parse(name, &text)
    }

    /// Reads a text.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        Self::of_lines(name, text::lines(text.trim_start_matches('\u{feff}')))
    }

    /// Reads numbered lines of a text, such as those behind the header of another format.
    pub fn of_lines<'a>(name: &str, lines: impl Iterator<Item = Line<'a>>) -> Result<Self> {
        let mut rows: Vec<Line> = Vec::new();
        let mut comment: Option<Line> = None;
        for (number, line) in lines {
            let bare = uncommented(line);
            if bare.is_empty() {
                // The last comment above the first row may have its headings.
                let words = line.trim().trim_start_matches(['#', '!', '%', '/', '\u{feff}']).trim();
                if rows.is_empty() && !words.is_empty() {
                    comment = Some((number, words));
                }
            } else if !is_directive(bare) {
                rows.push((number, bare));
            }
        }
        if rows.is_empty() {
            return Err(Error::Input(format!("{name}: found 0 rows of numbers, expected some, such as -39.0; 1.575")));
        }
        let layout = TableLayout::find(name, &rows)?;
        Reader { name, layout }.read(&rows, comment)
    }

    /// Name in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of rows, at least one.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.columns
    }

    /// Numbers of the row `i`.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.columns..(i + 1) * self.columns]
    }

    /// Line of the row `i`, from 1.
    pub fn line(&self, i: usize) -> usize {
        self.lines[i]
    }

    /// An error at the row `i`.
    pub fn fault(&self, i: usize, found: impl std::fmt::Display, expected: impl std::fmt::Display) -> Error {
        Error::Input(format!("{}, line {}: found {found}, expected {expected}", self.name, self.lines[i]))
    }

    /// Separator and decimal sign in words.
    pub fn layout(&self) -> String {
        let sign = match (self.fractions, self.layout.decimal) {
            (false, _) => "whole numbers",
            (true, ',') => "decimal comma",
            (true, _) => "decimal point",
        };
        format!("separated by {}, {sign}", self.layout.separator.name())
    }

    /// Numbers of the headings behind the first one, of a table whose first heading alone is text: the places of an
    /// area.
    pub fn heading_numbers(&self) -> Option<(usize, Vec<f64>)> {
        let headings = self.headings.as_ref()?;
        let numbers = headings.names[1..].iter().map(|n| layout::number(n, self.layout.decimal));
        Some((headings.line, numbers.collect::<Option<_>>()?))
    }

    /// True if there is a row of headings.
    pub fn has_headings(&self) -> bool {
        self.headings.is_some()
    }
}

/// The line without comments, trimmed.
fn uncommented(line: &str) -> &str {
    let line = line.trim().trim_start_matches('\u{feff}');
    if line.starts_with('%') {
        return "";
    }
    let mut quoted = false;
    for (i, c) in line.char_indices() {
        quoted ^= c == '"';
        if !quoted && (c == '#' || c == '!' || line[i..].starts_with("//")) {
            return line[..i].trim_end();
        }
    }
    line
}

/// True for the line by which spreadsheets say their separator, and for separators alone.
fn is_directive(line: &str) -> bool {
    let says = line.get(..4).is_some_and(|head| head.eq_ignore_ascii_case("sep=")) && line.chars().count() == 5;
    says || line.chars().all(|c| c.is_whitespace() || c == ';' || c == ',')
}

struct Reader<'a> {
    name: &'a str,
    layout: TableLayout,
}

impl Reader<'_> {
    fn read(&self, rows: &[Line], comment: Option<Line>) -> Result<NumberTable> {
        let mut fields = Vec::new();
        let (headings, skip) = self.headings(rows)?;
        let body = &rows[skip..];
        let Some(&first) = body.first() else {
            let line = headings.map_or(1, |h| h.line);
            return Err(self.fault(line, "headings and no row of numbers", "numbers below them"));
        };
        self.layout.split(first.1, &mut fields);
        let columns = fields.len();
        if columns < 2 {
            return Err(self.no_number(first.0, first.1, first.1));
        }
        let mut table = NumberTable {
            name: self.name.to_owned(),
            headings,
            comment: None,
            values: Vec::with_capacity(body.len() * columns),
            lines: Vec::with_capacity(body.len()),
            columns,
            whole: vec![true; columns],
            layout: self.layout,
            fractions: false,
        };
        for &(line, text) in body {
            self.layout.split(text, &mut fields);
            if fields.len() != columns {
                let separator = self.layout.separator.name();
                return Err(self.fault(
                    line,
                    format!("\"{}\"", text::excerpt(text)),
                    format!("{columns} numbers, as in line {} (separated by {separator})", first.0),
                ));
            }
            for (whole, field) in table.whole.iter_mut().zip(&fields) {
                let Some(value) = layout::number(field, self.layout.decimal) else {
                    return Err(self.no_number(line, text, field));
                };
                *whole &= field.bytes().all(|b| b.is_ascii_digit());
                table.fractions |= field.contains(self.layout.decimal);
                table.values.push(value);
            }
            table.lines.push(line);
        }
        if let Some(headings) = &mut table.headings {
            // Names may stand between blanks above numbers between semicolons.
            let words = headings.names.first().map(|n| n.split_whitespace().map(str::to_owned).collect::<Vec<_>>());
            if let (1, Some(words)) = (headings.names.len(), words.filter(|w| w.len() == columns)) {
                headings.names = words;
            }
            if headings.names.len() != columns {
                let found = format!("{} headings ({})", headings.names.len(), headings.names.join(", "));
                let expected = format!(
                    "{columns}, one for each number of line {}; let the line begin with # if it is a comment",
                    first.0
                );
                return Err(self.fault(headings.line, found, expected));
            }
        }
        table.comment = comment.map(|(line, text)| self.names(line, text)).filter(|h| h.names.len() == columns);
        self.refuse_digits_between_commas(&table, body)?;
        Ok(table)
    }

    /// Headings, if there are any, and how many rows they and their units are.
    fn headings(&self, rows: &[Line]) -> Result<(Option<Headings>, usize)> {
        let mut headings = self.names(rows[0].0, rows[0].1);
        let number = |field: &String| layout::number(field, self.layout.decimal).is_some();
        if headings.names.first().is_some_and(number) {
            return Ok((None, 0));
        }
        if rows.len() > 1 {
            let units = self.names(rows[1].0, rows[1].1);
            if units.names.len() == headings.names.len() && columns::are_units(&units.names) {
                headings.units = units.names;
                return Ok((Some(headings), 2));
            }
        }
        Ok((Some(headings), 1))
    }

    /// A row of names; between blanks a unit in brackets belongs to the name before it.
    fn names(&self, line: usize, text: &str) -> Headings {
        let mut fields = Vec::new();
        self.layout.split(text, &mut fields);
        let mut names: Vec<String> = Vec::new();
        for field in fields {
            match names.last_mut() {
                Some(name) if self.layout.separator == Separator::Blank && field.starts_with(['(', '[']) => {
                    name.push(' ');
                    name.push_str(field);
                }
                _ => names.push(field.to_owned()),
            }
        }
        Headings { line, names, units: Vec::new() }
    }

    fn no_number(&self, line: usize, text: &str, field: &str) -> Error {
        let sign = if self.layout.decimal == ',' { "decimal comma" } else { "decimal point" };
        let found = match field.is_empty() {
            true => format!("no number between separators in \"{}\"", text::excerpt(text)),
            false => format!("\"{}\" in \"{}\"", text::excerpt(field), text::excerpt(text)),
        };
        let separator = self.layout.separator.name();
        let expected = format!(
            "finite numbers with a {sign}, separated by {separator} as in the other rows; comments begin with #, !, % \
             or //"
        );
        self.fault(line, found, expected)
    }

    fn fault(&self, line: usize, found: impl std::fmt::Display, expected: impl std::fmt::Display) -> Error {
        Error::Input(format!("{}, line {line}: found {found}, expected {expected}", self.name))
    }

    /// Refuses whole numbers between commas where the digits of a column may be those behind the decimal commas of the
    /// column before it.
    fn refuse_digits_between_commas(&self, table: &NumberTable, body: &[Line]) -> Result<()> {
        let quoted = || body.iter().any(|row| row.1.contains('"'));
        let pointed = || body.iter().any(|row| row.1.contains(['.', 'e', 'E', 'd', 'D']));
        if self.layout.separator != Separator::Comma || table.headings.is_some() {
            return Ok(());
        }
        if !table.whole[1..].contains(&true) || pointed() || quoted() {
            return Ok(());
        }
        Err(self.fault(
            body[0].0,
            format!("whole numbers between commas, \"{}\"", text::excerpt(body[0].1)),
            "numbers that can be told apart: are the commas decimal commas or separators? Separate columns by \
             semicolons, or name them in a first row such as y,z",
        ))
    }
}
