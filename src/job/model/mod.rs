//! The job as data: every key, its unit, its default and its simple bounds. The JSON Schema is generated from here,
//! and the bounds in it are the ones that reading enforces. SI units throughout.

mod absorber;
mod analyses;
mod body;
mod contact;
mod creepage;
mod curving;
mod face_contact;
mod matrices;
mod measured;
mod placement;
mod rail;
mod receptance;
mod roughness;
mod support;
mod swept;
mod uncertainty;
mod wheel;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::format::FORMAT;
use super::sweep::SweepPlan;

pub use absorber::*;
pub use analyses::*;
pub use body::*;
pub use contact::*;
pub use creepage::*;
pub use curving::*;
pub use face_contact::*;
pub use matrices::*;
pub use measured::*;
pub use placement::*;
pub use rail::*;
pub use receptance::*;
pub use roughness::*;
pub use support::*;
pub use swept::*;
pub use uncertainty::*;
pub use wheel::*;

/// A railsqueal job: bodies, their contact, and the analyses to run. SI units throughout.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "railsqueal job")]
pub struct Job {
    /// Address or file of the schema of the job, for editors; the program does not read it.
    #[serde(rename = "$schema", default, skip_serializing)]
    pub schema: Option<String>,
    /// Format that the job is written for; the present one and all before it are read. Once resolved, the present one.
    #[schemars(range(min = 1, max = FORMAT))]
    pub version: u32,
    /// Free text, written beside the results.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// The bodies. Contact needs both; one alone is valid without contact.
    pub bodies: Bodies,
    /// The contact between the two bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<Contact>,
    /// Contacts of a disc that turns with pads that do not, between bodies by their names, in place of `contact`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<FaceContact>,
    /// The curve that `vehicle` runs through: shifts, yaws, loads and creepages of its wheels follow from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<Curve>,
    /// The bogie or two-axle vehicle in the curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vehicle: Option<Vehicle>,
    /// Analyses to run; at least one analysis.
    pub analyses: Analyses,
    /// Linear solvers and resources.
    #[serde(default)]
    pub solver: Solver,
    /// PETSc, SLEPc and MUMPS options by name, without the leading dash, e.g. `{"mat_mumps_icntl_14": 40}`.
    /// An empty string stands for an option without a value. PETSC_OPTIONS and the command line come later and win.
    #[serde(default)]
    pub petsc_options: BTreeMap<String, OptionValue>,
    /// Selection of output files and datasets.
    #[serde(default)]
    pub output: Output,
    /// The points of `analyses.sweep` or `analyses.uncertainty`, made when the job is read.
    #[serde(skip)]
    pub sweep: Option<SweepPlan>,
    /// Defaults that have changed since the format the job is written for and that it takes up, one line each, made
    /// when the job is read.
    #[serde(skip)]
    pub changed_defaults: Vec<String>,
}

/// The bodies: two by their place, or, with `contacts`, bodies by names of their own.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bodies {
    /// Body 1, below the contact plane (z < 0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<Body>,
    /// Body 2, above the contact plane (z > 0). It is described like a lower body and reflected z -> -z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<Body>,
    /// Further bodies by their names, which touch the lower one where `contact.around` says. A name is made of letters,
    /// digits, hyphens and underscores. Each body is described like a lower one.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub others: BTreeMap<String, Body>,
    /// Bodies by names of their own, which `contacts` joins, until they have their places.
    #[serde(flatten)]
    pub named: BTreeMap<String, Body>,
    /// Names of the bodies that have taken the lower and the upper place.
    #[serde(skip)]
    pub names: Option<[String; 2]>,
}

impl Bodies {
    /// The bodies that are given, to be changed, in the order of [`Job::all_bodies`].
    pub(crate) fn all_mut(&mut self) -> impl Iterator<Item = &mut Body> {
        self.lower.iter_mut().chain(&mut self.upper).chain(self.others.values_mut())
    }
}

/// Linear solvers and resources.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Solver {
    /// Solver of the static problems.
    #[serde(default)]
    pub linear: LinearSolver,
    /// Solver of the eigenproblems of the modes.
    #[serde(default)]
    pub eigen: EigenSolver,
    /// Memory that all ranks of one node may use together, bytes. Default: what the system and the control group leave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "byte"))]
    pub memory_limit: Option<f64>,
    /// A folder on a disk of each machine, relative to the job file: the factors of matrices go there and do not stay
    /// in memory. It exists; what is put there is removed at the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub out_of_core: Option<PathBuf>,
}

/// Solver of the static problems.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinearSolver {
    /// Sparse direct factorisation with MUMPS.
    #[default]
    Mumps,
    /// Conjugate gradients with algebraic multigrid: slower for many right-hand sides, much less memory.
    Gamg,
}

/// Solver of the eigenproblems of the modes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EigenSolver {
    /// Block methods of this program: thick-restart Lanczos, many modes by spectrum slicing, Arnoldi for the full
    /// system.
    #[default]
    Blocks,
    /// Solvers of SLEPc with single vectors: a second opinion.
    Slepc,
}

/// Selection of output besides the tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// True if the fields on the meshes (`/VTKHDF`) are written.
    #[serde(default = "yes")]
    pub fields: bool,
    /// True if the reduced model (`/reduced`: modes and compliance at the contact) is written, which `--reuse` takes
    /// up: 72 n² bytes for each body with n contact nodes, before compression.
    #[serde(default = "yes")]
    pub reduced: bool,
    /// True if the modes of bodies that are swept from a section, and complex modes with them, are written on meshes
    /// that show them. By default as `fields` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub swept_modes: Option<bool>,
}

impl Default for Output {
    fn default() -> Self {
        Self { fields: true, reduced: true, swept_modes: None }
    }
}

fn yes() -> bool {
    true
}

/// Value of a PETSc option.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum OptionValue {
    /// Passed as `true` or `false`.
    Switch(bool),
    /// Whole number.
    Integer(i64),
    /// Number.
    Number(f64),
    /// Anything else, as text; empty for an option without a value.
    Text(String),
}

impl std::fmt::Display for OptionValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            OptionValue::Switch(b) => write!(f, "{b}"),
            OptionValue::Integer(i) => write!(f, "{i}"),
            OptionValue::Number(x) => write!(f, "{x}"),
            OptionValue::Text(s) => f.write_str(s),
        }
    }
}

impl Job {
    /// The bodies that are given, lower first, with their names.
    pub fn bodies(&self) -> Vec<(&'static str, &Body)> {
        let both = [("lower", self.bodies.lower.as_ref()), ("upper", self.bodies.upper.as_ref())];
        both.into_iter().filter_map(|(name, body)| body.map(|b| (name, b))).collect()
    }

    /// All bodies that are given, the lower one first, the upper one next, with their keys below `bodies`.
    pub fn all_bodies(&self) -> Vec<(String, &Body)> {
        let two = self.bodies().into_iter().map(|(name, body)| (name.to_owned(), body));
        two.chain(self.bodies.others.iter().map(|(name, body)| (format!("others.{name}"), body))).collect()
    }

    /// The body on the lower one at a contact, with its key below `bodies`.
    pub fn upper_at(&self, contact: &Contact) -> Option<(String, &Body)> {
        match &contact.body {
            Some(name) => self.bodies.others.get(name).map(|body| (format!("others.{name}"), body)),
            None => self.bodies.upper.as_ref().map(|body| ("upper".into(), body)),
        }
    }

    /// Returns whether the bodies are given by matrices. Reading a job makes sure that they are if one is.
    pub(crate) fn by_matrices(&self) -> bool {
        self.bodies().iter().any(|(_, b)| b.matrices.is_some())
    }

    /// Returns whether the bodies are reduced anew in each run, and have no fields on meshes: those given by matrices,
    /// and a disc with its pads.
    pub(crate) fn is_reduced_anew(&self) -> bool {
        self.by_matrices() || self.is_disc_with_pads()
    }

    /// Returns whether a body is swept from a section.
    pub(crate) fn is_swept(&self) -> bool {
        self.bodies().iter().any(|(_, b)| matches!(b.mesh, Some(MeshSource::Revolved(_) | MeshSource::Extruded(_))))
    }

    /// Placement of the wheel on the rail, of a job with profiles.
    pub fn placement(&self) -> Option<&Placement> {
        self.contact.as_ref()?.placement.as_ref()
    }

    /// Returns whether the contact is where bodies that yield as a whole are under the load.
    pub(crate) fn is_loaded(&self) -> bool {
        let hybrid = self.contact.as_ref().is_some_and(|c| c.compliance == Compliance::Hybrid);
        hybrid && self.placement().is_some_and(|p| p.loaded)
    }

    /// Distance of the nodes of the contact grid, m, where the job says it.
    pub(crate) fn contact_spacing(&self) -> Option<f64> {
        let of_patch = self.contact.as_ref().and_then(|c| c.patch).and_then(|p| p.spacing);
        of_patch.or(self.bodies().first().and_then(|(_, b)| match &b.mesh {
            Some(MeshSource::Cylinder(c)) => Some(c.element_size),
            _ => None,
        }))
    }

    /// Angular velocity of the lower or the upper body, rad/s.
    pub fn angular_velocity(&self, name: &str) -> f64 {
        self.bodies().into_iter().find(|(n, _)| *n == name).map_or(0.0, |(_, body)| self.angular_velocity_of(body))
    }

    /// Angular velocity of a body of the job, rad/s.
    pub fn angular_velocity_of(&self, body: &Body) -> f64 {
        let speed = self.contact.as_ref().map_or(0.0, |c| c.speed);
        match body.rotation {
            None | Some(Rotation::Named(RotationName::None)) => 0.0,
            Some(Rotation::Named(RotationName::Rolling)) => match self.placement() {
                Some(p) => p.angular_speed.unwrap_or(p.speed.unwrap_or(speed) / p.radius),
                None => body.axle().map_or(0.0, |r| speed / r),
            },
            Some(Rotation::Speed(omega)) => omega,
        }
    }

    /// Circumference of the body `name`, m, if it is a wheel whose radius is known.
    pub fn circumference(&self, name: &str) -> Option<f64> {
        let bodies = self.bodies();
        let (_, body) = bodies.iter().find(|(n, _)| *n == name)?;
        let radius = match self.placement() {
            Some(p) => (name == "upper").then_some(p.radius),
            None => body.axle(),
        };
        radius.map(|r| 2.0 * std::f64::consts::PI * r)
    }

    /// The resolved job as JSON: every default filled in. What follows from the curve is not in it, as it follows
    /// again.
    pub fn to_json(&self) -> Value {
        let mut job = self.clone();
        if job.is_disc_with_pads() {
            job.contact = None;
            job.bodies.by_their_names();
        }
        if let Some(contact) = job.contact.as_mut().filter(|c| c.from.is_some()) {
            contact.remove_derived();
        }
        job.contact.iter_mut().for_each(Contact::remove_places);
        serde_json::to_value(job).unwrap_or(Value::Null)
    }
}
