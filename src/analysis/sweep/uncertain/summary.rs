//! Lines of the summary about the samples of a study.

use crate::job::{SweepPlan, Uncertainty};
use crate::output::datasets::sweep::{EigenvalueSearch, Outcome};
use crate::output::datasets::uncertainty::StudyStatistics as Report;
use crate::summary::Summary;
use crate::Error;
use std::f64::consts::PI;

/// Line about the modes that are continued, `near` of all that are followed.
pub(super) fn near_in_words(near: Option<usize>, followed: usize, summary: &mut Summary) {
    if let Some(near) = near {
        let text = format!(
            "{near} of {followed} may become unstable or be the least stable one, by their growth rates at the base \
             points; these are continued"
        );
        summary.value("modes near the axis", text);
    }
}

/// A probability with its digits that count beside half the width of its interval.
fn with_width(p: f64, [low, high]: [f64; 2]) -> String {
    format!("{p:.2} +- {:.2}", 0.5 * (high - low))
}

/// Lines of the summary.
pub(super) fn say(
    report: &Report,
    (plan, all): (&SweepPlan, &[Outcome]),
    models: usize,
    wanted: &Uncertainty,
    summary: &mut Summary,
) {
    let failed: Vec<usize> = (0..all.len()).filter(|&i| all[i].status != 0).collect();
    summary.line(format!(
        "uncertainty of {}: {} points on {models} reduced model{}, {} random samples, {} failed",
        plan.keys.join(", "),
        all.len(),
        if models == 1 { "" } else { "s" },
        report.samples,
        failed.len()
    ));
    summary.line(sentence(report));
    search_in_words(all, summary);
    let percent = 100.0 * report.confidence;
    let [low, high] = report.interval;
    summary
        .value("probability of squeal", format!("{percent:.0} % interval {low:.3} to {high:.3} by {}", report.way()));
    if report.failed > 0 {
        let [n, lost] = [report.samples, report.failed].map(|n| n as f64);
        let yes = report.probability * (n - lost);
        let text = format!(
            "{:.3} to {:.3} if all {} that failed were stable or unstable",
            yes / n,
            (yes + lost) / n,
            report.failed
        );
        summary.value("  with failed samples", text);
    }
    for mode in &report.modes {
        let [low, high] = mode.interval;
        let [_, least, _, middle, _, most, _] = mode.quantiles;
        summary.value(
            &format!("{:.1} Hz", mode.own.im / (2.0 * PI)),
            format!(
                "P {:.3}, {low:.3} to {high:.3}; growth rate {middle:+.2} 1/s, \
                 90 % within {least:+.2} and {most:+.2}; {}",
                mode.probability, mode.name
            ),
        );
    }
    if report.other > 0.0 {
        summary.value("other motions", format!("P {:.3}: unlike the modes of the job's own point", report.other));
    }
    for (key, of) in plan.keys.iter().zip(&report.indices) {
        let ([a, b], [c, d]) = (of.first_interval, of.total_interval);
        let text = format!("Sobol' index {:.3}, {a:.3} to {b:.3}; total {:.3}, {c:.3} to {d:.3}", of.first, of.total);
        summary.value(&format!("  {key}"), text);
    }
    let Some(&first) = failed.first() else { return };
    let share = failed.len() as f64 / all.len() as f64;
    let (place, why) = (plan.place(first), &all[first].message);
    summary.value("first failed sample", format!("{place}: {why}"));
    if share > wanted.max_failed {
        summary.fail(Error::NotConverged(format!(
            "{} of {} samples failed, more than analyses.uncertainty.max_failed = {} of them; the others are in the \
             results, and /uncertainty/status and /uncertainty/message say which failed and why. The first is {place}: \
             {why}",
            failed.len(),
            all.len(),
            wanted.max_failed
        )));
    }
}

/// Lines of the summary about how the eigenvalues of the points were found.
fn search_in_words(all: &[Outcome], summary: &mut Summary) {
    use EigenvalueSearch::{Continued, FellBack, Missed, Rebased, Uncounted};
    let by = |search: EigenvalueSearch| all.iter().filter(|o| o.search == search).count();
    let [counted, uncounted, fell_back, missed, rebased] = [Continued, Uncounted, FellBack, Missed, Rebased].map(by);
    let continued = counted + uncounted + rebased;
    if continued + fell_back + missed == 0 {
        return;
    }
    let bases = all.len() - continued - fell_back - missed;
    let others = match rebased {
        0 => String::new(),
        n => format!("; {n} points were continued from some of these"),
    };
    summary.value(
        "eigenvalues",
        format!(
            "{continued} points continued from {bases} base points, {fell_back} searched for since they could not \
             be{others}"
        ),
    );
    if uncounted + missed > 0 {
        let counted = counted + rebased;
        let text = match missed {
            0 => format!("unstable eigenvalues counted at {counted} of these points, none was missing"),
            _ => format!(
                "unstable eigenvalues were missing at {missed} points, for which more were searched; all others were \
                 counted"
            ),
        };
        summary.value("  counts", text);
    }
}

/// The outcome in a sentence.
fn sentence(report: &Report) -> String {
    let mut text = format!("P(squeal) = {}", with_width(report.probability, report.interval));
    let by: Vec<String> = report
        .modes
        .iter()
        .filter(|m| m.probability > 0.0)
        .take(4)
        .map(|m| format!("{:.0} Hz {:.2}", m.own.im / (2.0 * PI), m.probability))
        .collect();
    if !by.is_empty() {
        text += &format!(": {}", by.join(", "));
    }
    let largest = report.indices.iter().zip(&report.keys).max_by(|a, b| a.0.first.total_cmp(&b.0.first));
    if let Some((of, key)) = largest.filter(|l| l.0.first > 0.0) {
        text += &format!("; {:.0} % of the variance of the growth rate is {key}", 100.0 * of.first.min(1.0));
    }
    text
}
