//! Harwell–Boeing files (I. S. Duff, R. G. Grimes and J. G. Lewis, *Users' guide for the Harwell–Boeing sparse matrix
//! collection*, 1992), as Ansys' HBMAT writes them: real, assembled, unsymmetric (RUA), symmetric (RSA, the lower
//! triangle) or skew (RZA). Patterns, complex and elemental matrices are refused; right-hand sides are passed over.

use super::entries::{assemble, Listing, MatrixEntry};
use super::numbers::{columns, integer, real};
use super::{Fault, LabelledMatrix, Parsed, MAX_ORDER};
use crate::input::text::{excerpt, lines};

/// Numbers a line, and the width of each.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layout {
    per: usize,
    width: usize,
}

/// A Fortran format such as `(16I5)`, `(1P,3D25.16)` or `(4E20.12)`.
fn layout(format: &str) -> Option<Layout> {
    let mut inner = format.trim().strip_prefix('(')?.strip_suffix(')')?.trim().to_ascii_uppercase();
    inner.retain(|c| c != ' ');
    // A factor of scale, with or without a comma: it moves the point of printed numbers, not of those that are read.
    if let Some((factor, rest)) = inner.split_once('P') {
        factor.parse::<i32>().ok()?;
        inner = rest.trim_start_matches(',').to_owned();
    }
    let at = inner.find(['I', 'E', 'D', 'F', 'G'])?;
    let per = if at == 0 { 1 } else { inner[..at].parse().ok()? };
    let tail = &inner[at + 1..];
    // The digits of an exponent, as in E25.16E3, do not matter for reading.
    let width = tail.split(['.', 'E']).next()?.parse().ok()?;
    let plain = tail.bytes().all(|b| b.is_ascii_digit() || b == b'.' || b == b'E');
    (plain && (1..=80).contains(&per) && (1..=80).contains(&width)).then_some(Layout { per, width })
}

/// Lines behind the header.
struct Data<'a> {
    lines: Vec<(usize, &'a str)>,
    next: usize,
}

impl Data<'_> {
    /// `count` words of the layout from `cards` lines.
    fn words<T>(
        &mut self,
        count: usize,
        (layout, cards, what): (Layout, usize, &str),
        read: impl Fn(&str) -> Result<T, String>,
    ) -> Parsed<Vec<T>> {
        let needed = count.div_ceil(layout.per);
        let end = self.lines.last().map_or(0, |l| l.0);
        if needed != cards {
            let what = format!("found {cards} lines of {what} in the header, expected {needed} for {count} numbers");
            return Err(Fault::new(2, what));
        }
        if self.next + needed > self.lines.len() {
            return Err(Fault::new(end, format!("the file ends before the last of the {what}; it is truncated")));
        }
        let mut words = Vec::with_capacity(count);
        for &(number, line) in &self.lines[self.next..self.next + needed] {
            let fault = |what: String| Fault::new(number, what);
            let here = (count - words.len()).min(layout.per);
            for k in 0..here {
                words.push(read(columns(line, k * layout.width, layout.width)).map_err(fault)?);
            }
            if !line.is_ascii() || !line.get(here * layout.width..).unwrap_or("").trim().is_empty() {
                return Err(fault(format!(
                    "found \"{}\", expected {here} numbers of {} columns",
                    excerpt(line),
                    layout.width
                )));
            }
        }
        self.next += needed;
        Ok(words)
    }
}

/// Content of the header.
struct Header {
    cards: [usize; 3],
    kind: char,
    order: usize,
    entries: usize,
    layouts: [Layout; 3],
    lines: usize,
}

/// The lines of the header.
fn header(all: &[(usize, &str)]) -> Parsed<Header> {
    let line = |k: usize| {
        let found = all.get(k).map(|l| l.1);
        found.ok_or_else(|| Fault::new(all.len(), "the file ends within the header of four lines; it is truncated"))
    };
    let count = |k: usize, from: usize, what: &str| match integer(columns(line(k)?, from, 14), what) {
        Ok(n) if (0..=1 << 40).contains(&n) => Ok(n as usize),
        Ok(n) => Err(Fault::new(k + 1, format!("found {n}, expected {what}"))),
        Err(what) => Err(Fault::new(k + 1, what)),
    };
    line(0)?;
    let sides =
        if columns(line(1)?, 56, 14).trim().is_empty() { 0 } else { count(1, 56, "lines of right-hand sides")? };
    let cards =
        [count(1, 14, "lines of pointers")?, count(1, 28, "lines of indices")?, count(1, 42, "lines of values")?];
    let kind: Vec<char> = columns(line(2)?, 0, 3).to_ascii_uppercase().chars().collect();
    let kind = match kind[..] {
        ['R', kind @ ('U' | 'S' | 'Z'), 'A'] => kind,
        _ => {
            return Err(Fault::new(
                3,
                format!(
                "found the type \"{}\", expected RUA, RSA or RZA, real and assembled; patterns (P..), complex (C..), \
                     rectangular (.R.) and elemental (..E) matrices are not taken",
                excerpt(columns(line(2)?, 0, 3))
            ),
            ))
        }
    };
    let (rows, order) = (count(2, 14, "the number of rows")?, count(2, 28, "the number of columns")?);
    if rows != order || order == 0 || order > MAX_ORDER {
        let what = format!("found {rows} rows and {order} columns, expected a square matrix of up to {MAX_ORDER}");
        return Err(Fault::new(3, what));
    }
    let format = |from: usize, width: usize, what: &str| {
        let text = columns(line(3)?, from, width);
        let fail = || {
            Fault::new(
                4,
                format!("found the format \"{}\" of the {what}, expected one as (16I5) or (4E20.12)", excerpt(text)),
            )
        };
        layout(text).ok_or_else(fail)
    };
    let layouts = [format(0, 16, "pointers")?, format(16, 16, "indices")?, format(32, 20, "values")?];
    let entries = count(2, 42, "the number of entries")?;
    Ok(Header { cards, kind, order, entries, layouts, lines: if sides > 0 { 5 } else { 4 } })
}

pub(super) fn parse(text: &str) -> Parsed<LabelledMatrix> {
    let all: Vec<(usize, &str)> = lines(text).collect();
    let head = header(&all)?;
    if head.entries > text.len() || head.order > text.len() {
        let what = format!(
            "found {} columns with {} entries, more than the file has; it is truncated",
            head.order, head.entries
        );
        return Err(Fault::new(3, what));
    }
    let mut data = Data { lines: all.get(head.lines..).unwrap_or_default().to_vec(), next: 0 };
    let number = |word: &str| integer(word, "a number");
    let pointers = data.words(head.order + 1, (head.layouts[0], head.cards[0], "pointers"), number)?;
    let rises = pointers.windows(2).all(|w| w[0] <= w[1]);
    if pointers.first() != Some(&1) || pointers.last() != Some(&(head.entries as i64 + 1)) || !rises {
        let what = format!("found pointers that do not rise from 1 to {}; the file is damaged", head.entries + 1);
        return Err(Fault::new(head.lines + 1, what));
    }
    let from = data.next;
    let indices = data.words(head.entries, (head.layouts[1], head.cards[1], "indices"), number)?;
    let line_of = |k: usize| data.lines.get(from + k / head.layouts[1].per).map_or(0, |l| l.0);
    let mut places = Vec::with_capacity(head.entries);
    for (col, w) in pointers.windows(2).enumerate() {
        for k in w[0] as usize - 1..w[1] as usize - 1 {
            let (row, line) = (indices[k], line_of(k));
            if !(1..=head.order as i64).contains(&row) {
                return Err(Fault::new(line, format!("found the row {row}, expected one of 1 to {}", head.order)));
            }
            let row = row as usize - 1;
            if head.kind != 'U' && (row < col || row == col && head.kind == 'Z') {
                let what = format!("found the entry ({}, {}), expected the lower triangle only", row + 1, col + 1);
                return Err(Fault::new(line, what));
            }
            places.push((row, col, line));
        }
    }
    let values = data.words(head.entries, (head.layouts[2], head.cards[2], "values"), real)?;
    let mut entries = Vec::with_capacity(2 * places.len());
    for (&(row, col, line), &value) in places.iter().zip(&values) {
        let entry = MatrixEntry { row: row as u32, col: col as u32, value, line: line as u32 };
        entries.push(entry);
        if row != col && head.kind != 'U' {
            let value = if head.kind == 'Z' { -value } else { value };
            entries.push(MatrixEntry { row: entry.col, col: entry.row, value, ..entry });
        }
    }
    let matrix = assemble(head.order, entries, Listing::All, &|row| (row + 1).to_string())?;
    Ok(LabelledMatrix { matrix, dofs: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fortran_formats_are_understood() {
        for (format, per, width) in [
            ("(16I5)", 16, 5),
            ("(I8)", 1, 8),
            ("(3D25.16)", 3, 25),
            ("(1P,3E25.16)", 3, 25),
            ("(1P3E25.16E3)", 3, 25),
            ("( 4F20.12 )", 4, 20),
            ("(5G16.8)", 5, 16),
        ] {
            assert_eq!(layout(format), Some(Layout { per, width }), "{format}");
        }
        for format in ["", "16I5", "(5A8)", "(I0)", "(2(3E9.2))", "(E25.16", "(*)", "(-1P,3I5x)"] {
            assert_eq!(layout(format), None, "{format}");
        }
    }
}
