//! Limit cycles: a motion is followed until it repeats itself or has died out.
//!
//! Modes are little damped, so a cycle is approached slowly: after ten thousands of periods as a rule. The way there
//! is shortened. Between windows of some periods the deviation from rest is multiplied by a factor that leads to the
//! amplitude at which, by what has been seen, nothing grows nor decays (`trail`). What is told of the cycle is then
//! measured on a motion that has been left to itself (`alone`), after its return to a section has been looked at
//! (`section`; H. Poincaré; see A. H. Nayfeh, B. Balachandran, Applied Nonlinear Dynamics, 1995).
//!
//! One rule gives the verdict (`CycleOutcome::of`): a motion that has stopped changing is a cycle if it comes back to
//! the section, otherwise irregular; one that still changes is unsettled. A beat that shrinks is a change, so it is
//! followed until it is gone or the time is over.

mod amplitude_continuation;
mod periodicity;
mod section;
mod settling;

pub use periodicity::{Record, SectionReturns};

use super::stepper::{State, Stepper};
use crate::Result;
use amplitude_continuation::{GrowthSample, NextAmplitude, Trail};
use faer::Mat;
use section::{PoincareSection, SectionMeasures};
use settling::{FreeRecord, SettlingState, LOOKS};

/// Periods of a window over which amplitudes are averaged.
const WINDOW: f64 = 16.0;
/// Least share of the mean square of the velocities along the followed direction: below it the motion has become
/// another one.
const SHARE: f64 = 0.2;

/// The golden section: its multiples are spread evenly between whole numbers.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Settings of the search.
#[derive(Debug, Clone)]
pub struct CycleSettings {
    /// The time step of the stepper, s.
    pub step: f64,
    /// Period of the motion to begin with, s.
    pub period: f64,
    /// Relative error of the amplitude.
    pub settled: f64,
    /// Longest time, s.
    pub longest: f64,
    /// Root mean square of the modal velocities, √J, below which a decaying motion counts as rest.
    pub floor: f64,
    /// True if small motions about rest decay: then those that meet no other nodes than at rest do have nothing else
    /// before them.
    pub stable: bool,
    /// Closed and sticking nodes at rest.
    pub nodes: [usize; 2],
    /// Multiples of the frequency that are told.
    pub harmonics: usize,
    /// Velocities that are told, as rows over the modal ones, `[r, m]`.
    pub watch: Mat<f64>,
    /// Values recorded for its sound.
    pub heard: Option<AmplitudeRecord>,
}

/// Modal displacements that are kept of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeRecord {
    /// Steps between two of them.
    pub stride: usize,
    /// They are measured over at least this time, s.
    pub time: f64,
}

/// Outcome of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CycleOutcome {
    /// It has died out.
    Rest,
    /// It repeats itself.
    Cycle,
    /// Neither its amplitude nor its beat changes any more, but it does not repeat itself.
    Irregular,
    /// Its amplitude still changes at the end of the time, or its beat still shrinks.
    Unsettled,
}

impl CycleOutcome {
    /// Verdict on a motion that goes on: `stays` is true if it has stopped changing.
    fn of(stays: bool, returns: &SectionReturns) -> Self {
        match (stays, returns.crossings > 0) {
            (true, true) => Self::Cycle,
            (true, false) => Self::Irregular,
            (false, _) => Self::Unsettled,
        }
    }
}

/// A motion that was followed to its end.
#[derive(Debug, Clone)]
pub struct FollowedMotion {
    /// Outcome of the motion.
    pub fate: CycleOutcome,
    /// How it repeats itself, and what it is made of; none of what rests.
    pub motion: Option<(SectionReturns, Record)>,
    /// Rate at which small deviations of the amplitude go back, 1/s; NaN where it was not found.
    pub back: f64,
    /// Simulated time, s.
    pub time: f64,
    /// The state at the end.
    pub state: State,
}

/// The end of a motion: where another march begins.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleMotion {
    /// Modal displacements from rest, m √kg, `[m]`.
    pub q: Vec<f64>,
    /// Modal velocities, m √kg/s, `[m]`.
    pub v: Vec<f64>,
    /// s.
    pub period: f64,
}

/// Follows the motion of `stepper` about the state `rest`.
pub fn follow(stepper: &mut Stepper<'_>, rest: &State, settings: &CycleSettings) -> Result<FollowedMotion> {
    let omega = stepper.omega().to_vec();
    let first = stepper.state().step;
    let along = vec![0.0; omega.len()];
    let section = PoincareSection::default();
    let mut walk = Walk { stepper, rest, settings, omega, along, step: settings.step, first, section };
    let mut trail = walk.trail();
    let mut alone: Option<FreeRecord> = None;
    let mut back = f64::NAN;
    // Neither amplitude nor beat has changed of late.
    let mut stays = false;
    walk.aim()?;
    while walk.time() < settings.longest && !stays {
        let Some(seen) = walk.look(alone.as_ref().map_or(0, FreeRecord::looks))? else {
            // The motion has become another one.
            (trail, alone) = (walk.trail(), None);
            walk.aim()?;
            continue;
        };
        let small = seen.linear && settings.stable || seen.level < settings.floor.ln();
        if seen.rate < 0.0 && small {
            return Ok(FollowedMotion {
                fate: CycleOutcome::Rest,
                motion: None,
                back,
                time: walk.time(),
                state: rest.clone(),
            });
        }
        let Some(own) = &mut alone else {
            match trail.next(seen) {
                NextAmplitude::Scale(factor) => walk.scale(factor)?,
                NextAmplitude::Wait => {}
                NextAmplitude::Near(rate) => {
                    (alone, back) = (Some(FreeRecord::default()), rate);
                    walk.section = PoincareSection::default();
                }
            }
            continue;
        };
        match own.next(seen, walk.section.spread(), settings.settled) {
            SettlingState::Nothing => {}
            SettlingState::Gone => (trail, alone) = (walk.trail(), None),
            SettlingState::Sustained => stays = true,
            SettlingState::Settled => {
                let returns = walk.returns()?;
                let (record, level) = walk.record(returns.period)?;
                let settled = (level.ln() - seen.level).abs() <= settings.settled;
                if settled && returns.crossings > 0 {
                    let (motion, state) = (Some((returns, record)), walk.stepper.state().clone());
                    return Ok(FollowedMotion { fate: CycleOutcome::Cycle, motion, back, time: walk.time(), state });
                }
                // What was brought in on the way may have to decay.
                stays = settled && own.keeps_its_spread();
            }
        }
    }
    let stays = stays || alone.is_some_and(|own| own.is_stationary());
    let returns = walk.returns()?;
    let fate = CycleOutcome::of(stays, &returns);
    let period = if returns.period > 0.0 { returns.period } else { settings.period };
    let (record, _) = walk.record(period)?;
    let state = walk.stepper.state().clone();
    Ok(FollowedMotion { fate, motion: Some((returns, record)), back, time: walk.time(), state })
}

/// The motion on its way.
struct Walk<'w, 'a, 's> {
    stepper: &'w mut Stepper<'a>,
    rest: &'s State,
    settings: &'s CycleSettings,
    /// rad/s, `[m]`.
    omega: Vec<f64>,
    /// The direction of the motion in the modal velocities, of length 1, `[m]`.
    along: Vec<f64>,
    /// s.
    step: f64,
    /// Number of the first step.
    first: u64,
    section: PoincareSection,
}

impl Walk<'_, '_, '_> {
    fn time(&self) -> f64 {
        (self.stepper.state().step - self.first) as f64 * self.step
    }

    fn step(&mut self) -> Result<()> {
        let state = self.stepper.state();
        self.section.before(state.step, [&state.q, &state.v]);
        self.stepper.advance()?;
        let state = self.stepper.state();
        let measures = SectionMeasures { along: &self.along, omega: &self.omega, step: self.step };
        self.section.after([&state.q, &state.v], measures);
        Ok(())
    }

    /// Along the direction of the motion.
    fn project(&self, v: &[f64]) -> f64 {
        self.along.iter().zip(v).map(|(a, v)| a * v).sum()
    }

    /// Steps of a window.
    fn window(&self) -> usize {
        (WINDOW * self.settings.period / self.step).ceil() as usize
    }

    /// A trail of looks of three windows.
    fn trail(&self) -> Trail {
        Trail::new(3.0 * self.window() as f64 * self.step)
    }

    /// The direction of the motion: that of the largest velocity in a window.
    fn aim(&mut self) -> Result<()> {
        let mut largest = 0.0;
        for _ in 0..self.window() {
            self.step()?;
            let v = &self.stepper.state().v;
            let square: f64 = v.iter().map(|v| v * v).sum();
            if square > largest {
                largest = square;
                self.along = v.iter().map(|v| v / square.sqrt()).collect();
            }
        }
        Ok(())
    }

    /// Root mean square along the direction of the motion over a window, √J, its share of all motion, and whether no
    /// other nodes were met than at rest.
    fn mean(&mut self) -> Result<(f64, f64, bool)> {
        let steps = self.window();
        let (mut weights, mut along, mut all, mut linear) = (0.0, 0.0, 0.0, true);
        for step in 0..steps {
            self.step()?;
            let weight = periodicity::hann(step, steps);
            let report = self.stepper.report();
            linear &= [report.closed(), report.stick()] == self.settings.nodes;
            let v = &self.stepper.state().v;
            weights += weight;
            along += weight * self.project(v).powi(2);
            all += weight * v.iter().map(|v| v * v).sum::<f64>();
        }
        Ok(((along / weights).sqrt(), along / all.max(f64::MIN_POSITIVE), linear))
    }

    /// Lets fast parts of the motion go for a window and looks at two more, and at the crossings of the section in the
    /// last one. None where the motion has become another one. From the look `number` on windows are let go that differ
    /// in length: a beat would look the same each time if looks were as long as some of its periods.
    fn look(&mut self, number: usize) -> Result<Option<GrowthSample>> {
        let part = if number < LOOKS { 1.0 } else { 0.5 + (number as f64 * GOLDEN).fract() };
        for _ in 0..(part * self.window() as f64).round() as usize {
            self.step()?;
        }
        let one = self.mean()?;
        self.section.begin_burst();
        let two = self.mean()?;
        self.section.end_burst();
        if two.1 < SHARE && two.0 > 0.0 {
            return Ok(None);
        }
        let [a, b] = [one.0, two.0].map(|a| a.max(f64::MIN_POSITIVE).ln());
        let width = self.window() as f64 * self.step;
        Ok(Some(GrowthSample { level: b, rate: (b - a) / width, linear: one.2 && two.2 }))
    }

    /// Multiplies the deviation from rest.
    fn scale(&mut self, factor: f64) -> Result<()> {
        let mut state = self.stepper.state().clone();
        let stretch = |x: &mut Vec<f64>, rest: &[f64]| {
            x.iter_mut().zip(rest).for_each(|(x, r)| *x = r + factor * (*x - r));
        };
        stretch(&mut state.q, &self.rest.q);
        stretch(&mut state.v, &self.rest.v);
        self.stepper.put(state)?;
        self.stepper.settle()
    }
}

#[cfg(test)]
mod tests;
