//! The laws of contact at points of quadrature, with the consistent matrices of the interface: equation (3) of the
//! paper of Lai, Chiello, Brunel and Dufrénoy as it stands.
//!
//! The interface carries bilinear shape functions N. The nodal reactions R are those of a field of stress H⁻¹R, H =
//! ∫NᵀN, and the laws are projections of that field at the points of a rule of Gauss in each cell:
//!
//! R_n = ∫ N_nᵀ max(0, N_n (H⁻¹R_n − ρ_n g)),   R_t = ∫ N_tᵀ Proj(N_t (H⁻¹R_t − ρ_t ṡ)),
//!
//! the disc of the second having the radius μ times what is under the integral of the first. With the lumped H and
//! the nodes as points these are the nodal laws of `contact::law`.
//!
//! R_n ≥ 0 at every node and |R_t| ≤ μ R_n, as integrals of what is projected; the field H⁻¹R need not be so at the
//! border of the contact, where it wavers about a kink. The gap closes in the mean: ∫ N g = 0 at nodes that the
//! contact surrounds, not g = 0. In the cells that the border crosses the equations are those of neither side, and
//! their solution depends on ρ a little, the less the finer the grid: ρ is that of the nodal laws, the inverse of a
//! node's own compliance, the same for the whole interface.

mod cells;
mod newton;
mod steady;
mod surface;

pub(crate) use cells::{ContactCells, IntegratedLaw};
pub(crate) use newton::{CellProblem, ConsistentEffort, FactoredJacobian};
pub use steady::{augmentation, ConsistentSolution, ConsistentSteady};
pub use surface::ConsistentSurface;
