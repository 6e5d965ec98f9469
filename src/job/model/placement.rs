//! A wheel on a rail: running profiles and where the wheel is.

use crate::rails;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A running profile, by the name of a built-in one or from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Profile {
    /// The wheel S1002 of EN 13715.
    S1002,
    /// The head of the rail 49E1.
    #[serde(rename = "49E1")]
    Rail49E1,
    /// The head of the rail 54E1.
    #[serde(rename = "54E1")]
    Rail54E1,
    /// The head of the rail 54E3, which is that of 49E1.
    #[serde(rename = "54E3")]
    Rail54E3,
    /// The head of the rail 60E1.
    #[serde(rename = "60E1")]
    Rail60E1,
    /// The head of the rail 60E2.
    #[serde(rename = "60E2")]
    Rail60E2,
    /// The head of the rail 115RE of AREMA.
    #[serde(rename = "115RE")]
    Rail115Re,
    /// The head of the rail UIC 60 of the Manchester benchmark, whose arcs meet elsewhere.
    #[serde(rename = "UIC60")]
    Uic60,
    /// A measured or drawn one.
    #[serde(rename = "file")]
    File(ProfileFile),
}

impl Profile {
    /// The dimensions of the built-in rail whose head it is.
    pub fn rail(&self) -> Option<&'static rails::Rail> {
        match self {
            Profile::Rail49E1 => Some(&rails::R49E1),
            Profile::Rail54E1 => Some(&rails::R54E1),
            Profile::Rail54E3 => Some(&rails::R54E3),
            Profile::Rail60E1 => Some(&rails::R60E1),
            Profile::Rail60E2 => Some(&rails::R60E2),
            Profile::Rail115Re => Some(&rails::R115RE),
            Profile::S1002 | Profile::Uic60 | Profile::File(_) => None,
        }
    }
}

/// A profile in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProfileFile {
    /// Its path, relative to the job file: Miniprof (.whl, .ban), SIMPACK (.prw, .prr), or text with y and z in
    /// columns.
    pub path: PathBuf,
    /// Unit of length in the file, m. Default: what the file says, or 0.001.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub unit: Option<f64>,
    /// Direction of z in the file. Default: as the flange or the rail's head shows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<ProfileVertical>,
    /// True if y is to be reversed: of a rail whose gauge side has the positive y.
    #[serde(default)]
    pub mirror: bool,
    /// y of the running circle in the file of a wheel, m. Default: 0, of Miniprof 70 mm from the back of the flange.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "m"))]
    pub circle: Option<f64>,
    /// Wavelength that smoothing leaves half of, m; 0 passes through all points. Measured profiles need some 0.003 to
    /// 0.010.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.1), extend("unit" = "m"))]
    pub smoothing: f64,
}

/// Direction of z in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProfileVertical {
    /// Downwards.
    Down,
    /// Upwards.
    Up,
}

/// Placement of the wheel on the rail. The track's axes are x forwards, y to the right, z down.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Placement {
    /// Side of the track, seen in the direction of travel.
    pub side: TrackSide,
    /// Radius of the running circle, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub radius: f64,
    /// Distance of the inner sides of the rails, m.
    #[serde(default = "standard_gauge")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub gauge: f64,
    /// Depth below the tops of the rails down to which the gauge is taken, m.
    #[serde(default = "gauge_depth")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub gauge_depth: f64,
    /// Inclination of the rail towards the middle of the track, added to what its profile has: 0.025 of an upright
    /// one on common sleepers.
    #[serde(default)]
    #[schemars(extend("unit" = "rad"))]
    pub cant: f64,
    /// Distance of the two running circles of the wheelset, m.
    #[serde(default = "circles")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub circles: f64,
    /// Shift of the wheelset to the right, m.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub lateral: f64,
    /// Yaw of the wheelset, positive to the right.
    #[serde(default)]
    #[schemars(extend("unit" = "rad"))]
    pub yaw: f64,
    /// Roll of the wheelset about the track, positive lowers the right-hand wheel.
    #[serde(default)]
    #[schemars(extend("unit" = "rad"))]
    pub roll: f64,
    /// The point of contact, instead of shift and roll.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<GivenContact>,
    /// True if this is the position under the load: what bodies that are swept give way by, a rail by a millimetre,
    /// then does not move the contact. Else that of bodies without load.
    #[serde(default = "yes")]
    pub loaded: bool,
    /// Speed along the track. Default: `contact.speed`, in the place of which the mean of the speeds comes with which
    /// both materials pass the contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub speed: Option<f64>,
    /// Angular speed of the wheel about its axle. Default: the speed over the radius of the running circle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "rad/s"))]
    pub angular_speed: Option<f64>,
    /// Curvature of the track 1/R: positive where it turns to the right. The way on the inner rail is shorter, and the
    /// track turns under the wheel.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(extend("unit" = "1/m"))]
    pub curvature: f64,
    /// Position on the profile of the wheel near which the contact is, to the field side of the running circle, of a
    /// wheel that touches the rail at several places. Default: the place that touches first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "m"))]
    pub touch_near: Option<f64>,
    /// Creepages instead of those of the motion.
    #[serde(default, skip_serializing_if = "GivenCreepage::is_none")]
    pub creepage: GivenCreepage,
}

/// A point of contact that is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenContact {
    /// y on the profile of the wheel, m, to the field side of the running circle.
    #[schemars(extend("unit" = "m"))]
    pub wheel: f64,
    /// y on the profile of the rail after its cant, m, to the field side.
    #[schemars(extend("unit" = "m"))]
    pub rail: f64,
}

/// Creepages that are given; the others follow from the motion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenCreepage {
    /// Longitudinal creepage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "1"))]
    pub longitudinal: Option<f64>,
    /// Lateral creepage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "1"))]
    pub lateral: Option<f64>,
    /// Spin of the contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "1/m"))]
    pub spin: Option<f64>,
}

impl GivenCreepage {
    fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// The side of the track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrackSide {
    /// The left-hand wheel and rail.
    Left,
    /// The right-hand wheel and rail.
    Right,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

fn yes() -> bool {
    true
}

fn standard_gauge() -> f64 {
    1.435
}

fn gauge_depth() -> f64 {
    0.014
}

fn circles() -> f64 {
    1.5
}
