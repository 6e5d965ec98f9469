//! Rules of rough surfaces.

use super::super::model::*;

/// Adds the faults of `contact.roughness`.
pub fn check(job: &Job, faults: &mut Vec<String>) {
    let Some(rough) = job.contact.as_ref().and_then(|c| c.roughness.as_ref()) else { return };
    if job.contact.as_ref().is_some_and(|c| c.points.is_some()) || job.by_matrices() {
        faults.push("contact.roughness: contact points stand still, so that nothing rolls; leave it out".into());
        return;
    }
    let around = job.contact.as_ref().map_or(0, |c| c.around.len());
    let several = job
        .contact
        .as_ref()
        .is_some_and(|c| around > 0 || c.places == ContactPlaces::All || c.wheels == ContactWheels::Both);
    let given = rough.further.len();
    if given > 0 && (!several || (around > 0 && given != around)) {
        faults.push(format!(
            "contact.roughness.further: found the roughness of {given} further contacts, expected that of {around}, or \
             none"
        ));
    }
    for (k, own) in rough.further.iter().enumerate() {
        if around > 0 && !own.lower.is_empty() {
            faults.push(format!(
                "contact.roughness.further.{k}.lower: the same surface passes all contacts around a body; expected its \
                 roughness as contact.roughness.lower alone"
            ));
        }
    }
    for RoughBody { name, path, parts } in rough.all() {
        for (i, part) in parts.iter().enumerate() {
            let path = format!("{path}.{i}");
            let turns = job.circumference(name).is_some();
            match part {
                RoughnessPart::File(f) if f.path.as_os_str().is_empty() => {
                    faults.push(format!("{path}.file.path: the file name is empty"));
                }
                RoughnessPart::Flat(f) if f.depth.is_none() && !turns => faults.push(format!(
                    "{path}.flat.depth: missing; the radius of this body is not known, so that a chord has no depth"
                )),
                RoughnessPart::Step(_) if turns => faults.push(format!(
                    "{path}.step: a wheel comes back to the same height after a turn; give a flat or a joint, \
                     or give the step to a rail"
                )),
                RoughnessPart::Spectrum(s) => {
                    if matches!(&s.levels, RoughLevels::Bands(b) if b.is_empty() || b.iter().any(|b| !(b[0] > 0.0))) {
                        faults.push(format!(
                            "{path}.spectrum.levels: expected \"ISO3095\" or pairs of wavelength (m, above 0) \
                             and level (dB re 1 µm)"
                        ));
                    }
                }
                _ => {}
            }
        }
    }
}
