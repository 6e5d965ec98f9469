//! Eigenvalues continued from a state of the same bodies whose spectrum is known.
//!
//! The tracked ones are the roots that Newton's method finds from the known ones on det(1 − KG) P with all others
//! divided out where they were; the others stay where they were. That no unstable one is missing is counted along the
//! imaginary axis, at the frequencies of the others: with the continued roots exact and the others near theirs, what is
//! left of the determinant has no zeros in the right half-plane but those that are missing. Where one root does not
//! settle, goes far, or meets another one, or the count is not certain, there is no answer, and the spectrum has to be
//! searched for as a whole.

use super::{Last, Secular, C, CONTINUED, FAR, LAST};
use crate::contact::LinearContact;
use crate::model::CoupledModel;
use crate::stability::reduced::{check, Eigenpair};
use crate::Result;
use std::f64::consts::FRAC_PI_2;

/// Distance of the frequencies at which roots that are not tracked are looked for, over their damping ratio.
const NEARER: f64 = 0.3;

/// Spectrum of a state from which those of others are continued.
#[derive(Debug, Clone)]
pub struct KnownSpectrum {
    /// Roots with Im > 0 that are continued, 1/s.
    pub(super) tracked: Vec<C>,
    /// The other ones, 1/s.
    pub(super) others: Vec<C>,
    /// Relaxations of the contact that are as little damped as what is listed, 1/s.
    relaxations: Vec<C>,
}

impl KnownSpectrum {
    /// Spectrum of the last state of this rank, of which the eigenvalues `wanted` are tracked; none where it was not
    /// found by what the contact sees.
    pub fn of_last(wanted: &[C]) -> Option<Self> {
        let Last { roots, relaxations, contact, .. } = LAST.with_borrow(Last::clone);
        if contact.is_empty() {
            return None;
        }
        let is_wanted = |v: &C| wanted.iter().any(|w| (w - v).norm() <= 1e-9 * v.norm());
        let (tracked, others): (Vec<C>, Vec<C>) = roots.into_iter().partition(is_wanted);
        (!tracked.is_empty()).then_some(Self { tracked, others, relaxations })
    }

    /// Number of eigenvalues that are continued.
    pub fn tracked(&self) -> usize {
        self.tracked.len()
    }
}

/// The tracked eigenvalues of `known` in another state of the same bodies, or of bodies a little different, with Im > 0
/// and their modal amplitudes, by falling growth rate, each with a backward error of at most `tolerance` (as
/// [`eigenvalues`](super::eigenvalues) has it). None where it is not certain that they are these, and that no other one
/// is unstable.
pub fn continued(
    bodies: &CoupledModel,
    contact: &LinearContact,
    known: &KnownSpectrum,
    [ratio, tolerance]: [f64; 2],
) -> Result<Option<Vec<Eigenpair>>> {
    check(bodies, contact)?;
    let relaxations = Some(&known.relaxations[..]);
    let Some(mut secular) = Secular::with_relaxations(bodies, contact, ratio, relaxations)? else { return Ok(None) };
    let Some(mut roots) = secular.tracked(known) else { return Ok(None) };
    roots.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    Ok(secular.motions(bodies, &roots, tolerance))
}

/// Logarithms of the frequencies of `roots`, ascending, no two nearer than a part of the damping ratio there: one that
/// has left its place shows in the determinant at its frequency, over a width of its damping ratio.
fn frequencies(roots: &[C]) -> Vec<f64> {
    let mut all: Vec<[f64; 2]> = roots.iter().map(|v| [v.im.ln(), -v.re / v.norm()]).collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut kept: Vec<f64> = Vec::new();
    for [u, ratio] in all {
        if kept.last().is_none_or(|last| u - last > NEARER * ratio) {
            kept.push(u);
        }
    }
    kept
}

impl Secular {
    /// The tracked roots of `known` here.
    fn tracked(&mut self, known: &KnownSpectrum) -> Option<Vec<C>> {
        // One that grows and stays where it was would stand for one that is missing.
        if known.others.iter().any(|v| v.re >= 0.0) {
            return None;
        }
        let first = known.others.len();
        let (mut all, left) = self.settled(known.others.clone(), known.tracked.clone());
        let near = |(v, before): (&C, &C)| (v - before).norm() <= FAR * before.norm();
        let same = all.len() == first + known.tracked.len() && all[first..].iter().zip(&known.tracked).all(near);
        if !same || !left.is_empty() {
            return None;
        }
        self.angle = FRAC_PI_2;
        (self.missing_by(&all, &frequencies(&known.others))? == 0).then(|| all.split_off(first))
    }

    /// The eigenpairs of `roots` without the unknowns of the contact; none where one has a backward error of more than
    /// `tolerance`.
    fn motions(&self, bodies: &CoupledModel, roots: &[C], tolerance: f64) -> Option<Vec<Eigenpair>> {
        let (forces, seen) = self.forces(roots);
        let errors = self.errors(bodies, roots, (&forces, &seen), CONTINUED);
        let modal = self.modes.motions(roots, &forces);
        let pair = |(l, (&value, backward_error)): (usize, (&C, f64))| {
            let modal = modal.col_as_slice(l).to_vec();
            Eigenpair { value, modal, tangential: Vec::new(), backward_error }
        };
        let good = errors.iter().all(|e| *e <= tolerance);
        good.then(|| roots.iter().zip(errors).enumerate().map(pair).collect())
    }
}
