//! The reduced model of a job's bodies: modes and compliance come from the finite elements (or the compliance from
//! half-spaces, which have no modes); everything after this works on it alone.

use super::deferred_correction;
use super::steps::Requirements;
use crate::body::half_space::{is_uniform, HalfSpaceBody, HalfSpaceContact};
use crate::body::hybrid::Lines;
use crate::body::positivity::refuse_negative;
use crate::body::{ElasticBody, TraceModes};
use crate::case::bodies::BuiltBodies;
use crate::case::interface::{convolution, half_space, interface_of, near};
use crate::grid::{Interface, Transfer};
use crate::job::{self, Compliance, Job, LinearSolver};
use crate::model::{shared, ContactTrace, ReducedModel, SharedModel};
use crate::parallel::World;
use crate::progress::Progress;
use crate::{Error, Result};

/// The reduced model on rank 0, nothing elsewhere.
pub struct Reduction {
    root: Option<ReducedModel>,
    /// True if the compliance is only near that of the finite elements, for steady rolling to correct by static solves.
    pub approximate: bool,
}

impl Reduction {
    /// Collective: the reduced model of the job's bodies with the `modes` of each of `BuiltBodies::unique` (none of
    /// them, where the job asks for none: the compliance is then all there is).
    pub fn build(
        world: &World,
        job: &Job,
        contact: &job::Contact,
        bodies: &BuiltBodies,
        modes: &[TraceModes],
        progress: &mut Progress,
    ) -> Result<Self> {
        let interface = world.on_root(|| interface_of(job, contact, bodies))?;
        progress.stage("compliance of the contact");
        let mut parts = Vec::new();
        let approximate = by_products(job);
        let mut probed = Vec::new();
        // Half-spaces alone need no matrix.
        let mut convolution = None;
        if contact.compliance == Compliance::HalfSpace && !approximate {
            let made = |s: &Interface| self::convolution(bodies, s);
            convolution = world.on_root(|| interface.as_ref().map_or(Ok(None), made))?.flatten();
        }
        let without = world.max(f64::from(u8::from(convolution.is_some()))) > 0.0;
        if without {
            progress.note("as a convolution");
        } else if approximate {
            for index in 0..bodies.unique.len() {
                probed.push(deferred_correction::probe(bodies.fields(index)?, bodies.grid_of(index))?);
            }
        } else if contact.compliance.of_bodies() {
            for (i, body) in bodies.unique.iter().enumerate() {
                let compliance = body.compliance(&mut |done, of| progress.step("contact rows", done, of))?;
                parts.extend(compliance.map(|compliance| match modes.get(i) {
                    Some(modes) => ContactTrace { modes: modes.clone(), compliance },
                    None => ContactTrace::statics(compliance),
                }));
            }
        } else {
            let patches = interface.as_ref().map_or(&[][..], |s| &s.patches);
            for p in &bodies.places {
                let position = |k: usize| p.positions.get(k).copied();
                let on = patches.iter().enumerate();
                let contacts: Vec<HalfSpaceContact> =
                    on.map(|(k, s)| HalfSpaceContact { lines: [&s.x, &s.y], position: position(k) }).collect();
                let body = HalfSpaceBody::with_contacts(world, p.name, half_space(p)?, &contacts);
                parts.extend(body.compliance(&mut |_, _| {})?.map(ContactTrace::statics));
            }
        }
        let root = world.on_root(|| {
            let interface = interface.ok_or_else(|| Error::Defect("no interface on rank 0".into()))?;
            if let Some(convolution) = convolution.take() {
                return ReducedModel::of_half_spaces(interface, convolution);
            }
            if approximate {
                parts = near(bodies, &interface, &probed)?.map(ContactTrace::statics).into();
            }
            let place = match (approximate || contact.compliance == Compliance::HalfSpace, &bodies.places[..]) {
                (false, [lower, upper]) => [lower.body, upper.body],
                _ => [0, 1],
            };
            let model = ReducedModel::assemble(job, interface, parts, place)?;
            residual_is_positive(bodies, &model)?;
            Ok(model)
        })?;
        Ok(Self { root: root.map(looked_through), approximate })
    }

    /// Collective: the model that the points of a sweep share, on every rank, where both bodies need few numbers at
    /// the contact and a state of rest sees half-spaces alone: what [`Reduction::build`] makes on rank 0 and
    /// [`SharedModel::broadcast`] brings to the others, but by every rank itself. None of other bodies.
    pub fn shared(
        world: &World,
        job: &Job,
        contact: &job::Contact,
        (bodies, modes): (&BuiltBodies, &[TraceModes]),
        progress: &mut Progress,
    ) -> Result<Option<SharedModel>> {
        let [lower, upper] = &bodies.places[..] else { return Ok(None) };
        if !job.is_loaded() || modes.len() != bodies.unique.len() {
            return Ok(None);
        }
        let few = bodies.unique.iter().map(|b| b.compact()).collect::<Result<Option<Vec<_>>>>()?;
        let interface = shared(world, world.on_root(|| interface_of(job, contact, bodies))?.as_ref())?;
        let uniform = interface.patches.iter().all(|p| is_uniform(&p.x) && is_uniform(&p.y));
        let (Some(few), true) = (few, uniform) else { return Ok(None) };
        let grids: Vec<Lines> = interface.patches.iter().map(|p| [p.x.clone(), p.y.clone()]).collect();
        progress.stage("compliance of the contact");
        let named: Vec<_> = bodies.unique.iter().map(|b| b.name()).zip(&few).collect();
        refuse_negative(world, &named, &grids)?;
        let parts = [lower, upper].map(|p| (&modes[p.body], &few[p.body]));
        SharedModel::of_compact(world, job, (interface, &grids), parts).map(Some)
    }

    /// On rank 0: the reduction to `model`.
    pub(crate) fn from_model(model: ReducedModel) -> Self {
        Self { root: Some(looked_through(model)), approximate: false }
    }

    /// Gives the bodies the rotation that they have in `job` ([`ReducedModel::turn`]).
    pub(super) fn turn(&mut self, job: &Job) -> Result<()> {
        self.root.as_mut().map_or(Ok(()), |root| root.turn(job))
    }

    /// Elsewhere: no model.
    pub fn elsewhere() -> Self {
        Self { root: None, approximate: false }
    }

    /// The model; to be asked for on rank 0 only.
    pub fn root(&self) -> Result<&ReducedModel> {
        self.root.as_ref().ok_or_else(|| Error::Defect("the reduced model is on rank 0".into()))
    }

    /// The model on rank 0, `None` elsewhere.
    pub fn on_root(&self) -> Option<&ReducedModel> {
        self.root.as_ref()
    }
}

/// The model, which knows whether its compliance is a convolution.
fn looked_through(mut model: ReducedModel) -> ReducedModel {
    if model.pair.convolution.is_none() {
        model.pair.find_convolution(&model.interface);
    }
    model
}

/// An error where bodies meet on a grid that is not of their nodes, and it sees more of the modes than the compliance
/// has.
fn residual_is_positive(bodies: &BuiltBodies, model: &ReducedModel) -> Result<()> {
    let averaged = |p: &crate::case::bodies::Place| {
        p.grid().is_some_and(|g| matches!(g.transfer, Some(Transfer::Averages { .. })))
    };
    if !bodies.places.iter().any(averaged) || model.pair.residual.llt(faer::Side::Lower).is_ok() {
        return Ok(());
    }
    Err(Error::Job(
        "contact.compliance: the residual compliance of the finite elements on the contact grid is not \
         positive: the grid is finer than what their faces show. \
         Take \"hybrid\", a finer mesh at the contact, or a larger contact.grid.spacing (not with a \
         contact.placement, whose grid follows from the profiles)"
            .into(),
    ))
}

/// Requirements of the reduced model on the bodies.
pub(super) fn needs(job: &Job) -> Requirements {
    let elements = job.contact.as_ref().is_some_and(|c| c.compliance.of_bodies());
    Requirements { solvers: elements, shapes: elements && job.analyses.modes.is_some() }
}

/// Returns whether the compliance of the bodies is left unmade: an iterative solver gives one displacement at a time,
/// which is enough for steady rolling where nothing else asks for the compliance.
pub(super) fn by_products(job: &Job) -> bool {
    let analyses = &job.analyses;
    job.contact.as_ref().is_some_and(|c| c.compliance == Compliance::Fe)
        && job.solver.linear == LinearSolver::Gamg
        && analyses.modes.is_none()
        && analyses.stability.is_none()
        && analyses.creep_curve.is_none()
        && analyses.transient.is_none()
        && analyses.cycles.is_none()
        && job.sweep.is_none()
}
