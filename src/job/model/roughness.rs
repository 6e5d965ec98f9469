//! Roughness of the running surfaces.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Roughness of the running surfaces, which travels through the contact in `analyses.transient`; other analyses take
/// the bodies as smooth. A body has the sum of its parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Roughness {
    /// Parts of the roughness of the lower body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lower: Vec<RoughnessPart>,
    /// Parts of the roughness of the upper body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub upper: Vec<RoughnessPart>,
    /// Parts at further contacts, in their order. Default: those of the first one, with lines of their own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<FurtherRoughness>,
    /// Way over which all heights grow from nothing, m, so that the run begins with smooth bodies.
    #[serde(default = "default_onset")]
    #[schemars(range(min = 0.0), extend("unit" = "m"))]
    pub onset: f64,
}

/// Roughness at a further contact.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FurtherRoughness {
    /// Parts of the roughness of the lower body there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lower: Vec<RoughnessPart>,
    /// Parts of the roughness of the upper body there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub upper: Vec<RoughnessPart>,
}

fn default_onset() -> f64 {
    0.05
}

impl Roughness {
    /// The bodies' parts at the contact `number` that are given, the lower one's first.
    pub fn bodies(&self, number: usize) -> [RoughBody<'_>; 2] {
        let further = number.checked_sub(1).and_then(|k| Some((k, self.further.get(k)?)));
        let (path, lower, upper) = match further {
            Some((k, own)) => (format!("contact.roughness.further.{k}"), &own.lower, &own.upper),
            None => ("contact.roughness".to_owned(), &self.lower, &self.upper),
        };
        let of = |name: &'static str, parts| RoughBody { name, path: format!("{path}.{name}"), parts };
        [of("lower", lower), of("upper", upper)]
    }

    /// All parts that are given, body by body.
    pub fn all(&self) -> impl Iterator<Item = RoughBody<'_>> {
        (0..=self.further.len()).flat_map(|number| self.bodies(number))
    }

    /// Key and path of each file of a measured part.
    pub fn files(&self) -> Vec<(String, &PathBuf)> {
        let mut all = Vec::new();
        for RoughBody { path, parts, .. } in self.all() {
            for (i, part) in parts.iter().enumerate() {
                if let RoughnessPart::File(file) = part {
                    all.push((format!("{path}.{i}.file"), &file.path));
                }
            }
        }
        all
    }

    /// The same of the paths, to be changed.
    pub(crate) fn paths_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let further = self.further.iter_mut().flat_map(|own| own.lower.iter_mut().chain(&mut own.upper));
        let parts = self.lower.iter_mut().chain(&mut self.upper).chain(further);
        parts.filter_map(|part| match part {
            RoughnessPart::File(file) => Some(&mut file.path),
            _ => None,
        })
    }
}

/// Roughness of a body at a contact.
#[derive(Debug, Clone)]
pub struct RoughBody<'r> {
    /// Name of the body: lower or upper.
    pub name: &'static str,
    /// Key of its parts.
    pub path: String,
    /// The parts.
    pub parts: &'r [RoughnessPart],
}

/// A part of the roughness of a body. Heights are positive where the surface stands out; ways grow in the direction
/// of travel, from the centre of the contact at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RoughnessPart {
    /// A random line with the levels of a spectrum.
    Spectrum(RoughSpectrum),
    /// A measured line or area.
    File(RoughFile),
    /// Waves of one length.
    Wave(RoughWave),
    /// A flat of a wheel.
    Flat(RoughFlat),
    /// A dipped joint: two rails bent down where they meet.
    Joint(RoughJoint),
    /// A step in the height of the surface.
    Step(RoughStep),
}

/// A random line, alike across the contact, by levels in one-third-octave bands of wavelength.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoughSpectrum {
    /// `"ISO3095"`, the limit of ISO 3095:2013 for rails, or pairs of wavelength, m, and level, dB re 1 µm.
    pub levels: RoughLevels,
    /// Added to all levels, dB.
    #[serde(default)]
    #[schemars(extend("unit" = "dB"))]
    pub raise: f64,
    /// Phases are drawn from it: the same seed gives the same line.
    pub seed: u32,
    /// Way after which the line repeats itself, m. Default: the circumference of a wheel, else 20.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub length: Option<f64>,
    /// Shorter waves are left out, m. Default: all of the levels' bands are made.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("unit" = "m"))]
    pub shortest: f64,
}

/// Levels of a spectrum.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum RoughLevels {
    /// By name.
    Named(RoughStandard),
    /// Pairs of wavelength, m, and level, dB re 1 µm.
    Bands(Vec<[f64; 2]>),
}

/// A spectrum with a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum RoughStandard {
    /// The limit of ISO 3095:2013.
    #[serde(rename = "ISO3095")]
    Iso3095,
}

/// A line or an area in a text file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoughFile {
    /// Its path, relative to the job file: way and height in two columns, or a table whose first row has the lateral
    /// places and whose first column has the way.
    pub path: PathBuf,
    /// Unit of the heights, m.
    #[serde(default = "micrometre")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub unit: f64,
    /// Unit of the way and of the lateral places, m.
    #[serde(default = "metre")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub distance_unit: f64,
    /// Way after which the file repeats itself, m. Default: the circumference of a wheel, if the file is as long;
    /// else it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub period: Option<f64>,
}

fn micrometre() -> f64 {
    1e-6
}

fn metre() -> f64 {
    1.0
}

/// Waves of one length, amplitude sin(2π (s − at)/wavelength).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoughWave {
    /// Wavelength, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub wavelength: f64,
    /// Half the height from trough to crest, m.
    #[schemars(extend("unit" = "m"))]
    pub amplitude: f64,
    /// Position at which a rising wave passes its mean, m.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub at: f64,
}

/// A flat of a wheel, which comes back at every turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoughFlat {
    /// Way to its middle, m.
    #[schemars(extend("unit" = "m"))]
    pub at: f64,
    /// Its length, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub length: f64,
    /// Its depth, m. Default: that of a chord, length²/(8R), half of it if it is rounded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub depth: Option<f64>,
    /// True if its edges are worn, so that it is a period of a cosine; a new one is a chord.
    #[serde(default)]
    pub rounded: bool,
}

/// A dipped joint, depth (1 − 2|s − at|/length)².
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoughJoint {
    /// Way to the joint, m.
    #[schemars(extend("unit" = "m"))]
    pub at: f64,
    /// Length of the dip, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub length: f64,
    /// Depth of the dip, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub depth: f64,
}

/// A step: ahead of it the surface is higher.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoughStep {
    /// Way to its middle, m.
    #[schemars(extend("unit" = "m"))]
    pub at: f64,
    /// Way over which the surface rises, half a wave of a sine, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub length: f64,
    /// Its height, m; negative for a step down.
    #[schemars(extend("unit" = "m"))]
    pub height: f64,
}
