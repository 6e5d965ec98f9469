//! Laws of friction: the coefficient as a function of the sliding velocity, as a job gives it and as contact takes it. A further law is
//! a file here and a line in the table below.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Friction law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum FrictionLaw {
    /// Coulomb friction with a constant coefficient.
    Constant(#[schemars(range(min = 0.0), extend("unit" = "1"))] f64),
    /// Friction that depends on the sliding velocity.
    Varying(VaryingFriction),
}

/// A law μ(v) of the sliding velocity v ≥ 0, m/s.
trait Law: std::fmt::Display {
    /// μ(v), 1.
    fn coefficient(&self, v: f64) -> f64;

    /// dμ/dv, s/m.
    fn slope(&self, v: f64) -> f64;

    /// What is wrong with the parameters, if anything: the key, and the rest of the message.
    fn fault(&self) -> Option<(&'static str, String)>;
}

/// The table of laws: name of the type, of the file (and of the key in a job), and the formula.
macro_rules! laws {
    ($($law:ident: $file:ident, $formula:literal;)*) => {
        $(mod $file; pub use $file::$law;)*

        /// Friction that depends on the sliding velocity: the law and its parameters.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum VaryingFriction {
            $(
                #[doc = $formula]
                $law($law),
            )*
        }

        impl VaryingFriction {
            #[inline]
            fn law(&self) -> &dyn Law {
                match self { $(Self::$law(law) => law,)* }
            }

            /// Its key in a job.
            pub fn key(&self) -> &'static str {
                match self { $(Self::$law(_) => stringify!($file),)* }
            }
        }

        $(impl From<$law> for FrictionLaw {
            fn from(law: $law) -> Self {
                Self::Varying(VaryingFriction::$law(law))
            }
        })*
    };
}

laws! {
    Exponential: exponential, "mu(v) = kinetic + (static - kinetic) exp(-v / decay_velocity).";
    Rational: rational, "mu(v) = kinetic + (static - kinetic) / (1 + v / half_velocity).";
}

impl FrictionLaw {
    /// μ at the sliding velocity `v` ≥ 0, m/s.
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

    /// True if the coefficient is the same at all velocities.
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// What is wrong with the parameters beyond the bounds of each, if anything; `path` is the place of the law in the job.
    pub fn fault(&self, path: &str) -> Option<String> {
        let Self::Varying(varying) = self else { return None };
        varying.law().fault().map(|(key, text)| format!("{path}.{}.{key}: {text}", varying.key()))
    }
}

/// What is wrong where a law that falls with the velocity rises.
fn rises(at_rest: f64, kinetic: f64) -> Option<(&'static str, String)> {
    (kinetic > at_rest).then(|| {
        ("kinetic", format!("found {kinetic}, expected at most static ({at_rest}): the law falls with the velocity"))
    })
}

impl std::fmt::Display for FrictionLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Constant(mu) => write!(f, "{mu}"),
            Self::Varying(varying) => varying.law().fmt(f),
        }
    }
}

/// That the slope of a law is its derivative, and that it begins and ends as told.
#[cfg(test)]
fn check(law: impl Into<FrictionLaw>, at_rest: f64, fast: f64) {
    let law = law.into();
    assert!((law.coefficient(0.0) - at_rest).abs() < 1e-15, "at rest: {}", law.coefficient(0.0));
    assert!((law.coefficient(1e9) - fast).abs() < 1e-8, "fast: {}", law.coefficient(1e9));
    for v in [0.01, 0.1, 1.0, 10.0] {
        let h = 1e-6;
        let d = (law.coefficient(v + h) - law.coefficient(v - h)) / (2.0 * h);
        assert!((law.slope(v) - d).abs() < 1e-8, "at {v}: {} against {d}", law.slope(v));
    }
}
