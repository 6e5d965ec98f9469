//! The case that a job describes: its two bodies, made from meshes, sections, profiles or matrices, and the contact
//! between them.

mod absorbers;
pub mod bodies;
pub mod curving;
pub(crate) mod cycle;
pub(crate) mod examined;
pub mod foresee;
pub mod interface;
mod lies;
pub mod meshes;
pub mod own_contact;
pub(crate) mod pictures;
pub mod placed;
pub mod rail;
pub(crate) mod rolling;
pub(crate) mod roughness;
pub mod shown;
pub(crate) mod standing;
pub mod surfaces;
pub mod swept;
pub(crate) mod well_posed;

pub use bodies::Bodies;
pub use meshes::Meshes;
