//! The contact of two bodies as the job and the meshes describe it: interface, load, creepages, friction.

use super::bodies::{BuiltBodies, Place};
use crate::body::half_space::HalfSpace;
use crate::contact::full_sliding::{SlidingDirection, SlidingProblem};
use crate::contact::points::yield_to_load;
use crate::contact::{
    self, fe_correction, ContactCreepage, Influence, Loads, NormalLoad, PatchKinematics, SlidingPoint, SteadyProblem,
    Stencil,
};
use crate::fem::ElasticMaterial;
use crate::friction::PatchFriction;
use crate::grid::ContactGrid;
use crate::grid::Interface;
use crate::job::{self, Direction, Job, Load};
use crate::model::{Convolution, CoupledModel};
use crate::{Error, Result};
use faer::Mat;

/// Creepages of the job.
pub fn creepage(contact: &job::Contact) -> ContactCreepage {
    let c = contact.creepage;
    ContactCreepage { longitudinal: c.longitudinal, lateral: c.lateral, spin: c.spin }
}

/// Rolling of each contact of a job.
pub(crate) fn kinematics(contact: &job::Contact) -> Vec<PatchKinematics> {
    contact.all().map(|one| PatchKinematics { speed: one.speed, creepage: creepage(one) }).collect()
}

/// Friction of each contact of a job.
pub(crate) fn friction(contact: &job::Contact) -> PatchFriction {
    let further = contact.all().skip(1).map(|one| one.law().clone());
    PatchFriction::new(contact.law().clone(), further.collect())
}

/// Loads of the contacts of a job: a vertical one that they share, a lateral one beside it, or one each.
pub(crate) fn loads(contact: &job::Contact) -> Loads {
    match contact.vertical_load {
        Some(load) => {
            let angles: Vec<f64> = contact.all().map(|one| one.angle).collect();
            let begin = || contact.all().map(|one| one.normal_load.unwrap_or(0.0)).collect();
            match contact.lateral_force {
                Some(lateral) => Loads::vertical_and_lateral(&angles, [load, lateral], begin()),
                None => Loads::vertical(&angles, NormalLoad::Force(load)),
            }
        }
        None => Loads::of_patches(&contact.all().map(normal_load).collect::<Vec<_>>()),
    }
}

/// Load or approach of the job.
pub fn normal_load(contact: &job::Contact) -> NormalLoad {
    match contact.load() {
        Load::Normal(n) => NormalLoad::Force(n),
        Load::Approach(d) => NormalLoad::Approach(d),
    }
}

/// Steady rolling under the contact of a job; solved as `wanted` says, or by the defaults of a job.
pub(crate) fn steady_rolling<'a>(
    (interface, pair): (&'a Interface, &'a CoupledModel),
    contact: &job::Contact,
    wanted: Option<&job::Steady>,
) -> SteadyProblem<'a> {
    let job::Steady { tolerance, max_iterations } = wanted.cloned().unwrap_or_default();
    let compliance = pair.convolution.as_ref().map_or(pair.at_rest().into(), Influence::from);
    SteadyProblem {
        interface,
        compliance,
        friction: friction(contact),
        kinematics: kinematics(contact),
        loads: loads(contact),
        stencil: Stencil::default(),
        tolerance,
        max_iterations: max_iterations as usize,
    }
}

/// The contact points of a job; none of a job with a grid.
pub(crate) fn points(contact: &job::Contact) -> Option<Vec<SlidingPoint>> {
    let of = |p: &job::ContactPoint| {
        let d = [0, 1].map(|c| p.direction.get(c).copied().unwrap_or(0.0));
        let direction = d.map(|v| v / d[0].hypot(d[1]));
        SlidingPoint { direction, velocity: p.slip_velocity, force: p.force.unwrap_or(0.0), gap: p.gap }
    };
    contact.points.as_ref()?;
    Some(contact.all().flat_map(|one| one.points.iter().flatten()).map(of).collect())
}

/// The contact points, where the force of each is given: it does not follow from a load.
pub(crate) fn given_forces(contact: &job::Contact) -> Option<Vec<SlidingPoint>> {
    points(contact).filter(|_| contact.normal_load.is_none() && contact.approach.is_none())
}

/// Residual of steady rolling that small motions are looked at about.
const AT_REST: f64 = 1e-10;

/// Steady rolling as [`steady_rolling`] has it, solved for as a state of rest.
pub(crate) fn at_rest<'a>(
    model: (&'a Interface, &'a CoupledModel),
    contact: &job::Contact,
    wanted: Option<&job::Steady>,
) -> SteadyProblem<'a> {
    let problem = steady_rolling(model, contact, wanted);
    SteadyProblem { tolerance: problem.tolerance.min(AT_REST), ..problem }
}

/// Steady sliding of all of the contact of a job. Of points each has to yield along its normal.
pub(crate) fn steady_sliding<'a>(
    (interface, pair): (&'a Interface, &'a CoupledModel),
    contact: &job::Contact,
    direction: Direction,
) -> Result<SlidingProblem<'a>> {
    if interface.are_points() {
        yield_to_load(pair)?;
    }
    Ok(SlidingProblem {
        interface,
        compliance: pair.at_rest(),
        friction: friction(contact),
        kinematics: kinematics(contact),
        loads: loads(contact),
        stencil: Stencil::default(),
        direction: match direction {
            Direction::Rigid => SlidingDirection::Rigid,
            Direction::Actual => SlidingDirection::Actual,
        },
    })
}

/// On rank 0: the points of the contact, or the grid both bodies share, and the gap between them.
pub(crate) fn interface_of(job: &Job, contact: &job::Contact, bodies: &BuiltBodies) -> Result<Interface> {
    if job.is_disc_with_pads() {
        return super::disc_and_pads::interface(job);
    }
    if let Some(points) = points(contact) {
        return contact::points::interface(&points);
    }
    let [lower, upper] = &bodies.places[..] else {
        return Err(Error::Defect("contact needs the contact grids of two bodies".into()));
    };
    if lower.grids.is_empty() || lower.grids.len() != upper.grids.len() {
        return Err(Error::Defect(format!(
            "{} and {} contact grids of two bodies",
            lower.grids.len(),
            upper.grids.len()
        )));
    }
    let each = lower.grids.iter().zip(&upper.grids).map(|(lower, upper)| interface_between(lower, upper));
    Interface::joined(each.collect::<Result<Vec<_>>>()?)
}

/// The grid that both bodies share and the gap between them. Bodies that overlap are an error: the approach counts
/// from first touch.
pub(crate) fn interface_between(lower: &ContactGrid, upper: &ContactGrid) -> Result<Interface> {
    // A thousandth of an element: much less than the grid error, much more than rounding in a mesh file.
    let spacing = super::surfaces::spacing(lower);
    ContactGrid::matched(lower, upper, 1e-3 * spacing)?;
    let gap: Vec<f64> = lower.z.iter().zip(&upper.z).map(|(l, u)| -l - u).collect();
    let lowest = (0..gap.len()).min_by(|&a, &b| gap[a].total_cmp(&gap[b]));
    if let Some(i) = lowest.filter(|&i| gap[i] < -1e-3 * spacing) {
        let nx = lower.x.len();
        return Err(Error::Input(format!(
            "contact: the bodies overlap by {:.3e} m at x = {:.4e} m, y = {:.4e} m, where the lower one reaches \
             up to z = {:.3e} m and the upper one down to z = {:.3e} m; \
             expected first touch at the origin: move the meshes along z until both end at 0 there",
            -gap[i],
            lower.x[i % nx],
            lower.y[i / nx],
            lower.z[i],
            -upper.z[i]
        )));
    }
    Interface::new(lower.x.clone(), lower.y.clone(), gap)
}

/// On rank 0: the influence of half-spaces of the bodies' materials on each other; none where the grid is not uniform.
pub(crate) fn convolution(bodies: &BuiltBodies, s: &Interface) -> Result<Option<Convolution>> {
    let Some(patch) = s.only() else { return Ok(None) };
    let of = |p: usize| Convolution::of_half_space(&half_space(&bodies.places[p])?, &patch.x, &patch.y);
    let (Some(lower), Some(upper)) = (of(0)?, of(1)?) else { return Ok(None) };
    Convolution::combined(&lower, &upper).map(Some)
}

/// On rank 0: influence matrices of two half-spaces of the bodies' materials, m/N, `[3n, 3n]` each.
fn half_spaces(bodies: &BuiltBodies, s: &Interface) -> Result<[Mat<f64>; 2]> {
    let patch = s.single("a compliance of half-spaces")?;
    let of = |p: usize| half_space(&bodies.places[p])?.compliance(&patch.x, &patch.y);
    Ok([of(0)?, of(1)?])
}

/// The half-space of the material of a body of finite elements.
pub(crate) fn half_space(place: &Place) -> Result<HalfSpace> {
    let missing = || Error::Defect(format!("body {} has no material", place.name));
    let ElasticMaterial { young, poisson, .. } = place.material.ok_or_else(missing)?;
    Ok(HalfSpace { young, poisson })
}

/// On rank 0: compliances near those of the finite-element bodies in both places, m/N, `[3n, 3n]` each: of
/// half-spaces, completed by the responses `probed` of each of [`BuiltBodies::unique`] to forces on one node.
pub(crate) fn near(bodies: &BuiltBodies, s: &Interface, probed: &[[Vec<f64>; 3]]) -> Result<[Mat<f64>; 2]> {
    let patch = s.single("a compliance near that of finite elements")?;
    let mut both = half_spaces(bodies, s)?;
    for (c, place) in both.iter_mut().zip(&bodies.places) {
        fe_correction::complete(c, &patch.x, &patch.y, &probed[place.body])?;
    }
    Ok(both)
}
