//! Rolling contact in time on the reduced model: modes of both bodies by a θ-method, the residual compliance of the
//! contact statically, Signorini's and Coulomb's laws at every step (`docs/explanation/transient.md`). It knows neither
//! PETSc nor MPI nor files: everything here is dense, runs on rank 0 and can be tested alone.
//!
//! Over a step h the modes obey, with u the modal amplitudes and v their velocities,
//!
//! v⁺ − v = −h (c v_θ + Ω² u_θ) + h Ψᵀ R_θ,   u⁺ = u + h v_θ,   (·)_θ = (1 − θ)(·) + θ(·)⁺
//!
//! (M. Jean, Comput. Methods Appl. Mech. Engrg. 177 (1999)). The displacements of the contact at the end of the step
//! are y⁺ = Ψ u⁺ + S R⁺ = y_free + W R⁺ with the constant symmetric positive definite W = S + θ²h² Ψ diag(1/(1 + hθ c
//! + h²θ²ω²)) Ψᵀ.
//!
//! Where S > 0 the interface is massless and compliant: the reactions are as smooth as the displacements, and the force
//! that the modes feel over a step is R_θ. (The force at the end of the step instead would treat the contact's
//! stiffness as θ = 1 does and damp a mode by h/4 times the part of its ω² that the contact contributes: more than
//! squeal grows.) Where S = 0 the reactions are impulses: R is their mean over the step, R_θ = R, and a velocity law
//! holds.
//!
//! The normal law is g⁺ ≥ 0 ⟂ p ≥ 0, or 0 ≤ ġ⁺ ⟂ p ≥ 0 at the contacts that would close where S = 0 (inelastic
//! impact). The creep of a step is taken along the particle, ṡ = (w⁺(x) − w(x − Vh))/h + c.

mod aligned;
pub(crate) mod border;
mod coupled;
pub(crate) mod cycle;
pub(crate) mod delassus;
mod departure_point;
pub(crate) mod dynamics;
pub(crate) mod energy;
mod fixed_point;
mod gauss_seidel;
pub mod loading;
pub(crate) mod low_rank_modes;
pub mod model;
mod newton;
pub(crate) mod points;
pub mod problem;
pub mod scheme;
mod split_newton;
pub mod start;
pub(crate) mod stepper;
mod structure_of_arrays;
#[cfg(test)]
mod tests;

pub use border::Border;
pub use delassus::DelassusOperator;
pub use dynamics::Dynamics;
pub use energy::Energy;
pub use loading::{DrivenMotion, History, Loading, PatchDrive, Tangential};
pub use model::Model;
pub use newton::NewtonMemory;
pub use points::PointModel;
pub use problem::{ContactSolver, Effort, StepProblem, StepSolution};
pub use scheme::Scheme;
pub use stepper::{ContactProblemView, PatchReport, Settings, State, StepReport, Stepper};
