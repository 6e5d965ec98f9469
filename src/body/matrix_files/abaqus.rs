//! Matrices of Abaqus (`*MATRIX GENERATE`, `*MATRIX OUTPUT`) in text: `row node, row dof, column node, column dof,
//! value` (FORMAT=MATRIX INPUT, the default, and FORMAT=LABELS), or `row, column, value` (FORMAT=COORDINATE).
//!
//! A symmetric matrix is listed by one triangle or in full; then entries above and below the diagonal are equal (Abaqus
//! Keywords Reference Guide, `*MATRIX INPUT`). An included `*MATRIX INPUT` line may give name, type and scale factor.

use super::dofs::Dof;
use super::entries::{assemble, Labels, Listing, MatrixEntry};
use super::numbers::{index, real};
use super::{select, Fault, LabelledMatrix, Parsed};
use crate::input::text::{excerpt, lines};

/// A matrix while its lines are read.
struct Block {
    name: String,
    scale: f64,
    listing: Listing,
    labels: Labels,
    numbered: Vec<MatrixEntry>,
    order: usize,
}

impl Block {
    fn new(name: String) -> Self {
        let (labels, numbered) = (Labels::default(), Vec::new());
        Self { name, scale: 1.0, listing: Listing::OnceOrTwice, labels, numbered, order: 0 }
    }

    /// Takes a line of data.
    fn take(&mut self, number: usize, line: &str) -> Parsed<()> {
        let fault = |what: String| Fault::new(number, what);
        let words: Vec<&str> = match line.contains(',') {
            true => line.trim_end().trim_end_matches(',').split(',').map(str::trim).collect(),
            false => line.split_whitespace().collect(),
        };
        match words[..] {
            [a, b, c, d, value] => {
                let row = Dof::from_words(a, b, 1).map_err(fault)?;
                let col = Dof::from_words(c, d, 1).map_err(fault)?;
                self.labels.push(row, col, self.scale * real(value).map_err(fault)?, number);
            }
            [row, col, value] => {
                let (row, col) = (index(row, "row").map_err(fault)?, index(col, "column").map_err(fault)?);
                let value = self.scale * real(value).map_err(fault)?;
                self.order = self.order.max(row.max(col) + 1);
                self.numbered.push(MatrixEntry { row: row as u32, col: col as u32, value, line: number as u32 });
            }
            _ => {
                return Err(fault(format!(
                    "found \"{}\", expected \"row node, row dof, column node, column dof, value\" (FORMAT=MATRIX INPUT \
                     or LABELS) or \"row column value\" (FORMAT=COORDINATE)",
                    excerpt(line)
                )))
            }
        }
        if !self.numbered.is_empty() && !self.labels.entries.is_empty() {
            return Err(fault("found lines of three and of five numbers, expected the same in the whole file".into()));
        }
        Ok(())
    }

    fn is_empty(&self) -> bool {
        self.numbered.is_empty() && self.labels.entries.is_empty()
    }

    fn finish(self) -> Parsed<LabelledMatrix> {
        if self.is_empty() {
            return Err(Fault::new(0, "found no entries of the matrix; the file is truncated"));
        }
        if self.numbered.is_empty() {
            return self.labels.assemble(self.listing);
        }
        let matrix = assemble(self.order, self.numbered, self.listing, &|row| (row + 1).to_string())?;
        Ok(LabelledMatrix { matrix, dofs: None })
    }
}

pub(super) fn parse(text: &str, name: Option<&str>) -> Parsed<LabelledMatrix> {
    let mut blocks: Vec<Block> = Vec::new();
    for (number, line) in lines(text) {
        let trimmed = line.trim();
        if trimmed.is_empty() || trimmed.starts_with("**") {
            continue;
        }
        if trimmed.starts_with('*') {
            blocks.push(keyword(number, trimmed)?);
            continue;
        }
        if blocks.is_empty() {
            blocks.push(Block::new(String::new()));
        }
        if let Some(block) = blocks.last_mut() {
            block.take(number, trimmed)?;
        }
    }
    let names: Vec<String> = blocks.iter().map(|b| b.name.clone()).collect();
    match (name, &names[..]) {
        (Some(name), [one]) if one.is_empty() => super::unnamed(Some(name))?,
        _ => {}
    }
    let chosen = select(&names, name)?;
    blocks.swap_remove(chosen).finish()
}

/// Parameters of a line `*MATRIX INPUT`; other keywords are refused.
fn keyword(number: usize, line: &str) -> Parsed<Block> {
    let fault = |what: String| Fault::new(number, what);
    let mut words = line[1..].split(',').map(str::trim);
    let keyword = words.next().unwrap_or("").split_whitespace().collect::<Vec<_>>().join(" ");
    if !keyword.eq_ignore_ascii_case("matrix input") {
        return Err(fault(format!(
            "found *{}, expected *MATRIX INPUT or lines of data; matrices of elements and substructures are not taken: \
             write the assembled ones by *MATRIX GENERATE with *MATRIX OUTPUT",
            excerpt(&keyword)
        )));
    }
    let mut block = Block::new(String::new());
    for word in words.filter(|w| !w.is_empty()) {
        let (key, value) = word.split_once('=').map_or((word, ""), |(k, v)| (k.trim(), v.trim()));
        match key.to_ascii_uppercase().as_str() {
            "NAME" => block.name = value.trim_matches('"').to_owned(),
            "SCALE FACTOR" => block.scale = real(value).map_err(fault)?,
            "TYPE" if value.eq_ignore_ascii_case("symmetric") => {}
            "TYPE" if value.eq_ignore_ascii_case("unsymmetric") => block.listing = Listing::All,
            _ => {
                return Err(fault(format!(
                    "found the parameter \"{}\" of *MATRIX INPUT, expected NAME, TYPE or SCALE FACTOR; put the data \
                     into this file",
                    excerpt(word)
                )))
            }
        }
    }
    Ok(block)
}
