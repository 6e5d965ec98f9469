//! Reading a result file back.

use super::checksums::{digest, Pieces};
use super::provenance::hexadecimal;
use super::table::SUM;
use super::values::Values;
use super::vtkhdf::strong;
use crate::{memory, Error, Result};
use hdf5::types::{IntSize, TypeDescriptor, VarLenUnicode};
use ndarray::s;
use std::cell::OnceCell;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A chunk, byte, is not larger than this unless its dataset is.
const CHUNK: u128 = 32 << 20;

/// Reading a result file takes no more memory than ten times its size and this, byte.
const ROOM: u64 = 64 << 20;

/// An open result file. Errors name the file and the dataset.
///
/// ```
/// use railsqueal::output::Reader;
/// use std::path::Path;
///
/// /// Growth rates, 1/s, and frequencies, Hz, of a result.
/// fn eigenvalues(file: &Path) -> railsqueal::Result<[Vec<f64>; 2]> {
///     let result = Reader::open(file)?;
///     let (_, growth) = result.numbers("stability/growth_rate")?;
///     let (_, frequency) = result.numbers("stability/frequency")?;
///     Ok([growth, frequency])
/// }
/// let error = eigenvalues(Path::new("none.h5")).unwrap_err();
/// assert!(error.message().contains("none.h5"));
/// ```
pub struct Reader {
    file: hdf5::File,
    path: PathBuf,
    /// Sums of the rows that the ranks wrote, once they are asked for.
    pieces: OnceCell<Pieces>,
}

impl Reader {
    /// Opens a file for reading; `Error::Input` if it is missing, truncated or no HDF5 file.
    pub fn open(path: &Path) -> Result<Self> {
        if let Err(e) = crate::input::open(path) {
            return Err(Error::Input(format!("cannot read {}: {e}", path.display())));
        }
        let file = hdf5::File::with_options().with_fapl(strong).open(path).map_err(|e| {
            Error::Input(format!("{} is no HDF5 file, or a truncated one ({e}); make it again", path.display()))
        })?;
        Ok(Self { file, path: path.to_owned(), pieces: OnceCell::new() })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
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

    /// Shape and values of a dataset whose SHA-256 was written beside it; an error where they do not fit it, or where
    /// there is none.
    pub(crate) fn verified(&self, path: &str) -> Result<(Vec<usize>, Values)> {
        let (shape, values) = self.read(path)?;
        let sum = self.attribute(path, SUM).map_err(|e| e.context("a checksum is missing"))?;
        if sum != hexadecimal(&digest(path, &shape, &values)) {
            return Err(self
                .fault(path, "it is damaged: its SHA-256 is not that with which it was written; make the file again"));
        }
        Ok((shape, values))
    }

    /// [`Reader::verified`] for real numbers.
    pub(crate) fn verified_numbers(&self, path: &str) -> Result<(Vec<usize>, Vec<f64>)> {
        match self.verified(path)? {
            (shape, Values::F64(v)) => Ok((shape, v)),
            _ => Err(self.fault(path, "it does not hold real numbers of double precision")),
        }
    }

    /// [`Reader::verified`] for a scalar text.
    pub(crate) fn verified_text(&self, path: &str) -> Result<String> {
        match self.verified(path)?.1 {
            Values::Text(v) if v.len() == 1 => Ok(v.into_iter().next().unwrap_or_default()),
            _ => Err(self.fault(path, "it is not one text")),
        }
    }

    /// Shape and values of a dataset that the ranks wrote row by row, with the sums of all their rows in the file.
    pub(crate) fn verified_rows(&self, path: &str) -> Result<(Vec<usize>, Values)> {
        let (shape, values) = self.read(path)?;
        let rows = shape.first().copied().unwrap_or(1);
        self.fit(path, 0..rows, &values)?;
        Ok((shape, values))
    }

    /// An error unless the values of these rows of a dataset fit the sums in the file.
    fn fit(&self, path: &str, rows: Range<usize>, values: &Values) -> Result<()> {
        if self.pieces.get().is_none() {
            let name = |name: &str| self.verified(&format!("/checksums/{name}")).map(|(_, values)| values);
            let tables = [name("names")?, name("dataset")?, name("first_row")?, name("rows")?, name("sha256")?];
            let pieces =
                Pieces::new(tables).ok_or_else(|| self.fault("/checksums", "its datasets contradict each other"))?;
            let _ = self.pieces.set(pieces);
        }
        let columns = values.len() / rows.len().max(1);
        let part = |first: usize, count: usize| values.slice(first * columns..(first + count) * columns);
        match self.pieces.get().is_some_and(|p| p.fit(path, rows.start, rows.len(), part)) {
            true => Ok(()),
            false => Err(self.fault(
                path,
                "it is damaged: the SHA-256 of its pieces are not those with which \
             they were written; make the file again",
            )),
        }
    }

    /// An error where a dataset is larger than what there is of it in the file: damage to a size alone must not ask
    /// for memory without end.
    fn holds(&self, dataset: &hdf5::Dataset) -> hdf5::Result<()> {
        let size = dataset.dtype()?.size() as u128;
        let bytes = |shape: &[usize]| shape.iter().fold(size, |n, &along| n.saturating_mul(along as u128));
        let wanted = bytes(&dataset.shape());
        let there = match (dataset.chunk(), dataset.num_chunks()) {
            // All chunks of what was written are there.
            (Some(chunk), Some(count)) if bytes(&chunk) <= wanted.max(CHUNK) => {
                bytes(&chunk).saturating_mul(count as u128)
            }
            (Some(_), _) => 0,
            _ => std::fs::metadata(&self.path).map_or(u128::MAX, |m| m.len().into()),
        };
        match wanted <= there {
            true => Ok(()),
            false => Err(format!("it is damaged: {wanted} bytes by its shape, {there} in the file").into()),
        }
    }

    /// A dataset as it lies in the file.
    pub(super) fn dataset(&self, path: &str) -> Result<hdf5::Dataset> {
        self.file.dataset(path).map_err(|e| self.fault(path, &e.to_string()))
    }

    /// Shape and values of a dataset.
    pub fn read(&self, path: &str) -> Result<(Vec<usize>, Values)> {
        if !self.has(path) {
            return Err(self.fault(path, "it is not there; was the file made with the same analyses?"));
        }
        let read = || -> hdf5::Result<(Vec<usize>, Values)> {
            let dataset = self.file.dataset(path)?;
            self.holds(&dataset)?;
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

    /// Rows `rows` of a dataset of three columns in single or double precision, `[rows, 3]` row by row; they fit the
    /// sums of the pieces in the file.
    pub fn rows(&self, path: &str, rows: Range<usize>) -> Result<Vec<f64>> {
        let read = || -> hdf5::Result<Values> {
            let dataset = self.file.dataset(path)?;
            self.holds(&dataset)?;
            let shape = dataset.shape();
            if shape.len() != 2 || shape[1] != 3 || shape[0] < rows.end {
                return Err(format!("it has the shape {shape:?}, expected {} rows of 3 at least", rows.end).into());
            }
            let part = s![rows.clone(), ..];
            Ok(match dataset.dtype()?.to_descriptor()? {
                TypeDescriptor::Float(hdf5::types::FloatSize::U8) => {
                    Values::F64(dataset.read_slice_2d::<f64, _>(part)?.iter().copied().collect())
                }
                _ => Values::F32(dataset.read_slice_2d::<f32, _>(part)?.iter().copied().collect()),
            })
        };
        let values = read().map_err(|e| self.fault(path, &e.to_string()))?;
        self.fit(path, rows.clone(), &values)?;
        match values {
            Values::F32(v) => Ok(v.into_iter().map(f64::from).collect()),
            Values::F64(v) => Ok(v),
            _ => Ok(Vec::new()),
        }
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

    /// Reads all datasets of a group and of those in it, `deep` groups at most below each other: damaged links may
    /// lead back.
    fn survey(&self, group: &str, deep: usize) -> Result<()> {
        if !self.has(group) {
            return Ok(());
        }
        for name in self.names(group)? {
            let path = format!("{group}/{name}");
            match self.file.group(&path) {
                Ok(_) if deep > 0 => self.survey(&path, deep - 1)?,
                Ok(_) => return Err(self.fault(&path, "it is damaged: a group where there is none")),
                Err(_) => {
                    // A checksum is read with it where there is one.
                    let _ = self.attribute(&path, SUM);
                    drop(self.read(&path)?);
                }
            }
        }
        Ok(())
    }

    fn fault(&self, path: &str, what: &str) -> Error {
        Error::Input(format!("{}: cannot read dataset {path}: {what}", self.path.display()))
    }
}

/// In a process of its own, as libhdf5 may crash: reads all that a later run may take up from a result file, or only
/// what says what it is, with no more memory than ten times the file and 64 MB. Errors are those of reading;
/// `Error::Memory` where more was asked for.
pub fn survey(path: &Path, head: bool) -> Result<()> {
    let size = std::fs::metadata(path).map_or(0, |m| m.len());
    memory::confine(size.saturating_mul(10).saturating_add(ROOM));
    // Of a call before this one.
    let before = memory::refused();
    let result = read_all(path, head);
    match memory::refused() && !before {
        true => Err(Error::Memory(format!("{}: more than ten times its size and 64 MB", path.display()))),
        false => result,
    }
}

fn read_all(path: &Path, head: bool) -> Result<()> {
    let reader = Reader::open(path)?;
    if head {
        super::overwrite_policy::is_result(path)?;
        return Ok(());
    }
    for group in ["reduced", "modes", "checksums"] {
        reader.survey(group, 3)?;
    }
    for dataset in ["/VTKHDF/Points", "/VTKHDF/PointData/body"] {
        if reader.has(dataset) {
            reader.read(dataset)?;
        }
    }
    let shapes = "/VTKHDF/PointData/shape";
    if !reader.has(shapes) {
        return Ok(());
    }
    let dataset = reader.file.dataset(shapes).map_err(|e| reader.fault(shapes, &e.to_string()))?;
    reader.holds(&dataset).map_err(|e| reader.fault(shapes, &e.to_string()))?;
    let rows = dataset.shape().first().copied().unwrap_or(0);
    // Some rows at a time are in memory.
    for first in (0..rows).step_by(1 << 20) {
        let some = dataset.read_slice_2d::<f32, _>(s![first..rows.min(first + (1 << 20)), ..]);
        some.map_err(|e| reader.fault(shapes, &e.to_string()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As on a file system where HDF5's lock fails.
    #[test]
    fn files_are_read_without_locks() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.h5");
        hdf5::File::create(&path).and_then(|f| f.close()).expect("a file");
        let other = std::fs::File::open(&path).expect("open");
        rustix::fs::flock(&other, rustix::fs::FlockOperation::LockExclusive).expect("a lock");
        assert!(hdf5::File::open(&path).is_err(), "with a lock of its own HDF5 does not open the file");
        Reader::open(&path).map(drop).expect("without it does");
    }
}
