//! The state of a run as tables, and the way back.

use super::super::segments::program;
use super::super::{Segments, Table, Values};
use crate::job::{run_differences, Job};
use crate::model::ModalMatrix;
use crate::transient::{Energy, Model, State};
use crate::{Error, Result};
use sha2::{Digest, Sha256};

/// A state from a segment.
pub struct Checkpoint {
    /// The state.
    pub state: State,
    /// SHA-256 of the reduced model it belongs to.
    pub identity: String,
}

/// SHA-256 of the reduced model.
pub fn identity(model: &Model<'_>) -> String {
    let mut hash = Sha256::new();
    let mut add = |v: f64| hash.update(v.to_le_bytes());
    for matrix in [Some(model.residual), Some(model.modes), model.carried].into_iter().flatten() {
        matrix.col_iter().for_each(|c| c.iter().for_each(|&v| add(v)));
    }
    model.omega.iter().chain(&model.damping.values()).chain(&model.interface.gap).for_each(|&v| add(v));
    // That of a body at rest is in its frequencies.
    if let ModalMatrix::Blocks(_) = &model.stiffness {
        model.stiffness.values().into_iter().for_each(add);
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// The state as tables of a segment, with the job it belongs to.
pub fn tables(state: &State, identity: &str, job: &Job) -> Result<Vec<Table>> {
    let job = serde_json::to_string(&job.to_json()).map_err(|e| Error::Defect(format!("resolved job: {e}")))?;
    let e = &state.energy;
    let energy = vec![e.kinetic, e.elastic, e.friction, e.damping, e.impact, e.drive, e.rolling, e.start];
    let text = |name: &str, text: &str, value: String| Table::scalar(&format!("/checkpoint/{name}"), "-", text, value);
    let mut tables = vec![
        text("job", "The resolved job, JSON.", job),
        text("program", "Program and version.", program()),
        text("model", "SHA-256 of the reduced model.", identity.to_owned()),
        Table::scalar("/checkpoint/step", "1", "Steps done.", state.step as i64),
        Table::list("/checkpoint/q", "m kg^1/2", "Modal displacements.", state.q.clone()),
        Table::list("/checkpoint/v", "m kg^1/2/s", "Modal velocities.", state.v.clone()),
        Table::list(
            "/checkpoint/reaction",
            "N",
            "Reactions (x, y, normal) of the contact nodes.",
            state.reaction.clone(),
        ),
        Table::list("/checkpoint/motions", "m", "Rigid motions; of one contact its approach.", state.motions.clone()),
        Table::list("/checkpoint/creep", "m/s", "Creep velocities that were found.", state.creep.to_vec()),
        Table::list(
            "/checkpoint/energy",
            "J",
            "Kinetic, elastic; by friction, damping, impact; of the drive, the rolling moment; of the start.",
            energy,
        ),
    ];
    if !state.friction.is_empty() {
        let text = "Coefficients of friction that the material at the contact nodes remembers.";
        tables.push(Table::list("/checkpoint/friction", "1", text, state.friction.clone()));
    }
    Ok(tables)
}

impl Checkpoint {
    /// Checkpoint of the last segment.
    pub fn last(segments: &Segments) -> Result<Self> {
        let entries = segments.entries();
        let last = entries.last().ok_or_else(|| Error::Defect("a run to be continued has no segment".into()))?;
        let file = segments.open(last)?;
        let wrong =
            |what: String| Error::Input(format!("--resume: {}: /checkpoint/{what}", segments.path(last).display()));
        let list = |name: &str| file.numbers(&format!("/checkpoint/{name}")).map(|(_, v)| v);
        let Values::I64(step) = file.read("/checkpoint/step")?.1 else {
            return Err(wrong("step is no whole number".into()));
        };
        if step[..] != [last.last as i64] {
            return Err(wrong(format!("step: found {step:?}, expected {}, as the name of the file says", last.last)));
        }
        let (creep, energy) = (list("creep")?, list("energy")?);
        let [kinetic, elastic, friction, damping, impact, drive, rolling, start] = energy[..] else {
            return Err(wrong(format!("energy: found {} values, expected 8", energy.len())));
        };
        let [cx, cy] = creep[..] else {
            return Err(wrong(format!("creep: found {} values, expected 2", creep.len())));
        };
        let state = State {
            step: last.last,
            q: list("q")?,
            v: list("v")?,
            reaction: list("reaction")?,
            motions: list("motions")?,
            creep: [cx, cy],
            friction: if file.has("/checkpoint/friction") { list("friction")? } else { Vec::new() },
            energy: Energy { kinetic, elastic, friction, damping, impact, drive, rolling, start },
        };
        Ok(Self { state, identity: file.text("/checkpoint/model")? })
    }
}

/// Refuses to continue what another version wrote, and what belongs to another job, naming the keys that differ. What
/// comes after the steps that are done may be another: duration and histories.
pub fn refuse_other_job(segments: &Segments, job: &Job) -> Result<()> {
    let parts = segments.parts();
    let Some(part) = parts.last() else {
        return Err(Error::Defect("a run to be continued was never begun".into()));
    };
    let place = segments.folder().display();
    if part.program != program() {
        return Err(Error::Job(format!(
            "--resume: {place} was written by {}, this is {}; continue it with that version",
            part.program,
            program()
        )));
    }
    let Some(wanted) = &job.analyses.transient else {
        return Err(Error::Job("--resume: only a transient can be continued; the job has none".into()));
    };
    let (done, total) = (segments.done(), wanted.steps());
    if total < done {
        return Err(Error::Job(format!(
            "--resume: {place} holds {done} steps already, more than the {total} of \
             analyses.transient.duration; expected {} s or more",
            done as f64 * wanted.step
        )));
    }
    let keys = run_differences(&part.job, &job.to_json(), done as f64 * wanted.step);
    if keys.is_empty() {
        return Ok(());
    }
    Err(Error::Job(format!(
        "--resume: {place} belongs to another job; these keys differ: {}. Continue it with the job that it was \
         begun with",
        keys.join(", ")
    )))
}
