//! Data that the steps of a run compute and later steps use.

use super::full_stability::FullComparison;
use super::reduction::Reduction;
use super::reuse;
use super::run::Run;
use super::steps::{self, seeks_shapes, Step};
use super::transient::{self, Inputs};
use super::{creep_curve, cycles, modes, receptance, stability, steady, sweep};
use crate::body::TraceModes;
use crate::case::axle_torque;
use crate::case::bodies::BuiltBodies;
use crate::case::preflight;
use crate::job::{self, TransientModel};
use crate::output::datasets::reduced::{self, Origin, ReusedModel};
use crate::output::{sha256, Table};
use crate::{Error, Result};

/// The model of an earlier run, where there is one; on rank 0.
type PriorRun = Option<Option<ReusedModel>>;

/// Data that the steps of a run have computed so far.
pub struct RunState<'s> {
    earlier: steps::PriorRun,
    bodies: BuiltBodies<'s>,
    /// Free modes of each of [`BuiltBodies::unique`]; those of an earlier run on rank 0, elsewhere their frequencies.
    modes: Vec<TraceModes>,
    /// Result of reading the mode shapes of an earlier run, where they were wanted.
    shapes: Option<Result<()>>,
    /// True if this run has computed the modes.
    computed: bool,
    /// The model of `--reuse`.
    reused: PriorRun,
    /// The model that a run that is continued was begun with.
    kept: PriorRun,
    origin: Option<Origin>,
    /// The reduced model.
    model: Option<Reduction>,
    found: Option<crate::case::stability_problem::StabilityResult>,
    /// Result that the full system found beside the mode that a full transient begins along.
    beside: Option<FullComparison>,
}

impl<'s> RunState<'s> {
    /// Nothing yet.
    pub fn new(earlier: steps::PriorRun) -> Self {
        Self {
            earlier,
            bodies: BuiltBodies::none(),
            modes: Vec::new(),
            shapes: None,
            computed: false,
            reused: None,
            kept: None,
            origin: None,
            model: None,
            found: None,
            beside: None,
        }
    }

    /// The job's own point for the points of a sweep, if its model could be made.
    pub fn base(&self) -> Option<sweep::Base<'_, 's>> {
        self.model.as_ref().map(|model| sweep::Base {
            model,
            bodies: &self.bodies,
            modes: &self.modes,
            found: self.found.as_ref(),
        })
    }

    /// Collective: one step of `run`.
    pub fn perform(&mut self, step: Step, run: &mut Run<'s>) -> Result<()> {
        match step {
            Step::PriorRun => self.read_earlier(run),
            Step::Bodies => {
                self.bodies = BuiltBodies::build(run.petsc, run.job, run.meshes, run.progress, &mut run.summary)?;
                // Points of a sweep take the same files.
                if run.job.sweep.is_none() {
                    run.meshes.forget();
                }
                Ok(())
            }
            Step::EarlierShapes => self.read_shapes(run),
            Step::Solvers => self.solvers(run),
            Step::Modes => self.make_modes(run),
            Step::EarlierModes => self.list_modes(run),
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
            Step::Cycles => match &run.job.analyses.cycles {
                Some(wanted) => cycles::run(run, wanted, self.model()?, (&self.bodies, &self.modes)),
                None => Ok(()),
            },
            Step::FreeSolvers => self.bodies.unique.iter_mut().try_for_each(|body| body.release()),
            Step::FreeModes => {
                self.bodies.forget_shapes();
                Ok(())
            }
        }
    }

    /// On rank 0: what an earlier run made, first that of a run that is continued.
    fn made_earlier(&self) -> Option<&ReusedModel> {
        self.kept.as_ref().or(self.reused.as_ref())?.as_ref()
    }

    /// Collective: computes the modes, which then are on the disk.
    fn make_modes(&mut self, run: &mut Run) -> Result<()> {
        let all = modes::compute_all(run.job, &mut self.bodies, run.progress)?;
        self.computed = true;
        // Those of finite elements are turned to the ones of the model instead.
        if run.job.is_swept() {
            run.world().on_root(|| self.made_earlier().map_or(Ok(()), |kept| reuse::same(&all, &kept.modes)))?;
        }
        if self.earlier.compliance() {
            run.summary.value("compliance", "from the earlier run; the modes are found again");
        }
        // Measured frequencies are not told from computed ones where the modes alone are kept.
        let measured = all.iter().any(|modes| !modes.computed.is_empty());
        if !run.options.resume && run.options.reuse.is_none() && keeps(run.job) && !measured {
            let shapes = match seeks_shapes(run.job, false) && self.bodies.on_meshes() {
                true => Some(modes::kept_shapes(run, &self.bodies, &all)?),
                false => None,
            };
            run.file.keep_shapes(shapes)?;
            let alike = self.bodies.unique.len() == 1;
            let tables = run.world().on_root(|| reduced::tables_of_modes(run.job, alike, &all))?;
            run.file.keep(&tables.unwrap_or_default(), false)?;
        }
        modes::list(run, &self.places(), &all)?;
        modes::show(run, &self.bodies, &all)?;
        self.modes = all;
        Ok(())
    }

    /// Collective: the modes of an earlier run become those of this one, with their shapes where they were kept.
    fn list_modes(&mut self, run: &mut Run) -> Result<()> {
        let found = self.made_earlier().map(|r| r.modes.clone());
        self.modes = modes::broadcast(run.world(), found);
        modes::list(run, &self.places(), &self.modes)?;
        let shown = run.job.output.fields && self.bodies.on_meshes();
        let text = match shown && matches!(self.shapes, Some(Ok(()))) && self.earlier.shapes {
            true => {
                modes::show(run, &self.bodies, &self.modes)?;
                "from the earlier run"
            }
            false => "from the earlier run; mode shapes are not written",
        };
        let what = if self.earlier.compliance() { "modes and compliance" } else { "modes" };
        run.summary.value(what, text);
        Ok(())
    }

    /// The places of the bodies, and which of those that differ are in them.
    fn places(&self) -> Vec<(&'static str, usize)> {
        match self.bodies.places.is_empty() {
            true => ["lower", "upper"].into_iter().zip([0, self.modes.len().min(2).saturating_sub(1)]).collect(),
            false => self.bodies.places.iter().map(|p| (p.name, p.body)).collect(),
        }
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
        // A run that is continued goes on with the model that it was begun with; what is made of matrices is the same
        // again.
        if options.resume && !job.is_reduced_anew() {
            self.kept = Some(world.on_root(|| transient::stored_model::read(run.segments()?, job))?);
        }
        Ok(())
    }

    fn read_shapes(&mut self, run: &mut Run) -> Result<()> {
        let left = reuse::shapes::of_unfinished(run.options).filter(|_| self.earlier.shapes);
        let file = left.clone().or(run.options.reuse.as_deref().map(reuse::shapes::file));
        let Some(file) = file else { return Ok(()) };
        run.progress.stage("mode shapes of an earlier run");
        let modes = self.made_earlier().map(|r| r.modes.clone());
        let read = reuse::shapes::read(run.world(), (&file, left.is_some()), &mut self.bodies, modes.as_deref());
        match left {
            // Without them the modes are made again.
            Some(file) => {
                read.map_err(|e| e.with(format!("Remove {}: the run then does without", file.display())))?;
                self.shapes = Some(Ok(()));
            }
            None => self.shapes = Some(read),
        }
        Ok(())
    }

    fn solvers(&mut self, run: &mut Run) -> Result<()> {
        // Shapes that cannot be read are not completed by static solves.
        if run.job.analyses.steady.is_none() && matches!(self.shapes, Some(Err(_))) {
            return Ok(());
        }
        self.bodies.factorise(run.job, run.progress, &mut run.summary)
    }

    fn reduce(&mut self, run: &mut Run) -> Result<()> {
        let (world, job, options, earlier) = (run.world(), run.job, run.options, self.earlier);
        let contact = contact(job)?;
        let there = self.kept.take().or(self.reused.take());
        let there = there.filter(|_| earlier.compliance());
        self.origin = match &there {
            Some(there) => there.as_ref().map(|r| r.origin.clone()),
            None => Some(reuse::origin((&self.bodies, contact.all().count()), &self.modes)?),
        };
        let made = there.is_none();
        let model = match there {
            Some(there) => there.and_then(|r| r.model).map_or_else(Reduction::elsewhere, Reduction::from_model),
            None => Reduction::build(world, job, contact, &self.bodies, &self.modes, run.progress)?,
        };
        // Of bodies that were made the contact was examined before.
        if self.bodies.places.is_empty() {
            let found = world.on_root(|| match model.on_root() {
                Some(root) => preflight::of_interface(job, &root.interface),
                None => Ok(preflight::PreflightReport::default()),
            })?;
            run.warn(found.map(|report| report.warnings).unwrap_or_default());
        }
        // Shapes that were kept are those of the model.
        if options.resume && self.shapes.is_none() {
            transient::stored_model::align(world, &mut self.bodies, &model)?;
        }
        // A compliance that is only near the true one is of no use to another run.
        // Of several contacts the model is kept as few numbers, or not at all where frequencies are measured.
        let measured = contact.all().count() > 1 && self.modes.iter().any(|modes| !modes.computed.is_empty());
        let whole = !measured && !model.approximate && (options.reuse.is_none() || earlier.own || made);
        self.model = Some(model);
        if whole && keeps(job) {
            let tables = world.on_root(|| self.tables(job))?.unwrap_or_default();
            // The segments have it, or what a run that failed has left.
            if made && !options.resume {
                run.file.keep(&tables, true)?;
            }
            run.file.tables(tables);
            if let (true, Some(path)) = (earlier.own, &options.reuse) {
                run.file.leave(path.clone());
            }
            if earlier.own {
                run.file.leave(run.file.shapes());
            }
        }
        if options.resume {
            run.file.leave(run.file.shapes());
        }
        self.balance(run)
    }

    /// Collective: gives the axle the angular speed of its torque, where the job has one.
    fn balance(&mut self, run: &mut Run) -> Result<()> {
        let Some(model) = &mut self.model else { return Ok(()) };
        let root = model.on_root().map(|root| (&root.interface, &root.pair));
        let Some((job, angular_speed)) = axle_torque::balanced_on_root(run.world(), run.job, root)? else {
            return Ok(());
        };
        model.turn(&job)?;
        run.summary.value("angular speed of the axle, by its torque", format!("{angular_speed:.6} rad/s"));
        for (number, one) in job.contact.iter().flat_map(job::Contact::all).enumerate() {
            let job::Creepage { longitudinal, lateral, spin } = one.creepage;
            let text = format!("longitudinal {longitudinal:.6}, lateral {lateral:.6}, spin {spin:.5} 1/m");
            run.summary.value(&format!("  creepages of contact {}", number + 1), text);
        }
        let text = "Angular speed of the axle, by contact.torque.";
        run.file.table(Table::scalar("/contact/angular_speed", "rad/s", text, angular_speed));
        let told = run.summary.warnings().to_vec();
        run.warn(job::range(&job)?.into_iter().filter(|text| !told.contains(text)));
        run.go_on_with(job);
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
        let (found, full) = stability::run(run, wanted, contact(run.job)?, &parts)?;
        self.found = found;
        let transient = run.job.analyses.transient.as_ref().filter(|t| t.model == TransientModel::Full);
        let begun = transient.and_then(|t| t.start.mode).filter(|_| !run.options.resume);
        if let (Some(full), Some(number)) = (full, begun) {
            self.beside = Some(FullComparison::nearest_to(run.world(), full, number)?);
        }
        Ok(())
    }

    fn transient(&mut self, run: &mut Run) -> Result<()> {
        let (job, options) = (run.job, run.options);
        let (Some(wanted), stop) = (&job.analyses.transient, run.stop) else { return Ok(()) };
        let keep = match options.resume || job.is_reduced_anew() {
            true => None,
            false => run.world().on_root(|| self.tables(job))?,
        };
        let model = self.model.as_ref().ok_or_else(no_model)?;
        let segments = run.segments.clone();
        let kept = run.file.kept_file().map(std::path::Path::to_owned);
        let inputs = Inputs {
            job,
            given: run.given,
            wanted,
            contact: contact(job)?,
            bodies: &self.bodies,
            places: &self.places(),
            modes: &self.modes,
            shapes: options.reuse.is_none() || self.earlier.shapes || self.computed,
            model,
            found: self.found.as_ref(),
            beside: self.beside.as_ref(),
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
        // What this output had left of an earlier run is no input of its own.
        if let Some(path) = run.options.reuse.as_ref().filter(|_| !self.earlier.own) {
            sums.push((path.display().to_string(), sha256(path)?));
        }
        Ok(sums)
    }
}

/// Returns whether modes and compliance are kept on the disk for later runs.
fn keeps(job: &job::Job) -> bool {
    let of_bodies = job.contact.as_ref().is_some_and(|c| c.compliance.of_bodies());
    job.output.reduced && of_bodies && !job.is_reduced_anew() && !job.analyses.on_contact().is_empty()
}

fn contact(job: &job::Job) -> Result<&job::Contact> {
    job.contact.as_ref().ok_or_else(|| Error::Defect("an analysis of the contact without one".into()))
}

fn no_model() -> Error {
    Error::Defect("an analysis before the reduced model".into())
}
