//! The unknowns of the contact as they follow what moves it, at one frequency after the other.
//!
//! With a real shift σ, (λA + C)⁻¹ = (1 + (λ − σ) M)⁻¹ (σA + C)⁻¹, M = (σA + C)⁻¹ A = Q H Qᵀ: of the matrix H, which
//! is triangular but for one more diagonal, a frequency asks for n² operations.

use super::modal::real_times;
use super::{ContactRows, C};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::hessenberg::{hessenberg_in_place, hessenberg_in_place_scratch, HessenbergParams};
use faer::linalg::householder::{
    apply_block_householder_sequence_on_the_right_in_place_scratch,
    apply_block_householder_sequence_on_the_right_in_place_with_conj,
};
use faer::linalg::solvers::Solve;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Auto, Conj, Mat, MatRef, Par, Spec};

/// Reflections that are applied at once.
const BLOCK: usize = 16;

/// f of y at any λ.
pub(super) struct Following {
    /// σ, 1/s.
    shift: f64,
    /// H, `[nf, nf]`.
    reduced: Mat<f64>,
    /// Q, `[nf, nf]`.
    basis: Mat<f64>,
    /// −Qᵀ (σA + C)⁻¹ of what y adds to the rows by its rate and at rest, `[nf, r]` each.
    driven: [Mat<f64>; 2],
}

impl Following {
    /// Tracker of rows of one size; frequencies are of the order of `rate`.
    pub fn new(rows: &ContactRows, seen: usize, rate: f64) -> Self {
        let nf = rows.by_rate.nrows();
        let own = |of: &Mat<f64>| of.as_ref().subcols(seen, nf).to_owned();
        let by = |of: &Mat<f64>| of.as_ref().subcols(0, seen).to_owned();
        let (by_rate, at_rest) = (own(&rows.by_rate), own(&rows.at_rest));
        let lu = (faer::Scale(rate) * &by_rate + at_rest).partial_piv_lu();
        let (reduced, basis) = hessenberg(lu.solve(&by_rate));
        let driven =
            [&rows.by_rate, &rows.at_rest].map(|of| faer::Scale(-1.0) * (basis.transpose() * lu.solve(by(of))));
        Self { shift: rate, reduced, basis, driven }
    }

    /// f of Qᵀf.
    pub fn back(&self, turned: &Mat<C>) -> Mat<C> {
        real_times(&self.basis, turned)
    }

    /// Rows of a matrix `own`, `[rows, nf]`, in the basis that [`turned`](Self::turned) has f in.
    pub fn onto(&self, own: MatRef<'_, f64>) -> Mat<f64> {
        own * &self.basis
    }

    /// Qᵀf per y, `[nf, r]`.
    pub fn turned(&self, lambda: C) -> Mat<C> {
        let (nf, r) = self.driven[0].shape();
        let beyond = lambda - self.shift;
        let mut matrix = Mat::<C>::zeros(nf, nf);
        for j in 0..nf {
            let last = (j + 2).min(nf);
            let from = &self.reduced.col_as_slice(j)[..last];
            matrix.col_as_slice_mut(j)[..last].iter_mut().zip(from).for_each(|(v, h)| *v = beyond * h);
            matrix[(j, j)] += 1.0;
        }
        let mut x = Mat::from_fn(nf, r, |i, j| lambda * self.driven[0][(i, j)] + self.driven[1][(i, j)]);
        eliminate(&mut matrix, &mut x);
        solve_upper_triangular_in_place(matrix.as_ref(), x.as_mut(), Par::Seq);
        x
    }
}

/// Makes `matrix`, which has one diagonal below the main one, triangular, the larger row of two first; the rows of
/// `x` go with it.
fn eliminate(matrix: &mut Mat<C>, x: &mut Mat<C>) {
    let n = matrix.nrows();
    // Multipliers and exchanges of all rows first, column by column.
    let mut steps: Vec<(bool, C)> = Vec::with_capacity(n.saturating_sub(1));
    for j in 0..n {
        let column = matrix.col_as_slice_mut(j);
        apply(&steps, &mut column[..j + 1]);
        if j + 1 == n {
            break;
        }
        let swap = column[j + 1].norm_sqr() > column[j].norm_sqr();
        if swap {
            column.swap(j, j + 1);
        }
        let factor = if column[j] == C::default() { C::default() } else { column[j + 1] / column[j] };
        column[j + 1] = C::default();
        steps.push((swap, factor));
    }
    for j in 0..x.ncols() {
        apply(&steps, x.col_as_slice_mut(j));
    }
}

/// The steps of an elimination on a column, each on a row and the next one.
fn apply(steps: &[(bool, C)], column: &mut [C]) {
    for (k, &(swap, factor)) in steps.iter().enumerate() {
        if swap {
            column.swap(k, k + 1);
        }
        let above = column[k];
        column[k + 1] -= factor * above;
    }
}

/// H and Q of a matrix Q H Qᵀ.
fn hessenberg(mut matrix: Mat<f64>) -> (Mat<f64>, Mat<f64>) {
    let n = matrix.nrows();
    let mut basis = Mat::<f64>::identity(n, n);
    if n < 3 {
        return (matrix, basis);
    }
    let params = Spec::new(<HessenbergParams as Auto<f64>>::auto());
    let scratch = hessenberg_in_place_scratch::<f64>(n, BLOCK, Par::Seq, params)
        .or(apply_block_householder_sequence_on_the_right_in_place_scratch::<f64>(n - 1, BLOCK, n - 1));
    let mut memory = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut memory);
    let mut reflections = Mat::<f64>::zeros(BLOCK, n - 1);
    hessenberg_in_place(matrix.as_mut(), reflections.as_mut(), Par::Seq, stack, params);
    apply_block_householder_sequence_on_the_right_in_place_with_conj(
        matrix.as_ref().submatrix(1, 0, n - 1, n - 1),
        reflections.as_ref(),
        Conj::No,
        basis.as_mut().submatrix_mut(1, 1, n - 1, n - 1),
        Par::Seq,
        stack,
    );
    for j in 0..n {
        (j + 2..n).for_each(|i| matrix[(i, j)] = 0.0);
    }
    (matrix, basis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknowns_follow() {
        for n in [1, 2, 3, 40] {
            let r = 3;
            let part =
                |seed: f64| Mat::from_fn(n, r + n, |i, j| ((3.1 + seed) * i as f64 + 7.7 * j as f64 * seed).sin());
            let mut rows = ContactRows { by_rate: part(1.0), at_rest: part(1.3), forces: Mat::zeros(r, r + n) };
            (0..n).for_each(|i| rows.at_rest[(i, r + i)] += 6.0);
            let following = Following::new(&rows, r, 2.0);
            for lambda in [C::new(-0.3, 4.0), C::new(0.0, 0.01), C::new(1.0, 90.0)] {
                let all = |i: usize, j: usize| lambda * rows.by_rate[(i, j)] + rows.at_rest[(i, j)];
                let own = Mat::from_fn(n, n, |i, j| all(i, r + j));
                let left = &own * following.back(&following.turned(lambda)) + Mat::from_fn(n, r, all);
                assert!(left.norm_l2() < 1e-11 * own.norm_l2(), "{n}, {lambda}: {}", left.norm_l2());
            }
        }
    }
}
