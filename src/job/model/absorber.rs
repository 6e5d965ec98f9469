//! Tuned absorbers and ring dampers of a wheel.

use super::Material;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Tuned absorbers: equal masses on springs, evenly spaced round a wheel that is swept from a section
/// (`mesh.revolved`). They turn with the wheel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Absorber {
    /// Place of the section at which they are mounted.
    pub place: AbsorberPlace,
    /// Direction of their motion on the springs. Across it they are mounted rigidly.
    pub direction: AbsorberDirection,
    /// Moving mass of all of them together, kg.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "kg"))]
    pub mass: f64,
    /// Frequency to which they are tuned, Hz: that of a mass on its spring with the wheel held.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub frequency: f64,
    /// Loss factor of the springs, taken as viscous: right at `frequency`, in proportion to the frequency elsewhere.
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub loss_factor: f64,
    /// Number of absorbers round the wheel. They move as a ring in modes of fewer than half as many nodal diameters.
    #[schemars(range(min = 3, max = 1000))]
    pub count: u32,
}

/// Place of a section at which something is mounted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum AbsorberPlace {
    /// By name, of the sections `W920S` and `wheel`.
    Named(NamedPlace),
    /// By its coordinates.
    At(SectionPlace),
}

/// Place of a wheel by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedPlace {
    /// Inner side of the rim, halfway between the web and the field side.
    Rim,
    /// Middle of the web, halfway between hub and rim.
    Web,
}

/// Place of a section by its coordinates, on the section or within 2 mm of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SectionPlace {
    /// Distance from the axle, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub radius: f64,
    /// Distance along the axle, m: of W920S from the middle of its web, of `wheel` from its running circle, of a file
    /// its x, of the cylinder from its mid-plane; of wheels towards the flange.
    #[schemars(extend("unit" = "m"))]
    pub y: f64,
}

/// Direction of the motion of an absorber.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AbsorberDirection {
    /// Along the radius.
    Radial,
    /// Along the circle.
    Tangential,
    /// Along the axle.
    Axial,
}

/// Ring damper: a ring of round wire in a groove of a wheel that is swept from a section (`mesh.revolved`), as a linear
/// equivalent of its friction: springs with a loss factor between ring and groove, the same in all directions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingDamper {
    /// Place of the groove on the section.
    pub place: AbsorberPlace,
    /// Diameter of the wire, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub diameter: f64,
    /// Material of the wire. Default: steel, 210 GPa, 0.3, 7860 kg/m³.
    #[serde(default = "steel")]
    pub material: Material,
    /// Frequency of the ring, as a rigid mass, on the contact with its groove, Hz.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub frequency: f64,
    /// Loss factor of that contact, taken as viscous: right at `frequency`, in proportion to the frequency elsewhere.
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub loss_factor: f64,
}

fn steel() -> Material {
    Material { young: 210e9, poisson: 0.3, density: 7860.0 }
}

impl Absorber {
    /// Largest number of nodal diameters of modes in which they move as a ring.
    pub(crate) fn highest_order(&self) -> usize {
        (self.count.max(1) as usize - 1) / 2
    }

    /// Mass of one of them, kg.
    pub fn each(&self) -> f64 {
        self.mass / f64::from(self.count)
    }
}

impl AbsorberPlace {
    /// The place in words.
    pub fn text(&self) -> String {
        match self {
            AbsorberPlace::Named(NamedPlace::Rim) => "on the inner side of the rim".into(),
            AbsorberPlace::Named(NamedPlace::Web) => "on the middle of the web".into(),
            AbsorberPlace::At(at) => format!("at r = {:.4} m, y = {:.4} m", at.radius, at.y),
        }
    }
}

impl AbsorberDirection {
    /// Its name in a job.
    pub fn name(self) -> &'static str {
        match self {
            AbsorberDirection::Radial => "radial",
            AbsorberDirection::Tangential => "tangential",
            AbsorberDirection::Axial => "axial",
        }
    }
}
