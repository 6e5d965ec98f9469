//! Vectorised sums: pole-residue sums of modes and poles of a body in λ, and corrections of one root by the others.

use super::C;
use pulp::{Arch, Simd, WithSimd};

/// Numbers that are added up side by side.
const LANES: usize = 8;

/// Terms of G of a body, each with columns of residues of its own: first the modes by themselves, 1/(λ² + cλ + k); then
/// real poles, 1/(λ − p); then pairs of poles, (λ − Re p)/|..|², where |..|² stands for (λ − p)(λ − p̄); and last those
/// pairs once more, Im p/|..|².
#[derive(Default)]
pub(super) struct PoleSums {
    /// k and c.
    pub singles: [Vec<f64>; 2],
    pub real: Vec<f64>,
    /// Re p and Im p > 0.
    pub pairs: [Vec<f64>; 2],
}

impl PoleSums {
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
    terms: &'a PoleSums,
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
        let (l_re, l_im) = (lambda.re, lambda.im);
        let (k, c) = (&terms.singles[0][..first], &terms.singles[1][..first]);
        let (own_re, own_im) = (&mut out_re[..first], &mut out_im[..first]);
        for i in 0..first {
            // λ (λ + c) + k.
            let x = l_re + c[i];
            let (a, b) = (l_re * x - l_im * l_im + k[i], l_im * (l_re + x));
            let size = 1.0 / (a * a + b * b);
            own_re[i] = a * size;
            own_im[i] = -b * size;
        }
        slope += 2.0 * lambda * C::new(sum(own_re), sum(own_im)) + C::new(product(c, own_re), product(c, own_im));
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
        let singles = terms.singles[0].len();
        let (own_re, own_im) = (&out_re[..singles], &out_im[..singles]);
        let (into_re, into_im) = (&mut by_re[..singles], &mut by_im[..singles]);
        for i in 0..singles {
            // −(2λ + c)/(λ² + cλ + k)².
            let (x, y) = (2.0 * l_re + c[i], 2.0 * l_im);
            let (a, b) = (own_re[i] * own_re[i] - own_im[i] * own_im[i], 2.0 * own_re[i] * own_im[i]);
            into_re[i] = y * b - x * a;
            into_im[i] = -(x * b + y * a);
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

/// aᵀb.
#[inline(always)]
fn product(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let both = a.chunks_exact(LANES).zip(b.chunks_exact(LANES));
    for (a, b) in both {
        for k in 0..LANES {
            lanes[k] += a[k] * b[k];
        }
    }
    let first = a.len() - a.len() % LANES;
    let rest: f64 = a[first..].iter().zip(&b[first..]).map(|(a, b)| a * b).sum();
    rest + lanes.iter().sum::<f64>()
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

/// Factors that are multiplied before a logarithm is taken.
const FACTORS: usize = 64;
/// Least size of such a product, below which digits are lost.
const LEAST: f64 = 1e-290;

/// Π (λ − p)(λ − p̄) / Π (λ − z)(λ − z̄) of as many poles p as roots z.
pub(super) struct DeflationQuotient {
    /// Real and imaginary parts of both, ascending by their sizes, so that neighbours nearly cancel.
    poles: [Vec<f64>; 2],
    roots: [Vec<f64>; 2],
}

impl DeflationQuotient {
    pub fn new(poles: &[C], roots: &[C]) -> Self {
        let sorted = |of: &[C]| {
            let mut all = of.to_vec();
            all.sort_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr()));
            [all.iter().map(|v| v.re).collect(), all.iter().map(|v| v.im).collect()]
        };
        Self { poles: sorted(poles), roots: sorted(roots) }
    }

    /// Its logarithm, the imaginary part up to a multiple of 2π.
    pub fn logarithm(&self, lambda: C) -> C {
        let count = self.poles[0].len().min(self.roots[0].len());
        let mut sum = C::default();
        for first in (0..count).step_by(FACTORS) {
            let end = (first + FACTORS).min(count);
            let [a, b, c, d] = [&self.poles[0], &self.poles[1], &self.roots[0], &self.roots[1]].map(|v| &v[first..end]);
            let product = Arch::new().dispatch(Factors { lambda, poles: [a, b], roots: [c, d] });
            let size = product.re.abs() + product.im.abs();
            sum += match size.is_finite() && size > LEAST {
                true => product.ln(),
                // Beyond the range of numbers one by one.
                false => {
                    let one = |re: &f64, im: &f64| {
                        let v = C::new(*re, *im);
                        (lambda - v).ln() + (lambda - v.conj()).ln()
                    };
                    let all = |re: &[f64], im: &[f64]| re.iter().zip(im).map(|(re, im)| one(re, im)).sum::<C>();
                    all(a, b) - all(c, d)
                }
            };
        }
        sum
    }
}

struct Factors<'a> {
    lambda: C,
    poles: [&'a [f64]; 2],
    roots: [&'a [f64]; 2],
}

impl WithSimd for Factors<'_> {
    type Output = C;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> C {
        let Self { lambda, poles: [p_re, p_im], roots: [z_re, z_im] } = self;
        let n = p_re.len();
        let (p_im, z_re, z_im) = (&p_im[..n], &z_re[..n], &z_im[..n]);
        // (λ − v)(λ − v̄).
        let both = |re: f64, im: f64| {
            let x = lambda.re - re;
            (x * x - (lambda.im - im) * (lambda.im + im), 2.0 * x * lambda.im)
        };
        let quotient = |k: usize| {
            let ((a, b), (c, d)) = (both(p_re[k], p_im[k]), both(z_re[k], z_im[k]));
            let size = 1.0 / (c * c + d * d);
            ((a * c + b * d) * size, (b * c - a * d) * size)
        };
        let mut lanes = [[1.0; LANES], [0.0; LANES]];
        for first in (0..n - n % LANES).step_by(LANES) {
            for k in 0..LANES {
                let (re, im) = quotient(first + k);
                let (x, y) = (lanes[0][k], lanes[1][k]);
                lanes[0][k] = x * re - y * im;
                lanes[1][k] = x * im + y * re;
            }
        }
        let rest: C = (n - n % LANES..n).map(quotient).map(|(re, im)| C::new(re, im)).product();
        rest * (0..LANES).map(|k| C::new(lanes[0][k], lanes[1][k])).product::<C>()
    }
}

/// Roots with what each of them is pushed away by.
pub(super) struct AberthSums {
    re: Vec<f64>,
    im: Vec<f64>,
}

impl AberthSums {
    pub fn new(all: &[C]) -> Self {
        Self { re: all.iter().map(|v| v.re).collect(), im: all.iter().map(|v| v.im).collect() }
    }

    /// Contribution of the other roots, and of the conjugates of all, to the logarithmic derivative at number `j`.
    pub fn attraction(&self, j: usize) -> C {
        Arch::new().dispatch(Attraction { of: self, j })
    }
}

struct Attraction<'a> {
    of: &'a AberthSums,
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
        let terms = PoleSums {
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

    /// Beside a pole, on the axis, far away, and beyond the range of numbers.
    #[test]
    fn quotients_are_those_of_logarithms() {
        let list = |count: usize, shift: f64| -> Vec<C> {
            (0..count).map(|i| C::new(-0.01 * (i % 7) as f64, 1.0 + shift + 0.3 * i as f64)).collect()
        };
        for (count, unit) in [(3, 1.0), (64, 1.0), (201, 1.0), (201, 1e200)] {
            let (poles, mut roots) = (list(count, 0.0), list(count, 0.01));
            roots.reverse();
            roots.iter_mut().for_each(|v| *v *= unit);
            let quotient = DeflationQuotient::new(&poles, &roots);
            for lambda in [C::new(1e-9, 1.3 - 1e-9), C::new(0.0, 2.05), C::new(40.0, 3.0)] {
                let one = |v: &C| (lambda - v).ln() + (lambda - v.conj()).ln();
                let want = poles.iter().map(one).sum::<C>() - roots.iter().map(one).sum::<C>();
                let off = quotient.logarithm(lambda) - want;
                let turns = off.im / (2.0 * std::f64::consts::PI);
                assert!(off.re.abs() < 1e-10 * (1.0 + want.re.abs()), "{count}, {unit}, {lambda}: {off}");
                assert!((turns - turns.round()).abs() < 1e-10, "{count}, {unit}, {lambda}: {off}");
            }
        }
    }

    #[test]
    fn all_others_push() {
        let all: Vec<C> = (0..29).map(|i| C::new(-0.1 * f64::from(i % 5), 1.0 + 0.7 * f64::from(i))).collect();
        let charges = AberthSums::new(&all);
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
