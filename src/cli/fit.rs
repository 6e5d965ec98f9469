//! `railsqueal fit JOB --decay FILE.csv`: the track of a job, fitted to measured decay rates.

use super::args::{beside, TrackFitOptions};
use railsqueal::analysis::track_fit::{fit, lines, track_key, MeasuredDecay};
use railsqueal::job::{self, Job};
use railsqueal::parallel::World;
use railsqueal::progress::Progress;
use railsqueal::{Error, Result};
use std::path::Path;

/// Collective: fits the track of the job at `path` to the decay rates of a file, in the `bands` that are named; writes
/// the job with the fitted values beside it, and returns what is to be printed.
///
/// # Errors
/// Wrong options, job or table; no convergence; a job that cannot be written.
pub fn track(world: &World, path: &Path, bands: &[String], options: &TrackFitOptions) -> Result<String> {
    let Some(file) = &options.decay else { return Err(Error::Defect("a fit without decay rates".into())) };
    let bands = bands.iter().map(|text| band(text)).collect::<Result<Vec<_>>>()?;
    let keys = options.key.iter().map(|name| track_key(name.trim())).collect::<Result<Vec<_>>>()?;
    let target = beside(path)?.with_file_name(format!("{}-fit.json", path.file_stem().unwrap_or_default().display()));
    let bytes = world.broadcast(world.on_root(|| job::read_file(path))?.unwrap_or_default());
    let job = world.agree(Job::from_bytes(&bytes, path, &options.sets, None))?;
    let measured = world.agree(MeasuredDecay::read(file, &bands))?;
    let mut progress = Progress::new(world.is_root());
    let found = fit(world, &job, &measured, &keys, &mut progress)?;
    let text = job::with_numbers(&bytes, path, &options.sets, &found.numbers())?;
    let written = || std::fs::write(&target, &text);
    world.on_root(|| written().map_err(|e| Error::Io(format!("cannot write {}: {e}", target.display()))))?;
    let directions: Vec<&str> = measured.directions.iter().map(|(name, _)| *name).collect();
    let (first, last) = (measured.nominal[0], measured.nominal[measured.nominal.len() - 1]);
    let mut text = format!(
        "{}: decay rates ({}) of {} bands from {first} to {last} Hz\n",
        measured.name,
        directions.join(", "),
        measured.nominal.len()
    );
    if !measured.left_out.is_empty() {
        let names: Vec<String> = measured.left_out.iter().map(|f| f.to_string()).collect();
        text += &format!("left out: {} Hz\n", names.join(", "));
    }
    lines(&found).iter().for_each(|line| text += &format!("{line}\n"));
    Ok(text + &format!("{}\n", target.display()))
}

/// The ends of `250,5000`, Hz.
fn band(text: &str) -> Result<[f64; 2]> {
    let ends: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match ends.as_deref() {
        Some([low, high]) if 0.0 < *low && low <= high && high.is_finite() => Ok([*low, *high]),
        _ => Err(Error::Job(format!("--band: found \"{text}\", expected two frequencies in Hz such as 250,5000"))),
    }
}
