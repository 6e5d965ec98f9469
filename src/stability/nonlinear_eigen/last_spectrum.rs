//! State between solutions: the last roots, as starts of the next ones.

use super::modal_compliance::ModalCompliance;
use super::{C, FAR, REAL, STRAIGHT};
use std::cell::RefCell;
use std::rc::Rc;

thread_local! {
    /// From one state to the next the roots are mostly near.
    pub(super) static LAST: RefCell<LastState> = RefCell::new(LastState::default());
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

/// The next state begins at `values`, which something else has found of the bodies of the last one.
pub(crate) fn begin_at(values: impl Iterator<Item = C>) {
    if let Some(modes) = ModalCompliance::last() {
        let near = |v: &C| v.im > REAL * v.norm() && v.im.atan2(v.re) <= modes.within();
        LAST.set(LastState {
            poles: modes.poles.clone(),
            roots: values.filter(near).collect(),
            ..LastState::default()
        });
    }
}

/// Last state that this rank knows.
#[derive(Clone, Default)]
pub struct LastSpectrum {
    last: LastState,
    modes: Option<Rc<ModalCompliance>>,
}

impl LastSpectrum {
    /// State that is known now.
    pub fn present() -> Self {
        Self { last: LAST.with_borrow(LastState::clone), modes: ModalCompliance::last() }
    }

    /// Roots and contact of the last solution.
    pub(super) fn last(&self) -> &LastState {
        &self.last
    }

    /// Modal sums of the last solution.
    pub(super) fn modes(&self) -> Option<&ModalCompliance> {
        self.modes.as_deref()
    }

    /// The next state begins from here, whichever was computed last: what is found then depends on this one alone, to
    /// the last bit.
    pub(crate) fn restore(&self) {
        LAST.set(self.last.clone());
        ModalCompliance::know(self.modes.clone());
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
