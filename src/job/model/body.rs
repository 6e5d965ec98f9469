//! A body: mesh or matrices, material, damping, supports.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// One linear elastic body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Source of the mesh. A body has a mesh and a material, or matrices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshSource>,
    /// Linear elastic, isotropic material of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// Running profile of a wheel or a rail; `contact.placement` says where it is. Without a mesh the body is a
    /// half-space at the contact; a section that is swept (`mesh.revolved`) has modes as well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<super::Profile>,
    /// Mass, damping and stiffness matrices from another program, instead of mesh, material, damping and supports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrices: Option<super::Matrices>,
    /// Damping: Rayleigh's, or loss factors of the modes. Default: none; of wheels loss factors by nodal diameters,
    /// 0.002, 0.02 and 0.0002 for n = 0, 1 and more. Wheels are bodies with a built-in wheel section (W920S, `wheel`),
    /// and the upper body of a `contact.placement` that is swept from a section or is a mesh file that turns.
    #[serde(default)]
    pub damping: Damping,
    /// Measured frequencies and damping of modes, in place of computed ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<super::GivenModes>,
    /// Names of the boundary groups that are clamped; none: the body is free. The built-in cylinder has the groups
    /// `inner`, `outer`, `contact`, `side_minus`, `side_plus`. Case matters, but for the groups of `.inp` files.
    #[serde(default)]
    pub fixed: Vec<String>,
    /// Supports: everything else that holds a body with a mesh, or goes with it, at named groups: single components
    /// clamped, planes of symmetry, springs and dashpots, masses, ends that absorb.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub supports: Vec<super::Support>,
    /// Primary suspension of a wheelset (`mesh.revolved` with a solid axle), which then is not clamped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub suspension: Option<super::Suspension>,
    /// Tuned absorbers on a wheel that is swept from a section (`mesh.revolved`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absorbers: Vec<super::Absorber>,
    /// Ring dampers in grooves of a wheel that is swept from a section (`mesh.revolved`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ring_dampers: Vec<super::RingDamper>,
    /// Track under a rail (`mesh.extruded`), with its damping.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub track: Option<super::Track>,
    /// Rotation of the body: `"none"`, `"rolling"` with the angular velocity V/R, or an angular velocity, rad/s.
    /// Default: `"rolling"` for a supported body whose axle is known (the built-in cylinder has one) in a job with
    /// contact and `analyses.modes`, else `"none"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<Rotation>,
    /// Distance of the axle from the contact point, m, of a body with a mesh file that rotates; the axle is parallel
    /// to y, below the contact point of a lower body, above that of an upper one. The built-in cylinder has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub axle_distance: Option<f64>,
}

/// Rotation of a body about its axle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Rotation {
    /// In words.
    Named(RotationName),
    /// Angular velocity, rad/s; positive if the material passes the contact towards +x.
    #[schemars(extend("unit" = "rad/s"))]
    Speed(f64),
}

/// Rotation in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RotationName {
    /// The body does not turn: its inertia is that of a body at rest.
    None,
    /// It rolls: Ω = V/R with the rolling speed V and the distance R of the axle from the contact point.
    Rolling,
}

impl Body {
    /// Factor of the damping matrix of a body given by matrices.
    pub fn damping_factor(&self) -> f64 {
        self.matrices.as_ref().map_or(1.0, |m| m.damping_factor)
    }

    /// Returns whether the body is a half-space that a profile bounds.
    pub(crate) fn is_half_space(&self) -> bool {
        self.profile.is_some() && self.mesh.is_none()
    }

    /// Returns whether the body turns about its axle.
    pub fn rotates(&self) -> bool {
        !matches!(self.rotation, None | Some(Rotation::Named(RotationName::None)))
    }

    /// Returns whether it is of finite elements in three dimensions.
    pub fn is_meshed(&self) -> bool {
        matches!(self.mesh, Some(MeshSource::Cylinder(_) | MeshSource::File(_)))
    }

    /// Returns whether the job names something that holds the body, be it not in all directions.
    pub(crate) fn is_held(&self) -> bool {
        !self.fixed.is_empty() || self.suspension.is_some() || self.supports.iter().any(super::Support::holds)
    }

    /// The file of a drawn section, and the key that names it.
    pub(crate) fn section_file(&self) -> Option<(&'static str, &Path)> {
        match &self.mesh {
            Some(MeshSource::Revolved(super::Revolved { section: super::Section::File(file), .. })) => {
                Some(("mesh.revolved.section.file", &file.path))
            }
            Some(MeshSource::Extruded(super::Extruded { section: super::RailSection::File(file), .. })) => {
                Some(("mesh.extruded.section.file", &file.path))
            }
            _ => None,
        }
    }

    /// Distance of the axle from the contact point, m, where it is known.
    pub fn axle(&self) -> Option<f64> {
        match &self.mesh {
            Some(MeshSource::Cylinder(c)) => Some(c.outer_radius),
            Some(MeshSource::Revolved(r)) => Some(r.running().radius),
            _ => self.axle_distance,
        }
    }

    /// The dimensions at the contact, of a built-in body.
    pub fn running(&self) -> Option<super::Running> {
        match &self.mesh {
            Some(MeshSource::Cylinder(c)) => Some(super::Running {
                radius: c.outer_radius,
                crown: c.crown_radius,
                width: c.thickness,
                room: 0.5 * c.thickness - c.contact_offset.abs(),
            }),
            Some(MeshSource::Revolved(r)) => Some(r.running()),
            Some(MeshSource::Extruded(e)) => Some(e.running()),
            _ => None,
        }
    }

    /// Material of a body that is not given by matrices. Reading a job makes sure that it has one.
    pub fn elastic(&self) -> crate::Result<&Material> {
        let missing = || crate::Error::Defect("a material is asked for of a body without one".into());
        self.material.as_ref().ok_or_else(missing)
    }

    /// Mesh and material of a body of finite elements. Reading a job makes sure that a body without matrices has both.
    pub fn elements(&self) -> crate::Result<(&MeshSource, &Material)> {
        match (&self.mesh, &self.material) {
            (Some(mesh), Some(material)) => Ok((mesh, material)),
            _ => Err(crate::Error::Defect("finite elements are asked for of a body without a mesh".into())),
        }
    }
}

fn one() -> f64 {
    1.0
}

/// A built-in shape or a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum MeshSource {
    /// The built-in annular cylinder.
    Cylinder(Cylinder),
    /// A file of Gmsh, MSH 4.1 or 2.2 (ASCII or binary), or of Abaqus or CalculiX (`.inp`), relative to the job file:
    /// the body in its place, the contact point at the origin, a lower body below the plane z = 0 and an upper one
    /// above it. Its contact surface is the group `contact`.
    File(MeshFile),
    /// A body of revolution swept from a section: no mesh of three dimensions.
    Revolved(super::Revolved),
    /// A straight body along x swept from a section: a rail, which lies on the `track`.
    Extruded(super::Extruded),
}

/// A mesh file: its path, or its path and how to take it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MeshFile {
    /// Path of a file in metres.
    Path(PathBuf),
    /// Path and more.
    Keys(MeshFileKeys),
}

/// A mesh file and how to take it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshFileKeys {
    /// Path of the file.
    pub path: PathBuf,
    /// Length of the file's unit, m: 0.001 for a mesh in millimetres.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub scale: f64,
    /// Takes 4-node tetrahedra all the same, although they lock: they are far too stiff in bending, and in shear.
    #[serde(default)]
    pub linear_tetrahedra: bool,
    /// Brings the mesh to its place, step by step in this order, after `scale`: the contact point to the origin, the
    /// axle along y.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub transform: Vec<Motion>,
}

/// A step that moves a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Motion {
    /// Moves it by this, m.
    Translate(#[schemars(extend("unit" = "m"))] [f64; 3]),
    /// Turns it about an axis.
    Rotate(Turn),
}

/// A rotation of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    /// Direction of the axis, of any length but 0.
    pub axis: [f64; 3],
    /// Angle, rad, right-handed about the axis.
    #[schemars(extend("unit" = "rad"))]
    pub angle: f64,
    /// A point of the axis, m.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub about: [f64; 3],
}

impl MeshFile {
    /// Its path.
    pub fn path(&self) -> &PathBuf {
        match self {
            MeshFile::Path(path) => path,
            MeshFile::Keys(keys) => &keys.path,
        }
    }

    /// The same, to be changed.
    pub(crate) fn path_mut(&mut self) -> &mut PathBuf {
        match self {
            MeshFile::Path(path) => path,
            MeshFile::Keys(keys) => &mut keys.path,
        }
    }

    /// Returns whether it is read as a file of Abaqus or CalculiX, by its ending: names do not depend on case there.
    pub(crate) fn is_abaqus(&self) -> bool {
        self.path().extension().is_some_and(|ending| ending.eq_ignore_ascii_case("inp"))
    }

    /// Length of the file's unit, m.
    pub fn scale(&self) -> f64 {
        match self {
            MeshFile::Path(_) => 1.0,
            MeshFile::Keys(keys) => keys.scale,
        }
    }

    /// The steps that bring it to its place.
    pub fn transform(&self) -> &[Motion] {
        match self {
            MeshFile::Path(_) => &[],
            MeshFile::Keys(keys) => &keys.transform,
        }
    }

    /// Returns whether 4-node tetrahedra are taken.
    pub(crate) fn linear_tetrahedra(&self) -> bool {
        matches!(self, MeshFile::Keys(keys) if keys.linear_tetrahedra)
    }
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

impl Damping {
    /// Damping of steel railway wheels: damping ratios of 1e-3 with no nodal diameter, 1e-2 with one, in which the axle
    /// takes part, 1e-4 with more (as D. J. Thompson, Railway Noise and Vibration, 2009, has them from measurements,
    /// recalled).
    pub(crate) fn of_steel_wheels() -> Self {
        let factors = [2e-3, 2e-2, 2e-4].map(LossFactor).to_vec();
        Self { modal: Some(ModalDamping::ByDiameter(factors)), ..Self::default() }
    }
}

/// Loss factors of the free-interface modes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum ModalDamping {
    /// Loss factor of each mode in the order of the frequencies; the last one holds for all modes that follow.
    ByMode(Vec<LossFactor>),
    /// Loss factors by bands of frequency, ascending; every mode must lie in a band.
    ByFrequency(Vec<DampingBand>),
    /// Loss factors of modes with 0, 1, 2, ... nodal diameters, of a body of revolution that is swept or rotates; the
    /// last one holds for all that follow.
    ByDiameter(Vec<LossFactor>),
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
