//! The case that a job describes: its two bodies, made from meshes, sections, profiles or matrices, and the contact
//! between them.

mod absorbers;
pub(crate) mod axle_torque;
pub mod bodies;
mod contact_places;
pub mod curving;
pub(crate) mod disc_and_pads;
pub(crate) mod display_modes;
pub mod endless_rail;
pub(crate) mod interface;
mod lateral_shift;
pub(crate) mod limit_cycle_point;
mod mesh_diagnostics;
pub mod mesh_preview;
pub(crate) mod meshes;
pub mod own_contact;
pub mod placed_body;
pub(crate) mod placements;
pub(crate) mod positioned_mesh;
pub mod preflight;
pub(crate) mod rail;
pub(crate) mod roughness;
pub(crate) mod stability_problem;
pub mod surfaces;
pub mod swept;
pub(crate) mod transient_problem;
pub(crate) mod well_posed;
pub(crate) mod wheel_rail_geometry;

pub use bodies::BuiltBodies;
pub use meshes::Meshes;
