//! Steady curving of a two-axle bogie or vehicle: shift, yaw, roll and speed of rotation of both axles, and load and
//! creepages at every place of contact.
//!
//! # Frames and signs
//! The track frame at each axle: x forwards, y to the right, z down. A curve to the right has a positive curvature 1/R;
//! its left
//! rail is the outer one. Shift and yaw of an axle are measured from the middle of the track and from its tangent *at
//! that axle*.
//!
//! # Equations
//! With half the wheelbase b, s = +1 for the leading axle and −1 for the trailing one, the shift y, the yaw ψ, and the
//! frame of the
//! bogie at y_B, ψ_B (H. True, K. Knothe and others call this the quasi-static curving problem; the form is that of
//! A. H. Wickens, *Fundamentals of Rail Vehicle Dynamics*, 2003, chapter 5):
//!
//! ```text
//! suspension on an axle    Y = −2k_y (y − y_B − s b ψ_B + b²/2R),   M = −(2k_x l² + k_ψ) (ψ − ψ_B + s b/R)
//! lateral                  Σ F_y + Y + Y_a = 0            Y_a = −W (cant deficiency as an angle)
//! vertical                 Σ F_z + W = 0
//! roll                     Σ (y_c F_z − r_c F_y) + M_a = 0  about the middle of the axle; M_a = Y_a (height of the
//! mass − r)
//! yaw                      Σ (x_c F_y − y_c F_x) + M = 0
//! torque                   Σ r_c (F_x + T ψ/cos δ) = drive
//! frame                    Σ Y = 0,   Σ (s b Y + M) = secondary yaw moment
//! ```
//!
//! Sums run over the places of contact of both wheels, any number each. A place has the normal force of Hertz' contact
//! under the overlap of the undeformed profiles there, and the tangential force of a creep law with the creepages
//!
//! ```text
//! ξ = 1 − y_c/R − Ω r_c/V,   η = ψ/cos δ,   φ = (Ω/V) sin(δ − roll) + cos δ/R
//! ```
//!
//! # What is neglected
//! One ellipse a place, also where wheel and rail fit each other closely (flange root); the track does not yield
//! sideways; the body
//! above the bogie acts by its load, its lateral force and a moment alone.

mod axle;
mod contact_force;
mod equilibrium;
mod limits;

pub use axle::{AxleMotion, AxleState};
pub use contact_force::{ContactForce, CreepLaw};
pub(crate) use contact_force::{Kinematics, PlaceLaws};
pub use equilibrium::CurvingSolution;

use crate::friction::TrackFriction;
use crate::placement::MovableWheel;

/// The wheels of a bogie or of a two-axle vehicle, leading axle first, the inner one of each axle first.
pub const WHEELS: [BogieWheel; 4] = [
    BogieWheel { leading: true, inner: true },
    BogieWheel { leading: true, inner: false },
    BogieWheel { leading: false, inner: true },
    BogieWheel { leading: false, inner: false },
];

/// A wheel of a bogie in a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BogieWheel {
    /// True for the leading axle.
    pub leading: bool,
    /// True for the inner rail of the curve.
    pub inner: bool,
}

impl BogieWheel {
    /// Its name: "leading inner" and so on.
    pub fn name(self) -> String {
        format!("{} {}", if self.leading { "leading" } else { "trailing" }, if self.inner { "inner" } else { "outer" })
    }
}

/// A curve and how it is run through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveMotion {
    /// Curvature 1/R, 1/m: positive to the right, 0 for a straight track.
    pub curvature: f64,
    /// Speed V, m/s.
    pub speed: f64,
    /// Lateral acceleration in the plane of the track, over gravity: (cant deficiency)/(distance of the running
    /// circles), positive where the cant is too small. 1.
    pub deficiency: f64,
}

/// Masses, lengths and springs of a bogie or of a two-axle vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BogieData {
    /// Half the wheelbase b, m.
    pub half_wheelbase: f64,
    /// Load W of an axle on the rails, N.
    pub axle_load: f64,
    /// Radius of the running circles r0, m.
    pub wheel_radius: f64,
    /// Half the distance of the running circles l0, m.
    pub half_circles: f64,
    /// Stiffness k_x and k_y of the primary suspension along and across the track, N/m for each axle box.
    pub primary: [f64; 2],
    /// Half the lateral distance l of the axle boxes, m.
    pub half_boxes: f64,
    /// Yaw stiffness k_ψ between axle and frame beside that of the boxes, N m/rad for each axle.
    pub yaw_stiffness: f64,
    /// Yaw moment of the secondary suspension on the frame, N m: positive turns it to the right.
    pub secondary_moment: f64,
    /// Torque on each axle, N m: positive drives forwards.
    pub torque: [f64; 2],
    /// Height of the centre of gravity over the rails, m.
    pub mass_height: f64,
}

/// A curving problem.
#[derive(Debug, Clone)]
pub struct CurvingProblem {
    /// The left-hand and the right-hand wheel over their rails.
    pub wheels: [MovableWheel; 2],
    /// Young's modulus, Pa, and Poisson's ratio of rail and wheel.
    pub materials: [(f64, f64); 2],
    /// Friction between wheel and rail.
    pub friction: TrackFriction,
    /// Law of the creep forces.
    pub law: CreepLaw,
    /// The bogie.
    pub bogie: BogieData,
    /// The curve.
    pub curve: CurveMotion,
}

impl CurvingProblem {
    /// Bodies, track and laws that the force at a place of contact follows from.
    pub(crate) fn place_laws(&self) -> PlaceLaws<'_> {
        PlaceLaws { materials: self.materials, friction: &self.friction, law: self.law, curve: &self.curve }
    }
}

#[cfg(test)]
mod tests;
