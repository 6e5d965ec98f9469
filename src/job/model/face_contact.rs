//! Contacts of a disc that turns with pads that do not, by their names.

use super::{Bodies, Body, Contact, ContactPoint, Creepage, Job, Rotation};
use crate::friction::FrictionLaw;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pad on a face of a disc: the disc turns about its axle, the pad does not, and all of it slides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaceContact {
    /// Name of the contact in messages and results.
    pub name: String,
    /// Names of the two bodies: the disc first, a body of revolution (`mesh.revolved`), then the pads, given by
    /// matrices or by a mesh (`mesh.file`).
    pub between: [String; 2],
    /// Group of the section of the disc that is the face, such as `side_plus`.
    pub face: String,
    /// Group of the mesh of the pads that lies on this face; for pads by a mesh alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pad_face: Option<String>,
    /// Normal force that presses the pad on the disc, N: that of the piston.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "N"))]
    pub normal_load: f64,
    /// Friction law: a number is Coulomb's coefficient, 0 frictionless.
    pub friction: FrictionLaw,
    /// Cells of the face.
    pub cells: Vec<ContactCell>,
}

/// A rectangle of the face of a disc that a pad presses evenly: a node of pads by matrices, the same rectangle of pads
/// by a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactCell {
    /// Distance of its middle from the axle, m.
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "m"))]
    pub radius: f64,
    /// Angle of its middle about the axle, rad, from x to y of the pads, whose z is the axle.
    #[schemars(extend("unit" = "rad"))]
    pub angle: f64,
    /// Half its sides along the circle and along the radius, m.
    #[schemars(inner(range(min = 0.0)), extend("unit" = "m"))]
    pub half: [f64; 2],
    /// Number of the node of the pad in the other program; for pads by matrices alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<i64>,
}

impl FaceContact {
    /// The contact as the analyses take it, on a disc with the angular velocity `speed`, rad/s.
    fn resolved(&self, speed: f64) -> Contact {
        let point = |cell: &ContactCell| ContactPoint {
            direction: vec![1f64.copysign(speed)],
            gap: 0.0,
            force: None,
            slip_velocity: Some(speed.abs() * cell.radius),
        };
        Contact {
            friction: self.friction.clone(),
            own_friction: Some(self.friction.clone()),
            normal_load: Some(self.normal_load),
            points: Some(self.cells.iter().map(point).collect()),
            name: Some(self.name.clone()),
            friction_zones: Vec::new(),
            approach: None,
            vertical_load: None,
            axle_load: None,
            roll_moment: 0.0,
            lateral_force: None,
            torque: None,
            places: Default::default(),
            wheels: Default::default(),
            around: Vec::new(),
            speed: 0.0,
            creepage: Creepage::default(),
            compliance: Default::default(),
            quadrature: Default::default(),
            patch: None,
            grid: None,
            placement: None,
            from: None,
            in_equilibrium: false,
            further: Vec::new(),
            turned: 0.0,
            body: None,
            angle: 0.0,
            touch_angle: 0.0,
            roughness: None,
        }
    }
}

impl Bodies {
    /// Moves the named bodies `names` to the places below and above the contact.
    fn place(&mut self, names: [&String; 2]) {
        let [lower, upper] = names.map(|name| self.named.remove(name));
        (self.lower, self.upper) = (lower, upper);
        self.names = Some(names.map(String::clone));
    }

    /// The bodies by the names that the job gives them.
    pub(super) fn by_their_names(&mut self) {
        if let Some([lower, upper]) = self.names.take() {
            let places = [(lower, self.lower.take()), (upper, self.upper.take())];
            self.named.extend(places.into_iter().filter_map(|(name, body)| Some((name, body?))));
        }
    }

    /// The name that the job gives the body with the key `key` below `bodies`.
    pub fn name_of<'n>(&'n self, key: &'n str) -> &'n str {
        match (&self.names, key) {
            (Some([disc, _]), "lower") => disc,
            (Some([_, pads]), "upper") => pads,
            _ => key,
        }
    }

    /// A message with the names that the job gives its bodies in the place of their places.
    pub(crate) fn with_names(&self, text: String) -> String {
        match &self.names {
            None => text,
            Some([lower, upper]) => text
                .replace("bodies.lower", &format!("bodies.{lower}"))
                .replace("bodies.upper", &format!("bodies.{upper}")),
        }
    }

    /// Faults of bodies with names of their own in a job without `contacts`.
    pub(in crate::job) fn unnamed(&self) -> Vec<String> {
        let known = ["lower", "upper", "others"].map(String::from);
        let fault = |name: &String| {
            let text = crate::job::schema::unknown_key(&format!("bodies.{name}"), name, &known);
            format!("{text}; bodies with names of their own are joined by contacts")
        };
        self.named.keys().map(fault).collect()
    }
}

impl Job {
    /// Puts the bodies that `contacts` names in their places and makes their contact; the faults of a job that has not
    /// what it takes.
    pub(in crate::job) fn resolve_named(&mut self) -> Vec<String> {
        let Some(first) = self.contacts.first() else { return self.bodies.unnamed() };
        let [disc, pads] = &first.between;
        let faults = self.faults_of_names([disc, pads]);
        if !faults.is_empty() {
            return faults;
        }
        let speed = match self.bodies.named.get(disc).and_then(|body| body.rotation) {
            Some(Rotation::Speed(speed)) => speed,
            _ => 0.0,
        };
        let mut all = self.contacts.iter().map(|contact| contact.resolved(speed));
        let contact = all.next().map(|one| Contact { further: all.collect(), ..one });
        let names = [disc.clone(), pads.clone()];
        self.bodies.place([&names[0], &names[1]]);
        self.contact = contact;
        Vec::new()
    }

    /// Faults of the names of bodies and contacts, and of the keys that `contacts` takes the place of.
    fn faults_of_names(&self, [disc, pads]: [&String; 2]) -> Vec<String> {
        let mut faults = Vec::new();
        let beside = [
            ("contact", self.contact.is_some()),
            ("curve", self.curve.is_some()),
            ("vehicle", self.vehicle.is_some()),
            ("bodies.lower", self.bodies.lower.is_some()),
            ("bodies.upper", self.bodies.upper.is_some()),
            ("bodies.others", !self.bodies.others.is_empty()),
        ];
        faults.extend(beside.into_iter().filter(|(_, is)| *is).map(|(key, _)| {
            format!(
                "{key}: given beside contacts, which joins bodies by names of their own, as bodies.{disc}; leave one \
                 of the two out"
            )
        }));
        for (i, contact) in self.contacts.iter().enumerate() {
            if contact.name.trim().is_empty() {
                faults.push(format!("contacts.{i}.name: the name is empty"));
            }
            if self.contacts[..i].iter().any(|other| other.name == contact.name) {
                faults.push(format!("contacts.{i}.name: \"{}\" is given twice; give each its own", contact.name));
            }
            if contact.between != [disc.clone(), pads.clone()] {
                faults.push(format!(
                    "contacts.{i}.between: found {:?}, expected {:?} as in contacts.0: one disc and one body of pads; \
                     several pads may be one body, whose matrices or mesh have them all",
                    contact.between,
                    [disc, pads]
                ));
            }
        }
        if disc == pads {
            faults.push(format!("contacts.0.between: found \"{disc}\" twice, expected two bodies"));
        }
        for name in [disc, pads].into_iter().filter(|name| !self.bodies.named.contains_key(*name)) {
            let there: Vec<String> = self.bodies.named.keys().cloned().collect();
            faults.push(format!(
                "contacts.0.between: the job has no body \"{name}\"; its bodies are {}",
                crate::job::schema::quoted(&there)
            ));
        }
        let allowed = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        for name in self.bodies.named.keys().filter(|name| name.is_empty() || !name.chars().all(allowed)) {
            faults.push(format!("bodies.{name:?}: expected a name of letters, digits, hyphens and underscores"));
        }
        for name in self.bodies.named.keys().filter(|name| ![disc, pads].contains(name)) {
            faults.push(format!("bodies.{name}: no contact names it; leave it out"));
        }
        let by_matrices =
            |name: &String| self.bodies.named.get(name).is_some_and(|body: &Body| body.matrices.is_some());
        if by_matrices(disc) && !by_matrices(pads) {
            faults.push(format!(
                "contacts.0.between: found \"{disc}\" first, which is given by matrices; expected the disc first, then \
                 the pads"
            ));
        }
        faults
    }

    /// Returns whether the job is one of a disc that turns between pads.
    pub fn is_disc_with_pads(&self) -> bool {
        !self.contacts.is_empty()
    }
}
