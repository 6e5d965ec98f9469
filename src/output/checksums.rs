//! SHA-256 of what later runs take up: of a whole dataset in its attribute `sha256`, of the rows that each rank wrote
//! in the group `/checksums`.
//!
//! The sum goes over the path of the dataset, its shape (or the first row and the number of rows) and the values in
//! little-endian bytes, texts with a zero byte behind each: values that were changed, moved or taken from elsewhere
//! do not fit it. HDF5's own checksum is of no use here: it leaves out scalars, contiguous datasets and metadata.

use super::table::Table;
use super::values::Values;
use super::vtkhdf::Slab;
use crate::parallel::World;
use bytemuck::cast_slice;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

/// Bytes of a sum.
const SIZE: usize = 32;

/// The sum of `values` of the dataset `path` with this shape, or of rows given by the first of them and their number.
pub(super) fn digest(path: &str, place: &[usize], values: &Values) -> [u8; SIZE] {
    let mut hash = Sha256::new();
    hash.update(path.trim_start_matches('/'));
    hash.update([0]);
    place.iter().for_each(|&n| hash.update((n as u64).to_le_bytes()));
    match values {
        // Numbers are little-endian on all machines that this program is built for.
        Values::F64(v) => hash.update(cast_slice::<f64, u8>(v)),
        Values::F32(v) => hash.update(cast_slice::<f32, u8>(v)),
        Values::I8(v) => hash.update(cast_slice::<i8, u8>(v)),
        Values::U8(v) => hash.update(v),
        Values::I32(v) => hash.update(cast_slice::<i32, u8>(v)),
        Values::I64(v) => hash.update(cast_slice::<i64, u8>(v)),
        Values::Complex(v) => hash.update(cast_slice::<num_complex::Complex64, u8>(v)),
        Values::Text(v) => v.iter().for_each(|t| {
            hash.update(t);
            hash.update([0]);
        }),
    }
    hash.finalize().into()
}

/// Sums of the rows that this rank has written.
#[derive(Default)]
pub(super) struct RowSums {
    names: Vec<String>,
    dataset: Vec<i32>,
    first: Vec<i64>,
    rows: Vec<i64>,
    sums: Vec<u8>,
}

impl RowSums {
    /// Takes the rows of a slab, `columns` values in each.
    pub(super) fn add(&mut self, slab: &Slab, columns: usize) {
        let rows = slab.values.len() / columns.max(1);
        let name = self.names.iter().position(|n| n == &slab.path).unwrap_or_else(|| {
            self.names.push(slab.path.clone());
            self.names.len() - 1
        });
        self.dataset.push(name as i32);
        self.first.push(slab.start as i64);
        self.rows.push(rows as i64);
        self.sums.extend(digest(&slab.path, &[slab.start, rows], &slab.values));
    }

    /// Collective: those of all ranks as tables, on rank 0. All ranks write rows of the same datasets in the same
    /// order.
    pub(super) fn tables(self, world: &World) -> Vec<Table> {
        let (dataset, first) = (world.gather(&self.dataset), world.gather(&self.first));
        let (rows, sums) = (world.gather(&self.rows), world.gather(&self.sums));
        if !world.is_root() {
            return Vec::new();
        }
        let list = |name: &str, text: &str, values: Values| {
            Table::list(&format!("/checksums/{name}"), "1", text, values).summed()
        };
        let count = rows.len();
        vec![
            Table::list("/checksums/names", "-", "The datasets that are checked.", self.names).summed(),
            list("dataset", "Index in names of the dataset of each piece.", dataset.into()),
            list("first_row", "First row of each piece.", first.into()),
            list("rows", "Rows of each piece.", rows.into()),
            Table::new("/checksums/sha256", "-", "SHA-256 of each piece.", &[count, SIZE], sums).summed(),
        ]
    }
}

/// The sums of a file, by dataset: first row, number of rows and sum of each piece, in the order of the rows.
pub(super) struct Pieces(BTreeMap<String, Vec<(usize, usize, Vec<u8>)>>);

impl Pieces {
    /// From the datasets of the group `/checksums` in the order in which they are written; `None` where they
    /// contradict each other.
    pub(super) fn new(tables: [Values; 5]) -> Option<Self> {
        let [Values::Text(names), Values::I32(dataset), Values::I64(first), Values::I64(rows), Values::U8(sums)] =
            tables
        else {
            return None;
        };
        if [first.len(), rows.len(), sums.len() / SIZE] != [dataset.len(); 3] {
            return None;
        }
        let mut pieces: BTreeMap<String, Vec<_>> = BTreeMap::new();
        for (k, &d) in dataset.iter().enumerate() {
            let name = names.get(usize::try_from(d).ok()?)?;
            let (first, rows) = (usize::try_from(first[k]).ok()?, usize::try_from(rows[k]).ok()?);
            if rows > 0 {
                pieces.entry(name.clone()).or_default().push((first, rows, sums[SIZE * k..SIZE * (k + 1)].to_vec()));
            }
        }
        pieces.values_mut().for_each(|p| p.sort());
        Some(Self(pieces))
    }

    /// Returns whether the `rows` rows of a dataset from `start` on, which `part` gives by index of the first and
    /// number, are whole pieces with the right sums.
    pub(super) fn fit(&self, path: &str, start: usize, rows: usize, part: impl Fn(usize, usize) -> Values) -> bool {
        let mut next = start;
        for (first, count, sum) in self.0.get(path).into_iter().flatten() {
            if first + count <= start || *first >= start + rows {
                continue;
            }
            if *first != next || first + count > start + rows {
                return false;
            }
            if digest(path, &[*first, *count], &part(first - start, *count))[..] != sum[..] {
                return false;
            }
            next = first + count;
        }
        next == start + rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_shape_and_values_count() {
        let values = Values::F64(vec![1.0, -2.0]);
        let sum = digest("/a/b", &[2], &values);
        assert_eq!(sum, digest("a/b", &[2], &values), "the leading slash is no part of the name");
        for other in [
            digest("/a/c", &[2], &values),
            digest("/a/b", &[1, 2], &values),
            digest("/a/b", &[2], &Values::F64(vec![1.0, 2.0])),
            digest("/a/b", &[2], &Values::F64(vec![-2.0, 1.0])),
        ] {
            assert_ne!(sum, other);
        }
        let text = |t: &[&str]| digest("/t", &[2], &Values::Text(t.iter().map(|t| t.to_string()).collect()));
        assert_ne!(text(&["ab", "c"]), text(&["a", "bc"]));
        // By another program: hashlib.sha256(b"a/b\0" + (2).to_bytes(8, "little") + struct.pack("<2d", 1, -2)).
        assert_eq!(
            super::super::provenance::hexadecimal(&sum),
            "16a1fa0ff22f1b0d463101f04f11c095d66eea4c134ede9e43d894b244e94219"
        );
    }

    #[test]
    fn rows_are_whole_pieces_with_their_sums() {
        let rows: Vec<i64> = (0..10).collect();
        // Row r holds r.
        let part = |from: usize, first: usize, count: usize| {
            Values::I64((from + first..from + first + count).map(|r| r as i64).collect())
        };
        let mut written = RowSums::default();
        for (start, end) in [(0, 4), (4, 7), (7, 10)] {
            let values = Values::I64(rows[start..end].to_vec());
            written.add(&Slab { path: "/x".into(), start, values }, 1);
        }
        let RowSums { names, dataset, first, rows: counts, sums } = written;
        let pieces =
            Pieces::new([names.into(), dataset.into(), first.into(), counts.into(), sums.into()]).expect("pieces");
        for (start, count, fit) in
            [(0, 10, true), (0, 4, true), (4, 6, true), (0, 5, false), (1, 3, false), (0, 11, false), (7, 3, true)]
        {
            assert_eq!(pieces.fit("/x", start, count, |f, c| part(start, f, c)), fit, "{start} {count}");
        }
        assert!(!pieces.fit("/x", 0, 4, |_, c| part(1, 0, c)), "other values");
        assert!(!pieces.fit("/y", 0, 4, |f, c| part(0, f, c)), "another dataset");
    }
}
