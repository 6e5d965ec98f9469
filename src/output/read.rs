//! Reading a result file back.

use super::values::Values;
use crate::{Error, Result};
use hdf5::types::{IntSize, TypeDescriptor, VarLenUnicode};
use ndarray::s;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// An open result file. Errors name the file and the dataset.
pub struct Reader {
    file: hdf5::File,
    path: PathBuf,
}

impl Reader {
    /// Opens a file for reading; `Error::Input` if it is missing, truncated or no HDF5 file.
    pub fn open(path: &Path) -> Result<Self> {
        if let Err(e) = std::fs::File::open(path) {
            return Err(Error::Input(format!("cannot read {}: {e}", path.display())));
        }
        let file = hdf5::File::open(path).map_err(|e| {
            Error::Input(format!("{} is no HDF5 file, or a truncated one ({e}); make it again", path.display()))
        })?;
        Ok(Self { file, path: path.to_owned() })
    }

    /// True if there is such a dataset or group.
    pub fn has(&self, path: &str) -> bool {
        let mut at = String::new();
        path.split('/').filter(|p| !p.is_empty()).all(|part| {
            at = format!("{at}/{part}");
            self.file.link_exists(&at)
        })
    }

    /// Names of what is in a group, in alphabetical order.
    pub fn names(&self, group: &str) -> Result<Vec<String>> {
        let names = self.file.group(group).and_then(|g| g.member_names());
        names.map_err(|e| self.fault(group, &e.to_string()))
    }

    /// Shape and values of a dataset.
    pub fn read(&self, path: &str) -> Result<(Vec<usize>, Values)> {
        if !self.has(path) {
            return Err(self.fault(path, "it is not there; was the file made with the same analyses?"));
        }
        let read = || -> hdf5::Result<(Vec<usize>, Values)> {
            let dataset = self.file.dataset(path)?;
            let values = match dataset.dtype()?.to_descriptor()? {
                TypeDescriptor::Float(hdf5::types::FloatSize::U8) => Values::F64(dataset.read_raw()?),
                TypeDescriptor::Float(_) => Values::F32(dataset.read_raw()?),
                TypeDescriptor::Integer(IntSize::U1) => Values::I8(dataset.read_raw()?),
                TypeDescriptor::Integer(IntSize::U4) => Values::I32(dataset.read_raw()?),
                TypeDescriptor::Integer(_) => Values::I64(dataset.read_raw()?),
                TypeDescriptor::Unsigned(IntSize::U1) => Values::U8(dataset.read_raw()?),
                TypeDescriptor::Compound(_) => Values::Complex(dataset.read_raw()?),
                TypeDescriptor::VarLenUnicode => {
                    let text: Vec<VarLenUnicode> = dataset.read_raw()?;
                    Values::Text(text.iter().map(|t| t.as_str().to_owned()).collect())
                }
                other => return Err(format!("its type {other} is not one of this program's").into()),
            };
            Ok((dataset.shape(), values))
        };
        read().map_err(|e| self.fault(path, &e.to_string()))
    }

    /// Shape and values of a dataset of real numbers.
    pub fn numbers(&self, path: &str) -> Result<(Vec<usize>, Vec<f64>)> {
        match self.read(path)? {
            (shape, Values::F64(v)) => Ok((shape, v)),
            _ => Err(self.fault(path, "it does not hold real numbers of double precision")),
        }
    }

    /// Rows `rows` of a dataset of three columns in single precision, `[rows, 3]` row by row.
    pub fn rows(&self, path: &str, rows: Range<usize>) -> Result<Vec<f64>> {
        let read = || -> hdf5::Result<Vec<f64>> {
            let dataset = self.file.dataset(path)?;
            let shape = dataset.shape();
            if shape.len() != 2 || shape[1] != 3 || shape[0] < rows.end {
                return Err(format!("it has the shape {shape:?}, expected {} rows of 3 at least", rows.end).into());
            }
            let values = dataset.read_slice_2d::<f32, _>(s![rows.clone(), ..])?;
            Ok(values.iter().map(|&v| f64::from(v)).collect())
        };
        read().map_err(|e| self.fault(path, &e.to_string()))
    }

    /// A scalar text.
    pub fn text(&self, path: &str) -> Result<String> {
        match self.read(path)?.1 {
            Values::Text(v) if v.len() == 1 => Ok(v.into_iter().next().unwrap_or_default()),
            _ => Err(self.fault(path, "it is not one text")),
        }
    }

    /// A text attribute (`units`, `description`) of a dataset.
    pub fn attribute(&self, path: &str, name: &str) -> Result<String> {
        let read = || self.file.dataset(path)?.attr(name)?.read_scalar::<VarLenUnicode>();
        read().map(|t| t.as_str().to_owned()).map_err(|e| self.fault(path, &format!("attribute {name}: {e}")))
    }

    fn fault(&self, path: &str, what: &str) -> Error {
        Error::Input(format!("{}: cannot read dataset {path}: {what}", self.path.display()))
    }
}
