//! Sound of a rail without ends, exact in free air: one exterior problem of Helmholtz in the plane for each
//! wavenumber along the rail.
//!
//! A motion that goes with e^{−iξx} makes a pressure that does, too, and that obeys Helmholtz's equation in the plane
//! of the section with κ² = k² − ξ². Waves longer than those of the air, |ξ| < k, radiate; shorter ones keep their
//! sound at the surface. Under a force F the power is ½FᴴGF, and G the integral over ξ of what each wavenumber
//! radiates (D. J. Thompson, *Railway Noise and Vibration*, 2009, chapter 6, on rails in two and a half dimensions).

mod adaptive;
mod kernel;
mod plane;
mod radiators;

pub use radiators::RailRadiators;
