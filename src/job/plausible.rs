//! Values that the program takes but that were probably meant otherwise: another unit, per cent, a diameter.
//!
//! A key has a line in `USUAL`: its dotted path in the resolved job (`*` stands for any one segment, also an index),
//! what it is, the magnitudes that are usual, and the units in which it is often given by mistake. Everything found is
//! a warning and never an error; where a run ends with an error these warnings come with it, since they may be the
//! reason.

use super::contact_frames::contact_frames;
use super::model::*;
use super::schema::Checker;
use serde_json::Value;

/// Jobs to which a line of the table applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scope {
    /// In every job.
    Everywhere,
    /// In jobs with a wheel on a rail (`contact.placement`) or with a rail on its track.
    OnRail,
    /// In all others.
    CachedModes,
}
use Scope::{CachedModes, Everywhere, OnRail};

/// A unit in which a value may have been given instead, and the value in the unit of the job.
type Unit = (&'static str, fn(f64) -> f64);

/// Usual range of a key.
struct Usual {
    key: &'static str,
    scope: Scope,
    /// Name of the value, as the subject of a sentence.
    what: &'static str,
    /// Smallest and largest usual magnitude; 0 is always usual.
    range: [f64; 2],
    /// Units that may have been meant, the most likely one first.
    meant: &'static [Unit],
}

const fn usual(key: &'static str, scope: Scope, what: &'static str, range: [f64; 2], meant: &'static [Unit]) -> Usual {
    Usual { key, scope, what, range, meant }
}

const MM: Unit = ("mm", |v| 1e-3 * v);
const CM: Unit = ("cm", |v| 1e-2 * v);
const UM: Unit = ("µm", |v| 1e-6 * v);
const KM_H: Unit = ("km/h", |v| v / 3.6);
const DEGREES: Unit = ("degrees", f64::to_radians);
const MRAD: Unit = ("mrad", |v| 1e-3 * v);
const PER_CENT: Unit = ("%", |v| 1e-2 * v);
const RADIUS: &[Unit] = &[MM, CM, ("m of diameter", |v| 0.5 * v), ("mm of diameter", |v| 5e-4 * v)];
const FORCE: &[Unit] = &[("kN", |v| 1e3 * v), ("MN", |v| 1e6 * v)];
const ELASTIC: &[Unit] = &[("GPa", |v| 1e9 * v), ("MPa", |v| 1e6 * v), ("kPa", |v| 1e3 * v)];
const DENSITY: &[Unit] =
    &[("t/m³ (g/cm³)", |v| 1e3 * v), ("kg/mm³", |v| 1e9 * v), ("t/mm³", |v| 1e12 * v), ("g/m³", |v| 1e-3 * v)];
const STIFFNESS: &[Unit] = &[("MN/m (kN/mm)", |v| 1e6 * v), ("kN/m (N/mm)", |v| 1e3 * v)];
const ANGLE: &[Unit] = &[DEGREES, MRAD];
const SLOPE: &[Unit] = &[("the N of 1:N", |v| 1.0 / v), DEGREES];
const LENGTH: &[Unit] = &[MM, CM];
const KHZ: Unit = ("kHz", |v| 1e3 * v);
const GRAM: Unit = ("g", |v| 1e-3 * v);

/// The usual magnitudes, a line a key. A key of a job has one line for each scope at most.
const USUAL: &[Usual] = &[
    usual("contact.normal_load", OnRail, "the load of a wheel", [1e3, 3e5], FORCE),
    usual("contact.axle_load", OnRail, "the load of an axle", [2e3, 6e5], FORCE),
    usual("contact.approach", OnRail, "the approach of a wheel to its rail", [1e-7, 1e-3], &[UM, MM]),
    usual("contact.speed", OnRail, "the speed of a train", [0.01, 100.0], &[KM_H]),
    usual("contact.placement.speed", OnRail, "the speed of a train", [0.01, 100.0], &[KM_H]),
    usual("contact.friction", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.friction.*.static", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.friction.*.kinetic", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.friction.table.points.*.1", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.friction_zones.*.friction", OnRail, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.friction_zones.*.from_angle", OnRail, "a contact angle", [0.0, 1.5], &[DEGREES]),
    usual("contact.around.*.friction", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.friction_zones.*.friction.*.static", OnRail, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.friction_zones.*.friction.*.kinetic", OnRail, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual(
        "contact.friction_zones.*.friction.table.points.*.1",
        OnRail,
        "a coefficient of friction",
        [0.0, 1.0],
        &[PER_CENT],
    ),
    usual("contact.around.*.friction.*.static", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.around.*.friction.*.kinetic", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual(
        "contact.around.*.friction.table.points.*.1",
        Everywhere,
        "a coefficient of friction",
        [0.0, 1.0],
        &[PER_CENT],
    ),
    usual("contacts.*.friction", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contacts.*.friction.*.static", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contacts.*.friction.*.kinetic", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contacts.*.friction.table.points.*.1", Everywhere, "a coefficient of friction", [0.0, 1.0], &[PER_CENT]),
    usual("contact.creepage.longitudinal", Everywhere, "a creepage", [0.0, 0.1], &[PER_CENT]),
    usual("contact.creepage.lateral", Everywhere, "a creepage", [0.0, 0.1], &[PER_CENT]),
    usual("contact.placement.creepage.longitudinal", OnRail, "a creepage", [0.0, 0.1], &[PER_CENT]),
    usual("contact.placement.creepage.lateral", OnRail, "a creepage", [0.0, 0.1], &[PER_CENT]),
    usual("contact.placement.radius", OnRail, "the radius of a wheel", [0.1, 0.75], RADIUS),
    usual("contact.placement.gauge", OnRail, "a gauge", [0.3, 2.0], LENGTH),
    usual("contact.placement.gauge_depth", OnRail, "the depth at which the gauge is taken", [1e-3, 0.05], LENGTH),
    usual("contact.placement.circles", OnRail, "the distance of the running circles", [0.3, 2.2], LENGTH),
    usual("contact.placement.cant", OnRail, "the inclination of a rail (1:40 is 0.025)", [0.0, 0.11], SLOPE),
    usual("contact.placement.lateral", OnRail, "the shift of a wheelset", [0.0, 0.08], LENGTH),
    usual("contact.placement.yaw", OnRail, "the yaw of a wheelset", [0.0, STEERED], ANGLE),
    usual("contact.placement.roll", OnRail, "the roll of a wheelset", [0.0, 0.06], ANGLE),
    usual("contact.placement.contact.wheel", OnRail, "a place on a profile", [0.0, 0.1], LENGTH),
    usual("contact.placement.contact.rail", OnRail, "a place on a profile", [0.0, 0.1], LENGTH),
    usual("bodies.*.material.young", OnRail, "the modulus of a metal", [1e10, 1e12], ELASTIC),
    usual("bodies.*.material.young", CachedModes, "the modulus of a solid", [1e5, 1.5e12], ELASTIC),
    usual("bodies.*.material.density", OnRail, "the density of a metal", [1e3, 2.5e4], DENSITY),
    usual("bodies.*.material.density", CachedModes, "the density of a solid", [10.0, 2.5e4], DENSITY),
    usual("bodies.*.axle_distance", Everywhere, "the radius of a wheel", [1e-3, 5.0], LENGTH),
    usual("bodies.*.mesh.cylinder.outer_radius", Everywhere, "the radius of a cylinder", [1e-4, 10.0], LENGTH),
    usual("bodies.*.mesh.cylinder.thickness", Everywhere, "the width of a cylinder", [1e-4, 10.0], LENGTH),
    usual("bodies.*.mesh.revolved.section.file.radius", OnRail, "the radius of a wheel", [0.1, 0.75], RADIUS),
    usual("bodies.*.mesh.extruded.length", OnRail, "the length of rail that is modelled", [1.0, 200.0], LENGTH),
    usual("bodies.*.track.spacing", OnRail, "the distance of sleepers", [0.2, 2.0], LENGTH),
    usual("bodies.*.track.pad.vertical", OnRail, "the stiffness of a pad", [1e6, 1e10], STIFFNESS),
    usual("bodies.*.track.pad.lateral", OnRail, "the stiffness of a pad", [1e5, 1e10], STIFFNESS),
    usual("bodies.*.track.sleeper.ballast.vertical", OnRail, "the stiffness of ballast", [1e6, 1e10], STIFFNESS),
    usual("bodies.*.track.sleeper.both_rails.length", OnRail, "the length of a sleeper", [0.8, 5.0], LENGTH),
    usual("bodies.*.track.sleeper.both_rails.rail_distance", OnRail, "the distance of the rails", [0.35, 2.1], LENGTH),
    usual("bodies.*.track.sleeper.mass", OnRail, "half the mass of a sleeper", [10.0, 1000.0], &[("t", |v| 1e3 * v)]),
    usual("bodies.*.track.loss_factor", OnRail, "a loss factor", [0.0, 1.0], &[PER_CENT]),
    usual("bodies.*.track.pad.loss_factor", OnRail, "a loss factor", [0.0, 2.0], &[PER_CENT]),
    usual("bodies.*.absorbers.*.mass", Everywhere, "the mass of all absorbers of a wheel", [0.1, 200.0], &[GRAM]),
    usual("bodies.*.absorbers.*.frequency", Everywhere, "the tuning of an absorber", [20.0, 2e4], &[KHZ]),
    usual("bodies.*.absorbers.*.loss_factor", Everywhere, "a loss factor", [0.0, 2.0], &[PER_CENT]),
    usual("bodies.*.absorbers.*.place.radius", Everywhere, "a place on a wheel", [0.02, 1.0], LENGTH),
    usual("bodies.*.absorbers.*.place.y", Everywhere, "a place on a wheel", [0.0, 0.5], LENGTH),
    usual("bodies.*.ring_dampers.*.diameter", Everywhere, "the diameter of a wire", [2e-3, 0.05], LENGTH),
    usual("bodies.*.ring_dampers.*.frequency", Everywhere, "the frequency of a ring damper", [20.0, 2e4], &[KHZ]),
    usual("bodies.*.ring_dampers.*.loss_factor", Everywhere, "a loss factor", [0.0, 2.0], &[PER_CENT]),
    usual("bodies.*.ring_dampers.*.place.radius", Everywhere, "a place on a wheel", [0.02, 1.0], LENGTH),
    usual("bodies.*.damping.modal.by_mode.*", Everywhere, "a loss factor", [0.0, 1.0], &[PER_CENT]),
    usual("bodies.*.damping.modal.by_diameter.*", Everywhere, "a loss factor", [0.0, 1.0], &[PER_CENT]),
    usual("bodies.*.damping.modal.by_frequency.*.loss_factor", Everywhere, "a loss factor", [0.0, 1.0], &[PER_CENT]),
];

/// Lateral acceleration, m/s², above which no train runs through a curve: 1 m/s² that passengers feel, 1.5 m/s² of
/// cant, and a margin.
const LATERAL: f64 = 3.0;
/// Radius of a curve times the yaw of a leading wheelset in it, m: about a wheelbase.
const WHEELBASE: f64 = 3.0;
/// Smallest yaw, rad, that is taken for that of a curve.
const CURVED: f64 = 1e-3;
/// Largest usual yaw of a wheelset, rad.
const STEERED: f64 = 0.1;
/// Modes of a rail reach this many times as far as the frequencies that are asked about:
/// `docs/examples/wheel-on-rail.md`, "Modes to keep".
const REACH: f64 = 2.0;
/// They reach as far as this, Hz, where the job does not say about which frequencies it asks.
const SQUEAL: f64 = 2000.0;

/// Warnings of implausible values, one each.
pub fn plausible(job: &Job) -> Vec<String> {
    let checker = Checker::default();
    let resolved = job.to_json();
    let rail = job.placement().is_some() || job.bodies().iter().any(|(_, b)| b.track.is_some());
    let mut found = Vec::new();
    for line in USUAL.iter().filter(|line| line.scope == Everywhere || (line.scope == OnRail) == rail) {
        for pattern in line.patterns() {
            let mut places = Vec::new();
            numbers(&resolved, &pattern, &mut Vec::new(), &mut places);
            found.extend(places.iter().filter_map(|(path, value)| line.remark(&path.join("."), *value, &checker)));
            found.extend(line.remark_of_sweep(job, &pattern, &checker));
        }
    }
    found.extend(fast_in_a_curve(job).filter(|_| resolved.get("curve").is_none()));
    found.extend(few_modes(job).filter(|_| rail));
    found.extend(tuned_beyond_modes(job));
    found.extend(contact_frames(job));
    found
}

/// Remarks on absorbers and ring dampers that are tuned to frequencies without modes.
fn tuned_beyond_modes(job: &Job) -> Vec<String> {
    let Some(end) = job.analyses.modes.as_ref().and_then(|m| m.max_frequency) else { return Vec::new() };
    let of = |(name, body): (String, &Body)| {
        let absorbers = body.absorbers.iter().enumerate().map(|(i, a)| (format!("absorbers.{i}"), a.frequency));
        let rings = body.ring_dampers.iter().enumerate().map(|(i, r)| (format!("ring_dampers.{i}"), r.frequency));
        let beyond = absorbers.chain(rings).filter(|(_, frequency)| *frequency > end);
        let remark = |(key, frequency): (String, f64)| {
            format!(
                "bodies.{name}.{key}.frequency: found {frequency} Hz, but modes are kept up to {end} Hz only: below \
                 that the masses move with the wheel and damp little; expected analyses.modes.max_frequency above it"
            )
        };
        beyond.map(remark).collect::<Vec<String>>()
    };
    job.all_bodies().into_iter().flat_map(of).collect()
}

impl Usual {
    /// Segments of its key; of a key of a body also those that it has among `bodies.others`.
    fn patterns(&self) -> Vec<Vec<&'static str>> {
        let own: Vec<&str> = self.key.split('.').collect();
        match own[..] {
            ["bodies", ..] => vec![[&["bodies", "others"], &own[1..]].concat(), own],
            _ => vec![own],
        }
    }

    /// The remark on a value that is not usual at the place `path`.
    fn remark(&self, path: &str, value: f64, checker: &Checker) -> Option<String> {
        let [low, high] = self.range;
        let fits = |v: f64| v == 0.0 || (low..=high).contains(&rounded(v.abs()));
        if fits(value) {
            return None;
        }
        let unit = match checker.unit_at(&path.split('.').collect::<Vec<_>>()).as_str() {
            "-" | "1" => String::new(),
            unit => format!(" {unit}"),
        };
        let usual = match low {
            0.0 => format!("at most {}", number(high)),
            _ => format!("{} to {}", number(low), number(high)),
        };
        let meant = self.meant.iter().map(|(name, si)| (name, si(value))).find(|(_, si)| *si != 0.0 && fits(*si));
        let meant =
            meant.map(|(name, si)| format!("; were {} {name} meant, the job would have {}", number(value), number(si)));
        let (found, what) = (number(value), self.what);
        Some(format!("{path}: found {found}{unit}, but {what} is {usual}{unit}{}", meant.unwrap_or_default()))
    }

    /// The remark on the first such value of a swept key.
    fn remark_of_sweep(&self, job: &Job, pattern: &[&str], checker: &Checker) -> Option<String> {
        let plan = job.sweep.as_ref()?;
        let analysis = if job.analyses.uncertainty.is_some() { "uncertainty.inputs" } else { "sweep.keys" };
        plan.keys.iter().zip(&plan.values).find_map(|(key, values)| {
            let path: Vec<&str> = key.split('.').collect();
            let same = path.len() == pattern.len() && path.iter().zip(pattern).all(|(a, b)| *b == "*" || a == b);
            let remark = |value: &Value| self.remark(key, value.as_f64()?, checker);
            same.then(|| values.iter().find_map(remark))?.map(|text| format!("analyses.{analysis}: {text}"))
        })
    }
}

/// The numbers at the places of `value` that fit `pattern`, with their paths; `path` is that of `value`.
fn numbers(value: &Value, pattern: &[&str], path: &mut Vec<String>, found: &mut Vec<(Vec<String>, f64)>) {
    let Some((first, rest)) = pattern.split_first() else {
        found.extend(value.as_f64().map(|number| (path.clone(), number)));
        return;
    };
    let entries: Vec<(String, &Value)> = match value {
        Value::Object(map) => map.iter().map(|(key, inner)| (key.clone(), inner)).collect(),
        Value::Array(items) => items.iter().enumerate().map(|(i, inner)| (i.to_string(), inner)).collect(),
        _ => Vec::new(),
    };
    for (key, inner) in entries.into_iter().filter(|(key, _)| *first == "*" || key == first) {
        path.push(key);
        numbers(inner, rest, path, found);
        path.pop();
    }
}

/// Six significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

/// A number for people.
fn number(value: f64) -> String {
    let value = rounded(value);
    match value.abs() {
        m if m != 0.0 && !(1e-3..1e6).contains(&m) => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// A speed at which no train runs through the curve that the yaw of its wheelset is that of.
fn fast_in_a_curve(job: &Job) -> Option<String> {
    let placement = job.placement().filter(|p| (CURVED..=STEERED).contains(&p.yaw.abs()))?;
    let (key, speed) = match placement.speed {
        Some(speed) => ("contact.placement.speed", speed),
        None => ("contact.speed", job.contact.as_ref()?.speed),
    };
    let radius = WHEELBASE / placement.yaw.abs();
    let lateral = |v: f64| v * v / radius;
    // Beyond the range of speeds the table has spoken.
    (speed <= 100.0 && lateral(speed) > LATERAL).then(|| {
        let meant = format!("; were {} km/h meant, the job would have {}", number(speed), number(speed / 3.6));
        let meant = if lateral(speed / 3.6) <= LATERAL { meant } else { String::new() };
        format!(
            "{key}: found {} m/s with contact.placement.yaw {} rad, that of a curve of some {radius:.0} m, in which a \
             train runs at {:.0} m/s at most{meant}",
            number(speed),
            placement.yaw,
            (LATERAL * radius).sqrt()
        )
    })
}

/// Modes that do not reach far enough beyond the frequencies that stability is asked about.
fn few_modes(job: &Job) -> Option<String> {
    let reach = job.analyses.modes.as_ref()?.max_frequency?;
    let asked = job.analyses.stability.as_ref()?.max_frequency;
    let (needed, why) = match asked {
        Some(asked) => (REACH * asked, format!("twice analyses.stability.max_frequency ({} Hz)", number(asked))),
        None => (SQUEAL, "for stability without a max_frequency of its own".into()),
    };
    (reach < needed).then(|| {
        format!(
            "analyses.modes.max_frequency: found {} Hz, expected at least {} Hz, {why}: the waves of a rail at \
             a frequency \
             come from many modes around it, and with too few growth rates are off by a factor (at 965 Hz 7.0 1/s with \
             modes up to 1100 Hz, 2.8 with modes up to 4000 Hz)",
            number(reach),
            number(needed)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const WHEEL: &str = include_str!("../../jobs/drawn-wheel.json");

    fn read(text: &str, sets: &[&str]) -> Job {
        let sets: Vec<String> = sets.iter().map(|s| s.to_string()).collect();
        Job::from_bytes(text.as_bytes(), Path::new("jobs/job.json"), &sets, None).unwrap()
    }

    #[test]
    fn no_shipped_job_is_remarked_on() {
        let jobs = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs");
        let mut count = 0;
        for entry in std::fs::read_dir(jobs).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "json") {
                let job = Job::from_bytes(&std::fs::read(&path).unwrap(), &path, &[], None).unwrap();
                assert_eq!(plausible(&job), [""; 0], "{}", path.display());
                count += 1;
            }
        }
        assert!(count > 20);
    }

    #[test]
    fn every_key_of_the_table_is_one_of_the_job_and_has_its_unit() {
        let known = Checker::default();
        for line in USUAL {
            // A key of either body, of a law, or of a list.
            let path: Vec<&str> = line.key.split('.').collect();
            let fill = |k: usize| match (path[k], k) {
                ("*", 1) if path[0] == "bodies" => "lower",
                ("*", k) if path[k - 1] == "friction" => "exponential",
                ("*", _) => "0",
                (key, _) => key,
            };
            let path: Vec<&str> = (0..path.len()).map(fill).collect();
            assert!(known.keys_at(&path).is_some(), "{}", line.key);
            assert!(line.range[0] < line.range[1], "{}", line.key);
        }
    }

    /// Each key with a value that is probably meant otherwise, and with the value that was meant.
    #[test]
    fn what_was_probably_meant_is_told() {
        for (key, value, meant) in [
            ("contact.normal_load", "60", "60 kN meant, the job would have 60000"),
            ("contact.normal_load", "0.06", "0.06 MN meant, the job would have 60000"),
            ("contact.speed", "360", "360 km/h meant, the job would have 100"),
            ("contact.speed", "36", "36 km/h meant, the job would have 10"),
            ("contact.placement.speed", "120", "120 km/h meant, the job would have 33.3333"),
            ("contact.friction", "35", "35 % meant, the job would have 0.35"),
            ("contact.friction", "1.2", "at most 1"),
            (
                "contact.friction",
                "{\"exponential\": {\"static\": 40, \"kinetic\": 0.3, \"decay_velocity\": 0.5}}",
                "friction.exponential.static: found 40, but a coefficient of friction is at most 1; were 40 % meant",
            ),
            ("contact.placement.creepage.lateral", "0.8", "0.8 % meant, the job would have 0.008"),
            ("contact.placement.cant", "0.5", "but the inclination of a rail (1:40 is 0.025) is at most 0.11 rad"),
            ("contact.placement.cant", "40", "40 the N of 1:N meant, the job would have 0.025"),
            ("contact.placement.cant", "1.43", "1.43 degrees meant, the job would have 0.0249582"),
            ("contact.placement.lateral", "-6", "-6 mm meant, the job would have -0.006"),
            ("contact.placement.yaw", "-0.57", "-0.57 degrees meant, the job would have -0.00994838"),
            ("contact.placement.yaw", "-10", "-10 mrad meant, the job would have -0.01"),
            ("contact.placement.roll", "1.5", "1.5 degrees meant"),
            ("contact.placement.radius", "460", "460 mm meant, the job would have 0.46"),
            ("contact.placement.radius", "0.92", "0.92 m of diameter meant, the job would have 0.46"),
            ("contact.placement.radius", "920", "920 mm of diameter meant, the job would have 0.46"),
            ("contact.placement.gauge", "1435", "1435 mm meant, the job would have 1.435"),
            ("contact.placement.gauge_depth", "14", "14 mm meant, the job would have 0.014"),
            ("contact.placement.circles", "1500", "1500 mm meant, the job would have 1.5"),
            ("bodies.upper.mesh.revolved.section.file.radius", "460", "460 mm meant"),
            ("bodies.upper.material.young", "210", "210 GPa meant, the job would have 2.1e11"),
            ("bodies.lower.material.young", "210000", "210000 MPa meant, the job would have 2.1e11"),
            ("bodies.upper.material.density", "7.86", "7.86 t/m³ (g/cm³) meant, the job would have 7860"),
            ("bodies.upper.material.density", "7.86e-9", "7.86e-9 t/mm³ meant, the job would have 7860"),
            ("bodies.lower.material.density", "1e30", "but the density of a metal is 1000 to 25000 kg/m³"),
            ("bodies.lower.track.spacing", "600", "600 mm meant, the job would have 0.6"),
            ("bodies.lower.track.pad.vertical", "120", "120 MN/m (kN/mm) meant, the job would have 1.2e8"),
            ("bodies.lower.track.pad.lateral", "40000", "40000 kN/m (N/mm) meant, the job would have 4e7"),
            ("bodies.lower.track.sleeper", "{\"mass\": 0.3}", "0.3 t meant, the job would have 300"),
            ("bodies.lower.track.loss_factor", "2", "2 % meant, the job would have 0.02"),
            ("bodies.upper.damping.modal.by_diameter", "[0.002, 2, 0.0002]", "2 % meant, the job would have 0.02"),
            ("analyses.modes.max_frequency", "1100", "with modes up to 1100 Hz, 2.8 with modes up to 4000 Hz"),
        ] {
            let job = read(WHEEL, &[&format!("{key}={value}")]);
            let remarks = plausible(&job);
            let [remark] = &remarks[..] else { panic!("{key}={value}: {remarks:?}") };
            assert!(remark.starts_with(key) && remark.contains(meant), "{key}={value}: {remark}");
        }
        let approach = ["contact.normal_load=null", "contact.approach=60"];
        assert!(plausible(&read(WHEEL, &approach))[0].contains("60 µm meant, the job would have 6e-5"));
        // As far as it is asked about.
        let asked = |f: &str| plausible(&read(WHEEL, &["analyses.modes.max_frequency=2500", f])).len();
        assert_eq!(
            ["=975", "=1250", "=1300"].map(|f| asked(&format!("analyses.stability.max_frequency{f}"))),
            [0, 0, 1]
        );
    }

    #[test]
    fn jobs_without_a_rail_have_other_magnitudes() {
        let cylinders = include_str!("../../jobs/two-cylinders.json");
        let sets = ["contact.normal_load=60", "bodies.lower.material.young=3e9", "contact.speed=200"];
        assert_eq!(plausible(&read(cylinders, &sets)), [""; 0]);
        let sets = ["bodies.lower.material.young=205", "contact.creepage.lateral=0.3"];
        let remarks = plausible(&read(cylinders, &sets));
        assert!(remarks.len() == 2 && remarks[0].starts_with("contact.creepage.lateral: found 0.3"), "{remarks:?}");
        assert!(remarks[1].contains("205 GPa meant, the job would have 2.05e11"), "{remarks:?}");
    }

    #[test]
    fn values_of_a_sweep_are_looked_at_as_well() {
        let sweep =
            "analyses.sweep={\"keys\": {\"contact.placement.lateral\": [-0.006, -6], \"contact.friction\": [0.3]}}";
        let remarks = plausible(&read(WHEEL, &[sweep]));
        let [remark] = &remarks[..] else { panic!("{remarks:?}") };
        assert!(remark.starts_with("analyses.sweep.keys: contact.placement.lateral: found -6 m"), "{remark}");
    }
}
