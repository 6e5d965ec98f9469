//! Matrices of Nastran's OUTPUT4 in binary: Fortran records of numbers of four or eight bytes, of either byte order, as
//! pyYeti reads them.

use super::entries::MatrixEntry;
use super::op4::{finish, string, Header};
use super::{select, Fault, LabelledMatrix, Parsed};

/// Returns true if the content begins as a binary file does: a record of 24 bytes (or of 48 with numbers of eight
/// bytes).
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let Some(first) = bytes.first_chunk::<4>() else { return false };
    [24, 48].contains(&i32::from_le_bytes(*first)) || [24, 48].contains(&i32::from_be_bytes(*first))
}

/// Bytes with a place in them, and their order.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
    /// True if whole numbers, and words, have eight bytes.
    wide: bool,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Parsed<&'a [u8]> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        self.at += count;
        taken.ok_or_else(|| {
            Fault::new(0, format!("the file ends at byte {}, within a record; it is truncated", self.bytes.len()))
        })
    }

    fn number(&mut self) -> Parsed<i64> {
        if self.wide {
            let bytes: [u8; 8] = self.take(8)?.try_into().unwrap_or_default();
            return Ok(if self.big { i64::from_be_bytes(bytes) } else { i64::from_le_bytes(bytes) });
        }
        self.mark()
    }

    /// Length of a record, of four bytes in any case.
    fn mark(&mut self) -> Parsed<i64> {
        let bytes: [u8; 4] = self.take(4)?.try_into().unwrap_or_default();
        Ok(i64::from(if self.big { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) }))
    }

    fn value(&mut self, double: bool) -> Parsed<f64> {
        let at = self.at;
        let value = if double || self.wide {
            let bytes: [u8; 8] = self.take(8)?.try_into().unwrap_or_default();
            if self.big {
                f64::from_be_bytes(bytes)
            } else {
                f64::from_le_bytes(bytes)
            }
        } else {
            let bytes: [u8; 4] = self.take(4)?.try_into().unwrap_or_default();
            f64::from(if self.big { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) })
        };
        match value.is_finite() {
            true => Ok(value),
            false => Err(Fault::new(0, format!("found the value {value} at byte {at}, expected a finite number"))),
        }
    }

    /// A record: its length in front and behind, and a cursor over its content.
    fn record(&mut self) -> Parsed<Cursor<'a>> {
        let at = self.at;
        let length = self.mark()?;
        let bytes = self.take(usize::try_from(length).map_err(|_| wrong(at, length))?)?;
        match self.mark()? {
            end if end == length => Ok(Cursor { bytes, at: 0, ..*self }),
            end => Err(wrong(at, end)),
        }
    }
}

fn wrong(at: usize, length: i64) -> Fault {
    Fault::new(
        0,
        format!(
            "found the length {length} of the record at byte {at}, expected the same at both ends; \
             the file is damaged"
        ),
    )
}

pub(super) fn parse(bytes: &[u8], name: Option<&str>) -> Parsed<LabelledMatrix> {
    let first: [u8; 4] = bytes.first_chunk().copied().unwrap_or_default();
    let both = [i32::from_le_bytes(first), i32::from_be_bytes(first)];
    let mut cursor = Cursor { bytes, at: 0, big: [24, 48].contains(&both[1]), wide: both.contains(&48) };
    let (mut names, mut found) = (Vec::new(), None);
    while cursor.at < bytes.len() {
        let mut head = cursor.record()?;
        let header = Header {
            columns: head.number()?,
            rows: head.number()?,
            form: head.number()?,
            kind: head.number()?,
            name: String::from_utf8_lossy(head.take(if head.wide { 16 } else { 8 })?)
                .trim_matches(['\0', ' '])
                .to_owned(),
        };
        let wanted = name.is_none_or(|n| header.name.eq_ignore_ascii_case(n));
        names.push(header.name.clone());
        let entries = columns(&mut cursor, &header, wanted)?;
        if wanted && found.is_none() {
            found = Some((header, entries));
        }
    }
    select(&names, name)?;
    match found {
        Some((header, entries)) => finish(&header, entries),
        None => Err(Fault::new(0, "found no matrix in the file, expected one")),
    }
}

/// The entries up to the column that ends the matrix.
fn columns(cursor: &mut Cursor, header: &Header, wanted: bool) -> Parsed<Vec<MatrixEntry>> {
    let order = if wanted { header.order().map_err(|what| Fault::new(0, what))? as i64 } else { 0 };
    let (mut entries, mut last) = (Vec::new(), 0);
    loop {
        let place = cursor.at;
        let fault = |what: String| Fault::new(0, format!("record at byte {place}: {what}"));
        let mut record = cursor.record()?;
        let (column, row, mut words) = (record.number()?, record.number()?, record.number()?);
        if column > header.columns {
            return Ok(entries);
        }
        if column <= last || row < 0 || words < 1 {
            let what =
                format!("found column {column} from row {row} with {words} words, expected a column behind {last}");
            return Err(fault(what));
        }
        last = column;
        if !wanted {
            continue;
        }
        let per = if record.wide { 1 } else { header.words() };
        let mut put = |record: &mut Cursor, first: i64, length: i64| -> Parsed<()> {
            if first + length > order {
                return Err(fault(format!("found row {}, expected at most {order}", first + length)));
            }
            for row in first..first + length {
                let value = record.value(header.words() == 2)?;
                entries.push(MatrixEntry { row: row as u32, col: column as u32 - 1, value, line: 0 });
            }
            Ok(())
        };
        if row > 0 {
            if words % per != 0 {
                return Err(fault(format!("found {words} words in column {column}, expected a multiple of {per}")));
            }
            put(&mut record, row - 1, words / per)?;
            continue;
        }
        while words > 0 {
            let mut head = vec![record.number()?];
            if header.long_strings() {
                head.push(record.number()?);
            }
            let (length, first, used) = string(per, &head).map_err(fault)?;
            // In binary files the length counts itself, not the row.
            words -= used;
            if words < 0 {
                return Err(fault(format!("found a string of {length} values, longer than its column")));
            }
            put(&mut record, first, length)?;
        }
    }
}
