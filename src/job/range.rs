//! The range in which the theory holds, as far as the job alone shows it (`docs/explanation/limits.md`, "Range").

use super::hertz::{contact_size, small_strain};
use super::{Body, Contact, CreepageKey, Job, Transient};
use crate::{Error, Result};

/// A quantity that must stay small, and from where on it is warned of and refused.
struct Small {
    /// The key, and what was found.
    found: String,
    /// Name of the small quantity.
    what: &'static str,
    value: f64,
    warn: f64,
    refuse: f64,
}

/// No solid that could be a wheel or a rail has slower shear waves, m/s; lead has 700, hard rubber some 50.
const SLOWEST: f64 = 20.0;

/// Warnings of what comes near the ends of the range; an error that names all that is beyond them.
pub fn range(job: &Job) -> Result<Vec<String>> {
    if let (false, Some(disc)) = (job.contacts.is_empty(), &job.bodies.lower) {
        return within(&[turning(job, disc)?]);
    }
    let Some(contact) = job.contact.as_ref().filter(|_| !job.by_matrices()) else { return Ok(Vec::new()) };
    let mut named = vec![("contact".to_owned(), contact)];
    if !contact.around.is_empty() {
        named.extend(contact.further.iter().enumerate().map(|(i, one)| (format!("contact.around.{i}"), one)));
    }
    named.iter().try_for_each(|(key, one)| small_strain(job, (key, one)))?;
    let mut all: Vec<Small> = named.iter().enumerate().map(|(k, (key, one))| slip(job, (key, one), k)).collect();
    all.extend(mach(job, contact)?);
    if let Some(transient) = &job.analyses.transient {
        all.extend(motion(job, contact, transient));
    }
    within(&all)
}

/// Warnings of those that come near their limits; an error that names those beyond them.
fn within(all: &[Small]) -> Result<Vec<String>> {
    let text =
        |s: &Small, verb: &str, limit: f64| format!("{}: {} is {:.2e}, {verb} {limit}", s.found, s.what, s.value);
    let beyond: Vec<String> =
        all.iter().filter(|s| !(s.value <= s.refuse)).map(|s| text(s, "expected at most", s.refuse)).collect();
    if !beyond.is_empty() {
        return Err(Error::Job(format!("beyond the range of the theory: {}", beyond.join("\n  "))));
    }
    Ok(all.iter().filter(|s| s.value > s.warn).map(|s| text(s, "small up to", s.warn)).collect())
}

/// The velocity of the disc below its pads over that of shear waves.
fn turning(job: &Job, disc: &Body) -> Result<Small> {
    let m = disc.elastic()?;
    let waves = (0.5 * m.young / (1.0 + m.poisson) / m.density).sqrt();
    let speed = job.angular_velocity_of(disc).abs();
    let cells = job.contacts.iter().flat_map(|contact| &contact.cells);
    let radius = cells.map(|cell| cell.radius + cell.half[1]).fold(0.0, f64::max);
    let name = job.bodies.with_names("bodies.lower.rotation".into());
    Ok(Small {
        found: format!(
            "{name} {speed} rad/s, {:.4e} m/s at r = {radius} m (shear waves {waves:.3e} m/s)",
            speed * radius
        ),
        what: "the speed over that of shear waves",
        value: speed * radius / waves,
        warn: 0.1,
        refuse: 0.3,
    })
}

/// Largest magnitude of a history.
fn largest(table: &Option<Vec<[f64; 2]>>) -> f64 {
    table.iter().flatten().map(|p| p[1].abs()).fold(0.0, f64::max)
}

/// The largest rigid slip over the rolling speed. The surfaces of the bodies move at V(1 ± s/2), the convective terms
/// of both take V.
fn slip(job: &Job, (key, contact): (&str, &Contact), number: usize) -> Small {
    let c = contact.creepage;
    let histories = job.analyses.transient.as_ref().and_then(|t| t.histories.clone()).unwrap_or_default();
    let (path, histories) = histories.of_contact(number);
    let curve = job.analyses.creep_curve.as_ref();
    let farthest = |key: CreepageKey| {
        let values = curve.filter(|curve| curve.key == key).and_then(|curve| curve.numbers().ok()).unwrap_or_default();
        // The values are those of the first contact.
        let change = job.contact.as_ref().map_or(0.0, |first| c.component(key) - first.creepage.component(key));
        values.into_iter().fold(0.0, |m: f64, v| m.max((v + change).abs()))
    };
    let along = c.longitudinal.abs().max(largest(&histories.longitudinal)).max(farthest(CreepageKey::Longitudinal));
    let across = c.lateral.abs().max(largest(&histories.lateral)).max(farthest(CreepageKey::Lateral));
    let reach = contact_size(job, contact).or(contact.patch.map(|p| p.half_length.max(p.half_width))).unwrap_or(0.0);
    let spin = reach * c.spin.abs().max(largest(&histories.spin)).max(farthest(CreepageKey::Spin));
    let mut found = format!("{key}.creepage {} {} {} 1/m", c.longitudinal, c.lateral, c.spin);
    let listed = [CreepageKey::Longitudinal, CreepageKey::Lateral, CreepageKey::Spin].map(farthest);
    if let Some(value) = listed.into_iter().filter(|v| *v > 0.0).reduce(f64::max) {
        found += &format!(", analyses.creep_curve.values up to {value}");
    }
    let moved = [&histories.longitudinal, &histories.lateral, &histories.spin].map(largest);
    if let Some(value) = moved.into_iter().filter(|v| *v > 0.0).reduce(f64::max) {
        found += &format!(", {path} up to {value}");
    }
    Small {
        found,
        what: "the rigid slip in the contact over the speed",
        value: along.hypot(across) + spin,
        warn: 0.1,
        refuse: 1.0,
    }
}

/// The speed over that of shear waves: inertia by the moving contact, left out of the statics, changes displacements
/// by about its square.
fn mach(job: &Job, contact: &Contact) -> Result<Option<Small>> {
    let (mut slowest, mut whose, mut at) = (f64::INFINITY, String::new(), String::new());
    for (name, body) in job.all_bodies() {
        let m = body.elastic()?;
        let speed = (0.5 * m.young / (1.0 + m.poisson) / m.density).sqrt();
        if speed < slowest {
            let material = format!("young {:e} Pa and density {:e} kg/m³", m.young, m.density);
            (slowest, whose) = (speed, format!("{speed:.3e} m/s in bodies.{name}, by its {material}"));
            at = format!("bodies.{name}.material, {material}, hence shear waves of {speed:.3e} m/s");
        }
    }
    Ok(Some(Small {
        // Slower ones than in any solid are the fault of the material.
        found: match slowest < SLOWEST {
            true => format!("{at} (contact.speed {} m/s)", contact.speed),
            false => format!("contact.speed {} m/s (shear waves {whose})", contact.speed),
        },
        what: "the speed over that of shear waves",
        value: contact.speed / slowest,
        warn: 0.1,
        refuse: 0.3,
    }))
}

/// Displacements at the start, and the way of a step, against the size of the contact.
fn motion(job: &Job, contact: &Contact, transient: &Transient) -> Vec<Small> {
    let size = contact_size(job, contact).or(contact.patch.map(|p| p.half_length.min(p.half_width)));
    let Some(size) = size else { return Vec::new() };
    let mut all = Vec::new();
    if transient.start.mode.is_some() {
        // The gap κs²/2 changes by κ s a against the approach κ a².
        all.push(Small {
            found: format!("analyses.transient.start.amplitude {} m", transient.start.amplitude),
            what: "the displacement over the half length of the contact",
            value: transient.start.amplitude / size,
            warn: 0.02,
            refuse: 0.2,
        });
    }
    let way = contact.speed * transient.step;
    let element = contact.patch.and_then(|p| p.spacing).or(job.contact_spacing());
    // Material must be seen in the contact, and should be seen at every node of it.
    all.push(Small {
        found: format!("analyses.transient.step {} s", transient.step),
        what: "the way that rolls through in a step over the half length of the contact",
        value: way / size,
        warn: element.map_or(0.5, |h| (h / size).min(0.5)),
        refuse: 1.0,
    });
    all
}

#[cfg(test)]
mod tests {
    use super::super::example::two_cylinders as job;
    use super::*;

    fn found(set: &str) -> Result<Vec<String>> {
        let transient =
            "analyses.transient={\"duration\": 0.01, \"step\": 1e-5, \"start\": {\"mode\": 1, \"amplitude\": 1e-6}}";
        range(&job(&[transient, "contact.creepage={\"lateral\": 0.01}", set]))
    }

    /// Below the first value nothing is said, between both there is a warning that names the key, above the second an
    /// error.
    #[test]
    fn what_leaves_the_range_is_warned_of_and_then_refused() {
        // Shear waves of steel: √(205e9/2.6/7800) = 3179 m/s; Hertz' radius at 70 kN: 4.884 mm.
        for (key, warn, refuse) in [
            ("contact.creepage.longitudinal", 0.0995, 1.0),
            ("contact.creepage.spin", 0.09 / 4.884e-3, 0.99 / 4.884e-3),
            ("contact.speed", 317.9, 953.8),
            ("analyses.transient.start.amplitude", 0.02 * 4.884e-3, 0.2 * 4.884e-3),
            ("analyses.transient.step", 1e-4, 4.884e-4),
        ] {
            // The step of 10 µs is much too long for such speeds, too.
            let set = |factor: f64, value: f64| match key {
                "contact.speed" => format!("contact={}", {
                    let mut c = serde_json::to_value(job(&[]).contact).unwrap();
                    c["speed"] = serde_json::json!(factor * value);
                    c
                }),
                _ => format!("{key}={}", factor * value),
            };
            if key == "contact.speed" {
                let alone = |v: f64| range(&job(&[&set(1.0, v), "contact.creepage={\"lateral\": 0.01}"]));
                assert_eq!(alone(0.99 * warn).unwrap(), [] as [&str; 0], "{key}");
                assert!(alone(1.01 * warn).unwrap()[0].contains(key), "{key}");
                assert!(alone(1.01 * refuse).unwrap_err().to_string().contains(key), "{key}");
                continue;
            }
            assert_eq!(found(&set(0.98, warn)).unwrap(), [] as [&str; 0], "{key}");
            let name = key.split(".longi").next().unwrap().split(".spin").next().unwrap();
            let warnings = found(&set(1.02, warn)).unwrap();
            assert!(warnings.len() == 1 && warnings[0].contains(name), "{key}: {warnings:?}");
            assert!(found(&set(0.97, refuse)).is_ok(), "{key}");
            let error = found(&set(1.03, refuse)).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(name), "{key}: {error}");
        }
    }
}
