//! Limit cycles as solutions of equations (`docs/explanation/branches.md`): branches over a key, their special points
//! and the stability of each cycle. The room knows neither PETSc nor MPI nor files: everything is dense and runs on
//! rank 0.
//!
//! The structure is linear and remembers long; the contact is not linear and forgets within the passage of its
//! material. Unknowns are therefore H harmonics of the r functions of the modal motion that act at the contact,
//! z = Cᵀ q with Ψ = B Cᵀ, and the angular frequency. Given them, [`balance`] marches the contact alone, by the laws
//! and the solver of the transient, until its start is forgotten, takes the forces φ = Bᵀ R of the period that
//! follows, and compares with what the modes make of them:
//!
//! ẑ_k = Cᵀ (s_k² + s_k C_m + K_m)⁻¹ C (φ̂_k + load),   s_k = (2i/h) tan(kωh/2),   k = 0 … H
//!
//! where h = 2π/(Nω) is the step of the march. s_k is ikω as the θ-method of the transient has it for θ = ½: up to the
//! harmonics left out, a solution is a cycle of the transient in steps of h.

pub(crate) mod balance;
pub(crate) mod branch;
pub(crate) mod contact_jacobian;
pub(crate) mod corrector;
pub(crate) mod floquet;
mod free;
mod growing;
mod hill;
mod kernel;
mod nodal_period;
mod order;
mod poles;
mod prescribed;
mod receptance;
mod serialized;
mod special;
pub(crate) mod structure;
#[cfg(test)]
mod tests;

pub use balance::{Conditions, ContactMemory, PeriodicSolution, Resolution};
pub use branch::{BranchEnd, BranchExtent, BranchPoint, BranchState, Family, Special, SpecialKind};
pub use contact_jacobian::ContactJacobian;
#[cfg(test)]
pub use floquet::Multipliers;
pub use growing::{cycle_of_mode, GrowingMotion};
pub use nodal_period::NodalPeriod;
pub use order::in_order;
pub use structure::Structure;
