//! The analysis `track_decay`: decay rates of the track of a rail by EN 15461, tables under `/track_decay`.

use super::run::Run;
use crate::case::rail::{endless, EndlessRail};
use crate::job::TrackDecay;
use crate::output::datasets::track_decay::{tables, DirectionalDecay};
use crate::sound::Bands;
use crate::swept::track_decay::{decay_rate, lowest_rate, POSITIONS};
use crate::swept::Infinite;
use crate::{Error, Result};
use std::f64::consts::PI;

/// Bands of the standard, Hz.
const BANDS: [f64; 2] = [250.0, 5000.0];
/// Forces of [`Infinite::along`] that are examined: normal, which is vertical in the upright frame, and lateral.
const FORCES: [(usize, &str); 2] = [(2, "vertical"), (1, "lateral")];

/// Collective: decay rates of the rail of the job, vertical and lateral; the ranks share the bands.
pub fn run(run: &mut Run) -> Result<()> {
    let Some(wanted) = &run.job.analyses.track_decay else { return Ok(()) };
    run.progress.stage("track decay rates");
    let world = run.world();
    let Some(found) = world.agree(endless(run.job, BANDS[1] * 1.13))? else {
        return Err(Error::Defect("track decay rates without a rail".into()));
    };
    let EndlessRail { name, rail, spacing } = found;
    let spacing = wanted.spacing.unwrap_or(spacing);
    let bands = Bands::spanning(BANDS[0], BANDS[1]);
    let positions: Vec<f64> = POSITIONS.iter().map(|bay| bay * spacing).collect();
    let mine = squares(&rail, wanted, &positions, (&bands, world.rank, world.size));
    let mine = world.agree(mine.map_err(|e| e.context(format!("bodies.{name}.track"))))?;
    let all = world.sum_all(&mine);
    if !world.is_root() {
        return Ok(());
    }
    let (count, size) = (bands.nominal().len(), positions.len());
    let directions: Vec<DirectionalDecay> = FORCES
        .iter()
        .zip(all.chunks_exact(count * size))
        .map(|((_, name), squares)| DirectionalDecay {
            name,
            rate: squares.chunks_exact(size).map(|band| decay_rate(band, &positions)).collect(),
            response: squares.chunks_exact(size).flat_map(|b| b.iter().map(|a| (a / b[0]).sqrt())).collect(),
        })
        .collect();
    let least = lowest_rate(positions[size - 1]);
    for direction in &directions {
        let at = |f: f64| bands.nominal().iter().position(|b| *b == f).map_or(f64::NAN, |k| direction.rate[k]);
        let [a, b, c] = [500.0, 1000.0, 2000.0].map(at);
        run.summary.line(format!(
            "track decay rate (EN 15461) of body {name}, {}: {a:.2} dB/m at 500 Hz, {b:.2} at 1000 Hz, {c:.2} at \
             2000 Hz",
            direction.name
        ));
        let names = bands.nominal();
        let low: Vec<String> =
            names.iter().zip(&direction.rate).filter(|(_, r)| **r < 2.0 * least).map(|(f, _)| f.to_string()).collect();
        if !low.is_empty() {
            run.summary.line(format!(
                "  {} below {:.2} dB/m, which the standard's positions up to {:.1} m cannot tell: {} Hz",
                direction.name,
                2.0 * least,
                positions[size - 1],
                low.join(", ")
            ));
        }
    }
    run.file.tables(tables(&bands.nominal(), &positions, least, &directions));
    Ok(())
}

/// Means of |velocity per force|² over each band at the positions, `[2, bands, positions]`: those of the bands
/// of rank `rank` of `size`, 0 for the others.
fn squares(
    rail: &Infinite,
    wanted: &TrackDecay,
    positions: &[f64],
    (bands, rank, size): (&Bands, usize, usize),
) -> Result<Vec<f64>> {
    // The hammer stands beside the accelerometer for the direct response.
    let at: Vec<f64> = positions.iter().map(|x| x.max(wanted.offset)).collect();
    let centres = bands.centres();
    let mut sums = vec![0.0; FORCES.len() * centres.len() * at.len()];
    let half = 10f64.powf(0.05);
    let lines = wanted.lines as usize;
    let jobs = centres.iter().enumerate().flat_map(|(band, centre)| (0..lines).map(move |k| (band, *centre, k)));
    // Bands are of one rank each: sums are the same on any number of them.
    for (band, centre, k) in jobs.filter(|(band, ..)| band % size == rank) {
        let (low, high) = (centre / half, centre * half);
        let omega = 2.0 * PI * (low + (high - low) * (k as f64 + 0.5) / lines as f64);
        let moved = rail.along(omega, &FORCES.map(|(force, _)| force), &at)?;
        for (d, response) in moved.iter().enumerate() {
            for (n, h) in response.iter().enumerate() {
                sums[(d * centres.len() + band) * at.len() + n] += omega * omega * h.norm_sqr() / lines as f64;
            }
        }
    }
    Ok(sums)
}
