//! The state that a run on all degrees of freedom begins with, and how it is kept.

use super::super::Inputs;
use super::root_driver::{RootDriver, RootHalf};
use crate::analysis::complex_modes::recovered;
use crate::analysis::full_stability::FullComparison;
use crate::body::Side;
use crate::case::transient_problem::scale;
use crate::output::datasets::checkpoint::Checkpoint;
use crate::output::Table;
use crate::parallel::World;
use crate::stability::reduced::reactions;
use crate::transient::State;
use crate::{Error, Result};
use num_complex::Complex;

type C = Complex<f64>;

/// Group of the segments.
const GROUP: &str = "/checkpoint/full";
/// Data kept of each body, with its unit and its text.
const KEPT: [[&str; 3]; 2] = [
    ["displacement", "m", "Displacements of the degrees of freedom, rank by rank."],
    ["velocity", "m/s", "Velocities of the degrees of freedom, rank by rank."],
];

/// Start of a run.
pub(super) struct FullStart {
    /// This rank's displacements and velocities of each body.
    pub(super) motion: Vec<(Vec<f64>, Vec<f64>)>,
    /// On rank 0: the rest of the state of a run that is continued.
    pub(super) state: Option<State>,
    /// On rank 0: the model that it was begun with.
    pub(super) identity: Option<String>,
}

/// Collective: at rest under the reactions of `rest`, which rank 0 has, and moved as the job says.
pub(super) fn fresh(world: &World, inputs: &Inputs<'_>, rest: Option<&State>) -> Result<FullStart> {
    let (bodies, start) = (inputs.bodies, &inputs.wanted.start);
    let mut motion = Vec::new();
    for place in &bodies.places {
        let forces = rest.map_or(Vec::new(), |rest| place.side.orient(&rest.reaction));
        let u = bodies.fields(place.body)?.statics(&forces, 1)?;
        let v = vec![0.0; u.len()];
        motion.push((u, v));
    }
    match (inputs.beside, start.mode) {
        (_, None) => {}
        (Some(beside), _) => along(world, inputs, beside, &mut motion)?,
        (None, _) => along_mode(world, inputs, &mut motion)?,
    }
    if let Some(random) = start.random {
        let drawn = world.on_root(|| {
            let count = inputs.model.root()?.pair.omega.len();
            let still = State { v: vec![0.0; count], ..rest.cloned().unwrap_or_else(nowhere) };
            Ok(still.shaken(u64::from(random.seed), random.energy).v)
        })?;
        let drawn = world.broadcast(drawn.unwrap_or_default());
        let mut first = 0;
        for (place, (_, v)) in bodies.places.iter().zip(&mut motion) {
            let vectors = &bodies.shapes_of(place.body)?.vectors;
            for (phi, rate) in vectors.iter().zip(&drawn[first..]) {
                v.iter_mut().zip(phi).for_each(|(v, p)| *v += rate * p);
            }
            first += vectors.len();
        }
    }
    Ok(FullStart { motion, state: None, identity: None })
}

/// Collective: moves the bodies by a complex mode of their own. Its amplitude is that of the reduced one beside it:
/// what the modes have of it at the contact.
fn along(
    world: &World,
    inputs: &Inputs<'_>,
    beside: &FullComparison,
    motion: &mut [(Vec<f64>, Vec<f64>)],
) -> Result<()> {
    let found =
        world.on_root(|| Ok(scale(&inputs.model.root()?.pair, &beside.amplitudes, inputs.wanted.start.amplitude)))?;
    let scale = world.broadcast(vec![found.unwrap_or_default()])[0];
    for (mode, (u, v)) in beside.motion.iter().zip(motion) {
        u.iter_mut().zip(mode).for_each(|(u, z)| *u += (scale * z).re);
        v.iter_mut().zip(mode).for_each(|(v, z)| *v += (scale * beside.value * z).re);
    }
    Ok(())
}

/// Collective: moves the bodies by a complex mode of the reduced model, with what its reactions do statically beyond
/// the modes: the closed nodes stay closed.
fn along_mode(world: &World, inputs: &Inputs<'_>, motion: &mut [(Vec<f64>, Vec<f64>)]) -> Result<()> {
    let mode = world.on_root(|| {
        let root = inputs.model.root()?;
        let found = inputs.found.ok_or_else(|| Error::Defect("no stability to start from".into()))?;
        let pair = inputs.start_mode()?;
        let mut all = vec![C::default(); root.pair.modes.nrows()];
        for (j, f) in reactions(&root.pair, &found.contact, pair)?.into_iter().enumerate() {
            all[3 * found.contact.nodes[j / 3].node + j % 3] = f;
        }
        let scale = scale(&root.pair, &pair.modal, inputs.wanted.start.amplitude);
        Ok((pair.modal.iter().map(|q| scale * q).collect::<Vec<C>>(), all, scale, pair.value))
    })?;
    let (modal, forces, scale, value) = mode.unwrap_or_default();
    let modal = world.broadcast(modal);
    let value = world.broadcast(vec![value])[0];
    let mut first = 0;
    for (place, (u, v)) in inputs.bodies.places.iter().zip(motion) {
        let count = inputs.bodies.shapes_of(place.body)?.vectors.len();
        let turned = |of: fn(&C) -> f64| -> Vec<f64> {
            let part: Vec<f64> = forces.iter().map(|f| of(&(scale * f))).collect();
            place.side.orient(&part)
        };
        let parts = [turned(|f| f.re), turned(|f| f.im)];
        let moved = recovered(world, inputs.bodies, place.body, &modal[first..first + count], &parts)?;
        u.iter_mut().zip(&moved).for_each(|(u, z)| *u += z.re);
        v.iter_mut().zip(&moved).for_each(|(v, z)| *v += (value * z).re);
        first += count;
    }
    Ok(())
}

fn nowhere() -> State {
    State {
        step: 0,
        q: Vec::new(),
        v: Vec::new(),
        reaction: Vec::new(),
        motions: vec![0.0],
        creep: [0.0; 2],
        friction: Vec::new(),
        energy: crate::transient::Energy::default(),
    }
}

/// Collective: where the last segment ends.
pub(super) fn resumed(world: &World, inputs: &Inputs<'_>, halves: &[RootHalf<'_>]) -> Result<FullStart> {
    let found = world.on_root(|| {
        let segments = inputs.segments()?;
        let entries = segments.entries();
        let last = entries.last().ok_or_else(|| Error::Defect("a run to be continued has no segment".into()))?;
        let file = segments.open(last)?;
        let mut whole = Vec::new();
        for (half, side) in halves.iter().zip(Side::BOTH) {
            let group = format!("{GROUP}/{}", side.name());
            let ranks = file.numbers(&format!("{group}/ranges"))?.1;
            let now: Vec<f64> = half.ranges.iter().map(|r| *r as f64).collect();
            if ranks != now {
                return Err(Error::Job(format!(
                    "--resume: {}: found degrees of freedom of the {} body on {} ranks, expected {}; continue a \
                     full transient on as many ranks as it was begun on",
                    segments.path(last).display(),
                    side.name(),
                    ranks.len().saturating_sub(1),
                    world.size
                )));
            }
            for [name, ..] in KEPT {
                let values = file.numbers(&format!("{group}/{name}"))?.1;
                let count = half.ranges.last().copied().unwrap_or(0) as usize;
                if values.len() != count {
                    return Err(Error::Input(format!(
                        "--resume: {}: {group}/{name}: found {} values, expected {count}",
                        segments.path(last).display(),
                        values.len()
                    )));
                }
                let parts = half.ranges.windows(2).map(|r| values[r[0] as usize..r[1] as usize].to_vec());
                whole.push(parts.collect::<Vec<Vec<f64>>>());
            }
        }
        Ok((whole, Checkpoint::last(segments)?))
    })?;
    let (whole, last) = found.map_or((Vec::new(), None), |(whole, last)| (whole, Some(last)));
    let mut whole = whole.into_iter();
    let mut next = || world.scatter(whole.next().unwrap_or_default());
    let motion = halves.iter().map(|_| (next(), next())).collect();
    let (state, identity) = last.map_or((None, None), |last| (Some(last.state), Some(last.identity)));
    Ok(FullStart { motion, state, identity })
}

/// The state of all degrees of freedom as tables of a segment.
pub(super) fn tables(leader: &RootDriver<'_>) -> Vec<Table> {
    let mut tables = Vec::new();
    for ((whole, side), ranges) in leader.save().into_iter().zip(Side::BOTH).zip(leader.ranges()) {
        let group = format!("{GROUP}/{}", side.name());
        let ranges: Vec<f64> = ranges.iter().map(|r| *r as f64).collect();
        tables.push(Table::list(&format!("{group}/ranges"), "1", "First degree of freedom of each rank.", ranges));
        for ([name, units, text], values) in KEPT.into_iter().zip(whole) {
            tables.push(Table::list(&format!("{group}/{name}"), units, text, values));
        }
    }
    tables
}
