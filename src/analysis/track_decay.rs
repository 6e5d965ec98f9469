//! The analysis `track_decay`: decay rates of the track of a rail by EN 15461, tables under `/track_decay`.

use super::run::Run;
use crate::case::endless_rail::{endless, EndlessRail};
use crate::job::TrackDecay;
use crate::output::datasets::track_decay::{tables, DirectionalDecay};
use crate::sound::Bands;
use crate::swept::infinite::TrackSlope;
use crate::swept::track_decay::{decay_rate, lowest_rate, POSITIONS};
use crate::swept::Infinite;
use crate::{Error, Result};
use std::f64::consts::PI;

/// Bands of the standard, Hz.
const BANDS: [f64; 2] = [250.0, 5000.0];
/// Highest frequency of the bands, Hz, and a little more.
pub(super) const REACH: f64 = BANDS[1] * 1.13;
/// Forces of [`Infinite::along`] that are examined: normal, which is vertical in the upright frame, and lateral.
pub(super) const FORCES: [(usize, &str); 2] = [(2, "vertical"), (1, "lateral")];

/// Collective: decay rates of the rail of the job, vertical and lateral; the ranks share the bands.
pub fn run(run: &mut Run) -> Result<()> {
    let Some(wanted) = &run.job.analyses.track_decay else { return Ok(()) };
    run.progress.stage("track decay rates");
    let world = run.world();
    let Some(found) = world.agree(endless(run.job, REACH))? else {
        return Err(Error::Defect("track decay rates without a rail".into()));
    };
    let EndlessRail { name, rail, spacing, .. } = found;
    let spacing = wanted.spacing.unwrap_or(spacing);
    let bands = Bands::spanning(BANDS[0], BANDS[1]);
    let positions: Vec<f64> = POSITIONS.iter().map(|bay| bay * spacing).collect();
    let centres = bands.centres();
    // Bands are of one rank each: sums are the same on any number of them.
    let own = |band: usize| band % world.size == world.rank;
    let forces = FORCES.map(|(force, _)| force);
    let mine =
        mean_squares(&rail, wanted, &positions, &WantedBands { centres: &centres, own: &own, forces: &forces }, &[]);
    let mine = world.agree(mine.map_err(|e| e.context(format!("bodies.{name}.track"))))?;
    let all = world.sum_all(&mine.values);
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

/// Forces and bands whose responses are wanted.
pub(super) struct WantedBands<'a> {
    /// Centres of all bands, Hz.
    pub centres: &'a [f64],
    /// Returns whether a band is this rank's.
    pub own: &'a dyn Fn(usize) -> bool,
    /// Forces of [`Infinite::along`].
    pub forces: &'a [usize],
}

/// Means of |velocity per force|² over each band at the positions, `[forces, bands, positions]`, and their derivatives
/// by the parameters `slopes`, `[slopes]` of the same; 0 for bands of other ranks.
pub(super) fn mean_squares(
    rail: &Infinite,
    wanted: &TrackDecay,
    positions: &[f64],
    lines: &WantedBands,
    slopes: &[TrackSlope],
) -> Result<MeanSquares> {
    // The hammer stands beside the accelerometer for the direct response.
    let at: Vec<f64> = positions.iter().map(|x| x.max(wanted.offset)).collect();
    let (centres, forces) = (lines.centres, lines.forces);
    let size = forces.len() * centres.len() * at.len();
    let mut sums = MeanSquares { values: vec![0.0; size], slopes: vec![vec![0.0; size]; slopes.len()] };
    let half = 10f64.powf(0.05);
    let count = wanted.lines as usize;
    let jobs = centres.iter().enumerate().flat_map(|(band, centre)| (0..count).map(move |k| (band, *centre, k)));
    for (band, centre, k) in jobs.filter(|(band, ..)| (lines.own)(*band)) {
        let (low, high) = (centre / half, centre * half);
        let omega = 2.0 * PI * (low + (high - low) * (k as f64 + 0.5) / count as f64);
        let weight = omega * omega / count as f64;
        for (d, moved) in rail.along_slopes(omega, forces, &at, slopes)?.iter().enumerate() {
            let first = (d * centres.len() + band) * at.len();
            for (n, h) in moved.response.iter().enumerate() {
                sums.values[first + n] += weight * h.norm_sqr();
                for (sum, slope) in sums.slopes.iter_mut().zip(&moved.slopes) {
                    sum[first + n] += weight * 2.0 * (h.conj() * slope[n]).re;
                }
            }
        }
    }
    Ok(sums)
}

/// Means of |velocity per force|².
pub(super) struct MeanSquares {
    /// `[forces, bands, positions]`.
    pub values: Vec<f64>,
    /// Derivatives, `[parameters]` of the same.
    pub slopes: Vec<Vec<f64>>,
}
