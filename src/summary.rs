//! The summary a run ends with, on stdout.

use crate::job::{damping_lines, plausible, range, undamped, Job};
use crate::Error;

/// Lines of the summary, in order.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    verdict: Vec<String>,
    lines: Vec<String>,
    warnings: Vec<String>,
    failure: Option<Error>,
}

impl Summary {
    /// Summary of `job` before anything is computed: the defaults it takes up that are not those of its format, the
    /// damping of its bodies, what is implausible, and what comes near the ends of the range of the theory.
    pub fn from_job(job: &Job) -> Self {
        let told = |line: &String| format!("default changed: {line}");
        let mut summary = Self { lines: job.changed_defaults.iter().map(told).collect(), ..Self::default() };
        damping_lines(job).into_iter().for_each(|text| summary.line(text));
        undamped(job).into_iter().chain(plausible(job)).for_each(|text| summary.warn(text));
        // What is beyond them has been refused.
        range(job).unwrap_or_default().into_iter().for_each(|text| summary.warn(text));
        summary
    }

    /// Adds a warning, which the result file keeps as well.
    pub fn warn(&mut self, text: impl Into<String>) {
        let text = text.into();
        self.lines.push(format!("warning: {text}"));
        self.warnings.push(text);
    }

    /// The warnings.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Sets the sentences that stand before everything else: the verdict on the run.
    pub fn verdict(&mut self, sentences: impl IntoIterator<Item = String>) {
        self.verdict = sentences.into_iter().collect();
    }

    /// The lines below the verdict.
    pub fn lines(&self) -> &[String] {
        &self.lines
    }

    /// Adds a line.
    pub fn line(&mut self, text: impl Into<String>) {
        self.lines.push(text.into());
    }

    /// Notes that part of the work failed although there are results: the run writes them and then ends with this
    /// error.
    pub fn fail(&mut self, error: Error) {
        self.failure.get_or_insert(error);
    }

    /// Returns the first error given to [`Summary::fail`].
    pub fn failure(&self) -> Option<&Error> {
        self.failure.as_ref()
    }

    /// Adds an aligned line of a quantity and its value.
    pub fn value(&mut self, name: &str, value: impl std::fmt::Display) {
        self.lines.push(format!("  {name:<34} {value}"));
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.verdict.iter().chain(&self.lines).try_for_each(|line| writeln!(f, "{line}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_changed_default_is_told_first() {
        let bytes = include_bytes!("../jobs/annulus.json");
        let mut job = Job::from_bytes(bytes, Path::new("job.json"), &[], None).unwrap();
        assert_eq!(Summary::from_job(&job).to_string(), "");
        job.changed_defaults.push("a.b is not given: 2 since format 2, 1 before".into());
        let mut summary = Summary::from_job(&job);
        summary.line("body");
        let text = "default changed: a.b is not given: 2 since format 2, 1 before\nbody\n";
        assert_eq!(summary.to_string(), text);
        // The verdict stands before all, whenever it is found.
        summary.verdict(["No squeal found.".to_owned()]);
        assert_eq!(summary.to_string(), format!("No squeal found.\n{text}"));
    }
}
