//! Branches of limit cycles of a job: cycles that they begin with, the walk along each in both directions, thresholds
//! of rest and of squeal that was started. Starts and directions are spread over the ranks; the result does not depend
//! on their number. Everything that is done is kept on the disk, and a later run of the same job takes it up.

pub mod animation;
mod curve;
mod follow;
mod hopf;
mod onsets;
mod search;
mod sound;
mod spread;
mod starts;
mod stored_branches;
mod summary;
#[cfg(test)]
mod tests;
mod thresholds;

use super::radiation::ModalSound;
use super::reduction::Reduction;
use super::run::Run;
use crate::body::TraceModes;
use crate::case::bodies::BuiltBodies;
use crate::case::limit_cycle_point::watch;
use crate::cycles::Structure;
use crate::job::{key_unit, Branches, RADIUS};
use crate::model::{shared, CoupledModel, SharedModel};
use crate::output::datasets::branches::{BranchTables, Onset};
use crate::stability::nonlinear_eigen::SpectrumMemory;
use crate::{Error, Result};
use curve::CurveTable;
use follow::BranchFollower;
use search::{Clock, Search};
use std::cell::RefCell;
use stored_branches::StoredBranches;

pub use stored_branches::job_of;

/// Part of the range of the key to which thresholds and special points are located.
const LOCATED: f64 = 1e-6;

/// Key of the sound of the cycles.
pub const SOUND: &str = "analyses.cycles.sound_power";

/// Collective: the branches of `wanted`; tables under `/cycles`. `bodies` and `modes` are those whose sound is asked
/// for.
pub fn run(
    run: &mut Run,
    wanted: &Branches,
    model: &Reduction,
    (bodies, modes): (&BuiltBodies, &[TraceModes]),
) -> Result<()> {
    let (world, job) = (run.world(), run.job);
    run.progress.stage("limit cycles");
    let own;
    let pair = match (world.size, model.on_root()) {
        (1, Some(root)) => (&root.interface, &root.pair),
        (_, root) => {
            let interface = shared(world, root.map(|m| &m.interface))?;
            own = (interface, CoupledModel::broadcast(world, root.map(|m| &m.pair)));
            (&own.0, &own.1)
        }
    };
    let curve = match wanted.along == RADIUS {
        true => Some(CurveTable::new(world, job, [wanted.from, wanted.to])?),
        false => None,
    };
    let adapted = match job.modes_change_along(&wanted.along) {
        true => {
            let mut adapted = SharedModel::broadcast(world, model.on_root())?;
            // The same to the last bit whatever values of the key came before.
            adapted.renew();
            Some(RefCell::new(adapted))
        }
        false => None,
    };
    let memory = SpectrumMemory::default();
    let search = Search { job, wanted, model: pair, bodies: adapted.as_ref(), curve: curve.as_ref(), memory: &memory };
    let clock = Clock::new(run.stop);
    let kept = StoredBranches::open(world, &run.options.output, run.given, &search)?;
    run.file.discard(kept.folder());
    let halt = |clock: &Clock<'_>| match world.max(f64::from(u8::from(clock.is_over()))) > 0.0 {
        true => Err(clock.error(kept.folder(), &run.options.output)),
        false => Ok(()),
    };
    let onsets = onsets::all(&search, world, (&kept, &clock), run.progress)?;
    halt(&clock)?;
    let candidates = starts::candidates(&search, world, &onsets)?;
    if candidates.is_empty() {
        return Err(no_unstable_mode(&search, &onsets));
    }
    let transient = search.transient()?;
    let rolling = search.rolling(job, &transient, pair.1)?;
    let ready = rolling.ready()?;
    let (rest, _) = ready.initial_state(&ready.model(pair.1), &rolling)?;
    let structure = Structure::new(ready.model(pair.1))?;
    let walker = BranchFollower { search: &search, structure: &structure, kept: &kept, clock: &clock };
    let (starts, failed) = walker.starts(world, &candidates, run.progress)?;
    halt(&clock)?;
    if starts.is_empty() {
        let first = failed.first().map_or(String::new(), |f| format!("; the first, {}: {}", f.origin, f.why));
        let text = format!(
            "analyses.cycles: none of {} starts led to a cycle{first}; expected one that does: give a longer \
             analyses.cycles.march.duration, other modes or values of the key in analyses.cycles.starts (modes, at), \
             or its thresholds or results",
            candidates.len()
        );
        return Err(Error::NotConverged(text));
    }
    let branches = walker.branches(world, &candidates, starts, run.progress)?;
    halt(&clock)?;
    let (nodal, lost) = walker.nodal_periods(world, &branches.all)?;
    let sounding = match &wanted.sound_power {
        Some(sound) => {
            run.progress.stage("radiation of sound");
            let motions = (wanted.march.step, pair.0.patches.len());
            Some(ModalSound::new(world, (SOUND, sound), motions, bodies, modes)?)
        }
        None => None,
    };
    let found = world.on_root(|| {
        let rows = |patch: usize| {
            let rows = watch(pair, &rest, patch);
            (0..rows.nrows()).map(|i| rows.row(i).iter().copied().collect()).collect::<Vec<Vec<f64>>>()
        };
        let watched: Vec<Vec<f64>> = (0..pair.0.patches.len()).flat_map(rows).collect();
        let unit = key_unit(&wanted.along);
        let criticality = hopf::criticality(&onsets, &branches.all, wanted.to - wanted.from);
        let tables = BranchTables {
            along: (&wanted.along, &unit),
            branches: &branches.all,
            every: wanted.every,
            watch: &watched,
            onsets: &onsets,
            criticality: &criticality,
            structure: (&structure, pair.0),
            nodal: &nodal,
        };
        let sounds = sounding.as_ref().map(|s| sound::Sounds::new(s, &branches.all)).transpose()?;
        let mut tables = tables.tables();
        tables.extend(sounds.iter().flat_map(sound::Sounds::tables));
        Ok((tables, watched, criticality, sounds))
    })?;
    let every = wanted.every;
    if let Some((tables, watched, criticality, sounds)) = found {
        let told = summary::BranchSummary {
            wanted,
            branches: &branches,
            onsets: &onsets,
            criticality: &criticality,
            watch: &watched,
            failed: &failed,
        };
        told.write(sounds.as_ref(), &mut run.summary);
        if let Some(curve) = &curve {
            run.summary.value("contacts over the radius", curve.text());
        }
        if let Some(why) = lost {
            run.summary.fail(Error::NotConverged(format!(
                "limit cycles: forces of the contact nodes over a period (/cycles/period) are missing, all else is in \
                 the results: {why}"
            )));
        }
        run.file.tables(tables);
    }
    animation::write(run, bodies, &branches.all, every)
}

/// The error of a job without a start.
fn no_unstable_mode(search: &Search<'_>, onsets: &[Onset]) -> Error {
    let along = &search.wanted.along;
    let at: Vec<String> = search.values().iter().map(f64::to_string).collect();
    let known: Vec<String> = onsets.iter().map(|o| format!("{:.6}", o.key)).collect();
    Error::Job(format!(
        "analyses.cycles: rest is stable at {along} = {}, so no cycle begins there by itself; expected a job with an \
         unstable mode, or analyses.cycles.starts with other values of the key (at), thresholds, or a cycle of an \
         earlier result (results){}",
        at.join(", "),
        match known.is_empty() {
            true => String::new(),
            false => format!("; its stability changes at {along} = {}", known.join(", ")),
        }
    ))
}
