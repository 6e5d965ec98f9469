//! Quantities prescribed over a step: creepages, spins, rigid motions, and the resultants that take their places.

use super::super::border::Border;
use super::super::loading::{Loading, Normal, Tangential};
use super::State;

/// The quantity that the shift of a border stands for.
#[derive(Debug, Clone, Copy)]
enum Unknown {
    /// Creep velocity along x or y, m/s, times the step.
    Creep(usize),
    /// Minus a rigid motion, m.
    Motion(usize),
}

/// Prescribed quantities of a step.
pub(super) struct StepDrive {
    /// Creep along x and y, m/s, and spin, rad/s, of each patch.
    pub(super) creeps: Vec<([f64; 2], f64)>,
    /// Rigid motions at the end of the step, m, `[motions]`; 0 for those that are to be found.
    motions: Vec<f64>,
    /// Approach of each patch by them, m, and its rate, m/s.
    pub(super) approach: Vec<f64>,
    pub(super) rate: Vec<f64>,
    /// Patches that stay open, because nothing presses them.
    pub(super) open: Vec<bool>,
    /// Unknown shifts with their resultants.
    pub(super) borders: Vec<Border>,
    unknown: Vec<Unknown>,
}

impl StepDrive {
    /// Quantities of the step of `h` (s) that begins at the time `t` (s) in the state `before`.
    pub(super) fn new(drive: &Loading, before: &State, t: f64, h: f64) -> Self {
        let (mut borders, mut unknown) = (Vec::new(), Vec::new());
        let mut creeps = vec![([0.0; 2], 0.0); drive.patches.len()];
        for (patch, (creep, spin)) in drive.patches.iter().zip(&mut creeps) {
            for c in 0..2 {
                match &patch.tangential[c] {
                    Tangential::Creep(history) => creep[c] = history.value(t + 0.5 * h),
                    Tangential::Force(history) => {
                        borders.push(Border::of_component(c, history.value(t + h)));
                        unknown.push(Unknown::Creep(c));
                    }
                }
            }
            *spin = patch.spin.value(t + 0.5 * h);
        }
        let open: Vec<bool> = (0..drive.patches.len()).map(|c| drive.is_open(c, t + h)).collect();
        let (mut motions, mut rates) = (vec![0.0; drive.motions.len()], vec![0.0; drive.motions.len()]);
        for (j, motion) in drive.motions.iter().enumerate() {
            match &motion.normal {
                // What bears nothing stays where it was.
                Normal::Force(_) if motion.factors.iter().zip(&open).all(|(&n, open)| n == 0.0 || *open) => {
                    motions[j] = before.motions[j];
                }
                Normal::Force(history) => {
                    borders.push(motion.border(history.value(t + h), drive.loaded_by(j)));
                    unknown.push(Unknown::Motion(j));
                }
                Normal::Approach(history) => {
                    motions[j] = history.value(t + h);
                    rates[j] = (history.value(t + h) - history.value(t)) / h;
                }
            }
        }
        let (approach, rate) = (drive.approaches(&motions), drive.approaches(&rates));
        Self { creeps, motions, approach, rate, open, borders, unknown }
    }

    /// Shifts of the borders in the state `now`, m.
    pub(super) fn shifts(&self, now: &State, h: f64) -> Vec<f64> {
        let of = |unknown: &Unknown| match *unknown {
            Unknown::Creep(c) => now.creep[c] * h,
            Unknown::Motion(j) => -now.motions[j],
        };
        self.unknown.iter().map(of).collect()
    }

    /// Rigid motions with the shifts found, m, `[motions]`.
    pub(super) fn motions(&self, shift: &[f64]) -> Vec<f64> {
        let mut motions = self.motions.clone();
        for (unknown, s) in self.unknown.iter().zip(shift) {
            if let Unknown::Motion(j) = *unknown {
                motions[j] = -s;
            }
        }
        motions
    }

    /// The rigid motion that the shift of border `k` is minus of; none of a creep.
    pub(super) fn motion_of(&self, k: usize) -> Option<usize> {
        match self.unknown[k] {
            Unknown::Motion(j) => Some(j),
            Unknown::Creep(_) => None,
        }
    }

    /// Tangential shifts found, m; 0 where the creep is prescribed.
    pub(super) fn tangential(&self, shift: &[f64]) -> [f64; 2] {
        let mut along = [0.0; 2];
        for (unknown, s) in self.unknown.iter().zip(shift) {
            if let Unknown::Creep(c) = *unknown {
                along[c] = *s;
            }
        }
        along
    }
}
