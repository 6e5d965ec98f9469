//! The analysis `modes`: free-interface modes of each body.

use super::run::Run;
use crate::body::modes::Extent;
use crate::body::{ElasticBody, Kind, ModeLabel, Side, TraceModes};
use crate::case::bodies::BuiltBodies;
use crate::case::display_modes::Pictures;
use crate::case::rail;
use crate::job::{Job, ModesExtent};
use crate::model::{measure, shifts, speeds, waves, ModalRotation, RotatingWave};
use crate::output::{companion, write_modes, BodyPart, SequenceFile, Table};
use crate::parallel::World;
use crate::progress::Progress;
use crate::summary::Summary;
use crate::Result;
use faer::Mat;
use std::path::Path;

/// Collective: modes of each of [`BuiltBodies::unique`]; none where the job asks for none.
pub fn compute_all(job: &Job, bodies: &mut BuiltBodies, progress: &mut Progress) -> Result<Vec<TraceModes>> {
    let Some(wanted) = &job.analyses.modes else { return Ok(Vec::new()) };
    let extent = match wanted.extent() {
        ModesExtent::Count(n) => Extent::Count(n),
        ModesExtent::MaxFrequency(f) => Extent::MaxFrequency(f),
    };
    let mut all = Vec::new();
    for body in &mut bodies.unique {
        progress.stage(format!("modes, body {}", body.name()));
        let mut modes = body.modes(extent, &mut |done, of| progress.converged("modes", done, of))?;
        // Coordinates of the result file in place of those of the lower form.
        let mirrored = body.kind() == Kind::Elements && body.name() == Side::Upper.name();
        measure(job, body.name(), &mut modes, &mut |points| of_places(body.as_ref(), points, mirrored))?;
        all.push(modes);
    }
    Ok(all)
}

/// Collective: the modes of a `body` at `points` of a job, `[3p, m]`, of which those of a `mirrored` one have z the
/// other way.
fn of_places(body: &dyn ElasticBody, points: &[[f64; 3]], mirrored: bool) -> Result<Option<Mat<f64>>> {
    let sign = |c: usize| if mirrored { Side::Upper.reflection(c) } else { 1.0 };
    let own: Vec<[f64; 3]> = points.iter().map(|p| [0, 1, 2].map(|c| sign(c) * p[c])).collect();
    let found = body.modes_at(&own)?;
    Ok(found.map(|all| Mat::from_fn(all.nrows(), all.ncols(), |i, k| sign(i % 3) * all[(i, k)])))
}

/// On rank 0: the tables of the `modes` of the bodies that differ, for every place, which names the index of its body.
pub fn list(run: &mut Run, places: &[(&'static str, usize)], modes: &[TraceModes]) -> Result<()> {
    for &(place, body) in places {
        let Some(modes) = modes.get(body) else { continue };
        // Beside a body given by matrices there may be a rigid one.
        if run.job.by_matrices() && !run.job.bodies().iter().any(|(name, _)| *name == place) {
            continue;
        }
        let frequency = modes.frequency();
        run.file.tables(tables(place, &frequency, &modes.residual));
        if modes.rotation.is_none() {
            run.file.tables(orders(place, &modes.names));
        }
        run.file.tables(families(place, &modes.names));
        run.file.tables(validity(run, place)?);
        if let Some(rotation) = &modes.rotation {
            rotating(run, place, modes, rotation)?;
        }
        if places.iter().find(|p| p.1 == body).is_some_and(|first| first.0 == place) {
            summarise(place, (&frequency, &modes.names), &mut run.summary);
            shifts(modes).into_iter().for_each(|text| run.summary.value(&format!("  measured on {place}"), text));
        }
    }
    Ok(())
}

/// Collective: the shapes of the `modes` of the bodies that differ as a sequence that goes with the result file,
/// where fields are wanted.
pub fn show(run: &mut Run, bodies: &BuiltBodies, modes: &[TraceModes]) -> Result<()> {
    let path = companion(&run.options.output, "free_modes.vtkhdf");
    if run.job.output.swept_modes == Some(true) {
        return show_swept(run, &path, bodies, modes);
    }
    if !run.job.output.fields || modes.is_empty() || !bodies.on_meshes() {
        return Ok(());
    }
    run.progress.stage("writing mode shapes");
    let places: Vec<usize> = bodies.places.iter().map(|p| p.body).collect();
    let how = (run.replaces(), true);
    let shapes = sequence(run.world(), &path, how, bodies, (&bodies.parts(), &places), modes)?;
    run.file.attach(shapes)
}

/// Collective: the shapes of the modes of wheels that are swept from a section; a rail has hundreds of waves.
fn show_swept(run: &mut Run, path: &Path, bodies: &BuiltBodies, modes: &[TraceModes]) -> Result<()> {
    let world = run.world();
    let pictures = Pictures::new(world, bodies, |kind| kind == Kind::Swept);
    if pictures.is_empty() || modes.is_empty() {
        return Ok(());
    }
    run.progress.stage("writing mode shapes");
    let frequencies: Vec<Vec<f64>> = pictures.bodies().into_iter().map(|body| modes[body].frequency()).collect();
    let mode = |picture: usize, k: usize| Ok(pictures.mode(picture, k));
    let shapes = write_modes(world, path, (run.replaces(), true), &pictures.parts(), &frequencies, mode)?;
    run.file.attach(shapes)
}

/// Collective: the shapes of the bodies that differ in double precision, for a run that takes them up where this one
/// does not come to its end.
pub fn kept_shapes<'w>(run: &Run<'w>, bodies: &BuiltBodies, modes: &[TraceModes]) -> Result<SequenceFile<'w>> {
    let first = |body: usize| bodies.places.iter().position(|p| p.body == body);
    let (parts, all) = (bodies.parts(), 0..bodies.unique.len());
    let parts: Vec<BodyPart> = all.clone().filter_map(|body| parts.get(first(body)?).copied()).collect();
    let petsc = run.petsc;
    sequence(petsc.world(), &run.file.shapes(), (true, false), bodies, (&parts, &all.collect::<Vec<_>>()), modes)
}

/// Collective: shapes of the modes as a sequence; `parts` with the index of the body of each.
fn sequence<'w>(
    world: &'w World,
    path: &Path,
    how: (bool, bool),
    bodies: &BuiltBodies,
    (parts, places): (&[BodyPart], &[usize]),
    modes: &[TraceModes],
) -> Result<SequenceFile<'w>> {
    let frequencies: Vec<Vec<f64>> = places.iter().map(|&body| modes[body].frequency()).collect();
    write_modes(world, path, how, parts, &frequencies, |b, k| {
        Ok(bodies.fields(places[b])?.at_nodes(&bodies.shapes_of(places[b])?.vectors[k]).into_flattened())
    })
}

/// Collective: the frequencies and residuals of modes that rank 0 has go to all ranks.
pub fn broadcast(world: &World, modes: Option<Vec<TraceModes>>) -> Vec<TraceModes> {
    let counts = world.broadcast(modes.iter().flatten().map(|m| m.omega.len() as u64).collect::<Vec<u64>>());
    let of = |what: fn(&TraceModes) -> &Vec<f64>| {
        let list: Vec<Vec<f64>> = match &modes {
            Some(modes) => modes.iter().map(|m| what(m).clone()).collect(),
            None => vec![Vec::new(); counts.len()],
        };
        list.into_iter().map(|values| world.broadcast(values)).collect::<Vec<_>>()
    };
    let (omega, residual) = (of(|m| &m.omega), of(|m| &m.residual));
    let elsewhere = || omega.into_iter().zip(residual);
    modes.unwrap_or_else(|| {
        elsewhere().map(|(omega, residual)| TraceModes { omega, residual, ..TraceModes::default() }).collect()
    })
}

/// Nodal diameters of the modes of a body that rotates, and its waves.
fn rotating(run: &mut Run, place: &str, modes: &TraceModes, rotation: &ModalRotation) -> Result<()> {
    let speed = run.job.angular_velocity(place);
    let side = Side::named(place)?;
    let speeds = speeds(run.job, side, &modes.names, modes.omega.len());
    let list = |name: &str, units: &str, text: &str, values: Vec<f64>| {
        Table::list(&format!("/modes/{place}/{name}"), units, text, values)
    };
    let waves = waves(&modes.omega, rotation, &speeds)?;
    let speed_text = "Angular velocity of the body; positive if its material passes the contact towards +x.";
    if speeds.iter().any(|of| *of != speed) {
        let text = "Angular velocity of the body of each mode, of several bodies around one.";
        run.file.tables([list("angular_velocities", "rad/s", text, speeds.clone())]);
    }
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
    if waves.is_empty() {
        return Ok(());
    }
    let named = |w: &RotatingWave| format!("{:.2} ({:+.0})", w.frequency, w.diameters);
    let listed: Vec<String> = waves.iter().take(6).map(named).collect();
    run.summary.value(
        &format!("waves at {} rad/s", distinct(&speeds)),
        format!("Hz (nodal diameters, + with the rotation): {} ...", listed.join(", ")),
    );
    Ok(())
}

/// Angular velocities in words, each once, in the order of the modes.
fn distinct(speeds: &[f64]) -> String {
    let mut all: Vec<String> = Vec::new();
    for speed in speeds.iter().map(|speed| format!("{speed:.3}")) {
        if !all.contains(&speed) {
            all.push(speed);
        }
    }
    all.join(", ")
}

/// Collective: on rank 0 the frequency from which on a rail is one of infinite length, of a body that is a rail.
fn validity(run: &Run, place: &str) -> Result<Option<Table>> {
    let bodies = run.job.bodies();
    let Some((_, body)) = bodies.into_iter().find(|(name, _)| *name == place) else { return Ok(None) };
    let from = run.world().on_root(|| rail::endless_from(body))?.flatten();
    let text =
        "Frequency from which on the longitudinal receptance of the rail is that of an infinite one within 10 %; \
                below it modes depend on its length and its ends.";
    Ok(from.map(|from| Table::scalar(&format!("/modes/{place}/infinite_from"), "Hz", text, from)))
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
fn orders(place: &str, names: &[ModeLabel]) -> Option<Table> {
    let values: Vec<f64> = names.iter().map(|n| f64::from(n.order)).collect();
    let text = "Nodal diameters of each mode at rest; waves on the length of a rail.";
    (!names.is_empty()).then(|| Table::list(&format!("/modes/{place}/diameters"), "1", text, values))
}

/// Component with the largest motion in each mode, where it is known.
fn families(place: &str, names: &[ModeLabel]) -> Option<Table> {
    let text =
        "Part of the body that moves most in each mode, numbered from 0 by frequency within a number of diameters.";
    let values: Vec<String> = names.iter().map(|n| n.family.clone()).collect();
    (!names.is_empty()).then(|| Table::list(&format!("/modes/{place}/family"), "-", text, values))
}

fn summarise(name: &str, (frequency, names): (&[f64], &[ModeLabel]), summary: &mut Summary) {
    let rigid = frequency.iter().filter(|&&f| f == 0.0).count();
    let called = |k: usize| names.get(k).map_or(String::new(), |n| format!(" {n}"));
    let elastic: Vec<String> =
        (rigid..frequency.len()).take(6).map(|k| format!("{:.2}{}", frequency[k], called(k))).collect();
    let of = if rigid > 0 { format!("{} ({rigid} rigid)", frequency.len()) } else { frequency.len().to_string() };
    summary.value(&format!("modes of {name}"), format!("{of}; Hz: {} ...", elastic.join(", ")));
}
