//! Separator and decimal sign of a table, found from all of its rows.

use super::{text, Line};
use crate::{Error, Result};

/// Separator of the fields of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    Semicolon,
    Tab,
    Blank,
    Comma,
}

impl Separator {
    pub fn name(self) -> &'static str {
        match self {
            Separator::Semicolon => "semicolons",
            Separator::Tab => "tabs",
            Separator::Blank => "blanks",
            Separator::Comma => "commas",
        }
    }

    fn is(self, c: char) -> bool {
        match self {
            Separator::Semicolon => c == ';',
            Separator::Tab => c == '\t',
            Separator::Blank => c.is_whitespace(),
            Separator::Comma => c == ',',
        }
    }
}

/// How the rows of a table are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TableLayout {
    pub separator: Separator,
    /// `.` or `,`.
    pub decimal: char,
}

/// All layouts. Rows that are numbers in two of them are the same numbers, as a field that holds a separator of another
/// layout is no number; so the first one that fits is as good as any.
const LAYOUTS: [TableLayout; 8] = [
    TableLayout { separator: Separator::Semicolon, decimal: '.' },
    TableLayout { separator: Separator::Semicolon, decimal: ',' },
    TableLayout { separator: Separator::Tab, decimal: '.' },
    TableLayout { separator: Separator::Tab, decimal: ',' },
    TableLayout { separator: Separator::Blank, decimal: '.' },
    TableLayout { separator: Separator::Blank, decimal: ',' },
    TableLayout { separator: Separator::Comma, decimal: '.' },
    // With fields in quotes.
    TableLayout { separator: Separator::Comma, decimal: ',' },
];

impl TableLayout {
    /// The layout in which all rows are numbers, else the one in which most are.
    pub fn find(name: &str, rows: &[Line]) -> Result<Self> {
        let has = |c: char| rows.iter().any(|row| row.1.contains(c));
        let [semicolon, tab, comma, quote] = [';', '\t', ',', '"'].map(has);
        let possible = |l: &TableLayout| match (l.separator, l.decimal) {
            (Separator::Comma, ',') => comma && quote,
            (_, ',') if !comma => false,
            (Separator::Semicolon, _) => semicolon,
            (Separator::Tab, _) => tab,
            (Separator::Comma, _) => comma,
            (Separator::Blank, _) => true,
        };
        let mut best = None;
        for layout in LAYOUTS.into_iter().filter(possible) {
            let (numeric, whole) = layout.fit(rows);
            if whole {
                return Ok(layout);
            }
            if numeric > 0 && best.is_none_or(|(most, _)| numeric > most) {
                best = Some((numeric, layout));
            }
        }
        best.map(|b| b.1).ok_or_else(|| {
            let (line, text) = rows[1.min(rows.len() - 1)];
            Error::Input(format!(
                "{name}, line {line}: found \"{}\", expected two numbers or more a row, separated by semicolons, tabs, \
                 blanks or commas (with a decimal comma by semicolons, tabs or blanks)",
                text::excerpt(text)
            ))
        })
    }

    /// Rows of at least two numbers, and whether all rows behind headings are such rows of one length.
    fn fit(self, rows: &[Line]) -> (usize, bool) {
        let mut fields = Vec::new();
        let (mut numeric, mut length, mut headings, mut whole) = (0, None, 0, true);
        for &(_, text) in rows {
            self.split(text, &mut fields);
            let numbers = fields.iter().filter(|f| number(f, self.decimal).is_some()).count();
            if numbers == fields.len() && numbers >= 2 {
                numeric += 1;
                whole &= *length.get_or_insert(numbers) == numbers;
            } else if numeric == 0 && headings < 2 && fields.first().is_none_or(|f| !is_numeric(f)) {
                headings += 1;
            } else {
                whole = false;
            }
        }
        (numeric, whole && numeric > 0)
    }

    /// Fields of a row; separators at its end count for nothing.
    pub fn split<'a>(self, row: &'a str, fields: &mut Vec<&'a str>) {
        fields.clear();
        let (mut quoted, mut begin) = (false, 0);
        for (i, c) in row.char_indices() {
            quoted ^= c == '"';
            if !quoted && self.separator.is(c) {
                self.push(&row[begin..i], fields);
                begin = i + c.len_utf8();
            }
        }
        self.push(&row[begin..], fields);
        while fields.last().is_some_and(|f| f.is_empty()) {
            fields.pop();
        }
    }

    fn push<'a>(self, field: &'a str, fields: &mut Vec<&'a str>) {
        let field = field.trim();
        if self.separator == Separator::Blank && field.is_empty() {
            return;
        }
        let inside = field.strip_prefix('"').and_then(|f| f.strip_suffix('"'));
        fields.push(inside.unwrap_or(field).trim());
    }
}

/// Returns whether a field is a number with either decimal sign.
fn is_numeric(field: &str) -> bool {
    ['.', ','].iter().any(|&sign| number(field, sign).is_some())
}

/// A finite number with the decimal sign `decimal`, with an exponent of E or D.
pub(super) fn number(field: &str, decimal: char) -> Option<f64> {
    let (mut text, mut digits, mut exponent) = (String::with_capacity(field.len()), 0, false);
    let mut previous = None;
    for c in field.chars() {
        match c {
            '0'..='9' => {
                digits += 1;
                text.push(c);
            }
            '+' | '-' | '\u{2212}' if previous.is_none() || previous == Some('e') => {
                text.push(if c == '+' { '+' } else { '-' });
            }
            'e' | 'E' | 'd' | 'D' if digits > 0 && !exponent => {
                (exponent, digits) = (true, 0);
                text.push('e');
            }
            c if c == decimal && !exponent && !text.contains('.') => text.push('.'),
            _ => return None,
        }
        previous = if matches!(c, 'e' | 'E' | 'd' | 'D') { Some('e') } else { Some(c) };
    }
    // A comma at the end of a number is a separator.
    if digits == 0 || (decimal == ',' && previous == Some(',')) {
        return None;
    }
    text.parse().ok().filter(|v: &f64| v.is_finite())
}
