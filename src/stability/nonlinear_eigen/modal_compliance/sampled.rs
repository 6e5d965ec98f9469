//! The compliance G of the modes over λ: sums over their poles.

use super::{ModalCompliance, ModeSet, C};
use faer::Mat;
use std::cell::RefCell;
use std::rc::Rc;

/// Frequencies that are looked at together: what is made for them stays near the processor.
const CHUNK: usize = 32;

/// G of a body, chunk by chunk, as soon as it was made.
type KeptCompliance = RefCell<Vec<Mat<f64>>>;

/// Values of λ at which G is asked for again and again: that of a body that stays as it is is kept.
pub(in super::super) struct SampledCompliance {
    pub values: Vec<C>,
    /// Bodies whose G is kept.
    kept: Vec<(Rc<ModeSet>, KeptCompliance)>,
}

impl SampledCompliance {
    /// The `values` with the bodies of some `modes`.
    pub fn new(values: Vec<C>, modes: &ModalCompliance) -> Self {
        Self { values, kept: modes.parts.iter().map(|part| (part.clone(), RefCell::default())).collect() }
    }
}

impl std::fmt::Debug for SampledCompliance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SampledCompliance").field("values", &self.values.len()).finish()
    }
}

impl ModalCompliance {
    /// G at each of `values`, by columns, one after the other, `[r²]` each.
    pub fn compliance(&self, values: &[C]) -> Vec<C> {
        let ([g], _) = self.with_derivatives(values);
        g
    }

    /// G and dG/dλ at each of `values`, by columns, one after the other, `[r²]` each; and the logarithmic derivative
    /// of P.
    pub fn compliances(&self, values: &[C]) -> ([Vec<C>; 2], Vec<C>) {
        self.with_derivatives(values)
    }

    /// G as [`compliance`](Self::compliance) has it.
    pub fn compliance_at(&self, of: &SampledCompliance) -> Vec<C> {
        let r2 = self.rank * self.rank;
        let mut all = vec![C::default(); r2 * of.values.len()];
        for part in &self.parts {
            let made = || of.values.chunks(CHUNK).map(|some| part.compliance::<1>(some).0).collect::<Vec<_>>();
            let known = of.kept.iter().find(|k| Rc::ptr_eq(&k.0, part));
            if let Some((_, kept)) = known.filter(|k| k.1.borrow().is_empty()) {
                kept.replace(made());
            }
            let add = |products: &[Mat<f64>], all: &mut [C]| {
                for (product, out) in products.iter().zip(all.chunks_mut(CHUNK * r2)) {
                    out.chunks_exact_mut(r2).enumerate().for_each(|(l, out)| self.add(part, (product, 2 * l), out));
                }
            };
            match known {
                Some((_, kept)) => add(&kept.borrow(), &mut all),
                None => add(&made(), &mut all),
            }
        }
        all
    }

    /// G and its first derivatives, N in all; and the logarithmic derivative of P.
    fn with_derivatives<const N: usize>(&self, values: &[C]) -> ([Vec<C>; N], Vec<C>) {
        let r2 = self.rank * self.rank;
        let mut all = [const { Vec::new() }; N].map(|_: Vec<C>| vec![C::default(); r2 * values.len()]);
        let mut slopes = vec![C::default(); values.len()];
        for part in &self.parts {
            for (chunk, some) in values.chunks(CHUNK).enumerate() {
                let first = chunk * CHUNK;
                let (product, of) = part.compliance::<N>(some);
                slopes[first..first + some.len()].iter_mut().zip(of).for_each(|(a, b)| *a += b);
                for l in 0..some.len() {
                    for (d, out) in all.iter_mut().enumerate() {
                        let out = &mut out[(first + l) * r2..(first + l + 1) * r2];
                        self.add(part, (&product, 2 * (N * l + d)), out);
                    }
                }
            }
        }
        (all, slopes)
    }

    /// Adds G of a body, whose real and imaginary parts are two columns of `product`, to that of both, `[r²]`.
    fn add(&self, part: &ModeSet, (product, column): (&Mat<f64>, usize), out: &mut [C]) {
        let [re, im] = [0, 1].map(|k| product.col_as_slice(column + k));
        for j in 0..part.functions {
            let from = j * part.functions..(j + 1) * part.functions;
            let into = (part.first + j) * self.rank + part.first;
            let parts = re[from.clone()].iter().zip(&im[from]);
            out[into..].iter_mut().zip(parts).for_each(|(v, (re, im))| *v += C::new(*re, *im));
        }
    }
}
