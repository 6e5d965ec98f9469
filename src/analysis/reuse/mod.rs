//! Reuse of the reduced model of an earlier run whose bodies are the same.

pub mod shapes;

use crate::body::{Side, TraceModes};
use crate::case::bodies::Bodies;
use crate::job::Job;
use crate::output::datasets::reduced::{load, of_modes_alone, Origin, Reused};
use crate::output::Reader;
use crate::{Error, Result};
use std::path::Path;

/// What the group `/reduced` holds beside a model made from `bodies` with these `modes`.
pub fn origin(bodies: &Bodies, modes: &[TraceModes]) -> Origin {
    let alike = bodies.places.len() == 2 && bodies.places[0].body == bodies.places[1].body;
    let residual = |side: Side| {
        let place = bodies.places.iter().find(|p| p.side == side);
        place.and_then(|p| modes.get(p.body)).map(|m| m.residual.clone()).unwrap_or_default()
    };
    Origin { alike, residual: Side::BOTH.map(residual) }
}

/// What the file of a run that did not come to its end has, in words.
pub fn held(file: &Path) -> &'static str {
    match Reader::open(file).is_ok_and(|file| of_modes_alone(&file)) {
        true => "modes",
        false => "modes and compliance",
    }
}

/// On rank 0: the reduced model that `file` holds, if it is that of `job`. `Error::Job` names the keys that differ if it is not.
pub fn read(file: &Path, job: &Job) -> Result<Reused> {
    let name = file.display();
    let refuse = |text: &str| Err(Error::Job(format!("--reuse {name}: {text}")));
    match &job.contact {
        Some(c) if job.analyses.on_contact().is_empty() || c.points.is_some() => {
            return refuse("no analysis of the job works on a reduced model of finite elements");
        }
        Some(c) if c.compliance.of_bodies() => {}
        Some(_) => return refuse("contact.compliance is \"half_space\": there is nothing to spare"),
        None => return refuse("the job has no contact"),
    }
    if job.analyses.stability.as_ref().is_some_and(|s| s.full.is_some()) && shapes::kept(file).is_none() {
        return refuse("analyses.stability.full needs the finite elements and whole mode shapes, which the file has not; leave one of the two out");
    }
    load(&Reader::open(file)?, job)
}
