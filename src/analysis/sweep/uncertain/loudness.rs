//! How loud samples are: the limit cycles of some of them, each from its own most unstable mode. Stable samples are
//! silent.

use super::super::cycles::{folder, BranchOutcomes, Chain, FollowedPoints};
use super::super::sound::SoundSetup;
use super::super::{build, goes_on, groups, point_of, Base, Sources};
use super::{Study, LEVELS};
use crate::analysis::radiation::bands_of;
use crate::analysis::run::Run;
use crate::job::{fe_inputs, Job, SampleCycles, SweepPlan};
use crate::model::SharedModel;
use crate::output::datasets::cycles::{motions, Cycle};
use crate::output::datasets::sweep::Outcome;
use crate::output::Table;
use crate::parallel::World;
use crate::summary::Summary;
use crate::transient::scheme::LIMIT;
use crate::{Error, Result};
use std::f64::consts::PI;

/// Group of the results.
const GROUP: &str = "/uncertainty/cycles";
/// Key of the sound.
const SOUND: &str = "analyses.uncertainty.cycles.sound_power";

/// Samples that were followed, on rank 0.
pub(in super::super) struct Loudness {
    /// Numbers of their points, and their states of rest.
    samples: Vec<(usize, Outcome)>,
    found: BranchOutcomes,
    harmonics: usize,
    /// True if sound is wanted.
    is_heard: bool,
    /// Share of them that may fail.
    max_failed: f64,
}

/// Points of the samples that are followed among `samples` with `each` points, in `replicates`: the first ones of each.
fn followed(wanted: &SampleCycles, [samples, each, replicates]: [usize; 3]) -> Vec<usize> {
    let (of_replicate, length) = (wanted.samples as usize / replicates, samples / replicates);
    (0..samples).filter(|i| i % length < of_replicate).map(|i| i * each).collect()
}

impl Study<'_> {
    /// Collective: an error if samples cannot be followed in time, or heard, on the bodies of the job's own point.
    pub(in super::super) fn check_cycles(&self, world: &World, base: Option<&Base<'_, '_>>) -> Result<()> {
        let (Some(wanted), Some(base)) = (&self.wanted.cycles, base) else { return Ok(()) };
        if let Some(sound) = &wanted.sound_power {
            bands_of((SOUND, sound), base.bodies, base.modes)?;
        }
        world.on_root(|| {
            let highest = base.model.root()?.pair.omega.iter().copied().fold(0.0, f64::max);
            if wanted.step * highest > LIMIT {
                return Err(Error::Job(format!(
                    "analyses.uncertainty.cycles.step: found {} s, too long for the highest mode kept, {:.1} Hz; \
                     expected at most {:.3e} s, 2 pi steps to its period: take a shorter step or fewer modes",
                    wanted.step,
                    highest / (2.0 * PI),
                    LIMIT / highest
                )));
            }
            Ok(())
        })?;
        Ok(())
    }

    /// Collective: the limit cycles of some samples among the `points` with these `results`, if they are wanted.
    pub(in super::super) fn loudness(
        &self,
        run: &mut Run,
        (plan, points): (&SweepPlan, &[Option<Job>]),
        base: Option<&Base<'_, '_>>,
        results: &[Option<Outcome>],
    ) -> Result<Option<Loudness>> {
        let Some(wanted) = &self.wanted.cycles else { return Ok(None) };
        let world = run.world();
        let each = self.wanted.points_per_sample();
        let chosen = followed(wanted, [points.len() / each, each, self.wanted.replicates()]);
        let unstable = |i: &usize| u8::from(results[*i].as_ref().is_some_and(|r| r.unstable() > 0));
        let unstable = world.broadcast(chosen.iter().map(unstable).collect::<Vec<u8>>());
        let moving: Vec<usize> = chosen.iter().zip(&unstable).filter(|p| *p.1 == 1).map(|p| *p.0).collect();
        let jobs: Vec<Option<Job>> = moving.iter().map(|&i| points[i].clone()).collect();
        let (cycles, folder) = (wanted.of_points(), folder(&run.options.output));
        let followed = FollowedPoints::create_folder(run, (&cycles, SOUND), (points, &folder))?;
        let mut found = BranchOutcomes::new(plan, &cycles);
        let mut earlier = Vec::new();
        // Points that share bodies share a model.
        let groups = groups(&jobs);
        for (number, (inputs, members)) in groups.iter().enumerate() {
            let members: Vec<usize> = members.iter().map(|&k| moving[k]).collect();
            let (mut model, sources) = match base.filter(|_| *inputs == fe_inputs(run.job)) {
                Some(base) => {
                    let model = SharedModel::broadcast(world, base.model.on_root())?;
                    (model, Sources::Base(base.bodies, base.modes))
                }
                None => {
                    run.progress.note(format!("bodies of limit cycles, {} of {}", number + 1, groups.len()));
                    let around = (run.meshes, &mut *run.progress);
                    match build(run.petsc, point_of(points, members[0])?, &mut earlier, around) {
                        Ok((model, bodies, modes)) => (model, Sources::IntrinsicDamping(Box::new(bodies), modes)),
                        Err(e) if goes_on(&e) => {
                            found.failed.extend(members.iter().map(|&i| (0, i, e.to_string())));
                            continue;
                        }
                        Err(e) => return Err(e),
                    }
                }
            };
            let chains: Vec<Chain> = members.iter().map(|&i| Chain::of_point(i)).collect();
            found.follow(run, &followed, (&mut model, Some(sources)), (&chains, true))?;
        }
        // On rank 0 alone there are all results.
        let state = |&i: &usize| results[i].clone().map(|outcome| (i, outcome));
        Ok(Some(Loudness {
            samples: chosen.iter().filter_map(state).collect(),
            found,
            harmonics: cycles.harmonics as usize,
            is_heard: wanted.sound_power.is_some(),
            max_failed: self.wanted.max_failed,
        }))
    }
}

impl Loudness {
    /// On rank 0: the tables, and what the summary says.
    pub(in super::super) fn report(self, plan: &SweepPlan, summary: &mut Summary) -> Vec<Table> {
        let Self { samples, mut found, harmonics, is_heard, max_failed } = self;
        let silence = found.heard.as_ref().map_or(Vec::new(), SoundSetup::silence);
        let cycle = |(i, rest): &(usize, Outcome)| match found.cycles[*i].take() {
            Some(cycle) => cycle,
            None if rest.status != 0 || rest.unstable() > 0 => Cycle::none(harmonics),
            None => {
                let cycle = Cycle::at_rest(rest.force, [rest.closed, rest.sticking], 0.0, harmonics);
                Cycle { sound: silence.clone(), ..cycle }
            }
        };
        let all: Vec<Cycle> = samples.iter().map(cycle).collect();
        let count = |fate: i8| all.iter().filter(|c| c.fate == fate).count();
        let (n, squealing) = (all.len(), all.iter().filter(|c| c.fate > 0).count());
        let mut text = format!("{squealing} of {n} samples squeal");
        for (fate, what) in [(2, "irregular"), (3, "unsettled"), (-1, "not computed")] {
            if count(fate) > 0 {
                text += &format!(", {} {what}", count(fate));
            }
        }
        summary.value("limit cycles", text);
        let group = |name: &str| format!("{GROUP}/{name}");
        let text = "Row of each followed sample in the tables of /uncertainty.";
        let rows = samples.iter().map(|s| s.0 as i64).collect::<Vec<i64>>();
        let mut tables = vec![Table::list(&group("sample"), "1", text, rows)];
        tables.extend(motions(GROUP, &[n], &all));
        if is_heard {
            let level = |c: &Cycle| match c.fate {
                0 => f64::NEG_INFINITY,
                _ => found.heard.as_ref().and_then(|heard| heard.level(c)).map_or(f64::NAN, |level| level.0),
            };
            let levels: Vec<f64> = all.iter().map(level).collect();
            let mut known: Vec<f64> = levels.iter().copied().filter(|v| !v.is_nan()).collect();
            known.sort_by(f64::total_cmp);
            let loud: Vec<f64> = known.iter().copied().filter(|v| v.is_finite()).collect();
            if !loud.is_empty() {
                let [low, middle, high] = [0.05, 0.5, 0.95].map(|p| reached(&loud, p));
                let text = format!("median {middle:.1} dB(A) of those that squeal, 90 % within {low:.1} and {high:.1}");
                summary.value("  level", text);
            }
            if !known.is_empty() {
                let text =
                    format!("{} of {} samples, silent ones among them", in_words(reached(&known, 0.95)), known.len());
                summary.value("  one in twenty is louder than", text);
            }
            if let Some((k, text)) = found.heard.as_ref().and_then(|heard| heard.loudest(&all)) {
                summary.value("  loudest", format!("{text}, {}", plan.place(samples[k].0)));
            }
            let text = "A-weighted sound power level of the louder body, re 1 pW; -inf: silent, NaN: not known.";
            tables.push(Table::list(&group("level_a"), "dB", text, levels));
            let text = "Levels that the shares /uncertainty/levels of the known ones do not exceed; -inf: silence.";
            tables.push(Table::list(&group("quantiles"), "dB", text, LEVELS.map(|p| reached(&known, p)).to_vec()));
            tables.extend(found.heard.iter().flat_map(|heard| heard.tables(GROUP, &[n], &all)));
        }
        let mut messages: Vec<String> = samples.iter().map(|s| s.1.message.clone()).collect();
        found.failed.sort();
        for (_, point, why) in &found.failed {
            samples.iter().position(|s| s.0 == *point).into_iter().for_each(|k| messages[k].clone_from(why));
        }
        if let Some((_, point, why)) = found.failed.first() {
            let (place, failed) = (plan.place(*point), found.failed.len());
            summary.value("  first not computed", format!("{place}: {why}"));
            if failed as f64 / n as f64 > max_failed {
                summary.fail(Error::NotConverged(format!(
                    "{failed} of {n} limit cycles were not computed, more than analyses.uncertainty.max_failed = \
                     {max_failed} of them; the others are in the results, and {GROUP}/message says which and why. The \
                     first is {place}: {why}"
                )));
            }
        }
        let text = "Why a limit cycle was not computed; empty where it was.";
        tables.push(Table::list(&group("message"), "-", text, messages));
        tables
    }
}

/// The smallest of sorted `values` that a share `p` of them does not exceed; NaN of none.
fn reached(values: &[f64], p: f64) -> f64 {
    let place = (p * values.len() as f64).ceil() as usize;
    values.get(place.clamp(1, values.len().max(1)) - 1).copied().unwrap_or(f64::NAN)
}

/// A level.
fn in_words(level: f64) -> String {
    match level.is_finite() {
        true => format!("{level:.1} dB(A)"),
        false => "silence".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first samples of each replicate are followed, by the first point of each.
    #[test]
    fn first_samples_of_each_replicate_are_followed() {
        let wanted = |samples: u32| -> SampleCycles {
            serde_json::from_value(serde_json::json!({ "samples": samples })).unwrap()
        };
        assert_eq!(followed(&wanted(4), [8, 1, 2]), [0, 1, 4, 5]);
        assert_eq!(followed(&wanted(4), [8, 5, 1]), [0, 5, 10, 15]);
        assert_eq!(followed(&wanted(8), [8, 1, 1]), (0..8).collect::<Vec<_>>());
    }

    /// Levels that shares of the samples do not exceed, silent ones among them.
    #[test]
    fn levels_are_those_of_samples() {
        let silent = f64::NEG_INFINITY;
        assert_eq!(reached(&[silent, silent, 90.0, 100.0], 0.5), silent);
        assert_eq!(reached(&[silent, silent, 90.0, 100.0], 0.51), 90.0);
        assert_eq!([0.0, 0.95, 1.0].map(|p| reached(&[90.0, 100.0], p)), [90.0, 100.0, 100.0]);
        assert!(reached(&[], 0.5).is_nan());
    }
}
