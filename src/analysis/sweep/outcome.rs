//! Results of the points of a sweep: transfer to rank 0 and summary.

use crate::job::SweepPlan;
use crate::output::datasets::sweep::{EigenvalueSearch, Followed, Outcome};
use crate::stability::oscillates;
use crate::summary::Summary;
use crate::{Error, Result};
use num_complex::Complex;

/// Outcomes as they travel to rank 0.
#[derive(Default)]
pub(super) struct PackedOutcomes {
    pub numbers: Vec<f64>,
    pub text: Vec<u8>,
}

/// Numbers of an outcome before its eigenvalues.
const HEAD: usize = 16;
/// The ways of a search, by their numbers.
const SEARCHES: [EigenvalueSearch; 6] = [
    EigenvalueSearch::Whole,
    EigenvalueSearch::Continued,
    EigenvalueSearch::FellBack,
    EigenvalueSearch::Uncounted,
    EigenvalueSearch::Missed,
    EigenvalueSearch::Rebased,
];
/// Numbers of a mode that is followed.
const FOLLOWED: usize = 4;

impl PackedOutcomes {
    /// Adds the outcome of a point.
    pub fn push(&mut self, index: usize, o: &Outcome) {
        let counts = [index, o.status as usize, o.closed, o.reversed, o.message.len(), o.eigenvalues.len(), o.sticking];
        self.numbers.extend(counts.map(|n| n as f64));
        self.numbers.extend(o.force);
        let search = SEARCHES.iter().position(|s| *s == o.search).unwrap_or(0);
        self.numbers.extend([o.approach, o.backward_error, o.followed.len() as f64, search as f64]);
        self.numbers.extend([f64::from(u8::from(o.interpolated)), o.angular_speed]);
        self.numbers.extend(o.eigenvalues.iter().flat_map(|l| [l.re, l.im]));
        let mode = |f: &Followed| f.mode.map_or(-1.0, |m| m as f64);
        self.numbers.extend(o.followed.iter().flat_map(|f| [mode(f), f.value.re, f.value.im, f.agreement]));
        self.text.extend(o.message.as_bytes());
    }

    /// Puts all outcomes in their places.
    pub fn unpack(&self, into: &mut [Option<Outcome>]) -> Result<()> {
        let torn = || Error::Defect("results of a sweep were torn on their way".into());
        let (mut numbers, mut text) = (&self.numbers[..], &self.text[..]);
        while !numbers.is_empty() {
            let (head, rest) = numbers.split_at_checked(HEAD).ok_or_else(torn)?;
            let count = |k: usize| head[k] as usize;
            let (values, rest) = rest.split_at_checked(2 * count(5)).ok_or_else(torn)?;
            let (followed, rest) = rest.split_at_checked(FOLLOWED * count(12)).ok_or_else(torn)?;
            let (message, after) = text.split_at_checked(count(4)).ok_or_else(torn)?;
            (numbers, text) = (rest, after);
            *into.get_mut(count(0)).ok_or_else(torn)? = Some(Outcome {
                status: head[1] as i32,
                message: String::from_utf8_lossy(message).into_owned(),
                eigenvalues: values.chunks_exact(2).map(|v| Complex::new(v[0], v[1])).collect(),
                backward_error: head[11],
                closed: count(2),
                sticking: count(6),
                reversed: count(3),
                force: [head[7], head[8], head[9]],
                approach: head[10],
                followed: followed
                    .chunks_exact(FOLLOWED)
                    .map(|f| Followed {
                        mode: (f[0] >= 0.0).then_some(f[0] as usize),
                        value: Complex::new(f[1], f[2]),
                        agreement: f[3],
                    })
                    .collect(),
                search: *SEARCHES.get(count(13)).ok_or_else(torn)?,
                interpolated: head[14] != 0.0,
                angular_speed: head[15],
            });
        }
        Ok(())
    }
}

/// So many points at most have lines of their own in the summary.
pub(super) const LISTED: usize = 12;

/// Writes the summary of the points; `kind` names the `models` that they were computed on.
pub(super) fn summarise(plan: &SweepPlan, all: &[Outcome], models: usize, kind: &str, summary: &mut Summary) {
    let failed: Vec<usize> = (0..all.len()).filter(|&i| all[i].status != 0).collect();
    let unstable = all.iter().filter(|o| o.unstable() > 0).count();
    summary.line(format!(
        "sweep of {}: {} points on {models} {kind} model{}, {unstable} unstable, {} failed",
        plan.keys.join(", "),
        all.len(),
        if models == 1 { "" } else { "s" },
        failed.len()
    ));
    let growth = |i: &usize| all[*i].eigenvalues.first().map_or(f64::NEG_INFINITY, |l| l.re);
    let worst = (0..all.len()).filter(|&i| all[i].status == 0).max_by(|a, b| growth(a).total_cmp(&growth(b)));
    if let Some(l) = worst.and_then(|i| all[i].eigenvalues.first()) {
        summary.value("largest growth rate", rate(l));
        summary.value("  there", plan.place(worst.unwrap_or_default()));
    }
    if all.len() <= LISTED {
        for (i, outcome) in all.iter().enumerate().filter(|(_, o)| o.status == 0) {
            let Some(l) = outcome.eigenvalues.first() else { continue };
            let text = format!("{}, {} unstable", rate(l), outcome.unstable());
            summary.value(&format!("  {}", plan.place(i)), text);
        }
    }
    let Some(&first) = failed.first() else { return };
    summary.value("first failed point", format!("{}: {}", plan.place(first), all[first].message));
    summary.fail(Error::NotConverged(format!(
        "{} of {} points of the sweep failed, the others are in the results; /sweep/status and /sweep/message \
         say which and why. \
         The first is {}: {}",
        failed.len(),
        all.len(),
        plan.place(first),
        all[first].message
    )));
}

/// Growth rate and frequency of an eigenvalue.
fn rate(value: &Complex<f64>) -> String {
    match oscillates(*value) {
        true => format!("{:+.4} 1/s at {:.3} Hz", value.re, value.im.abs() / (2.0 * std::f64::consts::PI)),
        false => format!("{:+.4} 1/s without oscillation", value.re),
    }
}
