//! Stability problem: the state of a job's contact, linearised, and the eigenvalues there.

use super::interface::{at_rest, friction, given_forces, steady_sliding};
use super::well_posed;
use crate::contact::points::linearised;
use crate::contact::{LinearContact, SlidingProblem, SteadyProblem, SteadySolution};
use crate::friction::PatchFriction;
use crate::grid::Interface;
use crate::job::{self, Direction, Job, StabilityState};
use crate::model::CoupledModel;
use crate::stability::nonlinear_eigen::SpectrumMemory;
use crate::stability::reduced::sharpness;
use crate::stability::{eigenvalues, spectrum, Equilibrium, Spectrum};
use crate::{Error, Result};

/// Result of rank 0 on the reduced model.
pub(crate) struct StabilityResult {
    /// The state; none where the forces of points are given.
    pub(crate) state: Option<Equilibrium>,
    pub(crate) contact: LinearContact,
    pub(crate) spectrum: Spectrum,
}

/// A state of rest: none where the forces of points are given; linearised; and its solution where it rolls.
type StateOfRest = (Option<Equilibrium>, LinearContact, Option<SteadySolution>);

/// Stability problem, on rank 0.
#[derive(Clone, Copy)]
pub(crate) struct StabilityProblem<'a> {
    pub(crate) job: &'a Job,
    pub(crate) stability: &'a job::Stability,
    pub(crate) contact: &'a job::Contact,
    pub(crate) model: (&'a Interface, &'a CoupledModel),
}

type StabilityRequest = fn(&job::Stability, &CoupledModel, &LinearContact, &SpectrumMemory) -> Result<Spectrum>;

impl StabilityProblem<'_> {
    /// The state and the eigenvalues about it, searched for from what `memory` has of the state before.
    pub(crate) fn analyse(&self, memory: &SpectrumMemory) -> Result<StabilityResult> {
        self.with(spectrum, memory)
    }

    /// The state and the eigenvalues about it, which may be without their motions.
    pub(crate) fn eigenvalues(&self, memory: &SpectrumMemory) -> Result<StabilityResult> {
        self.with(eigenvalues, memory)
    }

    fn with(&self, spectrum: StabilityRequest, memory: &SpectrumMemory) -> Result<StabilityResult> {
        let request = |contact: &LinearContact| spectrum(self.stability, self.model.1, contact, memory);
        let sharp = |contact: &LinearContact| sharpness(self.model.1, contact);
        self.begun_with(None, &sharp, request).map(|(found, _)| found)
    }

    /// The state, for which rolling begins with the solution `start`, and what `spectrum` says of it; and the solution
    /// where it rolls. Refused where a memory is too short by the `sharpness` of the linearised contact.
    pub(crate) fn begun_with(
        &self,
        start: Option<&SteadySolution>,
        sharpness: &dyn Fn(&LinearContact) -> Result<f64>,
        spectrum: impl FnOnce(&LinearContact) -> Result<Spectrum>,
    ) -> Result<(StabilityResult, Option<SteadySolution>)> {
        let (state, contact, rolling) = self.at_rest_with(&friction(self.contact), start)?;
        if sharpness(&contact)? >= 1.0 {
            well_posed::refuse_short(self.contact, |friction| sharpness(&self.at_rest_with(friction, None)?.1))?;
        }
        let spectrum = spectrum(&contact)?;
        Ok((StabilityResult { state, contact, spectrum }, rolling))
    }

    /// How near a memory is to being too short for the contact with the friction `friction`.
    pub(crate) fn sharpness(&self, friction: &PatchFriction) -> Result<f64> {
        sharpness(self.model.1, &self.at_rest_with(friction, None)?.1)
    }

    /// The state, and its linearisation.
    pub(crate) fn at_rest(&self) -> Result<(Option<Equilibrium>, LinearContact)> {
        self.at_rest_with(&friction(self.contact), None).map(|(state, contact, _)| (state, contact))
    }

    /// The same with this friction, beginning with the solution `start` of another state on this interface.
    fn at_rest_with(&self, friction: &PatchFriction, start: Option<&SteadySolution>) -> Result<StateOfRest> {
        let contact = self.contact;
        if let Some(points) = given_forces(contact) {
            return Ok((None, linearised(&points, friction.law(0)), None));
        }
        // Points slide as they are told to: nothing is deformed upstream of them.
        let (state, direction) = match self.model.0.are_points() {
            true => (StabilityState::Sliding, Direction::Rigid),
            false => (self.stability.state(), self.stability.direction),
        };
        let (state, linear, rolling): (Equilibrium, LinearContact, _) = match state {
            StabilityState::Sliding => {
                let problem = steady_sliding(self.model, contact, direction)?;
                let problem = SlidingProblem { friction: friction.clone(), ..problem };
                let found = problem.solve()?;
                let linear = problem.contact(&found);
                (found.into(), linear, None)
            }
            StabilityState::Steady => {
                let problem = at_rest(self.model, contact, self.job.analyses.steady.as_ref());
                let problem = SteadyProblem { friction: friction.clone(), ..problem };
                let found = problem.solve_from(start)?;
                let linear = problem.contact(&found);
                (found.clone().into(), linear, Some(found))
            }
        };
        if state.closed() == 0 {
            return Err(Error::Job(
                "analyses.stability: the contact is open, so nothing rubs; raise contact.approach or give a normal_load"
                    .into(),
            ));
        }
        Ok((Some(state), linear, rolling))
    }
}
