//! The contact of a cycle, linearised: forces on what acts at the contact under small changes of its motion.
//!
//! Changes in a period are combinations of a window: sequences of N samples that hold every motion up to some
//! multiples of the frequency, periodic or not (D. Slepian, Bell Syst. Tech. J. 57 (1978)). All are marched at once by
//! the linearised steps of the stepper; what the contact makes of each in its period and in those that follow, until it
//! is forgotten, is the kernel. Its cost does not depend on the number of modes.

use super::balance::{state, Balance, ContactMemory, PeriodicSolution};
use crate::transient::stepper::StateChanges;
use crate::{Error, Result};
use faer::{Mat, Side};
use std::f64::consts::PI;

type C = num_complex::Complex<f64>;

/// Part of the square of a sequence that may lie outside the band where it is left out.
const LEAK: f64 = 1e-10;

/// The window of `samples` samples that holds motions up to `multiples` times the frequency, `[samples, d]`, with
/// orthonormal columns.
pub(super) fn window(samples: usize, multiples: f64) -> Result<Mat<f64>> {
    let half = (multiples / samples as f64).min(0.5);
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 2.0 * half,
        apart => (2.0 * PI * half * apart as f64).sin() / (PI * apart as f64),
    };
    let kernel = Mat::from_fn(samples, samples, entry);
    let eigen = kernel
        .self_adjoint_eigen(Side::Lower)
        .map_err(|e| Error::NotConverged(format!("limit cycles: the window of a period was not found ({e:?})")))?;
    let values = eigen.S().column_vector();
    let kept: Vec<usize> = (0..samples).filter(|&k| values[k] > LEAK).collect();
    Ok(Mat::from_fn(samples, kept.len(), |i, k| eigen.U()[(i, kept[k])]))
}

impl Balance<'_, '_> {
    /// The kernel of `cycle` on the functions of `window`: forces in the period of a change, in the next one and so on,
    /// each `[r d, r d]`, the place of the function k of the motion i being i d + k.
    pub(super) fn kernel(&mut self, cycle: &PeriodicSolution, window: &Mat<f64>) -> Result<Vec<Mat<f64>>> {
        let (samples, d) = (window.nrows(), window.ncols());
        let r = self.structure.rank();
        let h = 2.0 * PI / (samples as f64 * cycle.omega);
        let delays = self.delays(&cycle.contact, h);
        let harmonics: Vec<Vec<C>> = cycle.modal.iter().map(|q| self.structure.at_contact(q)).collect();
        let sample = |n: usize| -> Vec<f64> {
            let turn = |k: usize| C::from_polar(1.0, 2.0 * PI * ((k * n) % samples) as f64 / samples as f64);
            (0..r).map(|i| harmonics.iter().enumerate().map(|(k, z)| (z[i] * turn(k)).re).sum()).collect()
        };
        let period: Vec<Vec<f64>> = (0..samples).map(sample).collect();
        // What nothing holds goes on.
        let drift = self.structure.free.as_ref().map_or(0.0, |free| cycle.drift * h * free.size);
        let from = |start: usize, count: usize| -> Vec<Vec<f64>> {
            let at = |step: usize| {
                let mut sample = period[(start + step) % samples].clone();
                sample.iter_mut().last().into_iter().for_each(|last| *last += drift * step as f64);
                sample
            };
            (0..=count).map(at).collect()
        };
        // The contact under this motion, which has all multiples: from where marches of the cycle begin to phase zero.
        let before = self.forgetting(&cycle.begin, h);
        let settled = self.forces(&from((samples - before % samples) % samples, before), &cycle.begin, h)?.1;
        // The first period is changed, the steps after it forget the change.
        let count = samples + self.forgetting(&cycle.contact, h);
        self.prescribe(&from(0, count), &settled, h)?;
        let mut changes = StateChanges::of_motion(&self.stepper, Mat::zeros(r, r * d));
        let mut kernel = vec![Mat::zeros(r * d, r * d); delays + 1];
        for step in 0..count {
            let (delay, n) = (step / samples, step % samples);
            let end = |i: usize, column: usize| match delay == 0 && column / d == i {
                true => window[(n, column % d)],
                false => 0.0,
            };
            self.stepper.advance_with(&mut changes, Mat::from_fn(r, r * d, end).as_ref())?;
            let force = changes.force();
            for column in 0..r * d {
                let to = kernel[delay].col_as_slice_mut(column);
                for j in 0..r {
                    let change = force[(j, column)];
                    (0..d).for_each(|b| to[j * d + b] += window[(n, b)] * change);
                }
            }
        }
        Ok(kernel)
    }

    /// Forces on the first of what acts at the contact in the second of two periods under a periodic change of its
    /// motion, `change` at each step.
    #[cfg(test)]
    pub(super) fn forces_under(&mut self, cycle: &PeriodicSolution, change: &dyn Fn(usize) -> f64) -> Result<Vec<f64>> {
        let samples = self.resolution.samples;
        let h = 2.0 * PI / (samples as f64 * cycle.omega);
        let harmonics: Vec<Vec<C>> = cycle.modal.iter().map(|q| self.structure.at_contact(q)).collect();
        let sample = |n: usize| -> Vec<f64> {
            let turn = |k: usize| C::from_polar(1.0, 2.0 * PI * (k * n) as f64 / samples as f64);
            vec![harmonics.iter().enumerate().map(|(k, z)| (z[0] * turn(k)).re).sum::<f64>() + change(n)]
        };
        let motion: Vec<Vec<f64>> = (0..=3 * samples).map(sample).collect();
        let (forces, _) = self.forces(&motion, &cycle.contact, h)?;
        Ok(forces[2 * samples..].iter().map(|f| f[0]).collect())
    }

    /// Periods after its own in which the contact knows of a change.
    pub(super) fn delays(&self, memory: &ContactMemory, h: f64) -> usize {
        self.forgetting(memory, h).div_ceil(self.resolution.samples).max(1)
    }

    /// Lets the contact go on from `start` under `motion`, `[steps + 1][r]`, which begins with the start, in steps of
    /// `h`, s.
    fn prescribe(&mut self, motion: &[Vec<f64>], start: &ContactMemory, h: f64) -> Result<()> {
        {
            let mut course = self.course.borrow_mut();
            course.samples.clear();
            course.samples.extend_from_slice(motion);
            course.next = 1 % motion.len().max(1);
            (course.drift, course.gone) = (0.0, 0.0);
        }
        self.stepper.restart(h, state(motion.first().cloned().unwrap_or_default(), start))
    }

    /// Forces on what acts at the contact at the end of each step under `motion`, `[steps + 1][r]`, whose first sample
    /// is the start; and the contact at the end.
    fn forces(&mut self, motion: &[Vec<f64>], start: &ContactMemory, h: f64) -> Result<(Vec<Vec<f64>>, ContactMemory)> {
        self.prescribe(motion, start, h)?;
        let mut forces = Vec::with_capacity(motion.len());
        for _ in 1..motion.len() {
            self.stepper.advance()?;
            forces.push(self.stepper.modal_force().unwrap_or_default().to_vec());
        }
        Ok((forces, ContactMemory::from_state(self.stepper.state())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn window_holds_motions_that_do_not_close() {
        let samples = 240;
        let window = window(samples, 7.0).unwrap();
        assert!(window.ncols() < 30, "{}", window.ncols());
        for multiple in [0.0, 0.37, 3.2, 6.9] {
            let wave: Vec<f64> = (0..samples).map(|n| (2.0 * PI * multiple * n as f64 / 240.0 + 0.4).cos()).collect();
            let part = |k: usize| (0..samples).map(|n| window[(n, k)] * wave[n]).sum::<f64>();
            let parts: Vec<f64> = (0..window.ncols()).map(part).collect();
            let error = |n: usize| wave[n] - parts.iter().enumerate().map(|(k, p)| p * window[(n, k)]).sum::<f64>();
            let error = (0..samples).map(|n| error(n).powi(2)).sum::<f64>().sqrt();
            assert!(error < 1e-3, "{multiple}: {error}");
        }
    }
}
