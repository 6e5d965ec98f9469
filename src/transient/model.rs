//! The two bodies and their interface as the transient takes them.

use faer::{Mat, MatRef};

use crate::grid::Interface;
use crate::model::ModalMatrix;
use crate::model::{CoupledModel, RotationTerms};
use crate::{Error, Result};

/// Largest difference of mirrored entries of the modal matrices, relative to the largest: rounding.
pub(super) const ASYMMETRY: f64 = 1e-9;

/// How the reactions act in time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Impact {
    /// The residual compliance is positive at every contact: position law.
    Compliant,
    /// There is none: velocity law with inelastic impacts.
    Rigid,
}

/// Two bodies on an interface of n nodes: m modes and a residual compliance, rows `3*i + (x, y, n)`.
#[derive(Debug, Clone)]
pub struct Model<'a> {
    /// The interface with the gap of the undeformed bodies.
    pub interface: &'a Interface,
    /// Residual S, m/N, `[3n, 3n]`, symmetric.
    pub residual: MatRef<'a, f64>,
    /// Modes at the contact, Ψ = [Φ1, E Φ2], 1/√kg, `[3n, m]`.
    pub modes: MatRef<'a, f64>,
    /// Angular frequencies, rad/s, `[m]`; 0 for rigid-body modes.
    pub omega: &'a [f64],
    /// Modal stiffness, 1/s², symmetric of bodies at rest.
    pub stiffness: ModalMatrix,
    /// Modal damping, 1/s, symmetric of bodies at rest.
    pub damping: ModalMatrix,
    /// Terms of rotation in both.
    pub turning: Option<RotationTerms>,
    /// Rates at which a lower body that turns under the upper one carries its deformation past the contact, 1/(√kg s),
    /// `[3n, m]`; none where the material of both bodies passes alike.
    pub carried: Option<MatRef<'a, f64>>,
    /// Modal loads that are not contact forces, ΦᵀF, N/√kg, `[m]`; an empty slice for none.
    pub load: &'a [f64],
}

impl<'a> Model<'a> {
    /// A pair of bodies on its `interface`, without loads other than the contact's.
    pub fn new(pair: &'a CoupledModel, interface: &'a Interface) -> Self {
        let (residual, modes) = (pair.residual.as_ref(), pair.modes.as_ref());
        let (stiffness, damping) = (pair.stiffness.clone(), pair.damping.clone());
        let (turning, carried) = (pair.turning.clone(), pair.carried.as_ref().map(Mat::as_ref));
        Self { interface, residual, modes, omega: &pair.omega, stiffness, damping, turning, carried, load: &[] }
    }
}

impl Model<'_> {
    /// Checks the sizes and says which law of impact holds.
    pub fn impact(&self) -> Result<Impact> {
        let (n, m) = (self.interface.len(), self.omega.len());
        let fits = self.residual.shape() == (3 * n, 3 * n)
            && self.modes.shape() == (3 * n, m)
            && self.carried.is_none_or(|rates| rates.shape() == (3 * n, m))
            && self.stiffness.order() == m
            && self.damping.order() == m
            && (self.load.is_empty() || self.load.len() == m);
        if !fits {
            return Err(Error::Defect(format!(
                "transient: residual {:?}, modes {:?}, stiffness of {}, damping of {}, {} loads for {n} nodes \
                 and {m} modes",
                self.residual.shape(),
                self.modes.shape(),
                self.stiffness.order(),
                self.damping.order(),
                self.load.len()
            )));
        }
        let sound = |k: &usize| {
            let (w, c) = (self.omega[*k], self.damping.get(*k, *k));
            w >= 0.0 && c >= 0.0 && w.is_finite() && self.stiffness.get(*k, *k) >= 0.0
        };
        if let Some(k) = (0..m).find(|k| !sound(k)) {
            return Err(Error::Input(format!(
                "transient: mode {k} has the frequency {} rad/s and the damping {} 1/s; neither may be negative",
                self.omega[k],
                self.damping.get(k, k)
            )));
        }
        let matrices = [("stiffness", &self.stiffness), ("damping", &self.damping)];
        let asked = self.turning.is_none();
        if let Some(name) = matrices.iter().find(|(_, a)| asked && a.asymmetry() > ASYMMETRY) {
            return Err(Error::Input(format!(
                "analyses.transient: the {} matrix of a body is not symmetric, which the transient needs; \
                 stability takes it",
                name.0
            )));
        }
        let d = |k: usize| self.residual[(k, k)];
        // A point may have its tangential compliance in the modes alone, or apart from them.
        let free = |k: usize| self.interface.are_points() && k % 3 < 2 && d(k) >= 0.0;
        if (0..3 * n).all(|k| d(k) > 0.0 || free(k)) {
            return Ok(Impact::Compliant);
        }
        if self.turning.is_none() && (0..3 * n).all(|k| d(k) == 0.0 || free(k)) {
            return Ok(Impact::Rigid);
        }
        let k = (0..3 * n).find(|&k| !(d(k) > 0.0)).unwrap_or(0);
        Err(Error::Job(format!(
            "analyses.transient: the residual compliance of contact node {} in direction {} is {:.3e} m/N, it \
             must be positive, or zero at \
             all nodes; keep fewer modes in analyses.modes, or all of a body that is given by matrices",
            k / 3,
            ["x", "y", "n"][k % 3],
            d(k)
        )))
    }

    /// Compliance of the whole model where no mode is rigid, S + Ψ K⁻¹ Ψᵀ, m/N, `[3n, 3n]`.
    pub fn statics(&self) -> Mat<f64> {
        self.residual + self.modes * self.stiffness.statics(self.modes.transpose())
    }
}
