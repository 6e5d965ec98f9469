//! Reader of the input files of Abaqus and CalculiX: nodes, solid elements, sets and surfaces; parts and instances become one mesh.
//!
//! Sources: Abaqus Keywords Reference Guide and Elements Guide ("Three-dimensional solid element library": order of nodes, numbers of faces); CalculiX
//! CrunchiX user's manual ("Element types", "*SURFACE"). Names are case-insensitive there: groups have them in lower case.

mod deck;
mod elements;
mod flatten;
mod keywords;
mod lines;
mod parse;
#[cfg(test)]
mod tests;

use super::listed::Origin;
use super::{Mesh, Naming};
use crate::{Error, Result};
use lines::{place, Lines, Place};
use std::path::{Path, PathBuf};

/// Reads a mesh from the file at `path` and the files that it includes, and remarks: what was left out, and what was taken for something else.
pub fn read(path: &Path) -> Result<(Mesh, Vec<String>)> {
    let name = path.display().to_string();
    let file = crate::input::open(path).map_err(|e| {
        Error::Input(format!("mesh file {name} cannot be read: {e}; expected an input file of Abaqus or CalculiX"))
    })?;
    of_lines(Lines::new(Box::new(std::io::BufReader::with_capacity(1 << 18, file)), path.to_path_buf()))
}

/// Reads a mesh from the bytes of a file; `name` stands in messages, and files are included relative to it.
pub fn parse(data: &[u8], name: &str) -> Result<(Mesh, Vec<String>)> {
    of_lines(Lines::new(Box::new(std::io::Cursor::new(data)), PathBuf::from(name)))
}

fn of_lines(mut lines: Lines) -> Result<(Mesh, Vec<String>)> {
    let deck = parse::deck(&mut lines)?;
    let mut files = Files { names: lines.files, instances: Vec::new() };
    let mut remarks = deck.remarks.said(&files);
    let listed = flatten::flatten(deck, &mut files)?;
    let (mut mesh, more) = listed.mesh(&files)?;
    mesh.naming = Naming::Abaqus;
    let name = files.names.first().map(|f| f.display().to_string()).unwrap_or_default();
    remarks.extend(more.into_iter().map(|text| format!("{name}: {text}")));
    Ok((mesh, remarks))
}

/// Names of files and instances, for messages.
struct Files {
    names: Vec<PathBuf>,
    /// Names of the instances that numbers belong to; none of a file without instances.
    instances: Vec<String>,
}

impl Files {
    /// The file and line of a place.
    fn at(&self, at: Place) -> String {
        let [file, line] = place(at);
        let name = self.names.get(file as usize).map(|f| f.display().to_string()).unwrap_or_default();
        format!("{name}, line {line}")
    }
}

impl Origin for Files {
    fn error(&self, at: u64, what: String) -> Error {
        Error::Input(format!("{}: {what}", self.at(at)))
    }

    fn number(&self, tag: u64) -> String {
        let (instance, id) = ((tag >> 32) as usize, tag as u32);
        match self.instances.get(instance).filter(|n| !n.is_empty()) {
            Some(name) => format!("{id} of the instance {name}"),
            None => id.to_string(),
        }
    }

    fn merge(&self) -> &'static str {
        "equivalence them where the mesh was made; parts that are tied to each other are no one body"
    }
}
