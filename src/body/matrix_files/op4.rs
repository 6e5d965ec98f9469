//! Matrices of Nastran's OUTPUT4 in text: a header `NCOL NROW FORM TYPE NAME format`, then each column with its entries
//! that are not zero, dense, or in strings (sparse), with both ways to say their place (BIGMAT and not).
//!
//! The layout is that which pyYeti and pyNastran read. Rows have no map: the file numbers them.

use super::entries::{assemble, Listing, MatrixEntry};
use super::numbers::{columns, integer, real};
use super::{select, Fault, LabelledMatrix, Parsed, MAX_ORDER};
use crate::input::text::{excerpt, lines};

/// Rows from which strings are long by themselves, whatever the sign of NROW.
pub(super) const LONG: i64 = 65536;

/// Header of a matrix.
pub(super) struct Header {
    pub columns: i64,
    pub rows: i64,
    pub form: i64,
    pub kind: i64,
    pub name: String,
}

impl Header {
    /// Refuses what is no real square matrix; returns its order.
    pub fn order(&self) -> Result<usize, String> {
        let Self { columns, rows, form, kind, name } = self;
        if !matches!(kind, 1 | 2) {
            return Err(format!(
                "found type {kind} of the matrix {name}, expected 1 or 2, real; complex ones (3 and 4) are not taken"
            ));
        }
        if !matches!(form, 1 | 2 | 6) {
            return Err(format!(
                "found form {form} of the matrix {name}, expected 1 (square), 2 or 6 (symmetric); diagonal and \
                 triangular ones are not taken"
            ));
        }
        if *columns != rows.abs() || *columns < 1 || *columns > MAX_ORDER as i64 {
            return Err(format!(
                "found {} rows and {columns} columns of the matrix {name}, expected a square one of up to {MAX_ORDER}",
                rows.abs()
            ));
        }
        Ok(*columns as usize)
    }

    /// Words of four bytes that a value counts for in strings.
    pub fn words(&self) -> i64 {
        if self.kind % 2 == 0 {
            2
        } else {
            1
        }
    }

    /// True if strings give length and row in two numbers.
    pub fn long_strings(&self) -> bool {
        self.rows < 0 || self.rows >= LONG
    }
}

/// Length of a string in values of `per` words, its first row, 0-based, and the words that it takes, from what stands
/// in front of it.
pub(super) fn string(per: i64, words: &[i64]) -> Result<(i64, i64, i64), String> {
    let (length, row, used) = match words {
        [length, row] => (length - 1, *row, length + 1),
        [both] => ((both >> 16) - 1, both & 0xffff, both >> 16),
        _ => return Err(format!("found {} numbers in front of a string, expected 1 or 2", words.len())),
    };
    if length < 1 || length % per != 0 || row < 1 {
        return Err(format!(
            "found a string of {length} words at row {row}, expected a positive multiple of {per} words"
        ));
    }
    Ok((length / per, row - 1, used))
}

/// Lines with a place in them.
struct Cursor<'a> {
    lines: Vec<(usize, &'a str)>,
    next: usize,
}

impl<'a> Cursor<'a> {
    fn line(&mut self, what: &str) -> Parsed<(usize, &'a str)> {
        let end = self.lines.last().map_or(0, |l| l.0);
        let line = self.lines.get(self.next).copied();
        self.next += 1;
        line.ok_or_else(|| Fault::new(end, format!("the file ends before {what}; it is truncated")))
    }

    /// `count` values in lines of `per` values of `width` columns.
    fn values(
        &mut self,
        count: i64,
        (per, width): (usize, usize),
        mut give: impl FnMut(i64, f64, usize) -> Parsed<()>,
    ) -> Parsed<()> {
        let mut done = 0;
        while done < count {
            let (number, line) = self.line("the last value of a column")?;
            let here = ((count - done) as usize).min(per);
            for k in 0..here {
                let value = real(columns(line, k * width, width)).map_err(|what| Fault::new(number, what))?;
                give(done + k as i64, value, number)?;
            }
            if !line.get(here * width..).unwrap_or("").trim().is_empty() {
                return Err(Fault::new(number, format!("found \"{}\", expected {here} values", excerpt(line))));
            }
            done += here as i64;
        }
        Ok(())
    }
}

pub(super) fn parse(text: &str, name: Option<&str>) -> Parsed<LabelledMatrix> {
    let mut cursor = Cursor { lines: lines(text).filter(|(_, l)| !l.trim().is_empty()).collect(), next: 0 };
    let (mut names, mut found) = (Vec::new(), None);
    while cursor.next < cursor.lines.len() {
        let (header, layout) = head(&mut cursor)?;
        let wanted = name.is_none_or(|n| header.name.eq_ignore_ascii_case(n));
        names.push(header.name.clone());
        let entries = body(&mut cursor, &header, layout, wanted)?;
        if wanted && found.is_none() {
            found = Some((header, entries));
        }
    }
    select(&names, name)?;
    let Some((header, entries)) = found else {
        return Err(Fault::new(0, "found no matrix in the file, expected one"));
    };
    finish(&header, entries)
}

/// The matrix of its entries.
pub(super) fn finish(header: &Header, entries: Vec<MatrixEntry>) -> Parsed<LabelledMatrix> {
    let order = header.order().map_err(|what| Fault::new(0, what))?;
    let matrix = assemble(order, entries, Listing::All, &|row| (row + 1).to_string())?;
    if header.form == 6 {
        if let Some((i, j, d)) = matrix.asymmetry().filter(|a| a.2 > 1e-9) {
            return Err(Fault::new(
                0,
                format!(
                    "found entries ({0}, {1}) and ({1}, {0}) of the matrix {2} that differ by {d:.1e} of the largest, \
                     expected a symmetric matrix, whole: its form is 6",
                    i + 1,
                    j + 1,
                    header.name
                ),
            ));
        }
    }
    Ok(LabelledMatrix { matrix, dofs: None })
}

/// Header, and values a line with their width.
fn head(cursor: &mut Cursor) -> Parsed<(Header, (usize, usize))> {
    let (number, line) = cursor.line("the header of a matrix")?;
    let fault = |what: String| Fault::new(number, what);
    if !line.is_ascii() {
        return Err(fault("found letters that are not ASCII, expected the header of a matrix".into()));
    }
    if line.trim_end().ends_with("|I16") {
        return Err(fault(
            "found a matrix with sizes of 16 columns (I16), expected 8; write a matrix of fewer rows".into(),
        ));
    }
    let count = |k: usize, what: &str| integer(columns(line, 8 * k, 8), what).map_err(fault);
    let header = Header {
        columns: count(0, "the number of columns")?,
        rows: count(1, "the number of rows")?,
        form: count(2, "the form")?,
        kind: count(3, "the type")?,
        name: columns(line, 32, 8).trim().to_owned(),
    };
    let format = line.get(40..).unwrap_or("").trim().to_ascii_uppercase();
    // Without a format values are 5E16.9.
    let layout = match format.strip_prefix("1P,").unwrap_or(&format) {
        "" => Some((5, 16)),
        plain => plain.split_once(['E', 'D']).and_then(|(per, rest)| {
            let width = rest.split('.').next()?.parse().ok()?;
            Some((per.parse().ok()?, width))
        }),
    };
    match layout.filter(|l| l.0 > 0 && (8..=64).contains(&l.1)) {
        Some(layout) => Ok((header, layout)),
        None => Err(fault(format!("found the format \"{}\", expected one as 1P,3E23.16", excerpt(&format)))),
    }
}

/// The entries up to the column that ends the matrix.
fn body(cursor: &mut Cursor, header: &Header, layout: (usize, usize), wanted: bool) -> Parsed<Vec<MatrixEntry>> {
    let at = cursor.lines[cursor.next - 1].0;
    let order = if wanted { header.order().map_err(|what| Fault::new(at, what))? as i64 } else { i64::MAX };
    let mut entries = Vec::new();
    let mut last = 0;
    loop {
        let (number, line) = cursor.line("the column that ends the matrix")?;
        let fault = |what: String| Fault::new(number, what);
        let count = |k: usize, what: &str| integer(columns(line, 8 * k, 8), what).map_err(fault);
        let (column, row) = (count(0, "a column")?, count(1, "the first row")?);
        let mut words = count(2, "the number of words")?;
        if column > header.columns {
            // One value of no meaning.
            return cursor.values(1, layout, |_, _, _| Ok(())).map(|()| entries);
        }
        if column <= last || row < 0 || words < 1 {
            let what =
                format!("found column {column} from row {row} with {words} words, expected a column behind {last}");
            return Err(fault(what));
        }
        last = column;
        let mut put = |first: i64, k: i64, value: f64, line: usize| {
            let row = first + k;
            if wanted {
                if row >= order {
                    return Err(Fault::new(line, format!("found row {}, expected at most {order}", row + 1)));
                }
                entries.push(MatrixEntry { row: row as u32, col: column as u32 - 1, value, line: line as u32 });
            }
            Ok(())
        };
        if row > 0 {
            cursor.values(words, layout, |k, value, line| put(row - 1, k, value, line))?;
            continue;
        }
        while words > 0 {
            let (number, line) = cursor.line("a string of a column")?;
            let fault = |what: String| Fault::new(number, what);
            let head: Vec<i64> = match header.long_strings() {
                true => vec![columns(line, 0, 8), columns(line, 8, 8)],
                false => vec![line],
            }
            .into_iter()
            .map(|w| integer(w, "the place of a string").map_err(fault))
            .collect::<Parsed<_>>()?;
            let (length, first, used) = string(header.words(), &head).map_err(fault)?;
            words -= used;
            if words < 0 {
                return Err(fault(format!("found a string of {length} values, longer than its column")));
            }
            cursor.values(length, layout, |k, value, line| put(first, k, value, line))?;
        }
    }
}
