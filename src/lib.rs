//! railsqueal: rolling contact with Coulomb friction between finite-element bodies in an Eulerian frame,
//! the stability of steady sliding, and the squeal that follows.
//!
//! Data flows down this list and never back up; see `docs/` for the theory and the conventions.

#![deny(unsafe_code)]
// What input can reach must not panic.
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::todo))]

pub mod analysis;
pub mod body;
pub mod case;
pub mod contact;
pub mod curving;
mod dense;
pub mod eigen;
pub mod error;
pub mod fem;
pub mod friction;
pub mod grid;
mod input;
pub mod job;
pub mod memory;
pub mod mesh;
pub mod model;
pub mod output;
pub mod parallel;
#[allow(unsafe_code)] // The one place where the C libraries are called.
pub mod petsc;
pub mod placement;
pub mod plan;
pub mod progress;
mod quadrature;
pub mod rails;
pub mod random;
pub mod roughness;
pub mod scratch;
pub mod sound;
pub mod stability;
pub mod stop;
pub mod summary;
pub mod swept;
pub mod transient;

pub use error::{Error, Result};
