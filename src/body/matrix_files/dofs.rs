//! Degrees of freedom of rows: node and direction, and the files that list them.

use super::numbers::{index, integer};
use super::{Fault, Parsed, MAX_ORDER};
use crate::input::text::{decode, excerpt, lines};
use crate::{Error, Result};
use std::fmt;
use std::path::Path;

/// Node and direction of a row: 1 to 3 displacements along x, y, z, 4 to 6 rotations about them, 0 a point without
/// directions, as Nastran's scalar points and modal coordinates are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Dof {
    /// Number of the node; below 0 a node that the other program made for itself.
    pub node: i64,
    /// Direction, 0 to 6.
    pub direction: u8,
}

impl fmt::Display for Dof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "node {} {}", self.node, NAMES.get(self.direction as usize).unwrap_or(&"?"))
    }
}

/// Names of the directions in messages.
const NAMES: [&str; 7] = ["scalar", "x", "y", "z", "rx", "ry", "rz"];

impl Dof {
    /// From a node and a direction, by their words.
    pub(super) fn from_words(node: &str, direction: &str, least: u8) -> std::result::Result<Self, String> {
        let node = integer(node, "a node")?;
        if node == 0 {
            return Err("found the node 0, expected a node number that is not 0".into());
        }
        let direction = match integer(direction, "a direction")? {
            d if (i64::from(least)..=6).contains(&d) => d as u8,
            d => {
                return Err(format!(
                    "found the direction {d} of node {node}, expected 1 to 6: displacements and rotations; leave \
                     other fields (temperature, pressure, warping) out of the model"
                ))
            }
        };
        Ok(Self { node, direction })
    }
}

/// Reads the file that lists node and direction of each row.
///
/// One row a line, in their order: `node.direction` as CalculiX writes it, or `node direction`; or with the row in
/// front, `row node direction`, in any order and behind a heading, as Ansys' mapping has it. Directions are 1 to 6, or
/// UX, UY, UZ, ROTX, ROTY, ROTZ.
///
/// # Errors
/// `Error::Input` with path and line.
pub fn read(path: &Path) -> Result<Vec<Dof>> {
    let name = path.display();
    let fail = |what: String| Error::Input(format!("{name}: cannot read the degrees of freedom: {what}"));
    let bytes = crate::input::read(path).map_err(|e| fail(e.to_string()))?;
    let text = decode(&bytes).map_err(fail)?;
    parse(&text).map_err(|Fault { line, what }| match line {
        0 => Error::Input(format!("{name}: {what}")),
        line => Error::Input(format!("{name}: line {line}: {what}")),
    })
}

pub(super) fn parse(text: &str) -> Parsed<Vec<Dof>> {
    let mut listed: Vec<(Option<usize>, Dof, usize)> = Vec::new();
    for (number, line) in lines(text) {
        let line = line.trim();
        if line.is_empty() || ["#", "!", "%", "**", "$"].iter().any(|c| line.starts_with(c)) {
            continue;
        }
        let words: Vec<&str> = line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()).collect();
        // Ansys' mapping begins with the names of its columns.
        if listed.is_empty() && words.iter().all(|w| w.starts_with(|c: char| c.is_ascii_alphabetic())) {
            continue;
        }
        let fault = |what: String| Fault::new(number, what);
        let (row, node, direction) = match words[..] {
            [both] => {
                let expected = || fault(format!("found \"{}\", expected node.direction, as 12.3", excerpt(both)));
                let (node, direction) = both.split_once('.').ok_or_else(expected)?;
                (None, node, direction)
            }
            [node, direction] => (None, node, direction),
            [row, node, direction] => (Some(index(row, "row").map_err(fault)?), node, direction),
            _ => return Err(fault(format!("found \"{}\", expected node and direction of a row", excerpt(line)))),
        };
        let dof = Dof::from_words(node, by_name(direction), 0).map_err(fault)?;
        listed.push((row, dof, number));
    }
    order(listed)
}

/// The number of a direction that Ansys names.
fn by_name(direction: &str) -> &str {
    match direction.to_ascii_uppercase().as_str() {
        "UX" => "1",
        "UY" => "2",
        "UZ" => "3",
        "ROTX" => "4",
        "ROTY" => "5",
        "ROTZ" => "6",
        _ => direction,
    }
}

/// The degrees of freedom by their rows; every row and every degree of freedom is listed once.
fn order(mut listed: Vec<(Option<usize>, Dof, usize)>) -> Parsed<Vec<Dof>> {
    let Some(first) = listed.first().copied() else {
        return Err(Fault::new(0, "found no degree of freedom, expected one line for each row of the matrices"));
    };
    if let Some((_, _, line)) = listed.iter().find(|l| l.0.is_some() != first.0.is_some()) {
        return Err(Fault::new(*line, "found rows with and without their number, expected the same in all lines"));
    }
    listed.sort_by_key(|l| l.0);
    for (k, (row, dof, line)) in listed.iter().enumerate() {
        if let Some(row) = row.filter(|&row| row != k) {
            let what = format!("found row {} for {dof}, expected row {}: each of them once", row + 1, k + 1);
            return Err(Fault::new(*line, what));
        }
    }
    if listed.len() > MAX_ORDER {
        return Err(Fault::new(0, format!("found {} rows, expected at most {MAX_ORDER}", listed.len())));
    }
    let mut sorted: Vec<(Dof, usize)> = listed.iter().map(|l| (l.1, l.2)).collect();
    sorted.sort_unstable();
    if let Some(w) = sorted.windows(2).find(|w| w[0].0 == w[1].0) {
        return Err(Fault::new(w[1].1, format!("found {} again, given in line {} already", w[1].0, w[0].1)));
    }
    Ok(listed.into_iter().map(|l| l.1).collect())
}
