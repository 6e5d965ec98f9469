//! Rules between the keys of a rail.

use super::super::model::*;

/// Part of a bay by which a number of bays may be off a whole one.
const WHOLE: f64 = 1e-6;

/// Adds the faults of pads that stand apart.
fn check_bays(path: &str, track: &Track, extruded: &Extruded, faults: &mut Vec<String>) {
    let Some(length) = track.pad_length else {
        if track.position != 0.0 {
            faults.push(format!(
                "{path}.track.position: found {} m without {path}.track.pad_length: pads that are spread evenly \
                 are the same everywhere; leave it out",
                track.position
            ));
        }
        return;
    };
    if length > track.spacing {
        faults.push(format!(
            "{path}.track.pad_length: found {length} m, expected at most {path}.track.spacing ({} m)",
            track.spacing
        ));
    }
    let bays = extruded.length / track.spacing;
    if (bays - bays.round()).abs() > WHOLE || bays < 0.5 {
        faults.push(format!(
            "{path}.mesh.extruded.length: found {} m, expected a whole number of bays of {path}.track.spacing \
             ({} m), as \
             pads stand apart, for example {:.4} m",
            extruded.length,
            track.spacing,
            bays.ceil() * track.spacing
        ));
    }
}

/// Adds the fault of pads that stand apart in a job without the modes that they act through.
pub fn check_modes(job: &Job, faults: &mut Vec<String>) {
    let apart = |body: &Body| body.track.as_ref().is_some_and(|t| t.pad_length.is_some());
    for (name, _) in job.bodies().into_iter().filter(|(_, b)| apart(b) && job.analyses.modes.is_none()) {
        faults.push(format!(
            "analyses.modes: missing; bodies.{name}.track.pad_length acts on the modes, e.g. \
             {{\"max_frequency\": 4000}}"
        ));
    }
}

/// Largest part of the gauge by which the middles of rails may be farther apart than their running edges.
const HEADS: f64 = 0.15;

/// Adds the faults of sleepers below both rails.
pub fn check_sleepers(job: &Job, faults: &mut Vec<String>) {
    for (name, body) in job.bodies() {
        let Some(track) = &body.track else { continue };
        let Some(whole) = track.sleeper.and_then(|sleeper| sleeper.both_rails) else { continue };
        let path = format!("bodies.{name}.track");
        let key = format!("{path}.sleeper.both_rails");
        if track.pad_length.is_none() {
            faults.push(format!(
                "{key}: found without {path}.pad_length; sleepers below both rails stand apart: give the length of \
                 their pads, e.g. 0.15"
            ));
        }
        if whole.rail_distance >= whole.length {
            faults.push(format!(
                "{key}.rail_distance: found {} m, expected less than the length of the sleeper ({} m)",
                whole.rail_distance, whole.length
            ));
        }
        if job.contact.as_ref().is_none_or(|contact| contact.wheels != ContactWheels::Both) {
            faults.push(format!(
                "{key}: found without contact.wheels = \"both\"; one wheel alone is modelled with the rail that it \
                 runs on: let both run, or leave the key out"
            ));
        }
        let gauge = match (&job.curve, job.placement()) {
            (Some(curve), _) if curve.gauge_widening > 0.0 => {
                Some(("curve.gauge + curve.gauge_widening", curve.gauge + curve.gauge_widening))
            }
            (Some(curve), _) => Some(("curve.gauge", curve.gauge)),
            (None, Some(placement)) => Some(("contact.placement.gauge", placement.gauge)),
            _ => None,
        };
        if let Some((of, gauge)) =
            gauge.filter(|(_, gauge)| !(whole.rail_distance > *gauge && whole.rail_distance < (1.0 + HEADS) * gauge))
        {
            faults.push(format!(
                "{key}.rail_distance: found {} m with {of} = {gauge} m, expected a little more than the gauge: the \
                 distance of the middles of the rails, {:.3} m with heads of 65 mm",
                whole.rail_distance,
                gauge + 0.065
            ));
        }
    }
}

/// Adds the faults of track decay rates: they are of one rail, on a track.
pub fn check_track_decay(job: &Job, faults: &mut Vec<String>) {
    if job.analyses.track_decay.is_none() {
        return;
    }
    let rails = job.bodies().into_iter().filter(|(_, b)| matches!(b.mesh, Some(MeshSource::Extruded(_)))).count();
    if rails != 1 {
        faults.push(format!(
            "analyses.track_decay: found {rails} rails, expected one: a body with mesh.extruded, on its track"
        ));
    }
    for (name, track) in job.bodies().into_iter().filter_map(|(name, b)| Some((name, b.track.as_ref()?))) {
        let ballast = track.sleeper.map_or(0.0, |s| s.ballast.loss_factor);
        if [track.loss_factor, track.pad.loss_factor, ballast].iter().all(|loss| *loss == 0.0) {
            faults.push(format!(
                "bodies.{name}.track: found neither a loss factor of the rail nor one of pads or ballast, expected one \
                 above 0: without damping its waves never decay"
            ));
        }
    }
}

/// Adds the faults of a rail.
pub fn check_body(path: &str, body: &Body, extruded: &Extruded, faults: &mut Vec<String>) {
    let key = format!("{path}.mesh.extruded");
    if let Some(rail) = extruded.section.built() {
        let reach = rail.head.reach();
        if !(extruded.contact_offset.abs() <= reach) {
            faults.push(format!(
                "{key}.contact_offset: found {} m, expected a place on the head of {}, between -{reach} and \
                 {reach} m, where its surface is 72 degrees \
                 steep; contact on the face below needs contact.placement",
                extruded.contact_offset, rail.name
            ));
        }
    }
    for (given, what) in [(!body.fixed.is_empty(), "fixed"), (body.damping != Damping::default(), "damping")] {
        if given {
            faults.push(format!(
                "{path}.{what}: a rail has none of its own, {path}.track holds and damps it; leave it out"
            ));
        }
    }
    let track = body.track.clone().unwrap_or_default();
    if 2.0 * track.ends.length >= extruded.length {
        faults.push(format!(
            "{path}.track.ends.length: found {} m, expected less than half of {key}.length ({} m): there are \
             two ends, and plain rail between them",
            track.ends.length, extruded.length
        ));
    }
    check_bays(path, &track, extruded, faults);
}

#[cfg(test)]
mod tests {
    use crate::job::Job;
    use std::path::Path;

    const BAYS: &[u8] = include_bytes!("../../../jobs/rail-bays.json");

    const WHEELSET: &[u8] = include_bytes!("../../../jobs/wheelset-sleepers.json");

    /// Answer of a job to a change of it.
    fn answer(job: &[u8], set: &str) -> String {
        Job::from_bytes(job, Path::new("job.json"), &[set.to_string()], None).expect_err("must be refused").to_string()
    }

    #[test]
    fn sleepers_below_both_rails_have_both() {
        let says = |set: &str| answer(WHEELSET, set);
        let one = says("contact.wheels=\"one\"");
        assert!(one.contains("sleeper.both_rails: found without contact.wheels = \"both\""), "{one}");
        let even = says("bodies.lower.track.pad_length=null");
        assert!(even.contains("sleeper.both_rails: found without bodies.lower.track.pad_length"), "{even}");
        let short = says("bodies.lower.track.sleeper.both_rails.length=1.4");
        assert!(short.contains("rail_distance: found 1.5 m, expected less than the length"), "{short}");
        let metre = says("curve.gauge=1.0");
        assert!(metre.contains("rail_distance: found 1.5 m with curve.gauge = 1 m"), "{metre}");
    }

    #[test]
    fn pads_that_stand_apart_have_their_bays() {
        let says = |set: &str| answer(BAYS, set);
        assert!(Job::from_bytes(BAYS, Path::new("job.json"), &[], None).is_ok());
        let short = says("bodies.lower.mesh.extruded.length=28.5");
        assert!(
            short.contains("bodies.lower.mesh.extruded.length: found 28.5 m") && short.contains("28.8000 m"),
            "{short}"
        );
        let long = says("bodies.lower.track.pad_length=0.7");
        assert!(long.contains("bodies.lower.track.pad_length: found 0.7 m, expected at most"), "{long}");
        let even = says("bodies.lower.track.pad_length=null");
        assert!(even.contains("bodies.lower.track.position: found 0.3 m without"), "{even}");
        let modes = says("analyses.modes=null");
        assert!(modes.contains("bodies.lower.track.pad_length acts on the modes"), "{modes}");
    }
}
