//! `init`: a job to begin with, and what it needs, as the project's own jobs are.

use super::args::Example;
use railsqueal::{Error, Result};
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// A file that an example consists of, beside its job.
struct Companion {
    name: &'static str,
    /// Path by which the job of the project names it; the written job names it by `name`. None of a drawing, which the
    /// job does not read.
    named: Option<&'static str>,
    content: &'static [u8],
}

/// Meshes of the example with meshes from files.
const MESHES: [Companion; 2] = [
    Companion {
        name: "block-lower.msh",
        named: Some("../meshes/block-lower.msh"),
        content: include_bytes!("../../meshes/block-lower.msh"),
    },
    Companion {
        name: "block-upper-binary.msh",
        named: Some("../meshes/block-upper-binary.msh"),
        content: include_bytes!("../../meshes/block-upper-binary.msh"),
    },
];

/// Section and drawing of the example with a drawn wheel.
const WHEEL: [Companion; 2] = [
    Companion {
        name: "wheel-section.msh",
        named: Some("../meshes/wheel-section.msh"),
        content: include_bytes!("../../meshes/wheel-section.msh"),
    },
    Companion { name: "wheel-outline.dxf", named: None, content: include_bytes!("../../meshes/wheel-outline.dxf") },
];

/// Section and drawing of the example with a drawn rail.
const RAIL: [Companion; 2] = [
    Companion {
        name: "rail-section.msh",
        named: Some("../meshes/rail-section.msh"),
        content: include_bytes!("../../meshes/rail-section.msh"),
    },
    Companion { name: "rail-outline.csv", named: None, content: include_bytes!("../../meshes/rail-outline.csv") },
];

/// Section and drawing of the example with a drawn wheelset.
const WHEELSET: [Companion; 2] = [
    Companion {
        name: "wheelset-section.msh",
        named: Some("../meshes/wheelset-section.msh"),
        content: include_bytes!("../../meshes/wheelset-section.msh"),
    },
    Companion {
        name: "wheelset-outline.csv",
        named: None,
        content: include_bytes!("../../meshes/wheelset-outline.csv"),
    },
];

/// The job of an example, and what lies beside it.
fn files(example: Example) -> (&'static str, &'static [Companion]) {
    match example {
        Example::TwoCylinders => (include_str!("../../jobs/two-cylinders.json"), &[]),
        Example::OwnMesh => (include_str!("../../jobs/blocks.json"), &MESHES),
        Example::Sweep => (include_str!("../../jobs/sweep-curve.json"), &[]),
        Example::Squeal => (include_str!("../../jobs/squeal.json"), &[]),
        Example::WheelOnRail => (include_str!("../../jobs/wheel-on-rail.json"), &[]),
        Example::Bogie => (include_str!("../../jobs/curve-of-150-m.json"), &[]),
        Example::DrawnWheel => (include_str!("../../jobs/drawn-wheel.json"), &WHEEL),
        Example::DrawnRail => (include_str!("../../jobs/drawn-rail.json"), &RAIL),
        Example::DrawnWheelset => (include_str!("../../jobs/drawn-wheelset.json"), &WHEELSET),
        Example::FrictionModifier => (include_str!("../../jobs/friction-modifier.json"), &[]),
        Example::TwinDisc => (include_str!("../../jobs/twin-disc.json"), &[]),
        Example::WheelOnRailContact => (include_str!("../../jobs/wheel-on-rail-contact.json"), &[]),
    }
}

/// Way from a drawing to the section of an example with one.
fn from_drawing(example: Example) -> Option<&'static str> {
    match example {
        Example::DrawnWheel => Some("railsqueal section wheel-outline.dxf --kind wheel --output wheel.msh"),
        Example::DrawnRail => Some("railsqueal section rail-outline.csv --kind rail --output rail.msh"),
        Example::DrawnWheelset => {
            Some("railsqueal section wheelset-outline.csv --kind wheelset --size 0.012 --output wheelset.msh")
        }
        _ => None,
    }
}

/// Name of the schema of jobs, beside the written job.
const SCHEMA: &str = "railsqueal.schema.json";

/// The job with the key that leads editors to its schema: they complete its keys, and show what each is.
fn with_schema(job: &str) -> String {
    job.replacen('{', &format!("{{\n  \"$schema\": \"{SCHEMA}\","), 1)
}

/// Writes the example to `job`, with its schema beside it, and says what was written and what to do with it. Files
/// that are there stay: `Error::Job` but for the schema, which is the same for all jobs.
pub fn write(example: Example, job: &Path) -> Result<String> {
    let (text, companions) = files(example);
    let folder = job.parent().unwrap_or(Path::new(""));
    let mut wanted: Vec<(PathBuf, Vec<u8>)> = vec![(job.into(), with_schema(text).into())];
    for companion in companions {
        if let Some(named) = companion.named {
            wanted[0].1 = String::from_utf8_lossy(&wanted[0].1).replace(named, companion.name).into_bytes();
        }
        wanted.push((folder.join(companion.name), companion.content.into()));
    }
    if let Some((path, _)) = wanted.iter().find(|(path, _)| path.exists()) {
        return Err(Error::Job(format!(
            "{}: is there already, and is not replaced; name another job with --output",
            path.display()
        )));
    }
    let schema = folder.join(SCHEMA);
    if !schema.exists() {
        let text = serde_json::to_string_pretty(&railsqueal::job::schema())
            .map_err(|e| Error::Defect(format!("schema of the job: {e}")))?;
        wanted.push((schema, (text + "\n").into()));
    }
    for (path, content) in &wanted {
        let failed = |e: std::io::Error| match e.kind() {
            ErrorKind::AlreadyExists => {
                Error::Job(format!("{}: is there already, and is not replaced", path.display()))
            }
            _ => Error::Io(format!("cannot write {}: {e}", path.display())),
        };
        let mut file = OpenOptions::new().write(true).create_new(true).open(path).map_err(failed)?;
        file.write_all(content).map_err(failed)?;
    }
    let mut said: String = wanted.iter().map(|(path, _)| format!("wrote {}\n", path.display())).collect();
    let (job, result) = (job.display(), super::args::default_output(job));
    said += &format!("next: railsqueal check {job}, railsqueal run {job}, railsqueal report {}\n", result.display());
    if let Some(command) = from_drawing(example) {
        said += &format!("a section from a drawing: {command}; it prints what the job then says of it\n");
    }
    Ok(said)
}
