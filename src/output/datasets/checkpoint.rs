//! The state of a run as tables, and the way back.

use super::super::{Reader, Segments, Table, Values};
use crate::job::{differences, Job};
use crate::model::ModalMatrix;
use crate::transient::{Energy, Model, State};
use crate::{Error, Result};
use serde_json::Value;
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
    for matrix in [model.residual, model.modes] {
        matrix.col_iter().for_each(|c| c.iter().for_each(|&v| add(v)));
    }
    model.omega.iter().chain(&model.damping.values()).chain(&model.interface.gap).for_each(|&v| add(v));
    // That of a body at rest is in its frequencies.
    if let ModalMatrix::Blocks(_) = &model.stiffness {
        model.stiffness.values().into_iter().for_each(add);
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

fn program() -> String {
    format!("railsqueal {}", env!("CARGO_PKG_VERSION"))
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
        Table::scalar("/checkpoint/approach", "m", "Approach.", state.approach),
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
    /// That of the last segment; none where there is no segment.
    pub fn last(segments: &Segments, job: &Job) -> Result<Option<Self>> {
        refuse_other_job(segments, job)?;
        let Some(path) = segments.files()?.pop() else { return Ok(None) };
        let file = Reader::open(&path)?;
        let list = |name: &str| file.numbers(&format!("/checkpoint/{name}")).map(|(_, v)| v);
        let wrong = |name: &str| Error::Job(format!("{}: /checkpoint/{name} is not as it was written", path.display()));
        let Values::I64(step) = file.read("/checkpoint/step")?.1 else { return Err(wrong("step")) };
        let (approach, creep, energy) = (list("approach")?, list("creep")?, list("energy")?);
        let [kinetic, elastic, friction, damping, impact, drive, rolling, start] = energy[..] else {
            return Err(wrong("energy"));
        };
        let ([step], [approach], [cx, cy]) = (&step[..], &approach[..], &creep[..]) else {
            return Err(wrong("approach"));
        };
        let state = State {
            step: *step as u64,
            q: list("q")?,
            v: list("v")?,
            reaction: list("reaction")?,
            approach: *approach,
            creep: [*cx, *cy],
            friction: if file.has("/checkpoint/friction") { list("friction")? } else { Vec::new() },
            energy: Energy { kinetic, elastic, friction, damping, impact, drive, rolling, start },
        };
        Ok(Some(Self { state, identity: file.text("/checkpoint/model")? }))
    }
}

/// Refuses to continue what cannot be read, what another version wrote, and what belongs to another job, naming the keys that
/// differ.
pub fn refuse_other_job(segments: &Segments, job: &Job) -> Result<()> {
    let Some(path) = segments.files()?.pop() else {
        return Err(Error::Job(format!(
            "--resume: there is nothing to continue in {}; name the result file of a run that was stopped",
            segments.folder().display()
        )));
    };
    let read = |name: &str| {
        let file = Reader::open(&path)?;
        file.text(&format!("/checkpoint/{name}"))
    };
    let unreadable = |e: Error| {
        Error::Job(format!("--resume: {}; remove this file to continue from the segment before it", e.message()))
    };
    let version = read("program").map_err(unreadable)?;
    if version != program() {
        return Err(Error::Job(format!(
            "--resume: {} was written by {version}, this is {}; continue it with that version",
            path.display(),
            program()
        )));
    }
    let kept: Value = serde_json::from_str(&read("job").map_err(unreadable)?)
        .map_err(|e| Error::Job(format!("--resume: {}: the job in it cannot be read: {e}", path.display())))?;
    let keys: Vec<String> = differences(&kept, &job.to_json()).into_iter().map(|d| d.key).collect();
    if keys.is_empty() {
        return Ok(());
    }
    Err(Error::Job(format!(
        "--resume: {} belongs to another job; these keys differ: {}. Continue it with the job that it was begun with",
        path.display(),
        keys.join(", ")
    )))
}
