//! Memory of a search for eigenvalues of the states before: their roots as starts, and what was made of the bodies.

use super::modal_compliance::{ModalCompliance, ModePoles};
use super::{C, FAR, REAL, STRAIGHT};
use faer::Mat;
use std::cell::RefCell;
use std::rc::Rc;

/// Memory of a sequence of states, as the points of a sweep are: from one to the next the roots are mostly near, and
/// the bodies the same. An empty one begins from nothing; what is found depends on the memory to the last bit, but not
/// beyond the tolerance of the search.
#[derive(Default)]
pub struct SpectrumMemory {
    last: RefCell<LastState>,
    /// Modal sums of the last state.
    modes: RefCell<Option<Rc<ModalCompliance>>>,
    /// Poles of groups of coupled modes, the last ones used first.
    pub(super) poles: RefCell<Vec<Rc<ModePoles>>>,
    /// Modes at the contact rows; all states of the same bodies share them.
    pub(super) shapes: RefCell<Option<Rc<Mat<f64>>>>,
}

/// Data of the last state.
#[derive(Clone, Default)]
pub(super) struct LastState {
    pub(super) poles: Vec<C>,
    pub(super) roots: Vec<C>,
    /// Their positions a state earlier.
    pub(super) before: Vec<C>,
    /// K at some frequencies.
    pub(super) contact: Vec<C>,
    /// How it had changed.
    pub(super) change: Vec<C>,
    /// Relaxations of the contact that are as little damped as what is listed.
    pub(super) relaxations: Vec<C>,
}

/// State of a memory that others begin from.
#[derive(Clone, Default)]
pub struct LastSpectrum {
    last: LastState,
    modes: Option<Rc<ModalCompliance>>,
}

impl LastSpectrum {
    /// Roots and contact of the last solution.
    pub(super) fn last(&self) -> &LastState {
        &self.last
    }

    /// Modal sums of the last solution.
    pub(super) fn modes(&self) -> Option<&ModalCompliance> {
        self.modes.as_deref()
    }
}

impl SpectrumMemory {
    /// State that is known now.
    pub fn present(&self) -> LastSpectrum {
        LastSpectrum { last: self.last(), modes: self.modes() }
    }

    /// The next state begins from `state`, whichever was computed last: what is found then depends on this one alone,
    /// to the last bit.
    pub fn restore(&self, state: &LastSpectrum) {
        self.remember(state.last.clone());
        self.know(state.modes.clone());
    }

    /// The next state begins at `values`, which something else has found of the bodies of the last one.
    pub(crate) fn begin_at(&self, values: impl Iterator<Item = C>) {
        if let Some(modes) = self.modes() {
            let near = |v: &C| v.im > REAL * v.norm() && v.im.atan2(v.re) <= modes.within();
            self.remember(LastState {
                poles: modes.poles.clone(),
                roots: values.filter(near).collect(),
                ..LastState::default()
            });
        }
    }

    /// Roots and contact of the last solution.
    pub(super) fn last(&self) -> LastState {
        self.last.borrow().clone()
    }

    /// Takes `last` for the last solution.
    pub(super) fn remember(&self, last: LastState) {
        self.last.replace(last);
    }

    /// Modal sums of the last state.
    pub(super) fn modes(&self) -> Option<Rc<ModalCompliance>> {
        self.modes.borrow().clone()
    }

    /// Takes `modes` for those of the last state.
    pub(super) fn know(&self, modes: Option<Rc<ModalCompliance>>) {
        self.modes.replace(modes);
    }
}

impl LastState {
    /// Returns whether these poles are those of the last state, or near them one by one.
    pub(super) fn is_near(&self, poles: &[C]) -> bool {
        let near = |(a, b): (&C, &C)| (a - b).norm() <= FAR * b.norm();
        !self.roots.is_empty() && self.poles.len() == poles.len() && self.poles.iter().zip(poles).all(near)
    }

    /// Expected positions of the roots when the contact is `now`: on their way, if the contact goes on as it went.
    pub(super) fn predicted(&self, now: &[C]) -> Vec<C> {
        if self.before.is_empty() || self.change.len() != now.len() {
            return self.roots.clone();
        }
        let change: Vec<C> = now.iter().zip(&self.contact).map(|(a, b)| a - b).collect();
        let square = |v: &[C]| v.iter().map(C::norm_sqr).sum::<f64>();
        let product: C = change.iter().zip(&self.change).map(|(a, b)| a * b.conj()).sum();
        let times = product.re / square(&self.change);
        let aside: Vec<C> = change.iter().zip(&self.change).map(|(a, b)| a - b * times).collect();
        if !(square(&aside) <= STRAIGHT[0].powi(2) * square(&change) && times.abs() <= STRAIGHT[1]) {
            return self.roots.clone();
        }
        let ahead = |(v, before): (&C, &C)| v + (v - before) * times;
        let within = |(v, to): (&C, C)| if (to - v).norm() <= FAR * v.norm() && to.im > 0.0 { to } else { *v };
        let all = self.roots.iter().zip(&self.before);
        self.roots.iter().zip(all.map(ahead)).map(within).collect()
    }
}
