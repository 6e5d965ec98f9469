//! Distributed real sparse matrix in compressed rows: what assembly makes and the solvers take.

/// One rank's rows of a square real matrix. Rows are distributed in contiguous ranges.
#[derive(Debug, Clone, Default)]
pub struct DistCsr {
    /// First row of each rank, `[size + 1]`; the last entry is the order of the matrix.
    pub ranges: Vec<u64>,
    /// Start of each local row in `cols`, `[n_local + 1]`.
    pub indptr: Vec<usize>,
    /// Global column of each entry, ascending in a row.
    pub cols: Vec<u64>,
    /// Value of each entry.
    pub values: Vec<f64>,
}
