//! Columns of a table by their headings.

use super::{Headings, NumberTable};
use crate::{Error, Result};

/// Names of a numbering of the rows; the first one is that of pandas, which has none.
const INDEX: [&str; 11] = ["", "i", "index", "no", "no.", "nr", "nr.", "n", "id", "point", "#"];

/// Units of length, m.
const UNITS: [(&str, f64); 13] = [
    ("m", 1.0),
    ("cm", 1e-2),
    ("mm", 1e-3),
    ("um", 1e-6),
    ("µm", 1e-6),
    ("μm", 1e-6),
    ("micron", 1e-6),
    ("microns", 1e-6),
    ("micrometre", 1e-6),
    ("nm", 1e-9),
    ("in", 0.0254),
    ("inch", 0.0254),
    ("inches", 0.0254),
];

/// A column that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its number, from 0.
    pub at: usize,
    /// Its unit in m, where the heading names one.
    pub unit: Option<f64>,
}

/// Two columns that a table may have.
#[derive(Debug, Clone, Copy)]
pub struct ColumnPair<'a> {
    /// Names that the headings may have for each of them, in lower case; several pairs of names may be given.
    pub names: &'a [[&'a [&'a str]; 2]],
    /// Both columns in words, for messages.
    pub expected: &'a str,
    /// Without headings the first column may not be whole numbers that count the rows.
    pub refuse_counting: bool,
}

/// Returns whether the words are a row of units; a numbering has none.
pub(super) fn are_units(words: &[String]) -> bool {
    let none = |word: &String| word.is_empty() || word == "-";
    words.iter().all(|w| none(w) || unit(w).is_some()) && words.iter().any(|w| unit(w).is_some())
}

/// The unit of length, m, that a word names, in brackets or not.
fn unit(word: &str) -> Option<f64> {
    let word = word.trim_matches(['(', ')', '[', ']', ' ']).to_lowercase();
    UNITS.iter().find(|u| u.0 == word).map(|u| u.1)
}

/// Name and unit of a heading such as `y`, `y (mm)`, `y [mm]`, `y/mm`, `y_mm`, `y in mm` or `y mm`; the unit is `None`
/// in brackets around something else.
fn parts(heading: &str) -> (String, Option<Option<f64>>) {
    let heading = heading.trim();
    if let Some((name, rest)) = heading.split_once(['(', '[']) {
        return (name.trim().to_lowercase(), Some(unit(rest)));
    }
    if let Some((name, word)) = heading.rsplit_once(['/', '_', ' ']) {
        if let Some(unit) = unit(word) {
            let name = name.trim();
            return (name.strip_suffix(" in").unwrap_or(name).trim().to_lowercase(), Some(Some(unit)));
        }
    }
    (heading.to_lowercase(), None)
}

/// A heading.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heading {
    /// As it is written.
    pub title: String,
    /// Name in lower case.
    pub name: String,
    /// Unit in lower case, in brackets behind the name; none where there is none, or `-`.
    pub unit: Option<String>,
}

impl NumberTable {
    /// The headings, one each column; those of a comment above the rows where all of them are `known`.
    pub fn headings(&self, known: &[&str]) -> Option<Vec<Heading>> {
        let heading = |title: &String| {
            let (name, unit) = match title.split_once(['(', '[']) {
                Some((name, rest)) => (name, Some(rest.trim_matches([')', ']', ' ']).to_lowercase())),
                None => (title.as_str(), None),
            };
            let unit = unit.filter(|unit| !unit.is_empty() && unit != "-");
            Heading { title: title.clone(), name: name.trim().to_lowercase(), unit }
        };
        let all = |headings: &Headings| headings.names.iter().map(heading).collect::<Vec<_>>();
        let of_comment =
            || self.comment.as_ref().map(all).filter(|h| h.iter().all(|h| known.contains(&h.name.as_str())));
        self.headings.as_ref().map(all).or_else(of_comment)
    }

    /// The two columns `wanted`; a numbering of the rows under a heading of its own is left out.
    ///
    /// # Errors
    /// More than two columns without headings; a first column that may count the rows; headings that are not those
    /// wanted; a unit that is none.
    pub fn pair(&self, wanted: &ColumnPair) -> Result<[Column; 2]> {
        let known = |h: &&Headings| {
            let name = |n: &String| parts(n).0;
            let role = |n: &str| wanted.names.iter().flatten().any(|names| names.contains(&n));
            h.names.iter().all(|n| role(&name(n)) || INDEX.contains(&name(n).as_str()))
        };
        match self.headings.as_ref().or(self.comment.as_ref().filter(known)) {
            Some(headings) => self.named(headings, wanted),
            None => self.unnamed(wanted),
        }
    }

    fn unnamed(&self, wanted: &ColumnPair) -> Result<[Column; 2]> {
        let counts = self.counts(0);
        if self.columns == 2 && !(wanted.refuse_counting && counts) {
            return Ok([0, 1].map(|at| Column { at, unit: None }));
        }
        let hint = match (counts, self.layout.separator) {
            (true, _) => "the first column counts the rows: leave it out, or name the columns",
            (false, super::Separator::Comma) => {
                "name the columns in a first row; with decimal commas separate columns by semicolons"
            }
            _ => "name the columns in a first row, and leave out all others",
        };
        Err(self.fault(0, format!("{} columns without headings", self.columns), format!("{}: {hint}", wanted.expected)))
    }

    fn named(&self, headings: &Headings, wanted: &ColumnPair) -> Result<[Column; 2]> {
        let fault = |found: String| {
            Error::Input(format!(
                "{}, line {}: found {found}, expected {}; leave out all other columns",
                self.name, headings.line, wanted.expected
            ))
        };
        let mut columns: Vec<(String, Column)> = Vec::new();
        for (at, heading) in headings.names.iter().enumerate() {
            let (name, unit) = parts(heading);
            if INDEX.contains(&name.as_str()) && self.counts(at) {
                continue;
            }
            if columns.iter().any(|c| c.0 == name) {
                return Err(fault(format!("two columns \"{name}\"")));
            }
            let unit = match unit {
                Some(None) => {
                    return Err(fault(format!("the heading \"{heading}\", whose unit is none of m, cm, mm, µm or in")))
                }
                unit => unit.flatten().or(headings.units.get(at).and_then(|u| self::unit(u))),
            };
            columns.push((name, Column { at, unit }));
        }
        for [first, second] in wanted.names {
            let place = |names: &[&str]| columns.iter().position(|c| names.contains(&c.0.as_str()));
            if let (Some(a), Some(b), 2) = (place(first), place(second), columns.len()) {
                if a != b {
                    return Ok([columns[a].1.clone(), columns[b].1.clone()]);
                }
            }
        }
        let names: Vec<&str> = headings.names.iter().map(String::as_str).collect();
        Err(fault(format!("the columns \"{}\"", names.join("\", \""))))
    }

    /// Returns whether the fields of a column are digits that count the rows.
    pub fn counts(&self, at: usize) -> bool {
        let first = self.values[at];
        self.rows() > 2 && self.whole[at] && (0..self.rows()).all(|i| self.row(i)[at] == first + i as f64)
    }

    /// Columns that were taken, in words, with those that were left out.
    pub fn described(&self, taken: &[Column]) -> String {
        let headings = self.headings.as_ref().or(self.comment.as_ref());
        let name = |at: usize| match headings.and_then(|h| h.names.get(at)) {
            Some(name) if !name.is_empty() => format!("\"{name}\""),
            _ => format!("{}", at + 1),
        };
        let used: Vec<String> = taken.iter().map(|c| name(c.at)).collect();
        let left: Vec<String> = (0..self.columns).filter(|at| taken.iter().all(|c| c.at != *at)).map(name).collect();
        match left.is_empty() {
            true => format!("columns {}", used.join(" and ")),
            false => format!("columns {}, without the numbering {}", used.join(" and "), left.join(", ")),
        }
    }
}
