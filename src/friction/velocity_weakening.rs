//! Common part of laws whose coefficient falls from rest to fast sliding: two levels, the part of their difference that
//! is left, a memory.

/// How a law falls between its levels.
pub(super) trait Falling {
    /// Part of the difference of the levels that is left at the sliding velocity `v` ≥ 0: 1 at rest.
    fn left(&self, v: f64) -> f64;

    /// Its derivative by `v`, s/m.
    fn left_slope(&self, v: f64) -> f64;

    /// Both of them.
    fn left_with_slope(&self, v: f64) -> (f64, f64) {
        (self.left(v), self.left_slope(v))
    }

    /// Both of them at each of the velocities `v`.
    fn lefts_with_slopes(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        v.iter().map(|v| self.left_with_slope(*v)).unzip()
    }

    /// How it falls, as the end of a sentence with its comma or space.
    fn shape(&self) -> String;

    /// Fault in the parameters of the shape beyond the bounds of each: the key, and the rest of the message.
    fn shape_fault(&self) -> Option<(&'static str, String)> {
        None
    }
}

/// A type of law that remembers, with the keys of its memory after its own.
macro_rules! remembering {
    ($(#[$about:meta])* pub struct $law:ident { $($(#[$of:meta])* pub $key:ident: $type:ty,)* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $law {
            $($(#[$of])* pub $key: $type,)*
            /// Length of sliding over which the coefficient of a particle follows the law (friction memory), m.
            #[serde(default = "crate::friction::memory::default_length")]
            #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
            pub memory_length: f64,
            /// Velocity that the memory takes for slower ones, so that it forgets in stick as well, m/s.
            #[serde(default = "crate::friction::memory::default_velocity")]
            #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
            pub memory_velocity: f64,
        }

        impl $law {
            /// The law with the memory that a job has by default.
            pub fn new($($key: $type),*) -> Self {
                let memory_length = crate::friction::memory::default_length();
                let memory_velocity = crate::friction::memory::default_velocity();
                Self { $($key,)* memory_length, memory_velocity }
            }

            /// The same law with the memory of the length `memory_length`, m.
            pub fn remembering(self, memory_length: f64) -> Self {
                Self { memory_length, ..self }
            }
        }

        impl crate::friction::Remembers for $law {
            fn memory(&self) -> crate::friction::Memory {
                crate::friction::Memory { length: self.memory_length, velocity: self.memory_velocity }
            }

            fn set_memory_length(&mut self, length: f64) {
                self.memory_length = length;
            }
        }
    };
}

/// A type of law that falls from `static` to `kinetic`, with these keys before its own; it says how by [`Falling`].
macro_rules! falling {
    ($(#[$about:meta])* pub struct $law:ident { $($keys:tt)* }) => {
        crate::friction::velocity_weakening::remembering! {
            $(#[$about])*
            pub struct $law {
                /// Coefficient at rest; no less than `kinetic`.
                #[serde(rename = "static")]
                #[schemars(range(min = 0.0), extend("unit" = "1"))]
                pub at_rest: f64,
                /// Coefficient in fast sliding.
                #[schemars(range(min = 0.0), extend("unit" = "1"))]
                pub kinetic: f64,
                $($keys)*
            }
        }

        impl crate::friction::Law for $law {
            fn coefficient(&self, v: f64) -> f64 {
                self.kinetic + (self.at_rest - self.kinetic) * self.left(v)
            }

            fn slope(&self, v: f64) -> f64 {
                (self.at_rest - self.kinetic) * self.left_slope(v)
            }

            fn with_slope(&self, v: f64) -> (f64, f64) {
                let (left, slope) = self.left_with_slope(v);
                let difference = self.at_rest - self.kinetic;
                (self.kinetic + difference * left, difference * slope)
            }

            fn with_slopes(&self, v: &[f64]) -> (Vec<f64>, Vec<f64>) {
                let (mut left, mut slope) = self.lefts_with_slopes(v);
                let difference = self.at_rest - self.kinetic;
                left.iter_mut().for_each(|l| *l = self.kinetic + difference * *l);
                slope.iter_mut().for_each(|s| *s *= difference);
                (left, slope)
            }

            fn scale(&mut self, factor: f64) {
                self.at_rest *= factor;
                self.kinetic *= factor;
            }

            fn fault(&self) -> Option<(&'static str, String)> {
                let (at_rest, kinetic) = (self.at_rest, self.kinetic);
                let rises = || {
                    ("kinetic", format!("found {kinetic}, expected at most static ({at_rest}): the law falls \
                     with the velocity"))
                };
                (kinetic > at_rest).then(rises).or_else(|| self.shape_fault())
            }
        }

        impl std::fmt::Display for $law {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "falling from {} to {}{}", self.at_rest, self.kinetic, self.shape())
            }
        }
    };
}

pub(super) use {falling, remembering};
