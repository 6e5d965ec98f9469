//! What a body gives to contact, whether finite elements or matrices from elsewhere.

pub mod align;
pub mod clusters;
pub mod fe;
pub mod matrices;
pub mod matrix_market;
pub mod modes;
pub mod nearest;
pub mod residual;
pub mod statics;
pub mod trace;

pub use trace::{Side, Trace};

use faer::Mat;

/// A body as the interface sees it, dense, on rank 0. Contact rows are interleaved `3*i + c` over the nodes `i` of the
/// contact grid; component `c` is x, y, and n = into the body (-z in lower form), so that pressure acts as `+p` on row n
/// of either body. All in lower form; an upper body's tangential reactions enter with a minus sign (see `contact`).
#[derive(Debug, Clone)]
pub struct ReducedBody {
    /// Angular frequencies of the kept free-interface modes, rad/s, ascending, `[m]`; 0 for rigid-body modes.
    pub omega: Vec<f64>,
    /// Modal damping coefficients c_k (q̈ + c_k q̇ + ω² q = …), 1/s, `[m]`.
    pub damping: Vec<f64>,
    /// Mass-normalised modes at the contact rows, 1/√kg, `[3n, m]`.
    pub contact_modes: Mat<f64>,
    /// Static compliance of the contact rows, m/N, `[3n, 3n]`, symmetric: the whole K⁻¹, modes included.
    pub compliance: Mat<f64>,
}
