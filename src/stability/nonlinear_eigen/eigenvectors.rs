//! Eigenvectors of roots and their backward errors: motions of the modes and unknowns of the contact.

use super::backward_errors::{BackwardErrors, Vectors};
use super::refinement::moved;
use super::{NonlinearEigenproblem, C, LOOKED_AT};
use crate::model::CoupledModel;
use crate::stability::reduced::Eigenpair;
use faer::Mat;

impl NonlinearEigenproblem<'_> {
    /// Forces on the functions that an eigenvalue makes, each of norm 1, and the motion of these under them, `[r,
    /// roots]`.
    pub(super) fn forces(&self, roots: &[C]) -> (Vec<Vec<C>>, Mat<C>) {
        let r = self.modes.rank;
        let (g, k) = (self.modes.compliance(roots), self.along.stiffness(roots));
        let part = |of: &[C], l: usize| -> Vec<C> { of[l * r * r..(l + 1) * r * r].to_vec() };
        let forces: Vec<Vec<C>> = (0..roots.len()).map(|l| self.null_vector(&part(&k, l), &part(&g, l))).collect();
        let motions = moved(&g, &forces);
        (forces, motions)
    }

    /// The eigenvalues `roots` with their backward errors alone; none where one has more than `tolerance`.
    pub(super) fn values(&self, bodies: &CoupledModel, roots: &[C], tolerance: f64) -> Option<Vec<Eigenpair>> {
        let (forces, motions) = self.forces(roots);
        let squares = self.modes.least(roots, &forces);
        let some = looked_at(roots.len(), LOOKED_AT);
        let (of, under): (Vec<C>, Vec<Vec<C>>) = some.iter().map(|&l| (roots[l], forces[l].clone())).unzip();
        let modal = self.modes.motions(&of, &under);
        let errors = self.errors(bodies, roots, (&forces, &motions, &squares), (&some, modal));
        let pair = |(&value, backward_error): (&C, f64)| Eigenpair {
            value,
            modal: Vec::new(),
            tangential: Vec::new(),
            backward_error,
        };
        let good = errors.iter().all(|e| *e <= tolerance);
        good.then(|| roots.iter().zip(errors).map(pair).collect())
    }

    /// Backward errors of `roots` with these forces on the functions, motions of them, and squares of the norms of the
    /// motions of the modes, or less, as [`eigenvalues`](super::eigenvalues) has them; those of `some` roots by the
    /// amplitudes `modal` of the modes as well, `[m, some]`.
    pub(super) fn errors(
        &self,
        bodies: &CoupledModel,
        roots: &[C],
        (forces, motions, squares): (&[Vec<C>], &Mat<C>, &[f64]),
        (some, modal): (&[usize], Mat<C>),
    ) -> Vec<f64> {
        let rows = &self.contact.rows;
        let scaled = BackwardErrors::new(&self.modes, rows);
        let own = self.contact.resolvent.expand(&self.contact.resolvent.solve_each(roots, motions));
        let x = Vectors { values: roots, motions, own: &own, squares };
        let mut errors = scaled.errors(rows, &x, forces);
        let of: Vec<C> = some.iter().map(|&l| roots[l]).collect();
        for (&l, error) in some.iter().zip(self.lifted(bodies, &scaled, &of, modal).errors) {
            if !(error <= errors[l]) {
                errors[l] = error;
            }
        }
        errors
    }

    /// Response of the contact to the amplitudes `modal` of the modes at each of `roots`, `[m, roots]`.
    pub(super) fn lifted(&self, bodies: &CoupledModel, scaled: &BackwardErrors, roots: &[C], modal: Mat<C>) -> Lifted {
        let motions = self.modes.motions_of(&modal);
        let own = self.contact.resolvent.expand(&self.contact.resolvent.solve_each(roots, &motions));
        let squares = squares(&modal);
        let x = Vectors { values: roots, motions: &motions, own: &own, squares: &squares };
        let errors = scaled.whole_errors((&self.modes, bodies), &self.contact.rows, &x, &modal);
        Lifted { modal, own, squares, errors }
    }

    /// The eigenpairs of `roots`, those of conjugates too; none where one has a backward error of more than
    /// `tolerance`.
    pub(super) fn pairs(&self, bodies: &CoupledModel, roots: &[C], tolerance: f64) -> Option<Vec<Eigenpair>> {
        let scaled = BackwardErrors::new(&self.modes, &self.contact.rows);
        let (forces, _) = self.forces(roots);
        let modal = self.modes.motions(roots, &forces);
        let Lifted { modal, own, squares, errors } = self.lifted(bodies, &scaled, roots, modal);
        if errors.iter().any(|e| !(*e <= tolerance)) {
            return None;
        }
        let mut pairs = Vec::new();
        for (l, (&value, backward_error)) in roots.iter().zip(errors).enumerate() {
            let forces = own.col(l).squared_norm_l2() / scaled.force.powi(2);
            let norm = (squares[l] * (1.0 + value.norm_sqr() / scaled.rate.powi(2)) + forces).sqrt();
            let of = |x: &Mat<C>| -> Vec<C> { x.col_as_slice(l).iter().map(|v| v / norm).collect() };
            let (modal, tangential) = (of(&modal), of(&own));
            let conjugate = |v: &[C]| v.iter().map(C::conj).collect();
            let other = (conjugate(&modal), conjugate(&tangential));
            pairs.push(Eigenpair { value, modal, tangential, backward_error });
            pairs.push(Eigenpair { value: value.conj(), modal: other.0, tangential: other.1, backward_error });
        }
        Some(pairs)
    }
}

/// Numbers of those of `count` eigenvalues whose motions are looked at: the first ones, and one in each so many.
pub(super) fn looked_at(count: usize, [first, each]: [usize; 2]) -> Vec<usize> {
    (0..count).filter(|l| *l < first || l % each == 0).collect()
}

/// Squares of the norms of columns.
pub(super) fn squares(of: &Mat<C>) -> Vec<f64> {
    of.col_iter().map(|c| c.squared_norm_l2()).collect()
}

/// Motions at eigenvalues.
pub(super) struct Lifted {
    /// Amplitudes q of the modes, `[m, values]`.
    pub modal: Mat<C>,
    /// Unknowns of the contact, `[nf, values]`.
    pub own: Mat<C>,
    /// Squares of the norms of q.
    pub squares: Vec<f64>,
    pub errors: Vec<f64>,
}
