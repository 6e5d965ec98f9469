//! The summary a run ends with, on stdout.

use crate::Error;

/// Lines of the summary, in order.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    lines: Vec<String>,
    failure: Option<Error>,
}

impl Summary {
    /// Adds a line.
    pub fn line(&mut self, text: impl Into<String>) {
        self.lines.push(text.into());
    }

    /// Notes that part of the work failed although there are results: the run writes them and then ends with this error.
    pub fn fail(&mut self, error: Error) {
        self.failure.get_or_insert(error);
    }

    /// What [`Summary::fail`] was told first.
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
        self.lines.iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}
