//! The contact: friction, load, creepages, patch, contact points.

use super::{Creepage, CreepageKey};
use crate::friction::{FrictionLaw, FrictionZone, PlaceOnRail, TrackFriction};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Rolling contact with Coulomb friction. Rolling is towards -x: the leading edge is x = -a.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Friction law: a number is Coulomb's coefficient, 0 frictionless; `{"exponential": ...}` falls with the velocity.
    pub friction: FrictionLaw,
    /// Zones of the rails with a friction of their own, such as a lubricated gauge face. The first zone that holds a
    /// contact has its friction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub friction_zones: Vec<FrictionZone>,
    /// Normal force that presses the bodies together, N. Give either this or `approach`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N"))]
    pub normal_load: Option<f64>,
    /// Rigid approach of the bodies from first touch, m. Give either this or `normal_load`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub approach: Option<f64>,
    /// Vertical force on a wheel that its contacts carry together, N, with `places` "all" in the place of
    /// `normal_load`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N"))]
    pub vertical_load: Option<f64>,
    /// Vertical force on a wheelset that both its wheels carry together, N, with `wheels` "both" in the place of
    /// `normal_load`: the normal force at each wheel follows from it and from `roll_moment`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N"))]
    pub axle_load: Option<f64>,
    /// Moment about the track that the wheels bear beside `axle_load`, N m, positive where it loads the right-hand
    /// wheel.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(extend("unit" = "N m"))]
    pub roll_moment: f64,
    /// Lateral force of the rail on the wheel, N, positive to the right, beside `vertical_load`: the shift of the wheel
    /// follows from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "N"))]
    pub lateral_force: Option<f64>,
    /// Torque of the drive or brake on the axle of a wheel on a rail, N m, positive where it drives, 0 of one that
    /// rolls freely. The angular speed, and with it the creepages, then follow from the creep forces of all contacts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "N m"))]
    pub torque: Option<f64>,
    /// Places of a wheel on its rail that are contacts.
    #[serde(default, skip_serializing_if = "ContactPlaces::is_one")]
    pub places: ContactPlaces,
    /// Wheels of a wheelset that are in contact.
    #[serde(default, skip_serializing_if = "ContactWheels::is_one")]
    pub wheels: ContactWheels,
    /// Further bodies, like the upper one or those of `bodies.others`, that touch the lower one elsewhere around its
    /// axle, such as other wheels on a roller. They share the keys of this contact except those that they give
    /// themselves.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub around: Vec<ContactAround>,
    /// Rolling speed V, m/s; needed unless `points` are given.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub speed: f64,
    /// Rigid creep of body 1 relative to body 2, divided by the speed.
    #[serde(default)]
    pub creepage: Creepage,
    /// Source of the compliance of the contact surface.
    #[serde(default)]
    pub compliance: Compliance,
    /// Points at which the laws of contact hold: at the nodes, or at points of quadrature between them.
    #[serde(default)]
    pub quadrature: Quadrature,
    /// The finely meshed rectangle on which contact is looked for; it must hold the whole contact. Needed by built-in
    /// cylinders and swept bodies; a mesh file brings its own grid, the group `contact`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patch: Option<Patch>,
    /// The grid on which two meshes of three dimensions meet that do not have the same one, or whose compliance is
    /// `"hybrid"`; given, two meshes that have the same one meet on it as well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<CommonGrid>,
    /// Placement of the wheel (upper body) on the rail (lower body), both given by their profiles. Frame, gap, grid and
    /// creepages follow from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement: Option<super::Placement>,
    /// The wheel of `vehicle` in `curve` whose contact this is: load, speed, position and creepages are then those of
    /// the equilibrium in the curve. Default, where both are given: the leading inner wheel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<super::ContactOfWheel>,
    /// True once load and position are those of the equilibrium in the curve, and no longer stand-ins.
    #[serde(skip)]
    pub in_equilibrium: bool,
    /// The other contacts of a wheel that carries load at several places, of the other wheel, and of the bodies of
    /// `around`, once these are known.
    #[serde(skip)]
    pub further: Vec<Contact>,
    /// Angle of a contact of `around` about the axle of the lower body, rad.
    #[serde(skip)]
    pub turned: f64,
    /// Friction law that a contact of `around` has of its own.
    #[serde(skip)]
    pub own_friction: Option<FrictionLaw>,
    /// Name of the body of `bodies.others` that touches the lower one here; none: one like the upper body.
    #[serde(skip)]
    pub body: Option<String>,
    /// Name of a contact of `contacts`.
    #[serde(skip)]
    pub name: Option<String>,
    /// Contact angle δ of a wheel on its rail, rad, positive where the rail falls to the right, once it is known.
    #[serde(skip)]
    pub angle: f64,
    /// The same at first touch, as a vehicle in its curve sees it; by it zones of friction hold a contact.
    #[serde(skip)]
    pub touch_angle: f64,
    /// Roughness of the running surfaces, in `analyses.transient`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<super::Roughness>,
    /// Contact points of bodies given by matrices, all closed and sliding. They take the place of load, speed,
    /// creepage and patch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<ContactPoint>>,
}

/// Places of a wheel on its rail that are contacts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactPlaces {
    /// One place: that of first touch, or of a wheel in a curve the one with the larger load.
    #[default]
    One,
    /// All places that carry load, such as tread and flange, each with its own angle, grid and creepages.
    All,
}

/// Wheels of a wheelset that are in contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ContactWheels {
    /// The wheel of the placement, or that which `from` names.
    #[default]
    One,
    /// Both wheels, each on a rail of its own. The contacts of the wheel that the placement or `from` names come first.
    Both,
}

impl ContactWheels {
    fn is_one(&self) -> bool {
        *self == Self::One
    }
}

impl ContactPlaces {
    fn is_one(&self) -> bool {
        *self == Self::One
    }
}

/// A further body that touches the lower one elsewhere around its axle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactAround {
    /// Angle about the axle of the lower body from the first contact, rad, positive towards +x: the material of a lower
    /// body that turns passes the first contact before this one.
    #[schemars(extend("unit" = "rad"))]
    pub angle: f64,
    /// Name of the body, one of `bodies.others`. Default: another one like the upper body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Normal force that presses this body on the lower one, N. Default: load or approach of the first contact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N"))]
    pub normal_load: Option<f64>,
    /// Rectangle on which this contact is looked for. Default: that of the first one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patch: Option<Patch>,
    /// Friction law at this contact. Default: that of the first one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionLaw>,
    /// Rigid creep at this contact. Default: that of the first one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub creepage: Option<Creepage>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// One sliding contact point between bodies given by matrices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactPoint {
    /// Direction (x, y) in which body 1 slides over body 2, of any length; y may be left out.
    pub direction: Vec<f64>,
    /// Gap between the undeformed bodies at this contact, m, where a load presses them together.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(extend("unit" = "m"))]
    pub gap: f64,
    /// Static normal force, N, instead of a load on all contacts. With `slip_velocity` it damps motion across the
    /// sliding direction, and makes a falling friction law act.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0), extend("unit" = "N"))]
    pub force: Option<f64>,
    /// Sliding velocity, m/s. Needed with `force` and under a load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m/s"))]
    pub slip_velocity: Option<f64>,
}

impl Contact {
    /// Fills in what follows from the wheel that is named, with stand-ins until the equilibrium in the curve is known.
    /// The keys that are given beside it are the faults.
    pub(crate) fn stand_in(&mut self, curve: &super::Curve, vehicle: &super::VehicleData) -> Vec<String> {
        let given = [
            ("normal_load", self.normal_load.is_some()),
            ("approach", self.approach.is_some()),
            ("vertical_load", self.vertical_load.is_some()),
            ("axle_load", self.axle_load.is_some()),
            ("lateral_force", self.lateral_force.is_some()),
            ("speed", self.speed != 0.0),
            ("creepage", self.creepage != Creepage::default()),
            ("placement", self.placement.is_some()),
            ("patch", self.patch.is_some()),
        ];
        let faults = given.into_iter().filter(|(_, is)| *is).map(|(key, _)| {
            format!(
                "contact.{key}: given beside curve and vehicle, from which it follows (contact.from names \
             the wheel); leave one of the two out"
            )
        });
        let faults = faults.collect();
        self.normal_load = Some(0.5 * vehicle.axle_load);
        self.speed = curve.speed;
        self.placement = Some(super::Placement {
            side: super::TrackSide::Right,
            radius: vehicle.wheel_radius,
            gauge: curve.gauge + curve.gauge_widening,
            gauge_depth: curve.gauge_depth,
            cant: curve.rail_cant,
            circles: vehicle.circles(),
            lateral: 0.0,
            yaw: 0.0,
            roll: 0.0,
            contact: None,
            loaded: true,
            speed: None,
            angular_speed: None,
            creepage: super::GivenCreepage::default(),
            curvature: 0.0,
            touch_near: None,
        });
        faults
    }

    /// Makes the contacts of the bodies of `around`, which follow from their keys alone.
    pub(crate) fn make_around(&mut self) {
        if self.around.is_empty() {
            return;
        }
        let base = Self { around: Vec::new(), further: Vec::new(), ..self.clone() };
        let one = |own: &ContactAround| {
            let mut contact = Self { turned: own.angle, body: own.body.clone(), ..base.clone() };
            if own.normal_load.is_some() {
                (contact.normal_load, contact.approach) = (own.normal_load, None);
            }
            contact.creepage = own.creepage.unwrap_or(contact.creepage);
            contact.own_friction = own.friction.clone();
            contact.patch = own.patch.or(contact.patch);
            contact
        };
        self.further = self.around.iter().map(one).collect();
    }

    /// The same with another value of one creepage; the creepages of further contacts change by as much.
    pub fn with_creepage_at(&self, key: CreepageKey, value: f64) -> Self {
        let change = value - self.creepage.component(key);
        let further = self.further.iter().map(|one| one.with_creepage_at(key, one.creepage.component(key) + change));
        Self { creepage: self.creepage.with(key, value), further: further.collect(), ..self.clone() }
    }

    /// Takes off what [`Contact::stand_in`] and the equilibrium have filled in.
    pub(super) fn remove_derived(&mut self) {
        (self.normal_load, self.speed, self.placement) = (None, 0.0, None);
        (self.creepage, self.in_equilibrium) = (Creepage::default(), false);
        self.further.clear();
    }

    /// Takes off the places and the shift that follow from the forces on a wheel, and the forces at the wheels that
    /// follow from those on a wheelset.
    pub(in crate::job) fn remove_places(&mut self) {
        if self.wheels == ContactWheels::Both && self.axle_load.is_some() {
            self.normal_load = None;
            self.further.clear();
        }
        if self.places == ContactPlaces::All && self.vertical_load.is_some() {
            self.normal_load = None;
            let shifted = self.lateral_force.is_some();
            self.placement.iter_mut().for_each(|p| {
                p.touch_near = None;
                p.lateral = if shifted { 0.0 } else { p.lateral };
            });
            self.further.clear();
        }
    }

    /// Friction of the track: the law of the contact and its zones.
    pub fn track_friction(&self) -> TrackFriction {
        TrackFriction { elsewhere: self.friction.clone(), zones: self.friction_zones.clone() }
    }

    /// Friction law at this contact, once its place is known: its own one, that of its zone, or that of the job.
    pub fn law(&self) -> &FrictionLaw {
        match (&self.own_friction, self.zone()) {
            (Some(own), _) => own,
            (None, Some(number)) => &self.friction_zones[number].friction,
            (None, None) => &self.friction,
        }
    }

    /// Number of the zone that holds this contact, once its place is known.
    pub(crate) fn zone(&self) -> Option<usize> {
        let placement = self.placement.as_ref()?;
        let right = placement.side == super::TrackSide::Right;
        let place = PlaceOnRail { right, curvature: placement.curvature, angle: self.touch_angle };
        self.friction_zones.iter().position(|zone| zone.holds(place))
    }

    /// Key of the friction law at the contact `number` of this job.
    pub(crate) fn law_key(&self, number: usize) -> String {
        let here = self.all().nth(number).map(|one| (one.own_friction.is_some(), one.zone()));
        match here {
            _ if self.name.is_some() => format!("contacts.{number}.friction"),
            Some((true, _)) => format!("contact.around.{}.friction", number - 1),
            Some((_, Some(zone))) => format!("contact.friction_zones.{zone}.friction"),
            _ => "contact.friction".into(),
        }
    }

    /// The same with `factor` times the friction at all contacts.
    pub(crate) fn with_friction_scaled(&self, factor: f64) -> Self {
        let TrackFriction { elsewhere, zones } = self.track_friction().scaled(factor);
        Self {
            friction: elsewhere,
            friction_zones: zones,
            own_friction: self.own_friction.as_ref().map(|law| law.scaled(factor)),
            further: self.further.iter().map(|one| one.with_friction_scaled(factor)).collect(),
            ..self.clone()
        }
    }

    /// The contacts: this one, then the other ones of the same wheel, then those of other wheels.
    pub fn all(&self) -> impl Iterator<Item = &Contact> {
        std::iter::once(self).chain(&self.further)
    }

    /// Names of several contacts, in their order: their wheels, their places on the profile of a wheel, or the bodies
    /// around the lower one. Empty where there is one.
    pub(crate) fn names(&self) -> Vec<String> {
        if self.further.is_empty() {
            return Vec::new();
        }
        let name = |(number, one): (usize, &Self)| match one.name.as_ref().or(one.body.as_ref()) {
            Some(name) => name.clone(),
            None if !self.around.is_empty() => format!("body {}", number + 1),
            None => {
                let wheel = (self.wheels == ContactWheels::Both).then(|| match one.side() {
                    super::TrackSide::Left => "left-hand wheel".to_owned(),
                    super::TrackSide::Right => "right-hand wheel".to_owned(),
                });
                let place = one.placement.as_ref().and_then(|p| p.touch_near);
                let place = place.map(|y| format!("y = {:.2} mm of the wheel's profile", 1e3 * y));
                [wheel, place].into_iter().flatten().collect::<Vec<_>>().join(", ")
            }
        };
        self.all().enumerate().map(name).collect()
    }

    /// Place of a contact of a body around the lower one, in words.
    pub(crate) fn around_text(&self) -> String {
        let body = self.body.as_ref().map_or(String::new(), |name| format!("{name}, "));
        format!("{body}{} rad around the lower body", self.turned)
    }

    /// Side of the track of a contact with a placement; the left-hand one of others.
    pub fn side(&self) -> super::TrackSide {
        self.placement.as_ref().map_or(super::TrackSide::Left, |p| p.side)
    }

    /// Load that presses the bodies together. Reading a job makes sure that exactly one of the four keys is given.
    /// The part of a vertical load or of an axle load that this contact carries is known once the places are.
    pub fn load(&self) -> Load {
        match (self.normal_load, self.approach) {
            (Some(n), _) => Load::Normal(n),
            (None, Some(d)) => Load::Approach(d),
            (None, None) => Load::Normal(self.vertical_load.or(self.axle_load.map(|q| 0.5 * q)).unwrap_or(0.0)),
        }
    }
}

/// Load that presses the bodies together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Load {
    /// Given normal force, N.
    Normal(f64),
    /// Given rigid approach, m.
    Approach(f64),
}

/// Source of the compliance of the contact surface.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Compliance {
    /// From the finite-element bodies.
    #[default]
    Fe,
    /// Elastic half-spaces of the bodies' materials (Boussinesq and Cerruti) on the same grid; the bodies' shapes give
    /// the gap only.
    HalfSpace,
    /// The half-space near the contact, and beside it what the rest of the body adds, from its section or its finite
    /// elements.
    Hybrid,
}

impl Compliance {
    /// Returns whether it is that of the bodies, with their modes.
    pub fn of_bodies(self) -> bool {
        self != Compliance::HalfSpace
    }
}

/// Points at which the laws of contact hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quadrature {
    /// At the nodes of the grid: pressure is nodal force over nodal area.
    #[default]
    Nodal,
    /// At points of quadrature in the cells of the grid, with the consistent matrix of its bilinear shape functions:
    /// in steady rolling and in the transient.
    Consistent,
}

/// A rectilinear grid in the plane z = 0 about the contact point. What is not given follows from Hertz' ellipse.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommonGrid {
    /// Half-length along x, m; rounded up to whole spacings. Default: 1.7 times that of Hertz' ellipse.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub half_length: Option<f64>,
    /// Half-width along y, m; rounded up to whole spacings. Default: 1.7 times that of Hertz' ellipse.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub half_width: Option<f64>,
    /// Distance of the nodes, m. Default: a tenth of the smaller half axis of Hertz' ellipse, a fourteenth where the
    /// rigid slip of the spin at the edge is more than that of the other creepages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub spacing: Option<f64>,
    /// Curvatures of the gap along x and y, the sums of those of both bodies, 1/m: the gap is then that parabola, not
    /// that of the faces of the meshes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("unit" = "1/m"))]
    pub curvatures: Option<[f64; 2]>,
}

/// Half-lengths of the rectangle around the contact point on which contact is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Patch {
    /// Half-length along x, m; rounded up to whole elements.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub half_length: f64,
    /// Half-width along y, m; rounded up to whole elements.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub half_width: f64,
    /// Distance of the nodes of the contact grid between swept bodies, m; others have that of their elements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub spacing: Option<f64>,
}
