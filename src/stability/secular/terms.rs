//! Vectorised sums: pole-residue sums of modes and poles of a body in λ, and corrections of one root by the others.

use super::C;
use pulp::{Arch, Simd, WithSimd};

/// Numbers that are added up side by side.
const LANES: usize = 8;

/// Terms of G of a body, each with columns of residues of its own: first the modes by themselves, 1/(λ² + cλ + k); then
/// real poles, 1/(λ − p); then pairs of poles, (λ − Re p)/|..|², where |..|² stands for (λ − p)(λ − p̄); and last those
/// pairs once more, Im p/|..|².
#[derive(Default)]
pub(super) struct Terms {
    /// k and c.
    pub singles: [Vec<f64>; 2],
    pub real: Vec<f64>,
    /// Re p and Im p > 0.
    pub pairs: [Vec<f64>; 2],
}

impl Terms {
    /// Columns of residues.
    pub fn columns(&self) -> usize {
        self.singles[0].len() + self.real.len() + 2 * self.pairs[0].len()
    }

    /// Column of a real pole.
    pub fn of_real(&self, number: usize) -> usize {
        self.singles[0].len() + number
    }

    /// Both columns of a pair of poles.
    pub fn of_pair(&self, number: usize) -> [usize; 2] {
        let first = self.of_real(self.real.len()) + number;
        [first, first + self.pairs[0].len()]
    }

    /// Shares of all at λ, real and imaginary parts, and those of their derivatives where `out` has four lists, of
    /// `columns` each; and what they have of the logarithmic derivative of P.
    pub fn evaluate(&self, lambda: C, out: &mut [&mut [f64]]) -> C {
        let [re, im, more @ ..] = out else { return C::default() };
        let derivatives = match more {
            [re, im] => Some([&mut **re, &mut **im]),
            _ => None,
        };
        Arch::new().dispatch(Shares { terms: self, lambda, out: [re, im], derivatives })
    }
}

struct Shares<'a> {
    terms: &'a Terms,
    lambda: C,
    out: [&'a mut [f64]; 2],
    derivatives: Option<[&'a mut [f64]; 2]>,
}

impl WithSimd for Shares<'_> {
    type Output = C;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> C {
        let Self { terms, lambda, out: [out_re, out_im], derivatives } = self;
        let mut slope = C::default();
        let first = terms.singles[0].len();
        for i in 0..first {
            let share = (lambda * (lambda + terms.singles[1][i]) + terms.singles[0][i]).inv();
            slope += (2.0 * lambda + terms.singles[1][i]) * share;
            (out_re[i], out_im[i]) = (share.re, share.im);
        }
        for (i, p) in terms.real.iter().enumerate() {
            let share = (lambda - p).inv();
            slope += share;
            (out_re[first + i], out_im[first + i]) = (share.re, share.im);
        }
        let first = first + terms.real.len();
        let n = terms.pairs[0].len();
        let (re, im) = (&terms.pairs[0][..n], &terms.pairs[1][..n]);
        let ((along_re, aside_re), (along_im, aside_im)) =
            (out_re[first..first + 2 * n].split_at_mut(n), out_im[first..first + 2 * n].split_at_mut(n));
        let (l_re, l_im) = (lambda.re, lambda.im);
        // |..|² by its factors: near a pole one of them is small.
        let share = |re: f64, im: f64| {
            let (x, below, above) = (l_re - re, l_im - im, l_im + im);
            let (a, b) = (x * x - below * above, 2.0 * x * l_im);
            let size = 1.0 / (a * a + b * b);
            (x, a * size, -b * size)
        };
        for i in 0..n {
            let (x, s_re, s_im) = share(re[i], im[i]);
            along_re[i] = x * s_re - l_im * s_im;
            along_im[i] = x * s_im + l_im * s_re;
            aside_re[i] = im[i] * s_re;
            aside_im[i] = im[i] * s_im;
        }
        slope += 2.0 * C::new(sum(along_re), sum(along_im));
        let Some([by_re, by_im]) = derivatives else { return slope };
        for i in 0..terms.singles[0].len() {
            let share = C::new(out_re[i], out_im[i]);
            let by = -(2.0 * lambda + terms.singles[1][i]) * share * share;
            (by_re[i], by_im[i]) = (by.re, by.im);
        }
        for i in terms.singles[0].len()..first {
            let share = C::new(out_re[i], out_im[i]);
            let by = -share * share;
            (by_re[i], by_im[i]) = (by.re, by.im);
        }
        let ((along_re, aside_re), (along_im, aside_im)) =
            (by_re[first..first + 2 * n].split_at_mut(n), by_im[first..first + 2 * n].split_at_mut(n));
        for i in 0..n {
            let (x, s_re, s_im) = share(re[i], im[i]);
            // −2 (λ − Re p)/|..|⁴.
            let (a_re, a_im) = (x * s_re - l_im * s_im, x * s_im + l_im * s_re);
            let (f_re, f_im) = (-2.0 * (a_re * s_re - a_im * s_im), -2.0 * (a_re * s_im + a_im * s_re));
            along_re[i] = s_re + x * f_re - l_im * f_im;
            along_im[i] = s_im + x * f_im + l_im * f_re;
            aside_re[i] = im[i] * f_re;
            aside_im[i] = im[i] * f_im;
        }
        slope
    }
}

#[inline(always)]
fn sum(of: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let chunks = of.chunks_exact(LANES);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        lanes.iter_mut().zip(chunk).for_each(|(a, v)| *a += v);
    }
    rest + lanes.iter().sum::<f64>()
}

/// Roots with what each of them is pushed away by.
pub(super) struct Charges {
    re: Vec<f64>,
    im: Vec<f64>,
}

impl Charges {
    pub fn new(all: &[C]) -> Self {
        Self { re: all.iter().map(|v| v.re).collect(), im: all.iter().map(|v| v.im).collect() }
    }

    /// Contribution of the other roots, and of the conjugates of all, to the logarithmic derivative at number `j`.
    pub fn attraction(&self, j: usize) -> C {
        Arch::new().dispatch(Attraction { of: self, j })
    }
}

struct Attraction<'a> {
    of: &'a Charges,
    j: usize,
}

impl WithSimd for Attraction<'_> {
    type Output = C;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> C {
        let (re, im, j) = (&self.of.re[..], &self.of.im[..], self.j);
        let n = re.len();
        let own = (re[j], im[j]);
        let others = inverses(own, (&re[..j], &im[..j]), 1.0) + inverses(own, (&re[j + 1..n], &im[j + 1..n]), 1.0);
        others + inverses(own, (re, im), -1.0)
    }
}

/// The sum of the inverses of the distances from each of `from`, whose imaginary parts are taken `sign` times, to a
/// place.
#[inline(always)]
fn inverses((x, y): (f64, f64), (re, im): (&[f64], &[f64]), sign: f64) -> C {
    let one = |re: f64, im: f64| {
        let (a, b) = (x - re, y - sign * im);
        let size = 1.0 / (a * a + b * b);
        (a * size, -b * size)
    };
    let mut lanes = [[0.0; LANES]; 2];
    let both = re.chunks_exact(LANES).zip(im.chunks_exact(LANES));
    for (re, im) in both {
        for k in 0..LANES {
            let (a, b) = one(re[k], im[k]);
            lanes[0][k] += a;
            lanes[1][k] += b;
        }
    }
    let [mut sum_re, mut sum_im] = lanes.map(|l| l.iter().sum::<f64>());
    for k in re.len() - re.len() % LANES..re.len() {
        let (a, b) = one(re[k], im[k]);
        sum_re += a;
        sum_im += b;
    }
    C::new(sum_re, sum_im)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_each() {
        let terms = Terms {
            singles: [vec![4.0, 9.0], vec![0.1, 0.2]],
            real: vec![-3.0, -0.5],
            pairs: [
                (0..19).map(|i| -0.01 * f64::from(i)).collect(),
                (0..19).map(|i| 1.0 + 0.3 * f64::from(i)).collect(),
            ],
        };
        let n = terms.columns();
        assert_eq!((n, terms.of_real(1), terms.of_pair(2)), (42, 3, [6, 25]));
        // Beside a pole, on the axis, far away.
        for lambda in [C::new(-0.01 + 1e-9, 1.3 - 1e-9), C::new(0.0, 2.05), C::new(40.0, 3.0)] {
            let shares = |lambda: C| {
                let mut out = vec![vec![0.0; n]; 4];
                let mut all: Vec<&mut [f64]> = out.iter_mut().map(|v| &mut v[..]).collect();
                let slope = terms.evaluate(lambda, &mut all);
                (out, slope)
            };
            let (out, slope) = shares(lambda);
            let mut want = vec![[C::default(); 2]; n];
            let mut sum = C::default();
            for i in 0..2 {
                let (k, c) = (terms.singles[0][i], terms.singles[1][i]);
                let s = (lambda * lambda + c * lambda + k).inv();
                want[i] = [s, -(2.0 * lambda + c) * s * s];
                sum += (2.0 * lambda + c) * s;
                let s = (lambda - terms.real[i]).inv();
                want[terms.of_real(i)] = [s, -s * s];
                sum += s;
            }
            for i in 0..19 {
                let p = C::new(terms.pairs[0][i], terms.pairs[1][i]);
                let [a, b] = [p, p.conj()].map(|p| (lambda - p).inv());
                // 1/(λ − p) ± 1/(λ − p̄).
                let [along, aside] = terms.of_pair(i);
                want[along] = [0.5 * (a + b), -0.5 * (a * a + b * b)];
                want[aside] = [C::new(0.0, -0.5) * (a - b), C::new(0.0, 0.5) * (a * a - b * b)];
                sum += a + b;
            }
            let mut few = vec![vec![0.0; n]; 2];
            let mut parts: Vec<&mut [f64]> = few.iter_mut().map(|v| &mut v[..]).collect();
            assert_eq!(terms.evaluate(lambda, &mut parts), slope);
            assert_eq!(few, out[..2]);
            for (i, [share, by]) in want.iter().enumerate() {
                let found = [0, 2].map(|k| C::new(out[k][i], out[k + 1][i]));
                assert!(
                    (found[0] - share).norm() < 1e-14 * (1.0 + share.norm()),
                    "{lambda}, {i}: {} {share}",
                    found[0]
                );
                assert!((found[1] - by).norm() < 1e-14 * (1.0 + by.norm()), "{lambda}, {i}: {} {by}", found[1]);
            }
            assert!((slope - sum).norm() < 1e-13 * sum.norm(), "{slope} {sum}");
        }
    }

    #[test]
    fn all_others_push() {
        let all: Vec<C> = (0..29).map(|i| C::new(-0.1 * f64::from(i % 5), 1.0 + 0.7 * f64::from(i))).collect();
        let charges = Charges::new(&all);
        for j in [0, 3, 28] {
            let of = |k: usize| {
                let other = if k == j { C::default() } else { (all[j] - all[k]).inv() };
                other + (all[j] - all[k].conj()).inv()
            };
            let want: C = (0..all.len()).map(of).sum();
            assert!((charges.attraction(j) - want).norm() < 1e-14 * want.norm());
        }
    }
}
