//! Sound radiated by vibrating surfaces: radiators, their radiation resistance, spectra, third octaves
//! (`docs/explanation/sound.md`). Only `surface`, which makes radiators of a body's distributed mesh, knows MPI. Bodies
//! of revolution are solved exactly in `revolved`, rails in `line`.
//!
//! The velocity of a surface in its modes is v_n(x, t) = Σ_j φ_n,j(x) q̇_j(t). With the cross-spectral density S(f)
//! of the modal velocities the sound power per hertz is W(f) = tr(R(f) S(f)), R being the real symmetric radiation
//! resistance matrix of the modes (F. Fahy, P. Gardonio, *Sound and Structural Vibration*, 2nd ed., 2007, chapter 3).

pub mod bands;
pub(crate) mod line;
pub(crate) mod panels;
pub(crate) mod power;
pub mod radiators;
pub(crate) mod revolved;
pub mod spectrum;
pub mod surface;

pub use bands::Bands;
pub use power::{PowerSpectrum, Radiation};
pub use radiators::Radiators;
pub use spectrum::Welch;

/// The air around the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Density, kg/m³.
    pub density: f64,
    /// Speed of sound, m/s.
    pub speed: f64,
}

impl Air {
    /// Wave number at the frequency `f` (Hz), 1/m.
    ///
    /// ```
    /// let air = railsqueal::sound::Air { density: 1.2, speed: 340.0 };
    /// // A wave of 340 Hz is 1 m long.
    /// assert!((air.wave_number(340.0) - 2.0 * std::f64::consts::PI).abs() < 1e-12);
    /// ```
    pub fn wave_number(&self, f: f64) -> f64 {
        2.0 * std::f64::consts::PI * f / self.speed
    }
}

/// Level of a sound power (W) in dB re 1 pW; −∞ for none.
///
/// ```
/// assert_eq!(railsqueal::sound::level(1.0).round(), 120.0);
/// ```
pub fn level(power: f64) -> f64 {
    10.0 * (power / 1e-12).log10()
}

/// Distance at which the pressure beside a track is measured, m (ISO 3095).
const DISTANCE: f64 = 7.5;

/// Sound pressure level, dB re 20 µPa, 7.5 m from a source on hard ground with the power level `power` (dB re 1 pW)
/// that radiates alike in all directions above it: its power goes through half a sphere, p² = ρc W/(2πd²).
///
/// ```
/// use railsqueal::sound::{pressure_level, Air};
///
/// let air = Air { density: 1.2, speed: 340.0 };
/// // 25.4 dB below the power level.
/// assert!((pressure_level(air, 112.0) - 86.6).abs() < 0.1);
/// ```
pub fn pressure_level(air: Air, power: f64) -> f64 {
    let square = air.density * air.speed * 1e-12 / (2.0 * std::f64::consts::PI * DISTANCE * DISTANCE);
    power + 10.0 * (square / (20e-6f64 * 20e-6)).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_and_levels() {
        // A wave as long as 2 m turns by π over 1 m.
        let found = Air { density: 1.2, speed: 343.0 }.wave_number(171.5);
        assert!((found - std::f64::consts::PI).abs() < 1e-14, "{found}");
        assert!((level(1.0) - 120.0).abs() < 1e-12 && level(0.0) == f64::NEG_INFINITY);
        // The text book's −20 lg d − 8 dB, in air of 400 N·s/m³.
        let air = Air { density: 400.0 / 340.0, speed: 340.0 };
        let wanted = 100.0 - 20.0 * 7.5f64.log10() - 10.0 * (2.0 * std::f64::consts::PI).log10();
        assert!((pressure_level(air, 100.0) - wanted).abs() < 1e-9);
    }
}
