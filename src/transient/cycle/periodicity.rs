//! Periodicity of a motion and its harmonics.

use super::section::LONGEST;
use super::{CycleSettings, Walk};
use crate::Result;
use faer::Mat;
use num_complex::Complex;

type C = Complex<f64>;

/// Crossings of the section that a period is measured over.
const CROSSINGS: usize = 24;
/// Largest distance of two states a period apart, of the amplitude of the motion; twice the wanted error of the
/// amplitude where that is more.
pub(super) const PERIODIC: f64 = 0.02;
/// Periods that are measured, at least.
const MEASURED: f64 = 16.0;

/// How the motion comes back to a section through the space of states (Poincaré's): where its velocity along its own
/// direction becomes positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SectionReturns {
    /// Period, s; the mean time between crossings where no period is found.
    pub period: f64,
    /// Crossings of the section in a period; 0 where the motion does not repeat itself within 8.
    pub crossings: usize,
    /// Largest distance of states any number of periods apart, of those at the end and in the looks before, of the
    /// amplitude of the motion.
    pub apart: f64,
}

/// A motion over some of its periods.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Mean kinetic energy, J.
    pub kinetic: f64,
    /// Mean force on body 1 at the first contact (x, y, z), N.
    pub force: [f64; 3],
    /// Root mean squares about them, N.
    pub sway: [f64; 3],
    /// Amplitudes of this force at the multiples of the frequency, N, `[harmonics][3]`.
    pub lines: Vec<[C; 3]>,
    /// Nodes that stick, of those that are closed: mean and largest share.
    pub stick: [f64; 2],
    /// Fewest closed nodes.
    pub closed: usize,
    /// Root mean squares of the velocities that are watched, m/s, `[r]`.
    pub velocity: Vec<f64>,
    /// Their amplitudes at the multiples of the frequency, m/s, `[harmonics][r]`.
    pub spectrum: Vec<Vec<C>>,
    /// Modal displacements, √kg m, and impulses of the forces on body 1 at C contacts beside their first values, N·s,
    /// every [`AmplitudeRecord::stride`](super::AmplitudeRecord::stride) steps, `[samples][m + 3C]`; none where no
    /// sound is wanted.
    pub heard: Vec<Vec<f64>>,
}

impl Walk<'_, '_, '_> {
    /// Follows the motion through the section, and compares its states with those of the last looks.
    pub(super) fn returns(&mut self) -> Result<SectionReturns> {
        let longest = self.settings.crossing_limit();
        let mut steps = 0;
        self.section.begin_burst();
        while self.section.recorded() < CROSSINGS && steps < longest {
            self.step()?;
            steps += 1;
        }
        let found = self.section.end_burst().crossings;
        let (Some(first), Some(last), true) = (found.first(), found.last(), found.len() > LONGEST) else {
            return Ok(SectionReturns { period: f64::NAN, crossings: 0, apart: f64::INFINITY });
        };
        let count = found.len();
        let apart = self.section.distances();
        let most = PERIODIC.max(2.0 * self.settings.settled);
        Ok(match apart.iter().position(|d| *d <= most) {
            Some(k) => {
                let p = k + 1;
                let whole = (count - 1) / p;
                let period = (found[p * whole].time - first.time) / whole as f64;
                SectionReturns { period, crossings: p, apart: apart[k] }
            }
            None => {
                let period = (last.time - first.time) / (count - 1) as f64;
                SectionReturns { period, crossings: 0, apart: apart.into_iter().fold(f64::INFINITY, f64::min) }
            }
        })
    }

    /// Measures the motion over periods of `period`, s, and the amplitude along its direction.
    pub(super) fn record(&mut self, period: f64) -> Result<(Record, f64)> {
        let (least, stride) = self.settings.heard.map_or((0.0, usize::MAX), |h| (h.time, h.stride.max(1)));
        let periods = (MEASURED * self.settings.period / period).max(least / period).ceil().max(MEASURED / 4.0);
        let steps = (periods * period / self.step).round().max(2.0) as usize;
        let (r, n) = (self.settings.watch.nrows(), self.settings.harmonics);
        let forces = 3 * self.stepper.patches().len();
        let channels = forces + r;
        let (mut heard, mut impulse) = (Vec::new(), vec![0.0; forces]);
        let (mut weights, mut mean, mut squares) = (0.0, vec![0.0; channels], vec![0.0; channels]);
        let mut lines = vec![vec![C::default(); channels]; n];
        let (mut kinetic, mut along, mut stick, mut most, mut fewest) = (0.0, 0.0, 0.0, 0f64, usize::MAX);
        // Shifted by the first sample: what is added up stays small.
        let mut shift: Option<Vec<f64>> = None;
        for step in 0..steps {
            self.step()?;
            let weight = hann(step, steps);
            let (state, report) = (self.stepper.state(), self.stepper.report());
            let mut sample: Vec<f64> = report.patches.iter().flat_map(|patch| patch.force).collect();
            sample.extend(watched(&self.settings.watch, &state.v));
            let shift = shift.get_or_insert_with(|| sample.clone());
            sample.iter_mut().zip(&*shift).for_each(|(s, o)| *s -= o);
            impulse.iter_mut().zip(&sample).for_each(|(i, f)| *i += self.step * f);
            if self.settings.heard.is_some() && step % stride == 0 {
                heard.push(state.q.iter().chain(&impulse).copied().collect());
            }
            weights += weight;
            for (k, s) in sample.iter().enumerate() {
                mean[k] += weight * s;
                squares[k] += weight * s * s;
            }
            for (j, line) in lines.iter_mut().enumerate() {
                let phase = 2.0 * std::f64::consts::PI * (j + 1) as f64 * step as f64 * self.step / period;
                let turn = C::from_polar(2.0 * weight, -phase);
                line.iter_mut().zip(&sample).for_each(|(l, s)| *l += turn * s);
            }
            kinetic += weight * 0.5 * state.v.iter().map(|v| v * v).sum::<f64>();
            along += weight * self.project(&state.v).powi(2);
            let share = report.stick() as f64 / report.closed().max(1) as f64;
            stick += weight * share;
            most = most.max(share);
            fewest = fewest.min(report.closed());
        }
        let shift = shift.unwrap_or_else(|| vec![0.0; channels]);
        let mean: Vec<f64> = mean.iter().map(|s| s / weights).collect();
        let rms = |k: usize| (squares[k] / weights - mean[k] * mean[k]).max(0.0).sqrt();
        let lines: Vec<Vec<C>> = lines.iter().map(|l| l.iter().map(|s| s / weights).collect()).collect();
        let record = Record {
            kinetic: kinetic / weights,
            force: [0, 1, 2].map(|c| mean[c] + shift[c]),
            sway: [0, 1, 2].map(rms),
            lines: lines.iter().map(|l| [l[0], l[1], l[2]]).collect(),
            stick: [stick / weights, most],
            closed: fewest,
            velocity: (0..r).map(|k| rms(forces + k)).collect(),
            spectrum: lines.iter().map(|l| l[forces..].to_vec()).collect(),
            heard,
        };
        Ok((record, (along / weights).sqrt()))
    }
}

impl CycleSettings {
    /// Steps within which so many crossings are to come.
    fn crossing_limit(&self) -> u32 {
        (2.0 * CROSSINGS as f64 * self.period / self.step).ceil() as u32
    }
}

/// von Hann's window: what is no multiple of the frequency hardly shows.
pub(super) fn hann(step: usize, steps: usize) -> f64 {
    (std::f64::consts::PI * (step as f64 + 0.5) / steps as f64).sin().powi(2)
}

fn watched<'a>(watch: &'a Mat<f64>, v: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    (0..watch.nrows()).map(move |i| v.iter().enumerate().map(|(k, v)| watch[(i, k)] * v).sum())
}
