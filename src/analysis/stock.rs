//! What the steps of a run make and later steps take.

use super::reduction::Reduction;
use super::reuse;
use super::run::Run;
use super::steps::Step;
use super::transient::{self, Inputs};
use super::{creep_curve, modes, receptance, stability, steady};
use crate::body::TraceModes;
use crate::case::bodies::Bodies;
use crate::case::foresee;
use crate::job;
use crate::output::datasets::reduced::{self, Origin, Reused};
use crate::output::{sha256, Table};
use crate::{Error, Result};

/// The model of an earlier run, where there is one; on rank 0.
type Earlier = Option<Option<Reused>>;

/// What the steps of a run have made so far.
pub struct Stock<'s> {
    bodies: Bodies<'s>,
    /// Free modes of each of [`Bodies::unique`], computed in this run.
    modes: Vec<TraceModes>,
    /// Whether the mode shapes that an earlier run wrote could be read, where they were wanted.
    shapes: Option<Result<()>>,
    /// The model of `--reuse`.
    reused: Earlier,
    /// The model that a run that is continued was begun with.
    kept: Earlier,
    origin: Option<Origin>,
    /// The reduced model.
    pub model: Option<Reduction>,
    found: Option<stability::Found>,
}

impl<'s> Stock<'s> {
    /// Nothing yet.
    pub fn new() -> Self {
        Self {
            bodies: Bodies::none(),
            modes: Vec::new(),
            shapes: None,
            reused: None,
            kept: None,
            origin: None,
            model: None,
            found: None,
        }
    }

    /// Collective: one step of `run`.
    pub fn perform(&mut self, step: Step, run: &mut Run<'s>) -> Result<()> {
        match step {
            Step::Earlier => self.read_earlier(run),
            Step::Bodies => {
                self.bodies = Bodies::build(run.petsc, run.job, run.meshes, run.progress, &mut run.summary)?;
                // Points of a sweep take the same files.
                if run.job.sweep.is_none() {
                    run.meshes.forget();
                }
                // What the contact does not allow is found before modes and compliance are made.
                let foreseen = run.world().on_root(|| foresee::of_run(run.job, &self.bodies))?;
                for text in foreseen.into_iter().flat_map(|report| report.warnings) {
                    run.progress.note(format!("warning: {text}"));
                    run.summary.warn(text);
                }
                Ok(())
            }
            Step::EarlierShapes => {
                self.read_shapes(run);
                Ok(())
            }
            Step::Solvers => self.solvers(run),
            Step::Modes => match self.earlier() {
                Some(there) => {
                    if let Some(there) = there {
                        modes::write_reused(run, &there.modes);
                    }
                    Ok(())
                }
                None => {
                    self.modes = modes::run(run, &mut self.bodies)?;
                    Ok(())
                }
            },
            Step::Geometry => self.bodies.write_shapes(&mut run.file),
            Step::Model => self.reduce(run),
            Step::Receptance => match (&run.job.analyses.receptance, &run.job.contact) {
                (Some(wanted), Some(contact)) => receptance::run(run, wanted, contact, self.model()?),
                _ => Ok(()),
            },
            Step::Stability => self.stability(run),
            Step::Steady => match (&run.job.analyses.steady, &run.job.contact, &self.model) {
                (Some(wanted), Some(contact), Some(model)) => steady::run(run, wanted, contact, &self.bodies, model),
                _ => Ok(()),
            },
            Step::CreepCurve => match (&run.job.analyses.creep_curve, &run.job.contact) {
                (Some(wanted), Some(contact)) => creep_curve::run(run, wanted, contact, self.model()?),
                _ => Ok(()),
            },
            Step::Transient => self.transient(run),
            Step::FreeSolvers => self.bodies.unique.iter_mut().try_for_each(|body| body.release()),
            Step::FreeModes => {
                self.bodies.forget_shapes();
                Ok(())
            }
        }
    }

    /// The modes of an earlier run, where they are not computed again; on rank 0.
    fn earlier(&self) -> Option<&Option<Reused>> {
        self.reused.as_ref().or(self.kept.as_ref().filter(|_| self.bodies.places.is_empty()))
    }

    fn model(&self) -> Result<&Reduction> {
        self.model.as_ref().ok_or_else(no_model)
    }

    fn read_earlier(&mut self, run: &mut Run) -> Result<()> {
        let (world, job, options) = (run.world(), run.job, run.options);
        if let Some(path) = &options.reuse {
            run.progress.stage("reading the reduced model of an earlier run");
            self.reused = Some(world.on_root(|| reuse::read(path, job))?);
        }
        // A run that is continued goes on with the model that it was begun with; what is made of matrices is the same again.
        if options.resume && !job.by_matrices() {
            self.kept = Some(world.on_root(|| transient::kept::read(run.segments()?, job))?);
        }
        Ok(())
    }

    fn read_shapes(&mut self, run: &mut Run) {
        let (Some(reused), Some(path)) = (&self.reused, &run.options.reuse) else { return };
        run.progress.stage("mode shapes of an earlier run");
        let model = reused.as_ref().map(|r| &r.model);
        self.shapes = Some(reuse::shapes::read(run.world(), &reuse::shapes::file(path), &mut self.bodies, model));
    }

    fn solvers(&mut self, run: &mut Run) -> Result<()> {
        // Shapes that cannot be read are not completed by static solves.
        if run.job.analyses.steady.is_none() && matches!(self.shapes, Some(Err(_))) {
            return Ok(());
        }
        self.bodies.factorise(run.job, run.progress, &mut run.summary)
    }

    fn reduce(&mut self, run: &mut Run) -> Result<()> {
        let (world, job, options) = (run.world(), run.job, run.options);
        let bodies = &mut self.bodies;
        let contact = contact(job)?;
        self.origin = match (&self.kept, &self.reused) {
            (Some(there), _) | (None, Some(there)) => there.as_ref().map(|r| r.origin.clone()),
            (None, None) => Some(reuse::origin(bodies, &self.modes)),
        };
        let model = match self.kept.take().or(self.reused.take()) {
            Some(there) => there.map_or_else(Reduction::elsewhere, |r| Reduction::of(r.model)),
            None => Reduction::build(world, job, contact, bodies, &self.modes, run.progress)?,
        };
        if options.resume {
            transient::kept::align(world, bodies, &model)?;
        }
        // A compliance that is only near the true one is of no use to another run.
        let whole = options.reuse.is_none() && !model.approximate;
        self.model = Some(model);
        if whole && job.output.reduced && contact.compliance.of_bodies() && !job.by_matrices() {
            let tables = world.on_root(|| self.tables(job))?.unwrap_or_default();
            match options.resume {
                // The segments have it.
                true => run.file.tables(tables),
                false => run.file.keep(tables)?,
            }
        }
        Ok(())
    }

    /// On rank 0: the reduced model as tables.
    fn tables(&self, job: &job::Job) -> Result<Vec<Table>> {
        reduced::tables(job, &self.origin.clone().unwrap_or_default(), self.model()?.root()?)
    }

    fn stability(&mut self, run: &mut Run) -> Result<()> {
        let (Some(wanted), Some(model)) = (&run.job.analyses.stability, &self.model) else { return Ok(()) };
        let shapes = self.shapes.as_ref().map_or(Ok(()), |s| s.as_ref().copied());
        let parts = stability::Parts { bodies: &self.bodies, shapes, model };
        self.found = stability::run(run, wanted, contact(run.job)?, &parts)?;
        Ok(())
    }

    fn transient(&mut self, run: &mut Run) -> Result<()> {
        let (job, options) = (run.job, run.options);
        let (Some(wanted), stop) = (&job.analyses.transient, run.stop) else { return Ok(()) };
        let keep = match options.resume || job.by_matrices() {
            true => None,
            false => run.world().on_root(|| self.tables(job))?,
        };
        let model = self.model.as_ref().ok_or_else(no_model)?;
        let segments = run.segments.clone();
        let kept = run.file.kept().map(std::path::Path::to_owned);
        let inputs = Inputs {
            job,
            wanted,
            contact: contact(job)?,
            bodies: &self.bodies,
            modes: &self.modes,
            model,
            found: self.found.as_ref(),
            options,
            stop,
            segments: segments.as_ref(),
            kept: kept.as_deref(),
        };
        transient::run(run, &inputs, keep.unwrap_or_default())
    }

    /// On rank 0: name and checksum of every input.
    pub fn checksums(&self, run: &Run) -> Result<Vec<(String, String)>> {
        let mut sums = self.bodies.checksums(run.job)?;
        if let Some(path) = &run.options.reuse {
            sums.push((path.display().to_string(), sha256(path)?));
        }
        Ok(sums)
    }
}

fn contact(job: &job::Job) -> Result<&job::Contact> {
    job.contact.as_ref().ok_or_else(|| Error::Defect("an analysis of the contact without one".into()))
}

fn no_model() -> Error {
    Error::Defect("an analysis before the reduced model".into())
}
