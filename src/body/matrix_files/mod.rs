//! Readers of matrices that other programs write, one module for each format, and the maps of their degrees of freedom.
//!
//! A reader gives a real square matrix, and where the file says so node and direction of every row. What a file does
//! not say for certain is refused with the line, what was found, what was expected and what to do.

mod abaqus;
mod calculix;
mod dmig;
pub mod dofs;
mod entries;
mod harwell_boeing;
mod numbers;
mod op4;
mod op4_binary;
#[cfg(test)]
mod tests;

use super::matrix_market::{self, Csr};
use crate::{Error, Result};
pub use dofs::Dof;
use std::path::Path;

/// Formats of matrix files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Matrix Market, coordinate or array.
    MatrixMarket,
    /// Text of Abaqus' `*MATRIX OUTPUT`: matrix input, labels or coordinate.
    Abaqus,
    /// Text of CalculiX' `SOLVER=MATRIXSTORAGE`.
    CalculiX,
    /// Bulk data entries DMIG of Nastran.
    Dmig,
    /// OUTPUT4 of Nastran, text or binary.
    Op4,
    /// Harwell–Boeing.
    HarwellBoeing,
}

impl Format {
    /// Formats and their names in a job.
    pub const NAMES: [(Format, &'static str); 6] = [
        (Format::MatrixMarket, "matrix_market"),
        (Format::Abaqus, "abaqus"),
        (Format::CalculiX, "calculix"),
        (Format::Dmig, "dmig"),
        (Format::Op4, "op4"),
        (Format::HarwellBoeing, "harwell_boeing"),
    ];

    /// Format by the ending of the file, and where two share it by its first line.
    fn by_ending(path: &Path, bytes: &[u8]) -> std::result::Result<Format, String> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let banner = crate::input::text::without_mark(bytes).get(..14).is_some_and(|b| b.eq_ignore_ascii_case(BANNER));
        Ok(match ending.as_str() {
            _ if banner => Format::MatrixMarket,
            "mm" => Format::MatrixMarket,
            "mtx" => Format::Abaqus,
            "sti" | "mas" => Format::CalculiX,
            "pch" | "bdf" | "nas" | "dat" => Format::Dmig,
            "op4" => Format::Op4,
            "rua" | "rsa" | "rza" | "rra" | "pua" | "psa" | "rse" | "rue" | "cua" | "csa" | "hb" | "matrix" => {
                Format::HarwellBoeing
            }
            _ => {
                let names: Vec<&str> = Format::NAMES.iter().map(|(_, name)| *name).collect();
                return Err(format!(
                    "found the ending \"{ending}\", expected one of mtx, mm, sti, mas, pch, bdf, nas, dat, op4, rua, \
                     rsa, rza, hb, matrix; name the format, {{\"path\": …, \"format\": …}} with one of {}",
                    names.join(", ")
                ));
            }
        })
    }
}

/// Beginning of every Matrix Market file.
const BANNER: &[u8] = b"%%MatrixMarket";

/// Largest order: MUMPS numbers rows with 32 bits.
const MAX_ORDER: usize = 100_000_000;
/// Orders up to which a matrix may have fewer entries than rows: a few bytes must not ask for memory without end.
const UNCHECKED: usize = 4_000_000;

/// A matrix file, and the matrix in it.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// Path.
    pub path: &'a Path,
    /// Name of the matrix in the file, where it has names.
    pub name: Option<&'a str>,
    /// Format; without it the ending says it.
    pub format: Option<Format>,
}

/// A matrix as a file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelledMatrix {
    /// The matrix.
    pub matrix: Csr,
    /// Node and direction of each row, ascending; none where the file numbers the rows only.
    pub dofs: Option<Vec<Dof>>,
}

/// A fault of a file with its line, counted from 1; 0: the file as a whole.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    line: usize,
    what: String,
}

impl Fault {
    fn new(line: usize, what: impl Into<String>) -> Self {
        Self { line, what: what.into() }
    }
}

/// Result of a reader.
type Parsed<T> = std::result::Result<T, Fault>;

/// Reads the matrix of a source.
///
/// # Errors
/// `Error::Input` with the path, the line, what was found and what was expected.
pub fn read(source: &Source) -> Result<LabelledMatrix> {
    let path = source.path.display();
    let fail = |what: String| Error::Input(format!("{path}: cannot read the matrix: {what}"));
    let bytes = crate::input::read(source.path).map_err(|e| fail(e.to_string()))?;
    let format = source.format.map_or_else(|| Format::by_ending(source.path, &bytes), Ok).map_err(fail)?;
    let matrix = parse(&bytes, format, source.name).map_err(|fault| match fault.line {
        0 => Error::Input(format!("{path}: {}", fault.what)),
        line => Error::Input(format!("{path}: line {line}: {}", fault.what)),
    })?;
    if source.format.is_none() && format == Format::Abaqus && matrix.dofs.is_none() {
        return Err(fail(
            "found lines of three numbers and no Matrix Market banner; expected \"%%MatrixMarket …\" in the first \
             line, or for Abaqus' FORMAT=COORDINATE the format in the job, {\"path\": …, \"format\": \"abaqus\"}"
                .into(),
        ));
    }
    Ok(matrix)
}

/// The matrix `name` of the content of a file.
fn parse(bytes: &[u8], format: Format, name: Option<&str>) -> Parsed<LabelledMatrix> {
    if format == Format::Op4 && op4_binary::is_binary(bytes) {
        return op4_binary::parse(bytes, name);
    }
    let text = crate::input::text::decode(bytes).map_err(|what| Fault::new(0, what))?;
    match format {
        Format::MatrixMarket => {
            let matrix = matrix_market::parse(&text).map_err(|(line, what)| Fault::new(line, what))?;
            unnamed(name)?;
            Ok(LabelledMatrix { matrix, dofs: None })
        }
        Format::Abaqus => abaqus::parse(&text, name),
        Format::CalculiX => unnamed(name).and_then(|()| calculix::parse(&text)),
        Format::Dmig => dmig::parse(&text, name),
        Format::Op4 => op4::parse(&text, name),
        Format::HarwellBoeing => unnamed(name).and_then(|()| harwell_boeing::parse(&text)),
    }
}

/// Refuses a name for a format of one matrix in a file.
fn unnamed(name: Option<&str>) -> Parsed<()> {
    match name {
        Some(name) => {
            let what =
                format!("found the name \"{name}\" in the job, but files of this format have no names; leave it out");
            Err(Fault::new(0, what))
        }
        None => Ok(()),
    }
}

/// Index of the matrix that is meant among the `names` of a file.
fn select(names: &[String], wanted: Option<&str>) -> Parsed<usize> {
    let list = || if names.is_empty() { "none".into() } else { names.join(", ") };
    match wanted {
        Some(name) => {
            let same = |n: &String| n.eq_ignore_ascii_case(name);
            names.iter().position(same).ok_or_else(|| {
                Fault::new(0, format!("found the matrices {}, expected one named \"{name}\"; correct the name", list()))
            })
        }
        None if names.len() == 1 => Ok(0),
        None if names.is_empty() => {
            Err(Fault::new(0, "found no matrix in the file, expected one; is it another format?"))
        }
        None => Err(Fault::new(
            0,
            format!(
                "found the matrices {}, expected one; name it, {{\"path\": …, \"name\": \"{}\"}}",
                list(),
                names[0]
            ),
        )),
    }
}
