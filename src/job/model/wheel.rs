//! Wheel by its main dimensions.

use super::Material;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of a web.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Web {
    /// Plane disc of even thickness.
    #[default]
    Straight,
    /// S between hub and rim, whose middle moves by `web_offset`: 3t² − 2t³ of the way t from the rim to the hub.
    Curved,
}

/// Wheel by its main dimensions. y is the distance from the running circle along the axle towards the flange; the back
/// of the flange is at y = 70 mm. It has the group `bore`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelDimensions {
    /// Diameter of the running circle, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub diameter: f64,
    /// Shape of the web.
    #[serde(default)]
    pub web: Web,
    /// Thickness of the web along the axle, m.
    #[serde(default = "web_thickness")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub web_thickness: f64,
    /// y of the middle of the web at the rim, towards the flange, m.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub web_position: f64,
    /// Distance of the middle of a curved web at the hub from that at the rim, towards the flange, m.
    #[serde(default = "web_offset")]
    #[schemars(extend("unit" = "m"))]
    pub web_offset: f64,
    /// Diameter of the bore, m.
    #[serde(default = "bore")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub bore: f64,
    /// Diameter of the hub, m.
    #[serde(default = "hub_diameter")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub hub_diameter: f64,
    /// Length of the hub along the axle, m.
    #[serde(default = "hub_length")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub hub_length: f64,
    /// y of the middle of the hub, towards the flange, m.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub hub_position: f64,
    /// Width of the rim with the flange, m.
    #[serde(default = "rim_width")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub rim_width: f64,
    /// Thickness of the rim below the running circle, m.
    #[serde(default = "rim_thickness")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub rim_thickness: f64,
    /// Height of the flange above the running circle, m, at least 0.022.
    #[serde(default = "flange_height")]
    #[schemars(range(min = 0.022), extend("unit" = "m"))]
    pub flange_height: f64,
    /// Thickness of the flange, m.
    #[serde(default = "flange_thickness")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub flange_thickness: f64,
    /// Ring of another material in the rim, as the rubber of a resilient wheel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer: Option<WheelLayer>,
}

/// Ring of another material in the rim of a wheel, over the whole width of the rim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelLayer {
    /// Diameter of its inner side, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub inner_diameter: f64,
    /// Its thickness, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub thickness: f64,
    /// Its material; of rubber with the dynamic modulus at the frequencies of interest. Poisson's ratio is at most
    /// 0.49.
    pub material: Material,
    /// Its loss factor: a mode is damped by it times the part of its strain energy in the ring.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub loss_factor: f64,
}

impl WheelDimensions {
    /// Distance of the back of the flange from the running circle, m, by the convention of wheel profiles.
    pub const BACK: f64 = 0.070;

    /// Radii of bore, hub, inner side of the rim, tread and tip of the flange, m.
    pub fn radii(&self) -> [f64; 5] {
        let tread = 0.5 * self.diameter;
        let [bore, hub] = [self.bore, self.hub_diameter].map(|d| 0.5 * d);
        [bore, hub, tread - self.rim_thickness, tread, tread + self.flange_height]
    }

    /// Ends of the hub along the axle, m.
    pub fn hub(&self) -> [f64; 2] {
        [-0.5, 0.5].map(|part| self.hub_position + part * self.hub_length)
    }

    /// y of the middle of the web at the rim and at the hub, m.
    pub(crate) fn web_middle(&self) -> [f64; 2] {
        let offset = if self.web == Web::Curved { self.web_offset } else { 0.0 };
        [self.web_position, self.web_position + offset]
    }

    /// y of the field side of the rim, of the face and of the back of the flange, m.
    pub fn rim(&self) -> [f64; 3] {
        [Self::BACK - self.rim_width, Self::BACK - self.flange_thickness, Self::BACK]
    }
}

fn web_thickness() -> f64 {
    0.024
}
fn web_offset() -> f64 {
    0.030
}
fn bore() -> f64 {
    0.190
}
fn hub_diameter() -> f64 {
    0.270
}
fn hub_length() -> f64 {
    0.180
}
fn rim_width() -> f64 {
    0.135
}
fn rim_thickness() -> f64 {
    0.070
}
fn flange_height() -> f64 {
    0.028
}
fn flange_thickness() -> f64 {
    0.030
}
