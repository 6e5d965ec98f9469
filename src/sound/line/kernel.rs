//! The field of a line of sources.

use crate::sound::panels::{Kernel, OutlinePoint};
use num_complex::Complex64;

/// G = −(i/4) H0⁽²⁾(κR) and ∂G/∂n′ of a line of sources.
#[derive(Debug, Clone, Copy, Default)]
pub struct Line {
    found: [[Complex64; 2]; 1],
}

impl Kernel for Line {
    fn integrals(&mut self, source: &OutlinePoint, at: [f64; 2], k: f64) -> &[[Complex64; 2]] {
        let apart = [source.at[0] - at[0], source.at[1] - at[1]];
        let distance = apart[0].hypot(apart[1]);
        let along = (apart[0] * source.normal[0] + apart[1] * source.normal[1]) / distance;
        let z = k * distance;
        let hankel = [Complex64::new(libm::j0(z), -libm::y0(z)), Complex64::new(libm::j1(z), -libm::y1(z))];
        let quarter = Complex64::new(0.0, 0.25);
        self.found = [[-quarter * hankel[0], quarter * (k * along) * hankel[1]]];
        &self.found
    }
}
