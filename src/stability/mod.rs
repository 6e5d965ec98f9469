//! Which modes grow about steady sliding of the whole contact, and how fast: on the reduced model and on the full system.

pub mod dense;
pub mod full;
pub mod reduced;

use crate::contact::LinearContact;
use crate::job;
use crate::model::ModalPair;
use crate::{Error, Result};
use num_complex::Complex;
use reduced::{eigenpairs, Eigenpair};

/// Eigenvalues about steady sliding.
pub struct Spectrum {
    /// One of each conjugate pair, by falling growth rate, up to the frequency limit.
    pub eigenpairs: Vec<Eigenpair>,
    /// All finite eigenvalues, both of each conjugate pair.
    pub all: Vec<Complex<f64>>,
    /// Highest frequency kept, Hz; infinite where the modes are all there are.
    pub limit: f64,
    /// Number of closed contacts.
    pub closed: usize,
}

/// On rank 0: the eigenvalues about a sliding contact.
pub fn spectrum(stability: &job::Stability, pair: &ModalPair, contact: &LinearContact) -> Result<Spectrum> {
    let reach = pair.reach;
    let limit = stability.max_frequency.unwrap_or(reach);
    if limit > reach * (1.0 + 1e-12) {
        return Err(Error::Job(format!(
            "analyses.stability.max_frequency is {limit} Hz, but the modes of the bodies reach {reach:.1} Hz only; \
             ask for more modes in analyses.modes or for a lower limit"
        )));
    }
    let pairs = eigenpairs(pair, contact, stability.tolerance)?;
    let all = pairs.iter().map(|p| p.value).collect();
    // A real matrix has its complex eigenvalues in conjugate pairs: one of each says all.
    let kept = pairs.into_iter().filter(|e| e.value.im >= 0.0 && e.frequency() <= limit).collect();
    Ok(Spectrum { eigenpairs: kept, all, limit, closed: contact.nodes.len() })
}
