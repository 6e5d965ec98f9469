//! The rail of a job as one without ends, and the keys of its track that can be fitted to measured decay rates.

use super::rail::{continuous_track, extruded, section, RailContactPosition};
use crate::fem::ElasticMaterial;
use crate::job::{self, Job};
use crate::swept::infinite::{ForcePlace, InfiniteRailSpec, TrackSlope};
use crate::swept::{Infinite, LoadPatch, TrackLayer};
use crate::{Error, Result};
use std::f64::consts::PI;

/// Radius of the tip of a hammer, m.
const HAMMER: f64 = 5e-3;

/// A rail without ends, its pads and sleepers spread evenly, under forces at the top of its head in the upright frame.
pub struct EndlessRail {
    /// Body that it is.
    pub name: &'static str,
    /// Its motions under forces along (x, y, down).
    pub rail: Infinite,
    /// Distance of the sleepers, m.
    pub spacing: f64,
    /// Mass of the rail, kg/m.
    mass: f64,
}

/// The first rail of a job as one without ends, for frequencies up to `reach`, Hz; none where the job has no rail.
pub fn endless(job: &Job, reach: f64) -> Result<Option<EndlessRail>> {
    let rail = |(name, body): (&'static str, &job::Body)| {
        let extruded = extruded(body)?;
        let made = || {
            let track = body.track.clone().unwrap_or_default();
            let m = body.elastic()?;
            let material = ElasticMaterial { young: m.young, poisson: m.poisson, density: m.density };
            let section = section(extruded, RailContactPosition { y: 0.0, z: None, right: false, tilt: None })?;
            let angle = section.contact().angle;
            let meshed = section.for_modes()?;
            let mass = meshed.area() * m.density;
            let making = InfiniteRailSpec {
                section: meshed,
                material,
                track: Some(continuous_track(&track, mass)),
                angle,
                loss: track.loss_factor,
                places: vec![ForcePlace::at_contact_point(LoadPatch::Circle { radius: HAMMER }, -angle)],
            };
            let rail = Infinite::new(&making, 2.0 * PI * reach)?;
            Ok(EndlessRail { name, rail, spacing: track.spacing, mass })
        };
        Some(made().map_err(|e: Error| e.context(format!("bodies.{name}"))))
    };
    job.bodies().into_iter().find_map(rail).transpose()
}

impl EndlessRail {
    /// The rail on pads and ballast of another stiffness and loss factor, on the same sleepers.
    pub(crate) fn on_track(&self, track: &job::Track) -> Infinite {
        self.rail.on_track(&continuous_track(track, self.mass), track.loss_factor)
    }

    /// Derivatives of rail and track by the logarithms of keys.
    pub(crate) fn log_slopes(&self, track: &job::Track, keys: &[TrackKey]) -> Vec<TrackSlope> {
        let laid = continuous_track(track, self.mass);
        let ballast = laid.sleeper.map(|s| s.ballast);
        keys.iter().map(|key| key.log_slope(laid.pad, ballast, track.loss_factor)).collect()
    }
}

/// A key of a track that can be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrackKey {
    /// Vertical stiffness of the pads.
    PadVertical,
    /// Lateral and longitudinal stiffness of the pads.
    PadLateral,
    /// Loss factor of the pads.
    PadLoss,
    /// Vertical stiffness of the ballast.
    BallastVertical,
    /// Lateral and longitudinal stiffness of the ballast.
    BallastLateral,
    /// Loss factor of the ballast.
    BallastLoss,
    /// Loss factor of the rail.
    RailLoss,
}

impl TrackKey {
    /// All of them, with their paths below the track.
    pub const ALL: [(Self, &'static str); 7] = [
        (Self::PadVertical, "pad.vertical"),
        (Self::PadLateral, "pad.lateral"),
        (Self::PadLoss, "pad.loss_factor"),
        (Self::BallastVertical, "sleeper.ballast.vertical"),
        (Self::BallastLateral, "sleeper.ballast.lateral"),
        (Self::BallastLoss, "sleeper.ballast.loss_factor"),
        (Self::RailLoss, "loss_factor"),
    ];

    /// Path below the track.
    pub fn path(self) -> &'static str {
        Self::ALL.iter().find(|(key, _)| *key == self).map_or("", |(_, path)| path)
    }

    /// Unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::PadVertical | Self::PadLateral | Self::BallastVertical | Self::BallastLateral => "N/m",
            Self::PadLoss | Self::BallastLoss | Self::RailLoss => "",
        }
    }

    /// Direction without whose decay rates it cannot be told; none for loss factors.
    pub fn direction(self) -> Option<&'static str> {
        match self {
            Self::PadVertical | Self::BallastVertical => Some("vertical"),
            Self::PadLateral | Self::BallastLateral => Some("lateral"),
            Self::PadLoss | Self::BallastLoss | Self::RailLoss => None,
        }
    }

    /// Its value; none where the track has no sleepers to have ballast.
    pub fn value(self, track: &job::Track) -> Option<f64> {
        self.place(&mut track.clone()).copied()
    }

    /// Sets its value; a track without sleepers has no ballast to set.
    pub fn set(self, track: &mut job::Track, value: f64) {
        if let Some(place) = self.place(track) {
            *place = value;
        }
    }

    fn place(self, track: &mut job::Track) -> Option<&mut f64> {
        let job::Track { pad, sleeper, loss_factor, .. } = track;
        let ballast = sleeper.as_mut().map(|s| &mut s.ballast);
        match self {
            Self::PadVertical => Some(&mut pad.vertical),
            Self::PadLateral => Some(&mut pad.lateral),
            Self::PadLoss => Some(&mut pad.loss_factor),
            Self::BallastVertical => ballast.map(|b| &mut b.vertical),
            Self::BallastLateral => ballast.map(|b| &mut b.lateral),
            Self::BallastLoss => ballast.map(|b| &mut b.loss_factor),
            Self::RailLoss => Some(loss_factor),
        }
    }

    /// Derivative by its logarithm. The dashpots c = η √(s m) of a layer go with the root of its stiffness s.
    fn log_slope(self, pad: TrackLayer, ballast: Option<TrackLayer>, loss: f64) -> TrackSlope {
        let some = TrackSlope::default();
        // Vertical; longitudinal and lateral.
        let only = |layer: TrackLayer, of: [f64; 3], stiffness: f64, viscosity: f64| TrackLayer {
            stiffness: std::array::from_fn(|d| of[d] * stiffness * layer.stiffness[d]),
            viscosity: std::array::from_fn(|d| of[d] * viscosity * layer.viscosity[d]),
        };
        let by = |layer: TrackLayer| match self {
            Self::PadVertical | Self::BallastVertical => only(layer, [1.0, 0.0, 0.0], 1.0, 0.5),
            Self::PadLateral | Self::BallastLateral => only(layer, [0.0, 1.0, 1.0], 1.0, 0.5),
            Self::PadLoss | Self::BallastLoss | Self::RailLoss => only(layer, [1.0; 3], 0.0, 1.0),
        };
        match self {
            Self::PadVertical | Self::PadLateral | Self::PadLoss => TrackSlope { pad: by(pad), ..some },
            Self::BallastVertical | Self::BallastLateral | Self::BallastLoss => {
                TrackSlope { ballast: ballast.map_or(some.ballast, by), ..some }
            }
            Self::RailLoss => TrackSlope { loss, ..some },
        }
    }
}
