//! Resolvent of the contact rows: unknowns f of the contact under given motions y, at one λ after the other.
//!
//! With a real shift σ, (λA + C)⁻¹ = (1 + (λ − σ) M)⁻¹ (σA + C)⁻¹, M = (σA + C)⁻¹ A = Q H Qᵀ: of the matrix H, which
//! is triangular but for one more diagonal, a frequency asks for n² operations and the memory of a few columns.

use super::modal_compliance::real_times;
use super::{ContactRows, C};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::hessenberg::{hessenberg_in_place, hessenberg_in_place_scratch, HessenbergParams};
use faer::linalg::householder::{
    apply_block_householder_sequence_on_the_right_in_place_scratch,
    apply_block_householder_sequence_on_the_right_in_place_with_conj,
};
use faer::linalg::solvers::Solve;
use faer::{Auto, Conj, Mat, MatRef, Par, Spec};
use pulp::{Arch, Simd, WithSimd};

/// Reflections that are applied at once.
const BLOCK: usize = 16;

/// f of y at any λ.
pub(super) struct ContactResolvent {
    /// σ, 1/s.
    shift: f64,
    /// H, `[nf, nf]`.
    hessenberg: Mat<f64>,
    /// Q, `[nf, nf]`.
    basis: Mat<f64>,
    /// −Qᵀ (σA + C)⁻¹ of what y adds to the rows by its rate and at rest, `[nf, r]` each.
    driven: [Mat<f64>; 2],
}

impl ContactResolvent {
    /// Tracker of rows of one size; frequencies are of the order of `rate`.
    pub fn new(rows: &ContactRows, rank: usize, rate: f64) -> Self {
        let nf = rows.by_rate.nrows();
        let own = |of: &Mat<f64>| of.as_ref().subcols(rank, nf).to_owned();
        let by = |of: &Mat<f64>| of.as_ref().subcols(0, rank).to_owned();
        let (by_rate, at_rest) = (own(&rows.by_rate), own(&rows.at_rest));
        let lu = (faer::Scale(rate) * &by_rate + at_rest).partial_piv_lu();
        let (hessenberg, basis) = hessenberg_form(lu.solve(&by_rate));
        let driven =
            [&rows.by_rate, &rows.at_rest].map(|of| faer::Scale(-1.0) * (basis.transpose() * lu.solve(by(of))));
        Self { shift: rate, hessenberg, basis, driven }
    }

    /// f of Qᵀf.
    pub fn expand(&self, projected: &Mat<C>) -> Mat<C> {
        real_times(&self.basis, projected)
    }

    /// Rows of a matrix `own`, `[rows, nf]`, in the basis that [`solve`](Self::solve) has f in.
    pub fn project(&self, own: MatRef<'_, f64>) -> Mat<f64> {
        own * &self.basis
    }

    /// Qᵀf per y, `[nf, r]`.
    pub fn solve(&self, lambda: C) -> Mat<C> {
        let (nf, r) = self.driven[0].shape();
        let at = |i: usize, j: usize| lambda * self.driven[0][(i, j)] + self.driven[1][(i, j)];
        self.shifted_solve(lambda, Planar::from_fn(nf, r, at))
    }

    /// Qᵀf of each of `values` with the motions y in `motions`, `[nf, values]`.
    pub fn solve_each(&self, values: &[C], motions: &Mat<C>) -> Mat<C> {
        let [by_rate, at_rest] = self.driven.each_ref().map(|of| real_times(of, motions));
        let mut all = Mat::zeros(by_rate.nrows(), values.len());
        for (l, &lambda) in values.iter().enumerate() {
            let at = |i: usize, _: usize| lambda * by_rate[(i, l)] + at_rest[(i, l)];
            all.as_mut()
                .subcols_mut(l, 1)
                .copy_from(self.shifted_solve(lambda, Planar::from_fn(by_rate.nrows(), 1, at)));
        }
        all
    }

    /// (1 + (λ − σ) H)⁻¹ of some columns.
    fn shifted_solve(&self, lambda: C, columns: Planar) -> Mat<C> {
        Arch::new().dispatch(Shifted { matrix: &self.hessenberg, shift: lambda - self.shift, columns })
    }
}

/// Complex columns by their real and imaginary parts, one column after the other.
struct Planar {
    re: Vec<f64>,
    im: Vec<f64>,
    columns: usize,
}

impl Planar {
    fn from_fn(rows: usize, columns: usize, at: impl Fn(usize, usize) -> C) -> Self {
        let (re, im) = (0..rows * columns).map(|k| at(k % rows, k / rows)).map(|v| (v.re, v.im)).unzip();
        Self { re, im, columns }
    }
}

/// (1 + sH)⁻¹ b of a matrix H that is triangular but for one more diagonal, by rotations of its columns from the last
/// one on, (1 + sH) Q = R: each column of R is done with as soon as it is made (G. Henry, The shifted Hessenberg system
/// solve computation, Cornell Theory Center, 1994).
struct Shifted<'a> {
    matrix: &'a Mat<f64>,
    shift: C,
    columns: Planar,
}

impl WithSimd for Shifted<'_> {
    type Output = Mat<C>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Mat<C> {
        let Self { matrix, shift, columns: Planar { re: mut b_re, im: mut b_im, columns } } = self;
        let n = matrix.nrows();
        if n == 0 {
            return Mat::zeros(0, columns);
        }
        // The column that the next rotation acts on, and a column of R.
        let last = matrix.col_as_slice(n - 1);
        let mut now_re: Vec<f64> = last.iter().map(|h| shift.re * h).collect();
        let mut now_im: Vec<f64> = last.iter().map(|h| shift.im * h).collect();
        now_re[n - 1] += 1.0;
        let (mut r_re, mut r_im) = (vec![0.0; n], vec![0.0; n]);
        let mut rotations = vec![[C::default(); 2]; n];
        for k in (1..n).rev() {
            let before = &matrix.col_as_slice(k - 1)[..=k];
            // Of the row k the rotation leaves nothing before the diagonal.
            let (alpha, beta) = (shift * before[k], C::new(now_re[k], now_im[k]));
            let size = (alpha.norm_sqr() + beta.norm_sqr()).sqrt();
            let (alpha, beta) = (alpha / size, beta / size);
            rotations[k] = [alpha, beta];
            let (p, q, t, w) = (alpha.conj() * shift, beta.conj(), beta * shift, alpha);
            let (v_re, v_im) = (&mut now_re[..k], &mut now_im[..k]);
            let (into_re, into_im) = (&mut r_re[..k], &mut r_im[..k]);
            let turned = ([&mut *v_re, &mut *v_im], [&mut *into_re, &mut *into_im]);
            rotate(simd, [p, q, t, -w], &before[..k], turned);
            // The unit on the diagonal of the column before.
            into_re[k - 1] += alpha.re;
            into_im[k - 1] -= alpha.im;
            v_re[k - 1] += beta.re;
            v_im[k - 1] += beta.im;
            let own = b_re.chunks_exact_mut(n).zip(b_im.chunks_exact_mut(n));
            for (re, im) in own {
                let (x, y) = (re[k] / size, im[k] / size);
                (re[k], im[k]) = (x, y);
                eliminate(simd, C::new(x, y), [into_re, into_im], [&mut re[..k], &mut im[..k]]);
            }
        }
        let first = C::new(now_re[0], now_im[0]).inv();
        for j in 0..columns {
            let x = C::new(b_re[j * n], b_im[j * n]) * first;
            (b_re[j * n], b_im[j * n]) = (x.re, x.im);
        }
        let mut out = Mat::zeros(n, columns);
        for j in 0..columns {
            let column = out.col_as_slice_mut(j);
            let mut above = C::new(b_re[j * n], b_im[j * n]);
            for k in 1..n {
                let ([alpha, beta], own) = (rotations[k], C::new(b_re[j * n + k], b_im[j * n + k]));
                column[k - 1] = beta * above + alpha.conj() * own;
                above = beta.conj() * own - alpha * above;
            }
            column[n - 1] = above;
        }
        out
    }
}

/// A real column h and a complex one v become p h + q v, which goes `into` another one, and t h + w v, which stays;
/// columns by their real and imaginary parts.
#[inline(always)]
fn rotate<S: Simd>(simd: S, factors: [C; 4], h: &[f64], (v, into): ([&mut [f64]; 2], [&mut [f64]; 2])) {
    let (h, h_rest) = S::as_simd_f64s(h);
    let ([v_re, v_im], [into_re, into_im]) = (v.map(S::as_mut_simd_f64s), into.map(S::as_mut_simd_f64s));
    let [p, q, t, w] = factors.map(|f| [f.re, f.im, -f.im].map(|f| simd.splat_f64s(f)));
    let add = |a, b, c| simd.mul_add_e_f64s(a, b, c);
    let columns = v_re.0.iter_mut().zip(v_im.0).zip(into_re.0.iter_mut().zip(into_im.0)).zip(h);
    for (((v_re, v_im), (into_re, into_im)), h) in columns {
        let (x, y) = (*v_re, *v_im);
        *into_re = add(q[2], y, add(q[0], x, simd.mul_f64s(p[0], *h)));
        *into_im = add(q[1], x, add(q[0], y, simd.mul_f64s(p[1], *h)));
        *v_re = add(w[2], y, add(w[0], x, simd.mul_f64s(t[0], *h)));
        *v_im = add(w[1], x, add(w[0], y, simd.mul_f64s(t[1], *h)));
    }
    let [p, q, t, w] = factors;
    let columns = v_re.1.iter_mut().zip(v_im.1).zip(into_re.1.iter_mut().zip(into_im.1)).zip(h_rest);
    for (((v_re, v_im), (into_re, into_im)), h) in columns {
        let v = C::new(*v_re, *v_im);
        let (to, stays) = (p * h + q * v, t * h + w * v);
        (*into_re, *into_im, *v_re, *v_im) = (to.re, to.im, stays.re, stays.im);
    }
}

/// A complex column `out` less a number times another one, by their real and imaginary parts.
#[inline(always)]
fn eliminate<S: Simd>(simd: S, factor: C, [re, im]: [&[f64]; 2], [out_re, out_im]: [&mut [f64]; 2]) {
    let ((re, re_rest), (im, im_rest)) = (S::as_simd_f64s(re), S::as_simd_f64s(im));
    let ((out_re, out_re_rest), (out_im, out_im_rest)) = (S::as_mut_simd_f64s(out_re), S::as_mut_simd_f64s(out_im));
    let [y, minus_x, minus_y] = [factor.im, -factor.re, -factor.im].map(|f| simd.splat_f64s(f));
    let add = |a, b, c| simd.mul_add_e_f64s(a, b, c);
    for ((out_re, out_im), (re, im)) in out_re.iter_mut().zip(out_im).zip(re.iter().zip(im)) {
        *out_re = add(minus_x, *re, add(y, *im, *out_re));
        *out_im = add(minus_x, *im, add(minus_y, *re, *out_im));
    }
    for ((out_re, out_im), (re, im)) in out_re_rest.iter_mut().zip(out_im_rest).zip(re_rest.iter().zip(im_rest)) {
        *out_re -= factor.re * re - factor.im * im;
        *out_im -= factor.re * im + factor.im * re;
    }
}

/// H and Q of a matrix Q H Qᵀ.
fn hessenberg_form(mut matrix: Mat<f64>) -> (Mat<f64>, Mat<f64>) {
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
    fn resolvent_solves_the_contact_rows() {
        for n in [1, 2, 3, 40] {
            let r = 3;
            let part =
                |seed: f64| Mat::from_fn(n, r + n, |i, j| ((3.1 + seed) * i as f64 + 7.7 * j as f64 * seed).sin());
            let mut rows = ContactRows { by_rate: part(1.0), at_rest: part(1.3), forces: Mat::zeros(r, r + n) };
            (0..n).for_each(|i| rows.at_rest[(i, r + i)] += 6.0);
            let resolvent = ContactResolvent::new(&rows, r, 2.0);
            for lambda in [C::new(-0.3, 4.0), C::new(0.0, 0.01), C::new(1.0, 90.0)] {
                let all = |i: usize, j: usize| lambda * rows.by_rate[(i, j)] + rows.at_rest[(i, j)];
                let own = Mat::from_fn(n, n, |i, j| all(i, r + j));
                let left = &own * resolvent.expand(&resolvent.solve(lambda)) + Mat::from_fn(n, r, all);
                assert!(left.norm_l2() < 1e-11 * own.norm_l2(), "{n}, {lambda}: {}", left.norm_l2());
            }
        }
    }
}
