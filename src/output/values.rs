//! Arrays of the types a result file holds, and how they go into HDF5 datasets.

use hdf5::types::VarLenUnicode;
use hdf5::{Dataset, Group};
use ndarray::{s, ArrayView1, ArrayView2, ArrayView3};
use num_complex::Complex64;

/// Values of one dataset in row-major order.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Double precision.
    F64(Vec<f64>),
    /// Single precision: sequences of fields, which are for looking at.
    F32(Vec<f32>),
    /// Labels.
    I8(Vec<i8>),
    /// Cell types.
    U8(Vec<u8>),
    /// Ranks, counts.
    I32(Vec<i32>),
    /// Node numbers, offsets.
    I64(Vec<i64>),
    /// Complex numbers, stored as the compound {r, i} that h5py reads as complex.
    Complex(Vec<Complex64>),
    /// UTF-8 text.
    Text(Vec<String>),
}

macro_rules! from_vec {
    ($($t:ty => $v:ident),*) => {$(
        impl From<Vec<$t>> for Values {
            fn from(values: Vec<$t>) -> Self { Values::$v(values) }
        }
        impl From<$t> for Values {
            fn from(value: $t) -> Self { Values::$v(vec![value]) }
        }
    )*};
}
from_vec!(f64 => F64, f32 => F32, i8 => I8, u8 => U8, i32 => I32, i64 => I64, Complex64 => Complex, String => Text);

impl From<&[f64]> for Values {
    fn from(values: &[f64]) -> Self {
        Values::F64(values.to_vec())
    }
}

impl From<&str> for Values {
    fn from(value: &str) -> Self {
        Values::Text(vec![value.to_owned()])
    }
}

/// How the datasets of fields are laid out: contiguous and allocated at once, so that ranks only write into them.
/// Tables are written whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Layout {
    Reserved,
    Whole,
    /// Chunked, so many rows each (0: as their size asks for), and compressed; the first dimension can grow.
    Compressed(usize),
}

/// Size of a compressed chunk, about, at the most.
pub(super) const CHUNK_BYTES: usize = 1 << 18;
/// Smaller chunks cost more by their number than it costs to make larger ones of them.
pub(super) const CHUNK_LEAST: usize = 1 << 12;

impl Values {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Values::F64(v) => v.len(),
            Values::F32(v) => v.len(),
            Values::I8(v) => v.len(),
            Values::U8(v) => v.len(),
            Values::I32(v) => v.len(),
            Values::I64(v) => v.len(),
            Values::Complex(v) => v.len(),
            Values::Text(v) => v.len(),
        }
    }

    /// True without values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Some of the values.
    pub(super) fn slice(&self, range: std::ops::Range<usize>) -> Values {
        match self {
            Values::F64(v) => v[range].to_vec().into(),
            Values::F32(v) => v[range].to_vec().into(),
            Values::I8(v) => v[range].to_vec().into(),
            Values::U8(v) => v[range].to_vec().into(),
            Values::I32(v) => v[range].to_vec().into(),
            Values::I64(v) => v[range].to_vec().into(),
            Values::Complex(v) => v[range].to_vec().into(),
            Values::Text(v) => v[range].to_vec().into(),
        }
    }

    /// Bytes of one value; of text, those in the dataset itself.
    pub(super) fn item_bytes(&self) -> usize {
        match self {
            Values::I8(_) | Values::U8(_) => 1,
            Values::F32(_) | Values::I32(_) => 4,
            Values::F64(_) | Values::I64(_) => 8,
            Values::Complex(_) | Values::Text(_) => 16,
        }
    }

    /// Bytes on disk, about.
    pub(super) fn bytes(&self) -> usize {
        let text = if let Values::Text(v) = self { v.iter().map(String::len).sum() } else { 0 };
        text + self.item_bytes() * self.len()
    }

    /// Creates the dataset `name` of this type in `group`; an empty `shape` is a scalar.
    pub(super) fn create(&self, group: &Group, name: &str, shape: &[usize], layout: Layout) -> hdf5::Result<Dataset> {
        match self {
            Values::F64(_) => create::<f64>(group, name, shape, layout),
            Values::F32(_) => create::<f32>(group, name, shape, layout),
            Values::I8(_) => create::<i8>(group, name, shape, layout),
            Values::U8(_) => create::<u8>(group, name, shape, layout),
            Values::I32(_) => create::<i32>(group, name, shape, layout),
            Values::I64(_) => create::<i64>(group, name, shape, layout),
            Values::Complex(_) => create::<Complex64>(group, name, shape, layout),
            Values::Text(_) => create::<VarLenUnicode>(group, name, shape, layout),
        }
    }

    /// Writes the whole dataset.
    pub(super) fn write(&self, dataset: &Dataset) -> hdf5::Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        match self {
            Values::F64(v) => dataset.write_raw(v),
            Values::F32(v) => dataset.write_raw(v),
            Values::I8(v) => dataset.write_raw(v),
            Values::U8(v) => dataset.write_raw(v),
            Values::I32(v) => dataset.write_raw(v),
            Values::I64(v) => dataset.write_raw(v),
            Values::Complex(v) => dataset.write_raw(v),
            Values::Text(v) => {
                let text: hdf5::Result<Vec<VarLenUnicode>> = v.iter().map(|t| unicode(t)).collect();
                dataset.write_raw(&text?)
            }
        }
    }

    /// Writes the rows from `start` on of a dataset with up to three dimensions.
    pub(super) fn write_rows(&self, dataset: &Dataset, start: usize) -> hdf5::Result<()> {
        match self {
            Values::F64(v) => rows(dataset, start, v),
            Values::F32(v) => rows(dataset, start, v),
            Values::I8(v) => rows(dataset, start, v),
            Values::U8(v) => rows(dataset, start, v),
            Values::I32(v) => rows(dataset, start, v),
            Values::I64(v) => rows(dataset, start, v),
            Values::Complex(v) => rows(dataset, start, v),
            Values::Text(_) => Err("text cannot be written by rows".into()),
        }
    }
}

/// `text` as a string that HDF5 can hold, which has no NUL in it.
pub(super) fn unicode(text: &str) -> hdf5::Result<VarLenUnicode> {
    text.parse::<VarLenUnicode>().map_err(|e| format!("text {text:?} cannot be stored: {e}").into())
}

fn create<T: hdf5::H5Type>(group: &Group, name: &str, shape: &[usize], layout: Layout) -> hdf5::Result<Dataset> {
    use hdf5::plist::dataset_create::{AllocTime, FillTime};
    let builder = group.new_dataset::<T>();
    if shape.is_empty() {
        return builder.shape(()).create(name);
    }
    match layout {
        Layout::Reserved => {
            builder.no_chunk().alloc_time(Some(AllocTime::Early)).fill_time(FillTime::Never).shape(shape).create(name)
        }
        Layout::Whole => builder.shape(shape).create(name),
        Layout::Compressed(rows) => {
            let row = std::mem::size_of::<T>() * shape[1..].iter().product::<usize>();
            let mut chunk = shape.to_vec();
            chunk[0] = match rows {
                0 => (CHUNK_BYTES / row.max(1)).clamp(1, shape[0].max(1)),
                rows => rows,
            };
            chunk.iter_mut().for_each(|c| *c = (*c).max(1));
            let mut extents = hdf5::SimpleExtents::new(shape.iter().copied());
            extents = hdf5::SimpleExtents::from_vec(
                std::iter::once(hdf5::Extent::resizable(shape[0])).chain(extents.iter().skip(1).copied()).collect(),
            );
            let builder = builder.chunk(&chunk[..]);
            // A library built without zlib stores the same data uncompressed.
            if hdf5::filters::deflate_available() {
                builder.shuffle().deflate(4).shape(extents).create(name)
            } else {
                builder.shape(extents).create(name)
            }
        }
    }
}

fn rows<T: hdf5::H5Type>(dataset: &Dataset, start: usize, values: &[T]) -> hdf5::Result<()> {
    if values.is_empty() {
        return Ok(());
    }
    let shape = dataset.shape();
    match shape[..] {
        [_] => dataset.write_slice(ArrayView1::from(values), s![start..start + values.len()]),
        [_, columns] => {
            let view = ArrayView2::from_shape((values.len() / columns.max(1), columns), values)
                .map_err(|e| hdf5::Error::from(e.to_string()))?;
            dataset.write_slice(view, s![start..start + view.nrows(), ..])
        }
        [_, a, b] => {
            let view = ArrayView3::from_shape((values.len() / (a * b).max(1), a, b), values)
                .map_err(|e| hdf5::Error::from(e.to_string()))?;
            dataset.write_slice(view, s![start..start + view.shape()[0], .., ..])
        }
        _ => Err(format!("rows of a dataset of shape {shape:?} cannot be written").into()),
    }
}
