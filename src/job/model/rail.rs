//! A rail and the track it lies on.

use super::swept::{one, running};
use crate::rails;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A straight body along x, swept from a section. Needs `contact.compliance` `"hybrid"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Extruded {
    /// The section: a built-in one by its name, or a drawing.
    pub section: RailSection,
    /// Length of rail that is modelled, the contact in its middle, m; it repeats itself beyond.
    #[serde(default = "length")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub length: f64,
    /// Distance of the contact point from the middle of the head (of a file: from its x = 0), towards +y, m. The
    /// frame of the contact is that of the surface there.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub contact_offset: f64,
}

/// A section of a rail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum RailSection {
    /// The rail 49E1 of EN 13674-1 (S49).
    #[serde(rename = "49E1")]
    Rail49E1,
    /// The rail 54E1 of EN 13674-1 (UIC 54).
    #[serde(rename = "54E1")]
    Rail54E1,
    /// The rail 54E3 of EN 13674-1 (S54).
    #[serde(rename = "54E3")]
    Rail54E3,
    /// The rail 60E1 of EN 13674-1.
    #[serde(rename = "60E1")]
    Rail60E1,
    /// The rail 60E2 of EN 13674-1.
    #[serde(rename = "60E2")]
    Rail60E2,
    /// The rail 115RE of AREMA.
    #[serde(rename = "115RE")]
    Rail115Re,
    /// A drawn one: a plane mesh of Gmsh, x across the track, y up.
    #[serde(rename = "file")]
    File(RailFile),
}

/// The section of a rail in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RailFile {
    /// Its path, relative to the job file: MSH 4.1 or 2.2, triangles and quadrilaterals of first or second order.
    pub path: PathBuf,
    /// Length of the file's unit, m: 0.001 for a drawing in millimetres.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub scale: f64,
    /// Physical curve on which the wheel runs.
    #[serde(default = "running")]
    pub running: String,
    /// Physical curve that lies on the pads.
    #[serde(default = "foot")]
    pub foot: String,
    /// Transversal radius of the running line at the contact point, m, for Hertz' estimates of the contact. Without
    /// it the line is straight there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub crown: Option<f64>,
}

/// Track under a rail: pads on the ground, or on sleepers on ballast, spread evenly or standing apart; and what absorbs
/// at the ends of the rail.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Track {
    /// The pad of each sleeper, under all of the foot.
    #[serde(default)]
    pub pad: Layer,
    /// Distance of the sleepers, m.
    #[serde(default = "spacing")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub spacing: f64,
    /// Length of each pad along the rail, m. With it pads and sleepers stand apart, one each `spacing`; without it
    /// they are spread evenly along the track.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub pad_length: Option<f64>,
    /// With `pad_length`: distance from the middle of a pad to the contact, along +x, m; with both wheels to the first
    /// contact.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub position: f64,
    /// Sleepers. Without them the pads lie on the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sleeper: Option<Sleeper>,
    /// Loss factor of the rail itself.
    #[serde(default = "loss_factor")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub loss_factor: f64,
    /// Absorbing ends.
    #[serde(default)]
    pub ends: Ends,
}

/// Springs and dashpots under one sleeper. The dashpots are viscous, c = ηk/ω with ω = √(k/m) where the mass on them
/// resonates: that of the rail between two sleepers on the pads, that of the sleeper on the ballast.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Vertical stiffness, N/m.
    #[serde(default = "vertical")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N/m"))]
    pub vertical: f64,
    /// Lateral and longitudinal stiffness, N/m.
    #[serde(default = "lateral")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N/m"))]
    pub lateral: f64,
    /// Loss factor η.
    #[serde(default = "layer_loss")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub loss_factor: f64,
}

/// A sleeper on ballast. Each rail has half of it for itself, which moves without turning, unless `both_rails` says
/// what the whole is like.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sleeper {
    /// Mass that moves with one rail, kg.
    #[serde(default = "sleeper_mass")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "kg"))]
    pub mass: f64,
    /// The ballast under it, as far as it moves with one rail.
    #[serde(default)]
    pub ballast: Layer,
    /// The whole sleeper below both rails, with `contact.wheels` = "both" and `pad_length`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub both_rails: Option<WholeSleeper>,
}

/// A sleeper below both rails: a rigid bar with twice the mass and the ballast that move with one rail, spread evenly
/// along it. It turns about the track and about the vertical.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WholeSleeper {
    /// Its length, m.
    #[serde(default = "sleeper_length")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub length: f64,
    /// Distance of the middles of the rails, m.
    #[serde(default = "rail_distance")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub rail_distance: f64,
}

/// Absorbing ends of the rail: damping by the mass that grows with the square of the distance from where it begins, and
/// dashpots for the long waves along the rail.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ends {
    /// Length of either end, m; 0 for none.
    #[serde(default = "end_length")]
    #[schemars(range(min = 0.0), extend("unit" = "m"))]
    pub length: f64,
    /// Its largest value, 1/s.
    #[serde(default = "end_damping")]
    #[schemars(range(min = 0.0), extend("unit" = "1/s"))]
    pub damping: f64,
    /// Dashpots at either end for what runs along the rail in compression, over the density times √(E/ρ), which take
    /// up all of a long wave that no track slows; the damping by the mass is then only for what moves across. 0: it
    /// is for all motions.
    #[serde(default = "end_longitudinal")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub longitudinal: f64,
}

impl Default for Layer {
    fn default() -> Self {
        Self { vertical: vertical(), lateral: lateral(), loss_factor: layer_loss() }
    }
}

impl Default for Ends {
    fn default() -> Self {
        Self { length: end_length(), damping: end_damping(), longitudinal: end_longitudinal() }
    }
}

impl Default for Track {
    fn default() -> Self {
        Self {
            pad: Layer::default(),
            spacing: spacing(),
            pad_length: None,
            position: 0.0,
            sleeper: None,
            loss_factor: loss_factor(),
            ends: Ends::default(),
        }
    }
}

impl Extruded {
    /// The dimensions at the contact: of a drawing only the file knows more.
    pub fn running(&self) -> super::Running {
        let Some(rail) = self.section.built() else {
            let any = f64::INFINITY;
            let crown = if let RailSection::File(file) = &self.section { file.crown } else { None };
            return super::Running { radius: any, crown, width: any, room: any };
        };
        let offset = self.contact_offset;
        let head = &rail.head;
        let room = if offset.abs() <= head.reach() { head.room(offset) } else { 0.0 };
        let width = 2.0 * head.point(head.to_angle(head.steep())).y;
        super::Running { radius: f64::INFINITY, crown: Some(head.radius_at(offset)), width, room }
    }
}

impl RailSection {
    /// The dimensions of a built-in one.
    pub fn built(&self) -> Option<&'static rails::Rail> {
        match self {
            RailSection::Rail49E1 => Some(&rails::R49E1),
            RailSection::Rail54E1 => Some(&rails::R54E1),
            RailSection::Rail54E3 => Some(&rails::R54E3),
            RailSection::Rail60E1 => Some(&rails::R60E1),
            RailSection::Rail60E2 => Some(&rails::R60E2),
            RailSection::Rail115Re => Some(&rails::R115RE),
            RailSection::File(_) => None,
        }
    }
}

fn foot() -> String {
    "foot".into()
}

fn length() -> f64 {
    14.0
}

fn spacing() -> f64 {
    0.6
}

fn loss_factor() -> f64 {
    0.02
}

fn vertical() -> f64 {
    120e6
}

fn lateral() -> f64 {
    40e6
}

fn layer_loss() -> f64 {
    0.2
}

fn sleeper_mass() -> f64 {
    300.0
}

fn sleeper_length() -> f64 {
    2.6
}

fn rail_distance() -> f64 {
    1.5
}

fn end_length() -> f64 {
    5.0
}

fn end_damping() -> f64 {
    6000.0
}

/// Between the 0.83 of its resistance that a wave meets on pads of 67 MN/m² at 300 Hz, √(1 − s/m′ω²), and the 1 of
/// short ones.
fn end_longitudinal() -> f64 {
    0.9
}
