//! Reuse of the reduced model of an earlier run whose bodies are the same.

pub(crate) mod shapes;

use crate::body::{Side, TraceModes};
use crate::case::bodies::BuiltBodies;
use crate::job::Job;
use crate::output::datasets::reduced::{load, of_modes_alone, Origin, ReusedModel};
use crate::output::Reader;
use crate::{Error, Result};
use std::path::Path;

/// Contents of the group `/reduced` beside a model made from `bodies` with these `modes`. Rows of several `contacts`
/// are kept as few numbers.
pub fn origin((bodies, contacts): (&BuiltBodies, usize), modes: &[TraceModes]) -> Result<Origin> {
    let alike = bodies.places.len() == 2 && bodies.places[0].body == bodies.places[1].body;
    let residual = |side: Side| {
        let place = bodies.places.iter().find(|p| p.side == side);
        place.and_then(|p| modes.get(p.body)).map(|m| m.residual.clone()).unwrap_or_default()
    };
    // Measured frequencies change the compliance of the rows, and not these numbers.
    let few = contacts > 1 && modes.iter().all(|modes| modes.computed.is_empty());
    let functions = |side: Side| match bodies.places.iter().find(|p| p.side == side) {
        Some(place) if few => bodies.unique.get(place.body).map_or(Ok(None), |b| b.contact_functions()),
        _ => Ok(None),
    };
    let [lower, upper] = Side::BOTH.map(functions);
    Ok(Origin { alike, residual: Side::BOTH.map(residual), functions: [lower?, upper?] })
}

/// Describes the contents of the file of an unfinished run, in words.
pub fn held(file: &Path) -> &'static str {
    match Reader::open(file).is_ok_and(|file| of_modes_alone(&file)) {
        true => "modes",
        false => "modes and compliance",
    }
}

/// True if the file is what a run has left that did not come to its end.
pub fn is_left(file: &Path) -> bool {
    Reader::open(file).is_ok_and(|file| file.has("/reduced/version") && !file.has("/provenance/job"))
}

/// Part of the largest component by which a mode that was found again may differ from the one that was kept, and part
/// of its frequency.
const SAME: f64 = 1e-6;

/// On rank 0: `Error::Input` unless the modes `found` again are those `kept` by an earlier run.
pub fn same(found: &[TraceModes], kept: &[TraceModes]) -> Result<()> {
    let close = |a: &[f64], b: &[f64]| {
        let largest = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * largest)
    };
    let alike = |a: &TraceModes, b: &TraceModes| {
        let columns = match (&a.rows, &b.rows) {
            (Some(a), Some(b)) if a.shape() == b.shape() => {
                let of = |m: &faer::Mat<f64>, k: usize| (0..m.nrows()).map(|i| m[(i, k)]).collect::<Vec<f64>>();
                (0..a.ncols()).all(|k| close(&of(a, k), &of(b, k)))
            }
            _ => false,
        };
        columns && close(&a.omega, &b.omega)
    };
    match found.len() == kept.len() && found.iter().zip(kept).all(|(a, b)| alike(a, b)) {
        true => Ok(()),
        false => Err(Error::Input(
            "the modes found again are not those that the earlier run has left: it was of another version of the \
             program or of its libraries. Run without --reuse, or with output.swept_modes = false"
                .into(),
        )),
    }
}

/// On rank 0: the reduced model that `file` holds, if it is that of `job`. `Error::Job` names the keys that differ if
/// it is not.
pub fn read(file: &Path, job: &Job) -> Result<ReusedModel> {
    let name = file.display();
    let refuse = |text: &str| Err(Error::Job(format!("--reuse {name}: {text}")));
    if !file.exists() {
        let named = file.with_file_name(format!("{}.h5", file.file_name().unwrap_or_default().to_string_lossy()));
        let near = if named.exists() { format!("; did you mean {}?", named.display()) } else { String::new() };
        return Err(Error::Input(format!(
            "--reuse: cannot read {name}: there is no such file, expected a result file (.h5) of an earlier run{near}"
        )));
    }
    match &job.contact {
        Some(c) if job.analyses.on_contact().is_empty() || c.points.is_some() => {
            return refuse("no analysis of the job works on a reduced model of finite elements");
        }
        Some(c) if c.compliance.of_bodies() => {}
        Some(_) => return refuse("contact.compliance is \"half_space\": there is nothing to spare"),
        None => return refuse("the job has no contact"),
    }
    if job.analyses.stability.as_ref().is_some_and(|s| s.full.is_some()) && shapes::shape_file(file).is_none() {
        return refuse(
            "analyses.stability.full needs the finite elements and whole mode shapes, which the file \
         has not; leave one of the two out",
        );
    }
    load(&Reader::open(file)?, job)
}
