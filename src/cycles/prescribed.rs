//! A motion behind the contact that is given by its harmonics.

use crate::transient::{Dynamics, Model};
use crate::Result;
use faer::Mat;
use std::cell::RefCell;
use std::rc::Rc;

/// Samples of a periodic motion, `[N][r]`, and the one that the next step ends at.
#[derive(Debug, Default)]
pub(super) struct PrescribedMotion {
    pub(super) samples: Vec<Vec<f64>>,
    pub(super) next: usize,
    /// By how much the last of the r goes on in a step besides, and how far it has gone.
    pub(super) drift: f64,
    pub(super) gone: f64,
}

/// The motion of a [`PrescribedMotion`], which another owner changes between marches.
pub(super) struct Prescribed(pub(super) Rc<RefCell<PrescribedMotion>>);

impl Dynamics for Prescribed {
    fn operator(&self, model: &Model<'_>) -> Mat<f64> {
        model.residual.to_owned()
    }

    fn free(&mut self, q: &[f64], _v: &[f64], _f: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
        let mut course = self.0.borrow_mut();
        let count = course.samples.len().max(1);
        let mut end = course.samples.get(course.next).cloned().unwrap_or_else(|| q.to_vec());
        course.next = (course.next + 1) % count;
        course.gone += course.drift;
        if let Some(last) = end.last_mut() {
            *last += course.gone;
        }
        // The residual compliance has no velocity: only displacements are asked for.
        Ok((end, vec![0.0; q.len()]))
    }

    fn lag(&self, _f: &[f64]) -> Option<Vec<f64>> {
        None
    }

    fn add(&self, _f: &[f64], _q: &mut [f64], _v: &mut [f64]) {}

    fn gamma(&self) -> f64 {
        0.5
    }

    fn kinetic(&self, _v: &[f64]) -> f64 {
        0.0
    }

    fn elastic(&self, _q: &[f64]) -> f64 {
        0.0
    }

    fn damped(&self, _before: (&[f64], &[f64]), _after: (&[f64], &[f64])) -> (f64, f64) {
        (0.0, 0.0)
    }
}
