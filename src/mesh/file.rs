//! Mesh files of any format.

use super::{inp, msh, Mesh};
use crate::Result;
use std::path::Path;

/// Reads a mesh from the file at `path`, by its ending: `.inp` of Abaqus and CalculiX, else Gmsh's MSH; and remarks on what was left out or taken for
/// something else. An upper body's mesh lies at z > 0 and is reflected by the caller ([`Mesh::reflected`]).
pub fn read(path: &Path) -> Result<(Mesh, Vec<String>)> {
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("inp") => inp::read(path),
        _ => Ok((msh::read(path)?, Vec::new())),
    }
}
