//! Contact points that stand alone: their steady sliding under given forces, and what a load on all of them asks of
//! the bodies.

use super::law::{LinearContact, LinearNode, Slip, Tangent};
use super::memory::LinearMemory;
use crate::friction::FrictionLaw;
use crate::grid::Interface;
use crate::model::CoupledModel;
use crate::{Error, Result};

/// A contact point that slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlidingPoint {
    /// Direction of sliding, a unit vector.
    pub direction: [f64; 2],
    /// Sliding velocity, m/s. Without it a law that depends on it is taken at rest, and has no slope there.
    pub velocity: Option<f64>,
    /// Normal force, N, where it is given.
    pub force: f64,
    /// Gap of the undeformed bodies, m.
    pub gap: f64,
}

impl SlidingPoint {
    /// Coefficient of friction in steady sliding, 1.
    pub fn coefficient(&self, law: &FrictionLaw) -> f64 {
        law.coefficient(self.velocity.unwrap_or(0.0))
    }

    /// Reaction (tx, ty, p), N.
    fn reaction(&self, law: &FrictionLaw) -> [f64; 3] {
        let mu = self.coefficient(law);
        let [x, y] = self.direction.map(|d| -mu * self.force * d);
        [x, y, self.force]
    }
}

/// The points as an interface.
pub fn interface(points: &[SlidingPoint]) -> Result<Interface> {
    let creep = |p: &SlidingPoint| p.direction.map(|d| d * p.velocity.unwrap_or(0.0));
    Interface::points(points.iter().map(|p| p.gap).collect(), points.iter().map(creep).collect())
}

/// Steady sliding under the given forces, linearised.
pub fn linearised(points: &[SlidingPoint], law: &FrictionLaw) -> LinearContact {
    let node = |(node, p): (usize, &SlidingPoint)| {
        let v = p.velocity.unwrap_or(0.0);
        // What a law that falls does beyond that is in the memories.
        let tangent = Tangent::Slip(Slip::steady(p.force, p.direction, v, p.coefficient(law), 0.0));
        LinearNode { node, tangent, convection: Vec::new() }
    };
    let memory = |(at, p): (usize, &SlidingPoint)| {
        let v = p.velocity.filter(|v| v * p.force > 0.0)?;
        LinearMemory::at_a_point(law, at, p.direction, p.force, v)
    };
    LinearContact {
        nodes: points.iter().enumerate().map(node).collect(),
        memory: points.iter().enumerate().filter_map(memory).collect(),
        ..LinearContact::default()
    }
}

/// Reactions (tx, ty, p) under the given forces, N, `[3n]`.
pub fn reactions(points: &[SlidingPoint], law: &FrictionLaw) -> Vec<f64> {
    points.iter().flat_map(|p| p.reaction(law)).collect()
}

/// An error where a point does not yield along its normal: a load cannot be shared out to it.
pub fn yield_to_load(pair: &CoupledModel) -> Result<()> {
    let rigid = |i: &usize| pair.compliance[(3 * i + 2, 3 * i + 2)] == 0.0;
    match (0..pair.compliance.nrows() / 3).find(rigid) {
        None => Ok(()),
        Some(i) => Err(Error::Job(format!(
            "contact.normal_load: neither body moves along the normal of contact {}, so that its share of the \
             load is not determined; give \
             contact.points.N.force instead",
            i + 1
        ))),
    }
}

/// An error where a body is free to move under the reactions, N, `[3n]`, of a load.
pub fn bear_load(pair: &CoupledModel, reaction: &[f64]) -> Result<()> {
    let scale = reaction.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    for k in (0..pair.omega.len()).filter(|&k| pair.omega[k] == 0.0) {
        let (mut force, mut size) = (0.0, 0.0f64);
        for (row, r) in reaction.iter().enumerate() {
            force += pair.modes[(row, k)] * r;
            size = size.max((pair.modes[(row, k)] * scale).abs());
        }
        if force.abs() > 1e-9 * size {
            let side = if k < pair.lower_modes { "lower" } else { "upper" };
            return Err(Error::Job(format!(
                "contact.normal_load: the {side} body is free to move under it, nothing holds it; give the \
                 force of each contact in \
                 contact.points.N.force, which is then balanced from outside"
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn friction_acts_against_sliding() {
        let point = SlidingPoint { direction: [0.6, -0.8], velocity: Some(2.0), force: 100.0, gap: 0.0 };
        let law = &FrictionLaw::Constant(0.3);
        let found = reactions(&[point], law);
        assert!(found.iter().zip([-18.0, 24.0, 100.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        let creep = interface(&[point]).unwrap().creep(0);
        assert!(creep.iter().zip([1.2, -1.6]).all(|(a, b)| (a - b).abs() < 1e-15), "{creep:?}");
        let friction = linearised(&[point], law).nodes[0].tangent.friction();
        assert!(friction.iter().zip([-0.18, 0.24]).all(|(a, b)| (a - b).abs() < 1e-15), "{friction:?}");
    }
}
