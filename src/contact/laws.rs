//! The laws of Signorini and Coulomb as projections, with nodal quadrature (`docs/theory.md`).

/// Coefficient of friction as a function of the sliding velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionLaw {
    /// Coulomb: the same at all velocities, 1.
    Constant(f64),
    /// μ(v) = μ_k + (μ_s − μ_k) exp(−v/v_d).
    Exponential {
        /// μ_s, at rest, 1.
        at_rest: f64,
        /// μ_k, in fast sliding, 1.
        kinetic: f64,
        /// v_d, m/s.
        decay_velocity: f64,
    },
}

impl FrictionLaw {
    /// μ at the sliding velocity `v` ≥ 0, m/s.
    pub fn coefficient(&self, v: f64) -> f64 {
        match *self {
            FrictionLaw::Constant(mu) => mu,
            FrictionLaw::Exponential { at_rest, kinetic, decay_velocity } => {
                kinetic + (at_rest - kinetic) * (-v / decay_velocity).exp()
            }
        }
    }

    /// True if the coefficient is the same at all velocities.
    pub fn is_constant(&self) -> bool {
        matches!(self, FrictionLaw::Constant(_))
    }

    /// dμ/dv at the sliding velocity `v`, s/m.
    pub fn slope(&self, v: f64) -> f64 {
        match *self {
            FrictionLaw::Constant(_) => 0.0,
            FrictionLaw::Exponential { at_rest, kinetic, decay_velocity } => {
                -(at_rest - kinetic) / decay_velocity * (-v / decay_velocity).exp()
            }
        }
    }
}

/// Projection on the half-line p ≥ 0.
pub fn project_normal(p: f64) -> f64 {
    p.max(0.0)
}

/// |z|; without the care of `hypot` for numbers whose squares overflow, which takes longer than the rest of the laws.
pub(crate) fn size(z: [f64; 2]) -> f64 {
    (z[0] * z[0] + z[1] * z[1]).sqrt()
}

/// Projection on the disc of radius `radius` ≥ 0.
pub fn project_disc(z: [f64; 2], radius: f64) -> [f64; 2] {
    let norm = size(z);
    if norm <= radius {
        z
    } else {
        let f = radius / norm;
        [f * z[0], f * z[1]]
    }
}

/// Status of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// No contact.
    Open = 0,
    /// Contact without sliding.
    Stick = 1,
    /// Contact with sliding.
    Slip = 2,
}

/// Natural map of the laws at one node and the status that the projections find there.
///
/// `p`, `t`: pressure and traction on body 1 (Pa); `gap` (m) and `creep` (m/s) as they follow from them; `rho_n` (Pa/m) and
/// `rho_t` (Pa·s/m) the arbitrary positive augmentation parameters. Returns p − max(0, p − ρ_n g) and
/// t − Proj(t − ρ_t ṡ) with the disc of radius μ times the projected pressure: all zero if and only if Signorini's and
/// Coulomb's laws hold.
pub fn natural_map(
    p: f64,
    t: [f64; 2],
    gap: f64,
    creep: [f64; 2],
    rho_n: f64,
    rho_t: f64,
    friction: f64,
) -> (f64, [f64; 2], State) {
    let q = project_normal(p - rho_n * gap);
    let z = [t[0] - rho_t * creep[0], t[1] - rho_t * creep[1]];
    let bound = friction * q;
    let d = project_disc(z, bound);
    let state = if q == 0.0 {
        State::Open
    } else if size(z) <= bound {
        State::Stick
    } else {
        State::Slip
    };
    (p - q, [t[0] - d[0], t[1] - d[1]], state)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_a_falling_law_is_its_derivative() {
        let law = FrictionLaw::Exponential { at_rest: 0.4, kinetic: 0.25, decay_velocity: 0.3 };
        assert_eq!(law.coefficient(0.0), 0.4);
        for v in [0.0, 0.1, 1.0] {
            let h = 1e-6;
            let d = (law.coefficient(v + h) - law.coefficient(v)) / h;
            assert!((law.slope(v) - d).abs() < 1e-5, "at {v}: {} against {d}", law.slope(v));
        }
    }

    #[test]
    fn natural_map_vanishes_exactly_where_the_laws_hold() {
        let at = |p, t, g, s| natural_map(p, t, g, s, 2.0, 3.0, 0.5);
        // Open, sticking, sliding against the traction.
        assert_eq!(at(0.0, [0.0, 0.0], 1.0, [1.0, 0.0]), (0.0, [0.0, 0.0], State::Open));
        assert_eq!(at(4.0, [1.0, -1.0], 0.0, [0.0, 0.0]), (0.0, [0.0, 0.0], State::Stick));
        assert_eq!(at(4.0, [0.0, -2.0], 0.0, [0.0, 5.0]), (0.0, [0.0, 0.0], State::Slip));
        // Pressure across a gap, sliding along the traction, sliding below the bound: none may pass.
        assert!(at(4.0, [0.0, 0.0], 0.1, [0.0, 0.0]).0 != 0.0);
        assert!(at(4.0, [0.0, 2.0], 0.0, [0.0, 5.0]).1 != [0.0, 0.0]);
        assert!(at(4.0, [0.0, -1.0], 0.0, [0.0, 0.1]).1 != [0.0, 0.0]);
        // Adhesion and penetration neither.
        assert!(at(-1.0, [0.0, 0.0], 0.0, [0.0, 0.0]).0 != 0.0);
        assert!(at(0.0, [0.0, 0.0], -0.1, [0.0, 0.0]).0 != 0.0);
    }
}
