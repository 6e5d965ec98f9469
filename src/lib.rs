//! railsqueal: rolling contact with Coulomb friction between finite-element bodies in an Eulerian frame,
//! the stability of steady sliding, and the squeal that follows.
//!
//! Data flows down this list and never back up; see `docs/` for the theory and the conventions.

pub mod analysis;
pub mod body;
pub mod contact;
pub mod error;
pub mod fem;
pub mod job;
pub mod mesh;
pub mod output;
pub mod parallel;
pub mod petsc;
pub mod progress;

pub use error::{Error, Result};
