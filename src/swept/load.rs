//! Loads that are spread over a small circle of the surface, as the orders of Fourier see them, on a swept body and
//! on a half-space.
//!
//! Weight ω(x, y) = 3/(2πb²) √(1 − r²/b²), r² = x² + y²: Hertz' pressure of the force 1. Loads ω π_m e_c with π = (1,
//! x, y) along e_c = (x, y, n into the body) have the number 3m + c; they are forces and moments on the circle, and
//! the same means ⟨ω π_m, u_c⟩ are taken of displacements.

use super::contact::{SectionContact, Spot};
use super::load_frame::rotate_loads;
use super::{Forms, Path};
use crate::quadrature::legendre;
use faer::Mat;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Points in a part of an integral.
static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| legendre(8));

/// Points and weights for integrals over [a, b] by `panels` equal parts.
fn points(a: f64, b: f64, panels: usize) -> Vec<(f64, f64)> {
    let half = 0.5 * (b - a) / panels as f64;
    let panel = |k: usize| {
        let middle = a + half * (2 * k + 1) as f64;
        RULE.iter().map(move |(x, w)| (middle + half * x, half * w))
    };
    (0..panels).flat_map(panel).collect()
}

/// Number of loads.
pub const LOADS: usize = 9;

/// A value for each pair of loads.
pub type Square = [[f64; LOADS]; LOADS];

/// Family that each load of order n ≥ 1 moves: 0 (U cos nθ, V sin nθ, W cos nθ) or 1 (U sin nθ, −V cos nθ, W sin nθ).
pub const FAMILY: [usize; LOADS] = [1, 0, 0, 0, 1, 1, 1, 0, 0];

/// ∫ω … dx with cos nθ, sin nθ, and the tilt of e_r and e_θ against the fixed axes: along, cos θ; tilt, sin θ.
#[derive(Debug, Clone, Copy, Default)]
struct Round {
    cos: f64,
    x_sin: f64,
    cos_along: f64,
    sin_tilt: f64,
    x_cos_tilt: f64,
    x_sin_along: f64,
}

impl Round {
    /// Displacements times the weight, for each load without the factor y, in (U, V, W): u_x = u_r sin θ + u_θ cos θ,
    /// u_z = u_r cos θ − u_θ sin θ, n = −z.
    fn means(&self, n: usize) -> [[f64; 3]; 6] {
        let Round { cos, x_sin, cos_along, sin_tilt, x_cos_tilt, x_sin_along } = *self;
        if n == 0 {
            return [
                [0.0, cos_along, 0.0],
                [0.0, 0.0, cos],
                [-cos_along, 0.0, 0.0],
                [x_cos_tilt, 0.0, 0.0],
                [0.0; 3],
                [0.0, x_cos_tilt, 0.0],
            ];
        }
        [
            [sin_tilt, -cos_along, 0.0],
            [0.0, 0.0, cos],
            [-cos_along, sin_tilt, 0.0],
            [x_cos_tilt, x_sin_along, 0.0],
            [0.0, 0.0, x_sin],
            [-x_sin_along, -x_cos_tilt, 0.0],
        ]
    }
}

/// The circle of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadCircle {
    /// Its radius b, m.
    pub radius: f64,
}

impl LoadCircle {
    /// ∫ over x at the place y of ω times what [`Round`] names, of the order `n` on the rolling radius `radius`, m,
    /// or on a straight line of the period 2π `radius`.
    fn round(&self, n: usize, (radius, path): (f64, Path), y: f64) -> Round {
        let b = self.radius;
        let c = (b * b - y * y).max(0.0).sqrt();
        let n = n as f64;
        // x = c sin φ: periodic in φ, so equal steps converge faster than any power.
        let steps = 16 + (n * c / radius).ceil() as usize;
        let unit = 1.5 * c * c / (b * b * b) / steps as f64;
        let mut round = Round::default();
        for i in 0..steps {
            let phi = PI * i as f64 / steps as f64;
            let x = c * phi.sin();
            let weight = unit * phi.cos().powi(2);
            let (theta, (tilt, along)) = match path {
                Path::Axle => ((x / radius).asin(), (x / radius).asin().sin_cos()),
                Path::Line(_) => (x / radius, (0.0, 1.0)),
            };
            let (sin, cos) = (n * theta).sin_cos();
            round.cos += weight * cos;
            round.x_sin += weight * x * sin;
            round.cos_along += weight * cos * along;
            round.sin_tilt += weight * sin * tilt;
            round.x_cos_tilt += weight * x * cos * tilt;
            round.x_sin_along += weight * x * sin * along;
        }
        round
    }

    /// Γ: ∫∫ω π_m² of each load, 1 or m².
    pub fn moments(&self) -> [f64; LOADS] {
        std::array::from_fn(|k| if k < 3 { 1.0 } else { self.radius * self.radius / 5.0 })
    }

    /// F = ∫∫ω e^{−iκ·x} = 3 j1(s)/s, s = κb, and its derivative by κ, m.
    fn transform(&self, wavenumber: f64) -> [f64; 2] {
        let s = wavenumber * self.radius;
        if s < 0.05 {
            let q = s * s;
            let slope = -s / 5.0 * (1.0 - q / 14.0);
            return [1.0 - q / 10.0 * (1.0 - q / 28.0), self.radius * slope];
        }
        let f = 3.0 * (s.sin() / s - s.cos()) / (s * s);
        [f, self.radius * (3.0 * (s.sin() / s - f) / s)]
    }
}

/// The loads of one order on the nodes of the running line.
#[derive(Debug, Clone)]
pub struct LineLoad {
    order: usize,
    patch: LoadCircle,
    /// nθ_c, or kx_c along a line, rad.
    phase: f64,
    /// First amplitude of a node, and for each load the weights of its U, V and W.
    nodes: Vec<(usize, [[f64; 3]; LOADS])>,
}

impl LineLoad {
    /// The loads of the order `n` on `forms`, whose rolling radius is `radius`, m; along a line its period over 2π.
    pub fn new(forms: &Forms, patch: LoadCircle, n: usize, radius: f64) -> Self {
        Self::for_contact(forms, patch, n, &SectionContact::level(radius))
    }

    /// The loads of the order `n` on the spots of a contact, in its frame.
    pub(crate) fn for_contact(forms: &Forms, patch: LoadCircle, n: usize, contact: &SectionContact) -> Self {
        let mut nodes = Vec::new();
        for spot in contact.spots() {
            let turn = contact.turn(spot);
            for (at, mut loads) in on_spot(forms, patch, n, spot) {
                // The factors x and y of a load stay; its direction is turned.
                for c in 0..3 {
                    let column = rotate_loads(std::array::from_fn(|k| spot.share * loads[k][c]), turn);
                    loads.iter_mut().zip(column).for_each(|(load, value)| load[c] = value);
                }
                nodes.push((at, loads));
            }
        }
        Self { order: n, patch, phase: forms.path.wavenumber(n) * contact.along(), nodes }
    }

    /// First amplitude that is loaded.
    pub fn first(&self) -> usize {
        self.nodes.iter().map(|(at, _)| *at).min().unwrap_or(0)
    }

    /// The loads as columns of amplitudes, each of the family that it moves, `[order, 9]`.
    pub fn columns(&self, order: usize) -> Mat<f64> {
        let mut columns = Mat::zeros(order, LOADS);
        for (at, loads) in &self.nodes {
            for (k, load) in loads.iter().enumerate() {
                (0..3).for_each(|c| columns[(at + c, k)] += load[c]);
            }
        }
        columns
    }

    /// The means of the amplitudes of a column, `[order]`, each taken of the family that its load moves.
    pub fn means(&self, amplitudes: faer::ColRef<'_, f64>) -> [f64; LOADS] {
        let mut means = [0.0; LOADS];
        for (at, loads) in &self.nodes {
            for (mean, load) in means.iter_mut().zip(loads) {
                *mean += (0..3).map(|c| load[c] * amplitudes[at + c]).sum::<f64>();
            }
        }
        means
    }

    /// Γ of its circle, 1 or m².
    pub fn moments(&self) -> [f64; LOADS] {
        self.patch.moments()
    }

    /// Part of each mean of [`LineLoad::means`] in a motion of the family 0 or 1.
    pub fn shares(&self, family: usize) -> [f64; LOADS] {
        family_shares(self.order, self.phase, family)
    }
}

/// Part of each of the nine means at a contact in a motion of the family 0 or 1 of an order: the means are those of the
/// families about the contact, which lies at the angle `phase` of the waves, rad.
pub(crate) fn family_shares(order: usize, phase: f64, family: usize) -> [f64; LOADS] {
    let (s, c) = phase.sin_cos();
    let of = if family == 0 { [c, -s] } else { [s, c] };
    FAMILY.map(|own| if order == 0 { 1.0 } else { of[own] })
}

/// Loads of the order `n` on the edges of the running line under a spot, in the frame of the spot: first amplitude of a
/// node, and for each load the weights of its U, V and W.
fn on_spot(forms: &Forms, patch: LoadCircle, n: usize, spot: &Spot) -> Vec<(usize, [[f64; 3]; LOADS])> {
    let section = &forms.section;
    let mut nodes = Vec::new();
    for edge in &section.tread {
        let [first, last, middle] = edge.map(|i| spot.along(section.nodes[i]));
        let (low, high) = (first.max(-patch.radius), last.min(patch.radius));
        // An edge along the normal of the spot carries none of its loads, nor does one of another wheel.
        let elsewhere = forms.path == Path::Axle && spot.is_far_from(section.nodes[edge[2]]);
        if high <= low || elsewhere || last - first < UPRIGHT * section.length(edge) {
            continue;
        }
        // t = middle + s (last − first)/2 + s² (first + last − 2 middle)/2 along the edge.
        let (slope, bend) = (0.5 * (last - first), 0.5 * (first + last - 2.0 * middle));
        let place =
            |t: f64| (0..8).fold(0.0, |s: f64, _| s - (middle + s * (slope + s * bend) - t) / (slope + 2.0 * s * bend));
        let mut of_edge = [[[0.0; 3]; LOADS]; 3];
        for (t, step) in points(low, high, 2) {
            let s = place(t);
            let values = [0.5 * s * (s - 1.0), 0.5 * s * (s + 1.0), 1.0 - s * s];
            // Along a line it is the same everywhere.
            let radius = if forms.path == Path::Axle { spot.radius_at(t) } else { spot.radius };
            let means = patch.round(n, (radius, forms.path), t).means(n);
            for (node, value) in of_edge.iter_mut().zip(values) {
                for (k, load) in node.iter_mut().enumerate() {
                    let factor = if k < 6 { 1.0 } else { t };
                    load.iter_mut().zip(means[k % 6]).for_each(|(l, m)| *l += step * value * factor * m);
                }
            }
        }
        for (&node, loads) in edge.iter().zip(of_edge) {
            let Some(at) = forms.amplitude(node) else { continue };
            nodes.push((at, in_frame(&loads, spot.angle)));
        }
    }
    nodes
}

/// Loads along (x, y, n) of a level surface as loads along (x, t, n) of one of the slope angle `angle`, rad.
fn in_frame(loads: &[[f64; 3]; LOADS], angle: f64) -> [[f64; 3]; LOADS] {
    let columns: [[f64; LOADS]; 3] = std::array::from_fn(|c| rotate_loads(std::array::from_fn(|k| loads[k][c]), angle));
    std::array::from_fn(|k| [0, 1, 2].map(|c| columns[c][k]))
}

/// Extent of an edge along the tangent of a spot over its length below which it stands upright there.
const UPRIGHT: f64 = 1e-6;

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
    /// The circle of the loads.
    pub patch: LoadCircle,
    /// Shear modulus, Pa.
    pub shear: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

impl HalfSpaceLoad {
    /// κ times the means under the loads of the wave of size κ and of the direction α against x, m/N and so on, the
    /// mean over the four quadrants: what is even along x and along y.
    fn wave(&self, kappa: f64, alpha: f64) -> Square {
        let [value, slope] = self.patch.transform(kappa);
        let (nu, (s, c)) = (self.poisson, alpha.sin_cos());
        let coupling = 0.5 * (1.0 - 2.0 * nu);
        // ω, xω and yω in Fourier space, and the displacements of the surface, but for factors i and −i, which are in
        // `PHASE`.
        let load = [value, slope * c, slope * s];
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
        let b = self.patch.radius;
        let mut all = [[0.0; LOADS]; LOADS];
        let mut add = |kappa: f64, weight: f64| {
            let first = if kappa <= k { 0.0 } else { (k / kappa).acos() };
            for (alpha, step) in points(first, 0.5 * PI, 1) {
                accumulate(&mut all, &self.wave(kappa, alpha), weight * step / (PI * PI));
            }
        };
        for (kappa, step) in points(0.0, k, 8 + (k * b) as usize) {
            add(kappa, step);
        }
        // The angle falls like a root just above k: κ = k + τ².
        for (tau, step) in points(0.0, (FAR / b - k).max(0.0).sqrt(), PANELS) {
            add(k + tau * tau, 2.0 * tau * step);
        }
        all
    }

    /// The same of all wavenumbers.
    pub fn sum(&self) -> Square {
        self.up_to(FAR / self.patch.radius)
    }

    /// The same of one order n ≥ 1 of a body of rolling radius `radius`, m: ∂/∂k of [`HalfSpaceLoad::up_to`] over the
    /// radius.
    pub fn order(&self, n: usize, radius: f64) -> Square {
        let k = n as f64 / radius;
        let end = (FAR / (k * self.patch.radius)).max(1.0).acosh();
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

    #[test]
    fn the_line_load_is_that_of_the_bessel_function() {
        let patch = LoadCircle { radius: 2.0 };
        // ∫ω cos kx dx = (3/2b³) c J1(kc)/k; on a large radius nθ = kx. J1(1.2) = 0.498289057567216, J1(30) =
        // −0.118751062616623.
        for (k, y, bessel) in [(0.75, 1.2, 0.498_289_057_567_216), (18.75, 1.2, -0.118_751_062_616_623)] {
            let wanted = 1.5 / 8.0 * 1.6 * bessel / k;
            let round = patch.round((k * 1e6) as usize, (1e6, Path::Axle), y);
            assert!((round.cos - wanted).abs() < 1e-10, "{} {wanted}", round.cos);
            assert!((round.cos_along - wanted).abs() < 1e-10 && round.sin_tilt.abs() < 1e-5);
        }
        let sum = |f: &dyn Fn(f64) -> f64| points(-2.0, 2.0, 4).into_iter().map(|(y, w)| w * f(y)).sum::<f64>();
        let total = sum(&|y| patch.round(0, (1e6, Path::Axle), y).cos);
        let second = sum(&|y| y * y * patch.round(0, (1e6, Path::Axle), y).cos);
        assert!((total - 1.0).abs() < 1e-13 && (second - patch.moments()[8]).abs() < 1e-13, "{total} {second}");
        // Both ways to the transform and its slope.
        for s in [0.0249, 0.0251] {
            let [low, at, high] = [s - 1e-4, s, s + 1e-4].map(|s| patch.transform(s));
            assert!((at[1] - (high[0] - low[0]) / 2e-4).abs() < 1e-6, "{at:?}");
        }
    }

    /// B_nn = 0.6(1−ν²)/(Eb), B_tt = B_nn (2−ν)/(2(1−ν)); under a normal force the surface is drawn inwards; rocking
    /// in a fully loaded circle is the same about x and y; each order is the derivative of the sum.
    #[test]
    fn the_orders_of_the_half_space_add_up_to_hertz() {
        let (young, nu, b) = (205e9, 0.3, 5e-3);
        let load = HalfSpaceLoad { patch: LoadCircle { radius: b }, shear: young / 2.6, poisson: nu };
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
}
