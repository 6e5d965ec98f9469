//! Eigenvalues continued from a state of the same bodies whose spectrum is known.
//!
//! The tracked ones are the roots that Newton's method finds from the known ones on det(1 − KG) P with all others
//! divided out where they were. Known ones move with the poles of the bodies nearest to them: damping that changes
//! moves all of them. For the tracked roots the contact is interpolated over their frequencies alone, and coarsely;
//! each is then corrected with the contact at its own place ([`refinement`](super::refinement)). Where one root does
//! not settle, goes far, or meets another one, there is no answer, and the spectrum has to be searched for as a whole.
//!
//! A count on request tells that no unstable one is missing, along the imaginary axis, at the frequencies of the
//! others: with the continued roots exact and the others near theirs, what is left of the determinant has no zeros in
//! the right half-plane but those that are missing. For the count the contact is interpolated over the frequencies of
//! all modes.

use super::eigenvectors::{looked_at, squares};
use super::modal_compliance::SampledCompliance;
use super::refinement::RefinedPairs;
use super::{LastSpectrum, NonlinearEigenproblem, SpectrumMemory, C, CONTINUED, FAR};
use crate::contact::LinearContact;
use crate::model::CoupledModel;
use crate::stability::reduced::{check, Eigenpair};
use crate::Result;
use faer::Mat;
use std::f64::consts::FRAC_PI_2;
use std::rc::Rc;

/// Distance of the frequencies at which roots that are not tracked are looked for, over their damping ratio.
const NEARER: f64 = 0.3;
/// Logarithm of frequency by which the contact is interpolated beyond the tracked roots, over the part of their size by
/// which they may move, and over their largest damping ratio.
const BESIDE: [f64; 2] = [2.0, 2.0];

/// Spectrum of a state from which those of others are continued.
#[derive(Debug, Clone)]
pub struct KnownSpectrum {
    /// Roots with Im > 0 that are continued, 1/s.
    pub(super) tracked: Vec<C>,
    /// The other ones, 1/s.
    pub(super) others: Vec<C>,
    /// Poles of the bodies, by falling frequency, 1/s.
    poles: Vec<C>,
    /// Relaxations of the contact that are as little damped as what is listed, 1/s.
    relaxations: Vec<C>,
    /// Places on the imaginary axis where unstable ones are counted.
    axis: Option<Rc<SampledCompliance>>,
}

impl KnownSpectrum {
    /// Spectrum of a `state`, of which the eigenvalues `wanted` are tracked; none where it was not found by what the
    /// contact sees, or none of them is one of its roots.
    pub(crate) fn of_state(state: &LastSpectrum, wanted: &[C]) -> Option<Self> {
        let last = state.last();
        if last.contact.is_empty() {
            return None;
        }
        let is_wanted = |v: &C| wanted.iter().any(|w| (w - v).norm() <= 1e-9 * v.norm());
        let (tracked, others): (Vec<C>, Vec<C>) = last.roots.iter().copied().partition(is_wanted);
        let on_axis = |u: f64| C::from_polar(u.exp(), FRAC_PI_2);
        let values = || frequencies(&others).into_iter().map(on_axis).collect();
        let axis = state.modes().map(|modes| Rc::new(SampledCompliance::new(values(), modes)));
        let (poles, relaxations) = (by_frequency(&last.poles), last.relaxations.clone());
        (!tracked.is_empty()).then_some(Self { tracked, others, poles, relaxations, axis })
    }

    /// Estimate of this spectrum in a state whose bodies have the poles `now`: each eigenvalue has moved by as much as
    /// the pole nearest to it, if there are as many poles and none has gone far.
    fn at_poles(&self, now: &[C]) -> Self {
        let mut moved = self.clone();
        if now.len() != self.poles.len() {
            return moved;
        }
        let now = by_frequency(now);
        if now.iter().zip(&self.poles).any(|(a, b)| (a - b).norm() > FAR * b.norm()) {
            return moved;
        }
        for value in moved.tracked.iter_mut().chain(&mut moved.others) {
            let far = |k: &usize| (self.poles[*k] - *value).norm_sqr();
            let nearest = (0..now.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
            *value += nearest.map_or(C::default(), |k| now[k] - self.poles[k]);
        }
        moved
    }

    /// Number of eigenvalues that are continued.
    pub fn tracked(&self) -> usize {
        self.tracked.len()
    }

    /// Range of the angular frequencies over which the contact is interpolated for the tracked ones.
    fn range(&self) -> [f64; 2] {
        let sizes = || self.tracked.iter().map(|v| v.norm());
        let (low, high) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
        let ratio = self.tracked.iter().map(|v| v.re.abs() / v.norm()).fold(0.0, f64::max);
        let beside = (BESIDE[0] * FAR).max(BESIDE[1] * ratio).exp();
        [low / beside, high * beside]
    }
}

/// Answer to the question whether unstable eigenvalues beside the continued ones are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// None was asked for.
    NotAsked,
    /// None is missing.
    Complete,
    /// Some are missing, or their number is not certain.
    Refused,
}

/// Eigenvalues continued to another state.
pub struct TrackedSpectrum {
    /// With Im > 0 and modal amplitudes, by falling growth rate.
    pub pairs: Vec<Eigenpair>,
    /// Answer on the unstable ones that are missing.
    pub count: Count,
}

/// The tracked eigenvalues of `known` in another state of the same bodies, or of bodies a little different, with Im > 0
/// and their modal amplitudes, by falling growth rate, each with a backward error of at most `tolerance` (as
/// [`eigenvalues`](super::eigenvalues) has it). None where it is not certain that they are these. Where `is_counted`
/// says so of them, the other unstable ones are counted.
pub fn track(
    bodies: &CoupledModel,
    contact: &LinearContact,
    known: &KnownSpectrum,
    [ratio, tolerance]: [f64; 2],
    is_counted: &dyn Fn(&[Eigenpair]) -> bool,
    memory: &SpectrumMemory,
) -> Result<Option<TrackedSpectrum>> {
    check(bodies, contact)?;
    // One that grows and stays where it was, or is taken to go to the left, would stand for one that is missing.
    let grows = |known: &KnownSpectrum| known.others.iter().any(|v| v.re >= 0.0);
    if grows(known) {
        return Ok(None);
    }
    let given = Some((&known.relaxations[..], known.range()));
    let Some(mut problem) = NonlinearEigenproblem::with_relaxations(bodies, contact, (ratio, given), memory)? else {
        return Ok(None);
    };
    let known = &known.at_poles(&problem.modes.poles);
    if grows(known) {
        return Ok(None);
    }
    let Some(mut roots) = problem.tracked(known) else { return Ok(None) };
    roots.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    let Some(refined) = problem.refined(&roots) else { return Ok(None) };
    let Some(pairs) = problem.motions(bodies, &refined, tolerance) else { return Ok(None) };
    let roots = refined.roots;
    let count = match is_counted(&pairs) {
        false => Count::NotAsked,
        true => problem.count(known, &roots),
    };
    Ok(Some(TrackedSpectrum { pairs, count }))
}

/// The `values` by falling frequency.
fn by_frequency(values: &[C]) -> Vec<C> {
    let mut all = values.to_vec();
    all.sort_by(|a, b| b.im.total_cmp(&a.im).then(b.re.total_cmp(&a.re)));
    all
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

impl NonlinearEigenproblem<'_> {
    /// The tracked roots of `known` here.
    fn tracked(&self, known: &KnownSpectrum) -> Option<Vec<C>> {
        let first = known.others.len();
        let (mut all, left) = self.settled(known.others.clone(), known.tracked.clone());
        let near = |(v, before): (&C, &C)| (v - before).norm() <= FAR * before.norm();
        let same = all.len() == first + known.tracked.len() && all[first..].iter().zip(&known.tracked).all(near);
        (same && left.is_empty()).then(|| all.split_off(first))
    }

    /// Counts the unstable eigenvalues beside the continued `roots`, with the others where they were.
    fn count(&mut self, known: &KnownSpectrum, roots: &[C]) -> Count {
        self.angle = FRAC_PI_2;
        let Some(along) = self.along_all() else { return Count::Refused };
        self.along = along;
        let all = [&known.others[..], roots].concat();
        match self.missing_by(&all, known.axis.as_deref()) {
            Some(0) => Count::Complete,
            _ => Count::Refused,
        }
    }

    /// The eigenpairs without the unknowns of the contact, by falling growth rate; none where one has a backward error
    /// of more than `tolerance`.
    fn motions(&self, bodies: &CoupledModel, of: &RefinedPairs, tolerance: f64) -> Option<Vec<Eigenpair>> {
        let modal = self.modes.motions(&of.roots, &of.forces);
        let some = looked_at(of.roots.len(), CONTINUED);
        let modal_of_some = Mat::from_fn(modal.nrows(), some.len(), |i, k| modal[(i, some[k])]);
        let found = (&of.forces[..], &of.motions, &squares(&modal)[..]);
        let errors = self.errors(bodies, &of.roots, found, (&some, modal_of_some));
        let pair = |(l, (&value, backward_error)): (usize, (&C, f64))| {
            let modal = modal.col_as_slice(l).to_vec();
            Eigenpair { value, modal, tangential: Vec::new(), backward_error }
        };
        let good = errors.iter().all(|e| *e <= tolerance);
        let mut pairs: Vec<Eigenpair> = of.roots.iter().zip(errors).enumerate().map(pair).collect();
        pairs.sort_by(|a, b| b.value.re.total_cmp(&a.value.re).then(b.value.im.total_cmp(&a.value.im)));
        good.then_some(pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eigenvalues move with the pole nearest to them; where poles have come, gone, or gone far, they stay.
    #[test]
    fn known_eigenvalues_move_with_the_poles() {
        let [first, second] = [C::new(-1.0, 99.0), C::new(-2.0, 200.0)];
        let (tracked, others) = (vec![C::new(-1.5, 100.0)], vec![C::new(-3.0, 203.0)]);
        let poles = by_frequency(&[first, second]);
        let known = KnownSpectrum { tracked, others, poles, relaxations: Vec::new(), axis: None };
        let moved = |poles: &[C]| {
            let moved = known.at_poles(poles);
            (moved.tracked[0], moved.others[0])
        };
        assert_eq!(moved(&[first, C::new(-4.0, 200.0)]), (C::new(-1.5, 100.0), C::new(-5.0, 203.0)));
        assert_eq!(moved(&[C::new(-4.0, 200.0), first]), (C::new(-1.5, 100.0), C::new(-5.0, 203.0)));
        let stayed = (known.tracked[0], known.others[0]);
        assert_eq!(moved(&[first]), stayed);
        assert_eq!(moved(&[first, C::new(-90.0, 200.0)]), stayed);
    }
}
