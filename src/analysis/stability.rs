//! The analysis `stability`: which modes grow about steady sliding of the whole contact, and how fast.

use super::bodies::Bodies;
use super::interface::steady_sliding;
use super::reduction::Reduction;
use super::report::Summary;
use super::run::Run;
use super::steps::Needs;
use super::{complex_modes, full_stability, memory};
use crate::contact::sliding::SlidingSolution;
use crate::contact::LinearContact;
use crate::grid::Interface;
use crate::job::{self, Job};
use crate::model::ModalPair;
use crate::output::datasets::stability::{eigenvalues, sliding_state};
use crate::stability::reduced::{participation, Eigenpair};
use crate::stability::{frequency_reach, spectrum, Spectrum};
use crate::{Error, Result};

/// Collective: stability on the reduced model and, where the job asks for it, on the full system; tables under `/stability`.
pub(super) fn run(
    run: &mut Run,
    stability: &job::Stability,
    contact: &job::Contact,
    parts: &Parts,
) -> Result<Option<Found>> {
    let world = run.world();
    let Parts { bodies, shapes, model } = parts;
    run.progress.stage("stability of steady sliding");
    let found = world.on_root(|| {
        let root = model.root()?;
        let found = analyse(stability, contact, &root.interface, &root.pair)?;
        let problem = steady_sliding((&root.interface, &root.pair), contact, stability.direction);
        let smallest = memory::smallest(&contact.friction, |law| memory::sliding(&problem, law, &root.pair))?;
        Ok((found, smallest))
    })?;
    let (found, smallest) = found.unzip();
    let full = match &stability.full {
        Some(wanted) => {
            shapes.map_err(Clone::clone)?;
            let reduced = found.as_ref().zip(model.on_root()).map(|(f, root)| (&f.spectrum, &f.contact, &root.pair));
            Some(full_stability::run(run, wanted, bodies, reduced)?)
        }
        None => None,
    };
    if let (Some(Found { sliding, spectrum, .. }), Some(root)) = (&found, model.on_root()) {
        run.file.tables(eigenvalues(spectrum, &root.pair, full.as_ref()));
        run.file.tables(sliding_state(sliding, contact.friction.memory().is_some()));
        summarise(spectrum, &root.pair, &mut run.summary);
        memory::say(&contact.friction, smallest.unwrap_or_default(), &mut run.file, &mut run.summary);
        if sliding.reversed > 0 {
            let (reversed, closed) = (sliding.reversed, sliding.closed.len());
            let text = format!("{reversed} of {closed}: the creepage is too small for full sliding");
            run.summary.value("nodes that would stick", text);
        }
        if let Some(full) = &full {
            full_stability::summarise(full, &mut run.summary);
        }
    }
    match shapes {
        _ if !writes_shapes(run.job) => {}
        Ok(()) => {
            run.progress.stage("complex modes");
            let reduced = found.as_ref().zip(model.on_root()).map(|(f, root)| (f, &root.pair));
            complex_modes::run(run, stability, bodies, reduced, full.as_ref())?;
        }
        Err(e) => run
            .summary
            .value("complex modes", format!("not written, for want of the mode shapes of the earlier run: {e}")),
    }
    Ok(found)
}

/// Whether complex modes are to be written.
pub(super) fn writes_shapes(job: &Job) -> bool {
    job.output.fields && job.analyses.stability.as_ref().is_some_and(|s| s.shapes > 0)
}

/// What the analysis needs of the bodies: those of the full system come with their displacements.
pub(super) fn needs(job: &Job, wanted: &job::Stability) -> Needs {
    let full = wanted.full.is_some();
    Needs { solvers: writes_shapes(job) && !full, shapes: writes_shapes(job) || full }
}

/// What the bodies give.
pub(super) struct Parts<'a> {
    pub(super) bodies: &'a Bodies<'a>,
    /// Whether the bodies have their mode shapes, or why an earlier run does not give them.
    pub(super) shapes: std::result::Result<(), &'a Error>,
    pub(super) model: &'a Reduction,
}

/// What rank 0 found on the reduced model.
pub(super) struct Found {
    pub(super) sliding: SlidingSolution,
    pub(super) contact: LinearContact,
    pub(super) spectrum: Spectrum,
}

/// On rank 0: the sliding state and the eigenvalues about it.
pub(super) fn analyse(
    stability: &job::Stability,
    contact: &job::Contact,
    interface: &Interface,
    pair: &ModalPair,
) -> Result<Found> {
    let problem = steady_sliding((interface, pair), contact, stability.direction);
    let sliding = problem.solve()?;
    if sliding.closed.is_empty() {
        return Err(Error::Job(
            "analyses.stability: the contact is open, so nothing slides; raise contact.approach or give a normal_load"
                .into(),
        ));
    }
    memory::refuse_short(&contact.friction, |law| memory::sliding(&problem, law, pair))?;
    let contact = problem.contact(&sliding);
    let spectrum = spectrum(stability, pair, &contact, frequency_reach(pair))?;
    Ok(Found { sliding, contact, spectrum })
}

pub(super) fn summarise(spectrum: &Spectrum, model: &ModalPair, summary: &mut Summary) {
    let unstable: Vec<&Eigenpair> = spectrum.eigenpairs.iter().filter(|e| e.growth_rate() > 0.0).collect();
    summary.line(format!(
        "stability of steady sliding: {} unstable of {} eigenvalues{}, {} closed contacts",
        unstable.len(),
        spectrum.eigenpairs.len(),
        if spectrum.limit.is_finite() { format!(" up to {:.0} Hz", spectrum.limit) } else { String::new() },
        spectrum.closed
    ));
    let most = unstable.len().max(3);
    for e in spectrum.eigenpairs.iter().take(most) {
        summary.value(
            &format!("{:.3} Hz", e.frequency()),
            format!("growth rate {:+.4} 1/s; {}", e.growth_rate(), partners(model, e)),
        );
    }
}

/// The free modes that make up an eigenvector, the largest shares first.
fn partners(model: &ModalPair, pair: &Eigenpair) -> String {
    let mut shares: Vec<(usize, f64)> = participation(model, pair).into_iter().enumerate().collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    let named = shares.iter().take(3).filter(|(_, s)| *s > 0.01).map(|&(k, share)| {
        let upper = k >= model.lower_modes;
        let number = if upper { k - model.lower_modes } else { k } + 1;
        let place = ["lower", "upper"][usize::from(upper)];
        format!("{:.0} % {place} mode {number}", 100.0 * share)
    });
    named.collect::<Vec<_>>().join(", ")
}
