//! Selected entries of the inverse, by the elimination tree alone.

use super::{Factor, Symmetry};
use crate::{Error, Result};
use faer::Mat;
use mumps_sys::MUMPS_INT;
use std::ptr;

/// Columns of the inverse treated together. Each block walks up the elimination tree once, with messages between the
/// ranks: of 900 rows, MUMPS's own 32 takes three to four times as long as 512 on two ranks.
const INVERSE_BLOCK: MUMPS_INT = 512;

impl Factor<'_> {
    /// Collective: the entries of the inverse at `rows` × `rows` (global numbers, the same on every rank, none
    /// twice), of a symmetric matrix, `[rows, rows]` on rank 0 and empty elsewhere. Works on the elimination tree
    /// alone, without one full solve per row (MUMPS's selected entries of the inverse).
    pub fn inverse_block(&mut self, rows: &[u64]) -> Result<Mat<f64>> {
        let world = self.world;
        let n = self.ranges[world.size];
        let bad = rows.iter().find(|&&r| r >= n);
        world.agree(bad.map_or(Ok(()), |r| Err(Error::Defect(format!("inverse block: row {r} of {n}")))))?;
        if self.kind == Symmetry::General {
            return Err(Error::Defect("inverse block of a matrix that is not symmetric".into()));
        }
        let k = rows.len();
        let mut block = if world.is_root() { Mat::zeros(k, k) } else { Mat::new() };
        // Columns in ascending row number, as MUMPS wants the row indices; one half, the other is its mirror image.
        let mut sorted: Vec<usize> = (0..k).collect();
        sorted.sort_unstable_by_key(|&i| rows[i]);
        // The count of entries asked for at once is a 32-bit number.
        const ENTRIES: usize = 1 << 27;
        let mut begin = 0;
        while begin < k {
            let mut end = begin;
            let mut entries = 0;
            while end < k && (end == begin || entries + (k - end) <= ENTRIES) {
                entries += k - end;
                end += 1;
            }
            let values = self.selected(rows, &sorted, begin..end)?;
            if world.is_root() {
                let mut values = values.into_iter();
                for j in begin..end {
                    for i in j..k {
                        let v = values.next().unwrap_or(f64::NAN);
                        block[(sorted[i], sorted[j])] = v;
                        block[(sorted[j], sorted[i])] = v;
                    }
                }
            }
            begin = end;
        }
        Ok(block)
    }

    /// Entries `sorted[j..]` × `sorted[j]` of the inverse for the columns `j` of `columns`, one after the other.
    fn selected(&mut self, rows: &[u64], sorted: &[usize], columns: std::ops::Range<usize>) -> Result<Vec<f64>> {
        let order = self.ranges[self.world.size] as usize;
        let mut starts: Vec<MUMPS_INT> = Vec::new();
        let mut indices: Vec<MUMPS_INT> = Vec::new();
        if self.world.is_root() {
            let mut column_at = vec![usize::MAX; order];
            for j in columns {
                column_at[rows[sorted[j]] as usize] = j;
            }
            starts.push(1);
            for j in column_at {
                if j != usize::MAX {
                    indices.extend(sorted[j..].iter().map(|&i| rows[i] as MUMPS_INT + 1));
                }
                starts.push(indices.len() as MUMPS_INT + 1);
            }
        }
        let mut values = vec![0.0; indices.len()];
        self.id.nrhs = order as MUMPS_INT;
        self.id.nz_rhs = indices.len() as MUMPS_INT;
        if self.world.is_root() {
            self.id.irhs_ptr = starts.as_mut_ptr();
            self.id.irhs_sparse = indices.as_mut_ptr();
            self.id.rhs_sparse = values.as_mut_ptr();
        }
        self.control(20, 1);
        self.control(21, 0);
        self.control(30, 1);
        let usual = self.id.icntl[26];
        self.control(27, INVERSE_BLOCK);
        self.call(3);
        self.control(27, usual);
        self.control(30, 0);
        self.control(20, 0);
        self.id.nz_rhs = 0;
        self.id.irhs_ptr = ptr::null_mut();
        self.id.irhs_sparse = ptr::null_mut();
        self.id.rhs_sparse = ptr::null_mut();
        self.result("selected entries of the inverse")?;
        Ok(values)
    }
}
