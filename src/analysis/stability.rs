//! The analysis `stability`: which modes grow about steady rolling or sliding, and how fast.

use super::reduction::Reduction;
use super::run::Run;
use super::steps::Requirements;
use super::{complex_modes, full_stability, point, sensitivity};
use crate::case::bodies::BuiltBodies;
use crate::case::interface::friction;
use crate::case::stability_problem::{StabilityProblem, StabilityResult};
use crate::case::well_posed;
use crate::job::{self, Job};
use crate::model::CoupledModel;
use crate::output::datasets::stability::{causes, confirmations, derivatives, eigenvalues, equilibrium, of_point};
use crate::stability::confirmation;
use crate::stability::criterion::{criteria, Criterion};
use crate::stability::full::FullResult;
use crate::stability::nonlinear_eigen::SpectrumMemory;
use crate::stability::reduced::{participation, Eigenpair};
use crate::stability::sensitivity::Sensitivities;
use crate::stability::{grows, is_rigid, oscillates, Spectrum};
use crate::summary::Summary;
use crate::{Error, Result};
use num_complex::Complex;

/// Collective: stability on the reduced model and, where the job asks for it, on the full system; tables under
/// `/stability`. What was found, on rank 0 and of the full system.
pub(super) fn run(
    run: &mut Run,
    stability: &job::Stability,
    contact: &job::Contact,
    parts: &Parts,
) -> Result<(Option<StabilityResult>, Option<FullResult>)> {
    let (world, job) = (run.world(), run.job);
    let Parts { bodies, shapes, model } = parts;
    run.progress.stage("stability");
    let found = world.on_root(|| {
        let root = model.root()?;
        let examined = StabilityProblem { job, stability, contact, model: (&root.interface, &root.pair) };
        let found = examined.analyse(&SpectrumMemory::default())?;
        let smallest = well_posed::smallest(contact, |friction| examined.sharpness(friction))?;
        let sensitivities = sensitivity::wanted(&examined, &found, root)?;
        // Points apart from each other are not one.
        let criteria = match root.interface.are_points() {
            true => Vec::new(),
            false => {
                let s = &root.interface;
                let places: Vec<Vec<[f64; 2]>> =
                    s.patches.iter().map(|p| p.nodes().map(|i| s.point(i)).collect()).collect();
                criteria(&root.pair, &places, &found.contact, listed(&found.spectrum))?
            }
        };
        let one_point = point::wanted(&examined, &found)?;
        let unstable: Vec<&Eigenpair> =
            asked_places(&found.spectrum).into_iter().map(|i| &found.spectrum.eigenpairs[i]).collect();
        let confirmed = confirmation::of_reduced(run.petsc, &root.pair, &found.contact, &unstable)?;
        Ok((found, (smallest, sensitivities, criteria, one_point), confirmed))
    })?;
    let (found, (smallest, sensitivities, criteria, one_point), confirmed) = match found {
        Some((found, (smallest, sensitivities, criteria, point), confirmed)) => {
            (Some(found), (Some(smallest), sensitivities, criteria, point), confirmed)
        }
        None => (None, (None, None, Vec::new(), None), Vec::new()),
    };
    let full = match &stability.full {
        Some(wanted) => {
            shapes.map_err(Clone::clone)?;
            let reduced = found.as_ref().zip(model.on_root()).map(|(f, root)| (&f.spectrum, &f.contact, &root.pair));
            Some(full_stability::run(run, wanted, bodies, reduced)?)
        }
        None => None,
    };
    if let (Some(StabilityResult { state, spectrum, .. }), Some(root)) = (&found, model.on_root()) {
        run.file.tables(eigenvalues(spectrum, root, full.as_ref()));
        let tables =
            state.as_ref().map(|s| equilibrium(s, friction(contact).only().is_none_or(|law| !law.is_constant())));
        run.file.tables(tables.unwrap_or_default());
        let moves = if state.as_ref().is_none_or(|s| s.sliding) { "sliding" } else { "rolling" };
        summarise(spectrum, moves, (&root.pair, sensitivities.as_ref(), &criteria), &mut run.summary);
        if !confirmed.is_empty() {
            run.summary.value("SLEPc confirms", confirmation::in_words(&confirmed));
        }
        let asked = asked_places(spectrum).into_iter().zip(confirmed);
        let places = asked.filter_map(|(i, c)| Some((i, c?))).collect::<Vec<_>>();
        run.file.tables(confirmations(places, spectrum.eigenpairs.len(), full.as_ref()));
        run.file.tables(causes(&criteria));
        if let Some(comparison) = &one_point {
            run.file.tables(of_point(comparison, spectrum.eigenpairs.len()));
            point::summarise(comparison, spectrum, told(spectrum), &mut run.summary);
        }
        if let Some(all) = &sensitivities {
            run.file.tables(derivatives(all, root.pair.omega.len()));
            sensitivity::warn(all, &mut run.summary);
        }
        well_posed::say(contact, smallest.unwrap_or_default(), &mut run.file, &mut run.summary);
        if let Some(state) = state.as_ref().filter(|s| s.reversed > 0) {
            let (reversed, closed) = (state.reversed, state.closed());
            let text = format!("{reversed} of {closed}: the creepage is too small for full sliding");
            run.summary.value("nodes that would stick", text);
        }
        if let Some(full) = &full {
            full_stability::summarise(full, &mut run.summary);
        }
    }
    match shapes {
        _ if run.job.output.swept_modes == Some(true) => {
            let reduced = found.as_ref().zip(model.on_root()).map(|(f, root)| (f, &root.pair));
            if !complex_modes::draw(run, stability, bodies, reduced)? && run.options.reuse.is_some() {
                let text = "not written: the file of --reuse has no shapes of the modes of swept bodies";
                run.summary.value("complex modes", text);
            }
        }
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
    Ok((found, full))
}

/// Returns whether complex modes are to be written.
pub(super) fn writes_shapes(job: &Job) -> bool {
    job.output.fields && !job.is_reduced_anew() && job.analyses.stability.as_ref().is_some_and(|s| s.shapes > 0)
}

/// Returns whether bodies rotate in the full system.
pub(super) fn turns_in_full(job: &Job) -> bool {
    let full = job.analyses.stability.as_ref().is_some_and(|s| s.full.is_some());
    full && job.bodies().iter().any(|(_, b)| b.rotates())
}

/// Requirements of the analysis on the bodies: those of the full system come with their displacements.
pub(super) fn needs(job: &Job, wanted: &job::Stability) -> Requirements {
    let full = wanted.full.is_some();
    Requirements { solvers: writes_shapes(job) && !full, shapes: writes_shapes(job) || full }
}

/// Contributions of the bodies.
pub(super) struct Parts<'a> {
    pub(super) bodies: &'a BuiltBodies<'a>,
    /// Mode shapes of the bodies, or the reason why an earlier run does not give them.
    pub(super) shapes: std::result::Result<(), &'a Error>,
    pub(super) model: &'a Reduction,
}

/// Eigenvalues that the summary lists: all that grow, and at least so many; what makes them is told of no more than
/// so many.
const LISTED: [usize; 2] = [3, 50];

/// The eigenvalues of which it is told what makes them.
fn listed(spectrum: &Spectrum) -> &[Eigenpair] {
    &spectrum.eigenpairs[..told(spectrum).min(LISTED[1])]
}

/// Unstable pairs that SLEPc is asked about, those that grow fastest.
const CONFIRMED: usize = 20;

/// Places of the unstable pairs that SLEPc is asked about: of motions that oscillate. Growth without oscillation
/// comes in clusters of hundreds, one for each node.
fn asked_places(spectrum: &Spectrum) -> Vec<usize> {
    unstable_places(spectrum).filter(|&i| spectrum.eigenpairs[i].value.im != 0.0).take(CONFIRMED).collect()
}

/// Places of the unstable eigenvalues in the list.
fn unstable_places(spectrum: &Spectrum) -> impl Iterator<Item = usize> + '_ {
    let all = spectrum.eigenpairs.iter().enumerate();
    all.filter(|(_, e)| grows(e.value, e.backward_error)).map(|(i, _)| i)
}

/// How many the summary lists.
fn told(spectrum: &Spectrum) -> usize {
    let unstable = unstable_places(spectrum).count();
    unstable.max(LISTED[0]).min(spectrum.eigenpairs.len())
}

/// Writes the summary of a contact in the motion `moves`, of bodies with their modes, and of the sensitivities of the
/// eigenvalues.
pub(super) fn summarise(
    spectrum: &Spectrum,
    moves: &str,
    (model, sensitivities, criteria): (&CoupledModel, Option<&Sensitivities>, &[Criterion]),
    summary: &mut Summary,
) {
    let unstable: Vec<&Eigenpair> = unstable_places(spectrum).map(|i| &spectrum.eigenpairs[i]).collect();
    let sticking = match spectrum.sticking {
        0 => String::new(),
        n => format!(", {n} of them in stick"),
    };
    let rigid = match spectrum.eigenpairs.iter().filter(|e| is_rigid(e.value)).count() {
        0 => String::new(),
        n => format!(" ({n} of them rigid motions)"),
    };
    summary.line(format!(
        "stability of steady {moves}: {} unstable of {} eigenvalues{rigid}{}, {} closed contacts{sticking}",
        unstable.len(),
        spectrum.eigenpairs.len(),
        if spectrum.limit.is_finite() { format!(" up to {:.0} Hz", spectrum.limit) } else { String::new() },
        spectrum.closed
    ));
    without_oscillation(unstable.iter().map(|e| e.value), summary);
    let first = spectrum.eigenpairs.iter().enumerate().take(told(spectrum));
    // Growth without oscillation is no mode, and comes in clusters of hundreds.
    for (i, e) in first.filter(|(_, e)| oscillates(e.value) || !grows(e.value, e.backward_error)) {
        summary.value(
            &format!("{:.3} Hz", e.frequency()),
            format!("growth rate {:+.4} 1/s; {}", e.growth_rate(), partners(model, e)),
        );
        if let Some(c) = criteria.get(i).filter(|c| c.growth_rate.is_finite()) {
            summary.value("  growth-rate budget", cause(c));
        }
        if let Some(all) = sensitivities.filter(|_| grows(e.value, e.backward_error)) {
            summary.value("  to stabilise (linear estimate)", sensitivity::cures(all, i, e, model));
        }
    }
}

/// Line of the summary on those of the `unstable` eigenvalues that grow without oscillation: relaxations of the contact
/// between stick and slip, apart from the modes that squeal.
pub(super) fn without_oscillation(unstable: impl Iterator<Item = Complex<f64>>, summary: &mut Summary) {
    let rates: Vec<f64> = unstable.filter(|value| !oscillates(*value)).map(|value| value.re).collect();
    let fastest = rates.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let text = match rates.len() {
        0 => return,
        1 => format!("1 eigenvalue, growth rate {fastest:+.4} 1/s; stick-slip relaxation, no mode"),
        n => format!("{n} eigenvalues, growth rates up to {fastest:+.4} 1/s; stick-slip relaxation, no modes"),
    };
    summary.value("growth without oscillation", text);
}

/// A criterion in words.
fn cause(c: &Criterion) -> String {
    format!(
        "structural damping {:+.3}, friction {:+.3}, creep damping {:+.3}, contact tilt {:+.3}, sum {:+.3} 1/s; \
         kappa {:+.3e} 1/kg, H {:.1} pm/N at {:+.1} degrees",
        c.damping,
        c.friction(),
        c.across,
        c.tilting,
        c.growth_rate,
        c.coupling,
        1e12 * c.compliance.norm(),
        c.compliance.arg().to_degrees()
    )
}

/// The name of the free mode `k` of `model`.
pub(super) fn mode_name(model: &CoupledModel, k: usize) -> String {
    let (body, names, k) = match k.checked_sub(model.lower_modes) {
        None => ("lower", &model.names[0], k),
        Some(k) => ("upper", &model.names[1], k),
    };
    let name = names.get(k).map_or(String::new(), |name| format!(" {name}"));
    format!("{body} mode {}{name}", k + 1)
}

/// The free modes that make up an eigenvector, the largest shares first.
fn partners(model: &CoupledModel, pair: &Eigenpair) -> String {
    let mut shares: Vec<(usize, f64)> = participation(model, pair).into_iter().enumerate().collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    let large = shares.iter().take(3).filter(|(_, s)| *s > 0.01);
    let named = large.map(|&(k, share)| format!("{:.0} % {}", 100.0 * share, mode_name(model, k)));
    named.collect::<Vec<_>>().join(", ")
}
