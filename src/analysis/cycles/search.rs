//! The bodies of a job over the key of its branches, and when the search has to stop.

use super::curve::CurveTable;
use crate::case::stability_problem::StabilityProblem;
use crate::case::transient_problem::TransientProblem;
use crate::cycles::{BranchExtent, Conditions, Family, Resolution};
use crate::grid::Interface;
use crate::job::{self, range, Branches, Job, StabilityState, StartState};
use crate::model::{CoupledModel, ModalDynamics, SharedModel};
use crate::stability::grows;
use crate::stability::nonlinear_eigen::SpectrumMemory;
use crate::stop::Stop;
use crate::{Error, Result};
use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::path::Path;
use std::time::{Duration, Instant};

/// The bodies and the key.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    pub(super) job: &'a Job,
    pub(super) wanted: &'a Branches,
    pub(super) model: (&'a Interface, &'a CoupledModel),
    /// The bodies at any value of the key, where it changes their damping or rotation.
    pub(super) bodies: Option<&'a RefCell<SharedModel>>,
    /// Contacts over the radius of the curve, where that is the key.
    pub(super) curve: Option<&'a CurveTable>,
    /// Memory of the search for eigenvalues about rest.
    pub(super) memory: &'a SpectrumMemory,
}

impl Family for Search<'_> {
    fn conditions(&self, key: f64) -> Result<Conditions> {
        let job = self.job_at(key)?;
        range(&job)?;
        let (transient, pair) = (self.transient()?, self.pair(&job)?);
        let rolling = self.rolling(&job, &transient, &pair)?;
        let ready = rolling.ready()?;
        let model = ready.model(&pair);
        let (_, settings) = ready.initial_state(&model, &rolling)?;
        Ok(Conditions { settings, interface: ready.interface().clone(), load: ready.load().to_vec() })
    }

    fn dynamics(&self, key: f64) -> Result<Option<ModalDynamics>> {
        self.bodies.map(|bodies| bodies.borrow().dynamics(&self.job_at(key)?)).transpose()
    }
}

impl<'a> Search<'a> {
    /// The job at a value of the key.
    pub(super) fn job_at(&self, key: f64) -> Result<Job> {
        match self.curve {
            Some(curve) => curve.job_at(self.job, key),
            None if self.job.branch_number(&self.wanted.along) == Some(key) => Ok(self.job.clone()),
            None => self.job.with_branch_number(&self.wanted.along, key),
        }
    }

    /// Both bodies with the damping and the rotation of `job`.
    pub(super) fn pair(&self, job: &Job) -> Result<Cow<'a, CoupledModel>> {
        Ok(match self.bodies {
            Some(bodies) => Cow::Owned(bodies.borrow_mut().pair(job)?.clone()),
            None => Cow::Borrowed(self.model.1),
        })
    }

    /// The values of the key at which unstable modes are looked for.
    pub(super) fn values(&self) -> Vec<f64> {
        match &self.wanted.starts.at[..] {
            [] => self.job.branch_number(&self.wanted.along).into_iter().collect(),
            given => given.to_vec(),
        }
    }

    /// The march of the first cycle as a transient.
    pub(super) fn transient(&self) -> Result<job::Transient> {
        Ok(self.wanted.march.transient(match self.stability()?.state() {
            StabilityState::Sliding => StartState::Sliding,
            StabilityState::Steady => StartState::Steady,
        }))
    }

    /// The transient of `job` on the bodies `pair`.
    pub(super) fn rolling<'b>(
        &self,
        job: &'b Job,
        wanted: &'b job::Transient,
        pair: &'b CoupledModel,
    ) -> Result<TransientProblem<'b>>
    where
        'a: 'b,
    {
        let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("limit cycles without contact".into()))?;
        Ok(TransientProblem { job, wanted, contact, model: (self.model.0, pair) })
    }

    fn stability(&self) -> Result<&'a job::Stability> {
        let stability = self.job.analyses.stability.as_ref();
        stability.ok_or_else(|| Error::Defect("limit cycles without stability".into()))
    }

    /// The eigenvalues about rest at a value of the key.
    pub(super) fn with_problem<T>(&self, key: f64, found: impl FnOnce(StabilityProblem<'_>) -> Result<T>) -> Result<T> {
        let job = self.job_at(key)?;
        let pair = self.pair(&job)?;
        let contact = job.contact.as_ref().ok_or_else(|| Error::Defect("limit cycles without contact".into()))?;
        found(StabilityProblem { job: &job, stability: self.stability()?, contact, model: (self.model.0, &pair) })
    }

    /// Growth rates about rest, 1/s, and frequencies, Hz, of the modes that oscillate, by falling growth rate; and
    /// whether each grows.
    pub(super) fn growth(&self, key: f64) -> Result<Vec<([f64; 2], bool)>> {
        let spectrum = self.with_problem(key, |problem| problem.eigenvalues(self.memory))?.spectrum;
        let moving = spectrum.eigenpairs.iter().filter(|e| e.frequency() > 0.0);
        Ok(moving.map(|e| ([e.value.re, e.frequency()], grows(e.value, e.backward_error))).collect())
    }

    /// Harmonics and steps of a cycle.
    pub(super) fn resolution(&self) -> Resolution {
        Resolution { harmonics: self.wanted.harmonics as usize, samples: self.wanted.samples as usize }
    }

    /// Extent of the branches.
    pub(super) fn extent(&self) -> BranchExtent {
        let wanted = self.wanted;
        BranchExtent {
            range: [wanted.from, wanted.to],
            most: wanted.most as usize,
            longest: wanted.longest,
            located: Some(super::LOCATED),
            stability: wanted.stability,
        }
    }
}

/// True for errors of one value of the key or of one start, which others may not have.
pub(super) fn is_local(e: &Error) -> bool {
    matches!(e, Error::Job(_) | Error::Input(_) | Error::NotConverged(_))
}

/// When this rank has to stop: on a signal, or before the limit of wall time.
pub(super) struct Clock<'s> {
    stop: &'s Stop,
    /// Beginning of the step at work, and the longest one so far.
    begun: Cell<Instant>,
    longest: Cell<Duration>,
    why: Cell<Option<&'static str>>,
}

impl<'s> Clock<'s> {
    pub(super) fn new(stop: &'s Stop) -> Self {
        let (begun, longest) = (Cell::new(Instant::now()), Cell::new(Duration::ZERO));
        Self { stop, begun, longest, why: Cell::new(None) }
    }

    /// Begins a step.
    pub(super) fn start_step(&self) {
        self.begun.set(Instant::now());
    }

    /// Ends a step, begins the next one and returns whether to go on.
    pub(super) fn goes_on(&self) -> bool {
        self.longest.set(self.longest.get().max(self.begun.get().elapsed()));
        self.start_step();
        if self.why.get().is_none() {
            self.why.set(self.stop.asked(self.longest.get()));
        }
        self.why.get().is_none()
    }

    /// True once the search has to stop.
    pub(super) fn is_over(&self) -> bool {
        self.why.get().is_some()
    }

    /// The end of the run: the same on every rank.
    pub(super) fn error(&self, folder: &Path, output: &Path) -> Error {
        Error::Stopped(format!(
            "stopped {} among the limit cycles; those that are done are kept in {}, and --resume {} takes them up",
            self.why.get().unwrap_or("on request"),
            folder.display(),
            output.display()
        ))
    }
}
