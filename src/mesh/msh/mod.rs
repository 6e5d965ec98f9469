//! Reader of Gmsh's MSH 4.1 and 2.2, ASCII and binary: cells and the physical groups of their boundary facets.
//!
//! Format: Gmsh reference manual, "MSH file format". Every error names the file and the line (ASCII) or byte offset
//! (binary).

mod cursor;
pub(crate) mod plane;
mod sections;
mod v2;
mod v4;

use super::listed::FileOrigin;
use super::{Mesh, MeshPieces};
use crate::{Error, Result};
use cursor::{Cursor, InputSource};
use sections::RawSections;
use std::path::Path;

/// Reads a mesh from the file at `path`. Lengths in the file are in m. An upper body's mesh lies at z > 0 and is
/// reflected by the caller ([`Mesh::reflected`]).
pub fn read(path: &Path) -> Result<Mesh> {
    Ok(read_remarked(path, MeshPieces::One)?.0)
}

/// The same with remarks on its cells, of a mesh that may have some `pieces`.
pub fn read_remarked(path: &Path, pieces: MeshPieces) -> Result<(Mesh, Vec<String>)> {
    let name = path.display().to_string();
    let mut file = crate::input::open(path).map_err(|e| {
        Error::Input(format!("mesh file {name} cannot be read: {e}; expected a Gmsh MSH file, version 4.1 or 2.2"))
    })?;
    of_source(&mut file, &name, pieces)
}

/// Reads a mesh from the bytes of a file; `name` stands in messages.
pub fn parse(data: &[u8], name: &str) -> Result<Mesh> {
    Ok(of_source(&mut std::io::Cursor::new(data), name, MeshPieces::One)?.0)
}

fn of_source(source: &mut dyn InputSource, name: &str, pieces: MeshPieces) -> Result<(Mesh, Vec<String>)> {
    let mut cursor = Cursor::new(source, name)?;
    cursor.skip_mark()?;
    let listed = RawSections::default().read(&mut cursor)?;
    let (mesh, remarks) = listed.mesh(&cursor, pieces)?;
    Ok((mesh, remarks.into_iter().map(|text| format!("{name}: {text}")).collect()))
}

impl FileOrigin for Cursor<'_> {
    fn error(&self, at: u64, what: String) -> Error {
        self.error_at(at, what)
    }

    fn merge(&self) -> &'static str {
        "Gmsh: removeDuplicateNodes, or fragment the volumes"
    }
}
