//! Sound of a body of revolution, exact: the exterior problem of Helmholtz by boundary integrals over the outline of
//! the section, one for each order of Fourier.
//!
//! With e^{+iωt}, G = e^{−ikR}/(4πR), the outward normal n and its velocity v the surface pressure p obeys ½p = ∫ p
//! ∂G/∂n′ dS′ + iωρ ∫ v G dS′ (integral of Kirchhoff and Helmholtz; F. Fahy, P. Gardonio, *Sound and Structural
//! Vibration*, 2nd ed., 2007, chapter 3). Round the axis v and p go with cos nθ or sin nθ, so that the integrals over
//! θ can be done first: what is left are rings (`ring`) along the outline (`panels`). Orders do not know of each
//! other, and the two families of one order radiate alike.

mod bessel;
mod exterior;
mod modes;
mod ring;

pub use exterior::{square, Exterior};
pub use modes::RevolvedRadiators;
