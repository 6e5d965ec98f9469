//! Thick-restart block Lanczos for θ = 1/(λ − σ), the eigenvalues of (K − σM)⁻¹M, with the inner product xᵀMy.
//!
//! Every new block is orthogonalised against the whole basis; what the recurrence knows is taken off first, so that
//! one pass over the basis is a second one. The projected matrix T is kept whole: after a restart it is the diagonal
//! of the Ritz values kept with the coupling to the next block. Sources: Grimes, Lewis, Simon, SIAM J. Matrix Anal.
//! Appl. 15 (1994) 228, for the block method with shift and inverse; Wu, Simon, SIAM J. Matrix Anal. Appl. 22 (2000)
//! 602, for the thick restart.

use super::block::{columns, combine, gram, random, subtract};
use super::orthonormal::{orthonormalise, OrthonormalBlocks};
use super::{Pencil, Shifted};
use crate::dense::symmetric_eigen;
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Columns of a block.
const BLOCK: usize = 8;
/// Relative residual of θ at which a pair has converged.
const TOLERANCE: f64 = 1e-9;
/// Relative residual of θ at which a pair is locked: its coupling to the rest is rounding then.
const LOCKED: f64 = 1e-13;
/// Blocks that must follow one with new random columns before pairs count as those of the goal.
const SETTLED: usize = 3;
/// Restarts after which the method gives up.
const MAX_RESTARTS: usize = 200;
/// Values of θ closer than this, relatively, are locked together or not at all.
const CLUSTER: f64 = 4e-3;

/// Which pairs are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Goal {
    /// This many whose eigenvalues are nearest to the shift.
    Nearest(usize),
    /// This many nearest below the shift and this many nearest above it.
    Sides(usize, usize),
}

impl Goal {
    fn count(&self) -> usize {
        match *self {
            Goal::Nearest(n) => n,
            Goal::Sides(below, above) => below + above,
        }
    }
}

/// Sizes of the method.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    /// Columns of a block, at least 1.
    pub block: usize,
    /// Columns of the basis at which it is restarted, more than the pairs wanted.
    pub subspace: usize,
}

impl Sizes {
    /// For `count` pairs, as measured: wider blocks take more right-hand sides in all and larger bases, narrower ones
    /// more passes through the factor.
    pub(crate) fn for_count(count: usize) -> Self {
        Self { block: BLOCK, subspace: (2 * count + 4 * BLOCK).max(count + 6 * BLOCK) }
    }

    /// For `count` pairs where each pass through the factor reads it from a disk: few passes, without a restart as
    /// long as there are not many pairs.
    pub(crate) fn few_passes(count: usize) -> Self {
        Self { block: 3 * BLOCK, subspace: 2 * count + 15 * BLOCK }
    }
}

/// Converged pairs.
pub(super) struct ConvergedPairs {
    /// θ of each, by falling size.
    pub theta: Vec<f64>,
    /// Orthonormal in the mass, `[n_local, theta.len()]`.
    pub vectors: Vec<f64>,
    /// Restarts.
    pub restarts: usize,
    /// Right-hand sides solved.
    pub solves: usize,
}

/// Ritz pairs of the active part of the basis, by falling |θ|.
struct Ritz {
    theta: Vec<f64>,
    /// In the active columns of the basis.
    vectors: Mat<f64>,
    /// Length of what the image has beyond the basis, over |θ|.
    residual: Vec<f64>,
}

impl Ritz {
    fn converged(&self) -> impl Iterator<Item = (f64, bool)> + '_ {
        self.theta.iter().zip(&self.residual).map(|(t, r)| (*t, *r <= TOLERANCE))
    }
}

struct Lanczos<'a> {
    pencil: &'a dyn Pencil,
    shifted: &'a mut dyn Shifted,
    deflated: MatRef<'a, f64>,
    n: usize,
    /// Orthonormal columns: locked ones, those with known images, the next block.
    basis: Vec<f64>,
    /// M times the next block.
    mass: Vec<f64>,
    /// θ of the locked columns.
    locked: Vec<f64>,
    /// Active columns whose images are known, and T between them and the next block.
    done: usize,
    t: Mat<f64>,
    /// The last image beyond the basis: next block = image, `[next, last block]`.
    beyond: Mat<f64>,
    solves: usize,
    /// Random columns drawn so far.
    drawn: u64,
    /// Blocks taken since the basis was last filled up because it was invariant.
    since: usize,
    /// θ of the goal when that last happened.
    before: Vec<f64>,
}

/// Collective: the pairs of the goal, in a space orthogonal to `deflated`, which has orthonormal columns. `progress`
/// is told converged and wanted.
pub(super) fn run(
    pencil: &dyn Pencil,
    shifted: &mut dyn Shifted,
    deflated: MatRef<'_, f64>,
    goal: Goal,
    sizes: Sizes,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<ConvergedPairs> {
    let n = pencil.n_local();
    let room = pencil.order() as usize - deflated.ncols();
    let block = sizes.block.clamp(1, room.max(1));
    let mut subspace = sizes.subspace.max(goal.count() + 2 * block).max(3 * block);
    let mut lanczos = Lanczos {
        pencil,
        shifted,
        deflated,
        n,
        basis: Vec::with_capacity(n * (subspace + 2 * block).min(room + block)),
        mass: Vec::new(),
        locked: Vec::new(),
        done: 0,
        t: Mat::new(),
        beyond: Mat::new(),
        solves: 0,
        drawn: 0,
        since: SETTLED,
        before: Vec::new(),
    };
    lanczos.refill(block)?;
    let mut restarts = 0;
    loop {
        let width = lanczos.width();
        if width > 0 {
            lanczos.expand(block)?;
        }
        let all = lanczos.width() == 0;
        let full = all || lanczos.dimension() + block > subspace;
        let enough = lanczos.locked.len() + lanczos.done >= goal.count();
        if !full && !enough {
            progress(lanczos.locked.len(), goal.count());
            continue;
        }
        let ritz = lanczos.ritz()?;
        let (reached, converged) = lanczos.reached(&ritz, goal);
        progress(converged.min(goal.count()), goal.count());
        if all || reached && lanczos.settled(&ritz, goal) {
            return Ok(lanczos.finish(ritz, restarts));
        }
        if full {
            // Unwanted pairs of the other side that are nearer to the shift need room too.
            let span = lanczos.span(&ritz, goal);
            if span + 4 * block > subspace {
                subspace = span + 6 * block;
                continue;
            }
            if restarts == MAX_RESTARTS {
                return Err(Error::NotConverged(format!(
                    "only {converged} of {} modes converged in {restarts} restarts of a basis of {subspace} \
                     columns; ask for fewer modes",
                    goal.count()
                )));
            }
            restarts += 1;
            lanczos.restart(&ritz, span, subspace, block);
        }
    }
}

impl Lanczos<'_> {
    /// Columns of the basis.
    fn dimension(&self) -> usize {
        self.locked.len() + self.t.nrows()
    }

    /// Columns of the next block.
    fn width(&self) -> usize {
        self.t.nrows() - self.done
    }

    /// Collective: brings the next block to `block` columns with random ones, softened by the operator, as far as
    /// there are any.
    fn refill(&mut self, block: usize) -> Result<()> {
        let (n, world) = (self.n, self.pencil.world());
        // Near an eigenvalue all images are along its vectors; once those are in the basis there are others.
        for _ in 0..3 {
            let room = (self.pencil.order() as usize).saturating_sub(self.deflated.ncols() + self.dimension());
            let missing = block.saturating_sub(self.width()).min(room);
            if missing == 0 {
                break;
            }
            let first = world.all_gather(&[n as u64])[..world.rank].iter().sum();
            let (mut x, mut w) = (vec![0.0; n * missing], vec![0.0; n * missing]);
            for j in 0..missing {
                random(first, self.drawn + j as u64, &mut x[j * n..(j + 1) * n]);
            }
            self.drawn += missing as u64;
            let dimension = self.dimension();
            let against = OrthonormalBlocks { deflated: self.deflated, basis: columns(&self.basis, n, dimension) };
            self.pencil.mass(&x, &mut w, missing);
            against.project_out(world, &mut x, &w, missing);
            self.pencil.mass(&x, &mut w, missing);
            self.shifted.solve(&mut w, missing)?;
            self.solves += missing;
            self.pencil.mass(&w, &mut x, missing);
            let inner = gram(world, columns(&w, n, missing), columns(&x, n, missing));
            let sizes: Vec<f64> = (0..missing).map(|j| inner[(j, j)].max(0.0).sqrt()).collect();
            let new = orthonormalise(self.pencil, &against, &mut w, &mut x, &sizes);
            self.append(&w, &x, new.rank);
        }
        Ok(())
    }

    /// Adds `count` orthonormal columns, and M times them, to the next block.
    fn append(&mut self, w: &[f64], mass: &[f64], count: usize) {
        self.basis.extend_from_slice(w);
        self.mass.extend_from_slice(mass);
        let size = self.t.nrows() + count;
        self.t.resize_with(size, size, |_, _| 0.0);
        self.beyond.resize_with(self.beyond.nrows() + count, self.beyond.ncols(), |_, _| 0.0);
    }

    /// Collective: takes the image of the next block into T; what it has beyond the basis is the block after it.
    fn expand(&mut self, block: usize) -> Result<()> {
        let (n, p, world) = (self.n, self.width(), self.pencil.world());
        let (locked, done) = (self.locked.len(), self.done);
        let mut w = self.mass.clone();
        self.shifted.solve(&mut w, p)?;
        self.solves += p;
        // What the recurrence knows: the coupling to the blocks before, and the image's part in its own block.
        let own = gram(world, columns(&self.mass, n, p), columns(&w, n, p));
        for j in 0..p {
            (0..p).for_each(|i| self.t[(done + i, done + j)] = own[(i, j)]);
        }
        let size = done + p;
        let begin = (0..done).find(|&i| (0..p).any(|j| self.t[(i, done + j)] != 0.0)).unwrap_or(done);
        let known = self.t.get(begin..size, done..size);
        let active = columns(&self.basis, n, locked + size).subcols(locked + begin, size - begin);
        subtract(&mut w, active, known);
        let lengths: Vec<f64> = (0..p).map(|j| known.col(j).norm_l2()).collect();
        let against = OrthonormalBlocks { deflated: self.deflated, basis: columns(&self.basis, n, locked + size) };
        let mut mass = std::mem::take(&mut self.mass);
        let new = orthonormalise(self.pencil, &against, &mut w, &mut mass, &lengths);
        for j in 0..p {
            (0..size).for_each(|i| self.t[(i, done + j)] += new.taken[(locked + i, j)]);
        }
        // The operator is symmetric; its rounding errors are not.
        for j in 0..p {
            (0..done).for_each(|i| self.t[(done + j, i)] = self.t[(i, done + j)]);
            for i in 0..j {
                let mean = 0.5 * (self.t[(done + i, done + j)] + self.t[(done + j, done + i)]);
                (self.t[(done + i, done + j)], self.t[(done + j, done + i)]) = (mean, mean);
            }
        }
        self.done = size;
        self.beyond = Mat::zeros(0, p);
        self.append(&w, &mass, new.rank);
        self.beyond = new.factors;
        for i in 0..new.rank {
            for j in 0..p {
                self.t[(done + j, size + i)] = self.beyond[(i, j)];
                self.t[(size + i, done + j)] = self.beyond[(i, j)];
            }
        }
        self.since += 1;
        if self.width() < block {
            self.refill(block)?;
            self.since = 0;
        }
        Ok(())
    }

    /// Ritz pairs of the active columns, with the length of what their images have beyond the basis.
    fn ritz(&self) -> Result<Ritz> {
        let (size, last) = (self.done, self.beyond.ncols());
        let failed = || Error::NotConverged(format!("eigenvalues of the projected matrix of order {size}"));
        let (values, vectors) = symmetric_eigen(self.t.get(..size, ..size)).ok_or_else(failed)?;
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| values[b].abs().total_cmp(&values[a].abs()));
        let vectors = Mat::from_fn(size, size, |i, j| vectors[(i, order[j])]);
        let theta: Vec<f64> = order.iter().map(|&i| values[i]).collect();
        let rest = &self.beyond * vectors.subrows(size - last, last);
        let residual = (0..size).map(|j| rest.col(j).norm_l2() / theta[j].abs().max(f64::MIN_POSITIVE)).collect();
        Ok(Ritz { theta, vectors, residual })
    }

    /// Returns whether the goal is reached, and how many pairs that belong to it have converged.
    fn reached(&self, ritz: &Ritz, goal: Goal) -> (bool, usize) {
        let all = || self.locked.iter().map(|t| (*t, true)).chain(ritz.converged());
        match goal {
            Goal::Nearest(count) => {
                let leading = all().take_while(|p| p.1).count();
                (leading >= count, leading)
            }
            Goal::Sides(below, above) => {
                let left = all().filter(|p| p.0 < 0.0).take_while(|p| p.1).count();
                let right = all().filter(|p| p.0 > 0.0).take_while(|p| p.1).count();
                (left >= below && right >= above, left.min(below) + right.min(above))
            }
        }
    }

    /// Returns whether the pairs are those of the whole space: where the basis was invariant, what is beside it shows
    /// in some blocks from new columns, or in that a further invariant basis has the same pairs.
    fn settled(&mut self, ritz: &Ritz, goal: Goal) -> bool {
        if self.since > 0 {
            return self.since >= SETTLED;
        }
        let now: Vec<f64> = self.locked.iter().chain(&ritz.theta).copied().take(goal.count()).collect();
        let same = now.len() == self.before.len()
            && now.iter().zip(&self.before).all(|(a, b)| (a - b).abs() <= TOLERANCE * a.abs());
        self.before = now;
        same
    }

    /// How many pairs by falling |θ| hold those of the goal, as far as their Ritz values are there.
    fn span(&self, ritz: &Ritz, goal: Goal) -> usize {
        let Goal::Sides(mut below, mut above) = goal else { return goal.count() };
        let mut all = self.locked.iter().chain(&ritz.theta);
        let last = all.position(|theta| {
            let side = if *theta < 0.0 { &mut below } else { &mut above };
            *side = side.saturating_sub(1);
            below + above == 0
        });
        last.map_or(goal.count(), |i| i + 1)
    }

    /// Replaces the active columns by the best Ritz vectors and locks those that have converged.
    fn restart(&mut self, ritz: &Ritz, span: usize, subspace: usize, block: usize) {
        let (n, old, width) = (self.n, self.locked.len(), self.width());
        let leading = ritz.residual.iter().take_while(|r| **r <= LOCKED).count();
        let apart = |i: &usize| {
            *i == 0 || *i >= ritz.theta.len() || {
                let (a, b) = (ritz.theta[*i - 1], ritz.theta[*i]);
                (a - b).abs() > CLUSTER * a.abs()
            }
        };
        let lock = (0..=leading).rev().find(apart).unwrap_or(0);
        let wanted = span.saturating_sub(old);
        let room = (subspace - old).saturating_sub(2 * block + width);
        let keep = (wanted + (ritz.theta.len().saturating_sub(wanted)) / 2)
            .max(lock)
            .min(room.max(lock))
            .min(ritz.theta.len());
        let s = ritz.vectors.subcols(0, keep);
        let last = self.beyond.ncols();
        let coupling = &self.beyond * s.subrows(self.done - last, last);
        combine(&mut self.basis[old * n..(old + self.done) * n], n, s);
        // The next block moves up behind them.
        let next = (old + self.done) * n;
        self.basis.copy_within(next..next + width * n, (old + keep) * n);
        self.basis.truncate((old + keep + width) * n);
        self.locked.extend(&ritz.theta[..lock]);
        let active = keep - lock;
        let mut t = Mat::zeros(active + width, active + width);
        for j in 0..active {
            t[(j, j)] = ritz.theta[lock + j];
            for i in 0..width {
                t[(active + i, j)] = coupling[(i, lock + j)];
                t[(j, active + i)] = coupling[(i, lock + j)];
            }
        }
        (self.t, self.done) = (t, active);
    }

    /// The pairs converged so far, as far as no unconverged one is nearer to the shift on the same side. An image
    /// over θ is a better vector than the Ritz vector itself, and what it has beyond the basis is known.
    fn finish(mut self, ritz: Ritz, restarts: usize) -> ConvergedPairs {
        let (n, old, size, width) = (self.n, self.locked.len(), self.done, self.width());
        let mut open = [false; 2];
        let mut kept = Vec::new();
        for (i, (theta, converged)) in ritz.converged().enumerate() {
            let side = usize::from(theta > 0.0);
            open[side] |= !converged;
            if !open[side] {
                kept.push(i);
            }
        }
        let last = self.beyond.ncols();
        let beyond = &self.beyond * ritz.vectors.subrows(size - last, last);
        let s = Mat::from_fn(size + width, kept.len(), |i, j| match i < size {
            true => ritz.vectors[(i, kept[j])],
            false => beyond[(i - size, kept[j])] / ritz.theta[kept[j]],
        });
        combine(&mut self.basis[old * n..], n, s.as_ref());
        self.basis.truncate((old + kept.len()) * n);
        self.basis.shrink_to_fit();
        let mut theta = self.locked;
        theta.extend(kept.iter().map(|&i| ritz.theta[i]));
        ConvergedPairs { theta, vectors: self.basis, restarts, solves: self.solves }
    }
}
