//! Modes as the contact has them.

use faer::Mat;
use std::cell::RefCell;
use std::rc::Rc;

thread_local! {
    /// Modes at the contact rows; all states of the same bodies share them.
    static SHAPES: RefCell<Option<Rc<Mat<f64>>>> = const { RefCell::new(None) };
}

/// The modes at all contact rows by the functions of which they consist at some of them.
pub(super) struct OnContact {
    /// The modes, `[3n, modes]`.
    pub(super) shapes: Rc<Mat<f64>>,
    /// The functions, `[3n, r]`.
    pub(super) functions: Mat<f64>,
    /// Squares of the norms of the modes, and of what is left of them without the functions, of each body and row.
    pub(super) squares: [Vec<[f64; 2]>; 2],
}

impl OnContact {
    /// The modes `psi`, `[3n, modes]`, of which those of each body lie between two of `ends`, by functions with the
    /// amplitudes `basis`.
    pub(super) fn new(psi: &Mat<f64>, basis: &Mat<f64>, ends: [usize; 3]) -> Self {
        let kept = SHAPES.with_borrow(|last| last.clone().filter(|last| **last == *psi));
        let shapes = kept.unwrap_or_else(|| Rc::new(psi.clone()));
        SHAPES.set(Some(shapes.clone()));
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
        Self { shapes, functions, squares }
    }
}
