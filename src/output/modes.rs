//! Mode shapes as a sequence: one step for each mode, so that ParaView steps through them.

use super::fields::{BodyPart, FieldKind, FieldSpec};
use super::sequence::{Sequence, SequenceFile};
use super::table::Table;
use crate::parallel::World;
use crate::{Error, Result};
use std::path::Path;

/// Collective: writes the real modes of the bodies into a file of their own, to be finished, or attached to the main
/// file. Its steps are numbered 1, 2, …: the modes of the first of `bodies`, then those of the next; while one body
/// shows its mode the others stand still. Shapes are in single precision if `single`. `frequencies[b]` are the
/// frequencies of the modes of body b, Hz; `shape(b, k)`, collective, returns mode k of body b at this rank's local
/// nodes in lower form, mass-normalised, 1/√kg, `[3 * nodes]`.
pub fn write_modes<'w>(
    world: &'w World,
    path: &Path,
    (overwrite, single): (bool, bool),
    bodies: &[BodyPart],
    frequencies: &[Vec<f64>],
    mut shape: impl FnMut(usize, usize) -> Result<Vec<f64>>,
) -> Result<SequenceFile<'w>> {
    if frequencies.len() != bodies.len() {
        let (have, want) = (frequencies.len(), bodies.len());
        return Err(Error::Defect(format!("modes of {have} bodies of {want} are written")));
    }
    let modes: Vec<(usize, usize)> =
        frequencies.iter().enumerate().flat_map(|(b, f)| (0..f.len()).map(move |k| (b, k))).collect();
    let steps: Vec<f64> = (1..=modes.len()).map(|k| k as f64).collect();
    let body: Vec<i8> = modes.iter().map(|&(b, _)| if bodies[b].upper { 2 } else { 1 }).collect();
    let number: Vec<i64> = modes.iter().map(|&(_, k)| k as i64 + 1).collect();
    let tables = [
        Table::list("/modes/frequency", "Hz", "Frequency of the mode of each step.", frequencies.concat()).summed(),
        Table::list("/modes/body", "-", "Body whose mode each step shows: 1 lower, 2 upper.", body).summed(),
        Table::list("/modes/number", "1", "Number of the mode of each step in its body, from 1.", number).summed(),
    ];
    let text = "Free-interface mode, mass-normalised: displacement for a unit modal coordinate.";
    let spec = FieldSpec::new("shape", "kg^-1/2", text, FieldKind::Vector);
    let description = "Number of the step; /modes/frequency, /modes/body and /modes/number say which mode it is.";
    let sequence =
        Sequence { fields: vec![spec], values: &steps, units: "1", description, tables: &tables, summed: true, single };
    let mut file = SequenceFile::create(world, path, overwrite, bodies, sequence)?;
    let mut still: Vec<Vec<f64>> = bodies.iter().map(|b| vec![0.0; 3 * b.part.node_ids.len()]).collect();
    for (step, &(b, k)) in modes.iter().enumerate() {
        let moving = world.agree(shape(b, k))?;
        let at_rest = std::mem::replace(&mut still[b], moving);
        let written = file.step(step, &[still.iter().map(Vec::as_slice).collect()]);
        still[b] = at_rest;
        written?;
    }
    Ok(file)
}
