//! Rolling contact with Coulomb friction between finite-element bodies in an Eulerian frame, the stability of steady
//! rolling, and the squeal that follows.
//!
//! The crate is the library behind the program `railsqueal`: one job file in, one result file out. It can be used by
//! itself for single parts, such as a contact of half-spaces, a wheel on a rail by their profiles, or a friction law.
//!
//! # Example
//!
//! The point of contact of a wheel S1002 on a rail 60E1, and Hertz' ellipse under 60 kN:
//!
//! ```
//! use railsqueal::placement::builtin::{rail_60e1, s1002};
//! use railsqueal::placement::{HertzLoad, Position, RailSide, WheelPlacement};
//!
//! let placement = WheelPlacement {
//!     side: RailSide::Right,
//!     gauge: 1.435,
//!     gauge_depth: 0.014,
//!     cant: 0.025_f64.atan(),
//!     radius: 0.46,
//!     circles: 1.5,
//!     position: Position::Shift { lateral: -4e-3, yaw: 0.010, roll: 0.0 },
//!     near: None,
//! };
//! let placed = placement.place(&s1002()?, &rail_60e1()?)?;
//! let touch = placed.touch();
//! let ellipse = placed.ellipse(0.5 * 210e9 / 0.91, HertzLoad::Force(60e3))?;
//! assert!((touch.angle + 9.64e-3).abs() < 1e-4);
//! assert!((1e3 * ellipse.semi_axes[0] - 5.81).abs() < 0.02);
//! # Ok::<(), railsqueal::Error>(())
//! ```
//!
//! # Where to look
//!
//! | for | look at |
//! |---|---|
//! | the job file | [`job::Job`], [`job::schema`] |
//! | wheel and rail by their profiles | [`placement`], [`rails`], [`curving`] |
//! | steady rolling with friction | [`contact::SteadyProblem`], [`friction::FrictionLaw`], [`body::half_space`] |
//! | creep forces in closed form | [`contact::baseline`] |
//! | modes and compliance of bodies | [`body`], [`swept`], [`fem`], [`eigen`] |
//! | the reduced model of two bodies | [`model`] |
//! | eigenvalues, growth rates | [`stability`] |
//! | steps in time | [`transient`] |
//! | limit cycles as solutions | `docs/explanation/branches.md` |
//! | sound | [`sound`] |
//! | whole runs | [`analysis`], [`plan`] |
//! | the result file | [`output`] |
//!
//! Theory, conventions and limits are in the pages of `docs/`: `docs/explanation`, `docs/reference/conventions.md` and
//! `docs/explanation/limits.md`. Data flows down the list of rooms in `docs/developers/architecture.md` and never back
//! up.
//!
//! # What it does not do
//!
//! Plasticity, wear and temperature; large strains; dynamics of a vehicle in time; reflections of sound. Units are SI
//! throughout.

#![deny(unsafe_code)]
// What input can reach must not panic.
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::todo))]

pub mod analysis;
pub mod body;
pub mod case;
pub mod contact;
pub mod curving;
pub(crate) mod cycles;
mod dense;
pub mod eigen;
pub mod error;
pub mod fem;
pub mod friction;
pub mod grid;
mod input;
pub mod job;
pub mod memory;
pub mod mesh;
pub mod model;
pub mod output;
pub mod parallel;
#[allow(unsafe_code)] // The one place where the C libraries are called.
pub mod petsc;
pub mod placement;
pub mod plan;
pub mod progress;
mod quadrature;
pub mod rails;
pub(crate) mod random;
pub mod roughness;
pub mod scratch;
pub mod sound;
pub mod stability;
pub mod stop;
pub mod summary;
pub mod swept;
pub mod transient;

pub use error::{Error, Result};
