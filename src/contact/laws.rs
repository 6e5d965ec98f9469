//! The laws of Signorini and Coulomb as projections, with nodal quadrature (formulation section 3).

/// Projection on the half-line p ≥ 0.
pub fn project_normal(p: f64) -> f64 {
    p.max(0.0)
}

/// Projection on the disc of radius `radius` ≥ 0.
pub fn project_disc(z: [f64; 2], radius: f64) -> [f64; 2] {
    let norm = z[0].hypot(z[1]);
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
    } else if z[0].hypot(z[1]) <= bound {
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
