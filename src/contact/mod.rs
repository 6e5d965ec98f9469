//! Rolling contact on its own interface S_c: kinematics, laws as projections, the frictional contact solver on dense
//! influence matrices. It knows neither PETSc nor MPI: everything here runs on rank 0 and can be tested alone.
//!
//! Signs (see `docs/reference/conventions.md`): body 1 is the lower one; w = u1 − u2 tangential; material flows towards
//! +x, so the upstream neighbour of a node is the one with the smaller x; the traction t acts on body 1 and opposes the
//! creep ṡ = c + V ∂w/∂x; |t| ≤ μp.

pub(crate) mod active_set;
pub mod baseline;
mod candidates;
pub mod consistent;
mod continuation;
pub(crate) mod deferred_correction;
pub(crate) mod fe_correction;
mod frictionless_cg;
pub(crate) mod full_sliding;
pub(crate) mod half_space_estimate;
mod influence;
mod interface;
pub(crate) mod krylov;
pub(crate) mod law;
mod linear;
mod linear_places;
pub(crate) mod loads;
pub mod memory;
mod nested;
mod newton;
mod normal;
mod patch;
pub(crate) mod points;
mod start;
pub mod steady;
pub(crate) mod upwind_reconstruction;

pub use continuation::Continuation;
pub use deferred_correction::DeferredSteady;
pub use full_sliding::{SlidingDirection, SlidingProblem, SlidingSolution};
pub use influence::Influence;
pub use interface::{ContactCreepage, PatchKinematics, Stencil, Upstream, SPIN_SPACINGS};
pub use law::{LinearContact, LinearEdge, LinearNode, Slip, Status, Tangent};
pub use loads::{LoadedMotion, Loads, NormalLoad};
pub use memory::LinearMemory;
pub use points::SlidingPoint;
pub use steady::{PatchResultant, SteadyProblem, SteadySolution};
