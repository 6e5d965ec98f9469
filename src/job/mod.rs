//! The job file: strict, versioned JSON. It is parsed, overridden, checked against its schema and between its keys, and
//! returned with all defaults filled in; nothing is computed here.

mod branches;
mod compare;
mod contact_frames;
mod cycles;
mod damping;
mod edited;
#[cfg(test)]
pub(crate) mod example;
mod format;
mod hertz;
mod measured_inputs;
mod model;
mod overrides;
mod parse;
mod plausible;
mod published;
mod range;
mod schema;
mod sweep;
mod transient;
mod uncertainty;
mod validate;

pub(crate) use branches::key_unit;
pub use branches::{Branches, EarlierResult, Starts, StartsBy, RADIUS};
pub(crate) use compare::run_differences;
pub use compare::{differences, fe_inputs, Difference};
pub use cycles::{Branch, Cycles};
pub(crate) use damping::damping_lines;
pub use damping::undamped;
pub use edited::with_numbers;
pub use format::FORMAT;
pub(crate) use hertz::contact_radius;
pub use model::*;
pub use plausible::plausible;
pub use range::range;
pub use schema::schema;
pub use sweep::SweepPlan;
pub use transient::*;
pub(crate) use validate::MOST_NODES;

use crate::{Error, Result};
use format::JobFormat;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::io::Read;
use std::path::Path;

/// A job is text written by hand or by a script; anything larger is some other file.
const MAX_BYTES: u64 = 16 << 20;

/// Bytes of the job file. Call it on rank 0 and broadcast them: [`Job::from_bytes`] is the same on every rank.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    let fail = |e: std::io::Error| Error::Job(format!("{}: cannot read the job file: {e}", path.display()));
    let file = crate::input::open(path).map_err(fail)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(fail)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(Error::Job(format!(
            "{}: larger than {} MiB; this is no job file",
            path.display(),
            MAX_BYTES >> 20
        )));
    }
    Ok(bytes)
}

impl Job {
    /// Parses, overrides (`sets`: `PATH=VALUE`), validates and resolves a job. `path` names it in messages, and files
    /// named in the job are relative to its folder. `only` keeps the one analysis of that name.
    ///
    /// ```
    /// use railsqueal::job::Job;
    ///
    /// let text = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/two-cylinders.json"));
    /// let sets = ["contact.normal_load=50e3".to_string()];
    /// let job = Job::from_bytes(text, "jobs/two-cylinders.json".as_ref(), &sets, Some("steady"))?;
    /// assert_eq!(job.analyses.names(), ["steady"]);
    ///
    /// // A fault names its key.
    /// let wrong = ["contact.frictoin=0.3".to_string()];
    /// let error = Job::from_bytes(text, "jobs/two-cylinders.json".as_ref(), &wrong, None).unwrap_err();
    /// assert!(error.to_string().contains("frictoin"));
    /// # Ok::<(), railsqueal::Error>(())
    /// ```
    pub fn from_bytes(bytes: &[u8], path: &Path, sets: &[String], only: Option<&str>) -> Result<Job> {
        Self::of_format(bytes, path, sets, only, &JobFormat::PRESENT)
    }

    fn of_format(bytes: &[u8], path: &Path, sets: &[String], only: Option<&str>, format: &JobFormat) -> Result<Job> {
        let name = path.display().to_string();
        let checker = schema::Checker::default();
        let mut value = parse::parse(bytes, &name)?;
        report(&name, format.later(&value).into_iter().collect())?;
        overrides::apply(&mut value, sets, &checker)?;
        report(&name, format.later(&value).into_iter().collect())?;
        report(&name, checker.check(&value))?;
        let mut job: Job = from_json(&value).map_err(|e| {
            // The schema is made from the same types, so this is what the schema cannot express.
            Error::Job(format!("{name}: {}: {}", e.path(), e.inner()))
        })?;
        job.schema = None;
        report(&name, job.resolve_contacts())?;
        job.resolve_groups();
        job.resolve_rotation();
        if let Some(only) = only {
            keep_only(&mut job, only)?;
        }
        report(&name, job.resolve_measured_inputs())?;
        report(&name, validate::validate(&job))?;
        job.resolve_damping(&damping::stated(&value));
        let folder = path.parent().unwrap_or(Path::new(""));
        if let Some(wanted) = &job.analyses.sweep {
            job.sweep = Some(sweep::plan(&value, wanted, &name, folder, &checker)?);
        }
        if let Some(wanted) = &job.analyses.uncertainty {
            job.sweep = Some(uncertainty::plan(&value, wanted, &name, folder, &checker)?);
        }
        job.resolve(folder);
        job.changed_defaults = format.changed(&value, &job.to_json());
        job.version = format.number;
        Ok(job)
    }

    /// Makes the contacts of the bodies around one, and fills in what follows from the wheel that `contact.from` names,
    /// as stand-ins; the faults of a job that has not what it takes.
    fn resolve_contacts(&mut self) -> Vec<String> {
        let faults = self.resolve_named();
        if !faults.is_empty() || self.is_disc_with_pads() {
            return faults;
        }
        let Some(contact) = &mut self.contact else { return Vec::new() };
        contact.make_around();
        match (&self.curve, &self.vehicle, contact.from) {
            (Some(curve), Some(vehicle), from) => {
                contact.from = from.or(Some(ContactOfWheel { wheel: VehicleWheel::LeadingInner }));
                contact.stand_in(curve, &vehicle.data())
            }
            (curve, _, Some(_)) => {
                let missing = if curve.is_none() { "curve" } else { "vehicle" };
                vec![format!("{missing}: missing; contact.from names a wheel of a vehicle in a curve")]
            }
            _ => Vec::new(),
        }
    }

    /// Groups of Abaqus and CalculiX are in lower case, as their reader has them: their names do not depend on case.
    fn resolve_groups(&mut self) {
        let is_abaqus = |body: &Body| matches!(&body.mesh, Some(MeshSource::File(file)) if file.is_abaqus());
        let pads = self.contacts.first().map(|contact| &contact.between[1]);
        let pads = pads.and_then(|name| self.bodies.named.get(name)).or(self.bodies.upper.as_ref());
        if pads.is_some_and(is_abaqus) {
            let faces = self.contacts.iter_mut().filter_map(|contact| contact.pad_face.as_mut());
            faces.for_each(|group| *group = group.to_lowercase());
        }
        for body in self.bodies.all_mut() {
            if is_abaqus(body) {
                let supported = body.supports.iter_mut().map(|s| &mut s.group);
                body.fixed.iter_mut().chain(supported).for_each(|group| *group = group.to_lowercase());
            }
        }
    }

    /// A body that can turn and of which nothing else is said rolls.
    fn resolve_rotation(&mut self) {
        let inertia = self.contact.is_some() && self.analyses.modes.is_some();
        let placed = self.placement().is_some();
        let lower = usize::from(self.bodies.lower.is_some());
        for (number, body) in self.bodies.all_mut().enumerate() {
            // A wheel on a placement has its axle there.
            let axle = body.axle().is_some() || (placed && number >= lower && body.is_meshed());
            let held = !body.fixed.is_empty() || body.suspension.is_some();
            let can = inertia && body.matrices.is_none() && held && axle;
            let name = if can { RotationName::Rolling } else { RotationName::None };
            body.rotation.get_or_insert(Rotation::Named(name));
        }
    }

    fn resolve(&mut self, folder: &Path) {
        let graded = self.contact.is_some();
        if self.is_swept() {
            self.output.swept_modes.get_or_insert(self.output.fields);
        }
        // A section and a profile have no mesh on which all could be shown.
        self.output.fields &=
            !self.is_swept() && self.bodies().iter().all(|(_, b)| b.profile.is_none() || b.is_meshed());
        // Absolute, so that the resolved job means the same file wherever it is kept.
        let absolute = |file: &mut std::path::PathBuf| {
            let path = folder.join(&*file);
            *file = std::path::absolute(&path).unwrap_or(path);
        };
        self.solver.out_of_core.iter_mut().for_each(absolute);
        if let Some(cycles) = &mut self.analyses.cycles {
            cycles.starts.results.iter_mut().for_each(|r| absolute(&mut r.file));
        }
        if let Some(rough) = self.contact.as_mut().and_then(|c| c.roughness.as_mut()) {
            rough.paths_mut().for_each(absolute);
        }
        for body in self.bodies.all_mut() {
            if let Some(m) = &mut body.matrices {
                m.paths_mut().into_iter().for_each(absolute);
            }
            if let Some(Profile::File(file)) = &mut body.profile {
                absolute(&mut file.path);
            }
            match &mut body.mesh {
                None => {}
                Some(MeshSource::Revolved(Revolved { section: Section::File(file), .. })) => absolute(&mut file.path),
                Some(MeshSource::Revolved(_)) => {}
                Some(MeshSource::Extruded(extruded)) => {
                    if let RailSection::File(file) = &mut extruded.section {
                        absolute(&mut file.path);
                    }
                    body.track.get_or_insert_default();
                }
                Some(MeshSource::Cylinder(c)) => {
                    let default = if graded { c.element_size.max(0.25 * c.thickness) } else { c.element_size };
                    c.max_element_size.get_or_insert(default);
                }
                Some(MeshSource::File(file)) => absolute(file.path_mut()),
            }
        }
    }
}

fn keep_only(job: &mut Job, only: &str) -> Result<()> {
    let turns = job.all_bodies().iter().any(|(_, b)| b.rotates());
    let analyses = &mut job.analyses;
    let given = analyses.names();
    if !given.contains(&only) {
        let words: Vec<String> = given.iter().map(|s| s.to_string()).collect();
        let near = schema::nearest(only, &words).map_or(".".into(), |n| format!("; did you mean \"{n}\"?"));
        return Err(Error::Job(format!(
            "--only {only}: the job has no such analysis{near} It has {}",
            if words.is_empty() { "none".into() } else { schema::quoted(&words) }
        )));
    }
    // Stability and receptances are computed on the modes, and a sweep is one of stability; what turns has inertia
    // even in steady rolling.
    const ON_MODES: [&str; 8] =
        ["modes", "stability", "creep_curve", "sweep", "uncertainty", "receptance", "transient", "cycles"];
    if !turns && !ON_MODES.contains(&only) {
        analyses.modes = None;
    }
    if only != "curving" {
        analyses.curving = None;
    }
    if only != "track_decay" {
        analyses.track_decay = None;
    }
    if only != "steady" {
        analyses.steady = None;
    }
    // A transient may start from a mode of stability, a creep curve has the least stable eigenvalue.
    if !["stability", "creep_curve", "sweep", "uncertainty", "transient", "cycles"].contains(&only) {
        analyses.stability = None;
    }
    if only != "creep_curve" {
        analyses.creep_curve = None;
    }
    if only != "transient" {
        analyses.transient = None;
    }
    if only != "cycles" {
        analyses.cycles = None;
    }
    if only != "sweep" {
        analyses.sweep = None;
    }
    if only != "uncertainty" {
        analyses.uncertainty = None;
    }
    if only != "receptance" {
        analyses.receptance = None;
    }
    Ok(())
}

/// A part of a job from its JSON; an error has the path of the fault. All parts are read by this one function, since
/// the compiler makes the code that reads them anew for each kind of input: three were a tenth of all code.
pub(crate) fn from_json<T: DeserializeOwned>(
    value: &Value,
) -> std::result::Result<T, serde_path_to_error::Error<serde_json::Error>> {
    serde_path_to_error::deserialize(value)
}

/// At most this many faults are listed.
const MAX_FAULTS: usize = 12;

fn report(name: &str, faults: Vec<String>) -> Result<()> {
    match faults.len() {
        0 => Ok(()),
        1 => Err(Error::Job(format!("{name}: {}", faults[0]))),
        n => {
            let mut text = format!("{name}: {n} faults:");
            for fault in faults.iter().take(MAX_FAULTS) {
                text += &format!("\n  {fault}");
            }
            if n > MAX_FAULTS {
                text += &format!("\n  and {} more", n - MAX_FAULTS);
            }
            Err(Error::Job(text))
        }
    }
}

#[cfg(test)]
mod tests;
