//! The job as data: every key, its unit, its default and its simple bounds. The JSON Schema is generated from here,
//! and the bounds in it are the ones that reading enforces. SI units throughout.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

use super::sweep::SweepPlan;
use super::transient::Transient;

/// Version of the job format that this program reads.
pub const VERSION: u32 = 1;

/// A railsqueal job: bodies, their contact, and the analyses to run. SI units throughout.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "railsqueal job")]
pub struct Job {
    /// Version of the job format: 1.
    #[schemars(extend("const" = 1))]
    pub version: u32,
    /// Free text, written beside the results.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// The bodies. Contact needs both; one alone is valid without contact.
    pub bodies: Bodies,
    /// The contact between the two bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<Contact>,
    /// What to compute; at least one analysis.
    pub analyses: Analyses,
    /// Linear solvers and resources.
    #[serde(default)]
    pub solver: Solver,
    /// PETSc, SLEPc and MUMPS options by name, without the leading dash, e.g. `{"mat_mumps_icntl_14": 40}`.
    /// An empty string stands for an option without a value. PETSC_OPTIONS and the command line come later and win.
    #[serde(default)]
    pub petsc_options: BTreeMap<String, OptionValue>,
    /// What is written.
    #[serde(default)]
    pub output: Output,
    /// The points of `analyses.sweep`, made when the job is read.
    #[serde(skip)]
    pub sweep: Option<SweepPlan>,
}

/// The two bodies by their place.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bodies {
    /// Body 1, below the contact plane (z < 0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<Body>,
    /// Body 2, above the contact plane (z > 0). It is described like a lower body and reflected z -> -z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<Body>,
}

/// One linear elastic body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Where the mesh comes from. A body has a mesh and a material, or matrices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshSource>,
    /// Linear elastic, isotropic material of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// Mass, damping and stiffness matrices from another program, instead of mesh, material, damping and supports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrices: Option<Matrices>,
    /// Damping: Rayleigh's, or loss factors of the modes.
    #[serde(default)]
    pub damping: Damping,
    /// Names of the boundary groups that are clamped; none: the body is free. The built-in cylinder has the groups
    /// `inner`, `outer`, `contact`, `side_minus`, `side_plus`.
    #[serde(default)]
    pub fixed: Vec<String>,
}

impl Body {
    /// Mesh and material of a body of finite elements. Reading a job makes sure that a body without matrices has both.
    pub fn elements(&self) -> crate::Result<(&MeshSource, &Material)> {
        match (&self.mesh, &self.material) {
            (Some(mesh), Some(material)) => Ok((mesh, material)),
            _ => Err(crate::Error::Defect("finite elements are asked for of a body without a mesh".into())),
        }
    }
}

/// A body by its matrices, real Matrix Market files relative to the job file. Degrees of freedom without mass and rigid-body
/// motions are allowed. Such a body may be alone: its counter-body is then rigid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Matrices {
    /// File of the mass matrix M, symmetric, kg.
    pub mass: PathBuf,
    /// File of the damping matrix C, N·s/m. Without it there is no damping.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<PathBuf>,
    /// File of the stiffness matrix K, symmetric, N/m.
    pub stiffness: PathBuf,
    /// Where the body touches: one entry for each of `contact.points`, in their order.
    pub contacts: Vec<MatrixContact>,
}

/// The degrees of freedom of a body at one contact, by their 1-based row in the matrices. A minus sign turns the direction
/// round; 0 means that the body does not move in that direction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatrixContact {
    /// Row of the displacement along the normal, into the body.
    pub normal: i64,
    /// Rows of the displacements along x and y; y may be left out.
    pub tangential: Vec<i64>,
}

/// A built-in shape or a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum MeshSource {
    /// The built-in annular cylinder.
    Cylinder(Cylinder),
    /// A Gmsh MSH 4.1 file (ASCII or binary) in metres, relative to the job file: the body in its place, the contact point at the
    /// origin, a lower body below the plane z = 0 and an upper one above it. Its contact surface is the group `contact`.
    File(PathBuf),
}

/// Annular cylinder with its axis along y, crowned or plain, meshed finely at the contact and coarsely far away.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Radius of the bore, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub inner_radius: f64,
    /// Rolling radius at the contact point, m; more than `inner_radius`.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub outer_radius: f64,
    /// Width along y, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub thickness: f64,
    /// Transversal radius of the running surface, m. Without it the cylinder is plain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub crown_radius: Option<f64>,
    /// Distance of the contact point and of the apex of the crown from the mid-plane, towards +y, m.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub contact_offset: f64,
    /// Edge length of the elements at the contact, m; of a body without contact, at the edges of its bore.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub element_size: f64,
    /// Ratio of the sizes of neighbouring elements away from the contact; 1 is a uniform mesh.
    #[serde(default = "default_growth")]
    #[schemars(range(min = 1.0, max = 4.0), extend("unit" = "1"))]
    pub growth: f64,
    /// Largest edge length far from the contact, m. Default: a quarter of `thickness`, but no less than `element_size`;
    /// in a job without contact `element_size`, so that the mesh is uniform.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub max_element_size: Option<f64>,
}

fn default_growth() -> f64 {
    1.3
}

/// Linear elastic, isotropic material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus, Pa.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Pa"))]
    pub young: f64,
    /// Poisson's ratio, between -1 and 0.5.
    #[schemars(extend("exclusiveMinimum" = -1, "exclusiveMaximum" = 0.5, "unit" = "1"))]
    pub poisson: f64,
    /// Mass density, kg/m³.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "kg/m³"))]
    pub density: f64,
}

/// Damping: Rayleigh's, C = alpha M + beta K, or loss factors of the modes in its place.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Damping {
    /// Factor of the mass, 1/s.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "1/s"))]
    pub alpha: f64,
    /// Factor of the stiffness, s.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "s"))]
    pub beta: f64,
    /// Loss factors of the modes, in place of alpha and beta: a mode of angular frequency w and loss factor eta has the
    /// damping coefficient c = eta w (twice the damping ratio is eta).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modal: Option<ModalDamping>,
}

/// Loss factors of the free-interface modes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum ModalDamping {
    /// Loss factor of each mode in the order of the frequencies; the last one holds for all modes that follow.
    ByMode(Vec<LossFactor>),
    /// Loss factors by bands of frequency, ascending; every mode must lie in a band.
    ByFrequency(Vec<DampingBand>),
}

/// A loss factor: damping coefficient over angular frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct LossFactor(#[schemars(range(min = 0.0), extend("unit" = "1"))] pub f64);

/// A band of frequency with its loss factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DampingBand {
    /// Upper end of the band, which begins where the one before ends, Hz; the last band may do without and has no end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub up_to: Option<f64>,
    /// Loss factor of the modes in the band, 1.
    pub loss_factor: LossFactor,
}

/// Rolling contact with Coulomb friction. Rolling is towards -x: the leading edge is x = -a.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Friction law: a number is Coulomb's coefficient, 0 frictionless; `{"exponential": ...}` falls with the velocity.
    pub friction: Friction,
    /// Normal force that presses the bodies together, N. Give either this or `approach`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N"))]
    pub normal_load: Option<f64>,
    /// Rigid approach of the bodies from first touch, m. Give either this or `normal_load`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub approach: Option<f64>,
    /// Rolling speed V, m/s; needed unless `points` are given.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub speed: f64,
    /// Rigid creep of body 1 relative to body 2, divided by the speed.
    #[serde(default)]
    pub creepage: Creepage,
    /// Where the compliance of the contact surface comes from.
    #[serde(default)]
    pub compliance: Compliance,
    /// The finely meshed rectangle on which contact is looked for; it must hold the whole contact. Needed by built-in
    /// cylinders; a mesh file brings its own grid, the group `contact`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patch: Option<Patch>,
    /// Contact points of bodies given by matrices, all closed and sliding. They take the place of load, speed, creepage and
    /// patch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<ContactPoint>>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// One sliding contact point between bodies given by matrices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactPoint {
    /// Direction (x, y) in which body 1 slides over body 2, of any length; y may be left out.
    pub direction: Vec<f64>,
    /// Static normal force, N. With `slip_velocity` it damps motion across the sliding direction, and makes a falling
    /// friction law act.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("unit" = "N"))]
    pub force: Option<f64>,
    /// Sliding velocity, m/s. Needed with `force`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub slip_velocity: Option<f64>,
}

impl Contact {
    /// What presses the bodies together. Reading a job makes sure that exactly one of the two keys is given.
    pub fn load(&self) -> Load {
        match (self.normal_load, self.approach) {
            (Some(n), _) => Load::Normal(n),
            (None, Some(d)) => Load::Approach(d),
            (None, None) => Load::Normal(0.0),
        }
    }
}

/// What presses the bodies together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Load {
    /// Given normal force, N.
    Normal(f64),
    /// Given rigid approach, m.
    Approach(f64),
}

/// Friction law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Friction {
    /// Coulomb friction with a constant coefficient.
    Constant(#[schemars(range(min = 0.0), extend("unit" = "1"))] f64),
    /// Friction that falls with the sliding velocity.
    Falling(FallingFriction),
}

/// Friction that falls with the sliding velocity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FallingFriction {
    /// mu(v) = kinetic + (static - kinetic) exp(-v / decay_velocity).
    pub exponential: ExponentialFriction,
}

/// mu(v) = kinetic + (static - kinetic) exp(-v / decay_velocity).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExponentialFriction {
    /// Coefficient at rest; no less than `kinetic`.
    #[serde(rename = "static")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub at_rest: f64,
    /// Coefficient in fast sliding.
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub kinetic: f64,
    /// Velocity at which the coefficient has fallen by 63 % of the difference, m/s.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub decay_velocity: f64,
}

impl std::fmt::Display for Friction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Friction::Constant(mu) => write!(f, "{mu}"),
            Friction::Falling(FallingFriction { exponential: e }) => {
                write!(f, "falling from {} to {} over {} m/s", e.at_rest, e.kinetic, e.decay_velocity)
            }
        }
    }
}

/// Creepages: rigid slip velocity of body 1 relative to body 2 over the rolling speed, (xi - phi y, eta + phi x).
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Creepage {
    /// Longitudinal creepage xi, 1 (0.003 is 0.3 %).
    #[serde(default)]
    #[schemars(extend("unit" = "1"))]
    pub longitudinal: f64,
    /// Lateral creepage eta, 1 (0.003 is 0.3 %).
    #[serde(default)]
    #[schemars(extend("unit" = "1"))]
    pub lateral: f64,
    /// Spin phi, 1/m.
    #[serde(default)]
    #[schemars(extend("unit" = "1/m"))]
    pub spin: f64,
}

/// Source of the compliance of the contact surface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Compliance {
    /// From the finite-element bodies.
    #[default]
    Fe,
    /// Elastic half-spaces of the bodies' materials (Boussinesq and Cerruti) on the same grid; the bodies' shapes give
    /// the gap only.
    HalfSpace,
}

/// Half-lengths of the rectangle around the contact point on which contact is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Patch {
    /// Half-length along x, m; rounded up to whole elements.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub half_length: f64,
    /// Half-width along y, m; rounded up to whole elements.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub half_width: f64,
}

/// The analyses; those given are run, in this order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Analyses {
    /// Undamped modes of each body without contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<Modes>,
    /// Steady rolling with friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steady: Option<Steady>,
    /// Stability of steady sliding of the whole contact: the modes that squeal, with their growth rates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stability: Option<Stability>,
    /// Receptances of the bodies at the contact point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub receptance: Option<Receptance>,
    /// Rolling contact in time: how instability grows, and to what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transient: Option<Transient>,
    /// Stability at many values of keys of the job.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep: Option<Sweep>,
}

impl Analyses {
    /// The analyses given that work on the contact of two bodies, by name; each needs their compliance.
    pub fn on_contact(&self) -> Vec<&'static str> {
        self.names().into_iter().filter(|n| !["modes", "sweep"].contains(n)).collect()
    }

    /// Names of the analyses that are given, in the order in which they run.
    pub fn names(&self) -> Vec<&'static str> {
        let given = [
            ("modes", self.modes.is_some()),
            ("steady", self.steady.is_some()),
            ("stability", self.stability.is_some()),
            ("receptance", self.receptance.is_some()),
            ("transient", self.transient.is_some()),
            ("sweep", self.sweep.is_some()),
        ];
        given.into_iter().filter(|(_, is)| *is).map(|(name, _)| name).collect()
    }
}

/// Undamped modes of each body, contact open, supports held. Give either `count` or `max_frequency`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Modes {
    /// Number of modes of each body, the lowest first; a cluster of equal frequencies is never cut, so a few more may come.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 100_000))]
    pub count: Option<u32>,
    /// All modes of each body up to this frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub max_frequency: Option<f64>,
}

impl Modes {
    /// Which modes are asked for. Reading a job makes sure that exactly one of the two keys is given.
    pub fn extent(&self) -> ModesExtent {
        match (self.count, self.max_frequency) {
            (Some(n), _) => ModesExtent::Count(n as usize),
            (None, Some(f)) => ModesExtent::MaxFrequency(f),
            (None, None) => ModesExtent::Count(0),
        }
    }
}

/// Which modes are asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModesExtent {
    /// This many, the lowest first.
    Count(usize),
    /// All up to this frequency, Hz.
    MaxFrequency(f64),
}

/// Steady rolling: normal contact and friction with everything constant in time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Steady {
    /// Residual of the contact laws, relative to the normal force, at which the solution is accepted.
    #[serde(default = "default_tolerance")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.01))]
    pub tolerance: f64,
    /// Iterations after which the solver gives up.
    #[serde(default = "default_iterations")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub max_iterations: u32,
}

/// Stability of steady sliding on the modes of `analyses.modes` and the residual compliance of the contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stability {
    /// Eigenvalues up to this frequency are kept, Hz. Default: the highest frequency that both bodies' modes reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub max_frequency: Option<f64>,
    /// Where the direction and the velocity of sliding come from.
    #[serde(default)]
    pub direction: Direction,
    /// Largest backward error of an accepted eigenpair.
    #[serde(default = "default_backward_error")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.01))]
    pub tolerance: f64,
    /// Complex modes that are written as motions of the bodies: the unstable ones, and if these are fewer the least damped up to this number; 0: none.
    #[serde(default = "default_shapes")]
    #[schemars(range(max = 10_000))]
    pub shapes: u32,
    /// Pictures of each complex mode over its period, a multiple of 4.
    #[serde(default = "default_phases")]
    #[schemars(range(min = 4, max = 1000), extend("multipleOf" = 4))]
    pub phases: u32,
    /// The same on the full finite-element system, compared with the reduced one. Default: reduced only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full: Option<FullStability>,
}

/// Stability on the full finite-element system: the quadratic eigenproblem with a multiplier for each closed node, by
/// successive shifts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FullStability {
    /// All eigenvalues up to this frequency are computed, Hz.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub max_frequency: f64,
    /// and up to this damping ratio of either sign: faster decay is not looked for.
    #[serde(default = "default_damping_ratio")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.9))]
    pub damping_ratio: f64,
    /// Eigenvalues per shift, about: the shifts are as far apart as this allows.
    #[serde(default = "default_shift_count")]
    #[schemars(range(min = 6, max = 1000))]
    pub count: u32,
    /// Largest backward error and constraint violation of an accepted eigenpair.
    #[serde(default = "default_backward_error")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.01))]
    pub tolerance: f64,
    /// Relative distance |Δλ|/|λ| within which every eigenvalue must have its partner in the reduced model, and the other way round.
    #[serde(default = "default_agreement")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 0.5))]
    pub agreement: f64,
}

fn default_shapes() -> u32 {
    3
}

fn default_phases() -> u32 {
    16
}

fn default_damping_ratio() -> f64 {
    0.1
}

fn default_shift_count() -> u32 {
    20
}

fn default_agreement() -> f64 {
    0.01
}

fn default_backward_error() -> f64 {
    1e-9
}

/// Displacement of each body at the contact point per unit force there, over frequency, from the modes and the residual compliance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Receptance {
    /// Frequencies, Hz: a list, or a range. None may lie beyond the modes of the bodies.
    pub frequency: Frequencies,
    /// How the force is spread over the contact nodes; the displacement is their mean with the same shares.
    #[serde(default)]
    pub spread: Spread,
}

/// Frequencies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Frequencies {
    /// These.
    List(Vec<Hertz>),
    /// Equidistant ones.
    Range(SweepRange),
}

/// A frequency, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Hertz(#[schemars(range(min = 0.0), extend("unit" = "Hz"))] pub f64);

impl Frequencies {
    /// The frequencies one by one, Hz, or what is wrong with them.
    pub fn numbers(&self) -> Result<Vec<f64>, String> {
        let list = match self {
            Frequencies::List(list) => list.iter().map(|f| f.0).collect(),
            Frequencies::Range(range) => range.numbers()?,
        };
        match list.iter().find(|f| **f < 0.0) {
            _ if list.is_empty() => Err("the list is empty".into()),
            Some(f) => Err(format!("found {f} Hz, expected frequencies ≥ 0")),
            None => Ok(list),
        }
    }
}

/// How a unit force is spread over the contact nodes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Spread {
    /// As the pressure of the contact without friction under the load of the job.
    #[default]
    Pressure,
    /// Evenly over the whole patch.
    Uniform,
}

/// Stability at many values of keys of the job: every point has its own sliding equilibrium, contact set and spectrum, as
/// `analyses.stability` has for the job itself. What needs new modes or compliances makes them once for all points that share them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Values of each swept key, by its dotted path, e.g. `{"contact.friction": [0.2, 0.3]}`: a list, or a range.
    pub keys: IndexMap<String, SweepValues>,
    /// How the values of several keys are combined.
    #[serde(default)]
    pub combine: Combine,
}

/// Values of a swept key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum SweepValues {
    /// These values, of any type the key may have.
    List(Vec<Value>),
    /// Equidistant numbers.
    Range(SweepRange),
}

/// Equidistant numbers, both ends included. Give either `count` or `step`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepRange {
    /// First value, in the unit of the key.
    #[schemars(extend("unit" = "1"))]
    pub from: f64,
    /// Last value, in the unit of the key.
    #[schemars(extend("unit" = "1"))]
    pub to: f64,
    /// Number of values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 100_000))]
    pub count: Option<u32>,
    /// Distance of the values, in the unit of the key; the last one may fall short of `to`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "1"))]
    pub step: Option<f64>,
}

/// How the values of several keys are combined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Combine {
    /// Every value of each with every value of the others; the last key runs fastest.
    #[default]
    Grid,
    /// Side by side: the first values of all, then the second ones, and so on.
    Zip,
}

/// Where the direction and the velocity of sliding come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// The rigid creep at each node.
    #[default]
    Rigid,
    /// The creep of the deformed bodies, by a fixed point; refused where a node would stick.
    Actual,
}

fn default_tolerance() -> f64 {
    1e-8
}

fn default_iterations() -> u32 {
    200
}

/// Linear solvers and resources.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Solver {
    /// Solver of the static problems.
    #[serde(default)]
    pub linear: LinearSolver,
    /// Memory that all ranks of one node may use together, bytes. Default: what the system and the control group leave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "byte"))]
    pub memory_limit: Option<f64>,
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

/// What is written besides the tables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Whether the fields on the meshes (`/VTKHDF`) are written.
    #[serde(default = "yes")]
    pub fields: bool,
    /// Whether the reduced model (`/reduced`: modes and compliance at the contact) is written, which `--reuse` takes up: 72 n² bytes
    /// for each body with n contact nodes, before compression.
    #[serde(default = "yes")]
    pub reduced: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self { fields: true, reduced: true }
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

    /// Whether the bodies are given by matrices. Reading a job makes sure that they are if one is.
    pub fn by_matrices(&self) -> bool {
        self.bodies().iter().any(|(_, b)| b.matrices.is_some())
    }

    /// The resolved job as JSON: every default filled in.
    pub fn to_json(&self) -> Value {
        serde_json::to_value(self).unwrap_or(Value::Null)
    }
}
