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
        let errors = self.errors(bodies, roots, (&forces, &motions), LOOKED_AT);
        let pair = |(&value, backward_error): (&C, f64)| Eigenpair {
            value,
            modal: Vec::new(),
            tangential: Vec::new(),
            backward_error,
        };
        let good = errors.iter().all(|e| *e <= tolerance);
        good.then(|| roots.iter().zip(errors).map(pair).collect())
    }

    /// Backward errors of `roots` with these forces on the functions and motions of them, as
    /// [`eigenvalues`](super::eigenvalues) has them.
    pub(super) fn errors(
        &self,
        bodies: &CoupledModel,
        roots: &[C],
        (forces, motions): (&[Vec<C>], &Mat<C>),
        looked_at: [usize; 2],
    ) -> Vec<f64> {
        let rows = &self.contact.rows;
        let scaled = BackwardErrors::new(&self.modes, rows);
        let own = self.contact.resolvent.expand(&self.contact.resolvent.solve_each(roots, motions));
        let squares = self.modes.least(roots, forces);
        let x = Vectors { values: roots, motions, own: &own, squares: &squares };
        let mut errors = scaled.errors(rows, &x, forces);
        let some: Vec<usize> = (0..roots.len()).filter(|l| *l < looked_at[0] || l % looked_at[1] == 0).collect();
        let (of, under): (Vec<C>, Vec<Vec<C>>) = some.iter().map(|&l| (roots[l], forces[l].clone())).unzip();
        for (&l, error) in some.iter().zip(self.lifted(bodies, &scaled, &of, &under).errors) {
            if !(error <= errors[l]) {
                errors[l] = error;
            }
        }
        errors
    }

    /// The motions of the modes under the forces on the functions of each of `roots`.
    pub(super) fn lifted(
        &self,
        bodies: &CoupledModel,
        scaled: &BackwardErrors,
        roots: &[C],
        forces: &[Vec<C>],
    ) -> Lifted {
        let modal = self.modes.motions(roots, forces);
        let motions = self.modes.motions_of(&modal);
        let own = self.contact.resolvent.expand(&self.contact.resolvent.solve_each(roots, &motions));
        let squares: Vec<f64> = modal.col_iter().map(|c| c.squared_norm_l2()).collect();
        let x = Vectors { values: roots, motions: &motions, own: &own, squares: &squares };
        let errors = scaled.whole_errors((&self.modes, bodies), &self.contact.rows, &x, &modal);
        Lifted { modal, own, squares, errors }
    }

    /// The eigenpairs of `roots`, those of conjugates too; none where one has a backward error of more than
    /// `tolerance`.
    pub(super) fn pairs(&self, bodies: &CoupledModel, roots: &[C], tolerance: f64) -> Option<Vec<Eigenpair>> {
        let scaled = BackwardErrors::new(&self.modes, &self.contact.rows);
        let (forces, _) = self.forces(roots);
        let Lifted { modal, own, squares, errors } = self.lifted(bodies, &scaled, roots, &forces);
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

/// Motions at eigenvalues.
pub(super) struct Lifted {
    /// Amplitudes q of the modes, `[m, values]`.
    pub(super) modal: Mat<C>,
    /// Unknowns of the contact, `[nf, values]`.
    pub(super) own: Mat<C>,
    /// Squares of the norms of q.
    pub(super) squares: Vec<f64>,
    pub(super) errors: Vec<f64>,
}
