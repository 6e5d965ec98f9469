//! Keys of `analyses.cycles`, and the job at other values of the key that a branch follows.

use super::cycles::Cycles;
use super::from_json;
use super::model::{Bodies, Body, Contact, Creepage, Job};
use super::overrides::put;
use super::transient::SoundPower;
use super::validate::validate;
use crate::friction::TrackFriction;
use crate::{Error, Result};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Number, Value};
use std::path::PathBuf;

/// Branches of limit cycles over a key: stable and unstable cycles, their multipliers, folds and thresholds. The first
/// cycles are those of the unstable modes at the value of the job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Branches {
    /// The key that the branches go along: a number of the contact, e.g. `contact.friction` or
    /// `contact.creepage.lateral`, of the damping of a body, e.g. `bodies.upper.damping.modal.by_diameter.2`, or
    /// `curve.radius`; its value in the job is where they begin, unless `starts` says otherwise.
    pub along: String,
    /// Least value of the key, in its unit.
    #[schemars(extend("unit" = "1"))]
    pub from: f64,
    /// Largest value of the key, in its unit.
    #[schemars(extend("unit" = "1"))]
    pub to: f64,
    /// Cycles in each direction, at the most.
    #[serde(default = "default_most")]
    #[schemars(range(min = 1, max = 10_000))]
    pub most: u32,
    /// Harmonics of the motion at the contact that are unknowns; the forces have all.
    #[serde(default = "default_harmonics")]
    #[schemars(range(min = 1, max = 64))]
    pub harmonics: u32,
    /// Time steps of a period.
    #[serde(default = "default_samples")]
    #[schemars(range(min = 32, max = 10_000))]
    pub samples: u32,
    /// Longest step along the branch, of the motion of the first cycle.
    #[serde(default = "default_length")]
    #[schemars(extend("exclusiveMinimum" = 0, "unit" = "1"), range(max = 1.0))]
    pub longest: f64,
    /// Computes the Floquet multipliers of each cycle.
    #[serde(default = "default_stability")]
    pub stability: bool,
    /// One cycle of so many of a branch has its period in the result, as special points have: forces and states of the
    /// contact nodes, and with `output.fields` the motion of the bodies for ParaView. Default: special points alone,
    /// without motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10_000))]
    pub every: Option<u32>,
    /// Cycles that branches begin with.
    #[serde(default)]
    pub starts: Starts,
    /// Sound power of each cycle, in third octaves; `from` is not given here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sound_power: Option<SoundPower>,
    /// How the first cycles are marched: `duration`, `settled`, `amplitude`, `step`, `tolerance` and `hold` as in
    /// `sweep.cycles`.
    #[serde(default = "default_march")]
    pub march: Cycles,
}

/// Cycles that branches begin with.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Starts {
    /// Values of the key at which unstable modes are looked for. Default: that of the job.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("unit" = "1"))]
    pub at: Vec<f64>,
    /// Number of unstable modes, from the most unstable one, whose cycles are looked for at each value; 0 for none.
    /// Default: every one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modes: Option<u32>,
    /// How the cycle of an unstable mode is found.
    #[serde(default)]
    pub by: StartsBy,
    /// Begins at the thresholds of rest too, with small cycles along the mode that neither grows nor decays there.
    #[serde(default)]
    pub thresholds: bool,
    /// Cycles of earlier results of `analyses.cycles` or `analyses.sweep.cycles` along the same key on the same contact
    /// grid.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub results: Vec<EarlierResult>,
}

/// How the cycle of an unstable mode is found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StartsBy {
    /// Motions along the mode of growing amplitude, to the one that no longer grows; marched where they lead to none.
    #[default]
    Amplitude,
    /// A march from a small motion along the mode, as `march` says, to the cycle that it settles on.
    March,
}

/// A cycle of an earlier result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EarlierResult {
    /// The result file.
    pub file: PathBuf,
    /// Place of the cycle in the rows of `/cycles`, from 0. Of a sweep the number of the point, those of further
    /// branches behind those of the first.
    pub cycle: u32,
}

fn default_most() -> u32 {
    60
}

fn default_harmonics() -> u32 {
    6
}

fn default_samples() -> u32 {
    240
}

fn default_length() -> f64 {
    0.15
}

fn default_stability() -> bool {
    true
}

fn default_march() -> Cycles {
    Cycles::default()
}

impl Job {
    /// The value of a key that a branch may go along, `contact.…`, `bodies.<body>.damping.…` or `curve.radius`; none
    /// where it is not there or is no number.
    pub(crate) fn branch_number(&self, key: &str) -> Option<f64> {
        if key == RADIUS {
            return self.curve.as_ref().map(|c| c.radius);
        }
        let (part, path) = match key.strip_prefix("contact.") {
            Some(path) => (serde_json::to_value(self.contact.as_ref()?), path),
            None => {
                let (upper, path) = damping_key(key)?;
                let body = if upper { &self.bodies.upper } else { &self.bodies.lower };
                (serde_json::to_value(&body.as_ref()?.damping), path)
            }
        };
        let pointer: String = path.split('.').map(|s| format!("/{s}")).collect();
        part.ok()?.pointer(&pointer).and_then(Value::as_f64)
    }

    /// True if modes of the reduced model change their damping or rotation along a branch over `key`.
    pub(crate) fn modes_change_along(&self, key: &str) -> bool {
        damping_key(key).is_some() || (key == SPEED && self.turns())
    }

    fn turns(&self) -> bool {
        self.bodies().iter().any(|(name, _)| self.angular_velocity(name) != 0.0)
    }

    /// The job with another value of a key of the contact or of the damping of a body, checked like any other job.
    pub(crate) fn with_branch_number(&self, key: &str, value: f64) -> Result<Self> {
        let refused = |why: String| Error::Job(format!("analyses.cycles, at {key} = {value}: {why}"));
        let number = serde_json::Number::from_f64(value).ok_or_else(|| refused("expected a finite number".into()))?;
        let mut job = self.clone();
        if let Some(path) = key.strip_prefix("contact.") {
            let own = job.contact.as_mut().ok_or_else(|| refused("expected a contact".into()))?;
            let mut contact = with_number(own, path, number).map_err(refused)?;
            // What is not in a job file goes with it.
            contact.in_equilibrium = own.in_equilibrium;
            let TrackFriction { elsewhere, zones } = contact.track_friction();
            let further = own.further.iter().map(|c| Contact {
                friction: elsewhere.clone(),
                friction_zones: zones.clone(),
                ..c.clone()
            });
            contact.further = further.collect();
            (contact.angle, contact.touch_angle) = (own.angle, own.touch_angle);
            contact.make_around();
            *own = contact;
        } else {
            let Bodies { lower, upper, .. } = &mut job.bodies;
            let found = damping_key(key).and_then(|(is_upper, path)| {
                let body = if is_upper { upper } else { lower };
                Some((&mut body.as_mut()?.damping, path))
            });
            let (damping, path) = found.ok_or_else(|| refused("expected a key of contact or of a damping".into()))?;
            *damping = with_number(damping, path, number).map_err(refused)?;
        }
        let mut given = job.clone();
        // The range is that of the branch: a step that leaves it is no fault of the job.
        given.analyses.cycles = None;
        // Creepages that follow from a placement are in the job by now, and are no fault of it either.
        if let Some(contact) = given.contact.as_mut().filter(|c| c.placement.is_some()) {
            contact.creepage = Creepage::default();
            contact.further.clear();
            // So are the places that all contacts of a wheel or of both wheels have been found at.
            contact.remove_places();
            if contact.in_equilibrium {
                contact.placement.iter_mut().for_each(|placement| placement.touch_near = None);
            }
        }
        match validate(&given).into_iter().next() {
            Some(fault) => Err(refused(fault)),
            None => Ok(job),
        }
    }
}

/// `part` of a job with another number at `path` in it; an error in words.
fn with_number<T>(part: &T, path: &str, number: Number) -> std::result::Result<T, String>
where
    T: Serialize + DeserializeOwned,
{
    let mut json = serde_json::to_value(part).map_err(|e| e.to_string())?;
    let path: Vec<&str> = path.split('.').collect();
    put(&mut json, &path, Value::Number(number), "analyses.cycles.along").map_err(|e| e.to_string())?;
    from_json(&json).map_err(|e| e.to_string())
}

/// Parts of a key of the damping of a body: true for the upper body, and the rest of the key.
fn damping_key(key: &str) -> Option<(bool, &str)> {
    let of = |prefix, upper| key.strip_prefix(prefix).map(|path| (upper, path));
    of("bodies.lower.damping.", false).or_else(|| of("bodies.upper.damping.", true))
}

/// The radius of the curve: contacts are those of the equilibrium of the vehicle.
pub const RADIUS: &str = "curve.radius";

/// Rolling speed.
const SPEED: &str = "contact.speed";

/// Keys that may change along a branch, beside those of damping and of friction.
const KEYS: [&str; 5] = ["contact.creepage.", "contact.normal_load", "contact.approach", SPEED, RADIUS];

/// True for a number of a friction law: that of the contact, of a zone of the rails, or of a body around the lower one.
fn is_friction(key: &str) -> bool {
    let path: Vec<&str> = key.split('.').collect();
    matches!(&path[..], ["contact", "friction", ..] | ["contact", "friction_zones" | "around", _, "friction", ..])
}

/// Likeness of a misspelt key to one of the job, from 0 to 1, above which that one is meant.
const ALIKE: f64 = 0.8;

/// True if `key` is `parent` or lies in it.
fn is_within(key: &str, parent: &str) -> bool {
    key == parent || key.strip_prefix(parent).is_some_and(|rest| parent.ends_with('.') || rest.starts_with('.'))
}

/// Question after the key of the job nearest to `key` that a branch may go along; nothing where none is like it.
fn meant(job: &Job, key: &str) -> String {
    let mut keys = Vec::new();
    if let Some(Ok(contact)) = job.contact.as_ref().map(serde_json::to_value) {
        number_keys(&contact, "contact", &mut keys);
        keys.retain(|k| is_friction(k) || KEYS.iter().any(|parent| is_within(k, parent)));
    }
    for (name, body) in job.bodies() {
        if let Ok(damping) = serde_json::to_value(&body.damping) {
            number_keys(&damping, &format!("bodies.{name}.damping"), &mut keys);
        }
    }
    keys.extend(job.curve.as_ref().map(|_| RADIUS.to_string()));
    // Long keys that begin alike are no more alike for it: the word counts, and few letters.
    let word = |k: &str| k.rsplit('.').next().map(str::to_string);
    let like = |k: &String| match word(k) == word(key) {
        true => 1.0,
        false => strsim::normalized_damerau_levenshtein(key, k),
    };
    let near = keys.iter().map(|k| (like(k), k)).filter(|k| k.0 > ALIKE).max_by(|a, b| a.0.total_cmp(&b.0));
    near.map_or_else(String::new, |(_, near)| format!("; did you mean \"{near}\"?"))
}

/// Adds the keys of all numbers in `value`, which has the key `key`.
fn number_keys(value: &Value, key: &str, keys: &mut Vec<String>) {
    match value {
        Value::Number(_) => keys.push(key.into()),
        Value::Object(all) => all.iter().for_each(|(k, v)| number_keys(v, &format!("{key}.{k}"), keys)),
        Value::Array(all) => all.iter().enumerate().for_each(|(k, v)| number_keys(v, &format!("{key}.{k}"), keys)),
        _ => {}
    }
}

/// The faults of `analyses.cycles`.
pub(super) fn faults(job: &Job, wanted: &Branches) -> Vec<String> {
    let mut faults = Vec::new();
    let path = "analyses.cycles";
    if job.analyses.stability.is_none() {
        faults.push(format!("analyses.stability: missing; {path} begins at its unstable mode, e.g. {{}}"));
    }
    let key = &wanted.along;
    let fits = |k: &str| is_within(key, k);
    let damping = damping_key(key);
    if !is_friction(key) && !KEYS.iter().any(|k| fits(k)) && damping.is_none() {
        faults.push(format!(
            "{path}.along: found \"{key}\", expected a key that keeps modes and mesh: of contact friction, that of a \
             friction zone or of around, or a number of such a law, creepage.longitudinal, creepage.lateral, \
             creepage.spin, normal_load, approach or speed; a number of bodies.lower.damping or bodies.upper.damping; \
             or curve.radius{}",
            meant(job, key)
        ));
        return faults;
    }
    let body = damping.and_then(|(upper, _)| if upper { job.bodies.upper.as_ref() } else { job.bodies.lower.as_ref() });
    if body.is_some_and(Body::is_half_space) {
        faults.push(format!("{path}.along: found \"{key}\", expected the damping of a body with modes"));
    }
    match job.branch_number(key) {
        None => faults.push(format!(
            "{path}.along: found \"{key}\", expected a key that the job gives a number for{}",
            meant(job, key)
        )),
        Some(here) if !(wanted.from <= here && here <= wanted.to && wanted.from < wanted.to) => faults.push(format!(
            "{path}.from, to: found {} to {}, expected a range around the job's own {key} = {here}",
            wanted.from, wanted.to
        )),
        Some(_) => {}
    }
    if wanted.samples < 8 * wanted.harmonics {
        faults.push(format!(
            "{path}.samples: found {}, expected at least eight for each of the {} harmonics",
            wanted.samples, wanted.harmonics
        ));
    }
    let Some(contact) = &job.contact else { return faults };
    if key == RADIUS && contact.from.is_none() {
        faults.push(format!(
            "{path}.along: found \"{key}\", expected a contact of a wheel of the vehicle (contact.from)"
        ));
    }
    if key == RADIUS && !(wanted.from > 0.0) {
        faults.push(format!("{path}.from: found {} m, expected a radius above 0", wanted.from));
    }
    let kept = key == RADIUS || damping.is_some() || is_friction(key);
    if contact.placement.is_some() && !kept {
        faults.push(format!(
            "{path}.along: found \"{key}\", which follows from contact.placement here; follow contact.friction, with \
             curve and vehicle curve.radius, or give load and creepages"
        ));
    }
    if contact.roughness.is_some() {
        faults.push(format!("{path}: found contact.roughness, under which no motion repeats itself; leave out one"));
    }
    if contact.points.is_some() {
        faults.push(format!(
            "{path}: found contact.points, expected a contact on a grid, which has a compliance of its own beside the \
             modes; sweep.cycles marches cycles of points"
        ));
    }
    if wanted.march.theta != 0.5 {
        faults.push(format!(
            "{path}.march.theta: found {}, expected 0.5: cycles that are solved for know no damping of the scheme",
            wanted.march.theta
        ));
    }
    if wanted.march.sound_power.is_some() {
        faults.push(format!("{path}.march.sound_power: found, expected none; give {path}.sound_power"));
    }
    if wanted.sound_power.as_ref().is_some_and(|s| s.from.is_some()) {
        faults.push(format!("{path}.sound_power.from: found, expected none: the sound is that of a period"));
    }
    let outside = wanted.starts.at.iter().find(|&&key| !(wanted.from <= key && key <= wanted.to));
    if let Some(outside) = outside {
        faults.push(format!(
            "{path}.starts.at: found {outside}, expected values in the range from {} to {}",
            wanted.from, wanted.to
        ));
    }
    let starts = &wanted.starts;
    if starts.modes == Some(0) && !starts.thresholds && starts.results.is_empty() {
        faults.push(format!("{path}.starts.modes: found 0, expected at least one start: modes, thresholds or results"));
    }
    faults
}

/// The unit of a key, as the schema has it; "-" where it has none.
pub(crate) fn key_unit(key: &str) -> String {
    super::schema::Checker::default().unit_at(&key.split('.').collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::super::example::wheel_on_rail;
    use super::super::model::{Contact, Job, TrackSide};
    use super::is_friction;
    use std::path::Path;

    /// A wheel on a placement has creepages that follow from it once it runs; friction can change all the same.
    #[test]
    fn friction_changes_on_a_placement_whose_creepages_are_known() {
        let mut job = wheel_on_rail(&[]);
        if let Some(contact) = &mut job.contact {
            contact.creepage.lateral = -0.01;
        }
        let other = job.with_branch_number("contact.friction", 0.4).unwrap();
        let numbers = ["contact.friction", "contact.creepage.lateral"].map(|key| other.branch_number(key));
        assert_eq!(numbers, [Some(0.4), Some(-0.01)]);
    }

    /// All contacts of a wheel keep the places that the equilibrium has found for them, and so do those of both wheels.
    #[test]
    fn friction_changes_at_all_places_that_were_found() {
        let jobs: [&[u8]; 2] =
            [include_bytes!("../../jobs/flange.json"), include_bytes!("../../jobs/wheelset-both-wheels.json")];
        for bytes in jobs {
            let mut job = Job::from_bytes(bytes, Path::new("job.json"), &[], None).unwrap();
            let contact = job.contact.as_mut().unwrap();
            contact.in_equilibrium = true;
            contact.placement.as_mut().unwrap().touch_near = Some(0.014);
            contact.further = vec![contact.clone()];
            let other = job.with_branch_number("contact.friction", 0.4).unwrap();
            let contact = other.contact.as_ref().unwrap();
            assert_eq!(contact.placement.as_ref().unwrap().touch_near, Some(0.014));
            assert_eq!((contact.further.len(), other.branch_number("contact.friction")), (1, Some(0.4)));
        }
    }

    /// The friction of a zone changes at all contacts, which keep their places.
    #[test]
    fn friction_of_a_zone_changes_at_the_contact_in_it() {
        let zones = r#"contact.friction_zones=[{"from_angle": 0.5, "friction": 0.1}]"#;
        let mut job = wheel_on_rail(&[zones]);
        let contact = job.contact.as_mut().unwrap();
        let steep = if contact.side() == TrackSide::Right { -1.2 } else { 1.2 };
        contact.further = vec![Contact { touch_angle: steep, ..contact.clone() }];
        let laws = |job: &Job| -> Vec<f64> {
            job.contact.iter().flat_map(Contact::all).map(|one| one.law().coefficient(0.0)).collect()
        };
        let here = laws(&job);
        assert!(here[1] == 0.1 && here[0] > 0.1, "{here:?}");
        let other = job.with_branch_number("contact.friction_zones.0.friction", 0.2).unwrap();
        assert_eq!(laws(&other), [here[0], 0.2]);
        let other = job.with_branch_number("contact.friction", 0.25).unwrap();
        assert_eq!(laws(&other), [0.25, 0.1]);
        assert_eq!(laws(&Job { contact: Some(job.contact.unwrap().with_friction_scaled(2.0)), ..other })[1], 0.2);
        let found = ["from_angle", "friction", "friction.exponential.static"]
            .map(|key| is_friction(&format!("contact.friction_zones.0.{key}")));
        assert_eq!(found, [false, true, true]);
    }
}
