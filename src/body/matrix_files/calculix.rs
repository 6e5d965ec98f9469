//! Matrices of CalculiX (`*FREQUENCY, SOLVER=MATRIXSTORAGE`): `.sti` and `.mas`, one line `row column value` for each
//! entry of the upper triangle of a symmetric matrix; node and direction of the rows are in the `.dof` beside.

use super::entries::{assemble, Listing, MatrixEntry};
use super::numbers::{index, real};
use super::{Fault, LabelledMatrix, Parsed};
use crate::input::text::{excerpt, lines};

pub(super) fn parse(text: &str) -> Parsed<LabelledMatrix> {
    let (mut entries, mut n) = (Vec::new(), 0);
    for (number, line) in lines(text).filter(|(_, l)| !l.trim().is_empty()) {
        let fault = |what: String| Fault::new(number, what);
        let words: Vec<&str> = line.split_whitespace().collect();
        let [row, col, value] = words[..] else {
            return Err(fault(format!("found \"{}\", expected row, column and value", excerpt(line))));
        };
        let (row, col) = (index(row, "row").map_err(fault)?, index(col, "column").map_err(fault)?);
        if row > col {
            return Err(fault(format!(
                "found the entry ({}, {}) below the diagonal, expected the upper triangle of a symmetric matrix; a \
                 matrix that is not symmetric is not taken",
                row + 1,
                col + 1
            )));
        }
        n = n.max(col + 1);
        let value = real(value).map_err(fault)?;
        entries.push(MatrixEntry { row: row as u32, col: col as u32, value, line: number as u32 });
    }
    if entries.is_empty() {
        return Err(Fault::new(0, "the file is empty; expected lines of row, column and value"));
    }
    let matrix = assemble(n, entries, Listing::Once, &|row| (row + 1).to_string())?;
    // CalculiX writes every diagonal entry, zero or not.
    if let Some(i) = (0..n).find(|&i| !matrix.row(i).0.contains(&(i as u64))) {
        let what =
            format!("found no diagonal entry in row {}, expected one in each row; the file is incomplete", i + 1);
        return Err(Fault::new(0, what));
    }
    Ok(LabelledMatrix { matrix, dofs: None })
}
