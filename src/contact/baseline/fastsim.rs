//! FASTSIM: the simplified theory of rolling contact.

use super::EllipticContact;
use crate::contact::interface::ContactCreepage;
use crate::contact::law::project_disc;

/// Strips along the rolling direction, and pieces of each.
const GRID: [usize; 2] = [100, 100];

/// J. J. Kalker, *A fast algorithm for the simplified theory of rolling contact*, Vehicle System Dynamics 11 (1982):
/// the displacement is a flexibility times the traction, a flexibility for each of the creepages so that the forces
/// without slip are those of the linear theory; the bound of friction is that of a parabolic pressure. Forces (x, y)
/// on body 1, N.
pub fn fastsim(e: &EllipticContact, c: &ContactCreepage) -> [f64; 2] {
    let (a, b, k) = (e.a, e.b, e.kalker);
    let flexibility = |coefficient: f64| 8.0 * a / (3.0 * e.shear * coefficient);
    let (along, across) = (flexibility(k.longitudinal), flexibility(k.lateral));
    let by_spin = std::f64::consts::PI * a * (a / b).sqrt() / (4.0 * e.shear * k.spin);
    let peak = 2.0 * e.load / (std::f64::consts::PI * a * b);
    let [strips, pieces] = GRID;
    let width = 2.0 * b / strips as f64;
    let mut force = [0.0; 2];
    for strip in 0..strips {
        let y = -b + (strip as f64 + 0.5) * width;
        let half = a * (1.0 - (y / b).powi(2)).sqrt();
        let length = 2.0 * half / pieces as f64;
        let mut t = [0.0; 2];
        for piece in 0..pieces {
            // To the middle of the piece, where pressure and traction are taken.
            let x = -half + (piece as f64 + 0.5) * length;
            let way = if piece == 0 { 0.5 * length } else { length };
            let middle = x - 0.5 * way;
            let gradient =
                [c.longitudinal / along - c.spin * y / by_spin, c.lateral / across + c.spin * middle / by_spin];
            let bound = e.friction * peak * (1.0 - (x / a).powi(2) - (y / b).powi(2)).max(0.0);
            t = project_disc([t[0] - gradient[0] * way, t[1] - gradient[1] * way], bound);
            force[0] += t[0] * length * width;
            force[1] += t[1] * length * width;
        }
    }
    force
}

#[cfg(test)]
mod tests {
    use super::super::tests::{benchmark, creepage};
    use super::*;

    /// Steady rolling of the benchmark by CONTACT, extrapolated to zero grid size (`docs/explanation/validation.md`);
    /// the simplified theory is known to be within 5 % of μN of it without spin.
    #[test]
    fn is_near_the_forces_of_contact() {
        let e = benchmark();
        for (eta, want) in [(0.001, -0.3005), (0.003, -0.7177), (0.005, -0.9304)] {
            let [x, y] = fastsim(&e, &creepage(0.0, eta, 0.0)).map(|f| f / (e.friction * e.load));
            assert!((y - want).abs() < 0.05 && x.abs() < 1e-12, "{eta}: {y} against {want}");
        }
    }

    /// Without slip a spin alone makes a lateral force; with much of it there is less, and none by symmetry along the
    /// rolling direction.
    #[test]
    fn spin_makes_a_lateral_force() {
        let e = benchmark();
        let [x, y] = fastsim(&e, &creepage(0.0, 0.0, 0.5));
        assert!(y > 0.0 && x.abs() < 1e-9 * y, "{x} {y}");
    }
}
