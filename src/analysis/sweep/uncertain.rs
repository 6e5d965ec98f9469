//! The points of `analyses.uncertainty`: modes followed from the job's own point by their shapes, and what the samples
//! say of them.

use super::bases::{Bases, Strayed, Survey};
use super::counts::{Counted, Counts};
use super::point_model::{FollowedRate, StudyModel};
use super::Base;
use crate::analysis::stability::mode_name;
use crate::case::stability_problem::StabilityResult;
use crate::contact::LinearContact;
use crate::job::{self, Job, SweepPlan, Uncertainty};
use crate::model::CoupledModel;
use crate::output::datasets::sweep::{Followed, Outcome};
use crate::output::datasets::uncertainty::{tables, ModeOf, StudyStatistics as Report};
use crate::output::Table;
use crate::parallel::World;
use crate::random::indices::indices;
use crate::random::interval::{quantile, share};
use crate::stability::nonlinear_eigen::{LastSpectrum, SpectrumMemory};
use crate::stability::reduced::{shares, Eigenpair};
use crate::stability::{grows, is_rigid, spectrum, Spectrum};
use crate::summary::Summary;
use crate::{Error, Result};
use num_complex::Complex;
use std::cell::Cell;

type C = Complex<f64>;

/// Modes of the job's own point that are followed: the least damped ones.
const FOLLOWED: usize = 100;
/// Part of its frequency by which that of a mode may change from the job's own point to a sample.
const NEAR: f64 = 0.2;
/// Modal assurance criterion from which on a motion is a mode that is followed.
pub(super) const ALIKE: f64 = 0.5;
/// Modal assurance criterion below which a motion of a base point becomes no mode that is followed.
const UNLIKE: f64 = 0.2;
/// Modes that are told of at least, where fewer are unstable in samples.
const TOLD: usize = 3;
/// Probabilities of the quantiles of growth rates.
pub(super) const LEVELS: [f64; 7] = [0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99];

/// A mode of the job's own point.
#[derive(Debug, Clone)]
struct Reference {
    value: C,
    /// Amplitudes of the free modes of both bodies, of norm 1, `[m]`.
    modal: Vec<C>,
    /// Its frequency and what it consists of; on rank 0.
    name: String,
}

/// The study on every rank.
pub(super) struct Study<'a> {
    wanted: &'a Uncertainty,
    references: Vec<Reference>,
    /// Free modes of the lower body.
    lower: usize,
    /// Points from which the others begin.
    bases: Bases,
    /// Points at which unstable eigenvalues are counted.
    counts: Counts,
    /// Largest number of modes that are continued on a model, where not all are.
    near: Cell<Option<usize>>,
    /// True while points that no base point leads to are left for later.
    defers: Cell<bool>,
    /// Memory of the search for eigenvalues on this rank.
    memory: SpectrumMemory,
}

impl<'a> Study<'a> {
    /// Collective: the study of `job`, if it has one, with the modes of its own point.
    pub(super) fn new(
        world: &World,
        (job, plan): (&'a Job, &SweepPlan),
        (base, own): (Option<&Base<'_, '_>>, Option<&Error>),
    ) -> Result<Option<Self>> {
        let Some(wanted) = &job.analyses.uncertainty else { return Ok(None) };
        if let Some(e) = own {
            return Err(e
                .clone()
                .context("analyses.uncertainty: modes are followed from the job's own point, which failed"));
        }
        let missing = || Error::Defect("analyses.uncertainty without the stability of the job".into());
        let found = world.on_root(|| {
            let base = base.ok_or_else(missing)?;
            let (found, model) = (base.found.ok_or_else(missing)?, base.model.root()?);
            Ok((references(&found.spectrum.eigenpairs, &model.pair), model.pair.lower_modes))
        })?;
        let (all, lower) = found.unwrap_or_default();
        let numbers = all.iter().flat_map(|r| [r.value].into_iter().chain(r.modal.iter().copied()));
        let numbers = world.broadcast(numbers.flat_map(|z| [z.re, z.im]).collect::<Vec<f64>>());
        let sizes = world.broadcast(vec![all.len() as u64, lower as u64]);
        let [count, lower] = [0, 1].map(|k| sizes.get(k).map_or(0, |&n| n as usize));
        let references = match world.is_root() {
            true => all,
            false => numbers
                .chunks_exact((numbers.len() / count.max(1)).max(2))
                .map(|row| {
                    let mut values = row.chunks_exact(2).map(|z| C::new(z[0], z[1]));
                    let value = values.next().unwrap_or_default();
                    Reference { value, modal: values.collect(), name: String::new() }
                })
                .collect(),
        };
        let bases = Bases::new(plan, wanted.follow);
        let counts = Counts::new(wanted.seed, plan.points.len());
        let (near, defers, memory) = (Cell::new(None), Cell::new(false), SpectrumMemory::default());
        Ok(Some(Self { wanted, references, lower, bases, counts, near, defers, memory }))
    }

    /// Inputs of the samples beside their jobs.
    pub(super) fn identity(&self) -> Vec<u8> {
        let all = self.references.iter().flat_map(|r| [r.value].into_iter().chain(r.modal.iter().copied()));
        let all = all.flat_map(|z| [z.re.to_le_bytes(), z.im.to_le_bytes()].concat());
        all.chain(self.bases.identity()).chain([u8::from(self.wanted.interpolate)]).collect()
    }

    /// Frees the base points of models that are no longer needed.
    pub(super) fn forget(&self) {
        self.bases.forget();
        self.counts.forget();
    }

    /// Returns whether a point among the `members` of a model is solved before the others: those at which unstable
    /// eigenvalues are counted in any case.
    pub(super) fn is_first(&self, members: &[usize], i: usize, placed: bool) -> bool {
        let bases = self.bases.numbers(members, placed);
        bases.len() == 1 || bases.contains(&i) || self.counts.is_chosen(i)
    }

    /// Keeps the points among the `members` of a model at which unstable eigenvalues were `counted`.
    pub(super) fn learn(&self, members: &[usize], counted: Vec<Counted>) {
        members.iter().take(1).for_each(|first| self.counts.learn(*first, counted.clone()));
    }

    /// Leaves points that no base point leads to for later, or no longer.
    pub(super) fn defer(&self, defers: bool) {
        self.defers.set(defers);
    }

    /// Continues the points `strayed` among the `members` of a model, ascending, which no base point leads to, from
    /// some of them, if they are not too few.
    pub(super) fn stray(&self, members: &[usize], strayed: Vec<usize>) {
        if let (Some(first), Some(strayed)) = (members.first(), Strayed::new(strayed)) {
            self.bases.stray(*first, strayed);
        }
    }

    /// The point that a strayed point `i` among the `members` of a model is continued from.
    pub(super) fn stray_base(&self, members: &[usize], i: usize) -> usize {
        let strayed = members.first().and_then(|first| self.bases.strayed(*first, i));
        strayed.map_or(i, |s| self.bases.nearest(&s.numbers, i))
    }

    /// Counts unstable eigenvalues at all points, or no longer.
    pub(super) fn count_all(&self, all: bool) {
        self.counts.set_all(all);
    }

    /// Returns whether bodies are interpolated over their profiles.
    pub(super) fn interpolates(&self) -> bool {
        self.wanted.interpolate
    }

    /// The whole search for the eigenvalues of a point, from what was remembered last.
    fn search(&self) -> impl FnMut(&job::Stability, &CoupledModel, &LinearContact) -> Result<Spectrum> + '_ {
        |stability, pair, contact| spectrum(stability, pair, contact, &self.memory)
    }

    /// Growth rates of the modes that are followed at a point, by a whole search from nothing.
    pub(super) fn growth_rates(&self, mut model: StudyModel, point: &Job) -> Result<Vec<FollowedRate>> {
        self.memory.restore(&LastSpectrum::default());
        model.renew();
        let lower = model.lower_modes();
        let (_, found, _) = model.solved(point, None, &mut self.search())?;
        let rate = |f: &Followed| Some(FollowedRate { mode: f.mode?, rate: f.value.re, agreement: f.agreement });
        Ok(self.followed(&found, lower).iter().filter_map(rate).collect())
    }

    /// The modes that are followed among those of a sample on `lower` free modes of the lower body, each by the motion
    /// nearest to it in shape; and what grows beside them.
    fn followed(&self, found: &StabilityResult, lower: usize) -> Vec<Followed> {
        let motions: Vec<&Eigenpair> = found.spectrum.eigenpairs.iter().filter(|e| oscillates(e)).collect();
        let mut alike: Vec<(f64, usize, usize)> = Vec::new();
        let mut best = vec![0.0f64; motions.len()];
        for (k, motion) in motions.iter().enumerate() {
            let norm = motion.modal.iter().map(C::norm_sqr).sum::<f64>().sqrt();
            for (r, reference) in self.references.iter().enumerate() {
                let apart = (motion.value.im - reference.value.im).abs();
                if apart > NEAR * reference.value.im || norm == 0.0 {
                    continue;
                }
                let mac = product(&reference.modal, self.lower, &motion.modal, lower).norm_sqr() / (norm * norm);
                best[k] = best[k].max(mac);
                if mac >= ALIKE {
                    alike.push((mac, r, k));
                }
            }
        }
        alike.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let (mut of, mut taken) = (vec![None; self.references.len()], vec![false; motions.len()]);
        for (mac, r, k) in alike {
            if of[r].is_none() && !taken[k] {
                of[r] = Some((mac, k));
                taken[k] = true;
            }
        }
        let known = of.iter().enumerate().filter_map(|(r, found)| {
            let (agreement, k) = (*found)?;
            Some(Followed { mode: Some(r), value: motions[k].value, agreement })
        });
        let mut all: Vec<Followed> = known.collect();
        let grown = found.spectrum.eigenpairs.iter().filter(|e| grows(e.value, e.backward_error));
        for e in grown {
            match motions.iter().position(|m| std::ptr::eq(*m, e)) {
                Some(k) if taken[k] => {}
                place => {
                    let agreement = place.map_or(0.0, |k| best[k]);
                    all.push(Followed { mode: None, value: e.value, agreement });
                }
            }
        }
        all
    }

    /// On rank 0: the tables, and what the summary says.
    pub(super) fn report(
        &self,
        plan: &SweepPlan,
        all: &[Outcome],
        models: usize,
        summary: &mut Summary,
    ) -> Result<Vec<Table>> {
        let report = self.evaluated(plan, all);
        say(&report, (plan, all), models, self.wanted, summary);
        near_in_words(self.near.get(), self.references.len(), summary);
        Ok(tables(plan, all, &report))
    }

    /// Statistics of the samples.
    fn evaluated(&self, plan: &SweepPlan, all: &[Outcome]) -> Report {
        let wanted = self.wanted;
        let (each, random) = (wanted.points_per_sample(), wanted.random_per_sample());
        let (replicates, confidence) = (wanted.replicates(), wanted.confidence);
        let samples: Vec<usize> = (0..all.len()).filter(|i| i % each < random).collect();
        let chance = |of: &dyn Fn(&Outcome) -> bool| {
            let hits: Vec<Option<bool>> = samples.iter().map(|&i| (all[i].status == 0).then(|| of(&all[i]))).collect();
            let (share, interval, method) = share(&hits, replicates, confidence);
            (share, interval, method)
        };
        let quantiles = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            LEVELS.map(|p| quantile(&values, p))
        };
        let (any, any_interval, method) = chance(&|o| o.unstable() > 0);
        let unstable =
            |o: &Outcome, r: usize| o.followed.iter().any(|f| f.mode == Some(r) && grows(f.value, o.backward_error));
        let mut modes: Vec<ModeOf> = Vec::new();
        for (r, reference) in self.references.iter().enumerate() {
            let (probability, interval, method) = chance(&|o| unstable(o, r));
            let at = |i: usize| all[i].followed.iter().find(|f| f.mode == Some(r));
            let found: Vec<&Followed> = samples.iter().filter_map(|&i| at(i)).collect();
            modes.push(ModeOf {
                name: reference.name.clone(),
                own: reference.value,
                probability,
                interval,
                method,
                found: found.len() as f64 / samples.len() as f64,
                agreement: found.iter().map(|f| f.agreement).fold(f64::NAN, f64::min),
                quantiles: quantiles(found.iter().map(|f| f.value.re).collect()),
                values: (0..all.len()).map(|i| at(i).map(|f| f.value)).collect(),
            });
        }
        let own = |m: &ModeOf| m.own.re;
        modes.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(own(b).total_cmp(&own(a))));
        let told = modes.iter().filter(|m| m.probability > 0.0).count().max(TOLD).min(modes.len());
        modes.truncate(told);
        let (other, other_interval, _) = chance(&|o| o.followed.iter().any(|f| f.mode.is_none()));
        let growth = |o: &Outcome| o.eigenvalues.first().map_or(f64::NAN, |l| l.re);
        let rows: Vec<Vec<f64>> = match wanted.wants_indices() {
            false => Vec::new(),
            true => all
                .chunks(each)
                .map(|row| row.iter().map(|o| if o.status == 0 { growth(o) } else { f64::NAN }).collect())
                .filter(|row: &Vec<f64>| row.iter().all(|f| f.is_finite()))
                .collect(),
        };
        let computed = samples.iter().filter(|&&i| all[i].status == 0);
        Report {
            keys: plan.keys.clone(),
            parts: (0..all.len()).map(|i| i % each).collect(),
            samples: samples.len(),
            failed: samples.iter().filter(|&&i| all[i].status != 0).count(),
            probability: any,
            interval: any_interval,
            method,
            other,
            other_interval,
            confidence,
            levels: LEVELS.to_vec(),
            quantiles: quantiles(computed.map(|&i| growth(&all[i])).collect()),
            modes,
            indices: indices(&rows, confidence, wanted.seed).unwrap_or_default(),
            index_rows: rows.len(),
        }
    }
}

impl Survey {
    /// The outcome of a point with the modes that are continued or grow; the rest of some hundred eigenvalues is no
    /// longer needed.
    fn reduced(&self, mut outcome: Outcome) -> Outcome {
        outcome.eigenvalues.truncate(outcome.unstable().max(1));
        let error = outcome.backward_error;
        outcome.followed.retain(|f| f.mode.is_none_or(|r| self.has(r)) || grows(f.value, error));
        outcome
    }
}

/// True if a motion oscillates, with Im λ > 0.
fn oscillates(e: &Eigenpair) -> bool {
    e.value.im > 1e-6 * e.value.norm() && !is_rigid(e.value)
}

/// The least damped of the `pairs` that oscillate, of bodies with the modes of `model`.
fn references(pairs: &[Eigenpair], model: &CoupledModel) -> Vec<Reference> {
    let mut all: Vec<&Eigenpair> = pairs.iter().filter(|e| oscillates(e)).collect();
    all.sort_by(|a, b| a.damping_ratio().total_cmp(&b.damping_ratio()));
    let reference = |e: &Eigenpair| {
        let norm = e.modal.iter().map(C::norm_sqr).sum::<f64>().sqrt();
        let parts = shares(&model.omega, &e.modal, e.value);
        let largest = (0..parts.len()).max_by(|&a, &b| parts[a].total_cmp(&parts[b]));
        let of = largest.map_or(String::new(), |k| format!(", {}", mode_name(model, k)));
        Reference {
            value: e.value,
            modal: e.modal.iter().map(|q| q / norm.max(f64::MIN_POSITIVE)).collect(),
            name: format!("{:.0} Hz{of}", e.frequency()),
        }
    };
    all.into_iter().take(FOLLOWED).map(reference).collect()
}

/// aᴴb of the amplitudes of free modes, those of the lower body first, where both bodies may have fewer modes in one
/// of them: mass-normalised modes of the same bodies, of which the lowest ones are the same.
fn product(a: &[C], a_lower: usize, b: &[C], b_lower: usize) -> C {
    let part = |a: &[C], b: &[C]| a.iter().zip(b).map(|(a, b)| a.conj() * b).sum::<C>();
    let ((a1, a2), (b1, b2)) = (a.split_at(a_lower.min(a.len())), b.split_at(b_lower.min(b.len())));
    part(a1, b1) + part(a2, b2)
}

mod continuation;
mod loudness;
mod summary;
use summary::{near_in_words, say};

#[cfg(test)]
mod tests;
