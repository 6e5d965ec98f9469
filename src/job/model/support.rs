//! Supports of a body with a mesh: what holds, carries, damps or loads the facets of a named group.

use super::Job;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Supports or masses of one group of boundary facets. Springs, dashpots and clamps lead to the ground.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// Name of the group.
    pub group: String,
    /// Components of the displacement that are held at its nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clamped: Vec<Component>,
    /// True if the group is a plane of symmetry, across x, y or z: the displacement across it is held.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub symmetry: bool,
    /// Springs to the ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Stiffnesses>,
    /// Viscous dashpots beside the springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Dampings>,
    /// Loss factor of the springs, taken as viscous: right at `loss_frequency`, in proportion to the frequency
    /// elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub loss_factor: Option<f64>,
    /// Frequency at which the springs have their loss factor, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub loss_frequency: Option<f64>,
    /// Mass that moves with the group, kg, or kg/m² where it is given per area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("unit" = "kg"))]
    pub mass: Option<f64>,
    /// Reference of stiffness, damping and mass: the whole group, spread evenly over its area, or each square metre.
    #[serde(default)]
    pub per: Per,
    /// The body absorbs waves that run towards the group, which must be plane.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absorbing: Option<Absorbing>,
}

/// A component of a displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

/// Reference of a number of a support.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Per {
    /// The whole group.
    #[default]
    Total,
    /// A square metre of it.
    Area,
}

/// Stiffness of springs by direction, N/m, or N/m³ where it is given per area.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stiffnesses {
    /// Stiffness along x.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N/m"))]
    pub x: f64,
    /// Stiffness along y.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N/m"))]
    pub y: f64,
    /// Stiffness along z.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N/m"))]
    pub z: f64,
    /// Along the normal of the surface, point by point.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N/m"))]
    pub normal: f64,
}

/// Damping of dashpots by direction, N·s/m, or N·s/m³ where it is given per area.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dampings {
    /// Damping along x.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N·s/m"))]
    pub x: f64,
    /// Damping along y.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N·s/m"))]
    pub y: f64,
    /// Damping along z.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N·s/m"))]
    pub z: f64,
    /// Along the normal of the surface, point by point.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "N·s/m"))]
    pub normal: f64,
}

/// Damping by the mass that grows towards a plane group with the square of the depth already passed, and dashpots on
/// the group for long waves along a bar.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Absorbing {
    /// Distance from the plane of the group up to which the body absorbs, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub depth: f64,
    /// The largest damping, at the group, 1/s.
    #[schemars(range(min = 0.0), extend("unit" = "1/s"))]
    pub rate: f64,
    /// Dashpots on the group along its normal for what runs along a bar in compression, over the density times
    /// √(E/ρ), which take up all of a long wave; the damping by the mass is then only for what moves across. Without
    /// them it is for all motions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("unit" = "1"))]
    pub longitudinal: Option<f64>,
}

impl Absorbing {
    /// Returns whether there is anything that absorbs.
    pub fn absorbs(&self) -> bool {
        self.rate > 0.0 || self.longitudinal.is_some_and(|l| l > 0.0)
    }
}

impl Stiffnesses {
    /// Along x, y, z and the normal.
    pub fn all(&self) -> [f64; 4] {
        [self.x, self.y, self.z, self.normal]
    }
}

impl Dampings {
    /// Along x, y, z and the normal.
    pub fn all(&self) -> [f64; 4] {
        [self.x, self.y, self.z, self.normal]
    }
}

impl Support {
    /// Stiffness along x, y, z and the normal; nothing is 0.
    pub fn springs(&self) -> [f64; 4] {
        self.stiffness.map_or([0.0; 4], |s| s.all())
    }

    /// Damping along x, y, z and the normal: of dashpots, and of springs with a loss factor η, c = ηk/ω at its
    /// frequency.
    pub fn dashpots(&self) -> [f64; 4] {
        let lost = match (self.loss_factor, self.loss_frequency) {
            (Some(eta), Some(f)) => eta / (2.0 * std::f64::consts::PI * f),
            _ => 0.0,
        };
        let (own, springs) = (self.damping.map_or([0.0; 4], |d| d.all()), self.springs());
        std::array::from_fn(|k| own[k] + lost * springs[k])
    }

    /// Returns whether it holds the body against a static load in some direction.
    pub fn holds(&self) -> bool {
        !self.clamped.is_empty() || self.symmetry || self.springs().iter().any(|k| *k > 0.0)
    }

    /// Returns whether it damps.
    pub fn damps(&self) -> bool {
        self.dashpots().iter().any(|c| *c > 0.0) || self.absorbing.is_some_and(|a| a.absorbs())
    }
}

impl Job {
    /// Part of the job that puts a static load on the bodies which a support has to bear; none where inertia alone can
    /// balance it: of the receptance, and of the stability about a given approach.
    pub(crate) fn static_load(&self) -> Option<&'static str> {
        let analyses = &self.analyses;
        let pressed = self.contact.as_ref().is_some_and(|c| c.normal_load.is_some());
        match () {
            _ if analyses.steady.is_some() => Some("analyses.steady"),
            _ if analyses.creep_curve.is_some() => Some("analyses.creep_curve"),
            _ if analyses.transient.is_some() => Some("analyses.transient"),
            _ if analyses.stability.is_some() && pressed => Some("the sliding under contact.normal_load"),
            _ => None,
        }
    }
}
