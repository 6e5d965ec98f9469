//! Finite elements: elements, forms, degrees of freedom, distributed assembly, stress recovery.

pub mod assembly;
pub mod dofs;
pub(crate) mod element;
pub mod forms;
pub mod rotation;
pub mod stress;
pub mod surface;

/// Isotropic linear elastic material.
///
/// ```
/// use railsqueal::fem::ElasticMaterial;
///
/// let steel = ElasticMaterial { young: 210e9, poisson: 0.3, density: 7850.0 };
/// let (lambda, mu) = steel.lame();
/// assert!((mu - 80.77e9).abs() < 1e7 && (lambda - 121.15e9).abs() < 1e7);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticMaterial {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m³.
    pub density: f64,
}

impl ElasticMaterial {
    /// Lamé's constants λ, μ, Pa.
    pub fn lame(&self) -> (f64, f64) {
        let (e, nu) = (self.young, self.poisson);
        (e * nu / ((1. + nu) * (1. - 2. * nu)), e / (2. * (1. + nu)))
    }

    /// Shear modulus, Pa.
    pub fn shear(&self) -> f64 {
        self.lame().1
    }
}
