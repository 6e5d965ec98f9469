//! The force at one place of contact.

use super::CurveMotion;
use crate::contact::baseline::{coefficients, fastsim, polach, shen_hedrick_elkins, EllipticContact};
use crate::contact::ContactCreepage;
use crate::friction::{PlaceOnRail, TrackFriction};
use crate::placement::{ContactPlace, Ellipse as HertzEllipse, HertzLoad};
use crate::Result;

/// Half-axis ratios a/b between which Kalker's coefficients are tabulated; beyond them those of the end are taken.
const TABULATED: [f64; 2] = [0.1, 10.0];

/// Stiffness of a gap that is open, N/m: it keeps the equations of a wheel that has lost contact regular, and carries
/// no load in a solution, which [`super::limits`] refuses.
const OPEN_STIFFNESS: f64 = 1e7;

/// A creep law of total forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CreepLaw {
    /// Shen, Hedrick and Elkins (1983).
    ShenHedrickElkins,
    /// Polach (1999).
    Polach,
    /// Kalker's FASTSIM (1982).
    Fastsim,
}

impl CreepLaw {
    fn force(self, ellipse: &EllipticContact, creepage: &ContactCreepage) -> [f64; 2] {
        match self {
            Self::ShenHedrickElkins => shen_hedrick_elkins(ellipse, creepage),
            Self::Polach => polach(ellipse, creepage),
            Self::Fastsim => fastsim(ellipse, creepage),
        }
    }
}

/// A place of contact with its load and creepages. Forces are those on the wheel, in the track frame (x forwards, y
/// right, z down).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForce {
    /// The place.
    pub place: ContactPlace,
    /// Approach along the normal, m; negative where the gap is open.
    pub approach: f64,
    /// Normal force N, N.
    pub normal: f64,
    /// Half-axes of Hertz' ellipse along and across the track, m.
    pub half_axes: [f64; 2],
    /// Coefficient of friction at the creep velocity.
    pub friction: f64,
    /// Longitudinal creepage ξ, 1, lateral creepage η, 1, and spin φ, 1/m, of the rail against the wheel.
    pub creepage: [f64; 3],
    /// Longitudinal force F_x on the wheel, N, positive forwards.
    pub longitudinal: f64,
    /// Tangential force T on the wheel across the track, along the rail's tangent to the right, N.
    pub tangential: f64,
}

/// How an axle meets a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kinematics {
    /// Yaw ψ, rad.
    pub yaw: f64,
    /// Roll, rad.
    pub roll: f64,
    /// Ω/V, rad/m.
    pub turning: f64,
    /// Longitudinal and lateral creepage, 1, and spin, 1/m, where they are not those of the motion.
    pub given: [Option<f64>; 3],
}

/// Bodies, track and laws that the force at a place of contact follows from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaceLaws<'a> {
    /// Young's modulus, Pa, and Poisson's ratio of rail and wheel.
    pub materials: [(f64, f64); 2],
    /// Friction between wheel and rail.
    pub friction: &'a TrackFriction,
    /// Law of the creep forces.
    pub law: CreepLaw,
    /// The curve.
    pub curve: &'a CurveMotion,
}

impl ContactForce {
    /// The force at `place` of the wheel on the `right` or on the left where the axle is `height` m below one radius
    /// over the rails' tops.
    pub(crate) fn at_height(
        laws: &PlaceLaws,
        (place, right): (ContactPlace, bool),
        height: f64,
        motion: Kinematics,
    ) -> Result<ContactForce> {
        let (cos, curve) = (place.angle.cos(), laws.curve);
        let approach = cos * (height - place.distance);
        // ξ = 1 − y_c/R − Ω r_c/V, η = ψ/cos δ, φ = (Ω/V) sin χ + cos δ/R with χ = δ − roll.
        let own = [
            1.0 - place.across * curve.curvature - motion.turning * place.radius,
            motion.yaw / cos,
            motion.turning * (place.angle - motion.roll).sin() + cos * curve.curvature,
        ];
        let creepage = [0, 1, 2].map(|k| motion.given[k].unwrap_or(own[k]));
        let law = laws.friction.law(PlaceOnRail { right, curvature: curve.curvature, angle: place.angle });
        let friction = law.coefficient(curve.speed * creepage[0].hypot(creepage[1]));
        let mut force = ContactForce {
            place,
            approach,
            normal: OPEN_STIFFNESS * approach,
            half_axes: [0.0; 2],
            friction,
            creepage,
            longitudinal: 0.0,
            tangential: 0.0,
        };
        if approach <= 0.0 {
            return Ok(force);
        }
        let elastic = Elastic::of(laws.materials);
        let [along, across] = place.curvature;
        let hertz = HertzEllipse::new([[along, 0.0], [0.0, across]], elastic.plane, HertzLoad::Approach(approach))?;
        let [a, b] = hertz.semi_axes;
        force.normal = place.share * hertz.force;
        force.half_axes = [a, b];
        let ratio = (a / b).clamp(TABULATED[0], TABULATED[1]);
        if let Some(kalker) = coefficients(elastic.poisson, ratio) {
            let ellipse = EllipticContact {
                a,
                b,
                load: hertz.force,
                friction,
                shear: elastic.shear,
                plane: elastic.plane,
                kalker,
            };
            let [longitudinal, lateral, spin] = creepage;
            // Forces on the rail along x, which points backwards, and along y: those on the wheel are opposite.
            let [back, right] = laws.law.force(&ellipse, &ContactCreepage { longitudinal, lateral, spin });
            (force.longitudinal, force.tangential) = (place.share * back, -place.share * right);
        }
        Ok(force)
    }

    /// True if the place carries load.
    pub(crate) fn is_loaded(&self) -> bool {
        self.approach > 0.0
    }

    /// Lateral force on the wheel, N, positive to the right: N sin δ + T cos δ.
    pub fn lateral(&self) -> f64 {
        self.normal * self.place.angle.sin() + self.tangential * self.place.angle.cos()
    }

    /// Vertical force on the wheel, N, positive down: −N cos δ + T sin δ.
    pub fn vertical(&self) -> f64 {
        -self.normal * self.place.angle.cos() + self.tangential * self.place.angle.sin()
    }

    /// Tangential force over the bound of friction, 1.
    pub(crate) fn utilisation(&self) -> f64 {
        let bound = self.friction * self.normal;
        if bound > 0.0 {
            self.longitudinal.hypot(self.tangential) / bound
        } else {
            0.0
        }
    }
}

/// Moduli of both bodies together: 1/G = (1/G1 + 1/G2)/2, ν/G = (ν1/G1 + ν2/G2)/2, 1/E* = Σ (1 − ν²)/E.
struct Elastic {
    shear: f64,
    poisson: f64,
    plane: f64,
}

impl Elastic {
    fn of(materials: [(f64, f64); 2]) -> Self {
        let soft = materials.map(|(young, poisson)| (1.0 + poisson) / young);
        let shear = 1.0 / (soft[0] + soft[1]);
        let poisson = shear * (materials[0].1 * soft[0] + materials[1].1 * soft[1]);
        let plane = 1.0 / materials.map(|(young, poisson)| (1.0 - poisson * poisson) / young).iter().sum::<f64>();
        Self { shear, poisson, plane }
    }
}
