//! Entries of a matrix as a file lists them, and the matrix that they make.

use super::dofs::Dof;
use super::{Fault, LabelledMatrix, Parsed, MAX_ORDER, UNCHECKED};
use crate::body::matrix_market::Csr;
use std::collections::HashMap;

/// An entry and the line that it stands in.
#[derive(Debug, Clone, Copy)]
pub(super) struct MatrixEntry {
    pub row: u32,
    pub col: u32,
    pub value: f64,
    pub line: u32,
}

/// Which entries a file lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Listing {
    /// All that are not zero.
    All,
    /// Each pair of symmetric entries once, in either triangle.
    Once,
    /// Each pair once, or each pair twice.
    OnceOrTwice,
}

/// Names a row in messages.
pub(super) type RowName<'a> = &'a dyn Fn(u32) -> String;

/// The matrix of order `n` of the entries. An entry that is listed twice is refused.
pub(super) fn assemble(n: usize, mut entries: Vec<MatrixEntry>, listing: Listing, name: RowName) -> Parsed<Csr> {
    if n > MAX_ORDER || n > entries.len().max(UNCHECKED) {
        let what =
            format!("found a matrix of {n} rows with {} entries, expected at least one in each row", entries.len());
        return Err(Fault::new(0, what + "; the file is incomplete, or a row number wrong"));
    }
    entries.sort_unstable_by_key(|e| (e.row, e.col, e.line));
    if let Some(w) = entries.windows(2).find(|w| (w[0].row, w[0].col) == (w[1].row, w[1].col)) {
        let (first, again) = (w[0], w[1]);
        return Err(Fault::new(
            again.line as usize,
            format!(
                "found the entry ({}, {}) again, given in line {} already; expected every entry once: whether they \
                 add up or replace each other is not certain",
                name(again.row),
                name(again.col),
                first.line
            ),
        ));
    }
    if listing == Listing::All {
        return Ok(csr(n, &entries));
    }
    let find = |row: u32, col: u32| entries.binary_search_by_key(&(row, col), |e| (e.row, e.col)).ok();
    let off = || entries.iter().filter(|e| e.row != e.col);
    let twice = off().find(|e| find(e.col, e.row).is_some());
    let once = off().find(|e| find(e.col, e.row).is_none());
    match (twice, once) {
        (Some(twice), _) if listing == Listing::Once => {
            let other = find(twice.col, twice.row).map_or(0, |k| entries[k].line);
            Err(Fault::new(
                twice.line.max(other) as usize,
                format!(
                    "found the entries ({0}, {1}) and ({1}, {0}) of a symmetric matrix, in lines {2} and {3}; expected \
                     one of the two",
                    name(twice.row),
                    name(twice.col),
                    twice.line.min(other),
                    twice.line.max(other)
                ),
            ))
        }
        (Some(twice), Some(once)) => Err(Fault::new(
            once.line as usize,
            format!(
                "found the entry ({0}, {1}) without ({1}, {0}), but both of ({2}, {3}); expected one triangle of a \
                 symmetric matrix, or all entries. The file is incomplete, or its matrix is not symmetric",
                name(once.row),
                name(once.col),
                name(twice.row),
                name(twice.col)
            ),
        )),
        (Some(_), None) => Ok(csr(n, &entries)),
        (None, _) => {
            let mirror = |e: &MatrixEntry| MatrixEntry { row: e.col, col: e.row, ..*e };
            let above: Vec<MatrixEntry> = off().map(mirror).collect();
            entries.extend(above);
            entries.sort_unstable_by_key(|e| (e.row, e.col));
            Ok(csr(n, &entries))
        }
    }
}

/// Compressed rows of sorted entries.
fn csr(n: usize, entries: &[MatrixEntry]) -> Csr {
    Csr::from_entries(n, entries.iter().map(|e| (e.row as usize, e.col as usize, e.value)).collect())
}

/// Entries between nodes and directions.
#[derive(Debug, Default)]
pub(super) struct Labels {
    numbers: HashMap<Dof, u32>,
    dofs: Vec<Dof>,
    pub entries: Vec<MatrixEntry>,
}

impl Labels {
    /// Number of a degree of freedom in the order in which they come.
    fn number(&mut self, dof: Dof) -> u32 {
        let next = self.dofs.len() as u32;
        let number = *self.numbers.entry(dof).or_insert(next);
        if number == next {
            self.dofs.push(dof);
        }
        number
    }

    /// Appends an entry.
    pub fn push(&mut self, row: Dof, col: Dof, value: f64, line: usize) {
        let (row, col) = (self.number(row), self.number(col));
        self.entries.push(MatrixEntry { row, col, value, line: line as u32 });
    }

    /// The matrix in ascending order of node and direction.
    pub fn assemble(mut self, listing: Listing) -> Parsed<LabelledMatrix> {
        let mut order: Vec<u32> = (0..self.dofs.len() as u32).collect();
        order.sort_unstable_by_key(|&k| self.dofs[k as usize]);
        let mut place = vec![0u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let dofs: Vec<Dof> = order.iter().map(|&k| self.dofs[k as usize]).collect();
        for e in &mut self.entries {
            (e.row, e.col) = (place[e.row as usize], place[e.col as usize]);
        }
        let name = |row: u32| dofs[row as usize].to_string();
        let matrix = assemble(dofs.len(), self.entries, listing, &name)?;
        Ok(LabelledMatrix { matrix, dofs: Some(dofs) })
    }
}
