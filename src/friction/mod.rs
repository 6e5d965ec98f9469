//! Laws of friction: the coefficient as a function of the sliding velocity, as a job gives it and as contact takes
//! it, and how the material remembers it ([`Memory`]). A further law is a file here and a line in the table below.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

mod exp_simd;
mod memory;
mod patches;
mod velocity_weakening;
mod zones;

pub use memory::{Memory, Relaxation, Remembered};
pub use patches::PatchFriction;
pub use zones::{FrictionZone, PlaceOnRail, TrackFriction, ZoneRail};

/// Friction law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum FrictionLaw {
    /// Coulomb friction with a constant coefficient.
    Constant(#[schemars(range(min = 0.0), extend("unit" = "1"))] f64),
    /// Friction that depends on the sliding velocity.
    Varying(VaryingFriction),
}

/// Common part of all laws that depend on the velocity.
trait Remembers {
    /// Its memory.
    fn memory(&self) -> Memory;

    /// Gives it a memory of the length `length`, m.
    fn set_memory_length(&mut self, length: f64);
}

/// A law μ(v) of the sliding velocity v ≥ 0, m/s.
trait Law: Remembers + std::fmt::Display {
    /// μ(v), 1.
    fn coefficient(&self, v: f64) -> f64;

    /// dμ/dv, s/m.
    fn slope(&self, v: f64) -> f64;

    /// Both of them.
    fn with_slope(&self, v: f64) -> (f64, f64) {
        (self.coefficient(v), self.slope(v))
    }

    /// Both of them at each of the velocities `v`.
    fn with_slopes(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        v.iter().map(|v| self.with_slope(*v)).unzip()
    }

    /// The largest coefficient.
    fn largest(&self) -> f64 {
        self.coefficient(0.0)
    }

    /// Multiplies the coefficient by `factor` at all velocities.
    fn scale(&mut self, factor: f64);

    /// Fault in the parameters, if anything: the key, and the rest of the message.
    fn fault(&self) -> Option<(&'static str, String)>;
}

/// The table of laws: name of the variant, of the type, of the file (and of the key in a job), and the formula.
macro_rules! laws {
    ($($law:ident($type:ident): $file:ident, $formula:literal;)*) => {
        $(mod $file; pub use $file::$type;)*

        /// Friction that depends on the sliding velocity: the law and its parameters.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum VaryingFriction {
            $(
                #[doc = $formula]
                $law($type),
            )*
        }

        impl VaryingFriction {
            #[inline]
            fn law(&self) -> &dyn Law {
                match self { $(Self::$law(law) => law,)* }
            }

            fn law_mut(&mut self) -> &mut dyn Law {
                match self { $(Self::$law(law) => law,)* }
            }

            /// Its key in a job.
            pub fn key(&self) -> &'static str {
                match self { $(Self::$law(_) => stringify!($file),)* }
            }
        }

        $(impl From<$type> for FrictionLaw {
            fn from(law: $type) -> Self {
                Self::Varying(VaryingFriction::$law(law))
            }
        })*
    };
}

laws! {
    Exponential(Exponential): exponential, "mu(v) = kinetic + (static - kinetic) exp(-v / decay_velocity).";
    Rational(Rational): rational, "mu(v) = kinetic + (static - kinetic) / (1 + v / half_velocity).";
    DoubleExponential(DoubleExponential): double_exponential,
        "mu(v) falls from static to kinetic by two exponential terms.";
    Linear(Linear): linear, "mu(v) = kinetic + (static - kinetic) max(0, 1 - v / end_velocity).";
    Kraft(Kraft): kraft, "mu(v) = static (1 - exp(-0.138 m/s / v) / 2 - exp(-6.9 m/s / v) / 2).";
    Table(FrictionTable): table, "mu(v) along straight lines between the points of a table.";
}

impl FrictionLaw {
    /// μ at the sliding velocity `v` ≥ 0, m/s.
    ///
    /// ```
    /// use railsqueal::friction::FrictionLaw;
    ///
    /// let law: FrictionLaw = serde_json::from_str(
    ///     r#"{"exponential": {"static": 0.4, "kinetic": 0.3, "decay_velocity": 0.5}}"#,
    /// )
    /// .expect("a law as a job has it");
    /// assert!((law.coefficient(0.0) - 0.4).abs() < 1e-15);
    /// assert!(law.slope(0.1) < 0.0);
    /// // The coefficient of a particle follows the law over 20 µm of sliding.
    /// assert_eq!(law.memory().map(|m| m.length), Some(2e-5));
    /// ```
    #[inline]
    pub fn coefficient(&self, v: f64) -> f64 {
        match self {
            Self::Constant(mu) => *mu,
            Self::Varying(varying) => varying.law().coefficient(v),
        }
    }

    /// dμ/dv at the sliding velocity `v` ≥ 0, s/m.
    #[inline]
    pub fn slope(&self, v: f64) -> f64 {
        match self {
            Self::Constant(_) => 0.0,
            Self::Varying(varying) => varying.law().slope(v),
        }
    }

    /// μ and dμ/dv at the sliding velocity `v` ≥ 0, m/s.
    #[inline]
    pub(crate) fn with_slope(&self, v: f64) -> (f64, f64) {
        match self {
            Self::Constant(mu) => (*mu, 0.0),
            Self::Varying(varying) => varying.law().with_slope(v),
        }
    }

    /// The largest coefficient of all velocities.
    pub fn largest(&self) -> f64 {
        match self {
            Self::Constant(mu) => *mu,
            Self::Varying(varying) => varying.law().largest(),
        }
    }

    /// The memory of a law that depends on the velocity.
    #[inline]
    pub fn memory(&self) -> Option<Memory> {
        match self {
            Self::Constant(_) => None,
            Self::Varying(varying) => Some(varying.law().memory()),
        }
    }

    /// The same law with a memory of the length `length`, m, where it has one.
    pub fn remembering(&self, length: f64) -> Self {
        let mut law = self.clone();
        if let Self::Varying(varying) = &mut law {
            varying.law_mut().set_memory_length(length);
        }
        law
    }

    /// The same law with `factor` times the coefficient at all velocities.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut law = self.clone();
        match &mut law {
            Self::Constant(mu) => *mu *= factor,
            Self::Varying(varying) => varying.law_mut().scale(factor),
        }
        law
    }

    /// Key of the length of its memory in the job, `path` being the place of the law; empty where it has none.
    pub(crate) fn memory_key(&self, path: &str) -> String {
        match self {
            Self::Constant(_) => String::new(),
            Self::Varying(varying) => format!("{path}.{}.memory_length", varying.key()),
        }
    }

    /// True if the coefficient is the same at all velocities.
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// Fault in the parameters beyond the bounds of each, if anything; `path` is the place of the law in the job.
    pub fn fault(&self, path: &str) -> Option<String> {
        let Self::Varying(varying) = self else { return None };
        varying.law().fault().map(|(key, text)| format!("{path}.{}.{key}: {text}", varying.key()))
    }
}

impl std::fmt::Display for FrictionLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Constant(mu) => write!(f, "{mu}"),
            Self::Varying(varying) => {
                varying.law().fmt(f)?;
                write!(f, ", remembered over {} m", varying.law().memory().length)
            }
        }
    }
}

/// Checks that the slope of a law is its derivative, and that it begins and ends as told.
#[cfg(test)]
fn check(law: &FrictionLaw, at_rest: f64, fast: f64) {
    assert!((law.coefficient(0.0) - at_rest).abs() < 1e-15, "at rest: {}", law.coefficient(0.0));
    assert!((law.coefficient(1e9) - fast).abs() < 1e-8, "fast: {}", law.coefficient(1e9));
    for v in [0.01, 0.1, 1.0, 10.0] {
        let h = 1e-6;
        let d = (law.coefficient(v + h) - law.coefficient(v - h)) / (2.0 * h);
        assert!((law.slope(v) - d).abs() < 1e-8, "at {v}: {} against {d}", law.slope(v));
        assert_eq!(law.with_slope(v), (law.coefficient(v), law.slope(v)), "at {v}");
        assert!((law.scaled(1.7).coefficient(v) - 1.7 * law.coefficient(v)).abs() < 1e-15, "scaled, at {v}");
    }
}
