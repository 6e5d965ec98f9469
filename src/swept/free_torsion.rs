//! Statics of order 0 of a body that is free to turn about its axle: a wheelset whose bearings exert no torque.
//!
//! The rigid torsion φ = (0, r, 0)/√I_p takes no part: u = K⁺f is M-orthogonal to φ. The load without its torque, f
//! − Mφ φᵀf, is borne by K + sM with a shift s far below all elastic eigenvalues. Further rounds, with sMu on the
//! right side, leave powers of s/ω² of the error.

use super::skyline_ldlt::SkylineFactor;
use super::{Forms, Path};
use crate::Result;
use faer::{Mat, MatRef};

/// Shift over that of the modes.
const ALMOST_FREE: f64 = 1e-6;
/// Rounds of the solution.
const ROUNDS: usize = 3;

impl Forms {
    /// Returns whether nothing but the inertia resists a torsion of the whole body: it is held by bearings alone.
    pub(crate) fn turns_freely(&self) -> bool {
        let clamped = (0..self.section.nodes.len()).any(|k| self.amplitude(k).is_none());
        self.path == Path::Axle
            && self.bearings().next().is_some()
            && !clamped
            && self.track(0, empty(self).as_ref()).is_none()
    }

    /// The factor of K_0 + sM for [`Forms::solve_free`], in the `memory` of another one.
    pub(crate) fn factor_free(&self, memory: Vec<f64>) -> Result<SkylineFactor> {
        self.factor_in(memory, 0, ALMOST_FREE * self.shift())?.positive("the statics of order 0 of a body on bearings")
    }

    /// K_0⁺ f of columns, `[order, k]`, without the rigid torsion, with the `factor` of [`Forms::factor_free`].
    pub(crate) fn solve_free(&self, factor: &SkylineFactor, loads: MatRef<'_, f64>) -> Mat<f64> {
        let mut torsion = Mat::<f64>::zeros(self.order(), 1);
        for (node, [r, _]) in self.section.nodes.iter().enumerate() {
            if let Some(first) = self.amplitude(node) {
                torsion[(first + 1, 0)] = *r;
            }
        }
        let inertia = self.mass(0, torsion.as_ref());
        let polar = (torsion.transpose() * &inertia)[(0, 0)];
        let balanced = loads - &inertia * (torsion.transpose() * loads) * faer::Scale(1.0 / polar);
        let shift = -ALMOST_FREE * self.shift();
        let mut u = Mat::<f64>::zeros(self.order(), loads.ncols());
        for _ in 0..ROUNDS {
            u = factor.solve((&balanced + faer::Scale(shift) * self.mass(0, u.as_ref())).as_ref());
            let turned = inertia.transpose() * &u;
            u -= &torsion * turned * faer::Scale(1.0 / polar);
        }
        u
    }
}

/// No columns of amplitudes.
fn empty(forms: &Forms) -> Mat<f64> {
    Mat::zeros(forms.order(), 0)
}
