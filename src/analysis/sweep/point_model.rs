//! The model of a point of a study: shared with others, or of bodies that are interpolated over their profiles.

use super::places::PlacedBodies;
use super::{contact_of, outcome_of, with_problem};
use crate::case::axle_torque;
use crate::case::stability_problem::{StabilityProblem, StabilityResult};
use crate::contact::{LinearContact, SteadySolution};
use crate::job::{self, range, Job};
use crate::model::{CoupledModel, SharedModel};
use crate::output::datasets::sweep::Outcome;
use crate::stability::reduced::sharpness;
use crate::stability::Spectrum;
use crate::{Error, Result};

/// Search for the eigenvalues of bodies about a linearised contact.
pub(super) type Request<'r> = &'r mut dyn FnMut(&job::Stability, &CoupledModel, &LinearContact) -> Result<Spectrum>;

/// A point that is solved: its outcome, its spectrum, and its steady rolling.
pub(super) type SolvedPoint = (Outcome, StabilityResult, Option<SteadySolution>);

/// Growth rate of a mode that is followed.
#[derive(Debug, Clone, Copy)]
pub(super) struct FollowedRate {
    /// Number of the mode.
    pub mode: usize,
    /// Growth rate, 1/s.
    pub rate: f64,
    /// Modal assurance criterion with the mode of the job's own point.
    pub agreement: f64,
}

/// The model of some points.
pub(super) enum StudyModel<'m> {
    /// Bodies at one place.
    Shared(&'m mut SharedModel),
    /// Bodies at any of some places.
    Placed(&'m mut PlacedBodies),
}

impl StudyModel<'_> {
    /// The same, for a while.
    pub fn again(&mut self) -> StudyModel<'_> {
        match self {
            Self::Shared(model) => StudyModel::Shared(model),
            Self::Placed(bodies) => StudyModel::Placed(bodies),
        }
    }

    /// Number of modes of the lower body.
    pub fn lower_modes(&self) -> usize {
        match self {
            Self::Shared(model) => model.lower_modes(),
            Self::Placed(bodies) => bodies.lower_modes(),
        }
    }

    /// Makes the model as it is before any point was solved.
    pub fn renew(&mut self) {
        if let Self::Shared(model) = self {
            model.renew();
        }
    }

    /// A point, on this rank alone: rolling begins with `start`, and the eigenvalues are those that `request` finds.
    pub fn solved(&mut self, point: &Job, start: Option<&SteadySolution>, request: Request) -> Result<SolvedPoint> {
        match self {
            Self::Shared(model) => with_problem(model, point, |problem| {
                let bodies = problem.model.1;
                let sharp = |linear: &LinearContact| sharpness(bodies, linear);
                let (found, rolling) =
                    problem.begun_with(start, &sharp, |linear| request(problem.stability, bodies, linear))?;
                Ok((outcome_of(problem.contact, &found), found, rolling))
            }),
            Self::Placed(bodies) => placed(bodies, point, start, request),
        }
    }
}

/// A point on bodies that are interpolated.
fn placed(
    bodies: &mut PlacedBodies,
    point: &Job,
    start: Option<&SteadySolution>,
    request: Request,
) -> Result<SolvedPoint> {
    let (Some(stability), Some(contact)) = (&point.analyses.stability, &point.contact) else {
        return Err(Error::Defect("a point of a study without contact or stability".into()));
    };
    range(point)?;
    let mut model = bodies.model(point)?;
    let balanced = axle_torque::balanced(point, (&model.interface, &model.rolling))?;
    let (point, contact) = match &balanced {
        Some(job) => (job, contact_of(job)?),
        None => (point, contact),
    };
    if balanced.is_some() {
        model = bodies.model(point)?;
    }
    let problem = StabilityProblem { job: point, stability, contact, model: (&model.interface, &model.rolling) };
    // Of another place it may be on a grid of another size, or too far away to begin with.
    let start = start.filter(|s| s.pressure.len() == model.interface.len());
    // Dense matrices are made of the nodes that the contact asks for.
    let seen = |linear: &LinearContact| -> Result<(CoupledModel, LinearContact)> {
        let nodes = linear.places();
        Ok((model.at_nodes(&nodes)?, linear.on_places(&nodes)))
    };
    let sharp = |linear: &LinearContact| match linear.memory.is_empty() {
        true => Ok(0.0),
        false => seen(linear).and_then(|(bodies, linear)| sharpness(&bodies, &linear)),
    };
    let mut begun = |start| {
        problem.begun_with(start, &sharp, |linear| {
            let (bodies, linear) = seen(linear)?;
            request(stability, &bodies, &linear)
        })
    };
    let solved = match begun(start) {
        Err(Error::NotConverged(_) | Error::Job(_)) if start.is_some() => begun(None),
        solved => solved,
    };
    let (found, rolling) = solved?;
    let outcome = Outcome { interpolated: true, ..outcome_of(contact, &found) };
    Ok((outcome, found, rolling))
}
