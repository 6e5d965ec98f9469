//! Points of a study: base points, whose eigenvalues are searched for as a whole, and those that are continued from
//! them.

use super::super::bases::{BasePoint, Strayed, Survey};
use super::super::near_axis::BaseEigenvalue;
use super::super::point_model::StudyModel;
use super::super::{goes_on, point_of};
use super::{oscillates, product, Reference, Study, C, NEAR, TOLD, UNLIKE};
use crate::case::stability_problem::StabilityResult;
use crate::job::Job;
use crate::output::datasets::sweep::{EigenvalueSearch, Followed, Outcome};
use crate::stability::nonlinear_eigen::{Count, KnownSpectrum, LastSpectrum};
use crate::stability::reduced::Eigenpair;
use crate::stability::{grows, track, Spectrum};
use crate::{Error, Result};

/// Result of a continuation from a base point.
enum Continuation {
    /// The outcome, which has what was done for it.
    Found(Outcome),
    /// The count was not certain, or unstable ones are missing; so many were continued.
    Refused(usize),
    /// The eigenvalues went astray.
    Lost,
}

impl Study<'_> {
    /// The point `i` among the `members` that share a `model`. Every one begins from a base point of these, so that it
    /// does not depend on which points this rank has computed before. None while points are deferred and this one
    /// cannot be continued from there.
    pub(in super::super) fn solve(
        &self,
        mut model: StudyModel,
        (points, members): (&[Option<Job>], &[usize]),
        i: usize,
    ) -> Result<Option<Outcome>> {
        let missing = || Error::Defect("a point of a study without a base point".into());
        let numbers = self.bases.numbers(members, matches!(model, StudyModel::Placed(_)));
        let first = *members.first().ok_or_else(missing)?;
        let survey = self.bases.survey(first, || self.survey(model.again(), (points, members), &numbers))?;
        if let Some(strayed) = self.bases.strayed(first, i) {
            return self.solve_strayed(model, points, (&survey, &strayed), i).map(Some);
        }
        let number = self.bases.nearest(&numbers, i);
        let base = survey.get(number).ok_or_else(missing)?;
        if number == i {
            return base.outcome.clone().map(|outcome| Some(survey.reduced(outcome)));
        }
        let point = point_of(points, i)?;
        let is_counted = |pairs: &[Eigenpair]| {
            let unstable = pairs.iter().filter(|e| grows(e.value, e.backward_error)).count();
            survey.near.is_none() || self.counts.wants((first, i), unstable, |a, b| self.bases.distance(a, b))
        };
        match self.continuation((model.again(), point), (&survey, base), &is_counted)? {
            Continuation::Found(outcome) => Ok(Some(outcome)),
            Continuation::Lost if self.defers.get() && !base.known.is_empty() => Ok(None),
            other => self.whole((model, point), (&survey, base), &other).map(Some),
        }
    }

    /// A point that no base point leads to, from the nearest of some of them.
    fn solve_strayed(
        &self,
        mut model: StudyModel,
        points: &[Option<Job>],
        (survey, strayed): (&Survey, &Strayed),
        i: usize,
    ) -> Result<Outcome> {
        let number = self.bases.nearest(&strayed.numbers, i);
        let base = strayed.base(number, || {
            let mut base = self.base_after(survey.first(), model.again(), (points, number))?;
            base.continue_from(survey.near.as_ref());
            Ok(base)
        })?;
        if number == i {
            let outcome = survey.reduced(base.outcome.clone()?);
            return Ok(Outcome { search: EigenvalueSearch::FellBack, ..outcome });
        }
        let point = point_of(points, i)?;
        match self.continuation((model.again(), point), (survey, &base), &|_| true)? {
            Continuation::Found(outcome) => {
                let search = match outcome.search {
                    EigenvalueSearch::Missed => EigenvalueSearch::Missed,
                    _ => EigenvalueSearch::Rebased,
                };
                Ok(Outcome { search, ..outcome })
            }
            other => {
                let outcome = self.whole((model, point), (survey, &base), &other)?;
                // That it went astray is kept where the base point has failed, too.
                let search = match outcome.search {
                    EigenvalueSearch::Whole => EigenvalueSearch::FellBack,
                    search => search,
                };
                Ok(Outcome { search, ..outcome })
            }
        }
    }

    /// A point by the eigenvalues of a base point.
    fn continuation(
        &self,
        (mut model, point): (StudyModel, &Job),
        (survey, base): (&Survey, &BasePoint),
        is_counted: &dyn Fn(&[Eigenpair]) -> bool,
    ) -> Result<Continuation> {
        let mut failed = Continuation::Lost;
        for known in &base.known {
            self.memory.restore(&base.state);
            let search = |outcome: &Outcome, search| match &failed {
                Continuation::Refused(n) if *n != outcome.unstable() => EigenvalueSearch::Missed,
                _ => search,
            };
            // What follows a refused count is counted.
            let was_refused = matches!(failed, Continuation::Refused(_));
            let counts = |pairs: &[Eigenpair]| was_refused || is_counted(pairs);
            failed = match self.continued((model.again(), point), (survey, base, known), &counts)? {
                None => failed,
                Some((outcome, Count::Complete)) => {
                    let search = search(&outcome, EigenvalueSearch::Continued);
                    return Ok(Continuation::Found(Outcome { search, ..outcome }));
                }
                Some((outcome, Count::NotAsked)) => {
                    let search = search(&outcome, EigenvalueSearch::Uncounted);
                    return Ok(Continuation::Found(Outcome { search, ..outcome }));
                }
                // With more of them where they are a count may be certain; the first one tells what was missing.
                Some((_, Count::Refused)) if was_refused => failed,
                Some((outcome, Count::Refused)) => Continuation::Refused(outcome.unstable()),
            };
        }
        Ok(failed)
    }

    /// A point whose eigenvalues are searched for as a whole, after a continuation that has failed.
    fn whole(
        &self,
        (mut model, point): (StudyModel, &Job),
        (survey, base): (&Survey, &BasePoint),
        failed: &Continuation,
    ) -> Result<Outcome> {
        self.memory.restore(&base.state);
        let lower = model.lower_modes();
        let (outcome, found, _) = model.solved(point, base.rolling.as_ref(), &mut self.search())?;
        let search = match failed {
            _ if base.known.is_empty() => EigenvalueSearch::Whole,
            Continuation::Refused(n) if survey.near.is_some() && *n != outcome.unstable() => EigenvalueSearch::Missed,
            _ => EigenvalueSearch::FellBack,
        };
        let outcome = survey.reduced(Outcome { followed: self.followed(&found, lower), ..outcome });
        Ok(Outcome { search, ..outcome })
    }

    /// The base points `numbers` of a model, the first one from nothing, the others from that one.
    fn survey(
        &self,
        mut model: StudyModel,
        (points, members): (&[Option<Job>], &[usize]),
        numbers: &[usize],
    ) -> Result<Survey> {
        let mut bases: Vec<(usize, BasePoint)> = Vec::new();
        for &number in numbers {
            let base = self.base_after(bases.first().map(|b| &b.1), model.again(), (points, number))?;
            bases.push((number, base));
        }
        let growth = |r: &usize| self.references[*r].value.re;
        let mut told: Vec<usize> = (0..self.references.len()).collect();
        told.sort_by(|a, b| growth(b).total_cmp(&growth(a)));
        told.truncate(TOLD);
        let survey = Survey::new(bases, &self.bases, members, &told);
        if let Some(near) = &survey.near {
            self.near.set(self.near.get().max(Some(near.modes.len())));
        }
        Ok(survey)
    }

    /// The base point `number`, whose search begins from the eigenvalues of the `first` one, or from nothing.
    fn base_after(
        &self,
        first: Option<&BasePoint>,
        mut model: StudyModel,
        (points, number): (&[Option<Job>], usize),
    ) -> Result<BasePoint> {
        self.memory.restore(&first.map_or_else(LastSpectrum::default, |first| first.state.clone()));
        model.renew();
        match point_of(points, number).and_then(|point| self.base(model, point)) {
            Err(e) if goes_on(&e) => Ok(BasePoint::failed(e)),
            found => found,
        }
    }

    /// A base point, whose eigenvalues are searched for as a whole.
    fn base(&self, mut model: StudyModel, point: &Job) -> Result<BasePoint> {
        let lower = model.lower_modes();
        let (outcome, found, rolling) = model.solved(point, None, &mut self.search())?;
        let followed = self.followed(&found, lower);
        let candidates = if self.bases.continues() { self.candidates(&found, &followed, lower) } else { Vec::new() };
        let outcome = Ok(Outcome { followed, ..outcome });
        Ok(BasePoint { outcome, state: self.memory.present(), candidates, known: Vec::new(), rolling })
    }

    /// A point whose eigenvalues are continued from those that are `known` of its base; none where they could not be.
    fn continued(
        &self,
        (mut model, point): (StudyModel, &Job),
        (survey, base, known): (&Survey, &BasePoint, &KnownSpectrum),
        is_counted: &dyn Fn(&[Eigenpair]) -> bool,
    ) -> Result<Option<(Outcome, Count)>> {
        let lower = model.lower_modes();
        let mut count = None;
        let (outcome, found, _) = model.solved(point, base.rolling.as_ref(), &mut |stability, pair, linear| {
            let found = track(stability, pair, linear, known, is_counted, &self.memory)?;
            count = found.as_ref().map(|f| f.1);
            Ok(found.map_or_else(Spectrum::default, |f| f.0))
        })?;
        let Some(count) = count else { return Ok(None) };
        let followed = self.followed(&found, lower);
        // A mode that the base point has is here as well, or it has gone to a motion that is not tracked.
        let has = |mode: Option<usize>| followed.iter().any(|f| f.mode == mode);
        let lost = |f: &Followed| f.mode.is_some_and(|r| survey.has(r)) && !has(f.mode);
        if base.followed().iter().any(lost) {
            return Ok(None);
        }
        Ok(Some((survey.reduced(Outcome { followed, ..outcome }), count)))
    }

    /// The eigenvalues of a base point that oscillate, with what is `followed` there.
    fn candidates(&self, found: &StabilityResult, followed: &[Followed], lower: usize) -> Vec<BaseEigenvalue> {
        let most = followed.iter().filter(|f| f.mode.is_some()).map(|f| -f.value.re / f.value.norm());
        let most = most.fold(0.0, f64::max);
        let candidate = |e: &Eigenpair| {
            let norm = e.modal.iter().map(C::norm_sqr).sum::<f64>().sqrt();
            let may_be = |r: &Reference| {
                let near = (e.value.im - r.value.im).abs() <= NEAR * r.value.im;
                near && product(&r.modal, self.lower, &e.modal, lower).norm() >= UNLIKE.sqrt() * norm
            };
            let may_be = (0..self.references.len()).filter(|r| may_be(&self.references[*r])).collect();
            BaseEigenvalue { value: e.value, may_be, is_little_damped: e.damping_ratio() <= most }
        };
        found.spectrum.eigenpairs.iter().filter(|e| oscillates(e)).map(candidate).collect()
    }
}
