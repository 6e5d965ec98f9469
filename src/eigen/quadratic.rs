//! Quadratic eigenproblems (λ²M + λC + K) x = 0, complex and of no symmetry: the pairs nearest to a shift σ by a
//! block Arnoldi method with shift and inversion.
//!
//! The method works on the companion form in (x, λx), whose inverse at the shift is (x₁, x₂) → (u, x₁ + σu), u =
//! −P(σ)⁻¹ (M (x₂ + σx₁) + C x₁). Both halves of all its vectors lie in the span of a basis Q that grows by one block
//! for each block of solves, so only Q is kept, and the vectors as coordinates in it (two-level orthogonalisation: D.
//! Lu, Y. Su, Z. Bai, SIAM J. Matrix Anal. Appl. 37 (2016) 195, here with blocks). Solves in blocks cost a fraction
//! of as many single ones, and a block finds eigenvalues that lie together. When the space is full it restarts with
//! the best vectors.

pub use super::block::random;
use crate::parallel::World;
use crate::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Llt;
use faer::{Accum, Mat, MatMut, MatRef, Par, Side};
use num_complex::Complex;

pub(super) type C = Complex<f64>;
/// aᴴ b.
type Inner<'a> = dyn Fn(MatRef<'_, C>, MatRef<'_, C>) -> Mat<C> + 'a;

/// Columns of a block of solves.
pub const BLOCK: usize = 4;
/// A direction that is this much smaller than what it was before those known were taken from it is rounding.
const NOISE: f64 = 1e-13;
/// One that is smaller than this is made orthonormal with care, column by column, and so is a block of which the Gram
/// matrix with unit diagonal has a pivot smaller than the second.
const SMALL: f64 = 1e-8;
const PIVOT: f64 = 1e-2;
/// Times that known directions are taken from a single column at the most.
const PASSES: usize = 4;
/// Restarts after which the method gives up.
const MAX_RESTARTS: usize = 100;

/// The problem, distributed over the ranks by rows, and its inverse at the shift.
pub trait Quadratic {
    /// The ranks.
    fn world(&self) -> &World;
    /// Rows on this rank.
    fn n_local(&self) -> usize;
    /// Collective: Y = A X with the matrix A of this power of the eigenvalue, K, C, M for 0, 1, 2; local rows,
    /// `[n_local, columns]` column by column.
    fn multiply(&mut self, power: usize, x: &[C], y: &mut [C], columns: usize) -> Result<()>;
    /// Collective: K X, C X and M X.
    fn images(&mut self, x: &[C], columns: usize) -> Result<[Vec<C>; 3]> {
        let mut out = [0, 1, 2].map(|_| vec![C::default(); x.len()]);
        out.iter_mut().enumerate().try_for_each(|(power, out)| self.multiply(power, x, out, columns))?;
        Ok(out)
    }
    /// Collective: X := P(σ)⁻¹ X, local rows, `[n_local, columns]` column by column.
    fn solve(&mut self, x: &mut [C], columns: usize) -> Result<()>;
}

/// Settings of the computation.
#[derive(Debug, Clone, Copy)]
pub struct QuadraticSettings {
    /// The shift σ of the inverse: the eigenvalues nearest to it are sought.
    pub target: C,
    /// Number of eigenpairs.
    pub count: usize,
    /// Largest residual of θ = 1/(λ − σ), relative to θ.
    pub tolerance: f64,
    /// The same of vectors that are given beside them; 0: none are.
    pub loose: f64,
}

/// Eigenpairs, the nearest to the shift first. There may be more than were asked for: none is left out among them.
#[derive(Debug, Clone, Default)]
pub struct QuadraticPairs {
    /// Eigenvalues.
    pub lambda: Vec<C>,
    /// Local rows of each eigenvector, of Euclidean norm 1.
    pub vectors: Vec<Vec<C>>,
    /// The same of the vectors that have begun to converge.
    pub beside: Vec<Vec<C>>,
    /// Restarts of the method.
    pub restarts: usize,
    /// Columns that were solved for.
    pub solves: usize,
}

/// Columns of Q at the most.
fn room(count: usize) -> usize {
    4 * count + 5 * BLOCK
}

/// Collective: aᴴ b, the same on every rank.
pub(super) fn gram(world: &World, a: MatRef<'_, C>, b: MatRef<'_, C>) -> Mat<C> {
    let (rows, cols) = (a.ncols(), b.ncols());
    let mut own = vec![C::default(); rows * cols];
    matmul(
        MatMut::from_column_major_slice_mut(&mut own, rows, cols),
        Accum::Replace,
        a.adjoint(),
        b,
        C::from(1.0),
        Par::Seq,
    );
    MatRef::from_column_major_slice(&world.sum_all(&own), rows, cols).to_owned()
}

fn norms(a: MatRef<'_, C>) -> Vec<f64> {
    a.col_iter().map(|c| c.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt()).collect()
}

/// `a` with zeros below, up to `rows`.
fn taller(a: MatRef<'_, C>, rows: usize) -> Mat<C> {
    Mat::from_fn(rows, a.ncols(), |i, j| if i < a.nrows() { a[(i, j)] } else { C::default() })
}

/// Collective: norms of distributed columns of `n` local rows.
pub fn sizes(world: &World, columns: &[C], n: usize) -> Vec<f64> {
    let squares: Vec<f64> = columns.chunks_exact(n).map(|c| c.iter().map(|v| v.norm_sqr()).sum()).collect();
    world.sum_all(&squares).into_iter().map(f64::sqrt).collect()
}

/// aᴴ b of what every rank has whole.
fn plain(a: MatRef<'_, C>, b: MatRef<'_, C>) -> Mat<C> {
    a.adjoint() * b
}

/// [a, b].
fn beside(a: MatRef<'_, C>, b: MatRef<'_, C>) -> Mat<C> {
    Mat::from_fn(a.nrows(), a.ncols() + b.ncols(), |i, j| if j < a.ncols() { a[(i, j)] } else { b[(i, j - a.ncols())] })
}

/// [a; b].
fn above(a: MatRef<'_, C>, b: MatRef<'_, C>) -> Mat<C> {
    Mat::from_fn(a.nrows() + b.nrows(), a.ncols(), |i, j| if i < a.nrows() { a[(i, j)] } else { b[(i - a.nrows(), j)] })
}

/// w = V T + Q R.
pub(super) struct Split {
    pub q: Mat<C>,
    r: Mat<C>,
    t: Mat<C>,
}

/// Orthonormal columns Q, orthogonal to those of `known`, V, that span with them the columns of `w`, whose norms were
/// `sizes` before something was taken from them. What is rounding is left out. `inner` gives aᴴ b.
fn split(w: MatRef<'_, C>, known: MatRef<'_, C>, sizes: &[f64], inner: &Inner) -> Split {
    let p = w.ncols();
    let mut q = Mat::<C>::zeros(w.nrows(), 0);
    let mut r = Mat::<C>::zeros(0, p);
    let mut t = Mat::<C>::zeros(known.ncols(), p);
    for k in 0..p {
        let mut v = w.subcols(k, 1).to_owned();
        let mut shares = Mat::<C>::zeros(q.ncols(), 1);
        let mut size = sizes[k];
        for _ in 0..PASSES {
            let (h, g) = (inner(known, v.as_ref()), inner(q.as_ref(), v.as_ref()));
            v -= known * &h + &q * &g;
            (0..t.nrows()).for_each(|i| t[(i, k)] += h[(i, 0)]);
            shares += &g;
            let before = size;
            size = inner(v.as_ref(), v.as_ref())[(0, 0)].re.max(0.0).sqrt();
            if size > 0.5 * before || !(size > NOISE * sizes[k]) {
                break;
            }
        }
        if size > NOISE * sizes[k] {
            v *= faer::Scale(C::from(1.0 / size));
            q = beside(q.as_ref(), v.as_ref());
            r = taller(r.as_ref(), q.ncols());
            r[(q.ncols() - 1, k)] = C::from(size);
        }
        (0..shares.nrows()).for_each(|i| r[(i, k)] = shares[(i, 0)]);
    }
    Split { q, r, t }
}

/// Collective: [`split`] for distributed columns; by Gram matrices where they are far from dependent.
pub(super) fn split_block(world: &World, w: MatRef<'_, C>, known: MatRef<'_, C>, sizes: &[f64]) -> Split {
    let careful = || split(w, known, sizes, &|a, b| gram(world, a, b));
    let p = w.ncols();
    let mut q = w.to_owned();
    let mut r = Mat::<C>::identity(p, p);
    let mut t = Mat::<C>::zeros(known.ncols(), p);
    // Cholesky-QR twice, with unit diagonal.
    for pass in 0..2 {
        let h = gram(world, known, q.as_ref());
        matmul(q.as_mut(), Accum::Add, known, &h, C::from(-1.0), Par::Seq);
        t += &h * &r;
        let g = gram(world, q.as_ref(), q.as_ref());
        let d: Vec<f64> = (0..p).map(|i| g[(i, i)].re.max(0.0).sqrt()).collect();
        if pass == 0 && d.iter().zip(sizes).any(|(d, s)| !(*d > SMALL * s)) {
            return careful();
        }
        let unit = Mat::from_fn(p, p, |i, j| g[(i, j)] / (d[i] * d[j]));
        let Ok(factor) = Llt::new(unit.as_ref(), Side::Lower) else { return careful() };
        let l = factor.L();
        if (0..p).any(|i| !(l[(i, i)].re > PIVOT)) {
            return careful();
        }
        // q ← q R⁻¹, R = Lᴴ D.
        let upper = Mat::from_fn(p, p, |i, j| if i <= j { l[(j, i)].conj() * d[j] } else { C::default() });
        let mut inverse = Mat::<C>::zeros(p, p);
        for j in 0..p {
            inverse[(j, j)] = upper[(j, j)].inv();
            for i in (0..j).rev() {
                let sum: C = (i + 1..=j).map(|k| upper[(i, k)] * inverse[(k, j)]).sum();
                inverse[(i, j)] = -sum / upper[(i, i)];
            }
        }
        q = &q * &inverse;
        r = &upper * &r;
    }
    Split { q, r, t }
}

/// The space.
struct Space {
    /// Local rows of Q, column by column.
    basis: Vec<C>,
    n: usize,
    /// Coordinates of x₁ and of x₂ of each vector in Q, `[r, m]`; the last columns are the block to go on with.
    top: Mat<C>,
    bottom: Mat<C>,
    /// Vectors of that block.
    next: usize,
    /// The operator in the vectors before it, `[m, m − next]`.
    projected: Mat<C>,
}

impl Space {
    fn basis(&self) -> MatRef<'_, C> {
        MatRef::from_column_major_slice(&self.basis, self.n, self.basis.len() / self.n)
    }

    /// Q times coordinates.
    fn vectors(&self, coordinates: MatRef<'_, C>) -> Vec<C> {
        let mut out = vec![C::default(); self.n * coordinates.ncols()];
        let target = MatMut::from_column_major_slice_mut(&mut out, self.n, coordinates.ncols());
        matmul(target, Accum::Replace, self.basis(), coordinates, C::from(1.0), Par::Seq);
        out
    }

    /// Collective: the space of the `start`, local rows column by column.
    fn new(world: &World, n: usize, start: &[C], target: C) -> Self {
        let w = MatRef::from_column_major_slice(start, n, start.len() / n);
        let nothing = MatRef::from_column_major_slice(&[], n, 0);
        let Split { q, .. } = split_block(world, w, nothing, &sizes(world, start, n));
        let r = q.ncols();
        let unit = 1.0 / (1.0 + target.norm_sqr()).sqrt();
        let diagonal = |v: C| Mat::from_fn(r, r, |i, j| if i == j { v } else { C::default() });
        Self {
            basis: q.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<C>>()).collect(),
            n,
            top: diagonal(C::from(unit)),
            bottom: diagonal(target * unit),
            next: r,
            projected: Mat::zeros(r, 0),
        }
    }

    /// Collective: applies the inverse to the last block.
    fn step(&mut self, operator: &mut dyn Quadratic, target: C, room: usize) -> Result<()> {
        let (n, b, m) = (self.n, self.next, self.top.ncols());
        let [top, bottom] = [&self.top, &self.bottom].map(|u| u.subcols(m - b, b).to_owned());
        // −(M (x₂ + σx₁) + C x₁).
        let first = self.vectors(top.as_ref());
        let sum = self.vectors((&bottom + faer::Scale(target) * &top).as_ref());
        let (mut moved, mut product) = (vec![C::default(); n * b], vec![C::default(); n * b]);
        operator.multiply(2, &sum, &mut moved, b)?;
        operator.multiply(1, &first, &mut product, b)?;
        moved.iter_mut().zip(&product).for_each(|(y, p)| *y = -(*y + p));
        drop((sum, product));
        drop(first);
        operator.solve(&mut moved, b)?;
        let world = operator.world();

        let Split { q: new, r, t: shares } =
            split_block(world, MatRef::from_column_major_slice(&moved, n, b), self.basis(), &sizes(world, &moved, n));
        drop(moved);
        // Not twice what is needed, as a list that grows would take.
        self.basis.reserve_exact(self.n * room.saturating_sub(self.basis().ncols()).max(new.ncols()));
        new.col_iter().for_each(|c| self.basis.extend(c.iter()));
        let rows = self.basis().ncols();
        let [u, v] = [&self.top, &self.bottom].map(|u| taller(u.as_ref(), rows));
        let y = above(shares.as_ref(), r.as_ref());
        let second = taller(top.as_ref(), rows) + faer::Scale(target) * &y;

        // The same once more in the coordinates, which are those of orthonormal vectors.
        let known = above(u.as_ref(), v.as_ref());
        let w = above(y.as_ref(), second.as_ref());
        let Split { q, r, t: column } = split(w.as_ref(), known.as_ref(), &norms(w.as_ref()), &plain);
        self.next = q.ncols();
        let projected = taller(self.projected.as_ref(), m + self.next);
        self.projected = beside(projected.as_ref(), above(column.as_ref(), r.as_ref()).as_ref());
        self.top = beside(u.as_ref(), q.subrows(0, rows));
        self.bottom = beside(v.as_ref(), q.subrows(rows, rows));
        Ok(())
    }

    /// Collective: Ritz values θ, the largest first, their residuals relative to them, and their vectors in the
    /// coordinates of the vectors.
    fn ritz(&self, world: &World) -> Result<(Vec<C>, Vec<f64>, Mat<C>)> {
        let m = self.projected.ncols();
        let found = world.on_root(|| {
            let eigen = self
                .projected
                .subrows(0, m)
                .eigen()
                .map_err(|e| Error::NotConverged(format!("quadratic eigenproblem: its projection: {e:?}")))?;
            let theta = eigen.S().column_vector();
            let mut order: Vec<usize> = (0..m).collect();
            order.sort_by(|&a, &b| theta[b].norm().total_cmp(&theta[a].norm()));
            let mut all: Vec<C> = order.iter().map(|&i| theta[i]).collect();
            for &i in &order {
                let z: Vec<C> = (0..m).map(|row| eigen.U()[(row, i)]).collect();
                let size = z.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
                all.extend(z.iter().map(|v| v / size));
            }
            Ok(all)
        })?;
        let all = world.broadcast(found.unwrap_or_default());
        let theta = all[..m].to_vec();
        let z = MatRef::from_column_major_slice(&all[m..], m, m).to_owned();
        let rest = norms((self.projected.subrows(m, self.next) * &z).as_ref());
        let residuals = rest.iter().zip(&theta).map(|(r, t)| r / t.norm().max(f64::MIN_POSITIVE)).collect();
        Ok((theta, residuals, z))
    }

    /// Keeps the span of the Ritz vectors `z` and the block to go on with.
    fn restart(&mut self, z: MatRef<'_, C>) {
        let m = self.projected.ncols();
        let only = |w: MatRef<'_, C>| {
            let nothing = Mat::zeros(w.nrows(), 0);
            split(w, nothing.as_ref(), &vec![1.0; w.ncols()], &plain).q
        };
        let z = only(z);
        let inside = z.adjoint() * (self.projected.subrows(0, m) * &z);
        let coupling = self.projected.subrows(m, self.next) * &z;
        self.projected = above(inside.as_ref(), coupling.as_ref());
        let kept = |u: &Mat<C>| beside((u.subcols(0, m) * &z).as_ref(), u.subcols(m, self.next));
        let [top, bottom] = [kept(&self.top), kept(&self.bottom)];
        // Directions of Q that are still needed.
        let both = beside(top.as_ref(), bottom.as_ref());
        let p = only(both.as_ref());
        self.basis = self.vectors(p.as_ref());
        self.top = p.adjoint() * top;
        self.bottom = p.adjoint() * bottom;
    }
}

/// Collective: the eigenpairs nearest to the target. `start` holds the local rows of the block to begin with, column
/// by column. `progress` is told converged and wanted pairs after every block.
pub fn nearest(
    operator: &mut dyn Quadratic,
    start: &[C],
    wanted: &QuadraticSettings,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<QuadraticPairs> {
    let n = operator.n_local();
    let order = operator.world().sum_u64(n as u64);
    let world = operator.world();
    world.agree(match n {
        0 => Err(Error::Defect("quadratic eigenproblem: a rank without rows".into())),
        _ if start.is_empty() || !start.len().is_multiple_of(n) => {
            Err(Error::Defect(format!("a start of {} values for {n} rows", start.len())))
        }
        _ => Ok(()),
    })?;
    if wanted.count as u64 > 2 * order {
        return Err(Error::Job(format!(
            "{} eigenvalues were asked for, but there are only {}; ask for fewer",
            wanted.count,
            2 * order
        )));
    }
    let mut space = Space::new(world, n, start, wanted.target);
    let (mut restarts, mut solves) = (0, 0);
    let finite = |t: &&C| t.norm() > 0.0;
    loop {
        solves += space.next;
        space.step(operator, wanted.target, room(wanted.count))?;
        let (theta, residuals, z) = space.ritz(operator.world())?;
        let converged = residuals.iter().take_while(|r| **r <= wanted.tolerance).count();
        progress(converged.min(wanted.count), wanted.count);
        if converged >= wanted.count || space.next == 0 {
            let found = converged.min(theta.iter().take_while(finite).count());
            if found < wanted.count {
                return Err(Error::NotConverged(format!(
                    "quadratic eigenproblem: only {found} of {} eigenvalues are finite; ask for fewer",
                    wanted.count
                )));
            }
            let begun = (found..theta.len()).filter(|&i| finite(&&theta[i]) && residuals[i] <= wanted.loose);
            let kept: Vec<usize> = (0..found).chain(begun).collect();
            let z = Mat::from_fn(z.nrows(), kept.len(), |i, j| z[(i, kept[j])]);
            let vectors = space.vectors((space.top.subcols(0, z.nrows()) * &z).as_ref());
            drop(space);
            let sizes = sizes(operator.world(), &vectors, n);
            let unit = |(x, size): (&[C], &f64)| x.iter().map(|v| v / size).collect();
            let mut vectors: Vec<Vec<C>> = vectors.chunks_exact(n).zip(&sizes).map(unit).collect();
            let beside = vectors.split_off(found);
            return Ok(QuadraticPairs {
                lambda: theta[..found].iter().map(|t| wanted.target + t.inv()).collect(),
                vectors,
                beside,
                restarts,
                solves,
            });
        }
        if space.basis().ncols() + BLOCK > room(wanted.count) {
            if restarts == MAX_RESTARTS {
                return Err(Error::NotConverged(format!(
                    "quadratic eigenproblem: only {converged} of {} eigenvalues converged in {restarts} \
                     restarts; ask for fewer",
                    wanted.count
                )));
            }
            restarts += 1;
            let beside = if wanted.loose > 0.0 { wanted.count } else { 0 };
            let keep = (wanted.count + beside + BLOCK).min(z.ncols());
            space.restart(z.subcols(0, keep));
        }
    }
}
