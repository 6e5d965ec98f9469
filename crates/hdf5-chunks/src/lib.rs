//! Chunks of HDF5 datasets as they lie in a file, compressed: copied without being decoded. The one function of HDF5 that the crate `hdf5` lacks,
//! made safe. Needs HDF5 1.10.5.

#![warn(missing_docs, clippy::undocumented_unsafe_blocks)]

use hdf5::{Dataset, Result};
use hdf5_metno_sys::{h5d::H5Dwrite_chunk, h5p::H5P_DEFAULT};
use std::fs::File;
use std::os::unix::fs::FileExt;

/// Whether chunks of `from` are chunks of `to` as they are: the same type of values, shape of a chunk and filters.
pub fn alike(from: &Dataset, to: &Dataset) -> bool {
    let types = from.dtype().ok().zip(to.dtype().ok());
    let chunk = from.chunk();
    chunk.is_some() && chunk == to.chunk() && from.filters() == to.filters() && types.is_some_and(|(a, b)| a == b)
}

/// Copies all chunks of `from`, which lies in the open `file` (without a user block), into `to`, its first row becoming row `row` there. The shape
/// of `to` holds them already; [`alike`] holds, and `row` is the first of a chunk. An error of `hdf5` or of reading, as text.
pub fn copy(file: &File, from: &Dataset, to: &Dataset, row: usize) -> Result<()> {
    let mut bytes = Vec::new();
    for index in 0..from.num_chunks().unwrap_or(0) {
        let chunk = from.chunk_info(index).ok_or("a chunk cannot be found")?;
        bytes.resize(chunk.size as usize, 0);
        file.read_exact_at(&mut bytes, chunk.addr).map_err(|e| hdf5::Error::from(format!("reading a chunk: {e}")))?;
        let mut offset = chunk.offset;
        if let Some(first) = offset.first_mut() {
            *first += row as u64;
        }
        write(to, &offset, chunk.filter_mask, &bytes)?;
    }
    Ok(())
}

/// Writes the `bytes` of the chunk that begins at `offset` (one index a dimension), to which the filters whose bit in `mask` is set were not applied.
fn write(to: &Dataset, offset: &[u64], mask: u32, bytes: &[u8]) -> Result<()> {
    let (chunk, shape) = (to.chunk().ok_or("the dataset has no chunks")?, to.shape());
    let fits = |(i, &at): (usize, &u64)| at < shape[i] as u64 && at % chunk[i] as u64 == 0;
    if offset.len() != shape.len() || !offset.iter().enumerate().all(fits) {
        return Err(format!("no chunk of {chunk:?} in {shape:?} begins at {offset:?}").into());
    }
    let code = hdf5::sync::sync(|| {
        // SAFETY: an open dataset; as many offsets as it has dimensions, each the begin of a chunk within its shape; `bytes` are read alone. The
        // library is not entered elsewhere meanwhile.
        unsafe { H5Dwrite_chunk(to.id(), H5P_DEFAULT, mask, offset.as_ptr(), bytes.len(), bytes.as_ptr().cast()) }
    });
    match code < 0 {
        true => Err(hdf5::Error::query()?),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dataset(file: &hdf5::File, rows: usize, chunk: usize, level: u8) -> Dataset {
        let shape = hdf5::SimpleExtents::from_vec(vec![hdf5::Extent::resizable(rows), hdf5::Extent::fixed(3)]);
        file.new_dataset::<f64>().chunk(&[chunk, 3]).shuffle().deflate(level).shape(shape).create("x").expect("x")
    }

    #[test]
    fn chunks_are_copied_as_they_are_the_last_one_part_full() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let numbers = |from: usize, rows: usize| (3 * from..3 * (from + rows)).map(|k| (k as f64).sin()).collect::<Vec<_>>();
        let from = hdf5::File::create(at("from.h5")).expect("a file");
        let source = dataset(&from, 10, 4, 4);
        source.write_raw(&numbers(8, 10)).expect("write");
        from.flush().expect("flush");
        let to = hdf5::File::create(at("to.h5")).expect("a file");
        let target = dataset(&to, 18, 4, 4);
        target.write_slice(&ndarray_of(&numbers(0, 8)), ndarray::s![0..8, ..]).expect("write");
        assert!(alike(&source, &target));
        let file = File::open(at("from.h5")).expect("open");
        assert!(copy(&file, &source, &target, 6).is_err(), "no chunk begins at row 6");
        assert!(copy(&file, &source, &target, 16).is_err(), "there are no such rows");
        copy(&file, &source, &target, 8).expect("copied");
        // What comes next goes into the chunk that is part full.
        target.resize((21, 3)).expect("longer");
        target.write_slice(&ndarray_of(&numbers(18, 3)), ndarray::s![18..21, ..]).expect("write");
        assert_eq!(target.read_raw::<f64>().expect("read"), numbers(0, 21));
        let other = hdf5::File::create(at("other.h5")).expect("a file");
        assert!(!alike(&source, &dataset(&other, 10, 5, 4)), "other chunks");
        let last = hdf5::File::create(at("last.h5")).expect("a file");
        assert!(!alike(&source, &dataset(&last, 10, 4, 5)), "another filter");
    }

    fn ndarray_of(values: &[f64]) -> ndarray::Array2<f64> {
        ndarray::Array2::from_shape_vec((values.len() / 3, 3), values.to_vec()).expect("rows of three")
    }
}
