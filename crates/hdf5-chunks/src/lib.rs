//! Chunks of HDF5 datasets as they lie in a file, compressed: copied without being decoded; and whether files are open.
//! The two functions of HDF5 that the crate `hdf5` lacks, made safe. Needs HDF5 1.10.5.

#![warn(missing_docs, clippy::undocumented_unsafe_blocks)]

use hdf5::filters::Filter;
use hdf5::{Dataset, Datatype, Result};
use hdf5_metno_sys::h5d::H5Dwrite_chunk;
use hdf5_metno_sys::h5f::{H5Fget_obj_count, H5F_OBJ_ALL, H5F_OBJ_FILE};
use hdf5_metno_sys::h5p::H5P_DEFAULT;
use std::fs::File;
use std::os::unix::fs::FileExt;

/// True if this process has open HDF5 files: those that could not be closed stay open.
pub fn has_open_files() -> bool {
    // SAFETY: a query of the library's own table, which takes no pointers. The library is not entered elsewhere
    // meanwhile.
    hdf5::sync::sync(|| unsafe { H5Fget_obj_count(H5F_OBJ_ALL as i64, H5F_OBJ_FILE) }) > 0
}

/// A dataset with chunks that others are copied into.
pub struct Target {
    dataset: Dataset,
    kind: Datatype,
    chunk: Vec<usize>,
    filters: Vec<Filter>,
}

impl Target {
    /// Takes a dataset; an error if it has no chunks.
    pub fn new(dataset: Dataset) -> Result<Self> {
        let (kind, chunk) = (dataset.dtype()?, dataset.chunk().ok_or("the dataset has no chunks")?);
        let filters = dataset.filters();
        Ok(Self { dataset, kind, chunk, filters })
    }

    /// The dataset.
    pub fn dataset(&self) -> &Dataset {
        &self.dataset
    }

    /// Returns whether chunks of `from` are chunks of this one as they are, its first row becoming row `row` here: the
    /// same type of values, shape of a chunk and filters, and `row` the first of a chunk.
    pub fn takes(&self, from: &Dataset, row: usize) -> bool {
        let Ok(list) = from.dcpl() else { return false };
        row.is_multiple_of(self.chunk[0])
            && list.chunk().as_ref() == Some(&self.chunk)
            && list.filters() == self.filters
            && from.dtype().is_ok_and(|kind| kind == self.kind)
    }

    /// Copies all chunks of `from`, which lies in the open `file` (without a user block), its first row becoming row
    /// `row`. The shape of the dataset holds them already, and [`Target::takes`] holds. An error of HDF5 or of
    /// reading, as text.
    pub fn copy(&self, file: &File, from: &Dataset, row: usize) -> Result<()> {
        let (mut bytes, shape) = (Vec::new(), self.dataset.shape());
        for index in 0..from.num_chunks().unwrap_or(0) {
            let chunk = from.chunk_info(index).ok_or("a chunk cannot be found")?;
            bytes.resize(chunk.size as usize, 0);
            file.read_exact_at(&mut bytes, chunk.addr)
                .map_err(|e| hdf5::Error::from(format!("reading a chunk: {e}")))?;
            let mut offset = chunk.offset;
            if let Some(first) = offset.first_mut() {
                *first += row as u64;
            }
            self.write(&shape, &offset, chunk.filter_mask, &bytes)?;
        }
        Ok(())
    }

    /// Writes the `bytes` of the chunk that begins at `offset` (one index a dimension) in the dataset of this shape,
    /// to which the filters whose bit in `mask` is set were not applied.
    fn write(&self, shape: &[usize], offset: &[u64], mask: u32, bytes: &[u8]) -> Result<()> {
        let fits = |(i, &at): (usize, &u64)| at < shape[i] as u64 && at.is_multiple_of(self.chunk[i] as u64);
        if offset.len() != shape.len() || !offset.iter().enumerate().all(fits) {
            return Err(format!("no chunk of {:?} in {shape:?} begins at {offset:?}", self.chunk).into());
        }
        let code = hdf5::sync::sync(|| {
            // SAFETY: an open dataset; as many offsets as it has dimensions, each the begin of a chunk within its
            // shape; `bytes` are read alone. The library is not entered elsewhere meanwhile.
            unsafe {
                H5Dwrite_chunk(
                    self.dataset.id(),
                    H5P_DEFAULT,
                    mask,
                    offset.as_ptr(),
                    bytes.len(),
                    bytes.as_ptr().cast(),
                )
            }
        });
        match code < 0 {
            true => Err(hdf5::Error::query()?),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dataset(file: &hdf5::File, rows: usize, chunk: usize, level: u8) -> Dataset {
        let shape = hdf5::SimpleExtents::from_vec(vec![hdf5::Extent::resizable(rows), hdf5::Extent::fixed(3)]);
        file.new_dataset::<f64>().chunk([chunk, 3]).shuffle().deflate(level).shape(shape).create("x").expect("x")
    }

    #[test]
    fn open_files_are_counted() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = hdf5::File::create(folder.path().join("open.h5")).expect("a file");
        assert!(has_open_files());
        file.close().expect("closed");
    }

    #[test]
    fn chunks_are_copied_as_they_are_the_last_one_part_full() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let numbers =
            |from: usize, rows: usize| (3 * from..3 * (from + rows)).map(|k| (k as f64).sin()).collect::<Vec<_>>();
        let from = hdf5::File::create(at("from.h5")).expect("a file");
        let source = dataset(&from, 10, 4, 4);
        source.write_raw(&numbers(8, 10)).expect("write");
        from.flush().expect("flush");
        let to = hdf5::File::create(at("to.h5")).expect("a file");
        let target = Target::new(dataset(&to, 18, 4, 4)).expect("chunks");
        target.dataset().write_slice(&ndarray_of(&numbers(0, 8)), ndarray::s![0..8, ..]).expect("write");
        assert!(target.takes(&source, 8) && !target.takes(&source, 6), "no chunk begins at row 6");
        let file = File::open(at("from.h5")).expect("open");
        assert!(target.copy(&file, &source, 6).is_err(), "no chunk begins at row 6");
        assert!(target.copy(&file, &source, 16).is_err(), "there are no such rows");
        target.copy(&file, &source, 8).expect("copied");
        // What comes next goes into the chunk that is part full.
        target.dataset().resize((21, 3)).expect("longer");
        target.dataset().write_slice(&ndarray_of(&numbers(18, 3)), ndarray::s![18..21, ..]).expect("write");
        assert_eq!(target.dataset().read_raw::<f64>().expect("read"), numbers(0, 21));
        let other = hdf5::File::create(at("other.h5")).expect("a file");
        let other = Target::new(dataset(&other, 10, 5, 4)).expect("chunks");
        assert!(!other.takes(&source, 0), "other chunks");
        let last = hdf5::File::create(at("last.h5")).expect("a file");
        let last = Target::new(dataset(&last, 10, 4, 5)).expect("chunks");
        assert!(!last.takes(&source, 0), "another filter");
    }

    fn ndarray_of(values: &[f64]) -> ndarray::Array2<f64> {
        ndarray::Array2::from_shape_vec((values.len() / 3, 3), values.to_vec()).expect("rows of three")
    }
}
