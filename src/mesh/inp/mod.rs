//! Reader of the input files of Abaqus and CalculiX: nodes, solid elements, sets and surfaces; parts and instances
//! become one mesh.
//!
//! Sources: Abaqus Keywords Reference Guide and Elements Guide ("Three-dimensional solid element library": order of
//! nodes, numbers of faces); CalculiX CrunchiX user's manual ("Element types", "*SURFACE"). Names are
//! case-insensitive there: groups have them in lower case.

mod deck;
mod elements;
mod flatten;
mod keywords;
mod lines;
mod parse;
#[cfg(test)]
mod tests;

use super::listed::FileOrigin;
use super::{Mesh, MeshPieces, Naming};
use crate::{Error, Result};
use lines::{place, DeckLines, Place};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Reads a mesh from the file at `path` and the files that it includes, and remarks: what was left out, and what was
/// taken for something else. `pieces` are expected.
pub fn read(path: &Path, pieces: MeshPieces) -> Result<(Mesh, Vec<String>)> {
    let name = path.display().to_string();
    let file = crate::input::open(path).map_err(|e| {
        Error::Input(format!("mesh file {name} cannot be read: {e}; expected an input file of Abaqus or CalculiX"))
    })?;
    let lines = Box::new(std::io::BufReader::with_capacity(1 << 18, file));
    of_lines(DeckLines::new(lines, path.to_path_buf()), pieces)
}

/// Reads a mesh from the bytes of a file; `name` stands in messages, and files are included relative to it.
pub fn parse(data: &[u8], name: &str) -> Result<(Mesh, Vec<String>)> {
    of_lines(DeckLines::new(Box::new(std::io::Cursor::new(data)), PathBuf::from(name)), MeshPieces::One)
}

fn of_lines(mut lines: DeckLines, pieces: MeshPieces) -> Result<(Mesh, Vec<String>)> {
    let deck = parse::deck(&mut lines)?;
    let mut files = Files { names: lines.files, ..Files::default() };
    let mut remarks = deck.remarks.said(&files);
    let listed = flatten::flatten(deck, &mut files)?;
    let (mut mesh, more) = listed.mesh(&files, pieces)?;
    mesh.naming = Naming::Abaqus;
    name_groups(&mut mesh, &files);
    let name = files.names.first().map(|f| f.display().to_string()).unwrap_or_default();
    remarks.extend(more.into_iter().map(|text| format!("{name}: {}", files.shown(&text))));
    Ok((mesh, remarks))
}

/// Scope of the sets and surfaces of the assembly in names of groups.
const ASSEMBLY: &str = "assembly";

/// Gives groups of parts and of the assembly their bare names where only one has it, or all of that name are the same
/// facets, and remembers their full names.
fn name_groups(mesh: &mut Mesh, files: &Files) {
    if files.parts.is_empty() {
        return;
    }
    let mut bare: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for full in mesh.groups.keys() {
        if let Some((_, name)) = full.split_once(SEPARATOR) {
            bare.entry(name.to_owned()).or_default().push(full.clone());
        }
    }
    for (name, all) in bare {
        let sorted = |full: &String| {
            let mut facets = mesh.groups.get(full).cloned().unwrap_or_default();
            facets.sort_unstable();
            facets
        };
        let one = all.windows(2).all(|w| sorted(&w[0]) == sorted(&w[1]));
        for full in &all {
            let Some(facets) = mesh.groups.remove(full) else { continue };
            let group = if one { name.clone() } else { files.shown(full) };
            mesh.groups.entry(group.clone()).or_insert(facets);
            for written in files.spellings(full) {
                mesh.aliases.insert(written, group.clone());
            }
        }
    }
}

/// Stands between scope and name of a group while the file is read: names may have points.
const SEPARATOR: char = '\u{1}';

/// Names of files and instances, for messages.
#[derive(Default)]
struct Files {
    names: Vec<PathBuf>,
    /// Names of the instances that numbers belong to; none of a file without instances.
    instances: Vec<String>,
    /// Names of the parts of these instances; none of a file without parts.
    parts: Vec<String>,
}

impl Files {
    /// Name of a set or a surface of an instance, or of the assembly behind the last one, as that of a group.
    fn scoped(&self, instance: usize, name: &str) -> String {
        match self.instances.get(instance) {
            _ if self.parts.is_empty() => name.to_owned(),
            Some(scope) if !scope.is_empty() => format!("{scope}{SEPARATOR}{name}"),
            _ => format!("{ASSEMBLY}{SEPARATOR}{name}"),
        }
    }

    /// A name of a group as it is shown.
    fn shown(&self, full: &str) -> String {
        full.replace(SEPARATOR, ".")
    }

    /// Full names by which a job may call a group: by its instance, or by the part if that has one instance.
    fn spellings(&self, full: &str) -> Vec<String> {
        let Some((scope, name)) = full.split_once(SEPARATOR) else { return Vec::new() };
        let part = self.instances.iter().position(|i| i == scope).and_then(|i| self.parts.get(i));
        let single = part.filter(|part| self.parts.iter().filter(|p| p == part).count() == 1);
        [Some(scope), single.map(String::as_str)].into_iter().flatten().map(|s| format!("{s}.{name}")).collect()
    }

    /// The file and line of a place.
    fn at(&self, at: Place) -> String {
        let [file, line] = place(at);
        let name = self.names.get(file as usize).map(|f| f.display().to_string()).unwrap_or_default();
        format!("{name}, line {line}")
    }
}

impl FileOrigin for Files {
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
