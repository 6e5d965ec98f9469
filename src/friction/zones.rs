//! Zones of the rails with a friction of their own, such as a lubricated gauge face.

use super::FrictionLaw;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A zone of the rails with a friction of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionZone {
    /// The rail that the zone is on. Default: both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rail: Option<ZoneRail>,
    /// Contact angle at first touch from which on the zone begins, rad, positive where the surface faces the middle of
    /// the track: 0.9 is on the gauge face. Default: all of the rail.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "rad"))]
    pub from_angle: Option<f64>,
    /// Friction law of the contacts in the zone, as `contact.friction` is for all others.
    pub friction: FrictionLaw,
}

/// A rail of the track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZoneRail {
    /// The left-hand rail in the direction of travel.
    Left,
    /// The right-hand rail in the direction of travel.
    Right,
    /// The inner rail of a curve.
    Inner,
    /// The outer rail of a curve.
    Outer,
}

impl ZoneRail {
    /// True if it is one of a curve.
    pub(crate) fn is_in_a_curve(self) -> bool {
        matches!(self, Self::Inner | Self::Outer)
    }
}

/// Place of a contact on the rails.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceOnRail {
    /// True for the right-hand rail in the direction of travel.
    pub right: bool,
    /// Curvature of the track, 1/m, positive to the right; 0 where it is straight.
    pub curvature: f64,
    /// Contact angle δ at first touch, rad, positive where the rail falls to the right.
    pub angle: f64,
}

impl FrictionZone {
    /// True if a contact at `place` is in the zone.
    ///
    /// ```
    /// use railsqueal::friction::{FrictionLaw, FrictionZone, PlaceOnRail, ZoneRail};
    ///
    /// let friction = FrictionLaw::Constant(0.1);
    /// let gauge_face = FrictionZone { rail: Some(ZoneRail::Outer), from_angle: Some(0.5), friction };
    /// // In a curve to the right the outer rail is the left one, whose gauge face falls to the right.
    /// let flange = PlaceOnRail { right: false, curvature: 0.01, angle: 1.2 };
    /// assert!(gauge_face.holds(flange));
    /// assert!(!gauge_face.holds(PlaceOnRail { angle: 0.03, ..flange }));
    /// assert!(!gauge_face.holds(PlaceOnRail { right: true, angle: -1.2, ..flange }));
    /// ```
    pub fn holds(&self, place: PlaceOnRail) -> bool {
        let PlaceOnRail { right, curvature, angle } = place;
        let inner = right == (curvature > 0.0);
        let is_on_rail = match self.rail {
            None => true,
            Some(ZoneRail::Left) => !right,
            Some(ZoneRail::Right) => right,
            Some(ZoneRail::Inner) => curvature != 0.0 && inner,
            Some(ZoneRail::Outer) => curvature != 0.0 && !inner,
        };
        // The middle of the track is to the right of the left-hand rail.
        let towards_middle = if right { -angle } else { angle };
        is_on_rail && self.from_angle.is_none_or(|least| towards_middle >= least)
    }
}

/// Friction on the rails of a track: that of the first zone that holds a place, or else the law `elsewhere`.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackFriction {
    /// Law outside all zones.
    pub elsewhere: FrictionLaw,
    /// The zones, of which the first that holds a place counts.
    pub zones: Vec<FrictionZone>,
}

impl From<FrictionLaw> for TrackFriction {
    fn from(law: FrictionLaw) -> Self {
        Self { elsewhere: law, zones: Vec::new() }
    }
}

impl TrackFriction {
    /// The law at a place.
    pub fn law(&self, place: PlaceOnRail) -> &FrictionLaw {
        self.zones.iter().find(|zone| zone.holds(place)).map_or(&self.elsewhere, |zone| &zone.friction)
    }

    /// The largest coefficient of all laws at all velocities.
    pub fn largest(&self) -> f64 {
        self.zones.iter().map(|zone| zone.friction.largest()).fold(self.elsewhere.largest(), f64::max)
    }

    /// The same friction with `factor` times all coefficients.
    pub fn scaled(&self, factor: f64) -> Self {
        let scaled = |zone: &FrictionZone| FrictionZone { friction: zone.friction.scaled(factor), ..zone.clone() };
        Self { elsewhere: self.elsewhere.scaled(factor), zones: self.zones.iter().map(scaled).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_zone_that_holds_a_place_counts() {
        let zone = |rail, from_angle, mu| FrictionZone { rail, from_angle, friction: FrictionLaw::Constant(mu) };
        let friction = TrackFriction {
            elsewhere: FrictionLaw::Constant(0.4),
            zones: vec![
                zone(None, Some(0.5), 0.1),
                zone(Some(ZoneRail::Inner), None, 0.25),
                zone(Some(ZoneRail::Left), None, 0.3),
            ],
        };
        let at = |right, curvature, angle| friction.law(PlaceOnRail { right, curvature, angle }).largest();
        // Gauge faces of both rails, on straight track as well.
        assert_eq!([at(true, 0.0, -1.2), at(false, 0.0, 1.2)], [0.1, 0.1]);
        // A steep place that faces the field is none.
        assert_eq!([at(true, 0.0, 0.6), at(false, 0.0, -0.6)], [0.4, 0.3]);
        // The inner rail is the one on the side to which the track turns.
        assert_eq!([at(true, 0.01, 0.0), at(true, -0.01, 0.0)], [0.25, 0.4]);
        assert_eq!([at(false, -0.01, 0.0), at(false, 0.01, 0.0)], [0.25, 0.3]);
        assert_eq!(friction.scaled(2.0).largest(), 0.8);
    }
}
