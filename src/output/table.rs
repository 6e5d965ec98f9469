//! A table: one dataset outside `/VTKHDF`, held on rank 0 until the file is finished.

use super::checksums::digest;
use super::dimensions::labels;
use super::provenance::hexadecimal;
use super::values::{unicode, Layout, Values};
use hdf5::types::VarLenUnicode;
use hdf5::{File, Location};

/// Attribute with the SHA-256 of a dataset.
pub(super) const SUM: &str = "sha256";
/// Attribute with the names of the dimensions of a dataset, as HDF5's dimension scales have it.
const LABELS: &str = "DIMENSION_LABELS";
/// Tables larger than this are compressed.
const COMPRESS_FROM: usize = 1 << 16;

/// One dataset with its unit and meaning.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub(super) path: String,
    pub(super) units: String,
    pub(super) description: String,
    pub(super) shape: Vec<usize>,
    pub(super) values: Values,
    /// Extendible first dimension, by chunks of so many rows (0: as the size of a row asks for).
    pub(super) extendible: Option<usize>,
    pub(super) summed: bool,
}

impl Table {
    /// The dataset at `path` ("/group/…/name") with `values` of `shape`, row-major; an empty shape is a scalar.
    /// `units` is an SI unit, "1" for numbers without one, "-" for what is not a quantity (labels, text).
    pub fn new(path: &str, units: &str, description: &str, shape: &[usize], values: impl Into<Values>) -> Self {
        Self {
            path: path.to_owned(),
            units: units.to_owned(),
            description: description.to_owned(),
            shape: shape.to_vec(),
            values: values.into(),
            extendible: None,
            summed: false,
        }
    }

    /// The same for one value.
    pub fn scalar(path: &str, units: &str, description: &str, value: impl Into<Values>) -> Self {
        Self::new(path, units, description, &[], value)
    }

    /// The same for a list of values, of whatever length.
    pub fn list(path: &str, units: &str, description: &str, values: impl Into<Values>) -> Self {
        let values = values.into();
        Self::new(path, units, description, &[values.len()], values)
    }

    /// Stores the table chunked and compressed whatever its size, with a first dimension that can grow later.
    pub fn extendible(self) -> Self {
        self.in_chunks(0)
    }

    /// The same in chunks of `rows` rows.
    pub(crate) fn in_chunks(mut self, rows: usize) -> Self {
        self.extendible = Some(rows);
        self
    }

    /// Stores the SHA-256 of the table beside it, for what later runs take up.
    pub fn summed(mut self) -> Self {
        self.summed = true;
        self
    }

    /// Bytes on disk, with HDF5's own share.
    pub(super) fn bytes(&self) -> u64 {
        (self.values.bytes() + 2048) as u64
    }

    /// Fault in the table, if anything.
    pub(super) fn fault(&self) -> Option<String> {
        let path = &self.path;
        let expected: usize = self.shape.iter().product();
        if !path.starts_with('/') || path.ends_with('/') || path.contains("//") {
            Some(format!("table path {path:?} is not of the form /group/name"))
        } else if expected != self.values.len() {
            Some(format!("table {path} of shape {:?} has {} values", self.shape, self.values.len()))
        } else if self.units.is_empty() || self.description.is_empty() {
            Some(format!("table {path} lacks its unit or its description"))
        } else if self.extendible.is_some() && self.summed {
            Some(format!("table {path} can grow and would not fit its checksum"))
        } else if self.extendible.is_some() && self.shape.is_empty() {
            Some(format!("table {path} is a scalar and cannot grow"))
        } else {
            None
        }
    }

    /// Adds the table to an open file.
    pub(super) fn write(&self, file: &File) -> hdf5::Result<()> {
        // What later runs take up are matrices whose digits are noise to a compressor: a fifth less on disk for most
        // of the time of writing.
        let large = !self.summed && self.values.bytes() >= COMPRESS_FROM && !matches!(self.values, Values::Text(_));
        let layout = match self.extendible {
            Some(rows) => Layout::Compressed(rows),
            None if large && !self.shape.is_empty() => Layout::Compressed(0),
            None => Layout::Whole,
        };
        let (group, name) = parent(file, &self.path)?;
        let dataset = self.values.create(&group, &name, &self.shape, layout)?;
        describe(&dataset, &self.units, &self.description)?;
        let labels = labels(&self.path, self.shape.len());
        if !labels.is_empty() {
            let labels: Vec<VarLenUnicode> = labels.into_iter().map(unicode).collect::<hdf5::Result<_>>()?;
            let attribute = dataset.new_attr::<VarLenUnicode>().shape(labels.len()).create(LABELS)?;
            attribute.write_raw(&labels)?;
        }
        if self.summed {
            let sum = hexadecimal(&digest(&self.path, &self.shape, &self.values));
            dataset.new_attr::<hdf5::types::VarLenUnicode>().create(SUM)?.write_scalar(&unicode(&sum)?)?;
        }
        self.values.write(&dataset)
    }
}

/// The group of `path`, made if need be, and the last part of the path.
pub(super) fn parent(file: &File, path: &str) -> hdf5::Result<(hdf5::Group, String)> {
    let mut parts: Vec<&str> = path.split('/').filter(|p| !p.is_empty()).collect();
    let name = parts.pop().unwrap_or_default().to_owned();
    let mut group = file.as_group()?;
    for part in parts {
        group = if group.link_exists(part) { group.group(part)? } else { group.create_group(part)? };
    }
    Ok((group, name))
}

/// Sets the attributes that every dataset has.
pub(super) fn describe(dataset: &Location, units: &str, description: &str) -> hdf5::Result<()> {
    for (name, text) in [("units", units), ("description", description)] {
        dataset.new_attr::<hdf5::types::VarLenUnicode>().create(name)?.write_scalar(&unicode(text)?)?;
    }
    Ok(())
}
