//! The contact of two bodies as the job and the meshes describe it: interface, load, creepages, friction.

use super::bodies::{Bodies, Place};
use crate::body::half_space::HalfSpace;
use crate::contact::sliding::{SlidingDirection, SlidingProblem};
use crate::contact::{kernel, Creepage, LinearContact, LinearNode, NormalLoad, Slip, SteadyProblem, Stencil, Tangent};
use crate::fem::Material;
use crate::friction::FrictionLaw;
use crate::grid::ContactGrid;
use crate::grid::Interface;
use crate::job::{self, Direction, Load};
use crate::model::{ModalPair, ReducedModel};
use crate::{Error, Result};
use faer::Mat;

/// Creepages of the job.
pub fn creepage(contact: &job::Contact) -> Creepage {
    let c = contact.creepage;
    Creepage { longitudinal: c.longitudinal, lateral: c.lateral, spin: c.spin }
}

/// Load or approach of the job.
pub fn normal_load(contact: &job::Contact) -> NormalLoad {
    match contact.load() {
        Load::Normal(n) => NormalLoad::Force(n),
        Load::Approach(d) => NormalLoad::Approach(d),
    }
}

/// Steady rolling of the reduced model `root` under the contact of a job; solved as `wanted` says, or by the defaults of a job.
pub(super) fn steady_rolling<'a>(
    root: &'a ReducedModel,
    contact: &job::Contact,
    wanted: Option<&job::Steady>,
) -> SteadyProblem<'a> {
    let job::Steady { tolerance, max_iterations } = wanted.cloned().unwrap_or_default();
    SteadyProblem {
        interface: &root.interface,
        compliance: root.pair.compliance.as_ref(),
        friction: contact.friction,
        speed: contact.speed,
        creepage: creepage(contact),
        load: normal_load(contact),
        stencil: Stencil::default(),
        tolerance,
        max_iterations: max_iterations as usize,
    }
}

/// Direction of sliding of a contact point, a unit vector.
fn direction(point: &job::ContactPoint) -> [f64; 2] {
    let d = [0, 1].map(|c| point.direction.get(c).copied().unwrap_or(0.0));
    let norm = d[0].hypot(d[1]);
    d.map(|d| d / norm)
}

/// The points of a job as an interface; none of a job with a grid.
pub(super) fn points(contact: &job::Contact) -> Option<Result<Interface>> {
    let creep = |p: &job::ContactPoint| direction(p).map(|d| d * p.slip_velocity.unwrap_or(0.0));
    contact
        .points
        .as_ref()
        .map(|points| Interface::points(points.iter().map(|p| p.gap).collect(), points.iter().map(creep).collect()))
}

/// Whether the forces of the contact points are given one by one, where there are points: they do not follow from a load.
pub(super) fn given_forces(contact: &job::Contact) -> Option<&[job::ContactPoint]> {
    contact.points.as_deref().filter(|_| contact.normal_load.is_none() && contact.approach.is_none())
}

/// Steady sliding of contact points under given forces, linearised.
pub(super) fn sliding_points(points: &[job::ContactPoint], law: FrictionLaw) -> LinearContact {
    let node = |(node, p): (usize, &job::ContactPoint)| {
        // A law that depends on the velocity is taken at rest where none is given, and has no slope there; without a force neither matters.
        let v = p.slip_velocity.unwrap_or(0.0);
        let slope = p.slip_velocity.map_or(0.0, |v| law.slope(v));
        let slip = Slip::steady(p.force.unwrap_or(0.0), direction(p), v, law.coefficient(v), slope);
        LinearNode { node, tangent: Tangent::Slip(slip), convection: Vec::new() }
    };
    LinearContact { nodes: points.iter().enumerate().map(node).collect() }
}

/// Reactions (tx, ty, p) of contact points that slide under given forces, N, `[3n]`.
pub(super) fn reactions(points: &[job::ContactPoint], law: FrictionLaw) -> Vec<f64> {
    let of = |p: &job::ContactPoint| {
        let (force, mu) = (p.force.unwrap_or(0.0), law.coefficient(p.slip_velocity.unwrap_or(0.0)));
        let [x, y] = direction(p).map(|d| -mu * force * d);
        [x, y, force]
    };
    points.iter().flat_map(of).collect()
}

/// An error unless the load of `contact` can be borne by the points of the reduced model: every point has to yield along its normal, and no body may
/// be free to move under it.
pub(super) fn bears_load(model: &ReducedModel, reaction: &[f64]) -> Result<()> {
    let pair = &model.pair;
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
                "contact.normal_load: the {side} body is free to move under it, nothing holds it; give the force of each contact in \
                 contact.points.N.force, which is then balanced from outside"
            )));
        }
    }
    Ok(())
}

/// An error where a contact point does not yield along its normal: a load cannot be shared out to it.
fn yields(pair: &ModalPair) -> Result<()> {
    let rigid = |i: &usize| pair.compliance[(3 * i + 2, 3 * i + 2)] == 0.0;
    match (0..pair.compliance.nrows() / 3).find(rigid) {
        None => Ok(()),
        Some(i) => Err(Error::Job(format!(
            "contact.normal_load: neither body moves along the normal of contact {}, so that its share of the load is not determined; give \
             contact.points.N.force instead",
            i + 1
        ))),
    }
}

/// Steady sliding of all of the contact of a job. Of points each has to yield along its normal.
pub(super) fn steady_sliding<'a>(
    (interface, pair): (&'a Interface, &'a ModalPair),
    contact: &job::Contact,
    direction: Direction,
) -> Result<SlidingProblem<'a>> {
    if interface.are_points() {
        yields(pair)?;
    }
    Ok(SlidingProblem {
        interface,
        compliance: pair.compliance.as_ref(),
        friction: contact.friction,
        speed: contact.speed,
        creepage: creepage(contact),
        load: normal_load(contact),
        stencil: Stencil::default(),
        direction: match direction {
            Direction::Rigid => SlidingDirection::Rigid,
            Direction::Actual => SlidingDirection::Actual,
        },
    })
}

/// On rank 0: the points of the contact, or the grid both bodies share, and the gap between them.
pub(super) fn interface_of(contact: &job::Contact, bodies: &Bodies) -> Result<Interface> {
    if let Some(points) = points(contact) {
        return points;
    }
    let grids: Vec<&ContactGrid> = bodies.places.iter().filter_map(|p| p.grid.as_ref()).collect();
    let [lower, upper] = grids[..] else {
        return Err(Error::Defect("contact needs the contact grids of two bodies".into()));
    };
    // A thousandth of an element: much less than the grid error, much more than rounding in a mesh file.
    let spacing = lower.x.windows(2).chain(lower.y.windows(2)).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    ContactGrid::matched(lower, upper, 1e-3 * spacing)?;
    let gap = lower.z.iter().zip(&upper.z).map(|(l, u)| -l - u).collect();
    Interface::new(lower.x.clone(), lower.y.clone(), gap)
}

/// On rank 0: influence matrices of two half-spaces of the bodies' materials, m/N, `[3n, 3n]` each.
fn half_spaces(bodies: &Bodies, s: &Interface) -> Result<[Mat<f64>; 2]> {
    let of = |p: usize| half_space(&bodies.places[p])?.compliance(&s.x, &s.y);
    Ok([of(0)?, of(1)?])
}

/// The half-space of the material of a body of finite elements.
pub(super) fn half_space(place: &Place) -> Result<HalfSpace> {
    let missing = || Error::Defect(format!("body {} has no material", place.name));
    let Material { young, poisson, .. } = place.material.ok_or_else(missing)?;
    Ok(HalfSpace { young, poisson })
}

/// On rank 0: compliances near those of the finite-element bodies in both places, m/N, `[3n, 3n]` each: of half-spaces, completed
/// by the responses `probed` of each of [`Bodies::unique`] to forces on one node.
pub(super) fn near(bodies: &Bodies, s: &Interface, probed: &[[Vec<f64>; 3]]) -> Result<[Mat<f64>; 2]> {
    let mut both = half_spaces(bodies, s)?;
    for (c, place) in both.iter_mut().zip(&bodies.places) {
        kernel::complete(c, &s.x, &s.y, &probed[place.body])?;
    }
    Ok(both)
}
