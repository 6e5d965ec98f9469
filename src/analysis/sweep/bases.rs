//! Base points of a study: a few points of each model that are computed from nothing, and from which the others begin.
//!
//! Which they are follows from the plan alone, so that the result of a point depends neither on the ranks nor on what
//! was computed before.

use crate::contact::SteadySolution;
use crate::job::SweepPlan;
use crate::output::datasets::sweep::Outcome;
use crate::stability::secular::{KnownSpectrum, State};
use crate::{Error, Result};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

/// Points of a model to each of its base points, and base points of a model at the most.
const EACH: usize = 32;
const MOST: usize = 16;
/// Base points at the most where points differ in their places as well.
const MOST_PLACED: usize = 48;

/// A base point as this rank has computed it.
pub(super) struct BasePoint {
    pub outcome: Result<Outcome>,
    /// State of the search for eigenvalues.
    pub state: State,
    /// Eigenvalues that those of other points are continued from; none where all are to be searched for.
    pub known: Option<KnownSpectrum>,
    /// Steady rolling that those of other points begin with.
    pub rolling: Option<SteadySolution>,
}

impl BasePoint {
    /// A base point that could not be computed.
    pub fn failed(error: Error) -> Self {
        Self { outcome: Err(error), state: State::present(), known: None, rolling: None }
    }
}

/// The base points of all models.
pub(super) struct Bases {
    /// True if eigenvalues are continued.
    continues: bool,
    /// Values of the inputs over their deviations, `[points][inputs]`.
    scaled: Vec<Vec<f64>>,
    computed: RefCell<HashMap<usize, Rc<BasePoint>>>,
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
        Self { continues, scaled, computed: RefCell::default() }
    }

    /// True if eigenvalues are continued.
    pub fn continues(&self) -> bool {
        self.continues
    }

    /// Inputs that the results of all points depend on.
    pub fn identity(&self) -> Vec<u8> {
        let values = self.scaled.iter().flatten().flat_map(|v| v.to_le_bytes());
        values.chain([u8::from(self.continues)]).collect()
    }

    /// Base point of the point `i` among the `members` of a model, or of bodies that differ in where they are touched
    /// (`placed`): the nearest of some that are spread evenly over them.
    pub fn nearest(&self, members: &[usize], i: usize, placed: bool) -> usize {
        let most = if placed { MOST_PLACED } else { MOST };
        let count = if self.continues { (members.len() / EACH).clamp(1, most) } else { 1 };
        let far = |b: usize| -> f64 { self.scaled[b].iter().zip(&self.scaled[i]).map(|(a, b)| (a - b).powi(2)).sum() };
        let bases = (0..count).filter_map(|k| members.get(k * members.len() / count).copied());
        bases.min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(i)
    }

    /// Frees the base points of models that are no longer needed.
    pub fn forget(&self) {
        self.computed.borrow_mut().clear();
    }

    /// The base point with this number; `compute` is asked for it once.
    pub fn get(&self, number: usize, compute: impl FnOnce() -> Result<BasePoint>) -> Result<Rc<BasePoint>> {
        if let Some(known) = self.computed.borrow().get(&number) {
            return Ok(known.clone());
        }
        let made = Rc::new(compute()?);
        self.computed.borrow_mut().insert(number, made.clone());
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points begin from the nearest base point, whichever rank asks; a few points have one.
    #[test]
    fn points_begin_from_the_nearest_base_point() {
        let scaled = (0..80).map(|i| vec![f64::from(i), 1.0]).collect();
        let bases = Bases { continues: true, scaled, computed: RefCell::default() };
        let members: Vec<usize> = (0..80).collect();
        let of: Vec<usize> = [0, 19, 21, 40, 79].iter().map(|&i| bases.nearest(&members, i, false)).collect();
        assert_eq!(of, [0, 0, 40, 40, 40]);
        assert_eq!(bases.nearest(&members[30..50], 45, false), 30);
        let whole = Bases { continues: false, ..bases };
        assert_eq!(whole.nearest(&members, 79, false), 0);
    }
}
