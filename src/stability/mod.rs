//! Which modes grow about steady rolling or sliding, and how fast: on the reduced model and on the full system.

pub mod confirmation;
pub mod criterion;
pub mod dense;
mod equilibrium;
pub mod full;
pub mod nonlinear_eigen;
pub(crate) mod point;
pub mod reduced;
pub(crate) mod rightmost;
pub mod sensitivity;

use crate::contact::LinearContact;
use crate::job;
use crate::model::CoupledModel;
use crate::{Error, Result};
use nonlinear_eigen::SpectrumMemory;
use num_complex::Complex;
use reduced::{eigenpairs, Eigenpair};

pub use equilibrium::Equilibrium;

/// Growth relative to the eigenvalue, and to the backward error, that rounding may make.
const ROUNDING: [f64; 2] = [1e-10, 100.0];
/// Smallest size that an eigenvalue is measured by, 1/s: motions that only drift have none of their own.
const DRIFT: f64 = 100.0;

/// Eigenvalues smaller than this, 1/s, are rigid motions: free bodies, and slides against a friction that does not
/// change, have zeros in pairs, which rounding moves by √ε times the highest frequency.
const RIGID: f64 = 0.01;

/// True for a rigid motion, whose eigenvalue is zero but for rounding.
pub(crate) fn is_rigid(value: Complex<f64>) -> bool {
    value.norm() < RIGID
}

/// Imaginary part of an eigenvalue over its modulus from which on it oscillates; below it is rounding.
const OSCILLATION: f64 = 1e-6;

/// True for an eigenvalue with a frequency; the others grow or decay without oscillation.
pub fn oscillates(value: Complex<f64>) -> bool {
    value.im.abs() > OSCILLATION * value.norm()
}

/// True for a motion of the eigenvalue `value` (1/s), found with `backward_error`, that is not rigid and grows by more
/// than rounding: the only rule by which anything is called unstable.
///
/// ```
/// use num_complex::Complex;
/// use railsqueal::stability::grows;
///
/// assert!(grows(Complex::new(2.8, 6063.0), 1e-12));
/// assert!(!grows(Complex::new(1e-9, 6063.0), 1e-12));
/// ```
pub fn grows(value: Complex<f64>, backward_error: f64) -> bool {
    !is_rigid(value) && value.re > (ROUNDING[0] + ROUNDING[1] * backward_error) * value.norm().max(DRIFT)
}

/// Eigenvalues about steady sliding.
#[derive(Default)]
pub struct Spectrum {
    /// One of each conjugate pair, by falling growth rate, up to the frequency limit and the damping ratio; and all
    /// that grow.
    pub eigenpairs: Vec<Eigenpair>,
    /// All finite eigenvalues, both of each conjugate pair; of many modes without the relaxations of the contact.
    pub all: Vec<Complex<f64>>,
    /// Highest frequency kept, Hz; infinite where the modes are all there are.
    pub limit: f64,
    /// Number of closed contacts.
    pub closed: usize,
    /// Number of those that stick.
    pub sticking: usize,
}

/// On rank 0: the eigenvalues about a sliding contact. The search begins from what `memory` has of the state before.
pub fn spectrum(
    stability: &job::Stability,
    pair: &CoupledModel,
    contact: &LinearContact,
    memory: &SpectrumMemory,
) -> Result<Spectrum> {
    by(nonlinear_eigen::eigenpairs, stability, (pair, contact), memory)
}

/// The same where nothing but the eigenvalues is asked for: of many modes those with Im λ ≥ 0 alone, without their
/// motions.
pub fn eigenvalues(
    stability: &job::Stability,
    pair: &CoupledModel,
    contact: &LinearContact,
    memory: &SpectrumMemory,
) -> Result<Spectrum> {
    by(nonlinear_eigen::eigenvalues, stability, (pair, contact), memory)
}

/// The same as [`spectrum`] of the eigenvalues that are tracked from a known one; none where it is not certain that
/// they are these. Where `is_counted` says so of them, other unstable ones are counted.
pub fn track(
    stability: &job::Stability,
    pair: &CoupledModel,
    contact: &LinearContact,
    known: &nonlinear_eigen::KnownSpectrum,
    is_counted: &dyn Fn(&[Eigenpair]) -> bool,
    memory: &SpectrumMemory,
) -> Result<Option<(Spectrum, nonlinear_eigen::Count)>> {
    let limit = limit(stability, pair)?;
    let bounds = [stability.damping_ratio, stability.tolerance];
    let found = nonlinear_eigen::track(pair, contact, known, bounds, is_counted, memory)?;
    let Some(found) = found else { return Ok(None) };
    let nonlinear_eigen::TrackedSpectrum { pairs, count } = found;
    let all = pairs.iter().map(|p| p.value).collect();
    let eigenpairs = listed_pairs(stability, pairs, limit);
    let spectrum = Spectrum { eigenpairs, all, limit, closed: contact.nodes.len(), sticking: contact.sticking() };
    Ok(Some((spectrum, count)))
}

/// The spectrum, of many modes as `few` gives it.
fn by(
    few: Few,
    stability: &job::Stability,
    (pair, contact): (&CoupledModel, &LinearContact),
    memory: &SpectrumMemory,
) -> Result<Spectrum> {
    let limit = limit(stability, pair)?;
    let pairs = match by_functions(few, stability, (pair, contact), memory)? {
        Some(pairs) => pairs,
        None => {
            let pairs = eigenpairs(pair, contact, stability.tolerance)?;
            memory.begin_at(pairs.iter().map(|p| p.value));
            pairs
        }
    };
    let all = pairs.iter().map(|p| p.value).collect();
    let kept = listed_pairs(stability, pairs, limit);
    Ok(Spectrum { eigenpairs: kept, all, limit, closed: contact.nodes.len(), sticking: contact.sticking() })
}

/// Function that [`nonlinear_eigen`] supplies.
type Few = fn(&CoupledModel, &LinearContact, [f64; 2], &SpectrumMemory) -> Result<Option<Vec<Eigenpair>>>;

/// On rank 0: the first of those that [`spectrum`] lists, of many modes without its motion.
pub(crate) fn least_stable(
    stability: &job::Stability,
    pair: &CoupledModel,
    contact: &LinearContact,
    memory: &SpectrumMemory,
) -> Result<Option<Eigenpair>> {
    let limit = limit(stability, pair)?;
    if let Some(pairs) = by_functions(nonlinear_eigen::eigenvalues, stability, (pair, contact), memory)? {
        return Ok(pairs.into_iter().find(|e| listed(stability, e, limit)));
    }
    rightmost::rightmost(pair, contact, stability.tolerance, |e| listed(stability, e, limit))
}

/// Modes from which on their eigenvalues are found by what the contact sees of them: with fewer the dense pencil
/// takes no longer.
const MANY: usize = 200;

/// The eigenvalues that may be listed, of many modes that the contact sees as few functions; none where it is not
/// certain that these are all.
fn by_functions(
    few: Few,
    stability: &job::Stability,
    (pair, contact): (&CoupledModel, &LinearContact),
    memory: &SpectrumMemory,
) -> Result<Option<Vec<Eigenpair>>> {
    // The full system is looked through with the whole spectrum as its guide. What a body carries past the contact is
    // none of the few functions.
    if pair.omega.len() < MANY || stability.full.is_some() || pair.carried.is_some() {
        return Ok(None);
    }
    few(pair, contact, [stability.damping_ratio, stability.tolerance], memory)
}

/// The highest frequency that is kept, Hz, infinite where the modes are all there are.
fn limit(stability: &job::Stability, pair: &CoupledModel) -> Result<f64> {
    let reach = pair.reach;
    let limit = stability.max_frequency.unwrap_or(reach);
    match limit > reach * (1.0 + 1e-12) {
        false => Ok(limit),
        true => Err(Error::Job(format!(
            "analyses.stability.max_frequency is {limit} Hz, but the modes of the bodies reach {reach:.1} Hz only; \
             ask for more modes in analyses.modes or for a lower limit"
        ))),
    }
}

/// Members of `pairs` that are listed, by the frequency `limit`, Hz.
pub(crate) fn listed_pairs(stability: &job::Stability, pairs: Vec<Eigenpair>, limit: f64) -> Vec<Eigenpair> {
    pairs.into_iter().filter(|e| listed(stability, e, limit)).collect()
}

/// Returns whether an eigenvalue is listed: up to the frequency `limit`, Hz, and the damping ratio, or because it
/// grows.
fn listed(stability: &job::Stability, e: &Eigenpair, limit: f64) -> bool {
    // What the full system has within its wedge must find its partner, at the edge as well.
    let least = stability.full.as_ref().map_or(0.0, |f| 1.5 * f.damping_ratio);
    let ratio = stability.damping_ratio.max(least);
    let damped = ratio < 1.0 && e.damping_ratio().abs() > ratio && !grows(e.value, e.backward_error);
    // A real matrix has its complex eigenvalues in conjugate pairs: one of each says all.
    e.value.im >= 0.0 && e.frequency() <= limit && !damped
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Zeros of free bodies with the rounding that was seen, beside a wave that hardly grows and a growth without
    /// oscillation.
    #[test]
    fn rigid_motions_and_rounding_do_not_grow() {
        let grows = |re: f64, im: f64| grows(Complex::new(re, im), 1e-15);
        assert!(!grows(1e-3, 0.0) && !grows(2e-8, 1e-4) && !grows(1e-9, 6e3) && !grows(-1.0, 6e3));
        assert!(grows(0.1, 6e3) && grows(1e-5, 6e3) && grows(1588.0, 0.0));
    }
}
