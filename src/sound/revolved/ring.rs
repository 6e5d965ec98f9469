//! The field of a ring of sources whose strength goes with cos nφ.
//!
//! With the distance R² = ρ² + 4 r r′ sin²(φ/2) of a point on the ring of radius r′ from a point at the radius r, ρ
//! their distance in the plane of the section, the integrals ∫ f(φ) dφ/R over the ring have a peak of the width
//! ρ/√(rr′). The substitution sin χ = sn(u), χ = (π − φ)/2, with the complementary modulus m = ρ/R_max turns them
//! into (2/R_max) ∫ f du over the period 2K of what stays analytic in |Im u| < K′, the factor 1/R² of a derivative
//! included (its poles are those of 1/dn²). The sum over equal steps then converges as e^{−2πHK′/K} with the number H
//! of points on half the period, and K/K′ grows with the logarithm of 1/m only: a point close to the ring costs a few
//! more evaluations than one far away.

use crate::sound::panels::{Kernel, OutlinePoint};
use num_complex::Complex64;
use std::f64::consts::PI;

/// Natural logarithm of the relative error allowed.
const DIGITS: f64 = 19.0;
/// Points beside those that resolve the waves.
const SPARE: f64 = 4.0;

/// ∫ G cos nφ dφ, 1/m, and ∫ ∂G/∂n′ cos nφ dφ, 1/m², over a ring, G = e^{−ikR}/(4πR), for n = 0 … as far as `layers`
/// reaches.
#[derive(Debug, Clone, Default)]
pub struct Layers {
    /// [∫ G, ∫ ∂G/∂n′], `[orders]`.
    pub of_order: Vec<[Complex64; 2]>,
    /// cos φ, and the real and imaginary parts of both, at the points of the last ring.
    points: Vec<(f64, [f64; 4])>,
}

impl Layers {
    /// For the orders 0 to `last`.
    pub fn new(last: usize) -> Self {
        Self { of_order: vec![[Complex64::default(); 2]; last + 1], points: Vec::new() }
    }

    /// Integrates the kernel over `ring` at the point (r, y) `at` (m), with the wave number `k` (1/m). The point must
    /// not lie on the ring.
    pub fn integrate(&mut self, ring: &OutlinePoint, at: [f64; 2], k: f64) {
        let [dr, dy] = [ring.at[0] - at[0], ring.at[1] - at[1]];
        let across = 4.0 * at[0] * ring.at[0];
        let near = dr.hypot(dy);
        let far = (near * near + across).sqrt();
        let (m, modulus) = (near / far, across.sqrt() / far);
        let quarter = PI / (2.0 * agm(1.0, m));
        // A modulus of 0 has no ring to go round.
        let ratio = 2.0 * quarter * agm(1.0, modulus) / PI;
        let last = self.of_order.len() - 1;
        let waves = quarter * (2.0 * last as f64 + 0.5 * k * far * modulus * modulus) / PI;
        let points = 2 * ((0.5 * (DIGITS / (2.0 * PI) * ratio + waves + SPARE)).ceil() as usize);
        let step = quarter / points as f64;

        self.of_order.fill([Complex64::default(); 2]);
        // n′ times the vector from the point to the ring: this, and 2 r n_r sin²(φ/2) more.
        let (slope, turned) = (dr * ring.normal[0] + dy * ring.normal[1], 2.0 * at[0] * ring.normal[0]);
        self.points.clear();
        let mut add = |distance: f64, sine2: f64| {
            let (s, c) = (k * distance).sin_cos();
            let kr = k * distance;
            let along = -(slope + turned * sine2) / (distance * distance);
            // (1 + ikR) e^{−ikR}.
            let derivative = [along * (c + kr * s), along * (kr * c - s)];
            self.points.push((1.0 - 2.0 * sine2, [c, -s, derivative[0], derivative[1]]));
        };
        // Half of the points from the far end u = 0 of the ring, the other half from its near end, where v = K − u:
        // each with the digits it needs.
        let start = Jacobi::at(0.5 * step, m);
        let whole = start.plus(&start, modulus);
        let mut here = start;
        for _ in 0..points / 2 {
            add(far * here.dn, here.cn * here.cn);
            let sine = m * here.sn / here.dn;
            add(near / here.dn, sine * sine);
            here = here.plus(&whole, modulus);
        }
        self.sum(step / (PI * far));
    }

    /// Sums over the points with cos nφ, by recurrence from order to order; several points at once, so that they need
    /// not wait for each other.
    fn sum(&mut self, weight: f64) {
        const TOGETHER: usize = 4;
        for chunk in self.points.chunks(TOGETHER) {
            let (mut cosine, mut parts) = ([0.0; TOGETHER], [[0.0; 4]; TOGETHER]);
            for (i, (c, p)) in chunk.iter().enumerate() {
                (cosine[i], parts[i]) = (*c, p.map(|p| weight * p));
            }
            let (mut before, mut value) = (cosine, [1.0; TOGETHER]);
            for [g, d] in &mut self.of_order {
                let mut sum = [0.0; 4];
                for i in 0..TOGETHER {
                    (0..4).for_each(|c| sum[c] += parts[i][c] * value[i]);
                    (before[i], value[i]) = (value[i], 2.0 * cosine[i] * value[i] - before[i]);
                }
                *g += Complex64::new(sum[0], sum[1]);
                *d += Complex64::new(sum[2], sum[3]);
            }
        }
    }
}

impl Kernel for Layers {
    fn integrals(&mut self, source: &OutlinePoint, at: [f64; 2], k: f64) -> &[[Complex64; 2]] {
        Layers::integrate(self, source, at, k);
        // A radian of the ring is as long as its radius.
        self.of_order.iter_mut().flatten().for_each(|v| *v *= source.at[0]);
        &self.of_order
    }
}

/// Arithmetic–geometric mean of a ≥ b ≥ 0; 0 for b = 0.
fn agm(mut a: f64, mut b: f64) -> f64 {
    if b == 0.0 {
        return 0.0;
    }
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// Jacobi's elliptic functions at a point.
#[derive(Debug, Clone, Copy)]
struct Jacobi {
    sn: f64,
    cn: f64,
    dn: f64,
}

impl Jacobi {
    /// At `u` > 0 for the complementary modulus `m` > 0: descending Landen transformations (M. Abramowitz, I. A.
    /// Stegun, *Handbook of Mathematical Functions*, 1964, 16.4).
    fn at(u: f64, m: f64) -> Self {
        // The mean takes eight steps from m = 1e-16.
        let (mut a, mut b) = (1.0, m);
        let mut steps = [(0.0, 0.0); 16];
        let mut count = 0;
        while (a - b).abs() > 1e-15 * a && count < steps.len() {
            steps[count] = (0.5 * (a - b), 0.5 * (a + b));
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
            count += 1;
        }
        let mut phi = a * u * f64::powi(2.0, count as i32);
        for (c, a) in steps[..count].iter().rev() {
            phi = 0.5 * (phi + (c / a * phi.sin()).asin());
        }
        let (sn, cn) = phi.sin_cos();
        Self { sn, cn, dn: (cn * cn + (m * sn).powi(2)).sqrt() }
    }

    /// At the sum of two arguments, for the modulus `modulus` (the same, 16.17).
    fn plus(&self, other: &Self, modulus: f64) -> Self {
        let (a, b, square) = (self, other, modulus * modulus);
        let below = 1.0 / (1.0 - square * (a.sn * b.sn).powi(2));
        Self {
            sn: (a.sn * b.cn * b.dn + b.sn * a.cn * a.dn) * below,
            cn: (a.cn * b.cn - a.sn * b.sn * a.dn * b.dn) * below,
            dn: (a.dn * b.dn - square * a.sn * b.sn * a.cn * b.cn) * below,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same integrals by brute force: Gauss's points on intervals that halve towards φ = 0.
    fn brute(ring: &OutlinePoint, [r, y]: [f64; 2], k: f64, n: usize) -> [Complex64; 2] {
        let rule = crate::quadrature::legendre(24);
        let mut sum = [Complex64::default(); 2];
        let mut high = PI;
        for level in 0..46 {
            let low = if level == 45 { 0.0 } else { 0.5 * high };
            // Twelve parts of each interval: the waves.
            for part in 0..12 {
                let (a, b) = (low + (high - low) * part as f64 / 12.0, low + (high - low) * (part + 1) as f64 / 12.0);
                for (x, w) in &rule {
                    let phi = 0.5 * (a + b) + 0.5 * (b - a) * x;
                    let s2 = (0.5 * phi).sin().powi(2);
                    let [dr, dy] = [ring.at[0] - r, ring.at[1] - y];
                    let distance = (dr * dr + dy * dy + 4.0 * r * ring.at[0] * s2).sqrt();
                    let along = dr * ring.normal[0] + dy * ring.normal[1] + 2.0 * r * ring.normal[0] * s2;
                    let g = Complex64::from_polar(1.0, -k * distance) / (4.0 * PI * distance);
                    let d = -(1.0 + Complex64::i() * k * distance) * g * along / (distance * distance);
                    let factor = (b - a) * w * (n as f64 * phi).cos();
                    sum[0] += factor * g;
                    sum[1] += factor * d;
                }
            }
            high = low;
        }
        sum
    }

    #[test]
    fn rings_near_and_far_are_integrated_to_seven_digits() {
        let normal = [0.6, -0.8];
        let mut layers = Layers::new(12);
        for r in [1e-4, 0.03, 0.3, 0.48] {
            for (dr, dy) in [(1e-7, 2e-7), (1e-4, 0.0), (0.003, -0.004), (-0.02, 0.01), (0.1, 0.15), (0.0, 7.5)] {
                for k in [0.02, 3.0, 40.0, 130.0] {
                    let ring = OutlinePoint { at: [f64::abs(r + dr), dy], normal };
                    layers.integrate(&ring, [r, 0.0], k);
                    for n in [0, 1, 3, 8, 12] {
                        let wanted = brute(&ring, [r, 0.0], k, n);
                        // Beside what the ring makes of a uniform strength: high orders of a distant ring are next to
                        // nothing.
                        let size = brute(&ring, [r, 0.0], 0.0, 0);
                        for (kind, (found, wanted)) in layers.of_order[n].iter().zip(wanted).enumerate() {
                            let near = dr.hypot(dy);
                            let scale =
                                if kind == 0 { size[0].norm() } else { size[1].norm().max(size[0].norm() / near) };
                            let error = (found - wanted).norm() / scale;
                            assert!(error < 1e-7, "r {r}, {dr}, {dy}, k {k}, n {n}, {kind}: {error:.1e}");
                        }
                    }
                }
            }
        }
    }

    /// On the axis only order 0 is left: G of the distance, times 2π.
    #[test]
    fn the_axis_sees_order_0_only() {
        let ring = OutlinePoint { at: [0.3, 0.4], normal: [1.0, 0.0] };
        let mut layers = Layers::new(3);
        layers.integrate(&ring, [0.0, 0.0], 5.0);
        let g = Complex64::from_polar(2.0 * PI / (4.0 * PI * 0.5), -2.5);
        let wanted = [g, -(1.0 + Complex64::i() * 2.5) * g * 0.3 / 0.25];
        for (n, found) in layers.of_order.iter().enumerate() {
            for (found, wanted) in found.iter().zip(wanted) {
                let wanted = if n == 0 { wanted } else { Complex64::default() };
                assert!((found - wanted).norm() < 1e-12, "{n}: {found} {wanted}");
            }
        }
    }
}
