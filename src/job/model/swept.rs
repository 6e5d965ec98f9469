//! A body swept from a section.

use super::{Material, WheelDimensions};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A body of revolution about an axle along y, swept from a section. Needs `contact.compliance` `"hybrid"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Revolved {
    /// The section, by the name of a built-in one.
    pub section: Section,
    /// Distance of the contact point, and of the apex of a crown, from the mid-plane (of W920S: from that of its web;
    /// of `wheel`: from its running circle; of a file: from its x = 0), towards +y, m.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub contact_offset: f64,
}

/// A built-in section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Section {
    /// The benchmark wheel W920S: bore of radius 95 mm, straight web, tread of radius 460 mm. It has the group `inner`.
    W920S,
    /// The benchmark wheelset: two wheels W920S, 1500 mm apart, on a solid axle of the diameter 160 mm. It has the
    /// groups `seats` and `journals`. Its contact is on the right-hand or the left-hand wheel, as the placement says;
    /// without one on the left-hand wheel.
    #[serde(rename = "W920S-wheelset")]
    W920SWheelset,
    /// The annular cylinder. It has the groups `inner`, `outer`, `side_minus`, `side_plus`.
    #[serde(rename = "cylinder")]
    Cylinder(Ring),
    /// A wheel by its main dimensions. It has the group `bore`.
    #[serde(rename = "wheel")]
    Wheel(WheelDimensions),
    /// A drawn one: a plane mesh of Gmsh, x along the axle, y away from it.
    #[serde(rename = "file")]
    File(SectionFile),
}

/// A section in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SectionFile {
    /// Its path, relative to the job file: MSH 4.1 or 2.2, triangles and quadrilaterals of first or second order.
    pub path: PathBuf,
    /// Length of the file's unit, m: 0.001 for a drawing in millimetres.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub scale: f64,
    /// Physical curve that runs on the rail. Other physical curves are groups that can be clamped or supported.
    #[serde(default = "running")]
    pub running: String,
    /// Rolling radius at the contact point, m, which the drawing has to have within a thousandth; with
    /// `contact.placement` that of the running circle.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub radius: f64,
    /// Position of the middle of the axle along it, m, of a wheelset of which the drawing is the half with the flange
    /// towards that middle: the other half is its mirror image. Without it the drawing is the whole section.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub middle: Option<f64>,
    /// Transversal radius of the running line at the contact point, m, for Hertz' estimates of the contact. Without
    /// it the line is straight there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub crown: Option<f64>,
    /// Parts of other materials than that of the body, as the rubber of a resilient wheel.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<FileLayer>,
}

/// Part of a drawn section that is of another material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileLayer {
    /// Physical surface of the file.
    pub group: String,
    /// Its material; of rubber with the dynamic modulus at the frequencies of interest. Poisson's ratio is at most
    /// 0.49.
    pub material: Material,
    /// Its loss factor: a mode is damped by it times the part of its strain energy there.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub loss_factor: f64,
}

pub(super) fn one() -> f64 {
    1.0
}

pub(super) fn running() -> String {
    "running".into()
}

/// Section of an annular cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ring {
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
}

/// Primary suspension of a wheelset: springs between its axle boxes and the bogie frame, which stands still. The
/// boxes do not turn, and see the mean displacement of the journal: no torque about the axle, no moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Suspension {
    /// Stiffness along the track, of each axle box, N/m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N/m"))]
    pub longitudinal: f64,
    /// Stiffness along the axle, of each axle box, N/m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N/m"))]
    pub lateral: f64,
    /// Vertical stiffness, of each axle box, N/m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N/m"))]
    pub vertical: f64,
    /// Places of the bearings along the axle, y, m: of W920S-wheelset from its middle to the right, where ±1 is the
    /// default; of a file with `middle` from there to the right; of another file its x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "m"))]
    pub journals: Option<Vec<f64>>,
}

impl Suspension {
    /// Places of the bearings along the axle, m.
    pub fn places(&self) -> &[f64] {
        self.journals.as_deref().unwrap_or(&[-1.0, 1.0])
    }
}

/// Running part: the dimensions of a built-in body that touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Running {
    /// Rolling radius, m.
    pub radius: f64,
    /// Transversal radius of the running surface, m; a plain one has none.
    pub crown: Option<f64>,
    /// Width of the running surface, m.
    pub width: f64,
    /// Distance from the contact point to the nearer edge of the running surface, m.
    pub room: f64,
}

impl Revolved {
    /// y of the middle of a wheelset of two wheels with running lines, m; none of another body.
    pub fn middle(&self) -> Option<f64> {
        match &self.section {
            Section::W920SWheelset => Some(0.75),
            Section::File(file) => file.middle,
            _ => None,
        }
    }

    /// The dimensions at the contact.
    pub fn running(&self) -> Running {
        let offset = self.contact_offset;
        match &self.section {
            // Its tread, m.
            Section::W920S | Section::W920SWheelset => {
                Running { radius: 0.460, crown: None, width: 0.105, room: (0.065 + offset).min(0.040 - offset) }
            }
            Section::Cylinder(c) => Running {
                radius: c.outer_radius,
                crown: c.crown_radius,
                width: c.thickness,
                room: 0.5 * c.thickness - offset.abs(),
            },
            Section::Wheel(wheel) => {
                let [field, face, _] = wheel.rim();
                Running {
                    radius: 0.5 * wheel.diameter,
                    crown: None,
                    width: face - field,
                    room: (offset - field).min(face - offset),
                }
            }
            // Where its running line ends is in the file.
            Section::File(f) => Running { radius: f.radius, crown: f.crown, width: f64::INFINITY, room: f64::INFINITY },
        }
    }
}
