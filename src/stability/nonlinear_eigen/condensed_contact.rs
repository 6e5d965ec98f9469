//! Rows of the contact, condensed to the contact functions.

use super::contact_resolvent::ContactResolvent;
use super::modal_compliance::real_times;
use super::C;
use crate::stability::reduced::{ContactRows, ScaledPencil};
use faer::Mat;

/// The contact in what it sees: rows (λ `by_rate` + `at_rest`) (y, f) = 0 and forces on y, `[r, r + nf]`.
pub(super) struct CondensedContact {
    pub(super) rows: ContactRows,
    pub(super) rank: usize,
    pub(super) resolvent: ContactResolvent,
    /// Forces on y by the f of [`ContactResolvent::solve`], `[r, nf]`.
    pub(super) projected_forces: Mat<f64>,
}

impl CondensedContact {
    pub(super) fn new(mut rows: ContactRows, rank: usize, rate: f64) -> Self {
        // Rows of one size.
        for i in 0..rows.by_rate.nrows() {
            let size = |j: usize| rows.by_rate[(i, j)].abs() * rate + rows.at_rest[(i, j)].abs();
            let largest = (0..rows.by_rate.ncols()).map(size).fold(0.0, f64::max);
            if largest > 0.0 {
                for j in 0..rows.by_rate.ncols() {
                    rows.by_rate[(i, j)] /= largest;
                    rows.at_rest[(i, j)] /= largest;
                }
            }
        }
        let resolvent = ContactResolvent::new(&rows, rank, rate);
        let projected_forces = resolvent.project(rows.forces.as_ref().subcols(rank, rows.by_rate.nrows()));
        Self { rows, rank, resolvent, projected_forces }
    }

    pub(super) fn unknowns(&self) -> usize {
        self.rows.by_rate.nrows()
    }

    /// Forces on y per y at λ, `[r, r]`.
    pub(super) fn stiffness(&self, lambda: C) -> Mat<C> {
        let r = self.rank;
        let mut k = real_times(&self.projected_forces, &self.resolvent.solve(lambda));
        for j in 0..r {
            for i in 0..r {
                k[(i, j)] += self.rows.forces[(i, j)];
            }
        }
        k
    }

    /// Forces on y under the `motions` y at each of `values`, `[r, values]`.
    pub(super) fn forces_under(&self, values: &[C], motions: &Mat<C>) -> Mat<C> {
        let own = real_times(&self.projected_forces, &self.resolvent.solve_each(values, motions));
        own + real_times(&self.rows.forces.as_ref().subcols(0, self.rank).to_owned(), motions)
    }

    /// Eigenvalues of the contact by itself, y = 0, with Im ≥ 0, whose angle is at most `angle`; none where they are
    /// not to be had.
    pub(super) fn relaxations(&self, rate: f64, angle: f64) -> Option<Vec<C>> {
        let (r, nf) = (self.rank, self.unknowns());
        let part = |of: &Mat<f64>, f: f64| Mat::from_fn(nf, nf, |i, j| f * of[(i, r + j)]);
        let pencil = ScaledPencil::scaled(part(&self.rows.at_rest, -1.0), part(&self.rows.by_rate, rate));
        let values = pencil.values().ok()?;
        Some(values.into_iter().map(|v| v * rate).filter(|v| v.im.atan2(v.re) <= angle).collect())
    }
}
