//! How loud samples are: the limit cycles of some of them, each from its own most unstable mode. Stable samples are
//! silent.

use super::super::cycles::{folder, BranchOutcomes, Chain, FollowedPoints};
use super::super::{build, groups, point_of, Base, Sources};
use super::{Study, LEVELS};
use crate::analysis::run::Run;
use crate::job::{fe_inputs, Job, SampleCycles, SweepPlan};
use crate::model::SharedModel;
use crate::output::datasets::cycles::{motions, Cycle};
use crate::output::datasets::sweep::Outcome;
use crate::output::Table;
use crate::summary::Summary;
use crate::{Error, Result};

/// Group of the results.
const GROUP: &str = "/uncertainty/cycles";
/// Key of the sound.
const SOUND: &str = "analyses.uncertainty.cycles.sound_power";

/// Samples that were followed, on rank 0.
pub(in super::super) struct Loudness {
    /// Numbers of their points.
    points: Vec<usize>,
    /// True where the state of rest failed.
    has_failed: Vec<bool>,
    found: BranchOutcomes,
    /// Share of them that may fail.
    max_failed: f64,
}

/// Points of the samples that are followed among `samples` with `each` points, in `replicates`: the first ones of each.
fn followed(wanted: &SampleCycles, [samples, each, replicates]: [usize; 3]) -> Vec<usize> {
    let (of_replicate, length) = (wanted.samples as usize / replicates, samples / replicates);
    (0..samples).filter(|i| i % length < of_replicate).map(|i| i * each).collect()
}

impl Study<'_> {
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
        // Of points that share bodies one model is made.
        let mut moving: Vec<Option<Job>> = vec![None; points.len()];
        for (&i, _) in chosen.iter().zip(&unstable).filter(|p| *p.1 == 1) {
            moving[i] = points[i].clone();
        }
        let (cycles, folder) = (wanted.of_points(), folder(&run.options.output));
        let followed = FollowedPoints::create_folder(run, (&cycles, SOUND), (points, &folder))?;
        let mut found = BranchOutcomes::new(plan, &cycles);
        let mut earlier = Vec::new();
        let groups = groups(&moving);
        for (number, (inputs, members)) in groups.iter().enumerate() {
            let (mut model, sources) = match base.filter(|_| *inputs == fe_inputs(run.job)) {
                Some(base) => {
                    let model = SharedModel::broadcast(world, base.model.on_root())?;
                    (model, Sources::Base(base.bodies, base.modes))
                }
                None => {
                    run.progress.note(format!("bodies of limit cycles, {} of {}", number + 1, groups.len()));
                    let around = (run.meshes, &mut *run.progress);
                    let (model, bodies, modes) = build(run.petsc, point_of(points, members[0])?, &mut earlier, around)?;
                    (model, Sources::IntrinsicDamping(Box::new(bodies), modes))
                }
            };
            run.progress.stage("limit cycles of samples");
            let chains: Vec<Chain> = members.iter().map(|&i| Chain::of_point(i)).collect();
            found.follow(run, &followed, (&mut model, Some(sources)), (&chains, true))?;
        }
        let has_failed = chosen.iter().map(|&i| results[i].as_ref().is_none_or(|r| r.status != 0)).collect();
        Ok(Some(Loudness { points: chosen, has_failed, found, max_failed: self.wanted.max_failed }))
    }
}

impl Loudness {
    /// On rank 0: the tables, and what the summary says.
    pub(in super::super) fn report(self, plan: &SweepPlan, summary: &mut Summary) -> Vec<Table> {
        let Self { points, has_failed, mut found, max_failed } = self;
        let harmonics = found.cycles.iter().flatten().next().map_or(0, |c| c.lines.len());
        let all: Vec<Cycle> = points
            .iter()
            .zip(&has_failed)
            .map(|(&i, failed)| match (found.cycles[i].take(), failed) {
                (Some(cycle), _) => cycle,
                (None, true) => Cycle::none(harmonics),
                (None, false) => Cycle::at_rest([f64::NAN; 3], [0, 0], 0.0, harmonics),
            })
            .collect();
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
        let rows = points.iter().map(|&i| i as i64).collect::<Vec<i64>>();
        let mut tables = vec![Table::list(&group("sample"), "1", text, rows)];
        tables.extend(motions(GROUP, &[n], &all));
        if let Some(heard) = &found.heard {
            let silent = |c: &Cycle| if c.fate == 0 { f64::NEG_INFINITY } else { f64::NAN };
            let level = |c: &Cycle| heard.level(c).map_or_else(|| silent(c), |level| level.0);
            let levels: Vec<f64> = all.iter().map(level).collect();
            let mut known: Vec<f64> = levels.iter().copied().filter(|v| !v.is_nan()).collect();
            known.sort_by(f64::total_cmp);
            let loud: Vec<f64> = known.iter().copied().filter(|v| v.is_finite()).collect();
            if !loud.is_empty() {
                let [low, middle, high] = [0.05, 0.5, 0.95].map(|p| reached(&loud, p));
                let text = format!("median {middle:.1} dB(A) of those that squeal, 90 % within {low:.1} and {high:.1}");
                summary.value("  level", text);
                let text = format!("{} of all samples", in_words(reached(&known, 0.95)));
                summary.value("  one in twenty is louder than", text);
            }
            if let Some((k, text)) = heard.loudest(&all) {
                summary.value("  loudest", format!("{text}, {}", plan.place(points[k])));
            }
            let text =
                "A-weighted sound power level of the louder body, re 1 pW; -inf of a silent sample, NaN where it \
                        is not known.";
            tables.push(Table::list(&group("level_a"), "dB", text, levels));
            let text = "Levels that the shares /uncertainty/levels of all these samples do not exceed; -inf: silence.";
            tables.push(Table::list(&group("quantiles"), "dB", text, LEVELS.map(|p| reached(&known, p)).to_vec()));
            tables.extend(heard.tables(GROUP, &[n], &all));
        }
        let mut messages = vec![String::new(); n];
        found.failed.sort();
        let failed = found.failed.len() as f64 / n as f64;
        if let Some((_, point, why)) = found.failed.first().filter(|_| failed > max_failed) {
            summary.fail(Error::NotConverged(format!(
                "{} of {n} limit cycles were not computed, more than analyses.uncertainty.max_failed = {max_failed} of \
                 them; the others are in the results, and {GROUP}/message says which and why. The first is {}: {why}",
                found.failed.len(),
                plan.place(*point)
            )));
        }
        for (_, point, why) in found.failed {
            points.iter().position(|&i| i == point).into_iter().for_each(|k| messages[k].clone_from(&why));
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
