//! The transposed system, whose eigenvectors are the conjugate left vectors yᵀ: its products, and those vectors.
//!
//! Without friction and rotation the system is symmetric but for the sign of the pressures, so that the right vectors
//! around a shift span a space in which the left ones nearly lie. What is missing is corrected by inverse iteration
//! with the residuals.

use super::pairs::FullEigenpair;
use super::system::System;
use crate::eigen::projection::Projection;
use crate::eigen::quadratic::{sizes, Quadratic};
use crate::parallel::World;
use crate::Result;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Change of a left vector by one more inverse iteration after which it is not improved any more.
const UNCHANGED: f64 = 1e-9;
/// Corrections at the most; what is left then is SLEPc's.
const ROUNDS: usize = 12;

/// The transposed system as a problem of its own.
struct Transposed<'s, 'a>(&'s mut System<'a>);

impl Quadratic for Transposed<'_, '_> {
    fn world(&self) -> &World {
        self.0.world
    }

    fn n_local(&self) -> usize {
        Quadratic::n_local(self.0)
    }

    fn multiply(&mut self, power: usize, x: &[C], y: &mut [C], columns: usize) -> Result<()> {
        self.0.transposed_product(power, x, y, columns);
        Ok(())
    }

    fn solve(&mut self, x: &mut [C], columns: usize) -> Result<()> {
        self.0.solve_whole(x, columns, true)
    }
}

impl System<'_> {
    /// Collective: out = Aᵀ x with the matrix A of this power of λ, of each of the `columns` vectors.
    pub(super) fn transposed_product(&self, power: usize, x: &[C], out: &mut [C], columns: usize) {
        let n = x.len() / columns.max(1);
        let unit = self.unit(power);
        out.fill(C::default());
        for part in &self.parts {
            let image = part.multiply_transposed(self.world, power, &part.reals(x, n));
            image.add_to(C::from(unit), out, n, part.first);
        }
        if power > 1 {
            return;
        }
        let (first, closed) = (self.pressures(), self.coupling.closed());
        for (x, out) in x.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
            let z = self.motion(x);
            let rows: Vec<C> = self.multipliers(x, 0, closed + self.coupling.remembering());
            let rows: Vec<C> = rows.iter().map(|r| r / self.stiffness).collect();
            let (r, f) = rows.split_at(closed);
            let image = self.matrices().transposed(power, (&z, r, f), [unit, self.stiffness, self.rate]);
            self.add_forces(&image.motion, 1.0, out);
            if self.world.is_root() {
                let own = image.pressures.iter().chain(&image.friction);
                out[first..].iter_mut().zip(own).for_each(|(o, v)| *o += v);
            } else if first == 0 && power == 0 {
                out[0] = x[0];
            }
        }
    }

    /// Collective: P(σ)ᵀ x at the shift of each of the `columns` vectors.
    pub(super) fn transposed_rest(&self, x: &[C], columns: usize) -> Vec<C> {
        let mut sum = vec![C::default(); x.len()];
        let mut product = vec![C::default(); x.len()];
        for power in 0..3 {
            self.transposed_product(power, x, &mut product, columns);
            let factor = (self.sigma / self.rate).powu(power as u32);
            sum.iter_mut().zip(&product).for_each(|(s, p)| *s += factor * p);
        }
        sum
    }

    /// Collective: left vectors y (yᴴ P(λ) = 0, local rows) of the pairs `which` of those `found` around the shift,
    /// as exactly as a few corrections make them.
    pub(super) fn left_vectors(&mut self, found: &[FullEigenpair], which: &[usize]) -> Result<Vec<Vec<C>>> {
        let (n, first, closed) = (Quadratic::n_local(self), self.pressures(), self.coupling.closed());
        let guess = |pair: &FullEigenpair| {
            let mut x = pair.vector.clone();
            if self.world.is_root() {
                x[first..first + closed].iter_mut().for_each(|r| *r = -*r);
                x[first + closed..].fill(C::default());
            }
            x
        };
        let guesses: Vec<Vec<C>> = found.iter().map(guess).collect();
        let target = self.sigma / self.rate;
        let known: Vec<C> = which.iter().map(|&i| found[i].value / self.rate).collect();
        let mut transposed = Transposed(self);
        let mut space = Projection::new(&mut transposed, guesses)?;
        let mut round = 0;
        loop {
            let world = transposed.0.world;
            let (values, coordinates) = space.pairs(world, target, &known)?;
            let vectors = space.vectors(coordinates.as_ref());
            let mut changes = space.residuals(&values, coordinates.as_ref());
            transposed.solve(&mut changes, known.len())?;
            let left = sizes(world, &changes, n)
                .iter()
                .zip(sizes(world, &vectors, n))
                .map(|(c, x)| c / x)
                .collect::<Vec<f64>>();
            let open: Vec<usize> = (0..known.len()).filter(|&i| !(left[i] <= UNCHANGED)).collect();
            if open.is_empty() || round == ROUNDS {
                return Ok(vectors.chunks_exact(n).map(|x| x.iter().map(C::conj).collect()).collect());
            }
            let some: Vec<C> = open.iter().flat_map(|&i| changes[i * n..(i + 1) * n].iter().copied()).collect();
            let own = Mat::from_fn(coordinates.nrows(), known.len(), |i, j| coordinates[(i, j)]);
            space.correct(&mut transposed, own.as_ref(), &open, &some)?;
            round += 1;
        }
    }
}
