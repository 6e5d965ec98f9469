//! What repeats itself in a motion, and of what it is made.

use super::{Settings, Walk};
use crate::Result;
use faer::Mat;
use num_complex::Complex;
use std::collections::VecDeque;

type C = Complex<f64>;

/// Crossings of the section that are compared.
const CROSSINGS: usize = 24;
/// Longest period, in crossings.
const LONGEST: usize = 8;
/// Largest distance of two states a period apart, of the amplitude of the motion.
const PERIODIC: f64 = 0.02;
/// Periods that are measured, at least.
const MEASURED: f64 = 16.0;

/// How the motion comes back to a section through the space of states (Poincaré's): where its velocity along its own direction becomes positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Returns {
    /// Period, s; the mean time between crossings where no period is found.
    pub period: f64,
    /// Crossings of the section in a period; 0 where the motion does not repeat itself within 8.
    pub crossings: usize,
    /// Largest distance of states a period apart, of the amplitude of the motion.
    pub apart: f64,
}

/// A motion over some of its periods.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Mean kinetic energy, J.
    pub kinetic: f64,
    /// Mean forces on body 1 (x, y, z), N.
    pub force: [f64; 3],
    /// Root mean squares about them, N.
    pub sway: [f64; 3],
    /// Amplitudes of the forces at the multiples of the frequency, N, `[harmonics][3]`.
    pub lines: Vec<[C; 3]>,
    /// Nodes that stick, of those that are closed: mean and largest share.
    pub stick: [f64; 2],
    /// Fewest closed nodes.
    pub closed: usize,
    /// Root mean squares of the velocities that are watched, m/s, `[r]`.
    pub velocity: Vec<f64>,
    /// Their amplitudes at the multiples of the frequency, m/s, `[harmonics][r]`.
    pub spectrum: Vec<Vec<C>>,
    /// Modal displacements, √kg m, and impulse of the force on body 1 beside its first value, N·s, every [`Heard::stride`](super::Heard::stride) steps,
    /// `[samples][m + 3]`; none where no sound is wanted.
    pub heard: Vec<Vec<f64>>,
}

impl Walk<'_, '_, '_> {
    /// Follows the motion through the section.
    pub(super) fn returns(&mut self) -> Result<Returns> {
        let mut found: VecDeque<(f64, Vec<f64>)> = VecDeque::new();
        let longest = self.settings.crossing_limit();
        let (mut square, mut steps) = (0.0, 0);
        while found.len() < CROSSINGS && steps < longest {
            let before = self.stepper.state().clone();
            self.step()?;
            steps += 1;
            let after = self.stepper.state();
            square += self.along.iter().zip(&after.v).fold(0.0, |s, (_, v)| s + v * v);
            let [a, b] = [&before.v, &after.v].map(|v| self.project(v));
            if a < 0.0 && b >= 0.0 {
                let part = a / (a - b);
                let h = self.step;
                let between = |k: usize| {
                    // Cubic of displacements and velocities at both ends: those at the crossing.
                    let (q, v) = ([before.q[k], after.q[k]], [before.v[k], after.v[k]]);
                    let (t, u) = (part, 1.0 - part);
                    let place = q[0] * u * u * (1.0 + 2.0 * t)
                        + q[1] * t * t * (1.0 + 2.0 * u)
                        + h * t * u * (u * v[0] - t * v[1]);
                    let speed = u * v[0] + t * v[1];
                    [self.omega[k] * place, speed]
                };
                let state = (0..before.q.len()).flat_map(between).collect();
                found.push_back(((before.step as f64 + part) * h, state));
            }
        }
        let scale = (2.0 * square / f64::from(steps.max(1))).sqrt();
        let (Some(first), Some(last), true) = (found.front(), found.back(), found.len() > LONGEST && scale > 0.0)
        else {
            return Ok(Returns { period: f64::NAN, crossings: 0, apart: f64::INFINITY });
        };
        let count = found.len();
        let apart = |p: usize| {
            let pairs = found.iter().zip(found.iter().skip(p));
            pairs.map(|(a, b)| distance(&a.1, &b.1)).fold(0.0, f64::max) / scale
        };
        let all: Vec<f64> = (1..=LONGEST).map(apart).collect();
        let mean = (last.0 - first.0) / (count - 1) as f64;
        Ok(match all.iter().position(|d| *d <= PERIODIC) {
            Some(k) => {
                let p = k + 1;
                let whole = (count - 1) / p;
                let period = (found[p * whole].0 - first.0) / whole as f64;
                Returns { period, crossings: p, apart: all[k] }
            }
            None => Returns { period: mean, crossings: 0, apart: all.into_iter().fold(f64::INFINITY, f64::min) },
        })
    }

    /// Measures the motion over periods of `period`, s, and the amplitude along its direction.
    pub(super) fn record(&mut self, period: f64) -> Result<(Record, f64)> {
        let (least, stride) = self.settings.heard.map_or((0.0, usize::MAX), |h| (h.time, h.stride.max(1)));
        let periods = (MEASURED * self.settings.period / period).max(least / period).ceil().max(MEASURED / 4.0);
        let steps = (periods * period / self.step).round().max(2.0) as usize;
        let (r, n) = (self.settings.watch.nrows(), self.settings.harmonics);
        let channels = 3 + r;
        let (mut heard, mut impulse) = (Vec::new(), [0.0; 3]);
        let (mut weights, mut mean, mut squares) = (0.0, vec![0.0; channels], vec![0.0; channels]);
        let mut lines = vec![vec![C::default(); channels]; n];
        let (mut kinetic, mut along, mut stick, mut most, mut fewest) = (0.0, 0.0, 0.0, 0f64, usize::MAX);
        // Shifted by the first sample: what is added up stays small.
        let mut shift: Option<Vec<f64>> = None;
        for step in 0..steps {
            self.step()?;
            let weight = hann(step, steps);
            let (state, report) = (self.stepper.state(), self.stepper.report());
            let mut sample: Vec<f64> = report.force.to_vec();
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
            let share = report.stick as f64 / report.closed.max(1) as f64;
            stick += weight * share;
            most = most.max(share);
            fewest = fewest.min(report.closed);
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
            velocity: (0..r).map(|k| rms(3 + k)).collect(),
            spectrum: lines.iter().map(|l| l[3..].to_vec()).collect(),
            heard,
        };
        Ok((record, (along / weights).sqrt()))
    }
}

impl Settings {
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

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
