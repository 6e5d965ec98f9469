//! A curve of the track and the vehicle that runs through it.

use super::TrackSide;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A curve of the track, and how it is run through. Shifts, yaws, loads and creepages of the wheels of `vehicle` follow
/// from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Radius of the middle of the track, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub radius: f64,
    /// Side to which the track turns, seen in the direction of travel.
    #[serde(default = "to_the_right")]
    pub direction: TrackSide,
    /// Speed along the track, m/s.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub speed: f64,
    /// Height of the outer rail above the inner one, m. Give either this or `cant_deficiency`; with neither the cant is
    /// that of this speed and radius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("unit" = "m"))]
    pub cant: Option<f64>,
    /// Height that is missing to the cant of equilibrium of this speed and radius, m; negative where the cant is in
    /// excess.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "m"))]
    pub cant_deficiency: Option<f64>,
    /// Distance of the inner sides of the rails on straight track, m.
    #[serde(default = "standard_gauge")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub gauge: f64,
    /// By how much the gauge is wider in the curve, m.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "m"))]
    pub gauge_widening: f64,
    /// Depth below the tops of the rails down to which the gauge is taken, m.
    #[serde(default = "gauge_depth")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub gauge_depth: f64,
    /// Inclination of the rails towards the middle of the track, added to what their profile has: 0.025 for 1:40, 0.05
    /// for 1:20.
    #[schemars(extend("unit" = "rad"))]
    pub rail_cant: f64,
    /// Law of the creep forces with which axles and frame are in equilibrium.
    #[serde(default)]
    pub creep_law: CreepForceLaw,
}

/// A law of total creep forces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CreepForceLaw {
    /// Shen, Hedrick and Elkins (1983).
    #[default]
    ShenHedrickElkins,
    /// Polach (1999).
    Polach,
    /// Kalker's FASTSIM (1982).
    Fastsim,
}

/// A two-axle bogie or vehicle: a built-in one by its name, or its data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Vehicle {
    /// A built-in bogie.
    Named(VehicleName),
    /// Its data.
    Data(VehicleData),
}

/// Built-in bogies; docs/explanation/curving.md has their data and sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VehicleName {
    /// A metro bogie: wheelbase 2.5 m, axle load 120 kN, stiff primary suspension.
    MetroBogie,
    /// A tram bogie: wheelbase 1.8 m, axle load 60 kN.
    TramBogie,
    /// A freight bogie: wheelbase 1.8 m, axle load 220 kN.
    FreightBogie,
}

/// Data of a two-axle bogie or vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleData {
    /// Kind of the frame that the axles belong to: that of a bogie, or the body of a two-axle vehicle.
    #[serde(default)]
    pub kind: VehicleKind,
    /// Distance of the axles, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub wheelbase: f64,
    /// Load of an axle on the rails, N.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N"))]
    pub axle_load: f64,
    /// Suspension between axles and frame.
    pub primary: PrimarySuspension,
    /// Radius of the running circles of the wheels, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub wheel_radius: f64,
    /// Distance of the backs of the flanges, m. The running circles are 70 mm from them.
    #[serde(default = "back_to_back")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub back_to_back: f64,
    /// Yaw moment of the secondary suspension on the frame, N m: positive turns it to the right.
    #[serde(default)]
    #[schemars(extend("unit" = "N m"))]
    pub secondary_moment: f64,
    /// Torque on the leading and on the trailing axle, N m: positive drives forwards, negative brakes.
    #[serde(default)]
    #[schemars(extend("unit" = "N m"))]
    pub torque: [f64; 2],
    /// Height of the centre of gravity above the rails, m, by which a lateral force of the curve shifts load from one
    /// rail to the other. Needed where the curve has a cant deficiency.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub centre_of_gravity: Option<f64>,
}

/// Kind of vehicle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum VehicleKind {
    /// A bogie.
    #[default]
    Bogie,
    /// A vehicle with two axles.
    TwoAxle,
}

/// Springs between axles and frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrimarySuspension {
    /// Stiffness of an axle box along the track, N/m.
    #[schemars(range(min = 0.0), extend("unit" = "N/m"))]
    pub longitudinal: f64,
    /// Stiffness of an axle box across the track, N/m.
    #[schemars(range(min = 0.0), extend("unit" = "N/m"))]
    pub lateral: f64,
    /// Yaw stiffness of an axle against the frame beside that of its boxes, N m/rad.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N m/rad"))]
    pub yaw: f64,
    /// Distance of the two boxes of an axle, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub box_distance: f64,
}

/// A wheel of the vehicle in the curve, whose contact is examined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactOfWheel {
    /// Wheel of the vehicle whose contact is computed.
    pub wheel: VehicleWheel,
}

/// A wheel of a two-axle bogie or vehicle in a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum VehicleWheel {
    /// Leading axle, inner rail.
    #[serde(rename = "leading inner")]
    LeadingInner,
    /// Leading axle, outer rail.
    #[serde(rename = "leading outer")]
    LeadingOuter,
    /// Trailing axle, inner rail.
    #[serde(rename = "trailing inner")]
    TrailingInner,
    /// Trailing axle, outer rail.
    #[serde(rename = "trailing outer")]
    TrailingOuter,
}

impl VehicleWheel {
    /// Flags: leading axle, inner rail.
    pub fn place(self) -> [bool; 2] {
        match self {
            Self::LeadingInner => [true, true],
            Self::LeadingOuter => [true, false],
            Self::TrailingInner => [false, true],
            Self::TrailingOuter => [false, false],
        }
    }
}

impl VehicleData {
    /// Distance of the running circles, m: they are 70 mm from the backs of the flanges (EN 13715).
    pub fn circles(&self) -> f64 {
        self.back_to_back + 2.0 * 0.070
    }
}

impl Vehicle {
    /// Its data.
    pub fn data(&self) -> VehicleData {
        match self {
            Self::Data(data) => data.clone(),
            Self::Named(name) => name.data(),
        }
    }
}

impl VehicleName {
    /// Its data. All three are typical bogies of their kind with rounded figures, not those of a make.
    fn data(self) -> VehicleData {
        let bogie = |wheelbase, axle_load, wheel_radius, (longitudinal, lateral, box_distance), height| VehicleData {
            kind: VehicleKind::Bogie,
            wheelbase,
            axle_load,
            primary: PrimarySuspension { longitudinal, lateral, yaw: 0.0, box_distance },
            wheel_radius,
            back_to_back: back_to_back(),
            secondary_moment: 0.0,
            torque: [0.0; 2],
            centre_of_gravity: Some(height),
        };
        match self {
            Self::MetroBogie => bogie(2.5, 120e3, 0.46, (10e6, 5e6, 2.0), 1.4),
            Self::TramBogie => bogie(1.8, 60e3, 0.3, (8e6, 4e6, 1.6), 1.2),
            Self::FreightBogie => bogie(1.8, 220e3, 0.46, (2e6, 2e6, 2.0), 1.8),
        }
    }
}

fn to_the_right() -> TrackSide {
    TrackSide::Right
}

fn standard_gauge() -> f64 {
    1.435
}

fn gauge_depth() -> f64 {
    0.014
}

fn back_to_back() -> f64 {
    1.360
}
