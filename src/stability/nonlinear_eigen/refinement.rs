//! Eigenpairs with the contact at the eigenvalue itself, from those that its polynomials give nearly.
//!
//! Newton's method for λ and the forces φ on the functions,
//!
//! (K(λ) G(λ) − 1) φ = 0,   φ₀ᴴ (φ − φ₀) = 0,
//!
//! with the residual of the contact itself and the Jacobian of the polynomials. The residual needs K for the single
//! motion Gφ, not for all r. Each step reduces the error by the relative error of the polynomials.

use super::dense_lu::DenseLu;
use super::{NonlinearEigenproblem, APART, C, COARSE};
use faer::Mat;

/// Steps at the most.
const STEPS: usize = 6;
/// How far an eigenvalue may go altogether, over its size.
const NEAR: f64 = 1e-3;
/// Largest relative change of λ and φ in the last step, which leaves [`COARSE`] of it: rounding.
const LAST: f64 = 1e-13 / COARSE;

/// Eigenvalues with Im > 0, and what the functions do there.
pub(super) struct RefinedPairs {
    pub roots: Vec<C>,
    /// Forces φ on the functions, of norm 1.
    pub forces: Vec<Vec<C>>,
    /// Motions Gφ under these, `[r, roots]`.
    pub motions: Mat<C>,
}

impl NonlinearEigenproblem<'_> {
    /// Eigenpairs near `roots` of the polynomials; none where one does not settle there, or two become one.
    pub(super) fn refined(&self, roots: &[C]) -> Option<RefinedPairs> {
        let r = self.modes.rank;
        let (mut forces, _) = self.forces(roots);
        let mut refined = roots.to_vec();
        for _ in 0..STEPS {
            let ([g, by_g], _) = self.modes.compliances(&refined);
            let [k, by_k] = self.along.stiffnesses(&refined);
            let motions = moved(&g, &forces);
            let made = self.contact.forces_under(&refined, &motions);
            let mut largest = 0.0f64;
            for (l, force) in forces.iter_mut().enumerate() {
                let of = |of: &[C]| of[l * r * r..(l + 1) * r * r].to_vec();
                let step = self.newton_step([&of(&k), &of(&g)], [&of(&by_k), &of(&by_g)], force, made.col_as_slice(l));
                let (by_lambda, by_force) = step.split_last()?;
                force.iter_mut().zip(by_force).for_each(|(f, d)| *f += d);
                refined[l] += by_lambda;
                let size = force.iter().map(C::norm_sqr).sum::<f64>().sqrt();
                force.iter_mut().for_each(|f| *f /= size);
                let turned = by_force.iter().map(C::norm_sqr).sum::<f64>().sqrt();
                largest = largest.max(turned).max(by_lambda.norm() / refined[l].norm());
            }
            let strayed = |(v, from): (&C, &C)| !((v - from).norm() <= NEAR * from.norm());
            if refined.iter().zip(roots).any(strayed) {
                return None;
            }
            if largest <= LAST {
                let met = |i: usize| refined[..i].iter().any(|v| (v - refined[i]).norm() <= APART * v.norm());
                if (0..refined.len()).any(met) {
                    return None;
                }
                let motions = moved(&self.modes.compliance(&refined), &forces);
                return Some(RefinedPairs { roots: refined, forces, motions });
            }
        }
        None
    }

    /// Changes of φ and then of λ, `[r + 1]`, by K and G, their derivatives, and the forces that the contact `made` of
    /// the motion under φ.
    fn newton_step(&self, [k, g]: [&[C]; 2], [by_k, by_g]: [&[C]; 2], force: &[C], made: &[C]) -> Vec<C> {
        let r = self.modes.rank;
        let matrix = self.matrix(k, g);
        let mut change = vec![C::default(); r * r];
        self.modes.add_product(by_k, g, &mut change);
        self.modes.add_product(k, by_g, &mut change);
        let by_lambda = |i: usize| (0..r).map(|j| change[j * r + i] * force[j]).sum::<C>();
        let entry = |i: usize, j: usize| match (i < r, j < r) {
            (true, true) => matrix[j * r + i],
            (true, false) => by_lambda(i),
            (false, true) => force[j].conj(),
            (false, false) => C::default(),
        };
        let n = r + 1;
        let residual = (0..r).map(|i| force[i] - made[i]).chain([C::default()]).collect::<Vec<C>>();
        DenseLu::new((0..n * n).map(|e| entry(e / n, e % n)).collect(), n).solve(&residual)
    }
}

/// Motions of the functions under `forces` with G of each, `[r²]`, by columns one after the other.
pub(super) fn moved(g: &[C], forces: &[Vec<C>]) -> Mat<C> {
    let r = forces.first().map_or(0, Vec::len);
    Mat::from_fn(r, forces.len(), |i, l| (0..r).map(|j| g[(l * r + j) * r + i] * forces[l][j]).sum::<C>())
}
