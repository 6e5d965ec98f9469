//! A load that is spread over a small circle of the surface, as the orders of Fourier see it, on a swept body and on a half-space.
//!
//! Weight ω(x, y) = 3/(2πb²) √(1 − r²/b²), r² = x² + y²: Hertz' pressure of the force 1.

use super::Forms;
use faer::Mat;
use std::f64::consts::PI;

/// Points and weights of Gauss and Legendre on [−1, 1], 8 points, one half of them.
const GAUSS_8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// ∫f over [a, b] by `panels` equal parts.
fn integral(a: f64, b: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let half = 0.5 * (b - a) / panels as f64;
    let mut sum = 0.0;
    for k in 0..panels {
        let middle = a + half * (2 * k + 1) as f64;
        for (x, w) in GAUSS_8 {
            sum += half * w * (f(middle - half * x) + f(middle + half * x));
        }
    }
    sum
}

/// The circle of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Its radius b, m.
    pub radius: f64,
}

impl Patch {
    /// ∫ω cos kx dx at the place y, 1/m: (3/2b³) c J1(kc)/k with c² = b² − y².
    pub fn line(&self, k: f64, y: f64) -> f64 {
        let b = self.radius;
        let c = (b * b - y * y).max(0.0).sqrt();
        // x = c sin φ: periodic in φ, so equal steps converge faster than any power.
        let steps = 16 + (k * c).ceil() as usize;
        let mean = (0..steps)
            .map(|i| {
                let phi = PI * i as f64 / steps as f64;
                phi.cos().powi(2) * (k * c * phi.sin()).cos()
            })
            .sum::<f64>()
            / steps as f64;
        1.5 * c * c / (b * b * b) * mean
    }

    /// ∫∫ω e^{−iκ·x}: 3 j1(s)/s, s = κb.
    fn transform(&self, wavenumber: f64) -> f64 {
        let s = wavenumber * self.radius;
        if s < 0.05 {
            let q = s * s;
            return 1.0 - q / 10.0 * (1.0 - q / 28.0);
        }
        3.0 * (s.sin() / s - s.cos()) / (s * s)
    }
}

/// The weights of the nodes of the running line for the load of one order.
#[derive(Debug, Clone)]
pub struct LineLoad {
    /// (First amplitude of a node, ∫N_a ŵ dy).
    pub nodes: Vec<(usize, f64)>,
}

impl LineLoad {
    /// The load of the order `n` on `forms`, whose rolling radius is `radius`, m.
    pub fn new(forms: &Forms, patch: Patch, n: usize, radius: f64) -> Self {
        let k = n as f64 / radius;
        let section = &forms.section;
        let mut nodes = Vec::new();
        for edge in &section.tread {
            let [first, last, middle] = edge.map(|i| section.nodes[i][1]);
            let (low, high) = (first.max(-patch.radius), last.min(patch.radius));
            if high <= low {
                continue;
            }
            // y = middle + s (last − first)/2 + s² (first + last − 2 middle)/2 along the edge.
            let (slope, bend) = (0.5 * (last - first), 0.5 * (first + last - 2.0 * middle));
            let place = |y: f64| {
                (0..8).fold(0.0, |s: f64, _| s - (middle + s * (slope + s * bend) - y) / (slope + 2.0 * s * bend))
            };
            let values = |s: f64| [0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s];
            for (a, &node) in edge.iter().enumerate() {
                let weight = integral(low, high, 2, |y| values(place(y))[a] * patch.line(k, y));
                nodes.extend(forms.amplitude(node).map(|at| (at, weight)));
            }
        }
        Self { nodes }
    }

    /// The load of the force 1 along U, V or W (c = 0, 1, 2) as columns of amplitudes, `[order, 3]`.
    pub fn columns(&self, order: usize) -> Mat<f64> {
        let mut load = Mat::zeros(order, 3);
        for &(at, weight) in &self.nodes {
            (0..3).for_each(|c| load[(at + c, c)] += weight);
        }
        load
    }

    /// Weighted mean of the amplitudes (U, V, W) of a column, `[order]`.
    pub fn mean(&self, amplitudes: faer::ColRef<'_, f64>) -> [f64; 3] {
        let mut mean = [0.0; 3];
        for &(at, weight) in &self.nodes {
            mean.iter_mut().enumerate().for_each(|(c, m)| *m += weight * amplitudes[at + c]);
        }
        mean
    }
}

/// Wavenumbers times b up to which integrals go; what is beyond is some 1e-8 of them.
const FAR: f64 = 400.0;

/// Half-space that carries the load: shear modulus G, Pa, and Poisson's ratio ν. In Fourier space a force along n moves the surface by (1 − ν)/(Gκ), one along x
/// by (1 − ν k_x²/κ²)/(Gκ), likewise along y (from K. L. Johnson, Contact Mechanics, 1985, (3.18) and (3.75)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpaceLoad {
    /// The load.
    pub patch: Patch,
    /// Shear modulus, Pa.
    pub shear: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

impl HalfSpaceLoad {
    /// ⟨ω, u⟩ under ω along x, y, n with the wavenumbers |k_x| < `k`, m/N.
    pub fn up_to(&self, k: f64) -> [f64; 3] {
        let square = |kappa: f64| self.patch.transform(kappa).powi(2);
        let (b, nu) = (self.patch.radius, self.poisson);
        // ∫dα over the directions with |k_x| < k, plainly and with cos², sin².
        let share = |kappa: f64| {
            let a = if kappa <= k { 0.5 * PI } else { (k / kappa).asin() };
            let swing = 0.5 * (2.0 * a).sin();
            [a - 0.5 * nu * (a - swing), a - 0.5 * nu * (a + swing), (1.0 - nu) * a]
        };
        let unit = 1.0 / (PI * PI * self.shear);
        [0, 1, 2].map(|c| {
            let whole = integral(0.0, k, 8 + (k * b) as usize, |kappa| square(kappa) * share(kappa)[c]);
            // The angle falls like a root just above k: κ = k + τ².
            let end = ((FAR / b - k).max(0.0)).sqrt();
            let rest = integral(0.0, end, 400, |tau| 2.0 * tau * square(k + tau * tau) * share(k + tau * tau)[c]);
            unit * (whole + rest)
        })
    }

    /// The same of one order n ≥ 1 of a body of rolling radius `radius`: ∂/∂k of [`HalfSpaceLoad::up_to`] over the radius.
    pub fn order(&self, n: usize, radius: f64) -> [f64; 3] {
        let k = n as f64 / radius;
        let (b, nu) = (self.patch.radius, self.poisson);
        let end = (FAR / (k * b)).max(1.0).acosh();
        let unit = 1.0 / (PI * PI * radius * self.shear);
        [0, 1, 2].map(|c| {
            let sum = integral(0.0, end, 400, |t| {
                let (across, along) = (t.tanh().powi(2), t.cosh().powi(-2));
                let angle = [1.0 - nu * along, 1.0 - nu * across, 1.0 - nu][c];
                self.patch.transform(k * t.cosh()).powi(2) * angle
            });
            unit * sum
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_load_is_that_of_the_bessel_function() {
        let patch = Patch { radius: 2.0 };
        // J1(1.2) = 0.498289057567216, J1(30) = −0.118751062616623.
        for (k, y, bessel) in [(0.75, 1.2, 0.498_289_057_567_216), (18.75, 1.2, -0.118_751_062_616_623)] {
            let wanted = 1.5 / 8.0 * 1.6 * bessel / k;
            assert!((patch.line(k, y) - wanted).abs() < 1e-13, "{} {wanted}", patch.line(k, y));
        }
        let total = integral(-2.0, 2.0, 4, |y| patch.line(0.0, y));
        assert!((total - 1.0).abs() < 1e-13, "{total}");
        assert!((patch.transform(0.0249) - patch.transform(0.025001)).abs() < 1e-5);
    }

    /// B_nn = 0.6(1−ν²)/(Eb), B_tt = B_nn (2−ν)/(2(1−ν)); each order is the derivative of the sum.
    #[test]
    fn the_orders_of_the_half_space_add_up_to_hertz() {
        let (young, nu, b) = (205e9, 0.3, 5e-3);
        let load = HalfSpaceLoad { patch: Patch { radius: b }, shear: young / 2.6, poisson: nu };
        let normal = 0.6 * (1.0 - nu * nu) / (young * b);
        let tangential = normal * (2.0 - nu) / (2.0 * (1.0 - nu));
        let all = load.up_to(FAR / b);
        for (found, wanted) in all.iter().zip([tangential, tangential, normal]) {
            assert!((found / wanted - 1.0).abs() < 1e-7, "{found:e} {wanted:e}");
        }
        let radius = 0.5;
        for n in [3usize, 40, 300] {
            let [low, high] = [-1e-3, 1e-3].map(|d| load.up_to((n as f64 + d) / radius));
            let order = load.order(n, radius);
            for c in 0..3 {
                let slope = (high[c] - low[c]) / 2e-3;
                assert!((order[c] / slope - 1.0).abs() < 1e-4, "{n} {c}: {:e} {slope:e}", order[c]);
            }
        }
    }
}
