//! Damping by the mass that grows towards a plane.

use super::{Coupling, Form};
use crate::mesh::quality::{determinant, jacobian};
use crate::mesh::Cell;

/// ∫ ρ α v·u dV, kg/s, with α = `rate` (1 − d/`depth`)² at the distance d < `depth` from a plane and 0 beyond: waves meet no step that would send them
/// back.
pub struct Absorbing {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// A point of the plane, m.
    pub place: [f64; 3],
    /// Its unit normal.
    pub normal: [f64; 3],
    /// Where the damping begins, m from the plane.
    pub depth: f64,
    /// α at the plane, 1/s.
    pub rate: f64,
}

impl Absorbing {
    /// α at a point, 1/s.
    pub fn at(&self, x: [f64; 3]) -> f64 {
        let distance = (0..3).map(|c| (x[c] - self.place[c]) * self.normal[c]).sum::<f64>().abs();
        self.rate * (1.0 - distance / self.depth).max(0.0).powi(2)
    }
}

impl Form for Absorbing {
    fn coupling(&self) -> Coupling {
        Coupling::Components
    }

    fn matrix(&self, cell: Cell<'_>, x: &[[f64; 3]], out: &mut [f64]) {
        let n = cell.kind.nodes();
        out.fill(0.0);
        for p in cell.kind.mass_rule() {
            let values = &p.shape.values[..n];
            let place = std::array::from_fn(|c| x.iter().zip(values).map(|(x, v)| v * x[c]).sum());
            let w = self.density * self.at(place) * p.weight * determinant(&jacobian(x, &p.shape));
            for (row, a) in out.chunks_exact_mut(n).zip(values) {
                row.iter_mut().zip(values).for_each(|(to, b)| *to += w * a * b);
            }
        }
    }
}
