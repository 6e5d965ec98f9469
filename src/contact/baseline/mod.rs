//! Creep forces of a contact that is one point: laws of the total forces on an elliptic contact of like half-spaces
//! under Hertz' pressure. What the discretised contact is compared with.
//!
//! Signs are those of the rest: the forces act on body 1, creepages are of body 1 against body 2, and the contact
//! rolls towards −x. So a positive creepage makes a negative force, and a positive spin, which creeps backwards at
//! the leading edge, a positive lateral one.

mod fastsim;
mod footprint;
mod kalker;
mod laws;
mod linearised;

pub use fastsim::fastsim;
pub use footprint::Footprint;
pub use kalker::{coefficients, Coefficients};
pub use laws::{linear, polach, shen_hedrick_elkins};
pub use linearised::LinearForce;

use super::interface::ContactCreepage;

/// A law of total forces: (x, y) on body 1, N.
pub type TotalForceLaw = fn(&EllipticContact, &ContactCreepage) -> [f64; 2];

/// The laws with their names in result files and in sentences.
pub const LAWS: [(&str, &str, TotalForceLaw); 4] = [
    ("linear", "Kalker's linear theory", linear),
    ("shen_hedrick_elkins", "Shen, Hedrick and Elkins", shen_hedrick_elkins),
    ("polach", "Polach", polach),
    ("fastsim", "FASTSIM", fastsim),
];

/// An elliptic contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipticContact {
    /// Half-axis along the rolling direction, m.
    pub a: f64,
    /// Half-axis across it, m.
    pub b: f64,
    /// Normal force, N.
    pub load: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Shear modulus of both bodies together, 1/G = (1/G1 + 1/G2)/2, Pa.
    pub shear: f64,
    /// Contact modulus of both bodies, 1/E* = Σ (1 − ν²)/E, Pa.
    pub plane: f64,
    /// Kalker's coefficients.
    pub kalker: Coefficients,
}

impl EllipticContact {
    /// The ellipse with the second moments of the pressures p at places (x, y), with the areas w: an ellipse under
    /// Hertz' pressure has ⟨x²⟩ = a²/5. `materials` are Young's modulus, Pa, and Poisson's ratio of both bodies,
    /// which together have ν/G = (ν1/G1 + ν2/G2)/2. None without pressure, or beyond Kalker's table.
    pub(crate) fn of_pressure(
        nodes: impl Iterator<Item = ([f64; 2], f64)> + Clone,
        friction: f64,
        materials: [(f64, f64); 2],
    ) -> Option<Self> {
        let sum = |of: &dyn Fn([f64; 2]) -> f64| nodes.clone().map(|(x, force)| of(x) * force).sum::<f64>();
        let load = sum(&|_| 1.0);
        let centre = [sum(&|x| x[0]) / load, sum(&|x| x[1]) / load];
        let half = |c: usize| (5.0 * sum(&|x| (x[c] - centre[c]).powi(2)) / load).sqrt();
        let (a, b) = (half(0), half(1));
        let soft = materials.map(|(young, poisson)| (1.0 + poisson) / young);
        // 1/2G each.
        let shear = 1.0 / (soft[0] + soft[1]);
        let poisson = shear * (materials[0].1 * soft[0] + materials[1].1 * soft[1]);
        let plane = 1.0 / materials.map(|(young, poisson)| (1.0 - poisson * poisson) / young).iter().sum::<f64>();
        let kalker = coefficients(poisson, a / b)?;
        (load > 0.0).then_some(Self { a, b, load, friction, shear, plane, kalker })
    }

    /// The ellipse of the same bodies under another normal force `load`, N: its half-axes go with the cube root of it.
    pub fn under(&self, load: f64) -> Self {
        let factor = (load / self.load).cbrt();
        Self { a: factor * self.a, b: factor * self.b, load, ..*self }
    }

    /// Stiffness of Hertz' contact, N/m: the force goes with δ^(3/2), so that dP/dδ = 3P/2δ, and δ = 3P K(e)/(2π E*
    /// max(a, b)) (K. L. Johnson, *Contact Mechanics* (1985), eq. 4.26c), where the arithmetic-geometric mean M gives
    /// the elliptic integral as K(e) = π max(a, b)/2M(a, b).
    pub(crate) fn normal_stiffness(&self) -> f64 {
        let (mut a, mut b) = (self.a, self.b);
        for _ in 0..60 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        2.0 * self.plane * a
    }

    /// The forces (x, y) of the linear theory, N.
    fn without_slip(&self, c: &ContactCreepage) -> [f64; 2] {
        let (area, k) = (self.shear * self.a * self.b, self.kalker);
        let spin = (self.a * self.b).sqrt() * k.spin * c.spin;
        [-area * k.longitudinal * c.longitudinal, -area * (k.lateral * c.lateral - spin)]
    }

    /// Largest friction, N.
    fn bound(&self) -> f64 {
        self.friction * self.load
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The contact of the benchmark: two steel bodies of 0.5 m, 70 kN, μ = 0.3.
    pub(super) fn benchmark() -> EllipticContact {
        let (young, poisson): (f64, f64) = (205e9, 0.3);
        let a = 4.884e-3;
        EllipticContact {
            a,
            b: a,
            load: 70e3,
            friction: 0.3,
            shear: young / (2.0 * (1.0 + poisson)),
            plane: young / (2.0 * (1.0 - poisson * poisson)),
            kalker: coefficients(poisson, 1.0).unwrap(),
        }
    }

    pub(super) fn creepage(longitudinal: f64, lateral: f64, spin: f64) -> ContactCreepage {
        ContactCreepage { longitudinal, lateral, spin }
    }

    /// Each law has the slope of the linear theory at rest, is odd, is mirrored with the creepages, and slides in the
    /// end with all of μN against the creep.
    #[test]
    fn laws_begin_as_the_linear_theory_and_end_in_full_sliding() {
        let e = benchmark();
        for (name, law, slope) in [
            ("Shen, Hedrick, Elkins", shen_hedrick_elkins as TotalForceLaw, 1e-3),
            ("Polach", polach as TotalForceLaw, 1e-3),
            ("FASTSIM", fastsim as TotalForceLaw, 0.02),
        ] {
            for c in [[1e-7, 0.0, 0.0], [0.0, 1e-7, 0.0], [0.0, 0.0, 1e-5], [1e-7, -2e-7, 0.0]] {
                let c = creepage(c[0], c[1], c[2]);
                let (got, want) = (law(&e, &c), linear(&e, &c));
                // Askew Polach's force is against the creep, of the size of the linear theory's.
                let size = |f: [f64; 2]| f[0].hypot(f[1]);
                let apart = match c.longitudinal * c.lateral {
                    0.0 => size([got[0] - want[0], got[1] - want[1]]) / size(want),
                    _ => (size(got) / size(want) - 1.0).abs(),
                };
                assert!(apart < slope, "{name}, {c:?}: {got:?} against {want:?}");
                let back = law(&e, &c.scaled(-1.0));
                assert!((0..2).all(|k| (got[k] + back[k]).abs() < 1e-9 * e.bound()), "{name} is not odd");
            }
            for direction in [[1.0, 0.0], [0.0, -1.0]] {
                let f = law(&e, &creepage(0.5 * direction[0], 0.5 * direction[1], 0.0));
                let want = direction.map(|d| -e.bound() * d);
                assert!((0..2).all(|k| (f[k] - want[k]).abs() < 0.02 * e.bound()), "{name}: {f:?} against {want:?}");
            }
            // Askew the first and the last keep to the direction of the linear theory, which is not quite that of the
            // creep.
            let f = law(&e, &creepage(0.3, 0.4, 0.0));
            assert!((f[0].hypot(f[1]) / e.bound() - 1.0).abs() < 0.02 && f[0] < 0.0 && f[1] < f[0], "{name}: {f:?}");
            let [one, other] = [1.0, -1.0].map(|s| law(&e, &creepage(s * 0.002, 0.001, s * 0.0)));
            assert!(
                (one[0] + other[0]).abs() < 1e-9 * e.bound() && (one[1] - other[1]).abs() < 1e-9 * e.bound(),
                "{name}"
            );
        }
    }

    /// Second moments give the half-axes of Hertz' pressure back.
    #[test]
    fn the_ellipse_of_a_pressure_is_that_of_hertz() {
        let (a, b, n) = (3e-3, 5e-3, 200);
        let at = |i: usize, h: f64| h * (2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
        let nodes = (0..n * n).map(|k| {
            let (x, y) = (at(k % n, a), at(k / n, b));
            ([x + 1e-3, y], (1.0 - (x / a).powi(2) - (y / b).powi(2)).max(0.0).sqrt())
        });
        let found = EllipticContact::of_pressure(nodes, 0.3, [(205e9, 0.3), (70e9, 0.2)]).unwrap();
        assert!((found.a - a).abs() < 1e-3 * a && (found.b - b).abs() < 1e-3 * b, "{found:?}");
        let g = [205e9 / 2.6, 70e9 / 2.4];
        assert!((found.shear - 2.0 / (1.0 / g[0] + 1.0 / g[1])).abs() < 1.0);
    }

    /// Stiffness 2aE* of a circle; for an ellipse the slope of Hertz' force over the approach, by the integral K(e)
    /// itself.
    #[test]
    fn the_stiffness_is_that_of_hertz() {
        let round = benchmark();
        assert!((round.normal_stiffness() / (2.0 * round.a * round.plane) - 1.0).abs() < 1e-14);
        let approach = |e: &EllipticContact| {
            let (long, short) = (e.a.max(e.b), e.a.min(e.b));
            let n = 2000;
            let k: f64 = (0..n)
                .map(|i| (f64::from(i) + 0.5) * std::f64::consts::FRAC_PI_2 / f64::from(n))
                .map(|t| (1.0 - (1.0 - (short / long).powi(2)) * t.sin().powi(2)).sqrt().recip())
                .sum();
            let k = k * std::f64::consts::FRAC_PI_2 / f64::from(n);
            1.5 * e.load * k / (std::f64::consts::PI * e.plane * long)
        };
        for (a, b) in [(3e-3, 9e-3), (8e-3, 2e-3)] {
            let e = EllipticContact { a, b, ..round };
            let [more, less] = [1.001, 0.999].map(|f| e.under(f * e.load));
            let slope = (more.load - less.load) / (approach(&more) - approach(&less));
            assert!((e.normal_stiffness() / slope - 1.0).abs() < 1e-6, "{a} {b}: {slope:e}");
        }
    }
}
