//! The steps of a run, whatever moves in them: what is recorded, written in segments, and when the run stops.

use super::sound::Sound;
use super::transient_summary::StepHistory;
use super::Inputs;
use crate::job::Body;
use crate::output::datasets::checkpoint;
use crate::output::datasets::points::Points;
use crate::output::datasets::record::Recorder;
use crate::output::Table;
use crate::progress::Progress;
use crate::transient::{Effort, Stepper};
use crate::{Error, Result};
use std::time::Instant;

/// Report on the steps of a run.
pub(super) struct LoopReport {
    /// Work of the contact solver.
    pub(super) effort: Effort,
    /// Number of steps.
    pub(super) steps: u64,
    /// Wall time of all of them, s.
    pub(super) seconds: f64,
    /// Recorded values.
    pub(super) account: StepHistory,
}

/// Services that accompany the steps.
pub(super) struct TimeLoop<'c, 'i> {
    pub(super) inputs: &'c Inputs<'i>,
    pub(super) points: &'c Points,
    pub(super) sound: Option<&'c Sound<'i>>,
    /// Checksum of the model.
    pub(super) identity: String,
    /// Data that the future depends on beside the state of the stepper.
    pub(super) more: &'c dyn Fn() -> Result<Vec<Table>>,
    /// True if a signal came to another rank.
    pub(super) elsewhere: &'c dyn Fn() -> bool,
}

impl TimeLoop<'_, '_> {
    /// On rank 0: all steps. `begun` is the checksum of the model of a run that is continued; a new one has `keep` in
    /// its first segment.
    pub(super) fn go(
        &self,
        mut stepper: Stepper<'_>,
        begun: Option<&str>,
        keep: Vec<Table>,
        progress: &mut Progress,
    ) -> Result<LoopReport> {
        let TimeLoop { inputs, points, sound, identity, more, elsewhere } = self;
        let (root, segments) = (inputs.model.root()?, inputs.segments()?);
        let wanted = inputs.wanted;
        let total = wanted.steps();
        let changed = begun.is_some_and(|begun| begun != identity.as_str());
        let found_again = |body: &Body| body.matrices.is_none();
        if changed && inputs.job.is_disc_with_pads() && inputs.job.bodies.upper.as_ref().is_some_and(found_again) {
            return Err(Error::Input(
                "--resume: the modes of the pads, which are computed again, are not those that the run was begun \
                 with; expected the number of ranks and the files of the begun run. Run it anew (--force)"
                    .into(),
            ));
        }
        if changed {
            progress.note(
                "warning: the reduced model differs in rounding from that of the run to be continued, or a file \
                 of its roughness has changed; the results do too",
            );
        }
        // Nothing is left behind by a run that cannot begin.
        match begun {
            Some(_) => segments.go_on(inputs.given.to_json())?,
            None => segments.start_run(inputs.given.to_json())?,
        }
        let kept = |stepper: &Stepper<'_>| -> Result<Vec<Table>> {
            let mut tables = checkpoint::tables(stepper.state(), identity, inputs.given)?;
            tables.extend(more()?);
            Ok(tables)
        };
        let mut recorder =
            Recorder::new(points, wanted, root, sound.map_or(0, |s| s.stride()), &stepper.state().reaction);
        let mut effort = Effort::default();
        let first = stepper.state().step;
        let mut account = StepHistory::new(wanted.step, first, total);
        let clock = Instant::now();
        if begun.is_none() {
            let mut tables = kept(&stepper)?;
            tables.extend(keep);
            tables.extend(points.checkpoint_tables());
            tables.extend(sound.map(|s| s.tables()).unwrap_or_default());
            segments.write(0, &tables)?;
            if let Some(file) = inputs.kept {
                let _ = std::fs::remove_file(file);
            }
        }
        let mut segment_begun = Instant::now();
        while stepper.state().step < total {
            let result = stepper.advance();
            if result.is_ok() {
                recorder.record_step(&stepper);
                account.record_step(
                    stepper.state().step,
                    stepper.report(),
                    stepper.state().energy.kinetic,
                    recorder.velocities(),
                );
                effort += stepper.report().effort;
            }
            let step = stepper.state().step;
            let end = step.is_multiple_of(u64::from(wanted.segment)) || step == total;
            if result.is_err() || end {
                let mut tables = recorder.tables();
                tables.extend(kept(&stepper)?);
                if result.is_ok() || recorder.any() {
                    segments.write(step, &tables)?;
                }
                recorder.clear();
            }
            result.map_err(|e| {
                let place = segments.folder().display();
                let advice = match e {
                    Error::NotConverged(_) => "; a shorter analyses.transient.step, or a larger tolerance, may help",
                    _ => "",
                };
                e.context(format!("analyses.transient (the state before is kept in {place}{advice})"))
            })?;
            progress.step("steps", (step - first) as usize, (total - first) as usize);
            if end {
                // A run that is continued from here begins with an empty solver; one that goes on does as well.
                stepper.reset()?;
                let segment = segment_begun.elapsed();
                segment_begun = Instant::now();
                if elsewhere() {
                    inputs.stop.request();
                }
                if step < total {
                    if let Some(why) = inputs.stop.asked(segment) {
                        return Err(Error::Stopped(format!(
                            "stopped {why} after {step} of {total} steps (t = {:.6} s); the state is kept in \
                             {}. Continue with \
                             --resume {}",
                            step as f64 * wanted.step,
                            segments.folder().display(),
                            inputs.options.output.display()
                        )));
                    }
                }
            }
        }
        segments.complete(total)?;
        Ok(LoopReport { effort, steps: total - first, seconds: clock.elapsed().as_secs_f64(), account })
    }
}
