//! Pads and ballast of a track, fitted to measured decay rates.
//!
//! The fit minimises Σ (ln D(θ) − ln D_measured)² over bands and directions; θ are the logarithms of keys of the track
//! and D the decay rates of the analysis `track_decay`. Logarithms, since a rail radiates from a length that goes
//! with 1/D: equal differences are equal differences of its sound power, dB. The derivatives ∂ ln D/∂θ are those of the
//! waves in closed form. The motions of the section are made for the track at the beginning; with the fitted track
//! they are made anew, until the keys stay.

mod least_squares;
mod measured;
mod report;

pub use measured::MeasuredDecay;
pub use report::lines;

use super::track_decay::{mean_squares, WantedBands, FORCES, REACH};
use crate::case::endless_rail::{endless, EndlessRail, TrackKey};
use crate::job::{Job, Track, TrackDecay};
use crate::parallel::World;
use crate::progress::Progress;
use crate::swept::track_decay::{decay_rate, log_slope, lowest_rate, POSITIONS};
use crate::{Error, Result};
use least_squares::{least_squares, Evaluation, Minimum};

/// A key has no effect if no logarithm of a rate moves by more than this part of its own logarithm; so has a band on
/// which no key has more.
const EFFECT: f64 = 0.02;
/// Largest ratio between a fitted value and that of the job, either way.
const FARTHEST: f64 = 100.0;
/// Stiffness with which other fits begin, over that of the job: the sum of squares may have several minima.
const STARTS: [f64; 2] = [0.2, 5.0];
/// Stiffness over that of the job at which the rates are looked at to begin with the best of each direction.
const LOOKED_AT: [f64; 6] = [0.125, 0.25, 0.5, 2.0, 4.0, 8.0];
/// Longest steps, of a logarithm, that end a fit: one from another start, and the last ones.
const NEAR: f64 = 1e-3;
const SHORT: f64 = 1e-5;
/// Change with new motions of the section that ends all fits, of a logarithm and in standard deviations.
const STAYS: f64 = 1e-4;
const STAYS_WITHIN: f64 = 0.05;
/// Difference of a logarithm between two minima that are not the same; and how much worse one is that is told, dB.
const APART: f64 = 0.1;
const TOLD: f64 = 1.0;
/// Most times that the motions of the section are made.
const ROUNDS: usize = 6;

/// A key with its fitted value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedKey {
    /// The key.
    pub key: TrackKey,
    /// Value in the job.
    pub before: f64,
    /// Fitted value.
    pub fitted: f64,
    /// Standard deviation of its logarithm.
    pub deviation: f64,
    /// True if it ended at the farthest value that is looked at.
    pub bound: bool,
}

/// Decay rates of one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedDirection {
    /// `vertical` or `lateral`.
    pub name: &'static str,
    /// Measured rates, dB/m, `[b]`.
    pub measured: Vec<f64>,
    /// Fitted rates, dB/m, `[b]`.
    pub fitted: Vec<f64>,
    /// Bands, Hz, on which no key has an effect.
    pub without_effect: Vec<f64>,
}

/// A track fitted to measured decay rates.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackFit {
    /// Body that is the rail.
    pub body: &'static str,
    /// Keys that were fitted.
    pub keys: Vec<FittedKey>,
    /// Keys without an effect on any band, which keep their values.
    pub held: Vec<TrackKey>,
    /// Correlations of the keys, `[keys][keys]`.
    pub correlation: Vec<Vec<f64>>,
    /// Bands, Hz.
    pub bands: Vec<f64>,
    /// Rates of the directions.
    pub directions: Vec<FittedDirection>,
    /// Root mean square of 10 lg of fitted over measured rates, dB: of the job, and of the fit.
    pub residual: [f64; 2],
    /// Other minima, from other starts: values of the keys, and root mean square, dB.
    pub others: Vec<(Vec<f64>, f64)>,
    /// Lowest rate that the positions can tell, dB/m.
    pub least: f64,
}

/// The key of a name below the track.
pub fn track_key(name: &str) -> Result<TrackKey> {
    let known = TrackKey::ALL.map(|(_, path)| path);
    TrackKey::ALL.into_iter().find(|(_, path)| *path == name).map(|(key, _)| key).ok_or_else(|| {
        Error::Job(format!("--key: found \"{name}\", expected a key below bodies.*.track: {}", known.join(", ")))
    })
}

/// Keys that are fitted where none are named: the pads, in the directions that were measured.
fn usual_keys(measured: &MeasuredDecay) -> Vec<TrackKey> {
    let usual = [TrackKey::PadVertical, TrackKey::PadLateral, TrackKey::PadLoss];
    usual.into_iter().filter(|key| is_measured(*key, measured)).collect()
}

fn is_measured(key: TrackKey, measured: &MeasuredDecay) -> bool {
    key.direction().is_none_or(|wanted| measured.directions.iter().any(|(name, _)| *name == wanted))
}

/// The keys that are fitted, with their values in the job.
fn starts(job: &Job, measured: &MeasuredDecay, wanted: &[TrackKey]) -> Result<(Track, Vec<(TrackKey, f64)>)> {
    let rails = job.bodies().into_iter().filter(|(_, body)| crate::case::rail::extruded(body).is_some());
    let Some((name, body)) = rails.into_iter().next() else {
        return Err(Error::Defect("a fit of decay rates without a rail".into()));
    };
    let track = body.track.clone().unwrap_or_default();
    let keys = if wanted.is_empty() { usual_keys(measured) } else { wanted.to_vec() };
    let mut starts: Vec<(TrackKey, f64)> = Vec::new();
    for key in keys {
        let path = key.path();
        if let (false, Some(direction)) = (is_measured(key, measured), key.direction()) {
            return Err(Error::Job(format!(
                "--key {path}: found no column {direction} in {}, without which it cannot be told; add the column, or \
                 leave the key out",
                measured.name
            )));
        }
        let value = key.value(&track).ok_or_else(|| {
            Error::Job(format!(
                "--key {path}: found no bodies.{name}.track.sleeper, expected one on ballast; add it to the job, or \
                 leave the key out"
            ))
        })?;
        if !(value > 0.0) {
            return Err(Error::Job(format!(
                "bodies.{name}.track.{path}: found {value}, expected a value above 0 to begin with, as its logarithm \
                 is fitted; set one by --set bodies.{name}.track.{path}=0.1"
            )));
        }
        if !starts.iter().any(|(known, _)| *known == key) {
            starts.push((key, value));
        }
    }
    let rates = measured.nominal.len() * measured.directions.len();
    if rates <= starts.len() {
        return Err(Error::Job(format!(
            "--key: found {} keys to be fitted to {rates} decay rates of {}, expected more rates than keys; name fewer \
             keys, or measure more bands",
            starts.len(),
            measured.name
        )));
    }
    Ok((track, starts))
}

/// Decay rates and their residuals on one track.
struct Rates {
    /// dB/m, `[directions · bands]`.
    rates: Vec<f64>,
    evaluation: Evaluation,
}

/// Rail, measured rates and keys of a fit.
struct Problem<'a> {
    world: &'a World,
    wanted: &'a TrackDecay,
    rail: EndlessRail,
    track: Track,
    measured: &'a MeasuredDecay,
    keys: Vec<TrackKey>,
    positions: Vec<f64>,
}

impl Problem<'_> {
    /// The track with the logarithms `theta` of the keys.
    fn track(&self, theta: &[f64]) -> Track {
        let mut track = self.track.clone();
        self.keys.iter().zip(theta).for_each(|(key, value)| key.set(&mut track, value.exp()));
        track
    }

    /// Collective: rates on the track with the logarithms `theta`; the ranks share the bands.
    fn rates(&self, theta: &[f64]) -> Result<Rates> {
        let track = self.track(theta);
        let slopes = self.rail.log_slopes(&track, &self.keys);
        let names = self.measured.directions.iter().map(|(name, _)| *name);
        let forces: Vec<usize> =
            names.filter_map(|name| FORCES.iter().find(|(_, known)| *known == name).map(|(force, _)| *force)).collect();
        let own = |band: usize| band % self.world.size == self.world.rank;
        let lines = WantedBands { centres: &self.measured.centre, own: &own, forces: &forces };
        let mine = mean_squares(&self.rail.on_track(&track), self.wanted, &self.positions, &lines, &slopes);
        let mine = self.world.agree(mine.map_err(|e| e.context(format!("bodies.{}.track", self.rail.name))))?;
        let squares = self.world.sum_all(&mine.values);
        let changes: Vec<Vec<f64>> = mine.slopes.iter().map(|slopes| self.world.sum_all(slopes)).collect();
        let size = self.positions.len();
        let rates: Vec<f64> = squares.chunks_exact(size).map(|band| decay_rate(band, &self.positions)).collect();
        let measured = self.measured.directions.iter().flat_map(|(_, rates)| rates);
        let row = |(k, band): (usize, &[f64])| {
            let of = |change: &Vec<f64>| log_slope(band, &change[k * size..(k + 1) * size], &self.positions);
            changes.iter().map(of).collect()
        };
        let evaluation = Evaluation {
            residuals: rates.iter().zip(measured).map(|(rate, measured)| (rate / measured).ln()).collect(),
            jacobian: squares.chunks_exact(size).enumerate().map(row).collect(),
        };
        Ok(Rates { rates, evaluation })
    }

    /// Collective: evaluates the residuals, and says their root mean square.
    fn evaluated(&self, theta: &[f64], progress: &Progress) -> Result<Evaluation> {
        let evaluation = self.rates(theta)?.evaluation;
        progress.note(format!("difference of the rates {:.3} dB", decibels(&evaluation)));
        Ok(evaluation)
    }

    /// The logarithms `theta` with all stiffness times `factor`.
    fn stiffer(&self, theta: &[f64], factor: f64) -> Vec<f64> {
        let start = |(key, value): (&TrackKey, &f64)| value + if key.unit().is_empty() { 0.0 } else { factor.ln() };
        self.keys.iter().zip(theta).map(start).collect()
    }

    /// Collective: the logarithms `theta` with the stiffness of each direction times that of [`LOOKED_AT`] with which
    /// its rates are nearest to the measured ones.
    fn scanned(&self, theta: &[f64], progress: &Progress) -> Result<Vec<f64>> {
        let size = self.measured.nominal.len();
        let mut best = vec![(f64::INFINITY, 1.0); self.measured.directions.len()];
        for factor in LOOKED_AT.into_iter().chain([1.0]) {
            let evaluation = match self.evaluated(&self.stiffer(theta, factor), progress) {
                Err(Error::NotConverged(_)) => continue,
                found => found?,
            };
            for (best, residuals) in best.iter_mut().zip(evaluation.residuals.chunks_exact(size)) {
                let sum: f64 = residuals.iter().map(|r| r * r).sum();
                if sum < best.0 {
                    *best = (sum, factor);
                }
            }
        }
        let factor = |key: &TrackKey| {
            let of = |(name, _): &(&str, Vec<f64>)| key.direction() == Some(name);
            self.measured.directions.iter().position(of).map_or(1.0, |d| best[d].1)
        };
        Ok(self.keys.iter().zip(theta).map(|(key, value)| value + factor(key).ln()).collect())
    }

    /// Collective: minima from the logarithms `theta` on, and from other tracks, the latter where they converge.
    fn minima(&self, theta: &[f64], bounds: &[[f64; 2]], progress: &Progress) -> Result<Vec<Minimum>> {
        let from = |start: Vec<f64>| least_squares(start, bounds, NEAR, |at| self.evaluated(at, progress));
        let [softer, stiffer] = STARTS.map(|factor| self.stiffer(theta, factor));
        let (mut found, mut failed) = (Vec::new(), None);
        for start in [theta.to_vec(), softer, stiffer, self.scanned(theta, progress)?] {
            match from(start) {
                Ok(minimum) => found.push(minimum),
                Err(Error::NotConverged(text)) => failed = failed.or(Some(Error::NotConverged(text))),
                Err(error) => return Err(error),
            }
        }
        failed.filter(|_| found.is_empty()).map_or(Ok(found), Err)
    }

    /// Collective: the minimum near `theta` with motions of the section that were made for the track there.
    fn until_it_stays(
        mut self,
        job: &Job,
        mut theta: Vec<f64>,
        bounds: &[[f64; 2]],
        progress: &Progress,
    ) -> Result<(Self, Minimum)> {
        let mut moved = f64::INFINITY;
        for _ in 0..ROUNDS {
            let track = self.track(&theta);
            self = self.renewed(job, track)?;
            let found = least_squares(theta.clone(), bounds, SHORT, |at| self.evaluated(at, progress))?;
            let covariance = found.there.covariance(theta.len())?;
            let stays = |k: usize| {
                let step = (found.parameters[k] - theta[k]).abs();
                step < STAYS.max(STAYS_WITHIN * covariance[k][k].sqrt())
            };
            if (0..theta.len()).all(stays) {
                return Ok((self, found));
            }
            moved = distance(&found.parameters, &theta);
            theta = found.parameters;
        }
        Err(Error::NotConverged(format!(
            "the fit to {}: found keys that still move by {moved:.1e} of themselves with new motions of the section, \
             expected {STAYS:.0e} or a twentieth of their deviations; fit fewer keys, or begin elsewhere by --set",
            self.measured.name
        )))
    }

    /// Collective: the rail with motions of its section for another track of its own.
    fn renewed(self, job: &Job, track: Track) -> Result<Self> {
        let mut job = job.clone();
        if let Some(body) = match self.rail.name {
            "lower" => job.bodies.lower.as_mut(),
            _ => job.bodies.upper.as_mut(),
        } {
            body.track = Some(track.clone());
        }
        let rail = self.world.agree(rail(&job))?;
        Ok(Self { rail, track, ..self })
    }
}

fn rail(job: &Job) -> Result<EndlessRail> {
    endless(job, REACH)?.ok_or_else(|| Error::Defect("a fit of decay rates without a rail".into()))
}

/// Returns the largest effect of each key on a logarithm of a rate.
fn effects(evaluation: &Evaluation, keys: usize) -> Vec<f64> {
    (0..keys).map(|k| evaluation.jacobian.iter().map(|row| row[k].abs()).fold(0.0, f64::max)).collect()
}

/// Largest difference of two sets of logarithms.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Values and root mean squares of the minima that are not `best` and nearly as good, each once.
fn other_minima(minima: &[Minimum], best: &Minimum) -> Vec<(Vec<f64>, f64)> {
    let mut others: Vec<&Minimum> = Vec::new();
    for minimum in minima.iter().filter(|m| decibels(&m.there) < decibels(&best.there) + TOLD) {
        if std::iter::once(&best).chain(&others).all(|o| distance(&o.parameters, &minimum.parameters) > APART) {
            others.push(minimum);
        }
    }
    others.iter().map(|m| (m.parameters.iter().map(|p| p.exp()).collect(), decibels(&m.there))).collect()
}

/// Root mean square of residuals, dB.
fn decibels(evaluation: &Evaluation) -> f64 {
    10.0 / 10f64.ln() * (evaluation.sum() / evaluation.residuals.len() as f64).sqrt()
}

/// Collective: fits the keys `wanted` of the track of a job, those of the pads where there are none, to measured decay
/// rates.
///
/// # Errors
/// A job without `analyses.track_decay`; keys that the rates say nothing of; more keys than rates; no convergence.
pub fn fit(
    world: &World,
    job: &Job,
    measured: &MeasuredDecay,
    wanted: &[TrackKey],
    progress: &mut Progress,
) -> Result<TrackFit> {
    let decay = job.analyses.track_decay.as_ref().ok_or_else(|| {
        Error::Job(
            "analyses.track_decay: missing; it says how the decay rates are measured, add \"track_decay\": {}".into(),
        )
    })?;
    let (track, starts) = starts(job, measured, wanted)?;
    progress.stage("fit of the track to decay rates");
    let made = world.agree(rail(job))?;
    let spacing = decay.spacing.unwrap_or(made.spacing);
    let mut problem = Problem {
        world,
        wanted: decay,
        rail: made,
        track,
        measured,
        keys: starts.iter().map(|(key, _)| *key).collect(),
        positions: POSITIONS.iter().map(|bay| bay * spacing).collect(),
    };
    let values: Vec<f64> = starts.iter().map(|(_, value)| value.ln()).collect();
    let first = problem.rates(&values)?.evaluation;
    let effective: Vec<bool> = effects(&first, starts.len()).into_iter().map(|effect| effect >= EFFECT).collect();
    let of = |kept: bool| starts.iter().zip(&effective).filter(move |(_, e)| **e == kept).map(|(start, _)| *start);
    let (held, starts): (Vec<_>, Vec<_>) = (of(false).collect(), of(true).collect());
    if starts.is_empty() {
        return Err(Error::Job(format!(
            "--key: found no effect of {} on any decay rate of {}; name keys of the layer that the rail feels at these \
             bands, such as pad.vertical",
            held.iter().map(|(key, _)| key.path()).collect::<Vec<_>>().join(", "),
            measured.name
        )));
    }
    problem.keys = starts.iter().map(|(key, _)| *key).collect();
    let theta: Vec<f64> = starts.iter().map(|(_, value)| value.ln()).collect();
    let limit = FARTHEST.ln();
    let bounds: Vec<[f64; 2]> = theta.iter().map(|start| [start - limit, start + limit]).collect();
    let minima = problem.minima(&theta, &bounds, progress)?;
    let best = minima.iter().min_by(|a, b| a.there.sum().total_cmp(&b.there.sum()));
    let theta = best.map_or(theta, |minimum| minimum.parameters.clone());
    let (problem, minimum) = problem.until_it_stays(job, theta, &bounds, progress)?;
    let theta = &minimum.parameters;
    let others = other_minima(&minima, &minimum);
    let rates = problem.rates(theta)?.rates;
    let covariance = minimum.there.covariance(starts.len())?;
    let keys =
        starts.iter().zip(theta).zip(&bounds).enumerate().map(|(k, (((key, before), theta), bounds))| FittedKey {
            key: *key,
            before: *before,
            fitted: theta.exp(),
            deviation: covariance[k][k].sqrt(),
            bound: bounds.contains(theta),
        });
    let size = measured.nominal.len();
    let directions = measured.directions.iter().enumerate().map(|(d, (name, measured_rates))| {
        let rows = &minimum.there.jacobian[d * size..(d + 1) * size];
        let without = rows.iter().zip(&measured.nominal).filter(|(row, _)| row.iter().all(|j| j.abs() < EFFECT));
        FittedDirection {
            name,
            measured: measured_rates.clone(),
            fitted: rates[d * size..(d + 1) * size].to_vec(),
            without_effect: without.map(|(_, band)| *band).collect(),
        }
    });
    let correlated = |i: usize, j: usize| covariance[i][j] / (covariance[i][i] * covariance[j][j]).sqrt();
    Ok(TrackFit {
        body: problem.rail.name,
        keys: keys.collect(),
        held: held.into_iter().map(|(key, _)| key).collect(),
        correlation: (0..starts.len()).map(|i| (0..starts.len()).map(|j| correlated(i, j)).collect()).collect(),
        bands: measured.nominal.clone(),
        directions: directions.collect(),
        residual: [decibels(&first), decibels(&minimum.there)],
        others,
        least: lowest_rate(problem.positions[problem.positions.len() - 1]),
    })
}

impl TrackFit {
    /// Paths of the keys in the job with their fitted values, to so many digits as their meaning has.
    pub fn numbers(&self) -> Vec<(String, f64)> {
        let six = |value: f64| format!("{value:.5e}").parse().unwrap_or(value);
        let path = |key: &FittedKey| format!("bodies.{}.track.{}", self.body, key.key.path());
        self.keys.iter().map(|key| (path(key), six(key.fitted))).collect()
    }
}
