//! Poincaré section of a motion, where the velocity along its own direction becomes positive, and how closely states
//! return to it.

use std::collections::VecDeque;

/// Longest period, in crossings.
pub(super) const LONGEST: usize = 8;
/// Bursts of crossings that are compared: those of the last looks, and one of the verdict.
const BURSTS: usize = 4;
/// Most crossings of a burst.
const MOST: usize = 24;

/// A crossing of the section.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Crossing {
    /// Number of the crossing since the motion was left to itself.
    number: usize,
    /// s.
    pub(super) time: f64,
    /// Displacements times their angular frequencies, and velocities, `[2m]`.
    state: Vec<f64>,
}

/// Crossings that follow one another, and the amplitude meanwhile.
#[derive(Debug, Clone, Default)]
pub(super) struct Burst {
    pub(super) crossings: Vec<Crossing>,
    /// Sum of the squares of the velocities of all steps.
    square: f64,
    steps: usize,
}

impl Burst {
    /// Amplitude of the velocity.
    fn amplitude(&self) -> f64 {
        (2.0 * self.square / self.steps.max(1) as f64).sqrt()
    }
}

/// Measures of a motion: its direction in the modal velocities, of length 1, the angular frequencies of the modes,
/// rad/s, and the time step, s.
#[derive(Debug, Clone, Copy)]
pub(super) struct SectionMeasures<'a> {
    pub(super) along: &'a [f64],
    pub(super) omega: &'a [f64],
    pub(super) step: f64,
}

/// The section and the last bursts of crossings. All steps pass through it, so that crossings keep their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct PoincareSection {
    number: usize,
    bursts: VecDeque<Burst>,
    recorded: Option<Burst>,
    before: (u64, Vec<f64>, Vec<f64>),
}

impl PoincareSection {
    /// Keeps displacements and velocities before the step that follows the step `number`.
    pub(super) fn before(&mut self, number: u64, now: [&[f64]; 2]) {
        let (step, q, v) = &mut self.before;
        *step = number;
        for (kept, now) in [q, v].into_iter().zip(now) {
            kept.clear();
            kept.extend_from_slice(now);
        }
    }

    /// Counts the crossing of the step that led to displacements and velocities `after`, and keeps it while a burst is
    /// recorded.
    pub(super) fn after(&mut self, after: [&[f64]; 2], measures: SectionMeasures<'_>) {
        let [place, speed] = after;
        let SectionMeasures { along, omega, step: h } = measures;
        let (step, q, v) = &self.before;
        let project = |v: &[f64]| -> f64 { along.iter().zip(v).map(|(a, v)| a * v).sum() };
        let (a, b) = (project(v), project(speed));
        let crosses = a < 0.0 && b >= 0.0;
        self.number += usize::from(crosses);
        let Some(burst) = &mut self.recorded else { return };
        burst.square += speed.iter().map(|v| v * v).sum::<f64>();
        burst.steps += 1;
        if !crosses || burst.crossings.len() == MOST {
            return;
        }
        let t = a / (a - b);
        let u = 1.0 - t;
        let between = |k: usize| {
            // Cubic of displacements and velocities at both ends: those at the crossing.
            let at = q[k] * u * u * (1.0 + 2.0 * t)
                + place[k] * t * t * (1.0 + 2.0 * u)
                + h * t * u * (u * v[k] - t * speed[k]);
            [omega[k] * at, u * v[k] + t * speed[k]]
        };
        let state = (0..q.len()).flat_map(between).collect();
        burst.crossings.push(Crossing { number: self.number, time: (*step as f64 + t) * h, state });
    }

    /// Begins a burst.
    pub(super) fn begin_burst(&mut self) {
        self.recorded = Some(Burst::default());
    }

    /// Crossings of the burst that is being recorded.
    pub(super) fn recorded(&self) -> usize {
        self.recorded.as_ref().map_or(0, |b| b.crossings.len())
    }

    /// Ends the burst; returns it.
    pub(super) fn end_burst(&mut self) -> Burst {
        let burst = self.recorded.take().unwrap_or_default();
        self.bursts.push_back(burst.clone());
        if self.bursts.len() > BURSTS {
            self.bursts.pop_front();
        }
        burst
    }

    /// Returns for each period of 1 to [`LONGEST`] crossings the largest distance of two states of the last bursts
    /// whose crossings are any number of such periods apart, of the amplitude. Infinite where no two crossings are.
    pub(super) fn distances(&self) -> [f64; LONGEST] {
        let all: Vec<&Crossing> = self.bursts.iter().flat_map(|b| &b.crossings).collect();
        let scale = self.bursts.iter().map(Burst::amplitude).fold(0.0, f64::max);
        let mut largest = [-1.0f64; LONGEST];
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                let (apart, d) = (a.number - b.number, distance(&a.state, &b.state));
                let periods = largest.iter_mut().enumerate().filter(|(p, _)| apart.is_multiple_of(p + 1));
                periods.for_each(|(_, l)| *l = l.max(d));
            }
        }
        largest.map(|d| if d >= 0.0 && scale > 0.0 { d / scale } else { f64::INFINITY })
    }

    /// Returns the least of the [`distances`](Self::distances): how far the motion is from repeating itself.
    pub(super) fn spread(&self) -> f64 {
        self.distances().into_iter().fold(f64::INFINITY, f64::min)
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::amplitude_continuation::GrowthSample;
    use super::super::periodicity::{hann, PERIODIC};
    use super::super::settling::{FreeRecord, SettlingState};
    use super::super::{CycleOutcome, SectionReturns};
    use super::*;
    use std::f64::consts::PI;

    const SETTLED: f64 = 1e-3;
    const STEPS: usize = 60;

    /// Verdict on an oscillation of the period 1 whose amplitude over time is `amplitude`, and the looks that it took.
    fn verdict(mut amplitude: impl FnMut(f64) -> f64) -> (CycleOutcome, usize) {
        let (mut section, mut alone, mut step) = (PoincareSection::default(), FreeRecord::default(), 0);
        let h = 1.0 / STEPS as f64;
        let mut at = |step: usize| {
            let (a, phase) = (amplitude(step as f64 * h), 2.0 * PI * (step as f64 * h - 0.25));
            [a * phase.sin() / (2.0 * PI), a * phase.cos()]
        };
        let mut now = at(0);
        for look in 1..200 {
            let mut level = 0.0;
            for window in 0..3 {
                if window == 2 {
                    section.begin_burst();
                }
                let (mut squares, mut weights) = (0.0, 0.0);
                for k in 0..16 * STEPS {
                    section.before(step as u64, [&now[..1], &now[1..]]);
                    step += 1;
                    now = at(step);
                    let measures = SectionMeasures { along: &[1.0], omega: &[2.0 * PI], step: h };
                    section.after([&now[..1], &now[1..]], measures);
                    let weight = hann(k, 16 * STEPS);
                    squares += weight * now[1] * now[1];
                    weights += weight;
                }
                level = 0.5 * f64::ln(squares / weights);
            }
            section.end_burst();
            let known = alone.next(GrowthSample { level, rate: 0.0, linear: false }, section.spread(), SETTLED);
            let repeats = section.spread() <= PERIODIC;
            let stays = match known {
                SettlingState::Nothing => false,
                SettlingState::Gone => panic!("gone"),
                SettlingState::Sustained => true,
                SettlingState::Settled => repeats || alone.keeps_its_spread(),
            };
            if stays {
                let returns = SectionReturns { period: 1.0, crossings: usize::from(repeats), apart: section.spread() };
                return (CycleOutcome::of(true, &returns), look);
            }
        }
        (CycleOutcome::Unsettled, 200)
    }

    /// The beat of two waves 1.6 % apart dies out over a hundred looks, or stays; a chaotic one stays, too.
    #[test]
    fn beats_that_die_out_leave_a_cycle_and_others_do_not() {
        let (fate, looks) = verdict(|t| 1.0 + 0.1 * (-1.5e-3 * t).exp() * (0.1 * t).cos());
        assert!(fate == CycleOutcome::Cycle && looks > 40, "{fate:?} {looks}");
        let (fate, looks) = verdict(|t| 1.0 + 0.1 * (0.1 * t).cos());
        assert!(fate == CycleOutcome::Irregular && looks < 24, "{fate:?} {looks}");
        // A beat so slow that states one period apart are close to each other: 8e-4 of the amplitude.
        let (fate, looks) = verdict(|t| 1.0 + 0.1 * (8e-3 * t).cos());
        assert!(fate == CycleOutcome::Irregular && looks < 60, "{fate:?} {looks}");
        // The logistic map, of which every period but no stable one is there.
        let (mut x, mut last) = (0.3, 0);
        let (fate, looks) = verdict(move |t| {
            // Between two crossings, where the displacement is zero.
            let period = (t + 0.5).floor() as i64;
            if period != last {
                (x, last) = (3.9 * x * (1.0 - x), period);
            }
            1.0 + 0.2 * x
        });
        assert!(fate == CycleOutcome::Irregular && looks < 40, "{fate:?} {looks}");
    }

    /// Amplitudes that alternate: a period of two crossings, found at once.
    #[test]
    fn a_doubled_period_is_one_of_two_crossings() {
        let (fate, looks) = verdict(|t| if (t + 0.5).floor() as i64 % 2 == 0 { 1.0 } else { 1.1 });
        assert!(fate == CycleOutcome::Cycle && looks == 4, "{fate:?} {looks}");
    }
}
