//! A law of total forces, linearised about steady rolling.

use super::EllipticContact;
use crate::contact::interface::ContactCreepage;
use crate::contact::LinearMemory;
use crate::friction::FrictionLaw;

/// Steps of the differences, over the creepage at which the linear theory alone reaches the bound of friction, over
/// the load and over the coefficient.
const STEP: f64 = 1e-5;

/// How the friction (x, y) on body 1 of a contact of one point follows small motions:
/// δF = −D δṡ + (∂F/∂P) δP + (∂F/∂μ) δμ, with the creep ṡ (m/s) and the normal force P.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearForce {
    /// F, N.
    pub force: [f64; 2],
    /// D, N·s/m.
    pub resistance: [[f64; 2]; 2],
    /// ∂F/∂P, 1.
    pub by_load: [f64; 2],
    /// ∂F/∂μ, N.
    pub by_friction: [f64; 2],
    /// The coefficient at the velocity of the rigid creep, where it depends on that.
    pub memory: Option<LinearMemory>,
}

impl LinearForce {
    /// Linearisation of `law` on the ellipse `e`, whose coefficient of friction is that of `friction` at the creep, at
    /// the creepages `c` and the rolling speed `speed`, m/s. The spin stays as it is.
    pub fn new(
        law: impl Fn(&EllipticContact, &ContactCreepage) -> [f64; 2],
        e: &EllipticContact,
        c: &ContactCreepage,
        speed: f64,
        friction: &FrictionLaw,
    ) -> Self {
        let creepage = c.longitudinal.hypot(c.lateral);
        let velocity = speed * creepage;
        let e = EllipticContact { friction: friction.coefficient(velocity), ..*e };
        let slope =
            |ahead: [f64; 2], behind: [f64; 2], distance: f64| [0, 1].map(|k| (ahead[k] - behind[k]) / distance);
        let stiffness = e.shear * e.a * e.b * e.kalker.lateral.min(e.kalker.longitudinal);
        let step = STEP * creepage.max(if e.bound() > 0.0 { e.bound() / stiffness } else { 1e-3 });
        let by_creepage = [[1.0, 0.0], [0.0, 1.0]].map(|d: [f64; 2]| {
            let moved = |by: f64| {
                let longitudinal = c.longitudinal + by * d[0];
                law(&e, &ContactCreepage { longitudinal, lateral: c.lateral + by * d[1], ..*c })
            };
            slope(moved(step), moved(-step), 2.0 * step)
        });
        let loaded = |factor: f64| law(&e.under(factor * e.load), c);
        let rubbed = |factor: f64| law(&EllipticContact { friction: factor * e.friction, ..e }, c);
        let [more, less] = [1.0 + STEP, 1.0 - STEP];
        let direction = if creepage > 0.0 { [c.longitudinal, c.lateral].map(|c| c / creepage) } else { [1.0, 0.0] };
        let memory = LinearMemory::at_a_point(friction, 0, direction, e.load, velocity).map(|mut memory| {
            // About rest the velocity of sliding is of second order.
            memory.relaxation.gain *= if creepage > 0.0 { 1.0 } else { 0.0 };
            memory
        });
        let by_friction = match e.friction > 0.0 {
            true => slope(rubbed(more), rubbed(less), 2.0 * STEP * e.friction),
            false => [0.0; 2],
        };
        Self {
            force: law(&e, c),
            resistance: [0, 1].map(|row| [0, 1].map(|column| -by_creepage[column][row] / speed)),
            by_load: slope(loaded(more), loaded(less), 2.0 * STEP * e.load),
            by_friction,
            memory,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{benchmark, creepage};
    use super::super::{linear, shen_hedrick_elkins};
    use super::*;

    /// The linear theory resists with G a b C/V and goes with P^(2/3), Shen–Hedrick–Elkins' law with that at rest,
    /// and sliding with μP along the creep and nothing against more of it.
    #[test]
    fn laws_have_the_slopes_of_their_formulas() {
        let (e, speed, mu) = (benchmark(), 10.0, FrictionLaw::Constant(0.3));
        let [stiff, along] = [e.kalker.lateral, e.kalker.longitudinal].map(|c| e.shear * e.a * e.b * c / speed);
        let rest = creepage(0.0, 0.0, 0.0);
        for law in [linear, shen_hedrick_elkins] {
            let found = LinearForce::new(law, &e, &rest, speed, &mu);
            let [[xx, xy], [yx, yy]] = found.resistance;
            assert!((xx / along - 1.0).abs() < 1e-4 && (yy / stiff - 1.0).abs() < 1e-4, "{found:?}");
            assert!(xy.abs() < 1e-9 * xx && yx.abs() < 1e-9 * xx && found.memory.is_none(), "{found:?}");
        }
        let found = LinearForce::new(linear, &e, &creepage(0.0, 0.001, 0.0), speed, &mu);
        let [x, y] = found.force;
        assert!(x == 0.0 && (found.by_load[1] / (2.0 / 3.0 * y / e.load) - 1.0).abs() < 1e-8, "{found:?}");
        let found = LinearForce::new(shen_hedrick_elkins, &e, &creepage(0.0, 0.03, 0.0), speed, &mu);
        let [[xx, xy], [yx, yy]] = found.resistance;
        assert!((found.force[1] + 0.3 * e.load).abs() < 1e-6 && (found.by_load[1] + 0.3).abs() < 1e-9, "{found:?}");
        assert!(
            (found.by_friction[1] / e.load + 1.0).abs() < 1e-9 && yy.abs() + xy.abs() + yx.abs() < 1e-3,
            "{found:?}"
        );
        // Across the creep the force turns with the direction that the linear theory has.
        let want = along / stiff * 0.3 * e.load / (speed * 0.03);
        assert!((xx / want - 1.0).abs() < 1e-6, "{xx:e}, expected {want:e}");
    }
}
