//! The means under the loads of a patch on a half-space: what a body yields where the patch is small.

use super::load_patch::{points, LoadPatch, Square, LOADS};
use std::f64::consts::PI;

/// Wavenumbers times b up to which integrals go; what is beyond is some 1e-8 of them.
const FAR: f64 = 400.0;
/// Parts of what goes up to there.
const PANELS: usize = 300;

/// Sign of the product of the factors i of a pair of loads and of the displacement of one under the other: 1 or −1; 0
/// where the product is odd along x or along y.
const PHASE: Square = {
    let mut all = [[0.0; LOADS]; LOADS];
    let mut k = 0;
    while k < LOADS * LOADS {
        let (a, b) = (k / LOADS, k % LOADS);
        // Powers of i, and how often odd along x and along y.
        let (by, under) = (a / 3, b / 3);
        let (moved, force) = (a % 3, b % 3);
        let mut power = 0;
        let mut odd = [0; 2];
        if by > 0 {
            power += 3;
            odd[by - 1] += 1;
        }
        if under > 0 {
            power += 1;
            odd[under - 1] += 1;
        }
        if moved < 2 && force == 2 {
            power += 1;
            odd[moved] += 1;
        }
        if moved == 2 && force < 2 {
            power += 3;
            odd[force] += 1;
        }
        if moved < 2 && force < 2 && moved != force {
            odd[0] += 1;
            odd[1] += 1;
        }
        if odd[0] % 2 == 0 && odd[1] % 2 == 0 {
            all[a][b] = if power % 4 == 0 { 1.0 } else { -1.0 };
        }
        k += 1;
    }
    all
};

/// Half-space that carries the loads: shear modulus G, Pa, and Poisson's ratio ν. In Fourier space, e^{i(k_x x + k_y
/// y)}, a force along n moves the surface by (1 − ν)/(Gκ) along n and by i(1 − 2ν)k/(2Gκ²) along x, y; one along x, y
/// by (δ − ν k k/κ²)/(Gκ) (from K. L. Johnson, Contact Mechanics, 1985, (3.18), (3.75)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpaceLoad {
    /// The patch of the loads.
    pub patch: LoadPatch,
    /// Shear modulus, Pa.
    pub shear: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

impl HalfSpaceLoad {
    /// κ times the means under the loads of the wave of size κ and of the direction α against x, m/N and so on, the
    /// mean over the four quadrants: what is even along x and along y.
    fn wave(&self, kappa: f64, alpha: f64) -> Square {
        let (nu, (s, c)) = (self.poisson, alpha.sin_cos());
        let coupling = 0.5 * (1.0 - 2.0 * nu);
        // ω, xω and yω in Fourier space, and the displacements of the surface, but for factors i and −i, which are in
        // `PHASE`.
        let load = self.patch.transform([kappa * c, kappa * s]);
        let moved = [
            [1.0 - nu * c * c, -nu * c * s, coupling * c],
            [-nu * c * s, 1.0 - nu * s * s, coupling * s],
            [coupling * c, coupling * s, 1.0 - nu],
        ];
        let moved = moved.map(|row| row.map(|v| v / self.shear));
        let mut all = [[0.0; LOADS]; LOADS];
        for (a, row) in all.iter_mut().enumerate() {
            for (b, v) in row.iter_mut().enumerate() {
                *v = PHASE[a][b] * (load[a / 3] * load[b / 3]) * moved[a % 3][b % 3];
            }
        }
        all
    }

    /// The means under the loads with the wavenumbers |k_x| < `k`: ⟨ω π_m, u⟩ of each under each.
    pub fn up_to(&self, k: f64) -> Square {
        // Over the direction of a wave nothing varies on a circle but the factors; on a rectangle the waves do.
        let (shorter, longer) = (self.patch.shorter(), self.patch.half()[0].max(self.patch.half()[1]));
        let sectors = match self.patch {
            LoadPatch::Circle { .. } => 1,
            LoadPatch::Rectangle { half: [a, _], .. } => 2 + (k * a) as usize,
        };
        let mut all = [[0.0; LOADS]; LOADS];
        let mut add = |kappa: f64, weight: f64| {
            let first = if kappa <= k { 0.0 } else { (k / kappa).acos() };
            for (alpha, step) in points(first, 0.5 * PI, sectors) {
                accumulate(&mut all, &self.wave(kappa, alpha), weight * step / (PI * PI));
            }
        };
        for (kappa, step) in points(0.0, k, 8 + (k * longer) as usize) {
            add(kappa, step);
        }
        // The angle falls like a root just above k: κ = k + τ².
        for (tau, step) in points(0.0, (FAR / shorter - k).max(0.0).sqrt(), PANELS) {
            add(k + tau * tau, 2.0 * tau * step);
        }
        all
    }

    /// The same of all wavenumbers, of loads on a circle: those of a rectangle fall too slowly.
    pub fn sum(&self) -> Square {
        self.up_to(FAR / self.patch.shorter())
    }

    /// The same of one order n ≥ 1 of a body of rolling radius `radius`, m: ∂/∂k of [`HalfSpaceLoad::up_to`] over the
    /// radius.
    pub fn order(&self, n: usize, radius: f64) -> Square {
        let k = n as f64 / radius;
        let end = (FAR / (k * self.patch.half()[1])).max(1.0).acosh();
        let mut all = [[0.0; LOADS]; LOADS];
        for (t, step) in points(0.0, end, PANELS) {
            let alpha = (1.0 / t.cosh()).acos();
            accumulate(&mut all, &self.wave(k * t.cosh(), alpha), step / (PI * PI * radius));
        }
        all
    }
}

fn accumulate(sum: &mut Square, part: &Square, weight: f64) {
    for (s, p) in sum.as_flattened_mut().iter_mut().zip(part.as_flattened()) {
        *s += weight * p;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swept::FAMILY;

    /// Each order of loads is the derivative of their sum, and none moves what belongs to the other family.
    fn orders_are_derivatives(load: &HalfSpaceLoad) {
        let radius = 0.5;
        for n in [3usize, 40, 300] {
            let [low, high] = [-1e-3, 1e-3].map(|d| load.up_to((n as f64 + d) / radius));
            let order = load.order(n, radius);
            for c in 0..LOADS {
                for d in 0..LOADS {
                    let slope = (high[c][d] - low[c][d]) / 2e-3;
                    let size = (order[c][c] * order[d][d]).abs().sqrt();
                    assert!((order[c][d] - slope).abs() < 1e-4 * size, "{n} {c} {d}: {:e} {slope:e}", order[c][d]);
                    assert!(FAMILY[c] == FAMILY[d] || order[c][d].abs() < 1e-12 * size, "{c} {d}");
                }
            }
        }
    }

    /// The mean displacement of a square under an even pressure of the force 1 is 4 (ln(1 + √2) − (√2 − 1)/3)/π times
    /// (1 − ν²)/(2aE) (S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 1951, section 124: 0.95); each order
    /// is the derivative of the sum, of rectangles that lie along and across.
    #[test]
    fn loads_on_rectangles_are_those_of_an_even_pressure() {
        let (young, nu) = (205e9, 0.3);
        let of = |half: [f64; 2]| HalfSpaceLoad {
            patch: LoadPatch::Rectangle { half, middle: 0.0 },
            shear: young / 2.6,
            poisson: nu,
        };
        let b = 2e-3;
        let wanted =
            4.0 / PI * ((1.0 + 2f64.sqrt()).ln() - (2f64.sqrt() - 1.0) / 3.0) * (1.0 - nu * nu) / (2.0 * b * young);
        let [found, further] = [40.0, 80.0].map(|reach| of([b; 2]).up_to(reach / b)[2][2]);
        // What is beyond falls like 1/k.
        assert!(((2.0 * further - found) / wanted - 1.0).abs() < 1e-3, "{found:e} {further:e} {wanted:e}");
        [of([10e-3, 1e-3]), of([1e-3, 10e-3])].iter().for_each(orders_are_derivatives);
    }

    /// B_nn = 0.6(1−ν²)/(Eb), B_tt = B_nn (2−ν)/(2(1−ν)); under a normal force the surface is drawn inwards; rocking
    /// in a fully loaded circle is the same about x and y; each order is the derivative of the sum.
    #[test]
    fn the_orders_of_the_half_space_add_up_to_hertz() {
        let (young, nu, b) = (205e9, 0.3, 5e-3);
        let load = HalfSpaceLoad { patch: LoadPatch::Circle { radius: b }, shear: young / 2.6, poisson: nu };
        let normal = 0.6 * (1.0 - nu * nu) / (young * b);
        let tangential = normal * (2.0 - nu) / (2.0 * (1.0 - nu));
        let all = load.sum();
        for (k, wanted) in [tangential, tangential, normal].into_iter().enumerate() {
            assert!((all[k][k] / wanted - 1.0).abs() < 1e-6, "{:e} {wanted:e}", all[k][k]);
        }
        assert!((all[5][5] / all[8][8] - 1.0).abs() < 1e-9 && (all[3][2] / all[7][2] - 1.0).abs() < 1e-9);
        // ⟨ωx, u_x⟩ under ω e_n: the whole inside any circle pulls: −(1−2ν)/(4πG) ∫ω(s) Q(s)/… by parts, here against
        // direct summation of u_r = −(1−2ν)Q(r)/(4πGr).
        let inward = points(0.0, b, 16).into_iter().map(|(r, step)| {
            let share = 1.0 - (1.0 - r * r / (b * b)).powf(1.5);
            let weight = 3.0 / (2.0 * PI * b * b) * (1.0 - r * r / (b * b)).sqrt();
            let displacement = -(1.0 - 2.0 * nu) * share / (4.0 * PI * load.shear * r);
            step * PI * r * r * weight * displacement
        });
        let inward: f64 = inward.sum();
        assert!((all[3][2] / inward - 1.0).abs() < 1e-3 && all[2][3] == all[3][2], "{:e} {inward:e}", all[3][2]);
        orders_are_derivatives(&load);
    }
}
