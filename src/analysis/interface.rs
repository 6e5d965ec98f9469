//! The contact of two bodies as the job and the meshes describe it: interface, load, creepages, friction.

use super::bodies::Bodies;
use crate::body::half_space::HalfSpace;
use crate::contact::sliding::{SlidingDirection, SlidingProblem};
use crate::contact::{kernel, Creepage, NormalLoad, SteadyProblem, Stencil};
use crate::fem::Material;
use crate::grid::ContactGrid;
use crate::grid::Interface;
use crate::job::{self, Direction, Load};
use crate::model::ModalPair;
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

/// Steady rolling under the contact of a job; solved as `wanted` says, or by the defaults of a job.
pub(super) fn steady_rolling<'a>(
    (interface, pair): (&'a Interface, &'a ModalPair),
    contact: &job::Contact,
    wanted: Option<&job::Steady>,
) -> SteadyProblem<'a> {
    let job::Steady { tolerance, max_iterations } = wanted.cloned().unwrap_or_default();
    SteadyProblem {
        interface,
        compliance: pair.compliance.as_ref(),
        friction: contact.friction.clone(),
        speed: contact.speed,
        creepage: creepage(contact),
        load: normal_load(contact),
        stencil: Stencil::default(),
        tolerance,
        max_iterations: max_iterations as usize,
    }
}

/// Residual of steady rolling that small motions are looked at about.
const AT_REST: f64 = 1e-10;

/// Steady rolling as [`steady_rolling`] has it, solved for as a state of rest.
pub(super) fn at_rest<'a>(
    model: (&'a Interface, &'a ModalPair),
    contact: &job::Contact,
    wanted: Option<&job::Steady>,
) -> SteadyProblem<'a> {
    let problem = steady_rolling(model, contact, wanted);
    SteadyProblem { tolerance: problem.tolerance.min(AT_REST), ..problem }
}

/// Steady sliding of all of the contact of a job.
pub(super) fn steady_sliding<'a>(
    (interface, pair): (&'a Interface, &'a ModalPair),
    contact: &job::Contact,
    direction: Direction,
) -> SlidingProblem<'a> {
    SlidingProblem {
        interface,
        compliance: pair.compliance.as_ref(),
        friction: contact.friction.clone(),
        speed: contact.speed,
        creepage: creepage(contact),
        load: normal_load(contact),
        stencil: Stencil::default(),
        direction: match direction {
            Direction::Rigid => SlidingDirection::Rigid,
            Direction::Actual => SlidingDirection::Actual,
        },
    }
}

/// On rank 0: the grid both bodies share and the gap between them.
pub(super) fn interface_of(bodies: &Bodies) -> Result<Interface> {
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
pub(super) fn half_spaces(bodies: &Bodies, s: &Interface) -> Result<[Mat<f64>; 2]> {
    let of = |m: &Material| HalfSpace { young: m.young, poisson: m.poisson }.compliance(&s.x, &s.y);
    Ok([of(&bodies.places[0].material)?, of(&bodies.places[1].material)?])
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
