//! Stability of steady sliding on the full finite-element system: the quadratic eigenproblem of both bodies with the
//! pressures of the closed nodes as multipliers, by successive shifts up the imaginary axis.

mod columns;
pub mod completeness;
pub(crate) mod coupling;
mod damping;
mod full_body;
pub(super) mod inverse;
pub(crate) mod pairs;
pub(crate) mod residuals;
mod rotation_correction;
mod shift;
pub mod system;
mod transposed;

use super::confirmation::{Confirmation, ConfirmationRequest, Problem};
use super::grows;
use crate::body::fe::BodyModes;
use crate::body::FullSystem;
use crate::contact::LinearContact;
use crate::eigen::sparse::Method;
use crate::petsc::{Petsc, Span};
use crate::progress::Progress;
use crate::{Error, Result};
use completeness::{Disc, Wedge};
use num_complex::Complex;
use pairs::{FullEigenpair, ShiftSpectrum};
use residuals::Residuals;
use system::System;

pub use coupling::Coupling;
pub use damping::{DampedBody, RayleighDamping, Spin};

type C = Complex<f64>;

/// Largest accepted change of an eigenvector by one more inverse iteration.
const CORRECTION_LIMIT: f64 = 1e-7;
/// Residual that SLEPc iterates to from a pair that was found, and vectors of its spaces.
const CONFIRMED: (f64, usize) = (1e-8, 4);

/// Settings of the computation.
#[derive(Debug, Clone, Copy)]
pub struct FullOptions {
    /// Eigenvalues up to this frequency, Hz.
    pub max_frequency: f64,
    /// and up to this damping ratio of either sign.
    pub damping_ratio: f64,
    /// Eigenvalues per shift, about.
    pub count: usize,
    /// Largest accepted backward error and constraint violation.
    pub tolerance: f64,
    /// Who computes.
    pub method: Method,
}

/// One eigenvalue of the full system with its mode.
#[derive(Debug, Clone)]
pub struct FullPair {
    /// λ, 1/s.
    pub value: C,
    /// This rank's degrees of freedom of the lower and of the upper body (in lower form), of Euclidean norm 1 together.
    pub motion: [Vec<C>; 2],
    /// Pressures of the closed nodes with that motion, N, `[k]`, on every rank.
    pub pressure: Vec<C>,
    /// Reactions of the closed nodes, N, rows (x, y, n), `[3k]`, on every rank.
    pub forces: Vec<C>,
    /// Power of each body's own damping with this motion over |λ|²: uᴴ C u, N·s/m.
    pub damping: [f64; 2],
    /// Contribution of rotation to uᴴ K u of each body, N/m.
    pub stiffening: [f64; 2],
    /// Its residuals.
    pub residuals: Residuals,
    /// SLEPc's confirmation of it, if it grows.
    pub confirmation: Option<Confirmation>,
}

/// A shift that was worked at.
#[derive(Debug, Clone, Copy)]
pub struct ShiftReport {
    /// The shift, 1/s.
    pub shift: C,
    /// Radius within which everything is known, 1/s.
    pub radius: f64,
    /// Eigenvalues found.
    pub found: usize,
    /// Solves.
    pub solves: usize,
    /// True if solutions had to be corrected for what the modes do not see of rotation.
    pub corrected: bool,
}

/// The spectrum in the wedge.
#[derive(Debug, Clone)]
pub struct FullSpectrum {
    /// Eigenpairs by rising frequency.
    pub pairs: Vec<FullPair>,
    /// The shifts in the order in which they were worked at.
    pub shifts: Vec<ShiftReport>,
}

/// The full spectrum beside the reduced one; the pairs by falling growth rate.
pub struct FullResult {
    /// Spectrum and shifts.
    pub spectrum: FullSpectrum,
    /// On rank 0: share of each free mode in each pair.
    pub shares: Vec<Vec<f64>>,
    /// On rank 0: modal amplitudes of each pair, lower body first.
    pub amplitudes: Vec<Vec<C>>,
    /// On rank 0: place of each pair's partner among the reduced eigenpairs.
    pub partners: Vec<Option<usize>>,
}

/// The bodies of the full system.
#[derive(Clone, Copy)]
pub struct FullBodies<'a, 'b> {
    /// The bodies that differ.
    pub bodies: &'b [&'a dyn FullSystem],
    /// Free modes of each of them, whose frequencies the shifts avoid, or none.
    pub modes: &'b [&'a BodyModes],
    /// The lower and the upper body.
    pub places: &'b [DampedBody; 2],
}

/// Collective: the eigenpairs of the bodies in sliding contact up to a frequency. `reduced` are the eigenvalues of
/// the reduced model (both of each conjugate pair), which say where to look.
pub fn spectrum<'a>(
    petsc: &'a Petsc<'a>,
    FullBodies { bodies, modes, places }: FullBodies<'a, '_>,
    contact: &LinearContact,
    reduced: &[C],
    options: &FullOptions,
    progress: &mut Progress,
) -> Result<FullSpectrum> {
    let wedge = Wedge::new(options.max_frequency, options.damping_ratio);
    let poles: Vec<f64> = modes.iter().flat_map(|m| m.omega.iter().copied()).collect();
    let mut system = System::new(petsc, bodies, modes, places, Coupling::new(contact)?, 0.5 * wedge.height)?;
    let mut from = 0.0;
    let (mut discs, mut pairs, mut shifts) = (Vec::new(), Vec::new(), Vec::new());
    while from < wedge.height {
        let next = completeness::next(&wedge, from, options.count, reduced, &poles, |height| {
            places[0].damping.on_curve(height).map_or(C::new(0.0, height), |on| on.0)
        });
        let shift = system.shift_to(next.height)?;
        let mut count = next.count;
        let mut attempt = 0;
        let (disc, found) = loop {
            let (found, report) = around(petsc, &mut system, shift, (count, next.reach), options, progress)?;
            let disc = Disc { centre: shift, radius: report.radius, found: found.iter().map(|p| p.value).collect() };
            shifts.push(report);
            match wedge.covered(&disc) {
                Some((low, high)) if low <= from && high > from => break (disc, found),
                _ if attempt == 3 => break (disc, found),
                _ => {}
            }
            attempt += 1;
            count += count / 2 + 2;
        };
        let reached = wedge.covered(&disc).filter(|c| c.0 <= from).map_or(from, |c| c.1);
        discs.push(disc);
        pairs.push(found);
        if reached <= from {
            break;
        }
        from = reached;
    }
    let kept = completeness::merge(&discs, &wedge)?;
    let mut slots: Vec<Vec<Option<FullPair>>> = pairs.into_iter().map(|l| l.into_iter().map(Some).collect()).collect();
    let pairs = kept.into_iter().filter_map(|(d, i)| slots[d][i].take()).collect();
    Ok(FullSpectrum { pairs, shifts })
}

/// Collective: the eigenpairs around the shift at which the system stands.
fn around(
    petsc: &Petsc,
    system: &mut System,
    shift: C,
    wanted: (usize, f64),
    options: &FullOptions,
    progress: &mut Progress,
) -> Result<(Vec<FullPair>, ShiftReport)> {
    let hertz = shift.im / (2.0 * std::f64::consts::PI);
    let mut told = |done, of| progress.converged(&format!("eigenvalues about {hertz:.0} Hz"), done, of);
    let around = system
        .nearest(petsc, options.method, wanted, &mut told)
        .map_err(|e| e.context(format!("stability, full system, shift at {hertz:.1} Hz")))?;
    if around.corrected {
        progress.note(format!(
            "shift at {hertz:.0} Hz: the modes see little of the rotation there, so that each solution is \
             corrected; more modes in analyses.modes make it faster"
        ));
    }
    let confirmations = confirm(petsc, system, &around.pairs, options)?;
    let mut pairs = Vec::new();
    for (FullEigenpair { value, vector, residuals }, confirmation) in around.pairs.iter().zip(confirmations) {
        let (value, x, residuals) = (*value, &vector[..], *residuals);
        let worst = residuals.backward_error.max(residuals.constraint);
        if !(worst <= options.tolerance && residuals.correction <= CORRECTION_LIMIT) {
            return Err(Error::NotConverged(format!(
                "stability, full system: the method takes the eigenvalue {value:.6e} 1/s for converged, but its \
                 backward error is {:.1e} and its \
                 violation of the closed contact {:.1e} (analyses.stability.full.tolerance is {:.1e}), and one \
                 more inverse iteration changes it by {:.1e} \
                 (limit {CORRECTION_LIMIT:.0e})",
                residuals.backward_error, residuals.constraint, options.tolerance, residuals.correction
            )));
        }
        let (motion, pressure) = system.split(x);
        let forces = system.reactions(value, x);
        let (mut damping, stiffening) = (system.dissipation(x), system.stiffening(x));
        // The symmetric part of what rotation adds keeps energy, the skew one does work.
        for (damping, stiffening) in damping.iter_mut().zip(&stiffening) {
            *damping += value.im * stiffening.im / value.norm_sqr();
        }
        let stiffening = stiffening.map(|s| s.re);
        pairs.push(FullPair { value, motion, pressure, forces, damping, stiffening, residuals, confirmation });
    }
    let ShiftSpectrum { radius, solves, corrected, .. } = around;
    let radius = radius * (1.0 - 1e-9);
    let report = ShiftReport { shift, radius, found: pairs.len(), solves, corrected };
    Ok((pairs, report))
}

/// Collective: SLEPc's confirmation of each of the pairs `found` around the shift that grows and is promised, where
/// SLEPc is asked for. Systems that turn are left out: each of many single solutions is corrected there.
fn confirm(
    petsc: &Petsc,
    system: &mut System,
    found: &[FullEigenpair],
    options: &FullOptions,
) -> Result<Vec<Option<Confirmation>>> {
    let wedge = Wedge::new(options.max_frequency, options.damping_ratio);
    let unstable = |p: &FullEigenpair| wedge.holds(p.value) && grows(p.value, p.residuals.backward_error);
    let which: Vec<usize> = (0..found.len()).filter(|&i| unstable(&found[i])).collect();
    let mut all = vec![None; found.len()];
    if which.is_empty() || options.method != Method::Slepc || system.turns() {
        return Ok(all);
    }
    let left = system.left_vectors(found, &which)?;
    let (norms, rate, shift) = (system.norms, system.rate(), system.sigma);
    let problem = Problem { petsc, span: Span::World, norms, rate, system: "stability of the full system" };
    for (&i, left) in which.iter().zip(&left) {
        let FullEigenpair { value, vector, .. } = &found[i];
        let asked = ConfirmationRequest { value: *value, shift, right: vector, left, effort: CONFIRMED };
        all[i] = problem.confirm(system, &asked)?;
    }
    Ok(all)
}
