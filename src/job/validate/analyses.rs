//! Rules of `analyses`.

use super::super::model::*;
use crate::job::cycles::Cycles;
use crate::job::transient::{HeldQuantity, SoundPower, StartState, Transient, TransientModel};

pub(super) fn check_analyses(job: &Job, faults: &mut Vec<String>) {
    if job.analyses.names().is_empty() {
        faults.push(
            "analyses: nothing to compute; give at least one of \"modes\", \"steady\", \"stability\" and \"transient\""
                .into(),
        );
    }
    if let Some(modes) = &job.analyses.modes {
        match (modes.count, modes.max_frequency) {
            (Some(_), Some(_)) => {
                faults.push("analyses.modes: both count and max_frequency are given; give exactly one of them".into());
            }
            (None, None) => faults.push("analyses.modes: give exactly one of count and max_frequency (Hz)".into()),
            _ => {}
        }
        if job.solver.linear == LinearSolver::Gamg {
            faults.push(
                "solver.linear: found \"gamg\", but analyses.modes needs the factorisation that \"mumps\" \
                 makes; leave out one of the two"
                    .into(),
            );
        }
    }
    if let Some(analysis) = job.analyses.on_contact().first() {
        match &job.contact {
            None => faults.push(format!("contact: missing; analyses.{analysis} needs it")),
            Some(contact) if contact.compliance.of_bodies() => {
                let held =
                    |b: &Body| b.is_held() || b.is_half_space() || matches!(b.mesh, Some(MeshSource::Extruded(_)));
                for (name, body) in job.bodies().iter().filter(|(_, b)| !held(b) && !b.is_meshed()) {
                    let instead = match &body.mesh {
                        Some(MeshSource::Revolved(r)) if r.middle().is_some() => {
                            ", or give its primary suspension, e.g. {\"longitudinal\": 10e6, \"lateral\": 5e6, \
                             \"vertical\": 1e6} (N/m)"
                        }
                        _ => "",
                    };
                    faults.push(format!(
                        "bodies.{name}.fixed: no fixed support, but analyses.{analysis} solves a static \
                         problem; name a group to clamp, e.g. [\"inner\"]{instead}"
                    ));
                }
                for (name, _) in job.bodies().iter().filter(|(_, b)| !held(b) && b.is_meshed()) {
                    if let Some(what) = job.static_load() {
                        faults.push(format!(
                            "bodies.{name}.fixed: no fixed support, but {what} is a static problem whose load \
                             nothing bears; name a group to clamp, \
                             e.g. [\"inner\"], or hang the body on springs (bodies.{name}.supports)"
                        ));
                    }
                }
            }
            Some(_) => {}
        }
    }
    if let Some(receptance) = &job.analyses.receptance {
        if job.analyses.modes.is_none() {
            faults.push(
                "analyses.modes: missing; analyses.receptance is computed on the modes, e.g. {\"count\": 60}".into(),
            );
        }
        if job.contact.as_ref().is_some_and(|c| !c.compliance.of_bodies()) {
            faults.push(
                "contact.compliance: \"half_space\" has no modes; analyses.receptance needs \"fe\" or \"hybrid\""
                    .into(),
            );
        }
        if let Err(fault) = receptance.frequency.numbers() {
            faults.push(format!("analyses.receptance.frequency: {fault}"));
        }
    }
    if let Some(curve) = &job.analyses.creep_curve {
        if let Err(fault) = curve.numbers() {
            faults.push(format!("analyses.creep_curve.values: {fault}"));
        }
        if job.solver.linear == LinearSolver::Gamg && job.analyses.modes.is_none() {
            faults.push(
                "solver.linear: found \"gamg\", but analyses.creep_curve needs the compliance that \"mumps\" \
                 makes; leave out one of the two"
                    .into(),
            );
        }
    }
    if let Some(transient) = &job.analyses.transient {
        check_transient(job, transient, ("analyses.transient", faults));
    }
    if job.analyses.sweep.is_some() && job.analyses.stability.is_none() {
        faults.push("analyses.stability: missing; analyses.sweep computes it at every point, e.g. {}".into());
    }
    if let Some(sweep) = &job.analyses.sweep {
        check_cycles(job, sweep, faults);
    }
    if let Some(cycles) = &job.analyses.cycles {
        faults.extend(crate::job::branches::faults(job, cycles));
        if let Some(sound) = &cycles.sound_power {
            check_sound("analyses.cycles.sound_power", sound, faults);
        }
        check_transient(job, &cycles.march.transient(StartState::Sliding), ("analyses.cycles.march", faults));
    }
    if let (Some(_), Some(contact)) = (&job.analyses.stability, &job.contact) {
        check_stability(job, contact, faults);
    }
}

pub(super) fn check_uncertainty(job: &Job, wanted: &Uncertainty, faults: &mut Vec<String>) {
    if job.analyses.stability.is_none() {
        faults.push("analyses.stability: missing; analyses.uncertainty computes it at every point, e.g. {}".into());
    }
    if job.analyses.sweep.is_some() {
        faults.push("analyses.sweep: found beside analyses.uncertainty; leave out one of the two".into());
    }
    faults.extend(crate::job::uncertainty::faults(wanted).into_iter().map(|f| format!("analyses.uncertainty.{f}")));
    if let Some(cycles) = &wanted.cycles {
        check_followed(job, ("analyses.uncertainty.cycles", &cycles.of_points()), faults);
    }
}

/// Adds the faults of the limit cycles of a sweep.
pub(super) fn check_cycles(job: &Job, sweep: &Sweep, faults: &mut Vec<String>) {
    let Some(cycles) = &sweep.cycles else { return };
    let path = "analyses.sweep.cycles";
    if let Some(key) = cycles.along.as_ref().filter(|key| !sweep.keys.contains_key(*key)) {
        let keys: Vec<&str> = sweep.keys.keys().map(String::as_str).collect();
        faults.push(format!("{path}.along: found \"{key}\", expected a swept key: {}", keys.join(", ")));
    }
    if let Some(k) = (1..cycles.branches.len()).find(|&k| cycles.branches[..k].contains(&cycles.branches[k])) {
        faults.push(format!("{path}.branches: found \"{}\" twice, expected each once", cycles.branches[k].name()));
    }
    check_followed(job, (path, cycles), faults);
}

/// Faults of points that are followed to their limit cycles.
fn check_followed(job: &Job, (path, cycles): (&str, &Cycles), faults: &mut Vec<String>) {
    if job.contact.as_ref().is_some_and(|c| c.roughness.is_some()) {
        faults.push(format!(
            "{path}: found contact.roughness, under which no motion repeats itself; leave out one of the two"
        ));
    }
    if let Some(sound) = &cycles.sound_power {
        check_sound(&format!("{path}.sound_power"), sound, faults);
        if let Some(from) = sound.from {
            faults.push(format!(
                "{path}.sound_power.from: found {from} s, expected none: the sound of a point is that of its \
                 motion at the end"
            ));
        }
    }
    check_transient(job, &cycles.transient(StartState::Sliding), (path, faults));
}

/// Largest number of steps: segments are named by twelve figures.
const MAX_STEPS: u64 = 999_999_999_999;

/// Adds the faults of a transient under the key `path`.
pub(super) fn check_transient(job: &Job, transient: &Transient, (path, faults): (&str, &mut Vec<String>)) {
    if job.analyses.modes.is_none() {
        faults.push(format!("analyses.modes: missing; {path} is computed on the modes, e.g. {{\"count\": 60}}"));
    }
    if job.contact.as_ref().is_some_and(|c| !c.compliance.of_bodies()) {
        faults.push(format!("contact.compliance: \"half_space\" has no modes; {path} needs \"fe\" or \"hybrid\""));
    }
    if transient.model == TransientModel::Full {
        check_full(job, transient, (path, faults));
    }
    if transient.duration < transient.step {
        faults.push(format!(
            "{path}.duration: found {} s, expected at least one step ({} s)",
            transient.duration, transient.step
        ));
    }
    if transient.steps() > MAX_STEPS {
        // Their number need not be one.
        faults.push(format!(
            "{path}.duration: found {:e} s in steps of {} s, expected at most {MAX_STEPS} steps, {:.3e} s",
            transient.duration,
            transient.step,
            MAX_STEPS as f64 * transient.step
        ));
    }
    if transient.start.mode.is_some() && job.analyses.stability.is_none() {
        faults.push(format!("analyses.stability: missing; {path}.start.mode names a mode of it, e.g. {{}}"));
    }
    for (i, point) in transient.points.iter().enumerate() {
        if point.name.trim().is_empty() || transient.points[..i].iter().any(|p| p.name == point.name) {
            faults.push(format!("{path}.points.{i}.name: found {:?}, expected a name of its own", point.name));
        }
    }
    if let Some(sound) = &transient.sound_power {
        check_sound(&format!("{path}.sound_power"), sound, faults);
    }
    let loaded =
        |c: &Contact| c.normal_load.is_some() || c.vertical_load.is_some() || c.axle_load.is_some() || c.from.is_some();
    let load_given = job.contact.as_ref().is_some_and(loaded);
    let histories = transient.histories.clone().unwrap_or_default();
    let all = histories.all();
    for (path, own) in &all {
        if own.normal_load.is_some() && own.approach.is_some() {
            faults.push(format!("{path}: both normal_load and approach are given; give one of them"));
        }
    }
    let shared = job.contact.as_ref().is_some_and(|c| c.vertical_load.is_some());
    for (path, _) in all.iter().filter(|(_, own)| shared && own.presses()) {
        faults.push(format!(
            "{path}: normal_load or approach is given, but the contacts of the wheel share contact.vertical_load; \
             expected analyses.transient.histories.vertical_load"
        ));
    }
    if histories.vertical_load.is_some() && !shared {
        faults.push(format!(
            "{path}.histories.vertical_load: given without contact.vertical_load, the load at the start that the \
             contacts share; expected normal_load of each contact, or contact.places = \"all\" with a vertical load"
        ));
    }
    let aside = job.contact.as_ref().is_some_and(|c| c.lateral_force.is_none() || c.from.is_some());
    if histories.lateral_force.is_some() && aside {
        faults.push(format!(
            "{path}.histories.lateral_force: given without contact.lateral_force, from which the shift of a wheel at \
             a given yaw (contact.placement) follows; give that, or leave the table out"
        ));
    }
    let given = histories.vertical_load.is_some() || all.iter().any(|(_, own)| own.presses());
    if transient.hold == HeldQuantity::Load && !load_given && !given {
        faults.push(format!("{path}.hold: \"load\" needs contact.normal_load; the job gives an approach"));
    }
}

/// Refuses keys that the model of all degrees of freedom leaves to the model of the modes.
fn check_full(job: &Job, transient: &Transient, (path, faults): (&str, &mut Vec<String>)) {
    let load = transient.histories.as_ref().is_some_and(|h| h.normal_load.is_some());
    let mut refuse = |key: &str, found: &str, why: &str| {
        faults.push(format!("{path}.{key}: found {found}, but {path}.model is \"full\": {why}"));
    };
    if transient.hold == HeldQuantity::Load || load {
        let key = if load { "histories.normal_load" } else { "hold" };
        refuse(key, "a given load", "its law of impact holds the approach; give that, or take the model \"reduced\"");
    }
    if transient.body_stride > 0 {
        let found = transient.body_stride.to_string();
        refuse(
            "body_stride",
            &found,
            "it writes the motion of points alone; set it to 0, or take the model \"reduced\"",
        );
    }
    if job.solver.linear != LinearSolver::Mumps {
        faults.push(format!(
            "solver.linear: found \"gamg\", expected \"mumps\": {path}.model \"full\" solves \
         with one factorisation at every step"
        ));
    }
}

fn check_sound(path: &str, sound: &SoundPower, faults: &mut Vec<String>) {
    if sound.bodies.is_empty() || (1..sound.bodies.len()).any(|i| sound.bodies[..i].contains(&sound.bodies[i])) {
        faults.push(format!("{path}.bodies: found {:?}, expected \"lower\", \"upper\" or both", sound.bodies));
    }
    if let Some(f) = sound.max_frequency.filter(|f| *f <= sound.min_frequency) {
        faults.push(format!(
            "{path}.max_frequency: found {f} Hz, expected more than min_frequency ({} Hz)",
            sound.min_frequency
        ));
    }
}

fn check_stability(job: &Job, contact: &Contact, faults: &mut Vec<String>) {
    if job.analyses.modes.is_none() {
        faults
            .push("analyses.modes: missing; analyses.stability is computed on the modes, e.g. {\"count\": 60}".into());
    }
    if !contact.compliance.of_bodies() {
        faults.push(
            "contact.compliance: \"half_space\" has no modes; analyses.stability needs \"fe\" or \"hybrid\"".into(),
        );
    }
    if let Some(phases) = job.analyses.stability.as_ref().map(|s| s.phases).filter(|p| !p.is_multiple_of(4)) {
        faults.push(format!(
            "analyses.stability.phases: found {phases}, expected a multiple of 4: a quarter \
         period after the real part comes the imaginary one"
        ));
    }
    let stability = job.analyses.stability.as_ref();
    if stability.is_some_and(|s| s.state == Some(StabilityState::Steady) && s.direction == Direction::Rigid) {
        faults.push(
            "analyses.stability.direction: found \"rigid\" with the state \"steady\", in which the \
         bodies are deformed; expected \"actual\", or the state \"sliding\""
                .into(),
        );
    }
    let c = contact.creepage;
    // On a placement creepages follow from the motion of the wheel.
    if contact.placement.is_some() || stability.is_some_and(|s| s.state() == StabilityState::Steady) {
        return;
    }
    if c.longitudinal == 0.0 && c.lateral == 0.0 && c.spin == 0.0 {
        faults.push(
            "contact.creepage: all three are 0, so the direction of sliding is undefined; analyses.stability \
             needs a creepage"
                .into(),
        );
    }
}
