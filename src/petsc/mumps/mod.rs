//! Direct solver for real matrices: MUMPS in real arithmetic through its own C interface.
//!
//! PETSc's scalars are complex (SLEPc takes complex targets in no other build), and a complex factorisation of a real
//! matrix costs three to four times the time and twice the memory of a real one. MUMPS keeps its precisions in separate
//! libraries, so the real one is called beside PETSc. Numbers of controls and statistics are those of the
//! MUMPS 5.5 users' guide.

mod failure;
mod inverse;
mod solve;

pub(super) use failure::{failure, room, space, MumpsCall};

use super::csr::{norm2, DistCsr};
use super::ordering::nested_dissection;
use crate::parallel::World;
use crate::{Error, Result};
use failure::SINGULAR;
use mpi::raw::AsRaw;
use mumps_sys::{dmumps_c, DMUMPS_STRUC_C, MUMPS_INT};
use std::borrow::Cow;
use std::ptr;

/// Properties of a matrix known before it is factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
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
    /// METIS nested dissection on blocks of rows with equal pattern. For [`Symmetry::General`] METIS sees the pattern
    /// as it is, which must be symmetric.
    Metis,
    /// SCOTCH inside MUMPS, where that was built with it.
    Scotch,
    /// PORD inside MUMPS.
    Pord,
}

/// How to factorise.
#[derive(Debug, Clone, Copy)]
pub struct FactorOptions {
    /// Properties of the matrix.
    pub kind: Symmetry,
    /// Elimination order.
    pub ordering: Ordering,
}

impl FactorOptions {
    /// The defaults for a matrix of this kind.
    pub fn new(kind: Symmetry) -> Self {
        Self { kind, ordering: Ordering::Metis }
    }
}

/// Statistics of MUMPS on a factorisation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FactorStatistics {
    /// Entries in the factors (estimated by the analysis, then counted).
    pub factor_entries: u64,
    /// Floating-point operations of the elimination.
    pub flops: f64,
    /// Operations of the rank that has most of them.
    pub flops_max: f64,
    /// Entries in the factors on the rank that has most of them.
    pub entries_max: u64,
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
    kind: Symmetry,
    statistics: FactorStatistics,
    /// Distribution of right-hand sides and solutions over several ranks.
    rows: solve::Rows,
}

/// Relaxation of the estimated workspace, percent, at the first attempt without and with pivoting, and at the last.
/// Without pivots to delay the estimate is nearly what is needed, on several ranks too; what is beyond stays taken as
/// long as the factor.
const WORKSPACE: [MUMPS_INT; 3] = [2, 30, 1000];

/// MUMPS's KEEP(1), which says how many zeros two fronts may be made one for; it takes 5. With 3 the factor of an
/// annulus of hexahedra has 5 percent fewer entries and operations, and a solve takes as long.
const AMALGAMATION: MUMPS_INT = 3;

/// Advice against a factorisation without memory.
const ADVICE: &str = "solver.out_of_core, more ranks on more machines, a coarser mesh or, for steady rolling \
 alone, solver.linear \"gamg\"";

/// A pivot below this fraction of the largest entry counts as zero. Stiffness matrices of graded meshes reach 1e-9,
/// a free rigid-body motion leaves some 1e-16.
const NULL_PIVOT: f64 = 1e-13;

/// Condition numbers above this one are those of singular matrices with rounding errors in them.
const CONDITION_LIMIT: f64 = 1e13;

impl<'w> Factor<'w> {
    /// Collective: factorises `matrix`. `name` stands for it in messages.
    pub fn new(world: &'w World, matrix: &DistCsr, options: FactorOptions, name: &str) -> Result<Self> {
        let mut factor = Self::analysed(world, matrix, options, name, true)?;
        factor.refuse_no_room(name)?;
        if let Err(error) = factor.factorise(matrix, name) {
            // Only the search for pivots can say which rows make a matrix singular.
            if options.kind == Symmetry::Positive && i64::from(factor.id.infog[0]) == SINGULAR {
                drop(factor);
                let options = FactorOptions { kind: Symmetry::Indefinite, ..options };
                Self::analysed(world, matrix, options, name, false)?.factorise(matrix, name)?;
            }
            return Err(error);
        }
        allocator::trim();
        factor.check_condition(matrix, name)?;
        Ok(factor)
    }

    /// Collective: factorises another matrix of the same pattern in place of the first; its analysis is kept.
    pub fn renew(&mut self, matrix: &DistCsr, name: &str) -> Result<()> {
        matrix.validate(self.world, name)?;
        self.rows = Default::default();
        self.factorise(matrix, name)?;
        self.check_condition(matrix, name)
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
            Symmetry::Positive => 1,
            Symmetry::Indefinite => 2,
            Symmetry::General => 0,
        };
        let statistics = FactorStatistics::default();
        let mut factor =
            Self { world, id, ranges: matrix.ranges.clone(), kind: options.kind, statistics, rows: Default::default() };
        factor.call(-1);
        factor.result(name)?;
        for stream in 1..=3 {
            factor.control(stream, -1);
        }
        factor.control(4, 0);
        factor.id.keep[0] = AMALGAMATION;
        factor.control(18, 3); // matrix distributed by rows, pattern at the analysis and values at the factorisation
        factor.control(28, 1); // ordering on one rank
        if let Some(scratch) = world.scratch.get() {
            factor.control(22, 1); // factors on the disk
            put_text(&mut factor.id.ooc_tmpdir, &scratch.path().to_string_lossy())?;
        }
        factor.control(14, WORKSPACE[usize::from(options.kind != Symmetry::Positive)]);
        factor.control(
            7,
            match options.ordering {
                Ordering::Metis => 1,
                Ordering::Scotch => 3,
                Ordering::Pord => 4,
            },
        );
        if options.kind != Symmetry::Positive {
            factor.control(24, 1); // find null pivots: a singular matrix is reported, with its rows
            factor.id.cntl[2] = NULL_PIVOT;
        }
        if options.kind == Symmetry::Indefinite {
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
            flops_max: world.max(factor.id.rinfo[0]),
            entries_max: world.max(large(factor.id.info[2]) as f64) as u64,
            memory_max_mb: factor.id.infog[if factor.on_disk() { 25 } else { 15 }].max(0) as u64,
            memory_sum_mb: factor.id.infog[if factor.on_disk() { 26 } else { 16 }].max(0) as u64,
        };
        Ok(factor)
    }

    /// True where the factors go to the disk.
    pub(crate) fn on_disk(&self) -> bool {
        self.id.icntl[21] == 1
    }

    /// Collective: an error where there is no memory for what the analysis found, or no space on the disk.
    fn refuse_no_room(&self, name: &str) -> Result<()> {
        let what = format!("the factorisation of {name}");
        let failed = self.failed(&what, name);
        let need = self.id.info[if self.on_disk() { 16 } else { 14 }].max(0) as u64;
        space(self.world, 8.0 * large(self.id.info[2]) as f64, &failed)?;
        room(self.world, need, &failed)
    }

    /// Local pattern as MUMPS takes it, 1-based: the lower triangle of symmetric matrices, all of others.
    fn pattern(&self, matrix: &DistCsr) -> (Vec<MUMPS_INT>, Vec<MUMPS_INT>) {
        let one = |k: u64| k as MUMPS_INT + 1;
        match self.kind {
            Symmetry::General => {
                let (starts, cols) = matrix.whole_pattern();
                let rows = (0..matrix.n_local()).flat_map(|i| std::iter::repeat_n(i as u64, starts[i + 1] - starts[i]));
                let first = matrix.ranges[self.world.rank];
                (rows.map(|i| one(first + i)).collect(), cols.iter().map(|&c| one(c.into())).collect())
            }
            _ => matrix.lower_triangle(self.world.rank).map(|(r, c, _)| (one(r), one(c))).unzip(),
        }
    }

    fn factorise(&mut self, matrix: &DistCsr, name: &str) -> Result<()> {
        let (mut rows, mut cols) = self.pattern(matrix);
        let values: Cow<[f64]> = match self.kind {
            Symmetry::General => Cow::Owned(matrix.full().into_owned().values),
            // Where nothing else is stored they are there already.
            _ if rows.len() == matrix.values.len() => Cow::Borrowed(&matrix.values),
            _ => Cow::Owned(matrix.lower_triangle(self.world.rank).map(|(_, _, v)| v).collect()),
        };
        self.id.irn_loc = rows.as_mut_ptr();
        self.id.jcn_loc = cols.as_mut_ptr();
        // It is read alone.
        self.id.a_loc = values.as_ptr().cast_mut();
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
            flops_max: self.world.max(self.id.rinfo[2]),
            entries_max: self.world.max(large(self.id.info[8]) as f64) as u64,
            memory_max_mb: self.id.infog[17].max(0) as u64,
            memory_sum_mb: self.id.infog[18].max(0) as u64,
        };
        let null = self.id.infog[27];
        if null > 0 {
            return Err(self.singular(null, name));
        }
        if self.kind == Symmetry::Positive && self.id.infog[11] > 0 {
            return Err(Error::NotConverged(format!(
                "matrix {name} is not positive definite: {} negative pivots. A stiffness matrix has none unless \
                 an element \
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
        // Any start will do that is not orthogonal to smooth or to local vectors, and is the same on any number of
        // ranks.
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
            "matrix {name} is singular to working precision: condition number {:.1e}, its null vector is \
             largest in row {row}. \
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
            "matrix {name} is singular: {null} zero pivots, in rows {}{more}. Six for one body mean that \
             nothing holds it \
             (give it a fixed group); others, nodes without elements or a shift that is an eigenvalue.",
            shown.join(", ")
        ))
    }

    /// Number of negative eigenvalues of a symmetric matrix (Sylvester's law of inertia).
    pub fn negative_pivots(&self) -> u64 {
        self.id.infog[11].max(0) as u64
    }

    /// Returns the statistics of the factorisation.
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
        let (code, detail) = (i64::from(self.id.infog[0]), i64::from(self.id.infog[1]));
        failure(code, detail, &self.failed(&format!("the factorisation of {name}"), name))
    }

    fn failed<'a>(&self, what: &'a str, matrix: &'a str) -> MumpsCall<'a> {
        MumpsCall { what, matrix, entry: 8.0, megabytes: self.statistics.memory_max_mb, advice: ADVICE }
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

/// Puts `text` into a field of characters that ends in zero.
fn put_text(field: &mut [std::ffi::c_char], text: &str) -> Result<()> {
    if text.len() >= field.len() || text.contains('\0') {
        return Err(Error::Job(format!(
            "solver.out_of_core: found a path of {} bytes, {text}; expected one that MUMPS can hold, of at most \
             {} bytes",
            text.len(),
            field.len() - 1
        )));
    }
    field.fill(0);
    field.iter_mut().zip(text.bytes()).for_each(|(to, from)| *to = from as std::ffi::c_char);
    Ok(())
}

/// MUMPS gives numbers beyond 32 bits as negative millions.
fn large(value: MUMPS_INT) -> u64 {
    if value < 0 {
        value.unsigned_abs() as u64 * 1_000_000
    } else {
        value as u64
    }
}
