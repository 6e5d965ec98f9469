//! The summary a run ends with, on stdout.

/// Lines of the summary, in order.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    lines: Vec<String>,
}

impl Summary {
    /// Adds a line.
    pub fn line(&mut self, text: impl Into<String>) {
        self.lines.push(text.into());
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
