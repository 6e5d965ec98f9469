//! Measured modes of a body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Measured values of the modes of a body.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenModes {
    /// Modes whose frequency or damping was measured on the body by itself, held as the job holds it and at rest: these
    /// take the place of the computed ones, shapes stay. Of a body of revolution both modes of a pair are one here.
    #[serde(default)]
    pub measured: Vec<MeasuredMode>,
}

/// A measured mode: the computed one that it is, by `order` with `family`, by `near`, by `shape`, or by all of them,
/// and what was measured.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredMode {
    /// Nodal diameters of the mode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<u32>,
    /// Family of the mode as the summary names it, e.g. `"axial 0"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
    /// Measured shape: the mode is the computed one with the largest modal assurance criterion (MAC), at least 0.7.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<MeasuredShape>,
    /// Computed frequency that the mode lies within 3 % of, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub near: Option<f64>,
    /// Measured natural frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub frequency: Option<f64>,
    /// Standard deviation of the measured frequency, Hz: for `"distribution": "measured"` of `analyses.uncertainty`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "Hz"))]
    pub frequency_deviation: Option<f64>,
    /// Measured loss factor, in place of all damping of the mode by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0), extend("unit" = "1"))]
    pub loss_factor: Option<f64>,
    /// Standard deviation of the measured loss factor, as that of the frequency.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"))]
    pub loss_factor_deviation: Option<f64>,
    /// Measured damping ratio, half of a loss factor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 0.5), extend("unit" = "1"))]
    pub damping_ratio: Option<f64>,
    /// Standard deviation of the measured damping ratio, as that of the frequency.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"))]
    pub damping_ratio_deviation: Option<f64>,
}

/// A measured mode shape: displacements at points of the body, in one unit of any size.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredShape {
    /// Points (x, y, z). Of a body with `mesh.revolved` y is along the axle, as `absorbers.place` counts it, and the
    /// axle passes through x = z = 0; of other meshes these are the coordinates of the result file.
    #[schemars(length(min = 1, max = 10_000), extend("unit" = "m"))]
    pub points: Vec<[f64; 3]>,
    /// Displacement along x, y and z at each point; null for a direction that was not measured.
    #[schemars(length(min = 1, max = 10_000))]
    pub motion: Vec<[Option<f64>; 3]>,
}

impl MeasuredShape {
    /// The measured components: row 3i + c of component c at the point i, and its value.
    pub fn components(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let all = self.motion.iter().flatten().enumerate();
        all.filter_map(|(row, value)| value.map(|value| (row, value)))
    }
}

impl MeasuredMode {
    /// The measured loss factor.
    pub fn loss(&self) -> Option<f64> {
        self.loss_factor.or(self.damping_ratio.map(|ratio| 2.0 * ratio))
    }

    /// Description of the computed mode that is meant.
    pub fn described(&self) -> String {
        let order = self.order.map(|n| format!("order {n}"));
        let family = self.family.as_ref().map(|f| format!("family \"{f}\""));
        let near = self.near.map(|f| format!("near {f} Hz"));
        let shape = self.shape.as_ref().map(|_| "this shape".to_string());
        [order, family, near, shape].into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}
