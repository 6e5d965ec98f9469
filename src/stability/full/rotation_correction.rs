//! Rotation in the full system. The inverse at a shift knows what the modes see of it. The rest is sparse, small, and
//! no matrix of low rank. Where the pairs of the nearby problem without it cannot be improved ([`super::pairs`]),
//! each solution is corrected for it.

use super::system::System;
use crate::{Error, Result};
use faer::linalg::solvers::SolveLstsq;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Allowed residual of an eigenvector after corrections: the error of a solution counts by the eigenvalue nearest to
/// the shift, of which there is most in it, and so more in those far away.
const CORRECTED: f64 = 1e-9;
/// Bounds of what they may leave of a solution.
const ACCURACY: [f64; 2] = [1e-14, 1e-11];
/// Most corrections of a solution.
const CORRECTIONS: usize = 20;

/// A column to be corrected: its Krylov space, by GMRES (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 1986).
struct Column {
    /// Its place in the block.
    place: usize,
    /// |y|.
    size: f64,
    basis: Vec<Vec<C>>,
    /// Columns of the Hessenberg matrix.
    projected: Vec<Vec<C>>,
    /// Residual after the last step, over |y|.
    left: f64,
}

impl Column {
    /// Collective: takes in `image`, the operator times the last vector of the basis; returns coordinates of the
    /// solution once no more than `accuracy` of it is left.
    fn step(&mut self, system: &System, mut image: Vec<C>, accuracy: f64) -> Option<Vec<C>> {
        let mut h = vec![C::default(); self.basis.len()];
        // The second time takes what rounding left.
        for _ in 0..2 {
            let own: Vec<C> =
                self.basis.iter().map(|v| v.iter().zip(&image).map(|(v, w)| v.conj() * w).sum()).collect();
            for ((h, g), v) in h.iter_mut().zip(system.world.sum_all(&own)).zip(&self.basis) {
                *h += g;
                image.iter_mut().zip(v).for_each(|(w, v)| *w -= g * v);
            }
        }
        let size = system.size(&image);
        h.push(C::from(size));
        self.projected.push(h);
        let k = self.projected.len();
        let matrix = Mat::from_fn(k + 1, k, |i, j| self.projected[j].get(i).copied().unwrap_or_default());
        let right = Mat::from_fn(k + 1, 1, |i, _| if i == 0 { C::from(1.0) } else { C::default() });
        let y = matrix.qr().solve_lstsq(&right);
        let rest = &right - &matrix * &y;
        let left = rest.norm_l2();
        if size > 0.0 {
            image.iter_mut().for_each(|w| *w /= size);
        }
        self.basis.push(image);
        // The operator is nearly one, so the rest is nearly its own correction: what is left then is smaller by as
        // much as this step made it.
        let done = left * (left / self.left) <= accuracy;
        self.left = left;
        done.then(|| {
            (0..=k).map(|i| self.size * (rest[(i, 0)] + if i < k { y[(i, 0)] } else { C::default() })).collect()
        })
    }
}

impl System<'_> {
    /// Solutions at the shift are corrected from now on, as exactly as eigenvalues at these `distances` from it need.
    pub(super) fn correct_solutions(&mut self, distances: &[f64]) {
        let [near, far] = [f64::min, f64::max].map(|which| distances.iter().copied().reduce(which).unwrap_or(1.0));
        let share = if far > 0.0 { near / far } else { 1.0 };
        self.accuracy = Some((CORRECTED * share).clamp(ACCURACY[0], ACCURACY[1]));
    }

    /// Collective: solves for the columns of `x` in place, with the transposed matrix where this is `transposed`.
    /// Without corrections that is the inverse P̃⁻¹ with what the modes see of the rotation; with them y = P̃⁻¹b is
    /// the right side of P̃⁻¹P x = y.
    pub(super) fn solve_whole(&mut self, x: &mut [C], columns: usize, transposed: bool) -> Result<()> {
        self.solve_seen(x, columns, transposed)?;
        let Some(accuracy) = self.accuracy else { return Ok(()) };
        let n = x.len() / columns.max(1);
        let start = |(place, y): (usize, &[C])| {
            let size = self.size(y);
            let first = y.iter().map(|v| v / size).collect();
            (size > 0.0).then(|| Column { place, size, basis: vec![first], projected: Vec::new(), left: 1.0 })
        };
        let mut open: Vec<Column> = x.chunks_exact(n).enumerate().filter_map(start).collect();
        for _ in 0..CORRECTIONS {
            let last: Vec<C> = open.iter().filter_map(|column| column.basis.last()).flatten().copied().collect();
            let mut images = match transposed {
                false => self.apply(&vec![self.sigma; open.len()], &last)?,
                true => self.transposed_rest(&last, open.len()),
            };
            self.solve_seen(&mut images, open.len(), transposed)?;
            let mut still = Vec::new();
            for (mut column, image) in open.into_iter().zip(images.chunks_exact(n)) {
                match column.step(self, image.to_vec(), accuracy) {
                    None => still.push(column),
                    Some(coordinates) => {
                        let x = &mut x[column.place * n..(column.place + 1) * n];
                        x.fill(C::default());
                        for (v, c) in column.basis.iter().zip(coordinates) {
                            x.iter_mut().zip(v).for_each(|(x, v)| *x += c * v);
                        }
                    }
                }
            }
            if still.is_empty() {
                return Ok(());
            }
            open = still;
        }
        Err(Error::NotConverged(format!(
            "stability, full system: the solution at {:.1} Hz does not take in the rotation that the modes do \
             not see: {:.1e} of it is left; \
             ask for more modes in analyses.modes",
            self.sigma.im / (2.0 * std::f64::consts::PI),
            open.iter().map(|c| c.left).fold(0.0, f64::max)
        )))
    }
}
