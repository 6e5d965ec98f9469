//! Direct solver for real matrices: MUMPS in real arithmetic through its own C interface.
//!
//! PETSc's scalars are complex (SLEPc takes complex targets in no other build), and a complex factorisation of a real
//! matrix costs three to four times the time and twice the memory of a real one. MUMPS keeps its precisions in separate
//! libraries, so the real one is called beside PETSc. Numbers of controls and statistics are those of the
//! MUMPS 5.5 users' guide.

use super::csr::{norm2, DistCsr};
use super::ordering::nested_dissection;
use crate::parallel::World;
use crate::{Error, Result};
use faer::Mat;
use mpi::raw::AsRaw;
use mumps_sys::{dmumps_c, DMUMPS_STRUC_C, MUMPS_INT};
use std::ptr;

/// What is known of a matrix before it is factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Symmetric and positive definite: no pivoting; a matrix that is not so is an error.
    Positive,
    /// Symmetric: pivots are sought, and [`Factor::negative_pivots`] counts the negative eigenvalues.
    Indefinite,
    /// Neither; both triangles are used.
    General,
}

/// Elimination order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ordering {
    /// METIS nested dissection on blocks of rows with equal pattern. For [`Kind::General`] METIS sees the pattern as
    /// it is, which must be symmetric.
    Metis,
    /// SCOTCH inside MUMPS, where that was built with it.
    Scotch,
    /// PORD inside MUMPS.
    Pord,
}

/// How to factorise.
#[derive(Debug, Clone, Copy)]
pub struct FactorOptions {
    /// What is known of the matrix.
    pub kind: Kind,
    /// Elimination order.
    pub ordering: Ordering,
}

impl FactorOptions {
    /// The defaults for a matrix of this kind.
    pub fn new(kind: Kind) -> Self {
        Self { kind, ordering: Ordering::Metis }
    }
}

/// What MUMPS says of a factorisation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FactorStatistics {
    /// Entries in the factors (estimated by the analysis, then counted).
    pub factor_entries: u64,
    /// Floating-point operations of the elimination.
    pub flops: f64,
    /// Memory of the rank that needs most, MB (10⁶ byte): estimated by the analysis, then allocated.
    pub memory_max_mb: u64,
    /// Memory of all ranks together, MB.
    pub memory_sum_mb: u64,
}

/// A factorised matrix.
pub struct Factor<'w> {
    world: &'w World,
    /// Boxed: MUMPS keeps pointers into its own structure.
    id: Box<DMUMPS_STRUC_C>,
    ranges: Vec<u64>,
    kind: Kind,
    statistics: FactorStatistics,
}

/// Relaxation of the estimated workspace, percent, at the first attempt without and with pivoting, and at the last.
const WORKSPACE: [MUMPS_INT; 3] = [10, 30, 1000];

/// Columns of the inverse treated together. Each block walks up the elimination tree once, with messages between the ranks:
/// of 900 rows, blocks of 512 take a quarter of the time of MUMPS's own 32 on two ranks.
const INVERSE_BLOCK: MUMPS_INT = 512;

/// A pivot below this fraction of the largest entry counts as zero. Stiffness matrices of graded meshes reach 1e-9,
/// a free rigid-body motion leaves some 1e-16.
const NULL_PIVOT: f64 = 1e-13;

/// INFOG(1) after a zero pivot.
const SINGULAR: MUMPS_INT = -10;

/// Condition numbers above this one are those of singular matrices with rounding errors in them.
const CONDITION_LIMIT: f64 = 1e13;

impl<'w> Factor<'w> {
    /// Collective: factorises `matrix`. `name` stands for it in messages.
    pub fn new(world: &'w World, matrix: &DistCsr, options: FactorOptions, name: &str) -> Result<Self> {
        let mut factor = Self::analysed(world, matrix, options, name, true)?;
        if let Err(error) = factor.factorise(matrix, name) {
            // Only the search for pivots can say which rows make a matrix singular.
            if options.kind == Kind::Positive && factor.id.infog[0] == SINGULAR {
                drop(factor);
                let options = FactorOptions { kind: Kind::Indefinite, ..options };
                Self::analysed(world, matrix, options, name, false)?.factorise(matrix, name)?;
            }
            return Err(error);
        }
        factor.check_condition(matrix, name)?;
        Ok(factor)
    }

    /// Collective: what factorising `matrix` would cost, from the analysis of its pattern alone.
    pub fn estimate(world: &World, matrix: &DistCsr, options: FactorOptions) -> Result<FactorStatistics> {
        Factor::analysed(world, matrix, options, "estimate", false).map(|f| f.statistics)
    }

    fn analysed(world: &'w World, matrix: &DistCsr, options: FactorOptions, name: &str, values: bool) -> Result<Self> {
        if values {
            matrix.validate(world, name)?;
        }
        if matrix.order() == 0 {
            return Err(Error::Input(format!("matrix {name} has no rows: every degree of freedom is fixed")));
        }
        if matrix.order() > MUMPS_INT::MAX as u64 {
            return Err(Error::Memory(format!(
                "matrix {name} has {} rows, more than MUMPS can number",
                matrix.order()
            )));
        }
        let mut order = match options.ordering {
            Ordering::Metis => nested_dissection(world, matrix)?,
            _ => Vec::new(),
        };
        // MUMPS counts from 1, and takes the position of each variable.
        let mut permutation: Vec<MUMPS_INT> = order.drain(..).map(|p| p as MUMPS_INT + 1).collect();
        // SAFETY: a structure of integers, floats and pointers, for which all zeros are valid; MUMPS fills it.
        let mut id: Box<DMUMPS_STRUC_C> = Box::new(unsafe { std::mem::zeroed() });
        // SAFETY: a live communicator.
        id.comm_fortran = unsafe { mpi::ffi::RSMPI_Comm_c2f(world.comm.as_raw()) } as MUMPS_INT;
        id.par = 1;
        id.sym = match options.kind {
            Kind::Positive => 1,
            Kind::Indefinite => 2,
            Kind::General => 0,
        };
        let statistics = FactorStatistics::default();
        let mut factor = Self { world, id, ranges: matrix.ranges.clone(), kind: options.kind, statistics };
        factor.call(-1);
        factor.result(name)?;
        for stream in 1..=3 {
            factor.control(stream, -1);
        }
        factor.control(4, 0);
        factor.control(18, 3); // matrix distributed by rows, pattern at the analysis and values at the factorisation
        factor.control(28, 1); // ordering on one rank
        factor.control(14, WORKSPACE[usize::from(options.kind != Kind::Positive)]);
        factor.control(
            7,
            match options.ordering {
                Ordering::Metis => 1,
                Ordering::Scotch => 3,
                Ordering::Pord => 4,
            },
        );
        if options.kind != Kind::Positive {
            factor.control(24, 1); // find null pivots: a singular matrix is reported, with its rows
            factor.id.cntl[2] = NULL_PIVOT;
        }
        if options.kind == Kind::Indefinite {
            factor.control(13, 1); // no ScaLAPACK on the last block: its pivots would not be counted
        }

        let (mut rows, mut cols) = factor.pattern(matrix);
        factor.id.n = matrix.order() as MUMPS_INT;
        factor.id.nnz_loc = rows.len() as i64;
        factor.id.irn_loc = rows.as_mut_ptr();
        factor.id.jcn_loc = cols.as_mut_ptr();
        factor.id.perm_in = if permutation.is_empty() { ptr::null_mut() } else { permutation.as_mut_ptr() };
        factor.call(1);
        factor.id.perm_in = ptr::null_mut();
        factor.id.irn_loc = ptr::null_mut();
        factor.id.jcn_loc = ptr::null_mut();
        factor.result(name)?;
        factor.statistics = FactorStatistics {
            factor_entries: large(factor.id.infog[19]),
            flops: factor.id.rinfog[0],
            memory_max_mb: factor.id.infog[15].max(0) as u64,
            memory_sum_mb: factor.id.infog[16].max(0) as u64,
        };
        Ok(factor)
    }

    /// Local pattern as MUMPS takes it, 1-based: the lower triangle of symmetric matrices, all of others.
    fn pattern(&self, matrix: &DistCsr) -> (Vec<MUMPS_INT>, Vec<MUMPS_INT>) {
        let one = |k: u64| k as MUMPS_INT + 1;
        match self.kind {
            Kind::General => (0..matrix.n_local())
                .flat_map(|i| matrix.row(i).0.iter().map(move |&c| (i, c)))
                .map(|(i, c)| (one(matrix.ranges[self.world.rank] + i as u64), one(c)))
                .unzip(),
            _ => matrix.lower_triangle(self.world.rank).map(|(r, c, _)| (one(r), one(c))).unzip(),
        }
    }

    fn factorise(&mut self, matrix: &DistCsr, name: &str) -> Result<()> {
        let (mut rows, mut cols) = self.pattern(matrix);
        let mut values: Vec<f64> = match self.kind {
            Kind::General => matrix.values.clone(),
            _ => matrix.lower_triangle(self.world.rank).map(|(_, _, v)| v).collect(),
        };
        self.id.irn_loc = rows.as_mut_ptr();
        self.id.jcn_loc = cols.as_mut_ptr();
        self.id.a_loc = values.as_mut_ptr();
        let mut percent = self.id.icntl[13];
        loop {
            self.call(2);
            // Delayed pivots outgrew the estimate.
            if [-8, -9, -14, -15, -17, -20].contains(&self.id.infog[0]) && percent < WORKSPACE[2] {
                percent = (percent * 3).min(WORKSPACE[2]);
                self.control(14, percent);
                continue;
            }
            break;
        }
        self.id.irn_loc = ptr::null_mut();
        self.id.jcn_loc = ptr::null_mut();
        self.id.a_loc = ptr::null_mut();
        self.result(name)?;
        self.statistics = FactorStatistics {
            factor_entries: large(self.id.infog[8]),
            flops: self.id.rinfog[2],
            memory_max_mb: self.id.infog[17].max(0) as u64,
            memory_sum_mb: self.id.infog[18].max(0) as u64,
        };
        let null = self.id.infog[27];
        if null > 0 {
            return Err(self.singular(null, name));
        }
        if self.kind == Kind::Positive && self.id.infog[11] > 0 {
            return Err(Error::NotConverged(format!(
                "matrix {name} is not positive definite: {} negative pivots. A stiffness matrix has none unless an element \
                 is turned inside out or the material is unstable.",
                self.id.infog[11]
            )));
        }
        Ok(())
    }

    /// Without pivoting a free rigid-body motion leaves a pivot of rounding error, which MUMPS takes for a number. Two
    /// steps of inverse iteration find it: they estimate the condition number from below.
    fn check_condition(&mut self, matrix: &DistCsr, name: &str) -> Result<()> {
        let world = self.world;
        let scale = matrix.norm_inf(world);
        // Any start will do that is not orthogonal to smooth or to local vectors, and is the same on any number of ranks.
        let mut x: Vec<f64> = matrix.rows_of(world.rank).map(|i| 1.0 + (i as f64 * 12.9898).sin()).collect();
        let mut growth = 0.0;
        for _ in 0..2 {
            let before = norm2(world, &x);
            x.iter_mut().for_each(|v| *v /= before);
            if self.solve(&mut x, 1).is_err() {
                growth = f64::INFINITY;
                break;
            }
            growth = norm2(world, &x);
        }
        if growth * scale < CONDITION_LIMIT {
            return Ok(());
        }
        let mut largest = (0.0, 0u64);
        for (i, v) in matrix.rows_of(world.rank).zip(&x) {
            if v.is_nan() || v.abs() > largest.0 {
                largest = (v.abs(), i);
            }
        }
        let row = world.max(if largest.0 == world.max(largest.0) { largest.1 as f64 } else { -1.0 });
        Err(Error::NotConverged(format!(
            "matrix {name} is singular to working precision: condition number {:.1e}, its null vector is largest in row {row}. \
             Does a fixed group hold the body, is every node part of an element, and is a shift not an eigenvalue?",
            growth * scale
        )))
    }

    /// The error for a matrix with `null` zero pivots, naming their rows.
    fn singular(&self, null: MUMPS_INT, name: &str) -> Error {
        let mut rows = Vec::new();
        if self.world.is_root() && !self.id.pivnul_list.is_null() {
            // SAFETY: on rank 0 MUMPS lists the rows (1-based) of the null pivots, INFOG(28) of them.
            let list = unsafe { std::slice::from_raw_parts(self.id.pivnul_list, null as usize) };
            rows.extend(list.iter().map(|&r| (r - 1) as u64));
            rows.sort_unstable();
        }
        let rows = self.world.broadcast(rows);
        let shown: Vec<String> = rows.iter().take(6).map(u64::to_string).collect();
        let more = if rows.len() > 6 { ", …" } else { "" };
        Error::NotConverged(format!(
            "matrix {name} is singular: {null} zero pivots, in rows {}{more}. Six for one body mean that nothing holds it \
             (give it a fixed group); others, nodes without elements or a shift that is an eigenvalue.",
            shown.join(", ")
        ))
    }

    /// Number of negative eigenvalues of a symmetric matrix (Sylvester's law of inertia).
    pub fn negative_pivots(&self) -> u64 {
        self.id.infog[11].max(0) as u64
    }

    /// What the factorisation took.
    pub fn statistics(&self) -> FactorStatistics {
        self.statistics
    }

    /// First row of each rank, `[size + 1]`.
    pub fn ranges(&self) -> &[u64] {
        &self.ranges
    }

    /// Number of rows on this rank.
    pub fn n_local(&self) -> usize {
        (self.ranges[self.world.rank + 1] - self.ranges[self.world.rank]) as usize
    }

    /// Collective: solves for `nrhs` right-hand sides in place. `rhs`: local rows, `[n_local, nrhs]` column by column.
    pub fn solve(&mut self, rhs: &mut [f64], nrhs: usize) -> Result<()> {
        let n = self.n_local();
        let right = rhs.len() == n * nrhs && rhs.iter().all(|v| v.is_finite());
        self.world.agree(right.then_some(()).ok_or_else(|| {
            Error::Defect(format!(
                "right-hand side of {} values for {nrhs} columns of {n} rows, or not finite",
                rhs.len()
            ))
        }))?;
        let order = self.ranges[self.world.size] as usize;
        // Counts in MPI and leading dimensions in MUMPS are 32-bit.
        let chunk = (i32::MAX as usize / order).clamp(1, 512);
        let mut done = 0;
        while done < nrhs {
            let k = chunk.min(nrhs - done);
            self.solve_chunk(&mut rhs[done * n..(done + k) * n], k)?;
            done += k;
        }
        Ok(())
    }

    fn solve_chunk(&mut self, rhs: &mut [f64], k: usize) -> Result<()> {
        let world = self.world;
        let order = self.ranges[world.size] as usize;
        self.id.nrhs = k as MUMPS_INT;
        self.id.lrhs = order as MUMPS_INT;
        self.control(20, 0);
        self.control(21, 0);
        self.control(30, 0);
        if world.size == 1 {
            self.id.rhs = rhs.as_mut_ptr();
            self.call(3);
            self.id.rhs = ptr::null_mut();
            return self.result("solve");
        }
        // Ranks hold rows, MUMPS takes whole columns on rank 0.
        let parts = world.gather(rhs);
        let mut whole = vec![0.0; parts.len()];
        let pieces = |ranges: &[u64]| -> Vec<(usize, usize)> {
            ranges.windows(2).map(|w| (w[0] as usize, (w[1] - w[0]) as usize)).collect()
        };
        let pieces = pieces(&self.ranges);
        if world.is_root() {
            for &(first, n) in &pieces {
                for j in 0..k {
                    let from = first * k + j * n;
                    whole[j * order + first..][..n].copy_from_slice(&parts[from..from + n]);
                }
            }
        }
        // MUMPS remembers that a rank gave a pointer, and refuses sparse right-hand sides then on any but rank 0.
        if world.is_root() {
            self.id.rhs = whole.as_mut_ptr();
        }
        self.call(3);
        self.id.rhs = ptr::null_mut();
        self.result("solve")?;
        let parts = if world.is_root() {
            let part = |&(first, n): &(usize, usize)| {
                (0..k).flat_map(|j| whole[j * order + first..][..n].iter().copied()).collect()
            };
            pieces.iter().map(part).collect()
        } else {
            Vec::new()
        };
        rhs.copy_from_slice(&world.scatter(parts));
        Ok(())
    }

    /// Collective: the entries of the inverse at `rows` × `rows` (global numbers, the same on every rank, none twice), of
    /// a symmetric matrix, `[rows, rows]` on rank 0 and empty elsewhere. Works on the elimination tree alone, without one
    /// full solve per row (MUMPS's selected entries of the inverse).
    pub fn inverse_block(&mut self, rows: &[u64]) -> Result<Mat<f64>> {
        let world = self.world;
        let n = self.ranges[world.size];
        let bad = rows.iter().find(|&&r| r >= n);
        world.agree(bad.map_or(Ok(()), |r| Err(Error::Defect(format!("inverse block: row {r} of {n}")))))?;
        if self.kind == Kind::General {
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

    /// Sets ICNTL(`number`).
    fn control(&mut self, number: usize, value: MUMPS_INT) {
        self.id.icntl[number - 1] = value;
    }

    fn call(&mut self, job: MUMPS_INT) {
        self.id.job = job;
        // SAFETY: the structure was zeroed and initialised (job -1) on all ranks; pointers set in it are valid for the
        // job at hand and are reset by the caller after it.
        unsafe { dmumps_c(&mut *self.id) };
    }

    /// INFOG(1) as a result; the same on every rank.
    fn result(&self, name: &str) -> Result<()> {
        let (code, detail) = (self.id.infog[0], self.id.infog[1]);
        if code >= 0 {
            return Ok(());
        }
        // Sizes beyond 32 bits come as negative millions.
        let entries = if detail < 0 { -(detail as f64) * 1e6 } else { detail as f64 };
        let gib = entries * 8.0 / f64::powi(1024.0, 3);
        let estimate = self.statistics.memory_max_mb;
        Err(match code {
            -13 | -5 | -7 | -19 | -75 | -76 | -80 => Error::Memory(format!(
                "out of memory in the factorisation of {name}: MUMPS was refused {gib:.2} GiB; it needs about {estimate} MB on \
                 one rank in all (error {code}). Use more ranks on more machines, a coarser mesh, or solver.linear \"gamg\"."
            )),
            -8 | -9 | -14 | -15 | -17 | -20 => Error::Memory(format!(
                "factorisation of {name}: the workspace of MUMPS is too small even at {} % above its estimate of {estimate} MB \
                 (error {code}, {detail})",
                WORKSPACE[2]
            )),
            SINGULAR | -6 => Error::NotConverged(format!(
                "matrix {name} is singular (MUMPS error {code} after {detail} pivots): is the body held by a fixed group, and is \
                 every node part of an element?"
            )),
            -40 => Error::NotConverged(format!("matrix {name} is not positive definite (MUMPS error -40)")),
            _ => Error::Defect(format!("MUMPS, {name}: error {code}, {detail}")),
        })
    }
}

impl Drop for Factor<'_> {
    fn drop(&mut self) {
        let mut over = 0;
        // SAFETY: a valid output; may be called at any time.
        unsafe { mpi::ffi::MPI_Finalized(&mut over) };
        if over == 0 {
            self.call(-2);
        }
    }
}

/// MUMPS gives numbers beyond 32 bits as negative millions.
fn large(value: MUMPS_INT) -> u64 {
    if value < 0 {
        value.unsigned_abs() as u64 * 1_000_000
    } else {
        value as u64
    }
}
