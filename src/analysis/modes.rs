//! The analysis `modes`: free-interface modes of each body.

use super::run::Run;
use crate::body::modes::Extent;
use crate::body::{Kind, ModeName, TraceModes};
use crate::case::bodies::Bodies;
use crate::job::{Job, ModesExtent};
use crate::model::{waves, ModalRotation, Wave};
use crate::output::{companion, write_modes, Table};
use crate::progress::Progress;
use crate::summary::Summary;
use crate::Result;

/// Collective: modes of each of [`Bodies::unique`]; none where the job asks for none.
pub fn compute_all(job: &Job, bodies: &mut Bodies, progress: &mut Progress) -> Result<Vec<TraceModes>> {
    let Some(wanted) = &job.analyses.modes else { return Ok(Vec::new()) };
    let extent = match wanted.extent() {
        ModesExtent::Count(n) => Extent::Count(n),
        ModesExtent::MaxFrequency(f) => Extent::MaxFrequency(f),
    };
    let mut all = Vec::new();
    for body in &mut bodies.unique {
        progress.stage(format!("modes, body {}", body.name()));
        all.push(body.modes(extent, &mut |done, of| progress.step("modes", done, of))?);
    }
    Ok(all)
}

/// Collective: modes of every unique body, written for every place; returns those of each of [`Bodies::unique`].
pub fn run(run: &mut Run, bodies: &mut Bodies) -> Result<Vec<TraceModes>> {
    let world = run.world();
    let all = compute_all(run.job, bodies, run.progress)?;
    for (index, (body, modes)) in bodies.unique.iter().zip(&all).enumerate() {
        if body.kind() == Kind::Rigid {
            continue;
        }
        let frequency = modes.frequency();
        for place in bodies.places.iter().filter(|p| p.body == index) {
            run.file.tables(tables(place.name, &frequency, &modes.residual));
            if modes.rotation.is_none() {
                run.file.tables(orders(place.name, &modes.names));
            }
            run.file.tables(families(place.name, &modes.names));
            if let Some(rotation) = &modes.rotation {
                rotating(run, place.name, &modes.omega, rotation)?;
            }
        }
        summarise(body.name(), (&frequency, &modes.names), &mut run.summary);
    }
    if run.job.output.fields && !all.is_empty() && bodies.on_meshes() {
        run.progress.stage("writing mode shapes");
        let frequencies: Vec<Vec<f64>> = bodies.places.iter().map(|p| all[p.body].frequency()).collect();
        let path = companion(&run.options.output, "free_modes.vtkhdf");
        let shapes = write_modes(world, &path, run.replaces(), &bodies.parts(), &frequencies, |b, k| {
            let body = bodies.places[b].body;
            Ok(bodies.fields(body)?.at_nodes(&bodies.shapes_of(body)?.vectors[k]).into_flattened())
        })?;
        run.file.attach(shapes)?;
    }
    Ok(all)
}

/// Nodal diameters of the modes of a body that rotates, and its waves.
fn rotating(run: &mut Run, place: &str, omega: &[f64], rotation: &ModalRotation) -> Result<()> {
    let speed = run.job.angular_velocity(place);
    let list = |name: &str, units: &str, text: &str, values: Vec<f64>| {
        Table::list(&format!("/modes/{place}/{name}"), units, text, values)
    };
    let waves = waves(omega, rotation, speed)?;
    let speed_text = "Angular velocity of the body; positive if its material passes the contact towards +x.";
    run.file.tables([
        Table::scalar(&format!("/modes/{place}/angular_velocity"), "rad/s", speed_text, speed),
        list("diameters", "1", "Nodal diameters of each mode at rest.", rotation.diameters()),
        list(
            "wave_frequency",
            "Hz",
            "Frequencies of the undamped waves of the rotating body, seen from beside it, ascending.",
            waves.iter().map(|w| w.frequency).collect(),
        ),
        list(
            "wave_diameters",
            "1",
            "Nodal diameters of each wave: positive where it travels with the rotation, negative against it.",
            waves.iter().map(|w| w.diameters).collect(),
        ),
    ]);
    let named = |w: &Wave| format!("{:.2} ({:+.0})", w.frequency, w.diameters);
    let listed: Vec<String> = waves.iter().take(6).map(named).collect();
    run.summary.value(
        &format!("waves at {speed:.3} rad/s"),
        format!("Hz (nodal diameters, + with the rotation): {} ...", listed.join(", ")),
    );
    Ok(())
}

/// On rank 0: the tables of modes (frequencies in Hz, residuals) that come from an earlier run, for the lower and the upper body.
pub fn write_reused(run: &mut Run, modes: &[(Vec<f64>, Vec<f64>); 2]) {
    for (name, (frequency, residual)) in ["lower", "upper"].into_iter().zip(modes) {
        run.file.tables(tables(name, frequency, residual));
        summarise(name, (frequency, &[]), &mut run.summary);
    }
    run.summary.value("modes and compliance", "from the earlier run; mode shapes are not written");
}

fn tables(place: &str, frequency: &[f64], residual: &[f64]) -> Vec<Table> {
    let list = |name: &str, units: &str, text: &str, values: &[f64]| {
        Table::list(&format!("/modes/{place}/{name}"), units, text, values.to_vec())
    };
    let text = "Frequencies of the free-interface modes, ascending; 0 is a rigid-body mode.";
    let mut tables = vec![list("frequency", "Hz", text, frequency)];
    // What is solved densely has no residuals of its own.
    if residual.len() == frequency.len() {
        let text = "Residual |Kx - w²Mx| / (|w² - s| |Mx|) of each mode, with the shift s.";
        tables.push(list("residual", "1", text, residual));
    }
    tables
}

/// Nodal diameters of modes that have names.
fn orders(place: &str, names: &[ModeName]) -> Option<Table> {
    let values: Vec<f64> = names.iter().map(|n| f64::from(n.order)).collect();
    let text = "Nodal diameters of each mode at rest; waves on the length of a rail.";
    (!names.is_empty()).then(|| Table::list(&format!("/modes/{place}/diameters"), "1", text, values))
}

/// What of the modes moves most, where it is known.
fn families(place: &str, names: &[ModeName]) -> Option<Table> {
    let text = "What of each mode moves most, numbered from 0 by frequency within a number of diameters.";
    let values: Vec<String> = names.iter().map(|n| n.family.clone()).collect();
    (!names.is_empty()).then(|| Table::list(&format!("/modes/{place}/family"), "-", text, values))
}

fn summarise(name: &str, (frequency, names): (&[f64], &[ModeName]), summary: &mut Summary) {
    let rigid = frequency.iter().filter(|&&f| f == 0.0).count();
    let called = |k: usize| names.get(k).map_or(String::new(), |n| format!(" {n}"));
    let elastic: Vec<String> =
        (rigid..frequency.len()).take(6).map(|k| format!("{:.2}{}", frequency[k], called(k))).collect();
    let of = if rigid > 0 { format!("{} ({rigid} rigid)", frequency.len()) } else { frequency.len().to_string() };
    summary.value(&format!("modes of {name}"), format!("{of}; Hz: {} ...", elastic.join(", ")));
}
