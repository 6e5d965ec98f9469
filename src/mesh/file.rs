//! Mesh files of any format.

use super::{inp, msh, Mesh, MeshPieces};
use crate::input::text::without_mark;
use crate::{Error, Result};
use std::io::Read;
use std::path::Path;

/// Formats that are not read, by their endings, with what to do.
const OTHERS: [(&[&str], &str, &str); 9] = [
    (&["unv", "med", "mesh"], "a mesh that Gmsh reads", GMSH),
    (&["bdf", "nas", "fem"], "a mesh of Nastran", GMSH),
    (&["vtk"], "a mesh of VTK", GMSH),
    (&["vtu", "xdmf", "e", "exo", "cgns", "k", "f3grid"], "a mesh of another program", MESHIO),
    (
        &["stl", "ply", "obj", "off"],
        "a surface without a volume",
        "fill it with tetrahedra: gmsh -3 -order 2 a script \
     (.geo) with Merge, Surface Loop and Volume, and Physical Surface for each group",
    ),
    (
        &["step", "stp", "iges", "igs", "brep"],
        "a drawing, no mesh",
        "mesh it: gmsh -3 -order 2 FILE -format msh41 \
     -o FILE.msh, with physical groups from the graphical interface of Gmsh or a script (.geo)",
    ),
    (&["geo"], "a script of Gmsh, no mesh", "run it: gmsh -3 -order 2 FILE -format msh41 -o FILE.msh"),
    (
        &["cdb", "db", "dat"],
        "a file of Ansys or Nastran",
        "save the mesh as an input file of Abaqus (.inp), or as .unv or \
     .bdf and convert that with Gmsh",
    ),
    (
        &["odb", "cae", "frd", "fcstd"],
        "a project or results of another program",
        "write the input file (.inp) of the \
     analysis and give that",
    ),
];

const GMSH: &str = "convert it: gmsh FILE -save -format msh41 -o FILE.msh, and name the surfaces as physical groups";
const MESHIO: &str = "convert it: meshio convert FILE FILE.msh (of Python), and name the surfaces as physical groups";

/// Reads a mesh from the file at `path`, by its first letters: an input file of Abaqus and CalculiX begins with `*`,
/// one of Gmsh with `$`; and remarks on what was left out or taken for something else. An upper body's mesh lies at
/// z > 0 and is reflected by the caller ([`Mesh::reflected`]). `pieces` are expected.
///
/// # Errors
/// A file of another format, with what to do; and those of the readers.
pub fn read(path: &Path, pieces: MeshPieces) -> Result<(Mesh, Vec<String>)> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match (first_letter(path), ending.as_str()) {
        (Some(b'*'), _) => inp::read(path, pieces),
        (Some(b'$'), "inp" | "msh" | "") => msh::read_remarked(path, pieces),
        (_, "inp") => inp::read(path, pieces),
        _ => match OTHERS.iter().find(|(endings, ..)| endings.contains(&ending.as_str())) {
            Some((_, what, advice)) => Err(Error::Input(format!(
                "mesh file {}: found {what} (.{ending}), expected one of Gmsh (.msh) or of Abaqus or CalculiX (.inp); \
                 {advice}",
                path.display()
            ))),
            None => msh::read_remarked(path, pieces),
        },
    }
}

/// The first letter of a file that is none of its byte order mark and blanks, if it can be read.
fn first_letter(path: &Path) -> Option<u8> {
    let mut bytes = Vec::new();
    crate::input::open(path).ok()?.take(1 << 12).read_to_end(&mut bytes).ok()?;
    without_mark(&bytes).iter().copied().find(|b| !b.is_ascii_whitespace())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file is read by what it holds; one of another format is refused with the way to convert it.
    #[test]
    fn formats_are_told_by_their_content() {
        let folder = tempfile::tempdir().expect("a folder");
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
        let copy = |from: &str, to: &str, mark: &[u8]| {
            let bytes = std::fs::read(data.join(from)).expect("a mesh");
            std::fs::write(folder.path().join(to), [mark, &bytes].concat()).expect("a copy");
            read(&folder.path().join(to), MeshPieces::One).unwrap_or_else(|e| panic!("{e}")).0
        };
        let expected = copy("inp/hex8.inp", "a.inp", b"");
        for mark in [&b""[..], b"\xef\xbb\xbf"] {
            assert_eq!(copy("inp/hex8.inp", "b.msh", mark), expected);
            assert_eq!(copy("msh/hex8-4.1.msh", "c.msh", mark).cells, expected.cells);
            assert_eq!(copy("msh/hex8-4.1.msh", "c.inp", mark).cells, expected.cells);
        }
        for (name, word) in [
            ("a.unv", "gmsh FILE"),
            ("a.bdf", "gmsh FILE"),
            ("a.med", "gmsh FILE"),
            ("a.vtk", "gmsh FILE"),
            ("a.VTU", "meshio convert"),
            ("a.stl", "Surface Loop"),
            ("a.step", "gmsh -3 -order 2"),
            ("a.frd", ".inp"),
        ] {
            std::fs::write(folder.path().join(name), "-1\n2411\n").expect("a file");
            let error = read(&folder.path().join(name), MeshPieces::One).expect_err(name);
            assert!(error.exit_code() == 3 && error.message().contains(word), "{error}");
        }
    }
}
