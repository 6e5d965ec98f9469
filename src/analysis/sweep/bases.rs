//! Base points of a study: a few points of each model whose eigenvalues are searched for as a whole, and from which the
//! others begin; and what of their eigenvalues is continued.
//!
//! Which they are follows from the plan alone, so that the result of a point depends neither on the ranks nor on what
//! was computed before.

use super::near_axis::{BaseEigenvalue, BaseMotions, FitInputs, NearAxis};
use crate::contact::SteadySolution;
use crate::job::SweepPlan;
use crate::output::datasets::sweep::{Followed, Outcome};
use crate::stability::nonlinear_eigen::{KnownSpectrum, LastSpectrum};
use crate::{Error, Result};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

/// Points of a model to each of its base points, and base points of a model at the most.
const EACH: usize = 32;
const MOST: usize = 16;
/// Base points at the most where points differ in their places as well.
const MOST_PLACED: usize = 48;

/// One in so many points that went astray is searched for as a whole, so that others begin from it; and the most such.
const STRAYED_EACH: usize = 4;
const MOST_STRAYED: usize = 48;

/// A base point as this rank has computed it.
pub(super) struct BasePoint {
    pub outcome: Result<Outcome>,
    /// State of the search for eigenvalues.
    pub state: LastSpectrum,
    /// Its eigenvalues that oscillate.
    pub candidates: Vec<BaseEigenvalue>,
    /// Eigenvalues that those of other points are continued from: those near the axis, and more of them where these go
    /// astray; none where all are to be searched for.
    pub known: Vec<KnownSpectrum>,
    /// Steady rolling that those of other points begin with.
    pub rolling: Option<SteadySolution>,
}

impl BasePoint {
    /// A base point that could not be computed.
    pub fn failed(error: Error) -> Self {
        Self {
            outcome: Err(error),
            state: LastSpectrum::default(),
            candidates: Vec::new(),
            known: Vec::new(),
            rolling: None,
        }
    }

    /// Chooses the eigenvalues that those of other points are continued from, by the modes that are `near` the axis.
    pub fn continue_from(&mut self, near: Option<&NearAxis>) {
        let wanted = |is: &dyn Fn(&BaseEigenvalue) -> bool| -> Vec<_> {
            self.candidates.iter().filter(|c| is(c)).map(|c| c.value).collect()
        };
        let few = near.map(|near| wanted(&|c| near.wants(c)));
        let many = wanted(&|c| c.is_little_damped || !c.may_be.is_empty());
        let sets = few.into_iter().chain([many]);
        self.known = sets.filter_map(|wanted| KnownSpectrum::of_state(&self.state, &wanted)).collect();
        self.candidates = Vec::new();
    }

    /// Motions found there, before it is chosen which of them are continued.
    fn found(&self) -> BaseMotions<'_> {
        BaseMotions { followed: self.followed(), candidates: &self.candidates }
    }

    /// Modes that are followed there.
    pub fn followed(&self) -> &[Followed] {
        self.outcome.as_ref().map_or(&[], |o| &o.followed)
    }
}

/// The base points of a model.
pub(super) struct Survey {
    /// Each with its number, ascending.
    bases: Vec<(usize, BasePoint)>,
    /// Modes that are continued; none where all are.
    pub near: Option<NearAxis>,
}

impl Survey {
    /// Chooses what is continued from the base points `computed`, which lack it, to the `members` of the model; `told`
    /// are modes that are continued in any case.
    pub fn new(computed: Vec<(usize, BasePoint)>, all: &Bases, members: &[usize], told: &[usize]) -> Self {
        let mut bases = computed;
        let (numbers, known): (Vec<usize>, Vec<BaseMotions>) =
            bases.iter().filter(|b| b.1.outcome.is_ok()).map(|b| (b.0, b.1.found())).unzip();
        let rows = |of: &[usize]| of.iter().map(|&i| &all.scaled[i][..]).collect();
        let inputs = FitInputs { bases: rows(&numbers), samples: rows(members) };
        let near = if all.continues { NearAxis::new(&known, told, &inputs) } else { None };
        bases.iter_mut().filter(|_| all.continues).for_each(|(_, base)| base.continue_from(near.as_ref()));
        Self { bases, near }
    }

    /// First base point.
    pub fn first(&self) -> Option<&BasePoint> {
        self.bases.first().map(|b| &b.1)
    }

    /// The base point with this number.
    pub fn get(&self, number: usize) -> Option<&BasePoint> {
        self.bases.iter().find(|b| b.0 == number).map(|b| &b.1)
    }

    /// True if a mode is continued.
    pub fn has(&self, mode: usize) -> bool {
        self.near.as_ref().is_none_or(|near| near.has(mode))
    }
}

/// Points of a model that no base point leads to, and those among them that the others are continued from.
pub(super) struct Strayed {
    /// Numbers of all of them, ascending.
    all: Vec<usize>,
    /// Numbers of those that others begin from.
    pub numbers: Vec<usize>,
    /// Base points that this rank has computed.
    computed: RefCell<HashMap<usize, Rc<BasePoint>>>,
}

impl Strayed {
    /// Points `all`, ascending; none where they are too few to begin from some of them.
    pub fn new(all: Vec<usize>) -> Option<Self> {
        let step = all.len().div_ceil(MOST_STRAYED).max(STRAYED_EACH);
        let numbers: Vec<usize> = all.iter().copied().step_by(step).collect();
        (all.len() > STRAYED_EACH).then(|| Self { all, numbers, computed: RefCell::default() })
    }

    /// True if a point is one of them.
    pub fn has(&self, i: usize) -> bool {
        self.all.binary_search(&i).is_ok()
    }

    /// The point `number`, from which others begin; `compute` is asked for it once.
    pub fn base(&self, number: usize, compute: impl FnOnce() -> Result<BasePoint>) -> Result<Rc<BasePoint>> {
        if let Some(known) = self.computed.borrow().get(&number) {
            return Ok(known.clone());
        }
        let made = Rc::new(compute()?);
        self.computed.borrow_mut().insert(number, made.clone());
        Ok(made)
    }
}

/// The base points of all models.
pub(super) struct Bases {
    /// True if eigenvalues are continued.
    continues: bool,
    /// Values of the inputs over their deviations, `[points][inputs]`.
    scaled: Vec<Vec<f64>>,
    /// By the first point of each model.
    surveys: RefCell<HashMap<usize, Rc<Survey>>>,
    /// By the first point of each model.
    strayed: RefCell<HashMap<usize, Rc<Strayed>>>,
}

impl Bases {
    /// Base points of `plan`; one of each model where nothing is continued.
    pub fn new(plan: &SweepPlan, continues: bool) -> Self {
        let mut scaled = vec![Vec::with_capacity(plan.keys.len()); plan.points.len()];
        for values in &plan.values {
            let values: Vec<f64> = values.iter().map(|v| v.as_f64().unwrap_or(0.0)).collect();
            let count = values.len().max(1) as f64;
            let mean = values.iter().sum::<f64>() / count;
            let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
            let unit = if deviation > 0.0 { deviation } else { 1.0 };
            scaled.iter_mut().zip(&values).for_each(|(row, v)| row.push((v - mean) / unit));
        }
        Self { continues, scaled, surveys: RefCell::default(), strayed: RefCell::default() }
    }

    /// True if eigenvalues are continued.
    pub fn continues(&self) -> bool {
        self.continues
    }

    /// FitInputs that the results of all points depend on.
    pub fn identity(&self) -> Vec<u8> {
        let values = self.scaled.iter().flatten().flat_map(|v| v.to_le_bytes());
        values.chain([u8::from(self.continues)]).collect()
    }

    /// Base points of the `members` of a model, or of bodies that differ in where they are touched (`placed`): some
    /// that are spread evenly over them.
    pub fn numbers(&self, members: &[usize], placed: bool) -> Vec<usize> {
        let most = if placed { MOST_PLACED } else { MOST };
        let count = if self.continues { (members.len() / EACH).clamp(1, most) } else { 1 };
        let mut all: Vec<usize> = (0..count).filter_map(|k| members.get(k * members.len() / count).copied()).collect();
        all.dedup();
        all
    }

    /// Square of the distance of two points, by their inputs over their deviations.
    pub fn distance(&self, a: usize, b: usize) -> f64 {
        self.scaled[a].iter().zip(&self.scaled[b]).map(|(a, b)| (a - b).powi(2)).sum()
    }

    /// The nearest to the point `i` of the base points `numbers`.
    pub fn nearest(&self, numbers: &[usize], i: usize) -> usize {
        let far = |b: &usize| self.distance(*b, i);
        numbers.iter().copied().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(i)
    }

    /// Frees the base points of models that are no longer needed.
    pub fn forget(&self) {
        self.surveys.borrow_mut().clear();
        self.strayed.borrow_mut().clear();
    }

    /// Keeps the points of the model of the point `first` that no base point leads to.
    pub fn stray(&self, first: usize, strayed: Strayed) {
        self.strayed.borrow_mut().insert(first, Rc::new(strayed));
    }

    /// Points of the model of the point `first` that went astray, if the point `i` is one of them.
    pub fn strayed(&self, first: usize, i: usize) -> Option<Rc<Strayed>> {
        self.strayed.borrow().get(&first).filter(|s| s.has(i)).cloned()
    }

    /// The base points of the model of the point `first`; `compute` is asked for them once.
    pub fn survey(&self, first: usize, compute: impl FnOnce() -> Result<Survey>) -> Result<Rc<Survey>> {
        if let Some(known) = self.surveys.borrow().get(&first) {
            return Ok(known.clone());
        }
        let made = Rc::new(compute()?);
        self.surveys.borrow_mut().insert(first, made.clone());
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points that no base point leads to begin from every so-manieth of them, where they are more than a few.
    #[test]
    fn strayed_points_begin_from_some_of_them() {
        assert!(Strayed::new(vec![3, 5, 8, 9]).is_none());
        let few = Strayed::new(vec![3, 5, 8, 9, 11]).unwrap();
        assert_eq!(few.numbers, [3, 11]);
        assert!(few.has(8) && !few.has(10));
        let many = Strayed::new((0..2000).map(|i| 3 * i).collect()).unwrap();
        assert!((40..=48).contains(&many.numbers.len()));
    }

    /// Points begin from the nearest base point, whichever rank asks; a few points have one.
    #[test]
    fn points_begin_from_the_nearest_base_point() {
        let scaled = (0..80).map(|i| vec![f64::from(i), 1.0]).collect();
        let bases = Bases { continues: true, scaled, surveys: RefCell::default(), strayed: RefCell::default() };
        let members: Vec<usize> = (0..80).collect();
        let nearest = |of: &Bases, members: &[usize], i: usize| of.nearest(&of.numbers(members, false), i);
        let of: Vec<usize> = [0, 19, 21, 40, 79].iter().map(|&i| nearest(&bases, &members, i)).collect();
        assert_eq!(of, [0, 0, 40, 40, 40]);
        assert_eq!(nearest(&bases, &members[30..50], 45), 30);
        let whole = Bases { continues: false, ..bases };
        assert_eq!(nearest(&whole, &members, 79), 0);
    }
}
