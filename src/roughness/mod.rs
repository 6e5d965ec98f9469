//! Roughness of running surfaces: lines and areas from files or spectra, flats, joints and steps, and how they travel
//! through the contact (`docs/explanation/roughness.md`). It knows neither bodies nor jobs, and takes no part but in
//! the gap.
//!
//! Heights are along the outward normal of the surface: what stands out has r > 0 and closes the gap, of either body,
//! g(x, y, t) = g0(x, y) − r1(Vt − x, y) − r2(Vt − x, y). The argument s = Vt − x is the way rolled until the
//! material at x was, or will be, at the contact's centre: s grows in the direction of travel, and material flows
//! towards +x with the rolling speed V.

mod line;
pub mod read;
pub(crate) mod shape;
pub mod spectrum;
mod surface;

pub use line::RoughnessLine;
pub use shape::RoughnessShape;
pub use surface::{RoughSurfaces, RoughnessFeature};
