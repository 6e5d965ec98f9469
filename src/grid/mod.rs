//! The grid of contact nodes: the part of a body's surface that offers them, and the interface of two bodies on them.

mod interface;
pub mod surface;

pub use interface::Interface;
pub use surface::ContactGrid;
