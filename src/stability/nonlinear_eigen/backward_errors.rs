//! Backward errors in the pencil of all unknowns, which is not made for them: what it has beside the bodies
//! themselves is a matrix of the rank of the functions that the contact sees, whose amplitudes in the modes are of
//! norm 1 and at right angles to each other.

use super::modal_compliance::{real_times, ModalCompliance};
use super::{ContactRows, C};
use crate::model::CoupledModel;
use faer::Mat;

/// The pencil in its own units, as [`assemble`](crate::stability::reduced::assemble) has them.
pub(super) struct BackwardErrors {
    /// Unit of time is 1/`rate`, rad/s.
    pub rate: f64,
    /// Unit of the unknowns of the contact, N.
    pub force: f64,
    /// Divisors of the rows of the contact.
    rows: Vec<f64>,
    /// Norms of both matrices.
    norms: [f64; 2],
}

/// Vectors x = (q, λq, f) of the pencil as the contact sees them, one for each eigenvalue.
pub(super) struct Vectors<'a> {
    /// λ, 1/s.
    pub values: &'a [C],
    /// Motion Bq, `[r, values]`.
    pub motions: &'a Mat<C>,
    /// Unknowns f of the contact, `[nf, values]`.
    pub own: &'a Mat<C>,
    /// Squares of the norms of q.
    pub squares: &'a [f64],
}

impl BackwardErrors {
    /// Error bounds of these modes under the `rows` of the contact.
    pub fn new(modes: &ModalCompliance, rows: &ContactRows) -> Self {
        let (m, r, nf) = (modes.count(), modes.rank, rows.by_rate.nrows());
        let square = |of: &dyn Fn(usize, usize) -> f64, columns: usize, count: usize| {
            (0..columns).map(|j| (0..count).map(|i| of(i, j).powi(2)).sum::<f64>()).sum::<f64>()
        };
        let forces = |i: usize, j: usize| rows.forces[(i, j)];
        let by_own = |i: usize, j: usize| rows.forces[(i, r + j)];
        // ‖K − Bᵀ G B‖².
        let shared: f64 = (0..r).map(|j| (0..r).map(|i| forces(i, j) * modes.stiffness[(i, j)]).sum::<f64>()).sum();
        let stiffness = (modes.squares[0] - 2.0 * shared + square(&forces, r, r)).max(0.0).sqrt();
        let mean = stiffness / (m.max(1) as f64).sqrt();
        let rate = if mean > 0.0 { mean.sqrt() } else { 1.0 };
        let coupling = square(&by_own, nf, r).sqrt();
        let reach = coupling / (nf.max(1) as f64).sqrt();
        let force = if reach > 0.0 { rate * rate / reach } else { 1.0 };
        // Each row of the contact with its largest entry and the square of its norm in both matrices.
        let mut norms = [
            m as f64
                + (stiffness / (rate * rate)).powi(2)
                + modes.squares[1] / (rate * rate)
                + (force * coupling / (rate * rate)).powi(2),
            2.0 * m as f64,
        ];
        let full = [(&rows.at_rest, 1.0), (&rows.by_rate, rate)]
            .map(|(of, unit)| modes.on_modes(&(faer::Scale(unit) * of.as_ref().subcols(0, r))));
        // Column by column, as they lie in memory.
        let mut by_modes = vec![0.0f64; nf];
        for column in full.iter().flat_map(|f| (0..m).map(|j| f.col_as_slice(j))) {
            by_modes.iter_mut().zip(column).for_each(|(largest, v)| *largest = largest.max(v.abs()));
        }
        let of = |i: usize| {
            let mut largest = by_modes[i];
            let mut squares = [0.0; 2];
            for j in 0..r {
                squares[0] += rows.at_rest[(i, j)].powi(2) + (rate * rows.by_rate[(i, j)]).powi(2);
            }
            for j in r..r + nf {
                let both = [force * rows.at_rest[(i, j)], force * rate * rows.by_rate[(i, j)]];
                for (square, v) in squares.iter_mut().zip(both) {
                    largest = f64::max(largest, v.abs());
                    *square += v * v;
                }
            }
            norms.iter_mut().zip(squares).for_each(|(n, s)| *n += s / (largest * largest));
            largest
        };
        let rows = (0..nf).map(of).collect();
        Self { rate, force, rows, norms: norms.map(f64::sqrt) }
    }

    #[cfg(test)]
    pub fn norms(&self) -> [f64; 2] {
        self.norms
    }

    /// Backward errors of eigenvalues with their vectors, where q is the motion of the modes under the forces Bᵀφ;
    /// `forces` has φ for each.
    pub fn errors(&self, rows: &ContactRows, x: &Vectors<'_>, forces: &[Vec<C>]) -> Vec<f64> {
        let r = x.motions.nrows();
        let made = self.forces(rows, x);
        let left = |l: usize| (0..r).map(|i| (forces[l][i] - made[(i, l)]).norm_sqr()).sum::<f64>();
        self.of_modes(rows, x, (0..x.values.len()).map(left))
    }

    /// The same of the vectors with the amplitudes `q` of the modes of `bodies`, `[m, values]`, whatever made these.
    pub fn whole_errors(
        &self,
        (modes, bodies): (&ModalCompliance, &CoupledModel),
        rows: &ContactRows,
        x: &Vectors<'_>,
        q: &Mat<C>,
    ) -> Vec<f64> {
        let (m, count) = (q.nrows(), q.ncols());
        let parts = Mat::from_fn(m, 2 * count, |i, j| if j < count { q[(i, j)].re } else { q[(i, j - count)].im });
        let [stiff, damped] = [&bodies.stiffness, &bodies.damping].map(|of| of.product(parts.as_ref()));
        let pushed = modes.on_modes_of(&self.forces(rows, x));
        let left = |l: usize| {
            let lambda = x.values[l];
            let at = |of: &Mat<f64>, i: usize| C::new(of[(i, l)], of[(i, count + l)]);
            let row = |i: usize| at(&stiff, i) + lambda * (at(&damped, i) + lambda * q[(i, l)]) - pushed[(i, l)];
            (0..m).map(|i| row(i).norm_sqr()).sum::<f64>()
        };
        self.of_modes(rows, x, (0..count).map(left))
    }

    /// Forces of the contact on the functions, `[r, values]`.
    fn forces(&self, rows: &ContactRows, x: &Vectors<'_>) -> Mat<C> {
        let (r, nf) = (x.motions.nrows(), x.own.nrows());
        let part = |first: usize, count: usize| rows.forces.as_ref().subcols(first, count).to_owned();
        real_times(&part(0, r), x.motions) + real_times(&part(r, nf), x.own)
    }

    /// Backward errors by what is left in the rows of the modes, squares of norms.
    fn of_modes(&self, rows: &ContactRows, x: &Vectors<'_>, left: impl Iterator<Item = f64>) -> Vec<f64> {
        let (r, nf) = (x.motions.nrows(), x.own.nrows());
        // The rows of the contact, those by the rate below those at rest.
        let both = |first: usize, count: usize| {
            Mat::from_fn(2 * nf, count, |i, j| match i < nf {
                true => rows.at_rest[(i, first + j)],
                false => rows.by_rate[(i - nf, first + j)],
            })
        };
        let images = real_times(&both(0, r), x.motions) + real_times(&both(r, nf), x.own);
        let of = |(l, left): (usize, f64)| {
            let lambda = x.values[l];
            let row = |i: usize| (images[(i, l)] + lambda * images[(nf + i, l)]) / self.rows[i];
            let residual = left / self.rate.powi(4) + (0..nf).map(|i| row(i).norm_sqr()).sum::<f64>();
            let scaled = lambda.norm() / self.rate;
            let own: f64 = (0..nf).map(|i| x.own[(i, l)].norm_sqr()).sum();
            let norm = x.squares[l] * (1.0 + scaled * scaled) + own / self.force.powi(2);
            residual.sqrt() / ((self.norms[0] + scaled * self.norms[1]) * norm.sqrt())
        };
        left.enumerate().map(of).collect()
    }
}
