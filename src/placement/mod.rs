//! A wheel on a rail: profiles.

pub mod builtin;
mod formats;
pub mod profile;
pub mod read;
pub mod spline;

pub use profile::Profile;
