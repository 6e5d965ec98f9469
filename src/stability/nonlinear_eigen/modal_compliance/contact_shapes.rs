//! Modes as the contact has them.

use super::super::SpectrumMemory;
use crate::model::CoupledModel;
use faer::Mat;
use std::rc::Rc;
use std::sync::Arc;

/// The modes at all contact rows by the functions of which they consist at some of them.
pub(super) struct ContactShapes {
    /// The modes, `[3n, modes]`.
    pub(super) shapes: Rc<Mat<f64>>,
    /// Mark of the models with these modes.
    mark: Option<Arc<()>>,
    /// The functions, `[3n, r]`.
    pub(super) functions: Mat<f64>,
    /// Squares of the norms of the modes, and of what is left of them without the functions, of each body and row.
    pub(super) squares: [Vec<[f64; 2]>; 2],
}

impl ContactShapes {
    /// The modes of `bodies` at the contact, of which those of each body lie between two of `ends`, by functions with
    /// the amplitudes `basis`.
    pub(super) fn new(bodies: &CoupledModel, basis: &Mat<f64>, ends: [usize; 3], memory: &SpectrumMemory) -> Self {
        let psi = &bodies.modes;
        let kept = memory.shapes.borrow().clone().filter(|last| **last == *psi);
        let shapes = kept.unwrap_or_else(|| Rc::new(psi.clone()));
        memory.shapes.replace(Some(shapes.clone()));
        let functions = psi * basis.transpose();
        let left = psi - &functions * basis;
        let squares = [0, 1].map(|body| {
            let mut squares = vec![[0.0; 2]; psi.nrows()];
            for j in ends[body]..ends[body + 1] {
                let both = psi.col_as_slice(j).iter().zip(left.col_as_slice(j));
                squares.iter_mut().zip(both).for_each(|(s, (p, l))| {
                    s[0] += p * p;
                    s[1] += l * l;
                });
            }
            squares
        });
        Self { shapes, mark: bodies.modes_mark.clone(), functions, squares }
    }

    /// Returns whether the modes of `bodies` are these at some contact rows.
    pub(super) fn is_of(&self, bodies: &CoupledModel, rows: &[usize]) -> bool {
        if let (Some(a), Some(b)) = (&self.mark, &bodies.modes_mark) {
            if Arc::ptr_eq(a, b) {
                return true;
            }
        }
        let same = |j: usize| {
            let (a, b) = (bodies.modes.col_as_slice(j), self.shapes.col_as_slice(j));
            rows.iter().all(|&row| a[row] == b[row])
        };
        self.shapes.shape() == bodies.modes.shape() && (0..self.shapes.ncols()).all(same)
    }
}
