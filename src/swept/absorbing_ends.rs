//! Ends of a rail that absorb, so that what runs away from the contact does not come back: for what moves across the
//! rail damping by the mass that grows from nothing, for what runs along it in compression, of waves much longer than
//! any end, dashpots where the period closes.

use std::f64::consts::PI;

/// α(x) = α_max (s/L_a)² over the length L_a before either end of a period L that has the contact in its middle, s
/// from where the end begins: forces −α(x) times mass times velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbsorbingEnds {
    /// The period L, m.
    pub period: f64,
    /// Length L_a of either end, m; at most half the period.
    pub length: f64,
    /// α_max, 1/s.
    pub damping: f64,
    /// Velocity c of dashpots ρc, N·s/m³, at x = ±L/2, which take up motions along the rail; 0: the damping by the
    /// mass is for them, too. m/s.
    pub along: f64,
}

impl AbsorbingEnds {
    /// ∫α cos(2πmx/L) dx over the period, m/s.
    fn wave(&self, m: usize) -> f64 {
        let (q, l) = (2.0 * PI * m as f64 / self.period, self.length);
        if m == 0 {
            return 2.0 * self.damping * l / 3.0;
        }
        // From the outer end inwards: cos(q(L/2 − u)) = (−1)^m cos qu.
        let half = 2.0 / (q * q * l) - 2.0 * (q * l).sin() / (q * q * q * l * l);
        let sign = if m.is_multiple_of(2) { 1.0 } else { -1.0 };
        2.0 * sign * self.damping * half
    }

    /// ∫α cos k_i x cos k_j x dx, m/s.
    pub fn cosines(&self, i: usize, j: usize) -> f64 {
        0.5 * (self.wave(i.abs_diff(j)) + self.wave(i + j))
    }

    /// Damping, by the dashpots at both sides of the closing of the period, of motions along the rail with cos k_i x
    /// and cos k_j x, m/s. Those with sin kx rest there.
    pub fn closing(&self, i: usize, j: usize) -> f64 {
        if (i + j).is_multiple_of(2) {
            2.0 * self.along
        } else {
            -2.0 * self.along
        }
    }

    /// ∫α sin k_i x sin k_j x dx, m/s.
    pub fn sines(&self, i: usize, j: usize) -> f64 {
        0.5 * (self.wave(i.abs_diff(j)) - self.wave(i + j))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integrals_are_those_of_summation() {
        let ends = AbsorbingEnds { period: 14.0, length: 5.0, damping: 6000.0, along: 0.0 };
        let steps = 200_000;
        let dx = ends.period / steps as f64;
        let sum = |f: &dyn Fn(f64) -> f64| -> f64 {
            let at = |i: usize| -0.5 * ends.period + (i as f64 + 0.5) * dx;
            let alpha = |x: f64| ends.damping * ((x.abs() - 2.0).max(0.0) / 5.0).powi(2);
            (0..steps).map(|i| alpha(at(i)) * f(at(i)) * dx).sum()
        };
        let k = |n: usize| 2.0 * PI * n as f64 / ends.period;
        for (i, j) in [(0, 0), (0, 3), (2, 2), (4, 7), (7, 4)] {
            let cosines = sum(&|x| (k(i) * x).cos() * (k(j) * x).cos());
            let sines = sum(&|x| (k(i) * x).sin() * (k(j) * x).sin());
            assert!((ends.cosines(i, j) - cosines).abs() < 1e-3, "{i} {j}: {} {cosines}", ends.cosines(i, j));
            assert!((ends.sines(i, j) - sines).abs() < 1e-3, "{i} {j}: {} {sines}", ends.sines(i, j));
        }
        assert_eq!(ends.sines(0, 3), 0.0);
    }
}
