//! The energy balance: what is stored, what went where, and what the discretisation lost.
//!
//! Over a step the mean reactions R_θ do the work R_θ·Δy on the bodies. With the slip d of the particle over the step
//! (its creep times h) that is, tangentially, t·Δw = t·d − t·(hc + w − w_foot): friction takes −t·d, and the drive
//! gives −t·(hc + w − w_foot), which is −∫ t·(c + V ∂w/∂x). Of that the part −V ∫ p ∂x g0 is the work of the rolling
//! moment.

/// Energies stored (J) and works since the start (J).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Kinetic energy of the modes.
    pub kinetic: f64,
    /// Elastic energy of the modes and of the residual compliance, ½ qᵀΩ²q + ½ RᵀSR.
    pub elastic: f64,
    /// Dissipated by friction.
    pub friction: f64,
    /// Dissipated by damping.
    pub damping: f64,
    /// Lost in impacts.
    pub impact: f64,
    /// Done by the drive: creepages, approach or load, loads on the bodies, the axles of bodies that rotate.
    pub drive: f64,
    /// The part of it that the rolling moment does.
    pub rolling: f64,
    /// Kinetic and elastic energy at the start; of a start that has settled, so that its first step is balanced.
    pub start: f64,
}

impl Energy {
    /// Energy gained by the discretisation: stored + dissipated − supplied, J. Zero for the exact motion; with θ = ½
    /// all there is comes from contacts that open or close within a step.
    pub fn residual(&self) -> f64 {
        self.kinetic + self.elastic - self.start + self.friction + self.damping + self.impact - self.drive
    }
}
