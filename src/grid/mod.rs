//! The grid of contact nodes: the part of a body's surface that offers them, how any other surface meets them, and
//! the interface of two bodies on them.

mod clip;
mod faces;
mod interface;
pub mod surface;
mod transfer;

pub use faces::Faces;
pub use interface::{ContactPatch, Interface, TurningPoints};
pub use surface::ContactGrid;
pub(crate) use transfer::averages;
pub use transfer::{means, PatchAverage, PatchShape, Transfer, Weights};
