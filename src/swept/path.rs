//! Sweep path: round an axle, or along a line.

use std::f64::consts::PI;

/// The way of a section. Order n has the wave cos nθ all round the axle, and cos kx with k = 2πn/L on a line that
/// repeats itself after the period L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Path {
    /// Round the axle, by the angle θ.
    Axle,
    /// Along x, repeated after this period, m.
    Line(f64),
}

impl Path {
    /// Factor of a derivative along the path: n, or k = 2πn/L, 1/m.
    pub fn wavenumber(self, n: usize) -> f64 {
        match self {
            Path::Axle => n as f64,
            Path::Line(period) => 2.0 * PI * n as f64 / period,
        }
    }

    /// ∫cos² over the whole way, which is that of sin² too; of order 0, which has no wave, the way itself: radians,
    /// or m.
    pub(crate) fn length_integral(self, n: usize) -> f64 {
        let whole = match self {
            Path::Axle => 2.0 * PI,
            Path::Line(period) => period,
        };
        if n == 0 {
            whole
        } else {
            0.5 * whole
        }
    }

    /// r of the measure r dr dy of a section round an axle; 1 along a line.
    pub(super) fn measure(self, r: f64) -> f64 {
        match self {
            Path::Axle => r,
            Path::Line(_) => 1.0,
        }
    }
}
